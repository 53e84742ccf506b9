//! DDS as the middlewares of ROS 2 use it: names of topics and types, qualities, and what a node says of itself.
//!
//! ```text
//! topic   rt/<topic>, of type package::msg::dds_::Type_
//! node    ros_discovery_info, with the identities of its writers and readers
//! ```
//! One thread takes what comes: messages of subscriptions, and which readers each writer has. DDS finds other processes of this
//! computer at the ports that its standard gives them, others by multicast. The hash of a type is not announced, since `rustdds` has no
//! place for it.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::net::{Ipv4Addr, UdpSocket};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::{anyhow, Context, Result};
use dermis_golden::data::recording::message::to_cdr;
use futures::channel::{mpsc, oneshot};
use futures::executor::block_on;
use futures::stream::{self, BoxStream, StreamExt};
use rustdds::bytes::Bytes;
use rustdds::dds::result::WriteError;
use rustdds::no_key::{DataWriter, Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent, QosPolicies, QosPolicyBuilder,
    RTPSEntity, RepresentationIdentifier, StatusEvented, Timestamp, TopicDescription, TopicKind, GUID,
};
use rustix::process::{getrlimit, setrlimit, Resource, Rlimit};

use super::graph::{self, NodeEntities, ParticipantEntities};
use super::{Carrier, Publisher, Subscription, Taken};
use crate::patches::NodeFields;
use crate::topics::{Quality, Topic};

/// Prefix of the names of topics that are none of DDS' own.
const PREFIX: &str = "rt";
/// Bytes of the encapsulation, which DDS writes itself.
const ENCAPSULATION: usize = 4;
/// Longest wait for readers that have taken none of the last messages; then a message is left out.
const BLOCKING: rustdds::Duration = rustdds::Duration::from_millis(100);
/// Longest wait for readers to have the last messages, at the end.
const LAST: Duration = Duration::from_secs(1);

/// A node of ROS 2, the only one of its process.
pub struct DdsNode {
    participant: DomainParticipant,
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    interfaces: Vec<Ipv4Addr>,
    /// Results of a patch that may follow at once, after a stall: those of the frames that wait, and the next one.
    burst: usize,
    own: Mutex<NodeEntities>,
    graph: Writer,
    matched: Arc<Matched>,
    /// What the thread takes.
    streams: mpsc::UnboundedSender<BoxStream<'static, ()>>,
    /// The thread, and what ends it.
    thread: Option<(oneshot::Sender<()>, JoinHandle<()>)>,
}

type Writer = DataWriter<Bytes, Cdr>;

/// Sends the messages of a topic.
struct DdsPublisher {
    writer: Writer,
    quality: Quality,
    matched: Arc<Matched>,
}

/// Takes the messages of a topic.
struct DdsSubscription {
    /// Ends the stream of messages when dropped.
    _end: oneshot::Sender<()>,
}

/// Messages that are in CDR already; of those that are taken the content is not read.
#[derive(Clone)]
struct Cdr;

impl SerializerAdapter<Bytes> for Cdr {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Bytes) -> Result<Bytes, Infallible> {
        Ok(message.clone())
    }
}

impl DeserializerAdapter<()> for Cdr {
    type Error = Infallible;
    type Decoded = ();

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded((): ()) {}
}

impl DefaultDecoder<()> for Cdr {
    type Decoder = Cdr;

    const DECODER: Cdr = Cdr;
}

impl Decode<'_, ()> for Cdr {
    type Error = Infallible;

    fn decode_bytes(self, _: &[u8], _: RepresentationIdentifier) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Which readers each writer has.
#[derive(Default)]
struct Matched(Mutex<BTreeMap<GUID, BTreeSet<GUID>>>);

