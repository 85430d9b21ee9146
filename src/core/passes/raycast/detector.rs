//! The surface detector in f64, along the samples of one ray. At sample i, with steps of s, the difference is
//! D = mean(v[i], v[i-s] ... v[i-(m-1)s]) - mean(v[i-ms] ... v[i-(2m-1)s]): (2/n) (newer half - older half) for a ring of
//! n = 2m samples (thesis 4-3, where n is 8). Each half is as long as an edge in mm, whatever the step, so that D converges with
//! the step to the difference of two integrals. The [`Detector`] decides when D is an edge. All lengths below are lengths of the
//! ring, so that they are the same in mm as well.
//!
//! The plain threshold is the thesis'. The adaptive one is a detector of constant false alarm rate (Rohling 1983): D must
//! exceed the threshold and noise (1 + n/k) s, where s is the standard deviation of the k samples before the ring's newer
//! half, over two rings: the bar is higher while few samples are known, and noise times the deviation of the newer half while
//! none is. An edge below that bar may be a weak wall: if the ray has no other surface, its largest such edge is examined
//! again, and is the surface if the mean of the n samples from its crossing on exceeds the mean in front of it by noise s / 2. Noise of standard deviation s leaves that mean
//! uncertain by s / sqrt(n) and D by 2 s / sqrt(n): an edge that its height does not distinguish from noise may be distinguished by its duration.
//!
//! The lasting detector also rejects an edge when less than half of it remains half a ring behind it: specks in the fluid, and
//! shells thinner than that in front of something else. A shell that is the only surface on the ray is still found.

use crate::probe::Geometry;
use crate::scene::{Detector, Place, Ring, Scene, Sign, Surface};

/// After the crossing of the threshold the detector follows the difference until it falls below this share of its maximum.
pub(super) const FOLLOW_LEVEL: f64 = 0.7;

/// Factor of the detector's difference by `surface.sign`: 1 for bright, -1 for dark, 0 if its absolute value counts.
pub(super) fn polarity(scene: &Scene) -> f64 {
    match scene.settings.surface.sign {
        Sign::Bright => 1.0,
        Sign::Dark => -1.0,
        Sign::Any => 0.0,
    }
}

/// The difference that is compared with the threshold: times `polarity`, or its absolute value if `polarity` is 0.
pub(super) fn judged(polarity: f64, difference: f64) -> f64 {
    if polarity == 0.0 { difference.abs() } else { polarity * difference }
}

