//! The same bits whatever number of threads a software device has: lavapipe reads LP_NUM_THREADS when the device is made, so this very
//! program is started again beside itself.

use super::repeats::digest_of;
use super::{Bench, Found};
use crate::gpu::{Context, GpuError};
use crate::verify::report::{Fault, Figure, Level, Unit};
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What lavapipe takes the number of its threads from. 0: none beside the caller's.
const VARIABLE: &str = "LP_NUM_THREADS";

/// How long one program may take: a machine that is busy needs seconds.
const LONGEST: Duration = Duration::from_secs(120);

/// What the program is started with to print [`super::repeats::digest`] of a device.
pub fn arguments(context: &Context) -> Vec<String> {
    ["verify", "--digest", "--device", &context.candidate.name].map(String::from).into()
}

/// Numbers of threads to try; none is what the driver takes by itself.
fn numbers(level: Level) -> &'static [Option<u32>] {
    match level {
        Level::Quick => &[Some(1), Some(7)],
        Level::Full => &[Some(0), Some(1), Some(2), Some(7), None],
    }
}

pub(super) fn check(bench: &mut Bench) -> Result<Found, GpuError> {
    let candidate = &bench.context.candidate;
    if !candidate.is_software() || !candidate.name.contains("llvmpipe") {
        return Ok(Found::left_out("only lavapipe is told how many threads to have"));
    }
    let Some(program) = bench.program.clone() else {
        return Ok(Found::left_out("this program cannot be started again"));
    };
    let (mut found, expected) = (Found::default(), digest_of(&bench.modes()?));
    let mut compared = 0;
    for number in numbers(bench.level) {
        let said = match begin(&program, &arguments(&bench.context), *number) {
            Ok(child) => end(child),
            Err(fault) => return Ok(Found::left_out(format!("{} does not start: {fault}", program.display()))),
        };
        let threads = number.map_or("as many threads as it likes".into(), |n| format!("{VARIABLE}={n}"));
        match said {
            Err(fault) => found.faults.push(Fault::new(format!("{threads}: {fault}"))),
            Ok(said) => {
                compared += 1;
                found.faults.extend(apart(&expected, &said).map(|what| Fault::new(format!("{threads}: {what}"))));
            }
        }
    }
    let figure = Figure::error("numbers of threads compared", f64::from(compared), 0.0, Unit::Count);
    found.figures.push(Figure { allowed: None, ..figure });
    Ok(found)
}

/// The first mode whose pictures are others.
fn apart(expected: &str, got: &str) -> Option<String> {
    let differ = |(e, g): &(&str, &str)| e != g;
    let pair = expected.lines().zip(got.lines()).find(differ);
    let lines = |text: &str| text.lines().count();
    match pair {
        Some((e, g)) => Some(format!("another picture: expected {e}, got {g}")),
        None if lines(expected) != lines(got) => Some(format!("{} modes of {}", lines(got), lines(expected))),
        None => None,
    }
}

fn begin(program: &Path, arguments: &[String], number: Option<u32>) -> std::io::Result<Child> {
    let mut command = Command::new(program);
    command.args(arguments).env_remove(VARIABLE);
    command.envs(number.map(|n| (VARIABLE, n.to_string())));
    // A signal that a terminal sends to all is for this program to tell of.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
}

/// What it printed, once it has ended well; one that does not end is killed.
fn end(mut child: Child) -> Result<String, String> {
    let begun = Instant::now();
    // A digest is shorter than a pipe holds: the program ends before anyone reads.
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if begun.elapsed() < LONGEST => std::thread::sleep(Duration::from_millis(20)),
            other => {
                let _ = child.kill();
                let _ = child.wait();
                let fault = other.err().map(|e| e.to_string());
                return Err(fault.unwrap_or(format!("not done after {} s, killed", LONGEST.as_secs())));
            }
        }
    };
    let mut said = String::new();
    let read = child.stdout.take().map_or(Ok(0), |mut out| out.read_to_string(&mut said));
    match (status.success(), read) {
        (false, _) => Err(format!("the program beside this one failed: {status}")),
        (true, Err(fault)) => Err(format!("what the program beside this one printed: {fault}")),
        (true, Ok(_)) => Ok(said),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_checksum_a_mode_too_few_and_nothing_are_each_told() {
        let expected = "01 vr\n02 sr\n";
        assert_eq!(apart(expected, expected), None);
        assert_eq!(apart(expected, "01 vr\n03 sr\n").as_deref(), Some("another picture: expected 02 sr, got 03 sr"));
        assert_eq!(apart(expected, "01 vr\n").as_deref(), Some("1 modes of 2"));
        assert_eq!(apart(expected, "").as_deref(), Some("0 modes of 2"));
    }
}
