//! Compilation of a kernel to flat lists of operations over 64-bit limbs.
//!
//! Every node has a slot of as many limbs as its width takes. A signed number is sign-extended over its limbs, an
//! unsigned one has zeros above its width; so an exact sum of up to 64 bits is one addition. Casts between equal bits,
//! extensions within a limb and wires have the slot of their operand.

use super::kernel::{Binary, Kernel, Node, NodeId, Role, Type, Unary};

/// Offset of a slot in limbs.
pub(crate) type Slot = u32;

/// A number of several limbs or with a sign that needs care: slot, limbs, width, signedness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operand {
    pub(crate) slot: Slot,
    pub(crate) limbs: u32,
    pub(crate) ty: Type,
}

/// An operation. `to` is the slot of the result; numbers are of one limb where nothing else is said.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Op {
    Add {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    Sub {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    Mul {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    And {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    Or {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    Xor {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    Equal {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    LessSigned {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    LessUnsigned {
        to: Slot,
        a: Slot,
        b: Slot,
    },
    /// Inverts the low bits given by the mask.
    Not {
        to: Slot,
        a: Slot,
        mask: u64,
    },
    IsMask {
        to: Slot,
        a: Slot,
        mask: u64,
    },
    IsNonZero {
        to: Slot,
        a: Slot,
    },
    Parity {
        to: Slot,
        a: Slot,
        mask: u64,
    },
    Mux {
        to: Slot,
        c: Slot,
        a: Slot,
        b: Slot,
    },
    /// Shifts right, then masks.
    Field {
        to: Slot,
        a: Slot,
        shift: u32,
        mask: u64,
    },
    /// A field that lies in two limbs.
    Straddle {
        to: Slot,
        a: Slot,
        shift: u32,
        mask: u64,
    },
    /// Sign-extends from `bits` bits.
    Sign {
        to: Slot,
        a: Slot,
        bits: u32,
    },
    /// `high` shifted left by `by`, or'ed with `low`.
    Join {
        to: Slot,
        high: Slot,
        low: Slot,
        by: u32,
    },
    Shift {
        to: Slot,
        a: Slot,
        by: Slot,
        ty: Type,
        left: bool,
    },
    Read {
        to: Slot,
        memory: u32,
        address: Slot,
    },
    /// Numbers of any width; index into [`Program::wide`].
    Wide {
        index: u32,
    },
}

/// Operations on numbers of more than one limb.
#[derive(Clone, Debug)]
pub(crate) enum Wide {
    /// Sum, difference, product, comparison, shift up to 127 bits.
    Arithmetic {
        operator: Binary,
        to: Operand,
        a: Operand,
        b: Operand,
    },
    /// Bitwise and, or, xor.
    Bitwise {
        operator: Binary,
        to: Operand,
        a: Slot,
        b: Slot,
    },
    Equal {
        to: Slot,
        a: Slot,
        b: Slot,
        limbs: u32,
    },
    Unary {
        operator: Unary,
        to: Operand,
        a: Operand,
    },
    Mux {
        to: Operand,
        c: Slot,
        a: Slot,
        b: Slot,
    },
    Read {
        to: Operand,
        memory: u32,
        address: Slot,
    },
    Slice {
        to: Operand,
        a: Operand,
        low: u32,
    },
    /// Parts with their offsets.
    Concat {
        to: Operand,
        parts: Vec<(Operand, u32)>,
    },
    /// Copies and extends, or changes the signedness.
    Resize {
        to: Operand,
        a: Operand,
    },
}

/// The compiled kernel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Program {
    /// Next values, resets and writes.
    pub(crate) edge: Vec<Op>,
    /// Combinational outputs.
    pub(crate) show: Vec<Op>,
    pub(crate) wide: Vec<Wide>,
    /// Slots of the constants, and their limbs.
    pub(crate) constants: Vec<(Slot, Vec<u64>)>,
    /// Number of limbs.
    pub(crate) limbs: usize,
    slots: Vec<Option<Slot>>,
}

/// Limbs of a number of `bits` bits.
pub(crate) fn limbs(bits: usize) -> u32 {
    bits.div_ceil(64) as u32
}

/// The low `bits` bits set, at most 64.
pub(crate) fn mask(bits: usize) -> u64 {
    match bits {
        0 => 0,
        bits => u64::MAX >> (64 - bits.min(64)),
    }
}

impl Program {
    /// Compiles a kernel without errors.
    pub(crate) fn new(kernel: &Kernel) -> Self {
        let mut program = Program { slots: vec![None; kernel.nodes.len()], ..Program::default() };
        for signal in 0..kernel.signals.len() {
            if !matches!(kernel.signals[signal].role, Role::Wire { .. }) {
                let ty = kernel.signals[signal].ty;
                if let Some(&node) = kernel.interned.get(&(Node::Signal(signal), ty)) {
                    program.slot(kernel, node);
                }
            }
        }
        let edge = kernel.order(&kernel.edge_roots()).unwrap_or_default();
        let show = kernel.order(&kernel.output_roots()).unwrap_or_default();
        program.edge = program.list(kernel, &edge);
        program.show = program.list(kernel, &show);
        program
    }

    /// The slot of `node` with its type.
    pub(crate) fn operand(&self, kernel: &Kernel, node: NodeId) -> Operand {
        let ty = kernel.ty(node);
        Operand { slot: self.slots[node].unwrap_or_default(), limbs: limbs(ty.bits), ty }
    }

    fn slot(&mut self, kernel: &Kernel, node: NodeId) -> Slot {
        if let Some(slot) = self.slots[node] {
            return slot;
        }
        let slot = self.limbs as Slot;
        self.limbs += limbs(kernel.ty(node).bits) as usize;
        self.slots[node] = Some(slot);
        slot
    }

    fn list(&mut self, kernel: &Kernel, order: &[NodeId]) -> Vec<Op> {
        let mut ops = Vec::new();
        for &node in order {
            self.compile(kernel, node, &mut ops);
        }
        ops
    }

    fn wide(&mut self, ops: &mut Vec<Op>, wide: Wide) {
        ops.push(Op::Wide { index: self.wide.len() as u32 });
        self.wide.push(wide);
    }

    fn compile(&mut self, kernel: &Kernel, node: NodeId, ops: &mut Vec<Op>) {
        let (kind, ty) = kernel.nodes[node].clone();
        // Nodes without an operation of their own.
        let alias = match &kind {
            Node::Signal(signal) => match kernel.signals[*signal].role {
                Role::Wire { .. } => kernel.signals[*signal].value,
                _ => return,
            },
            Node::Extend(a) if limbs(ty.bits) == limbs(kernel.ty(*a).bits) => Some(*a),
            _ => None,
        };
        if let Some(alias) = alias {
            self.slots[node] = self.slots[alias];
            return;
        }
        if let Node::Constant(value) = kind {
            if self.slots[node].is_none() {
                let to = self.slot(kernel, node);
                self.constants.push((to, extended(&value, ty)));
            }
            return;
        }
        let to = self.slot(kernel, node);
        let narrow = ty.bits <= 64 && kind.operands().iter().all(|&operand| kernel.ty(operand).bits <= 64);
        let operands: Vec<Operand> = kind.operands().iter().map(|&id| self.operand(kernel, id)).collect();
        match narrow {
            true => self.narrow(&kind, ty, to, &operands, ops),
            false => self.compile_wide(&kind, Operand { slot: to, limbs: limbs(ty.bits), ty }, &operands, ops),
        }
    }

    fn narrow(&mut self, kind: &Node, ty: Type, to: Slot, operands: &[Operand], ops: &mut Vec<Op>) {
        let slot = |k: usize| operands[k].slot;
        match kind {
            Node::Binary(operator, ..) => {
                let (a, b) = (slot(0), slot(1));
                let widest = operands[0].ty.bits.max(operands[1].ty.bits);
                // A sum that is wide enough is exact and needs no mask.
                let exact = match operator {
                    Binary::Add => ty.bits > widest,
                    Binary::Sub => ty.bits > widest && ty.signed,
                    _ => true,
                };
                ops.push(match operator {
                    Binary::Add => Op::Add { to, a, b },
                    Binary::Sub => Op::Sub { to, a, b },
                    Binary::Mul => Op::Mul { to, a, b },
                    Binary::And => Op::And { to, a, b },
                    Binary::Or => Op::Or { to, a, b },
                    Binary::Xor => Op::Xor { to, a, b },
                    Binary::Equal => Op::Equal { to, a, b },
                    Binary::Less if operands[0].ty.signed => Op::LessSigned { to, a, b },
                    Binary::Less => Op::LessUnsigned { to, a, b },
                    Binary::ShiftLeft => Op::Shift { to, a, by: b, ty, left: true },
                    Binary::ShiftRight => Op::Shift { to, a, by: b, ty, left: false },
                });
                match (exact, ty.signed) {
                    (true, _) => {}
                    (false, false) => ops.push(Op::Field { to, a: to, shift: 0, mask: mask(ty.bits) }),
                    (false, true) => ops.push(Op::Sign { to, a: to, bits: ty.bits as u32 }),
                }
            }
            Node::Unary(operator, _) => {
                let (a, mask) = (slot(0), mask(operands[0].ty.bits));
                ops.push(match operator {
                    Unary::Not => Op::Not { to, a, mask },
                    Unary::All => Op::IsMask { to, a, mask },
                    Unary::Any => Op::IsNonZero { to, a },
                    Unary::Parity => Op::Parity { to, a, mask },
                });
            }
            Node::Mux(..) => ops.push(Op::Mux { to, c: slot(0), a: slot(1), b: slot(2) }),
            Node::Slice(_, low) => {
                ops.push(Op::Field { to, a: slot(0), shift: *low as u32, mask: mask(ty.bits) });
            }
            Node::Concat(_) => {
                let mut high = slot(0);
                for part in &operands[1..] {
                    ops.push(Op::Join { to, high, low: part.slot, by: part.ty.bits as u32 });
                    high = to;
                }
            }
            Node::Cast(_) if ty.signed => ops.push(Op::Sign { to, a: slot(0), bits: ty.bits as u32 }),
            Node::Cast(_) => ops.push(Op::Field { to, a: slot(0), shift: 0, mask: mask(ty.bits) }),
            Node::Read { memory, .. } => ops.push(Op::Read { to, memory: *memory as u32, address: slot(0) }),
            // Compiled as aliases.
            Node::Extend(_) | Node::Constant(_) | Node::Signal(_) => {}
        }
    }

    fn compile_wide(&mut self, kind: &Node, to: Operand, operands: &[Operand], ops: &mut Vec<Op>) {
        let wide = match kind {
            Node::Binary(Binary::Equal, ..) => {
                Wide::Equal { to: to.slot, a: operands[0].slot, b: operands[1].slot, limbs: operands[0].limbs }
            }
            Node::Binary(operator @ (Binary::And | Binary::Or | Binary::Xor), ..) => {
                Wide::Bitwise { operator: *operator, to, a: operands[0].slot, b: operands[1].slot }
            }
            Node::Binary(operator, ..) => Wide::Arithmetic { operator: *operator, to, a: operands[0], b: operands[1] },
            Node::Unary(operator, _) => Wide::Unary { operator: *operator, to, a: operands[0] },
            Node::Mux(..) => Wide::Mux { to, c: operands[0].slot, a: operands[1].slot, b: operands[2].slot },
            Node::Slice(_, low) if to.limbs == 1 => {
                let (a, shift) = (operands[0].slot + (*low / 64) as Slot, (*low % 64) as u32);
                let (to, mask) = (to.slot, mask(to.ty.bits));
                let straddles = shift as usize + mask.count_ones() as usize > 64;
                return ops.push(match straddles {
                    true => Op::Straddle { to, a, shift, mask },
                    false => Op::Field { to, a, shift, mask },
                });
            }
            Node::Slice(_, low) => Wide::Slice { to, a: operands[0], low: *low as u32 },
            Node::Concat(_) => {
                let mut offset = to.ty.bits as u32;
                let parts = operands.iter().map(|part| {
                    offset -= part.ty.bits as u32;
                    (*part, offset)
                });
                Wide::Concat { to, parts: parts.collect() }
            }
            Node::Extend(_) | Node::Cast(_) => Wide::Resize { to, a: operands[0] },
            Node::Read { memory, .. } if to.limbs == 1 => {
                return ops.push(Op::Read { to: to.slot, memory: *memory as u32, address: operands[0].slot });
            }
            Node::Read { memory, .. } => Wide::Read { to, memory: *memory as u32, address: operands[0].slot },
            // Compiled without an operation.
            Node::Constant(_) | Node::Signal(_) => return,
        };
        self.wide(ops, wide);
    }
}

/// The limbs of a constant with its sign in the bits above its width.
fn extended(value: &[u64], ty: Type) -> Vec<u64> {
    let mut limbs = value.to_vec();
    let last = limbs.len() - 1;
    let used = ty.bits - 64 * last;
    if ty.signed && limbs[last] >> (used - 1) & 1 == 1 {
        limbs[last] |= !mask(used);
    }
    limbs
}
