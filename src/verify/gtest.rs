//! The protocol of GoogleTest programs, so that runners of such programs, such as `deqp-runner gtest-runner` and CTest, can run `echolume
//! verify`: the list of tests, the filter, and the lines on each test. Suites are groups, and cases are checks.

use super::report::{CheckName, Outcome, Run, Verdict, failure};

/// A pattern list in the syntax of `--gtest_filter`: `POSITIVE[-NEGATIVE]`, each a list of patterns separated by `:`. In a pattern `*` is
/// any text and `?` any single character. A name is selected if it matches a positive pattern and no negative one. If the list begins
/// with `-`, it is selected if it matches no negative one. An empty list selects nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Filter {
    positive: Vec<String>,
    negative: Vec<String>,
}

impl std::str::FromStr for Filter {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Filter, Self::Err> {
        let list = |text: &str| text.split(':').filter(|p| !p.is_empty()).map(String::from).collect::<Vec<_>>();
        Ok(match text.split_once('-') {
            None => Filter { positive: list(text), negative: Vec::new() },
            Some(("", negative)) => Filter { positive: vec!["*".into()], negative: list(negative) },
            Some((positive, negative)) => Filter { positive: list(positive), negative: list(negative) },
        })
    }
}

impl Filter {
    /// True if the filter selects the test with this full name, `suite.case`.
    pub fn selects(&self, name: &str) -> bool {
        let any = |patterns: &[String]| patterns.iter().any(|pattern| matches(pattern.as_bytes(), name.as_bytes()));
        any(&self.positive) && !any(&self.negative)
    }
}

/// True if the whole text matches. Linear in both lengths: after a failure only the last `*` takes one character more.
fn matches(pattern: &[u8], text: &[u8]) -> bool {
    let (mut p, mut t) = (0, 0);
    // The place after the last `*`, and where its text ends.
    let mut star: Option<(usize, usize)> = None;
    while t < text.len() {
        match pattern.get(p) {
            Some(b'*') => {
                p += 1;
                star = Some((p, t));
            }
            Some(&c) if c == b'?' || c == text[t] => (p, t) = (p + 1, t + 1),
            _ => {
                let Some((after, end)) = star else { return false };
                star = Some((after, end + 1));
                (p, t) = (after, end + 1);
            }
        }
    }
    pattern[p..].iter().all(|c| *c == b'*')
}

/// Letters and digits of a title, with one `_` for everything else between them: names of suites and cases have no spaces and no dots.
pub fn identifier(title: &str) -> String {
    let mut name = String::new();
    for c in title.chars() {
        match c {
            c if c.is_ascii_alphanumeric() => name.push(c),
            _ if name.ends_with('_') || name.is_empty() => {}
            _ => name.push('_'),
        }
    }
    name.trim_end_matches('_').to_string()
}

/// The name of a check as GoogleTest has it, `suite.case`. It changes only if the check is renamed.
pub fn full_name(check: &CheckName) -> String {
    format!("{}.{}", identifier(&check.group), identifier(&check.name))
}

/// The output for `--gtest_list_tests`: each suite followed by a dot, and its cases below it, indented by two spaces.
pub fn list(checks: &[CheckName]) -> String {
    let (mut text, mut group) = (String::new(), None);
    for check in checks {
        if group != Some(&check.group) {
            text += &format!("{}.\n", identifier(&check.group));
            group = Some(&check.group);
        }
        text += &format!("  {}\n", identifier(&check.name));
    }
    text
}

/// The lines that are printed before a run.
pub fn begins_run(checks: &[CheckName]) -> String {
    let suites = checks.chunk_by(|a, b| a.group == b.group).count();
    let lines = format!("[==========] Running {} from {}.", tests(checks.len()), test_suites(suites));
    lines + "\n[----------] Global test environment set-up."
}

/// The line before the first check of a group, which has `checks` checks.
pub(crate) fn begins_group(group: &str, checks: usize) -> String {
    format!("[----------] {} from {}", tests(checks), identifier(group))
}

/// The line that is printed before a check.
pub fn begins(check: &CheckName) -> String {
    format!("[ RUN      ] {}", full_name(check))
}

/// The lines that are printed after a check: its faults if it failed, its notes if it has no result, and the verdict. Brackets in a message become
/// parentheses, because runners search every line for the verdict.
pub fn ends(outcome: &Outcome) -> String {
    let name = full_name(&outcome.check());
    let ms = milliseconds(outcome.seconds);
    let quoted = |text: String| text.replace('[', "(").replace(']', ")");
    match outcome.verdict {
        Verdict::Passed => format!("[       OK ] {name} ({ms} ms)"),
        Verdict::Failed => format!("{}[  FAILED  ] {name} ({ms} ms)", quoted(failure(outcome))),
        // GoogleTest knows no other word for a test without a result.
        Verdict::LeftOut | Verdict::Interrupted => {
            let notes: String = outcome.notes.iter().map(|note| note.clone() + "\n").collect();
            format!("{}[  SKIPPED ] {name} ({ms} ms)", quoted(notes))
        }
    }
}

/// The line that is printed after the last check of a group.
pub(crate) fn ends_group(outcomes: &[Outcome]) -> String {
    let suite = outcomes.first().map_or(String::new(), |first| identifier(&first.group));
    let ms = milliseconds(outcomes.iter().map(|o| o.seconds).sum());
    format!("[----------] {} from {suite} ({ms} ms total)", tests(outcomes.len()))
}

/// The lines at the end of a run: the counts, and the names of the checks that were skipped or failed.
pub fn ends_run(run: &Run) -> String {
    let mut text = "[----------] Global test environment tear-down\n".to_string();
    let suites = run.groups().len();
    let ms = milliseconds(run.seconds);
    text += &format!("[==========] {} from {} ran. ({ms} ms total)\n", tests(run.outcomes.len()), test_suites(suites));
    text += &format!("[  PASSED  ] {}.\n", tests(run.count(Verdict::Passed)));
    let is_skipped = |o: &&Outcome| matches!(o.verdict, Verdict::LeftOut | Verdict::Interrupted);
    let skipped: Vec<&Outcome> = run.outcomes.iter().filter(is_skipped).collect();
    for (word, outcomes) in [("[  SKIPPED ]", skipped), ("[  FAILED  ]", run.failures().collect())] {
        if outcomes.is_empty() {
            continue;
        }
        text += &format!("{word} {}, listed below:\n", tests(outcomes.len()));
        for outcome in outcomes {
            text += &format!("{word} {}\n", full_name(&outcome.check()));
        }
    }
    text
}

fn tests(count: usize) -> String {
    format!("{count} test{}", if count == 1 { "" } else { "s" })
}

fn test_suites(count: usize) -> String {
    format!("{count} test suite{}", if count == 1 { "" } else { "s" })
}

fn milliseconds(seconds: f64) -> u64 {
    (1000.0 * seconds).round() as u64
}
