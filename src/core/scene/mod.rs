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
mod number;
pub mod picker;
pub mod planes;
mod region;
mod sampling;
pub mod self_attenuation;
pub mod settings;
mod sizes;
mod slice_index;
pub mod start_curve;
mod still;
#[cfg(test)]
pub(crate) mod test_block;
pub mod transfer;
mod turntable;
pub mod unveil;
pub mod variants;
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
pub use still::{DistantLight, StillLights};
pub use visible_bounds::{Rectangle, Shared, VisibleBounds};

use crate::probe::StoredType;
use crate::probe::{Array, Geometry, Probe};
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

/// The box and grey window that a pass of stage 2 renders with. They depend on the mode, because each mode has its own start depth: rays that start
/// at the probe would meet the uterine wall first.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub window: [f64; 2],
    /// Lower corner of the box, at the start depth where that is deeper than the region's near face, mm in space.
    pub low: DVec3,
    /// Upper corner of the box, mm in space.
    pub high: DVec3,
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
    /// Pixel format of the picture: that of the window, so that no conversion is needed. Set by the renderer for its device.
    pub window_texels: WindowTexels,
    /// Bytes of shared memory of a workgroup on a GPU, which AOS, the light volume and filters use. 0 on a CPU, where single invocations are faster.
    /// Set by the renderer for its device.
    pub shared_memory: u32,
    /// True if the device truncates half-precision floats when it stores them, instead of rounding. Set by the renderer for its device.
    pub truncates_halves: bool,
    /// Maximum number of frames that go through stage 1 at once, at least 1. Set by the renderer for its device.
    pub frames_at_once: u32,
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
        check_measures::check_measures(&self.measure)?;
        still::check(self)?;
        cuts::check(&self.cuts)?;
        start_curve::check(self)?;
        check::check_planes(self)
    }
}

