//! Shared by the ray casters: the parameters of rays and sweep map, and in f64 the march of a ray through the volume.

use crate::passes::empty_space::skip_constant;
use crate::passes::lookup_tables::{is_non_uniform, line_span, sweep_border, sweep_span};
use crate::passes::pass::*;
use crate::passes::preprocess::packed_sampling;
use crate::probe::{Advance, Array, Geometry, Indices, Motion, Probe};
use crate::scene::cube::HalfSpace;
use crate::scene::{MAX_CLIPS, Rays, Scene, View, windowed};
use glam::DVec3;

/// Whether the sweep look-up table, the table of slices (non-uniform sweep), and the line look-up table (intra-frame motion) are
/// needed.
fn tables(scene: &Scene) -> (bool, bool, bool) {
    match &scene.geometry {
        Geometry::Sweep(probe) => {
            let swept = !matches!(probe.motion, Motion::Still { .. });
            (swept, swept && is_non_uniform(&scene.geometry), scene.moves_in_frames())
        }
        Geometry::Cartesian(_) => (false, false, false),
    }
}

pub(in crate::passes) fn reads(scene: &Scene) -> Vec<Bind> {
    let (swept, non_uniform, moving) = tables(scene);
    let mut reads = vec![Bind { filtered: scene.filters_in_hardware(), ..whole("volume", Slot::of_rays(scene)) }];
    reads.extend((swept && scene.slice_terms() == 0).then_some(whole("sweep_lut", Slot::SweepLut)));
    reads.extend(moving.then_some(whole("line_lut", Slot::LineLut)));
    reads.extend(non_uniform.then_some(whole("slice_table", Slot::SliceTable)));
    reads
}

/// The slots that passes with samples along rays read, including the one that they skip empty space by.
pub(super) fn marching_reads(scene: &Scene, skipping: Option<Slot>) -> Vec<Bind> {
    let mut reads = reads(scene);
    reads.extend(scene.packs().then_some(whole("packed_neighbours", Slot::PackedNeighbours)));
    reads.extend(skipping.map(|slot| whole("bricks", slot)));
    reads
}

/// How slices lie in space: SWEEP of the shaders.
pub(in crate::passes) fn sweep(scene: &Scene) -> i32 {
    scene.probe().map_or(0, |probe| match probe.motion {
        Motion::Fan { .. } => 1,
        Motion::Translated => 2,
        Motion::Still { .. } => 3,
    })
}

pub(in crate::passes) fn constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let array = scene.probe().map_or(0, |probe| match probe.array {
        Array::Linear => 0,
        Array::Curved { .. } if probe.is_radial() => 2,
        Array::Curved { .. } => 1,
    });
    let (_, non_uniform, moving) = tables(scene);
    vec![
        ("SWEEP", sweep(scene)),
        ("ARRAY", array),
        ("SAMPLING", !scene.filters_in_hardware() as i32),
        ("ELEVATION", scene.takes_bspline() as i32),
        ("INTRA_FRAME_MOTION", moving as i32),
        ("NON_UNIFORM", non_uniform as i32),
        ("SWEEP_TERMS", scene.slice_terms() as i32),
        ("MIRRORED", scene.probe().map_or(0, mirrored)),
        ("CLIPS", scene.settings.clip.len() as i32),
        ("SPREAD", scene.spreads() as i32),
    ]
}

/// Specialization constants of passes that take samples along rays.
pub(super) fn marching_constants(scene: &Scene, skipping: Option<Slot>) -> Vec<(&'static str, i32)> {
    let mut constants = constants(scene);
    if scene.packs() {
        constants = replaced(constants, &["SAMPLING"], [("SAMPLING", packed_sampling(scene))]);
    }
    constants.extend([skip_constant(skipping), ("SLIDING", scene.settings.ray.sliding as i32)]);
    constants
}

/// Ray parameters for a pass that casts no ray: they do not depend on the camera.
pub(in crate::passes) fn unmoved_params(scene: &Scene, view: View) -> Params {
    params(&unmoved(scene, [DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::Y]), view, 1.0)
}

