//! Texture coordinates along a ray, and the places at which they enter another cell or leave the insonified region.
//!
//! An additional breakpoint does no harm, because the field is the same polynomial on both sides of it. Therefore the solutions of squared
//! equations are not tested for their sign.

use super::polynomial::{Polynomial, bracketed};
use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::scene::Scene;
use glam::DVec3;

/// A straight line through a scene's volume: `base + s direction`, s in mm.
#[derive(Clone, Copy, Debug)]
pub struct Line<'a> {
    pub scene: &'a Scene,
    /// A point of the line, mm. Rounding errors are smallest if it lies near the volume.
    pub base: DVec3,
    /// Direction in which the distance s from `base` grows; a unit vector.
    pub direction: DVec3,
}

impl Line<'_> {
    pub fn place(&self, s: f64) -> DVec3 {
        self.base + self.direction * s
    }

    /// Fractional column, row and slice of the volume at s, whole at the centres of texels. They are extrapolated outside the insonified region.
    pub fn coordinates(&self, s: f64) -> [f64; 3] {
        let grid = &self.scene.grid;
        let place = self.place(s);
        let column = |x: f64, y: f64| [(x - grid.origin[0]) / grid.pitch[0], (y - grid.origin[1]) / grid.pitch[1]];
        match &self.scene.geometry {
            Geometry::Cartesian(volume) => {
                let [i, j] = column(place.x, place.y);
                [i, j, (place.z - volume.origin[2]) / volume.spacing[2]]
            }
            Geometry::Sweep(probe) => {
                let (x, y, position) = probe.inverse_sweep_map(place);
                let [i, j] = column(x, y);
                let line = if probe.advance == Advance::None { 0.0 } else { probe.plane_indices(x, y).1 };
                [i, j, probe.slice_index(position, line)]
            }
        }
    }

    /// True if the place at the distance `s` from `base`, mm, is inside the insonified region, and always for a Cartesian volume.
    pub fn is_inside(&self, s: f64) -> bool {
        crate::passes::raycast::ray::texel(self.scene, self.place(s)).is_some()
    }

    /// Returns `low`, `high` and, between them in rising order, every s at which a column, row or slice coordinate is the index of a texel or the
    /// line crosses the border of the insonified region. Some other places may be among them.
    pub fn breakpoints(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let mut found = Vec::new();
        let size = self.scene.volume_size().map(|n| n as usize);
        let grid = &self.scene.grid;
        let texels = |axis: usize| (0..size[axis]).map(move |k| grid.origin[axis] + grid.pitch[axis] * k as f64);
        crossings_of_a_line(self.base.x, self.direction.x, texels(0), &mut found);
        match &self.scene.geometry {
            Geometry::Cartesian(volume) => {
                crossings_of_a_line(self.base.y, self.direction.y, texels(1), &mut found);
                let slices = (0..size[2]).map(|k| volume.origin[2] + volume.spacing[2] * k as f64);
                crossings_of_a_line(self.base.z, self.direction.z, slices, &mut found);
            }
            Geometry::Sweep(probe) => {
                let plane = Plane::new(probe, self);
                plane.depths(texels(1), &mut found);
                plane.borders([low, high], &mut found);
                if probe.advance != Advance::None && matches!(probe.lines, Axis::Table(_)) {
                    // The motor's travel with the line is linear between two lines only.
                    (0..probe.lines.len()).for_each(|n| plane.line(probe.lines.at(n as f64), &mut found));
                }
                match probe.advance {
                    Advance::None => plane.slices(&mut found),
                    _ => self.slices_on_the_move(probe, [low, high], &mut found),
                }
            }
        }
        sorted(found, [low, high])
    }

    /// The slices of a motor that moves during a frame: the slice at a place depends on its line, and may turn round along the ray.
    fn slices_on_the_move(&self, probe: &Probe, ends: [f64; 2], found: &mut Vec<f64>) {
        let before = sorted(found.clone(), ends);
        for pair in before.windows(2) {
            let (middle, half) = ((pair[0] + pair[1]) / 2.0, (pair[1] - pair[0]) / 2.0);
            let turned = |k: usize| {
                let advance = probe.advance_at(k as f64);
                Polynomial::through(8, |x| {
                    let (x, y, position) = probe.inverse_sweep_map(self.place(middle + half * x));
                    let share = probe.plane_indices(x, y).1 / probe.lines.len() as f64;
                    (position - probe.slices.at(k as f64) - advance * share) / probe.slices.pitch().abs().max(1e-12)
                })
            };
            let indices = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|x| self.coordinates(middle + half * x)[2]);
            let (least, most) = indices.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            // Half the spread more on both sides: between five places of one cell the slice strays less.
            let slack = (most - least) / 2.0 + 1e-9;
            let last = probe.slices.len() - 1;
            let index = |v: f64| v.clamp(0.0, last as f64) as usize;
            for k in index((least - slack).ceil())..=index((most + slack).floor()) {
                let mut roots = Vec::new();
                turned(k).roots(&mut roots);
                found.extend(roots.into_iter().map(|x| middle + half * x));
            }
        }
    }
}

