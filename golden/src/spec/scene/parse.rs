//! Parsing and checking scene text: the schema, and one function per table.

use super::adc_scan::{adc_scan, FIELDS as ADC_SCAN_FIELDS};
use super::estimator::FORMER_NAMES;
use super::reader::{number_of, Reader};
use super::{
    CoefficientCheck, Condition, EstimatorKind, FixedSpec, ForceOutput, Form, HardwareSpec, InputSpec, InverseKind,
    InverseSpec, MeanKind, Medium, ObjectiveKind, OutputSpec, PartitionSpec, RunningZero, Scene, SceneError,
    SearchSpec, TableRange, TableStorage, ThresholdSpec, Zero, MAX_CONTACTS, MISSING_SHARE, PLAUSIBLE_MPA,
};
use crate::spec::board::{Board, SEARCH_WIDTHS};
use crate::spec::link_kind::LinkKind;
use crate::spec::partition::{subarrays, Case, Grid};
use crate::spec::scene::MAX_FLOAT_DEGREE;
use crate::spec::sensor::{Sensor, SensorError, MAX_LENGTH_MM, MAX_SIDE, MIN_SIDE};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Tables and their fields; "" is the top level.
const SCHEMA: [(&str, &[&str]); 13] = [
    ("", &["name"]),
    ("sensor", &["rows", "cols", "pitch_x_mm", "pitch_y_mm", "thickness_mm"]),
    ("medium", &["kind", "poisson"]),
    ("partition", &["case", "cases", "condition", "rows", "cols", "max_contacts"]),
    ("search", &["estimator", "objective", "mu_max", "noise_floor_MPa", "form", "degree", "network", "deviations"]),
    ("inverse", &["kind", "level"]),
    ("threshold", &["min_force_N"]),
    ("fixed", &["input_bits", "data_bits", "coef_bits", "inverse_bits", "prune_bits", "lanes"]),
    ("hardware", &["board", "link", "coefficient_check", "estimator", "search_width", "tables", "source"]),
    ("hardware.adc_scan", &ADC_SCAN_FIELDS),
    ("hardware.table_range", &["gain", "thickness_mm", "dead_taxels"]),
    (
        "input",
        &[
            "full_scale_MPa",
            "average",
            "mean",
            "calibration",
            "tare",
            "dead",
            "unipolar",
            "gain_spread",
            "plausible_MPa",
            "missing_share",
            "zero",
            "zero_average",
            "zero_limit_MPa",
        ],
    ),
    ("output", &["forces"]),
];
/// Smallest mu_max above 0: with a smaller one, the powers of μ vanish in the hardware's words.
const LEAST_MU_MAX: f64 = 0.001;
/// Largest mu_max, above the friction of any elastic cover.
const LARGEST_MU_MAX: f64 = 2.0;
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
        let root: Table = toml::from_str(text).map_err(|error| syntax(text, origin, &error))?;
        let reader = Reader::new(origin, &root);
        reader.check_names(&SCHEMA)?;
        let sensor = sensor(&reader)?;
        let input = input(&reader, origin, &sensor)?;
        Ok(Scene {
            name: name(&reader, origin)?,
            medium: medium(&reader)?,
            partition: partition(&reader, &sensor)?,
            search: search(&reader, origin)?,
            inverse: inverse(&reader)?,
            threshold: threshold(&reader)?,
            fixed: fixed(&reader)?,
            hardware: hardware(&reader, origin, &sensor, input.dead.len())?,
            input,
            output: output(&reader)?,
            sensor,
        })
    }
}

fn syntax(text: &str, origin: &str, error: &toml::de::Error) -> SceneError {
    let end = error.span().map_or(0, |span| span.start.min(text.len()));
    SceneError::Syntax {
        file: origin.to_string(),
        line: 1 + text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count(),
        message: match error.message() {
            // The reader names a type of its own.
            wide if wide.contains("as i128") => "an integer has more than 64 bits".to_string(),
            message => message.to_string(),
        },
    }
}

