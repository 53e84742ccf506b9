//! Memories and multipliers of the hardware, counted as the synthesiser counts them.
//!
//! Every memory of more than one word is listed by its name in the Verilog, where an attribute carries the choice:
//! block RAM, of the board's shape that takes the fewest, or distributed RAM for few words. Both counts are exact;
//! tests compare them with Yosys.
//!
//! | stage | memory | words × bits |
//! |---|---|---|
//! | prepare | drift of a running zero and its step; zero and gain; sums of several frames, or their sliding means, with two frames where they are several | taxels × those of the limit, once with `zero_average` more; taxels × `code_bits` and 18; taxels × `input_bits`, or × the means · `input_bits` + 2 · `code_bits` |
//! | receive | frame buffer of each case, four lanes | subarrays · Q × `input_bits` |
//! | fold | input of the passes | Q × 4 · `fold_bits` |
//! | pass | v_ij as operands, except those of the highest degree | their number · Q × 4 · `data_bits` |
//! | pass | coefficients; list of their columns | words × 18 · lanes; words × address, twice where Ax is used for Ay |
//! | pass | low limbs of Cz⁺, where the words would not fit otherwise | a power of two × `limb_align` · lanes |
//! | rescale | raw v_00 | Q × 4 · `acc_bits` |
//! | relax | v_00 to which the products are added | Q × 4 · `vector_bits` |
//! | search | polynomials, one memory per coefficient | 3 buffers of Q × 4 · `search_bits` |
//! | search | the next subarray's, or the next frame's where block RAM suffices | Q × 4 · `search_bits` |
//! | force | p(μ*) | subarrays · 4 Q / W × W · `search_bits`, W the taxels per cycle of the search |

use serde::Serialize;

use super::storage::{word_bits, LaidOut, Storage};
use crate::estimate::segment::{Segmenter, BASINS, WEIGHT_BITS, WIDTH, WORD_BITS};
use crate::fixed::stages::prepare::adaptive_mean::AdaptiveMean;
use crate::fixed::stages::prepare::running_zero::RunningZero;
use crate::fixed::stages::prepare::GAIN_BITS;
use crate::fixed::stages::resultants::POSITION_BITS;
use crate::fixed::stages::segment::cycles::{Segmentation, TAP_BITS};
use crate::fixed::words::arith::{bit_length, signed_bits};
use crate::fixed::words::formats::{Formats, FORCE_BITS, HALVINGS, MULTIPLIER_BITS};
use crate::fixed::words::network::POSITION_BITS as MU_BITS;
use crate::fixed::words::schedule::sections;
use crate::spec::board::Board;
use crate::spec::scene::{ForceOutput, Scene};

/// Number of polynomial buffers between which the sweeps of the search alternate.
pub const SEARCH_BUFFERS: usize = 3;

/// What a memory holds; the hardware's memories carry it as a label.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Holds {
    /// Zero and gain of each taxel.
    Calibration,
    /// Drift of each taxel's running zero, and its next step.
    Drift,
    /// Sums of the frames that are averaged, or their sliding means, with two frames where they are several.
    Average,
    /// One lane of the quads of a frame, in the layout of a case.
    Frame {
        /// Index of the case.
        case: usize,
        /// Lane of the quad.
        lane: usize,
    },
    /// Taxel of each place, and place of each taxel.
    TaxelOrder,
    /// Folded input.
    Folded,
    /// Operand vectors of the passes, one memory or one per lane.
    Operands(usize),
    /// Coefficients of the matrices.
    Coefficients,
    /// Low limbs of the coefficients of Cz⁺.
    LowCoefficients,
    /// Columns of the coefficients that are not left out.
    Columns,
    /// Accumulators that wait for their shift.
    Raw,
    /// v_00 in parities, for `relax`.
    FirstProduct,
    /// p in parities, for `shear`.
    Sheared,
    /// Coefficient of this index of the polynomials, in the buffers of the search.
    Polynomials(usize),
    /// The same at the start of the search.
    Start(usize),
    /// Bank of polynomials of the serial search, 0 or 1.
    Bank(usize),
    /// Transposed polynomial of the serial search.
    Transposed,
    /// Floors of the logarithms.
    Floors,
    /// Totals of the candidates.
    Totals,
    /// Values p(μ*).
    Values,
    /// Words of `segment`, as quads.
    SegmentQuads,
    /// Its words row-major, then smoothed.
    Smoothed,
    /// Its words smoothed along the rows, then the step or the basin of each taxel.
    Steps,
    /// Its weights in the order of the smoothing.
    SmoothingWeights,
    /// Saddles of its basins.
    Saddles,
    /// The basin after each, or the one it is part of, or its contact.
    BasinLinks,
    /// Loads of the basins, then sums of the contacts.
    Loads,
    /// Smallest saddle of each basin that is high.
    SaddleThresholds,
    /// Contacts of the taxels, as quads.
    Labels,
    /// Middles of the contacts: rows 0, columns 1.
    Middles(usize),
}

