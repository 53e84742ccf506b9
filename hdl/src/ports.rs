//! Ports that several blocks share, so that one of them can stand in another's place.
//!
//! rust-hdl connects the fields of blocks, and has no block that is chosen when the design is built. So a set of ports
//! is a struct of its own, declared with `ports!`: blocks that hold it in their field `ports` have these ports under
//! the names of its fields, as if the fields were their own. `one_of!` declares an enum of such blocks, which is used
//! like any of them.

/// Declares a struct of ports. Inside a block its fields keep their names.
macro_rules! ports {
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$port_meta:meta])* pub $port:ident: $type:ty,)+ }) => {
        $(#[$meta])*
        pub struct $name {
            $($(#[$port_meta])* pub $port: $type,)+
        }

        impl rust_hdl::prelude::Logic for $name {
            fn update(&mut self) {}
        }

        impl rust_hdl::prelude::Block for $name {
            fn connect_all(&mut self) {
                $(self.$port.connect_all();)+
            }

            fn update_all(&mut self) {
                $(self.$port.update_all();)+
            }

            fn has_changed(&self) -> bool {
                false $(|| self.$port.has_changed())+
            }

            // Without a scope of its own: the ports are those of the block around it.
            fn accept(&self, _name: &str, probe: &mut dyn rust_hdl::core::probe::Probe) {
                $(self.$port.accept(stringify!($port), probe);)+
            }
        }
    };
}

/// Gives a block the ports of its field `ports`.
macro_rules! has_ports {
    ($block:ty: $ports:ty) => {
        impl std::ops::Deref for $block {
            type Target = $ports;

            fn deref(&self) -> &$ports {
                &self.ports
            }
        }

        impl std::ops::DerefMut for $block {
            fn deref_mut(&mut self) -> &mut $ports {
                &mut self.ports
            }
        }
    };
}

/// Declares an enum of blocks with the same ports.
macro_rules! one_of {
    ($(#[$meta:meta])* pub enum $name:ident: $ports:ty { $($(#[$block_meta:meta])* $block:ident,)+ }) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$block_meta])* $block(Box<$block>),)+
        }

        impl std::ops::Deref for $name {
            type Target = $ports;

            fn deref(&self) -> &$ports {
                match self {
                    $($name::$block(block) => block,)+
                }
            }
        }

        impl std::ops::DerefMut for $name {
            fn deref_mut(&mut self) -> &mut $ports {
                match self {
                    $($name::$block(block) => block,)+
                }
            }
        }

        impl rust_hdl::prelude::Logic for $name {
            fn update(&mut self) {}
        }

        impl rust_hdl::prelude::Block for $name {
            fn connect_all(&mut self) {
                match self {
                    $($name::$block(block) => block.connect_all(),)+
                }
            }

            fn update_all(&mut self) {
                match self {
                    $($name::$block(block) => block.update_all(),)+
                }
            }

            fn has_changed(&self) -> bool {
                match self {
                    $($name::$block(block) => block.has_changed(),)+
                }
            }

            // The scope is the block's own.
            fn accept(&self, name: &str, probe: &mut dyn rust_hdl::core::probe::Probe) {
                match self {
                    $($name::$block(block) => block.accept(name, probe),)+
                }
            }
        }
    };
}

pub(crate) use {has_ports, one_of, ports};
