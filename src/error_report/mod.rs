//! Error against run time: what a measurement of the dials is, as a file, as a table, as a picture, and as the settings to use.
//! Every approximation is a dial; a dial's points are its settings, each with its errors and its time on the device.

pub mod choose;
pub(crate) mod command;
pub mod convergence;
pub mod dials;
pub mod export;
pub mod measure;
pub mod metrics;
pub mod plot;

use convergence::Fit;
use metrics::{PictureError, SurfaceError};
use serde::{Deserialize, Serialize};

/// What the first line of a stored report must say; another version is refused, not guessed.
pub const FORMAT: &str = "echolume error report 1";

/// A measurement of one scene on one device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// [`FORMAT`].
    pub format: String,
    pub device: String,
    pub driver: String,
    /// When it was measured, ISO 8601.
    pub date: String,
    /// In words on its first line, then all settings, resolved, as TOML.
    pub scene: String,
    pub sizes: Sizes,
    /// Runs of which a time is the median.
    pub repeats: u32,
    pub dials: Vec<Dial>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    /// Texels of the volume.
    pub volume: [u32; 3],
    /// Pixels of the picture by default.
    pub picture: [u32; 2],
}

/// One approximation, turned while all else stays as it is by default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dial {
    pub name: String,
    /// Unit of the points' values, empty where they are counts or names.
    pub unit: String,
    pub reference: Reference,
    pub points: Vec<Point>,
    /// Error against the value, where it has an order.
    pub order: Option<Fit>,
    /// RMSE of the device against f64 where nothing but its arithmetic and formats differ.
    #[serde(default)]
    pub floor: Option<f64>,
}

/// What the errors of a dial are taken against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Reference {
    /// The four stages in f64 on the CPU.
    F64,
    /// A picture of the device's own, converged as far as it goes.
    Converged {
        /// The assignments that make it.
        set: Vec<String>,
        /// Its RMSE against the next coarser one, an upper bound for its own error where it converges.
        rmse: f64,
    },
}

/// One setting of a dial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// As short as a plot needs: "0.25", "pre-integrated".
    pub label: String,
    /// The assignments that make it, each "key=value" as `--set` takes them.
    pub set: Vec<String>,
    /// Where it lies on the dial, in the dial's unit; for names their number in order.
    pub value: f64,
    pub errors: Errors,
    /// None on a device without time stamps.
    pub time: Option<Time>,
    /// Whether this is what the scene has without any assignment.
    pub is_default: bool,
}

/// Pictures on a scale of 0..1; the surface where there is one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Errors {
    pub rmse: f64,
    pub max: f64,
    /// dB; none (infinite) for equal pictures.
    pub psnr: Option<f64>,
    pub ssim: Option<f64>,
    /// Of the distance map, mm.
    pub mm: Option<SurfaceError>,
    /// Of the normals, degrees.
    pub degrees: Option<SurfaceError>,
}

impl From<PictureError> for Errors {
    fn from(e: PictureError) -> Errors {
        Errors { rmse: e.rmse, max: e.max, psnr: e.psnr, ssim: e.ssim, mm: None, degrees: None }
    }
}

/// Time on the device over the repeats, ns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Time {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

impl Time {
    /// None of no run.
    pub fn of(runs: &[f64]) -> Option<Time> {
        let mut sorted = runs.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (low, high) = (*sorted.first()?, *sorted.last()?);
        let n = sorted.len();
        Some(Time { median: (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0, low, high })
    }
}

/// Which error is meant where one is enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Of the picture, 0..1.
    Rmse,
    /// RMS of the distance map.
    Mm,
    /// RMS of the normals.
    Degrees,
}

impl Measure {
    /// None where it was not measured, or is no number.
    pub fn of(self, errors: &Errors) -> Option<f64> {
        let rms = |surface: &Option<SurfaceError>| surface.and_then(|s| s.error).map(|e| e.rms);
        let error = match self {
            Measure::Rmse => Some(errors.rmse),
            Measure::Mm => rms(&errors.mm),
            Measure::Degrees => rms(&errors.degrees),
        };
        error.filter(|e| e.is_finite())
    }

