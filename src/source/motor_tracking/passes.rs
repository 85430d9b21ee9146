//! Frames of known angle become the slices of a pass. Pure.

use crate::Frame;
use crate::live::Event;
use crate::probe::Axis;
use crate::probe::motor::{ArrayState, Direction};
use std::collections::VecDeque;

/// Largest number of consecutive missing slices that are filled with copies of neighbours.
pub(super) const MAX_FILLED: usize = 2;

/// Sorts frames of known array angle into the slices of one pass after another.
pub(super) struct Passes {
    /// rad.
    slices: Axis,
    current: Option<Pass>,
    /// Number of the last pass that is over.
    over: Option<usize>,
}

struct Pass {
    number: usize,
    direction: Direction,
    /// The frame nearest so far to the slice at the array's position. The nearest frame is used and not the last one, because it shows
    /// the slice most accurately. It is emitted when a frame of the next slice arrives.
    nearest: Option<Candidate>,
    /// The frame that was emitted last.
    emitted: Option<Candidate>,
    slices: usize,
}

struct Candidate {
    /// ArrayState in the order of the pass.
    step: usize,
    /// rad.
    angle: f64,
    frame: Frame,
}

impl Passes {
    /// `slices`: angles of the slices, rad, at least two.
    pub fn new(slices: Axis) -> Passes {
        Passes { slices, current: None, over: None }
    }

    /// Fractional index of an angle (rad) in the order of a pass.
    fn step(&self, angle: f64, direction: Direction) -> f64 {
        let index = self.slices.index_of(angle);
        if direction == Direction::Forward { index } else { self.slices.len() as f64 - 1.0 - index }
    }

    /// Adds a frame and the state of the array when its first line was acquired. Slices that later frames cannot change are appended to `out`.
    pub fn frame(&mut self, frame: Frame, place: ArrayState, counts: &mut TrackingCounts, out: &mut VecDeque<Event>) {
        let last = self.slices.len() as f64 - 1.0;
        match place {
            ArrayState::Unknown => counts.unknown += 1,
            ArrayState::Reversing { angle } => {
                counts.turning += 1;
                // At its far end the pass is over. There is no need to wait for the next one.
                let step = self.current.as_ref().map(|current| self.step(angle.to_radians(), current.direction));
                if step.is_some_and(|step| step > (last - MAX_FILLED as f64).max(last / 2.0)) {
                    self.end(counts, out);
                }
            }
            ArrayState::Sweeping { angle, direction, pass } => {
                let newest = self.over.max(self.current.as_ref().map(|current| current.number));
                if Some(pass) == self.over {
                    // The array paused at the end and then moved on a little.
                    counts.turning += 1;
                    return;
                }
                if newest.is_some_and(|newest| pass < newest) {
                    counts.late += 1;
                    return;
                }
                if self.current.as_ref().is_some_and(|current| current.number != pass) {
                    self.end(counts, out);
                }
                let angle = angle.to_radians();
                let step = self.step(angle, direction);
                if !(-0.5..=last + 0.5).contains(&step) {
                    counts.beyond += 1;
                    if step > last {
                        self.end(counts, out);
                    }
                    return;
                }
                let near = Candidate { step: step.round().clamp(0.0, last) as usize, angle, frame };
                let mut current = self.current.take().unwrap_or(Pass {
                    number: pass,
                    direction,
                    nearest: None,
                    emitted: None,
                    slices: 0,
                });
                match current.nearest.take() {
                    Some(other) if near.step < other.step => {
                        counts.late += 1;
                        current.nearest = Some(other);
                    }
                    Some(other) if near.step == other.step => {
                        counts.farther += 1;
                        let nearer = self.distance(&near, &current) < self.distance(&other, &current);
                        current.nearest = Some(if nearer { near } else { other });
                    }
                    other => {
                        if let Some(other) = other {
                            self.emit(&mut current, other, counts, out);
                        }
                        current.nearest = Some(near);
                    }
                }
                self.current = Some(current);
            }
        }
    }

