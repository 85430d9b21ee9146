//! The smallest and the largest value of every tile of a slice: made anew for the slices that a new frame is near, never for
//! the whole volume while frames arrive one by one.

use crate::passes::*;
use crate::scene::TILE;

pub const PASS: Pass = Pass {
    name: "tile_ranges",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    shader: |_, _| "skip/tile_ranges.plain",
    needed: super::asked,
    // A slice changes with the frames that are smoothed into it.
    reads: |s, _| vec![Bind { part: Part::Around(s.smoothing_radius()[2]), ..whole("volume", Slot::Volume) }],
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("tile_ranges", Slot::TileRanges) }],
    extent: |s, t| {
        let [width, height, _] = s.tile_counts();
        [width, height, t.slices]
    },
    repeat: once,
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |_, _| vec![("TILE", TILE as i32)],
    tolerance: Tolerance { absolute: 2e-5, relative: 0.0, outliers: 0.0, why: "one of 65535 steps, up or down" },
    reference: |_, args, reads, writes| {
        let volume = reads.get("volume");
        let target = writes.get_mut("tile_ranges");
        let edge = TILE as usize;
        for z in args.slice as usize..(args.slice + args.slices) as usize {
            for y in 0..target.size[1] {
                for x in 0..target.size[0] {
                    let (mut low, mut high) = (1.0f64, 0.0f64);
                    for row in edge * y..(edge * (y + 1)).min(volume.size[1]) {
                        for column in edge * x..(edge * (x + 1)).min(volume.size[0]) {
                            let value = volume.one(column, row, z);
                            (low, high) = (low.min(value), high.max(value));
                        }
                    }
                    let steps = [(low * 65535.0).floor(), (high * 65535.0).ceil()];
                    target.set([x, y, z], &steps.map(|n| n / 65535.0));
                }
            }
        }
    },
};
