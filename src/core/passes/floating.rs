//! Drops parts that float: specks in fluid, which touch nothing else that is drawn. The CPU finds them when a volume is complete, by connected
//! components of the texels above the level of which something is drawn, and a pass lowers theirs below it. Two texels that one sample can touch
//! belong to one part, so that no sample near a part that stays changes.

use super::components::Lattice;
use super::pass::*;
use crate::scene::Scene;

/// How far below the level texels are put: more than the rounding of any format of a volume, the step of 8 bits.
const MARGIN: f64 = 1.0 / 255.0;

pub const DROP: Pass = Pass {
    name: "drop_floating",
    shader: |_, _| "preprocess/drop_floating",
    needed: |s| match s.drops_floating() {
        true => Ok("small parts that float are not drawn"),
        false => Err("not asked for, or nothing is drawn that could float"),
    },
    // A part may lie in all slices.
    reads: |s, _| {
        let all = Bind { part: Part::Around(s.slices()), ..whole("source", Slot::WholeVolume) };
        vec![all, whole("floating", Slot::Floating)]
    },
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("target", Slot::Volume) }],
    params: |s, t| Params::default().f32("most", lowered(s)).i32("slice", t.slice),
    tolerance: Tolerance::absolute(5e-4).because("a copy, but for the level; R16F stores 1 to 4.9e-4"),
    reference: |scene, args, reads, writes| {
        let (source, floating) = (reads.get("source"), reads.get("floating"));
        writes.get_mut("target").fill_slices(args.written(), |[x, y, z]| {
            let (value, is_dropped) = (source.one(x, y, z), floating.one(x, y, z) > 0.5);
            [if is_dropped { value.min(lowered(scene)) } else { value }]
        });
    },
    ..Pass::AFTER_SLICES
};

pub(super) const SEARCH: Search = Search {
    name: "floating",
    within: Slot::WholeVolume,
    find: |scene, bytes| Found { texels: find(scene, bytes), unveiled: None },
    reference,
};

fn level(scene: &Scene) -> f64 {
    scene.floating_level().unwrap_or(0.0)
}

/// What texels that float have at most.
fn lowered(scene: &Scene) -> f64 {
    (level(scene) - MARGIN).max(0.0)
}

/// Finds the texels of the parts that the setting `floating` drops and returns the content of [`Slot::Floating`]: one byte a texel, 255 in such
/// parts, otherwise 0. `bytes`: all texels of the volume in the format of [`Slot::WholeVolume`].
pub fn find(scene: &Scene, bytes: &[u8]) -> Vec<u8> {
    /// Texels that are decoded at a time.
    const CHUNK: usize = 1 << 16;
    let (format, level) = (Slot::WholeVolume.format(scene), level(scene));
    let values = |chunk: &[u8]| Texels::decode([chunk.len() / format.channel_bytes(), 1, 1], format, chunk).values;
    let is_above = |value: f64| value > level;
    let set: Vec<bool> = bytes.chunks(CHUNK * format.channel_bytes()).flat_map(values).map(is_above).collect();
    let lattice = Lattice {
        size: scene.volume_size().map(|n| n as usize),
        slices: scene.part_reach(),
        sizes: &scene.texel_sizes(),
    };
    let floats = lattice.floating(|n| set.get(n).copied().unwrap_or(false), scene.least_part());
    floats.into_iter().map(|floats| if floats { 255 } else { 0 }).collect()
}

/// The reference of [`find`]: the texels of the parts that the setting `floating` drops, in f64 by flood fill from a texel of each part. 1 in such
/// parts, otherwise 0. `volume`: the whole volume.
pub fn reference(scene: &Scene, volume: &Texels) -> Texels {
    let [columns, rows, slices] = volume.size;
    let (level, reach, sizes) = (level(scene), scene.part_reach() as i64, scene.texel_sizes());
    let is_set = |[x, y, z]: [usize; 3]| volume.one(x, y, z) > level;
    let mut floating = Texels::from_fn(volume.size, 1, |_, _| 0.0);
    let mut seen = vec![false; columns * rows * slices];
    let index = |[x, y, z]: [usize; 3]| (z * rows + y) * columns + x;
    for start in cells(volume.size) {
        if seen[index(start)] || !is_set(start) {
            continue;
        }
        seen[index(start)] = true;
        let (mut part, mut next) = (vec![start], 0);
        while let Some([x, y, z]) = part.get(next).copied() {
            next += 1;
            let around = |at: usize, by: i64, count: usize| {
                (at as i64 - by).max(0) as usize..(at as i64 + by + 1).min(count as i64) as usize
            };
            for at in around(z, reach, slices)
                .flat_map(|z| around(y, 1, rows).flat_map(move |y| around(x, 1, columns).map(move |x| [x, y, z])))
            {
                if is_set(at) && !std::mem::replace(&mut seen[index(at)], true) {
                    part.push(at);
                }
            }
        }
        let size = part.iter().fold(0u64, |sum, [_, y, z]| sum.saturating_add(sizes[z * rows + y]));
        if size < scene.least_part() {
            part.iter().for_each(|at| floating.set(*at, &[1.0]));
        }
    }
    floating
}
