//! Stage `send`: requests the forces row-major, then each subarray's status beats, while the output queue has room.
//!
//! A taxel waits until the values of its subarray begin, so that the upper subarrays leave while the lower ones are searched.

use dermis_golden::fixed::stages::send::STATUS_BEATS;
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::{count_bits, largest, BitDelay, CaseCounter, Counter, Dff, PartsBegun, Scan, StatusCode};
use crate::wire::Wire;

/// From the first subarray's values on, one beat is requested in each cycle with `room`: all taxels, then the status beats.
#[derive(dermis_hdl_derive::Block)]
pub struct Send {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// Index of the case of the frame being sent; constant until its last beat.
    pub which: Wire<In>,
    /// The frame's first values are available: start requesting beats.
    pub start: Signal<In, Bit>,
    /// The first values of a subarray are available; with `start` those of the first.
    pub begins: Signal<In, Bit>,
    /// A beat is offered on the output, monitored for the end of the frame.
    pub m_axis_tvalid: Signal<In, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The offered beat is the last of its frame.
    pub m_axis_tlast: Signal<In, Bit>,
    /// A beat may be requested in this cycle.
    pub room: Signal<In, Bit>,
    /// A beat is requested in this cycle.
    pub offer: Signal<Out, Bit>,
    /// 0: a force, 1 … 3: a status beat; valid with `offer`.
    pub beat: Wire<Out>,
    /// Index of the beat's subarray; valid with `offer`.
    pub part: Wire<Out>,
    /// Address of the memory word with the taxel; valid with `offer`.
    pub address: Wire<Out>,
    /// Lane of the taxel in the word; valid with `offer`.
    pub lane: Wire<Out>,
    /// The frame's last beat was accepted one cycle ago; high for one cycle.
    pub done: Signal<Out, Bit>,
    scan: RustHdl<Scan>,
    words: RustHdl<Counter>,
    parts: RustHdl<CaseCounter>,
    code: StatusCode,
    released: PartsBegun,
    sending: RustHdl<Dff>,
    status: RustHdl<Dff>,
    out: RustHdl<BitDelay>,
    step: Signal<Local, Bit>,
    at_end: Signal<Local, Bit>,
    finish: Signal<Local, Bit>,
}

impl Send {
    /// For frames of `model`.
    pub fn new(model: &Model) -> Self {
        let subarrays: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        let statuses: Vec<usize> =
            model.cases().iter().map(|case| model.status_beats_of(case) / STATUS_BEATS).collect();
        let code = StatusCode::new(largest(&statuses), largest(&subarrays), model.formats().by_contact());
        let scan = Scan::new(model.cases(), model.formats().search_width);
        Send {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(subarrays.len())),
            start: Default::default(),
            begins: Default::default(),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            room: Default::default(),
            offer: Default::default(),
            beat: Wire::new(2),
            part: Wire::new(code.part.width()),
            address: Wire::new(scan.address_bits()),
            lane: Wire::new(2),
            done: Default::default(),
            words: RustHdl::new(Counter::new(STATUS_BEATS)),
            parts: RustHdl::new(CaseCounter::new(&statuses)),
            code,
            released: PartsBegun::new(largest(&subarrays)),
            sending: Default::default(),
            status: Default::default(),
            out: RustHdl::new(BitDelay::new(1)),
            step: Default::default(),
            at_end: Default::default(),
            finish: Default::default(),
            scan: RustHdl::new(scan),
        }
    }
}

impl Logic for Send {
    #[hdl_gen]
    fn update(&mut self) {
        self.scan.clk.next = self.clk.val();
        self.words.clk.next = self.clk.val();
        self.parts.clk.next = self.clk.val();
        self.sending.clk.next = self.clk.val();
        self.status.clk.next = self.clk.val();
        self.released.clk.next = self.clk.val();

        self.scan.which.next = self.which.val();
        self.parts.which.next = self.which.val();
        self.released.begins.next = self.begins.val();
        self.released.first.next = self.start.val();
        self.released.part.next = self.scan.part.val();
        self.step.next = self.sending.q.val() & self.room.val() & (self.status.q.val() | self.released.open.val());
        self.at_end.next = self.step.val() & !self.status.q.val() & self.scan.last.val();
        self.finish.next = self.step.val() & self.status.q.val() & self.words.last.val() & self.parts.last.val();
        self.offer.next = self.step.val();

        self.scan.clear.next = self.start.val();
        self.scan.enable.next = self.step.val() & !self.status.q.val();
        self.words.clear.next = self.start.val();
        self.words.enable.next = self.step.val() & self.status.q.val();
        self.parts.clear.next = self.start.val();
        self.parts.enable.next = self.step.val() & self.status.q.val() & self.words.last.val();
        self.code.status.next = self.status.q.val();
        self.code.word.next = self.words.value.val();
        self.code.status_part.next = self.parts.value.val();
        self.code.scan_part.next = self.scan.part.val();
        self.beat.next = self.code.beat.val();
        self.part.next = self.code.part.val();
        self.address.next = self.scan.address.val();
        self.lane.next = self.scan.lane.val();

        self.sending.d.next = (self.start.val() | (self.sending.q.val() & !self.finish.val())) & !self.rst.val();
        self.status.d.next = (self.at_end.val() | (self.status.q.val() & !self.finish.val())) & !self.rst.val();
        comment!("Registered once to shorten the route from the output");
        self.out.clk.next = self.clk.val();
        self.out.rst.next = self.rst.val();
        self.out.d.next = self.m_axis_tvalid.val() & self.m_axis_tready.val() & self.m_axis_tlast.val();
        self.done.next = self.out.q.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, Reference};
    use crate::language::Change;
    use crate::scenes::{learned, model, Place};
    use crate::wire::Word;

