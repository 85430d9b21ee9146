//! Slots: the GPU resources that passes read and write. A slot's shape and format follow from the scene; a slot that no pass
//! of a plan names does not exist.

use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::scene::{Scene, VolumeFormat, transfer};
use crate::source::StoredType;

/// Frames that may be on their way into slices at once: layers of the frame array, and slots of the staging ring.
pub const FRAMES_IN_FLIGHT: u32 = 4;
/// Entries of the sweep and line look-up tables. The half tangent is smooth: linear interpolation between 1025 entries is
/// off by h^2/8 times its second derivative, under 1e-6 slices for a sweep of 142 frames over 85 deg.
pub const LUT_ENTRIES: usize = 1025;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Slot {
    /// Arriving frames, one a layer.
    Frames,
    /// (sample, line) of every slice pixel; -1 outside the sector.
    ScanLut,
    /// Slices between filters of stage 1.
    SliceA,
    SliceB,
    /// The volume before smoothing across slices.
    SharpVolume,
    /// The 3D texture that rays are cast through.
    Volume,
    SweepLut,
    LineLut,
    SliceTable,
    Transfer,
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
    /// The lit or composited picture.
    Picture,
    SmoothPicture,
    SmoothPictureB,
    /// 8-bit result.
    Screen,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    Two([u32; 2]),
    Layers([u32; 3]),
    Three([u32; 3]),
    /// Bytes.
    Buffer(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    R8,
    R16,
    R16f,
    R32f,
    Rg16f,
    Rg32f,
    Rgba16f,
    Rgba8,
    /// 32-bit floats of a buffer.
    Floats,
}

impl Format {
    pub fn channels(self) -> usize {
        match self {
            Format::R8 | Format::R16 | Format::R16f | Format::R32f | Format::Floats => 1,
            Format::Rg16f | Format::Rg32f => 2,
            Format::Rgba16f | Format::Rgba8 => 4,
        }
    }

    pub fn channel_bytes(self) -> usize {
        match self {
            Format::R8 | Format::Rgba8 => 1,
            Format::R16 | Format::R16f | Format::Rg16f | Format::Rgba16f => 2,
            Format::R32f | Format::Rg32f | Format::Floats => 4,
        }
    }

    pub fn texel_bytes(self) -> usize {
        self.channels() * self.channel_bytes()
    }
}

impl Shape {
    pub fn texels(self) -> u64 {
        match self {
            Shape::Two([w, h]) => u64::from(w) * u64::from(h),
            Shape::Layers(n) | Shape::Three(n) => n.iter().map(|n| u64::from(*n)).product(),
            Shape::Buffer(bytes) => u64::from(bytes) / 4,
        }
    }

    /// Slices of a 3D image, layers of an array, 1 otherwise: what a barrier tells apart.
    pub fn parts(self) -> u32 {
        match self {
            Shape::Layers(n) | Shape::Three(n) => n[2],
            _ => 1,
        }
    }
}

/// Who writes a slot first.
#[derive(Clone, Copy)]
pub enum Filled {
    ByPasses,
    ByFrames,
    /// Made from the scene by the CPU, in f64, stored as f32.
    ByScene(fn(&Scene) -> Vec<f32>),
}

impl Slot {
    pub const ALL: [Slot; 20] = [
        Slot::Frames,
        Slot::ScanLut,
        Slot::SliceA,
        Slot::SliceB,
        Slot::SharpVolume,
        Slot::Volume,
        Slot::SweepLut,
        Slot::LineLut,
        Slot::SliceTable,
        Slot::Transfer,
        Slot::Distance,
        Slot::DistanceA,
        Slot::DistanceB,
        Slot::Surface,
        Slot::Shadow,
        Slot::Occlusion,
        Slot::Picture,
        Slot::SmoothPicture,
        Slot::SmoothPictureB,
        Slot::Screen,
    ];

    /// Debug name; also the GLSL variable's unless a pass gives an alias.
    pub fn name(self) -> &'static str {
        match self {
            Slot::Frames => "frames",
            Slot::ScanLut => "scan_lut",
            Slot::SliceA => "slice_a",
            Slot::SliceB => "slice_b",
            Slot::SharpVolume => "sharp_volume",
            Slot::Volume => "volume",
            Slot::SweepLut => "sweep_lut",
            Slot::LineLut => "line_lut",
            Slot::SliceTable => "slice_table",
            Slot::Transfer => "transfer",
            Slot::Distance => "distance_map",
            Slot::DistanceA => "distance_a",
            Slot::DistanceB => "distance_b",
            Slot::Surface => "surface",
            Slot::Shadow => "shadow",
            Slot::Occlusion => "occlusion",
            Slot::Picture => "picture",
            Slot::SmoothPicture => "smooth_picture",
            Slot::SmoothPictureB => "smooth_picture_b",
            Slot::Screen => "screen",
        }
    }

    pub fn shape(self, scene: &Scene) -> Shape {
        let [width, height] = scene.frame_size();
        match self {
            Slot::Frames => Shape::Layers([width, height, FRAMES_IN_FLIGHT]),
            Slot::ScanLut | Slot::SliceA | Slot::SliceB => Shape::Two(scene.grid.size),
            Slot::SharpVolume | Slot::Volume => Shape::Three(scene.volume_size()),
            Slot::SweepLut | Slot::LineLut => Shape::Buffer(4 * LUT_ENTRIES as u32),
            Slot::SliceTable => Shape::Buffer(8 * scene.slices()),
            Slot::Transfer => Shape::Buffer(16 * transfer::ENTRIES as u32),
            Slot::Distance | Slot::DistanceA | Slot::DistanceB | Slot::Surface => Shape::Two(scene.picture_size()),
            Slot::Shadow
            | Slot::Occlusion
            | Slot::Picture
            | Slot::SmoothPicture
            | Slot::SmoothPictureB
            | Slot::Screen => Shape::Two(scene.picture_size()),
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
            Slot::SliceA | Slot::SliceB => Format::R32f,
            Slot::SharpVolume | Slot::Volume => match scene.settings.slices.format {
                VolumeFormat::R8 => Format::R8,
                VolumeFormat::R16 => Format::R16,
                VolumeFormat::R16f => Format::R16f,
                VolumeFormat::R32f => Format::R32f,
            },
            Slot::SweepLut | Slot::LineLut | Slot::SliceTable | Slot::Transfer => Format::Floats,
            Slot::Distance | Slot::DistanceA | Slot::DistanceB => Format::R32f,
            Slot::Surface if scene.samples_behind() > 0 => Format::Rgba16f,
            Slot::Surface => Format::Rg16f,
            Slot::Shadow | Slot::Occlusion => Format::R16f,
            Slot::Picture | Slot::SmoothPicture | Slot::SmoothPictureB => Format::Rgba16f,
            Slot::Screen => Format::Rgba8,
        }
    }

    pub fn filled(self) -> Filled {
        match self {
            Slot::Frames => Filled::ByFrames,
            Slot::ScanLut => Filled::ByScene(scan_lut),
            Slot::SweepLut => Filled::ByScene(sweep_lut),
            Slot::LineLut => Filled::ByScene(line_lut),
            Slot::SliceTable => Filled::ByScene(slice_table),
            Slot::Transfer => {
                Filled::ByScene(|s| floats(transfer::table(&s.settings.volume.transfer).iter().flatten().copied()))
            }
            _ => Filled::ByPasses,
        }
    }

    /// Whether each of the volume images that take turns has its own.
    pub fn takes_turns(self) -> bool {
        matches!(self, Slot::SharpVolume | Slot::Volume)
    }

    /// Written and read by different queues where the device has several: created CONCURRENT then.
    pub fn crosses_queues(self) -> bool {
        matches!(self, Slot::Frames | Slot::SharpVolume | Slot::Volume)
    }

    pub fn bytes(self, scene: &Scene) -> u64 {
        self.shape(scene).texels() * self.format(scene).texel_bytes() as u64
    }
}

