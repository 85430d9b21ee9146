//! What measuring keeps from one input to the next: the first end of a distance on the surface, and the clipboard for the results.

use crate::clipboard::Clipboard;
use glam::DVec3;

/// The distance on the surface in progress, and copied results.
#[derive(Default)]
pub(super) struct Survey {
    /// The first end (in space, mm) of the distance on the surface that is being measured; None if none is.
    pub(super) first_end: Option<DVec3>,
    pub(super) clipboard: Clipboard,
}
