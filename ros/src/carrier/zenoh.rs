//! Zenoh as rmw_zenoh uses it: keys, attachments and liveliness tokens, by which nodes of ROS 2 find and understand each other.
//!
//! ```text
//! key         <domain>/<topic>/<type>/<type hash>
//! attachment  sequence number, time in ns (64 bits each, little-endian), 16, identity of the publisher (16 bytes)
//! token       @ros2_lv/<domain>/<session>/<node>/<number>/<NN, MP or MS>/%/<namespace>/<node's name>[/<topic>/<type>/<type hash>/<quality>]
//! ```
//! In a token slashes of names are written `%`. The identity of a publisher is XXH3-128 of its token. What is latched is kept in a
//! cache, which subscribers ask when they come.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{anyhow, Result};
use twox_hash::XxHash3_128;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::{Config, Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use super::{Carrier, Publisher, Subscription, Taken};
use crate::patches::NodeFields;
use crate::topics::Topic;

/// Root of the tokens.
const TOKENS: &str = "@ros2_lv";
/// Kinds of what has a token: node, publisher, subscription.
const NODE: &str = "NN";
const PUBLISHER: &str = "MP";
const SUBSCRIPTION: &str = "MS";
/// Period in which the number of the last latched message is sent, where it has changed; that of rmw_zenoh.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// Numbers of qualities in tokens, those of the interface rmw: reliable and best effort.
const RELIABILITY: [u8; 2] = [1, 2];
/// Latched, which rmw calls transient local, and volatile.
const DURABILITY: [u8; 2] = [1, 2];
/// The last messages are kept.
const KEEP_LAST: u8 = 1;

/// A node of ROS 2.
pub struct ZenohNode {
    session: Session,
    domain: u32,
    /// Namespace and name of the node in tokens.
    node: String,
    /// Number of what has a token next; that of the node is 0.
    next: AtomicU64,
    _token: LivelinessToken,
}

/// Sends the messages of a topic.
struct ZenohPublisher {
    publisher: AdvancedPublisher<'static>,
    identity: [u8; 16],
    /// Number of the next message, from 1.
    sequence: AtomicU64,
    /// Whether there is a subscriber.
    wanted: Arc<AtomicBool>,
    _token: LivelinessToken,
}

/// Takes the messages of a topic.
struct ZenohSubscription {
    _subscriber: Subscriber<()>,
    _token: LivelinessToken,
}

/// An error of Zenoh, in words.
fn failed(what: &str) -> impl Fn(zenoh::Error) -> anyhow::Error + '_ {
    move |error| anyhow!("{what}: {error}")
}

/// A name in a token.
fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

/// The key of a topic's messages.
fn key(domain: u32, topic: &Topic) -> String {
    format!("{domain}/{}/{}/{}", topic.name.trim_start_matches('/'), topic.dds_type(), topic.type_hash)
}

/// The quality of a topic in its token; the fields without a value are deadline, lifespan and liveliness, which are those of rmw.
fn quality(topic: &Topic) -> String {
    let reliability = RELIABILITY[usize::from(!topic.quality.reliable)];
    let durability = DURABILITY[usize::from(!topic.quality.latched)];
    format!("{reliability}:{durability}:{KEEP_LAST},{}:,:,:,,", topic.quality.depth)
}

impl Subscription for ZenohSubscription {}

impl ZenohNode {
    /// Opens a session and announces the node.
    ///
    /// # Errors
    /// An address that cannot be listened on.
    pub fn open(fields: &NodeFields) -> Result<ZenohNode> {
        let NodeFields { name, namespace, domain, connect, listen, .. } = fields;
        let mut config = Config::default();
        let list = |addresses: &[String]| format!("{addresses:?}");
        for (option, value) in [
            ("mode", "\"peer\"".to_owned()),
            ("connect/endpoints", list(connect)),
            ("listen/endpoints", list(listen)),
            ("scouting/multicast/enabled", "false".into()),
            ("timestamping/enabled", "true".into()),
        ] {
            config.insert_json5(option, &value).map_err(failed(option))?;
        }
        let session = zenoh::open(config).wait().map_err(failed(&format!("node.listen = {}", list(listen))))?;
        let node = format!("{}/{}", mangled(namespace), mangled(name));
        let token = format!("{TOKENS}/{domain}/{}/0/0/{NODE}/%/{node}", session.zid());
        let token = session.liveliness().declare_token(token).wait().map_err(failed("the node's token"))?;
        Ok(ZenohNode { session, domain: *domain, node, next: AtomicU64::new(1), _token: token })
    }

