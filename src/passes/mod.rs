//! The passes: each declared in one file with its parameters and its f64 reference, and all of them listed, in the order in
//! which they run, in [`PASSES`]. Everything else (bindings, barriers, time stamps, labels, tests) follows from these.

pub mod chain;
pub mod fault_injection;
mod format;
pub mod interface_check;
pub mod lookup_tables;
pub mod measure;
mod params;
pub mod slots;
pub mod texels;

pub mod preprocess {
    pub mod condition;
    pub mod load_slice;
    pub mod packed_neighbours;
    pub mod scan_convert;
}
pub mod filter {
    pub mod aos;
    pub mod bilateral;
    pub mod enhanced_sigma;
    pub mod estimator;
    pub mod gaussian;
    pub mod growth;
    pub mod median;
    pub mod perona_malik;
    pub mod sigma;
}
pub mod raycast {
    pub mod composite;
    pub mod cube;
    mod detector;
    mod noise;
    pub mod planes;
    pub mod projection;
    pub mod ray;
    pub mod surface;
    pub mod volume;
}
pub mod empty_space;
pub mod shade;
pub mod postprocess {
    pub mod assemble;
    pub mod tone;
}

pub use params::{Params, Value, ray_params};
pub use slots::Slot;
pub use texels::{Arrays, Texels};

use crate::scene::Scene;

/// A distance that hit nothing: the largest finite float, so that no shader has to keep infinities.
pub const MISS: f64 = f32::MAX as f64;

pub fn is_hit(distance: f64) -> bool {
    distance < 3e38
}

/// All passes in the order in which they run.
pub const PASSES: &[Pass] = &[
    preprocess::condition::PASS,
    preprocess::load_slice::PASS,
    preprocess::scan_convert::PASS,
    filter::median::SLICE,
    filter::estimator::SLICE,
    filter::sigma::SLICE,
    filter::growth::SLICE,
    filter::enhanced_sigma::SLICE,
    filter::perona_malik::SLICE,
    filter::aos::SLICE,
    filter::gaussian::LATERAL,
    filter::gaussian::DEPTH,
    filter::gaussian::ELEVATION,
    preprocess::packed_neighbours::PASS,
    empty_space::tile_ranges::PASS,
    empty_space::brick_ranges::PASS,
    empty_space::classify::SURFACE,
    empty_space::distance::SURFACE,
    raycast::surface::PASS,
    empty_space::classify::VOLUME,
    empty_space::distance::VOLUME,
    raycast::volume::PASS,
    raycast::projection::PASS,
    raycast::planes::PASS,
    raycast::planes::TONED,
    raycast::cube::PASS,
    filter::median::DISTANCE,
    filter::bilateral::DISTANCE,
    filter::sigma::DISTANCE,
    filter::enhanced_sigma::DISTANCE,
    filter::perona_malik::DISTANCE,
    shade::shadow::PASS,
    shade::occlusion::PASS,
    shade::light::PASS,
    postprocess::assemble::PASS,
    filter::sigma::PICTURE,
    filter::enhanced_sigma::PICTURE,
    filter::perona_malik::PICTURE,
    filter::aos::PICTURE,
    postprocess::tone::PASS,
];

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    Preprocess,
    Raycast,
    Shade,
    Postprocess,
}

impl Stage {
    pub fn name(self) -> &'static str {
        match self {
            Stage::Preprocess => "preprocess",
            Stage::Raycast => "raycast",
            Stage::Shade => "shade",
            Stage::Postprocess => "postprocess",
        }
    }
}

/// What makes a pass run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frequency {
    /// Each frame that arrives.
    Frame,
    /// A volume whose frames have all arrived.
    Volume,
    /// Each picture.
    Picture,
}

/// The numbers that differ between two dispatches of the same pass and scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DispatchArgs {
    /// Layer of the frame array that holds the frame.
    pub layer: u32,
    /// Slice that the frame becomes; of a pass over the volume, the first that it makes anew.
    pub slice: u32,
    /// Slices that a pass over the volume makes anew.
    pub slices: u32,
    /// 0.. of a pass that repeats.
    pub iteration: u32,
    /// Which of the volume images that take turns.
    pub image: u32,
}

/// The part of a slot that one dispatch touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Whole,
    /// The turn's slice of a 3D texture.
    Slice,
    /// The turn's layer of the frame array.
    Layer,
    /// The turn's slices of a 3D texture, and that many more on either side.
    Around(u32),
}

/// A slot under the name that the shader gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bind {
    pub name: &'static str,
    pub slot: Slot,
    pub part: Part,
    /// Samples are taken of it through the device's linear filter; otherwise only texels are fetched.
    pub filtered: bool,
}

pub fn whole(name: &'static str, slot: Slot) -> Bind {
    Bind { name, slot, part: Part::Whole, filtered: false }
}

/// One slice of a 3D texture, or all of a plane.
pub fn slice(name: &'static str, slot: Slot) -> Bind {
    let part = if matches!(slot, Slot::Volume | Slot::SharpVolume) { Part::Slice } else { Part::Whole };
    Bind { part, ..whole(name, slot) }
}

