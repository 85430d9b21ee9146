//! The shapes and formats of slots, as they follow from a scene, and the batches of frames.

use super::{Format, Shape};
use crate::probe::StoredType;
use crate::scene::planes::cell;
use crate::scene::{Propagation, Scene, VolumeFormat};

/// Largest number of batches of frames in flight, which is also the number of entries of the staging ring. The frame array has a range of layers for
/// each entry.
pub const BATCHES_IN_FLIGHT: u32 = 4;

/// Most frames that go through stage 1 at once. Submitting a batch of so many costs little more than a single frame.
const MAX_FRAMES: u64 = 16;

/// Largest size in bytes of the samples of a batch, and of the slices between two filters, unless a single frame is larger. A CPU's caches hold this
/// much; a GPU works on it several times longer than the host needs to submit it.
pub fn batch_bytes(scene: &Scene) -> u64 {
    if scene.is_for_cpu() { 4 << 20 } else { 16 << 20 }
}

/// Largest number of consecutive frames that go through stage 1 (preprocess) together, each pass in one dispatch; at least 1.
pub fn frames_per_batch(scene: &Scene) -> u32 {
    let bytes =
        |[width, height]: [u32; 2], format: Format| u64::from(width) * u64::from(height) * format.texel_bytes() as u64;
    let largest = bytes(scene.frame_size(), frame_format(scene)).max(bytes(scene.grid.size, Format::R32f));
    let largest = if scene.conditions() { largest.max(bytes(scene.line_lattice(), Format::R32f)) } else { largest };
    let most = MAX_FRAMES.min(scene.slices().into()).min(scene.device.frames_at_once.max(1).into());
    (batch_bytes(scene) / largest).clamp(1, most) as u32
}

pub(super) fn frame_layers(scene: &Scene) -> Shape {
    let [width, height] = scene.frame_size();
    Shape::Layers([width, height, BATCHES_IN_FLIGHT * frames_per_batch(scene)])
}

/// A frame array of `layers` layers has an equal range of layers for each entry of the staging ring ([`BATCHES_IN_FLIGHT`]). Returns the end
/// (exclusive) of the range that holds `layer`.
pub fn ring_entry_end(layers: u32, layer: u32) -> u32 {
    let entry = (layers / BATCHES_IN_FLIGHT).max(1);
    layer - layer % entry + entry
}

/// A layer for each frame of a batch.
pub(super) fn batch([width, height]: [u32; 2], scene: &Scene) -> Shape {
    Shape::Layers([width, height, frames_per_batch(scene)])
}

pub(super) fn slices(scene: &Scene) -> Shape {
    batch(scene.grid.size, scene)
}

pub(super) fn frame_format(scene: &Scene) -> Format {
    match scene.input.stored {
        StoredType::U8 => Format::R8,
        StoredType::U16 => Format::R16,
        StoredType::F32 => Format::R32f,
    }
}

pub(super) fn one_slice(scene: &Scene) -> Shape {
    Shape::Two(scene.grid.size)
}

/// The part of the volume that is stored.
pub(super) fn volume(scene: &Scene) -> Shape {
    let stored = scene.stored_bounds();
    Shape::Three(std::array::from_fn(|a| stored.high[a] - stored.low[a]))
}

pub(super) fn volume_format(scene: &Scene) -> Format {
    match scene.volume_format() {
        VolumeFormat::R8 => Format::R8,
        VolumeFormat::R16 => Format::R16,
        VolumeFormat::Auto | VolumeFormat::R16f => Format::R16f,
        VolumeFormat::R32f => Format::R32f,
    }
}

pub(super) fn per_brick(scene: &Scene) -> Shape {
    Shape::Three(scene.bricks().count)
}

/// Cells of a level of the light volume's pyramid; level 0 is the light volume itself.
pub(super) fn light_level(scene: &Scene, level: u32) -> Shape {
    Shape::Three(scene.light_lattice().count.map(|n| n.div_ceil(1 << level)))
}

/// One layer of cells across the axis that the light comes along; of the back light, in cells of twice the edge.
pub(super) fn light_layer(scene: &Scene, is_back: bool) -> Shape {
    let light = &scene.settings.light;
    let volume = light.volume.unwrap_or_default();
    let direction = if is_back { volume.back_direction } else { light.direction };
    let axis = Propagation::new(scene.light_direction(direction)).axis;
    let Shape::Three(count) = light_level(scene, u32::from(is_back)) else { return Shape::Two([1; 2]) };
    Shape::Two(if axis == 0 { [count[1], count[2]] } else { [count[0], if axis == 1 { count[2] } else { count[1] }] })
}

pub(super) fn entries(scene: &Scene) -> Shape {
    Shape::Buffer(4 * scene.settings.ray.entries)
}

pub(super) fn per_ray(scene: &Scene) -> Shape {
    Shape::Two(scene.ray_size())
}

pub(super) fn per_pixel_of_rendering(scene: &Scene) -> Shape {
    Shape::Two(scene.rendering_size())
}

/// Two vectors for each column of the last tile.
pub(super) fn curve_columns(scene: &Scene) -> Shape {
    let ([columns, _], [width, _]) = (scene.tile_grid(), scene.picture_size());
    Shape::Buffer(32 * (width - cell(width, columns - 1, columns)))
}

pub(super) fn per_pixel(scene: &Scene) -> Shape {
    Shape::Two(scene.picture_size())
}

/// A voxel where there are no labels.
pub(super) fn per_label(scene: &Scene) -> Shape {
    Shape::Three(scene.labels().map_or([1; 3], |labels| labels.size.map(|n| n as u32)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A batch that is read must have its layers in its view, and those of the batches that are written beside it must not be there.
    #[test]
    fn a_view_of_a_batch_ends_with_its_entry_of_the_ring() {
        for batch in 1..=MAX_FRAMES as u32 {
            let layers = BATCHES_IN_FLIGHT * batch;
            for entry in 0..BATCHES_IN_FLIGHT {
                let first = entry * batch;
                for layer in first..first + batch {
                    assert_eq!(ring_entry_end(layers, layer), first + batch, "layer {layer} of {layers}");
                }
            }
        }
    }
}
