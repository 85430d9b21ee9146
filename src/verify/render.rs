//! Renders pictures for checks, on the device and by the f64 reference.

use super::built_in;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::slots::Format;
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::reference;
use crate::scene::Scene;
use std::sync::Arc;

/// Makes a renderer and sends it a volume, which the next picture shows. `frames`: one array for each slice in geometric order, with the values that
/// a shader reads (0..1).
///
/// # Errors
/// Those of [`Renderer::new`], [`Renderer::frame`] and [`Renderer::show`]: for example, a frame of another size, or more frames than slices.
pub fn sent(
    context: &Arc<Context>,
    scene: &Scene,
    frames: &[Texels],
    options: &RendererOptions,
) -> Result<Renderer, GpuError> {
    let mut renderer = Renderer::new(context, scene.clone(), options)?;
    send(&mut renderer, frames, 0)?;
    Ok(renderer)
}

/// Sends the frames of a volume into volume image `image`, alone and in batches of two and three, and selects that image for the next picture.
///
/// # Errors
/// Those of [`Renderer::frame`] and [`Renderer::show`]: for example, a frame of another size, or more frames than slices.
pub fn send(renderer: &mut Renderer, frames: &[Texels], image: u32) -> Result<(), GpuError> {
    let format = Slot::Frames.format(renderer.scene());
    for (k, frame) in frames.iter().enumerate() {
        renderer.frame(k as u32, &frame.encode(format), image)?;
        if [0, 2, 5].contains(&(k % 6)) {
            renderer.submit_frames()?;
        }
    }
    renderer.show(image)
}

/// Renders one picture with a new renderer. `frames`: one array for each slice in geometric order, with the values that a shader reads (0..1).
///
/// # Errors
/// Those of [`sent`], or the device fails.
pub fn picture(context: &Arc<Context>, scene: &Scene, frames: &[Texels]) -> Result<Picture, GpuError> {
    sent(context, scene, frames, &RendererOptions::default())?.picture()
}

/// The content of a slot after a new renderer has drawn a picture.
///
/// # Errors
/// Those of [`sent`], the device fails, or no pass writes the slot.
pub fn slot(context: &Arc<Context>, scene: &Scene, frames: &[Texels], slot: Slot) -> Result<Texels, GpuError> {
    let mut renderer = sent(context, scene, frames, &RendererOptions::default())?;
    renderer.picture()?;
    let missing = || GpuError::Broken(format!("no pass writes '{}'", slot.name()));
    renderer.read(slot)?.ok_or_else(missing)
}

/// A rendered picture, with its scene and frames.
pub struct Drawn {
    pub name: String,
    pub scene: Scene,
    /// The frames, one for each slice in geometric order, with the values that a shader reads (0..1).
    pub frames: Vec<Texels>,
    pub picture: Picture,
}

/// Renders every mode, one after the other in one renderer, in the simplest way: one volume image, one queue, frames in order.
///
/// # Errors
/// The device fails.
pub fn modes(context: &Arc<Context>) -> Result<Vec<Drawn>, GpuError> {
    let mut renderer: Option<Renderer> = None;
    let options = RendererOptions { queues: Some(1), ..RendererOptions::default() };
    let draw = |spec: built_in::SceneSpec| {
        let scene = spec.build().map_err(GpuError::Broken)?;
        let frames = built_in::wall(&scene, 0);
        let there = match &mut renderer {
            Some(there) => {
                there.change(scene.clone())?;
                there
            }
            None => renderer.insert(Renderer::new(context, scene.clone(), &options)?),
        };
        send(there, &frames, 0)?;
        Ok(Drawn { name: spec.name, scene, frames, picture: there.picture()? })
    };
    built_in::modes().into_iter().map(draw).collect()
}

/// Renders the picture by the reference renderer (f64).
pub(crate) fn reference_picture(scene: &Scene, frames: &[Texels]) -> Picture {
    let mut slots = reference::render(scene, frames);
    let screen = slots.remove(&Slot::Screen).unwrap_or_else(|| Texels::untouched([0; 3], 4));
    Picture { width: screen.size[0] as u32, height: screen.size[1] as u32, rgba: screen.encode(Format::Rgba8) }
}

/// Renders the picture by the reference renderer (f64), from frames that are rounded to the format in which the device stores them.
pub fn stored_reference_picture(scene: &Scene, frames: &[Texels]) -> Picture {
    let format = Slot::Frames.format(scene);
    let stored: Vec<_> = frames.iter().map(|f| Texels::decode(f.size, format, &f.encode(format))).collect();
    reference_picture(scene, &stored)
}
