//! The expression graph of a block: nodes in one arena, signals, memories.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::error::KernelError;

/// Width and signedness of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Type {
    /// Width in bits, at least 1.
    pub bits: usize,
    /// Two's complement if set, else unsigned.
    pub signed: bool,
}

impl Type {
    /// An unsigned type of `bits` bits.
    pub fn unsigned(bits: usize) -> Self {
        Type { bits, signed: false }
    }

    /// A two's complement type of `bits` bits.
    pub fn signed(bits: usize) -> Self {
        Type { bits, signed: true }
    }
}

impl std::fmt::Display for Type {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", if self.signed { "s" } else { "u" }, self.bits)
    }
}

/// Index of a node in [`Kernel::nodes`].
pub(crate) type NodeId = usize;
/// Index of a signal in [`Kernel::signals`].
pub(crate) type SignalId = usize;
/// Index of a memory in [`Kernel::memories`].
pub(crate) type MemoryId = usize;

/// Operators of one operand, unsigned result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Unary {
    /// Every bit inverted.
    Not,
    /// 1 if all bits are 1.
    All,
    /// 1 if a bit is 1.
    Any,
    /// 1 if the number of bits that are 1 is odd.
    Parity,
}

/// Operators of two operands. Operands of a sum, a difference or a comparison are extended to a common width.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Binary {
    /// Sum modulo two to the power of the node's width.
    Add,
    /// Difference modulo two to the power of the node's width.
    Sub,
    /// Product, exact.
    Mul,
    /// Bitwise and, operands of the same width.
    And,
    /// Bitwise or, operands of the same width.
    Or,
    /// Bitwise exclusive or, operands of the same width.
    Xor,
    /// Whether two numbers are equal.
    Equal,
    /// Whether the first number is less than the second.
    Less,
    /// Shift to the left by a signal; bits beyond the width are dropped.
    ShiftLeft,
    /// Shift to the right by a signal, arithmetic for signed operands.
    ShiftRight,
}

/// A node of the graph. None carries text or a function.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// Limbs of 64 bits, least significant first; bits beyond the width are zero.
    Constant(Vec<u64>),
    /// The value of a named signal.
    Signal(SignalId),
    /// A word of a memory, asynchronous.
    Read { memory: MemoryId, address: NodeId },
    /// Operator of one operand.
    Unary(Unary, NodeId),
    /// Operator of two operands.
    Binary(Binary, NodeId, NodeId),
    /// The second operand if the first is 1, else the third.
    Mux(NodeId, NodeId, NodeId),
    /// Bits from this offset on, as many as the node is wide.
    Slice(NodeId, usize),
    /// Concatenation, most significant part first.
    Concat(Vec<NodeId>),
    /// The operand with the node's larger width, by zeros or by its sign.
    Extend(NodeId),
    /// The operand's bits with the other signedness.
    Cast(NodeId),
}

impl Node {
    /// The nodes that this one reads.
    pub(crate) fn operands(&self) -> Vec<NodeId> {
        match self {
            Node::Constant(_) | Node::Signal(_) => Vec::new(),
            Node::Read { address, .. } => vec![*address],
            Node::Unary(_, a) | Node::Slice(a, _) | Node::Extend(a) | Node::Cast(a) => vec![*a],
            Node::Binary(_, a, b) => vec![*a, *b],
            Node::Mux(c, a, b) => vec![*c, *a, *b],
            Node::Concat(parts) => parts.clone(),
        }
    }
}

/// Kind of a named signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// Port driven from outside.
    Input,
    /// Output of an instance.
    Instance,
    /// Combinational; `declared` ahead of its assignment.
    Wire { declared: bool },
    /// Changes at the rising edge of the clock.
    Register(Register),
}

impl Role {
    /// Whether another block drives the signal.
    pub(crate) fn is_driven_outside(&self) -> bool {
        matches!(self, Role::Input | Role::Instance)
    }
}

/// Properties of a register.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Register {
    /// Synchronous reset: condition, value; it has priority over the next value.
    pub(crate) reset: Option<(NodeId, u64)>,
    /// Initial value in the bitstream; without it the value before a reset is undefined.
    pub(crate) initial: Option<u64>,
    /// Synthesis must neither merge nor remove it.
    pub(crate) keep: bool,
    /// Clock domain: that of the block's clock port, or one of [`Kernel::domains`].
    pub(crate) domain: Option<usize>,
}

/// A clock domain besides that of the block's clock port. Its resets are asynchronous.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Domain {
    /// Input that is its clock.
    pub(crate) clock: SignalId,
    /// Registers change at the falling edge.
    pub(crate) falling: bool,
}

