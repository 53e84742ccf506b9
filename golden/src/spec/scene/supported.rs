//! Supported: which values of the schema the golden model implements, and which the hardware and its bit-true model.
//!
//! | field | golden model | hardware, bit-true model |
//! |---|---|---|
//! | `partition.case` | all | 0 … 3, rows × cols, "adaptive" of two or more cases, if they fit the device; "contacts" with a network |
//! | `partition.condition` | all | with "contacts" "loaded" |
//! | `search.mu_max`, `output.forces` | all | with "adaptive" above 0 and "taxels" |
//! | `search.objective` | all; with "adaptive" and "contacts" "sparse" | "sparse" |
//! | `search.degree` | all | 1 … 3 |
//! | `search.estimator` | all, as below | any: the hardware has `hardware.estimator` |
//! | `hardware.estimator` | any: the model has `search.estimator` | "search", "network" |
//! | `search.form` | all, "orthogonal" up to [`crate::estimate::float::orthogonal::MAX_TAXELS`] taxels | "oblique" |
//! | `input.curve` | all | none |
//! | `input.template` | all | with an adaptive mean false, and `input.average` up to 6 |
//! | `input.dead` | all; with "orthogonal" none | with one subarray |
//! | `input.unipolar` | all; with "orthogonal" none | with a network |
//!
//! The estimators "evidence", "evidence+network" and "combined" take no objective but the default, no "orthogonal" form,
//! mu_max above 0, partition 0 or "contacts", since they find the contacts themselves, and a pitch of up to 3 thicknesses,
//! on a bonded layer 1.5. "network" takes case 0 of up to 144 taxels or "contacts", mu_max above 0, no "search_width", not
//! the serial engine.
//!
//! Dead taxels in hardware: Cz⁺, Ax and Ay are multiplied by Π ([`crate::physics::matrices::Matrices::without`]). The broken
//! mirror symmetry takes up to four products instead of one ([`crate::fixed::words::coefficients`]). A subarray with a
//! dead taxel needs its own matrices, while the subarrays of the engine share theirs: with several subarrays, dead
//! taxels are rejected.
//!
//! Writable tables: not with "adaptive" or the serial engine. Writable coefficients (`hardware.table_range.thickness_mm`,
//! `dead_taxels`): not with a network, which was trained for one cover, nor with the coefficient check, whose signatures are in
//! the bitstream; dead taxels with one subarray, as above.
//!
//! Several arrays: not with writable coefficients, which all have in common, nor with a scan or blocks of frames, of which each would
//! have to be told which array it is of.
//!
//! `hardware.source = "adc-scan"`: no dead taxels as tables, since a dead taxel's samples are told from others while they
//! are taken, no average of frames, `input_bits` for a result and a sign.
//!
//! `input.zero = "running"`: not the serial engine, which has no stage before `receive`; not behind a link, where a request that is
//! sent twice would count twice.
//!
//! Fields not listed are the same for both. Rules are checked in the order of the table, so a scene with several
//! rejected values always reports the same one.

use super::{
    CoefficientCheck, Condition, EstimatorKind, ForceOutput, Form, MeanKind, Medium, ObjectiveKind, Scene, SceneError,
    LONGEST_AVERAGE, SHORTEST_AVERAGE, TABLE_CODE_BITS,
};
use crate::spec::partition::Case;
use crate::spec::quads::Quads;
use crate::spec::scene::MAX_DEGREE;
use crate::spec::window::{Place, Window};

/// A value and whether it is rejected.
pub(super) struct Rule {
    refused: bool,
    field: &'static str,
    value: String,
    available: &'static str,
}

/// Largest pitch for the estimator "evidence" on a half-space, in thicknesses. At 2.9 its standard deviations hold; at 9,
/// between whose taxels a contact is not seen, its forces on sensor-4's frames were wrong by several times, without a
/// flag.
const LARGEST_PITCH: f64 = 3.0;
/// The same on a bonded layer, whose stress spreads less. At 1.33 the standard deviations hold; at 2 one frame in ten is
/// off by more than three of them.
const LARGEST_PITCH_BONDED: f64 = 1.5;

