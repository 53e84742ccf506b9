//! The modules of a design: every block with its ports, its kernel and the blocks inside it.
//!
//! rust-hdl's probe visits the blocks. A block that only connects others gets its kernel from its `#[hdl_gen]` text, so
//! that all modules are printed, checked and estimated in the same way.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::sync::Arc;

use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::*;

use super::change::Change;
use super::error::KernelError;
use super::kernel::{Kernel, Role};
use super::keywords::is_keyword;
use super::verilog::range;
use super::wiring::{wiring, Pin, SEPARATOR};

thread_local! {
    /// The kernels of bodies that a probe has visited since its last scope began or ended.
    static VISITED: RefCell<Option<Arc<Kernel>>> = const { RefCell::new(None) };
}

/// Tells the probe that walks the design that the current block has this kernel.
pub(super) fn visit(kernel: &Arc<Kernel>) {
    VISITED.set(Some(kernel.clone()));
}

/// A block of a design.
#[derive(Debug)]
struct Module {
    /// Names of the instances that lead to it from the top, none for the top.
    path: Vec<String>,
    ports: Vec<Pin>,
    locals: Vec<Pin>,
    /// Ports of the blocks inside, as they are called in this module.
    inner: Vec<Pin>,
    /// Instance and ports of the blocks inside.
    children: Vec<(String, Vec<String>)>,
    code: Verilog,
    kernel: Option<Arc<Kernel>>,
}

impl Module {
    /// The net of a signal of this module at `path`: a port of a block inside belongs to that block.
    fn net(&self, path: &str, name: &str) -> Net {
        let inner = self.children.iter().find_map(|(instance, ports)| {
            let port = name.strip_prefix(instance)?.strip_prefix(SEPARATOR)?;
            ports.iter().any(|own| own == port).then(|| (called(path, instance), port.to_owned()))
        });
        inner.unwrap_or_else(|| (path.to_owned(), name.to_owned()))
    }

    fn new(path: Vec<String>, code: Verilog) -> Self {
        let (ports, locals, inner) = Default::default();
        Module { path, ports, locals, inner, children: Vec::new(), code, kernel: None }
    }

    /// The block of this kernel, whose ports are those of its declaration.
    fn of_kernel(path: Vec<String>, kernel: Arc<Kernel>) -> Self {
        let mut module = Module::new(path, Verilog::Empty);
        let pin = |name: &str, bits, driven| Pin { name: name.to_owned(), bits, driven, value: None };
        module.ports.extend(kernel.clock.iter().map(|clock| pin(clock, 1, false)));
        module.ports.extend(kernel.ports.iter().map(|port| pin(&port.name, port.bits, port.output)));
        module.kernel = Some(kernel);
        module
    }

    /// Adds the instances of its kernel to its children, and they and the blocks inside them to `modules`.
    fn place_instances(&mut self, modules: &mut Vec<Module>) {
        for instance in self.kernel.iter().flat_map(|kernel| &kernel.instances) {
            let path = [&self.path[..], std::slice::from_ref(&instance.name)].concat();
            let mut module = Module::of_kernel(path, instance.kernel.clone());
            module.place_instances(modules);
            self.children.push((instance.name.clone(), module.ports.iter().map(|pin| pin.name.clone()).collect()));
            modules.push(module);
        }
    }
}

/// Path of a block, and one of its ports or signals.
pub(super) type Net = (String, String);

/// A net as it is called in the whole design.
pub(super) fn called(path: &str, name: &str) -> String {
    match path {
        "" => name.to_owned(),
        path => format!("{path}{SEPARATOR}{name}"),
    }
}

/// All blocks of a design.
#[derive(Debug)]
pub struct Hierarchy {
    /// By their path.
    modules: BTreeMap<String, Module>,
}

fn by_path(modules: Vec<Module>) -> BTreeMap<String, Module> {
    modules.into_iter().map(|module| (module.path.join(SEPARATOR), module)).collect()
}

