//! Frame budget: keeps the time of a picture below a limit while the view moves, by choosing a rung of the quality ladder. A view at rest has full
//! quality. Pure: picture times go in, the rung of the next picture comes out.
//!
//! The quality ladder of a moving view: changes of the settings from full quality down. They come from a measured error report, or are
//! the built-in ones, which were found to cost the least error for the time that they save.

use crate::error_report::{Combination, Measure, Report, choose};
use crate::plan::Work;
use crate::scene::load::Layers;
use crate::scene::{Mode, Ray, Scene, Settings, camera};
use crate::texts;
use std::time::{Duration, Instant};

/// Time without a movement after which a view counts as at rest.
pub(super) const REST_DELAY: Duration = Duration::from_millis(250);
/// Weight of a new time in the running mean of a rung.
const NEW_WEIGHT: f64 = 0.4;
/// A better rung is chosen if its estimated time is below this fraction of the budget, so that it is not left again at once.
const MARGIN: f64 = 0.85;
/// After so many pictures on a rung the measured ratios of the ladder are replaced by the expected ones.
const FORGET_AFTER: u32 = 32;
/// Volumes have stopped coming after so many times of that between two.
const PAUSE: f64 = 3.0;
/// Pictures on a rung before a better one is tried.
const MIN_PICTURES: u32 = 4;

/// The quality of a picture: its rungs on two ladders, one for rays and one for shading. 0 is full quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quality {
    /// Rung on the ladder of rays, which reduces the work of all stages after stage 1, the filters of frames.
    pub rays: usize,
    /// Rung on the ladder of shading, which leaves out occlusion and then also shadow of stage 3. The distance map stays complete.
    pub shading: usize,
}

/// Keeps a frame budget for each kind of work. Pictures that need only other tones, colours, or planes beside a rendering are always drawn in
/// full.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    rays: FrameBudget,
    shading: FrameBudget,
    live: Live,
}

/// The budget of pictures of volumes that keep coming: the time between two of them, where that is longer than the frame budget. More would show
/// older volumes, and less would leave out more than it has to.
#[derive(Clone, Debug)]
struct Live {
    pictures: FrameBudget,
    /// The frame budget of a moving view, the shortest one.
    least: Option<Duration>,
    /// When the last volume came, and the mean interval between volumes, s.
    came: Option<(Instant, Option<f64>)>,
}

impl Live {
    fn volumes_came(&mut self, count: u64, now: Instant) {
        let Some((last, mean)) = self.came else {
            self.came = Some((now, None));
            return;
        };
        let time = now.saturating_duration_since(last).as_secs_f64() / count.max(1) as f64;
        // After a pause they come anew.
        let mean = mean.filter(|mean| time < PAUSE * mean).map_or(time, |mean| mean + NEW_WEIGHT * (time - mean));
        self.came = Some((now, Some(mean)));
        self.pictures.budget = self.least.map(|least| least.max(Duration::from_secs_f64(mean)));
    }

    /// Until when the next volume is expected.
    fn ends_at(&self) -> Option<Instant> {
        let (last, mean) = self.came?;
        mean.map(|mean| last + Duration::from_secs_f64(PAUSE * mean).max(REST_DELAY))
    }

    fn is_on(&self, now: Instant) -> bool {
        self.pictures.budget.is_some() && self.ends_at().is_some_and(|end| now < end)
    }
}

/// The rung for rays before any picture was timed: full quality on a GPU with memory of its own. On a GPU that shares the machine's memory, and
/// on a CPU, such a picture may take seconds and cannot be interrupted.
pub(super) fn first_rung(has_unified_memory: bool) -> usize {
    usize::from(has_unified_memory)
}

impl Pace {
    /// `rungs`: the ladder of rays; `first`: the rung for a moving view before any picture was timed.
    pub(super) fn new(budget: Option<Duration>, rungs: &[Rung], first: usize) -> Pace {
        let shares: Vec<f64> = rungs.iter().map(|rung| rung.time_share).collect();
        let shading = SHADING.map(|(_, share)| share);
        let of_rays = FrameBudget::new(budget, &shares).beginning_at(first);
        let live = Live { pictures: of_rays.clone(), least: budget, came: None };
        Pace { rays: of_rays, shading: FrameBudget::new(budget, &shading), live }
    }

