//! The phantom as a free-running probe: frame after frame as fast as sound allows, each of where the array really is.

use crate::files::InputError;
use crate::probe::motor::{ArrayState, PositionLog};
use crate::source::frame::{Frame, Header, Source};
use crate::source::live::{Event, Live};
use crate::source::phantom::{Phantom, PhantomOptions};
use crate::source::phantom_source::PhantomSource;
use std::time::{Duration, Instant};

/// Share of the way to the next slice that the motor may travel during a frame, for as many lines as that leaves time for.
const MAX_ADVANCE: f64 = 0.75;
/// Fewest lines of a frame.
const MIN_LINES: usize = 16;

/// The phantom, seen by an array that a motor turns: a demonstration of placing frames, and so its frames have no place.
///
/// Memory: the phantom's volumes, computed once.
pub struct FreeRunning {
    header: Header,
    watch: PositionLog,
    /// By volume and slice.
    volumes: Vec<Vec<Frame>>,
    /// Of a frame, s.
    period: f64,
    begun: bool,
    /// When the first line of the frame is taken that is on its way, s on the motor's clock.
    next: Option<f64>,
    count: u32,
}

impl FreeRunning {
    /// These options for an array that turns at `speed` deg/s: both ways, with as many lines as sound has time for and the motor's
    /// way during a frame.
    ///
    /// # Errors
    /// As of [`Phantom::new`].
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

    /// Computes the phantom's volumes. `watch`: of the motor that turns the array.
    pub fn new(phantom: Phantom, watch: PositionLog) -> FreeRunning {
        let mut volumes: Vec<Vec<Frame>> = (0..phantom.volumes()).map(|v| phantom.volume(v)).collect();
        volumes.iter_mut().for_each(|volume| volume.sort_by_key(|frame| frame.slice));
        let probe = phantom.probe(0);
        let period = probe.acquisition_time() / probe.slices.len() as f64;
        let header = PhantomSource::new(phantom).header();
        FreeRunning { header, watch, volumes, period, begun: false, next: None, count: 0 }
    }

    /// What the array saw at a time: the frame of the nearest slice, swept the way that the array went.
    fn seen(&self, time: f64) -> Option<&Frame> {
        let (angle, pass) = match self.watch.at(time) {
            ArrayState::Sweeping { angle, pass, .. } => (angle, pass),
            ArrayState::Reversing { angle } => (angle, 0),
            ArrayState::Unknown => self.watch.span().map_or((0.0, 0), |(_, last)| (last.angle, last.pass)),
        };
        let volume = self.volumes.get(pass % self.volumes.len().max(1))?;
        let crate::probe::Geometry::Sweep(probe) = &self.header.forward else { return None };
        // Saturates: beyond the fan it is that of its edge.
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
        let first_line = *self.next.get_or_insert(self.watch.time(now));
        let left = self.watch.instant(first_line + self.period).saturating_duration_since(now);
        if left > patience {
            std::thread::sleep(patience);
            return Event::Idle;
        }
        std::thread::sleep(left);
        let mut next = first_line + self.period;
        // Frames that nobody fetched in time are gone.
        let behind = self.watch.time(Instant::now()) - next;
        if behind > self.period {
            next += (behind / self.period).floor() * self.period;
        }
        let seen = self.seen(next - self.period).cloned();
        self.next = Some(next);
        let Some(frame) = seen else { return Event::End(Some("the phantom has no frames".into())) };
        self.count = self.count.wrapping_add(1);
        Event::Frame(Frame { volume: 0, number: self.count, slice: 0, backward: false, time: None, ..frame })
    }

    fn can_wait(&self) -> bool {
        false
    }
}
