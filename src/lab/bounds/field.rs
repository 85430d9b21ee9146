//! Proven range of the field over a part of a ray, by interval coordinates and the extremes of the function of a cell.
//!
//! Across slices that function is linear, or a cubic B-spline (`ray.elevation=bspline`); within slices it is bilinear. Both have Bernstein
//! coefficients over the part: the values at its ends, or the polar form (blossom) of the cubic at mixed ends (Ramshaw 1989). Through a
//! Cartesian volume the field within a cell is a polynomial of the position, of degree 3 or 5. Its Bernstein coefficients are means of the
//! function at mixed corners of the two ends, and their hull contains it. Through a swept volume the coordinates over the part are
//! intervals, and the function over a box lies in the hull of its coefficients at the corners of the box. If rounding of its ends makes a
//! part reach over the face of a cell, the range is widened by the possible change of the field there.

use super::interval::Interval;
use crate::exact_ray::Line;
use crate::passes::Texels;
use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use std::f64::consts::FRAC_PI_2;

/// The samples of a volume along a line, as intervals.
pub struct Field<'a> {
    pub line: &'a Line<'a>,
    pub volume: &'a Texels,
    /// The texel values that become 0 and 1.
    pub window: [f64; 2],
    /// Smallest and largest texel of the volume.
    pub range: [f64; 2],
}

