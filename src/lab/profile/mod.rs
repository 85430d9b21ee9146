//! Profiles: run times of every pass with the conditions of their measurement, and their JSON file. [`timed_run`] makes a profile,
//! [`compare`] compares two, and [`export`] writes them as text and as Chrome traces. [`pipelines`] measures the compilation of pipelines.

pub mod compare;
pub mod export;
pub mod pipelines;
pub mod statistics;
pub mod timed_run;

use crate::baselines::Stored;
use crate::machine::Device;
use crate::tree::{FromNode, ToNode};
use statistics::Sample;

/// Requested coverage of confidence intervals.
pub const LEVEL: f64 = 0.95;

/// The result of one run of `echolume profile`. Lists of times are in ns, with one entry per repeat in the order in which they were measured.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Profile {
    /// The name of the file format: [`Stored::FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// When it was measured, RFC 3339.
    pub date: String,
    pub device: Device,
    /// All settings as TOML, with defaults filled in.
    pub scene: String,
    /// Fingerprint of `scene`: [`settings_hash`].
    pub settings_hash: String,
    /// Description of the input.
    pub input: String,
    pub sizes: Sizes,
    /// The least time to acquire the volume. None for a volume that is not a sweep of a probe.
    pub acquisition: Option<Acquisition>,
    /// Number of measured repeats, each of which renders one picture.
    pub repeats: usize,
    /// Number of repeats that are run first and not measured.
    pub warm_up: usize,
    /// Growth of the view's azimuth from each repeat to the next, deg.
    #[tree(default)]
    pub turn: f64,
    /// The times of the passes, in running order, copies to and from the device included. Without time stamps there are none.
    pub passes: Vec<PassProfile>,
    /// The times of host spans: `stage` (frames are written into staging memory), `submit` and `wait` (for the picture). They do not add up to
    /// `wall_ns`.
    pub host: Vec<PassProfile>,
    /// Wall time of the repeat by the host's clock, from before its first frame is uploaded until the picture is in host memory.
    pub wall_ns: Vec<f64>,
    /// CPU time of the process over the same intervals, all threads, user and system. On a software device it is the cost of the work. Empty if the
    /// system does not report it.
    #[tree(default)]
    pub cpu_ns: Vec<f64>,
    /// Time from the begin of the first pass to the end of the last one, by the device's clock. Empty without time stamps.
    pub device_ns: Vec<f64>,
    /// The measured roofline ceilings of the device. None if they were not asked for, or the device has no time stamps.
    pub ceilings: Option<Ceilings>,
    /// How the volume is sampled and how texels are read, in words. None in files of earlier versions.
    #[tree(default)]
    pub sampling: Option<String>,
    /// Largest error of the position of device spans on the host's clock, ns. None if the device's clock cannot be read.
    #[tree(default)]
    pub clock_deviation_ns: Option<u64>,
}

/// Sizes of the data that is processed.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Sizes {
    /// Samples per line, and number of lines; columns and rows of a Cartesian frame.
    pub frame: [u32; 2],
    pub slices: u32,
    /// Columns, rows and slices of the volume, texels.
    pub volume: [u32; 3],
    /// Width and height, pixels.
    pub picture: [u32; 2],
}

/// The least time in which sound can acquire a volume.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Acquisition {
    /// Travel time of sound from the face to the last sample and back, summed over all lines of all slices, s.
    pub seconds: f64,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
}

