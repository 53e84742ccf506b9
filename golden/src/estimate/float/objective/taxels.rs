//! Taxels: their positions, and the stress there of point forces on the elastic body.
//!
//! With d from force to taxel, on a half-space and on a bonded layer of thickness h ([`crate::physics::bonded::kernel`]):
//!
//! ```text
//! b = 3 h² (Fx dx + Fy dy + Fz h)/(2π ρ⁵),  ρ² = |d|² + h²        b h² = Fz gn(r) + (F·d/h) gs(r),  r = |d|/h
//! ```
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: position, force | 2, 3 | mm, N |
//! | out: b and its derivatives by the position | 3 × n | MPa, MPa/mm |

use super::radial::Radial;
use crate::physics::bonded::kernel::Kernel;
use crate::spec::scene::Medium;
use crate::spec::sensor::Sensor;
use std::f64::consts::TAU;

/// Positions of the taxels, and the medium above them.
#[derive(Clone, Debug)]
pub struct Taxels {
    /// x of each taxel in mm from the array's centre, row-major.
    pub x: Vec<f64>,
    /// y of each taxel in mm from the array's centre, row-major.
    pub y: Vec<f64>,
    /// Depth of the taxels under the surface in mm.
    pub depth: f64,
    /// Kernels of a bonded layer; `None` for a half-space.
    layer: Option<Radial>,
}

impl Taxels {
    /// The taxels of `sensor` under `medium`.
    pub fn new(sensor: &Sensor, medium: Medium) -> Taxels {
        let place = |index: usize| sensor.position_mm(index / sensor.cols, index % sensor.cols);
        let (x, y) = (0..sensor.taxels()).map(place).map(|[x, y]| (x, y)).unzip();
        let layer = match medium {
            Medium::HalfSpace => None,
            Medium::BondedLayer { poisson } => Some(Radial::new(&Kernel::new(poisson))),
        };
        Taxels { x, y, depth: sensor.thickness_mm, layer }
    }

    /// Number of taxels.
    pub fn count(&self) -> usize {
        self.x.len()
    }

    /// Adds the stress in MPa of forces of 1 N along x, y and z at `place` (mm), times `weight`, to three columns.
    pub fn add_unit_forces(&self, place: [f64; 2], weight: f64, columns: &mut [Vec<f64>; 3]) {
        let h = self.depth;
        let [cx, cy, cz] = columns;
        let taxels = self.x.iter().zip(&self.y).zip(cx).zip(cy).zip(cz);
        match &self.layer {
            None => {
                let scale = weight * 3.0 * h * h / TAU;
                for ((((x, y), cx), cy), cz) in taxels {
                    let (dx, dy) = (x - place[0], y - place[1]);
                    let inverse = 1.0 / (dx * dx + dy * dy + h * h);
                    let s = scale * inverse * inverse * inverse.sqrt();
                    *cx += s * dx;
                    *cy += s * dy;
                    *cz += s * h;
                }
            }
            Some(layer) => {
                let scale = weight / (h * h);
                for ((((x, y), cx), cy), cz) in taxels {
                    let (u, v) = ((x - place[0]) / h, (y - place[1]) / h);
                    let [normal, shear] = layer.at((u * u + v * v).sqrt());
                    *cx += scale * shear * u;
                    *cy += scale * shear * v;
                    *cz += scale * normal;
                }
            }
        }
    }

    /// Writes the stress of `force` (x, y, z in N) at `place` (mm) and its derivatives by x and y of the position to
    /// three vectors.
    pub fn field(&self, place: [f64; 2], force: [f64; 3], out: &mut [Vec<f64>; 3]) {
        let h = self.depth;
        let [value, along_x, along_y] = out;
        let taxels = self.x.iter().zip(&self.y).zip(value).zip(along_x).zip(along_y);
        match &self.layer {
            None => {
                let [fx, fy, fz] = force.map(|f| f * 3.0 * h * h / TAU);
                for ((((x, y), value), along_x), along_y) in taxels {
                    let (dx, dy) = (x - place[0], y - place[1]);
                    let inverse = 1.0 / (dx * dx + dy * dy + h * h);
                    let s = inverse * inverse * inverse.sqrt();
                    let load = s * (fx * dx + fy * dy + fz * h);
                    let steep = 5.0 * load * inverse;
                    *value = load;
                    *along_x = steep * dx - s * fx;
                    *along_y = steep * dy - s * fy;
                }
            }
            Some(layer) => {
                let [fx, fy, fz] = force.map(|f| f / (h * h));
                for ((((x, y), value), along_x), along_y) in taxels {
                    let (u, v) = ((x - place[0]) / h, (y - place[1]) / h);
                    let r = (u * u + v * v).sqrt();
                    let ([normal, shear], [normal_slope, shear_slope]) = layer.with_slopes(r);
                    let along = fx * u + fy * v;
                    // At r = 0 the slopes are zero: both kernels are even.
                    let steep = (fz * normal_slope + along * shear_slope) / r.max(f64::MIN_POSITIVE);
                    *value = fz * normal + along * shear;
                    *along_x = -(steep * u + fx * shear) / h;
                    *along_y = -(steep * v + fy * shear) / h;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_agree_with_columns_and_their_differences() {
        fields_agree(Medium::HalfSpace);
        fields_agree(Medium::BondedLayer { poisson: 0.4 });
    }

    fn fields_agree(medium: Medium) {
        let sensor = Sensor { rows: 2, cols: 3, pitch_x_mm: 2.0, pitch_y_mm: 4.0, thickness_mm: 3.0 };
        let taxels = Taxels::new(&sensor, medium);
        let empty = || [vec![0.0; 6], vec![0.0; 6], vec![0.0; 6]];
        let force = [0.3, -0.7, 2.0];
        let at = |place: [f64; 2]| {
            let mut columns = empty();
            taxels.add_unit_forces(place, 1.0, &mut columns);
            (0..6).map(|i| (0..3).map(|k| force[k] * columns[k][i]).sum::<f64>()).collect::<Vec<_>>()
        };
        let (x, y, d) = (0.4, -1.1, 1e-5);
        let mut field = empty();
        taxels.field([x, y], force, &mut field);
        let [value, along_x, along_y] = field;
        let ([right, left], [up, down]) = ([at([x + d, y]), at([x - d, y])], [at([x, y + d]), at([x, y - d])]);
        for (i, at) in at([x, y]).into_iter().enumerate() {
            assert!((value[i] - at).abs() < 1e-15);
            assert!((along_x[i] - (right[i] - left[i]) / (2.0 * d)).abs() < 1e-7);
            assert!((along_y[i] - (up[i] - down[i]) / (2.0 * d)).abs() < 1e-7);
        }
    }
}
