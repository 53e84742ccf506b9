//! Sums of 2^k frames, taxel by taxel, or their sliding or adaptive mean.

use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::stages::prepare::adaptive_mean::AdaptiveMean;
use dermis_golden::fixed::stages::prepare::Prepare;
use dermis_golden::fixed::Plan;
use dermis_golden::spec::scene::MeanKind;

use super::adaptive_mean::{AdaptiveKernel, MARK_BITS};
use super::arrays::Arrays;
use super::sliding_mean::{frames_bits, MeanPorts, SlidingMean};
use crate::block;
use crate::language::{Block, Builder, Contents, Inside, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::stream::beats::Stream;

block! {
    /// ```text
    /// s_axis --> read sum, hold word --> add --> memory; in the last of the 2^k frames also m_axis
    /// ```
    /// The sums have their own memory, so that frames arrive while the frame buffer is still being read. An early `tlast`
    /// in any of the frames restarts the sum; its partial sum leaves as a beat with `tlast`, at which `receive` drops the
    /// frame and sets `framing`. If `tlast` is missing in any of the frames, it is missing on the sum's last beat too. Modules
    /// `sliding_mean` and `adaptive_mean` have the kernels of the others.
    ///
    /// Where zeros run, the bit above a word says whether one is at its limit; it goes on with the number of frames.
    ///
    /// Latency two cycles, of a sliding mean three; all registers advance together while the output is free. Of an adaptive mean see there.
    pub struct Average {
        /// Taxels of a frame.
        taxels: usize,
        /// Width of a word in bits.
        bits: usize,
        /// k.
        power: usize,
        mean: MeanKind,
        /// The windows of an adaptive mean.
        adaptive: Option<AdaptiveMean>,
        marks: FrameMarks,
        /// Each has a sliding mean of its own; one where blocks are added up.
        arrays: Arrays,
        /// Tables are written.
        written: bool,
    }
    ports AveragePorts {
        clock;
        reset;
        /// A taxel's word, `bits` wide, two's complement, where zeros run with a bit above it; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: (bits + usize::from(marks.limited), arrays.bits);
        /// A taxel's sum, `bits + power` wide, two's complement; valid with `m_axis_tvalid`.
        source<Stream> m_axis: (bits + power, arrays.bits);
        /// Number of frames in a sliding mean, up to 2^(k+1) − 1, with the window of an adaptive one above; above it, where zeros run, whether one is at its limit. Valid
        /// with `m_axis_tvalid`. Otherwise one bit, 0.
        out frames: marks.bits();
        /// Of several arrays those whose means begin anew, a bit each; only while no frame is under way.
        in anew: arrays.anew_bits(*written);
    }
}

/// What goes with the words of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameMarks {
    /// Bits of the number of frames in a sliding mean, of an adaptive one with its window; 0 where the mean does not slide.
    pub frames_bits: usize,
    /// Whether a running zero is at its limit.
    pub limited: bool,
}

impl FrameMarks {
    /// Those of `model`.
    pub fn new(model: &Plan) -> Self {
        let input = &model.scene.input;
        let frames_bits = match input.mean {
            MeanKind::Block => 0,
            MeanKind::Sliding => frames_bits(input.average),
            MeanKind::Adaptive => MARK_BITS,
        };
        FrameMarks { frames_bits, limited: input.running_zero().is_some() }
    }

    /// Width of their wire, the number below; one constant bit where there is none.
    pub fn bits(self) -> usize {
        (self.frames_bits + usize::from(self.limited)).max(1)
    }
}

impl Average {
    /// Sums words of `bits` bits of `taxels` taxels over 2^k frames, or gives 2^k times their sliding or adaptive mean, as `prepare` has
    /// it, one for each of the `arrays`, whose tables are `written` or not; with the `marks` of a frame. `None` where each frame is its
    /// own sum.
    pub fn new(
        [taxels, bits]: [usize; 2],
        prepare: &Prepare,
        marks: FrameMarks,
        written: bool,
        arrays: Arrays,
    ) -> Option<Self> {
        let Prepare { average: power, mean, adaptive, .. } = prepare.clone();
        let averages = power > 0 || mean == MeanKind::Sliding;
        averages.then_some(Average { taxels, bits, power: power as usize, mean, adaptive, marks, arrays, written })
    }

