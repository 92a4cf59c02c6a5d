//! Warnings on standard error, a line each, as they come up.
use indicatif::ProgressBar;
use std::sync::{Mutex, PoisonError};

/// The bar that is on the terminal while several drives are under way.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints the warnings that were not printed yet.
pub fn say() {
    let bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
    for warning in monorange_formats::warnings::fresh() {
        let print = || eprintln!("warning: {warning}");
        bar.as_ref().map_or_else(print, |bar| bar.suspend(print));
    }
}

/// From now on warnings stand above this bar.
pub fn print_above(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = bar;
}

/// Says that a picture is left out, and why.
pub fn left_out(error: &monorange_formats::Error) {
    eprintln!("warning: left out: {}", error.in_one_line());
}
