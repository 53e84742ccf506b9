//! The few blocks that hold arithmetic and memory.
//!
//! rust-hdl 0.46 reads some signed constructs differently from the Verilog it prints, and has no
//! multiplication beyond 16×16. So everything signed or wide lives here: each primitive prints its own Verilog, with
//! the scene's widths in it, and its `update` computes the same in integers with the bit-true model's functions. The
//! stages around them are plain `#[hdl_gen]` kernels of single-bit control and wiring. Every primitive is
//! run against its printed Verilog in the co-simulation, stage by stage.

mod butterfly;
mod candidates;
mod counts;
mod counter;
mod delay;
mod force_unit;
mod gather;
mod judge;
mod lanes;
mod mirror;
mod normaliser;
mod operand_select;
mod polynomial_word;
mod ram;
mod raw_length;
mod rescaler;
mod score;
mod steps;
mod store;
mod sum;
mod taylor;
mod unfolder;
mod walk;

pub use butterfly::Butterfly;
pub use candidates::Candidates;
pub use counter::{count_bits, Counter};
pub use counts::Counts;
pub use delay::{BitDelay, Delay};
pub use force_unit::ForceUnit;
pub use gather::Gather;
pub use judge::Judge;
pub use lanes::Lanes;
pub use mirror::Mirror;
pub use normaliser::Normaliser;
pub use operand_select::OperandSelect;
pub use polynomial_word::PolynomialWord;
pub use ram::Ram;
pub use raw_length::RawLength;
pub use rescaler::Rescaler;
pub use score::Score;
pub use steps::Steps;
pub use store::Store;
pub use sum::Sum;
pub use taylor::Taylor;
pub use unfolder::Unfolder;
pub use walk::Walk;
