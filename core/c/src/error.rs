use core::{
    ffi::c_char,
    fmt::{Display, Write},
};
use heapless::String;

/// Bytes of an error's text, with the zero at its end.
pub const MONORANGE_ERROR_BYTES: usize = 160;

/// What was wrong, in words: which value, what it was, what would be accepted.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Error {
    /// Ends with a zero.
    pub text: [c_char; MONORANGE_ERROR_BYTES],
}

/// Writes what was wrong where the caller wants to know it; always `false`.
pub(crate) fn fail(error: Option<&mut Error>, why: impl Display) -> bool {
    let Some(error) = error else { return false };
    let mut text = String::<{ MONORANGE_ERROR_BYTES - 1 }>::new();
    // What does not fit is cut off.
    let _ = write!(Cut(&mut text), "{why}");
    error.text.fill(0);
    for (to, from) in error.text.iter_mut().zip(text.as_bytes()) {
        *to = *from as c_char;
    }
    false
}

/// `true`, or what was wrong.
pub(crate) fn told<E: Display>(result: Result<(), E>, error: Option<&mut Error>) -> bool {
    match result {
        Ok(()) => true,
        Err(why) => fail(error, why),
    }
}

/// An object that must be there.
pub(crate) fn there<'a, T>(object: Option<&'a mut T>, error: &mut Option<&mut Error>) -> Option<&'a mut T> {
    if object.is_none() {
        fail(error.as_deref_mut(), "the object is NULL: it was not started, or starting it failed");
    }
    object
}

/// Takes what fits.
struct Cut<'a, const N: usize>(&'a mut String<N>);

impl<const N: usize> Write for Cut<'_, N> {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        text.chars().try_for_each(|letter| self.0.push(letter)).map_err(|_| core::fmt::Error)
    }
}
