//! `echolume verify`: tests a device and its driver.

use crate::args::{check_outputs, device_failure, write_if_asked};
use crate::baselines::{Stored, Threshold};
use crate::files::replace_for_all;
use crate::files::signals::Held;
use crate::gpu::{Context, ContextOptions, DeviceChoice, GpuError};
use crate::machine;
use crate::terminal::{Failure, failed, input, progress_bar, say};
use crate::verify::gtest::{self, Filter};
use crate::verify::isolation::{self, InjectedCrash, Workers};
use crate::verify::progress::{self, Progress, Style};
use crate::verify::report::baseline::{BaselineComparison, compare};
use crate::verify::report::prometheus::prometheus;
use crate::verify::report::{self, CheckName, Level, Outcome, Run, Verdict, html, junit};
use crate::verify::reproduce::{ReproduceError, reproduce};
use crate::verify::self_test::{self, Detection};
use crate::verify::{self, Check, DeviceUnderTest};
use indicatif::ProgressBar;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
#[command(
    after_help = "Exit codes: 0 all checks passed, 1 a check failed or a report could not be written, 2 usage or an input, 3 no device, 4 a signal ended the run early and no check had failed, 125 with --bisect if the device cannot be started.\n\nExamples:\n  \
                        echolume verify                                         (some minutes on a CPU, less on a GPU)\n  \
                        echolume verify --full --json before.json               (before the driver is updated)\n  \
                        echolume verify --full --baseline before.json --html after.html\n  \
                        echolume verify --self-test                             (whether the checks detect injected faults)"
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
    /// Compare with an earlier run (its --json). Exit code 1 also if a pass is slower; an error that grew within its tolerance is only reported
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
    /// Ratio to the baseline's time that counts as a failure. A time that is measured once fails above 3 times and 0.1 s more
    #[arg(long, value_name = "RATIO", default_value_t = 1.25, requires = "baseline")]
    threshold: f64,
    #[command(flatten)]
    files: Files,
    /// Folder for the pictures of failures: actual, expected, difference. Created when needed
    #[arg(long, value_name = "FOLDER", default_value = "echolume-verify")]
    pictures: PathBuf,
    /// Inject faults one at a time and print which check detects each; an undetected fault is a failure
    #[arg(long, conflicts_with_all = ["against", "baseline", "full", "only", "list"])]
    self_test: bool,
    /// Render every mode on this device too, and compare the pictures
    #[arg(long, value_name = "N|NAME")]
    against: Option<DeviceChoice>,
    /// Run only checks whose group or name contains this, or the one whose line of --list it is; may be repeated
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// List the checks and exit
    #[arg(long)]
    list: bool,
    /// List what the checks exercise, and exit: shaders, pipelines, constants, classes of instructions and Vulkan commands
    #[arg(long, conflicts_with_all = ["list", "self_test", "only"])]
    coverage: bool,
    /// Write one dispatch of this check's pass for a bug report: shader, inputs, expected values, and a script for Amber. The smallest
    /// that fails, or the smallest
    #[arg(long, value_name = "CHECK", requires = "output")]
    reproduce: Option<String>,
    /// Folder for --reproduce. Created when needed
    #[arg(short, long, value_name = "FOLDER", requires = "reproduce")]
    output: Option<PathBuf>,
    /// Run each check in a process of its own, so that one that crashes or hangs is a failed check and the rest goes on (the default
    /// with --full)
    #[arg(long, conflicts_with_all = ["no_isolate", "self_test"])]
    isolate: bool,
    /// Run all checks in this process, with --full too
    #[arg(long)]
    no_isolate: bool,
    /// For `git bisect run` over versions of a driver: each check in a process of its own, and exit code 125 if the device cannot be started
    #[arg(long, conflicts_with_all = ["no_isolate", "self_test"])]
    bisect: bool,
    /// Time limit of a check in a process of its own, and of the start of the device, s
    #[arg(long, value_name = "SECONDS", default_value_t = 1200, value_parser = clap::value_parser!(u64).range(1..=86400))]
    check_timeout: u64,
    /// List the checks as a GoogleTest program lists its tests, and exit
    #[arg(long = "gtest_list_tests")]
    gtest_list_tests: bool,
    /// Run the checks that a GoogleTest filter selects (POSITIVE-NEGATIVE, patterns separated by ':'), and print what such a program
    /// prints: for deqp-runner
    #[arg(long = "gtest_filter", value_name = "PATTERNS", conflicts_with = "self_test")]
    gtest_filter: Option<Filter>,
    /// Do not use the validation layer even if it is installed
    #[arg(long)]
    no_validation: bool,
    /// Print only a digest of all pictures
    #[arg(long, hide = true)]
    digest: bool,
    /// Run checks for another process
    #[arg(long, hide = true)]
    worker: bool,
    /// Let a check crash: KIND:GROUP / NAME, where KIND is segv, abort, hang, exit, flake or unsynchronized, or KIND:start
    #[arg(long, hide = true, value_name = "KIND:CHECK")]
    inject_crash: Option<InjectedCrash>,
}

