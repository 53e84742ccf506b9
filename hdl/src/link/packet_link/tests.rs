//! The link between a host and an engine in plain integers: every packet that leaves, and every code that reaches the
//! engine, is the expected one; the Verilog does the same in every cycle.

use std::collections::VecDeque;

use dermis_golden::fixed::stages::load;
use dermis_golden::wire::link::{codes_to_bytes, Beat, Counters, Decoder, Kind, Packet, Sums, BEAT_BYTES};

use super::*;
use crate::language::testbench::{check_with_defects, subject_of, Reference, Subject};
use crate::language::Change;
use crate::link::Answers;
use crate::wire::Word;

/// Beats of labels and statuses of a frame, after the forces.
const OTHER_BEATS: usize = 3;
const PARAMS: PacketParams = PacketParams {
    rows: TAXELS / 4,
    cols: 4,
    input_bits: 12,
    answer_bytes: [Sums::BYTES + OTHER_BEATS * BEAT_BYTES, (TAXELS + OTHER_BEATS) * BEAT_BYTES],
    image_bytes: Some(IMAGE_BYTES),
    answers: Answers::Both,
    frames: 4,
    scans: false,
};
const TAXELS: usize = 12;
const IMAGE_BYTES: usize = 18;
/// Packets between two resets.
const PACKETS: usize = 12;

fn identity() -> Identity {
    Identity { version: 2, rows: 3, cols: 4, scene: 0xc0db_dedc, ..Identity::default() }
}

fn subject(changes: &[Change]) -> Subject<'static> {
    subject_of!(
        PacketLink::new(&PARAMS, &identity()),
        changes,
        inputs [
            rst, receive_data, receive_valid, receive_broken, send_ready, s_axis_tready, m_axis_tdata, m_axis_tvalid,
            m_axis_tlast,
        ],
        outputs [
            send_data, send_valid, s_axis_tdata, s_axis_tvalid, s_axis_tlast, m_axis_tready, requested, activity, dropped,
        ],
    )
}

/// Outputs of an earlier run, from the first reset on; those that are data where they are valid.
struct Recorded {
    outputs: VecDeque<Vec<Word>>,
    reset: bool,
}

impl Reference for Recorded {
    fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
        let outputs = &self.outputs[0];
        let [sent, offered] = [1, 3].map(|output| outputs[output].number() == 1);
        let is_known = [sent, true, offered, true, offered, true, true, true, true];
        outputs.iter().zip(is_known).map(|(&word, known)| (known && self.reset).then_some(word)).collect()
    }

    fn clock(&mut self, inputs: &[Word]) {
        self.reset |= inputs[0].number() == 1;
        self.outputs.pop_front();
    }
}

/// Host and engine around the link, which both wait at random.
struct Around {
    link: Subject<'static>,
    random: fastrand::Rng,
    arriving: VecDeque<u8>,
    /// Cycles until the next byte may arrive.
    pause: usize,
    /// Beats of the engine, with their end.
    beats: VecDeque<([i32; 3], bool)>,
    codes: Vec<i32>,
    decoder: Decoder,
    answers: Vec<Packet>,
    /// Of the packets since the last reset.
    counters: Counters,
    stimulus: Vec<Vec<Word>>,
    outputs: Vec<Vec<Word>>,
}

impl Around {
    fn cycle(&mut self, rst: bool) {
        let arrives = self.pause == 0 && !self.arriving.is_empty();
        let byte = if arrives { self.arriving.pop_front().unwrap() } else { self.random.u8(..) };
        self.pause = if arrives { self.random.usize(4..20) } else { self.pause.saturating_sub(1) };
        let [takes_byte, takes_code] = [(); 2].map(|()| self.random.u8(..4) > 0);
        let (beat, last) = self.beats.front().copied().unwrap_or_default();
        let inputs = vec![
            rst.into(),
            Word::from(u64::from(byte)),
            arrives.into(),
            Word::default(),
            takes_byte.into(),
            takes_code.into(),
            Word::of_fields(&beat.map(i64::from), 32),
            (!self.beats.is_empty()).into(),
            last.into(),
        ];
        let outputs = self.link.cycle(&inputs);
        let is_high = |output: usize| outputs[output].number() == 1;
        if is_high(1) && takes_byte {
            self.answers.extend(self.decoder.next(outputs[0].number() as u8).map(|packet| packet.unwrap()));
        }
        if is_high(3) && takes_code {
            let beat = outputs[2].signed(0, PARAMS.stream_bits()) as i32;
            self.codes.push(beat);
            // An image's bytes are no codes, and come between frames.
            let is_byte = |beat: i32| beat >= 1 << (PARAMS.input_bits - 1);
            assert!(self.codes.iter().all(|&other| is_byte(other) == is_byte(beat)), "{:?}", self.codes);
            let count = if is_byte(beat) { IMAGE_BYTES } else { TAXELS };
            match (is_high(4), self.codes.len() == count) {
                // The engine drops a frame or an image whose last beat is early.
                (true, false) => self.codes.clear(),
                (last, whole) => assert_eq!(last, whole, "the last beat"),
            }
        }
        if is_high(5) && !self.beats.is_empty() {
            self.beats.pop_front();
        }
        self.stimulus.push(inputs);
        self.outputs.push(outputs);
    }

