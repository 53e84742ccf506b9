//! The contacts of a result in one message: `dermis_msgs`, the only types that are not of ROS 2 itself.

use serde::{Deserialize, Serialize};

use super::{Definition, Header, Message, HEADER, POINT, TIME};

/// `dermis_msgs/msg/Contact`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Stays with the contact from result to result, from 1; 0 if it is not followed.
    pub number: u64,
    /// Results since the first one with this number, that one included.
    pub age: u64,
    /// Centre of pressure in m: x, y, z.
    pub position: [f64; 3],
    /// In N, compression is positive.
    pub normal_force: f64,
    /// In N: x, y.
    pub shear: [f64; 2],
    /// Standard deviations in N of the shear in x and y and of the normal force; NaN where there is none.
    pub sigma: [f64; 3],
    /// Shear over normal force.
    pub load_ratio: f64,
    /// Its standard deviation; NaN where there is none.
    pub load_ratio_sigma: f64,
    /// Whether a contact of the array moves: [`Contact::MOVING_UNKNOWN`], [`Contact::MOVING_NO`] or [`Contact::MOVING_YES`].
    pub moving: u8,
}

impl Contact {
    /// The result does not say whether it moves.
    pub const MOVING_UNKNOWN: u8 = 0;
    /// All contacts stay.
    pub const MOVING_NO: u8 = 1;
    /// A contact moves, comes or goes.
    pub const MOVING_YES: u8 = 2;
}

/// `dermis_msgs/msg/Contacts`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contacts {
    /// Time and coordinate system.
    pub header: Header,
    /// Name of the array.
    pub name: String,
    /// Name of the estimator.
    pub estimator: String,
    /// Limitations of the result, by name.
    pub flags: Vec<String>,
    /// The contacts that have a centre of pressure.
    pub contacts: Vec<Contact>,
}

impl Message for Contacts {
    const NAME: &'static str = "dermis_msgs/msg/Contacts";
    const TEXT: &'static str = include_str!("../msg/Contacts.msg");
    const USES: &'static [Definition] =
        &[HEADER, TIME, ("dermis_msgs/Contact", include_str!("../msg/Contact.msg")), POINT];
}
