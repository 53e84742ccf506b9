//! The patch file: a node of ROS 2, and the sensors that it publishes.
//!
//! Fields, their defaults and ranges are in the guide's page `docs/ros.md`. Paths are relative to the file.

mod fields;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{anyhow, bail, Context, Result};
use dermis_golden::plain_words::of_toml;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_host::engine::EngineName;
use dermis_host::stream::Source;

pub use fields::{CarrierName, NodeFields, PatchFields, Pose};

use fields::Fields;

/// Largest patch file in bytes.
const LARGEST_FILE: u64 = 1 << 20;
/// Most patches of a file.
const MOST_PATCHES: usize = 1024;
/// Domains that ROS 2 has.
const LAST_DOMAIN: u32 = 232;

/// Where the frames of a patch come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Lines, as `dermis reconstruct --stream` takes them.
    Lines(Source),
    /// A recording, at its pace.
    Recording(PathBuf),
}

/// A patch whose scene is loaded.
#[derive(Clone, Debug)]
pub struct Patch {
    /// What the file states.
    pub fields: PatchFields,
    /// Its scene, with the estimator that the file states.
    pub scene: Scene,
    /// Text of the scene's file.
    pub text: String,
    /// Built-in name or path of the scene, which scenes have in common.
    pub path: String,
    /// Where its frames come from.
    pub origin: Origin,
    /// What computes its forces.
    pub engine: EngineName,
    /// Coordinate system of its messages.
    pub frame_id: String,
}

/// A patch file.
#[derive(Clone, Debug)]
pub struct PatchFile {
    /// The node.
    pub node: NodeFields,
    /// Its patches, at least one.
    pub patches: Vec<Patch>,
}

impl PatchFile {
    /// Reads a file and the scenes that it names.
    ///
    /// # Errors
    /// A file that cannot be read or is no patch file: with the file, the field, its value and what is allowed.
    pub fn load(path: &Path) -> Result<PatchFile> {
        let file = path.display().to_string();
        let size = std::fs::metadata(path).with_context(|| file.clone())?.len();
        if size > LARGEST_FILE {
            bail!("{file}: has {size} bytes; at most {LARGEST_FILE} are read");
        }
        let text = std::fs::read_to_string(path).with_context(|| file.clone())?;
        PatchFile::parse(&text, path.parent().unwrap_or(Path::new("."))).map_err(|error| anyhow!("{file}: {error:#}"))
    }

    /// The file with this text, with paths relative to `folder`; errors have no file's name.
    pub(crate) fn parse(text: &str, folder: &Path) -> Result<PatchFile> {
        let read = toml::Deserializer::parse(text).map_err(|error| {
            let (line, message) = of_toml(text, &error);
            anyhow!("line {line}: {message}")
        })?;
        let Fields { node, patch } = serde_path_to_error::deserialize(read).map_err(|error| {
            let (line, message) = of_toml(text, error.inner());
            match error.path().to_string().as_str() {
                "." => anyhow!("line {line}: {message}"),
                path => anyhow!("line {line}, {path}: {message}"),
            }
        })?;
        node.check()?;
        if patch.is_empty() || patch.len() > MOST_PATCHES {
            return Err(wrong("patch", format!("{} patches", patch.len()), "1 to 1024 of [[patch]]"));
        }
        let load = |(index, own)| Patch::load(own, &format!("patch[{index}]"), folder);
        let patches = patch.into_iter().enumerate().map(load).collect::<Result<Vec<Patch>>>()?;
        unique(&patches, "name", |patch| Some(patch.fields.name.clone()))?;
        unique(&patches, "frame_id", |patch| Some(patch.frame_id.clone()))?;
        unique(&patches, "source", |patch| match &patch.origin {
            Origin::Lines(_) => Some(patch.fields.source.clone()),
            // Several patches may show the same one.
            Origin::Recording(_) => None,
        })?;
        Ok(PatchFile { node, patches })
    }

    /// Number of workers, among which the patches without a board are divided.
    pub fn threads(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let computed = self.patches.iter().filter(|patch| patch.fields.board.is_none()).count();
        self.node.threads.unwrap_or_else(cores).min(computed)
    }
}