/// A named signal.
#[derive(Clone, Debug)]
pub(crate) struct Signal {
    pub(crate) name: String,
    pub(crate) ty: Type,
    pub(crate) role: Role,
    /// Value of a wire, next value of a register.
    pub(crate) value: Option<NodeId>,
    /// Conditions under which the signal is assigned, one per assignment.
    pub(crate) guards: Vec<Option<NodeId>>,
    pub(crate) comment: Option<String>,
    /// Driven port of the block.
    pub(crate) output: bool,
    /// Names of the states that a register is in, by their numbers; else none.
    pub(crate) states: &'static [&'static str],
}

/// Initial contents of a memory.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Contents {
    /// Undefined; zeros in the simulation.
    #[default]
    Undefined,
    /// Read by `$readmemh` from a file of this name; one word of limbs per address for the simulation.
    File {
        /// File name without folder.
        name: String,
        /// Words, limbs of 64 bits, least significant first.
        words: Vec<Vec<u64>>,
    },
    /// Words of at most 64 bits by address, written out in the Verilog; the others are undefined, zeros in the simulation.
    Words(Vec<(usize, u64)>),
}

/// A write port.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Write {
    pub(crate) enable: NodeId,
    pub(crate) address: NodeId,
    pub(crate) data: NodeId,
    /// Bit of the word at which the data begin; they may be narrower than the word.
    pub(crate) low: usize,
}

/// A memory with asynchronous read ports; a register that takes a read directly is its output register.
#[derive(Clone, Debug)]
pub struct Memory {
    /// Name in the block.
    pub name: String,
    /// Number of words.
    pub words: usize,
    /// Width of a word in bits.
    pub bits: usize,
    /// Initial contents.
    pub contents: Contents,
    /// Value of the attribute `ram_style`, of a memory that nothing writes `rom_style`: `block`, `distributed`; none leaves the choice to
    /// synthesis.
    pub style: Option<String>,
    /// What is read in the cycle of a write to the same address is not used: attribute `no_rw_check`.
    pub unchecked: bool,
    /// What it holds, by which a plan of the memories refers to it.
    pub label: Option<String>,
    pub(crate) writes: Vec<Write>,
}

impl Memory {
    /// Whether it has a write port.
    pub fn is_written(&self) -> bool {
        !self.writes.is_empty()
    }
}

/// A port of a block.
#[derive(Clone, Debug)]
pub(crate) struct Port {
    pub(crate) name: String,
    pub(crate) bits: usize,
    pub(crate) output: bool,
    /// What it means.
    pub(crate) doc: String,
}

/// A block inside another one. Its port `p` is the signal `name__p` of the block around it.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    pub(crate) name: String,
    pub(crate) kernel: Arc<Kernel>,
}

/// Between the levels of the name of a module or a net. Neither `$` nor `.`, which Tcl, XDC and VHDL do not take.
pub const SEPARATOR: &str = "__";

/// What a clock port means.
const CLOCK: &str = "Clock; registers change on its rising edge.";

/// What is wrong with an expression.
#[derive(Clone, Debug)]
pub(crate) enum Defect {
    /// Signed and unsigned operands.
    MixedSigns,
    /// Operands of these widths are impossible.
    Width(String),
}

/// What is printed in which order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Item {
    /// A comment line.
    Comment(String),
    /// The definition of a wire.
    Wire(SignalId),
}

/// A block's behaviour: one graph, from which simulation, Verilog and resources follow.
#[derive(Clone, Debug, Default)]
pub struct Kernel {
    pub(crate) block: String,
    pub(crate) clock: Option<String>,
    /// The ports besides the clock, in the order of their declaration.
    pub(crate) ports: Vec<Port>,
    pub(crate) instances: Vec<Instance>,
    pub(crate) domains: Vec<Domain>,
    pub(crate) nodes: Vec<(Node, Type)>,
    pub(crate) interned: HashMap<(Node, Type), NodeId>,
    pub(crate) signals: Vec<Signal>,
    pub(crate) memories: Vec<Memory>,
    pub(crate) items: Vec<Item>,
    pub(crate) errors: Vec<KernelError>,
    /// Defects of expressions whose signals are not known before the kernel is finished.
    pub(crate) defects: Vec<(NodeId, Defect)>,
    /// Signals that nothing reads, on purpose.
    pub(crate) unused: Vec<NodeId>,
}

impl Kernel {
    /// Name of the block, in messages.
    pub fn block(&self) -> &str {
        &self.block
    }

    /// The memories.
    pub fn memories(&self) -> &[Memory] {
        &self.memories
    }

    /// Defects of the description: first those of expressions, from which others follow; empty if there are none.
    pub fn errors(&self) -> &[KernelError] {
        &self.errors
    }

    /// Name and type of every signal: ports, wires, registers.
    pub fn signals(&self) -> impl Iterator<Item = (&str, Type)> {
        self.signals.iter().map(|signal| (signal.name.as_str(), signal.ty))
    }

