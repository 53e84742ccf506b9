//! Plain text: doc comments where no docs of the crate are at hand, in JSON schemas, comments of Verilog, printed tables.

use schemars::generate::SchemaSettings;
use schemars::JsonSchema;
use serde_json::Value as Json;

/// A doc comment as plain text: on one line, without escapes, and without links, of which the words stay.
pub fn plain_text(doc: &[&str]) -> String {
    let doc = doc.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ");
    let (mut text, mut rest) = (String::new(), doc.as_str());
    while let Some((before, behind)) = rest.split_once('[') {
        text.push_str(before);
        let end = behind.split_once(']').filter(|_| !before.ends_with('\\'));
        let target = |tail: &'_ str| tail.strip_prefix('(').and_then(|tail| tail.find(')')).map(|end| end + 2);
        rest = match end {
            Some((words, tail)) if words.starts_with('`') || target(tail).is_some() => {
                text.push_str(words);
                &tail[target(tail).unwrap_or(0)..]
            }
            _ => {
                text.push('[');
                behind
            }
        };
    }
    (text + rest).replace("\\[", "[").replace("\\]", "]")
}

/// JSON schema (draft 2020-12) of what is read as `T` or written from it; its descriptions are the doc comments, as plain text.
pub(crate) fn json_schema<T: JsonSchema>(settings: SchemaSettings) -> Json {
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    plain_descriptions(&mut schema);
    schema
}

fn plain_descriptions(schema: &mut Json) {
    match schema {
        Json::Object(fields) => {
            for (name, value) in fields {
                match value {
                    Json::String(text) if name == "description" => {
                        *text = plain_text(&text.lines().collect::<Vec<_>>())
                    }
                    value => plain_descriptions(value),
                }
            }
        }
        Json::Array(values) => values.iter_mut().for_each(plain_descriptions),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::plain_text;

    #[test]
    fn doc_comments_become_plain_text() {
        let doc = [
            " Largest |gain|, see",
            " [`Scene`](super::Scene) and [the page](page.md), [`x`]; \\[row, col\\], [a, b].",
        ];
        assert_eq!(plain_text(&doc), "Largest |gain|, see `Scene` and the page, `x`; [row, col], [a, b].");
    }
}
