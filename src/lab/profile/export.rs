//! Writes profiles, comparisons and pass times: CSV, tables for a terminal, and a run as Chrome trace events (Trace Event Format, JSON
//! object form), which Perfetto and chrome://tracing open.

use super::compare::{Comparison, Kind, Line, Ratio, Verdict};
use super::statistics::{Interval, Sample, drift};
use super::{Ceiling, LEVEL, PassProfile, Profile, Sizes};
use crate::passes::Span;
use crate::passes::times::acquisition_floor;
use crate::text::csv_field;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// A profile as CSV: a line for each pass, then the host spans, `device` (from the begin of the first pass to the end of the last), `wall`, and `cpu`
/// (CPU time of the process, if the system reports it). Where a line has no times, such as `device` without time stamps, its time columns are empty.
pub fn csv(profile: &Profile) -> String {
    let mut text = String::from(
        "kind,stage,name,runs_per_picture,repeats,min_ns,p5_ns,median_ns,p95_ns,max_ns,mad_ns,ci_low_ns,ci_high_ns,\
         ci_coverage,bytes_read,bytes_written,bytes_per_s,fetches,filtered,invocations,ceiling,share_of_ceiling,share_of_passes\n",
    );
    let sum: f64 = medians(&profile.passes).sum();
    for (kind, list) in [("pass", &profile.passes), ("host", &profile.host)] {
        for span in list {
            let sample = span.sample();
            let roof = profile.ceilings.as_ref().and_then(|c| span.roof(c));
            let share = sample.as_ref().filter(|_| kind == "pass" && sum > 0.0).map(|s| s.median() / sum);
            let mut fields =
                vec![kind.into(), csv_field(&span.stage), csv_field(&span.name), span.runs_per_picture.to_string()];
            fields.push(span.samples_ns.len().to_string());
            fields.extend(time_fields(sample.as_ref()));
            fields.extend([span.bytes_read, span.bytes_written].map(|n| n.to_string()));
            fields.push(optional(span.bytes_per_second()));
            fields.extend([span.fetches, span.filtered, span.invocations].map(optional));
            fields.push(optional(roof.map(|r| r.bound)));
            fields.extend([roof.map(|r| r.share), share].map(optional));
            let _ = writeln!(text, "{}", fields.join(","));
        }
    }
    for (kind, list) in totals(profile) {
        let mut fields = vec![kind.to_string(), String::new(), kind.into(), "1".into(), list.len().to_string()];
        fields.extend(time_fields(Sample::new(list).ok().as_ref()));
        fields.resize(text.lines().next().map_or(0, |l| l.split(',').count()), String::new());
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}

/// All times of a profile, ns, as CSV: a line for each repeat of every pass, host span, and of `device` (from the begin of the first pass to the end
/// of the last), `wall`, and `cpu` (CPU time of the process, if the system reports it).
pub fn csv_samples(profile: &Profile) -> String {
    let mut text = String::from("kind,stage,name,repeat,ns\n");
    let lists = [("pass", &profile.passes), ("host", &profile.host)];
    let spans = lists.iter().flat_map(|(kind, list)| {
        list.iter().map(move |span| (*kind, span.stage.as_str(), span.name.as_str(), &span.samples_ns))
    });
    let totals = totals(profile).map(|(name, list)| (name, "", name, list));
    for (kind, stage, name, samples) in spans.chain(totals) {
        for (repeat, ns) in samples.iter().enumerate() {
            let _ = writeln!(text, "{kind},{},{},{repeat},{ns}", csv_field(stage), csv_field(name));
        }
    }
    text
}

/// Times that are not of one pass or span.
fn totals(profile: &Profile) -> impl Iterator<Item = (&'static str, &Vec<f64>)> {
    let cpu = (!profile.cpu_ns.is_empty()).then_some(("cpu", &profile.cpu_ns));
    [("device", &profile.device_ns), ("wall", &profile.wall_ns)].into_iter().chain(cpu)
}

/// Median times of the spans that have times, ns.
fn medians(spans: &[PassProfile]) -> impl Iterator<Item = f64> {
    spans.iter().filter_map(|s| s.sample()).map(|s| s.median())
}

fn time_fields(sample: Option<&Sample>) -> Vec<String> {
    let Some(sample) = sample else { return vec![String::new(); 9] };
    let interval = sample.median_interval(LEVEL);
    let [p5, median, p95] = [0.05, 0.5, 0.95].map(|share| sample.quantile(share));
    let numbers =
        [sample.min(), p5, median, p95, sample.max(), sample.mad(), interval.low, interval.high, interval.coverage];
    numbers.map(|n| n.to_string()).into()
}

fn optional(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

/// Ratio of the medians of the halves of a run above which a pass is reported as not steady.
const MAX_DRIFT: f64 = 1.05;

/// A table as text, each column as wide as its widest cell: the first `left` columns are left-aligned, the others right-aligned.
pub(crate) fn aligned(rows: &[Vec<String>], left: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(c, (cell, width))| match c < left {
            true => format!("{cell:<width$}"),
            false => format!("{cell:>width$}"),
        });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}

/// The cells of a row of which none has a `|`, which separates them here.
fn cells(row: &str) -> Vec<String> {
    row.split('|').map(String::from).collect()
}

fn ms(ns: f64) -> String {
    format!("{:.4}", ns * 1e-6)
}

fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

fn interval(interval: &Interval) -> String {
    let mark = if interval.reaches(LEVEL) { "" } else { "*" };
    format!("{}..{}{mark}", ms(interval.low), ms(interval.high))
}

/// A profile as a table for a terminal: conditions, passes, totals and notes.
pub fn profile_table(profile: &Profile) -> String {
    let mut text = conditions(profile);
    text.push('\n');
    if profile.has_time_stamps() {
        text.push_str(&aligned(&pass_rows(profile), 2));
    } else {
        text.push_str("times of passes: not known, this device has no time stamps\n");
    }
    text.push('\n');
    text.push_str(&aligned(&total_rows(profile), 1));
    for note in notes(profile) {
        let _ = writeln!(text, "{note}");
    }
    text
}

fn conditions(profile: &Profile) -> String {
    let device = &profile.device;
    let software = if device.is_software { " (software: computes on the CPU)" } else { "" };
    let clock = match (profile.has_time_stamps(), device.calibrated) {
        (false, _) => "none".into(),
        (true, tied) => format!(
            "{} ns a tick, {} bits, {} to the host's clock{}",
            device.timestamp_period_ns,
            device.valid_bits,
            if tied { "tied" } else { "not tied" },
            profile.clock_deviation_ns.map_or(String::new(), |ns| format!(" within {:.1} us", ns as f64 / 1e3))
        ),
    };
    let clocks = device.clocks.as_deref().unwrap_or("not known: runs at other clocks or power states do not compare");
    let Sizes { frame: [w, h], slices, volume: [x, y, z], picture: [across, down] } = profile.sizes;
    let sizes = format!(
        "frames of {w} x {h}, {slices} slices, volume {x} x {y} x {z}, picture {across} x {down}; settings {}",
        profile.settings_hash
    );
    let turned =
        if profile.turn == 0.0 { String::new() } else { format!(", the view turned by {} deg each", profile.turn) };
    let mut rows = vec![
        ("device", format!("{}{software}, {}, Vulkan {}", device.name, device.driver, device.api)),
        ("time stamps", clock),
        ("clocks", clocks.into()),
        ("program", format!("{}, {}", profile.program, profile.date)),
        ("input", profile.input.clone()),
        ("sizes", sizes),
        ("repeats", format!("{} after {} to warm up{turned}", profile.repeats, profile.warm_up)),
    ];
    if let Some(sampling) = &profile.sampling {
        rows.push(("samples", sampling.clone()));
    }
    if let Some(ceilings) = &profile.ceilings {
        let rate = |c: &Ceiling| format!("{:.2} ({:.2}..{:.2})", c.median * 1e-9, c.low * 1e-9, c.high * 1e-9);
        let line = format!(
            "copy {} GB/s, sampling {} G/s{}, fetch {} G/s",
            rate(&ceilings.copy),
            rate(&ceilings.sampling),
            ceilings.exact.as_ref().map_or_else(String::new, |c| format!(", by eight texels {} G/s", rate(c))),
            rate(&ceilings.fetch)
        );
        rows.push(("ceilings", line));
    }
    aligned(&rows.into_iter().map(|(name, value)| vec![name.into(), value]).collect::<Vec<_>>(), 2)
}

/// A header and one row per pass; columns that are empty for all passes are omitted.
fn pass_rows(profile: &Profile) -> Vec<Vec<String>> {
    let head = "stage|pass|runs|ms|p5|p95|95 % interval|drift %|GB/s|% of ceiling|M invocations|share %";
    let mut rows = vec![cells(head)];
    let sum: f64 = medians(&profile.passes).sum();
    for pass in &profile.passes {
        let Some(sample) = pass.sample() else { continue };
        let roof = profile.ceilings.as_ref().and_then(|c| pass.roof(c));
        let drift = drift(&pass.samples_ns).ok().flatten();
        rows.push(vec![
            pass.stage.clone(),
            pass.name.clone(),
            pass.runs_per_picture.to_string(),
            ms(sample.median()),
            ms(sample.quantile(0.05)),
            ms(sample.quantile(0.95)),
            interval(&sample.median_interval(LEVEL)),
            drift.map_or_else(String::new, |d| format!("{:+.1}", 100.0 * (d - 1.0))),
            pass.bytes_per_second().map_or_else(String::new, |b| format!("{:.2}", b * 1e-9)),
            roof.map_or_else(String::new, |r| format!("{} {}", percent(r.share), r.bound)),
            pass.invocations.map_or_else(String::new, |n| format!("{:.3}", n as f64 * 1e-6)),
            if sum > 0.0 { percent(sample.median() / sum) } else { String::new() },
        ]);
    }
    let filled = |c: usize| rows.iter().skip(1).any(|row| !row[c].is_empty());
    let kept: Vec<usize> = (0..rows[0].len()).filter(|c| filled(*c)).collect();
    rows.iter().map(|row| kept.iter().map(|c| row[*c].clone()).collect()).collect()
}

/// Times that are not of one pass: totals of the device, and the host.
fn total_rows(profile: &Profile) -> Vec<Vec<String>> {
    let mut rows = vec![cells("a picture|ms|p5|p95|95 % interval|% of wall")];
    let wall = Sample::new(&profile.wall_ns).ok().map(|s| s.median()).filter(|w| *w > 0.0);
    let mut add = |name: &str, times: &[f64]| {
        let Ok(sample) = Sample::new(times) else { return };
        rows.push(vec![
            name.into(),
            ms(sample.median()),
            ms(sample.quantile(0.05)),
            ms(sample.quantile(0.95)),
            interval(&sample.median_interval(LEVEL)),
            wall.map_or_else(String::new, |w| percent(sample.median() / w)),
        ]);
    };
    add("passes, sum", &profile.pass_sums());
    add("idle between passes", &profile.idle_ns());
    add("device, first to last", &profile.device_ns);
    for PassProfile { name, samples_ns, .. } in &profile.host {
        add(&format!("host: {name}"), samples_ns);
    }
    add("wall, submit to idle", &profile.wall_ns);
    add("CPU, all threads", &profile.cpu_ns);
    rows
}

fn notes(profile: &Profile) -> Vec<String> {
    let mut notes = Vec::new();
    if let Ok(wall) = Sample::new(&profile.wall_ns) {
        let interval = wall.median_interval(LEVEL);
        if !interval.reaches(LEVEL) {
            let covers = 100.0 * interval.coverage;
            notes
                .push(format!("* {} repeats are too few for 95 %: the whole range covers {covers:.1} %", wall.count()));
        }
    }
    let moved = |pass: &&PassProfile| {
        drift(&pass.samples_ns).ok().flatten().is_some_and(|d| !(1.0 / MAX_DRIFT..=MAX_DRIFT).contains(&d))
    };
    let unsteady: Vec<&str> = profile.passes.iter().filter(moved).map(|p| p.name.as_str()).collect();
    if !unsteady.is_empty() {
        let by = 100.0 * (MAX_DRIFT - 1.0);
        notes.push(format!("not steady, halves of the run differ by more than {by:.0} %: {}", unsteady.join(", ")));
    }
    if profile.device.is_software && profile.has_time_stamps() {
        notes.push("a software device stamps times by the CPU's clock, and shares the CPU with everything else".into());
    }
    if profile.ceilings.is_some() && profile.has_time_stamps() {
        notes.push(
            "GB/s counts every texel of every slot once: the least traffic; caches may lift it above the ceiling"
                .into(),
        );
    }
    notes.extend(profile.acquisition.map(|a| acquisition_floor(a.seconds, a.sound_speed)));
    notes
}

/// A comparison as a table for a terminal: notes such as differing conditions, one row for each [`Line`], the test, and the regressions or what may
/// have been overlooked.
pub fn comparison_table(comparison: &Comparison) -> String {
    let mut rows = vec![cells("stage|pass|old ms|new ms|ratio|95 % interval|p (Holm)|noise|sees from|verdict|")];
    rows.extend(comparison.lines.iter().map(comparison_row));
    let mut text = String::new();
    for note in &comparison.notes {
        let _ = writeln!(text, "{note}");
    }
    text.push_str(&aligned(&rows, 2));
    let _ = writeln!(text, "compared: {}", comparison.time);
    let _ = writeln!(text, "test: {}", comparison.test);
    let regressions: Vec<&str> = comparison.regressions().map(|l| l.name.as_str()).collect();
    let by = 100.0 * (comparison.threshold - 1.0);
    let _ = match (regressions.is_empty(), comparison.cannot_tell()) {
        (true, None) => writeln!(text, "nothing is slower by more than {by:.1} %"),
        (true, Some(why)) => writeln!(text, "{why}"),
        (false, _) => writeln!(text, "slower by more than {by:.1} %: {}", regressions.join(", ")),
    };
    text
}

fn comparison_row(line: &Line) -> Vec<String> {
    let verdict = match line.verdict {
        Verdict::Faster => "faster",
        Verdict::Slower => "SLOWER",
        Verdict::WithinNoise => "within noise",
        Verdict::New => "new",
        Verdict::Gone => "gone",
        Verdict::NotComparable => "not comparable",
    };
    let group = match line.kind {
        Kind::Pass => line.stage.as_str(),
        Kind::Host => "host",
        Kind::Wall | Kind::Cpu => "",
    };
    let [old, new] = [line.old_ns, line.new_ns].map(|ns| ns.map_or_else(String::new, ms));
    let mut row = vec![group.into(), line.name.clone(), old, new];
    let ratio = |r: Ratio| {
        let interval = format!("{:.3}..{:.3}", r.low, r.high);
        let noise = format!("{:.1} %", 100.0 * (r.floor - 1.0));
        [format!("{:.3}", r.estimate), interval, format!("{:.4}", r.p_holm), noise]
    };
    row.extend(line.ratio.map(ratio).unwrap_or_default());
    row.push(line.limit.map_or_else(String::new, |limit| format!("{:.1} %", 100.0 * (limit - 1.0))));
    row.extend([verdict.to_string(), line.note.clone().unwrap_or_default()]);
    row
}

/// Why a trace cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    #[error("span {name:?} of repeat {repeat}: from {begin_ns} to {end_ns} ns is not an interval of time")]
    Interval { name: &'static str, repeat: usize, begin_ns: f64, end_ns: f64 },
    #[error("trace: {0}")]
    Json(String),
}

/// Maximum time that the numbers of the format resolve to the nanosecond: 2^53 ns, 104 days.
const MAX_NS: f64 = 9_007_199_254_740_992.0;

/// Spans as a Chrome trace, those of host and device on one time axis. Each is given with the index, from 0, of its measured repeat. Host spans may
/// nest; other overlapping spans get threads of their own, so that no viewer drops them. Without calibration the device's spans are consistent only
/// among themselves, and the trace states that.
///
/// # Errors
/// A span ends before it begins, or a time is not finite or beyond 2^53 ns (104 days).
pub fn chrome_trace(profile: &Profile, spans: &[(usize, Span)]) -> Result<String, TraceError> {
    for (repeat, Span { name, begin, end, .. }) in spans {
        let fits = |ns: &f64| ns.is_finite() && ns.abs() < MAX_NS;
        if !(fits(begin) && fits(end) && begin <= end) {
            return Err(TraceError::Interval { name, repeat: *repeat, begin_ns: *begin, end_ns: *end });
        }
    }
    // Calibration is not exact to the nanosecond: the first time stamp may be before the begin of the run.
    let origin = spans.iter().map(|(_, s)| s.begin.round() as i64).min().unwrap_or(0).min(0);
    let tied = if profile.device.calibrated { "" } else { " (clock not tied to the host's)" };
    let names = [(false, "host".to_string()), (true, format!("device {}{tied}", profile.device.name))];
    let mut events = Vec::new();
    for (on_device, name) in names {
        let process = process(on_device);
        events.push(json!({"ph": "M", "name": "process_name", "pid": process, "args": {"name": name}}));
        events.push(json!({"ph": "M", "name": "process_sort_index", "pid": process, "args": {"sort_index": process}}));
        let placed = lanes(spans, on_device);
        for lane in 0..placed.iter().map(|(lane, ..)| lane + 1).max().unwrap_or(0) {
            let name = match (on_device, lane) {
                (false, 0) => "calls".into(),
                (true, 0) => "passes".into(),
                (_, lane) => format!("overlapping {lane}"),
            };
            events.push(
                json!({"ph": "M", "name": "thread_name", "pid": process, "tid": lane + 1, "args": {"name": name}}),
            );
        }
        events.extend(
            placed
                .into_iter()
                .map(|(lane, begin, end, span)| event(profile, span, lane, [begin - origin, end - origin])),
        );
    }
    let trace = json!({
        "displayTimeUnit": "ns",
        "otherData": {
            "program": profile.program,
            "date": profile.date,
            "device": profile.device.name,
            "driver": profile.device.driver,
            "input": profile.input,
            "settings": profile.settings_hash,
            "clocks tied": profile.device.calibrated,
            "clock deviation ns": profile.clock_deviation_ns,
        },
        "traceEvents": events,
    });
    serde_json::to_string(&trace).map_err(|e| TraceError::Json(e.to_string()))
}

fn process(on_device: bool) -> u32 {
    1 + u32::from(on_device)
}

/// `between`: begin and end, ns from the start of the trace. The format counts microseconds; three decimals resolve 1 ns.
fn event(profile: &Profile, (repeat, span): &(usize, Span), lane: usize, between: [i64; 2]) -> Value {
    let us = |ns: i64| ns as f64 / 1e3;
    let (list, category) = if span.on_device { (&profile.passes, "pass") } else { (&profile.host, "host") };
    let stage = list.iter().find(|p| p.name == span.name).map_or("", |p| p.stage.as_str());
    json!({
        "ph": "X",
        "name": span.name,
        "cat": category,
        "pid": process(span.on_device),
        "tid": lane + 1,
        "ts": us(between[0]),
        "dur": us(between[1] - between[0]),
        "args": {"repeat": repeat, "stage": stage},
    })
}

/// The spans of the device or the host in order of begin: lane, begin, end (integer ns) and the span with its repeat. In a lane of the device
/// spans do not overlap; on the host they may nest.
fn lanes(spans: &[(usize, Span)], on_device: bool) -> Vec<(usize, i64, i64, &(usize, Span))> {
    let rounded = |(_, span): &(usize, Span)| [span.begin.round() as i64, span.end.round() as i64];
    let mut ordered: Vec<_> = spans.iter().filter(|(_, s)| s.on_device == on_device).collect();
    // Of two that begin together, the longer encloses the shorter.
    ordered.sort_by_key(|s| (rounded(s)[0], -rounded(s)[1]));
    // Ends of the open spans of each lane, innermost last.
    let mut open: Vec<Vec<i64>> = Vec::new();
    let mut placed = Vec::with_capacity(ordered.len());
    for span in ordered {
        let [begin, end] = rounded(span);
        for lane in &mut open {
            while lane.last().is_some_and(|last| *last <= begin) {
                lane.pop();
            }
        }
        let fits = |lane: &Vec<i64>| lane.last().is_none_or(|last| !on_device && end <= *last);
        let at = open.iter().position(fits).unwrap_or(open.len());
        if at == open.len() {
            open.push(Vec::new());
        }
        open[at].push(end);
        placed.push((at, begin, end, span));
    }
    placed
}
