//! The sequencer as a state machine in plain integers.

use std::collections::BTreeMap;

use dermis_golden::fixed::words::arith::{bit_length, magnitude_bits, round_shift, saturate};
use dermis_golden::fixed::Model;
use dermis_golden::physics::symmetry::parity::FLIP_X;
use dermis_golden::spec::scene::Scene;

use super::*;
use crate::language::kernel_of;
use crate::language::testbench::{check, random_word, Reference};
use crate::wire::Word;

const FOLD_HIGH: u64 = Step::FoldHigh as u64;
const FOLD_LOW: u64 = Step::FoldLow as u64;
const FIRST: u64 = Step::First as u64;
const REPLAY: u64 = Step::Replay as u64;
const OTHERS: u64 = Step::Others as u64;

/// Inputs in the order of the kernel.
const INPUTS: [&str; 12] = [
    "rst",
    "start",
    "magnitude",
    "code",
    "row_word",
    "row_valid",
    "raw_word",
    "rounded",
    "clipped",
    "round_done",
    "transformed",
    "transformed_valid",
];

fn word(inputs: &[Word], name: &str) -> Word {
    inputs[INPUTS.iter().position(|input| *input == name).unwrap()]
}

fn bit(inputs: &[Word], name: &str) -> bool {
    word(inputs, name).number() == 1
}

struct Machine {
    formats: Formats,
    program: Vec<Instruction>,
    widths: [usize; 12],
    /// Names and widths of the outputs in the order of the kernel.
    outputs: Vec<(String, usize)>,
    state: State,
    /// A frame has started since the first reset; before, most is undefined.
    started: bool,
    reset: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    step: u64,
    draining: bool,
    wait: u64,
    quad: u64,
    phase: u64,
    column: u64,
    gap: u64,
    product: u64,
    first_product: u64,
    seen: u64,
    length: u64,
    normalise: u64,
    rescale: u64,
    saturations: u64,
    read: [bool; 2],
    replayed: bool,
    written: u64,
    vector: u64,
    stored: u64,
}

impl Machine {
    fn drained(&self) -> bool {
        self.state.draining && self.state.wait == DRAIN - 1
    }

    fn advance(&mut self, inputs: &[Word]) {
        let f = &self.formats;
        let quads = f.quads as u64;
        let s = self.state;
        let mut next = s;
        let end_of_words = 4 * quads - 1;
        next.length = u64::from(bit_length(s.seen));
        next.read = [self.reads(), s.read[0]];
        next.replayed = s.step == REPLAY && !s.draining && s.phase < 4;
        if s.step == FOLD_HIGH {
            next.normalise = u64::from(f.input_bits - 1) - s.length;
        }
        if s.step == FIRST {
            next.rescale = s.length.saturating_sub(u64::from(f.vector_bits - 1));
        }
        if self.rescaled(inputs) && bit(inputs, "clipped") {
            next.saturations += 1;
        }
        if s.step == FIRST && bit(inputs, "row_valid") {
            next.seen |= magnitude_bits(self.signed(inputs, "row_word"));
            next.stored = if s.stored == end_of_words { 0 } else { s.stored + 1 };
        }
        if (self.is_folding() && bit(inputs, "transformed_valid")) || self.rescaled(inputs) {
            next.written = if s.written == end_of_words { 0 } else { s.written + 1 };
            if self.rescaled(inputs) && s.written == end_of_words {
                next.vector += 1;
            }
        }
        let last_quad = s.quad == quads - 1;
        if s.draining {
            next.wait = s.wait + 1;
            if self.drained() {
                next.draining = false;
                next.step = match s.step {
                    FOLD_HIGH if f.input_low_bits == 0 => FIRST,
                    OTHERS => 0,
                    step => step + 1,
                };
                if next.step == FIRST {
                    next.seen = 0;
                }
            }
        } else if self.is_folding() || s.step == REPLAY {
            next.phase = (s.phase + 1) % 8;
            if s.phase == 7 {
                next.quad = if last_quad { 0 } else { s.quad + 1 };
                next.draining = last_quad;
            }
        } else if s.step != 0 {
            let last = self.program[s.product as usize].last;
            if s.gap == 0 {
                next.column = if s.column == quads - 1 { 0 } else { s.column + 1 };
                if s.column == quads - 1 {
                    if last {
                        next.gap = 1;
                    } else {
                        next.product = s.product + 1;
                    }
                }
            } else if s.gap == row_gap(f.quads) {
                next.gap = 0;
                next.quad = if last_quad { 0 } else { s.quad + 1 };
                next.product = if last_quad { s.product + 1 } else { s.first_product };
                next.first_product = if last_quad { s.product + 1 } else { s.first_product };
                next.draining = last_quad && (s.step == FIRST || s.product as usize == self.program.len() - 1);
            } else {
                next.gap = s.gap + 1;
            }
        }
        if !s.draining {
            next.wait = 0;
        }
        if s.step == 0 && bit(inputs, "start") {
            next = State { step: FOLD_HIGH, seen: word(inputs, "magnitude").number(), ..State::default() };
        }
        if bit(inputs, "rst") {
            next.step = 0;
            next.draining = false;
        }
        self.state = next;
    }

