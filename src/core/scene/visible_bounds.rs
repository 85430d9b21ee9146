//! Visible bounds: the texels of the volume that any sample of stage 2 may touch. Stage 1 computes only these (after Solteszova and
//! others 2017, who filter only what a picture shows). They do not depend on the camera, which may move at any time.

use super::cube::{self, HalfSpace};
use super::planes::{Plane, Tile};
use super::region::insonified_box;
use super::{Mode, Scene, SliceGrid};
use crate::probe::{Array, Geometry, Motion, Probe};
use glam::DVec3;
use std::ops::Range;

/// Margin for rounding of positions in f32 and in the device's filter, texels.
const SLACK: f64 = 0.5;

/// A box of texels: columns, rows and slices from `low` up to, but not including, `high`. All zero if empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VisibleBounds {
    pub low: [u32; 3],
    pub high: [u32; 3],
}

impl VisibleBounds {
    /// The bounds of a whole volume.
    pub fn all(size: [u32; 3]) -> VisibleBounds {
        VisibleBounds { low: [0; 3], high: size }
    }

    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.low[a] >= self.high[a])
    }

    /// True if `other` lies within these bounds. An empty box lies within any bounds.
    pub fn holds(&self, other: &VisibleBounds) -> bool {
        other.is_empty() || (0..3).all(|a| self.low[a] <= other.low[a] && other.high[a] <= self.high[a])
    }

    pub fn slices(&self) -> Range<u32> {
        self.low[2]..self.high[2]
    }

    /// The smallest bounds that contain both; an empty box adds nothing.
    pub fn with(self, other: VisibleBounds) -> VisibleBounds {
        if self.is_empty() || other.is_empty() {
            return if self.is_empty() { other } else { self };
        }
        VisibleBounds {
            low: std::array::from_fn(|a| self.low[a].min(other.low[a])),
            high: std::array::from_fn(|a| self.high[a].max(other.high[a])),
        }
    }
}

/// What stage 1 must serve if several scenes draw the same volume alternately, such as a view at rest and in motion ([`Scene::sharing`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Step along a ray of the picture at rest, mm; the sampling is chosen by it.
    pub(super) step: f64,
    /// Corners of the box that holds every sample of every ray of these scenes, mm in space. None if it may grow at any time, or if no ray is cast.
    pub(super) marched: Option<(DVec3, DVec3)>,
    /// Longest reach of the sliding filter, mm.
    pub(super) taps: f64,
}

/// A rectangle of texels of a slice: its first column and row, and the number of its columns and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    pub first: [u32; 2],
    pub size: [u32; 2],
}

impl Rectangle {
    /// Multiple of texels at which each edge of a rectangle lies: that of the workgroups that make it, and of tiles.
    pub(crate) const ALIGNMENT: u32 = 32;
}

/// The positions of the samples of a pass: inside a box and all half-spaces, or at most `reach` mm outside.
struct Look {
    low: DVec3,
    high: DVec3,
    /// Half-spaces: outward unit normals and limits, mm.
    planes: Vec<(DVec3, f64)>,
    reach: f64,
}

impl Scene {
    /// The scene with another pixel grid of the slices.
    pub fn on_grid(mut self, grid: SliceGrid) -> Scene {
        self.grid = grid;
        self.visible_bounds = of(&self);
        self
    }

    /// The frames that stage 1 needs, by the numbers of their slices: those of the visible slices, and the neighbours that smoothing across slices
    /// reads.
    pub fn visible_frames(&self) -> Range<u32> {
        let reach = self.reach_across_slices();
        let Range { start, end } = self.visible_bounds.slices();
        if self.visible_bounds.is_empty() {
            0..0
        } else {
            start.saturating_sub(reach)..(end + reach).min(self.slices())
        }
    }

