//! Between the bytes of a link and the engine's streams.

use dermis_golden::wire::link::Identity;
use rust_hdl::prelude::*;

use super::{
    CounterRam, Crc, FrameIngress, Packer, Parser, Requests, Resultants, Shape, SlipDecoder, SlipEncoder, Sources,
};
use crate::language::RustHdl;
use crate::primitives::RegisterSlice;
use crate::wire::Wire;

/// ```text
/// bytes in  -> slip_decoder -> parser -> ingress -> towards -> s_axis
///                                 '-> requests -> packer -> slip_encoder -> bytes out
/// m_axis -> back -> resultants, counters -> sources ---^
/// ```
/// `towards` and `back` are register slices where the engine is large and far from the link's pins. Received bytes
/// arrive at any time, at least five cycles apart, without back-pressure; bytes are sent with `send_ready`.
#[derive(dermis_hdl_derive::Block)]
pub struct PacketLink {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A received byte; valid with `receive_valid`.
    pub receive_data: Wire<In>,
    /// A byte was received in this cycle.
    pub receive_valid: Signal<In, Bit>,
    /// A byte was received with an error in this cycle.
    pub receive_broken: Signal<In, Bit>,
    /// A byte to send; valid with `send_valid`.
    pub send_data: Wire<Out>,
    /// `send_data` is offered; held until `send_ready`.
    pub send_valid: Signal<Out, Bit>,
    /// The link accepts the byte in this cycle.
    pub send_ready: Signal<In, Bit>,
    /// A taxel's code, or a byte of an image of tables, `stream_bits` wide; to the engine.
    pub s_axis_tdata: Wire<Out>,
    /// `s_axis_tdata` is offered to the engine; held until `s_axis_tready`.
    pub s_axis_tvalid: Signal<Out, Bit>,
    /// The engine accepts the beat in this cycle.
    pub s_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame or image; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<Out, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; from the engine.
    pub m_axis_tdata: Wire<In>,
    /// The engine offers a beat.
    pub m_axis_tvalid: Signal<In, Bit>,
    /// The beat is accepted in this cycle.
    pub m_axis_tready: Signal<Out, Bit>,
    /// The beat is the frame's last; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<In, Bit>,
    /// A frame is asked for and its answer not begun.
    pub requested: Signal<Out, Bit>,
    /// A packet is being received, computed or sent.
    pub activity: Signal<Out, Bit>,
    /// A packet is dropped in this cycle.
    pub dropped: Signal<Out, Bit>,
    decoder: SlipDecoder,
    parser: Parser,
    ingress: FrameIngress,
    towards: RustHdl<RegisterSlice>,
    back: RustHdl<RegisterSlice>,
    requests: Requests,
    resultants: Resultants,
    sources: Sources,
    packer: Packer,
    encoder: SlipEncoder,
    counters: CounterRam,
    arriving: Crc,
    leaving: Crc,
    unused: Signal<Local, Bit>,
    unused_low: Wire<Local>,
}

impl PacketLink {
    /// For the packets of `shape`; requests for the identity are answered with `identity`.
    pub fn new(shape: &Shape, identity: &Identity) -> Self {
        PacketLink {
            clk: Default::default(),
            rst: Default::default(),
            receive_data: Wire::new(8),
            receive_valid: Default::default(),
            receive_broken: Default::default(),
            send_data: Wire::new(8),
            send_valid: Default::default(),
            send_ready: Default::default(),
            s_axis_tdata: Wire::new(shape.stream_bits()),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(96),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            requested: Default::default(),
            activity: Default::default(),
            dropped: Default::default(),
            decoder: SlipDecoder::default(),
            parser: Parser::new(shape),
            ingress: FrameIngress::new(shape),
            towards: RustHdl::new(RegisterSlice::new(shape.stream_bits(), shape.answers.are_fast())),
            back: RustHdl::new(RegisterSlice::new(96, shape.answers.are_fast())),
            requests: Requests::new(shape),
            resultants: Resultants::new(shape),
            sources: Sources::new(shape.answers.are_fast()),
            packer: Packer::new(shape.payloads()),
            encoder: SlipEncoder::new(shape.answers.are_fast()),
            counters: CounterRam::new(identity, shape.answers.are_fast()),
            arriving: Crc::default(),
            leaving: Crc::default(),
            unused: Default::default(),
            unused_low: Wire::new(8),
        }
    }
}

