//! What is known of the machine: device, driver, clocks.

use crate::gpu::Context;
use crate::profile::Device;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

/// Now, by RFC 3339.
pub fn date() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}

/// Name and version of the program.
pub fn program() -> String {
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    format!("{} {} ({build})", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))
}

pub fn device(context: &Context) -> Device {
    let candidate = &context.candidate;
    Device {
        name: candidate.name.clone(),
        driver: candidate.driver.trim().into(),
        api: candidate.api_version(),
        is_software: candidate.is_software(),
        timestamp_period_ns: f64::from(context.limits.timestamp_period),
        valid_bits: candidate.valid_bits(),
        calibrated: candidate.calibrated,
        clocks: clocks(candidate.is_software()),
    }
}

/// CPU time that each thread of this process has had, user and system, ns by thread.
#[derive(Clone, Debug)]
pub struct CpuTime(BTreeMap<String, u64>);

impl CpuTime {
    /// Now. None where the system does not tell: it is Linux' /proc/self/task/*/schedstat, whose first number is the time on a
    /// CPU in ns (/proc/self/stat counts in hundredths of a second). A thread that is running is told up to its last switch,
    /// so this one yields first.
    pub fn now() -> Option<CpuTime> {
        std::thread::yield_now();
        let mut threads = BTreeMap::new();
        for thread in std::fs::read_dir("/proc/self/task").ok()? {
            let thread = thread.ok()?;
            // One that has just ended has no file any more.
            let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) else { continue };
            let on_cpu = text.split_whitespace().next()?.parse().ok()?;
            threads.insert(thread.file_name().to_string_lossy().into_owned(), on_cpu);
        }
        (!threads.is_empty()).then_some(CpuTime(threads))
    }

    /// ns of all threads since then. What a thread did that has ended is lost; drivers keep theirs.
    pub fn since(&self, then: &CpuTime) -> f64 {
        let of = |(name, now): (&String, &u64)| now.saturating_sub(then.0.get(name).copied().unwrap_or(0));
        self.0.iter().map(of).sum::<u64>() as f64
    }
}

/// What the system tells of clocks and power without privileges: of the processor for a software device, of the first display
/// device that says something otherwise.
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
    fn what_a_thread_works_is_counted_as_its_own() {
        if !Path::new("/proc/self/task").exists() {
            assert!(CpuTime::now().is_none());
            return;
        }
        let (go, wait) = mpsc::channel::<()>();
        let (tell, told) = mpsc::channel::<String>();
        let worker = std::thread::spawn(move || {
            let own = std::fs::read_link("/proc/thread-self").unwrap();
            let own = own.file_name().unwrap().to_string_lossy().into_owned();
            tell.send(own.clone()).unwrap();
            wait.recv().unwrap();
            let product = (0..3_000_000).fold(1.0f64, |x, _| std::hint::black_box(x * 1.000_000_1));
            assert!(product > 1.0);
            tell.send(own).unwrap();
            // Alive until it has been looked at: what has ended is told no more.
            wait.recv().unwrap();
        });
        let name = told.recv().unwrap();
        let then = CpuTime::now().expect("Linux tells");
        go.send(()).unwrap();
        told.recv().unwrap();
        let now = CpuTime::now().expect("Linux tells");
        let own = now.0[&name] - then.0[&name];
        assert!(own > 0, "the thread that worked had no time");
        assert!(now.since(&then) >= own as f64);
        assert_eq!(then.since(&now), 0.0);
        go.send(()).unwrap();
        worker.join().unwrap();
    }
}
