//! What shows pictures: [`target`] is a window or a monitor, [`swapchain`] the images that it takes in turns, [`screen`] puts the
//! picture and the panels into one of them, [`overlay`] draws panels, [`display`] finds a monitor where there is no compositor.

pub mod display;
mod overlay;
mod screen;
mod stages;
mod swapchain;
mod target;

pub use overlay::Panels;
pub(super) use screen::Drawn;
pub use screen::{PresentOutcome, Screen};
pub use swapchain::PresentMode;
pub use target::{Handles, Target};
