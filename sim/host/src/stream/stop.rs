//! The end of streams that another thread asks for.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use super::queue::Queue;

/// Something that can be closed.
trait Close: Send + Sync {
    fn close(&self);
}

impl<T: Send> Close for Queue<T> {
    fn close(&self) {
        Queue::close(self);
    }
}

/// Ends streams from another thread; a stream that has not begun ends at once.
#[derive(Clone, Default)]
pub struct Stop(Arc<Mutex<Stopping>>);

#[derive(Default)]
struct Stopping {
    stopped: bool,
    /// The queues of the streams that run.
    queues: Vec<Weak<dyn Close>>,
}

impl Stop {
    fn lock(&self) -> MutexGuard<'_, Stopping> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends them after the line that is being answered.
    pub fn now(&self) {
        let mut stopping = self.lock();
        stopping.stopped = true;
        stopping.queues.drain(..).filter_map(|queue| queue.upgrade()).for_each(|queue| queue.close());
    }

    /// Whether they are to end.
    pub(super) fn stopped(&self) -> bool {
        self.lock().stopped
    }

    /// Closes a queue too, which frees who waits for it.
    pub(super) fn add<T: Send + 'static>(&self, queue: &Arc<Queue<T>>) {
        let queue: Arc<dyn Close> = queue.clone();
        self.lock().queues.push(Arc::downgrade(&queue));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::queue::Bell;
    use crate::stream::Policy;
    use std::sync::mpsc::channel;

    #[test]
    fn a_stream_that_waits_for_a_line_is_freed() {
        let (ring, rung) = channel();
        let (stop, queue) = (Stop::default(), Arc::new(Queue::<u8>::new(1, Policy::All, Bell::new(3, ring))));
        stop.add(&queue);
        std::thread::scope(|scope| {
            let waiting = scope.spawn(move || rung.recv());
            stop.now();
            assert_eq!(waiting.join().unwrap(), Ok(3));
        });
        assert!(stop.stopped() && queue.take().ended);
    }
}
