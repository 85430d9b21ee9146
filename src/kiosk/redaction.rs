//! Text without the names of recordings: those are often the names of people.
//!
//! What is taken out, with a stand-in that keeps its number wherever the same comes again:
//!
//! - names of files that end as recordings and pictures do, `<file-1>.mha`, with the path before them. A path that begins with its root
//!   is known from there on, spaces and all. Of one that does not, nobody can say where it begins: all that stands before it in the
//!   message goes with it, or in quotes all between them;
//! - every other path that lies outside of the system's own folders, or below a folder that is named as private, `<path-1>`;
//! - the names in the path of a recording that is named to it, wherever they stand, `<name-1>`;
//! - user and password in addresses;
//! - lines of more than 16 KiB, whole.

use std::collections::HashMap;
use std::path::Path;

/// How names of recordings and pictures end.
const ENDINGS: &[&str] = &[
    "mha", "mhd", "vol", "frames", "png", "dcm", "raw", "zraw", "nrrd", "nhdr", "nii", "img", "jpg", "jpeg", "bmp",
    "tif", "tiff", "pgm", "ppm", "gif", "avi", "mp4", "mov", "mkv",
];
/// Folders that belong to the system: paths below them are told.
const SYSTEM: &[&str] = &[
    "/bin",
    "/dev",
    "/etc",
    "/lib",
    "/lib32",
    "/lib64",
    "/proc",
    "/sbin",
    "/sys",
    "/usr",
    "/var/lib/echolume",
    "/var/log",
];
/// Names in paths that are nobody's.
const NOBODYS: &[&str] = &[
    "data",
    "echolume",
    "home",
    "media",
    "phantom",
    "pictures",
    "recordings",
    "root",
    "srv",
    "sweep",
    "sweeps",
    "users",
    "tests",
    "volume",
    "volumes",
];
const LEVELS: &[&str] = &["ERROR", "WARN", "INFO", "DEBUG", "TRACE"];

/// Longest line that is looked through, bytes: names may be anywhere in one.
const LONGEST_LINE: usize = 16 << 10;

/// Takes the names out of text.
#[derive(Default)]
pub struct Redactor {
    numbers: HashMap<String, usize>,
    /// Below these every path is taken out, even where they are the system's.
    private: Vec<String>,
    /// Lower-case.
    names: Vec<String>,
}

impl Redactor {
    pub fn new() -> Redactor {
        Redactor::default()
    }

    /// Whatever lies below this folder is private.
    pub fn add_folder(&mut self, folder: &Path) {
        let folder = folder.to_string_lossy();
        let folder = folder.trim_end_matches(['/', '\\']);
        if !folder.is_empty() {
            self.private.push(folder.to_string());
        }
    }

