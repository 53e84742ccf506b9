//! Forward model: the normal stress that forces on the surface cause at every taxel.
//!
//! Forces per cell, as results have them, are spread evenly over the cell of their taxel; forces at points act at any place
//! of the surface, also beside the array:
//!
//! ```text
//! cells:   b(r, c) = Σ over s, d  cz(r−s, c−d) fz(s, d) + cx(r−s, c−d) fx(s, d) + cy(r−s, c−d) fy(s, d)
//! points:  b(r, c) = Σ over k  kernel(position of r, c − position of k) · f(k)
//! ```
//!
//! The influence depends on the distance alone, so 3 (2·rows − 1) (2·cols − 1) numbers take the place of three matrices of
//! taxels², and a cell without force costs nothing. Frames are computed on all cores. It is the stress in the cover: what a sensor
//! makes of it, [`crate::data::generator::converter`] adds.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: forces of cells | frames × taxels × 3 | N: x, y, normal, on the body |
//! | in: forces at points | a list for each frame | mm from the array's centre; N |
//! | out: b | frames × taxels | MPa, compression positive |

use super::body::Body;
use super::influence::{at_distance, table};
use crate::spec::scene::{Medium, Scene};
use crate::spec::sensor::Sensor;
use rayon::prelude::*;
use thiserror::Error;

/// Components of a force: x, y, normal.
pub const AXES: usize = 3;

/// A force on one point of the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointForce {
    /// Where it acts, in mm from the array's centre, [x, y].
    pub at_mm: [f64; 2],
    /// The force in N, [x, y, normal].
    pub force_N: [f64; AXES],
}

/// Forces from which no stress follows.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ForwardError {
    /// The forces are no whole frames.
    #[error("forces_N has {found} values, wanted a multiple of {rows} · {cols} · {AXES}")]
    Count {
        /// Values found.
        found: usize,
        /// Rows of the array.
        rows: usize,
        /// Columns of the array.
        cols: usize,
    },
    /// A value is not finite.
    #[error("{field}[{index}] of frame {frame} = {value} is not a finite number")]
    NotFinite {
        /// "forces_N" or "at_mm".
        field: &'static str,
        /// The frame, from 0.
        frame: usize,
        /// Where in the frame, from 0: row, column, component, or point, component.
        index: String,
        /// The value found.
        value: f64,
    },
    /// The forces are so large that their stress has no number.
    #[error("the stress on taxel {row},{col} in frame {frame} is not a finite number")]
    Overflow {
        /// The frame, from 0.
        frame: usize,
        /// The taxel's row.
        row: usize,
        /// The taxel's column.
        col: usize,
    },
}

/// The stress of surface forces on one array through one medium.
pub struct ForwardModel {
    sensor: Sensor,
    body: Body,
    /// cx, cy, cz for each distance taxel − cell: rows from −(rows − 1) to rows − 1, columns alike.
    influence: [Vec<f64>; AXES],
}

impl ForwardModel {
    /// The model of a scene's array and medium.
    pub fn of_scene(scene: &Scene) -> ForwardModel {
        ForwardModel::new(&scene.sensor, scene.medium)
    }

    /// The model of an array, whose sizes are in range, on a medium.
    pub fn new(sensor: &Sensor, medium: Medium) -> ForwardModel {
        let table = table(sensor, medium);
        let [down, right] = [sensor.rows, sensor.cols].map(|count| count as isize - 1);
        let influence = std::array::from_fn(|axis| {
            let of_row = |row| (-right..=right).map(move |col| [row, col]);
            let distances = (-down..=down).flat_map(of_row);
            distances.map(|distance| at_distance(&table, sensor.cols, distance)[axis]).collect()
        });
        ForwardModel { sensor: sensor.clone(), body: Body::new(medium, sensor.thickness_mm), influence }
    }

