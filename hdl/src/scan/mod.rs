//! The engine behind converters that it scans by itself: `hardware.source = "adc-scan"`.
//!
//! ```text
//!  row, sclk, cs_n, mosi <── scan_sequencer ── take, done ──> scan_capture ── codes ──> engine ──> scan_status ──> m_axis
//!                                                miso ───────────^  '───── rail, other: a queue ──────^
//! ```
//! With writable tables, `scan_tables` stands before the engine and lets their images in, and `scan_codes` behind
//! `scan_status` lets the codes follow the forces.
//!
//! Nothing of it is in a scene whose codes come as a stream. The converters are [`dermis_golden::spec::adc`], the arithmetic is
//! [`dermis_golden::fixed::stages::scan`].

mod capture;
mod codes;
mod core;
mod generate;
mod pins;
mod sequencer;
mod simulate;
mod status;
mod tables;

pub use self::core::ScanCore;
pub use capture::ScanCapture;
pub use codes::ScanCodes;
pub(crate) use generate::pins_text;
pub use generate::{generate_scan, generate_scan_changed};
pub use pins::{Beat, ScanDevice, ScanInputs, ScanOutputs, ScanPins};
pub use sequencer::ScanSequencer;
pub use simulate::scan_simulator;
pub use status::ScanStatus;
pub use tables::ScanTables;

use dermis_golden::fixed::Model;
use dermis_golden::spec::adc::timing::Timing;
use dermis_golden::spec::adc::AdcScan;

use crate::error::HdlError;

/// What decides the circuits of a scan.
#[derive(Clone, Debug)]
pub struct ScanParams {
    /// Converters and averages.
    pub scan: AdcScan,
    /// Cycles.
    pub timing: Timing,
    /// Rows of the array.
    pub rows: usize,
    /// Width of a code, in bits.
    pub code_bits: u32,
    /// Dead taxels, row-major indices.
    pub dead: Vec<usize>,
}

/// Refuses a model whose hardware scans its array for `what`, a module around the engine that is fed with codes.
///
/// # Errors
/// [`HdlError::Unsupported`] for such a model.
pub(crate) fn require_stream(model: &Model, what: &'static str) -> Result<(), HdlError> {
    match model.scene.hardware.adc_scan {
        None => Ok(()),
        Some(_) => Err(HdlError::Unsupported { field: "hardware.source", value: "adc-scan".to_owned(), what }),
    }
}

impl ScanParams {
    /// The scan of `model`.
    ///
    /// # Errors
    /// [`HdlError::Unsupported`] where codes come as a stream.
    pub fn of(model: &Model) -> Result<ScanParams, HdlError> {
        let hardware = &model.scene.hardware;
        let (Some(scan), Some(timing)) = (hardware.adc_scan, model.scan_timing()) else {
            let value = "stream".to_owned();
            return Err(HdlError::Unsupported { field: "hardware.source", value, what: "a scan" });
        };
        let (rows, code_bits) = (model.scene.sensor.rows, model.formats().code_bits);
        Ok(ScanParams { scan, timing, rows, code_bits, dead: model.dead.clone() })
    }
}
