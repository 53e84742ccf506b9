//! The sequencer as a state machine in plain integers.

use std::collections::BTreeMap;

use super::*;
use crate::language::kernel_of;
use crate::language::testbench::{check, random_word, Reference};
use crate::wire::Word;

const RST: usize = 0;
const FILLING: usize = 1;
const START: usize = 2;
const ENABLED: usize = 3;
const WANTED: usize = 4;
const TOTAL: usize = 5;

const IDLE: u64 = Phase::Idle as u64;
const SET_UP: u64 = Phase::SetUp as u64;
const RUN: u64 = Phase::Run as u64;
const COMPARE: u64 = Phase::Compare as u64;

fn bit(inputs: &[Word], index: usize) -> bool {
    inputs[index].number() == 1
}

struct Machine {
    degree: u64,
    polynomials: u64,
    score_bits: usize,
    /// Width of the index of a polynomial.
    bits: usize,
    /// Names and widths of the outputs in the order of the kernel.
    outputs: Vec<(String, usize)>,
    state: State,
    done: bool,
    reset: bool,
    /// A search has started since the first reset, and its first sweep runs; before, most is undefined.
    started: bool,
    runs: bool,
}

/// Location of a set of polynomials: bank and region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Region {
    odd: bool,
    upper: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    state: u64,
    sweep: u64,
    tick: u64,
    enabled: bool,
    moves: [i64; 2],
    source: Region,
    target: Region,
    current: Region,
    kept: Region,
    count: u64,
    turns: [u64; 3],
    position: [i64; 2],
    takes: bool,
    settled: i64,
    centre: [i64; 2],
    centre_disc: i64,
    disc: i64,
    best: [i64; 2],
    best_disc: i64,
    offset: [i64; 2],
    score: i64,
    taken: bool,
    found: bool,
    improved: bool,
}

impl Machine {
    fn run_end(&self) -> bool {
        self.state.state == RUN && self.state.tick == SLOT * self.polynomials + SWEEP_TAIL - 1
    }

    /// Index of the candidate that is next: in a halving the centre comes first.
    fn in_turn(&self) -> u64 {
        let s = &self.state;
        match (s.sweep < COARSE, s.count / 2) {
            (true, order) => order,
            (false, 0) => CENTRE as u64,
            (false, order) if order <= CENTRE as u64 => order - 1,
            (false, order) => order,
        }
    }

    fn advance(&mut self, inputs: &[Word]) {
        let s = self.state;
        let mut next = s;
        match s.state {
            IDLE if bit(inputs, START) => {
                let sweep = if bit(inputs, ENABLED) { 0 } else { LAST };
                let State { source, target, .. } = s;
                let enabled = bit(inputs, ENABLED);
                next = State { state: SET_UP, sweep, enabled, source, target, ..State::default() };
            }
            SET_UP => {
                next.state = RUN;
                next.tick = 0;
                next.source = if s.sweep < COARSE { s.current } else { s.kept };
                let odd = !next.source.odd;
                next.target = Region { odd, upper: odd == s.kept.odd && !s.kept.upper };
                next.improved = false;
                if s.sweep < COARSE {
                    next.moves = coarse_step(s.sweep as usize);
                    next.centre = [0, 1].map(|axis| s.centre[axis] + next.moves[axis]);
                    next.centre_disc = coarse_disc(s.sweep as usize);
                } else {
                    next.moves = s.offset;
                    if s.sweep < LAST {
                        next.best = s.best.map(|p| 2 * p);
                        next.centre = next.best;
                        next.best_disc = 4 * s.best_disc;
                        next.centre_disc = 4 * s.best_disc;
                        next.offset = [0, 0];
                        next.taken = false;
                    }
                    if s.sweep == COARSE {
                        next.found = s.taken;
                    }
                }
            }
            RUN => {
                next.tick = s.tick + 1;
                if self.run_end() {
                    next.state = if s.sweep == LAST { IDLE } else { COMPARE };
                    next.count = 0;
                    next.takes = false;
                }
            }
            COMPARE => self.compare(&mut next, inputs),
            _ => {}
        }
        if bit(inputs, RST) {
            next.state = IDLE;
        }
        self.state = next;
    }

