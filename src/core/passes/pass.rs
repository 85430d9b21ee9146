//! What a pass declares: one compute dispatch, its slots, numbers and reference. The files of the passes import this module
//! and no list of passes; what follows from a pass's place in [`PASSES`](super::PASSES) is in [`chain`](super::chain).

pub(super) use super::slots::composited_beside_surface;
pub use super::slots::{Found, Search, Slot, rendered};
pub use super::texels::{Arrays, Texels};
use crate::scene::Scene;
use glam::DVec3;
use std::ops::Deref;

/// The distance of a ray that hit nothing: the largest finite float, so that shaders need no infinities.
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
    /// Once for each frame.
    Frame,
    /// Once for each complete volume.
    Volume,
    /// Once for each picture.
    Picture,
}

/// The numbers that differ between two dispatches of the same pass and scene. By default a pass over frames gets one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DispatchArgs {
    /// Layer of the frame array that holds the first frame.
    pub layer: u32,
    /// The first slice that the dispatch writes. For a pass over frames it is the slice of the first frame.
    pub slice: u32,
    /// Number of slices that the dispatch writes. For a pass over frames it is the number of frames.
    pub slices: u32,
    /// Number of the dispatch, from 0, within a pass that repeats.
    pub iteration: u32,
    /// Index of the copy of multi-buffered slots that the dispatch uses.
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
    /// All of it. The first three texels are the number of workgroups along x, y and z. The device reads them when it executes the
    /// dispatch.
    Groups,
}

/// A slot under the name that the shader gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bind {
    pub name: &'static str,
    pub slot: Slot,
    pub part: Part,
    /// True if the device's linear filter samples the slot. Otherwise the shader only fetches texels.
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

/// A sequence of filters. Each reads the output of the one before it. Their order is that of [`PASSES`](super::PASSES).
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
    /// It takes no part: the pass names its own slots and computes all of its extent.
    None,
    /// It filters the output of the link before it.
    Filter(Filter),
    /// It reads the state of the chain at this place of `PASSES` and passes nothing on. A pass after the chain reads its end.
    Observer(Chain),
    /// Reads the slices of the volume after their chain, and makes the visible part of each.
    AfterSlices,
}

/// A filter of a chain.
#[derive(Clone, Copy)]
pub struct Filter {
    pub chain: Chain,
    /// Number of dispatches of one step. Their intermediate results stay within the pass.
    pub dispatches: fn(&Scene) -> u32,
    /// How many columns and rows around a texel one step on slices reads. None: from border to border. Filters before it compute this much
    /// more than the visible part.
    pub reach: fn(&Scene) -> Option<[u32; 2]>,
    /// Adjacent texels that an invocation makes, along an axis that the pass's extent shortens.
    pub run: u32,
    /// True if a step would store its input without loss. Alone in its chain such a step is left out, and frames are copied.
    pub copies: fn(&Scene) -> bool,
    /// True if the next filter could read the input of a step instead of its output. Before another filter such a step is left out.
    pub is_identity: fn(&Scene) -> bool,
}

impl Filter {
    /// A filter of that chain that reads one texel and takes one dispatch a step.
    pub const fn of(chain: Chain) -> Filter {
        Filter { chain, dispatches: once, reach: |_| Some([0; 2]), run: RUN, copies: |_| false, is_identity: |_| false }
    }

    /// A filter of slices that looks that many columns and rows away.
    pub(super) const fn of_slices(reach: fn(&Scene) -> Option<[u32; 2]>) -> Filter {
        Filter { reach, ..Filter::of(Chain::Slices) }
    }
}

/// Whether a scene needs a pass, with the reason, for `--explain`.
pub type Need = Result<&'static str, &'static str>;

/// Largest error against the reference on the test inputs.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Absolute, in the units of the output.
    pub absolute: f64,
    /// Relative to the expected value. The larger of the two tolerances applies.
    pub relative: f64,
    /// Share of texels whose error may be larger, because a branch may take the other side.
    pub outliers: f64,
    pub why: &'static str,
}

/// One compute dispatch. This is the only place where it is described. Callers use the methods with the names of the fields.
pub struct Pass {
    /// Debug label, time stamp and test case; unique.
    pub name: &'static str,
    pub stage: Stage,
    pub frequency: Frequency,
    /// The pass's part in a filter chain.
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
    /// The numbers of a dispatch. They change from picture to picture without compiling anything.
    pub params: fn(&Scene, &DispatchArgs) -> Params,
    /// Specialization constants: the structure of a dispatch. Another value is another pipeline.
    pub constants: fn(&Scene, &Dispatch) -> Vec<(&'static str, i32)>,
    pub tolerance: Tolerance,
    /// The same result computed from the formula in f64. It reads arrays by the shader's names. Texels that it leaves NaN stay untouched.
    /// For a pass over frames it is called for each frame, with that frame's layer of every array of layers.
    pub reference: fn(&Scene, &Dispatch, &Arrays, &mut Arrays),
}

impl Pass {
    /// What most passes of the rays have in common: one invocation and one dispatch a picture, without parameters and constants. What is
    /// left empty here is different in every pass, and no pass without it passes its tests.
    pub(super) const OF_RAYS: Pass = Pass {
        name: "",
        stage: Stage::Raycast,
        frequency: Frequency::Picture,
        link: Link::None,
        shader: |_, _| "",
        needed: |_| Err(""),
        reads: |_, _| Vec::new(),
        writes: |_, _| Vec::new(),
        extent: ray_extent,
        repeat: once,
        params: |_, _| Params::default(),
        constants: no_constants,
        tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "" },
        reference: |_, _, _, _| {},
    };

    /// The same of passes that make slices of frames.
    pub(super) const OF_SLICES: Pass = Pass {
        stage: Stage::Preprocess,
        frequency: Frequency::Frame,
        extent: slice_extent,
        ..Pass::filter(Chain::Slices)
    };

    /// The same of filters of the distance map.
    pub(super) const OF_DISTANCES: Pass = Pass { stage: Stage::Shade, ..Pass::filter(Chain::Distances) };

    /// The same of filters of the picture.
    pub(super) const OF_PICTURES: Pass =
        Pass { stage: Stage::Postprocess, extent: picture_extent, ..Pass::filter(Chain::Pictures) };

    const fn filter(chain: Chain) -> Pass {
        Pass { link: Link::Filter(Filter::of(chain)), reads: reads_source, writes: writes_target, ..Pass::OF_RAYS }
    }
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

/// Number of adjacent texels that one invocation of some filters computes, because their windows share most texels: RUN of glsl/filter.
pub const RUN: u32 = 4;

/// Invocations that make so many texels in runs along an axis.
pub(crate) fn in_runs(texels: [u32; 3], axis: usize) -> [u32; 3] {
    in_runs_of(RUN, texels, axis)
}

/// Number of invocations that compute these texels in runs of this length along an axis.
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
    /// Adds a number, clamped to finite values, so that shaders need no infinities.
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
