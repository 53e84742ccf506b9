//! Stress that forces on the surface cause.

use dermis_golden::physics::forward::{ForwardModel, PointForce, AXES};

use crate::guard::{buffer, copy, dermis_status, guarded, reference, values, Error};
use crate::scene::dermis_scene;

/// Coordinates of a point: x, y.
const PLANE: usize = 2;

impl dermis_scene {
    /// The forward model, made with the first stress.
    fn forward(&self) -> &ForwardModel {
        self.forward_model.get_or_init(|| ForwardModel::of_scene(&self.spec))
    }
}

/// Compute the stress that forces on the surface cause in the scene's medium, for any number of frames, on all cores.
///
/// forces_N has count values, frame after frame of rows * cols * 3: x, y and normal force on each taxel's cell in N, over which
/// it is spread evenly. stress_MPa has room for count / 3 values, frame after frame of rows * cols: normal stress in MPa,
/// compression positive, of the medium, without the noise and codes of a sensor. After an error what stress_MPa holds is not
/// defined. The first call for a scene builds the model, which takes longer than the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stress(
    scene: *const dermis_scene,
    forces_N: *const f64,
    count: usize,
    stress_MPa: *mut f64,
) -> dermis_status {
    guarded(|| {
        let scene = unsafe { reference("scene", scene) }?;
        let forces_N = unsafe { values("forces_N", forces_N, count) }?;
        let buffer = unsafe { buffer("stress_MPa", stress_MPa, count / AXES) }?;
        copy(&scene.forward().of_cells(forces_N).map_err(Error::input)?, buffer);
        Ok(())
    })
}

/// Compute the stress that forces on points of the surface cause in the scene's medium.
///
/// at_mm has points * 2 values, x and y of each point in mm from the array's centre, also beside the array; forces_N has
/// points * 3 values, x, y and normal force in N. stress_MPa has room for rows * cols values, as dermis_stress has them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_stress_of_points(
    scene: *const dermis_scene,
    at_mm: *const f64,
    forces_N: *const f64,
    points: usize,
    stress_MPa: *mut f64,
) -> dermis_status {
    guarded(|| {
        let scene = unsafe { reference("scene", scene) }?;
        let length = |each: usize| {
            let too_many = || Error::input(format!("points = {points} is not allowed; they are more than memory has"));
            points.checked_mul(each).ok_or_else(too_many)
        };
        let at_mm = unsafe { values("at_mm", at_mm, length(PLANE)?) }?;
        let forces_N = unsafe { values("forces_N", forces_N, length(AXES)?) }?;
        let buffer = unsafe { buffer("stress_MPa", stress_MPa, scene.spec.sensor.taxels()) }?;
        let point = |(at, force): (&[f64], &[f64])| PointForce {
            at_mm: [at[0], at[1]],
            force_N: [force[0], force[1], force[2]],
        };
        let forces = at_mm.chunks_exact(PLANE).zip(forces_N.chunks_exact(AXES)).map(point).collect();
        copy(&scene.forward().of_points(&[forces]).map_err(Error::input)?, buffer);
        Ok(())
    })
}
