//! Cycle counts of the engine at full speed: input one beat a cycle, output always ready.

use serde::Serialize;

use super::model::Model;
use super::send::STATUS_BEATS;

/// How long a frame takes, in clock cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Cycles {
    /// From the last input beat to the first output beat.
    pub first_output: u64,
    /// From the last input beat to the last output beat, status included.
    pub latency: u64,
    /// From the first input beat to the last output beat, both included.
    pub total: u64,
}

impl Cycles {
    /// The counts of a frame of `model`; a frame that is not searched is done sooner.
    pub fn of(model: &Model, searching: bool) -> Self {
        let taxels = model.scene.sensor.taxels() as u64;
        let first_output = u64::from(searching);
        let latency = first_output + taxels + STATUS_BEATS as u64 - 1;
        Cycles { first_output, latency, total: taxels + latency }
    }
}
