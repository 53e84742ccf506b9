//! Execution of a compiled kernel.
//!
//! At a clock edge the next values are computed from the state and the inputs, then taken all at once. Combinational
//! outputs are computed after an edge and when an input changed. Where neither an input nor a register changed since
//! the last edge, nothing is computed. The clocks of other domains are inputs; their edges and resets act before the
//! outputs are computed. A register that takes a word of an unchecked memory in the cycle that writes the word gets its
//! complement, so that using it shows as an error.

use super::compile::{limbs, mask, Op, Operand, Program, Wide};
use super::kernel::{Binary, Contents, Domain, Kernel, Node, Role, Type, Unary};

/// A register's transition: its slot, the next value, the reset.
#[derive(Clone, Debug)]
struct Transition {
    to: usize,
    next: usize,
    limbs: usize,
    reset: Option<(usize, u64)>,
    domain: Option<usize>,
    collides: Option<Collision>,
}

/// Where a register takes a word of a memory whose reads in the cycle of a write are not used.
#[derive(Clone, Debug)]
struct Collision {
    memory: usize,
    address: usize,
    bits: usize,
    /// Condition under which the register takes the word; always without one.
    enable: Option<usize>,
}

/// A write port in slots.
#[derive(Clone, Debug)]
struct WritePort {
    memory: usize,
    enable: usize,
    address: usize,
    data: usize,
    /// First bit of the word that is written, and number of bits.
    low: usize,
    bits: usize,
}

/// A memory's words, one after the other.
#[derive(Clone, Debug)]
struct Words {
    words: usize,
    limbs: usize,
    content: Vec<u64>,
}

/// Replaces up to 64 bits of a word from bit `low` on; says whether any changed.
fn replace(word: &mut [u64], low: usize, bits: usize, value: u64) -> bool {
    let (limb, shift) = (low / 64, low % 64);
    let [wide, new] = [mask(bits), value & mask(bits)].map(|value| u128::from(value) << shift);
    let mut changed = false;
    for (own, half) in word[limb..].iter_mut().zip([0, 64]) {
        let next = *own & !((wide >> half) as u64) | (new >> half) as u64;
        changed |= *own != next;
        *own = next;
    }
    changed
}

/// The state of a kernel.
#[derive(Clone, Debug)]
pub struct Simulation {
    program: Program,
    slots: Vec<u64>,
    memories: Vec<Words>,
    transitions: Vec<Transition>,
    /// Next values of the registers, before they are taken.
    staged: Vec<u64>,
    writes: Vec<WritePort>,
    /// Clock of each other domain: slot, whether its falling edge counts, its last level.
    clocks: Vec<(usize, bool, bool)>,
    /// An input or a register changed since the next values were computed.
    changed: bool,
}

