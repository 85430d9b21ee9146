//! The target of presentation: a window, a monitor without a compositor (VK_KHR_display), or a surface that nobody sees
//! (VK_EXT_headless_surface).

use crate::device_selection::Candidate;
use crate::error::{ErrorContext, GpuError};
use ash::{Entry, Instance, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::ffi::CStr;
use std::sync::Arc;

/// A window of any windowing library. The surface on it keeps it alive.
pub trait WindowHandles: HasWindowHandle + HasDisplayHandle {}

impl<T: HasWindowHandle + HasDisplayHandle> WindowHandles for T {}

/// Where pictures are presented.
#[derive(Clone)]
pub enum Target {
    Window(Arc<dyn WindowHandles>),
    /// A monitor without a compositor (VK_KHR_display).
    Monitor(MonitorChoice),
    /// A surface of this size, pixels, that no monitor shows (VK_EXT_headless_surface).
    Unseen([u32; 2]),
}

impl Target {
    /// The instance extensions that a surface on this target needs.
    ///
    /// # Errors
    /// The window system is one that Vulkan does not support here.
    pub fn extensions(&self, entry: &Entry) -> Result<Vec<&'static CStr>, GpuError> {
        let wanted: Vec<&'static CStr> = match self {
            Target::Window(window) => {
                let display = window.display_handle().map_err(|e| GpuError::Window(e.to_string()))?;
                let names = ash_window::enumerate_required_extensions(display.as_raw())
                    .map_err(|e| GpuError::Window(format!("Vulkan does not support this windowing system ({e:?})")))?;
                // SAFETY: the names are constants of ash, terminated and static.
                names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect()
            }
            Target::Monitor(_) => vec![ash::khr::surface::NAME, ash::khr::display::NAME],
            Target::Unseen(_) => vec![ash::khr::surface::NAME, ash::ext::headless_surface::NAME],
        };
        // SAFETY: only reads the list of extensions.
        let there = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let lacks = wanted.iter().find(|name| !there.iter().any(|e| e.extension_name_as_c_str() == Ok(name)));
        match lacks {
            None => Ok(wanted),
            Some(name) => Err(GpuError::Window(format!("no Vulkan driver has {}", name.to_string_lossy()))),
        }
    }

    pub(crate) fn is_monitor(&self) -> bool {
        matches!(self, Target::Monitor(_))
    }

    /// Creates a surface on this target for the device.
    ///
    /// # Errors
    /// The window is closed, the chosen monitor or mode does not exist, another program uses the monitor, or the driver fails.
    pub fn surface(
        &self,
        entry: &Entry,
        instance: &Instance,
        device: vk::PhysicalDevice,
    ) -> Result<vk::SurfaceKHR, GpuError> {
        let window = match self {
            Target::Window(window) => window,
            Target::Monitor(wanted) => return monitor_surface(entry, instance, device, wanted),
            Target::Unseen(_) => {
                let surfaces = ash::ext::headless_surface::Instance::new(entry, instance);
                // SAFETY: the instance was created with this extension, because the target asks for it.
                let surface = unsafe { surfaces.create_headless_surface(&Default::default(), None) };
                return surface.context(|| "create a surface without a screen".into());
            }
        };
        let display = window.display_handle().map_err(|e| GpuError::Window(e.to_string()))?;
        let handle = window.window_handle().map_err(|e| GpuError::Window(e.to_string()))?;
        // SAFETY: both handles are alive: the owner of the surface keeps the window alive.
        unsafe { ash_window::create_surface(entry, instance, display.as_raw(), handle.as_raw(), None) }
            .context(|| "create a surface on the window".into())
    }

    /// Adds to the candidate's missing features those that presentation on this target needs.
    pub(crate) fn check_support(&self, entry: &Entry, instance: &Instance, candidate: &mut Candidate) {
        if !candidate.can_present {
            candidate.missing.push("VK_KHR_swapchain or dynamicRendering".into());
        }
        let Some(queue) = candidate.queues.first().filter(|q| q.draws) else {
            candidate.missing.push("a queue that draws and computes".into());
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
            Ok(false) => candidate.missing.push("support for presentation here".into()),
            // Only this error names the available monitors.
            Err(why) => {
                let why = if let GpuError::Window(why) = why { why } else { why.to_string() };
                candidate.missing.push(format!("support for presentation here ({why})").into());
            }
        }
    }
}

/// Which monitor to present on, and in which display mode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MonitorChoice {
    /// A part of the monitor's name, ignoring case. The first monitor whose name contains it and that has a display mode is used. `None` for the
    /// first monitor that has a mode.
    pub monitor: Option<String>,
    /// Width and height, pixels, which a mode must have. `None` for the monitor's native resolution, or the largest mode if none has that.
    pub size: Option<[u32; 2]>,
    /// Refresh rate, Hz: of the modes with the chosen resolution, the one with the nearest rate is used. `None` for the highest rate. Without effect
    /// where the largest mode replaces the native resolution.
    pub refresh: Option<f64>,
}

