//! Bounds of the light of a ray. The opacity and colours of each part are ranges, which are composited from back to front with both ends of
//! the opacity. Parts are halved where that narrows the result most.

use super::field::Field;
use super::interval::Interval;
use crate::exact_ray::Line;
use crate::scene::TransferPoint;
use crate::scene::transfer::{self, Absorption};
use glam::DVec3;

/// The transfer function, evaluated on intervals of sample values.
#[derive(Clone, Debug)]
pub struct Medium {
    /// The control points of the transfer function by ascending sample value ([`transfer::of`]).
    pub points: Vec<TransferPoint>,
    /// Samples below it are transparent.
    pub threshold: f64,
    pub absorption: Absorption,
    /// Factors of the colours at 0 mm along the ray, and their growth per mm. None: the colours are as they are.
    pub tint: Option<[[Interval; 3]; 2]>,
    /// Scales the absorption. None: it is not scaled.
    pub fade: Option<Fade>,
}

impl Medium {
    /// Red, green, blue and absorption per mm over a range of values in 0..1.
    fn over(&self, values: Interval) -> ([Interval; 3], Interval) {
        let mut all = self.at(values.low);
        let ends = self.points.iter().filter(|p| values.low < p.at && p.at < values.high);
        for rgba in ends.map(rgba).chain([self.at(values.high)]) {
            all = std::array::from_fn(|c| all[c].hull(rgba[c]));
        }
        let per_mm = |opacity: Interval| {
            let length = Interval::of(self.absorption.reference_length);
            match self.absorption.extinction {
                Some(extinction) => {
                    (opacity * Interval::of(extinction)).at_most(Interval::of(transfer::OPAQUE).over(length))
                }
                None => opacity.absorption(transfer::OPAQUE).over(length),
            }
        };
        let mut absorption = per_mm(all[3].clamped());
        if values.low < self.threshold {
            absorption.low = 0.0;
        }
        if values.high < self.threshold {
            absorption = Interval::ZERO;
        }
        // Rounding outwards makes no matter.
        absorption.low = absorption.low.max(0.0);
        ([all[0], all[1], all[2]], absorption)
    }

    fn at(&self, value: f64) -> [Interval; 4] {
        let after = self.points.partition_point(|p| p.at <= value);
        let before = after.checked_sub(1).and_then(|n| self.points.get(n));
        match (before, self.points.get(after)) {
            (Some(low), Some(high)) => {
                let from = Interval::of(low.at);
                let share = (Interval::of(value) - from).over(Interval::of(high.at) - from);
                let (low, high) = (rgba(low), rgba(high));
                std::array::from_fn(|c| low[c] + (high[c] - low[c]) * share)
            }
            (Some(end), None) | (None, Some(end)) => rgba(end),
            (None, None) => [Interval::ZERO; 4],
        }
    }
}

/// Red, green, blue and opacity of a control point.
fn rgba(TransferPoint { colour: [r, g, b], opacity, .. }: &TransferPoint) -> [Interval; 4] {
    [*r, *g, *b, *opacity].map(Interval::of)
}

/// The factor 0..1 by which `region.fade` scales the matter along a ray ([`Scene::faded`](crate::scene::Scene::faded)), as intervals.
#[derive(Clone, Copy, Debug)]
pub struct Fade {
    /// The place at 0 mm along the ray, and its unit direction.
    base: DVec3,
    direction: DVec3,
    /// The box towards whose faces matter fades, mm.
    low: DVec3,
    high: DVec3,
    /// mm.
    length: f64,
}

impl Fade {
    /// None if the line's scene has no fade.
    pub fn of(line: &Line) -> Option<Fade> {
        let (low, high) = (line.scene.volume_view().low, line.scene.high);
        line.scene.region_fade().map(|length| Fade { base: line.base, direction: line.direction, low, high, length })
    }

    /// The shares that are left over a part of the ray.
    fn over(&self, s: Interval) -> Interval {
        let place = |axis: usize| Interval::of(self.base[axis]) + Interval::of(self.direction[axis]) * s;
        let to_low = |axis: usize| place(axis) - Interval::of(self.low[axis]);
        let to_high = |axis: usize| Interval::of(self.high[axis]) - place(axis);
        let to_faces = [to_low(0).at_most(to_high(0)), to_high(1), to_low(2).at_most(to_high(2))];
        let squares = to_faces.map(|distance| {
            let beyond = Interval::ONE - distance.over(Interval::of(self.length));
            Interval { low: beyond.low.max(0.0), high: beyond.high.max(0.0) }.square()
        });
        let left = (Interval::ONE - (squares[0] + squares[1] + squares[2]).root()).clamped();
        // The smooth step rises: its extremes are at the ends.
        let step = |t: f64| {
            let t = Interval::of(t);
            t * t * (Interval::of(3.0) - Interval::of(2.0) * t)
        };
        Interval { low: step(left.low).low, high: step(left.high).high }.clamped()
    }
}

/// A part of a ray: what it adds to the light behind it.
#[derive(Clone, Copy, Debug)]
struct Part {
    from: f64,
    to: f64,
    opacity: Interval,
    /// Red, green, blue, and 1 for the opacity.
    colour: [Interval; 4],
}

