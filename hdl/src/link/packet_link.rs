//! Between the bytes of a link and the engine's streams.

use dermis_golden::wire::link::Identity;

use super::counter_ram::CounterRamPorts;
use super::packer::PackerPorts;
use super::requests::RequestsPorts;
use super::{
    CounterRam, Crc, FrameIngress, Packer, PacketParams, Parser, Requests, Resultants, SlipDecoder, SlipEncoder,
    Sources,
};
use crate::block;
use crate::language::{Block, Builder, Inside, Outside};
use crate::primitives::{through, Beats, RegisterSlice, Stream};
use crate::streams::BEAT_BITS;

block! {
    /// ```text
    /// bytes in  -> slip_decoder -> parser -> ingress -> towards -> s_axis
    ///                                 '-> requests -> packer -> slip_encoder -> bytes out
    /// m_axis -> back -> resultants, counters -> sources ---^
    /// ```
    /// `towards` and `back` are register slices where the engine is large and far from the link's pins. Received bytes
    /// arrive at any time, at least five cycles apart, without back-pressure; bytes are sent with `send_ready`.
    pub struct PacketLink {
        /// What the packets depend on.
        params: PacketParams,
        /// Answer to a request for the identity.
        identity: Identity,
    }
    ports PacketLinkPorts {
        clock;
        reset;
        /// A received byte; valid with `receive_valid`.
        in receive_data: 8;
        /// A byte was received in this cycle.
        in receive_valid;
        /// A byte was received with an error in this cycle.
        in receive_broken;
        /// A byte to send; valid with `send_valid`.
        out send_data: 8;
        /// `send_data` is offered; held until `send_ready`.
        out send_valid;
        /// The link accepts the byte in this cycle.
        in send_ready;
        /// A taxel's code, or a byte of an image of tables, `stream_bits` wide; to the engine.
        source<Stream> s_axis: params.stream_bits();
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; from the engine.
        sink<Stream> m_axis: BEAT_BITS;
        /// A frame is asked for and its answer not begun.
        out requested;
        /// A packet is being received, computed or sent.
        out activity;
        /// A packet is dropped in this cycle.
        out dropped;
    }
}

impl PacketLink {
    /// For the packets of `params`; requests for the identity are answered with `identity`.
    pub fn new(params: &PacketParams, identity: &Identity) -> Self {
        PacketLink { params: params.clone(), identity: *identity }
    }
}

impl Block for PacketLink {
    fn build<'k>(&self, k: &'k Builder, io: PacketLinkPorts<Inside<'k>>) {
        let registered = self.params.answers.are_fast();
        let decoder = k.instance("decoder", SlipDecoder::default());
        let parser = k.instance("parser", Parser::new(&self.params));
        let ingress = k.instance("ingress", FrameIngress::new(&self.params));
        let towards = registered.then(|| RegisterSlice::new(self.params.stream_bits()));
        let towards = k.instance("towards", towards);
        let requests = k.instance("requests", Requests::new(&self.params));
        let packer = k.instance("packer", Packer::new(self.params.payloads()));
        let encoder = k.instance("encoder", SlipEncoder::new(registered));
        let counters = k.instance("counters", CounterRam::new(&self.identity, registered));
        let arriving = k.instance("arriving", Crc::default());
        let leaving = k.instance("leaving", Crc::default());

        k.comment("Received bytes to packets.");
        decoder.data.set(io.receive_data);
        decoder.valid.set(io.receive_valid);
        decoder.broken.set(io.receive_broken);
        parser.content.set(decoder.content);
        parser.content_valid.set(decoder.content_valid);
        parser.packet_end.set(decoder.packet_end);
        parser.spoiled.set(decoder.spoiled);
        parser.crc_right.set(arriving.right);
        arriving.restart.set(io.rst | decoder.packet_end);
        arriving.octet.set(decoder.content);
        arriving.load.set(decoder.content_valid);

