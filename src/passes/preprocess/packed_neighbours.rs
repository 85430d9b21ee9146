//! Every texel of a slice together with its neighbours one column and one row on. An interpolated sample then takes two loads, one per
//! slice. This needs four times the volume's memory, and one more pass over every new slice.

use crate::passes::pass::*;
use crate::scene::{Scene, VolumeFormat};

pub const PASS: Pass = Pass {
    name: "packed_neighbours",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    link: Link::AfterSlices,
    shader: |_, _| "preprocess/packed_neighbours.plain",
    needed: |s| match s.packs() {
        true => Ok("rays load the four neighbours of a slice at once"),
        false => Err("no ray is cast, or samples are taken in another way"),
    },
    // A slice changes with the frames that are smoothed into it.
    reads: |s, _| vec![Bind { part: Part::Around(s.smoothing_radius()[2]), ..whole("volume", Slot::Volume) }],
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("packed_neighbours", Slot::PackedNeighbours) }],
    extent: |s, t| in_runs([s.grid.size[0], s.grid.size[1], t.slices], 0),
    repeat: once,
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |s, _| vec![("RUN", RUN as i32), ("STORED", stored(s))],
    tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "copies of what is stored" },
    reference: |scene, args, reads, writes| {
        let volume = reads.get("volume");
        let target = writes.get_mut("packed_neighbours");
        let [width, height, _] = target.size;
        for z in args.slice as usize..(args.slice + args.slices) as usize {
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
                let of = [(x, y), (right, y), (x, below), (right, below)].map(|(x, y)| volume.one(x, y, z));
                let packed = Texels { size: [4, 1, 1], channels: 1, values: of.to_vec() };
                let bytes = packed.encode(Slot::Volume.format(scene));
                let words = bytes.chunks_exact(4).map(|b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
                target.set([x, y, z], &words.collect::<Vec<_>>());
            }
        }
    },
};

/// STORED of packed_neighbours.comp.
fn stored(scene: &Scene) -> i32 {
    match scene.settings.slices.format {
        VolumeFormat::R8 => 0,
        VolumeFormat::R16 => 1,
        VolumeFormat::R16f | VolumeFormat::R32f => 2,
    }
}

/// SAMPLING of ray.glsl where rays load packed neighbours.
pub(in crate::passes) fn sampling(scene: &Scene) -> i32 {
    2 + stored(scene)
}
