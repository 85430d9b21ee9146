//! Measurements that need the picture or the volume: the first end of a distance on the surface, voxels counted in the background, and the clipboard
//! for the results.

use crate::clipboard::Clipboard;
use crate::gpu::Wake;
use crate::scene::Measurement;
use glam::DVec3;
use std::io;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Measurements that need the volume or the surface: counting voxels, a distance on the surface, and copied results.
pub(super) struct Survey {
    wake: Wake,
    /// Receives the count of voxels.
    counted: Option<Receiver<Option<Measurement>>>,
    /// The first end of a distance on the surface.
    first_end: Option<DVec3>,
    clipboard: Clipboard,
}

impl Survey {
    /// `wake` is called when counting has ended.
    pub(super) fn new(wake: Wake) -> Survey {
        Survey { wake, counted: None, first_end: None, clipboard: Clipboard::default() }
    }

    /// The first end (in space, mm) of the distance on the surface that is being measured; None if none is.
    pub(super) fn first_end(&self) -> Option<DVec3> {
        self.first_end
    }

    pub(super) fn begin_distance(&mut self, at: DVec3) {
        self.first_end = Some(at);
    }

    pub(super) fn end_distance(&mut self) {
        self.first_end = None;
    }

    pub(super) fn is_counting(&self) -> bool {
        self.counted.is_some()
    }

    /// Starts to count voxels on a thread.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn count(&mut self, count: impl FnOnce() -> Option<Measurement> + Send + 'static) -> io::Result<()> {
        let (sender, receiver) = channel();
        let wake = self.wake.clone();
        let work = move || {
            let _ = sender.send(count());
            wake();
        };
        std::thread::Builder::new().name("counting".into()).spawn(work)?;
        self.counted = Some(receiver);
        Ok(())
    }

    /// The count that has ended since the last call, None if none has. The inner None means that there was nothing to count.
    pub(super) fn poll(&mut self) -> Option<Option<Measurement>> {
        let counted = match self.counted.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(counted) => counted,
            Err(TryRecvError::Disconnected) => None,
        };
        self.counted = None;
        Some(counted)
    }

    /// Puts results on the clipboard.
    ///
    /// # Errors
    /// One line: there is no desktop, or its clipboard refuses.
    pub(super) fn copy(&mut self, results: String) -> Result<(), String> {
        self.clipboard.copy(results)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// Prevents a count that is taken twice, and a view that waits for one that ended with a fault.
    #[test]
    fn what_was_counted_is_taken_once_and_a_count_that_fails_ends() {
        let (sender, woken) = channel();
        let mut survey = Survey::new(Arc::new(move || _ = sender.send(())));
        assert_eq!(survey.poll(), None);
        let (release, released) = channel::<()>();
        let count = move || released.recv().ok().map(|()| Measurement::default());
        survey.count(count).expect("a thread");
        assert!(survey.is_counting() && survey.poll().is_none());
        release.send(()).expect("it waits");
        woken.recv().expect("it counted");
        assert_eq!(survey.poll(), Some(Some(Measurement::default())));
        assert!(!survey.is_counting() && survey.poll().is_none());
        survey.count(|| None).expect("a thread");
        woken.recv().expect("it counted");
        assert_eq!(survey.poll(), Some(None), "the region is empty");
    }
}
