//! Signal handlers: each case runs in its own process, which sends the signals to itself.
#![cfg(target_os = "linux")]

use crate::common::files::Folder;
use crate::common::own_process;
use crate::common::wait;
use echolume::low_level::files::Unfinished;
use echolume::low_level::files::signals::{Held, Writing};
use rustix::process::{Signal, getpid, kill_process};
use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::time::Duration;

const SURVIVED: i32 = 42;

fn send(signal: Signal) {
    kill_process(getpid(), signal).expect("a signal");
}

/// Any thread may receive the signal: it takes a moment.
fn eventually(signal: impl Fn() -> Option<&'static str>) -> Option<&'static str> {
    Some(wait::until("the signal", signal))
}

/// True while a signal that was sent to this process has reached none of its threads (proc(5): `ShdPnd`).
fn is_pending() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let pending = status.lines().find_map(|line| line.strip_prefix("ShdPnd:")).expect("it is listed");
    pending.trim().bytes().any(|digit| digit != b'0')
}

fn file() -> PathBuf {
    PathBuf::from(std::env::var_os("SIGNALS_FILE").expect("a name"))
}

/// A name, what runs in the child process, and the signal that must end it.
type Case = (&'static str, fn(), Option<Signal>);

const CASES: &[Case] = &[
    ("nobody", || send(Signal::TERM), Some(Signal::TERM)),
    (
        "patient",
        || {
            let held = Held::take();
            (0..3).for_each(|_| send(Signal::TERM));
            assert_eq!(eventually(|| held.signal()), Some("SIGTERM"));
            // While it is held: one of them may arrive late.
            std::process::exit(SURVIVED);
        },
        None,
    ),
    (
        "first",
        || {
            let held = Held::first();
            send(Signal::INT);
            assert_eq!(eventually(|| held.signal()), Some("SIGINT"));
            send(Signal::TERM);
        },
        Some(Signal::TERM),
    ),
    (
        "patience-wins",
        || {
            let (first, patient) = (Held::first(), Held::take());
            (0..3).for_each(|_| send(Signal::HUP));
            assert_eq!(eventually(|| first.signal()), Some("SIGHUP"));
            // The other two may not have arrived yet.
            wait::until("all of them", || (!is_pending()).then_some(()));
            wait::watch(Duration::from_millis(20));
            drop(patient);
            assert_eq!(first.signal(), Some("SIGHUP"));
        },
        None,
    ),
    (
        "told-and-gone",
        || {
            let held = Held::first();
            send(Signal::TERM);
            assert_eq!(eventually(|| held.signal()), Some("SIGTERM"));
            drop(held);
            assert_eq!(Held::first().signal(), None);
            send(Signal::HUP);
        },
        Some(Signal::HUP),
    ),
    (
        "writing",
        || {
            let mut unfinished = Unfinished::create(&file()).expect("a file");
            unfinished.write_all(b"half").expect("written");
            let writing = Writing::begin();
            send(Signal::INT);
            assert_eq!(eventually(|| writing.signal()), Some("SIGINT"));
            drop(writing);
            let stopped = unfinished.finish().expect_err("nothing more is taken");
            assert_eq!(stopped.to_string(), "stopped by SIGINT");
            drop(unfinished);
        },
        Some(Signal::INT),
    ),
    (
        "written",
        || {
            let writing = Writing::begin();
            echolume::low_level::files::replace(&file(), b"new").expect("written");
            send(Signal::TERM);
            assert_eq!(eventually(|| writing.signal()), Some("SIGTERM"));
            drop(writing);
        },
        Some(Signal::TERM),
    ),
    (
        "written-while-held",
        || {
            let held = Held::first();
            send(Signal::TERM);
            assert_eq!(eventually(|| held.signal()), Some("SIGTERM"));
            echolume::low_level::files::replace(&file(), b"new").expect("whoever holds it says what it means");
        },
        None,
    ),
];

/// Runs one case, in the process that `run` starts.
#[test]
fn child() {
    if !own_process::is_child() {
        return;
    }
    let name = std::env::var("SIGNALS_CASE").expect("a case");
    let (_, run, ends) = CASES.iter().find(|case| case.0 == name).expect("a known case");
    run();
    if ends.is_some() {
        wait::watch(Duration::from_secs(10));
    }
    std::process::exit(SURVIVED);
}

fn run(name: &str, file: &Path) -> ExitStatus {
    let mut child = own_process::command("signals::child");
    child.env("SIGNALS_CASE", name).env("SIGNALS_FILE", file).output().expect("it runs").status
}

#[test]
fn a_signal_reaches_its_holder_and_otherwise_ends_the_process() {
    let folder = Folder::new("signals");
    for (name, _, ends) in CASES {
        let file = folder.join("file");
        std::fs::write(&file, "old").expect("written");
        let status = run(name, &file);
        match ends {
            Some(signal) => assert_eq!(status.signal(), Some(signal.as_raw()), "{name}: {status}"),
            None => assert_eq!(status.code(), Some(SURVIVED), "{name}: {status}"),
        }
        let expected = if name.starts_with("written") { "new" } else { "old" };
        assert_eq!(std::fs::read_to_string(&file).expect("read"), expected, "{name}");
        assert_eq!(folder.names().len(), 1, "{name} left something");
    }
}
