//! Registers of the multipliers, at their operands and their product.
//!
//! The registers' reset must be constant zero. The device has no constant there, so that a look-up table drives the
//! net. Every multiplier has its own look-up table: a common net enters each DSP block through a wire shared by the
//! block's multipliers, and nextpnr's router then does not converge.

use serde_json::{json, Value};

use super::design::{Design, Net, Register};

/// Yosys's cell of an ECP5 multiplier.
pub const MULTIPLIER: &str = "MULT18X18D";
/// Bits of a multiplier's operand.
const OPERAND: usize = 18;
/// Names of the operands.
const SIDES: [&str; 2] = ["A", "B"];
/// Bits of the product.
const PRODUCT: usize = 36;
/// Reset pin of the registers.
const RESET: &str = "RST0";

/// Drives the reset of each multiplier with registers from a look-up table of zeros.
pub(super) fn drive_resets(module: &mut Value) {
    let mut last = last_net(module);
    let Some(cells) = module["cells"].as_object_mut() else { return };
    let mut drivers = Vec::new();
    let registered = |cell: &Value| cell["type"] == MULTIPLIER && cell["connections"][RESET][0] == "0";
    for (name, cell) in cells.iter_mut().filter(|(_, cell)| registered(cell)) {
        last += 1;
        cell["connections"][RESET] = json!([last]);
        drivers.push((format!("{name}$never"), constant_zero(last)));
    }
    cells.extend(drivers);
}

/// The greatest number of a net in a module.
fn last_net(module: &Value) -> Net {
    let of = |kind: &str| module[kind].as_object().into_iter().flatten().map(|(_, value)| value);
    let cells =
        of("cells").flat_map(|cell| cell["connections"].as_object().into_iter().flatten()).map(|(_, nets)| nets);
    let named = of("ports").chain(of("netnames")).map(|named| &named["bits"]);
    cells
        .chain(named)
        .flat_map(|nets| nets.as_array().into_iter().flatten())
        .filter_map(Value::as_u64)
        .max()
        .unwrap_or(0)
}

/// A look-up table that drives `net` with zero.
fn constant_zero(net: Net) -> Value {
    let mut directions = json!({"Z": "output"});
    let mut connections = json!({"Z": [net]});
    for pin in ["A", "B", "C", "D"] {
        directions[pin] = json!("input");
        connections[pin] = json!(["0"]);
    }
    json!({
        "type": "LUT4",
        "parameters": {"INIT": "0".repeat(16)},
        "attributes": {},
        "port_directions": directions,
        "connections": connections,
    })
}

/// Inputs of an operand's registers; no clock if all bits are constants.
struct Operand {
    clock: Option<Net>,
    data: Vec<Value>,
}

/// Names of an operand's pins.
fn pins(side: &str) -> impl Iterator<Item = String> + '_ {
    (0..OPERAND).map(move |bit| format!("{side}{bit}"))
}

impl Design {
    /// Moves the registers of both operands, or of none: nextpnr has no timing of a multiplier with only one operand
    /// register. A constant operand may be registered too: until its register is loaded, the other operand is zero.
    /// Returns the number of operands moved, constants not counted.
    pub(super) fn operands(&mut self, cell: &mut Value) -> usize {
        let [a, b] = SIDES.map(|side| self.data(cell, side));
        let (Some(a), Some(b)) = (a, b) else { return 0 };
        let (clock, moved) = match (a.clock, b.clock) {
            (Some(a), Some(b)) if a != b => return 0,
            (Some(clock), other) | (other, Some(clock)) => (clock, 1 + usize::from(other.is_some())),
            (None, None) => return 0,
        };
        for (side, operand) in SIDES.into_iter().zip([a, b]) {
            for (pin, data) in pins(side).zip(operand.data) {
                self.fan_out.add(&cell["connections"][&pin], -1);
                cell["connections"][&pin] = json!([data]);
                self.fan_out.add(&cell["connections"][&pin], 1);
            }
            enable_register(cell, &format!("REG_INPUT{side}"), clock);
        }
        moved
    }

    /// The inputs of an operand's registers; `None` unless every bit comes from a movable flip-flop or is a constant.
    fn data(&self, cell: &Value, side: &str) -> Option<Operand> {
        let mut operand = Operand { clock: None, data: Vec::with_capacity(OPERAND) };
        let mut ones = false;
        for pin in pins(side) {
            let net = &cell["connections"][pin][0];
            let Some(number) = net.as_u64() else {
                ones |= net != "0";
                operand.data.push(net.clone());
                continue;
            };
            let plain = |register: &&Register| register.enable == "1" && !self.removed.contains(&register.cell);
            let register = self.by_output.get(&number).filter(plain)?;
            if *operand.clock.get_or_insert(register.clock) != register.clock {
                return None;
            }
            operand.data.push(register.data.clone());
        }
        // A constant one cannot be registered with other bits: registers start at zero.
        (operand.clock.is_none() || !ones).then_some(operand)
    }

    /// Moves the registers of a product; `None` if they cannot be moved.
    pub(super) fn product(&mut self, cell: &mut Value) -> Option<()> {
        let driven = self.driven(cell, (0..PRODUCT).map(|bit| format!("P{bit}")))?;
        let (_, first) = driven.first()?;
        let (clock, own) = (first.clock, cell["connections"]["CLK0"][0].as_u64());
        if first.enable != "1" || own.is_some_and(|own| own != clock) {
            return None;
        }
        self.take(cell, driven);
        enable_register(cell, "REG_OUTPUT", clock);
        Some(())
    }
}

