//! What `echolume profile` measured: the numbers themselves, and what they were measured on. Tables, comparisons and traces
//! follow from it; nothing here measures.

pub mod ceilings;
pub(crate) mod command;
pub mod compare;
pub mod differences;
pub mod formats;
pub(crate) mod judgement;
pub mod machine;
pub mod measure;
pub mod pass_times;
pub mod ranks;
pub mod statistics;
pub mod table;
pub mod trace;

use serde::{Deserialize, Serialize};
use statistics::Sample;

/// Version of the JSON; another layout gets another name.
pub const FORMAT: &str = "echolume-profile-2";
/// Still read: knows no CPU time, and no camera that turns.
pub const FORMAT_BEFORE: &str = "echolume-profile-1";

/// Coverage that intervals aim at.
pub const LEVEL: f64 = 0.95;

#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    #[error("format is {found:?}, this program reads {FORMAT:?}; profile again with it")]
    Format { found: String },
    #[error("not a profile: {0}")]
    Json(String),
    /// Contents that contradict themselves.
    #[error("{field}: {fault}")]
    Contents { field: String, fault: String },
}

impl ProfileError {
    fn on_one_line(self) -> ProfileError {
        let line = |text: String| crate::scene::load::single_line(&text);
        match self {
            ProfileError::Format { found } => ProfileError::Format { found: line(found) },
            ProfileError::Json(fault) => ProfileError::Json(line(fault)),
            ProfileError::Contents { field, fault } => {
                ProfileError::Contents { field: line(field), fault: line(fault) }
            }
        }
    }
}

/// One run of `echolume profile`. Every list of times has one entry a repeat, in the order measured, all in ns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// [`FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// When, by RFC 3339.
    pub date: String,
    pub device: Device,
    /// All settings, resolved, as TOML.
    pub scene: String,
    /// [`settings_hash`] of `scene`.
    pub settings_hash: String,
    /// What the frames came from, in words.
    pub input: String,
    pub sizes: Sizes,
    /// What acquiring the volume takes, where a probe swept it.
    pub acquisition: Option<Acquisition>,
    /// Pictures measured.
    pub repeats: usize,
    /// Pictures rendered before them, not measured.
    pub warm_up: usize,
    /// How far the view turned from each repeat to the next, deg.
    #[serde(default)]
    pub turn: f64,
    /// In running order.
    pub passes: Vec<PassProfile>,
    /// What the CPU did: submit, upload, wait, whole. They may lie within each other and do not add up.
    pub host: Vec<PassProfile>,
    /// From submit to the device being idle again, by the host's clock.
    pub wall_ns: Vec<f64>,
    /// CPU time of the process over the same stretch, all threads, user and system: on a software device what the work costs
    /// whatever else the machine does. Empty where the system does not tell.
    #[serde(default)]
    pub cpu_ns: Vec<f64>,
    /// From the first pass' begin to the last one's end, by the device's clock. Empty without time stamps.
    pub device_ns: Vec<f64>,
    pub ceilings: Option<Ceilings>,
    /// How the volume is sampled and texels are read, in words.
    #[serde(default)]
    pub sampling: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Device {
    pub name: String,
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// Computes on the CPU.
    pub is_software: bool,
    /// ns a tick of the device's clock.
    pub timestamp_period_ns: f64,
    /// Bits of a time stamp; 0 where the queue has none, and then no pass has times.
    pub valid_bits: u32,
    /// The device's clock was tied to the host's, so that both may be drawn on one axis.
    pub calibrated: bool,
    /// What is known of clocks and power state, in words; None where the device tells nothing.
    pub clocks: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    /// Samples and lines.
    pub frame: [u32; 2],
    pub slices: u32,
    /// Texels.
    pub volume: [u32; 3],
    /// Pixels.
    pub picture: [u32; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Acquisition {
    /// s, for all lines of all slices, at the speed of sound.
    pub seconds: f64,
    /// m/s.
    pub sound_speed: f64,
}

/// A pass of the device, or a span of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassProfile {
    /// Unique in its list.
    pub name: String,
    /// Stage of a pass; of a host span whatever groups it.
    pub stage: String,
    /// Dispatches in one repeat.
    pub runs_per_picture: u32,
    /// All runs of a repeat together. Empty without time stamps.
    pub samples_ns: Vec<f64>,
    /// Bytes that a repeat cannot do without reading, every texel of every slot once.
    pub bytes_read: u64,
    /// Bytes that a repeat writes.
    pub bytes_written: u64,
    /// Texels fetched in a repeat without filtering, where they can be counted.
    #[serde(default)]
    pub fetches: Option<u64>,
    /// Filtered texture samples taken in a repeat, where they can be counted.
    #[serde(default)]
    pub filtered: Option<u64>,
    /// Compute shader invocations in a repeat, from pipeline statistics where the device has them.
    #[serde(default)]
    pub invocations: Option<u64>,
}

/// A rate that the device reached in a loop that does nothing else, per second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceiling {
    pub median: f64,
    /// 5th and 95th percentile over the measurement's own repeats.
    pub low: f64,
    pub high: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ceilings {
    /// Bytes read and bytes written together: copying one byte moves two.
    pub copy: Ceiling,
    /// Filtered samples.
    pub sampling: Ceiling,
    /// Samples of eight texels, interpolated by the shader.
    #[serde(default)]
    pub exact: Option<Ceiling>,
    /// Texel fetches, or loads where the device takes those.
    pub fetch: Ceiling,
}

/// The ceiling that a pass is nearest to, and how near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roof {
    /// 1 at the ceiling. Above it where caches serve what the ceiling's loop had to fetch from memory.
    pub share: f64,
    /// "copy", "sampling" or "fetch".
    pub bound: &'static str,
}