    /// A recording: the names in its path are private wherever they stand.
    pub fn add_recording(&mut self, path: &Path) {
        if let Some(folder) = path.parent() {
            self.add_folder(folder);
        }
        let parts = path.iter().map(|part| part.to_string_lossy().to_ascii_lowercase());
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().to_ascii_lowercase());
        for name in parts.chain(stem) {
            let system = SYSTEM.iter().any(|folder| folder.split('/').any(|part| part == name));
            let telling = name.len() >= 3 && name.chars().any(char::is_alphabetic);
            if telling && !system && !NOBODYS.contains(&name.as_str()) {
                self.names.push(name);
            }
        }
        // A name that contains another one goes first.
        self.names.sort_by_key(|name| std::cmp::Reverse(name.len()));
        self.names.dedup();
    }

    /// The text without them. Lines stay lines.
    pub fn text(&mut self, text: &str) -> String {
        let mut said = String::with_capacity(text.len());
        for line in text.split_inclusive('\n') {
            let (line, end) = line.strip_suffix('\n').map_or((line, ""), |line| (line, "\n"));
            if line.len() > LONGEST_LINE {
                said += &format!("(a line of {} bytes is left out)", line.len());
            } else {
                let line = self.without_paths(&without_passwords(line));
                said += &self.without_names(line);
            }
            said += end;
        }
        said
    }

    fn stand_in(&mut self, kind: &str, name: &str) -> String {
        let next = self.numbers.len() + 1;
        let number = self.numbers.entry(name.to_ascii_lowercase()).or_insert(next);
        format!("<{kind}-{number}>")
    }

    fn without_paths(&mut self, line: &str) -> String {
        let mut from = message_at(line);
        let mut said = line[..from].to_string();
        while let Some((path, ending)) = self.next_path(line, from) {
            said += &line[from..path.start];
            let whole = &line[path.clone()];
            said += &match ending {
                Some(ending) => {
                    let name = whole.rsplit(['/', '\\']).next().unwrap_or(whole);
                    // Of a message that went with it only the last word is the name, as far as anybody can tell.
                    let rooted = root(line, path.start) == Some(path.start);
                    let name = if rooted { name } else { name.rsplit(' ').next().unwrap_or(name) };
                    self.stand_in("file", name) + "." + ending
                }
                None => self.stand_in("path", whole),
            };
            from = path.end;
        }
        said + &line[from..]
    }

    /// The next path, and how it ends where that is as a recording's does.
    fn next_path(&self, line: &str, from: usize) -> Option<(std::ops::Range<usize>, Option<&'static str>)> {
        let mut rooted = root(line, from);
        while let Some(at) = rooted.filter(|at| self.is_told(&line[*at..])) {
            rooted = root(line, at + 1);
        }
        let ended = ending(line, from);
        match (rooted, ended) {
            (Some(start), Some((end, ending))) if start < end => Some((start..rest_of_name(line, end), Some(ending))),
            // The system's paths may end like this too.
            (_, Some((end, ending))) => Some((unrooted(line, from, end)..rest_of_name(line, end), Some(ending))),
            (Some(start), None) => {
                let quote = line[..start].chars().next_back().filter(|c| is_quote(*c));
                let end = match quote.and_then(|quote| line[start..].rfind(quote)) {
                    Some(end) => Some(end),
                    None => line[start..].find(": "),
                };
                Some((start..end.map_or(line.len(), |end| start + end), None))
            }
            (None, None) => None,
        }
    }

    /// A path of the system, and of nobody.
    fn is_told(&self, path: &str) -> bool {
        let below = |folder: &str| path.strip_prefix(folder);
        let private = self.private.iter().any(|f| below(f).is_some_and(|rest| rest.starts_with(['/', '\\'])));
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-' || c == '_');
        !private && SYSTEM.iter().any(|f| below(f).is_some_and(ends))
    }

    fn without_names(&mut self, mut line: String) -> String {
        let names = std::mem::take(&mut self.names);
        for name in &names {
            // Of the same length, byte for byte.
            let lower = line.to_ascii_lowercase();
            let (mut said, mut from) = (String::new(), 0);
            for (at, _) in lower.match_indices(name.as_str()) {
                let end = at + name.len();
                let beside = [line[..at].chars().next_back(), line[end..].chars().next()];
                if !beside.into_iter().flatten().any(char::is_alphanumeric) {
                    said += &line[from..at];
                    said += &self.stand_in("name", name);
                    from = end;
                }
            }
            if from > 0 {
                line = said + &line[from..];
            }
        }
        self.names = names;
        line
    }
}

/// Behind the time and level of a line of a log.
fn message_at(line: &str) -> usize {
    let bytes = line.as_bytes();
    if bytes.get(4) != Some(&b'-') || bytes.get(10) != Some(&b'T') {
        return 0;
    }
    let Some(time) = line.find(' ') else { return 0 };
    let rest = line[time..].trim_start();
    let level = LEVELS.iter().find(|level| rest.starts_with(**level)).map_or(0, |level| level.len());
    line.len() - rest.len() + level
}

fn is_quote(c: char) -> bool {
    matches!(c, '"' | '\'' | '`')
}

