//! The program's heap: glibc's, with few arenas and huge pages.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's heap, with huge pages requested for large blocks.
///
/// Linux maps memory on first touch, 4 KiB at a time: 40 thousand times for a 4K cut-out, which takes three times as
/// long as computing it. Where huge pages are available on request, as in most distributions, 2 MiB are mapped at once.
/// Only whole huge pages inside a block are requested, so that its neighbours do not grow; in a block that is hardly
/// used, each place that is used may take up to 2 MiB.
struct Heap;

#[global_allocator]
static HEAP: Heap = Heap;

/// Size of a huge page; a larger one elsewhere does no harm.
const HUGE_PAGE: usize = 2 << 20;
/// Blocks of at least this size contain at least three huge pages.
const MIN_LARGE_BLOCK: usize = 4 * HUGE_PAGE;

/// The block, after requesting its whole huge pages.
#[expect(unsafe_code, reason = "advice on memory is given by address")]
fn advised(block: *mut u8, size: usize) -> *mut u8 {
    if size >= MIN_LARGE_BLOCK && !block.is_null() {
        let before = block.addr().next_multiple_of(HUGE_PAGE) - block.addr();
        let whole = (size - before) / HUGE_PAGE * HUGE_PAGE;
        // SAFETY: these pages are inside the block, and the advice does not change their contents. A system without
        // huge pages rejects it, which is fine.
        unsafe { libc::madvise(block.add(before).cast(), whole, libc::MADV_HUGEPAGE) };
    }
    block
}

#[expect(unsafe_code, reason = "an allocator is unsafe by its trait")]
// SAFETY: every call is the system's own; blocks are what it returned.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: guaranteed by the caller.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: guaranteed by the caller.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: guaranteed by the caller.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: guaranteed by the caller.
        advised(unsafe { System.realloc(block, layout, size) }, size)
    }
}

/// By default glibc creates eight arenas per core and keeps in each what threads have freed: a sixth of the memory of
/// `dataset generate -j 8`. Four are no slower. Freed memory is returned to the system only above a threshold: the next
/// picture needs it again, and the system clears everything that it hands out.
#[expect(
    unsafe_code,
    reason = "a function of C, which takes two numbers; no other thread has begun"
)]
pub(crate) fn tune() {
    const MAX_ARENAS: i32 = 4;
    const MAX_FREE_BYTES: i32 = 1 << 30;
    // The largest that glibc accepts; if it were not set, it would be 128 KiB once the other is
    // set.
    const MAX_HEAP_BLOCK_BYTES: i32 = 32 << 20;
    // SAFETY: sound for any numbers.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, MAX_ARENAS);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MAX_FREE_BYTES);
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAX_HEAP_BLOCK_BYTES);
    }
}
