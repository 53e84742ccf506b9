//! Where coordinate systems are.

use serde::{Deserialize, Serialize};

use super::{Definition, Header, Message, Vector3, HEADER, QUATERNION, TIME, VECTOR3};

/// `geometry_msgs/msg/Transform`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// In m.
    pub translation: Vector3,
    /// Rotation as a unit quaternion: x, y, z, w.
    pub rotation: [f64; 4],
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Time, and the coordinate system in which the other one is placed.
    pub header: Header,
    /// The coordinate system that is placed.
    pub child_frame_id: String,
    /// Its place.
    pub transform: Transform,
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TfMessage {
    /// The places.
    pub transforms: Vec<TransformStamped>,
}

impl Message for TfMessage {
    const NAME: &'static str = "tf2_msgs/msg/TFMessage";
    const TEXT: &'static str = include_str!("../msg/TFMessage.msg");
    const USES: &'static [Definition] = &[
        ("geometry_msgs/TransformStamped", include_str!("../msg/TransformStamped.msg")),
        HEADER,
        TIME,
        ("geometry_msgs/Transform", include_str!("../msg/Transform.msg")),
        VECTOR3,
        QUATERNION,
    ];
}
