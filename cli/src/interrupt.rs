//! Ctrl-C, TERM and HUP: what is unfinished goes away, and the person is told.
use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// What is on the disk under another name than its own, or empty. Whoever holds the lock is not interrupted.
static UNFINISHED: Mutex<(u64, BTreeMap<u64, PathBuf>)> = Mutex::new((0, BTreeMap::new()));

fn lock() -> MutexGuard<'static, (u64, BTreeMap<u64, PathBuf>)> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A file or folder that a signal removes while this lives.
#[derive(Debug)]
pub struct Unfinished(u64);

/// No signal is answered while this lives.
pub struct Paused {
    _list: MutexGuard<'static, (u64, BTreeMap<u64, PathBuf>)>,
}

impl Unfinished {
    /// Makes a file or a folder.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn file<T: AsPath>(make: impl FnOnce() -> io::Result<T>) -> io::Result<(T, Self)> {
        let mut list = lock();
        let made = make()?;
        let unfinished = Self::add(&mut list, made.as_path());
        Ok((made, unfinished))
    }

    /// A folder that is about to be made; it goes if it is empty then.
    pub fn folder(path: &Path) -> Self {
        Self::add(&mut lock(), path)
    }

    /// Waits for a signal that is being answered, and lets none be until the result is dropped.
    pub fn pause() -> Paused {
        Paused { _list: lock() }
    }

    /// Leaves it to a signal for the rest of the process: an empty folder may go at any time.
    pub fn keep(self) {
        std::mem::forget(self);
    }

    fn add(list: &mut (u64, BTreeMap<u64, PathBuf>), path: &Path) -> Self {
        list.0 += 1;
        list.1.insert(list.0, std::path::absolute(path).unwrap_or_else(|_| path.to_owned()));
        Self(list.0)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // Where the list is locked the entry stays, and names what is not there any more.
        if let Ok(mut list) = UNFINISHED.try_lock() {
            list.1.remove(&self.0);
        }
    }
}

/// What has a path.
pub trait AsPath {
    /// The path.
    fn as_path(&self) -> &Path;
}

impl AsPath for tempfile::NamedTempFile {
    fn as_path(&self) -> &Path {
        self.path()
    }
}

impl AsPath for tempfile::TempDir {
    fn as_path(&self) -> &Path {
        self.path()
    }
}

/// Answers signals from now on: removes what is unfinished, says so, and ends the process with 128 + the signal's
/// number. A signal that whoever started us has us ignore (`nohup`, a job in the background) stays ignored.
pub fn watch() {
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
        let ignored = ignored_signals();
        let wanted: Vec<_> = [SIGINT, SIGTERM, SIGHUP]
            .into_iter()
            .filter(|signal| ignored & (1 << (signal - 1)) == 0)
            .collect();
        let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else { return };
        std::thread::spawn(move || {
            if let Some(signal) = signals.forever().next() {
                clear(signal);
            }
        });
    }
}

#[cfg(unix)]
fn clear(signal: i32) {
    let list = lock();
    // Files before the folders that were made for them, the innermost first.
    for path in list.1.values().rev() {
        let _ = match path.extension().is_some_and(|extension| extension == "part") {
            true if path.is_dir() => fs::remove_dir_all(path),
            true => fs::remove_file(path),
            false => fs::remove_dir(path),
        };
    }
    let name = signal_hook::low_level::signal_name(signal).unwrap_or("a signal");
    eprintln!("error: stopped by {name}: nothing half-written stays\n  help: run the command again");
    std::process::exit(128 + signal);
}

/// The signals that are ignored, a bit each, where the system tells.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
