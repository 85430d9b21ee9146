//! Writes the probe file that describes a probe.

use super::axis::Axis;
use super::file::{MAX_BYTES, ProbeFile};
use super::geometry::{Array, Firing, Motion, Probe, Volumes};
use std::fmt::Write as _;
use std::path::Path;

/// Positions that differ by no more, in rad or mm, are equal: converting angles to degrees and back rounds.
const POSITION_TOLERANCE: f64 = 1e-9;

impl ProbeFile {
    /// The text of a probe file from which [`ProbeFile::read`], [`ProbeFile::geometry`] and [`Volumes::swept`] make this probe and these volumes
    /// again. `probe` has the motor's motion in the first volume. `speed_ratio` and `firing` of `volumes` are ignored, since they follow from
    /// `probe`. `range`: the sample values that are displayed as 0 and 1.
    ///
    /// # Errors
    /// One line: no probe file makes this probe. For example, its advance is not that of a motor at constant speed, or its tables are longer than a
    /// file may be.
    pub fn to_toml(probe: &Probe, volumes: &Volumes, range: [f64; 2]) -> Result<String, String> {
        for firing in [Firing::Forward, Firing::Backward, Firing::Alternating] {
            let volumes = Volumes { firing, ..volumes.clone() };
            let at_rest = at_rest(probe, &volumes);
            let gap = at_rest.slices.at(1.0) - at_rest.slices.at(0.0);
            let speed_ratio = if probe.slices.len() > 1 { (probe.advance_at(0.0) / gap).abs() } else { 0.0 };
            let text = written(&at_rest, &Volumes { speed_ratio, ..volumes.clone() }, range);
            let read = ProbeFile::parse(Path::new("probe.toml"), &text)
                .and_then(|file| file.geometry(probe.samples, probe.lines.len(), volumes.frames * volumes.count));
            let (read, read_volumes) = match read {
                Ok(read) => read,
                Err(e) if firing == Firing::Forward => return Err(format!("{}: {}", e.field(), e.fault())),
                Err(_) => continue,
            };
            if is_same(probe, &read_volumes.swept(0, &read)) && text.len() as u64 <= MAX_BYTES {
                return Ok(text);
            }
        }
        Err("cannot be described by a probe file".into())
    }
}

/// The probe with each slice where the motor was when the first line of its frame fired: the opposite of [`Volumes::swept`].
fn at_rest(probe: &Probe, volumes: &Volumes) -> Probe {
    let late = 1.0 - 1.0 / probe.lines.len() as f64;
    let slices = match volumes.firing {
        Firing::Forward => probe.slices.clone(),
        _ => {
            let start = |k: usize| {
                let travel = if volumes.fires_from_last(0, k) { late * probe.advance_at(k as f64) } else { 0.0 };
                probe.slices.at(k as f64) + travel
            };
            Axis::Table((0..probe.slices.len()).map(start).collect())
        }
    };
    Probe { slices, ..probe.clone() }
}