impl Matched {
    fn readers(&self) -> MutexGuard<'_, BTreeMap<GUID, BTreeSet<GUID>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the news of a reader that has come or gone.
    fn take(&self, event: &DomainParticipantStatusEvent) {
        match event {
            DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, remote_reader } => {
                self.readers().entry(*local_writer).or_default().insert(*remote_reader);
            }
            DomainParticipantStatusEvent::ReaderLost { guid, .. } => self.keep(|own| own != guid),
            DomainParticipantStatusEvent::ParticipantLost { id, .. } => self.keep(|own| own.prefix != *id),
            _ => (),
        }
    }

    fn keep(&self, readers: impl Fn(&GUID) -> bool) {
        self.readers().values_mut().for_each(|own| own.retain(&readers));
    }

    fn has(&self, writer: GUID) -> bool {
        self.readers().get(&writer).is_some_and(|readers| !readers.is_empty())
    }
}

/// An error of DDS, in words.
fn failed<E: std::fmt::Debug>(what: &str) -> impl Fn(E) -> anyhow::Error + '_ {
    move |error| anyhow!("{what}: {error:?}")
}

/// A topic of ROS 2 on DDS.
fn dds_topic(participant: &DomainParticipant, topic: &Topic, burst: usize) -> Result<rustdds::Topic> {
    // Names of DDS itself begin with no slash.
    let name = if topic.name.starts_with('/') { format!("{PREFIX}{}", topic.name) } else { topic.name.clone() };
    let created = participant.create_topic(name, topic.dds_type(), &qos(topic.quality, burst), TopicKind::NoKey);
    created.map_err(failed(&topic.name))
}

/// The quality of a topic, of whose messages at least `burst` may wait for the thread that sends them unless they are latched.
fn qos(quality: Quality, burst: usize) -> QosPolicies {
    let reliability = match quality.reliable {
        true => Reliability::Reliable { max_blocking_time: BLOCKING },
        false => Reliability::BestEffort,
    };
    let durability = if quality.latched { Durability::TransientLocal } else { Durability::Volatile };
    let depth = if quality.latched { quality.depth } else { quality.depth.max(burst) };
    let depth = i32::try_from(depth).unwrap_or(i32::MAX);
    QosPolicyBuilder::new().reliability(reliability).durability(durability).history(History::KeepLast { depth }).build()
}

/// Lets the process open as many files as the system allows, since every writer and reader has some of its own: two, of hundreds of
/// patches more than a process has by default. Where that is refused the topic says so for which there is none.
fn allow_files() {
    let limit = getrlimit(Resource::Nofile);
    let _ = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit });
}

impl DdsNode {
    /// Joins a domain as one node, on the interfaces of these addresses.
    ///
    /// # Errors
    /// An address that no interface has; ports that cannot be had.
    pub fn open(fields: &NodeFields) -> Result<DdsNode> {
        let NodeFields { name, namespace, domain, interfaces, queue, .. } = fields;
        for own in interfaces {
            UdpSocket::bind((*own, 0)).with_context(|| format!("node.interfaces = {own}"))?;
        }
        allow_files();
        let domain = u16::try_from(*domain)?;
        let builder = DomainParticipantBuilder::new(domain).with_only_networks(interfaces.iter().copied());
        let participant = builder.build().map_err(failed(&format!("node.domain = {domain}")))?;
        let none = QosPolicies::qos_none();
        let publisher = participant.create_publisher(&none).map_err(failed("DDS"))?;
        let subscriber = participant.create_subscriber(&none).map_err(failed("DDS"))?;
        let topic = dds_topic(&participant, &graph::topic(), 1)?;
        let graph = publisher.create_datawriter_no_key(&topic, None).map_err(failed("DDS"))?;
        let (streams, taken) = mpsc::unbounded::<BoxStream<'static, ()>>();
        let (end, ended) = oneshot::channel();
        let thread = std::thread::Builder::new().name("DDS".into()).spawn(move || {
            block_on(taken.flatten_unordered(None).take_until(ended).collect::<()>());
        })?;
        let matched = Arc::new(Matched::default());
        let (seen, listener) = (Arc::clone(&matched), participant.status_listener());
        let events = stream::poll_fn(move |context| listener.as_async_status_stream().poll_next_unpin(context));
        streams.unbounded_send(events.map(move |event| seen.take(&event)).boxed()).map_err(failed("DDS"))?;
        let own = NodeEntities { namespace: namespace.clone(), name: name.clone(), ..NodeEntities::default() };
        let (interfaces, burst, own, thread) = (interfaces.clone(), queue + 1, Mutex::new(own), Some((end, thread)));
        Ok(DdsNode { participant, publisher, subscriber, interfaces, burst, own, graph, matched, streams, thread })
    }

