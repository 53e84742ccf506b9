//! `dermis generate`: a frame, or a recording of a press, with known forces, from contacts described on the command line.
//!
//! | option | contacts |
//! |---|---|
//! | `--contact shape:key=value:…` | keys `at`, `size`, `normal`, `shear`, `slip`, `friction` |
//! | `--like FILE` | those described in a frame file |
//! | `--random N` | N random ones, drawn from the seed |
//! | `--press MOTION` | one random one that holds or moves: a recording in place of a frame, `generate_press` |

use std::path::PathBuf;

use anyhow::{anyhow, bail, Result};
use clap::Args;
use dermis_golden::data::frame::{Contact, Frame};
use dermis_golden::data::generator::converter::Converter;
use dermis_golden::data::generator::draws::DrawOptions;
use dermis_golden::data::generator::presses::{Motion, Press};
use dermis_golden::data::generator::slip::Slip;
use dermis_golden::data::generator::{generate, random_contacts, Draw};
use dermis_golden::spec::scene::Scene;

use super::generate_press::{self, PressArguments};
use dermis_golden::write::write;
use dermis_report::drawn_frames::Shapes;

/// Arguments of `dermis generate`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Built-in name or path of the scene that defines sensor and medium.
    scene: String,
    /// Contact, repeatable: shape:key=value:… with at=X,Y (mm), size=… (mm, degrees), normal=N, shear=X,Y (N),
    /// slip=none|full-sliding|partial-slip|even-shear, friction=F.
    #[arg(long = "contact", value_name = "TEXT")]
    contacts: Vec<String>,
    /// Use the contacts described in a frame file.
    #[arg(long, value_name = "FILE")]
    like: Option<PathBuf>,
    /// Draw N random contacts, at most 1000.
    #[arg(long, value_name = "N", default_value_t = 0)]
    random: usize,
    /// Shapes of the random contacts.
    #[arg(long, value_enum, default_value = "elliptic")]
    shapes: Shapes,
    /// How the shear is spread over the random contacts: full (slip), even, mixed, or its share of the friction limit.
    #[arg(long, value_name = "SLIP", default_value_t = Slip::Full)]
    slip: Slip,
    /// Place random contacts so that they touch each other.
    #[arg(long)]
    touching: bool,
    /// Seed of contacts and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Standard deviation of Gaussian noise over the largest |b|.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    noise: f64,
    /// Standard deviation of the taxels' gains.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    gain_spread: f64,
    /// Standard deviation of the taxels' zeros since the tare over the largest |b|.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    drift: f64,
    /// Frames without contact whose noisy mean is subtracted; 0: none.
    #[arg(long, value_name = "N", default_value_t = 0)]
    tare_frames: usize,
    /// Frames that are averaged, each with its own noise; not of a press.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "press")]
    frames: usize,
    #[command(flatten)]
    press: PressArguments,
    /// Unipolar sensor: tension reads as zero.
    #[arg(long)]
    unipolar: bool,
    /// Quantise to codes of this width in bits.
    #[arg(long)]
    bits: Option<u32>,
    /// Stress of the largest code in MPa; default: the frame's peak.
    #[arg(long, value_name = "MPA")]
    full_scale: Option<f64>,
    /// Dead taxel, which reads zero; repeatable.
    #[arg(long, value_name = "ROW,COL")]
    dead: Vec<String>,
    /// Stuck taxel, which always reads the given stress; repeatable.
    #[arg(long, value_name = "ROW,COL=MPA")]
    stuck: Vec<String>,
    /// Id of the frame.
    #[arg(long, default_value = "generated", conflicts_with = "press")]
    id: String,
    /// File to write; default: standard output. Of a press a recording, if its name ends in .mcap, else a line of JSON per frame.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

const EXAMPLES: &str = "Examples:
  dermis generate sensor-1 --contact hertz-circle:size=3:normal=5:shear=1,0.5 --out press.json
  dermis generate sensor-2 --contact ring:at=2,-3:size=7,3:normal=8 --noise 0.001 --bits 16 --seed 7
  dermis generate sensor-3 --contact flat-punch:at=-8,-20:size=4:normal=6:shear=0,2 \\
                           --contact hertz-ellipse:at=6,15:size=3,5,30:normal=9:shear=2,0:slip=partial-slip:friction=0.6
  dermis generate sensor-1 --contact tilted:size=4,5,30,0.5,-0.3:normal=5:shear=1,1 --noise 0.01 --gain-spread 0.01 \
                           --drift 0.002 --frames 64 --tare-frames 256
  dermis generate sensor-4 --contact plantar-left:at=-70,0:normal=350:shear=10,50
  dermis generate sensor-3 --random 4 --slip mixed --seed 12 --dead 3,4 --stuck 0,7=0.2
  dermis generate sensor-1 --press slide --noise 0.01 --gain-spread 0.01 --bits 10 --duration 0.2 --out slide.jsonl
