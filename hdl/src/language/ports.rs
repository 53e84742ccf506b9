//! The ports of a block, declared once: what is inside, what connects to it and what tests see follow from it.
//!
//! [`block!`](crate::block) declares the parameters of a block and its ports. The struct of ports has one field for each port,
//! whose type depends on the side from which it is seen, its [`View`]:
//!
//! | view | an input is | an output is |
//! |---|---|---|
//! | [`Inside`], in [`Block::build`] | an expression | an [`Output`], to be driven once |
//! | [`Outside`], from [`Builder::instance`] | a [`Net`], to be assigned | an expression |
//! | [`Signals`](super::Signals), in rust-hdl | a signal | a signal |
//! | [`Widths`], from [`Interface::widths`] | its width in bits | its width in bits |

use std::marker::PhantomData;
use std::sync::Arc;

use dermis_golden::spec::plain_text::plain_text;

use super::build::{Builder, Net};
use super::expression::Expr;
use super::kernel::{Kernel, Port, Type, SEPARATOR};

/// A hardware block: its parameters are the fields of a struct, from which its ports and its behaviour follow.
pub trait Block: Interface {
    /// Describes the behaviour between the ports `io`.
    fn build<'k>(&'k self, k: &'k Builder, io: Self::Ports<Inside<'k>>);
}

/// The ports of a block; [`block!`](crate::block) implements it.
pub trait Interface {
    /// The ports, as seen from one side.
    type Ports<V: View>;

    /// Name of the block in messages.
    const NAME: &'static str;

    /// Its clock port; none of a combinational block.
    const CLOCK: Option<&'static str>;

    /// The ports, made by `make` in the order of their declaration.
    fn ports<V: View>(&self, make: &mut dyn Make<V>) -> Self::Ports<V>;

    /// The widths of the ports in bits.
    fn widths(&self) -> Self::Ports<Widths> {
        self.ports(&mut MakeWidths)
    }

    /// Shows `visitor` the ports in the order of their declaration.
    fn visit<V: View>(ports: &Self::Ports<V>, visitor: &mut dyn Visit<V>);

    /// As [`Interface::visit`], to change them.
    fn visit_mut<V: View>(ports: &mut Self::Ports<V>, visitor: &mut dyn VisitMut<V>);
}

impl<B: Interface> Interface for &B {
    type Ports<V: View> = B::Ports<V>;

    const NAME: &'static str = B::NAME;

    const CLOCK: Option<&'static str> = B::CLOCK;

    fn ports<V: View>(&self, make: &mut dyn Make<V>) -> Self::Ports<V> {
        (**self).ports(make)
    }

    fn visit<V: View>(ports: &Self::Ports<V>, visitor: &mut dyn Visit<V>) {
        B::visit(ports, visitor);
    }

    fn visit_mut<V: View>(ports: &mut Self::Ports<V>, visitor: &mut dyn VisitMut<V>) {
        B::visit_mut(ports, visitor);
    }
}

impl<B: Block> Block for &B {
    fn build<'k>(&'k self, k: &'k Builder, io: Self::Ports<Inside<'k>>) {
        (**self).build(k, io);
    }
}

/// The side from which ports are seen.
pub trait View {
    /// An input of one bit.
    type InBit;
    /// An output of one bit.
    type OutBit;
    /// An input of a width that the parameters decide.
    type In;
    /// An output of such a width.
    type Out;
}

/// Makes the ports of a view from their declaration: name, width in bits, meaning.
pub trait Make<V: View> {
    /// An input of one bit, or of none.
    fn in_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> V::InBit;
    /// An output of one bit, or of none.
    fn out_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> V::OutBit;
    /// An input of `bits` bits.
    fn input(&mut self, name: &str, bits: usize, doc: &[&str]) -> V::In;
    /// An output of `bits` bits.
    fn output(&mut self, name: &str, bits: usize, doc: &[&str]) -> V::Out;
}

