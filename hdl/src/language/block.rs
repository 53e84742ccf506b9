//! A kernel as the body of a rust-hdl block.

use std::sync::Arc;

use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::*;

use super::compile::limbs;
use super::error::KernelError;
use super::hierarchy::{visit, Hierarchy};
use super::kernel::{Kernel, Role};
use super::simulate::Simulation;
use crate::wire::Wire;

/// A port of a rust-hdl block as limbs of 64 bits, least significant first.
pub trait Port {
    /// Width in bits.
    fn port_bits(&self) -> usize;
    /// Whether the value changed in the last update.
    fn has_new_value(&self) -> bool;
    /// Gives the current value to `take`; limbs at the end that are zeros may be missing.
    fn read(&self, take: &mut dyn FnMut(&[u64]));
    /// Sets the value after the next update.
    fn write(&mut self, value: &[u64]);
    /// Marks the port as driven by its block.
    fn drive(&mut self);
}

impl<D: Direction> Port for Wire<D> {
    fn port_bits(&self) -> usize {
        self.width()
    }

    fn has_new_value(&self) -> bool {
        self.changed()
    }

    fn read(&self, take: &mut dyn FnMut(&[u64])) {
        take(self.limbs());
    }

    fn write(&mut self, value: &[u64]) {
        self.next.set_limbs(value);
    }

    fn drive(&mut self) {
        Logic::connect(self);
    }
}

macro_rules! one_bit_port {
    ($direction:ty, $type:ty, $bit:expr) => {
        impl Port for Signal<$direction, $type> {
            fn port_bits(&self) -> usize {
                1
            }

            fn has_new_value(&self) -> bool {
                self.changed
            }

            fn read(&self, take: &mut dyn FnMut(&[u64])) {
                let bit: fn($type) -> bool = $bit;
                take(&[u64::from(bit(self.val()))]);
            }

            fn write(&mut self, value: &[u64]) {
                self.next = (value[0] != 0).into();
            }

            fn drive(&mut self) {
                Logic::connect(self);
            }
        }
    };
}

one_bit_port!(In, Bit, |bit| bit);
one_bit_port!(Out, Bit, |bit| bit);
one_bit_port!(In, Clock, |clock| clock.clk);

/// First limb and limbs of a port in the simulation.
type Place = (usize, usize);

/// A kernel bound to the ports of its block, with its simulation. [`kernel_block!`](crate::kernel_block) calls it.
#[derive(Debug, Default)]
pub struct Body {
    kernel: Arc<Kernel>,
    simulation: Option<Simulation>,
    inputs: Vec<Place>,
    outputs: Vec<Place>,
    started: bool,
}

impl Body {
    /// Binds the ports, by name and width, to the kernel's signals of the same names.
    pub fn new(mut kernel: Kernel, inputs: &[(&str, usize)], outputs: &[(&str, usize)]) -> Self {
        for (ports, is_output) in [(inputs, false), (outputs, true)] {
            for &(port, bits) in ports {
                kernel.bind(port, bits, is_output);
            }
        }
        let simulation = kernel.errors().is_empty().then(|| Simulation::new(&kernel));
        let places = |ports: &[(&str, usize)]| -> Vec<Place> {
            let place = |(name, bits): &(&str, usize)| {
                let slot = simulation.as_ref().and_then(|simulation| simulation.slot_of(&kernel, name));
                (slot.unwrap_or_default(), limbs(*bits) as usize)
            };
            ports.iter().map(place).collect()
        };
        let (inputs, outputs) = (places(inputs), places(outputs));
        Body { kernel: Arc::new(kernel), simulation, inputs, outputs, started: false }
    }

    /// The behaviour of a block whose kernel has ports of its own, with the blocks inside it.
    pub(super) fn of(kernel: Kernel) -> Self {
        let ports = kernel.ports.clone();
        let simulated = match kernel.errors().is_empty() && !kernel.instances.is_empty() {
            true => &Hierarchy::of_kernel(kernel.clone()).flat(&[]),
            false => &kernel,
        };
        let simulation = simulated.errors().is_empty().then(|| Simulation::new(simulated));
        let places = |is_output: bool| -> Vec<Place> {
            let place = |port: &super::kernel::Port| {
                let slot = simulation.as_ref().and_then(|simulation| simulation.slot_of(simulated, &port.name));
                (slot.unwrap_or_default(), limbs(port.bits) as usize)
            };
            ports.iter().filter(|port| port.output == is_output).map(place).collect()
        };
        let (inputs, outputs) = (places(false), places(true));
        Body { kernel: Arc::new(kernel), simulation, inputs, outputs, started: false }
    }

