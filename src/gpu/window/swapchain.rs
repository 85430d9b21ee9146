//! The swapchain: the images of a surface.

use super::PresentMode;
use super::present_wait::PresentWaiter;
use super::target::Target;
use crate::context::{Context, Presentation};
use crate::error::{ErrorContext, GpuError};
use crate::faults::InjectionPoint;
use crate::scene::WindowTexels;
use crate::sync::locked;
use ash::vk;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A surface with its swapchain images, which are made again when its size changes.
pub(crate) struct Swapchain {
    context: Arc<Context>,
    /// Keeps the window alive; the surface must be destroyed first.
    target: Target,
    surface: vk::SurfaceKHR,
    handle: vk::SwapchainKHR,
    pub images: Vec<SwapchainImage>,
    pub format: vk::Format,
    pub size: [u32; 2],
    present_mode: PresentMode,
    /// Measures when the pictures of `handle` are on the monitor, if the device can.
    waiter: Option<PresentWaiter>,
}

/// An image of a swapchain.
pub(crate) struct SwapchainImage {
    pub handle: vk::Image,
    /// Is signalled when the image has been drawn and can be presented.
    pub drawn: vk::Semaphore,
}

/// Formats that pass values of 10 bits to the monitor unchanged: four times as many levels of grey.
const DEEP: [vk::Format; 2] = [vk::Format::A2B10G10R10_UNORM_PACK32, vk::Format::A2R10G10B10_UNORM_PACK32];
/// Formats that pass 8-bit values to the monitor unchanged.
const FORMATS: [vk::Format; 2] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];

/// The deepest format that the surface offers and for which `can_draw` says that pictures can be copied and panels drawn.
fn choose(offered: &[vk::SurfaceFormatKHR], can_draw: impl Fn(vk::Format) -> bool) -> Option<vk::Format> {
    let is_plain = |f: &vk::SurfaceFormatKHR| f.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR;
    let is_offered = |format: &vk::Format| offered.iter().any(|o| o.format == *format && is_plain(o));
    let deep = DEEP.into_iter().filter(|format| can_draw(*format));
    deep.chain(FORMATS).find(is_offered)
}

impl Swapchain {
    /// A surface without images; [`Swapchain::fit`] creates them.
    ///
    /// # Errors
    /// The device cannot present on the target.
    pub fn new(context: &Arc<Context>, target: Target, present_mode: PresentMode) -> Result<Swapchain, GpuError> {
        let surface = target.surface(&context.entry, &context.instance, context.candidate.handle)?;
        let mut made = Swapchain {
            context: context.clone(),
            target,
            surface,
            handle: vk::SwapchainKHR::null(),
            images: Vec::new(),
            format: vk::Format::UNDEFINED,
            size: [0; 2],
            present_mode,
            waiter: None,
        };
        made.format = made.choose_format()?;
        Ok(made)
    }

    fn presentation(&self) -> Result<&Presentation, GpuError> {
        self.context
            .presentation
            .as_ref()
            .ok_or_else(|| GpuError::Window("the device was not opened for presentation".into()))
    }

    fn choose_format(&self) -> Result<vk::Format, GpuError> {
        let (device, family) = (self.context.candidate.handle, self.context.queue(0).family);
        let surfaces = &self.presentation()?.surfaces;
        // SAFETY: surface and device belong to this instance; the call only reads.
        let is_supported = unsafe { surfaces.get_physical_device_surface_support(device, family, self.surface) };
        if is_supported != Ok(true) {
            // No other query is allowed for such a surface.
            return Err(GpuError::Window("the surface is gone, or the device cannot present on it".into()));
        }
        // SAFETY: surface and device belong to this instance; the call only reads.
        let there = unsafe { surfaces.get_physical_device_surface_formats(device, self.surface) }
            .context(|| "list the formats of the surface".into())?;
        let needed = vk::FormatFeatureFlags::BLIT_DST
            | vk::FormatFeatureFlags::TRANSFER_SRC
            | vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND;
        let found = choose(&there, |format| self.context.format_features(format).contains(needed));
        let none = "the surface supports no UNORM format of 8 or 10 bits that pictures can be copied to";
        let found = found.ok_or_else(|| GpuError::Window(none.into()))?;
        // Pictures are made so from the next change of the scene on.
        let of_pictures = match found {
            deep if DEEP.contains(&deep) => WindowTexels::Deep,
            vk::Format::B8G8R8A8_UNORM => WindowTexels::Bgra8,
            _ => WindowTexels::Rgba8,
        };
        *locked(&self.context.window_texels) = of_pictures;
        Ok(found)
    }