/// Enables a multiplier's register with the given clock, always enabled and never reset.
fn enable_register(cell: &mut Value, register: &str, clock: Net) {
    for (name, value) in [("CLK", "CLK0"), ("CE", "CE0"), ("RST", RESET)] {
        cell["parameters"][format!("{register}_{name}")] = json!(value);
    }
    for (pin, net) in [("CLK0", json!(clock)), ("CE0", json!("1")), (RESET, json!("0"))] {
        cell["connections"][pin] = json!([net]);
        cell["port_directions"][pin] = json!("input");
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Map;

    use super::super::{pack_registers, PackedRegisters};
    use super::*;

    /// Nets: 1 clock; 100 + bit operand's data, 200 + bit its register's output; 300 + bit product, 400 + bit its
    /// register's output. Operand B is the constant 0 up to bit 17.
    fn netlist(enable: &str, extra_load: bool) -> Value {
        let mut cells = Map::new();
        let mut flip_flop = |name: String, data: Net, output: Net, enable: &str| {
            let cell = json!({
                "type": "TRELLIS_FF",
                "parameters": {"CEMUX": enable, "CLKMUX": "CLK", "REGSET": "RESET"},
                "port_directions": {"CLK": "input", "DI": "input", "LSR": "input", "Q": "output"},
                "connections": {"CLK": [1], "DI": [data], "LSR": ["0"], "Q": [output]},
            });
            cells.insert(name, cell);
        };
        for bit in 0..18 {
            flip_flop(format!("a{bit}"), 100 + bit, 200 + bit, enable);
        }
        for bit in 0..36 {
            flip_flop(format!("p{bit}"), 300 + bit, 400 + bit, "1 ");
        }
        let (mut pins, mut directions) = (Map::new(), Map::new());
        let mut pin = |name: String, net: Value, direction: &str| {
            directions.insert(name.clone(), json!(direction));
            pins.insert(name, json!([net]));
        };
        for bit in 0..18 {
            pin(format!("A{bit}"), json!(200 + bit), "input");
            pin(format!("B{bit}"), json!("0"), "input");
        }
        for bit in 0..36 {
            pin(format!("P{bit}"), json!(300 + bit), "output");
        }
        let multiplier =
            json!({"type": "MULT18X18D", "parameters": {}, "port_directions": directions, "connections": pins});
        cells.insert("m".into(), multiplier);
        let mut outputs: Vec<u64> = (400..436).collect();
        if extra_load {
            outputs.push(300);
            outputs.push(200);
        }
        let ports = json!({"y": {"direction": "output", "bits": outputs}});
        json!({"modules": {"t": {"ports": ports, "cells": cells}}})
    }

    #[test]
    fn both_registers_of_a_multiplier_move_in() {
        let mut netlist = netlist("1 ", false);
        let packed = pack_registers(&mut netlist, "t");
        assert_eq!(packed, PackedRegisters { operands: 1, products: 1, block_rams: 0, flip_flops: 54 });
        let multiplier = &netlist["modules"]["t"]["cells"]["m"];
        assert_eq!(multiplier["connections"]["A5"], json!([105]));
        assert_eq!(multiplier["connections"]["P35"], json!([435]));
        assert_eq!(multiplier["connections"]["CLK0"], json!([1]));
        assert_eq!(multiplier["parameters"]["REG_INPUTA_CLK"], "CLK0");
        assert_eq!(multiplier["parameters"]["REG_INPUTB_CLK"], "CLK0");
    }

    #[test]
    fn the_reset_has_a_zero_of_its_own() {
        let mut netlist = netlist("1 ", false);
        pack_registers(&mut netlist, "t");
        let cells = netlist["modules"]["t"]["cells"].as_object().unwrap();
        assert_eq!(cells.len(), 2);
        // The greatest number in the netlist is 435.
        assert_eq!(cells["m"]["connections"]["RST0"], json!([436]));
        assert_eq!(cells["m$never"]["connections"]["Z"], json!([436]));
        assert_eq!(cells["m$never"]["parameters"]["INIT"], "0000000000000000");
    }

    #[test]
    fn a_flip_flop_that_others_read_stays_and_a_product_that_others_read_is_left() {
        let mut netlist = netlist("1 ", true);
        assert_eq!(
            pack_registers(&mut netlist, "t"),
            PackedRegisters { operands: 1, flip_flops: 17, ..PackedRegisters::default() }
        );
        assert!(netlist["modules"]["t"]["cells"]["a0"].is_object());
    }

    #[test]
    fn both_operands_move_or_none() {
        let mut netlist = netlist("1 ", false);
        // B's lowest bit comes straight from outside.
        netlist["modules"]["t"]["cells"]["m"]["connections"]["B0"] = json!([500]);
        assert_eq!(
            pack_registers(&mut netlist, "t"),
            PackedRegisters { products: 1, flip_flops: 36, ..PackedRegisters::default() }
        );
        assert!(netlist["modules"]["t"]["cells"]["m"]["parameters"]["REG_INPUTA_CLK"].is_null());
    }

    #[test]
    fn a_flip_flop_with_an_enable_stays() {
        let mut netlist = netlist("CE", false);
        assert_eq!(
            pack_registers(&mut netlist, "t"),
            PackedRegisters { products: 1, flip_flops: 36, ..PackedRegisters::default() }
        );
        assert_eq!(netlist["modules"]["t"]["cells"]["m"]["connections"]["A0"], json!([200]));
    }
}
