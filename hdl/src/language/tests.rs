mod errors;
mod states;

use std::collections::BTreeMap;

use super::kernel::{Port, Role};
use super::resources::FLATTENED;
use super::testbench::{check, random_words, verilated, Reference, Subject};
use super::*;
use crate::wire::Word;

/// Makes all of `names` driven ports of a finished kernel.
fn bound(kernel: Kernel, outputs: &[(&str, usize)]) -> Kernel {
    let mut kernel = kernel;
    let inputs = kernel.signals.iter().filter(|signal| signal.role == Role::Input);
    let inputs: Vec<(String, usize)> = inputs.map(|signal| (signal.name.clone(), signal.ty.bits)).collect();
    let outputs = outputs.iter().map(|&(name, bits)| (name.to_owned(), bits));
    for (output, ports) in [(false, inputs), (true, outputs.collect())] {
        for (name, bits) in ports {
            kernel.bind(&name, bits, output);
            kernel.ports.push(Port { name, bits, output, doc: String::new() });
        }
    }
    kernel
}

/// An operator, its inputs' widths, and the same in integers: operands are unsigned, or signed if so marked.
struct Case {
    name: &'static str,
    bits: usize,
    integer: fn(&[i128]) -> i128,
}

/// Operands: unsigned a, b of 13 and 9 bits; signed s, t of 13 and 9; wide unsigned w, v of 90 and 70; wide signed x;
/// a bit c; a number n of 4 bits.
const OPERANDS: [(&str, usize, bool); 9] = [
    ("a", 13, false),
    ("b", 9, false),
    ("s", 13, true),
    ("t", 9, true),
    ("w", 90, false),
    ("v", 70, false),
    ("x", 90, true),
    ("c", 1, false),
    ("n", 4, false),
];

fn round(value: i128, by: u32) -> i128 {
    (value + (1 << (by - 1))) >> by
}

