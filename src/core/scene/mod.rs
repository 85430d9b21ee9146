//! The scene: everything that determines a picture. It combines the geometry of the probe, the type of the samples and the user's
//! [`Settings`], checked and resolved to the values that the passes need. Pure data, no Vulkan.

mod areas;
mod bricks;
pub mod camera;
mod caps;
mod check;
mod check_measures;
pub mod cube;
pub mod curve;
pub mod cuts;
pub mod default_look;
mod echo_levels;
mod file_version;
mod floating;
mod labels;
mod light_lattice;
pub mod load;
pub mod look;
pub mod marks;
mod needs;
mod number;
pub mod picker;
pub mod planes;
mod region;
mod sampling;
pub mod self_attenuation;
pub mod settings;
mod sizes;
mod slice_index;
mod smoothing;
pub mod start_curve;
mod still;
#[cfg(test)]
pub(crate) mod test_block;
pub mod transfer;
mod turntable;
pub mod unveil;
pub mod variants;
mod views;
pub mod visible_bounds;

pub use bricks::{Bricks, Reach, Side, TILE};
pub use camera::Rays;
pub use echo_levels::{EchoHistogram, EchoLevels};
pub use file_version::FileVersion;
pub use labels::{LabelVolume, SharedLabels};
pub use light_lattice::{AmbientCones, LightLattice, Propagation};
pub use marks::VolumeAxis;
pub use number::{Group, Number, Slider, start_depths};
pub use region::{depth_offset, insonified_box};
pub use settings::*;
pub(crate) use smoothing::gaussian_radius;
pub use still::{DistantLight, StillLights};
pub use views::View;
pub(crate) use views::windowed;
pub use visible_bounds::{Rectangle, Shared, VisibleBounds};

use crate::probe::{Geometry, Probe, StoredType};
use crate::tree::{All, Defaults, FromNode, Name, ToNode};
use glam::DVec3;
use region::{framed_low, is_still, slice_grid, visible_box};
use sizes::{Pitches, ResolvedSize, Resolver};

/// Maximum width and height of a picture, pixels.
pub const MAX_PICTURE: u32 = 16384;
/// Maximum standard deviation of a Gaussian, pixels: it has 193 taps.
pub const MAX_DEVIATION: f64 = 32.0;
/// Maximum edge of a filter's window, pixels.
pub const MAX_WINDOW: u32 = 63;

/// Maximum number of samples on a ray.
const MAX_SAMPLES: f64 = 65536.0;

/// Maximum number of clip planes.
pub const MAX_CLIPS: usize = 4;

/// Type and value range of the samples of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    pub stored: StoredType,
    /// The stored sample values that become 0 and 1.
    pub range: [f64; 2],
}

impl Input {
    /// The same samples with the range of the setting `samples.range`, if it is set. `shift`: what was added to signed samples to store them as
    /// unsigned ([`SampleType::shift`](crate::probe::SampleType::shift)); the setting does not contain it.
    pub fn in_range_of(self, settings: &Settings, shift: f64) -> Input {
        let asked = settings.samples.range.map(|range| range.map(|value| value + shift));
        Input { range: asked.unwrap_or(self.range), ..self }
    }
}

/// The pixel grid of a slice. The centre of pixel (0, 0) lies at `origin`, pixels are `pitch` apart; (x, y) in the plane of the slice, mm: x lateral,
/// y depth from the apex of a curved array or the face of a linear one. A Cartesian volume has them as in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceGrid {
    pub size: [u32; 2],
    pub origin: [f64; 2],
    pub pitch: [f64; 2],
}

impl SliceGrid {
    pub fn place(&self, column: f64, row: f64) -> (f64, f64) {
        (self.origin[0] + column * self.pitch[0], self.origin[1] + row * self.pitch[1])
    }
}

/// The ring of samples that the surface detector compares at a place: two halves, each as long as an edge (`surface.edge`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Distance between two samples of the ring, mm.
    pub step: f64,
    /// Number of samples in each half, 4..=256.
    pub half: u32,
    /// Number of samples after the crossing of the threshold among which the detector looks for the largest difference.
    pub follow: u32,
}

