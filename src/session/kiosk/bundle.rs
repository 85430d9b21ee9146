//! The support bundle: one archive with information about program and machine, the configuration and the logs, but without patient data.

use super::config::{self, Config};
use super::log_rotation::{is_log_file, rotated_name};
use super::redaction::Redactor;
use crate::machine;
use crate::scene::load;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Largest size of all logs together, bytes; the newest ones are kept.
const MAX_LOG_BYTES: u64 = 20 << 20;
/// Largest number of log files.
const MAX_LOG_FILES: u32 = 100;
/// Largest size of any other text, bytes.
const MAX_ENTRY: usize = 1 << 20;

const ABOUT: &str = "\
A support bundle of Echolume. All of it is text; check it before you pass it on.

It does NOT contain recordings, pictures, volumes or anything that was rendered; names of patients; names of recordings and pictures, and
folders outside of the system folders, which are replaced by `<file-1>.mha`, `<path-2>` and `<name-3>` (the same for the same name); users
and passwords of addresses; comments of the configuration; the names of this machine and its users.

It does contain addresses such as that of a scanner, the port of a motor, and text that is not a file name, such as a tool.

Contents:

";

/// A support bundle that is being collected: an archive of redacted texts for whoever analyses a fault.
pub struct Bundle {
    redactor: Redactor,
    entries: Vec<Entry>,
    /// Notes for the README, after the list of contents.
    notes: Vec<String>,
}

struct Entry {
    name: String,
    description: String,
    text: String,
}

impl Bundle {
    /// Collects the system information, the configuration and its logs. `config`: path of the configuration, or None for the default one. It
    /// never fails: what cannot be read is noted in the bundle.
    pub fn new(config: Option<&Path>) -> Bundle {
        let mut bundle = Bundle { redactor: Redactor::new(), entries: Vec::new(), notes: Vec::new() };
        let path = config.unwrap_or(Path::new(config::DEFAULT_PATH));
        let text = load::read(path, "configuration").map_err(|error| error.to_string());
        let table = text.as_ref().ok().and_then(|text| toml::from_str::<toml::Table>(text).ok());
        let log = bundle.add_private_names(path, table.as_ref());
        bundle.add("system.txt", "program, system, processor, memory, variables for Vulkan", &system_information());
        bundle.add_configuration(path, text, table);
        bundle.add_logs(&log);
        bundle
    }

    /// Collects private names from a configuration, which may be invalid. Returns the path of the log.
    fn add_private_names(&mut self, path: &Path, table: Option<&toml::Table>) -> PathBuf {
        let folder = path.parent().unwrap_or(Path::new(""));
        let value_of = |above: Option<&str>, key: &str| {
            let table = above.map_or(table, |above| table?.get(above)?.as_table());
            Some(table?.get(key)?.as_str()?.to_string())
        };
        if let Some(source) = value_of(None, "source").filter(|s| s != config::PHANTOM && !s.contains("://")) {
            self.redactor.add_recording(Path::new(&source));
            self.redactor.add_folder(folder.join(&source).parent().unwrap_or(folder));
        }
        for private in [value_of(Some("files"), "pictures"), value_of(Some("live"), "record")].into_iter().flatten() {
            self.redactor.add_folder(&folder.join(private));
        }
        value_of(Some("files"), "log").map_or(config::DEFAULT_LOG.into(), |log| folder.join(log))
    }

    /// Adds a file of this name with `text`. The text is redacted first and then cut at 2^20 characters, so that a private name at the cut is
    /// recognised. `description`: its line in the README.
    pub fn add(&mut self, name: &str, description: &str, text: &str) {
        self.add_up_to(MAX_ENTRY, name, description, text);
    }

    fn add_up_to(&mut self, most: usize, name: &str, description: &str, text: &str) {
        let mut text = self.redactor.redact(text);
        text.truncate(text.char_indices().nth(most).map_or(text.len(), |(end, _)| end));
        self.entries.push(Entry { name: name.into(), description: description.into(), text });
    }

