//! What carries the messages to other nodes of ROS 2.
//!
//! | module | carries over |
//! |---|---|
//! | `zenoh` | Zenoh, with the names that the middleware `rmw_zenoh` has |
//! | `dds` | DDS, with the names that the middlewares of Cyclone DDS and Fast DDS have |
//! | `graph` | what a node says of itself on DDS |

mod dds;
mod graph;
mod zenoh;

use anyhow::Result;

pub use dds::DdsNode;
pub use zenoh::ZenohNode;

use crate::topics::Topic;

/// Called for each message that is taken.
pub type Taken = Box<dyn Fn() + Send + Sync>;

/// A node of ROS 2 in its network.
pub trait Carrier: Send + Sync {
    /// Where other nodes find it, in words.
    fn address(&self) -> String;

    /// Begins to publish a topic.
    ///
    /// # Errors
    /// A network that refuses it.
    fn publisher(&self, topic: &Topic) -> Result<Box<dyn Publisher>>;

    /// Begins to take the messages of a topic, for each of which `taken` is called.
    ///
    /// # Errors
    /// A network that refuses it.
    fn subscription(&self, topic: &Topic, taken: Taken) -> Result<Box<dyn Subscription>>;

    /// Says that all publishers and subscriptions are there.
    ///
    /// # Errors
    /// A network that refuses it.
    fn complete(&self) -> Result<()> {
        Ok(())
    }

    /// Leaves the network: what was sent so far leaves first.
    ///
    /// # Errors
    /// A network that cannot be left.
    fn close(self: Box<Self>) -> Result<()>;
}

/// Sends the messages of a topic.
pub trait Publisher: Send + Sync {
    /// Whether there is a subscriber.
    fn is_wanted(&self) -> bool;

    /// Sends a message in CDR, with its encapsulation.
    ///
    /// # Errors
    /// A network that is left.
    fn put(&self, cdr: Vec<u8>) -> Result<()>;
}

/// Takes the messages of a topic as long as it is kept.
pub trait Subscription: Send + Sync {}
