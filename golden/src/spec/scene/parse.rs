//! Parsing of scene text: the tables whose fields do not stand for themselves, and what goes beyond one field.

use super::declared::Declared;
use super::field::{choice, table, whole, Field, Kind, Member, Number, Optional, Table};
use super::reader::Reader;
use super::{
    Condition, FixedSpec, HardwareSpec, InputSpec, InverseKind, InverseSpec, MeanKind, Medium, OutputSpec,
    PartitionSpec, Scene, SceneError, SearchSpec, TableRange, ThresholdSpec, MAX_CONTACTS, SHORTEST_AVERAGE,
};
use crate::plain_words::of_toml;
use crate::spec::partition::{subarrays, Case, Grid};
use crate::spec::sensor::{Sensor, SensorError, MAX_LENGTH_MM, MAX_SIDE, MIN_SIDE};
use serde_json::{json, Value as Json};
use std::path::Path;
use toml::Value;

/// Longest scene name in characters; the name becomes part of file names and reports.
const LONGEST_NAME: usize = 64;

impl Scene {
    /// Reads a scene from TOML text. `origin` names the file in errors; its stem is the scene's name if the text has
    /// none, and its folder the place of calibration and tare files.
    ///
    /// ```
    /// use dermis_golden::spec::scene::Scene;
    ///
    /// let sensor = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n";
    /// let scene = Scene::parse(sensor, "mine.toml")?;
    /// assert_eq!((scene.name.as_str(), scene.fixed.input_bits), ("mine", 20));
    /// let error = Scene::parse(&format!("{sensor}[search]\nmu_max = 9"), "mine.toml").unwrap_err();
    /// assert!(error.to_string().starts_with("mine.toml: search.mu_max = 9 is not allowed"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Any [`SceneError`] except those of finding and reading a file.
    pub fn parse(text: &str, origin: &str) -> Result<Scene, SceneError> {
        let root: toml::Table = toml::from_str(text).map_err(|error| syntax(text, origin, &error))?;
        let reader = Reader::new(origin, &root);
        reader.check_names(Scene::fields())?;
        let sensor = sensor(&reader)?;
        let input = InputSpec::read(&reader)?;
        check_input(&reader, &input, &sensor)?;
        let mut scene = Scene {
            name: name(&reader, origin)?,
            medium: MediumFields::read(&reader)?.medium(&reader)?,
            partition: PartitionFields::read(&reader)?.partition(&reader, &sensor)?,
            search: SearchSpec::read(&reader)?,
            inverse: InverseSpec::read(&reader)?,
            threshold: ThresholdSpec::read(&reader)?,
            fixed: FixedSpec::read(&reader)?,
            hardware: HardwareSpec::read(&reader)?,
            input,
            output: OutputSpec::read(&reader)?,
            sensor,
        };
        check_inverse(&reader, &scene)?;
        check_table_range(&reader, &scene)?;
        check_arrays(&reader, &mut scene)?;
        Ok(scene)
    }

    /// The declarations of all fields, table by table.
    pub(super) fn declare(fields: &mut Vec<Declared>) {
        name_field().declare("name", &["Name in reports and files."], fields);
        SensorFields::declare(fields);
        MediumFields::declare(fields);
        PartitionFields::declare(fields);
        SearchSpec::declare(fields);
        InverseSpec::declare(fields);
        ThresholdSpec::declare(fields);
        FixedSpec::declare(fields);
        HardwareSpec::declare(fields);
        InputSpec::declare(fields);
        OutputSpec::declare(fields);
    }
}

fn syntax(text: &str, origin: &str, error: &toml::de::Error) -> SceneError {
    let (line, message) = of_toml(text, error);
    SceneError::Syntax { file: origin.to_string(), line, message }
}

/// A scene's name.
struct SceneName;

impl Kind for SceneName {
    type Value = String;

    fn read(&self, value: &Value, _: &str) -> Option<String> {
        value.as_str().filter(|name| is_name(name)).map(str::to_owned)
    }

    fn allowed(&self) -> String {
        format!(
            "1 to {LONGEST_NAME} letters, digits, '-', '_', '.' and spaces, without a dot in front or a space at either end"
        )
    }

