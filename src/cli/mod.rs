//! The command line: subcommands, logging and exit codes.
//!
//! Exit codes of every command: 0 done, 1 failed, 2 bad input or usage, 3 no Vulkan device. `verify` also returns 4 if a signal stopped it before all
//! was done. `batch` also returns 3 for a lost device and 4 if some units failed. `profile` also returns 5 if the noise may hide a slowdown.

/// What a build without a feature says of what it leaves out.
#[cfg(not(all(feature = "lab", feature = "verify", feature = "view")))]
fn left_out_fault(what: &str, feature: &str) -> Failure {
    input(format!(
        "{what}: this program was built without the feature `{feature}`; build it with `cargo build --release`"
    ))
}

/// A command in a build without its feature: it says how to have it.
#[cfg(not(all(feature = "lab", feature = "verify", feature = "view")))]
macro_rules! left_out {
    ($module:ident, $command:ident, $name:literal) => {
        mod $module {
            use crate::terminal::Failure;
            use std::ffi::OsString;

            #[derive(clap::Args)]
            pub struct $command {
                #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
                _arguments: Vec<OsString>,
            }

            impl $command {
                pub fn run(self) -> Result<(), Failure> {
                    Err(super::left_out_fault(stringify!($module), $name))
                }
            }
        }
    };
}

mod about;
#[cfg(feature = "lab")]
mod against;
#[cfg(feature = "verify")]
mod batch;
#[cfg(feature = "lab")]
mod bounds;
#[cfg(feature = "lab")]
mod budget;
mod compare;
mod drawing;
#[cfg(feature = "lab")]
mod error_report;
#[cfg(feature = "lab")]
mod filter;
#[cfg(feature = "lab")]
mod filter_report;
mod help;
mod machine;
mod mesh;
mod mesh_sheet;
mod one_colour;
#[cfg(feature = "lab")]
mod pipelines;
mod probe;
#[cfg(feature = "lab")]
mod profile;
mod recordings;
mod render;
#[cfg(feature = "lab")]
mod report;
mod segment;
mod series;
mod serve;
mod stic;
mod still;
mod stream;
#[cfg(feature = "lab")]
mod thesis_tables;
#[cfg(feature = "verify")]
mod verify;
#[cfg(feature = "view")]
mod view;
#[cfg(feature = "view")]
mod view_config;
#[cfg(feature = "view")]
mod view_open;
mod worksheet;

/// `--budget` in a build without error reports.
#[cfg(not(feature = "lab"))]
mod budget {
    use super::left_out_fault;
    use crate::passes::PassTime;
    use crate::scene::Scene;
    use crate::terminal::Failure;
    use std::path::Path;

    type Opened = Result<Scene, Failure>;

    pub fn chosen(_: &str, _: &Path, _: impl FnOnce() -> Opened) -> Result<Vec<String>, Failure> {
        Err(left_out_fault("--budget", "lab"))
    }

    pub fn judge(_: &str, _: &[PassTime]) -> Result<(), Failure> {
        Err(left_out_fault("--budget", "lab"))
    }
}
#[cfg(not(feature = "lab"))]
left_out!(filter, Filter, "lab");
#[cfg(not(feature = "lab"))]
left_out!(profile, Profile, "lab");
#[cfg(not(feature = "lab"))]
left_out!(report, Report, "lab");
#[cfg(not(feature = "verify"))]
left_out!(batch, Batch, "verify");
#[cfg(not(feature = "verify"))]
left_out!(verify, Verify, "verify");
#[cfg(not(feature = "view"))]
left_out!(view, View, "view");

use crate::files::signals::hangups;
use crate::files::{self, Lock};
use crate::kiosk::log_rotation::{DEFAULT_FILE_BYTES, DEFAULT_FILES, LateLog, RotatingLog};
use crate::memory;
use crate::source::standard_input;
use crate::sync::locked;
use crate::terminal::{self, Failure, failed, input};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tracing_subscriber::filter::filter_fn;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

