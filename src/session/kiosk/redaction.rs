//! Redaction: removes the names of recordings from text, because those are often the names of people.
//!
//! The following is replaced by placeholders, whose number is the same for the same name:
//!
//! - file names with the extension of a recording or picture, `<file-1>.mha`, with their path. An absolute path is removed from its root
//!   on, including spaces. The start of a relative path is unknown: everything before it in the message is removed, or everything
//!   inside of the quotes;
//! - other paths outside of the system folders, or inside of a folder that was added as private, `<path-1>`;
//! - the names in the path of a recording that was added, anywhere in the text, `<name-1>`;
//! - user and password in addresses;
//! - complete lines of more than 16 KiB.

use crate::source::formats::{FORMATS, PICTURES};
use std::collections::HashMap;
use std::path::Path;

/// Endings of pictures and films that are not read here, but stand in logs.
const OTHER_PICTURES: [&str; 7] = ["tif", "tiff", "gif", "avi", "mp4", "mov", "mkv"];
/// System folders, divided by blanks: paths inside of them are kept.
const SYSTEM_FOLDERS: &str = "/bin /dev /etc /lib /lib32 /lib64 /proc /sbin /sys /usr /var/lib/echolume /var/log";
/// Names in paths that identify nobody, divided by blanks.
const PUBLIC_NAMES: &str =
    "data echolume home media phantom pictures recordings root srv sweep sweeps users tests volume volumes";
const LEVELS: &[&str] = &["ERROR", "WARN", "INFO", "DEBUG", "TRACE"];

/// Longest line that is searched, bytes. Longer ones are removed completely.
const MAX_LINE: usize = 16 << 10;

/// Replaces private names, such as those of recordings and of the user, in texts that are passed on.
#[derive(Default)]
pub struct Redactor {
    numbers: HashMap<String, usize>,
    /// Private folders: paths inside of them are removed, even in system folders.
    private: Vec<String>,
    /// Private names, lower-case.
    names: Vec<String>,
}

impl Redactor {
    pub fn new() -> Redactor {
        Redactor::default()
    }

    /// Makes a folder's path private.
    pub(crate) fn add_folder(&mut self, folder: &Path) {
        let folder = folder.to_string_lossy();
        let folder = folder.trim_end_matches(['/', '\\']);
        if !folder.is_empty() {
            self.private.push(folder.to_string());
        }
    }

