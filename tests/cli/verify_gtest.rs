//! `echolume verify` as a runner of GoogleTest programs drives it. The runner here reads what deqp-runner reads: the list, and of a run
//! the lines that begin a test and the first line after each that has a word in brackets.

use crate::common::program::*;

/// Full names of a list of tests: a line with a dot at its end is a suite, an indented one a case.
fn listed(text: &str) -> Vec<String> {
    let (mut names, mut suite) = (Vec::new(), None);
    for line in text.lines() {
        match line.strip_prefix("  ") {
            Some(case) => {
                assert!(is_identifier(case), "{line:?}");
                names.push(format!("{}{case}", suite.expect("a case has a suite")));
            }
            None => {
                assert!(line.strip_suffix('.').is_some_and(is_identifier), "{line:?}");
                suite = Some(line);
            }
        }
    }
    names
}

fn is_identifier(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// The word of a verdict line: the first text in brackets that is one word and is followed by a space.
fn verdict(line: &str) -> Option<&str> {
    let (_, rest) = line.split_once('[')?;
    let (word, after) = rest.split_once(']')?;
    let word = word.trim();
    (after.starts_with(' ') && !word.contains(' ')).then_some(word)
}

/// Tests and their verdicts. A test without one has crashed.
fn results(out: &str) -> Vec<(String, String)> {
    let (mut results, mut current) = (Vec::<(String, String)>::new(), false);
    for line in out.lines() {
        if let (true, Some(word)) = (current, verdict(line)) {
            let (name, result) = results.last_mut().expect("a test runs");
            assert!(line.contains(name.as_str()), "{line:?} is no verdict of {name}");
            (*result, current) = (word.into(), false);
        } else if let Some(name) = line.strip_prefix("[ RUN      ] ") {
            results.push((name.into(), "crash".into()));
            current = true;
        }
    }
    results
}

#[test]
fn the_list_is_that_of_a_googletest_program_and_names_each_check_once() {
    let names = listed(&done(&["verify", "--gtest_list_tests"]));
    let plain = done(&["verify", "--list"]);
    assert_eq!(names.len(), plain.lines().count());
    assert!(names.len() > 100 && names.contains(&"known_answers.a_sphere_in_a_sweep".into()), "{names:?}");
    let distinct: std::collections::BTreeSet<_> = names.iter().collect();
    assert_eq!(distinct.len(), names.len());
    let some = listed(&done(&["verify", "--gtest_list_tests", "--gtest_filter=*.the_*-*largest*"]));
    assert_eq!(some.iter().filter(|name| name.contains(".the_")).count(), some.len());
    assert!(!some.is_empty() && !some.iter().any(|name| name.contains("largest")), "{some:?}");
    let nothing = done(&["verify", "--gtest_list_tests", "--gtest_filter=-*"]);
    assert_eq!(nothing, "", "a runner takes every line for a test or a suite");
}

#[test]
fn a_runner_reads_each_verdict_and_sees_a_crash() {
    let chosen = "--gtest_filter=known_answers.a_sphere_in_a_sweep:known_answers.every_level_of_a_picture:formats.uses_of_every_format";
    let (code, out, err) = run(&["verify", chosen]);
    assert_eq!(code, Some(0), "{out}{err}");
    let passed = results(&out);
    assert_eq!(passed.len(), 3, "{out}");
    assert!(passed.iter().all(|(_, word)| word == "OK"), "{passed:?}");
    assert!(out.contains("[==========] Running 3 tests from 2 test suites.") && out.contains("[  PASSED  ] 3 tests."));
    // A check that crashes takes its process with it: the runner starts the rest again.
    let crash = ["--inject-crash", "exit:known answers / a sphere in a sweep"];
    let (_, out, _) = run(&[&["verify", chosen], &crash[..]].concat());
    assert_eq!(
        results(&out).last().map(|(name, word)| (name.as_str(), word.as_str())),
        Some(("known_answers.a_sphere_in_a_sweep", "crash"))
    );
    // Unless each has its own: then it is a failure like any other, and nothing in its message is taken for a verdict.
    let (code, out, _) = run(&[&["verify", chosen, "--isolate"], &crash[..]].concat());
    let of = results(&out);
    let word = |name: &str| of.iter().find(|(of, _)| of.ends_with(name)).map(|(_, word)| word.as_str());
    assert_eq!((code, of.len()), (Some(1), 3), "{out}");
    assert_eq!([word("sweep"), word("picture"), word("format")], [Some("FAILED"), Some("OK"), Some("OK")]);
    assert!(
        out.contains("[  FAILED  ] 1 test, listed below:\n[  FAILED  ] known_answers.a_sphere_in_a_sweep\n"),
        "{out}"
    );
}

#[test]
fn a_filter_that_selects_nothing_runs_nothing_and_succeeds() {
    let (code, out, err) = run(&["verify", "--gtest_filter=no.such_test"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("Running 0 tests from 0 test suites.") && results(&out).is_empty(), "{out}");
}
