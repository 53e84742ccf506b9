//! The table of `dermis schema scene`.

use dermis_golden::spec::scene::{Declared, Scene};

use super::table::aligned;

/// A row per field of a scene.
pub fn scene_fields() -> String {
    let row = |field: &Declared| {
        let page = field.page.map_or(String::new(), |page| format!(" [{}][{page}.md]", page.replace(['/', '-'], " ")));
        vec![
            format!("`{}`", field.path),
            field.allowed.clone(),
            field.without.clone().unwrap_or_else(|| "required".to_owned()),
            field.hardware.to_owned(),
            field.meaning.clone() + &page,
        ]
    };
    aligned(5, &["field", "values", "without it", "hardware", "meaning"], Scene::fields().iter().map(row).collect())
}
