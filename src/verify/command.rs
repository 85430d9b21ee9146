//! `echolume verify`.

use crate::args::{check_outputs, write_report};
use crate::files::read_text;
use crate::files::signals::Held;
use crate::gpu::{Context, ContextOptions, DeviceChoice, GpuError};
use crate::terminal::{Failure, failed, input, say};
use crate::verify::report::baseline::{BaselineComparison, BaselineOptions, compare};
use crate::verify::report::{self, Level, Outcome, Run, Verdict, html, junit};
use crate::verify::self_test::{self, Detection};
use crate::verify::{self, Check, DeviceUnderTest};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Maximum size of a baseline file, bytes.
const MAX_BASELINE: u64 = 256 << 20;

#[derive(clap::Args)]
#[command(
    after_help = "Exit codes: 0 all checks passed, 1 a check failed or a report could not be written, 2 usage or an input, 3 no device.\n\nExamples:\n  \
                        echolume verify                                         (some minutes on a CPU, less on a GPU)\n  \
                        echolume verify --full --json before.json               (before the driver is updated)\n  \
                        echolume verify --full --baseline before.json --html after.html\n  \
                        echolume verify --self-test                             (do the checks detect injected faults?)"
)]
pub struct Verify {
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<DeviceChoice>,
    /// Run every pass, mode and path once (the default)
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Run every input of every pass in every scene, and a stress test of some minutes
    #[arg(long)]
    full: bool,
    /// Compare with an earlier run (its --json), also within tolerances; exit code 1 if anything became worse
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    /// Ratio to the baseline's time that counts as a failure
    #[arg(long, value_name = "RATIO", default_value_t = 1.25, requires = "baseline")]
    threshold: f64,
    /// Write JUnit XML, for CI
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write all measurements (JSON), for --baseline
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write an HTML page with pictures side by side
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Folder for the pictures of failures: actual, expected, difference. Created when needed
    #[arg(long, value_name = "FOLDER", default_value = "echolume-verify")]
    pictures: PathBuf,
    /// Inject faults one at a time and print which check detects each; an undetected fault is a failure
    #[arg(long, conflicts_with_all = ["against", "baseline", "full", "only", "list"])]
    self_test: bool,
    /// Render every mode on this device too, and compare the pictures
    #[arg(long, value_name = "N|NAME")]
    against: Option<DeviceChoice>,
    /// Run only checks whose group or name contains this; may be repeated
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// List the checks and exit
    #[arg(long)]
    list: bool,
    /// Do not use the validation layer even if it is installed
    #[arg(long)]
    no_validation: bool,
    /// Print only a digest of all pictures
    #[arg(long, hide = true)]
    digest: bool,
}

impl Verify {
    pub fn run(&self) -> Result<(), Failure> {
        if self.digest {
            let device = self.device.clone().unwrap_or(DeviceChoice::Best);
            let context = context(&ContextOptions { device, validation: false, ..ContextOptions::default() })?;
            say!("{}", verify::determinism::digest(&context).map_err(failed)?.trim_end());
            return Ok(());
        }
        let level = if self.full { Level::Full } else { Level::Quick };
        if self.list {
            let checks = self.chosen(verify::checks(level))?;
            checks.iter().for_each(|check| say!("{} / {}", check.group, check.name));
            return Ok(());
        }
        let options = BaselineOptions::new(self.threshold).map_err(|e| input(format!("--{e}")))?;
        let files = [("--json", &self.json), ("--junit", &self.junit), ("--html", &self.html)];
        check_outputs(&files.map(|(flag, file)| (flag, file.as_deref())), self.baseline.as_deref())?;
        let mut earlier = self.baseline.as_deref().map(read).transpose()?;
        // Checks that were not requested are not missing.
        earlier.iter_mut().for_each(|run| run.outcomes.retain(|o| self.is_selected(o)));
        let mut dut = self.open(level)?;
        let (mut run, stopped) = match self.self_test {
            true => (self.run_self_test(&dut)?, None),
            false => self.run_checks(&mut dut)?,
        };
        self.save_pictures(&mut run);
        let compared = earlier.map(|earlier| compare(&earlier, &run, &options));
        self.write(&run, compared.as_ref())?;
        self.judge(&run, compared.as_ref(), stopped)
    }

