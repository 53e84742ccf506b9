//! Stage `estimate`: rows of the layers of a network in, images of the hidden layers as operands out, then μ.
//!
//! ```text
//! row -> round -> butterfly -> ReLU, saturate -> butterfly -> operand      hidden layers, four cycles
//! row -> round -> saturate -> reduced to the disc of mu_max -> μ           first two rows of the last layer
//! ```
//! A position outside the disc is reduced every fourth cycle: squares, their sum, comparison, reduction. μ is known after a
//! fixed number of cycles, whatever it is.

use dermis_golden::fixed::stages::estimate::{ln_sigma_range, OUTPUTS, REDUCTIONS, REDUCTION_CYCLES, REDUCTION_SHIFT};
use dermis_golden::fixed::stages::send::LN_SIGMA_BITS;
use dermis_golden::fixed::words::formats::MU_STEPS;
use dermis_golden::fixed::words::network::{LAST_SHIFT, OUTPUT_BITS, POSITION_BITS};
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Net, Type};
use crate::primitives::{count_bits, count_saturations, hadamard, position_bits, saturated, SATURATION_BITS};

block! {
    /// Rows of accumulators in; operands of the hidden layers four cycles later; μ and its σ after the second row of the last
    /// layer. One more quad, of both positions and two zeros, says that μ is known; no product reads it.
    pub struct Estimate {
        lane_bits: usize,
        data_bits: usize,
        /// Width of the word of both ln σ, which stands in the place of the score.
        score_bits: usize,
        network: Layers,
    }
    ports EstimatePorts {
        clock;
        reset;
        /// The rows of the first layer come next.
        in start;
        /// A subarray starts: its saturations are counted from 0.
        in clear;
        /// Otherwise μ is 0; constant from `start` until the next.
        in enabled;
        /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `valid`.
        in quad: 4 * lane_bits;
        /// `quad` holds a row of a layer.
        in valid;
        /// Images of four neurons in parities, or the positions of μ, `data_bits` each, signed; valid with `operands_valid`.
        out operands: 4 * data_bits;
        /// `operands` holds a quad, or μ is known.
        out operands_valid;
        /// Position of μ1 in mu_max/384, signed; valid from the last `operands_valid` until the next `start`.
        out position_x: position_bits();
        /// Position of μ2 in mu_max/384, signed; valid as `position_x`.
        out position_y: position_bits();
        /// ln of the standard deviation of μ1 over mu_max in the lower half, of μ2 in the upper, signed, in 1/384; valid as
        /// `position_x`.
        out ln_sigma: score_bits;
        /// μ is known; high for one cycle.
        out known;
        /// Number of saturated images and outputs of this subarray, 16 bits, stays at the largest count; final with μ.
        out saturations: SATURATION_BITS;
    }
}

/// Sizes of a network.
#[derive(Clone, Copy, Debug)]
struct Layers {
    /// Rows of all hidden layers, of whole groups.
    hidden: usize,
    /// Right shift of the hidden layers.
    shift: usize,
}

impl Estimate {
    /// For the network of `model`, if it has one.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (network, formats) = (model.quantised().network.as_ref()?, model.formats());
        Some(Estimate {
            lane_bits: formats.lane_bits as usize,
            data_bits: formats.data_bits as usize,
            score_bits: formats.score_bits as usize,
            network: Layers { hidden: formats.hidden_rows().sum(), shift: network.shift as usize },
        })
    }
}

/// A signed number within `range`.
fn clamped<'k>(k: &'k Builder, value: Expr<'k>, [least, most]: [i64; 2]) -> Expr<'k> {
    let [least, most] = [least, most].map(|limit| k.signed_constant(value.bits(), limit));
    let value = value.signed();
    value.less(least).mux(least, most.less(value).mux(most, value))
}