    fn own(&self) -> MutexGuard<'_, NodeEntities> {
        self.own.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Carrier for DdsNode {
    fn address(&self) -> String {
        let addresses: Vec<String> = self.interfaces.iter().map(ToString::to_string).collect();
        format!("DDS domain {} on {}", self.participant.domain_id(), addresses.join(", "))
    }

    fn publisher(&self, topic: &Topic) -> Result<Box<dyn Publisher>> {
        let own = dds_topic(&self.participant, topic, self.burst)?;
        let writer: Writer = self.publisher.create_datawriter_no_key(&own, None).map_err(failed(&topic.name))?;
        self.own().writers.push(writer.guid().to_bytes());
        Ok(Box::new(DdsPublisher { writer, quality: topic.quality, matched: Arc::clone(&self.matched) }))
    }

    fn subscription(&self, topic: &Topic, taken: Taken) -> Result<Box<dyn Subscription>> {
        let own = dds_topic(&self.participant, topic, self.burst)?;
        let reader = self.subscriber.create_datareader_no_key::<(), Cdr>(&own, None).map_err(failed(&topic.name))?;
        self.own().readers.push(reader.guid().to_bytes());
        let (end, ended) = oneshot::channel();
        let samples = reader.async_bare_sample_stream().map(move |sample| sample.map_or((), |()| taken()));
        self.streams.unbounded_send(samples.take_until(ended).boxed()).map_err(failed(&topic.name))?;
        Ok(Box::new(DdsSubscription { _end: end }))
    }

    fn complete(&self) -> Result<()> {
        let participant = self.participant.guid().to_bytes();
        let message = to_cdr(&ParticipantEntities { participant, nodes: vec![self.own().clone()] });
        write(&self.graph, message.map_err(|error| anyhow!("{}: {error}", graph::topic().name))?)
    }

    fn close(self: Box<Self>) -> Result<()> {
        Ok(())
    }
}

impl Drop for DdsNode {
    /// The participant leaves the domain when its last handle is dropped, and the thread has one.
    fn drop(&mut self) {
        if let Some((end, thread)) = self.thread.take() {
            drop(end);
            // A panic of the thread has been printed.
            let _ = thread.join();
        }
    }
}

/// Sends a message in CDR, with its encapsulation; one that readers who do not keep up would hold up is left out.
fn write(writer: &Writer, mut cdr: Vec<u8>) -> Result<()> {
    let body = Bytes::from(cdr.split_off(ENCAPSULATION.min(cdr.len())));
    match writer.write(body, Some(Timestamp::now())) {
        Ok(()) | Err(WriteError::WouldBlock { .. }) => Ok(()),
        Err(error) => Err(anyhow!("{}: {error}", writer.topic().name())),
    }
}

impl Publisher for DdsPublisher {
    fn is_wanted(&self) -> bool {
        self.matched.has(self.writer.guid())
    }

    fn put(&self, cdr: Vec<u8>) -> Result<()> {
        write(&self.writer, cdr)
    }
}

impl Drop for DdsPublisher {
    /// What is latched and what streams has no last message that somebody waits for.
    fn drop(&mut self) {
        if self.quality.reliable && !self.quality.latched {
            // Readers that do not answer have lost it.
            let _ = self.writer.wait_for_acknowledgments(LAST);
        }
    }
}

impl Subscription for DdsSubscription {}
