//! A block of the language as a block of rust-hdl: in rust-hdl's designs, its ports are signals.

use std::ops::{Deref, DerefMut};

use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::{Bit, Block as RustHdlBlock, Clock, In, Logic, Out, Signal};

use super::block::{Body, Port};
use super::ports::{kernel_of, Block, Interface, Make, View};
use crate::wire::Wire;

/// Ports as signals of rust-hdl.
#[derive(Clone, Copy, Debug)]
pub struct Signals;

impl View for Signals {
    type InBit = Signal<In, Bit>;
    type OutBit = Signal<Out, Bit>;
    type In = Wire<In>;
    type Out = Wire<Out>;
}

/// A port as a signal of rust-hdl.
pub trait SignalPort: Port + RustHdlBlock {}

impl<T: Port + RustHdlBlock> SignalPort for T {}

struct MakeSignals;

impl Make<Signals> for MakeSignals {
    fn in_bit(&mut self, _: &'static str, _: &'static [&'static str]) -> Signal<In, Bit> {
        Default::default()
    }

    fn out_bit(&mut self, _: &'static str, _: &'static [&'static str]) -> Signal<Out, Bit> {
        Default::default()
    }

    fn input(&mut self, _: &'static str, bits: usize, _: &'static [&'static str]) -> Wire<In> {
        Wire::new(bits)
    }

    fn output(&mut self, _: &'static str, bits: usize, _: &'static [&'static str]) -> Wire<Out> {
        Wire::new(bits)
    }
}

/// `B` in a design of rust-hdl. Its ports are fields, as if they were declared in this struct.
pub struct RustHdl<B: Interface> {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    ports: B::Ports<Signals>,
    kernel: Body,
}

impl<B: Block> RustHdl<B> {
    /// `block` with its behaviour.
    pub fn new(block: B) -> Self {
        let ports = block.ports(&mut MakeSignals);
        RustHdl { clk: Default::default(), ports, kernel: Body::of(kernel_of(&block)) }
    }
}

impl<B: Block + Default> Default for RustHdl<B> {
    fn default() -> Self {
        RustHdl::new(B::default())
    }
}

impl<B: Interface> RustHdl<B> {
    /// The kernel.
    pub fn kernel(&self) -> &super::Kernel {
        self.kernel.kernel()
    }

    fn update_ports(&mut self, outputs: bool) {
        B::visit_mut(&mut self.ports, &mut |_, is_output, port| {
            if is_output == outputs {
                port.update_all();
            }
        });
    }
}

impl<B: Interface> Deref for RustHdl<B> {
    type Target = B::Ports<Signals>;

    fn deref(&self) -> &Self::Target {
        &self.ports
    }
}

impl<B: Interface> DerefMut for RustHdl<B> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.ports
    }
}

impl<B: Interface> Logic for RustHdl<B> {
    fn update(&mut self) {
        let RustHdl { clk, ports, kernel } = self;
        let mut changed = false;
        B::visit(ports, &mut |_, is_output, port| changed |= !is_output && port.has_new_value());
        let edge = B::CLOCK.is_some() && clk.pos_edge();
        let inputs = |set: &mut dyn FnMut(usize, &dyn Port), ports: &B::Ports<Signals>| {
            let mut index = 0;
            B::visit(ports, &mut |_, is_output, port| {
                if !is_output {
                    set(index, port);
                    index += 1;
                }
            });
        };
        // The body reads the inputs before it writes the outputs.
        let cell = std::cell::RefCell::new(ports);
        kernel.update(
            edge,
            changed,
            |set| inputs(set, &cell.borrow()),
            |take| {
                let mut index = 0;
                B::visit_mut(&mut cell.borrow_mut(), &mut |_, is_output, port| {
                    if is_output {
                        take(index, port);
                        index += 1;
                    }
                });
            },
        );
    }

    fn connect(&mut self) {
        B::visit_mut(&mut self.ports, &mut |_, is_output, port| {
            if is_output {
                port.drive();
            }
        });
    }
}

impl<B: Interface> RustHdlBlock for RustHdl<B> {
    fn connect_all(&mut self) {
        self.connect();
    }

    fn update_all(&mut self) {
        self.clk.update_all();
        self.update_ports(false);
        if self.has_changed() {
            self.update();
            self.update_ports(true);
        }
    }

    fn has_changed(&self) -> bool {
        let mut changed = self.clk.has_changed() || self.kernel.has_changed();
        B::visit(&self.ports, &mut |_, _, port| changed |= port.has_changed());
        changed
    }

    fn accept(&self, name: &str, probe: &mut dyn Probe) {
        probe.visit_start_scope(name, self);
        if let Some(clock) = B::CLOCK {
            self.clk.accept(clock, probe);
        }
        B::visit(&self.ports, &mut |name, _, port| port.accept(name, probe));
        self.kernel.accept("kernel", probe);
        probe.visit_end_scope(name, self);
    }
}