impl Block for Estimate {
    fn build<'k>(&self, k: &'k Builder, io: EstimatePorts<Inside<'k>>) {
        let EstimatePorts { rst, start, clear, enabled, quad, valid, .. } = io;
        let Layers { hidden, shift } = self.network;
        let bit = Type::unsigned(1);
        let later = |name: &str, value: Expr| {
            let state = k.state(name, bit, rst, 0);
            state.set(value);
            state.get()
        };
        let row = k.state("row", Type::unsigned(count_bits(hidden + 3)), rst | start, 0);
        let [is_first, is_second] = [0, 1].map(|own| row.is((hidden + own) as u64));
        let ended = k.wire("ended", row.is(hidden as u64 + 2));
        k.when(valid & !ended, || row.set(row.plus(1)));
        let is_hidden = k.wire("is_hidden", row.less(k.constant(row.bits(), hidden as u64)));
        let accumulator = |parity: usize| quad.slice(parity * self.lane_bits, self.lane_bits).signed();

        k.comment("Hidden layers: images above zero, in parities again.");
        let rounded =
            |parity: usize| k.delay(&format!("rounded_{parity}"), accumulator(parity).round_shift(shift)).unsigned();
        let parities = k.wire("rounded", concat(&[3, 2, 1, 0].map(rounded)));
        let images = self.data_bits - 3;
        let images: Vec<(Expr, Expr)> = (0..4)
            .map(|lane| {
                let sum = k.delay(&format!("sum_{lane}"), hadamard(parities)[lane]);
                let clips =
                    k.wire(&format!("clips_{lane}"), !sum.top() & sum.slice(images, sum.bits() - 1 - images).any());
                let image = sum.top().mux(k.constant(images, 0), sum.low(images).unsigned() | clips.repeat(images));
                (k.delay(&format!("image_{lane}"), k.constant(1, 0).concat(image)), clips)
            })
            .collect();
        let all = k.wire("images", concat(&[3, 2, 1, 0].map(|lane: usize| images[lane].0)));
        let operands = hadamard(all).map(|sum| sum.unsigned());
        let images_out = k.delay("images_out", concat(&[3, 2, 1, 0].map(|parity: usize| operands[parity])));
        let valid2 = later("valid2", later("valid1", valid & is_hidden));
        let images_valid = later("images_valid", later("valid3", valid2));

        k.comment("Last layer: μ from its first row, ln σ from its first and second.");
        let first = later("first", valid & is_first);
        let second = later("second", valid & is_second);
        let output = |place: usize, bits: u32| {
            let (parity, row) = OUTPUTS[place];
            let name = format!("output_{place}");
            let value = k.delay(&name, accumulator(parity).round_shift(shift + LAST_SHIFT as usize));
            let (value, clips) = saturated(k, value, bits as usize);
            (value, [first, second][row] & clips)
        };
        let outputs = [POSITION_BITS, POSITION_BITS, OUTPUT_BITS, OUTPUT_BITS];
        let outputs: Vec<(Expr, Expr)> = (0..4).map(|place| output(place, outputs[place])).collect();
        let ln_written = [later("ln_first", first), later("ln_second", second)];
        let ln_sigma: Vec<Expr> = [2, 3]
            .map(|place| {
                let (_, row) = OUTPUTS[place];
                let register = k.register(&format!("ln_{place}"), Type::signed(OUTPUT_BITS as usize));
                // It is needed with μ, much later.
                let value = k.delay(&format!("saturated_{place}"), outputs[place].0);
                k.when(ln_written[row], || register.set(clamped(k, value, ln_sigma_range())));
                register.get().extend(LN_SIGMA_BITS as usize).unsigned()
            })
            .into();
        io.ln_sigma.set(ln_sigma[1].concat(ln_sigma[0]));
        let known = self.position(k, [first, second], later, [outputs[0].0, outputs[1].0], [rst | start, enabled]);
        let position =
            ["position_y", "position_x"].map(|name| k.named(name).signed().extend(self.data_bits).unsigned());
        let position = k.constant(2 * self.data_bits, 0).concat(concat(&position));
        io.operands.set(known.mux(position, images_out));
        io.operands_valid.set(images_valid | known);

