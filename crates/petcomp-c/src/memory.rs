//! The caller's memory: pointers checked as far as possible, read in place, written by copying.
#![expect(unsafe_code, reason = "C owns the memory")]

use crate::status::{Failure, Status};
use bytemuck::Pod;
use std::ffi::{CStr, c_char};

/// Values of the caller, read in place.
///
/// # Safety
/// `pointer` is null or points to `count` values that are not written to while in use.
pub(crate) unsafe fn slice<'a, T: Pod>(
    name: &str,
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], Failure> {
    check(name, pointer, count)?;
    // SAFETY: checked as far as possible; the rest is promised.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// An array of fixed length.
///
/// # Safety
/// As [`slice`].
pub(crate) unsafe fn array<T: Pod, const N: usize>(
    name: &str,
    pointer: *const T,
) -> Result<[T; N], Failure> {
    // SAFETY: promised.
    let values = unsafe { slice(name, pointer, N) }?;
    Ok(std::array::from_fn(|i| values[i]))
}

/// Writes values into a buffer of the caller.
///
/// # Safety
/// `buffer` is null or points to room for `capacity` values.
pub(crate) unsafe fn store<T: Pod>(
    name: &str,
    values: &[T],
    buffer: *mut T,
    capacity: usize,
) -> Result<(), Failure> {
    if capacity < values.len() {
        return Err(too_small(name, capacity, values.len()));
    }
    check(name, buffer, values.len())?;
    // SAFETY: there is room; our values do not overlap the caller's memory.
    unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), buffer, values.len()) };
    Ok(())
}

/// Writes one value.
///
/// # Safety
/// As [`store`].
pub(crate) unsafe fn put<T: Pod>(name: &str, value: T, place: *mut T) -> Result<(), Failure> {
    // SAFETY: promised.
    unsafe { store(name, &[value], place, 1) }
}

/// Text of the caller.
///
/// # Safety
/// `pointer` is null or points to text that ends with a NUL.
pub(crate) unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, Failure> {
    check(name, pointer, 1)?;
    // SAFETY: promised.
    let text = unsafe { CStr::from_ptr(pointer) }.to_str();
    text.map_err(|e| Failure::argument(name, format_args!("{e}, expected UTF-8")))
}

/// Texts of the caller.
///
/// # Safety
/// `pointer` is null (if `count` is 0) or points to `count` [`text`]s.
pub(crate) unsafe fn texts<'a>(
    name: &str,
    pointer: *const *const c_char,
    count: usize,
) -> Result<Vec<&'a str>, Failure> {
    if count == 0 {
        return Ok(Vec::new());
    }
    check(name, pointer, count)?;
    // SAFETY: promised.
    let pointers = unsafe { std::slice::from_raw_parts(pointer, count) };
    // SAFETY: promised.
    let texts = pointers.iter().map(|&one| unsafe { text(name, one) });
    texts.collect()
}

/// Writes text with its NUL into a buffer of the caller, and its size in bytes to `length`, if that
/// is not null. The size comes first, so that it is known even if the buffer is too small.
///
/// # Safety
/// As [`store`].
pub(crate) unsafe fn store_text(
    name: &str,
    text: &str,
    buffer: *mut c_char,
    capacity: usize,
    length: *mut usize,
) -> Result<(), Failure> {
    let bytes: Vec<c_char> = text.bytes().chain([0]).map(|b| b as c_char).collect();
    if !length.is_null() {
        // SAFETY: promised.
        unsafe { put("length", bytes.len(), length) }?;
    }
    // SAFETY: promised.
    unsafe { store(name, &bytes, buffer, capacity) }
}

fn too_small(name: &str, capacity: usize, needed: usize) -> Failure {
    let message = format!("{name}: capacity {capacity}, expected at least {needed}");
    Failure::new(Status::BufferTooSmall, message)
}

fn check<T>(name: &str, pointer: *const T, count: usize) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::argument(name, "null, expected a pointer"));
    }
    if !pointer.is_aligned() {
        let what = format_args!("misaligned, expected a multiple of {}", align_of::<T>());
        return Err(Failure::argument(name, what));
    }
    let bytes = count.checked_mul(size_of::<T>());
    match bytes.and_then(|bytes| isize::try_from(bytes).ok()) {
        Some(_) => Ok(()),
        None => Err(Failure::argument(
            name,
            format_args!("{count} values, more than memory can hold"),
        )),
    }
}