const CASES: &[Case] = &[
    Case { name: "add_u", bits: 14, integer: |i| i[0] + i[1] },
    Case { name: "add_s", bits: 14, integer: |i| i[2] + i[3] },
    Case { name: "add_w", bits: 91, integer: |i| i[4] + i[5] },
    Case { name: "add_x", bits: 91, integer: |i| i[6] + i[3] },
    Case { name: "sub_u", bits: 14, integer: |i| i[0] - i[1] },
    Case { name: "sub_s", bits: 14, integer: |i| i[2] - i[3] },
    Case { name: "sub_w", bits: 91, integer: |i| i[5] - i[4] },
    Case { name: "low_add", bits: 5, integer: |i| i[0] + i[1] },
    Case { name: "low_sub", bits: 11, integer: |i| i[2] - i[3] },
    Case { name: "low_wide", bits: 60, integer: |i| i[4] - i[5] },
    Case { name: "mul_u", bits: 22, integer: |i| i[0] * i[1] },
    Case { name: "mul_s", bits: 22, integer: |i| i[2] * i[3] },
    Case { name: "mul_w", bits: 79, integer: |i| i[5] * i[1] },
    Case { name: "mul_x", bits: 99, integer: |i| i[6] * i[3] },
    Case { name: "mul_add", bits: 24, integer: |i| i[2] * i[3] + i[3] },
    Case { name: "and_u", bits: 13, integer: |i| i[0] & (i[1] << 4) },
    Case { name: "or_w", bits: 90, integer: |i| i[4] | i[5] },
    Case { name: "xor_w", bits: 70, integer: |i| i[5] ^ (i[4] & ((1 << 70) - 1)) },
    Case { name: "not_u", bits: 13, integer: |i| !i[0] },
    Case { name: "not_w", bits: 90, integer: |i| !i[4] },
    Case { name: "equal", bits: 1, integer: |i| (i[1] & 3 == i[8] & 3).into() },
    Case { name: "equal_w", bits: 1, integer: |i| (i[4] & 1 == i[7]).into() },
    Case { name: "less_u", bits: 1, integer: |i| (i[0] < i[1]).into() },
    Case { name: "less_s", bits: 1, integer: |i| (i[2] < i[3]).into() },
    Case { name: "less_w", bits: 1, integer: |i| (i[4] < i[5]).into() },
    Case { name: "less_x", bits: 1, integer: |i| (i[6] < i[3]).into() },
    Case { name: "mux_s", bits: 13, integer: |i| if i[7] == 1 { i[2] } else { i[3] } },
    Case { name: "mux_w", bits: 90, integer: |i| if i[7] == 1 { i[4] } else { i[5] } },
    Case {
        name: "case_u",
        bits: 13,
        integer: |i| match i[8] {
            3 => i[0],
            5 => i[1],
            6 => 77,
            _ => 0,
        },
    },
    Case { name: "slice_s", bits: 7, integer: |i| i[2] >> 5 },
    Case { name: "slice_w", bits: 20, integer: |i| i[4] >> 55 },
    Case { name: "slice_x", bits: 80, integer: |i| i[6] >> 9 },
    Case { name: "slice_sum", bits: 6, integer: |i| (i[0] + i[1]) >> 3 },
    Case { name: "concat", bits: 23, integer: |i| i[7] << 22 | i[1] << 13 | (i[2] & 0x1fff) },
    Case { name: "concat_w", bits: 104, integer: |i| i[0] << 91 | i[4] << 1 | i[7] },
    Case { name: "extend_s", bits: 40, integer: |i| i[2] },
    Case { name: "extend_x", bits: 120, integer: |i| i[3] },
    Case { name: "resize_s", bits: 5, integer: |i| i[2] },
    Case { name: "resize_t", bits: 20, integer: |i| i[3] },
    Case { name: "repeated", bits: 12, integer: |i| i[8] * 0x111 },
    Case { name: "squares", bits: 9, integer: |i| i[8] * i[8] + 3 },
    Case { name: "all", bits: 1, integer: |i| (i[8] == 15).into() },
    Case { name: "any", bits: 1, integer: |i| (i[8] != 0).into() },
    Case { name: "parity", bits: 1, integer: |i| ((i[2] & 0x1fff).count_ones() % 2).into() },
    Case { name: "parity_w", bits: 1, integer: |i| (i[4].count_ones() % 2).into() },
    Case { name: "any_w", bits: 1, integer: |i| (i[4] >> 80 != 0).into() },
    Case { name: "all_w", bits: 1, integer: |i| (i[7] == 1 || i[4] == (1 << 90) - 1).into() },
    Case { name: "left", bits: 18, integer: |i| i[2] << 5 },
    Case { name: "right", bits: 8, integer: |i| i[2] >> 5 },
    Case { name: "round_s", bits: 10, integer: |i| round(i[2], 4) },
    Case { name: "round_u", bits: 10, integer: |i| round(i[0], 4) },
    Case { name: "round_x", bits: 61, integer: |i| round(i[6], 30) },
    Case { name: "left_by", bits: 13, integer: |i| i[0] << i[8] },
    Case { name: "right_by", bits: 13, integer: |i| i[0] >> i[8] },
    Case { name: "arithmetic_by", bits: 13, integer: |i| i[2] >> i[8] },
    Case { name: "inner_arithmetic", bits: 14, integer: |i| (i[2] >> i[8]) + i[3] },
    Case { name: "left_w", bits: 90, integer: |i| (i[4] << i[8]) & ((1 << 90) - 1) },
    Case { name: "arithmetic_x", bits: 90, integer: |i| i[6] >> i[8] },
];

fn operators() -> Kernel {
    let k = Builder::combinational("operators");
    let inputs: Vec<Expr> = OPERANDS
        .iter()
        .map(|&(name, bits, signed)| {
            let input = k.input(name, bits);
            if signed {
                input.signed()
            } else {
                input
            }
        })
        .collect();
    let [a, b, s, t, w, v, x, c, n] = inputs[..] else { panic!("nine operands") };
    let values = [
        a + b,
        s + t,
        w + v,
        x + t,
        a - b,
        s - t,
        v - w,
        (a + b).low(5),
        (s - t).low(11),
        (w - v).low(60),
        a * b,
        s * t,
        v * b,
        x * t,
        s * t + t.extend(23),
        a & b.concat(k.constant(4, 0)),
        w | v.extend(90),
        v ^ w.low(70),
        !a,
        !w,
        b.low(2).equals(n.low(2)),
        w.equals(w.slice(1, 89).concat(c)),
        a.less(b),
        s.less(t),
        w.less(v),
        x.less(t),
        c.mux(s, t),
        c.mux(w, v),
        n.case(&[(3, a), (5, b), (6, k.constant(7, 77))], k.constant(1, 0)),
        s.slice(5, 7),
        w.slice(55, 20),
        x.slice(9, 80),
        (a + b).slice(3, 6),
        concat(&[c, b, s]),
        concat(&[a, w, c]),
        s.extend(40),
        t.extend(120),
        s.resize(5),
        t.resize(20),
        n.repeat(3),
        n.table(9, &(0..16).map(|index| index * index + 3).collect::<Vec<_>>()),
        n.all(),
        n.any(),
        s.parity(),
        w.parity(),
        w.slice(80, 10).any(),
        (c.mux(!w, w) | w).all(),
        s.shift_left(5),
        s.shift_right(5),
        s.round_shift(4),
        a.round_shift(4),
        x.round_shift(30),
        a.shift_left_by(n),
        a.shift_right_by(n),
        s.shift_right_by(n),
        s.shift_right_by(n) + t,
        w.shift_left_by(n),
        x.shift_right_by(n),
    ];
    assert_eq!(values.len(), CASES.len());
    for (case, value) in CASES.iter().zip(values) {
        k.wire(case.name, value);
    }
    let outputs: Vec<(&str, usize)> = CASES.iter().map(|case| (case.name, case.bits)).collect();
    bound(k.finish(), &outputs)
}

