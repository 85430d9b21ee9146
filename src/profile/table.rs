//! Profiles and comparisons as tables for a terminal.

use super::compare::{Comparison, Kind, Line, Verdict};
use super::formats::medians;
use super::statistics::{Interval, Sample, drift};
use super::{Ceiling, LEVEL, PassProfile, Profile};
use crate::profile::pass_times;
use std::fmt::Write as _;

/// A pass whose halves differ by more is said not to have been steady.
const STEADY: f64 = 1.05;

/// Rows under each other, columns as wide as their widest cell: the first `left` aligned left, the others right.
fn aligned(rows: &[Vec<String>], left: usize) -> String {
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

/// What was measured where, every pass, what lies between passes and on the host, and what the numbers do not say.
pub fn profile(profile: &Profile) -> String {
    let mut text = conditions(profile);
    text.push('\n');
    if profile.has_time_stamps() {
        text.push_str(&aligned(&passes(profile), 2));
    } else {
        text.push_str("times of passes: not known, this device has no time stamps\n");
    }
    text.push('\n');
    text.push_str(&aligned(&whole(profile), 1));
    for note in notes(profile) {
        let _ = writeln!(text, "{note}");
    }
    text
}

fn conditions(profile: &Profile) -> String {
    let (device, sizes) = (&profile.device, &profile.sizes);
    let software = if device.is_software { " (software: computes on the CPU)" } else { "" };
    let clock = match (profile.has_time_stamps(), device.calibrated) {
        (false, _) => "none".into(),
        (true, tied) => format!(
            "{} ns a tick, {} bits, {} to the host's clock",
            device.timestamp_period_ns,
            device.valid_bits,
            if tied { "tied" } else { "not tied" }
        ),
    };
    let clocks = device.clocks.as_deref().unwrap_or("not known: runs at other clocks or power states do not compare");
    let sizes = format!(
        "frames of {} x {}, {} slices, volume {} x {} x {}, picture {} x {}; settings {}",
        sizes.frame[0],
        sizes.frame[1],
        sizes.slices,
        sizes.volume[0],
        sizes.volume[1],
        sizes.volume[2],
        sizes.picture[0],
        sizes.picture[1],
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

/// A head and one row a pass; columns that no pass fills are left out.
fn passes(profile: &Profile) -> Vec<Vec<String>> {
    let head = [
        "stage",
        "pass",
        "runs",
        "ms",
        "p5",
        "p95",
        "95 % interval",
        "drift %",
        "GB/s",
        "% of ceiling",
        "M invocations",
        "share %",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
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
    let kept: Vec<usize> = (0..head.len()).filter(|c| filled(*c)).collect();
    rows.iter().map(|row| kept.iter().map(|c| row[*c].clone()).collect()).collect()
}

/// What is not one pass: the device as a whole, and the host.
fn whole(profile: &Profile) -> Vec<Vec<String>> {
    let mut rows = vec![["a picture", "ms", "p5", "p95", "95 % interval", "% of wall"].map(String::from).to_vec()];
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
        drift(&pass.samples_ns).ok().flatten().is_some_and(|d| !(1.0 / STEADY..=STEADY).contains(&d))
    };
    let unsteady: Vec<&str> = profile.passes.iter().filter(moved).map(|p| p.name.as_str()).collect();
    if !unsteady.is_empty() {
        let by = 100.0 * (STEADY - 1.0);
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
    notes.extend(profile.acquisition.map(|a| pass_times::floor(a.seconds, a.sound_speed)));
    notes
}

/// One line a pass, the conditions that differ, the test, and the regressions.
pub fn comparison(comparison: &Comparison) -> String {
    let head = ["stage", "pass", "old ms", "new ms", "ratio", "95 % interval", "p (Holm)", "noise", "verdict", ""];
    let mut rows = vec![head.map(String::from).to_vec()];
    rows.extend(comparison.lines.iter().map(compared));
    let mut text = String::new();
    for note in &comparison.notes {
        let _ = writeln!(text, "{note}");
    }
    text.push_str(&aligned(&rows, 2));
    let _ = writeln!(text, "test: {}", comparison.test);
    let regressions: Vec<&str> = comparison.regressions().map(|l| l.name.as_str()).collect();
    let by = 100.0 * (comparison.threshold - 1.0);
    let _ = match regressions.is_empty() {
        true => writeln!(text, "nothing is slower by more than {by:.1} %"),
        false => writeln!(text, "slower by more than {by:.1} %: {}", regressions.join(", ")),
    };
    text
}

fn compared(line: &Line) -> Vec<String> {
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
        Kind::Wall => "",
    };
    let [old, new] = [line.old_ns, line.new_ns].map(|ns| ns.map_or_else(String::new, ms));
    let mut row = vec![group.into(), line.name.clone(), old, new];
    row.extend(match &line.ratio {
        None => vec![String::new(); 4],
        Some(r) => vec![
            format!("{:.3}", r.estimate),
            format!("{:.3}..{:.3}", r.low, r.high),
            format!("{:.4}", r.p_holm),
            format!("{:.1} %", 100.0 * (r.floor - 1.0)),
        ],
    });
    row.extend([verdict.to_string(), line.note.clone().unwrap_or_default()]);
    row
}
