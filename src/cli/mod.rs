//! Subcommands, logging, and exit codes: 0 done, 1 failed, 2 bad input or usage.

mod devices;
mod info;
mod render;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Prints a line; a closed pipe is not an error worth a panic.
macro_rules! say {
    ($($word:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($word)*);
    }};
}
pub(crate) use say;

#[derive(Parser)]
#[command(
    name = "echolume",
    version,
    about = "Renders sweeps of a 3D/4D ultrasound probe, on Vulkan",
    long_about = "Renders sweeps of a mechanically wobbling 3D/4D ultrasound probe, on Vulkan.\n\n\
                  Try: echolume render sweep.mha -o picture.png --preset fetal\n\
                  Not a medical device."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say more on standard error; twice for every detail
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Write the log to this file instead
    #[arg(long, value_name = "FILE", global = true)]
    log_file: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Render a recording to a picture
    Render(Box<render::Render>),
    /// Say what is in a recording (never who)
    Info(info::Info),
    /// List the Vulkan devices, what each lacks, and which one would be used
    Devices(devices::Devices),
}

/// Why a command ends early, in one line.
#[derive(Debug)]
pub enum Failure {
    /// The input or the command line is wrong: exit code 2.
    Input(String),
    /// It was right and still did not work: exit code 1.
    Failed(String),
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
    let done = start_log(arguments.verbose, arguments.log_file.as_deref()).and_then(|()| match arguments.command {
        Command::Render(render) => render.run(),
        Command::Info(info) => info.run(),
        Command::Devices(devices) => devices.run(),
    });
    let (code, message) = match done {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Failed(message)) => (1, message),
        Err(Failure::Input(message)) => (2, message),
    };
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "echolume: {message}");
    ExitCode::from(code)
}

fn start_log(verbose: u8, file: Option<&std::path::Path>) -> Result<(), Failure> {
    let level = match verbose {
        0 => tracing::Level::WARN,
        1 => tracing::Level::INFO,
        _ => tracing::Level::DEBUG,
    };
    let log = tracing_subscriber::fmt().with_max_level(level).with_target(false);
    match file {
        None => log.without_time().with_writer(std::io::stderr).init(),
        Some(path) => {
            let opened = std::fs::OpenOptions::new().create(true).append(true).open(path);
            let file = opened.map_err(|e| input(format!("{}: cannot be written: {e}", path.display())))?;
            log.with_ansi(false).with_writer(std::sync::Mutex::new(file)).init();
        }
    }
    Ok(())
}
