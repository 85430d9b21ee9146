//! The smallest and the largest value of every tile of a slice, and those that samples in each brick may have, from the tiles that
//! they may touch. Only tiles of the slices that a new frame changes, and bricks that depend on those slices, are updated.

use crate::passes::lookup_tables::brick_reaches;
use crate::passes::pass::*;
use crate::scene::{Side, TILE};

/// Of tiles.
pub const TILES: Pass = Pass {
    name: "tile_ranges",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    link: Link::None,
    shader: |_, _| "empty_space/tile_ranges.plain",
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

/// Of bricks.
pub const BRICKS: Pass = Pass {
    name: "brick_ranges",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    link: Link::None,
    shader: |_, _| "empty_space/brick_ranges.plain",
    needed: super::asked,
    reads: |s, _| {
        let part = Part::Around(s.smoothing_radius()[2]);
        vec![whole("brick_table", Slot::BrickTable), Bind { part, ..whole("tile_ranges", Slot::TileRanges) }]
    },
    writes: |_, _| vec![whole("brick_ranges", Slot::BrickRanges)],
    extent: |s, _| s.bricks().count,
    repeat: once,
    params: |_, t| Params::default().i32("slice", t.slice).i32("slices", t.slices),
    constants: no_constants,
    tolerance: Tolerance {
        absolute: 0.0,
        relative: 0.0,
        outliers: 0.0,
        why: "the smallest and the largest of values that are stored alike",
    },
    reference: |scene, args, reads, writes| {
        let tiles = reads.get("tile_ranges");
        let target = writes.get_mut("brick_ranges");
        let bricks = scene.bricks();
        for (n, reach) in brick_reaches(scene, &bricks).into_iter().enumerate() {
            let [first, last] = reach.slices;
            let outside = reach.side == Side::Outside;
            if !outside && (last < args.slice || first >= args.slice + args.slices) {
                continue;
            }
            let (mut low, mut high) = (1.0f64, 0.0f64);
            let [columns, rows] = reach.tiles;
            let within = |[from, to]: [u32; 2]| if outside { 0..0 } else { from as usize..to as usize + 1 };
            for z in within(reach.slices) {
                for y in within(rows) {
                    for x in within(columns) {
                        let at = 2 * ((z * tiles.size[1] + y) * tiles.size[0] + x);
                        (low, high) = (low.min(tiles.values[at]), high.max(tiles.values[at + 1]));
                    }
                }
            }
            let [width, height, _] = bricks.count.map(|n| n as usize);
            target.set([n % width, n / width % height, n / (width * height)], &[low, high]);
        }
    },
};
