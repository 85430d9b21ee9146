//! Description of the machine for reports: device, driver, clocks, program, date, and CPU time of the process.

use crate::Context;
use crate::tree::{FromNode, ToNode};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

/// A Vulkan device as reports describe it.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Device {
    pub name: String,
    pub driver: String,
    /// The newest Vulkan version that the device supports, such as 1.3.280.
    pub api: String,
    /// True if it computes on the CPU.
    pub is_software: bool,
    /// Period of the device's clock, ns per tick.
    pub timestamp_period_ns: f64,
    /// Number of valid bits of a time stamp. 0 if the rendering queue has none; then no pass has times.
    pub valid_bits: u32,
    /// True if the device's clock can be related to the host's, so that both can be drawn on one axis.
    pub calibrated: bool,
    /// Description of clock rates and power state; None if unknown.
    pub clocks: Option<String>,
}

impl Device {
    /// A device about which nothing is known.
    pub fn unknown() -> Device {
        let unknown = || "not known".to_string();
        Device {
            name: unknown(),
            driver: unknown(),
            api: unknown(),
            is_software: false,
            timestamp_period_ns: 0.0,
            valid_bits: 0,
            calibrated: false,
            clocks: None,
        }
    }

    /// The name without the versions that some drivers put in parentheses after it, such as that of LLVM, so that results before and after an update
    /// of a driver are compared.
    pub fn identity(&self) -> String {
        let Some((name, rest)) = self.name.split_once(" (") else { return self.name.clone() };
        let is_version = |word: &str| word.contains('.') && word.starts_with(|c: char| c.is_ascii_digit());
        let lasting = |part: &&str| !part.split(' ').any(is_version);
        let parts: Vec<&str> = rest.trim_end_matches(')').split(", ").filter(lasting).collect();
        if parts.is_empty() { name.into() } else { format!("{name} ({})", parts.join(", ")) }
    }

    /// The conditions that measured times depend on, each with a name that the user reads.
    pub fn conditions(&self) -> [(&'static str, String); 4] {
        [
            ("device", self.name.clone()),
            ("driver", self.driver.clone()),
            ("Vulkan", self.api.clone()),
            ("clocks", self.clocks.clone().unwrap_or_else(|| "not known".into())),
        ]
    }
}

/// The current time, UTC, in whole seconds (RFC 3339).
pub fn date() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}

/// Name, version and build of the program.
pub fn program() -> String {
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    format!("echolume {} ({build})", env!("CARGO_PKG_VERSION"))
}

/// Resident memory of this process, bytes. None if the system does not report it.
pub fn resident_bytes() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    // Pages have 4 KiB on every supported system that has this file.
    Some(pages * 4096)
}

/// Describes the device of a context.
pub fn device(context: &Context) -> Device {
    let candidate = &context.candidate;
    Device {
        name: candidate.name.clone(),
        driver: candidate.driver.trim().into(),
        api: candidate.api_version(),
        is_software: candidate.is_software(),
        timestamp_period_ns: f64::from(context.candidate.limits.timestamp_period),
        valid_bits: candidate.valid_bits(),
        calibrated: candidate.calibrated_timestamps,
        clocks: clocks(candidate.is_software()),
    }
}

/// CPU time of each thread of this process so far, user and system, ns.
#[derive(Clone, Debug)]
pub struct CpuTime(BTreeMap<String, u64>);

impl CpuTime {
    /// Reads the current values; None if the system does not report them. On Linux they are in /proc/self/task/*/schedstat, whose
    /// first number is the time on a CPU in ns (/proc/self/stat has a resolution of 10 ms only). The value of a running thread is
    /// updated at context switches, so this thread yields first.
    pub fn now() -> Option<CpuTime> {
        std::thread::yield_now();
        let mut threads = BTreeMap::new();
        for thread in std::fs::read_dir("/proc/self/task").ok()? {
            let thread = thread.ok()?;
            // A thread that has just ended has no file.
            let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) else { continue };
            let on_cpu = text.split_whitespace().next()?.parse().ok()?;
            threads.insert(thread.file_name().to_string_lossy().into_owned(), on_cpu);
        }
        (!threads.is_empty()).then_some(CpuTime(threads))
    }

    /// CPU time of all threads from the reading `then` to this later reading, ns. Time of threads that have ended since then is lost; drivers keep
    /// their threads alive.
    pub fn since(&self, then: &CpuTime) -> f64 {
        let of = |(name, now): (&String, &u64)| now.saturating_sub(then.0.get(name).copied().unwrap_or(0));
        self.0.iter().map(of).sum::<u64>() as f64
    }
}

