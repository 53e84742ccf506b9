//! Results: forces, contacts with error bars, flags.
//!
//! What an engine does not give is absent: a status or a marker says so, never a zero.

use std::ffi::{c_char, CString};
use std::sync::OnceLock;

use dermis_golden::data::frame::Forces;
use dermis_golden::result::flags::FlagSet;
use dermis_golden::result::reconstruct::{FoundContact, Reconstruction};
use dermis_host::link::PhysicalAnswer;

use crate::guard::{attempt, buffer, copy, dermis_status, free, guarded, output, reference, Error};

/// One contact of a result. A figure counts where its marker is true; else it is NaN.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct dermis_contact {
    /// Force in N: x, y, normal.
    pub force_N: [f64; 3],
    /// Standard deviation of the shear in N: x, y.
    pub shear_sigma_N: [f64; 2],
    /// Standard deviation of the normal force in N.
    pub normal_sigma_N: f64,
    /// Ratio of shear to normal force: x, y.
    pub mu: [f64; 2],
    /// Standard deviation of mu: x, y.
    pub mu_sigma: [f64; 2],
    /// Centre of pressure in mm from the array's centre: x, y.
    pub centre_mm: [f64; 2],
    /// Whether the estimator gives shear_sigma_N.
    pub has_shear_sigma_N: bool,
    /// Whether the estimator gives normal_sigma_N.
    pub has_normal_sigma_N: bool,
    /// Whether the estimator gives mu_sigma.
    pub has_mu_sigma: bool,
    /// Whether there are compressive forces, which have a centre.
    pub has_centre_mm: bool,
}

impl From<FoundContact> for dermis_contact {
    fn from(found: FoundContact) -> dermis_contact {
        let FoundContact { force_N, shear_sigma_N, normal_sigma_N, mu, mu_sigma, centre_mm, .. } = found;
        let absent = [f64::NAN; 2];
        dermis_contact {
            force_N,
            shear_sigma_N: shear_sigma_N.unwrap_or(absent),
            normal_sigma_N: normal_sigma_N.unwrap_or(f64::NAN),
            mu,
            mu_sigma: mu_sigma.unwrap_or(absent),
            centre_mm: centre_mm.unwrap_or(absent),
            has_shear_sigma_N: shear_sigma_N.is_some(),
            has_normal_sigma_N: normal_sigma_N.is_some(),
            has_mu_sigma: mu_sigma.is_some(),
            has_centre_mm: centre_mm.is_some(),
        }
    }
}

/// The forces of one frame. Any number of threads may read one at the same time.
pub struct dermis_result {
    source: Source,
    /// When its last frame was acquired, in ns, if the caller stated it.
    time_ns: Option<i64>,
    json: OnceLock<CString>,
}

/// Where a result comes from.
enum Source {
    /// A model, or a board that sent all forces.
    Reconstruction(Box<Reconstruction>),
    /// A board that sent resultants.
    Answer(Box<PhysicalAnswer>),
}

impl dermis_result {
    /// The result of a model, or of a board that sent all forces.
    pub fn of_model(result: Reconstruction) -> dermis_result {
        dermis_result { source: Source::Reconstruction(Box::new(result)), time_ns: None, json: OnceLock::new() }
    }

    /// The result of a board that sent resultants.
    pub fn of_board(answer: PhysicalAnswer) -> dermis_result {
        dermis_result { source: Source::Answer(Box::new(answer)), time_ns: None, json: OnceLock::new() }
    }

    /// The same of frames of which the last was acquired at that time in ns.
    pub(crate) fn at(self, time_ns: Option<i64>) -> dermis_result {
        dermis_result { time_ns, ..self }
    }

    pub(crate) fn into_raw(self) -> *mut dermis_result {
        Box::into_raw(Box::new(self))
    }

    fn resultant_N(&self) -> [f64; 3] {
        match &self.source {
            Source::Reconstruction(result) => result.resultant_N,
            Source::Answer(answer) => answer.resultant_N,
        }
    }

    fn forces(&self) -> Option<&Forces> {
        match &self.source {
            Source::Reconstruction(result) => Some(&result.forces_N).filter(|forces| !forces.fz.is_empty()),
            Source::Answer(answer) => answer.forces_N.as_ref(),
        }
    }

    fn contacts(&self) -> Option<Vec<dermis_contact>> {
        let Source::Reconstruction(result) = &self.source else { return None };
        result.contacts().map(|all| all.into_iter().map(dermis_contact::from).collect())
    }

