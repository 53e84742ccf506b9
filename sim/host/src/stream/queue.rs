//! The queue between the thread that reads a stream and the one that reconstructs it, perhaps with others.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// What happens to a line where the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Reading waits; nothing is lost as long as the source waits as well.
    All,
    /// The oldest line is dropped.
    Latest,
}

/// Tells the thread that reconstructs which of its queues has something, once until that is heard.
pub(super) struct Bell {
    /// Number of the queue.
    index: usize,
    rung: AtomicBool,
    heard_by: Sender<usize>,
}

impl Bell {
    /// The bell of the queue with this number.
    pub(super) fn new(index: usize, heard_by: Sender<usize>) -> Arc<Bell> {
        Arc::new(Bell { index, rung: AtomicBool::new(false), heard_by })
    }

    /// Sends the number, unless it was sent and not heard yet.
    pub(super) fn ring(&self) {
        if !self.rung.swap(true, Ordering::AcqRel) {
            // Where no thread takes it any more, none waits for it.
            let _ = self.heard_by.send(self.index);
        }
    }

    /// Whatever comes from now on rings again.
    pub(super) fn heard(&self) {
        self.rung.store(false, Ordering::Release);
    }
}

/// A queue of at most `length` items, in order.
pub(super) struct Queue<T> {
    state: Mutex<State<T>>,
    /// There is room, or the queue is closed.
    room: Condvar,
    bell: Arc<Bell>,
    length: usize,
    policy: Policy,
}

struct State<T> {
    items: VecDeque<T>,
    /// Number of items that found it full.
    full: u64,
    closed: bool,
}

/// What a queue has.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Taken<T> {
    /// The oldest item.
    pub(super) item: Option<T>,
    /// Number of items so far that found the queue full.
    pub(super) full: u64,
    /// Closed, and nothing left: there will be no further item.
    pub(super) ended: bool,
}

impl<T> Queue<T> {
    /// An empty queue, which rings whenever it changes; `length` is at least one.
    pub(super) fn new(length: usize, policy: Policy, bell: Arc<Bell>) -> Self {
        let state = State { items: VecDeque::new(), full: 0, closed: false };
        Queue { state: Mutex::new(state), room: Condvar::new(), bell, length: length.max(1), policy }
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an item; returns whether the queue still takes any.
    pub(super) fn push(&self, item: T) -> bool {
        let mut state = self.lock();
        state.full += u64::from(state.items.len() >= self.length);
        while self.policy == Policy::All && state.items.len() >= self.length && !state.closed {
            state = self.room.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.items.len() >= self.length {
            state.items.pop_front();
        }
        state.items.push_back(item);
        let open = !state.closed;
        drop(state);
        self.bell.ring();
        open
    }

    /// Whether an item that is added now is not waited for.
    pub(super) fn takes(&self) -> bool {
        let state = self.lock();
        self.policy == Policy::Latest || state.items.len() < self.length || state.closed
    }

    /// Ends the queue: what it holds is still taken.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.room.notify_all();
        self.bell.ring();
    }

    /// Takes the oldest item, if there is one; the bell rings again for what follows it.
    pub(super) fn take(&self) -> Taken<T> {
        self.bell.heard();
        let mut state = self.lock();
        let item = state.items.pop_front();
        let (full, left) = (state.full, state.closed || !state.items.is_empty());
        let ended = state.closed && item.is_none();
        drop(state);
        self.room.notify_all();
        if left && !ended {
            self.bell.ring();
        }
        Taken { item, full, ended }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{channel, Receiver};

    fn queue<T>(length: usize, policy: Policy) -> (Queue<T>, Receiver<usize>) {
        let (ring, rung) = channel();
        (Queue::new(length, policy, Bell::new(7, ring)), rung)
    }

    /// The next item once there is one; `None` at the end.
    fn next<T>(queue: &Queue<T>, rung: &Receiver<usize>) -> Option<T> {
        loop {
            assert_eq!(rung.recv().unwrap(), 7);
            let Taken { item, ended, .. } = queue.take();
            if item.is_some() || ended {
                return item;
            }
        }
    }

    #[test]
    fn the_latest_are_kept_in_order_and_the_others_counted() {
        let (queue, rung) = queue(3, Policy::Latest);
        assert!((0..10).all(|k| queue.push(k)));
        queue.close();
        let taken: Vec<Taken<i32>> = (0..4).map(|_| queue.take()).collect();
        let of = |item, ended| Taken { item, full: 7, ended };
        assert_eq!(taken, [of(Some(7), false), of(Some(8), false), of(Some(9), false), of(None, true)]);
        assert!(!queue.push(1));
        // Once for what was pushed and not heard, and once for each that was left behind one that was taken.
        assert!(rung.try_iter().count() <= 5);
    }

    #[test]
    fn all_wait_for_room_and_arrive_in_order() {
        let (queue, rung) = queue(2, Policy::All);
        let taken: Vec<i32> = std::thread::scope(|scope| {
            scope.spawn(|| {
                assert!((0..1000).all(|k| queue.push(k)));
                queue.close();
            });
            std::iter::from_fn(|| {
                assert!(queue.lock().items.len() <= 2);
                next(&queue, &rung)
            })
            .collect()
        });
        assert!(taken.into_iter().eq(0..1000));
    }

    #[test]
    fn closing_frees_a_reader_that_waits() {
        let (queue, _rung) = queue(1, Policy::All);
        assert!(queue.push(1));
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| queue.push(2));
            queue.close();
            assert!(!waiting.join().unwrap());
        });
    }
}
