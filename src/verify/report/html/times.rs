//! Times of the device, as bars under each other.

use crate::profile::LEVEL;
use crate::profile::statistics::Sample;
use crate::text::escaped;
use crate::verify::report::numbers::amount;
use crate::verify::report::{Figure, Outcome, Run, Unit};
use maud::{Markup, html};

/// Every time by its group; empty where none was measured.
pub fn section(run: &Run) -> Markup {
    let timed = |outcomes: &[&'_ Outcome]| -> Vec<(String, Figure)> {
        let figures = outcomes.iter().flat_map(|o| o.figures.iter().map(move |f| (o, f)));
        let times = figures.filter(|(_, f)| f.unit == Unit::Ns && f.value.is_finite());
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
                        tbody { @for (name, figure) in &times { (row(name, figure, longest)) } }
                    }
                }
            }
        }
    }
}

/// Low and high end of the median's interval, and whether there were samples enough for it.
fn interval(figure: &Figure) -> Option<[f64; 2]> {
    let interval = Sample::new(&figure.samples).ok()?.median_interval(LEVEL);
    interval.reaches(LEVEL).then_some([interval.low, interval.high])
}

fn high(figure: &Figure) -> f64 {
    interval(figure).map_or(figure.value, |[_, high]| high.max(figure.value))
}

fn row(name: &str, figure: &Figure, longest: f64) -> Markup {
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