    /// Replaces a lost surface by a new one on the same target.
    pub(crate) fn renew_surface(&mut self) -> Result<(), GpuError> {
        self.context.wait_idle()?;
        self.destroy();
        self.surface =
            self.target.surface(&self.context.entry, &self.context.instance, self.context.candidate.handle)?;
        self.format = self.choose_format()?;
        Ok(())
    }

    /// Makes the images again with the size of the surface, or with `wanted`, pixels, if the surface has no size of its own. Returns false if the
    /// surface is empty, as that of a minimised window. No image may be in flight.
    pub fn fit(&mut self, wanted: [u32; 2]) -> Result<bool, GpuError> {
        // It waits with the swapchain that is replaced.
        self.waiter = None;
        let presentation = self.presentation()?;
        let device = self.context.candidate.handle;
        // SAFETY: surface and device belong to this instance; the calls only read.
        let (can, modes) = unsafe {
            let can = presentation.surfaces.get_physical_device_surface_capabilities(device, self.surface);
            let modes = presentation.surfaces.get_physical_device_surface_present_modes(device, self.surface);
            (can.context(|| "ask the surface for its size".into())?, modes.unwrap_or_default())
        };
        let (least, most) = (can.min_image_extent, can.max_image_extent);
        let size = match can.current_extent.width {
            u32::MAX => vk::Extent2D {
                width: wanted[0].clamp(least.width, most.width.max(least.width)),
                height: wanted[1].clamp(least.height, most.height.max(least.height)),
            },
            _ => can.current_extent,
        };
        if size.width == 0 || size.height == 0 {
            return Ok(false);
        }
        let usage = vk::ImageUsageFlags::TRANSFER_DST;
        if !can.supported_usage_flags.contains(usage) {
            return Err(GpuError::Window("the surface's images cannot be copied into".into()));
        }
        let present_mode = match self.present_mode {
            PresentMode::Mailbox if modes.contains(&vk::PresentModeKHR::MAILBOX) => vk::PresentModeKHR::MAILBOX,
            _ => vk::PresentModeKHR::FIFO,
        };
        let alphas = [
            vk::CompositeAlphaFlagsKHR::OPAQUE,
            vk::CompositeAlphaFlagsKHR::INHERIT,
            vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
        ];
        let alpha = alphas.into_iter().find(|a| can.supported_composite_alpha.contains(*a)).unwrap_or(alphas[0]);
        let most = if can.max_image_count == 0 { u32::MAX } else { can.max_image_count };
        let create = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface)
            .min_image_count((can.min_image_count + 1).min(most))
            .image_format(self.format)
            .image_color_space(vk::ColorSpaceKHR::SRGB_NONLINEAR)
            .image_extent(size)
            .image_array_layers(1)
            .image_usage(usage)
            .pre_transform(can.current_transform)
            .composite_alpha(alpha)
            .present_mode(present_mode)
            .clipped(true)
            .old_swapchain(self.handle);
        // SAFETY: the create structure is complete; nothing of the old swapchain is in flight, and it is destroyed below.
        let made =
            unsafe { presentation.swapchains.create_swapchain(&create, None) }.context(|| "create a swapchain".into());
        self.drop_images();
        self.handle = made?;
        self.waiter = PresentWaiter::new(&self.context, self.handle);
        // SAFETY: the swapchain is alive.
        let images = unsafe { self.presentation()?.swapchains.get_swapchain_images(self.handle) }
            .context(|| "list the images of the swapchain".into())?;
        for handle in images {
            // SAFETY: the structure is complete.
            let drawn = unsafe { self.context.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
            let drawn = drawn.context(|| "create a semaphore".into())?;
            self.context.name(handle, "window");
            self.images.push(SwapchainImage { handle, drawn });
        }
        self.size = [size.width, size.height];
        Ok(true)
    }

