//! The kernel of a block that connects others: from the assignments that `#[hdl_gen]` reads off its `update`.

use std::collections::{BTreeMap, BTreeSet};

use rust_hdl::core::ast::{
    VerilogBlock, VerilogBlockOrConditional, VerilogExpression, VerilogLiteral, VerilogOp, VerilogOpUnary,
    VerilogStatement,
};

use super::build::{Builder, Net};
use super::error::KernelError;
use super::expression::Expr;
use super::kernel::{Kernel, Type};

/// Between the levels of the name of a module or a net. Not rust-hdl's `$`, which Tcl, XDC and VHDL do not take.
pub const SEPARATOR: &str = "__";

/// A signal of a block as it stands in the block's module: a port, a port of a block inside, or a signal of its own.
#[derive(Clone, Debug)]
pub(super) struct Pin {
    pub(super) name: String,
    pub(super) bits: usize,
    /// The block assigns it.
    pub(super) driven: bool,
    /// The value of a constant.
    pub(super) value: Option<u64>,
}

/// The kernel of the block `block` with these pins and signals of its own.
pub(super) fn wiring(block: &str, pins: &[Pin], locals: &[Pin], code: &VerilogBlock) -> Kernel {
    let builder = Builder::combinational(block);
    Wiring::new(&builder, pins, locals).connect(code);
    let mut kernel = builder.finish();
    kernel.connects = true;
    pins.iter().for_each(|pin| kernel.bind(&pin.name, pin.bits, pin.driven));
    kernel
}

/// Values by the name of the assigned signal.
type Values<'k> = BTreeMap<String, Expr<'k>>;

struct Wiring<'k> {
    builder: &'k Builder,
    inputs: BTreeMap<String, Expr<'k>>,
    nets: BTreeMap<String, Net<'k>>,
}

impl<'k> Wiring<'k> {
    fn new(builder: &'k Builder, pins: &[Pin], locals: &[Pin]) -> Self {
        let (driven, inputs): (Vec<&Pin>, Vec<&Pin>) = pins.iter().chain(locals).partition(|pin| pin.driven);
        let input = |pin: &Pin| match pin.value {
            Some(value) => builder.wire(&pin.name, builder.constant(pin.bits, value)),
            None => builder.input(&pin.name, pin.bits),
        };
        Wiring {
            builder,
            inputs: inputs.iter().map(|pin| (pin.name.clone(), input(pin))).collect(),
            nets: driven
                .iter()
                .map(|pin| (pin.name.clone(), builder.net(&pin.name, Type::unsigned(pin.bits))))
                .collect(),
        }
    }

    /// Assigns every signal once, after its last statement, so that comments stay in front of what they explain.
    fn connect(&self, code: &VerilogBlock) {
        let mut values = Values::new();
        let assigned: Vec<BTreeSet<String>> = code.iter().map(|statement| self.targets(statement)).collect();
        for (index, statement) in code.iter().enumerate() {
            if let VerilogStatement::Comment(text) = statement {
                self.builder.comment(text.trim());
            }
            self.run(statement, &mut values);
            for name in &assigned[index] {
                let later = assigned[index + 1..].iter().any(|names| names.contains(name));
                if let (false, Some(net), Some(&value)) = (later, self.nets.get(name), values.get(name)) {
                    net.set(value);
                }
            }
        }
    }

    fn targets(&self, statement: &VerilogStatement) -> BTreeSet<String> {
        let of = |block: &VerilogBlock| block.iter().flat_map(|statement| self.targets(statement)).collect();
        match statement {
            VerilogStatement::Assignment(VerilogExpression::Signal(name), _) => BTreeSet::from([plain(name)]),
            VerilogStatement::Macro(block) => of(block),
            VerilogStatement::If(choice) => {
                let mut names: BTreeSet<String> = of(&choice.then);
                match &choice.otherwise {
                    VerilogBlockOrConditional::Block(block) => names.append(&mut of(block)),
                    VerilogBlockOrConditional::Conditional(statement) => names.append(&mut self.targets(statement)),
                    VerilogBlockOrConditional::None => {}
                }
                names
            }
            _ => BTreeSet::new(),
        }
    }

    fn run(&self, statement: &VerilogStatement, values: &mut Values<'k>) {
        match statement {
            VerilogStatement::Assignment(VerilogExpression::Signal(name), value) => {
                let name = plain(name);
                if !self.nets.contains_key(&name) {
                    self.fail(&name, "is not assigned by this block");
                }
                values.insert(name, self.value(value));
            }
            VerilogStatement::Macro(block) => block.iter().for_each(|statement| self.run(statement, values)),
            VerilogStatement::If(choice) => {
                let condition = self.value(&choice.test);
                let (mut then, mut otherwise) = (values.clone(), values.clone());
                choice.then.iter().for_each(|statement| self.run(statement, &mut then));
                match &choice.otherwise {
                    VerilogBlockOrConditional::Block(block) => {
                        block.iter().for_each(|statement| self.run(statement, &mut otherwise));
                    }
                    VerilogBlockOrConditional::Conditional(statement) => self.run(statement, &mut otherwise),
                    VerilogBlockOrConditional::None => {}
                }
                for name in self.targets(statement) {
                    let value = match (then.get(&name), otherwise.get(&name)) {
                        (Some(a), Some(b)) if a.is_same(*b) => *a,
                        (Some(a), Some(b)) => condition.mux(*a, *b),
                        _ => {
                            self.fail(&name, "has no value under one of two conditions");
                            continue;
                        }
                    };
                    values.insert(name, value);
                }
            }
            VerilogStatement::Comment(_) => {}
            other => self.fail(&format!("{other:?}"), UNKNOWN),
        }
    }