    fn add_configuration(&mut self, path: &Path, text: Result<String, String>, table: Option<toml::Table>) {
        let text = match text {
            Ok(text) => text,
            Err(fault) => return self.note(&format!("configuration: {fault}")),
        };
        let written = match &table {
            Some(table) => toml::to_string(table).unwrap_or_else(|e| format!("cannot be shown: {e}\n")),
            // Without valid TOML, comments and names cannot be told apart from keys: only the keys are kept.
            None => keys(&text),
        };
        self.add("configuration/as-written.toml", "the file, sorted by key, without comments", &written);
        match Config::parse(&text, path) {
            Ok(config) => {
                let read = config.to_toml().unwrap_or_else(|e| format!("cannot be shown: {e}\n"));
                self.add("configuration/as-read.toml", "the configuration as read, including defaults", &read);
            }
            Err(error) => {
                self.add("configuration/refused.txt", "the error in the configuration", &format!("{error}\n"))
            }
        }
    }

    /// Adds the log and its rotated files, newest first, at most 20 MiB in all.
    fn add_logs(&mut self, log: &Path) {
        let (mut left, mut found) = (MAX_LOG_BYTES, false);
        for number in 0..MAX_LOG_FILES {
            let file = rotated_name(log, number);
            if left == 0 || !std::fs::metadata(&file).is_ok_and(|there| there.is_file()) {
                // During a rotation the current file is missing for a moment.
                if number == 0 { continue } else { break }
            }
            found = true;
            let name = rotated_name(Path::new("logs/echolume.log"), number).to_string_lossy().into_owned();
            if !is_log_file(&file) {
                self.note(&format!("{name}: {} is not a log and was left out", file.display()));
                continue;
            }
            match tail(&file, left) {
                Ok((bytes, cut)) => {
                    left -= left.min(bytes.len() as u64);
                    let description = if cut { "the end of the log" } else { "the log" };
                    self.add_up_to(usize::MAX, &name, description, &String::from_utf8_lossy(&bytes));
                }
                Err(error) => self.note(&format!("{name}: {} cannot be read: {error}", file.display())),
            }
        }
        if !found {
            self.note(&format!("logs: none found at {}", log.display()));
        }
    }

    /// Adds a note to the README on a missing part and the reason.
    pub fn note(&mut self, note: &str) {
        let note = self.redactor.redact(&crate::text::printable(note));
        self.notes.push(note);
    }

