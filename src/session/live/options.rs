//! How a stream renders.

use super::cine::CineLimits;
use super::volume_pool::Update;
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::{TimeStamps, Wake};
use crate::scene::load::Layers;
use crate::scene::{Scene, Settings};
use std::sync::Arc;

/// How a [`Stream`](super::Stream) renders.
#[derive(Clone)]
pub struct StreamOptions {
    pub update: Update,
    /// Volume images used in rotation if volumes are shown whole: 2, or 3 so that a volume need not wait for a picture.
    pub images: u32,
    /// Queues to use; None: as many as the device offers.
    pub queues: Option<usize>,
    /// Copies every picture to host memory. Otherwise it stays on the device, for a window.
    pub readback: bool,
    /// Size of the cine loop; none by default.
    pub cine: CineLimits,
    /// Called when the next step has work: the source reported an event, or a pipeline was compiled. If set, pipelines of changed
    /// settings are compiled in the background.
    pub wake: Option<Wake>,
    /// What is timed on the device. With [`TimeStamps::EachPass`] passes do not overlap, so that pictures take longer.
    pub time_stamps: TimeStamps,
    /// Shaders to use instead of the embedded ones. Those that change are loaded again between two pictures.
    pub shaders: Option<Arc<ShaderFolder>>,
    /// What was chosen: settings that nobody chose follow from the geometry and the first whole volume. None: the settings are complete.
    pub chosen: Option<Layers>,
    /// Other settings that the pictures of a volume are drawn with in turn, from the scene at full quality: stage 1 serves them too, so that
    /// a change among them sends no frame again.
    pub lowered: Option<Lowered>,
    /// Compiles the pipelines of the first geometry in the background, if there is a `wake`: steps return at once meanwhile.
    pub prepares: bool,
    /// Draws the first picture with a 16th of the rays, and then at once the same in full: something is seen soon on a slow device.
    pub coarse_first: bool,
    /// Holds back what keeps the device busy, so that a window's panels are drawn while a picture is: see
    /// [`RendererOptions::paced`](crate::gpu::RendererOptions::paced). Frames that the device has no room for stay in the feed.
    pub paced: bool,
}

/// The settings that a scene at full quality is drawn with while the view moves.
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