/// A monitor as a driver lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct Monitor {
    pub name: String,
    /// Native resolution, pixels.
    pub size: [u32; 2],
    pub modes: Vec<Mode>,
}

/// A display mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    pub size: [u32; 2],
    /// Refresh rate, mHz (thousandths of a hertz).
    pub refresh: u32,
}

impl MonitorChoice {
    /// The index in `monitors` of the chosen monitor, and the index of its mode.
    ///
    /// # Errors
    /// There is no such monitor or mode; the error lists what is available.
    pub fn choose(&self, monitors: &[Monitor]) -> Result<(usize, usize), String> {
        let all = || monitors.iter().map(|m| format!("{:?}", m.name)).collect::<Vec<_>>().join(", ");
        let is_it =
            |m: &Monitor| self.monitor.as_ref().is_none_or(|part| m.name.to_lowercase().contains(&part.to_lowercase()));
        let found = monitors.iter().position(|m| is_it(m) && !m.modes.is_empty());
        let Some(monitor) = found else {
            return Err(match (&self.monitor, monitors.is_empty()) {
                (_, true) => {
                    "no monitor is connected to this device: a window needs display.direct = false, or no --direct"
                        .into()
                }
                (Some(part), _) => format!("no monitor is called {part:?}; there are: {}", all()),
                (None, _) => format!("no monitor has a mode; there are: {}", all()),
            });
        };
        let Monitor { name, size, modes } = &monitors[monitor];
        let wanted = self.size.unwrap_or(*size);
        let area = |m: &Mode| u64::from(m.size[0]) * u64::from(m.size[1]);
        let near = |m: &Mode| self.refresh.map_or(0.0, |hz| (f64::from(m.refresh) / 1000.0 - hz).abs());
        let candidates = modes.iter().enumerate().filter(|(_, m)| m.size == wanted);
        // The nearest to the requested refresh rate, or the fastest.
        let best = candidates.min_by(|(_, a), (_, b)| near(a).total_cmp(&near(b)).then(b.refresh.cmp(&a.refresh)));
        // If no mode has the native resolution, the largest one is used.
        let best = best.or_else(|| match self.size {
            None => modes.iter().enumerate().max_by_key(|(_, m)| (area(m), m.refresh)),
            Some(_) => None,
        });
        match best {
            Some((mode, _)) => Ok((monitor, mode)),
            None => {
                let there: Vec<String> = modes.iter().map(|m| format!("{}x{}", m.size[0], m.size[1])).collect();
                Err(format!("{name:?} has no mode of {}x{}; it has: {}", wanted[0], wanted[1], there.join(", ")))
            }
        }
    }
}

/// The first display plane that supports a display and is free or already used for it.
fn plane(
    displays: &ash::khr::display::Instance,
    device: vk::PhysicalDevice,
    display: vk::DisplayKHR,
    mode: vk::DisplayModeKHR,
) -> Result<Option<(u32, u32, vk::DisplayPlaneAlphaFlagsKHR)>, GpuError> {
    // SAFETY: the device belongs to the instance; the calls only read.
    let planes = unsafe { displays.get_physical_device_display_plane_properties(device) }
        .context(|| "list the planes of the monitors".into())?;
    for (number, plane) in (0..).zip(&planes) {
        let is_free = plane.current_display == vk::DisplayKHR::null() || plane.current_display == display;
        // SAFETY: as above; the plane's number is one of those listed.
        let reaches = unsafe { displays.get_display_plane_supported_displays(device, number) }.unwrap_or_default();
        // SAFETY: as above.
        let Ok(can) = (unsafe { displays.get_display_plane_capabilities(device, mode, number) }) else { continue };
        if is_free && reaches.contains(&display) {
            let alphas = [
                vk::DisplayPlaneAlphaFlagsKHR::OPAQUE,
                vk::DisplayPlaneAlphaFlagsKHR::GLOBAL,
                vk::DisplayPlaneAlphaFlagsKHR::PER_PIXEL,
            ];
            let alpha = alphas.into_iter().find(|a| can.supported_alpha.contains(*a)).unwrap_or(alphas[0]);
            return Ok(Some((number, plane.current_stack_index, alpha)));
        }
    }
    Ok(None)
}

/// The monitor and the display mode that were chosen.
pub(super) struct Chosen {
    name: String,
    display: vk::DisplayKHR,
    pub mode: vk::DisplayModePropertiesKHR,
}

