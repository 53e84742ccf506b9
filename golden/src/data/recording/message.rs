//! The ROS 2 messages of a recording, their encoding CDR and their schemas.
//!
//! Structures have the fields of the `.msg` files beside this module, in their order; a schema is a file's text followed by
//! those of the types that it uses, as rosbag2 writes it.
//!
//! | module | holds |
//! |---|---|
//! | [`contacts`] | the contacts of a result, a type of Dermis |
//! | [`diagnostics`] | the state of a program's parts |
//! | [`markers`] | arrows and lines that viewers draw |
//! | [`transforms`] | where coordinate systems are |
//! | [`type_hash`](mod@type_hash) | the hash of a type, from its text |

pub mod contacts;
pub mod diagnostics;
pub mod markers;
pub mod transforms;
pub mod type_hash;

pub use contacts::{Contact, Contacts};
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use markers::{Marker, MarkerArray, NoTexture, Pose};
pub use transforms::{TfMessage, Transform, TransformStamped};
use type_hash::type_hash;
pub use type_hash::Definition;

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
    /// Text of its `.msg` file.
    const TEXT: &'static str;
    /// Name and text of each type that it uses.
    const USES: &'static [Definition];

    /// The schema: the text of the type and of all that it uses.
    fn schema() -> String {
        let rule = "=".repeat(80);
        let used = Self::USES.iter().map(|(name, text)| format!("{rule}\nMSG: {name}\n{text}"));
        Self::TEXT.to_owned() + &used.collect::<String>()
    }

    /// Its type hash, RIHS01, which ROS 2 has in the names of its channels.
    fn hash() -> String {
        type_hash(Self::NAME, Self::TEXT, Self::USES)
    }

    /// The message in CDR.
    ///
    /// # Errors
    /// A text or list that CDR cannot represent, in words.
    fn to_cdr(&self) -> Result<Vec<u8>, String> {
        to_cdr(self)
    }
}

/// A message in CDR.
///
/// # Errors
/// As [`Message::to_cdr`].
pub fn to_cdr<T: Serialize>(message: &T) -> Result<Vec<u8>, String> {
    let mut bytes = LITTLE_ENDIAN.to_vec();
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut bytes, message).map_err(|error| error.to_string())?;
    Ok(bytes)
}

const TIME: Definition = ("builtin_interfaces/Time", include_str!("msg/Time.msg"));
const HEADER: Definition = ("std_msgs/Header", include_str!("msg/Header.msg"));

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
    const TEXT: &'static str = include_str!("msg/Image.msg");
    const USES: &'static [Definition] = &[HEADER, TIME];
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
    const TEXT: &'static str = include_str!("msg/PointCloud2.msg");
    const USES: &'static [Definition] = &[HEADER, TIME, ("sensor_msgs/PointField", include_str!("msg/PointField.msg"))];
}

const VECTOR3: Definition = ("geometry_msgs/Vector3", include_str!("msg/Vector3.msg"));
const POINT: Definition = ("geometry_msgs/Point", include_str!("msg/Point.msg"));
const QUATERNION: Definition = ("geometry_msgs/Quaternion", include_str!("msg/Quaternion.msg"));

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
    const TEXT: &'static str = include_str!("msg/WrenchStamped.msg");
    const USES: &'static [Definition] =
        &[HEADER, TIME, ("geometry_msgs/Wrench", include_str!("msg/Wrench.msg")), VECTOR3];
}

/// `std_msgs/msg/Empty`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Empty {
    /// A structure of IDL has at least one member.
    structure_needs_at_least_one_member: u8,
}

impl Message for Empty {
    const NAME: &'static str = "std_msgs/msg/Empty";
    const TEXT: &'static str = include_str!("msg/Empty.msg");
    const USES: &'static [Definition] = &[];
}

/// `std_msgs/msg/String`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Text {
    /// The text.
    pub data: String,
}

impl Message for Text {
    const NAME: &'static str = "std_msgs/msg/String";
    const TEXT: &'static str = include_str!("msg/String.msg");
    const USES: &'static [Definition] = &[];
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
            (Contacts::schema(), Contacts::USES),
            (DiagnosticArray::schema(), DiagnosticArray::USES),
            (TfMessage::schema(), TfMessage::USES),
            (Empty::schema(), Empty::USES),
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
