//! A board's answer to a frame, in LSBs and in physical units.

use std::time::SystemTime;

use anyhow::Result;
use dermis_golden::data::frame::{Forces, Frame};
use dermis_golden::fixed::stages::send::{labels_of_beats, status_fields, Status, FRAMING, STATUS_BEATS};
use dermis_golden::fixed::words::formats::MU_STEPS;
use dermis_golden::fixed::{FixedError, Model};
use dermis_golden::result::checks::Checks;
use dermis_golden::result::flags::{frame_flags, Feature, Flag, FlagSet};
use dermis_golden::result::reconstruct::{Diagnostics, FoundContact, MissingTaxel, Reconstruction, SuspectTaxel};
use dermis_golden::wire::link::{beats_of_bytes, Sums, BEAT_BYTES};
use dermis_golden::wire::udp::shortened;
use serde::Serialize;

use super::core_clock::Acquired;

/// A board's answer to a frame, in LSBs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BoardAnswer {
    /// Sums over all taxels; of a board that sends records none.
    pub sums: Option<Sums>,
    /// Forces `[fx, fy, fz]` of all taxels, row-major, if requested; or the beats of the records.
    pub forces: Option<Vec<[i32; 3]>>,
    /// Beats of labels; none where there is one μ.
    pub labels: Vec<[i32; 3]>,
    /// Status beats.
    pub status: Vec<[i32; 3]>,
    /// Codes that the board has scanned, row-major; none where they were sent to it.
    pub codes: Vec<i32>,
    /// Comparison with the bit-true model: `None` if not requested, else the first difference or `Some(None)`.
    pub difference: Option<Option<String>>,
    /// Time at which the answer was complete.
    pub received_at: SystemTime,
    /// When the frame entered the core, of one that says it.
    pub acquired: Option<Acquired>,
    /// Words of a packet of forces that are mantissas of 16 bits, which are rounded; `None` for forces as they are.
    pub short_forces: Option<usize>,
}

impl BoardAnswer {
    /// Parses the payload of a forces or resultants packet; `None` if its length is wrong.
    pub fn of_bytes(model: &Model, bytes: &[u8], forces: bool) -> Option<BoardAnswer> {
        let others = (model.status_triples() + model.code_beats()) * BEAT_BYTES;
        let (front, others) = bytes.split_at_checked(bytes.len().checked_sub(others)?)?;
        let mut labels = beats_of_bytes(others)?;
        let mut status = labels.split_off(model.label_beats());
        let sensor = &model.scene.sensor;
        // Places of the last beat beyond the array are empty.
        let codes = status.split_off(model.status_beats()).concat().into_iter().take(sensor.taxels()).collect();
        let records = model.sends_resultants();
        let forces = if forces || records { Some(beats_of_bytes(front)?) } else { None };
        let sums = match &forces {
            Some(forces) if forces.len() != model.force_triples() => return None,
            Some(_) if records => None,
            Some(forces) => Some(Sums::of(forces, sensor.cols)),
            None => Some(Sums::of_bytes(front)?),
        };
        let (difference, received_at) = (None, SystemTime::now());
        let (acquired, short_forces) = (None, None);
        Some(BoardAnswer { sums, forces, labels, status, codes, difference, received_at, acquired, short_forces })
    }

