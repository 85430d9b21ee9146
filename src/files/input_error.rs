//! Errors of input files: one line that names the file, the field and the fault.

use std::io;
use std::path::Path;

/// Longest quotation from a file, characters.
const MAX_QUOTE: usize = 60;
/// Longest part of a message, characters.
const MAX_PART: usize = 300;

/// An error of an input file: one line that names the file, the field and what is wrong with it.
///
/// Everything that comes from the file is escaped and shortened, so that a file cannot send control characters to a terminal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {field}: {fault}")]
pub struct InputError {
    file: String,
    field: String,
    fault: String,
}

impl InputError {
    /// An error of `field` in `file`. All three parts are escaped and shortened.
    pub fn new(file: &Path, field: impl AsRef<str>, fault: impl AsRef<str>) -> InputError {
        InputError {
            file: escaped(&file.display().to_string(), MAX_PART),
            field: escaped(field.as_ref(), MAX_PART),
            fault: escaped(fault.as_ref(), MAX_PART),
        }
    }

    /// The operating system cannot read the file.
    pub(crate) fn unreadable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be read: {error}"))
    }

    /// The operating system cannot write the file.
    pub(crate) fn unwritable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be written: {error}"))
    }

    /// The field that is wrong.
    pub fn field(&self) -> &str {
        &self.field
    }

    /// What is wrong with it.
    pub fn fault(&self) -> &str {
        &self.fault
    }
}

/// A value from a file in quotes, escaped and shortened.
pub(crate) fn quoted(value: &str) -> String {
    format!("'{}'", escaped(value, MAX_QUOTE))
}

/// Text with control characters and other invisible ones escaped, at most `longest` characters of the original.
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
