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
mod design;
mod multiplier;

use serde_json::Value;

use block_ram::BLOCK_RAM;
use design::Design;
pub use multiplier::MULTIPLIER;

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

/// Moves registers in the module `top` of Yosys's JSON.
///
/// Other cells and modules are not changed. Without that module nothing is moved.
pub fn pack_registers(netlist: &mut Value, top: &str) -> PackedRegisters {
    let Some(module) = netlist["modules"].get_mut(top) else { return PackedRegisters::default() };
    let Some(mut design) = Design::of(module) else { return PackedRegisters::default() };
    let Some(cells) = module["cells"].as_object_mut() else { return PackedRegisters::default() };
    let mut packed = PackedRegisters::default();
    for cell in cells.values_mut().filter(|cell| cell["type"] == MULTIPLIER) {
        packed.operands += design.operands(cell);
        packed.products += usize::from(design.product(cell).is_some());
    }
    // After the multipliers: of two registers between a block RAM and a multiplier each takes one.
    for cell in cells.values_mut().filter(|cell| cell["type"] == BLOCK_RAM) {
        packed.block_rams += usize::from(design.outputs(cell).is_some());
    }
    packed.flip_flops = design.clear_away(cells);
    multiplier::drive_resets(module);
    packed
}
