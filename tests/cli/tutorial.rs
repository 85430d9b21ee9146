//! docs/tutorial.md: a test runs every command of the page and compares what it prints with the page.
//!
//! Each part below a heading `## ` is run in a folder of its own, where `tests` is that of the repository and `echolume` the program under test.
//! A block of code that begins with ```` ```console ```` holds commands behind `$ ` and what they print. A line `...` stands for any lines, and
//! widths of columns do not count. Comments right above a block, which a reader does not see, say what else may differ:
//!
//! - `<!-- varies: A | B -->`: each of these texts of the block stands for any text;
//! - `<!-- numbers vary -->`: each number stands for any other;
//! - `<!-- exit codes: 0 1 -->`: commands of the block may end with any of these.
//!
//! A picture `tutorial-NAME.png` on the page is the `NAME.png` that its part writes.
#![cfg(unix)]

use crate::common::files::repository;
use crate::common::program::*;
use echolume::low_level::picture::Picture;
use std::collections::BTreeSet;
use std::os::unix::fs::symlink;
use std::process::Command;
use std::sync::Mutex;

/// Stands for any text in an expected line.
const ANY: char = '\u{1}';

/// What may differ between the page and a run.
#[derive(Default, Clone)]
struct Varying {
    texts: Vec<String>,
    numbers: bool,
    exit_codes: Vec<i32>,
}

/// A command, the lines that the page shows below it, and what may differ.
struct Step {
    command: String,
    lines: Vec<String>,
    varying: Varying,
}

/// The parts of a page that have commands: the heading and the steps of each.
fn sessions(page: &str) -> Vec<(String, Vec<Step>)> {
    let mut found: Vec<(String, Vec<Step>)> = Vec::new();
    let (mut varying, mut is_block) = (Varying::default(), false);
    for line in page.lines() {
        let comment = |start: &str| line.strip_prefix(start).and_then(|rest| rest.strip_suffix(" -->"));
        if is_block && line == "```" {
            (varying, is_block) = (Varying::default(), false);
        } else if is_block {
            let (_, steps) = found.last_mut().expect("a heading before the first block");
            match (line.strip_prefix("$ "), steps.last_mut()) {
                (Some(command), _) => {
                    steps.push(Step { command: command.into(), lines: Vec::new(), varying: varying.clone() });
                }
                (None, Some(step)) => step.lines.push(line.into()),
                (None, None) => panic!("a block begins without a command: {line}"),
            }
        } else if let Some(heading) = line.strip_prefix("## ") {
            found.push((heading.into(), Vec::new()));
        } else if let Some(texts) = comment("<!-- varies: ") {
            varying.texts.extend(texts.split(" | ").map(str::to_string));
        } else if line == "<!-- numbers vary -->" {
            varying.numbers = true;
        } else if let Some(codes) = comment("<!-- exit codes: ") {
            varying.exit_codes.extend(codes.split(' ').map(|code| code.parse::<i32>().expect("an exit code")));
        }
        is_block |= line == "```console";
    }
    found.retain(|(_, steps)| !steps.is_empty());
    found
}

/// A line with single spaces; where numbers vary, each is a `#`, whatever its sign.
fn plain(line: &str, numbers: bool) -> String {
    let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
    if !numbers {
        return line;
    }
    let mut text = String::new();
    for c in line.chars() {
        if c.is_ascii_digit() && [" -", " +", ",-"].iter().any(|sign| text.ends_with(sign)) {
            text.pop();
        }
        let goes_on = text.ends_with('#') && (c.is_ascii_digit() || c == '.');
        if !goes_on {
            text.push(if c.is_ascii_digit() { '#' } else { c });
        }
    }
    text
}

/// True if a printed line is that of the page.
fn line_matches(expected: &str, printed: &str, varying: &Varying) -> bool {
    let with_any = varying.texts.iter().fold(expected.to_string(), |line, text| line.replace(text, &ANY.to_string()));
    let (expected, printed) = (plain(&with_any, varying.numbers), plain(printed, varying.numbers));
    let Some((first, others)) = expected.split_once(ANY) else { return expected == printed };
    let Some(mut rest) = printed.strip_prefix(first) else { return false };
    let parts: Vec<&str> = others.split(ANY).collect();
    let (last, middle) = parts.split_last().expect("at least one part");
    for part in middle {
        let Some((_, after)) = rest.split_once(part) else { return false };
        rest = after;
    }
    rest.ends_with(last)
}

/// True if the printed lines are those of the page.
fn lines_match(expected: &[String], printed: &[&str], varying: &Varying) -> bool {
    match (expected.split_first(), printed.split_first()) {
        (None, None) => true,
        (Some((line, after)), _) if line == "..." => {
            (0..=printed.len()).any(|skipped| lines_match(after, &printed[skipped..], varying))
        }
        (Some((line, after)), Some((first, rest))) => {
            line_matches(line, first, varying) && lines_match(after, rest, varying)
        }
        _ => false,
    }
}