    /// The first difference from the bit-true model's result for `codes`, `None` if equal. What the model does not see is
    /// ignored: flags of packets dropped earlier, and of single samples of a scan.
    pub fn compare_with_model(&self, model: &Model, codes: &[i32]) -> Option<String> {
        let trace = model.run(codes);
        let (cols, taxels) = (model.scene.sensor.cols, model.scene.sensor.taxels());
        let (forces, labels) = trace.beats.split_at(model.force_triples());
        let short = self.short_forces.map(|words| beats_of(&shortened(forces.as_flattened(), words)));
        let forces = short.as_deref().unwrap_or(forces);
        let pairs = self.forces.iter().flatten().zip(forces).enumerate();
        let mut differing = pairs.filter(|(_, (got, expected))| got != expected);
        if let Some((index, (got, expected))) = differing.next() {
            let place = match model.sends_resultants() {
                true => format!("beat {index} of the records:"),
                false => format!("row {}, column {}: force", index / cols, index % cols),
            };
            return Some(format!("{place} {got:?}, model {expected:?}"));
        }
        if let Some(sums) = self.sums {
            let expected = Sums::of(forces, cols);
            if sums != expected {
                return Some(format!("sums {sums:?}, model {expected:?}"));
            }
        }
        let read = |beats| labels_of_beats(beats, taxels);
        let mut differing = std::iter::zip(read(&self.labels), read(labels)).enumerate();
        if let Some((index, (got, expected))) = differing.find(|(_, (got, expected))| got != expected) {
            return Some(format!("row {}, column {}: label {got}, model {expected}", index / cols, index % cols));
        }
        let mut status = self.status.clone();
        let unseen = status_fields().into_iter().filter(|field| *field == FRAMING || field.feature == Feature::Scan);
        unseen.for_each(|field| status.chunks_mut(STATUS_BEATS).for_each(|beats| field.put(beats, 0)));
        (status != trace.status).then(|| format!("status {status:?}, model {:?}", trace.status))
    }

    /// The result of this answer to `readings`; `None` if it has no forces.
    ///
    /// # Errors
    /// An answer that the model cannot decode.
    pub fn decode(&self, model: &Model, readings: &Frame) -> Result<Option<Reconstruction>, FixedError> {
        let decode = |forces: &Vec<[i32; 3]>| {
            let beats = [forces.as_slice(), &self.labels].concat();
            model.decode(std::slice::from_ref(readings), "board", &beats, &self.status)
        };
        self.forces.as_ref().map(decode).transpose()
    }

    fn statuses(&self) -> impl Iterator<Item = Status> + '_ {
        Status::all(&self.status)
    }

    /// Whether the board has dropped a frame's packet since its last answer.
    pub fn dropped_before(&self) -> bool {
        self.statuses().any(|status| status.framing)
    }

    /// The version of the tables in each status, or `refused`, `not whole`.
    pub(super) fn tables(&self) -> impl Iterator<Item = String> + '_ {
        self.statuses().map(|status| match status.raised {
            raised if raised.contains(Flag::TablesIncomplete) => "not whole".to_owned(),
            raised if raised.contains(Flag::TablesRefused) => "refused".to_owned(),
            _ => status.tables_version.to_string(),
        })
    }

    /// |μ| over `search.mu_max`; none with several subarrays or contacts, whose loads the resultants do not tell.
    fn mu_share(&self) -> Option<f64> {
        let mut all = self.statuses();
        let (first, others) = (all.next(), all.next());
        let [x, y] = first.filter(|_| others.is_none())?.position().map(f64::from);
        Some(x.hypot(y) / MU_STEPS as f64)
    }

    /// The figures behind the flags that an answer with sums allows.
    fn checks(&self, model: &Model, readings: &Frame, frame: &Frame) -> Result<Checks> {
        let figures = Checks { peak_MPa: frame.peak_MPa(), mu_share: self.mu_share(), ..Checks::default() };
        let figures = figures.with_missing(&model.scene, frame);
        Ok(figures.with_readings(model.input(), std::slice::from_ref(readings)))
    }

    /// The flags of an answer with sums, as in a reconstruction, but `mu-at-bound` only with one subarray.
    fn flags(&self, model: &Model, frame: &Frame, checks: &Checks) -> Result<Vec<Flag>> {
        let noise_MPa = model.input().noise_MPa();
        let of_frame = frame_flags(&model.scene, model.estimator(), frame, &model.codes(frame)?, noise_MPa);
        // The statuses of contacts that are not there say nothing of μ.
        let labels = labels_of_beats(&self.labels, model.scene.sensor.taxels());
        let of_taxels = |slot: usize| labels.is_empty() || labels.contains(&(slot + 1));
        let statuses: Vec<Status> = self.statuses().collect();
        let of_others = of_frame.into_iter().chain(checks.flags(&model.scene)).collect::<FlagSet>();
        Ok((model.status_flags(&statuses, of_taxels) | of_others).iter().collect())
    }
}

