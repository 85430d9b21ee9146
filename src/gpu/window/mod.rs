//! Presentation: `target` is a window or a monitor, `swapchain` the images of its surface, `screen` copies the picture into
//! one of them and draws the panels over it, `overlay` draws the panels. A build without the feature `view` has only a target
//! that cannot exist.

#[cfg(feature = "view")]
mod overlay;
#[cfg(feature = "view")]
pub(super) mod screen;
#[cfg(feature = "view")]
mod swapchain;
#[cfg_attr(not(feature = "view"), path = "no_target.rs")]
pub(super) mod target;

#[cfg(feature = "view")]
pub use overlay::Panels;
#[cfg(feature = "view")]
pub use screen::{PresentOutcome, Screen, monitor_size};
#[cfg(feature = "view")]
pub use swapchain::PresentMode;
#[cfg(feature = "view")]
pub use target::{MonitorChoice, Target, WindowHandles};
