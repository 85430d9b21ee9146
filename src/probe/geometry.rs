//! The maps between (sample, line, slice) indices and points in space, in f64. They define the geometry that every pass is tested against.
//!
//! Space is (X lateral, Y depth, Z elevation) in mm. The origin is the in-plane apex of a curved array, or the face of a linear one; Y
//! points away from the probe. Equations: in-plane map and sweep map of the thesis, 4.4.2.
//!
//! [`Volumes`] is how the frames of a recording make up volumes, and in which direction each was swept.

use super::axis::{Axis, interpolated};
use crate::tree::{FromNode, ToNode};
use glam::DVec3;
use std::f64::consts::PI;

/// Shape of the transducer array.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
pub enum Array {
    /// Elements on an arc of `radius` mm (Ra, from the apex to the face); radius 0 is a phased array. Positions of scan lines are angles in rad.
    Curved { radius: f64 },
    /// Elements on a straight line. Positions of scan lines are lateral, in mm.
    Linear,
}

/// How the array moves from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
pub enum Motion {
    /// The array rotates about an axis `wobble_radius` mm (Rw) behind its face. Positions of slices are angles in rad.
    Fan { wobble_radius: f64 },
    /// The array is moved in elevation. Positions of slices are in mm.
    Translated,
    /// A single frame, drawn as a slab of `thickness` mm.
    Still { thickness: f64 },
}

/// Change of a slice's position while its frame is acquired line by line, in the unit of the slice axis (rad or mm). Line n of L lines is at the
/// slice's position + advance n / L. The advance is negative if the position falls from line to line, whatever the order in time.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
pub enum Advance {
    /// The motor stops for each frame.
    None,
    /// The same change for every slice: the motor moves in one direction, lines fire in one order, and the slices are uniformly spaced.
    Same(f64),
    /// One change for each slice: the motor moves in both directions, lines fire in both orders, or the slices are not uniformly spaced.
    Each(Vec<f64>),
}

/// A swept probe: its geometry determines the position of each sample in space.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
pub struct Probe {
    pub array: Array,
    /// Position of each scan line: rad (curved array) or mm (linear array).
    pub lines: Axis,
    /// Distance from the array's face to the first sample (d0), mm.
    pub start_depth: f64,
    /// Distance between samples (dr), mm.
    pub sample_pitch: f64,
    /// Number of samples of a line, at least 2.
    pub samples: usize,
    pub motion: Motion,
    /// Position of each slice at the time of its line 0, in geometric order: rad or mm, see [`Motion`].
    pub slices: Axis,
    pub advance: Advance,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
}

/// Fractional indices of a sample in a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indices {
    pub sample: f64,
    pub line: f64,
    pub slice: f64,
}

/// A number of a geometry that is out of its range: its name and what is wrong with it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("probe geometry: {field}: {fault}")]
pub struct GeometryError {
    pub field: &'static str,
    pub fault: String,
}

fn fault<T>(field: &'static str, fault: impl Into<String>) -> Result<T, GeometryError> {
    Err(GeometryError { field, fault: fault.into() })
}