/// Proven bounds of the light of one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Bounds of red, green, blue and opacity.
    pub rgba: [Interval; 4],
    /// Number of parts of the ray, without those that are surely transparent.
    pub parts: usize,
}

impl Bounds {
    /// Width, upper less lower bound, of the widest channel.
    pub fn width(&self) -> f64 {
        self.rgba.iter().map(|c| c.width()).fold(0.0, f64::max)
    }
}

/// The bounds of a ray. Parts of the ray are halved until the widest channel is no wider than `target`, `enough` is true for the bounds, there are
/// `most` parts that are not surely transparent, or no part can be halved. `hints`: positions on the field's line in rising order, mm, at which parts
/// end at first, even if these are more than `most`. The first and last are the ray's ends. The bounds are valid for any positions between them;
/// positions at the faces of cells make them narrower.
pub fn bounds(
    field: &Field,
    medium: &Medium,
    hints: &[f64],
    target: f64,
    most: usize,
    enough: impl Fn(&Bounds) -> bool,
) -> Bounds {
    let part = |from: f64, to: f64| part(field, medium, from, to);
    let mut parts: Vec<Part> = hints.windows(2).filter(|p| p[1] > p[0]).filter_map(|p| part(p[0], p[1])).collect();
    loop {
        let found = Bounds { rgba: composited(&parts), parts: parts.len() };
        if found.width() <= target || parts.len() >= most || enough(&found) {
            return found;
        }
        let doubt = doubts(&parts);
        // Those that hold most of the doubt; a part that cannot be halved is left.
        let mut order: Vec<usize> = (0..parts.len()).filter(|n| divisible(&parts[*n])).collect();
        order.sort_by(|a, b| doubt[*b].total_cmp(&doubt[*a]));
        let total: f64 = order.iter().map(|n| doubt[*n]).sum();
        let mut halved = vec![false; parts.len()];
        let (mut covered, mut count) = (0.0, 0);
        for n in order {
            if covered >= 0.7 * total || count + parts.len() >= most {
                break;
            }
            covered += doubt[n];
            count += 1;
            halved[n] = true;
        }
        if count == 0 {
            return found;
        }
        let split = |(n, p): (usize, &Part)| match halved[n] {
            false => [Some(*p), None],
            true => {
                let middle = p.from + (p.to - p.from) / 2.0;
                [part(p.from, middle), part(middle, p.to)]
            }
        };
        parts = parts.iter().enumerate().flat_map(split).flatten().collect();
    }
}

fn divisible(part: &Part) -> bool {
    part.to - part.from > 1e-9 * part.to.abs().max(1.0)
}

/// None where nothing is, or all is transparent.
fn part(field: &Field, medium: &Medium, from: f64, to: f64) -> Option<Part> {
    let (values, surely_inside) = field.content(from, to)?;
    let (mut colour, mut absorption) = medium.over(values);
    if absorption.high <= 0.0 {
        return None;
    }
    if !surely_inside {
        absorption.low = 0.0;
    }
    if let Some(fade) = &medium.fade {
        absorption = absorption * fade.over(Interval::between(from, to));
        absorption.low = absorption.low.max(0.0);
    }
    if let Some([start, rate]) = &medium.tint {
        let s = Interval::between(from, to);
        colour = std::array::from_fn(|c| colour[c] * (start[c] + rate[c] * s));
    }
    let length = Interval::of(to) - Interval::of(from);
    let [r, g, b] = colour;
    Some(Part { from, to, opacity: (absorption * length).opacity(), colour: [r, g, b, Interval::ONE] })
}

/// From back to front: light a c + (1 - a) behind. It is linear in the opacity a, so that its extremes are at the ends of a, and it rises
/// with the colour and with what is behind.
fn composited(parts: &[Part]) -> [Interval; 4] {
    let mut behind = [Interval::ZERO; 4];
    for part in parts.iter().rev() {
        for (behind, colour) in behind.iter_mut().zip(part.colour) {
            let over = |a: f64| {
                let (a, rest) = (Interval::of(a), Interval::ONE - Interval::of(a));
                a * colour + rest * *behind
            };
            let (thin, thick) = (over(part.opacity.low), over(part.opacity.high));
            *behind = thin.hull(thick);
        }
    }
    // No light is negative, and no opacity above 1: only rounding outwards is.
    let [r, g, b, opacity] = behind.map(|v| Interval { low: v.low.max(0.0), ..v });
    [r, g, b, Interval { high: opacity.high.min(1.0), ..opacity }]
}

/// How much each part widens the result, roughly: the light that reaches it times its own doubt.
fn doubts(parts: &[Part]) -> Vec<f64> {
    let mut left = 1.0;
    let each = parts.iter().map(|part| {
        let colours = part.colour.iter().map(|c| c.high - c.low).fold(0.0, f64::max);
        let doubt = left * ((part.opacity.high - part.opacity.low) + part.opacity.high * colours);
        left *= 1.0 - (part.opacity.low + part.opacity.high) / 2.0;
        doubt
    });
    each.collect()
}
