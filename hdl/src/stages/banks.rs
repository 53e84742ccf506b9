//! Stage `receive` where the case is chosen per frame: a frame buffer per case, and the choice of the case.
//!
//! Every buffer receives every code, each in the layout of its own subarrays; reads come from the buffer of the chosen
//! case. All buffers fill and become free together.

use super::receive::{Receive, ReceivePorts};
use super::Choose;
use crate::language::{Builder, Expr, Inside, Outside};
use crate::primitives::expression_by_case;

impl Receive {
    /// All `buffers` get what the stage gets; its outputs are those of the chosen one. `full` is high once the case has been
    /// chosen too.
    pub(super) fn build_banks<'k>(
        k: &'k Builder,
        io: ReceivePorts<Inside<'k>>,
        choose: &'k Choose,
        buffers: &'k [Receive],
    ) {
        let bank = |(number, buffer): (usize, &'k Receive)| k.instance(&format!("banks__{number}"), buffer);
        let banks: Vec<ReceivePorts<Outside<'k>>> = buffers.iter().enumerate().map(bank).collect();
        let choose = k.instance("choose", choose);
        for bank in &banks {
            bank.s_axis.data.set(io.s_axis.data);
            bank.s_axis.valid.set(io.s_axis.valid);
            bank.s_axis.last.set(io.s_axis.last);
            bank.free.set(io.free);
            // An address beyond a smaller buffer is meant for another one; its data are not used.
            bank.quad_address.set(io.quad_address.low(bank.quad_address.bits()));
            bank.part.set(io.part.low(bank.part.bits()));
            bank.reported.set(io.reported);
            bank.floor.set(io.floor);
        }
        // All buffers fill and become free together: the handshake of the first is that of all.
        let Some(first) = banks.first() else { return };
        choose.code.set(io.s_axis.data);
        choose.accept.set(first.accept);
        choose.tlast.set(io.s_axis.last);
        choose.free.set(io.free);
        io.s_axis.ready.set(first.s_axis.ready);
        io.accept.set(first.accept);
        io.taken_word.set(first.taken_word);
        io.row_end.set(first.row_end);
        io.dropped.set(first.dropped);
        io.framing.set(first.framing);
        for (number, bank) in banks.iter().enumerate() {
            k.unused([bank.full, bank.case_index]);
            if number > 0 {
                k.unused([bank.s_axis.ready, bank.accept, bank.taken_word, bank.row_end, bank.dropped, bank.framing]);
            }
        }
        io.full.set(choose.settled);
        io.case_index.set(choose.case_index);
        let chosen = |of: fn(&ReceivePorts<Outside<'k>>) -> Expr<'k>| {
            let each: Vec<Expr> = banks.iter().map(of).collect();
            expression_by_case(choose.case_index, &each).unwrap_or(each[0])
        };
        io.quad.set(chosen(|bank| bank.quad));
        io.magnitude.set(chosen(|bank| bank.magnitude));
        io.positive.set(chosen(|bank| bank.positive));
        io.negative.set(chosen(|bank| bank.negative));
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::Model;
    use dermis_golden::spec::scene::Scene;

    use super::super::choose::tests::Expected;
    use super::super::receive::tests::FrameBuffer;
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
    use crate::language::Change;
    use crate::wire::Word;

    /// A frame buffer for each case, and the choice.
    struct Banks<'a> {
        buffers: Vec<FrameBuffer>,
        choice: Expected<'a>,
    }

    impl Reference for Banks<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [case_index, settled] = <[_; 2]>::try_from(self.choice.outputs(&[])).unwrap();
            let settles = settled.is_some_and(|settled| settled.number() == 1);
            let index = case_index.map_or(0, |case_index| case_index.number() as usize);
            let mut outputs = self.buffers[index].outputs(inputs);
            (outputs[5], outputs[6]) = (settled, case_index);
            // Before the first choice no buffer is chosen; what is gathered of a subarray is that of the chosen case.
            outputs[7] = outputs[7].filter(|_| case_index.is_some());
            outputs[8..11].iter_mut().for_each(|gathered| *gathered = gathered.filter(|_| settles));
            outputs
        }

        fn clock(&mut self, inputs: &[Word]) {
            let accept = self.buffers[0].outputs(inputs)[1].unwrap();
            self.choice.clock(&[inputs[0], accept, inputs[3], inputs[4], inputs[1]]);
            self.buffers.iter_mut().for_each(|buffer| buffer.clock(inputs));
        }
    }

    #[test]
    fn outputs_are_those_of_the_chosen_bank() {
        let text = "name = \"banks\"\n[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 2.0\npitch_y_mm = 2.0\n\
                    thickness_mm = 2.0\n[partition]\ncases = [0, 1]\n[search]\nnoise_floor_MPa = 0.0\n";
        let model = Model::new(&Scene::parse(text, "banks.toml").unwrap()).unwrap();
        let choose = Choose::new(&model);
        let banks = || Banks {
            buffers: (0..2).map(|case| FrameBuffer::new(&model, case)).collect(),
            choice: Expected::new(&choose),
        };
        let (mut state, mut random) = (banks(), fastrand::Rng::with_seed(7));
        let sizes = model.cases().iter().map(|case| (case.formats.quads * case.parts.len(), case.parts.len()));
        let (quads, parts) = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1))).unwrap();
        let cycle = |cycle: usize| {
            let beat = state.buffers[0].reception.beat(&mut random, cycle);
            let settled = state.choice.outputs(&[])[1].is_some_and(|settled| settled.number() == 1);
            let free = settled && random.u8(..40) == 0;
            let [address, part] = [quads, parts].map(|limit| Word::from(random.u64(..limit as u64)));
            let reported = random.u8(..20) == 0;
            let inputs = [&beat[..], &[free.into(), address, part, reported.into(), Word::default()]].concat();
            state.clock(&inputs);
            inputs
        };
        let stimulus: Vec<Vec<Word>> = (0..8000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            subject_of!(
                Receive::new(&model),
                changes,
                inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, quad_address, part, reported, floor],
                outputs [
                    s_axis_tready, accept, taken_word, row_end, dropped, full, case_index, quad, magnitude, positive,
                    negative, framing
                ],
            )
        };
        let defects = [Change::value("", "choose__accept", |k| k.constant(1, 0))];
        check_with_defects(subject, &stimulus, banks, &defects);
    }
}
