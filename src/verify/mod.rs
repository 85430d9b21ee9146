//! Whether a device and its driver still do what they should: every pass, every mode and every way to fail, on inputs that are part of
//! the program. Needs no source tree. What came of it is a [`Run`]; [`crate::verify::report`] makes reports of that.
//!
//! A check says what it measured and what is wrong; [`Bench`] is what it works on. The groups are the files of this folder; the
//! self-test plants faults and looks which check notices each.

pub mod against;
pub mod built_in;
mod check;
pub(crate) mod command;
mod compared;
pub mod drawn;
pub mod failing;
pub mod formats;
pub mod hazards;
pub mod inputs;
mod isolated_context;
mod known_answers;
pub mod limits;
pub mod modes;
pub mod passes;
pub mod poison;
pub mod repeats;
pub mod report;
pub mod self_test;
mod shown;
mod speed;
pub mod stamps;
pub mod stress;
pub mod threads;

use crate::gpu::pass_runner::PassRunner;
use crate::gpu::{Context, ContextOptions, GpuError};
use crate::machine;
use crate::passes::fault_injection::Change;
use crate::scene::Scene;
use crate::verify::report::{FORMAT, Level, Outcome, Run};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

pub use check::{Check, Found};
pub use compared::{Comparison, Slack, compare};
pub use drawn::Drawn;

/// What checks work on: a device, and the scenes that are part of the program.
pub struct Bench {
    pub context: Arc<Context>,
    pub level: Level,
    options: ContextOptions,
    single: Option<PassRunner>,
    scenes: Rc<Vec<(String, Scene)>>,
    /// Done to every context that is made.
    prepare: Option<fn(&Context)>,
    /// The program that checks start again beside themselves: this one, unless it is only a part of one.
    pub program: Option<PathBuf>,
    modes: Option<Rc<Vec<Drawn>>>,
    /// InjectedFault in every context that is made.
    planted: Option<Change>,
    /// Messages of validation that were told.
    told: usize,
}

impl Bench {
    /// # Errors
    /// No device, or none with the validation layer where that is asked for.
    pub fn new(options: &ContextOptions, level: Level) -> Result<Bench, GpuError> {
        Bench::prepared(options, level, None)
    }

    /// The same with something done to every context before anything is made from it.
    ///
    /// # Errors
    /// As of [`Bench::new`].
    pub fn prepared(options: &ContextOptions, level: Level, prepare: Option<fn(&Context)>) -> Result<Bench, GpuError> {
        let context = Context::new(options)?;
        prepare.iter().for_each(|prepare| prepare(&context));
        let made = |asked: &built_in::Asked| Ok((asked.name.clone(), asked.make()?));
        let scenes: Result<Vec<_>, String> = built_in::scenes().iter().map(made).collect();
        let scenes = Rc::new(scenes.map_err(GpuError::Broken)?);
        Ok(Bench {
            context,
            level,
            options: options.clone(),
            single: None,
            scenes,
            prepare,
            planted: None,
            program: std::env::current_exe().ok(),
            modes: None,
            told: 0,
        })
    }

    /// Another one on the same device and scenes, with a fault planted.
    ///
    /// # Errors
    /// As of [`Bench::new`].
    pub fn planted(&self, change: Change) -> Result<Bench, GpuError> {
        let mut bench = Bench {
            context: self.context.clone(),
            options: self.options.clone(),
            scenes: self.scenes.clone(),
            single: None,
            planted: Some(change),
            program: None,
            modes: None,
            ..*self
        };
        bench.renew()?;
        Ok(bench)
    }

    /// Scenes by name, which among them need every pass.
    pub fn scenes(&self) -> Rc<Vec<(String, Scene)>> {
        self.scenes.clone()
    }

