//! `echolume verify` as CI and a cart call it: its exit codes, its files, and the comparison with an earlier run.

use crate::common::files::repository;
use crate::common::program::*;
use echolume::low_level::baselines::Stored;
use echolume::low_level::verify::report::{Level, Run, Unit, Verdict};
use echolume::low_level::verify::self_test;
use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

/// Checks that take no time.
const FEW: [&str; 4] = ["--only", "a sphere in a sweep", "--only", "every level of a picture"];

fn verify(more: &[&str]) -> Ran {
    run(&[&["verify"], more].concat())
}

fn kept(folder: &Folder, name: &str, more: &[&str]) -> (String, Run) {
    let file = folder.path(name);
    let (code, out, err) = verify(&[more, &["--json", &file]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    (file.clone(), Run::from_json(&fs::read_to_string(&file).expect("written")).expect("read back"))
}

/// Groups that the command runs, and those that tests/gpu runs in its own process, in passes.rs and verify_groups.rs: all of them would take a
/// quarter of the gate's time for this command, whose pipelines validation inspects one by one.
const GROUPS: [&str; 5] = ["known answers", "modes", "sampling", "speed", "time stamps"];
const GROUPS_OF_GPU: [&str; 8] =
    ["determinism", "failures", "formats", "hazards", "memory", "passes", "specialization", "stress"];

#[test]
fn no_group_of_checks_is_left_out() {
    let groups: BTreeSet<&str> =
        echolume::low_level::verify::checks(Level::Quick).iter().map(|check| check.group).collect();
    assert_eq!(groups, GROUPS.into_iter().chain(GROUPS_OF_GPU).collect());
}

/// All quick checks of these groups pass on this device, and every report file says so.
#[test]
fn every_quick_check_passes_on_this_device() {
    let folder = Folder::new("verify-quick");
    let [junit, html] = ["junit.xml", "page.html"].map(|name| folder.path(name));
    let pictures = folder.path("pictures");
    let mut arguments = vec!["--quick", "--junit", &junit, "--html", &html, "--pictures", &pictures];
    GROUPS.iter().for_each(|group| arguments.extend(["--only", group]));
    let (_, run) = kept(&folder, "run.json", &arguments);
    println!("{} checks in {:.0} s on {}", run.outcomes.len(), run.seconds, run.device.name);
    for outcome in run.outcomes.iter().filter(|o| o.verdict == Verdict::LeftOut) {
        println!("left out: {} / {}: {}", outcome.group, outcome.name, outcome.notes.join("; "));
    }
    assert!(run.validation, "the tests need the validation layer");
    assert!(run.outcomes.len() > 90 && run.count(Verdict::LeftOut) < 10, "{} checks", run.outcomes.len());
    let document = fs::read_to_string(&junit).expect("written");
    let document = roxmltree::Document::parse(&document).expect("XML");
    let root = document.root_element();
    assert_eq!((root.tag_name().name(), root.attribute("failures")), ("testsuites", Some("0")));
    let cases = document.descendants().filter(|n| n.has_tag_name("testcase")).count();
    assert_eq!(cases, run.outcomes.len());
    let page = fs::read_to_string(&html).expect("written");
    assert!(page.contains("data:image/png;base64,") && page.contains(&run.device.name));
    assert!(!std::path::Path::new(&pictures).exists(), "there is nothing to show");
}

/// Every injected fault and every dropped barrier is caught, and a run without a fault reports nothing.
#[test]
fn every_injected_fault_and_every_dropped_barrier_is_caught() {
    let folder = Folder::new("verify-self-test");
    let (_, run) = kept(&folder, "run.json", &["--self-test"]);
    let planted = self_test::faults().count();
    // In addition: barriers checked by the oracle, barriers checked by the layer, no fault, and a crash.
    assert!(planted >= 24 && run.outcomes.len() == planted + 4, "{planted} of {}", run.outcomes.len());
    let caught: Vec<String> = run.outcomes.iter().map(|o| format!("{}: {}", o.name, o.notes.join("; "))).collect();
    println!("{}", caught.join("\n"));
    // Its memory is coherent.
    let untested: Vec<&str> =
        run.outcomes.iter().filter(|o| o.verdict == Verdict::LeftOut).map(|o| o.name.as_str()).collect();
    assert_eq!(untested, ["vkInvalidateMappedMemoryRanges"]);
    assert_eq!(run.count(Verdict::Passed), run.outcomes.len() - untested.len());
    // More than one kind of check is needed.
    let by = |group: &str| caught.iter().filter(|c| c.contains(&format!("caught by {group}"))).count();
    assert!(by("passes") > 10 && by("known answers") > 3 && by("the barrier oracle") == 1, "{caught:?}");
    assert_eq!(by("synchronization validation"), 1, "{caught:?}");
    // Every bug of the history was recreated, and says where it was met.
    let bugs = self_test::KNOWN_BUGS;
    assert!(bugs.len() >= 10, "{}", bugs.len());
    for bug in bugs {
        let outcome = run.outcomes.iter().find(|o| o.name == bug.fault).unwrap_or_else(|| panic!("{}", bug.fault));
        assert!(outcome.notes.iter().any(|note| note.contains(bug.source)), "{:?}", outcome.notes);
    }
}

/// The page names each public bug with its source and the fault that recreates it, and no other.
#[test]
fn the_page_lists_every_known_bug() {
    let page = fs::read_to_string(repository("docs/verify.md")).expect("the page");
    let section = page.split("\n## ").find(|section| section.starts_with("Known bugs\n")).expect("the section");
    let rows: Vec<&str> = section.lines().filter(|line| line.starts_with("| ")).collect();
    assert_eq!(rows.len(), self_test::KNOWN_BUGS.len() + 1, "a head, and a row for each");
    for (row, bug) in rows[1..].iter().zip(self_test::KNOWN_BUGS) {
        let source = bug.source.strip_prefix("https://").map_or(bug.source.into(), |_| format!("<{}>", bug.source));
        assert_eq!(*row, format!("| {} | {} | {} | {source} |", bug.fault, bug.driver, bug.what));
    }
}

#[test]
fn a_run_like_the_baseline_has_not_changed_and_one_that_is_slower_or_wrong_has() {
    let folder = Folder::new("verify-baseline");
    // A check by its line of --list.
    let (_, one) = kept(&folder, "one.json", &["--only", "passes / median_distance"]);
    assert_eq!(one.outcomes.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["median_distance"]);
    let chosen = [&FEW[..], &["--only", "median_distance"]].concat();
    let (file, earlier) = kept(&folder, "before.json", &chosen);
    let again = |name: &str, changed: &Run, threshold: &str| {
        let file = folder.write(name, changed.to_json().expect("JSON"));
        verify(&[&chosen[..], &["--baseline", &file, "--threshold", threshold]].concat())
    };
    // A busy machine is no slower device: any time passes that is not a hundred times longer.
    let (code, out, err) = verify(&[&chosen[..], &["--baseline", &file, "--threshold", "100"]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("compared with"), "{out}");
    // In the earlier run everything took a millionth of the time.
    let mut quick = earlier.clone();
    for figure in quick.outcomes.iter_mut().flat_map(|o| &mut o.figures).filter(|f| f.unit == Unit::Ns) {
        figure.value /= 1e6;
        figure.samples.iter_mut().for_each(|s| *s /= 1e6);
    }
    let (code, out, err) = again("quick.json", &quick, "100");
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("slower") && err.contains("became worse since the baseline"), "{out}{err}");
    // In the earlier run the sphere had a thousandth of the error: reported, and no failure.
    let mut exact = earlier.clone();
    let sphere = exact.outcomes.iter_mut().find(|o| o.name == "a sphere in a sweep").expect("it was run");
    sphere.figures[0].value /= 1e3;
    let (code, out, err) = again("exact.json", &exact, "100");
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("a sphere in a sweep: largest error") && out.contains("still under"), "{out}");
}

#[test]
fn refusals_of_verify_are_one_line_with_their_own_exit_code() {
    let folder = Folder::new("verify-refused");
    let text = folder.write("text.json", "no baseline");
    let other = folder.write("other.json", "{\"format\": \"somebody else's\"}");
    for (more, named) in [
        (vec!["--baseline", "/nowhere/run.json"], "--baseline /nowhere/run.json: cannot be read"),
        (vec!["--baseline", &text], "text.json"),
        (vec!["--baseline", &other], "somebody else's"),
        (vec!["--baseline", "/dev/zero"], "is not a regular file"),
        (vec!["--baseline", &text, "--threshold", "0.5"], "threshold"),
        (vec!["--only", "no such check"], "--list"),
        (vec!["--only", "passes / no such pass"], "--list"),
        (
            vec!["--list", "--only", "passes / median_slice", "--only", "no such check"],
            "--only no such check: no check",
        ),
    ] {
        refuses(&more, &verify(&more), 2, &[named]);
    }
    refuses(&["--json"], &verify(&["--json", &folder.path("none/run.json")]), 1, &["there is no folder"]);
    let full = verify(&[&FEW[..], &["--json", "/dev/full"]].concat());
    refuses(&["--json"], &full, 1, &["/dev/full: cannot be written"]);
    let (code, _, err) = verify(&["--quick", "--full"]);
    assert!(code == Some(2) && err.contains("cannot be used with"), "{err}");
    refuses(&["--device"], &verify(&["--device", "no such card"]), 3, &["no such card", "available"]);
    let without = finish(without_device(Command::new(PROGRAM).arg("verify")));
    refuses(&["no driver"], &without, 3, &["no Vulkan device"]);
    assert_eq!(folder.names().len(), 2, "{:?}", folder.names());
}

#[test]
fn a_device_against_itself_draws_the_same() {
    let (code, out, err) = verify(&["--against", "0", "--only", "volume", "--only", "planes"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("against: ") && out.contains("failed 0"), "{out}");
}
