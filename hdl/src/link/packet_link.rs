//! Between a wire's bytes and the engine's streams.

use dermis_golden::link::{code_bytes, Identity};
use rust_hdl::prelude::*;

use super::{Feeder, Packer, Parser, Requests, Resultants, Shape, SlipDecoder, SlipEncoder, Sources, Tally};
use crate::wire::Wire;

/// ```text
/// bytes in  -> slip_decoder -> parser -> feeder -> s_axis
///                                 '-> requests -> packer -> slip_encoder -> bytes out
///                m_axis -> resultants -> sources ---^
/// ```
/// Bytes come at any time and are never held up; bytes go when `send_ready`.
#[derive(LogicBlock)]
pub struct PacketLink {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A byte from the wire.
    pub receive_data: Wire<In>,
    /// It came in this cycle.
    pub receive_valid: Signal<In, Bit>,
    /// A byte came that cannot be read.
    pub receive_broken: Signal<In, Bit>,
    /// A byte for the wire.
    pub send_data: Wire<Out>,
    /// It is offered.
    pub send_valid: Signal<Out, Bit>,
    /// It is taken.
    pub send_ready: Signal<In, Bit>,
    /// A taxel's code.
    pub s_axis_tdata: Wire<Out>,
    /// It is offered.
    pub s_axis_tvalid: Signal<Out, Bit>,
    /// It is taken.
    pub s_axis_tready: Signal<In, Bit>,
    /// It is the frame's last.
    pub s_axis_tlast: Signal<Out, Bit>,
    /// `{fz, fy, fx}`.
    pub m_axis_tdata: Wire<In>,
    /// A beat is offered.
    pub m_axis_tvalid: Signal<In, Bit>,
    /// It is taken.
    pub m_axis_tready: Signal<Out, Bit>,
    /// It is the frame's last.
    pub m_axis_tlast: Signal<In, Bit>,
    /// Something comes, is computed or goes.
    pub activity: Signal<Out, Bit>,
    /// A packet is dropped.
    pub dropped: Signal<Out, Bit>,
    decoder: SlipDecoder,
    parser: Parser,
    feeder: Feeder,
    requests: Requests,
    resultants: Resultants,
    sources: Sources,
    packer: Packer,
    encoder: SlipEncoder,
    tally: Tally,
}

impl PacketLink {
    /// For the scene of `shape`, which answers as `identity`.
    pub fn new(shape: &Shape, identity: &Identity) -> Self {
        let taxels = shape.rows * shape.cols;
        PacketLink {
            clk: Default::default(),
            rst: Default::default(),
            receive_data: Wire::new(8),
            receive_valid: Default::default(),
            receive_broken: Default::default(),
            send_data: Wire::new(8),
            send_valid: Default::default(),
            send_ready: Default::default(),
            s_axis_tdata: Wire::new(shape.input_bits as usize),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(96),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            activity: Default::default(),
            dropped: Default::default(),
            decoder: SlipDecoder::default(),
            parser: Parser::new(taxels * code_bytes(shape.input_bits)),
            feeder: Feeder::new(taxels, shape.input_bits),
            requests: Requests::new(shape),
            resultants: Resultants::new(shape),
            sources: Sources::new(identity),
            packer: Packer::default(),
            encoder: SlipEncoder::default(),
            tally: Tally::default(),
        }
    }
}

