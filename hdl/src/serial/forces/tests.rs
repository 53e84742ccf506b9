//! The beats of a frame against plain integers.

use super::*;
use crate::language::kernel_of;
use crate::language::testbench::{check, Reference};
use crate::wire::Word;

const SIZES: Forces = Forces {
    places: 5,
    wanted: 5,
    word: 29,
    value: 25,
    score: 20,
    unrounded: 50,
    mu_step: 1234,
    mu_fraction: 15,
    shift_base: 12,
    threshold: 1 << 20,
    score_limit: Some(-1000),
    balance: Some(Balance { push: 5, taxels: 24 }),
    taxels: 24,
};

#[derive(Clone, Copy, Default, PartialEq)]
enum Step {
    #[default]
    Idle,
    Scaling,
    Sending,
}

/// Beat after beat, with the phases of the module docs.
#[derive(Clone, Default)]
struct Beats {
    step: Step,
    phase: u64,
    status: bool,
    beat: u64,
    ahead: Option<u64>,
    factors: Option<[i64; 2]>,
    product: Option<i64>,
    mu: [i64; 2],
    words: [i64; 3],
    saturations: u64,
    contact: bool,
    balance: i64,
    counting: bool,
    cycles: u64,
    valid: bool,
    shift: u64,
    reset: bool,
}

impl Beats {
    fn is_last(&self) -> bool {
        self.valid && self.status && self.beat == STATUS_BEATS as u64 - 1
    }

    /// The words of a status beat.
    fn status_words(&self, inputs: &[Word]) -> [i64; 3] {
        let number = |k: usize| inputs[k].number() as i64;
        match self.beat {
            0 => {
                let flags =
                    [(8, CONDITION), (7, FOUND), (9, FRAMING)].map(|(k, bit)| number(k) * i64::from(bit.mask()));
                let no_contact = i64::from(!self.contact) * i64::from(NO_CONTACT.mask());
                let [x, y] = [4, 5].map(|k| inputs[k].signed(0, position_bits()));
                let low = inputs[7].number() == 1 && Some(inputs[6].signed(0, SIZES.score)) > SIZES.score_limit;
                let marks = i64::from(low) * i64::from(SCORE_LOW.mask())
                    + i64::from(self.balance < 0) * i64::from(NEGATIVE_PRESSURE.mask());
                [x, y, flags.iter().sum::<i64>() + no_contact + marks]
            }
            1 => [number(7) * inputs[6].signed(0, SIZES.score), number(11), number(10)],
            _ => [number(12), self.saturations as i64, self.cycles as i64],
        }
    }

    /// The value that has been read becomes a factor, and the next one is addressed.
    fn take_value(&mut self, inputs: &[Word]) {
        self.factors = Some([inputs[3].signed(0, SIZES.value), self.mu[0]]);
        self.ahead = self.ahead.map(|ahead| ahead + 1);
    }

    fn factor_b(&mut self, factor: i64) {
        self.factors = self.factors.map(|[a, _]| [a, factor]);
    }

    fn scale(&mut self, inputs: &[Word]) {
        let position = |k: usize| inputs[k].signed(0, position_bits());
        match self.phase {
            0 => self.factors = Some([SIZES.mu_step, position(4)]),
            1 => self.factor_b(position(5)),
            6 => self.mu[0] = inputs[14].signed(0, FACTOR),
            7 => self.mu[1] = inputs[14].signed(0, FACTOR),
            _ => {}
        }
        (self.step, self.phase) = match self.phase + 1 {
            MU_WORDS => (Step::Sending, 0),
            phase => (Step::Scaling, phase),
        };
    }

    fn send(&mut self, inputs: &[Word]) {
        let forces = !self.status;
        match self.phase {
            2 => self.take_value(inputs),
            3 => self.factor_b(self.mu[1]),
            4 => self.factor_b(1 << SIZES.mu_fraction),
            8..=10 => {
                let status = self.status_words(inputs)[self.phase as usize - 8];
                let word = if forces { inputs[14].signed(0, WORD) } else { status };
                self.words = [self.words[1], self.words[2], word];
                self.saturations += u64::from(forces && inputs[15].number() == 1);
            }
            11 => {
                if forces && self.words[2].abs() < SIZES.threshold {
                    self.words = [0; 3];
                }
                self.contact |= forces && self.words[2] != 0;
                (self.counting, self.valid) = (false, true);
            }
            LAST_PHASE if inputs[16].number() == 0 => return,
            LAST_PHASE => {
                if self.is_last() {
                    self.step = Step::Idle;
                }
                let push = SIZES.balance.map_or(0, |balance| i64::from(balance.push));
                let weight = if self.words[2] < 0 { push } else { 1 };
                self.balance += if forces { weight * self.words[2] } else { 0 };
                let forces_end = forces && self.beat == SIZES.taxels - 1;
                (self.phase, self.valid) = (AGAIN_PHASE, false);
                self.beat = if forces_end { 0 } else { self.beat + 1 };
                self.status |= forces_end;
                return self.take_value(inputs);
            }
            _ => {}
        }
        self.phase += 1;
    }
}

