//! Options of the rendering of a stream.

use super::cine::CineLimits;
use super::volume_pool::Update;
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::{TimeStamps, Wake};
use crate::scene::load::Layers;
use crate::scene::{Scene, Settings};
use crate::tree::Defaults;
use std::sync::Arc;

/// Options of a [`Stream`](super::Stream).
#[derive(Clone, Defaults)]
pub struct StreamOptions {
    pub update: Update,
    /// Number of volume images in rotation with [`Update::Whole`]: 2, or 3 so that a volume need not wait for a picture.
    #[value(3)]
    pub images: u32,
    /// Number of device queues to use. None: all queues of the device.
    pub queues: Option<usize>,
    /// True: every picture is copied to host memory (readback). False: it stays on the device, for a window.
    #[value(true)]
    pub readback: bool,
    /// Limits of the cine loop; by default there is none.
    pub cine: CineLimits,
    /// Called on the thread that compiled a pipeline, so that the next step may have work. If it is given, pipelines of changed settings are
    /// compiled in the background; otherwise a step waits for them.
    pub wake: Option<Wake>,
    /// Which operations are timed on the device. With [`TimeStamps::EachPass`] passes do not overlap, so that pictures take longer.
    pub time_stamps: TimeStamps,
    /// Folder of shaders that are used in place of the embedded ones. Changed shaders are loaded again between two pictures. None: the embedded ones
    /// are used.
    pub shaders: Option<Arc<ShaderFolder>>,
    /// The settings that the user chose. All others are derived from the geometry and the first complete volume. None: the settings given to the
    /// stream are complete, and nothing is derived.
    pub chosen: Option<Layers>,
    /// A function that gives settings of lower quality for a scene at full quality. One result of stage 1 (the filters of frames) serves all of them,
    /// so that no frame is sent again when the quality changes. None: a change of quality may need the frames again.
    pub lowered: Option<Lowered>,
    /// Compile the pipelines of the first geometry in the background, if `wake` is given. Meanwhile [`Stream::step`](super::Stream::step)
    /// returns at once.
    pub prepares: bool,
    /// Draw the first picture with a 16th of the rays, and then in full, so that a slow device shows something soon.
    pub coarse_first: bool,
    /// Submit work in small portions, so that a window's panels can be drawn while a picture is being drawn: see
    /// [`RendererOptions::paced`](crate::gpu::RendererOptions::paced). Frames that the device has no room for stay in the feed.
    pub paced: bool,
}

/// A function that returns, for a scene at full quality, the settings of lower quality of which any one may replace its own while the view moves.
/// Their order does not matter. [`StreamOptions::lowered`] says what they are for.
pub type Lowered = Arc<dyn Fn(&Scene) -> Vec<Settings> + Send + Sync>;
