//! Signals during long work: old files are kept, no partial files are left, and a stream ends as usual.
#![cfg(unix)]

use crate::common::program::*;
use crate::common::wait::eventually;
use echolume::low_level::baselines::Stored;
use echolume::low_level::verify::report::{Run, Verdict};
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SIGNALS: [Signal; 3] = [Signal::INT, Signal::TERM, Signal::HUP];

fn start(program: &mut Command) -> Child {
    program.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("start the program")
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("send a signal");
}

#[test]
fn a_signal_leaves_no_half_written_file() {
    let folder = Folder::new("signals");
    let (mha, frames, sweep) = (folder.path("out.mha"), folder.path("out.frames"), folder.path("sweep.mha"));
    done(&["phantom", "--body", "constant", "--no-speckle", "--volumes", "6", "-o", &sweep]);
    fs::write(&mha, "old").expect("an old file");
    let before = folder.names();
    for (row, sent) in [
        (&["convert", SWEEP, &mha, "--spacing", "0.1"][..], Signal::INT),
        (&["convert", SWEEP, &mha, "--spacing", "0.1"], Signal::TERM),
        (&["convert", SWEEP, &mha, "--spacing", "0.1"], Signal::HUP),
        (&["phantom", "--volumes", "500", "-o", &mha], Signal::TERM),
        (&["convert", &sweep, &mha, "--sequence"], Signal::INT),
        (&["convert", &sweep, &frames], Signal::TERM),
    ] {
        let mut child = start(with_default_signals().args(row));
        let half = || folder.names().difference(&before).next().is_some();
        assert!(eventually(half), "{row:?} has begun nothing");
        signal(&child, sent);
        let began = Instant::now();
        let status = child.wait().expect("it ends");
        assert!(began.elapsed() < Duration::from_secs(5), "{row:?} took {:?} to end", began.elapsed());
        assert_eq!(status.signal(), Some(sent.as_raw()), "{row:?} ended with {status}");
        assert_eq!(folder.names(), before, "{row:?}");
        assert_eq!(fs::read(&mha).expect("the old file"), b"old", "{row:?}");
    }
}

#[test]
fn a_signal_ends_what_only_computes_at_once_and_nothing_is_left() {
    let folder = Folder::new("computing");
    let [png, json, md, dir] = ["out.png", "out.json", "out.md", "report"].map(|name| folder.path(name));
    let picture =
        folder.write("in.pgm", [b"P5 1500 1500 255\n".to_vec(), (0..1500 * 1500).map(|n| n as u8).collect()].concat());
    for (n, row) in [
        &["render", "-o", &png, "--size", "4096x4096", "--set", "ray.step=0.1"][..],
        &["profile", "--repeat", "10000", "--json", &json],
        &["verify", "--self-test", "--json", &json],
        &["report", "error", "--dial", "step", "-o", &dir],
        &["report", "tables", "--markdown", &md],
        &["filter", &picture, "--growth-table", "--csv", &json],
    ]
    .into_iter()
    .enumerate()
    {
        let mut child = start(with_default_signals().args(row));
        // It prints the chosen device before it begins.
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        assert!(line.starts_with("device: "), "{row:?} said {line:?}");
        let sent = SIGNALS[n % SIGNALS.len()];
        signal(&child, sent);
        assert_eq!(child.wait().expect("it ends").signal(), Some(sent.as_raw()), "{row:?}");
        let left: Vec<_> = folder.names().into_iter().filter(|name| name != "report" && name != "in.pgm").collect();
        assert!(left.is_empty(), "{row:?} left {left:?}");
    }
}

/// Every picture that is there is whole, and no other file is left.
#[test]
fn a_signal_ends_a_series_after_a_whole_picture() {
    let folder = Folder::new("series-stopped");
    let turn = folder.path("turn");
    let row = ["render", BONE, "--preset", "bone", "--size", "64x48", "--turntable", "3600", "-o", &turn];
    let mut child = start(with_default_signals().args(row));
    let second = folder.join("turn/picture-000001.png");
    assert!(eventually(|| second.exists()), "no pictures come");
    signal(&child, Signal::INT);
    let mut error = String::new();
    child.stderr.take().expect("its errors").read_to_string(&mut error).expect("text");
    assert_eq!(child.wait().expect("it ends").signal(), Some(Signal::INT.as_raw()), "{error}");
    assert!(error.contains("stopped by SIGINT after ") && error.contains(" of 3600 pictures"), "{error}");
    let there = Folder(turn.into());
    let names = there.names();
    assert!((2..3600).contains(&names.len()), "{}", names.len());
    for name in names {
        let read = echolume::low_level::picture::Picture::load(&there.join(&name));
        assert!(read.is_ok_and(|picture| picture.width == 64), "{name}");
    }
}

