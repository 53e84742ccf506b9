//! Designs of two blocks: their modules, and what is wrong with them.

use super::*;
use crate::block;
use crate::language::{kernel_of, Block, Builder, Inside};

block! {
    /// The contrary of a bit.
    #[derive(Default)]
    struct Inverter {}
    ports InverterPorts {
        /// A bit.
        in a;
        /// Its contrary; combinational.
        out b;
    }
}

impl Block for Inverter {
    fn build<'k>(&self, _: &'k Builder, io: InverterPorts<Inside<'k>>) {
        io.b.set(!io.a);
    }
}

/// How two inverters are connected.
#[derive(Clone, Copy)]
enum Way {
    /// One behind the other.
    Chain,
    /// In a ring while `a` is high.
    Ring,
    /// As a chain whose first instance has a name that tools refuse.
    Named,
    /// The second has no input.
    Open,
}

block! {
    /// Two inverters.
    struct Two {
        way: Way,
    }
    ports TwoPorts {
        /// A bit.
        in a;
        /// The bit again; combinational.
        out b;
    }
}

impl Block for Two {
    fn build<'k>(&self, k: &'k Builder, io: TwoPorts<Inside<'k>>) {
        let first = k.instance(if matches!(self.way, Way::Named) { "program" } else { "first" }, Inverter {});
        let second = k.instance("second", Inverter {});
        first.a.set(if matches!(self.way, Way::Ring) { second.b & io.a } else { io.a });
        if !matches!(self.way, Way::Open) {
            second.a.set(first.b);
        }
        io.b.set(second.b);
    }
}

fn hierarchy(way: Way) -> Hierarchy {
    Hierarchy::of_kernel(kernel_of(&Two { way }))
}

#[test]
fn an_instance_named_by_a_keyword_is_an_error() {
    let error = hierarchy(Way::Named).check().unwrap_err();
    assert!(error.to_string().contains("program"), "{error}");
    assert!(matches!(error, KernelError::Name { .. }));
}

#[test]
fn an_input_of_an_instance_that_nothing_drives_is_named() {
    let error = hierarchy(Way::Open).check().unwrap_err().to_string();
    assert!(error.contains("second__a"), "{error}");
}

#[test]
fn a_block_of_blocks_is_a_module_with_instances() {
    let hierarchy = hierarchy(Way::Chain);
    hierarchy.check().unwrap();
    let text = hierarchy.verilog("chain", None);
    let chain = "\
module chain (
    // A bit.
    input wire a,
    // The bit again; combinational.
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
    assert!(text.contains("    output wire b\n);\n    assign b = !a;\n"), "{text}");
}

#[test]
fn a_loop_through_several_blocks_is_named() {
    let error = hierarchy(Way::Ring).check().unwrap_err().to_string();
    let ring = "second__b, second__a, first__b, first__a";
    assert_eq!(error, format!("block second, signal b: combinational loop through {ring}: `~a`"));
}
