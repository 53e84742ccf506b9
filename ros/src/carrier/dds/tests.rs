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
    let of = |topic: &Topic| (qos(topic.quality).reliability(), qos(topic.quality).durability());
    let (reliable, last) =
        (Some(Reliability::Reliable { max_blocking_time: BLOCKING }), |depth| Some(History::KeepLast { depth }));
    assert_eq!(of(&tf_static()), (reliable, Some(Durability::TransientLocal)));
    assert_eq!(of(&diagnostics()), (reliable, Some(Durability::Volatile)));
    let stream = qos(STREAM);
    assert_eq!((stream.reliability(), stream.history()), (Some(Reliability::BestEffort), last(1)));
    assert_eq!(qos(diagnostics().quality).history(), last(10));
}
