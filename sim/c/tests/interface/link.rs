//! The link against the model in the board's place: requests are the board's packets, answers give the model's results;
//! damaged, late and foreign packets are told apart.

use std::ffi::CStr;
use std::ptr::null_mut;

use dermis_c::guard::dermis_status;
use dermis_c::link::*;
use dermis_c::result::*;
use dermis_c::scene::*;
use dermis_golden::data::frame::Frame;
use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_golden::wire::link::{codes_of_bytes, Beat, Decoder, Identity, Kind, Packet, Sums};

use super::input::{last_error, scene, stress};

/// A link, with the model of its scene in the place of the board.
struct Setting {
    link: *mut dermis_link,
    model: Model,
}

/// What `dermis_link_receive` found in all bytes: each status with its answer and result.
type Found = Vec<(dermis_status, dermis_answer, Option<Owned>)>;

/// A result that is freed when dropped.
struct Owned(*mut dermis_result);

impl Drop for Owned {
    fn drop(&mut self) {
        unsafe { dermis_result_free(self.0) }
    }
}

impl Drop for Setting {
    fn drop(&mut self) {
        unsafe { dermis_link_free(self.link) }
    }
}

impl Setting {
    fn new(name: &str) -> Setting {
        let (scene, mut link) = (scene(name), null_mut());
        assert_eq!(unsafe { dermis_link_new(scene, 0, &mut link) }, dermis_status::Ok, "{}", last_error());
        unsafe { dermis_scene_free(scene) };
        Setting { link, model: Model::new(&Scene::builtin(name).unwrap()).unwrap() }
    }

    /// The packet of a request for a frame, or for the identity.
    fn request(&self, frame: Option<(&[f64], bool)>) -> Packet {
        let capacity = unsafe { dermis_link_capacity(self.link) };
        let (mut wire, mut size) = (vec![0; capacity], 0);
        let status = match frame {
            Some((stress, forces)) => unsafe {
                dermis_link_frame(
                    self.link,
                    stress.as_ptr(),
                    stress.len(),
                    forces,
                    wire.as_mut_ptr(),
                    capacity,
                    &mut size,
                )
            },
            None => unsafe { dermis_link_identify(self.link, wire.as_mut_ptr(), capacity, &mut size) },
        };
        assert_eq!(status, dermis_status::Ok, "{}", last_error());
        let mut decoder = Decoder::default();
        let mut packets = wire[..size].iter().filter_map(|byte| decoder.next(*byte));
        let packet = packets.next().unwrap().unwrap();
        assert!(packets.next().is_none());
        packet
    }

    /// The board's answer to a request, as bytes.
    fn answer(&self, request: &Packet) -> Vec<u8> {
        let payload = match request.kind {
            Kind::Identify => Identity::of(&self.model).unwrap().to_bytes(),
            kind => {
                let codes = codes_of_bytes(&request.payload, self.model.formats().code_bits).unwrap();
                let trace = self.model.run(&codes);
                let bytes = |beats: &[[i32; 3]]| -> Vec<u8> {
                    beats.iter().flat_map(|&[fx, fy, fz]| Beat { fx, fy, fz }.to_bytes()).collect()
                };
                let front = match kind {
                    Kind::FrameForForces => bytes(&trace.beats),
                    _ => Sums::of(&trace.beats, self.model.scene.sensor.cols).to_bytes(),
                };
                [front, bytes(&trace.status)].concat()
            }
        };
        Packet { kind: request.kind.answer(), sequence: request.sequence, payload }.to_wire()
    }

    /// Hands on bytes in pieces of `length`.
    fn receive(&self, bytes: &[u8], length: usize) -> Found {
        let mut found = Vec::new();
        for mut piece in bytes.chunks(length) {
            while !piece.is_empty() {
                let (mut used, mut answer, mut result) = (0, dermis_answer::Other, null_mut());
                let status = unsafe {
                    dermis_link_receive(self.link, piece.as_ptr(), piece.len(), &mut used, &mut answer, &mut result)
                };
                assert!(used > 0 && used <= piece.len());
                piece = &piece[used..];
                if status != dermis_status::Ok || answer != dermis_answer::None {
                    found.push((status, answer, (!result.is_null()).then_some(Owned(result))));
                }
            }
        }
        found
    }
}

/// Status and answer of each.
fn kinds(found: &Found) -> Vec<(dermis_status, dermis_answer)> {
    found.iter().map(|(status, answer, _)| (*status, *answer)).collect()
}

const IDENTITY: (dermis_status, dermis_answer) = (dermis_status::Ok, dermis_answer::Identity);
const RESULT: (dermis_status, dermis_answer) = (dermis_status::Ok, dermis_answer::Result);
const OTHER: (dermis_status, dermis_answer) = (dermis_status::Ok, dermis_answer::Other);
const DAMAGED: (dermis_status, dermis_answer) = (dermis_status::Damaged, dermis_answer::None);

