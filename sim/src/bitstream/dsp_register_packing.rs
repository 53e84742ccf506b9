//! Registers into the multipliers, which have room for them.
//!
//! An ECP5 multiplier has a register at each operand and one at its product. Yosys leaves them empty and puts flip-flops in
//! the fabric, from where the way in costs as much time as the product itself. This moves them in: same clock, no
//! enable, no reset, zero at the start.
//!
//! ```text
//! flip-flops -> both operands    all bits, flip-flops or constant zeros; the flip-flops stay where others use them
//! product    -> flip-flops       every used bit goes to one flip-flop and nowhere else
//! ```
//! Their reset is zero for ever, which the device has no wire for: the zero is a net from a look-up table. One for all
//! multipliers goes across the device and into every block by a wire that the block's multipliers share, and routing lays
//! one of its arcs over the other without end. So every multiplier has a look-up table of its own.
//!
//! Block RAMs keep theirs outside: which clock and enable their registers have in the 36-bit mode that Yosys chooses is not
//! documented. That the netlist still computes the same bits is what the replay shows.

use std::collections::{BTreeSet, HashMap};

use serde_json::{json, Map, Value};

/// Yosys's cell of an ECP5 multiplier.
pub const MULTIPLIER: &str = "MULT18X18D";
/// Operand's bits of a multiplier.
const OPERAND: usize = 18;
/// Names of its operands.
const SIDES: [&str; 2] = ["A", "B"];
/// Its product's bits.
const PRODUCT: usize = 36;
/// The reset of its registers.
const RESET: &str = "RST0";

/// A net's number in Yosys's JSON.
type Net = u64;

/// What was moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackedRegisters {
    /// Operands whose register is now in the multiplier.
    pub operands: usize,
    /// Products.
    pub products: usize,
    /// Flip-flops that are no longer needed.
    pub flip_flops: usize,
}

/// A flip-flop without enable and reset that starts at zero.
#[derive(Clone, Debug)]
struct Register {
    cell: String,
    clock: Net,
    data: Value,
    output: Net,
}

/// Moves registers in the module `top` of Yosys's JSON.
///
/// Cells of other types and modules are left as they are. A netlist without that module has nothing to move.
pub fn pack_registers(netlist: &mut Value, top: &str) -> PackedRegisters {
    let Some(module) = netlist["modules"].get_mut(top) else { return PackedRegisters::default() };
    let fan_out = FanOut::of(module);
    let Some(cells) = module["cells"].as_object_mut() else { return PackedRegisters::default() };
    let by_output: HashMap<Net, Register> = registers(cells).map(|r| (r.output, r)).collect();
    let by_data = by_output.values().filter_map(|r| Some((r.data.as_u64()?, r.clone()))).collect();
    let mut design = Design { fan_out, by_output, by_data, removed: BTreeSet::new() };
    let mut packed = PackedRegisters::default();
    for cell in cells.values_mut() {
        if cell["type"] == MULTIPLIER {
            packed.operands += design.operands(cell);
            packed.products += usize::from(design.product(cell).is_some());
        }
    }
    let before = cells.len();
    let Design { fan_out, by_output, removed, .. } = design;
    let unread = by_output.values().filter(|register| fan_out.count(register.output) == 0);
    let unneeded: BTreeSet<&String> = removed.iter().chain(unread.map(|register| &register.cell)).collect();
    cells.retain(|name, _| !unneeded.contains(name));
    packed.flip_flops = before - cells.len();
    drive_resets(module);
    packed
}

