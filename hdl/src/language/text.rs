//! Expressions of a kernel in Verilog, and which of them need a wire of their own.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::kernel::{Binary, Kernel, Node, NodeId, Role, Unary};

/// An operand's place: a text binds less tightly than an operand must.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Binding {
    Mux,
    Or,
    And,
    Operator,
    Atom,
}

/// Prints expressions.
pub(super) struct Text<'a> {
    pub(super) kernel: &'a Kernel,
    /// Names of nodes that have a wire of their own.
    pub(super) names: BTreeMap<NodeId, String>,
}

impl Kernel {
    /// Names for the unnamed nodes that need a wire: read more than once, selected from, or of a form whose value
    /// would depend on its context.
    fn own_wires(&self) -> BTreeMap<NodeId, String> {
        let values: Vec<NodeId> = self.signals.iter().filter_map(|signal| signal.value).collect();
        let roots = [values.clone(), self.edge_roots()].concat();
        let order = self.order(&roots).unwrap_or_default();
        let mut readers = vec![0; self.nodes.len()];
        let mut needed = BTreeSet::new();
        let direct: BTreeSet<NodeId> = values.iter().copied().collect();
        for &node in &order {
            for operand in self.nodes[node].0.operands() {
                readers[operand] += 1;
            }
            let ty = self.ty(node);
            match &self.nodes[node].0 {
                Node::Slice(a, _) => {
                    needed.insert(self.bare(*a));
                }
                Node::Extend(a) if self.ty(*a).signed => {
                    needed.insert(self.bare(*a));
                }
                Node::Binary(Binary::Add | Binary::Sub, a, b) => {
                    let grows = |id: &&NodeId| self.ty(**id).signed && self.ty(**id).bits < ty.bits;
                    needed.extend([a, b].iter().filter(|id| grows(id)).map(|id| self.bare(**id)));
                }
                Node::Binary(Binary::Mul, ..) if !direct.contains(&node) => {
                    needed.insert(node);
                }
                Node::Binary(Binary::ShiftRight, a, _) if self.ty(*a).signed && !direct.contains(&node) => {
                    needed.insert(node);
                }
                _ => {}
            }
        }
        for &root in &values {
            readers[root] += 1;
        }
        let shared = order.iter().copied().filter(|&node| readers[node] > 1 && !self.is_short(node));
        needed.extend(shared);
        needed.retain(|&node| !matches!(self.nodes[node].0, Node::Signal(_) | Node::Constant(_)));
        self.named_after_takers(needed)
    }

    /// Names for `nodes`, each after the first signal or memory that takes it: an expression more changes the names of its own taker's.
    fn named_after_takers(&self, mut nodes: BTreeSet<NodeId>) -> BTreeMap<NodeId, String> {
        let signals = self.signals.iter();
        let values = signals.clone().filter_map(|signal| Some((&signal.name, signal.value?)));
        let resets = signals.filter_map(|signal| match &signal.role {
            Role::Register(register) => Some((&signal.name, register.reset?.0)),
            _ => None,
        });
        let writes = self.memories.iter().flat_map(|memory| {
            let all = memory.writes.iter().flat_map(|write| [write.enable, write.address, write.data]);
            all.map(|node| (&memory.name, node))
        });
        let (mut names, mut counts) = (BTreeMap::new(), BTreeMap::new());
        let mut seen = vec![false; self.nodes.len()];
        for (taker, root) in values.chain(resets).chain(writes) {
            let mut stack = vec![root];
            while let Some(node) = stack.pop() {
                if std::mem::replace(&mut seen[node], true) {
                    continue;
                }
                stack.extend(self.nodes[node].0.operands());
                if !nodes.remove(&node) {
                    continue;
                }
                let count = counts.entry(taker).or_insert(0);
                *count += 1;
                let mut name = format!("{taker}_part_{count}");
                while self.signal_of(&name).is_some() {
                    name.push('_');
                }
                names.insert(node, name);
            }
        }
        names
    }

    /// The node under casts.
    pub(super) fn bare(&self, node: NodeId) -> NodeId {
        match self.nodes[node].0 {
            Node::Cast(a) => self.bare(a),
            _ => node,
        }
    }

