//! A file of metrics that is replaced again and again while the program runs. A thread of its own writes it, so that a slow disk delays
//! nothing else.

use crate::files;
use crate::sync::locked;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// Longest wait for the last text at the end.
const PATIENCE: Duration = Duration::from_secs(2);

/// A file of metrics that a thread of its own writes. Dropping it writes the last text and waits at most 2 s for that.
pub struct Textfile {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    slot: Mutex<Slot>,
    /// Signalled when the slot changes.
    changed: Condvar,
    failures: AtomicU64,
}

#[derive(Default)]
struct Slot {
    /// The newest text that is not yet written.
    text: Option<String>,
    /// Nothing will follow.
    is_closed: bool,
    /// The thread has ended.
    is_done: bool,
}

impl Textfile {
    /// Starts the thread that writes `file`. Nothing is written before the first [`Textfile::put`].
    ///
    /// # Errors
    /// One line: the thread cannot be started.
    pub fn new(file: &Path) -> Result<Textfile, String> {
        let shared: Arc<Shared> = Arc::default();
        let (theirs, path) = (shared.clone(), file.to_path_buf());
        let thread = std::thread::Builder::new().name("metrics".into()).spawn(move || write_all(&path, &theirs));
        match thread {
            Ok(_) => Ok(Textfile { shared }),
            Err(e) => Err(format!("{}: a thread that writes it cannot be started: {e}", file.display())),
        }
    }

    /// Has the thread replace the content of the file by this text, and returns at once. A text that still waits to be written is discarded for a
    /// newer one. A write error is logged as a warning; further errors are only counted until a write succeeds again.
    pub fn put(&self, text: String) {
        locked(&self.shared.slot).text = Some(text);
        self.shared.changed.notify_all();
    }

    /// Number of failed writes.
    pub fn failures(&self) -> u64 {
        self.shared.failures.load(Ordering::Relaxed)
    }
}

impl Drop for Textfile {
    /// Waits until the last text is written, but not for a disk that hangs.
    fn drop(&mut self) {
        let mut slot = locked(&self.shared.slot);
        slot.is_closed = true;
        self.shared.changed.notify_all();
        let waited = self.shared.changed.wait_timeout_while(slot, PATIENCE, |slot| !slot.is_done);
        if !waited.unwrap_or_else(|e| e.into_inner()).0.is_done {
            tracing::warn!("metrics: the last ones are not written yet; they are not waited for");
        }
    }
}

impl Shared {
    /// Waits for the next text; none at the end.
    fn next(&self) -> Option<String> {
        let slot = locked(&self.slot);
        let waited = self.changed.wait_while(slot, |slot| slot.text.is_none() && !slot.is_closed);
        waited.unwrap_or_else(|e| e.into_inner()).text.take()
    }
}

/// Writes each text that comes.
fn write_all(file: &Path, shared: &Shared) {
    // Also if this thread panics.
    let _ended = Ended(shared);
    let mut is_failing = false;
    while let Some(text) = shared.next() {
        match files::replace_for_all(file, text.as_bytes()) {
            Ok(()) if is_failing => {
                tracing::info!("metrics: {} is written again", file.display());
                is_failing = false;
            }
            Ok(()) => {}
            Err(fault) => {
                shared.failures.fetch_add(1, Ordering::Relaxed);
                if !std::mem::replace(&mut is_failing, true) {
                    tracing::warn!("metrics: {fault}; going on without, and trying again");
                }
            }
        }
    }
}

struct Ended<'a>(&'a Shared);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        locked(&self.0.slot).is_done = true;
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::WorkFolder;
    use std::time::Instant;

    fn folder() -> WorkFolder {
        WorkFolder::new(&std::env::temp_dir(), "echolume-textfile-").expect("a folder")
    }

    fn wait(until: impl Fn() -> bool) {
        let begun = Instant::now();
        while !until() {
            assert!(begun.elapsed() < Duration::from_secs(60), "it does not come");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn the_file_holds_the_last_text_and_nothing_is_left_beside_it() {
        let folder = folder();
        let file = folder.path().join("a.prom");
        let textfile = Textfile::new(&file).expect("a thread");
        for n in 0..50 {
            textfile.put(format!("a {n}\n"));
        }
        drop(textfile);
        assert_eq!(std::fs::read_to_string(&file).expect("written"), "a 49\n");
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&file).expect("there").permissions().mode();
            assert_eq!(mode & 0o777, 0o644, "node_exporter runs as another user");
        }
    }

    #[test]
    fn a_file_that_cannot_be_written_is_counted_and_written_as_soon_as_it_can_be() {
        let folder = folder();
        let below = folder.path().join("below");
        let file = below.join("a.prom");
        let textfile = Textfile::new(&file).expect("a thread");
        for n in 1..=3 {
            textfile.put(format!("a {n}\n"));
            wait(|| textfile.failures() == n);
        }
        std::fs::create_dir(&below).expect("a folder");
        textfile.put("a 4\n".into());
        wait(|| file.exists());
        assert_eq!(textfile.failures(), 3);
        drop(textfile);
        assert_eq!(std::fs::read_to_string(&file).expect("written"), "a 4\n");
    }
}