impl Scene {
    /// Checks that C for a microcontroller serves every value of a scene that hardware serves: one subarray with one μ, a
    /// frame at a time.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] for the first value that it does not serve.
    pub fn require_c(&self) -> Result<(), SceneError> {
        let input = &self.input;
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        let resultants = self.output.forces == ForceOutput::Resultants;
        self.require([
            rule(self.partition.case != Case::WHOLE, "partition.case", self.partition.case.to_string(), "0, in C"),
            rule(input.average > 0, "input.average", input.average.to_string(), "0, in C: average the readings before"),
            rule(
                input.slides(),
                "input.mean",
                input.mean.name().to_string(),
                "block, in C: average the readings before",
            ),
            rule(input.running_zero().is_some(), "input.zero", "running".to_string(), "fixed, in C"),
            rule(self.hardware.has_writable_tables(), "hardware.tables", writable(), "rom, in C"),
            rule(
                self.hardware.arrays > 1,
                "hardware.arrays",
                self.hardware.arrays.to_string(),
                "1, in C: build it for each array",
            ),
            rule(
                self.hardware.adc_scan.is_some(),
                "hardware.source",
                "adc-scan".to_string(),
                "stream, in C: it takes readings",
            ),
            rule(resultants, "output.forces", "resultants".to_string(), "taxels, in C: add up the forces"),
        ])
    }

    /// Checks that the hardware implements every value of the scene.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] for the first value that is valid but not implemented.
    pub fn require_supported(&self) -> Result<(), SceneError> {
        let (search, input) = (&self.search, &self.input);
        let several = self.partition.case == Case::Adaptive;
        let (arrays, adapts) = (self.hardware.arrays > 1, input.mean == MeanKind::Adaptive);
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        self.require([
            rule(
                self.partition.case == Case::Contacts && self.hardware_estimator() != EstimatorKind::Network,
                "partition.case",
                self.partition.case.to_string(),
                "0, 1, 2, 3, adaptive, rows and cols; contacts with hardware.estimator = network",
            ),
            rule(
                several && self.partition.choices(&self.sensor).len() < 2,
                "partition.case",
                self.partition.case.to_string(),
                "0: no other of the paper's cases divides the array",
            ),
            rule(
                self.partition.case == Case::Contacts && self.partition.condition == Condition::BothSigns,
                "partition.condition",
                "both-signs".to_string(),
                "loaded, with contacts",
            ),
            rule(several && search.mu_max == 0.0, "search.mu_max", "0".to_string(), "above 0, with adaptive"),
            rule(
                several && self.output.forces == ForceOutput::Resultants,
                "output.forces",
                "resultants".to_string(),
                "taxels, with adaptive",
            ),
            rule(
                several && self.hardware.search_width.is_some_and(|width| width < Quads::LANES),
                "hardware.search_width",
                self.hardware.search_width.unwrap_or_default().to_string(),
                "4, with adaptive",
            ),
            rule(
                search.objective != ObjectiveKind::Sparse,
                "search.objective",
                search.objective.name().to_string(),
                "sparse",
            ),
            rule(
                !EstimatorKind::HARDWARE_NAMES.iter().any(|(_, kind)| *kind == self.hardware_estimator()),
                "hardware.estimator",
                self.hardware_estimator().name().to_string(),
                "search, network",
            ),
            rule(search.form != Form::Oblique, "search.form", "orthogonal".to_string(), "oblique"),
            rule(
                search.degree.is_some_and(|degree| degree > MAX_DEGREE),
                "search.degree",
                search.degree.unwrap_or_default().to_string(),
                "1 to 3",
            ),
            rule(!input.curve.is_empty(), "input.curve", "[…]".to_string(), "none; a table of gains and offsets alone"),
            rule(adapts && input.template, "input.template", "true".to_string(), "false, with input.mean = adaptive"),
            rule(
                adapts && !(SHORTEST_AVERAGE + 1..=LONGEST_AVERAGE).contains(&input.longest_average()),
                "input.average",
                input.average.to_string(),
                "0, 3, 4, 5 or 6, with input.mean = adaptive",
            ),
            rule(
                !input.dead.is_empty() && !matches!(self.partition.case, Case::WHOLE | Case::Contacts),
                "input.dead",
                self.dead(),
                "none, or partition.case = 0 or contacts",
            ),
            rule(
                input.unipolar && self.hardware_estimator() != EstimatorKind::Network,
                "input.unipolar",
                "true".to_string(),
                "false, or hardware.estimator = network",
            ),
            rule(several && self.hardware.has_writable_tables(), "hardware.tables", writable(), "rom, with adaptive"),
            rule(
                arrays && self.hardware.has_writable_coefficients(),
                "hardware.arrays",
                self.hardware.arrays.to_string(),
                "1, with hardware.table_range.thickness_mm or dead_taxels: all arrays have the same coefficients",
            ),
            rule(
                several && !self.hardware.array_noise_floors_MPa.is_empty(),
                "hardware.array_noise_floors_MPa",
                "[…]".to_string(),
                "none, with adaptive",
            ),
            rule(
                arrays && self.hardware.adc_scan.is_some(),
                "hardware.source",
                "adc-scan".to_string(),
                "stream, with hardware.arrays above 1",
            ),
            rule(
                arrays && input.average > 0 && input.mean == MeanKind::Block,
                "input.average",
                input.average.to_string(),
                "0, with hardware.arrays above 1; or input.mean = sliding",
            ),
            rule(
                self.hardware.has_writable_coefficients() && self.hardware_estimator() == EstimatorKind::Network,
                "hardware.estimator",
                EstimatorKind::Network.name().to_string(),
                "search, with hardware.table_range.thickness_mm or dead_taxels: a network was trained for one cover",
            ),
            rule(
                self.hardware.has_writable_coefficients()
                    && self.hardware.coefficient_check == CoefficientCheck::Signature,
                "hardware.coefficient_check",
                "signature".to_string(),
                "none, with hardware.table_range.thickness_mm or dead_taxels: its signatures are in the bitstream",
            ),
            rule(
                self.hardware.has_writable_dead_taxels() && self.partition.case != Case::WHOLE,
                "hardware.table_range.dead_taxels",
                self.hardware.table_range.dead_taxels.to_string(),
                "0, or partition.case = 0",
            ),
            rule(
                self.hardware.has_writable_tables() && self.fixed.input_bits < TABLE_CODE_BITS,
                "fixed.input_bits",
                self.fixed.input_bits.to_string(),
                "at least 9 with hardware.tables = writable, whose bytes are no codes",
            ),
        ])?;
        self.require_scannable()?;
        match self.hardware_estimator() {
            EstimatorKind::Network => self.require_network(),
            _ => Ok(()),
        }
    }

