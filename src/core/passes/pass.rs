//! What a pass declares: one compute dispatch, its slots, numbers and reference. The files of the passes import this module
//! and no list of passes; what follows from a pass's place in [`PASSES`](super::PASSES) is in [`chain`](super::chain).

pub(super) use super::slots::composited_beside_surface;
pub use super::slots::{Found, Search, Slot, rendered};
pub use super::texels::{Arrays, Texels};
use crate::scene::Scene;
use glam::DVec3;
use std::ops::Deref;

/// A distance that hit nothing: the largest finite float, so that no shader has to keep infinities.
pub const MISS: f64 = f32::MAX as f64;

pub fn is_hit(distance: f64) -> bool {
    distance < 3e38
}

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

/// How often a pass runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frequency {
    /// For each frame that arrives.
    Frame,
    /// For a volume whose frames have all arrived.
    Volume,
    /// For each picture.
    Picture,
}

/// The numbers that differ between two dispatches of the same pass and scene. By default a pass over frames gets one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DispatchArgs {
    /// Layer of the frame array that holds the first frame.
    pub layer: u32,
    /// The first slice that it writes, of frames the one that the first frame becomes.
    pub slice: u32,
    /// Slices that it writes: of a pass over frames, the number of frames.
    pub slices: u32,
    /// 0.. of a pass that repeats.
    pub iteration: u32,
    /// Which copy of the multi-buffered slots it uses.
    pub image: u32,
}

impl Default for DispatchArgs {
    fn default() -> DispatchArgs {
        DispatchArgs { layer: 0, slice: 0, slices: 1, iteration: 0, image: 0 }
    }
}

/// One dispatch as its pass sees it: the numbers, and the slots of the filter chain that the pass is a link of.
pub struct Dispatch<'a> {
    args: &'a DispatchArgs,
    slots: Option<(Slot, Slot)>,
}

impl<'a> Dispatch<'a> {
    /// `slots`: what the link reads and writes.
    pub(super) fn new(args: &'a DispatchArgs, slots: Option<(Slot, Slot)>) -> Dispatch<'a> {
        Dispatch { args, slots }
    }

    /// The slot that this link of the chain reads.
    ///
    /// # Panics
    /// When the pass declares [`Link::None`].
    pub fn source(&self) -> Slot {
        self.link().0
    }

    /// The slot that this link of the chain writes.
    ///
    /// # Panics
    /// When the pass declares [`Link::None`].
    pub fn target(&self) -> Slot {
        self.link().1
    }

    /// True if this link writes into the 3D texture: it is the last of its chain.
    pub(super) fn writes_volume(&self) -> bool {
        self.target().is_volume()
    }

    fn link(&self) -> (Slot, Slot) {
        match self.slots {
            Some(slots) => slots,
            None => panic!("a pass that is no link of a chain asks for the chain's slots"),
        }
    }
}

impl Deref for Dispatch<'_> {
    type Target = DispatchArgs;

    fn deref(&self) -> &DispatchArgs {
        self.args
    }
}

/// The part of a slot that one dispatch touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Whole,
    /// The dispatch's slices of a 3D texture, or a layer from the first on for each of them. All of a plane.
    Slices,
    /// The dispatch's layers of the frame array.
    Layers,
    /// The dispatch's slices of a 3D texture, and that many more on either side.
    Around(u32),
    /// All of it: the first three texels are the workgroups along x, y and z that the dispatch has. The device reads them when it gets there.
    Groups,
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

/// The dispatch's slices.
pub fn slices(name: &'static str, slot: Slot) -> Bind {
    Bind { part: Part::Slices, ..whole(name, slot) }
}

pub fn layers(name: &'static str, slot: Slot) -> Bind {
    Bind { part: Part::Layers, ..whole(name, slot) }
}

/// The dispatch's slices of a slot of a filter chain; of the frames, which a chain may begin with, its layers.
pub(super) fn chain_slot(name: &'static str, slot: Slot) -> Bind {
    if slot == Slot::Frames { layers(name, slot) } else { slices(name, slot) }
}

/// What a filter reads: its chain's slot, which shaders name `source`.
pub(super) fn reads_source(_: &Scene, dispatch: &Dispatch) -> Vec<Bind> {
    vec![chain_slot("source", dispatch.source())]
}

/// What a filter writes: its chain's slot, which shaders name `target`; of the 3D texture the dispatch's slices.
pub(super) fn writes_target(_: &Scene, dispatch: &Dispatch) -> Vec<Bind> {
    vec![slices("target", dispatch.target())]
}

