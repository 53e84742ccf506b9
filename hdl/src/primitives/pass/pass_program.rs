//! Schedule of the matrix passes as a table of instructions.

use dermis_golden::fixed::plan::program::{instructions, Instruction};
use dermis_golden::fixed::plan::resources::{operand_words, Holds};
use dermis_golden::fixed::words::schedule::{sections, Axis, Operand, Section, Target};
use dermis_golden::fixed::{CasePlan, Model};

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, Net, Type};
use crate::primitives::address::counter::count_bits;

/// One product over the columns of one group of rows: an instruction of the schedule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// First address in the coefficient memory.
    pub coefficients: usize,
    /// Number of words there: the stored columns.
    pub columns: usize,
    /// First address in the operand memory.
    pub operand: usize,
    /// Operand: 0 = from the operand memory, 1 = high limb of the input, 2 = low limb, 3 = one.
    pub kind: u64,
    /// Source parity = target parity XOR `flip`.
    pub flip: u64,
    /// The operand is read with x and y exchanged.
    pub transposed: bool,
    /// What the operand is multiplied by: 0 = nothing, 1 = μ1, 2 = μ2.
    pub factor: u64,
    /// The accumulation is that of a layer of a network.
    pub layer: bool,
    /// Last product of an accumulation.
    pub last: bool,
    /// Last step of a section.
    pub ends: bool,
    /// Number of operand vectors that must be readable before this step.
    pub needs: usize,
}

/// The sections of all cases, each with its case: what a `start` of the pass program begins.
pub fn programs(model: &Model) -> Vec<(&CasePlan, Section)> {
    let mut all = Vec::new();
    for case in model.cases() {
        all.extend(sections(&case.formats).into_iter().map(|section| (case, section)));
    }
    all
}

/// The steps of a section: its [instructions](dermis_golden::fixed::plan::program).
fn unroll((case, section): &(&CasePlan, Section)) -> Vec<Step> {
    let step = |instruction: Instruction| Step {
        coefficients: instruction.coefficients,
        columns: instruction.columns,
        operand: instruction.operand,
        kind: match instruction.product.operand {
            Operand::InputHigh => 1,
            Operand::InputLow => 2,
            Operand::One => 3,
            _ => 0,
        },
        flip: instruction.product.matrix.flip as u64,
        transposed: instruction.product.transposed,
        factor: instruction.product.factor.map_or(0, |axis| if axis == Axis::X { 1 } else { 2 }),
        layer: matches!(instruction.target, Target::Layer(_)),
        last: instruction.last,
        ends: false,
        needs: instruction.needs,
    };
    let mut steps: Vec<Step> = instructions(case, section).into_iter().map(step).collect();
    if let Some(step) = steps.last_mut() {
        step.ends = true;
    }
    steps
}

/// Number of columns of the longest step.
pub fn longest(model: &Model) -> usize {
    let steps = programs(model).iter().flat_map(unroll).map(|step| step.columns).max();
    steps.unwrap_or(1).max(model.formats().quads)
}

block! {
    /// Position in the step's columns in; addresses and control out, one cycle later, or three where a column list is
    /// read.
    ///
    /// `start` loads the first step of `section` ([`programs`]), `advance` the next one, both at the clock edge.
    /// `ready` (the step's operand can be read, and the pause after an accumulation is over), `last` (its last column)
    /// and `ends` (the last step of the section, after which the first follows) are combinational.
    ///
    /// The current instruction is in a register. The table is always read at the next instruction, because `advance`
    /// settles late in the cycle.
    pub struct PassProgram {
        /// The steps of each section.
        steps: Vec<Vec<Step>>,
        /// Address of each coefficient word's column, and its transposed address; empty without a column list.
        list: Vec<[usize; 2]>,
        /// Some step reads its operand transposed.
        across: bool,
        /// Cycles without a product after each accumulation, 1 to 3.
        pause: usize,
        /// Words of the coefficient memory.
        words: usize,
        /// Columns of the longest step.
        columns: usize,
        /// Words of the operand memory.
        operands: usize,
        /// Vectors of the operand memory.
        vectors: usize,
        control: Control,
    }
    ports PassProgramPorts {
        clock;
        /// Index of the section; valid with `start`, constant until its last step.
        in section: count_bits(steps.len());
        /// Load the first step at the clock edge.
        in start;
        /// Load the next step at the clock edge.
        in advance;
        /// Position in the step's columns; taken in every cycle.
        in column: count_bits(*columns);
        /// Number of operand vectors of this subarray that can be read; taken in every cycle.
        in finished: count_bits(vectors + 1);
        /// The step's operand can be read, and the pause after an accumulation is over.
        out ready;
        /// `column` is the step's last.
        out last;
        /// The step is the last of its section.
        out ends;
        /// Address in the coefficient memory; [`latency`](PassProgram::latency) cycles after `column`.
        out coefficient_address: count_bits(*words);
        /// Address in the operand memory, and in its low bits in the input memory; [`latency`](PassProgram::latency)
        /// cycles after `column`.
        out operand_address: count_bits(*operands);
        /// Operand selection as in [`OperandSelect`](super::operand_select::OperandSelect): kind, flip, exchange, from
        /// bit 0; with the addresses.
        out source: SOURCE_BITS;
        /// Factor of the operand as in [`OperandScale`](super::operand_scale::OperandScale); with the addresses.
        /// Constant 0 without a network.
        out factor: FACTOR_BITS;
        /// Control of [`Lanes`](crate::primitives::arithmetic::lanes::Lanes), see [`Control`]; with the addresses.
        out control: control.bits();
        /// Index of the step in its section; from `start` on.
        out step: count_bits(largest_of(steps));
    }
}

