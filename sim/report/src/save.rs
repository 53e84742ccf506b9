//! Writes a document's files: HTML, Markdown, JSON, a CSV per table, an SVG per picture.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, Result};

use super::data::{csv, document as json, path_of_picture, path_of_table, text};
use super::document::{Document, Item};
use super::html::html;
use super::style::standalone;
use dermis_golden::write::write;

/// Writes all files into `folder`, each completely or not at all, and deletes tables and pictures of an earlier report.
/// Tables and pictures are written before the HTML page. Returns the page's path.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn save(document: &Document, folder: &Path) -> Result<PathBuf> {
    let mut files: Vec<(String, String)> = Vec::new();
    for item in document.sections.iter().flat_map(|section| &section.items) {
        match item {
            Item::Text(_) => {}
            Item::Table(table) => files.push((path_of_table(document, &table.id), csv(table))),
            Item::Pictures(all) => {
                files
                    .extend(all.iter().map(|p| (path_of_picture(document, &p.id), standalone(&p.svg, &p.caption, ""))));
            }
        }
    }
    let own: BTreeSet<PathBuf> = files.iter().map(|(path, _)| folder.join(path)).collect();
    files.push((format!("{}.md", document.name), text(document)));
    files.push((format!("{}.json", document.name), serde_json::to_string(&json(document))? + "\n"));
    files.push((format!("{}.html", document.name), html(document)));
    for (path, text) in &files {
        let path = folder.join(path);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(|e| anyhow!("{}: {e}", parent.display()))?;
        write(&path, text.as_bytes())?;
    }
    let folders: BTreeSet<&Path> = own.iter().filter_map(|path| path.parent()).collect();
    for entry in folders.into_iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten() {
        if !own.contains(&entry.path()) {
            fs::remove_file(entry.path()).map_err(|e| anyhow!("{}: {e}", entry.path().display()))?;
        }
    }
    Ok(folder.join(format!("{}.html", document.name)))
}