impl Simulation {
    /// The initial state of a kernel without errors.
    pub fn new(kernel: &Kernel) -> Self {
        let program = Program::new(kernel);
        let mut slots = vec![0; program.limbs];
        for (slot, value) in &program.constants {
            slots[*slot as usize..][..value.len()].copy_from_slice(value);
        }
        let node = |id| program.operand(kernel, id).slot as usize;
        let mut transitions = Vec::new();
        for (signal, definition, register) in kernel.registers() {
            let held = kernel.interned[&(Node::Signal(signal), definition.ty)];
            let sign = |value: u64| match definition.ty.signed
                && definition.ty.bits < 64
                && value >> (definition.ty.bits - 1) & 1 == 1
            {
                true => value | !mask(definition.ty.bits),
                false => value,
            };
            let Some(next) = definition.value else { continue };
            slots[node(held)] = sign(register.initial.unwrap_or(0));
            let reset = register.reset.map(|(condition, value)| (node(condition), sign(value)));
            let limbs = limbs(definition.ty.bits) as usize;
            // A register with an enable takes the word or keeps its own.
            let (enable, taken) = match kernel.nodes[next].0 {
                Node::Mux(enable, taken, kept) if kept == held => (Some(node(enable)), taken),
                _ => (None, next),
            };
            let collides = match kernel.nodes[taken].0 {
                Node::Read { memory, address } if kernel.memories[memory].unchecked => {
                    Some(Collision { memory, address: node(address), bits: definition.ty.bits, enable })
                }
                _ => None,
            };
            let (to, next, domain) = (node(held), node(next), register.domain);
            transitions.push(Transition { to, next, limbs, reset, domain, collides });
        }
        let mut writes = Vec::new();
        for (memory, definition) in kernel.memories.iter().enumerate() {
            writes.extend(definition.writes.iter().map(|write| WritePort {
                memory,
                enable: node(write.enable),
                address: node(write.address),
                data: node(write.data),
                low: write.low,
                bits: kernel.ty(write.data).bits,
            }));
        }
        let memories = kernel.memories.iter().map(|memory| {
            let limbs = limbs(memory.bits) as usize;
            let mut content = vec![0; memory.words * limbs];
            match &memory.contents {
                Contents::File { words, .. } => {
                    let each = content.chunks_mut(limbs).zip(words);
                    each.for_each(|(to, word)| to[..word.len()].copy_from_slice(word));
                }
                Contents::Words(words) => {
                    words.iter().for_each(|&(address, word)| content[address * limbs] = word);
                }
                Contents::Undefined => {}
            }
            Words { words: memory.words, limbs, content }
        });
        let staged = vec![0; transitions.iter().map(|transition| transition.limbs).sum()];
        let memories = memories.collect();
        let clock = |&Domain { clock, falling }: &Domain| {
            let own = kernel.interned[&(Node::Signal(clock), kernel.signals[clock].ty)];
            (node(own), falling, false)
        };
        let clocks = kernel.domains.iter().map(clock).collect();
        Simulation { clocks, slots, memories, transitions, staged, writes, changed: true, program }
    }

    /// Sets an input of `limbs` limbs; `slot` as from [`Simulation::slot_of`]. Limbs that `value` lacks are zeros.
    pub fn set(&mut self, slot: usize, limbs: usize, value: &[u64]) {
        for (index, own) in self.slots[slot..][..limbs].iter_mut().enumerate() {
            let limb = value.get(index).copied().unwrap_or(0);
            self.changed |= *own != limb;
            *own = limb;
        }
    }

    /// The limbs of a signal.
    pub fn get(&self, slot: usize, limbs: usize) -> &[u64] {
        &self.slots[slot..][..limbs]
    }

    /// First limb of the signal of this name; inputs, registers and outputs have one.
    pub fn slot_of(&self, kernel: &Kernel, name: &str) -> Option<usize> {
        let signal = kernel.signal_of(name)?;
        let of = &kernel.signals[signal];
        let node = match of.role {
            Role::Wire { .. } => of.value?,
            _ => *kernel.interned.get(&(Node::Signal(signal), of.ty))?,
        };
        Some(self.program.operand(kernel, node).slot as usize)
    }

    /// A rising edge of the clock.
    pub fn clock(&mut self) {
        if self.changed {
            self.changed = self.edge(None);
        }
    }

