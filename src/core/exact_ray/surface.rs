//! The surface detector of docs/numerics.md as a function of the place, without samples:
//!
//! ```text
//! D(t) = mean of the field over [t, t + h] - mean over [t - h, t]
//! ```
//!
//! from the integral of the field along the ray, which is known exactly. Between the places at which t, t - h or t + h enters another
//! cell, D is a polynomial: crossings of the threshold and largest values are its roots and stationary places.
//!
//! Only the detector by a plain threshold has this form, without a rough search: the noise that the others learn, and the
//! steps of the rough search, are defined by samples ([`fault`]).

use super::coordinates::Line;
use super::field::{Segment, segments};
use super::polynomial::{Polynomial, bracketed};
use super::projection::integral_between;
use super::volume::cut;
use crate::passes::Texels;
use crate::scene::{Detector, Edge, EdgeName, Place, Scene, Sign};

/// Share of the largest difference below which an edge has been followed.
const FOLLOW_LEVEL: f64 = 0.7;

/// A surface that was found on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Position of the surface, mm along the line from its base.
    pub place: f64,
    /// Mean field over one edge length (`surface.edge`) behind the place where the detector's difference is largest. If `surface.place` is the first
    /// crossing, it is taken behind the crossing of the threshold.
    pub echo: f64,
    /// Mean field over the depth behind the surface that skin shading (`light.skin`) averages. Places outside the insonified region count as 0. It is
    /// 0 unless the skin is translucent.
    pub behind: f64,
    /// Estimated error of the position, mm: the error of the detector's difference (or of its slope, at a maximum), divided by its slope there.
    pub off: f64,
}

/// Why the scene's surface detector is not defined without discrete samples, and what to set instead. The text follows a colon. None if it is
/// defined.
pub fn fault(scene: &Scene) -> Option<&'static str> {
    let surface = &scene.settings.surface;
    match surface {
        _ if surface.edge == Some(Edge::Named(EdgeName::Samples)) => {
            Some("surface.edge=samples counts steps: set surface.edge to a length in mm")
        }
        _ if surface.rough > 1 => Some("surface.rough searches by steps of its own: set surface.rough=1"),
        _ if surface.sign == Sign::Any => Some(
            "surface.sign=any takes the size of the difference, which is no polynomial: set surface.sign=bright or dark",
        ),
        _ if surface.detector != Detector::Threshold => {
            Some("surface.detector learns noise from samples, or asks neighbours: set surface.detector=threshold")
        }
        _ => None,
    }
}

/// Finds the scene's surface on a line, between 0 and `path` mm from its base. None if there is none. `before`: length of the line in front of the
/// base that the detector may use, mm. Adds the number of pieces that were integrated to `pieces`.
pub fn surface(line: &Line, volume: &Texels, path: f64, before: f64, pieces: &mut u64) -> Option<Found> {
    let scene = line.scene;
    let edge = scene.ring.step * f64::from(scene.ring.half);
    let window = scene.surface_view().window;
    let depth = scene.settings.light.skin.map_or(0.0, |skin| skin.depth);
    let behind = if scene.samples_behind() > 0 { depth } else { 0.0 };
    let ends = [-edge.min(before), path + (3.0 * edge).max(behind)];
    let segments = segments(line, volume, window, ends);
    let limit = path + 3.0 * edge;
    let mut seen = 0;
    let runs = runs(&segments);
    *pieces += runs.iter().map(|run| run.parts.len() as u64).sum::<u64>();
    for run in &runs {
        let search = Search { scene, run, edge, limit };
        match search.surface(&mut seen) {
            End::Found(place, echo, off) if (0.0..=path).contains(&place) => {
                let mean = |from: f64| {
                    let inside = runs.iter().map(|r| r.between(from, from + behind)).sum::<f64>();
                    if behind > 0.0 { inside / behind } else { 0.0 }
                };
                return Some(Found { place, echo, behind: mean(place), off });
            }
            End::Found(..) | End::Nothing => return None,
            End::Run => {}
        }
    }
    None
}

