//! The hash of a type, RIHS01: SHA-256 of the type's description in JSON, which has names and types of the fields of the type and of all
//! that it uses; constants, default values and comments are not in it.
//!
//! ```text
//! .msg ── lines ── fields ── JSON, used types by name ── SHA-256 ── RIHS01_…
//! ```

use sha2::{Digest, Sha256};

/// Number of a field that is of another message type.
const NESTED: u32 = 1;
/// What the number of a list adds to that of its elements: of fixed, of bounded, of any length.
const LISTS: [u32; 3] = [48, 96, 144];
/// Types of `.msg` files that are no messages, and their numbers.
const PRIMITIVES: [(&str, u32); 15] = [
    ("int8", 2),
    ("uint8", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("char", 3),
    ("bool", 15),
    ("byte", 16),
    ("string", 17),
    ("wstring", 18),
];
/// The field of a type without one, as IDL requires it.
const NO_FIELD: &str = "uint8 structure_needs_at_least_one_member";

/// Name and text of a type.
pub type Definition = (&'static str, &'static str);

/// The type hash of the type `name` with this `text`, which uses `uses`.
///
/// ```
/// use dermis_golden::data::recording::message::type_hash::type_hash;
///
/// let published = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
/// assert_eq!(type_hash("std_msgs/msg/String", "string data # any\n", &[]), published);
/// ```
pub fn type_hash(name: &str, text: &str, uses: &[Definition]) -> String {
    let mut used: Vec<(String, String)> =
        uses.iter().map(|(name, text)| (full_name(name), description(&full_name(name), text))).collect();
    used.sort();
    let used: Vec<String> = used.into_iter().map(|(_, description)| description).collect();
    let own = description(name, text);
    let json = format!("{{\"type_description\": {own}, \"referenced_type_descriptions\": [{}]}}", used.join(", "));
    Sha256::digest(json).iter().fold("RIHS01_".to_owned(), |hash, byte| hash + &format!("{byte:02x}"))
}

/// `package/Type` of a `.msg` file as `package/msg/Type`.
fn full_name(name: &str) -> String {
    name.replacen('/', "/msg/", 1)
}

/// A type with its fields as JSON.
fn description(name: &str, text: &str) -> String {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim());
    // A constant has its value behind an equals sign.
    let mut fields: Vec<&str> = lines.filter(|line| !line.is_empty() && !line.contains('=')).collect();
    if fields.is_empty() {
        fields.push(NO_FIELD);
    }
    let fields: Vec<String> = fields.into_iter().filter_map(|line| line.split_once(' ')).map(field).collect();
    format!("{{\"type_name\": \"{name}\", \"fields\": [{}]}}", fields.join(", "))
}

/// A field as JSON.
fn field((kind, rest): (&str, &str)) -> String {
    // Behind the name may be a default value.
    let name = rest.split_whitespace().next().unwrap_or("");
    let (kind, list) = match kind.split_once('[') {
        Some((kind, bounds)) => (kind, Some(bounds.trim_end_matches(']'))),
        None => (kind, None),
    };
    let (added, capacity) = match list.map(|bounds| (bounds, bounds.trim_start_matches("<="))) {
        None => (0, "0"),
        Some(("", _)) => (LISTS[2], "0"),
        Some((bounds, length)) if bounds != length => (LISTS[1], length),
        Some((_, length)) => (LISTS[0], length),
    };
    let primitive = PRIMITIVES.iter().find(|(name, _)| *name == kind);
    let nested = if primitive.is_some() { String::new() } else { full_name(kind) };
    let number = primitive.map_or(NESTED, |(_, number)| *number) + added;
    format!(
        "{{\"name\": \"{name}\", \"type\": {{\"type_id\": {number}, \"capacity\": {capacity}, \"string_capacity\": 0, \
         \"nested_type_name\": \"{nested}\"}}}}"
    )
}

#[cfg(test)]
mod tests {
    use super::super::*;

    /// As the packages of ROS 2 publish them.
    #[test]
    fn hashes_are_those_that_are_published() {
        let published = [
            (Image::hash(), "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"),
            (PointCloud2::hash(), "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"),
            (WrenchStamped::hash(), "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"),
            (Text::hash(), "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
            (MarkerArray::hash(), "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"),
        ];
        for (own, published) in published {
            assert_eq!(own, format!("RIHS01_{published}"));
        }
    }

    #[test]
    fn every_name_type_and_length_counts_and_nothing_else() {
        let hash = |text: &str| type_hash("a/msg/B", text, &[]);
        let own = hash("float64[2] shear\n");
        assert_eq!(own, hash("# Shear in N.\nuint8 LARGEST=9\n\nfloat64[2]  shear   # x, y\n"));
        for other in [
            "float64[2] sheer",
            "float32[2] shear",
            "float64[3] shear",
            "float64[] shear",
            "float64[<=2] shear",
            "float64 shear",
        ] {
            assert_ne!(own, hash(other), "{other}");
        }
        assert_ne!(own, type_hash("a/msg/C", "float64[2] shear", &[]));
        assert_ne!(own, type_hash("a/msg/B", "float64[2] shear", &[TIME]));
    }
}
