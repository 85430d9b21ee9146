//! The surface detector in f64, along the samples of one ray. At sample i, with steps of s, the difference is
//! D = mean(v[i], v[i-s], v[i-2s], v[i-3s]) - mean(v[i-4s] ... v[i-7s]): (2/n) (newer half - older half) for a ring of n = 8
//! (thesis 4-3). The [`Detector`] decides when D is an edge.
//!
//! The plain threshold is the thesis'. The adaptive one is a detector of constant false alarm rate (Rohling 1983): D must
//! exceed the threshold and noise (1 + n/m) s, where s is the standard deviation of the m samples before the ring's newer
//! half, over 16 samples: the bar is higher while few samples are known, and noise times the deviation of the newer half while
//! none is. An edge below that bar may be a weak wall: if the ray has no other surface, its largest such edge is examined
//! again, and is the surface if the mean of the n samples from its crossing on exceeds the mean in front of it by noise s / 2. Noise of standard deviation s leaves that mean
//! uncertain by 0.35 s and D by 0.71 s: an edge that its height does not distinguish from noise may be distinguished by its duration.
//!
//! The lasting detector also rejects an edge when less than half of it remains half a ring behind it: specks in the fluid, and
//! shells thinner than that in front of something else. A shell that is the only surface on the ray is still found.

use crate::probe::Geometry;
use crate::scene::{Detector, Place, RING, Scene, Sign, Surface};

const N: usize = RING as usize;

pub(super) fn polarity(scene: &Scene) -> f64 {
    match scene.settings.surface.sign {
        Sign::Bright => 1.0,
        Sign::Dark => -1.0,
    }
}

/// Place of the surface in samples, and the echo behind it. Sample n is the ray's sample `first + n`; the region begins at its
/// sample 0, and half a ring later an edge in its middle may be a surface.
pub(super) fn detect(scene: &Scene, samples: &[Option<f64>], first: i64) -> Option<(f64, f64)> {
    // A Cartesian volume repeats its border: that it is even says nothing of the noise.
    let bordered = matches!(scene.geometry, Geometry::Cartesian(_));
    let ray = Ray { settings: &scene.settings.surface, polarity: polarity(scene), samples, first, bordered };
    let mut state = State { noise: Noise::default(), weak: None, seen: 0 };
    match ray.search(&mut state) {
        End::Surface(place, echo) => Some((place, echo)),
        End::Nothing => None,
        End::Ray if state.seen + 1 == ray.settings.number => ray.second_look(&state.weak?),
        End::Ray => None,
    }
}

/// An edge that was rejected.
struct Weak {
    difference: f64,
    at: usize,
    /// The earliest sample that its ring may use.
    since: usize,
    /// The level that the mean echo behind it must exceed, by polarity; none for an edge above the bar that did not last.
    level: Option<f64>,
}

struct State {
    noise: Noise,
    weak: Option<Weak>,
    seen: u32,
}

impl State {
    fn pass_over(&mut self, edge: Weak) {
        if self.weak.as_ref().is_none_or(|w| edge.difference > w.difference) {
            self.weak = Some(edge);
        }
    }
}

enum End {
    Surface(f64, f64),
    /// Nothing more is looked for.
    Nothing,
    /// The ray's last sample came first.
    Ray,
}

/// The result of following an edge.
enum Edge {
    Surface(f64, f64),
    /// No surface: its echo did not last, like that of a speck.
    Speck {
        best: f64,
        best_at: usize,
    },
    Cut(End),
}

struct Ray<'a> {
    settings: &'a Surface,
    polarity: f64,
    samples: &'a [Option<f64>],
    first: i64,
    /// True if samples in front of the region do not enter the noise.
    bordered: bool,
}

