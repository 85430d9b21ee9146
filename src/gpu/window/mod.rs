//! Presentation. `target` is a window, a monitor or a surface that nobody sees, and `swapchain` the images of its surface. `screen` copies the picture into
//! `composition`, draws the panels over it, and copies the result into an image of the swapchain. `panel_textures` keeps the textures of
//! the panels. `present_wait` measures when a picture becomes visible. A build without the
//! feature `view` has only a target that cannot exist.

#[cfg(feature = "view")]
mod composition;
#[cfg(feature = "view")]
mod damage;
#[cfg(feature = "view")]
mod panel_textures;
#[cfg(feature = "view")]
mod present_wait;
#[cfg(feature = "view")]
pub(super) mod screen;
#[cfg(feature = "view")]
mod swapchain;
#[cfg(feature = "view")]
pub(super) mod target;

#[cfg(feature = "view")]
pub use screen::{Panels, PresentOutcome, Screen, fixed_size};
#[cfg(feature = "view")]
pub use target::{MonitorChoice, Target, WindowHandles};

pub use crate::scene::PresentMode;

/// The target of presentation in a build without the feature `view`. No value of it exists, so no function here is ever called.
#[cfg(not(feature = "view"))]
pub(super) mod target {
    use crate::device_selection::Candidate;
    use crate::error::GpuError;
    use ash::{Entry, Instance};
    use std::ffi::CStr;

    pub enum Target {}

    impl Target {
        pub fn extensions(&self, _: &Entry) -> Result<Vec<&'static CStr>, GpuError> {
            match *self {}
        }

        pub(crate) fn check_support(&self, _: &Entry, _: &Instance, _: &mut Candidate) {
            match *self {}
        }

        pub(crate) fn is_monitor(&self) -> bool {
            match *self {}
        }
    }
}
