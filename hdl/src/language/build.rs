//! Construction of a kernel: ports, wires, registers, memories, conditions.

use std::cell::{Cell, RefCell};
use std::sync::Arc;

use super::error::KernelError;
use super::expression::Expr;
use super::kernel::{
    Contents, Domain, Instance, Item, Kernel, Memory, MemoryId, Node, NodeId, Port, Register, Role, Signal, SignalId,
    Type, Write, SEPARATOR,
};
use super::keywords::is_keyword;

/// The port that resets a block.
const RESET: &str = "rst";

/// Builds a [`Kernel`]. Its expressions borrow it, so that Rust's operators, loops and functions compose them.
#[derive(Debug, Default)]
pub struct Builder {
    pub(crate) kernel: RefCell<Kernel>,
    /// Condition of the assignments made now, innermost last.
    conditions: RefCell<Vec<NodeId>>,
    scope: RefCell<String>,
    /// Domain of the registers declared now.
    domain: Cell<Option<usize>>,
    /// What resets the instances in place of the input `rst`.
    instance_reset: Cell<Option<NodeId>>,
}

/// A declared signal, which is assigned with [`Net::set`].
#[derive(Clone, Copy, Debug)]
pub struct Net<'k> {
    builder: &'k Builder,
    /// None of the input of an instance that is left out.
    signal: Option<SignalId>,
    value: Expr<'k>,
}

impl<'k> std::ops::Deref for Net<'k> {
    type Target = Expr<'k>;

    fn deref(&self) -> &Expr<'k> {
        &self.value
    }
}

/// A memory under construction.
#[derive(Clone, Copy, Debug)]
pub struct MemoryPort<'k> {
    builder: &'k Builder,
    memory: MemoryId,
    bits: usize,
}

impl Builder {
    /// A kernel for the block of this name whose registers change at the rising edge of port `clk`.
    pub fn new(block: &str) -> Self {
        Builder::combinational(block).clocked("clk")
    }

    /// A kernel without clock.
    pub fn combinational(block: &str) -> Self {
        let kernel = Kernel { block: block.to_owned(), ..Kernel::default() };
        Builder { kernel: RefCell::new(kernel), ..Builder::default() }
    }

    /// With the clock port of this name.
    pub fn clocked(self, clock: &str) -> Self {
        self.kernel.borrow_mut().clock = Some(clock.to_owned());
        self
    }

