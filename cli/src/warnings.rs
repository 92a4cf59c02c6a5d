//! Warnings on standard error, a line each, as they come up.

/// Prints the warnings that were not printed yet.
pub fn say() {
    for warning in monorange_formats::warnings::fresh() {
        eprintln!("warning: {warning}");
    }
}
