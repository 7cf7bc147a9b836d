//! Memory that a thread takes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static NOW: Cell<usize> = const { Cell::new(0) };
    static MOST: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, which counts what each thread holds: `#[global_allocator]` of tests that state a limit.
pub struct Counting;

/// Adds to what this thread holds; what another thread had taken may be given back here, so it stops at nothing.
fn count(more: usize, less: usize) {
    // While a thread ends there is nothing to count.
    let _ended = NOW.try_with(|now| {
        now.set((now.get() + more).saturating_sub(less));
        MOST.with(|most| most.set(most.get().max(now.get())));
    });
}

#[expect(unsafe_code, reason = "allocators are unsafe by their trait; all is handed on to the system's")]
// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(0, layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size, layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

/// Begins to count on this thread.
pub(super) fn start() {
    NOW.set(0);
    MOST.set(0);
}

/// The most bytes that this thread held at a time since [`start`].
pub(super) fn most() -> usize {
    MOST.get()
}