    fn is_folding(&self) -> bool {
        matches!(self.state.step, FOLD_HIGH | FOLD_LOW)
    }

    fn reads(&self) -> bool {
        self.is_folding() && !self.state.draining && self.state.phase < 4
    }

    fn is_unfolding(&self) -> bool {
        matches!(self.state.step, REPLAY | OTHERS)
    }

    fn rescaled(&self, inputs: &[Word]) -> bool {
        self.is_unfolding() && bit(inputs, "round_done")
    }

    /// The operand to write: a limb of a folded word, or a rescaled word rounded to `data_bits`.
    fn operand(&self, inputs: &[Word]) -> i64 {
        let f = &self.formats;
        let low = f.input_low_bits;
        let transformed = self.signed(inputs, "transformed");
        match self.state.step {
            FOLD_HIGH => transformed >> low,
            FOLD_LOW => (transformed & ((1 << low) - 1)) << (f.limb_align - low),
            _ => {
                let word = self.signed(inputs, "rounded");
                saturate(round_shift(word, SEARCH_EXTRA_BITS), f.data_bits).0
            }
        }
    }

    fn signed(&self, inputs: &[Word], name: &str) -> i64 {
        let index = INPUTS.iter().position(|input| *input == name).unwrap();
        inputs[index].signed(0, self.widths[index])
    }