/// Attributes of memories by the path of their block and their name in it.
pub type Attributes = BTreeMap<(String, String), String>;

impl Hierarchy {
    /// The blocks of `design`.
    pub fn of(design: &dyn Block) -> Self {
        VISITED.take();
        let mut collector = Collector::default();
        design.accept("", &mut collector);
        Hierarchy { modules: by_path(collector.done) }
    }

    /// The blocks of a design whose top has this kernel.
    pub fn of_kernel(kernel: Kernel) -> Self {
        let mut modules = Vec::new();
        let mut top = Module::of_kernel(Vec::new(), Arc::new(kernel));
        top.place_instances(&mut modules);
        modules.push(top);
        Hierarchy { modules: by_path(modules) }
    }

    /// The kernel of the top.
    pub(crate) fn top(&self) -> Option<&Kernel> {
        self.modules.get("").and_then(|module| module.kernel.as_deref())
    }

    /// The net of the signal `name` in the block at `path`.
    pub(super) fn net(&self, path: &str, name: &str) -> Net {
        match self.modules.get(path) {
            Some(module) => module.net(path, name),
            None => (path.to_owned(), name.to_owned()),
        }
    }

    /// The kernel of every block by its path: the instances from the top, levels separated by [`SEPARATOR`].
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &Kernel)> {
        self.modules.iter().filter_map(|(path, module)| Some((path.as_str(), module.kernel.as_deref()?)))
    }

    /// Path, scope and kernel of every block, the top first, each followed by the blocks inside it in their order. The
    /// scope is the instances from the top, separated by dots, as simulators name it.
    pub fn scopes(&self) -> Vec<(&str, String, &Kernel)> {
        let (mut all, mut open) = (Vec::new(), vec![String::new()]);
        while let Some((path, module)) = open.pop().and_then(|path| self.modules.get_key_value(&path)) {
            all.extend(module.kernel.as_deref().map(|kernel| (path.as_str(), module.path.join("."), kernel)));
            open.extend(module.children.iter().rev().map(|(instance, _)| called(path, instance)));
        }
        all
    }

    /// # Errors
    /// The first defect of one of the kernels.
    pub fn check(&self) -> Result<(), KernelError> {
        let without = self.modules.iter().find(|(_, module)| module.kernel.is_none());
        if let Some((path, _)) = without {
            return Err(KernelError::Wiring { block: path.clone(), what: "the block".into(), reason: "has no kernel" });
        }
        for (path, module) in &self.modules {
            if let Some((instance, _)) = module.children.iter().find(|(instance, _)| is_keyword(instance)) {
                let (block, signal) = (path.clone(), instance.clone());
                return Err(KernelError::Name { block, signal, reason: "a keyword of Verilog" });
            }
        }
        if let Some(error) = self.kernels().flat_map(|(_, kernel)| kernel.errors()).next() {
            return Err(error.clone());
        }
        for (path, module) in &self.modules {
            let kernel = module.kernel.as_deref().into_iter();
            let lacks = |kernel: &Kernel, pin: &Pin| {
                let signal = kernel.signal_of(&pin.name).map(|id| &kernel.signals[id]);
                kernel.clock.as_deref() != Some(&pin.name) && signal.is_none_or(|signal| signal.output != pin.driven)
            };
            let pin = kernel.flat_map(|kernel| module.ports.iter().chain(&module.inner).find(|pin| lacks(kernel, pin)));
            if let Some(Pin { name, .. }) = pin.into_iter().next() {
                let reason = "is not in the kernel, or in the other direction";
                return Err(KernelError::Wiring { block: path.clone(), what: name.clone(), reason });
            }
        }
        self.loops()
    }

    /// The same blocks with these changes: seeded defects, which a check must find.
    ///
    /// # Errors
    /// [`KernelError::Change`] for a block or a signal that the design does not have; what is wrong with a new value.
    pub fn changed(mut self, changes: &[Change]) -> Result<Self, KernelError> {
        for change in changes {
            let module = self.modules.get_mut(change.block());
            let kernel = module.and_then(|module| module.kernel.as_mut()).ok_or_else(|| change.without_block())?;
            *kernel = Arc::new(change.apply(kernel)?);
        }
        Ok(self)
    }

    /// Finds a combinational loop through several blocks.
    fn loops(&self) -> Result<(), KernelError> {
        let mut sources: BTreeMap<Net, Vec<Net>> = BTreeMap::new();
        // The block that drives a net, its kernel, and the net's name in it.
        let mut drivers: BTreeMap<Net, (&str, &Kernel, &str)> = BTreeMap::new();
        for (path, kernel) in self.kernels() {
            for (output, inputs) in kernel.combinational() {
                let of = |name: &str| self.modules[path].net(path, name);
                sources.entry(of(output)).or_default().extend(inputs.into_iter().map(of));
                drivers.insert(of(output), (path, kernel, output));
            }
        }
        // Nets whose sources are all known to be free of loops, and those on the way to the current one.
        let (mut free, mut open): (BTreeSet<&Net>, Vec<(&Net, usize)>) = Default::default();
        for start in sources.keys() {
            open.push((start, 0));
            while let Some((net, next)) = open.pop() {
                let source = sources.get(net).and_then(|all| all.get(next)).filter(|_| !free.contains(net));
                let Some(source) = source else {
                    free.insert(net);
                    continue;
                };
                open.push((net, next + 1));
                if let Some(first) = open.iter().position(|(net, _)| *net == source) {
                    let through: Vec<String> =
                        open[first..].iter().map(|((path, name), _)| called(path, name)).collect();
                    let (block, kernel, signal) = drivers[source];
                    return Err(KernelError::Loop {
                        block: block.to_owned(),
                        signal: signal.to_owned(),
                        through: through.join(", "),
                        expression: kernel.value_of(signal),
                    });
                }
                open.push((source, 0));
            }
        }
        Ok(())
    }

    /// The Verilog of all blocks, with the top module `top`, and `attributes` in front of memories.
    pub fn verilog(&self, top: &str, attributes: &Attributes) -> String {
        let texts = self.modules.keys().filter_map(|path| self.module(path, top, attributes));
        texts.map(|text| text + "\n").collect()
    }

    /// The Verilog of the block `path`.
    pub fn module(&self, path: &str, top: &str, attributes: &Attributes) -> Option<String> {
        let module = self.modules.get(path)?;
        let kernel = module.kernel.as_ref()?;
        let name = |path: &str| match path {
            "" => top.to_owned(),
            path => format!("{top}{SEPARATOR}{path}"),
        };
        let own = |((block, array), attribute): (&(String, String), &String)| {
            (block == path).then(|| (array.clone(), attribute.clone()))
        };
        let body = kernel.verilog_with(&attributes.iter().filter_map(own).collect());
        let mut lines: Vec<String> = Vec::new();
        lines.extend(module.inner.iter().map(|pin| format!("wire {}{};", range(pin.bits), pin.name)));
        lines.extend(body.lines().map(str::to_owned));
        for (instance, ports) in &module.children {
            let child = [module.path.clone(), vec![instance.clone()]].concat().join(SEPARATOR);
            let clock = kernel.instances.iter().find(|own| own.name == *instance).and_then(|own| own.kernel.clock.as_ref());
            let connect = |port: &String| match (&kernel.clock, clock == Some(port)) {
                (Some(clock), true) => format!("    .{port}({clock})"),
                _ => format!("    .{port}({instance}{SEPARATOR}{port})"),
            };
            lines.push(format!("{} {instance} (", name(&child)));
            lines.push(format!("{}\n);", ports.iter().map(connect).collect::<Vec<_>>().join(",\n")));
        }
        let ports = module.ports.iter().map(|pin| &*pin.name);
        let mut text = kernel.header(&name(path), ports, &|port| kernel.meaning(port));
        for line in lines.iter().flat_map(|line| line.lines()) {
            let _ = write!(text, "\n{}", format!("    {line}").trim_end());
        }
        Some(text + "\nendmodule\n")
    }
}

