//! Subcommands, logging, and exit codes: 0 done, 1 failed, 2 bad input or usage; of `verify` 3 where there is no device.

mod arriving;
mod asked;
mod convert;
mod devices;
mod driven;
mod filter;
mod info;
mod look;
mod phantom;
mod probe;
mod profile;
mod render;
mod report;
mod report_error;
mod report_tables;
mod serial;
#[cfg(feature = "view")]
mod shown;
mod stream;
mod support_bundle;
mod targets;
mod turns;
mod verify;
#[cfg(feature = "view")]
mod view;
#[cfg(not(feature = "view"))]
#[path = "no_view.rs"]
mod view;

use crate::kiosk::rotating::{self, Rotating};
use clap::{Parser, Subcommand};
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Prints a line on standard output.
macro_rules! say {
    ($($word:tt)*) => { crate::cli::print(format_args!($($word)*)) };
}
pub(crate) use say;

/// What standard output said when it could not be written.
static UNWRITTEN: Mutex<Option<std::io::Error>> = Mutex::new(None);
static UNHEARD: AtomicBool = AtomicBool::new(false);

/// Remembers a failure for the end: whoever reads may go away at any time, but a full disk is no success.
fn print(line: std::fmt::Arguments) {
    let line = harmless(&line.to_string());
    match writeln!(std::io::stdout(), "{line}").and_then(|()| std::io::stdout().flush()) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => UNHEARD.store(true, Ordering::Relaxed),
        Err(error) => drop(UNWRITTEN.lock().unwrap_or_else(|e| e.into_inner()).get_or_insert(error)),
    }
}

/// What was read may hold anything, and must not write to the terminal.
fn harmless(text: &str) -> String {
    let mut lines = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() && c != '\n' { lines.extend(c.escape_default()) } else { lines.push(c) }
    }
    lines
}

/// Whether whoever read standard output has gone away.
fn unheard() -> bool {
    UNHEARD.load(Ordering::Relaxed)
}

#[derive(Parser)]
#[command(
    name = "echolume",
    version,
    about = "Renders sweeps of a 3D/4D ultrasound probe, on Vulkan",
    long_about = "Renders sweeps of a mechanically wobbling 3D/4D ultrasound probe, on Vulkan.\n\n\
                  Try: echolume render -o face.png\n     echolume render sweep.mha -o picture.png --preset fetal\n\
                  Not a medical device."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say more on standard error; twice for every detail
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Write the log to this file instead: 10 MiB, then it becomes FILE.1 and so on to FILE.4, and the oldest goes
    #[arg(long, value_name = "FILE", global = true)]
    log_file: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Render a recording, or without one a synthetic fetal head, to a picture
    Render(Box<render::Render>),
    /// Render frames as they arrive: the phantom, a recording, a pipe, a scanner on the network
    Stream(Box<stream::Stream>),
    /// Show them on a screen, to be turned by hand
    #[cfg_attr(not(feature = "view"), command(hide = true, disable_help_flag = true))]
    View(Box<view::View>),
    /// Run the 2D filters on an ordinary picture, and measure what they do
    Filter(Box<filter::Filter>),
    /// Say where the time goes, pass by pass, and compare two such runs
    Profile(Box<profile::Profile>),
    /// Say whether this device and its driver still draw what they should
    Verify(verify::Verify),
    /// Report error against run time, dial by dial, or the thesis' tables of times
    Report(report::Report),
    /// Write a synthetic sweep: a fetal head, or a body with an exact answer
    Phantom(phantom::MakePhantom),
    /// Write a volume of a sweep on a Cartesian lattice (.mha, .nrrd)
    Convert(convert::Convert),
    /// Say what is in a recording (never who)
    Info(info::Info),
    /// Drive the motor of a probe: home, sweep, stop; or simulate one
    Probe(probe::Probe),
    /// List the Vulkan devices, what each lacks, and which one would be used
    Devices(devices::Devices),
    /// Pack versions, devices, configuration and logs for whoever is to help; no recordings, no pictures, no names
    SupportBundle(support_bundle::SupportBundle),
}

/// Why a command ends early, in one line.
#[derive(Debug)]
pub enum Failure {
    /// The input or the command line is wrong: exit code 2.
    Input(String),
    /// It was right and still did not work: exit code 1.
    Failed(String),
    /// `verify` has no device to look at: exit code 3.
    NoDevice(String),
}

