//! Options of the rendering of a stream.

use super::cine::CineLimits;
use super::volume_pool::Update;
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::{TimeStamps, Wake};
use crate::scene::load::Layers;
use crate::scene::{Scene, Settings};
use std::sync::Arc;

/// Options of a [`Stream`](super::Stream).
#[derive(Clone)]
pub struct StreamOptions {
    pub update: Update,
    /// Number of volume images used in rotation if volumes are shown whole: 2, or 3 so that a volume need not wait for a picture.
    pub images: u32,
    /// Number of queues to use. None: all queues of the device.
    pub queues: Option<usize>,
    /// Copies every picture to host memory. Otherwise it stays on the device, for a window.
    pub readback: bool,
    /// Size of the cine loop; none by default.
    pub cine: CineLimits,
    /// Called when the next step has work: the source reported an event, or a pipeline was compiled. If it is set, pipelines of changed
    /// settings are compiled in the background.
    pub wake: Option<Wake>,
    /// The operations that are timed on the device. With [`TimeStamps::EachPass`] passes do not overlap, so that pictures take longer.
    pub time_stamps: TimeStamps,
    /// Shaders to use instead of the embedded ones. Changed shaders are loaded again between two pictures.
    pub shaders: Option<Arc<ShaderFolder>>,
    /// The settings that were chosen. All others are derived from the geometry and the first complete volume. None: the settings are
    /// complete.
    pub chosen: Option<Layers>,
    /// Makes, from the scene at full quality, lower settings with which pictures of a volume may also be drawn. The result of stage 1
    /// serves all of them, so that a change between them sends no frame again.
    pub lowered: Option<Lowered>,
    /// Compiles the pipelines of the first geometry in the background, if `wake` is set. Steps meanwhile return at once.
    pub prepares: bool,
    /// Draws the first picture with a 16th of the rays, and then the same picture in full, so that a slow device shows something soon.
    pub coarse_first: bool,
    /// Holds back work that would keep the device busy, so that a window's panels are drawn while a picture is being drawn: see
    /// [`RendererOptions::paced`](crate::gpu::RendererOptions::paced). Frames that the device has no room for stay in the feed.
    pub paced: bool,
}

/// Returns the settings that replace those of a scene at full quality while the view moves.
pub type Lowered = Arc<dyn Fn(&Scene) -> Vec<Settings> + Send + Sync>;

impl Default for StreamOptions {
    fn default() -> StreamOptions {
        StreamOptions {
            update: Update::Whole,
            images: 3,
            queues: None,
            readback: true,
            cine: CineLimits::default(),
            wake: None,
            time_stamps: TimeStamps::default(),
            shaders: None,
            chosen: None,
            lowered: None,
            prepares: false,
            coarse_first: false,
            paced: false,
        }
    }
}
