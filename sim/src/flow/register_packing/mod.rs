//! Moves registers from the fabric into the ECP5 multipliers and block RAMs (register packing).
//!
//! An ECP5 multiplier has a register at each operand and one at its product, a block RAM one at its output. Yosys leaves
//! them unused and places flip-flops in the fabric. The route from there into the multiplier takes as long as the
//! product itself, and a block RAM without its register takes more than half of a cycle until its output is valid.
//! Flip-flops are moved if they have the same clock, no reset and the initial value zero.
//!
//! ```text
//! flip-flops -> both operands    all bits are flip-flops or constant zeros; flip-flops with other loads are also kept
//! product    -> flip-flops       every used bit drives one flip-flop and nothing else
//! block RAM  -> flip-flops       the same; they have no enable or a common one
//! ```
//! The netlist co-simulation shows that the edited netlist computes the same bits.

mod block_ram;
mod multiplier;

use std::collections::{BTreeSet, HashMap};

use serde_json::{json, Map, Value};

/// Yosys's cell of an ECP5 multiplier.
pub const MULTIPLIER: &str = "MULT18X18D";
/// Yosys's cell of an ECP5 block RAM.
const BLOCK_RAM: &str = "DP16KD";

/// A net's number in Yosys's JSON.
type Net = u64;

/// Number of registers moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PackedRegisters {
    /// Operands whose registers are now in a multiplier.
    pub operands: usize,
    /// Products whose registers are now in a multiplier.
    pub products: usize,
    /// Block RAMs whose output registers are used.
    pub block_rams: usize,
    /// Flip-flops removed from the fabric.
    pub flip_flops: usize,
}

/// A flip-flop without reset, with initial value zero.
#[derive(Clone, Debug)]
struct Register {
    cell: String,
    clock: Net,
    /// Net of its enable, or the constant "1".
    enable: Value,
    data: Value,
    output: Net,
}

/// Moves registers in the module `top` of Yosys's JSON.
///
/// Other cells and modules are not changed. Without that module nothing is moved.
pub fn pack_registers(netlist: &mut Value, top: &str) -> PackedRegisters {
    let Some(module) = netlist["modules"].get_mut(top) else { return PackedRegisters::default() };
    let fan_out = FanOut::of(module);
    let Some(cells) = module["cells"].as_object_mut() else { return PackedRegisters::default() };
    let by_output: HashMap<Net, Register> = registers(cells).map(|r| (r.output, r)).collect();
    let by_data = by_output.values().filter_map(|r| Some((r.data.as_u64()?, r.clone()))).collect();
    let mut design = Design { fan_out, by_output, by_data, removed: BTreeSet::new() };
    let mut packed = PackedRegisters::default();
    for cell in cells.values_mut().filter(|cell| cell["type"] == MULTIPLIER) {
        packed.operands += design.operands(cell);
        packed.products += usize::from(design.product(cell).is_some());
    }
    // After the multipliers: of two registers between a block RAM and a multiplier each takes one.
    for cell in cells.values_mut().filter(|cell| cell["type"] == BLOCK_RAM) {
        packed.block_rams += usize::from(design.outputs(cell).is_some());
    }
    let before = cells.len();
    let Design { fan_out, by_output, removed, .. } = design;
    let unread = by_output.values().filter(|register| fan_out.count(register.output) == 0);
    let unneeded: BTreeSet<&String> = removed.iter().chain(unread.map(|register| &register.cell)).collect();
    cells.retain(|name, _| !unneeded.contains(name));
    packed.flip_flops = before - cells.len();
    multiplier::drive_resets(module);
    packed
}

/// Fan-out of each net: number of cell inputs and module outputs.
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

/// The flip-flops that may be moved.
fn registers(cells: &Map<String, Value>) -> impl Iterator<Item = Register> + '_ {
    cells.iter().filter_map(|(name, cell)| {
        let parameter = |name: &str| cell["parameters"][name].as_str().map(str::trim);
        let net = |pin: &str| cell["connections"][pin][0].as_u64();
        let plain = cell["type"] == "TRELLIS_FF"
            && parameter("CLKMUX") == Some("CLK")
            && parameter("REGSET") == Some("RESET")
            && cell["connections"]["LSR"][0] == "0";
        let enable = match parameter("CEMUX")? {
            "1" => json!("1"),
            "CE" => cell["connections"]["CE"][0].clone(),
            _ => return None,
        };
        let data = cell["connections"]["DI"][0].clone();
        plain.then_some(Register { cell: name.clone(), clock: net("CLK")?, enable, data, output: net("Q")? })
    })
}

/// The netlist's nets and flip-flops.
struct Design {
    fan_out: FanOut,
    by_output: HashMap<Net, Register>,
    by_data: HashMap<Net, Register>,
    /// Flip-flops moved behind a product or a block RAM.
    removed: BTreeSet<String>,
}

impl Design {
    /// The flip-flops that the outputs `pins` of a cell drive, with their pins, if every used bit drives one and nothing
    /// else, and all have the same clock and enable; `None` if one does not, or no bit is used.
    fn driven(&self, cell: &Value, pins: impl Iterator<Item = String>) -> Option<Vec<(String, Register)>> {
        let mut driven: Vec<(String, Register)> = Vec::new();
        for pin in pins {
            let net = cell["connections"][&pin][0].as_u64().filter(|&net| self.fan_out.count(net) > 0);
            let Some(net) = net else { continue };
            let register = self.by_data.get(&net).filter(|_| self.fan_out.count(net) == 1)?;
            driven.push((pin, register.clone()));
        }
        let (_, first) = driven.first()?;
        let alike = |register: &Register| register.clock == first.clock && register.enable == first.enable;
        driven.iter().all(|(_, register)| alike(register)).then_some(driven)
    }

    /// Moves flip-flops behind the pins of a cell that drive them.
    fn take(&mut self, cell: &mut Value, driven: Vec<(String, Register)>) {
        for (pin, register) in driven {
            cell["connections"][pin] = json!([register.output]);
            self.removed.insert(register.cell);
        }
    }
}