#[test]
fn answers_give_the_results_of_the_model() {
    let setting = Setting::new("eight-by-eight");
    let stress = stress();
    let frame = Frame::from_stress("frame", &setting.model.scene.sensor, stress.clone()).unwrap();
    let wanted = setting.model.reconstruct(&frame).unwrap();
    let requests =
        [setting.request(None), setting.request(Some((&stress, true))), setting.request(Some((&stress, false)))];
    let kinds_sent = requests.each_ref().map(|request| request.kind);
    assert_eq!(kinds_sent, [Kind::Identify, Kind::FrameForForces, Kind::FrameForResultants]);
    let wire: Vec<u8> = requests.iter().flat_map(|request| setting.answer(request)).collect();
    for length in [1, 100, usize::MAX] {
        if length > 1 {
            // Each request is answered once.
            assert_eq!(kinds(&setting.receive(&wire, length)), [IDENTITY, OTHER, OTHER]);
            continue;
        }
        let found = setting.receive(&wire, length);
        assert_eq!(kinds(&found), [IDENTITY, RESULT, RESULT]);
        let (mut fx, mut fy, mut fz, mut sum, mut flags) = ([0.0; 64], [0.0; 64], [0.0; 64], [0.0; 3], 0);
        for (index, (_, _, result)) in found.iter().enumerate().skip(1) {
            let result = result.as_ref().unwrap().0;
            unsafe {
                assert_eq!(dermis_result_resultant(result, sum.as_mut_ptr()), dermis_status::Ok);
                assert_eq!(dermis_result_flags(result, &mut flags), dermis_status::Ok);
                let status = dermis_result_forces(result, fx.as_mut_ptr(), fy.as_mut_ptr(), fz.as_mut_ptr(), fx.len());
                assert_eq!(status, [dermis_status::Ok, dermis_status::Absent][index - 1]);
                let json = CStr::from_ptr(dermis_result_json(result)).to_str().unwrap();
                assert!(json.contains("\"resultant_N\""), "{json}");
            }
            assert_eq!(flags, wanted.flags.iter().map(|flag| flag.bit()).sum::<u32>());
            // Sums of integers and of their multiples differ in their last bits.
            assert!(sum.iter().zip(wanted.resultant_N).all(|(sum, wanted)| (sum - wanted).abs() < 1e-12), "{sum:?}");
        }
        assert_eq!(
            (&fx[..], &fy[..], &fz[..]),
            (&wanted.forces_N.fx[..], &wanted.forces_N.fy[..], &wanted.forces_N.fz[..])
        );
    }
}

#[test]
fn damaged_late_and_foreign_packets_are_told_apart() {
    let setting = Setting::new("eight-by-eight");
    let stress = stress();
    let first = setting.request(Some((&stress, true)));
    let mut wire = setting.answer(&first);
    let middle = wire.len() / 2;
    wire[middle] ^= 1;
    assert_eq!(kinds(&setting.receive(&wire, 64)), [DAMAGED]);
    assert!(last_error().contains("CRC"), "{}", last_error());
    // The link goes on; a number that was never sent is another's.
    let again = setting.request(Some((&stress, true)));
    assert_ne!(again.sequence, first.sequence);
    let late = Packet { sequence: 200, ..again.clone() };
    let wire = [setting.answer(&late), setting.answer(&again)].concat();
    assert_eq!(kinds(&setting.receive(&wire, 64)), [OTHER, RESULT]);
    // An answer that is too short is no result.
    let short = setting.request(Some((&stress, true)));
    let wire = Packet { kind: Kind::Forces, sequence: short.sequence, payload: vec![0; 12] }.to_wire();
    assert_eq!(kinds(&setting.receive(&wire, 64)), [DAMAGED]);
    assert_eq!(last_error(), "an answer of type forces has 12 bytes");
    // A board of another scene.
    let identify = setting.request(None);
    let foreign = Identity { scene: 1, ..Identity::of(&setting.model).unwrap() };
    let wire = Packet { kind: Kind::Identity, sequence: identify.sequence, payload: foreign.to_bytes() }.to_wire();
    assert_eq!(kinds(&setting.receive(&wire, 64)), [(dermis_status::Board, dermis_answer::None)]);
    assert!(last_error().starts_with("the board was built for another scene"), "{}", last_error());
}

#[test]
fn what_cannot_be_sent_is_named() {
    let setting = Setting::new("eight-by-eight");
    let (stress, mut wire, mut size) = (stress(), [0; 20], 7);
    let frame = |count: usize, forces: bool, size: &mut usize, wire: &mut [u8]| {
        let room = wire.len();
        unsafe { dermis_link_frame(setting.link, stress.as_ptr(), count, forces, wire.as_mut_ptr(), room, size) }
    };
    assert_eq!(frame(64, true, &mut size, &mut wire), dermis_status::Input);
    let text = last_error();
    assert!(text.starts_with("capacity = 20 is not allowed; the request has ") && size == 0, "{text}");
    assert_eq!(frame(60, true, &mut size, &mut wire), dermis_status::Input);
    assert!(last_error().starts_with("count = 60 is not allowed"), "{}", last_error());
    // A scene that averages has no link.
    let toml = c"[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n\
                 [input]\naverage = 1\nfull_scale_MPa = 1\n";
    let (mut scene, mut link) = (null_mut(), null_mut::<dermis_link>().wrapping_add(1));
    unsafe {
        assert_eq!(dermis_scene_parse(toml.as_ptr(), c"pad.toml".as_ptr(), &mut scene), dermis_status::Ok);
        assert_eq!(dermis_link_new(scene, 0, &mut link), dermis_status::Input);
        dermis_scene_free(scene);
    }
    assert!(last_error().starts_with("input.average = 1:") && link.is_null(), "{}", last_error());
}