/// Looks up the chosen monitor and mode.
///
/// # Errors
/// No such monitor or mode.
pub(super) fn choose_monitor(
    displays: &ash::khr::display::Instance,
    device: vk::PhysicalDevice,
    wanted: &MonitorChoice,
) -> Result<Chosen, GpuError> {
    // SAFETY: the device belongs to the instance; the call only reads.
    let there =
        unsafe { displays.get_physical_device_display_properties(device) }.context(|| "list the monitors".into())?;
    let mut monitors = Vec::new();
    let mut modes = Vec::new();
    for display in &there {
        // SAFETY: as above.
        let of = unsafe { displays.get_display_mode_properties(device, display.display) }.unwrap_or_default();
        // SAFETY: the name is null or a terminated string that lives as long as the instance.
        let name = unsafe { display.display_name_as_c_str() }.map(|name| name.to_string_lossy().into_owned());
        let mode = |m: &vk::DisplayModePropertiesKHR| Mode {
            size: [m.parameters.visible_region.width, m.parameters.visible_region.height],
            refresh: m.parameters.refresh_rate,
        };
        let size = [display.physical_resolution.width, display.physical_resolution.height];
        monitors.push(Monitor { name: name.unwrap_or_default(), size, modes: of.iter().map(mode).collect() });
        modes.push(of);
    }
    let (monitor, mode) = wanted.choose(&monitors).map_err(GpuError::Window)?;
    let name = monitors.swap_remove(monitor).name;
    Ok(Chosen { name, display: there[monitor].display, mode: modes[monitor][mode] })
}

/// A surface that covers the chosen monitor.
///
/// # Errors
/// No such monitor, or another program uses it.
fn monitor_surface(
    entry: &Entry,
    instance: &Instance,
    device: vk::PhysicalDevice,
    wanted: &MonitorChoice,
) -> Result<vk::SurfaceKHR, GpuError> {
    let displays = ash::khr::display::Instance::new(entry, instance);
    let Chosen { name, display, mode } = choose_monitor(&displays, device, wanted)?;
    let Some((plane, stack, alpha)) = plane(&displays, device, display, mode.display_mode)? else {
        return Err(GpuError::Window(format!("{name:?} is in use: no plane of it is free")));
    };
    let create = vk::DisplaySurfaceCreateInfoKHR::default()
        .display_mode(mode.display_mode)
        .plane_index(plane)
        .plane_stack_index(stack)
        .transform(vk::SurfaceTransformFlagsKHR::IDENTITY)
        .global_alpha(1.0)
        .alpha_mode(alpha)
        .image_extent(mode.parameters.visible_region);
    // SAFETY: mode and plane were listed by this device.
    unsafe { displays.create_display_plane_surface(&create, None) }.context(|| format!("take monitor {name:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn monitors() -> Vec<Monitor> {
        let mode = |size, hz: u32| Mode { size, refresh: hz * 1000 };
        let bare = |name: &str, size| Monitor { name: name.into(), size, modes: Vec::new() };
        vec![
            bare("HDMI-1", [0, 0]),
            Monitor {
                name: "EIZO MX243W".into(),
                size: [1920, 1200],
                modes: vec![mode([1920, 1200], 60), mode([1920, 1200], 75), mode([1024, 768], 85)],
            },
            Monitor { name: "Panel".into(), size: [800, 480], modes: vec![mode([640, 480], 60), mode([720, 480], 50)] },
        ]
    }

    #[test]
    fn the_first_monitor_with_a_mode_is_taken_at_its_own_size_and_fastest() {
        assert_eq!(MonitorChoice::default().choose(&monitors()), Ok((1, 1)));
    }

    #[test]
    fn name_size_and_refresh_rate_select_the_mode() {
        let wanted = |monitor: &str, size, refresh| MonitorChoice { monitor: Some(monitor.into()), size, refresh };
        assert_eq!(wanted("eizo", None, Some(60.0)).choose(&monitors()), Ok((1, 0)));
        assert_eq!(wanted("eizo", Some([1024, 768]), None).choose(&monitors()), Ok((1, 2)));
        assert_eq!(
            wanted("panel", None, None).choose(&monitors()),
            Ok((2, 1)),
            "the largest: no mode has the native resolution"
        );
    }

    #[test]
    fn an_error_names_the_request_and_what_is_available() {
        let none =
            MonitorChoice { monitor: Some("dell".into()), ..MonitorChoice::default() }.choose(&monitors()).unwrap_err();
        assert!(none.contains("dell") && none.contains("EIZO"), "{none}");
        let small = MonitorChoice { size: Some([5, 5]), ..MonitorChoice::default() }.choose(&monitors()).unwrap_err();
        assert!(small.contains("5x5") && small.contains("1024x768"), "{small}");
        assert!(MonitorChoice::default().choose(&[]).unwrap_err().contains("connected"));
    }
}
