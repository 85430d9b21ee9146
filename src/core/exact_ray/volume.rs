//! Emission and absorption along a ray, integrated:
//!
//! ```text
//! I = integral of c(v) kappa(v) exp(-K) ds, K(s) = integral of kappa(v) from the entry to s, opacity = 1 - exp(-K(end))
//! ```
//!
//! with the transfer function itself, colour and opacity linear between its points, not its table. kappa is -ln(1 - opacity) per reference
//! length, or the opacity times `volume.extinction`; it is multiplied by what `region.fade` leaves of the matter at the place. The rays
//! of the program approximate this integral by a sum (`passes::raycast::composite`).
//!
//! A ray is cut where its field is that of a point of the transfer function, 0, 1 or the threshold, and where the fade has a kink. On a piece
//! between two cuts the integrand is smooth: 15 Gauss-Kronrod nodes integrate it, with the depth K at the nodes by the polynomial through kappa at the same
//! nodes. A piece whose rules of 7 and 15 nodes differ is halved.

use super::fade::Fade;
use super::field::Segment;
use super::gauss_kronrod::{COUNT, RULE};
use super::polynomial::bracketed;
use crate::passes::raycast::volume::{depth_axis, reference_length};
use crate::scene::transfer::{self, Absorption};
use crate::scene::{Scene, Shading, TransferPoint};

/// The composited light of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Red, green and blue, premultiplied, and opacity.
    pub rgba: [f64; 4],
    /// Distance along the ray at which the opacity reaches `volume.hit`, mm. None if it never does.
    pub hit: Option<f64>,
    /// Sum over all pieces of the difference between the 7-point and the 15-point rule: an estimate of the error of each channel, usually much too
    /// large.
    pub estimate: f64,
    /// Number of pieces that were integrated.
    pub pieces: u64,
}

/// Depth of an opaque ray: 1 - exp(-36.8) is 1 in f64.
const OPAQUE_DEPTH: f64 = 36.8;

/// How colour and opacity depend on the value between two neighbouring levels: `base + rise v`.
#[derive(Clone, Copy, Debug)]
struct Linear {
    base: [f64; 4],
    rise: [f64; 4],
    transparent: bool,
}

/// Colour and absorption of the matter on a ray, as a function of the field (the windowed sample value).
#[derive(Clone, Debug)]
pub struct Medium<'a> {
    /// Values at which colour or opacity have a kink or a step, in rising order.
    levels: Vec<f64>,
    /// Between two levels, below the first, above the last.
    linear: Vec<Linear>,
    absorption: Absorption,
    /// What is left of the matter along the ray; none if it does not fade.
    fade: Option<Fade<'a>>,
    /// Factors of the colours at 0 mm along the ray, and their growth per mm; none if colours have no tint.
    tint: Option<[[f64; 3]; 2]>,
    hit_depth: f64,
    /// Largest difference of the two rules on one piece, in light.
    tolerance: f64,
}

