//! Slots: the GPU resources that passes read and write. A slot's shape and format follow from the scene; a slot that no pass
//! of a plan names does not exist.

pub use super::format::{Format, Shape};
use super::{empty_space, lookup_tables};
use crate::scene::planes::TILE_VECTORS;
use crate::scene::{Scene, VolumeFormat, transfer};
use crate::source::StoredType;

/// Frames that may be on their way into slices at once: layers of the frame array, and slots of the staging ring.
pub const FRAMES_IN_FLIGHT: u32 = 4;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Slot {
    /// Arriving frames, one a layer.
    Frames,
    /// Gain of every sample of a line.
    Tgc,
    /// The frame after line conditioning: decimated samples x lines.
    Conditioned,
    /// (sample, line) of every slice pixel on the lattice that is scan-converted; -1 outside the sector.
    ScanLut,
    /// Slices between filters of stage 1.
    SliceA,
    SliceB,
    /// How many rings the window of the enhanced sigma filter grew, at each pixel of the last slice.
    Growth,
    /// Of a slice's rows or columns under elimination: u = forward + shares u of the next pixel.
    SliceShares,
    SliceForward,
    /// A slice diffused along its rows.
    SliceRows,
    /// The volume before smoothing across slices.
    SharpVolume,
    /// The 3D texture that rays are cast through.
    Volume,
    /// Each texel of it with its neighbours one column and one row on, as their bits.
    Quads,
    /// Smallest and largest value of every tile of every slice.
    TileRanges,
    /// What each brick looks at of the tiles, and where it lies to the sector.
    BrickTable,
    /// Smallest and largest value that samples within each brick may have.
    BrickRanges,
    /// What each brick is to a mode.
    BrickKinds,
    /// The same with the distance to the nearest brick of another kind along x, and within x and y.
    LeapsX,
    LeapsXy,
    /// The same in space: for the surface detector, and for the mode that composites or takes the mean.
    SurfaceLeaps,
    VolumeLeaps,
    /// Entries of the transfer function that are not transparent, before each.
    OpaqueBefore,
    SweepLut,
    LineLut,
    SliceTable,
    Transfer,
    /// The transfer function between every two sample values.
    PreIntegrated,
    /// The tiles of a picture of planes: what each shows, and its lines.
    Tiles,
    /// The half-spaces that bound the block of mode cube.
    Block,
    /// Distance along each pixel's ray, mm; the largest float where nothing was hit.
    Distance,
    DistanceA,
    DistanceB,
    /// Echo at the surface, 1 where a surface was found, and the mean echo behind it where the skin look wants it.
    Surface,
    /// Light that arrives at each pixel's surface, 0..1.
    Shadow,
    /// Ambient light that arrives, 0..1.
    Occlusion,
    /// The composited volume, where stage 3 lights it or lays it over a surface.
    Veil,
    /// What stages 2 and 3 rendered, where it becomes the picture only by averaging or beside planes.
    Rendered,
    /// The planes of a 4-up picture; black where the rendering goes.
    Planes,
    /// The picture of stages 2 and 3 before the filters of stage 4.
    Picture,
    SmoothPicture,
    SmoothPictureB,
    /// As of slices: elimination of the picture's rows or columns.
    PictureShares,
    PictureForward,
    PictureRows,
    /// 8-bit result.
    Screen,
}

/// Who writes a slot first.
#[derive(Clone, Copy)]
pub enum Initializer {
    ByPasses,
    ByFrames,
    /// Made from the scene by the CPU, in f64, stored as f32.
    ByScene(fn(&Scene) -> Vec<f32>),
}

