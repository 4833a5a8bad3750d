//! The heap of the program: glibc's, with few arenas and huge pages.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's heap, whose large blocks ask for huge pages.
///
/// Linux hands out memory when it is first touched, 4 KiB at a time: 40 thousand times for a cut-out of 4K, which takes
/// three times as long as making it. Where huge pages are to be had on request, as in most distributions, 2 MiB come at
/// once. Only whole huge pages inside of a block are asked for, so that its neighbours do not grow; of a block that is
/// hardly used each place that is may take up to 2 MiB.
struct Heap;

#[global_allocator]
static HEAP: Heap = Heap;

/// Size of a huge page; what is larger elsewhere takes no harm.
const HUGE_PAGE: usize = 2 << 20;
/// Blocks from this size on have at least three huge pages in them.
const MIN_LARGE_BLOCK: usize = 4 * HUGE_PAGE;

/// The block; its whole huge pages are asked for as such.
#[expect(unsafe_code, reason = "advice on memory is given by address")]
fn advised(block: *mut u8, size: usize) -> *mut u8 {
    if size >= MIN_LARGE_BLOCK && !block.is_null() {
        let before = block.addr().next_multiple_of(HUGE_PAGE) - block.addr();
        let whole = (size - before) / HUGE_PAGE * HUGE_PAGE;
        // SAFETY: these pages lie inside the block, and the advice changes nothing that is in them. Where the system knows
        // no huge pages it refuses, which is as good.
        unsafe { libc::madvise(block.add(before).cast(), whole, libc::MADV_HUGEPAGE) };
    }
    block
}

#[expect(unsafe_code, reason = "an allocator is unsafe by its trait")]
// SAFETY: every call is the system's own; blocks are what it gave.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller has it.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller has it.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller has it.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller has it.
        advised(unsafe { System.realloc(block, layout, size) }, size)
    }
}

/// By default glibc makes eight heaps for each core and keeps in each what threads have freed: a
/// sixth of the memory of `dataset generate -j 8`. Four take no longer. What is freed goes back to the
/// system only beyond some size: the next picture needs it again, and the system clears all that it
/// hands out.
#[expect(
    unsafe_code,
    reason = "a function of C, which takes two numbers; no other thread has begun"
)]
pub(crate) fn tune() {
    const MAX_ARENAS: i32 = 4;
    const MAX_FREE_BYTES: i32 = 1 << 30;
    // The largest that glibc takes; without it, it would be 128 KiB once the other is set.
    const MAX_HEAP_BLOCK_BYTES: i32 = 32 << 20;
    // SAFETY: sound for any numbers.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, MAX_ARENAS);
        libc::mallopt(libc::M_TRIM_THRESHOLD, MAX_FREE_BYTES);
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAX_HEAP_BLOCK_BYTES);
    }
}
