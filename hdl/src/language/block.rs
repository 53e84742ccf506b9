//! Declaration of a block: the macro from which its ports follow, seen from each side.

/// Declares a block: a struct of its parameters, and a struct of its ports, each once.
///
/// ```text
/// block! {
///     /// Output queue.
///     pub struct Queue {
///         /// Width of a beat in bits.
///         bits: usize,
///     }
///     ports QueuePorts {
///         clock;
///         reset;
///         /// Writes a beat in this cycle.
///         in write;
///         /// Data of the beat; valid with `write`.
///         in word: bits;
///         /// A beat can be written in this cycle.
///         out room;
///     }
/// }
///
/// impl Block for Queue {
///     fn build<'k>(&self, k: &'k Builder, io: QueuePorts<Inside<'k>>) { … }
/// }
/// ```
/// A port without a width is one bit wide; a width is an expression of the parameters, which are in scope by their names.
/// `source<Stream> m_axis: bits` are the ports of a [bundle](crate::bundle), `Stream::from(bits)`, that the block sends, with `sink`
/// one that it receives.
/// A port of width 0 is left out: on either side what reads it is 0, and what drives it goes nowhere.
/// `clock` is the port `clk`, `clock aclk` one of another name, `reset` the port `rst`. A block without `clock` is
/// combinational.
#[macro_export]
macro_rules! block {
    (
        $(#[$meta:meta])*
        $vis:vis struct $block:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty),* $(,)? }
        ports $ports:ident { clock; reset; $($port:tt)* }
    ) => {
        $crate::block! {
            @ Some("clk"), [$(#[$meta])*] $vis $block, $ports, [$($(#[$field_meta])* $field_vis $field: $field_type,)*]
            { #[doc = " Synchronous reset, active high."] in rst; $($port)* }
        }
    };
    (
        $(#[$meta:meta])*
        $vis:vis struct $block:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty),* $(,)? }
        ports $ports:ident { clock; $($port:tt)* }
    ) => {
        $crate::block! {
            @ Some("clk"), [$(#[$meta])*] $vis $block, $ports,
            [$($(#[$field_meta])* $field_vis $field: $field_type,)*] { $($port)* }
        }
    };
    (
        $(#[$meta:meta])*
        $vis:vis struct $block:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty),* $(,)? }
        ports $ports:ident { clock $clock:ident; $($port:tt)* }
    ) => {
        $crate::block! {
            @ Some(stringify!($clock)), [$(#[$meta])*] $vis $block, $ports,
            [$($(#[$field_meta])* $field_vis $field: $field_type,)*] { $($port)* }
        }
    };
    (
        $(#[$meta:meta])*
        $vis:vis struct $block:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty),* $(,)? }
        ports $ports:ident { $($port:tt)* }
    ) => {
        $crate::block! {
            @ None, [$(#[$meta])*] $vis $block, $ports, [$($(#[$field_meta])* $field_vis $field: $field_type,)*] { $($port)* }
        }
    };
    (
        @ $clock:expr, [$($meta:tt)*] $vis:vis $block:ident, $ports:ident,
        [$($(#[$field_meta:meta])* $field_vis:vis $field:ident: $field_type:ty,)*]
        { $($(#[doc = $doc:literal])+ $direction:ident $(<$bundle:ident>)? $port:ident $(: $width:expr)?;)* }
    ) => {
        $($meta)*
        $vis struct $block { $($(#[$field_meta])* $field_vis $field: $field_type,)* }

        #[doc = concat!("Ports of [`", stringify!($block), "`].")]
        $vis struct $ports<V: $crate::language::View> {
            $($(#[doc = $doc])+ pub $port: $crate::block!(@type $direction V $([$bundle])? $($width)?),)*
        }

        impl $crate::language::Interface for $block {
            type Ports<V: $crate::language::View> = $ports<V>;

            const NAME: &'static str = stringify!($block);

            const CLOCK: Option<&'static str> = $clock;

            #[allow(unused_variables)]
            fn ports<V: $crate::language::View>(&self, make: &mut dyn $crate::language::Make<V>) -> $ports<V> {
                #[allow(unused_imports)]
                use $crate::language::Interface as _;
                let $block { $($field,)* } = self;
                $ports { $($port: $crate::block!(@make $direction make, stringify!($port), [$($doc),+] $(, [$bundle])? $(, $width)?),)* }
            }

            #[allow(unused_variables)]
            fn visit<V: $crate::language::View>(ports: &$ports<V>, visitor: &mut dyn $crate::language::Visit<V>) {
                $($crate::block!(@visit $direction visitor, (stringify!($port), &ports.$port) $(, [$bundle])? $(, $width)?);)*
            }

            #[allow(unused_variables)]
            fn visit_mut<V: $crate::language::View>(
                ports: &mut $ports<V>,
                visitor: &mut dyn $crate::language::VisitMut<V>,
            ) {
                $($crate::block!(@visit $direction visitor, (&mut ports.$port) $(, [$bundle])? $(, $width)?);)*
            }
        }
    };
    (@type in $view:ident) => { <$view as $crate::language::View>::InBit };
    (@type out $view:ident) => { <$view as $crate::language::View>::OutBit };
    (@type in $view:ident $width:expr) => { <$view as $crate::language::View>::In };
    (@type out $view:ident $width:expr) => { <$view as $crate::language::View>::Out };
    (@type source $view:ident [$bundle:ident] $width:expr) => { <$bundle as $crate::language::Bundle>::Signals<$view> };
    (@type sink $view:ident [$bundle:ident] $width:expr) => {
        <$bundle as $crate::language::Bundle>::Signals<$crate::language::Flip<$view>>
    };
    (@make in $make:ident, $name:expr, $doc:tt) => { $make.in_bit($name, 1, &$doc) };
    (@make out $make:ident, $name:expr, $doc:tt) => { $make.out_bit($name, 1, &$doc) };
    (@make in $make:ident, $name:expr, $doc:tt, $width:expr) => {
        $make.input($name, $crate::language::Width::from($width).0, &$doc)
    };
    (@make out $make:ident, $name:expr, $doc:tt, $width:expr) => {
        $make.output($name, $crate::language::Width::from($width).0, &$doc)
    };
    (@make source $make:ident, $name:expr, $doc:tt, [$bundle:ident], $value:expr) => {
        $crate::language::Bundle::source(&$bundle::from($value), $name, &$doc, $make)
    };
    (@make sink $make:ident, $name:expr, $doc:tt, [$bundle:ident], $value:expr) => {
        $crate::language::Bundle::sink(&$bundle::from($value), $name, &$doc, $make)
    };
    (@visit in $visitor:ident, $port:tt) => { $visitor.in_bit $port };
    (@visit out $visitor:ident, $port:tt) => { $visitor.out_bit $port };
    (@visit in $visitor:ident, $port:tt, $width:expr) => { $visitor.input $port };
    (@visit out $visitor:ident, $port:tt, $width:expr) => { $visitor.output $port };
    (@visit source $visitor:ident, ($name:expr, $port:expr), [$bundle:ident], $value:expr) => {
        <$bundle as $crate::language::Bundle>::visit_source($name, $port, $visitor)
    };
    (@visit sink $visitor:ident, ($name:expr, $port:expr), [$bundle:ident], $value:expr) => {
        <$bundle as $crate::language::Bundle>::visit_sink($name, $port, $visitor)
    };
    (@visit source $visitor:ident, ($port:expr), [$bundle:ident], $value:expr) => {
        <$bundle as $crate::language::Bundle>::visit_mut_source($port, $visitor)
    };
    (@visit sink $visitor:ident, ($port:expr), [$bundle:ident], $value:expr) => {
        <$bundle as $crate::language::Bundle>::visit_mut_sink($port, $visitor)
    };
}
