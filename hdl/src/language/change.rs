//! Changed kernels: seeded defects, which a check must find.
//!
//! A test shows that a check can fail by breaking the design. The defect is a change of one signal of one block, written
//! with the language, so that it breaks what is built and not the text that is printed.

use std::collections::HashMap;

use super::build::Builder;
use super::error::KernelError;
use super::expression::Expr;
use super::kernel::{Item, Kernel, Node, NodeId, Role, SignalId};

/// One expression over a finished kernel, whose signals and memories are given by name.
type Value = Box<dyn for<'k> Fn(&'k Builder) -> Expr<'k>>;
/// Two of them.
type Pair = Box<dyn for<'k> Fn(&'k Builder) -> [Expr<'k>; 2]>;

/// What becomes of a signal.
enum Kind {
    Value(Value),
    Within(Pair),
    Undefined,
}

/// A change of one signal of one block: a seeded defect.
pub struct Change {
    block: String,
    signal: String,
    kind: Kind,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, signal {}", self.block, self.signal)
    }
}

impl Change {
    fn new(block: &str, signal: &str, kind: Kind) -> Self {
        Change { block: block.to_owned(), signal: signal.to_owned(), kind }
    }

    /// In the block at the path `block`, levels separated by [`SEPARATOR`](super::SEPARATOR), `signal` has the value
    /// that `value` builds: a wire always, a register at every clock edge without reset.
    pub fn value(block: &str, signal: &str, value: impl for<'k> Fn(&'k Builder) -> Expr<'k> + 'static) -> Self {
        Change::new(block, signal, Kind::Value(Box::new(value)))
    }

    /// In the value of `signal`, conditions included, the first expression that `pair` builds becomes the second. Both
    /// have the same type.
    pub fn within(block: &str, signal: &str, pair: impl for<'k> Fn(&'k Builder) -> [Expr<'k>; 2] + 'static) -> Self {
        Change::new(block, signal, Kind::Within(Box::new(pair)))
    }

    /// The register `signal` has neither reset nor initial value.
    pub fn undefined(block: &str, signal: &str) -> Self {
        Change::new(block, signal, Kind::Undefined)
    }

    /// Path of the block.
    pub(super) fn block(&self) -> &str {
        &self.block
    }

    /// The error of a design without the block.
    pub(super) fn without_block(&self) -> KernelError {
        self.refused("is in no block of this path")
    }

    fn refused(&self, reason: &'static str) -> KernelError {
        KernelError::Change { block: self.block.clone(), signal: self.signal.clone(), reason }
    }

    /// `kernel`, changed and checked.
    ///
    /// # Errors
    /// [`KernelError::Change`] if the block has no such signal to drive or its value no such expression; what is wrong
    /// with the new value.
    pub(super) fn apply(&self, kernel: &Kernel) -> Result<Kernel, KernelError> {
        let driven = |&id: &SignalId| !kernel.signals[id].role.is_driven_outside();
        let id = kernel.signal_of(&self.signal).filter(driven).ok_or_else(|| self.refused("is not driven there"))?;
        let mut changed = match &self.kind {
            Kind::Undefined => {
                let mut changed = kernel.clone();
                let Role::Register(register) = &mut changed.signals[id].role else {
                    return Err(self.refused("is not a register"));
                };
                (register.reset, register.initial) = (None, None);
                changed
            }
            Kind::Value(value) => {
                let builder = Builder::over(kernel.clone());
                let node = value(&builder).assigned_to(id).id;
                let mut changed = builder.kernel.into_inner();
                changed.drive(id, node);
                changed
            }
            Kind::Within(pair) => {
                let builder = Builder::over(kernel.clone());
                let [from, to] = pair(&builder);
                let (from, to) = (from.id, to.id);
                let mut changed = builder.kernel.into_inner();
                if changed.ty(from) != changed.ty(to) {
                    return Err(self.refused("would change in type"));
                }
                let before = changed.signals[id].value;
                let mut known = HashMap::from([(from, to)]);
                let after = before.map(|value| changed.substituted(value, &mut known));
                let after =
                    after.filter(|_| after != before).ok_or_else(|| self.refused("has no such expression in it"))?;
                changed.drive(id, after);
                changed
            }
        };
        changed.check();
        match changed.errors.first() {
            None => Ok(changed),
            Some(error) => Err(error.clone()),
        }
    }
}

