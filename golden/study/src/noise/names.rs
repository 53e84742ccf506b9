//! Names: values by their names in scene files and on the command line.

use dermis_golden::data::generator::draws::ContactShape;

/// The value with a name.
///
/// # Errors
/// For an unknown name all that are known, separated by commas.
pub fn by_name<T: Copy>(name: &str, names: &[(&str, T)]) -> Result<T, String> {
    let known = || names.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    names.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(known)
}

/// The shapes of a list: names separated by commas, `mixed`, `all` or `table`.
///
/// # Errors
/// An unknown name, with all that are known.
pub fn shapes_named(text: &str) -> Result<Vec<ContactShape>, String> {
    match text {
        "all" | "mixed" => Ok(ContactShape::NAMES.map(|(_, shape)| shape).to_vec()),
        "table" => Ok(ContactShape::TABLE.to_vec()),
        list => {
            let shape =
                |name: &str| by_name(name, &ContactShape::NAMES).map_err(|known| format!("{name:?}: one of {known}"));
            list.split(',').map(|name| shape(name.trim())).collect()
        }
    }
}