/// The scene with another set of parallel rays (`origin`, its change per pixel to the right and down, and `direction`), and without the rays' step.
pub(super) fn unmoved(scene: &Scene, [origin, origin_dx, origin_dy, direction]: [DVec3; 4]) -> Scene {
    let [direction_dx, direction_dy] = [DVec3::ZERO; 2];
    let rays = Rays { origin, origin_dx, origin_dy, direction, direction_dx, direction_dy, ..scene.rays };
    Scene { rays, step: 1.0, ..scene.clone() }
}

pub(super) fn params(scene: &Scene, view: View, step: f64) -> Params {
    let [window_low, window_high] = view.window;
    let (grid, local) = (&scene.grid, scene.local_origin());
    let mut clips = [[0.0; 4]; MAX_CLIPS];
    for (clip, (normal, limit)) in clips.iter_mut().zip(scene.clips()) {
        *clip = normal.extend(scene.limit_to_local(normal, limit)).to_array();
    }
    let [clip_0, clip_1, clip_2, clip_3] = clips;
    let (bricks, stored) = (scene.bricks(), scene.stored_bounds());
    let last_stored = stored.high.map(|end| end - 1);
    let probe = scene.probe();
    let [range_low, range_high] = probe.map_or([0.0; 2], |probe| [probe.first_range(), probe.last_range()]);
    let (line_low, line_high) = probe.map_or((0.0, 0.0), line_span);
    let (slice_origin, slice_density) = match &scene.geometry {
        Geometry::Cartesian(volume) => (volume.origin[2] - local.z, 1.0 / volume.spacing[2]),
        Geometry::Sweep(_) => (0.0, 0.0),
    };
    let advance = match probe {
        Some(Probe { advance: Advance::Same(advance), slices, .. }) if tables(scene).0 => advance / slices.pitch(),
        _ => 0.0,
    };
    sweep_params(ray_params(scene), scene)
        .vec3("brick_low", scene.to_local(bricks.low))
        .vec3("brick_density", bricks.edge.recip())
        .vec3("last_brick", bricks.count.map(|n| f64::from(n) - 1.0))
        .f32("spread", scene.settings.ray.spread)
        .f32("spread_range", scene.probe().map_or(1.0, spread_range))
        .vec4("clip_0", clip_0)
        .vec4("clip_1", clip_1)
        .vec4("clip_2", clip_2)
        .vec4("clip_3", clip_3)
        .vec3("box_low", scene.to_local(view.low))
        .vec3("box_high", scene.to_local(view.high))
        .f32("step_length", step)
        .first_stored(scene)
        .i32("last_stored_column", last_stored[0])
        .i32("last_stored_row", last_stored[1])
        .i32("last_stored_slice", last_stored[2])
        .vec3("texture_shift", stored.low.map(|first| 0.5 - f64::from(first)))
        .vec3("texture_scale", std::array::from_fn(|axis| 1.0 / f64::from(stored.high[axis] - stored.low[axis])))
        .f32("last_slice", f64::from(scene.slices() - 1))
        .f32("window_low", window_low)
        .f32("window_scale", 1.0 / (window_high - window_low))
        .vec2("grid_origin", [grid.origin[0] - local.x, grid.origin[1] - local.y])
        .vec2("grid_density", grid.pitch.map(|p| 1.0 / p))
        .f32("range_low", range_low)
        .f32("range_high", range_high)
        .f32("range_low_squared", f64::from(range_low as f32 * range_low as f32))
        .f32("range_high_squared", f64::from(range_high as f32 * range_high as f32))
        .f32("line_low", line_low)
        .f32("line_high", line_high)
        .f32("slice_origin", slice_origin)
        .f32("slice_density", slice_density)
        .f32("axis_depth", probe.map_or(0.0, |probe| probe.axis_depth()))
        .f32("line_density", probe.map_or(0.0, |_| f64::from(scene.settings.ray.entries - 1) / (line_high - line_low)))
        .f32("advance", advance)
}

