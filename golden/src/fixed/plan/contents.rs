//! What a plan contains: everything about a scene's hardware that is known before a frame arrives.

use serde_json::Value;

use super::resources::Resources;
use super::storage::Storage;
use crate::estimate::misfit::Misfit;
use crate::estimate::segment::Segmenter;
use crate::fixed::stages::choose::FrameStats;
use crate::fixed::stages::load::Outcome;
use crate::fixed::stages::prepare::Prepare;
use crate::fixed::stages::resultants::{self, Summed};
use crate::fixed::stages::scan::CODES_PER_BEAT;
use crate::fixed::stages::segment::cycles::Segmentation;
use crate::fixed::stages::send::{label_beats, STATUS_BEATS};
use crate::fixed::words::formats::Formats;
use crate::fixed::words::quantised::Quantised;
use crate::spec::adc::timing::Timing;
use crate::spec::board::{Board, EngineKind};
use crate::spec::partition::{Case, Grid, Subarray};
use crate::spec::quads::Quads;
use crate::spec::scene::{CoefficientCheck, ForceOutput, Scene};
use crate::spec::window::Window;

/// The hardware of one scene. What differs between partition cases is in [`CasePlan`]; the methods without a case give
/// that of the first, which with several cases is case 0, the whole array.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The scene.
    pub scene: Scene,
    /// The board.
    pub board: Board,
    /// Calibration and averaging of the input.
    pub prepare: Prepare,
    /// What each array has of its own beside zeros and gains, array after array: as many as `hardware.arrays`, at least one.
    pub own: Vec<OwnTables>,
    /// Word of a score above which it is that of no clean frame, where the whole array is searched for one μ and there is a
    /// table of deviations. Words of scores fall with the objective.
    pub score_limit: Option<i32>,
    /// Times that the forces below zero are below those above in every clean frame, 1 to 15, where there is such a limit; see
    /// [`forces::pulls`](crate::fixed::stages::forces::pulls).
    pub push_limit: Option<u32>,
    /// Dead taxels, row-major in the array, ascending; none where they are written, as gains of 0.
    pub dead: Vec<usize>,
    /// Segmentation and window, where each contact has a μ of its own.
    pub by_contact: Option<ContactPlan>,
    /// The check of decoded frames, where a network gives μ.
    pub misfit: Option<Misfit>,
    /// Memories and multipliers.
    pub resources: Resources,
    /// Cases that divide the array but were left out; empty if the scene lists its cases.
    pub dropped: Vec<Dropped>,
    /// At least one.
    pub(super) cases: Vec<CasePlan>,
}

/// What an array has of its own beside zeros and gains.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnTables {
    /// Noise floor in LSBs of a frame buffer word, rounded down.
    pub noise_floor: i32,
    /// `threshold.min_force_N` in force LSBs, rounded up.
    pub threshold: i64,
    /// Version of the tables: 0 for those of the bitstream.
    pub version: u16,
    /// What became of the last image of tables.
    pub outcome: Outcome,
}

impl OwnTables {
    /// The noise floor as an unsigned word of `bits` bits: no code is above the largest of [`Plan::floor_bits`].
    pub fn floor_word(&self, bits: u32) -> i32 {
        i64::from(self.noise_floor).clamp(0, (1 << bits) - 1) as i32
    }

    /// The threshold as a word of 32 bits.
    pub fn threshold_word(&self) -> u32 {
        self.threshold.clamp(0, u32::MAX.into()) as u32
    }
}

/// What one partition case adds to the hardware. All cases use the lanes, the search and the force unit of the first.
#[derive(Clone, Debug)]
pub struct CasePlan {
    /// The case.
    pub case: Case,
    /// The subarrays, row-major.
    pub parts: Vec<Subarray>,
    /// Widths and scales, the same in all cases but for quads, lanes and groups.
    pub formats: Formats,
    /// Quantised matrices.
    pub quantised: Quantised,
    /// The case's part of the coefficient memory.
    pub storage: Storage,
}

