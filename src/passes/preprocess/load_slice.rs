//! A slice of a Cartesian volume: scaled to 0..1 and put into its place.

use super::scan_convert::{load_params, normalisation};
use crate::passes::chain::{copied, slice_link, writes_volume};
use crate::passes::*;

const NAME: &str = "load_slice";

pub const PASS: Pass = Pass {
    name: NAME,
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    shader: |s, t| {
        if writes_volume(s, NAME, t) { "preprocess/load_slice.slice" } else { "preprocess/load_slice.plane" }
    },
    needed: |s| match s.probe() {
        None if copied(s).is_some() => Err("a frame is a slice as the volume stores it: it is copied there"),
        None => Ok("the volume is Cartesian already: its slices are only scaled"),
        Some(_) => Err("frames are polar"),
    },
    reads: |_, _| vec![layer("frames", Slot::Frames)],
    writes: |s, t| vec![slice("target", slice_link(s, NAME, t).1)],
    extent: slice_extent,
    repeat: once,
    params: load_params,
    constants: no_constants,
    tolerance: Tolerance {
        absolute: 5e-4,
        relative: 0.0,
        outliers: 0.0,
        why: "one multiplication and addition in f32; R16F stores 1 to 4.9e-4",
    },
    reference: |scene, args, reads, writes| {
        let frames = reads.get("frames");
        let target = writes.get_mut("target");
        let z = if target.size[2] > 1 { args.slice as usize } else { 0 };
        let (gain, offset) = normalisation(scene);
        for y in 0..frames.size[1] {
            for x in 0..frames.size[0] {
                let value = frames.one(x, y, 0) * gain + offset;
                target.set([x, y, z], &[value.clamp(0.0, 1.0)]);
            }
        }
    },
};