/// What the run is written to.
#[derive(clap::Args)]
struct Files {
    /// Write JUnit XML, for CI
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write all measurements (JSON), for --baseline
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write an HTML page with pictures side by side
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write metrics in Prometheus' text format, for the textfile collector of its node exporter (name it *.prom)
    #[arg(long, value_name = "FILE")]
    prometheus: Option<PathBuf>,
}

impl Verify {
    pub fn run(&self) -> Result<(), Failure> {
        if self.digest {
            let device = self.device.clone().unwrap_or(DeviceChoice::Best);
            let context = context(&ContextOptions { device, ..ContextOptions::default() })?;
            say!("{}", verify::determinism::digest(&context).map_err(failed)?.trim_end());
            return Ok(());
        }
        if self.coverage {
            let scenes = verify::built_in::scenes(verify::built_in::gpu()).map_err(failed)?;
            say!("{}", verify::coverage::text(&scenes).trim_end());
            return Ok(());
        }
        let level = if self.full { Level::Full } else { Level::Quick };
        if self.worker {
            return self.serve(level);
        }
        if self.list || self.gtest_list_tests {
            let names: Vec<CheckName> = verify::checks(level).iter().map(Check::title).collect();
            let names: Vec<CheckName> = self.chosen(&names)?.into_iter().map(|n| names[n].clone()).collect();
            match self.gtest_list_tests {
                true if names.is_empty() => {}
                true => say!("{}", gtest::list(&names).trim_end()),
                false => names.iter().for_each(|check| say!("{} / {}", check.group, check.name)),
            }
            return Ok(());
        }
        if let (Some(check), Some(folder)) = (&self.reproduce, &self.output) {
            return self.reproduce(level, check, folder);
        }
        let threshold = Threshold::new(self.threshold).map_err(|e| input(format!("--{e}")))?;
        let files = [
            ("--json", &self.files.json),
            ("--junit", &self.files.junit),
            ("--html", &self.files.html),
            ("--prometheus", &self.files.prometheus),
        ];
        check_outputs(&files.map(|(flag, file)| (flag, file.as_deref())), self.baseline.as_deref())?;
        let mut earlier =
            self.baseline.as_deref().map(Run::load).transpose().map_err(|e| input(format!("--baseline {e}")))?;
        // Checks that were not requested are not missing.
        earlier.iter_mut().for_each(|run| run.outcomes.retain(|o| self.is_selected(o)));
        let (mut run, stopped) = match () {
            _ if self.self_test => (self.run_self_test(level)?, None),
            _ if self.isolate || self.bisect || (self.full && !self.no_isolate) => {
                self.run_isolated(level).map_err(|why| match why {
                    Failure::NoDevice(why) if self.bisect => Failure::Untestable(why),
                    other => other,
                })?
            }
            _ => self.run_here(level)?,
        };
        self.save_pictures(&mut run);
        let compared = earlier.map(|earlier| compare(&earlier, &run, threshold));
        self.write(&run, compared.as_ref())?;
        self.judge(&run, compared.as_ref(), stopped)
    }

    /// Runs the checks in this process. Returns the outcomes, and the signal if one ended the run early.
    fn run_here(&self, level: Level) -> Result<(Run, Option<&'static str>), Failure> {
        let begun = Instant::now();
        let mut lines = Vec::new();
        let mut dut = self.open(level, &mut lines)?;
        let held = Held::first();
        let checks = self.checks(&dut, &mut lines)?;
        lines.iter().for_each(|line| say!("{line}"));
        let names: Vec<CheckName> = checks.iter().map(Check::title).collect();
        let chosen = self.chosen(&names)?;
        let mut group = None;
        let what = "stopping after this check; a second signal stops at once and writes nothing";
        let outcomes = announcing_signals(&held, what, || {
            self.run_each(&names, &chosen, progress_bar(0), &held, |n| checks[n].run_after(&mut group, &mut dut))
        });
        let device = machine::device(&dut.context);
        Ok((verify::run_on(device, dut.watched(), level, outcomes, begun), held.signal()))
    }