/// Returns both ends and those of `found` that lie between them, in rising order. Values closer than rounding errors are merged.
pub(super) fn sorted(mut found: Vec<f64>, [low, high]: [f64; 2]) -> Vec<f64> {
    found.retain(|s| *s > low && *s < high);
    found.extend([low, high]);
    found.sort_by(f64::total_cmp);
    let tiny = 1e-14 * (high - low).max(low.abs()).max(high.abs());
    found.dedup_by(|later, earlier| *later - *earlier <= tiny);
    found
}

/// Appends to `found` each s at which start + rate s equals one of the values.
pub(super) fn crossings_of_a_line(start: f64, rate: f64, values: impl Iterator<Item = f64>, found: &mut Vec<f64>) {
    if rate != 0.0 {
        found.extend(values.map(|v| (v - start) / rate));
    }
}

/// The real roots of a s^2 + b s + c without cancellation. A double root that rounding lifts off zero counts.
pub(super) fn quadratic(a: f64, b: f64, c: f64) -> impl Iterator<Item = f64> {
    let inner = b * b - 4.0 * a * c;
    let q = -0.5 * (b + inner.max(0.0).sqrt().copysign(b));
    let roots = if a == 0.0 {
        [None, (b != 0.0).then(|| -c / b)]
    } else if inner < -1e-12 * b * b {
        [None; 2]
    } else {
        [Some(q / a), (q != 0.0).then(|| c / q)]
    };
    roots.into_iter().flatten()
}

/// A ray in the planes of a swept probe: x is linear along it, and the depth below the sweep's axis is the length of a linear vector.
struct Plane<'a> {
    probe: &'a Probe,
    /// x = x0 + x1 s.
    x: [f64; 2],
    /// The depth in the plane is `offset` + |vector|, or the first component alone if the sweep does not turn.
    first: [f64; 2],
    second: [f64; 2],
    offset: f64,
    turns: bool,
}

