//! XELA uSkin: the messages of its server, a JSON object per line.
//!
//! | field | meaning |
//! |---|---|
//! | `message` | number of the message; `"Welcome"` in the first one, which has no readings |
//! | `time` | seconds since 1970 |
//! | `1`, `2`, … | a sensor each |
//! | of it `taxels`, `model` | number of its taxels, name |
//! | of it `data` | x, y and z of each taxel, counts of 16 bits in four hexadecimal digits, separated by commas |
//! | of it `calibrated` | the same as forces in N; `null` where the sensor is not calibrated |
//!
//! Of each taxel z is taken, the normal force; without calibration counts, whose zero is not 0 (`--zero first:N`).

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::value::RawValue;

use super::error::{ImportError, Source};
use super::format::Format;
use super::recording::{is_reading, RawFrame, Recording};
use super::triaxial::Wanted;
use super::units::Unit;
use crate::data::text::number_ns;

/// Values of a taxel: x, y, z.
const AXES: usize = 3;

/// A sensor in a message.
#[derive(Deserialize)]
struct Sensor {
    data: String,
    taxels: usize,
    model: Option<String>,
    calibrated: Option<Vec<f64>>,
}

/// What the first message shows of the sensor that is read.
struct First {
    name: String,
    model: Option<String>,
    shape: [usize; 2],
    calibrated: bool,
}

/// Reads a recording of the wanted sensor.
pub(super) fn parse(text: &str, wanted: &Wanted, source: &Source) -> Result<Recording, ImportError> {
    let (mut frames, mut left_out, mut start_ns) = (Vec::new(), Vec::new(), None);
    let mut first: Option<First> = None;
    for (index, text) in text.lines().enumerate().filter(|(_, text)| !text.trim().is_empty()) {
        let line = index + 1;
        let message: BTreeMap<String, &RawValue> = match serde_json::from_str(text) {
            Ok(message) => message,
            Err(error) => {
                left_out.push(format!("line {line}: no JSON object, from column {} on", error.column()));
                continue;
            }
        };
        let names: Vec<String> = message.keys().filter(|key| key.parse::<u32>().is_ok()).cloned().collect();
        if names.is_empty() {
            continue;
        }
        let name = match &first {
            Some(first) => first.name.clone(),
            None => names[wanted.choose(&names, source)?].clone(),
        };
        let wrong = |reason: &str| source.line(line, text, format!("a message whose sensor {name} has {reason}"));
        let Some(sensor) = message.get(&name) else {
            left_out.push(format!("line {line}: without sensor {name}"));
            continue;
        };
        let sensor: Sensor =
            serde_json::from_str(sensor.get()).map_err(|_| wrong("data, taxels, model and calibrated"))?;
        let calibrated = match &first {
            Some(first) => first.calibrated,
            None => {
                let shape = wanted.size(sensor.taxels, "XELA sensor", source)?;
                let (model, calibrated) = (sensor.model.clone(), sensor.calibrated.is_some());
                first.insert(First { name: name.clone(), model, shape, calibrated }).calibrated
            }
        };
        let all = values(&sensor, calibrated).filter(|all| sensor.taxels.checked_mul(AXES) == Some(all.len()));
        let all = all.ok_or_else(|| wrong("x, y and z of each taxel"))?;
        // As it is written: a floating-point number rounds the digits of a date.
        let time_ns = message.get("time").and_then(|time| number_ns(time.get(), 0));
        let start_ns = *start_ns.get_or_insert(time_ns.unwrap_or(0));
        frames.push(RawFrame {
            number: frames.len() + 1,
            time_s: time_ns.map(|time| time.saturating_sub(start_ns) as f64 / 1e9),
            values: all.chunks(AXES).map(|taxel| taxel[AXES - 1]).collect(),
            stated: None,
            device: None,
        });
    }
    let First { name, model, shape, calibrated } =
        first.ok_or_else(|| source.missing("the first frame", "no line has a message with readings"))?;
    if let Some(frame) = frames.iter().find(|frame| frame.values.len() != shape[0] * shape[1]) {
        return Err(source.field(
            &format!("taxels of message {}", frame.number),
            frame.values.len(),
            "that of the first",
        ));
    }
    let device = Some(format!("XELA {}, sensor {name}", model.unwrap_or_default()));
    let (unit, bits) = if calibrated { (Unit::Newton, None) } else { (Unit::Raw, Some(16)) };
    Ok(Recording { device, unit: Some(unit), bits, left_out, ..Recording::bare(Format::Xela, shape, frames) })
}