/// The control word of the lanes: bit 0 is the last product of an accumulation; the others are there where they are
/// needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Control {
    /// Whether a bit says that the accumulation is that of a layer.
    pub layers: bool,
    /// Whether a bit says that the product is the first of a subarray, for the coefficient check.
    pub opens: bool,
}

impl Control {
    /// The word of `model`.
    pub fn new(model: &Model) -> Self {
        Control { layers: model.has_network(), opens: model.has_coefficient_check() }
    }

    /// Width in bits.
    pub fn bits(self) -> usize {
        1 + usize::from(self.layers) + usize::from(self.opens)
    }

    /// Bit of the layers.
    pub fn layer_at(self) -> Option<usize> {
        self.layers.then_some(1)
    }

    /// Bit of the first product.
    pub fn opens_at(self) -> Option<usize> {
        self.opens.then_some(1 + usize::from(self.layers))
    }
}

/// Width of `factor`, in bits.
pub const FACTOR_BITS: usize = 2;

/// File of the column list, one line per word of the coefficient memory.
pub const COLUMN_FILE: &str = "columns.hex";
/// Width of `source`, in bits.
pub const SOURCE_BITS: usize = 5;

impl PassProgram {
    /// The schedule of `model`.
    pub fn new(model: &Model) -> Self {
        let (formats, cases) = (model.formats(), model.cases());
        let programs = programs(model);
        let pair = |case: &CasePlan, j| [j, if formats.shared_a { case.layout().transposed(j) } else { j }];
        let pairs = |case: &CasePlan| case.storage.column_list().iter().map(|&j| pair(case, j)).collect::<Vec<_>>();
        PassProgram {
            steps: programs.iter().map(unroll).collect(),
            list: cases.iter().filter(|case| case.storage.listed).flat_map(pairs).collect(),
            across: formats.shared_a,
            pause: model.first().storage.pause,
            words: cases.iter().map(|case| case.storage.words()).sum(),
            columns: longest(model),
            operands: operand_words(formats).max(formats.quads),
            vectors: programs.iter().map(|(_, section)| section.operands.len()).max().unwrap_or(0),
            control: Control::new(model),
        }
    }

    /// Cycles from `column` to the addresses: 1, or 3 with a column list.
    pub fn latency(&self) -> usize {
        if self.list.is_empty() {
            1
        } else {
            3
        }
    }

    /// Widths of the fields of an instruction, from bit 0: last, kind and flip and transposed as in
    /// `source`, ends, final column, needs, operand, coefficients; with a network also factor and layer.
    fn fields(&self) -> Vec<usize> {
        let (columns, needs) = (count_bits(self.columns), count_bits(self.vectors + 1));
        let mut all = vec![1, SOURCE_BITS, 1, columns, needs, count_bits(self.operands), count_bits(self.words)];
        if self.control.layers {
            all.extend([FACTOR_BITS, 1]);
        }
        all
    }

    /// The instruction of `step`.
    fn word(&self, step: &Step) -> u64 {
        let source = step.kind | step.flip << 2 | u64::from(step.transposed) << 4;
        let [last, ends] = [step.last, step.ends].map(u64::from);
        let numbers = [step.columns - 1, step.needs, step.operand, step.coefficients].map(|number| number as u64);
        let [columns, needs, operand, coefficients] = numbers;
        let all = [last, source, ends, columns, needs, operand, coefficients, step.factor, u64::from(step.layer)];
        all.into_iter().zip(self.fields()).rev().fold(0, |word, (field, bits)| word << bits | field)
    }