impl NodeFields {
    fn check(&self) -> Result<()> {
        let NodeFields {
            name, namespace, domain, connect, listen, interfaces, rate_Hz, late_ms, queue, threads, ..
        } = self;
        if !is_name(name) {
            return Err(wrong("node.name", quoted(name), NAME));
        }
        if namespace != "/" && !namespace.strip_prefix('/').is_some_and(|path| path.split('/').all(is_name)) {
            return Err(wrong(
                "node.namespace",
                quoted(namespace),
                "\"/\" or names behind slashes, as \"/robot/hand\"",
            ));
        }
        if *domain > LAST_DOMAIN {
            return Err(wrong("node.domain", domain, "0 to 232"));
        }
        for (field, addresses) in [("node.connect", connect), ("node.listen", listen)] {
            let is_address = |own: &&String| {
                zenoh::config::EndPoint::from_str(own).is_ok_and(|own| own.protocol().as_str() == "tcp")
            };
            if let Some(own) = addresses.iter().find(|own| !is_address(own)) {
                return Err(wrong(field, quoted(own), "a list of addresses as \"tcp/192.168.1.7:7447\""));
            }
        }
        if interfaces.is_empty() {
            return Err(wrong("node.interfaces", "[]", "a list of addresses as \"192.168.1.7\""));
        }
        if let Some(rate) = rate_Hz.filter(|rate| !(*rate > 0.0 && rate.is_finite())) {
            return Err(wrong("node.rate_Hz", rate, "a number above 0"));
        }
        if !(*late_ms > 0.0 && late_ms.is_finite()) {
            return Err(wrong("node.late_ms", late_ms, "a number above 0"));
        }
        if !(1..=4096).contains(queue) {
            return Err(wrong("node.queue", queue, "a whole number from 1 to 4096"));
        }
        if let Some(threads) = threads.filter(|threads| !(1..=256).contains(threads)) {
            return Err(wrong("node.threads", threads, "a whole number from 1 to 256"));
        }
        Ok(())
    }
}

impl Patch {
    fn load(fields: PatchFields, at: &str, folder: &Path) -> Result<Patch> {
        let field = |name: &str| format!("{at}.{name}");
        if !is_name(&fields.name) {
            return Err(wrong(&field("name"), quoted(&fields.name), NAME));
        }
        let frame_id = fields.frame_id.clone().unwrap_or_else(|| fields.name.clone());
        let parent = fields.pose.as_ref().map(|pose| pose.parent.clone());
        for (name, id) in [("frame_id", Some(frame_id.clone())), ("pose.parent", parent)] {
            if let Some(id) = id.filter(|id| id.is_empty() || id.starts_with('/') || id.contains(char::is_whitespace)) {
                return Err(wrong(&field(name), quoted(&id), "a name without spaces that begins with no slash"));
            }
        }
        let numbers = fields.pose.iter().flat_map(|pose| pose.xyz_m.into_iter().chain(pose.rpy_rad));
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return Err(wrong(&field("pose"), number, "finite numbers"));
        }
        let builtin = Scene::builtin_names().contains(&fields.scene.as_str());
        let path = if builtin { fields.scene.clone() } else { folder.join(&fields.scene).display().to_string() };
        let text = Scene::text(&path).with_context(|| field("scene"))?;
        let mut scene = Scene::parse(&text, &path).with_context(|| field("scene"))?;
        if let Some(name) = &fields.estimator {
            let names = EstimatorKind::NAMES;
            let found = names.iter().find(|(own, _)| own == name);
            let allowed = || names.map(|(name, _)| quoted(name)).join(", ");
            let (_, kind) = found.ok_or_else(|| wrong(&field("estimator"), quoted(name), &allowed()))?;
            scene = scene.estimated_by(*kind);
        }
        let engine = EngineName::software(&fields.engine).with_context(|| at.to_owned())?;
        if let Some(board) = &fields.board {
            let stated = [("estimator", fields.estimator.is_some()), ("engine", engine != EngineName::Golden)];
            if let Some((name, _)) = stated.into_iter().find(|(_, stated)| *stated) {
                return Err(wrong(
                    &field(name),
                    "stated",
                    &format!("left out: the board at {board} computes the forces"),
                ));
            }
        }
        let origin = match Path::new(&fields.source).extension().is_some_and(|extension| extension == "mcap") {
            true => Origin::Recording(folder.join(&fields.source)),
            false => match fields.source.parse().map_err(|error: String| wrong(&field("source"), error, SOURCE))? {
                Source::Path(path) => Origin::Lines(Source::Path(folder.join(path).display().to_string())),
                other => Origin::Lines(other),
            },
        };
        Ok(Patch { fields, scene, text, path, origin, engine, frame_id })
    }
}

const NAME: &str = "letters, digits and underscores, and begins with no digit";
const SOURCE: &str = "\"-\", \"udp://HOST:PORT\", \"serial:PORT\", or a path";

/// Whether ROS 2 takes it as a name.
fn is_name(text: &str) -> bool {
    let all = text.chars().all(|own| own.is_ascii_alphanumeric() || own == '_');
    all && text.starts_with(|own: char| own.is_ascii_alphabetic() || own == '_')
}

fn quoted(text: &str) -> String {
    format!("{text:?}")
}

fn wrong(field: &str, value: impl Display, allowed: &str) -> anyhow::Error {
    anyhow!("{field} = {value} is not allowed; it must be {allowed}")
}

/// Checks that no two patches have the same value of a field.
fn unique(patches: &[Patch], field: &str, of: impl Fn(&Patch) -> Option<String>) -> Result<()> {
    let mut seen = BTreeMap::new();
    for (index, patch) in patches.iter().enumerate() {
        let Some(value) = of(patch) else { continue };
        if let Some(before) = seen.insert(value.clone(), index) {
            let allowed = format!("another one than that of patch[{before}]");
            return Err(wrong(&format!("patch[{index}].{field}"), quoted(&value), &allowed));
        }
    }
    Ok(())
}
