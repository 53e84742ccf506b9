//! `dermis new`: a scene for a new sensor, as a commented file.
//!
//! What the options leave out is asked on a terminal; elsewhere the missing option is an error. The scene is written only
//! if it can be read back and the floating-point model takes it.

use std::fmt::Write as _;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{anyhow, bail, Result};
use clap::{Args, ValueEnum};
use dermis_golden::estimate::float::Golden;
use dermis_golden::estimate::learned::Learned;
use dermis_golden::spec::board::{Board, EngineKind};
use dermis_golden::spec::scene::{Medium, Scene};
use dermis_golden::write::write;

/// Arguments of `dermis new`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis new pad.toml --rows 12 --cols 10 --pitch 3 --thickness 2.5
  dermis new strip.toml --rows 4 --cols 20 --pitch 5,4 --thickness 3 --noise 0.0002 --full-scale 0.25
  dermis new skin.toml --rows 8 --cols 8 --pitch 4 --thickness 4 --poisson 0.45 --friction 0.5
  dermis new block.toml --rows 8 --cols 8 --pitch 4 --thickness 6 --cover free

The cover of nearly every array is bonded to a rigid base, so that is the default: read as a free one, the shear is wrong by
half and more. `dermis check` says what the other one would cost. On a terminal, what is left out is asked; an existing file is not replaced.")]
pub struct Arguments {
    /// File to write; its name without the ending is the scene's.
    file: PathBuf,
    /// Rows of taxels.
    #[arg(long)]
    rows: Option<usize>,
    /// Columns of taxels.
    #[arg(long)]
    cols: Option<usize>,
    /// Distance of the taxels in mm along columns and rows; one number: the same along both.
    #[arg(long, value_name = "X,Y")]
    pitch: Option<Pitch>,
    /// Thickness of the cover in mm, which is the depth of the taxels.
    #[arg(long, value_name = "MM")]
    thickness: Option<f64>,
    /// Standard deviation of one reading in MPa.
    #[arg(long, value_name = "MPA")]
    noise: Option<f64>,
    /// Stress of the largest reading in MPa.
    #[arg(long, value_name = "MPA")]
    full_scale: Option<f64>,
    /// Whether readings go below zero in tension; FSR mats, other piezoresistive and most capacitive arrays read pressure alone.
    #[arg(long, value_enum)]
    tension: Option<Tension>,
    /// Largest ratio of shear to normal force.
    #[arg(long, value_name = "MU")]
    friction: Option<f64>,
    /// How the cover is held; default: bonded.
    #[arg(long, value_enum)]
    cover: Option<Cover>,
    /// Poisson ratio of a bonded cover; default: 0.48, that of silicone and polyurethane; foams have 0.3 and less.
    #[arg(long, value_name = "RATIO")]
    poisson: Option<f64>,
    /// Board for the hardware: a name that `dermis boards` lists, or the path of a file that ends with .toml.
    #[arg(long, value_name = "BOARD")]
    board: Option<String>,
}

/// How the cover is held.
#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Cover {
    /// Glued or moulded to a rigid base with the taxels.
    #[default]
    Bonded,
    /// Not glued, or many pitches thick above taxels on which it continues: a half-space.
    Free,
}

/// Whether an array reads tension.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Tension {
    /// Readings go below zero where the cover pulls.
    Yes,
    /// They stay at zero: `input.unipolar`.
    No,
}

/// One of the values of an option as an answer, in small letters or capitals.
struct Choice<T>(T);

impl<T: ValueEnum> FromStr for Choice<T> {
    type Err = String;

    fn from_str(text: &str) -> Result<Choice<T>, String> {
        T::from_str(text, true).map(Choice)
    }
}

/// Distance of the taxels in mm along columns and rows.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pitch([f64; 2]);

impl FromStr for Pitch {
    type Err = String;

