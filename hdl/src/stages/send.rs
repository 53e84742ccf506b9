//! Stage `send`: requests the forces row-major, then each subarray's status beats, while the output queue has room.
//!
//! A taxel waits until the values of its subarray begin, so that the upper subarrays leave while the lower ones are searched.

use dermis_golden::fixed::stages::send::STATUS_BEATS;
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{count_bits, largest, BitDelay, CaseCounter, Counter, Dff, PartsBegun, Scan, StatusCode};

block! {
    /// From the first subarray's values on, one beat is requested in each cycle with `room`: all taxels, then the status beats.
    pub struct Send {
        scan: Scan,
        /// Statuses of a frame and its subarrays, by case.
        statuses: Vec<usize>,
        subarrays: Vec<usize>,
        code: StatusCode,
    }
    ports SendPorts {
        clock;
        reset;
        /// Index of the case of the frame being sent; constant until its last beat.
        in case_index: count_bits(subarrays.len());
        /// The frame's first values are available: start requesting beats.
        in start;
        /// The first values of a subarray are available; with `start` those of the first.
        in begins;
        /// A beat is offered on the output, monitored for the end of the frame.
        in m_axis_tvalid;
        /// The receiver accepts a beat in this cycle.
        in m_axis_tready;
        /// The offered beat is the last of its frame.
        in m_axis_tlast;
        /// A beat may be requested in this cycle.
        in room;
        /// A beat is requested in this cycle.
        out offer;
        /// 0: a force, 1 … 3: a status beat; valid with `offer`.
        out beat: 2;
        /// Index of the beat's subarray; valid with `offer`.
        out part: code.widths().part;
        /// Address of the memory word with the taxel; valid with `offer`.
        out address: scan.address_bits();
        /// Lane of the taxel in the word; valid with `offer`.
        out lane: 2;
        /// The frame's last beat was accepted one cycle ago; high for one cycle.
        out done;
    }
}

impl Send {
    /// For frames of `model`.
    pub fn new(model: &Model) -> Self {
        let subarrays: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        let statuses: Vec<usize> =
            model.cases().iter().map(|case| model.status_beats_of(case) / STATUS_BEATS).collect();
        let code = StatusCode::new(largest(&statuses), largest(&subarrays), model.formats().by_contact());
        Send { scan: Scan::new(model.cases(), model.formats().search_width), statuses, subarrays, code }
    }
}

impl Block for Send {
    fn build<'k>(&self, k: &'k Builder, io: SendPorts<Inside<'k>>) {
        let scan = k.instance("scan", &self.scan);
        let words = k.instance("words", Counter::new(STATUS_BEATS));
        let parts = k.instance("parts", CaseCounter::new(&self.statuses));
        let code = k.instance("code", &self.code);
        let released = k.instance("released", PartsBegun::new(largest(&self.subarrays)));
        let sending = k.instance("sending", Dff {});
        let status = k.instance("status", Dff {});
        let out = k.instance("out", BitDelay::new(1));

        scan.case_index.set(io.case_index);
        parts.case_index.set(io.case_index);
        let open = released.map(|released| {
            released.begins.set(io.begins);
            released.first.set(io.start);
            released.part.set(scan.part);
            status.q | released.open
        });
        let offers = sending.q & io.room;
        let step = k.wire("step", open.map_or(offers, |open| offers & open));
        let at_end = k.wire("at_end", step & !status.q & scan.last);
        let finish = k.wire("finish", step & status.q & words.last & parts.last);
        io.offer.set(step);

        scan.clear.set(io.start);
        scan.enable.set(step & !status.q);
        words.clear.set(io.start);
        words.enable.set(step & status.q);
        parts.clear.set(io.start);
        parts.enable.set(step & status.q & words.last);
        code.status.set(status.q);
        code.word.set(words.value);
        code.status_part.set(parts.value);
        code.scan_part.set(scan.part);
        io.beat.set(code.beat);
        io.part.set(code.part);
        io.address.set(scan.address);
        io.lane.set(scan.lane);

        sending.d.set((io.start | (sending.q & !finish)) & !io.rst);
        status.d.set((at_end | (status.q & !finish)) & !io.rst);
        k.comment("Registered once to shorten the route from the output");
        out.d.set(io.m_axis_tvalid & io.m_axis_tready & io.m_axis_tlast);
        io.done.set(out.q);
        k.comment("`receive` writes by mask and needs the end of a row, this stage reads by lane.");
        k.unused([scan.mask, scan.row_end]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
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
            let [rst, case_index, start, begins, valid, ready, last] =
                [0, 1, 2, 3, 4, 5, 6].map(|input| inputs[input].number());
            let beats =
                self.model.scene.sensor.taxels() + self.model.status_beats_of(&self.model.cases()[case_index as usize]);
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
        let mut case_index = 0;
        let cycle = |cycle: usize| {
            let rst = cycle < 2 || random.u16(..1000) == 0;
            let start = !rst && sending.beat.is_none() && random.u8(..10) == 0;
            if start {
                case_index = random.usize(..model.cases().len());
            }
            let more = sending.beat.is_some() && sending.begun < model.cases()[case_index].parts.len();
            let bits = [start, start || (more && random.u8(..80) == 0), random.bool(), random.bool(), random.bool()];
            let bits = bits.into_iter().chain([random.u8(..4) > 0]).map(Word::from);
            let inputs: Vec<Word> = [Word::from(rst), Word::from(case_index as u64)].into_iter().chain(bits).collect();
            sending.clock(&inputs);
            inputs
        };
        let stimulus: Vec<Vec<Word>> = (0..8000).map(cycle).collect();
        let subject = |changes: &[Change]| {
            subject_of!(
                Send::new(model),
                changes,
                inputs [rst, case_index, start, begins, m_axis_tvalid, m_axis_tready, m_axis_tlast, room],
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