fn name(reader: &Reader, origin: &str) -> Result<String, SceneError> {
    let stem = || {
        let stem = std::path::Path::new(origin).file_stem();
        Value::String(stem.map_or("scene".into(), |stem| stem.to_string_lossy().into_owned()))
    };
    let value = reader.value("name").cloned().unwrap_or_else(stem);
    match value.as_str() {
        Some(name) if is_name(name) => Ok(name.to_string()),
        _ => Err(reader.wrong(
            "name",
            &value,
            format!(
                "1 to {LONGEST_NAME} letters, digits, '-', '_', '.' and spaces, without a dot in front or a space at \
                 either end"
            ),
        )),
    }
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

fn sensor(reader: &Reader) -> Result<Sensor, SceneError> {
    let lines = |path| {
        let range = MIN_SIDE as i64..=MAX_SIDE as i64;
        // In range, so that the cast keeps the value.
        reader.integer(path, range, None).map(|lines| lines as usize)
    };
    let length = |path| {
        let allowed = format!("a number above 0, at most {MAX_LENGTH_MM}");
        let number = reader.number(path, |mm| mm > 0.0 && mm <= MAX_LENGTH_MM, &allowed)?;
        number.ok_or_else(|| reader.missing(path, allowed))
    };
    let sensor = Sensor {
        rows: lines("sensor.rows")?,
        cols: lines("sensor.cols")?,
        pitch_x_mm: length("sensor.pitch_x_mm")?,
        pitch_y_mm: length("sensor.pitch_y_mm")?,
        thickness_mm: length("sensor.thickness_mm")?,
    };
    // The lengths are in range, each by itself; their ratios are not yet.
    sensor.check().map(|()| sensor).map_err(|SensorError { field, allowed, .. }| {
        let path = format!("sensor.{field}");
        match reader.value(&path) {
            Some(value) => reader.wrong(&path, value, allowed),
            None => reader.missing(&path, allowed),
        }
    })
}

fn medium(reader: &Reader) -> Result<Medium, SceneError> {
    let layer = Medium::BondedLayer { poisson: Medium::ELASTOMER };
    let names = [("half-space", Medium::HalfSpace), ("bonded-layer", layer)];
    let kind = reader.choice("medium.kind", &names)?;
    let poisson = reader.number("medium.poisson", Medium::allows_poisson, Medium::POISSON_ALLOWED)?;
    match (kind, poisson, reader.value("medium.poisson")) {
        (Medium::HalfSpace, _, Some(value)) => {
            Err(reader.wrong("medium.poisson", value, "left out unless medium.kind = \"bonded-layer\""))
        }
        (Medium::BondedLayer { .. }, Some(poisson), _) => Ok(Medium::BondedLayer { poisson }),
        (kind, _, _) => Ok(kind),
    }
}

fn partition(reader: &Reader, sensor: &Sensor) -> Result<PartitionSpec, SceneError> {
    let names = [("loaded", Condition::Loaded), ("both-signs", Condition::BothSigns)];
    let condition = reader.choice("partition.condition", &names)?;
    let max_contacts = match reader.value("partition.max_contacts") {
        Some(value) if reader.value("partition.case").and_then(Value::as_str) != Some("contacts") => {
            return Err(reader.wrong("partition.max_contacts", value, "left out beside any case but \"contacts\""));
        }
        _ => reader.integer("partition.max_contacts", 1..=MAX_CONTACTS as i64, Some(MAX_CONTACTS as i64))? as usize,
    };
    let own = ["partition.rows", "partition.cols"].map(|path| reader.value(path));
    if let Some(value) = reader.value("partition.cases") {
        let listed = Some(listed_cases(reader, value, sensor)?);
        return Ok(PartitionSpec { case: Case::Adaptive, listed, condition, max_contacts });
    }
    let (field, case) = match (reader.value("partition.case"), own) {
        (None, [None, None]) => return Ok(PartitionSpec { condition, ..Default::default() }),
        (Some(value), [None, None]) => ("partition.case", named_case(reader, value)?),
        (None, _) => {
            let parts = |path| {
                let parts = reader.integer(path, 1..=(MAX_SIDE / MIN_SIDE) as i64, None)?;
                Ok::<_, SceneError>(parts as usize)
            };
            let (rows, cols) = (parts("partition.rows")?, parts("partition.cols")?);
            ("partition.rows", Case::Grid(Grid { rows, cols }))
        }
        (Some(value), _) => return Err(reader.wrong("partition.case", value, "left out beside rows and cols")),
    };
    if case.grid().is_some() {
        subarrays(case, sensor).map_err(|error| {
            let value = reader.value(field).unwrap_or(&Value::Boolean(false));
            reader.wrong(field, value, format!("a partition of {sensor} ({error})"))
        })?;
    }
    Ok(PartitionSpec { case, listed: None, condition, max_contacts })
}

/// The cases 0 to 3 that `partition.cases` lists.
fn listed_cases(reader: &Reader, value: &Value, sensor: &Sensor) -> Result<[bool; 4], SceneError> {
    let path = "partition.cases";
    let adaptive = |case: &Value| case.as_str() == Some("adaptive");
    if ["rows", "cols"].iter().any(|field| reader.value(&format!("partition.{field}")).is_some())
        || reader.value("partition.case").is_some_and(|case| !adaptive(case))
    {
        return Err(reader.wrong(path, value, "left out beside rows, cols and any case but \"adaptive\""));
    }
    let wrong = || reader.wrong(path, value, "a list of 0 and others of 1, 2 and 3, each once");
    let mut listed = [false; 4];
    for entry in value.as_array().ok_or_else(wrong)? {
        let number = entry.as_integer().filter(|number| (0..4).contains(number)).ok_or_else(wrong)?;
        // In range, so that the cast keeps the value.
        if std::mem::replace(&mut listed[number as usize], true) {
            return Err(wrong());
        }
        let case = Case::numbered(number).ok_or_else(wrong)?;
        let refused = |error| reader.wrong(path, value, format!("partitions of {sensor} ({error})"));
        subarrays(case, sensor).map_err(refused)?;
    }
    match listed {
        [true, rest @ ..] if rest.contains(&true) => Ok(listed),
        _ => Err(wrong()),
    }
}

fn named_case(reader: &Reader, value: &Value) -> Result<Case, SceneError> {
    let case = match value {
        Value::Integer(number) => Case::numbered(*number),
        Value::String(name) if name == "adaptive" => Some(Case::Adaptive),
        Value::String(name) if name == "contacts" => Some(Case::Contacts),
        _ => None,
    };
    case.ok_or_else(|| reader.wrong("partition.case", value, "0, 1, 2, 3, \"adaptive\" or \"contacts\""))
}

fn search(reader: &Reader, origin: &str) -> Result<SearchSpec, SceneError> {
    let default = SearchSpec::default();
    let allowed = format!("0, or a number from {LEAST_MU_MAX} to {LARGEST_MU_MAX}");
    let in_range = |mu| mu == 0.0 || (LEAST_MU_MAX..=LARGEST_MU_MAX).contains(&mu);
    let mu_max = reader.number("search.mu_max", in_range, &allowed)?;
    let floor = reader.number("search.noise_floor_MPa", |mpa| mpa >= 0.0, "a number of at least 0")?;
    Ok(SearchSpec {
        estimator: estimator(reader, "search.estimator", &EstimatorKind::NAMES)?,
        objective: reader.choice("search.objective", &ObjectiveKind::NAMES)?,
        mu_max: mu_max.unwrap_or(default.mu_max),
        noise_floor_MPa: floor,
        form: reader.choice("search.form", &[("oblique", Form::Oblique), ("orthogonal", Form::Orthogonal)])?,
        degree: degree(reader)?,
        network: file(reader, origin, "search.network")?,
        deviations: file(reader, origin, "search.deviations")?,
    })
}

/// A stated estimator. The error for a name of an earlier version says what takes its place.
fn estimator(
    reader: &Reader,
    path: &str,
    names: &[(&str, EstimatorKind)],
) -> Result<Option<EstimatorKind>, SceneError> {
    let Some(value) = reader.value(path) else { return Ok(None) };
    match FORMER_NAMES.iter().find(|(former, _)| value.as_str() == Some(former)) {
        Some((_, now)) => Err(reader.wrong(path, value, *now)),
        None => reader.one_of(path, value, names).map(Some),
    }
}

fn degree(reader: &Reader) -> Result<Option<usize>, SceneError> {
    let in_range =
        |value: &Value| usize::try_from(value.as_integer()?).ok().filter(|d| (1..=MAX_FLOAT_DEGREE).contains(d));
    reader.typed("search.degree", in_range, &format!("a whole number from 1 to {MAX_FLOAT_DEGREE}"))
}

fn inverse(reader: &Reader) -> Result<InverseSpec, SceneError> {
    let kind = reader.choice("inverse.kind", &InverseKind::NAMES)?;
    let level = reader.number("inverse.level", |level| level > 0.0 && level < 1.0, "a number above 0 and below 1")?;
    match (kind, reader.value("inverse.level")) {
        (InverseKind::Exact, Some(value)) => {
            Err(reader.wrong("inverse.level", value, "left out with inverse.kind = \"exact\""))
        }
        _ => Ok(InverseSpec { kind, level }),
    }
}

fn threshold(reader: &Reader) -> Result<ThresholdSpec, SceneError> {
    let force = reader.number("threshold.min_force_N", |n| n >= 0.0, "a number of at least 0")?;
    let default = ThresholdSpec::default().min_force_N;
    Ok(ThresholdSpec { min_force_N: force.unwrap_or(default) })
}

fn fixed(reader: &Reader) -> Result<FixedSpec, SceneError> {
    let default = FixedSpec::default();
    // All ranges are within u32.
    let bits = |path, range: RangeInclusive<i64>, default: u32| {
        let bits = reader.integer(path, range, Some(i64::from(default)))?;
        Ok::<_, SceneError>(bits as u32)
    };
    let coef_bits = bits("fixed.coef_bits", 8..=18, default.coef_bits)?;
    Ok(FixedSpec {
        input_bits: bits("fixed.input_bits", 8..=24, default.input_bits)?,
        data_bits: bits("fixed.data_bits", 12..=18, default.data_bits)?,
        coef_bits,
        inverse_bits: bits("fixed.inverse_bits", i64::from(coef_bits)..=32, default.inverse_bits)?,
        prune_bits: bits("fixed.prune_bits", 8..=31, default.prune_bits)?,
        lanes: lanes(reader)?,
    })
}

fn lanes(reader: &Reader) -> Result<Option<u32>, SceneError> {
    let read = |value: &Value| value.as_integer().filter(|n| (4..=1024).contains(n) && n % 4 == 0);
    // In range, so that the cast keeps the value.
    Ok(reader.typed("fixed.lanes", read, "a multiple of 4 from 4 to 1024")?.map(|lanes| lanes as u32))
}

fn hardware(reader: &Reader, origin: &str, sensor: &Sensor, dead: usize) -> Result<HardwareSpec, SceneError> {
    let tables = [("rom", TableStorage::Rom), ("writable", TableStorage::Writable)];
    let checks = [("none", CoefficientCheck::None), ("signature", CoefficientCheck::Signature)];
    Ok(HardwareSpec {
        board: board(reader, origin)?,
        link: reader.choice("hardware.link", &LinkKind::NAMES)?,
        coefficient_check: reader.choice("hardware.coefficient_check", &checks)?,
        estimator: estimator(reader, "hardware.estimator", &EstimatorKind::HARDWARE_NAMES)?,
        search_width: search_width(reader)?,
        tables: reader.choice("hardware.tables", &tables)?,
        table_range: table_range(reader, sensor, dead)?,
        adc_scan: adc_scan(reader, sensor)?,
    })
}

/// Without writable tables a range has no meaning. The scene itself, with its number of `dead` taxels, is within it.
fn table_range(reader: &Reader, sensor: &Sensor, dead: usize) -> Result<TableRange, SceneError> {
    let table = "hardware.table_range";
    if let (Some(value), None | Some("rom")) =
        (reader.value(table), reader.value("hardware.tables").map_or(Some("rom"), Value::as_str))
    {
        return Err(reader.wrong(table, value, "left out, or hardware.tables = \"writable\""));
    }
    let field = "hardware.table_range.thickness_mm";
    let thickness_mm = range(reader, field)?;
    let holds_own = |[least, most]: [f64; 2]| (least..=most).contains(&sensor.thickness_mm);
    if let (Some(value), Some(false)) = (reader.value(field), thickness_mm.map(holds_own)) {
        return Err(reader.wrong(
            field,
            value,
            format!("a range that contains sensor.thickness_mm = {}", sensor.thickness_mm),
        ));
    }
    let field = "hardware.table_range.dead_taxels";
    let most = sensor.taxels() - 1;
    // In range, so that the cast keeps the value.
    let dead_taxels = reader.integer(field, 0..=most as i64, Some(0))? as usize;
    if let Some(value) = reader.value(field).filter(|_| (1..dead).contains(&dead_taxels)) {
        return Err(reader.wrong(field, value, format!("{dead} to {most}: input.dead has {dead}")));
    }
    Ok(TableRange { gain: range(reader, "hardware.table_range.gain")?, thickness_mm, dead_taxels })
}

/// Two numbers above 0 in ascending order.
fn range(reader: &Reader, path: &str) -> Result<Option<[f64; 2]>, SceneError> {
    let read = |value: &Value| {
        let [least, most] = value.as_array()?.as_slice() else { return None };
        let range = [number_of(least)?, number_of(most)?];
        (0.0 < range[0] && range[0] <= range[1]).then_some(range)
    };
    reader.typed(path, read, "[least, largest], numbers above 0")
}

/// A built-in board's name, or the path of a file, which the scene gives relative to its own folder.
fn board(reader: &Reader, origin: &str) -> Result<String, SceneError> {
    let Some(value) = reader.value("hardware.board") else { return Ok(HardwareSpec::default().board) };
    match value.as_str() {
        Some(name) if Board::names().contains(&name) => Ok(name.to_owned()),
        Some(file) if Board::is_file(file) => Ok(Path::new(origin).with_file_name(file).display().to_string()),
        _ => {
            let names: Vec<_> = Board::names().into_iter().map(|name| format!("{name:?}")).collect();
            let own = "or the path of a board's file, which ends with .toml";
            Err(reader.wrong("hardware.board", value, format!("{}, {own}", names.join(" or "))))
        }
    }
}

fn search_width(reader: &Reader) -> Result<Option<usize>, SceneError> {
    let read = |value: &Value| usize::try_from(value.as_integer()?).ok().filter(|width| SEARCH_WIDTHS.contains(width));
    reader.typed("hardware.search_width", read, "4, 2 or 1")
}

fn input(reader: &Reader, origin: &str, sensor: &Sensor) -> Result<InputSpec, SceneError> {
    let spread = reader.number("input.gain_spread", |spread| (0.0..=1.0).contains(&spread), "a number from 0 to 1")?;
    let full_scale_MPa = reader.number("input.full_scale_MPa", |mpa| mpa > 0.0, "a number above 0")?;
    let plausible_MPa = reader.number("input.plausible_MPa", |mpa| mpa > 0.0, "a number above 0")?;
    let half = |share: f64| (0.0..=0.5).contains(&share);
    let missing_share = reader.number("input.missing_share", half, "a number from 0 to 0.5")?;
    // In range, so that the cast keeps the value.
    let average = reader.integer("input.average", 0..=12, Some(0))? as u32;
    Ok(InputSpec {
        full_scale_MPa,
        average,
        mean: mean(reader, average)?,
        calibration: file(reader, origin, "input.calibration")?,
        tare: file(reader, origin, "input.tare")?,
        dead: dead(reader, sensor)?,
        unipolar: reader.typed("input.unipolar", Value::as_bool, "true or false")?.unwrap_or(false),
        gain_spread: spread.unwrap_or(0.0),
        plausible_MPa: plausible_MPa.unwrap_or(PLAUSIBLE_MPA),
        missing_share: missing_share.unwrap_or(MISSING_SHARE),
        zero: zero(reader, full_scale_MPa)?,
    })
}

/// A fixed zero has neither rate nor limit. The limit of a running one is beyond the noise, so that noise is no touch.
fn zero(reader: &Reader, full_scale_MPa: Option<f64>) -> Result<Zero, SceneError> {
    let (path, limit) = ("input.zero", "input.zero_limit_MPa");
    let average = "input.zero_average";
    if !reader.choice(path, &[("fixed", false), ("running", true)])? {
        return match [average, limit].into_iter().find_map(|field| Some((field, reader.value(field)?))) {
            Some((field, value)) => Err(reader.wrong(field, value, "left out, or input.zero = \"running\"")),
            None => Ok(Zero::Fixed),
        };
    }
    // In range, so that the cast keeps the value.
    let average = reader.integer(average, 1..=16, Some(i64::from(RunningZero::AVERAGE)))? as u32;
    let noise_MPa = reader.value("search.noise_floor_MPa").and_then(number_of).unwrap_or(0.0);
    let least = RunningZero::LEAST_OVER_NOISE * noise_MPa;
    let in_range = |mpa: f64| mpa > 0.0 && mpa >= least && full_scale_MPa.is_none_or(|most| mpa <= most);
    let allowed = "a number above 0, at least 5 times search.noise_floor_MPa, at most input.full_scale_MPa";
    let stated = reader.number(limit, in_range, allowed)?;
    let by_full_scale = full_scale_MPa.map(|most| RunningZero::LIMIT_SHARE * most).filter(|mpa| in_range(*mpa));
    let limit_MPa = stated.or(by_full_scale).ok_or_else(|| reader.missing(limit, allowed))?;
    Ok(Zero::Running(RunningZero { average, limit_MPa }))
}

/// A sliding mean of one frame is no mean.
fn mean(reader: &Reader, average: u32) -> Result<MeanKind, SceneError> {
    let path = "input.mean";
    let kind = reader.choice(path, &[("block", MeanKind::Block), ("sliding", MeanKind::Sliding)])?;
    match (reader.value(path), average) {
        (Some(value), 0) if kind == MeanKind::Sliding => {
            Err(reader.wrong(path, value, "\"block\", or input.average from 1 to 12"))
        }
        _ => Ok(kind),
    }
}

/// A path relative to the folder of the scene's file.
fn file(reader: &Reader, origin: &str, field: &str) -> Result<Option<PathBuf>, SceneError> {
    match reader.value(field) {
        None => Ok(None),
        Some(Value::String(name)) if !name.is_empty() => Ok(Some(Path::new(origin).with_file_name(name))),
        Some(value) => Err(reader.wrong(field, value, "the name of a file")),
    }
}

fn dead(reader: &Reader, sensor: &Sensor) -> Result<Vec<[usize; 2]>, SceneError> {
    let path = "input.dead";
    let Some(value) = reader.value(path) else {
        return Ok(Vec::new());
    };
    let (rows, cols) = (sensor.rows, sensor.cols);
    let wrong = |value| {
        let ranges = format!("row 0 to {}, col 0 to {}", rows - 1, cols - 1);
        reader.wrong(path, value, format!("a list of [row, col], {ranges}, fewer than all taxels"))
    };
    let taxel = |value: &Value| {
        let [row, col] = value.as_array()?.as_slice() else { return None };
        let index =
            |value: &Value, count: usize| usize::try_from(value.as_integer()?).ok().filter(|index| *index < count);
        Some([index(row, rows)?, index(col, cols)?])
    };
    let list = value.as_array().ok_or_else(|| wrong(value))?;
    let mut dead = list.iter().map(|value| taxel(value).ok_or_else(|| wrong(value))).collect::<Result<Vec<_>, _>>()?;
    dead.sort_unstable();
    dead.dedup();
    if dead.len() == sensor.taxels() {
        return Err(wrong(value));
    }
    Ok(dead)
}

fn output(reader: &Reader) -> Result<OutputSpec, SceneError> {
    let names = [("taxels", ForceOutput::Taxels), ("resultants", ForceOutput::Resultants)];
    Ok(OutputSpec { forces: reader.choice("output.forces", &names)? })
}