/// Results so far are written, and missing checks do not count as passed.
#[test]
fn a_signal_ends_verify_with_what_it_found() {
    let folder = Folder::new("verify-stopped");
    let [json, junit] = ["run.json", "run.xml"].map(|name| folder.path(name));
    let mut child =
        start(with_default_signals().args(["verify", "--only", "passes", "--json", &json, "--junit", &junit]));
    let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines().map_while(Result::ok);
    assert!(lines.next().expect("a line").starts_with("device: "));
    signal(&child, Signal::INT);
    let said: Vec<String> = lines.collect();
    let mut error = String::new();
    child.stderr.take().expect("its errors").read_to_string(&mut error).expect("text");
    assert_eq!(child.wait().expect("it ends").code(), Some(4), "{said:?}");
    assert!(said.iter().any(|line| line.starts_with("SIGINT: stopping after this check")), "{said:?}");
    let run = Run::from_json(&fs::read_to_string(&json).expect("written")).expect("read back");
    let (all, left) = (run.outcomes.len(), run.count(Verdict::Interrupted));
    assert_eq!(error.trim_end(), format!("echolume: SIGINT ended the run: {left} of {all} checks were not run"));
    let stopped = run.outcomes.iter().filter(|o| o.verdict == Verdict::Interrupted && o.notes == ["not run: SIGINT"]);
    assert!(stopped.count() == left && left > 20, "{:?}", run.outcomes);
    assert_eq!(Verdict::ALL.map(|verdict| run.count(verdict)).iter().sum::<usize>(), all);
    let last = said.last().expect("a summary");
    assert!(last.contains(&format!(", interrupted {left} in ")), "{last}");
    let document = fs::read_to_string(&junit).expect("written");
    assert_eq!(document.matches("<failure").count(), 0, "no check has failed");
    assert_eq!(document.matches("<error").count(), left, "a CI that reads nothing else is to see it");
}

/// The check that runs is not waited for: its process is killed, and it has not failed.
#[test]
fn a_signal_ends_an_isolated_run_at_once() {
    let folder = Folder::new("verify-isolated-stopped");
    let json = folder.path("run.json");
    let hang = ["--inject-crash", "hang:known answers / every level of a picture", "--json", &json];
    let chosen = ["verify", "--isolate", "--only", "every level of a picture", "--only", "a sphere in a sweep"];
    let mut child = start(with_default_signals().args(chosen).args(hang));
    let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines().map_while(Result::ok);
    assert!(lines.next().expect("a line").starts_with("device: "));
    signal(&child, Signal::INT);
    let said: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(4), "{said:?}");
    let run = Run::from_json(&fs::read_to_string(&json).expect("written")).expect("read back");
    assert_eq!((run.count(Verdict::Interrupted), run.outcomes.len()), (2, 2), "{:?}", run.outcomes);
    assert!(run.outcomes.iter().all(|o| o.faults.is_empty() && o.notes[0].ends_with("SIGINT")), "{:?}", run.outcomes);
}

#[test]
fn a_signal_ends_a_stream_with_its_summary_and_a_finished_recording() {
    let folder = Folder::new("stream");
    let started = SIGNALS.map(|sent| {
        let tape = folder.path(&format!("{}.frames", sent.as_raw()));
        let stream = ["stream", "--null", "--rate", "3", "--size", "24x24", "--mode", "mip", "--record", &tape];
        (sent, start(with_default_signals().args(stream)), tape)
    });
    for (sent, mut child, tape) in started {
        let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines().map_while(Result::ok);
        assert!(lines.any(|line| line.contains(" s  frames ")), "it streams");
        signal(&child, sent);
        let last = lines.last().expect("a last line");
        assert!(last.contains("volumes shown"), "{last}");
        assert_eq!(child.wait().expect("it ends").code(), Some(0));
        assert!(done(&["info", &tape]).contains("as it was written"), "the index is missing");
    }
}

#[test]
fn a_stream_that_nobody_listens_to_and_nothing_keeps_ends() {
    let small = ["stream", "--null", "--rate", "3", "--size", "24x24", "--mode", "mip"];
    let mut child = start(Command::new(PROGRAM).args(small));
    drop(child.stdout.take());
    assert!(eventually(|| child.try_wait().expect("wait for it").is_some()), "it goes on for nobody");
    assert_eq!(child.wait().expect("it has ended").code(), Some(0));
}

#[test]
fn a_signal_that_was_to_be_ignored_does_not_end_what_is_written() {
    let folder = Folder::new("nohup");
    let out = folder.path("out.mha");
    let mut ignoring = Command::new("sh");
    ignoring.args(["-c", "trap '' HUP; exec \"$@\"", "sh", PROGRAM, "convert", SWEEP, &out, "--spacing", "0.5"]);
    let mut child = start(&mut ignoring);
    assert!(eventually(|| !folder.names().is_empty()), "it writes");
    signal(&child, Signal::HUP);
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    assert_eq!(folder.names().into_iter().collect::<Vec<_>>(), ["out.mha"]);
}