impl Ray<'_> {
    fn mean(&self, i: usize, stride: usize, from: usize) -> Option<f64> {
        let half = (from..from + N / 2).map(|n| self.samples.get(i - n * stride).copied().flatten());
        half.sum::<Option<f64>>().map(|sum| sum / (N / 2) as f64)
    }

    /// The difference at i, if a full ring since `since` precedes it and none of the ring is outside.
    fn difference(&self, i: usize, stride: usize, since: usize) -> Option<f64> {
        (i < self.samples.len() && i >= since + (N - 1) * stride)
            .then(|| Some(self.polarity * (self.mean(i, stride, 0)? - self.mean(i, stride, N / 2)?)))
            .flatten()
    }

    fn adapts(&self) -> bool {
        self.settings.detector != Detector::Threshold
    }

    /// Half a ring into the region.
    fn inside(&self, i: usize) -> bool {
        i as i64 + self.first >= i64::from(RING / 2)
    }

    fn rough_threshold(&self) -> f64 {
        self.settings.rough_threshold.unwrap_or(self.settings.threshold)
    }

    /// The four samples of a half, newest first.
    fn half(&self, i: usize, stride: usize, from: usize) -> [f64; N / 2] {
        std::array::from_fn(|n| self.samples[i - (n + from) * stride].unwrap_or(0.0))
    }

    /// Mean and deviation of the samples in front of the newer half; without any, the deviation is that of the newer half.
    fn before(&self, noise: &Noise, i: usize, stride: usize) -> (f64, f64) {
        let noise = match noise.learnt > 0.0 {
            true => *noise,
            false => {
                let (mut newer, mut older) = (Noise::default(), Noise::default());
                newer.learn(self.half(i, stride, 0));
                older.learn(self.half(i, stride, N / 2));
                Noise { mean: older.mean, ..newer }
            }
        };
        (noise.mean, noise.variance.sqrt())
    }

    /// The bar that the difference at i must exceed, where the ring is full.
    fn bar(&self, threshold: f64, noise: &Noise, i: usize, stride: usize) -> f64 {
        if !self.adapts() {
            return threshold;
        }
        let doubt = if noise.learnt > 0.0 { 1.0 + f64::from(RING) / noise.learnt } else { 1.0 };
        threshold.max(self.settings.noise * doubt * self.before(noise, i, stride).1)
    }

    /// Learns from the ring's older half, and takes note of an edge above the threshold.
    fn learn(&self, state: &mut State, d: f64, i: usize, stride: usize, since: usize) {
        if !self.adapts() {
            return;
        }
        if !self.bordered || i as i64 + self.first >= ((N - 1) * stride) as i64 {
            state.noise.learn(self.half(i, stride, N / 2));
        }
        let threshold = if stride > 1 { self.rough_threshold() } else { self.settings.threshold };
        if d > threshold && self.inside(i) {
            let (mean, deviation) = self.before(&state.noise, i, stride);
            let level = self.polarity * mean + self.settings.noise * deviation / 2.0;
            state.pass_over(Weak { difference: d, at: i, since, level: Some(level) });
        }
    }

    /// From the ray's start to the requested surface, or to its end.
    fn search(&self, state: &mut State) -> End {
        let rough = self.settings.rough as usize;
        let (mut i, mut since) = (0, 0);
        'rough: while i < self.samples.len() {
            if self.samples[i].is_none() {
                i += rough;
                since = i;
                state.noise = Noise::default();
                continue;
            }
            let (mut from, mut limit) = (since, usize::MAX);
            if rough > 1 {
                let fires = self.difference(i, rough, since).is_some_and(|d| {
                    self.learn(state, d, i, rough, since);
                    d > self.bar(self.rough_threshold(), &state.noise, i, rough)
                });
                if !fires {
                    i += rough;
                    continue;
                }
                // If the ring did not fire one step earlier, the edge is in its newer half, and the fine ring fits in front of it.
                let silent = i >= since + N * rough;
                from = i.saturating_sub(if silent { N / 2 * rough + N } else { N * rough }).max(since);
                limit = i + N;
            }
            // The fine search. A gap sends it back to the rough one behind the gap.
            let mut at = from;
            // The sample at which an edge need not have risen.
            let mut fresh = from + N - 1;
            loop {
                if at >= self.samples.len() {
                    return End::Ray;
                }
                if self.samples[at].is_none() {
                    state.noise = Noise::default();
                    if rough > 1 {
                        i = at + rough;
                        since = i;
                        continue 'rough;
                    }
                    from = at + 1;
                    fresh = from + N - 1;
                    at += 1;
                    continue;
                }
                if let Some(d) = self.difference(at, 1, from).filter(|_| rough == 1) {
                    self.learn(state, d, at, 1, from);
                }
                let noise = state.noise;
                if self.crosses(at, from, fresh, |i| self.bar(self.settings.threshold, &noise, i, 1)) {
                    let wanted = state.seen + 1 == self.settings.number;
                    match self.follow(at, from, wanted, false) {
                        Edge::Surface(place, echo) if wanted => return End::Surface(place, echo),
                        Edge::Surface(..) => {
                            state.seen += 1;
                            state.weak = None;
                            state.noise = Noise::default();
                            (i, since) = (self.beyond(at, from), self.beyond(at, from));
                            continue 'rough;
                        }
                        Edge::Speck { best, best_at } => {
                            let since = if rough > 1 { since } else { from };
                            state.pass_over(Weak { difference: best, at: best_at, since, level: None });
                            at = self.beyond(at, from);
                            // Fine steps for a while: a rough ring would be filled only behind a wall that follows.
                            limit = if rough > 1 { at + N * rough } else { usize::MAX };
                            fresh = at + 1;
                        }
                        Edge::Cut(end) => return end,
                    }
                } else if at >= limit {
                    i = limit - (N - 2) * rough;
                    since = i;
                    continue 'rough;
                }
                at += 1;
            }
        }
        End::Ray
    }

    /// Examines the largest rejected edge again, by the threshold alone; it must last.
    fn second_look(&self, weak: &Weak) -> Option<(f64, f64)> {
        let from = weak.at.saturating_sub(N * self.settings.rough as usize).max(weak.since);
        // Before the limit, and at it: there, too, a crossing comes first.
        let last = (weak.at + N).min(self.samples.len() - 1);
        let at = (from..=last)
            .take_while(|i| self.samples[*i].is_some())
            .find(|i| self.crosses(*i, from, from + N - 1, |_| self.settings.threshold))?;
        let Edge::Surface(place, echo) = self.follow(at, from, true, true) else { return None };
        let behind: f64 = self.samples.get(at + 1..=at + N)?.iter().copied().sum::<Option<f64>>()? / N as f64;
        weak.level.is_none_or(|level| self.polarity * behind > level).then_some((place, echo))
    }

    /// Above the bar here and not one sample earlier: an edge in front of the region is none of its surfaces.
    fn crosses(&self, i: usize, since: usize, fresh: usize, bar: impl Fn(usize) -> f64) -> bool {
        self.difference(i, 1, since).is_some_and(|d| {
            let bar = bar(i);
            let rises = i == fresh || self.difference(i.wrapping_sub(1), 1, since).is_none_or(|before| before <= bar);
            self.inside(i) && rises && d > bar
        })
    }

    /// Where the difference is largest within the ring's length from the crossing on.
    fn peak(&self, crossing: usize, since: usize) -> (f64, usize) {
        let within = (crossing..crossing + N).map_while(|i| Some((self.difference(i, 1, since)?, i)));
        within.fold((f64::MIN, crossing), |best, here| if here.0 > best.0 { here } else { best })
    }

    /// Where an edge has been followed to its end.
    fn beyond(&self, crossing: usize, since: usize) -> usize {
        let lasting = self.settings.detector == Detector::Lasting;
        (crossing + N).max(if lasting { self.peak(crossing, since).1 + N / 2 } else { 0 })
    }

    /// The largest difference within the ring's length after the crossing, refined by a parabola through its neighbours, minus
    /// half a ring: the middle of the edge. Or the crossing itself.
    fn follow(&self, crossing: usize, since: usize, wanted: bool, again: bool) -> Edge {
        let first_crossing = self.settings.place == Place::FirstCrossing;
        let lasting = self.settings.detector == Detector::Lasting && !again;
        let (best, best_at) = self.peak(crossing, since);
        let echo = |i: usize| self.mean(i, 1, 0).unwrap_or(0.0);
        let beyond = self.beyond(crossing, since);
        // Whether the ray leaves the insonified region before its last sample.
        let gap = self.samples.iter().take(beyond + 1).skip(crossing).any(|s| s.is_none());
        let end = || Edge::Cut(if gap { End::Nothing } else { End::Ray });
        let whole = beyond < self.samples.len() && !gap;
        if !(whole || wanted) {
            return end();
        }
        // A ray that ends before the edge has been followed keeps it.
        if lasting && whole {
            let left = self.polarity * (echo(best_at + N / 2) - echo(best_at)) + best;
            if left <= best / 2.0 {
                return Edge::Speck { best, best_at };
            }
        }
        if first_crossing {
            return Edge::Surface(crossing as f64, echo(crossing));
        }
        // Without the sample after it, it may not be the peak: the ray left the insonified region on a rising edge.
        let Some(after) = self.difference(best_at + 1, 1, since) else { return end() };
        let before = self.difference(best_at - 1, 1, since).unwrap_or(best);
        let bend = before - 2.0 * best + after;
        // Two equal differences put it in the middle between them.
        let shift = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        Edge::Surface(best_at as f64 + shift - (f64::from(RING) - 1.0) / 2.0, echo(best_at))
    }
}

