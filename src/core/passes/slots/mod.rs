//! Slots: the GPU resources that passes read and write. Each is declared once, in the table below; its shape and format
//! follow from the scene. A slot that no pass of a plan names does not exist.

mod formats;
mod sizes;

pub use formats::{Format, Shape, encoded};
pub use sizes::{BATCHES_IN_FLIGHT, batch_bytes, frames_per_batch, ring_entry_end};

use super::raycast::tolerance;
use super::unveil::{self, Unveiled};
use super::{MISS, Texels, cut, floating, lookup_tables};
use crate::scene::planes::TILE_VECTORS;
use crate::scene::{Scene, SurfaceColour, WindowTexels};
use sizes::*;

/// What a slot is.
struct Descriptor {
    /// Debug name; also the GLSL variable's unless a pass gives an alias.
    name: &'static str,
    shape: fn(&Scene) -> Shape,
    format: fn(&Scene) -> Format,
    initializer: Initializer,
    /// How to tell that two scenes make different content, where it is made from the scene.
    differs: Differs,
    meaning: Meaning,
    /// True if each of the volume images has its own copy.
    is_multibuffered: bool,
    /// True if texels that no pass writes are read as 0: those of slices outside the sector.
    starts_clear: bool,
    /// True if different queues use it where the device has several; it is created CONCURRENT then. Stage 1 works on these
    /// slots; new ones are cleared and filled where pictures are made.
    crosses_queues: bool,
}

/// What the values of a slot mean; `--dump` prints it.
#[derive(Clone, Copy)]
pub(crate) struct Meaning {
    pub channels: &'static [&'static str],
    pub unit: &'static str,
    /// The value of a ray that hit nothing. None if the slot has no such value.
    pub miss: Option<f64>,
}

const GREY: &[&str] = &["value"];
const COLOUR: &[&str] = &["red", "green", "blue", "alpha"];
const VECTOR: &[&str] = &["x", "y", "z", "w"];
const LIT: &[&str] = &["red", "green", "blue", "density"];
const ABSORBING: &[&str] = &["red", "green", "blue", "absorption"];
const COST: &str = "cost of a candidate above that of no surface";
const AS_THE_SHADER: &str = "vectors as the shader takes them";
const KIND: &str = "(64 kind + distance in bricks) / 255; kinds: 0 active, 1 empty, 2 homogeneous";
const OF_SLICE_PIXEL: &str = "colour 0..1; absorption of one slice pixel";
const DENSITY: &str = "share of the densest matter, 0..1";
const LIGHT: &str = "light; 1 is that of an unshadowed light of strength 1";
const ARRIVED: &str = "light: share of what came; share of the densest matter";
/// Of samples of the recording.
const SHARE_OF_RANGE: &str = "share of the range of the recording's samples, 0..1, before the grey window";

/// How a slot gets its content: passes write it, uploaded frames fill it, or the CPU computes it.
#[derive(Clone, Copy)]
pub enum Initializer {
    ByPasses,
    ByFrames,
    /// The CPU computes the content from the scene in f64 and stores it as f32.
    ByScene(fn(&Scene) -> Vec<f32>),
    /// The CPU computes the content by a search in a complete volume.
    ByVolume(Search),
}

/// A search in a volume by the CPU.
#[derive(Clone, Copy)]
pub struct Search {
    /// Name of the search in the list of host times.
    pub name: &'static str,
    /// The slot of the volume that is searched.
    pub within: Slot,
    /// The search. Its second argument is all texels of the slot `within`, as bytes in the format of that slot.
    pub find: fn(&Scene, &[u8]) -> Found,
    /// The same search in f64, by another method. It returns the content of the slot that the search fills.
    pub reference: fn(&Scene, &Texels) -> Texels,
}

/// What a search found.
pub struct Found {
    /// Bytes of the slot that the search fills, in its format.
    pub texels: Vec<u8>,
    /// The start surface, and whether fluid was recognised, if the search was for the render start (`unveil`); otherwise None.
    pub unveiled: Option<Unveiled>,
}

/// How to tell that two scenes make different content of a slot.
#[derive(Clone, Copy)]
enum Differs {
    /// Both are made and compared.
    ByContent,
    /// From what the content follows from: the content itself is too long to compare.
    By(fn(&Scene, &Scene) -> bool),
}

impl Descriptor {
    /// An image that passes write.
    const fn image(name: &'static str, shape: fn(&Scene) -> Shape, format: fn(&Scene) -> Format) -> Descriptor {
        Descriptor {
            name,
            shape,
            format,
            initializer: Initializer::ByPasses,
            differs: Differs::ByContent,
            meaning: Meaning { channels: &[], unit: "", miss: None },
            is_multibuffered: false,
            starts_clear: false,
            crosses_queues: false,
        }
    }