/// The operators in integers of 128 bits.
struct Integers;

impl Reference for Integers {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let number = |(word, &(_, bits, signed)): (&Word, &(&str, usize, bool))| {
            let value = i128::from(word.limbs()[1]) << 64 | i128::from(word.limbs()[0]);
            if signed {
                value << (128 - bits) >> (128 - bits)
            } else {
                value
            }
        };
        let numbers: Vec<i128> = inputs.iter().zip(&OPERANDS).map(number).collect();
        let word = |case: &Case| {
            let value = (case.integer)(&numbers);
            let mut word = Word::default();
            word.set(0, case.bits.min(64), value as u64);
            if case.bits > 64 {
                word.set(64, case.bits - 64, (value >> 64) as u64);
            }
            Some(word)
        };
        CASES.iter().map(word).collect()
    }

    fn clock(&mut self, _: &[Word]) {}
}

#[test]
fn operators_are_those_of_integers() {
    let widths = OPERANDS.map(|(_, bits, _)| bits);
    check(&operators(), &random_words(2000, &widths), &mut Integers);
}

/// Registers with enable, reset, priority; a memory with an output register, one with contents.
fn state() -> Kernel {
    let k = Builder::new("state");
    let (rst, up, down, data, address) =
        (k.input("rst", 1), k.input("up", 1), k.input("down", 1), k.input("data", 70), k.input("address", 3));
    let count = k.state("count", Type::unsigned(4), rst, 9);
    k.when(up, || count.set((count.get() + k.constant(1, 1)).low(4)));
    k.when(down, || count.set((count.get() - k.constant(1, 1)).low(4)));
    let held = k.register("held", Type::unsigned(70)).keep();
    k.when(up, || k.when(down, || held.set(data)));
    let swapped = [k.register("one", Type::unsigned(70)), k.register("two", Type::unsigned(70))];
    swapped[0].set(up.mux(data, swapped[1].get()));
    swapped[1].set(swapped[0].get());
    let ram = k.memory("ram", 8, 70, Contents::Undefined).style("distributed");
    ram.write(up, address, data);
    let read = k.register("read", Type::unsigned(70));
    k.when(down, || read.set(ram.read(address)));
    let parts = k.memory("parts", 8, 70, Contents::Undefined);
    parts.write_part(up, address, 0, data.low(33));
    parts.write_part(down, address, 33, data.slice(33, 37));
    k.register("joined", Type::unsigned(70)).set(parts.read(address));
    let words = (0..8).map(|word| vec![word * 0x1111_2222_3333, word]).collect();
    let rom = k.memory("rom", 8, 70, Contents::File { name: "rom.hex".into(), words });
    k.wire("direct", rom.read(address));
    let names = ["count", "held", "one", "two", "read", "joined", "direct"];
    let outputs: Vec<(&str, usize)> = names.iter().map(|name| (*name, if *name == "count" { 4 } else { 70 })).collect();
    bound(k.finish(), &outputs)
}

#[derive(Default)]
struct State {
    count: Option<u64>,
    held: Option<Word>,
    swapped: [Option<Word>; 2],
    ram: [Option<Word>; 8],
    read: Option<Word>,
    /// Lower 33 and upper 37 bits.
    parts: [[Option<u64>; 2]; 8],
    joined: [Option<u64>; 2],
}

