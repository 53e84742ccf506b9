//! Table `[hardware.adc_scan]`, which `hardware.source = "adc-scan"` needs.

use super::reader::Reader;
use super::SceneError;
use crate::spec::adc::{AdcScan, CONVERTERS, MOST_AVERAGE, MOST_CONVERTERS};
use crate::spec::sensor::Sensor;
use toml::Value;

/// Fields of the table.
pub(super) const FIELDS: [&str; 8] = [
    "converter",
    "converters",
    "channels",
    "sclk_MHz",
    "row_settling_us",
    "channel_settling_us",
    "samples",
    "period_us",
];

/// The scan of a scene; `None` with `hardware.source = "stream"`.
pub(super) fn adc_scan(reader: &Reader, sensor: &Sensor) -> Result<Option<AdcScan>, SceneError> {
    let scans = reader.choice("hardware.source", &[("stream", false), ("adc-scan", true)])?;
    match (reader.value("hardware.adc_scan"), scans) {
        (Some(value), false) => {
            return Err(reader.wrong("hardware.adc_scan", value, "left out, or hardware.source = \"adc-scan\""));
        }
        (_, false) => return Ok(None),
        (_, true) => {}
    }
    let path = |field: &str| format!("hardware.adc_scan.{field}");
    let names = CONVERTERS.map(|converter| format!("{:?}", converter.name)).join(" or ");
    let named = |value: &Value| CONVERTERS.into_iter().find(|converter| value.as_str() == Some(converter.name));
    let converter = reader.typed(&path("converter"), named, &names)?;
    let converter = converter.ok_or_else(|| reader.missing(&path("converter"), names))?;
    // In range, so that the casts keep the values.
    let converters = reader.integer(&path("converters"), 1..=MOST_CONVERTERS as i64, Some(1))? as usize;
    let least = sensor.cols.div_ceil(converters);
    let all = converter.channels.min(least);
    let channels = reader.integer(&path("channels"), 1..=converter.channels as i64, Some(all as i64))? as usize;
    if converters * channels != sensor.cols {
        let exact = converters * least == sensor.cols && least <= converter.channels;
        let expected = match exact {
            true => format!("{least}, for {} columns with {converters} converters", sensor.cols),
            false => format!(
                "columns / hardware.adc_scan.converters, a whole number up to {}; there are {} columns and {converters} \
                 converters",
                converter.channels, sensor.cols
            ),
        };
        return Err(reader.wrong(&path("channels"), &Value::Integer(channels as i64), expected));
    }
    let above = |field: &str| {
        let allowed = "a number above 0";
        let number = reader.number(&path(field), |number| number > 0.0, allowed)?;
        number.ok_or_else(|| reader.missing(&path(field), allowed))
    };
    let time = |field: &str| {
        let number = reader.number(&path(field), |number| number >= 0.0, "a number of at least 0")?;
        Ok::<f64, SceneError>(number.unwrap_or(0.0))
    };
    let power = |value: &Value| (0..=MOST_AVERAGE).find(|power| value.as_integer() == Some(1 << power));
    let allowed = format!("a power of two from 1 to {}", 1 << MOST_AVERAGE);
    Ok(Some(AdcScan {
        converter,
        converters,
        channels,
        sclk_MHz: above("sclk_MHz")?,
        row_settling_us: time("row_settling_us")?,
        channel_settling_us: time("channel_settling_us")?,
        average: reader.typed(&path("samples"), power, &allowed)?.unwrap_or(0),
        period_us: above("period_us")?,
    }))
}

#[cfg(test)]
mod tests {
    use crate::spec::scene::Scene;

    fn scene(more: &str) -> Result<Scene, String> {
        let sensor = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n";
        Scene::parse(&format!("{sensor}{more}"), "mat.toml").map_err(|error| error.to_string())
    }

    fn table(more: &str) -> Result<Scene, String> {
        let head = "[hardware]\nsource = \"adc-scan\"\n[hardware.adc_scan]\n";
        scene(&format!("{head}{more}"))
    }

    const LEAST: &str = "converter = \"max11125\"\nsclk_MHz = 10\nperiod_us = 1000\n";

    #[test]
    fn defaults_and_values() {
        let scan = table(LEAST).unwrap().hardware.adc_scan.unwrap();
        assert_eq!((scan.converters, scan.channels, scan.average, scan.row_settling_us), (1, 8, 0, 0.0));
        let scan = table(&format!("{LEAST}converters = 2\nsamples = 16\n")).unwrap().hardware.adc_scan.unwrap();
        assert_eq!((scan.channels, scan.samples(), scan.cols()), (4, 16, 8));
        assert_eq!(scene("[hardware]\nsource = \"stream\"").unwrap().hardware.adc_scan, None);
    }

    #[test]
    fn wrong_values_say_what_is_possible() {
        let with = |more: &str| table(&format!("{LEAST}{more}")).unwrap_err();
        let cases = [
            (
                table("sclk_MHz = 10\nperiod_us = 1000").unwrap_err(),
                "converter is missing; it must be \"max11125\" or \"ads8688\"",
            ),
            (
                table("converter = \"max1\"").unwrap_err(),
                "converter = \"max1\" is not allowed; it must be \"max11125\" or \"ads8688\"",
            ),
            (
                table("converter = \"max11125\"\nperiod_us = 1").unwrap_err(),
                "sclk_MHz is missing; it must be a number above 0",
            ),
            (with("converters = 3"), "channels = 3 is not allowed; it must be columns / hardware.adc_scan.converters"),
            (with("channels = 4"), "channels = 4 is not allowed; it must be 8, for 8 columns with 1 converters"),
            (with("channels = 9"), "channels = 9 is not allowed; it must be a whole number from 1 to 8"),
            (with("samples = 3"), "samples = 3 is not allowed; it must be a power of two from 1 to 256"),
            (with("row_settling_us = -1"), "row_settling_us = -1 is not allowed; it must be a number of at least 0"),
            (with("rows = 8"), "unknown field hardware.adc_scan.rows"),
            (scene("[hardware.adc_scan]\nsclk_MHz = 1").unwrap_err(), "left out, or hardware.source = \"adc-scan\""),
            (scene("[hardware]\nsource = \"adc\"").unwrap_err(), "\"stream\" or \"adc-scan\""),
        ];
        for (text, wanted) in cases {
            assert!(text.starts_with("mat.toml: ") && text.contains(wanted), "{text}");
        }
    }

    #[test]
    fn what_a_scan_cannot_give_is_refused() {
        let refused =
            |more: &str| table(&format!("{LEAST}{more}")).unwrap().require_supported().unwrap_err().to_string();
        assert!(refused("[fixed]\ninput_bits = 12").contains("fixed.input_bits = 12"));
        assert!(refused("[input]\naverage = 1").contains("input.average = 1"));
        let text = table(LEAST).unwrap().require_supported();
        assert!(text.is_ok(), "{text:?}");
    }
}
