//! `echolume verify --isolate`: checks in processes of their own, of which one may crash, hang or exit.

use crate::common::program::*;
use echolume::low_level::baselines::Stored;
use echolume::low_level::verify::report::{Run, Unit, Verdict};
use std::fs;

/// Checks that take no time; one with pictures.
const FEW: [&str; 6] = ["--only", "a sphere in a sweep", "--only", "every level of a picture", "--only", "block"];

fn ran(folder: &Folder, name: &str, more: &[&str]) -> (Option<i32>, String, Run) {
    let file = folder.path(name);
    let pictures = folder.path("pictures");
    let common = ["verify", "--json", &file, "--pictures", &pictures];
    let (code, out, err) = run(&[&common, &FEW[..], more].concat());
    let said = format!("{out}{err}");
    let text = fs::read_to_string(&file).unwrap_or_else(|e| panic!("{e}: {said}"));
    (code, said, Run::from_json(&text).expect("read back"))
}

/// Without what depends on the moment.
fn timeless(mut run: Run) -> Run {
    (run.seconds, run.date, run.device.clocks) = (0.0, String::new(), None);
    for outcome in &mut run.outcomes {
        outcome.seconds = 0.0;
        outcome.figures.retain(|figure| figure.unit != Unit::Ns);
    }
    run
}

/// The embedded pictures of a page.
fn pictures(page: &str) -> Vec<String> {
    let text = fs::read_to_string(page).expect("written");
    text.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(String::from).collect()
}