Shapes and sizes: hertz-circle a; hertz-ellipse a,b,angle; tilted a,b,angle,u,v; lobed a,b,angle; flat-punch a or a,b,angle; ring outer,inner;
  rectangle width,height,angle; plantar-left, plantar-right none or width,length,angle.";

/// Generates the frame; returns its JSON, or the path and size of the file written.
///
/// # Errors
/// Contacts that cannot be parsed or are inconsistent, options out of range, a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<String> {
    let scene = Scene::load(&arguments.scene)?;
    if let Some(motion) = arguments.press.motion() {
        return press(arguments, &scene, motion);
    }
    let mut contacts = arguments.contacts.iter().map(|text| contact(text)).collect::<Result<Vec<_>>>()?;
    if let Some(path) = &arguments.like {
        contacts.extend(Frame::load(path, Some(&scene))?.contacts);
    }
    let Arguments { random: count, shapes, slip, touching, seed, .. } = *arguments;
    let draw = Draw { count, shapes: shapes.into(), slip, touching, seed };
    draw.check()?;
    contacts.extend(random_contacts(&scene.sensor, draw));
    if contacts.is_empty() {
        bail!("no contact: give --contact, --like or --random");
    }
    let frame = generate(&arguments.id, &scene.sensor, scene.medium, &contacts)?;
    let text = converter(arguments)?.convert(&frame)?.to_json() + "\n";
    match &arguments.out {
        None => Ok(text),
        Some(path) => {
            write(path, text.as_bytes())?;
            Ok(format!("{} ({} bytes)\n", path.display(), text.len()))
        }
    }
}

/// The press of a motion.
fn press(arguments: &Arguments, scene: &Scene, motion: Motion) -> Result<String> {
    if !arguments.contacts.is_empty() || arguments.like.is_some() || arguments.random > 0 {
        bail!("--press draws its contact from --seed: leave out --contact, --like and --random");
    }
    let press = arguments.press.press(motion, DrawOptions { slip: arguments.slip, ..DrawOptions::default() })?;
    let draw = DrawOptions { converter: converter(arguments)?, ..press.draw.clone() };
    generate_press::run(scene, &Press { draw, ..press }, arguments.seed, arguments.out.as_deref())
}

/// The sensor that reads the stress.
fn converter(arguments: &Arguments) -> Result<Converter> {
    Ok(Converter {
        noise: arguments.noise,
        gain_spread: arguments.gain_spread,
        drift: arguments.drift,
        tare_frames: arguments.tare_frames,
        frames: arguments.frames,
        unipolar: arguments.unipolar,
        bits: arguments.bits,
        full_scale_MPa: arguments.full_scale,
        dead: arguments.dead.iter().map(|text| taxel("--dead", text)).collect::<Result<_>>()?,
        stuck: arguments.stuck.iter().map(|text| stuck(text)).collect::<Result<_>>()?,
        seed: arguments.seed,
    })
}

/// Parses `shape:key=value:…`.
fn contact(text: &str) -> Result<Contact> {
    let mut parts = text.split(':');
    let mut contact = Contact { shape: parts.next().map(str::to_string), ..Default::default() };
    for part in parts {
        let wrong = || anyhow!("--contact {text}: {part:?} is not of the form key=value");
        let (key, value) = part.split_once('=').ok_or_else(wrong)?;
        let list =
            || numbers(value).ok_or_else(|| anyhow!("--contact {text}: {key} = {value:?} is not a list of numbers"));
        let fixed = |count: usize| {
            list().and_then(|list| match list.len() {
                got if got == count => Ok(list),
                got => Err(anyhow!("--contact {text}: {key} has {got} values, wanted {count}")),
            })
        };
        match key {
            "at" => contact.centre_mm = Some(fixed(2).map(|v| [v[0], v[1]])?),
            "size" => contact.size_mm = list()?,
            "normal" => contact.normal_N = Some(fixed(1)?[0]),
            "shear" => contact.tangential_N = Some(fixed(2).map(|v| [v[0], v[1]])?),
            "slip" => contact.kind_of_slip = Some(value.to_string()),
            "friction" => contact.friction = Some(fixed(1)?[0]),
            _ => bail!("--contact {text}: unknown key {key}; known: at, size, normal, shear, slip, friction"),
        }
    }
    Ok(contact)
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|number| number.trim().parse().ok()).collect()
}

/// Parses `row,col`.
fn taxel(option: &str, text: &str) -> Result<[usize; 2]> {
    let parse = |(row, col): (&str, &str)| Some([row.trim().parse().ok()?, col.trim().parse().ok()?]);
    text.split_once(',').and_then(parse).ok_or_else(|| anyhow!("{option} {text:?}: wanted row,col"))
}

/// Parses `row,col=MPa`.
fn stuck(text: &str) -> Result<([usize; 2], f64)> {
    let (place, reads) = text.split_once('=').ok_or_else(|| anyhow!("--stuck {text:?}: wanted row,col=MPa"))?;
    let reads = reads.trim().parse().map_err(|_| anyhow!("--stuck {text:?}: {reads:?} is not a number"))?;
    Ok((taxel("--stuck", place)?, reads))
}
