//! Time and energy of a frame by estimator, on CPU, microcontroller and FPGA.

use anyhow::Result;

use super::super::document::{
    count, decimal, empty_cell, seconds, seconds_text, text_cell, Cell, Item, Picture, Section, Table,
};
use super::super::measure::{DeviceRow, Devices, CORE_W};
use super::super::pictures::{bars, Bars};
use super::super::power::range;
use super::super::style::SERIES;
use super::super::BUDGET_US;
use dermis_flow::microcontroller::target::{Core, CORES, POWER_SOURCE};

/// Scenes of the guide's table: search, network, a network for each contact.
pub const DEVICE_SCENES: [&str; 3] = ["sensor-1", "sensor-1-noisy", "eight-by-eight-contacts"];

/// What the figures are.
pub fn device_text() -> String {
    let [least, most] = CORE_W;
    let cores = CORES.map(|Core { name, power_W, .. }| format!("a {name} {} to {} W", power_W[0], power_W[1]));
    let cores = cores.join(", ");
    format!(
        "Median: of the frames on the CPU while nothing else is started, of instructions at one per cycle, of cycles. 99.9 %: not \
         exceeded by as many frames on a CPU whose cores all have another thread, by any frame of an FPGA. Ratio: over the hardware's \
         estimator in floating point, in this run. Arrays: of 1000 frames per second, by time alone. Energy: a core of the CPU takes \
         {least} to {most} W, an assumption; {cores}, {POWER_SOURCE}, and sleeps in between; the \
         FPGA as dermis power estimates it, static power and clock included, for one array and for as many as there is time for."
    )
}

/// The section.
///
/// # Errors
/// A picture that cannot be written.
pub fn devices(devices: &Devices) -> Result<Section> {
    let mut items = vec![Item::Text(device_text()), Item::Pictures(vec![device_picture(devices)?])];
    items.extend(devices.notes.iter().map(|note| Item::Text(note.clone())));
    items.push(Item::Table(device_table(devices)));
    Ok(Section { id: "devices", title: "Where a frame is computed".into(), items })
}

/// A row for each estimator and device.
pub fn device_table(devices: &Devices) -> Table {
    let head = [
        "scene",
        "estimator",
        "device",
        "median",
        "99.9 %",
        "jitter",
        "ratio",
        "arrays",
        "µJ, one array",
        "µJ, all arrays",
        "frames",
    ];
    let rows = devices.rows.iter().map(row).collect();
    Table::new("devices", "Time and energy of a frame by estimator and device", &head, rows)
}

fn row(device: &DeviceRow) -> Vec<Cell> {
    let energy = |ends: Option<[f64; 2]>| {
        ends.map_or_else(empty_cell, |ends| Cell { shown: range(ends), number: Some(ends[1]) })
    };
    vec![
        text_cell(device.scene.clone()),
        text_cell(device.estimator.clone()),
        text_cell(device.device.clone()),
        seconds(Some(device.median_s)),
        seconds(device.most_s),
        seconds(device.jitter_s),
        device.ratio.map_or_else(empty_cell, |ratio| decimal(Some(ratio), if ratio < 10.0 { 2 } else { 0 })),
        count(device.arrays),
        energy(device.one_array_uJ),
        energy(device.all_arrays_uJ),
        count(device.frames as u64),
    ]
}

/// Median and 99.9 % of each row beside the 1 ms line.
///
/// # Errors
/// A picture that cannot be written.
pub fn device_picture(devices: &Devices) -> Result<Picture> {
    let group = |row: &DeviceRow| {
        // Short enough for the width of the picture.
        let device = row.device.replace(", floating point", "").replace(" integers", "");
        let estimator = row.estimator.replace("unrelated frames", "alone").replace("frames ", "");
        (format!("{}: {estimator}, {device}", row.scene), vec![Some(row.median_s), row.most_s])
    };
    let plot = Bars {
        axis: "time of a frame".into(),
        groups: devices.rows.iter().map(group).collect(),
        series: vec![("median".into(), SERIES[0]), ("99.9 %, CPU under load".into(), SERIES[1])],
        text: seconds_text,
        limit: Some(1e-6 * BUDGET_US as f64),
        names_above: true,
        log: true,
    };
    let caption = "Time of a frame by estimator and device; the line is 1 ms".to_owned();
    Ok(Picture { id: "devices".into(), caption, svg: bars(&plot)? })
}