impl Reference for State {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let address = inputs[4].number();
        let mut direct = Word::default();
        direct.set_limbs(&[address * 0x1111_2222_3333, address]);
        let joined = self.joined[0].zip(self.joined[1]).map(|(low, high)| {
            let mut joined = Word::default();
            joined.set_limbs(&[low | high << 33, high >> 31]);
            joined
        });
        vec![self.count.map(Word::from), self.held, self.swapped[0], self.swapped[1], self.read, joined, Some(direct)]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, up, down] = [0, 1, 2].map(|k| inputs[k].number() == 1);
        let (data, address) = (inputs[3], inputs[4].number() as usize);
        self.count = match (rst, up, down) {
            (true, ..) => Some(9),
            (_, _, true) => self.count.map(|count| count.wrapping_sub(1) & 15),
            (_, true, _) => self.count.map(|count| (count + 1) & 15),
            _ => self.count,
        };
        if up && down {
            self.held = Some(data);
        }
        self.swapped = [if up { Some(data) } else { self.swapped[1] }, self.swapped[0]];
        if down {
            self.read = self.ram[address];
        }
        self.joined = self.parts[address];
        if up {
            self.parts[address][0] = Some(data.field(0, 33));
        }
        if down {
            self.parts[address][1] = Some(data.field(33, 37));
        }
        if up {
            self.ram[address] = Some(data);
        }
    }
}

#[test]
fn registers_and_memories_are_those_of_the_reference() {
    check(&state(), &random_words(3000, &[1, 1, 1, 70, 3]), &mut State::default());
}

/// Registers at both edges of a second clock, with a reset that acts at once; a memory with words in the text.
fn clocks() -> Kernel {
    let k = Builder::new("clocks");
    let (other, clear, data) = (k.input("other", 1), k.input("clear", 1), k.input("data", 4));
    let ty = Type::unsigned(4);
    let down = k.falling(other, || k.state("down", ty, clear, 9));
    let up = k.rising(other, || k.register("up", ty));
    down.set((*down + data).low(4));
    up.set(*down);
    k.register("here", ty).set(*up);
    let rom = k.memory("rom", 16, 4, Contents::Words((0..16).map(|word| (word, word as u64 * 7 % 16)).collect()));
    k.register("word", ty).set(rom.read(data));
    bound(k.finish(), &[("down", 4), ("up", 4), ("here", 4), ("word", 4)])
}

#[derive(Default)]
struct Clocks {
    level: bool,
    down: Option<u64>,
    up: Option<u64>,
    here: Option<u64>,
    word: Option<u64>,
}

impl Reference for Clocks {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let [other, clear, data] = [0, 1, 2].map(|k| inputs[k].number());
        match (self.level, other == 1) {
            (false, true) => self.up = self.down,
            (true, false) => self.down = self.down.map(|down| (down + data) % 16),
            _ => {}
        }
        self.level = other == 1;
        if clear == 1 {
            self.down = Some(9);
        }
        [self.down, self.up, self.here, self.word].map(|value| value.map(Word::from)).to_vec()
    }

    fn clock(&mut self, inputs: &[Word]) {
        self.here = self.up;
        self.word = Some(inputs[2].number() * 7 % 16);
    }
}

#[test]
fn registers_of_other_clocks_follow_their_edges_and_resets() {
    let mut all = random_words(3000, &[1, 1, 4]);
    // Verilator sees the edges after the first cycle.
    all[0] = vec![Word::default(); 3];
    check(&clocks(), &all, &mut Clocks::default());
}

