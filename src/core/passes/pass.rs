//! What a pass declares: one compute dispatch, its slots, numbers and reference. The files of the passes import this module
//! and no list of passes; what follows from a pass's place in [`PASSES`](super::PASSES) is in [`chain`](super::chain).

pub use super::slots::{Found, Search, Slot, rendered};
pub(super) use super::slots::{composited_beside_surface, toned_slot};
pub use super::texels::{Arrays, Texels};
pub(super) use super::texels::{cells, pixels};
use crate::scene::{MAX_DEVIATION, Scene};
use crate::tree::{Defaults, Name};
use glam::DVec3;
use std::ops::{Deref, Range};

/// The value of a distance map where the ray hit nothing: the largest finite float, so that shaders need no infinities.
pub const MISS: f64 = f32::MAX as f64;

pub fn is_hit(distance: f64) -> bool {
    distance < 3e38
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Name)]
#[tree(rename_all = "lowercase")]
pub enum Stage {
    Preprocess,
    Raycast,
    Shade,
    Postprocess,
}

/// How often a pass runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frequency {
    /// Once for each frame.
    Frame,
    /// Before a picture, over the slices of the volume that have changed.
    Volume,
    /// Once for each picture.
    Picture,
}

/// The arguments of a dispatch: the numbers in which two dispatches of the same pass and scene differ. The default is one frame in slice 0.
#[derive(Clone, Copy, Debug, Defaults, PartialEq, Eq)]
pub struct DispatchArgs {
    /// The layer of the frame array that holds the first frame of the dispatch.
    pub layer: u32,
    /// The first slice that the dispatch writes. For a pass over frames it is the slice of the first frame.
    pub slice: u32,
    /// Number of slices that the dispatch writes. For a pass over frames it is the number of frames.
    #[value(1)]
    pub slices: u32,
    /// Number of the dispatch, from 0, among those of a pass that repeats.
    pub iteration: u32,
    /// Index of the volume image, of the two or three that are filled and shown in rotation: it selects the copy of multibuffered slots.
    pub image: u32,
}

impl DispatchArgs {
    /// The slices that the dispatch writes.
    pub(super) fn written(&self) -> Range<usize> {
        self.slice as usize..(self.slice + self.slices) as usize
    }
}

/// The arguments of one dispatch, and the slots that it reads and writes as a link of a filter chain.
pub struct Dispatch<'a> {
    args: &'a DispatchArgs,
    slots: Option<(Slot, Slot)>,
}

impl<'a> Dispatch<'a> {
    /// `slots`: the slots (read, written) of the chain. None for a pass that is no link.
    pub(super) fn new(args: &'a DispatchArgs, slots: Option<(Slot, Slot)>) -> Dispatch<'a> {
        Dispatch { args, slots }
    }

    /// The slot that this link of the chain reads.
    ///
    /// # Panics
    /// If the pass is no link of a chain: [`Link::None`] or [`Link::AfterSlices`].
    pub fn source(&self) -> Slot {
        self.link().0
    }

    /// The slot that this link of the chain writes. It is meaningless for an observer ([`Link::Observer`]), which writes slots of its own.
    ///
    /// # Panics
    /// If the pass is no link of a chain: [`Link::None`] or [`Link::AfterSlices`].
    pub fn target(&self) -> Slot {
        self.link().1
    }

    /// True if this link writes into the 3D texture, because it is the last filter of slices.
    pub(super) fn writes_volume(&self) -> bool {
        self.target().is_volume()
    }

    fn link(&self) -> (Slot, Slot) {
        self.slots.unwrap_or_else(|| panic!("a pass that is no link of a chain asks for the chain's slots"))
    }
}

impl Deref for Dispatch<'_> {
    type Target = DispatchArgs;

    fn deref(&self) -> &DispatchArgs {
        self.args
    }
}