    /// A buffer of 32-bit floats made from the scene.
    const fn table(
        name: &'static str,
        shape: fn(&Scene) -> Shape,
        make: fn(&Scene) -> Vec<f32>,
        differs: Differs,
    ) -> Descriptor {
        Descriptor::image(name, shape, |_| Format::Floats).by_scene(make, differs)
    }

    /// `channels`: their names, as many as texels have or more.
    const fn of(self, channels: &'static [&'static str], unit: &'static str) -> Descriptor {
        Descriptor { meaning: Meaning { channels, unit, miss: None }, ..self }
    }

    const fn distances(self) -> Descriptor {
        let unit = "mm along the ray of the pixel, from the ray's origin";
        Descriptor { meaning: Meaning { channels: GREY, unit, miss: Some(MISS) }, ..self }
    }

    /// An image of the volume. Each volume image has its own copy; texels that no pass writes are read as 0.
    const fn volume(name: &'static str) -> Descriptor {
        Descriptor::image(name, volume, volume_format).multibuffered().clear().of(GREY, SHARE_OF_RANGE)
    }

    /// A table of vectors of four floats, as many bytes as `shape` has.
    const fn vectors(name: &'static str, shape: fn(&Scene) -> Shape, make: fn(&Scene) -> Vec<f32>) -> Descriptor {
        Descriptor::table(name, shape, make, Differs::ByContent).of(VECTOR, AS_THE_SHADER)
    }

    const fn by_frames(self) -> Descriptor {
        Descriptor { initializer: Initializer::ByFrames, ..self }
    }

    const fn by_scene(self, make: fn(&Scene) -> Vec<f32>, differs: Differs) -> Descriptor {
        Descriptor { initializer: Initializer::ByScene(make), differs, ..self }
    }

    /// `differs`: whether two scenes find other content in the same volume.
    const fn by_volume(self, search: Search, differs: fn(&Scene, &Scene) -> bool) -> Descriptor {
        Descriptor { initializer: Initializer::ByVolume(search), differs: Differs::By(differs), ..self }
    }

    const fn multibuffered(self) -> Descriptor {
        Descriptor { is_multibuffered: true, ..self }
    }

    const fn clear(self) -> Descriptor {
        Descriptor { starts_clear: true, ..self }
    }

    const fn across_queues(self) -> Descriptor {
        Descriptor { crosses_queues: true, ..self }
    }
}

