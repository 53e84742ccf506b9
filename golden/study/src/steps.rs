//! Steps of a study whose frames are computed side by side.

use std::sync::atomic::{AtomicUsize, Ordering};

/// What counts a step each time that it is called, and gives `progress` the number of steps done and the `total`.
pub(crate) fn steps(progress: &(dyn Fn(usize, usize) + Sync), total: usize) -> impl Fn() + Sync + '_ {
    let done = AtomicUsize::new(0);
    move || progress(done.fetch_add(1, Ordering::Relaxed) + 1, total)
}
