//! Taylor shift: moves the polynomials' centre by a grid step and halves the step, with additions and shifts only.

use dermis_golden::fixed::words::schedule::EXPONENTS;

use crate::block;
use crate::language::{Block, Builder, Expr, Inside};
use crate::primitives::search::polynomial_word::PolynomialWord;

block! {
    /// Polynomials and their `step` in; the polynomials about the new centre [`LATENCY`] cycles later: two cycles for
    /// x, two for y and the halving. No path has more than one adder: what a coefficient gains comes from two terms,
    /// one of which needs no sum of its own and is added in the first cycle of an axis, the other in the second.
    pub struct Taylor {
        layout: PolynomialWord,
    }
    ports TaylorPorts {
        clock;
        /// Move, bits 1:0 along x, −1, 0 or 1, signed, bits 3:2 along y, bit 4 halve the grid step afterwards; valid
        /// one cycle before `word`.
        in step: STEP_BITS;
        /// Polynomials, one per lane; taken in every cycle.
        in word: layout.bits();
        /// The polynomials about the new centre; four cycles after `word`.
        out moved: layout.bits();
    }
}

/// Cycles from `word` to `moved`.
pub const LATENCY: usize = 4;
/// Width of `step`, in bits.
const STEP_BITS: usize = 5;

impl Taylor {
    /// For polynomials in `layout`.
    pub fn new(layout: &PolynomialWord) -> Self {
        Taylor { layout: layout.clone() }
    }
}

impl Block for Taylor {
    fn build<'k>(&self, k: &'k Builder, io: TaylorPorts<Inside<'k>>) {
        let layout = &self.layout;
        let lane = |lane| k.scope(&format!("lane_{lane}"), || moved(k, layout, io.step, io.word, lane));
        let lanes: Vec<Vec<Expr>> = (0..layout.lanes).map(lane).collect();
        io.moved.set(layout.join(&lanes));
    }
}

/// The polynomial of one lane: moved along x, then along y, then halved.
fn moved<'k>(k: &'k Builder, layout: &PolynomialWord, step: Expr<'k>, word: Expr<'k>, lane: usize) -> Vec<Expr<'k>> {
    // One copy per lane, to limit fan-out; the attribute keeps synthesis from merging them. The step travels along the
    // pipeline: it is used in four cycles, its halving in the last.
    let mut left = step;
    let steps = [("dx_1", 0), ("dx_2", 0), ("dy_1", 2), ("dy_2", 0)].map(|(name, used)| {
        let register = k.register(name, left.slice(used, left.bits() - used).ty()).keep();
        register.set(left.slice(used, left.bits() - used));
        left = *register;
        left
    });
    let halving = steps[3].top();
    let start: Vec<Expr> = (0..layout.widths.len()).map(|n| layout.coefficient(word, n, lane)).collect();
    let along_x = shift(k, "x", &start, [steps[0], steps[1]]);
    let between: Vec<Expr> = (0..).zip(along_x).map(|(n, value)| k.delay(&format!("between_{n}"), value)).collect();
    let along_y = shift(k, "y", &between, [steps[2], steps[3]]);
    let halved = |(n, value): (usize, Expr<'k>)| {
        let value = k.wire(&format!("shifted_{n}"), value);
        let degree = (EXPONENTS[n].0 + EXPONENTS[n].1) as usize;
        // Of a word that is no wider the sign is left.
        let by = degree.min(value.bits() - 1);
        let half = if by > 0 { halving.mux(value.shift_right(by), value) } else { value };
        k.delay(&format!("moved_{n}"), half)
    };
    (0..).zip(along_y).map(halved).collect()
}

/// What a coefficient gains in a move: the terms an odd or an even number of orders above it, each times its binomial
/// factor.
#[derive(Clone, Copy)]
struct Gain<'k> {
    value: Expr<'k>,
    /// It changes its sign with the step.
    odd: bool,
    /// The value is a sum itself.
    sum: bool,
}