impl Kernel {
    /// What the declaration says of a port; empty if it says nothing.
    fn meaning(&self, port: &str) -> Option<String> {
        let (.., doc) = self.port_list().find(|(name, ..)| *name == port)?;
        (!doc.is_empty()).then(|| doc.to_owned())
    }

    /// The head of a module of this name with these ports, in this order.
    pub(super) fn header<'a>(
        &self,
        name: &str,
        ports: impl Iterator<Item = &'a str>,
        comment: &dyn Fn(&str) -> Option<String>,
    ) -> String {
        let declared = |port: &str| {
            let Some(signal) = self.signal_of(port).map(|id| &self.signals[id]) else {
                return format!("    input wire {port}");
            };
            let kind = match &signal.role {
                Role::Input | Role::Instance => "input wire",
                Role::Wire { .. } => "output wire",
                Role::Register(_) => "output reg",
            };
            format!("    {kind} {}{port}", range(signal.ty.bits))
        };
        let port = |port: &str| {
            let comment = comment(port).map(|text| format!("    // {text}\n"));
            comment.unwrap_or_default() + &declared(port)
        };
        format!("module {name} (\n{}\n);", ports.map(port).collect::<Vec<_>>().join(",\n"))
    }
}

/// Collects the blocks of a design.
#[derive(Default)]
struct Collector {
    open: Vec<Module>,
    done: Vec<Module>,
}

