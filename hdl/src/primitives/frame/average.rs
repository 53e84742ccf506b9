//! Sums of 2^k frames, taxel by taxel, or their sliding mean.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::Plan;
use dermis_golden::spec::scene::MeanKind;
use rust_hdl::prelude::*;

use super::sliding_mean;
use crate::kernel_block;
use crate::language::{Body, Builder, Contents, Kernel, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::pass_through::low_wires;
use crate::wire::Wire;

/// ```text
/// s_axis --> read sum, hold word --> add --> memory; in the last of the 2^k frames also m_axis
/// ```
/// The sums have their own memory, so that frames arrive while the frame buffer is still being read. An early `tlast`
/// in any of the frames restarts the sum; its partial sum leaves as a beat with `tlast`, at which `receive` drops the
/// frame and sets `framing`. If `tlast` is missing in any of the frames, it is missing on the sum's last beat too. With
/// k = 0 the stream passes through. Module `sliding_mean` has the kernel of a sliding mean.
///
/// Where zeros run, the bit above a word says whether one is at its limit; it goes on with the number of frames.
///
/// Latency two cycles, of a sliding mean three; all registers advance together while the output is free.
#[derive(dermis_hdl_derive::Block)]
pub struct Average {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's word, `bits` wide, two's complement, where zeros run with a bit above it; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's sum, `bits + power` wide, two's complement; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of the sums; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Number of frames in a sliding mean, up to 2^(k+1) − 1; above it, where zeros run, whether one is at its limit. Valid
    /// with `m_axis_tvalid`. Otherwise one bit, 0.
    pub frames: Wire<Out>,
    kernel: Body,
}

kernel_block!(
    Average,
    clock clk,
    inputs [rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready],
    outputs [s_axis_tready, m_axis_tdata, m_axis_tvalid, m_axis_tlast, frames]
);

/// What goes with the words of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameMarks {
    /// Bits of the number of frames in a sliding mean; 0 where the mean does not slide.
    pub frames_bits: usize,
    /// Whether a running zero is at its limit.
    pub limited: bool,
}

impl FrameMarks {
    /// Those of `model`.
    pub fn new(model: &Plan) -> Self {
        let input = &model.scene.input;
        let frames_bits = if input.slides() { sliding_mean::frames_bits(input.average) } else { 0 };
        FrameMarks { frames_bits, limited: input.running_zero().is_some() }
    }

    /// Width of their wire, the number below; one constant bit where there is none.
    pub fn bits(self) -> usize {
        (self.frames_bits + usize::from(self.limited)).max(1)
    }
}

impl Average {
    /// Sums words of `bits` bits of `taxels` taxels over 2^`power` frames, or gives 2^`power` times their sliding mean; with
    /// the `marks` of a frame.
    pub fn new(taxels: usize, bits: usize, power: u32, mean: MeanKind, marks: FrameMarks) -> Self {
        let slides = mean == MeanKind::Sliding;
        let offered_bits = bits + usize::from(marks.limited);
        let block = Average {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(offered_bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits + power as usize),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            frames: Wire::new(marks.bits()),
            kernel: Body::default(),
        };
        block.bind(match power {
            _ if slides => sliding_mean::kernel(taxels, bits, power, marks.limited),
            0 => {
                let k = low_wires("average", [offered_bits, bits], "No averaging: the stream passes through.");
                let none = k.constant(1, 0);
                k.wire("frames", if marks.limited { k.named("s_axis_tdata").top() } else { none });
                k.finish()
            }
            _ => kernel(taxels, bits, power as usize, marks.limited),
        })
    }
}

fn kernel(taxels: usize, bits: usize, power: usize, limited: bool) -> Kernel {
    let k = Builder::new("average");
    let (bit, index, wide) = (Type::unsigned(1), Type::unsigned(count_bits(taxels)), bits + power);
    let (rst, data) = (k.input("rst", 1), k.input("s_axis_tdata", bits + usize::from(limited)));
    let [offered, tlast, ready] = ["s_axis_tvalid", "s_axis_tlast", "m_axis_tready"].map(|name| k.input(name, 1));
    let sums = k.memory("sums", taxels, wide, Contents::Undefined).holds(Holds::Average);
    let taxel = k.state("taxel", index, rst, 0);
    let frame = k.state("frame", Type::unsigned(power), rst, 0);
    let [missed, held, valid] = ["missed", "held", "m_axis_tvalid"].map(|name| k.state(name, bit, rst, 0));
    let held_taxel = k.register("held_taxel", index);
    let [held_first, held_leaves, held_last] =
        ["held_first", "held_leaves", "held_last"].map(|name| k.register(name, bit));
    let (word, sofar) = (k.register("word", Type::unsigned(bits)), k.register("sofar", Type::unsigned(wide)));
    let (sum_out, last_out) = (k.register("m_axis_tdata", Type::unsigned(wide)), k.register("m_axis_tlast", bit));

    let zero = |bits: usize| k.constant(bits, 0);
    let at_end = k.wire("at_end", taxel.is(taxels as u64 - 1));
    let final_frame = k.wire("final_frame", frame.all());
    let early = k.wire("early", tlast & !at_end);
    let before = held_first.mux(zero(wide), *sofar);
    let sum = k.wire("sum", (word.signed().extend(wide).unsigned() + before).low(wide));
    let moves = k.wire("moves", !*valid | ready);
    k.wire("s_axis_tready", moves & !rst);
    k.when(moves, || {
        held.set(offered);
        valid.set(*held & *held_leaves);
        k.when(offered, || {
            taxel.set((early | at_end).mux(zero(taxel.bits()), taxel.plus(1)));
            k.when(at_end, || {
                frame.set(frame.plus(1));
                missed.set(!final_frame & (*missed | !tlast));
            });
            k.when(early, || {
                frame.set(zero(power));
                missed.set(zero(1));
            });
        });
        word.set(data.low(bits));
        sofar.set(sums.read(*taxel));
        held_taxel.set(*taxel);
        held_first.set(frame.is(0));
        held_leaves.set(final_frame | early);
        held_last.set(tlast & (early | !*missed));
        sum_out.set(sum);
        last_out.set(*held_last);
    });
    sums.write(moves & *held, *held_taxel, sum);
    if limited {
        let (held_limit, frames) = (k.register("held_limit", bit), k.register("frames", bit));
        k.when(moves, || {
            held_limit.set(data.top());
            frames.set(*held_limit);
        });
    } else {
        k.wire("frames", zero(1));
    }
    k.finish()
}

#[cfg(test)]
pub(crate) mod tests;