    struct Sending<'a> {
        model: &'a Model,
        /// The next beat of the frame: its taxels, then its status beats.
        beat: Option<usize>,
        /// Subarrays of the frame whose values have begun.
        begun: usize,
        done: Option<bool>,
    }

    impl<'a> Sending<'a> {
        fn new(model: &'a Model) -> Self {
            Sending { model, beat: None, begun: 0, done: None }
        }

        /// Code, subarray and, of a force, the taxel's place, of the beat that is requested.
        fn request(&self, inputs: &[Word]) -> Option<(usize, usize, Option<Place>)> {
            let case = &self.model.cases()[inputs[1].number() as usize];
            let beat = self.beat.filter(|_| inputs[7].number() == 1)?;
            match beat.checked_sub(self.model.scene.sensor.taxels()) {
                Some(status) => {
                    let label = usize::from(self.model.formats().by_contact());
                    Some((1 + status % STATUS_BEATS, status / STATUS_BEATS + label, None))
                }
                None => {
                    let place = Place::of(case, beat);
                    (place.part < self.begun).then_some((0, place.part, Some(place)))
                }
            }
        }
    }

    impl Reference for Sending<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let request = self.request(inputs);
            let width = self.model.formats().search_width;
            let place = request.as_ref().and_then(|(.., place)| Some(place.as_ref()?.word(width)));
            let number = |number: usize| Word::from(number as u64);
            vec![
                Some(request.is_some().into()),
                request.as_ref().map(|(beat, ..)| number(*beat)),
                request.as_ref().map(|(_, part, _)| number(*part)),
                place.map(|(address, _)| number(address)),
                place.map(|(_, lane)| number(lane)),
                self.done.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, which, start, begins, valid, ready, last] =
                [0, 1, 2, 3, 4, 5, 6].map(|input| inputs[input].number());
            let beats =
                self.model.scene.sensor.taxels() + self.model.status_beats_of(&self.model.cases()[which as usize]);
            let next = self.beat.map(|beat| beat + usize::from(self.request(inputs).is_some()));
            self.beat = if start == 1 { Some(0) } else { next.filter(|&beat| beat < beats) };
            self.begun = if start == 1 { 1 } else { self.begun + begins as usize };
            self.done = Some(valid & ready & last == 1);
            if rst == 1 {
                (self.beat, self.done) = (None, Some(false));
            }
        }
    }

    #[test]
    fn forces_are_requested_as_their_values_begin_and_status_beats_follow() {
        let several = model(10, 14, "[partition]\ncases = [0, 1, 2, 3]\n");
        let contacts = learned(6, 5, &[7], "[partition]\ncase = \"contacts\"\nmax_contacts = 3\n");
        for (model, defects) in [(several, true), (contacts, false)] {
            requests_are_in_order(&model, defects);
        }
    }

    fn requests_are_in_order(model: &Model, has_defects: bool) {
        let mut random = fastrand::Rng::with_seed(9);
        let mut sending = Sending::new(model);
        let mut which = 0;
        let cycle = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..1000) == 0;
            let start = !rst && sending.beat.is_none() && random.u8(..10) == 0;
            if start {
                which = random.usize(..model.cases().len());
            }
            let more = sending.beat.is_some() && sending.begun < model.cases()[which].parts.len();
            let bits = [start, start || (more && random.u8(..80) == 0), random.bool(), random.bool(), random.bool()];
            let bits = bits.into_iter().chain([random.u8(..4) > 0]).map(Word::from);
            let inputs: Vec<Word> = [Word::from(rst), Word::from(which as u64)].into_iter().chain(bits).collect();
            sending.clock(&inputs);
            inputs
        };
        let stimulus: Vec<Vec<Word>> = (0..8000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            block_subject!(
                Send::new(model),
                changes,
                inputs [rst, which, start, begins, m_axis_tvalid, m_axis_tready, m_axis_tlast, room],
                outputs [offer, beat, part, address, lane, done],
            )
        };
        let defects = [
            Change::value("", "released__part", |k| k.named("parts__value")),
            Change::value("", "finish", |k| k.named("step") & k.named("status__q") & k.named("words__last")),
        ];
        let defects = if has_defects { &defects[..] } else { &[] };
        check_with_defects(subject, &stimulus, || Sending::new(model), defects);
    }
}
