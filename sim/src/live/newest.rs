//! The newest picture: one slot, written by the source, read by every client.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// A picture as JSON, with its number from 1.
pub type Numbered = (u64, Arc<str>);

/// The slot; a picture replaces the one before it.
#[derive(Default)]
pub struct Newest {
    slot: Mutex<Option<Numbered>>,
    changed: Condvar,
}

impl Newest {
    /// Replaces the picture.
    pub fn publish(&self, picture: String) {
        let mut slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        let number = slot.as_ref().map_or(0, |(number, _)| *number) + 1;
        *slot = Some((number, picture.into()));
        self.changed.notify_all();
    }

    /// The newest picture once its number is above `seen`; `None` if there is none within `wait`.
    pub fn after(&self, seen: u64, wait: Duration) -> Option<Numbered> {
        let slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        let old = |slot: &mut Option<Numbered>| slot.as_ref().is_none_or(|(number, _)| *number <= seen);
        let (slot, late) = self.changed.wait_timeout_while(slot, wait, old).unwrap_or_else(PoisonError::into_inner);
        (!late.timed_out()).then(|| slot.clone()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_is_handed_out_and_only_once() {
        let newest = Newest::default();
        let wait = Duration::from_millis(1);
        assert_eq!(newest.after(0, wait), None);
        newest.publish("a".into());
        newest.publish("b".into());
        assert_eq!(newest.after(0, wait), Some((2, "b".into())));
        assert_eq!(newest.after(2, wait), None);
        std::thread::scope(|scope| {
            scope.spawn(|| newest.publish("c".into()));
            assert_eq!(newest.after(2, Duration::from_secs(10)), Some((3, "c".into())));
        });
    }
}
