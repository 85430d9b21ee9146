//! Whole pictures: frames in, and what every stage made of them.

use crate::gpu::{Context, GpuError, Options, Renderer};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::scene::Scene;
use std::sync::Arc;

/// A renderer with a volume's frames sent: values as the frame's texture yields them, one array a slice, in geometric order.
pub fn sent(context: &Arc<Context>, scene: &Scene, frames: &[Texels], options: &Options) -> Result<Renderer, GpuError> {
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
    sent(context, scene, frames, &Options::default())?.picture()
}

/// What a slot holds after a picture.
pub fn slot(context: &Arc<Context>, scene: &Scene, frames: &[Texels], slot: Slot) -> Result<Texels, GpuError> {
    let mut renderer = sent(context, scene, frames, &Options::default())?;
    renderer.picture()?;
    let missing = || GpuError::Broken(format!("no pass writes '{}'", slot.name()));
    renderer.read(slot)?.ok_or_else(missing)
}