/// Segments without a gap between them, and the integral of the clamped field.
struct Run {
    /// Ends of parts with one polynomial each, mm, in rising order.
    ends: Vec<f64>,
    /// Integral from the run's beginning to each end, mm.
    integrals: Vec<f64>,
    /// Segment, and the places in -1..1 at which each part begins and ends.
    parts: Vec<(Segment, [f64; 2])>,
}

fn runs(segments: &[Segment]) -> Vec<Run> {
    let mut found: Vec<Run> = Vec::new();
    let mut cuts = Vec::new();
    for segment in segments {
        let connected = found.last().and_then(|r| r.ends.last()).is_some_and(|end| *end == segment.from);
        if !connected {
            found.push(Run { ends: vec![segment.from], integrals: vec![0.0], parts: Vec::new() });
        }
        let Some(run) = found.last_mut() else { continue };
        cut(segment, &[0.0, 1.0], &mut cuts);
        for pair in cuts.windows(2) {
            let so_far = run.integrals.last().copied().unwrap_or(0.0);
            run.integrals.push(so_far + integral_between(segment, pair[0], pair[1]));
            run.ends.push(if pair[1] == 1.0 { segment.to } else { segment.place(pair[1]) });
            run.parts.push((*segment, [pair[0], pair[1]]));
        }
    }
    found
}

impl Run {
    fn first(&self) -> f64 {
        self.ends[0]
    }

    fn last(&self) -> f64 {
        self.ends[self.ends.len() - 1]
    }

    /// How far apart two values of the clamped field may be.
    fn spread(&self) -> f64 {
        let ranges = self.parts.iter().map(|(segment, _)| segment.field.range().map(|v| v.clamp(0.0, 1.0)));
        let [low, high] = ranges.fold([1.0, 0.0], |[l, h]: [f64; 2], [a, b]| [l.min(a), h.max(b)]);
        high - low
    }

    /// Integral of the clamped field from the run's beginning to s, mm.
    fn integral(&self, s: f64) -> f64 {
        let part = (self.ends.partition_point(|end| *end <= s).max(1) - 1).min(self.parts.len() - 1);
        let (segment, [from, to]) = &self.parts[part];
        let x = ((s - segment.middle()) / segment.half()).clamp(*from, *to);
        self.integrals[part] + integral_between(segment, *from, x)
    }

    /// Integral over the part of an interval that is in the run, mm.
    fn between(&self, from: f64, to: f64) -> f64 {
        let (from, to) = (from.max(self.first()), to.min(self.last()));
        if to > from { self.integral(to) - self.integral(from) } else { 0.0 }
    }
}

enum End {
    /// Place, echo, and the estimated error of the place, mm.
    Found(f64, f64, f64),
    /// Nothing more is looked for on this ray.
    Nothing,
    /// The run ends; another may follow.
    Run,
}

struct Search<'a> {
    scene: &'a Scene,
    run: &'a Run,
    /// h, mm.
    edge: f64,
    /// Last place of the line that the detector looks at, mm.
    limit: f64,
}

/// A part of the difference: a polynomial between two places.
struct Part {
    from: f64,
    to: f64,
    difference: Polynomial,
}

impl Part {
    fn place(&self, x: f64) -> f64 {
        (self.from + self.to) / 2.0 + (self.to - self.from) / 2.0 * x
    }

    fn at(&self, t: f64) -> f64 {
        let half = (self.to - self.from) / 2.0;
        self.difference.at(((t - self.from - half) / half).clamp(-1.0, 1.0))
    }

    /// Its ends and the stationary places between them, in rising order.
    fn turns(&self) -> Vec<f64> {
        let mut places = Vec::new();
        self.difference.slope().roots(&mut places);
        let mut turns = vec![self.from];
        turns.extend(places.into_iter().map(|x| self.place(x)));
        turns.push(self.to);
        turns
    }
}

