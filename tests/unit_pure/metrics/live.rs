//! The metrics of a live run.

use super::{Metrics, parsed};
use echolume::low_level::live::Statistics;
use echolume::low_level::live::metrics::{Conditions, SourceStatus, text};
use echolume::low_level::live::statistics::SourceFaults;
use echolume::low_level::live::volume_pool::VolumeCounts;
use echolume::low_level::metrics::table;
use echolume::low_level::passes::PassTime;
use std::collections::BTreeSet;
use std::time::Duration;

/// Statistics of a period, with two pictures.
fn period() -> Statistics {
    let mut period = Statistics {
        time: Duration::from_secs(1),
        frames: 31,
        lost: 3,
        refused: 2,
        frozen: 11,
        unrecorded: 4,
        faults: SourceFaults { reported: 5, ended: 1, disconnected: 6 },
        pictures: 2,
        volumes: VolumeCounts { shown: 2, dropped: 7, incomplete: 8, left_out: 9 },
        passes: vec![
            PassTime { name: "picture", runs: 2, total: 30e6 },
            PassTime { name: "frames", runs: 31, total: 62e6 },
            PassTime { name: "idle", runs: 0, total: 0.0 },
        ],
        ..Statistics::default()
    };
    [0.004, 0.034, 0.2, 60.0].iter().for_each(|seconds| period.latencies.record(*seconds));
    period
}

fn conditions() -> Conditions {
    Conditions {
        command: "stream",
        device: "llvmpipe \"x\"".into(),
        driver: "Mesa 25.0.7\n(LLVM 19)".into(),
        vulkan: "1.4.305".into(),
        is_running: true,
        started: 1_800_000_000.125,
        now: 1_800_000_015.5,
        write_failures: 1,
        memory: Some(300 << 20),
        device_losses: 2,
        device_stalls: 1,
        busy: Duration::from_millis(250),
        source: SourceStatus { is_connected: true, is_frozen: false, not_opened: 10 },
    }
}

fn value(metrics: &Metrics, name: &str, labels: &[(&str, &str)]) -> f64 {
    let is_it = |sample: &&super::Labelled| labels.iter().all(|(label, value)| sample.0[*label] == *value);
    let found: Vec<_> = metrics[&format!("echolume_{name}")].iter().filter(is_it).collect();
    assert_eq!(found.len(), 1, "{name} {labels:?}");
    found[0].1
}

#[test]
fn every_count_comes_back_in_seconds_and_bytes() {
    let mut totals = Statistics::default();
    totals.add(&period());
    totals.add(&period());
    let metrics = parsed(&text(&totals, &conditions()));
    for (name, labels, expected) in [
        (
            "info",
            &[("command", "stream"), ("device", "llvmpipe \"x\""), ("driver", "Mesa 25.0.7\\n(LLVM 19)")][..],
            1.0,
        ),
        ("info", &[("version", env!("CARGO_PKG_VERSION")), ("vulkan", "1.4.305")], 1.0),
        ("running", &[], 1.0),
        ("start_time_seconds", &[], 1_800_000_000.125),
        ("written_timestamp_seconds", &[], 1_800_000_015.5),
        ("metrics_write_failures_total", &[], 1.0),
        ("resident_memory_bytes", &[], 314_572_800.0),
        ("frames_total", &[], 62.0),
        ("frames_dropped_total", &[("reason", "full")], 6.0),
        ("frames_dropped_total", &[("reason", "refused")], 4.0),
        ("frames_dropped_total", &[("reason", "late")], 18.0),
        ("frames_dropped_total", &[("reason", "frozen")], 22.0),
        ("frames_unrecorded_total", &[], 8.0),
        ("volumes_total", &[("result", "shown")], 4.0),
        ("volumes_total", &[("result", "dropped")], 14.0),
        ("volumes_total", &[("result", "incomplete")], 16.0),
        ("pictures_total", &[], 4.0),
        ("latency_seconds_bucket", &[("le", "0.005")], 2.0),
        ("latency_seconds_bucket", &[("le", "0.02")], 2.0),
        ("latency_seconds_bucket", &[("le", "0.035")], 4.0),
        ("latency_seconds_bucket", &[("le", "0.2")], 6.0),
        ("latency_seconds_bucket", &[("le", "30")], 6.0),
        ("latency_seconds_bucket", &[("le", "+Inf")], 8.0),
        ("latency_seconds_count", &[], 8.0),
        ("pass_seconds_count", &[("pass", "picture")], 4.0),
        ("pass_seconds_count", &[("pass", "frames")], 62.0),
        ("device_losses_total", &[], 2.0),
        ("device_stalls_total", &[], 1.0),
        ("device_busy_seconds", &[], 0.25),
        ("source_connected", &[], 1.0),
        ("source_faults_total", &[("kind", "reported")], 10.0),
        ("source_faults_total", &[("kind", "ended")], 2.0),
        ("source_faults_total", &[("kind", "disconnected")], 12.0),
        ("source_faults_total", &[("kind", "not_opened")], 10.0),
        ("frozen", &[], 0.0),
    ] {
        assert_eq!(value(&metrics, name, labels), expected, "{name} {labels:?}");
    }
    for (name, labels, expected) in [
        ("latency_seconds_sum", &[][..], 120.476),
        ("pass_seconds_sum", &[("pass", "picture")], 0.06),
        ("pass_seconds_sum", &[("pass", "frames")], 0.124),
    ] {
        assert!((value(&metrics, name, labels) / expected - 1.0).abs() < 1e-12, "{name}");
    }
    assert_eq!(metrics["echolume_pass_seconds_sum"].len(), 2, "a pass that did not run has no sample");
    // Nothing of the table is forgotten.
    let of_live = table::ALL.iter().filter(|metric| !metric.name.starts_with("echolume_verify_"));
    let expected: BTreeSet<String> = of_live.flat_map(super::sample_names).collect();
    assert_eq!(metrics.into_keys().collect::<BTreeSet<_>>(), expected);
}

#[test]
fn a_run_of_a_month_makes_no_longer_file_than_one_of_a_minute() {
    let (mut totals, mut first) = (Statistics::default(), 0);
    for n in 0..300 {
        totals.add(&period());
        let lines = text(&totals, &conditions()).lines().count();
        if n == 0 {
            first = lines;
        }
        assert_eq!(lines, first, "period {n}");
    }
    assert!(first < 120, "{first} lines");
}

#[test]
fn a_run_that_has_not_begun_has_all_counters_at_zero() {
    let metrics = parsed(&text(&Statistics::default(), &Conditions::default()));
    // Without them `increase` would not see the first event.
    for metric in table::ALL.iter().filter(|metric| metric.name.ends_with("_total")) {
        assert!(metrics[metric.name].iter().all(|(_, value)| *value == 0.0), "{}", metric.name);
    }
    assert_eq!(value(&metrics, "latency_seconds_count", &[]), 0.0);
    assert!(!metrics.contains_key("echolume_resident_memory_bytes"));
}
