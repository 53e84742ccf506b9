//! The zero of each taxel: fixed, or following the readings while nothing presses.

use super::declared::Declared;
use super::field::{choice, number_of, table, whole, HasDefault, Kind, Member, Number, Table};
use super::reader::Reader;
use super::SceneError;
use toml::Value;

/// What the zero of each taxel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Zero {
    /// The stored one: the mean of the tare frames, else the table's offset, else 0.
    #[default]
    Fixed,
    /// It starts as the stored one and follows the readings while nothing presses: [`crate::data::input::running_zero`].
    Running(RunningZero),
}

/// How the zero of each taxel follows its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningZero {
    /// The zero takes 2^−average of what a reading is off; 1 to 16.
    pub average: u32,
    /// Largest distance from the stored zero in MPa, and largest stress in MPa that is no touch; above 0, at most the full
    /// scale.
    pub limit_MPa: f64,
}

impl RunningZero {
    /// Default of `input.zero_average`: a second at 1 kHz.
    pub const AVERAGE: u32 = 10;
    /// Default of `input.zero_limit_MPa` over the full scale.
    pub const LIMIT_SHARE: f64 = 1.0 / 64.0;
    /// Least limit over the noise of a frame, so that noise on any of 256 × 256 taxels is no touch.
    pub const LEAST_OVER_NOISE: f64 = 5.0;
}

table! {
    struct ZeroTable in "input" {
        /// The zero of each taxel is that of tare or table, or follows the readings while nothing presses; give all frames since the
        /// start.
        zero: bool = choice(&[("fixed", false), ("running", true)])
            .or(false)
            .hardware("yes, without a link")
            .page("architecture/prepare");
        /// A running zero takes 2^−zero_average of what a reading is off.
        zero_average: Option<u32> = whole::<u32>(1, 16).optional("10");
        /// How far in MPa a running zero may go, and what is no touch: more than the zeros drift, less than the lightest press; at
        /// least 5 times the noise floor, at most the full scale.
        zero_limit_MPa: Option<f64> = Number::Positive.optional("1/64 of the full scale");
    }
}

/// The fields of the zero of each taxel. A fixed one has neither rate nor limit. The limit of a running one is beyond the noise,
/// so that noise is no touch.
pub(super) struct ZeroFields;

impl Member for ZeroFields {
    type Value = Zero;

    fn read(&self, reader: &Reader, _: &str) -> Result<Zero, SceneError> {
        let ZeroTable { zero: runs, zero_average, zero_limit_MPa } = ZeroTable::read(reader)?;
        let limit = "input.zero_limit_MPa";
        if !runs {
            let stated = [("input.zero_average", zero_average.is_some()), (limit, zero_limit_MPa.is_some())];
            return match stated.into_iter().find(|(_, stated)| *stated) {
                Some((field, _)) => Err(reader.wrong_field(field, "left out, or input.zero = \"running\"")),
                None => Ok(Zero::Fixed),
            };
        }
        let number = |path| reader.value(path).and_then(number_of);
        let full_scale_MPa = number("input.full_scale_MPa");
        let of_arrays = reader.value("hardware.array_noise_floors_MPa").and_then(Value::as_array);
        let noise = number("search.noise_floor_MPa").into_iter();
        let noise = noise.chain(of_arrays.into_iter().flatten().filter_map(number_of));
        let least = RunningZero::LEAST_OVER_NOISE * noise.fold(0.0, f64::max);
        let in_range = |mpa: &f64| *mpa >= least && full_scale_MPa.is_none_or(|most| *mpa <= most);
        let allowed = "a number above 0, at least 5 times the noise floor, at most input.full_scale_MPa";
        if zero_limit_MPa.is_some_and(|mpa| !in_range(&mpa)) {
            return Err(reader.wrong_field(limit, allowed));
        }
        let by_full_scale = full_scale_MPa.map(|most| RunningZero::LIMIT_SHARE * most).filter(in_range);
        let limit_MPa = zero_limit_MPa.or(by_full_scale).ok_or_else(|| reader.missing(limit, allowed))?;
        Ok(Zero::Running(RunningZero { average: zero_average.unwrap_or(RunningZero::AVERAGE), limit_MPa }))
    }

    fn declare(&self, _: &str, _: &[&str], fields: &mut Vec<Declared>) {
        ZeroTable::declare(fields);
    }
}

impl HasDefault for ZeroFields {
    fn default_value(&self) -> Zero {
        Zero::Fixed
    }
}
