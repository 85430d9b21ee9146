//! The tables of the thesis, next to the times of this device: Tables 3-6 (4.5), the time for each rendered volume in surface mode, and
//! Tables 7-9 (5.5), the growth of filter windows. This file has the rows, their conditions and the values of the thesis. [`row_times`] and
//! [`growth`] fill them, and [`export`] writes Markdown and CSV.

pub mod export;
pub mod growth;
pub mod row_times;

use crate::machine::Device;
use crate::profile::Ceiling;
use crate::profile::statistics::Sample;
use growth::Grown;

/// Angle over the scan lines of a frame, deg. This and the following constants are the conditions of the thesis (4.5) where a table does not vary
/// them.
pub(crate) const SECTOR_ANGLE: f64 = 77.0;
/// Angle over the frames of a volume, deg.
pub(crate) const FAN_ANGLE: f64 = 61.0;
/// Depth of a scan line from the probe's face to its last sample in the measurements of the thesis, mm.
pub const DEPTH: f64 = 160.0;
/// Samples of a scan line in the measurements of the thesis.
pub const SAMPLES: usize = 512;
/// Speed of sound in the measurements of the thesis, m/s.
pub const SOUND_SPEED: f64 = 1540.0;
/// Time that the thesis measured under these conditions, ms.
const USUAL_MS: f64 = 54.6;
/// Memory bandwidth of the thesis' GTX 650, GB/s (128 bits at 5 GHz).
pub(crate) const THESIS_BANDWIDTH: f64 = 80.0;

/// Where the 3D filter of the thesis runs, and its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter3d {
    None,
    /// As in the thesis: along every ray, with a sliding front slice (`ray.sliding`). The value is the number of samples along each edge of the
    /// filter's cube.
    Sliding(u32),
    /// Separable, applied slice by slice in stage 1 (`slices.smooth.kernel`). The value is the number of taps along each axis.
    Stored(u32),
}

impl Filter3d {
    /// Name of the filter in the tables.
    pub fn name(self) -> String {
        match self {
            Filter3d::None => "none".into(),
            Filter3d::Sliding(n) => format!("{n}x{n}x{n} along the ray"),
            Filter3d::Stored(n) => format!("{n}x{n}x{n} slice by slice"),
        }
    }
}

/// The conditions under which one row of a table is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Frames of a volume.
    pub frames: usize,
    /// Scan lines of a frame, each of [`SAMPLES`] samples.
    pub lines: usize,
    /// n of a volume of n^3: slices of n x n pixels, and n samples of a ray from the face to the end of the volume.
    pub volume: u32,
    /// Edge of the square picture, pixels. It equals `volume`, except in the rows of Table 4 that keep the picture's size.
    pub picture: u32,
    pub filter_3d: Filter3d,
    /// Edge of the sigma filter's window, pixels. If rays are composited, it is the starting window of the enhanced sigma filters of all three
    /// stages. Otherwise a plain sigma filter runs on the distance map.
    pub filter_2d: u32,
    /// True for the pipeline of the thesis (4.1, chapter 6): whole rays are composited and their colour is lit, and the enhanced sigma filter runs in
    /// stages 1, 3 and 4 (preprocess, shade, postprocess). False: only the surface is found, in one colour, and a plain sigma filter runs in stage 3.
    pub is_composited: bool,
}

impl Conditions {
    /// The conditions of the thesis: 37 frames of 128 lines, a volume of 512^3, a picture of 512 x 512, the 3D filter of 3 samples, and a plain sigma
    /// filter of 9 pixels. With `quick`, the edges of the volume and the picture are a quarter, and the number of lines is a half of these.
    pub fn usual(quick: bool) -> Conditions {
        let (lines, volume) = if quick { (64, 128) } else { (128, 512) };
        let filter_3d = Filter3d::Sliding(3);
        Conditions { frames: 37, lines, volume, picture: volume, filter_3d, filter_2d: 9, is_composited: false }
    }
}

/// GPU times of a row of a table. Each list has one entry per repeat.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// Stages 2-4 (raycast, shade, postprocess) of one picture, which the thesis timed; ns, by repeat.
    pub picture: Vec<f64>,
    /// Stage 1 (preprocess) of all frames of a volume together; ns, by repeat.
    pub preprocess: Vec<f64>,
}

/// Median, minimum and maximum of a time over the repeats, ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Spread {
    /// Statistics of times that are given in ns. None without times.
    pub fn new(ns: &[f64]) -> Option<Spread> {
        let sample = Sample::new(ns).ok()?;
        let [median, min, max] = [sample.median(), sample.min(), sample.max()].map(|ns| ns * 1e-6);
        Some(Spread { median, min, max })
    }
}

