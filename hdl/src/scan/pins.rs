//! The pins of a scan, independent of the simulator.

/// Input pins of a scan in one clock cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanInputs {
    /// Synchronous reset, active high.
    pub rst: bool,
    /// `enable`: a scan may begin.
    pub enable: bool,
    /// `s_axis_tdata`: a byte of an image of tables, as a beat; without writable tables there is no such stream.
    pub s_data: i32,
    /// `s_axis_tvalid`: `s_data` is offered.
    pub s_valid: bool,
    /// `s_axis_tlast`: the byte is the image's last.
    pub s_last: bool,
    /// Outputs of the converters, bit k that of converter k.
    pub miso: u64,
    /// `m_axis_tready`: the receiver accepts a beat in this cycle.
    pub m_ready: bool,
}

/// A beat that the engine takes: a code, a byte of an image, or the early end of a scan that an image breaks off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beat {
    /// Its content.
    pub data: i32,
    /// It is the last of its frame or image.
    pub last: bool,
}

/// Pins of a scan towards the array and its converters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanPins {
    /// Address of the row that is driven.
    pub row: u64,
    /// Serial clock.
    pub sclk: bool,
    /// Chip select, active low.
    pub cs_n: bool,
    /// Commands.
    pub mosi: bool,
}

/// Output pins of a scan in one clock cycle, sampled just before the rising edge, and the beat that the engine takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanOutputs {
    /// Towards the array.
    pub pins: ScanPins,
    /// `m_axis_tvalid`: `m_data` holds a beat.
    pub m_valid: bool,
    /// `m_axis_tlast`: the beat is the last of its frame.
    pub m_last: bool,
    /// `m_axis_tdata` as `[fx, fy, fz]`, each a 32-bit signed word.
    pub m_data: [i32; 3],
    /// `s_axis_tready`: the byte of an image is accepted.
    pub s_ready: bool,
    /// The beat that the engine takes in this cycle; observation only, no pin.
    pub taken: Option<Beat>,
}

/// A simulated scan, advanced one clock cycle at a time.
pub trait ScanDevice {
    /// Applies `inputs`, samples the outputs before the rising edge, then clocks.
    fn cycle(&mut self, inputs: &ScanInputs) -> ScanOutputs;
}