    /// Acquires the next image; returns its index. It waits at most `nanoseconds`. `free` is signalled when the image may be written.
    pub fn acquire(&self, nanoseconds: u64, free: vk::Semaphore) -> Result<u32, vk::Result> {
        let Some(presentation) = &self.context.presentation else { return Err(vk::Result::ERROR_SURFACE_LOST_KHR) };
        self.context.faults.check(InjectionPoint::Acquire)?;
        // SAFETY: the swapchain is alive, and nothing waits for the semaphore.
        let acquired =
            unsafe { presentation.swapchains.acquire_next_image(self.handle, nanoseconds, free, vk::Fence::null()) };
        // A suboptimal image is presented all the same; `present` reports it again.
        acquired.map(|(image, _)| image)
    }

    /// Presents an image once it has been drawn. Returns true if the swapchain should be recreated.
    pub fn present(&mut self, image: u32) -> Result<bool, vk::Result> {
        let Some(presentation) = &self.context.presentation else { return Err(vk::Result::ERROR_SURFACE_LOST_KHR) };
        let (chains, images, drawn) = ([self.handle], [image], [self.images[image as usize].drawn]);
        let number = [self.waiter.as_mut().map_or(0, PresentWaiter::number)];
        let mut numbered = vk::PresentIdKHR::default().present_ids(&number);
        let mut present =
            vk::PresentInfoKHR::default().wait_semaphores(&drawn).swapchains(&chains).image_indices(&images);
        if self.waiter.is_some() {
            present = present.push_next(&mut numbered);
        }
        let at = Instant::now();
        // SAFETY: the image was acquired and a submission in flight signals `drawn`.
        let outcome = self.context.on_queue(|queue| unsafe { presentation.swapchains.queue_present(queue, &present) });
        if let (Ok(_), Some(waiter)) = (&outcome, &mut self.waiter) {
            waiter.presented(number[0], at);
        }
        outcome
    }

    /// The times from presentation to the monitor that were measured since the last call.
    pub fn take_latencies(&mut self) -> Vec<Duration> {
        self.waiter.as_mut().map(PresentWaiter::take).unwrap_or_default()
    }

    fn drop_images(&mut self) {
        self.waiter = None;
        // SAFETY: nothing is in flight.
        unsafe {
            for SwapchainImage { drawn, .. } in self.images.drain(..) {
                self.context.device.destroy_semaphore(drawn, None);
            }
            if let (Some(presentation), false) = (&self.context.presentation, self.handle == vk::SwapchainKHR::null()) {
                presentation.swapchains.destroy_swapchain(self.handle, None);
            }
        }
        self.handle = vk::SwapchainKHR::null();
    }

    fn destroy(&mut self) {
        self.drop_images();
        if let Some(presentation) = &self.context.presentation {
            // SAFETY: its swapchain is gone; null is allowed.
            unsafe { presentation.surfaces.destroy_surface(self.surface, None) };
        }
        self.surface = vk::SurfaceKHR::null();
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // A device that was lost is idle.
        let _ = self.context.wait_idle();
        if self.context.is_given_up() {
            // The surface stays, and its window must outlive it.
            std::mem::forget(self.target.clone());
            return;
        }
        self.destroy();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_of_10_bits_is_preferred_where_it_can_be_drawn_on() {
        let plain = |format| vk::SurfaceFormatKHR { format, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR };
        let [deep, other] = DEEP;
        let [usual, swapped] = FORMATS;
        let all = [plain(swapped), plain(usual), plain(other), plain(deep)];
        assert_eq!(choose(&all, |_| true), Some(deep));
        assert_eq!(choose(&all, |format| format != deep), Some(other));
        assert_eq!(choose(&all, |_| false), Some(usual));
        assert_eq!(choose(&all[..1], |_| true), Some(swapped));
        let wide = vk::SurfaceFormatKHR { format: deep, color_space: vk::ColorSpaceKHR::HDR10_ST2084_EXT };
        assert_eq!(choose(&[wide, plain(usual)], |_| true), Some(usual), "a monitor would show other levels");
        assert_eq!(choose(&[plain(vk::Format::B8G8R8A8_SRGB)], |_| true), None);
    }
}
