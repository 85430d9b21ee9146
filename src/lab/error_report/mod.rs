//! Error against run time (work-precision). Every approximation is a dial. The points of a dial are its settings, each with its errors and
//! its times on the device. [`errors_and_times`] fills a [`Report`], which is stored as JSON, and renders combinations of several dials.
//! [`export`] and [`plot`] write it as text and as a diagram, and [`choose`] picks settings among the combinations.

pub mod budget;
pub mod choose;
pub mod convergence;
pub mod dials;
pub mod errors_and_times;
pub mod export;
pub mod metrics;
pub mod plot;
pub mod richardson;
mod running;

use crate::baselines::Stored;
use crate::profile::LEVEL;
use crate::profile::statistics::{Interval, Sample};
use crate::scene::Scene;
use crate::tree::{FromNode, ToNode};
use budget::Budget;
use convergence::Fit;
use metrics::{Levels, SurfaceError};

/// The measured errors and times of one scene on one device.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Report {
    /// The name of the format: [`Stored::FORMAT`].
    pub format: String,
    pub device: String,
    pub driver: String,
    /// When it was measured, ISO 8601.
    pub date: String,
    /// Description of the input on the first line, then all settings as TOML, with defaults filled in.
    pub scene: String,
    pub sizes: Sizes,
    /// Number of timed runs of each setting. The scene's own setting of a dial has more, because it runs in turn with every other setting.
    pub repeats: u32,
    pub dials: Vec<Dial>,
    /// Combinations of settings of one dial or of several, each rendered and compared with the scene's finest picture. The first is the scene with
    /// its own settings.
    pub choices: Vec<Combination>,
    /// How much each approximation of the scene contributes to its error.
    pub budget: Budget,
}

/// Settings of one or several dials at once, or the scene's own settings, with their errors and times.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Combination {
    /// What differs from the scene's own settings: name of each dial, and label of its point. Empty for the scene's own settings.
    pub changed: Vec<(String, String)>,
    /// The assignments of these changes, `key=value` as for `--set`.
    pub set: Vec<String>,
    /// Errors against the reference: the scene's picture with the finest numerical settings.
    pub errors: Errors,
    /// Estimate of the error of that reference itself; 0 if it is [`Reference::F64`].
    pub reference_error: OwnError,
    /// Times of the combination. None if the device has no time stamps.
    pub times: Option<Times>,
}

/// An estimate of the error of a reference. Of [`Reference::Exact`], `rmse` is its `estimate`, also where that is in mm, and `levels` is 255 times
/// `rmse`.
#[derive(Clone, Copy, Debug, Default, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct OwnError {
    /// RMSE of the reference's picture, 0..1.
    pub rmse: f64,
    /// 95th percentile over its pixels after toning, levels of 255.
    pub levels: f64,
}

impl OwnError {
    /// The upper limit of the error of the last picture of a converging sequence. `errors`: the difference of the last two pictures.
    pub fn of(errors: &Errors) -> OwnError {
        OwnError { rmse: errors.rmse, levels: errors.levels.p95 }
    }
}

/// What the settings of a dial have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(rename_all = "kebab-case")]
pub enum Kind {
    /// The settings compute the same picture more or less accurately. A choice may vary the dial together with others.
    Numerical,
    /// The settings change what several numerical dials change, all at once. A choice may vary the dial, but then no other dial.
    Several,
    /// The settings change the number of pixels, or of rays in a pixel: another picture, with an error of its own. No choice varies the dial.
    Pixels,
    /// The settings change the look: differences from the scene's own setting are not errors. No choice varies the dial.
    Look,
}

/// Sizes of the volume and of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Sizes {
    /// Columns, rows and slices of the volume, texels.
    pub volume: [u32; 3],
    /// Size of the picture with the scene's own settings, pixels. A dial may change it.
    pub picture: [u32; 2],
}

