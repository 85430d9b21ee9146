//! A slice of a Cartesian volume, scaled to 0..1.

use super::scan_convert::{load_params, normalisation};
use crate::passes::pass::*;
use crate::passes::slots::Format;
use crate::scene::Scene;
use crate::source::StoredType;

pub const PASS: Pass = Pass {
    name: "load_slice",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::Filter(Filter { copies: stores_what_it_reads, ..Filter::of(Chain::Slices) }),
    shader: |_, t| {
        if t.writes_volume() { "preprocess/load_slice.slice" } else { "preprocess/load_slice.plane" }
    },
    needed: |s| match s.probe() {
        None => Ok("the volume is Cartesian already: its slices are only scaled"),
        Some(_) => Err("frames are polar"),
    },
    reads: |_, _| vec![layer("frames", Slot::Frames)],
    writes: writes_target,
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

/// True if the volume stores the same values as frames hold. Floats may be beyond 0..1, so they are never copied.
fn stores_what_it_reads(scene: &Scene) -> bool {
    let format = Slot::Volume.format(scene);
    match scene.input.stored {
        StoredType::U8 => format == Format::R8 && scene.input.range == [0.0, 255.0],
        StoredType::U16 => format == Format::R16 && scene.input.range == [0.0, 65535.0],
        StoredType::F32 => false,
    }
}
