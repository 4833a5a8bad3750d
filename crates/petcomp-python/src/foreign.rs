//! Pixels in the memory of an array of NumPy: the only unsafe code of this package.
#![allow(unsafe_code, reason = "Python owns the memory")]

use bytemuck::Pod;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
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
    pub(crate) fn view(&self) -> ImageView<'_, P> {
        // SAFETY: that is how it was made.
        let pixels = unsafe { std::slice::from_raw_parts(self.first, self.width * self.height) };
        ImageView::new(self.width, self.height, pixels)
    }
}

/// The pixels of an array of numbers, which has a last axis of as many as a pixel is made of, where
/// they are; where they do not lie row by row, those of a copy.
pub(crate) fn foreign<T: Element, P: Pod>(
    array: &Bound<'_, PyUntypedArray>,
    [width, height]: [usize; 2],
) -> PyResult<Foreign<P>> {
    let py = array.py();
    let numpy = py.import("numpy")?;
    // Contiguous and aligned.
    let plain = numpy.call_method1("require", (array, numpy::dtype::<T>(py), ["C", "A"]))?;
    let plain = plain.cast_into::<PyArrayDyn<T>>()?;
    assert_eq!(
        plain.len() * size_of::<T>(),
        width * height * size_of::<P>()
    );
    Ok(Foreign {
        first: plain.data().cast::<P>().cast_const(),
        _owner: plain.into_any().unbind(),
        width,
        height,
        pixel: PhantomData,
    })
}