/// From the position in a sweep to the slice index, and the borders of the lines.
fn sweep_params(params: Params, scene: &Scene) -> Params {
    let probe = scene.probe();
    let [border_low, border_high] = probe.map_or([0.0; 2], sweep_border);
    let (first_position, last_position) = probe.filter(|_| tables(scene).0).map_or((0.0, 0.0), sweep_span);
    let polynomial = scene.slice_polynomial();
    let [low, high] = polynomial.as_ref().map_or([first_position, last_position], |polynomial| polynomial.limits);
    let density = match polynomial.is_none() && last_position > first_position {
        true => f64::from(scene.settings.ray.entries - 1) / (last_position - first_position),
        false => 0.0,
    };
    let term = |i: usize| polynomial.as_ref().and_then(|p| p.terms.get(i)).copied().unwrap_or(0.0);
    let four = |first: usize| std::array::from_fn(|i| term(first + i));
    let [first_line, last_line] = border_lines(probe);
    params
        .vec2("first_line", first_line)
        .vec2("last_line", last_line)
        .f32("sweep_first", first_position)
        .f32("sweep_last", last_position)
        .f32("sweep_border_low", border_low)
        .f32("sweep_border_high", border_high)
        .f32("sweep_low", low)
        .f32("sweep_high", high)
        .f32("sweep_density", density)
        .f32("sweep_offset", polynomial.as_ref().map_or(0.0, |p| p.offset))
        .vec4("sweep_terms_0", four(0))
        .vec4("sweep_terms_1", four(4))
        .vec2("sweep_terms_2", [term(8), term(9)])
}

/// In-plane normals of the first and the last line of a curved array: towards larger angles from the first, towards smaller ones from the last.
fn border_lines(probe: Option<&Probe>) -> [[f64; 2]; 2] {
    let side = |angle: f64, towards: f64| [towards * angle.cos(), -towards * angle.sin()];
    let curved = probe.filter(|p| matches!(p.array, Array::Curved { .. }));
    let [first, last] = curved.map_or([0.0; 2], |p| [p.lines.first(), p.lines.last()]);
    [side(first, 1.0), side(last, -1.0)]
}

/// The lines and the sweep are each their own mirror image, to the last bit of the parameters: bits 0 and 1.
fn mirrored(probe: &Probe) -> i32 {
    let [[first_x, first_y], [last_x, last_y]] = border_lines(Some(probe)).map(|line| line.map(|c| c as f32));
    let [low, high] = sweep_border(probe).map(|position| position as f32);
    i32::from(first_x == -last_x && first_y == last_y && last_x < 0.0) + 2 * i32::from(low == -high)
}

/// The position in the picture, in rays from its upper left corner, that the ray (x, y) goes through: the middle of its cell.
pub(super) fn middle_of(x: usize, y: usize) -> [f64; 2] {
    [x as f64 + 0.5, y as f64 + 0.5]
}

/// A ray in f64, and the volume that it goes through.
pub(super) struct Ray<'a> {
    scene: &'a Scene,
    volume: &'a Texels,
    /// mm, at the place where steps are shortest if they grow.
    step: f64,
    window: [f64; 2],
    origin: DVec3,
    /// Unit length, away from the eye.
    pub direction: DVec3,
    /// Across the ray, unit length.
    across: [DVec3; 2],
    /// Distances along the ray, mm, between which it is in the box and on the kept side of all clip planes: it enters at `enter` and leaves at
    /// `leave`. `enter` is at least 0. A ray that misses, or only touches, has (0, -1).
    pub enter: f64,
    pub leave: f64,
    /// Ratio of the step at the entry to the scene's step, and the increase of this ratio per mm.
    wider: f64,
    widening: f64,
}

