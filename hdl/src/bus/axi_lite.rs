//! AXI4-Lite in front of the registers.

use dermis_golden::wire::registers::{ADDRESS_BITS, REGISTER_BITS};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// One access at a time: address and data of a write are taken together; a read and a write that wait take turns. The answer
/// comes two cycles later and stays until it is taken. A refused access is answered with SLVERR.
#[derive(dermis_hdl_derive::Block)]
pub struct AxiLite {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Address of a write in bytes; valid with `s_axil_awvalid`.
    pub s_axil_awaddr: Wire<In>,
    /// An address is offered; the sender holds it until `s_axil_awready`.
    pub s_axil_awvalid: Signal<In, Bit>,
    /// The address is accepted in this cycle.
    pub s_axil_awready: Signal<Out, Bit>,
    /// Data of a write; valid with `s_axil_wvalid`.
    pub s_axil_wdata: Wire<In>,
    /// Bytes of a write that count; valid with `s_axil_wvalid`.
    pub s_axil_wstrb: Wire<In>,
    /// Data are offered; the sender holds them until `s_axil_wready`.
    pub s_axil_wvalid: Signal<In, Bit>,
    /// The data are accepted in this cycle.
    pub s_axil_wready: Signal<Out, Bit>,
    /// 0 or SLVERR; valid with `s_axil_bvalid`.
    pub s_axil_bresp: Wire<Out>,
    /// The answer of a write; it is held until `s_axil_bready`.
    pub s_axil_bvalid: Signal<Out, Bit>,
    /// The answer is accepted in this cycle.
    pub s_axil_bready: Signal<In, Bit>,
    /// Address of a read in bytes; valid with `s_axil_arvalid`.
    pub s_axil_araddr: Wire<In>,
    /// An address is offered; the sender holds it until `s_axil_arready`.
    pub s_axil_arvalid: Signal<In, Bit>,
    /// The address is accepted in this cycle.
    pub s_axil_arready: Signal<Out, Bit>,
    /// Content of the register; valid with `s_axil_rvalid`.
    pub s_axil_rdata: Wire<Out>,
    /// 0 or SLVERR; valid with `s_axil_rvalid`.
    pub s_axil_rresp: Wire<Out>,
    /// The answer of a read; it is held until `s_axil_rready`.
    pub s_axil_rvalid: Signal<Out, Bit>,
    /// The answer is accepted in this cycle.
    pub s_axil_rready: Signal<In, Bit>,
    /// An access in this cycle.
    pub select: Signal<Out, Bit>,
    /// The access is a write; valid with `select`.
    pub write: Signal<Out, Bit>,
    /// Address in bytes; valid with `select`.
    pub address: Wire<Out>,
    /// Data of a write; valid with `select` and `write`.
    pub data: Wire<Out>,
    /// Bytes of a write that count; valid with `select` and `write`.
    pub strobe: Wire<Out>,
    /// Content of the register; valid in the cycle after `select`.
    pub content: Wire<In>,
    /// The access is an error; valid in the cycle after `select`.
    pub refused: Signal<In, Bit>,
    kernel: Body,
}

kernel_block!(
    AxiLite,
    clock clk,
    inputs [
        rst, s_axil_awaddr, s_axil_awvalid, s_axil_wdata, s_axil_wstrb, s_axil_wvalid, s_axil_bready, s_axil_araddr,
        s_axil_arvalid, s_axil_rready, content, refused
    ],
    outputs [
        s_axil_awready, s_axil_wready, s_axil_bresp, s_axil_bvalid, s_axil_arready, s_axil_rdata, s_axil_rresp,
        s_axil_rvalid, select, write, address, data, strobe
    ]
);

impl Default for AxiLite {
    fn default() -> Self {
        let strobe = REGISTER_BITS / 8;
        let block = AxiLite {
            clk: Default::default(),
            rst: Default::default(),
            s_axil_awaddr: Wire::new(ADDRESS_BITS),
            s_axil_awvalid: Default::default(),
            s_axil_awready: Default::default(),
            s_axil_wdata: Wire::new(REGISTER_BITS),
            s_axil_wstrb: Wire::new(strobe),
            s_axil_wvalid: Default::default(),
            s_axil_wready: Default::default(),
            s_axil_bresp: Wire::new(2),
            s_axil_bvalid: Default::default(),
            s_axil_bready: Default::default(),
            s_axil_araddr: Wire::new(ADDRESS_BITS),
            s_axil_arvalid: Default::default(),
            s_axil_arready: Default::default(),
            s_axil_rdata: Wire::new(REGISTER_BITS),
            s_axil_rresp: Wire::new(2),
            s_axil_rvalid: Default::default(),
            s_axil_rready: Default::default(),
            select: Default::default(),
            write: Default::default(),
            address: Wire::new(ADDRESS_BITS),
            data: Wire::new(REGISTER_BITS),
            strobe: Wire::new(strobe),
            content: Wire::new(REGISTER_BITS),
            refused: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel())
    }
}

fn kernel() -> Kernel {
    let k = Builder::new("axi_lite");
    let bit = Type::unsigned(1);
    let rst = k.input("rst", 1);
    let (awaddr, awvalid) = (k.input("s_axil_awaddr", ADDRESS_BITS), k.input("s_axil_awvalid", 1));
    let wdata = k.input("s_axil_wdata", REGISTER_BITS);
    let (wstrb, wvalid) = (k.input("s_axil_wstrb", REGISTER_BITS / 8), k.input("s_axil_wvalid", 1));
    let (bready, araddr) = (k.input("s_axil_bready", 1), k.input("s_axil_araddr", ADDRESS_BITS));
    let (arvalid, rready) = (k.input("s_axil_arvalid", 1), k.input("s_axil_rready", 1));
    let (content, refused) = (k.input("content", REGISTER_BITS), k.input("refused", 1));
    let asked = k.state("asked", bit, rst, 0).comment("An access was made in the last cycle.");
    let writes = k.register("writes", bit).comment("It was a write.");
    let read_next = k.state("read_next", bit, rst, 0).comment("The last access was a write.");
    let [bvalid, rvalid] = ["s_axil_bvalid", "s_axil_rvalid"].map(|name| k.state(name, bit, rst, 0));
    let rdata = k.register("s_axil_rdata", Type::unsigned(REGISTER_BITS));
    let error = k.register("error", bit);

    let idle = k.wire("idle", !(*asked | *bvalid | *rvalid));
    let can_write = k.wire("can_write", awvalid & wvalid);
    let reads = k.wire("s_axil_arready", idle & arvalid & (*read_next | !can_write));
    let write = k.wire("write", idle & can_write & !(arvalid & *read_next));
    k.wire("s_axil_awready", write);
    k.wire("s_axil_wready", write);
    let select = k.wire("select", reads | write);
    k.wire("address", write.mux(awaddr, araddr));
    k.wire("data", wdata);
    k.wire("strobe", wstrb);
    asked.set(select);
    k.when(select, || {
        writes.set(write);
        read_next.set(write);
    });
    k.when(*asked, || {
        rdata.set(content);
        error.set(refused);
    });
    bvalid.set((*asked & *writes) | (*bvalid & !bready));
    rvalid.set((*asked & !*writes) | (*rvalid & !rready));
    let response = concat(&[*error, k.constant(1, 0)]);
    k.wire("s_axil_bresp", response);
    k.wire("s_axil_rresp", response);
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
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
        check(AxiLite::default().kernel.kernel(), &stimulus, &mut Slave::default());
    }
}
