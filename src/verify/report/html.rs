//! A run as a self-contained HTML page: no network, no script, no other file. Failures come first.

use super::baseline::{BaselineComparison, Class};
use super::{
    Figure, Outcome, PictureComparison, Run, Unit, Verdict, amount, fault_items, grouped, percent, seconds,
    value_of_limit,
};
use crate::baselines::Stored;
use crate::html_page::page;
use crate::picture::Picture;
use crate::profile::LEVEL;
use crate::profile::statistics::Sample;
use crate::text::escaped;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use maud::{Markup, html};

/// Maximum number of checks of a group that is expanded by default.
const MAX_OPEN: usize = 40;

/// The report as a complete HTML page. Pictures are embedded up to the limits of 300 sets of three and [`MAX_BYTES`], those of failures first. The
/// page states how many are omitted. `compared`: the comparison with a baseline, if there is one.
///
/// # Errors
/// One line: the run contradicts itself, for example with two outcomes of one check ([`Run::check`]).
pub fn html(run: &Run, compared: Option<&BaselineComparison>) -> Result<String, String> {
    run.check()?;
    let mut embedded = EmbeddedPictures::default();
    let failures: Vec<&Outcome> = run.failures().collect();
    let result = match overall(run, compared) {
        Verdict::Failed => "failed",
        Verdict::Interrupted => "interrupted",
        Verdict::Passed | Verdict::LeftOut => "passed",
    };
    let title = format!("echolume verify: {result}, {}", run.device.name);
    let body = html! {
        (head(run, compared))
        main {
            @if let Some(compared) = compared { (baseline(compared)) }
            @if !failures.is_empty() {
                section id="failures" {
                    h2 { "Failures" }
                    @for outcome in &failures { (failure(outcome, &mut embedded)) }
                }
            }
            @for (at, (group, outcomes)) in run.groups().into_iter().enumerate() {
                (group_section(at, group, &outcomes, &mut embedded))
            }
            (times_section(run))
            (notes(run))
        }
        footer {
            @if let Some(note) = embedded.note() { p { (note) } }
            p { "Written by " (escaped(&run.program)) "." }
        }
    };
    Ok(page(&title, "", &body))
}

/// The verdict of the page. A run without passed checks says nothing about the device.
fn overall(run: &Run, compared: Option<&BaselineComparison>) -> Verdict {
    match run.count(Verdict::Failed) > 0 || compared.is_some_and(BaselineComparison::is_worse) {
        true => Verdict::Failed,
        false if run.count(Verdict::Interrupted) > 0 => Verdict::Interrupted,
        false if run.count(Verdict::Passed) == 0 => Verdict::LeftOut,
        false => Verdict::Passed,
    }
}

/// A verdict as a word with a colour.
fn badge(verdict: Verdict) -> Markup {
    html! { span class={ "badge " (class(verdict)) } { (verdict.word()) } }
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "failed",
        // Coloured alike: neither says anything about the device.
        Verdict::LeftOut | Verdict::Interrupted => "left-out",
    }
}

