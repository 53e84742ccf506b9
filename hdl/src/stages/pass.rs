//! Stage `pass`: the matrix-vector products of a subarray, one after the other on the MAC lanes.
//!
//! The schedule issues one column per cycle. It waits for one to three cycles after each accumulation and where the operand of a
//! step is not complete yet; where quads are written and read in order, until its first quad has been written. From issue
//! to operands: addresses (1 cycle, 3 with a column list), memories (2), selection of limb and parity (1), with a network the
//! product with μ (3); then the lanes.

use dermis_golden::fixed::plan::resources::{operand_words, Holds};
use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::{
    count_bits, longest, position_bits, programs, BitDelay, Counter, Delay, Dff, Lanes, OperandScale, OperandSelect,
    OperandWriter, PassProgram, Ram, FACTOR_BITS, SCALE_LATENCY, SOURCE_BITS,
};

block! {
    /// Words of the input memory and finished v_ij in, accumulators of whole rows out.
    pub struct Pass {
        /// Columns of the longest product.
        columns: usize,
        /// Sections of the schedule.
        sections: usize,
        /// Quads of a subarray.
        quads: usize,
        fold_bits: usize,
        /// Bits of a quad of operands.
        operand_bits: usize,
        lane_bits: usize,
        /// Schedule of the products.
        pass_program: PassProgram,
        /// Operands of later products; of a schedule that has none there is no memory.
        vectors: Option<Ram>,
        operand_writer: Option<OperandWriter>,
        select: OperandSelect,
        /// Operands of the steps of `relax` are multiplied by μ.
        scales: bool,
        /// The MAC lanes.
        lanes: Lanes,
    }
    ports PassPorts {
        clock;
        reset;
        /// Index of the [section](dermis_golden::fixed::words::schedule::sections), without contacts that of the case; constant
        /// from `start` until its last row.
        in section: count_bits(*sections);
        /// The products of a subarray may begin while its input is still being written; of contacts those of a section.
        in start;
        /// Address of the quad to read from the input memory; in every cycle of a product with the input.
        out input_address: count_bits(*quads);
        /// Four parities of that quad, `fold_bits` each, signed; two cycles after `input_address`.
        in input_quad: 4 * fold_bits;
        /// Four parities of an operand, of a v_ij, the images of a layer, a window or p, `operand_bits` each, signed, quads in order;
        /// valid with `vector_valid`.
        in vector_quad: *operand_bits;
        /// `vector_quad` holds a quad.
        in vector_valid;
        /// Position of μ1 in mu_max/384, signed, with a network; valid from the quad of operands that says so.
        in position_x: position_bits();
        /// Position of μ2 in mu_max/384, signed, with a network; valid as `position_x`.
        in position_y: position_bits();
        /// Writes `coefficient_data` to the coefficient memory; only in a reset.
        in coefficient_write;
        /// Word of the memory; valid with `coefficient_write`.
        in coefficient_word: lanes.widths().coefficient_word;
        /// Pair of lanes; valid with `coefficient_write`.
        in coefficient_pair: lanes.widths().coefficient_pair;
        /// The coefficients of two lanes; valid with `coefficient_write`.
        in coefficient_data: lanes.widths().coefficient_data;
        /// Accumulators of one row for the four parities, `lane_bits` each, signed; valid with `quad_valid`.
        out quad: 4 * lane_bits;
        /// `quad` holds a row of a layer of a network; `quad_valid` is low.
        out layer_valid;
        /// `quad` holds a row.
        out quad_valid;
        /// `quad` holds a row two cycles later.
        out quad_soon;
        /// The coefficient signature of the subarray is wrong, 1 bit; valid with its last row.
        out damaged: 1;
        /// A product's column is issued in this cycle.
        out issued;
        /// Index in its section of the instruction that issues; valid with `issued`.
        out step: pass_program.widths().step;
    }
}

impl Pass {
    /// For the schedule and the coefficients of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let quads = formats.quads;
        let lengths: Vec<Vec<usize>> = programs(model).into_iter().map(|(_, section)| section.operands).collect();
        let operands = operand_words(formats);
        let operand_bits = 4 * formats.operand_bits() as usize;
        let memory = || Ram::new(operands.max(quads), 1, operand_bits).holding([Holds::Operands(0)]).registered();
        Pass {
            columns: longest(model),
            sections: lengths.len(),
            quads,
            fold_bits: formats.fold_bits as usize,
            operand_bits,
            lane_bits: formats.lane_bits as usize,
            pass_program: PassProgram::new(model),
            vectors: (operands > 0).then(memory),
            operand_writer: (operands > 0).then(|| OperandWriter::new(&lengths, model.first().storage.streamed)),
            select: OperandSelect::new(formats),
            scales: formats.scales_operands(),
            lanes: Lanes::new(model),
        }
    }
}

