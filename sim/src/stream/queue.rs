//! The queue between the thread that reads and the one that reconstructs.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// What happens to a line where the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Reading waits; nothing is lost as long as the source waits as well.
    All,
    /// The oldest line is dropped.
    Latest,
}

/// A queue of at most `length` items, in order.
pub(super) struct Queue<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    length: usize,
    policy: Policy,
}

struct State<T> {
    items: VecDeque<T>,
    /// Number of items that found it full.
    full: u64,
    closed: bool,
}

impl<T> Queue<T> {
    /// An empty queue; `length` is at least one.
    pub(super) fn new(length: usize, policy: Policy) -> Self {
        let state = State { items: VecDeque::new(), full: 0, closed: false };
        Queue { state: Mutex::new(state), changed: Condvar::new(), length: length.max(1), policy }
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an item; returns whether the queue still takes any.
    pub(super) fn push(&self, item: T) -> bool {
        let mut state = self.lock();
        state.full += u64::from(state.items.len() >= self.length);
        while self.policy == Policy::All && state.items.len() >= self.length && !state.closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.items.len() >= self.length {
            state.items.pop_front();
        }
        state.items.push_back(item);
        self.changed.notify_all();
        !state.closed
    }

    /// Ends the queue: what it holds is still taken.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// The oldest item and the number of items so far that found the queue full; waits for one, `None` once the queue is closed and
    /// empty.
    pub(super) fn pop(&self) -> (Option<T>, u64) {
        let mut state = self.lock();
        while state.items.is_empty() && !state.closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        let item = state.items.pop_front();
        self.changed.notify_all();
        (item, state.full)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_are_kept_in_order_and_the_others_counted() {
        let queue = Queue::new(3, Policy::Latest);
        assert!((0..10).all(|k| queue.push(k)));
        queue.close();
        let taken: Vec<(Option<i32>, u64)> = (0..4).map(|_| queue.pop()).collect();
        assert_eq!(taken, [(Some(7), 7), (Some(8), 7), (Some(9), 7), (None, 7)]);
        assert!(!queue.push(1));
    }

    #[test]
    fn all_wait_for_room_and_arrive_in_order() {
        let queue = Queue::new(2, Policy::All);
        let taken: Vec<i32> = std::thread::scope(|scope| {
            scope.spawn(|| {
                assert!((0..1000).all(|k| queue.push(k)));
                queue.close();
            });
            std::iter::from_fn(|| {
                assert!(queue.lock().items.len() <= 2);
                queue.pop().0
            })
            .collect()
        });
        assert!(taken.into_iter().eq(0..1000));
    }

    #[test]
    fn closing_frees_a_reader_that_waits() {
        let queue = Queue::new(1, Policy::All);
        assert!(queue.push(1));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| queue.push(2));
            queue.close();
            assert!(!waiting.join().unwrap());
        });
    }
}
