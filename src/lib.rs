//! Echolume turns the polar frames of a mechanically wobbling ultrasound probe into rendered volumes, on bare Vulkan.
//!
//! A [`Recording`] or a [`Live`] source delivers frames, and its [`Geometry`] states where their samples lie in space. The [`Plan`] of a
//! [`Scene`] lists the passes that process them on the device of a [`Context`]. A [`Renderer`] draws a volume, and a [`Stream`] draws frames
//! while they arrive. [`Layers`] read the settings of a scene from presets, files and `key=value`. These names are at the root of this
//! crate, together with the types that they take and return, and their errors.
//!
//! [`low_level`] holds the modules that the program itself is made of, without a promise of stability.
//!
//! # Render a file
//!
//! ```
//! use echolume::{Context, ContextOptions, Input, Layers, Renderer, RendererOptions, Scene, Source};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut recording = echolume::open("tests/data/bone-l14/bone.mha".as_ref(), None)?;
//! let mut layers = Layers::default();
//! layers.preset("bone")?;
//! layers.set("picture.size=[96,64]")?;
//! let input = Input { stored: recording.stored_type(), range: recording.range() };
//! let scene = Scene::new(recording.geometry(0), input, layers.finish()?)?;
//!
//! let context = Context::new(&ContextOptions::default())?;
//! let mut renderer = Renderer::new(&context, scene, &RendererOptions::default())?;
//! recording.skip_to_volume(0)?;
//! for _ in 0..recording.frames_per_volume() {
//!     let Some(frame) = recording.next_frame()? else { break };
//!     renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
//! }
//! renderer.show(0)?;
//! let picture = renderer.picture()?;
//! assert_eq!([picture.width, picture.height], [96, 64]);
//! # Ok(())
//! # }
//! ```
//!
//! # Stream from an own source
//!
//! A source implements [`Live`]: it states the geometry once, then hands over frames on its own clock.
//!
//! ```
//! use echolume::{Context, ContextOptions, Event, Feed, Frame, Geometry, Grid, Header, Layers, Live, Step, StoredType, Stream, StreamOptions};
//! use std::time::Duration;
//!
//! /// Eight slices of 16 x 16 pixels that become brighter.
//! struct Ramp {
//!     sent: usize,
//! }
//!
//! impl Live for Ramp {
//!     fn next(&mut self, _: Duration) -> Event {
//!         self.sent += 1;
//!         match self.sent {
//!             1 => {
//!                 let grid = Grid { size: [16, 16, 8], spacing: [1.0; 3], origin: [0.0; 3] };
//!                 let (forward, backward) = (Geometry::Cartesian(grid), Geometry::Cartesian(grid));
//!                 let (stored, range) = (StoredType::U8, [0.0, 255.0]);
//!                 Event::Begin(Box::new(Header { forward, backward, stored, range, posed: false, synthetic: false }))
//!             }
//!             n @ 2..10 => {
//!                 let slice = n - 2;
//!                 let (number, bytes) = (slice as u32, vec![30 * slice as u8; 16 * 16]);
//!                 Event::Frame(Frame { volume: 0, number, slice, backward: false, time: None, pose: None, bytes })
//!             }
//!             _ => Event::End(None),
//!         }
//!     }
//!
//!     fn can_wait(&self) -> bool {
//!         true
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut layers = Layers::default();
//! layers.set("mode=mip")?;
//! layers.set("picture.size=[32,32]")?;
//! let context = Context::new(&ContextOptions::default())?;
//! let feed = Feed::new(Box::new(Ramp { sent: 0 }), None)?;
//! let mut stream = Stream::new(&context, feed, layers.finish()?, StreamOptions::default());
//! let mut pictures = 0;
//! loop {
//!     match stream.step(Duration::from_millis(50))? {
//!         Step::Picture(_) => pictures += 1,
//!         Step::End(_) => break,
//!         _ => {}
//!     }
//! }
//! assert_eq!(pictures, 1);
//! # Ok(())
//! # }
//! ```
//!
//! # Run one pass alone
//!
//! ```
//! use echolume::low_level::gpu::pass_runner::PassRunner;
//! use echolume::low_level::passes::{Arrays, DispatchArgs, Texels, by_name};
//! use echolume::{Context, ContextOptions, Geometry, Grid, Input, Layers, Scene, StoredType};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut layers = Layers::default();
//! layers.set("slices.median=true")?;
//! let grid = Grid { size: [8, 8, 1], spacing: [1.0; 3], origin: [0.0; 3] };
//! let input = Input { stored: StoredType::F32, range: [0.0, 1.0] };
//! let scene = Scene::new(Geometry::Cartesian(grid), input, layers.finish()?)?;
//!
//! // A dark slice with one bright pixel, which the median filter removes.
//! let median = by_name("median_slice").ok_or("no such pass")?;
//! let args = DispatchArgs::default();
//! let source = median.reads(&scene, &args)[0].name;
//! let target = median.writes(&scene, &args)[0].name;
//! let mut inputs = Arrays::default();
//! inputs.insert(source, Texels::from_fn([8, 8, 1], 1, |at, _| if at == [4, 4, 0] { 1.0 } else { 0.25 }));
//! let context = Context::new(&ContextOptions::default())?;
//! let outputs = PassRunner::new(&context)?.run(&scene, median, &args, &inputs, 0.0)?;
//! // To the last digit of a slice: 16 bits, in the format that the device reads best.
//! assert!((outputs.get(target).get([4, 4, 0])[0] - 0.25).abs() < 1e-4);
//! # Ok(())
//! # }
//! ```
//!
//! # Explain a plan
//!
//! Needs no device.
//!
//! ```
//! use echolume::{Geometry, Grid, Input, Layers, Plan, Scene, StoredType};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut layers = Layers::default();
//! layers.set("mode=mip")?;
//! let grid = Grid { size: [64, 64, 32], spacing: [0.5; 3], origin: [0.0; 3] };
//! let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
//! let scene = Scene::new(Geometry::Cartesian(grid), input, layers.finish()?)?;
//! let text = Plan::new(&scene).explain(&scene);
//! assert!(text.contains("+ raycast_projection"), "a projection casts rays");
//! assert!(text.contains("- light"), "a projection has no surface to light");
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

