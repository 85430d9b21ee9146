//! Whole pictures: frames in, and what every stage made of them.

use super::built_in;
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::scene::Scene;
use std::sync::Arc;

/// A renderer with a volume's frames sent: values as the frame's texture yields them, one array a slice, in geometric order.
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

/// Sends a volume's frames into one of the volume images, and shows it.
pub fn send(renderer: &mut Renderer, frames: &[Texels], image: u32) -> Result<(), GpuError> {
    let format = Slot::Frames.format(renderer.scene());
    for (k, frame) in frames.iter().enumerate() {
        renderer.frame(k as u32, &frame.encode(format), image)?;
    }
    renderer.show(image)
}

/// One picture, with a renderer of its own.
pub fn picture(context: &Arc<Context>, scene: &Scene, frames: &[Texels]) -> Result<Picture, GpuError> {
    sent(context, scene, frames, &RendererOptions::default())?.picture()
}

/// What a slot holds after a picture.
pub fn slot(context: &Arc<Context>, scene: &Scene, frames: &[Texels], slot: Slot) -> Result<Texels, GpuError> {
    let mut renderer = sent(context, scene, frames, &RendererOptions::default())?;
    renderer.picture()?;
    let missing = || GpuError::Broken(format!("no pass writes '{}'", slot.name()));
    renderer.read(slot)?.ok_or_else(missing)
}

/// A scene, what was sent, and what came of it.
pub struct Drawn {
    pub name: String,
    pub scene: Scene,
    /// As the frames' textures yield them, one array a slice.
    pub frames: Vec<Texels>,
    pub picture: Picture,
}

/// Every mode, one after the other in one renderer: one volume image, one queue, frames in order, everything waited for.
pub fn modes(context: &Arc<Context>) -> Result<Vec<Drawn>, GpuError> {
    let mut renderer: Option<Renderer> = None;
    let options = RendererOptions { queues: Some(1), ..RendererOptions::default() };
    let draw = |asked: built_in::Asked| {
        let scene = asked.make().map_err(GpuError::Broken)?;
        let frames = built_in::wall(&scene, 0);
        let there = match &mut renderer {
            Some(there) => {
                there.change(scene.clone())?;
                there
            }
            None => renderer.insert(Renderer::new(context, scene.clone(), &options)?),
        };
        send(there, &frames, 0)?;
        Ok(Drawn { name: asked.name, scene, frames, picture: there.picture()? })
    };
    built_in::modes().into_iter().map(draw).collect()
}
