//! Widths and scales of the whole pipeline; [`widths`](crate::fixed::plan::widths) derives them from a scene.
//!
//! Widths are norm bounds: the largest input times the ∞-norm of the matrix it is multiplied by is the largest output
//! of a stage, so nothing before `rescale` can overflow. `rescale` shifts v_00 to a full word by one measured exponent
//! per subarray; what does not fit is saturated and counted. Where the norms of the scaled A are below one, nothing
//! saturates.
//!
//! | word | bits | default | LSB |
//! |---|---|---|---|
//! | code | `code_bits` | 20 | full scale / (2^(code_bits − 1) − 1) |
//! | frame buffer's word | `input_bits` = `code_bits` + average | 20 | that / 2^average, times 2^−normalise |
//! | parity of the input | `fold_bits` = `input_bits` + 2 | 22 | as the code |
//! | Cz⁺ | `inverse_bits` | 24 | 2^−`inverse_exponent` N/MPa |
//! | Ax, Ay | `coef_bits` | 18 | 2^−`a_exponent` |
//! | accumulator of a lane | `lane_bits` | 37 | as below, or v_00: 2^`limb_align` times that |
//! | accumulator | `acc_bits` | 42 | v_00: 2^`raw_shift` · code · Cz⁺ |
//! | v_ij, parities | `vector_bits` = `data_bits` + 4 | 22 | accumulator · 2^rescale |
//! | v_ij, operand of a pass | `data_bits` | 18 | 16 LSBs of the above |
//! | v_ij, taxels, in the search | `search_bits[k]` | 27 and less | a quarter of `vector_bits`' |
//! | Σ over taxels of v_ij | `sum_bits[k]` | | the same |
//! | log2 | `LOG_FRACTION` fraction bits | 6 | 2^−6 |
//! | image of a neuron, after ReLU | `image_bits` | 15 | of its layer, [`network`](super::network) |
//! | μ | 18 | | 2^−`mu_fraction` |
//! | force | 32 | | `force_exponent` |

use serde::Serialize;

use super::coefficients::Flips;
use crate::spec::quads::Quads;

/// Operand width of the multipliers in bits; a board with narrower multipliers has its own.
pub const MULTIPLIER_BITS: u32 = 18;
/// Bits by which a v_ij in the search is wider than an operand of the passes.
pub const SEARCH_EXTRA_BITS: u32 = 4;
/// ε of the sparse objective is 2^−`EPSILON_SHIFT`. Of 17 to 21, 20 comes nearest to the floating-point model on 200
/// drawn frames of each sensor.
pub const EPSILON_SHIFT: u32 = 20;
/// Fraction bits of a logarithm.
pub const LOG_FRACTION: u32 = 6;
/// The logarithm's table has 2^`LOG_TABLE_BITS` entries.
pub const LOG_TABLE_BITS: u32 = 4;
/// Halvings of the search step after the coarse grid.
pub const HALVINGS: u32 = 7;
/// μ is counted in mu_max / (3·2^7): the grid's step after all halvings.
pub const MU_STEPS: i64 = 3 << HALVINGS;
/// Right shift from X·`mu_step` to a μ word, X a search position.
pub const MU_ROUND: u32 = 8;
/// Width of a force word on the output stream.
pub const FORCE_BITS: u32 = 32;
/// Largest right shift of the force stage; a larger one would shift out every product.
pub const FORCE_SHIFT_MAX: u32 = 62;
/// Widths and scales of one scene's pipeline, widths in bits; see the table of the module.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formats {
    /// Degree of p(μ).
    pub degree: usize,
    /// Quads per subarray, Q.
    pub quads: usize,
    /// Matrix lanes per parity; the engine has four times as many.
    pub lanes_per_parity: usize,
    /// Groups of `lanes_per_parity` rows that a pass computes one after the other.
    pub groups: usize,
    /// Taxels that the search computes per cycle, W: 4, 2 or 1; 4 without a search.
    pub search_width: usize,
    /// Rows of each layer of the network that gives μ, the last with those of the outputs; empty with a search.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<usize>,
    /// Quads of the window that the network reads around each contact, which has a μ of its own; `None` where there is one μ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_quads: Option<usize>,
    /// Bits by which p(μ) may be larger than v_00; 0 with a search, whose words grow.
    #[serde(skip_serializing_if = "is_zero")]
    pub headroom: u32,
    /// Ay is Ax with x and y exchanged and is not stored.
    pub shared_a: bool,
    /// Parity flips of the matrices; serialised where the mirror symmetry is broken.
    #[serde(skip_serializing_if = "Flips::are_symmetric")]
    pub flips: Flips,
    /// Width of a code on the input stream.
    pub code_bits: u32,
    /// Width of a word of the frame buffer: a code, or a sum of several.
    pub input_bits: u32,
    /// Width of a folded input.
    pub fold_bits: u32,
    /// Width of the low limb of the folded input, 0 if the input fits one multiplier operand.
    pub input_low_bits: u32,
    /// Width of Cz⁺.
    pub inverse_bits: u32,
    /// Width of the low limb of Cz⁺, 0 if Cz⁺ fits one multiplier operand.
    pub inverse_low_bits: u32,
    /// The larger of the two low limbs' widths: the left shift of the product of the high limbs.
    pub limb_align: u32,
    /// LSB of the raw v_00 is 2^`raw_shift` times the LSBs of its factors.
    pub raw_shift: u32,
    /// LSB of Cz⁺ is 2^−`inverse_exponent` N/MPa.
    pub inverse_exponent: i32,
    /// Width of Ax, Ay.
    pub coef_bits: u32,
    /// LSB of −A·(4/3)·mu_max is 2^−`a_exponent`.
    pub a_exponent: i32,
    /// Width of an accumulator with all products of a v_ij.
    pub acc_bits: u32,
    /// Width of an accumulator of the parallel engine's lanes, which has the products of v_00 without low limbs or
    /// those with one.
    pub lane_bits: u32,
    /// Largest bit length of a raw v_00.
    pub raw_length_max: u32,
    /// Width of an operand of the passes.
    pub data_bits: u32,
    /// Width of a v_ij in parities, after `rescale`.
    pub vector_bits: u32,
    /// Right shift from the accumulator of an A pass to a v_ij.
    pub a_shift: u32,
    /// Width of each v_ij in the search memory, in order of [`EXPONENTS`](super::schedule::EXPONENTS).
    pub search_bits: Vec<u32>,
    /// Width of Σ over taxels of each v_ij.
    pub sum_bits: Vec<u32>,
    /// Width of a score.
    pub score_bits: u32,
    /// Fraction bits of a μ word.
    pub mu_fraction: u32,
    /// μ per step of the search, in 2^−(`mu_fraction` + `MU_ROUND`).
    pub mu_step: i64,
    /// LSB of a force word is 2^`force_exponent` · code LSB in MPa · 1 N/MPa.
    pub force_exponent: i32,
}

