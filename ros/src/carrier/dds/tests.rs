//! Readers of other participants, and qualities.

use super::*;
use crate::topics::{diagnostics, tf_static, STREAM};
use dermis_golden::data::recording::message::WrenchStamped;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

fn wait(what: &str, until: impl Fn() -> bool) {
    let begun = Instant::now();
    while !until() {
        assert!(begun.elapsed() < Duration::from_secs(30), "{what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Readers of another participant: one that is closed, and one whose participant ends.
#[test]
fn a_topic_is_wanted_while_somebody_reads_it() {
    let fields = NodeFields { domain: 1 + std::process::id() % 200, ..NodeFields::default() };
    let node = DdsNode::open(&fields).unwrap();
    let topic = Topic::of::<WrenchStamped>("/hand/thumb/wrench", STREAM);
    let publisher = node.publisher(&topic).unwrap();
    assert!(!publisher.is_wanted());
    let message = to_cdr(&NodeEntities::default()).unwrap();
    for closed in [true, false] {
        let other = DdsNode::open(&fields).unwrap();
        let taken = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&taken);
        let count = Box::new(move || {
            counted.fetch_add(1, Ordering::Relaxed);
        });
        let subscription = other.subscription(&topic, count).unwrap();
        wait("a reader", || publisher.is_wanted());
        wait("a message", || {
            publisher.put(message.clone()).unwrap();
            taken.load(Ordering::Relaxed) > 0
        });
        if closed {
            drop(subscription);
        } else {
            drop(other);
        }
        wait("no reader", || !publisher.is_wanted());
    }
}

#[test]
fn qualities_are_those_of_the_topics() {
    let reliable = Some(Reliability::Reliable { max_blocking_time: BLOCKING });
    let (latched, volatile) = (Some(Durability::TransientLocal), Some(Durability::Volatile));
    for (topic, burst, wanted, depth) in [
        (tf_static(), 3, (reliable, latched), 1),
        (diagnostics(), 3, (reliable, volatile), 10),
        (Topic::of::<WrenchStamped>("/wrench", STREAM), 3, (Some(Reliability::BestEffort), volatile), 3),
    ] {
        let own = qos(topic.quality, burst);
        assert_eq!((own.reliability(), own.durability()), wanted, "{}", topic.name);
        assert_eq!(own.history(), Some(History::KeepLast { depth }), "{}", topic.name);
    }
}
