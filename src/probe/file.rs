//! The probe file: a TOML file with the positions of the scan lines and frames of a recording. Lengths in mm, angles in degrees.
//!
//! The numbers of samples, lines and frames are not in it. They come from the recording.

use super::axis::Axis;
use super::geometry::{Advance, Array, Firing, GeometryError, Motion, Probe, Volumes};
use super::motor::{Direction, MotorTable};
use crate::files::{self, InputError};
use crate::tree::{self, Defaults, FromNode, Node};
use std::path::{Path, PathBuf};

/// Largest size of a probe file, bytes.
pub(super) const MAX_BYTES: u64 = 1 << 20;
/// Thickness, mm, of the slab that a single frame is drawn as if its file states none.
pub const SLAB: f64 = 1.0;
/// Time stamps are rounded: a motor that turns by one frame in a frame's time may seem to turn by so much more, as a share.
const ROUNDED: f64 = 1e-3;

/// A probe file that was read. `tests/data/*/probe.toml` are commented examples.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeFile {
    path: PathBuf,
    tables: Tables,
    interval: Option<f64>,
}

impl ProbeFile {
    /// Reads a probe file and checks everything that can be checked without the recording.
    ///
    /// # Errors
    /// The file cannot be read, is larger than 1 MiB or is not TOML. A key is unknown, missing or inapplicable, or excludes another. A value has
    /// another type or is out of its range. The error is one line that names the file, and the field or the line of the text.
    pub fn read(path: &Path) -> Result<ProbeFile, InputError> {
        let text = files::read_text(path, MAX_BYTES, "probe file").map_err(|e| InputError::new(path, "file", e))?;
        ProbeFile::parse(path, &text)
    }

    pub(super) fn parse(path: &Path, text: &str) -> Result<ProbeFile, InputError> {
        let tables = tree::from_toml::<Tables>(text).map_err(|e| {
            let before = e.span().and_then(|s| text.get(..s.start)).unwrap_or("");
            let line = before.matches('\n').count() + 1;
            InputError::new(path, format!("line {line}"), e.message().trim().replace('\n', ", "))
        })?;
        ProbeFile { path: path.into(), tables, interval: None }.checked()
    }

    /// Makes a probe file of its tables, and checks it as [`ProbeFile::read`] does. `path` is only the name of their origin
    /// in messages; nothing is read from there.
    ///
    /// # Errors
    /// A key is unknown, missing or inapplicable, or excludes another. A value has another type or is out of its range. The error is one line that
    /// names `path`.
    pub fn from_tables(path: &Path, tables: Node) -> Result<ProbeFile, InputError> {
        let tables = Tables::from_node(tables).map_err(|e| InputError::new(path, "probe", e.to_string()))?;
        ProbeFile { path: path.into(), tables, interval: None }.checked()
    }

    fn checked(self) -> Result<ProbeFile, InputError> {
        self.check()?;
        Ok(self)
    }

    /// Looks for the probe file of a recording in the folder of the recording. `<stem>.probe.toml` is for this recording alone; if there is none,
    /// `probe.toml` is for all recordings of the folder. None if there is neither. `sweep.mha.gz` has the probe file of `sweep.mha`.
    pub fn find_for(recording: &Path) -> Option<PathBuf> {
        let is_packed = recording.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let unpacked = if is_packed { recording.with_extension("") } else { recording.into() };
        let own = unpacked.file_stem().map(|stem| {
            let mut name = stem.to_os_string();
            name.push(".probe.toml");
            recording.with_file_name(name)
        });
        own.into_iter().chain([recording.with_file_name("probe.toml")]).find(|p| p.is_file())
    }

    /// Path of the file that was read, or of the origin that [`ProbeFile::from_tables`] was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The same probe file for a recording whose time stamps state an interval of `interval` s between frames; None: the recording has no time
    /// stamps. Only `motion.steady` needs the interval.
    pub fn timed(self, interval: Option<f64>) -> ProbeFile {
        ProbeFile { interval, ..self }
    }

    /// The sample values that are displayed as 0 and 1, in the unit of the recording; None if the file does not state them.
    pub fn range(&self) -> Option<[f64; 2]> {
        self.tables.samples.range
    }