    fn from_str(text: &str) -> Result<Pitch, String> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some([both]) => Ok(Pitch([*both; 2])),
            Some([x, y]) => Ok(Pitch([*x, *y])),
            _ => Err("one number in mm, or two separated by a comma".to_owned()),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// A missing option where nothing can be asked, a value out of range, a scene that the floating-point model refuses, a
/// file that exists or cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let file = arguments.file.display().to_string();
    if arguments.file.exists() {
        bail!("{file}: exists already; dermis check {} says what it contains", shown(&file));
    }
    let stdin = std::io::stdin();
    let text = match stdin.is_terminal() {
        true => scene_text(arguments, &mut Asker::Terminal(&mut stdin.lock(), &mut std::io::stderr()))?,
        false => scene_text(arguments, &mut Asker::Nobody)?,
    };
    // Refused here with the field's name, rather than written.
    Golden::new(&Scene::parse(&text, &file)?).map_err(|error| anyhow!("{file}: {error}"))?;
    write(&arguments.file, text.as_bytes())?;
    Ok(format!("{file}\nnext: dermis check {}\n", shown(&file)))
}

/// A path as a shell takes it.
fn shown(path: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=".contains(c);
    match path.chars().all(is_plain) {
        true => path.to_owned(),
        false => format!("'{}'", path.replace('\'', "'\\''")),
    }
}

/// Where missing values come from.
enum Asker<'a> {
    /// Questions and answers.
    Terminal(&'a mut dyn BufRead, &'a mut dyn Write),
    /// A missing value is an error.
    Nobody,
}

impl Asker<'_> {
    /// The value of an option that a scene needs.
    fn required<T: FromStr + Clone>(&mut self, given: &Option<T>, option: &str, question: &str) -> Result<T> {
        match given {
            Some(value) => Ok(value.clone()),
            None => self.ask(question)?.ok_or_else(|| anyhow!("--{option} is missing: {question}")),
        }
    }

    /// The value of an option that a scene can do without; an empty answer leaves it out.
    fn optional<T: FromStr + Clone>(&mut self, given: &Option<T>, question: &str) -> Result<Option<T>> {
        match given {
            Some(value) => Ok(Some(value.clone())),
            None => self.ask(&format!("{question}; empty: unknown")),
        }
    }

    /// The value of an option that is one of several; `None` for an empty answer.
    fn choice<T: ValueEnum>(&mut self, given: Option<T>, question: &str) -> Result<Option<T>> {
        match given {
            Some(value) => Ok(Some(value)),
            None => Ok(self.ask(question)?.map(|Choice(value)| value)),
        }
    }

    /// Asks until the answer can be read; `None` for an empty one, or without a terminal.
    fn ask<T: FromStr>(&mut self, question: &str) -> Result<Option<T>> {
        let Asker::Terminal(input, output) = self else { return Ok(None) };
        loop {
            write!(output, "{question}: ").and_then(|()| output.flush())?;
            let mut line = String::new();
            if input.read_line(&mut line)? == 0 || line.trim().is_empty() {
                return Ok(None);
            }
            match line.trim().parse() {
                Ok(value) => return Ok(Some(value)),
                Err(_) => writeln!(output, "{:?} is not understood", line.trim())?,
            }
        }
    }
}

/// Axes, signs and the first taxel, as the guide's page "your sensor" has them.
const AXES: [&str; 5] = [
    "            column 0   1   2",
    "     row 0         o---.---.--> x    o: the first reading of a frame, row 0 and column 0",
    "         1         |   .   .         seen from above: x to the right, from column to column;",
    "         2         v   .   .         y down, from row to row",
    "                   y                 normal stress and force are positive in pressure, forces act on the cover",
];

