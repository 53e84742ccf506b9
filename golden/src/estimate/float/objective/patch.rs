//! Patch: maximum likelihood of one elliptic contact.
//!
//! Pressure ∝ (1 − r²)^g on the ellipse x = x₀ + L u, |u| ≤ 1, L symmetric; shear in proportion. With equal noise on
//! every taxel the likelihood is largest where the misfit is smallest:
//!
//! ```text
//! Π = −min over x₀, L, g, F of ‖b − K(x₀, L, g) F‖²        F = (Fx, Fy, Fz), μ = (Fx, Fy)/Fz
//! ```
//!
//! x₀, the three entries of L and g are fitted by Levenberg–Marquardt, F is linear. L replaces two radii and an angle,
//! because the angle of a circle is undefined and would stall the fit. g = 0 is the uniform pressure, g = ½ Hertz's.
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: b | n | MPa | finite |
//! | out: μ | 2 | – | |μ| ≤ mu_max |
//! | out: load | scalar | N | above 0 |
//!
//! The fit first uses few nodes, then takes a few steps with many, on wide contacts with still more. Where one contact does not explain the stress but
//! several ellipses do ([`super::multi_ellipse`]), their forces are added up.

use super::disc::Disc;
use super::ellipse::{Ellipse, COARSE_NODES, FINE_NODES, WIDE_NODES};
use super::estimate::{MuEstimate, Objective, SearchInput, WIDE_FROM};
use super::fit::{fit, misfit, misfit_limit, Fit, THOROUGH};
use super::multi_ellipse::{fit_ellipses, start_parameters, EllipseFit, FIT_WIDTHS};
use super::taxels::Taxels;
use crate::estimate::segment::segment;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use nalgebra::DVector;

/// Initial radii in units of the depth.
const START_RADII: [f64; 4] = [0.5, 1.0, 1.7, 2.7];
/// The objective `patch`.
#[derive(Clone, Debug)]
pub struct Patch {
    taxels: Taxels,
    coarse: Disc,
    fine: Disc,
    wide: Disc,
}

impl Patch {
    /// The objective for subarrays of the shape of `sensor` under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium) -> Patch {
        let discs = [COARSE_NODES, FINE_NODES, WIDE_NODES].map(|[rings, angles]| Disc::new(rings, angles));
        let [coarse, fine, wide] = discs;
        Patch { taxels: Taxels::new(sensor, medium), coarse, fine, wide }
    }
}

impl Patch {
    /// The fitted contact, with more nodes if it is wide; the evaluations are those of all stages.
    fn fit(&self, b: &DVector<f64>, input: &SearchInput) -> Option<Fit> {
        let (taxels, centre) = (&self.taxels, input.centre_mm());
        let mut model = Ellipse { taxels, disc: &self.coarse };
        let radii: Vec<f64> =
            START_RADII.iter().map(|radius| radius * taxels.depth).chain(input.wide_radius_mm()).collect();
        let start = |&radius: &f64| {
            let theta = [centre[0], centre[1], radius, radius, 0.0, 0.5];
            misfit(&mut model, b, &theta).map(|misfit| (theta, misfit))
        };
        let starts: Vec<_> = radii.iter().filter_map(start).collect();
        let (theta, _) = starts.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let coarse = fit(&mut model, b, theta, THOROUGH)?;
        let fine = fit(&mut Ellipse { taxels, disc: &self.fine }, b, &coarse.theta, THOROUGH)?;
        let evaluations = radii.len() + coarse.evaluations + fine.evaluations;
        if fine.theta[2].max(fine.theta[3]) <= WIDE_FROM * taxels.depth {
            return Some(Fit { evaluations, ..fine });
        }
        let wide = fit(&mut Ellipse { taxels, disc: &self.wide }, b, &fine.theta, THOROUGH)?;
        Some(Fit { evaluations: evaluations + wide.evaluations, ..wide })
    }
}

impl Objective for Patch {
    /// `None`: a patch is compared with the stress, not scored by forces on taxels.
    fn score(&self, _p: &[f64]) -> Option<f64> {
        None
    }

    fn find(&self, input: &SearchInput) -> Option<MuEstimate> {
        let b = DVector::from_column_slice(input.b);
        let fit = self.fit(&b, input)?;
        let one = |evaluations: usize| {
            let force = [fit.loads[0], fit.loads[1], fit.loads[2]];
            MuEstimate::of_force(force, input.mu_max, -fit.misfit, evaluations)
        };
        let limit = misfit_limit(input.b, input.noise_MPa);
        if fit.misfit <= limit {
            return one(fit.evaluations);
        }
        let p = input.family.v(0, 0);
        let drawn = FIT_WIDTHS.map(|width| segment(input.sensor, p, width));
        let starts: Vec<Vec<f64>> = drawn
            .iter()
            .filter(|drawn| drawn.count > 1)
            .map(|drawn| start_parameters(input.sensor, p, drawn))
            .collect();
        let several = fit_ellipses(&self.taxels, input.b, &starts, limit);
        let evaluations = fit.evaluations + several.as_ref().map_or(0, |several| several.evaluations);
        match several.filter(EllipseFit::explains_stress) {
            Some(several) => MuEstimate::of_force(several.force_N(), input.mu_max, -several.misfit, evaluations),
            None => one(evaluations),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::generator::slip::Slip;
    use crate::data::generator::{generate, random_contacts, Draw, Shapes};
    use crate::estimate::float::pass::Polynomial;
    use crate::physics::matrices::Matrices;
    use crate::spec::scene::Scene;
    use crate::spec::scene::MAX_FLOAT_DEGREE;

    #[test]
    fn several_ellipses_add_up_on_any_body() {
        let mut scene = Scene::builtin("sensor-3").unwrap();
        let sensor = scene.sensor.clone();
        let draw = Draw { count: 2, shapes: Shapes::Elliptic, slip: Slip::Full, touching: false, seed: 3 };
        let contacts = random_contacts(&sensor, draw);
        for medium in [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.48 }] {
            let frame = generate("two", &sensor, medium, &contacts).unwrap();
            scene.medium = medium;
            let matrices = Matrices::of(&scene, &sensor, MAX_FLOAT_DEGREE).unwrap();
            let (b, mu_max) = (frame.stress_MPa.as_slice(), scene.search.mu_max);
            let family = Polynomial::new(&matrices, b);
            let input = SearchInput { sensor: &sensor, b, family: &family, mu_max, noise_MPa: 0.0 };
            let found = Patch::new(&sensor, medium).find(&input).unwrap();
            let [tx, ty, load] = frame.resultant_N.unwrap();
            let off = (found.found.mu[0] - tx / load).hypot(found.found.mu[1] - ty / load);
            // The quadrature of the fit is accurate to 1e-4 of the peak.
            assert!(off < 0.005 && (found.load_N.unwrap() / load - 1.0).abs() < 0.005, "{medium}: {found:?}");
            assert!(-found.found.objective <= misfit_limit(b, 0.0));
        }
    }
}
