//! The registers of the map, and what they control.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::wire::registers::{self, Access, Register, ADDRESS_BITS, REGISTERS, REGISTER_BITS, RESET_CYCLES};
use rust_hdl::prelude::*;

use super::tables_in::OCTET_BITS;
use crate::kernel_block;
use crate::language::{concat, Body, Builder, Expr, Kernel, Type};
use crate::wire::Wire;

/// Bytes of a register.
const BYTES: usize = REGISTER_BITS / 8;

/// Answers one access in the cycle after `select`. Counters wrap. Of a write the bytes count that `strobe` names.
#[derive(dermis_hdl_derive::Block)]
pub struct Registers {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// An access in this cycle.
    pub select: Signal<In, Bit>,
    /// The access is a write; valid with `select`.
    pub write: Signal<In, Bit>,
    /// Address in bytes; valid with `select`.
    pub address: Wire<In>,
    /// Data of a write; valid with `select` and `write`.
    pub data: Wire<In>,
    /// Bytes of a write that count; valid with `select` and `write`.
    pub strobe: Wire<In>,
    /// The last taxel of a frame is received in this cycle.
    pub complete: Signal<In, Bit>,
    /// The last beat of a frame is sent in this cycle.
    pub sent: Signal<In, Bit>,
    /// A code is clipped in this cycle.
    pub clipped: Signal<In, Bit>,
    /// An incomplete beat is received in this cycle.
    pub partial: Signal<In, Bit>,
    /// A wrong `tlast` is received in this cycle.
    pub misframed: Signal<In, Bit>,
    /// The byte offered is accepted in this cycle.
    pub octet_taken: Signal<In, Bit>,
    /// A byte of an image of tables, and above it whether it is the last; valid with `octet_valid`.
    pub octet: Wire<Out>,
    /// A byte is offered; it is held until `octet_taken`.
    pub octet_valid: Signal<Out, Bit>,
    /// Content of the register; valid in the cycle after `select`.
    pub content: Wire<Out>,
    /// The access is an error; valid in the cycle after `select`.
    pub refused: Signal<Out, Bit>,
    /// Engine and streams are to be reset.
    pub restart: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    Registers,
    clock clk,
    inputs [rst, select, write, address, data, strobe, complete, sent, clipped, partial, misframed, octet_taken],
    outputs [octet, octet_valid, content, refused, restart]
);