impl Field<'_> {
    /// What is proven of the part of the line between two positions on it, mm from its `base` along its direction; `from` is at most `to`. None if
    /// the whole part is outside the insonified region. Otherwise wherever the part is inside, its windowed samples, clamped to 0..1, are within
    /// the interval; true if all of it is surely inside.
    pub fn content(&self, from: f64, to: f64) -> Option<(Interval, bool)> {
        match &self.line.scene.geometry {
            Geometry::Cartesian(_) => Some((self.along_a_line(from, to), true)),
            Geometry::Sweep(probe) => self
                .sweep(probe, Interval::between(from, to))
                .map(|(at, surely_inside)| (self.over_a_box(at), surely_inside)),
        }
    }

    fn place(&self, axis: usize, s: Interval) -> Interval {
        Interval::of(self.line.base[axis]) + Interval::of(self.line.direction[axis]) * s
    }

    fn windowed(&self, value: f64) -> Interval {
        let [black, white] = self.window;
        (Interval::of(value) - Interval::of(black)).over(Interval::of(white) - Interval::of(black))
    }

    /// Stretched values of the texels of a cell, slice by slice: of two slices, or of four for a B-spline. Bit 0 of the index in a slice: the higher
    /// column, bit 1: row.
    fn texels(&self, cell: [i64; 3]) -> [[Interval; 4]; 4] {
        let first = if self.is_spline() { -1 } else { 0 };
        std::array::from_fn(|slice| {
            std::array::from_fn(|corner| {
                let at = |axis: usize, bit: usize| cell[axis] + (corner >> bit & 1) as i64;
                self.windowed(self.volume.clamped(at(0, 0), at(1, 1), cell[2] + slice as i64 + first))
            })
        })
    }

    fn is_spline(&self) -> bool {
        self.line.scene.takes_bspline()
    }

    /// Bernstein coefficients of the cell's function across slices from one share to another, for each column and row: two, or four of a cubic.
    fn across(&self, texels: &[[Interval; 4]; 4], ends: [Interval; 2]) -> Vec<[Interval; 4]> {
        let each =
            |of: &dyn Fn([Interval; 4]) -> Interval| std::array::from_fn(|n| of(std::array::from_fn(|k| texels[k][n])));
        match self.is_spline() {
            false => ends.iter().map(|share| each(&|[a, b, ..]| mix(a, b, *share))).collect(),
            true => (0..4usize)
                .map(|far| {
                    let arguments = std::array::from_fn(|n| ends[usize::from(n < far)]);
                    each(&|slices| blossom(slices, arguments))
                })
                .collect(),
        }
    }

    /// By how much the field may be outside of the function of a part's cell, in largest steps of stretched values; `beyond`: by how much the part
    /// reaches over a face, texels. None if the function's continuation is not bounded here.
    fn slack(&self, beyond: f64) -> Option<f64> {
        // Both the field and the cell's own function, continued, leave the face at no more than this slope. Beyond by 0.3 texels the weights
        // of the cubic's derivative still have one sign, and those of the cubic magnitudes of less than 1 + 2 beyond.
        let most = if self.is_spline() { 0.3 } else { 1.0 };
        (beyond <= most).then(|| beyond * (1.0 + (1.0 + 2.0 * beyond).powi(2)) * 1.000_001)
    }

    /// How much stretched values may change from one texel to the next.
    fn steepest(&self) -> f64 {
        (self.windowed(self.range[1]) - self.windowed(self.range[0])).magnitude()
    }

    fn everything(&self) -> Interval {
        self.windowed(self.range[0]).hull(self.windowed(self.range[1])).clamped()
    }

    /// The cell of a coordinate interval along an axis.
    fn cell(&self, axis: usize, at: Interval) -> i64 {
        // A B-spline goes on beyond the outer slices, whose texels it repeats.
        let reach = if self.goes_on(axis) { 1.0 } else { 0.0 };
        let last = self.volume.size[axis].saturating_sub(2) as f64;
        (at.low / 2.0 + at.high / 2.0).floor().clamp(-reach, last + reach) as i64
    }

    /// True if the field changes beyond the outer texels of an axis.
    fn goes_on(&self, axis: usize) -> bool {
        axis == 2 && self.is_spline() && self.volume.size[axis] > 1
    }

    fn along_a_line(&self, from: f64, to: f64) -> Interval {
        let mut ends = [from, to].map(|s| self.cartesian(Interval::of(s)));
        let (mut cell, mut slack) = ([0; 3], 0.0);
        for axis in 0..3 {
            let last = (self.volume.size[axis] - 1) as f64;
            let hull = ends[0][axis].hull(ends[1][axis]);
            // Beyond the border the field repeats it.
            if !self.goes_on(axis) && (hull.high <= 0.0 || hull.low >= last) {
                let border = if hull.high <= 0.0 { 0.0 } else { last };
                ends.iter_mut().for_each(|end| end[axis] = Interval::of(border));
            }
            let hull = ends[0][axis].hull(ends[1][axis]);
            cell[axis] = self.cell(axis, hull);
            let Some(more) = self.slack(overshoot(hull, cell[axis])) else { return self.everything() };
            slack += more;
        }
        let share = |end: usize, axis: usize| ends[end][axis] - Interval::of(cell[axis] as f64);
        let across = self.across(&self.texels(cell), [share(0, 2), share(1, 2)]);
        // The polar form: of the arguments of all axes, as many as the coefficient's number are those of the far end.
        let degree = across.len() + 1;
        let coefficient = |number: usize| {
            let mut sum = Interval::ZERO;
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let slices = number.checked_sub(x + y).and_then(|far| Some((far, across.get(far)?)));
                if let Some((far, values)) = slices {
                    let ways = Interval::of(choose(across.len() - 1, far));
                    sum = sum + ways * bilinear(values, [share(x, 0), share(y, 1)]);
                }
            }
            sum.over(Interval::of(choose(degree, number)))
        };
        let hull = (0..=degree).map(coefficient).reduce(Interval::hull).unwrap_or(Interval::ZERO);
        hull.widened((slack * self.steepest()).next_up()).clamped()
    }

    fn over_a_box(&self, at: [Interval; 3]) -> Interval {
        let (mut cell, mut slack) = ([0; 3], 0.0);
        let mut shares = [Interval::ZERO; 3];
        for axis in 0..3 {
            let last = (self.volume.size[axis] - 1) as f64;
            let inner = Interval { low: at[axis].low.clamp(0.0, last), high: at[axis].high.clamp(0.0, last) };
            let within = (last - 1.0).max(0.0);
            cell[axis] = (inner.low / 2.0 + inner.high / 2.0).floor().clamp(0.0, within) as i64;
            let beyond = overshoot(inner, cell[axis]);
            if beyond > 1.0 {
                return self.everything();
            }
            slack += beyond * 1.000_001;
            shares[axis] = (inner - Interval::of(cell[axis] as f64)).clamped();
        }
        let [x, y, z] = shares.map(|share| [share.low, share.high].map(Interval::of));
        let corners = x.into_iter().flat_map(|x| y.map(|y| [x, y]));
        let across = self.across(&self.texels(cell), z);
        let values = corners.flat_map(|at| across.iter().map(move |values| bilinear(values, at)));
        let hull = values.reduce(Interval::hull).unwrap_or(Interval::ZERO);
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
fn overshoot(at: Interval, cell: i64) -> f64 {
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

/// Between two values. The share is used once, so that intervals as narrow as rounding stay so.
fn mix(a: Interval, b: Interval, share: Interval) -> Interval {
    a + (b - a) * share
}

fn bilinear(values: &[Interval; 4], [x, y]: [Interval; 2]) -> Interval {
    mix(mix(values[0], values[1], x), mix(values[2], values[3], x), y)
}

/// The polar form of the uniform cubic B-spline between the second and the third of four slices, at three shares 0..1 of the way: of three
/// equal ones its value (Ramshaw 1989, "Blossoms are polar forms").
fn blossom([a, b, c, d]: [Interval; 4], [u, v, w]: [Interval; 3]) -> Interval {
    let between = |from: Interval, to: Interval, share: Interval, more: f64, length: f64| {
        mix(from, to, (share + Interval::of(more)).over(Interval::of(length)))
    };
    let [first, second, third] = [between(a, b, u, 2.0, 3.0), between(b, c, u, 1.0, 3.0), between(c, d, u, 0.0, 3.0)];
    mix(between(first, second, v, 1.0, 2.0), between(second, third, v, 0.0, 2.0), w)
}

/// n over k.
fn choose(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}