mod args;
#[cfg(feature = "verify")]
#[doc(hidden)]
pub mod batch;
mod cli;

pub use cli::run;

pub use low_level::files::InputError;
pub use low_level::gpu::{Context, ContextOptions, DeviceChoice, GpuError, Renderer, RendererOptions};
pub use low_level::live::{Feed, FinishedPicture, Step, Stream, StreamError, StreamOptions};
pub use low_level::picture::Picture;
pub use low_level::plan::Plan;
pub use low_level::probe::{Frame, Geometry, GeometryError, Grid, Probe, SampleType, StoredType};
pub use low_level::scene::load::{Layers, LoadError};
pub use low_level::scene::{Input, Scene, SceneError, Settings};
pub use low_level::source::live::{Event, Live};
pub use low_level::source::{Header, Recording, Source, open};

/// The modules of the program, for its own tests, benches and tools. Each of them may change with any version.
///
/// In the order in which a frame is processed:
///
/// - [`source`] reads recordings and live sources into frames. [`probe`] defines where their samples lie in space and drives the probe's
///   motor.
/// - [`scene`] is everything that determines a picture: geometry, mode, filters, camera, light. [`passes`] declares every compute pass,
///   [`plan`] derives the passes and slots that a scene needs, [`barriers`] and [`queues`] their order.
/// - [`gpu`] is the only member that uses Vulkan and the only one with unsafe code.
/// - [`live`] renders frames while they arrive.
/// - [`reference`](mod@reference) renders on the CPU in f64, [`exact_ray`] integrates its rays without samples, [`bounds`] encloses them.
///   [`profile`] measures GPU times, [`error_report`] error against run time. [`verify`] tests a device and its driver.
/// - [`batch`] renders, converts, measures or verifies many recordings, one shard of them a process.
pub mod low_level {
    #[cfg(feature = "verify")]
    pub use crate::batch;
    pub use echolume_base::{baselines, files, metrics, picture, statistics, text, tree};
    pub use echolume_core::{
        barriers, dump, error_map, exact_ray, mesh, passes, plan, queues, reference, scene, spirv, stated_error,
    };
    pub use echolume_gpu::{self as gpu, machine, shader_source, shader_tools};
    #[cfg(feature = "lab")]
    pub use echolume_lab::{bounds, error_report, filter_report, profile, thesis_tables};
    pub use echolume_segment as segment;
    pub use echolume_session::{compare, kiosk, live, marked, measure, user_presets, worksheet, workspace};
    #[cfg(feature = "view")]
    pub use echolume_ui as ui;
    #[cfg(feature = "verify")]
    pub use echolume_verify as verify;
    pub use {echolume_probe as probe, echolume_source as source};
}

use echolume_base::digest;
#[cfg(feature = "verify")]
use echolume_base::html_page;
use echolume_base::memory;
use echolume_base::sync;
use echolume_base::terminal;
use low_level::*;