    /// Announces a publisher or a subscription; its token as text.
    fn announce(&self, kind: &str, topic: &Topic) -> Result<(LivelinessToken, String)> {
        let Topic { name, type_hash, .. } = topic;
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let (session, domain, node, name) = (self.session.zid(), self.domain, &self.node, mangled(name));
        let (dds_type, quality) = (topic.dds_type(), quality(topic));
        let text =
            format!("{TOKENS}/{domain}/{session}/0/{number}/{kind}/%/{node}/{name}/{dds_type}/{type_hash}/{quality}");
        let token = self.session.liveliness().declare_token(text.clone()).wait().map_err(failed(&topic.name))?;
        Ok((token, text))
    }
}

impl Carrier for ZenohNode {
    fn address(&self) -> String {
        let addresses: Vec<String> = self.session.info().locators().wait().iter().map(ToString::to_string).collect();
        addresses.join(", ")
    }

    fn publisher(&self, topic: &Topic) -> Result<Box<dyn Publisher>> {
        let (reliability, congestion) = match topic.quality.reliable {
            true => (Reliability::Reliable, CongestionControl::Block),
            false => (Reliability::BestEffort, CongestionControl::Drop),
        };
        let plain = self.session.declare_publisher(key(self.domain, topic));
        let plain = plain.congestion_control(congestion).reliability(reliability);
        let publisher = match topic.quality.latched {
            true => plain
                .cache(CacheConfig::default().max_samples(topic.quality.depth))
                .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
                .publisher_detection()
                .wait(),
            false => plain.advanced().wait(),
        };
        let publisher = publisher.map_err(failed(&topic.name))?;
        let wanted = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&wanted);
        let listener =
            publisher.matching_listener().callback(move |status| seen.store(status.matching(), Ordering::Relaxed));
        listener.background().wait().map_err(failed(&topic.name))?;
        let matching = publisher.matching_status().wait().map_err(failed(&topic.name))?.matching();
        wanted.fetch_or(matching, Ordering::Relaxed);
        let (token, text) = self.announce(PUBLISHER, topic)?;
        let identity = XxHash3_128::oneshot(text.as_bytes()).to_le_bytes();
        Ok(Box::new(ZenohPublisher { publisher, identity, sequence: AtomicU64::new(1), wanted, _token: token }))
    }

    fn subscription(&self, topic: &Topic, taken: Taken) -> Result<Box<dyn Subscription>> {
        let subscriber = self.session.declare_subscriber(key(self.domain, topic));
        let subscriber = subscriber.callback(move |_| taken()).wait().map_err(failed(&topic.name))?;
        let (token, _) = self.announce(SUBSCRIPTION, topic)?;
        Ok(Box::new(ZenohSubscription { _subscriber: subscriber, _token: token }))
    }

    fn close(self: Box<Self>) -> Result<()> {
        self.session.close().wait().map_err(failed("the session"))
    }
}

impl Publisher for ZenohPublisher {
    fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    fn put(&self, cdr: Vec<u8>) -> Result<()> {
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64);
        let attachment = attachment(sequence, now, &self.identity);
        self.publisher
            .put(cdr)
            .attachment(attachment)
            .wait()
            .map_err(|error| anyhow!("{}: {error}", self.publisher.key_expr()))
    }
}

/// What goes with a message.
fn attachment(sequence: u64, time_ns: u64, identity: &[u8; 16]) -> Vec<u8> {
    let mut bytes = [sequence.to_le_bytes(), time_ns.to_le_bytes()].concat();
    bytes.push(identity.len() as u8);
    bytes.extend(identity);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topics::{diagnostics, tf_static, STREAM};
    use dermis_golden::data::recording::message::WrenchStamped;

    #[test]
    fn keys_and_qualities_are_those_of_rmw_zenoh() {
        let topic = Topic::of::<WrenchStamped>("/hand/thumb/wrench", STREAM);
        let hash = "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77";
        let wanted = format!("7/hand/thumb/wrench/geometry_msgs::msg::dds_::WrenchStamped_/{hash}");
        assert_eq!(key(7, &topic), wanted);
        assert_eq!(quality(&topic), "2:2:1,1:,:,:,,");
        assert_eq!(quality(&diagnostics()), "1:2:1,10:,:,:,,");
        assert_eq!(quality(&tf_static()), "1:1:1,1:,:,:,,");
    }

    #[test]
    fn an_attachment_has_number_time_and_identity() {
        let bytes = attachment(3, 0x0102, &[7; 16]);
        let head = [3, 0, 0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 16];
        assert_eq!((&bytes[..17], &bytes[17..]), (&head[..], &[7; 16][..]));
    }

    /// As the published definition of XXH3 gives it for an empty text.
    #[test]
    fn an_identity_is_the_hash_of_the_token() {
        assert_eq!(XxHash3_128::oneshot(b""), 0x99aa_06d3_0147_98d8_6001_c324_468d_497f);
    }
}
