//! A hierarchy of blocks as one kernel, for its simulation.

use std::collections::HashMap;

use super::hierarchy::{called, Hierarchy, Net};
use super::kernel::{Domain, Kernel, Memory, Node, NodeId, Register, Role, Signal, SignalId, Write};

impl Hierarchy {
    /// All blocks as one kernel. Its ports are those of the top; a signal of a block inside is called by path and name, with a
    /// dot between. Signals in `observed`, each given by the path of its block and its name, are outputs too, so that a simulation
    /// shows them.
    pub(crate) fn flat(&self, observed: &[(&str, &str)]) -> Kernel {
        let mut flat = Flattener::default();
        for (path, kernel) in self.kernels() {
            flat.declare(self, path, kernel);
        }
        for (path, kernel) in self.kernels() {
            flat.add(self, path, kernel);
        }
        let mut kernel = flat.kernel;
        for index in 0..kernel.domains.len() {
            kernel.domains[index].clock = kernel.source(kernel.domains[index].clock);
        }
        let top = self.top();
        kernel.block = top.map(|top| top.block.clone()).unwrap_or_default();
        kernel.clock = top.and_then(|top| top.clock.clone());
        let outputs = top.into_iter().flat_map(|top| top.signals.iter().filter(|signal| signal.output));
        for (path, name) in outputs.map(|signal| ("", signal.name.as_str())).chain(observed.iter().copied()) {
            if let Some(&id) = flat.signals.get(&self.net(path, name)) {
                kernel.signals[id].output = true;
            }
        }
        kernel
    }

    /// Name in the flat kernel of the signal `name` of the block at `path`.
    pub(super) fn flat_name(&self, path: &str, name: &str) -> String {
        flat_name(self.net(path, name))
    }
}

fn flat_name((path, name): Net) -> String {
    match path.as_str() {
        "" => name,
        path => format!("{path}.{name}"),
    }
}

#[derive(Default)]
struct Flattener {
    kernel: Kernel,
    signals: HashMap<Net, SignalId>,
}

impl Flattener {
    /// Declares the signals of `kernel`. A port of a block inside another one is a single signal, of the type and role that its
    /// driver gives it.
    fn declare(&mut self, hierarchy: &Hierarchy, path: &str, kernel: &Kernel) {
        for signal in &kernel.signals {
            let net = hierarchy.net(path, &signal.name);
            let name = flat_name(net.clone());
            let own = || Signal {
                name,
                ty: signal.ty,
                role: signal.role.clone(),
                value: None,
                guards: Vec::new(),
                comment: None,
                output: false,
                states: signal.states,
            };
            match self.signals.get(&net) {
                None => {
                    self.kernel.signals.push(own());
                    self.signals.insert(net, self.kernel.signals.len() - 1);
                }
                Some(&id) if !signal.role.is_driven_outside() => self.kernel.signals[id] = own(),
                Some(_) => {}
            }
        }
    }

    /// Adds nodes, values, memories of `kernel`.
    fn add(&mut self, hierarchy: &Hierarchy, path: &str, kernel: &Kernel) {
        let net = |id: SignalId| hierarchy.net(path, &kernel.signals[id].name);
        let signals: Vec<SignalId> = (0..kernel.signals.len()).map(|id| self.signals[&net(id)]).collect();
        let (memories, domains) = (self.kernel.memories.len(), self.kernel.domains.len());
        let mut nodes: Vec<NodeId> = Vec::with_capacity(kernel.nodes.len());
        for (node, ty) in &kernel.nodes {
            let of = |id: &NodeId| nodes[*id];
            let (node, own) = match node {
                Node::Constant(_) => (node.clone(), *ty),
                Node::Signal(id) => (Node::Signal(signals[*id]), self.kernel.signals[signals[*id]].ty),
                Node::Read { memory, address } => (Node::Read { memory: memory + memories, address: of(address) }, *ty),
                Node::Unary(operator, a) => (Node::Unary(*operator, of(a)), *ty),
                Node::Binary(operator, a, b) => (Node::Binary(*operator, of(a), of(b)), *ty),
                Node::Mux(c, a, b) => (Node::Mux(of(c), of(a), of(b)), *ty),
                Node::Slice(a, low) => (Node::Slice(of(a), *low), *ty),
                Node::Concat(parts) => (Node::Concat(parts.iter().map(of).collect()), *ty),
                Node::Extend(a) => (Node::Extend(of(a)), *ty),
                Node::Cast(a) => (Node::Cast(of(a)), *ty),
            };
            let mut id = self.kernel.intern(node, own);
            if own != *ty {
                // Another block sees the bits of a signed output.
                id = self.kernel.intern(Node::Cast(id), *ty);
            }
            nodes.push(id);
        }
        for (id, signal) in kernel.signals.iter().enumerate().filter(|(_, signal)| !signal.role.is_driven_outside()) {
            let own = &mut self.kernel.signals[signals[id]];
            own.value = signal.value.map(|value| nodes[value]);
            if let Role::Register(register) = &signal.role {
                own.role = Role::Register(Register {
                    reset: register.reset.map(|(condition, value)| (nodes[condition], value)),
                    domain: register.domain.map(|domain| domain + domains),
                    ..register.clone()
                });
            }
        }
        self.kernel.memories.extend(kernel.memories.iter().map(|memory| {
            let moved = |write: &Write| Write {
                enable: nodes[write.enable],
                address: nodes[write.address],
                data: nodes[write.data],
                low: write.low,
            };
            Memory {
                writes: memory.writes.iter().map(moved).collect(),
                name: called(path, &memory.name),
                ..memory.clone()
            }
        }));
        let moved = |domain: &Domain| Domain { clock: signals[domain.clock], falling: domain.falling };
        self.kernel.domains.extend(kernel.domains.iter().map(moved));
    }
}

impl Kernel {
    /// The signal whose value `signal` passes on unchanged.
    fn source(&self, signal: SignalId) -> SignalId {
        let mut source = signal;
        while let Some(Node::Signal(next)) = self.signals[source].value.map(|value| &self.nodes[value].0) {
            match self.signals[source].role {
                Role::Wire { .. } => source = *next,
                _ => break,
            }
        }
        source
    }
}