    /// Angle between the first and the last frame of a volume that is swept as a fan, degrees. None for other motions, or if the file does not state
    /// it.
    pub fn fan_angle(&self) -> Option<f64> {
        let motion = &self.tables.motion;
        let table = motion.frame_angles_deg.as_ref().and_then(|table| Some(table.last()? - table.first()?));
        motion.fan_angle_deg.or(table)
    }

    /// The `[motor]` table, if the file has one.
    pub fn motor(&self) -> Option<&MotorTable> {
        self.tables.motor.as_ref()
    }

    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(&self.path, field, fault))
    }

    fn check(&self) -> Result<(), InputError> {
        let (lines, motion) = (&self.tables.lines, &self.tables.motion);
        let curved = self.tables.array.kind == ArrayKind::Curved;
        let (fan, translated) = (motion.kind == MotionKind::Fan, motion.kind == MotionKind::Translated);
        // Field, its value, may it be zero, does it apply to this kind of probe.
        let numbers = [
            ("array.radius_mm", self.tables.array.radius_mm, true, curved),
            ("lines.sector_angle_deg", lines.sector_angle_deg, false, curved),
            ("lines.width_mm", lines.width_mm, false, !curved),
            ("depth.start_mm", Some(self.tables.depth.start_mm), true, true),
            ("depth.sample_pitch_mm", self.tables.depth.sample_pitch_mm, false, true),
            ("depth.end_mm", self.tables.depth.end_mm, false, true),
            ("motion.wobble_radius_mm", motion.wobble_radius_mm, true, fan),
            ("motion.fan_angle_deg", motion.fan_angle_deg, true, fan),
            ("motion.pitch_mm", motion.pitch_mm, false, translated),
            ("motion.thickness_mm", motion.thickness_mm, false, true),
            ("motion.speed_ratio", motion.speed_ratio, true, true),
            ("motion.motor_deg_per_s", motion.motor_deg_per_s, true, fan),
            ("motion.motor_mm_per_s", motion.motor_mm_per_s, true, translated),
            ("sound.speed_m_per_s", Some(self.tables.sound.speed_m_per_s), false, true),
        ];
        for (field, value, zero, applies) in numbers {
            let Some(value) = value else { continue };
            if !applies {
                return self.fault(field, "does not apply to this kind of array or motion");
            }
            if !value.is_finite() || value < 0.0 || (value == 0.0 && !zero) {
                let least = if zero { "of at least 0" } else { "above 0" };
                return self.fault(field, format!("is {value}, must be a finite number {least}"));
            }
        }
        let tables = [
            ("lines.angles_deg", &lines.angles_deg, curved),
            ("lines.positions_mm", &lines.positions_mm, !curved),
            ("motion.frame_angles_deg", &motion.frame_angles_deg, fan),
            ("motion.frame_positions_mm", &motion.frame_positions_mm, translated),
        ];
        for (field, table, applies) in tables {
            if table.is_some() && !applies {
                return self.fault(field, "does not apply to this kind of array or motion");
            }
        }
        if let Some(ratio) = motion.speed_ratio.filter(|ratio| *ratio > 1.0) {
            return self.fault("motion.speed_ratio", format!("is {ratio}, must be 0 to 1"));
        }
        let ways = [motion.speed_ratio.is_some(), motion.motor_speed().is_some(), motion.steady];
        if ways.into_iter().filter(|is_stated| *is_stated).count() > 1 {
            let fault =
                "follows from the speed of the motor, and from a steady motor and time stamps: leave all but one out";
            return self.fault("motion.speed_ratio", fault);
        }
        if motion.kind == MotionKind::Still && motion.frames_per_volume > 1 {
            return self.fault("motion.frames_per_volume", "must be 1 when the probe is still");
        }
        if let Some((field, fault)) = self.tables.motor.as_ref().and_then(|m| m.check().err()) {
            return self.fault(field, fault);
        }
        match self.range() {
            Some([low, high]) if !(low < high && (high - low).is_finite()) => {
                self.fault("samples.range", format!("is [{low}, {high}], must be two rising finite numbers"))
            }
            _ => Ok(()),
        }
    }

    /// The probe and how the frames make up volumes, for a recording of `samples` samples a line, `lines` lines a frame and `frames` frames. The
    /// probe stands still during a frame ([`Advance::None`]); [`Volumes::swept`] adds the motor's motion in a volume.
    ///
    /// # Errors
    /// The probe file lacks a key or has two that exclude each other, has a table for another number of lines or frames, or has numbers that make no
    /// valid [`Probe`]. The motor travels beyond the next frame while one is acquired, or `motion.steady` is set and the recording has no time
    /// stamps. There are fewer frames than one volume.
    pub fn geometry(&self, samples: usize, lines: usize, frames: usize) -> Result<(Probe, Volumes), InputError> {
        let mut volumes = self.volumes(frames)?;
        let (motion, slices) = self.motion(volumes.frames)?;
        let (array, lines) = self.lines(lines)?;
        let depth = &self.tables.depth;
        let sample_pitch = match (depth.sample_pitch_mm, depth.end_mm) {
            (Some(pitch), None) => pitch,
            (None, Some(end)) => (end - depth.start_mm) / (samples.max(2) - 1) as f64,
            _ => return self.fault("depth", "must have either sample_pitch_mm or end_mm"),
        };
        let probe = Probe {
            array,
            lines,
            start_depth: depth.start_mm,
            sample_pitch,
            samples,
            motion,
            slices,
            advance: Advance::None,
            sound_speed: self.tables.sound.speed_m_per_s,
        };
        probe.check().map_err(|e| geometry_error(&self.path, &e))?;
        if let Some(ratio) = self.speed_ratio(&probe)? {
            volumes.speed_ratio = ratio;
        }
        for volume in 0..volumes.count.min(2) {
            volumes.swept(volume, &probe).check().map_err(|e| geometry_error(&self.path, &e))?;
        }
        Ok((probe, volumes))
    }

    /// The share of the way to the next frame that the motor travels while one is acquired, as sound fires its lines one after the other
    /// without a pause (thesis 4.4.2.2), where it follows from depth and the speed of the motor or the time between frames. It is said.
    fn speed_ratio(&self, probe: &Probe) -> Result<Option<f64>, InputError> {
        let (motion, count, lines) = (&self.tables.motion, probe.slices.len(), probe.lines.len());
        let frame_time = probe.acquisition_time() / count as f64;
        let pitch = (probe.slices.last() - probe.slices.first()) / (count.max(2) - 1) as f64;
        let (field, ratio, after) = match (motion.motor_speed(), motion.steady, self.interval) {
            (None, false, _) => return Ok(None),
            _ if count < 2 => return Ok(Some(0.0)),
            (Some((field, speed)), ..) => (field, speed * frame_time / pitch, String::new()),
            (None, true, Some(interval)) => {
                let after = format!(" of {:.2} ms between time stamps", interval * 1e3);
                ("motion.steady", frame_time / interval, after)
            }
            (None, true, None) => {
                let fault =
                    "needs time stamps of the frames, which are missing here: state speed_ratio or the motor's speed";
                return self.fault("motion.steady", fault);
            }
        };
        let while_taken = format!("while {lines} lines take {:.2} ms{after}", frame_time * 1e3);
        let said = format!("the motor travels {ratio:.3} of the way to the next frame {while_taken}");
        if ratio > 1.0 + ROUNDED {
            return self.fault(field, format!("{said}: at most 1"));
        }
        tracing::warn!(file = %self.path.display(), "{field}: {said}");
        Ok(Some(ratio.min(1.0)))
    }

    fn volumes(&self, frames: usize) -> Result<Volumes, InputError> {
        let motion = &self.tables.motion;
        let each = match (motion.kind, motion.frames_per_volume) {
            (MotionKind::Still, _) => 1,
            (_, 0) => frames,
            (_, each) => each,
        };
        if frames == 0 || each > frames {
            return self.fault("motion.frames_per_volume", format!("is {each}, but the recording has {frames} frames"));
        }
        Ok(Volumes {
            frames: each,
            count: frames / each,
            left_over: frames % each,
            both_ways: motion.both_ways,
            first_backward: motion.first_direction == Direction::Backward,
            speed_ratio: motion.speed_ratio.unwrap_or(0.0),
            firing: self.tables.lines.firing,
        })
    }

    fn motion(&self, frames: usize) -> Result<(Motion, Axis), InputError> {
        let motion = &self.tables.motion;
        let slab = (Motion::Still { thickness: motion.thickness_mm.unwrap_or(SLAB) }, Axis::centred(1.0, 1));
        let swept = match motion.kind {
            MotionKind::Still => return Ok(slab),
            MotionKind::Translated => {
                let slices = match (motion.pitch_mm, &motion.frame_positions_mm) {
                    (Some(pitch), None) => Axis::centred(pitch, frames),
                    (None, Some(table)) => self.table("motion.frame_positions_mm", table, frames, "frames")?,
                    _ => return self.fault("motion", "must have either pitch_mm or frame_positions_mm"),
                };
                (Motion::Translated, slices)
            }
            MotionKind::Fan => {
                let Some(wobble_radius) = motion.wobble_radius_mm else {
                    return self.fault("motion.wobble_radius_mm", "is missing");
                };
                let slices = match (motion.fan_angle_deg, &motion.frame_angles_deg) {
                    (Some(angle), None) => spread(angle.to_radians(), frames),
                    (None, Some(table)) => self.angles("motion.frame_angles_deg", table, frames, "frames")?,
                    _ => return self.fault("motion", "must have either fan_angle_deg or frame_angles_deg"),
                };
                (Motion::Fan { wobble_radius }, slices)
            }
        };
        // A single frame is no sweep: it is drawn as a slab.
        Ok(if frames == 1 { slab } else { swept })
    }

    fn lines(&self, count: usize) -> Result<(Array, Axis), InputError> {
        let lines = &self.tables.lines;
        match (self.tables.array.kind, self.tables.array.radius_mm) {
            (ArrayKind::Curved, None) => self.fault("array.radius_mm", "is missing"),
            (ArrayKind::Curved, Some(radius)) => {
                let axis = match (lines.sector_angle_deg, &lines.angles_deg) {
                    (Some(angle), None) => spread(angle.to_radians(), count),
                    (None, Some(table)) => self.angles("lines.angles_deg", table, count, "lines")?,
                    _ => return self.fault("lines", "must have either sector_angle_deg or angles_deg"),
                };
                Ok((Array::Curved { radius }, axis))
            }
            (ArrayKind::Linear, _) => {
                let axis = match (lines.width_mm, &lines.positions_mm) {
                    (Some(width), None) => spread(width, count),
                    (None, Some(table)) => self.table("lines.positions_mm", table, count, "lines")?,
                    _ => return self.fault("lines", "must have either width_mm or positions_mm"),
                };
                Ok((Array::Linear, axis))
            }
        }
    }

    /// A table of degrees as radians.
    fn angles(&self, field: &str, table: &[f64], count: usize, of: &str) -> Result<Axis, InputError> {
        self.table(field, &table.iter().map(|a| a.to_radians()).collect::<Vec<_>>(), count, of)
    }

    fn table(&self, field: &str, table: &[f64], count: usize, of: &str) -> Result<Axis, InputError> {
        if table.len() != count {
            return self.fault(field, format!("has {} entries, but there are {count} {of}", table.len()));
        }
        let axis = Axis::from_table(table.to_vec());
        match axis.is_valid() {
            true => Ok(axis),
            false => self.fault(field, "must be finite numbers that rise from one to the next"),
        }
    }
}

