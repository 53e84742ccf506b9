//! Floor plan: assigns sites to the multipliers of the MAC lanes.
//!
//! A device has its multipliers in a few rows. A placer pulls the lanes' logic together and takes whatever multipliers
//! are left in those rows: the 36 wires of a product then cross half the device, those of all lanes meet in the middle,
//! and routing takes hours or does not converge. With neighbouring sites for neighbouring lanes the placer puts the
//! logic near them.
//!
//! ```text
//! row 0   1 2 3 4 \   / 21 ...    blocks of four sites; the lanes, sorted by parity and number, go down one
//! row 1   5 6 7 8 |   | 17 ...    column and up the next, over as many columns as are needed in the middle
//! row 2   9 ...   \__/  13 ...    of the device; if all but one are needed, the middle one stays free
//! ```

use dermis_golden::spec::board::MultiplierBlocks;
use serde_json::{json, Value};

use super::register_packing::MULTIPLIER;

/// Sites of a block: offset from the block's column, which is also the site's number in its name.
const IN_BLOCK: [u32; MultiplierBlocks::SIZE] = [0, 1, 4, 5];

/// Assigns sites to the lanes' multipliers in the module `top` of Yosys's JSON; returns their number.
///
/// Other multipliers are left to the placer. If there are more lanes than sites, nothing is assigned.
pub fn assign_sites(netlist: &mut Value, top: &str, blocks: &MultiplierBlocks) -> usize {
    let Some(cells) = netlist["modules"][top]["cells"].as_object_mut() else { return 0 };
    let mut lanes: Vec<((u32, u32), &mut Value)> = cells
        .iter_mut()
        .filter(|(_, cell)| cell["type"] == MULTIPLIER)
        .filter_map(|(n, cell)| Some((lane(n)?, cell)))
        .collect();
    lanes.sort_unstable_by_key(|(lane, _)| *lane);
    let sites = sites(blocks, lanes.len());
    if sites.len() < lanes.len() {
        return 0;
    }
    for ((_, cell), site) in lanes.iter_mut().zip(sites) {
        cell["attributes"]["BEL"] = json!(site);
    }
    lanes.len()
}

/// Parity and number of the lane that a cell belongs to, from its name `….parity_p__lane_k__…`; `None` for other cells.
fn lane(name: &str) -> Option<(u32, u32)> {
    let (_, name) = name.split_once(".parity_")?;
    let (parity, name) = name.split_once("__lane_")?;
    let (lane, _) = name.split_once("__")?;
    Some((parity.parse().ok()?, lane.parse().ok()?))
}

/// At least `count` sites in the order of the lanes, fewer if the device has fewer.
fn sites(blocks: &MultiplierBlocks, count: usize) -> Vec<String> {
    let MultiplierBlocks { columns, rows } = blocks;
    let needed = count.div_ceil(rows.len() * IN_BLOCK.len()).min(columns.len());
    let mut taken = columns.clone();
    match columns.len() - needed {
        // The single free column serves all other multipliers: in the middle it is near the logic that uses them.
        1 => drop(taken.remove(columns.len() / 2)),
        left => taken = columns[left / 2..][..needed].to_vec(),
    }
    let blocks = taken.iter().enumerate().flat_map(|(k, column)| {
        let mut blocks: Vec<(u32, u32)> = rows.iter().map(|row| (*column, *row)).collect();
        if k % 2 == 1 {
            blocks.reverse();
        }
        blocks
    });
    blocks.flat_map(|(x, y)| IN_BLOCK.map(|k| format!("X{}/Y{y}/MULT18_{k}", x + k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> MultiplierBlocks {
        MultiplierBlocks { columns: vec![4, 13, 22], rows: vec![10, 34] }
    }

    #[test]
    fn lanes_take_neighbouring_sites_in_the_middle_and_no_site_twice() {
        assert_eq!(
            sites(&blocks(), 3)[..5],
            ["X13/Y10/MULT18_0", "X14/Y10/MULT18_1", "X17/Y10/MULT18_4", "X18/Y10/MULT18_5", "X13/Y34/MULT18_0"]
        );
        let all = sites(&blocks(), 24);
        // The second column goes up.
        assert_eq!(all[8], "X13/Y34/MULT18_0");
        assert_eq!(all.iter().collect::<std::collections::BTreeSet<_>>().len(), 24);
    }

    #[test]
    fn a_single_column_that_is_left_is_that_in_the_middle() {
        let sites = sites(&blocks(), 16);
        assert_eq!(sites.len(), 16);
        assert!(sites.iter().all(|site| !site.starts_with("X13/") && !site.starts_with("X14/")), "{sites:?}");
    }

    #[test]
    fn a_lane_s_multiplier_gets_its_site_and_another_none() {
        let names =
            ["a.lanes.parity_1__lane_0__a_MULT", "a.lanes.parity_0__lane_10__a_MULT", "a.lanes.parity_0__lane_9__x"];
        let mut cells: serde_json::Map<String, Value> =
            names.iter().map(|name| (name.to_string(), json!({"type": "MULT18X18D"}))).collect();
        cells.insert("unit.x_MULT".into(), json!({"type": "MULT18X18D"}));
        cells.insert("a.lanes.parity_0__lane_1__q".into(), json!({"type": "TRELLIS_FF"}));
        let mut netlist = json!({"modules": {"t": {"cells": cells}}});
        assert_eq!(assign_sites(&mut netlist, "t", &blocks()), 3);
        let site = |name: &str| netlist["modules"]["t"]["cells"][name]["attributes"]["BEL"].clone();
        // Sorted by parity and number, not as text.
        assert_eq!(
            [names[2], names[1], names[0]].map(site),
            [json!("X13/Y10/MULT18_0"), json!("X14/Y10/MULT18_1"), json!("X17/Y10/MULT18_4")]
        );
        assert!(site("unit.x_MULT").is_null() && site("a.lanes.parity_0__lane_1__q").is_null());
    }

    #[test]
    fn more_lanes_than_sites_are_left_to_the_placer() {
        let cells: serde_json::Map<String, Value> =
            (0..25).map(|k| (format!("a.lanes.parity_0__lane_{k}__a"), json!({"type": "MULT18X18D"}))).collect();
        let mut netlist = json!({"modules": {"t": {"cells": cells}}});
        assert_eq!(assign_sites(&mut netlist, "t", &blocks()), 0);
    }
}