/// How the contacts of the array are found, and what is read around each.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPlan {
    /// The constants of the segmentation.
    pub segmenter: Segmenter,
    /// The window around a contact.
    pub window: Window,
}

impl ContactPlan {
    /// The segmentation in hardware, for the array and the largest number of contacts of `scene`.
    pub fn segmentation<'a>(&'a self, scene: &'a Scene) -> Segmentation<'a> {
        let (sensor, most) = (&scene.sensor, scene.partition.max_contacts);
        Segmentation { sensor, segmenter: &self.segmenter, most }
    }
}

/// A case that divides the array but was left out, because a design with it exceeds the board.
#[derive(Clone, Debug)]
pub struct Dropped {
    /// The case left out.
    pub case: Case,
    /// The design of the cases built and this one.
    pub design: Plan,
}

impl Plan {
    /// The plan of array `array` of those that this engine serves, alone; of an engine of one array the same plan. Formats and the
    /// meaning of a code are those of all arrays. `array` is below `hardware.arrays`.
    pub fn of_array(&self, array: usize) -> Plan {
        Plan {
            prepare: self.prepare.of_array(array),
            scene: self.scene.of_array(array),
            own: self.own.get(array).cloned().into_iter().collect(),
            ..self.clone()
        }
    }

    /// What the array has of its own; of several that of the first.
    pub fn own(&self) -> &OwnTables {
        &self.own[0]
    }

    /// The same, to change it.
    pub fn own_mut(&mut self) -> &mut OwnTables {
        &mut self.own[0]
    }

    /// A number of each array, as JSON: the number itself where there is one array.
    pub fn of_each_array(&self, of: impl Fn(&OwnTables) -> Value) -> Value {
        match self.own.as_slice() {
            [only] => of(only),
            several => several.iter().map(of).collect(),
        }
    }

    /// Noise floor in LSBs of a frame buffer word; of several arrays that of the first.
    pub fn noise_floor(&self) -> i32 {
        self.own().noise_floor
    }

    /// Threshold in force LSBs; of several arrays that of the first.
    pub fn threshold(&self) -> i64 {
        self.own().threshold
    }

    /// The cases built, case 0 first if there are several.
    pub fn cases(&self) -> &[CasePlan] {
        &self.cases
    }

    /// The first case.
    pub fn first(&self) -> &CasePlan {
        &self.cases[0]
    }

    /// The first case, to change what it holds.
    pub fn first_mut(&mut self) -> &mut CasePlan {
        &mut self.cases[0]
    }

    /// Widths and scales.
    pub fn formats(&self) -> &Formats {
        &self.first().formats
    }

    /// Quantised matrices.
    pub fn quantised(&self) -> &Quantised {
        &self.first().quantised
    }

    /// The coefficient memory's layout.
    pub fn storage(&self) -> &Storage {
        &self.first().storage
    }

    /// The subarrays, row-major.
    pub fn parts(&self) -> &[Subarray] {
        &self.first().parts
    }

    /// The quad layout of a subarray.
    pub fn layout(&self) -> Quads {
        self.first().layout()
    }

    /// Number of subarrays along the rows and along the columns.
    pub fn grid(&self) -> Grid {
        self.first().grid()
    }

    /// Number of status beats of a frame of the first case.
    pub fn status_beats(&self) -> usize {
        self.status_beats_of(self.first())
    }

    /// Number of status beats of a frame of a case: [`STATUS_BEATS`] per subarray, in the order of the subarrays, or for each
    /// contact that may have a μ of its own.
    pub fn status_beats_of(&self, case: &CasePlan) -> usize {
        match self.by_contact {
            Some(_) => STATUS_BEATS * self.scene.partition.max_contacts,
            None => case.status_beats(),
        }
    }