/// Number of v_ij for a polynomial of `degree`.
pub fn vectors(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl Formats {
    /// Whether a network gives μ, and [`relax`](crate::fixed::stages::relax) p(μ), instead of a search.
    pub fn has_network(&self) -> bool {
        !self.layers.is_empty()
    }

    /// Whether the network gives a μ for each contact, not one for the whole array.
    pub fn by_contact(&self) -> bool {
        self.window_quads.is_some()
    }

    /// Whether μ is searched: the polynomial has a degree, and no network gives μ.
    pub fn searches(&self) -> bool {
        self.degree > 0 && !self.has_network()
    }

    /// Rows that leave the lanes for each hidden layer of the network: those of whole groups.
    pub fn hidden_rows(&self) -> impl Iterator<Item = usize> + '_ {
        let hidden = self.layers.split_last().map_or(&[][..], |(_, hidden)| hidden);
        hidden.iter().map(|rows| rows.next_multiple_of(self.lanes_per_parity))
    }

    /// Number of vectors that leave `rescale`: v_00, then the other v_ij of the polynomial, or with a network a product
    /// for each step of `relax`.
    pub fn vectors(&self) -> usize {
        match self.has_network() {
            true => 1 + self.degree,
            false => vectors(self.degree),
        }
    }

    /// How many of these vectors later passes read: with a search all but those of the highest degree, with a network all
    /// but the last.
    pub fn operand_vectors(&self) -> usize {
        match (self.degree, self.has_network()) {
            (0, _) => 0,
            (degree, true) => degree,
            (degree, false) => vectors(degree - 1),
        }
    }

    /// Width of a word of the operand memory: of a v_ij, or where windows of contacts are in it, of a multiplier's operand.
    pub fn operand_bits(&self) -> u32 {
        if self.by_contact() {
            MULTIPLIER_BITS
        } else {
            self.data_bits
        }
    }

    /// Whether operands are multiplied by the one μ in front of the lanes.
    pub fn scales_operands(&self) -> bool {
        self.has_network() && !self.by_contact()
    }

    /// Bit length to which v_00 is brought.
    pub fn full_length(&self) -> u32 {
        self.vector_bits - 1 - self.headroom
    }

    /// Width of the image of a neuron, without a sign: four of them add up to an operand.
    pub fn image_bits(&self) -> u32 {
        self.data_bits - 3
    }

    /// Steps of a sweep of the search over `quads` quads, one per cycle: `search_width` taxels each.
    pub fn sweep_steps(&self, quads: usize) -> usize {
        quads * (Quads::LANES / self.search_width)
    }
}

/// The right shift of the force stage for a subarray shifted left by `normalise` and right by `rescale`: the fraction
/// of the μ word plus the distance of the subarray's exponent from that of the force word.
pub fn force_shift(formats: &Formats, normalise: u32, rescale: u32) -> u32 {
    let rescale_max = formats.raw_length_max.saturating_sub(formats.full_length());
    let headroom = FORCE_BITS - formats.search_bits[0];
    (formats.mu_fraction + rescale_max + normalise).saturating_sub(headroom + rescale).min(FORCE_SHIFT_MAX)
}
