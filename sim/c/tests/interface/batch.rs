//! Batches: results are those of frames alone, to the bit; arrays that are left out are not touched; what is refused is named.

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

use dermis_c::batch::*;
use dermis_c::guard::dermis_status;
use dermis_c::result::*;
use dermis_c::scene::*;

use super::input::{last_error, stress};

const TAXELS: usize = 64;
const NONE: dermis_batch = dermis_batch {
    results: 0,
    resultant_N: null_mut(),
    sigma_N: null_mut(),
    flags: null_mut(),
    fx_N: null_mut(),
    fy_N: null_mut(),
    fz_N: null_mut(),
};

struct Scene(*mut dermis_scene);

impl Drop for Scene {
    fn drop(&mut self) {
        unsafe { dermis_scene_free(self.0) };
    }
}

fn scene(more: &str) -> Scene {
    let array = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n";
    let (text, mut scene) = (CString::new(format!("{array}{more}")).unwrap(), null_mut());
    unsafe {
        assert_eq!(dermis_scene_parse(text.as_ptr(), c"pad.toml".as_ptr(), &mut scene), dermis_status::Ok);
    }
    Scene(scene)
}

/// Frames of a press that grows.
fn frames(count: usize) -> Vec<f64> {
    (0..count).flat_map(|k| stress().into_iter().map(move |b| b * (1.0 + k as f64))).collect()
}

fn many(scene: &Scene, engine: &CStr, stress: &[f64], batch: &dermis_batch) -> Result<(), String> {
    match unsafe { dermis_reconstruct_many(scene.0, engine.as_ptr(), stress.as_ptr(), stress.len(), false, batch) } {
        dermis_status::Ok => Ok(()),
        _ => Err(last_error()),
    }
}

#[test]
fn every_result_is_that_of_its_frame_alone() {
    for (engine, more, has_sigma) in [
        (c"golden", "", true),
        (c"golden", "[search]\nestimator = \"search\"\nnoise_floor_MPa = 0.0\n", false),
        (c"fixed", "[input]\nfull_scale_MPa = 4.0\n", false),
    ] {
        let (scene, results) = (scene(more), 5);
        let mut stress = frames(results);
        stress[TAXELS + 9] = f64::NAN;
        let [mut resultant, mut sigma] = [const { [[0.0; 3]; 5] }; 2];
        let (mut flags, mut forces) = ([0; 5], [const { [[0.0; TAXELS]; 5] }; 3]);
        let [fx_N, fy_N, fz_N] = forces.each_mut().map(|own| own.as_mut_ptr().cast());
        let (resultant_N, sigma_N) = (resultant.as_mut_ptr().cast(), sigma.as_mut_ptr().cast());
        let batch = dermis_batch { results, resultant_N, sigma_N, flags: flags.as_mut_ptr(), fx_N, fy_N, fz_N };
        many(&scene, engine, &stress, &batch).unwrap();
        for k in 0..results {
            let (own, mut result) = (&stress[TAXELS * k..TAXELS * (k + 1)], null_mut());
            let (mut force_N, mut bits, mut alone) = ([0.0; 3], 0, [[0.0; TAXELS]; 3]);
            unsafe {
                let done = dermis_reconstruct(scene.0, engine.as_ptr(), own.as_ptr(), own.len(), false, &mut result);
                assert_eq!(done, dermis_status::Ok);
                dermis_result_resultant(result, force_N.as_mut_ptr());
                dermis_result_flags(result, &mut bits);
                let [x, y, z] = alone.each_mut().map(|own| own.as_mut_ptr());
                dermis_result_forces(result, x, y, z, TAXELS);
                dermis_result_free(result);
            }
            assert_eq!((force_N, bits), (resultant[k], flags[k]));
            assert_eq!(alone, [forces[0][k], forces[1][k], forces[2][k]]);
            assert_eq!(sigma[k].map(f64::is_nan), [!has_sigma; 3]);
        }
        assert!(flags[0] != flags[1] && resultant[4][2] > 4.0 * resultant[0][2]);
        // Nothing but what is wanted.
        let mut only = [[0.0; 3]; 5];
        many(&scene, engine, &stress, &dermis_batch { results, resultant_N: only.as_mut_ptr().cast(), ..NONE })
            .unwrap();
        assert_eq!(only, resultant);
    }
}

#[test]
fn what_cannot_be_used_is_named() {
    let (plain, stress) = (scene(""), frames(2));
    let refused =
        |scene: &Scene, stress: &[f64], batch: &dermis_batch| many(scene, c"golden", stress, batch).unwrap_err();
    assert_eq!(refused(&plain, &stress, &NONE), "results = 0 is not allowed; 128 values give 2 of them");
    let two = dermis_batch { results: 2, ..NONE };
    assert!(refused(&plain, &stress[1..], &two).starts_with("a batch of 127 values is not allowed; scene pad has"));
    let mut infinite = stress.clone();
    infinite[TAXELS] = f64::INFINITY;
    assert!(refused(&plain, &infinite, &two).contains("frame 1"), "{}", last_error());
    let sliding = scene("[input]\nmean = \"sliding\"\naverage = 1\n");
    assert!(refused(&sliding, &stress, &two).contains("input.mean = \"sliding\" needs the frames before"));
    let sums = scene("[output]\nforces = \"resultants\"\n");
    let mut fz = vec![0.0; 2 * TAXELS];
    assert_eq!(
        refused(&sums, &stress, &dermis_batch { fz_N: fz.as_mut_ptr(), ..two }),
        "the result has no force per taxel"
    );
    assert_eq!(many(&sums, c"golden", &stress, &two), Ok(()));
    assert_eq!(many(&plain, c"golden", &[], &NONE), Ok(()));
    unsafe {
        let status = dermis_reconstruct_many(plain.0, c"golden".as_ptr(), stress.as_ptr(), 128, false, null());
        assert_eq!((status, last_error()), (dermis_status::Input, "batch is NULL".to_owned()));
    }
}