impl Slot {
    pub const ALL: &'static [Slot] = &[
        Slot::Frames,
        Slot::Tgc,
        Slot::Conditioned,
        Slot::ScanLut,
        Slot::SliceA,
        Slot::SliceB,
        Slot::Growth,
        Slot::SliceShares,
        Slot::SliceForward,
        Slot::SliceRows,
        Slot::SharpVolume,
        Slot::Volume,
        Slot::Quads,
        Slot::TileRanges,
        Slot::BrickTable,
        Slot::BrickRanges,
        Slot::BrickKinds,
        Slot::LeapsX,
        Slot::LeapsXy,
        Slot::SurfaceLeaps,
        Slot::VolumeLeaps,
        Slot::OpaqueBefore,
        Slot::SweepLut,
        Slot::LineLut,
        Slot::SliceTable,
        Slot::Transfer,
        Slot::PreIntegrated,
        Slot::Tiles,
        Slot::Block,
        Slot::Distance,
        Slot::DistanceA,
        Slot::DistanceB,
        Slot::Surface,
        Slot::Shadow,
        Slot::Occlusion,
        Slot::Veil,
        Slot::Rendered,
        Slot::Planes,
        Slot::Picture,
        Slot::SmoothPicture,
        Slot::SmoothPictureB,
        Slot::PictureShares,
        Slot::PictureForward,
        Slot::PictureRows,
        Slot::Screen,
    ];

    /// Debug name; also the GLSL variable's unless a pass gives an alias.
    pub fn name(self) -> &'static str {
        match self {
            Slot::Frames => "frames",
            Slot::Tgc => "tgc",
            Slot::Conditioned => "conditioned",
            Slot::ScanLut => "scan_lut",
            Slot::SliceA => "slice_a",
            Slot::SliceB => "slice_b",
            Slot::Growth => "growth",
            Slot::SliceShares => "slice_shares",
            Slot::SliceForward => "slice_forward",
            Slot::SliceRows => "slice_rows",
            Slot::SharpVolume => "sharp_volume",
            Slot::Volume => "volume",
            Slot::Quads => "quads",
            Slot::TileRanges => "tile_ranges",
            Slot::BrickTable => "brick_table",
            Slot::BrickRanges => "brick_ranges",
            Slot::BrickKinds => "brick_kinds",
            Slot::LeapsX => "leaps_x",
            Slot::LeapsXy => "leaps_xy",
            Slot::SurfaceLeaps => "surface_leaps",
            Slot::VolumeLeaps => "volume_leaps",
            Slot::OpaqueBefore => "opaque_before",
            Slot::SweepLut => "sweep_lut",
            Slot::LineLut => "line_lut",
            Slot::SliceTable => "slice_table",
            Slot::Transfer => "transfer",
            Slot::PreIntegrated => "pre_integrated",
            Slot::Tiles => "tiles",
            Slot::Block => "block",
            Slot::Distance => "distance_map",
            Slot::DistanceA => "distance_a",
            Slot::DistanceB => "distance_b",
            Slot::Surface => "surface",
            Slot::Shadow => "shadow",
            Slot::Occlusion => "occlusion",
            Slot::Veil => "veil",
            Slot::Rendered => "rendered",
            Slot::Planes => "planes",
            Slot::Picture => "picture",
            Slot::SmoothPicture => "smooth_picture",
            Slot::SmoothPictureB => "smooth_picture_b",
            Slot::PictureShares => "picture_shares",
            Slot::PictureForward => "picture_forward",
            Slot::PictureRows => "picture_rows",
            Slot::Screen => "screen",
        }
    }

    pub fn shape(self, scene: &Scene) -> Shape {
        let [width, height] = scene.frame_size();
        match self {
            Slot::Frames => Shape::Layers([width, height, FRAMES_IN_FLIGHT]),
            Slot::Tgc => Shape::Buffer(4 * width),
            Slot::Conditioned => Shape::Two(scene.line_lattice()),
            Slot::ScanLut | Slot::SliceA | Slot::SliceB => Shape::Two(scene.grid.size),
            Slot::Growth | Slot::SliceShares | Slot::SliceForward | Slot::SliceRows => Shape::Two(scene.grid.size),
            Slot::SharpVolume | Slot::Volume | Slot::Quads => Shape::Three(scene.volume_size()),
            Slot::TileRanges => Shape::Three(scene.tile_counts()),
            Slot::BrickTable => Shape::Buffer(16 * scene.bricks().total() as u32),
            Slot::BrickRanges | Slot::BrickKinds | Slot::LeapsX | Slot::LeapsXy => Shape::Three(scene.bricks().count),
            Slot::SurfaceLeaps | Slot::VolumeLeaps => Shape::Three(scene.bricks().count),
            Slot::OpaqueBefore => Shape::Buffer(4 * (transfer::ENTRIES as u32 + 1)),
            Slot::SweepLut | Slot::LineLut => Shape::Buffer(4 * scene.settings.ray.entries),
            Slot::SliceTable => Shape::Buffer(8 * scene.slices()),
            Slot::Transfer => Shape::Buffer(16 * transfer::ENTRIES as u32),
            Slot::PreIntegrated => Shape::Buffer(16 * (transfer::ENTRIES * transfer::ENTRIES) as u32),
            Slot::Tiles => Shape::Buffer(16 * TILE_VECTORS * scene.tile_count()),
            Slot::Block => Shape::Buffer(16 * scene.block().len() as u32),
            Slot::Distance | Slot::DistanceA | Slot::DistanceB | Slot::Surface => Shape::Two(scene.ray_size()),
            Slot::Shadow | Slot::Occlusion | Slot::Veil | Slot::Rendered => Shape::Two(scene.ray_size()),
            Slot::PictureShares | Slot::PictureForward | Slot::PictureRows => Shape::Two(scene.picture_size()),
            Slot::Planes | Slot::Picture | Slot::SmoothPicture | Slot::SmoothPictureB | Slot::Screen => {
                Shape::Two(scene.picture_size())
            }
        }
    }

    pub fn format(self, scene: &Scene) -> Format {
        match self {
            Slot::Frames => match scene.input.stored {
                StoredType::U8 => Format::R8,
                StoredType::U16 => Format::R16,
                StoredType::F32 => Format::R32f,
            },
            Slot::ScanLut => Format::Rg32f,
            Slot::Conditioned | Slot::SliceA | Slot::SliceB | Slot::Growth => Format::R32f,
            Slot::SliceShares | Slot::SliceForward | Slot::SliceRows | Slot::PictureShares => Format::R32f,
            Slot::PictureForward | Slot::PictureRows => Format::Rgba32f,
            Slot::SharpVolume | Slot::Volume => match scene.settings.slices.format {
                VolumeFormat::R8 => Format::R8,
                VolumeFormat::R16 => Format::R16,
                VolumeFormat::R16f => Format::R16f,
                VolumeFormat::R32f => Format::R32f,
            },
            Slot::Quads if scene.settings.slices.format == VolumeFormat::R8 => Format::R32u,
            Slot::Quads => Format::Rg32u,
            Slot::Tgc | Slot::SweepLut | Slot::LineLut | Slot::SliceTable | Slot::Transfer | Slot::PreIntegrated => {
                Format::Floats
            }
            Slot::Tiles | Slot::Block | Slot::BrickTable | Slot::OpaqueBefore => Format::Floats,
            Slot::TileRanges | Slot::BrickRanges => Format::Rg16,
            Slot::BrickKinds | Slot::LeapsX | Slot::LeapsXy | Slot::SurfaceLeaps | Slot::VolumeLeaps => Format::R8,
            Slot::Distance | Slot::DistanceA | Slot::DistanceB => Format::R32f,
            Slot::Surface if scene.samples_behind() > 0 => Format::Rgba16f,
            Slot::Surface => Format::Rg16f,
            Slot::Shadow | Slot::Occlusion => Format::R16f,
            Slot::Veil | Slot::Rendered | Slot::Planes => Format::Rgba16f,
            Slot::Picture | Slot::SmoothPicture | Slot::SmoothPictureB => Format::Rgba16f,
            Slot::Screen => Format::Rgba8,
        }
    }

    pub fn filled(self) -> Initializer {
        match self {
            Slot::Frames => Initializer::ByFrames,
            Slot::Tgc => Initializer::ByScene(lookup_tables::tgc),
            Slot::ScanLut => Initializer::ByScene(lookup_tables::scan_lut),
            Slot::BrickTable => Initializer::ByScene(empty_space::table),
            Slot::OpaqueBefore => Initializer::ByScene(lookup_tables::opaque_before),
            Slot::SweepLut => Initializer::ByScene(lookup_tables::sweep_lut),
            Slot::LineLut => Initializer::ByScene(lookup_tables::line_lut),
            Slot::SliceTable => Initializer::ByScene(lookup_tables::slice_table),
            Slot::Transfer => Initializer::ByScene(lookup_tables::transfer_table),
            Slot::PreIntegrated => Initializer::ByScene(lookup_tables::pre_integrated_table),
            Slot::Tiles => Initializer::ByScene(lookup_tables::tile_table),
            Slot::Block => Initializer::ByScene(lookup_tables::block_table),
            _ => Initializer::ByPasses,
        }
    }

    /// Whether each of the volume images that take turns has its own.
    pub fn is_multibuffered(self) -> bool {
        matches!(self, Slot::SharpVolume | Slot::Volume | Slot::Quads | Slot::TileRanges | Slot::BrickRanges)
    }

    /// Whether texels that no pass writes are read as 0: those of slices outside the sector.
    pub fn starts_clear(self) -> bool {
        matches!(self, Slot::SliceA | Slot::SliceB | Slot::SharpVolume | Slot::Volume)
    }

    /// Used by different queues where the device has several, and created CONCURRENT then: all that stage 1 works on, since what is
    /// new is cleared and filled where pictures are made.
    pub fn crosses_queues(self) -> bool {
        matches!(
            self,
            Slot::Frames
                | Slot::Conditioned
                | Slot::ScanLut
                | Slot::SliceA
                | Slot::SliceB
                | Slot::Growth
                | Slot::SliceShares
                | Slot::SliceForward
                | Slot::SliceRows
                | Slot::SharpVolume
                | Slot::Volume
        )
    }

    pub fn bytes(self, scene: &Scene) -> u64 {
        self.shape(scene).texels() * self.format(scene).texel_bytes() as u64
    }
}
