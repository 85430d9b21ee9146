//! One DICOM file as a recording.

use super::super::layout::Layout;
use super::super::packed::InputFile;
use super::super::{OpenOptions, kretz};
use super::about::{about, accept};
use super::classes::{Class, Coding};
use super::elements::Elements;
use super::image::{Arrangement, Image};
use super::placed::{Placed, layout};
use super::tags;
use super::{regions, volume};
use crate::files::InputError;

/// Reads the layout of one DICOM file.
///
/// # Errors
/// The file is cut short or damaged, holds no ultrasound, or has pixels of a kind that is not read.
pub(in super::super) fn read(file: &InputFile, options: &OpenOptions) -> Result<Layout, InputError> {
    let elements = Elements::read(file)?;
    if let Some((offset, length)) = elements.kretz {
        let mut layout = kretz::read(&file.window(offset, length))?;
        layout.format = "Kretz volume in DICOM";
        layout.remarks.extend(about(&elements));
        layout.unused = elements.unused(file.path, &mut layout.remarks);
        return refuse_spacing(file, options).map(|()| layout);
    }
    let kind = accept(file.path, &elements)?;
    // Philips counts volumes as frames.
    let slices = elements.root.long(tags::PHILIPS_SLICES).filter(|_| kind == Class::Philips).unwrap_or(1);
    let image = Image::of(file.path, &elements, slices)?;
    let placed = match kind {
        Class::EnhancedVolume => volume::enhanced(file.path, &elements, &image)?,
        Class::Philips => volume::philips(file.path, &elements, &image)?,
        _ => regions::pictures(file.path, &elements.root, &image, options)?,
    };
    if placed.has_spacing {
        refuse_spacing(file, options)?;
    }
    let is_plain = image.coding == Coding::Native && image.arrangement == Arrangement::Plain && !image.swapped;
    let is_whole = placed.part == [0, 0, image.size[0], image.size[1]];
    let is_in_order = placed.order.iter().copied().eq(0..image.places.len());
    let is_direct = is_plain && is_whole && is_in_order;
    if file.is_packed() && !is_direct {
        let is_native = image.coding == Coding::Native;
        let what = if is_native { "parts of frames, or pixels in another order" } else { "compressed frames" };
        let fault = format!("is packed by gzip, which is not read for {what}: unpack it");
        return Err(InputError::new(file.path, "file", fault));
    }
    let direct = image.parts.first().filter(|_| is_direct).map(|(offset, _)| file.pixels(*offset));
    let mut remarks = about(&elements);
    remarks.extend(placed.remarks);
    let mut layout = layout(vec![file.path.into()], file.path.into(), image, Placed { remarks, ..placed }, direct)?;
    layout.unused = elements.unused(file.path, &mut layout.remarks);
    Ok(layout)
}

fn refuse_spacing(file: &InputFile, options: &OpenOptions) -> Result<(), InputError> {
    let why = "is for pictures without a spacing; this file states its own";
    options.voxel_spacing.map_or(Ok(()), |_| Err(InputError::new(file.path, "--voxel-spacing", why)))
}