#[test]
fn verilog_keeps_names_comments_and_constants() {
    let k = Builder::new("small");
    let (rst, a) = (k.input("rst", 1), k.input("a", 4));
    k.comment("Twice the input.");
    let twice = k.wire("twice", a + a);
    let sum = k.state("sum", Type::unsigned(8), rst, 3).comment("Sum of all inputs.");
    k.when(a.any(), || sum.set((sum.get() + twice).low(8)));
    k.scope("lane_2", || k.register("copy", Type::unsigned(1)).keep().set(a.at(3)));
    let kernel = bound(k.finish(), &[("twice", 5)]);
    assert_eq!(
        kernel.verilog(),
        "\
// Sum of all inputs.
reg [7:0] sum;
reg lane_2__copy;
// Twice the input.
assign twice = {1'b0, a} + {1'b0, a};
(* keep *) always @(posedge clk) begin
  lane_2__copy <= a[3];
end
always @(posedge clk) begin
  if (rst) begin
    sum <= 8'd3;
  end else begin
    if (|a) sum <= sum + {3'd0, twice};
  end
end
wire unused_signals = &{1'b0, lane_2__copy};"
    );
    let logic = kernel.logic(&Default::default());
    // 5 and 8 for the sums, 4 for the ends of each carry chain, 1 for |a; an enable of 8 flip-flops becomes 6/7 LUT each.
    assert_eq!((logic.flip_flops, logic.luts), (9, FLATTENED * (5.0 + 8.0 + 2.0 * 4.0 + 1.0 + 8.0 * 6.0 / 7.0)));
}

/// An expression more changes the names of what its own signal takes, no others.
#[test]
fn a_net_is_named_after_what_takes_it() {
    let verilog = |more: bool| {
        let k = Builder::new("named");
        let [a, b] = ["a", "b"].map(|name| k.input(name, 8));
        if more {
            let shared = a.minus(1);
            k.wire("more", (shared & b) | !shared);
        }
        for (name, by) in [("first", 1), ("second", 2)] {
            let shared = a.plus(by);
            k.wire(name, (shared & b) | !shared);
        }
        k.finish().verilog()
    };
    let (few, many) = (verilog(false), verilog(true));
    assert!(few.contains("wire [7:0] second_part_1 = a + 8'd2;"), "{few}");
    let kept = few.lines().filter(|line| line.starts_with("wire [7:0]")).all(|line| many.contains(line));
    assert!(many.contains("more_part_1") && kept, "{few}\n{many}");
}

#[test]
fn verilog_holds_constants_and_separates_operators() {
    let k = Builder::combinational("small");
    let a = k.input("a", 4);
    let three = k.wire("three", k.constant(2, 3));
    k.wire("four", three.plus(1));
    k.wire("none", !a.any());
    let kernel = bound(k.finish(), &[("three", 2), ("four", 2), ("none", 1)]);
    assert_eq!(kernel.verilog(), "assign three = 2'd3;\nassign four = three + 2'd1;\nassign none = !(|a);");
}

#[test]
fn a_changed_kernel_differs_under_verilator() {
    let adder = |number: u64| {
        let k = Builder::new("adder");
        let x = k.input("x", 8);
        let sum = k.register("sum", Type::unsigned(8)).initially(0);
        sum.set(x.plus(number).low(8));
        bound(k.finish(), &[("sum", 8)])
    };
    let stimulus = random_words(50, &[8]);
    let expected = Subject::from(&adder(3)).simulated(&stimulus);
    assert_eq!(verilated(&Subject::from(&adder(3)), &stimulus), expected);
    assert_ne!(verilated(&Subject::from(&adder(2)), &stimulus), expected);
}

crate::block! {
    /// A bit one cycle later, 0 after a reset.
    struct Later {}
    ports LaterPorts {
        clock;
        reset;
        /// The bit.
        in d;
        /// The bit of the cycle before.
        out q;
    }
}

impl Block for Later {
    fn build<'k>(&self, _: &'k Builder, io: LaterPorts<Inside<'k>>) {
        io.q.state(io.rst, 0).set(io.d);
    }
}

crate::block! {
    /// `d` on `q`, later where that is `wanted`; reset by `clear`.
    struct Around {
        wanted: bool,
    }
    ports AroundPorts {
        clock;
        reset;
        /// Resets what is inside.
        in clear;
        /// The bit.
        in d;
        /// The bit, or that of the cycle before.
        out q;
    }
}

impl Block for Around {
    fn build<'k>(&self, k: &'k Builder, io: AroundPorts<Inside<'k>>) {
        let later = k.instance("later", self.wanted.then_some(Later {}));
        k.reset_instances(io.clear);
        io.q.set(later.map_or(io.d, |later| {
            later.d.set(io.d);
            later.q
        }));
    }
}

#[test]
fn a_kind_of_ram_is_stated_once_or_not_at_all() {
    let kernel = state();
    let given = BTreeMap::from(["ram", "rom"].map(|name| (name.to_owned(), "block".to_owned())));
    let stated =
        |text: String| text.lines().filter(|line| line.contains("m_style")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(stated(kernel.verilog()), ["(* ram_style = \"distributed\" *)"]);
    let both = ["(* ram_style = \"block\" *)", "(* rom_style = \"block\" *)"];
    assert_eq!(stated(kernel.verilog_with(Some(&given), "")), both);
    assert_eq!(stated(kernel.verilog_with(None, "")), [""; 0]);
    assert!(kernel.verilog_with(None, "dut__").contains("$readmemh(\"dut__rom.hex\", rom);"));
}

#[test]
fn an_instance_that_is_not_wanted_is_left_out() {
    let with = kernel_of(&Around { wanted: true });
    let text = with.verilog();
    assert!(text.contains("assign later__rst = clear;") && text.contains("assign q = later__q;"), "{text}");
    assert!(with.instances.len() == 1 && !with.is_wires());
    let without = kernel_of(&Around { wanted: false });
    assert_eq!(without.verilog().lines().next_back(), Some("assign q = d;"));
    assert!(without.instances.is_empty() && without.is_wires() && without.errors().is_empty());
}