/// The part of a slot that one dispatch reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Whole,
    /// The part depends on the shape of the slot. Of a 3D texture it is the dispatch's slices, of an array of layers the first layers, one for each
    /// of these slices, of a 2D image or a buffer all of it.
    Slices,
    /// The layers of the frame array from [`DispatchArgs::layer`] on, one for each frame of the dispatch.
    Layers,
    /// The dispatch's slices of a 3D texture, and this many more on either side.
    Around(u32),
    /// The whole slot, which sets the size of an indirect dispatch. Its first three texels are the number of workgroups along x, y and z, which the
    /// device reads when it executes the dispatch.
    Groups,
}

/// One binding of a dispatch: a slot under the name that the shader gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bind {
    pub name: &'static str,
    pub slot: Slot,
    pub part: Part,
    /// True if the shader samples the slot through the device's linear filter. Otherwise it only fetches texels.
    pub filtered: bool,
}

pub fn whole(name: &'static str, slot: Slot) -> Bind {
    Bind { name, slot, part: Part::Whole, filtered: false }
}

/// Binds a whole slot if `is_bound`, otherwise nothing.
pub(super) fn whole_if(is_bound: bool, name: &'static str, slot: Slot) -> Vec<Bind> {
    is_bound.then_some(whole(name, slot)).into_iter().collect()
}

/// Binds the dispatch's slices of a slot.
pub fn slices(name: &'static str, slot: Slot) -> Bind {
    Bind { part: Part::Slices, ..whole(name, slot) }
}

pub fn layers(name: &'static str, slot: Slot) -> Bind {
    Bind { part: Part::Layers, ..whole(name, slot) }
}

/// Binds a slot of a filter chain: the dispatch's slices of a volume, or its layers of the frame array, which a chain may begin with.
pub(super) fn chain_slot(name: &'static str, slot: Slot) -> Bind {
    if slot == Slot::Frames { layers(name, slot) } else { slices(name, slot) }
}

/// The input of a filter: its chain's slot, which shaders name `source`.
pub(super) fn reads_source(_: &Scene, dispatch: &Dispatch) -> Vec<Bind> {
    vec![chain_slot("source", dispatch.source())]
}

/// The output of a filter: its chain's slot, which shaders name `target`. Of the 3D texture only the dispatch's slices are written.
fn writes_target(_: &Scene, dispatch: &Dispatch) -> Vec<Bind> {
    vec![slices("target", dispatch.target())]
}

/// The output of a filter for its reference, and the slice of it that the dispatch writes: 0 unless it is the 3D texture.
pub(super) fn target_of<'a>(writes: &'a mut Arrays, args: &DispatchArgs) -> (&'a mut Texels, usize) {
    let target = writes.get_mut("target");
    let z = if target.size[2] > 1 { args.slice as usize } else { 0 };
    (target, z)
}

/// The input of a filter for its reference, and what [`target_of`] returns.
pub(super) fn filtered<'a>(
    reads: &'a Arrays,
    writes: &'a mut Arrays,
    args: &DispatchArgs,
) -> (&'a Texels, &'a mut Texels, usize) {
    let (target, z) = target_of(writes, args);
    (reads.get("source"), target, z)
}

/// A sequence of filters. Each reads the output of the one before it. Their order is that of [`PASSES`](super::PASSES).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// The slices of stage 1 (preprocess), from the frame to the 3D texture.
    Slices,
    /// The slices of the section volume ([`Slot::SectionVolume`]), which planes beside a rendering are cut from.
    Sections,
    /// The distance maps of stage 3 (shade).
    Distances,
    /// The pictures of stage 4 (postprocess).
    Pictures,
}

impl Chain {
    /// The volume that the slices of this chain make, after smoothing across slices. None for chains of distance maps and pictures.
    pub(super) fn volume(self, scene: &Scene) -> Option<Slot> {
        match self {
            Chain::Slices if scene.drops_floating() => Some(Slot::WholeVolume),
            Chain::Slices => Some(Slot::Volume),
            Chain::Sections => Some(Slot::SectionVolume),
            Chain::Distances | Chain::Pictures => None,
        }
    }
}

/// The need of a pass that makes the section volume: `need`, or an error if the scene has no section volume.
pub(super) fn of_sections(scene: &Scene, need: Need) -> Need {
    if scene.has_sections() { need } else { Err("no planes are cut from a volume of their own") }
}

