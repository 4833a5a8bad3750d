//! Pixels in the memory of an array of NumPy: the only unsafe code of this package.
#![allow(unsafe_code, reason = "Python owns the memory")]

use bytemuck::Pod;
use petcomp::ImageView;
use pyo3::prelude::*;
use std::marker::PhantomData;

/// Pixels that an array holds, kept alive by it.
///
/// As with every library that computes beside the interpreter, nobody must write to an array while
/// it is worked on.
pub(crate) struct Foreign<P> {
    /// Never looked at: it only has to live.
    _owner: Py<PyAny>,
    first: *const P,
    width: usize,
    height: usize,
    pixel: PhantomData<P>,
}

// SAFETY: it is only read, of plain data, and the owner's count is kept by PyO3 on any thread.
unsafe impl<P: Pod + Sync> Send for Foreign<P> {}
// SAFETY: as above.
unsafe impl<P: Pod + Sync> Sync for Foreign<P> {}

impl<P: Pod> Foreign<P> {
    /// The pixels of an array.
    ///
    /// # Safety
    /// `first` points to `width * height` pixels row by row, aligned, in memory that `owner` keeps.
    pub(crate) unsafe fn new(
        owner: Py<PyAny>,
        first: *const P,
        [width, height]: [usize; 2],
    ) -> Self {
        Self {
            _owner: owner,
            first,
            width,
            height,
            pixel: PhantomData,
        }
    }

    pub(crate) fn view(&self) -> ImageView<'_, P> {
        // SAFETY: that is what `new` asks for.
        let pixels = unsafe { std::slice::from_raw_parts(self.first, self.width * self.height) };
        ImageView::new(self.width, self.height, pixels)
    }
}
