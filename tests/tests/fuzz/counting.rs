//! An allocator that counts, so that no input can fill the memory unseen. Each thread has its own count.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Counts what is allocated.
pub struct Counting;

thread_local! {
    /// Bytes of this thread: now, and the most since [`mark`].
    static BYTES: Cell<[isize; 2]> = const { Cell::new([0, 0]) };
}

fn count(bytes: isize) {
    // A thread that ends frees its last things without its counts.
    let _ = BYTES.try_with(|count| {
        let [now, most] = count.get();
        count.set([now + bytes, most.max(now + bytes)]);
    });
}

/// Bytes allocated now; counting for [`most_since`] begins.
pub fn mark() -> isize {
    BYTES.with(|count| {
        let [now, _] = count.get();
        count.set([now, now]);
        now
    })
}

/// The most bytes since a mark.
pub fn most_since(mark: isize) -> usize {
    BYTES.with(|count| (count.get()[1] - mark).max(0) as usize)
}

// Every call is passed on as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        System.alloc(layout)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        System.dealloc(pointer, layout);
    }
}