    /// Runs the checks on the device. Returns the outcomes, and the signal if one ended the run early.
    fn run_checks(&self, dut: &mut DeviceUnderTest) -> Result<(Run, Option<&'static str>), Failure> {
        let held = Held::first();
        announce(dut);
        let checks = match &self.against {
            Some(other) => {
                let other = context(&ContextOptions { device: other.clone(), ..dut.options().clone() })?;
                say!("against: {}, {}", other.candidate.name, other.candidate.driver.trim());
                verify::modes::against(dut.level, &other).map_err(failed)?
            }
            None => verify::checks(dut.level),
        };
        let checks = self.chosen(checks)?;
        let (mut ran, mut group) = (0, Vec::<Outcome>::new());
        let on_outcome = |outcome: &Outcome| {
            if group.first().is_some_and(|first| first.group != outcome.group) {
                print_group(&std::mem::take(&mut group));
            }
            // One line per group; a failure is printed at once.
            if outcome.verdict == Verdict::Failed {
                say!("{}", report::failure(outcome).trim_end());
            }
            group.push(Outcome { pictures: Vec::new(), ..outcome.clone() });
            ran += 1;
        };
        let mut run = announcing_signals(&held, || verify::run(dut, &checks, || held.signal(), on_outcome));
        print_group(&group);
        let stopped = held.signal().filter(|_| ran < checks.len());
        // Readers of the report files must see it, too.
        run.outcomes.extend(stopped.map(|signal| verify::stopped(signal, checks.len() - ran)));
        Ok((run, stopped))
    }

    /// Runs the self-test: which check detects each injected fault.
    fn run_self_test(&self, dut: &DeviceUnderTest) -> Result<Run, Failure> {
        announce(dut);
        let begun = Instant::now();
        let tell = |detection: &Detection| match &detection.by {
            _ if detection.left_out => say!("{}: left out\n    {}", detection.fault, detection.message),
            Some(by) => say!("{}: caught by {by}\n    {}", detection.fault, detection.message),
            None => say!("{}: NOT CAUGHT ({})\n    {}", detection.fault, detection.what, detection.message),
        };
        let detection = self_test::run(dut.options(), tell).map_err(failed)?;
        Ok(dut.run_of(detection.iter().map(Detection::outcome).collect(), begun))
    }

    /// Opens the device, with validation if its layer is installed.
    fn open(&self, level: Level) -> Result<DeviceUnderTest, Failure> {
        let device = self.device.clone().unwrap_or(DeviceChoice::Best);
        let with = |validation| {
            DeviceUnderTest::new(
                &ContextOptions { device: device.clone(), validation, ..ContextOptions::default() },
                level,
            )
        };
        match with(!self.no_validation) {
            Err(GpuError::NoValidation) => with(false),
            made => made,
        }
        .map_err(no_device)
        .and_then(|mut dut| {
            if dut.watched() && !dut.prove_validation().map_err(failed)? {
                say!(
                    "validation sees nothing here: the layer is active and did not notice a missing barrier; its silence proves nothing"
                );
            }
            Ok(dut)
        })
    }

    fn chosen(&self, mut checks: Vec<Check>) -> Result<Vec<Check>, Failure> {
        checks.retain(|check| self.wants(check.group, &check.name));
        match checks.is_empty() {
            true => {
                Err(input(format!("--only {}: no check has this name; --list prints all names", self.only.join(", "))))
            }
            false => Ok(checks),
        }
    }

    /// True if this run includes a check of an earlier one.
    fn is_selected(&self, earlier: &Outcome) -> bool {
        (earlier.group == "against") == self.against.is_some() && self.wants(&earlier.group, &earlier.name)
    }

    fn wants(&self, group: &str, name: &str) -> bool {
        self.only.is_empty()
            || self.only.iter().any(|part| group.contains(part.as_str()) || name.contains(part.as_str()))
    }

    /// Writes the pictures of each failure and stores their file names in it. If the folder cannot be written, only the pictures are lost.
    fn save_pictures(&self, run: &mut Run) {
        for outcome in run.outcomes.iter_mut().filter(|o| o.verdict == Verdict::Failed) {
            for shown in &outcome.pictures {
                let Some(fault) = shown.fault.and_then(|at| outcome.faults.get_mut(at)) else { continue };
                let of = shown.fault.map_or(0, |at| at + 1);
                let name = file_name(&format!("{}-{}-{of}-{}", outcome.group, outcome.name, shown.what));
                for (kind, picture) in
                    [("actual", &shown.actual), ("expected", &shown.expected), ("difference", &shown.difference)]
                {
                    let file = self.pictures.join(format!("{name}-{kind}.png"));
                    let made = std::fs::create_dir_all(&self.pictures)
                        .map_err(|e| format!("{}: {e}", self.pictures.display()));
                    match made.and_then(|()| picture.save(&file)) {
                        Ok(()) => fault.files.push(file.display().to_string()),
                        Err(why) => return tracing::warn!("pictures of failures: {why}"),
                    }
                }
            }
        }
    }