impl<'a> Ray<'a> {
    pub fn cast(scene: &'a Scene, volume: &'a Texels, view: View, step: f64, x: usize, y: usize) -> Ray<'a> {
        Ray::through(scene, volume, view, step, middle_of(x, y))
    }

    /// The ray through a position (x, y) of the picture, in rays from its upper left corner.
    pub fn through(scene: &'a Scene, volume: &'a Texels, view: View, step: f64, [x, y]: [f64; 2]) -> Ray<'a> {
        let (origin, direction) = scene.rays.at(x, y);
        let (enter, leave) = span(scene, view, origin, direction);
        let sideways = scene.rays.origin_dx + scene.rays.direction_dx;
        let across = sideways.reject_from_normalized(direction).normalize();
        let (wider, widening) = match scene.spreads() && leave > enter {
            true => {
                let (low, high) = (wider(scene, origin + direction * enter), wider(scene, origin + direction * leave));
                (low, (high - low) / (leave - enter))
            }
            false => (1.0, 0.0),
        };
        let across = [across, across.cross(direction)];
        Ray { scene, volume, step, window: view.window, origin, direction, across, enter, leave, wider, widening }
    }

    pub fn path(&self) -> f64 {
        self.leave - self.enter
    }

    /// Distance along the ray at which it enters the region, mm; [`MISS`] if it does not.
    pub(crate) fn enter_or_miss(&self) -> f64 {
        if self.path() > 0.0 { self.enter } else { MISS }
    }

    /// Distance t behind the entry after n steps, mm: the solution of dt/dn = step (wider + widening t).
    pub fn offset(&self, n: f64) -> f64 {
        let rate = self.step * self.widening;
        match rate == 0.0 {
            true => self.step * self.wider * n,
            false => self.wider / self.widening * (rate * n).exp_m1(),
        }
    }

    /// Length of the step that follows n steps, mm.
    pub fn length(&self, n: f64) -> f64 {
        self.offset(n + 1.0) - self.offset(n)
    }

    /// Number of steps, which may be fractional, to an offset in mm behind the entry.
    pub(crate) fn steps_to(&self, offset: f64) -> f64 {
        match self.widening == 0.0 {
            true => offset / (self.step * self.wider),
            false => (self.widening / self.wider * offset).max(-0.999_999).ln_1p() / (self.step * self.widening),
        }
    }

    /// The place in space, mm, at an offset in mm behind the entry.
    pub fn place(&self, offset: f64) -> DVec3 {
        self.origin + self.direction * (self.enter + offset)
    }

    /// True if the place at an offset in mm behind the entry is in the insonified region.
    pub fn is_inside(&self, offset: f64) -> bool {
        texel(self.scene, self.place(offset)).is_some()
    }

    /// The sample after the grey window, 0..1, at an offset in mm behind the entry. `n` is the number of steps to that offset. None outside the
    /// insonified region. With `ray.sliding` it is the weighted mean over a cube of samples around that place, without those outside the region.
    pub fn sample(&self, offset: f64, n: f64) -> Option<f64> {
        let at = texel(self.scene, self.place(offset))?;
        let edge = i64::from(self.scene.settings.ray.sliding);
        let value = match edge {
            0 => interpolated(self.scene, self.volume, at),
            _ => self.filtered(n, edge / 2),
        };
        Some(windowed(self.window, value))
    }

    fn filtered(&self, n: f64, reach: i64) -> f64 {
        // Deviation sqrt(edge - 1) / 2.
        let weight = |away: i64| (-(away * away) as f64 / (2.0 * reach as f64 / 2.0)).exp();
        let (mut sum, mut weights) = (0.0, 0.0);
        for along in -reach..=reach {
            let n = n + along as f64;
            let (middle, apart) = (self.place(self.offset(n)), self.length(n - 0.5));
            for (x, y) in (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y))) {
                let place = middle + (self.across[0] * x as f64 + self.across[1] * y as f64) * apart;
                if let Some(at) = texel(self.scene, place) {
                    let w = weight(x) * weight(y) * weight(along);
                    sum += w * interpolated(self.scene, self.volume, at);
                    weights += w;
                }
            }
        }
        if weights > 0.0 { sum / weights } else { 0.0 }
    }

    /// The sample after the grey window, 0..1, at a distance in mm along the ray, without `ray.sliding`. None outside the insonified region.
    pub fn echo(&self, distance: f64) -> Option<f64> {
        let at = texel(self.scene, self.origin + self.direction * distance)?;
        Some(windowed(self.window, interpolated(self.scene, self.volume, at)))
    }
}

/// The value of the volume at fractional texel indices, interpolated as the scene says.
pub(in crate::passes) fn interpolated(scene: &Scene, volume: &Texels, at: [f64; 3]) -> f64 {
    if scene.takes_bspline() { volume.bspline_across_slices(at) } else { volume.trilinear(at) }
}

/// Ratio of the step to the scene's step at a place: proportional to the range from the array's apex.
fn wider(scene: &Scene, place: DVec3) -> f64 {
    let Some(probe) = scene.probe() else { return 1.0 };
    let (x, y, _) = probe.inverse_sweep_map(place);
    1.0 + scene.settings.ray.spread * ((x.hypot(y) / spread_range(probe)).clamp(1.0, 8.0) - 1.0)
}