        k.comment("Packets to the engine.");
        ingress.frame_begin.set(parser.frame_begin);
        ingress.image.set(parser.image);
        ingress.payload.set(parser.payload);
        ingress.content.set(decoder.content);
        ingress.good.set(parser.good);
        ingress.bad.set(parser.bad);
        let codes = Beats {
            data: ingress.code,
            array: k.constant(1, 0),
            valid: ingress.valid,
            ready: ingress.ready,
            last: ingress.last,
        };
        through!(codes, towards).connect(&io.s_axis);

        k.comment("Requests and counters.");
        requests.good.set(parser.good);
        requests.kind.set(parser.kind);
        requests.number.set(parser.number);
        requests.taken.set(ingress.taken);
        requests.begun.set(packer.begun);
        counters.taken.set(ingress.taken | requests.noted);
        counters.fault.set(parser.fault);
        counters.overrun.set(ingress.overrun | requests.overrun);

        k.comment("Engine to packets.");
        self.answer(k, &io, &requests, &counters, &packer);
        leaving.restart.set(packer.crc_restart);
        leaving.octet.set(packer.crc_octet);
        leaving.load.set(packer.crc_load);
        packer.crc_low.set(leaving.low);
        packer.crc_busy.set(leaving.busy);

        k.comment("Outputs used in the other direction only.");
        k.unused([arriving.busy, leaving.right, arriving.low]);

        k.comment("Packets to sent bytes.");
        encoder.content.set(packer.content);
        encoder.border.set(packer.border);
        encoder.content_valid.set(packer.valid);
        packer.ready.set(encoder.content_ready);
        encoder.ready.set(io.send_ready);
        io.send_data.set(encoder.data);
        io.send_valid.set(encoder.valid);

        io.requested.set(requests.waiting);
        io.activity.set(io.receive_valid | requests.waiting | encoder.valid);
        io.dropped.set(parser.bad | ingress.overrun | requests.overrun);
    }
}

impl PacketLink {
    /// From the beats of the engine, identity and counters to the payload of an answer.
    fn answer<'k>(
        &self,
        k: &'k Builder,
        io: &PacketLinkPorts<Inside<'k>>,
        requests: &RequestsPorts<Outside<'k>>,
        counters: &CounterRamPorts<Outside<'k>>,
        packer: &PackerPorts<Outside<'k>>,
    ) {
        let registered = self.params.answers.are_fast();
        let back = k.instance("back", registered.then(|| RegisterSlice::new(BEAT_BITS)));
        let resultants = k.instance("resultants", Resultants::new(&self.params));
        let sources = k.instance("sources", Sources::new(registered));

        resultants.run.set(sources.answer_wanted);
        resultants.summarise.set(sources.summarise);
        resultants.taken.set(packer.taken & sources.answer_wanted);
        let beats = through!(io.m_axis.inward(), back);
        resultants.beat.set(beats.data);
        resultants.beat_valid.set(beats.valid);
        resultants.beat_last.set(beats.last);
        beats.ready.set(resultants.beat_ready);
        requests.answered.set(beats.valid);
        sources.source.set(packer.source);
        sources.begun.set(packer.begun);
        sources.wanted.set(packer.wanted);
        sources.index.set(packer.index);
        sources.taken.set(packer.taken);
        counters.address.set(sources.address);
        counters.hold.set(packer.halfway);
        sources.entry.set(counters.entry);
        sources.entry_valid.set(counters.entry_valid);
        sources.answer.set(resultants.word);
        sources.answer_valid.set(resultants.word_valid);
        sources.answer_last.set(resultants.word_last);
        packer.offer.set(requests.offer);
        packer.number.set(requests.answer_number);
        packer.offered_source.set(requests.source);
        packer.octet.set(sources.octet);
        packer.word_valid.set(sources.word_valid);
        packer.word_last.set(sources.word_last);
    }
}

#[cfg(test)]
mod tests;