    /// The visible columns and rows of a slice and `around` more on each side, extended to complete workgroups or to the slice's border.
    pub(crate) fn visible_rectangle(&self, around: [u32; 2]) -> Rectangle {
        let cut = |axis: usize| {
            let (low, high) = (self.visible_bounds.low[axis], self.visible_bounds.high[axis]);
            let first = low.saturating_sub(around[axis]) / Rectangle::ALIGNMENT * Rectangle::ALIGNMENT;
            let end =
                high.saturating_add(around[axis]).next_multiple_of(Rectangle::ALIGNMENT).min(self.grid.size[axis]);
            (first, end - first)
        };
        let (columns, rows) = (cut(0), cut(1));
        Rectangle { first: [columns.0, rows.0], size: [columns.1, rows.1] }
    }

    /// The texels of the volume that the device stores, at least one: the visible rectangle, in complete workgroups, of all slices that stage 1
    /// needs, and the `kept_bounds` of the scene. Coordinates of texels are those of the whole volume everywhere; only where an image is accessed,
    /// its first texel is subtracted.
    pub fn stored_bounds(&self) -> VisibleBounds {
        let (Rectangle { first, size }, slices) = (self.visible_rectangle([0; 2]), self.visible_frames());
        let shown = VisibleBounds {
            low: [first[0], first[1], slices.start],
            high: [first[0] + size[0], first[1] + size[1], slices.end],
        };
        let all = shown.with(self.kept_bounds);
        if all.is_empty() { VisibleBounds::all([1; 3]) } else { all }
    }

    /// The scene with the stored bounds of `before` as its `kept_bounds`, if both volumes have the same size and these bounds hold everything that
    /// this scene shows. Otherwise its `kept_bounds` become empty. A region that shrinks needs no new memory and keeps its slices.
    pub fn keeping(self, before: &Scene) -> Scene {
        let stored = before.stored_bounds();
        let shown = Scene { kept_bounds: VisibleBounds::default(), ..self };
        let is_held = shown.visible_bounds.is_empty() || stored.holds(&shown.stored_bounds());
        let is_kept = shown.volume_size() == before.volume_size() && is_held;
        Scene { kept_bounds: if is_kept { stored } else { VisibleBounds::default() }, ..shown }
    }

    /// The scene with a stage 1 that also serves `full` and `others`, which draw the same volume with the same filters. What depends on the number of
    /// samples of a ray follows `full`, so that changing from one of these scenes to another needs no frame again.
    pub fn sharing(self, full: &Scene, others: &[&Scene]) -> Scene {
        let all = || others.iter().copied().chain([full, &self]);
        let visible_bounds = all().map(|scene| scene.visible_bounds).fold(self.visible_bounds, VisibleBounds::with);
        // None is a box that may grow at any time.
        let marched = all().map(marched_box).reduce(|a, b| {
            let ((a, b), (c, d)) = (a?, b?);
            Some((a.min(c), b.max(d)))
        });
        let taps = all().map(Scene::tap_reach).fold(0.0, f64::max);
        let shared = Shared { step: full.step, marched: marched.flatten(), taps };
        Scene { visible_bounds, shared: Some(shared), ..self }
    }

    /// Share (0..1) of the volume's texels that lie within the visible bounds.
    pub fn visible_share(&self) -> f64 {
        let texels = |size: [u32; 3]| size.map(f64::from).iter().product::<f64>();
        texels(std::array::from_fn(|a| self.visible_bounds.high[a] - self.visible_bounds.low[a]))
            / texels(self.volume_size())
    }
}

/// Computes the visible bounds of a scene.
pub(super) fn of(scene: &Scene) -> VisibleBounds {
    let counts_growth = scene.settings.slices.enhanced_sigma.is_some_and(|e| e.growth);
    // A part is as large as it is in all of the sector, and fluid lies where it does whatever the region is.
    if scene.settings.slices.everything || counts_growth || scene.drops_floating() || scene.unveils() {
        return VisibleBounds::all(scene.volume_size());
    }
    looks(scene).iter().filter_map(|look| touched(scene, look)).fold(VisibleBounds::default(), VisibleBounds::with)
}