/// Where the next path with a root begins.
fn root(line: &str, from: usize) -> Option<usize> {
    let mut before = line[..from].chars().next_back();
    for (at, c) in line[from..].char_indices().map(|(at, c)| (from + at, c)) {
        let rest = &line[at..];
        let word = before.is_none_or(|b| b.is_whitespace() || is_quote(b) || "=([{<,;:|".contains(b));
        let second = rest.chars().nth(1);
        let slash = |c: Option<char>| matches!(c, Some('/' | '\\'));
        let begins = match c {
            // Not an address, nor a fraction.
            '/' => !(before == Some(':') && second == Some('/')) && second.is_some_and(|c| !c.is_whitespace()),
            '\\' => second == Some('\\'),
            '~' => slash(second),
            '.' => slash(second) || (second == Some('.') && slash(rest.chars().nth(2))),
            c if c.is_ascii_alphabetic() => second == Some(':') && slash(rest.chars().nth(2)),
            _ => false,
        };
        if word && begins {
            return Some(at);
        }
        before = Some(c);
    }
    None
}

/// Where the next name ends that is a recording's or a picture's, and how.
fn ending(line: &str, from: usize) -> Option<(usize, &'static str)> {
    line[from..].match_indices('.').find_map(|(at, _)| {
        let rest = &line[from + at + 1..];
        let letters = rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len());
        let ending = ENDINGS.iter().find(|ending| ending.eq_ignore_ascii_case(&rest[..letters]))?;
        Some((from + at + 1 + letters, *ending))
    })
}

/// What stands right behind the ending belongs to the name: `a.mha.part`, `a.mha/b`.
fn rest_of_name(line: &str, end: usize) -> usize {
    let more = line[end..].find(|c: char| c.is_whitespace() || is_quote(c) || ",;:)]}>|".contains(c));
    more.map_or(line.len(), |more| end + more)
}

/// Where a path without a root begins at the earliest.
fn unrooted(line: &str, from: usize, end: usize) -> usize {
    let quote = line[end..].chars().next().filter(|c| is_quote(*c));
    // That of O'Brien opens nothing.
    let opens = |at: &usize| line[..*at].chars().next_back().is_none_or(|c| !c.is_alphanumeric());
    let quotes = quote.into_iter().flat_map(|quote| line[from..end].match_indices(quote)).map(|(at, _)| from + at);
    let start = quotes.into_iter().find(opens).map_or(from, |at| at + 1);
    start + (line[start..end].len() - line[start..end].trim_start().len())
}

