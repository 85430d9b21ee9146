//! Slot formats as Vulkan formats, and their support by the device.

use super::context::Context;
use super::device_selection::Candidate;
use super::error::GpuError;
use super::faults::Poison;
use crate::passes::Slot;
use crate::passes::slots::{Format, Shape};
use crate::plan::Plan;
use crate::scene::{Sampling, Scene, WindowTexels};
use crate::sync::locked;
use ash::vk;

/// By which instructions shaders read single texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelAccess {
    /// `texelFetch` from textures, as the shaders are written.
    Textures,
    /// `imageLoad` from storage images and texel buffers; the SPIR-V is rewritten.
    Storage,
}

impl TexelAccess {
    /// The faster access on a device. A software device runs its complete sampler for every fetch; on a GPU textures have caches of their own.
    pub fn for_device(candidate: &Candidate) -> TexelAccess {
        if candidate.is_software() { TexelAccess::Storage } else { TexelAccess::Textures }
    }

    /// The fastest sampling with this access. `ray.sampling = "auto"` selects it, or [`Sampling::Exact`] where it cannot be used or does not pay.
    pub fn sampling(self) -> Sampling {
        if self == TexelAccess::Storage { Sampling::PackedNeighbours } else { Sampling::Hardware }
    }

    pub fn describe(self) -> &'static str {
        match self {
            TexelAccess::Textures => "texels by texelFetch",
            TexelAccess::Storage => "texels by imageLoad",
        }
    }
}

/// The Vulkan format of images in a format of slots.
pub(super) fn vulkan(format: Format) -> vk::Format {
    match format {
        Format::R8 => vk::Format::R8_UNORM,
        Format::R16 => vk::Format::R16_UNORM,
        Format::R16f => vk::Format::R16_SFLOAT,
        Format::R32f | Format::Floats => vk::Format::R32_SFLOAT,
        Format::Rg16 => vk::Format::R16G16_UNORM,
        Format::Rg16f => vk::Format::R16G16_SFLOAT,
        Format::Rg32f => vk::Format::R32G32_SFLOAT,
        Format::R32u => vk::Format::R32_UINT,
        Format::Rg32u => vk::Format::R32G32_UINT,
        Format::Rgba16f => vk::Format::R16G16B16A16_SFLOAT,
        Format::Rgba32f => vk::Format::R32G32B32A32_SFLOAT,
        Format::Rgba8 => vk::Format::R8G8B8A8_UNORM,
        Format::Bgra8 => vk::Format::B8G8R8A8_UNORM,
    }
}

/// The clear value that fills an image of a format with the content of a poison.
pub(super) fn clear_value(poison: Poison, format: Format) -> vk::ClearColorValue {
    match format {
        Format::R32u | Format::Rg32u => vk::ClearColorValue { uint32: [poison.integer; 4] },
        Format::R8 | Format::R16 | Format::Rg16 | Format::Rgba8 | Format::Bgra8 => {
            vk::ClearColorValue { float32: [poison.normalized; 4] }
        }
        _ => vk::ClearColorValue { float32: [poison.float; 4] },
    }
}

/// Usage flags of a slot's image. An image that no pass writes is a storage image only if texels are read from storage images.
pub(super) fn usage(context: &Context, slot: Slot) -> vk::ImageUsageFlags {
    let read = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
    match slot {
        Slot::Frames | Slot::ScanLut if TexelAccess::for_device(&context.candidate) == TexelAccess::Textures => read,
        _ => read | vk::ImageUsageFlags::STORAGE,
    }
}

fn features(context: &Context, slot: Slot, scene: &Scene) -> vk::FormatFeatureFlags {
    let mut features = vk::FormatFeatureFlags::SAMPLED_IMAGE
        | vk::FormatFeatureFlags::TRANSFER_DST
        | vk::FormatFeatureFlags::TRANSFER_SRC;
    if usage(context, slot).contains(vk::ImageUsageFlags::STORAGE) {
        features |= vk::FormatFeatureFlags::STORAGE_IMAGE;
    }
    if [Slot::of_rays(scene), Slot::of_planes(scene)].contains(&slot) && scene.filters_in_hardware() {
        features |= vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;
    }
    features
}