/// The scene as a commented file.
fn scene_text(arguments: &Arguments, asker: &mut Asker) -> Result<String> {
    let rows = asker.required(&arguments.rows, "rows", "number of rows")?;
    let cols = asker.required(&arguments.cols, "cols", "number of columns")?;
    let Pitch([x, y]) =
        asker.required(&arguments.pitch, "pitch", "pitch in mm, along columns and rows: X,Y or one number")?;
    let thickness = asker.required(&arguments.thickness, "thickness", "thickness of the cover in mm")?;
    let medium = medium_fields(arguments, asker)?;
    let noise = asker.optional(&arguments.noise, "standard deviation of one reading in MPa")?;
    let full_scale = asker.optional(&arguments.full_scale, "stress of the largest reading in MPa")?;
    let tension =
        "whether readings go below zero in tension, yes or no; most arrays, as of FSR, read pressure alone; empty: unknown";
    let unipolar = asker.choice(arguments.tension, tension)?.map(|reads| (reads == Tension::No).to_string());
    let number = |value: f64| Some(format!("{value:?}"));
    let board = arguments.board.as_deref().map(|board| board_beside(board, &arguments.file)).transpose()?;
    let of_board = board.map(|board| ("board", Some(format!("{board:?}"))));
    let tables = |network: Option<&str>| {
        let quoted = |text: &str| Some(format!("{text:?}"));
        let of_network = network.map(|name| ("network", quoted(name)));
        let in_hardware = network.map(|_| ("estimator", quoted("network")));
        let search = [("mu_max", arguments.friction.and_then(number)), ("noise_floor_MPa", noise.and_then(number))];
        [
            (
                "sensor",
                vec![
                    ("rows", Some(rows.to_string())),
                    ("cols", Some(cols.to_string())),
                    ("pitch_x_mm", number(x)),
                    ("pitch_y_mm", number(y)),
                    ("thickness_mm", number(thickness)),
                ],
            ),
            ("medium", medium.clone()),
            ("search", search.into_iter().chain(of_network).collect()),
            (
                "input",
                vec![
                    ("full_scale_MPa", full_scale.and_then(number)),
                    ("unipolar", unipolar.clone()),
                    ("calibration", None),
                    ("tare", None),
                    ("dead", None),
                ],
            ),
            ("hardware", of_board.clone().into_iter().chain(in_hardware).collect()),
        ]
    };
    let scene = Scene::parse(&text_of(&tables(None))?, "the new scene").ok();
    text_of(&tables(scene.as_ref().and_then(network)))
}

/// The network of the program for the hardware of a scene; `None` without one, without noise, where the search is more accurate, and on
/// a board whose engine takes none.
fn network(scene: &Scene) -> Option<&'static str> {
    let board = Board::load(scene.hardware.board_name()).ok()?;
    let takes_one = board.engine == EngineKind::Parallel && scene.search.noise_floor_MPa != Some(0.0);
    takes_one.then(|| Learned::serving(scene))?
}

/// A table of a scene with its fields, of which some have no value.
type Table = (&'static str, Vec<(&'static str, Option<String>)>);

/// The text of a scene of these tables; one without fields is left out.
fn text_of(tables: &[Table]) -> Result<String> {
    let mut text =
        "# Written by `dermis new`. Fields left out have the defaults of the guide's page \"your sensor\".\n"
            .to_owned();
    AXES.iter().for_each(|line| text += &format!("# {line}\n"));
    for (table, lines) in tables.iter().filter(|(_, lines)| !lines.is_empty()) {
        writeln!(text, "\n[{table}]")?;
        for (field, value) in lines {
            writeln!(text, "{}", line(&format!("{table}.{field}"), value.clone())?)?;
        }
    }
    Ok(text)
}

/// A line of the scene: the field with its value and meaning; without a value what it is without it, as a comment.
fn line(path: &str, value: Option<String>) -> Result<String> {
    let known = Scene::fields().iter().find(|field| field.path == path);
    let field = known.ok_or_else(|| anyhow!("a scene has no field {path}"))?;
    let name = path.rsplit_once('.').map_or(path, |(_, name)| name);
    let (setting, note) = match (value, field.schema.get("default"), &field.without) {
        (Some(value), ..) => (format!("{name} = {value}"), String::new()),
        (None, Some(default), _) => (format!("# {name} = {default}"), String::new()),
        (None, None, without) => {
            (format!("# {name} ="), format!(" Without it: {}.", without.as_deref().unwrap_or("an error")))
        }
    };
    Ok(format!("{setting:<22} # {}{note}", field.meaning))
}