    /// Whether the mean is adaptive.
    pub fn adapts(&self) -> bool {
        self.adaptive.is_some()
    }

    fn sums<'k>(&self, k: &'k Builder, io: AveragePorts<Inside<'k>>) {
        let (bit, index) = (Type::unsigned(1), Type::unsigned(count_bits(self.taxels)));
        let wide = self.bits + self.power;
        let sums = k.memory("sums", self.taxels, wide, Contents::Undefined).holds(Holds::Average);
        let taxel = k.state("taxel", index, io.rst, 0);
        let frame = k.state("frame", Type::unsigned(self.power), io.rst, 0);
        let [missed, held] = ["missed", "held"].map(|name| k.state(name, bit, io.rst, 0));
        let valid = io.m_axis.valid.state(io.rst, 0);
        let held_taxel = k.register("held_taxel", index);
        let [held_first, held_leaves, held_last] =
            ["held_first", "held_leaves", "held_last"].map(|name| k.register(name, bit));
        let (word, sofar) = (k.register("word", Type::unsigned(self.bits)), k.register("sofar", Type::unsigned(wide)));
        let (sum_out, last_out) = (io.m_axis.data.register(), io.m_axis.last.register());

        let zero = |bits: usize| k.constant(bits, 0);
        let at_end = k.wire("at_end", taxel.is(self.taxels as u64 - 1));
        let final_frame = k.wire("final_frame", frame.all());
        let early = k.wire("early", io.s_axis.last & !at_end);
        let before = held_first.mux(zero(wide), *sofar);
        let sum = k.wire("sum", (word.signed().extend(wide).unsigned() + before).low(wide));
        let moves = k.wire("moves", !*valid | io.m_axis.ready);
        io.s_axis.ready.set(moves & !io.rst);
        k.when(moves, || {
            held.set(io.s_axis.valid);
            valid.set(*held & *held_leaves);
            k.when(io.s_axis.valid, || {
                taxel.set((early | at_end).mux(zero(taxel.bits()), taxel.plus(1)));
                k.when(at_end, || {
                    frame.set(frame.plus(1));
                    missed.set(!final_frame & (*missed | !io.s_axis.last));
                });
                k.when(early, || {
                    frame.set(zero(self.power));
                    missed.set(zero(1));
                });
            });
            word.set(io.s_axis.data.low(self.bits));
            sofar.set(sums.read(*taxel));
            held_taxel.set(*taxel);
            held_first.set(frame.is(0));
            held_leaves.set(final_frame | early);
            held_last.set(io.s_axis.last & (early | !*missed));
            sum_out.set(sum);
            last_out.set(*held_last);
        });
        sums.write(moves & *held, *held_taxel, sum);
        if self.marks.limited {
            let (held_limit, frames) = (k.register("held_limit", bit), io.frames.register());
            k.when(moves, || {
                held_limit.set(io.s_axis.data.top());
                frames.set(*held_limit);
            });
        } else {
            io.frames.set(zero(1));
        }
    }
}

impl Block for Average {
    fn build<'k>(&self, k: &'k Builder, io: AveragePorts<Inside<'k>>) {
        let Average { taxels, bits, power, mean, ref adaptive, marks: FrameMarks { limited, .. }, arrays, written } =
            *self;
        let ports = MeanPorts {
            rst: io.rst,
            resets: arrays.resets(io.rst, io.anew, written),
            data: io.s_axis.data,
            array: io.s_axis.array,
            offered: io.s_axis.valid,
            tlast: io.s_axis.last,
            ready_out: io.s_axis.ready,
            data_out: io.m_axis.data,
            array_out: io.m_axis.array,
            valid_out: io.m_axis.valid,
            last_out: io.m_axis.last,
            ready: io.m_axis.ready,
            frames: io.frames,
        };
        match (mean, adaptive) {
            (MeanKind::Block, _) => self.sums(k, io),
            (_, Some(mean)) => AdaptiveKernel { mean, bits, limited, arrays }.build(k, ports),
            (_, None) => SlidingMean { taxels, bits, power, limited, arrays }.build(k, ports),
        }
    }
}

#[cfg(test)]
mod adaptive_tests;
#[cfg(test)]
pub(crate) mod tests;