impl Collector {
    /// Gives the kernel that was visited last to the current block.
    fn keep(&mut self) {
        if let (Some(kernel), Some(module)) = (VISITED.take(), self.open.last_mut()) {
            module.kernel = Some(kernel);
        }
    }
}

impl Probe for Collector {
    fn visit_start_scope(&mut self, name: &str, node: &dyn Block) {
        self.keep();
        let outer = self.open.last().map(|module| module.path.clone());
        let path = outer.map_or(Vec::new(), |path| [path, vec![name.replace('$', SEPARATOR)]].concat());
        self.open.push(Module::new(path, node.hdl()));
    }

    fn visit_atom(&mut self, name: &str, signal: &dyn Atom) {
        let Some(module) = self.open.last_mut() else { return };
        let driven = !matches!(signal.kind(), AtomKind::InputParameter | AtomKind::Constant);
        let value = (signal.kind() == AtomKind::Constant).then(|| signal.verilog().as_usize() as u64);
        let pin = Pin { name: name.to_owned(), bits: signal.bits(), driven, value };
        match signal.kind() {
            AtomKind::InputParameter | AtomKind::OutputParameter => module.ports.push(pin),
            _ => module.locals.push(pin),
        }
    }

    fn visit_end_scope(&mut self, _name: &str, _node: &dyn Block) {
        self.keep();
        let Some(mut module) = self.open.pop() else { return };
        if let Verilog::Combinatorial(code) = &module.code {
            let pins: Vec<Pin> = module.ports.iter().chain(&module.inner).cloned().collect();
            module.kernel = Some(Arc::new(wiring(&module.path.join(SEPARATOR), &pins, &module.locals, code)));
        }
        module.place_instances(&mut self.done);
        if let (Some(outer), Some(instance)) = (self.open.last_mut(), module.path.last()) {
            let called = |pin: &Pin| Pin {
                name: format!("{instance}{SEPARATOR}{}", pin.name),
                bits: pin.bits,
                driven: !pin.driven,
                value: None,
            };
            outer.inner.extend(module.ports.iter().map(called));
            outer.children.push((instance.clone(), module.ports.iter().map(|pin| pin.name.clone()).collect()));
        }
        self.done.push(module);
    }
}

#[cfg(test)]
mod tests;