/// Declares the enum of slots and the descriptor of each.
macro_rules! slots {
    ($($(#[$doc:meta])* $slot:ident = $descriptor:expr;)*) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Slot { $($(#[$doc])* $slot,)* }

        const DESCRIPTORS: &[Descriptor] = &[$($descriptor,)*];

        const _: () = {
            $(assert!(Slot::$slot.descriptor().meaning.channels.len() > 0, stringify!($slot));)*
        };

        impl Slot {
            pub const ALL: &'static [Slot] = &[$(Slot::$slot,)*];
        }
    };
}

use Descriptor as D;
use Differs::{By, ByContent};

slots! {
    /// The frame array: the frames of every batch in flight, one a layer.
    Frames = D::image("frames", frame_layers, frame_format).by_frames().across_queues().of(GREY, SHARE_OF_RANGE);
    /// Gain of every sample of a line, for time gain compensation.
    Tgc = D::table("tgc", |s| Shape::Buffer(4 * s.frame_size()[0]), lookup_tables::tgc, ByContent)
        .of(GREY, "gain of a sample: a factor, or an addend where samples are log-compressed");
    /// The frames of a batch after line conditioning: decimated samples x lines.
    Conditioned = D::image("conditioned", |s| batch(s.line_lattice(), s), |_| Format::R32f).across_queues()
        .of(GREY, SHARE_OF_RANGE);
    /// The (sample, line) of every slice pixel, for scan conversion; -1 outside the sector.
    ScanLut = D::image("scan_lut", one_slice, |_| Format::Rg32f).by_scene(lookup_tables::scan_lut, By(lattice_differs))
        .across_queues().of(&["sample", "line"], "index from 0; -1 outside the sector");
    /// Slices between two filters of stage 1; each slice of a batch is a layer.
    SliceA = D::image("slice_a", slices, |_| Format::R32f).clear().across_queues().of(GREY, SHARE_OF_RANGE);
    SliceB = D::image("slice_b", slices, |_| Format::R32f).clear().across_queues().of(GREY, SHARE_OF_RANGE);
    /// How many rings the window of the enhanced sigma filter grew, at each pixel of the last batch's slices.
    Growth = D::image("growth", slices, |_| Format::R32f).across_queues().of(GREY, "rings of pixels");
    /// AOS on slices, after the elimination along rows or columns: the result at a pixel is `SliceForward` plus `SliceShares` times the result at the
    /// next pixel.
    SliceShares = D::image("slice_shares", slices, |_| Format::R32f).across_queues().of(GREY, "share, 0..1");
    SliceForward = D::image("slice_forward", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    /// AOS on slices: a slice after the diffusion along its rows.
    SliceRows = D::image("slice_rows", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    /// AOS with Richardson's extrapolation: a slice after a complete step. `SliceHalfStep` is the slice after the first of two half steps.
    SliceStep = D::image("slice_step", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    SliceHalfStep = D::image("slice_half_step", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    /// RKL1: slices after a stage. Each stage reads the results of the last two.
    SliceStageA = D::image("slice_stage_a", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    SliceStageB = D::image("slice_stage_b", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    SliceStageC = D::image("slice_stage_c", slices, |_| Format::R32f).across_queues().of(GREY, SHARE_OF_RANGE);
    /// The volume before it is smoothed across slices.
    SharpVolume = D::volume("sharp_volume").across_queues();
    /// The volume before floating parts are dropped.
    WholeVolume = D::volume("whole_volume").across_queues();
    /// 1 in texels of floating parts of the volume, otherwise 0.
    Floating = D::image("floating", volume, |_| Format::R8).by_volume(floating::SEARCH,
        |a, b| a.floating_basis() != b.floating_basis()).of(GREY, "1 in parts of the volume that float");
    /// The volume that rays are cast through, unless parts of it are removed ([`Slot::CutVolume`]).
    Volume = D::volume("volume").across_queues();
    /// The volume without what cuts or the render start remove. Rays are cast through it in place of [`Slot::Volume`].
    CutVolume = D::volume("cut_volume");
    /// The start surface: the row at which rendering starts, for each column and slice of the volume.
    StartSurface = D::image("start_surface", |s| Shape::Two([s.grid.size[0], s.slices()]), |_| Format::R32f)
        .by_volume(unveil::SEARCH, |a, b| a.unveil_basis() != b.unveil_basis())
        .multibuffered().of(GREY, "row of the volume, by column and slice");
    /// The start curve: the first row that is not in front of it, for each column and slice of the volume.
    StartCurve = D::image("start_curve", |s| Shape::Two([s.grid.size[0], s.slices()]), |_| Format::R32f)
        .by_scene(cut::start_curve, By(|a, b| a.start_curve_differs(b))).of(GREY, "row of the volume, by column and slice");
    /// The cuts: the axes of their views, and the edges of their contours or the points of their brushes.
    Cuts = D::vectors("cuts", |s| Shape::Buffer(16 * cut::table_length(s) as u32), cut::table);
    /// The place of each slice in space: its angle or position, and how far the motor moves during its frame.
    SlicePlaces = D::vectors("slice_places", |s| Shape::Buffer(16 * s.slices()), cut::slice_places);
    /// For each texel of a slice, the share (0..1) of the frame's lines that fired before the line through it.
    LineShares = D::image("line_shares", one_slice, |_| Format::R32f).by_scene(cut::line_shares, By(lattice_differs))
        .of(GREY, "share of the frame's lines that fired before");
    /// The section volume before it is smoothed across slices. `SectionVolume` is the smoothed one, which planes beside a rendering are cut from.
    SharpSectionVolume = D::volume("sharp_section_volume").across_queues();
    SectionVolume = D::volume("section_volume").across_queues();
    /// The bits of each texel of the volume together with those of its neighbours one column and one row on.
    PackedNeighbours = D::image("packed_neighbours", volume, |_| Format::Rg32u).multibuffered()
        .of(&["bits", "more_bits"], "bits of a texel and of its neighbours one column on, one row on, and both");
    /// Smallest and largest value of every tile of every slice.
    TileRanges = D::image("tile_ranges", |s| Shape::Three(s.tile_counts()), |_| Format::Rg16).multibuffered().clear()
        .of(&["smallest", "largest"], SHARE_OF_RANGE);
    /// For each brick, which tiles and slices its samples may touch, and on which side of the sector's border it is.
    BrickTable = D::table(
        "brick_table",
        |s| Shape::Buffer(16 * s.bricks().total() as u32),
        lookup_tables::brick_table,
        By(|a, b| !a.geometry.equals_except_direction(&b.geometry) || a.brick_basis() != b.brick_basis()),
    )
        .of(&["tile_columns", "tile_rows", "slices", "side"], "indices: 4096 first + last; side: 0 outside the sector, 1 across its border, 2 inside");
    /// Smallest and largest value that samples within each brick may have.
    BrickRanges = D::image("brick_ranges", per_brick, |_| Format::Rg16).multibuffered()
        .of(&["smallest", "largest"], SHARE_OF_RANGE);
    /// The kind of each brick for the scene's mode: active, empty or homogeneous.
    BrickKinds = D::image("brick_kinds", per_brick, |_| Format::R8).of(GREY, KIND);
    /// Steps of the distance transform of bricks: the kind of each brick, and its distance to the nearest brick of another kind along x.
    /// `BrickDistancesXy` has the distance within x and y.
    BrickDistancesX = D::image("brick_distances_x", per_brick, |_| Format::R8).of(GREY, KIND);
    BrickDistancesXy = D::image("brick_distances_xy", per_brick, |_| Format::R8).of(GREY, KIND);
    /// The kind of each brick, and its distance to the nearest brick of another kind: for the surface detector. `VolumeBrickDistances` has them for
    /// modes that composite or take the mean.
    SurfaceBrickDistances = D::image("surface_brick_distances", per_brick, |_| Format::R8).of(GREY, KIND);
    VolumeBrickDistances = D::image("volume_brick_distances", per_brick, |_| Format::R8).of(GREY, KIND);
    /// For each entry of the transfer function, the number of entries before it that are not transparent.
    OpaqueBefore = D::table("opaque_before", |s| Shape::Buffer(4 * (s.transfer_entries() as u32 + 1)),
        lookup_tables::opaque_before, ByContent).of(GREY, "entries of the transfer function");
    /// Position in the sweep, in mean distances of slices from slice 0, which is the slice index if slices are equidistant. The abscissa is the
    /// tangent of half the angle of a fan, otherwise mm. The table is the same for both directions of the motor.
    SweepLut = D::table("sweep_lut", entries, lookup_tables::sweep_lut,
        By(|a, b| !a.geometry.equals_except_direction(&b.geometry) || lattice(a) != lattice(b)))
        .of(GREY, "mean distances of slices");
    /// Share (0..1) of a frame's lines that fired before a line, over the position of the line.
    LineLut = D::table("line_lut", entries, lookup_tables::line_lut, By(lattice_differs))
        .of(GREY, "share of the lines of a frame");
    /// Position of every slice, and the motor's travel during its frame.
    SliceTable = D::table("slice_table", |s| Shape::Buffer(8 * s.slices()), lookup_tables::slice_table,
        By(|a, b| a.geometry != b.geometry)).of(&["position", "advance"], "mean distances of slices");
    /// The transfer function: colour and absorption over the sample value.
    Transfer = D::table("transfer", |s| Shape::Buffer(16 * s.transfer_entries() as u32), lookup_tables::transfer_table,
        ByContent).of(ABSORBING, OF_SLICE_PIXEL);
    /// Integrals of the transfer function over the sample value up to each entry: of absorption times colour, and of absorption.
    TransferIntegral = D::table("transfer_integral", |s| Shape::Buffer(16 * s.transfer_entries() as u32),
        lookup_tables::transfer_integral, ByContent).of(ABSORBING, OF_SLICE_PIXEL);
    /// The mean colour and absorption of a step between every two sample values. Whether two scenes differ in it is told by the transfer function,
    /// which is shorter.
    PreIntegrated = D::table("pre_integrated", |s| Shape::Buffer(16 * (s.transfer_entries().pow(2)) as u32),
        lookup_tables::pre_integrated_table, By(|a, b| Slot::Transfer.differs(a, b))).of(ABSORBING, OF_SLICE_PIXEL);
    /// Light and opacity of a complete step between every two sample values, then the transfer function for the incomplete last step of a ray. They
    /// also depend on the length of the step.
    SelfAttenuated = D::table(
        "self_attenuated",
        |s| Shape::Buffer(16 * (s.transfer_entries() * (s.transfer_entries() + 1)) as u32),
        lookup_tables::self_attenuated_table,
        By(|a, b| Slot::Transfer.differs(a, b) || a.optical_step() != b.optical_step()),
    ).of(&["red", "green", "blue", "opacity"], "premultiplied colour and opacity of a step, 0..1");
    /// The tiles of a picture of planes: what each shows, and its lines.
    Tiles = D::vectors("tiles", |s| Shape::Buffer(16 * TILE_VECTORS * s.tile_count()), lookup_tables::tile_table);
    /// The columns of a curved plane: the place of each, and the vector through its slab.
    CurveColumns = D::vectors("curve_columns", curve_columns, lookup_tables::curve_table);
    /// The half-spaces that bound the block of mode cube.
    Block = D::vectors("block", |s| Shape::Buffer(16 * s.block().len() as u32), lookup_tables::block_table);
    /// The light volume: density and echo of the matter in each cell.
    LightMatter = D::image("light_matter", |s| light_level(s, 0), |_| Format::Rg16f)
        .of(&["density", "echo"], "share of the densest matter; share of the range of the recording's samples");
    /// The Gaussian pyramid of the light volume's density. At each level cells have twice the edge of the level before.
    LightPyramid1 = D::image("light_pyramid_1", |s| light_level(s, 1), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid2 = D::image("light_pyramid_2", |s| light_level(s, 2), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid3 = D::image("light_pyramid_3", |s| light_level(s, 3), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid4 = D::image("light_pyramid_4", |s| light_level(s, 4), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid5 = D::image("light_pyramid_5", |s| light_level(s, 5), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid6 = D::image("light_pyramid_6", |s| light_level(s, 6), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid7 = D::image("light_pyramid_7", |s| light_level(s, 7), |_| Format::R16f).of(GREY, DENSITY);
    LightPyramid8 = D::image("light_pyramid_8", |s| light_level(s, 8), |_| Format::R16f).of(GREY, DENSITY);
    /// Light that leaves the last layer of cells that a dispatch lit, towards the next layer of the light volume. Dispatches alternate between
    /// `LightFrontA` and `LightFrontB`.
    LightFrontA = D::image("light_front_a", |s| light_layer(s, false), |_| Format::Rgba32f).of(COLOUR, LIGHT);
    LightFrontB = D::image("light_front_b", |s| light_layer(s, false), |_| Format::Rgba32f).of(COLOUR, LIGHT);
    /// Light that arrives in each cell, and the density of its matter. The passes that scatter it alternate between `LightScattered` and
    /// `LightScatteredB`, so that this one stays.
    LightArriving = D::image("light_arriving", |s| light_level(s, 0), |_| Format::Rgba16f).of(LIT, ARRIVED);
    LightScattered = D::image("light_scattered", |s| light_level(s, 0), |_| Format::Rgba16f).of(LIT, ARRIVED);
    LightScatteredB = D::image("light_scattered_b", |s| light_level(s, 0), |_| Format::Rgba16f).of(LIT, ARRIVED);
    /// Back light, in cells of twice the edge: what leaves the last layer of cells that a dispatch lit. Dispatches alternate between `BackFrontA` and
    /// `BackFrontB`. `BackLight` is the back light that arrives in each of these cells, and the density of its matter.
    BackFrontA = D::image("back_front_a", |s| light_layer(s, true), |_| Format::Rgba32f).of(COLOUR, LIGHT);
    BackFrontB = D::image("back_front_b", |s| light_layer(s, true), |_| Format::Rgba32f).of(COLOUR, LIGHT);
    BackLight = D::image("back_light", |s| light_level(s, 1), |_| Format::Rgba16f).of(LIT, ARRIVED);
    /// In cells of twice the edge: the sum of ambient light, which comes from the side of the probe, and back light (red, green, blue), and the
    /// ambient light alone (alpha).
    LightAmbient = D::image("light_ambient", |s| light_level(s, 1), |_| Format::Rgba16f).of(COLOUR, LIGHT);
    /// Light that white matter in each cell scatters towards the viewer, by colour, and the ambient light that arrives there.
    LightShade = D::image("light_shade", |s| light_level(s, 0), |_| Format::Rgba16f).of(COLOUR, LIGHT);
    /// For each cell the direction towards weaker echoes, whose length (0..1) is its certainty, and the light for a highlight.
    LightNormals = D::image("light_normals", |s| light_level(s, 0), |_| Format::Rgba16f)
        .of(&["x", "y", "z", "highlight"], "direction, as long as it is certain; light");
    /// The medium of a still at the entries of the transfer function: albedo and extinction.
    StillMedium = D::table("still_medium", |s| Shape::Buffer(16 * s.transfer_entries() as u32),
        lookup_tables::still_medium, ByContent)
        .of(&["red", "green", "blue", "extinction"], "albedo of scattering, 0..1; extinction, 1/mm");
    /// The largest extinction of each brick, for stills.
    StillMajorants = D::image("still_majorants", per_brick, |_| Format::R32f).of(GREY, "largest extinction of a brick, 1/mm");
    /// Sums over the paths of each pixel of a still: light and the number of paths that met matter. `StillSquaresA` has the sums of the squares of
    /// the luminances. Dispatches alternate between A and B.
    StillSumsA = D::image("still_sums_a", per_ray, |_| Format::Rgba32f)
        .of(&["red", "green", "blue", "collided"], "light of all paths of a pixel; how many of them collided");
    StillSumsB = D::image("still_sums_b", per_ray, |_| Format::Rgba32f)
        .of(&["red", "green", "blue", "collided"], "light of all paths of a pixel; how many of them collided");
    StillSquaresA = D::image("still_squares_a", per_ray, |_| Format::R32f)
        .of(GREY, "squares of the luminance of all paths of a pixel");
    StillSquaresB = D::image("still_squares_b", per_ray, |_| Format::R32f)
        .of(GREY, "squares of the luminance of all paths of a pixel");
    /// The cut face of a clip plane that each ray meets: its echo, and its opacity (0 without a cut face; rays end at an opacity of 1).
    Cap = D::image("cap", per_ray, |_| Format::Rg16f)
        .of(&["echo", "opacity"], "echo 0..1 after the grey window of planes, where a ray ends at a cut face; opacity, 0..1");
    /// Detector consistent: the two edges of each ray that are most likely its surface.
    Candidates = D::image("candidates", per_ray, |_| Format::Rgba32f)
        .of(&["first", "second", "first_weight", "second_weight"], "mm along the ray, the largest float where there is none; weight, 0..1");
    /// Detector consistent: how much more either candidate costs than no surface, summed along rows and columns from four sides.
    PathsFromLeft = D::image("from_left", per_ray, |_| Format::Rg32f).of(&["first", "second"], COST);
    PathsFromRight = D::image("from_right", per_ray, |_| Format::Rg32f).of(&["first", "second"], COST);
    PathsFromTop = D::image("from_top", per_ray, |_| Format::Rg32f).of(&["first", "second"], COST);
    PathsFromBottom = D::image("from_bottom", per_ray, |_| Format::Rg32f).of(&["first", "second"], COST);
    /// The distance map: the distance along each ray at which it meets a surface, mm; the largest float where it hit nothing.
    Distance = D::image("distance_map", per_ray, |_| Format::R32f).distances();
    DistanceA = D::image("distance_a", per_ray, |_| Format::R32f).distances();
    DistanceB = D::image("distance_b", per_ray, |_| Format::R32f).distances();
    /// For each ray the echo at its surface, 1 where a surface was found, and the mean echo behind it where skin shading needs that.
    Surface = D::image("surface", per_ray, |s| if s.samples_behind() > 0 { Format::Rgba16f } else { Format::Rg16f })
        .of(&["echo", "found", "echo_behind", "unused"], "echo 0..1 after the grey window; found: 0 or 1");
    /// Share (0..1) of the lamp's light that reaches each ray's surface: 1 without a shadow.
    Shadow = D::image("shadow", per_ray, |_| Format::R16f).of(GREY, "share, 0..1");
    /// Share (0..1) of the ambient light that reaches each ray's surface.
    Occlusion = D::image("occlusion", per_ray, |_| Format::R16f).of(GREY, "share, 0..1");
    /// The composited volume that stage 3 lights or shows in front of a surface, or that gives the surface its colour.
    VolumeLayer = D::image("volume_layer", per_ray, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    /// Layout pair: the volume that is shown beside a surface, where `VolumeLayer` holds the surface's colour.
    VolumeBesideSurface = D::image("volume_beside_surface", per_ray, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    /// What stages 2 and 3 render, if the picture is assembled from it. With adaptive supersampling it holds the rays of marked pixels; other texels
    /// keep their old content.
    Rendered = D::image("rendered", per_ray, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    /// Adaptive supersampling: the colour of one ray through the middle of each pixel. `EdgeMarks` is 1 in pixels that have all rays.
    PixelRays = D::image("pixel_rays", per_pixel_of_rendering, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    EdgeMarks = D::image("edge_marks", per_pixel_of_rendering, |_| Format::R8).of(GREY, "1 in pixels that have several rays");
    /// With a tolerance (`ray.tolerance`): the colours of the rays through every other pixel of every other row. `LatticeErrors` has their colours on
    /// the screen and their errors.
    Lattice = D::image("lattice", |s| Shape::Two(tolerance::lattice_size(s)), |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    LatticeErrors = D::image("lattice_errors", |s| Shape::Two(tolerance::lattice_size(s)), |_| Format::Rgba32f)
        .of(&["red", "green", "blue", "error"], "colour and error on the screen, 0..1; no error is certain");
    /// With a tolerance: the estimated error of each pixel, as a share of the screen's range 0..1. It is 0 only where the pixel is certain, for
    /// example because its ray meets only empty bricks.
    PixelErrors = D::image("pixel_errors", per_ray, |_| Format::R32f).of(GREY, "error on the screen, 0..1; 0 is certain");
    /// With a tolerance: two words for each tile of 8 x 8 pixels, with a bit for each pixel that is set if its error is too large. `MarkedBefore` is
    /// the number of such pixels in the tiles before.
    ErrorMarks = D::image("error_marks", |s| Shape::Two(tolerance::tiles(s)), |_| Format::Rg32u)
        .of(&["rows 0 to 3", "rows 4 to 7"], "bits of pixels of a tile");
    MarkedBefore = D::image("marked_before", |s| Shape::Two(tolerance::tiles(s)), |_| Format::R32u).of(GREY, "pixels");
    /// With a tolerance: the number of workgroups along x, y and z for the rays of all marked pixels, and the number of these pixels.
    RefineGroups = D::image("refine_groups", |_| Shape::Two([4, 1]), |_| Format::R32u)
        .of(GREY, "workgroups along x, y, z; pixels");
    /// The planes beside a rendering; black where the picture has the rendering.
    Planes = D::image("planes", |s| Shape::Two(s.tile_area().size), |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    /// The picture of stages 2 and 3 before the filters of stage 4.
    Picture = D::image("picture", per_pixel, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    SmoothPicture = D::image("smooth_picture", per_pixel, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    SmoothPictureB = D::image("smooth_picture_b", per_pixel, |_| Format::Rgba16f).of(COLOUR, "share, 0..1");
    /// AOS on the picture, after the elimination along rows or columns: the result at a pixel is `PictureForward` plus `PictureShares` times the
    /// result at the next pixel.
    PictureShares = D::image("picture_shares", per_pixel, |_| Format::R32f).of(GREY, "share, 0..1");
    PictureForward = D::image("picture_forward", per_pixel, |_| Format::Rgba32f).of(COLOUR, "share, 0..1");
    PictureRows = D::image("picture_rows", per_pixel, |_| Format::Rgba32f).of(COLOUR, "share, 0..1");
    /// The number of the label of each voxel in the box that holds all labels, if the scene shows labels. `LabelCover` is the share of the
    /// surroundings of each of these voxels that has a label.
    Labels = D::image("labels", per_label, |_| Format::R8).by_scene(lookup_tables::label_ids, By(lookup_tables::labels_differ))
        .of(GREY, "number of the label / 255; 0 is none");
    LabelCover = D::image("label_cover", per_label, |_| Format::R8).by_scene(lookup_tables::label_cover, By(lookup_tables::labels_differ))
        .of(GREY, "share of the surroundings of a voxel that has a label, above 0.5 where the voxel has one");
    LabelColours = D::table("label_colours", |_| Shape::Buffer(16 * 256), lookup_tables::label_colours, By(lookup_tables::labels_differ))
        .of(COLOUR, "share, 0..1");
    /// The result before labels are laid over it.
    Unlabelled = D::image("unlabelled", per_pixel, |s| match s.device.window_texels {
        WindowTexels::Deep => Format::Rgba16f,
        _ => Format::Rgba8,
    }).of(COLOUR, "share, 0..1");
    /// The result: 8 bits a channel, or the format of the window.
    Screen = D::image("screen", per_pixel, |s| match s.device.window_texels {
        WindowTexels::Rgba8 => Format::Rgba8,
        WindowTexels::Bgra8 => Format::Bgra8,
        WindowTexels::Deep => Format::Rgba16f,
    }).of(COLOUR, "share, 0..1");
}

/// What look-up tables follow from besides the geometry.
fn lattice(scene: &Scene) -> impl PartialEq + use<> {
    (scene.grid, scene.apron, scene.decimation(), scene.settings.ray.entries)
}

fn lattice_differs(old: &Scene, new: &Scene) -> bool {
    !old.geometry.equals_except_advance(&new.geometry) || lattice(old) != lattice(new)
}

impl Slot {
    const fn descriptor(self) -> &'static Descriptor {
        &DESCRIPTORS[self as usize]
    }

    /// The search by which the CPU computes the content of this slot. None for slots that are filled otherwise.
    pub fn search(self) -> Option<Search> {
        if let Initializer::ByVolume(search) = self.initializer() { Some(search) } else { None }
    }

    pub(crate) fn meaning(self) -> Meaning {
        self.descriptor().meaning
    }

    /// Debug name, which is also the name of the GLSL variable unless a pass binds it under another.
    pub fn name(self) -> &'static str {
        self.descriptor().name
    }

    pub fn shape(self, scene: &Scene) -> Shape {
        (self.descriptor().shape)(scene)
    }

    pub fn format(self, scene: &Scene) -> Format {
        (self.descriptor().format)(scene)
    }

    pub fn initializer(self) -> Initializer {
        self.descriptor().initializer
    }

    /// True if each volume image (of the two or three volumes that are filled and shown in rotation) has its own copy of the slot.
    pub fn is_multibuffered(self) -> bool {
        self.descriptor().is_multibuffered
    }

    /// True if the slot is cleared to 0 when it is made, so that texels that no pass writes are read as 0.
    pub fn starts_clear(self) -> bool {
        self.descriptor().starts_clear
    }

    /// True if several queues use the slot, on devices that have several.
    pub fn crosses_queues(self) -> bool {
        self.descriptor().crosses_queues
    }

    /// True if the CPU computes the slot's content, from the scene or by a search in the volume, and it is not the same for these two scenes. False
    /// for content that passes or frames write.
    pub fn differs(self, old: &Scene, new: &Scene) -> bool {
        match (self.initializer(), self.descriptor().differs) {
            (Initializer::ByScene(make), ByContent) => make(old) != make(new),
            (Initializer::ByScene(_) | Initializer::ByVolume(_), By(differs)) => differs(old, new),
            _ => false,
        }
    }

    /// True for an array of layers.
    pub fn is_layered(self, scene: &Scene) -> bool {
        matches!(self.shape(scene), Shape::Layers(_))
    }

    /// True if the slot has one texel for each texel of the volume. It is false for [`Slot::PackedNeighbours`]. The device stores only the texels
    /// within [`Scene::stored_bounds`].
    pub fn is_volume(self) -> bool {
        let of_rays =
            matches!(self, Slot::Volume | Slot::SharpVolume | Slot::WholeVolume | Slot::Floating | Slot::CutVolume);
        of_rays || matches!(self, Slot::SectionVolume | Slot::SharpSectionVolume)
    }

    /// The volume that rays are cast through: [`Slot::CutVolume`] if cuts or a render start remove parts of the volume, otherwise [`Slot::Volume`].
    pub fn of_rays(scene: &Scene) -> Slot {
        if scene.removes() { Slot::CutVolume } else { Slot::Volume }
    }

    /// The volume that planes are cut from: [`Slot::SectionVolume`] if the scene has it, otherwise the volume before cuts, with its floating parts.
    pub fn of_planes(scene: &Scene) -> Slot {
        match (scene.has_sections(), scene.drops_floating()) {
            (true, _) => Slot::SectionVolume,
            (false, true) => Slot::WholeVolume,
            (false, false) => Slot::Volume,
        }
    }

    /// The texel of the volume (column, row, slice) that is texel (0, 0, 0) of the slot's image. Three zeros for slots without texels of the volume.
    pub fn first_texel(self, scene: &Scene) -> [u32; 3] {
        let is_stored_part = self.is_volume() || self == Slot::PackedNeighbours;
        if is_stored_part { scene.stored_bounds().low } else { [0; 3] }
    }

    /// Size of the slot's array in references and readbacks. For a volume it is the whole volume, not only what the device stores, so that indices
    /// are texel coordinates of the volume.
    pub fn array_size(self, scene: &Scene) -> [usize; 3] {
        if self.is_volume() { scene.volume_size().map(|n| n as usize) } else { self.shape(scene).size() }
    }

    /// Size of the slot in bytes. Of a slot that each volume image has its own copy of, it is the size of one copy.
    pub fn bytes(self, scene: &Scene) -> u64 {
        self.shape(scene).texels() * self.format(scene).texel_bytes() as u64
    }
}

/// The slot that stages 2 (raycast) and 3 (shade) render into: the picture, unless the picture is assembled from what they render
/// ([`Scene::assembles`]).
pub fn rendered(scene: &Scene) -> Slot {
    if scene.assembles() { Slot::Rendered } else { Slot::Picture }
}

/// The slot of the picture in 8 bits: the result itself, unless labels are laid over it.
pub(super) fn toned_slot(scene: &Scene) -> Slot {
    if scene.labels().is_some() { Slot::Unlabelled } else { Slot::Screen }
}

/// The slot of volume-rendered whole rays that are composited next to a surface or give it its colour. It is the volume layer, unless that holds what
/// lies behind the surface.
pub(super) fn composited_beside_surface(scene: &Scene) -> Slot {
    let is_behind = scene.settings.surface.colour == SurfaceColour::Behind;
    if scene.is_pair() && is_behind { Slot::VolumeBesideSurface } else { Slot::VolumeLayer }
}
