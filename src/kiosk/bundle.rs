//! What whoever is to help needs to see, in one archive: the program and the machine, the configuration, and the logs; and nothing of
//! a patient.

use super::config::{self, Config};
use super::log_rotation::{holds_a_log, numbered};
use super::redaction::Redactor;
use crate::scene::load;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Of all files of the log together, the newest, bytes.
const MOST_LOG: u64 = 20 << 20;
/// Files of a log that are looked for.
const MOST_FILES: u32 = 100;
/// Longest text of anything else, bytes.
const LONGEST: usize = 1 << 20;

const ABOUT: &str = "\
What Echolume packed for whoever is to help. All of it is text; have a look before you pass it on.

What is NOT in it: recordings, pictures, volumes or anything that was rendered; names of patients; names of recordings and pictures, and
folders outside of the system's own, for which `<file-1>.mha`, `<path-2>` and `<name-3>` stand, the same for the same name; users and
passwords of addresses; comments of the configuration; the names of this machine and its users.

What stays: addresses such as that of a scanner, the port of a motor, and whatever somebody typed where no file is named, such as a tool.

What is in it:

";

/// The archive as it fills.
pub struct Bundle {
    redactor: Redactor,
    entries: Vec<Entry>,
    /// What the first page says beside the list.
    notes: Vec<String>,
}

struct Entry {
    name: String,
    what: String,
    text: String,
}

impl Bundle {
    /// With what is known of the system, the configuration and the logs that it names. `config`: the usual one where none is given.
    /// Nothing of this fails: what cannot be had is said inside.
    pub fn new(config: Option<&Path>) -> Bundle {
        let mut bundle = Bundle { redactor: Redactor::new(), entries: Vec::new(), notes: Vec::new() };
        let path = config.unwrap_or(Path::new(config::USUAL));
        let text = load::read(path, "configuration").map_err(|error| error.to_string());
        let table = text.as_ref().ok().and_then(|text| toml::from_str::<toml::Table>(text).ok());
        let log = bundle.learn(path, table.as_ref());
        bundle.add("system.txt", "program, system, processor, memory, variables for Vulkan", &system());
        bundle.add_configuration(path, text, table);
        bundle.add_logs(&log);
        bundle
    }

    /// What is private, from a configuration that need not be right; and where the log is.
    fn learn(&mut self, path: &Path, table: Option<&toml::Table>) -> PathBuf {
        let folder = path.parent().unwrap_or(Path::new(""));
        let said = |above: Option<&str>, key: &str| {
            let table = above.map_or(table, |above| table?.get(above)?.as_table());
            Some(table?.get(key)?.as_str()?.to_string())
        };
        if let Some(source) = said(None, "source").filter(|s| s != config::PHANTOM && !s.contains("://")) {
            self.redactor.add_recording(Path::new(&source));
            self.redactor.add_folder(folder.join(&source).parent().unwrap_or(folder));
        }
        for private in [said(Some("files"), "pictures"), said(Some("live"), "record")].into_iter().flatten() {
            self.redactor.add_folder(&folder.join(private));
        }
        said(Some("files"), "log").map_or(config::USUAL_LOG.into(), |log| folder.join(log))
    }

    /// An entry, without the names in it; what is longer than 1 MiB is cut.
    pub fn add(&mut self, name: &str, what: &str, text: &str) {
        let end = text.char_indices().nth(LONGEST).map_or(text.len(), |(end, _)| end);
        self.add_whole(name, what, &text[..end]);
    }

    fn add_whole(&mut self, name: &str, what: &str, text: &str) {
        let text = self.redactor.text(text);
        self.entries.push(Entry { name: name.into(), what: what.into(), text });
    }

    fn add_configuration(&mut self, path: &Path, text: Result<String, String>, table: Option<toml::Table>) {
        let text = match text {
            Ok(text) => text,
            Err(fault) => return self.note(&format!("configuration: {fault}")),
        };
        let written = match &table {
            Some(table) => toml::to_string(table).unwrap_or_else(|e| format!("cannot be shown: {e}\n")),
            // Where nobody can say what is a comment and what a name, only the keys are left.
            None => keys(&text),
        };
        self.add("configuration/as-written.toml", "the file, in order of its keys, without comments", &written);
        match Config::parse(&text, path) {
            Ok(config) => {
                let read = config.to_toml().unwrap_or_else(|e| format!("cannot be shown: {e}\n"));
                self.add(
                    "configuration/as-read.toml",
                    "the same as the program takes it, with what was left out",
                    &read,
                );
            }
            Err(error) => self.add("configuration/refused.txt", "why the program refuses it", &format!("{error}\n")),
        }
    }