fn written(probe: &Probe, volumes: &Volumes, [low, high]: [f64; 2]) -> String {
    let mut text = String::from("# Lengths in mm, angles in degrees.\n");
    let mut say = |line: std::fmt::Arguments| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{line}");
    };
    let firing = match volumes.firing {
        Firing::Forward => "",
        Firing::Backward => "\nfiring = \"backward\"",
        Firing::Alternating => "\nfiring = \"alternating\"",
    };
    match probe.array {
        Array::Curved { radius } => {
            say(format_args!("[array]\nkind = \"curved\"\nradius_mm = {radius:?}\n\n[lines]"));
            say(format_args!("{}{firing}\n", angles("sector_angle_deg", "angles_deg", &probe.lines)));
        }
        Array::Linear => {
            say(format_args!("[array]\nkind = \"linear\"\n\n[lines]"));
            let span = probe.lines.last() - probe.lines.first();
            say(format_args!("{}{firing}\n", axis(("width_mm", span), "positions_mm", &probe.lines, 1.0)));
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

/// One number for positions that are uniform and centred, otherwise all of them.
fn axis((even, number): (&str, f64), table: &str, positions: &Axis, scale: f64) -> String {
    let is_centred = (positions.first() + positions.last()).abs() <= POSITION_TOLERANCE;
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
    let equal = |a: f64, b: f64| (a - b).abs() <= POSITION_TOLERANCE * a.abs().max(1.0);
    let kinds = match (a.motion, b.motion) {
        (Motion::Fan { wobble_radius: a }, Motion::Fan { wobble_radius: b }) => equal(a, b),
        (Motion::Still { thickness: a }, Motion::Still { thickness: b }) => equal(a, b),
        (a, b) => a == b,
    };
    let sizes = |p: &Probe| [p.samples, p.lines.len(), p.slices.len()];
    let numbers = |p: &Probe| [p.array_radius(), p.start_depth, p.sample_pitch, p.sound_speed];
    let last = a.lines.len() as f64;
    kinds
        && std::mem::discriminant(&a.array) == std::mem::discriminant(&b.array)
        && sizes(a) == sizes(b)
        && numbers(a).into_iter().zip(numbers(b)).all(|(a, b)| equal(a, b))
        && (0..a.lines.len()).map(|k| k as f64).all(|k| equal(a.lines.at(k), b.lines.at(k)))
        && (0..a.slices.len())
            .map(|k| k as f64)
            .all(|k| [0.0, last].into_iter().all(|line| equal(a.slice_position(line, k), b.slice_position(line, k))))
}

#[cfg(test)]
mod tests {
    use super::super::geometry::Advance;
    use super::*;

    fn probe() -> Probe {
        let slices = Axis::centred(0.03, 7);
        Probe {
            array: Array::Curved { radius: 39.8 },
            lines: Axis::centred(0.011, 40),
            start_depth: 1.5,
            sample_pitch: 0.25,
            samples: 100,
            motion: Motion::Fan { wobble_radius: 20.0 },
            advance: Advance::Same(0.4 * 0.03),
            slices,
            sound_speed: 1480.0,
        }
    }

    #[test]
    fn a_written_probe_is_read_as_the_same() {
        let uneven = Axis::Table(vec![-0.1, -0.05, 0.01, 0.05, 0.06, 0.09, 0.2]);
        let off_centre = Axis::Even { first: 0.01, pitch: 0.02, count: 40 };
        let volumes = Volumes { both_ways: true, ..Volumes::forward(7, 2) };
        let moving = Volumes { speed_ratio: 0.3, first_backward: true, ..volumes.clone() };
        let turned = Volumes { firing: Firing::Backward, ..moving.clone() };
        let mixed = Volumes { firing: Firing::Alternating, ..moving.clone() };
        let linear =
            Probe { array: Array::Linear, lines: Axis::centred(0.3, 40), motion: Motion::Translated, ..probe() };
        for (probe, volumes) in [
            (probe(), volumes.clone()),
            (Probe { lines: off_centre, ..probe() }, volumes.clone()),
            (moving.swept(0, &Probe { slices: uneven.clone(), ..probe() }), moving.clone()),
            (turned.swept(0, &probe()), turned),
            (mixed.swept(0, &Probe { slices: uneven, ..probe() }), mixed),
            (linear.clone(), volumes.clone()),
            (
                Probe { slices: Axis::Even { first: 4.0, pitch: 0.5, count: 7 }, advance: Advance::None, ..linear },
                volumes,
            ),
            (
                Probe {
                    motion: Motion::Still { thickness: 2.5 },
                    slices: Axis::centred(1.0, 1),
                    advance: Advance::None,
                    ..probe()
                },
                Volumes::forward(1, 3),
            ),
        ] {
            let text = ProbeFile::to_toml(&probe, &volumes, [3.0, 250.0]).unwrap();
            let file = ProbeFile::parse(Path::new("probe.toml"), &text).unwrap();
            let (read, read_volumes) = file.geometry(100, 40, volumes.frames * volumes.count).unwrap();
            assert!(is_same(&read_volumes.swept(0, &read), &probe), "{text}");
            assert_eq!(
                (read_volumes.both_ways, read_volumes.first_backward),
                (volumes.both_ways, volumes.first_backward)
            );
            assert_eq!(file.range(), Some([3.0, 250.0]));
        }
        let irregular = Probe { advance: Advance::Each(vec![0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), ..probe() };
        assert!(ProbeFile::to_toml(&irregular, &Volumes::forward(7, 1), [0.0, 1.0]).is_err());
    }
}