/// Converts the error of a geometry to an error of the file that the geometry comes from.
pub fn geometry_error(file: &Path, error: &GeometryError) -> InputError {
    InputError::new(file, error.field, &error.fault)
}

/// `count` positions over `span`, from first to last, centred on zero. A single position is at zero.
fn spread(span: f64, count: usize) -> Axis {
    if count < 2 { Axis::centred(1.0, 1) } else { Axis::centred(span / (count - 1) as f64, count) }
}

/// The tables of a probe file, one struct each. Unknown keys are errors, so that a misspelt key is not silently ignored.
#[derive(Clone, Debug, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct Tables {
    array: ArrayTable,
    lines: LinesTable,
    depth: DepthTable,
    motion: MotionTable,
    #[tree(default)]
    sound: SoundTable,
    #[tree(default)]
    samples: SamplesTable,
    motor: Option<MotorTable>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode)]
#[tree(rename_all = "lowercase")]
enum ArrayKind {
    Curved,
    Linear,
}

#[derive(Clone, Debug, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct ArrayTable {
    kind: ArrayKind,
    radius_mm: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct LinesTable {
    sector_angle_deg: Option<f64>,
    width_mm: Option<f64>,
    angles_deg: Option<Vec<f64>>,
    positions_mm: Option<Vec<f64>>,
    #[tree(default)]
    firing: Firing,
}