/// A sequence of filters, each of which reads what the one before it wrote. Their order is that of [`PASSES`](super::PASSES).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// The slices of stage 1, from the frame to the 3D texture.
    Slices,
    /// The slices of the volume that planes beside a rendering are cut from.
    Sections,
    /// The distance maps of stage 3.
    Distances,
    /// The pictures of stage 4.
    Pictures,
}

impl Chain {
    /// The volume that frames go to by this chain, smoothed; none of the others.
    pub(super) fn volume(self, scene: &Scene) -> Option<Slot> {
        match self {
            Chain::Slices if scene.drops_floating() => Some(Slot::WholeVolume),
            Chain::Slices => Some(Slot::Volume),
            Chain::Sections => Some(Slot::SectionVolume),
            Chain::Distances | Chain::Pictures => None,
        }
    }
}

/// The need of a pass of the volume that planes beside a rendering are cut from.
pub(super) fn of_sections(scene: &Scene, need: Need) -> Need {
    if scene.has_sections() { need } else { Err("no planes are cut from a volume of their own") }
}

/// How a pass takes part in a filter chain. Its slots and the part of a slice that it makes follow from this.
#[derive(Clone, Copy)]
pub enum Link {
    /// Not at all: the pass names its own slots and makes all of its extent.
    None,
    /// Filters what the link before it left.
    Filter(Filter),
    /// Reads what the chain holds at this place of `PASSES` and passes nothing on: the end of the chain for a pass after it.
    Observer(Chain),
    /// Reads the slices of the volume after their chain, and makes the visible part of each.
    AfterSlices,
}

/// A filter of a chain.
#[derive(Clone, Copy)]
pub struct Filter {
    pub chain: Chain,
    /// Dispatches that make one step; what they leave between them stays within the pass.
    pub dispatches: fn(&Scene) -> u32,
    /// How many columns and rows away one step on slices looks; none: from border to border. Filters before it make that much
    /// more than is visible.
    pub reach: fn(&Scene) -> Option<[u32; 2]>,
    /// Adjacent texels that an invocation makes, along an axis that the pass's extent shortens.
    pub run: u32,
    /// True if a step would store what it reads without loss: alone in its chain it is left out, and frames are copied.
    pub copies: fn(&Scene) -> bool,
    /// True if the next filter could as well read what a step reads: before another filter the step is left out.
    pub is_identity: fn(&Scene) -> bool,
}

impl Filter {
    /// A filter of that chain that reads one texel and takes one dispatch per step.
    pub const fn of(chain: Chain) -> Filter {
        Filter { chain, dispatches: once, reach: |_| Some([0; 2]), run: RUN, copies: |_| false, is_identity: |_| false }
    }

    /// A filter of slices that looks that many columns and rows away.
    pub(super) const fn of_slices(reach: fn(&Scene) -> Option<[u32; 2]>) -> Filter {
        Filter { reach, ..Filter::of(Chain::Slices) }
    }
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

/// One compute dispatch: the only place where it is described. Callers use the methods of the fields' names.
pub struct Pass {
    /// Debug label, time stamp and test case; unique.
    pub name: &'static str,
    pub stage: Stage,
    pub frequency: Frequency,
    /// Part in a filter chain.
    pub link: Link,
    /// Path below glsl/ and variant.
    pub shader: fn(&Scene, &Dispatch) -> &'static str,
    pub needed: fn(&Scene) -> Need,
    pub reads: fn(&Scene, &Dispatch) -> Vec<Bind>,
    pub writes: fn(&Scene, &Dispatch) -> Vec<Bind>,
    /// Invocations, not workgroups.
    pub extent: fn(&Scene, &DispatchArgs) -> [u32; 3],
    /// Dispatches in a row, with [`DispatchArgs::iteration`] counting.
    pub repeat: fn(&Scene) -> u32,
    /// Numbers: they change from picture to picture and compile nothing.
    pub params: fn(&Scene, &DispatchArgs) -> Params,
    /// Structure: a change of it is another pipeline.
    pub constants: fn(&Scene, &Dispatch) -> Vec<(&'static str, i32)>,
    pub tolerance: Tolerance,
    /// The same from the formula, in f64. Reads arrays by the shader's names; texels it leaves NaN stay untouched. Of a pass over
    /// frames it is called for each frame, with that frame's layer of every array of layers.
    pub reference: fn(&Scene, &Dispatch, &Arrays, &mut Arrays),
}

pub fn once(_: &Scene) -> u32 {
    1
}

pub(super) fn no_constants(_: &Scene, _: &Dispatch) -> Vec<(&'static str, i32)> {
    Vec::new()
}

/// One invocation per texel of each slice.
pub(super) fn slice_extent(scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
    [scene.grid.size[0], scene.grid.size[1], args.slices]
}

/// One invocation per pixel.
pub(super) fn picture_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.picture_size()[0], scene.picture_size()[1], 1]
}