    /// The instruction at index `asked` of `section`; zeros beyond the last.
    fn table<'k>(&self, k: &'k Builder, section: Expr<'k>, asked: Expr<'k>) -> Expr<'k> {
        let (length, bits) = (1 << asked.bits(), self.fields().iter().sum());
        let (index, cases) = match self.steps.len() {
            1 => (asked, 1),
            _ => (section.concat(asked), 1 << section.bits()),
        };
        let mut words = vec![0; cases * length];
        for (case, steps) in self.steps.iter().enumerate() {
            for (step, word) in steps.iter().zip(&mut words[case * length..]) {
                *word = self.word(step);
            }
        }
        k.wire("instruction", index.table(bits, &words))
    }

    /// The addresses for `column`, and with them source, factor and control, all to be registered once more: at once,
    /// or behind the column list.
    fn addresses<'k>(
        &self,
        k: &'k Builder,
        column: Expr<'k>,
        [c_base, o_base]: [Expr<'k>; 2],
        with: [Option<Expr<'k>>; 3],
    ) -> ([Expr<'k>; 2], [Option<Expr<'k>>; 3]) {
        const NAMES: [&str; 3] = ["source", "factor", "control"];
        let coefficients = (c_base + column).low(c_base.bits());
        let operand = |base: Expr<'k>, column: Expr<'k>| (base + column).low(o_base.bits());
        if self.list.is_empty() {
            return ([coefficients, operand(o_base, column)], with);
        }
        let bits = column.bits();
        let word = |&[straight, transposed]: &[usize; 2]| match self.across {
            true => vec![(transposed << bits | straight) as u64],
            false => vec![straight as u64],
        };
        let contents = Contents::File { name: COLUMN_FILE.to_owned(), words: self.list.iter().map(word).collect() };
        k.comment("Column of each coefficient word, and its transposed address above it if one is needed.");
        let columns =
            k.memory("columns", self.list.len(), bits << usize::from(self.across), contents).holds(Holds::Columns);
        let twice = |name: &str, value: Expr<'k>| {
            let once = k.delay(&format!("{name}1"), value);
            [once, k.delay(&format!("{name}2"), once)]
        };
        let [c_address1, c_address2] = twice("c_address", coefficients);
        let [_, o_base2] = twice("o_base", o_base);
        let with2 = [0, 1, 2].map(|at| with[at].map(|value| twice(NAMES[at], value)[1]));
        let pair = k.delay("pair", columns.read(c_address1));
        let kept = match (self.across, with2[0]) {
            (true, Some(source2)) => source2.at(4).mux(pair.slice(bits, bits), pair.low(bits)),
            _ => pair,
        };
        let kept = k.wire("kept", kept);
        ([c_address2, operand(o_base2, kept)], with2)
    }
}

impl Block for PassProgram {
    fn build<'k>(&self, k: &'k Builder, io: PassProgramPorts<Inside<'k>>) {
        let step = io.step.register();
        let names =
            ["last_product", "selects", "ends", "final_column", "needs", "o_base", "c_base", "multiplies", "of_layer"];
        let registers: Vec<Net> =
            names.iter().zip(self.fields()).map(|(name, bits)| k.register(name, Type::unsigned(bits))).collect();
        let &[last_product, selects, ends, final_column, needs, o_base, c_base, ref of_network @ ..] = &registers[..]
        else {
            unreachable!("one register per field")
        };
        let asked = k.wire("asked", (io.start | *ends).mux(k.constant(step.bits(), 0), step.plus(1)));
        let instruction = self.table(k, io.section, asked);
        k.when(io.start | io.advance, || {
            step.set(asked);
            let mut at = 0;
            for register in &registers {
                register.set(instruction.slice(at, register.bits()));
                at += register.bits();
            }
        });
        let ended = io.advance & *last_product;
        let pauses = (1..=self.pause).scan(ended, |ended, number| {
            *ended = k.delay(&format!("pause_{number}"), *ended);
            Some(*ended)
        });
        let pauses = pauses.reduce(|one, other| one | other).unwrap_or(k.constant(1, 0));
        io.ready.set(!(pauses | io.finished.less(*needs)));
        let last = io.last.set(io.column.equals(*final_column));
        let opens = self.control.opens.then(|| step.is(0) & io.column.is(0));
        let layer = of_network.get(1).map(Net::get);
        let flags: Vec<Expr> = opens.into_iter().chain(layer).chain([*last_product & last]).collect();
        let flags = k.wire("flags", concat(&flags));
        let factor = of_network.first().map(Net::get);
        let with = [Some(*selects), factor, Some(flags)];
        let ([coefficients, operands], with) = self.addresses(k, io.column, [*c_base, *o_base], with);
        io.coefficient_address.delay(coefficients);
        io.operand_address.delay(operands);
        for (output, value) in [io.source, io.factor, io.control].into_iter().zip(with) {
            match value {
                Some(value) => output.delay(value),
                None => output.set(k.constant(output.bits(), 0)),
            };
        }
    }
}

