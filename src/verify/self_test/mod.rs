//! Group "self-test": fault injection. Faults are injected on the device's side one at a time, and one of the checks of `echolume verify`
//! must detect each. The same check must pass without the fault, otherwise it proves nothing.

mod history;
mod injected_faults;

pub use history::KNOWN_BUGS;

use super::built_in::{ALL_FILTERS, BYTES, frames, scene, wobbler};
use crate::gpu::{Context, ContextOptions, GpuError, Renderer, RendererOptions};
use crate::passes::fault_injection::InjectedFault;
use crate::passes::{PASSES, Texels, is_hit};
use crate::probe::Geometry;
use crate::queues::oracle::SubmissionLog;
use crate::report::{CheckName, Fault, Level, Outcome, Verdict};
use crate::scene::Scene;
use crate::{
    Check, DeviceUnderTest, Findings, credible_messages, each_pass, known_answers, memory, render, sampling,
    specialization,
};
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;
use std::time::Instant;

/// Maximum number of scenes in which each pass is checked, and of further ones, each with another pipeline.
const SCENES: usize = 6;

/// Whether an injected fault was detected, and by which check.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    pub fault: String,
    /// The kind of defect that the fault stands for.
    pub what: String,
    /// Group and name of the check that detected the fault. None if none did.
    pub by: Option<String>,
    /// Message of the check, or the reason why nothing detected the fault.
    pub message: String,
    /// True if the fault was not tested: nothing that a check runs on this device meets it, or the validation layer that it needs is not active.
    pub left_out: bool,
    /// Duration of the test by the clock of the host, s.
    pub seconds: f64,
}

impl Detection {
    /// The publicly reported bugs that the fault recreates, one line each.
    pub fn history(&self) -> impl Iterator<Item = String> {
        history::of(&self.fault).map(|bug| format!("as in {}: {} ({})", bug.driver, bug.what, bug.source))
    }

    /// The detection as the outcome of a check: failed if the fault was not detected, left out if it was not tested, otherwise passed.
    pub fn outcome(&self) -> Outcome {
        let (verdict, faults, note) = match &self.by {
            _ if self.left_out => (Verdict::LeftOut, Vec::new(), Some(self.message.clone())),
            Some(by) => (Verdict::Passed, Vec::new(), Some(format!("caught by {by}: {}", self.message))),
            None => (Verdict::Failed, vec![Fault::new(format!("not caught: {}", self.message))], None),
        };
        let notes = [Some(self.what.clone()), note].into_iter().flatten().chain(self.history()).collect();
        let check = CheckName { group: "self-test".into(), name: self.fault.clone() };
        Outcome { seconds: self.seconds, faults, notes, ..Outcome::new(check, verdict) }
    }
}

/// Whether a deliberate crash was detected, from the outcome of the check whose process crashed. It is detected if the check failed and its fault
/// names the signal that ended the process.
pub fn crash(outcome: &Outcome) -> Detection {
    let said = outcome.faults.first().map(|fault| fault.what.clone());
    let is_named = outcome.verdict == Verdict::Failed && said.as_ref().is_some_and(|said| said.contains("signal"));
    Detection {
        fault: "driver crash".into(),
        what: "the driver ends the process of a check".into(),
        by: is_named.then(|| format!("{}, {}", outcome.group, outcome.name)),
        message: said.unwrap_or_else(|| "the check has no fault".into()),
        left_out: false,
        seconds: outcome.seconds,
    }
}

/// All faults that the self-test injects, in running order: those of single passes and Vulkan commands, then one for each class of instructions.
/// Dropped barriers are tested in addition.
pub fn faults() -> impl Iterator<Item = InjectedFault> {
    injected_faults::FAULTS.iter().copied().chain(injected_faults::of_instructions())
}

