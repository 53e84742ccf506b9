//! Streams of frames without a board: lines in, lines of JSON out, in order and with bounded memory.
//!
//! ```text
//! standard input, growing file, serial port, UDP ── lines ── queue of N lines ── frames ── engine ── NDJSON
//!                          own thread                 full: wait, or drop the oldest       the best that keeps up
//! ```
//!
//! | in, one line each | |
//! |---|---|
//! | `{"id": 7, "stress_MPa": [0.1, …]}` | row-major; `id` may be left out |
//! | `0.1,0.2,…` | row-major, separated by commas |
//!
//! | out, one line each | |
//! |---|---|
//! | result | `sequence` from 0, `line` of its last frame from 1, `received_s`, `answered_s` since 1970, `dropped` lines so far, `estimator`, where that changes `estimator_change`; then the fields of [`Reconstruction`](dermis_golden::result::reconstruct::Reconstruction) |
//! | refusal | `line`, `error`; the stream goes on |
//!
//! Frames whose values are known, as those of a recording, stand in place of lines, each once it is due ([`Input`]).
//!
//! With `input.average = k` 2^k frames give one result. A line is at most [`LONGEST_LINE`] bytes, so a queue of N lines
//! takes at most N times that.
//!
//! | module | does |
//! |---|---|
//! | [`mod@line`] | a line of bounded length, and the frame in it |
//! | [`queue`] | the queue between the two threads |
//! | [`source`] | where lines come from |
//! | [`stop`] | the end that another thread asks for |
//! | [`rate`] | whether results keep up with the frames, and which estimator does |
//! | [`estimators`] | the estimator that is taken, and its results |
//! | [`answers`] | results and refusals |
//! | [`zero`] | a zero that is taken anew while a stream runs |
//! | [`together`] | several streams in one thread, or one |

pub mod acquisition;
pub mod answers;
pub mod estimators;
pub mod line;
pub mod queue;
pub mod rate;
mod reader;
pub mod source;
pub mod stop;
pub mod together;
pub mod zero;

pub use answers::nanoseconds;
pub use answers::{as_lines, seconds, Counts, Outcome, Output, Refusal, StreamAnswer, StreamOptions};
pub use estimators::{Estimators, Faster, Note};
pub use line::LONGEST_LINE;
pub use queue::Policy;
pub use rate::Clock;
pub use reader::{DueFrame, Input};
pub use source::Source;
pub(crate) use source::DATAGRAM;
pub use stop::Stop;
pub use together::{run, run_together, run_until, Member, Outputs};
pub use zero::{ZeroRequest, ZERO_FRAMES};