#[derive(Clone, Debug, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct DepthTable {
    #[tree(default)]
    start_mm: f64,
    /// Distance between samples.
    sample_pitch_mm: Option<f64>,
    /// Depth of the last sample: dr = (d1 - d0) / (S - 1).
    end_mm: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode)]
#[tree(rename_all = "lowercase")]
enum MotionKind {
    Fan,
    Translated,
    Still,
}

#[derive(Clone, Debug, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct MotionTable {
    kind: MotionKind,
    wobble_radius_mm: Option<f64>,
    fan_angle_deg: Option<f64>,
    frame_angles_deg: Option<Vec<f64>>,
    pitch_mm: Option<f64>,
    frame_positions_mm: Option<Vec<f64>>,
    thickness_mm: Option<f64>,
    /// 0: all frames of the recording are one volume.
    #[tree(default)]
    frames_per_volume: usize,
    /// Every second volume was swept backwards.
    #[tree(default)]
    both_ways: bool,
    #[tree(default)]
    first_direction: Direction,
    speed_ratio: Option<f64>,
    /// Speed of the motor, from which the ratio follows, in the unit of the motion.
    motor_deg_per_s: Option<f64>,
    motor_mm_per_s: Option<f64>,
    /// The motor never stops between frames: the ratio follows from their time stamps.
    #[tree(default)]
    steady: bool,
}