impl Scene {
    /// Checks the settings against the geometry and resolves them.
    ///
    /// # Errors
    /// Names the first setting that cannot be rendered, and its limits.
    pub fn new(geometry: Geometry, input: Input, settings: Settings) -> Result<Scene, SceneError> {
        match &geometry {
            Geometry::Sweep(probe) => {
                probe.check().map_err(|e| SceneError { field: e.field, fault: e.fault })?;
            }
            Geometry::Cartesian(grid) => {
                grid.check().map_err(|e| SceneError { field: e.field, fault: e.fault })?;
            }
        }
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
        let longer: Vec<String> = is_longer
            .then(|| format!("ray.step: {step} mm: {MAX_SAMPLES} are the most samples of a ray"))
            .into_iter()
            .collect();
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
            window_texels: WindowTexels::default(),
            shared_memory: 0,
            truncates_halves: false,
            frames_at_once: u32::MAX,
            sampling,
            apron: 0.0,
            conditioning,
            slice_filters,
            section_smooth,
            distance,
            resolved_sizes: resolver.resolved,
            found: longer,
            visible_bounds: VisibleBounds::default(),
            kept_bounds: VisibleBounds::default(),
            shared: None,
        };
        let fields = [
            ["slices.smooth.lateral", "slices.smooth.depth", "slices.smooth.elevation"],
            ["planes.smooth.lateral", "planes.smooth.depth", "planes.smooth.elevation"],
        ];
        let deviations = [scene.smoothing(), scene.section_smoothing()];
        for (axis, field, deviation) in
            (0..2).flat_map(|n| (0..3).map(move |axis| (axis, fields[n][axis], deviations[n][axis])))
        {
            if deviation > MAX_DEVIATION {
                let unit = if axis < 2 { "slice pixels" } else { "slices" };
                return refuse(field, format!("is {deviation:.1} {unit}, at most {MAX_DEVIATION} can be filtered"));
            }
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
        unveil::check_unveiled(&scene)?;
        start_curve::check_drawn(&scene)?;
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
        self.shared_memory == 0
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

    /// True if only pixels at edges have several rays (`ray.adaptive`). It needs a mode in which a pixel follows from the colours along its rays
    /// alone.
    pub fn adapts_rays(&self) -> bool {
        let ray = &self.settings.ray;
        let is_alone = self.settings.mode == Mode::Volume && !self.lights_volume();
        ray.adaptive && ray.rays > 1 && is_alone && self.still().is_none() && !self.has_caps()
    }

    /// The tolerance of `ray.tolerance`, levels of 8 bits, by which the steps of each pixel are chosen. None if it is 0, or if the scene is not
    /// volume rendering, lights first hits, or is a still.
    pub fn tolerance(&self) -> Option<f64> {
        let is_alone = self.settings.mode == Mode::Volume && !self.lights_volume() && self.still().is_none();
        Some(self.settings.ray.tolerance).filter(|levels| *levels > 0.0 && is_alone)
    }

    /// True if pixels at edges of a surface, or of a cut face, mix the near and the far side by the share of the pixel that each covers. With several
    /// rays a pixel it is false: the mean of the rays does this.
    pub fn antialiases(&self) -> bool {
        let ray = &self.settings.ray;
        self.settings.post.antialias
            && (self.has_distance() || self.has_caps())
            && ray.rays == 1
            && ray.subsampling == 1
    }

    /// True if stages 2 and 3 render into a slot other than the picture, which is then assembled from it: several rays make a pixel, one ray makes
    /// several pixels, edges are antialiased, or planes or a second rendering are beside it.
    pub fn assembles(&self) -> bool {
        let ray = &self.settings.ray;
        let is_beside =
            ray.rays > 1 || ray.subsampling > 1 || self.settings.layout != Layout::Single || self.antialiases();
        is_beside && !self.is_flat()
    }

    /// True if assembling the picture also converts it to 8 bits, because no other pass of stage 4 reads it.
    pub(crate) fn tones_assembled(&self) -> bool {
        self.assembles() && self.only_tones()
    }

    /// True if nothing is done to a picture but toning.
    fn only_tones(&self) -> bool {
        let post = &self.settings.post;
        let filtered = post.sigma.is_some() || post.enhanced_sigma.is_some() || post.perona_malik.is_some();
        !filtered && !post.floats
    }

    /// Number of entries of the table of the transfer function.
    pub fn transfer_entries(&self) -> usize {
        transfer::entries(&self.settings.volume).unwrap_or(transfer::ENTRIES)
    }

    /// True if the scene runs a surface detector.
    pub fn detects_surface(&self) -> bool {
        matches!(self.settings.mode, Mode::Surface | Mode::Mixed)
    }

    /// True if the surface of each ray is chosen among several candidates, by what neighbouring rays found.
    pub(crate) fn chooses_surface(&self) -> bool {
        self.detects_surface() && self.settings.surface.detector == Detector::Consistent
    }

    /// True if stage 3 lights a distance map: of a surface, or of the first hits of volume rendering.
    pub fn has_distance(&self) -> bool {
        self.detects_surface() || self.lights_volume()
    }

    /// True if volume rendering lights the first hit of each ray like a surface (`volume.shading`).
    pub fn lights_volume(&self) -> bool {
        self.settings.mode == Mode::Volume && self.settings.volume.shading == Shading::FirstHit
    }

    /// True if the steps along a ray grow with the distance from the array's apex (`ray.spread`).
    pub fn spreads(&self) -> bool {
        let curved = self.probe().is_some_and(|p| matches!(p.array, Array::Curved { .. }));
        curved && self.settings.ray.spread > 0.0
    }

    /// The box and grey window of the surface detector.
    pub fn surface_view(&self) -> View {
        self.view(self.settings.surface.window, self.settings.surface.start_depth)
    }

    /// The box and grey window of volume rendering.
    pub fn volume_view(&self) -> View {
        self.view(self.settings.volume.window, self.settings.volume.start_depth)
    }

    /// The box and grey window of projections.
    pub(crate) fn projection_view(&self) -> View {
        self.view(self.settings.projection.window, self.settings.projection.start_depth)
    }

    /// Y coordinate in space, mm, at which rendering starts unless the start surface or start curve is deeper. In mode mixed it is the deeper of the
    /// start depths of both layers; planes and mode cube start at the region's near face.
    pub fn start_depth(&self) -> f64 {
        let (surface, volume, projection) = (self.surface_view(), self.volume_view(), self.projection_view());
        match self.settings.mode {
            Mode::Surface => surface.low.y,
            Mode::Volume => volume.low.y,
            Mode::Mixed => surface.low.y.max(volume.low.y),
            Mode::Mip | Mode::MinIp | Mode::Mean => projection.low.y,
            _ => self.low.y,
        }
    }

    /// The whole region with this grey window, without a start depth.
    pub(crate) fn whole_view(&self, window: [f64; 2]) -> View {
        self.view(window, None)
    }

    fn view(&self, window: [f64; 2], start: Option<f64>) -> View {
        let start = start.map_or(self.low.y, |s| s + depth_offset(&self.geometry));
        View { window, low: self.low.with_y(self.low.y.max(start)), high: self.high }
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

    /// True if samples are composited through the transfer function.
    pub fn composites(&self) -> bool {
        matches!(self.settings.mode, Mode::Volume | Mode::Mixed) || self.colours_surface() || self.is_pair()
    }

    /// True if volume rendering gives the surface its colour (`surface.colour`).
    pub(crate) fn colours_surface(&self) -> bool {
        self.settings.mode == Mode::Surface && self.settings.surface.colour != SurfaceColour::Constant
    }

    /// True if layout pair shows volume rendering and the surface side by side.
    pub fn is_pair(&self) -> bool {
        self.settings.layout == Layout::Pair
    }

    /// Whether one pass finds the surface and composites the whole ray (thesis 4.4.2): `Ok` with the reason, or `Err` with the reason why not.
    pub(crate) fn marches_once(&self) -> Result<&'static str, &'static str> {
        let settings = &self.settings;
        let is_whole = settings.surface.colour == SurfaceColour::Rendered || self.is_pair();
        if settings.mode != Mode::Surface {
            return Err("no surface is found and no whole ray composited in this mode");
        }
        if !is_whole {
            return Err("no whole ray is composited");
        }
        if self.chooses_surface() {
            return Err("two passes: the surface is chosen among neighbouring rays");
        }
        if settings.ray.sliding == 0 && !self.is_pair() {
            // Measured: docs/experiments/one-march.md.
            return Err("two passes: where samples are cheap (no ray.sliding) they are no slower than one march");
        }
        if matches!(settings.volume.compositing, Compositing::PreIntegrated | Compositing::Exponential) {
            return Err(
                "two passes: this compositing takes samples at the ends of steps, the detector in their middles",
            );
        }
        if self.spreads() {
            return Err("two passes: steps that grow have no sample of the detector in their middles");
        }
        if self.surface_view().low != self.volume_view().low {
            return Err("two passes: rays of the volume and of the surface start at different depths");
        }
        Ok("one march finds the surface and composites the whole ray")
    }

    /// True if the mode is a projection: the largest, smallest or mean sample of each ray.
    pub(crate) fn projects(&self) -> bool {
        matches!(self.settings.mode, Mode::Mip | Mode::MinIp | Mode::Mean)
    }

    /// True if the picture has planes: a mode of planes, or a layout with planes beside the rendering.
    pub fn cuts_planes(&self) -> bool {
        self.is_flat() || self.settings.layout.has_planes()
    }

    /// True if the mode cuts planes and casts no rays.
    pub fn is_flat(&self) -> bool {
        self.settings.mode.is_flat()
    }

    /// Standard deviations of the 3D Gaussian: along columns and rows in slice pixels, across slices in slices. The last is less than the setting
    /// where interpolation between slices smooths more than linear interpolation does.
    pub fn smoothing(&self) -> [f64; 3] {
        let [lateral, depth, elevation] = self.deviations(self.slice_filters.smooth.unwrap_or_default());
        if self.blurs() {
            return [binomial_deviation(3), binomial_deviation(3), elevation];
        }
        [lateral, depth, elevation]
    }

    /// Standard deviations of the 3D Gaussian of the section volume: slice pixels, slice pixels and slices.
    pub(crate) fn section_smoothing(&self) -> [f64; 3] {
        self.deviations(self.section_smooth.unwrap_or_default())
    }

    fn deviations(&self, smooth: Smooth) -> [f64; 3] {
        if let Some(taps) = smooth.kernel {
            return [binomial_deviation(taps); 3];
        }
        let elevation = self.left_to_smooth(smooth.elevation);
        [smooth.lateral / self.grid.pitch[0], smooth.depth / self.grid.pitch[1], elevation]
    }

    /// The deviation of the Gaussian across slices, slices, that together with the interpolation between them has the variance of this
    /// deviation and linear interpolation. The weights of two texels at a share t have the variance t (1 - t), 1/6 on average; those of
    /// the cubic B-spline 1/3 everywhere.
    fn left_to_smooth(&self, deviation: f64) -> f64 {
        match self.settings.ray.elevation {
            Elevation::Linear => deviation,
            Elevation::Bspline | Elevation::BsplineSharp => {
                (deviation * deviation - (1.0 / 3.0 - 1.0 / 6.0)).max(0.0).sqrt()
            }
        }
    }

    /// True if samples between slices are interpolated by the cubic B-spline, which reads four slices.
    pub fn takes_bspline(&self) -> bool {
        self.settings.ray.elevation != Elevation::Linear
    }

    /// True if slices are sharpened across elevation, for `ray.elevation = "bspline-sharp"`.
    pub(crate) fn sharpens(&self) -> bool {
        self.settings.ray.elevation == Elevation::BsplineSharp
    }

    /// True if a pass filters across slices.
    pub fn filters_across_slices(&self) -> bool {
        self.smoothing_radius()[2] > 0
    }

    /// Number of taps of the 3D Gaussian on each side of the middle, along columns, rows and slices.
    pub fn smoothing_radius(&self) -> [u32; 3] {
        if let Some(taps) = self.slice_filters.smooth.and_then(|s| s.kernel) {
            return [taps / 2; 3];
        }
        let [lateral, depth, elevation] = self.smoothing().map(gaussian_radius);
        let elevation = if self.sharpens() { 1 } else { elevation };
        if self.blurs() { [1, 1, elevation] } else { [lateral, depth, elevation] }
    }

    /// Number of taps of the 3D Gaussian of the section volume on each side of the middle, along columns, rows and slices.
    pub(crate) fn section_smoothing_radius(&self) -> [u32; 3] {
        if let Some(taps) = self.section_smooth.and_then(|s| s.kernel) {
            return [taps / 2; 3];
        }
        let [lateral, depth, elevation] = self.section_smoothing().map(gaussian_radius);
        [lateral, depth, if self.sharpens() { 1 } else { elevation }]
    }

    /// Number of frames on either side of a slice that can change it in the volume that rays go through: all of them where floating parts are dropped
    /// or the start surface is searched.
    pub(crate) fn reach_to_frames(&self) -> u32 {
        if self.drops_floating() || self.unveils() { self.slices() } else { self.smoothing_radius()[2] }
    }

    /// Number of neighbouring slices on either side that a filtered slice depends on; of the two volumes, the one with more.
    pub fn reach_across_slices(&self) -> u32 {
        let sections = if self.has_sections() { self.section_smoothing_radius()[2] } else { 0 };
        self.smoothing_radius()[2].max(sections)
    }

    /// True if slices get the slight blur against wood grain: it is set, and no smoothing blurs them in their plane.
    fn blurs(&self) -> bool {
        let smooth = self.slice_filters.smooth.unwrap_or_default();
        let blur = self.settings.slices.blur.is_on(self.is_flat());
        blur && smooth.kernel.is_none() && smooth.lateral == 0.0 && smooth.depth == 0.0
    }

    /// The estimator of the centre in an enhanced sigma filter: as set, otherwise Perona-Malik for planes and the median for all other modes (thesis
    /// 5.7).
    pub fn centre(&self, enhanced: EnhancedSigma) -> Estimator {
        let usual = if self.is_flat() { Estimator::PeronaMalik } else { Estimator::Median };
        enhanced.centre.unwrap_or(usual)
    }

    /// Number of samples behind the surface that skin shading averages; 0 if it needs none.
    pub(crate) fn samples_behind(&self) -> u32 {
        match self.settings.light.skin {
            Some(skin) if skin.translucency > 0.0 => ((skin.depth / self.ring.step).ceil() as u32).clamp(1, 256),
            _ => 0,
        }
    }

    /// Distance between the samples behind the surface that skin shading averages, mm. Together the steps span the skin's depth.
    pub(crate) fn step_behind(&self) -> f64 {
        self.settings.light.skin.map_or(0.0, |skin| skin.depth) / f64::from(self.samples_behind().max(1))
    }

    /// True if the light on a surface depends on the echo at or behind it: by `light.texture`, or the translucency of skin.
    pub fn lights_by_echo(&self) -> bool {
        let is_translucent = self.skin().is_some_and(|s| s.translucency > 0.0);
        self.detects_surface() && (self.settings.light.texture > 0.0 || is_translucent)
    }

    /// Skin shading, if it has an effect: wrap or translucency is above 0. Otherwise None.
    pub fn skin(&self) -> Option<Skin> {
        self.settings.light.skin.filter(|s| s.wrap > 0.0 || s.translucency > 0.0)
    }

    /// Largest difference, mm, of the distances of neighbouring rays on one surface; a larger one is a gap between two surfaces.
    pub fn cliff(&self) -> f64 {
        self.settings.light.cliff * f64::from(self.settings.ray.subsampling)
    }

    /// Position of the near light in space, mm. None if the light is distant.
    pub fn light_place(&self) -> Option<DVec3> {
        self.settings.light.position.map(|p| self.rays.target + self.rays.out_of_camera(p))
    }

    /// Reach of the slice filters, pixels.
    fn filter_reach(&self) -> f64 {
        let [lateral, depth, _] = self.smoothing_radius().map(f64::from);
        let median = if self.settings.slices.median { 1.0 } else { 0.0 };
        let slices = &self.slice_filters;
        let sigma = slices.sigma.map_or(0.0, |s| f64::from(s.repeat * (s.window / 2)));
        let enhanced = slices.enhanced_sigma.map_or(0.0, |e| f64::from(e.largest / 2));
        let estimator = match slices.estimator {
            Some(Estimator::NagaoMatsuyama) => 2.0,
            Some(_) => 1.0,
            None => 0.0,
        };
        let diffusion = slices.perona_malik.map_or(0.0, |p| p.reach());
        // The reach of a chain of square windows extends to their corners.
        let gaussian = lateral.hypot(depth);
        let [lateral, depth, _] = self.section_smoothing_radius().map(f64::from);
        let sections = if self.has_sections() { lateral.hypot(depth) } else { 0.0 };
        let slices = std::f64::consts::SQRT_2 * (median + estimator + sigma + enhanced) + diffusion + gaussian;
        slices.max(sections)
    }
}

/// Standard deviation of the binomial kernel of `taps` taps.
fn binomial_deviation(taps: u32) -> f64 {
    f64::from(taps - 1).sqrt() / 2.0
}

/// Number of taps on one side of a Gaussian of `deviation` pixels or slices. It is cut off at three standard deviations, which hold 99.7 %.
pub(crate) fn gaussian_radius(deviation: f64) -> u32 {
    if deviation > 0.0 { ((3.0 * deviation).ceil() as u32).max(1) } else { 0 }
}