/// Addresses without `user:password@`.
fn without_passwords(line: &str) -> String {
    let mut said = String::new();
    let mut rest = line;
    while let Some(at) = rest.find("://") {
        let (before, address) = rest.split_at(at + 3);
        let host = &address[..address.find(['/', '"', '\'']).unwrap_or(address.len())];
        said += before;
        rest = &address[host.rfind('@').map_or(0, |at| at + 1)..];
    }
    said + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn redacted(text: &str) -> String {
        let mut redactor = Redactor::new();
        redactor.add_folder(Path::new("/var/lib/echolume/pictures"));
        redactor.text(text)
    }

    #[test]
    fn names_of_recordings_and_pictures_go_with_their_paths() {
        let stamp = "2026-11-22T01:00:00.000001Z";
        for (text, wanted) in [
            ("/data/Anna Smith/scan 1.mha: cut short", "<file-1>.mha: cut short"),
            ("source = \"/data/Smith, Anna (1980).MHA\"", "source = \"<file-1>.mha\""),
            ("file=/data/Anna.vol more samples", "file=<file-1>.vol more samples"),
            ("cannot open 'Anna O'Brien.dcm', trying", "cannot open '<file-1>.dcm', trying"),
            ("C:\\Users\\Anna\\a b.frames is cut", "<file-1>.frames is cut"),
            ("~/Anna/a.nrrd", "<file-1>.nrrd"),
            ("/data/a.mha.part and /data/b.png", "<file-1>.mha and <file-2>.png"),
            ("/data/a.mha, /other/a.mha, /data/b.mha", "<file-1>.mha, <file-1>.mha, <file-2>.mha"),
            ("/data/Anna Smith: is a folder", "<path-1>: is a folder"),
            ("/home/anna", "<path-1>"),
            ("/var/lib/echolume/pictures/Anna Smith: full", "<path-1>: full"),
            ("/var/lib/echolume/pictures: full", "/var/lib/echolume/pictures: full"),
            ("/etc/echolume/echolume.toml: line 3", "/etc/echolume/echolume.toml: line 3"),
            ("/usr/lib/libvulkan.so.1 and /dev/ttyUSB0", "/usr/lib/libvulkan.so.1 and /dev/ttyUSB0"),
            ("igtl://anna:secret@scanner:18944/x", "igtl://scanner:18944/x"),
            ("igtl://scanner:18944: 12 frames/s, 1 / 2", "igtl://scanner:18944: 12 frames/s, 1 / 2"),
            ("no raw data, 12.5 volumes", "no raw data, 12.5 volumes"),
            ("a\n/data/b.raw\n\nc", "a\n<file-1>.raw\n\nc"),
        ] {
            assert_eq!(redacted(text), wanted, "{text}");
        }
        // Nobody can say where a name without a root begins: the message goes with it, time and level stay.
        let line = format!("{stamp}  WARN saved Anna Smith.png at last");
        assert_eq!(redacted(&line), format!("{stamp}  WARN <file-1>.png at last"));
    }

    #[test]
    fn the_names_of_a_recording_go_wherever_they_stand() {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/etc/echolume/Anna Smith/Smith_20w.xyz"));
        for (text, wanted) in [
            ("/etc/echolume/Anna Smith/Smith_20w.xyz: none", "<path-1>: none"),
            ("volume 3 of smith_20W, ANNA SMITH", "volume 3 of <name-3>, <name-2>"),
            ("Smith_20w.xyz", "<name-4>"),
            ("Blacksmith_20wide echolume", "Blacksmith_20wide echolume"),
        ] {
            assert_eq!(redactor.text(text), wanted, "{text}");
        }
    }

    #[test]
    fn a_line_without_end_is_left_out_and_not_looked_through_for_ever() {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/data/anna.mha"));
        for part in ["anna ", "/data/a: ", "a.mha ", "://a@", "'"] {
            assert!(redactor.text(&part.repeat(1 << 20)).len() < 100);
            let said = redactor.text(&(part.repeat(2000) + "\n").repeat(20));
            assert_eq!((said.lines().count(), said.contains("anna")), (20, false));
        }
    }

    proptest! {
        /// Whatever surrounds it, and whatever the name is made of.
        #[test]
        fn no_name_gets_through(
            before in "[a-z :=,'\"(]{0,12}",
            folder in "(/data/|/mnt/x y/|~/|\\./|C:\\\\|)",
            name in "[a-z, ()-]{0,8}(O')?ZQX[a-z, ()_-]{0,8}",
            ending in "(mha|PNG|vol|frames|dcm)",
            after in "(|: [a-z ]{0,9}|, [a-z]{0,5}|\"|'|\\.part| \\.png)",
        ) {
            let said = redacted(&format!("2026-11-22T01:00:00Z  INFO {before}{folder}{name}.{ending}{after}"));
            prop_assert!(!said.contains("ZQX") && said.contains("INFO"), "{}", said);
        }

        #[test]
        fn any_text_is_survived_and_keeps_its_lines(text in "(\\PC|[\n/\\\\.~:'\"@]|://|\\.mha|/data/){0,40}") {
            let mut redactor = Redactor::new();
            redactor.add_recording(Path::new("/data/äöü/a b.mha"));
            prop_assert_eq!(redactor.text(&text).matches('\n').count(), text.matches('\n').count());
        }
    }
}