impl Reference for Beats {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let bit = |bit: bool| self.reset.then(|| Word::from(bit));
        let shift = if self.step == Step::Scaling { MU_ROUND.into() } else { self.shift };
        let ready = inputs[16].number() == 1;
        vec![
            self.ahead.map(|ahead| Word::from(ahead % (1 << SIZES.places))),
            Some(Word::from((inputs[2].number() + 1) % (1 << SIZES.wanted))),
            self.product.map(|product| Word::of_fields(&[product], SIZES.unrounded)),
            self.reset.then(|| Word::from(shift)),
            self.valid.then(|| Word::of_fields(&self.words, WORD)),
            bit(self.valid),
            bit(self.is_last()),
            bit(self.is_last() && ready),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, start, begins] = [0, 1, 13].map(|k| inputs[k].number() == 1);
        self.product = self.factors.map(|[a, b]| a * b);
        let counts = self.counting;
        match self.step {
            Step::Idle if start => {
                *self = Beats {
                    step: Step::Scaling,
                    ahead: Some(0),
                    phase: 0,
                    status: false,
                    beat: 0,
                    saturations: 0,
                    contact: false,
                    balance: 0,
                    ..self.clone()
                };
            }
            Step::Idle => {}
            Step::Scaling => self.scale(inputs),
            Step::Sending => self.send(inputs),
        }
        self.cycles = if begins { COUNTED_LATER } else { self.cycles + u64::from(counts) };
        self.counting |= begins;
        let more = inputs[10].number() as i64 - inputs[11].number() as i64;
        self.shift = (SIZES.shift_base + more).clamp(0, FORCE_SHIFT_MAX.into()) as u64;
        if rst {
            (self.step, self.valid, self.reset) = (Step::Idle, false, true);
        }
    }
}

/// Frames one after the other, with random words from the rounder and a receiver that stalls; resets.
#[test]
fn forces_are_sent_and_then_the_status() {
    let mut random = fastrand::Rng::with_seed(29);
    let mut beats = Beats::default();
    let (mut wait, mut frame, mut speed) = (0, Vec::new(), 4);
    let cycle = |cycle: usize| {
        let rst = cycle < 2 || random.u16(..5000) == 0;
        // A frame begins, and starts to be sent some cycles later.
        if rst {
            wait = 20;
        }
        let idle = beats.step == Step::Idle;
        let [begins, start] = [20, 0].map(|at| idle && !rst && wait == at);
        if idle && !rst {
            wait = if wait == 0 { 21 } else { wait - 1 };
        }
        if begins || frame.is_empty() {
            let position = |random: &mut fastrand::Rng| Word::of_fields(&[random.i64(-60..61)], position_bits());
            frame = vec![position(&mut random), position(&mut random), Word::from(random.u64(..1 << SIZES.score))];
            frame.extend([(); 3].map(|()| Word::from(random.bool())));
            frame.extend([16, 30].map(|most| Word::from(random.u64(..most))));
            frame.push(Word::from(random.u64(..1 << SATURATION_BITS)));
            speed = random.u8(1..9);
        }
        let mut inputs = vec![Word::from(rst), Word::from(start), Word::from(random.u64(..1 << SIZES.places))];
        inputs.push(Word::from(random.u64(..1 << SIZES.word)));
        inputs.extend(&frame);
        inputs
            .extend([Word::from(begins), Word::of_fields(&[random.i64(-(1 << 31)..1 << 31) >> random.u8(..20)], WORD)]);
        inputs.extend([Word::from(random.u8(..8) == 0), Word::from(random.u8(..8) < speed)]);
        beats.clock(&inputs);
        inputs
    };
    let all: Vec<Vec<Word>> = (0..12_000).map(cycle).collect();
    check(&kernel_of(&SIZES), &all, &mut Beats::default());
}
