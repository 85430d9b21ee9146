//! A probe as the text of a probe file.

use super::{LONGEST, ProbeFile};
use crate::probe::{Array, Axis, Motion, Probe, Volumes};
use std::fmt::Write as _;
use std::path::Path;

/// What is apart by no more, in rad or mm, is the same place: a file says angles in degrees.
const SAME: f64 = 1e-9;

impl ProbeFile {
    /// The text that [`ProbeFile::read`] and [`ProbeFile::geometry`] make this probe and these volumes of again. `range`: the values that are
    /// shown as 0 and 1. The probe is that of the first volume.
    ///
    /// # Errors
    /// A probe that no file can say: an advance that is not the motor's at an even speed, tables longer than a file may be; in words.
    pub fn to_toml(probe: &Probe, volumes: &Volumes, range: [f64; 2]) -> Result<String, String> {
        let gap = probe.slices.at(1.0) - probe.slices.at(0.0);
        let advance = probe.slice_position(probe.lines.len() as f64, 0.0) - probe.slice_position(0.0, 0.0);
        let speed_ratio = if probe.slices.len() > 1 { (advance / gap).abs() } else { 0.0 };
        let text = written(probe, &Volumes { speed_ratio, ..volumes.clone() }, range);
        let read = ProbeFile::parse(Path::new("probe.toml"), &text)
            .and_then(|file| file.geometry(probe.samples, probe.lines.len(), volumes.frames * volumes.count));
        let (read, there) = read.map_err(|e| format!("{}: {}", e.field(), e.fault()))?;
        let read = Probe { advance: there.advance(0, &read.slices), ..read };
        match is_same(probe, &read) && text.len() as u64 <= LONGEST {
            true => Ok(text),
            false => Err("cannot be said by a probe file".into()),
        }
    }
}

fn written(probe: &Probe, volumes: &Volumes, [low, high]: [f64; 2]) -> String {
    let mut text = String::from("# Lengths in mm, angles in degrees.\n");
    let mut say = |line: std::fmt::Arguments| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{line}");
    };
    match probe.array {
        Array::Curved { radius } => {
            say(format_args!("[array]\nkind = \"curved\"\nradius_mm = {radius:?}\n\n[lines]"));
            say(format_args!("{}\n", angles("sector_angle_deg", "angles_deg", &probe.lines)));
        }
        Array::Linear => {
            say(format_args!("[array]\nkind = \"linear\"\n\n[lines]"));
            let span = probe.lines.last() - probe.lines.first();
            say(format_args!("{}\n", axis(("width_mm", span), "positions_mm", &probe.lines, 1.0)));
        }
    }
    say(format_args!("[depth]\nstart_mm = {:?}\nsample_pitch_mm = {:?}\n", probe.start_depth, probe.sample_pitch));
    match probe.motion {
        Motion::Still { thickness } => say(format_args!("[motion]\nkind = \"still\"\nthickness_mm = {thickness:?}")),
        Motion::Translated => {
            say(format_args!("[motion]\nkind = \"translated\""));
            say(format_args!("{}", axis(("pitch_mm", probe.slices.pitch()), "frame_positions_mm", &probe.slices, 1.0)));
        }
        Motion::Fan { wobble_radius } => {
            say(format_args!("[motion]\nkind = \"fan\"\nwobble_radius_mm = {wobble_radius:?}"));
            say(format_args!("{}", angles("fan_angle_deg", "frame_angles_deg", &probe.slices)));
        }
    }
    let direction = if volumes.first_backward { "backward" } else { "forward" };
    say(format_args!("frames_per_volume = {}\nboth_ways = {}", volumes.frames, volumes.both_ways));
    say(format_args!("first_direction = \"{direction}\"\nspeed_ratio = {:?}\n", volumes.speed_ratio));
    say(format_args!("[sound]\nspeed_m_per_s = {:?}\n\n[samples]\nrange = [{low:?}, {high:?}]", probe.sound_speed));
    text
}

fn angles(even: &str, table: &str, positions: &Axis) -> String {
    let span = (positions.last() - positions.first()).to_degrees();
    axis((even, span), table, positions, 180.0 / std::f64::consts::PI)
}