pub fn layer(name: &'static str, slot: Slot) -> Bind {
    Bind { part: Part::Layer, ..whole(name, slot) }
}

/// Whether a scene needs a pass, and why (or why not), for `--explain`.
pub type Need = Result<&'static str, &'static str>;

/// Largest error against the reference on the test inputs.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Absolute, in the units of the output.
    pub absolute: f64,
    /// Relative to the expected value; the larger of the two holds.
    pub relative: f64,
    /// Share of texels that may be further off, where a branch flips.
    pub outliers: f64,
    pub why: &'static str,
}

/// One compute dispatch: the only place where it is described.
pub struct Pass {
    /// Debug label, time stamp and test case; unique.
    pub name: &'static str,
    pub stage: Stage,
    pub frequency: Frequency,
    /// Path below glsl/ and variant.
    pub shader: fn(&Scene, &DispatchArgs) -> &'static str,
    pub needed: fn(&Scene) -> Need,
    pub reads: fn(&Scene, &DispatchArgs) -> Vec<Bind>,
    pub writes: fn(&Scene, &DispatchArgs) -> Vec<Bind>,
    /// Invocations, not workgroups.
    pub extent: fn(&Scene, &DispatchArgs) -> [u32; 3],
    /// Dispatches in a row, with [`DispatchArgs::iteration`] counting.
    pub repeat: fn(&Scene) -> u32,
    /// Numbers: they move while a picture lives.
    pub params: fn(&Scene, &DispatchArgs) -> Params,
    /// Structure: a change of it is another pipeline.
    pub constants: fn(&Scene, &DispatchArgs) -> Vec<(&'static str, i32)>,
    pub tolerance: Tolerance,
    /// The same from the formula, in f64. Reads arrays by the shader's names; texels it leaves NaN stay untouched.
    pub reference: fn(&Scene, &DispatchArgs, &Arrays, &mut Arrays),
}

impl Pass {
    pub fn is_needed(&self, scene: &Scene) -> bool {
        (self.needed)(scene).is_ok()
    }

    /// Invocations of a dispatch: of a slice only what can be seen.
    pub fn invocations(&self, scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
        let extent = (self.extent)(scene, args);
        let Some(seen) = chain::rectangle(scene, self.name, args) else { return extent };
        // Some make a run of neighbours each.
        let run = |axis: usize| if extent[axis] < scene.grid.size[axis] { RUN } else { 1 };
        [seen.size[0].div_ceil(run(0)), seen.size[1].div_ceil(run(1)), extent[2]]
    }

    /// Numbers of a dispatch: of a slice, with the texel that its first invocation makes.
    pub fn numbers(&self, scene: &Scene, args: &DispatchArgs) -> Params {
        let params = (self.params)(scene, args);
        match chain::rectangle(scene, self.name, args) {
            Some(r) => params.i32("first_column", r.first[0]).i32("first_row", r.first[1]),
            None => params,
        }
    }

    /// What a dispatch leaves: the reference, and around what it makes of a slice what was there.
    pub fn expected(&self, scene: &Scene, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
        let before = writes.clone();
        (self.reference)(scene, args, reads, writes);
        let Some(r) = chain::rectangle(scene, self.name, args) else { return };
        for (name, kept) in before.iter() {
            let target = writes.get_mut(name);
            for (x, y) in (0..kept.size[1]).flat_map(|y| (0..kept.size[0]).map(move |x| (x, y))) {
                let made = [x, y]
                    .iter()
                    .zip(r.first)
                    .zip(r.size)
                    .all(|((at, first), size)| (first as usize..(first + size) as usize).contains(at));
                (0..kept.size[2]).filter(|_| !made).for_each(|z| target.set([x, y, z], kept.get([x, y, z])));
            }
        }
    }
}

/// Time of one pass over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    pub name: &'static str,
    pub runs: u32,
    /// ns, all runs together.
    pub total: f64,
}

/// Something that took time, on the clock of the run: ns since it began.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    pub name: &'static str,
    pub on_device: bool,
    pub begin: f64,
    pub end: f64,
    /// Shader invocations that the device counted, where it does.
    pub invocations: Option<u64>,
}

/// The pass of that name.
pub fn by_name(name: &str) -> Option<&'static Pass> {
    PASSES.iter().find(|p| p.name == name)
}

pub fn once(_: &Scene) -> u32 {
    1
}

pub fn no_constants(_: &Scene, _: &DispatchArgs) -> Vec<(&'static str, i32)> {
    Vec::new()
}

pub fn slice_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.grid.size[0], scene.grid.size[1], 1]
}

pub fn picture_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.picture_size()[0], scene.picture_size()[1], 1]
}

/// Of stages 2 and 3.
pub fn ray_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.ray_size()[0], scene.ray_size()[1], 1]
}

/// Neighbours that one invocation of some filters makes, because their windows share most texels: RUN of glsl/filter.
pub const RUN: u32 = 4;

/// Invocations that make so many texels in runs along an axis.
pub fn in_runs(mut texels: [u32; 3], axis: usize) -> [u32; 3] {
    texels[axis] = texels[axis].div_ceil(RUN);
    texels
}
