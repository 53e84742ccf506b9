//! Bonded: transfer functions of an elastic layer of thickness h on a rigid base.
//!
//! With q = k h and Poisson ratio ν, the stress at the base as a function of pressure and of the shear along the wave,
//! b^ = Hn p^ − i Ht t^:
//!
//! ```text
//! Hn = 2(1−ν) [2(1−ν) cosh q + q sinh q] / Δ        Δ = q² + 4(1−ν)² + (3−4ν) sinh² q
//! Ht = 2(1−ν) [(1−2ν) sinh q + q cosh q] / Δ
//! ```
//!
//! Plane strain, u = 0 at the base. Numerator and denominator are multiplied by exp(−2q) to avoid overflow.
//!
//! | | shape | unit | range |
//! |---|---|---|---|
//! | in: q, ν | scalars | – | q at least 0, ν from 0 to below 0.5 |
//! | out: Hn, Ht | scalars | – | Hn 1 … 0, Ht 0 … 0.5 |
//!
//! [`kernel`] derives the stress under a point force from them, [`cell`] that under a loaded cell.

pub mod cell;
pub mod kernel;

/// Hn and Ht at `q` ≥ 0 for a Poisson ratio of 0 to below 0.5.
pub fn transfer(q: f64, poisson: f64) -> [f64; 2] {
    let wide = 2.0 * (1.0 - poisson);
    let decay = (-q).exp();
    let square = decay * decay;
    // cosh q and sinh q times exp(−q)
    let (cosh, sinh) = ((1.0 + square) / 2.0, -(-2.0 * q).exp_m1() / 2.0);
    let delta = (q * q + wide * wide) * square + (3.0 - 4.0 * poisson) * sinh * sinh;
    let scale = wide * decay / delta;
    [scale * (wide * cosh + q * sinh), scale * ((1.0 - 2.0 * poisson) * sinh + q * cosh)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        // (q, [ν 0.40: Hn, Ht; ν 0.48: Hn, Ht]), printed with six digits.
        let known = [
            (0.25, [[0.980639, 0.232468], [0.973815, 0.229738]]),
            (0.5, [[0.935407, 0.387236], [0.917375, 0.374212]]),
            (1.0, [[0.830513, 0.487876], [0.809139, 0.462806]]),
            (2.0, [[0.591975, 0.414982], [0.602086, 0.413533]]),
            (3.0, [[0.334977, 0.256046], [0.355750, 0.268662]]),
            (5.0, [[0.071374, 0.059867], [0.078042, 0.065126]]),
        ];
        for (q, rows) in known {
            for (poisson, wanted) in [0.40, 0.48].into_iter().zip(rows) {
                let got = transfer(q, poisson);
                assert!((0..2).all(|k| (got[k] - wanted[k]).abs() < 0.51e-6), "{q} {poisson}: {got:?}");
            }
        }
    }

    #[test]
    fn limits() {
        for poisson in [0.0, 0.3, 0.48, 0.499_999] {
            // Small q: total force and moment. Ht = q + O(q³).
            let [n, t] = transfer(1e-4, poisson);
            assert!((n - 1.0).abs() < 1e-7 && (t / 1e-4 - 1.0).abs() < 1e-7);
            // Large q: the half-space's decay, raised by c.
            let c = 4.0 * (1.0 - poisson) / (3.0 - 4.0 * poisson);
            let [n, t] = transfer(40.0, poisson);
            let decay = c * (-40f64).exp();
            assert!((n / (decay * (42.0 - 2.0 * poisson)) - 1.0).abs() < 1e-12);
            assert!((t / (decay * (41.0 - 2.0 * poisson)) - 1.0).abs() < 1e-12);
            assert!(transfer(1e4, poisson).iter().all(|h| *h == 0.0));
        }
    }

    #[test]
    fn the_incompressible_layer_has_a_simpler_form() {
        for q in [0.1f64, 0.7, 2.5, 9.0] {
            let below = q * q + q.cosh() * q.cosh();
            let [n, t] = transfer(q, 0.5);
            assert!((n * below / (q.cosh() + q * q.sinh()) - 1.0).abs() < 1e-14);
            assert!((t * below / (q * q.cosh()) - 1.0).abs() < 1e-14);
        }
    }
}
