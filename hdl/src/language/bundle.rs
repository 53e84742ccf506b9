//! Bundles: signals between two blocks that belong together, declared once and connected as one.
//!
//! [`bundle!`](crate::bundle) declares the signals as who sends them sees them. In [`block!`](crate::block) a bundle is two kinds of
//! ports: `source` of the sender, `sink` of the receiver, whose inputs are the sender's outputs, [`Flip`].

use std::marker::PhantomData;

use super::build::Net;
use super::expression::Expr;
use super::ports::{Make, Output, View, Visit, VisitMut};

/// The ports of a view at the other end of a bundle: an input there is an output here.
#[derive(Debug)]
pub struct Flip<V>(PhantomData<V>);

impl<V: View> View for Flip<V> {
    type InBit = V::OutBit;
    type OutBit = V::InBit;
    type In = V::Out;
    type Out = V::In;
}

/// The signals of a bundle; [`bundle!`](crate::bundle) implements it.
pub trait Bundle {
    /// The signals, as who sends them sees them.
    type Signals<V: View>;

    /// The signals of the port `port`, which has the comment `doc`, of who sends.
    fn source<V: View>(&self, port: &str, doc: &[&str], make: &mut dyn Make<V>) -> Self::Signals<V>;

    /// As [`Bundle::source`], of who receives.
    fn sink<V: View>(&self, port: &str, doc: &[&str], make: &mut dyn Make<V>) -> Self::Signals<Flip<V>>;

    /// Shows `visitor` the signals of who sends.
    fn visit_source<V: View>(port: &str, signals: &Self::Signals<V>, visitor: &mut dyn Visit<V>);

    /// As [`Bundle::visit_source`], of who receives.
    fn visit_sink<V: View>(port: &str, signals: &Self::Signals<Flip<V>>, visitor: &mut dyn Visit<V>);

    /// As [`Bundle::visit_source`], to change them.
    fn visit_mut_source<V: View>(signals: &mut Self::Signals<V>, visitor: &mut dyn VisitMut<V>);

    /// As [`Bundle::visit_sink`], to change them.
    fn visit_mut_sink<V: View>(signals: &mut Self::Signals<Flip<V>>, visitor: &mut dyn VisitMut<V>);
}

/// What takes a value once: the input of an instance, or an output of the block around it.
pub trait Drive<'k> {
    /// Gives it the value.
    fn drive(&self, value: Expr<'k>);
}

impl<'k> Drive<'k> for Net<'k> {
    fn drive(&self, value: Expr<'k>) {
        self.set(value);
    }
}

impl<'k> Drive<'k> for Output<'k> {
    fn drive(&self, value: Expr<'k>) {
        self.set(value);
    }
}

/// For [`bundle!`](crate::bundle): the comment of a signal, its own, in which `{}` is the name of the port, or that of the port where it
/// has none.
pub fn comment(own: &[&str], port: &str, of_port: &[&str]) -> Vec<String> {
    let lines = if own.is_empty() { of_port } else { own };
    lines.iter().map(|line| line.replace("{}", port)).collect()
}