    /// Runs the checks in processes of their own. Returns the outcomes, and the signal if one ended the run early.
    fn run_isolated(&self, level: Level) -> Result<(Run, Option<&'static str>), Failure> {
        let (begun, held) = (Instant::now(), Held::first());
        let program = this_program()?;
        let command = || self.worker_command(&program);
        let signal = || held.signal();
        let limit = Duration::from_secs(self.check_timeout);
        let what = "ending; the running check is interrupted";
        announcing_signals(&held, what, || {
            let bar = progress_bar(0);
            let (mut workers, ready) = match Workers::start(&command, limit, &signal, progress::echo(&bar)) {
                Err(Failure::Failed(why)) => return Ok((verify::unstarted(level, why, begun), held.signal())),
                started => started?,
            };
            ready.lines.iter().for_each(|line| say!("{line}"));
            let chosen = self.chosen(&ready.checks)?;
            let names = &ready.checks;
            let outcomes = self.run_each(names, &chosen, bar, &held, |n| workers.run(n, &names[n]));
            Ok((verify::run_on(ready.device, ready.validation, level, outcomes, begun), held.signal()))
        })
    }

    /// Runs the chosen checks by `one`, which is given their places in `names`, and says so.
    fn run_each(
        &self,
        names: &[CheckName],
        chosen: &[usize],
        bar: ProgressBar,
        held: &Held,
        mut one: impl FnMut(usize) -> Outcome,
    ) -> Vec<Outcome> {
        let selected: Vec<CheckName> = chosen.iter().map(|n| names[*n].clone()).collect();
        let style = if self.gtest_filter.is_some() { Style::GoogleTest } else { Style::Groups };
        if style == Style::GoogleTest {
            say!("{}", gtest::begins_run(&selected));
        }
        let progress = RefCell::new(Progress::new(style, &selected, bar));
        let outcomes = verify::run_each(
            &selected,
            || held.signal(),
            |at| {
                progress.borrow_mut().begins(&selected[at]);
                one(chosen[at])
            },
            |outcome| progress.borrow_mut().ends(outcome),
        );
        progress.into_inner().finish();
        outcomes
    }

    /// Writes a dispatch as files.
    fn reproduce(&self, level: Level, check: &str, folder: &Path) -> Result<(), Failure> {
        let mut lines = Vec::new();
        let mut dut = self.open(level, &mut lines)?;
        lines.iter().for_each(|line| say!("{line}"));
        let made = reproduce(&mut dut, check, folder).map_err(|error| match error {
            ReproduceError::NoPass(_) => input(format!("--reproduce {error}")),
            other => failed(other),
        })?;
        say!("{}: {}", made.title, if made.fails { "differs from its reference" } else { "as its reference" });
        if let Some(why) = &made.without_script {
            say!("no script for Amber: {why}");
        }
        say!("written: {} files in {}", made.files.len(), folder.display());
        Ok(())
    }

    /// Runs checks for another process, which asks for them on standard input.
    fn serve(&self, level: Level) -> Result<(), Failure> {
        isolation::tell_calls();
        self.inject_crash.iter().for_each(InjectedCrash::at_start);
        let mut lines = Vec::new();
        let opened = self.open(level, &mut lines).and_then(|dut| {
            let checks = self.checks(&dut, &mut lines)?;
            Ok((dut, checks))
        });
        let (mut dut, checks) = match opened {
            Ok(opened) => opened,
            Err(failure) => return isolation::refuse(failure).map_err(failed),
        };
        let names = checks.iter().map(Check::title).collect();
        let device = machine::device(&dut.context);
        let ready = isolation::Ready { device, validation: dut.watched(), lines, checks: names };
        isolation::serve(&mut dut, &checks, ready).map_err(failed)
    }