/// Frames whose slots of stage 1 stay in the caches of a CPU.
const FRAMES_IN_CACHE: u32 = 4;

/// Sets the fields of a scene that depend on the device. `ray.sampling = "auto"` becomes the filter of the device, or packed neighbours with
/// [`TexelAccess::Storage`]. It becomes [`Sampling::Exact`] (eight single texels) if the device cannot filter the volume's format, or if packed
/// neighbours take more time than they save or exceed a limit of the device. The volume gets the format that the device stores best, the picture that
/// of the window, and passes use shared memory on a GPU. On a CPU few frames go through stage 1 at once, so that the slots of stage 1 stay in the
/// caches.
pub fn adapt_scene(context: &Context, texel_access: TexelAccess, mut scene: Scene) -> Scene {
    scene.device.truncates_halves = context.candidate.truncates_halves();
    let filters = filters(context, Slot::Volume.format(&scene));
    let mut scene = scene.sampled(if filters { texel_access.sampling() } else { Sampling::Exact });
    match context.candidate.is_software() {
        true => scene.device.frames_at_once = FRAMES_IN_CACHE,
        false => scene.device.shared_memory = context.candidate.limits.max_compute_shared_memory_size,
    }
    scene.device.window_texels = window_texels(context);
    scene.device.invocations = context.candidate.limits.max_compute_work_group_invocations;
    let format = vulkan(Slot::PackedNeighbours.format(&scene));
    let fits = context.image_limits(format, vk::ImageType::TYPE_3D, usage(context, Slot::PackedNeighbours));
    let fits = fits.is_ok_and(|l| {
        Slot::PackedNeighbours.bytes(&scene) <= l.max_resource_size.min(context.candidate.max_allocation)
    });
    if fits { scene } else { scene.without_quads() }
}

/// The format in which the window takes pictures, if passes can store it.
fn window_texels(context: &Context) -> WindowTexels {
    let wanted = *locked(&context.window_texels);
    let format = match wanted {
        WindowTexels::Rgba8 => return wanted,
        WindowTexels::Bgra8 => vulkan(Format::Bgra8),
        WindowTexels::Deep => vulkan(Format::Rgba16f),
    };
    let needed = vk::FormatFeatureFlags::STORAGE_IMAGE
        | vk::FormatFeatureFlags::SAMPLED_IMAGE
        | vk::FormatFeatureFlags::BLIT_SRC
        | vk::FormatFeatureFlags::TRANSFER_SRC
        | vk::FormatFeatureFlags::TRANSFER_DST;
    let is_stored = context.format_features(format).contains(needed);
    if is_stored && context.writes_without_format(format) { wanted } else { WindowTexels::Rgba8 }
}

/// True if the device can filter images in this format linearly.
pub fn filters(context: &Context, format: Format) -> bool {
    context.format_features(vulkan(format)).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
}