/// Drops barriers, then injects every fault, one at a time. Calls `tell` with each detection: two for the dropped barriers, one for each fault, and a
/// last one that tells whether the checks that detected faults pass without one. Barriers are dropped twice: all of them for an independent check of
/// barriers, and some for the validation layer.
///
/// # Errors
/// The device cannot be opened, or fails without a fault.
pub fn run(options: &ContextOptions, mut tell: impl FnMut(&Detection)) -> Result<Vec<Detection>, GpuError> {
    let mut all = vec![by_oracle(options)?, by_layer(options)?];
    all.iter().for_each(&mut tell);
    all.extend(run_faults(options, faults(), tell)?);
    Ok(all)
}

/// Injects each of the given faults, one at a time, without the validation layer, and calls `tell` with the detection of each. The last detection
/// tells whether the checks that detected faults pass without one.
///
/// # Errors
/// The device cannot be opened, or fails without a fault.
pub fn run_faults(
    options: &ContextOptions,
    faults: impl Iterator<Item = InjectedFault>,
    mut tell: impl FnMut(&Detection),
) -> Result<Vec<Detection>, GpuError> {
    // Validation does not affect results, and would take most of the time.
    let options = ContextOptions { validation: false, ..options.clone() };
    let sound = DeviceUnderTest::new(&options, Level::Quick)?;
    let answers = [known_answers::checks, sampling::checks, specialization::checks, memory::checks];
    let answers = answers.into_iter().flat_map(|group| group(Level::Quick)).collect();
    let mut search = DetectionSearch { sound, answers, alarms: BTreeMap::new() };
    let mut all = Vec::new();
    let mut keep = |detection| {
        tell(&detection);
        all.push(detection);
    };
    for fault in faults {
        keep(search.detection(&fault)?);
    }
    keep(search.without_faults());
    Ok(all)
}

struct DetectionSearch {
    /// The device without faults.
    sound: DeviceUnderTest,
    answers: Vec<Check>,
    /// Faults that checks report without an injected fault, by check.
    alarms: BTreeMap<String, Option<String>>,
}

impl DetectionSearch {
    fn detection(&mut self, fault: &InjectedFault) -> Result<Detection, GpuError> {
        let (begun, mut dut) = (Instant::now(), self.sound.with_fault(fault.change)?);
        let looked = self.look(fault, &mut dut);
        let struck = dut.context.faults.change_count();
        let (by, message) = match looked {
            Ok((by, message)) => (Some(by), format!("{message} (met {struck} times)")),
            Err(Some(error)) => (None, format!("the device refused it, and no check compared anything: {error}")),
            Err(None) if struck == 0 => (None, "not tested: nothing that a check runs here meets it".into()),
            Err(None) => (None, format!("{struck} changes, and every check passes")),
        };
        let seconds = begun.elapsed().as_secs_f64();
        let left_out = by.is_none() && struck == 0;
        Ok(Detection { fault: fault.name.into(), what: fault.what.into(), by, message, left_out, seconds })
    }

    /// The first check that fails with the fault and passes without it. Otherwise the error of the device, if any: an error is no
    /// comparison, so it detects nothing.
    fn look(&mut self, fault: &InjectedFault, dut: &mut DeviceUnderTest) -> Result<(String, String), Option<String>> {
        let (scenes, mut refused) = (dut.scenes(), None);
        for (n, pass) in PASSES.iter().enumerate() {
            // The first, and the first of each pipeline: numbers may matter, or what the shader does.
            let concerned = || (0..scenes.len()).filter(|s| fault.change.concerns(pass, &scenes[*s].1));
            let mut variants = HashSet::new();
            let different = concerned().filter(|s| variants.insert(each_pass::variant(&scenes[*s].1, pass)));
            let chosen: BTreeSet<usize> = concerned().take(SCENES).chain(different.take(SCENES)).collect();
            for s in chosen {
                let Some(message) = alarm(each_pass::in_scene(dut, n, s), &mut refused) else { continue };
                let (by, sound) = (format!("passes, {}", pass.name), &mut self.sound);
                let alarms = self.alarms.entry(format!("{by}, '{}'", scenes[s].0));
                if alarms.or_insert_with(|| sound_alarm(each_pass::in_scene(sound, n, s))).is_none() {
                    return Ok((by, message));
                }
            }
        }
        for check in &self.answers {
            let Some(message) = alarm((check.work)(dut), &mut refused) else { continue };
            let (by, sound) = (format!("{}, {}", check.group, check.name), &mut self.sound);
            if self.alarms.entry(by.clone()).or_insert_with(|| sound_alarm((check.work)(sound))).is_none() {
                return Ok((by, message));
            }
        }
        Err(refused)
    }

