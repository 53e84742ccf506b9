//! Table `[hardware.adc_scan]`, which `hardware.source = "adc-scan"` needs.

use super::declared::Declared;
use super::field::{choice, table, whole, HasDefault, Kind, Member, Number, Power, Table};
use super::reader::Reader;
use super::SceneError;
use crate::spec::adc::{AdcScan, Converter, CONVERTERS, MOST_AVERAGE, MOST_CONVERTERS};
use serde_json::{json, Value as Json};
use toml::Value;

table! {
    struct ScanTable in "hardware.adc_scan" {
        /// Type of the converters, as `dermis converters` lists them.
        converter: Converter = ConverterName.required().page("architecture/scan");
        /// Number of converters on one CS.
        converters: usize = whole::<usize>(1, MOST_CONVERTERS as u32).or(1).page("architecture/scan");
        /// Channels that are used of each converter; times `converters` the columns of the array.
        channels: Option<usize> = whole::<usize>(1, MOST_CHANNELS).optional("cols / converters").page("architecture/scan");
        /// SCLK in MHz; the clock's next lower even fraction is taken.
        sclk_MHz: f64 = Number::Positive.required().page("architecture/scan");
        /// Time in µs from switching a row until its columns have settled.
        row_settling_us: f64 = Number::NotNegative.or(0.0).page("architecture/scan");
        /// Least time in µs between two samples where the channel changes.
        channel_settling_us: f64 = Number::NotNegative.or(0.0).page("architecture/scan");
        /// Samples of a taxel that are averaged.
        samples: u32 = Power(MOST_AVERAGE).or(0).page("architecture/scan");
        /// Time in µs from one scan to the next.
        period_us: f64 = Number::Positive.required().page("architecture/scan");
    }
}

/// Most channels of any converter.
const MOST_CHANNELS: u32 = {
    let (mut most, mut k) = (0, 0);
    while k < CONVERTERS.len() {
        if CONVERTERS[k].channels > most {
            most = CONVERTERS[k].channels;
        }
        k += 1;
    }
    most as u32
};

struct ConverterName;

impl Kind for ConverterName {
    type Value = Converter;

    fn read(&self, value: &Value, _: &str) -> Option<Converter> {
        CONVERTERS.into_iter().find(|converter| value.as_str() == Some(converter.name))
    }

    fn allowed(&self) -> String {
        CONVERTERS.map(|converter| format!("{:?}", converter.name)).join(" or ")
    }

    fn schema(&self) -> Json {
        json!({ "enum": CONVERTERS.map(|converter| converter.name) })
    }
}

table! {
    struct SourceTable in "hardware" {
        /// Whether codes come as a stream or the hardware reads the converters of the array, `hardware.adc_scan`.
        source: bool = choice(&[("stream", false), ("adc-scan", true)]).or(false).page("architecture/scan");
    }
}

/// `hardware.source` and the table of the scan, which only `"adc-scan"` has.
pub(super) struct ScanFields;

impl Member for ScanFields {
    type Value = Option<AdcScan>;

    fn read(&self, reader: &Reader, path: &str) -> Result<Option<AdcScan>, SceneError> {
        let SourceTable { source: scans } = SourceTable::read(reader)?;
        if !scans {
            return match reader.value(path) {
                Some(value) => Err(reader.wrong(path, value, "left out, or hardware.source = \"adc-scan\"")),
                None => Ok(None),
            };
        }
        let scan = ScanTable::read(reader)?;
        // The sensor has been read.
        let cols = reader.value("sensor.cols").and_then(Value::as_integer).map_or(0, |cols| cols as usize);
        Ok(Some(AdcScan {
            converter: scan.converter,
            converters: scan.converters,
            channels: scan.channels(reader, cols)?,
            sclk_MHz: scan.sclk_MHz,
            row_settling_us: scan.row_settling_us,
            channel_settling_us: scan.channel_settling_us,
            average: scan.samples,
            period_us: scan.period_us,
        }))
    }

    fn declare(&self, _: &str, _: &[&str], fields: &mut Vec<Declared>) {
        SourceTable::declare(fields);
        ScanTable::declare(fields);
    }
}

impl HasDefault for ScanFields {
    fn default_value(&self) -> Option<AdcScan> {
        None
    }
}

impl ScanTable {
    /// The channels that are used of each converter: as many as make up the columns.
    fn channels(&self, reader: &Reader, cols: usize) -> Result<usize, SceneError> {
        let (path, most) = ("hardware.adc_scan.channels", self.converter.channels);
        let least = cols.div_ceil(self.converters);
        let channels = self.channels.unwrap_or(most.min(least));
        let allowed = if channels > most {
            format!("a whole number from 1 to {most}")
        } else if self.converters * channels == cols {
            return Ok(channels);
        } else if self.converters * least == cols && least <= most {
            format!("{least}, for {cols} columns with {} converters", self.converters)
        } else {
            format!(
                "columns / hardware.adc_scan.converters, a whole number up to {most}; there are {cols} columns and {} \
                 converters",
                self.converters
            )
        };
        Err(reader.wrong(path, &Value::Integer(channels as i64), allowed))
    }
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