impl<'a> Medium<'a> {
    /// The medium of a transfer function without fade or tint, in which no ray has a hit ([`Light::hit`]). `points`: control points in rising order,
    /// at least one; samples below `threshold` are transparent; a piece is halved until both quadrature rules differ by no more than `tolerance`.
    pub fn new(points: &[TransferPoint], threshold: f64, absorption: Absorption, tolerance: f64) -> Medium<'a> {
        let mut levels: Vec<f64> = [0.0, 1.0].into_iter().chain(points.iter().map(|p| p.at)).collect();
        levels.extend((threshold > 0.0).then_some(threshold));
        // Where the absorption ends to rise with the opacity.
        let opaque = absorption.opaque_from();
        levels.extend(points.windows(2).filter_map(|pair| {
            let [low, high] = [&pair[0], &pair[1]];
            let share = (opaque - low.opacity) / (high.opacity - low.opacity);
            (share > 0.0 && share < 1.0).then_some(low.at + share * (high.at - low.at))
        }));
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let linear = (0..=levels.len()).map(|n| {
            let (below, above) = (n.checked_sub(1).map(|n| levels[n]), levels.get(n).copied());
            let (Some(low), Some(high)) = (below, above) else {
                let end = below.or(above).unwrap_or(0.0);
                let rgba = transfer::at(points, end);
                return Linear { base: rgba, rise: [0.0; 4], transparent: end < threshold || rgba[3] == 0.0 };
            };
            // Two places strictly between the levels, so that a step at either belongs to its own side.
            let (a, b) = (low + 0.25 * (high - low), low + 0.75 * (high - low));
            let (at_a, at_b) = (transfer::at(points, a), transfer::at(points, b));
            let rise: [f64; 4] = std::array::from_fn(|c| (at_b[c] - at_a[c]) / (b - a));
            let base = std::array::from_fn(|c| at_a[c] - rise[c] * a);
            Linear { base, rise, transparent: a < threshold || (at_a[3] == 0.0 && at_b[3] == 0.0) }
        });
        let linear = linear.collect();
        Medium { levels, linear, absorption, fade: None, tint: None, hit_depth: f64::INFINITY, tolerance }
    }

    /// The medium that a scene's ray along `line` meets; the ray begins at `line.base`. A piece of the ray is halved until both quadrature rules
    /// differ by no more than `tolerance`.
    pub fn of(scene: &'a Scene, line: &super::Line<'a>, tolerance: f64) -> Medium<'a> {
        let volume = &scene.settings.volume;
        let points = transfer::of(volume);
        let absorption = Absorption::of(volume, reference_length(scene));
        let mut medium = Medium::new(&points, volume.threshold, absorption, tolerance);
        medium.fade = Fade::of(line);
        if volume.shading == Shading::DepthCoded {
            let (axis, near) = depth_axis(scene);
            let (start, rate) = (line.base.dot(axis) - near, line.direction.dot(axis));
            let apart = |c: usize| volume.far_tint[c] - volume.near_tint[c];
            medium.tint = Some([
                std::array::from_fn(|c| volume.near_tint[c] + apart(c) * start),
                std::array::from_fn(|c| apart(c) * rate),
            ]);
        }
        medium.hit_depth = transfer::absorption(volume.hit).min(OPAQUE_DEPTH);
        medium
    }

    /// The field values at which the transfer function has a kink or a jump, in rising order.
    pub fn levels(&self) -> &[f64] {
        &self.levels
    }

    fn linear_at(&self, value: f64) -> &Linear {
        &self.linear[self.levels.partition_point(|l| *l <= value)]
    }

    fn tinted(&self, s: f64, colour: [f64; 3]) -> [f64; 3] {
        match self.tint {
            Some([start, rate]) => std::array::from_fn(|c| colour[c] * (start[c] + rate[c] * s)),
            None => colour,
        }
    }

    /// Composites the segments of a ray, which are in order from the nearest on.
    pub fn light(&self, segments: &[Segment]) -> Light {
        let mut sum = Sum::default();
        let mut cuts = Vec::new();
        let kinks = match (&self.fade, segments.first(), segments.last()) {
            (Some(fade), Some(first), Some(last)) => fade.kinks([first.from, last.to]),
            _ => Vec::new(),
        };
        for segment in segments {
            cut(segment, &self.levels, &mut cuts);
            cut_at_places(segment, &kinks, &mut cuts);
            for pair in cuts.windows(2) {
                let linear = self.linear_at(segment.field.at((pair[0] + pair[1]) / 2.0));
                if !linear.transparent {
                    self.integrate(&Piece { segment, linear }, [pair[0], pair[1]], 0, &mut sum);
                }
                // What is behind is not seen: exp(-46) is 1e-20.
                if sum.depth > 46.0 {
                    return sum.light();
                }
            }
        }
        sum.light()
    }

    fn integrate(&self, piece: &Piece, [from, to]: [f64; 2], halvings: u32, sum: &mut Sum) {
        if sum.depth > 46.0 {
            return;
        }
        let half = (to - from) / 2.0;
        let scale = half * piece.segment.half();
        let place = |n: usize| from + half * (1.0 + RULE.nodes[n]);
        let (mut absorbed, mut colours) = ([0.0; COUNT], [[0.0; 3]; COUNT]);
        for n in 0..COUNT {
            let value = piece.segment.field.at(place(n));
            absorbed[n] = self.absorbed(piece, place(n), value);
            colours[n] = self.tinted(piece.segment.place(place(n)), piece.colour(value));
        }
        let depths = RULE.running(&absorbed);
        let emitted: [f64; COUNT] = std::array::from_fn(|n| absorbed[n] * (-depths[n] * scale).exp());
        let [depth, depth_by_7] = RULE.integrals(&absorbed).map(|v| v * scale);
        let light: [[f64; 2]; 3] = std::array::from_fn(|c| {
            RULE.integrals(&std::array::from_fn(|n| emitted[n] * colours[n][c])).map(|v| v * scale)
        });
        let [opacity, opacity_by_7] = RULE.integrals(&emitted).map(|v| v * scale);
        let left = (-sum.depth).exp();
        let off = light.iter().chain([&[opacity, opacity_by_7]]).map(|[a, b]| (a - b).abs()).fold(0.0, f64::max);
        // The two rules agree on nothing if the light is not what the depth says.
        let off = off.max((opacity + (-depth).exp_m1()).abs());
        let off = left * (off + (depth - depth_by_7).abs().min(1.0));
        if off > self.tolerance && halvings < 60 {
            let middle = from + half;
            self.integrate(piece, [from, middle], halvings + 1, sum);
            self.integrate(piece, [middle, to], halvings + 1, sum);
            return;
        }
        if sum.hit.is_none() && sum.depth + depth >= self.hit_depth {
            let wanted = self.hit_depth - sum.depth;
            let found = bracketed(|x| self.depth(piece, from, x) - wanted, from, to);
            sum.hit = Some(piece.segment.place(found.unwrap_or(to)));
        }
        for (total, [light, _]) in sum.colour.iter_mut().zip(light) {
            *total += left * light;
        }
        sum.depth += depth;
        sum.estimate += off;
        sum.pieces += 1;
    }

    /// Depth of the part of a piece between two places in -1..1.
    fn depth(&self, piece: &Piece, from: f64, to: f64) -> f64 {
        let half = (to - from) / 2.0;
        let values = std::array::from_fn(|n| {
            let place = from + half * (1.0 + RULE.nodes[n]);
            self.absorbed(piece, place, piece.segment.field.at(place))
        });
        RULE.integrals(&values)[0] * half * piece.segment.half()
    }

    /// Absorption per mm at a place in -1..1 of a piece's segment, where the field has this value.
    fn absorbed(&self, piece: &Piece, place: f64, value: f64) -> f64 {
        let left = self.fade.map_or(1.0, |fade| fade.at(piece.segment.place(place)));
        self.absorption.over_length(piece.opacity(value)) / self.absorption.reference_length * left
    }
}