    /// The outputs, and whether they are defined.
    fn values(&self, inputs: &[Word]) -> BTreeMap<&'static str, (bool, i64)> {
        let (f, s) = (&self.formats, self.state);
        let bits = count_bits(f.quads);
        let place = (4 * s.quad + s.phase % 4) as i64;
        let (unrounded, shift, round) = match s.step {
            REPLAY => (self.signed(inputs, "raw_word"), s.rescale, s.replayed),
            OTHERS => (self.signed(inputs, "row_word"), u64::from(f.a_shift), bit(inputs, "row_valid")),
            _ => (self.signed(inputs, "code") << (f.input_bits - 1), s.length, s.read[1]),
        };
        let issue = matches!(s.step, FIRST | OTHERS) && !s.draining && s.gap == 0;
        let instruction = self.program[(s.product as usize).min(self.program.len() - 1)];
        let (folded, rescaled) = (self.is_folding() && bit(inputs, "transformed_valid"), self.rescaled(inputs));
        let write = folded || rescaled && s.vector < f.operand_vectors() as u64;
        let vector = match s.step {
            FOLD_HIGH => 0,
            FOLD_LOW => 1,
            _ => first_vector(f) as u64 + s.vector,
        };
        let flip = if self.is_folding() { 0 } else { FLIP_X as u64 };
        let raw_write = s.step == FIRST && bit(inputs, "row_valid");
        let freed = if f.input_low_bits == 0 { FOLD_HIGH } else { FOLD_LOW };
        let always = |value: bool| (true, i64::from(value));
        let matrix = ((instruction.matrix as u64) << bits | s.quad) << bits | s.column;
        [
            ("index", (self.started, place)),
            ("raw_read_address", (self.started, place)),
            ("raw_write", always(raw_write)),
            ("raw_write_address", (raw_write, s.stored as i64)),
            ("unrounded", (self.reset, unrounded)),
            ("round_shift", (self.started && round, shift as i64)),
            ("round", (self.started, i64::from(round))),
            ("transform", always(bit(inputs, "round_done") && s.step != 0)),
            ("issue", always(issue)),
            ("last", (issue, i64::from(instruction.last && s.column == f.quads as u64 - 1))),
            ("address", (issue, matrix as i64)),
            ("low", (issue, i64::from(instruction.low))),
            ("operand_address", (issue, ((instruction.operand as u64) << bits | s.column) as i64)),
            ("flip", (issue, i64::from(instruction.flip))),
            ("align", (issue, i64::from(instruction.align))),
            ("write", always(write)),
            ("write_address", (write, (vector << bits | s.written >> 2) as i64)),
            ("write_lane", (write, (s.written & 3 ^ flip) as i64)),
            ("write_data", (write, if write { self.operand(inputs) } else { 0 })),
            ("normalised_valid", always(s.step == FOLD_HIGH && bit(inputs, "round_done"))),
            ("folding", always(s.step == FOLD_HIGH)),
            ("rescaled_valid", always(rescaled)),
            ("unfolding", always(self.is_unfolding())),
            ("free", always(self.drained() && s.step == freed)),
            ("normalise", (self.started, s.normalise as i64)),
            ("rescale", (self.started, s.rescale as i64)),
            ("saturations", (self.started, s.saturations as i64)),
            ("busy", always(s.step != 0)),
            ("done", always(self.drained() && s.step == OTHERS)),
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
        self.started |= self.reset && self.state.step == 0 && bit(inputs, "start");
        self.reset |= bit(inputs, "rst");
        self.advance(inputs);
    }
}

/// The sequencer of a small array with this section of a scene.
fn check_with(more: &str) {
    let text = format!(
        "name = \"solve\"\n[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 4.0\npitch_y_mm = 3.0\nthickness_mm = 3.0\n\
         [hardware]\nboard = \"icebreaker\"\n{more}"
    );
    let formats = Model::new(&Scene::parse(&text, "solve.toml").unwrap()).unwrap().formats().clone();
    let (acc, code) = (formats.acc_bits as usize, formats.input_bits as usize);
    let rounded = formats.input_bits.max(formats.vector_bits) as usize;
    let block = PassSequencer::new(&formats, acc.max(2 * code), rounded);
    let kernel = kernel_of(&block);
    let outputs = kernel.signals.iter().filter(|signal| signal.output);
    let mut machine = Machine {
        program: program(&formats),
        widths: [1, 1, code - 1, code, acc, 1, acc, rounded, 1, 1, rounded + 2, 1],
        outputs: outputs.map(|signal| (signal.name.clone(), signal.ty.bits)).collect(),
        state: State::default(),
        started: false,
        reset: false,
        formats: formats.clone(),
    };
    let mut random = fastrand::Rng::with_seed(20);
    let stimulus: Vec<Vec<Word>> = (0..20000)
        .map(|cycle| {
            let mut inputs: Vec<Word> = machine.widths.iter().map(|&bits| random_word(&mut random, bits)).collect();
            // Whole frames and, seldom, a reset within one.
            inputs[0] = (cycle % 4999 < 3).into();
            // The rounder keeps a rescaled word within its range.
            let range = formats.vector_bits as usize;
            inputs[7] = Word::of_fields(&[inputs[7].signed(0, range)], rounded);
            inputs
        })
        .collect();
    check(&kernel, &stimulus, &mut machine);
}

#[test]
fn words_go_where_the_state_machine_sends_them() {
    check_with("");
    check_with("[fixed]\ninput_bits = 12\n");
}
