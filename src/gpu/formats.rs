//! Our formats in Vulkan's words, and whether a device can use them as a scene needs.

use super::faults::Poison;
use super::{Context, Fetch, GpuError};
use crate::passes::Slot;
use crate::passes::slots::{Format, Shape};
use crate::plan::Plan;
use crate::scene::{Sampling, Scene};
use ash::vk;

pub fn vulkan(format: Format) -> vk::Format {
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
    }
}

/// A poison as texels of a format.
pub fn held(poison: Poison, format: Format) -> vk::ClearColorValue {
    match format {
        Format::R32u | Format::Rg32u => vk::ClearColorValue { uint32: [poison.whole; 4] },
        Format::R8 | Format::R16 | Format::Rg16 | Format::Rgba8 => vk::ClearColorValue { float32: [poison.share; 4] },
        _ => vk::ClearColorValue { float32: [poison.float; 4] },
    }
}

/// What an image of this slot is used for. What no pass writes is a storage image only where those are read by preference.
pub fn usage(context: &Context, slot: Slot) -> vk::ImageUsageFlags {
    let read = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
    match slot {
        Slot::Frames | Slot::ScanLut if Fetch::of(&context.candidate) == Fetch::Textures => read,
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
    if slot == Slot::Volume && scene.filters_in_hardware() {
        features |= vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;
    }
    features
}

/// The scene with its samples taken in the way that is fastest here: by eight texels where those are loaded, and where the device
/// cannot filter the volume's format at all.
pub fn suited(context: &Context, fetch: Fetch, scene: Scene) -> Scene {
    let there = context.format_features(vulkan(Slot::Volume.format(&scene)));
    let filters = there.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    let scene = scene.sampled(if filters { fetch.sampling() } else { Sampling::Exact });
    let format = vulkan(Slot::PackedNeighbours.format(&scene));
    let fits = context.image_limits(format, vk::ImageType::TYPE_3D, usage(context, Slot::PackedNeighbours));
    let fits = fits
        .is_ok_and(|l| Slot::PackedNeighbours.bytes(&scene) <= l.max_resource_size.min(context.candidate.max_bytes));
    if fits { scene } else { scene.without_quads() }
}

/// Refuses a plan whose slots the device cannot hold, before anything is allocated.
pub fn check(context: &Context, plan: &Plan, scene: &Scene) -> Result<(), GpuError> {
    let limits = &context.limits;
    for &slot in &plan.slots {
        let what = || format!("image '{}' ({:?} {:?})", slot.name(), slot.shape(scene), slot.format(scene));
        let within = |needed: u32, allowed: u32| match needed <= allowed {
            true => Ok(()),
            false => Err(GpuError::Limit { what: what(), needed: needed.into(), allowed: allowed.into() }),
        };
        let bytes = slot.bytes(scene);
        if bytes > context.candidate.max_bytes {
            return Err(GpuError::Limit { what: what(), needed: bytes, allowed: context.candidate.max_bytes });
        }
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
        let allowed = context.image_limits(format, kind, usage(context, slot))?.max_resource_size;
        if bytes > allowed {
            return Err(GpuError::Limit { what: what(), needed: bytes, allowed });
        }
    }
    Ok(())
}

/// What a device does with a format.
pub struct Abilities {
    pub format: String,
    pub can: Vec<&'static str>,
    pub cannot: Vec<&'static str>,
    /// Columns and rows of the largest sampled image, and texels along each edge of the largest volume; 0 where there is none.
    pub largest: [u32; 3],
}

/// Every format that slots have, with everything that slots are used for.
pub fn abilities(context: &Context) -> Vec<Abilities> {
    let formats = [
        Format::R8,
        Format::R16,
        Format::R16f,
        Format::R32f,
        Format::Rg16,
        Format::Rg16f,
        Format::Rg32f,
        Format::R32u,
        Format::Rg32u,
        Format::Rgba16f,
        Format::Rgba32f,
        Format::Rgba8,
    ];
    let uses = [
        ("sampled", vk::FormatFeatureFlags::SAMPLED_IMAGE),
        ("filtered", vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR),
        ("stored", vk::FormatFeatureFlags::STORAGE_IMAGE),
        ("copied from", vk::FormatFeatureFlags::TRANSFER_SRC),
        ("copied to", vk::FormatFeatureFlags::TRANSFER_DST),
    ];
    let of = |format: Format| {
        let there = context.format_features(vulkan(format));
        let (can, cannot): (Vec<_>, Vec<_>) = uses.iter().partition(|(_, needed)| there.contains(*needed));
        let edge = |kind| context.image_limits(vulkan(format), kind, vk::ImageUsageFlags::SAMPLED);
        let extent = |kind| edge(kind).map_or(vk::Extent3D::default(), |limits| limits.max_extent);
        let (flat, deep) = (extent(vk::ImageType::TYPE_2D), extent(vk::ImageType::TYPE_3D));
        let names = |of: Vec<&(&'static str, vk::FormatFeatureFlags)>| of.iter().map(|(name, _)| *name).collect();
        Abilities {
            format: format!("{format:?}"),
            can: names(can),
            cannot: names(cannot),
            largest: [flat.width, flat.height, deep.width.min(deep.height).min(deep.depth)],
        }
    };
    formats.into_iter().map(of).collect()
}

/// As if the device could filter no format of a volume.
pub fn deny_filters(context: &mut Context) {
    for format in [Format::R8, Format::R16, Format::R16f, Format::R32f].map(vulkan) {
        let there = context.format_features(format);
        context.take_features(format, there & !vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    }
}