/// How a pass takes part in a filter chain. The slots that it reads and writes, and the part of a slice that it makes, follow from this.
#[derive(Clone, Copy)]
pub enum Link {
    /// The pass takes no part: it names its own slots and computes all of its extent.
    None,
    /// The pass filters the output of the link before it.
    Filter(Filter),
    /// The pass reads what the chain holds at its place in [`PASSES`](super::PASSES) and writes slots of its own. If it stands after the last filter,
    /// it reads the end of the chain.
    Observer(Chain),
    /// The pass reads the finished slices of the volume, and computes the visible part of each slice of its own output.
    AfterSlices,
}

impl Link {
    /// The chain whose slots the pass reads. None for a pass that is no link of one.
    pub(super) fn chain(&self) -> Option<Chain> {
        match self {
            Link::Filter(filter) => Some(filter.chain),
            Link::Observer(chain) => Some(*chain),
            Link::None | Link::AfterSlices => None,
        }
    }
}

/// A filter of a chain. One step of it is one application of the filter, which may take several dispatches.
#[derive(Clone, Copy)]
pub struct Filter {
    pub chain: Chain,
    /// Number of dispatches of one step. They hand intermediate results on to each other in slots of the pass's own.
    pub dispatches: fn(&Scene) -> u32,
    /// How many columns and rows around a texel one step reads; used only for slices. None if each texel depends on the complete slice. The filters
    /// before this one compute that much more than the visible part.
    pub reach: fn(&Scene) -> Option<[u32; 2]>,
    /// Number of adjacent texels that one invocation makes, along the axis along which the pass's extent is shorter than the slice.
    pub run: u32,
    /// True if a step would store its input without loss. If it is then the only filter of [`Chain::Slices`], and no section volume is made, it is
    /// left out and frames are copied.
    pub copies: fn(&Scene) -> bool,
    /// True if the next filter could read this step's input instead of its output. If it is then the first of several filters of its chain, it is
    /// left out.
    pub is_identity: fn(&Scene) -> bool,
}

impl Filter {
    /// A filter of this chain that reads one texel for each that it writes, takes one dispatch a step and is never left out.
    pub const fn of(chain: Chain) -> Filter {
        Filter { chain, dispatches: once, reach: |_| Some([0; 2]), run: RUN, copies: |_| false, is_identity: |_| false }
    }

    /// A filter of slices that reads `reach` columns and rows around each texel ([`Filter::reach`]).
    pub(super) const fn of_slices(reach: fn(&Scene) -> Option<[u32; 2]>) -> Filter {
        Filter { reach, ..Filter::of(Chain::Slices) }
    }
}

/// Whether a scene needs a pass: `Ok` with the reason, or `Err` with the reason why not. `--explain` prints it.
pub type Need = Result<&'static str, &'static str>;

/// The largest error that a pass may have against its reference on the test inputs, beside the rounding of the output's format.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Absolute error, in the units of the output.
    pub absolute: f64,
    /// Error relative to the expected value. The larger of the absolute and the relative tolerance applies.
    pub relative: f64,
    /// Share (0..1) of the texels whose error may be larger, because a branch may go the other way by rounding.
    pub outliers: f64,
    pub why: &'static str,
}

impl Tolerance {
    /// Bit for bit.
    pub(super) const fn exact(why: &'static str) -> Tolerance {
        Tolerance::absolute(0.0).because(why)
    }

    /// An absolute tolerance alone, to which the methods below add.
    pub(super) const fn absolute(absolute: f64) -> Tolerance {
        Tolerance { absolute, relative: 0.0, outliers: 0.0, why: "" }
    }

    pub(super) const fn relative(self, relative: f64) -> Tolerance {
        Tolerance { relative, ..self }
    }

    pub(super) const fn outliers(self, outliers: f64) -> Tolerance {
        Tolerance { outliers, ..self }
    }

    pub(super) const fn because(self, why: &'static str) -> Tolerance {
        Tolerance { why, ..self }
    }
}

