//! Board flow: from a scene to a bitstream with open tools, and to the netlist that can be simulated.
//!
//! ```text
//! scene -> board top (Verilog) --yosys--> netlist --register packing, floor plan--> netlist
//!     netlist --nextpnr, several seeds--> best --pack--> bitstream
//!             ^-- pins, PLL of the board       |--> cells, clocks -> table, baselines
//! ```
//! All files and one log per tool lie in `<build-dir>/<scene>/<board>/`.

pub mod baseline;
pub mod bitstream;
pub mod family;
pub mod floor_plan;
pub mod netlist;
pub mod pins;
pub mod register_packing;
pub mod synthesis;
pub mod timing;
pub mod tools;
