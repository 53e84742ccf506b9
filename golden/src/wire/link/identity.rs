//! Identity of a board: the scene for which its bitstream was generated.

use serde_json::json;

use super::error::LinkError;
use super::payload::{Identity, Sums};
use super::{code_bytes, Kind, BEAT_BYTES, VERSION};
use crate::fixed::stages::send::{LABEL_BITS, STATUS_BEATS};
use crate::fixed::words::schedule::Kind as Words;
use crate::fixed::Plan;
use crate::spec::board::EngineKind;
use crate::spec::scene::Condition;

/// All requests.
const REQUESTS: [Kind; 5] =
    [Kind::Identify, Kind::ReadCounters, Kind::FrameForResultants, Kind::FrameForForces, Kind::Tables];

/// Bit of [`Identity::left_out`]: the board scans its array.
const SCANS: u8 = 0x80;

impl Identity {
    /// The identity of the hardware of `plan`.
    ///
    /// # Errors
    /// [`LinkError`]: the scene averages, or its zero runs, so that a request that is repeated would count twice; it chooses its
    /// case per frame, for which there is no packet; a payload is too long; the board lacks the link or its clock is too slow for the bit rate.
    pub fn of(plan: &Plan) -> Result<Identity, LinkError> {
        let (sensor, board) = (&plan.scene.sensor, &plan.board);
        let scene = &plan.scene;
        require_one_answer(plan)?;
        let payloads = payloads(plan).into_iter().chain(image_bytes(plan).map(|bytes| ("tables", bytes)));
        if let Some((what, bytes)) = payloads.into_iter().find(|(_, bytes)| *bytes > usize::from(u16::MAX)) {
            return Err(LinkError::TooLong { scene: plan.scene.name.clone(), what, taxels: sensor.taxels(), bytes });
        }
        // Rows, columns and subarrays are fewer than the taxels, whose codes fit a packet.
        Ok(Identity {
            version: VERSION,
            rows: sensor.rows as u16,
            cols: sensor.cols as u16,
            input_bits: plan.formats().code_bits as u8,
            status_beats: STATUS_BEATS as u8,
            scene: scene_hash(plan),
            clock_hz: (board.clock_MHz * 1e6).round() as u32,
            bit_rate: scene.hardware.link.bit_rate(board)?,
            statuses: (plan.status_beats() / STATUS_BEATS) as u16,
            left_out: REQUESTS.into_iter().filter(|&kind| !supports(plan, kind)).map(bit).sum::<u8>()
                | if scene.hardware.adc_scan.is_some() { SCANS } else { 0 },
            label_bits: if plan.label_beats() > 0 { LABEL_BITS as u8 } else { 0 },
        })
    }

    /// The same with all requests left out but those to which `supports` says yes.
    pub fn with_requests(self, supports: impl Fn(Kind) -> bool) -> Identity {
        Identity { left_out: REQUESTS.into_iter().filter(|&kind| !supports(kind)).map(bit).sum(), ..self }
    }

    /// Whether the board scans its array.
    pub fn scans(&self) -> bool {
        self.left_out & SCANS != 0
    }

    /// Whether the board answers requests of this type.
    pub fn supports(&self, kind: Kind) -> bool {
        self.left_out & bit(kind) == 0
    }
}

/// Refuses a plan of which a request that is repeated would count twice, or has another number of beats than the one before.
///
/// # Errors
/// [`LinkError::Unsupported`]: the scene averages, its zero runs, or it chooses its case per frame.
pub fn require_one_answer(plan: &Plan) -> Result<(), LinkError> {
    let scene = &plan.scene;
    let refuse = |field, value: String| Err(LinkError::Unsupported { field, value });
    if scene.input.longest_average() > 0 {
        return refuse("input.average", scene.input.longest_average().to_string());
    }
    if scene.input.running_zero().is_some() {
        return refuse("input.zero", "running".to_string());
    }
    if plan.chooses() {
        return refuse("partition.case", scene.partition.case.to_string());
    }
    Ok(())
}

