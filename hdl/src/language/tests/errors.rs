//! Defects of a description: what their errors say.

use super::super::*;

fn first_error(builder: Builder) -> String {
    let kernel = builder.finish();
    kernel.errors().first().expect("an error").to_string()
}

#[test]
fn each_error_names_block_signal_and_expression() {
    let k = Builder::new("b");
    let (a, s) = (k.input("a", 4), k.input("s", 4).signed());
    k.wire("y", a + s);
    assert_eq!(first_error(k), "block b, signal y: `(a + s4(s))` mixes signed and unsigned");

    let k = Builder::new("b");
    let a = k.input("a", 4);
    k.register("r", Type::unsigned(4)).set(a + a);
    assert_eq!(first_error(k), "block b, signal r: `(a + a)` has 5 bits, the signal 4");

    let k = Builder::new("b");
    let a = k.input("a", 4);
    k.register("r", Type::signed(4)).set(a);
    assert_eq!(first_error(k), "block b, signal r: `r = a` mixes signed and unsigned");

    let k = Builder::new("b");
    k.net("n", Type::unsigned(1));
    assert_eq!(first_error(k), "block b, signal n: not assigned");

    let k = Builder::new("b");
    let c = k.input("c", 1);
    let n = k.net("n", Type::unsigned(1));
    k.when(c, || n.set(c));
    assert_eq!(first_error(k), "block b, signal n: not assigned");

    let k = Builder::new("b");
    let a = k.input("a", 4);
    let r = k.register("r", Type::unsigned(4));
    r.set(a);
    r.set(!a);
    assert_eq!(first_error(k), "block b, signal r: assigned twice, the second time `~a`");

    let k = Builder::new("b");
    let (a, c) = (k.input("a", 4), k.input("c", 1));
    let r = k.register("r", Type::unsigned(4));
    k.when(c, || r.set(a));
    k.when(c, || r.set(!a));
    assert_eq!(first_error(k), "block b, signal r: assigned twice, the second time `~a`");

    let k = Builder::new("b");
    let c = k.input("c", 1);
    let (m, n) = (k.net("m", Type::unsigned(1)), k.net("n", Type::unsigned(1)));
    m.set(n.get() & c);
    n.set(!m.get());
    assert_eq!(first_error(k), "block b, signal n: combinational loop through n, m: `~m`");
}

#[test]
fn an_impossible_width_names_the_signal_that_takes_the_value() {
    let k = Builder::new("b");
    let (a, c) = (k.input("a", 4), k.input("c", 3));
    k.wire("y", a & c);
    assert_eq!(first_error(k), "block b, signal y: `(a & c)`: operands of 4 and 3 bits");

    // The signal that takes the value, although another is assigned in between.
    let k = Builder::new("b");
    let a = k.input("a", 4);
    let slice = a.slice(2, 3);
    k.wire("x", a);
    k.wire("y", !slice);
    assert_eq!(first_error(k), "block b, signal y: `a[4:2]`: 3 bits from bit 2 on, of 4");

    let k = Builder::new("b");
    let a = k.input("a", 4);
    k.register("r", Type::unsigned(4)).set(a.extend(3));
    assert_eq!(first_error(k), "block b, signal r: `u3(a)`: 4 bits cannot be extended to 3");

    let k = Builder::new("b");
    let a = k.input("a", 4);
    let r = k.register("r", Type::unsigned(4));
    k.when(a, || r.set(!a));
    assert_eq!(first_error(k), "block b, signal r: `(a ? ~a : r)`: a condition of 4 bits");

    let k = Builder::new("b");
    let a = k.input("a", 2);
    k.state("r", Type::unsigned(2), !a, 0).set(a);
    assert_eq!(first_error(k), "block b, signal r: `~a`: a reset of 2 bits");

    let k = Builder::new("b");
    let a = k.input("a", 2);
    k.memory("m", 4, 2, Contents::Undefined).write(!a, a, a);
    assert_eq!(first_error(k), "block b, signal m: `~a`: a write enable of 2 bits");

    let k = Builder::new("b");
    let a = k.input("a", 2);
    k.memory("m", 4, 3, Contents::Undefined).write(k.constant(1, 1), a, !a);
    assert_eq!(first_error(k), "block b, signal m: `~a`: a word of the memory has 3 bits");

    let k = Builder::new("b");
    let a = k.input("a", 1);
    k.wire("y", a.table(4, &[1, 2, 3]));
    assert_eq!(first_error(k), "block b, signal y: `(a ? 4'd2 : 4'd1)`: a table of 3 entries for 2 indices");

    let k = Builder::new("b");
    let a = k.input("a", 100);
    k.wire("y", a + a.shift_left(28));
    assert_eq!(first_error(k), "block b, signal y: `(a + {a, 28'd0})`: 129 bits, at most 127 in arithmetic");

    let k = Builder::new("b");
    k.wire("y", k.constant(3, 8));
    assert_eq!(first_error(k), "block b, signal y: `3'd8`: 8 needs more bits");

    // Nothing takes the value.
    let k = Builder::new("b");
    k.constant(3, 8);
    assert_eq!(first_error(k), "block b, signal (none): `3'd8`: 8 needs more bits");

    let k = Builder::new("b");
    let (a, c) = (k.input("a", 1), k.input("c", 1));
    k.falling(c, || k.state("r", Type::unsigned(1), !a, 0).set(a));
    assert_eq!(first_error(k), "block b, signal r: `~a`: an asynchronous reset is an input of one bit");

    let k = Builder::new("b");
    let a = k.input("a", 2);
    k.rising(a, || k.register("r", Type::unsigned(2)).set(a));
    assert_eq!(first_error(k), "block b, signal r: `a`: a clock is an input of one bit");
}

#[test]
fn names_and_ports_that_do_not_fit_are_errors() {
    for (name, reason) in
        [("a", "the name is used twice"), ("a$b", "not a Verilog identifier"), ("reg", "a keyword of Verilog")]
    {
        let k = Builder::new("b");
        k.input("a", 4);
        k.input(name, 1);
        assert_eq!(first_error(k), format!("block b, signal {name}: {reason}"));
    }
    let k = Builder::new("b");
    k.input("a", 4);
    let mut kernel = k.finish();
    for (port, bits, output) in [("a", 5, false), ("x", 1, false), ("a", 4, true)] {
        kernel.bind(port, bits, output);
    }
    let errors: Vec<String> = kernel.errors().iter().map(ToString::to_string).collect();
    assert_eq!(
        errors,
        [
            "block b, port a of 5 bits: the kernel's signal has 4 bits",
            "block b, port x of 1 bits: the kernel has no such signal",
            "block b, port a of 4 bits: the kernel's signal has another direction"
        ]
    );
}
