//! The times of passes, as `--timings` prints them.

use super::by_name;
use crate::scene::Scene;
use std::fmt::Write as _;

/// GPU time of one pass, over all its runs.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    pub name: &'static str,
    /// Number of runs: a batch counts one for each of its frames.
    pub runs: u32,
    /// Sum over all runs, ns.
    pub total: f64,
}

impl PassTime {
    /// Adds this time to the one of the same name in `all`, or appends it.
    pub fn add_to(&self, all: &mut Vec<PassTime>) {
        match all.iter_mut().find(|time| time.name == self.name) {
            Some(time) => {
                time.runs += self.runs;
                time.total += self.total;
            }
            None => all.push(self.clone()),
        }
    }
}

/// Formats pass times as a table: one line per pass, their sum and, for a volume of a probe, the time that sound needs ([`acquisition_floor`]). If
/// `measured` is empty it says that the device has no time stamps.
pub fn pass_time_table(measured: &[PassTime], scene: &Scene) -> String {
    let mut text = String::new();
    if measured.is_empty() {
        text.push_str("times: this device has no time stamps\n");
    } else {
        let _ = writeln!(text, "{:<12} {:<19} {:>5} {:>10} {:>10}", "stage", "pass", "runs", "ms a run", "ms in all");
        for time in measured {
            let stage = by_name(time.name).map_or("", |p| p.stage.name());
            let all = time.total * 1e-6;
            let each = all / f64::from(time.runs.max(1));
            let _ = writeln!(text, "{stage:<12} {:<19} {:>5} {each:>10.3} {all:>10.3}", time.name, time.runs);
        }
        let sum = measured.iter().map(|t| t.total).sum::<f64>() * 1e-6;
        let _ = writeln!(text, "{:<12} {:<19} {:>5} {:>10} {sum:>10.3}", "", "sum", "", "");
    }
    if let Some(probe) = scene.probe() {
        let _ = writeln!(text, "{}", acquisition_floor(probe.acquisition_time(), probe.sound_speed));
    }
    text
}

/// A sentence that states the acquisition floor. `seconds`: the time that sound travels for all lines of a volume; `sound_speed` in m/s.
pub fn acquisition_floor(seconds: f64, sound_speed: f64) -> String {
    let ms = seconds * 1e3;
    format!("sound itself needs {ms:.1} ms for this volume ({sound_speed} m/s): no display is faster")
}
