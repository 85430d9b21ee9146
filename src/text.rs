//! Text from outside (files, the network, drivers) made safe for a terminal and for one-line messages.

/// Maximum length of [`single_line`], characters.
const MAX_LINE: usize = 400;

/// Length of [`escaped`] after which the text is cut, bytes.
const MAX_ESCAPED: usize = 600;

/// The message on one line: line breaks become spaces, other control characters escapes. A key that it names may hold anything.
pub(crate) fn printable(message: &str) -> String {
    let mut line = String::new();
    for c in message.lines().collect::<Vec<_>>().join(" ").chars() {
        if c.is_control() { line.extend(c.escape_default()) } else { line.push(c) }
    }
    line
}

/// Like [`printable`], cut at 400 characters.
pub(crate) fn single_line(text: &str) -> String {
    printable(text).chars().take(MAX_LINE).collect()
}

/// One line of bounded length: control characters and other invisible ones, line breaks included, become escapes.
pub fn escaped(text: &str) -> String {
    let mut line = String::new();
    for c in text.chars() {
        if line.len() >= MAX_ESCAPED {
            line.push_str(" ...");
            break;
        }
        match c {
            '\'' | '"' | '\\' => line.push(c),
            _ => line.extend(c.escape_debug()),
        }
    }
    line
}
