//! Pointers of the caller: arguments that are null are errors that name the argument.
//!
//! All functions here trust the caller in the same way, as the top of the header says: a pointer
//! that is not null points to as many valid values as documented, which nobody changes meanwhile.

use crate::fault::Fault;
use std::ffi::{CStr, c_char};

fn null(name: &str) -> Fault {
    Fault::usage(format!("`{name}` is a null pointer"))
}

/// A handle or callback, unless it is null.
pub fn given<T>(value: Option<T>, name: &str) -> Result<T, Fault> {
    value.ok_or_else(|| null(name))
}

fn aligned<T>(pointer: *const T, name: &str) -> Result<(), Fault> {
    match (pointer.is_null(), pointer.is_aligned()) {
        (true, _) => Err(null(name)),
        (_, false) => Err(Fault::usage(format!("`{name}` is not aligned to {} bytes", align_of::<T>()))),
        _ => Ok(()),
    }
}

/// An array of `count` values; null is allowed if there are none.
///
/// # Safety
/// A pointer that is not null points to `count` values that live and do not change during `'a`.
pub unsafe fn array<'a, T>(pointer: *const T, count: usize, name: &str) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    aligned(pointer, name)?;
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Fault::usage(format!("`{name}` cannot have {count} elements")));
    }
    // SAFETY: not null, aligned and not longer than memory; the rest is the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// An array of `count` values that is changed.
///
/// # Safety
/// A pointer that is not null points to `count` values that nobody else uses during `'a`.
pub unsafe fn array_mut<'a, T>(pointer: *mut T, count: usize, name: &str) -> Result<&'a mut [T], Fault> {
    if count == 0 {
        return Ok(&mut []);
    }
    aligned(pointer, name)?;
    // SAFETY: not null and aligned; the rest is the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// A text in UTF-8.
///
/// # Safety
/// A pointer that is not null points to a text that ends in NUL and does not change during `'a`.
pub unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Fault> {
    // SAFETY: the caller's promise.
    unsafe { optional_text(pointer, name) }?.ok_or_else(|| null(name))
}

/// A text in UTF-8, or `None` for a null pointer.
///
/// # Safety
/// As for [`text`].
pub unsafe fn optional_text<'a>(pointer: *const c_char, name: &str) -> Result<Option<&'a str>, Fault> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: not null; the rest is the caller's promise.
    let text = unsafe { CStr::from_ptr(pointer) }.to_str();
    text.map(Some).map_err(|error| Fault::usage(format!("`{name}` is not UTF-8: {error}")))
}

/// Stores a result.
///
/// # Safety
/// A pointer that is not null can be written to.
pub unsafe fn store<T>(to: *mut T, value: T, name: &str) -> Result<(), Fault> {
    aligned(to, name)?;
    // SAFETY: not null and aligned; the rest is the caller's promise.
    unsafe { to.write(value) };
    Ok(())
}

/// Stores a new handle, which the caller owns. Nothing is made if there is no place for it.
///
/// # Safety
/// As for [`store`].
pub unsafe fn store_new<T>(
    to: *mut *mut T,
    make: impl FnOnce() -> Result<T, Fault>,
    name: &str,
) -> Result<(), Fault> {
    // SAFETY: the caller's promise. A failed call leaves a null pointer, which may be freed.
    unsafe { store(to, std::ptr::null_mut(), name) }?;
    let made = Box::into_raw(Box::new(make()?));
    // SAFETY: as above.
    unsafe { store(to, made, name) }
}

/// Stores where an array is, and its number of entries.
///
/// # Safety
/// As for [`store`], for both pointers.
pub unsafe fn store_array<T, P>(
    entries: &[T],
    to: *mut *const P,
    count: *mut usize,
    name: &str,
) -> Result<(), Fault> {
    // SAFETY: the caller's promise.
    unsafe {
        store(to, entries.as_ptr().cast(), name)?;
        store(count, entries.len(), "count")
    }
}

/// Frees a handle; null is ignored.
///
/// # Safety
/// A handle that is not null came from [`store_new`], and is not used afterwards.
pub unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // SAFETY: the caller's promise.
        drop(unsafe { Box::from_raw(handle) });
    }
}