    /// The newest of the log and of what rotated away, 20 MiB in all.
    fn add_logs(&mut self, log: &Path) {
        let (mut left, mut found) = (MOST_LOG, false);
        for number in 0..MOST_FILES {
            let file = numbered(log, number);
            if left == 0 || !std::fs::metadata(&file).is_ok_and(|there| there.is_file()) {
                // The one that is written may be between two rotations.
                if number == 0 { continue } else { break }
            }
            found = true;
            let name = numbered(Path::new("logs/echolume.log"), number).to_string_lossy().into_owned();
            if !holds_a_log(&file) {
                self.note(&format!("{name}: {} is no log and was left out", file.display()));
                continue;
            }
            match tail(&file, left) {
                Ok((bytes, cut)) => {
                    left -= left.min(bytes.len() as u64);
                    let what = if cut { "the log, its last part" } else { "the log" };
                    self.add_whole(&name, what, &String::from_utf8_lossy(&bytes));
                }
                Err(error) => self.note(&format!("{name}: {} cannot be read: {error}", file.display())),
            }
        }
        if !found {
            self.note(&format!("logs: there is none at {}", log.display()));
        }
    }

    /// A line of the first page: what is missing, and why.
    pub fn note(&mut self, note: &str) {
        let note = self.redactor.text(&crate::text::printable(note));
        self.notes.push(note);
    }

    /// The archive (.tar.gz), beginning with `README.txt`, which lists the rest.
    ///
    /// # Errors
    /// None that memory does not make.
    pub fn pack(self) -> io::Result<Vec<u8>> {
        let mut about = ABOUT.to_string();
        for Entry { name, what, text } in &self.entries {
            about += &format!("    {name:<32} {:>9} bytes  {what}\n", text.len());
        }
        if !self.notes.is_empty() {
            about += "\nWhat is missing or wrong:\n\n";
            self.notes.iter().for_each(|note| about += &format!("    {note}\n"));
        }
        let first = Entry { name: "README.txt".into(), what: String::new(), text: about };
        let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        for Entry { name, text, .. } in [first].iter().chain(&self.entries) {
            let mut header = tar::Header::new_gnu();
            header.set_size(text.len() as u64);
            header.set_mode(0o644);
            header.set_mtime(now.as_secs());
            archive.append_data(&mut header, Path::new("echolume-support").join(name), text.as_bytes())?;
        }
        archive.into_inner()?.finish()
    }
}

/// The end of a file, from the beginning of a line; and whether anything was left out.
fn tail(path: &Path, most: u64) -> io::Result<(Vec<u8>, bool)> {
    let mut file = File::open(path)?;
    let start = file.metadata()?.len().saturating_sub(most);
    file.seek(SeekFrom::Start(start))?;
    let mut bytes = Vec::new();
    file.take(most).read_to_end(&mut bytes)?;
    if start > 0 {
        let line = bytes.iter().position(|b| *b == b'\n').map_or(bytes.len(), |end| end + 1);
        bytes.drain(..line);
    }
    Ok((bytes, start > 0))
}

/// The tables and keys of what is no TOML, by line.
fn keys(text: &str) -> String {
    let mut said = String::from("# This is no TOML: only its keys are shown.\n");
    for (number, line) in text.lines().enumerate() {
        let key = line.split(['=', '#']).next().unwrap_or("").trim();
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-.[]".contains(c);
        if key.len() < 64 && !key.is_empty() && key.chars().all(plain) && (key.starts_with('[') || line.contains('=')) {
            said += &format!("{}: {key}\n", number + 1);
        }
    }
    said
}

/// Longest file of the system that is read, bytes: of a processor with many cores, the first ones.
const MAX_SYSTEM_FILE: u64 = 64 << 10;
/// How the variables begin that decide what Vulkan does.
const VARIABLES: &[&str] = &["VK_", "LP_", "MESA_", "GALLIVM_"];

