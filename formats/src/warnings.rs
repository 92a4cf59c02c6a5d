//! What looks wrong and is used all the same, in words for a person.
//!
//! A reader that is deep in a file cannot print, and must not stop: it leaves a warning here. The command line prints
//! [`fresh`] ones as lines on standard error and repeats [`all`] in `report.json`; the page shows them. They belong to
//! the thread that read the files. Warnings that differ in nothing but the file become one, with a count.
use crate::Error;
use std::cell::RefCell;

struct Warning {
    first: Error,
    more: usize,
    told: bool,
}

thread_local! {
    static WARNINGS: RefCell<Vec<Warning>> = const { RefCell::new(Vec::new()) };
}

impl Error {
    /// Leaves this as a warning: what it says is wrong is used all the same.
    ///
    /// ```
    /// use monorange_formats::{Error, warnings};
    /// Error::new("`mount.height` is 40 m").at("rig.toml").help("if 0.4 is meant, write height = 0.4").warn();
    /// assert_eq!(warnings::fresh(), ["rig.toml: `mount.height` is 40 m; if 0.4 is meant, write height = 0.4"]);
    /// assert!(warnings::fresh().is_empty() && warnings::all().len() == 1);
    /// ```
    pub fn warn(self) {
        WARNINGS.with_borrow_mut(|warnings| {
            match warnings.iter_mut().find(|warning| warning.first.says_the_same(&self)) {
                Some(same) => same.more += usize::from(same.first != self),
                None => warnings.push(Warning { first: self, more: 0, told: false }),
            }
        });
    }
}

/// The warnings that this has not returned before, one line each.
pub fn fresh() -> Vec<String> {
    WARNINGS.with_borrow_mut(|warnings| {
        let fresh = warnings.iter_mut().filter(|warning| !warning.told);
        fresh
            .map(|warning| {
                warning.told = true;
                warning.line()
            })
            .collect()
    })
}

/// All warnings since the last [`forget`], one line each.
pub fn all() -> Vec<String> {
    WARNINGS.with_borrow(|warnings| warnings.iter().map(Warning::line).collect())
}

/// Forgets every warning.
pub fn forget() {
    WARNINGS.with_borrow_mut(Vec::clear);
}

impl Warning {
    fn line(&self) -> String {
        let more = match self.more {
            0 => String::new(),
            more => format!(" (and {more} more)"),
        };
        self.first.one_line(&more)
    }
}