    /// Ends the current pass, if there is one, and appends its last slices to `out`.
    pub fn end(&mut self, counts: &mut TrackingCounts, out: &mut VecDeque<Event>) {
        let Some(mut current) = self.current.take() else { return };
        if let Some(nearest) = current.nearest.take() {
            self.emit(&mut current, nearest, counts, out);
        }
        if let Some(emitted) = current.emitted.take() {
            let missing = emitted.step + 1..self.slices.len();
            if missing.len() <= MAX_FILLED {
                for step in missing {
                    counts.filled += 1;
                    out.push_back(self.event(&mut current, step, emitted.frame.clone()));
                }
            }
        }
        let whole = current.slices == self.slices.len();
        counts.whole += u64::from(whole);
        counts.incomplete += u64::from(!whole);
        self.over = Some(current.number);
    }

    /// Emits a frame, and before it copies for missing slices: each of the neighbour whose angle is nearer.
    fn emit(&self, current: &mut Pass, near: Candidate, counts: &mut TrackingCounts, out: &mut VecDeque<Event>) {
        let before = current.emitted.take();
        let missing = before.as_ref().map_or(0, |emitted| emitted.step + 1)..near.step;
        if missing.len() <= MAX_FILLED {
            for step in missing {
                counts.filled += 1;
                let at = self.slices.at(self.slice(step, current.direction) as f64);
                let neighbour = match &before {
                    Some(emitted) if (emitted.angle - at).abs() < (near.angle - at).abs() => emitted,
                    _ => &near,
                };
                out.push_back(self.event(current, step, neighbour.frame.clone()));
            }
        }
        counts.placed += 1;
        out.push_back(self.event(current, near.step, near.frame.clone()));
        current.emitted = Some(near);
    }

    fn event(&self, current: &mut Pass, step: usize, frame: Frame) -> Event {
        current.slices += 1;
        Event::Frame(Frame {
            volume: u32::try_from(current.number).unwrap_or(u32::MAX),
            number: step as u32,
            slice: self.slice(step, current.direction),
            backward: current.direction == Direction::Backward,
            ..frame
        })
    }

    fn slice(&self, step: usize, direction: Direction) -> usize {
        if direction == Direction::Forward { step } else { self.slices.len() - 1 - step }
    }

    /// Distance from the centre of its slice, rad.
    fn distance(&self, near: &Candidate, current: &Pass) -> f64 {
        (near.angle - self.slices.at(self.slice(near.step, current.direction) as f64)).abs()
    }
}

/// Numbers of frames, of slices and of passes in motor tracking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackingCounts {
    /// Number of frames that became a slice.
    pub placed: u64,
    /// Number of frames that were left out because the sweep had not begun.
    pub early: u64,
    /// Number of frames that were left out near a reversal, where the direction is not known.
    pub turning: u64,
    /// Number of frames that were left out more than half a slice pitch beyond the first or last slice.
    pub beyond: u64,
    /// Number of frames that were left out because another one of the same pass was nearer to the slice.
    pub farther: u64,
    /// Number of frames that were left out because they had no time stamp, or the motor's position at their time did not become known soon
    /// enough.
    pub unknown: u64,
    /// Number of frames that were left out because a later pass or slice had begun.
    pub late: u64,
    /// Number of slices without a frame of their own that were filled with a neighbour's.
    pub filled: u64,
    /// Number of passes that became complete volumes.
    pub whole: u64,
    /// Number of passes that stayed incomplete because more than two slices in a row were missing, which are not filled.
    pub incomplete: u64,
}

impl TrackingCounts {
    /// A line for users on slices and frames that were lost since earlier counts. None if there is nothing to report: it is normal that some
    /// frames are left out because there are more than slices.
    pub fn fault(&self, before: &TrackingCounts) -> Option<String> {
        let parts = [
            (self.filled - before.filled, "slices had no frame of their own and were given a neighbour's"),
            (self.incomplete - before.incomplete, "passes missed more than two slices in a row and stayed incomplete"),
            (self.unknown - before.unknown, "frames were left out, the motor's position at their time not being known"),
            (self.late - before.late, "frames were left out, coming after those of a later pass or slice"),
        ];
        let parts: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(n, what)| format!("{n} {what}")).collect();
        (!parts.is_empty()).then(|| format!("motor: {}", parts.join("; ")))
    }
}

