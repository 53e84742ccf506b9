//! Stage `forces`: p(μ*) to forces in the units of the output stream.
//!
//! ```text
//! μ = (X·mu_step) / 2^MU_ROUND                fx = μ1 p,  fy = μ2 p,  fz = p
//! ```
//! Each is a product with a fraction of `mu_fraction` bits (fz with the factor 1.0), shifted right by the fraction and
//! the subarray's exponent together: rounded once, saturated to 32 bits, saturations counted. Where |fz| is below the
//! threshold, all three are zero.
//!
//! Where the scene has a limit r for it ([`pulls`]), the words fz of the whole array are added up, those below zero r times: the frame
//! has the flag `negative-pressure` if the sum is below zero.

use crate::fixed::words::arith::{round_shift, saturate};
use crate::fixed::words::formats::{Formats, FORCE_BITS, MU_ROUND};

/// The μ word of a search position (in mu_max/384): μ with `mu_fraction` fraction bits.
pub fn mu_word(formats: &Formats, position: i32) -> i64 {
    round_shift(i64::from(position) * formats.mu_step, MU_ROUND)
}

/// The force on one taxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Force {
    /// fx, fy, fz in force LSBs.
    pub words: [i32; 3],
    /// How many of the three words saturated.
    pub saturations: u32,
}

/// Whether the forces below zero, `push` times, are more than those above.
pub fn pulls(forces: &[Force], push: u32) -> bool {
    let weighed = |force: &Force| match i64::from(force.words[2]) {
        z if z < 0 => z * i64::from(push),
        z => z,
    };
    forces.iter().map(weighed).sum::<i64>() < 0
}

/// The force of a taxel with p = `value` (in search LSBs), μ words `mu`, right shift `shift`, `threshold` in force
/// LSBs.
pub fn force(formats: &Formats, value: i64, mu: [i64; 2], shift: u32, threshold: i64) -> Force {
    let products = [value * mu[0], value * mu[1], value << formats.mu_fraction];
    let rounded = products.map(|product| saturate(round_shift(product, shift), FORCE_BITS));
    let saturations = rounded.iter().map(|&(_, clipped)| u32::from(clipped)).sum();
    if rounded[2].0.abs() < threshold {
        return Force { words: [0; 3], saturations };
    }
    Force { words: rounded.map(|(word, _)| word as i32), saturations }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Frame;
    use crate::fixed::stages::send::Status;
    use crate::fixed::Model;
    use crate::result::flags::Flag;
    use crate::spec::scene::Scene;

    #[test]
    fn forces_below_zero_are_weighed() {
        let force = |z: i32| Force { words: [7, -7, z], saturations: 0 };
        let all = [100, -20, 3, -1].map(force);
        assert_eq!([1, 4, 5, 15].map(|push| pulls(&all, push)), [false, false, true, true]);
        assert!(!pulls(&[], 1) && !pulls(&[force(5), force(-1)], 5) && pulls(&[force(i32::MIN); 3], 15));
    }

    /// The bit of the status and the figure are one decision: no shipped frame has the flag, each in tension has it, and of those
    /// with a taxel that is stuck or a row that is silent some have.
    #[test]
    fn faulty_taxels_pull() {
        let scene = Scene::builtin("sensor-1").unwrap();
        let model = Model::new(&scene).unwrap();
        let push = f64::from(model.push_limit.unwrap());
        let raised = |frame: &Frame, change: &dyn Fn(usize, f64) -> f64| {
            let stress = frame.stress_MPa.iter().enumerate().map(|(k, b)| change(k, *b)).collect();
            let frame = Frame { stress_MPa: stress, ..frame.clone() };
            let result = model.reconstruct(&frame).unwrap();
            let status = Status::all(&model.run(&model.codes(&frame).unwrap().codes).status).next().unwrap();
            let bit = status.raised.contains(Flag::NegativePressure);
            assert_eq!(bit, result.negative_share().unwrap() * (1.0 + push) > 1.0, "{}", frame.id);
            assert_eq!(bit, result.flags.contains(&Flag::NegativePressure), "{}", frame.id);
            bit
        };
        let (mut faulty, cols) = ([0; 2], scene.sensor.cols);
        for frame in Frame::shipped(&scene) {
            let peak = frame.peak_MPa();
            let most = frame.stress_MPa.iter().position(|b| b.abs() == peak).unwrap();
            assert!(!raised(&frame, &|_, b| b) && raised(&frame, &|_, b| -b), "{}", frame.id);
            faulty[0] += usize::from(raised(&frame, &|k, b| if k == most { -peak } else { b }));
            faulty[1] += usize::from(raised(&frame, &|k, b| if k / cols == most / cols { 0.0 } else { b }));
        }
        assert!(faulty.iter().all(|frames| *frames > 0), "{faulty:?}");
    }
}
