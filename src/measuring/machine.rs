//! What is known of the machine: device, driver, clocks.

use crate::gpu::Context;
use crate::report::profile::Device;
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
        valid_bits: candidate.valid_bits,
        calibrated: candidate.calibrated,
        clocks: clocks(candidate.is_software()),
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