    /// Stress in MPa on each taxel, frames × taxels row-major, of forces in N on each cell, frames × taxels × 3 row-major.
    ///
    /// ```
    /// use dermis_golden::{physics::forward::ForwardModel, spec::scene::Scene};
    ///
    /// let model = ForwardModel::of_scene(&Scene::builtin("eight-by-eight")?);
    /// // 1 N along x on the cell of row 3, column 4: the taxel ahead of it is compressed, the one behind it pulled.
    /// let mut forces_N = vec![0.0; 8 * 8 * 3];
    /// forces_N[(3 * 8 + 4) * 3] = 1.0;
    /// let stress_MPa = model.of_cells(&forces_N)?;
    /// assert!(stress_MPa[3 * 8 + 5] > 0.0 && stress_MPa[3 * 8 + 3] == -stress_MPa[3 * 8 + 5]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ForwardError`]: no whole frames, a force or a stress that is not finite.
    pub fn of_cells(&self, forces_N: &[f64]) -> Result<Vec<f64>, ForwardError> {
        let Sensor { rows, cols, .. } = self.sensor;
        let taxels = self.sensor.taxels();
        if !forces_N.len().is_multiple_of(AXES * taxels) {
            return Err(ForwardError::Count { found: forces_N.len(), rows, cols });
        }
        let place = |value: usize| format!("{}, {}, {}", value / AXES / cols, value / AXES % cols, value % AXES);
        let mut stress_MPa = vec![0.0; forces_N.len() / AXES];
        let frames = forces_N.par_chunks(AXES * taxels).zip(stress_MPa.par_chunks_mut(taxels)).enumerate();
        frames.try_for_each(|(frame, (forces_N, stress_MPa))| {
            finite("forces_N", frame, forces_N, place)?;
            for (cell, force_N) in forces_N.chunks_exact(AXES).enumerate().filter(|(_, force)| **force != [0.0; AXES]) {
                self.add_cell([cell / cols, cell % cols], force_N, stress_MPa);
            }
            self.check_stress(frame, stress_MPa)
        })?;
        Ok(stress_MPa)
    }

    /// Adds the stress of a force on one cell.
    fn add_cell(&self, [row, col]: [usize; 2], force_N: &[f64], stress_MPa: &mut [f64]) {
        let Sensor { rows, cols, .. } = self.sensor;
        for (to, stress_MPa) in stress_MPa.chunks_exact_mut(cols).enumerate() {
            // Of the distances from −(cols − 1) on, those from this cell to column 0 and after.
            let first = (rows - 1 + to - row) * (2 * cols - 1) + cols - 1 - col;
            let [x, y, z] = self.influence.each_ref().map(|own| &own[first..first + cols]);
            for (((stress, x), y), z) in stress_MPa.iter_mut().zip(x).zip(y).zip(z) {
                *stress += force_N[0] * x + force_N[1] * y + force_N[2] * z;
            }
        }
    }

    /// Stress in MPa on each taxel, frames × taxels row-major, of the forces at points in each frame; none cause none.
    ///
    /// # Errors
    /// [`ForwardError`]: a place, a force or a stress that is not finite.
    pub fn of_points(&self, frames: &[Vec<PointForce>]) -> Result<Vec<f64>, ForwardError> {
        let (cols, taxels) = (self.sensor.cols, self.sensor.taxels());
        let mut stress_MPa = vec![0.0; frames.len() * taxels];
        let all = frames.par_iter().zip(stress_MPa.par_chunks_mut(taxels)).enumerate();
        all.try_for_each(|(frame, (forces, stress_MPa))| {
            for (point, PointForce { at_mm, force_N }) in forces.iter().enumerate() {
                finite("at_mm", frame, at_mm, |axis| format!("{point}, {axis}"))?;
                finite("forces_N", frame, force_N, |axis| format!("{point}, {axis}"))?;
                for (index, stress) in stress_MPa.iter_mut().enumerate() {
                    let [x, y] = self.sensor.position_mm(index / cols, index % cols);
                    *stress += self.body.point_MPa([x - at_mm[0], y - at_mm[1]], *force_N);
                }
            }
            self.check_stress(frame, stress_MPa)
        })?;
        Ok(stress_MPa)
    }

    /// Refuses stress that is not finite.
    fn check_stress(&self, frame: usize, stress_MPa: &[f64]) -> Result<(), ForwardError> {
        let cols = self.sensor.cols;
        match stress_MPa.iter().position(|stress| !stress.is_finite()) {
            Some(index) => Err(ForwardError::Overflow { frame, row: index / cols, col: index % cols }),
            None => Ok(()),
        }
    }
}