fn floats(values: impl IntoIterator<Item = f64>) -> Vec<f32> {
    values.into_iter().map(|v| v as f32).collect()
}

/// (sample, line) of every slice pixel in f32, -1 where the pixel is left out. With an apron of 0 the PLUS toolkit's rule
/// holds: both neighbours must exist in both directions, so the last sample and line themselves are out.
pub fn scan_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let [width, height] = scene.grid.size;
    let mut lut = Vec::with_capacity(2 * width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let (x, y) = scene.grid.place(f64::from(column), f64::from(row));
            let (sample, line) = scan_index(scene, probe, x, y).unwrap_or((-1.0, -1.0));
            lut.extend([sample as f32, line as f32]);
        }
    }
    lut
}

/// Fractional (sample, line) that a slice pixel at in-plane (x, y) shows, or none.
pub fn scan_index(scene: &Scene, probe: &Probe, x: f64, y: f64) -> Option<(f64, f64)> {
    let (sample, line) = probe.plane_indices(x, y);
    let (last_sample, last_line) = ((probe.samples - 1) as f64, (probe.lines.len() - 1) as f64);
    if scene.apron <= 0.0 {
        let inside = sample >= 0.0 && sample < last_sample && line >= 0.0 && line < last_line;
        return inside.then_some((sample, line));
    }
    let (near_sample, near_line) = (sample.clamp(0.0, last_sample), line.clamp(0.0, last_line));
    let (near_x, near_y) = probe.plane_point(near_sample, near_line);
    let [px, py] = scene.grid.pitch;
    let away = ((x - near_x) / px).hypot((y - near_y) / py);
    (away <= scene.apron).then_some((near_sample, near_line))
}

