//! The Vulkan renderer: the only member that calls Vulkan, and the only one with unsafe code.
//!
//! - `context` owns instance, device, queues and allocator; `device_selection` picks the device; `faults` injects faults.
//! - `resources` are images and the slots of a scene, `buffers` what is uploaded and read back, `memory` where both lie, `formats` what
//!   the device can do with them.
//! - `pipelines` compiles shaders, `scene_compiler` those of a scene, `pipeline_compiler` on a thread of its own, `preparation` before there is a renderer, `pipeline_measure` to measure that; `pipeline_cache` keeps
//!   what was compiled on disk; `shader_reload` takes shaders from a folder that is watched. `descriptor_sets` are for devices without push
//!   descriptors.
//! - `command_recorder` records command buffers with the barriers of `device_queues` and the time stamps of `timing`; `timeline` says when a submission is done,
//!   and `watchdog` gives up a device that does not finish. `bands` divides dispatches that a driver's watchdog might end, and `paced`
//!   holds bands back while a window's panels are drawn.
//! - `lost_device` reports why a device was lost, `losses` counts how often the same work lost it, `budget` how much memory it has left; `host_memory` returns what drivers freed.
//! - `renderer` runs the four stages, `pass_runner` a single pass for tests and benchmarks.
//! - `window` presents pictures.

mod bands;
pub mod budget;
mod buffers;
pub mod calls;
mod command_recorder;
pub mod context;
mod descriptor_sets;
mod device_queues;
pub mod device_selection;
pub mod error;
pub mod faults;
pub mod formats;
pub mod host_memory;
mod losses;
pub mod lost_device;
pub mod machine;
mod memory;
mod paced;
pub mod pass_runner;
mod pipeline_cache;
mod pipeline_compiler;
pub mod pipeline_measure;
mod pipelines;
mod preparation;
mod recently_used;
mod renderer;
pub mod resources;
mod scene_compiler;
#[cfg(feature = "hot-reload")]
mod shader_compile;
pub mod shader_reload;
pub mod shader_source;
pub mod shader_tools;
mod timeline;
mod timing;
mod validation;
mod watchdog;
pub mod window;

use echolume_base::{files, picture, text};
use echolume_core::{barriers, passes, plan, queues, scene, spirv};
use echolume_probe as probe;

pub use bands::Bands;
pub use context::{Context, ContextOptions};
pub use device_selection::{Candidate, DeviceChoice};
pub use error::GpuError;
pub use formats::TexelAccess;
pub use losses::Losses;
pub use pipeline_compiler::{SceneMaker, Wake};
pub use pipelines::Shaders;
pub use preparation::{Preparation, Prepared};
pub use renderer::{Renderer, RendererOptions};
pub use timing::TimeStamps;
pub use validation::WRITERS_OF_RUNS;
pub use watchdog::Deadline;
