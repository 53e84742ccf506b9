//! The ROS 2 messages of a recording, their encoding CDR and their schemas.
//!
//! Structures have the fields of the `.msg` files beside this module, in their order; a schema is a file's text followed by
//! those of the types that it uses, as rosbag2 writes it.

use byteorder::{BigEndian, LittleEndian};
use serde::{Deserialize, Serialize, Serializer};

/// Encapsulation of plain CDR in little-endian order.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
/// The same in big-endian order; the last two bytes are options without meaning here.
const BIG_ENDIAN: [u8; 2] = [0, 0];
/// Nanoseconds of a second.
const NANOSECONDS: u64 = 1_000_000_000;

/// A message type.
pub trait Message: Serialize + Sized {
    /// Its name, as ROS 2 has it.
    const NAME: &'static str;
    /// Its type hash, RIHS01, as ROS 2 computes it from the type's fields.
    const HASH: &'static str;
    /// Text of its `.msg` file.
    const TEXT: &'static str;
    /// Name and text of each type that it uses.
    const USES: &'static [(&'static str, &'static str)];

    /// The schema: the text of the type and of all that it uses.
    fn schema() -> String {
        let rule = "=".repeat(80);
        let used = Self::USES.iter().map(|(name, text)| format!("{rule}\nMSG: {name}\n{text}"));
        Self::TEXT.to_owned() + &used.collect::<String>()
    }

    /// The message in CDR.
    ///
    /// # Errors
    /// A text or list that CDR cannot represent, in words.
    fn to_cdr(&self) -> Result<Vec<u8>, String> {
        let mut bytes = LITTLE_ENDIAN.to_vec();
        cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, self).map_err(|error| error.to_string())?;
        Ok(bytes)
    }
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", include_str!("msg/Time.msg"));
const HEADER: (&str, &str) = ("std_msgs/Header", include_str!("msg/Header.msg"));

/// A message from its CDR.
///
/// # Errors
/// What is wrong, in words.
pub fn from_cdr<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, String> {
    let Some((head, body)) = bytes.split_first_chunk::<4>() else {
        return Err(format!("has {} bytes, wanted CDR", bytes.len()));
    };
    let message = match [head[0], head[1]] {
        order if order == LITTLE_ENDIAN[..2] => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        BIG_ENDIAN => cdr_encoding::from_bytes::<T, BigEndian>(body),
        _ => return Err(format!("begins with {head:02x?}, wanted plain CDR, {LITTLE_ENDIAN:02x?}")),
    };
    message.map(|(message, _)| message).map_err(|error| error.to_string())
}

/// Bytes as one sequence, instead of one by one.
fn sequence<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytes)
}

/// `builtin_interfaces/msg/Time`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Seconds since 1970.
    pub sec: i32,
    /// Nanoseconds of that second.
    pub nanosec: u32,
}

impl Time {
    /// Nanoseconds since 1970; 0 before it.
    pub fn nanoseconds(self) -> u64 {
        u64::try_from(self.sec).map_or(0, |sec| sec * NANOSECONDS + u64::from(self.nanosec))
    }
}

impl From<u64> for Time {
    /// The time this many nanoseconds after 1970; the last one that the type has if that is later.
    fn from(nanoseconds: u64) -> Time {
        let sec = i32::try_from(nanoseconds / NANOSECONDS).unwrap_or(i32::MAX);
        Time { sec, nanosec: (nanoseconds % NANOSECONDS) as u32 }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When the data were acquired.
    pub stamp: Time,
    /// Name of the coordinate system.
    pub frame_id: String,
}

/// `sensor_msgs/msg/Image`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Image<'a> {
    /// Time and coordinate system.
    pub header: Header,
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
    /// Type and number of a pixel's values.
    pub encoding: String,
    /// 1 if values have their most significant byte first.
    pub is_bigendian: u8,
    /// Bytes of a row.
    pub step: u32,
    /// The rows, one after the other.
    #[serde(serialize_with = "sequence")]
    pub data: &'a [u8],
}

