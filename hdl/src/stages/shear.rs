//! Stage `shear`: where each contact has a μ of its own, makes the operands of a step of `relax` from those of p.
//!
//! ```text
//! p, labels -> butterfly, mean -> times μ of the taxel's contact -> butterfly, saturate -> operand
//! ```
//! p is kept as it leaves `relax`. From `start` on one quad leaves per cycle: those for Ax, then those for Ay.

use dermis_golden::estimate::segment::NONE;
use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::pass::POSITION_SHIFT;
use dermis_golden::fixed::stages::shear::{LATENCY, MEAN};
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Type};
use crate::primitives::{count_bits, count_saturations, hadamard, position_bits, saturated, SATURATION_BITS};

block! {
    /// Operands of p in, in the order of the quads; after `start`, operands of the products with Ax, then with Ay, the first
    /// [`LATENCY`] cycles later.
    pub struct Shear {
        data: usize,
        quads: usize,
        /// Largest number of contacts.
        contacts: usize,
    }
    ports ShearPorts {
        clock;
        reset;
        /// A frame starts: v_00 comes next, and saturations are counted from 0.
        in clear;
        /// Four parities of p as an operand, `data_bits` each, signed; valid with `operands_valid`.
        in operands: 4 * data;
        /// `operands` holds a quad.
        in operands_valid;
        /// All quads of p are there: their operands leave.
        in start;
        /// Address of the quad whose labels are needed; from the cycle after `start`, one per cycle.
        out label_address: count_bits(*quads);
        /// Contact of each lane of that quad, 0 for none, else 1 …; two cycles after `label_address`.
        in labels: 4 * label_bits(*contacts);
        /// Position of μ1 of each contact in mu_max/384, signed, contact 1 in the low bits; constant while operands leave.
        in positions_x: contacts * position_bits();
        /// The same of μ2; as `positions_x`.
        in positions_y: contacts * position_bits();
        /// Four parities, `data_bits` each, signed; valid with `sheared_valid`.
        out sheared: 4 * data;
        /// `sheared` holds a quad.
        out sheared_valid;
        /// Number of saturated words of this frame, 16 bits, stays at the largest count; final two cycles after the last quad.
        out saturations: SATURATION_BITS;
    }
}

impl Shear {
    /// For the contacts of `model`, if it has any.
    pub fn of_model(model: &Model) -> Option<Self> {
        let (formats, contacts) = (model.formats(), model.contacts());
        (contacts > 0).then_some(Shear { data: formats.data_bits as usize, quads: formats.quads, contacts })
    }

    /// The address of the next quad.
    fn after<'k>(&self, k: &'k Builder, quad: Expr<'k>) -> Expr<'k> {
        quad.is(self.quads as u64 - 1).mux(k.constant(quad.bits(), 0), quad.plus(1))
    }

    /// The position of a contact, 0 for none.
    fn position_of<'k>(&self, k: &'k Builder, label: Expr<'k>, all: Expr<'k>) -> Expr<'k> {
        let none = k.constant(position_bits(), 0);
        let own = |contact: usize| all.slice((contact - 1) * position_bits(), position_bits());
        let arms: Vec<(u64, Expr<'k>)> =
            (NONE + 1..=self.contacts).map(|contact| (contact as u64, own(contact))).collect();
        label.case(&arms, none)
    }
}

/// Width of the number of one of so many contacts.
fn label_bits(contacts: usize) -> usize {
    count_bits(contacts + 1)
}

impl Block for Shear {
    fn build<'k>(&self, k: &'k Builder, io: ShearPorts<Inside<'k>>) {
        let ShearPorts { rst, clear, operands, operands_valid: valid, start, labels, .. } = io;
        let positions = [io.positions_x, io.positions_y];
        let (bit, count) = (Type::unsigned(1), Type::unsigned(count_bits(self.quads)));
        let place = k.state("place", count, rst | clear, 0);
        k.when(valid, || place.set(self.after(k, *place)));
        let memory = k.memory("operands_of_p", self.quads, 4 * self.data, Contents::Undefined).holds(Holds::Sheared);
        memory.write(valid, *place, operands);