    fn cycles_until(&mut self, is_reached: impl Fn(&Self) -> bool) {
        for _ in 0..20_000 {
            self.cycle(false);
            if is_reached(self) {
                return;
            }
        }
        panic!("the link hangs: {:?}", self.answers.last());
    }

    /// The codes that reach the engine from a packet, which answers with `beats`, and the packets that come back.
    fn exchange(&mut self, wire: &[u8], beats: &[[i32; 3]], answers: usize) -> (Vec<i32>, Vec<Packet>) {
        self.arriving.extend(wire);
        self.cycles_until(|around| around.arriving.is_empty());
        if beats.is_empty() {
            (0..200).for_each(|_| self.cycle(false));
        } else {
            self.cycles_until(|around| around.codes.len() == TAXELS);
            let last = beats.len() - 1;
            self.beats.extend(beats.iter().enumerate().map(|(at, &beat)| (beat, at == last)));
        }
        self.cycles_until(|around| around.answers.len() >= answers && around.beats.is_empty());
        (0..100).for_each(|_| self.cycle(false));
        (std::mem::take(&mut self.codes), std::mem::take(&mut self.answers))
    }
}

#[test]
fn packets_are_answered_and_the_verilog_does_the_same() {
    let mut around = Around {
        link: subject(&[]),
        random: fastrand::Rng::with_seed(18),
        arriving: VecDeque::new(),
        pause: 0,
        beats: VecDeque::new(),
        codes: Vec::new(),
        decoder: Decoder::default(),
        answers: Vec::new(),
        counters: Counters::default(),
        stimulus: Vec::new(),
        outputs: Vec::new(),
    };
    let mut random = fastrand::Rng::with_seed(19);
    for number in 0..3 * PACKETS as u8 {
        if usize::from(number) % PACKETS == 0 {
            // As many as the counters need.
            (0..8).for_each(|_| around.cycle(true));
            around.counters = Counters::default();
        }
        let kind = [
            Kind::Identify,
            Kind::FrameForForces,
            Kind::Tables,
            Kind::FrameForResultants,
            Kind::ReadCounters,
            Kind::Tables,
        ][number as usize % 6];
        let is_frame = [Kind::FrameForForces, Kind::FrameForResultants].contains(&kind);
        let half = 1 << (PARAMS.input_bits - 1);
        let (codes, payload) = if kind == Kind::Tables {
            let image: Vec<u8> = (0..IMAGE_BYTES).map(|_| random.u8(..)).collect();
            (load::beats(&image, PARAMS.input_bits), image)
        } else {
            let codes: Vec<i32> = (0..if is_frame { TAXELS } else { 0 }).map(|_| random.i32(-half..half)).collect();
            let payload = codes_to_bytes(&codes, PARAMS.input_bits);
            (codes, payload)
        };
        let packet = Packet { kind, sequence: number, payload };
        let mut wire = packet.to_wire();
        if number % 5 == 3 {
            // Then the CRC is wrong; bytes below 0x80 mean nothing to SLIP.
            let at = wire.iter().rposition(|&byte| byte < 0x80).unwrap();
            wire[at] ^= 1;
            around.counters.crc += 1;
            assert_eq!(around.exchange(&wire, &[], 0), (Vec::new(), Vec::new()), "{kind:?}");
            continue;
        }
        around.counters.taken += 1;
        let count = if is_frame { TAXELS + OTHER_BEATS } else { 0 };
        let mut value = || random.i32(..) >> random.u32(..32);
        let beats: Vec<[i32; 3]> = (0..count).map(|_| [(); 3].map(|()| value())).collect();
        let of_beats = |beats: &[[i32; 3]]| -> Vec<u8> {
            beats.iter().flat_map(|&[fx, fy, fz]| Beat { fx, fy, fz }.to_bytes()).collect()
        };
        let payload = match kind {
            Kind::Identify => identity().to_bytes(),
            Kind::FrameForForces => of_beats(&beats),
            Kind::FrameForResultants => {
                [Sums::of(&beats[..TAXELS], PARAMS.cols).to_bytes(), of_beats(&beats[TAXELS..])].concat()
            }
            _ => around.counters.to_bytes(),
        };
        let answer = Packet { kind: kind.answer(), sequence: number, payload };
        assert_eq!(around.exchange(&wire, &beats, 1), (codes, vec![answer]), "{kind:?}");
    }
    let recorded = || Recorded { outputs: around.outputs.clone().into(), reset: false };
    let defects = [
        Change::value("", "requests__taken", |k| k.constant(1, 0)),
        Change::value("", "ingress__image", |k| k.constant(1, 0)),
    ];
    check_with_defects(subject, &around.stimulus, recorded, &defects);
}
