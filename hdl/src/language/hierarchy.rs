//! The blocks of a design: every kernel with the blocks inside it, by their paths.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::sync::Arc;

use super::change::Change;
use super::error::KernelError;
use super::kernel::{Kernel, Role, SEPARATOR};
use super::verilog::range;

/// Path of a block, and one of its ports or signals.
pub(super) type Net = (String, String);

/// A net as it is called in the whole design.
pub(super) fn called(path: &str, name: &str) -> String {
    match path {
        "" => name.to_owned(),
        path => format!("{path}{SEPARATOR}{name}"),
    }
}

/// The memory file `name` of the design with the top module `top`. Two designs have different ones unless their top modules have one
/// name, which every tool refuses: no memory file's name ends another's behind the separator.
pub(crate) fn memory_file(top: &str, name: &str) -> String {
    format!("{top}{SEPARATOR}{name}")
}

/// All blocks of a design.
#[derive(Debug)]
pub struct Hierarchy {
    /// Kernels by their path: the instances from the top, levels separated by [`SEPARATOR`]; empty for the top.
    blocks: BTreeMap<String, Arc<Kernel>>,
    /// Attributes of ports of the top module, in the Verilog, by the port's name.
    port_attributes: BTreeMap<String, String>,
}

/// Values of the attribute `ram_style` by the path of a memory's block and its name in it.
pub type RamStyles = BTreeMap<(String, String), String>;

impl Hierarchy {
    /// The blocks of a design whose top has this kernel.
    pub fn of_kernel(kernel: Kernel) -> Self {
        let mut blocks = BTreeMap::new();
        let mut open = vec![(String::new(), Arc::new(kernel))];
        while let Some((path, kernel)) = open.pop() {
            let inside = kernel.instances.iter();
            open.extend(inside.map(|instance| (called(&path, &instance.name), instance.kernel.clone())));
            blocks.insert(path, kernel);
        }
        Hierarchy { blocks, port_attributes: BTreeMap::new() }
    }

    /// The same blocks, with these attributes of ports of the top module in the Verilog: the port's name, and names and values as Verilog
    /// has them between its brackets.
    pub(crate) fn with_port_attributes(self, attributes: impl IntoIterator<Item = (&'static str, String)>) -> Self {
        let port_attributes = attributes.into_iter().map(|(port, text)| (port.to_owned(), text)).collect();
        Hierarchy { port_attributes, ..self }
    }

    /// The kernel of the top.
    pub(crate) fn top(&self) -> Option<&Kernel> {
        self.blocks.get("").map(|kernel| &**kernel)
    }

    /// The net of the signal `name` in the block at `path`: a port of a block inside belongs to that block.
    pub(super) fn net(&self, path: &str, name: &str) -> Net {
        let instances = self.blocks.get(path).into_iter().flat_map(|kernel| &kernel.instances);
        let mut inner = instances.filter_map(|instance| {
            let port = name.strip_prefix(&instance.name)?.strip_prefix(SEPARATOR)?;
            let is_port = instance.kernel.port_list().any(|(own, ..)| own == port);
            is_port.then(|| (called(path, &instance.name), port.to_owned()))
        });
        inner.next_back().unwrap_or_else(|| (path.to_owned(), name.to_owned()))
    }

    /// The kernel of every block by its path.
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &Kernel)> {
        self.blocks.iter().map(|(path, kernel)| (path.as_str(), &**kernel))
    }

    /// Path, scope and kernel of every block, the top first, each followed by the blocks inside it in their order. The
    /// scope is the instances from the top, separated by dots, as simulators name it.
    pub fn scopes(&self) -> Vec<(&str, String, &Kernel)> {
        let (mut all, mut open) = (Vec::new(), vec![(String::new(), String::new())]);
        while let Some((path, scope)) = open.pop() {
            let Some((path, kernel)) = self.blocks.get_key_value(&path) else { continue };
            let dotted = |name: &str| if scope.is_empty() { name.to_owned() } else { format!("{scope}.{name}") };
            let inside = kernel.instances.iter().rev();
            open.extend(inside.map(|instance| (called(path, &instance.name), dotted(&instance.name))));
            all.push((path.as_str(), scope, &**kernel));
        }
        all
    }

