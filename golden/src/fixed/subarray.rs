//! One subarray: the stages from frame buffer to force memory.

use super::plan::contents::{CasePlan, Plan};
use super::stages::estimate::{estimate, images, Estimate};
use super::stages::pass::{join_limbs, pass, swap, Operands};
use super::stages::search::{search, Block, SearchResult};
use super::stages::send::ln_sigma_word;
use super::stages::{fold, forces, normalise, receive, relax, rescale, unfold};
use super::words::formats::{force_shift, Formats};
use super::words::network::WordNetwork;
use super::words::quantised::Quantised;
use super::words::schedule::{by_limbs, is_transposed, layer, schedule, EXPONENTS};
use crate::board::EngineKind;
use crate::symmetry::quads::Quads;

/// The quads that a stage passes on.
type QuadStream = Vec<[i64; 4]>;

/// The result for a subarray and the words that each stage passed on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubarrayTrace {
    /// Whether the scene's condition is met.
    pub condition: bool,
    /// Left shift of `normalise`.
    pub normalise: u32,
    /// Right shift of `rescale`.
    pub rescale: u32,
    /// Number of words that `rescale` saturated, with a network also `estimate` and `relax`.
    pub saturations: u32,
    /// Result of the search, with p(μ*).
    pub found: SearchResult,
    /// Output of `normalise`.
    pub normalised: QuadStream,
    /// Output of `fold`.
    pub folded: QuadStream,
    /// Output of `pass`: one quad per row and accumulation.
    pub passed: QuadStream,
    /// Output of `estimate`: operands of the images of each layer, then the positions of μ and two zeros; empty without a
    /// network.
    pub estimated: QuadStream,
    /// Output of `rescale`.
    pub rescaled: QuadStream,
    /// Output of `relax`: p after each step; empty without a network.
    pub relaxed: QuadStream,
    /// Output of `unfold`.
    pub unfolded: QuadStream,
}

impl SubarrayTrace {
    /// Computes the subarray with these `codes`, row-major in it.
    pub fn new(plan: &Plan, case: &CasePlan, codes: &[i32]) -> Self {
        let CasePlan { formats, quantised, .. } = case;
        let layout = case.layout();
        let received = receive::receive(codes, plan.noise_floor);
        let condition = received.meets(plan.scene.partition.condition);
        let samples: Vec<i64> = codes.iter().map(|&code| i64::from(code)).collect();
        let left = normalise::shift(received.magnitude, formats.input_bits);
        let normalised = normalise::normalise(&layout.pack(&samples), left);
        let folded = fold::fold(&normalised);

        let mut operands = Operands::of_input(&folded, formats);
        let (mut passed, mut rescaled, mut unfolded) = (Vec::new(), Vec::new(), Vec::new());
        let (mut estimated, mut relaxed) = (Vec::new(), Vec::new());
        let (mut right, mut saturations) = (0, 0);
        let mut polynomials = vec![[[0i64; 10]; 4]; formats.quads];
        let mut told = Estimate::default();
        let (mut first, mut values) = (Vec::new(), Vec::new());
        for (k, products) in schedule(formats).iter().enumerate() {
            let limbs: Vec<QuadStream> =
                by_limbs(products).iter().map(|part| pass(formats, quantised, layout, part, &operands)).collect();
            let accumulators = join_limbs(formats, &limbs);
            if k == 0 {
                right = rescale::shift(formats, rescale::raw_length(&accumulators));
            }
            let shift = if k == 0 { right } else { formats.a_shift };
            let (words, clipped) = rescale::rescale(formats, &accumulators, shift);
            saturations += clipped;
            match plan.board.engine {
                EngineKind::Parallel => passed.extend(limbs.concat()),
                EngineKind::Serial => passed.extend(accumulators),
            }
            rescaled.extend(&words);
            if let Some(network) = &quantised.network {
                let previous = if k == 0 { vec![[0; 4]; formats.quads] } else { first.clone() };
                let (sums, next, clipped) = relax::relax(formats, &previous, &words);
                saturations += clipped;
                operands.vectors.push(next);
                relaxed.extend(&sums);
                values = unfold::unfold(&sums, 0);
                unfolded.extend(&values);
                if k == 0 {
                    first = sums;
                    told = ask(formats, network, layout, quantised, &mut operands, &mut estimated);
                    saturations += told.saturations;
                    told.position = if condition { told.position } else { [0; 2] };
                    operands.position = told.position.map(i64::from);
                    estimated.push([operands.position[0], operands.position[1], 0, 0]);
                }
                continue;
            }
            operands.vectors.push(rescale::operand(formats, &words));
            // A transposed result is transposed back on its way to the search memory.
            let transposed = is_transposed(products);
            let mut taxels = unfold::unfold(&words, EXPONENTS[k].0 + EXPONENTS[k].1);
            if transposed {
                taxels.iter_mut().for_each(|quad| *quad = swap(*quad));
            }
            for (address, values) in taxels.iter().enumerate() {
                let to = if transposed { layout.transposed(address) } else { address };
                for (w, &value) in polynomials[to].iter_mut().zip(values) {
                    w[k] = value;
                }
            }
            unfolded.extend(taxels);
        }
        let found = match plan.has_network() {
            true => {
                let score = condition.then(|| i64::from(ln_sigma_word(told.ln_sigma)));
                SearchResult { sweeps: Vec::new(), position: told.position, score, values }
            }
            false => search(layout, Block::new(layout, polynomials), condition && plan.searches()),
        };
        SubarrayTrace {
            condition,
            normalise: left,
            rescale: right,
            saturations,
            found,
            normalised,
            folded,
            passed,
            estimated,
            rescaled,
            relaxed,
            unfolded,
        }
    }

    /// Forces of the subarray's taxels, row-major in it; `threshold` is in force LSBs.
    pub fn forces(&self, case: &CasePlan, threshold: i64) -> Vec<forces::Force> {
        let formats = &case.formats;
        let mu = self.found.position.map(|x| forces::mu_word(formats, x));
        let shift = force_shift(formats, self.normalise, self.rescale);
        let values = case.layout().unpack(&self.found.values);
        values.into_iter().map(|value| forces::force(formats, value, mu, shift, threshold)).collect()
    }
}

/// μ by the network; the images of its layers become operands. Those of whole groups of rows are passed on, zeros beyond the
/// last.
fn ask(
    formats: &Formats,
    network: &WordNetwork,
    layout: Quads,
    quantised: &Quantised,
    operands: &mut Operands,
    estimated: &mut QuadStream,
) -> Estimate {
    let mut saturations = 0;
    for (index, rows) in formats.hidden_rows().enumerate() {
        let accumulators = pass(formats, quantised, layout, &layer(index), operands);
        let (next, clipped) = images(formats, network.shift, &accumulators);
        saturations += clipped;
        estimated.extend(&next);
        estimated.extend(vec![[0; 4]; rows - next.len()]);
        operands.layers.push(next);
    }
    let rows = pass(formats, quantised, layout, &layer(formats.layers.len() - 1), operands);
    let told = estimate(network.shift, &rows);
    Estimate { saturations: saturations + told.saturations, ..told }
}
