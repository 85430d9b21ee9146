//! Running the program.

pub use super::files::*;
use std::fs;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_echolume");

impl Folder {
    /// A refused rendering keeps the old picture and writes no other file.
    pub fn refuses(&self, arguments: &[&str], named: &[&str]) {
        self.refuses_with(2, arguments, named);
    }

    /// The same with another exit code.
    pub fn refuses_with(&self, code: i32, arguments: &[&str], named: &[&str]) {
        let old = self.write("old.png", "old");
        let (all, before) = ([&["render"], arguments, &["-o", &old]].concat(), self.names());
        refuses(&all, &run(&all), code, named);
        assert_eq!(fs::read(&old).expect("the old picture is still there"), b"old", "{all:?}");
        assert_eq!(self.names(), before, "{all:?}");
    }
}

/// The program, with the default action of each signal: whoever runs the tests may ignore one, as `nohup` does, and a shell ignores
/// SIGINT for what it starts in the background.
pub fn with_default_signals() -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal=INT,TERM,HUP", PROGRAM]);
    command
}

/// Hides every Vulkan device from a command.
pub fn without_device(command: &mut Command) -> &mut Command {
    command
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env_remove("VK_ADD_DRIVER_FILES")
}

/// Exit code, standard output and standard error.
pub type Ran = (Option<i32>, String, String);

/// Time after which a program hangs: the longest takes a minute and a half alone.
const HANGS: Duration = Duration::from_secs(900);

/// Starts a program without an input, and with its output in pipes.
pub fn start(command: &mut Command) -> Child {
    let piped = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    piped.spawn().expect("start the program")
}

/// Runs a program to its end. One that hangs is killed and fails the test, instead of keeping all of them for ever.
pub fn finish(command: &mut Command) -> Ran {
    fn read(mut from: impl Read + Send + 'static) -> std::thread::JoinHandle<String> {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            from.read_to_end(&mut bytes).expect("read what it printed");
            String::from_utf8_lossy(&bytes).into_owned()
        })
    }
    let mut child = start(command);
    let (out, err) = (read(child.stdout.take().expect("piped")), read(child.stderr.take().expect("piped")));
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("wait for the program") {
            break status;
        }
        if begun.elapsed() > HANGS {
            child.kill().expect("kill the program");
            panic!("does not end within {HANGS:?}: {command:?}");
        }
        super::wait::poll();
    };
    (status.code(), out.join().expect("text"), err.join().expect("text"))
}

pub fn run(arguments: &[&str]) -> Ran {
    finish(Command::new(PROGRAM).args(arguments))
}

/// Runs the program, which must succeed. Returns its standard output.
pub fn done(arguments: &[&str]) -> String {
    let (code, out, err) = run(arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {err}");
    out
}

pub fn render(input: &str, output: &str, more: &[&str]) -> String {
    done(&[&["render", input, "-o", output, "--size", "64x48"], more].concat())
}

pub fn explain(input: &str, more: &[&str]) -> String {
    done(&[&["render", input, "--explain"], more].concat())
}

pub fn refuses(what: &[&str], (code, _, err): &Ran, wanted: i32, named: &[&str]) {
    let said = format!("{what:?} ended with {code:?} and said {err:?}, not {wanted} and {named:?}");
    let line = err.strip_suffix('\n').unwrap_or(err);
    assert!(*code == Some(wanted) && named.iter().all(|n| line.contains(n)), "{said}");
    let plain = !line.chars().any(char::is_control) && line.len() < 1000;
    assert!(plain && line.starts_with("echolume: "), "not one plain line: {said}");
}

pub fn png_size(path: &str) -> [u32; 2] {
    let bytes = fs::read(path).expect("read the picture");
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{path} is no PNG");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

/// The first word after `start` of each line that begins with it.
pub fn first_words(text: &str, start: &str) -> Vec<String> {
    let lines = text.lines().filter_map(|l| l.strip_prefix(start));
    lines.filter_map(|l| l.split_whitespace().next()).map(str::to_string).collect()
}