impl std::fmt::Display for TrackingCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let TrackingCounts { placed, early, turning, beyond, farther, unknown, late, filled, whole, incomplete } = self;
        write!(
            f,
            "{placed} frames in {whole} whole and {incomplete} incomplete passes, {filled} slices filled; left out: "
        )?;
        write!(
            f,
            "{early} before the sweep, {turning} at a turn, {beyond} beyond the slices, {farther} farther from "
        )?;
        write!(f, "their slice than others, {unknown} without a position, {late} too late")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Seven slices from -6 to 6 deg.
    fn slices() -> Axis {
        Axis::centred(2f64.to_radians(), 7)
    }

    fn frame(tag: u8) -> Frame {
        Frame { volume: 9, number: 9, slice: 9, backward: false, time: None, pose: None, bytes: vec![tag] }
    }

    /// Passes of these angles, deg, every second one backwards; frames are tagged by their index in the list.
    fn run_passes(passes: &[&[f64]]) -> (Vec<Frame>, TrackingCounts) {
        let (mut all, mut counts, mut out) = (Passes::new(slices()), TrackingCounts::default(), VecDeque::new());
        let mut tag = 0;
        for (pass, angles) in passes.iter().enumerate() {
            let direction = if pass % 2 == 0 { Direction::Forward } else { Direction::Backward };
            for angle in *angles {
                all.frame(frame(tag), ArrayState::Sweeping { angle: *angle, direction, pass }, &mut counts, &mut out);
                tag += 1;
            }
        }
        all.end(&mut counts, &mut out);
        let frames = out.into_iter().filter_map(|e| if let Event::Frame(frame) = e { Some(frame) } else { None });
        (frames.collect(), counts)
    }

    fn slices_and_tags(frames: &[Frame]) -> Vec<(usize, u8)> {
        frames.iter().map(|f| (f.slice, f.bytes[0])).collect()
    }

    #[test]
    fn a_backward_pass_is_another_volume_with_descending_slices() {
        let forth = [-6.1, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0];
        let back = forth.map(|a| -a);
        let (frames, counts) = run_passes(&[&forth, &back]);
        assert_eq!((frames.len(), counts.whole, counts.placed, counts.filled), (14, 2, 14, 0));
        for (n, frame) in frames.iter().enumerate() {
            let (volume, number) = (n / 7, n % 7);
            assert_eq!((frame.volume as usize, frame.number as usize, frame.backward), (volume, number, volume == 1));
            assert_eq!(frame.slice, if volume == 1 { 6 - number } else { number });
            assert_eq!(frame.bytes, [n as u8]);
        }
    }

    #[test]
    fn of_two_frames_at_a_slice_the_nearer_is_used_in_any_order() {
        let (frames, counts) = run_passes(&[&[-6.0, -5.2, -4.4, -3.9, -2.0, -1.2, 0.0, 2.0, 4.0, 6.0, 6.9]]);
        assert_eq!(slices_and_tags(&frames), [(0, 0), (1, 3), (2, 4), (3, 6), (4, 7), (5, 8), (6, 9)]);
        assert_eq!((counts.farther, counts.whole), (4, 1));
    }

    #[test]
    fn up_to_two_missing_slices_get_the_nearer_neighbours_frame_and_three_do_not() {
        let (frames, counts) = run_passes(&[&[-4.0, -2.0, 3.7, 6.0]]);
        assert_eq!(slices_and_tags(&frames), [(0, 0), (1, 0), (2, 1), (3, 1), (4, 2), (5, 2), (6, 3)]);
        assert_eq!((counts.filled, counts.placed, counts.whole, counts.incomplete), (3, 4, 1, 0));
        let (frames, counts) = run_passes(&[&[-6.0, 2.0, 2.1]]);
        assert_eq!(slices_and_tags(&frames), [(0, 0), (4, 1), (5, 1), (6, 1)]);
        assert_eq!((counts.filled, counts.whole, counts.incomplete, counts.farther), (2, 0, 1, 1));
        let (frames, counts) = run_passes(&[&[0.0, 2.0]]);
        assert_eq!(slices_and_tags(&frames), [(3, 0), (4, 1), (5, 1), (6, 1)], "three are missing at the start");
        assert_eq!(counts.incomplete, 1);
    }

    #[test]
    fn frames_beyond_the_sweep_or_at_a_reversal_are_left_out_and_end_the_pass() {
        let (mut all, mut counts, mut out) = (Passes::new(slices()), TrackingCounts::default(), VecDeque::new());
        let at = |angle, pass| ArrayState::Sweeping { angle, direction: Direction::Forward, pass };
        for angle in [-9.0, -7.01, -6.9, -4.0, -2.0, 0.0, 2.0, 4.0, 6.9] {
            all.frame(frame(0), at(angle, 0), &mut counts, &mut out);
        }
        assert_eq!((counts.beyond, out.len()), (2, 6), "a nearer one may follow the last");
        all.frame(frame(0), at(7.1, 0), &mut counts, &mut out);
        assert_eq!((counts.beyond, out.len(), counts.whole), (3, 7, 1));
        for angle in [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0] {
            all.frame(frame(0), at(angle, 2), &mut counts, &mut out);
        }
        all.frame(frame(0), ArrayState::Reversing { angle: -6.5 }, &mut counts, &mut out);
        assert_eq!(counts.whole, 1);
        all.frame(frame(0), ArrayState::Reversing { angle: 6.5 }, &mut counts, &mut out);
        assert_eq!((counts.whole, counts.turning), (2, 2));
        all.frame(frame(0), at(6.0, 2), &mut counts, &mut out);
        all.frame(frame(0), at(6.0, 0), &mut counts, &mut out);
        all.frame(frame(0), ArrayState::Unknown, &mut counts, &mut out);
        assert_eq!((out.len(), counts.turning, counts.late, counts.unknown), (14, 3, 1, 1));
    }

    proptest! {
        /// For any sequence of states: volume numbers rise, no slice is emitted twice, and none is beyond the last.
        #[test]
        fn no_order_of_places_gives_a_slice_twice(
            places in prop::collection::vec((-9.0..9.0_f64, 0..4_usize, 0..6_u8), 0..200),
        ) {
            let (mut all, mut counts, mut out) = (Passes::new(slices()), TrackingCounts::default(), VecDeque::new());
            for (angle, pass, kind) in places {
                let direction = if pass % 2 == 0 { Direction::Forward } else { Direction::Backward };
                let place = match kind {
                    0 => ArrayState::Reversing { angle },
                    1 => ArrayState::Unknown,
                    _ => ArrayState::Sweeping { angle, direction, pass },
                };
                all.frame(frame(0), place, &mut counts, &mut out);
            }
            all.end(&mut counts, &mut out);
            let mut before: Option<(u32, u32)> = None;
            for event in out {
                let Event::Frame(frame) = event else { panic!("only frames") };
                prop_assert!(frame.slice < 7);
                prop_assert!(before.is_none_or(|b| b < (frame.volume, frame.number)));
                before = Some((frame.volume, frame.number));
            }
        }
    }
}

#[cfg(test)]
mod count_tests {
    use super::*;

    #[test]
    fn surplus_frames_are_no_fault() {
        let plenty = TrackingCounts {
            placed: 9,
            early: 3,
            turning: 2,
            beyond: 1,
            farther: 7,
            whole: 1,
            ..TrackingCounts::default()
        };
        assert_eq!(plenty.fault(&TrackingCounts::default()), None);
        let one = TrackingCounts { filled: 2, ..plenty };
        assert!(one.fault(&plenty).is_some_and(|f| f.starts_with("motor: 2 slices") && !f.contains(';')));
        assert!(one.to_string().contains("2 slices filled") && one.to_string().lines().count() == 1);
    }
}
