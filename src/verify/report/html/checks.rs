//! Failures in full, and every group as a table.

use super::pictures::Album;
use super::{OPEN, badge};
use crate::text::escaped;
use crate::verify::report::numbers::{of_allowed, percent, seconds};
use crate::verify::report::words::fault_items;
use crate::verify::report::{Figure, Outcome, Unit, Verdict};
use maud::{Markup, html};

/// One failed check: each of its faults with its pictures, then pictures of none.
pub fn failure(outcome: &Outcome, album: &mut Album) -> Markup {
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
                @for shown in of_fault(Some(at)) { (album.set(shown)) }
            }
            @for shown in rest { (album.set(shown)) }
            @if !errors(outcome).is_empty() {
                ul class="figures" { @for figure in errors(outcome) { li class="figure" { (measured(figure)) } } }
            }
            @for note in &outcome.notes { p class="dim" { (escaped(note)) } }
        }
    }
}

/// What a check measured. Times have their own place, and are told here where there is nothing else.
fn errors(outcome: &Outcome) -> Vec<&Figure> {
    let errors: Vec<&Figure> = outcome.figures.iter().filter(|f| f.unit != Unit::Ns || f.allowed.is_some()).collect();
    if errors.is_empty() { outcome.figures.iter().collect() } else { errors }
}

/// A figure with its tolerance, and how much of that it takes as a bar.
fn measured(figure: &Figure) -> Markup {
    html! {
        span class="what" { (escaped(&figure.what)) } " "
        span class="value" { (of_allowed(figure)) }
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

/// A group: its counts, its table, and the pictures of what passed. Open where something failed, or where it is short.
pub fn group(at: usize, name: &str, outcomes: &[&Outcome], album: &mut Album) -> Markup {
    let counts = [Verdict::Passed, Verdict::Failed, Verdict::LeftOut]
        .map(|verdict| (verdict, outcomes.iter().filter(|o| o.verdict == verdict).count()));
    let open = outcomes.len() <= OPEN || counts[1].1 > 0;
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
                    tbody { @for outcome in outcomes { (row(outcome)) } }
                }
                @if !shown.is_empty() {
                    details class="gallery" {
                        summary { "Pictures of " (shown.len()) @if shown.len() == 1 { " check" } @else { " checks" } " that did not fail" }
                        @for outcome in shown {
                            h3 { (escaped(&outcome.name)) }
                            @for picture in &outcome.pictures { (album.set(picture)) }
                        }
                    }
                }
            }
        }
    }
}

fn row(outcome: &Outcome) -> Markup {
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
                @if outcome.verdict == Verdict::LeftOut {
                    @for note in &outcome.notes { div class="dim" { (escaped(note)) } }
                }
            }
            td class="time" { (seconds(outcome.seconds)) }
        }
    }
}
