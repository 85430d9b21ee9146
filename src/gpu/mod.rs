//! The Vulkan renderer: the only module that calls Vulkan, and the only one with unsafe code.
//!
//! - `context` owns instance, device, queues and allocator; `device_selection` picks the device; `faults` injects faults.
//! - `resources` are images and buffers, also those of a scene's slots, `formats` what the device can do with them.
//! - `pipelines` compiles shaders, also on its own thread, `shader_reload` takes them from a folder that is watched.
//! - `recorder` records command buffers with their barriers and the time stamps of `timing`; `timeline` says when a submission is done.
//!   `bands` divides dispatches that a watchdog might end.
//! - `lost_device` reports why a device was lost, `budget` how much memory it has left.
//! - `renderer` runs the four stages, `pass_runner` a single pass for tests and benchmarks.
//! - `window` presents pictures.

mod bands;
pub mod budget;
pub mod context;
pub(crate) mod device_selection;
pub(crate) mod error;
pub mod faults;
pub(crate) mod formats;
pub mod lost_device;
pub mod pass_runner;
mod pipelines;
mod recorder;
mod renderer;
pub mod resources;
pub mod shader_reload;
mod timeline;
mod timing;
mod validation;
pub mod window;

pub use bands::Bands;
pub use context::{Context, ContextOptions};
pub use device_selection::{Candidate, DeviceChoice};
pub use error::GpuError;
pub use formats::TexelAccess;
pub use pipelines::{Shaders, Wake};
pub use renderer::{Renderer, RendererOptions};
pub use timing::TimeStamps;