/// The parameter that the sweep look-up table is entered by: the tangent of half the angle about the wobble axis, or mm.
pub fn sweep_parameter(motion: Motion, position: f64) -> f64 {
    match motion {
        Motion::Fan { .. } => (position / 2.0).tan(),
        _ => position,
    }
}

fn sweep_position(motion: Motion, parameter: f64) -> f64 {
    match motion {
        Motion::Fan { .. } => 2.0 * parameter.atan(),
        _ => parameter,
    }
}

/// The parameter that the line look-up table is entered by: the tangent of half the in-plane angle, or mm.
pub fn line_parameter(array: Array, position: f64) -> f64 {
    match array {
        Array::Curved { .. } => (position / 2.0).tan(),
        Array::Linear => position,
    }
}

/// Lowest and highest parameter of the sweep table.
pub fn sweep_span(probe: &Probe) -> (f64, f64) {
    let (first, last) = probe.slice_bounds();
    (sweep_parameter(probe.motion, first), sweep_parameter(probe.motion, last))
}

/// Slice position in mean pitches from slice 0, over the sweep's parameter: the slice index itself for an even sweep.
fn sweep_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let (low, high) = sweep_span(probe);
    floats((0..LUT_ENTRIES).map(|i| {
        let parameter = low + (high - low) * i as f64 / (LUT_ENTRIES - 1) as f64;
        (sweep_position(probe.motion, parameter) - probe.slices.first()) / probe.slices.pitch()
    }))
}

/// Share of a frame's lines that fired before the line at each parameter.
fn line_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let low = line_parameter(probe.array, probe.lines.first());
    let high = line_parameter(probe.array, probe.lines.last());
    floats((0..LUT_ENTRIES).map(|i| {
        let parameter = low + (high - low) * i as f64 / (LUT_ENTRIES - 1) as f64;
        let position = match probe.array {
            Array::Curved { .. } => 2.0 * parameter.atan(),
            Array::Linear => parameter,
        };
        probe.lines.index_of(position) / probe.lines.len() as f64
    }))
}

/// Position and advance of every slice, in mean pitches from slice 0.
fn slice_table(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let pitch = probe.slices.pitch();
    floats((0..probe.slices.len()).flat_map(|k| {
        let advance = match &probe.advance {
            Advance::None => 0.0,
            Advance::Same(a) => *a,
            Advance::Each(table) => table.get(k).copied().unwrap_or(0.0),
        };
        [(probe.slices.at(k as f64) - probe.slices.first()) / pitch, advance / pitch]
    }))
}

/// Whether slices lie unevenly or were taken in mixed directions, so that a slice is found by bracketing.
pub fn is_uneven(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Sweep(p) => matches!(p.slices, Axis::Table(_)) || matches!(p.advance, Advance::Each(_)),
        Geometry::Cartesian(_) => false,
    }
}
