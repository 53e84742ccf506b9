//! Designs of two blocks: their modules, and what is wrong with them.

use rust_hdl::prelude::*;

use super::*;
use crate::kernel_block;
use crate::language::{Body, Builder};

/// The contrary of a bit.
#[derive(dermis_hdl_derive::Block)]
struct Inverter {
    a: Signal<In, Bit>,
    b: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(Inverter, inputs[a], outputs[b]);

impl Default for Inverter {
    fn default() -> Self {
        let k = Builder::combinational("inverter");
        k.wire("b", !k.input("a", 1));
        Inverter { a: Default::default(), b: Default::default(), kernel: Body::default() }.bind(k.finish())
    }
}

/// Two inverters, one behind the other.
#[derive(dermis_hdl_derive::Block, Default)]
struct Chain {
    a: Signal<In, Bit>,
    b: Signal<Out, Bit>,
    first: Inverter,
    second: Inverter,
}

impl Logic for Chain {
    #[hdl_gen]
    fn update(&mut self) {
        self.first.a.next = self.a.val();
        self.second.a.next = self.first.b.val();
        self.b.next = self.second.b.val();
    }
}

/// Two inverters in a ring while `a` is high.
#[derive(dermis_hdl_derive::Block, Default)]
struct Ring {
    a: Signal<In, Bit>,
    b: Signal<Out, Bit>,
    first: Inverter,
    second: Inverter,
}

impl Logic for Ring {
    #[hdl_gen]
    fn update(&mut self) {
        self.first.a.next = self.second.b.val() & self.a.val();
        self.second.a.next = self.first.b.val();
        self.b.next = self.second.b.val();
    }
}

/// An instance with a name that tools refuse.
#[derive(dermis_hdl_derive::Block, Default)]
struct Named {
    a: Signal<In, Bit>,
    b: Signal<Out, Bit>,
    program: Inverter,
}

impl Logic for Named {
    #[hdl_gen]
    fn update(&mut self) {
        self.program.a.next = self.a.val();
        self.b.next = self.program.b.val();
    }
}

#[test]
fn an_instance_named_by_a_keyword_is_an_error() {
    let error = Hierarchy::of(&Named::default()).check().unwrap_err();
    assert!(error.to_string().contains("program"), "{error}");
    assert!(matches!(error, KernelError::Name { .. }));
}

#[test]
fn a_block_that_connects_others_is_a_module_with_instances() {
    let hierarchy = Hierarchy::of(&Chain::default());
    hierarchy.check().unwrap();
    let comment = |path: &str, port: &str| (path.is_empty() && port == "a").then(|| "A bit.".to_owned());
    let text = hierarchy.verilog("chain", &Attributes::new(), &comment);
    let chain = "\
module chain (
    // A bit.
    input wire a,
    output wire b
);
    wire first__a;
    wire first__b;
    wire second__a;
    wire second__b;
    assign first__a = a;
    assign second__a = first__b;
    assign b = second__b;
    chain__first first (
        .a(first__a),
        .b(first__b)
    );
    chain__second second (
        .a(second__a),
        .b(second__b)
    );
endmodule
";
    assert!(text.starts_with(chain), "{text}");
    assert!(
        text.contains("module chain__first (\n    input wire a,\n    output wire b\n);\n    assign b = !a;\n"),
        "{text}"
    );
}

#[test]
fn a_loop_through_several_blocks_is_named() {
    let error = Hierarchy::of(&Ring::default()).check().unwrap_err().to_string();
    let ring = "second__b, second__a, first__b, first__a";
    assert_eq!(error, format!("block second, signal b: combinational loop through {ring}: `~a`"));
}
