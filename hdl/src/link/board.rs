//! A board's pins, independent of the simulator.

use crate::scan::ScanPins;
#[cfg(doc)]
use dermis_golden::spec::link_kind::LinkKind;

/// A board's output pins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardOutputs {
    /// Output pin of the link, [`LinkKind::output`].
    pub to_host: bool,
    /// LED: blinks while the clock runs.
    pub alive: bool,
    /// LED: lit while packets are received, computed or sent.
    pub busy: bool,
    /// LED: lit after a packet was dropped.
    pub error: bool,
    /// Pins of a scan; none move where codes come over the link.
    pub scan: ScanPins,
}

/// A simulated board. Its input pins are bits: those of the link, from bit 0 in the order of [`LinkKind::inputs`], then the
/// outputs of the converters of a scan.
pub trait BoardDevice: Send {
    /// Applies the link's inputs and the clock level, settles all signals and returns the outputs. The order of two
    /// clocks that change in the same call is undefined.
    fn settle(&mut self, inputs: u64, clock: bool) -> BoardOutputs;

    /// One clock cycle: applies the inputs, samples the outputs, then the rising edge.
    fn cycle(&mut self, inputs: u64) -> BoardOutputs {
        let outputs = self.settle(inputs, false);
        self.settle(inputs, true);
        outputs
    }
}
