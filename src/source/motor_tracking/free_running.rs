//! The phantom as a free-running probe: frames as fast as sound allows, each at the true position of the array.

use crate::files::InputError;
use crate::probe::motor::{ArrayState, PositionLog};
use crate::source::frame::{Frame, Header, Source};
use crate::source::live::{Event, Live};
use crate::source::phantom::{Phantom, PhantomOptions};
use crate::source::phantom_source::PhantomSource;
use std::time::{Duration, Instant};

/// Largest fraction of the distance to the next slice that the motor travels during a frame; limits the number of lines.
const MAX_ADVANCE: f64 = 0.75;
/// Fewest lines of a frame.
const MIN_LINES: usize = 16;

/// The phantom, scanned by an array that a motor sweeps. Its frames have no position, so that motor tracking can be demonstrated.
///
/// Memory: the phantom's volumes, computed once.
pub struct FreeRunning {
    header: Header,
    positions: PositionLog,
    /// By volume and slice.
    volumes: Vec<Vec<Frame>>,
    /// Duration of a frame, s.
    period: f64,
    begun: bool,
    /// When the first line of the current frame is acquired, s on the motor's clock.
    next: Option<f64>,
    count: u32,
}

impl FreeRunning {
    /// The phantom for an array that moves at `speed` deg/s: swept in both directions, with as many lines as sound has time for, and with
    /// the motor's travel during a frame.
    ///
    /// # Errors
    /// As [`Phantom::new`].
    pub fn phantom(options: PhantomOptions, speed: f64) -> Result<Phantom, InputError> {
        let options = PhantomOptions { both_ways: true, volumes: options.volumes.next_multiple_of(2), ..options };
        let ratio = |options: &PhantomOptions| {
            let probe = Phantom::new(options.clone())?.probe(0);
            let frame_time = probe.acquisition_time() / probe.slices.len() as f64;
            Ok(speed.to_radians() * frame_time / probe.slices.pitch())
        };
        let share = (MAX_ADVANCE / ratio(&options)?).min(1.0);
        let lines = ((options.lines as f64 * share) as usize).max(MIN_LINES);
        let options = PhantomOptions { lines, ..options };
        let speed_ratio = ratio(&options)?.min(1.0);
        Phantom::new(PhantomOptions { speed_ratio, ..options })
    }

    /// Computes the phantom's volumes. `positions`: of the motor that sweeps the array.
    pub fn new(phantom: Phantom, positions: PositionLog) -> FreeRunning {
        let mut volumes: Vec<Vec<Frame>> = (0..phantom.volumes()).map(|v| phantom.volume(v)).collect();
        volumes.iter_mut().for_each(|volume| volume.sort_by_key(|frame| frame.slice));
        let probe = phantom.probe(0);
        let period = probe.acquisition_time() / probe.slices.len() as f64;
        let header = PhantomSource::new(phantom).header();
        FreeRunning { header, positions, volumes, period, begun: false, next: None, count: 0 }
    }

    /// The frame at the position of the array at a time: that of the nearest slice, with the direction of the pass.
    fn frame_at(&self, time: f64) -> Option<&Frame> {
        let (angle, pass) = match self.positions.at(time) {
            ArrayState::Sweeping { angle, pass, .. } => (angle, pass),
            ArrayState::Reversing { angle } => (angle, 0),
            ArrayState::Unknown => self.positions.span().map_or((0.0, 0), |(_, last)| (last.angle, last.pass)),
        };
        let volume = self.volumes.get(pass % self.volumes.len().max(1))?;
        let crate::probe::Geometry::Sweep(probe) = &self.header.forward else { return None };
        // Saturates: beyond the fan, the slice at its edge.
        let slice = probe.slices.index_of(angle.to_radians()).round() as usize;
        volume.get(slice.min(volume.len().saturating_sub(1)))
    }
}

impl Live for FreeRunning {
    fn next(&mut self, patience: Duration) -> Event {
        if !self.begun {
            self.begun = true;
            return Event::Begin(Box::new(self.header.clone()));
        }
        let now = Instant::now();
        let first_line = *self.next.get_or_insert(self.positions.time(now));
        let left = self.positions.instant(first_line + self.period).saturating_duration_since(now);
        if left > patience {
            std::thread::sleep(patience);
            return Event::Idle;
        }
        std::thread::sleep(left);
        let mut next = first_line + self.period;
        // Frames that were not taken in time are lost.
        let behind = self.positions.time(Instant::now()) - next;
        if behind > self.period {
            next += (behind / self.period).floor() * self.period;
        }
        let frame = self.frame_at(next - self.period).cloned();
        self.next = Some(next);
        let Some(frame) = frame else { return Event::End(Some("the phantom has no frames".into())) };
        self.count = self.count.wrapping_add(1);
        Event::Frame(Frame { volume: 0, number: self.count, slice: 0, backward: false, time: None, ..frame })
    }

    fn can_wait(&self) -> bool {
        false
    }
}