    /// Largest number of contacts with a μ of its own; 0 where there is one μ.
    pub fn contacts(&self) -> usize {
        self.by_contact.as_ref().map_or(0, |_| self.scene.partition.max_contacts)
    }

    /// Whether the hardware has several cases and chooses one per frame.
    pub fn chooses(&self) -> bool {
        self.cases.len() > 1
    }

    /// Whether the passes of a frame begin when its first row of subarrays has arrived, before the others: the parallel engine
    /// with several rows of subarrays, in one case.
    pub fn begins_with_first_row(&self) -> bool {
        self.board.engine == EngineKind::Parallel && !self.chooses() && self.grid().rows > 1
    }

    /// Codes of a frame that arrive after those with which its passes may begin.
    pub fn codes_after_begin(&self) -> usize {
        match self.begins_with_first_row() {
            true => self.scene.sensor.taxels() - self.first().layout().rows * self.scene.sensor.cols,
            false => 0,
        }
    }

    /// Subarrays along rows and columns of each case built, in the order of [`Plan::cases`].
    pub fn grids(&self) -> Vec<Grid> {
        self.cases.iter().map(CasePlan::grid).collect()
    }

    /// Index in [`Plan::cases`] of the case chosen for a frame of `codes`: one per taxel, row-major, `input_bits`
    /// wide.
    pub fn choose(&self, codes: &[i32]) -> usize {
        let mut seen = FrameStats::default();
        for (index, &code) in codes.iter().enumerate() {
            seen.add(&self.scene.sensor, index, code, self.noise_floor());
        }
        seen.choose(&self.grids(), self.scene.partition.condition, self.noise_floor())
    }

    /// Whether the hardware has a μ search: `search.mu_max` is above 0, and no network gives μ.
    pub fn searches(&self) -> bool {
        self.formats().searches()
    }

    /// Whether a network gives μ.
    pub fn has_network(&self) -> bool {
        self.formats().has_network()
    }

    /// Whether zero, gain, threshold and noise floor are written at run time.
    pub fn has_writable_tables(&self) -> bool {
        self.scene.hardware.has_writable_tables()
    }

    /// Width of a word on the input stream: with writable tables one bit more than a code, see
    /// [`load`](crate::fixed::stages::load).
    pub fn stream_bits(&self) -> u32 {
        self.formats().code_bits + u32::from(self.has_writable_tables())
    }

    /// Width of the noise floor on its way through the engine; one bit, 0, where it is built in. It has no sign: a word that
    /// is damaged is a floor too, above which no stress of 0 is.
    pub fn floor_bits(&self) -> u32 {
        match self.built_in_floor() {
            Some(_) => 1,
            None => self.formats().input_bits - 1,
        }
    }

    /// The noise floor in codes that is built in; `None` where it is written or each array has its own.
    pub fn built_in_floor(&self) -> Option<i32> {
        self.built_in(|own| own.noise_floor)
    }

    /// The threshold in force LSBs that is built in; `None` likewise.
    pub fn built_in_threshold(&self) -> Option<i64> {
        self.built_in(|own| own.threshold)
    }

    /// What `of` gives where it is neither written nor differs between arrays.
    fn built_in<T: PartialEq>(&self, of: impl Fn(&OwnTables) -> T) -> Option<T> {
        let first = of(self.own());
        let common = self.own.iter().all(|own| of(own) == first);
        (common && !self.has_writable_tables()).then_some(first)
    }

    /// Whether the scene asks for the coefficient check.
    pub fn has_coefficient_check(&self) -> bool {
        self.scene.hardware.coefficient_check == CoefficientCheck::Signature
    }

    /// Whether the output is one resultant per subarray or contact instead of a force per taxel.
    pub fn sends_resultants(&self) -> bool {
        self.scene.output.forces == ForceOutput::Resultants
    }

