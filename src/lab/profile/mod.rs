//! Profiles: run times of every pass with the conditions of their measurement, and their JSON file. [`timed_run`] makes a profile,
//! [`compare`] compares two, and [`export`] writes them as text and as Chrome traces. [`pipelines`] measures the compilation of pipelines.

pub mod compare;
pub mod export;
pub mod pipelines;
pub mod statistics;
pub mod timed_run;

use crate::baselines::Stored;
use crate::machine::Device;
use serde::{Deserialize, Serialize};
use statistics::Sample;

/// Target coverage of confidence intervals.
pub const LEVEL: f64 = 0.95;

/// One run of `echolume profile`. Lists of times have one entry per repeat, in the order measured, in ns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// [`Stored::FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// Time of the run, RFC 3339.
    pub date: String,
    pub device: Device,
    /// All settings, resolved, as TOML.
    pub scene: String,
    /// [`settings_hash`] of `scene`.
    pub settings_hash: String,
    /// Description of the input.
    pub input: String,
    pub sizes: Sizes,
    /// Time to acquire the volume. None for volumes that no probe swept.
    pub acquisition: Option<Acquisition>,
    /// Number of measured pictures.
    pub repeats: usize,
    /// Number of pictures that are rendered first and not measured.
    pub warm_up: usize,
    /// Rotation of the view from each repeat to the next, deg.
    #[serde(default)]
    pub turn: f64,
    /// The passes in running order.
    pub passes: Vec<PassProfile>,
    /// Spans of the host: submit, upload, wait, total. They may nest, so they do not add up.
    pub host: Vec<PassProfile>,
    /// Time from submission until the device is idle again, by the host's clock.
    pub wall_ns: Vec<f64>,
    /// CPU time of the process over the same interval, all threads, user and system. On a software device this is the cost of the work,
    /// independent of other load. Empty if the system does not report it.
    #[serde(default)]
    pub cpu_ns: Vec<f64>,
    /// Time from the begin of the first pass to the end of the last, by the device's clock. Empty without time stamps.
    pub device_ns: Vec<f64>,
    pub ceilings: Option<Ceilings>,
    /// Description of how the volume is sampled and texels are read.
    #[serde(default)]
    pub sampling: Option<String>,
    /// Largest error of the position of device spans on the host's clock, ns. None if the device's clock cannot be read.
    #[serde(default)]
    pub clock_deviation_ns: Option<u64>,
}

/// Sizes of the processed data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    /// Samples per line, lines.
    pub frame: [u32; 2],
    pub slices: u32,
    /// Texels.
    pub volume: [u32; 3],
    /// Pixels.
    pub picture: [u32; 2],
}

/// Lower bound of the time to acquire a volume.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Acquisition {
    /// Travel time of sound for all lines of all slices, s.
    pub seconds: f64,
    /// m/s.
    pub sound_speed: f64,
}

/// Times of a pass on the device, or of a span on the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassProfile {
    /// Name, unique in its list.
    pub name: String,
    /// Stage of the pass; `host` for host spans.
    pub stage: String,
    /// Number of dispatches in one repeat.
    pub runs_per_picture: u32,
    /// Sum over all runs of a repeat, ns. Empty without time stamps.
    pub samples_ns: Vec<f64>,
    /// CPU time of all threads in a repeat, ns, if the device is the CPU; otherwise empty.
    #[serde(default)]
    pub cpu_ns: Vec<f64>,
    /// Minimum bytes read in a repeat: every texel of every bound slot once.
    pub bytes_read: u64,
    /// Bytes that a repeat writes.
    pub bytes_written: u64,
    /// Unfiltered texel fetches in a repeat, if they can be counted.
    #[serde(default)]
    pub fetches: Option<u64>,
    /// Filtered texture samples in a repeat, if they can be counted.
    #[serde(default)]
    pub filtered: Option<u64>,
    /// Invocations that a repeat needs, without those that fill up workgroups.
    #[serde(default)]
    pub dispatched: Option<u64>,
    /// Compute shader invocations in a repeat, from pipeline statistics if the device has them.
    #[serde(default)]
    pub invocations: Option<u64>,
}

/// Peak rate per second that the device reached in a micro-benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceiling {
    pub median: f64,
    /// 5th and 95th percentile over the repeats of the micro-benchmark.
    pub low: f64,
    pub high: f64,
}

/// Roofline ceilings of a device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceilings {
    /// Bytes read plus bytes written: copying one byte counts as two.
    pub copy: Ceiling,
    /// Filtered texture samples.
    pub sampling: Ceiling,
    /// Samples that the shader interpolates from eight texels.
    #[serde(default)]
    pub exact: Option<Ceiling>,
    /// Texel fetches, or storage loads if the device uses those.
    pub fetch: Ceiling,
}

/// The ceiling that a pass is closest to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roof {
    /// Ratio of the achieved rate to the ceiling. Above 1 if caches serve what the micro-benchmark fetched from memory.
    pub share: f64,
    /// "copy", "sampling" or "fetch".
    pub bound: &'static str,
}

impl PassProfile {
    /// The times as a sample; None without times.
    pub fn sample(&self) -> Option<Sample> {
        Sample::new(&self.samples_ns).ok()
    }

    /// Minimum bytes read and written in a repeat.
    pub fn bytes(&self) -> u64 {
        self.bytes_read + self.bytes_written
    }

    /// `count` events per repeat as a rate per second, by the median time.
    fn rate(&self, count: u64) -> Option<f64> {
        let median = self.sample()?.median();
        (median > 0.0 && count > 0).then(|| count as f64 / median * 1e9)
    }

    /// Minimum memory traffic per second, by the median time.
    pub fn bytes_per_second(&self) -> Option<f64> {
        self.rate(self.bytes())
    }

    /// The closest ceiling (S. Williams, A. Waterman and D. Patterson, Roofline, 2009, with measured ceilings).
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

    /// Idle time between passes, ns, one entry per repeat: the span of the device minus the passes. Negative if passes overlap.
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

/// Fingerprint of settings: 64-bit FNV-1a of their TOML, in hexadecimal. Not cryptographic.
pub fn settings_hash(scene: &str) -> String {
    let hash =
        scene.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
