//! Prints a kernel as the body of a Verilog-2001 module.
//!
//! All signals are unsigned vectors; a signed product, comparison or shift says `$signed` itself. Every operand is
//! printed with the width of its operator, so that Verilog's rules for widths and signs of a context change nothing.
//! What is combinational is assigned continuously: a process that computes a constant would wait forever for its trigger
//! in an event-driven simulator.

use std::collections::{BTreeMap, BTreeSet};

use super::kernel::{Contents, Domain, Item, Kernel, Memory, Node, NodeId, Role, Signal, SignalId, Type};
use super::states::shown;
use super::text::{number, Text};

struct Printer<'a> {
    kernel: &'a Kernel,
    /// The kind of RAM of memories, in place of the kernel's own; none of any where it is `None`.
    styles: Option<&'a BTreeMap<String, String>>,
    /// What stands before the names of memory files.
    prefix: &'a str,
    expressions: Text<'a>,
    /// Nodes to which such a wire has been printed.
    printed: BTreeSet<NodeId>,
    text: String,
}

impl Kernel {
    /// The module's body.
    pub fn verilog(&self) -> String {
        self.verilog_with(Some(&BTreeMap::new()), "")
    }

    /// The module's body, with these values of `ram_style` by the memory's name in place of the kernel's own, or without any, and with
    /// `prefix` before the names of memory files.
    pub(super) fn verilog_with(&self, styles: Option<&BTreeMap<String, String>>, prefix: &str) -> String {
        let (expressions, printed) = (Text::new(self), BTreeSet::new());
        let mut printer = Printer { kernel: self, styles, prefix, expressions, printed, text: String::new() };
        printer.body();
        printer.text.truncate(printer.text.trim_end().len());
        printer.text
    }

    /// The text of `$readmemh` and its file for every memory with contents.
    pub fn memory_files(&self) -> Vec<(String, String)> {
        let files = self.memories.iter().filter_map(|memory| match &memory.contents {
            Contents::File { name, words } => Some((name.clone(), memory_text(memory.bits, words))),
            Contents::Words(_) | Contents::Undefined => None,
        });
        files.collect()
    }
}

/// The text of a memory file: one word per line, hexadecimal, with all digits.
fn memory_text(bits: usize, words: &[Vec<u64>]) -> String {
    let digits = bits.div_ceil(4);
    let line = |word: &Vec<u64>| {
        let all: String = word.iter().rev().map(|limb| format!("{limb:016x}")).collect();
        format!("{}\n", &all[all.len() - digits..])
    };
    words.iter().map(line).collect()
}

/// `[high:0] ` of a declaration, nothing for one bit.
pub(super) fn range(bits: usize) -> String {
    if bits == 1 {
        String::new()
    } else {
        format!("[{}:0] ", bits - 1)
    }
}

