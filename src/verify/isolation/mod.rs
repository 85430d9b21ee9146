//! Runs checks in separate processes. A worker process runs one check after another. If it crashes or exceeds the time limit, the check
//! that it ran has failed, and a new worker continues with the next. The main process loads no driver.

mod injection;
mod worker;

pub use injection::InjectedCrash;
pub use worker::{Ready, refuse, serve, tell_calls};

use crate::files::signals;
use crate::report::{CheckName, Outcome, Verdict};
use crate::sync::locked;
use crate::terminal::Failure;
use crate::text::single_line;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use worker::{Message, Request};

/// The longest time limit of the start of a worker.
const START: Duration = Duration::from_secs(600);
/// The shortest: it does more than most checks.
const LEAST_START: Duration = Duration::from_secs(60);
/// How often a wait looks for signals.
const OFTEN: Duration = Duration::from_millis(50);
/// How long a worker that is not needed any more may take to end.
const FAREWELL: Duration = Duration::from_secs(5);
/// How long the output of a worker that has ended may take to arrive.
const LAST_WORDS: Duration = Duration::from_millis(500);
/// How many lines of a crashed worker's output the report quotes.
const LINES: usize = 4;
/// How many workers in a row may fail to start before no more are started.
const MAX_STARTS: u32 = 3;

/// A function that returns the name of the first signal that asked this process to end; None if none has.
pub type Signal<'a> = &'a dyn Fn() -> Option<&'static str>;
/// A function that prints a line that a worker wrote and that is not a message to this process.
pub type Echo = Arc<dyn Fn(&str) + Send + Sync>;

/// Runs checks in worker processes, one at a time. A worker that crashes is replaced.
pub struct Workers<'a> {
    /// The command of a worker.
    command: &'a dyn Fn() -> Command,
    /// Time limit of a check.
    limit: Duration,
    signal: Signal<'a>,
    echo: Echo,
    current: Option<Worker>,
    failed_starts: u32,
}

impl<'a> Workers<'a> {
    /// Starts the first worker with `command`, and waits until it has opened the device. `limit` is the time limit of a check, and of this start, for
    /// which it is at least one minute and at most ten. `signal` is called repeatedly during every wait, which ends once it returns a name. `echo`
    /// gets each line that a worker prints and that is not a message to this process.
    ///
    /// # Errors
    /// The program cannot be started, refuses its arguments, finds no device or does not open it in time, the driver crashes when it is opened, or a
    /// signal came.
    pub fn start(
        command: &'a dyn Fn() -> Command,
        limit: Duration,
        signal: Signal<'a>,
        echo: Echo,
    ) -> Result<(Workers<'a>, Ready), Failure> {
        let mut workers = Workers { command, limit, signal, echo, current: None, failed_starts: 0 };
        let ready = workers.renew()?;
        Ok((workers, ready))
    }

    /// Time limit of the start of a worker: it opens the device and proves that validation sees something.
    fn start_limit(&self) -> Duration {
        self.limit.clamp(LEAST_START, START)
    }

    fn renew(&mut self) -> Result<Ready, Failure> {
        let failed = |why: String| Failure::Failed(format!("the process that runs the checks {why}"));
        let mut worker = Worker::spawn(&mut (self.command)(), &self.echo).map_err(failed)?;
        match worker.receive(self.start_limit(), self.signal) {
            Ok(Message::Ready(ready)) => {
                self.current = Some(worker);
                Ok(*ready)
            }
            Ok(Message::Refused { code: 2, message }) => Err(Failure::Input(message)),
            Ok(Message::Refused { code: 3, message }) => Err(Failure::NoDevice(message)),
            Ok(Message::Refused { message, .. }) => Err(Failure::Failed(message)),
            Ok(Message::Done(_) | Message::Calls(..)) => Err(failed("answered before it was asked".into())),
            Err(Ended::BySignal(signal)) => Err(Failure::Interrupted(format!("{signal} ended the run"))),
            Err(Ended::Late) => {
                Err(failed(format!("had no device after {} s{}", self.start_limit().as_secs(), worker.in_call())))
            }
            Err(Ended::Itself { how, .. }) => Err(failed(format!("{how}{} before the first check", worker.in_call()))),
        }
    }

