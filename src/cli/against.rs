//! `profile --against`: two runs that alternate volume by volume, so that other load on the machine and its clocks affect both alike. Each
//! block of volumes is measured by a new pair of processes, so that the layout of memory varies, too.

use crate::baselines::Stored;
use crate::files::WorkFolder;
use crate::profile::Profile;
use crate::profile::compare::{CompareOptions, Comparison, blocks_in_turn, in_turn};
use crate::terminal::{Failure, failed, input, progress_bar, say};
#[cfg(target_os = "linux")]
use rustix::thread::CpuSet;
use std::convert::Infallible;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::str::FromStr;

/// What this program is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum Other {
    Program(PathBuf),
    /// This program with the shaders of this folder.
    Shaders(PathBuf),
    /// This program on another device, by number or name as in `--device`.
    Device(String),
}

impl FromStr for Other {
    type Err = Infallible;

    /// A folder is one of shaders, and a file, or what has the form of a path, a program; anything else is a device.
    fn from_str(text: &str) -> Result<Other, Infallible> {
        let path = Path::new(text);
        Ok(match () {
            _ if path.is_dir() => Other::Shaders(path.into()),
            // A name alone would be looked for in PATH.
            _ if path.is_file() => Other::Program(Path::new(".").join(path)),
            _ if path.components().count() > 1 => Other::Program(path.into()),
            _ => Other::Device(text.into()),
        })
    }
}

/// Options of `profile` that are not passed on, and whether a value follows. They say what is done with the measurements, or are given anew.
const KEPT_BACK: [(&str, bool); 9] = [
    ("--against", true),
    ("--threshold", true),
    ("--minor", true),
    ("--force", false),
    ("--json", true),
    ("--repeat", true),
    ("--warm-up", true),
    ("--no-ceilings", false),
    ("--log-file", true),
];

/// Arguments without these options and their values.
fn without(arguments: impl IntoIterator<Item = OsString>, options: &[(&str, bool)]) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        let text = argument.to_string_lossy();
        match options.iter().find(|(name, _)| text == *name) {
            Some((_, true)) => drop(arguments.next()),
            Some((_, false)) => {}
            None if options
                .iter()
                .any(|(name, _)| text.strip_prefix(name).is_some_and(|rest| rest.starts_with('='))) => {}
            None => kept.push(argument),
        }
    }
    kept
}

/// One of the two runs.
struct Side {
    name: String,
    program: PathBuf,
    arguments: Vec<OsString>,
    blocks: Vec<Profile>,
}

