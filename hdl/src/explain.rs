//! Which features a scene's hardware has, which it omits, and what each omission saves: the model of the scene with
//! that feature added, minus the model of the scene.

use dermis_golden::fixed::plan::feature_costs::{features, Feature};
use dermis_golden::fixed::plan::program::listing;
use dermis_golden::fixed::{Cycles, Model};
use serde::Serialize;
use serde_json::json;

use crate::error::HdlError;
use crate::generate::{usage, Generated};
use crate::usage::{total, Usage};

/// A feature of the hardware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Explained {
    /// Name of the feature.
    pub feature: &'static str,
    /// The scene's setting of it, or the setting with which it was added for comparison.
    pub setting: String,
    /// The scene's hardware has the feature.
    pub present: bool,
    /// What omitting it saves; `None` if the scene has the feature or cannot have it.
    pub saved: Option<Saved>,
    /// What it costs compared with the scene without it, where the cost depends on the setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub costs: Option<Saved>,
    /// Why the scene cannot have it; `None` if it can.
    pub impossible: Option<String>,
}

/// Resources and cycles with a feature minus without it; negative where the feature reduces them.
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
    /// Clock cycles from the last input beat to the last output beat, all subarrays searched.
    pub cycles: i64,
}

impl Generated {
    /// Adds the list of features and the program of the passes of `model` to the manifest, and updates the checksums.
    pub fn add_explained(&mut self, model: &Model, explained: &[Explained]) {
        self.manifest["features"] = json!(explained);
        let program = listing(model);
        if !program.is_empty() {
            self.manifest["program"] = json!(program);
        }
        self.seal();
    }
}

/// Every optional feature of the hardware, with its cost or saving in `model`.
///
/// # Errors
/// [`HdlError`] if a feature was added that has a model and no hardware: a defect of this crate.
pub fn explain(model: &Model) -> Result<Vec<Explained>, HdlError> {
    let own = needs(model)?;
    let explained = |feature: Feature| {
        let Feature { name, setting, with_feature, without_feature } = feature;
        let present = with_feature.is_none();
        let (mut saved, mut impossible) = (None, None);
        match with_feature {
            None => {}
            Some(Err(error)) => impossible = Some(error.to_string()),
            Some(Ok(plan)) => saved = Some(difference(&needs(&model.variant(plan))?, &own)),
        }
        let costs = match without_feature {
            None => None,
            Some(plan) => Some(difference(&own, &needs(&model.variant(plan))?)),
        };
        Ok(Explained { feature: name, setting, present, saved, costs, impossible })
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
    let usage = total(&usage(model)?);
    Ok((usage, Cycles::longest(model).latency))
}