impl Message for Image<'_> {
    const NAME: &'static str = "sensor_msgs/msg/Image";
    const HASH: &'static str = "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47";
    const TEXT: &'static str = include_str!("msg/Image.msg");
    const USES: &'static [(&'static str, &'static str)] = &[HEADER, TIME];
}

/// `sensor_msgs/msg/PointField`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointField {
    /// Name.
    pub name: String,
    /// Bytes before it in a point.
    pub offset: u32,
    /// Type of a value: [`PointField::FLOAT32`] or [`PointField::FLOAT64`].
    pub datatype: u8,
    /// Number of values.
    pub count: u32,
}

impl PointField {
    /// 32-bit floating point.
    pub const FLOAT32: u8 = 7;
    /// 64-bit floating point.
    pub const FLOAT64: u8 = 8;
}

/// `sensor_msgs/msg/PointCloud2`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointCloud2<'a> {
    /// Time and coordinate system.
    pub header: Header,
    /// Rows.
    pub height: u32,
    /// Points of a row.
    pub width: u32,
    /// What a point holds.
    pub fields: Vec<PointField>,
    /// Whether values have their most significant byte first.
    pub is_bigendian: bool,
    /// Bytes of a point.
    pub point_step: u32,
    /// Bytes of a row.
    pub row_step: u32,
    /// The points, row by row.
    #[serde(serialize_with = "sequence")]
    pub data: &'a [u8],
    /// Whether no value is undefined.
    pub is_dense: bool,
}

impl Message for PointCloud2<'_> {
    const NAME: &'static str = "sensor_msgs/msg/PointCloud2";
    const HASH: &'static str = "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5";
    const TEXT: &'static str = include_str!("msg/PointCloud2.msg");
    const USES: &'static [(&'static str, &'static str)] =
        &[HEADER, TIME, ("sensor_msgs/PointField", include_str!("msg/PointField.msg"))];
}

/// `geometry_msgs/msg/Vector3`: x, y, z.
pub type Vector3 = [f64; 3];

/// `geometry_msgs/msg/Wrench`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force in N.
    pub force: Vector3,
    /// Torque about the origin of the coordinate system in N·m.
    pub torque: Vector3,
}

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WrenchStamped {
    /// Time and coordinate system.
    pub header: Header,
    /// Force and torque.
    pub wrench: Wrench,
}

impl Message for WrenchStamped {
    const NAME: &'static str = "geometry_msgs/msg/WrenchStamped";
    const HASH: &'static str = "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77";
    const TEXT: &'static str = include_str!("msg/WrenchStamped.msg");
    const USES: &'static [(&'static str, &'static str)] = &[
        HEADER,
        TIME,
        ("geometry_msgs/Wrench", include_str!("msg/Wrench.msg")),
        ("geometry_msgs/Vector3", include_str!("msg/Vector3.msg")),
    ];
}

/// `std_msgs/msg/String`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Text {
    /// The text.
    pub data: String,
}