impl Ring {
    pub fn new(edge: Edge, step: f64, threshold: f64) -> Ring {
        let (step, half) = match edge {
            Edge::Named(EdgeName::Samples) => (step, 4),
            Edge::Length(length) => {
                let half = Ring::half_of(length, step);
                (length / f64::from(half), half)
            }
        };
        // An edge with the shape of an error function and a height A peaks at most 0.242 A/threshold halves behind its crossing.
        let follow = f64::from(half) * (0.25 / threshold).clamp(1.0, 16.0);
        // One more, as the crossing lies up to a step in front of the sample that exceeds the threshold.
        Ring { step, half, follow: follow.ceil() as u32 + 1 }
    }

    fn half_of(length: f64, step: f64) -> u32 {
        // The slack is that of rounding: 1.6 mm are four steps of 0.4 mm.
        (length / step - 1e-9).ceil().clamp(4.0, 256.0) as u32
    }

    /// Number of samples in each half for rays with another step, mm, and the same length of an edge.
    pub fn half_at(self, step: f64) -> u32 {
        Ring::half_of(self.step * f64::from(self.half), step)
    }

    /// Number of samples of the whole ring (n of thesis 4-3).
    pub fn samples(self) -> u32 {
        2 * self.half
    }
}

/// The pixel formats of a window. A picture in the window's format is copied to it without a conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WindowTexels {
    #[default]
    Rgba8,
    Bgra8,
    /// More than 8 bits a channel: the picture has 16-bit floats.
    Deep,
}

/// How pictures reach the screen: the present mode of the swapchain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, All, FromNode, Name, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum PresentMode {
    /// Each picture waits for a refresh of the monitor, without tearing.
    #[default]
    Fifo,
    /// The newest picture at each refresh, if the driver supports it: less latency, but some pictures are never presented.
    Mailbox,
}

impl std::str::FromStr for PresentMode {
    type Err = String;

    fn from_str(text: &str) -> Result<PresentMode, String> {
        let named = PresentMode::ALL.into_iter().find(|mode| mode.name() == text);
        named.ok_or_else(|| format!("must be {}", PresentMode::ALL.map(PresentMode::name).join(" or ")))
    }
}

/// What a scene takes from the device that draws it. The default is that of no device: a CPU without limits.
#[derive(Clone, Copy, Debug, PartialEq, Defaults)]
pub struct DeviceFacts {
    /// Pixel format of the picture: that of the window, so that no conversion is needed.
    pub window_texels: WindowTexels,
    /// Bytes of shared memory of a workgroup on a GPU, which AOS, the light volume and filters use. 0 on a CPU, where single invocations are faster.
    pub shared_memory: u32,
    /// Largest number of invocations of a workgroup.
    #[value(u32::MAX)]
    pub invocations: u32,
    /// True if the device truncates half-precision floats when it stores them, instead of rounding.
    pub truncates_halves: bool,
    /// Maximum number of frames that go through stage 1 at once, at least 1.
    #[value(u32::MAX)]
    pub frames_at_once: u32,
}

#[derive(Clone, Debug)]
pub struct Scene {
    pub geometry: Geometry,
    pub input: Input,
    pub settings: Settings,
    pub grid: SliceGrid,
    /// Corners of the rendered box, mm in space: the part of the insonified region's bounds within the region of interest.
    pub low: DVec3,
    pub high: DVec3,
    pub rays: Rays,
    /// Distance between samples along a ray, mm; the shortest one if steps grow along it (`ray.spread`).
    pub step: f64,
    /// The ring of the surface detector, whose own step divides the length of an edge evenly.
    pub ring: Ring,
    /// True if skipping bricks saves time on the device, which decides where `ray.brick` is not set. True until [`Scene::sampled`] sets it.
    pub bricks_pay: bool,
    /// What the renderer says of its device.
    pub device: DeviceFacts,
    /// How the volume is sampled: the setting `ray.sampling`, or for `Auto` what [`Scene::sampled`] chose.
    pub sampling: Sampling,
    /// Margin around the sector, pixels of a slice, in which pixels take the nearest sample of the sector: as wide as the filters reach. 0 is the
    /// strict rule of the PLUS toolkit, which keeps a pixel only if all four neighbours exist.
    pub apron: f64,
    /// Conditioning of lines, with sizes converted from mm to samples.
    pub conditioning: Conditioning,
    /// Filters of slices, with sizes converted from mm to slice pixels. The Gaussian keeps mm along lateral and depth, and has slices across them.
    pub slice_filters: Slices,
    /// The Gaussian of the section volume, in the units of the one in `slice_filters`. None if planes have no volume of their own.
    pub section_smooth: Option<Smooth>,
    /// Filters of the distance map, with sizes converted from mm to rays.
    pub distance: Distance,
    /// How sizes in mm were converted, for `--explain`.
    pub resolved_sizes: Vec<ResolvedSize>,
    /// How defaults were found, one line each, for `--explain`.
    pub found: Vec<String>,
    /// The texels of the volume that stage 2 may read. Stage 1 computes no others.
    pub visible_bounds: visible_bounds::VisibleBounds,
    /// Texels that the renderer stores although this scene does not need them, because an earlier scene did ([`Scene::keeping`]).
    pub kept_bounds: visible_bounds::VisibleBounds,
    /// What stage 1 must serve beyond this scene ([`Scene::sharing`]). None if no other scene draws the same volume.
    pub shared: Option<Shared>,
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("scene: {field}: {fault}")]
pub struct SceneError {
    pub field: &'static str,
    pub fault: String,
}

