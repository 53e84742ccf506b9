//! What a scene's hardware has and what it leaves out, with what each omission saves: the model of the scene with that
//! feature put back, less the model of the scene.

use dermis_golden::fixed::omissions::{features, Feature};
use dermis_golden::fixed::{Cycles, Model};
use serde::Serialize;

use crate::generate::HdlError;
use crate::simulate::design;
use crate::usage::{stages, total, Usage};

/// A feature of the hardware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Explained {
    /// What it is.
    pub feature: &'static str,
    /// How the scene has it, or how it was put back.
    pub setting: String,
    /// Whether the scene has it.
    pub present: bool,
    /// What leaving it out saves; `None` where the scene has it or cannot have it.
    pub saved: Option<Saved>,
    /// Why the scene cannot have it.
    pub impossible: Option<String>,
}

/// Differences; negative where the feature would have saved something itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Saved {
    /// Block RAMs.
    pub block_rams: i64,
    /// Multipliers.
    pub multipliers: i64,
    /// Flip-flops, estimated.
    pub flip_flops: i64,
    /// LUTs, estimated.
    pub luts: i64,
    /// Cycles from the last input beat to the last output beat, everything searched.
    pub cycles: i64,
}

/// Every feature that hardware can do without.
///
/// # Errors
/// A feature put back that has a model and no hardware: a defect of this crate.
pub fn explain(model: &Model) -> Result<Vec<Explained>, HdlError> {
    let (own, own_cycles) = needs(model)?;
    let explained = |feature: Feature| {
        let (mut saved, mut impossible) = (None, None);
        match &feature.put_back {
            None => {}
            Some(Err(error)) => impossible = Some(error.to_string()),
            Some(Ok(other)) => {
                let (usage, cycles) = needs(other)?;
                let less = |with: usize, without: usize| with as i64 - without as i64;
                saved = Some(Saved {
                    block_rams: less(usage.block_rams, own.block_rams),
                    multipliers: less(usage.multipliers, own.multipliers),
                    flip_flops: less(usage.flip_flops, own.flip_flops),
                    luts: less(usage.luts, own.luts),
                    cycles: cycles as i64 - own_cycles as i64,
                });
            }
        }
        let Feature { name, setting, put_back } = feature;
        Ok(Explained { feature: name, setting, present: put_back.is_none(), saved, impossible })
    };
    features(model).into_iter().map(explained).collect()
}

fn needs(model: &Model) -> Result<(Usage, u64), HdlError> {
    let usage = total(&stages(model, &design(model)?.verilog()));
    Ok((usage, Cycles::of(model, &vec![true; model.parts.len()]).latency))
}