    /// An input port, unsigned, of `bits` bits.
    pub fn input(&self, name: &str, bits: usize) -> Expr<'_> {
        *self.declare(name, Type::unsigned(bits), Role::Input)
    }

    /// Says that nothing reads these signals, on purpose: outputs of instances that nothing reads are otherwise an error.
    pub fn unused<'k>(&'k self, signals: impl IntoIterator<Item = Expr<'k>>) {
        // First all signals: an iterator may look them up in the kernel.
        let ids: Vec<NodeId> = signals.into_iter().map(|signal| signal.id).collect();
        self.kernel.borrow_mut().unused.extend(ids);
    }

    /// Declares a port; its number.
    pub(super) fn port(&self, port: Port) -> usize {
        let ports = &mut self.kernel.borrow_mut().ports;
        ports.push(port);
        ports.len() - 1
    }

    /// The name of the port of this number.
    pub(super) fn port_name(&self, port: usize) -> String {
        self.kernel.borrow().ports[port].name.clone()
    }

    /// What takes no value, and is 0.
    pub(super) fn left_out(&self) -> Net<'_> {
        Net { builder: self, signal: None, value: self.constant(1, 0) }
    }

    /// A signal that drives an input of an instance; one that is left out takes no value.
    pub(super) fn instance_input(&self, name: &str, bits: usize) -> Net<'_> {
        match bits {
            0 => self.left_out(),
            bits => self.net(name, Type::unsigned(bits)),
        }
    }

    /// A signal that an instance drives; 0 for an output that is left out.
    pub(super) fn instance_output(&self, name: &str, bits: usize) -> Expr<'_> {
        if bits == 0 {
            return self.constant(1, 0);
        }
        *self.declare(name, Type::unsigned(bits), Role::Instance)
    }

    /// Adds the instance `name` of a block; its ports are signals of this kernel.
    pub(super) fn place(&self, name: &str, kernel: Arc<Kernel>) {
        if is_keyword(name) {
            let (block, signal) = (self.block(), name.to_owned());
            self.fail(KernelError::Name { block, signal, reason: "a keyword of Verilog" });
        }
        let name = format!("{}{name}", self.scope.borrow());
        self.kernel.borrow_mut().instances.push(Instance { name, kernel });
    }

    /// Every instance whose reset is not assigned is reset by `reset`, of one bit, in place of the input `rst`.
    pub fn reset_instances(&self, reset: Expr<'_>) {
        if reset.bits() != 1 {
            reset.width_error(format!("a reset of {} bits", reset.bits()));
        }
        self.instance_reset.set(Some(reset.id));
    }

    /// The input `rst`, if there is one.
    fn reset_input(&self) -> Option<NodeId> {
        let kernel = self.kernel.borrow();
        let rst = kernel.signal_of(RESET).filter(|&id| kernel.signals[id].role == Role::Input)?;
        Some(kernel.interned[&(Node::Signal(rst), kernel.signals[rst].ty)])
    }

    /// Connects the reset of every instance whose reset is not assigned.
    fn connect_resets(&self) {
        let Some(node) = self.instance_reset.get().or_else(|| self.reset_input()) else { return };
        let resets: Vec<(SignalId, NodeId)> = {
            let kernel = self.kernel.borrow();
            let names = kernel.instances.iter().map(|instance| format!("{}{SEPARATOR}{RESET}", instance.name));
            let open = names.filter_map(|name| kernel.signal_of(&name));
            let driven = |id: SignalId| kernel.signals[id].role.is_driven_outside();
            open.filter(|&id| kernel.signals[id].value.is_none() && !driven(id)).map(|id| (id, node)).collect()
        };
        let mut kernel = self.kernel.borrow_mut();
        for (id, node) in resets {
            kernel.signals[id].value = Some(node);
            kernel.items.push(Item::Wire(id));
        }
    }

    /// Runs `body` without the prefixes of the scopes around it.
    pub(super) fn unscoped<R>(&self, body: impl FnOnce() -> R) -> R {
        let outer = self.scope.take();
        let result = body();
        *self.scope.borrow_mut() = outer;
        result
    }

    /// A combinational signal with a value. A driven port is a signal of the port's name.
    pub fn wire<'k>(&'k self, name: &str, value: Expr<'k>) -> Expr<'k> {
        let net = self.declare(name, value.ty(), Role::Wire { declared: false });
        self.kernel.borrow_mut().items.extend(net.signal.map(Item::Wire));
        net.set(value);
        *net
    }

    /// A combinational signal that is assigned later.
    pub fn net(&self, name: &str, ty: Type) -> Net<'_> {
        self.declare(name, ty, Role::Wire { declared: true })
    }

    /// A register without reset; before its first assignment its value is undefined in hardware, 0 in the simulation.
    pub fn register(&self, name: &str, ty: Type) -> Net<'_> {
        self.declare(name, ty, Role::Register(Register { domain: self.domain.get(), ..Register::default() }))
    }

    /// `value` one cycle later: a register without reset that takes it at every clock edge.
    pub fn delay<'k>(&'k self, name: &str, value: Expr<'k>) -> Expr<'k> {
        let register = self.register(name, value.ty());
        register.set(value);
        *register
    }

    /// A register that takes `value` at the clock edge while `reset` is 1; in a domain of its own, at once.
    pub fn state<'k>(&'k self, name: &str, ty: Type, reset: Expr<'k>, value: u64) -> Net<'k> {
        let (condition, domain) = (reset.id, self.domain.get());
        if domain.is_some() {
            self.input_of(condition, "an asynchronous reset");
        } else if reset.bits() != 1 {
            reset.width_error(format!("a reset of {} bits", reset.bits()));
        }
        self.declare(
            name,
            ty,
            Role::Register(Register { reset: Some((condition, value)), domain, ..Register::default() }),
        )
    }

    /// Declares the registers of `body` in a domain of their own: they change at the rising edge of input `clock`.
    pub fn rising<'k, R>(&'k self, clock: Expr<'k>, body: impl FnOnce() -> R) -> R {
        self.domain(clock, false, body)
    }

    /// As [`Builder::rising`], at the falling edge.
    pub fn falling<'k, R>(&'k self, clock: Expr<'k>, body: impl FnOnce() -> R) -> R {
        self.domain(clock, true, body)
    }

    fn domain<'k, R>(&'k self, clock: Expr<'k>, falling: bool, body: impl FnOnce() -> R) -> R {
        let outer = self.domain.get();
        if let Some(clock) = self.input_of(clock.id, "a clock") {
            let domains = &mut self.kernel.borrow_mut().domains;
            domains.push(Domain { clock, falling });
            self.domain.set(Some(domains.len() - 1));
        }
        let result = body();
        self.domain.set(outer);
        result
    }

    /// The input of one bit that the node is; otherwise an error.
    fn input_of(&self, id: NodeId, what: &str) -> Option<SignalId> {
        let input = {
            let kernel = self.kernel.borrow();
            match kernel.nodes[id] {
                (Node::Signal(signal), Type { bits: 1, .. }) if kernel.signals[signal].role == Role::Input => {
                    Some(signal)
                }
                _ => None,
            }
        };
        if input.is_none() {
            self.expression(id).width_error(format!("{what} is an input of one bit"));
        }
        input
    }

    /// A memory of `words` words of `bits` bits.
    pub fn memory(&self, name: &str, words: usize, bits: usize, contents: Contents) -> MemoryPort<'_> {
        let name = self.check_name(name);
        let mut kernel = self.kernel.borrow_mut();
        kernel.memories.push(Memory {
            name,
            words,
            bits,
            contents,
            style: None,
            unchecked: false,
            label: None,
            writes: Vec::new(),
        });
        MemoryPort { builder: self, memory: kernel.memories.len() - 1, bits }
    }

    /// A comment line before what is defined next.
    pub fn comment(&self, text: &str) {
        self.kernel.borrow_mut().items.push(Item::Comment(text.to_owned()));
    }

    /// An unsigned constant of `bits` bits.
    pub fn constant(&self, bits: usize, value: u64) -> Expr<'_> {
        Expr::constant_of(&self.kernel, bits, value)
    }

    /// A two's complement constant of `bits` bits, at most 64.
    pub fn signed_constant(&self, bits: usize, value: i64) -> Expr<'_> {
        let shift = 64 - bits.min(64);
        let constant = self.constant(bits, (value as u64) << shift >> shift).signed();
        if value << shift >> shift != value {
            constant.width_error(format!("{value} needs more bits"));
        }
        constant
    }

    /// Makes the assignments of `body` under `condition`; outside, and where it is 0, registers keep what they have.
    pub fn when<'k>(&'k self, condition: Expr<'k>, body: impl FnOnce()) {
        let mut all = condition;
        if let Some(&outer) = self.conditions.borrow().last() {
            all = self.expression(outer) & all;
        }
        self.conditions.borrow_mut().push(all.id);
        body();
        self.conditions.borrow_mut().pop();
    }

    /// Puts `prefix` and two underscores before the names that `body` declares.
    pub fn scope<R>(&self, prefix: &str, body: impl FnOnce() -> R) -> R {
        let outer = self.scope.borrow().clone();
        *self.scope.borrow_mut() = format!("{outer}{prefix}__");
        let result = body();
        *self.scope.borrow_mut() = outer;
        result
    }

    /// Over a finished kernel, to build expressions of what it has.
    pub(super) fn over(kernel: Kernel) -> Self {
        Builder { kernel: RefCell::new(kernel), ..Builder::default() }
    }

    /// The signal of this name, in a [`Change`](super::Change) of a finished kernel.
    pub fn named(&self, name: &str) -> Expr<'_> {
        let found = {
            let kernel = self.kernel.borrow();
            kernel.signal_of(name).map(|id| (Node::Signal(id), kernel.signals[id].ty))
        };
        match found {
            Some((node, ty)) => self.node(node, ty),
            None => {
                self.unknown(name);
                self.constant(1, 0)
            }
        }
    }

    /// The memory of this name, in a [`Change`](super::Change) of a finished kernel.
    pub fn array(&self, name: &str) -> MemoryPort<'_> {
        let found = {
            let kernel = self.kernel.borrow();
            kernel.memories.iter().position(|memory| memory.name == name).map(|at| (at, kernel.memories[at].bits))
        };
        match found {
            Some((memory, bits)) => MemoryPort { builder: self, memory, bits },
            None => {
                self.unknown(name);
                self.memory(name, 1, 1, Contents::Undefined)
            }
        }
    }

    fn unknown(&self, name: &str) {
        let (block, signal) = (self.block(), name.to_owned());
        self.fail(KernelError::Change { block, signal, reason: "is neither signal nor memory of it" });
    }

    /// The kernel; its [`Kernel::errors`] list what is wrong with it.
    pub fn finish(self) -> Kernel {
        self.connect_resets();
        let mut kernel = self.kernel.into_inner();
        for Port { name, bits, output, .. } in kernel.ports.clone() {
            kernel.bind(&name, bits, output);
        }
        kernel.check();
        kernel.check_reads();
        kernel
    }

    pub(crate) fn node(&self, node: Node, ty: Type) -> Expr<'_> {
        Expr::of(&self.kernel, node, ty)
    }

    pub(crate) fn fail(&self, error: KernelError) {
        self.kernel.borrow_mut().fail(error);
    }

    pub(crate) fn block(&self) -> String {
        self.kernel.borrow().block.clone()
    }

    fn expression(&self, id: NodeId) -> Expr<'_> {
        Expr { kernel: &self.kernel, id }
    }

    fn check_name(&self, name: &str) -> String {
        let name = format!("{}{name}", self.scope.borrow());
        let kernel = self.kernel.borrow();
        let taken = kernel.signal_of(&name).is_some() || kernel.memories.iter().any(|memory| memory.name == name);
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let reason = match taken || kernel.clock.as_deref() == Some(&name) {
            true => Some("the name is used twice"),
            false if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(plain) => {
                Some("not a Verilog identifier")
            }
            false if is_keyword(&name) => Some("a keyword of Verilog"),
            false => None,
        };
        let block = kernel.block.clone();
        drop(kernel);
        if let Some(reason) = reason {
            self.fail(KernelError::Name { block, signal: name.clone(), reason });
        }
        name
    }

    fn declare(&self, name: &str, ty: Type, role: Role) -> Net<'_> {
        let name = self.check_name(name);
        let mut kernel = self.kernel.borrow_mut();
        kernel.signals.push(Signal {
            name,
            ty,
            role,
            value: None,
            guards: Vec::new(),
            comment: None,
            output: false,
            states: &[],
        });
        let signal = kernel.signals.len() - 1;
        let id = kernel.intern(Node::Signal(signal), ty);
        Net { builder: self, signal: Some(signal), value: Expr { kernel: &self.kernel, id } }
    }
}

