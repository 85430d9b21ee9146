//! The picture that a window shows, with all that it was drawn of. Marks over it, and what is clicked on it, are computed from this alone: the settings
//! may already ask for another one.

use crate::passes::unveil::StartLine;
use crate::scene::Scene;

/// A picture that was drawn.
#[derive(Clone, Debug)]
pub(super) struct ShownPicture {
    /// Its settings, size and geometry.
    pub(super) scene: Scene,
    /// The number of its volume in the stream.
    pub(super) volume: u32,
    /// Where rendering starts on planes beside it, if that follows the fluid.
    pub(super) start_lines: Vec<StartLine>,
}