/// The range up to which steps have the scene's length: that of the first sample, unless that is (nearly) the apex.
fn spread_range(probe: &Probe) -> f64 {
    probe.first_range().max(probe.last_range() / 8.0)
}

/// Distances (enter, leave) along a ray from `origin`, mm, between which it is in the box of `view` and on the kept side of all clip planes. `enter`
/// is at least 0. The ray misses if leave < enter.
pub fn span(scene: &Scene, view: View, origin: DVec3, direction: DVec3) -> (f64, f64) {
    let found = entry(solid(scene, view), origin, direction);
    found.map_or((0.0, -1.0), |(enter, leave, _)| (enter, leave))
}

/// Where a ray enters and leaves the intersection of half-spaces, mm along it, and the index of the one that it enters last; None if it begins
/// inside. Returns None if the ray misses the intersection.
pub(super) fn entry(
    block: impl IntoIterator<Item = HalfSpace>,
    origin: DVec3,
    direction: DVec3,
) -> Option<(f64, f64, Option<usize>)> {
    let (mut enter, mut leave, mut face) = (0.0f64, f64::MAX, None);
    for (i, half) in block.into_iter().enumerate() {
        let (towards, room) = (half.normal.dot(direction), half.room(origin));
        if towards.abs() < 1e-12 {
            if room < 0.0 {
                return None;
            }
        } else if towards > 0.0 {
            leave = leave.min(room / towards);
        } else if room / towards > enter {
            (enter, face) = (room / towards, Some(i));
        }
    }
    (leave > enter).then_some((enter, leave, face))
}

/// Sides of a box, the first half-spaces of [`solid`].
pub(super) const SIDES: usize = 6;

/// The half-spaces whose intersection a view shows: the six sides of its box, then the clip planes.
pub(super) fn solid(scene: &Scene, view: View) -> impl Iterator<Item = HalfSpace> {
    let sides =
        DVec3::AXES.into_iter().flat_map(move |axis| [(axis, axis.dot(view.high)), (-axis, -axis.dot(view.low))]);
    sides.chain(scene.clips()).map(|(normal, limit)| HalfSpace { normal, limit })
}

/// Fractional texel indices of a place in space, mm. Beyond the first and the last slice the nearest of them counts. None beyond the first or last
/// sample or line of the frames; a Cartesian volume has indices everywhere.
pub(in crate::passes) fn texel_beyond_sweep(scene: &Scene, place: DVec3) -> Option<[f64; 3]> {
    let Geometry::Sweep(probe) = &scene.geometry else { return texel(scene, place) };
    let (x, y, position) = probe.inverse_sweep_map(place);
    let at = probe.to_indices(place);
    // The shader's table ends with the sweep.
    let (low, high) = probe.slice_bounds();
    let slice = probe.slice_index(position.clamp(low, high), at.line);
    let [i, j] = pixel(scene, x, y);
    inside(probe, Indices { slice: 0.0, ..at }).then_some([i, j, slice])
}

/// Fractional column and row of a place in the plane of the slices, mm.
fn pixel(scene: &Scene, x: f64, y: f64) -> [f64; 2] {
    let grid = &scene.grid;
    [(x - grid.origin[0]) / grid.pitch[0], (y - grid.origin[1]) / grid.pitch[1]]
}

/// Fractional texel indices, whole at the centres of texels, of a place in space, mm. None outside the insonified region of a sweep; a Cartesian
/// volume has indices everywhere. It uses the exact inverse of the probe's maps, not the tables that the shader reads.
pub fn texel(scene: &Scene, place: DVec3) -> Option<[f64; 3]> {
    match &scene.geometry {
        Geometry::Cartesian(volume) => {
            let [i, j] = pixel(scene, place.x, place.y);
            Some([i, j, (place.z - volume.origin[2]) / volume.spacing[2]])
        }
        Geometry::Sweep(probe) => {
            let (x, y, _) = probe.inverse_sweep_map(place);
            let at = probe.to_indices(place);
            let [i, j] = pixel(scene, x, y);
            inside(probe, at).then_some([i, j, at.slice])
        }
    }
}

fn inside(probe: &Probe, at: Indices) -> bool {
    let within = |index: f64, count: usize| index >= 0.0 && index <= (count - 1) as f64;
    within(at.sample, probe.samples) && within(at.line, probe.lines.len()) && within(at.slice, probe.slices.len())
}
