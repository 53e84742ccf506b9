//! Arithmetic, memories, counters and queues, from which the [stages](crate::stages) are built.
//!
//! rust-hdl 0.46 reads some signed constructs differently from the Verilog it prints, and has no multiplication beyond
//! 16×16. So blocks are kernels of the [`language`](crate::language): simulation, Verilog and the estimate of their logic
//! follow from one graph. `Scan` is an `#[hdl_gen]` kernel that connects others. Co-simulation compares the blocks with
//! the bit-true model, stage by stage, and proofs cover those that carry a handshake.
//!
//! The other modules hold what several blocks share: expressions of kernels in `constant_product`, `half_up`,
//! `leading_one`, `logarithm`, `pass_through`, `polynomial_word`, `sweep`.

mod average;
mod blank;
mod butterfly;
mod calibrate;
mod candidates;
mod case_counter;
mod constant_product;
mod counter;
mod counts;
mod delay;
mod dff;
mod filler;
mod force_unit;
mod gather;
mod half_up;
mod judge;
mod keep;
mod lanes;
mod leading_one;
mod logarithm;
mod mirror;
mod operand_select;
mod pass_through;
mod placer;
mod polynomial_word;
mod queue;
mod ram;
mod raw_length;
mod relay;
mod rescaler;
mod resultants;
mod scan;
mod score;
mod slice;
mod spread;
mod status_code;
mod steps;
mod store;
mod sum;
mod sweep;
mod taylor;
mod unfolder;
mod walk;
mod weigh;

pub use average::Average;
pub use blank::Blank;
pub use butterfly::Butterfly;
pub use calibrate::{Calibrate, CALIBRATION_FILE};
pub use candidates::{Candidates, LATENCY as CANDIDATES_LATENCY};
pub use case_counter::{expression_by_case, largest, CaseCounter};
pub use counter::{count_bits, Counter};
pub use counts::Counts;
pub use delay::{BitDelay, Delay};
pub use dff::Dff;
pub use filler::Filler;
pub use force_unit::{ForceUnit, CYCLE_BITS, STEPS as FORCE_STEPS};
pub use gather::Gather;
pub use judge::Judge;
pub use keep::Keep;
pub use lanes::{Lanes, MEMORY_FILE};
pub use leading_one::by_leading_one;
pub use mirror::{frame_quads, Mirror};
pub use operand_select::OperandSelect;
pub use placer::Placer;
pub use polynomial_word::PolynomialWord;
pub use queue::{Queue, PLACES as QUEUE_PLACES};
pub use ram::Ram;
pub use raw_length::{shift_bits, RawLength};
pub use relay::Relay;
pub use rescaler::{Rescaler, SATURATION_BITS};
pub use resultants::Resultants;
pub use scan::Scan;
pub use score::{Score, LATENCY as SCORE_LATENCY};
pub use slice::Slice;
pub use spread::Spread;
pub use status_code::StatusCode;
pub use steps::{control_bits, Steps, COLUMN_FILE, SOURCE_BITS};
pub use store::{Store, LATENCY as STORE_LATENCY};
pub use sum::Sum;
pub use sweep::{position_bits, BUFFER_BITS};
pub use taylor::{Taylor, LATENCY as TAYLOR_LATENCY};
pub use unfolder::Unfolder;
pub use walk::Walk;
pub use weigh::Weigh;