impl Message for Text {
    const NAME: &'static str = "std_msgs/msg/String";
    const HASH: &'static str = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18";
    const TEXT: &'static str = include_str!("msg/String.msg");
    const USES: &'static [(&'static str, &'static str)] = &[];
}

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
    const HASH: &'static str = "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf";
    const TEXT: &'static str = include_str!("msg/MarkerArray.msg");
    const USES: &'static [(&'static str, &'static str)] = &[
        ("visualization_msgs/Marker", include_str!("msg/Marker.msg")),
        HEADER,
        TIME,
        ("geometry_msgs/Pose", include_str!("msg/Pose.msg")),
        ("geometry_msgs/Point", include_str!("msg/Point.msg")),
        ("geometry_msgs/Quaternion", include_str!("msg/Quaternion.msg")),
        ("geometry_msgs/Vector3", include_str!("msg/Vector3.msg")),
        ("std_msgs/ColorRGBA", include_str!("msg/ColorRGBA.msg")),
        ("builtin_interfaces/Duration", include_str!("msg/Duration.msg")),
        ("sensor_msgs/CompressedImage", include_str!("msg/CompressedImage.msg")),
        ("visualization_msgs/UVCoordinate", include_str!("msg/UVCoordinate.msg")),
        ("visualization_msgs/MeshFile", include_str!("msg/MeshFile.msg")),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        Header { stamp: Time { sec: 7, nanosec: 9 }, frame_id: "skin".into() }
    }

    /// Aligned by hand: CDR counts the alignment from the end of its encapsulation.
    #[test]
    fn a_wrench_is_encoded_as_by_hand() {
        let wrench = Wrench { force: [1.0, 2.0, 3.0], torque: [0.0, -1.0, 0.5] };
        let bytes = WrenchStamped { header: header(), wrench: wrench.clone() }.to_cdr().unwrap();
        let mut wanted = vec![0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 5, 0, 0, 0];
        wanted.extend(b"skin\0");
        // 17 bytes so far without the encapsulation: padding to 24.
        wanted.extend([0; 7]);
        for value in wrench.force.iter().chain(&wrench.torque) {
            wanted.extend(value.to_le_bytes());
        }
        assert_eq!(bytes, wanted);
        assert_eq!(from_cdr::<WrenchStamped>(&bytes).unwrap().wrench, wrench);
    }

    #[test]
    fn messages_are_read_as_written() {
        let image = Image {
            header: header(),
            height: 1,
            width: 2,
            encoding: "8UC1".into(),
            is_bigendian: 0,
            step: 2,
            data: &[3, 4],
        };
        let bytes = image.to_cdr().unwrap();
        assert_eq!(from_cdr::<Image>(&bytes).unwrap(), image);
        let field = PointField { name: "x".into(), offset: 0, datatype: PointField::FLOAT32, count: 1 };
        let cloud = PointCloud2 {
            header: header(),
            height: 1,
            width: 1,
            fields: vec![field],
            is_bigendian: false,
            point_step: 4,
            row_step: 4,
            data: &[0, 0, 128, 63],
            is_dense: true,
        };
        let bytes = cloud.to_cdr().unwrap();
        assert_eq!(from_cdr::<PointCloud2>(&bytes).unwrap(), cloud);
        for length in 0..bytes.len() - 1 {
            assert!(from_cdr::<PointCloud2>(&bytes[..length]).is_err(), "{length} bytes");
        }
        let foreign = [&[0, 3, 0, 0], &bytes[4..]].concat();
        assert!(from_cdr::<PointCloud2>(&foreign).unwrap_err().starts_with("begins with [00, 03"));
        // A text of big-endian order, by hand.
        let text = from_cdr::<Text>(b"\0\0\0\0\0\0\0\x03hi\0").unwrap();
        assert_eq!(text, Text { data: "hi".into() });
    }

    #[test]
    fn times_are_nanoseconds_since_1970() {
        assert_eq!(Time::from(1_700_000_000_000_000_123), Time { sec: 1_700_000_000, nanosec: 123 });
        assert_eq!(Time { sec: 2, nanosec: 5 }.nanoseconds(), 2_000_000_005);
        assert_eq!((Time { sec: -1, nanosec: 5 }.nanoseconds(), Time::from(u64::MAX).sec), (0, i32::MAX));
    }

    #[test]
    fn a_schema_has_every_type_that_it_names() {
        for (text, uses) in [
            (Image::schema(), Image::USES),
            (PointCloud2::schema(), PointCloud2::USES),
            (WrenchStamped::schema(), WrenchStamped::USES),
            (Text::schema(), Text::USES),
            (MarkerArray::schema(), MarkerArray::USES),
        ] {
            let words =
                text.lines().filter(|line| !line.starts_with("MSG")).filter_map(|line| line.split([' ', '[']).next());
            let named = words.filter(|word| word.contains('/'));
            let missing: Vec<&str> = named.filter(|name| !text.contains(&format!("MSG: {name}\n"))).collect();
            assert!(missing.is_empty(), "{missing:?} in\n{text}");
            assert_eq!(text.matches("MSG: ").count(), uses.len());
        }
    }
}
