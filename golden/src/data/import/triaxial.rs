//! Sensors that measure three axes: of each taxel the normal force, and the choice of one of several sensors in a file.
//!
//! Shear that the device measures itself is left out: a frame has normal stress, and the shear that Dermis finds can be compared
//! with it.

use super::error::{ImportError, Source};

/// What the user states of a file of such sensors.
pub(super) struct Wanted<'a> {
    /// Rows and columns of the sensor.
    pub size: Option<[usize; 2]>,
    /// Its name.
    pub sensor: Option<&'a str>,
}

impl Wanted<'_> {
    /// The index of the sensor that the user names, or of the only one.
    pub(super) fn choose(&self, names: &[String], source: &Source) -> Result<usize, ImportError> {
        let allowed = || format!("one of {}", names.join(", "));
        match (self.sensor, names) {
            (Some(wanted), _) => {
                names.iter().position(|name| name == wanted).ok_or_else(|| source.field("--sensor", wanted, allowed()))
            }
            (None, [_]) => Ok(0),
            (None, _) => Err(source.missing("the sensor", format!("name it with --sensor, {}", allowed()))),
        }
    }

    /// The stated size, which the sensor's taxels must make up.
    pub(super) fn size(&self, taxels: usize, device: &str, source: &Source) -> Result<[usize; 2], ImportError> {
        let has = || format!("this {device} has {taxels} taxels");
        let open = || source.missing("the size", format!("give it with --size ROWSxCOLS; {}", has()));
        let [rows, cols] = self.size.ok_or_else(open)?;
        match rows * cols == taxels {
            true => Ok([rows, cols]),
            false => Err(source.field("--size", format!("{rows}x{cols}"), format!("that of the taxels; {}", has()))),
        }
    }
}
