//! The registers of the map, and what they control.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::wire::registers::{self, Access, Register, REGISTERS, REGISTER_BITS, RESET_CYCLES};

use super::bundles::Accesses;
use super::tables_in::OCTET_BITS;
use crate::block;
use crate::language::{concat, Block, Builder, Expr, Inside, Type};
use crate::primitives::{Arrays, QUEUE_PLACES};

block! {
    /// Answers one access in the cycle after `select`. Counters wrap. Of a write the bytes count that `strobe` names.
    pub struct Registers {
        /// Content of the constant registers, by name.
        constants: Vec<(&'static str, u32)>,
        /// The tables of the engine are writable.
        writable: bool,
        arrays: Arrays,
    }
    ports RegistersPorts {
        clock;
        reset;
        /// Accesses of a bus.
        sink<Accesses> access: Accesses {};
        /// The last taxel of a frame is received in this cycle.
        in complete;
        /// The last beat of a whole frame is sent in this cycle.
        in sent;
        /// A code is clipped in this cycle.
        in clipped;
        /// An incomplete beat is received in this cycle.
        in partial;
        /// A wrong `tlast` or `tid` is received in this cycle.
        in misframed;
        /// A frame is whole on its way out in this cycle: a reset of engine and streams does not lose it.
        in whole;
        /// Engine and streams are reset in this cycle; not with `complete` or `whole`.
        in restarting;
        /// The byte offered is accepted in this cycle.
        in octet_taken;
        /// A byte of an image of tables, above it whether it is the last, and above that the array; valid with `octet_valid`.
        out octet: OCTET_BITS + arrays.bits;
        /// A byte is offered; it is held until `octet_taken`.
        out octet_valid;
        /// Engine and streams are to be reset.
        out restart;
    }
}

impl Registers {
    /// With the content of the constant registers, by name, for an engine whose tables, of each of the `arrays`, are
    /// `writable` or not.
    pub fn new(constants: &[(&'static str, u32)], writable: bool, arrays: Arrays) -> Self {
        Registers { constants: constants.to_vec(), writable, arrays }
    }
}

impl Block for Registers {
    fn build<'k>(&self, k: &'k Builder, io: RegistersPorts<Inside<'k>>) {
        let content = io.access.content.register();
        let refused = io.access.refused.register();

        let is = |register: &Register| io.access.address.is(register.address as u64);
        let any = |which: &dyn Fn(&Register) -> bool| {
            REGISTERS.iter().filter(|register| which(register)).map(is).reduce(|a, b| a | b).unwrap_or(k.constant(1, 0))
        };
        let known = k.wire("known", any(&|_| true));
        let waiting = match self.writable {
            true => Some(io.octet_valid.state(io.rst, 0)),
            false => {
                io.octet_valid.set(k.constant(1, 0));
                None
            }
        };
        let writable = any(&|register| register.access.is_written() && register.access != Access::Push);
        let room =
            waiting.map_or(k.constant(1, 0), |waiting| any(&|register| register.access == Access::Push) & !*waiting);
        let writable = k.wire("writable", writable | room);
        let wrong = k.wire("wrong", io.access.select & !io.access.write.mux(writable, known));
        // What a write does is in the low byte, but for an image's end and its array.
        let written = k.wire("written", io.access.select & io.access.write & io.access.strobe.at(0));
        let bits = |name: &str| {
            let register = REGISTERS.iter().find(|register| register.name == name);
            let reaches = register.map_or(k.constant(1, 0), |register| written & is(register));
            move |field: registers::Field| reaches & io.access.data.at(field.low)
        };
        let control = bits("control");
        let clear = k.wire("clear", control(registers::CLEAR));
        let left_bits = count_bits(RESET_CYCLES as usize + 1);
        let left = k.state("left", Type::unsigned(left_bits), io.rst, 0).comment("Cycles of reset left.");
        left.set(left.any().mux(left.minus(1), *left));
        k.when(control(registers::RESET), || left.set(k.constant(left_bits, RESET_CYCLES)));
        io.restart.set(left.any());

        match waiting {
            None => {
                io.octet.set(k.constant(io.octet.bits(), 0));
            }
            Some(waiting) => {
                let octet = io.octet.register();
                // The byte, and what stands above it.
                let rest = io.octet.bits() - registers::OCTET.bits;
                let rest = io.access.strobe.at(registers::LAST.low / 8).repeat(rest)
                    & io.access.data.slice(registers::LAST.low, rest);
                let pushed = k.wire("pushed", written & room);
                k.when(io.octet_taken, || waiting.set(k.constant(1, 0)));
                k.when(pushed, || {
                    waiting.set(k.constant(1, 1));
                    octet.set(rest.concat(io.access.data.low(registers::OCTET.bits)));
                });
            }
        }

        let cleared = bits("errors");
        let events = [
            (registers::CLIPPED, io.clipped),
            (registers::PARTIAL, io.partial),
            (registers::FRAMING, io.misframed),
            (registers::ACCESS, wrong),
        ];
        let errors: Vec<Expr> = events
            .iter()
            .rev()
            .map(|&(field, event)| {
                let error = k.state(&format!("error_{}", field.name), Type::unsigned(1), io.rst, 0);
                error.set(event | (*error & !cleared(field)));
                *error
            })
            .collect();
        // As many as there are labels in the queue.
        let frames = Type::unsigned(count_bits(QUEUE_PLACES + 1));
        let under_way = k.state("under_way", frames, io.rst, 0).comment("Frames that a reset would lose.");
        let none = k.constant(frames.bits, 0);
        under_way.set(io.restarting.mux(none, (*under_way + io.complete - io.whole).low(frames.bits)));
        let lost = k.wire("lost", io.restarting.mux(*under_way, none));
        let counters = counters(k, &io, [wrong, lost], clear);
        let value = |register: &Register| match register.access {
            Access::Constant => {
                let constant = self.constants.iter().find(|(name, _)| *name == register.name);
                constant.map(|(_, content)| k.constant(REGISTER_BITS, u64::from(*content)))
            }
            Access::ReadOnly => counters.iter().find(|(name, _)| *name == register.name).map(|(_, counter)| *counter),
            Access::ClearedByOne => Some(concat(&errors).extend(REGISTER_BITS)),
            Access::Push => waiting.map(|waiting| {
                let below = k.constant(registers::WAITING.low, 0);
                k.constant(1, 1).concat(*waiting).concat(below).extend(REGISTER_BITS)
            }),
            Access::Pulse => None,
        };
        let arms: Vec<(u64, Expr)> =
            REGISTERS.iter().filter_map(|register| Some((register.address as u64, value(register)?))).collect();
        k.when(io.access.select, || {
            content.set(io.access.address.case(&arms, k.constant(REGISTER_BITS, 0)));
            refused.set(wrong);
        });
    }
}

/// Counters of events by the names of their registers, `wrong` that of refused accesses, `lost` the frames lost in this cycle; `clear`
/// sets them to 0.
fn counters<'k>(
    k: &'k Builder,
    io: &RegistersPorts<Inside<'k>>,
    [wrong, lost]: [Expr<'k>; 2],
    clear: Expr<'k>,
) -> [(&'static str, Expr<'k>); 8] {
    let events = [
        ("frames_in", io.complete),
        ("frames_out", io.sent),
        ("codes_clipped", io.clipped),
        ("beats_partial", io.partial),
        ("frames_misframed", io.misframed),
        ("accesses_refused", wrong),
        ("cycles", k.constant(1, 1)),
        ("frames_lost", lost),
    ];
    events.map(|(name, event)| {
        let own = k.state(name, Type::unsigned(REGISTER_BITS), io.rst, 0);
        own.set(clear.mux(k.constant(REGISTER_BITS, 0), (*own + event).low(REGISTER_BITS)));
        (name, *own)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
        counters: [u32; 8],
        under_way: u32,
        left: u64,
        answer: Option<(u32, bool)>,
        reset: bool,
        /// The engine has writable tables, of arrays whose numbers have so many bits.
        writable: bool,
        array_bits: usize,
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
            let events: Vec<bool> = (6..13).map(|k| inputs[k].number() == 1).collect();
            let index = address as usize / 4;
            let known = address % 4 == 0 && index < 18;
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
                    17 => self.counters[7],
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
            if inputs[13].number() == 1 {
                self.waiting = None;
            }
            if written && index == 16 && room {
                let above = if strobe >> 1 & 1 == 1 { (1 << (9 + self.array_bits)) - 256 } else { 0 };
                self.octet = Some(data & (255 | above));
                self.waiting = self.octet;
            }
            let [complete, sent, clipped, partial, misframed, whole, restarting] =
                [0, 1, 2, 3, 4, 5, 6].map(|k| events[k]);
            let now = [clipped, partial, misframed, refused];
            let set: u32 = now.iter().enumerate().map(|(bit, event)| u32::from(*event) << bit).sum();
            self.errors = self.errors & !cleared | set;
            let counted = [complete, sent, clipped, partial, misframed, refused, true].map(u32::from);
            let lost = if restarting { self.under_way } else { 0 };
            for (counter, count) in self.counters.iter_mut().zip(counted.into_iter().chain([lost])) {
                *counter = if commands & 2 == 2 { 0 } else { counter.wrapping_add(count) };
            }
            let under_way = self.under_way.wrapping_add(u32::from(complete)).wrapping_sub(u32::from(whole));
            self.under_way = if restarting { 0 } else { under_way & 31 };
            self.left = if commands & 1 == 1 { RESET_CYCLES } else { self.left.saturating_sub(1) };
            if rst == 1 {
                let Map { answer, writable, array_bits, octet, .. } = *self;
                *self = Map { reset: true, answer, writable, array_bits, octet, ..Map::default() };
            }
        }
    }

    #[test]
    fn every_register_answers_as_the_map_says() {
        let mut random = fastrand::Rng::with_seed(8);
        let stimulus = (0..30_000).map(|cycle| {
            let address = if random.u8(..6) == 0 { random.u64(..256) } else { 4 * random.u64(..19) };
            let mut inputs = vec![
                Word::from(cycle < 2 || random.u16(..900) == 0),
                Word::from(random.bool()),
                Word::from(random.bool()),
                Word::from(address),
                Word::from(u64::from(random.u32(..))),
                Word::from(random.u64(..16)),
            ];
            inputs.extend((0..8).map(|_| Word::from(random.u8(..4) == 0)));
            inputs
        });
        let stimulus: Vec<_> = stimulus.collect();
        for (writable, array_bits) in [(false, 0), (true, 0), (true, 4)] {
            let block = Registers::new(&CONSTANTS, writable, Arrays { bits: array_bits });
            check(&kernel_of(&block), &stimulus, &mut Map { writable, array_bits, ..Map::default() });
        }
    }
}
