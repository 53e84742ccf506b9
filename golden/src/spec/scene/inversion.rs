//! The rule of a scene's pseudo-inverse; without a level of its own it follows from the number format and the noise.

use super::inverse::{InverseKind, InverseSpec, Inversion};
use super::Scene;
use crate::spec::scene::largest_code;

/// Rounding of the coefficients is kept below 2^−`COEFFICIENTS_SHARE` of the forces.
const COEFFICIENTS_SHARE: i32 = 7;

impl Scene {
    /// The rule of the scene's pseudo-inverse, with its level.
    pub fn inversion(&self) -> Inversion {
        let InverseSpec { kind, level } = self.inverse;
        match kind {
            InverseKind::Exact => Inversion::EXACT,
            kind => Inversion { kind, level: level.unwrap_or_else(|| self.floor()) },
        }
    }

    /// The level if the scene has none: the largest of the floors of input, noise and coefficients.
    fn floor(&self) -> f64 {
        let input = 1.0 / (f64::from(largest_code(self.fixed.input_bits)) * 12f64.sqrt());
        let noise = self.input.full_scale_MPa.map_or(0.0, |full_scale| self.search.noise_floor_MPa() / full_scale);
        let coefficients = 2f64.powi(COEFFICIENTS_SHARE - self.fixed.inverse_bits as i32);
        // Noise beyond full scale would truncate everything; the largest singular value is always kept.
        (self.input.noise_share() * input.max(noise)).max(coefficients).min(0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_follows_format_and_noise() {
        let mut scene = Scene::builtin("sensor-1").unwrap();
        let near = |scene: &Scene, wanted: f64| (scene.inversion().level / wanted - 1.0).abs() < 1e-12;
        assert!(near(&scene, 2f64.powi(-17)));
        scene.fixed.inverse_bits = 32;
        let lsb = 1.0 / 524_287.0;
        assert!(near(&scene, lsb / 12f64.sqrt()));
        scene.search.noise_floor_MPa = Some(1e-3);
        assert!(near(&scene, lsb / 12f64.sqrt()), "a noise in MPa says nothing without full scale");
        scene.input.full_scale_MPa = Some(0.1);
        assert!(near(&scene, 0.01));
        scene.input.average = 4;
        assert!(near(&scene, 0.0025));
        scene.search.noise_floor_MPa = Some(1.0);
        assert!(near(&scene, 0.5), "noise beyond full scale");
        scene.inverse.level = Some(0.3);
        assert!(near(&scene, 0.3));
        scene.inverse.kind = InverseKind::Exact;
        assert_eq!(scene.inversion(), Inversion::EXACT);
    }
}