    /// # Errors
    /// The first defect of one of the kernels; a combinational loop through several.
    pub fn check(&self) -> Result<(), KernelError> {
        match self.kernels().flat_map(|(_, kernel)| kernel.errors()).next() {
            Some(error) => Err(error.clone()),
            None => self.loops(),
        }
    }

    /// The same blocks with these changes: seeded defects, which a check must find.
    ///
    /// # Errors
    /// [`KernelError::Change`] for a block or a signal that the design does not have; what is wrong with a new value.
    pub fn changed(mut self, changes: &[Change]) -> Result<Self, KernelError> {
        for change in changes {
            let kernel = self.blocks.get_mut(change.block()).ok_or_else(|| change.without_block())?;
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
                let of = |name: &str| self.net(path, name);
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

    /// The Verilog of all blocks, with the top module `top`. Memories that are not in `styles` have the kernels' own; without `styles` no
    /// memory has one.
    pub fn verilog(&self, top: &str, styles: Option<&RamStyles>) -> String {
        let texts = self.blocks.keys().filter_map(|path| self.module(path, top, styles));
        texts.map(|text| text + "\n").collect()
    }

    /// The memory files that the Verilog with the top module `top` reads, and their texts. Their names begin with that of the top
    /// module, so that the files of several designs can stand in one folder.
    pub fn memory_files(&self, top: &str) -> Vec<(String, String)> {
        let files = self.kernels().flat_map(|(_, kernel)| kernel.memory_files());
        files.map(|(name, text)| (memory_file(top, &name), text)).collect()
    }

    /// The Verilog of the block `path`, as of [`Hierarchy::verilog`].
    pub fn module(&self, path: &str, top: &str, styles: Option<&RamStyles>) -> Option<String> {
        let kernel = self.blocks.get(path)?;
        let name = |path: &str| match path {
            "" => top.to_owned(),
            path => format!("{top}{SEPARATOR}{path}"),
        };
        let own = |((block, array), style): (&(String, String), &String)| {
            (block == path).then(|| (array.clone(), style.clone()))
        };
        let own = styles.map(|styles| styles.iter().filter_map(own).collect());
        let mut body = kernel.verilog_with(own.as_ref(), &memory_file(top, ""));
        for instance in &kernel.instances {
            let connect = |(port, ..): (&str, bool, usize, &str)| match (&kernel.clock, &instance.kernel.clock) {
                (Some(clock), Some(own)) if own == port => format!("    .{port}({clock})"),
                _ => format!("    .{port}({}{SEPARATOR}{port})", instance.name),
            };
            let ports = instance.kernel.port_list().map(connect).collect::<Vec<_>>().join(",\n");
            let _ = write!(body, "\n{} {} (\n{ports}\n);", name(&called(path, &instance.name)), instance.name);
        }
        let no_attributes = BTreeMap::new();
        let attributes = if path.is_empty() { &self.port_attributes } else { &no_attributes };
        let mut text = kernel.header(&name(path), attributes);
        for line in body.trim_start().lines() {
            let _ = write!(text, "\n{}", format!("    {line}").trim_end());
        }
        Some(text + "\nendmodule\n")
    }
}

impl Kernel {
    /// The head of a module of this name, the clock first, with these attributes of ports.
    fn header(&self, name: &str, attributes: &BTreeMap<String, String>) -> String {
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
        let port = |(port, .., doc): (&str, bool, usize, &str)| {
            let doc = if doc.is_empty() { String::new() } else { format!("    // {doc}\n") };
            let attribute = attributes.get(port).map(|text| format!("    (* {text} *)\n")).unwrap_or_default();
            doc + &attribute + &declared(port)
        };
        format!("module {name} (\n{}\n);", self.port_list().map(port).collect::<Vec<_>>().join(",\n"))
    }
}

#[cfg(test)]
mod tests;