/// The declaration of a compute pass, the only place where it is described. Callers use methods of the same names in place of the functions in fields
/// (`invocations` for `extent`, `numbers` for `params`); only `repeat` has no method.
pub struct Pass {
    /// Unique name: debug label, name of its time stamps and of its test case.
    pub name: &'static str,
    pub stage: Stage,
    pub frequency: Frequency,
    /// How the pass takes part in a filter chain.
    pub link: Link,
    /// Path of the shader below glsl/ without its extension, with the variant behind a dot if it has several.
    pub shader: fn(&Scene, &Dispatch) -> &'static str,
    pub needed: fn(&Scene) -> Need,
    pub reads: fn(&Scene, &Dispatch) -> Vec<Bind>,
    pub writes: fn(&Scene, &Dispatch) -> Vec<Bind>,
    /// Number of invocations (not workgroups) along x, y and z.
    pub extent: fn(&Scene, &DispatchArgs) -> [u32; 3],
    /// Number of dispatches in a row that a run of the pass takes; [`DispatchArgs::iteration`] counts them.
    pub repeat: fn(&Scene) -> u32,
    /// The parameters of a dispatch. They may change from picture to picture without a new pipeline.
    pub params: fn(&Scene, &DispatchArgs) -> Params,
    /// Specialization constants, by name: they select the code that a dispatch runs. Another value makes another pipeline.
    pub constants: fn(&Scene, &Dispatch) -> Vec<(&'static str, i32)>,
    pub tolerance: Tolerance,
    /// Computes the outputs of a dispatch by the formulas of the pass in f64. The two [`Arrays`] are the inputs and the outputs, under their names in
    /// the shader. Texels that it leaves NaN are not written by the dispatch. For a pass over frames it is called once a frame, with that frame's
    /// layer of every array of layers.
    pub reference: fn(&Scene, &Dispatch, &Arrays, &mut Arrays),
}

impl Pass {
    /// Defaults of passes with one invocation per ray and one dispatch a picture, without parameters and constants. Every pass has to replace the
    /// fields that are empty here; tests fail otherwise.
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
        tolerance: Tolerance::exact(""),
        reference: |_, _, _, _| {},
    };

    /// Defaults of filters of slices, one invocation a texel. Every pass has to replace the fields that are empty in [`Pass::OF_RAYS`].
    pub(super) const OF_SLICES: Pass = Pass {
        stage: Stage::Preprocess,
        frequency: Frequency::Frame,
        extent: slice_extent,
        ..Pass::filter(Chain::Slices)
    };

    /// Defaults of passes that make slices of their own from the finished slices of the volume. Every pass has to replace the
    /// fields that are empty in [`Pass::OF_RAYS`].
    pub(super) const AFTER_SLICES: Pass =
        Pass { frequency: Frequency::Volume, link: Link::AfterSlices, ..Pass::OF_SLICES };

    /// Defaults of filters of the distance map. Every pass has to replace the fields that are empty in [`Pass::OF_RAYS`].
    pub(super) const OF_DISTANCES: Pass = Pass { stage: Stage::Shade, ..Pass::filter(Chain::Distances) };

    /// Defaults of filters of the picture. Every pass has to replace the fields that are empty in [`Pass::OF_RAYS`].
    pub(super) const OF_PICTURES: Pass =
        Pass { stage: Stage::Postprocess, extent: picture_extent, ..Pass::filter(Chain::Pictures) };

    const fn filter(chain: Chain) -> Pass {
        Pass { link: Link::Filter(Filter::of(chain)), reads: reads_source, writes: writes_target, ..Pass::OF_RAYS }
    }
}

pub fn once(_: &Scene) -> u32 {
    1
}

