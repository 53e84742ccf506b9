//! What a scene's hardware has and what it leaves out, with what each omission saves: the model of the scene with that
//! feature put back, less the model of the scene.

use dermis_golden::fixed::feature_costs::{features, Feature};
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
    /// What it costs against the scene without it, where that depends on how the scene has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub costs: Option<Saved>,
    /// Why the scene cannot have it.
    pub impossible: Option<String>,
}

/// Differences, with a feature less without it; negative where it saves something itself.
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
    let own = needs(model)?;
    let explained = |feature: Feature| {
        let (mut saved, mut impossible) = (None, None);
        match &feature.with_feature {
            None => {}
            Some(Err(error)) => impossible = Some(error.to_string()),
            Some(Ok(other)) => saved = Some(difference(&needs(other)?, &own)),
        }
        let costs = match &feature.without_feature {
            None => None,
            Some(other) => Some(difference(&own, &needs(other)?)),
        };
        let Feature { name, setting, with_feature, .. } = feature;
        Ok(Explained { feature: name, setting, present: with_feature.is_none(), saved, costs, impossible })
    };
    features(model).into_iter().map(explained).collect()
}

fn difference((with, cycles_with): &(Usage, u64), (without, cycles_without): &(Usage, u64)) -> Saved {
    let less = |with: usize, without: usize| with as i64 - without as i64;
    Saved {
        block_rams: less(with.block_rams, without.block_rams),
        multipliers: less(with.multipliers, without.multipliers),
        flip_flops: less(with.flip_flops, without.flip_flops),
        luts: less(with.luts, without.luts),
        cycles: *cycles_with as i64 - *cycles_without as i64,
    }
}

fn needs(model: &Model) -> Result<(Usage, u64), HdlError> {
    let usage = total(&stages(model, &design(model)?.verilog()));
    Ok((usage, Cycles::longest(model).latency))
}