/// A move of the polynomial `w` along an axis in two cycles; `steps` are the steps of the first and the second cycle.
///
/// c0' = c0 + d (c1 + c3) + d² c2,  c1' = c1 + 2d c2 + 3d² c3,  c2' = c2 + 3d c3, with d one of −1, 0, 1. So d² is
/// 1 if there is a move, and d·c is c, −c or 0, where −c is the complement plus one.
fn shift<'k>(k: &'k Builder, axis: &str, w: &[Expr<'k>], steps: [Expr<'k>; 2]) -> Vec<Expr<'k>> {
    let along_x = axis == "x";
    let one = |n: usize| {
        let bits = w[n].bits();
        let (i, j) = EXPONENTS[n];
        let order = if along_x { i } else { j };
        // The term `by` above, times its binomial factor.
        let term = |by: u32| {
            let above = if along_x { (i + by, j) } else { (i, j + by) };
            let term = w.get(EXPONENTS.iter().position(|&e| e == above)?)?.resize(bits);
            let twice = term.shift_left(1).low(bits);
            let (value, sum) = match binomial(order + by, by) {
                2 => (twice, false),
                3 => ((twice + term.unsigned()).low(bits), true),
                _ => (term.unsigned(), false),
            };
            Some(Gain { value, odd: by % 2 == 1, sum })
        };
        let odd = match (term(1), term(3)) {
            (Some(one), Some(three)) => Some(Gain { value: (one.value + three.value).low(bits), odd: true, sum: true }),
            (one, _) => one,
        };
        let mut gains: Vec<Gain> = [odd, term(2)].into_iter().flatten().collect();
        gains.sort_by_key(|gain| gain.sum);
        let add = |to: Expr<'k>, Gain { value, odd, .. }: Gain<'k>, step: Expr<'k>| {
            let moved = value & step.at(0).repeat(bits);
            let sign = step.at(1);
            if odd {
                (to + (moved ^ sign.repeat(bits)) + sign).low(bits)
            } else {
                (to + moved).low(bits)
            }
        };
        let mut own = w[n].unsigned();
        if gains.first().is_some_and(|gain| !gain.sum) {
            own = add(own, gains.remove(0), steps[0]);
        }
        let own = k.delay(&format!("{axis}{n}_own"), own);
        let second = gains.first().map(|&gain| Gain { value: k.delay(&format!("{axis}{n}_gain"), gain.value), ..gain });
        second.map_or(own, |gain| add(own, gain, steps[1])).signed()
    };
    (0..w.len()).map(one).collect()
}

/// n over k for n up to 3.
fn binomial(n: u32, k: u32) -> u32 {
    (0..k).fold(1, |product, m| product * (n - m) / (m + 1))
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::{halve, taylor_shift};

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Pipeline};
    use crate::wire::Word;

    /// A move, and coefficients of which all but the constant have room to grow, as in the search.
    fn stimulus(layout: &PolynomialWord, cycles: usize) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(4);
        let inputs = |_| {
            let step = [random.i64(-1..2), random.i64(-1..2), random.i64(0..2)];
            let mut word = random_word(&mut random, layout.bits());
            for lane in 0..layout.lanes {
                let w = layout.get(&word, lane);
                let small = std::array::from_fn(|n| if n == 0 { w[0] } else { w[n] >> 5 });
                layout.put(&mut word, lane, &small);
            }
            vec![Word::of_fields(&step, 2), word]
        };
        (0..cycles).map(inputs).collect()
    }

    fn is_exact(lanes: usize, widths: &[u32]) {
        let layout = PolynomialWord::new(lanes, widths);
        let block = Taylor::new(&layout);
        let moved = |inputs: &[Word]| {
            let (dx, dy, halving) = (inputs[0].signed(0, 2), inputs[0].signed(1, 2), inputs[0].field(4, 1) == 1);
            let mut out = Word::default();
            for lane in 0..lanes {
                let moved = taylor_shift(&layout.get(&inputs[1], lane), dx, dy);
                layout.put(&mut out, lane, &if halving { halve(&moved) } else { moved });
            }
            vec![Some(out)]
        };
        // The step comes a cycle before its polynomials; before the first there is none.
        let mut step: Option<Word> = None;
        let delayed = |inputs: &[Word]| {
            let step = step.replace(inputs[0]);
            step.map_or(vec![None], |step| moved(&[step, inputs[1]]))
        };
        check(&kernel_of(&block), &stimulus(&layout, 2000), &mut Pipeline::new(LATENCY, 1, delayed));
    }

    /// Degrees 3, 2 and 1; the constant coefficient may wrap. Words no wider than their degree.
    #[test]
    fn the_shift_is_exact() {
        is_exact(4, &[27, 26, 26, 25, 25, 25, 20, 22, 21, 20]);
        is_exact(1, &[34, 33, 31, 30, 29, 28]);
        is_exact(2, &[19, 18, 17]);
        is_exact(1, &[14, 12, 12, 9, 9, 9, 3, 2, 3, 1]);
    }
}