    /// Packs the archive (.tar.gz). Its first file is `README.txt`, which lists the contents.
    ///
    /// # Errors
    /// Writing the archive to memory failed.
    pub fn pack(self) -> io::Result<Vec<u8>> {
        let mut about = ABOUT.to_string();
        for Entry { name, description, text } in &self.entries {
            about += &format!("    {name:<32} {:>9} bytes  {description}\n", text.len());
        }
        if !self.notes.is_empty() {
            about += "\nMissing or wrong:\n\n";
            self.notes.iter().for_each(|note| about += &format!("    {note}\n"));
        }
        let first = Entry { name: "README.txt".into(), description: String::new(), text: about };
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

/// The end of a file, from the start of a line, and whether something was left out.
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

/// The tables and keys of a text that is not valid TOML, with line numbers.
fn keys(text: &str) -> String {
    let mut report = String::from("# This is not valid TOML: only its keys are shown.\n");
    for (number, line) in text.lines().enumerate() {
        let key = line.split(['=', '#']).next().unwrap_or("").trim();
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-.[]".contains(c);
        if key.len() < 64 && !key.is_empty() && key.chars().all(plain) && (key.starts_with('[') || line.contains('=')) {
            report += &format!("{}: {key}\n", number + 1);
        }
    }
    report
}

/// Largest part of a system file that is read, bytes. For a processor with many cores these are the first ones.
const MAX_SYSTEM_FILE: u64 = 64 << 10;
/// Prefixes of the environment variables that affect Vulkan.
const VARIABLES: &[&str] = &["VK_", "LP_", "MESA_", "GALLIVM_"];

/// Information about program, system, processor, memory and variables for Vulkan, one item a line. It does not name the machine.
fn system_information() -> String {
    let mut report = String::new();
    let mut item = |name: &str, value: Option<String>| {
        // Writing to a String does not fail.
        let _ = writeln!(report, "{name}: {}", value.unwrap_or_else(|| "unknown".into()));
    };
    item("program", Some(machine::program()));
    item("time", Some(machine::date()));
    item("built for", Some(format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)));
    let kernel = ["ostype", "osrelease", "version"].map(|name| text(&format!("/proc/sys/kernel/{name}")));
    let kernel = kernel.map(|part| part.unwrap_or_default().trim().to_string()).join(" ");
    item("kernel", Some(kernel.trim().to_string()).filter(|kernel| !kernel.is_empty()));
    item("system", text("/etc/os-release").and_then(|text| value(&text, "PRETTY_NAME", '=')));
    item("processor", text("/proc/cpuinfo").and_then(|text| value(&text, "model name", ':')));
    item("cores", std::thread::available_parallelism().ok().map(|cores| cores.to_string()));
    let memory = text("/proc/meminfo").unwrap_or_default();
    item("memory", value(&memory, "MemTotal", ':'));
    item("memory available", value(&memory, "MemAvailable", ':'));
    item("uptime", text("/proc/uptime").and_then(|up| Some(format!("{} s", up.split(' ').next()?))));
    let mut set: Vec<_> = std::env::vars_os()
        .map(|(name, value)| (name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned()))
        .filter(|(name, _)| VARIABLES.iter().any(|start| name.starts_with(start)))
        .collect();
    set.sort();
    let _ = writeln!(report, "variables with the prefix {}:", VARIABLES.join(", "));
    for (name, value) in &set {
        let _ = writeln!(report, "    {name}={}", value.escape_debug());
    }
    if set.is_empty() {
        report += "    none\n";
    }
    report
}

fn text(path: &str) -> Option<String> {
    let mut bytes = Vec::new();
    File::open(Path::new(path)).ok()?.take(MAX_SYSTEM_FILE).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

/// The value of the first line with this name.
fn value(text: &str, name: &str, sign: char) -> Option<String> {
    let lines = text.lines().filter_map(|line| line.split_once(sign));
    let mut values = lines.filter(|(left, _)| left.trim() == name).map(|(_, value)| value.trim().trim_matches('"'));
    values.next().map(str::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_long_log_is_kept_in_complete_lines() {
        let path = std::env::temp_dir().join(format!("echolume-tail-{}", std::process::id()));
        std::fs::write(&path, "2026-01-01T one\ntwo\nthree\n").expect("write");
        assert_eq!(tail(&path, 100).expect("read"), (b"2026-01-01T one\ntwo\nthree\n".to_vec(), false));
        assert_eq!(tail(&path, 8).expect("read"), (b"three\n".to_vec(), true));
        assert_eq!(tail(&path, 3).expect("read"), (Vec::new(), true));
        std::fs::remove_file(&path).expect("remove");
    }

    #[test]
    fn a_private_name_where_a_text_is_cut_is_redacted() {
        let mut bundle = Bundle { redactor: Redactor::new(), entries: Vec::new(), notes: Vec::new() };
        bundle.redactor.add_recording(Path::new("/data/Eleonora.mha"));
        let text = format!("{}Eleonora\n", "0\n".repeat(MAX_ENTRY / 2 - 2));
        bundle.add("long.txt", "a text", &text);
        let kept = &bundle.entries[0].text;
        assert!(kept.len() <= MAX_ENTRY && !kept.contains("El"), "{}", &kept[kept.len() - 20..]);
    }

    #[test]
    fn only_the_keys_of_invalid_toml_are_kept() {
        let report =
            keys("source = \"/data/Anna\n# Anna = 1\n[files]\nlog = 'x' # Anna\nAnna's note\nAnna Smith = 3\n");
        assert!(
            ["1: source\n", "3: [files]\n", "4: log\n"].iter().all(|l| report.contains(l)) && !report.contains("Anna"),
            "{report}"
        );
    }

    #[test]
    fn system_information_names_the_program_and_not_the_machine() {
        let report = system_information();
        assert!(report.starts_with(&format!("program: echolume {}", env!("CARGO_PKG_VERSION"))), "{report}");
        assert!(
            ["kernel: ", "processor: ", "memory: ", "with the prefix VK_"].iter().all(|name| report.contains(name)),
            "{report}"
        );
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        assert!(host.trim().len() < 4 || !report.contains(host.trim()), "{report}");
        assert!(!report.contains("PATH="));
    }

    #[test]
    fn values_are_found_by_name() {
        let text = "NAME=\"a\"\nPRETTY_NAME=\"Some System 12\"\nodd line\n";
        assert_eq!(value(text, "PRETTY_NAME", '=').as_deref(), Some("Some System 12"));
        assert_eq!(value(text, "none", '='), None);
    }
}