/// Measurements of one dial, an approximation or look that is varied while all other settings stay the scene's own.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Dial {
    pub name: String,
    pub kind: Kind,
    /// True if the points lie on an axis, so that a line may join them; false if they are names.
    pub is_ordered: bool,
    /// Unit of the points' values; empty if they have none.
    pub unit: String,
    pub reference: Reference,
    pub points: Vec<Point>,
    /// The fit of the error as a power of the point's value. None if no order could be fitted, and for other dials than `step`.
    pub order: Option<Fit>,
    /// RMSE, 0..1, of the device with the settings of the reference against the reference in f64 or of exact rays: what arithmetic and texel formats
    /// alone make. None for other references, and for other dials than `step`.
    #[tree(default)]
    pub floor: Option<f64>,
    /// For a dial that changes how rays take samples, why its reference is not exact rays. None if it is, if another reference was asked for, and for
    /// other dials.
    #[tree(default)]
    pub note: Option<String>,
}

impl Dial {
    /// True if a point lies on the dial's axis. A tolerance of 0 does not, because it means no tolerance.
    pub fn is_on_axis(&self, point: &Point) -> bool {
        self.is_ordered && (self.name != "tolerance" || point.value > 0.0)
    }
}

/// What the errors of a dial are measured against.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Reference {
    /// The picture of the reference renderer, in f64 on the CPU.
    F64,
    /// The picture of the reference renderer with exact rays in place of stage 2 (raycast): without steps, and without a table of the transfer
    /// function.
    Exact {
        /// The exact rays' own estimate of their error, root mean square over the rays; not a bound. It is that of the picture, or of the distance
        /// map in mm if the scene shows surfaces.
        estimate: f64,
        /// Number of pieces of rays that were integrated.
        pieces: u64,
    },
    /// The device's picture with the scene's own settings. The dial's settings differ in look, and the differences are not errors.
    AsItIs,
    /// A picture of the device itself, as accurate as the settings allow.
    Converged {
        /// Assignments `key=value` of that picture.
        set: Vec<String>,
        /// RMSE of that picture against one with the next coarser settings: an upper bound of its error if the pictures converge.
        rmse: f64,
    },
    /// The limit of pictures of the device for ever smaller cells of the light volume, by Richardson extrapolation ([`richardson`]).
    Extrapolated {
        /// Assignments `key=value` of the picture with the smallest cells.
        set: Vec<String>,
        /// Edges of the cells, mm, descending.
        cells: [f64; 3],
        /// The observed order of the error in the size of the cells.
        order: f64,
        /// RMSE of the limit: the root of the sum of the squares of two differences, from the limit of the two coarser pictures alone and from the
        /// next coarser setting of everything else. It is an upper bound of the limit's error if the pictures converge.
        rmse: f64,
    },
}

/// A measured setting of a dial.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Point {
    /// Short label for plots: "0.25", "pre-integrated".
    pub label: String,
    /// Assignments of the setting, each `key=value` as for `--set`.
    pub set: Vec<String>,
    /// Value on the dial's axis, in the dial's unit. For names it is a number that only gives their order in a plot.
    pub value: f64,
    pub errors: Errors,
    /// Times with this setting. None if the device has no time stamps.
    pub times: Option<Times>,
    /// Times divided by those of the scene's own setting, from alternate runs of both. None if the device has no time stamps.
    pub ratios: Option<Times>,
    /// True for the scene's own setting, which has no assignments.
    pub is_default: bool,
}

/// Errors of a picture against a reference, and of the surface if it shows one. With layout `single`, pixels that hit a surface in only one of the
/// two, or surfaces further apart than [`Scene::cliff`](crate::scene::Scene::cliff), are left out of the errors of the picture, and so are their
/// neighbours. `mm` has the shares of such pixels, without the neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Errors {
    /// Root mean square difference of red, green and blue before toning, 0..1.
    pub rmse: f64,
    /// Largest difference of any of these channels of any pixel, 0..1.
    pub max: f64,
    /// Peak signal-to-noise ratio, dB; None (infinite) for equal pictures.
    pub psnr: Option<f64>,
    /// Structural similarity (SSIM), at most 1. Pixels that are left out count as equal. None for a picture smaller than 11 x 11 pixels.
    pub ssim: Option<f64>,
    /// Differences of the pictures as displayed.
    pub levels: Levels,
    /// Error of the distance map, mm. None without one, or if it differs in size from that of the reference.
    pub mm: Option<SurfaceError>,
    /// Error of the normals, degrees. None where `mm` is None.
    pub degrees: Option<SurfaceError>,
}

