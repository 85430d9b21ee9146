//! The only folder that knows Vulkan, and the only one with unsafe code.
//!
//! [`context`] owns instance, device, queue and allocator; [`resources`] images and buffers; [`pipelines`] what a shader
//! becomes; [`slots`] the resources of a scene; [`recorder`] one command buffer, with the barriers of [`order`] and time stamps; [`measured`] what those said; [`timeline`] what is done;
//! [`renderer`] the four stages; [`single`] one pass alone, for tests; [`window`] what shows their pictures.

pub mod barrier_recorder;
pub mod context;
pub mod error;
pub mod faults;
pub mod formats;
pub mod measured;
pub mod pass_runner;
pub mod pipelines;
pub mod recorder;
pub mod renderer;
pub mod resources;
pub mod select;
pub mod shader_reload;
pub mod slots;
pub mod timeline;
pub mod timing;
#[cfg(feature = "view")]
pub mod window;
#[cfg(not(feature = "view"))]
#[path = "no_window.rs"]
mod window;

pub use context::{Context, ContextOptions};
pub use error::GpuError;
pub use pipelines::{Fetch, Wake};
pub use renderer::{Options, Renderer};
pub use select::{Candidate, Choice};