#[derive(Parser)]
#[command(
    name = "echolume",
    version,
    propagate_version = true,
    about = "Renders sweeps of a 3D/4D ultrasound probe, on Vulkan",
    long_about = "Renders sweeps of a mechanically wobbling 3D/4D ultrasound probe, on Vulkan.\n\n\
                  Try: echolume render -o face.png\n     echolume render sweep.mha -o picture.png --preset fetal\n\
                  Not a medical device.",
    after_long_help = "Exit codes of every command: 0 done, 1 failed, 2 bad input or usage, 3 no Vulkan device or not the one asked for, 4 \
                       stopped by a signal before all was done (verify). `batch`: also 1, stopped by a signal, 3, device lost, and 4, some units failed. `profile`: also 5, the noise may hide a slowdown. `stream` ends with 0 after a signal, and `probe` as its help says; any other command ends by the signal itself. `-` as a recording \
                       is standard input; `-o -` writes a picture to standard output, and every line to standard error. \
                       ECHOLUME_PROGRESS=lines in the environment writes how far the work is as lines to standard error, for a program that runs this one. \
                       Recordings, pictures, volumes, workspaces and logs can be read by their owner alone; ECHOLUME_PRIVATE=0 lets the umask decide."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Print more on standard error; repeat for every detail
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Write the log to this file. At 10 MiB it is rotated to FILE.1 and so on up to FILE.4; the oldest is deleted
    #[arg(long, value_name = "FILE", global = true)]
    log_file: Option<PathBuf>,
    /// Refuse recordings whose volumes take more memory than this, such as 8G; none: take any [default: half of the memory that this
    /// process may have; info: none]
    #[arg(long, value_name = "SIZE", global = true, value_parser = memory::parse)]
    max_memory: Option<u64>,
}

#[derive(Subcommand)]
enum Command {
    /// Render a recording, or a synthetic fetal head, to a picture
    Render(Box<render::Render>),
    /// Render frames as they arrive: the phantom, a recording, a pipe, a scanner on the network
    Stream(Box<stream::Stream>),
    /// Show live frames in an interactive window or on a kiosk display
    #[cfg_attr(not(feature = "view"), command(hide = true, disable_help_flag = true))]
    View(Box<view::View>),
    /// Run the 2D filters on an ordinary picture, and measure their effect
    #[cfg_attr(not(feature = "lab"), command(hide = true, disable_help_flag = true))]
    Filter(Box<filter::Filter>),
    /// Measure the GPU time of every pass, and compare two such runs
    #[cfg_attr(not(feature = "lab"), command(hide = true, disable_help_flag = true))]
    Profile(Box<profile::Profile>),
    /// Test whether this device and its driver render correctly
    #[cfg_attr(not(feature = "verify"), command(hide = true, disable_help_flag = true))]
    Verify(verify::Verify),
    /// Report error against run time for each dial, proven bounds of a picture, filters compared, or the tables of the thesis
    #[cfg_attr(not(feature = "lab"), command(hide = true, disable_help_flag = true))]
    Report(report::Report),
    /// Write a synthetic sweep: a fetal head, or a body with an exact answer
    Phantom(recordings::MakePhantom),
    /// Resample a volume to a Cartesian grid (.mha, .nrrd), or convert frames
    Convert(recordings::Convert),
    /// Sort the frames of one slow sweep over a beating heart into volumes of one cycle (STIC)
    Stic(stic::Stic),
    /// Write the surface of a recording as a mesh (.stl, .ply, .glb)
    Mesh(mesh::MakeMesh),
    /// Find bodies, label their voxels, and measure their volumes (.seg.nrrd)
    Segment(segment::Segment),
    /// Write the measurements of a workspace as a report, each with its picture (.pdf, .html, .csv)
    Worksheet(Box<worksheet::Worksheet>),
    /// Describe a recording, without patient fields
    Info(recordings::Info),
    /// Render, convert, measure or verify many recordings: one shard of a manifest, to be run on many machines
    #[cfg_attr(not(feature = "verify"), command(hide = true, disable_help_flag = true))]
    Batch(Box<batch::Batch>),
    /// Drive the motor of a probe: home, sweep, stop; or simulate one
    Probe(probe::Probe),
    /// List the Vulkan devices, their missing features, and which one would be used
    Devices(machine::Devices),
    /// Pack versions, devices, configuration and logs for support, without recordings, pictures or names
    SupportBundle(machine::SupportBundle),
    /// Print a script that completes commands and flags in a shell
    Completions(about::Completions),
    /// Write the manual pages
    Man(about::ManPages),
}

