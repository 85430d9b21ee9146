//! What is looked at, and what was found.

use super::Bench;
use crate::gpu::GpuError;
use crate::verify::report::{Fault, Figure, Outcome, Shown, Verdict};
use std::time::Instant;

/// What a check found.
#[derive(Default)]
pub struct Found {
    pub figures: Vec<Figure>,
    pub faults: Vec<Fault>,
    pub notes: Vec<String>,
    pub pictures: Vec<Shown>,
    /// Not run, because this device or system lacks something: what.
    pub left_out: Option<String>,
}

impl Found {
    /// What was not run, and why.
    pub fn left_out(why: impl Into<String>) -> Found {
        Found { left_out: Some(why.into()), ..Found::default() }
    }

    /// A fault unless something holds.
    pub fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds {
            self.faults.push(Fault::new(what()));
        }
    }

    /// Keeps an error, and makes it a fault where it is more than allowed. NaN is more than anything.
    pub fn error(&mut self, figure: Figure, what: impl FnOnce() -> String) {
        let within = figure.allowed.is_none_or(|allowed| figure.value <= allowed);
        self.expect(within, what);
        self.figures.push(figure);
    }
}

type Work = Box<dyn Fn(&mut Bench) -> Result<Found, GpuError>>;

/// One thing that is looked at.
pub struct Check {
    pub group: &'static str,
    /// Unique in its group.
    pub name: String,
    work: Work,
}

impl Check {
    pub fn new(
        group: &'static str,
        name: impl Into<String>,
        work: impl Fn(&mut Bench) -> Result<Found, GpuError> + 'static,
    ) -> Check {
        Check { group, name: name.into(), work: Box::new(work) }
    }

    /// Runs it. A device that fails is a fault of its own, and the next check gets another context.
    pub fn run(&self, bench: &mut Bench) -> Outcome {
        let begun = Instant::now();
        let mut found = self.found(bench).unwrap_or_else(|error| {
            let mut found = Found::default();
            found.faults.push(Fault::new(error.to_string()));
            if error.is_device_lost() {
                bench.renew().unwrap_or_else(|e| found.faults.push(Fault::new(format!("and no other device: {e}"))));
            }
            found
        });
        let complaints = bench.complaints();
        found.faults.extend(complaints.iter().map(|message| Fault::new(format!("validation: {message}"))));
        let verdict = match (found.faults.is_empty(), &found.left_out) {
            (false, _) => Verdict::Failed,
            (true, Some(_)) => Verdict::LeftOut,
            (true, None) => Verdict::Passed,
        };
        found.notes.extend(found.left_out.take());
        self.outcome(verdict, found, begun)
    }

    /// What it finds, with the device's error as it is.
    ///
    /// # Errors
    /// A device that fails.
    pub(super) fn found(&self, bench: &mut Bench) -> Result<Found, GpuError> {
        (self.work)(bench)
    }

    /// It was not run, or not to its end.
    pub(super) fn stopped(&self, why: &str) -> Outcome {
        let found = Found { notes: vec![format!("not run: {why}")], ..Found::default() };
        self.outcome(Verdict::LeftOut, found, Instant::now())
    }

    pub(super) fn failed(&self, why: String) -> Outcome {
        let found = Found { faults: vec![Fault::new(why)], ..Found::default() };
        self.outcome(Verdict::Failed, found, Instant::now())
    }

    fn outcome(&self, verdict: Verdict, found: Found, begun: Instant) -> Outcome {
        Outcome {
            group: self.group.into(),
            name: self.name.clone(),
            verdict,
            seconds: begun.elapsed().as_secs_f64(),
            figures: found.figures,
            faults: found.faults,
            notes: found.notes,
            pictures: found.pictures,
        }
    }
}