/// Times and work of a pass on the device, or times of a span of the host.
#[derive(Clone, Debug, Default, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct PassProfile {
    /// Name, unique among the passes or the host spans.
    pub name: String,
    /// Stage of the pass; `copies` for uploads and readbacks, `host` for a host span.
    pub stage: String,
    /// Number of runs in the first measured repeat: one for each dispatch or copy, or for each frame of a batch; for a host span, how often it
    /// occurs there.
    pub runs_per_picture: u32,
    /// Time of all runs together, ns, for each repeat. Empty for a pass without time stamps.
    pub samples_ns: Vec<f64>,
    /// CPU time of all threads in each repeat, ns, if the device is the CPU; otherwise empty.
    #[tree(default)]
    pub cpu_ns: Vec<f64>,
    /// Number of bytes that a repeat can read. Each run counts every texel once that it can reach in a bound slot (image or buffer).
    pub bytes_read: u64,
    /// Number of bytes that a repeat can write, counted like `bytes_read`.
    pub bytes_written: u64,
    /// Number of unfiltered texel fetches in a repeat. None if they cannot be counted.
    #[tree(default)]
    pub fetches: Option<u64>,
    /// Number of filtered texture samples in a repeat. None if they are not counted, which holds for every profile that this program measures.
    #[tree(default)]
    pub filtered: Option<u64>,
    /// Number of invocations that a repeat needs, without those that fill up workgroups. None for a copy or a host span.
    #[tree(default)]
    pub dispatched: Option<u64>,
    /// Number of compute shader invocations in the first repeat by pipeline statistics. None if the device does not count them.
    #[tree(default)]
    pub invocations: Option<u64>,
}

/// The rate, per second, of a micro-benchmark, over its repeats. The rates of passes are compared with its median.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Ceiling {
    pub median: f64,
    /// 5th and 95th percentile over the repeats of the micro-benchmark.
    pub low: f64,
    pub high: f64,
}

/// The roofline ceilings of a device, each a rate per second.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Ceilings {
    /// Copying: bytes read plus bytes written, so that a copied byte counts as two.
    pub copy: Ceiling,
    /// Texture samples through the device's filter.
    pub sampling: Ceiling,
    /// Samples that the shader interpolates from eight texels. None if that was not measured.
    #[tree(default)]
    pub exact: Option<Ceiling>,
    /// Reads of single texels, in the way that is faster on the device: texel fetches, or loads from storage images on a software device.
    pub fetch: Ceiling,
}

/// The ceiling that a pass comes closest to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roof {
    /// The rate that the pass achieves, divided by the ceiling. Above 1 if caches serve what the micro-benchmark fetched from memory.
    pub share: f64,
    /// Which ceiling: "copy", "sampling" or "fetch".
    pub bound: &'static str,
}

impl PassProfile {
    /// The times of all repeats, ns, as a sample. None without times.
    pub fn sample(&self) -> Option<Sample> {
        Sample::new(&self.samples_ns).ok()
    }

    /// Least number of bytes that a repeat reads and writes.
    pub fn bytes(&self) -> u64 {
        self.bytes_read + self.bytes_written
    }

    /// `count` events per repeat as a rate per second, by the median time.
    fn rate(&self, count: u64) -> Option<f64> {
        let median = self.sample()?.median();
        (median > 0.0 && count > 0).then(|| count as f64 / median * 1e9)
    }

    /// Least memory traffic, bytes per second, by the median time. None without times or traffic.
    pub fn bytes_per_second(&self) -> Option<f64> {
        self.rate(self.bytes())
    }

    /// The ceiling that the pass comes closest to (S. Williams, A. Waterman and D. Patterson, Roofline, 2009, with measured ceilings). None without
    /// times, or if no traffic of the pass is counted.
    pub fn roof(&self, ceilings: &Ceilings) -> Option<Roof> {
        let rates = [
            ("copy", self.bytes(), ceilings.copy),
            ("sampling", self.filtered.unwrap_or(0), ceilings.sampling),
            ("fetch", self.fetches.unwrap_or(0), ceilings.fetch),
        ];
        let roofs =
            rates.into_iter().filter(|(_, _, ceiling)| ceiling.median > 0.0).filter_map(|(bound, count, ceiling)| {
                self.rate(count).map(|rate| Roof { share: rate / ceiling.median, bound })
            });
        roofs.max_by(|a, b| a.share.total_cmp(&b.share))
    }
}

impl Profile {
    /// True if the device has time stamps, so that passes have times.
    pub(crate) fn has_time_stamps(&self) -> bool {
        self.device.valid_bits > 0
    }

