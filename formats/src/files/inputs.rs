//! The files that were read, so that none of them is written over.
//!
//! Every reader notes its file here: a command need not know which ones a rig or a dataset names. The list is the
//! process's, because outputs are written on other threads than inputs are read on.
use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

static READ: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);

/// Notes a file as an input. One that is no plain file on the disk is none.
pub fn note(path: &Path) {
    if let Some(path) = fs::canonicalize(path).ok().filter(|path| path.is_file()) {
        READ.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default().insert(path);
    }
}

/// Whether the file was read, by this name or by another one (links are followed).
pub fn was_read(path: &Path) -> bool {
    fs::canonicalize(path).is_ok_and(|path| {
        READ.lock().unwrap_or_else(PoisonError::into_inner).as_ref().is_some_and(|read| read.contains(&path))
    })
}