impl Plane<'_> {
    fn new<'a>(probe: &'a Probe, line: &Line) -> Plane<'a> {
        let turns = matches!(probe.motion, Motion::Fan { .. });
        let offset = if turns { probe.axis_depth() } else { 0.0 };
        Plane {
            probe,
            x: [line.base.x, line.direction.x],
            first: [line.base.y - offset, line.direction.y],
            second: [line.base.z, line.direction.z],
            offset,
            turns,
        }
    }

    /// Depth in the plane less the offset.
    fn depth(&self, s: f64) -> f64 {
        let (u, w) = (self.first[0] + self.first[1] * s, self.second[0] + self.second[1] * s);
        if self.turns { u.hypot(w) } else { u }
    }

    fn x(&self, s: f64) -> f64 {
        self.x[0] + self.x[1] * s
    }

    /// Square of the depth less the offset of a turning sweep: c + b s + a s^2, as [a, b, c].
    fn squared(&self) -> [f64; 3] {
        let ([u0, u1], [w0, w1]) = (self.first, self.second);
        [u1 * u1 + w1 * w1, 2.0 * (u0 * u1 + w0 * w1), u0 * u0 + w0 * w0]
    }

    /// Where the depth in the plane has one of the values, mm.
    fn depths(&self, values: impl Iterator<Item = f64>, found: &mut Vec<f64>) {
        if !self.turns {
            return crossings_of_a_line(self.first[0], self.first[1], values, found);
        }
        // About the nearest place to the axis, where nothing cancels: depth^2 = least^2 + a (s - nearest)^2.
        let ([u0, u1], [w0, w1]) = (self.first, self.second);
        let a = self.squared()[0];
        if a > 0.0 {
            let (nearest, least) = (-(u0 * u1 + w0 * w1) / a, (u0 * w1 - w0 * u1).abs() / a.sqrt());
            for depth in values.map(|v| v - self.offset).filter(|d| *d >= least) {
                let away = ((depth - least) * (depth + least) / a).sqrt();
                found.extend([nearest - away, nearest + away]);
            }
        }
    }

    /// Where the line crosses the slices of a motor that stops for each frame: planes through the axis, or across it.
    fn slices(&self, found: &mut Vec<f64>) {
        let ([u0, u1], [w0, w1]) = (self.first, self.second);
        for k in 0..self.probe.slices.len() {
            let position = self.probe.slices.at(k as f64);
            match self.probe.motion {
                Motion::Fan { .. } => {
                    let (sin, cos) = position.sin_cos();
                    let rate = w1 * cos - u1 * sin;
                    found.extend((rate != 0.0).then(|| -(w0 * cos - u0 * sin) / rate));
                }
                Motion::Translated => crossings_of_a_line(w0, w1, std::iter::once(position), found),
                Motion::Still { .. } => {}
            }
        }
    }

    /// The first and the last sample, and the first and the last line.
    fn borders(&self, ends: [f64; 2], found: &mut Vec<f64>) {
        let ranges = [self.probe.first_range(), self.probe.last_range()];
        match self.probe.array {
            Array::Linear => self.depths(ranges.into_iter(), found),
            Array::Curved { .. } => ranges.into_iter().for_each(|range| self.range(range, ends, found)),
        }
        [self.probe.lines.first(), self.probe.lines.last()].into_iter().for_each(|at| self.line(at, found));
    }

    /// Where the line crosses a scan line: x cos a = depth sin a, both sides squared for a turning sweep.
    fn line(&self, at: f64, found: &mut Vec<f64>) {
        if self.probe.array == Array::Linear {
            return crossings_of_a_line(self.x[0], self.x[1], std::iter::once(at), found);
        }
        let (sin, cos) = at.sin_cos();
        let [x0, x1] = self.x;
        let (start, rate) = (x0 * cos - self.offset * sin, x1 * cos);
        if !self.turns || sin.abs() < 1e-14 {
            let depth = if self.turns { [0.0; 2] } else { self.first };
            return crossings_of_a_line(start - depth[0] * sin, rate - depth[1] * sin, std::iter::once(0.0), found);
        }
        let [a, b, c] = self.squared();
        let square = sin * sin;
        let roots = quadratic(rate * rate - square * a, 2.0 * start * rate - square * b, start * start - square * c);
        // Squares lose half the digits where two solutions nearly meet: two steps of Newton's rule get them back.
        let off = |s: f64| start + rate * s - self.depth(s) * sin;
        for mut s in roots {
            for _ in 0..2 {
                let rate = rate - (a * s + b / 2.0) / self.depth(s).max(1e-300) * sin;
                let step = off(s) / rate;
                s -= if step.is_finite() && step.abs() < 1e-3 { step } else { 0.0 };
            }
            found.push(s);
        }
    }

    /// Where the line has a range from the apex of a curved array. The range is a convex function of s, since it is the length of (linear,
    /// linear), or of (linear, convex) as long as the depth in the plane is not negative: it has one least place and at most two crossings.
    fn range(&self, range: f64, [low, high]: [f64; 2], found: &mut Vec<f64>) {
        if self.turns && self.offset < 0.0 && self.probe.is_radial() {
            return self.range_above_the_apex(range, [low, high], found);
        }
        // Without a turn the depth may be negative: above the apex of a radial probe.
        let least_depth = if self.turns { 0.0 } else { f64::MIN };
        let off = |s: f64| self.x(s).hypot((self.depth(s) + self.offset).max(least_depth)) - range;
        // The least place by golden sections, until one lies within the range.
        let golden = (5f64.sqrt() - 1.0) / 2.0;
        let (mut a, mut b) = (low, high);
        let mut within = [low, high].into_iter().find(|s| off(*s) < 0.0);
        for _ in 0..90 {
            if within.is_some() {
                break;
            }
            let (c, d) = (b - golden * (b - a), a + golden * (b - a));
            let (fc, fd) = (off(c), off(d));
            within = if fc < 0.0 { Some(c) } else { (fd < 0.0).then_some(d) };
            (a, b) = if fc < fd { (a, d) } else { (c, b) };
        }
        if let Some(within) = within {
            found.extend(bracketed(off, low, within));
            found.extend(bracketed(off, within, high));
        }
    }

    /// The same where the range is not convex: by signs at the ends of many parts.
    fn range_above_the_apex(&self, range: f64, [low, high]: [f64; 2], found: &mut Vec<f64>) {
        const PARTS: u32 = 256;
        let off = |s: f64| self.x(s).hypot(self.depth(s) + self.offset) - range;
        let end = |n: u32| low + (high - low) * f64::from(n) / f64::from(PARTS);
        found.extend((0..PARTS).filter_map(|n| bracketed(off, end(n), end(n + 1))));
    }
}