/// The time that the thesis states for a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thesis {
    /// Time of one rendered volume, ms.
    pub ms: f64,
    /// True if the thesis has no such row in this table, and the time is that of another row: under the same conditions in another table, or, in
    /// Table 5, of the filter along the ray.
    pub(crate) from_others: bool,
}

/// A row of a table: what is measured, and the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Value of the condition that the table varies.
    pub label: String,
    pub conditions: Conditions,
    pub thesis: Thesis,
    /// The measured times. Empty before the measurement, and on a device without time stamps.
    pub times: Times,
    /// How many rays hit a surface, and at what mean depth. None before the measurement.
    pub reached: Option<Reached>,
}

/// One of Tables 3-6, or a comparison of two pipelines under the usual conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Number of the table in the thesis. None for the comparison of pipelines, which the thesis does not have.
    pub number: Option<u32>,
    /// Name of the condition that the table varies.
    pub varied: &'static str,
    pub rows: Vec<Row>,
    /// Index of the row with the usual conditions, to which ratios refer.
    pub usual: usize,
}

impl Table {
    /// Ratio of the row's median time of stages 2-4 ([`Times::picture`]) to that of the row with the usual conditions. None if either was not
    /// measured.
    pub fn ratio(&self, row: &Row) -> Option<f64> {
        let usual = Spread::new(&self.rows.get(self.usual)?.times.picture)?;
        let own = Spread::new(&row.times.picture)?;
        (usual.median > 0.0).then(|| own.median / usual.median)
    }

    /// Ratio of the row's time to that of the usual row, by the times of the thesis.
    pub(crate) fn thesis_ratio(&self, row: &Row) -> Option<f64> {
        self.rows.get(self.usual).map(|usual| row.thesis.ms / usual.thesis.ms)
    }
}

/// Tables 3-6 and the comparison of pipelines, with rows that are not measured yet. `quick`: see [`Conditions::usual`].
pub fn tables(quick: bool) -> Vec<Table> {
    let usual = Conditions::usual(quick);
    let table = |number, varied, rows: Vec<(String, Conditions, f64)>| {
        let row = |(label, conditions, ms): (String, Conditions, f64)| {
            let from_others = match number {
                Some(5) => matches!(conditions.filter_3d, Filter3d::Stored(_)),
                Some(6) => conditions == usual,
                number => number.is_none(),
            };
            Row { label, conditions, thesis: Thesis { ms, from_others }, times: Times::default(), reached: None }
        };
        let at = rows.iter().position(|(_, conditions, _)| *conditions == usual).unwrap_or(0);
        Table { number, varied, rows: rows.into_iter().map(row).collect(), usual: at }
    };
    let frames = [(27, 53.7), (31, 54.0), (35, 54.6), (37, USUAL_MS)];
    let volumes = [(128, 13.2), (256, 15.8), (384, 35.0), (512, USUAL_MS)];
    let filters = [
        (Filter3d::None, 21.5),
        (Filter3d::Sliding(3), USUAL_MS),
        (Filter3d::Sliding(5), 187.0),
        (Filter3d::Stored(3), USUAL_MS),
        (Filter3d::Stored(5), 187.0),
    ];
    let windows = [(3, 54.3), (5, 54.9), (7, 55.5), (9, USUAL_MS), (11, 56.8)];
    let volume = |fixed: bool, (n, ms): (u32, f64)| {
        let edge = n / (512 / usual.volume);
        let picture = if fixed { usual.picture } else { edge };
        let label = if quick { format!("{edge}^3 (for {n}^3)") } else { format!("{n}^3") };
        let label = if fixed { format!("{label}, picture {picture}^2") } else { label };
        (label, Conditions { volume: edge, picture, ..usual }, ms)
    };
    // Of the largest both readings are the same.
    let readings =
        [volumes.map(|v| volume(false, v)).to_vec(), volumes[..3].iter().map(|v| volume(true, *v)).collect()];
    let pipelines =
        [("one colour, sigma filter in stage 3", false), ("composited, enhanced sigma filter in stages 1, 3, 4", true)];
    let pipeline =
        |(name, is_composited): (&str, bool)| (name.to_string(), Conditions { is_composited, ..usual }, USUAL_MS);
    vec![
        table(Some(3), "frames", frames.map(|(n, ms)| (n.to_string(), Conditions { frames: n, ..usual }, ms)).to_vec()),
        table(Some(4), "volume", readings.concat()),
        table(
            Some(5),
            "3D filter",
            filters.map(|(f, ms)| (f.name(), Conditions { filter_3d: f, ..usual }, ms)).to_vec(),
        ),
        table(
            Some(6),
            "2D filter",
            windows.map(|(n, ms)| (format!("{n}x{n}"), Conditions { filter_2d: n, ..usual }, ms)).to_vec(),
        ),
        table(None, "pipeline", pipelines.map(pipeline).to_vec()),
    ]
}

