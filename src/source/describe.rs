//! Descriptions of geometry, volumes and times for users, in mm, degrees and seconds.

use crate::files::escaped;
use crate::probe::{Array, Axis, Firing, Geometry, Grid, Motion, Probe, Volumes};
use std::collections::BTreeMap;
use std::path::Path;

/// Longest path, characters.
const MAX_PATH_CHARACTERS: usize = 300;

/// A number for users: at most four decimals, without trailing zeros; large and tiny numbers with an exponent.
pub fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e7).contains(&value.abs()) {
        return format!("{value:.4e}");
    }
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// The rows of a description for users: pairs of title and value.
pub(super) trait Rows {
    fn add(&mut self, title: &str, value: impl Into<String>);
    /// Adds the row "frame": lines and samples of a frame of a sweep, otherwise its width and height in pixels.
    fn add_frame(&mut self, is_sweep: bool, size: [usize; 2]);
    fn add_geometry(&mut self, geometry: &Geometry);
    /// Adds the row "value range". `how` is appended to the values: how they were found.
    fn add_range(&mut self, range: [f64; 2], how: &str);
}

impl Rows for Vec<(String, String)> {
    fn add(&mut self, title: &str, value: impl Into<String>) {
        self.push((title.into(), value.into()));
    }

    fn add_frame(&mut self, is_sweep: bool, [first, second]: [usize; 2]) {
        let text = match is_sweep {
            true => format!("{second} lines of {first} samples"),
            false => format!("{first} x {second} pixels"),
        };
        self.add("frame", text);
    }

    fn add_geometry(&mut self, geometry: &Geometry) {
        self.extend(match geometry {
            Geometry::Sweep(swept) => probe(swept),
            Geometry::Cartesian(lattice) => grid(lattice),
        });
    }

    fn add_range(&mut self, range: [f64; 2], how: &str) {
        let [low, high] = range.map(number);
        self.add("value range", format!("{low} .. {high}{how}"));
    }
}

pub(super) fn path(path: &Path) -> String {
    escaped(&path.display().to_string(), MAX_PATH_CHARACTERS)
}

pub(super) fn volumes(volumes: &Volumes) -> String {
    let frames = if volumes.frames == 1 { "1 frame".into() } else { format!("{} frames", volumes.frames) };
    let mut text = format!("{} of {frames}", volumes.count);
    if volumes.left_over > 0 {
        text += &format!(", {} frames of a last, incomplete one are left out", volumes.left_over);
    }
    match (volumes.both_ways, volumes.first_backward) {
        (true, false) => text += ", swept forwards and backwards in turn",
        (true, true) => text += ", swept backwards and forwards in turn",
        (false, true) => text += ", swept backwards",
        (false, false) => {}
    }
    if volumes.speed_ratio > 0.0 {
        text += &format!(", motor moving for {} of each frame", number(volumes.speed_ratio));
        text += match volumes.firing {
            Firing::Forward => "",
            Firing::Backward => ", the last line first",
            Firing::Alternating => ", the first line and the last first in turn",
        };
    }
    text
}

pub(super) fn grid(grid: &Grid) -> Vec<(String, String)> {
    let [x, y, z] = grid.spacing.map(number);
    let [u, v, w] = grid.origin.map(number);
    let [a, b, c] = grid.size;
    vec![
        ("geometry".into(), format!("Cartesian, {a} x {b} x {c} voxels of {x} x {y} x {z} mm")),
        ("origin".into(), format!("{u}, {v}, {w} mm")),
    ]
}

pub(super) fn probe(probe: &Probe) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let (degrees, mm) = (("deg", 180.0 / std::f64::consts::PI), ("mm", 1.0));
    let (array, unit) = match probe.array {
        Array::Curved { radius } => (format!("curved, radius {} mm", number(radius)), degrees),
        Array::Linear => ("linear".into(), mm),
    };
    rows.add("array", array);
    rows.add("scan lines", axis(&probe.lines, unit));
    let last = probe.start_depth + probe.sample_pitch * (probe.samples.max(1) - 1) as f64;
    let pitch = number(probe.sample_pitch);
    rows.add("depth", format!("{} .. {} mm, {pitch} mm a sample", number(probe.start_depth), number(last)));
    match probe.motion {
        Motion::Fan { wobble_radius } => {
            rows.add("motion", format!("fan about an axis {} mm behind the face", number(wobble_radius)));
            rows.add("slices", axis(&probe.slices, degrees));
        }
        Motion::Translated => {
            rows.add("motion", "translated");
            rows.add("slices", axis(&probe.slices, mm));
        }
        Motion::Still { thickness } => rows.add("motion", format!("still, drawn {} mm thick", number(thickness))),
    }
    if let Some(cut) = probe.folded() {
        rows.add("cut", cut);
    }
    rows.add("speed of sound", format!("{} m/s", number(probe.sound_speed)));
    rows
}

/// `unit`: the name of the unit that is shown, and how many of these make one unit of the axis (rad or mm).
fn axis(axis: &Axis, (unit, scale): (&str, f64)) -> String {
    let [first, last, pitch] = [axis.first(), axis.last(), axis.pitch()].map(|v| number(v * scale));
    let even = if matches!(axis, Axis::Even { .. }) { "" } else { " on average, uneven" };
    match axis.len() {
        1 => format!("1, at {first} {unit}"),
        n => format!("{n}, {first} .. {last} {unit}, {pitch} {unit} apart{even}"),
    }
}

pub(super) fn times(times: &BTreeMap<usize, f64>) -> Option<(String, String)> {
    let (first, last) = (times.values().next()?, times.values().next_back()?);
    Some(("time stamps".into(), format!("{} .. {} s, {} of them", number(*first), number(*last), times.len())))
}

/// What users must know of a file: pairs of title and text. They never contain a field about the patient.
pub(super) type Remarks = Vec<(String, String)>;

/// Logs a warning about a file, and returns it as a row for users: it says what a user must know before they trust a picture.
pub(super) fn warned(file: &Path, title: &str, text: String) -> (String, String) {
    tracing::warn!(file = %path(file), "{text}");
    (title.into(), text)
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_keep_their_size_when_shortened() {
        let shown = [0.25, 30.0, 0.0, -74.99999, 1e-9, 3.4e38, 100.0].map(number);
        assert_eq!(shown, ["0.25", "30", "0", "-75", "1.0000e-9", "3.4000e38", "100"]);
    }
}