    /// Makes a recording's path private: paths inside of its folder are removed, and the names in the path are replaced wherever they occur in a
    /// text as whole words. Some names are kept: those of fewer than three bytes, of fewer than five without a letter, of system folders, and common
    /// words such as `data`.
    pub fn add_recording(&mut self, path: &Path) {
        if let Some(folder) = path.parent() {
            self.add_folder(folder);
        }
        let parts = path.iter().map(|part| part.to_string_lossy().to_ascii_lowercase());
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().to_ascii_lowercase());
        for name in parts.chain(stem) {
            let system = SYSTEM_FOLDERS.split(' ').any(|folder| folder.split('/').any(|part| part == name));
            // Long numbers are dates of birth and numbers of patients; short ones are counts too.
            let least = if name.chars().any(char::is_alphabetic) { 3 } else { 5 };
            let is_identifying = name.len() >= least;
            if is_identifying && !system && !PUBLIC_NAMES.split(' ').any(|public| public == name) {
                self.names.push(name);
            }
        }
        // Longer names are replaced first, because they may contain others.
        self.names.sort_by_key(|name| std::cmp::Reverse(name.len()));
        self.names.dedup();
    }

    /// The text with private names replaced. It has the same number of lines.
    pub fn redact(&mut self, text: &str) -> String {
        let mut redacted_text = String::with_capacity(text.len());
        for line in text.split_inclusive('\n') {
            let (line, end) = line.strip_suffix('\n').map_or((line, ""), |line| (line, "\n"));
            if line.len() > MAX_LINE {
                redacted_text += &format!("(a line of {} bytes was removed)", line.len());
            } else {
                let line = self.without_paths(&without_passwords(line));
                redacted_text += &self.without_names(line);
            }
            redacted_text += end;
        }
        redacted_text
    }

    fn placeholder(&mut self, kind: &str, name: &str) -> String {
        let next = self.numbers.len() + 1;
        let number = self.numbers.entry(name.to_ascii_lowercase()).or_insert(next);
        format!("<{kind}-{number}>")
    }

    fn without_paths(&mut self, line: &str) -> String {
        let mut from = message_at(line);
        let mut redacted_text = line[..from].to_string();
        while let Some((path, extension)) = self.next_path(line, from) {
            redacted_text += &line[from..path.start];
            let path_text = &line[path.clone()];
            redacted_text += &match extension {
                Some(extension) => {
                    let name = path_text.rsplit(['/', '\\']).next().unwrap_or(path_text);
                    // If the message was removed with the path, only the last word is taken as the name.
                    let absolute = absolute_path(line, path.start) == Some(path.start);
                    let name = if absolute { name } else { name.rsplit(' ').next().unwrap_or(name) };
                    self.placeholder("file", name) + "." + extension
                }
                None => self.placeholder("path", path_text),
            };
            from = path.end;
        }
        redacted_text + &line[from..]
    }

    /// The next path to remove, and its extension if it is one of a recording.
    fn next_path(&self, line: &str, from: usize) -> Option<(std::ops::Range<usize>, Option<&'static str>)> {
        let mut absolute = absolute_path(line, from);
        while let Some(at) = absolute.filter(|at| self.is_public(&line[*at..])) {
            absolute = absolute_path(line, at + 1);
        }
        let extension = next_extension(line, from);
        match (absolute, extension) {
            (Some(start), Some((end, extension))) if start < end => {
                Some((start..end_of_name(line, end), Some(extension)))
            }
            // System paths may have these extensions too.
            (_, Some((end, extension))) => {
                Some((relative_path(line, from, end)..end_of_name(line, end), Some(extension)))
            }
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

    /// True if a path is in a system folder and not in a private one.
    fn is_public(&self, path: &str) -> bool {
        let below = |folder: &str| path.strip_prefix(folder);
        let private = self.private.iter().any(|f| below(f).is_some_and(|rest| rest.starts_with(['/', '\\'])));
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-' || c == '_');
        !private && SYSTEM_FOLDERS.split(' ').any(|f| below(f).is_some_and(ends))
    }

    fn without_names(&mut self, mut line: String) -> String {
        let names = std::mem::take(&mut self.names);
        for name in &names {
            // ASCII lower case keeps all byte positions.
            let lower = line.to_ascii_lowercase();
            let (mut redacted_text, mut from) = (String::new(), 0);
            for (at, _) in lower.match_indices(name.as_str()) {
                let end = at + name.len();
                let neighbours = [line[..at].chars().next_back(), line[end..].chars().next()];
                if !neighbours.into_iter().flatten().any(char::is_alphanumeric) {
                    redacted_text += &line[from..at];
                    redacted_text += &self.placeholder("name", name);
                    from = end;
                }
            }
            if from > 0 {
                line = redacted_text + &line[from..];
            }
        }
        self.names = names;
        line
    }
}

/// Where the message starts in a line of a log: after time and level.
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

/// Where the next absolute path starts.
fn absolute_path(line: &str, from: usize) -> Option<usize> {
    let mut before = line[..from].chars().next_back();
    for (at, c) in line[from..].char_indices().map(|(at, c)| (from + at, c)) {
        let rest = &line[at..];
        let starts_word = before.is_none_or(|b| b.is_whitespace() || is_quote(b) || "=([{<,;:|".contains(b));
        let second = rest.chars().nth(1);
        let slash = |c: Option<char>| matches!(c, Some('/' | '\\'));
        let begins_path = match c {
            // Not the `//` of an address, and not a fraction.
            '/' => !(before == Some(':') && second == Some('/')) && second.is_some_and(|c| !c.is_whitespace()),
            '\\' => second == Some('\\'),
            '~' => slash(second),
            '.' => slash(second) || (second == Some('.') && slash(rest.chars().nth(2))),
            c if c.is_ascii_alphabetic() => second == Some(':') && slash(rest.chars().nth(2)),
            _ => false,
        };
        if starts_word && begins_path {
            return Some(at);
        }
        before = Some(c);
    }
    None
}

/// File extensions of recordings, of their samples, and of pictures.
fn extensions() -> impl Iterator<Item = &'static str> {
    let recordings = FORMATS.iter().flat_map(|format| format.endings.iter().chain(format.data));
    recordings.chain(&PICTURES).chain(&OTHER_PICTURES).copied()
}

/// Where the next file name of a recording or picture ends, and its extension.
fn next_extension(line: &str, from: usize) -> Option<(usize, &'static str)> {
    line[from..].match_indices('.').find_map(|(at, _)| {
        let rest = &line[from + at + 1..];
        let letters = rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len());
        let extension = extensions().find(|extension| extension.eq_ignore_ascii_case(&rest[..letters]))?;
        Some((from + at + 1 + letters, extension))
    })
}

/// Where a file name ends: what follows the extension directly belongs to it, as in `a.mha.part` and `a.mha/b`.
fn end_of_name(line: &str, end: usize) -> usize {
    let more = line[end..].find(|c: char| c.is_whitespace() || is_quote(c) || ",;:)]}>|".contains(c));
    more.map_or(line.len(), |more| end + more)
}

/// The earliest start of a relative path.
fn relative_path(line: &str, from: usize, end: usize) -> usize {
    let quote = line[end..].chars().next().filter(|c| is_quote(*c));
    // The apostrophe of O'Brien is no opening quote.
    let opens = |at: &usize| line[..*at].chars().next_back().is_none_or(|c| !c.is_alphanumeric());
    let quotes = quote.into_iter().flat_map(|quote| line[from..end].match_indices(quote)).map(|(at, _)| from + at);
    let start = quotes.into_iter().find(opens).map_or(from, |at| at + 1);
    start + (line[start..end].len() - line[start..end].trim_start().len())
}