impl Printer<'_> {
    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn body(&mut self) {
        let kernel = self.kernel;
        for memory in &kernel.memories {
            self.declare_memory(memory);
        }
        for signal in &kernel.signals {
            self.declare(signal);
        }
        let unread = self.unused();
        for item in &kernel.items {
            match item {
                Item::Comment(text) => self.line(&format!("// {text}")),
                Item::Wire(signal) => self.wire(*signal),
            }
        }
        for root in kernel.edge_roots() {
            self.own_wires(root);
        }
        if let Some(clock) = &kernel.clock {
            self.clocked(&format!("posedge {clock}"), None);
        }
        for (index, Domain { clock, falling }) in kernel.domains.iter().enumerate() {
            let edge = if *falling { "negedge" } else { "posedge" };
            self.clocked(&format!("{edge} {}", kernel.signals[*clock].name), Some(index));
        }
        if !unread.is_empty() {
            self.line(&format!("wire unused_signals = &{{1'b0, {}}};", unread.join(", ")));
        }
    }

    fn declare_memory(&mut self, memory: &Memory) {
        let Memory { name, words, bits, .. } = memory;
        let unchecked = memory.unchecked.then(|| "no_rw_check".to_owned());
        let style = self.styles.and_then(|styles| styles.get(name).or(memory.style.as_ref()));
        // Vivado has a name of its own for memories that nothing writes; Yosys takes either.
        let kind = if memory.is_written() { "ram_style" } else { "rom_style" };
        let style = style.map(|style| format!("{kind} = \"{style}\""));
        let attributes: Vec<String> = unchecked.into_iter().chain(style).collect();
        if !attributes.is_empty() {
            self.line(&format!("(* {} *)", attributes.join(", ")));
        }
        self.line(&format!("reg [{}:0] {name} [0:{}];", bits - 1, words - 1));
        match &memory.contents {
            Contents::File { name: file, .. } => {
                self.line(&format!("initial $readmemh(\"{}{file}\", {name});", self.prefix));
            }
            Contents::Words(words) => {
                self.line("initial begin");
                for (address, word) in words {
                    self.line(&format!("  {name}[{address}] = {};", number(*bits, &[*word])));
                }
                self.line("end");
            }
            Contents::Undefined => {}
        }
    }

    fn declare(&mut self, signal: &Signal) {
        if let (Some(comment), false) = (&signal.comment, signal.role.is_driven_outside()) {
            self.line(&format!("// {comment}"));
        }
        let Signal { name, ty, .. } = signal;
        match &signal.role {
            Role::Register(register) => {
                if !signal.output {
                    self.line(&format!("reg {}{name};", range(ty.bits)));
                }
                if let Some(value) = register.initial {
                    self.line(&format!("initial {name} = {};", number(ty.bits, &[value])));
                }
                if !signal.states.is_empty() {
                    shown(name, ty.bits, signal.states).iter().for_each(|line| self.line(line));
                }
            }
            Role::Wire { declared: true } if !signal.output => self.line(&format!("wire {}{name};", range(ty.bits))),
            Role::Instance => self.line(&format!("wire {}{name};", range(ty.bits))),
            Role::Wire { .. } | Role::Input => {}
        }
    }

    /// Reads the inputs that no expression reads, so that a linter does not warn; returns the unread wires and
    /// registers.
    fn unused(&mut self) -> Vec<String> {
        let kernel = self.kernel;
        let values = kernel.signals.iter().filter_map(|signal| signal.value).collect();
        let order = kernel.order(&[values, kernel.edge_roots()].concat()).unwrap_or_default();
        let mut read: BTreeMap<NodeId, Vec<bool>> = BTreeMap::new();
        let mut mark = |node: NodeId, low: usize, bits: usize| {
            let node = kernel.bare(node);
            read.entry(node).or_insert_with(|| vec![false; kernel.ty(node).bits])[low..low + bits].fill(true);
        };
        for &node in &order {
            match &kernel.nodes[node].0 {
                Node::Slice(a, low) => mark(*a, *low, kernel.ty(node).bits),
                other => other.operands().into_iter().for_each(|operand| mark(operand, 0, kernel.ty(operand).bits)),
            }
        }
        for domain in &kernel.domains {
            mark(kernel.interned[&(Node::Signal(domain.clock), Type::unsigned(1))], 0, 1);
        }
        for root in kernel.signals.iter().filter_map(|signal| signal.value).chain(kernel.edge_roots()) {
            mark(root, 0, kernel.ty(root).bits);
        }
        let unread = |node: NodeId| !read.get(&node).is_some_and(|bits| bits.iter().all(|bit| *bit));
        let own_node = |id: SignalId| kernel.interned[&(Node::Signal(id), kernel.signals[id].ty)];
        let inside = kernel.instance_inputs();
        let is_read = |id: SignalId| kernel.signals[id].output || inside.contains(&kernel.signals[id].name);
        let signals = (0..kernel.signals.len()).filter(|&id| !is_read(id) && unread(own_node(id)));
        let (inputs, signals): (Vec<SignalId>, Vec<SignalId>) =
            signals.partition(|&id| kernel.signals[id].role.is_driven_outside());
        let names = |ids: Vec<SignalId>| ids.into_iter().map(|id| kernel.signals[id].name.clone());
        let has_edge = kernel.registers().any(|(_, _, register)| register.domain.is_none())
            || kernel.memories.iter().any(|m| !m.writes.is_empty())
            || kernel.instances.iter().any(|instance| instance.kernel.clock.is_some());
        let clock = kernel.clock.iter().filter(|_| !has_edge).cloned();
        let inputs: Vec<String> = clock.chain(names(inputs)).collect();
        if !inputs.is_empty() {
            self.line(&format!("wire unused = &{{1'b0, {}}};", inputs.join(", ")));
        }
        let own = self
            .expressions
            .names
            .iter()
            .filter(|&(&node, _)| kernel.bare(node) == node && unread(node))
            .map(|(_, name)| name.clone());
        names(signals).chain(own).collect()
    }

    /// The wires of the unnamed nodes that `node` reads, itself included.
    fn own_wires(&mut self, node: NodeId) {
        for operand in self.kernel.nodes[node].0.operands() {
            self.own_wires(operand);
        }
        let Some(name) = self.expressions.names.get(&node).cloned() else { return };
        if self.printed.insert(node) {
            let value = self.expressions.form(node).0;
            self.line(&format!("wire {}{name} = {value};", range(self.kernel.ty(node).bits)));
        }
    }

    fn wire(&mut self, id: SignalId) {
        let kernel = self.kernel;
        let signal = &kernel.signals[id];
        let Some(value) = signal.value else { return };
        self.own_wires(value);
        let text = self.expressions.root(value);
        let Signal { name, ty, .. } = signal;
        match (signal.output, &signal.role) {
            (true, _) | (_, Role::Wire { declared: true }) => self.line(&format!("assign {name} = {text};")),
            _ => self.line(&format!("wire {}{name} = {text};", range(ty.bits))),
        }
    }

    /// The registers that change at this edge; the memories are in the domain of the block's clock port.
    fn clocked(&mut self, edge: &str, domain: Option<usize>) {
        let kernel = self.kernel;
        let mut free: [Vec<String>; 2] = Default::default();
        let mut reset: BTreeMap<NodeId, [Vec<String>; 2]> = BTreeMap::new();
        for memory in kernel.memories.iter().filter(|_| domain.is_none()) {
            for write in &memory.writes {
                let bits = kernel.ty(write.data).bits;
                let part = match bits == memory.bits {
                    true => String::new(),
                    false => format!("[{}:{}]", write.low + bits - 1, write.low),
                };
                let [address, data] = [write.address, write.data].map(|node| self.expressions.root(node));
                let assign = format!("{}[{address}]{part} <= {data};", memory.name);
                free[0].push(format!("if ({}) {assign}", self.expressions.root(write.enable)));
            }
        }
        for (id, signal, register) in kernel.registers().filter(|(_, _, register)| register.domain == domain) {
            let Some(next) = signal.value else { continue };
            let own = kernel.interned[&(Node::Signal(id), signal.ty)];
            let mut lines = Vec::new();
            self.transition(&signal.name, own, next, "", &mut lines);
            match register.reset {
                None => free[usize::from(register.keep)].extend(lines),
                Some((condition, value)) => {
                    let [under, after] = reset.entry(condition).or_default();
                    under.push(format!("{} <= {};", signal.name, number(signal.ty.bits, &[value])));
                    after.extend(lines);
                }
            }
        }
        let [plain, kept] = free;
        for (lines, attribute) in [(plain, ""), (kept, "(* keep *) ")] {
            if !lines.is_empty() {
                self.line(&format!("{attribute}always @({edge}) begin"));
                lines.iter().for_each(|line| self.line(&format!("  {line}")));
                self.line("end");
            }
        }
        for (condition, [under, after]) in reset {
            let condition = self.expressions.root(condition);
            let at_once = domain.map(|_| format!(" or posedge {condition}")).unwrap_or_default();
            self.line(&format!("always @({edge}{at_once}) begin\n  if ({condition}) begin"));
            under.iter().for_each(|line| self.line(&format!("    {line}")));
            self.line("  end else begin");
            after.iter().for_each(|line| self.line(&format!("    {line}")));
            self.line("  end\nend");
        }
    }

    /// The statements by which the register `own` takes `next`: conditions where it keeps its value in one branch.
    fn transition(&self, name: &str, own: NodeId, next: NodeId, indent: &str, lines: &mut Vec<String>) {
        if next == own {
            return;
        }
        let mux = match self.kernel.nodes[next].0 {
            Node::Mux(c, a, b) if self.keeps(next, own) && !self.expressions.names.contains_key(&next) => {
                Some((c, a, b))
            }
            _ => None,
        };
        let Some((c, a, b)) = mux else {
            lines.push(format!("{indent}{name} <= {};", self.expressions.root(next)));
            return;
        };
        let (condition, then, otherwise) = match a == own {
            true => (self.expressions.negated(c), b, own),
            false => (self.expressions.root(c), a, b),
        };
        let single = |node: NodeId| !matches!(self.kernel.nodes[node].0, Node::Mux(..)) || !self.keeps(node, own);
        let before = lines.len();
        match single(then) {
            true => lines.push(format!("{indent}if ({condition}) {name} <= {};", self.expressions.root(then))),
            false => {
                lines.push(format!("{indent}if ({condition}) begin"));
                self.transition(name, own, then, &format!("{indent}  "), lines);
                lines.push(format!("{indent}end"));
            }
        }
        debug_assert!(lines.len() > before);
        if otherwise != own {
            let mut more = Vec::new();
            self.transition(name, own, otherwise, indent, &mut more);
            let last = lines.last_mut().filter(|line| line.trim() == "end");
            match (last, more.first_mut()) {
                (Some(end), Some(first)) => {
                    *end = format!("{end} else {}", first.trim_start());
                    more.remove(0);
                }
                (None, Some(first)) => *first = format!("{indent}else {}", first.trim_start()),
                _ => {}
            }
            lines.extend(more);
        }
    }

    /// Whether a multiplexer tree has `own` at one of its ends.
    fn keeps(&self, node: NodeId, own: NodeId) -> bool {
        match self.kernel.nodes[node].0 {
            _ if node == own => true,
            Node::Mux(_, a, b) => self.keeps(a, own) || self.keeps(b, own),
            _ => false,
        }
    }
}
