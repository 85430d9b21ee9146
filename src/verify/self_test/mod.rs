//! Whether the checks notice anything: faults are planted on the device's side one at a time, and each must be caught by one of the
//! checks that `echolume verify` runs. The same check with nothing planted must pass, or it says nothing.

mod dropped;
mod list;
mod rays;

use super::{Bench, Check, Found, known_answers, passes};
use crate::gpu::{ContextOptions, GpuError};
use crate::passes::fault_injection::InjectedFault;
use crate::passes::{PASSES, is_hit};
use crate::verify::report::{Fault, Level, Outcome, Verdict};
use std::collections::BTreeMap;
use std::time::Instant;

/// Scenes of a pass that are looked at before the next pass is.
const SCENES: usize = 6;

/// A fault, and which check noticed it.
#[derive(Clone, Debug, PartialEq)]
pub struct Caught {
    pub fault: String,
    /// What it stands for.
    pub what: String,
    /// Group and name of the check; none: nothing noticed.
    pub by: Option<String>,
    /// What the check said, or why nothing did.
    pub found: String,
    /// Nobody looked.
    pub left_out: bool,
    /// s, host's clock.
    pub seconds: f64,
}

impl Caught {
    /// As the other checks report: an uncaught fault is a failure.
    pub fn outcome(&self) -> Outcome {
        let (verdict, faults, note) = match &self.by {
            _ if self.left_out => (Verdict::LeftOut, Vec::new(), Some(self.found.clone())),
            Some(by) => (Verdict::Passed, Vec::new(), Some(format!("caught by {by}: {}", self.found))),
            None => (Verdict::Failed, vec![Fault::new(format!("not caught: {}", self.found))], None),
        };
        Outcome {
            group: "self-test".into(),
            name: self.fault.clone(),
            verdict,
            seconds: self.seconds,
            figures: Vec::new(),
            faults,
            notes: [Some(self.what.clone()), note].into_iter().flatten().collect(),
            pictures: Vec::new(),
        }
    }
}

/// Every fault that is planted, in running order; barriers are dropped besides.
pub fn faults() -> impl Iterator<Item = &'static InjectedFault> {
    list::FAULTS.iter().chain(rays::FAULTS)
}

/// Plants every fault, drops every barrier; `tell` hears of each. What is told last is whether the checks that caught something pass with
/// nothing planted.
///
/// # Errors
/// A device that fails with nothing planted.
pub fn run(options: &ContextOptions, mut tell: impl FnMut(&Caught)) -> Result<Vec<Caught>, GpuError> {
    let mut all = Vec::new();
    for caught in dropped::all(options)? {
        tell(&caught);
        all.push(caught);
    }
    all.extend(planted(options, faults(), tell)?);
    Ok(all)
}

/// The same of faults of the caller's, with no barrier dropped.
///
/// # Errors
/// As of [`run`].
pub fn planted<'a>(
    options: &ContextOptions,
    faults: impl Iterator<Item = &'a InjectedFault>,
    mut tell: impl FnMut(&Caught),
) -> Result<Vec<Caught>, GpuError> {
    // A layer that watches has nothing to do with what is computed, and takes most of the time.
    let options = ContextOptions { validation: false, ..options.clone() };
    let sound = Bench::new(&options, Level::Quick)?;
    let mut search = Search { sound, answers: known_answers::checks(Level::Quick), alarms: BTreeMap::new() };
    let mut all = Vec::new();
    for fault in faults {
        let caught = search.caught(fault)?;
        tell(&caught);
        all.push(caught);
    }
    let caught = search.nothing();
    tell(&caught);
    all.push(caught);
    Ok(all)
}

struct Search {
    /// With nothing planted.
    sound: Bench,
    answers: Vec<Check>,
    /// What checks found with nothing planted.
    alarms: BTreeMap<String, Option<String>>,
}

impl Search {
    fn caught(&mut self, planted: &InjectedFault) -> Result<Caught, GpuError> {
        let (begun, mut bench) = (Instant::now(), self.sound.planted(planted.change)?);
        let looked = self.look(planted, &mut bench);
        let struck = bench.context.faults.change_count();
        let (by, found) = match looked {
            Ok((by, found)) => (Some(by), found),
            Err(Some(error)) => (None, format!("the device refused it, and no check compared anything: {error}")),
            Err(None) if struck == 0 => (None, "nothing that a check runs is changed by it".into()),
            Err(None) => (None, format!("{struck} changes, and every check passes")),
        };
        let seconds = begun.elapsed().as_secs_f64();
        Ok(Caught { fault: planted.name.into(), what: planted.what.into(), by, found, left_out: false, seconds })
    }

    /// The first check that notices, and does not without the fault; else what the device said, if it did not do as it was told: that is
    /// no comparison, and notices nothing.
    fn look(&mut self, planted: &InjectedFault, bench: &mut Bench) -> Result<(String, String), Option<String>> {
        let (scenes, mut refused) = (bench.scenes(), None);
        for (n, pass) in PASSES.iter().enumerate() {
            let concerned = (0..scenes.len()).filter(|s| planted.change.concerns(pass, &scenes[*s].1));
            for s in concerned.take(SCENES) {
                let Some(found) = alarm(passes::in_scene(bench, n, s), &mut refused) else { continue };
                let (by, sound) = (format!("passes, {}", pass.name), &mut self.sound);
                let alarms = self.alarms.entry(format!("{by}, '{}'", scenes[s].0));
                if alarms.or_insert_with(|| sound_alarm(passes::in_scene(sound, n, s))).is_none() {
                    return Ok((by, found));
                }
            }
        }
        for check in &self.answers {
            let Some(found) = alarm(check.found(bench), &mut refused) else { continue };
            let (by, sound) = (format!("{}, {}", check.group, check.name), &mut self.sound);
            if self.alarms.entry(by.clone()).or_insert_with(|| sound_alarm(check.found(sound))).is_none() {
                return Ok((by, found));
            }
        }
        Err(refused)
    }

    /// Whether what caught something passes with nothing planted.
    fn nothing(&self) -> Caught {
        let alarm = self.alarms.iter().find_map(|(check, found)| Some(format!("{check}: {}", found.as_ref()?)));
        Caught {
            fault: "nothing".into(),
            what: "a check that fails with nothing planted proves nothing".into(),
            by: alarm.is_none().then(|| "no check".into()),
            found: alarm.unwrap_or_else(|| format!("{} checks pass", self.alarms.len())),
            left_out: false,
            seconds: 0.0,
        }
    }
}

/// The first thing that is wrong, in a line. An error of the device is kept aside.
fn alarm(found: Result<Found, GpuError>, refused: &mut Option<String>) -> Option<String> {
    let found = found.map_err(|error| refused.get_or_insert(error.to_string()).clone()).ok()?;
    found.faults.first().map(line)
}

/// The same with nothing planted: there an error is an alarm, too.
fn sound_alarm(found: Result<Found, GpuError>) -> Option<String> {
    let mut refused = None;
    alarm(found, &mut refused).or(refused)
}

fn number(value: f64) -> String {
    if value.is_nan() || is_hit(value) { format!("{value:.6}") } else { "a miss".into() }
}

fn line(fault: &Fault) -> String {
    let input = if fault.input.is_empty() { String::new() } else { format!(", {}", fault.input) };
    let worst = fault.worst.as_ref().map_or(String::new(), |w| {
        format!(": {} at {:?} is {} instead of {}", w.output, w.at, number(w.got), number(w.expected))
    });
    format!("{}{worst}{input}", fault.what).replace('\n', ", ")
}