/// Statistics of a time over several runs, ns, or of the ratio of two times.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Time {
    pub median: f64,
    /// Confidence interval of the median (`low`, `high`): 95 % by order statistics. With fewer than 6 runs it is from the shortest to the longest.
    pub low: f64,
    pub high: f64,
    /// 95th percentile by the nearest rank. With fewer than 20 runs it is the longest run.
    pub p95: f64,
}

impl Time {
    /// The statistics of the values of several runs. None without runs, or if a value is not finite.
    pub fn of(runs: &[f64]) -> Option<Time> {
        let sample = Sample::new(runs).ok()?;
        let (sorted, n) = (sample.sorted(), sample.count());
        let Interval { low, high, .. } = sample.median_interval(LEVEL);
        let p95 = sorted[(n * 95).div_ceil(100) - 1];
        let median = (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
        Some(Time { median, low, high, p95 })
    }
}

/// GPU times, ns, or ratios of them.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Times {
    /// Work for each frame and volume: upload, stage 1 (preprocess), and the value ranges of bricks.
    pub volume: Time,
    /// Work for each picture: which bricks rays may skip, stages 2 to 4 (raycast, shade, postprocess), and the readback.
    pub picture: Time,
    /// Statistics of the sum of both in each run, or of the ratio of such sums.
    pub total: Time,
}

impl Times {
    /// The statistics of several runs, each with the times [volume, picture], ns. None without runs.
    pub fn of(runs: &[[f64; 2]]) -> Option<Times> {
        let of = |part: fn(&[f64; 2]) -> f64| Time::of(&runs.iter().map(part).collect::<Vec<_>>());
        Some(Times { volume: of(|r| r[0])?, picture: of(|r| r[1])?, total: of(|r| r[0] + r[1])? })
    }
}

/// The kind of error by which a plot or a choice compares settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// RMSE of the picture before toning, 0..1.
    Rmse,
    /// 95th percentile over the pixels after toning, levels of 255.
    Levels,
    /// RMS error of the distance map, mm.
    Mm,
    /// RMS error of the normals, degrees.
    Degrees,
}

impl Measure {
    /// The error by this measure. None if it was not measured or is not finite.
    pub fn of(self, errors: &Errors) -> Option<f64> {
        let rms = |surface: &Option<SurfaceError>| surface.and_then(|s| s.error).map(|e| e.rms);
        let error = match self {
            Measure::Rmse => Some(errors.rmse),
            Measure::Levels => Some(errors.levels.p95),
            Measure::Mm => rms(&errors.mm),
            Measure::Degrees => rms(&errors.degrees),
        };
        error.filter(|e| e.is_finite())
    }

    pub fn name(self) -> &'static str {
        match self {
            Measure::Rmse => "RMSE of the picture (0..1)",
            Measure::Levels => "95th percentile of the pixels (levels of 255)",
            Measure::Mm => "RMS error of distance (mm)",
            Measure::Degrees => "RMS error of normals (degrees)",
        }
    }

    /// An error by this measure as text for messages, with its unit, such as "RMSE 1.000e-3" or "0.250 levels".
    pub fn format(self, error: f64) -> String {
        match self {
            Measure::Rmse => format!("RMSE {error:.3e}"),
            Measure::Levels => format!("{error:.3} levels"),
            Measure::Mm => format!("{error:.3e} mm"),
            Measure::Degrees => format!("{error:.3e} degrees"),
        }
    }
}

impl Dial {
    /// True if the dial's settings differ in look, so that differences between their pictures are not errors.
    pub fn is_look(&self) -> bool {
        self.kind == Kind::Look
    }
}

impl Report {
    /// True if the report was measured with the settings of `scene`, and with a volume and a picture of its sizes.
    pub fn is_of(&self, scene: &Scene) -> bool {
        let settings = self.scene.split_once('\n').map_or("", |(_, settings)| settings);
        let sizes = Sizes { volume: scene.volume_size(), picture: scene.picture_size() };
        self.sizes == sizes && scene.settings.to_toml().is_ok_and(|own| own == settings)
    }

