//! Link: requests to a board as bytes, and its answers.
//!
//! The caller has the port: it writes the bytes of a request, and hands the bytes that it reads to [`dermis_link_receive`].
//! A request without answer is made again, with a new sequence number.
//!
//! | | | |
//! |---|---|---|
//! | out: request | bytes with SLIP framing, sequence, CRC-32 | [`dermis_golden::wire::link`] |
//! | in: bytes of the board | in pieces of any length | |
//! | out: answer | [`dermis_result`] | N |

use std::mem::MaybeUninit;
use std::slice::from_ref;

use dermis_golden::data::frame::Frame;
use dermis_golden::engine::StreamChecks;
use dermis_golden::fixed::Model;
use dermis_golden::wire::link::{codes_to_bytes, payloads, supports, Decoder, Identity, Kind, Packet, OVERHEAD};
use dermis_host::link::{check_identity, BoardAnswer, PhysicalAnswer};

use crate::guard::{attempt, buffer, copy, dermis_status, exclusive, free, guarded, output, reference, values, Error};
use crate::result::dermis_result;
use crate::scene::{dermis_scene, frames};
use crate::stream::pace;

/// The host end of a board's link. One thread at a time may use it.
pub struct dermis_link {
    model: Model,
    checks: StreamChecks,
    decoder: Decoder,
    sequence: u8,
    /// The readings sent under each sequence number, until they are answered.
    sent: Vec<Option<Frame>>,
}

/// What dermis_link_receive found.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum dermis_answer {
    /// No packet is complete yet.
    None = 0,
    /// The board is the scene's.
    Identity = 1,
    /// The result of a frame.
    Result = 2,
    /// An answer to no open request, such as a late one to a request that was made again; ignore it.
    Other = 3,
}

impl dermis_link {
    /// Writes a request with the next sequence number.
    fn request(&mut self, kind: Kind, payload: Vec<u8>, wire: &mut Wire) -> Result<u8, Error> {
        let sequence = self.sequence.wrapping_add(1);
        let bytes = Packet { kind, sequence, payload }.to_wire();
        let (needs, has) = (bytes.len(), wire.buffer.len());
        let buffer = wire.buffer.get_mut(..needs).ok_or_else(|| {
            Error::input(format!(
                "capacity = {has} is not allowed; the request has {needs} bytes: dermis_link_capacity"
            ))
        })?;
        copy(&bytes, buffer);
        wire.size.write(needs);
        self.sequence = sequence;
        Ok(sequence)
    }

    /// What a packet is, and its result.
    fn answer(&mut self, packet: &Packet) -> Result<(dermis_answer, Option<dermis_result>), Error> {
        let forces = match packet.kind {
            Kind::Identity => {
                let board = |error: dermis_host::link::IdentityError| Error {
                    status: dermis_status::Board,
                    text: error.to_string(),
                };
                check_identity(&self.model, &packet.payload).map_err(board)?;
                return Ok((dermis_answer::Identity, None));
            }
            Kind::Forces => true,
            Kind::Resultants => false,
            _ => return Ok((dermis_answer::Other, None)),
        };
        let Some(readings) = self.sent[usize::from(packet.sequence)].take() else {
            return Ok((dermis_answer::Other, None));
        };
        let bytes = packet.payload.len();
        let answer = BoardAnswer::of_bytes(&self.model, &packet.payload, forces).ok_or_else(|| Error {
            status: dermis_status::Damaged,
            text: format!("an answer of type {} has {bytes} bytes", packet.kind.name()),
        })?;
        let result = match answer.decode(&self.model, &readings)? {
            Some(mut result) => {
                self.checks.add(from_ref(&readings), result.resultant_N, &mut result.diagnostics());
                dermis_result::of_model(result)
            }
            None => {
                let mut physical = PhysicalAnswer::new(&self.model, &readings, &answer)?;
                self.checks.add(from_ref(&readings), physical.resultant_N, &mut physical.diagnostics());
                dermis_result::of_board(physical)
            }
        };
        Ok((dermis_answer::Result, Some(result)))
    }
}

/// Where the bytes of a request go.
struct Wire<'a> {
    buffer: &'a mut [MaybeUninit<u8>],
    size: &'a mut MaybeUninit<usize>,
}

impl Wire<'_> {
    /// # Safety
    /// As [`buffer`] and [`output`].
    unsafe fn new<'a>(wire: *mut u8, capacity: usize, size: *mut usize) -> Result<Wire<'a>, Error> {
        let size = unsafe { output("size", size) }?;
        size.write(0);
        Ok(Wire { buffer: unsafe { buffer("wire", wire, capacity) }?, size })
    }
}