    /// Whether a node is printed as shortly as the name of a wire.
    fn is_short(&self, node: NodeId) -> bool {
        match &self.nodes[node].0 {
            Node::Constant(_) | Node::Signal(_) | Node::Slice(..) => true,
            Node::Cast(a) | Node::Extend(a) | Node::Unary(_, a) => self.is_short(*a),
            _ => false,
        }
    }
}

impl<'a> Text<'a> {
    /// For the expressions of `kernel`.
    pub(super) fn new(kernel: &'a Kernel) -> Self {
        Text { kernel, names: kernel.own_wires() }
    }

    /// A value that stands alone on the right of an assignment of its width.
    pub(super) fn root(&self, node: NodeId) -> String {
        match self.names.get(&node) {
            Some(name) => name.clone(),
            None => self.form(node).0,
        }
    }

    /// The text of the contrary of a condition.
    pub(super) fn negated(&self, condition: NodeId) -> String {
        match self.kernel.nodes[condition].0 {
            Node::Unary(Unary::Not, a) => self.root(a),
            _ => format!("!{}", self.operand(condition)),
        }
    }

    /// The text of `node`, in parentheses if it binds less tightly than `least`.
    fn within(&self, node: NodeId, least: Binding) -> String {
        if let Some(name) = self.names.get(&node) {
            return name.clone();
        }
        let (text, binding) = self.form(node);
        match binding < least {
            true => format!("({text})"),
            false => text,
        }
    }

    /// The text of the operand of a unary operator; Verilog has no operator right behind another one.
    fn operand(&self, node: NodeId) -> String {
        let text = self.within(node, Binding::Atom);
        match text.starts_with(['!', '~', '&', '|', '^']) {
            true => format!("({text})"),
            false => text,
        }
    }

    /// The text of `node` as one of `bits` bits.
    fn fit(&self, node: NodeId, bits: usize, least: Binding) -> String {
        let ty = self.kernel.ty(node);
        let Some(more) = bits.checked_sub(ty.bits).filter(|more| *more > 0) else { return self.within(node, least) };
        if let Node::Constant(limbs) = &self.kernel.nodes[node].0
            && !ty.signed
        {
            return number(bits, limbs);
        }
        let text = self.within(node, Binding::Mux);
        match ty.signed {
            false => format!("{{{}, {text}}}", number(more, &[0])),
            true => {
                let top = self.select(self.kernel.bare(node), ty.bits - 1, 1);
                let sign = if more == 1 { top } else { format!("{{{more}{{{top}}}}}") };
                format!("{{{sign}, {text}}}")
            }
        }
    }

    /// Bits of a named node or of a constant.
    fn select(&self, node: NodeId, low: usize, bits: usize) -> String {
        let whole = self.kernel.ty(node).bits;
        if let Node::Constant(limbs) = &self.kernel.nodes[node].0 {
            let bit = |at: usize| limbs[at / 64] >> (at % 64) & 1;
            let mut value = vec![0; bits.div_ceil(64)];
            (0..bits).for_each(|at| value[at / 64] |= bit(low + at) << (at % 64));
            return number(bits, &value);
        }
        let name = self.within(node, Binding::Atom);
        match bits {
            _ if whole == bits => name,
            1 => format!("{name}[{low}]"),
            _ => format!("{name}[{}:{low}]", low + bits - 1),
        }
    }

    /// The operator of `node` with its operands, and how tightly it binds.
    pub(super) fn form(&self, node: NodeId) -> (String, Binding) {
        let kernel = self.kernel;
        let ty = kernel.ty(node);
        let atom = |text: String| (text, Binding::Atom);
        match &kernel.nodes[node].0 {
            Node::Constant(limbs) => atom(number(ty.bits, limbs)),
            Node::Signal(signal) => atom(kernel.signals[*signal].name.clone()),
            Node::Read { memory, address } => {
                atom(format!("{}[{}]", kernel.memories[*memory].name, self.within(*address, Binding::Mux)))
            }
            Node::Unary(Unary::Not, a) if self.inequality(*a).is_some() => {
                (self.inequality(*a).unwrap_or_default(), Binding::Operator)
            }
            Node::Unary(Unary::Not, a) if ty.bits == 1 => atom(format!("!{}", self.operand(*a))),
            Node::Unary(operator, a) => atom(format!("{}{}", operator.symbol(), self.operand(*a))),
            Node::Slice(a, low) => atom(self.select(kernel.bare(*a), *low, ty.bits)),
            Node::Cast(a) => match self.names.get(a) {
                Some(name) => atom(name.clone()),
                None => self.form(*a),
            },
            Node::Extend(a) => atom(self.fit(*a, ty.bits, Binding::Atom)),
            Node::Concat(parts) => atom(self.concat(parts)),
            Node::Mux(c, a, b) => {
                let (a, b) = (self.within(*a, Binding::Or), self.within(*b, Binding::Mux));
                (format!("{} ? {a} : {b}", self.within(*c, Binding::Or)), Binding::Mux)
            }
            Node::Binary(operator, a, b) => self.binary(*operator, *a, *b, ty.bits),
        }
    }

