//! Checks that a device and its driver render correctly: every pass, every mode and every kind of failure, on inputs that are built into
//! the program, so that no source tree is needed. The result is a [`Run`]. [`report`] writes it as text, JSON, JUnit XML and HTML, and
//! compares it with an earlier run.
//!
//! A [`Check`] runs on a [`DeviceUnderTest`] and returns [`Findings`]. Modules have the names of the groups that `echolume verify --list`
//! prints. [`self_test`] proves the checks by fault injection: it injects faults on the device's side and records which check detects each.

#![forbid(unsafe_code)]

pub mod built_in;
mod compare;
pub mod coverage;
pub mod determinism;
pub mod each_pass;
pub mod failures;
pub mod formats;
pub mod gtest;
pub mod hazards;
pub mod isolation;
mod known_answers;
pub mod memory;
pub mod modes;
pub mod progress;
pub mod render;
pub mod report;
pub mod reproduce;
pub mod sampling;
pub mod self_test;
mod specialization;
mod speed;
pub mod stress;
pub mod time_stamps;

pub use compare::{Comparison, ExtraTolerance, compare_outputs, compare_picture, expect_same_picture};

use echolume_base::{baselines, files, html_page, metrics, picture, statistics, sync, terminal, text, tree};
use echolume_core::{passes, plan, queues, reference, scene, spirv};
use echolume_gpu::{self as gpu, machine};
use echolume_lab::profile;
use {echolume_probe as probe, echolume_source as source};

use crate::gpu::pass_runner::PassRunner;
use crate::gpu::{Context, ContextOptions, GpuError};
use crate::passes::fault_injection::Change;
use crate::scene::{DeviceFacts, Scene};
use baselines::Stored;
use render::Drawn;
use report::{CheckName, Fault, Figure, Level, Outcome, PictureComparison, Run, Verdict};
use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

/// All checks of a level, in the order in which they run.
pub fn checks(level: Level) -> Vec<Check> {
    let groups = [
        each_pass::checks,
        specialization::checks,
        sampling::checks,
        known_answers::checks,
        modes::checks,
        determinism::checks,
        memory::checks,
        failures::checks,
        formats::checks,
        hazards::checks,
        time_stamps::checks,
        speed::checks,
        stress::checks,
    ];
    groups.into_iter().flat_map(|group| group(level)).collect()
}

/// Runs checks one after the other by `one`, which gets their indices in `names`, and calls `tell` with the outcome of each that was run. Once `stop`
/// returns a signal's name, the remaining checks get the verdict interrupted, so that there is one outcome for each name.
pub fn run_each(
    names: &[CheckName],
    stop: impl Fn() -> Option<&'static str>,
    mut one: impl FnMut(usize) -> Outcome,
    mut tell: impl FnMut(&Outcome),
) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for (n, name) in names.iter().enumerate() {
        if let Some(why) = stop() {
            outcomes.push(Outcome::unrun(name, Verdict::Interrupted, format!("not run: {why}")));
            continue;
        }
        // Logged first, because a driver that crashes may end the process.
        tracing::info!("check: {} / {}", name.group, name.name);
        let outcome = one(n);
        tell(&outcome);
        outcomes.push(outcome);
    }
    outcomes
}

/// The run with these outcomes; it began at `begun` and ends now. `device`: the tested device; `validation`: true if the validation layer was active.
pub fn run_on(device: machine::Device, validation: bool, level: Level, outcomes: Vec<Outcome>, begun: Instant) -> Run {
    Run {
        format: Run::FORMAT.into(),
        program: machine::program(),
        date: machine::date(),
        device,
        level,
        validation,
        seconds: begun.elapsed().as_secs_f64(),
        outcomes,
    }
}

/// The run of a device that could not be started: a single failed check with the reason `why`.
pub fn unstarted(level: Level, why: String, begun: Instant) -> Run {
    let check = CheckName { group: report::START.into(), name: "start of the device".into() };
    let outcome = Outcome { seconds: begun.elapsed().as_secs_f64(), ..Outcome::unrun(&check, Verdict::Failed, why) };
    run_on(machine::Device::unknown(), false, level, vec![outcome], begun)
}

/// What a check measured and found.
#[derive(Default)]
pub struct Findings {
    pub figures: Vec<Figure>,
    pub faults: Vec<Fault>,
    pub notes: Vec<String>,
    pub pictures: Vec<PictureComparison>,
    /// The reason why the check was skipped: what this device or system lacks. None if it was not skipped.
    pub left_out: Option<String>,
    /// The signal that ended the check before it was complete. None if it ran to its end.
    pub interrupted: Option<&'static str>,
    /// Number of pictures that [`expect_same_picture`] compared.
    pub compared: usize,
    /// Number of those that differ.
    pub differ: usize,
}