impl Side {
    /// Starts a block of so many volumes, whose profile and errors are written to `folder`.
    fn start(&self, folder: PathBuf, [repeats, warm_up]: [u32; 2]) -> Result<Block, Failure> {
        fs::create_dir_all(&folder).map_err(failed)?;
        let errors = File::create(folder.join(ERRORS)).map_err(failed)?;
        let mut command = Command::new(&self.program);
        command.args(&self.arguments).args(["--in-turn", "--no-ceilings", "--json"]).arg(folder.join(PROFILE));
        command.args(["--repeat", &repeats.to_string(), "--warm-up", &warm_up.to_string()]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(errors);
        let started = command.spawn().map_err(|e| input(format!("--against: {}: {e}", self.program.display())));
        started.map(|child| Block { child, folder })
    }

    /// Waits for the end of a block, and keeps its profile.
    fn finish(&mut self, block: &mut Block) -> Result<(), Failure> {
        let Block { child, folder } = block;
        if let Some(mut rest) = child.stdout.take() {
            std::io::copy(&mut rest, &mut std::io::sink()).map_err(failed)?;
        }
        let status = child.wait().map_err(failed)?;
        if !status.success() {
            let said = fs::read_to_string(folder.join(ERRORS)).unwrap_or_default();
            // Of a wrong command line the first line, otherwise the last.
            let fault = said.lines().find_map(|line| line.strip_prefix("error: ")).or(said.lines().last());
            let fault = fault.map(|line| line.trim_start_matches("echolume: "));
            let why = format!("--against: {}: {}", self.name, fault.unwrap_or(&status.to_string()));
            return Err(match status.code() {
                Some(2) => Failure::Input(why),
                Some(3) => Failure::NoDevice(why),
                _ => Failure::Failed(why),
            });
        }
        self.blocks.push(Profile::load(&folder.join(PROFILE)).map_err(failed)?);
        Ok(())
    }
}

/// Files of a block.
const PROFILE: &str = "profile.json";
const ERRORS: &str = "errors";

/// A process that measures a block.
struct Block {
    child: Child,
    folder: PathBuf,
}

impl Block {
    /// Asks for a volume and waits until it is done. False if the process ended instead.
    fn repeat(&mut self) -> bool {
        let (Some(asks), Some(answers)) = (&mut self.child.stdin, &mut self.child.stdout) else { return false };
        let is_done = |line: std::io::Result<String>| line.is_ok_and(|line| line == DONE);
        // It says nothing else between a question and its answer, so that nothing is lost in the buffer.
        asks.write_all(b"\n").is_ok() && BufReader::new(answers).lines().any(is_done)
    }
}

/// What a process says when a volume is done.
const DONE: &str = "in turn: done";

/// Binds this process, which measures a block, to the last core that it may run on. Otherwise the distribution of threads of a software device and of
/// other load over the cores differs between two processes and stays the same for seconds: alternating volumes would not cancel it, and more volumes
/// would not average it out. Does nothing except on Linux.
pub fn keep_to_one_core() {
    #[cfg(target_os = "linux")]
    if let Ok(cores) = rustix::thread::sched_getaffinity(None)
        && let Some(last) = (0..CpuSet::MAX_CPU).rev().find(|core| cores.is_set(*core))
    {
        let mut one = CpuSet::new();
        one.set(last);
        if let Err(e) = rustix::thread::sched_setaffinity(None, &one) {
            tracing::warn!("--in-turn: stays on all cores: {e}");
        }
    }
}

/// In a process that measures a block: waits for a line on standard input, which requests the next volume.
///
/// # Errors
/// Standard input has ended.
pub fn await_turn() -> Result<(), Failure> {
    match std::io::stdin().read_line(&mut String::new()) {
        Ok(length) if length > 0 => Ok(()),
        _ => Err(failed("--in-turn: standard input ended before all volumes were asked for")),
    }
}

/// In a process that measures a block: reports on standard output that the volume is done.
pub fn end_turn() {
    say!("{DONE}");
}

/// Measures this program with its own arguments and `other` alternately, in the order A B B A, and compares the times. `repeats`: number of measured
/// volumes of each side, at least. They are divided into blocks; only the first block may be larger, because the number of blocks follows from its
/// passes. Each block is a pair of processes, which first draw `warm_up` volumes that are not measured. An error if a process fails or ends early.
pub fn compared(other: &Other, repeats: u32, warm_up: u32, options: &CompareOptions) -> Result<Comparison, Failure> {
    let mut sides = sides(other)?;
    let folder = WorkFolder::new(&std::env::temp_dir(), "echolume-profile-").map_err(failed)?;
    let (mut pairs, mut done) = (blocks_in_turn(0, options.alpha), 0);
    let bar = progress_bar(pairs as u64).with_message("blocks");
    while done < pairs {
        let repeats = repeats.div_ceil(pairs as u32);
        let start = |at: usize| sides[at].start(folder.path().join(at.to_string()), [repeats, warm_up]);
        let mut blocks = [start(0)?, start(1)?];
        for turn in 0..repeats + warm_up {
            let first = (done + turn as usize) % 2;
            for at in [first, 1 - first] {
                if !blocks[at].repeat() {
                    sides[at].finish(&mut blocks[at])?;
                    return Err(failed(format!("--against: {}: ended before its volumes were done", sides[at].name)));
                }
            }
        }
        sides.iter_mut().zip(&mut blocks).try_for_each(|(side, block)| side.finish(block))?;
        done += 1;
        bar.inc(1);
        // The first pair tells how many passes there are.
        let passes = sides.iter().flat_map(|side| &side.blocks).map(|block| block.passes.len()).max();
        pairs = blocks_in_turn(passes.unwrap_or(0), options.alpha);
        bar.set_length(pairs as u64);
    }
    bar.finish_and_clear();
    let [old, new] = &sides;
    in_turn(&old.blocks, &new.blocks, options).map_err(input)
}

/// This program with its own arguments, and the other.
fn sides(other: &Other) -> Result<[Side; 2], Failure> {
    let program = std::env::current_exe().map_err(|e| failed(format!("this program's file is not known: {e}")))?;
    let own = without(std::env::args_os().skip(1), &KEPT_BACK);
    let with = |flag: &str, value: &OsString| {
        let rest = without(own.clone(), &[(flag, true)]);
        [rest, vec![flag.into(), value.clone()]].concat()
    };
    let (name, command, arguments) = match other {
        Other::Program(path) => (path.display().to_string(), path.clone(), own.clone()),
        Other::Shaders(path) => (path.display().to_string(), program.clone(), with("--glsl", &path.into())),
        Other::Device(device) => (device.clone(), program.clone(), with("--device", &device.into())),
    };
    let side = |name, program, arguments| Side { name, program, arguments, blocks: Vec::new() };
    Ok([side("this program".into(), program, own), side(name, command, arguments)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_is_measured_against_is_told_by_its_form() {
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
        assert_eq!(source.parse(), Ok(Other::Shaders(source.into())));
        assert_eq!("./no-such/program".parse(), Ok(Other::Program("./no-such/program".into())));
        assert_eq!("Cargo.toml".parse(), Ok(Other::Program("./Cargo.toml".into())));
        assert_eq!("llvmpipe".parse(), Ok(Other::Device("llvmpipe".into())));
        assert_eq!("1".parse(), Ok(Other::Device("1".into())));
    }

    #[test]
    fn options_of_the_comparison_are_not_passed_on() {
        let given =
            "profile --against a --json=b sweep.mha --json c --force --set ray.step=1 --repeat 3 --glsl d".split(' ');
        let kept = without(given.map(OsString::from), &KEPT_BACK);
        assert_eq!(kept, ["profile", "sweep.mha", "--set", "ray.step=1", "--glsl", "d"].map(OsString::from));
        assert_eq!(without(kept, &[("--glsl", true)]).len(), 4);
    }
}
