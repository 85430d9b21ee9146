//! Progress as lines of text for the program that started this one. The viewer shows the progress of an export by them.

use crate::sync::locked;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};
use std::fmt::{self, Debug, Formatter};
use std::io::{self, Write};
use std::sync::Mutex;

/// The environment variable that requests progress lines, and the value that it must have.
pub const ASKED_BY: (&str, &str) = ("ECHOLUME_PROGRESS", "lines");
/// What a line begins with.
const PREFIX: &str = "progress: ";
/// Most lines a second.
const RATE: u8 = 10;

/// Progress of a task: `done` of `of` steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    pub done: u64,
    pub of: u64,
}

/// Parses a line such as `progress: 12/72 pictures`. None if the line is something else.
pub fn parse(line: &str) -> Option<Progress> {
    let (done, rest) = line.strip_prefix(PREFIX)?.split_once('/')?;
    let of = rest.split_whitespace().next()?;
    Some(Progress { done: done.parse().ok()?, of: of.parse().ok()? })
}

/// True if the environment asks for progress lines ([`ASKED_BY`]).
pub fn is_asked() -> bool {
    std::env::var_os(ASKED_BY.0).is_some_and(|value| value == ASKED_BY.1)
}

/// A bar of `count` steps that does not draw itself but writes lines such as `progress: 12/72 pictures` to standard error.
pub fn bar(count: u64) -> ProgressBar {
    to(count, io::stderr())
}

fn to(count: u64, output: impl Write + Send + 'static) -> ProgressBar {
    let target = ProgressDrawTarget::term_like_with_hz(Box::new(Lines(Mutex::new(Box::new(output)))), RATE);
    let style = ProgressStyle::with_template("{pos}/{len} {msg}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(count), target).with_style(style)
}

/// A terminal without a cursor: each drawing is a line of its own.
struct Lines(Mutex<Box<dyn Write + Send>>);

impl Debug for Lines {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("Lines")
    }
}

impl Lines {
    fn write(&self, text: &str) -> io::Result<()> {
        let text = text.trim();
        if text.is_empty() {
            return Ok(());
        }
        writeln!(locked(&self.0), "{PREFIX}{text}")
    }
}

impl TermLike for Lines {
    fn width(&self) -> u16 {
        200
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.write(text)
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.write(text)
    }

    fn clear_line(&self) -> io::Result<()> {
        Ok(())
    }

    fn flush(&self) -> io::Result<()> {
        locked(&self.0).flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            locked(&self.0).extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_bar_writes_lines_that_say_how_far_it_is_and_are_read_again() {
        let written = Shared::default();
        let bar = to(72, written.clone()).with_message("pictures");
        for _ in 0..30 {
            bar.inc(1);
            bar.tick();
            std::thread::sleep(std::time::Duration::from_millis(8));
        }
        drop(bar);
        let text = String::from_utf8(written.0.lock().expect("lock").clone()).expect("text");
        let found: Vec<Progress> = text.lines().map(|line| parse(line).expect(line)).collect();
        assert!(found.len() > 1, "{text}");
        assert!(found.iter().all(|at| at.of == 72 && at.done <= 30), "{text}");
        assert!(found.windows(2).all(|two| two[0].done <= two[1].done), "{text}");
        for other in ["", "progress: ", "progress: a/b", "progress: 3", "error: 3/4", "progress: -1/4", "12/72"] {
            assert_eq!(parse(other), None, "{other}");
        }
    }
}