    /// Name and width of every register.
    pub fn register_widths(&self) -> impl Iterator<Item = (&str, usize)> {
        self.registers().map(|(_, signal, _)| (signal.name.as_str(), signal.ty.bits))
    }

    pub(crate) fn ty(&self, node: NodeId) -> Type {
        self.nodes[node].1
    }

    /// The index of `node`; equal nodes have one index.
    pub(crate) fn intern(&mut self, node: Node, ty: Type) -> NodeId {
        if let Some(&id) = self.interned.get(&(node.clone(), ty)) {
            return id;
        }
        self.nodes.push((node.clone(), ty));
        self.interned.insert((node, ty), self.nodes.len() - 1);
        self.nodes.len() - 1
    }

    /// Records a defect.
    pub(crate) fn fail(&mut self, error: KernelError) {
        self.errors.push(error);
    }

    /// Every output, and every input of an instance, that depends on inputs or on outputs of instances in the same cycle, with
    /// their names.
    pub(crate) fn combinational(&self) -> Vec<(&str, Vec<&str>)> {
        let inputs = self.instance_inputs();
        let leaves = |signal: &&Signal| signal.output || inputs.contains(&signal.name);
        let outputs = self.signals.iter().filter(leaves).filter(|signal| matches!(signal.role, Role::Wire { .. }));
        outputs.map(|signal| (signal.name.as_str(), self.inputs_of(signal))).collect()
    }

    /// Names of the signals that drive inputs of instances.
    pub(crate) fn instance_inputs(&self) -> BTreeSet<String> {
        let inputs = self.instances.iter().flat_map(|instance| {
            let inputs = instance.kernel.ports.iter().filter(|port| !port.output);
            inputs.map(|port| format!("{}{SEPARATOR}{}", instance.name, port.name))
        });
        inputs.collect()
    }

    /// Names of the inputs on which a wire depends in the same cycle.
    fn inputs_of(&self, signal: &Signal) -> Vec<&str> {
        let mut open: Vec<NodeId> = signal.value.into_iter().collect();
        let (mut seen, mut found) = (vec![false; self.nodes.len()], Vec::new());
        while let Some(node) = open.pop() {
            if std::mem::replace(&mut seen[node], true) {
                continue;
            }
            if let Node::Signal(id) = self.nodes[node].0 {
                match &self.signals[id].role {
                    Role::Input | Role::Instance => found.push(self.signals[id].name.as_str()),
                    Role::Wire { .. } => open.extend(self.signals[id].value),
                    Role::Register(_) => {}
                }
            }
            open.extend(self.nodes[node].0.operands());
        }
        found
    }

    /// Name of the first signal or memory whose value, reset or write contains `node`. If there is none, that of the
    /// first signal in `node`.
    pub(crate) fn taker_of(&self, node: NodeId) -> Option<&str> {
        let signals = self.signals.iter().map(|signal| {
            let reset = match &signal.role {
                Role::Register(Register { reset: Some((condition, _)), .. }) => Some(*condition),
                _ => None,
            };
            (signal.name.as_str(), signal.value.into_iter().chain(reset).collect())
        });
        let memories = self.memories.iter().map(|memory| {
            let roots = memory.writes.iter().flat_map(|write| [write.enable, write.address, write.data]);
            (memory.name.as_str(), roots.collect())
        });
        let mut values = signals.chain(memories);
        let taker = values.find(|(_, roots): &(_, Vec<NodeId>)| self.within(roots).any(|inner| inner == node));
        taker.map(|(name, _)| name).or_else(|| {
            self.within(&[node]).find_map(|inner| match self.nodes[inner].0 {
                Node::Signal(signal) => Some(self.signals[signal].name.as_str()),
                _ => None,
            })
        })
    }

