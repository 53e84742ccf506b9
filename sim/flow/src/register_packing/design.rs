//! The netlist's nets and the flip-flops that may be moved.

use std::collections::{BTreeSet, HashMap};

use serde_json::{json, Map, Value};

/// A net's number in Yosys's JSON.
pub(super) type Net = u64;

/// A flip-flop without reset, with initial value zero.
#[derive(Clone, Debug)]
pub(super) struct Register {
    pub(super) cell: String,
    pub(super) clock: Net,
    /// Net of its enable, or the constant "1".
    pub(super) enable: Value,
    pub(super) data: Value,
    pub(super) output: Net,
}

/// Fan-out of each net: number of cell inputs and module outputs.
pub(super) struct FanOut(HashMap<Net, usize>);

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

    pub(super) fn add(&mut self, nets: &Value, more: isize) {
        for net in nets.as_array().into_iter().flatten().filter_map(Value::as_u64) {
            let count = self.0.entry(net).or_default();
            *count = count.saturating_add_signed(more);
        }
    }

    pub(super) fn count(&self, net: Net) -> usize {
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
pub(super) struct Design {
    pub(super) fan_out: FanOut,
    pub(super) by_output: HashMap<Net, Register>,
    pub(super) by_data: HashMap<Net, Register>,
    /// Flip-flops moved behind a product or a block RAM.
    pub(super) removed: BTreeSet<String>,
}

impl Design {
    /// Of a module in Yosys's JSON; `None` if it has no cells.
    pub(super) fn of(module: &Value) -> Option<Design> {
        let by_output: HashMap<Net, Register> =
            registers(module["cells"].as_object()?).map(|r| (r.output, r)).collect();
        let by_data = by_output.values().filter_map(|r| Some((r.data.as_u64()?, r.clone()))).collect();
        Some(Design { fan_out: FanOut::of(module), by_output, by_data, removed: BTreeSet::new() })
    }

    /// Removes the flip-flops that were moved, and those that nothing reads any more; returns how many.
    pub(super) fn clear_away(self, cells: &mut Map<String, Value>) -> usize {
        let before = cells.len();
        let unread = self.by_output.values().filter(|register| self.fan_out.count(register.output) == 0);
        let unneeded: BTreeSet<&String> = self.removed.iter().chain(unread.map(|register| &register.cell)).collect();
        cells.retain(|name, _| !unneeded.contains(name));
        before - cells.len()
    }

    /// The flip-flops that the outputs `pins` of a cell drive, with their pins, if every used bit drives one and nothing
    /// else, and all have the same clock and enable; `None` if one does not, or no bit is used.
    pub(super) fn driven(&self, cell: &Value, pins: impl Iterator<Item = String>) -> Option<Vec<(String, Register)>> {
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
    pub(super) fn take(&mut self, cell: &mut Value, driven: Vec<(String, Register)>) {
        for (pin, register) in driven {
            cell["connections"][pin] = json!([register.output]);
            self.removed.insert(register.cell);
        }
    }
}
