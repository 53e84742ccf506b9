//! Fields of CSV lines.

/// A text as a CSV field, quoted if it contains a comma, a quote or a line end.
pub(super) fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}
