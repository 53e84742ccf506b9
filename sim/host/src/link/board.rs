//! A board, or a core behind Ethernet, as a session asks it.

use dermis_golden::fixed::Model;
use dermis_golden::wire::link::Identity;

use super::answer::BoardAnswer;
use super::error::HostError;

/// Transmission errors that were corrected by repetition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkErrors {
    /// Number of requests sent again.
    pub repeated: u64,
    /// Number of answers, or fragments of them, that failed their check.
    pub damaged: u64,
}

/// Packets that a board or a core has counted since its reset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PacketCounters {
    /// Packets of requests, or of frames, that were taken.
    pub taken: u32,
    /// Why packets were dropped, and how many.
    pub dropped: Vec<(&'static str, u32)>,
    /// Bits of a counter, which begins again at 0.
    pub(super) bits: u32,
}

impl PacketCounters {
    /// The packets that were dropped for this reason; 0 for an unknown one.
    pub fn dropped_for(&self, reason: &str) -> u32 {
        self.dropped.iter().find(|(name, _)| *name == reason).map_or(0, |(_, count)| *count)
    }

    /// What was dropped since `before`, by reason.
    pub fn since(&self, before: &PacketCounters) -> Vec<(&'static str, u32)> {
        let count = |(name, after): &(&'static str, u32)| {
            let differs = after.wrapping_sub(before.dropped_for(name));
            (*name, differs << (u32::BITS - self.bits) >> (u32::BITS - self.bits))
        };
        self.dropped.iter().map(count).collect()
    }
}

/// What a session asks of a board.
pub trait Board {
    /// Its port or address, in messages.
    fn name(&self) -> &str;

    /// Asks for the identity, and checks that the board was built for `model`.
    ///
    /// # Errors
    /// No answer, another version, another scene.
    fn identify(&mut self, model: &Model) -> Result<Identity, HostError>;

    /// Asks for the packet counters.
    ///
    /// # Errors
    /// No answer.
    fn counters(&mut self) -> Result<PacketCounters, HostError>;

    /// Sends a frame and waits for its forces or resultants; to a board that scans its array, a request without `codes`.
    ///
    /// # Errors
    /// No answer.
    fn frame(&mut self, model: &Model, codes: &[i32], forces: bool) -> Result<BoardAnswer, HostError>;

    /// Writes an image of tables.
    ///
    /// # Errors
    /// No answer.
    fn write_tables(&mut self, image: &[u8]) -> Result<(), HostError>;

    /// The number of its array among those of one engine.
    fn array(&self) -> usize {
        0
    }

    /// Transmission errors so far.
    fn link_errors(&self) -> LinkErrors;

    /// Lower bits of a code that are not sent.
    fn bits_left_out(&self) -> u32 {
        0
    }
}

/// Writes the tables of `model` into the board, `forces` being what it answers a frame with, and asks with a frame of zeros,
/// or of the next scan, whether they are whole.
///
/// # Errors
/// No answer; other tables than those of `model` afterwards.
pub(super) fn load(board: &mut dyn Board, model: &Model, forces: bool) -> Result<(), HostError> {
    board.write_tables(&model.image())?;
    let codes = if model.code_beats() > 0 { 0 } else { model.scene.sensor.taxels() };
    let answer = board.frame(model, &vec![0; codes], forces)?;
    let wants = model.own().version;
    let has = answer.tables().find(|tables| *tables != wants.to_string());
    has.map_or(Ok(()), |has| Err(HostError::Tables { port: board.name().to_owned(), has, wants }))
}
