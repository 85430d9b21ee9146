//! Numbers of what the program has: generated from it, and nowhere else in a page.

use super::{hold_part, pages, prose, read};
use crate::common::program::*;
use echolume::low_level::passes::PASSES;
use std::collections::BTreeSet;
use std::fmt::Write;

/// The group of each check that `verify` lists.
fn groups(level: &str) -> Vec<String> {
    let list = done(&["verify", level, "--list"]);
    list.lines().map(|line| line.split_once(" / ").expect("group and check").0.to_string()).collect()
}

/// The number behind a word in each line that has one, added up.
fn sum_of(text: &str, word: &str) -> usize {
    let numbers =
        text.lines().filter_map(|line| line.split_once(word)?.1.split(';').next()?.trim().parse::<usize>().ok());
    numbers.sum()
}

#[test]
fn generated_numbers_of_checks_are_those_that_verify_prints() {
    let [quick, full] = ["--quick", "--full"].map(groups);
    let mut part = "| group of checks | `--quick` | `--full` |\n|---|---|---|\n".to_string();
    let mut done_with = BTreeSet::new();
    for group in full.iter().filter(|group| done_with.insert(group.as_str())) {
        let [quick, full] = [&quick, &full].map(|checks| checks.iter().filter(|of| *of == group).count());
        writeln!(part, "| {group} | {quick} | {full} |").expect("text");
    }
    writeln!(part, "| all | {} | {} |\n", quick.len(), full.len()).expect("text");
    let pipelines = sum_of(&done(&["verify", "--coverage"]), "; pipelines: ");
    let outliers: Vec<f64> = PASSES.iter().map(|pass| pass.tolerance.outliers).filter(|share| *share > 0.0).collect();
    let [least, most] = [f64::min, f64::max].map(|of| 100.0 * outliers.iter().copied().reduce(of).expect("a pass"));
    writeln!(
        part,
        "The program has {} passes. The checks of single passes run {pipelines} pipelines of them.",
        PASSES.len()
    )
    .expect("text");
    writeln!(part, "In {} passes {least} to {most} % of the texels may be beyond the tolerance.", outliers.len())
        .expect("text");
    hold_part("docs/verify.md", part.trim_end());
}

/// Things that a command counts.
const COUNTED: [&str; 7] = ["checks", "pipelines", "passes", "settings", "presets", "tests", "metrics"];
/// Numbers that are no count of what there is, by page.
const OTHER_NUMBERS: [(&str, &str); 3] =
    [("docs/measuring.md", "24 passes"), ("docs/numerics.md", "150 passes"), ("docs/numerics.md", "176 passes")];

/// Counts of what the program has in the prose of a page. A line or a table with a date is a measurement, which stays.
fn counts(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut is_generated = false;
    for line in prose(page).lines() {
        is_generated =
            (is_generated || line.contains("<!-- Generated: ")) && !line.contains("<!-- End of the generated");
        let is_dated = line.split(|c: char| !(c.is_ascii_digit() || c == '-')).any(|word| {
            let parts: Vec<usize> = word.split('-').map(str::len).collect();
            parts == [4, 2, 2]
        });
        if is_generated || is_dated {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        for pair in words.windows(2) {
            let [number, thing] = [pair[0], pair[1]].map(|word| word.trim_matches(|c: char| !c.is_alphanumeric()));
            if number.chars().all(|c| c.is_ascii_digit() || c == ',') && !number.is_empty() && COUNTED.contains(&thing)
            {
                found.push(format!("{number} {thing}"));
            }
        }
    }
    found
}

#[test]
fn counts_of_what_the_program_has_are_not_written_by_hand() {
    let generated = ["docs/cli.md", "docs/settings.md", "docs/filters.md", "docs/error-reports.md", "CHANGELOG.md"];
    let is_written = |page: &String| {
        let is_measured = page.starts_with("docs/thesis-tables") || page.starts_with("docs/experiments/");
        !is_measured && !generated.contains(&page.as_str())
    };
    let mut other: BTreeSet<(&str, &str)> = OTHER_NUMBERS.into_iter().collect();
    let mut wrong = Vec::new();
    for page in pages().into_iter().filter(is_written) {
        for count in counts(&read(&page)) {
            match OTHER_NUMBERS.into_iter().find(|(of, text)| *of == page && *text == count) {
                Some(known) => _ = other.remove(&known),
                None => wrong.push(format!("{page}: {count}")),
            }
        }
    }
    assert!(wrong.is_empty(), "say how to count them, or let tools/docs write them: {wrong:?}");
    assert!(other.is_empty(), "no page has {other:?} any more: take them off the list");
}

#[test]
fn counts_are_found_in_prose_alone() {
    assert_eq!(
        counts("All 69 passes, 223 checks.\n| x (1,024 tests) | y |"),
        ["69 passes", "223 checks", "1,024 tests"]
    );
    let page = "`69 passes` passes 3 scenes\n```\n3 tests\n```\nOn 2026-11-29 all 69 passes ran\n\
                <!-- Generated: by a tool -->\n72 passes\n<!-- End of the generated part. -->\n";
    assert_eq!(counts(page), Vec::<String>::new());
    assert_eq!(sum_of("a; pipelines: 3; b\nc\nd; pipelines: 4; e", "; pipelines: "), 7);
}
