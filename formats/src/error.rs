use std::{fmt, path::Path};

/// What [`Error`] comes wrapped in.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a command stopped, for a person: where, what is wrong, and what to do about it.
///
/// ```
/// let error = monorange_formats::Error::new("`mount.heigth` is not a known key").at_line("rig.toml", 7).help("write `height`");
/// assert_eq!(error.to_string(), "rig.toml, line 7: `mount.heigth` is not a known key\n  help: write `height`");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    place: Option<String>,
    cause: String,
    help: Option<String>,
}

impl Error {
    /// An error with its cause in words.
    pub fn new(cause: impl fmt::Display) -> Self {
        Self { place: None, cause: cause.to_string(), help: None }
    }

    /// The same error in a file, unless a more exact place is known already.
    pub fn at(mut self, file: impl AsRef<Path>) -> Self {
        self.place.get_or_insert_with(|| file.as_ref().display().to_string());
        self
    }

    /// The same error in a line of a file, counted from 1, unless a more exact place is known already.
    pub fn at_line(self, file: impl AsRef<Path>, line: u64) -> Self {
        let place = format!("{}, line {line}", file.as_ref().display());
        self.at(place)
    }

    /// All of it in one line, as a warning is printed.
    pub fn in_one_line(&self) -> String {
        self.one_line("")
    }

    /// All of it in one line, with a remark behind the place.
    pub(crate) fn one_line(&self, after_place: &str) -> String {
        let place = self.place.as_ref().map_or(String::new(), |place| format!("{place}{after_place}: "));
        let help = self.help.as_ref().map_or(String::new(), |help| format!("; {help}"));
        format!("{place}{}{help}", self.cause).replace('\n', " ")
    }

    /// Whether both say the same of two files.
    pub(crate) fn says_the_same(&self, other: &Self) -> bool {
        self.cause == other.cause && self.help == other.help
    }

    /// The same error of an entry, whose name goes before the cause.
    pub(crate) fn in_entry(mut self, entry: &str) -> Self {
        self.cause = format!("{entry} {}", self.cause);
        self
    }

    /// Whether its cause has this word.
    pub(crate) fn says(&self, word: &str) -> bool {
        self.cause.contains(word)
    }

    /// The same error with what to do.
    pub fn help(mut self, help: impl fmt::Display) -> Self {
        self.help = Some(help.to_string());
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}", self.cause)?;
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}

/// The one of `known` that `given` was most likely meant to be.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |name: &str| strsim::jaro_winkler(&given.to_lowercase(), name);
    known.into_iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
}