    /// An edge of one domain; says whether anything changed.
    fn edge(&mut self, domain: Option<usize>) -> bool {
        let Simulation { program, slots, memories, transitions, staged, writes, .. } = self;
        let in_domain = |transition: &&Transition| transition.domain == domain;
        run(&program.edge, &program.wide, slots, memories);
        let mut at = 0;
        for transition in transitions.iter().filter(in_domain) {
            let target = &mut staged[at..][..transition.limbs];
            match transition.reset {
                Some((condition, value)) if slots[condition] != 0 => {
                    target.fill(0);
                    target[0] = value;
                }
                _ => target.copy_from_slice(&slots[transition.next..][..transition.limbs]),
            }
            let taken = |collision: &&Collision| collision.enable.is_none_or(|enable| slots[enable] != 0);
            if let Some(&Collision { memory, address, bits, .. }) = transition.collides.as_ref().filter(taken) {
                let written = |write: &WritePort| {
                    write.memory == memory && slots[write.enable] != 0 && slots[write.address] == slots[address]
                };
                if writes.iter().any(written) {
                    target.iter_mut().enumerate().for_each(|(limb, value)| *value ^= mask((bits - 64 * limb).min(64)));
                }
            }
            at += transition.limbs;
        }
        let mut changed = false;
        for write in writes.iter().filter(|write| domain.is_none() && slots[write.enable] != 0) {
            let memory = &mut memories[write.memory];
            let address = slots[write.address] as usize;
            if address < memory.words {
                let word = &mut memory.content[address * memory.limbs..][..memory.limbs];
                for (limb, &data) in slots[write.data..][..limbs(write.bits) as usize].iter().enumerate() {
                    let bits = (write.bits - 64 * limb).min(64);
                    changed |= replace(word, write.low + 64 * limb, bits, data);
                }
            }
        }
        let mut at = 0;
        for transition in transitions.iter().filter(in_domain) {
            let target = &mut slots[transition.to..][..transition.limbs];
            let next = &staged[at..][..transition.limbs];
            if target != next {
                target.copy_from_slice(next);
                changed = true;
            }
            at += transition.limbs;
        }
        changed
    }

    /// Edges and resets of the other domains since the last call.
    fn follow(&mut self) {
        for domain in 0..self.clocks.len() {
            let (slot, falling, before) = self.clocks[domain];
            let level = self.slots[slot] != 0;
            self.clocks[domain].2 = level;
            if level != before && before == falling {
                self.changed |= self.edge(Some(domain));
            }
        }
        for transition in self.transitions.iter().filter(|transition| transition.domain.is_some()) {
            if let Some((_, value)) = transition.reset.filter(|(condition, _)| self.slots[*condition] != 0) {
                let own = &mut self.slots[transition.to..][..transition.limbs];
                self.changed |= own[0] != value || own[1..].iter().any(|&limb| limb != 0);
                own.fill(0);
                own[0] = value;
            }
        }
    }

    /// Computes the combinational outputs.
    pub fn show(&mut self) {
        self.follow();
        run(&self.program.show, &self.program.wide, &mut self.slots, &self.memories);
    }
}