/// Whether a board of this plan answers requests of this type. The serial engine has no resultants: logic cells are few, so
/// the host adds up the forces. An engine that sends records has no forces.
pub fn supports(plan: &Plan, kind: Kind) -> bool {
    match kind {
        Kind::FrameForResultants => plan.board.engine == EngineKind::Parallel,
        Kind::FrameForForces => !plan.sends_resultants(),
        Kind::Tables => plan.has_writable_tables(),
        _ => true,
    }
}

/// Bit of a request in [`Identity::left_out`]; an answer has none.
fn bit(kind: Kind) -> u8 {
    match REQUESTS.contains(&kind) {
        true => 1 << (kind as u8 - 1),
        false => 0,
    }
}

/// Length in bytes of a frame's codes to the board, of its resultants and of its forces, each with a name.
pub fn payloads(plan: &Plan) -> [(&'static str, usize); 3] {
    let taxels = plan.scene.sensor.taxels();
    let others = (plan.status_triples() + plan.code_beats()) * BEAT_BYTES;
    let sent = if plan.scene.hardware.adc_scan.is_some() { 0 } else { taxels };
    let resultants = if plan.sends_resultants() { BEAT_BYTES * plan.force_beats() } else { Sums::BYTES };
    [
        ("codes", code_bytes(plan.formats().code_bits) * sent),
        ("resultants", resultants + others),
        ("forces", BEAT_BYTES * taxels + others),
    ]
}

/// Length in bytes of an image of tables; none where they are in the bitstream.
pub fn image_bytes(plan: &Plan) -> Option<usize> {
    plan.tables().map(|tables| tables.image_bytes())
}

/// CRC-32 over everything that determines the bits of the answers: this program's version, array, subarrays, formats,
/// whether records take the place of forces, condition, noise floors in codes and thresholds, limit of the score, whether codes are
/// checked, the arrays, zeros and gains of the taxels, dead taxels, the quantised matrices with the columns kept, the network, what finds the
/// contacts, and the scan. The names of scene and board and the clock are not included.
pub fn scene_hash(plan: &Plan) -> u32 {
    let (scene, sensor) = (&plan.scene, &plan.scene.sensor);
    let mut text = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "array": [sensor.rows, sensor.cols],
        "subarrays": plan.grid(),
        "formats": plan.formats(),
        "records": plan.sends_resultants(),
        "both_signs": plan.scene.partition.condition == Condition::BothSigns,
        "noise_floor": plan.of_each_array(|own| own.noise_floor.into()),
        "threshold": plan.of_each_array(|own| own.threshold.into()),
        "score_limit": plan.score_limit,
        "columns": plan.storage().columns,
        "zero": plan.prepare.zero,
        "gain": plan.prepare.gain,
        "contacts": plan.by_contact.as_ref().map(|contacts| (plan.contacts(), sensor, contacts.window)),
    });
    if let (Some(scan), Some(timing)) = (scene.hardware.adc_scan, plan.scan_timing()) {
        text["scan"] = json!([scan.converter.name, scan.converters, scan.average, timing.period]);
    }
    if let Some(push) = plan.push_limit {
        text["push_limit"] = json!(push);
    }
    if plan.prepare.check.is_some() {
        text["code_check"] = json!(true);
    }
    if scene.hardware.arrays > 1 {
        text["arrays"] = json!(scene.hardware.arrays);
    }
    let mut hash = crc32fast::Hasher::new();
    hash.update(text.to_string().as_bytes());
    plan.dead.iter().for_each(|taxel| hash.update(&(*taxel as u64).to_le_bytes()));
    let quantised = plan.quantised();
    let layers = 0..quantised.network.as_ref().map_or(0, |network| network.layers.len());
    let network = layers.flat_map(|layer| [Words::Layer(layer), Words::Bias(layer)]);
    let kinds = [Words::InverseHigh, Words::Ax, Words::Ay, Words::Mask].into_iter().chain(network);
    for flipped in kinds.flat_map(|kind| quantised.flips(kind)) {
        flipped.parity.iter().flatten().for_each(|word| hash.update(&word.to_le_bytes()));
    }
    hash.finalize()
}