/// Checks that the device can hold the slots of a plan, before anything is allocated.
///
/// # Errors
/// The first slot that exceeds a limit or whose format is not supported.
pub fn check(context: &Context, plan: &Plan, scene: &Scene) -> Result<(), GpuError> {
    let limits = &context.candidate.limits;
    for &slot in &plan.slots {
        let what = || {
            let image = format!("image '{}' ({:?} {:?})", slot.name(), slot.shape(scene), slot.format(scene));
            // What is as large as the recording is named by the recording's own sizes, which a user can change.
            let ([w, h], [columns, rows, slices]) = (scene.frame_size(), scene.volume_size());
            match slot {
                Slot::Frames if scene.probe().is_some() => {
                    format!("the recording's frames of {w} samples and {h} lines: {image}")
                }
                Slot::Frames => format!("the recording's frames of {w} columns and {h} rows: {image}"),
                Slot::Volume => format!("the volume of {columns} columns, {rows} rows and {slices} slices: {image}"),
                _ => image,
            }
        };
        let fits = |needed: u64, allowed: u64| match needed <= allowed {
            true => Ok(()),
            false => Err(GpuError::Limit { what: what(), needed, allowed }),
        };
        let within = |needed: u32, allowed: u32| fits(needed.into(), allowed.into());
        let bytes = slot.bytes(scene);
        // An image is never a buffer: what is uploaded and read back is cut into pieces.
        let allowed = match slot.shape(scene) {
            Shape::Buffer(_) => context.candidate.max_buffer,
            _ => context.candidate.max_allocation,
        };
        fits(bytes, allowed)?;
        match slot.shape(scene) {
            Shape::Buffer(bytes) => {
                within(bytes, limits.max_storage_buffer_range)?;
                continue;
            }
            Shape::Two([w, h]) => within(w.max(h), limits.max_image_dimension2_d)?,
            Shape::Layers([w, h, n]) => {
                within(w.max(h), limits.max_image_dimension2_d)?;
                within(n, limits.max_image_array_layers)?;
            }
            Shape::Three([w, h, d]) => within(w.max(h).max(d), limits.max_image_dimension3_d)?,
        }
        let format = vulkan(slot.format(scene));
        let needed = features(context, slot, scene);
        if !context.format_features(format).contains(needed) {
            return Err(GpuError::Format {
                what: what(),
                format: format!("{format:?}"),
                usage: format!("{:?}", needed & !context.format_features(format)),
            });
        }
        let kind = match slot.shape(scene) {
            Shape::Three(_) => vk::ImageType::TYPE_3D,
            _ => vk::ImageType::TYPE_2D,
        };
        let limits = context.image_limits(format, kind, usage(context, slot))?;
        let ([w, h, parts], most) = (slot.shape(scene).size().map(|n| n as u32), limits.max_extent);
        within(w, most.width)?;
        within(h, most.height)?;
        within(parts, if kind == vk::ImageType::TYPE_3D { most.depth } else { limits.max_array_layers })?;
        fits(bytes, limits.max_resource_size)?;
    }
    Ok(())
}

/// Which uses of one format a device supports.
pub struct FormatSupport {
    pub format: String,
    pub supported: Vec<&'static str>,
    pub unsupported: Vec<&'static str>,
    /// Width and height of the largest sampled image, and the edge of the largest cubic volume, texels; 0 without support.
    pub max_extent: [u32; 3],
}

/// The support of the device for every image format that slots have: for each format, which of the uses that slots make of images it allows.
pub fn format_support(context: &Context) -> Vec<FormatSupport> {
    use Format::*;
    let formats = [R8, R16, R16f, R32f, Rg16, Rg16f, Rg32f, R32u, Rg32u, Rgba16f, Rgba32f, Rgba8, Bgra8];
    let uses = [
        ("sampled", vk::FormatFeatureFlags::SAMPLED_IMAGE),
        ("filtered", vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR),
        ("stored", vk::FormatFeatureFlags::STORAGE_IMAGE),
        ("copied from", vk::FormatFeatureFlags::TRANSFER_SRC),
        ("copied to", vk::FormatFeatureFlags::TRANSFER_DST),
    ];
    let of = |format: Format| {
        let there = context.format_features(vulkan(format));
        let names = |is_there: bool| {
            uses.iter().filter(|(_, needed)| there.contains(*needed) == is_there).map(|(name, _)| *name).collect()
        };
        let edge = |kind| context.image_limits(vulkan(format), kind, vk::ImageUsageFlags::SAMPLED);
        let extent = |kind| edge(kind).map_or(vk::Extent3D::default(), |limits| limits.max_extent);
        let (flat, deep) = (extent(vk::ImageType::TYPE_2D), extent(vk::ImageType::TYPE_3D));
        FormatSupport {
            format: format!("{format:?}"),
            supported: names(true),
            unsupported: names(false),
            max_extent: [flat.width, flat.height, deep.width.min(deep.height).min(deep.depth)],
        }
    };
    formats.into_iter().map(of).collect()
}

/// Fault injection: the device appears unable to filter any format of a volume linearly.
pub fn disable_linear_filter(context: &mut Context) {
    for format in [Format::R8, Format::R16, Format::R16f, Format::R32f].map(vulkan) {
        let there = context.format_features(format);
        context.override_features(format, there & !vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    }
}
