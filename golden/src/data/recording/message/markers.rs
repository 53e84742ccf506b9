//! Arrows and lines that viewers draw.

use serde::{Deserialize, Serialize};

use super::{Definition, Header, Message, Vector3, HEADER, POINT, QUATERNION, TIME, VECTOR3};

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Place in m: x, y, z.
    pub position: [f64; 3],
    /// Rotation as a unit quaternion: x, y, z, w.
    pub orientation: [f64; 4],
}

impl Default for Pose {
    /// No translation, no rotation.
    fn default() -> Pose {
        Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// The fields of a marker that belong to textures, texts and meshes, which lines and arrows have none of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NoTexture {
    texture_resource: String,
    /// Header (time, name of the coordinate system), format, bytes of a `sensor_msgs/msg/CompressedImage`.
    texture: (i32, u32, String, String, Vec<u8>),
    uv_coordinates: Vec<[f32; 2]>,
    text: String,
    mesh_resource: String,
    /// Name and bytes of a `visualization_msgs/msg/MeshFile`.
    mesh_file: (String, Vec<u8>),
    mesh_use_embedded_materials: bool,
}

/// `visualization_msgs/msg/Marker`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Time and coordinate system.
    pub header: Header,
    /// Namespace of the number.
    pub ns: String,
    /// Number, by which a later marker replaces this one.
    pub id: i32,
    /// What is drawn: [`Marker::ARROW`] or [`Marker::LINE_LIST`].
    pub r#type: i32,
    /// [`Marker::ADD`] or [`Marker::DELETEALL`].
    pub action: i32,
    /// Coordinate system of the points.
    pub pose: Pose,
    /// In m; of an arrow the diameters of shaft and head and the head's length, of lines their width.
    pub scale: Vector3,
    /// Red, green, blue, opacity, each 0 to 1.
    pub color: [f32; 4],
    /// Seconds and nanoseconds for which it is shown; 0: until it is replaced.
    pub lifetime: (i32, u32),
    /// Whether it moves with its coordinate system.
    pub frame_locked: bool,
    /// Points in m: start and end of an arrow, or of each line.
    pub points: Vec<Vector3>,
    /// Colour of each point; empty: all have the marker's.
    pub colors: Vec<[f32; 4]>,
    /// Textures, texts, meshes.
    pub unused: NoTexture,
}

impl Marker {
    /// An arrow from the first point to the second one.
    pub const ARROW: i32 = 0;
    /// A line from each point of even index to the next one.
    pub const LINE_LIST: i32 = 5;
    /// Draw.
    pub const ADD: i32 = 0;
    /// Remove all markers of the channel.
    pub const DELETEALL: i32 = 3;
}

/// `visualization_msgs/msg/MarkerArray`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// The markers, carried out in their order.
    pub markers: Vec<Marker>,
}

impl Message for MarkerArray {
    const NAME: &'static str = "visualization_msgs/msg/MarkerArray";
    const TEXT: &'static str = include_str!("../msg/MarkerArray.msg");
    const USES: &'static [Definition] = &[
        ("visualization_msgs/Marker", include_str!("../msg/Marker.msg")),
        HEADER,
        TIME,
        ("geometry_msgs/Pose", include_str!("../msg/Pose.msg")),
        POINT,
        QUATERNION,
        VECTOR3,
        ("std_msgs/ColorRGBA", include_str!("../msg/ColorRGBA.msg")),
        ("builtin_interfaces/Duration", include_str!("../msg/Duration.msg")),
        ("sensor_msgs/CompressedImage", include_str!("../msg/CompressedImage.msg")),
        ("visualization_msgs/UVCoordinate", include_str!("../msg/UVCoordinate.msg")),
        ("visualization_msgs/MeshFile", include_str!("../msg/MeshFile.msg")),
    ];
}
