//! Template: what changed forces of contacts that stay in place would change of the readings.
//!
//! While a contact holds, its pressure keeps its shape q, Σ q = 1 over its cells, and only three numbers change: normal force and
//! shear. With q from an estimate on many frames, they follow from a difference d of two means by least squares:
//!
//! ```text
//! d = Σ over contacts of  ΔN Cz q + ΔFx Cx q + ΔFy Cy q  + noise
//! ```
//! What the fit leaves shows a contact that moves: over 1 mm on sensor-1 the change of the readings is that of a shear up to a fifth
//! of its size.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: forces of an estimate, its contacts | 3 × taxels, – | N, mm |
//! | in: d, taxels that count | taxels each | MPa, – |
//! | out: change of the force of each contact, its variance over that of d | 3 each | N, N²/MPa² |
//! | out: Σ of squares that the fit explains and leaves | scalars | MPa² |

use crate::physics::influence::table;
use crate::result::reconstruct::Reconstruction;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::{Col, Mat, Side};

/// The influence of an array's cells on its taxels, by their distance.
pub(super) struct Influences {
    sensor: Sensor,
    /// MPa per N along x, y and z, for each distance in rows and columns.
    table: Vec<[f64; 3]>,
}

/// The readings of changed forces of the contacts of a result.
pub(super) struct Template {
    /// Share of each taxel in the normal force of each contact.
    pub shares: Vec<Vec<f64>>,
    /// Stress in MPa per N along x, y and z of each contact, as columns; 0 on taxels that do not count.
    columns: Vec<Vec<f64>>,
    factor: Llt<f64>,
    /// Variance of each number of the fit over that of a reading.
    variances: Vec<f64>,
}

/// A fit of changed forces.
pub(super) struct Fit {
    /// ΔFx, ΔFy, ΔN of each contact in N.
    pub changes_N: Vec<[f64; 3]>,
    /// Σ of the squares of what it explains, and of what it leaves, in MPa².
    pub explained: f64,
    pub left: f64,
}

impl Influences {
    /// Those of an array on a medium.
    pub(super) fn new(sensor: &Sensor, medium: Medium) -> Influences {
        Influences { sensor: sensor.clone(), table: table(sensor, medium) }
    }

    /// The stress in MPa of forces of 1 N along x, y and z, spread over the cells by `shares`.
    fn columns(&self, shares: &[f64], counts: &[bool]) -> [Vec<f64>; 3] {
        let cols = self.sensor.cols;
        let mut columns = [(); 3].map(|()| vec![0.0; shares.len()]);
        for (cell, share) in shares.iter().enumerate().filter(|(_, share)| **share != 0.0) {
            let (s, d) = (cell / cols, cell % cols);
            for taxel in (0..shares.len()).filter(|taxel| counts[*taxel]) {
                let (r, c) = (taxel / cols, taxel % cols);
                let [x, y, z] = self.table[r.abs_diff(s) * cols + c.abs_diff(d)];
                // Odd along its own axis.
                columns[0][taxel] += share * if c < d { -x } else { x };
                columns[1][taxel] += share * if r < s { -y } else { y };
                columns[2][taxel] += share * z;
            }
        }
        columns
    }
}

impl Template {
    /// That of contacts with these `shares`; `counts` says which taxels do. `None` where the readings do not tell the forces apart.
    pub(super) fn new(influences: &Influences, shares: Vec<Vec<f64>>, counts: &[bool]) -> Option<Template> {
        let columns: Vec<Vec<f64>> = shares.iter().flat_map(|own| influences.columns(own, counts)).collect();
        let n = columns.len();
        let normal = Mat::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]));
        let factor = normal.llt(Side::Lower).ok()?;
        let inverse = factor.inverse();
        let variances: Vec<f64> = (0..n).map(|k| inverse[(k, k)]).collect();
        variances.iter().all(|variance| variance.is_finite()).then_some(Template { shares, columns, factor, variances })
    }

    /// Number of fitted numbers.
    pub(super) fn unknowns(&self) -> usize {
        self.columns.len()
    }

    /// Variance of the change of each contact's force, [x, y, normal], over that of `d`, in N²/MPa².
    pub(super) fn variances(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.variances.chunks_exact(3).map(|own| [own[0], own[1], own[2]])
    }

    /// The changes that explain the difference `d`, which is 0 on taxels that do not count.
    pub(super) fn fit(&self, d: &[f64]) -> Fit {
        let projected = Col::from_fn(self.columns.len(), |k| dot(&self.columns[k], d));
        let found = self.factor.solve(&projected);
        // Of a least-squares fit xᵀ Gᵀ d.
        let explained = found.transpose() * &projected;
        let changes_N = (0..self.shares.len()).map(|k| [0, 1, 2].map(|axis| found[3 * k + axis])).collect();
        Fit { changes_N, explained, left: (dot(d, d) - explained).max(0.0) }
    }
}

/// Share of each taxel in the normal force of each contact; `None` where none presses. Taxels belong to the nearest contact.
pub(super) fn shares(sensor: &Sensor, result: &Reconstruction) -> Option<Vec<Vec<f64>>> {
    let pressed: Vec<f64> = result.forces_N.fz.iter().map(|fz| fz.max(0.0)).collect();
    let contacts = result.contacts().unwrap_or_default();
    let centres: Option<Vec<[f64; 2]>> = contacts.iter().map(|contact| contact.centre_mm).collect();
    let centres = centres.filter(|centres| !centres.is_empty()).unwrap_or_else(|| vec![[0.0; 2]]);
    let mut shares = vec![vec![0.0; pressed.len()]; centres.len()];
    for (taxel, force_N) in pressed.into_iter().enumerate() {
        let [x, y] = sensor.position_mm(taxel / sensor.cols, taxel % sensor.cols);
        let away = |[u, v]: [f64; 2]| (x - u).hypot(y - v);
        let nearest = (0..centres.len()).min_by(|a, b| away(centres[*a]).total_cmp(&away(centres[*b])))?;
        shares[nearest][taxel] = force_N;
    }
    for own in &mut shares {
        let total: f64 = own.iter().sum();
        if total <= 0.0 {
            return None;
        }
        own.iter_mut().for_each(|share| *share /= total);
    }
    (!shares[0].is_empty()).then_some(shares)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}