fn run(ops: &[Op], wide: &[Wide], slots: &mut [u64], memories: &[Words]) {
    for op in ops {
        match *op {
            Op::Add { to, a, b } => slots[to as usize] = slots[a as usize].wrapping_add(slots[b as usize]),
            Op::Sub { to, a, b } => slots[to as usize] = slots[a as usize].wrapping_sub(slots[b as usize]),
            Op::Mul { to, a, b } => slots[to as usize] = slots[a as usize].wrapping_mul(slots[b as usize]),
            Op::And { to, a, b } => slots[to as usize] = slots[a as usize] & slots[b as usize],
            Op::Or { to, a, b } => slots[to as usize] = slots[a as usize] | slots[b as usize],
            Op::Xor { to, a, b } => slots[to as usize] = slots[a as usize] ^ slots[b as usize],
            Op::Equal { to, a, b } => slots[to as usize] = u64::from(slots[a as usize] == slots[b as usize]),
            Op::LessSigned { to, a, b } => {
                slots[to as usize] = u64::from((slots[a as usize] as i64) < slots[b as usize] as i64);
            }
            Op::LessUnsigned { to, a, b } => slots[to as usize] = u64::from(slots[a as usize] < slots[b as usize]),
            Op::Not { to, a, mask } => slots[to as usize] = !slots[a as usize] & mask,
            Op::IsMask { to, a, mask } => slots[to as usize] = u64::from(slots[a as usize] & mask == mask),
            Op::IsNonZero { to, a } => slots[to as usize] = u64::from(slots[a as usize] != 0),
            Op::Parity { to, a, mask } => {
                slots[to as usize] = u64::from((slots[a as usize] & mask).count_ones() & 1);
            }
            Op::Mux { to, c, a, b } => {
                slots[to as usize] = if slots[c as usize] != 0 { slots[a as usize] } else { slots[b as usize] };
            }
            Op::Field { to, a, shift, mask } => slots[to as usize] = slots[a as usize] >> shift & mask,
            Op::Straddle { to, a, shift, mask } => {
                let [low, high] = [slots[a as usize], slots[a as usize + 1]];
                slots[to as usize] = (low >> shift | high << (64 - shift)) & mask;
            }
            Op::Sign { to, a, bits } => {
                let up = 64 - bits;
                slots[to as usize] = ((slots[a as usize] << up) as i64 >> up) as u64;
            }
            Op::Join { to, high, low, by } => slots[to as usize] = slots[high as usize] << by | slots[low as usize],
            Op::Shift { to, a, by, ty, left } => {
                let (a, by) = (slots[a as usize], slots[by as usize]);
                let signed = i128::from(a as i64);
                let value = match (left, ty.signed) {
                    (true, _) if by >= 64 => 0,
                    (true, _) => a << by,
                    (false, true) => (signed >> by.min(127)) as u64,
                    (false, false) if by >= 64 => 0,
                    (false, false) => a >> by,
                };
                let up = 64 - ty.bits;
                slots[to as usize] = match ty.signed {
                    true => ((value << up) as i64 >> up) as u64,
                    false => value << up >> up,
                };
            }
            Op::Read { to, memory, address } => {
                let memory = &memories[memory as usize];
                slots[to as usize] = memory.content.get(slots[address as usize] as usize).copied().unwrap_or(0);
            }
            Op::Wide { index } => run_wide(&wide[index as usize], slots, memories),
        }
    }
}

fn run_wide(op: &Wide, slots: &mut [u64], memories: &[Words]) {
    let at = |slot: u32| slot as usize;
    match op {
        Wide::Arithmetic { operator, to, a, b } => {
            let value = arithmetic(*operator, to.ty, number(slots, a), number(slots, b));
            slots[at(to.slot)] = value as u64;
            if to.limbs == 2 {
                slots[at(to.slot) + 1] = (value >> 64) as u64;
            }
        }
        Wide::Bitwise { operator, to, a, b } => {
            for limb in 0..at(to.limbs) {
                let (x, y) = (slots[at(*a) + limb], slots[at(*b) + limb]);
                slots[at(to.slot) + limb] = match operator {
                    Binary::And => x & y,
                    Binary::Or => x | y,
                    _ => x ^ y,
                };
            }
        }
        Wide::Equal { to, a, b, limbs } => {
            let of = |slot: &u32| &slots[at(*slot)..][..at(*limbs)];
            slots[at(*to)] = u64::from(of(a) == of(b));
        }
        Wide::Unary { operator, to, a } => unary(*operator, slots, to, a),
        Wide::Mux { to, c, a, b } => {
            let from = at(if slots[at(*c)] != 0 { *a } else { *b });
            slots.copy_within(from..from + at(to.limbs), at(to.slot));
        }
        Wide::Read { to, memory, address } => {
            let memory = &memories[at(*memory)];
            let address = slots[at(*address)] as usize;
            let own = &mut slots[at(to.slot)..][..memory.limbs];
            match address < memory.words {
                true => own.copy_from_slice(&memory.content[address * memory.limbs..][..memory.limbs]),
                false => own.fill(0),
            }
        }
        Wide::Slice { to, a, low } => {
            let (skip, shift) = (at(*low) / 64, low % 64);
            for limb in 0..at(to.limbs) {
                let from = |k: usize| if k < at(a.limbs) { slots[at(a.slot) + k] } else { 0 };
                let high = if shift == 0 { 0 } else { from(limb + skip + 1) << (64 - shift) };
                slots[at(to.slot) + limb] = from(limb + skip) >> shift | high;
            }
            trim(slots, to);
        }
        Wide::Concat { to, parts } => {
            slots[at(to.slot)..][..at(to.limbs)].fill(0);
            for (part, offset) in parts {
                let shift = offset % 64;
                for limb in 0..at(part.limbs) {
                    let value = slots[at(part.slot) + limb];
                    let into = at(*offset) / 64 + limb;
                    slots[at(to.slot) + into] |= value << shift;
                    if shift > 0 && into + 1 < at(to.limbs) {
                        slots[at(to.slot) + into + 1] |= value >> (64 - shift);
                    }
                }
            }
        }
        Wide::Resize { to, a } => {
            let sign = match a.ty.signed && (slots[at(a.slot) + at(a.limbs) - 1] as i64) < 0 {
                true => u64::MAX,
                false => 0,
            };
            for limb in 0..at(to.limbs) {
                slots[at(to.slot) + limb] = if limb < at(a.limbs) { slots[at(a.slot) + limb] } else { sign };
            }
            trim(slots, to);
        }
    }
}