    /// Compares a candidate every two cycles, five cycles each: index, disc by x, disc by y and position, decision,
    /// update.
    fn compare(&self, next: &mut State, inputs: &[Word]) {
        let s = self.state;
        let coarse = s.sweep < COARSE;
        let offset = |turn: u64| [turn as i64 % 3 - 1, turn as i64 / 3 - 1];
        let further = |axis: usize| match offset(s.turns[0])[axis] {
            0 => 0,
            sign => 2 * sign * s.centre[axis] + 1,
        };
        let bits = self.score_bits;
        let total = inputs[TOTAL].signed(0, bits);
        next.count = s.count + 1;
        next.turns[2] = s.turns[0];
        if s.count % 2 == 1 {
            next.disc = s.centre_disc + further(0);
            next.settled = s.disc;
            let earlier = coarse && (s.position[1], s.position[0]) < (s.best[1], s.best[0]);
            let better = !s.taken || total < s.score || (total == s.score && earlier);
            let eligible = inputs[TOTAL].field(bits, 1) == 1 && s.disc <= 0 && (coarse || s.found);
            next.takes = s.count >= 3 && eligible && better;
            return;
        }
        next.turns[0] = self.in_turn();
        next.turns[1] = s.turns[0];
        next.disc = s.disc + further(1);
        next.position = [0, 1].map(|axis| s.centre[axis] + offset(s.turns[0])[axis]);
        if s.takes {
            (next.best, next.score, next.taken) = (s.position, total, true);
            (next.offset, next.best_disc, next.improved) = (offset(s.turns[1]), s.settled, true);
        }
        if s.count == SELECTION - 1 {
            next.state = SET_UP;
            next.sweep = s.sweep + 1;
            next.current = s.target;
            if !coarse || next.improved {
                next.kept = s.target;
            }
        }
    }

    /// The outputs, and whether they are defined.
    fn values(&self, inputs: &[Word]) -> BTreeMap<&'static str, (bool, i64)> {
        let s = self.state;
        let bits = self.bits;
        let running = s.state == RUN;
        let behind = |ticks: u64| s.tick.wrapping_sub(ticks);
        let address = |region: Region, polynomial: u64, code: u64| {
            ((u64::from(region.upper) << bits | polynomial & ((1 << bits) - 1)) << 4 | code) as i64
        };
        let top = |ticks: u64| (self.degree.wrapping_sub(behind(ticks) >> 2 & 3) & 3) as i64;
        let odd = bit(inputs, FILLING) || if running { s.source.odd } else { s.target.odd };
        let read = match running {
            true => address(s.source, s.tick >> 4, (s.tick >> 2 & 3) << 2 | !s.tick & 3),
            false => address(s.target, inputs[WANTED].number(), 0),
        };
        let turned = behind(TRANSPOSE);
        let turn_read = (turned >> 4 & 3) << 4 | (!turned & 3) << 2 | turned >> 2 & 3;
        let (leaves, back) = (behind(LEAVES), behind(BACK));
        let halves = s.sweep >= COARSE && s.sweep < LAST;
        let (started, slot, scored) = (s.tick >= BACK, back >> 4, s.sweep != LAST);
        let present = running && started && slot < self.polynomials;
        let before = running && started && slot >= 1 && slot <= self.polynomials;
        let bit = |value: bool| i64::from(value);
        let number = |value: u64| value as i64;
        let value = present && s.sweep == LAST && slot >= 1 && back & 15 == 0;
        let comparing = s.state == COMPARE;
        let (run, start) = (self.runs && running, self.started);
        [
            ("odd", (self.runs || bit(odd) == 1 && inputs[FILLING].number() == 1, bit(odd))),
            ("read_address", (self.runs, read)),
            ("x_element", (run, number(behind(1) & 3))),
            ("x_top", (run, top(1))),
            ("x_moves", (run, bit(s.moves[0] != 0))),
            ("x_down", (run, bit(s.moves[0] < 0))),
            ("turn_write", (run, number(behind(5) & 63))),
            ("turn_read", (run, number(turn_read))),
            ("y_element", (run, number(behind(ALONG_Y) & 3))),
            ("y_top", (run, top(ALONG_Y))),
            ("y_moves", (run, bit(s.moves[1] != 0))),
            ("y_down", (run, bit(s.moves[1] < 0))),
            ("halvings", (run, if halves { number(((leaves >> 2 & 3) + (leaves & 3)) & 3) } else { 0 })),
            ("write", (self.reset, bit(present))),
            ("write_address", (present, address(s.target, slot, (back & 3) << 2 | back >> 2 & 3))),
            ("cycle", (present || before, number(back & 15))),
            ("present", (self.reset, bit(present && scored) | bit(before && scored) << 1)),
            ("sums", (present || before, bit(slot == 0) | bit(slot == 1) << 1)),
            ("value_valid", (self.reset, bit(value))),
            ("comparing", (self.reset, bit(comparing))),
            ("candidate", (comparing && s.count >= 2, number(s.turns[2] & 15))),
            ("best_x", (start, s.best[0])),
            ("best_y", (start, s.best[1])),
            ("score", (start, s.score)),
            ("found", (start, bit(s.found))),
            ("taken", (start, bit(s.taken))),
            ("compared", (start, bit(s.state == SET_UP && s.enabled && s.sweep != 0))),
            ("done", (self.reset, bit(self.done))),
        ]
        .into()
    }
}

