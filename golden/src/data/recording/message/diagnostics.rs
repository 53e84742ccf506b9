//! The state of a program's parts.

use serde::{Deserialize, Serialize};

use super::{Definition, Header, Message, HEADER, TIME};

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// What is stated.
    pub key: String,
    /// Its value as text.
    pub value: String,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// [`DiagnosticStatus::OK`], [`DiagnosticStatus::WARN`], [`DiagnosticStatus::ERROR`] or [`DiagnosticStatus::STALE`].
    pub level: u8,
    /// Name of the part.
    pub name: String,
    /// Its state in words.
    pub message: String,
    /// What the part is.
    pub hardware_id: String,
    /// The figures behind it.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// All is well.
    pub const OK: u8 = 0;
    /// A limitation.
    pub const WARN: u8 = 1;
    /// Nothing works.
    pub const ERROR: u8 = 2;
    /// Nothing is known for some time.
    pub const STALE: u8 = 3;
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// Time; no coordinate system.
    pub header: Header,
    /// A status per part.
    pub status: Vec<DiagnosticStatus>,
}

impl Message for DiagnosticArray {
    const NAME: &'static str = "diagnostic_msgs/msg/DiagnosticArray";
    const TEXT: &'static str = include_str!("../msg/DiagnosticArray.msg");
    const USES: &'static [Definition] = &[
        HEADER,
        TIME,
        ("diagnostic_msgs/DiagnosticStatus", include_str!("../msg/DiagnosticStatus.msg")),
        ("diagnostic_msgs/KeyValue", include_str!("../msg/KeyValue.msg")),
    ];
}
