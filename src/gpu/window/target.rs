//! What pictures are shown on: a window of a windowing system, or a monitor that nothing else uses.

use super::display;
use crate::gpu::error::Doing;
use crate::gpu::{Candidate, GpuError};
use ash::{Entry, Instance, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::ffi::CStr;
use std::sync::Arc;

/// A window, whichever library made it. It lives as long as anything that is shown on it.
pub trait Handles: HasWindowHandle + HasDisplayHandle {}

impl<T: HasWindowHandle + HasDisplayHandle> Handles for T {}

/// What pictures are shown on.
#[derive(Clone)]
pub enum Target {
    Window(Arc<dyn Handles>),
    /// A monitor without a compositor (VK_KHR_display).
    Monitor(display::Wanted),
}

impl Target {
    /// The instance extensions that a surface on it needs.
    ///
    /// # Errors
    /// A windowing system that Vulkan cannot show on here.
    pub fn extensions(&self, entry: &Entry) -> Result<Vec<&'static CStr>, GpuError> {
        let wanted: Vec<&'static CStr> = match self {
            Target::Window(window) => {
                let display = window.display_handle().map_err(|e| GpuError::Window(e.to_string()))?;
                let names = ash_window::enumerate_required_extensions(display.as_raw())
                    .map_err(|e| GpuError::Window(format!("Vulkan knows no such windowing system ({e:?})")))?;
                // SAFETY: the names are constants of ash, terminated and static.
                names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect()
            }
            Target::Monitor(_) => vec![ash::khr::surface::NAME, ash::khr::display::NAME],
        };
        // SAFETY: only reads the list of extensions.
        let there = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let lacks = wanted.iter().find(|name| !there.iter().any(|e| e.extension_name_as_c_str() == Ok(name)));
        match lacks {
            None => Ok(wanted),
            Some(name) => Err(GpuError::Window(format!("no Vulkan driver has {}", name.to_string_lossy()))),
        }
    }

    pub fn is_monitor(&self) -> bool {
        matches!(self, Target::Monitor(_))
    }

    /// A surface on it for this device.
    ///
    /// # Errors
    /// A window that is gone; no monitor that is free.
    pub fn surface(
        &self,
        entry: &Entry,
        instance: &Instance,
        device: vk::PhysicalDevice,
    ) -> Result<vk::SurfaceKHR, GpuError> {
        let window = match self {
            Target::Window(window) => window,
            Target::Monitor(wanted) => return display::surface(entry, instance, device, wanted),
        };
        let display = window.display_handle().map_err(|e| GpuError::Window(e.to_string()))?;
        let handle = window.window_handle().map_err(|e| GpuError::Window(e.to_string()))?;
        // SAFETY: both handles are alive: whoever makes the surface holds the window as long as it.
        unsafe { ash_window::create_surface(entry, instance, display.as_raw(), handle.as_raw(), None) }
            .doing(|| "create a surface on the window".into())
    }

    /// Notes in a candidate's list what keeps it from showing anything here.
    pub fn note_lack(&self, entry: &Entry, instance: &Instance, candidate: &mut Candidate) {
        if !candidate.presents {
            candidate.lacks.push("VK_KHR_swapchain or dynamicRendering".into());
        }
        let Some(queue) = candidate.queues.first().filter(|q| q.draws) else {
            candidate.lacks.push("a queue that draws and computes".into());
            return;
        };
        let surfaces = ash::khr::surface::Instance::new(entry, instance);
        let shows = self.surface(entry, instance, candidate.handle).map(|surface| {
            // SAFETY: the surface was just made from this instance and is not used after.
            unsafe {
                let shows = surfaces.get_physical_device_surface_support(candidate.handle, queue.family, surface);
                surfaces.destroy_surface(surface, None);
                shows.unwrap_or(false)
            }
        });
        match shows {
            Ok(true) => {}
            Ok(false) => candidate.lacks.push("a way to show pictures here".into()),
            // Which monitors there are is said nowhere else.
            Err(why) => {
                let why = if let GpuError::Window(why) = why { why } else { why.to_string() };
                candidate.lacks.push(format!("a way to show pictures here ({why})").into());
            }
        }
    }
}