impl PassProfile {
    /// None without times.
    pub fn sample(&self) -> Option<Sample> {
        Sample::new(&self.samples_ns).ok()
    }

    pub fn bytes(&self) -> u64 {
        self.bytes_read + self.bytes_written
    }

    /// `count` in a repeat as a rate per second, by the median time.
    fn rate(&self, count: u64) -> Option<f64> {
        let median = self.sample()?.median();
        (median > 0.0 && count > 0).then(|| count as f64 / median * 1e9)
    }

    /// Least memory traffic per second by the median time.
    pub fn bytes_per_second(&self) -> Option<f64> {
        self.rate(self.bytes())
    }

    /// S. Williams, A. Waterman and D. Patterson, Roofline, 2009, with measured ceilings: the one nearest to being reached.
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
    pub fn has_time_stamps(&self) -> bool {
        self.device.valid_bits > 0
    }

    /// Time of all passes, one entry a repeat; empty without time stamps.
    pub fn pass_sums(&self) -> Vec<f64> {
        if !self.has_time_stamps() || self.passes.is_empty() {
            return Vec::new();
        }
        (0..self.repeats).map(|i| self.passes.iter().filter_map(|p| p.samples_ns.get(i)).sum()).collect()
    }

    /// What the device did between passes, one entry a repeat: its span less the passes. Below zero where passes overlap.
    pub fn idle_ns(&self) -> Vec<f64> {
        self.device_ns.iter().zip(self.pass_sums()).map(|(whole, passes)| whole - passes).collect()
    }

    /// That the lists agree with each other, and every number is one.
    pub fn check(&self) -> Result<(), ProfileError> {
        let fault = |field: &str, fault: String| Err(ProfileError::Contents { field: field.into(), fault });
        if self.format != FORMAT {
            return Err(ProfileError::Format { found: self.format.clone() });
        }
        if self.repeats == 0 {
            return fault("repeats", "is 0; at least one picture must be measured".into());
        }
        let stamped = if self.has_time_stamps() { self.repeats } else { 0 };
        let told = if self.cpu_ns.is_empty() { 0 } else { self.repeats };
        let mut lists = vec![
            ("wall_ns", self.repeats, &self.wall_ns),
            ("cpu_ns", told, &self.cpu_ns),
            ("device_ns", stamped, &self.device_ns),
        ];
        for (kind, expected, spans) in [("passes", stamped, &self.passes), ("host", self.repeats, &self.host)] {
            for (i, span) in spans.iter().enumerate() {
                if spans[..i].iter().any(|s| s.name == span.name) {
                    return fault(kind, format!("{:?} is there twice", span.name));
                }
                lists.push((&span.name, expected, &span.samples_ns));
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
            None => Ok(()),
        }
    }
}

/// Tells settings apart at a glance: FNV-1a, 64 bits, of their TOML, in hexadecimal. Not proof against intent.
pub fn settings_hash(scene: &str) -> String {
    let hash =
        scene.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