impl<'k> Net<'k> {
    /// Assigns `value` under the conditions of the enclosing [`Builder::when`]. A later assignment has priority over an
    /// earlier one of another condition. A narrower value is extended.
    pub fn set(&self, value: Expr<'k>) {
        let Some(target) = self.signal else { return };
        let value = value.assigned_to(target);
        let guard = self.builder.conditions.borrow().last().copied();
        let (before, twice, is_wire) = {
            let kernel = self.builder.kernel.borrow();
            let signal = &kernel.signals[target];
            let is_wire = matches!(signal.role, Role::Wire { .. });
            (signal.value, signal.guards.contains(&guard) || (guard.is_none() && !signal.guards.is_empty()), is_wire)
        };
        if twice {
            let signal = self.name();
            let expression = value.to_string();
            return self.builder.fail(KernelError::AssignedTwice { block: self.builder.block(), signal, expression });
        }
        let next = match guard {
            None => value,
            // A wire keeps nothing: it needs a value before the condition.
            Some(_) if is_wire && before.is_none() => {
                return self.builder.fail(KernelError::Unassigned { block: self.builder.block(), signal: self.name() })
            }
            Some(condition) => {
                let otherwise = before.unwrap_or(self.value.id);
                let at = |id| self.builder.expression(id);
                at(condition).mux(value, at(otherwise))
            }
        };
        let mut kernel = self.builder.kernel.borrow_mut();
        let signal = &mut kernel.signals[target];
        signal.value = Some(next.id);
        signal.guards.push(guard);
        if is_wire && !kernel.items.contains(&Item::Wire(target)) {
            kernel.items.push(Item::Wire(target));
        }
    }

