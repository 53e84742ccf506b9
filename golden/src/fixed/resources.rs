//! Memories and multipliers of the hardware, counted as the synthesiser counts them.
//!
//! Every memory of more than one word is listed by its name in the Verilog, where an attribute carries the choice:
//! block RAM, of the board's shape that takes the fewest, or distributed RAM for few words. Both counts are exact;
//! tests compare them with Yosys.
//!
//! | stage | memory | words × bits |
//! |---|---|---|
//! | prepare | zero and gain; sums of several frames | taxels × `code_bits` and 18; taxels × `input_bits` |
//! | receive | frame buffer of each case, four lanes | subarrays · Q × `input_bits` |
//! | fold | input of the passes | Q × 4 · `fold_bits` |
//! | pass | v_ij as operands, except those of the highest degree | their number · Q × 4 · `data_bits` |
//! | pass | coefficients; list of their columns | words × 18 · lanes; words × address, twice where Ax is used for Ay |
//! | rescale | raw v_00 | Q × 4 · `acc_bits` |
//! | search | polynomials, one memory per coefficient | 3 buffers of Q × 4 · `search_bits` |
//! | search | the next subarray's, where there are several | Q × 4 · `search_bits` |
//! | force | p(μ*) | subarrays · Q × 4 · `search_bits` |

use serde::Serialize;

use super::arith::{bit_length, signed_bits};
use super::formats::{Formats, LaidOut, FORCE_BITS, HALVINGS, MULTIPLIER_BITS};
use super::prepare::GAIN_BITS;
use super::resultants::POSITION_BITS;
use super::schedule::vectors;
use super::storage::word_bits;
use crate::board::Board;
use crate::scene::{ForceOutput, Scene};

/// [`Memory::block`] of the search memory.
pub const SEARCH_MEMORY: &str = "search__store";

/// Frame buffers of designs with several cases.
const BANKS: [&str; 4] =
    ["receive__banks__0__frame", "receive__banks__1__frame", "receive__banks__2__frame", "receive__banks__3__frame"];

/// Number of polynomial buffers between which the sweeps of the search alternate.
pub const SEARCH_BUFFERS: usize = 3;

