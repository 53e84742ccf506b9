//! Arithmetic, memories, counters and queues, from which the [stages](crate::stages) are built.
//!
//! Simulation, Verilog and the estimate of their logic follow from one graph of the [`language`](crate::language). Co-simulation
//! compares the blocks with the bit-true model, stage by stage, and proofs cover those
//! that carry a handshake.
//!
//! The other modules hold what several blocks share: expressions of kernels in `constant_product`, `half_up`,
//! `leading_one`, `logarithm`, `polynomial_word`, `sweep`.

mod address;
mod arithmetic;
mod frame;
mod memory;
mod output;
mod pass;
mod search;
mod stream;

pub use address::case_counter::{expression_by_case, largest, CaseCounter};
pub use address::case_equal::CaseEqual;
pub use address::counter::{count_bits, Counter};
pub use address::lane_mask::LaneMask;
pub use address::quad_address::{frame_quads, QuadAddress};
pub(crate) use address::quad_address::{lane_of, quad_address_of, Place as TaxelPlace};
pub use address::scan::Scan;
pub use address::transposed_place::TransposedPlace;
pub(crate) use arithmetic::butterfly::subtracted;
pub use arithmetic::butterfly::Butterfly;
pub use arithmetic::lanes::{Lanes, LOW_FILE, MEMORY_FILE};
pub use arithmetic::leading_one::by_leading_one;
pub use arithmetic::rescaler::{count_saturations, operand_of, saturating_sum, Rescaler, SATURATION_BITS};
pub(crate) use arithmetic::saturated::saturated;
pub(crate) use arithmetic::unfolder::hadamard;
pub use arithmetic::unfolder::Unfolder;
pub(crate) use frame::arrays::Resets;
pub use frame::arrays::{Arrays, FrameArray};
pub use frame::arrival::Arrival;
#[cfg(test)]
pub(crate) use frame::average::tests::Sums;
pub use frame::average::{Average, AveragePorts, FrameMarks};
#[cfg(test)]
pub(crate) use frame::calibrate::tests::Table;
pub use frame::calibrate::{Calibrate, CalibratePorts};
pub use frame::code_check::{FrameCheck, FAULT_BITS, LATENCY as CHECK_LATENCY};
pub use frame::frame_stats::FrameStats;
pub(crate) use frame::frame_stats::{beyond, magnitude_of};
pub use frame::input_mask::InputMask;
pub(crate) use frame::load::table_beat;
pub use frame::load::{CoefficientPlaces, Load, LoadPorts, PAIR_BITS, THRESHOLD_BITS, VERSION_WORD_BITS};
pub use memory::delay::{BitDelay, Delay};
pub use memory::dff::Dff;
pub use memory::enable_register::EnableRegister;
pub use memory::ram::Ram;
pub(crate) use output::balance::Balance;
#[cfg(test)]
pub(crate) use output::force_unit::tests::Requests;
pub use output::force_unit::{ForceUnit, STEPS as FORCE_STEPS};
pub use output::frame_cycles::{FrameCycles, CYCLE_BITS};
pub use output::parts_begun::PartsBegun;
pub(crate) use output::status_bits::status_bits;
pub use output::status_code::StatusCode;
pub use pass::limb_sum::LimbSum;
pub use pass::operand_scale::{OperandScale, SCALE_LATENCY};
pub use pass::operand_select::OperandSelect;
pub use pass::operand_source::{OperandSource, MASK_BITS};
pub use pass::operand_writer::OperandWriter;
pub use pass::pass_program::{longest, programs, Control, PassProgram, COLUMN_FILE, FACTOR_BITS, SOURCE_BITS};
pub use pass::raw_length::{shift_bits, RawLength};
pub use search::best_candidate::BestCandidate;
pub use search::candidates::{Candidates, LATENCY as CANDIDATES_LATENCY};
pub use search::polynomial_word::PolynomialWord;
pub use search::score::{Score, LATENCY as SCORE_LATENCY};
pub use search::score_bias::ScoreBias;
pub use search::search_sequencer::SearchSequencer;
pub use search::store::{latency as store_latency, Store};
pub use search::sum::Sum;
pub use search::sweep::{position_bits, BUFFER_BITS};
pub use search::taylor::{Taylor, LATENCY as TAYLOR_LATENCY};
pub(crate) use stream::beats::{through, Beats};
pub use stream::beats::{Stream, StreamSignals};
#[cfg(test)]
pub(crate) use stream::queue::tests::List;
pub use stream::queue::{Queue, CAPACITY as QUEUE_CAPACITY};
pub use stream::register_slice::RegisterSlice;