    /// The current value.
    pub fn get(&self) -> Expr<'k> {
        self.value
    }

    /// With a comment at its declaration.
    pub fn comment(self, text: &str) -> Self {
        if let Some(signal) = self.signal {
            self.builder.kernel.borrow_mut().signals[signal].comment = Some(text.to_owned());
        }
        self
    }

    /// With names of its states, by their numbers.
    pub(super) fn named_states(self, states: &'static [&'static str]) -> Self {
        if let Some(signal) = self.signal {
            self.builder.kernel.borrow_mut().signals[signal].states = states;
        }
        self
    }

    /// With the attribute `keep`: synthesis must neither merge nor remove the register.
    pub fn keep(self) -> Self {
        self.register(|register| register.keep = true)
    }

    /// With an initial value.
    pub fn initially(self, value: u64) -> Self {
        self.register(|register| register.initial = Some(value))
    }

    fn register(self, change: impl FnOnce(&mut Register)) -> Self {
        if let Some(signal) = self.signal
            && let Role::Register(register) = &mut self.builder.kernel.borrow_mut().signals[signal].role
        {
            change(register);
        }
        self
    }

    fn name(&self) -> String {
        let kernel = self.builder.kernel.borrow();
        self.signal.map(|signal| kernel.signals[signal].name.clone()).unwrap_or_default()
    }
}

