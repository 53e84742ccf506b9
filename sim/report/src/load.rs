//! What `dermis load` prints of an image of tables.

use std::path::{Path, PathBuf};

use dermis_golden::fixed::Model;
use serde::Serialize;

/// An image of tables.
#[derive(Clone, Debug, Serialize)]
pub struct LoadReport {
    /// Name of the specimen's scene.
    pub specimen: String,
    /// The file.
    pub file: PathBuf,
    /// Its bytes.
    pub bytes: usize,
    /// Version that frames report.
    pub version: u16,
    /// CRC-32 of what the words depend on; hardware refuses an image of another layout.
    pub layout: u32,
    /// Threshold in force LSBs.
    pub threshold_lsb: i64,
    /// Noise floor in codes.
    pub noise_floor_codes: i32,
    /// Port of the board that holds the tables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub port: Option<String>,
}

impl LoadReport {
    /// Of the image of `model`, in file `path`, and in the board at `port`.
    pub fn new(model: &Model, image: &[u8], path: &Path, port: Option<&str>) -> LoadReport {
        LoadReport {
            specimen: model.scene.name.clone(),
            file: path.to_owned(),
            bytes: image.len(),
            version: model.own().version,
            layout: model.table_layout(),
            threshold_lsb: model.threshold(),
            noise_floor_codes: model.noise_floor(),
            port: port.map(str::to_owned),
        }
    }
}

/// The report in words.
pub fn load(report: &LoadReport) -> String {
    let LoadReport { specimen, file, bytes, version, layout, threshold_lsb, noise_floor_codes, port } = report;
    let board = port.as_ref().map_or(String::new(), |port| format!("board        {port} holds them\n"));
    format!(
        "{}: {bytes} bytes, tables of {specimen}, version {version}, layout 0x{layout:08x}\n\
         threshold    {threshold_lsb} LSB\n\
         noise floor  {noise_floor_codes} codes\n{board}",
        file.display()
    )
}
