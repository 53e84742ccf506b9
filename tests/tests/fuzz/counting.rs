//! A counting allocator, to detect input that allocates too much memory. Each thread has its own count.
#![allow(unsafe_code, reason = "an allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Allocator that counts allocated bytes.
pub struct Counting;

thread_local! {
    /// Bytes of this thread: allocated now, and the maximum since [`mark`].
    static BYTES: Cell<[isize; 2]> = const { Cell::new([0, 0]) };
}

fn count(bytes: isize) {
    // At the end of a thread memory is freed after its counts are gone.
    let _ = BYTES.try_with(|count| {
        let [now, most] = count.get();
        count.set([now + bytes, most.max(now + bytes)]);
    });
}

/// Bytes allocated now; starts the measurement of [`most_since`].
pub fn mark() -> isize {
    BYTES.with(|count| {
        let [now, _] = count.get();
        count.set([now, now]);
        now
    })
}

/// Maximum number of bytes allocated since [`mark`].
pub fn most_since(mark: isize) -> usize {
    BYTES.with(|count| (count.get()[1] - mark).max(0) as usize)
}

// All calls are forwarded unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        unsafe { System.dealloc(pointer, layout) };
    }
}