impl Findings {
    /// The findings of a check that was skipped. `why`: what this device or system lacks.
    pub fn left_out(why: impl Into<String>) -> Findings {
        Findings { left_out: Some(why.into()), ..Findings::default() }
    }

    /// Adds a fault and the pictures that show it.
    pub(crate) fn add_shown(&mut self, fault: Fault, pictures: PictureComparison) {
        self.faults.push(fault);
        self.show(pictures);
    }

    /// Adds pictures that show the last fault, if there is one.
    pub(crate) fn show(&mut self, pictures: PictureComparison) {
        let fault = self.faults.len().checked_sub(1);
        self.pictures.push(PictureComparison { fault, ..pictures });
    }

    /// Adds a fault for each message of the validation layer.
    fn add_messages(&mut self, messages: &[String]) {
        self.faults.extend(messages.iter().map(|message| Fault::new(format!("validation: {message}"))));
    }

    /// Adds a fault with the text `what` unless the condition holds.
    pub fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds {
            self.faults.push(Fault::new(what()));
        }
    }
}

type Work = Box<dyn Fn(&mut DeviceUnderTest) -> Result<Findings, GpuError>>;

/// A single check of a device.
pub struct Check {
    pub group: &'static str,
    /// Name, unique in its group.
    pub name: String,
    work: Work,
}

impl Check {
    pub fn new(
        group: &'static str,
        name: impl Into<String>,
        work: impl Fn(&mut DeviceUnderTest) -> Result<Findings, GpuError> + 'static,
    ) -> Check {
        Check { group, name: name.into(), work: Box::new(work) }
    }

    /// Runs the check. A check that fails is run up to three times more, and passes, marked as flaky, once it passes. If it never does, it is run
    /// once while the host waits for each submission, and a note says if it passes then. An error of the device is a fault. After the loss of the
    /// device a new context is opened for all later runs.
    pub fn run(&self, dut: &mut DeviceUnderTest) -> Outcome {
        let first = self.run_once(dut);
        if first.verdict != Verdict::Failed {
            return first;
        }
        let dut = RefCell::new(dut);
        first.explained(|| self.run_once(&mut dut.borrow_mut()), || self.run_waiting(&mut dut.borrow_mut()))
    }

    /// Runs the check once, while the host waits for each submission before it makes the next one.
    pub(crate) fn run_waiting(&self, dut: &mut DeviceUnderTest) -> Outcome {
        dut.waits = true;
        dut.try_to_renew();
        let outcome = self.run_once(dut);
        dut.waits = false;
        dut.try_to_renew();
        outcome
    }

    fn run_once(&self, dut: &mut DeviceUnderTest) -> Outcome {
        let begun = Instant::now();
        let mut findings = (self.work)(dut).unwrap_or_else(|error| {
            let mut findings = Findings::default();
            findings.faults.push(Fault::new(error.to_string()));
            if error.is_device_lost() {
                dut.renew().unwrap_or_else(|e| findings.faults.push(Fault::new(format!("and no other device: {e}"))));
            }
            findings
        });
        findings.add_messages(&dut.complaints());
        let verdict = match (findings.faults.is_empty(), &findings.left_out, findings.interrupted) {
            (false, _, _) => Verdict::Failed,
            (true, _, Some(_)) => Verdict::Interrupted,
            (true, Some(_), None) => Verdict::LeftOut,
            (true, None, None) => Verdict::Passed,
        };
        findings.notes.extend(findings.left_out.take());
        findings.notes.extend(findings.interrupted.map(|signal| format!("not to its end: {signal}")));
        let Findings { figures, faults, notes, pictures, .. } = findings;
        let seconds = begun.elapsed().as_secs_f64();
        Outcome { seconds, figures, faults, notes, pictures, ..Outcome::new(self.title(), verdict) }
    }

    /// Runs the check. `group`: the group of the check that was run before, None for the first; it is set to this check's group. With validation, the
    /// first check of another group gets a new context.
    pub fn run_after(&self, group: &mut Option<&'static str>, dut: &mut DeviceUnderTest) -> Outcome {
        // State that the validation layer keeps of one group must not affect the next: see `IsolatedContext`.
        let is_other = group.replace(self.group).is_some_and(|before| before != self.group);
        if dut.options.validation && is_other {
            dut.try_to_renew();
        }
        self.run(dut)
    }