pub fn refuse<T>(field: &'static str, fault: impl Into<String>) -> Result<T, SceneError> {
    Err(SceneError { field, fault: fault.into() })
}

impl Settings {
    /// Checks settings as far as no geometry is needed.
    ///
    /// # Errors
    /// Names the first setting that is invalid for every geometry, and its limits.
    pub fn check(&self) -> Result<(), SceneError> {
        numbers().try_for_each(|number| number.check(self))?;
        check::check(self)?;
        check_measures::check_measures(&self.drawn.measure)?;
        still::check(self)?;
        cuts::check(&self.cuts)?;
        start_curve::check(self)?;
        check::check_planes(&self.planes)
    }
}

impl Scene {
    /// Checks the settings against the geometry and resolves them.
    ///
    /// # Errors
    /// Names the first setting that cannot be rendered, and its limits.
    pub fn new(geometry: Geometry, input: Input, settings: Settings) -> Result<Scene, SceneError> {
        let checked = match &geometry {
            Geometry::Sweep(probe) => probe.check(),
            Geometry::Cartesian(grid) => grid.check(),
        };
        checked.map_err(|e| SceneError { field: e.field, fault: e.fault })?;
        settings.check()?;
        check::check_conditioning(&settings.conditioning, &geometry)?;
        let [low, high] = input.range;
        if !(low.is_finite() && high.is_finite() && low < high) {
            return refuse("samples.range", format!("[{low}, {high}] must be finite and rise"));
        }
        let grid = slice_grid(&geometry, settings.slices.pixels);
        let (low, high) = visible_box(&geometry, &settings)?;
        let framed = framed_low(&geometry, &settings, low, high)?;
        let rays = camera::rays(&settings, framed, high, depth_offset(&geometry), is_still(&geometry));
        let pixel = grid.pitch[0].min(grid.pitch[1]);
        let side = match &geometry {
            Geometry::Cartesian(volume) => pixel.min(volume.spacing[2]),
            Geometry::Sweep(_) => pixel,
        };
        let largest = settings.ray.samples_per_voxel.map_or(f64::INFINITY, |n| side / f64::from(n));
        let longest = (high - low).length();
        // A step that nobody chose is as long as it has to be: no default makes a scene that is refused.
        let least = longest / MAX_SAMPLES;
        let step = settings.ray.step.unwrap_or(pixel.max(least)).min(largest);
        let edge = settings.surface.edge.unwrap_or(Edge::Length(4.0 * pixel.max(least)));
        let ring = Ring::new(edge, step, settings.surface.threshold);
        // The slack is that of rounding.
        let too_many = |step: f64| longest / step > MAX_SAMPLES * (1.0 + 1e-9);
        if too_many(step) {
            let (key, value) = match settings.ray.samples_per_voxel.filter(|_| step == largest) {
                Some(n) => ("ray.samples_per_voxel", format!("{n} are a step of {step} mm, which")),
                None => ("ray.step", format!("{step} mm")),
            };
            return refuse(
                key,
                format!("{value} makes {:.0} samples on a ray, at most {MAX_SAMPLES}", (longest / step).ceil()),
            );
        }
        if too_many(ring.step) && matches!(settings.mode, Mode::Surface | Mode::Mixed) {
            return refuse(
                "surface.edge",
                format!(
                    "4 steps of {} mm make {:.0} samples on a ray, at most {MAX_SAMPLES}",
                    ring.step,
                    (longest / ring.step).ceil()
                ),
            );
        }
        let is_longer = settings.ray.step.is_none() && step > pixel;
        let longer = is_longer.then(|| format!("ray.step: {step} mm: {MAX_SAMPLES} are the most samples of a ray"));
        let sampling = settings.ray.sampling;
        let pitches = Pitches::new(&geometry, &grid, &rays, settings.ray.subsampling, (low + high) / 2.0);
        let mut resolver = Resolver { pitches, resolved: Vec::new() };
        let conditioning = resolver.conditioning(&settings.conditioning);
        let slice_filters = resolver.slices(&settings.slices);
        let has_planes = settings.layout.has_planes();
        let section_smooth = settings.planes.smooth.filter(|_| has_planes);
        let section_smooth = section_smooth.map(|smooth| resolver.smooth("planes.smooth.elevation_mm", smooth));
        let halvings = settings.ray.subsampling.ilog2();
        let distance = (0..halvings).fold(resolver.distance(&settings.distance), |distance, _| distance.halved());
        let mut scene = Scene {
            geometry,
            input,
            settings,
            grid,
            low,
            high,
            rays,
            step,
            ring,
            bricks_pay: true,
            device: DeviceFacts::default(),
            sampling,
            apron: 0.0,
            conditioning,
            slice_filters,
            section_smooth,
            distance,
            resolved_sizes: resolver.resolved,
            found: Vec::from_iter(longer),
            visible_bounds: VisibleBounds::default(),
            kept_bounds: VisibleBounds::default(),
            shared: None,
        };
        let deviations = [
            (["slices.smooth.lateral", "slices.smooth.depth", "slices.smooth.elevation"], scene.smoothing()),
            (["planes.smooth.lateral", "planes.smooth.depth", "planes.smooth.elevation"], scene.section_smoothing()),
        ];
        let mut each = deviations.into_iter().flat_map(|(fields, of)| fields.into_iter().zip(of)).enumerate();
        if let Some((n, (field, deviation))) = each.find(|(_, (_, deviation))| *deviation > MAX_DEVIATION) {
            let axis = n % 3;
            let unit = if axis < 2 { "slice pixels" } else { "slices" };
            return refuse(field, format!("is {deviation:.1} {unit}, at most {MAX_DEVIATION} can be filtered"));
        }
        if scene.settings.volume.compositing == Compositing::Exponential && scene.composites() && scene.spreads() {
            return refuse(
                "ray.spread",
                "makes steps of different lengths, and volume.compositing=exponential takes one: set ray.spread=0, or another compositing",
            );
        }
        let is_behind = scene.settings.surface.colour == SurfaceColour::Behind;
        if scene.is_pair() && is_behind && scene.marches_once().is_err() {
            return refuse(
                "surface.colour",
                "'behind' in layout pair needs the volume of the surface's own march: set volume.compositing=corrected, ray.spread=0 and \
                 the same start depth of volume and surface, or another colour",
            );
        }
        scene.apron = 2.0 + scene.filter_reach();
        floating::check_floating(&scene)?;
        cuts::check_drawn(&scene)?;
        check::check_planes_resolved(&scene)?;
        scene.visible_bounds = visible_bounds::of(&scene);
        Ok(scene)
    }

