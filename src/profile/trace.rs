//! A run as Chrome trace events (Trace Event Format, JSON object form): Perfetto and chrome://tracing open it.

use super::Profile;
use serde_json::{Value, json};

/// Where a span ran, and by whose clock it was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Track {
    Device,
    Host,
}

/// A timed span, in ns since the run began.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    pub name: String,
    pub track: Track,
    /// Repeat that it belongs to, from 0.
    pub repeat: usize,
    pub begin_ns: f64,
    pub end_ns: f64,
}

/// Why a trace cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    #[error("span {name:?} of repeat {repeat}: from {begin_ns} to {end_ns} ns is no interval of time")]
    Interval { name: String, repeat: usize, begin_ns: f64, end_ns: f64 },
    #[error("trace: {0}")]
    Json(String),
}

/// Maximum time that the numbers of the format resolve to the nanosecond: 2^53 ns, 104 days.
const MAX_NS: f64 = 9_007_199_254_740_992.0;

/// Writes spans as a Chrome trace, both tracks on one time axis. Host spans may nest; other overlapping spans get threads of their
/// own, so that no viewer drops them. Without calibration the device's spans are consistent only among themselves, and the trace
/// says so.
///
/// # Errors
/// A span that ends before it begins, or is not finite.
pub fn chrome(profile: &Profile, spans: &[Span]) -> Result<String, TraceError> {
    for span in spans {
        let fits = |ns: f64| ns.is_finite() && ns.abs() < MAX_NS;
        if !(fits(span.begin_ns) && fits(span.end_ns) && span.begin_ns <= span.end_ns) {
            let (name, repeat) = (span.name.clone(), span.repeat);
            return Err(TraceError::Interval { name, repeat, begin_ns: span.begin_ns, end_ns: span.end_ns });
        }
    }
    // Calibration is not exact to the nanosecond: the first time stamp may be before the begin of the run.
    let origin = spans.iter().map(|s| s.begin_ns.round() as i64).min().unwrap_or(0).min(0);
    let tied = if profile.device.calibrated { "" } else { " (clock not tied to the host's)" };
    let names = [(Track::Host, "host".to_string()), (Track::Device, format!("device {}{tied}", profile.device.name))];
    let mut events = Vec::new();
    for (track, name) in names {
        let process = process(track);
        events.push(json!({"ph": "M", "name": "process_name", "pid": process, "args": {"name": name}}));
        events.push(json!({"ph": "M", "name": "process_sort_index", "pid": process, "args": {"sort_index": process}}));
        let placed = lanes(spans, track);
        for lane in 0..placed.iter().map(|(lane, ..)| lane + 1).max().unwrap_or(0) {
            let name = match (track, lane) {
                (Track::Host, 0) => "calls".into(),
                (Track::Device, 0) => "passes".into(),
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
        },
        "traceEvents": events,
    });
    serde_json::to_string(&trace).map_err(|e| TraceError::Json(e.to_string()))
}

fn process(track: Track) -> u32 {
    match track {
        Track::Host => 1,
        Track::Device => 2,
    }
}

/// `between`: begin and end, ns from the start of the trace. The format counts microseconds; three decimals resolve 1 ns.
fn event(profile: &Profile, span: &Span, lane: usize, between: [i64; 2]) -> Value {
    let us = |ns: i64| ns as f64 / 1e3;
    let (list, category) = match span.track {
        Track::Device => (&profile.passes, "pass"),
        Track::Host => (&profile.host, "host"),
    };
    let stage = list.iter().find(|p| p.name == span.name).map_or("", |p| p.stage.as_str());
    json!({
        "ph": "X",
        "name": span.name,
        "cat": category,
        "pid": process(span.track),
        "tid": lane + 1,
        "ts": us(between[0]),
        "dur": us(between[1] - between[0]),
        "args": {"repeat": span.repeat, "stage": stage},
    })
}

/// The spans of a track in order of begin: lane, begin, end (integer ns) and the span. In a lane of the device spans do not
/// overlap; on the host they may nest.
fn lanes(spans: &[Span], track: Track) -> Vec<(usize, i64, i64, &Span)> {
    let rounded = |span: &Span| [span.begin_ns.round() as i64, span.end_ns.round() as i64];
    let mut ordered: Vec<&Span> = spans.iter().filter(|s| s.track == track).collect();
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
        let fits = |lane: &Vec<i64>| lane.last().is_none_or(|last| track == Track::Host && end <= *last);
        let at = open.iter().position(fits).unwrap_or(open.len());
        if at == open.len() {
            open.push(Vec::new());
        }
        open[at].push(end);
        placed.push((at, begin, end, span));
    }
    placed
}