    /// Group and name of the check.
    pub fn title(&self) -> CheckName {
        CheckName { group: self.group.into(), name: self.name.clone() }
    }
}

/// The device under test, with the built-in scenes and what checks share.
pub struct DeviceUnderTest {
    pub context: Arc<Context>,
    pub level: Level,
    options: ContextOptions,
    /// Its pipelines are those of all renderers of the context, which compile each only once.
    pass_runner: PassRunner,
    scenes: Rc<Vec<(String, Scene)>>,
    /// Called on every new context.
    prepare: Option<fn(&Context)>,
    /// The `echolume` program, which some checks start as a child process: at first the executable of this process. A process that is not `echolume`
    /// has to set None, and these checks are then skipped.
    pub program: Option<PathBuf>,
    modes: Option<Rc<Vec<Drawn>>>,
    /// Fault injected into every new context.
    injected_fault: Option<Change>,
    /// Every new context waits for each submission before the next.
    waits: bool,
    /// Number of validation messages already reported.
    messages_read: usize,
    /// The validation layer is active but does not notice a missing barrier.
    validation_is_blind: bool,
}

impl DeviceUnderTest {
    /// Opens the device, and makes the built-in scenes.
    ///
    /// # Errors
    /// There is no device, it cannot be opened, or there is no validation layer although it is requested.
    pub fn new(options: &ContextOptions, level: Level) -> Result<DeviceUnderTest, GpuError> {
        DeviceUnderTest::prepared(options, level, None)
    }

    /// Opens the device, and makes the built-in scenes. `prepare` is called on this context and on every later one before anything is made from it.
    ///
    /// # Errors
    /// There is no device, it cannot be opened, or there is no validation layer although it is requested.
    pub fn prepared(
        options: &ContextOptions,
        level: Level,
        prepare: Option<fn(&Context)>,
    ) -> Result<DeviceUnderTest, GpuError> {
        let context = Context::new(options)?;
        prepare.iter().for_each(|prepare| prepare(&context));
        let pass_runner = PassRunner::new(&context)?;
        let limits = &context.candidate.limits;
        let facts = DeviceFacts {
            shared_memory: limits.max_compute_shared_memory_size,
            invocations: limits.max_compute_work_group_invocations,
            ..DeviceFacts::default()
        };
        let scenes = Rc::new(built_in::scenes(facts).map_err(GpuError::Broken)?);
        Ok(DeviceUnderTest {
            context,
            level,
            options: options.clone(),
            pass_runner,
            scenes,
            prepare,
            injected_fault: None,
            waits: false,
            program: std::env::current_exe().ok(),
            modes: None,
            messages_read: 0,
            validation_is_blind: false,
        })
    }