    /// The origin of the coordinates that shaders compute with, mm in space ("relative to center", Ohlarik 2008): the centre of the
    /// rendered box of a Cartesian volume, which may lie anywhere. A sweep's own origin, which its inverse map needs, is on its probe.
    pub(crate) fn local_origin(&self) -> DVec3 {
        match self.geometry {
            Geometry::Cartesian(_) => (self.low + self.high) / 2.0,
            Geometry::Sweep(_) => DVec3::ZERO,
        }
    }

    /// Converts a place in space, mm, to the coordinates that shaders compute with: those of a Cartesian volume count from the middle of the rendered
    /// box, those of a sweep are the same. The subtraction is in f64: f32 would lose a voxel of 0.1 mm at 1e6 mm.
    pub fn to_local(&self, place: DVec3) -> DVec3 {
        place - self.local_origin()
    }

    /// Converts the limit w of a half-space dot(n, p) <= w in space, mm, to the coordinates that shaders compute with.
    pub(crate) fn limit_to_local(&self, normal: DVec3, limit: f64) -> f64 {
        limit - normal.dot(self.local_origin())
    }

    pub fn probe(&self) -> Option<&Probe> {
        match &self.geometry {
            Geometry::Sweep(probe) => Some(probe),
            Geometry::Cartesian(_) => None,
        }
    }