    /// The kernel.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// One update of rust-hdl: new inputs, a clock edge, or the first of all. `inputs` sets and `outputs` takes the
    /// values of the ports; they are called only if something changed.
    pub fn update(
        &mut self,
        edge: bool,
        changed: bool,
        inputs: impl FnOnce(&mut dyn FnMut(usize, &dyn Port)),
        outputs: impl FnOnce(&mut dyn FnMut(usize, &mut dyn Port)),
    ) {
        if !(edge || changed || !self.started) {
            return;
        }
        self.started = true;
        let Some(simulation) = &mut self.simulation else { return };
        let places = &self.inputs;
        inputs(&mut |index, port| {
            let (slot, limbs) = places[index];
            port.read(&mut |value| simulation.set(slot, limbs, value));
        });
        if edge {
            simulation.clock();
        }
        simulation.show();
        let places = &self.outputs;
        outputs(&mut |index, port| {
            let (slot, limbs) = places[index];
            port.write(simulation.get(slot, limbs));
        });
    }
}

impl Kernel {
    /// Makes the signal `port` a port.
    pub(super) fn bind(&mut self, port: &str, bits: usize, is_output: bool) {
        let found = match self.signal_of(port).map(|id| &mut self.signals[id]) {
            None => "the kernel has no such signal".to_owned(),
            Some(signal) if signal.ty.bits != bits => format!("the kernel's signal has {} bits", signal.ty.bits),
            Some(signal) if (signal.role == Role::Input) == is_output => {
                "the kernel's signal has another direction".to_owned()
            }
            Some(signal) => {
                signal.output = is_output;
                return;
            }
        };
        self.errors.push(KernelError::Port { block: self.block.clone(), port: port.to_owned(), bits, found });
    }
}

impl Logic for Body {
    fn update(&mut self) {}
}

impl Block for Body {
    fn connect_all(&mut self) {}

    fn update_all(&mut self) {}

    /// Until its first update, which shows the outputs of the initial state.
    fn has_changed(&self) -> bool {
        !self.started
    }

    fn accept(&self, _name: &str, _probe: &mut dyn Probe) {
        visit(&self.kernel);
    }
}

/// Implements rust-hdl's `Logic` for a block from its kernel, and `bind`, which makes its field `kernel`.
///
/// ```text
/// kernel_block!(Queue, clock clk, inputs [rst, write, word], outputs [room, m_axis_tvalid]);
/// kernel_block!(Unsearched, ports SearchPorts, clock clk, inputs [rst, start], outputs [done]);
/// ```
/// The ports are fields of the block, or with `ports` those of its field `ports`.
#[macro_export]
macro_rules! kernel_block {
    (@ $block:ty, [$($clock:ident)?], [$($input:ident)*], [$($output:ident)*], $kernel:ident, $fields:pat) => {
        impl $block {
            /// Takes `kernel` as the block's behaviour.
            fn bind(mut self, kernel: $crate::language::Kernel) -> Self {
                use $crate::language::Port;
                self.kernel = $crate::language::Body::new(
                    kernel,
                    &[$((stringify!($input), self.$input.port_bits())),*],
                    &[$((stringify!($output), self.$output.port_bits())),*],
                );
                self
            }
        }

        impl rust_hdl::prelude::Logic for $block {
            fn update(&mut self) {
                #[allow(unused_imports)]
                use $crate::language::Port;
                let edge = false $(|| self.$clock.pos_edge())?;
                let changed = false $(|| self.$input.has_new_value())*;
                let $fields = self;
                $kernel.update(
                    edge,
                    changed,
                    |_set| {
                        let mut _index = 0;
                        $(_set(_index, &*$input); _index += 1;)*
                    },
                    |take| {
                        let mut index = 0;
                        $(take(index, $output); index += 1;)*
                        let _ = index;
                    },
                );
            }

            fn connect(&mut self) {
                use $crate::language::Port;
                $(self.$output.drive();)*
            }
        }
    };
    ($block:ty, $(clock $clock:ident,)? inputs [$($input:ident),* $(,)?], outputs [$($output:ident),* $(,)?]) => {
        $crate::kernel_block!(
            @ $block, [$($clock)?], [$($input)*], [$($output)*], kernel,
            Self { kernel, $($input,)* $($output,)* .. }
        );
    };
    (
        $block:ty, ports $ports:ident, $(clock $clock:ident,)?
        inputs [$($input:ident),* $(,)?], outputs [$($output:ident),* $(,)?]
    ) => {
        $crate::kernel_block!(
            @ $block, [$($clock)?], [$($input)*], [$($output)*], kernel,
            Self { kernel, ports: $ports { $($input,)* $($output,)* .. }, .. }
        );
    };
}
