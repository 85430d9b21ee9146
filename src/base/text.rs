//! Text from outside (files, the network, drivers) made safe for a terminal, for one-line messages and for tables.

use std::fmt::Write as _;

/// Maximum length of [`single_line`], characters.
const MAX_LINE: usize = 400;

/// Length of [`escaped`] after which the text is cut, bytes.
const MAX_ESCAPED: usize = 600;

/// Returns the message on one line: line breaks become spaces, other control characters become escapes. A message may quote a key of a
/// file, which can hold any character.
pub fn printable(message: &str) -> String {
    without_control_characters(&message.lines().collect::<Vec<_>>().join(" "))
}

/// Escapes control characters other than line ends. Text from files must not control the terminal.
pub(crate) fn without_control_characters(text: &str) -> String {
    let mut lines = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() && c != '\n' { lines.extend(c.escape_default()) } else { lines.push(c) }
    }
    lines
}

/// The text on one line, cut at 400 characters: line breaks become spaces, other control characters become escapes.
pub fn single_line(text: &str) -> String {
    printable(text).chars().take(MAX_LINE).collect()
}

/// The text on one line of at most about 600 characters: control characters and other invisible ones, line breaks included, are escaped.
pub fn escaped(text: &str) -> String {
    let mut line = String::new();
    for c in text.chars() {
        if line.len() >= MAX_ESCAPED {
            line.push_str(" ...");
            break;
        }
        push_visible(&mut line, c);
    }
    line
}

/// Appends a character; a control character or another invisible one is escaped.
pub(crate) fn push_visible(line: &mut String, c: char) {
    match c {
        '\'' | '"' | '\\' => line.push(c),
        _ => line.extend(c.escape_debug()),
    }
}

/// The text as a CSV field in quotes.
pub fn csv_quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// The text as a CSV field (RFC 4180), in quotes if it contains a comma, quote or line break.
pub fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { csv_quoted(text) } else { text.into() }
}

/// The text for a cell of a Markdown table, with table markup and terminal control characters escaped.
pub fn markdown_text(text: &str) -> String {
    text.chars()
        .flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] })
        .collect::<String>()
        .replace('|', "\\|")
}

/// A Markdown table with aligned pipes from rows of cells, the header first. The first column is left-aligned, the others right-aligned.
pub fn markdown_table(rows: &[Vec<String>]) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0).max(3);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for (n, row) in rows.iter().enumerate() {
        for (c, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let _ = if c == 0 { write!(text, "| {cell:<width$} ") } else { write!(text, "| {cell:>width$} ") };
        }
        text.push_str("|\n");
        if n == 0 {
            for (c, width) in widths.iter().enumerate() {
                let _ = match c {
                    0 => write!(text, "|{}", "-".repeat(width + 2)),
                    _ => write!(text, "|{}:", "-".repeat(width + 1)),
                };
            }
            text.push_str("|\n");
        }
    }
    text
}