/// Fills `cuts` with -1, 1 and, between them in rising order, every position at which the segment's field has one of the levels.
pub fn cut(segment: &Segment, levels: &[f64], cuts: &mut Vec<f64>) {
    cuts.clear();
    cuts.push(-1.0);
    let [low, high] = segment.field.range();
    for level in levels.iter().filter(|l| low - 1e-14 <= **l && **l <= high + 1e-14) {
        segment.field.plus(-level).roots(cuts);
    }
    cuts.push(1.0);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|later, earlier| *later - *earlier <= 4.0 * f64::EPSILON);
}

/// Adds to the cuts of a segment those of the places, mm along the ray, that are within it.
fn cut_at_places(segment: &Segment, places: &[f64], cuts: &mut Vec<f64>) {
    let before = cuts.len();
    let within = places.iter().filter(|s| **s > segment.from && **s < segment.to);
    cuts.extend(within.map(|s| ((s - segment.middle()) / segment.half()).clamp(-1.0, 1.0)));
    if cuts.len() > before {
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|later, earlier| *later - *earlier <= 4.0 * f64::EPSILON);
    }
}

struct Piece<'a> {
    segment: &'a Segment,
    linear: &'a Linear,
}

impl Piece<'_> {
    fn opacity(&self, value: f64) -> f64 {
        self.linear.base[3] + self.linear.rise[3] * value
    }

    fn colour(&self, value: f64) -> [f64; 3] {
        std::array::from_fn(|c| self.linear.base[c] + self.linear.rise[c] * value)
    }
}

#[derive(Default)]
struct Sum {
    colour: [f64; 3],
    depth: f64,
    hit: Option<f64>,
    estimate: f64,
    pieces: u64,
}

impl Sum {
    fn light(&self) -> Light {
        let [r, g, b] = self.colour;
        let opacity = transfer::opacity(self.depth);
        Light { rgba: [r, g, b, opacity], hit: self.hit, estimate: self.estimate, pieces: self.pieces }
    }
}
