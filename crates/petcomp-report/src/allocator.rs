//! The system's allocator, which reports large allocations to the library, for `petcomp-report
//! work`.

#![expect(
    unsafe_code,
    reason = "an allocator cannot be written without; every call goes to the system's as it came"
)]

use petcomp::work::allocated;
use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator with a counter.
struct CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

// SAFETY: all guarantees are those of `System`, which gets the same arguments; counting neither
// allocates nor panics.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        allocated(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        allocated(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Shrinking allocates nothing.
        if size > layout.size() {
            allocated(size);
        }
        unsafe { System.realloc(at, layout, size) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}