/// Removes `user:password@` from addresses.
fn without_passwords(line: &str) -> String {
    let mut redacted_text = String::new();
    let mut rest = line;
    while let Some(at) = rest.find("://") {
        let (before, address) = rest.split_at(at + 3);
        let host = &address[..address.find(['/', '"', '\'']).unwrap_or(address.len())];
        redacted_text += before;
        rest = &address[host.rfind('@').map_or(0, |at| at + 1)..];
    }
    redacted_text + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn redacted(text: &str) -> String {
        let mut redactor = Redactor::new();
        redactor.add_folder(Path::new("/var/lib/echolume/pictures"));
        redactor.redact(text)
    }

    /// Requirement: a relative name of any file that is read is removed, whatever its format.
    #[test]
    fn names_of_every_format_are_removed() {
        let mut count = 0;
        for ending in extensions() {
            for name in
                [format!("anna.{ending}"), format!("ANNA.{}", ending.to_uppercase()), format!("anna.{ending}.gz")]
            {
                let said = redacted(&format!("cannot open {name}: cut short"));
                assert!(
                    said.contains("<file-1>.") && said.contains("cut short") && !said.to_lowercase().contains("anna"),
                    "{name}: {said}"
                );
                count += 1;
            }
        }
        assert!(count > 2 * (FORMATS.len() + PICTURES.len()));
    }

    #[test]
    fn names_of_recordings_and_pictures_are_removed_with_their_paths() {
        let stamp = "2026-11-22T01:00:00.000001Z";
        for (text, expected) in [
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
            assert_eq!(redacted(text), expected, "{text}");
        }
        // The start of a relative path is unknown: the message before it is removed, time and level stay.
        let line = format!("{stamp}  WARN saved Anna Smith.png at last");
        assert_eq!(redacted(&line), format!("{stamp}  WARN <file-1>.png at last"));
    }

    #[test]
    fn the_names_of_a_recording_are_removed_everywhere() {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/etc/echolume/Anna Smith/Smith_20w.xyz"));
        for (text, expected) in [
            ("/etc/echolume/Anna Smith/Smith_20w.xyz: none", "<path-1>: none"),
            ("volume 3 of smith_20W, ANNA SMITH", "volume 3 of <name-3>, <name-2>"),
            ("Smith_20w.xyz", "<name-4>"),
            ("Blacksmith_20wide echolume", "Blacksmith_20wide echolume"),
        ] {
            assert_eq!(redactor.redact(text), expected, "{text}");
        }
    }

    /// Prevents a number of a patient, or a date of birth, that stays because it has no letter.
    #[test]
    fn long_numbers_in_the_path_of_a_recording_are_removed_and_short_ones_kept() {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/data/1987-04-12/4711223/100/20.xyz"));
        let text = "patient 4711223, born 1987-04-12: 100 volumes of 20 frames";
        assert_eq!(redactor.redact(text), "patient <name-2>, born <name-1>: 100 volumes of 20 frames");
    }

    #[test]
    fn a_very_long_line_is_removed_without_a_search() {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/data/anna.mha"));
        for part in ["anna ", "/data/a: ", "a.mha ", "://a@", "'"] {
            assert!(redactor.redact(&part.repeat(1 << 17)).len() < 100);
            let redacted_text = redactor.redact(&(part.repeat(600) + "\n").repeat(4));
            assert_eq!((redacted_text.lines().count(), redacted_text.contains("anna")), (4, false));
        }
    }

    proptest! {
        /// For any name in any surroundings.
        #[test]
        fn no_name_remains(
            before in "[a-z :=,'\"(]{0,12}",
            folder in "(/data/|/mnt/x y/|~/|\\./|C:\\\\|)",
            name in "[a-z, ()-]{0,8}(O')?ZQX[a-z, ()_-]{0,8}",
            extension in "(mha|PNG|vol|frames|dcm)",
            after in "(|: [a-z ]{0,9}|, [a-z]{0,5}|\"|'|\\.part| \\.png)",
        ) {
            let redacted_text = redacted(&format!("2026-11-22T01:00:00Z  INFO {before}{folder}{name}.{extension}{after}"));
            prop_assert!(!redacted_text.contains("ZQX") && redacted_text.contains("INFO"), "{}", redacted_text);
        }

        #[test]
        fn any_text_keeps_its_number_of_lines(text in "(\\PC|[\n/\\\\.~:'\"@]|://|\\.mha|/data/){0,40}") {
            let mut redactor = Redactor::new();
            redactor.add_recording(Path::new("/data/äöü/a b.mha"));
            prop_assert_eq!(redactor.redact(&text).matches('\n').count(), text.matches('\n').count());
        }
    }
}