/// One invocation per ray: stages 2 and 3.
pub(super) fn ray_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.ray_size()[0], scene.ray_size()[1], 1]
}

/// One invocation per pixel of the rendering.
pub(super) fn rendering_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.rendering_size()[0], scene.rendering_size()[1], 1]
}

/// Neighbours that one invocation of some filters makes, because their windows share most texels: RUN of glsl/filter.
pub const RUN: u32 = 4;

/// Invocations that make so many texels in runs along an axis.
pub(crate) fn in_runs(texels: [u32; 3], axis: usize) -> [u32; 3] {
    in_runs_of(RUN, texels, axis)
}

/// The same in runs of another length.
pub fn in_runs_of(run: u32, mut texels: [u32; 3], axis: usize) -> [u32; 3] {
    texels[axis] = texels[axis].div_ceil(run);
    texels
}

/// Invocations along each edge of a workgroup: local_size of glsl/include/common.glsl.
pub const GROUP: u32 = 8;

/// Largest tile of a workgroup, bytes. A multiprocessor of NVIDIA's Ada or Ampere has 100 KB of shared memory: for twelve workgroups, half of the
/// subgroups that it holds.
const LARGEST_TILE: u32 = 8 << 10;

/// Whether a workgroup reads its texels once into shared memory, of which they take so many words: glsl/include/workgroup_tile.glsl. A CPU, which has none
/// of its own, reads them once more as fast.
pub(super) fn reads_tile(scene: &Scene, words: u32) -> bool {
    4 * words <= LARGEST_TILE.min(scene.shared_memory)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    F32(f32),
    I32(i32),
    Vec2([f32; 2]),
    Vec3([f32; 3]),
    Vec4([f32; 4]),
    /// An array, of which the first may be all that are set.
    Floats([f32; MOST_FLOATS]),
}

/// The length of arrays of parameters.
const MOST_FLOATS: usize = 32;

/// Numbers of one dispatch, by the names that the shader gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(pub Vec<(&'static str, Value)>);

fn finite(value: f64) -> f32 {
    value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32
}

impl Params {
    /// Clamped to what is finite: shaders need not keep infinities.
    pub fn f32(mut self, name: &'static str, value: f64) -> Params {
        self.0.push((name, Value::F32(finite(value))));
        self
    }

    pub fn i32(mut self, name: &'static str, value: u32) -> Params {
        self.0.push((name, Value::I32(value as i32)));
        self
    }

    /// The texel of the volume that its image begins with.
    pub(super) fn first_stored(self, scene: &Scene) -> Params {
        let [column, row, slice] = Slot::Volume.first_texel(scene);
        self.i32("first_stored_column", column).i32("first_stored_row", row).i32("first_stored_slice", slice)
    }

    pub fn vec2(mut self, name: &'static str, value: [f64; 2]) -> Params {
        self.0.push((name, Value::Vec2(value.map(finite))));
        self
    }

    pub(super) fn vec4(mut self, name: &'static str, value: [f64; 4]) -> Params {
        self.0.push((name, Value::Vec4(value.map(finite))));
        self
    }

    /// As many as the array has at most; the others are 0.
    pub(super) fn floats(mut self, name: &'static str, values: &[f64]) -> Params {
        let value = |n: usize| values.get(n).copied().map_or(0.0, finite);
        self.0.push((name, Value::Floats(std::array::from_fn(value))));
        self
    }

    pub fn vec3(mut self, name: &'static str, value: impl Into<DVec3>) -> Params {
        self.0.push((name, Value::Vec3(value.into().to_array().map(finite))));
        self
    }
}

/// The rays of a scene, as every shader that casts or retraces them names them; relative to [`Scene::local_origin`].
pub(super) fn ray_params(scene: &Scene) -> Params {
    let rays = &scene.rays;
    Params::default()
        .vec3("origin", scene.to_local(rays.origin))
        .vec3("origin_dx", rays.origin_dx)
        .vec3("origin_dy", rays.origin_dy)
        .vec3("direction", rays.direction)
        .vec3("direction_dx", rays.direction_dx)
        .vec3("direction_dy", rays.direction_dy)
}
