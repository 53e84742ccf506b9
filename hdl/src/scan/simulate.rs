//! rust-hdl's own simulation of a scan.

use dermis_golden::fixed::Model;

use super::core::scanner;
use super::pins::{ScanDevice, ScanInputs, ScanOutputs, Scanner};
use crate::error::HdlError;
use crate::simulate::settles;

struct Simulator(Box<dyn Scanner>);

/// The scan of `model` in rust-hdl's simulation.
///
/// # Errors
/// As [`super::generate_scan`].
pub fn scan_simulator(model: &Model) -> Result<Box<dyn ScanDevice>, HdlError> {
    Ok(Box::new(Simulator(scanner(model)?)))
}

impl ScanDevice for Simulator {
    fn cycle(&mut self, inputs: &ScanInputs) -> ScanOutputs {
        let mut settle = |clock: bool| {
            self.0.drive(inputs, clock);
            assert!(settles(&mut *self.0), "the scan has a combinational loop: a defect of this crate");
            self.0.pins()
        };
        let outputs = settle(false);
        settle(true);
        outputs
    }
}
