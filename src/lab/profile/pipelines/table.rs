//! Statistics of pipelines and their comparison, as tables for a terminal.

use super::compare::{Change, PipelineComparison};
use super::{Pipeline, PipelineProfile};
use crate::profile::export::aligned;
use crate::text::escaped;
use std::fmt::Write as _;

/// Pipelines that the table of a long list shows: those with the fewest waves.
const SHOWN: usize = 40;

/// The pipelines as a table of text, and sums over all of them. The table has at most 40 rows: those with the lowest occupancy first, of equal
/// occupancy those with the most instructions. Where the device reports no statistics, those that take longest to compile are first.
pub fn table(profile: &PipelineProfile) -> String {
    let mut order: Vec<&Pipeline> = profile.pipelines.iter().collect();
    // Without statistics the slowest to compile are of interest.
    let rank = |p: &Pipeline| {
        let columns = profile.columns(p);
        (columns.waves.unwrap_or(f64::MAX), -columns.instructions.unwrap_or(p.cold_ms))
    };
    order.sort_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal));
    let title = ["registers", "waves", "spills", "instr.", "shared", "subgroup", "cold ms", "warm ms"];
    let number = |value: Option<f64>| value.map_or_else(|| "-".into(), |v| format!("{v}"));
    let mut rows = vec![title.map(String::from).to_vec()];
    for pipeline in order.iter().take(SHOWN) {
        let c = profile.columns(pipeline);
        let counts = [c.registers, c.waves, c.spills, c.instructions, c.shared, c.subgroup.map(f64::from)];
        let times = [pipeline.cold_ms, pipeline.warm_ms].map(|ms| format!("{ms:.1}"));
        rows.push(counts.map(number).into_iter().chain(times).collect());
    }
    // Names last: they are long, and of any length.
    let titles = order.iter().map(|pipeline| escaped(&pipeline.title()));
    let lines = aligned(&rows, 0);
    let lines = lines.lines().zip(std::iter::once("pipeline".to_string()).chain(titles));
    let mut text: String = lines.map(|(numbers, title)| format!("{numbers}  {title}\n")).collect();
    if order.len() > SHOWN {
        let _ = writeln!(text, "... {} more; --json has all", order.len() - SHOWN);
    }
    let _ = writeln!(text, "\n{}", sums(profile));
    text
}

fn sums(profile: &PipelineProfile) -> String {
    let sum = |of: fn(&Pipeline) -> f64| profile.pipelines.iter().map(of).sum::<f64>();
    let count = profile.pipelines.len();
    let hits = profile.pipelines.iter().filter(|p| p.from_cache == Some(true)).count();
    let told = profile.pipelines.iter().any(|p| p.from_cache.is_some());
    let cached = if told { format!(", {hits} from the cache") } else { String::new() };
    let mut text = format!(
        "{count} pipelines: compiled in {:.0} ms without any cache, in {:.0} ms from a pipeline cache{cached}",
        sum(|p| p.cold_ms),
        sum(|p| p.warm_ms)
    );
    if profile.has_statistics {
        let spills = profile.pipelines.iter().filter(|p| profile.columns(p).spills.is_some_and(|s| s > 0.0)).count();
        let _ = write!(text, "; {spills} spill");
    }
    text
}

/// The comparison as a table of text: the notes, the changes with those that fail the comparison first, the new pipelines whose registers spill, and
/// the counts.
pub fn comparison_table(compared: &PipelineComparison) -> String {
    let mut text = String::new();
    for note in &compared.notes {
        let _ = writeln!(text, "{}", escaped(note));
    }
    let row = |change: &Change| {
        let verdict = if change.is_worse { "worse" } else { "changed" };
        let values = format!("{} -> {}", change.old, change.new);
        vec![verdict.into(), escaped(&change.pipeline), change.column.to_string(), values]
    };
    let mut rows: Vec<Vec<String>> = compared.changes.iter().map(row).collect();
    let spilling = |title: &String| vec!["worse".into(), escaped(title), "spills".into(), "new, and spills".into()];
    rows.extend(compared.new_spills.iter().map(spilling));
    text.push_str(&aligned(&rows, 4));
    let [old, new] = compared.cold_ms;
    let _ = writeln!(
        text,
        "{} pipelines compared, {} worse; {} new, {} gone; compiled in {old:.0} ms before, {new:.0} ms now",
        compared.compared,
        compared.worse().len(),
        compared.added,
        compared.gone
    );
    text
}
