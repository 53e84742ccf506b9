//! Checks of a finished kernel, and expressions as text for messages.

use super::error::KernelError;
use super::kernel::{Binary, Defect, Kernel, Node, NodeId, Unary};

/// Nesting after which an expression in a message is abbreviated.
const DEPTH: usize = 4;

impl Kernel {
    /// Adds what is wrong with the finished kernel to its errors.
    pub(crate) fn check(&mut self) {
        let defects: Vec<KernelError> =
            std::mem::take(&mut self.defects).into_iter().map(|(node, defect)| self.defective(node, defect)).collect();
        self.errors.splice(..0, defects);
        let unassigned = |signal: &&super::kernel::Signal| signal.value.is_none() && !signal.role.is_driven_outside();
        let unassigned: Vec<String> =
            self.signals.iter().filter(unassigned).map(|signal| signal.name.clone()).collect();
        let block = self.block.clone();
        self.errors
            .extend(unassigned.into_iter().map(|signal| KernelError::Unassigned { block: block.clone(), signal }));
        let roots: Vec<NodeId> = self.signals.iter().filter_map(|signal| signal.value).collect();
        if let Err(wires) = self.order(&[roots, self.edge_roots()].concat()) {
            let names: Vec<&str> = wires.iter().map(|&wire| self.signals[wire].name.as_str()).collect();
            let (signal, through) = (names.first().copied().unwrap_or_default().to_owned(), names.join(", "));
            let expression = self.value_of(&signal);
            self.errors.push(KernelError::Loop { block, signal, through, expression });
        }
    }

    /// Adds the outputs of instances that nothing reads to its errors. A changed kernel is not asked: a seeded defect may leave a
    /// signal unread.
    pub(crate) fn check_reads(&mut self) {
        let signals = self.unread().join(", ");
        if !signals.is_empty() {
            let block = self.block.clone();
            self.errors.push(KernelError::Unread { block, signals });
        }
    }

    /// The error of a defect in the expression `node`.
    fn defective(&self, node: NodeId, defect: Defect) -> KernelError {
        let (block, expression) = (self.block.clone(), self.describe(node));
        let signal = self.taker_of(node).unwrap_or("(none)").to_owned();
        match defect {
            Defect::MixedSigns => KernelError::MixedSigns { block, signal, expression },
            Defect::Width(reason) => KernelError::Width { block, signal, expression, reason },
        }
    }

    /// The value of the signal `name` as text for a message; empty if it has none.
    pub(crate) fn value_of(&self, name: &str) -> String {
        let value = self.signal_of(name).and_then(|id| self.signals[id].value);
        value.map(|value| self.describe(value)).unwrap_or_default()
    }

    /// The expression of `node` as text for a message.
    pub(crate) fn describe(&self, node: NodeId) -> String {
        self.described(node, DEPTH)
    }

    fn described(&self, node: NodeId, depth: usize) -> String {
        let Some(inner) = depth.checked_sub(1) else { return "…".to_owned() };
        let of = |id: &NodeId| self.described(*id, inner);
        match &self.nodes[node].0 {
            Node::Constant(limbs) => format!("{}'d{}", self.ty(node).bits, limbs[0]),
            Node::Signal(signal) => self.signals[*signal].name.clone(),
            Node::Read { memory, address } => format!("{}[{}]", self.memories[*memory].name, of(address)),
            Node::Unary(operator, a) => format!("{}{}", operator.symbol(), of(a)),
            Node::Binary(operator, a, b) => format!("({} {} {})", of(a), operator.symbol(), of(b)),
            Node::Mux(c, a, b) => format!("({} ? {} : {})", of(c), of(a), of(b)),
            Node::Slice(a, low) => format!("{}[{}:{low}]", of(a), low + self.ty(node).bits - 1),
            Node::Concat(parts) => format!("{{{}}}", parts.iter().map(of).collect::<Vec<_>>().join(", ")),
            Node::Extend(a) | Node::Cast(a) => format!("{}({})", self.ty(node), of(a)),
        }
    }
}

impl Unary {
    /// The operator in Verilog.
    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Unary::Not => "~",
            Unary::All => "&",
            Unary::Any => "|",
            Unary::Parity => "^",
        }
    }
}

impl Binary {
    /// The operator in Verilog, for unsigned operands.
    pub(crate) fn symbol(self) -> &'static str {
        match self {
            Binary::Add => "+",
            Binary::Sub => "-",
            Binary::Mul => "*",
            Binary::And => "&",
            Binary::Or => "|",
            Binary::Xor => "^",
            Binary::Equal => "==",
            Binary::Less => "<",
            Binary::ShiftLeft => "<<",
            Binary::ShiftRight => ">>",
        }
    }
}