    pub(super) fn budget(&self) -> Option<Duration> {
        self.rays.budget
    }

    /// Notes that the user moved something whose picture needs this kind of work.
    pub(super) fn moved(&mut self, work: Work, now: Instant) {
        match work {
            Work::Rays => self.rays.view_moved(now),
            Work::Shading => self.shading.view_moved(now),
            Work::Tone => {}
        }
    }

    /// Notes that `count` volumes arrived from a source that does not wait for pictures.
    pub(super) fn volumes_came(&mut self, count: u64, now: Instant) {
        self.live.volumes_came(count, now);
    }

    /// Notes that volumes are no longer shown as they arrive.
    pub(super) fn volumes_stopped(&mut self) {
        self.live.came = None;
    }

    /// True while volumes keep arriving from a source that does not wait for pictures.
    pub(super) fn is_live(&self, now: Instant) -> bool {
        self.live.is_on(now)
    }

    /// Discards the measured times, because the scene changed.
    pub(super) fn forget(&mut self) {
        self.live.pictures.forget();
        self.rays.forget();
        self.shading.forget();
    }

    /// Time at which a moving view counts as at rest; None if it does not move.
    pub(super) fn rests_at(&self, now: Instant) -> Option<Instant> {
        let live = self.live.ends_at().filter(|end| *end > now && self.live.pictures.rung > 0);
        self.rays.rests_at(now).into_iter().chain(self.shading.rests_at(now)).chain(live).min()
    }

    /// The quality of the next picture.
    pub(super) fn quality(&self, now: Instant) -> Quality {
        match self.rays.is_moving(now) {
            true => Quality { rays: self.rays.rung(now), shading: 0 },
            false if self.live.is_on(now) => Quality { rays: self.live.pictures.rung, shading: 0 },
            false => Quality { rays: 0, shading: self.shading.rung(now) },
        }
    }

    /// Records how long a picture of this quality took that needed this kind of work.
    pub(super) fn picture_took(&mut self, work: Work, quality: Quality, time: Duration) {
        match work {
            Work::Rays if quality.shading == 0 => {
                self.rays.picture_took(quality.rays, time);
                self.live.pictures.picture_took(quality.rays, time);
            }
            Work::Shading if quality.rays == 0 => self.shading.picture_took(quality.shading, time),
            _ => {}
        }
    }
}

/// The ladder of the shading: what is left out, and the time as a fraction of that of all of stage 3. A first estimate.
const SHADING: [(&str, f64); 3] =
    [(texts::FULL_QUALITY, 1.0), (texts::NO_OCCLUSION, 0.6), (texts::NO_OCCLUSION_NO_SHADOW, 0.25)];

/// The settings with the shading of a rung of its ladder. Rays and filters of the distance map stay unchanged.
pub(super) fn shaded(mut settings: Settings, rung: usize) -> Settings {
    if rung > 0 {
        settings.light.occlusion = None;
    }
    if rung > 1 {
        settings.light.shadow = None;
    }
    settings
}

/// Most cells of a light volume that is made again for every picture of a view that moves.
const MOVING_CELLS: u32 = 1_000_000;

/// The settings with coarser cells of the light volume, for a moving view whose light changes with every picture. With fewer rays this is hardly
/// visible. A view that only rotates keeps its light volume.
pub(super) fn coarsely_lit(mut settings: Settings) -> Settings {
    if let Some(light) = &mut settings.light.volume {
        light.cells = light.cells.min(MOVING_CELLS);
    }
    settings
}

/// A quality in words, for the display of times.
pub(super) fn label(quality: Quality, rungs: &[Rung]) -> &str {
    match quality {
        Quality { rays: 0, shading } => SHADING[shading.min(SHADING.len() - 1)].0,
        Quality { rays, .. } => rungs.get(rays).map_or(SHADING[0].0, |rung| rung.label.as_str()),
    }
}

/// The settings with which stage 1 can serve all lower rungs of a scene at full quality, each once. Settings that only stages 2 to 4 use have
/// their defaults.
pub(super) fn lowered(rungs: &[Rung], scene: &Scene) -> Vec<Settings> {
    let mut all: Vec<Settings> = Vec::new();
    for rung in rungs.iter().skip(1) {
        let settings = rung.apply(&scene.settings);
        let ray = Ray { subsampling: 1, rays: 1, ..settings.ray };
        let (distance, light, post) = Default::default();
        let plain = Settings { ray, distance, light, post, ..settings };
        if !all.contains(&plain) {
            all.push(plain);
        }
    }
    all
}