/// A number as text, with an exponent if it is very large or small.
fn short(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

impl Probe {
    /// Distance of the first sample from the apex of a curved array or the face of a linear one, mm.
    pub fn first_range(&self) -> f64 {
        self.start_depth + self.array_radius()
    }

    /// Distance of the last sample from the apex of a curved array or the face of a linear one, mm.
    pub fn last_range(&self) -> f64 {
        self.first_range() + self.sample_pitch * (self.samples - 1) as f64
    }

    /// Radius of the array (Ra), mm; 0 for a linear one.
    pub fn array_radius(&self) -> f64 {
        match self.array {
            Array::Curved { radius } => radius,
            Array::Linear => 0.0,
        }
    }

    /// True if lines of a curved array lie 90 degrees or more off the depth axis, as those of a radial probe do: half-planes do not
    /// bound such a sector, and it reaches above its apex.
    pub fn is_radial(&self) -> bool {
        matches!(self.array, Array::Curved { .. }) && self.lines.outermost() >= PI / 2.0
    }

    /// Y of the wobble axis, mm: radius of the array minus wobble radius (Ra - Rw). 0 unless the motion is a fan.
    pub fn axis_depth(&self) -> f64 {
        match self.motion {
            Motion::Fan { wobble_radius } => self.array_radius() - wobble_radius,
            _ => 0.0,
        }
    }

    /// In-plane map: point (x lateral, y depth), mm, of a fractional (sample, line). The origin is the apex of a curved array, or the face of a
    /// linear one.
    pub fn plane_point(&self, sample: f64, line: f64) -> (f64, f64) {
        let range = self.first_range() + sample * self.sample_pitch;
        let at = self.lines.at(line);
        match self.array {
            Array::Curved { .. } => (range * at.sin(), range * at.cos()),
            Array::Linear => (at, range),
        }
    }

    /// Fractional (sample, line) of an in-plane point: the inverse of [`Probe::plane_point`].
    pub fn plane_indices(&self, x: f64, y: f64) -> (f64, f64) {
        let (range, at) = match self.array {
            // atan2(0, 0) is 0 here. On some GPUs it is not, so the shaders test the range first.
            Array::Curved { .. } => (x.hypot(y), x.atan2(y)),
            Array::Linear => (y, x),
        };
        ((range - self.first_range()) / self.sample_pitch, self.lines.index_of(at))
    }

    /// Position of a slice when the given line was acquired, rad or mm: see [`Motion`]. Both indices are fractional.
    pub fn slice_position(&self, line: f64, slice: f64) -> f64 {
        self.slices.at(slice) + self.advance_at(slice) * line / self.lines.len() as f64
    }

    /// Change of the slice's position while the frame at a fractional slice index is acquired, rad or mm: see [`Advance`].
    pub fn advance_at(&self, slice: f64) -> f64 {
        match &self.advance {
            Advance::None => 0.0,
            Advance::Same(a) => *a,
            Advance::Each(table) => interpolated(table, slice),
        }
    }

    /// [`Probe::advance_at`] a slice itself, without interpolation.
    pub fn advance_of(&self, slice: usize) -> f64 {
        match &self.advance {
            Advance::Each(table) => table.get(slice).copied().unwrap_or(0.0),
            Advance::None | Advance::Same(_) => self.advance_at(0.0),
        }
    }

    /// Point in space (lateral, depth, elevation), mm, of fractional indices: the in-plane map followed by the sweep map.
    pub fn to_space(&self, at: Indices) -> DVec3 {
        let (x, y) = self.plane_point(at.sample, at.line);
        let position = self.slice_position(at.line, at.slice);
        self.sweep_map(x, y, position)
    }

    /// Sweep map: point in space (lateral, depth, elevation), mm, of an in-plane point (x, y) of [`Probe::plane_point`] at a slice position, rad or
    /// mm. Position 0 has elevation 0.
    pub fn sweep_map(&self, x: f64, y: f64, position: f64) -> DVec3 {
        match self.motion {
            Motion::Fan { .. } => {
                let axis = self.axis_depth();
                DVec3::new(x, axis + (y - axis) * position.cos(), (y - axis) * position.sin())
            }
            Motion::Translated => DVec3::new(x, y, position),
            Motion::Still { .. } => DVec3::new(x, y, 0.0),
        }
    }

    /// In-plane point (x, y) and slice position of a point in space: the inverse of [`Probe::sweep_map`] for in-plane points beyond the wobble axis.
    /// The position is 0 for a still probe.
    pub fn inverse_sweep_map(&self, place: DVec3) -> (f64, f64, f64) {
        match self.motion {
            Motion::Fan { .. } => {
                let beyond = place.y - self.axis_depth();
                (place.x, beyond.hypot(place.z) + self.axis_depth(), place.z.atan2(beyond))
            }
            Motion::Translated => (place.x, place.y, place.z),
            Motion::Still { .. } => (place.x, place.y, 0.0),
        }
    }

    /// Fractional indices of a point in space. Sample and line follow from the in-plane point alone; the slice follows from its position and the
    /// line.
    pub fn to_indices(&self, place: DVec3) -> Indices {
        let (x, y, position) = self.inverse_sweep_map(place);
        let (sample, line) = self.plane_indices(x, y);
        Indices { sample, line, slice: self.slice_index(position, line) }
    }

    /// Fractional slice index of a slice position, for samples of the given line. 0 if there is only one slice.
    pub fn slice_index(&self, position: f64, line: f64) -> f64 {
        let share = line / self.lines.len() as f64;
        match &self.advance {
            _ if self.slices.len() == 1 => 0.0,
            Advance::None => self.slices.index_of(position),
            Advance::Same(advance) => self.slices.index_of(position - advance * share),
            Advance::Each(table) => {
                let at = |k: usize| self.slices.at(k as f64) + table[k] * share;
                let mut k = 0;
                while k + 2 < table.len() && at(k + 1) <= position {
                    k += 1;
                }
                k as f64 + (position - at(k)) / (at(k + 1) - at(k))
            }
        }
    }

    /// Corners (low, high) of the smallest in-plane rectangle (x, y) that contains every sample that is drawn, mm. Samples before the wobble
    /// axis are not drawn ([`Probe::folded_share`]).
    pub fn plane_bounds(&self) -> ([f64; 2], [f64; 2]) {
        let (mut low, mut high) = self.sector_bounds();
        let axis = self.axis_depth();
        if matches!(self.motion, Motion::Fan { .. }) && low[1] < axis {
            low[1] = axis;
            if let Array::Curved { .. } = self.array {
                // Lines that end before the axis reach less far to the side than the last arc at the axis does; above the apex, the
                // arc is widest beyond the axis.
                let chord = (self.last_range().powi(2) - axis.max(0.0).powi(2)).max(0.0).sqrt();
                let ends_before = |line: f64| self.last_range() * line.cos() < axis;
                if ends_before(self.lines.first()) {
                    low[0] = low[0].max(-chord);
                }
                if ends_before(self.lines.last()) {
                    high[0] = high[0].min(chord);
                }
            }
        }
        (low, high)
    }

    /// Share of a frame's samples that lie before the wobble axis (at a smaller y), 0..=1. These samples are not drawn. While a frame turns
    /// about the axis they move the opposite way, so that they sweep a second fan, mirrored at the axis. The inverse map
    /// ([`Probe::inverse_sweep_map`]) finds a point by its distance from the axis and its angle, which describe only the fan beyond the
    /// axis.
    pub fn folded_share(&self) -> f64 {
        let (axis, count) = (self.axis_depth(), self.lines.len());
        if !matches!(self.motion, Motion::Fan { .. }) {
            return 0.0;
        }
        let folded: f64 = (0..count)
            .map(|line| {
                let along = match self.array {
                    Array::Linear => 1.0,
                    Array::Curved { .. } => self.lines.at(line as f64).cos(),
                };
                if along == 0.0 {
                    return if axis > 0.0 { self.samples as f64 } else { 0.0 };
                }
                // Samples before this one lie before the axis; on a line that rises from the apex, those after it.
                let at_axis = (axis / along - self.first_range()) / self.sample_pitch;
                let before = |n: f64| n.clamp(0.0, self.samples as f64);
                if along > 0.0 { before(at_axis.ceil()) } else { self.samples as f64 - before(at_axis.floor() + 1.0) }
            })
            .sum();
        folded / (count * self.samples) as f64
    }

    /// A sentence for users about the samples that are not drawn ([`Probe::folded_share`]). None if all are drawn.
    pub fn folded(&self) -> Option<String> {
        let share = 100.0 * self.folded_share();
        (share > 0.0).then(|| {
            let place = format!("at y = {:.2} mm, where the sweep turns the other way", self.axis_depth());
            format!("{share:.2} % of each frame is not drawn: it lies before the wobble axis, {place}")
        })
    }

    /// Corners of the smallest in-plane rectangle that contains every sample, mm.
    fn sector_bounds(&self) -> ([f64; 2], [f64; 2]) {
        let (r0, r1) = (self.first_range(), self.last_range());
        let (first, last) = (self.lines.first(), self.lines.last());
        match self.array {
            Array::Linear => ([first, r0], [last, r1]),
            Array::Curved { .. } => {
                // The extremes of an annular sector: its corners, and where an arc is level or upright.
                let upright = [-PI / 2.0, 0.0, PI / 2.0].into_iter().filter(|a| *a > first && *a < last);
                let places = [first, last].into_iter().chain(upright).flat_map(|a| {
                    let level = if a.abs() == PI / 2.0 { 0.0 } else { a.cos() };
                    [r0, r1].map(|r| [r * a.sin(), r * level])
                });
                let ends = ([f64::MAX; 2], [f64::MIN; 2]);
                places
                    .fold(ends, |(low, high), p| ([0, 1].map(|n| p[n].min(low[n])), [0, 1].map(|n| p[n].max(high[n]))))
            }
        }
    }

    /// Bounds (low, high) of the slice positions of all lines, rad or mm, that hold for both directions of the motor. If the motor moves during a
    /// frame, one of the two bounds is therefore beyond the positions of this volume.
    pub fn slice_bounds(&self) -> (f64, f64) {
        let last = (self.slices.len() - 1) as f64;
        let share = 1.0 - 1.0 / self.lines.len() as f64;
        let (low, high) = (self.advance_at(0.0).abs() * share, self.advance_at(last).abs() * share);
        (self.slices.at(0.0) - low, self.slices.at(last) + high)
    }

    /// Corners (low, high) of a box in space that contains every sample that is drawn, mm.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let (low, high) = self.plane_bounds();
        let (first, last) = self.slice_bounds();
        match self.motion {
            Motion::Translated => (DVec3::new(low[0], low[1], first), DVec3::new(high[0], high[1], last)),
            Motion::Still { thickness } => {
                (DVec3::new(low[0], low[1], -thickness / 2.0), DVec3::new(high[0], high[1], thickness / 2.0))
            }
            Motion::Fan { .. } => {
                let axis = self.axis_depth();
                let (near, far) = (low[1] - axis, high[1] - axis);
                let widest = first.abs().max(last.abs());
                let straight = if first <= 0.0 && last >= 0.0 { 0.0 } else { first.abs().min(last.abs()) };
                let low_z = if first < 0.0 { far * first.sin() } else { near * first.sin() };
                let high_z = if last > 0.0 { far * last.sin() } else { near * last.sin() };
                let (low_y, high_y) = (axis + near * widest.cos(), axis + far * straight.cos());
                (DVec3::new(low[0], low_y, low_z), DVec3::new(high[0], high_y, high_z))
            }
        }
    }

    /// Time that sound needs for one volume, s: 2 d / c for each line (thesis 4.5).
    pub fn acquisition_time(&self) -> f64 {
        let depth = (self.start_depth + self.sample_pitch * (self.samples - 1) as f64) * 1e-3;
        (self.slices.len() * self.lines.len()) as f64 * 2.0 * depth / self.sound_speed
    }

    /// Checks every number of the geometry.
    ///
    /// # Errors
    /// The first number that is out of its range, or numbers that the maps cannot invert.
    pub fn check(&self) -> Result<(), GeometryError> {
        // Larger values belong to no real probe, and their squares would be infinite in f32.
        let at_least = |least: f64, field, value: f64| match (least..=1e6).contains(&value) {
            true => Ok(()),
            false => fault(field, format!("is {}, must lie in {}..=1e6", short(value), short(least))),
        };
        at_least(1e-6, "sample pitch", self.sample_pitch)?;
        at_least(1e-6, "sound speed", self.sound_speed)?;
        at_least(0.0, "start depth", self.start_depth)?;
        at_least(0.0, "array radius", self.array_radius())?;
        if self.samples < 2 {
            return fault("samples", format!("{} a line, at least 2 are needed", self.samples));
        }
        if self.lines.len() < 2 {
            return fault("scan lines", format!("{} a frame, at least 2 are needed", self.lines.len()));
        }
        if !self.lines.is_valid() || self.lines.outermost() > 1e6 {
            return fault("scan lines", "positions must be finite and rise from line to line");
        }
        if !self.slices.is_valid() || self.slices.outermost() > 1e6 {
            return fault("frames", "positions must be finite and rise from slice to slice");
        }
        if self.slices.len() < 2 && !matches!(self.motion, Motion::Still { .. }) {
            return fault("frames", "a sweep has at least 2 frames a volume; a single frame needs motion 'still'");
        }
        if let Array::Curved { .. } = self.array {
            let widest = self.lines.outermost();
            if widest >= PI {
                return fault("sector angle", format!("{:.1} deg off axis, must stay under 180", widest.to_degrees()));
            }
        }
        match &self.advance {
            Advance::None => {}
            Advance::Same(a) if a.is_finite() => {}
            Advance::Each(t) if t.len() == self.slices.len() && t.iter().all(|a| a.is_finite()) => {}
            _ => return fault("motion", "one finite advance a slice is needed"),
        }
        // A forward slice next to a backward one: beyond half a pitch of travel their last lines would cross.
        let last_line = (self.lines.len() - 1) as f64;
        let at = |k: usize| self.slice_position(last_line, k as f64);
        if (1..self.slices.len()).any(|k| at(k) <= at(k - 1)) {
            return fault("motion", "the motor travels so far within a frame that neighbouring slices cross");
        }
        match self.motion {
            Motion::Still { thickness } => {
                at_least(1e-6, "slice thickness", thickness)?;
                if self.slices.len() != 1 {
                    return fault("frames", "a still probe has one frame a volume");
                }
            }
            Motion::Translated => {}
            Motion::Fan { wobble_radius } => {
                at_least(0.0, "wobble radius", wobble_radius)?;
                let (first, last) = self.slice_bounds();
                let widest = first.abs().max(last.abs());
                if widest >= PI / 2.0 {
                    return fault("fan angle", format!("{:.1} deg off axis, must stay under 90", widest.to_degrees()));
                }
                let (farthest, axis) = (self.sector_bounds().1[1], self.axis_depth());
                if farthest <= axis {
                    let places =
                        format!("the sector ends at y = {farthest:.2} mm but the wobble axis is at {axis:.2} mm");
                    return fault("wobble radius", format!("{places}: nothing of the sector is beyond the axis"));
                }
            }
        }
        Ok(())
    }
}