    fn schema(&self) -> Json {
        json!({ "type": "string", "minLength": 1, "maxLength": LONGEST_NAME })
    }
}

fn name_field() -> Field<SceneName, Optional> {
    SceneName.optional("the file's name")
}

/// A name that is not stated is the file's, and as safe.
fn name(reader: &Reader, origin: &str) -> Result<String, SceneError> {
    if let Some(name) = name_field().read(reader, "name")? {
        return Ok(name);
    }
    let stem = Path::new(origin).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let value = Value::String(stem.into_owned());
    SceneName.read(&value, origin).ok_or_else(|| reader.wrong("name", &value, SceneName.allowed()))
}

/// Whether a name is safe in paths, reports and comments of generated files.
fn is_name(name: &str) -> bool {
    let tame = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
    !name.is_empty()
        && name.chars().count() <= LONGEST_NAME
        && name.chars().all(tame)
        && !name.starts_with('.')
        && name.trim() == name
}

table! {
    struct SensorFields in "sensor" {
        /// Rows of taxels.
        rows: usize = whole::<usize>(MIN_SIDE as u32, MAX_SIDE as u32).required();
        /// Columns of taxels.
        cols: usize = whole::<usize>(MIN_SIDE as u32, MAX_SIDE as u32).required();
        /// Distance in mm of neighbouring columns.
        pitch_x_mm: f64 = Number::UpTo(MAX_LENGTH_MM).required();
        /// Distance in mm of neighbouring rows.
        pitch_y_mm: f64 = Number::UpTo(MAX_LENGTH_MM).required();
        /// Thickness of the cover in mm: the depth at which stress is read.
        thickness_mm: f64 = Number::UpTo(MAX_LENGTH_MM).required();
    }
}

fn sensor(reader: &Reader) -> Result<Sensor, SceneError> {
    let SensorFields { rows, cols, pitch_x_mm, pitch_y_mm, thickness_mm } = SensorFields::read(reader)?;
    let sensor = Sensor { rows, cols, pitch_x_mm, pitch_y_mm, thickness_mm };
    // The lengths are in range, each by itself; their ratios are not yet.
    match sensor.check() {
        Ok(()) => Ok(sensor),
        Err(SensorError { field, allowed, .. }) => Err(reader.wrong_field(&format!("sensor.{field}"), allowed)),
    }
}

table! {
    struct MediumFields in "medium" {
        /// What lies between surface and taxels: an infinitely deep body, or a layer of the sensor's thickness on a rigid base.
        kind: Medium = choice(&[
            ("half-space", Medium::HalfSpace),
            ("bonded-layer", Medium::BondedLayer { poisson: Medium::ELASTOMER }),
        ])
        .or(Medium::HalfSpace);
        /// Poisson ratio of a bonded layer: of silicone and polyurethane 0.48, of foams 0.3 and less.
        poisson: Option<f64> = Medium::POISSON.optional("0.48 with `\"bonded-layer\"`");
    }
}

impl MediumFields {
    fn medium(self, reader: &Reader) -> Result<Medium, SceneError> {
        match (self.kind, self.poisson) {
            (Medium::HalfSpace, Some(_)) => {
                Err(reader.wrong_field("medium.poisson", "left out unless medium.kind = \"bonded-layer\""))
            }
            (Medium::BondedLayer { .. }, Some(poisson)) => Ok(Medium::BondedLayer { poisson }),
            (kind, None) => Ok(kind),
        }
    }
}

table! {
    struct PartitionFields in "partition" {
        /// Regions with a μ each: the paper's cases, the best of them per frame, or one region for each contact.
        case: Option<Case> = CaseName.optional("0").hardware("all but `\"contacts\"` with a search").page("partitions");
        /// Of `"adaptive"`: the cases to build.
        cases: Option<[bool; 4]> = CaseList.optional("all that fit").page("partitions");
        /// In place of a case: rows of subarrays.
        rows: Option<usize> = whole::<usize>(1, MOST_PARTS).optional("that of the case").page("partitions");
        /// In place of a case: columns of subarrays.
        cols: Option<usize> = whole::<usize>(1, MOST_PARTS).optional("that of the case").page("partitions");
        /// When a subarray is searched: where it is loaded, or, as in the paper, where compression and tension both exceed the
        /// noise.
        condition: Condition =
            choice(&[("loaded", Condition::Loaded), ("both-signs", Condition::BothSigns)]).or(Condition::Loaded);
        /// Of `"contacts"` with a network: how many contacts get a μ; of more those with the largest loads.
        max_contacts: Option<usize> = whole::<usize>(1, MAX_CONTACTS as u32).optional("8");
    }
}

