//! A run as one page that needs nothing beside it: no network, no script, no other file. What went wrong comes first.

mod checks;
mod pictures;
mod times;

use super::baseline::{Class, Compared};
use super::numbers::seconds;
use super::{Outcome, Run, Verdict};
use crate::text::escaped;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use pictures::Album;

/// Checks of a group that are shown without being asked for.
const OPEN: usize = 40;

/// The whole page. Pictures are embedded as long as [`pictures::MOST_SETS`] and [`pictures::MOST_BYTES`] allow, those of
/// failures first; how many are left out is said.
///
/// # Errors
/// One line: [`Run::check`] refuses the run.
pub fn html(run: &Run, compared: Option<&Compared>) -> Result<String, String> {
    run.check().map_err(|e| e.to_string())?;
    let mut album = Album::default();
    let failures: Vec<&Outcome> = run.failures().collect();
    let passed = Verdict::Failed != overall(run, compared);
    let title = format!("echolume verify: {}, {}", if passed { "passed" } else { "failed" }, escaped(&run.device.name));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                (head(run, compared))
                main {
                    @if let Some(compared) = compared { (baseline(compared)) }
                    @if !failures.is_empty() {
                        section id="failures" {
                            h2 { "Failures" }
                            @for outcome in &failures { (checks::failure(outcome, &mut album)) }
                        }
                    }
                    @for (at, (group, outcomes)) in run.groups().into_iter().enumerate() {
                        (checks::group(at, group, &outcomes, &mut album))
                    }
                    (times::section(run))
                    (notes(run))
                }
                footer {
                    @if let Some(note) = album.note() { p { (note) } }
                    p { "Written by " (escaped(&run.program)) "." }
                }
            }
        }
    };
    Ok(page.into_string())
}

/// What the page says in large letters. A run of nothing says nothing of the device.
fn overall(run: &Run, compared: Option<&Compared>) -> Verdict {
    match run.count(Verdict::Failed) > 0 || compared.is_some_and(Compared::is_worse) {
        true => Verdict::Failed,
        false if run.count(Verdict::Passed) == 0 => Verdict::LeftOut,
        false => Verdict::Passed,
    }
}

/// A verdict as a word; its colour only repeats it.
fn badge(verdict: Verdict) -> Markup {
    html! { span class={ "badge " (class(verdict)) } { (verdict.word()) } }
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "failed",
        Verdict::LeftOut => "left-out",
    }
}

fn head(run: &Run, compared: Option<&Compared>) -> Markup {
    let overall = overall(run, compared);
    let (checks, failed) = (run.outcomes.len(), run.count(Verdict::Failed));
    let verdict = match (overall, failed) {
        (Verdict::LeftOut, _) => "Nothing was checked".into(),
        (Verdict::Passed, _) => "Passed".into(),
        (Verdict::Failed, 0) => "Worse than before".into(),
        (Verdict::Failed, 1) => format!("1 of {checks} checks failed"),
        (Verdict::Failed, _) => format!("{failed} of {checks} checks failed"),
    };
    let software = if run.device.is_software { " (software: computes on the CPU)" } else { "" };
    let clocks = run.device.clocks.as_deref();
    let conditions = [
        ("Device", Some(escaped(&run.device.name) + software)),
        ("Driver", Some(escaped(&run.device.driver))),
        ("Vulkan", Some(escaped(&run.device.api))),
        ("Clocks", clocks.map(escaped)),
        ("Program", Some(escaped(&run.program))),
        ("Date", Some(escaped(&run.date))),
        ("Level", Some(run.level.word().into())),
        ("Validation layer", Some(if run.validation { "watching" } else { "not watching" }.into())),
    ];
    html! {
        header class=(class(overall)) {
            p class="program" { "echolume verify" }
            h1 { (verdict) }
            ul class="counts" {
                @for verdict in [Verdict::Passed, Verdict::Failed, Verdict::LeftOut] {
                    li { strong { (run.count(verdict)) } " " (verdict.word()) }
                }
                li { "in " strong { (seconds(run.seconds)) } }
                @if let Some(compared) = compared {
                    li { strong { (compared.worse_checks()) } " worse than before" }
                }
            }
            dl class="conditions" {
                @for (name, value) in &conditions {
                    @if let Some(value) = value { div { dt { (name) } dd { (value) } } }
                }
            }
        }
    }
}

fn baseline(compared: &Compared) -> Markup {
    html! {
        section id="baseline" {
            h2 { "Since the earlier run" }
            p class="dim" { "Compared with " (compared.baseline) "." }
            @if !compared.differences.is_empty() || !compared.notes.is_empty() {
                ul class="plain" {
                    @for line in compared.differences.iter().chain(&compared.notes) { li { (line) } }
                }
            }
            @for class in Class::ALL {
                @let changes: Vec<_> = compared.changes.iter().filter(|c| c.class == class).collect();
                @if !changes.is_empty() {
                    h3 class=(class.word()) { (class.word()) " " span class="dim" { (changes.len()) } }
                    ul class="changes" {
                        @for change in changes {
                            li { span class="of" { (escaped(&change.group)) " / " (escaped(&change.name)) } " " span { (change.what) } }
                        }
                    }
                }
            }
            p class="sentence" { (compared.conclusion()) "." }
        }
    }
}

/// Why checks were left out, and what else was noted, each reason once with the checks that it is of.
fn notes(run: &Run) -> Markup {
    /// A reason and its checks.
    type Reasons = Vec<(String, Vec<String>)>;
    let mut parts: [(&str, Reasons); 2] = [("Left out", Vec::new()), ("Notes", Vec::new())];
    let mut places = std::collections::HashMap::new();
    for outcome in &run.outcomes {
        let left_out = outcome.verdict == Verdict::LeftOut;
        let unexplained = (left_out && outcome.notes.is_empty()).then(|| "no reason was given".to_string());
        for note in outcome.notes.iter().map(|note| escaped(note)).chain(unexplained) {
            let reasons = &mut parts[usize::from(!left_out)].1;
            let place = *places.entry((left_out, note.clone())).or_insert_with(|| {
                reasons.push((note, Vec::new()));
                reasons.len() - 1
            });
            reasons[place].1.push(outcome.title());
        }
    }
    html! {
        @for (title, reasons) in parts.iter().filter(|(_, reasons)| !reasons.is_empty()) {
            section {
                h2 { (title) }
                dl class="reasons" {
                    @for (reason, checks) in reasons {
                        div {
                            dt { (reason) }
                            dd { @for check in checks { span class="check" { (check) } " " } }
                        }
                    }
                }
            }
        }
    }
}