        k.comment("Two sweeps over the quads: for Ax, then for Ay.");
        let running = k.state("running", bit, rst | clear, 0);
        let second = k.state("second", bit, rst | clear, 0);
        let quad = k.state("quad", count, rst | clear, 0);
        let last = k.wire("last", quad.is(self.quads as u64 - 1));
        k.when(*running, || {
            quad.set(self.after(k, *quad));
            second.set(*second ^ last);
            running.set(!(last & *second));
        });
        k.when(start, || running.set(k.constant(1, 1)));
        io.label_address.set(*quad);
        let read = k.delay("read_1", k.delay("read", memory.read(*quad)));
        k.comment("Labels and the positions of an axis are registered: from memory to multiplier is too long a way.");
        let labels = k.delay("labels_held", labels);
        let axis = k.delay("axis_2", k.delay("axis_1", *second));
        let positions = k.delay("positions", axis.mux(positions[1], positions[0]));

        let lane = |lane: usize| {
            k.scope(&format!("taxel_{lane}"), || {
                let taxel = hadamard(read)[lane].round_shift(MEAN as usize).low(self.data);
                let taxel = k.delay("taxel", k.delay("mean", taxel.unsigned())).signed();
                let label_bits = label_bits(self.contacts);
                let label = labels.slice(lane * label_bits, label_bits);
                let position = k.delay("position", self.position_of(k, label, positions)).signed();
                let product = k.delay("product", taxel * position);
                // Below 3/4 of a taxel.
                k.delay("sheared", product.round_shift(POSITION_SHIFT as usize).low(self.data).unsigned())
            })
        };
        let taxels = k.wire("taxels", concat(&[3, 2, 1, 0].map(lane)));
        let parity = |parity: usize| {
            let sum = k.delay(&format!("sum_{parity}"), hadamard(taxels)[parity].unsigned());
            saturated(k, sum.signed(), self.data)
        };
        let parities = [3, 2, 1, 0].map(parity);
        io.sheared.delay(concat(&parities.map(|(word, _)| word)));
        let later = |name: &str, value: Expr<'_>| {
            let state = k.state(name, bit, rst | clear, 0);
            state.set(value);
            state.get()
        };
        let leaves = (1..LATENCY as usize - 1).fold(*running, |valid, cycle| later(&format!("valid_{cycle}"), valid));
        later("sheared_valid", leaves);
        let clipped = leaves.mux(concat(&parities.map(|(_, clips)| clips)), k.constant(4, 0));
        count_saturations(k, "saturations", rst | clear, clipped);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use dermis_golden::fixed::stages::shear::{cycles, shear};
    use dermis_golden::fixed::words::formats::Formats;
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_word, Reference};
    use crate::wire::Word;

    const CONTACTS: usize = 5;

    fn formats() -> Formats {
        Formats { quads: 6, ..Model::new(&Scene::builtin("sensor-1-noisy").unwrap()).unwrap().formats().clone() }
    }

    /// p so far, what leaves in each of the next cycles, and the labels to give.
    struct Shearing {
        formats: Formats,
        /// As [`Reference::clock`] has filled them since the first reset.
        p: Option<Vec<[i64; 4]>>,
        /// Quads on their way, the next first.
        leaving: VecDeque<Option<[i64; 4]>>,
        /// Quads of the sweeps still to read, the next first.
        asked: VecDeque<usize>,
        total: u64,
        quiet: usize,
    }

    /// The labels of a quad in every cycle: those that the memory gives two cycles after the address.
    fn labels_of(quad: usize) -> [usize; 4] {
        std::array::from_fn(|lane| (3 * quad + 2 * lane) % (CONTACTS + 1))
    }

    fn positions(inputs: &[Word]) -> Vec<[i64; 2]> {
        (0..CONTACTS).map(|contact| [6, 7].map(|input| inputs[input].signed(contact, position_bits()))).collect()
    }

    impl Reference for Shearing {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let known = self.p.is_some();
            let leaves = self.leaving.front().copied().flatten();
            vec![
                self.asked.front().map(|quad| Word::from(*quad as u64)),
                leaves.map(|quad| Word::of_fields(&quad, self.formats.data_bits as usize)),
                known.then(|| leaves.is_some().into()),
                (known && self.quiet > 2).then(|| self.total.min(0xffff).into()),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, clear, valid, start] = [0, 1, 3, 4].map(|input| inputs[input].number() == 1);
            self.quiet += 1;
            self.leaving.pop_front();
            self.leaving.resize(self.leaving.len().max(LATENCY as usize), None);
            self.asked.pop_front();
            if let (true, Some(p)) = (valid, &mut self.p) {
                if p.len() == self.formats.quads {
                    p.clear();
                }
                p.push([0, 1, 2, 3].map(|parity| inputs[2].signed(parity, self.formats.data_bits as usize)));
            }
            if let (true, Some(p)) = (start, &self.p) {
                let labels: Vec<[usize; 4]> = (0..p.len()).map(labels_of).collect();
                let (operands, clipped) = shear(&self.formats, p, &labels, &positions(inputs));
                self.total += u64::from(clipped);
                self.leaving.truncate(LATENCY as usize - 1);
                self.leaving.extend(operands.concat().into_iter().map(Some));
                self.asked = (0..p.len()).chain(0..p.len()).collect();
                assert_eq!(self.leaving.len() as u64, cycles(p.len()));
            }
            if self.leaving.iter().any(Option::is_some) {
                self.quiet = 0;
            }
            if rst || clear {
                (self.total, self.quiet) = (0, 0);
                (self.leaving, self.asked) = (VecDeque::new(), VecDeque::new());
                self.p = if rst { Some(Vec::new()) } else { self.p.as_ref().map(|_| Vec::new()) };
            }
        }
    }

    /// Frames of some steps: p with gaps, then the sweeps; some are cut off by a reset.
    fn stimulus(formats: &Formats) -> Vec<Vec<Word>> {
        let mut random = fastrand::Rng::with_seed(41);
        let (data, quads) = (formats.data_bits as usize, formats.quads);
        let label_bits = count_bits(CONTACTS + 1);
        let mut stimulus = Vec::new();
        for frame in 0..40 {
            let all: Vec<i64> = (0..CONTACTS).map(|_| random.i64(-384..=384)).collect();
            let positions = [&all[..], &all.iter().rev().copied().collect::<Vec<_>>()]
                .map(|all| Word::of_fields(all, position_bits()));
            let largest = if frame % 3 == 0 { (1 << (data - 1)) - 1 } else { 1000 };
            // What the label memory was asked two cycles ago.
            let mut asked: VecDeque<usize> = vec![0, 0].into();
            let mut sweep: VecDeque<usize> = VecDeque::new();
            let mut put = |random: &mut fastrand::Rng, [rst, clear, valid, start]: [bool; 4]| {
                let word = match largest {
                    1000 => random_word(random, 4 * data),
                    _ => Word::of_fields(&[(); 4].map(|()| if random.bool() { largest } else { -largest }), data),
                };
                let labels = labels_of(asked.pop_front().unwrap()).map(|label| label as i64);
                let labels = Word::of_fields(&labels, label_bits);
                stimulus.push(vec![
                    rst.into(),
                    clear.into(),
                    word,
                    valid.into(),
                    start.into(),
                    labels,
                    positions[0],
                    positions[1],
                ]);
                asked.push_back(sweep.pop_front().unwrap_or(0));
                if start {
                    sweep = (0..quads).chain(0..quads).collect();
                }
            };
            put(&mut random, [frame % 4 == 0, false, false, false]);
            put(&mut random, [false, true, false, false]);
            for _ in 0..random.usize(1..4) {
                for _ in 0..quads {
                    put(&mut random, [false, false, true, false]);
                    (0..random.usize(..3)).for_each(|_| put(&mut random, [false; 4]));
                }
                put(&mut random, [false, false, false, true]);
                let waits = if frame % 7 == 6 { quads } else { 2 * quads + 12 };
                (0..waits).for_each(|_| put(&mut random, [false; 4]));
                if frame % 7 == 6 {
                    break;
                }
            }
        }
        stimulus
    }

    #[test]
    fn each_taxel_is_multiplied_by_the_mu_of_its_contact() {
        let formats = formats();
        let stimulus = stimulus(&formats);
        let block = Shear { data: formats.data_bits as usize, quads: formats.quads, contacts: CONTACTS };
        let (p, leaving, asked) = (None, VecDeque::new(), VecDeque::new());
        check(&kernel_of(&block), &stimulus, &mut Shearing { formats, p, leaving, asked, total: 0, quiet: 0 });
    }
}