    /// Opens the same device again, with the same scenes and with an injected fault.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub fn with_fault(&self, change: Change) -> Result<DeviceUnderTest, GpuError> {
        let mut dut = DeviceUnderTest {
            context: self.context.clone(),
            options: self.options.clone(),
            scenes: self.scenes.clone(),
            pass_runner: PassRunner::new(&self.context)?,
            injected_fault: Some(change),
            program: None,
            modes: None,
            ..*self
        };
        dut.renew()?;
        Ok(dut)
    }

    /// The built-in scenes with their names. Together they need every pass.
    pub fn scenes(&self) -> Rc<Vec<(String, Scene)>> {
        self.scenes.clone()
    }

    /// The scenes of [`built_in::modes`], rendered in the simplest way. Other checks take them as expected pictures. They are rendered at the first
    /// call.
    ///
    /// # Errors
    /// The device fails.
    pub fn modes(&mut self) -> Result<Rc<Vec<Drawn>>, GpuError> {
        if let Some(modes) = &self.modes {
            return Ok(modes.clone());
        }
        Ok(self.modes.insert(Rc::new(render::modes(&self.context)?)).clone())
    }

    /// The runner of single passes on this device.
    pub fn pass_runner(&mut self) -> &mut PassRunner {
        &mut self.pass_runner
    }

    /// Opens a further context on the same device, with the same options and injected fault. The present context stays in use.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub fn another(&self) -> Result<Arc<Context>, GpuError> {
        self.another_with(self.options.clone())
    }

    /// The same with other options.
    fn another_with(&self, options: ContextOptions) -> Result<Arc<Context>, GpuError> {
        let context = Context::new(&options)?;
        if self.waits {
            context.faults.wait_for_each_submission();
        }
        self.injected_fault.iter().for_each(|change| context.faults.inject_change(*change));
        self.prepare.iter().for_each(|prepare| prepare(&context));
        Ok(context)
    }

    /// The options with which contexts are opened.
    pub fn options(&self) -> &ContextOptions {
        &self.options
    }

    /// True if the validation layer is active and not known to miss a missing barrier.
    pub fn watched(&self) -> bool {
        self.options.validation && !self.validation_is_blind
    }

    /// Finds out whether the validation layer detects a missing barrier; the result is stored. If it does not, its silence proves nothing, and no
    /// report states that it was active. Without validation the result is false.
    ///
    /// # Errors
    /// The device cannot be opened again, or fails.
    pub fn prove_validation(&mut self) -> Result<bool, GpuError> {
        let notices = hazards::validation_notices_a_dropped_barrier(self)?;
        self.validation_is_blind = !notices;
        Ok(notices)
    }

    /// The run with these outcomes on this device; it began at `begun` and ends now.
    pub fn run_of(&self, outcomes: Vec<Outcome>, begun: Instant) -> Run {
        run_on(machine::device(&self.context), self.watched(), self.level, outcomes, begun)
    }

    fn renew(&mut self) -> Result<(), GpuError> {
        self.context = self.another()?;
        (self.pass_runner, self.messages_read) = (PassRunner::new(&self.context)?, 0);
        Ok(())
    }

    fn try_to_renew(&mut self) {
        self.renew().unwrap_or_else(|error| tracing::warn!("the old device goes on: {error}"));
    }

    /// Validation messages since the last call.
    fn complaints(&mut self) -> Vec<String> {
        let messages = self.context.messages();
        let new = messages[self.messages_read.min(messages.len())..].to_vec();
        self.messages_read = messages.len();
        credible_messages(&self.context, new, true)
    }
}

/// A context for one check alone: its device may be lost, may lack features, or one queue may act as several. Validation messages are
/// reported at the end.
///
/// Validation layers of version 1.3.239 do not know that a queue or the host waits for a timeline semaphore. If one queue acts as
/// several, they report everything between submissions as a hazard; likewise if memory that was read back is reused.
struct IsolatedContext {
    pub context: Arc<Context>,
    /// Report hazards between submissions.
    hears_submissions: bool,
}

impl IsolatedContext {
    /// Opens a context for a check that uses one queue.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub fn new(dut: &DeviceUnderTest) -> Result<IsolatedContext, GpuError> {
        IsolatedContext::of_queues(dut, 1)
    }

    /// Opens a context for a check with `queues` queues; on a device with fewer, one queue acts as several.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub(crate) fn of_queues(dut: &DeviceUnderTest, queues: usize) -> Result<IsolatedContext, GpuError> {
        let context = dut.another()?;
        Ok(IsolatedContext { hears_submissions: context.queue_count() >= queues, context })
    }

    /// Opens a context for a check whose renderers change often, or are made again after slots were read back.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub(crate) fn of_changes(dut: &DeviceUnderTest) -> Result<IsolatedContext, GpuError> {
        Ok(IsolatedContext { hears_submissions: false, context: dut.another()? })
    }

    /// Opens a context of a device that lacks features: `change` edits the known capabilities before anything is made from the context.
    ///
    /// # Errors
    /// The device cannot be opened again.
    pub(crate) fn lacking(
        dut: &DeviceUnderTest,
        change: impl FnOnce(&mut Context),
    ) -> Result<IsolatedContext, GpuError> {
        let mut isolated = IsolatedContext::new(dut)?;
        let own = Arc::get_mut(&mut isolated.context);
        own.map(change).ok_or(GpuError::Broken("the isolated context is shared".into()))?;
        Ok(isolated)
    }

    /// Adds the validation messages that can be believed as faults.
    pub(crate) fn report_validation(&self, findings: &mut Findings) {
        findings.add_messages(&self.credible_messages());
    }

    /// All validation messages so far, without known false positives.
    fn credible_messages(&self) -> Vec<String> {
        credible_messages(&self.context, self.context.messages(), self.hears_submissions)
    }
}

/// Validation messages without known false positives: hazards between submissions only if they are reliable.
fn credible_messages(context: &Context, mut messages: Vec<String>, hears_submissions: bool) -> Vec<String> {
    if !hears_submissions || !context.validates_timelines() {
        messages.retain(|m| !(m.contains("SYNC-HAZARD") && m.contains("vkQueueSubmit2")));
    }
    messages
}