fn head(run: &Run, compared: Option<&BaselineComparison>) -> Markup {
    let overall = overall(run, compared);
    let (checks, failed) = (run.outcomes.len(), run.count(Verdict::Failed));
    let verdict = match (overall, failed) {
        (Verdict::LeftOut, _) => "Nothing was checked".into(),
        (Verdict::Passed, _) => "Passed".into(),
        (Verdict::Interrupted, _) => {
            format!("Interrupted: {} of {checks} checks were not run", run.count(Verdict::Interrupted))
        }
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
        ("Level", Some(run.level.name().into())),
        ("Validation layer", Some(if run.validation { "watching" } else { "not watching" }.into())),
    ];
    html! {
        header class=(class(overall)) {
            p class="program" { "echolume verify" }
            h1 { (verdict) }
            ul class="counts" {
                @for verdict in Verdict::ALL.into_iter().filter(|v| *v != Verdict::Interrupted || run.count(*v) > 0) {
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

fn baseline(compared: &BaselineComparison) -> Markup {
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
                    h3 class=(class.name()) { (class.name()) " " span class="dim" { (changes.len()) } }
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

/// Reasons of left-out checks and other notes, each once with its checks.
fn notes(run: &Run) -> Markup {
    let part = |verdict| match verdict {
        Verdict::Interrupted => 0,
        Verdict::LeftOut => 1,
        Verdict::Passed | Verdict::Failed => 2,
    };
    let reasons = |of: usize, is_needed: bool| {
        let outcomes = run.outcomes.iter().filter(|outcome| part(outcome.verdict) == of);
        grouped(outcomes.flat_map(|outcome| {
            let unexplained = (is_needed && outcome.notes.is_empty()).then(|| "no reason was given".to_string());
            let notes = outcome.notes.iter().map(|note| escaped(note)).chain(unexplained);
            notes.map(move |note| (note, outcome.title()))
        }))
    };
    let parts = [("Interrupted", reasons(0, true)), ("Left out", reasons(1, true)), ("Notes", reasons(2, false))];
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

/// One failed check: each fault with its pictures, then the other pictures.
fn failure(outcome: &Outcome, embedded: &mut EmbeddedPictures) -> Markup {
    let of_fault = |at: Option<usize>| outcome.pictures.iter().filter(move |p| p.fault == at);
    let rest = outcome.pictures.iter().filter(|p| p.fault.is_none_or(|at| at >= outcome.faults.len()));
    html! {
        article {
            h3 { (outcome.title()) " " (badge(outcome.verdict)) }
            @if outcome.faults.is_empty() { p { "No reason was given." } }
            @for (at, fault) in outcome.faults.iter().enumerate() {
                p class="fault sentence" { (escaped(&fault.what)) }
                @let items = fault_items(fault);
                @if !items.is_empty() {
                    dl { @for (name, value) in items { div { dt { (name) } dd { (value) } } } }
                }
                @for shown in of_fault(Some(at)) { (embedded.set(shown)) }
            }
            @for shown in rest { (embedded.set(shown)) }
            @if !errors(outcome).is_empty() {
                ul class="figures" { @for figure in errors(outcome) { li class="figure" { (measured(figure)) } } }
            }
            @for note in &outcome.notes { p class="dim" { (escaped(note)) } }
        }
    }
}

/// Figures of a check. Times have a section of their own, and are listed here only if there is nothing else.
fn errors(outcome: &Outcome) -> Vec<&Figure> {
    let errors: Vec<&Figure> = outcome.figures.iter().filter(|f| f.unit != Unit::Ns || f.allowed.is_some()).collect();
    if errors.is_empty() { outcome.figures.iter().collect() } else { errors }
}

/// A figure with its limit, and a bar for its share of that.
fn measured(figure: &Figure) -> Markup {
    html! {
        span class="what" { (escaped(&figure.what)) } " "
        span class="value" { (value_of_limit(figure)) }
        @if let Some(used) = figure.used() { " " (bar(used)) }
    }
}

fn bar(used: f64) -> Markup {
    let width = (100.0 * used.clamp(0.0, 1.0)).ceil();
    let beyond = used > 1.0;
    html! {
        span class=(if beyond { "bar beyond" } else { "bar" }) {
            span style={ "width:" (width) "%" } {}
        }
        " "
        span class="share" { @if beyond { "beyond" } @else { (percent(used)) } }
    }
}

/// A group: counts, table, and pictures of checks that did not fail. Expanded if something failed or the group is short.
fn group_section(at: usize, name: &str, outcomes: &[&Outcome], embedded: &mut EmbeddedPictures) -> Markup {
    let counts = Verdict::ALL.map(|verdict| (verdict, outcomes.iter().filter(|o| o.verdict == verdict).count()));
    let open = outcomes.len() <= MAX_OPEN || counts[1].1 > 0;
    let shown: Vec<&&Outcome> =
        outcomes.iter().filter(|o| o.verdict != Verdict::Failed && !o.pictures.is_empty()).collect();
    html! {
        section id={ "group-" (at) } {
            details open[open] {
                summary {
                    h2 { (escaped(name)) }
                    span class="dim" {
                        @for (verdict, count) in counts.iter().filter(|(_, count)| *count > 0) {
                            (count) " " (verdict.word()) ", "
                        }
                        (seconds(outcomes.iter().map(|o| o.seconds).sum()))
                    }
                }
                table class="checks" {
                    thead { tr { th { "Check" } th { "Verdict" } th { "Measured" } th class="time" { "Took" } } }
                    tbody { @for outcome in outcomes { (check_row(outcome)) } }
                }
                @if !shown.is_empty() {
                    details class="gallery" {
                        summary { "Pictures of " (shown.len()) @if shown.len() == 1 { " check" } @else { " checks" } " that did not fail" }
                        @for outcome in shown {
                            h3 { (escaped(&outcome.name)) }
                            @for picture in &outcome.pictures { (embedded.set(picture)) }
                        }
                    }
                }
            }
        }
    }
}

fn check_row(outcome: &Outcome) -> Markup {
    let tightest = outcome.tightest();
    let others: Vec<&Figure> =
        errors(outcome).into_iter().filter(|f| tightest.is_none_or(|t| !std::ptr::eq(*f, t))).collect();
    html! {
        tr {
            td class="name" { (escaped(&outcome.name)) }
            td { (badge(outcome.verdict)) }
            td class="error" {
                @if let Some(figure) = tightest { div class="figure" { (measured(figure)) } }
                @match others.as_slice() {
                    [] => {}
                    [one] => { div class="figure" { (measured(one)) } }
                    many => {
                        details {
                            summary { (many.len()) " more" }
                            @for figure in many { div class="figure" { (measured(figure)) } }
                        }
                    }
                }
                @if matches!(outcome.verdict, Verdict::LeftOut | Verdict::Interrupted) {
                    @for note in &outcome.notes { div class="dim" { (escaped(note)) } }
                }
            }
            td class="time" { (seconds(outcome.seconds)) }
        }
    }
}

/// Maximum number of sets of three pictures in a page.
const MAX_SETS: usize = 300;
/// Maximum encoded size of all pictures in a page, bytes.
pub const MAX_BYTES: usize = 24 << 20;

/// Width below which pictures are enlarged, every pixel as a square, pixels.
const SMALL: u32 = 320;

/// Number and size of the pictures embedded so far.
#[derive(Default)]
pub(crate) struct EmbeddedPictures {
    sets: usize,
    bytes: usize,
    left_out: usize,
}

impl EmbeddedPictures {
    /// The actual picture, the expected one and their difference side by side, or a line with the reason if the page has no room for them.
    pub fn set(&mut self, shown: &PictureComparison) -> Markup {
        let pictures = [
            ("actual".to_string(), &shown.actual),
            ("expected".to_string(), &shown.expected),
            (format!("difference, {} times", shown.gain), &shown.difference),
        ];
        let what = escaped(&shown.what);
        if self.sets >= MAX_SETS {
            return self.leave_out(&what);
        }
        let encoded: Result<Vec<String>, String> = pictures.iter().map(|(_, picture)| data_uri(picture)).collect();
        let encoded = match encoded {
            Ok(encoded) => encoded,
            Err(fault) => return html! { p class="dim" { (what) ": the pictures cannot be shown: " (fault) } },
        };
        let bytes = self.bytes + encoded.iter().map(String::len).sum::<usize>();
        if bytes > MAX_BYTES {
            return self.leave_out(&what);
        }
        (self.sets, self.bytes) = (self.sets + 1, bytes);
        html! {
            figure class="set" {
                figcaption { (what) " " span class="dim" { (shown.actual.width) " x " (shown.actual.height) } }
                div class="three" {
                    @for ((name, picture), uri) in pictures.iter().zip(&encoded) {
                        div {
                            img class=[(picture.width < SMALL).then_some("small")] width=(picture.width) height=(picture.height)
                                alt={ (what) ", " (name) } src=(uri);
                            span { (name) }
                        }
                    }
                }
            }
        }
    }

    fn leave_out(&mut self, what: &str) -> Markup {
        self.left_out += 1;
        html! { p class="dim" { (what) ": pictures left out, the page is full" } }
    }

    /// A sentence that says how many pictures were omitted. None if none were.
    pub fn note(&self) -> Option<String> {
        (self.left_out > 0).then(|| {
            format!(
                "{} of {} sets of pictures are left out: a page holds {MAX_SETS} sets and {} MiB.",
                self.left_out,
                self.left_out + self.sets,
                MAX_BYTES >> 20
            )
        })
    }
}

fn data_uri(picture: &Picture) -> Result<String, String> {
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(picture.png()?)))
}

/// Times of all groups as bars; empty if no time was measured.
fn times_section(run: &Run) -> Markup {
    let timed = |outcomes: &[&'_ Outcome]| -> Vec<(String, Figure)> {
        let figures = outcomes.iter().flat_map(|o| o.figures.iter().map(move |f| (o, f)));
        let times = figures.filter(|(_, f)| f.unit == Unit::Ns && !f.is_single_time() && f.value.is_finite());
        times.map(|(o, f)| (o.name.clone(), f.clone())).collect()
    };
    let groups: Vec<(&str, Vec<(String, Figure)>)> =
        run.groups().iter().map(|(group, outcomes)| (*group, timed(outcomes))).filter(|(_, t)| !t.is_empty()).collect();
    html! {
        @if !groups.is_empty() {
            section id="times" {
                h2 { "Times" }
                p class="dim" { "Medians; the mark at the end of a bar is the interval that covers the true median with a probability of 95 %." }
                @for (group, times) in groups {
                    @let longest = times.iter().map(|(_, f)| high(f)).fold(0.0, f64::max);
                    h3 { (escaped(group)) }
                    table class="times" {
                        tbody { @for (name, figure) in &times { (time_row(name, figure, longest)) } }
                    }
                }
            }
        }
    }
}

/// Confidence interval of the median, ns; None if there are too few samples.
fn interval(figure: &Figure) -> Option<[f64; 2]> {
    let interval = Sample::new(&figure.samples).ok()?.median_interval(LEVEL);
    interval.reaches(LEVEL).then_some([interval.low, interval.high])
}

fn high(figure: &Figure) -> f64 {
    interval(figure).map_or(figure.value, |[_, high]| high.max(figure.value))
}

fn time_row(name: &str, figure: &Figure, longest: f64) -> Markup {
    let share = |ns: f64| if longest > 0.0 { 100.0 * ns / longest } else { 0.0 };
    let interval = interval(figure);
    html! {
        tr {
            td class="name" { (escaped(name)) " " span class="dim" { (escaped(&figure.what)) } }
            td {
                div class="track" {
                    span class="span" style={ "width:" (format!("{:.2}", share(figure.value))) "%" } {}
                    @if let Some([low, high]) = interval {
                        span class="interval"
                            style={ "left:" (format!("{:.2}", share(low))) "%;width:" (format!("{:.2}", share(high - low))) "%" } {}
                    }
                }
            }
            td class="value" { (amount(figure.value, Unit::Ns)) }
            td class="value dim range" {
                @match interval {
                    Some([low, high]) => { (amount(low, Unit::Ns)) " .. " (amount(high, Unit::Ns)) }
                    None => { (figure.samples.len()) @if figure.samples.len() == 1 { " sample" } @else { " samples" } }
                }
            }
        }
    }
}