    /// The nodes of these expressions, down to the signals that they read.
    fn within(&self, roots: &[NodeId]) -> impl Iterator<Item = NodeId> + '_ {
        let (mut open, mut seen) = (roots.to_vec(), vec![false; self.nodes.len()]);
        std::iter::from_fn(move || loop {
            let node = open.pop()?;
            if !std::mem::replace(&mut seen[node], true) {
                open.extend(self.nodes[node].0.operands());
                return Some(node);
            }
        })
    }

    /// Names of the outputs of instances that nothing reads, and that are not said to be unused.
    pub(crate) fn unread(&self) -> Vec<&str> {
        let values: Vec<NodeId> = self.signals.iter().filter_map(|signal| signal.value).collect();
        let roots = [&values[..], &self.edge_roots(), &self.unused].concat();
        let read: BTreeSet<SignalId> = self
            .within(&roots)
            .filter_map(|node| match self.nodes[node].0 {
                Node::Signal(id) => Some(id),
                _ => None,
            })
            .collect();
        let outputs = self.signals.iter().enumerate().filter(|(_, signal)| signal.role == Role::Instance);
        outputs.filter(|(id, _)| !read.contains(id)).map(|(_, signal)| signal.name.as_str()).collect()
    }

    /// Its ports, the clock first: name, whether it is an output, width in bits, meaning.
    pub(crate) fn port_list(&self) -> impl Iterator<Item = (&str, bool, usize, &str)> {
        let clock = self.clock.iter().map(|clock| (clock.as_str(), false, 1, CLOCK));
        clock.chain(self.ports.iter().map(|port| (port.name.as_str(), port.output, port.bits, port.doc.as_str())))
    }

    /// Whether its outputs are inputs, parts of them and constants alone: no register, memory, instance or operator.
    #[cfg(test)]
    pub(crate) fn is_wires(&self) -> bool {
        let is_logic = |node: &Node| matches!(node, Node::Unary(..) | Node::Binary(..) | Node::Mux(..));
        let values: Vec<NodeId> = self.signals.iter().filter_map(|signal| signal.value).collect();
        let logic = self.within(&values).any(|node| is_logic(&self.nodes[node].0));
        !logic && self.registers().next().is_none() && self.memories.is_empty() && self.instances.is_empty()
    }

    /// Width in bits of the signal of this name.
    pub(crate) fn width_of(&self, name: &str) -> Option<usize> {
        self.signal_of(name).map(|id| self.signals[id].ty.bits)
    }

    pub(crate) fn signal_of(&self, name: &str) -> Option<SignalId> {
        self.signals.iter().position(|signal| signal.name == name)
    }

    /// The registers in the order of their declaration.
    pub(crate) fn registers(&self) -> impl Iterator<Item = (SignalId, &Signal, &Register)> {
        self.signals.iter().enumerate().filter_map(|(id, signal)| match &signal.role {
            Role::Register(register) => Some((id, signal, register)),
            _ => None,
        })
    }

    /// Nodes that state elements take at a clock edge: next values, resets, memory writes.
    pub(crate) fn edge_roots(&self) -> Vec<NodeId> {
        let registers = self.registers().flat_map(|(_, signal, register)| {
            signal.value.into_iter().chain(register.reset.map(|(condition, _)| condition))
        });
        let writes = self.memories.iter().flat_map(|memory| &memory.writes);
        registers.chain(writes.flat_map(|write| [write.enable, write.address, write.data])).collect()
    }

    /// Nodes that outputs show: values of combinational outputs.
    pub(crate) fn output_roots(&self) -> Vec<NodeId> {
        let outputs = self.signals.iter().filter(|signal| signal.output);
        outputs.filter(|signal| matches!(signal.role, Role::Wire { .. })).filter_map(|signal| signal.value).collect()
    }

    /// The nodes that `roots` depend on, every operand before its reader; registers and inputs end a path.
    ///
    /// # Errors
    /// The wires of a combinational loop.
    pub(crate) fn order(&self, roots: &[NodeId]) -> Result<Vec<NodeId>, Vec<SignalId>> {
        #[derive(Clone, Copy, PartialEq)]
        enum Mark {
            New,
            Open,
            Done,
        }
        let mut marks = vec![Mark::New; self.nodes.len()];
        let mut ordered = Vec::new();
        for &root in roots {
            // A stack instead of recursion: chains of blocks can be long.
            let mut stack = vec![(root, false)];
            while let Some((node, leaves)) = stack.pop() {
                if leaves {
                    marks[node] = Mark::Done;
                    ordered.push(node);
                    continue;
                }
                if marks[node] != Mark::New {
                    continue;
                }
                marks[node] = Mark::Open;
                stack.push((node, true));
                for operand in self.sources(node) {
                    match marks[operand] {
                        Mark::New => stack.push((operand, false)),
                        Mark::Open => {
                            let path = stack.iter().filter(|(_, leaves)| *leaves).map(|(node, _)| *node);
                            return Err(self.wires_of(path.skip_while(|node| *node != operand)));
                        }
                        Mark::Done => {}
                    }
                }
            }
        }
        Ok(ordered)
    }

    /// The nodes whose value decides that of `node` in the same cycle.
    fn sources(&self, node: NodeId) -> Vec<NodeId> {
        match &self.nodes[node].0 {
            Node::Signal(signal) => match self.signals[*signal].role {
                Role::Wire { .. } => self.signals[*signal].value.into_iter().collect(),
                _ => Vec::new(),
            },
            other => other.operands(),
        }
    }

    fn wires_of(&self, nodes: impl Iterator<Item = NodeId>) -> Vec<SignalId> {
        nodes
            .filter_map(|node| match self.nodes[node].0 {
                Node::Signal(signal) => Some(signal),
                _ => None,
            })
            .collect()
    }
}
