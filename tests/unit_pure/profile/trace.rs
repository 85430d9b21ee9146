//! Traces obey the rules of the Trace Event Format.

use super::simulated::{Random, pass, profile};
use echolume::low_level::passes::Span;
use echolume::low_level::profile::Profile;
use echolume::low_level::profile::export::chrome_trace;
use serde_json::Value;
use std::collections::BTreeMap;

#[derive(Clone, Copy, PartialEq)]
enum Track {
    Device,
    Host,
}

fn span(name: &'static str, track: Track, begin: f64, end: f64) -> (usize, Span) {
    (0, Span { name, on_device: track == Track::Device, begin, end, runs: 1, invocations: None })
}

fn events(profile: &Profile, spans: &[(usize, Span)]) -> Vec<Value> {
    let text = chrome_trace(profile, spans).unwrap_or_else(|e| panic!("{e}"));
    let trace: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(trace["displayTimeUnit"], "ns");
    assert_eq!(trace["otherData"]["device"], "simulated");
    trace["traceEvents"].as_array().expect("events").clone()
}

/// Integer ns from a number of microseconds, as Perfetto reads it; they must be exact.
fn ns(value: &Value) -> i64 {
    let us = value.as_f64().expect("a number");
    let ns = (us * 1e3).round();
    assert_eq!(ns / 1e3, us, "{us} us are no whole ns");
    ns as i64
}

/// (pid, tid, begin, end, name) of every complete event, in order, after the rules were checked.
fn valid(events: &[Value]) -> Vec<(u64, u64, i64, i64, String)> {
    let mut named = BTreeMap::new();
    let mut threads = BTreeMap::new();
    let mut found = Vec::new();
    for event in events {
        let (pid, tid) = (event["pid"].as_u64().expect("pid"), event["tid"].as_u64().unwrap_or(0));
        match event["ph"].as_str().expect("ph") {
            "M" => {
                let name = event["name"].as_str().expect("name").to_string();
                assert!(["process_name", "process_sort_index", "thread_name"].contains(&name.as_str()), "{name}");
                assert!(event["args"].is_object());
                named.insert((pid, tid, name), event["args"]["name"].clone());
            }
            "X" => {
                let (begin, duration) = (ns(&event["ts"]), ns(&event["dur"]));
                assert!(begin >= 0 && duration >= 0, "{event}");
                assert!(event["args"]["repeat"].is_u64() && event["cat"].is_string());
                threads.insert((pid, tid), ());
                found.push((pid, tid, begin, begin + duration, event["name"].as_str().expect("name").to_string()));
            }
            other => panic!("phase {other}"),
        }
    }
    for (pid, tid) in threads.into_keys() {
        assert!(named.contains_key(&(pid, 0, "process_name".into())), "process {pid} has no name");
        assert!(named.contains_key(&(pid, tid, "thread_name".into())), "thread {tid} of {pid} has no name");
        let mut open: Vec<i64> = Vec::new();
        let mut before = 0;
        for (_, _, begin, end, name) in found.iter().filter(|e| (e.0, e.1) == (pid, tid)) {
            assert!(*begin >= before, "{name} goes back in time");
            before = *begin;
            while open.last().is_some_and(|last| last <= begin) {
                open.pop();
            }
            assert!(open.last().is_none_or(|last| end <= last), "{name} overlaps and does not nest");
            assert!(pid == 1 || open.is_empty(), "{name} overlaps on the device");
            open.push(*end);
        }
    }
    found
}

#[test]
fn a_trace_keeps_the_rules_whatever_the_spans() {
    let mut random = Random(71);
    for _ in 0..50 {
        let mut spans = Vec::new();
        for i in 0..60 {
            let track = if random.unit() < 0.5 { Track::Device } else { Track::Host };
            let begin = random.between(-500.0, 1e7).round() + random.unit();
            let length = [0.0, random.between(0.0, 2e6), 1e5][i % 3];
            spans.push(span("a span", track, begin, begin + length));
        }
        let found = valid(&events(&profile(1), &spans));
        assert_eq!(found.len(), spans.len(), "none is lost");
    }
}

#[test]
fn passes_in_a_row_share_a_thread_and_host_spans_nest() {
    let mut profile = profile(1);
    profile.passes.push(pass("volume", vec![1000.0]));
    let spans = [
        span("tone", Track::Device, 1333.4, 1500.0),
        span("volume", Track::Device, 333.1, 1333.4),
        span("submit", Track::Host, 10.0, 200.0),
        span("whole", Track::Host, 0.0, 2000.0),
        span("wait", Track::Host, 200.0, 2000.0),
    ];
    let all = events(&profile, &spans);
    let found = valid(&all);
    let at = |name: &str| found.iter().find(|e| e.4 == name).expect("span").clone();
    assert_eq!(at("volume"), (2, 1, 333, 1333, "volume".into()));
    assert_eq!(at("tone"), (2, 1, 1333, 1500, "tone".into()));
    for name in ["whole", "submit", "wait"] {
        assert_eq!((at(name).0, at(name).1), (1, 1), "{name}");
    }
    let volume = all.iter().find(|e| e["ph"] == "X" && e["name"] == "volume").expect("volume");
    assert_eq!(volume["args"]["stage"], "raycast");
}

#[test]
fn overlap_on_the_device_goes_to_a_second_thread() {
    let spans = [span("a", Track::Device, 0.0, 100.0), span("b", Track::Device, 50.0, 150.0)];
    let found = valid(&events(&profile(1), &spans));
    assert_eq!((found[0].1, found[1].1), (1, 2));
}

#[test]
fn a_clock_that_is_not_tied_is_named() {
    let mut profile = profile(1);
    let name = |profile: &Profile| {
        let events = events(profile, &[]);
        let device = events.iter().find(|e| e["name"] == "process_name" && e["pid"] == 2).expect("device");
        device["args"]["name"].as_str().expect("name").to_string()
    };
    assert_eq!(name(&profile), "device simulated");
    profile.device.calibrated = false;
    assert_eq!(name(&profile), "device simulated (clock not tied to the host's)");
}

#[test]
fn invalid_time_spans_are_refused() {
    for (begin, end) in [(5.0, 4.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (-1e300, 0.0)] {
        let error =
            chrome_trace(&profile(1), &[span("bad", Track::Host, begin, end)]).expect_err("refused").to_string();
        assert!(error.starts_with("span \"bad\" of repeat 0: from "), "{error}");
    }
}
