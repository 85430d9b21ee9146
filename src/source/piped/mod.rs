//! Raw frames from a pipe, such as the standard output of an acquisition program.
//!
//! The stream begins with one line of JSON, at most 64 KiB up to its end of line:
//!
//! | key | what |
//! |---|---|
//! | `echolume` | 1, the version of this format |
//! | `samples`, `lines`, `frames` | samples a line, lines a frame, frames a volume; each 1 to 65536 |
//! | `type` | `"u8"`, `"u16"` or `"f32"`, little-endian |
//! | `range` | the two values that are shown as 0 and 1; otherwise `samples.range` of the probe, otherwise all of an integer type. f32 needs one |
//! | `both_ways` | every second volume comes swept backwards; otherwise as the probe says |
//! | `speed_ratio` | share of the way to the next frame that the motor travels during one, 0..1; otherwise as the probe says |
//! | `stamped` | `true`: before each frame its time, an f64 in s. One that is not finite is none |
//! | `lines_at_once` | a frame is given on whenever so many of its lines have come |
//! | `probe` | the tables of a probe file as objects: `{"array": {"kind": "curved", ...}, ...}`. A probe file that is given besides goes before it |
//! | `cartesian` | instead of a probe: `{"size": [x, y, z], "spacing": [x, y, z], "origin": [x, y, z]}`, mm; `samples`, `lines` and `frames` may then be left out |
//!
//! Behind it come the frames in order of acquisition, line by line (samples fastest), with nothing between them but their times. The
//! stream may end behind any frame. `tools/pipe_frames.py` writes such a stream.

mod header;
mod queue;
mod reader;

use super::InputError;
use super::live::{Event, Live};
use crate::probe::ProbeFile;
use queue::Queue;
use reader::{Finish, Reader};
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// What the stream is called in messages.
const NAME: &str = "pipe";
/// Memory of the frames that wait to be taken, bytes, unless a single one is larger.
const MOST_WAITING: usize = 256 << 20;
/// Frames that wait.
const FRAMES_WAITING: usize = 4;

/// A stream of frames as a live source.
///
/// Memory: four frames that wait, of 256 MiB together at most or else one, and the one that is being read, of at most 1 GiB and no
/// more than twice what has come of it before the first is whole.
pub struct Piped {
    queue: Arc<Queue>,
}

impl Piped {
    /// Begins to read. `probe`: the probe file to go by, before what the stream says of its probe.
    ///
    /// # Errors
    /// A probe file that is none, a thread that cannot be started. What is wrong with the stream comes as [`Event::End`].
    pub fn new(reader: impl Read + Send + 'static, probe: Option<&Path>) -> Result<Piped, InputError> {
        let probe = probe.map(ProbeFile::read).transpose()?;
        let queue = Arc::new(Queue::new());
        let theirs = Finish(queue.clone());
        let started = thread::Builder::new().name(NAME.into()).spawn(move || {
            let end = Reader::new(reader, &theirs.0).run(probe);
            theirs.0.end(end.err().map(|error| error.to_string()));
        });
        started.map_err(|e| InputError::unreadable(Path::new(NAME), &e))?;
        Ok(Piped { queue })
    }
}

impl Live for Piped {
    fn next(&mut self, patience: Duration) -> Event {
        self.queue.next(patience)
    }

    fn can_wait(&self) -> bool {
        true
    }
}

impl Drop for Piped {
    /// Without waiting for the thread, which may be in the middle of reading: it ends with the next byte, or with the stream.
    fn drop(&mut self) {
        self.queue.close();
    }
}