/// True if two pictures are the same but for what two devices may differ in: a hundredth of the channels.
fn is_same_picture(page: &Picture, written: &Picture) -> bool {
    let channels = page.rgba.iter().zip(&written.rgba);
    let differing = channels.filter(|(a, b)| a.abs_diff(**b) > 8).count();
    (page.width, page.height) == (written.width, written.height) && 100 * differing < page.rgba.len()
}

/// Runs the steps of a session, and says which of them do not print what the page shows, or write another picture. Removes the names of the
/// pictures that it writes from `pictures`.
fn faults(steps: &[Step], pictures: &Mutex<BTreeSet<String>>) -> Vec<String> {
    let folder = Folder::new("tutorial");
    let programs = folder.join("bin");
    std::fs::create_dir(&programs).expect("a folder");
    symlink(PROGRAM, programs.join("echolume")).expect("a link to the program");
    symlink(repository("tests"), folder.join("tests")).expect("a link to the test data");
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let mut faults = Vec::new();
    for step in steps {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("exec 2>&1\n{}", step.command)]).current_dir(&folder.0);
        let (code, printed, _) = finish(shell.env("PATH", &path).env("COLUMNS", "100").env_remove("RUST_LOG"));
        let allowed = if step.varying.exit_codes.is_empty() { &[0][..] } else { &step.varying.exit_codes };
        let lines: Vec<&str> = printed.lines().collect();
        let is_right =
            code.is_some_and(|code| allowed.contains(&code)) && lines_match(&step.lines, &lines, &step.varying);
        if !is_right {
            faults.push(format!("$ {}\nends with {code:?} and prints\n{printed}", step.command));
        }
    }
    for name in pictures.lock().expect("pictures").extract_if(.., |name| folder.join(name).is_file()) {
        let [page, written] = [repository(&format!("docs/pictures/tutorial-{name}")), folder.join(&name)]
            .map(|path| Picture::load(&path).expect("a picture"));
        if !is_same_picture(&page, &written) {
            faults.push(format!("docs/pictures/tutorial-{name} is not what the commands write: run tools/pictures"));
        }
    }
    faults
}

#[test]
fn commands_of_the_tutorial_print_what_it_shows() {
    let page = std::fs::read_to_string(repository("docs/tutorial.md")).expect("the tutorial");
    let sessions = sessions(&page);
    assert_eq!(sessions.len(), 6, "{:?}", sessions.iter().map(|(heading, _)| heading).collect::<Vec<_>>());
    let shown =
        page.split("](pictures/tutorial-").skip(1).map(|rest| rest.split_once(')').expect("a link").0.to_string());
    let pictures = Mutex::new(shown.collect::<BTreeSet<String>>());
    assert!(!pictures.lock().expect("pictures").is_empty(), "the page shows no picture");
    let faults: Vec<String> = std::thread::scope(|scope| {
        let run = |steps| faults(steps, &pictures);
        let threads: Vec<_> = sessions.iter().map(|(_, steps)| scope.spawn(move || run(steps))).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("a session ends")).collect()
    });
    assert!(faults.is_empty(), "docs/tutorial.md: {}", faults.join("\n"));
    assert!(pictures.lock().expect("pictures").is_empty(), "no command writes {pictures:?}");
}

#[test]
fn what_a_page_may_leave_open_is_what_its_comments_say() {
    let page = "## A\n<!-- varies: gpu | 3 ms -->\n```console\n$ a b\ndevice: gpu, 3 ms\n...\nend\n$ c\n```\n## None\n## B\n\
                <!-- numbers vary -->\n<!-- exit codes: 0 5 -->\n```console\n$ d\nt   1.5 s\n```\n";
    let sessions = sessions(page);
    assert_eq!(
        sessions.iter().map(|(name, steps)| (name.as_str(), steps.len())).collect::<Vec<_>>(),
        [("A", 2), ("B", 1)]
    );
    let [a, d] = [&sessions[0].1[0], &sessions[1].1[0]];
    assert_eq!((a.command.as_str(), a.lines.len(), d.varying.exit_codes.as_slice()), ("a b", 3, &[0, 5][..]));
    for (step, printed, expected) in [
        (a, "device: llvmpipe, 20.1 ms\nend", true),
        (a, "device: llvmpipe, 20.1 ms\nx\ny\nend", true),
        (a, "device: llvmpipe; 20.1 ms\nend", false),
        (a, "device: llvmpipe, 20.1 ms\nend\nx", false),
        (a, "device: llvmpipe, 20.1 ms", false),
        (d, "t 12.25 s", true),
        (d, "t   1.5 ms", false),
        (d, "t s", false),
        (d, "", false),
    ] {
        let lines: Vec<&str> = printed.lines().collect();
        assert_eq!(lines_match(&step.lines, &lines, &step.varying), expected, "{printed}");
    }
    let signed = Varying { numbers: true, ..Varying::default() };
    assert!(line_matches("a -1.5 b", "a +20 b", &signed) && !line_matches("a -1.5 b", "a b", &signed));
    // Without a comment nothing may differ but the widths of columns.
    assert!(line_matches("a  1", "a 1", &Varying::default()) && !line_matches("a 1", "a 2", &Varying::default()));
}
