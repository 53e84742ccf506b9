//! File: a trained network with the physics it was trained for.
//!
//! ```text
//! "dermis network 2\n"       magic and version
//! JSON, "\n"                 signature, widths, limit of the misfit
//! per layer: largest output (f32)
//!            row by row      bias (f32)
//!            parity by parity, row by row
//!                            scale (f32), weights of 12 bits, two in three bytes
//! CRC-32                     of all before it
//! ```
//!
//! The limit of [`crate::estimate::misfit`] is measured after the training; a file without one is read as well.
//!
//! Numbers are little-endian. A weight is its row's scale times a whole number of −2047 … 2047; a pair (u, v) of them, 2048
//! added to each, is u + 4096 v; an odd row ends with v = 2048.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in, out: network, signature | – | – |
//! | out, in: bytes | about 1.5 per weight | – |

use super::error::LearnedError;
use super::features::Features;
use super::network::{Layer, Network, OUTPUT_CHANNELS};
use super::signature::Signature;
use faer::{Mat, RowRef};
use serde::{Deserialize, Serialize};

/// Magic and version.
const MAGIC: &[u8] = b"dermis network 2\n";
/// Largest whole number of a weight.
const LARGEST: f32 = 2047.0;
/// Added to a weight's number.
const ZERO: i32 = 2048;
/// Widest layer, so that a damaged file asks for no more memory than it may.
const WIDEST: usize = 1 << 14;

#[derive(Serialize, Deserialize)]
struct Head {
    signature: Signature,
    widths: Vec<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    misfit_limit: Option<f64>,
}

/// The bytes of a file.
pub(super) fn encode(network: &Network, signature: &Signature) -> Result<Vec<u8>, LearnedError> {
    let head = Head { signature: signature.clone(), widths: network.widths(), misfit_limit: None };
    let mut bytes = begin(&head)?;
    for layer in &network.layers {
        bytes.extend(layer.largest.to_le_bytes());
        bytes.extend(layer.bias.iter().flat_map(|bias| bias.to_le_bytes()));
        for row in layer.weights.iter().flat_map(|weights| weights.row_iter()) {
            let scale = scale(row);
            bytes.extend(scale.to_le_bytes());
            let number = |col: usize| match col < row.ncols() && scale > 0.0 {
                true => ((row[col] / scale).round() as i32 + ZERO) as u32,
                false => ZERO as u32,
            };
            for col in (0..row.ncols()).step_by(2) {
                bytes.extend(&(number(col) | number(col + 1) << 12).to_le_bytes()[..3]);
            }
        }
    }
    Ok(checked(bytes))
}

/// Magic and head.
fn begin(head: &Head) -> Result<Vec<u8>, LearnedError> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(serde_json::to_vec(head).map_err(|error| LearnedError::Encode(error.to_string()))?);
    bytes.push(b'\n');
    Ok(bytes)
}