/// Chooses the rung of the quality ladder for a moving view from the times of pictures. Rung 0 is full quality; each one after it is faster.
/// The default has no rungs: `new` makes one that can be used.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameBudget {
    budget: Option<Duration>,
    /// By rung: the expected time of a picture as a fraction of that on rung 0.
    expected: Vec<f64>,
    /// The expected fractions, corrected by measurements.
    measured: Vec<f64>,
    rung: usize,
    /// True until a picture was timed: the rung is a guess by the kind of device.
    is_guessed: bool,
    /// Mean time of the pictures on the present rung, s, and their number.
    mean: f64,
    pictures: u32,
    /// The previous rung and its mean.
    previous: Option<(usize, f64)>,
    moved: Option<Instant>,
}

impl FrameBudget {
    /// `time_shares`: expected time of a picture on each rung as a share of that on rung 0, decreasing. Without a budget every picture has full
    /// quality.
    pub(super) fn new(budget: Option<Duration>, time_shares: &[f64]) -> FrameBudget {
        let expected = if time_shares.is_empty() { vec![1.0] } else { time_shares.to_vec() };
        FrameBudget { budget, measured: expected.clone(), expected, ..FrameBudget::default() }
    }

    /// On this rung, or the last one, until the first picture was timed.
    fn beginning_at(mut self, rung: usize) -> FrameBudget {
        self.rung = rung.min(self.expected.len() - 1);
        self.is_guessed = self.rung > 0;
        self
    }

    /// Records that the view moved.
    fn view_moved(&mut self, now: Instant) {
        self.moved = Some(now);
    }

    /// Discards the measured times, because the scene changed.
    pub(super) fn forget(&mut self) {
        self.measured.clone_from(&self.expected);
        (self.pictures, self.previous) = (0, None);
    }

    /// True if the view moved less than `REST_DELAY` ago.
    pub(super) fn is_moving(&self, now: Instant) -> bool {
        self.moved.is_some_and(|at| now.saturating_duration_since(at) < REST_DELAY)
    }

    /// Time at which a moving view counts as at rest; None if it does not move.
    pub(super) fn rests_at(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|at| at + REST_DELAY).filter(|at| *at > now)
    }

    /// The rung of the next picture.
    pub(super) fn rung(&self, now: Instant) -> usize {
        match self.budget.is_some() && self.is_moving(now) {
            true => self.rung,
            false => 0,
        }
    }

    /// Records the time of a picture on a rung, and chooses the rung for the next pictures. Times on another rung than the chosen one are
    /// ignored, except that a picture at full quality within the budget chooses full quality.
    pub(super) fn picture_took(&mut self, rung: usize, time: Duration) {
        let Some(budget) = self.budget.map(|b| b.as_secs_f64()) else { return };
        let time = time.as_secs_f64();
        // Whatever rung the first time is of, it says more than a guess.
        if std::mem::take(&mut self.is_guessed) {
            self.rung = rung;
        }
        if rung != self.rung {
            // Another mode takes less: it needs no ladder.
            if rung == 0 && time <= budget * MARGIN {
                self.choose(0);
            }
            return;
        }
        self.mean = if self.pictures == 0 { time } else { self.mean + NEW_WEIGHT * (time - self.mean) };
        self.pictures = self.pictures.saturating_add(1);
        // The expected ratios come from another scene or device.
        if let Some((other, mean)) = self.previous.take_if(|(_, mean)| *mean > 0.0) {
            self.measured[rung] = self.measured[other] * self.mean / mean;
        }
        // A measurement may have been an outlier: return to the expected ratios from time to time.
        if self.pictures.is_multiple_of(FORGET_AFTER) {
            self.measured.clone_from(&self.expected);
        }
        if self.mean > budget {
            let last = self.measured.len() - 1;
            let fast = (rung + 1..=last).find(|r| self.estimate(*r) <= budget * MARGIN);
            self.choose(fast.unwrap_or(last));
        } else if self.pictures >= MIN_PICTURES && rung > 0 && self.estimate(rung - 1) <= budget * MARGIN {
            self.choose(rung - 1);
        }
    }

    fn choose(&mut self, rung: usize) {
        if rung != self.rung {
            self.previous = Some((self.rung, self.mean));
            (self.rung, self.pictures) = (rung, 0);
        }
    }

    /// Estimated time of a picture on another rung, s.
    fn estimate(&self, rung: usize) -> f64 {
        self.mean * self.measured[rung] / self.measured[self.rung].max(1e-9)
    }
}

