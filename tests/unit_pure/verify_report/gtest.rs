//! GoogleTest's filters and verdict lines.

use super::simulated::{fail, run};
use echolume::low_level::verify::gtest::{self, Filter};
use echolume::low_level::verify::report::{CheckName, Level, Verdict};
use proptest::prelude::*;
use std::collections::BTreeSet;

fn selects(filter: &str, name: &str) -> bool {
    filter.parse::<Filter>().expect("any text is a filter").selects(name)
}

/// The examples of GoogleTest's documentation: everything, a suite, patterns, and negative ones.
#[test]
fn filters_select_what_googletest_selects() {
    for (filter, selected, others) in [
        ("*", &["FooTest.Bar", "a.b"][..], &[][..]),
        ("FooTest.*", &["FooTest.Bar", "FooTest."], &["BarFooTest.Bar", "FooTest"]),
        ("*Null*:*Constructor*", &["A.IsNull", "A.ConstructorFails"], &["A.Other"]),
        ("-*DeathTest.*", &["FooTest.Bar"], &["FooDeathTest.Bar"]),
        ("FooTest.*-FooTest.Bar", &["FooTest.Baz"], &["FooTest.Bar", "BarTest.Baz"]),
        (
            "FooTest.*:BarTest.*-FooTest.Bar:BarTest.Foo",
            &["FooTest.Foo", "BarTest.Bar"],
            &["FooTest.Bar", "BarTest.Foo"],
        ),
        ("Foo?est.B*r", &["FooTest.Bar", "FooTest.Br"], &["Footest.Bart", "Foest.Bar"]),
        ("", &[], &["FooTest.Bar"]),
        ("A.a:", &["A.a"], &["", "A.b"]),
        ("*a*b*c", &["xaybzc", "abcabc"], &["acb", "abcd"]),
    ] {
        selected.iter().for_each(|name| assert!(selects(filter, name), "{filter} and {name}"));
        others.iter().for_each(|name| assert!(!selects(filter, name), "{filter} and {name}"));
    }
}

/// The definition, in exponential time.
fn by_definition(pattern: &[u8], text: &[u8]) -> bool {
    match pattern.split_first() {
        None => text.is_empty(),
        Some((b'*', rest)) => (0..=text.len()).any(|n| by_definition(rest, &text[n..])),
        Some((c, rest)) => {
            text.split_first().is_some_and(|(t, more)| (*c == b'?' || c == t) && by_definition(rest, more))
        }
    }
}

proptest! {
    #[test]
    fn a_pattern_matches_as_defined(pattern in "[ab*?]{0,8}", text in "[ab]{0,10}") {
        let defined = !pattern.is_empty() && by_definition(pattern.as_bytes(), text.as_bytes());
        prop_assert_eq!(selects(&pattern, &text), defined);
    }
}

/// Two checks of one name could not be told apart by a runner.
#[test]
fn full_names_are_distinct_and_plain() {
    for level in [Level::Quick, Level::Full] {
        let checks: Vec<CheckName> =
            echolume::low_level::verify::checks(level).iter().map(|check| check.title()).collect();
        let names: BTreeSet<String> = checks.iter().map(gtest::full_name).collect();
        assert_eq!(names.len(), checks.len());
        for name in &names {
            let parts: Vec<&str> = name.split('.').collect();
            let is_plain =
                |part: &&str| part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && !part.is_empty();
            assert!(parts.len() == 2 && parts.iter().all(is_plain), "{name}");
        }
    }
}

#[test]
fn what_a_failure_says_is_not_taken_for_a_verdict() {
    let mut run = run(1);
    fail(&mut run, "passes", "tone");
    let failed = run.outcomes.iter_mut().find(|o| o.verdict == Verdict::Failed).expect("one failed");
    failed.faults[0].what = "texel [3] is [  OK  ] wrong".into();
    let text = gtest::ends(failed);
    let lines: Vec<&str> = text.lines().collect();
    let (last, before) = lines.split_last().expect("a verdict");
    assert!(last.starts_with("[  FAILED  ] passes.tone ("), "{text}");
    assert!(before.len() > 1 && before.iter().all(|line| !line.contains('[')), "{text}");
    let text = gtest::ends_run(&run);
    assert!(text.contains("[  PASSED  ] 19 tests.\n[  SKIPPED ] 1 test, listed below:\n"), "{text}");
    assert!(text.ends_with("[  FAILED  ] 1 test, listed below:\n[  FAILED  ] passes.tone\n"), "{text}");
}
