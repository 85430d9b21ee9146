//! Output of a command: lines on standard output, and the line on standard error that ends a failed command.

use crate::progress_lines;
use crate::sync::locked;
use crate::text::without_control_characters;
use indicatif::ProgressBar;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Longest message of a failure, characters.
const MAX_MESSAGE: usize = 600;

/// The first error of writing to standard output.
static WRITE_ERROR: Mutex<Option<std::io::Error>> = Mutex::new(None);
/// True once the reader of standard output has closed it.
static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// True once standard output carries data: lines then go to standard error.
static IS_DATA: AtomicBool = AtomicBool::new(false);

/// Prints one line as `terminal::print` does: on standard output, or on standard error once standard output carries data. Takes the arguments of
/// `format!`.
#[macro_export]
macro_rules! say {
    ($($word:tt)*) => { $crate::terminal::print(format_args!($($word)*)) };
}
pub use say;

/// Why a command ends early, in one line.
#[derive(Debug)]
pub enum Failure {
    /// The input or the command line is wrong: exit code 2.
    Input(String),
    /// The request was valid but could not be carried out: exit code 1.
    Failed(String),
    /// No usable Vulkan device was found, or not the requested one, or `batch` lost its device: exit code 3.
    NoDevice(String),
    /// A signal ended the work early, and nothing had failed until then: exit code 4.
    Interrupted(String),
    /// Some units of a `batch` failed, and the others are done: exit code 4.
    SomeFailed(String),
    /// `profile --compare` or `--against`: the noise may hide a slowdown above the threshold: exit code 5.
    CannotTell(String),
    /// `verify --bisect` has no device to check: exit code 125, by which `git bisect run` skips a version.
    Untestable(String),
}

impl Failure {
    /// Why the command ends, in one line, without the variant, which decides the exit code.
    pub fn message(self) -> String {
        let (Failure::Input(message)
        | Failure::Failed(message)
        | Failure::NoDevice(message)
        | Failure::Interrupted(message)
        | Failure::SomeFailed(message)
        | Failure::CannotTell(message)
        | Failure::Untestable(message)) = self;
        message
    }

    /// The exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Failed(_) => 1,
            Failure::Input(_) => 2,
            Failure::NoDevice(_) => 3,
            Failure::Interrupted(_) | Failure::SomeFailed(_) => 4,
            Failure::CannotTell(_) => 5,
            Failure::Untestable(_) => 125,
        }
    }
}

/// The failure that the input or the command line is wrong.
pub fn input(error: impl std::fmt::Display) -> Failure {
    Failure::Input(error.to_string())
}

/// The failure that a valid request could not be carried out.
pub fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Failed(error.to_string())
}

/// Prints a line on standard output, with control characters escaped. A write error is kept for [`take_write_error`], to be reported when the
/// command ends: a reader may close the pipe at any time, but a full disk is a failure. Once standard output carries data
/// ([`keep_standard_output`]), the line goes to standard error.
pub fn print(line: std::fmt::Arguments) {
    let line = without_control_characters(&line.to_string());
    if IS_DATA.load(Ordering::Relaxed) {
        let _ = writeln!(std::io::stderr(), "{line}");
        return;
    }
    write(format!("{line}\n").as_bytes());
}

/// Keeps standard output for data: lines go to standard error from here on.
///
/// # Errors
/// Standard output is a terminal.
pub fn keep_standard_output() -> Result<(), &'static str> {
    if std::io::stdout().is_terminal() {
        return Err("standard output is a terminal; send it to a file or a pipe");
    }
    IS_DATA.store(true, Ordering::Relaxed);
    Ok(())
}

/// Writes bytes to standard output unchanged. A write error is kept for [`take_write_error`]; that the reader closed the pipe is none
/// ([`is_closed`]).
pub fn write(bytes: &[u8]) {
    match std::io::stdout().write_all(bytes).and_then(|()| std::io::stdout().flush()) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => IS_CLOSED.store(true, Ordering::Relaxed),
        Err(error) => drop(locked(&WRITE_ERROR).get_or_insert(error)),
    }
}

/// Prints a warning, or why the command ends, on standard error as one line. The exit code is the caller's.
pub fn remark(message: &str) {
    let _ = writeln!(std::io::stderr(), "echolume: {}", single_line(message));
}

/// True if standard error is a terminal that has colours and a cursor that can be moved, and the user did not refuse colours (NO_COLOR).
pub fn has_colours() -> bool {
    std::io::stderr().is_terminal() && !is_dumb() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|name| name == "dumb")
}

/// A progress bar up to `count` on standard error. It draws only on a terminal that can move its cursor. If progress lines are requested,
/// it writes those instead.
pub fn progress_bar(count: u64) -> ProgressBar {
    if progress_lines::is_asked() {
        return progress_lines::bar(count);
    }
    if is_dumb() { ProgressBar::hidden() } else { ProgressBar::new(count) }
}

/// Does work of `count` steps while a [`progress_bar`] shows how many of them are done. `what`: the steps, such as `slices`. `work` gets a function,
/// which it calls after each step. The bar is cleared at the end, also after an error.
pub fn with_progress<T>(count: u64, what: &'static str, work: impl FnOnce(&dyn Fn()) -> T) -> T {
    let bar = progress_bar(count).with_message(what);
    let done = work(&|| bar.inc(1));
    bar.finish_and_clear();
    done
}

/// True if the process that reads standard output has closed the pipe.
pub fn is_closed() -> bool {
    IS_CLOSED.load(Ordering::Relaxed)
}

/// Takes the first error of writing to standard output since the last call; None if there was none. That the reader closed the pipe is no
/// such error ([`is_closed`]).
pub fn take_write_error() -> Option<std::io::Error> {
    locked(&WRITE_ERROR).take()
}

/// `message` as one line of at most [`MAX_MESSAGE`] characters.
fn single_line(message: &str) -> String {
    let start: String = message.chars().take(MAX_MESSAGE).collect();
    let line = without_control_characters(&start).replace('\n', "\\n");
    if message.chars().nth(MAX_MESSAGE).is_some() { line + " ..." } else { line }
}