/// Sees each port of a view.
pub trait Visit<V: View> {
    /// An input of one bit.
    fn in_bit(&mut self, name: &str, port: &V::InBit);
    /// An output of one bit.
    fn out_bit(&mut self, name: &str, port: &V::OutBit);
    /// Another input.
    fn input(&mut self, name: &str, port: &V::In);
    /// Another output.
    fn output(&mut self, name: &str, port: &V::Out);
}

/// Changes each port of a view.
pub trait VisitMut<V: View> {
    /// An input of one bit.
    fn in_bit(&mut self, port: &mut V::InBit);
    /// An output of one bit.
    fn out_bit(&mut self, port: &mut V::OutBit);
    /// Another input.
    fn input(&mut self, port: &mut V::In);
    /// Another output.
    fn output(&mut self, port: &mut V::Out);
}

/// Ports as their block sees them.
#[derive(Debug)]
pub struct Inside<'k>(PhantomData<&'k ()>);

impl<'k> View for Inside<'k> {
    type InBit = Expr<'k>;
    type OutBit = Output<'k>;
    type In = Expr<'k>;
    type Out = Output<'k>;
}

/// Ports as a block sees them that has an instance.
#[derive(Debug)]
pub struct Outside<'k>(PhantomData<&'k ()>);

impl<'k> View for Outside<'k> {
    type InBit = Net<'k>;
    type OutBit = Expr<'k>;
    type In = Net<'k>;
    type Out = Expr<'k>;
}

/// The width of each port in bits.
#[derive(Clone, Copy, Debug)]
pub struct Widths;

impl View for Widths {
    type InBit = usize;
    type OutBit = usize;
    type In = usize;
    type Out = usize;
}

/// An output as its block sees it: it is driven once, by a wire or a register of its name.
#[derive(Clone, Copy, Debug)]
pub struct Output<'k> {
    builder: &'k Builder,
    /// Its number among the ports; none of an output that is left out.
    port: Option<usize>,
    bits: usize,
}

impl<'k> Output<'k> {
    /// Drives the output by a wire with this value. A narrower value is extended. An output that is left out is not driven.
    pub fn set(self, value: Expr<'k>) -> Expr<'k> {
        let wire = |name: &str| {
            let value = if value.bits() < self.bits { value.extend(self.bits) } else { value };
            self.builder.wire(name, value)
        };
        self.driven(wire).unwrap_or(value)
    }

    /// Drives the output by a wire that is assigned later.
    pub fn net(self) -> Net<'k> {
        self.by(|name| self.builder.net(name, Type::unsigned(self.bits)))
    }

    /// Drives the output by a register without reset.
    pub fn register(self) -> Net<'k> {
        self.by(|name| self.builder.register(name, Type::unsigned(self.bits)))
    }

    /// Drives the output by a register that `reset` sets to `value`.
    pub fn state(self, reset: Expr<'k>, value: u64) -> Net<'k> {
        self.by(|name| self.builder.state(name, Type::unsigned(self.bits), reset, value))
    }

    /// Drives the output by `value` one cycle later.
    pub fn delay(self, value: Expr<'k>) -> Expr<'k> {
        let register = self.register();
        register.set(value);
        *register
    }

    /// Width in bits.
    pub fn bits(self) -> usize {
        self.bits
    }

    /// A signal that drives the output; where that is left out, one that takes no value.
    fn by(self, signal: impl FnOnce(&str) -> Net<'k>) -> Net<'k> {
        self.driven(signal).unwrap_or_else(|| self.builder.left_out())
    }

    /// What `signal` makes of the output's name; `None` where it is left out.
    fn driven<R>(self, signal: impl FnOnce(&str) -> R) -> Option<R> {
        let name = self.builder.port_name(self.port?);
        Some(self.builder.unscoped(|| signal(&name)))
    }
}

/// Width of a port in bits, from an expression of a block's parameters or one of them.
#[derive(Clone, Copy, Debug)]
pub struct Width(pub usize);

impl From<usize> for Width {
    fn from(bits: usize) -> Self {
        Width(bits)
    }
}

impl From<&usize> for Width {
    fn from(bits: &usize) -> Self {
        Width(*bits)
    }
}

struct MakeInside<'k>(&'k Builder);

impl<'k> Make<Inside<'k>> for MakeInside<'k> {
    fn in_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> Expr<'k> {
        self.input(name, bits, doc)
    }

    fn out_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> Output<'k> {
        self.output(name, bits, doc)
    }

    fn input(&mut self, name: &str, bits: usize, doc: &[&str]) -> Expr<'k> {
        if bits == 0 {
            return self.0.constant(1, 0);
        }
        self.0.port(Port { name: name.to_owned(), bits, output: false, doc: plain_text(doc) });
        self.0.input(name, bits)
    }

    fn output(&mut self, name: &str, bits: usize, doc: &[&str]) -> Output<'k> {
        let port = || self.0.port(Port { name: name.to_owned(), bits, output: true, doc: plain_text(doc) });
        Output { builder: self.0, port: (bits > 0).then(port), bits }
    }
}