    /// Checks that a scan by the hardware gives the codes that the scene asks for.
    fn require_scannable(&self) -> Result<(), SceneError> {
        let Some(scan) = &self.hardware.adc_scan else { return Ok(()) };
        let bits = self.fixed.input_bits;
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        self.require([
            rule(
                bits < scan.converter.magnitude_bits() + 1,
                "fixed.input_bits",
                bits.to_string(),
                "at least 13 with a max11125, 16 with an ads8688: a code holds a result and a sign",
            ),
            rule(
                self.input.longest_average() > 0,
                "input.average",
                self.input.longest_average().to_string(),
                "0 with adc-scan: hardware.adc_scan.samples averages",
            ),
            rule(
                self.hardware.has_writable_dead_taxels(),
                "hardware.table_range.dead_taxels",
                self.hardware.table_range.dead_taxels.to_string(),
                "0, with adc-scan",
            ),
        ])
    }

    /// Checks that a network can give the μ of the whole array and p(μ) be that of the series.
    ///
    /// # Errors
    /// [`SceneError`] with the first field that forbids it.
    pub fn require_network(&self) -> Result<(), SceneError> {
        let (search, sensor) = (&self.search, &self.sensor);
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        self.require([
            rule(
                !matches!(self.partition.case, Case::WHOLE | Case::Contacts),
                "partition.case",
                self.partition.case.to_string(),
                "0, with the estimator network",
            ),
            rule(
                self.partition.case == Case::WHOLE && Window::of(sensor).place != Place::Array,
                "sensor.rows",
                sensor.rows.to_string(),
                "with sensor.cols up to 144 taxels, with the estimator network",
            ),
            rule(search.mu_max == 0.0, "search.mu_max", "0".to_string(), "above 0, with the estimator network"),
            rule(
                self.hardware.search_width.is_some(),
                "hardware.search_width",
                self.hardware.search_width.unwrap_or_default().to_string(),
                "left out, with the estimator network: nothing is searched",
            ),
        ])
    }

