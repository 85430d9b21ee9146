//! `profile --against`: two runs in turn, each block of them a process of its own, so that other load on the machine, its clocks and where memory
//! lies affect both alike.

use crate::baselines::Stored;
use crate::files::WorkFolder;
use crate::profile::Profile;
use crate::profile::compare::{CompareOptions, Comparison, blocks_in_turn, in_turn};
use crate::terminal::{Failure, failed, input, progress_bar};
use std::convert::Infallible;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::str::FromStr;

/// What a run is measured against.
#[derive(Clone, Debug, PartialEq)]
pub enum Other {
    Program(PathBuf),
    /// A folder of shaders.
    Shaders(PathBuf),
    /// By number or name, as in `--device`.
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
const KEPT_BACK: [(&str, bool); 8] = [
    ("--against", true),
    ("--threshold", true),
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
    /// Measures a block.
    fn block(&mut self, folder: &Path, [repeats, warm_up]: [u32; 2]) -> Result<(), Failure> {
        let file = folder.join("block.json");
        let mut command = Command::new(&self.program);
        command.args(&self.arguments).arg("--no-ceilings").arg("--json").arg(&file);
        command.args(["--repeat", &repeats.to_string(), "--warm-up", &warm_up.to_string()]);
        command.stdin(Stdio::null()).stdout(Stdio::null());
        let ran = command.output().map_err(|e| input(format!("--against: {}: {e}", self.program.display())))?;
        if !ran.status.success() {
            let said = String::from_utf8_lossy(&ran.stderr);
            let last = said.lines().last().map(|line| line.trim_start_matches("echolume: "));
            let why = format!("--against: {}: {}", self.name, last.unwrap_or(&ran.status.to_string()));
            return Err(match ran.status.code() {
                Some(2) => Failure::Input(why),
                Some(3) => Failure::NoDevice(why),
                _ => Failure::Failed(why),
            });
        }
        self.blocks.push(Profile::load(&file).map_err(failed)?);
        Ok(())
    }
}

/// Measures this program with its own arguments and `other` in turn, A B B A, and compares them. `repeats` in all for each; each block has
/// `warm_up` before its own.
pub fn compared(other: &Other, repeats: u32, warm_up: u32, options: &CompareOptions) -> Result<Comparison, Failure> {
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
    let mut sides = [side("this program".into(), program, own), side(name, command, arguments)];
    let folder = WorkFolder::new(&std::env::temp_dir(), "echolume-profile-").map_err(failed)?;
    let (mut pairs, mut done) = (blocks_in_turn(0, options.alpha), 0);
    let bar = progress_bar(2 * pairs as u64).with_message("blocks");
    while done < pairs {
        let first = done % 2;
        for at in [first, 1 - first] {
            sides[at].block(folder.path(), [repeats.div_ceil(pairs as u32), warm_up])?;
            bar.inc(1);
        }
        done += 1;
        // The first pair tells how many passes there are.
        let passes = sides[0].blocks.iter().chain(&sides[1].blocks).map(|block| block.passes.len()).max();
        pairs = blocks_in_turn(passes.unwrap_or(0), options.alpha);
        bar.set_length(2 * pairs as u64);
    }
    bar.finish_and_clear();
    let [old, new] = &sides;
    in_turn(&old.blocks, &new.blocks, options).map_err(input)
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