impl Logic for PacketLink {
    #[hdl_gen]
    fn update(&mut self) {
        self.decoder.clk.next = self.clk.val();
        self.parser.clk.next = self.clk.val();
        self.ingress.clk.next = self.clk.val();
        self.towards.clk.next = self.clk.val();
        self.back.clk.next = self.clk.val();
        self.requests.clk.next = self.clk.val();
        self.resultants.clk.next = self.clk.val();
        self.sources.clk.next = self.clk.val();
        self.packer.clk.next = self.clk.val();
        self.encoder.clk.next = self.clk.val();
        self.counters.clk.next = self.clk.val();
        self.arriving.clk.next = self.clk.val();
        self.leaving.clk.next = self.clk.val();
        self.decoder.rst.next = self.rst.val();
        self.parser.rst.next = self.rst.val();
        self.ingress.rst.next = self.rst.val();
        self.towards.rst.next = self.rst.val();
        self.back.rst.next = self.rst.val();
        self.requests.rst.next = self.rst.val();
        self.resultants.rst.next = self.rst.val();
        self.packer.rst.next = self.rst.val();
        self.encoder.rst.next = self.rst.val();
        self.counters.rst.next = self.rst.val();

        comment!("Received bytes to packets");
        self.decoder.data.next = self.receive_data.val();
        self.decoder.valid.next = self.receive_valid.val();
        self.decoder.broken.next = self.receive_broken.val();
        self.parser.content.next = self.decoder.content.val();
        self.parser.content_valid.next = self.decoder.content_valid.val();
        self.parser.packet_end.next = self.decoder.packet_end.val();
        self.parser.spoiled.next = self.decoder.spoiled.val();
        self.parser.crc_right.next = self.arriving.right.val();
        self.arriving.restart.next = self.rst.val() | self.decoder.packet_end.val();
        self.arriving.octet.next = self.decoder.content.val();
        self.arriving.load.next = self.decoder.content_valid.val();

        comment!("Packets to the engine");
        self.ingress.frame_begin.next = self.parser.frame_begin.val();
        self.ingress.image.next = self.parser.image.val();
        self.ingress.payload.next = self.parser.payload.val();
        self.ingress.content.next = self.decoder.content.val();
        self.ingress.good.next = self.parser.good.val();
        self.ingress.bad.next = self.parser.bad.val();
        self.ingress.ready.next = self.towards.s_axis_tready.val();
        self.towards.s_axis_tdata.next = self.ingress.code.val();
        self.towards.s_axis_tvalid.next = self.ingress.valid.val();
        self.towards.s_axis_tlast.next = self.ingress.last.val();
        self.towards.m_axis_tready.next = self.s_axis_tready.val();
        self.s_axis_tdata.next = self.towards.m_axis_tdata.val();
        self.s_axis_tvalid.next = self.towards.m_axis_tvalid.val();
        self.s_axis_tlast.next = self.towards.m_axis_tlast.val();

        comment!("Requests and counters");
        self.requests.good.next = self.parser.good.val();
        self.requests.kind.next = self.parser.kind.val();
        self.requests.number.next = self.parser.number.val();
        self.requests.taken.next = self.ingress.taken.val();
        self.requests.answered.next = self.back.m_axis_tvalid.val();
        self.requests.begun.next = self.packer.begun.val();
        self.counters.taken.next = self.ingress.taken.val() | self.requests.noted.val();
        self.counters.fault.next = self.parser.fault.val();
        self.counters.overrun.next = self.ingress.overrun.val() | self.requests.overrun.val();

        comment!("Engine to packets");
        self.resultants.run.next = self.sources.answer_wanted.val();
        self.resultants.summarise.next = self.sources.summarise.val();
        self.resultants.taken.next = self.packer.taken.val() & self.sources.answer_wanted.val();
        self.back.s_axis_tdata.next = self.m_axis_tdata.val();
        self.back.s_axis_tvalid.next = self.m_axis_tvalid.val();
        self.back.s_axis_tlast.next = self.m_axis_tlast.val();
        self.m_axis_tready.next = self.back.s_axis_tready.val();
        self.resultants.beat.next = self.back.m_axis_tdata.val();
        self.resultants.beat_valid.next = self.back.m_axis_tvalid.val();
        self.resultants.beat_last.next = self.back.m_axis_tlast.val();
        self.back.m_axis_tready.next = self.resultants.beat_ready.val();
        self.sources.source.next = self.packer.source.val();
        self.sources.begun.next = self.packer.begun.val();
        self.sources.wanted.next = self.packer.wanted.val();
        self.sources.index.next = self.packer.index.val();
        self.sources.taken.next = self.packer.taken.val();
        self.counters.address.next = self.sources.address.val();
        self.counters.hold.next = self.packer.halfway.val();
        self.sources.entry.next = self.counters.entry.val();
        self.sources.entry_valid.next = self.counters.entry_valid.val();
        self.sources.answer.next = self.resultants.word.val();
        self.sources.answer_valid.next = self.resultants.word_valid.val();
        self.sources.answer_last.next = self.resultants.word_last.val();
        self.packer.offer.next = self.requests.offer.val();
        self.packer.number.next = self.requests.answer_number.val();
        self.packer.offered_source.next = self.requests.source.val();
        self.packer.octet.next = self.sources.octet.val();
        self.packer.word_valid.next = self.sources.word_valid.val();
        self.packer.word_last.next = self.sources.word_last.val();
        self.leaving.restart.next = self.packer.crc_restart.val();
        self.leaving.octet.next = self.packer.crc_octet.val();
        self.leaving.load.next = self.packer.crc_load.val();
        self.packer.crc_low.next = self.leaving.low.val();
        self.packer.crc_busy.next = self.leaving.busy.val();

        comment!("Outputs used in the other direction only");
        self.unused.next = self.arriving.busy.val() | self.leaving.right.val();
        self.unused_low.next = self.arriving.low.val();

        comment!("Packets to sent bytes");
        self.encoder.content.next = self.packer.content.val();
        self.encoder.border.next = self.packer.border.val();
        self.encoder.content_valid.next = self.packer.valid.val();
        self.packer.ready.next = self.encoder.content_ready.val();
        self.encoder.ready.next = self.send_ready.val();
        self.send_data.next = self.encoder.data.val();
        self.send_valid.next = self.encoder.valid.val();

        self.requested.next = self.requests.waiting.val();
        self.activity.next = self.receive_valid.val() | self.requests.waiting.val() | self.encoder.valid.val();
        self.dropped.next = self.parser.bad.val() | self.ingress.overrun.val() | self.requests.overrun.val();
    }
}

#[cfg(test)]
mod tests;