impl<'k> MemoryPort<'k> {
    /// The word at `address`, asynchronous; 0 in the simulation at an address beyond the memory.
    pub fn read(&self, address: Expr<'k>) -> Expr<'k> {
        let node = Node::Read { memory: self.memory, address: address.unsigned().id };
        self.builder.node(node, Type::unsigned(self.bits))
    }

    /// Writes `data` to `address` at the clock edge if `enable` is 1.
    pub fn write(&self, enable: Expr<'k>, address: Expr<'k>, data: Expr<'k>) {
        if data.ty().bits != self.bits {
            data.width_error(format!("a word of the memory has {} bits", self.bits));
        }
        self.write_part(enable, address, 0, data);
    }

    /// Writes `data` to the bits from `low` on of the word at `address` at the clock edge if `enable` is 1. The others keep
    /// their values.
    pub fn write_part(&self, enable: Expr<'k>, address: Expr<'k>, low: usize, data: Expr<'k>) {
        if low + data.ty().bits > self.bits {
            data.width_error(format!("bit {low} and following of a word of {} bits", self.bits));
        }
        if enable.bits() != 1 {
            enable.width_error(format!("a write enable of {} bits", enable.bits()));
        }
        let write = Write { enable: enable.id, address: address.id, data: data.id, low };
        self.builder.kernel.borrow_mut().memories[self.memory].writes.push(write);
    }

    /// With this value of the attribute `ram_style`.
    pub fn style(self, style: &str) -> Self {
        self.builder.kernel.borrow_mut().memories[self.memory].style = Some(style.to_owned());
        self
    }

    /// With a label, by which a plan of the memories refers to it.
    pub fn holds(self, label: impl std::fmt::Display) -> Self {
        self.builder.kernel.borrow_mut().memories[self.memory].label = Some(label.to_string());
        self
    }

    /// With the attribute `no_rw_check`: what is read in the cycle of a write to the same address is not used.
    pub fn unchecked(self) -> Self {
        self.builder.kernel.borrow_mut().memories[self.memory].unchecked = true;
        self
    }
}

impl Kernel {
    /// Makes the signal `port` a port.
    pub(super) fn bind(&mut self, port: &str, bits: usize, is_output: bool) {
        let found = match self.signal_of(port).map(|id| &mut self.signals[id]) {
            None => "the kernel has no such signal".to_owned(),
            Some(signal) if signal.ty.bits != bits => format!("the kernel's signal has {} bits", signal.ty.bits),
            Some(signal) if (signal.role == Role::Input) == is_output => {
                "the kernel's signal has another direction".to_owned()
            }
            Some(signal) => {
                signal.output = is_output;
                return;
            }
        };
        self.errors.push(KernelError::Port { block: self.block.clone(), port: port.to_owned(), bits, found });
    }
}
