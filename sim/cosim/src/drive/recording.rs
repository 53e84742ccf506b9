//! Input and recording of a run.

/// Input of one reconstruction, with the number of output beats expected; or an image of tables, one frame that has none.
#[derive(Clone, Copy, Debug)]
pub struct InputFrame<'a> {
    /// Codes of all frames in order, each row-major.
    pub codes: &'a [i32],
    /// Taxels per frame; `tlast` marks the last one.
    pub taxels: usize,
    /// Expected output beats, status included.
    pub beats: usize,
    /// The array that it is of; 0 where there is one.
    pub array: usize,
}

/// An output beat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beat {
    /// Cycle of the transfer.
    pub cycle: u64,
    /// `[fx, fy, fz]`.
    pub data: [i32; 3],
    /// `m_axis_tlast`.
    pub last: bool,
}

/// A word observed at a tap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapWord {
    /// Cycle in which it was valid.
    pub cycle: u64,
    /// The word's fields.
    pub fields: Vec<i64>,
}

/// A violation of the output stream's protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProtocolViolation {
    /// Cycle in which it was observed.
    pub cycle: u64,
    /// Index of the affected output beat, counted over all frames.
    pub beat: usize,
    /// The violated rule as text.
    pub rule: String,
}

/// Cycles of one frame's first and last beats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Cycle of the first accepted code.
    pub first_in: Option<u64>,
    /// Cycle of the last accepted code.
    pub last_in: Option<u64>,
    /// Cycle of the last expected output beat.
    pub last_out: Option<u64>,
}

impl Times {
    /// Cycles from the last accepted input beat to the last output beat.
    pub fn latency(&self) -> Option<u64> {
        self.last_out?.checked_sub(self.last_in?)
    }

    /// Cycles from the first accepted input beat to the last output beat, both included.
    pub fn total(&self) -> Option<u64> {
        Some(self.last_out?.checked_sub(self.first_in?)? + 1)
    }
}

/// Everything observed during a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recording {
    /// Output beats of all frames in order.
    pub beats: Vec<Beat>,
    /// Words of each tap, in order.
    pub taps: Vec<Vec<TapWord>>,
    /// Times of each frame.
    pub times: Vec<Times>,
    /// Violations of the output stream's protocol.
    pub violations: Vec<ProtocolViolation>,
    /// Set when the watchdog ended the run.
    pub timeout: Option<ProtocolViolation>,
}