/// One number for positions that are even and centred, otherwise all of them.
fn axis((even, number): (&str, f64), table: &str, positions: &Axis, scale: f64) -> String {
    let is_centred = (positions.first() + positions.last()).abs() <= SAME;
    match positions {
        Axis::Even { .. } if is_centred => format!("{even} = {number:?}"),
        _ => {
            let all: Vec<String> =
                (0..positions.len()).map(|k| format!("{:?}", positions.at(k as f64) * scale)).collect();
            format!("{table} = [{}]", all.join(", "))
        }
    }
}

fn is_same(a: &Probe, b: &Probe) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= SAME * a.abs().max(1.0);
    let kinds = match (a.motion, b.motion) {
        (Motion::Fan { wobble_radius: a }, Motion::Fan { wobble_radius: b }) => near(a, b),
        (Motion::Still { thickness: a }, Motion::Still { thickness: b }) => near(a, b),
        (a, b) => a == b,
    };
    let sizes = |p: &Probe| [p.samples, p.lines.len(), p.slices.len()];
    let numbers = |p: &Probe| [p.array_radius(), p.start_depth, p.sample_pitch, p.sound_speed];
    let last = a.lines.len() as f64;
    kinds
        && std::mem::discriminant(&a.array) == std::mem::discriminant(&b.array)
        && sizes(a) == sizes(b)
        && numbers(a).into_iter().zip(numbers(b)).all(|(a, b)| near(a, b))
        && (0..a.lines.len()).map(|k| k as f64).all(|k| near(a.lines.at(k), b.lines.at(k)))
        && (0..a.slices.len())
            .map(|k| k as f64)
            .all(|k| [0.0, last].into_iter().all(|line| near(a.slice_position(line, k), b.slice_position(line, k))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe() -> Probe {
        let volumes = Volumes { speed_ratio: 0.4, ..Volumes::forward(7, 2) };
        let slices = Axis::centred(0.03, 7);
        Probe {
            array: Array::Curved { radius: 39.8 },
            lines: Axis::centred(0.011, 40),
            start_depth: 1.5,
            sample_pitch: 0.25,
            samples: 100,
            motion: Motion::Fan { wobble_radius: 20.0 },
            advance: volumes.advance(0, &slices),
            slices,
            sound_speed: 1480.0,
        }
    }

    #[test]
    fn no_probe_is_written_that_is_read_as_another() {
        let uneven = Axis::Table(vec![-0.1, -0.05, 0.01, 0.05, 0.06, 0.09, 0.2]);
        let aside = Axis::Even { first: 0.01, pitch: 0.02, count: 40 };
        let volumes = Volumes { both_ways: true, ..Volumes::forward(7, 2) };
        let moving = Volumes { speed_ratio: 0.3, first_backward: true, ..volumes.clone() };
        let linear =
            Probe { array: Array::Linear, lines: Axis::centred(0.3, 40), motion: Motion::Translated, ..probe() };
        for (probe, volumes) in [
            (probe(), volumes.clone()),
            (Probe { lines: aside, ..probe() }, volumes.clone()),
            (Probe { slices: uneven.clone(), advance: moving.advance(0, &uneven), ..probe() }, moving),
            (linear.clone(), volumes.clone()),
            (
                Probe {
                    slices: Axis::Even { first: 4.0, pitch: 0.5, count: 7 },
                    advance: crate::probe::Advance::None,
                    ..linear
                },
                volumes,
            ),
            (
                Probe {
                    motion: Motion::Still { thickness: 2.5 },
                    slices: Axis::centred(1.0, 1),
                    advance: crate::probe::Advance::None,
                    ..probe()
                },
                Volumes::forward(1, 3),
            ),
        ] {
            let text = ProbeFile::to_toml(&probe, &volumes, [3.0, 250.0]).unwrap();
            let file = ProbeFile::parse(Path::new("probe.toml"), &text).unwrap();
            let (read, there) = file.geometry(100, 40, volumes.frames * volumes.count).unwrap();
            assert!(is_same(&Probe { advance: there.advance(0, &read.slices), ..read }, &probe), "{text}");
            assert_eq!((there.both_ways, there.first_backward), (volumes.both_ways, volumes.first_backward));
            assert_eq!(file.range(), Some([3.0, 250.0]));
        }
        let astray =
            Probe { advance: crate::probe::Advance::Each(vec![0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), ..probe() };
        assert!(ProbeFile::to_toml(&astray, &Volumes::forward(7, 1), [0.0, 1.0]).is_err());
    }
}
