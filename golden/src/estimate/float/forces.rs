//! Force: from p and μ to one force vector per taxel, without those too small to report.
//!
//! fx = μ1 p, fy = μ2 p, fz = p; where |fz| < min_force all three are zero. A subarray whose |fz| are all below
//! min_force, or zero, has no contact.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: p, μ, min_force | n, 2, scalar | N, –, N |
//! | out: fx, fy, fz | n each | N |
//!
//! Fed by `pass` and `search`; its forces are scattered into the array's by `reconstruct`.

use crate::data::frame::Forces;
use crate::physics::matrices::Matrices;
use crate::physics::symmetry::folded::accumulate;

/// Forces in N of one subarray, row-major in it, from normal forces `p` in N and `mu`; those with |fz| < `min_force_N`
/// are zero.
pub fn force(p: &[f64], mu: [f64; 2], min_force_N: f64) -> Forces {
    let along = |mu: f64| p.iter().map(|p| mu * p).collect();
    threshold(Forces { fx: along(mu[0]), fy: along(mu[1]), fz: p.to_vec() }, min_force_N)
}

/// Sets the forces on taxels with |fz| < `min_force_N` to zero.
pub fn threshold(mut forces: Forces, min_force_N: f64) -> Forces {
    for k in 0..forces.fz.len() {
        if forces.fz[k].abs() < min_force_N {
            (forces.fx[k], forces.fy[k], forces.fz[k]) = (0.0, 0.0, 0.0);
        }
    }
    forces
}

/// What forces leave of the stress `b` in MPa: b − Cx fx − Cy fy − Cz fz.
pub fn residual(matrices: &Matrices, b: &[f64], forces: &Forces) -> Vec<f64> {
    let mut rest = b.to_vec();
    for (c, f) in [(&matrices.cx, &forces.fx), (&matrices.cy, &forces.fy), (&matrices.cz, &forces.fz)] {
        accumulate(c, f, -1.0, &mut rest);
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand_with_threshold() {
        let forces = force(&[1.0, -0.5, 0.25, -0.2], [0.5, -1.0], 0.25);
        assert_eq!(forces.fz, [1.0, -0.5, 0.25, 0.0]);
        assert_eq!(forces.fx, [0.5, -0.25, 0.125, 0.0]);
        assert_eq!(forces.fy, [-1.0, 0.5, -0.25, 0.0]);
    }

    #[test]
    fn a_weak_contact_is_none() {
        assert_eq!(force(&[0.1, -0.2], [0.3, 0.3], 0.5), Forces::zeros(2));
    }

    #[test]
    fn without_threshold_everything_stays() {
        let forces = force(&[1e-300, 0.0], [0.0, 0.0], 0.0);
        assert_eq!(forces.fz, [1e-300, 0.0]);
    }
}
