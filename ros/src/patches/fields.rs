//! The fields of a patch file as they are written, with their defaults.

use std::net::Ipv4Addr;

use clap::ValueEnum;
use serde::Deserialize;

/// Address of the router of rmw_zenoh.
pub(super) const ROUTER: &str = "tcp/127.0.0.1:7447";
/// Any port of the loopback.
pub(super) const LOOPBACK: &str = "tcp/127.0.0.1:0";

/// Name of a carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum CarrierName {
    /// For robots with `RMW_IMPLEMENTATION=rmw_zenoh_cpp`.
    Zenoh,
    /// For robots with any other middleware.
    Dds,
}

/// What a file states of the node.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NodeFields {
    /// Its name.
    pub name: String,
    /// Where its name and its topics are: `/` or `/hand`.
    pub namespace: String,
    /// Domain of ROS 2, 0 to 232.
    pub domain: u32,
    /// What carries its messages.
    pub carrier: CarrierName,
    /// Of Zenoh: addresses of routers and other nodes to connect to.
    pub connect: Vec<String>,
    /// Of Zenoh: addresses to listen on.
    pub listen: Vec<String>,
    /// Of DDS: addresses of this computer on whose networks discovery runs.
    pub interfaces: Vec<Ipv4Addr>,
    /// Most messages per second of a topic of a patch; every result if not stated.
    pub rate_Hz: Option<f64>,
    /// Results later than this after their frame count as late.
    pub late_ms: f64,
    /// Frames of a patch that may wait; the oldest one is dropped.
    pub queue: usize,
    /// Workers; if not stated as many as the computer has cores.
    pub threads: Option<usize>,
}

impl Default for NodeFields {
    fn default() -> NodeFields {
        NodeFields {
            name: "dermis".into(),
            namespace: "/".into(),
            domain: 0,
            carrier: CarrierName::Zenoh,
            connect: vec![ROUTER.into()],
            listen: vec![LOOPBACK.into()],
            interfaces: vec![Ipv4Addr::LOCALHOST],
            rate_Hz: None,
            late_ms: 20.0,
            queue: 2,
            threads: None,
        }
    }
}

/// Where a patch is.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// The coordinate system in which the patch is placed.
    #[serde(default = "base")]
    pub parent: String,
    /// Centre of the array in m.
    #[serde(default)]
    pub xyz_m: [f64; 3],
    /// Rotation about the fixed x, then y, then z axis, in rad.
    #[serde(default)]
    pub rpy_rad: [f64; 3],
}

pub(super) fn base() -> String {
    "base_link".into()
}

impl Pose {
    /// The rotation as a unit quaternion: x, y, z, w.
    pub fn quaternion(&self) -> [f64; 4] {
        let [(sr, cr), (sp, cp), (sy, cy)] = self.rpy_rad.map(|angle| (angle / 2.0).sin_cos());
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    }
}

/// What a file states of a patch.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchFields {
    /// Its name, that of its topics.
    pub name: String,
    /// Built-in name or path of its scene.
    pub scene: String,
    /// Where its frames come from.
    pub source: String,
    /// Bit rate of a serial port, in bit/s.
    pub baud: Option<u32>,
    /// Whether a recording begins again at its end.
    #[serde(default)]
    pub repeat: bool,
    /// Coordinate system of its messages; if not stated its name.
    pub frame_id: Option<String>,
    /// Where it is.
    pub pose: Option<Pose>,
    /// Name of the estimator; if not stated the best one that keeps up.
    pub estimator: Option<String>,
    /// Serial port of the board that computes its forces, or `udp:HOST` of a core behind Ethernet; if not stated an engine does.
    pub board: Option<String>,
    /// Name of the engine.
    #[serde(default = "golden")]
    pub engine: String,
    /// Every so many results is cross-checked, 0: none.
    pub check_every: Option<u64>,
    /// Whether the forces of the taxels are published.
    #[serde(default)]
    pub forces: bool,
    /// Whether the stress of the taxels is published.
    #[serde(default)]
    pub stress: bool,
}

fn golden() -> String {
    "golden".into()
}

/// What a file states.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fields {
    /// Of the node.
    #[serde(default)]
    pub(super) node: NodeFields,
    /// Of each patch.
    #[serde(default)]
    pub(super) patch: Vec<PatchFields>,
}