impl Reference for Machine {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let values = self.values(inputs);
        let of = |(name, bits): &(String, usize)| {
            let (defined, value) = values[name.as_str()];
            (self.reset && defined).then(|| Word::of_fields(&[value], *bits))
        };
        self.outputs.iter().map(of).collect()
    }

    fn clock(&mut self, inputs: &[Word]) {
        self.runs |= self.started && self.state.state == SET_UP;
        self.started |= self.reset && self.state.state == IDLE && bit(inputs, START);
        self.reset |= bit(inputs, RST);
        self.done = self.run_end() && self.state.sweep == LAST && !bit(inputs, RST);
        self.advance(inputs);
    }
}

#[test]
fn sweeps_and_comparisons_are_those_of_the_state_machine() {
    let scene =
        "name = \"walk\"\n[sensor]\nrows = 2\ncols = 2\npitch_x_mm = 4.0\npitch_y_mm = 3.0\nthickness_mm = 3.0\n\
                 [hardware]\nboard = \"icebreaker\"\n";
    let scene = dermis_golden::spec::scene::Scene::parse(scene, "walk.toml").unwrap();
    let formats = dermis_golden::fixed::Model::new(&scene).unwrap().formats().clone();
    let block = SearchSequencer::new(&formats);
    let kernel = kernel_of(&block);
    let score_bits = formats.score_bits as usize;
    let outputs = kernel.signals.iter().filter(|signal| signal.output);
    let mut machine = Machine {
        degree: formats.degree as u64,
        polynomials: polynomials(&formats) as u64,
        score_bits,
        bits: count_bits(polynomials(&formats)),
        outputs: outputs.map(|signal| (signal.name.clone(), signal.ty.bits)).collect(),
        state: State::default(),
        done: false,
        reset: false,
        started: false,
        runs: false,
    };
    let widths = [1, 1, 1, 1, machine.bits, score_bits + 1];
    let mut random = fastrand::Rng::with_seed(20);
    let stimulus: Vec<Vec<Word>> = (0..20000)
        .map(|cycle| {
            let mut inputs: Vec<Word> = widths.iter().map(|&bits| random_word(&mut random, bits)).collect();
            // Whole searches and, seldom, a reset within one; scores near one another, so that positions decide.
            inputs[RST] = (cycle % 4999 < 3).into();
            if cycle % 3 == 0 {
                inputs[TOTAL] = Word::from(1 << score_bits | random.u64(..3));
            }
            inputs
        })
        .collect();
    check(&kernel, &stimulus, &mut machine);
}