impl Logic for PacketLink {
    #[hdl_gen]
    fn update(&mut self) {
        self.decoder.clk.next = self.clk.val();
        self.parser.clk.next = self.clk.val();
        self.feeder.clk.next = self.clk.val();
        self.requests.clk.next = self.clk.val();
        self.resultants.clk.next = self.clk.val();
        self.sources.clk.next = self.clk.val();
        self.packer.clk.next = self.clk.val();
        self.encoder.clk.next = self.clk.val();
        self.tally.clk.next = self.clk.val();
        self.decoder.rst.next = self.rst.val();
        self.parser.rst.next = self.rst.val();
        self.feeder.rst.next = self.rst.val();
        self.requests.rst.next = self.rst.val();
        self.resultants.rst.next = self.rst.val();
        self.packer.rst.next = self.rst.val();
        self.encoder.rst.next = self.rst.val();
        self.tally.rst.next = self.rst.val();

        comment!("Wire to packet");
        self.decoder.data.next = self.receive_data.val();
        self.decoder.valid.next = self.receive_valid.val();
        self.decoder.broken.next = self.receive_broken.val();
        self.parser.content.next = self.decoder.content.val();
        self.parser.content_valid.next = self.decoder.content_valid.val();
        self.parser.packet_end.next = self.decoder.packet_end.val();
        self.parser.spoiled.next = self.decoder.spoiled.val();

        comment!("Packet to engine");
        self.feeder.frame_begin.next = self.parser.frame_begin.val();
        self.feeder.payload.next = self.parser.payload.val();
        self.feeder.content.next = self.decoder.content.val();
        self.feeder.good.next = self.parser.good.val();
        self.feeder.bad.next = self.parser.bad.val();
        self.feeder.ready.next = self.s_axis_tready.val();
        self.s_axis_tdata.next = self.feeder.code.val();
        self.s_axis_tvalid.next = self.feeder.valid.val();
        self.s_axis_tlast.next = self.feeder.last.val();

        comment!("What is to be answered");
        self.requests.good.next = self.parser.good.val();
        self.requests.kind.next = self.parser.kind.val();
        self.requests.number.next = self.parser.number.val();
        self.requests.taken.next = self.feeder.taken.val();
        self.requests.answered.next = self.m_axis_tvalid.val();
        self.requests.begun.next = self.packer.begun.val();
        self.tally.taken.next = self.feeder.taken.val() | self.requests.noted.val();
        self.tally.fault.next = self.parser.fault.val();
        self.tally.overrun.next = self.feeder.overrun.val() | self.requests.overrun.val();

        comment!("Engine to packet");
        self.resultants.run.next = self.sources.answer_wanted.val();
        self.resultants.summarise.next = self.sources.summarise.val();
        self.resultants.beat.next = self.m_axis_tdata.val();
        self.resultants.beat_valid.next = self.m_axis_tvalid.val();
        self.resultants.beat_last.next = self.m_axis_tlast.val();
        self.m_axis_tready.next = self.resultants.beat_ready.val();
        self.sources.source.next = self.packer.source.val();
        self.sources.begun.next = self.packer.begun.val();
        self.sources.wanted.next = self.packer.wanted.val();
        self.sources.counters.next = self.tally.counts.val();
        self.sources.answer.next = self.resultants.word.val();
        self.sources.answer_valid.next = self.resultants.word_valid.val();
        self.sources.answer_last.next = self.resultants.word_last.val();
        self.packer.offer.next = self.requests.offer.val();
        self.packer.header.next = self.requests.header.val();
        self.packer.offered_source.next = self.requests.source.val();
        self.packer.word.next = self.sources.word.val();
        self.packer.word_valid.next = self.sources.word_valid.val();
        self.packer.word_last.next = self.sources.word_last.val();

        comment!("Packet to wire");
        self.encoder.content.next = self.packer.content.val();
        self.encoder.border.next = self.packer.border.val();
        self.encoder.content_valid.next = self.packer.valid.val();
        self.packer.ready.next = self.encoder.content_ready.val();
        self.encoder.ready.next = self.send_ready.val();
        self.send_data.next = self.encoder.data.val();
        self.send_valid.next = self.encoder.valid.val();

        self.activity.next = self.receive_valid.val() | self.requests.waiting.val() | self.encoder.valid.val();
        self.dropped.next = self.parser.bad.val() | self.feeder.overrun.val() | self.requests.overrun.val();
    }
}