    /// The command of a worker: the same device and checks, and nothing that writes files.
    fn worker_command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.args(["verify", "--worker"]);
        for (flag, choice) in [("--device", &self.device), ("--against", &self.against)] {
            match choice {
                None | Some(DeviceChoice::Best) => {}
                Some(DeviceChoice::Number(n)) => drop(command.arg(flag).arg(n.to_string())),
                Some(DeviceChoice::Name(name)) => drop(command.arg(flag).arg(name)),
            }
        }
        let flags = [("--full", self.full), ("--no-validation", self.no_validation)];
        command.args(flags.iter().filter(|(_, is_set)| *is_set).map(|(flag, _)| flag));
        if let Some(crash) = &self.inject_crash {
            command.args(["--inject-crash", crash.text()]);
        }
        // As much log as this process writes.
        match () {
            _ if tracing::enabled!(tracing::Level::DEBUG) => drop(command.arg("-vv")),
            _ if tracing::enabled!(tracing::Level::INFO) => drop(command.arg("-v")),
            _ => {}
        }
        command
    }

    /// All checks of this command, chosen or not. Adds what to print of them to `lines`.
    fn checks(&self, dut: &DeviceUnderTest, lines: &mut Vec<String>) -> Result<Vec<Check>, Failure> {
        let mut checks = match &self.against {
            Some(other) => {
                let other = context(&ContextOptions { device: other.clone(), ..dut.options().clone() })?;
                lines.push(format!("against: {}, {}", other.candidate.name, other.candidate.driver.trim()));
                verify::modes::against(dut.level, &other).map_err(failed)?
            }
            None => verify::checks(dut.level),
        };
        match &self.inject_crash {
            Some(crash) if !crash.inject(&mut checks) => Err(input("--inject-crash: no check has this name")),
            _ => Ok(checks),
        }
    }

    /// Runs the self-test: which check detects each injected fault.
    fn run_self_test(&self, level: Level) -> Result<Run, Failure> {
        let mut lines = Vec::new();
        let dut = self.open(level, &mut lines)?;
        lines.iter().for_each(|line| say!("{line}"));
        let begun = Instant::now();
        let tell = |detection: &Detection| {
            match &detection.by {
                _ if detection.left_out => say!("{}: left out\n    {}", detection.fault, detection.message),
                Some(by) => say!("{}: caught by {by}\n    {}", detection.fault, detection.message),
                None => say!("{}: NOT CAUGHT ({})\n    {}", detection.fault, detection.what, detection.message),
            }
            detection.history().for_each(|line| say!("    {line}"));
        };
        let mut detections = self_test::run(dut.options(), tell).map_err(failed)?;
        let crash = self.crash()?;
        tell(&crash);
        detections.push(crash);
        Ok(dut.run_of(detections.iter().map(Detection::outcome).collect(), begun))
    }

    /// Lets the process of a check crash, as a faulty driver does.
    fn crash(&self) -> Result<Detection, Failure> {
        let program = this_program()?;
        let crash = "segv:known answers / every level of a picture";
        let command = || {
            let mut command = self.worker_command(&program);
            command.args(["--inject-crash", crash]);
            command
        };
        let (mut workers, ready) =
            Workers::start(&command, Duration::from_secs(self.check_timeout), &|| None, Arc::new(|_| ()))?;
        let is_chosen = |check: &CheckName| crash.ends_with(&format!(":{} / {}", check.group, check.name));
        let place = ready.checks.iter().position(is_chosen).ok_or_else(|| failed("there is no check to crash"))?;
        Ok(self_test::crash(&workers.run(place, &ready.checks[place])))
    }

    /// Opens the device, with validation if its layer is installed. Adds what to print of it to `lines`.
    fn open(&self, level: Level, lines: &mut Vec<String>) -> Result<DeviceUnderTest, Failure> {
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
        .map_err(device_failure)
        .and_then(|mut dut| {
            if dut.watched() && !dut.prove_validation().map_err(failed)? {
                let blind = "validation sees nothing here: the layer is active and did not notice a missing barrier; its silence proves nothing";
                lines.push(blind.into());
            }
            let device = &dut.context.candidate;
            let note = if device.is_software() { " (software: no GPU is used)" } else { "" };
            let watched = if dut.watched() { "" } else { "; without the validation layer" };
            lines.push(format!("device: {}{note}, {}{watched}", device.name, device.driver.trim()));
            Ok(dut)
        })
    }

    /// The places of the checks that the flags select.
    fn chosen(&self, checks: &[CheckName]) -> Result<Vec<usize>, Failure> {
        let unknown: Vec<&str> = self
            .only
            .iter()
            .filter(|part| !checks.iter().any(|check| names(part, check)))
            .map(String::as_str)
            .collect();
        match unknown.is_empty() {
            true => Ok((0..checks.len()).filter(|n| self.wants(&checks[*n])).collect()),
            false => {
                Err(input(format!("--only {}: no check has this name; --list prints all names", unknown.join(", "))))
            }
        }
    }

    /// True if this run includes a check of an earlier one.
    fn is_selected(&self, earlier: &Outcome) -> bool {
        (earlier.group == "against") == self.against.is_some() && self.wants(&earlier.check())
    }

    fn wants(&self, check: &CheckName) -> bool {
        let is_filtered = self.gtest_filter.as_ref().is_none_or(|filter| filter.selects(&gtest::full_name(check)));
        is_filtered && (self.only.is_empty() || self.only.iter().any(|part| names(part, check)))
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
        write_if_asked(self.files.json.as_deref(), || run.to_json())?;
        write_if_asked(self.files.junit.as_deref(), || junit::junit(run, compared))?;
        write_if_asked(self.files.html.as_deref(), || html::html(run, compared))?;
        let Some(file) = &self.files.prometheus else { return Ok(()) };
        // Written like those of a live run: node_exporter runs as another user.
        replace_for_all(file, prometheus(run, compared).as_bytes()).map_err(failed)?;
        say!("written: {}", file.display());
        Ok(())
    }

    fn judge(&self, run: &Run, compared: Option<&BaselineComparison>, stopped: Option<&str>) -> Result<(), Failure> {
        if let Some(compared) = compared {
            say!("{}", report::comparison(compared).trim_end());
        }
        if self.gtest_filter.is_some() {
            say!("{}", gtest::ends_run(run).trim_end());
        }
        say!("{}", report::summary(run));
        let files: Vec<_> = run.failures().flat_map(|o| &o.faults).flat_map(|f| &f.files).collect();
        if !files.is_empty() {
            say!("pictures of failures: {} in {}", files.len(), self.pictures.display());
        }
        let worse = compared.filter(|c| c.is_worse()).map_or(0, BaselineComparison::worse_checks);
        let (all, interrupted) = (run.outcomes.len(), run.count(Verdict::Interrupted));
        let rest = if interrupted > 0 { format!("; {interrupted} were not run") } else { String::new() };
        match (run.count(Verdict::Failed), worse) {
            (0, 0) if interrupted == 0 => Ok(()),
            (0, 0) => {
                let signal = stopped.unwrap_or("a signal");
                Err(Failure::Interrupted(format!("{signal} ended the run: {interrupted} of {all} checks were not run")))
            }
            (1, _) if self.bisect && run.is_unstarted() => {
                Err(Failure::Untestable("the device cannot be started".into()))
            }
            (0, worse) => Err(failed(format!("{worse} checks became worse since the baseline{rest}"))),
            (count, _) => Err(failed(format!("{count} of {all} checks failed{rest}"))),
        }
    }
}

