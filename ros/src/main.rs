//! The `dermis-ros` program: the forces of many sensors as topics of ROS 2, without an installation of ROS.
//!
//! ```text
//! hand.toml ── patches ─┬─ source 0 ── queue ─┐                    ┌─ wrench, contacts, arrows, forces, stress of each patch
//!                       ├─ source 1 ── queue ─┼─ worker per core ──┤
//!                       └─ source 2 ── queue ─┘                    └─ /diagnostics
//! ```
//!
//! | module | does |
//! |---|---|
//! | `patches` | the file that lists the patches |
//! | `source` | lines or frames of a patch, from a source that is opened again when it fails |
//! | `topics` | names, types and qualities of the topics |
//! | `carrier` | Zenoh or DDS, with the names that the middlewares of ROS 2 have |
//! | `engines` | what computes the forces of each patch |
//! | `messages` | results as messages |
//! | `diagnostics` | what is known of each patch |
//! | `node` | the workers, and what they publish |
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod carrier;
mod diagnostics;
mod engines;
mod messages;
mod node;
mod patches;
mod source;
mod topics;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use clap::{value_parser, Parser};
use dermis_flow::{output, say};

use patches::{CarrierName, PatchFile};

/// Results and messages are made and dropped by several threads thousands of times a second: with the allocator of the system that is a
/// tenth of the time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Publish the forces of the sensors in a patch file as topics of ROS 2, over Zenoh or DDS, until interrupted.
#[derive(Parser, Debug)]
#[command(name = "dermis-ros", version, after_help = EXAMPLES)]
struct Arguments {
    /// Patch file: the node, and for each sensor its name, scene, source of frames and place.
    #[arg(value_name = "FILE.toml", required_unless_present = "messages")]
    file: Option<PathBuf>,
    /// What carries the messages, in place of `carrier` of the file.
    #[arg(long, conflicts_with = "messages")]
    carrier: Option<CarrierName>,
    /// Check the file and its scenes, print the topics, and end.
    #[arg(long, visible_alias = "dry-run")]
    check: bool,
    /// Publish for so many seconds, print for each patch results per second, frames lost and late, latency, and end.
    #[arg(long, value_name = "SECONDS", conflicts_with = "check", value_parser = value_parser!(u64).range(1..=86_400))]
    measure: Option<u64>,
    /// Write the definitions of all messages into a folder, as PACKAGE/msg/TYPE.msg, and end.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["file", "check"])]
    messages: Option<PathBuf>,
}

const EXAMPLES: &str = "Examples:
  dermis-ros hand.toml --check      check the file, print the topics
  dermis-ros hand.toml              publish until interrupted
  dermis-ros hand.toml --measure 10 whether the computer keeps up with the patches
  dermis-ros --messages messages    dermis_msgs/msg/Contacts.msg and all that the topics use

A file for one sensor that sends a frame per line:

  [[patch]]
  name = \"thumb\"
  scene = \"sensor-1\"
  source = \"udp://0.0.0.0:9000\"

Over Zenoh the node connects to the router of rmw_zenoh at tcp/127.0.0.1:7447 and listens on the loopback alone, unless [node]
states connect and listen. Over DDS discovery is on the loopback alone, unless [node] states interfaces;
its ports, 7400 + 250 * domain and the next 250 of UDP, are open on all interfaces all the same: a firewall must close them.
`ros2 topic list` shows /thumb/wrench, /thumb/contacts, /thumb/arrows and more.

Exit codes: 0 ended by its sources or interrupted, 2 wrong input or a network address that cannot be used.";
/// Exit code of whatever fails: input and network are the user's.
const FAILED: u8 = 2;

/// Runs the program; the text for standard output.
fn run(arguments: &Arguments) -> Result<String> {
    if let Some(folder) = &arguments.messages {
        return messages::write_definitions(folder);
    }
    let mut file = PatchFile::load(arguments.file.as_deref().unwrap_or(Path::new("")))?;
    file.node.carrier = arguments.carrier.unwrap_or(file.node.carrier);
    if arguments.check {
        // Engines are built too: a scene may be refused by its estimator.
        return engines::Engines::build(&file).and_then(|_| topics::table(&file));
    }
    node::run(&file, arguments.measure.map(Duration::from_secs))
}

fn main() -> ExitCode {
    let done = run(&Arguments::parse()).and_then(|text| output::write(&mut std::io::stdout(), text.as_bytes()));
    match done {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            say!("error: {error:#}");
            ExitCode::from(FAILED)
        }
    }
}