/// The constants without those of the names `without`, and with those of `with`.
pub(super) fn replaced<const N: usize>(
    mut constants: Vec<(&'static str, i32)>,
    without: &[&str],
    with: [(&'static str, i32); N],
) -> Vec<(&'static str, i32)> {
    constants.retain(|(name, _)| !without.contains(name));
    constants.extend(with);
    constants
}

pub(super) fn no_constants(_: &Scene, _: &Dispatch) -> Vec<(&'static str, i32)> {
    Vec::new()
}

/// One invocation per texel of each of the dispatch's slices.
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

/// One invocation per pixel of the part of the picture that shows the rendering.
pub(super) fn rendering_extent(scene: &Scene, _: &DispatchArgs) -> [u32; 3] {
    [scene.rendering_size()[0], scene.rendering_size()[1], 1]
}

/// Number of adjacent texels that one invocation of most filters computes, because the windows of adjacent texels overlap: RUN of glsl/filter.
pub const RUN: u32 = 4;

/// Number of invocations along each axis that make `texels`, each a run of [`RUN`] texels along `axis`.
pub(crate) fn in_runs(texels: [u32; 3], axis: usize) -> [u32; 3] {
    in_runs_of(RUN, texels, axis)
}

/// Number of invocations along each axis that compute `texels`, if each computes a run of `run` texels along `axis`.
pub fn in_runs_of(run: u32, mut texels: [u32; 3], axis: usize) -> [u32; 3] {
    texels[axis] = texels[axis].div_ceil(run);
    texels
}

/// Invocations of a workgroup along x and along y; along z it has one: local_size of glsl/include/common.glsl.
pub const GROUP: u32 = 8;

/// Largest tile of a workgroup, bytes. A multiprocessor of NVIDIA's Ada or Ampere has 100 KB of shared memory: for twelve workgroups, half of the
/// subgroups that it holds.
const LARGEST_TILE: u32 = 8 << 10;

/// True if the invocations of a workgroup read their texels once into shared memory (glsl/include/workgroup_tile.glsl), which must hold `words` words
/// of 4 bytes. On a CPU it is false: it has no shared memory, and reads texels again as fast.
pub(super) fn reads_tile(scene: &Scene, words: u32) -> bool {
    4 * words <= LARGEST_TILE.min(scene.device.shared_memory)
}

#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    F32(f32),
    I32(i32),
    Vec2([f32; 2]),
    Vec3([f32; 3]),
    Vec4([f32; 4]),
    /// An array of floats; elements that were not set are 0.
    Floats(Box<[f32; MOST_FLOATS]>),
}

/// The length of arrays of parameters: the weights on one side of the widest Gaussian, and that of the middle.
const MOST_FLOATS: usize = 3 * MAX_DEVIATION as usize + 1;

/// Parameters of one dispatch, by the names that the shader gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(pub Vec<(&'static str, Value)>);

fn finite(value: f64) -> f32 {
    value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32
}

impl Params {
    /// Adds a float. Values beyond the range of f32, also infinities, become the largest finite float of their sign, so that shaders need not handle
    /// infinities.
    pub fn f32(self, name: &'static str, value: f64) -> Params {
        self.with(name, Value::F32(finite(value)))
    }

    pub fn i32(self, name: &'static str, value: u32) -> Params {
        self.with(name, Value::I32(value as i32))
    }

    fn with(mut self, name: &'static str, value: Value) -> Params {
        self.0.push((name, value));
        self
    }

    /// Adds the first texel of the volume that the device stores: column, row and slice.
    pub(super) fn first_stored(self, scene: &Scene) -> Params {
        let [column, row, slice] = Slot::Volume.first_texel(scene);
        self.i32("first_stored_column", column).i32("first_stored_row", row).i32("first_stored_slice", slice)
    }

    pub fn vec2(self, name: &'static str, value: [f64; 2]) -> Params {
        self.with(name, Value::Vec2(value.map(finite)))
    }

    pub(super) fn vec4(self, name: &'static str, value: [f64; 4]) -> Params {
        self.with(name, Value::Vec4(value.map(finite)))
    }

    /// Adds an array of at most [`MOST_FLOATS`] values; missing ones are 0.
    pub(super) fn floats(self, name: &'static str, values: &[f64]) -> Params {
        assert!(values.len() <= MOST_FLOATS, "{name}: {} values", values.len());
        let value = |n: usize| values.get(n).copied().map_or(0.0, finite);
        self.with(name, Value::Floats(Box::new(std::array::from_fn(value))))
    }

    pub fn vec3(self, name: &'static str, value: impl Into<DVec3>) -> Params {
        self.with(name, Value::Vec3(value.into().to_array().map(finite)))
    }
}

/// The rays of a scene as parameters, under the names that all shaders give them; relative to [`Scene::local_origin`].
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