struct Peak {
    best: f64,
    at: f64,
    /// Where the edge has been followed to.
    end: f64,
    /// Where the difference falls below 0.7 of its maximum.
    fallen: Option<f64>,
    /// True if the difference still rose where the run ended.
    cut: bool,
}

impl Search<'_> {
    /// The difference at t, by polarity.
    fn difference(&self, t: f64) -> f64 {
        let [a, b, c] = [t - self.edge, t, t + self.edge].map(|s| self.run.integral(s));
        let sign = if self.scene.settings.surface.sign == Sign::Bright { 1.0 } else { -1.0 };
        sign * ((c - b) - (b - a)) / self.edge
    }

    /// The parts of the difference between two places.
    fn parts(&self, from: f64, to: f64) -> Vec<Part> {
        let shifted = [-self.edge, 0.0, self.edge].into_iter().flat_map(|by| self.run.ends.iter().map(move |s| s + by));
        let mut ends: Vec<f64> = shifted.filter(|t| *t > from && *t < to).chain([from, to]).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|later, earlier| *later - *earlier < 1e-11);
        let part = |pair: &[f64]| {
            let (middle, half) = ((pair[0] + pair[1]) / 2.0, (pair[1] - pair[0]) / 2.0);
            let difference = Polynomial::through(8, |x| self.difference(middle + half * x));
            Part { from: pair[0], to: pair[1], difference }
        };
        ends.windows(2).map(part).collect()
    }

    /// Error of a place at which the difference (`derivative` 1) or its slope (2) takes a value: the error of that over its slope.
    /// A mean is as wrong as the field at most, and a polynomial's slope by the square of its degree more over half its length.
    fn off(&self, parts: &[Part], t: f64, derivative: u32) -> f64 {
        let Some(part) = parts.iter().find(|p| p.from <= t && t <= p.to) else { return 0.0 };
        let half = (part.to - part.from) / 2.0;
        let x = ((t - part.from - half) / half).clamp(-1.0, 1.0);
        let field = self.run.parts.iter().map(|(segment, _)| segment.off).fold(f64::EPSILON, f64::max);
        let slope = part.difference.slope();
        let (error, slope) = match derivative {
            1 => (2.0 * field, slope.at(x) / half),
            _ => (4.0 * field / self.edge, slope.slope().at(x) / (half * half)),
        };
        // A kink or a touched level has no slope: the place is then uncertain by what a parabola of that height is wide.
        (error / slope.abs().max(1e-12)).min(self.edge)
    }

    fn surface(&self, seen: &mut u32) -> End {
        let settings = &self.scene.settings.surface;
        let last = self.run.last().min(self.limit) - self.edge;
        // Two means differ by no more than the field does.
        if self.run.spread() <= settings.threshold {
            return End::Run;
        }
        // The first place whose older half may be used.
        let mut since = self.run.first();
        loop {
            let first = since + self.edge;
            if first >= last {
                return End::Run;
            }
            let Some((crossing, parts)) = self.crossing(first, last) else { return End::Run };
            let peak = self.peak(&parts, crossing, last);
            let beyond = (peak.end + self.edge).max(crossing + 3.0 * self.edge);
            let wanted = *seen + 1 == settings.number;
            let whole = beyond <= self.run.last().min(self.limit);
            let cut = if self.run.last() < self.limit { End::Nothing } else { End::Run };
            if !wanted {
                if !whole {
                    return cut;
                }
                *seen += 1;
                since = beyond;
                continue;
            }
            let echo = |t: f64| self.run.between(t, t + self.edge) / self.edge;
            if settings.place == Place::FirstCrossing {
                return End::Found(crossing + self.edge, echo(crossing), self.off(&parts, crossing, 1));
            }
            if peak.cut {
                return cut;
            }
            let (place, off) = match (settings.place, peak.fallen, self.risen(&parts, &peak, crossing)) {
                (Place::Middle, Some(fallen), Some(risen)) => {
                    ((fallen + risen) / 2.0, self.off(&parts, fallen, 1).max(self.off(&parts, risen, 1)))
                }
                _ => (peak.at, self.off(&parts, peak.at, 2)),
            };
            return End::Found(place, echo(peak.at), off);
        }
    }

    /// Where the difference rises above the threshold between two places, at 0 or behind it, and its parts as far as an edge may be
    /// followed from there. An edge that is above it where the first ring of the run ends counts, unless that is where the region
    /// begins.
    fn crossing(&self, first: f64, last: f64) -> Option<(f64, Vec<Part>)> {
        let threshold = self.scene.settings.surface.threshold;
        let mut parts: Vec<Part> = Vec::new();
        let mut known = first;
        // A few edges at a time: most surfaces are far from the end of the ray.
        while known < last {
            let to = (known + 4.0 * self.edge).min(last);
            let begun = parts.len();
            parts.extend(self.parts(known, to));
            let found = match parts.first() {
                Some(part) if begun == 0 && first > 1e-9 && part.at(first) > threshold => Some(first),
                _ => self.rise(parts.get(begun..).unwrap_or_default()),
            };
            known = to;
            if let Some(crossing) = found {
                let end = (crossing + 17.0 * self.edge).min(last);
                if end > known {
                    parts.extend(self.parts(known, end));
                }
                return Some((crossing, parts));
            }
        }
        None
    }

    /// The first place at 0 or behind it at which the difference rises above the threshold.
    fn rise(&self, parts: &[Part]) -> Option<f64> {
        let threshold = self.scene.settings.surface.threshold;
        for part in parts.iter().filter(|p| p.to > 0.0) {
            for pair in part.turns().windows(2) {
                let (from, to) = (pair[0].max(0.0), pair[1]);
                if to > from && part.at(from) <= threshold && part.at(to) > threshold {
                    return Some(bracketed(|t| part.at(t) - threshold, from, to).unwrap_or(to));
                }
            }
        }
        None
    }

    /// Follows the difference until it falls below 0.7 of its largest value, over at most max(h, h / (4 threshold)), 16 h at most.
    fn peak(&self, parts: &[Part], crossing: f64, last: f64) -> Peak {
        let threshold = self.scene.settings.surface.threshold;
        let limit = crossing + self.edge * (0.25 / threshold).clamp(1.0, 16.0);
        let mut peak = Peak { best: f64::MIN, at: crossing, end: limit, fallen: None, cut: false };
        for part in parts.iter().filter(|p| p.to > crossing && p.from < limit) {
            for pair in part.turns().windows(2) {
                let (from, to) = (pair[0].max(crossing), pair[1].min(limit));
                if to < from {
                    continue;
                }
                for t in [from, to] {
                    if part.at(t) > peak.best {
                        (peak.best, peak.at) = (part.at(t), t);
                    }
                }
                let level = FOLLOW_LEVEL * peak.best;
                if part.at(to) < level {
                    let fallen = bracketed(|t| part.at(t) - level, from, to).unwrap_or(to);
                    return Peak { end: fallen, fallen: Some(fallen), ..peak };
                }
            }
        }
        peak.cut = peak.at >= last;
        peak
    }

    /// Where the difference rises above 0.7 of its largest value for the last time before it, at most 2 h before the crossing.
    fn risen(&self, parts: &[Part], peak: &Peak, crossing: f64) -> Option<f64> {
        let level = FOLLOW_LEVEL * peak.best;
        let earliest = crossing - 2.0 * self.edge;
        for part in parts.iter().rev().filter(|p| p.from < peak.at && p.to > earliest) {
            for pair in part.turns().windows(2).rev() {
                let (from, to) = (pair[0].max(earliest), pair[1].min(peak.at));
                if to > from && part.at(from) <= level && part.at(to) > level {
                    return bracketed(|t| part.at(t) - level, from, to);
                }
            }
        }
        None
    }
}