#[test]
fn checks_in_processes_of_their_own_have_the_same_results() {
    let folder = Folder::new("verify-isolated");
    let pages = ["here.html", "isolated.html"].map(|name| folder.path(name));
    let (code, said, here) = ran(&folder, "here.json", &["--html", &pages[0]]);
    assert_eq!(code, Some(0), "{said}");
    let (code, said, isolated) = ran(&folder, "isolated.json", &["--isolate", "--html", &pages[1]]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(timeless(here), timeless(isolated));
    let [here, isolated] = [&pages[0], &pages[1]].map(|page| pictures(page));
    assert!(here.len() >= 3 && here == isolated, "{} and {} pictures", here.len(), isolated.len());
}

#[test]
fn a_check_that_crashes_or_hangs_is_one_failed_case_and_the_rest_goes_on() {
    let folder = Folder::new("verify-crash");
    for (kind, named) in [
        ("segv", "its process was ended by signal 11 (SIGSEGV)"),
        ("abort", "its process was ended by signal 6 (SIGABRT)"),
        ("exit", "its process ended with exit code 7"),
        ("hang", "did not end within 8 s; its process was killed"),
    ] {
        let junit = folder.path(&format!("{kind}.xml"));
        let crash = format!("{kind}:known answers / every level of a picture");
        let flags = ["--isolate", "--check-timeout", "8", "--inject-crash", &crash, "--junit", &junit];
        let (code, said, run) = ran(&folder, &format!("{kind}.json"), &flags);
        assert_eq!(code, Some(1), "{kind}: {said}");
        assert!(said.contains("1 of ") && said.contains("checks failed"), "{said}");
        let failed: Vec<_> = run.failures().collect();
        assert_eq!(failed.len(), 1, "{kind}: {failed:?}");
        assert_eq!((failed[0].name.as_str(), failed[0].faults.len()), ("every level of a picture", 1));
        assert_eq!(failed[0].faults[0].what, named);
        assert!(run.count(Verdict::Passed) >= 2 && run.count(Verdict::Passed) == run.outcomes.len() - 1, "{said}");
        let document = fs::read_to_string(&junit).expect("written");
        assert_eq!(document.matches("<failure").count(), 1, "{document}");
        assert!(document.contains(named), "{document}");
    }
}

/// A check that passes when it is run again does not fail the run, but is counted; one that passes only while the host waits for each submission is
/// told from others.
#[test]
fn flakes_and_missing_synchronization_are_told_from_other_failures() {
    let folder = Folder::new("verify-flake");
    let named = |kind: &str| format!("{kind}:known answers / every level of a picture");
    for isolated in ["--isolate", "--no-isolate"] {
        let junit = folder.path("flake.xml");
        let flags = [isolated, "--inject-crash", &named("flake"), "--junit", &junit];
        let (code, said, run) = ran(&folder, "flake.json", &flags);
        assert_eq!(code, Some(0), "{said}");
        assert!(said.contains(" (flaky: 1), failed 0"), "{said}");
        let flaky: Vec<_> = run.outcomes.iter().filter(|o| o.failed_before > 0).collect();
        assert_eq!(flaky.len(), 1);
        assert_eq!((flaky[0].failed_before, &flaky[0].notes[0][..]), (1, "flaky: it failed 1 of 2 times: injected"));
        assert!(fs::read_to_string(&junit).expect("written").contains("<flakyFailure"));

        let flags = [isolated, "--inject-crash", &named("unsynchronized")];
        let (code, said, run) = ran(&folder, "unsynchronized.json", &flags);
        assert_eq!(code, Some(1), "{said}");
        let failed: Vec<_> = run.failures().collect();
        assert!(failed.len() == 1 && failed[0].notes.iter().any(|n| n.contains("synchronization")), "{failed:?}");
    }
}

/// A driver that crashes or hangs before the first check is one failed check in every report, and names the call where one was begun.
#[test]
fn a_device_that_cannot_be_started_is_a_failed_check() {
    let folder = Folder::new("verify-start");
    let junit = folder.path("start.xml");
    let (code, said, run) =
        ran(&folder, "start.json", &["--isolate", "--inject-crash", "segv:start", "--junit", &junit]);
    assert_eq!(code, Some(1), "{said}");
    assert_eq!(run.outcomes.len(), 1);
    assert_eq!((run.outcomes[0].name.as_str(), run.outcomes[0].verdict), ("start of the device", Verdict::Failed));
    let what = &run.outcomes[0].faults[0].what;
    assert!(what.contains("signal 11 (SIGSEGV)") && what.contains("before the first check"), "{what}");
    assert_eq!(fs::read_to_string(&junit).expect("written").matches("<failure").count(), 1);
    let (code, said, _) = ran(&folder, "bisect.json", &["--bisect", "--inject-crash", "segv:start"]);
    assert_eq!(code, Some(125), "{said}");
    let without = finish(without_device(std::process::Command::new(PROGRAM).args(["verify", "--bisect"])));
    refuses(&["no driver"], &without, 125, &["no Vulkan device"]);
}

/// It is the isolation that saves the rest.
#[test]
fn a_crash_in_the_same_process_ends_the_run() {
    let flags = ["--no-isolate", "--inject-crash", "exit:known answers / every level of a picture"];
    let (code, out, err) = run(&[&["verify"], &FEW[..], &flags].concat());
    assert_eq!(code, Some(7), "{out}{err}");
    assert!(!out.contains("passed "), "{out}");
    // A full run isolates its checks unless told otherwise.
    let folder = Folder::new("verify-full-crash");
    let file = folder.path("run.json");
    let crash = "exit:known answers / every level of a picture";
    let only = ["--only", "every level of a picture", "--only", "a sphere in a sweep"];
    let (code, out, err) = run(&[&["verify", "--full", "--json", &file, "--inject-crash", crash], &only[..]].concat());
    assert_eq!(code, Some(1), "{out}{err}");
    let full = Run::from_json(&fs::read_to_string(&file).expect("written")).expect("read back");
    assert_eq!((full.count(Verdict::Failed), full.count(Verdict::Passed)), (1, 1), "{out}");
}

#[test]
fn an_isolated_run_without_a_device_or_with_a_wrong_flag_is_refused_like_any_other() {
    let without = finish(without_device(std::process::Command::new(PROGRAM).args(["verify", "--isolate"])));
    refuses(&["no driver"], &without, 3, &["no Vulkan device"]);
    let wrong = run(&["verify", "--isolate", "--only", "no such check"]);
    refuses(&["--only"], &wrong, 2, &["--list"]);
    let device = run(&["verify", "--isolate", "--device", "no such card"]);
    refuses(&["--device"], &device, 3, &["no such card", "available"]);
    for flags in [["--isolate", "--no-isolate"], ["--isolate", "--self-test"], ["--check-timeout", "0"]] {
        let (code, _, err) = run(&[&["verify"], &flags[..]].concat());
        assert!(code == Some(2) && err.contains("--help"), "{flags:?}: {err}");
    }
}