/// How the frames of a recording make up volumes, and how the motor moves in them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Volumes {
    /// Number of frames of a volume (K).
    pub frames: usize,
    /// Number of complete volumes in the recording.
    pub count: usize,
    /// Number of frames after the last complete volume.
    pub left_over: usize,
    /// True if every second volume was swept in the direction opposite to that of the first.
    pub both_ways: bool,
    /// True if the first volume was swept backwards.
    pub first_backward: bool,
    /// Share of the distance between two frames that the motor travels while one frame is acquired, 0..=1.
    pub speed_ratio: f64,
    pub firing: Firing,
}

/// Order in which the lines of a frame fire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode)]
#[tree(rename_all = "lowercase")]
pub enum Firing {
    /// From line 0.
    #[default]
    Forward,
    /// From the last line.
    Backward,
    /// In each volume the first frame in time fires from line 0, the next from the last line, and so on.
    Alternating,
}

impl Volumes {
    /// `count` volumes of `frames` frames, all swept forwards by a motor that stops for each frame.
    pub fn forward(frames: usize, count: usize) -> Volumes {
        Volumes { frames, count, ..Volumes::default() }
    }

    /// True if the volume with this index was swept backwards.
    pub fn backward(&self, volume: usize) -> bool {
        self.first_backward ^ (self.both_ways && volume % 2 == 1)
    }