impl Kernel {
    /// Gives a signal another value. A wire is declared ahead of all and assigned last, since it may read wires that
    /// come after it.
    fn drive(&mut self, id: SignalId, value: NodeId) {
        let signal = &mut self.signals[id];
        signal.value = Some(value);
        if let Role::Wire { declared } = &mut signal.role {
            *declared = true;
            self.items.retain(|item| *item != Item::Wire(id));
            self.items.push(Item::Wire(id));
        }
    }

    /// `node` with the operands that `known` has another node for; `known` gathers what was looked at.
    fn substituted(&mut self, node: NodeId, known: &mut HashMap<NodeId, NodeId>) -> NodeId {
        if let Some(&other) = known.get(&node) {
            return other;
        }
        let (inner, ty) = self.nodes[node].clone();
        let mut of = |id: NodeId| self.substituted(id, known);
        let new = match inner {
            Node::Constant(_) | Node::Signal(_) => inner,
            Node::Read { memory, address } => Node::Read { memory, address: of(address) },
            Node::Unary(operator, a) => Node::Unary(operator, of(a)),
            Node::Binary(operator, a, b) => Node::Binary(operator, of(a), of(b)),
            Node::Mux(c, a, b) => Node::Mux(of(c), of(a), of(b)),
            Node::Slice(a, low) => Node::Slice(of(a), low),
            Node::Concat(parts) => Node::Concat(parts.into_iter().map(of).collect()),
            Node::Extend(a) => Node::Extend(of(a)),
            Node::Cast(a) => Node::Cast(of(a)),
        };
        let new = self.intern(new, ty);
        known.insert(node, new);
        new
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel::Type;
    use super::*;

    /// A counter with a limit, and whether it is at its end.
    fn counter() -> Kernel {
        let k = Builder::new("counter");
        let (rst, enable) = (k.input("rst", 1), k.input("enable", 1));
        let value = k.state("value", Type::unsigned(4), rst, 0);
        let last = k.wire("last", value.is(9));
        k.when(enable, || value.set(last.mux(k.constant(4, 0), value.plus(1))));
        k.finish()
    }

    fn zero(k: &Builder) -> Expr<'_> {
        k.constant(1, 0)
    }

    fn verilog(change: Change) -> String {
        change.apply(&counter()).unwrap().verilog()
    }

    #[test]
    fn a_value_an_expression_or_a_reset_is_changed() {
        assert!(counter().verilog().contains("if (enable) value <= last ? 4'd0"));
        let text = verilog(Change::value("", "last", |k| k.named("value").is(10)));
        assert!(text.contains("assign last = value == 4'd10;"), "{text}");
        let text = verilog(Change::within("", "last", |k| [k.constant(4, 9), k.constant(4, 8)]));
        assert!(text.contains("assign last = value == 4'd8;"), "{text}");
        let text = verilog(Change::within("", "value", |k| [k.named("enable"), k.constant(1, 1)]));
        assert!(!text.contains("if (enable)") && text.contains("if (rst)"), "{text}");
        let text = verilog(Change::undefined("", "value"));
        assert!(!text.contains("if (rst)"), "{text}");
    }

    #[test]
    fn what_cannot_be_changed_is_an_error_with_block_and_signal() {
        let error = |change: Change| change.apply(&counter()).unwrap_err().to_string();
        assert_eq!(error(Change::value("a__b", "lost", zero)), "block a__b, signal lost: is not driven there");
        assert_eq!(error(Change::value("a", "enable", zero)), "block a, signal enable: is not driven there");
        assert_eq!(error(Change::undefined("a", "last")), "block a, signal last: is not a register");
        let absent = Change::within("a", "last", |k| [k.constant(4, 3), k.constant(4, 2)]);
        assert_eq!(error(absent), "block a, signal last: has no such expression in it");
        let wider = Change::within("a", "last", |k| [k.constant(4, 9), k.constant(5, 9)]);
        assert_eq!(error(wider), "block a, signal last: would change in type");
        let unknown = Change::value("a", "last", |k| k.named("nothing"));
        assert_eq!(error(unknown), "block counter, signal nothing: is neither signal nor memory of it");
        let wide = error(Change::value("a", "last", |k| k.named("value")));
        assert!(wide.contains("has 4 bits, the signal 1"), "{wide}");
        let ring = error(Change::value("a", "last", |k| !k.named("last")));
        assert!(ring.contains("combinational loop"), "{ring}");
    }
}
