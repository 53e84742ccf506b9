//! What goes into a run and what it leaves behind.

/// One frame to play: its codes and how many beats it must give.
#[derive(Clone, Copy, Debug)]
pub struct InputFrame<'a> {
    /// One code per taxel, row-major, of one frame after the other.
    pub codes: &'a [i32],
    /// Taxels of a frame, which ends with `tlast`.
    pub taxels: usize,
    /// Output beats of the frame, status included.
    pub beats: usize,
}

/// An output beat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beat {
    /// When it was transferred.
    pub cycle: u64,
    /// `[fx, fy, fz]`.
    pub data: [i32; 3],
    /// `m_axis_tlast`.
    pub last: bool,
}

/// A word that a tap showed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TapWord {
    /// When it passed.
    pub cycle: u64,
    /// Its fields.
    pub fields: Vec<i64>,
}

/// A broken promise of the output stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProtocolViolation {
    /// When it was seen.
    pub cycle: u64,
    /// Index of the output beat concerned, counted over all frames.
    pub beat: usize,
    /// The rule, as a sentence.
    pub rule: String,
}

/// Cycles of one frame's first and last beats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// First accepted code.
    pub first_in: Option<u64>,
    /// Last accepted code.
    pub last_in: Option<u64>,
    /// Last expected output beat.
    pub last_out: Option<u64>,
}

impl Times {
    /// Cycles from the last accepted input beat to the last output beat.
    pub fn latency(&self) -> Option<u64> {
        self.last_out?.checked_sub(self.last_in?)
    }

    /// Cycles from the first accepted input beat to the last output beat, both counted.
    pub fn total(&self) -> Option<u64> {
        Some(self.last_out?.checked_sub(self.first_in?)? + 1)
    }
}

/// All that a run showed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recording {
    /// Output beats of all frames in order.
    pub beats: Vec<Beat>,
    /// Per tap, its words in order.
    pub taps: Vec<Vec<TapWord>>,
    /// Per frame.
    pub times: Vec<Times>,
    /// Broken rules of the output stream.
    pub violations: Vec<ProtocolViolation>,
    /// Set when the run was given up.
    pub timeout: Option<ProtocolViolation>,
}