    /// True if slice k of a volume fires from its last line.
    pub(super) fn fires_from_last(&self, volume: usize, k: usize) -> bool {
        match self.firing {
            Firing::Forward => false,
            Firing::Backward => true,
            Firing::Alternating => (if self.backward(volume) { self.frames - 1 - k } else { k }) % 2 == 1,
        }
    }

    /// `probe` with the motor's motion in the volume of this index: where each slice was at its line 0, and how far the motor travels over its
    /// lines. The line that fires j-th of L in frame k, in the order of time, is at f = f_first + dir df (k + s j / L), with dir 1 or -1, the
    /// pitch df and the [`Volumes::speed_ratio`] s (thesis 4.4.2.2, Fig. 40).
    pub fn swept(&self, volume: usize, probe: &Probe) -> Probe {
        let (lines, last) = (probe.lines.len() as f64, probe.slices.len() - 1);
        let late = (lines - 1.0) / lines;
        let is_turned = |k| self.fires_from_last(volume, k);
        let (slices, advance) = match (self.advance(volume, &probe.slices), &probe.slices, self.firing) {
            (advance @ Advance::None, slices, _) | (advance, slices, Firing::Forward) => (slices.clone(), advance),
            (Advance::Same(travel), Axis::Even { first, pitch, count }, Firing::Backward) => {
                (Axis::Even { first: first + late * travel, pitch: *pitch, count: *count }, Advance::Same(-travel))
            }
            (advance, slices, _) => {
                let moving = Probe { advance, ..probe.clone() };
                let travel = |k: usize| moving.advance_at(k as f64);
                let start = |k: usize| slices.at(k as f64) + if is_turned(k) { late * travel(k) } else { 0.0 };
                let turned = |k: usize| if is_turned(k) { -travel(k) } else { travel(k) };
                (Axis::Table((0..=last).map(start).collect()), Advance::Each((0..=last).map(turned).collect()))
            }
        };
        Probe { slices, advance, ..probe.clone() }
    }