/// A memory of the hardware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// Path of its block in the hardware, levels separated by `__`.
    pub block: &'static str,
    /// Its name in the block.
    pub array: String,
    /// Number of words.
    pub words: usize,
    /// Width of a word in bits.
    pub bits: usize,
    /// Number of block RAMs; 0 for distributed RAM.
    pub block_rams: usize,
    /// Number of single-port RAMs.
    #[serde(skip_serializing_if = "is_zero")]
    pub large_rams: usize,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Memories and multipliers that a design needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Resources {
    /// Every memory, in pipeline order.
    pub memories: Vec<Memory>,
    /// Multipliers of each block that can have some: (block, count).
    pub multipliers: Vec<(&'static str, usize)>,
}

/// Width in bits of a count below `limit`, at least one.
pub fn count_bits(limit: usize) -> usize {
    bit_length(limit.saturating_sub(1) as u64).max(1) as usize
}

/// Width in bits of a search position: three grid steps and one candidate beyond, after all halvings.
pub fn position_bits() -> usize {
    signed_bits(4 << HALVINGS) as usize
}

/// Number of v_ij that later passes read: all but those of the highest degree.
pub fn operand_vectors(degree: usize) -> usize {
    degree.checked_sub(1).map_or(0, vectors)
}

impl Resources {
    /// The resources of a scene's cases on `board`; where there are several, the whole array's is the first. Memories
    /// of at most `shallow` words go into distributed RAM.
    pub fn new(cases: &[LaidOut], scene: &Scene, board: &Board, shallow: usize) -> Self {
        let f = &cases[0].formats;
        // Shared memories are sized for the largest case; the coefficients of all cases add up.
        let quads = f.quads;
        let words = cases.iter().map(|case| case.storage.words()).sum();
        let listed = cases.iter().any(|case| case.storage.listed);
        let frame_quads = |case: &LaidOut| case.parts * case.formats.quads;
        let several = cases.iter().any(|case| case.parts > 1);
        let quad = |bits: u32| 4 * bits as usize;
        let memory = |block, array: &str, words: usize, bits: usize, rom: bool| Memory {
            block,
            array: array.to_string(),
            words,
            bits,
            block_rams: if rom || words > shallow { board.block_rams_for(words, bits) } else { 0 },
            large_rams: 0,
        };
        let ram = |block, words, bits| memory(block, "field0", words, bits, false);
        let (input, taxels) = (&scene.input, scene.sensor.taxels());
        let mut memories = Vec::new();
        if input.calibration.is_some() || input.tare.is_some() {
            let gain = if input.calibration.is_some() { GAIN_BITS } else { 0 };
            memories.push(memory("prepare__calibrate", "entries", taxels, (f.code_bits + gain) as usize, true));
        }
        if input.average > 0 {
            memories.push(memory("prepare__average", "sums", taxels, f.input_bits as usize, false));
        }
        for (number, case) in cases.iter().enumerate() {
            let block = if cases.len() == 1 { "receive__frame" } else { BANKS[number] };
            let lane = |lane| memory(block, &format!("field{lane}"), frame_quads(case), f.input_bits as usize, false);
            memories.extend((0..4).map(lane));
        }
        memories.push(ram("fold__memory", quads, quad(f.fold_bits)));
        if f.degree > 0 {
            memories.push(ram("pass__vectors", operand_vectors(f.degree) * quads, quad(f.data_bits)));
        }
        memories.push(memory("pass__lanes", "memory", words, word_bits(f), true));
        if listed {
            // The transposed address as well, if it is read.
            let addresses = if f.shared_a { 2 } else { 1 };
            memories.push(memory("pass__steps", "columns", words, addresses * count_bits(quads), true));
        }
        memories.push(ram("rescale__raw", quads, quad(f.acc_bits)));
        for (k, &bits) in f.search_bits.iter().enumerate().filter(|_| f.degree > 0) {
            memories.push(memory(SEARCH_MEMORY, &format!("memory{k}"), SEARCH_BUFFERS * quads, quad(bits), false));
            if several {
                memories.push(memory(SEARCH_MEMORY, &format!("start{k}"), quads, quad(bits), false));
            }
        }
        memories.push(ram("forces__store", cases.iter().map(frame_quads).max().unwrap_or(0), quad(f.search_bits[0])));
        let calibrate = match input.calibration {
            Some(_) => board.multipliers_for(f.code_bits + 1, GAIN_BITS),
            None => 0,
        };
        let multipliers = vec![
            ("prepare__calibrate", calibrate),
            ("pass__lanes", 4 * f.lanes_per_parity * board.multipliers_for(MULTIPLIER_BITS, MULTIPLIER_BITS)),
            ("forces__unit", force_multipliers(f, board)),
            ("resultants", resultant_multipliers(scene, board)),
        ];
        Resources { memories, multipliers }
    }

    /// Number of block RAMs of all memories.
    pub fn block_rams(&self) -> usize {
        self.memories.iter().map(|memory| memory.block_rams).sum()
    }

    /// Number of single-port RAMs of all memories.
    pub fn large_rams(&self) -> usize {
        self.memories.iter().map(|memory| memory.large_rams).sum()
    }

    /// Number of multipliers of all blocks.
    pub fn multipliers(&self) -> usize {
        self.multipliers.iter().map(|(_, count)| count).sum()
    }

    /// Resources the board lacks: (name, required, available).
    pub fn shortages(&self, board: &Board) -> Vec<(&'static str, usize, usize)> {
        let all = [
            ("block RAMs", self.block_rams(), board.block_rams as usize),
            ("single-port RAMs", self.large_rams(), board.large_rams as usize),
            ("multipliers", self.multipliers(), board.multipliers as usize),
        ];
        all.into_iter().filter(|(_, needs, has)| needs > has).collect()
    }

    /// Whether `board` has the block RAMs and one more, for the packet counters of the link.
    pub fn fits(&self, board: &Board) -> bool {
        self.block_rams() < board.block_rams as usize
    }
}

/// Number of multipliers of the resultants: X fz⁺ and Y fz⁺.
pub fn resultant_multipliers(scene: &Scene, board: &Board) -> usize {
    match scene.output.forces {
        ForceOutput::Taxels => 0,
        ForceOutput::Resultants => 2 * board.multipliers_for(FORCE_BITS, POSITION_BITS + 1),
    }
}

/// Number of multipliers of the force unit: μ1 and μ2 from their positions, and both times p; none without a search.
pub fn force_multipliers(formats: &Formats, board: &Board) -> usize {
    if formats.degree == 0 {
        return 0;
    }
    let step = signed_bits(formats.mu_step.unsigned_abs());
    // A multiplication by a power of two is wiring.
    let words = if formats.mu_step.count_ones() == 1 { 0 } else { board.multipliers_for(position_bits() as u32, step) };
    2 * words + 2 * board.multipliers_for(formats.search_bits[0], MULTIPLIER_BITS)
}
