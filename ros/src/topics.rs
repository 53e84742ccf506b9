//! The topics of a node: names, types and qualities.
//!
//! | topic | type | quality |
//! |---|---|---|
//! | `<namespace>/<patch>/wrench`, `contacts`, `arrows`, `forces`, `stress` | force of the patch, its contacts, pictures | stream |
//! | `<namespace>/<patch>/scene`, `/tf_static` | text of the scene, poses of the patches | latched |
//! | `/diagnostics` | state of each patch | reliable |
//! | `<namespace>/<patch>/tare` | taken from others: a new zero | reliable |

use std::fmt::Write;

use anyhow::Result;
use dermis_golden::data::recording::message::{
    Contacts, DiagnosticArray, Empty, Image, MarkerArray, Message, PointCloud2, Text, TfMessage, WrenchStamped,
};

use crate::patches::{Patch, PatchFile};

/// What a topic promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Every message arrives, or what is sent waits; else the newest one matters.
    pub reliable: bool,
    /// Who comes later has the last messages.
    pub latched: bool,
    /// Messages that are kept.
    pub depth: usize,
}

/// Of results: best effort, the newest.
pub const STREAM: Quality = Quality { reliable: false, latched: false, depth: 1 };
/// Of what is said once.
pub const LATCHED: Quality = Quality { reliable: true, latched: true, depth: 1 };
/// Of the state.
pub const STATE: Quality = Quality { reliable: true, latched: false, depth: 10 };

/// A topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name with all namespaces, which begins with a slash.
    pub name: String,
    /// Its type as `package/msg/Type`.
    pub type_name: &'static str,
    /// The hash of its type, `RIHS01_…`.
    pub type_hash: String,
    /// What it promises.
    pub quality: Quality,
}

impl Topic {
    /// The topic of this name with messages `M`.
    pub fn of<M: Message>(name: impl Into<String>, quality: Quality) -> Topic {
        Topic { name: name.into(), type_name: M::NAME, type_hash: M::hash(), quality }
    }

    /// Its type as DDS names it, `package::msg::dds_::Type_`.
    pub fn dds_type(&self) -> String {
        self.type_name.replace('/', "::").replace("::msg::", "::msg::dds_::") + "_"
    }
}

/// `/diagnostics`.
pub fn diagnostics() -> Topic {
    Topic::of::<DiagnosticArray>("/diagnostics", STATE)
}

/// `/tf_static`.
pub fn tf_static() -> Topic {
    Topic::of::<TfMessage>("/tf_static", LATCHED)
}

/// The topics of a patch.
pub struct PatchTopics {
    /// Force and torque.
    pub wrench: Topic,
    /// Its contacts.
    pub contacts: Topic,
    /// Forces as arrows.
    pub arrows: Topic,
    /// The force of each taxel, where the file asks for it.
    pub forces: Option<Topic>,
    /// The stress of each taxel, where the file asks for it.
    pub stress: Option<Topic>,
    /// Text of the scene.
    pub scene: Topic,
    /// Asks for a new zero.
    pub tare: Topic,
}

impl PatchTopics {
    /// Those of a patch of a node in `namespace`.
    pub fn new(namespace: &str, patch: &Patch) -> PatchTopics {
        let fields = &patch.fields;
        let name = |topic: &str| format!("{}/{}/{topic}", namespace.trim_end_matches('/'), fields.name);
        PatchTopics {
            wrench: Topic::of::<WrenchStamped>(name("wrench"), STREAM),
            contacts: Topic::of::<Contacts>(name("contacts"), STREAM),
            arrows: Topic::of::<MarkerArray>(name("arrows"), STREAM),
            forces: fields.forces.then(|| Topic::of::<PointCloud2>(name("forces"), STREAM)),
            stress: fields.stress.then(|| Topic::of::<Image>(name("stress"), STREAM)),
            scene: Topic::of::<Text>(name("scene"), LATCHED),
            tare: Topic::of::<Empty>(name("tare"), STATE),
        }
    }
}

/// The topics of a file as a table.
///
/// # Errors
/// None: a table is text.
pub fn table(file: &PatchFile) -> Result<String> {
    let mut rows: Vec<(Topic, &str)> = Vec::new();
    for patch in &file.patches {
        let PatchTopics { wrench, contacts, arrows, forces, stress, scene, tare } =
            PatchTopics::new(&file.node.namespace, patch);
        let published = [Some(wrench), Some(contacts), Some(arrows), forces, stress, Some(scene)];
        rows.extend(published.into_iter().flatten().map(|topic| (topic, "publishes")));
        rows.push((tare, "subscribes"));
    }
    rows.push((diagnostics(), "publishes"));
    if file.patches.iter().any(|patch| patch.fields.pose.is_some()) {
        rows.push((tf_static(), "publishes"));
    }
    let width = |of: fn(&Topic) -> &str| rows.iter().map(|(topic, _)| of(topic).len()).max().unwrap_or(0);
    let (names, types) = (width(|topic| &topic.name), width(|topic| topic.type_name));
    let mut text = String::new();
    for (Topic { name, type_name, quality, .. }, does) in &rows {
        let reliable = if quality.reliable { "reliable" } else { "best effort" };
        let latched = if quality.latched { ", latched" } else { "" };
        writeln!(text, "{does:10}  {name:names$}  {type_name:types$}  {reliable}{latched}, last {}", quality.depth)?;
    }
    Ok(text)
}