    /// Whether the checks that detected faults pass without any.
    fn without_faults(&self) -> Detection {
        let alarm = self.alarms.iter().find_map(|(check, message)| Some(format!("{check}: {}", message.as_ref()?)));
        Detection {
            fault: "nothing".into(),
            what: "a check that fails with nothing planted proves nothing".into(),
            by: alarm.is_none().then(|| "no check".into()),
            message: alarm.unwrap_or_else(|| format!("{} checks pass", self.alarms.len())),
            left_out: false,
            seconds: 0.0,
        }
    }
}

/// The first fault as one line. An error of the device is stored in `refused`.
fn alarm(findings: Result<Findings, GpuError>, refused: &mut Option<String>) -> Option<String> {
    let findings = findings.map_err(|error| refused.get_or_insert(error.to_string()).clone()).ok()?;
    findings.faults.first().map(line)
}

/// The same without an injected fault: there an error of the device counts as a fault, too.
fn sound_alarm(findings: Result<Findings, GpuError>) -> Option<String> {
    let mut refused = None;
    alarm(findings, &mut refused).or(refused)
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

/// Number of contexts with validation, each with one barrier left out.
const WATCHED: usize = 6;

const SMALL: &str = "picture = { size = [12, 9] }\nslices = { pixels = 12 }";

/// Scenes to record: name, settings, and numbers of queues.
fn scenes() -> Vec<(&'static str, String, Vec<usize>)> {
    let of = |mode: &str, rest: &str| format!("mode = '{mode}'\n{rest}\n{SMALL}");
    vec![
        ("surface", of("sr", "light = { shadow = {}, occlusion = {} }\ndistance = { median = 3 }"), vec![1, 2, 3]),
        ("volume", of("vr", ""), vec![1, 3]),
        ("lit volume", of("vr", "volume = { shading = 'first-hit' }"), vec![1]),
        ("projection", of("mip", ""), vec![1, 2]),
        ("mixed", of("mixed", ""), vec![1]),
        ("plane", of("plane", ""), vec![1]),
        ("orthogonal", of("orthogonal", "post = { floats = true }"), vec![1]),
        ("tomography", of("tomography", ""), vec![1]),
        ("cube", of("cube", ""), vec![1]),
        ("4-up", of("vr", "layout = 'four'"), vec![1]),
        ("every filter", format!("mode = 'sr'\n{ALL_FILTERS}"), vec![1, 3]),
    ]
}

fn made(toml: &str) -> Result<(Scene, Vec<Texels>), GpuError> {
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let frames = frames(&scene, |[x, y, z]| ((7 * x + 3 * y + 11 * z) % 32) as f64 / 31.0);
    Ok((scene, frames))
}

/// Sends volumes while the one before is rendered.
fn streamed(renderer: &mut Renderer, frames: &[Texels]) -> Result<(), GpuError> {
    render::send(renderer, frames, 0)?;
    renderer.begin_picture()?;
    render::send(renderer, frames, 1)?;
    renderer.end_picture()?;
    renderer.begin_picture()?;
    render::send(renderer, frames, 0)?;
    renderer.end_picture()?;
    renderer.picture().map(|_| ())
}

fn logged(context: &Arc<Context>, toml: &str, queues: usize) -> Result<(Scene, SubmissionLog), GpuError> {
    let (scene, frames) = made(toml)?;
    let options = RendererOptions { volume_images: 2, queues: Some(queues), log: true, ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, scene, &options)?;
    streamed(&mut renderer, &frames)?;
    let log = renderer.log().cloned().unwrap_or_default();
    Ok((renderer.scene().clone(), log))
}

/// Leaves out barriers and waits, one at a time, of which the barrier oracle must detect each. The recording renders two volume images, one while the
/// other is filled.
fn by_oracle(options: &ContextOptions) -> Result<Detection, GpuError> {
    let begun = Instant::now();
    let context = Context::new(&ContextOptions { validation: false, ..options.clone() })?;
    let (mut barriers, mut waits, mut runs, mut implied, mut missed) = (0, 0, 0, 0, None);
    for (name, toml, counts) in scenes() {
        for queues in counts {
            let (scene, log) = logged(&context, &toml, queues)?;
            let of = |what: String| format!("{name}, {queues} queues: {what}");
            if let Some(hazard) = log.find_hazard(&scene) {
                missed.get_or_insert(of(format!("nothing is left out, and {hazard:?}")));
            }
            for barrier in log.barriers() {
                let unseen = log.without_barrier(barrier).find_hazard(&scene).is_none();
                // A semaphore wait of the submission may already imply this barrier.
                let may_be = !log.submissions[barrier.0].waits.is_empty();
                implied += usize::from(unseen && may_be);
                if unseen && !may_be {
                    missed.get_or_insert(of(format!("nothing detects that barrier {barrier:?} is missing")));
                }
            }
            let unseen = |wait: &(usize, usize)| log.without_wait(*wait).find_hazard(&scene).is_none();
            missed = missed.or(log
                .waits()
                .into_iter()
                .find(unseen)
                .map(|w| of(format!("nothing detects that wait {w:?} is missing"))));
            (barriers, waits, runs) = (barriers + log.barriers().len(), waits + log.waits().len(), runs + 1);
        }
    }
    Ok(Detection {
        fault: "dropped barrier".into(),
        what: "every barrier and every wait for another queue is left out once".into(),
        by: missed.is_none().then(|| "the barrier oracle".into()),
        message: missed.unwrap_or_else(|| {
            let missed = barriers - implied;
            format!("{missed} of {barriers} barriers and {waits} of {waits} waits in {runs} recordings; the rest stand where a queue waits for another")
        }),
        left_out: false,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// Synchronization validation, if its layer is installed, on one scene: no message with all barriers, some messages with one left out. It does
/// not detect every one, since it ignores write-after-write hazards through storage images.
fn by_layer(options: &ContextOptions) -> Result<Detection, GpuError> {
    let begun = Instant::now();
    let toml = format!("mode = 'mip'\n{SMALL}");
    let detection = |by: Option<&str>, message: String| Detection {
        fault: "dropped barrier, watched".into(),
        what: "barriers are left out while synchronization validation looks on".into(),
        by: by.map(String::from),
        message,
        left_out: false,
        seconds: begun.elapsed().as_secs_f64(),
    };
    let recorded = |dropped: Option<u32>| -> Result<(u32, Vec<String>), GpuError> {
        let context = Context::new(options)?;
        let (scene, frames) = made(&toml)?;
        let mut renderer = Renderer::new(&context, scene, &RendererOptions::default())?;
        dropped.iter().for_each(|n| renderer.drop_barrier(*n));
        render::send(&mut renderer, &frames, 0)?;
        renderer.picture()?;
        let barriers = renderer.barriers();
        drop(renderer);
        Ok((barriers, credible_messages(&context, context.messages(), true)))
    };
    if !options.validation {
        let why = "the validation layer does not watch".to_string();
        return Ok(Detection { left_out: true, ..detection(None, why) });
    }
    let (barriers, messages) = recorded(None)?;
    if let Some(message) = messages.first() {
        return Ok(detection(None, format!("nothing is left out, and validation says {message}")));
    }
    let mut detected = 0;
    for n in 0..WATCHED {
        let dropped = 1 + n as u32 * barriers / WATCHED as u32;
        let (_, messages) = recorded(Some(dropped))?;
        detected += usize::from(messages.iter().any(|m| m.contains("SYNC-HAZARD")));
    }
    let by = (detected > 0).then_some("synchronization validation");
    Ok(detection(by, format!("{detected} of {WATCHED} that were left out, of {barriers}")))
}
