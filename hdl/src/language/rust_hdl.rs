//! A block of the language as a block of rust-hdl: in rust-hdl's designs, its ports are signals.

use std::ops::{Deref, DerefMut};

use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::{Bit, Block as RustHdlBlock, Clock, Direction, In, Logic, Out, Signal};

use super::hierarchy::Hierarchy;
use super::ports::{kernel_of, Block, Interface, Make, View};
use super::run::{Run, Slot};
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

/// A port as a signal of rust-hdl, whose value is limbs of 64 bits, least significant first.
pub trait SignalPort: RustHdlBlock {
    /// Gives the current value to `take`; limbs at the end that are zeros may be missing.
    fn read(&self, take: &mut dyn FnMut(&[u64]));
    /// Sets the value after the next update.
    fn write(&mut self, value: &[u64]);
    /// Marks the port as driven by its block.
    fn drive(&mut self);
}

impl<D: Direction> SignalPort for Wire<D> {
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

macro_rules! one_bit {
    ($direction:ty) => {
        impl SignalPort for Signal<$direction, Bit> {
            fn read(&self, take: &mut dyn FnMut(&[u64])) {
                take(&[u64::from(self.val())]);
            }

            fn write(&mut self, value: &[u64]) {
                self.next = value[0] != 0;
            }

            fn drive(&mut self) {
                Logic::connect(self);
            }
        }
    };
}

one_bit!(In);
one_bit!(Out);

struct MakeSignals;

impl Make<Signals> for MakeSignals {
    fn in_bit(&mut self, _: &'static str, _: &'static [&'static str]) -> Signal<In, Bit> {
        Default::default()
    }

    fn out_bit(&mut self, _: &'static str, _: &'static [&'static str]) -> Signal<Out, Bit> {
        Default::default()
    }

    // A port that is left out is a wire that nothing reads or drives.
    fn input(&mut self, _: &'static str, bits: usize, _: &'static [&'static str]) -> Wire<In> {
        Wire::new(bits.max(1))
    }

    fn output(&mut self, _: &'static str, bits: usize, _: &'static [&'static str]) -> Wire<Out> {
        Wire::new(bits.max(1))
    }
}

/// The block `B` in a design of rust-hdl. Its ports are fields, as if they were declared in this struct; what is inside is
/// simulated as one kernel.
pub struct RustHdl<B: Interface> {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    ports: B::Ports<Signals>,
    run: Run,
    /// Where the simulation has the ports, in the order of their declaration.
    slots: Vec<Slot>,
    started: bool,
}

impl<B: Block> RustHdl<B> {
    /// `block` with its behaviour.
    pub fn new(block: B) -> Self {
        let ports = block.ports(&mut MakeSignals);
        let run = Run::new(&Hierarchy::of_kernel(kernel_of(&block)), &[]);
        let mut slots = Vec::new();
        B::visit(&ports, &mut |name, _, _| slots.push(run.slot("", name)));
        RustHdl { clk: Default::default(), ports, run, slots, started: false }
    }
}

impl<B: Interface> RustHdl<B> {
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
        let RustHdl { clk, ports, run, slots, started } = self;
        *started = true;
        let mut index = 0..;
        B::visit(ports, &mut |_, is_output, port| {
            let slot = index.next().map(|at| slots[at]).unwrap_or_default();
            if !is_output {
                port.read(&mut |limbs| run.set_limbs(slot, limbs));
            }
        });
        if B::CLOCK.is_some() && clk.pos_edge() {
            run.clock();
        }
        run.settle();
        let mut index = 0..;
        B::visit_mut(ports, &mut |_, is_output, port| {
            let slot = index.next().map(|at| slots[at]).unwrap_or_default();
            if is_output && slot.bits() > 0 {
                port.write(run.get(slot).limbs());
            }
        });
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
        let mut changed = self.clk.has_changed() || !self.started;
        B::visit(&self.ports, &mut |_, _, port| changed |= port.has_changed());
        changed
    }

    fn accept(&self, name: &str, probe: &mut dyn Probe) {
        probe.visit_start_scope(name, self);
        if let Some(clock) = B::CLOCK {
            self.clk.accept(clock, probe);
        }
        B::visit(&self.ports, &mut |name, _, port| port.accept(name, probe));
        probe.visit_end_scope(name, self);
    }
}