impl MotionTable {
    /// The key of the motor's speed, and the speed in rad/s or mm/s.
    fn motor_speed(&self) -> Option<(&'static str, f64)> {
        let turning = self.motor_deg_per_s.map(|speed| ("motion.motor_deg_per_s", speed.to_radians()));
        turning.or(self.motor_mm_per_s.map(|speed| ("motion.motor_mm_per_s", speed)))
    }
}

#[derive(Clone, Debug, PartialEq, Defaults, FromNode)]
#[tree(deny_unknown_fields)]
struct SoundTable {
    #[value(1540.0)]
    speed_m_per_s: f64,
}

#[derive(Clone, Debug, Default, PartialEq, FromNode)]
#[tree(deny_unknown_fields)]
struct SamplesTable {
    range: Option<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAN: &str = "[array]\nkind = 'curved'\nradius_mm = 40\n[lines]\nsector_angle_deg = 70\n[depth]\nend_mm = 159\n\
                       [motion]\nkind = 'fan'\nwobble_radius_mm = 25\nfan_angle_deg = 60\n";

    fn parse(text: &str) -> Result<ProbeFile, InputError> {
        ProbeFile::parse(Path::new("probe.toml"), text)
    }

    #[test]
    fn the_end_depth_is_that_of_the_last_sample() {
        let (probe, volumes) = parse(FAN).unwrap().geometry(160, 71, 31).unwrap();
        assert!((probe.sample_pitch - 1.0).abs() < 1e-12);
        assert!((probe.last_range() - 199.0).abs() < 1e-9);
        assert!((probe.lines.last().to_degrees() - 35.0).abs() < 1e-9);
        assert!((probe.slices.first().to_degrees() + 30.0).abs() < 1e-9);
        assert_eq!(volumes, Volumes::forward(31, 1));
    }

    #[test]
    fn frames_after_the_last_whole_volume_are_not_a_volume() {
        let file = parse(&format!("{FAN}frames_per_volume = 10\nboth_ways = true\nspeed_ratio = 0.5\n")).unwrap();
        let (_, volumes) = file.geometry(160, 71, 39).unwrap();
        assert_eq!((volumes.count, volumes.left_over, volumes.backward(1)), (3, 9, true));
        assert!(file.geometry(160, 71, 9).is_err());
    }

