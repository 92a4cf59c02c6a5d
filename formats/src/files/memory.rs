//! Files that are in memory and not on a disk: in a browser, the ones that someone dropped on the page.
//!
//! Every reader of this module looks here first, so that a rig can name a camera file beside it wherever both
//! are. The files belong to the thread that offered them.
use std::{
    cell::RefCell,
    collections::HashMap,
    path::{Path, PathBuf},
};

thread_local! {
    static OFFERED: RefCell<HashMap<PathBuf, Vec<u8>>> = RefCell::default();
}

/// Makes a file readable under a path, in place of another one of that path.
///
/// ```
/// use monorange_formats::files::{memory, read_times};
/// memory::offer("times.txt", b"0.0\n0.1\n".to_vec());
/// assert_eq!(read_times("times.txt".as_ref())?, [0.0, 0.1]);
/// memory::withdraw_all();
/// # Ok::<(), monorange_formats::Error>(())
/// ```
pub fn offer(path: impl Into<PathBuf>, content: Vec<u8>) {
    OFFERED.with_borrow_mut(|files| files.insert(path.into(), content));
}

/// Forgets every file that was offered.
pub fn withdraw_all() {
    OFFERED.with_borrow_mut(HashMap::clear);
}

pub(super) fn copy_of(path: &Path) -> Option<Vec<u8>> {
    OFFERED.with_borrow(|files| files.get(path).cloned())
}