/// Fewest rays along the shorter edge of a rendering, unless half the rays are fewer. With fewer a rung may hide or close a gap that the full picture
/// shows: tests/gpu/ladder.rs.
fn min_rays(settings: &Settings) -> u32 {
    let distance = &settings.distance;
    let is_rough =
        matches!(settings.mode, Mode::Surface | Mode::Mixed) && distance.median == 0 && distance.median_mm.is_none();
    // Of a surface without a median, single rays miss what their neighbours hit.
    if is_rough { 180 } else { 90 }
}

/// Largest number of rungs of a measured ladder.
const MAX_RUNGS: usize = 6;

/// A rung of the quality ladder: a change of settings that makes pictures faster.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// The change in words, for the display of times.
    pub(super) label: String,
    /// Expected time of a picture as a share of that at full quality.
    pub(super) time_share: f64,
    change: Change,
}

/// How a rung changes the settings.
#[derive(Clone, Debug, PartialEq)]
enum Change {
    None,
    /// One ray for so many pixels along each axis.
    Apart(u32),
    /// Assignments in the form of `--set`, from an error report.
    Measured(Vec<String>),
}

/// The built-in quality ladder, which only reduces the number of rays: without its filters a surface would have false holes, a longer step would
/// lose thin tissue, and neither saves as much as half the rays. The time shares are first estimates, from the phantom's face on two cores; the
/// frame budget corrects them by measurements.
pub fn built_in_ladder() -> Vec<Rung> {
    let rung = |label: &str, time_share, apart| Rung { label: label.into(), time_share, change: Change::Apart(apart) };
    vec![
        Rung { label: texts::FULL_QUALITY.into(), time_share: 1.0, change: Change::None },
        rung(texts::HALF_RAYS, 0.24, 2),
        rung(texts::QUARTER_RAYS, 0.065, 4),
        rung(texts::EIGHTH_RAYS, 0.02, 8),
    ]
}

/// The quality ladder of an error report: the Pareto front of its measured combinations of settings, from full quality to the fastest. Each rung
/// takes at most 75 % of the time of the one before; there are at most 6. Times are those of the picture without stage 1, which is the same on every
/// rung.
///
/// # Errors
/// One line: the report has no time of the scene as it is.
pub fn measured_ladder(report: &Report) -> Result<Vec<Rung>, String> {
    let picture_time = |c: &Combination| c.times.map(|t| t.picture.median).filter(|t| *t > 0.0);
    let as_it_is = report.choices.iter().find(|c| c.set.is_empty());
    let slowest = as_it_is.and_then(picture_time).ok_or("error report: the scene as it is has no time")?;
    let full = Rung { label: texts::FULL_QUALITY.into(), time_share: 1.0, change: Change::None };
    // A rung must save at least a quarter of the time of the one before.
    let mut rungs = vec![full];
    for choice in choose::front(report, Measure::Rmse).into_iter().rev().map(|i| &report.choices[i]) {
        let Some(time) = picture_time(choice) else { continue };
        let (time_share, before) = (time / slowest, rungs.last().map_or(1.0, |r| r.time_share));
        if time_share <= 0.75 * before {
            let label = choice.changed.iter().map(|(dial, point)| format!("{dial} {point}")).collect::<Vec<_>>();
            rungs.push(Rung { label: label.join(", "), time_share, change: Change::Measured(choice.set.clone()) });
        }
    }
    // If there are too many, the fastest one stays.
    while rungs.len() > MAX_RUNGS {
        rungs.remove(rungs.len() - 2);
    }
    Ok(rungs)
}

impl Rung {
    /// A rung with these assignments of settings, as from an error report.
    #[cfg(test)]
    pub(super) fn measured(set: &str) -> Rung {
        Rung { label: set.into(), time_share: 0.01, change: Change::Measured(vec![set.into()]) }
    }