/// Most rows or columns of subarrays.
const MOST_PARTS: u32 = (MAX_SIDE / MIN_SIDE) as u32;

/// One of the paper's cases, or a rule.
struct CaseName;

impl Kind for CaseName {
    type Value = Case;

    fn read(&self, value: &Value, _: &str) -> Option<Case> {
        match value {
            Value::Integer(number) => Case::numbered(*number),
            Value::String(name) if name == "adaptive" => Some(Case::Adaptive),
            Value::String(name) if name == "contacts" => Some(Case::Contacts),
            _ => None,
        }
    }

    fn allowed(&self) -> String {
        "0, 1, 2, 3, \"adaptive\" or \"contacts\"".to_owned()
    }

    fn schema(&self) -> Json {
        json!({ "enum": [0, 1, 2, 3, "adaptive", "contacts"] })
    }
}

/// Which of the cases 0 to 3 are listed.
struct CaseList;

impl Kind for CaseList {
    type Value = [bool; 4];

    fn read(&self, value: &Value, _: &str) -> Option<[bool; 4]> {
        let mut listed = [false; 4];
        for entry in value.as_array()? {
            let listed = listed.get_mut(usize::try_from(entry.as_integer()?).ok()?)?;
            if std::mem::replace(listed, true) {
                return None;
            }
        }
        (listed[0] && listed[1..].contains(&true)).then_some(listed)
    }

    fn allowed(&self) -> String {
        "a list of 0 and others of 1, 2 and 3, each once".to_owned()
    }

    fn schema(&self) -> Json {
        json!({ "type": "array", "items": { "enum": [0, 1, 2, 3] }, "contains": { "const": 0 }, "uniqueItems": true,
                "minItems": 2 })
    }
}

impl PartitionFields {
    fn partition(self, reader: &Reader, sensor: &Sensor) -> Result<PartitionSpec, SceneError> {
        let PartitionFields { case, cases, rows, cols, condition, max_contacts } = self;
        if max_contacts.is_some() && case != Some(Case::Contacts) {
            let allowed = "left out beside any case but \"contacts\"";
            return Err(reader.wrong_field("partition.max_contacts", allowed));
        }
        let spec = |case, listed| PartitionSpec {
            case,
            listed,
            condition,
            max_contacts: max_contacts.unwrap_or(MAX_CONTACTS),
        };
        if let Some(listed) = cases {
            if rows.or(cols).is_some() || case.is_some_and(|case| case != Case::Adaptive) {
                let allowed = "left out beside rows, cols and any case but \"adaptive\"";
                return Err(reader.wrong_field("partition.cases", allowed));
            }
            let numbered = (0..4).filter(|&number| listed[number as usize]).filter_map(Case::numbered);
            for case in numbered {
                subarrays(case, sensor).map_err(|error| {
                    reader.wrong_field("partition.cases", format!("partitions of {sensor} ({error})"))
                })?;
            }
            return Ok(spec(Case::Adaptive, Some(listed)));
        }
        let (field, case) = match (case, rows, cols) {
            (case, None, None) => ("partition.case", case.unwrap_or(Case::WHOLE)),
            (Some(_), _, _) => return Err(reader.wrong_field("partition.case", "left out beside rows and cols")),
            (None, Some(rows), Some(cols)) => ("partition.rows", Case::Grid(Grid { rows, cols })),
            (None, rows, _) => {
                let missing = if rows.is_some() { "partition.cols" } else { "partition.rows" };
                return Err(reader.missing(missing, whole::<usize>(1, MOST_PARTS).allowed()));
            }
        };
        if case.grid().is_some() {
            subarrays(case, sensor)
                .map_err(|error| reader.wrong_field(field, format!("a partition of {sensor} ({error})")))?;
        }
        Ok(spec(case, None))
    }
}

