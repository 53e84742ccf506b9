//! Lanes and memories: how many rows of a matrix are computed at a time, and in which memories its coefficients stand.

use super::resources::Resources;
use super::serial;
use super::storage::{storage_order, LaidOut, Storage};
use super::widths::{CaseMatrices, Widths};
use crate::fixed::words::formats::{Formats, MULTIPLIER_BITS};
use crate::fixed::words::quantised::Quantised;
use crate::fixed::words::schedule::{Kind, Matrix};
use crate::spec::board::{Board, EngineKind};
use crate::spec::scene::Scene;

/// Fewest lanes per parity; with fewer, the lanes would wait for the accumulators to be shifted out.
const MIN_LANES: usize = 4;

/// What is derived from a scene's matrices for one case.
pub struct Design {
    /// Widths, lanes and groups of rows.
    pub formats: Formats,
    /// The matrices as stored, pruned coefficients zero.
    pub quantised: Quantised,
    /// The coefficient memory's layout.
    pub storage: Storage,
}

/// Lays out the coefficient memory of a scene's cases and counts the resources, whether `board` has them or not.
pub fn fit(scene: &Scene, cases: &[CaseMatrices], board: &Board, widths: Widths) -> (Vec<Design>, Resources) {
    let Widths { formats, quantised } = widths;
    let order = storage_order(&formats);
    let (laid_out, resources) = match board.engine {
        EngineKind::Serial => serial::fit(&formats, &order, &quantised[0], board),
        EngineKind::Parallel => parallel(&formats, &order, &quantised, scene, cases, board),
    };
    let design = |((laid_out, mut quantised), case): ((LaidOut, Quantised), &CaseMatrices)| {
        let LaidOut { formats, storage, .. } = laid_out;
        storage.zero_pruned(&mut quantised, case.quads().len(), formats.lanes_per_parity);
        Design { formats, quantised, storage }
    };
    (laid_out.into_iter().zip(quantised).zip(cases).map(design).collect(), resources)
}

/// Lanes and memories of the parallel engine: the scene's number of lanes, else the most with which the memories fit, if
/// need be without frames that overlap or with some memories in distributed RAM. With the same number of lanes, the low limbs of
/// Cz⁺ have a memory of their own where that takes fewer block RAMs.
fn parallel(
    formats: &Formats,
    matrices: &[Matrix],
    quantised: &[Quantised],
    scene: &Scene,
    cases: &[CaseMatrices],
    board: &Board,
) -> (Vec<LaidOut>, Resources) {
    let (quads, prune_bits) = (formats.quads, scene.fixed.prune_bits);
    let written = scene.hardware.table_range.has_coefficients();
    let network = quantised.iter().find_map(|quantised| quantised.network.as_ref());
    // Rows of a layer leave before the next ones are complete.
    let most = network.and_then(|network| network.layers.iter().map(|layer| layer.inputs + 1).min()).unwrap_or(quads);
    let most = most.min(quads);
    let largest = |quantised: &Quantised| quantised.inverse.coefficients().map(|c| c.abs()).max().unwrap_or(0);
    let threshold = |quantised: &Quantised, matrix: Matrix| match matrix.kind {
        // Nor is anything left out that another specimen may need.
        _ if network.is_some() || written => 0,
        Kind::InverseHigh | Kind::InverseLow => largest(quantised) >> prune_bits,
        Kind::Ax => 2f64.powi(quantised.ax.exponent - prune_bits as i32) as i64,
        Kind::Ay => 2f64.powi(quantised.ay.exponent - prune_bits as i32) as i64,
        Kind::Layer(_) | Kind::Mask | Kind::Bias(_) => 0,
    };
    // Coefficients are written to one memory.
    let narrow_may = formats.inverse_low_bits > 0 && cases.len() == 1 && !written;
    let with = |groups: usize, narrow: bool| {
        let lanes_per_parity = quads.div_ceil(groups);
        let lay_out = |(quantised, case): (&Quantised, &CaseMatrices)| {
            let quads = case.quads().len();
            let formats =
                Formats { quads, lanes_per_parity, groups: quads.div_ceil(lanes_per_parity), ..formats.clone() };
            let mut order = matrices.to_vec();
            order.sort_by_key(|matrix| narrow && matrix.kind == Kind::InverseLow);
            let limits = order.into_iter().map(|matrix| (matrix, threshold(quantised, matrix))).collect();
            let storage = Storage::new(limits, quantised, quads, lanes_per_parity);
            let storage = if narrow { storage.with_narrow() } else { storage };
            LaidOut { formats, storage, parts: case.parts }
        };
        let mut laid_out: Vec<LaidOut> = quantised.iter().zip(cases).map(lay_out).collect();
        Storage::share(laid_out.iter_mut().map(|case| (&mut case.storage, case.formats.clone())));
        let resources = Resources::new(&laid_out, scene, board);
        (laid_out, resources)
    };
    let product = board.multipliers_for(MULTIPLIER_BITS, MULTIPLIER_BITS);
    // The multipliers of the other blocks do not depend on the number of lanes.
    let all = with(quads.div_ceil(most), false);
    let others = all.1.multipliers() - 4 * all.0[0].formats.lanes_per_parity * product;
    let left = (board.multipliers as usize).saturating_sub(others);
    let least = MIN_LANES.min(most);
    let per_parity = match scene.fixed.lanes {
        Some(lanes) => (lanes as usize / 4).clamp(1, most)..=(lanes as usize / 4).clamp(1, most),
        None => least..=(left / (4 * product)).clamp(least, most),
    };
    let mut groups: Vec<usize> = per_parity.rev().map(|lanes| quads.div_ceil(lanes)).collect();
    groups.dedup();
    // Where nothing fits, the design with the fewest block RAMs.
    let mut leanest: Option<(Vec<LaidOut>, Resources)> = None;
    for groups in groups {
        let memories = [false, true].into_iter().take(1 + usize::from(narrow_may));
        let designs = memories.map(|narrow| with(groups, narrow));
        let (fitting, others): (Vec<_>, Vec<_>) = designs.partition(|design| design.1.fits(board));
        if let Some(design) = fitting.into_iter().min_by_key(|design| design.1.rom_block_rams()) {
            return design;
        }
        let lean = others.into_iter().min_by_key(|design| design.1.block_rams());
        leanest = leanest.into_iter().chain(lean).min_by_key(|design| design.1.block_rams());
    }
    leanest.unwrap_or(all)
}
