//! Flip-flops and LUTs of a kernel, estimated from its graph.
//!
//! | node | four-input LUTs |
//! |---|---|
//! | sum, difference, comparison by size | 1 per bit, and 4 where the carry chain begins and ends |
//! | multiplexer | 6/7 per bit; 1/2 with a constant; none where 16 register bits or more keep their value or are reset by it |
//! | multiplexers between up to 16 constants | 1 per bit |
//! | and, or, exclusive or | 1/4 per bit: mostly merged into another node |
//! | equality | 1/2 per bit, 1/4 with a constant |
//! | parity, all or any of n bits | (n − 1)/3 |
//! | shift by a signal | 3/2 per bit and bit of the distance |
//! | product, memory in block RAM | none: counted as multipliers and block RAMs |
//! | memory of w words and b bits in LUTs | 6 per 16 words and 4 bits |
//!
//! The costs were fitted to what Yosys 0.23 needs for each block by itself. Of all blocks together, flattened, it shares
//! and removes a part ([`FLATTENED`]). The tests state how far the estimate is from Yosys.

use std::collections::{BTreeMap, BTreeSet};

use super::kernel::{Binary, Kernel, Node, NodeId, Unary};

/// A distributed RAM cell of the ECP5: words, bits per word, LUTs.
const CELL: [usize; 3] = [16, 4, 6];

/// LUTs of a flattened design over those of its blocks by themselves: measured 0.82 (one block search of degree 1) to 0.86
/// (`sensor-1`).
pub(super) const FLATTENED: f64 = 0.85;

/// LUTs by which place and route connects both ends of a carry chain to other logic.
const CHAIN_ENDS: f64 = 4.0;

/// Fewest flip-flops that share an enable or a reset: our flow makes logic of smaller groups (`sim/flow/src/family.rs`).
const SMALLEST_GROUP: usize = 16;

/// Logic of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Logic {
    /// Register bits.
    pub(crate) flip_flops: usize,
    /// Four-input LUTs; the caller rounds.
    pub(crate) luts: f64,
}

/// LUTs of a memory of `words` words and `bits` bits as distributed RAM.
pub(crate) fn distributed_luts(words: usize, bits: usize) -> usize {
    let [cell_words, cell_bits, luts] = CELL;
    words.div_ceil(cell_words) * bits.div_ceil(cell_bits) * luts
}

impl Kernel {
    /// Logic of the block. The memories named in `placed` are counted elsewhere, with their output registers.
    pub(crate) fn logic(&self, placed: &BTreeSet<&str>) -> Logic {
        let mut logic = Logic::default();
        // Multiplexers by which registers are kept or reset, and the flip-flops that each condition so steers.
        let (mut steering, mut steered) = (Vec::new(), BTreeMap::<NodeId, usize>::new());
        for (id, signal, _) in self.registers() {
            let own = self.interned[&(Node::Signal(id), signal.ty)];
            let next = signal.value.unwrap_or(own);
            let taken = match self.nodes[next].0 {
                Node::Mux(_, a, b) if b == own => a,
                _ => next,
            };
            let of_memory = match self.nodes[taken].0 {
                Node::Read { memory, .. } => placed.contains(self.memories[memory].name.as_str()),
                _ => false,
            };
            if !of_memory {
                logic.flip_flops += signal.ty.bits;
            }
            let mut outer = next;
            while let Node::Mux(condition, a, b) = self.nodes[outer].0 {
                let inner = if a == own || self.is_constant(a) { b } else { a };
                if inner == a && b != own && !self.is_constant(b) {
                    break;
                }
                steering.push((outer, condition));
                *steered.entry(condition).or_default() += signal.ty.bits;
                outer = inner;
            }
        }
        // Enable and reset are inputs of the flip-flop.
        let enough = |condition: &NodeId| steered[condition] >= SMALLEST_GROUP || self.is_input(*condition);
        let mut free: BTreeSet<NodeId> =
            steering.iter().filter(|(_, condition)| enough(condition)).map(|(mux, _)| *mux).collect();
        let values: Vec<NodeId> = self.signals.iter().filter_map(|signal| signal.value).collect();
        let order = self.order(&[values, self.edge_roots()].concat()).unwrap_or_default();
        // Inner multiplexers of a table are in the same LUT as the outer one.
        for &node in order.iter().filter(|&&node| self.choices(node).is_some()) {
            free.extend(self.nodes[node].0.operands());
        }
        let luts: f64 = order.iter().filter(|node| !free.contains(*node)).map(|&node| self.luts(node)).sum();
        logic.luts = FLATTENED * luts;
        for memory in self.memories.iter().filter(|memory| !placed.contains(memory.name.as_str())) {
            logic.luts += distributed_luts(memory.words, memory.bits) as f64;
        }
        logic
    }

    /// Whether the node is an input of the block, which registers of other blocks may share.
    fn is_input(&self, node: NodeId) -> bool {
        matches!(self.nodes[node].0, Node::Signal(id) if self.signals[id].role.is_driven_outside())
    }

    fn is_constant(&self, node: NodeId) -> bool {
        matches!(self.nodes[node].0, Node::Constant(_))
    }

    /// Levels of multiplexers between constants under `node`, up to the inputs of a LUT.
    fn choices(&self, node: NodeId) -> Option<usize> {
        match self.nodes[node].0 {
            Node::Constant(_) => Some(0),
            Node::Mux(_, a, b) => Some(self.choices(a)?.max(self.choices(b)?) + 1).filter(|levels| *levels <= 4),
            _ => None,
        }
    }

    fn luts(&self, node: NodeId) -> f64 {
        let bits = |id: NodeId| self.ty(id).bits as f64;
        let constant = |id: NodeId| self.is_constant(id);
        match &self.nodes[node].0 {
            Node::Binary(Binary::Add | Binary::Sub, ..) => bits(node) + CHAIN_ENDS,
            Node::Binary(Binary::Less, a, b) => bits(*a).max(bits(*b)) + CHAIN_ENDS,
            Node::Binary(Binary::Equal, a, b) => bits(*a) * if constant(*a) || constant(*b) { 0.25 } else { 0.5 },
            Node::Binary(Binary::And | Binary::Or | Binary::Xor, ..) => 0.25 * bits(node),
            Node::Binary(Binary::ShiftLeft | Binary::ShiftRight, _, by) => 1.5 * bits(node) * bits(*by),
            Node::Mux(_, a, b) if constant(*a) || constant(*b) => 0.5 * bits(node),
            Node::Mux(..) => 6.0 / 7.0 * bits(node),
            Node::Unary(Unary::All | Unary::Any | Unary::Parity, a) => (bits(*a) - 1.0) / 3.0,
            _ => 0.0,
        }
    }
}