    /// The Pareto front over the points of all dials by median time and error: indices of dial and point, from the fastest to the most accurate.
    /// Points without a time or without this error are not on it, nor are points of looks.
    pub fn pareto_front(&self, measure: Measure) -> Vec<(usize, usize)> {
        let mut indices = Vec::new();
        let mut pairs = Vec::new();
        for (d, dial) in self.dials.iter().enumerate().filter(|(_, dial)| !dial.is_look()) {
            for (p, point) in dial.points.iter().enumerate() {
                if let (Some(times), Some(error)) = (point.times, measure.of(&point.errors)) {
                    indices.push((d, p));
                    pairs.push([times.total.median, error]);
                }
            }
        }
        pareto_front(&pairs).into_iter().map(|i| indices[i]).collect()
    }
}

impl Stored for Report {
    const FORMAT: &'static str = "echolume error report 3";
    const WHAT: &'static str = "an error report";
    const AGAIN: &'static str = "measure again with it";
    const KIND: &'static str = "report";
    const MAX_BYTES: u64 = 64 << 20;

    /// All numbers are finite, and no error or time is negative.
    fn fault(&self) -> Option<(String, String)> {
        let impossible = |of: String, v: f64| Some((of, format!("{v} is not a possible result")));
        for dial in &self.dials {
            let reference_rmse = match &dial.reference {
                Reference::F64 | Reference::AsItIs => 0.0,
                Reference::Converged { rmse, .. } | Reference::Extrapolated { rmse, .. } => *rmse,
                Reference::Exact { estimate, .. } => *estimate,
            };
            if !(reference_rmse.is_finite() && reference_rmse >= 0.0) {
                return Some((format!("dial '{}'", dial.name), format!("its reference's error is {reference_rmse}")));
            }
            for point in &dial.points {
                let wrong = wrong_result(&point.errors, &[point.times, point.ratios], 0.0);
                if let Some(v) = wrong.or(Some(point.value).filter(|v| !v.is_finite())) {
                    return impossible(format!("dial '{}', point '{}'", dial.name, point.label), v);
                }
            }
        }
        for choice in &self.choices {
            if let Some(v) = wrong_result(&choice.errors, &[choice.times], choice.reference_error.rmse) {
                return impossible(format!("choice '{}'", choice.set.join(" ")), v);
            }
        }
        let sums = self.budget.shares.iter().map(|share| (share.source.as_str(), &share.errors));
        let own = self.budget.reference_error.rmse;
        let mut sums = sums.chain([("total", &self.budget.total)]);
        sums.find_map(|(source, errors)| impossible(format!("budget, '{source}'"), wrong_result(errors, &[], own)?))
    }
}

/// A number that no measurement gives: one that is not finite, or an error or time below 0.
fn wrong_result(e: &Errors, times: &[Option<Times>], other: f64) -> Option<f64> {
    let surfaces = [e.mm, e.degrees].into_iter().flatten().flat_map(|s| {
        let spread = s.error.map_or([0.0; 4], |e| [e.rms, e.median, e.p95, e.max]);
        spread.into_iter().chain([s.false_hits, s.missed_hits, s.jumps])
    });
    let l = e.levels;
    let levels = [l.rms, l.median, l.p95, l.max, l.over_1, l.over_8];
    let times = times.iter().flatten().flat_map(|t| [t.volume, t.picture, t.total]);
    let times = times.flat_map(|t| [t.low, t.median, t.high, t.p95]);
    let mut unsigned = [e.rmse, e.max].into_iter().chain(levels).chain(surfaces).chain(times).chain([other]);
    let wrong = unsigned.find(|v| !v.is_finite() || *v < 0.0);
    wrong.or_else(|| [e.psnr, e.ssim].into_iter().flatten().find(|v| !v.is_finite()))
}

/// The Pareto front of pairs: indices of the pairs that no other pair dominates (at most as large in both values and smaller in one), in order of the
/// first value. All equal pairs stay, in the given order. Pairs that are not finite are never on the front.
pub fn pareto_front(pairs: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..pairs.len()).filter(|i| pairs[*i].iter().all(|v| v.is_finite())).collect();
    // A stable sort: equal pairs keep their order.
    order.sort_by(|a, b| pairs[*a][0].total_cmp(&pairs[*b][0]).then(pairs[*a][1].total_cmp(&pairs[*b][1])));
    let mut kept: Vec<usize> = Vec::new();
    for i in order {
        let beaten = kept.last().is_some_and(|last| pairs[*last][1] <= pairs[i][1] && pairs[*last] != pairs[i]);
        if !beaten {
            kept.push(i);
        }
    }
    kept
}
