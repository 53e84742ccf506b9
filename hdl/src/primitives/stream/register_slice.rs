//! Register slice of a stream.

use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel, Type};
use crate::primitives::stream::pass_through::wires;
use crate::wire::Wire;

/// ```text
/// s_axis --> register --> m_axis
/// ```
/// Data and handshake pass through registers in both directions, which lets sender and receiver be placed far apart, at
/// the cost of one beat every two cycles. If not wanted, the stream passes through on wires.
#[derive(dermis_hdl_derive::Block)]
pub struct RegisterSlice {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Data of the beat; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// Data of the beat; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    RegisterSlice,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
    outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast]
);

impl RegisterSlice {
    /// For beats of `bits` bits; a register if `wanted`, otherwise wires.
    pub fn new(bits: usize, wanted: bool) -> Self {
        let block = RegisterSlice {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            kernel: Body::default(),
        };
        block.bind(match wanted {
            true => kernel(bits),
            false => wires("register_slice", bits, "No register slice: sender and receiver are placed close together.")
                .finish(),
        })
    }
}

fn kernel(bits: usize) -> Kernel {
    let k = Builder::new("register_slice");
    let rst = k.input("rst", 1);
    let (data, given) = (k.input("s_axis_tdata", bits), k.input("s_axis_tvalid", 1));
    let (last, taken) = (k.input("s_axis_tlast", 1), k.input("m_axis_tready", 1));
    let tdata = k.register("m_axis_tdata", Type::unsigned(bits));
    let valid = k.state("m_axis_tvalid", Type::unsigned(1), rst, 0);
    let tlast = k.register("m_axis_tlast", Type::unsigned(1));
    k.wire("s_axis_tready", !*valid);
    k.when(!*valid, || {
        tdata.set(data);
        tlast.set(last);
    });
    valid.set(valid.mux(!taken, given));
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    /// The beat in the register; undefined before the first reset.
    struct Slice(Option<Option<(Word, Word)>>);

    impl Reference for Slice {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let (beat, bit) = (self.0.flatten(), |bit: bool| self.0.map(|_| Word::from(bit)));
            // In the order of the kernel's signals.
            vec![beat.map(|beat| beat.0), bit(beat.is_some()), beat.map(|beat| beat.1), bit(beat.is_none())]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, valid, ready] = [0, 2, 4].map(|k| inputs[k].number() == 1);
            self.0 = match self.0 {
                _ if rst => Some(None),
                Some(Some(_)) if ready => Some(None),
                Some(None) => Some(valid.then_some((inputs[1], inputs[3]))),
                same => same,
            };
        }
    }

    #[test]
    fn beats_pass_one_at_a_time() {
        let mut stimulus = random_words(4000, &[1, 33, 1, 1, 1]);
        stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 101 == 0).into());
        check(RegisterSlice::new(33, true).kernel.kernel(), &stimulus, &mut Slice(None));
    }
}