/// The fields of the medium.
///
/// # Errors
/// A Poisson ratio of a free cover.
fn medium_fields(arguments: &Arguments, asker: &mut Asker) -> Result<Vec<(&'static str, Option<String>)>> {
    let question = "how the cover is held, bonded to a rigid base or free; empty: bonded, as nearly every array has it";
    let cover = asker.choice(arguments.cover, question)?.unwrap_or_default();
    let kind = |name: &str| ("kind", Some(format!("{name:?}")));
    match (cover, arguments.poisson) {
        (Cover::Bonded, poisson) => {
            let poisson = poisson.unwrap_or(Medium::ELASTOMER);
            Ok(vec![kind("bonded-layer"), ("poisson", Some(format!("{poisson:?}")))])
        }
        (Cover::Free, None) => Ok(vec![kind("half-space")]),
        (Cover::Free, Some(poisson)) => {
            bail!("--poisson {poisson}: only with --cover bonded; stress under a free cover does not depend on it")
        }
    }
}

/// The board as the scene `file` names it: the path of a board's file relative to the scene's folder, where that is the
/// working folder, else absolute.
fn board_beside(board: &str, file: &Path) -> Result<String> {
    let here = file.parent().is_none_or(|folder| folder.as_os_str().is_empty());
    if here || !Board::is_file(board) {
        return Ok(board.to_owned());
    }
    let path = std::path::absolute(board).map_err(|error| anyhow!("--board {board}: {error}"))?;
    Ok(path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use dermis_golden::fixed::Model;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        arguments: Arguments,
    }

    /// The text for some options and answers, and the questions.
    fn written(options: &[&str], answers: &str) -> (Result<String>, String) {
        let arguments = Command::parse_from([&["new", "pad.toml"], options].concat()).arguments;
        let (mut input, mut output) = (answers.as_bytes(), Vec::new());
        let text = scene_text(&arguments, &mut Asker::Terminal(&mut input, &mut output));
        (text, String::from_utf8(output).unwrap())
    }

    #[test]
    fn answers_and_options_give_the_same_scene() {
        let options = ["--rows", "4", "--cols", "6", "--pitch", "3,2.5", "--thickness", "2", "--noise", "0.001"];
        let (by_options, questions) = written(&[&options[..], &["--cover", "free"]].concat(), "");
        let tension =
            "whether readings go below zero in tension, yes or no; most arrays, as of FSR, read pressure alone";
        let asked = format!("stress of the largest reading in MPa; empty: unknown: {tension}; empty: unknown: ");
        assert_eq!(questions, asked);
        let (by_answers, questions) = written(&[], "4\nsix\n6\n3,2.5\n2\nfree\n0.001\n\n\n");
        assert!(questions.contains("number of columns: \"six\" is not understood\nnumber of columns: "), "{questions}");
        let text = by_options.unwrap();
        assert_eq!(text, by_answers.unwrap());
        let scene = Scene::parse(&text, "pad.toml").unwrap();
        assert_eq!((scene.sensor.rows, scene.sensor.cols, scene.sensor.pitch_y_mm), (4, 6, 2.5));
        assert_eq!((scene.search.noise_floor_MPa(), scene.input.full_scale_MPa), (0.001, None));
    }

    #[test]
    fn every_option_reaches_the_scene_and_comments_hold_the_defaults() {
        let needed = ["--rows", "4", "--cols", "4", "--pitch", "4", "--thickness", "4"];
        let more = ["--full-scale", "0.3", "--friction", "0.4", "--poisson", "0.45", "--board", "icebreaker"];
        let scene = Scene::parse(&written(&[needed, more].concat(), "").0.unwrap(), "pad.toml").unwrap();
        assert_eq!((scene.input.full_scale_MPa, scene.search.mu_max), (Some(0.3), 0.4));
        assert_eq!(
            (scene.hardware.board_name(), scene.medium.to_string().as_str()),
            ("icebreaker", "bonded-layer, poisson 0.45")
        );
        // The file of a board is found from the scene's folder.
        let beside = |file: &str| board_beside("boards/own.toml", Path::new(file)).unwrap();
        assert_eq!(beside("pad.toml"), "boards/own.toml");
        let absolute = std::env::current_dir().unwrap().join("boards/own.toml").display().to_string();
        assert_eq!(beside("scenes/pad.toml"), absolute);
        let parsed = |options: &[&str], answers: &str| {
            Scene::parse(&written(&[&needed, options].concat(), answers).0.unwrap(), "pad.toml").unwrap()
        };
        let free = parsed(&["--cover", "free"], "");
        assert_eq!(free, Scene::of_sensor(&free.sensor, "pad"));
        let medium = Medium::BondedLayer { poisson: 0.48 };
        // Nothing said, an empty answer, an answer.
        for (options, answers) in [(&[][..], ""), (&[], "\n"), (&[], "Bonded\n"), (&["--cover", "bonded"], "")] {
            let found = parsed(options, answers);
            assert_eq!(found.medium, medium, "{options:?} {answers:?}");
            // Fields of the network aside.
            let (search, hardware) = (free.search.clone(), free.hardware.clone());
            assert_eq!(
                Scene { search, hardware, ..found },
                Scene { medium, ..free.clone() },
                "{options:?} {answers:?}"
            );
        }
        // Two questions before it: noise and full scale.
        for (options, answers, unipolar) in [
            (&[][..], "\n\n\n\n", false),
            (&[], "\n\n\nno\n", true),
            (&[], "\n\n\nYes\n", false),
            (&["--tension", "no"], "", true),
            (&["--tension", "yes"], "", false),
        ] {
            assert_eq!(parsed(options, answers).input.unipolar, unipolar, "{options:?} {answers:?}");
        }
        let refused = written(&[&needed[..], &["--cover", "free", "--poisson", "0.4"]].concat(), "").0.unwrap_err();
        assert!(refused.to_string().starts_with("--poisson 0.4: only with --cover bonded"), "{refused}");
    }

    /// A network that serves the sensor is named where there is one, and the hardware has it; the scene is one that the hardware takes.
    #[test]
    fn a_network_of_the_program_is_named_where_one_serves_the_sensor() {
        let of = |size: [&str; 2], more: &[&str]| {
            let needed = ["--rows", size[0], "--cols", size[1], "--pitch", "3", "--thickness", "2.5"];
            let scene = Scene::parse(&written(&[&needed, more].concat(), "").0.unwrap(), "pad.toml").unwrap();
            let name = scene.search.network.as_ref().map(|path| path.to_string_lossy().into_owned());
            assert_eq!(scene.hardware.estimator.is_some(), name.is_some());
            if name.is_some() {
                Model::new(&scene).unwrap();
            }
            name
        };
        let bonded = Some("dermis:bonded".to_owned());
        assert_eq!(of(["8", "10"], &[]), bonded);
        assert_eq!(of(["12", "6"], &["--noise", "0.0002", "--full-scale", "0.2"]), bonded);
        assert_eq!(of(["8", "8"], &["--tension", "no"]), Some("dermis:bonded-unipolar".to_owned()));
        for more in [
            &["--cover", "free"][..],
            &["--friction", "0.4"],
            &["--noise", "0"],
            &["--board", "icebreaker"],
            &["--poisson", "0.2"],
        ] {
            assert_eq!(of(["8", "10"], more), None, "{more:?}");
        }
        assert_eq!((of(["9", "10"], &[]), of(["14", "14"], &[]), of(["4", "4"], &[])), (None, None, None));
    }

    #[test]
    fn without_a_terminal_the_missing_option_is_named() {
        let arguments = Command::parse_from(["new", "pad.toml", "--rows", "4"]).arguments;
        let error = scene_text(&arguments, &mut Asker::Nobody).unwrap_err().to_string();
        assert_eq!(error, "--cols is missing: number of columns");
        assert!(written(&["--rows", "4"], "4\n").0.unwrap_err().to_string().starts_with("--pitch is missing"));
    }

    #[test]
    fn axes_are_those_of_the_guide_and_of_the_model() {
        let text = written(&["--rows", "4", "--cols", "4", "--pitch", "4", "--thickness", "4"], "").0.unwrap();
        assert!(AXES.iter().all(|line| text.contains(&format!("# {line}\n"))), "{text}");
        assert!(include_str!("../../../docs/your-sensor.md").contains(&AXES.join("\n")));
        // The first reading is that of the taxel with the least x and y, the next one has more x.
        let sensor = Scene::parse(&text, "pad.toml").unwrap().sensor;
        let [first, next, below] = [(0, 0), (0, 1), (1, 0)].map(|(row, col)| sensor.position_mm(row, col));
        assert!(next[0] > first[0] && next[1] == first[1] && below[1] > first[1] && below[0] == first[0]);
    }
}