/// Number of steps of the section that has most.
fn largest_of(steps: &[Vec<Step>]) -> usize {
    steps.iter().map(Vec::len).max().unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const QUADS: usize = 7;
    const VECTORS: usize = 2;

    /// Two sections of steps with random fields, with or without a column list.
    fn shape(listed: bool, control: Control) -> PassProgram {
        let mut random = fastrand::Rng::with_seed(6);
        let mut step = |index: usize, count: usize| Step {
            coefficients: random.usize(..40),
            columns: random.usize(1..=QUADS),
            operand: random.usize(..VECTORS) * QUADS,
            kind: random.u64(..4),
            flip: random.u64(..4),
            transposed: random.bool(),
            factor: if control.layers { random.u64(..3) } else { 0 },
            layer: control.layers && random.bool(),
            last: random.bool(),
            ends: index + 1 == count,
            needs: random.usize(..=VECTORS),
        };
        let steps = [5, 3].map(|count| (0..count).map(|index| step(index, count)).collect()).into();
        let list = (0..47).map(|_| [random.usize(..QUADS), random.usize(..QUADS)]).collect();
        let list = if listed { list } else { Vec::new() };
        PassProgram {
            steps,
            list,
            across: listed,
            pause: 1 + usize::from(listed),
            words: 47,
            columns: QUADS,
            operands: VECTORS * QUADS,
            vectors: VECTORS,
            control,
        }
    }

    /// The step in execution, its index, the outputs on their way.
    struct Program {
        shape: PassProgram,
        now: Option<(Step, usize)>,
        /// Whether each of the cycles of the pause before ended an accumulation.
        ended: VecDeque<Option<bool>>,
        pipe: VecDeque<[Option<Word>; 5]>,
    }

    impl Program {
        /// Addresses, selection and control for `column` of the present step.
        fn put(&self, column: usize) -> [Option<Word>; 5] {
            let Some((step, index)) = &self.now else { return [None; 5] };
            let address = step.coefficients + column;
            let quad = self.shape.list.get(address).map_or(column, |pair| pair[usize::from(step.transposed)]);
            let source = step.kind | step.flip << 2 | u64::from(step.transposed) << 4;
            let last = step.last && column + 1 == step.columns;
            let Control { layers, opens } = self.shape.control;
            let opens = u64::from(opens && *index == 0 && column == 0) << usize::from(layers);
            let control = (opens | u64::from(step.layer)) << 1 | u64::from(last);
            [address as u64, (step.operand + quad) as u64, source, step.factor, control]
                .map(|word| Some(Word::from(word)))
        }
    }

    impl Reference for Program {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [column, finished] = [3, 4].map(|k| inputs[k].number() as usize);
            let of = |of: &dyn Fn(&Step) -> bool| self.now.map(|(step, _)| Word::from(of(&step)));
            let pauses = self.ended.contains(&Some(true));
            let flags = [
                self.now.map(|(_, index)| Word::from(index as u64)),
                of(&|step| step.ends),
                of(&|step| finished >= step.needs && !pauses),
                of(&|step| column + 1 == step.columns),
            ];
            flags.into_iter().chain(self.pipe[0]).collect()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [case, column] = [0, 3].map(|k| inputs[k].number() as usize);
            let [start, advance] = [1, 2].map(|k| inputs[k].number() == 1);
            self.pipe.push_back(self.put(column));
            self.pipe.pop_front();
            self.ended.push_back(self.now.map(|(step, _)| advance && step.last));
            self.ended.pop_front();
            if start {
                self.now = Some((self.shape.steps[case][0], 0));
            } else if let Some((step, index)) = self.now.filter(|_| advance) {
                let next = if step.ends { 0 } else { index + 1 };
                self.now = Some((self.shape.steps[case][next], next));
            }
        }
    }

    #[test]
    fn steps_follow_each_other_and_their_columns_have_their_addresses() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut case = 0;
        let inputs = |cycle: usize| {
            let start = cycle == 1 || random.u8(..60) == 0;
            if start {
                case = random.u64(..2);
            }
            let (column, finished) = (random.u64(..QUADS as u64), random.u64(..=VECTORS as u64));
            vec![case.into(), start.into(), (cycle > 4 && random.u8(..3) == 0).into(), column.into(), finished.into()]
        };
        let stimulus: Vec<Vec<Word>> = (0..3000).map(inputs).collect();
        for (listed, layers, opens) in [(false, false, false), (true, false, true), (false, true, true)] {
            let shape = shape(listed, Control { layers, opens });
            let pipe = vec![[None; 5]; shape.latency()].into();
            let ended = vec![None; shape.pause].into();
            check(&kernel_of(&shape), &stimulus, &mut Program { ended, shape, now: None, pipe });
        }
    }
}