/// Program, system, processor, memory, and what is set for Vulkan, one to a line.
pub fn system() -> String {
    let mut said = String::new();
    let mut say = |what: &str, value: Option<String>| {
        // Writing to a text does not fail.
        let _ = writeln!(said, "{what}: {}", value.unwrap_or_else(|| "not told by this system".into()));
    };
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    say("program", Some(format!("{} {} ({build})", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))));
    say("time", Some(humantime::format_rfc3339_seconds(std::time::SystemTime::now()).to_string()));
    say("built for", Some(format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)));
    let kernel = ["ostype", "osrelease", "version"].map(|name| text(&format!("/proc/sys/kernel/{name}")));
    let kernel = kernel.map(|part| part.unwrap_or_default().trim().to_string()).join(" ");
    say("kernel", Some(kernel.trim().to_string()).filter(|kernel| !kernel.is_empty()));
    say("system", text("/etc/os-release").and_then(|text| value(&text, "PRETTY_NAME", '=')));
    say("processor", text("/proc/cpuinfo").and_then(|text| value(&text, "model name", ':')));
    say("cores", std::thread::available_parallelism().ok().map(|cores| cores.to_string()));
    let memory = text("/proc/meminfo").unwrap_or_default();
    say("memory", value(&memory, "MemTotal", ':'));
    say("of it free", value(&memory, "MemAvailable", ':'));
    say("up for", text("/proc/uptime").and_then(|up| Some(format!("{} s", up.split(' ').next()?))));
    let mut set: Vec<_> = std::env::vars_os()
        .map(|(name, value)| (name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned()))
        .filter(|(name, _)| VARIABLES.iter().any(|start| name.starts_with(start)))
        .collect();
    set.sort();
    let _ = writeln!(said, "variables that begin with {}:", VARIABLES.join(", "));
    for (name, value) in &set {
        let _ = writeln!(said, "    {name}={}", value.escape_debug());
    }
    if set.is_empty() {
        said += "    none\n";
    }
    said
}

fn text(path: &str) -> Option<String> {
    let mut bytes = Vec::new();
    File::open(Path::new(path)).ok()?.take(MAX_SYSTEM_FILE).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

/// What a line says that begins with a name.
fn value(text: &str, name: &str, sign: char) -> Option<String> {
    let lines = text.lines().filter_map(|line| line.split_once(sign));
    let mut values = lines.filter(|(left, _)| left.trim() == name).map(|(_, value)| value.trim().trim_matches('"'));
    values.next().map(str::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_long_log_the_end_is_kept_in_whole_lines() {
        let path = std::env::temp_dir().join(format!("echolume-tail-{}", std::process::id()));
        std::fs::write(&path, "2026-01-01T one\ntwo\nthree\n").expect("write");
        assert_eq!(tail(&path, 100).expect("read"), (b"2026-01-01T one\ntwo\nthree\n".to_vec(), false));
        assert_eq!(tail(&path, 8).expect("read"), (b"three\n".to_vec(), true));
        assert_eq!(tail(&path, 3).expect("read"), (Vec::new(), true));
        std::fs::remove_file(&path).expect("remove");
    }

    #[test]
    fn of_what_is_no_toml_nothing_but_keys_is_told() {
        let said = keys("source = \"/data/Anna\n# Anna = 1\n[files]\nlog = 'x' # Anna\nAnna's note\nAnna Smith = 3\n");
        assert!(
            ["1: source\n", "3: [files]\n", "4: log\n"].iter().all(|l| said.contains(l)) && !said.contains("Anna"),
            "{said}"
        );
    }

    #[test]
    fn the_program_and_the_system_are_named_and_the_machine_is_not() {
        let said = system();
        assert!(said.starts_with(&format!("program: echolume {}", env!("CARGO_PKG_VERSION"))), "{said}");
        assert!(
            ["kernel: ", "processor: ", "memory: ", "begin with VK_"].iter().all(|name| said.contains(name)),
            "{said}"
        );
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        assert!(host.trim().len() < 4 || !said.contains(host.trim()), "{said}");
        assert!(!said.contains("PATH="));
    }

    #[test]
    fn values_are_those_of_their_name() {
        let text = "NAME=\"a\"\nPRETTY_NAME=\"Some System 12\"\nodd line\n";
        assert_eq!(value(text, "PRETTY_NAME", '=').as_deref(), Some("Some System 12"));
        assert_eq!(value(text, "none", '='), None);
    }
}