/// Finds the surface in the samples of a ray. Returns its fractional index in `samples` and the echo behind it; None if there is no surface.
/// `samples[n]` is the ray's sample `first + n`, None outside the insonified region. The region begins at sample 0 of the ray; a surface may lie
/// there at the earliest, and the samples before it fill the detector's ring.
pub(super) fn detect(scene: &Scene, samples: &[Option<f64>], first: i64) -> Option<(f64, f64)> {
    // A Cartesian volume repeats its border: that it is even says nothing of the noise.
    let bordered = matches!(scene.geometry, Geometry::Cartesian(_));
    let ray = Ray {
        settings: &scene.settings.surface,
        polarity: polarity(scene),
        samples,
        first,
        bordered,
        ring: scene.ring,
    };
    let mut state = State { noise: Noise::default(), weak: None, surfaces_passed: 0 };
    match ray.search(&mut state) {
        End::Surface(place, echo) => Some((place, echo)),
        End::Nothing => None,
        End::Ray if state.surfaces_passed + 1 == ray.settings.number => ray.second_look(&state.weak?),
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
    surfaces_passed: u32,
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
enum Followed {
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
    ring: Ring,
}

impl Ray<'_> {
    /// Samples of a half of the ring.
    fn half_len(&self) -> usize {
        self.ring.half as usize
    }

    /// Samples of the ring.
    fn len(&self) -> usize {
        self.ring.samples() as usize
    }

    fn mean(&self, i: usize, stride: usize, from: usize) -> Option<f64> {
        let half = (from..from + self.half_len()).map(|n| self.samples.get(i - n * stride).copied().flatten());
        half.sum::<Option<f64>>().map(|sum| sum / self.half_len() as f64)
    }

    /// The difference at i, if a full ring since `since` precedes it and none of the ring is outside.
    fn difference(&self, i: usize, stride: usize, since: usize) -> Option<f64> {
        (i < self.samples.len() && i >= since + (self.len() - 1) * stride)
            .then(|| Some(judged(self.polarity, self.mean(i, stride, 0)? - self.mean(i, stride, self.half_len())?)))
            .flatten()
    }

    fn adapts(&self) -> bool {
        self.settings.detector != Detector::Threshold
    }

    /// Half a ring into the region.
    fn inside(&self, i: usize) -> bool {
        i as i64 + self.first >= i64::from(self.ring.half)
    }

    fn rough_threshold(&self) -> f64 {
        self.settings.rough_threshold.unwrap_or(self.settings.threshold)
    }

    /// The samples of a half, newest first.
    fn half(&self, i: usize, stride: usize, from: usize) -> Vec<f64> {
        (0..self.half_len()).map(|n| self.samples[i - (n + from) * stride].unwrap_or(0.0)).collect()
    }

    /// Mean and deviation of the samples in front of the newer half; without any, the deviation is that of the newer half.
    fn before(&self, noise: &Noise, i: usize, stride: usize) -> (f64, f64) {
        let noise = match noise.learnt > 0.0 {
            true => *noise,
            false => {
                let (mut newer, mut older) = (Noise::default(), Noise::default());
                newer.learn(&self.half(i, stride, 0));
                older.learn(&self.half(i, stride, self.half_len()));
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
        let doubt = if noise.learnt > 0.0 { 1.0 + self.len() as f64 / noise.learnt } else { 1.0 };
        threshold.max(self.settings.noise * doubt * self.before(noise, i, stride).1)
    }

    /// Learns from the ring's older half, and takes note of an edge above the threshold.
    fn learn(&self, state: &mut State, d: f64, i: usize, stride: usize, since: usize) {
        if !self.adapts() {
            return;
        }
        if !self.bordered || i as i64 + self.first >= ((self.len() - 1) * stride) as i64 {
            state.noise.learn(&self.half(i, stride, self.half_len()));
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
        let (n, half) = (self.len(), self.half_len());
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
                let silent = i >= since + n * rough;
                from = i.saturating_sub(if silent { half * rough + n } else { n * rough }).max(since);
                limit = i + n;
            }
            // The fine search. A gap sends it back to the rough one behind the gap.
            let mut at = from;
            // The sample at which an edge need not have risen.
            let mut fresh = from + n - 1;
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
                    fresh = from + n - 1;
                    at += 1;
                    continue;
                }
                if let Some(d) = self.difference(at, 1, from).filter(|_| rough == 1) {
                    self.learn(state, d, at, 1, from);
                }
                let noise = state.noise;
                if self.crosses(at, from, fresh, |i| self.bar(self.settings.threshold, &noise, i, 1)) {
                    let wanted = state.surfaces_passed + 1 == self.settings.number;
                    let beyond = self.beyond(at, from, None);
                    match self.follow(at, from, wanted, None) {
                        Followed::Surface(place, echo) if wanted => return End::Surface(place, echo),
                        Followed::Surface(..) => {
                            state.surfaces_passed += 1;
                            state.weak = None;
                            state.noise = Noise::default();
                            (i, since) = (beyond, beyond);
                            continue 'rough;
                        }
                        Followed::Speck { best, best_at } => {
                            let since = if rough > 1 { since } else { from };
                            state.pass_over(Weak { difference: best, at: best_at, since, level: None });
                            at = beyond;
                            // Fine steps for a while: a rough ring would be filled only behind a wall that follows.
                            limit = if rough > 1 { at + n * rough } else { usize::MAX };
                            fresh = at + 1;
                        }
                        Followed::Cut(end) => return end,
                    }
                } else if at >= limit {
                    i = limit - (n - 2) * rough;
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
        let n = self.len();
        let from = weak.at.saturating_sub(n * self.settings.rough as usize).max(weak.since);
        // Before the limit, and at it: there, too, a crossing comes first.
        let last = (weak.at + n).min(self.samples.len() - 1);
        let at = (from..=last)
            .take_while(|i| self.samples[*i].is_some())
            .find(|i| self.crosses(*i, from, from + n - 1, |_| self.settings.threshold))?;
        let Followed::Surface(place, echo) = self.follow(at, from, true, Some(weak)) else { return None };
        let behind: f64 = self.samples.get(at + 1..=at + n)?.iter().copied().sum::<Option<f64>>()? / n as f64;
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

    /// Follows the difference from the crossing to the first sample at which it is less than 0.7 of its maximum so far: further on it
    /// belongs to another edge, which may be higher.
    /// `known`: the sample at which the second look expects it.
    fn peak(&self, crossing: usize, since: usize, known: Option<usize>) -> Peak {
        let limit = (crossing + self.ring.follow as usize).max(known.map_or(0, |known| known + 2));
        let mut peak =
            Peak { best: self.difference(crossing, 1, since).unwrap_or(0.0), at: crossing, end: limit, fallen: None };
        let mut before = peak.best;
        for i in crossing + 1..=limit {
            let Some(d) = self.difference(i, 1, since) else { break };
            let level = FOLLOW_LEVEL * peak.best;
            // A dip in front of the known peak is one of the noise.
            if d < level && known.is_none_or(|known| i >= known) {
                (peak.end, peak.fallen) = (i, Some(i as f64 - (level - d) / (before - d).max(level - d)));
                break;
            }
            if d > peak.best && i < limit {
                (peak.best, peak.at) = (d, i);
            }
            before = d;
        }
        peak
    }

    /// Where the difference rises above 0.7 of its maximum for the last time before it, samples.
    fn risen(&self, peak: &Peak, crossing: usize, since: usize) -> Option<f64> {
        let level = FOLLOW_LEVEL * peak.best;
        // The ring is filled again from here.
        let since = since.max(crossing.saturating_sub(2 * self.len()));
        (since + self.len()..=peak.at).rev().find_map(|i| {
            let (before, here) = (self.difference(i - 1, 1, since)?, self.difference(i, 1, since)?);
            (before <= level && here > level).then(|| i as f64 - (here - level) / (here - before))
        })
    }

    /// Follows the edge that crosses the threshold to its place. `since`: the first sample that the ring may use. `wanted`: it is the
    /// surface that the scene asks for. `again`: in the second look, the edge that is
    /// examined.
    fn follow(&self, crossing: usize, since: usize, wanted: bool, again: Option<&Weak>) -> Followed {
        let lasting = self.settings.detector == Detector::Lasting && again.is_none();
        let peak = self.peak(crossing, since, again.map(|weak| weak.at));
        let echo = |i: usize| self.mean(i, 1, 0).unwrap_or(0.0);
        let beyond = self.beyond(crossing, since, again);
        // Whether the ray leaves the insonified region before its last sample.
        let gap = self.samples.iter().take(beyond + 1).skip(crossing).any(|s| s.is_none());
        let end = || Followed::Cut(if gap { End::Nothing } else { End::Ray });
        let whole = beyond < self.samples.len() && !gap;
        if !(whole || (wanted && again.is_none())) {
            return end();
        }
        // A ray that ends before the edge has been followed keeps it.
        if lasting && whole {
            let left = self.polarity * (echo(peak.at + self.half_len()) - echo(peak.at)) + peak.best;
            if left <= peak.best / 2.0 {
                return Followed::Speck { best: peak.best, best_at: peak.at };
            }
        }
        if self.settings.place == Place::FirstCrossing {
            return Followed::Surface(crossing as f64, echo(crossing));
        }
        // Without the sample after it, it may not be the peak: the ray left the insonified region on a rising edge.
        let Some(after) = self.difference(peak.at + 1, 1, since) else { return end() };
        let middle_of_ring = (self.len() as f64 - 1.0) / 2.0;
        if let (Place::Middle, Some(fallen), Some(risen)) =
            (self.settings.place, peak.fallen, self.risen(&peak, crossing, since))
        {
            return Followed::Surface(0.5 * (risen + fallen) - middle_of_ring, echo(peak.at));
        }
        // A ring that was just filled has no difference before its first.
        let before = peak.at.checked_sub(1).and_then(|i| self.difference(i, 1, since)).unwrap_or(peak.best);
        let bend = before - 2.0 * peak.best + after;
        // Two equal differences put it in the middle between them.
        let shift = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        Followed::Surface(peak.at as f64 + shift - middle_of_ring, echo(peak.at))
    }

    /// Where an edge has been followed to its end: the search for the next one begins there.
    fn beyond(&self, crossing: usize, since: usize, again: Option<&Weak>) -> usize {
        let lasting = self.settings.detector == Detector::Lasting && again.is_none();
        let peak = self.peak(crossing, since, again.map(|weak| weak.at));
        peak.end.max(crossing + self.len()).max(if lasting { peak.at + self.half_len() } else { 0 })
    }
}

/// The largest difference of an edge.
struct Peak {
    best: f64,
    /// Its sample.
    at: usize,
    /// The sample at which it is known.
    end: usize,
    /// Where the difference falls below 0.7 of it, samples.
    fallen: Option<f64>,
}

/// Halves of the ring in the noise estimate: two rings. More would include samples too far in front of the edge, above all a slope of the gain.
const MEMORY: f64 = 4.0;

/// Running mean and variance of the samples in front of the detector's newer half ring.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    learnt: f64,
    pub(super) mean: f64,
    variance: f64,
}

impl Noise {
    /// Takes the older half of the ring, newest sample first: all of it the first time, afterwards only its newest sample.
    pub(super) fn learn(&mut self, older: &[f64]) {
        let count = older.len() as f64;
        if self.learnt == 0.0 {
            self.learnt = count;
            self.mean = older.iter().sum::<f64>() / count;
            self.variance = older.iter().map(|v| (v - self.mean).powi(2)).sum::<f64>() / (count - 1.0);
            return;
        }
        self.learnt += 1.0;
        // The recursions of the mean and the unbiased variance of n samples (Welford), held at n = MEMORY.
        let n = self.learnt.min(MEMORY * count);
        let off = older[0] - self.mean;
        self.mean += off / n;
        self.variance = self.variance * (n - 2.0) / (n - 1.0) + off * off / n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Edge;
    use libm::erf;

    /// Up to MEMORY samples these are the mean and the unbiased variance of all; then the oldest lose their weight.
    #[test]
    fn the_noise_is_that_of_the_samples_and_forgets() {
        let samples: Vec<f64> = (0..16).map(|i| 0.4 + 0.3 * (f64::from(i) * 1.7).sin()).collect();
        let mut noise = Noise::default();
        // Newest first.
        noise.learn(&[samples[3], samples[2], samples[1], samples[0]]);
        samples[4..].iter().for_each(|newest| noise.learn(&[*newest, 9.0, 9.0, 9.0]));
        let mean = samples.iter().sum::<f64>() / 16.0;
        let variance = samples.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 15.0;
        assert!((noise.mean - mean).abs() < 1e-12 && (noise.variance - variance).abs() < 1e-12, "{noise:?}");
        (0..200).for_each(|_| noise.learn(&[0.9; 4]));
        assert!((noise.mean - 0.9).abs() < 1e-4 && noise.variance < 1e-4, "{noise:?}");
    }

    /// The mean of (1 + erf(x / sqrt 2 sd)) / 2 over 0..h, times two, minus one: the largest difference of an edge of height 1.
    fn largest_difference(sd: f64, h: f64) -> f64 {
        let steps = 2000;
        let mean =
            (0..steps).map(|i| erf((f64::from(i) + 0.5) / f64::from(steps) * h / (sd * 2f64.sqrt()))).sum::<f64>();
        mean / f64::from(steps)
    }

    /// Place of the surface on a profile of the distance in mm, in mm, with an edge of 1 mm.
    fn place_on(settings: &Surface, half: u32, profile: impl Fn(f64) -> f64) -> Option<f64> {
        let step = 1.0 / f64::from(half);
        let ring = Ring::new(Edge::Length(1.0), step, settings.threshold);
        let samples: Vec<_> = (0..40 * half).map(|i| Some(profile((f64::from(i) + 0.5) * step))).collect();
        let ray = Ray { settings, polarity: 1.0, samples: &samples, first: 0, bordered: true, ring };
        match ray.search(&mut State { noise: Noise::default(), weak: None, surfaces_passed: 0 }) {
            End::Surface(place, _) => Some((place + 0.5) * step),
            _ => None,
        }
    }

    /// Prevents a place that depends on the height of the edge: a search for the peak that ends too early puts wide edges too near.
    #[test]
    fn the_place_of_an_edge_depends_neither_on_its_height_nor_on_its_width_nor_on_the_step() {
        for place in [Place::Peak, Place::Middle] {
            let (mut worst, mut edges) = (0.0f64, 0);
            for threshold in [0.05, 0.08, 0.2] {
                let settings = Surface { threshold, place, rough: 1, ..Surface::default() };
                for (half, sd) in [4, 5, 8, 16, 64]
                    .into_iter()
                    .flat_map(|half| [0.125, 0.5, 1.0, 2.0, 2.5].into_iter().map(move |sd| (half, sd)))
                {
                    for height in [1.0, 0.95, 0.6, 0.3, 0.15] {
                        if height * largest_difference(sd, 1.0) <= 1.25 * threshold {
                            continue;
                        }
                        // Fine steps cost the most and differ least.
                        for offset in (0..8).step_by(if half > 8 { 4 } else { 1 }) {
                            let edge = 15.0 + f64::from(offset) / (8.0 * f64::from(half));
                            let found = place_on(&settings, half, |x| {
                                height * 0.5 * (1.0 + erf((x - edge) / (sd * 2f64.sqrt())))
                            });
                            let off = found.expect("an edge above the threshold") - edge;
                            worst = worst.max(off.abs());
                            edges += 1;
                            assert!(
                                off.abs() <= 0.025,
                                "{place:?}, {half} samples, deviation {sd}, height {height}, threshold {threshold}: {off:.4}"
                            );
                        }
                    }
                }
            }
            println!("{place:?}: {worst:.4} of an edge at most, over {edges} edges");
            assert!(edges > 600, "{edges}");
        }
    }

    /// Steps of the data put the largest difference anywhere on a flat top; the middle between the two crossings of a level is where
    /// D is steep. The samples are those of trilinear interpolation between voxels of eight bits, four of them in the length of the edge, as by default.
    #[test]
    fn the_place_of_an_edge_in_data_of_eight_bits() {
        let mut worst = [[0.0f64; 2]; 2];
        for (way, place) in [Place::Peak, Place::Middle].into_iter().enumerate() {
            for (low, (height, widest)) in [(1.0, 1.0), (0.2, 0.5)].into_iter().enumerate() {
                let settings = Surface { threshold: 0.05, place, rough: 1, ..Surface::default() };
                for half in [4, 8, 16, 64] {
                    for (sd, offset) in [0.125, 0.25, 0.5, 0.75, 1.0]
                        .into_iter()
                        .flat_map(|sd| (0..16).step_by(if half > 8 { 4 } else { 1 }).map(move |offset| (sd, offset)))
                    {
                        if sd > widest {
                            continue;
                        }
                        let edge = 15.0 + f64::from(offset) / 32.0;
                        let voxel = |n: f64| {
                            let value = 0.1 + 0.8 * height * 0.5 * (1.0 + erf((0.25 * n - edge) / (sd * 2f64.sqrt())));
                            (255.0 * value).round() / 255.0
                        };
                        let field = |x: f64| {
                            let (below, share) = ((4.0 * x).floor(), (4.0 * x).fract());
                            voxel(below) * (1.0 - share) + voxel(below + 1.0) * share
                        };
                        let found = place_on(&settings, half, field).expect("an edge above the threshold");
                        worst[way][low] = worst[way][low].max((found - edge).abs());
                    }
                }
            }
        }
        println!(
            "peak: {:.4} of the edge at full height, {:.4} at a fifth; middle: {:.4}, {:.4}",
            worst[0][0], worst[0][1], worst[1][0], worst[1][1]
        );
        assert!(worst.iter().flatten().all(|off| *off <= 0.025), "{worst:?}");
        assert!(worst[1][0] < worst[0][0] && worst[1][1] < worst[0][1], "the middle is the better one: {worst:?}");
    }
}