    pub fn name(self) -> &'static str {
        match self {
            Measure::Rmse => "RMSE of the picture (0..1)",
            Measure::Mm => "RMS error of distance (mm)",
            Measure::Degrees => "RMS error of normals (degrees)",
        }
    }

    /// An error with its unit.
    pub fn say(self, error: f64) -> String {
        match self {
            Measure::Rmse => format!("RMSE {error:.3e}"),
            Measure::Mm => format!("{error:.3e} mm"),
            Measure::Degrees => format!("{error:.3e} degrees"),
        }
    }
}

impl Report {
    /// # Errors
    /// One line: a number is not finite or an error or time is negative, named by dial and point. JSON has no words for them.
    pub fn to_json(&self) -> Result<String, String> {
        self.check()?;
        serde_json::to_string_pretty(self).map_err(|e| format!("error report: {e}"))
    }

    /// # Errors
    /// One line: no JSON, of another format or version, or with numbers that no measurement gives.
    pub fn from_json(text: &str) -> Result<Report, String> {
        Report::read(text).map_err(|e| crate::text::single_line(&e))
    }

    fn read(text: &str) -> Result<Report, String> {
        #[derive(Deserialize)]
        struct Version {
            format: String,
        }
        let unread = |e: serde_json::Error| format!("error report: cannot be read: {e}");
        // The version first: a newer one would fail by its fields, and say so less clearly.
        let version: Version = serde_json::from_str(text).map_err(unread)?;
        if version.format != FORMAT {
            return Err(format!("error report: format is '{}', this program reads '{FORMAT}'", version.format));
        }
        let report: Report = serde_json::from_str(text).map_err(unread)?;
        report.check()?;
        Ok(report)
    }

    fn check(&self) -> Result<(), String> {
        for dial in &self.dials {
            let own = match &dial.reference {
                Reference::F64 => 0.0,
                Reference::Converged { rmse, .. } => *rmse,
            };
            if !(own.is_finite() && own >= 0.0) {
                return Err(format!("error report: dial '{}': its reference's RMSE is {own}", dial.name));
            }
            for point in &dial.points {
                let (e, bad) = (&point.errors, |v: f64| !v.is_finite() || v < 0.0);
                let surfaces = [e.mm, e.degrees].into_iter().flatten().flat_map(|s| {
                    let spread = s.error.map_or([0.0; 4], |e| [e.rms, e.median, e.p95, e.max]);
                    spread.into_iter().chain([s.false_hits, s.missed_hits])
                });
                let times = point.time.map_or([0.0; 3], |t| [t.low, t.median, t.high]);
                let wrong = [e.rmse, e.max].into_iter().chain(surfaces).chain(times).find(|v| bad(*v));
                let unsigned = [Some(point.value), e.psnr, e.ssim].into_iter().flatten().find(|v| !v.is_finite());
                if let Some(v) = wrong.or(unsigned) {
                    return Err(format!(
                        "error report: dial '{}', point '{}': {v} is no result",
                        dial.name, point.label
                    ));
                }
            }
        }
        Ok(())
    }

    /// The front over all dials of a report: dial and point, from the fastest to the most accurate. Points without a time or
    /// without this error are not on it.
    pub fn pareto_front(&self, measure: Measure) -> Vec<(usize, usize)> {
        let mut places = Vec::new();
        let mut pairs = Vec::new();
        for (d, dial) in self.dials.iter().enumerate() {
            for (p, point) in dial.points.iter().enumerate() {
                if let (Some(time), Some(error)) = (point.time, measure.of(&point.errors)) {
                    places.push((d, p));
                    pairs.push([time.median, error]);
                }
            }
        }
        pareto_front(&pairs).into_iter().map(|i| places[i]).collect()
    }
}

/// Indices of the pairs that no other pair dominates (is at most as large in both and smaller in one), in order of the first
/// value; equal pairs all stay, in the order given. Pairs that are not finite are never on it.
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