    /// The change in words, for the display of times.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The settings with the change of this rung; unchanged if they do not allow it.
    pub fn apply(&self, settings: &Settings) -> Settings {
        let mut changed = settings.clone();
        match &self.change {
            Change::None => return changed,
            Change::Apart(apart) => {
                changed = changed.moving();
                let [width, height] = camera::full_size(&changed);
                let most = width.min(height) / min_rays(settings);
                changed.ray.subsampling = [8, 4].into_iter().find(|n| apart >= n && most >= *n).unwrap_or(2);
            }
            Change::Measured(set) => {
                let apply = || -> Option<Settings> {
                    let mut layers = Layers::of(settings)?;
                    set.iter().try_for_each(|assignment| layers.set(assignment)).ok()?;
                    layers.finish().ok()
                };
                changed = apply().unwrap_or(changed);
            }
        }
        // Stage 1 stays the same: a change would need all frames again.
        changed.slices = settings.slices.clone();
        changed.conditioning = settings.conditioning.clone();
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LADDER: [f64; 5] = [1.0, 0.4, 0.25, 0.15, 0.1];

    /// Draws pictures while the view moves, on a device that takes `full` s at full quality. Returns their rungs.
    fn drag(frame_budget: &mut FrameBudget, full: f64, ratios: &[f64], pictures: usize, now: Instant) -> Vec<usize> {
        let one = |_| {
            frame_budget.view_moved(now);
            let rung = frame_budget.rung(now);
            frame_budget.picture_took(rung, Duration::from_secs_f64(full * ratios[rung]));
            rung
        };
        (0..pictures).map(one).collect()
    }

    #[test]
    fn a_slow_device_goes_down_until_the_budget_is_kept_and_stays_there() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut frame_budget, 0.060, &LADDER, 40, now);
        assert!(rungs[5..].iter().all(|r| 0.060 * LADDER[*r] <= 0.016), "{rungs:?}");
        assert!(rungs[5..].windows(2).filter(|w| w[0] != w[1]).count() <= 2, "it settles: {rungs:?}");
    }

    #[test]
    fn wrong_expected_ratios_are_corrected() {
        let (now, real) = (Instant::now(), [1.0, 0.9, 0.8, 0.5, 0.2]);
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut frame_budget, 0.050, &real, 35, now);
        assert!(rungs[10..].iter().all(|r| 0.050 * real[*r] <= 0.016), "{rungs:?}");
    }

    #[test]
    fn a_fast_device_keeps_full_quality_and_recovers_from_an_outlier() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        assert!(drag(&mut frame_budget, 0.004, &LADDER, 20, now).iter().all(|r| *r == 0));
        drag(&mut frame_budget, 0.200, &LADDER, 3, now);
        assert!(frame_budget.rung(now) > 0);
        let later = drag(&mut frame_budget, 0.004, &LADDER, 60, now);
        assert_eq!(later.last(), Some(&0), "{later:?}");
    }

    #[test]
    fn the_fastest_rung_is_used_if_none_keeps_the_budget() {
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(1)), &LADDER);
        let rungs = drag(&mut frame_budget, 1.0, &LADDER, 10, Instant::now());
        assert_eq!(rungs.last(), Some(&4));
    }

    #[test]
    fn a_device_that_shares_memory_begins_with_half_the_rays_until_a_picture_is_timed() {
        assert_eq!([first_rung(false), first_rung(true)], [0, 1]);
        let (rungs, now) = (built_in_ladder(), Instant::now());
        let budget = Duration::from_millis(33);
        let begun = |first| {
            let mut pace = Pace::new(Some(budget), &rungs, first);
            pace.moved(Work::Rays, now);
            pace
        };
        assert_eq!(begun(first_rung(false)).quality(now).rays, 0);
        let half = begun(first_rung(true)).quality(now).rays;
        assert!(rungs[half].apply(&Settings::default()).ray.subsampling == 2);
        // The picture at rest, ms, and the rung of the drag that follows.
        for (full, rung) in [(10, 0), (60, 1), (400, 2), (3000, 3)] {
            let mut pace = begun(first_rung(true));
            pace.picture_took(Work::Rays, Quality::default(), Duration::from_millis(full));
            assert_eq!(pace.quality(now).rays, rung, "{full} ms");
        }
        assert_eq!(FrameBudget::new(Some(budget), &[1.0]).beginning_at(1).rung, 0, "a ladder of one rung");
    }

    #[test]
    fn live_volumes_are_drawn_as_fast_as_they_come_and_no_faster() {
        let rungs = built_in_ladder();
        // Full quality takes so long, ms; the quality while volumes come every 200 ms, and after the last.
        for (full, budget, live) in [(150, 33, 0), (500, 33, 1), (1500, 33, 2), (150, 300, 0), (1000, 300, 1)] {
            let mut pace = Pace::new(Some(Duration::from_millis(budget)), &rungs, 0);
            let mut now = Instant::now();
            for _ in 0..30 {
                now += Duration::from_millis(200);
                pace.volumes_came(1, now);
                let quality = pace.quality(now);
                let took = Duration::from_millis(full).mul_f64(rungs[quality.rays].time_share);
                pace.picture_took(Work::Rays, quality, took);
            }
            assert_eq!(pace.quality(now), Quality { rays: live, shading: 0 }, "{full} ms, budget {budget}");
            let end = now + Duration::from_millis(601);
            assert_eq!(pace.rests_at(now).is_some(), live > 0);
            assert_eq!(pace.quality(end), Quality::default(), "they have stopped");
            pace.volumes_stopped();
            assert_eq!(pace.quality(now), Quality::default(), "frozen");
        }
        // A single volume, and full quality always.
        for budget in [Some(Duration::from_millis(1)), None] {
            let (mut pace, now) = (Pace::new(budget, &rungs, 0), Instant::now());
            pace.volumes_came(1, now);
            pace.picture_took(Work::Rays, Quality::default(), Duration::from_secs(1));
            assert_eq!(pace.quality(now), Quality::default());
        }
    }

    #[test]
    fn a_view_at_rest_has_full_quality() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        drag(&mut frame_budget, 0.1, &LADDER, 10, now);
        assert!(frame_budget.rung(now) > 0);
        assert_eq!(frame_budget.rests_at(now), Some(now + REST_DELAY));
        assert_eq!(frame_budget.rung(now + REST_DELAY), 0);
        let mut unlimited = FrameBudget::new(None, &LADDER);
        drag(&mut unlimited, 9.0, &LADDER, 10, now);
        assert_eq!(unlimited.rung(now), 0);
    }

    #[test]
    fn every_rung_keeps_stage_1_and_is_faster_than_the_one_before() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            let rungs = built_in_ladder();
            assert_eq!(rungs[0].apply(&settings), settings);
            for pair in rungs.windows(2) {
                assert!(pair[1].time_share < pair[0].time_share);
                let changed = pair[1].apply(&settings);
                assert!(
                    changed.ray.subsampling > 1 && changed.slices == settings.slices,
                    "{preset}: {}",
                    pair[1].label
                );
            }
        }
    }

    /// Prevents anatomy that is not there: a rung leaves everything but the number of rays as it is.
    #[test]
    fn a_rung_takes_rays_away_and_nothing_else() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let mut settings = layers.finish().expect("settings");
            let rungs = built_in_ladder();
            for (size, all) in [
                ([742, 724], [1, 2, 4, 8]),
                ([1000, 719], [1, 2, 4, 4]),
                ([370, 362], [1, 2, 4, 4]),
                ([40, 30], [1, 2, 2, 2]),
            ] {
                (settings.picture.size, settings.distance.median) = (size, 15);
                let apart: Vec<u32> = rungs.iter().map(|rung| rung.apply(&settings).ray.subsampling).collect();
                assert_eq!(apart, all, "{preset} {size:?}");
            }
            (settings.mode, settings.picture.size, settings.distance.median) = (Mode::Surface, [742, 724], 0);
            assert_eq!(rungs[3].apply(&settings).ray.subsampling, 4, "{preset} without a median");
            for rung in &rungs[1..] {
                let mut changed = rung.apply(&settings);
                changed.ray = Ray { subsampling: 1, ..changed.ray };
                let one_ray = Settings { ray: Ray { rays: 1, ..settings.ray.clone() }, ..settings.clone() };
                assert_eq!(changed, one_ray, "{preset}: {}", rung.label());
            }
        }
    }

    #[test]
    fn settings_survive_the_conversion_to_layers() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            assert_eq!(Layers::of(&settings).and_then(|l| l.finish().ok()).as_ref(), Some(&settings), "{preset}");
        }
    }
}
