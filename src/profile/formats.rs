//! Profiles as JSON, which comes back as it went, and as CSV for other programs.

use super::statistics::Sample;
use super::{FORMAT, FORMAT_BEFORE, LEVEL, PassProfile, Profile, ProfileError};
use serde::Deserialize;
use std::fmt::Write as _;

/// Every number as it is: `from_json(to_json(p))` is p.
pub fn to_json(profile: &Profile) -> Result<String, ProfileError> {
    profile.check()?;
    let mut text = serde_json::to_string_pretty(profile).map_err(|e| ProfileError::Json(e.to_string()))?;
    text.push('\n');
    Ok(text)
}

/// Total: any text gives a profile that agrees with itself, or an error.
pub fn from_json(text: &str) -> Result<Profile, ProfileError> {
    read(text).map_err(ProfileError::on_one_line)
}

fn read(text: &str) -> Result<Profile, ProfileError> {
    /// Read first: a profile of another version is told from a file that is none.
    #[derive(Deserialize)]
    struct Version {
        format: String,
    }
    let version: Version = serde_json::from_str(text).map_err(|e| ProfileError::Json(e.to_string()))?;
    if ![FORMAT, FORMAT_BEFORE].contains(&version.format.as_str()) {
        return Err(ProfileError::Format { found: version.format });
    }
    let mut profile: Profile = serde_json::from_str(text).map_err(|e| ProfileError::Json(e.to_string()))?;
    profile.format = FORMAT.into();
    profile.check()?;
    Ok(profile)
}

/// One line a pass, then the host's spans, `device` (first begin to last end), `wall` and `cpu` (of the process, where the
/// system tells). Without time stamps the columns of passes that tell times are empty.
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
                vec![kind.into(), quoted(&span.stage), quoted(&span.name), span.runs_per_picture.to_string()];
            fields.push(span.samples_ns.len().to_string());
            fields.extend(times(sample.as_ref()));
            fields.extend([span.bytes_read, span.bytes_written].map(|n| n.to_string()));
            fields.push(number(span.bytes_per_second()));
            fields.extend(
                [span.fetches, span.filtered, span.invocations].map(|n| n.map_or_else(String::new, |n| n.to_string())),
            );
            fields.push(roof.map_or_else(String::new, |r| r.bound.into()));
            fields.extend([roof.map(|r| r.share), share].map(number));
            let _ = writeln!(text, "{}", fields.join(","));
        }
    }
    for (kind, list) in whole(profile) {
        let mut fields = vec![kind.to_string(), String::new(), kind.into(), "1".into(), list.len().to_string()];
        fields.extend(times(Sample::new(list).ok().as_ref()));
        fields.resize(text.lines().next().map_or(0, |l| l.split(',').count()), String::new());
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}

/// One line a repeat of everything that was timed.
pub fn csv_samples(profile: &Profile) -> String {
    let mut text = String::from("kind,stage,name,repeat,ns\n");
    let lists = [("pass", &profile.passes), ("host", &profile.host)];
    let spans = lists.iter().flat_map(|(kind, list)| {
        list.iter().map(move |span| (*kind, span.stage.as_str(), span.name.as_str(), &span.samples_ns))
    });
    let whole = whole(profile).map(|(name, list)| (name, "", name, list));
    for (kind, stage, name, samples) in spans.chain(whole) {
        for (repeat, ns) in samples.iter().enumerate() {
            let _ = writeln!(text, "{kind},{},{},{repeat},{ns}", quoted(stage), quoted(name));
        }
    }
    text
}

/// What is not one pass or span.
fn whole(profile: &Profile) -> impl Iterator<Item = (&'static str, &Vec<f64>)> {
    let cpu = (!profile.cpu_ns.is_empty()).then_some(("cpu", &profile.cpu_ns));
    [("device", &profile.device_ns), ("wall", &profile.wall_ns)].into_iter().chain(cpu)
}

/// Median times of those that have times, ns.
pub(super) fn medians(spans: &[PassProfile]) -> impl Iterator<Item = f64> {
    spans.iter().filter_map(|s| s.sample()).map(|s| s.median())
}

fn times(sample: Option<&Sample>) -> Vec<String> {
    let Some(sample) = sample else { return vec![String::new(); 9] };
    let interval = sample.median_interval(LEVEL);
    let [p5, median, p95] = [0.05, 0.5, 0.95].map(|share| sample.quantile(share));
    let numbers =
        [sample.min(), p5, median, p95, sample.max(), sample.mad(), interval.low, interval.high, interval.coverage];
    numbers.map(|n| n.to_string()).into()
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| v.to_string())
}

/// RFC 4180: quoted where a comma, quote or line break would end the field.
fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.into(),
    }
}
