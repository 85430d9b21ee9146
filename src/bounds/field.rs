//! The range of the field over a part of a ray, proven: interval coordinates, and the extremes of a trilinear function.
//!
//! Through a Cartesian volume the field within a cell is a cubic of the place. Its Bernstein coefficients are means of the trilinear
//! function at mixed corners of the two ends (its polar form), and their hull contains it. Through a swept volume the coordinates over
//! the part are intervals, and a trilinear function over a box is largest and smallest at corners of the box. A part that reaches over
//! the face of a cell by the rounding of its ends is widened by what the field can change there.

use super::interval::Interval;
use crate::exact_ray::Line;
use crate::passes::Texels;
use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use std::f64::consts::FRAC_PI_2;

/// What is known of a part of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// All of it is outside the insonified region.
    Outside,
    /// The field, stretched by the grey window and clamped, is in this range wherever the part is inside.
    Within { values: Interval, surely_inside: bool },
}

/// The field of a volume along a line.
pub struct Field<'a> {
    line: &'a Line<'a>,
    volume: &'a Texels,
    window: [f64; 2],
    /// Smallest and largest texel.
    range: [f64; 2],
}

impl<'a> Field<'a> {
    /// `range`: smallest and largest value of the volume; `window`: the grey values that become 0 and 1.
    pub fn new(line: &'a Line<'a>, volume: &'a Texels, window: [f64; 2], range: [f64; 2]) -> Field<'a> {
        Field { line, volume, window, range }
    }

    /// The content between two places, mm, `from` at most `to`.
    pub fn content(&self, from: f64, to: f64) -> Content {
        match &self.line.scene.geometry {
            Geometry::Cartesian(_) => Content::Within { values: self.along_a_cubic(from, to), surely_inside: true },
            Geometry::Sweep(probe) => match self.sweep(probe, Interval::between(from, to)) {
                None => Content::Outside,
                Some((at, surely_inside)) => Content::Within { values: self.over_a_box(at), surely_inside },
            },
        }
    }

    fn place(&self, axis: usize, s: Interval) -> Interval {
        Interval::of(self.line.base[axis]) + Interval::of(self.line.direction[axis]) * s
    }

    fn windowed(&self, value: f64) -> Interval {
        let [black, white] = self.window;
        (Interval::of(value) - Interval::of(black)).over(Interval::of(white) - Interval::of(black))
    }

    /// Stretched values of the corners of a cell; bit 0 of the index: the higher column, bit 1: row, bit 2: slice.
    fn corners(&self, cell: [usize; 3]) -> [Interval; 8] {
        std::array::from_fn(|corner| {
            let at = |axis: usize| (cell[axis] + (corner >> axis & 1)) as i64;
            self.windowed(self.volume.clamped(at(0), at(1), at(2)))
        })
    }

    /// How much stretched values may change from one texel to the next.
    fn steepest(&self) -> f64 {
        (self.windowed(self.range[1]) - self.windowed(self.range[0])).magnitude()
    }

    fn everything(&self) -> Interval {
        self.windowed(self.range[0]).hull(self.windowed(self.range[1])).clamped()
    }

    /// The cell of a coordinate interval along an axis.
    fn cell(&self, axis: usize, at: Interval) -> usize {
        let last = self.volume.size[axis].saturating_sub(2) as f64;
        (at.low / 2.0 + at.high / 2.0).floor().clamp(0.0, last) as usize
    }

    fn along_a_cubic(&self, from: f64, to: f64) -> Interval {
        let mut ends = [from, to].map(|s| self.cartesian(Interval::of(s)));
        let (mut cell, mut slack) = ([0; 3], 0.0);
        for axis in 0..3 {
            let last = (self.volume.size[axis] - 1) as f64;
            let hull = ends[0][axis].hull(ends[1][axis]);
            // Beyond the border the field repeats it.
            if hull.high <= 0.0 || hull.low >= last {
                let border = if hull.high <= 0.0 { 0.0 } else { last };
                ends.iter_mut().for_each(|end| end[axis] = Interval::of(border));
            }
            let hull = ends[0][axis].hull(ends[1][axis]);
            cell[axis] = self.cell(axis, hull);
            let beyond = overshoot(hull, cell[axis]);
            if beyond > 1.0 {
                return self.everything();
            }
            // Both the field and the cell's own function, continued, leave the face at no more than this slope.
            slack += beyond * (1.0 + (1.0 + 2.0 * beyond).powi(2)) * 1.000_001;
        }
        let corners = self.corners(cell);
        let share = |end: usize, axis: usize| ends[end][axis] - Interval::of(cell[axis] as f64);
        let value = |n: usize| trilinear(&corners, std::array::from_fn(|axis| share(n >> axis & 1, axis)));
        // The polar form: b1 has one of the three coordinates at the far end, b2 two.
        let third = |a: Interval, b: Interval, c: Interval| (a + b + c).over(Interval::of(3.0));
        let bernstein = [value(0), third(value(1), value(2), value(4)), third(value(3), value(5), value(6)), value(7)];
        let hull = bernstein.into_iter().reduce(Interval::hull).unwrap_or(Interval::ZERO);
        hull.widened((slack * self.steepest()).next_up()).clamped()
    }

    fn over_a_box(&self, at: [Interval; 3]) -> Interval {
        let (mut cell, mut slack) = ([0; 3], 0.0);
        let mut shares = [Interval::ZERO; 3];
        for axis in 0..3 {
            let last = (self.volume.size[axis] - 1) as f64;
            let inner = Interval { low: at[axis].low.clamp(0.0, last), high: at[axis].high.clamp(0.0, last) };
            cell[axis] = self.cell(axis, inner);
            let beyond = overshoot(inner, cell[axis]);
            if beyond > 1.0 {
                return self.everything();
            }
            slack += beyond * 1.000_001;
            shares[axis] = (inner - Interval::of(cell[axis] as f64)).clamped();
        }
        let corners = self.corners(cell);
        let corner = |n: usize| {
            let end = |axis: usize| if n >> axis & 1 == 1 { shares[axis].high } else { shares[axis].low };
            trilinear(&corners, [0, 1, 2].map(|axis| Interval::of(end(axis))))
        };
        let hull = (0..8).map(corner).reduce(Interval::hull).unwrap_or(Interval::ZERO);
        hull.widened((slack * self.steepest()).next_up()).clamped()
    }

    fn cartesian(&self, s: Interval) -> [Interval; 3] {
        let grid = &self.line.scene.grid;
        let (origin, pitch) = match &self.line.scene.geometry {
            Geometry::Cartesian(volume) => (volume.origin[2], volume.spacing[2]),
            Geometry::Sweep(_) => (0.0, 1.0),
        };
        let (origins, pitches) = ([grid.origin[0], grid.origin[1], origin], [grid.pitch[0], grid.pitch[1], pitch]);
        std::array::from_fn(|axis| {
            (self.place(axis, s) - Interval::of(origins[axis])).over(Interval::of(pitches[axis]))
        })
    }

    /// Texture coordinates of a swept volume over a part, and whether all of it is surely inside the insonified region; none if all of
    /// it is outside.
    fn sweep(&self, probe: &Probe, s: Interval) -> Option<([Interval; 3], bool)> {
        let (x, z) = (self.place(0, s), self.place(2, s));
        let turns = matches!(probe.motion, Motion::Fan { .. });
        let axis = Interval::of(if turns { probe.axis_depth() } else { 0.0 })
            .widened(4.0 * f64::EPSILON * probe.array_radius());
        let beyond = self.place(1, s) - axis;
        let everything = Interval { low: f64::MIN, high: f64::MAX };
        // All of a sector is beyond the axis of its fan.
        if turns && beyond.high <= 0.0 {
            return None;
        }
        let (depth, position) = match probe.motion {
            Motion::Fan { .. } if beyond.low <= 0.0 => (everything, everything),
            Motion::Fan { .. } => ((beyond.square() + z.square()).root() + axis, z.angle(beyond)),
            Motion::Translated => (self.place(1, s), z),
            Motion::Still { .. } => (self.place(1, s), Interval::ZERO),
        };
        if depth.high > 1e300 {
            return Some(([everything; 3], false));
        }
        let (range, at) = match probe.array {
            Array::Linear => (depth, x),
            Array::Curved { .. } if probe.is_radial() => {
                // Off the depth axis: the angle to the lateral axis has no jump there.
                let quarter = Interval { low: FRAC_PI_2, high: FRAC_PI_2.next_up() };
                let angle = match x {
                    x if x.low > 0.0 => quarter - depth.angle(x),
                    x if x.high < 0.0 => depth.angle(-x) - quarter,
                    x if depth.low > 0.0 => x.angle(depth),
                    _ => return Some(([everything; 3], false)),
                };
                ((x.square() + depth.square()).root(), angle)
            }
            // Lines lie within 90 degrees of the axis.
            Array::Curved { .. } if depth.high <= 0.0 => return None,
            Array::Curved { .. } if depth.low <= 0.0 => return Some(([everything; 3], false)),
            Array::Curved { .. } => ((x.square() + depth.square()).root(), x.angle(depth)),
        };
        let line = index_on(&probe.lines, at);
        let slice = self.slice(probe, position, line);
        let sample = (range - Interval::of(probe.first_range()).widened(4.0 * f64::EPSILON * probe.last_range()))
            .over(Interval::of(probe.sample_pitch));
        let limits = [(sample, probe.samples), (line, probe.lines.len()), (slice, probe.slices.len())];
        let last = |count: usize| (count - 1) as f64;
        if limits.iter().any(|(at, count)| at.high < 0.0 || at.low > last(*count)) {
            return None;
        }
        let surely = limits.iter().all(|(at, count)| at.low >= 0.0 && at.high <= last(*count));
        let grid = &self.line.scene.grid;
        let on_grid = |v: Interval, n: usize| (v - Interval::of(grid.origin[n])).over(Interval::of(grid.pitch[n]));
        Some(([on_grid(x, 0), on_grid(depth, 1), slice], surely))
    }

    /// The slice index over intervals of position and line: it rises with the position, and its extremes by the line are at the ends,
    /// since the position of a slice is linear in the line.
    fn slice(&self, probe: &Probe, position: Interval, line: Interval) -> Interval {
        if probe.slices.len() == 1 {
            return Interval::ZERO;
        }
        let lines = if probe.advance == Advance::None { [0.0; 2] } else { [line.low, line.high] };
        let ends = [position.low, position.high].into_iter().flat_map(|p| lines.map(|l| probe.slice_index(p, l)));
        let (low, high) = ends.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let travel = (0..probe.slices.len()).map(|k| probe.advance_at(k as f64).abs()).fold(0.0, f64::max);
        Interval { low, high }.widened(slack_of_index(
            &probe.slices,
            position.magnitude() + travel,
            low.abs().max(high.abs()),
        ))
    }
}

/// By how much an interval reaches out of its cell, in texels.
fn overshoot(at: Interval, cell: usize) -> f64 {
    let beyond = (cell as f64 - at.low).max(at.high - (cell + 1) as f64);
    if beyond > 0.0 { beyond.next_up() } else { 0.0 }
}

/// Error of an index: at most 16 roundings, of terms as large as the positions over the smallest pitch, and of the index itself.
fn slack_of_index(axis: &Axis, largest: f64, index: f64) -> f64 {
    let pitch = match axis {
        Axis::Even { pitch, .. } => *pitch,
        Axis::Table(table) => table.windows(2).map(|p| p[1] - p[0]).fold(f64::MAX, f64::min),
    };
    let positions = largest + axis.first().abs().max(axis.last().abs());
    16.0 * f64::EPSILON * (1.0 + index + positions / pitch.max(1e-300))
}

/// Fractional index of positions along an axis, which rises with them.
fn index_on(axis: &Axis, at: Interval) -> Interval {
    let (low, high) = (axis.index_of(at.low), axis.index_of(at.high));
    Interval { low, high }.widened(slack_of_index(axis, at.magnitude(), low.abs().max(high.abs())))
}

/// The trilinear function of a cell at shares of its edges. Each share is used once for each pair of values, so that intervals as narrow
/// as rounding stay so.
fn trilinear(corners: &[Interval; 8], [x, y, z]: [Interval; 3]) -> Interval {
    let mix = |a: Interval, b: Interval, share: Interval| a + (b - a) * share;
    let row = |n: usize| mix(corners[n], corners[n + 1], x);
    mix(mix(row(0), row(2), y), mix(row(4), row(6), y), z)
}