impl Holds {
    /// Whether the content is part of the design, which only a block RAM can have.
    fn is_rom(self) -> bool {
        matches!(
            self,
            Holds::Calibration
                | Holds::Coefficients
                | Holds::LowCoefficients
                | Holds::Columns
                | Holds::SmoothingWeights
        )
    }
}

impl std::fmt::Display for Holds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Holds::Calibration => write!(f, "calibration"),
            Holds::Drift => write!(f, "drift of the zeros"),
            Holds::Average => write!(f, "average"),
            Holds::Frame { case, lane } => write!(f, "frame, case {case}, lane {lane}"),
            Holds::TaxelOrder => write!(f, "taxel order"),
            Holds::Folded => write!(f, "folded input"),
            Holds::Operands(lane) => write!(f, "operands {lane}"),
            Holds::Coefficients => write!(f, "coefficients"),
            Holds::LowCoefficients => write!(f, "low coefficients"),
            Holds::Columns => write!(f, "columns"),
            Holds::Raw => write!(f, "raw words"),
            Holds::FirstProduct => write!(f, "v_00"),
            Holds::Sheared => write!(f, "p"),
            Holds::Polynomials(index) => write!(f, "polynomials, coefficient {index}"),
            Holds::Start(index) => write!(f, "polynomials at the start, coefficient {index}"),
            Holds::Bank(bank) => write!(f, "polynomials, bank {bank}"),
            Holds::Transposed => write!(f, "transposed polynomial"),
            Holds::Floors => write!(f, "floors"),
            Holds::Totals => write!(f, "totals"),
            Holds::Values => write!(f, "values"),
            Holds::SegmentQuads => write!(f, "segment, quads"),
            Holds::Smoothed => write!(f, "segment, smoothed words"),
            Holds::Steps => write!(f, "segment, steps"),
            Holds::SmoothingWeights => write!(f, "segment, smoothing weights"),
            Holds::Saddles => write!(f, "segment, saddles"),
            Holds::BasinLinks => write!(f, "segment, basin links"),
            Holds::Loads => write!(f, "segment, loads"),
            Holds::SaddleThresholds => write!(f, "segment, saddle thresholds"),
            Holds::Labels => write!(f, "segment, labels"),
            Holds::Middles(axis) => write!(f, "segment, middles, axis {axis}"),
        }
    }
}