/// The result of an operator on numbers, in the width of `ty`.
fn arithmetic(operator: Binary, ty: Type, x: i128, y: i128) -> i128 {
    let value = match operator {
        Binary::Add => x.wrapping_add(y),
        Binary::Sub => x.wrapping_sub(y),
        Binary::Mul => x.wrapping_mul(y),
        Binary::Less => i128::from(x < y),
        Binary::ShiftLeft if (0..128).contains(&y) => x << y,
        // Numbers are at most 127 bits wide, so that the sign of an unsigned one is 0.
        Binary::ShiftRight => x >> y.clamp(0, 127),
        Binary::ShiftLeft | Binary::Equal | Binary::And | Binary::Or | Binary::Xor => 0,
    };
    let unused = 128 - ty.bits;
    match ty.signed {
        true => value << unused >> unused,
        false => ((value as u128) << unused >> unused) as i128,
    }
}

/// The inverse of the limbs of `a`, or one bit from all of them.
fn unary(operator: Unary, slots: &mut [u64], to: &Operand, a: &Operand) {
    let (to, from, last) = (to.slot as usize, a.slot as usize, a.limbs as usize - 1);
    let used = |limb: usize| if limb == last { mask(a.ty.bits - 64 * last) } else { u64::MAX };
    let own = |limb: usize| slots[from + limb] & used(limb);
    slots[to] = match operator {
        Unary::Not => return (0..=last).for_each(|limb| slots[to + limb] = !slots[from + limb] & used(limb)),
        Unary::All => u64::from((0..=last).all(|limb| own(limb) == used(limb))),
        Unary::Any => u64::from((0..=last).any(|limb| own(limb) != 0)),
        Unary::Parity => u64::from((0..=last).map(|limb| own(limb).count_ones()).sum::<u32>() & 1),
    };
}

/// A number of at most two limbs.
fn number(slots: &[u64], of: &Operand) -> i128 {
    let low = slots[of.slot as usize];
    match (of.limbs, of.ty.signed) {
        (1, true) => i128::from(low as i64),
        (1, false) => i128::from(low),
        _ => (u128::from(slots[of.slot as usize + 1]) << 64 | u128::from(low)) as i128,
    }
}

/// Makes the bits above the width zeros, or copies of the sign.
fn trim(slots: &mut [u64], of: &Operand) {
    let last = of.limbs as usize - 1;
    let unused = 64 * (last + 1) - of.ty.bits;
    let limb = &mut slots[of.slot as usize + last];
    *limb = match of.ty.signed {
        true => ((*limb << unused) as i64 >> unused) as u64,
        false => *limb << unused >> unused,
    };
}
