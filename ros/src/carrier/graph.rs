//! What a node says of itself on DDS, so that `ros2 node list` and `ros2 topic info` name it: which writers and readers are its own, since
//! DDS itself knows of processes alone.

use serde::Serialize;

use crate::topics::{Topic, LATCHED};

/// The sixteen bytes by which DDS knows a process, a writer or a reader.
pub type Gid = [u8; 16];

/// `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct NodeEntities {
    /// Namespace of the node.
    pub namespace: String,
    /// Its name.
    pub name: String,
    /// Its readers.
    pub readers: Vec<Gid>,
    /// Its writers.
    pub writers: Vec<Gid>,
}

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`.
#[derive(Clone, Debug, Serialize)]
pub struct ParticipantEntities {
    /// The process.
    pub participant: Gid,
    /// Its nodes.
    pub nodes: Vec<NodeEntities>,
}

/// Its topic, which every process of ROS 2 publishes and reads.
pub fn topic() -> Topic {
    Topic {
        name: "ros_discovery_info".into(),
        type_name: "rmw_dds_common/msg/ParticipantEntitiesInfo",
        type_hash: String::new(),
        quality: LATCHED,
    }
}