        let image_clips = k.delay(
            "image_clips",
            valid2.mux(concat(&[0, 1, 2, 3].map(|lane: usize| images[lane].1)), k.constant(4, 0)),
        );
        let output_clips = k.delay("output_clips", concat(&[0, 1, 2, 3].map(|place: usize| outputs[place].1)));
        count_saturations(k, "saturations", clear, image_clips | output_clips);
    }
}

impl Estimate {
    /// The position of μ, taken with `first` and reduced from `second` on; high for one cycle when it is known.
    fn position<'k>(
        &self,
        k: &'k Builder,
        [first, second]: [Expr<'k>; 2],
        later: impl Fn(&str, Expr<'k>) -> Expr<'k>,
        outputs: [Expr<'k>; 2],
        [restarts, enabled]: [Expr<'k>; 2],
    ) -> Expr<'k> {
        let axes: Vec<Net> = ["x", "y"].map(|name| k.register(name, Type::signed(POSITION_BITS as usize))).into();
        let left = k.state("left", Type::unsigned(count_bits(REDUCTION_CYCLES * REDUCTIONS + 1)), restarts, 0);
        let runs = k.wire("runs", left.any());
        k.when(runs, || left.set(left.minus(1)));
        k.when(second, || left.set(k.constant(left.bits(), (REDUCTION_CYCLES * REDUCTIONS) as u64)));
        let squares =
            [0, 1].map(|axis| k.delay(&format!("square_{axis}"), axes[axis].get() * axes[axis].get()).unsigned());
        let square = k.delay("square", squares[0] + squares[1]);
        let outside = k.delay("outside", k.constant(square.bits(), (MU_STEPS * MU_STEPS) as u64).less(square));
        // In the last cycle of a reduction `outside` is that of the position, which has not changed since the first.
        let reduces = k.wire("reduces", left.low(REDUCTION_CYCLES.trailing_zeros() as usize).is(1) & outside);
        for axis in [0, 1] {
            let position = axes[axis].get();
            let less = (position - position.round_shift(REDUCTION_SHIFT as usize)).low(POSITION_BITS as usize).signed();
            k.when(reduces, || axes[axis].set(less));
            k.when(first, || axes[axis].set(outputs[axis].signed()));
            let wide = position.extend(position_bits()).unsigned();
            k.wire(["position_x", "position_y"][axis], wide & enabled.repeat(position_bits()));
        }
        later("known", left.is(1))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use dermis_golden::fixed::stages::estimate::{estimate, images};
    use dermis_golden::fixed::stages::send::ln_sigma_word;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::scenes::learned;
    use crate::wire::Word;

    /// Cycles from a row to its operands, and from the second row of the last layer until μ is known.
    const LATENCY: [usize; 2] = [4, 2 + REDUCTION_CYCLES * REDUCTIONS];

    /// Inputs: reset, start, clear, whether μ is wanted, a row, whether there is one.
    struct Rows<'a> {
        model: &'a Model,
        hidden: usize,
        cycle: usize,
        rows: Vec<[i64; 4]>,
        enabled: bool,
        /// Operands by the cycle in which they are output; none before the first reset.
        operands: Option<BTreeMap<usize, [i64; 4]>>,
        saturations: u32,
        /// The cycle in which μ is known, and what it is then.
        known: Option<(usize, [Word; 3])>,
    }

    impl<'a> Rows<'a> {
        fn new(model: &'a Model, hidden: usize) -> Self {
            let (operands, known) = (None, None);
            Rows { model, hidden, cycle: 0, rows: Vec::new(), enabled: false, operands, saturations: 0, known }
        }

        fn mu(&self) -> [Word; 3] {
            let shift = self.model.quantised().network.as_ref().unwrap().shift;
            let found = estimate(shift, &self.rows[self.hidden..]);
            let position =
                found.position.map(|x| Word::of_fields(&[if self.enabled { x.into() } else { 0 }], position_bits()));
            [position[0], position[1], Word::of_fields(&[ln_sigma_word(found.ln_sigma).into()], 32)]
        }
    }

    impl Reference for Rows<'_> {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let due = self.operands.as_ref().map(|all| all.get(&self.cycle).copied());
            let known = self.known.filter(|(cycle, _)| *cycle <= self.cycle);
            let now = self.known.is_some_and(|(cycle, _)| cycle == self.cycle);
            let bits = self.model.formats().data_bits as usize;
            let of = |n: usize| known.map(|(_, mu)| mu[n]);
            let positions = known.filter(|_| now).map(|(_, mu)| {
                let [x, y] = [0, 1].map(|axis| mu[axis].signed(0, position_bits()));
                Word::of_fields(&[x, y, 0, 0], bits)
            });
            vec![
                of(2),
                of(0),
                of(1),
                self.operands.as_ref().map(|_| now.into()),
                positions.or(due.flatten().map(|quad| Word::of_fields(&quad, bits))),
                due.map(|quad| (quad.is_some() || now).into()),
                known.map(|_| u64::from(self.saturations).into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, start, clear, enabled, valid] = [0, 1, 2, 3, 5].map(|input| inputs[input].number() == 1);
            let formats = self.model.formats();
            let network = self.model.quantised().network.as_ref().unwrap();
            self.enabled = enabled;
            if valid && self.rows.len() < self.hidden + 2 {
                let row = [0, 1, 2, 3].map(|parity| inputs[4].signed(parity, formats.lane_bits as usize));
                self.rows.push(row);
                if self.rows.len() <= self.hidden {
                    let (quads, saturations) = images(formats, network.shift, &[row]);
                    self.saturations += saturations;
                    self.operands.iter_mut().for_each(|all| {
                        all.insert(self.cycle + LATENCY[0], quads[0]);
                    });
                } else if self.rows.len() == self.hidden + 2 {
                    self.saturations += estimate(network.shift, &self.rows[self.hidden..]).saturations;
                    self.known = Some((self.cycle + LATENCY[1], self.mu()));
                }
            }
            if start || rst {
                (self.rows, self.known) = (Vec::new(), None);
            }
            if clear {
                self.saturations = 0;
            }
            if rst {
                self.operands = Some(BTreeMap::new());
            }
            self.cycle += 1;
        }
    }

    #[test]
    fn rows_become_images_and_then_an_estimate() {
        let model = learned(4, 5, &[7], "mu_max = 0.3\n");
        let formats = model.formats();
        let hidden = 7usize.next_multiple_of(formats.lanes_per_parity);
        let (bits, shift) = (formats.lane_bits as usize, model.quantised().network.as_ref().unwrap().shift);
        let mut random = fastrand::Rng::with_seed(23);
        let mut stimulus: Vec<Vec<Word>> = Vec::new();
        let mut enabled = false;
        for frame in 0..60 {
            let mut put = |rst: bool, start: bool, row: Option<[i64; 4]>| {
                let word = Word::of_fields(&row.unwrap_or_default(), bits);
                // Several estimates may be made for one subarray.
                let clear = start && frame % 3 == 0;
                stimulus.push(vec![rst.into(), start.into(), clear.into(), enabled.into(), word, row.is_some().into()]);
                // From the cycle after the start on.
                enabled = if start { frame % 4 > 0 } else { enabled };
            };
            put(frame % 5 == 0, false, None);
            put(false, true, None);
            (0..6).for_each(|_| put(false, false, None));
            for row in 0..hidden + 2 + random.usize(..4) {
                (0..random.usize(..3)).for_each(|_| put(false, false, None));
                // Words of all sizes, some of which saturate.
                let large = if row < hidden { formats.image_bits() } else { LAST_SHIFT + POSITION_BITS };
                let limit = 1i64 << (shift + large - random.u32(..6)).min(formats.lane_bits - 1);
                put(false, false, Some([(); 4].map(|()| random.i64(-limit..limit))));
            }
            let wait = if frame % 7 == 6 { random.usize(..30) } else { LATENCY[1] + 10 };
            (0..wait).for_each(|_| put(false, false, None));
            if wait < LATENCY[1] {
                put(true, false, None);
            }
        }
        let block = Estimate::of_model(&model).unwrap();
        check(&kernel_of(&block), &stimulus, &mut Rows::new(&model, hidden));
    }
}
