//! Batches: frames that do not depend on each other, on all cores, into arrays of the caller.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use dermis_golden::result::flags::FlagSet;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_host::batch::Batch;
use dermis_host::engine::EngineName;

use crate::guard::{buffer, copy, dermis_status, guarded, reference, text, values, Error};
use crate::scene::dermis_scene;

/// Where the results of dermis_reconstruct_many are written, one after the other. An array that is NULL is left out.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct dermis_batch {
    /// Number of results, for which the arrays have room.
    pub results: usize,
    /// Sum of the forces in N, x, y and normal: 3 values for each result.
    pub resultant_N: *mut f64,
    /// Standard deviation of that in N: 3 values for each result, NaN where the estimator gives none.
    pub sigma_N: *mut f64,
    /// Limitations of the result, a sum of dermis_flag: 1 value for each result.
    pub flags: *mut u32,
    /// Force along x on each taxel in N: rows * cols values for each result.
    pub fx_N: *mut f64,
    /// Force along y on each taxel in N: rows * cols values for each result.
    pub fy_N: *mut f64,
    /// Normal force on each taxel in N: rows * cols values for each result.
    pub fz_N: *mut f64,
}

/// The arrays of a batch with their lengths for a result.
struct Arrays<'a> {
    floats: [(&'a mut [MaybeUninit<f64>], usize); 5],
    flags: &'a mut [MaybeUninit<u32>],
}

impl<'a> Arrays<'a> {
    /// # Safety
    /// As [`buffer`] for each array.
    unsafe fn new(batch: &dermis_batch, taxels: usize) -> Result<Arrays<'a>, Error> {
        let dermis_batch { results, resultant_N, sigma_N, flags, fx_N, fy_N, fz_N } = *batch;
        let too_many = || Error::input(format!("results = {results} is not allowed; they are more than memory has"));
        let floats = |name: &str, array: *mut f64, each: usize| -> Result<_, Error> {
            let wanted = if array.is_null() { 0 } else { results };
            let length = wanted.checked_mul(each).ok_or_else(too_many)?;
            Ok((unsafe { buffer(name, array, length) }?, each))
        };
        Ok(Arrays {
            floats: [
                floats("resultant_N", resultant_N, 3)?,
                floats("sigma_N", sigma_N, 3)?,
                floats("fx_N", fx_N, taxels)?,
                floats("fy_N", fy_N, taxels)?,
                floats("fz_N", fz_N, taxels)?,
            ],
            flags: unsafe { buffer("flags", flags, if flags.is_null() { 0 } else { results }) }?,
        })
    }

    /// Writes the result with this number.
    fn write(&mut self, number: usize, result: &Reconstruction) -> Result<(), Error> {
        let (sigma_N, forces) = (result.sigma_N().unwrap_or([f64::NAN; 3]), &result.forces_N);
        let given = [&result.resultant_N[..], &sigma_N, &forces.fx, &forces.fy, &forces.fz];
        for ((array, each), given) in self.floats.iter_mut().zip(given) {
            let Some(own) = array.get_mut(number * *each..(number + 1) * *each) else { continue };
            if given.len() != own.len() {
                return Err(Error::absent("force per taxel"));
            }
            copy(given, own);
        }
        if let Some(flags) = self.flags.get_mut(number) {
            flags.write(result.flags.iter().copied().collect::<FlagSet>().bits());
        }
        Ok(())
    }
}

/// Reconstruct frames that do not depend on each other, on all cores, into arrays of the caller.
///
/// engine, stress_MPa and cross_check are as for dermis_reconstruct: count values, frame after frame of rows * cols; the stress is
/// read where it stands. batch->results is the number of results, count / (rows * cols) / dermis_scene_frames_per_result.
/// Results are those of dermis_reconstruct of each frame alone, in the order of the frames; the frames of a sensor in the order of
/// time show more, and take less time with evidence: dermis_stream. DERMIS_STATUS_INPUT for a sliding mean and a running zero, whose
/// results depend on the frames before; DERMIS_STATUS_ABSENT for forces of taxels of output.forces = "resultants". After an error what
/// the arrays hold is not defined.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_reconstruct_many(
    scene: *const dermis_scene,
    engine: *const c_char,
    stress_MPa: *const f64,
    count: usize,
    cross_check: bool,
    batch: *const dermis_batch,
) -> dermis_status {
    guarded(|| {
        let scene = unsafe { reference("scene", scene) }?;
        let name = EngineName::software(unsafe { text("engine", engine) }?)?;
        let into = unsafe { reference("batch", batch) }?;
        let stress_MPa = unsafe { values("stress_MPa", stress_MPa, count) }?;
        let batch = Batch::new(&scene.engines, name, &scene.spec, stress_MPa, cross_check)?;
        let results = batch.results();
        if into.results != results {
            let given = into.results;
            return Err(Error::input(format!(
                "results = {given} is not allowed; {count} values give {results} of them"
            )));
        }
        let mut arrays = unsafe { Arrays::new(into, scene.spec.sensor.taxels()) }?;
        let mut number = 0;
        for chunk in batch {
            for result in chunk? {
                arrays.write(number, &result)?;
                number += 1;
            }
        }
        Ok(())
    })
}
