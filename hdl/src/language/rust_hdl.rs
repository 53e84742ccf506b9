//! A block of the language as a block of rust-hdl: in rust-hdl's designs, its ports are signals.

use std::ops::{Deref, DerefMut};

use rust_hdl::core::probe::Probe;
use rust_hdl::prelude::{Bit, Block as RustHdlBlock, Clock, Direction, In, Logic, Out, Signal};

use super::hierarchy::Hierarchy;
use super::ports::{kernel_of, Block, Interface, Make, View, Visit, VisitMut};
use super::run::{Run, Slot};
use crate::wire::{Wire, Word};

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
trait Port: RustHdlBlock {
    /// The current value.
    fn read(&self) -> Word;
    /// Sets the value after the next update.
    fn write(&mut self, value: Word);
    /// Marks the port as driven by its block.
    fn drive(&mut self);
}

macro_rules! port {
    ([$($generics:tt)*] $signal:ty, $self:ident => $read:expr, $value:ident => $next:expr) => {
        impl $($generics)* Port for $signal {
            fn read(&$self) -> Word {
                $read
            }

            fn write(&mut self, $value: Word) {
                self.next = $next;
            }

            fn drive(&mut self) {
                Logic::connect(self);
            }
        }
    };
}

port!([<D: Direction>] Wire<D>, self => self.val().word(), value => value.into());
port!([] Signal<In, Bit>, self => self.val().into(), value => value.number() == 1);
port!([] Signal<Out, Bit>, self => self.val().into(), value => value.number() == 1);

/// Calls a function with each port: its name, whether it is an output.
struct Each<F>(F);

impl<F: FnMut(&str, bool, &dyn Port)> Visit<Signals> for Each<F> {
    fn in_bit(&mut self, name: &str, port: &Signal<In, Bit>) {
        self.0(name, false, port);
    }

    fn out_bit(&mut self, name: &str, port: &Signal<Out, Bit>) {
        self.0(name, true, port);
    }

    fn input(&mut self, name: &str, port: &Wire<In>) {
        self.0(name, false, port);
    }

    fn output(&mut self, name: &str, port: &Wire<Out>) {
        self.0(name, true, port);
    }
}

/// Calls a function with each port, to change it: whether it is an output.
struct EachMut<F>(F);

impl<F: FnMut(bool, &mut dyn Port)> VisitMut<Signals> for EachMut<F> {
    fn in_bit(&mut self, port: &mut Signal<In, Bit>) {
        self.0(false, port);
    }

    fn out_bit(&mut self, port: &mut Signal<Out, Bit>) {
        self.0(true, port);
    }

    fn input(&mut self, port: &mut Wire<In>) {
        self.0(false, port);
    }

    fn output(&mut self, port: &mut Wire<Out>) {
        self.0(true, port);
    }
}

struct MakeSignals;

/// A port that is left out is one that nothing reads; an input of this kind counts as driven, or rust-hdl asks its user to connect
/// what is not there.
fn driven_unless<P: Port>(there: bool, mut port: P) -> P {
    if !there {
        port.drive();
    }
    port
}

impl Make<Signals> for MakeSignals {
    fn in_bit(&mut self, _: &str, bits: usize, _: &[&str]) -> Signal<In, Bit> {
        driven_unless(bits > 0, Default::default())
    }

    fn out_bit(&mut self, _: &str, _: usize, _: &[&str]) -> Signal<Out, Bit> {
        Default::default()
    }

    fn input(&mut self, _: &str, bits: usize, _: &[&str]) -> Wire<In> {
        driven_unless(bits > 0, Wire::new(bits.max(1)))
    }

    fn output(&mut self, _: &str, bits: usize, _: &[&str]) -> Wire<Out> {
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
        B::visit(&ports, &mut Each(|name: &str, _, _: &dyn Port| slots.push(run.slot("", name))));
        RustHdl { clk: Default::default(), ports, run, slots, started: false }
    }
}

impl<B: Interface> RustHdl<B> {
    fn update_ports(&mut self, outputs: bool) {
        B::visit_mut(
            &mut self.ports,
            &mut EachMut(|is_output: bool, port: &mut dyn Port| {
                if is_output == outputs {
                    port.update_all();
                }
            }),
        );
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
        let mut at = slots.iter();
        B::visit(
            ports,
            &mut Each(|_: &str, is_output: bool, port: &dyn Port| {
                if let Some(&slot) = at.next().filter(|slot| !is_output && slot.bits() > 0) {
                    run.set(slot, port.read());
                }
            }),
        );
        if B::CLOCK.is_some() && clk.pos_edge() {
            run.clock();
        }
        run.settle();
        let mut at = slots.iter();
        B::visit_mut(
            ports,
            &mut EachMut(|is_output: bool, port: &mut dyn Port| {
                if let Some(&slot) = at.next().filter(|slot| is_output && slot.bits() > 0) {
                    port.write(run.get(slot));
                }
            }),
        );
    }

    fn connect(&mut self) {
        B::visit_mut(
            &mut self.ports,
            &mut EachMut(|is_output: bool, port: &mut dyn Port| {
                if is_output {
                    port.drive();
                }
            }),
        );
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
        B::visit(&self.ports, &mut Each(|_: &str, _, port: &dyn Port| changed |= port.has_changed()));
        changed
    }

    fn accept(&self, name: &str, probe: &mut dyn Probe) {
        probe.visit_start_scope(name, self);
        if let Some(clock) = B::CLOCK {
            self.clk.accept(clock, probe);
        }
        B::visit(&self.ports, &mut Each(|name: &str, _, port: &dyn Port| port.accept(name, probe)));
        probe.visit_end_scope(name, self);
    }
}
