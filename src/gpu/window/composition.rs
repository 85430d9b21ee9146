//! The composed window: picture and panels in an image of their own, which is copied to the window. While only the picture changes, as
//! during a drag, the panels beside it stay as they are: drawing them takes a software device as long as a coarse picture.

use super::flat_image::FlatImage;
use crate::context::Context;
use crate::error::GpuError;
use ash::vk;
use egui::ClippedPrimitive;
use std::sync::Arc;

/// The image, and what was drawn into it last.
pub(super) struct Composition {
    pub image: FlatImage,
    /// It was drawn into, and has a layout.
    pub is_laid_out: bool,
    /// Its content. None if it is not known.
    pub content: Option<Content>,
}

/// What a composition holds.
pub(super) struct Content {
    /// The panels, with the pixels per point that they were drawn with.
    pub shapes: Vec<ClippedPrimitive>,
    pub scale: f32,
    /// Where the picture is, pixels: its corner and size.
    pub picture: [[u32; 2]; 2],
}

impl Composition {
    /// # Errors
    /// The device has no memory for it.
    pub(super) fn new(context: &Arc<Context>, format: vk::Format, size: [u32; 2]) -> Result<Composition, GpuError> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let image = FlatImage::new(context, "composed window", format, size, usage)?;
        Ok(Composition { image, is_laid_out: false, content: None })
    }

    /// True if it fits images of the window of this format and size, pixels.
    pub(super) fn fits(&self, format: vk::Format, size: [u32; 2]) -> bool {
        (self.image.format, self.image.size) == (format, size)
    }
}