    fn flags(&self) -> u32 {
        let flags = match &self.source {
            Source::Reconstruction(result) => &result.flags,
            Source::Answer(answer) => &answer.flags,
        };
        flags.iter().copied().collect::<FlagSet>().bits()
    }

    fn json(&self) -> Result<&CString, Error> {
        if let Some(text) = self.json.get() {
            return Ok(text);
        }
        let text = match &self.source {
            Source::Reconstruction(result) => serde_json::to_string(result),
            Source::Answer(answer) => serde_json::to_string(answer),
        };
        let internal = |text| Error { status: dermis_status::Internal, text };
        let text = text.map_err(|error| internal(error.to_string()))?;
        // JSON escapes a zero byte.
        let text = CString::new(text).map_err(|error| internal(error.to_string()))?;
        Ok(self.json.get_or_init(|| text))
    }
}

/// Free a result; NULL is allowed. Its JSON is freed with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_free(result: *mut dermis_result) {
    unsafe { free(result) }
}

/// Write the sum of the forces in N, x, y and normal, to the 3 values of force_N.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_resultant(result: *const dermis_result, force_N: *mut f64) -> dermis_status {
    guarded(|| {
        let result = unsafe { reference("result", result) }?;
        copy(&result.resultant_N(), unsafe { buffer("force_N", force_N, 3) }?);
        Ok(())
    })
}

/// Write when the last frame of the result was acquired to time_ns, as dermis_stream_push_at was told; of a block it is the last
/// of its frames. DERMIS_STATUS_ABSENT if that was not stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_time(result: *const dermis_result, time_ns: *mut i64) -> dermis_status {
    guarded(|| {
        let output = unsafe { output("time_ns", time_ns) }?;
        let time_ns = unsafe { reference("result", result) }?.time_ns;
        output.write(time_ns.ok_or_else(|| Error::absent("time of acquisition"))?);
        Ok(())
    })
}

/// Write the force on each taxel in N to fx_N, fy_N and fz_N, which have room for as many values as there are taxels.
/// DERMIS_STATUS_ABSENT if the result has resultants only: output.forces = "resultants" in the scene, or a frame sent for its
/// resultants.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_forces(
    result: *const dermis_result,
    fx_N: *mut f64,
    fy_N: *mut f64,
    fz_N: *mut f64,
    taxels: usize,
) -> dermis_status {
    guarded(|| {
        let forces =
            unsafe { reference("result", result) }?.forces().ok_or_else(|| Error::absent("force per taxel"))?;
        let wanted = forces.fz.len();
        if taxels != wanted {
            return Err(Error::input(format!("taxels = {taxels} is not allowed; the result has {wanted}")));
        }
        // All three are checked before one is written.
        let fx = unsafe { buffer("fx_N", fx_N, taxels) }?;
        let fy = unsafe { buffer("fy_N", fy_N, taxels) }?;
        let fz = unsafe { buffer("fz_N", fz_N, taxels) }?;
        copy(&forces.fx, fx);
        copy(&forces.fy, fy);
        copy(&forces.fz, fz);
        Ok(())
    })
}

/// Write the contacts, at most capacity of them, and the number that the result has to count. With capacity 0, contacts may be
/// NULL. DERMIS_STATUS_ABSENT, and a count of 0, if the result does not tell contacts apart: those of the estimators
/// with evidence and of partition.case = "contacts" do.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_contacts(
    result: *const dermis_result,
    contacts: *mut dermis_contact,
    capacity: usize,
    count: *mut usize,
) -> dermis_status {
    guarded(|| {
        let count = unsafe { output("count", count) }?;
        count.write(0);
        let all = unsafe { reference("result", result) }?.contacts().ok_or_else(|| Error::absent("contacts"))?;
        copy(&all, unsafe { buffer("contacts", contacts, capacity) }?);
        count.write(all.len());
        Ok(())
    })
}

/// Write the limitations of the result to flags, a sum of dermis_flag.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_flags(result: *const dermis_result, flags: *mut u32) -> dermis_status {
    guarded(|| {
        let flags = unsafe { output("flags", flags) }?;
        flags.write(unsafe { reference("result", result) }?.flags());
        Ok(())
    })
}

/// The result as `dermis reconstruct --json` prints it, or for a frame sent for its resultants as a line of
/// `dermis host --stream`: subarrays, figures behind the flags and all else. The text belongs to the result; NULL after an
/// error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_result_json(result: *const dermis_result) -> *const c_char {
    attempt(|| Ok(unsafe { reference("result", result) }?.json()?.as_ptr())).unwrap_or(std::ptr::null())
}