    /// Runs the check with index `place` in [`Ready::checks`] in a worker. `name`: its name, for an outcome if the worker fails. A check whose
    /// process crashes is run up to three times more in new workers, and passes, marked as flaky, once it passes.
    pub fn run(&mut self, place: usize, name: &CheckName) -> Outcome {
        let (first, has_crashed) = self.attempt(Request { place, waits: false }, name);
        // What failed without a crash the worker has run again itself.
        if !has_crashed {
            return first;
        }
        let workers = RefCell::new(self);
        let run = |waits| workers.borrow_mut().attempt(Request { place, waits }, name).0;
        first.explained(|| run(false), || run(true))
    }

    /// The outcome of one run, and whether its process crashed.
    fn attempt(&mut self, request: Request, name: &CheckName) -> (Outcome, bool) {
        let begun = Instant::now();
        let failed = |why: String| Outcome::unrun(name, Verdict::Failed, why);
        if self.current.is_none() {
            if self.failed_starts >= MAX_STARTS {
                return (failed(format!("not run: {MAX_STARTS} processes in a row had no device")), false);
            }
            match self.renew() {
                Ok(_) => self.failed_starts = 0,
                Err(Failure::Interrupted(why)) => {
                    return (Outcome::unrun(name, Verdict::Interrupted, format!("not run: {why}")), false);
                }
                Err(why) => {
                    self.failed_starts += 1;
                    return (failed(format!("not run: {}", why.message())), false);
                }
            }
        }
        let Some(mut worker) = self.current.take() else {
            return (failed("not run: there is no process".into()), false);
        };
        let reply = worker.ask(&request).and_then(|()| worker.receive(self.limit, self.signal));
        let mut has_crashed = false;
        let outcome = match reply {
            Ok(Message::Done(done)) => {
                self.current = Some(worker);
                let (outcome, mut pictures) = *done;
                pictures
                    .retain(|shown| [&shown.actual, &shown.expected, &shown.difference].iter().all(|p| p.width > 0));
                return (Outcome { pictures, ..outcome }, false);
            }
            Ok(_) => failed("the process that ran it answered something else".into()),
            Err(Ended::BySignal(signal)) => {
                Outcome::unrun(name, Verdict::Interrupted, format!("not to its end: {signal}"))
            }
            Err(Ended::Late) => {
                let call = worker.in_call();
                failed(format!("did not end within {} s{call}; its process was killed", self.limit.as_secs()))
            }
            // Whoever ends all processes of a service ends the worker, too.
            Err(Ended::Itself { by: Some(signal @ ("SIGINT" | "SIGTERM" | "SIGHUP")), .. }) => {
                Outcome::unrun(name, Verdict::Interrupted, format!("its process was ended by {signal}"))
            }
            Err(Ended::Itself { how, said, .. }) => {
                has_crashed = true;
                let mut outcome = failed(format!("its process {how}{}", worker.in_call()));
                outcome.notes.extend(said.iter().map(|line| format!("its output: {line}")));
                outcome
            }
        };
        (Outcome { seconds: begun.elapsed().as_secs_f64(), ..outcome }, has_crashed)
    }
}

