//! Waiting for other processes and threads. A test waits for a condition; the limits are for a busy machine, and no test asserts how long anything takes.
//! A pause of a stated length is an input ([`pace`]) or the time in which something must not happen ([`watch`]): on a slower machine both become longer,
//! and the test does not fail. A rule allows no other sleep in tests.

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
        poll();
    }
}

/// True as soon as `is_so` returns true, false if it does not within half a minute.
pub fn eventually(mut is_so: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) {
        if is_so() {
            return true;
        }
        poll();
    }
    false
}

/// Between two looks at a condition.
pub fn poll() {
    std::thread::sleep(Duration::from_millis(2));
}

/// What a user, a probe or a peer lets pass between two actions.
pub fn pace(pause: Duration) {
    std::thread::sleep(pause);
}

/// The time in which something could happen that must not.
pub fn watch(time: Duration) {
    std::thread::sleep(time);
}