    fn value(&self, expression: &VerilogExpression) -> Expr<'k> {
        match expression {
            VerilogExpression::Signal(name) => {
                let name = plain(name);
                let net = || self.nets.get(&name).map(Net::get);
                self.inputs.get(&name).copied().or_else(net).unwrap_or_else(|| {
                    self.fail(&name, "is no signal of this block");
                    self.builder.constant(1, 0)
                })
            }
            VerilogExpression::Literal(literal) => {
                let (bits, value) = number(literal).unwrap_or_else(|| {
                    self.fail(&literal.to_string(), "is not an unsigned constant of at most 64 bits");
                    (1, 0)
                });
                self.builder.constant(bits, value)
            }
            VerilogExpression::Paren(inner) => self.value(inner),
            VerilogExpression::Unary(VerilogOpUnary::Not, inner) => !self.value(inner),
            VerilogExpression::Binary(a, operator, b) => {
                let (a, b) = (self.value(a), self.value(b));
                match operator {
                    VerilogOp::BitAnd | VerilogOp::LogicalAnd => a & b,
                    VerilogOp::BitOr | VerilogOp::LogicalOr => a | b,
                    VerilogOp::BitXor => a ^ b,
                    VerilogOp::Eq => a.equals(b),
                    VerilogOp::Ne => a.differs(b),
                    other => {
                        self.fail(&format!("{other:?}"), UNKNOWN);
                        a
                    }
                }
            }
            other => {
                self.fail(&format!("{other:?}"), UNKNOWN);
                self.builder.constant(1, 0)
            }
        }
    }

    fn fail(&self, what: &str, reason: &'static str) {
        self.builder.fail(KernelError::Wiring { block: self.builder.block(), what: what.to_owned(), reason });
    }
}

const UNKNOWN: &str = "belongs into a kernel: a block that connects others has assignments, conditions and logic";

/// The name in the module of a signal that rust-hdl calls by its path of fields.
fn plain(path: &str) -> String {
    let name = path.trim_start_matches(['.', '$']).replace(['.', '$'], SEPARATOR);
    name.strip_suffix("__next").map(str::to_owned).unwrap_or(name)
}

/// Width and value of an unsigned literal of at most 64 bits. rust-hdl keeps both to itself and gives them as text:
/// `4'h9`, `3'b101`.
fn number(literal: &VerilogLiteral) -> Option<(usize, u64)> {
    let text = literal.to_string();
    let (bits, digits) = text.split_once('\'')?;
    let value = match digits.split_at_checked(1)? {
        ("b", digits) => u64::from_str_radix(digits, 2),
        ("h", digits) => u64::from_str_radix(digits, 16),
        _ => return None,
    };
    Some((bits.parse().ok()?, value.ok()?))
}

#[cfg(test)]
mod tests {
    use rust_hdl::prelude::*;

    use super::*;

    #[test]
    fn literals_have_their_width_or_are_an_error() {
        let literals: [(VerilogLiteral, Option<(usize, u64)>); 6] = [
            (true.into(), Some((1, 1))),
            (Bits::<3>::from(5).into(), Some((3, 5))),
            (Bits::<24>::from(9).into(), Some((24, 9))),
            (u64::MAX.into(), Some((64, u64::MAX))),
            ((1u128 << 64).into(), None),
            (Signed::<4>::from(-3).into(), None),
        ];
        for (literal, expected) in literals {
            assert_eq!(number(&literal), expected, "{literal}");
        }
        let pin = Pin { name: "y".to_owned(), bits: 4, driven: true, value: None };
        let errors = |literal: VerilogLiteral| {
            let assigned = VerilogExpression::Signal("y".to_owned());
            let code = [VerilogStatement::Assignment(assigned, VerilogExpression::Literal(literal))];
            let kernel = wiring("b", std::slice::from_ref(&pin), &[], &code.to_vec());
            kernel.errors().iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(errors(Bits::<4>::from(9).into()), [""; 0]);
        assert_eq!(errors(Bits::<5>::from(9).into()), ["block b, signal y: `5'd9` has 5 bits, the signal 4"]);
        let negative = "block b: `4'h-3` is not an unsigned constant of at most 64 bits";
        assert_eq!(errors(Signed::<4>::from(-3).into()), [negative]);
    }
}
