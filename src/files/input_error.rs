//! What is wrong with an input, on one line.

use std::io;
use std::path::Path;

/// Longest quotation from a file, in characters.
const QUOTE: usize = 60;
/// Longest part of a message, in characters.
const PART: usize = 300;

/// A fault of an input file: one line naming the file, the field and what is wrong with it.
///
/// Whatever was taken from the file is escaped and shortened on the way in, so that no file can write to a terminal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {field}: {fault}")]
pub struct InputError {
    file: String,
    field: String,
    fault: String,
}

impl InputError {
    pub fn new(file: &Path, field: impl AsRef<str>, fault: impl AsRef<str>) -> InputError {
        InputError {
            file: escaped(&file.display().to_string(), PART),
            field: escaped(field.as_ref(), PART),
            fault: escaped(fault.as_ref(), PART),
        }
    }

    /// The operating system would not let the file be read.
    pub(crate) fn unreadable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be read: {error}"))
    }

    /// The operating system would not let the file be written.
    pub(crate) fn unwritable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be written: {error}"))
    }

    pub fn field(&self) -> &str {
        &self.field
    }

    pub fn fault(&self) -> &str {
        &self.fault
    }
}

/// A value of the file in quotes, shortened.
pub(crate) fn quoted(value: &str) -> String {
    format!("'{}'", escaped(value, QUOTE))
}

/// Control characters and other invisible ones as escapes, at most `longest` characters of the original.
pub(crate) fn escaped(text: &str, longest: usize) -> String {
    let mut line = String::new();
    for (i, c) in text.chars().enumerate() {
        if i == longest {
            line.push_str("...");
            break;
        }
        match c {
            '\'' | '"' | '\\' => line.push(c),
            _ => line.extend(c.escape_debug()),
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_cannot_break_the_line_or_drive_the_terminal() {
        let error =
            InputError::new(Path::new("a\nb"), "Dim\u{1b}[2J", quoted(&"x\r\n\u{202e}".repeat(400))).to_string();
        assert_eq!(error.lines().count(), 1);
        assert!(!error.chars().any(|c| c.is_control() || c == '\u{202e}'), "{error}");
        assert!(error.len() < 2000);
    }
}