/// Clocks and power state that the system reports without privileges: of the processor for a software device, otherwise of the
/// first display device that reports any.
fn clocks(is_software: bool) -> Option<String> {
    let read = |path: &Path| std::fs::read_to_string(path).ok().map(|text| text.trim().to_string());
    let mut known = Vec::new();
    if is_software {
        let cpu = Path::new("/sys/devices/system/cpu/cpu0/cpufreq");
        known.extend(read(&cpu.join("scaling_governor")).map(|g| format!("governor {g}")));
        known.extend(read(&cpu.join("scaling_cur_freq")).map(|f| format!("{f} kHz")));
        let cores = std::thread::available_parallelism().map_or(0, |n| n.get());
        let load = read(Path::new("/proc/loadavg")).and_then(|l| l.split(' ').next().map(str::to_string));
        known.extend(load.map(|load| format!("load {load} on {cores} cores when begun")));
    } else {
        let cards = (0..8).map(|n| format!("/sys/class/drm/card{n}/device"));
        let said = cards.map(|card| {
            let level = read(&Path::new(&card).join("power_dpm_force_performance_level"));
            let state = read(&Path::new(&card).join("power_state"));
            [level.map(|l| format!("performance level {l}")), state.map(|s| format!("power state {s}"))]
        });
        known.extend(
            said.map(|s| s.into_iter().flatten().collect::<Vec<_>>()).find(|s| !s.is_empty()).unwrap_or_default(),
        );
    }
    (!known.is_empty()).then(|| known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn an_update_of_a_driver_leaves_the_identity_of_a_device() {
        for (name, identity) in [
            ("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe (256 bits)"),
            ("llvmpipe (LLVM 20.1.2, 256 bits)", "llvmpipe (256 bits)"),
            ("llvmpipe (LLVM 20.1.2, 512 bits)", "llvmpipe (512 bits)"),
            ("AMD RADV NAVI10 (LLVM 11.0.0)", "AMD RADV NAVI10"),
            ("AMD Radeon RX 7900 XTX (RADV NAVI31)", "AMD Radeon RX 7900 XTX (RADV NAVI31)"),
            ("NVIDIA H200", "NVIDIA H200"),
        ] {
            assert_eq!(Device { name: name.into(), ..Device::unknown() }.identity(), identity, "{name}");
        }
    }

    #[test]
    fn cpu_time_is_attributed_to_the_thread_that_used_it() {
        if !Path::new("/proc/self/task").exists() {
            assert!(CpuTime::now().is_none());
            return;
        }
        let (go, wait) = mpsc::channel::<()>();
        let (report, reported) = mpsc::channel::<String>();
        let worker = std::thread::spawn(move || {
            let own = std::fs::read_link("/proc/thread-self").unwrap();
            let own = own.file_name().unwrap().to_string_lossy().into_owned();
            report.send(own.clone()).unwrap();
            wait.recv().unwrap();
            let product = (0..3_000_000).fold(1.0f64, |x, _| std::hint::black_box(x * 1.000_000_1));
            assert!(product > 1.0);
            report.send(own).unwrap();
            // Stay alive until it has been read: ended threads are not reported.
            wait.recv().unwrap();
        });
        let name = reported.recv().unwrap();
        let then = CpuTime::now().expect("Linux tells");
        go.send(()).unwrap();
        reported.recv().unwrap();
        let now = CpuTime::now().expect("Linux tells");
        let own = now.0[&name] - then.0[&name];
        assert!(own > 0, "the thread that worked had no time");
        assert!(now.since(&then) >= own as f64);
        // Threads of other tests may end between the two.
        let alone = |time: &CpuTime| CpuTime([(name.clone(), time.0[&name])].into_iter().collect());
        assert_eq!(alone(&then).since(&alone(&now)), 0.0);
        go.send(()).unwrap();
        worker.join().unwrap();
    }
}