/// Samples in the noise estimate: two rings. More would include samples too far in front of the edge, above all a slope of the gain.
const MEMORY: f64 = 16.0;

/// Mean and variance of the `learnt` samples that have left the ring's newer half.
#[derive(Clone, Copy, Debug, Default)]
struct Noise {
    learnt: f64,
    mean: f64,
    variance: f64,
}

impl Noise {
    /// Takes the ring's older half, newest first: the first time all of it, then only its newest sample.
    fn learn(&mut self, older: [f64; N / 2]) {
        if self.learnt == 0.0 {
            let count = older.len() as f64;
            self.learnt = count;
            self.mean = older.iter().sum::<f64>() / count;
            self.variance = older.iter().map(|v| (v - self.mean).powi(2)).sum::<f64>() / (count - 1.0);
            return;
        }
        self.learnt += 1.0;
        // The recursions of the mean and the unbiased variance of n samples (Welford), held at n = MEMORY.
        let n = self.learnt.min(MEMORY);
        let off = older[0] - self.mean;
        self.mean += off / n;
        self.variance = self.variance * (n - 2.0) / (n - 1.0) + off * off / n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to MEMORY samples these are the mean and the unbiased variance of all; then the oldest lose their weight.
    #[test]
    fn the_noise_is_that_of_the_samples_and_forgets() {
        let samples: Vec<f64> = (0..16).map(|i| 0.4 + 0.3 * (f64::from(i) * 1.7).sin()).collect();
        let mut noise = Noise::default();
        // Newest first.
        noise.learn([samples[3], samples[2], samples[1], samples[0]]);
        samples[4..].iter().for_each(|newest| noise.learn([*newest, 9.0, 9.0, 9.0]));
        let mean = samples.iter().sum::<f64>() / 16.0;
        let variance = samples.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 15.0;
        assert!((noise.mean - mean).abs() < 1e-12 && (noise.variance - variance).abs() < 1e-12, "{noise:?}");
        (0..200).for_each(|_| noise.learn([0.9; 4]));
        assert!((noise.mean - 0.9).abs() < 1e-4 && noise.variance < 1e-4, "{noise:?}");
    }
}