/// Why a worker gave no answer.
enum Ended {
    /// This process was asked to end; the worker was killed.
    BySignal(&'static str),
    /// The time limit passed; the worker was killed.
    Late,
    /// The worker ended.
    Itself {
        /// In words, after "the process".
        how: String,
        by: Option<&'static str>,
        /// Its last lines.
        said: Vec<String>,
    },
}

struct Worker {
    child: Child,
    requests: Option<ChildStdin>,
    /// The last Vulkan call that began.
    call: Option<String>,
    replies: Receiver<Message>,
    said: Arc<Mutex<VecDeque<String>>>,
    readers: Vec<JoinHandle<()>>,
}

impl Worker {
    fn spawn(command: &mut Command, echo: &Echo) -> Result<Worker, String> {
        #[cfg(unix)]
        {
            // Ctrl-C reaches all processes of a group: this one decides what it means.
            use std::os::unix::process::CommandExt;
            command.process_group(0);
        }
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().map_err(|e| format!("cannot be started: {e}"))?;
        let (send, replies) = mpsc::channel();
        let said = Arc::new(Mutex::new(VecDeque::new()));
        let other = |said: &Arc<Mutex<VecDeque<String>>>| {
            let (said, echo) = (said.clone(), echo.clone());
            move |line: &str| {
                echo(line);
                let mut said = locked(&said);
                said.push_back(single_line(line));
                if said.len() > LINES {
                    said.pop_front();
                }
            }
        };
        let (of_stdout, of_stderr) = (other(&said), other(&said));
        let mut readers = Vec::new();
        readers.extend(child.stdout.take().map(|out| {
            read_lines(out, move |line| match Message::parse(line) {
                // Nobody listens any more once the worker is given up.
                Some(message) => drop(send.send(message)),
                None if line.trim().is_empty() => {}
                None => of_stdout(line),
            })
        }));
        readers.extend(child.stderr.take().map(|err| read_lines(err, of_stderr)));
        Ok(Worker { requests: child.stdin.take(), call: None, child, replies, said, readers })
    }

    /// The last call that began, to end a sentence with.
    fn in_call(&self) -> String {
        self.call.as_ref().map_or_else(String::new, |call| format!(" in {call}"))
    }

    fn ask(&mut self, request: &Request) -> Result<(), Ended> {
        self.call = None;
        let requests = self.requests.as_mut();
        match requests.map(|to| writeln!(to, "{}", request.line()).and_then(|()| to.flush())) {
            Some(Ok(())) => Ok(()),
            _ => Err(self.ended()),
        }
    }

    fn receive(&mut self, limit: Duration, signal: Signal) -> Result<Message, Ended> {
        let begun = Instant::now();
        loop {
            match self.replies.recv_timeout(OFTEN) {
                Ok(message) => match message.call() {
                    Some(call) => self.call = Some(call),
                    None => return Ok(message),
                },
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(match signal() {
                        Some(signal) => self.killed(Ended::BySignal(signal)),
                        None => self.ended(),
                    });
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Some(signal) = signal() {
                return Err(self.killed(Ended::BySignal(signal)));
            }
            if begun.elapsed() > limit {
                return Err(self.killed(Ended::Late));
            }
        }
    }

    fn killed(&mut self, why: Ended) -> Ended {
        self.end(Duration::ZERO);
        why
    }

    /// How the worker ended by itself.
    fn ended(&mut self) -> Ended {
        // Its output is closed, so it has ended or will at once.
        let status = self.end(LAST_WORDS);
        let begun = Instant::now();
        while begun.elapsed() < LAST_WORDS && !self.readers.iter().all(JoinHandle::is_finished) {
            std::thread::sleep(Duration::from_millis(5));
        }
        let said = locked(&self.said).iter().cloned().collect();
        let (how, by) = status.map_or(("ended".into(), None), in_words);
        Ended::Itself { how, by, said }
    }

    /// Waits so long for the worker to end, then kills it.
    fn end(&mut self, patience: Duration) -> Option<ExitStatus> {
        self.requests = None;
        let begun = Instant::now();
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if begun.elapsed() < patience => std::thread::sleep(Duration::from_millis(5)),
                _ => break,
            }
        }
        // An error means that it has ended.
        let _ = self.child.kill();
        self.child.wait().ok()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.end(FAREWELL);
    }
}

/// Calls `each` with every line of a stream, on a thread of its own.
fn read_lines(from: impl Read + Send + 'static, each: impl Fn(&str) + Send + 'static) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut from = BufReader::new(from);
        let mut line = Vec::new();
        while from.read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
            each(String::from_utf8_lossy(&line).trim_end_matches(['\n', '\r']));
            line.clear();
        }
    })
}

/// How a process ended, and the name of the signal that ended it.
fn in_words(status: ExitStatus) -> (String, Option<&'static str>) {
    #[cfg(unix)]
    {
        use std::os::unix::process::ExitStatusExt;
        if let Some(signal) = status.signal() {
            let name = signals::name_of(signal);
            return (format!("was ended by signal {signal} ({})", name.unwrap_or("no name")), name);
        }
    }
    (format!("ended with exit code {}", status.code().unwrap_or(-1)), None)
}