/// Where the rays of a row hit a surface, which shows whether rows did the same work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Share (0..1) of the rays that hit a surface.
    pub share: f64,
    /// Mean depth of these hits below the probe's face, mm; 0 without hits.
    pub depth: f64,
}

/// All tables with the conditions of the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    pub device: Device,
    /// Name, version and build of the program.
    pub program: String,
    /// When it was measured, RFC 3339.
    pub date: String,
    /// True for smaller volumes and pictures, see [`Conditions::usual`].
    pub quick: bool,
    /// Number of measured volumes for each row.
    pub repeats: usize,
    /// Number of volumes for each row that are rendered first and not measured.
    pub warm_up: usize,
    /// The rate of copying on this device: bytes read plus bytes written, per second. None without time stamps.
    pub copy: Option<Ceiling>,
    pub tables: Vec<Table>,
    pub grown: Vec<Grown>,
}

impl Report {
    /// True if any row has times.
    pub fn has_times(&self) -> bool {
        self.tables.iter().flat_map(|t| &t.rows).any(|r| !r.times.picture.is_empty())
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Test helper: a report whose rows have no times.
    pub fn report() -> Report {
        Report {
            device: Device {
                name: "Some, \"device\" | one".into(),
                driver: "driver 1".into(),
                api: "1.3.0".into(),
                is_software: true,
                timestamp_period_ns: 1.0,
                valid_bits: 64,
                calibrated: true,
                clocks: None,
            },
            program: "echolume 0".into(),
            date: "2026-01-02T03:04:05Z".into(),
            quick: false,
            repeats: 3,
            warm_up: 1,
            copy: None,
            tables: tables(false),
            grown: Vec::new(),
        }
    }

    /// Test helper: a report whose row n takes 2 (n + 1) ms in stages 2-4, and ten times as long in stage 1.
    pub fn measured() -> Report {
        let mut report = report();
        report.copy = Some(Ceiling { median: 8e9, low: 7e9, high: 9e9 });
        for table in &mut report.tables {
            for (n, row) in table.rows.iter_mut().enumerate() {
                let ns = 2e6 * (n + 1) as f64;
                row.times.picture = vec![ns * 1.5, ns * 0.5, ns];
                row.times.preprocess = vec![ns * 10.0; 3];
                row.reached = Some(Reached { share: 0.987, depth: 71.25 });
            }
        }
        report
    }

    #[test]
    fn rows_vary_one_condition_and_all_tables_share_the_usual_row() {
        for quick in [false, true] {
            let usual = Conditions::usual(quick);
            let counts: Vec<_> = tables(quick).iter().map(|t| (t.number, t.rows.len())).collect();
            assert_eq!(counts, [(Some(3), 4), (Some(4), 7), (Some(5), 5), (Some(6), 5), (None, 2)]);
            for table in tables(quick) {
                let at_usual: Vec<_> = table.rows.iter().filter(|r| r.conditions == usual).collect();
                assert_eq!(at_usual.len(), 1, "table {}", table.varied);
                assert_eq!(table.rows[table.usual].conditions, usual);
                assert_eq!(at_usual[0].thesis.ms, 54.6);
                for row in &table.rows {
                    let (c, u) = (row.conditions, usual);
                    let differs = [
                        c.frames != u.frames,
                        c.volume != u.volume,
                        c.filter_3d != u.filter_3d,
                        c.filter_2d != u.filter_2d,
                        c.is_composited != u.is_composited,
                    ];
                    let expected = [Some(3), Some(4), Some(5), Some(6), None].map(|n| n == table.number && c != u);
                    assert_eq!((differs, c.lines), (expected, u.lines), "table {}: {}", table.varied, row.label);
                    let is_fixed = row.label.contains("picture");
                    assert_eq!(c.picture, if is_fixed { u.picture } else { c.volume }, "{}", row.label);
                }
            }
        }
    }

    #[test]
    fn ratios_are_to_the_usual_row() {
        let mut table = tables(false).remove(2);
        assert_eq!(table.ratio(&table.rows[0]), None);
        for (row, ms) in table.rows.iter_mut().zip([2.0, 4.0, 10.0, 3.0, 3.0]) {
            row.times.picture = vec![ms * 1e6; 3];
        }
        let ratios: Vec<_> = table.rows.iter().map(|r| table.ratio(r)).collect();
        assert_eq!(ratios, [0.5, 1.0, 2.5, 0.75, 0.75].map(Some));
        let thesis = table.thesis_ratio(&table.rows[2]).expect("a ratio");
        assert!((thesis - 187.0 / 54.6).abs() < 1e-12);
    }
}