impl Failure {
    pub fn message(self) -> String {
        let (Failure::Input(message) | Failure::Failed(message) | Failure::NoDevice(message)) = self;
        message
    }
}

pub fn input(error: impl std::fmt::Display) -> Failure {
    Failure::Input(error.to_string())
}

pub fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(error.to_string())
}

/// Parses the command line and runs it.
pub fn run() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let _ = error.print();
            // Help and version are no errors.
            return if error.use_stderr() { ExitCode::from(2) } else { ExitCode::SUCCESS };
        }
    };
    let finds = matches!(arguments.command, Command::Verify(_));
    let log = start_log(arguments.verbose, arguments.log_file.as_deref(), arguments.command.log(), finds);
    let done = log.and_then(|()| match arguments.command {
        Command::Render(render) => render.run(),
        Command::Stream(stream) => stream.run(),
        Command::View(view) => view.run(),
        Command::Filter(filter) => filter.run(),
        Command::Profile(profile) => profile.run(),
        Command::Verify(verify) => verify.run(),
        Command::Report(report) => report.run(),
        Command::Phantom(phantom) => phantom.run(),
        Command::Convert(convert) => convert.run(),
        Command::Info(info) => info.run(),
        Command::Probe(probe) => probe.run(),
        Command::Devices(devices) => devices.run(),
        Command::SupportBundle(bundle) => bundle.run(),
    });
    let done = done.and_then(|()| match UNWRITTEN.lock().unwrap_or_else(|e| e.into_inner()).take() {
        Some(error) => Err(Failure::Failed(format!("standard output: cannot be written: {error}"))),
        None => Ok(()),
    });
    let Err(failure) = done else { return ExitCode::SUCCESS };
    let code = match failure {
        Failure::Failed(_) => 1,
        Failure::Input(_) => 2,
        Failure::NoDevice(_) => 3,
    };
    let _ = writeln!(std::io::stderr(), "echolume: {}", plain(&failure.message()));
    ExitCode::from(code)
}

/// One line of bounded length: what was typed or read may hold anything, and must not write to the terminal.
fn plain(message: &str) -> String {
    const LONGEST: usize = 600;
    let line = harmless(&message.chars().take(LONGEST).collect::<String>()).replace('\n', "\\n");
    if message.chars().nth(LONGEST).is_some() { line + " ..." } else { line }
}

impl Command {
    /// A log that the command's own configuration asks for: its file, bytes of one, and how many.
    fn log(&self) -> Option<(PathBuf, u64, u32)> {
        match self {
            Command::View(view) => view.log(),
            _ => None,
        }
    }
}

/// With `finds`, what validation says is part of what the command finds and not logged beside it.
fn start_log(
    verbose: u8,
    file: Option<&std::path::Path>,
    configured: Option<(PathBuf, u64, u32)>,
    finds: bool,
) -> Result<(), Failure> {
    let level = match verbose {
        0 => tracing::Level::WARN,
        1 => tracing::Level::INFO,
        _ => tracing::Level::DEBUG,
    };
    let log = tracing_subscriber::fmt().with_max_level(level).with_target(false);
    // A cart that cannot log shows pictures all the same.
    let configured = configured.filter(|_| file.is_none()).and_then(|(path, bytes, files)| {
        let opened = Rotating::open(&path, bytes, files);
        opened.inspect_err(|fault| drop(writeln!(std::io::stderr(), "echolume: log: {fault}; it goes here"))).ok()
    });
    if let Some(file) = configured {
        // What a service does is worth its lines.
        let level = level.max(tracing::Level::INFO);
        tracing_subscriber::fmt()
            .with_max_level(level)
            .with_target(false)
            .with_ansi(false)
            .with_writer(Mutex::new(file))
            .init();
        return Ok(());
    }
    match file {
        None => {
            let told = filter_fn(move |what| !finds || verbose > 0 || what.target() != "validation");
            log.without_time().with_writer(std::io::stderr).finish().with(told).init();
        }
        Some(path) => {
            let file = Rotating::open(path, rotating::USUAL_BYTES, rotating::USUAL_FILES);
            let file = file.map_err(|fault| input(format!("--log-file {fault}")))?;
            log.with_ansi(false).with_writer(Mutex::new(file)).init();
        }
    }
    Ok(())
}