/// True if a part of `--only` names a check: as a line of `--list`, or as a part of its group or name.
fn names(part: &str, check: &CheckName) -> bool {
    part == format!("{} / {}", check.group, check.name) || check.group.contains(part) || check.name.contains(part)
}

/// The file of this program, which workers run.
fn this_program() -> Result<PathBuf, Failure> {
    std::env::current_exe().map_err(|e| failed(format!("this program's file is not known: {e}")))
}

/// Reports a signal at once, and `what` it does: the running check may take a minute.
fn announcing_signals<T>(held: &Held, what: &str, work: impl FnOnce() -> T) -> T {
    const OFTEN: Duration = Duration::from_millis(100);
    let (working, works) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while held.signal().is_none() && works.recv_timeout(OFTEN) == Err(RecvTimeoutError::Timeout) {}
            if let Some(signal) = held.signal() {
                say!("{signal}: {what}");
            }
        });
        let done = work();
        drop(working);
        done
    })
}

fn context(options: &ContextOptions) -> Result<Arc<Context>, Failure> {
    Context::new(options).map_err(device_failure)
}

/// A file name made of the letters and digits of a title, of bounded length.
fn file_name(title: &str) -> String {
    let name = gtest::identifier(title).to_ascii_lowercase().replace('_', "-");
    name.chars().take(100).collect::<String>().trim_matches('-').to_string()
}
