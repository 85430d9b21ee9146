//! Draws unit after unit with one device and, as long as whole volumes follow each other, one renderer: its pipelines stay warm.

use super::agreement::Drawer;
use crate::args::open_device_until;
use crate::gpu::{Context, Deadline, DeviceChoice, GpuError, Losses, Renderer, RendererOptions};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::scene::Scene;
use crate::source::Frame;
use crate::verify::Findings;
use crate::verify::{compare_picture, render};
use std::sync::Arc;

/// Which Vulkan device is used, the time limit of a submission, and when to stop waiting.
#[derive(Clone)]
pub struct DeviceOptions {
    pub device: Option<DeviceChoice>,
    pub deadline: Deadline,
    /// Once this returns true, waiting for the device ends.
    pub stop: fn() -> bool,
}

/// Draws pictures of a batch: a device, and the renderer of the last picture.
pub struct Painter {
    context: Arc<Context>,
    renderer: Option<Renderer>,
    options: DeviceOptions,
    /// Losses of the device by the unit that is drawn.
    losses: Losses,
}

impl Painter {
    /// Opens the device.
    ///
    /// # Errors
    /// There is no such device, or it cannot be opened.
    pub fn open(options: &DeviceOptions) -> Result<Painter, GpuError> {
        let context = open_device_until(options.device.clone(), options.deadline, options.stop)?;
        Ok(Painter { context, renderer: None, options: options.clone(), losses: Losses::default() })
    }

    pub fn drawer(&self) -> Drawer {
        let there = &self.context.candidate;
        Drawer {
            device: there.name.clone(),
            driver: there.driver.trim().into(),
            vulkan: there.api_version(),
            is_software: there.is_software(),
        }
    }

    /// Draws a volume. If the device is lost, it is opened again and the work is repeated in smaller and smaller parts. `is_whole`: true if `frames`
    /// has every slice.
    ///
    /// # Errors
    /// The device lacks a feature, has too little memory, did not finish in time, was lost too often or cannot be opened again, or
    /// [`DeviceOptions::stop`] ended the wait for it.
    pub fn draw(&mut self, scene: &Scene, frames: &[Frame], is_whole: bool) -> Result<Picture, GpuError> {
        self.losses = Losses::default();
        loop {
            let drawn = self.draw_once(scene, frames, is_whole);
            let Err(error) = drawn else { return drawn };
            // What failed may have left anything.
            self.renderer = None;
            if !self.losses.allow_after(&error) {
                return Err(error);
            }
            let opened = open_device_until(self.options.device.clone(), self.options.deadline, self.options.stop);
            // The context is that of the lost device: neither this unit nor a later one can be drawn.
            self.context = opened.map_err(|why| match why {
                GpuError::Stopped { .. } => why,
                _ => GpuError::Lost { operation: "open the device again".into(), report: why.to_string() },
            })?;
        }
    }

    fn draw_once(&mut self, scene: &Scene, frames: &[Frame], is_whole: bool) -> Result<Picture, GpuError> {
        // Where frames are missing, those of the recording before must not be seen. A new renderer has none.
        if !is_whole || self.losses.any() {
            self.renderer = None;
        }
        let renderer = match &mut self.renderer {
            Some(there) => {
                there.change(scene.clone())?;
                there
            }
            none => {
                let options = RendererOptions { bands: self.losses.bands(), ..RendererOptions::default() };
                none.insert(Renderer::new(&self.context, scene.clone(), &options)?)
            }
        };
        renderer.volume(frames)?;
        let picture = renderer.picture()?;
        if !is_whole {
            self.renderer = None;
        }
        Ok(picture)
    }
}

/// Compares a picture with that of the f64 reference renderer, within the tolerance of `verify`. `frames`: one for every slice. The findings have a
/// fault if the picture differs by more.
pub fn against_reference(scene: &Scene, frames: &[Frame], picture: &Picture) -> Findings {
    let format = Slot::Frames.format(scene);
    let [width, height] = scene.geometry.frame_size();
    let mut slices = vec![Texels::untouched([width, height, 1], 1); scene.geometry.slices()];
    for frame in frames {
        if let Some(slice) = slices.get_mut(frame.slice) {
            *slice = Texels::decode([width, height, 1], format, &frame.bytes);
        }
    }
    let mut findings = Findings::default();
    compare_picture(&mut findings, "picture", &render::stored_reference_picture(scene, &slices), picture);
    findings
}
