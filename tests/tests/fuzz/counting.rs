//! An allocator that counts, so that no input can fill the memory unseen.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts what is allocated: now, and the most since it was last asked.
pub struct Counting;
/// Bytes allocated now.
pub static NOW: AtomicUsize = AtomicUsize::new(0);
/// The most since it was last set.
pub static MOST: AtomicUsize = AtomicUsize::new(0);

// Every call is passed on as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(now, Ordering::Relaxed);
        System.alloc(layout)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        System.dealloc(pointer, layout);
    }
}
