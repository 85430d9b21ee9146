//! The picture that a window shows, with the scene that it was drawn of. Marks over it and clicks on it are computed from this alone, since the
//! settings may already be newer.

use crate::passes::unveil::StartLine;
use crate::scene::Scene;

/// A picture that was drawn.
#[derive(Clone, Debug)]
pub(super) struct ShownPicture {
    /// The scene that was drawn: settings, size and geometry.
    pub(super) scene: Scene,
    /// The number of the drawn volume in the stream.
    pub(super) volume: u32,
    /// Start lines on the planes beside the rendering, if rendering starts at the fluid.
    pub(super) start_lines: Vec<StartLine>,
}