/// The bytes with their check sum.
fn checked(mut bytes: Vec<u8>) -> Vec<u8> {
    let crc = crc32fast::hash(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// The bytes of a file with another limit of the misfit; the weights stay as they are. `file` names it in errors.
pub(super) fn with_limit(bytes: &[u8], limit: f64, file: &str) -> Result<Vec<u8>, LearnedError> {
    let (head, weights) = parts(bytes, file)?;
    let mut own = begin(&Head { misfit_limit: Some(limit), ..head })?;
    own.extend(weights);
    Ok(checked(own))
}

/// The scale of a row's weights.
fn scale(row: RowRef<f32>) -> f32 {
    row.iter().fold(0.0f32, |most, weight| weight.abs().max(most)) / LARGEST
}

/// Head of a file's bytes, and the bytes of its weights; `file` names it in errors.
fn parts<'a>(bytes: &'a [u8], file: &str) -> Result<(Head, &'a [u8]), LearnedError> {
    let damaged = |reason: &str| LearnedError::Damaged { file: file.to_owned(), reason: reason.to_owned() };
    let body = bytes.strip_prefix(MAGIC).ok_or_else(|| damaged("it does not begin with \"dermis network 2\""))?;
    let (checked, crc) = bytes.split_last_chunk::<4>().ok_or_else(|| damaged("it is too short"))?;
    if crc32fast::hash(checked) != u32::from_le_bytes(*crc) {
        return Err(damaged("its check sum does not fit"));
    }
    let end = body.iter().position(|byte| *byte == b'\n').ok_or_else(|| damaged("it has no signature"))?;
    let head: Head = serde_json::from_slice(&body[..end]).map_err(|error| damaged(&error.to_string()))?;
    let widths = &head.widths;
    if widths.len() < 2 || widths.iter().any(|width| !(1..=WIDEST).contains(width)) {
        return Err(damaged("its widths are out of range"));
    }
    let inputs = Features::channels(&head.signature.window) + head.signature.cover.inputs();
    if widths.first() != Some(&inputs) || widths.last() != Some(&OUTPUT_CHANNELS) {
        return Err(damaged("its widths do not fit its window"));
    }
    if !head.signature.cover.is_possible() {
        return Err(damaged("its range of sensors is none"));
    }
    if head.misfit_limit.is_some_and(|limit| !(limit > 0.0 && limit.is_finite())) {
        return Err(damaged("its limit of the misfit is out of range"));
    }
    Ok((head, &body[end + 1..body.len() - 4]))
}

/// The limit of the misfit in a file's bytes; `file` names it in errors.
pub(super) fn limit(bytes: &[u8], file: &str) -> Result<Option<f64>, LearnedError> {
    Ok(parts(bytes, file)?.0.misfit_limit)
}

/// The signature in a file's bytes; `file` names it in errors.
pub(super) fn signature(bytes: &[u8], file: &str) -> Result<Signature, LearnedError> {
    Ok(parts(bytes, file)?.0.signature)
}

/// Network and signature of a file's bytes; `file` names it in errors.
pub(super) fn decode(bytes: &[u8], file: &str) -> Result<(Network, Signature), LearnedError> {
    let damaged = |reason: &str| LearnedError::Damaged { file: file.to_owned(), reason: reason.to_owned() };
    let (head, mut rest) = parts(bytes, file)?;
    let mut layers = Vec::new();
    for pair in head.widths.windows(2) {
        layers.push(layer(&mut rest, pair[0], pair[1]).ok_or_else(|| damaged("it is too short"))?);
    }
    if !rest.is_empty() {
        return Err(damaged("it is too long"));
    }
    Ok((Network { layers }, head.signature))
}

fn layer(rest: &mut &[u8], inputs: usize, outputs: usize) -> Option<Layer> {
    let float = |rest: &mut &[u8]| {
        let (head, tail) = rest.split_first_chunk::<4>()?;
        *rest = tail;
        Some(f32::from_le_bytes(*head)).filter(|value| value.is_finite())
    };
    let largest = float(rest)?;
    let bias = (0..outputs).map(|_| float(rest)).collect::<Option<Vec<f32>>>()?;
    let mut weights = std::array::from_fn(|_| Mat::zeros(outputs, inputs));
    for (parity, row) in (0..weights.len()).flat_map(|parity| (0..outputs).map(move |row| (parity, row))) {
        let scale = float(rest)?;
        for col in (0..inputs).step_by(2) {
            let ([a, b, c], tail) = rest.split_first_chunk::<3>()?;
            *rest = tail;
            let pair = u32::from_le_bytes([*a, *b, *c, 0]);
            let weight = |number: u32| scale * (number as i32 - ZERO) as f32;
            weights[parity][(row, col)] = weight(pair & 0xfff);
            if col + 1 < inputs {
                weights[parity][(row, col + 1)] = weight(pair >> 12);
            }
        }
    }
    Some(Layer { weights, bias, largest })
}

#[cfg(test)]
mod tests {
    use super::super::signature::{Cover, SensorRange};
    use super::*;
    use crate::random::Random;
    use crate::spec::scene::Scene;

    fn network() -> (Network, Signature) {
        let mut scene = Scene::builtin("sensor-1").unwrap();
        (scene.sensor.rows, scene.sensor.cols) = (2, 2);
        (Network::random(&[4, 5, OUTPUT_CHANNELS], &mut Random::new(1)), Signature::of(&scene))
    }

    #[test]
    fn a_file_has_the_network_to_12_bits() {
        let (network, signature) = network();
        let bytes = encode(&network, &signature).unwrap();
        let (read, own) = decode(&bytes, "f").unwrap();
        assert_eq!(own, signature);
        for (a, b) in network.layers.iter().zip(&read.layers) {
            assert_eq!((&a.bias, a.largest), (&b.bias, b.largest));
            for (a, b) in a.weights.iter().zip(&b.weights) {
                for (a, b) in a.row_iter().zip(b.row_iter()) {
                    assert!((0..a.ncols()).all(|col| (a[col] - b[col]).abs() <= 0.51 * scale(a)));
                }
            }
        }
        // Weights that are whole numbers of the scale stay as they are.
        assert_eq!(decode(&encode(&read, &own).unwrap(), "f").unwrap().0.widths(), [4, 5, 2]);
    }

    #[test]
    fn damage_is_found() {
        let (network, signature) = network();
        let bytes = encode(&network, &signature).unwrap();
        for at in [0, 20, bytes.len() / 2, bytes.len() - 1] {
            let mut bad = bytes.clone();
            bad[at] ^= 4;
            assert!(matches!(decode(&bad, "f"), Err(LearnedError::Damaged { .. })), "{at}");
        }
        for length in [0, 3, 17, bytes.len() - 1] {
            assert!(matches!(decode(&bytes[..length], "f"), Err(LearnedError::Damaged { .. })), "{length}");
        }
    }

    #[test]
    fn a_range_that_no_sensor_is_in_is_refused() {
        let read = |pitch_over_thickness: [f64; 2]| {
            let (_, mut signature) = network();
            signature.cover = Cover::Range(SensorRange { pitch_over_thickness, poisson: None, least_side: None });
            let inputs = Features::channels(&signature.window) + signature.cover.inputs();
            let network = Network::random(&[inputs, 5, OUTPUT_CHANNELS], &mut Random::new(1));
            decode(&encode(&network, &signature).unwrap(), "f")
        };
        assert!(read([0.5, 2.0]).is_ok() && read([1.0, 1.0]).is_ok());
        for bad in [[0.0, 2.0], [-1.0, 2.0], [2.0, 0.5]] {
            let error = read(bad).unwrap_err().to_string();
            assert!(error.contains("its range of sensors is none"), "{bad:?}: {error}");
        }
    }

    /// The limit is written without a change of the weights; a file without one, as older versions wrote it, is read.
    #[test]
    fn the_limit_of_the_misfit_is_part_of_the_head() {
        let (network, signature) = network();
        let plain = encode(&network, &signature).unwrap();
        assert_eq!(limit(&plain, "f").unwrap(), None);
        let limited = with_limit(&plain, 0.9375, "f").unwrap();
        assert_eq!(limit(&limited, "f").unwrap(), Some(0.9375));
        assert_eq!(limited, with_limit(&with_limit(&plain, 2.0, "f").unwrap(), 0.9375, "f").unwrap());
        let [a, b] = [&plain, &limited].map(|bytes| parts(bytes, "f").unwrap().1);
        assert_eq!(a, b);
        assert_eq!(decode(&limited, "f").unwrap().1, signature);
        for bad in [0.0, -1.0] {
            let bytes = with_limit(&plain, bad, "f").unwrap();
            assert!(matches!(decode(&bytes, "f"), Err(LearnedError::Damaged { .. })), "{bad}");
        }
    }
}
