use core::fmt;

/// What [`Error`] comes wrapped in.
pub type Result<T> = core::result::Result<T, Error>;

/// A broken contract between the caller and this crate; a rejected measurement is not one.
///
/// Every variant names the value that is at fault, so that a binary can add the file and the line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A value is NaN, infinite or outside its range.
    OutOfRange {
        /// The value's name as in the rig file, for instance `mount.height`.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would be accepted, in words, for instance `a finite number above 0`.
        expected: &'static str,
    },
    /// A buffer, picture or matrix has the wrong size.
    Size {
        /// Which one.
        name: &'static str,
        /// Its size.
        got: usize,
        /// The size it must have (at least, for buffers).
        expected: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { name, value, expected } => write!(f, "{name} is {value}, must be {expected}"),
            Self::Size { name, got, expected } => write!(f, "{name} has size {got}, must have {expected}"),
        }
    }
}

impl core::error::Error for Error {}
