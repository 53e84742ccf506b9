//! Estimated power of the recommended designs, beside the published one.

use anyhow::Result;
use dermis_study::paper::powers;

use super::super::document::{count, decimal, empty_cell, text_cell, Cell, Item, Section, Table};
use super::super::measure::{BitTrue, Measured, Options};
use super::super::power::WHAT;
use super::choice::{designs, Choice};
use super::lookup::case_text;
use dermis_cosim::hardware::Hardware;
use dermis_cosim::power::{energies, estimate_power, PowerEstimate};
use dermis_flow::jobs::parallel;

/// The section with the estimate of power; the quick variant has the first scene only.
///
/// # Errors
/// A design that cannot be simulated; an interruption.
pub fn power(measured: &[Measured], choices: &[Choice], options: &Options) -> Result<Section> {
    let known = |(_, own): &(&Measured, &BitTrue)| options.simulate && energies(&own.model.board).is_ok();
    let mut own: Vec<_> = designs(measured, choices).filter(known).collect();
    // The same design can be recommended for one contact and for several.
    own.dedup_by(|(a, _), (b, _)| std::ptr::eq(*a, *b));
    own.truncate(if options.quick { 1 } else { usize::MAX });
    let estimates =
        parallel("power", own, options.jobs, &options.interrupt, |(m, bit_true): (&Measured, &BitTrue)| {
            let hardware = Hardware::new(bit_true.model.clone(), &options.build)?;
            Ok((m, estimate_power(&hardware, &m.frames)?))
        })?;
    let source = estimates.first().map_or("", |(_, estimate)| estimate.source.as_str());
    Ok(Section {
        id: "power",
        title: "Power, estimated".into(),
        items: vec![
            Item::Text(format!(
                "{WHAT}: energies of a register bit that changes, of products, block RAMs and clock, each between a lower \
                 and an upper figure ({source}), times the changes counted in the simulated Verilog on the shipped frames. \
                 Static: the data sheet's typical standby current, half to twice."
            )),
            Item::Table(totals(&estimates)),
            Item::Table(stages(&estimates).collapsed()),
        ],
    })
}

/// The estimates, and below them the published figures.
fn totals(estimates: &[(&Measured, PowerEstimate)]) -> Table {
    let head = [
        "sensor",
        "case",
        "device",
        "frames",
        "frames per second",
        "static, lower mW",
        "static, upper mW",
        "clock, lower mW",
        "clock, upper mW",
        "all, lower mW",
        "all, upper mW",
        "per frame, lower µJ",
        "per frame, upper µJ",
    ];
    let own = estimates.iter().flat_map(|(m, estimate)| {
        estimate.rates.iter().map(move |rate| {
            let mut row = vec![
                text_cell(m.scene.name.clone()),
                text_cell(case_text(m.scene.partition.case)),
                text_cell(estimate.device.clone()),
                text_cell(rate.name),
                decimal(Some(rate.frames_per_second), 0),
            ];
            let ranges = [estimate.static_mW, estimate.clock_mW, rate.power_mW, rate.frame_uJ];
            row.extend(ranges.into_iter().flatten().map(|value| decimal(Some(value), usize::from(value < 10.0))));
            row
        })
    });
    let published = powers().into_iter().map(|published| {
        let mut row = vec![empty_cell(); head.len()];
        row[0] = text_cell(published.sensor);
        row[2] = text_cell(format!("{}, {}", published.system, published.source));
        let milliwatts = decimal(Some(1e3 * published.power_W), 0);
        (row[9], row[10]) = (milliwatts.clone(), milliwatts);
        row
    });
    let caption =
        "Estimated power and energy per frame, with frames at 1 kHz and back to back; last the published power";
    Table::new("power", caption, &head, own.chain(published).collect())
}

/// The changes and the energy of each stage.
fn stages(estimates: &[(&Measured, PowerEstimate)]) -> Table {
    let head =
        ["sensor", "case", "stage", "register bits", "changes per frame", "per frame, lower nJ", "per frame, upper nJ"];
    let rows = estimates.iter().flat_map(|(m, estimate)| {
        estimate.toggles.stages.iter().zip(&estimate.stages_nJ).map(|(own, energy)| {
            let mut row: Vec<Cell> = vec![
                text_cell(m.scene.name.clone()),
                text_cell(case_text(m.scene.partition.case)),
                text_cell(own.stage),
                count(own.register_bits as u64),
                decimal(Some(own.toggles), 0),
            ];
            row.extend(energy.map(|value| decimal(Some(value), usize::from(value < 10.0))));
            row
        })
    });
    Table::new("power-stages", "Register bits that change, and energy, by stage", &head, rows.collect())
}
