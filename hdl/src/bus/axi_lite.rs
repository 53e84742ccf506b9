//! AXI4-Lite in front of the registers.

use super::bundles::{Accesses, AxiLitePins};
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

block! {
    /// One access at a time: address and data of a write are taken together; a read and a write that wait take turns.
    /// The answer comes two cycles later and stays until it is taken. A refused access is answered with SLVERR.
    #[derive(Default)]
    pub struct AxiLite {}
    ports AxiLitePorts {
        clock;
        reset;
        /// The bus.
        sink<AxiLitePins> s_axil: AxiLitePins { there: true };
        /// Accesses that it makes.
        source<Accesses> access: Accesses {};
    }
}

impl Block for AxiLite {
    fn build<'k>(&self, k: &'k Builder, io: AxiLitePorts<Inside<'k>>) {
        let bit = Type::unsigned(1);
        let asked = k.state("asked", bit, io.rst, 0).comment("An access was made in the last cycle.");
        let writes = k.register("writes", bit).comment("It was a write.");
        let read_next = k.state("read_next", bit, io.rst, 0).comment("The last access was a write.");
        let [bvalid, rvalid] = [io.s_axil.bvalid, io.s_axil.rvalid].map(|output| output.state(io.rst, 0));
        let rdata = io.s_axil.rdata.register();
        let error = k.register("error", bit);

        let idle = k.wire("idle", !(*asked | *bvalid | *rvalid));
        let can_write = k.wire("can_write", io.s_axil.awvalid & io.s_axil.wvalid);
        let reads = io.s_axil.arready.set(idle & io.s_axil.arvalid & (*read_next | !can_write));
        let write = io.access.write.set(idle & can_write & !(io.s_axil.arvalid & *read_next));
        io.s_axil.awready.set(write);
        io.s_axil.wready.set(write);
        let select = io.access.select.set(reads | write);
        io.access.address.set(write.mux(io.s_axil.awaddr, io.s_axil.araddr));
        io.access.data.set(io.s_axil.wdata);
        io.access.strobe.set(io.s_axil.wstrb);
        asked.set(select);
        k.when(select, || {
            writes.set(write);
            read_next.set(write);
        });
        k.when(*asked, || {
            rdata.set(io.access.content);
            error.set(io.access.refused);
        });
        bvalid.set((*asked & *writes) | (*bvalid & !io.s_axil.bready));
        rvalid.set((*asked & !*writes) | (*rvalid & !io.s_axil.rready));
        let response = concat(&[*error, k.constant(1, 0)]);
        io.s_axil.bresp.set(response);
        io.s_axil.rresp.set(response);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    /// What the slave does.
    #[derive(Clone, Copy, Default, PartialEq)]
    enum Phase {
        #[default]
        Idle,
        /// An access, a write or not, was made in the last cycle.
        Asked(bool),
        /// Answers a write or a read.
        Answers(bool),
    }

    #[derive(Default)]
    struct Slave {
        phase: Phase,
        was_write: bool,
        answer: Option<(Word, u64)>,
        reset: bool,
    }

    impl Slave {
        /// Whether there is an access now: `Some(is a write)`.
        fn access(&self, inputs: &[Word]) -> Option<bool> {
            let [aw, w, ar] = [2, 5, 8].map(|k| inputs[k].number() == 1);
            match (self.phase, aw && w, ar) {
                (Phase::Idle, true, true) => Some(!self.was_write),
                (Phase::Idle, true, false) => Some(true),
                (Phase::Idle, false, true) => Some(false),
                _ => None,
            }
        }
    }

    impl Reference for Slave {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let access = self.access(inputs);
            let bit = |bit: bool| self.reset.then(|| Word::from(bit));
            let response = self.answer.map(|(_, response)| Word::from(response));
            let address = if access == Some(true) { inputs[1] } else { inputs[7] };
            vec![
                bit(self.phase == Phase::Answers(true)),
                bit(self.phase == Phase::Answers(false)),
                self.answer.map(|(data, _)| data),
                bit(access == Some(false)),
                bit(access == Some(true)),
                bit(access == Some(true)),
                bit(access == Some(true)),
                bit(access.is_some()),
                (self.reset && access.is_some()).then_some(address),
                Some(inputs[3]),
                Some(inputs[4]),
                response,
                response,
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [bready, rready] = [6, 9].map(|k| inputs[k].number() == 1);
            let access = self.access(inputs);
            self.was_write = access.unwrap_or(self.was_write);
            if let Phase::Asked(_) = self.phase {
                self.answer = self.reset.then(|| (inputs[10], 2 * inputs[11].number()));
            }
            self.phase = match self.phase {
                Phase::Idle => access.map_or(Phase::Idle, Phase::Asked),
                Phase::Asked(write) => Phase::Answers(write),
                Phase::Answers(write) if if write { bready } else { rready } => Phase::Idle,
                same => same,
            };
            if inputs[0].number() == 1 {
                *self = Slave { reset: true, answer: self.answer, ..Slave::default() };
            }
        }
    }

    #[test]
    fn accesses_take_turns_and_answers_stay_until_they_are_taken() {
        let mut random = fastrand::Rng::with_seed(13);
        let mut busy = [4, 4, 4];
        let stimulus = (0..20_000).map(|cycle| {
            if cycle % 100 == 0 {
                busy = [(); 3].map(|()| random.u8(1..8));
            }
            let mut often = |k: usize| Word::from(random.u8(..8) < busy[k]);
            let [aw, w, ar, b, r] = [often(0), often(0), often(1), often(2), often(2)];
            vec![
                Word::from(cycle < 2 || random.u16(..600) == 0),
                Word::from(random.u64(..256)),
                aw,
                Word::from(u64::from(random.u32(..))),
                Word::from(random.u64(..16)),
                w,
                b,
                Word::from(random.u64(..256)),
                ar,
                r,
                Word::from(u64::from(random.u32(..))),
                Word::from(random.bool()),
            ]
        });
        let stimulus: Vec<_> = stimulus.collect();
        check(&kernel_of(&AxiLite::default()), &stimulus, &mut Slave::default());
    }
}