    /// Sum of the times of all passes, ns, one entry per repeat; empty without time stamps.
    pub fn pass_sums(&self) -> Vec<f64> {
        if !self.has_time_stamps() || self.passes.is_empty() {
            return Vec::new();
        }
        (0..self.repeats).map(|i| self.passes.iter().filter_map(|p| p.samples_ns.get(i)).sum()).collect()
    }

    /// Idle time between passes, ns, for each repeat: the time of the device minus that of the passes. Negative if passes overlap.
    pub fn idle_ns(&self) -> Vec<f64> {
        self.device_ns.iter().zip(self.pass_sums()).map(|(span, passes)| span - passes).collect()
    }
}

impl Stored for Profile {
    const FORMAT: &'static str = "echolume-profile-3";
    /// They have no CPU time of passes; the first has none at all, and no rotating camera.
    const EARLIER: &'static [&'static str] = &["echolume-profile-1", "echolume-profile-2"];
    const QUOTE: char = '"';
    const WHAT: &'static str = "a profile";
    const AGAIN: &'static str = "profile again with it";
    const KIND: &'static str = "profile";
    const MAX_BYTES: u64 = 256 << 20;

    /// The lists are consistent and all numbers are finite.
    fn fault(&self) -> Option<(String, String)> {
        let fault = |field: &str, fault: String| Some((field.to_string(), fault));
        if self.repeats == 0 {
            return fault("repeats", "is 0; at least one picture must be measured".into());
        }
        let stamped = if self.has_time_stamps() { self.repeats } else { 0 };
        let with_cpu_time = if self.cpu_ns.is_empty() { 0 } else { self.repeats };
        let mut lists = vec![
            ("wall_ns", self.repeats, &self.wall_ns),
            ("cpu_ns", with_cpu_time, &self.cpu_ns),
            ("device_ns", stamped, &self.device_ns),
        ];
        for (kind, expected, spans) in [("passes", stamped, &self.passes), ("host", self.repeats, &self.host)] {
            for (i, span) in spans.iter().enumerate() {
                if spans[..i].iter().any(|s| s.name == span.name) {
                    return fault(kind, format!("{:?} is there twice", span.name));
                }
                lists.push((&span.name, expected, &span.samples_ns));
                let counted = if span.cpu_ns.is_empty() { 0 } else { self.repeats };
                lists.push((&span.name, counted, &span.cpu_ns));
            }
        }
        for (name, expected, times) in lists {
            if times.len() != expected {
                let why = if self.has_time_stamps() { "" } else { " (valid_bits is 0: the device has no time stamps)" };
                return fault(name, format!("has {} times for {expected} repeats{why}", times.len()));
            }
            if let Some((at, ns)) = times.iter().enumerate().find(|(_, ns)| !(ns.is_finite() && **ns >= 0.0)) {
                return fault(name, format!("time {at} is {ns} ns; a time is finite and not below 0"));
            }
        }
        let ceilings =
            self.ceilings.iter().flat_map(|c| [("copy", c.copy), ("sampling", c.sampling), ("fetch", c.fetch)]);
        let exact = self.ceilings.iter().filter_map(|c| Some(("exact", c.exact?)));
        for (name, ceiling) in ceilings.chain(exact) {
            if ![ceiling.low, ceiling.median, ceiling.high].iter().all(|v| v.is_finite() && *v >= 0.0) {
                return fault(name, format!("ceiling {ceiling:?} is not finite and at least 0"));
            }
        }
        let rest = self.acquisition.iter().flat_map(|a| [a.seconds, a.sound_speed]);
        match rest.chain([self.device.timestamp_period_ns, self.turn]).find(|v| !v.is_finite()) {
            Some(value) => fault("acquisition, timestamp_period_ns or turn", format!("{value} is not finite")),
            None => None,
        }
    }

    fn renew(&mut self) {
        self.format = Self::FORMAT.into();
    }
}

/// Fingerprint of settings: the 64-bit FNV-1a hash of their TOML, in hexadecimal. Not cryptographic.
pub fn settings_hash(scene: &str) -> String {
    let hash =
        scene.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
