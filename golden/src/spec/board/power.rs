//! Energies of a device's resources, for an estimate of its power: table `power` of `constraints/families/<family>.toml`.
//!
//! No vendor publishes the energies of single resources. The figures are derived, as the file says, from measurements of
//! other devices and from published energies of the process node; each is a range of a factor of two at least.

use std::collections::BTreeMap;

use serde::Deserialize;

/// Energies of the resources of a family, each as [lower, upper].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Power {
    /// Where the figures come from.
    pub source: String,
    /// A register bit that changes, with the nets and look-up tables behind it, pJ.
    pub toggle_pJ: [f64; 2],
    /// The clock of a flip-flop, in every cycle, pJ.
    pub clock_pJ: [f64; 2],
    /// A product of a multiplier, pJ.
    pub product_pJ: [f64; 2],
    /// A word read from or written to a block RAM, pJ.
    pub block_ram_pJ: [f64; 2],
    /// Factors of `static_mW`: process and temperature.
    pub static_range: [f64; 2],
    /// Typical static power of each device by the data sheet, mW.
    static_mW: BTreeMap<String, f64>,
}

impl Power {
    /// Static power of the device of this name, [lower, upper] in mW; `None` for one without a figure.
    pub fn static_mW(&self, device: &str) -> Option<[f64; 2]> {
        let typical = self.static_mW.get(device)?;
        Some(self.static_range.map(|factor| factor * typical))
    }
}
