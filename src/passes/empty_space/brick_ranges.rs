//! The smallest and the largest value that samples within each brick may have, from the tiles that they may look at. Only
//! bricks that look at a slice made anew are made anew.

use crate::passes::*;
use crate::scene::Side;

pub const PASS: Pass = Pass {
    name: "brick_ranges",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    shader: |_, _| "skip/brick_ranges.plain",
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
        for (n, reach) in super::reaches(scene, &bricks).into_iter().enumerate() {
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