    /// Whose taxels each record of resultants sums; `None` where the output is a force per taxel.
    pub fn summed(&self) -> Option<Summed> {
        let summed = if self.by_contact.is_some() { Summed::Label } else { Summed::Subarray };
        self.sends_resultants().then_some(summed)
    }

    /// Number of records of resultants: one per subarray, or per label, of which there is one more than contacts.
    pub fn records(&self) -> usize {
        match self.contacts() {
            0 => self.parts().len(),
            most => most + 1,
        }
    }

    /// Number of output beats with labels, between forces and statuses; 0 where there is one μ, or a record of each contact.
    pub fn label_beats(&self) -> usize {
        match &self.by_contact {
            Some(_) if !self.sends_resultants() => label_beats(self.scene.sensor.taxels()),
            _ => 0,
        }
    }

    /// Timing of the scan by the hardware; `None` where codes come as a stream.
    pub fn scan_timing(&self) -> Option<Timing> {
        // Checked when the plan was made.
        let scan = self.scene.hardware.adc_scan?;
        Timing::new(&scan, self.scene.sensor.rows, self.board.clock_MHz).ok()
    }

    /// Number of output beats of a frame before its status: forces and labels, or resultants.
    pub fn force_beats(&self) -> usize {
        match self.summed() {
            Some(summed) => summed.beats() * self.records(),
            None => self.scene.sensor.taxels() + self.label_beats(),
        }
    }

    /// Number of output beats with forces of taxels, or with resultants: those before labels and status.
    pub fn force_triples(&self) -> usize {
        self.force_beats() - self.label_beats()
    }

    /// Number of output beats behind them: labels of contacts, then status.
    pub fn status_triples(&self) -> usize {
        self.label_beats() + self.status_beats()
    }

    /// Number of beats with codes after the status: those of a scan whose tables, zero and gain among them, are found from
    /// readings and written at run time.
    pub fn code_beats(&self) -> usize {
        match self.scene.hardware.adc_scan.is_some() && self.has_writable_tables() {
            true => self.scene.sensor.taxels().div_ceil(CODES_PER_BEAT),
            false => 0,
        }
    }

    /// Cycles by which the first beat of resultants is later than the first beat of forces would be.
    pub(in crate::fixed) fn resultants_delay(&self) -> u64 {
        match self.sends_resultants() {
            false => 0,
            true => self.scene.sensor.taxels() as u64 - 1 + resultants::LATENCY,
        }
    }

    /// N per LSB of a force word, for codes whose largest value means `full_scale_MPa`.
    pub fn force_lsb_N(&self, full_scale_MPa: f64) -> f64 {
        full_scale_MPa / self.prepare.largest() * 2f64.powi(self.formats().force_exponent)
    }
}

impl CasePlan {
    /// The quad layout of a subarray.
    pub fn layout(&self) -> Quads {
        let Subarray { rows, cols, .. } = self.parts[0];
        Quads { rows, cols }
    }

    /// Number of subarrays along the rows and along the columns.
    pub fn grid(&self) -> Grid {
        let Quads { rows, cols } = self.layout();
        let (last_row, last_col) = self.parts.last().map_or((0, 0), |part| (part.row0, part.col0));
        Grid { rows: last_row / rows + 1, cols: last_col / cols + 1 }
    }

    /// The paper's number of the case, 0 to 3; 0 for a partition that the paper does not number.
    pub fn number(&self) -> u32 {
        (0..4).find(|&number| Case::numbered(number) == Some(self.case)).unwrap_or(0) as u32
    }

    /// The words of the case in the coefficient memory: one coefficient per lane.
    pub fn memory(&self) -> Vec<Vec<i64>> {
        self.storage.memory(&self.formats, &self.quantised)
    }

    /// Number of status beats of a frame: [`STATUS_BEATS`] per subarray, in the order of the subarrays.
    pub fn status_beats(&self) -> usize {
        STATUS_BEATS * self.parts.len()
    }
}
