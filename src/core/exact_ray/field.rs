//! The field along a ray as polynomials: one or more for each cell of the texture that the ray crosses.
//!
//! Within a cell the field is trilinear in the texture coordinates, or bilinear within slices and a cubic B-spline across them
//! (`ray.elevation=bspline`). The coordinates are linear along a ray through a Cartesian volume, where the field is a polynomial of degree
//! 3 or 5, and 4 or 6 values give it exactly; along a ray through a swept one they are smooth, and the field is interpolated by a
//! polynomial of degree 7, over parts of the cell so short that it agrees to rounding.

use super::coordinates::Line;
use super::polynomial::Polynomial;
use crate::passes::Texels;
use crate::probe::Geometry;

/// Largest difference, in stretched values, between the field of a swept volume and its polynomial at places between the nodes: ten
/// times the rounding of texture coordinates of a few hundred texels.
const AGREEMENT: f64 = 2e-13;
/// Times that a part of a cell may be halved.
const HALVINGS: u32 = 6;

/// A part of a ray on which the interpolated sample value (the field) is one polynomial.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Start of the segment, mm along the line from its `base`; `to` is its end.
    pub from: f64,
    pub to: f64,
    /// The sample value after the grey window, not clamped, with the segment mapped to -1..1.
    pub field: Polynomial,
    /// Estimated error of the polynomial: its largest difference from the interpolated samples at positions between its nodes.
    pub off: f64,
}

impl Segment {
    pub fn half(&self) -> f64 {
        (self.to - self.from) / 2.0
    }

    pub fn middle(&self) -> f64 {
        self.from + self.half()
    }

    /// Converts a position in -1..1 to mm along the ray.
    pub fn place(&self, x: f64) -> f64 {
        self.middle() + self.half() * x
    }
}

/// Returns the interpolated samples of the volume between two positions of a line, `ends` in mm, as polynomials. There are gaps where the line is
/// outside the insonified region of a swept volume. Beyond the border of a Cartesian volume the nearest texels count. `window`: the grey values that
/// become 0 and 1.
pub fn segments(line: &Line, volume: &Texels, window: [f64; 2], ends: [f64; 2]) -> Vec<Segment> {
    let mut found = Vec::new();
    if ends[1] <= ends[0] {
        return found;
    }
    let swept = matches!(line.scene.geometry, Geometry::Sweep(_));
    for pair in line.breakpoints(ends).windows(2) {
        let middle = (pair[0] + pair[1]) / 2.0;
        if swept && !line.is_inside(middle) {
            continue;
        }
        let cell = Cell::at(line, volume, window, middle);
        match swept {
            true => cell.interpolate(pair[0], pair[1], 0, &mut found),
            false => found.push(cell.segment(cell.coefficients(), pair[0], pair[1])),
        }
    }
    found
}

/// Weights of the slices k - 1 to k + 2 at a share 0..1 of the way from slice k to the next: the uniform cubic B-spline.
fn spline(t: f64) -> [f64; 4] {
    let left = 1.0 - t;
    let inner = |t: f64| (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    [left * left * left / 6.0, inner(t), inner(left), t * t * t / 6.0]
}

/// The texels that one cell of the volume is interpolated from: those of the two slices around it, or of four slices for a B-spline. Beyond the
/// border the nearest texel counts.
pub struct Cell<'a> {
    line: &'a Line<'a>,
    size: [usize; 3],
    low: [f64; 3],
    /// Stretched values of the texels, slice by slice; bit 0 of the index in a slice: the higher column, bit 1: row.
    texels: [[f64; 4]; 4],
}

impl Cell<'_> {
    fn at<'a>(line: &'a Line<'a>, volume: &Texels, [black, white]: [f64; 2], s: f64) -> Cell<'a> {
        let low = line.coordinates(s).map(f64::floor);
        let first = if line.scene.takes_bspline() { -1 } else { 0 };
        let texels = std::array::from_fn(|slice| {
            std::array::from_fn(|corner| {
                let at = |axis: usize, by: i64| low[axis] as i64 + by;
                let [column, row] = [corner & 1, corner >> 1].map(|bit| bit as i64);
                (volume.clamped(at(0, column), at(1, row), at(2, slice as i64 + first)) - black) / (white - black)
            })
        });
        Cell { line, size: volume.size, low, texels }
    }

    /// The field at s, by the function of this cell.
    fn value(&self, s: f64) -> f64 {
        let at = self.line.coordinates(s);
        // Beyond the border all texels of an axis are equal.
        let share: [f64; 3] =
            std::array::from_fn(|axis| if self.size[axis] > 1 { at[axis] - self.low[axis] } else { 0.0 });
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let slice = |[a, b, c, d]: [f64; 4]| mix(mix(a, b, share[0]), mix(c, d, share[0]), share[1]);
        match self.line.scene.takes_bspline() {
            true => spline(share[2]).iter().zip(self.texels).map(|(weight, texels)| weight * slice(texels)).sum(),
            false => mix(slice(self.texels[0]), slice(self.texels[1]), share[2]),
        }
    }

    /// Number of coefficients of the field along a line whose texture coordinates are linear.
    fn coefficients(&self) -> usize {
        if self.line.scene.takes_bspline() { 6 } else { 4 }
    }

    /// The segment whose polynomial has `count` coefficients.
    fn segment(&self, count: usize, from: f64, to: f64) -> Segment {
        let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
        let field = Polynomial::through(count, |x| self.value(middle + half * x));
        let off = |x: f64| (field.at(x) - self.value(middle + half * x)).abs();
        let between: &[f64] = if count < 8 { &[0.1] } else { &[-1.0, -0.7, 0.1, 0.95] };
        Segment { from, to, field, off: between.iter().map(|x| off(*x)).fold(0.0, f64::max) }
    }

    /// The polynomial of degree 7 if it agrees with the field between the nodes, else those of both halves.
    fn interpolate(&self, from: f64, to: f64, halvings: u32, found: &mut Vec<Segment>) {
        let segment = self.segment(8, from, to);
        let scale = self.texels.iter().flatten().fold(1.0, |most: f64, v| most.max(v.abs()));
        if segment.off <= AGREEMENT * scale || halvings == HALVINGS || to - from < 1e-9 {
            found.push(segment);
            return;
        }
        let middle = segment.middle();
        self.interpolate(from, middle, halvings + 1, found);
        self.interpolate(middle, to, halvings + 1, found);
    }
}
