//! The frames of a slow sweep in order of their phase: volumes of one cycle. At each phase every cycle of the heart has one place in the
//! sweep, between two frames; a slice between two such places is interpolated from both. (DeVore et al. 2003 sort so; here the places of
//! all phases are brought to the same slices.)

use super::rhythm::Rhythm;
use crate::probe::{Advance, Axis, Probe};
use crate::{Frame, Header, StoredType};
use rayon::prelude::*;

/// Most volumes of a cycle, and slices of a volume.
const MOST: usize = 1024;
/// Most volumes of a cycle where nothing else is asked for.
const USUAL: usize = 20;

/// How many volumes and slices a sweep over a beating heart is sorted into.
#[derive(Clone, Copy, Debug, Default)]
pub struct CycleOptions {
    /// Number of volumes of one cycle, 2..=1024. None: as many as frames were acquired in a mean cycle, but at most 20, the length of the viewer's
    /// cine loop.
    pub phases: Option<usize>,
    /// Slices of a volume, 2..=1024. None: the number of cycles of the sweep minus 1, rounded. Every phase was acquired at about so many positions of
    /// the sweep.
    pub slices: Option<usize>,
}

/// A slow sweep over a beating heart, sorted into the volumes of one cycle (spatio-temporal image correlation, STIC).
pub struct Cycle {
    /// Geometry of the volumes: the part of the sweep in which every phase was acquired.
    pub probe: Probe,
    /// Number of volumes of the cycle.
    pub phases: usize,
    /// Mean length of a heart cycle, s.
    pub seconds: f64,
    stored: StoredType,
    /// By frame of the sweep.
    frames: Vec<Frame>,
    rhythm: Rhythm,
    /// Positions of the frames along the axis of the sweep.
    positions: Vec<f64>,
}

impl Cycle {
    /// Sorts the frames of one slow sweep, given in order of acquisition, `rate` frames a second. `rhythm`: the phases of these frames.
    ///
    /// # Errors
    /// One line: fewer than four cycles, another number of phases than frames, numbers of volumes or slices out of their range, or slices without a
    /// valid geometry, as of a sweep that stands still.
    pub fn new(
        probe: &Probe,
        stored: StoredType,
        frames: Vec<Frame>,
        rhythm: Rhythm,
        rate: f64,
        options: CycleOptions,
    ) -> Result<Cycle, String> {
        let cycles = rhythm.cycles();
        if frames.len() != rhythm.phases.len() || cycles < 4.0 {
            return Err(format!("the sweep has {cycles:.1} cycles: at least 4 are needed, better 10 or more"));
        }
        let seconds = 1.0 / rate / rhythm.mean;
        let phases = options.phases.unwrap_or((seconds * rate).round().clamp(2.0, USUAL as f64) as usize);
        // A phase has its first place within the first cycle and its last within the last.
        let slices = options.slices.unwrap_or((cycles - 1.0).round().clamp(2.0, MOST as f64) as usize);
        for (name, count) in [("phases", phases), ("slices", slices)] {
            if !(2..=MOST).contains(&count) {
                return Err(format!("--{name} {count}: must lie in 2..={MOST}"));
            }
        }
        let positions: Vec<f64> = frames.iter().map(|frame| probe.slices.at(frame.slice as f64)).collect();
        let mut cycle = Cycle { probe: probe.clone(), phases, seconds, stored, frames, rhythm, positions };
        let (start, end) = (cycle.rhythm.phases[0], cycle.rhythm.phases[0] + cycles);
        let ends = [cycle.position(cycle.place(start + 1.0)), cycle.position(cycle.place(end - 1.0))];
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let axis = Axis::Even { first: low, pitch: (high - low) / (slices - 1) as f64, count: slices };
        cycle.probe = Probe { slices: axis, advance: Advance::None, ..probe.clone() };
        cycle.probe.check().map_err(|e| format!("{}: {}", e.field, e.fault))?;
        Ok(cycle)
    }

    /// The header of a recording of the volumes. `range`: the stored values that are displayed as 0 and 1.
    pub fn header(&self, range: [f64; 2]) -> Header {
        Header::of(crate::probe::Geometry::Sweep(self.probe.clone()), self.stored, range)
    }

    /// The frames of the volume at a phase (an index from 0 to `phases` - 1), by slice. The time stamp of all is that of the phase, s from the
    /// start of the cycle.
    pub fn volume(&self, phase: usize) -> Vec<Frame> {
        let share = phase as f64 / self.phases as f64;
        let (begin, end) = (self.rhythm.phases[0], self.rhythm.phases[0] + self.rhythm.cycles());
        // Where each cycle is at this phase: fractional frame and position in the sweep, in order of position.
        let mut places: Vec<(f64, f64)> = ((begin - share).ceil() as i64..=(end - share).floor() as i64)
            .map(|cycle| self.place(cycle as f64 + share))
            .map(|frame| (self.position(frame), frame))
            .collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        (0..self.probe.slices.len())
            .into_par_iter()
            .map(|slice| {
                let at = self.probe.slices.at(slice as f64);
                let next = places.partition_point(|(position, _)| *position <= at).clamp(1, places.len() - 1);
                let ((low, from), (high, to)) = (places[next - 1], places[next]);
                let between = if high > low { ((at - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
                let bytes = self.blended(&[(from, 1.0 - between), (to, between)]);
                let mut frame = Frame::of_slice(phase as u32, slice, bytes);
                frame.time = Some(share * self.seconds);
                frame
            })
            .collect()
    }

    /// The fractional frame at a phase.
    fn place(&self, phase: f64) -> f64 {
        let phases = &self.rhythm.phases;
        let n = phases.partition_point(|p| *p <= phase).clamp(1, phases.len() - 1) - 1;
        n as f64 + ((phase - phases[n]) / (phases[n + 1] - phases[n])).clamp(0.0, 1.0)
    }

    fn position(&self, frame: f64) -> f64 {
        let n = (frame as usize).min(self.positions.len() - 2);
        self.positions[n] + (self.positions[n + 1] - self.positions[n]) * (frame - n as f64)
    }

    /// The weighted sum of fractional frames, each of which lies between two neighbours in time.
    fn blended(&self, of: &[(f64, f64)]) -> Vec<u8> {
        let mut weights: Vec<(&Frame, f64)> = Vec::new();
        for (frame, weight) in of {
            let n = (*frame as usize).min(self.frames.len() - 2);
            let share = frame - n as f64;
            weights.extend([(&self.frames[n], weight * (1.0 - share)), (&self.frames[n + 1], weight * share)]);
        }
        weights.retain(|(_, weight)| *weight > 0.0);
        let each = self.stored.bytes();
        let samples = self.frames[0].bytes.len() / each;
        let mut bytes = Vec::with_capacity(samples * each);
        for at in (0..samples * each).step_by(each) {
            let sum = weights
                .iter()
                .map(|(frame, w)| w * frame.bytes.get(at..at + each).map_or(0.0, |bytes| self.stored.value(bytes)));
            self.stored.append(sum.sum(), &mut bytes);
        }
        bytes
    }
}
