//! Sensors that measure three axes: of each taxel the normal force, and the choice of one of several sensors in a file.
//!
//! Shear that the device measures itself is left out: a frame has normal stress, and the shear that Dermis finds can be compared
//! with it.

use super::error::{ImportError, Source};

/// The index of the sensor that the user names, or of the only one.
pub(super) fn choose(names: &[String], wanted: Option<&str>, source: &Source) -> Result<usize, ImportError> {
    let allowed = || format!("one of {}", names.join(", "));
    match (wanted, names) {
        (Some(wanted), _) => {
            names.iter().position(|name| name == wanted).ok_or_else(|| source.field("--sensor", wanted, allowed()))
        }
        (None, [_]) => Ok(0),
        (None, _) => Err(source.missing("the sensor", format!("name it with --sensor, {}", allowed()))),
    }
}

/// Checks that the sensor's taxels make up the stated size.
pub(super) fn size(
    taxels: usize,
    size: Option<[usize; 2]>,
    device: &str,
    source: &Source,
) -> Result<[usize; 2], ImportError> {
    let has = || format!("this {device} has {taxels} taxels");
    let [rows, cols] =
        size.ok_or_else(|| source.missing("the size", format!("give it with --size ROWSxCOLS; {}", has())))?;
    match rows * cols == taxels {
        true => Ok([rows, cols]),
        false => Err(source.field("--size", format!("{rows}x{cols}"), format!("that of the taxels; {}", has()))),
    }
}
