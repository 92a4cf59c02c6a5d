//! How long a thread has worked, whatever else the machine does meanwhile.
use std::{
    fs,
    time::{Duration, Instant},
};

/// A clock that runs while this thread has a processor; where the system does not tell that (it is not Linux), all the time.
pub(crate) struct Work {
    begun: Instant,
    had: Option<Duration>,
}

impl Work {
    pub(crate) fn begin() -> Self {
        Self { begun: Instant::now(), had: of_this_thread() }
    }

    pub(crate) fn done(&self) -> Duration {
        match (self.had, of_this_thread()) {
            (Some(had), Some(now)) => now.saturating_sub(had),
            _ => self.begun.elapsed(),
        }
    }
}

/// The first number of its schedstat is processor time, ns.
fn of_this_thread() -> Option<Duration> {
    let told = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(told.split(' ').next()?.parse().ok()?))
}