impl Block for Pass {
    fn build<'k>(&self, k: &'k Builder, io: PassPorts<Inside<'k>>) {
        let column = k.instance("column", Counter::new(self.columns));
        let running = k.instance("running", Dff {});
        let scaling = if self.scales { SCALE_LATENCY } else { 0 };
        let pass_program = k.instance("pass_program", &self.pass_program);
        let vectors = k.instance("vectors", self.vectors.as_ref());
        let operand_writer = k.instance("operand_writer", self.operand_writer.as_ref());
        let source = k.instance("source", Delay::new(SOURCE_BITS, 2));
        let control = k.instance("control", Delay::new(pass_program.control.bits(), 3 + scaling));
        let valid = k.instance("valid", BitDelay::new(3 + scaling + self.pass_program.latency()));
        let select = k.instance("select", &self.select);
        let lanes = k.instance("lanes", &self.lanes);

        pass_program.section.set(io.section);
        lanes.section.set(io.section);
        let issue = k.wire("issue", running.q & pass_program.ready);
        let column_end = k.wire("column_end", issue & pass_program.last);
        running.d.set((io.start | (running.q & !(column_end & pass_program.ends))) & !io.rst);
        column.clear.set(io.start | column_end);
        column.enable.set(issue);
        pass_program.start.set(io.start);
        pass_program.advance.set(column_end);
        pass_program.column.set(column.value);
        io.input_address.set(pass_program.operand_address.low(io.input_address.bits()));
        match vectors.zip(operand_writer) {
            Some((vectors, operand_writer)) => {
                operand_writer.section.set(io.section);
                operand_writer.clear.set(io.start);
                operand_writer.valid.set(io.vector_valid);
                pass_program.finished.set(operand_writer.finished);
                vectors.read.set(k.constant(1, 1));
                vectors.read_address.set(pass_program.operand_address);
                vectors.write.set(operand_writer.keep);
                vectors.write_address.set(operand_writer.address);
                vectors.write_data.set(io.vector_quad);
                select.vector_quad.set(vectors.read_data);
            }
            None => {
                pass_program.finished.set(k.constant(pass_program.finished.bits(), 0));
                select.vector_quad.set(k.constant(select.vector_quad.bits(), 0));
            }
        }

        source.d.set(pass_program.source);
        select.source.set(source.q);
        select.input_quad.set(io.input_quad);
        control.d.set(pass_program.control);
        valid.d.set(issue);

