//! Registers at the outputs of the block RAMs.
//!
//! In the mode of 36 bits a block RAM uses the outputs of both ports for the word that port B reads. Which of the two
//! clocks and enables the lower half's register has is not documented; it does not matter, because both ports get the
//! same.

use serde_json::{json, Value};

use super::design::Design;

/// Yosys's cell of an ECP5 block RAM.
pub const BLOCK_RAM: &str = "DP16KD";
/// Outputs of a port.
const OUTPUTS: usize = 18;

/// The data pins of a port.
fn pins(port: char) -> impl Iterator<Item = String> {
    (0..OUTPUTS).map(move |bit| format!("DO{port}{bit}"))
}

impl Design {
    /// Moves the registers behind the outputs of a block RAM; `None` if they cannot be moved.
    ///
    /// A block RAM is left as it is where its ports have different clocks or both are read.
    pub(super) fn outputs(&mut self, cell: &mut Value) -> Option<()> {
        let driven = self.driven(cell, ['A', 'B'].into_iter().flat_map(pins))?;
        let (_, first) = driven.first()?;
        let (clock, enable) = (json!(first.clock), first.enable.clone());
        let wide = cell["parameters"]["DATA_WIDTH_B"].as_str().and_then(|bits| usize::from_str_radix(bits, 2).ok());
        let read = |port: char| driven.iter().any(|(pin, _)| pin.starts_with(&format!("DO{port}")));
        if wide != Some(36) && read('A') && read('B') {
            return None;
        }
        // A port that is not used, as that of a ROM which would write, has no clock.
        let other = |pin: &&str| cell["connections"][pin][0].is_u64() && cell["connections"][pin][0] != clock;
        if ["CLKA", "CLKB"].iter().any(other) {
            return None;
        }
        self.take(cell, driven);
        for port in ['A', 'B'] {
            cell["parameters"][format!("REGMODE_{port}")] = json!("OUTREG");
            for (pin, net) in [(format!("OCE{port}"), &enable), (format!("CLK{port}"), &clock)] {
                cell["connections"][&pin] = json!([net]);
                cell["port_directions"][pin] = json!("input");
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Map;

    use super::super::{pack_registers, PackedRegisters};
    use super::*;

    /// Nets: 1 clock, 2 and 3 enables; 100 + bit lower half of the word, 200 + bit upper half; 1000 more behind the
    /// register of each, whose enable is `enables[half]`, 0 for none.
    fn netlist(width: &str, enables: [u64; 2]) -> Value {
        let mut cells = Map::new();
        let (mut connections, mut directions) = (Map::new(), Map::new());
        for (port, first, enable) in [('A', 100, enables[0]), ('B', 200, enables[1])] {
            for (bit, pin) in pins(port).enumerate() {
                let net = first + bit;
                let mut flip_flop = json!({
                    "type": "TRELLIS_FF",
                    "parameters": {"CEMUX": "1", "CLKMUX": "CLK", "REGSET": "RESET"},
                    "port_directions": {"CLK": "input", "DI": "input", "LSR": "input", "CE": "input", "Q": "output"},
                    "connections": {"CLK": [1], "DI": [net], "LSR": ["0"], "Q": [net + 1000]},
                });
                if enable > 0 {
                    flip_flop["parameters"]["CEMUX"] = json!("CE");
                    flip_flop["connections"]["CE"] = json!([enable]);
                }
                cells.insert(format!("{port}{bit}"), flip_flop);
                connections.insert(pin.clone(), json!([net]));
                directions.insert(pin, json!("output"));
            }
            connections.insert(format!("CLK{port}"), json!([1]));
            directions.insert(format!("CLK{port}"), json!("input"));
        }
        let block_ram = json!({
            "type": BLOCK_RAM,
            "parameters": {"DATA_WIDTH_B": width, "REGMODE_A": "NOREG", "REGMODE_B": "NOREG"},
            "port_directions": directions,
            "connections": connections,
        });
        cells.insert("m".into(), block_ram);
        let outputs: Vec<u64> = (1100..1118).chain(1200..1218).collect();
        json!({"modules": {"t": {"ports": {"y": {"direction": "output", "bits": outputs}}, "cells": cells}}})
    }

    const WIDE: &str = "00000000000000000000000000100100";
    const NARROW: &str = "00000000000000000000000000010010";

    #[test]
    fn a_word_of_36_bits_is_registered_in_both_ports() {
        for (enable, connected, clock) in [(0, json!(["1"]), json!([1])), (2, json!([2]), json!(["0"]))] {
            let mut netlist = netlist(WIDE, [enable; 2]);
            // The port of a ROM that would write has no clock.
            netlist["modules"]["t"]["cells"]["m"]["connections"]["CLKA"] = clock;
            let packed = PackedRegisters { block_rams: 1, flip_flops: 36, ..PackedRegisters::default() };
            assert_eq!(pack_registers(&mut netlist, "t"), packed);
            let cells = &netlist["modules"]["t"]["cells"];
            assert_eq!(cells.as_object().unwrap().len(), 1);
            assert_eq!(
                [&cells["m"]["connections"]["DOA5"], &cells["m"]["connections"]["DOB17"]],
                [&json!([1105]), &json!([1217])]
            );
            for port in ["A", "B"] {
                assert_eq!(cells["m"]["parameters"][format!("REGMODE_{port}")], "OUTREG");
                assert_eq!(cells["m"]["connections"][format!("OCE{port}")], connected);
                assert_eq!(cells["m"]["connections"][format!("CLK{port}")], json!([1]));
            }
        }
    }

    #[test]
    fn a_block_ram_stays_where_its_registers_differ_or_others_read_it() {
        let kept = |mut netlist: Value| {
            assert_eq!(pack_registers(&mut netlist, "t"), PackedRegisters::default());
            assert_eq!(netlist["modules"]["t"]["cells"]["m"]["parameters"]["REGMODE_B"], "NOREG");
        };
        kept(netlist(WIDE, [2, 3]));
        kept(netlist(WIDE, [0, 2]));
        kept(netlist(NARROW, [0, 0]));
        let mut read = netlist(WIDE, [0, 0]);
        read["modules"]["t"]["ports"]["z"] = json!({"direction": "output", "bits": [100]});
        kept(read);
        let mut clocked = netlist(WIDE, [0, 0]);
        clocked["modules"]["t"]["cells"]["m"]["connections"]["CLKA"] = json!([4]);
        kept(clocked);
    }
}