    /// Travel of the motor while each frame of this volume was acquired: towards the frame that followed in time, so negative for a
    /// backward sweep.
    fn advance(&self, volume: usize, slices: &Axis) -> Advance {
        if self.speed_ratio == 0.0 || slices.len() < 2 {
            return Advance::None;
        }
        let backward = self.backward(volume);
        let sign = if backward { -self.speed_ratio } else { self.speed_ratio };
        match slices {
            Axis::Even { pitch, .. } => Advance::Same(sign * pitch),
            Axis::Table(table) => {
                let gap = |k: usize| table[k + 1] - table[k];
                let last = table.len() - 2;
                // The last frame in time has no successor: the motor is assumed to continue at the same speed.
                let gap_after = |k: usize| if backward { gap(k.max(1) - 1) } else { gap(k.min(last)) };
                Advance::Each((0..table.len()).map(|k| sign * gap_after(k)).collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the motor's place at the time of each line, for each order of firing, both ways.
    #[test]
    fn lines_lie_where_the_motor_was_when_they_fired() {
        let probe = Probe {
            array: Array::Linear,
            lines: Axis::centred(0.3, 5),
            start_depth: 0.0,
            sample_pitch: 0.2,
            samples: 10,
            motion: Motion::Translated,
            slices: Axis::centred(2.0, 6),
            advance: Advance::None,
            sound_speed: 1540.0,
        };
        for firing in [Firing::Forward, Firing::Backward, Firing::Alternating] {
            let volumes = Volumes { both_ways: true, speed_ratio: 0.75, firing, ..Volumes::forward(6, 2) };
            for volume in 0..2 {
                let swept = volumes.swept(volume, &probe);
                swept.check().unwrap();
                for frame in 0..6 {
                    let from_last = firing == Firing::Backward || (firing == Firing::Alternating && frame % 2 == 1);
                    for fired in 0..5 {
                        let way = 2.0 * (f64::from(frame) + 0.75 * f64::from(fired) / 5.0);
                        let (slice, expected) = if volume == 0 { (frame, way - 5.0) } else { (5 - frame, 5.0 - way) };
                        let line = if from_last { 4 - fired } else { fired };
                        let at = swept.slice_position(f64::from(line), f64::from(slice));
                        assert!((at - expected).abs() < 1e-12, "{firing:?} {volume} {frame} {fired}: {at} {expected}");
                    }
                }
            }
        }
        let volumes = Volumes { firing: Firing::Alternating, ..Volumes::forward(6, 2) };
        assert_eq!(volumes.swept(0, &probe), probe, "a motor that stops for each frame");
    }

    /// Line 0 of the next frame in time is where the motor is when the last line of this one is done.
    #[test]
    fn the_motor_moves_towards_the_next_frame_in_time_both_ways() {
        let slices = Axis::Table(vec![0.0, 1.0, 3.0, 6.0]);
        let volumes = Volumes { both_ways: true, speed_ratio: 1.0, ..Volumes::forward(4, 2) };
        let Advance::Each(forward) = volumes.advance(0, &slices) else { panic!("a table has one advance a slice") };
        let Advance::Each(back) = volumes.advance(1, &slices) else { panic!("a table has one advance a slice") };
        for k in 0..3 {
            assert_eq!(slices.at(k as f64) + forward[k], slices.at(k as f64 + 1.0));
            assert_eq!(slices.at(k as f64 + 1.0) + back[k + 1], slices.at(k as f64));
        }
        assert_eq!(volumes.advance(1, &Axis::centred(0.5, 4)), Advance::Same(-0.5));
        assert_eq!(Volumes::forward(4, 1).advance(0, &slices), Advance::None);
    }

    #[test]
    fn the_first_direction_and_the_alternation_are_independent() {
        let volumes = Volumes { first_backward: true, ..Volumes::forward(4, 3) };
        assert_eq!([0, 1, 2].map(|v| volumes.backward(v)), [true; 3]);
        let volumes = Volumes { both_ways: true, ..volumes };
        assert_eq!([0, 1, 2].map(|v| volumes.backward(v)), [true, false, true]);
    }
}