/// Beats of numbers, three to each.
fn beats_of(numbers: &[i32]) -> Vec<[i32; 3]> {
    numbers.as_chunks().0.to_vec()
}

/// An answer in physical units; an output line of `--stream`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhysicalAnswer {
    /// Sum of the forces, [x, y, normal].
    pub resultant_N: [f64; 3],
    /// Centre of the normal forces relative to the array's centre, tension counted negative; none if their sum is zero.
    pub centre_mm: Option<[f64; 2]>,
    /// Number of taxels with a normal force; of a board that sends records none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loaded: Option<u64>,
    /// Flags, sorted.
    pub flags: Vec<Flag>,
    /// The figures behind the flags.
    pub checks: Checks,
    /// Taxels whose readings no force explains, as the cross-check has it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub suspects: Vec<SuspectTaxel>,
    /// Live taxels without a reading.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<MissingTaxel>,
    /// Whether the board has dropped a frame's packet since its last answer.
    pub dropped_before: bool,
    /// The contacts, that with the largest load first; of a board that tells them apart, if it sends forces or records.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contacts: Option<Vec<FoundContact>>,
    /// Force per taxel, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forces_N: Option<Forces>,
    /// Whether the answer equals the bit-true model's, if compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal: Option<bool>,
}

impl PhysicalAnswer {
    /// Its figures, flags and suspect taxels.
    pub fn diagnostics(&mut self) -> Diagnostics<'_> {
        Diagnostics { checks: &mut self.checks, flags: &mut self.flags, suspects: &mut self.suspects }
    }

    /// The answer to `readings`, in physical units.
    ///
    /// # Errors
    /// A frame of another sensor; an answer that the model cannot decode.
    pub fn new(model: &Model, readings: &Frame, answer: &BoardAnswer) -> Result<PhysicalAnswer> {
        let frame = &model.stress(std::slice::from_ref(readings))?;
        let lsb_N = model.force_lsb_N(model.codes(frame)?.full_scale_MPa);
        let sensor = &model.scene.sensor;
        let [x0, y0] = sensor.position_mm(0, 0);
        let centre = answer.sums.and_then(|sums| sums.centre());
        let centre_mm = centre.map(|[col, row]| [x0 + col * sensor.pitch_x_mm, y0 + row * sensor.pitch_y_mm]);
        let decoded = answer.decode(model, readings)?;
        let resultant_N = match (&answer.sums, &decoded) {
            (Some(sums), _) => [sums.fx, sums.fy, sums.fz].map(|sum| sum as f64 * lsb_N),
            (None, decoded) => decoded.as_ref().map_or([0.0; 3], |result| result.resultant_N),
        };
        // Forces or records tell all that a reconstruction checks.
        let (checks, flags) = match &decoded {
            Some(result) => (result.checks, result.flags.clone()),
            None => {
                let checks = answer.checks(model, readings, frame)?;
                (checks, answer.flags(model, frame, &checks)?)
            }
        };
        let axis = |beats: &[[i32; 3]], axis: usize| beats.iter().map(|beat| f64::from(beat[axis]) * lsb_N).collect();
        let forces = |beats: &Vec<[i32; 3]>| Forces { fx: axis(beats, 0), fy: axis(beats, 1), fz: axis(beats, 2) };
        Ok(PhysicalAnswer {
            resultant_N,
            centre_mm,
            loaded: answer.sums.map(|sums| sums.loaded),
            flags,
            checks,
            suspects: Vec::new(),
            missing: MissingTaxel::all(&model.scene, frame, std::slice::from_ref(readings)),
            dropped_before: answer.dropped_before(),
            contacts: decoded.and_then(|result| result.contacts()),
            forces_N: answer.forces.as_ref().filter(|_| !model.sends_resultants()).map(forces),
            equal: answer.difference.as_ref().map(Option::is_none),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::Scene;

    /// A frame's flags as a host tells them that asked for resultants, or for forces; the statuses are changed on the way.
    fn flags(model: &Model, change: &dyn Fn(&mut Status)) -> [Vec<Flag>; 2] {
        answers(model, &Frame::shipped(&model.scene).remove(1), change).map(|answer| answer.flags)
    }

    /// The answers to a frame of a host that asked for resultants, and of one that asked for forces.
    fn answers(model: &Model, frame: &Frame, change: &dyn Fn(&mut Status)) -> [PhysicalAnswer; 2] {
        let trace = model.run(&model.readings(std::slice::from_ref(frame)).unwrap());
        let changed = |mut status: Status| {
            change(&mut status);
            status.beats()
        };
        let sums = Some(Sums::of(&trace.beats, model.scene.sensor.cols));
        let status = Status::all(&trace.status).flat_map(changed).collect();
        let (labels, codes, received_at) = (Vec::new(), Vec::new(), SystemTime::UNIX_EPOCH);
        let (forces, difference, acquired, short_forces) = (None, None, None, None);
        let answer =
            BoardAnswer { sums, forces, labels, status, codes, difference, received_at, acquired, short_forces };
        let whole = BoardAnswer { forces: Some(trace.beats), ..answer.clone() };
        [answer, whole].map(|answer| PhysicalAnswer::new(model, frame, &answer).unwrap())
    }

    #[test]
    fn missing_readings_are_named_with_and_without_forces() {
        let scene = Scene::builtin("eight-by-eight").unwrap();
        let model = Model::new(&scene).unwrap();
        let mut stress = Frame::shipped(&scene).remove(1).stress_MPa;
        (stress[27], stress[50]) = (f64::NAN, f64::NAN);
        let frame = Frame::from_stress("lacking", &scene.sensor, stress).unwrap();
        let wanted = model.reconstruct(&frame).unwrap();
        for answer in answers(&model, &frame, &|_| ()) {
            assert_eq!((&answer.missing, &answer.flags), (&wanted.extra.missing, &wanted.flags));
            assert_eq!((answer.missing[0].row, answer.missing[0].col, answer.missing.len()), (3, 3, 2));
            assert_eq!(answer.checks.missing_load, wanted.checks.missing_load);
        }
    }

    #[test]
    fn each_flag_of_a_status_is_told_with_and_without_forces() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let model = Model::new(&scene).unwrap();
        assert_eq!(flags(&model, &|_| ()), [[], []]);
        for flag in Flag::ALL.into_iter().filter(|flag| flag.status_bit().is_some()) {
            let raised = FlagSet::raised([(flag, true)]);
            assert_eq!(flags(&model, &|status| status.raised = raised), [[flag], [flag]]);
        }
        assert_eq!(flags(&model, &|status| status.condition = false), [[Flag::ConditionUnmet]; 2]);
        assert_eq!(flags(&model, &|status| status.found = false), [[Flag::NoCompression]; 2]);
        assert_eq!(flags(&model, &|status| status.force_saturations = 1), [[Flag::Saturated]; 2]);
        // Without a search there was nothing to find.
        scene.search.mu_max = 0.0;
        assert_eq!(flags(&Model::new(&scene).unwrap(), &|_| ()), [[], []]);
    }

    /// A comparison with the model leaves out what the model does not see, and nothing else.
    #[test]
    fn each_field_of_a_status_is_compared_with_the_model_but_those_it_does_not_see() {
        let model = Model::new(&Scene::builtin("eight-by-eight").unwrap()).unwrap();
        let codes = model.readings(&Frame::shipped(&model.scene)[1..2]).unwrap();
        let trace = model.run(&codes);
        let answer = |status| BoardAnswer {
            sums: None,
            forces: None,
            labels: Vec::new(),
            status,
            codes: Vec::new(),
            difference: None,
            received_at: SystemTime::UNIX_EPOCH,
            acquired: None,
            short_forces: None,
        };
        assert_eq!(answer(trace.status.clone()).compare_with_model(&model, &codes), None);
        for field in status_fields() {
            let mut status = trace.status.clone();
            let other = field.get(&status) ^ 1;
            field.put(&mut status, other);
            let unseen = field == FRAMING || field.feature == Feature::Scan;
            assert_eq!(answer(status).compare_with_model(&model, &codes).is_none(), unseen, "{}", field.name);
        }
    }
}
