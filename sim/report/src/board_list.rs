//! The built-in boards and the known devices, as text and as JSON.

use std::collections::BTreeMap;

use dermis_golden::spec::board::{Board, Device, EngineKind};
use serde::Serialize;

use super::table::aligned;

/// A board with its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedBoard {
    /// Name in a scene.
    pub name: String,
    /// Every field of its file.
    #[serde(flatten)]
    pub board: Board,
}

impl From<Board> for NamedBoard {
    fn from(board: Board) -> Self {
        NamedBoard { name: board.name.clone(), board }
    }
}

/// Boards and devices.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoardList {
    /// The built-in boards.
    pub boards: Vec<NamedBoard>,
    /// The known devices.
    pub devices: Vec<Device>,
}

/// A table of the boards, one of the devices, and where the devices' figures come from.
pub fn boards(list: &BoardList) -> String {
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "none".to_owned());
    let boards = list.boards.iter().map(|NamedBoard { name, board }| {
        let engine = match board.engine {
            EngineKind::Parallel => "parallel",
            EngineKind::Serial => "serial",
        };
        vec![
            name.clone(),
            or_none(board.device.clone()),
            engine.to_owned(),
            board.clock_MHz.to_string(),
            or_none(board.uart_baud.map(|baud| baud.to_string())),
            or_none(board.spi_MHz.map(|rate| rate.to_string())),
        ]
    });
    let head = ["board", "device", "engine", "clock, MHz", "UART, bit/s", "SPI, MHz"];
    let mut text = aligned(3, &head, boards.collect());
    let devices = list.devices.iter().map(|device| {
        let counts = ["multipliers", "block_rams", "large_rams", "luts", "flip_flops"].map(|field| device.count(field));
        let counts = counts.map(|count| count.to_string());
        let bitstream = device.family.pin_file_extension().map_or("no", |_| "yes");
        let names = [&device.name, device.family.name(), bitstream].map(str::to_owned);
        [names.to_vec(), counts.to_vec()].concat()
    });
    let head = ["device", "family", "bitstream", "multipliers", "block RAMs", "single-port RAMs", "LUTs", "flip-flops"];
    text.push_str(&format!("\n{}\n", aligned(3, &head, devices.collect())));
    let families: BTreeMap<&str, &Device> = list.devices.iter().map(|device| (device.family.name(), device)).collect();
    for (family, Device { description, multiplier, block_ram, source, .. }) in families {
        text.push_str(&format!(
            "{family}: {description}; multipliers {multiplier}, block RAMs {block_ram}; {source}\n"
        ));
    }
    text
}