    /// Checks that the serial engine, which implements less than the parallel one, implements every value of the scene.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] for the first value that is valid but not implemented.
    pub fn require_serial(&self) -> Result<(), SceneError> {
        let (sensor, input) = (&self.sensor, &self.input);
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        let even = "an even number on a board with the serial engine";
        let none = "none on a board with the serial engine";
        self.require([
            rule(
                self.hardware_estimator() == EstimatorKind::Network,
                "hardware.estimator",
                EstimatorKind::Network.name().to_string(),
                "search on a board with the serial engine",
            ),
            rule(sensor.rows % 2 != 0, "sensor.rows", sensor.rows.to_string(), even),
            rule(sensor.cols % 2 != 0, "sensor.cols", sensor.cols.to_string(), even),
            rule(
                self.partition.case.grid().is_none_or(|grid| grid.rows * grid.cols > 1),
                "partition.case",
                self.partition.case.to_string(),
                "0 on a board with the serial engine",
            ),
            rule(
                self.search.mu_max == 0.0,
                "search.mu_max",
                "0".to_string(),
                "above 0 on a board with the serial engine",
            ),
            rule(!input.dead.is_empty(), "input.dead", self.dead(), none),
            rule(input.average > 0, "input.average", input.average.to_string(), "0 on a board with the serial engine"),
            rule(
                input.mean == MeanKind::Adaptive,
                "input.mean",
                input.mean.name().to_string(),
                "block on a board with the serial engine",
            ),
            rule(input.calibration.is_some(), "input.calibration", path(&input.calibration), none),
            rule(input.tare.is_some(), "input.tare", path(&input.tare), none),
            rule(
                input.running_zero().is_some(),
                "input.zero",
                "running".to_string(),
                "fixed on a board with the serial engine",
            ),
            rule(
                self.output.forces == ForceOutput::Resultants,
                "output.forces",
                "resultants".to_string(),
                "taxels on a board with the serial engine",
            ),
            rule(
                self.hardware.coefficient_check == CoefficientCheck::Signature,
                "hardware.coefficient_check",
                "signature".to_string(),
                none,
            ),
            rule(
                self.hardware.has_writable_tables(),
                "hardware.tables",
                writable(),
                "rom on a board with the serial engine",
            ),
            rule(
                self.hardware.arrays > 1,
                "hardware.arrays",
                self.hardware.arrays.to_string(),
                "1 on a board with the serial engine",
            ),
            rule(
                self.hardware.search_width.is_some(),
                "hardware.search_width",
                self.hardware.search_width.unwrap_or_default().to_string(),
                none,
            ),
            rule(
                self.fixed.lanes.is_some_and(|lanes| lanes != 4),
                "fixed.lanes",
                self.fixed.lanes.unwrap_or_default().to_string(),
                "4 on a board with the serial engine",
            ),
        ])
    }

    /// Checks that the golden model, which implements more than the hardware, implements every value of the scene.
    ///
    /// # Errors
    /// [`SceneError::NotAvailable`] for the first value that is valid but not implemented.
    pub fn require_golden(&self) -> Result<(), SceneError> {
        let objective = self.search.objective;
        let literal = self.search.form == Form::Orthogonal;
        // Regions and the choice of a case are compared by the sparse objective.
        let by_contact = self.partition.case.grid().is_none();
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        let estimator = self.model_estimator();
        if let Some(refusal) = self.evidence_refusal().filter(|_| estimator.has_evidence()) {
            return self.require([refusal]);
        }
        if estimator == EstimatorKind::Network {
            self.require_network()?;
        }
        self.require([
            rule(
                by_contact && objective != ObjectiveKind::Sparse,
                "search.objective",
                objective.name().to_string(),
                "sparse, with partition.case = adaptive or contacts",
            ),
            rule(
                literal && !self.input.dead.is_empty(),
                "input.dead",
                self.dead(),
                "none, with search.form = orthogonal",
            ),
            rule(
                literal && self.input.unipolar,
                "input.unipolar",
                "true".to_string(),
                "false, with search.form = orthogonal",
            ),
        ])
    }

