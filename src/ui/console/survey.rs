//! What measuring keeps from one input to the next: the first end of a distance on the surface, and the clipboard for the results.

use crate::clipboard::Clipboard;
use glam::DVec3;

/// The distance on the surface in progress, and copied results.
#[derive(Default)]
pub(super) struct Survey {
    /// The first end of a distance on the surface.
    first_end: Option<DVec3>,
    clipboard: Clipboard,
}

impl Survey {
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

    /// Puts results on the clipboard.
    ///
    /// # Errors
    /// One line: there is no desktop, or its clipboard refuses.
    pub(super) fn copy(&mut self, results: String) -> Result<(), String> {
        self.clipboard.copy(results)
    }
}