/// Declares a bundle: a struct of its parameters, and a struct of its signals.
///
/// ```text
/// bundle! {
///     /// A stream of beats.
///     pub struct Stream { bits: usize }
///     signals StreamSignals: *bits > 0 => {
///         out data "tdata": bits;
///         /// A beat is offered on `{}_tdata`.
///         out valid "tvalid";
///         /// The beat is accepted in this cycle.
///         in ready "tready";
///     }
/// }
/// ```
/// Widths are as in [`block!`](crate::block). Behind the name of the struct of signals is whether there are any: where there are none, all are left out. The port of a signal has
/// the name of the bundle's port, an underscore, and the name in quotes. `connect` connects a sender with a receiver; of the bundle
/// that a block receives, `inward` makes one that something inside it sends.
#[macro_export]
macro_rules! bundle {
    (
        $(#[$meta:meta])*
        $vis:vis struct $bundle:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty),* $(,)? }
        signals $signals:ident: $there:expr => {
            $($(#[doc = $doc:literal])* $direction:ident $signal:ident $name:literal $(: $width:expr)?;)*
        }
    ) => {
        $(#[$meta])*
        $vis struct $bundle { $($(#[$field_meta])* $field_vis $field: $field_type,)* }

        #[doc = concat!("Signals of [`", stringify!($bundle), "`].")]
        $vis struct $signals<V: $crate::language::View> {
            $(#[doc = concat!("Signal `", $name, "`.")] pub $signal: $crate::block!(@type $direction V $($width)?),)*
        }

        impl $crate::language::Bundle for $bundle {
            type Signals<V: $crate::language::View> = $signals<V>;

            #[allow(unused_variables)]
            fn source<V: $crate::language::View>(
                &self, port: &str, doc: &[&str], make: &mut dyn $crate::language::Make<V>,
            ) -> $signals<V> {
                let $bundle { $($field,)* } = self;
                let there = usize::from($there);
                $signals { $($signal: $crate::bundle!(@make $direction make, port, doc, there, [$($doc),*] $name $(, $width)?),)* }
            }

            #[allow(unused_variables)]
            fn sink<V: $crate::language::View>(
                &self, port: &str, doc: &[&str], make: &mut dyn $crate::language::Make<V>,
            ) -> $signals<$crate::language::Flip<V>> {
                let $bundle { $($field,)* } = self;
                let there = usize::from($there);
                $signals {
                    $($signal: $crate::bundle!(@flip make $direction make, port, doc, there, [$($doc),*] $name $(, $width)?),)*
                }
            }

            fn visit_source<V: $crate::language::View>(
                port: &str, signals: &$signals<V>, visitor: &mut dyn $crate::language::Visit<V>,
            ) {
                $($crate::block!(@visit $direction visitor, (&format!("{port}_{}", $name), &signals.$signal) $(, $width)?);)*
            }

            fn visit_sink<V: $crate::language::View>(
                port: &str,
                signals: &$signals<$crate::language::Flip<V>>,
                visitor: &mut dyn $crate::language::Visit<V>,
            ) {
                $($crate::bundle!(
                    @flip visit $direction visitor, (&format!("{port}_{}", $name), &signals.$signal) $(, $width)?
                );)*
            }

            fn visit_mut_source<V: $crate::language::View>(
                signals: &mut $signals<V>, visitor: &mut dyn $crate::language::VisitMut<V>,
            ) {
                $($crate::block!(@visit $direction visitor, (&mut signals.$signal) $(, $width)?);)*
            }

            fn visit_mut_sink<V: $crate::language::View>(
                signals: &mut $signals<$crate::language::Flip<V>>, visitor: &mut dyn $crate::language::VisitMut<V>,
            ) {
                $($crate::bundle!(@flip visit $direction visitor, (&mut signals.$signal) $(, $width)?);)*
            }
        }

        #[allow(dead_code)]
        impl<'k, A> $signals<A>
        where
            A: $crate::language::View<Out = $crate::language::Expr<'k>, OutBit = $crate::language::Expr<'k>>,
            A::In: $crate::language::Drive<'k>,
            A::InBit: $crate::language::Drive<'k>,
        {
            /// Connects who sends with who receives.
            pub fn connect<B>(&self, to: &$signals<B>)
            where
                B: $crate::language::View<In = $crate::language::Expr<'k>, InBit = $crate::language::Expr<'k>>,
                B::Out: $crate::language::Drive<'k>,
                B::OutBit: $crate::language::Drive<'k>,
            {
                $($crate::bundle!(@forth $direction self.$signal, to.$signal);)*
                $($crate::bundle!(@back $direction self.$signal, to.$signal);)*
            }
        }

        #[allow(dead_code)]
        impl<'k> $signals<$crate::language::Flip<$crate::language::Inside<'k>>> {
            /// What the block receives, to be sent on inside it.
            pub fn inward(&self) -> $signals<$crate::language::Outside<'k>> {
                $signals { $($signal: $crate::bundle!(@inward $direction self.$signal),)* }
            }
        }

        impl Clone for $signals<$crate::language::Outside<'_>> {
            fn clone(&self) -> Self {
                *self
            }
        }

        impl Copy for $signals<$crate::language::Outside<'_>> {}
    };
    (@flip make in $($rest:tt)*) => { $crate::bundle!(@make out $($rest)*) };
    (@flip make out $($rest:tt)*) => { $crate::bundle!(@make in $($rest)*) };
    (@flip visit in $($rest:tt)*) => { $crate::block!(@visit out $($rest)*) };
    (@flip visit out $($rest:tt)*) => { $crate::block!(@visit in $($rest)*) };
    (@make in $make:ident, $port:ident, $of_port:ident, $there:ident, $doc:tt $name:literal) => {
        $crate::bundle!(@made $make.in_bit, $port, $of_port, $doc $name, $there)
    };
    (@make out $make:ident, $port:ident, $of_port:ident, $there:ident, $doc:tt $name:literal) => {
        $crate::bundle!(@made $make.out_bit, $port, $of_port, $doc $name, $there)
    };
    (@make in $make:ident, $port:ident, $of_port:ident, $there:ident, $doc:tt $name:literal, $width:expr) => {
        $crate::bundle!(@made $make.input, $port, $of_port, $doc $name, $there * $crate::language::Width::from($width).0)
    };
    (@make out $make:ident, $port:ident, $of_port:ident, $there:ident, $doc:tt $name:literal, $width:expr) => {
        $crate::bundle!(@made $make.output, $port, $of_port, $doc $name, $there * $crate::language::Width::from($width).0)
    };
    (@made $make:ident.$method:ident, $port:ident, $of_port:ident, $doc:tt $name:literal, $bits:expr) => {{
        let lines = $crate::language::comment(&$doc, $port, $of_port);
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        $make.$method(&format!("{}_{}", $port, $name), $bits, &lines)
    }};
    (@forth out $from:expr, $to:expr) => { $crate::language::Drive::drive(&$to, $from) };
    (@forth in $from:expr, $to:expr) => {};
    (@back in $from:expr, $to:expr) => { $crate::language::Drive::drive(&$from, $to) };
    (@back out $from:expr, $to:expr) => {};
    (@inward out $signal:expr) => { $signal };
    (@inward in $signal:expr) => { $signal.net() };
}

#[cfg(test)]
mod tests;