/// A look-up table of zeros for the reset of each multiplier that has registers.
fn drive_resets(module: &mut Value) {
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

/// How many inputs of cells and outputs of the module each net goes to.
struct FanOut(HashMap<Net, usize>);

impl FanOut {
    fn of(module: &Value) -> FanOut {
        let mut fan_out = FanOut(HashMap::new());
        let cells = module["cells"].as_object().into_iter().flatten();
        for (_, cell) in cells {
            for (pin, nets) in cell["connections"].as_object().into_iter().flatten() {
                if cell["port_directions"][pin] != "output" {
                    fan_out.add(nets, 1);
                }
            }
        }
        for (_, port) in module["ports"].as_object().into_iter().flatten() {
            if port["direction"] != "input" {
                fan_out.add(&port["bits"], 1);
            }
        }
        fan_out
    }

    fn add(&mut self, nets: &Value, more: isize) {
        for net in nets.as_array().into_iter().flatten().filter_map(Value::as_u64) {
            let count = self.0.entry(net).or_default();
            *count = count.saturating_add_signed(more);
        }
    }

    fn count(&self, net: Net) -> usize {
        self.0.get(&net).copied().unwrap_or(0)
    }
}

/// The flip-flops that may move.
fn registers(cells: &Map<String, Value>) -> impl Iterator<Item = Register> + '_ {
    cells.iter().filter_map(|(name, cell)| {
        let parameter = |name: &str| cell["parameters"][name].as_str().map(str::trim);
        let net = |pin: &str| cell["connections"][pin][0].as_u64();
        let plain = cell["type"] == "TRELLIS_FF"
            && parameter("CEMUX") == Some("1")
            && parameter("CLKMUX") == Some("CLK")
            && parameter("REGSET") == Some("RESET")
            && cell["connections"]["LSR"][0] == "0";
        let data = cell["connections"]["DI"][0].clone();
        plain.then_some(Register { cell: name.clone(), clock: net("CLK")?, data, output: net("Q")? })
    })
}

/// An operand's bits before its registers; no clock where all of them are constants.
struct Operand {
    clock: Option<Net>,
    data: Vec<Value>,
}

/// Names of an operand's pins.
fn pins(side: &str) -> impl Iterator<Item = String> + '_ {
    (0..OPERAND).map(move |bit| format!("{side}{bit}"))
}

/// The nets and flip-flops around the cells.
struct Design {
    fan_out: FanOut,
    by_output: HashMap<Net, Register>,
    by_data: HashMap<Net, Register>,
    /// Flip-flops that a cell's output has taken.
    removed: BTreeSet<String>,
}

impl Design {
    /// Moves the registers of both operands in, or of none: place and route knows no timing of a multiplier that has one
    /// of the two. A constant operand may be registered as well: until it stands there, the other one is zero.
    fn operands(&mut self, cell: &mut Value) -> usize {
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

    /// What an operand's registers take in; `None` where not every bit comes from one, or from a constant.
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
            let register = self.by_output.get(&number).filter(|register| !self.removed.contains(&register.cell))?;
            if *operand.clock.get_or_insert(register.clock) != register.clock {
                return None;
            }
            operand.data.push(register.data.clone());
        }
        // At the start a register is zero, a constant beside it is not.
        (operand.clock.is_none() || !ones).then_some(operand)
    }

    /// Moves the registers of a product in.
    fn product(&mut self, cell: &mut Value) -> Option<()> {
        let mut clock = cell["connections"]["CLK0"][0].as_u64();
        let mut moved = Vec::new();
        for pin in (0..PRODUCT).map(|bit| format!("P{bit}")) {
            let net = cell["connections"][&pin][0].as_u64().filter(|&net| self.fan_out.count(net) > 0);
            let Some(net) = net else { continue };
            let register = self.by_data.get(&net).filter(|_| self.fan_out.count(net) == 1)?;
            if *clock.get_or_insert(register.clock) != register.clock {
                return None;
            }
            moved.push((pin, register));
        }
        for (pin, register) in &moved {
            cell["connections"][pin] = json!([register.output]);
            self.removed.insert(register.cell.clone());
        }
        enable_register(cell, "REG_OUTPUT", clock.filter(|_| !moved.is_empty())?);
        Some(())
    }
}

/// Turns a multiplier's register on: of this clock, always enabled and never reset.
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
        assert_eq!(packed, PackedRegisters { operands: 1, products: 1, flip_flops: 54 });
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
