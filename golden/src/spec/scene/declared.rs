//! What is known of a field of a scene file.

use serde::Serialize;
use serde_json::Value as Json;

/// A field as it is declared.
#[derive(Clone, Debug, Serialize)]
pub struct Declared {
    /// `table.field`, or `field` at the top level.
    pub path: String,
    /// The allowed values, in words.
    pub allowed: String,
    /// What a scene has without the field, a value or words; `None` where it must not be missing.
    pub without: Option<String>,
    /// Whether the hardware has it: "yes", or which values.
    pub hardware: &'static str,
    /// The page of the guide that tells more, a file name without `.md`.
    pub page: Option<&'static str>,
    /// What it means, with its unit; plain text.
    pub meaning: String,
    /// JSON schema of the value.
    pub schema: Json,
}