    /// The place in space, mm, of a point in the coordinates of settings: lateral, depth from the probe's face, elevation, mm.
    pub fn place_of(&self, [lateral, depth, elevation]: [f64; 3]) -> DVec3 {
        DVec3::new(lateral, depth + depth_offset(&self.geometry), elevation)
    }

    /// The opposite of [`Scene::place_of`]: a place in space, mm, as lateral, depth from the probe's face and elevation.
    pub fn point_of(&self, place: DVec3) -> [f64; 3] {
        (place - DVec3::Y * depth_offset(&self.geometry)).to_array()
    }

    pub fn slices(&self) -> u32 {
        self.geometry.slices() as u32
    }

    /// Width and height of a frame of the source: samples x lines, or columns x rows.
    pub fn frame_size(&self) -> [u32; 2] {
        self.geometry.frame_size().map(|n| n as u32)
    }

    /// True if the device is a CPU, or not known yet: it has no shared memory and executes both sides of every branch.
    pub(crate) fn is_for_cpu(&self) -> bool {
        self.device.shared_memory == 0
    }

    /// True if lines are conditioned before scan conversion.
    pub fn conditions(&self) -> bool {
        let c = &self.conditioning;
        let on = !c.tgc.is_empty() || c.dynamic_range.is_some() || c.deviation(1) > 0.0 || self.decimation() > 1;
        on && self.probe().is_some()
    }

    /// Decimation factor of the samples along each line of a frame; 1 for a Cartesian volume.
    pub fn decimation(&self) -> u32 {
        self.probe().map_or(1, |probe| self.settings.conditioning.factor(probe.samples))
    }

    /// Number of samples per line after decimation, and number of lines.
    pub fn line_lattice(&self) -> [u32; 2] {
        let [samples, lines] = self.frame_size();
        [(samples - 1) / self.decimation() + 1, lines]
    }

    /// Width, height and number of slices of the volume.
    pub fn volume_size(&self) -> [u32; 3] {
        [self.grid.size[0], self.grid.size[1], self.slices()]
    }

    /// Width and height of the picture.
    pub fn picture_size(&self) -> [u32; 2] {
        self.settings.picture.size
    }

    /// Number of rays along each axis, which is the size of the images of stages 2 and 3: the rendering's part of the picture, with several rays per
    /// pixel or one for several pixels.
    pub fn ray_size(&self) -> [u32; 2] {
        camera::ray_size(&self.settings)
    }

    /// Width and height of the rendering in pixels; with `ray.subsampling`, in rays.
    pub(crate) fn rendering_size(&self) -> [u32; 2] {
        self.ray_size().map(|n| n / self.settings.ray.rays)
    }

    /// Number of entries of the table of the transfer function.
    pub fn transfer_entries(&self) -> usize {
        transfer::entries(&self.settings.volume).unwrap_or(transfer::ENTRIES)
    }

    /// Clip planes (n, w) in space: n is a unit vector, and points p with dot(n, p) > w are removed; mm.
    pub fn clips(&self) -> impl Iterator<Item = (DVec3, f64)> {
        let offset = depth_offset(&self.geometry);
        self.settings.clip.iter().map(move |c| {
            let normal = DVec3::from(c.normal).normalize();
            (normal, normal.dot(DVec3::from(c.at) + DVec3::Y * offset))
        })
    }

    /// The length that the transfer function's opacities refer to, mm: one slice pixel, along its shorter edge.
    pub fn reference_length(&self) -> f64 {
        self.grid.pitch[0].min(self.grid.pitch[1])
    }

    /// The step of volume rendering in units of [`Scene::reference_length`], for steps of equal lengths.
    pub(crate) fn optical_step(&self) -> f64 {
        self.step / self.reference_length()
    }

    /// Largest difference, mm, of the distances of neighbouring rays on one surface; a larger one is a gap between two surfaces.
    pub fn cliff(&self) -> f64 {
        self.settings.light.cliff * f64::from(self.settings.ray.subsampling)
    }

    /// Position of the near light in space, mm. None if the light is distant.
    pub fn light_place(&self) -> Option<DVec3> {
        self.settings.light.position.map(|p| self.rays.target + self.rays.out_of_camera(p))
    }
}