impl Serialize for Holds {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A memory that the hardware needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// What it holds; each occurs once.
    pub holds: Holds,
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

impl Memory {
    /// A memory in block RAM, or in distributed RAM if it has at most `shallow` words that are not part of the design.
    fn new(holds: Holds, [words, bits]: [usize; 2], board: &Board, shallow: usize) -> Self {
        let in_blocks = holds.is_rom() || words > shallow;
        let block_rams = if in_blocks { board.block_rams_for(words, bits) } else { 0 };
        Memory { holds, words, bits, block_rams, large_rams: 0 }
    }
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Memories and multipliers that a design needs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Resources {
    /// Every memory, in pipeline order.
    pub memories: Vec<Memory>,
    /// Multipliers of each stage that can have some: (stage, count).
    pub multipliers: Vec<(&'static str, usize)>,
    /// Whether the search has a memory for the polynomials of the next subarray or frame, so that its passes run while the
    /// one before is searched.
    pub overlaps: bool,
}

/// Width in bits of a count below `limit`, at least one.
pub fn count_bits(limit: usize) -> usize {
    bit_length(limit.saturating_sub(1) as u64).max(1) as usize
}

/// Words of a memory that has one for each of `taxels` taxels of `arrays` arrays: the number of the array stands above that of the
/// taxel in an address.
pub fn array_places(arrays: usize, taxels: usize) -> usize {
    ((arrays - 1) << count_bits(taxels)) + taxels
}

/// Width in bits of a search position: three grid steps and one candidate beyond, after all halvings.
pub fn position_bits() -> usize {
    signed_bits(4 << HALVINGS) as usize
}

/// Words of the operand memory: those of the section that has most.
pub fn operand_words(formats: &Formats) -> usize {
    sections(formats).iter().map(|section| section.operands.iter().sum()).max().unwrap_or(0)
}

impl Resources {
    /// The resources of a scene's cases on `board`; where there are several, the whole array's is the first. Memories of few
    /// words go into distributed RAM. Where block RAM is short, frames do not overlap; where it still is, more memories go
    /// into distributed RAM.
    pub fn new(cases: &[LaidOut], scene: &Scene, board: &Board) -> Self {
        let [always, if_short] = board.distributed_words;
        let with = |overlaps| Resources::with_distributed(cases, scene, board, always, overlaps);
        // Of several subarrays the next one is always computed while one is searched; between frames it may be left out.
        let whole = cases.iter().all(|case| case.parts == 1);
        let all = if whole { vec![with(true), with(false)] } else { vec![with(true)] };
        let fitting = all.iter().find(|resources| resources.fits(board));
        fitting.or(all.last()).cloned().unwrap_or_else(|| with(true)).relieved(board, if_short)
    }

    /// The resources with memories of at most `shallow` words in distributed RAM.
    fn with_distributed(cases: &[LaidOut], scene: &Scene, board: &Board, shallow: usize, overlaps: bool) -> Self {
        let f = &cases[0].formats;
        // Shared memories are sized for the largest case; the coefficients of all cases add up.
        let quads = f.quads;
        let sum = |words: fn(&Storage) -> usize| cases.iter().map(|case| words(&case.storage)).sum::<usize>();
        let [words, wide, narrow] = [Storage::words, Storage::wide_words, Storage::narrow_words].map(sum);
        let listed = cases.iter().any(|case| case.storage.listed);
        let frame_quads = |case: &LaidOut| case.parts * case.formats.quads;
        let quad = |bits: u32| 4 * bits as usize;
        let memory = |holds: Holds, words: usize, bits: usize| Memory::new(holds, [words, bits], board, shallow);
        let input = &scene.input;
        let places = array_places(scene.hardware.arrays, scene.sensor.taxels());
        let mut memories = Vec::new();
        let gains = input.calibration.is_some() || scene.hardware.has_writable_tables();
        let running = RunningZero::of_scene(scene);
        if gains || input.tare.is_some() {
            let gain = if gains { GAIN_BITS } else { 0 };
            memories.push(memory(Holds::Calibration, places, (f.code_bits + gain) as usize));
        }
        if let Some(zero) = &running {
            memories.push(memory(Holds::Drift, places, (zero.moved_bits() + zero.step_bits()) as usize));
        }
        let adaptive = AdaptiveMean::of_scene(scene);
        let kept = adaptive.as_ref().map_or(f.input_bits, |adaptive| adaptive.word_bits(f.code_bits));
        if input.longest_average() > 0 {
            memories.push(memory(Holds::Average, places, kept as usize));
        }
        for (index, case) in cases.iter().enumerate() {
            let lane = |lane| memory(Holds::Frame { case: index, lane }, frame_quads(case), f.input_bits as usize);
            memories.extend((0..4).map(lane));
        }
        memories.push(memory(Holds::Folded, quads, quad(f.fold_bits)));
        if f.degree > 0 {
            // Of several cases the largest is the first.
            memories.push(memory(Holds::Operands(0), operand_words(f), quad(f.operand_bits())));
        }
        memories.push(memory(Holds::Coefficients, wide, word_bits(f)));
        if narrow > 0 {
            let bits = 4 * f.lanes_per_parity * f.limb_align as usize;
            memories.push(memory(Holds::LowCoefficients, narrow, bits));
        }
        if listed {
            // The transposed address as well, if it is read.
            let addresses = if f.shared_a { 2 } else { 1 };
            memories.push(memory(Holds::Columns, words, addresses * count_bits(quads)));
        }
        memories.push(memory(Holds::Raw, quads, quad(f.acc_bits)));
        if f.has_network() {
            memories.push(memory(Holds::FirstProduct, quads, quad(f.vector_bits)));
        }
        let segmenter = f.by_contact().then(|| Segmenter::new(&scene.sensor, WIDTH));
        if let Some(segmenter) = &segmenter {
            memories.push(memory(Holds::Sheared, quads, quad(f.data_bits)));
            memories.extend(segment_memories(&segmentation(scene, segmenter), board, shallow));
        }
        let searches = f.searches();
        for (k, &bits) in f.search_bits.iter().enumerate().filter(|_| searches) {
            memories.push(memory(Holds::Polynomials(k), SEARCH_BUFFERS * quads, quad(bits)));
            if overlaps {
                memories.push(memory(Holds::Start(k), quads, quad(bits)));
            }
        }
        let values = f.sweep_steps(cases.iter().map(frame_quads).max().unwrap_or(0));
        memories.push(memory(Holds::Values, values, f.search_width * f.search_bits[0] as usize));
        let difference = f.code_bits + if running.is_some() { 2 } else { 1 };
        let calibrate = if gains { board.multipliers_for(difference, GAIN_BITS) } else { 0 };
        let square = |bits: u32| board.multipliers_for(bits, bits);
        let squares = adaptive.as_ref().map_or(0, |adaptive| {
            let judged = adaptive.judged().map(|(window, _)| square(adaptive.apart_bits(window, f.code_bits)));
            square(adaptive.second_bits(f.code_bits)) + judged.sum::<usize>()
        });
        // Operands times μ, and the size of μ.
        let scale = 4 * board.multipliers_for(f.data_bits, MU_BITS);
        let of = |wanted: bool, count: usize| if wanted { count } else { 0 };
        let segments =
            segmenter.as_ref().map_or(0, |segmenter| segment_multipliers(&segmentation(scene, segmenter), board));
        let lane = board.multipliers_for(MULTIPLIER_BITS, MULTIPLIER_BITS);
        let multipliers = vec![
            ("prepare", calibrate + squares),
            ("pass", 4 * f.lanes_per_parity * lane + of(f.scales_operands(), scale)),
            ("segment", segments),
            ("estimate", of(f.has_network(), 2 * board.multipliers_for(MU_BITS, MU_BITS))),
            ("shear", of(f.by_contact(), scale)),
            ("forces", force_multipliers(f, board)),
            ("resultants", resultant_multipliers(scene, f.by_contact(), board)),
        ];
        Resources { memories, multipliers, overlaps: overlaps && searches }
    }

    /// With memories of at most `shallow` words in distributed RAM until the block RAMs suffice: those first that take the
    /// fewest LUTs for each block RAM.
    fn relieved(mut self, board: &Board, shallow: usize) -> Self {
        // A LUT holds a bit of 16 words.
        let luts = |memory: &Memory| memory.words.div_ceil(16) * memory.bits;
        let may_move = |memory: &Memory| memory.block_rams > 0 && memory.words <= shallow && !memory.holds.is_rom();
        let mut order: Vec<usize> = (0..self.memories.len()).filter(|&k| may_move(&self.memories[k])).collect();
        order.sort_by_key(|&k| luts(&self.memories[k]) / self.memories[k].block_rams);
        let mut moved = Vec::new();
        for k in order {
            if self.fits(board) {
                break;
            }
            moved.push((k, std::mem::take(&mut self.memories[k].block_rams)));
        }
        // The last ones may have been large enough to make some of the others unnecessary.
        for (k, block_rams) in moved {
            self.memories[k].block_rams = block_rams;
            if !self.fits(board) {
                self.memories[k].block_rams = 0;
            }
        }
        self
    }

    /// Number of block RAMs of coefficients and lists of columns, which no distributed RAM relieves.
    pub fn rom_block_rams(&self) -> usize {
        self.memories.iter().filter(|memory| memory.holds.is_rom()).map(|memory| memory.block_rams).sum()
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

/// The segmentation of the contacts of a scene.
fn segmentation<'a>(scene: &'a Scene, segmenter: &'a Segmenter) -> Segmentation<'a> {
    Segmentation { sensor: &scene.sensor, segmenter, most: scene.partition.max_contacts }
}

/// Memories of `segment` on `board`, those of at most `shallow` words in distributed RAM. So are the tables of the basins and the
/// middles, which are read asynchronously.
pub fn segment_memories(segmentation: &Segmentation, board: &Board, shallow: usize) -> Vec<Memory> {
    let (taxels, quads) = (segmentation.sensor.taxels(), segmentation.quads().len());
    let taps = [0, 1].map(|axis| segmentation.tap_count(axis));
    let [smoothed, sum] = [segmentation.smoothed_bits(), segmentation.sum_bits()].map(|bits| bits as usize);
    let (table, basin) = (BASINS + 1, count_bits(BASINS + 1));
    let [lane, label] = [WORD_BITS as usize + 1, count_bits(segmentation.most + 1)];
    let blocks = [
        (Holds::SegmentQuads, quads, 4 * lane),
        (Holds::Smoothed, taxels, smoothed),
        (Holds::Steps, taxels, smoothed.max(basin + 1)),
        (Holds::SmoothingWeights, taps.iter().sum(), TAP_BITS),
        (Holds::Saddles, table * table, smoothed),
        (Holds::Labels, quads, 4 * label),
    ];
    let tables = [(Holds::BasinLinks, basin + 1), (Holds::Loads, sum), (Holds::SaddleThresholds, smoothed)];
    let axes = [segmentation.sensor.rows, segmentation.sensor.cols].map(count_bits);
    let middles = axes.into_iter().enumerate().map(|(axis, bits)| (Holds::Middles(axis), segmentation.most, bits));
    let distributed = tables.into_iter().map(|(holds, bits)| (holds, table, bits)).chain(middles);
    let blocks = blocks.into_iter().map(|(holds, words, bits)| Memory::new(holds, [words, bits], board, shallow));
    blocks.chain(distributed.map(|(holds, words, bits)| Memory::new(holds, [words, bits], board, words))).collect()
}

/// Number of multipliers of `segment`: differences of smoothed words times slopes, words times weights.
pub fn segment_multipliers(segmentation: &Segmentation, board: &Board) -> usize {
    board.multipliers_for(segmentation.smoothed_bits() + 1, WEIGHT_BITS + 2)
}

/// Number of multipliers of the resultants: X fz and Y fz, and of contacts X fy and Y fx.
pub fn resultant_multipliers(scene: &Scene, by_contact: bool, board: &Board) -> usize {
    match scene.output.forces {
        ForceOutput::Taxels => 0,
        ForceOutput::Resultants => {
            let products = if by_contact { 4 } else { 2 };
            products * board.multipliers_for(FORCE_BITS, POSITION_BITS + 1)
        }
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