/// Make the host end of the link of a board that was built for a scene. It belongs to the caller: dermis_link_free; the scene
/// may be freed before it. After an error *link is NULL; DERMIS_STATUS_INPUT for a scene whose hardware cannot have a link.
/// cross_check is that of dermis_stream_new: the frames that are answered are a stream.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_new(
    scene: *const dermis_scene,
    cross_check: u64,
    link: *mut *mut dermis_link,
) -> dermis_status {
    guarded(|| {
        let link = unsafe { output("link", link) }?;
        link.write(std::ptr::null_mut());
        let scene = unsafe { reference("scene", scene) }?;
        let model = Model::new(&scene.spec)?;
        let identity = Identity::of(&model).map_err(Error::input)?;
        if identity.scans() {
            let text = "hardware.source = adc-scan: a link sends frames, which such a board does not take".to_owned();
            return Err(Error { status: dermis_status::Input, text });
        }
        let sent = vec![None; usize::from(u8::MAX) + 1];
        let checks = StreamChecks::new(&model, pace(cross_check));
        let made = dermis_link { model, checks, decoder: Decoder::default(), sequence: 0, sent };
        link.write(Box::into_raw(Box::new(made)));
        Ok(())
    })
}

/// Free a link; NULL is allowed. Results that it gave stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_free(link: *mut dermis_link) {
    unsafe { free(link) }
}

/// The largest number of bytes that a request has on the wire; 0 after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_capacity(link: *const dermis_link) -> usize {
    attempt(|| {
        let [(_, codes), ..] = payloads(&unsafe { reference("link", link) }?.model);
        // Every byte may need an escape; two ENDs.
        Ok(2 * (codes + OVERHEAD) + 2)
    })
    .unwrap_or(0)
}

/// Write the request for the board's identity to wire, which has room for capacity bytes, and their number to size. Send it
/// first: its answer tells whether the board was built for the scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_identify(
    link: *mut dermis_link,
    wire: *mut u8,
    capacity: usize,
    size: *mut usize,
) -> dermis_status {
    guarded(|| {
        let mut wire = unsafe { Wire::new(wire, capacity, size) }?;
        unsafe { exclusive("link", link) }?.request(Kind::Identify, Vec::new(), &mut wire)?;
        Ok(())
    })
}

/// Write the request for the forces of a frame, or with forces = false for its resultants, to wire, which has room for
/// capacity bytes, and their number to size. stress_MPa has count = rows * cols values, as for dermis_reconstruct. A board
/// takes up to three requests before it has answered the first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_frame(
    link: *mut dermis_link,
    stress_MPa: *const f64,
    count: usize,
    forces: bool,
    wire: *mut u8,
    capacity: usize,
    size: *mut usize,
) -> dermis_status {
    guarded(|| {
        let mut wire = unsafe { Wire::new(wire, capacity, size) }?;
        let link = unsafe { exclusive("link", link) }?;
        let kind = if forces { Kind::FrameForForces } else { Kind::FrameForResultants };
        if !supports(&link.model, kind) {
            let text = match forces {
                true => "forces = true is not allowed; the board's engine sends records only",
                false => "forces = false is not allowed; the board's engine sends forces only",
            };
            return Err(Error::input(text));
        }
        let scene = &link.model.scene;
        let frames = unsafe { frames(scene, stress_MPa, count) }?;
        let frames: Vec<Frame> = frames.into_iter().map(|frame| frame.mask_dead(&scene.input.dead)).collect();
        let codes = link.model.readings(&frames)?;
        let payload = codes_to_bytes(&codes, link.model.formats().code_bits);
        let sequence = link.request(kind, payload, &mut wire)?;
        link.sent[usize::from(sequence)] = frames.into_iter().next();
        Ok(())
    })
}

/// Take the next bytes from the board, as many as are there. Writes to used how many were taken: all, or those up to the end
/// of a packet; call it again with the others. answer says what the packet is. With DERMIS_ANSWER_RESULT *result belongs to
/// the caller: dermis_result_free; else it is NULL.
///
/// DERMIS_STATUS_DAMAGED: a packet was damaged on the wire; make the request again. DERMIS_STATUS_BOARD: the board was built
/// for another scene or version. Both leave used written, and the link goes on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dermis_link_receive(
    link: *mut dermis_link,
    bytes: *const u8,
    count: usize,
    used: *mut usize,
    answer: *mut dermis_answer,
    result: *mut *mut dermis_result,
) -> dermis_status {
    guarded(|| {
        let (used, result) = unsafe { (output("used", used)?, output("result", result)?) };
        let answer = unsafe { output("answer", answer) }?;
        let used = used.write(0);
        result.write(std::ptr::null_mut());
        answer.write(dermis_answer::None);
        let link = unsafe { exclusive("link", link) }?;
        for &byte in unsafe { values("bytes", bytes, count) }? {
            *used += 1;
            let Some(packet) = link.decoder.next(byte) else { continue };
            let packet = packet.map_err(|error| Error { status: dermis_status::Damaged, text: error.to_string() })?;
            let (kind, found) = link.answer(&packet)?;
            answer.write(kind);
            result.write(found.map_or(std::ptr::null_mut(), dermis_result::into_raw));
            break;
        }
        Ok(())
    })
}
