//! Boards behind a port that the library has: a core behind Ethernet, whose results are those of the model.

use std::ffi::CString;
use std::ptr::null_mut;
use std::time::{SystemTime, UNIX_EPOCH};

use dermis_c::board::*;
use dermis_c::guard::dermis_status;
use dermis_c::result::*;
use dermis_c::scene::*;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_host::link::NetworkCore;

use super::input::{last_error, scene, stress};

const NAME: &str = "eight-by-eight";

fn open(scene_name: &str, port: &str) -> (dermis_status, *mut dermis_board) {
    let (scene, mut board) = (scene(scene_name), null_mut());
    let port = CString::new(port).unwrap();
    let status = unsafe { dermis_board_open(scene, port.as_ptr(), 50, 0, &mut board) };
    unsafe { dermis_scene_free(scene) };
    (status, board)
}

fn now_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64
}

#[test]
fn a_core_behind_ethernet_answers_with_the_forces_of_the_model_and_their_time() {
    let model = Model::new(&Scene::builtin(NAME).unwrap()).unwrap();
    let core = NetworkCore::start(&model, "127.0.0.1:0").unwrap();
    let (status, board) = open(NAME, &format!("udp:{}", core.address()));
    assert_eq!(status, dermis_status::Ok, "{}", last_error());
    let stress = stress();
    let wanted = model.reconstruct(&dermis_golden::data::frame::Frame::shipped(&model.scene)[1]).unwrap();
    for _ in 0..3 {
        let (mut result, mut error_ns, before) = (null_mut(), 0, now_ns());
        let status = unsafe { dermis_board_frame(board, stress.as_ptr(), stress.len(), &mut result, &mut error_ns) };
        assert_eq!(status, dermis_status::Ok, "{}", last_error());
        let (mut sum_N, mut time_ns) = ([0.0; 3], 0);
        unsafe {
            assert_eq!(dermis_result_resultant(result, sum_N.as_mut_ptr()), dermis_status::Ok);
            assert_eq!(dermis_result_time(result, &mut time_ns), dermis_status::Ok);
            dermis_result_free(result);
        }
        assert_eq!(sum_N, wanted.resultant_N);
        assert!(
            error_ns > 0 && (before - error_ns as i64..=now_ns() + error_ns as i64).contains(&time_ns),
            "{time_ns} ± {error_ns}"
        );
    }
    // Of a wrong frame there is no result, and the next one is answered.
    let mut result = null_mut();
    let few = unsafe { dermis_board_frame(board, stress.as_ptr(), 63, &mut result, null_mut()) };
    assert_eq!((few, result.is_null()), (dermis_status::Input, true));
    let many = [stress.clone(), stress.clone()].concat();
    let two = unsafe { dermis_board_frame(board, many.as_ptr(), many.len(), &mut result, null_mut()) };
    assert_eq!((two, result.is_null()), (dermis_status::Input, true), "{}", last_error());
    assert_eq!(last_error(), "count = 128 is not allowed; a board takes one frame at a time");
    drop(core);
    let gone = unsafe { dermis_board_frame(board, stress.as_ptr(), stress.len(), &mut result, null_mut()) };
    assert_eq!((gone, result.is_null()), (dermis_status::Board, true));
    assert!(last_error().contains("no answer to frame_for_forces"), "{}", last_error());
    unsafe { dermis_board_free(board) };
}

#[test]
fn a_core_of_another_scene_and_one_that_is_not_there_are_told() {
    let core = NetworkCore::start(&Model::new(&Scene::builtin(NAME).unwrap()).unwrap(), "127.0.0.1:0").unwrap();
    let port = format!("udp:{}", core.address());
    let (status, board) = open("sensor-1", &port);
    assert_eq!((status, board.is_null()), (dermis_status::Board, true));
    assert!(last_error().contains("the board was built for another scene"), "{}", last_error());
    drop(core);
    let (status, board) = open(NAME, &port);
    assert_eq!((status, board.is_null()), (dermis_status::Board, true));
    assert!(last_error().contains("no answer to identify"), "{}", last_error());
    unsafe { dermis_board_free(board) };
}