/// Forces in N, or counts; `None` if one is neither.
fn values(sensor: &Sensor, calibrated: bool) -> Option<Vec<f64>> {
    if calibrated {
        return sensor.calibrated.clone().filter(|forces| forces.iter().all(|force| is_reading(*force)));
    }
    let count = |text: &str| u16::from_str_radix(text.trim(), 16).ok().map(f64::from);
    sensor.data.split(',').map(count).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{import, Imported, Settings};
    use super::*;

    const WELCOME: &str = "{\"message\": \"Welcome\", \"time\": 1700000000.0}\n";

    /// A message of sensor 1, of four taxels with these counts of z.
    fn message(number: u32, z: [u16; 4], calibrated: &str) -> String {
        let data: Vec<String> = z.iter().map(|z| format!("7F00,80FF,{z:04X}")).collect();
        format!(
            "{{\"message\": {number}, \"time\": {}, \"sensors\": 1, \"1\": {{\"data\": \"{}\", \"sensor\": \"1\", \
             \"taxels\": 4, \"model\": \"made-up\", \"calibrated\": {calibrated}}}}}\n",
            format_args!("1700000000.{number:02}"),
            data.join(",")
        )
    }

    fn read(text: &str, size: Option<[usize; 2]>, zero: Option<usize>) -> Result<Imported, String> {
        let correction = super::super::Correction { zero_frames: zero, ..Default::default() };
        let full_scale_MPa = zero.map(|_| 6.5535);
        let settings = Settings { pitch_mm: Some([4.0, 5.0]), size, full_scale_MPa, correction, ..Settings::default() };
        import("xela.log", text.as_bytes(), &settings).map_err(|error| error.to_string())
    }

    #[test]
    fn counts_and_forces_along_the_normal_are_read() {
        let counts =
            WELCOME.to_owned() + &message(1, [40000; 4], "null") + &message(2, [40000, 40100, 40000, 41000], "null");
        let imported = read(&counts, Some([2, 2]), Some(1)).unwrap();
        let summary = &imported.summary;
        assert_eq!((summary.format, summary.unit), (Format::Xela, Unit::Raw));
        let stress: Vec<f64> = imported.frames[1].stress_MPa.iter().map(|b| (b * 1e4).round()).collect();
        assert_eq!((stress, summary.frames[1].time_s), (vec![0.0, 100.0, 0.0, 1000.0], Some(0.01)));
        let forces = message(1, [0; 4], "[9,9,0.5, 9,9,0, 9,9,1, 9,9,-0.25]");
        let imported = read(&forces, Some([2, 2]), None).unwrap();
        assert_eq!(imported.summary.unit, Unit::Newton);
        // On 20 mm².
        assert_eq!(imported.frames[0].stress_MPa, [0.025, 0.0, 0.05, -0.0125]);
        assert_eq!(imported.summary.device.as_deref(), Some("XELA made-up, sensor 1"));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let one = message(1, [1; 4], "null");
        let text = read(&one, None, Some(1)).unwrap_err();
        assert_eq!(text, "xela.log: the size is missing; give it with --size ROWSxCOLS; this XELA sensor has 4 taxels");
        let short = read(&one.replace(",0001\"", "\""), Some([2, 2]), Some(1)).unwrap_err();
        assert!(short.starts_with("xela.log, line 1: ") && short.ends_with("x, y and z of each taxel"), "{short}");
        // Behind the first, whose number of taxels is that of the size: one that three times is none that there is.
        let many = one.clone() + &one.replace("\"taxels\": 4", "\"taxels\": 9223372036854775812");
        let many = read(&many, Some([2, 2]), Some(1)).unwrap_err();
        assert!(many.starts_with("xela.log, line 2: ") && many.ends_with("x, y and z of each taxel"), "{many}");
        let two = one.replace("\"1\": {", "\"2\": {\"data\": \"\", \"taxels\": 0}, \"1\": {");
        assert!(read(&two, Some([2, 2]), Some(1)).unwrap_err().contains("name it with --sensor, one of 1, 2"));
        let cut = one.clone() + &one[..40];
        assert_eq!(read(&cut, Some([2, 2]), Some(1)).unwrap().summary.lines_left_out.len(), 1);
        assert!(read(WELCOME, Some([2, 2]), None).unwrap_err().contains("no line has a message with readings"));
    }
}