    /// The text of the contrary of an equality that has no wire of its own.
    fn inequality(&self, node: NodeId) -> Option<String> {
        match self.kernel.nodes[node].0 {
            Node::Binary(Binary::Equal, a, b) if !self.names.contains_key(&node) => {
                Some(format!("{} != {}", self.within(a, Binding::Atom), self.within(b, Binding::Atom)))
            }
            _ => None,
        }
    }

    fn concat(&self, parts: &[NodeId]) -> String {
        let mut texts: Vec<(String, usize)> = Vec::new();
        for &part in parts {
            let text = self.within(part, Binding::Mux);
            match texts.last_mut().filter(|(last, _)| *last == text) {
                Some((_, count)) => *count += 1,
                None => texts.push((text, 1)),
            }
        }
        let one = |(text, count): &(String, usize)| match count {
            1 => text.clone(),
            _ => format!("{{{count}{{{text}}}}}"),
        };
        format!("{{{}}}", texts.iter().map(one).collect::<Vec<_>>().join(", "))
    }

    fn binary(&self, operator: Binary, a: NodeId, b: NodeId, bits: usize) -> (String, Binding) {
        let kernel = self.kernel;
        let signed = kernel.ty(a).signed;
        let (symbol, binding) = match operator {
            Binary::And if bits == 1 => ("&&", Binding::And),
            Binary::Or if bits == 1 => ("||", Binding::Or),
            _ => (operator.symbol(), Binding::Operator),
        };
        let join = |a: String, symbol: &str, b: String| (format!("{a} {symbol} {b}"), binding);
        let as_signed = |id, bits| format!("$signed({})", self.fit(id, bits, Binding::Mux));
        match operator {
            Binary::And | Binary::Or | Binary::Xor => {
                // The same operator needs no parentheses.
                let least = match binding {
                    Binding::Operator => Binding::Atom,
                    own => own,
                };
                join(self.within(a, least), symbol, self.within(b, least))
            }
            Binary::Add | Binary::Sub => {
                join(self.fit(a, bits, Binding::Atom), symbol, self.fit(b, bits, Binding::Atom))
            }
            Binary::Mul if signed => join(as_signed(a, kernel.ty(a).bits), symbol, as_signed(b, kernel.ty(b).bits)),
            Binary::Less if signed => {
                let bits = kernel.ty(a).bits.max(kernel.ty(b).bits);
                join(as_signed(a, bits), symbol, as_signed(b, bits))
            }
            Binary::ShiftRight if signed => join(as_signed(a, kernel.ty(a).bits), ">>>", self.within(b, Binding::Atom)),
            Binary::Equal | Binary::Less | Binary::Mul | Binary::ShiftLeft | Binary::ShiftRight => {
                join(self.within(a, Binding::Atom), symbol, self.within(b, Binding::Atom))
            }
        }
    }
}

/// A sized constant.
pub(super) fn number(bits: usize, limbs: &[u64]) -> String {
    let high = limbs.iter().rposition(|&limb| limb != 0).unwrap_or(0);
    match (bits, high) {
        (1, _) => format!("1'b{}", limbs[0] & 1),
        (_, 0) => format!("{bits}'d{}", limbs[0]),
        _ => {
            let mut text = format!("{bits}'h{:x}", limbs[high]);
            limbs[..high].iter().rev().for_each(|limb| {
                let _ = write!(text, "{limb:016x}");
            });
            text
        }
    }
}