/// Corners of the box that holds every sample of every ray, mm in space. None if it may grow at any time, or if no ray is cast.
pub(super) fn marched_box(scene: &Scene) -> Option<(DVec3, DVec3)> {
    if scene.settings.slices.everything {
        return None;
    }
    let boxes = looks_of_rays(scene).into_iter().map(|look| (look.low - look.reach, look.high + look.reach));
    boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn looks(scene: &Scene) -> Vec<Look> {
    let mut looks = looks_of_rays(scene);
    if scene.cuts_planes() {
        let (clips, tiling): (Vec<_>, _) = (scene.planes_clips().collect(), scene.tiling());
        let view = scene.planes_view();
        looks.extend(tiling.tiles.iter().map(|tile| {
            let planes = [clips.as_slice(), &tile_faces(scene, tile)].concat();
            Look { low: view.low, high: view.high, planes, reach: 0.0 }
        }));
    }
    looks
}

fn looks_of_rays(scene: &Scene) -> Vec<Look> {
    let clips: Vec<(DVec3, f64)> = scene.clips().collect();
    let look = |low, planes: &[_], steps| Look {
        low,
        high: scene.high,
        planes: planes.to_vec(),
        reach: reach(scene, scene.step, steps),
    };
    // The sliding filter reaches along and across the ray, beyond the last step that starts within the region.
    let sliding = match scene.settings.ray.sliding {
        0 => 0,
        edge => edge + 1,
    };
    let mut looks = Vec::new();
    if scene.detects_surface() {
        let ring = scene.ring.half * scene.settings.surface.rough + scene.ring.samples();
        let mut look = look(scene.surface_view().low, &clips, 0);
        look.reach = reach(scene, scene.ring.step, ring + sliding);
        look.reach += f64::from(scene.samples_behind()) * scene.step_behind();
        looks.push(look);
    }
    if scene.composites() {
        looks.push(look(scene.volume_view().low, &clips, sliding));
    }
    match scene.settings.mode {
        Mode::Mip | Mode::MinIp | Mode::Mean => looks.push(look(scene.projection_view().low, &clips, sliding)),
        Mode::Cube => {
            let block: Vec<_> = scene.block().iter().map(|half| (half.normal, half.limit)).collect();
            looks.push(look(scene.low, &block, 0));
        }
        _ => {}
    }
    looks
}

/// The half-spaces that bound the samples of a tile: its rectangle, as thick as the slab.
fn tile_faces(scene: &Scene, tile: &Tile) -> Vec<(DVec3, f64)> {
    let Plane { at, right, down, normal } = tile.plane;
    let [width, height] = tile.size.map(|n| f64::from(n) * tile.pixel / 2.0);
    // Slabs reach half of their thickness to either side.
    let slab = scene.settings.planes.thickness / 2.0;
    if tile.section.is_some() {
        // A box about the line, which is as high as the tile.
        let columns: Vec<DVec3> = tile.columns().into_iter().flatten().map(|(place, _)| place).collect();
        let side = |axis: DVec3| {
            let most = columns.iter().map(|place| axis.dot(*place)).fold(f64::MIN, f64::max);
            (axis, most + slab)
        };
        let ends = [(down, down.dot(at) + height), (-down, height - down.dot(at))];
        return [right, -right, normal, -normal].map(side).into_iter().chain(ends).collect();
    }
    let sides = [(right, width), (down, height), (normal, slab)];
    let faces = |(axis, half): (DVec3, f64)| [(axis, axis.dot(at) + half), (-axis, half - axis.dot(at))];
    sides.into_iter().flat_map(faces).collect()
}

/// Largest length, mm, of `steps` steps of a ray whose step is `step` mm. Growing steps keep growing outside the region.
pub(super) fn reach(scene: &Scene, step: f64, steps: u32) -> f64 {
    let steps = f64::from(steps);
    let (mut widest, mut growth) = (1.0, 0.0);
    if let Some(probe) = scene.probe().filter(|_| scene.spreads()) {
        // The same rule as in the ray casters: proportional to the range, starting here.
        let (spread, from) = (scene.settings.ray.spread, probe.first_range().max(probe.last_range() / 8.0));
        widest = 1.0 + spread * 7.0;
        growth = step * spread / from;
    }
    let (low, high) = insonified_box(&scene.geometry);
    // Beyond twice the volume there is nothing, and an exponential may be infinite.
    (step * widest * steps * ((steps + 1.0) * growth).exp()).min(2.0 * (high - low).length())
}

/// An interval that grows to contain the values added to it.
#[derive(Clone, Copy)]
struct Span(f64, f64);

impl Span {
    fn of(values: impl Iterator<Item = f64>) -> Span {
        values.fold(Span(f64::MAX, f64::MIN), |s, v| Span(s.0.min(v), s.1.max(v)))
    }

    fn within(self, low: f64, high: f64) -> Span {
        Span(self.0.max(low), self.1.min(high))
    }

    /// The value in the interval that is nearest to zero.
    fn least(self) -> f64 {
        0f64.clamp(self.0, self.1.max(self.0))
    }

    fn most(self) -> f64 {
        self.0.abs().max(self.1.abs())
    }
}

fn touched(scene: &Scene, look: &Look) -> Option<VisibleBounds> {
    let (mut low, mut high) = (look.low - look.reach, look.high + look.reach);
    if let Geometry::Sweep(probe) = &scene.geometry {
        // Only the insonified region is sampled. A single frame is sampled anywhere along its thickness.
        let (first, last) = probe.bounds();
        let thick = matches!(probe.motion, Motion::Still { .. });
        let nudge = 1e-9 * first.abs().max(last.abs()).max_element();
        let axes = if thick { 0..2 } else { 0..3 };
        for axis in axes {
            (low[axis], high[axis]) = (low[axis].max(first[axis] - nudge), high[axis].min(last[axis] + nudge));
        }
    }
    let planes: Vec<_> = look.planes.iter().map(|(normal, limit)| (*normal, limit + look.reach)).collect();
    let corners = corners(low, high, &planes);
    if corners.is_empty() {
        return None;
    }
    let along = |axis: usize| Span::of(corners.iter().map(|c| c[axis]));
    let index = |v: Span, origin: f64, pitch: f64| Span((v.0 - origin) / pitch, (v.1 - origin) / pitch);
    let spans: [Span; 3] = match &scene.geometry {
        Geometry::Cartesian(grid) => std::array::from_fn(|a| index(along(a), grid.origin[a], grid.spacing[a])),
        Geometry::Sweep(probe) => {
            let (x, y, position) = unswept(probe, &corners, along(0), along(1), along(2));
            let (x, y) = in_sector(probe, x, y);
            let SliceGrid { origin, pitch, .. } = scene.grid;
            [index(x, origin[0], pitch[0]), index(y, origin[1], pitch[1]), slices(scene, probe, position)]
        }
    };
    let size = scene.volume_size();
    let texel = |index: f64, axis: usize| index.floor().clamp(0.0, f64::from(size[axis] - 1)) as u32;
    // The B-spline takes one slice more on each side.
    let more = [0.0, 0.0, f64::from(u8::from(scene.takes_bspline()))];
    let bounds = VisibleBounds {
        low: std::array::from_fn(|a| texel(spans[a].0 - SLACK - more[a], a)),
        high: std::array::from_fn(|a| texel(spans[a].1 + SLACK + 1.0 + more[a], a) + 1),
    };
    // The bounds may intersect the sector's bounding box but not the sector.
    Some(bounds).filter(|bounds| !bounds.is_empty())
}

/// Bounds of in-plane x and y and of slice positions of a convex solid with these corners.
fn unswept(probe: &Probe, corners: &[DVec3], x: Span, y: Span, z: Span) -> (Span, Span, Span) {
    let Motion::Fan { .. } = probe.motion else { return (x, y, z) };
    let axis = probe.axis_depth();
    // What is drawn, and with it the solid, lies beyond the wobble axis. A plane of constant angle divides the solid there, so that the
    // extremes of the angle and the maximum distance from the axis lie at corners. The minimum distance may not.
    let beyond = Span((y.0 - axis).max(0.0), y.1 - axis);
    let angle = Span::of(corners.iter().map(|c| c.z.atan2((c.y - axis).max(f64::MIN_POSITIVE))));
    let farthest = corners.iter().map(|c| (c.y - axis).hypot(c.z)).fold(0.0, f64::max);
    (x, Span(beyond.least().hypot(z.least()) + axis, farthest + axis), angle)
}

/// The part of an in-plane rectangle that lies within the sector.
fn in_sector(probe: &Probe, x: Span, y: Span) -> (Span, Span) {
    let (low, high) = probe.plane_bounds();
    let (mut x, mut y) = (x.within(low[0], high[0]), y.within(low[1], high[1]));
    // A radial sector is bounded by its box alone.
    if matches!(probe.array, Array::Curved { .. }) && !probe.is_radial() {
        let chord = |range: f64, across: f64| (range * range - across * across).max(0.0).sqrt();
        y = y.within(chord(probe.first_range(), x.most()), chord(probe.last_range(), x.least()));
        let (first, last) = (probe.lines.first().tan(), probe.lines.last().tan());
        let side = |tangent: f64, far: bool| tangent * if (tangent > 0.0) == far { y.1 } else { y.0 };
        let half = chord(probe.last_range(), y.least());
        x = x.within(side(first, false).max(-half), side(last, true).min(half));
    }
    (x, y)
}

/// Range of slice indices at slice positions, over all lines.
fn slices(scene: &Scene, probe: &Probe, position: Span) -> Span {
    let (first, last) = probe.slice_bounds();
    let slack = match probe.motion {
        Motion::Still { .. } => return Span(0.0, 0.0),
        Motion::Translated => 0.0,
        Motion::Fan { .. } if scene.slice_terms() > 0 => super::slice_index::MAX_ERROR * probe.slices.pitch(),
        // The ray casters interpolate a table over the half tangent t. The error is at most h^2/8 of (2 atan t)''.
        Motion::Fan { .. } => {
            let h = ((last / 2.0).tan() - (first / 2.0).tan()) / f64::from(scene.settings.ray.entries - 1);
            1.3 * h * h / 8.0
        }
    };
    // The slice index at a position is monotone in the line.
    let lines = [0.0, (probe.lines.len() - 1) as f64];
    let at = |position: f64| lines.map(|line| probe.slice_index(position, line));
    let ([a, b], [c, d]) = (at(position.0 - slack), at(position.1 + slack));
    Span(a.min(b), c.max(d))
}

/// Corners of the intersection of a box with half-spaces (outward normals and limits).
fn corners(low: DVec3, high: DVec3, planes: &[(DVec3, f64)]) -> Vec<DVec3> {
    if (0..3).any(|a| low[a] > high[a]) {
        return Vec::new();
    }
    let sides = DVec3::AXES.iter().enumerate().flat_map(|(a, n)| [(-*n, -low[a]), (*n, high[a])]);
    let all = sides.chain(planes.iter().copied()).map(|(normal, limit)| HalfSpace { normal, limit });
    let all: Vec<HalfSpace> = all.collect();
    // A share of the box, and what f64 leaves of places that are far away.
    let tolerance = 1e-6 * (high - low).max_element() + 1e-14 * low.abs().max(high.abs()).max_element();
    // Nearly parallel planes add no corner that others do not give.
    cube::corners(&all, 1e-6, tolerance)
}