    /// 71 lines to 159 mm take 71 x 2 x 0.159 / 1540 s = 14.66 ms, in which 60 deg/s turn 0.8797 of the 1 degree between two of 61 frames.
    #[test]
    fn the_speed_ratio_follows_from_the_speed_of_the_motor_and_the_depth() {
        let turning = format!("{FAN}motor_deg_per_s = 60\nfirst_direction = 'backward'\n");
        let (_, volumes) = parse(&turning).unwrap().geometry(160, 71, 61).unwrap();
        assert!((volumes.speed_ratio - 60.0 * 71.0 * 2.0 * 0.159 / 1540.0).abs() < 1e-12, "{}", volumes.speed_ratio);
        assert_eq!(parse(&turning).unwrap().geometry(160, 71, 1).unwrap().1.speed_ratio, 0.0, "one frame is no sweep");
        let pushed = FAN.replace(
            "kind = 'fan'\nwobble_radius_mm = 25\nfan_angle_deg = 60",
            "kind = 'translated'\npitch_mm = 0.5\nmotor_mm_per_s = 20",
        );
        let (_, volumes) = parse(&pushed).unwrap().geometry(160, 71, 5).unwrap();
        assert!(
            (volumes.speed_ratio - 20.0 / 0.5 * 71.0 * 2.0 * 0.159 / 1540.0).abs() < 1e-12,
            "{}",
            volumes.speed_ratio
        );
    }

    /// 14.66 ms of the 20 ms from frame to frame; without time stamps, or with frames that follow sooner, it is refused.
    #[test]
    fn the_speed_ratio_of_a_steady_motor_follows_from_time_stamps() {
        let of = |interval| parse(&format!("{FAN}steady = true\n")).unwrap().timed(interval).geometry(160, 71, 61);
        let ratio = of(Some(0.02)).unwrap().1.speed_ratio;
        assert!((ratio - 71.0 * 2.0 * 0.159 / 1540.0 / 0.02).abs() < 1e-12, "{ratio}");
        assert_eq!(of(Some(0.01466)).unwrap().1.speed_ratio, 1.0, "a rounded time stamp");
        for (interval, named) in [(None, "needs time stamps"), (Some(0.01), "at most 1")] {
            let error = of(interval).unwrap_err().to_string();
            assert!(error.contains("motion.steady") && error.contains(named), "{error}");
        }
    }

    #[test]
    fn one_frame_of_a_fan_is_a_slab() {
        let (probe, _) = parse(FAN).unwrap().geometry(160, 71, 1).unwrap();
        assert_eq!(probe.motion, Motion::Still { thickness: SLAB });
        assert!(parse(FAN).unwrap().geometry(160, 1, 1).is_err(), "a single line spans no picture");
    }

    #[test]
    fn every_fault_is_one_line_that_names_file_and_field() {
        let faults = [
            ("radius_mm = 40", "radius_mm = nan", "array.radius_mm"),
            ("radius_mm = 40", "radus_mm = 40", "radus_mm"),
            ("radius_mm = 40", "radius_mm = 40\n\"a\\nb\" = 1", "line 4"),
            ("radius_mm = 40", "", "array.radius_mm"),
            ("end_mm = 159", "end_mm = 159\nsample_pitch_mm = 1", "depth"),
            ("end_mm = 159", "end_mm = -159", "depth.end_mm"),
            ("fan_angle_deg = 60", "frame_angles_deg = [1, 2, 3]", "motion.frame_angles_deg"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\npitch_mm = 1", "motion.pitch_mm"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\nspeed_ratio = 1.5", "motion.speed_ratio"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\nmotor_mm_per_s = 3", "motion.motor_mm_per_s"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\nmotor_deg_per_s = 140", "at most 1"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\nmotor_deg_per_s = 3\nspeed_ratio = 0", "motion.speed_ratio"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\nmotor_deg_per_s = 3\nsteady = true", "motion.speed_ratio"),
            ("sector_angle_deg = 70", "sector_angle_deg = 70\nfiring = 'sideways'", "sideways"),
            ("fan_angle_deg = 60", "fan_angle_deg = 60\n[samples]\nrange = [1, 1]", "samples.range"),
            ("sector_angle_deg = 70", "sector_angle_deg = 370", "sector angle"),
            ("wobble_radius_mm = 25", "wobble_radius_mm = -1", "wobble"),
            ("kind = 'fan'", "kind = 'helix'", "helix"),
        ];
        for (from, to, named) in faults {
            let error = parse(&FAN.replace(from, to)).and_then(|f| f.geometry(160, 71, 31)).unwrap_err().to_string();
            assert!(error.starts_with("probe.toml: ") && error.contains(named), "{error}");
            assert_eq!(error.lines().count(), 1);
        }
    }
}
