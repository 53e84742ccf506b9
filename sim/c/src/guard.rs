//! Guard: no panic reaches C. Every function runs inside [`guarded`], which turns an error into a status and keeps its text.
//!
//! | | |
//! |---|---|
//! | in: body of a function | `Result<T, Error>`, or a panic |
//! | out: status | [`dermis_status`] |
//! | out: text | [`dermis_last_error`], per thread |

use std::cell::RefCell;
use std::ffi::{c_char, CStr, CString};
use std::mem::MaybeUninit;
use std::panic::{catch_unwind, AssertUnwindSafe};

use dermis_golden::fixed::FixedError;

/// What became of a call.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum dermis_status {
    /// Done.
    Ok = 0,
    /// An argument, scene or frame cannot be used.
    Input = 1,
    /// The result does not have what was asked for.
    Absent = 2,
    /// Bytes from the link are not a valid packet; the next ones are read.
    Damaged = 3,
    /// The board was built for another scene or version, or does not answer.
    Board = 4,
    /// A defect of Dermis.
    Internal = 5,
}

/// An error: its status and its text.
#[derive(Debug)]
pub struct Error {
    /// What the function returns.
    pub status: dermis_status,
    /// What [`dermis_last_error`] returns.
    pub text: String,
}

impl Error {
    /// An error of the caller.
    pub fn input(text: impl ToString) -> Error {
        Error { status: dermis_status::Input, text: text.to_string() }
    }

    /// The result does not have `what`.
    pub fn absent(what: &str) -> Error {
        Error { status: dermis_status::Absent, text: format!("the result has no {what}") }
    }
}

impl From<FixedError> for Error {
    fn from(error: FixedError) -> Error {
        let status = match error {
            FixedError::Internal(_) | FixedError::Beats { .. } => dermis_status::Internal,
            _ => dermis_status::Input,
        };
        Error { status, text: error.to_string() }
    }
}

impl From<anyhow::Error> for Error {
    fn from(error: anyhow::Error) -> Error {
        match error.downcast::<FixedError>() {
            Ok(error) => error.into(),
            Err(error) => Error::input(error),
        }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

fn keep(text: String) {
    // A text ends at a zero byte in C.
    let text = CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default();
    LAST.with_borrow_mut(|last| *last = text);
}

/// Runs a function's body: its value, or the status of its error or panic.
pub fn attempt<T>(body: impl FnOnce() -> Result<T, Error>) -> Result<T, dermis_status> {
    // What a panic leaves half done is not used again: results are made whole, models stand behind locks.
    let outcome = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
        let text = format!("a defect of Dermis: {}", said.unwrap_or("a panic without text"));
        Err(Error { status: dermis_status::Internal, text })
    });
    outcome.map_err(|error| {
        keep(error.text);
        error.status
    })
}

/// Runs a function's body and returns its status.
pub fn guarded(body: impl FnOnce() -> Result<(), Error>) -> dermis_status {
    attempt(body).err().unwrap_or(dermis_status::Ok)
}

/// Checks that a pointer called `name` is neither NULL nor out of line.
fn check<T>(name: &str, pointer: *const T) -> Result<(), Error> {
    match (pointer.is_null(), pointer.is_aligned()) {
        (true, _) => Err(Error::input(format!("{name} is NULL"))),
        (_, false) => Err(Error::input(format!("{name} = {pointer:p} is not aligned to {} bytes", align_of::<T>()))),
        _ => Ok(()),
    }
}

/// What the argument `name` points to.
///
/// # Errors
/// NULL.
///
/// # Safety
/// The pointer is NULL or one to a value that lives as long as it is used.
pub unsafe fn reference<'a, T>(name: &str, pointer: *const T) -> Result<&'a T, Error> {
    check(name, pointer)?;
    Ok(unsafe { &*pointer })
}

/// What the argument `name` points to, to change it.
///
/// # Errors
/// NULL.
///
/// # Safety
/// As [`reference()`], and nothing else uses it.
pub unsafe fn exclusive<'a, T>(name: &str, pointer: *mut T) -> Result<&'a mut T, Error> {
    check(name, pointer)?;
    Ok(unsafe { &mut *pointer })
}

/// The output to which the argument `name` points; there may be no value yet.
///
/// # Errors
/// NULL.
///
/// # Safety
/// The pointer is NULL or one to memory for a value that nothing else uses.
pub unsafe fn output<'a, T>(name: &str, pointer: *mut T) -> Result<&'a mut MaybeUninit<T>, Error> {
    unsafe { exclusive(name, pointer.cast()) }
}

/// The `length` values from the argument `name` on; of none the pointer may be NULL.
///
/// # Errors
/// NULL.
///
/// # Safety
/// The pointer is NULL or one to as many values.
pub unsafe fn values<'a, T>(name: &str, pointer: *const T, length: usize) -> Result<&'a [T], Error> {
    if length == 0 {
        return Ok(&[]);
    }
    check(name, pointer)?;
    bounded::<T>(name, length)?;
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// The buffer of `length` values from the argument `name` on, which may be no values yet; for none the pointer may be NULL.
///
/// # Errors
/// NULL.
///
/// # Safety
/// The pointer is NULL or one to memory for as many values, which nothing else uses.
pub unsafe fn buffer<'a, T>(name: &str, pointer: *mut T, length: usize) -> Result<&'a mut [MaybeUninit<T>], Error> {
    if length == 0 {
        return Ok(&mut []);
    }
    check(name, pointer)?;
    bounded::<T>(name, length)?;
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer.cast(), length) })
}

/// Copies values to a buffer: as many as there are and fit.
pub fn copy<T: Copy>(values: &[T], buffer: &mut [MaybeUninit<T>]) {
    buffer.iter_mut().zip(values).for_each(|(buffer, value)| {
        buffer.write(*value);
    });
}

/// Checks that so many values can exist, such as the length -1 of a careless caller.
fn bounded<T>(name: &str, length: usize) -> Result<(), Error> {
    match length.checked_mul(size_of::<T>()) {
        Some(bytes) if isize::try_from(bytes).is_ok() => Ok(()),
        _ => Err(Error::input(format!("{name}: {length} values are more than memory has"))),
    }
}

/// The text of the argument `name`.
///
/// # Errors
/// NULL, or no UTF-8.
///
/// # Safety
/// The pointer is NULL or one to a text with a zero byte at its end.
pub unsafe fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, Error> {
    check(name, pointer)?;
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|error| Error::input(format!("{name} is not UTF-8: {error}")))
}

/// Ends a handle; NULL is none.
///
/// # Safety
/// The pointer is NULL or one from `Box::into_raw` that is not used again.
pub unsafe fn free<T>(handle: *mut T) {
    if !handle.is_null() {
        // Dropping frees memory; nothing in a handle panics then, and if it did the handle would be lost, not the program.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(unsafe { Box::from_raw(handle) })));
    }
}

/// The text of the last error on this thread, with field and value; empty if there was none. It is overwritten by the next
/// error on the same thread, and not freed.
#[unsafe(no_mangle)]
pub extern "C" fn dermis_last_error() -> *const c_char {
    LAST.with_borrow(|last| last.as_ptr())
}

/// The version of the library, as in Cargo.toml; not freed.
#[unsafe(no_mangle)]
pub extern "C" fn dermis_version() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!(),
    };
    VERSION.as_ptr()
}
