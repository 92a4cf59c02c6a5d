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
    /// Time runs backwards, or is not a number.
    TimeBackwards {
        /// What was given, in seconds.
        time: f64,
        /// The latest time before it.
        last: f64,
    },
    /// No landmark has this number.
    UnknownLandmark {
        /// The number.
        id: u32,
    },
    /// A landmark has this number already.
    KnownLandmark {
        /// The number.
        id: u32,
    },
    /// A setting asks for what this build or device cannot do.
    Unsupported {
        /// The setting's name as in the rig file.
        name: &'static str,
        /// What is missing, and what would work.
        reason: &'static str,
    },
    /// A capacity is used up.
    Full {
        /// Which one.
        name: &'static str,
        /// Its size.
        capacity: usize,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, &|f, number| write!(f, "{number}"))
    }
}

/// Writes a number.
type Number<'a> = &'a dyn Fn(&mut dyn fmt::Write, f64) -> fmt::Result;

impl Error {
    /// The sentence that [`Display`](fmt::Display) gives, with numbers written otherwise: the standard library's decimals are a
    /// fortieth of what a page loads, which has its own.
    ///
    /// # Errors
    /// Those of what is written to.
    pub fn write(&self, f: &mut dyn fmt::Write, number: Number<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { name, value, expected } => {
                write!(f, "{name} is ")?;
                number(f, *value)?;
                write!(f, ", must be {expected}")
            }
            Self::Size { name, got, expected } => write!(f, "{name} has size {got}, must have {expected}"),
            Self::TimeBackwards { time, last } => {
                f.write_str("time ")?;
                number(f, *time)?;
                f.write_str(" s lies before ")?;
                number(f, *last)?;
                f.write_str(" s")
            }
            Self::UnknownLandmark { id } => write!(f, "there is no landmark {id}"),
            Self::KnownLandmark { id } => write!(f, "there is a landmark {id} already"),
            Self::Unsupported { name, reason } => write!(f, "{name} asks for what is not here: {reason}"),
            Self::Full { name, capacity } => write!(f, "{name} is full: it has room for {capacity}"),
        }
    }
}

impl core::error::Error for Error {}