    fn write(&self, run: &Run, compared: Option<&BaselineComparison>) -> Result<(), Failure> {
        put(&self.json, || report::to_json(run).map_err(|e| e.to_string()))?;
        put(&self.junit, || junit::junit(run, compared))?;
        put(&self.html, || html::html(run, compared))
    }

    fn judge(&self, run: &Run, compared: Option<&BaselineComparison>, stopped: Option<&str>) -> Result<(), Failure> {
        if let Some(compared) = compared {
            say!("{}", report::comparison(compared).trim_end());
        }
        say!("{}", report::summary(run));
        let files: Vec<_> = run.failures().flat_map(|o| &o.faults).flat_map(|f| &f.files).collect();
        if !files.is_empty() {
            say!("pictures of failures: {} in {}", files.len(), self.pictures.display());
        }
        if let Some(signal) = stopped {
            return Err(failed(format!(
                "{signal} ended the run before all {} checks were done",
                run.outcomes.len() - 1
            )));
        }
        let worse = compared.filter(|c| c.is_worse()).map_or(0, BaselineComparison::worse_checks);
        match (run.count(Verdict::Failed), worse) {
            (0, 0) => Ok(()),
            (0, worse) => Err(failed(format!("{worse} checks became worse since the baseline"))),
            (count, _) => Err(failed(format!("{count} of {} checks failed", run.outcomes.len()))),
        }
    }
}

/// Writes a report file, if one was requested.
fn put(file: &Option<PathBuf>, text: impl FnOnce() -> Result<String, String>) -> Result<(), Failure> {
    let Some(file) = file else { return Ok(()) };
    write_report(file, &text().map_err(failed)?)
}

fn announce(dut: &DeviceUnderTest) {
    let device = &dut.context.candidate;
    let note = if device.is_software() { " (software: no GPU is used)" } else { "" };
    let watched = if dut.watched() { "" } else { "; without the validation layer" };
    say!("device: {}{note}, {}{watched}", device.name, device.driver.trim());
}

/// Reports a signal at once: the running check may take a minute.
fn announcing_signals<T>(held: &Held, work: impl FnOnce() -> T) -> T {
    const OFTEN: Duration = Duration::from_millis(100);
    let (working, works) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while held.signal().is_none() && works.recv_timeout(OFTEN) == Err(RecvTimeoutError::Timeout) {}
            if let Some(signal) = held.signal() {
                say!("{signal}: stopping after this check; a second signal stops at once and writes nothing");
            }
        });
        let done = work();
        drop(working);
        done
    })
}

fn print_group(group: &[Outcome]) {
    if let Some(first) = group.first() {
        say!("{}", report::group_line(&first.group, &group.iter().collect::<Vec<_>>()).trim_end());
    }
}

fn context(options: &ContextOptions) -> Result<Arc<Context>, Failure> {
    Context::new(options).map_err(no_device)
}

/// A missing device has an exit code of its own.
fn no_device(error: GpuError) -> Failure {
    match error {
        GpuError::NoLoader(_) | GpuError::NoDevice | GpuError::NoneFits(_) | GpuError::NoSuchDevice { .. } => {
            Failure::NoDevice(error.to_string())
        }
        other => failed(other),
    }
}

/// A file name made of the letters and digits of a title, of bounded length.
fn file_name(title: &str) -> String {
    let plain = title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' });
    let mut name = String::new();
    plain.for_each(|c| {
        if c != '-' || !name.ends_with('-') {
            name.push(c)
        }
    });
    name.chars().take(100).collect::<String>().trim_matches('-').to_string()
}

fn read(file: &Path) -> Result<Run, Failure> {
    let fault = |e: &dyn std::fmt::Display| input(format!("--baseline {}: {e}", file.display()));
    let text = read_text(file, MAX_BASELINE, "--json of verify").map_err(|e| fault(&e))?;
    report::from_json(&text).map_err(|e| fault(&e))
}