struct MakeOutside<'k, 'a> {
    builder: &'k Builder,
    instance: &'a str,
}

impl MakeOutside<'_, '_> {
    fn name(&self, port: &str) -> String {
        format!("{}{SEPARATOR}{port}", self.instance)
    }
}

impl<'k> Make<Outside<'k>> for MakeOutside<'k, '_> {
    fn in_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> Net<'k> {
        self.input(name, bits, doc)
    }

    fn out_bit(&mut self, name: &str, bits: usize, doc: &[&str]) -> Expr<'k> {
        self.output(name, bits, doc)
    }

    fn input(&mut self, name: &str, bits: usize, _: &[&str]) -> Net<'k> {
        self.builder.instance_input(&self.name(name), bits)
    }

    fn output(&mut self, name: &str, bits: usize, _: &[&str]) -> Expr<'k> {
        self.builder.instance_output(&self.name(name), bits)
    }
}

struct MakeWidths;

impl Make<Widths> for MakeWidths {
    fn in_bit(&mut self, _: &str, bits: usize, _: &[&str]) -> usize {
        bits
    }

    fn out_bit(&mut self, _: &str, bits: usize, _: &[&str]) -> usize {
        bits
    }

    fn input(&mut self, _: &str, bits: usize, _: &[&str]) -> usize {
        bits
    }

    fn output(&mut self, _: &str, bits: usize, _: &[&str]) -> usize {
        bits
    }
}

/// The kernel of a block.
pub fn kernel_of<B: Block>(block: &B) -> Kernel {
    let k = Builder::combinational(B::NAME);
    let k = match B::CLOCK {
        Some(clock) => k.clocked(clock),
        None => k,
    };
    let io = block.ports(&mut MakeInside(&k));
    block.build(&k, io);
    k.finish()
}

/// What an instance is made of: a block, or one that only some scenes have, an `Option`.
pub trait Instantiate {
    /// The ports as the block around the instance sees them; `None` where there is no instance.
    type Ports<'k>;

    /// Adds the instance `name` to `k`.
    fn instantiate<'k>(self, k: &'k Builder, name: &str) -> Self::Ports<'k>;
}

impl<B: Block> Instantiate for B {
    type Ports<'k> = <B as Interface>::Ports<Outside<'k>>;

    fn instantiate<'k>(self, k: &'k Builder, name: &str) -> Self::Ports<'k> {
        let kernel = Arc::new(kernel_of(&self));
        let ports = self.ports(&mut MakeOutside { builder: k, instance: name });
        k.place(name, kernel);
        ports
    }
}

impl<B: Block> Instantiate for Option<B> {
    type Ports<'k> = Option<<B as Interface>::Ports<Outside<'k>>>;

    fn instantiate<'k>(self, k: &'k Builder, name: &str) -> Self::Ports<'k> {
        self.map(|block| block.instantiate(k, name))
    }
}

impl Builder {
    /// An instance of `block`, or of none: its ports, of which the inputs are to be assigned. The clock is that of the block
    /// around it, and so is the reset, an input `rst` or that of [`Builder::reset_instances`], unless it is assigned.
    pub fn instance<I: Instantiate>(&self, name: &str, block: I) -> I::Ports<'_> {
        block.instantiate(self, name)
    }
}

#[cfg(test)]
mod tests;
