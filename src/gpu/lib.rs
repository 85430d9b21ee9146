//! The Vulkan renderer: the only member that calls Vulkan, and the only one with unsafe code.
//!
//! - `context` owns instance, device, queues and allocator. `device_selection` picks the device, and `faults` injects faults.
//! - `resources` has images and the slots of a scene, `buffers` the buffers for upload and readback, `memory` their memory, and `formats`
//!   the formats that the device supports.
//! - `pipelines` compiles shaders, `scene_compiler` those of a scene, `pipeline_compiler` those on a thread in the background, and
//!   `preparation` those that are needed before there is a renderer. `pipeline_measure` measures compilations. `pipeline_cache` stores
//!   compiled pipelines on disk. `shader_reload` reads shaders from a folder that is watched. `descriptor_sets` serves devices without push
//!   descriptors.
//! - `command_recorder` records command buffers with the barriers of `device_queues` and the time stamps of `timing`. `timeline` tells which
//!   submissions are done, and `watchdog` gives up a device that does not finish. `bands` divides dispatches that a driver's watchdog might
//!   end, and `paced` holds bands back while a window's panels are drawn.
//! - `lost_device` reports why a device was lost, `losses` counts how often the same work lost it, `budget` reads the memory that is left,
//!   and `host_memory` returns the memory that drivers freed.
//! - `renderer` runs the four stages, and `pass_runner` a single pass for tests and benchmarks.
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

use echolume_base::{files, picture, sync, text, tree};
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