    /// Every mode with filters of every stage, drawn in the plainest way: what is drawn in others is held against it.
    ///
    /// # Errors
    /// A device that fails.
    pub fn modes(&mut self) -> Result<Rc<Vec<Drawn>>, GpuError> {
        if let Some(modes) = &self.modes {
            return Ok(modes.clone());
        }
        let modes = Rc::new(drawn::modes(&self.context)?);
        self.modes = Some(modes.clone());
        Ok(modes)
    }

    /// What runs one pass alone.
    ///
    /// # Errors
    /// A device that fails.
    pub fn single(&mut self) -> Result<&mut PassRunner, GpuError> {
        if self.single.is_none() {
            self.single = Some(PassRunner::new(&self.context)?);
        }
        // Just made, where there was none.
        self.single.as_mut().ok_or(GpuError::Broken("no pass can be run alone".into()))
    }

    /// Another context on the same device: the old one was lost, or is to be lost.
    ///
    /// # Errors
    /// As of [`Bench::new`].
    pub fn another(&self) -> Result<Arc<Context>, GpuError> {
        let context = Context::new(&self.options)?;
        self.planted.iter().for_each(|change| context.faults.inject_change(*change));
        self.prepare.iter().for_each(|prepare| prepare(&context));
        Ok(context)
    }

    pub fn options(&self) -> &ContextOptions {
        &self.options
    }

    /// Whether the validation layer watches.
    pub fn watched(&self) -> bool {
        self.options.validation
    }

    /// A run that ends now.
    pub fn run_of(&self, outcomes: Vec<Outcome>, begun: Instant) -> Run {
        Run {
            format: FORMAT.into(),
            program: machine::program(),
            date: machine::date(),
            device: machine::device(&self.context),
            level: self.level,
            validation: self.options.validation,
            seconds: begun.elapsed().as_secs_f64(),
            outcomes,
        }
    }

    fn renew(&mut self) -> Result<(), GpuError> {
        (self.single, self.told) = (None, 0);
        self.context = self.another()?;
        Ok(())
    }

    /// What validation said since it was last asked.
    fn complaints(&mut self) -> Vec<String> {
        let messages = self.context.messages();
        let new = messages[self.told.min(messages.len())..].to_vec();
        self.told = messages.len();
        isolated_context::told(&self.context, new, true)
    }
}

/// Every check of a level, in running order.
pub fn checks(level: Level) -> Vec<Check> {
    let groups = [
        passes::checks,
        known_answers::checks,
        modes::checks,
        repeats::checks,
        poison::checks,
        failing::checks,
        limits::checks,
        formats::checks,
        hazards::checks,
        stamps::checks,
        speed::checks,
        stress::checks,
    ];
    groups.into_iter().flat_map(|group| group(level)).collect()
}

/// Runs checks one after the other; `tell` hears of each as it is done. Once `stop` has a reason no other is begun: they are left out.
pub fn run(
    bench: &mut Bench,
    checks: &[Check],
    stop: impl Fn() -> Option<&'static str>,
    mut tell: impl FnMut(&Outcome),
) -> Run {
    let begun = Instant::now();
    let mut outcomes = Vec::new();
    let mut group = checks.first().map_or("", |check| check.group);
    for check in checks {
        if let Some(why) = stop() {
            outcomes.push(check.stopped(why));
            continue;
        }
        // What validation keeps of one group is none of the next one's: see `aside`.
        if bench.options.validation && std::mem::replace(&mut group, check.group) != check.group {
            let renewed = bench.renew();
            renewed.unwrap_or_else(|error| tracing::warn!("the old device goes on: {error}"));
        }
        // A driver that crashes says nothing more.
        tracing::info!("check: {} / {}", check.group, check.name);
        let outcome = check.run(bench);
        tell(&outcome);
        outcomes.push(outcome);
    }
    bench.run_of(outcomes, begun)
}

/// What stands for the checks that a signal left out: a run that was not whole is not sound.
pub fn stopped(signal: &str, left: usize) -> Outcome {
    Check::new("run", "every check was run", |_| Ok(Found::default()))
        .failed(format!("{signal}: {left} checks were not"))
}
