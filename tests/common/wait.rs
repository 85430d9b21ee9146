//! Waiting for other processes and threads. The limits are for a busy machine: no test asserts how long anything takes.

use std::time::{Duration, Instant};

/// A software device on a busy machine needs seconds for a picture.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// Polls `look` until it returns something. Panics after [`PATIENCE`] with the name of what it waited for.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "{what} did not come within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// True as soon as `is_so` returns true, false if it does not within half a minute.
pub fn eventually(mut is_so: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) {
        if is_so() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    false
}