/// Refuses values that are not finite; `place` names the place of one.
fn finite(
    field: &'static str,
    frame: usize,
    values: &[f64],
    place: impl Fn(usize) -> String,
) -> Result<(), ForwardError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(ForwardError::NotFinite { field, frame, index: place(index), value: values[index] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::frame::Contact;
    use crate::data::generator::generate;
    use crate::physics::gauss::rule;
    use crate::physics::influence::Influence;
    use crate::random::Random;

    /// Rounding of sums of some hundred terms, relative to the largest stress.
    const ROUNDING: f64 = 1e-13;

    fn sensor(rows: usize, cols: usize) -> Sensor {
        Sensor { rows, cols, pitch_x_mm: 2.0, pitch_y_mm: 3.0, thickness_mm: 2.5 }
    }

    fn media() -> [Medium; 2] {
        [Medium::HalfSpace, Medium::BondedLayer { poisson: 0.48 }]
    }

    fn drawn(count: usize, seed: u64) -> Vec<f64> {
        let mut random = Random::new(seed);
        (0..count).map(|_| random.normal()).collect()
    }

    /// The largest difference, relative to the largest value.
    fn apart(found: &[f64], wanted: &[f64]) -> f64 {
        assert_eq!(found.len(), wanted.len());
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, own| most.max(own.abs()));
        let peak = largest(&mut wanted.iter().copied());
        largest(&mut found.iter().zip(wanted).map(|(found, wanted)| found - wanted)) / peak
    }

    #[test]
    fn stress_is_that_of_the_matrices() {
        for medium in media() {
            let sensor = sensor(5, 7);
            let (n, frames) = (sensor.taxels(), 3);
            let mut forces_N = drawn(frames * AXES * n, 3);
            // A frame with a single loaded cell.
            forces_N[AXES * n + AXES..2 * AXES * n].fill(0.0);
            let Influence { cx, cy, cz } = Influence::through(&sensor, medium);
            let mut wanted = vec![0.0; frames * n];
            for (k, wanted) in wanted.iter_mut().enumerate() {
                let (frame, taxel) = (k / n, k % n);
                let of_cell = |cell: usize| {
                    let force_N = &forces_N[AXES * (frame * n + cell)..];
                    cx[(taxel, cell)] * force_N[0] + cy[(taxel, cell)] * force_N[1] + cz[(taxel, cell)] * force_N[2]
                };
                *wanted = (0..n).map(of_cell).sum();
            }
            let model = ForwardModel::new(&sensor, medium);
            let found = model.of_cells(&forces_N).unwrap();
            assert!(apart(&found, &wanted) < ROUNDING, "{medium:?}");
            // Each frame alone gives the same, to the bit.
            for frame in 0..frames {
                let own = model.of_cells(&forces_N[AXES * n * frame..AXES * n * (frame + 1)]).unwrap();
                assert_eq!(own, found[n * frame..n * (frame + 1)]);
            }
        }
    }

    /// The generator integrates the point kernel over a rectangle, and knows no influence of cells.
    #[test]
    fn a_loaded_cell_is_a_rectangle_of_its_size() {
        for medium in media() {
            let sensor = sensor(5, 7);
            let [row, col] = [1, 4];
            let contact = Contact {
                shape: Some("rectangle".to_owned()),
                centre_mm: Some(sensor.position_mm(row, col)),
                size_mm: vec![sensor.pitch_x_mm, sensor.pitch_y_mm],
                normal_N: Some(4.0),
                tangential_N: Some([1.5, -0.5]),
                ..Contact::default()
            };
            let wanted = generate("cell", &sensor, medium, &[contact]).unwrap().stress_MPa;
            let mut forces_N = vec![0.0; AXES * sensor.taxels()];
            forces_N[AXES * (row * sensor.cols + col)..][..AXES].copy_from_slice(&[1.5, -0.5, 4.0]);
            let model = ForwardModel::new(&sensor, medium);
            let off = apart(&model.of_cells(&forces_N).unwrap(), &wanted);
            // The generator's quadrature is accurate to 3e-13 of the largest integrand on each of its patches.
            assert!(off < 1e-11, "{medium:?}: {off:e}");
            // Shear of the other sign is another stress.
            forces_N[AXES * (row * sensor.cols + col)] = -1.5;
            assert!(apart(&model.of_cells(&forces_N).unwrap(), &wanted) > 0.05, "{medium:?}");
        }
    }

    /// Points at the nodes of a quadrature stand for an even pressure.
    #[test]
    fn points_all_over_a_cell_are_the_cell() {
        for medium in media() {
            let sensor = sensor(4, 6);
            let [x, y] = sensor.position_mm(2, 1);
            let nodes = rule(16).iter().flat_map(|v| rule(16).iter().map(move |u| (u, v)));
            let points = nodes.map(|(u, v)| PointForce {
                at_mm: [x + u.0 * sensor.pitch_x_mm / 2.0, y + v.0 * sensor.pitch_y_mm / 2.0],
                force_N: [0.7, -0.2, 2.0].map(|force: f64| force * u.1 * v.1 / 4.0),
            });
            let mut forces_N = vec![0.0; AXES * sensor.taxels()];
            forces_N[AXES * (2 * sensor.cols + 1)..][..AXES].copy_from_slice(&[0.7, -0.2, 2.0]);
            let model = ForwardModel::new(&sensor, medium);
            let found = model.of_points(&[Vec::new(), points.collect()]).unwrap();
            let (none, cell) = found.split_at(sensor.taxels());
            assert!(none.iter().all(|stress| *stress == 0.0));
            let off = apart(cell, &model.of_cells(&forces_N).unwrap());
            assert!(off < 1e-11, "{medium:?}: {off:e}");
        }
    }

    /// What is lost is the spread of the pressure within a cell: half the pitch, a quarter of the difference.
    #[test]
    fn the_cells_of_a_contact_have_nearly_its_stress() {
        let off = |pitch_mm: f64| {
            let count = (24.0 / pitch_mm) as usize;
            let sensor =
                Sensor { rows: count, cols: count, pitch_x_mm: pitch_mm, pitch_y_mm: pitch_mm, thickness_mm: 3.0 };
            let contact = Contact {
                shape: Some("hertz-ellipse".to_owned()),
                size_mm: vec![5.0, 3.5, 20.0],
                normal_N: Some(5.0),
                tangential_N: Some([1.2, 0.6]),
                ..Contact::default()
            };
            let frame = generate("press", &sensor, Medium::HalfSpace, &[contact]).unwrap();
            let cells = frame.cell_forces_N.unwrap();
            let forces_N: Vec<f64> =
                (0..sensor.taxels()).flat_map(|k| [cells.fx[k], cells.fy[k], cells.fz[k]]).collect();
            apart(&ForwardModel::new(&sensor, Medium::HalfSpace).of_cells(&forces_N).unwrap(), &frame.stress_MPa)
        };
        let [coarse, fine] = [off(2.0), off(1.0)];
        assert!(coarse < 0.07 && coarse > 0.06, "{coarse}");
        assert!((3.0..5.5).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn forces_that_are_no_numbers_are_named() {
        let model = ForwardModel::new(&sensor(2, 3), Medium::HalfSpace);
        let cells = |forces: &[f64]| model.of_cells(forces).unwrap_err().to_string();
        assert_eq!(cells(&[0.0; 17]), "forces_N has 17 values, wanted a multiple of 2 · 3 · 3");
        assert_eq!(model.of_cells(&[]), Ok(Vec::new()));
        let mut forces_N = vec![0.0; 36];
        forces_N[18 + 13] = f64::NAN;
        assert_eq!(cells(&forces_N), "forces_N[1, 1, 1] of frame 1 = NaN is not a finite number");
        forces_N[18 + 13] = 0.0;
        // A layer of a thousandth of a millimetre: 1e6 MPa and more per N.
        let thin = Sensor { pitch_x_mm: 1e-3, pitch_y_mm: 1e-3, thickness_mm: 1e-3, ..sensor(2, 3) };
        forces_N[AXES * 4 + 2] = f64::MAX;
        let stress = ForwardModel::new(&thin, Medium::HalfSpace).of_cells(&forces_N).unwrap_err().to_string();
        assert!(stress.ends_with("in frame 0 is not a finite number"), "{stress}");
        let points =
            |force: PointForce| model.of_points(&[vec![PointForce::default(), force]]).unwrap_err().to_string();
        let there = PointForce { at_mm: [0.0, f64::INFINITY], force_N: [0.0, 0.0, 1.0] };
        assert_eq!(points(there), "at_mm[1, 1] of frame 0 = inf is not a finite number");
        let none = PointForce { at_mm: [0.0; 2], force_N: [f64::NAN, 0.0, 1.0] };
        assert_eq!(points(none), "forces_N[1, 0] of frame 0 = NaN is not a finite number");
        let large = PointForce { at_mm: [1.0; 2], force_N: [f64::MAX; 3] };
        assert_eq!(points(large), "the stress on taxel 0,0 in frame 0 is not a finite number");
    }
}
