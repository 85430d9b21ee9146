//! The picture that a window shows, with the scene that it was drawn of. Marks over it and clicks on it are computed from this alone, since the
//! settings may already be newer.

use crate::passes::unveil::StartLine;
use crate::scene::Scene;

/// What a picture in the window shows.
#[derive(Clone, Debug)]
pub(super) struct ShownPicture {
    /// The scene that was drawn, with its settings, size and geometry.
    pub(super) scene: Scene,
    /// Number of the volume that was drawn, in the stream.
    pub(super) volume: u32,
    /// The lines on the planes beside the rendering at which rendering starts, if that follows the fluid; otherwise empty.
    pub(super) start_lines: Vec<StartLine>,
}