fn check_inverse(reader: &Reader, scene: &Scene) -> Result<(), SceneError> {
    if scene.inverse.kind == InverseKind::Exact && scene.inverse.level.is_some() {
        return Err(reader.wrong_field("inverse.level", "left out with inverse.kind = \"exact\""));
    }
    let FixedSpec { coef_bits, inverse_bits, .. } = scene.fixed;
    if inverse_bits < coef_bits {
        let allowed = format!("a whole number from {coef_bits} to 32, at least fixed.coef_bits");
        return Err(reader.wrong_field("fixed.inverse_bits", allowed));
    }
    Ok(())
}

/// Without writable tables a range has no meaning. The scene itself, with its dead taxels, is within it.
fn check_table_range(reader: &Reader, scene: &Scene) -> Result<(), SceneError> {
    let Scene { sensor, hardware, input, .. } = scene;
    let TableRange { thickness_mm, dead_taxels, .. } = hardware.table_range;
    if !hardware.has_writable_tables() && reader.value("hardware.table_range").is_some() {
        return Err(reader.wrong_field("hardware.table_range", "left out, or hardware.tables = \"writable\""));
    }
    if thickness_mm.is_some_and(|[least, most]| !(least..=most).contains(&sensor.thickness_mm)) {
        let allowed = format!("a range that contains sensor.thickness_mm = {}", sensor.thickness_mm);
        return Err(reader.wrong_field("hardware.table_range.thickness_mm", allowed));
    }
    let (dead, most) = (input.dead.len(), sensor.taxels() - 1);
    if dead_taxels > most || (1..dead).contains(&dead_taxels) {
        let allowed = format!("0, or a whole number from {dead} to {most}: input.dead has {dead}");
        return Err(reader.wrong_field("hardware.table_range.dead_taxels", allowed));
    }
    Ok(())
}

/// What each of several arrays has of its own is stated for all of them, in place of what they would have in common. What is
/// decided for all, such as an estimator, is decided for the largest noise.
fn check_arrays(reader: &Reader, scene: &mut Scene) -> Result<(), SceneError> {
    let HardwareSpec { arrays, array_noise_floors_MPa, array_min_forces_N, .. } = &scene.hardware;
    let of_each = [
        ("hardware.array_noise_floors_MPa", "search.noise_floor_MPa", array_noise_floors_MPa),
        ("hardware.array_min_forces_N", "threshold.min_force_N", array_min_forces_N),
    ];
    for (field, common, list) in of_each {
        if !list.is_empty() && reader.value(common).is_some() {
            return Err(reader.wrong_field(common, format!("left out beside {field}")));
        }
        if !list.is_empty() && (*arrays == 1 || list.len() != *arrays) {
            let allowed = match arrays {
                1 => "left out, or hardware.arrays above 1".to_owned(),
                _ => format!("a list of {arrays} numbers, one for each of hardware.arrays"),
            };
            return Err(reader.wrong_field(field, allowed));
        }
    }
    let largest = array_noise_floors_MPa.iter().copied().reduce(f64::max);
    scene.search.noise_floor_MPa = scene.search.noise_floor_MPa.or(largest);
    Ok(())
}

/// Dead taxels are of the array, and fewer than all; a mean that slides has several frames.
fn check_input(reader: &Reader, input: &InputSpec, sensor: &Sensor) -> Result<(), SceneError> {
    let (rows, cols) = (sensor.rows, sensor.cols);
    if input.dead.iter().any(|&[row, col]| row >= rows || col >= cols) || input.dead.len() == sensor.taxels() {
        let ranges = format!("row 0 to {}, col 0 to {}", rows - 1, cols - 1);
        return Err(reader.wrong_field("input.dead", format!("a list of [row, col], {ranges}, fewer than all taxels")));
    }
    if input.mean == MeanKind::Sliding && input.average == 0 {
        return Err(reader.wrong_field("input.mean", "\"block\", or input.average from 1 to 12"));
    }
    if input.mean == MeanKind::Adaptive && (1..=SHORTEST_AVERAGE).contains(&input.average) {
        let allowed = format!("0, or a whole number from {} to 12, with an adaptive mean", SHORTEST_AVERAGE + 1);
        return Err(reader.wrong_field("input.average", allowed));
    }
    Ok(())
}