/// Parses the command line and runs the command. Returns the exit code of the process.
pub fn run() -> ExitCode {
    let arguments = match parsed() {
        Ok(arguments) => arguments,
        // --help and --version are reported as errors too, but are none.
        Err(error) => return if error.use_stderr() { ExitCode::from(2) } else { ExitCode::SUCCESS },
    };
    // A description needs one frame at a time.
    let all = matches!(arguments.command, Command::Info(_)).then_some(u64::MAX);
    arguments.max_memory.or(all).into_iter().for_each(memory::set_limit);
    let (configured, is_private, is_endless) = arguments.command.of_view();
    if !is_private {
        files::follow_umask();
    }
    let log = start_log(&arguments, configured, is_endless);
    // To the end no other process writes to the log.
    let (lock, log) = log.map_or_else(|failure| (LogLock::default(), Err(failure)), |lock| (lock, Ok(())));
    let log = log.and_then(|()| check_environment());
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
        Command::Stic(stic) => stic.run(),
        Command::Mesh(mesh) => mesh.run(),
        Command::Segment(segment) => segment.run(),
        Command::Worksheet(worksheet) => worksheet.run(),
        Command::Info(info) => info.run(arguments.verbose > 0),
        Command::Batch(batch) => batch.run(),
        Command::Probe(probe) => probe.run(),
        Command::Devices(devices) => devices.run(),
        Command::SupportBundle(bundle) => bundle.run(),
        Command::Completions(completions) => completions.run(help::completed(Arguments::command())),
        Command::Man(pages) => pages.run(help::grouped(Arguments::command())),
    });
    standard_input::forget();
    let done = done.and_then(|()| match terminal::take_write_error() {
        Some(error) => Err(failed(format!("standard output: cannot be written: {error}"))),
        None => Ok(()),
    });
    // The log itself stays open: the process ends before it is dropped.
    *locked(&lock) = None;
    let Err(failure) = done else { return ExitCode::SUCCESS };
    let code = failure.exit_code();
    terminal::remark(&failure.message());
    ExitCode::from(code)
}

/// The arguments of this process. What is wrong with them is printed.
fn parsed() -> Result<Arguments, clap::Error> {
    let is_short = std::env::args_os().any(|word| word == "-h");
    let program = help::grouped(Arguments::command());
    let mut program = if is_short { help::short(program) } else { program };
    let parsed = program.try_get_matches_from_mut(std::env::args_os());
    let arguments = parsed.and_then(|matches| Arguments::from_arg_matches(&matches));
    arguments.inspect_err(|error| {
        // What the standard library says of a number that is none.
        let plain = error.to_string();
        let said = plain
            .replace("invalid float literal", "must be a number")
            .replace("invalid digit found in string", "must be a whole number");
        let _ = if said == plain { error.print() } else { write!(std::io::stderr(), "{said}") };
    })
}

impl Command {
    /// What the viewer asks for, in this order: its log; whether only the user may read the files it writes (otherwise the umask decides); and whether it
    /// runs until it is stopped, so that SIGHUP opens the log again instead of ending it.
    fn of_view(&self) -> (Option<LogPlace>, bool, bool) {
        match self {
            #[cfg(feature = "view")]
            Command::View(view) => (view.log(), view.is_private(), view.is_kiosk()),
            _ => (None, true, false),
        }
    }
}