    /// The first value that the estimator `evidence` does not implement.
    pub(super) fn evidence_refusal(&self) -> Option<Rule> {
        let Scene { search, partition, sensor, .. } = self;
        let rule = |refused, field, value, available| Rule { refused, field, value, available };
        let (largest_pitch, thick_enough) = match self.medium {
            Medium::HalfSpace => (LARGEST_PITCH, "at least a third of the larger pitch, with the estimator evidence"),
            Medium::BondedLayer { .. } => (
                LARGEST_PITCH_BONDED,
                "on a bonded layer at least two thirds of the larger pitch, with the estimator evidence",
            ),
        };
        let rules = [
            rule(
                sensor.pitch_x_mm.max(sensor.pitch_y_mm) > largest_pitch * sensor.thickness_mm,
                "sensor.thickness_mm",
                sensor.thickness_mm.to_string(),
                thick_enough,
            ),
            rule(
                !matches!(partition.case, Case::WHOLE | Case::Contacts),
                "partition.case",
                partition.case.to_string(),
                "0 or contacts, with the estimator evidence",
            ),
            rule(
                search.objective != ObjectiveKind::Sparse,
                "search.objective",
                search.objective.name().to_string(),
                "left out, with the estimator evidence",
            ),
            rule(search.mu_max == 0.0, "search.mu_max", "0".to_string(), "above 0, with the estimator evidence"),
            rule(
                search.form != Form::Oblique,
                "search.form",
                "orthogonal".to_string(),
                "oblique, with the estimator evidence",
            ),
        ];
        rules.into_iter().find(|rule| rule.refused)
    }

    /// The error of the first rule that rejects its value.
    fn require<const N: usize>(&self, rules: [Rule; N]) -> Result<(), SceneError> {
        let refusal = |Rule { field, value, available, .. }| {
            let scene = self.name.clone();
            SceneError::NotAvailable { scene, field, value, available }
        };
        rules.into_iter().find(|rule| rule.refused).map_or(Ok(()), |rule| Err(refusal(rule)))
    }

    /// The input option, if any, that needs `input.full_scale_MPa` in hardware because its words are relative to it.
    pub(crate) fn scaled_input(&self) -> Option<&'static str> {
        let input = &self.input;
        let options = [
            ("input.calibration", input.calibration.is_some()),
            ("input.tare", input.tare.is_some()),
            ("hardware.tables", self.hardware.has_writable_tables()),
            ("hardware.source", self.hardware.adc_scan.is_some()),
            ("input.zero", self.input.running_zero().is_some()),
        ];
        options.into_iter().find(|(_, set)| *set).map(|(field, _)| field)
    }

    /// The value of that option, for messages.
    pub(crate) fn field_value(&self, field: &str) -> String {
        match field {
            "input.calibration" => path(&self.input.calibration),
            "hardware.tables" => writable(),
            "hardware.source" => "adc-scan".to_string(),
            "input.zero" => "running".to_string(),
            _ => path(&self.input.tare),
        }
    }

    /// Dead taxels, for messages: the first one represents all.
    fn dead(&self) -> String {
        match self.input.dead.as_slice() {
            [] => "[]".to_string(),
            [one] => format!("[{one:?}]"),
            [first, ..] => format!("[{first:?}, …]"),
        }
    }
}

/// The value of `hardware.tables` that some scenes cannot have, for messages.
fn writable() -> String {
    "writable".to_string()
}

fn path(file: &Option<std::path::PathBuf>) -> String {
    file.as_ref().map(|path| format!("{path:?}")).unwrap_or_default()
}
