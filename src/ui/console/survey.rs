//! Measurements that need the picture or the volume: the first end of a distance on the surface, a body that is measured in the background, and the
//! clipboard for the results.

use crate::clipboard::Clipboard;
use crate::gpu::Wake;
use crate::scene::Measurement;
use crate::texts;
use glam::DVec3;
use std::io;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// A measured body, and whether it reaches the border of the region, or the reason why it cannot be measured.
pub(super) type Surveyed = Result<(Measurement, bool), String>;

/// Measurements that need the volume or the surface: a body, a distance on the surface, and copied results.
pub(super) struct Survey {
    wake: Wake,
    /// Receives the measured body.
    body: Option<Receiver<Surveyed>>,
    /// The first end of a distance on the surface.
    first_end: Option<DVec3>,
    clipboard: Clipboard,
}

impl Survey {
    /// `wake` is called when a body is measured.
    pub(super) fn new(wake: Wake) -> Survey {
        Survey { wake, body: None, first_end: None, clipboard: Clipboard::default() }
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

    pub(super) fn is_measuring(&self) -> bool {
        self.body.is_some()
    }

    /// Starts to measure a body on a thread.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn measure(&mut self, measure: impl FnOnce() -> Surveyed + Send + 'static) -> io::Result<()> {
        let (sender, receiver) = channel();
        let wake = self.wake.clone();
        let work = move || {
            let _ = sender.send(measure());
            wake();
        };
        std::thread::Builder::new().name("measuring".into()).spawn(work)?;
        self.body = Some(receiver);
        Ok(())
    }

    /// What was measured since the last call; None if nothing was.
    pub(super) fn poll(&mut self) -> Option<Surveyed> {
        let measured = match self.body.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(measured) => measured,
            Err(TryRecvError::Disconnected) => Err(texts::WHY_THREAD_ENDED.into()),
        };
        self.body = None;
        Some(measured)
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

    /// Prevents a result that is taken twice, and a view that waits for one that ended with a fault.
    #[test]
    fn what_was_measured_is_taken_once_and_a_search_that_fails_ends() {
        let (sender, woken) = channel();
        let mut survey = Survey::new(Arc::new(move || _ = sender.send(())));
        assert_eq!(survey.poll(), None);
        let (release, released) = channel::<()>();
        let measure = move || released.recv().map(|()| (Measurement::default(), true)).map_err(|e| e.to_string());
        survey.measure(measure).expect("a thread");
        assert!(survey.is_measuring() && survey.poll().is_none());
        release.send(()).expect("it waits");
        woken.recv().expect("it measured");
        assert_eq!(survey.poll(), Some(Ok((Measurement::default(), true))));
        assert!(!survey.is_measuring() && survey.poll().is_none());
        survey.measure(|| Err("empty".into())).expect("a thread");
        woken.recv().expect("it ended");
        assert_eq!(survey.poll(), Some(Err("empty".into())));
    }
}
