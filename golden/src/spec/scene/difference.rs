//! The first field in which two scenes differ.

use super::field::Table;
use super::{PartitionSpec, Scene};
use crate::spec::sensor::Sensor;

/// The first name whose fields differ.
fn first<const N: usize>(differs: [(&'static str, bool); N]) -> Option<&'static str> {
    differs.into_iter().find_map(|(field, differs)| differs.then_some(field))
}

fn of_sensors(a: &Sensor, b: &Sensor) -> Option<&'static str> {
    first([
        ("sensor.rows", a.rows != b.rows),
        ("sensor.cols", a.cols != b.cols),
        ("sensor.pitch_x_mm", a.pitch_x_mm != b.pitch_x_mm),
        ("sensor.pitch_y_mm", a.pitch_y_mm != b.pitch_y_mm),
        ("sensor.thickness_mm", a.thickness_mm != b.thickness_mm),
    ])
}

fn of_partitions(a: &PartitionSpec, b: &PartitionSpec) -> Option<&'static str> {
    first([
        ("partition.case", a.case != b.case),
        ("partition.cases", a.listed != b.listed),
        ("partition.condition", a.condition != b.condition),
        ("partition.max_contacts", a.max_contacts != b.max_contacts),
    ])
}

impl Scene {
    /// The first field that differs between two scenes, as `table.field`; `None` if at most their names do.
    pub(crate) fn differing_field(&self, other: &Scene) -> Option<&'static str> {
        of_sensors(&self.sensor, &other.sensor)
            .or_else(|| first([("medium", self.medium != other.medium)]))
            .or_else(|| of_partitions(&self.partition, &other.partition))
            .or_else(|| self.search.differing_field(&other.search))
            .or_else(|| self.inverse.differing_field(&other.inverse))
            .or_else(|| self.threshold.differing_field(&other.threshold))
            .or_else(|| self.fixed.differing_field(&other.fixed))
            // A table inside another.
            .or_else(|| self.hardware.table_range.differing_field(&other.hardware.table_range))
            .or_else(|| self.hardware.differing_field(&other.hardware))
            .or_else(|| self.input.differing_field(&other.input))
            .or_else(|| self.output.differing_field(&other.output))
    }
}
