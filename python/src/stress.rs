//! Stress that forces on the surface cause.

use dermis_golden::physics::forward::{ForwardModel, PointForce, AXES};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{numbers, shape};
use crate::exceptions::input;
use crate::scene::Scene;

/// Coordinates of a point: x, y.
const PLANE: usize = 2;

#[pymethods]
impl Scene {
    /// Compute the stress that forces on the surface cause in the scene's medium.
    ///
    /// Parameters
    /// ----------
    /// forces_N : array of shape (rows, cols, 3) or (..., rows, cols, 3)
    ///     Force on each taxel's cell in N, as results have it: x, y, normal. It is spread evenly over the cell. With at_mm:
    ///     force on each point, shape (points, 3) or (..., points, 3).
    /// at_mm : array of shape (points, 2) or (..., points, 2), optional
    ///     Where forces act, x, y in mm from the array's centre, also beside the array: the same points for all frames, or
    ///     those of each frame, with as many axes as forces_N.
    ///
    /// Returns
    /// -------
    /// array of shape (rows, cols) or (..., rows, cols)
    ///     Normal stress on each taxel in MPa, compression positive: of the medium, without noise, codes and faults, which
    ///     `generate` adds. Frames are computed on all cores, without the interpreter's lock.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     An array of another shape or type, a number that is not finite.
    #[pyo3(signature = (forces_N, *, at_mm = None))]
    fn stress_MPa<'py>(
        &self,
        py: Python<'py>,
        forces_N: &Bound<'py, PyAny>,
        at_mm: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (forces, [rows, cols]) = (numbers("forces_N", forces_N)?, self.lengths());
        let found = forces.shape();
        let (leading, stress_MPa) = match at_mm {
            None => {
                let Some(leading) = found.strip_suffix(&[rows, cols, AXES]) else {
                    let (found, scene) = (shape(found), self.name());
                    return Err(input(format!(
                        "forces_N has shape {found}, scene {scene} wants ({rows}, {cols}, 3) or (..., {rows}, {cols}, 3)"
                    )));
                };
                let forces = forces.as_slice()?;
                (leading, py.detach(|| self.forward().of_cells(forces)))
            }
            Some(at_mm) => {
                let at = numbers("at_mm", at_mm)?;
                let (leading, frames) = points(found, at.shape(), forces.as_slice()?, at.as_slice()?)?;
                if frames.is_empty() {
                    // NumPy refuses more frames than memory has, which arrays without points may claim.
                    let zeros = py.import("numpy")?.call_method1("zeros", ([leading, &[rows, cols]].concat(),))?;
                    return Ok(zeros.cast_into::<PyArrayDyn<f64>>()?);
                }
                (leading, py.detach(|| self.forward().of_points(&frames)))
            }
        };
        let lengths = [leading, &[rows, cols]].concat();
        PyArray1::from_vec(py, stress_MPa.map_err(input)?).reshape(lengths)
    }
}

/// The leading lengths of forces at points, and the points of each frame; no frames where there are no points. Shapes and values are
/// those of forces_N and at_mm.
///
/// # Errors
/// `InputError` for shapes that do not belong together.
fn points<'a>(
    forces: &'a [usize],
    at: &[usize],
    force_N: &[f64],
    at_mm: &[f64],
) -> PyResult<(&'a [usize], Vec<Vec<PointForce>>)> {
    let wanted = "wanted (..., points, 3) with at_mm of (points, 2) or (..., points, 2)";
    let refused = || input(format!("forces_N has shape {}, at_mm {}; {wanted}", shape(forces), shape(at)));
    let [leading @ .., points, AXES] = forces else { return Err(refused()) };
    let shared = at == [*points, PLANE];
    if !shared && at != [leading, &[*points, PLANE]].concat() {
        return Err(refused());
    }
    let point = |frame: usize, point: usize| {
        let force = frame * points + point;
        let at = if shared { point } else { force };
        PointForce {
            at_mm: std::array::from_fn(|axis| at_mm[PLANE * at + axis]),
            force_N: std::array::from_fn(|axis| force_N[AXES * force + axis]),
        }
    };
    let frames = 0..if *points > 0 { leading.iter().product::<usize>() } else { 0 };
    Ok((leading, frames.map(|frame| (0..*points).map(|own| point(frame, own)).collect()).collect()))
}

impl Scene {
    /// The forward model, made with the first stress.
    fn forward(&self) -> &ForwardModel {
        self.forward_model.get_or_init(|| ForwardModel::of_scene(self.spec()))
    }
}
