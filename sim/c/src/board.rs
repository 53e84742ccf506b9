//! Board: one that answers at a serial port, or a core behind Ethernet, whose port the library has.
//!
//! Where a program has the port itself, such as without an operating system, [`mod@crate::link`] is the same as bytes.
//!
//! | | | |
//! |---|---|---|
//! | in: stress of a frame | row-major | MPa |
//! | out: answer | [`dermis_result`] | N |

use std::ffi::c_char;
use std::slice::from_ref;
use std::time::Duration;

use dermis_golden::engine::StreamChecks;
use dermis_golden::fixed::Model;
use dermis_host::link::{open_board, HostError, Session};

use crate::guard::{dermis_status, exclusive, free, guarded, output, reference, text, Error};
use crate::result::dermis_result;
use crate::scene::{dermis_scene, one_frame};
use crate::stream::pace;

/// A board that answers. One thread at a time may use it.
pub struct dermis_board {
    session: Session,
    checks: StreamChecks,
}

/// A failed exchange, or what the board refuses.
fn failed(error: anyhow::Error) -> Error {
    match error.downcast::<HostError>() {
        Ok(error) => Error { status: dermis_status::Board, text: error.to_string() },
        Err(error) => error.into(),
    }
}

/// Open the board at a port that was built for a scene. It belongs to the caller: dermis_board_free; the scene may be freed before
/// it. After an error *board is NULL.
///
/// port is the path of a serial port, such as "/dev/ttyUSB0", at the bit rate of the scene's board, or "udp:192.168.1.50", the
/// address of a core behind Ethernet, of several arrays with a number as in "udp:192.168.1.50#3". A request is made again after timeout_ms without an answer, up to eight times.
/// cross_check is that of dermis_stream_new: the frames that are answered are a stream.
///
/// DERMIS_STATUS_BOARD: no answer, or a board of another scene or version.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_board_open(
    scene: *const dermis_scene,
    port: *const c_char,
    timeout_ms: u64,
    cross_check: u64,
    board: *mut *mut dermis_board,
) -> dermis_status {
    guarded(|| {
        let board = unsafe { output("board", board) }?;
        board.write(std::ptr::null_mut());
        let scene = &unsafe { reference("scene", scene) }?.spec;
        let port = unsafe { text("port", port) }?;
        let model = Model::new(scene)?;
        let checks = StreamChecks::new(&model, pace(cross_check));
        let opened = open_board(port, &model, None, Duration::from_millis(timeout_ms), "host").map_err(failed)?;
        let session = Session::new(opened, model, None, None, true, false).map_err(failed)?;
        board.write(Box::into_raw(Box::new(dermis_board { session, checks })));
        Ok(())
    })
}

/// Close a board; NULL is allowed. Results that it gave stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_board_free(board: *mut dermis_board) {
    unsafe { free(board) }
}

/// Send a frame and wait for its forces: count = rows * cols values, as for dermis_reconstruct. *result belongs to the caller:
/// dermis_result_free; it is NULL after an error. Of a core behind Ethernet dermis_result_time says when the core had the frame,
/// nanoseconds since 1970, and error_ns, which may be NULL, by how much that may be wrong; of another board error_ns is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_board_frame(
    board: *mut dermis_board,
    stress_MPa: *const f64,
    count: usize,
    result: *mut *mut dermis_result,
    error_ns: *mut u64,
) -> dermis_status {
    guarded(|| {
        let result = unsafe { output("result", result) }?;
        result.write(std::ptr::null_mut());
        let mut error_ns = if error_ns.is_null() { None } else { Some(unsafe { output("error_ns", error_ns) }?) };
        if let Some(error_ns) = &mut error_ns {
            error_ns.write(0);
        }
        let dermis_board { session, checks } = unsafe { exclusive("board", board) }?;
        let frame = unsafe { one_frame(&session.model.scene, stress_MPa, count, "a board") }?;
        let (readings, answer) = session.request(&frame).map_err(failed)?;
        let found = answer.decode(&session.model, &readings)?;
        let mut found = found.ok_or_else(|| Error::absent("forces"))?;
        checks.add(from_ref(&readings), found.resultant_N, &mut found.diagnostics());
        if let Some((error_ns, acquired)) = error_ns.zip(answer.acquired) {
            error_ns.write(acquired.error_ns);
        }
        result.write(dermis_result::of_model(found).at(answer.acquired.map(|acquired| acquired.time_ns)).into_raw());
        Ok(())
    })
}
