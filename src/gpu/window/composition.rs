//! The composed window: picture and panels in an image of their own, which is copied to the window. While only the picture changes, as
//! during a drag, the panels beside it stay as they are: drawing them takes a software device as long as a coarse picture.

use crate::context::Context;
use crate::error::GpuError;
use crate::resources::RawImage;
use ash::vk;
use egui::ClippedPrimitive;
use std::sync::Arc;

/// The image in which picture and panels are composed for a window, and what was drawn into it last.
pub(super) struct Composition {
    pub image: RawImage,
    /// That of the window.
    pub format: vk::Format,
    /// That of the window, pixels.
    pub size: [u32; 2],
    /// True if the image was drawn into, so that its layout is no longer UNDEFINED.
    pub is_laid_out: bool,
    /// What the image shows. None if that is not known.
    pub content: Option<Content>,
}

/// What was drawn into a composition.
pub(super) struct Content {
    /// The panels. `scale`: the pixels per point that they were drawn with.
    pub shapes: Vec<ClippedPrimitive>,
    pub scale: f32,
    /// Upper left corner of the picture and its size, pixels of the window.
    pub picture: [[u32; 2]; 2],
}

impl Composition {
    /// Makes the image for a window of this format and size, pixels.
    ///
    /// # Errors
    /// The device has no memory for it.
    pub(super) fn new(context: &Arc<Context>, format: vk::Format, size: [u32; 2]) -> Result<Composition, GpuError> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let image = RawImage::flat(context, "composed window", format, size, usage)?;
        Ok(Composition { image, format, size, is_laid_out: false, content: None })
    }
}
