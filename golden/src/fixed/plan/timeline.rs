//! Timeline: when the products of a section are issued, and when their rows leave the lanes.

use super::storage::Storage;
use crate::fixed::stages::estimate::{REDUCTIONS, REDUCTION_CYCLES};
use crate::fixed::words::formats::Formats;
use crate::fixed::words::schedule::{accumulations, Axis, Operand, Product, Section, Target};

/// Latency of `fold` for the first quad: start, frame buffer, normalise, butterfly, memory.
const FOLD: u64 = 8;
/// Cycles from the issue of a product to the first row of its accumulators: addresses 1, memories 2, selection 1, lanes
/// 4.
const LANES: u64 = 8;
/// Additional cycles where columns are left out: the list of columns is a memory of its own.
const COLUMNS: u64 = 2;
/// Cycles from a row until it can be read as an operand: rescaler, operand memory.
const OPERAND: u64 = 5;
/// Additional cycles for the product of an operand and μ, where a network gives one μ.
const SCALE: u64 = 3;
/// Additional cycles for the sum with v_00 in `relax`, where there is a network.
pub(super) const RELAX: u64 = 3;
/// Cycles from a row of a hidden layer until its images can be read as an operand.
const IMAGES: u64 = 5;
/// Cycles from the second row of the last layer until μ can be read, beyond its reductions: output 1, saturation 1, operand 1.
const ESTIMATE: u64 = 3;
/// Cycles from the last raw row of v_00 to its first replayed row.
const REPLAY: u64 = 4;
/// Cycles from the last row to the start of the search: rescaler, unfold, memory.
pub(super) const UNFOLD: u64 = 7;

/// Timing of a section's products, in cycles from its start; of the first section from that of the subarray.
pub(super) struct Timeline {
    /// Cycle of the first product, and of the last.
    pub first_issue: u64,
    pub last_issue: u64,
    /// Multiplications done; in the last group of rows some lanes may be idle.
    pub products: u64,
    /// Cycle in which the last row leaves the lanes.
    pub last_row: u64,
    /// Cycle from which μ can be read, after the layers of a network.
    pub known: u64,
}

/// When the products of a section may begin.
#[derive(Clone, Copy)]
pub(super) struct Begins {
    /// The first cycle in which one can be issued.
    pub issue: u64,
    /// When the first two operand vectors can be read, where other stages than the passes give them.
    pub given: [u64; 2],
}

impl Begins {
    /// Of the first section of a subarray.
    pub fn first(storage: &Storage) -> Begins {
        Begins { issue: FOLD + storage.lead as u64, given: [0; 2] }
    }
}

/// All products of a subarray as one section.
pub(super) fn whole(formats: &Formats, storage: &Storage) -> Timeline {
    let section = Section { accumulations: accumulations(formats), operands: Vec::new() };
    timeline(formats, storage, &section, Begins::first(storage))
}

/// The timing of a section.
pub(super) fn timeline(formats: &Formats, storage: &Storage, section: &Section, begins: Begins) -> Timeline {
    let (quads, per_parity) = (formats.quads as u64, formats.lanes_per_parity as u64);
    let network = formats.has_network();
    let lanes = LANES + if storage.listed { COLUMNS } else { 0 } + if formats.scales_operands() { SCALE } else { 0 };
    let first_issue = begins.issue;
    // `free` is the first cycle in which a product can be issued.
    let (mut now, mut free, mut products_done) = (first_issue, first_issue, 0);
    // When the vectors, the images of the layers, and at the end μ can be read.
    let (mut vectors, mut layers): (Vec<u64>, Vec<u64>) = Default::default();
    let mut last_row = 0;
    for (target, products) in &section.accumulations {
        // Rows of all groups but the last, where the rows of a vector end with the last quad.
        let groups = storage.groups_of(products);
        let last_rows = match target {
            Target::Vector(_) => quads - (groups as u64 - 1) * per_parity,
            Target::Layer(_) => per_parity,
        };
        let readable = |product: &Product| match (product.operand, target) {
            (_, Target::Vector(0)) | (Operand::One, _) => 0,
            (Operand::InputHigh | Operand::InputLow, _) => vectors[0],
            (Operand::Vector(index), _) => vectors[index].max(layers.last().copied().unwrap_or(0)),
            (Operand::Window | Operand::Shear(_, Axis::X), _) => begins.given[0],
            (Operand::Mask | Operand::Shear(_, Axis::Y), _) => begins.given[1],
            (Operand::Layer(index), _) => layers[index],
        };
        for group in 0..groups {
            now = free;
            for product in products {
                now = now.max(readable(product));
                let columns = storage.columns_of(product.matrix, group).len() as u64;
                let rows = if group + 1 == groups { last_rows } else { per_parity };
                products_done += 4 * columns * rows;
                now += columns;
            }
            free = now + storage.pause as u64;
        }
        last_row = now - 1 + lanes + last_rows - 1;
        let streamed = if storage.streamed { quads - 1 } else { 0 };
        match *target {
            Target::Vector(vector) => {
                if vector == 0 {
                    last_row += REPLAY - 1 + quads;
                }
                // The accumulation of the high limbs completes v_00.
                vectors.truncate(vector);
                vectors.push(last_row - streamed + OPERAND + if network { RELAX } else { 0 });
            }
            Target::Layer(layer) if layer + 1 < formats.layers.len() => layers.push(last_row + IMAGES),
            Target::Layer(_) => {
                // With one lane per parity it is the first of a group of its own.
                let second_row = now - 1 + lanes + u64::from(per_parity > 1);
                layers.push(second_row + ESTIMATE + (REDUCTION_CYCLES * REDUCTIONS) as u64);
            }
        }
    }
    let known = layers.last().copied().unwrap_or(0);
    Timeline { first_issue, last_issue: now - 1, products: products_done, last_row, known }
}