        let mut coefficient_address = pass_program.coefficient_address;
        let mut operands = select.operands;
        if self.scales {
            let factor = k.instance("factor", Delay::new(FACTOR_BITS, 3));
            let later = k.instance("coefficient_address", Delay::new(coefficient_address.bits(), scaling));
            let scale = k.instance("scale", OperandScale {});
            factor.d.set(pass_program.factor);
            scale.factor.set(factor.q);
            scale.operands.set(operands);
            scale.position_x.set(io.position_x);
            scale.position_y.set(io.position_y);
            later.d.set(coefficient_address);
            (coefficient_address, operands) = (later.q, scale.scaled);
        }
        lanes.coefficient_write.set(io.coefficient_write);
        lanes.coefficient_word.set(io.coefficient_word);
        lanes.coefficient_pair.set(io.coefficient_pair);
        lanes.coefficient_data.set(io.coefficient_data);
        lanes.address.set(coefficient_address);
        lanes.operands.set(operands);
        lanes.valid.set(valid.q);
        lanes.control.set(control.q);
        io.quad.set(lanes.quad);
        io.quad_valid.set(lanes.quad_valid);
        io.quad_soon.set(lanes.quad_soon);
        io.layer_valid.set(lanes.layer_valid);
        io.damaged.set(lanes.damaged);
        io.issued.set(issue);
        io.step.set(pass_program.step);
        k.unused([column.last, pass_program.factor]);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, VecDeque};

    use dermis_golden::fixed::stages::pass::{pass, Operands};
    use dermis_golden::fixed::words::schedule::{operand_number, Axis, Operand, Section, Target};
    use dermis_golden::fixed::CasePlan;

    use super::*;
    use crate::language::testbench::{check_with_defects, random_word, subject_of, Reference};
    use crate::language::Change;
    use crate::scenes::{learned, model};
    use crate::wire::Word;

    /// A column of a product, which one cycle issues.
    #[derive(Clone, Copy)]
    struct Column {
        accumulation: usize,
        group: usize,
        /// Whether it is one of a layer, and whether the operand is the input.
        layer: bool,
        input: bool,
        /// Operand vectors that must be readable.
        needs: usize,
        /// Address of the operand's quad.
        quad: usize,
        /// Last of its accumulation.
        last: bool,
        /// Index of its instruction in the section.
        step: usize,
    }

    /// The columns of a section in order.
    fn columns((case, section): &(&CasePlan, Section)) -> Vec<Column> {
        let (mut all, mut step): (Vec<Column>, usize) = (Vec::new(), 0);
        // μ comes between the images of hidden layers and the other vectors.
        let layers = case.formats.layers.len();
        for (accumulation, (target, products)) in section.accumulations.iter().enumerate() {
            let layer = matches!(target, Target::Layer(_));
            for group in 0..case.storage.groups_of(products) {
                for product in products {
                    let needs = match (product.operand, case.formats.by_contact()) {
                        (Operand::Vector(index), _) => index + layers + 1,
                        (Operand::Layer(index), by_contact) => index + if by_contact { 3 } else { 2 },
                        (Operand::InputHigh | Operand::InputLow, _) => usize::from(layer),
                        (Operand::Window | Operand::Shear(_, Axis::X), _) => 1,
                        (Operand::Mask | Operand::Shear(_, Axis::Y), _) => 2,
                        (Operand::One, _) => 0,
                    };
                    let input = matches!(product.operand, Operand::InputHigh | Operand::InputLow);
                    let column = |&quad| Column { accumulation, group, layer, input, needs, quad, last: false, step };
                    all.extend(case.storage.columns_of(product.matrix, group).iter().map(column));
                    step += 1;
                }
                all.last_mut().unwrap().last = true;
            }
        }
        all
    }

    /// Inputs: reset, section, start, quad of the input, quad of an operand, whether it is valid, position of μ1, of μ2.
    struct Passes<'a> {
        model: &'a Model,
        programs: Vec<(&'a CasePlan, Section)>,
        columns: Vec<Vec<Column>>,
        cycle: usize,
        /// The section that runs, or ran last.
        program: usize,
        /// The next column, while a subarray runs, and the first cycle in which it may be issued.
        next: Option<(usize, usize)>,
        /// The column issued in the cycle before, in the cycle before that, and so on.
        issued: VecDeque<Option<Column>>,
        /// The input as far as it was read, and the quads of the operands; the position of μ.
        input: Vec<[i64; 4]>,
        quads: Vec<[i64; 4]>,
        position: [i64; 2],
        /// Accumulation and row by the cycle in which they leave; none before the first reset.
        rows: Option<BTreeMap<usize, (usize, usize)>>,
    }

    impl<'a> Passes<'a> {
        fn new(model: &'a Model) -> Self {
            let programs = programs(model);
            let columns = programs.iter().map(columns).collect();
            let (input, quads) = (vec![[0; 4]; model.formats().quads], Vec::new());
            let issued = VecDeque::new();
            let position = [0; 2];
            let (cycle, program, next, rows) = (0, 0, None, None);
            Passes { model, programs, columns, cycle, program, next, issued, input, quads, position, rows }
        }

        fn case(&self) -> &'a CasePlan {
            self.programs[self.program].0
        }

        /// Cycles from the issue of a column to its address.
        fn latency(&self) -> usize {
            if self.case().storage.listed {
                3
            } else {
                1
            }
        }

        fn section(&self) -> &Section {
            &self.programs[self.program].1
        }

        /// The address that was read from the input memory so many cycles ago.
        fn input_address(&self, cycles: usize) -> Option<usize> {
            let column = self.issued.get(self.latency() - 1 + cycles).copied().flatten();
            column.filter(|column| column.input).map(|column| column.quad)
        }

        /// The column that is issued in this cycle.
        fn issue(&self) -> Option<Column> {
            let (at, free) = self.next?;
            let storage = &self.case().storage;
            let mut first = 0;
            let readable = self.section().operands.iter().filter(|length| {
                let needed = if storage.streamed { first + 1 } else { first + **length };
                first += **length;
                self.quads.len() >= needed
            });
            let readable = readable.count();
            let column = self.columns[self.program][at];
            (free <= self.cycle && column.needs <= readable).then_some(column)
        }

        fn row(&self, accumulation: usize, row: usize) -> [i64; 4] {
            let CasePlan { formats, quantised, .. } = self.case();
            let mut operands = Operands::of_input(&self.input[..formats.quads], formats);
            let (mut left, mut vectors) = (&self.quads[..], Vec::new());
            for &length in &self.section().operands {
                let (quads, rest) = left.split_at(length.min(left.len()));
                vectors.push(quads.to_vec());
                left = rest;
            }
            let mut take = |operand: Operand| match operand_number(formats, operand).and_then(|at| vectors.get_mut(at))
            {
                Some(own) => std::mem::take(own),
                None => Vec::new(),
            };
            for layer in 0..formats.layers.len().saturating_sub(1) {
                let mut images = take(Operand::Layer(layer));
                images.truncate(formats.layers[layer]);
                operands.layers.push(images);
            }
            match formats.by_contact() {
                true => {
                    let products = &self.section().accumulations[accumulation].1;
                    let is_step = products.iter().any(|product| matches!(product.operand, Operand::Shear(..)));
                    match is_step {
                        true => operands.sheared = vec![[Axis::X, Axis::Y].map(|axis| take(Operand::Shear(0, axis)))],
                        false => operands.window = [take(Operand::Window), take(Operand::Mask)],
                    }
                }
                false => operands.vectors = (0..formats.operand_vectors()).map(|k| take(Operand::Vector(k))).collect(),
            }
            operands.position = self.position;
            let all = pass(
                formats,
                quantised,
                self.case().layout(),
                &self.section().accumulations[accumulation].1,
                &operands,
            );
            // Of a layer the rows of whole groups leave.
            all.get(row).copied().unwrap_or_default()
        }
    }

    impl Reference for Passes<'_> {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let formats = self.model.formats();
            let layer = |accumulation: usize| matches!(self.section().accumulations[accumulation].0, Target::Layer(_));
            let leaves = |cycle: usize, of_layer: bool| {
                let row = self.rows.as_ref()?.get(&cycle);
                Some(row.is_some_and(|&(accumulation, _)| layer(accumulation) == of_layer).into())
            };
            let row = self.rows.as_ref().and_then(|rows| rows.get(&self.cycle));
            vec![
                self.input_address(0).map(|address| Word::from(address as u64)),
                row.map(|&(accumulation, row)| {
                    Word::of_fields(&self.row(accumulation, row), formats.lane_bits as usize)
                }),
                leaves(self.cycle, false),
                leaves(self.cycle + 2, false),
                leaves(self.cycle, true),
                Some(Word::default()),
                self.rows.as_ref().map(|_| self.issue().is_some().into()),
                self.issue().map(|column| Word::from(column.step as u64)),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let formats = self.model.formats();
            let quad = |input: usize, bits: u32| [0, 1, 2, 3].map(|parity| inputs[input].signed(parity, bits as usize));
            let [rst, section, start, valid] = [0, 1, 2, 5].map(|input| inputs[input].number() as usize);
            if let Some(address) = self.input_address(2) {
                self.input[address] = quad(3, formats.fold_bits);
            }
            let issued = self.issue();
            if let Some(column) = issued {
                let own = &self.case().formats;
                let first = column.group * own.lanes_per_parity;
                if column.last {
                    let last = if column.layer { usize::MAX } else { own.quads };
                    let count = own.lanes_per_parity.min(last - first);
                    let leave = self.cycle + self.latency() + 7 + if own.scales_operands() { SCALE_LATENCY } else { 0 };
                    let rows = (0..count).map(|row| (leave + row, (column.accumulation, first + row)));
                    self.rows.iter_mut().for_each(|all| all.extend(rows.clone()));
                }
                let free = self.cycle + 1 + if column.last { self.case().storage.pause } else { 0 };
                let at = self.next.map_or(0, |(at, _)| at + 1);
                self.next = (at < self.columns[self.program].len()).then_some((at, free));
            }
            self.issued.push_front(issued);
            self.issued.truncate(10);
            if valid == 1 && self.quads.len() < self.section().operands.iter().sum() {
                self.quads.push(quad(4, formats.operand_bits()));
            }
            self.position = [6, 7].map(|input| inputs[input].signed(0, position_bits()));
            self.cycle += 1;
            if start == 1 {
                (self.program, self.next, self.quads) = (section, Some((0, self.cycle)), Vec::new());
            }
            if rst == 1 {
                (self.next, self.rows, self.issued) = (None, Some(BTreeMap::new()), VecDeque::new());
            }
        }
    }

    /// Subarrays with random inputs, whose v_ij arrive one quad per cycle after random pauses; some are cut by a reset.
    fn stimulus(model: &Model, subarrays: usize) -> Vec<Vec<Word>> {
        let formats = model.formats();
        let mut random = fastrand::Rng::with_seed(16);
        let mut passes = Passes::new(model);
        let mut all: Vec<Vec<Word>> = Vec::new();
        let mut cut = true;
        for _ in 0..subarrays {
            let section = random.usize(..passes.programs.len());
            let quads = passes.programs[section].0.formats.quads;
            let input: Vec<Word> =
                (0..quads).map(|_| random_word(&mut random, 4 * formats.fold_bits as usize)).collect();
            let end = if random.u8(..5) == 0 { random.usize(..200) } else { usize::MAX };
            // A reset, the start of the subarray, then its cycles.
            let (mut at, mut pause, mut sent) = (0, random.usize(1..100), 0);
            let position = [(); 2].map(|()| Word::of_fields(&[random.i64(-384..=384)], position_bits()));
            // The ends of the vectors, and one more vector that is no operand.
            let mut ends = passes.programs[section].1.operands.clone();
            ends.push(quads);
            let ends: Vec<usize> = ends
                .iter()
                .scan(0, |end, length| {
                    *end += length;
                    Some(*end)
                })
                .collect();
            loop {
                let idle =
                    passes.next.is_none() && passes.rows.iter().flatten().all(|(&cycle, _)| cycle < passes.cycle);
                let whole = ends[ends.len() - 1];
                if at > 12 && (at > end || (idle && sent == whole)) {
                    break;
                }
                let valid = at > 12 && pause == 0 && sent < whole;
                let read = passes.input_address(2).and_then(|address| input.get(address).copied());
                // The coefficients are not written.
                let [write, word, pair, data] = [Word::default(); 4];
                let inputs = vec![
                    (at == 0 && cut).into(),
                    Word::from(section as u64),
                    (at == 12).into(),
                    read.unwrap_or_else(|| random_word(&mut random, 4 * formats.fold_bits as usize)),
                    random_word(&mut random, 4 * formats.operand_bits() as usize),
                    valid.into(),
                    position[0],
                    position[1],
                    write,
                    word,
                    pair,
                    data,
                ];
                passes.clock(&inputs);
                all.push(inputs);
                at += 1;
                sent += usize::from(valid);
                pause = if valid && ends.contains(&sent) {
                    random.usize(1..100)
                } else {
                    pause.saturating_sub(usize::from(at > 12))
                };
            }
            cut = end < usize::MAX;
        }
        all
    }

    #[test]
    fn rows_are_the_products_of_the_model() {
        let several = model(8, 8, "[partition]\ncases = [0, 1]\n[fixed]\nlanes = 16\n");
        let shared = model(6, 6, "[search]\nmu_max = 0.005\n");
        let streamed = model(4, 6, "[search]\nmu_max = 0.1\ndegree = 2\n");
        assert!(several.formats().groups > 1 && shared.formats().shared_a && streamed.storage().streamed);
        let network = learned(4, 5, &[13, 7], "mu_max = 0.3\n");
        let contacts = learned(6, 5, &[13, 7], "mu_max = 0.3\n[partition]\ncase = \"contacts\"\n");
        for model in [several, shared, streamed, network, contacts] {
            let subject = |changes: &[Change]| {
                subject_of!(
                    Pass::new(&model),
                    changes,
                    inputs [
                        rst, section, start, input_quad, vector_quad, vector_valid, position_x, position_y,
                        coefficient_write, coefficient_word, coefficient_pair, coefficient_data,
                    ],
                    outputs [input_address, quad, quad_valid, quad_soon, layer_valid, damaged, issued, step],
                )
            };
            let defects = [
                Change::value("", "select__source", |k| k.named("pass_program__source")),
                Change::value("", "operand_writer__clear", |k| k.named("rst")),
            ];
            let defects = if model.cases().len() == 2 { &defects[..] } else { &[] };
            check_with_defects(subject, &stimulus(&model, 20), || Passes::new(&model), defects);
        }
    }
}