/// Refuses a variable of the environment that would mean nothing.
fn check_environment() -> Result<(), Failure> {
    match std::env::var_os(files::PRIVATE) {
        Some(value) if value != "0" && value != "1" => {
            Err(input(format!("{}={}: must be 0 or 1", files::PRIVATE, value.display())))
        }
        _ => Ok(()),
    }
}

/// Where a log is written: its path, the size limit of one file in bytes, and the number of files.
type LogPlace = (PathBuf, u64, u32);

/// Time between two tries to open the log of a kiosk.
const LOG_PAUSE: Duration = Duration::from_secs(5);

/// The lock of the log, as soon as it can be locked.
type LogLock = Arc<Mutex<Option<Lock>>>;

/// Opens a log that no other process writes to. A command that is endless, a kiosk, opens it again at SIGHUP instead of ending. A kiosk that cannot
/// open its log logs to standard error until it can: it still shows pictures.
fn open_log((path, bytes, files): LogPlace, is_endless: bool, lock: &LogLock) -> Result<Box<dyn Write + Send>, String> {
    if !is_endless {
        return Ok(Box::new(RotatingLog::open(&path, bytes, files)?));
    }
    let reopens = hangups().map_err(|e| format!("SIGHUP cannot be caught: {e}"))?;
    let lock = lock.clone();
    let open = move || {
        let mut lock = locked(&lock);
        if !lock.as_ref().is_some_and(Lock::is_held) {
            *lock = Some(Lock::take(&path)?);
        }
        Ok(RotatingLog::open(&path, bytes, files)?.reopened(reopens.clone()))
    };
    let log = LateLog::new(open, std::io::stderr(), LOG_PAUSE);
    if let Some(fault) = log.fault() {
        let _ = writeln!(std::io::stderr(), "echolume: log: {fault}; logging to standard error");
    }
    Ok(Box::new(log))
}

/// Starts logging, and locks the log. A command that reports validation messages itself logs them only with `-v`. `configured`: the log that the
/// command's configuration asks for, which `--log-file` overrides.
fn start_log(arguments: &Arguments, configured: Option<LogPlace>, is_endless: bool) -> Result<LogLock, Failure> {
    let (verbose, reports_validation) = (arguments.verbose, matches!(arguments.command, Command::Verify(_)));
    let asked = arguments.log_file.clone().map(|path| (path, DEFAULT_FILE_BYTES, DEFAULT_FILES));
    let (is_asked, place) = (asked.is_some(), asked.or(configured));
    let lock = place.as_ref().map(|(path, ..)| Lock::take(path)).transpose();
    let lock = Arc::new(Mutex::new(lock.map_err(|fault| failed(format!("log {fault}")))?));
    let file = match place.map(|place| open_log(place, is_endless, &lock)).transpose() {
        Err(fault) if is_asked => return Err(input(format!("--log-file {fault}"))),
        // A kiosk without a log still shows pictures.
        Err(fault) => {
            let _ = writeln!(std::io::stderr(), "echolume: log: {fault}; logging to standard error");
            None
        }
        Ok(file) => file,
    };
    let level = match verbose {
        // A service logs its actions.
        0 if is_asked || file.is_none() => tracing::Level::WARN,
        0 | 1 => tracing::Level::INFO,
        _ => tracing::Level::DEBUG,
    };
    let log = tracing_subscriber::fmt().with_max_level(level).with_target(false);
    match file {
        None => {
            let shown = filter_fn(move |event| !reports_validation || verbose > 0 || event.target() != "validation");
            log.without_time()
                .with_ansi(terminal::has_colours())
                .with_writer(std::io::stderr)
                .finish()
                .with(shown)
                .init();
        }
        Some(file) => log.with_ansi(false).with_writer(Mutex::new(file)).init(),
    }
    Ok(lock)
}