impl Registers {
    /// With the content of the constant registers, by name, for an engine whose tables are `writable` or not.
    pub fn new(constants: &[(&'static str, u32)], writable: bool) -> Self {
        let block = Registers {
            clk: Default::default(),
            rst: Default::default(),
            select: Default::default(),
            write: Default::default(),
            address: Wire::new(ADDRESS_BITS),
            data: Wire::new(REGISTER_BITS),
            strobe: Wire::new(BYTES),
            complete: Default::default(),
            sent: Default::default(),
            clipped: Default::default(),
            partial: Default::default(),
            misframed: Default::default(),
            octet_taken: Default::default(),
            octet: Wire::new(OCTET_BITS),
            octet_valid: Default::default(),
            content: Wire::new(REGISTER_BITS),
            refused: Default::default(),
            restart: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel(constants, writable))
    }
}

fn kernel(constants: &[(&'static str, u32)], has_tables: bool) -> Kernel {
    let k = Builder::new("registers");
    let (rst, select, write) = (k.input("rst", 1), k.input("select", 1), k.input("write", 1));
    let address = k.input("address", ADDRESS_BITS);
    let (data, strobe) = (k.input("data", REGISTER_BITS), k.input("strobe", BYTES));
    let [complete, sent, clipped, partial, misframed] =
        ["complete", "sent", "clipped", "partial", "misframed"].map(|name| k.input(name, 1));
    let octet_taken = k.input("octet_taken", 1);
    let number = Type::unsigned(REGISTER_BITS);
    let content = k.register("content", number);
    let refused = k.register("refused", Type::unsigned(1));

    let is = |register: &Register| address.is(register.address as u64);
    let any = |which: &dyn Fn(&Register) -> bool| {
        REGISTERS.iter().filter(|own| which(own)).map(is).reduce(|a, b| a | b).unwrap_or(k.constant(1, 0))
    };
    let known = k.wire("known", any(&|_| true));
    let waiting = match has_tables {
        true => Some(k.state("octet_valid", Type::unsigned(1), rst, 0)),
        false => {
            k.wire("octet_valid", k.constant(1, 0));
            None
        }
    };
    let writable = any(&|own| own.access.is_written() && own.access != Access::Push);
    let room = waiting.map_or(k.constant(1, 0), |waiting| any(&|own| own.access == Access::Push) & !*waiting);
    let writable = k.wire("writable", writable | room);
    let wrong = k.wire("wrong", select & !write.mux(writable, known));
    // What a write does is in the low byte, but for an image's end.
    let written = k.wire("written", select & write & strobe.at(0));
    let bits = |name: &str| {
        let own = REGISTERS.iter().find(|own| own.name == name);
        let reaches = own.map_or(k.constant(1, 0), |own| written & is(own));
        move |field: registers::Field| reaches & data.at(field.low)
    };
    let control = bits("control");
    let clear = k.wire("clear", control(registers::CLEAR));
    let left_bits = count_bits(RESET_CYCLES as usize + 1);
    let left = k.state("left", Type::unsigned(left_bits), rst, 0).comment("Cycles of reset left.");
    left.set(left.any().mux(left.minus(1), *left));
    k.when(control(registers::RESET), || left.set(k.constant(left_bits, RESET_CYCLES)));
    k.wire("restart", left.any());

    match waiting {
        None => {
            k.wire("octet", k.constant(OCTET_BITS, 0));
        }
        Some(waiting) => {
            let octet = k.register("octet", Type::unsigned(OCTET_BITS));
            let last = strobe.at(registers::LAST.low / 8) & data.at(registers::LAST.low);
            let pushed = k.wire("pushed", written & room);
            k.when(octet_taken, || waiting.set(k.constant(1, 0)));
            k.when(pushed, || {
                waiting.set(k.constant(1, 1));
                octet.set(last.concat(data.low(registers::OCTET.bits)));
            });
        }
    }

    let cleared = bits("errors");
    let events = [
        (registers::CLIPPED, clipped),
        (registers::PARTIAL, partial),
        (registers::FRAMING, misframed),
        (registers::ACCESS, wrong),
    ];
    let errors: Vec<Expr> = events
        .iter()
        .rev()
        .map(|&(field, event)| {
            let own = k.state(&format!("error_{}", field.name), Type::unsigned(1), rst, 0);
            own.set(event | (*own & !cleared(field)));
            *own
        })
        .collect();
    let counts = [
        ("frames_in", complete),
        ("frames_out", sent),
        ("codes_clipped", clipped),
        ("beats_partial", partial),
        ("frames_misframed", misframed),
        ("accesses_refused", wrong),
        ("cycles", k.constant(1, 1)),
    ];
    let counters: Vec<(&str, Expr)> = counts
        .iter()
        .map(|&(name, event)| {
            let own = k.state(name, number, rst, 0);
            own.set(clear.mux(k.constant(REGISTER_BITS, 0), (*own + event).low(REGISTER_BITS)));
            (name, *own)
        })
        .collect();

    let value = |register: &Register| match register.access {
        Access::Constant => {
            let own = constants.iter().find(|(name, _)| *name == register.name);
            own.map(|(_, content)| k.constant(REGISTER_BITS, u64::from(*content)))
        }
        Access::ReadOnly => counters.iter().find(|(name, _)| *name == register.name).map(|(_, own)| *own),
        Access::ClearedByOne => Some(concat(&errors).extend(REGISTER_BITS)),
        Access::Push => waiting.map(|waiting| {
            let below = k.constant(registers::WAITING.low, 0);
            k.constant(1, 1).concat(*waiting).concat(below).extend(REGISTER_BITS)
        }),
        Access::Pulse => None,
    };
    let arms: Vec<(u64, Expr)> = REGISTERS.iter().filter_map(|own| Some((own.address as u64, value(own)?))).collect();
    k.when(select, || {
        content.set(address.case(&arms, k.constant(REGISTER_BITS, 0)));
        refused.set(wrong);
    });
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, Reference};
    use crate::wire::Word;

    const CONSTANTS: [(&str, u32); 7] = [
        ("id", 1),
        ("map_version", 0xffff_ffff),
        ("scene", 0x1234_5678),
        ("array", 4),
        ("clock_Hz", 5),
        ("force_triples", 6),
        ("status_triples", 7),
    ];

    /// The map as a driver sees it.
    #[derive(Default)]
    struct Map {
        errors: u32,
        counters: [u32; 7],
        left: u64,
        answer: Option<(u32, bool)>,
        reset: bool,
        /// The engine has writable tables.
        writable: bool,
        /// The byte that waits, and the one before.
        waiting: Option<u64>,
        octet: Option<u64>,
    }

    impl Reference for Map {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let octet = if self.writable { self.octet } else { Some(0) };
            vec![
                self.answer.map(|(content, _)| Word::from(u64::from(content))),
                self.answer.map(|(_, refused)| Word::from(refused)),
                self.reset.then(|| Word::from(self.waiting.is_some())),
                self.reset.then(|| Word::from(self.left > 0)),
                octet.map(Word::from),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, select, write, address, data, strobe] = [0, 1, 2, 3, 4, 5].map(|k| inputs[k].number());
            let events: Vec<bool> = (6..11).map(|k| inputs[k].number() == 1).collect();
            let index = address as usize / 4;
            let known = address % 4 == 0 && index < 17;
            let room = self.writable && self.waiting.is_none() && self.reset;
            let takes = known && ([7, 8].contains(&index) || (index == 16 && room));
            let refused = select == 1 && if write == 1 { !takes } else { !known };
            if select == 1 {
                let content = match index {
                    _ if !known => 0,
                    0..=6 => CONSTANTS[index].1,
                    7 => 0,
                    8 => self.errors,
                    16 if self.writable => 1 << 17 | u32::from(self.waiting.is_some()) << 16,
                    16 => 0,
                    _ => self.counters[index - 9],
                };
                self.answer = self.reset.then_some((content, refused));
            }
            let written = select == 1 && write == 1 && strobe & 1 == 1 && known;
            let (commands, cleared) = match index {
                7 if written => (data & 3, 0),
                8 if written => (0, data as u32 & 15),
                _ => (0, 0),
            };
            if inputs[11].number() == 1 {
                self.waiting = None;
            }
            if written && index == 16 && room {
                self.octet = Some(data & 255 | (data & 256 & (strobe >> 1 << 8)));
                self.waiting = self.octet;
            }
            let [complete, sent, clipped, partial, misframed] = [0, 1, 2, 3, 4].map(|k| events[k]);
            let now = [clipped, partial, misframed, refused];
            let set: u32 = now.iter().enumerate().map(|(bit, event)| u32::from(*event) << bit).sum();
            self.errors = self.errors & !cleared | set;
            let counted = [complete, sent, clipped, partial, misframed, refused, true];
            for (counter, event) in self.counters.iter_mut().zip(counted) {
                *counter = if commands & 2 == 2 { 0 } else { counter.wrapping_add(u32::from(event)) };
            }
            self.left = if commands & 1 == 1 { RESET_CYCLES } else { self.left.saturating_sub(1) };
            if rst == 1 {
                let Map { answer, writable, octet, .. } = *self;
                *self = Map { reset: true, answer, writable, octet, ..Map::default() };
            }
        }
    }

    #[test]
    fn every_register_answers_as_the_map_says() {
        let mut random = fastrand::Rng::with_seed(8);
        let stimulus = (0..30_000).map(|cycle| {
            let address = if random.u8(..6) == 0 { random.u64(..256) } else { 4 * random.u64(..18) };
            let mut inputs = vec![
                Word::from(cycle < 2 || random.u16(..900) == 0),
                Word::from(random.bool()),
                Word::from(random.bool()),
                Word::from(address),
                Word::from(u64::from(random.u32(..))),
                Word::from(random.u64(..16)),
            ];
            inputs.extend((0..6).map(|_| Word::from(random.u8(..4) == 0)));
            inputs
        });
        let stimulus: Vec<_> = stimulus.collect();
        for writable in [false, true] {
            let block = Registers::new(&CONSTANTS, writable);
            check(block.kernel.kernel(), &stimulus, &mut Map { writable, ..Map::default() });
        }
    }
}
