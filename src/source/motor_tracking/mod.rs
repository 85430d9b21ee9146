//! Motor tracking: frames of a free-running probe, which have no position of their own, are placed by the position of the array when
//! their first line was acquired.
//!
//! A pass of the motor is a volume, and a frame goes to the slice that is nearest to its angle ([`passes`]). The accuracy depends on the
//! time of the frame's first line. By arrival it is known up to the jitter of the transmission. An error of t s displaces the frame by
//! the array's speed times t, in opposite directions for forward and backward passes: 10 ms are 1.2 deg at 120 deg/s. A constant delay can
//! be given and then has no effect. Between two positions of the motor the array is assumed to move uniformly, see [`Track::at`].
//!
//! While a frame is acquired the array travels by speed times frame time. The speed between the ramps is used for all frames: near the
//! ends of a sweep, within v^2 / 2a deg of them (0.3 deg at 65 deg/s and 8000 deg/s2), the last lines are off by up to that distance.
//!
//! [`FreeRunning`] is the phantom as such a probe: frames as fast as sound allows, each at the true position of the array.
//!
//! [`Track::at`]: crate::probe::motor::Track::at

mod passes;

pub use passes::TrackingCounts;

use super::frame::{Frame, Header, Source};
use super::live::{Event, Live};
use super::parts::WholeFrames;
use super::phantom::{Phantom, PhantomOptions, PhantomSource};
use crate::files::InputError;
use crate::probe::motor::{ArrayState, BackgroundSweep, PositionLog};
use crate::probe::{Advance, Axis, Geometry, Motion, Probe};
use passes::{MAX_FILLED, Passes};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Most frames that wait for the motor's position, and for how long.
const MAX_WAITING: usize = 32;
const MAX_WAIT: Duration = Duration::from_millis(300);
/// Longest wait for the source before the motor is checked again; shorter while frames wait for a position.
const POLL: Duration = Duration::from_millis(20);
const POLL_WAITING: Duration = Duration::from_millis(4);
/// Shortest time between two faults that are reported.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// How the time is determined at which the first line of a frame was acquired.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// From the frame's arrival, minus the time that sound needs for all its lines, minus `delay` s, the time from the last line to the arrival.
    Arrival { delay: f64 },
    /// From the frame's time stamp, which is taken as that of its first line: s since 1970 on this machine's clock. A frame without one is left out.
    Stamp,
}

/// How frames are assigned to the slices of a volume by the motor's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorTrackingOptions {
    pub clock: Clock,
    /// True if the source is read only once the array sweeps, which suits a file. A source with its own clock has to be read from the start,
    /// because frames that had waited would be taken for new ones.
    pub holds: bool,
}

/// A live source that assigns the frames of a free-running probe to slices by the motor's position.
///
/// Memory: 32 frames that wait for a position, two that may be the nearest to their slice, and copies for missing slices.
pub struct MotorTracked {
    source: WholeFrames,
    motor: BackgroundSweep,
    options: MotorTrackingOptions,
    tracking: Option<Tracking>,
    /// Frames that are not placed yet: the time of the first line on the motor's clock, until when they wait, and the frame.
    waiting: VecDeque<(f64, Instant, Frame)>,
    out: VecDeque<Event>,
    /// Why the source ended.
    ended: Option<Option<String>>,
    counts: TrackingCounts,
    reported: TrackingCounts,
    reported_at: Instant,
    over: bool,
}

/// What depends on the geometry.
struct Tracking {
    passes: Passes,
    /// Time that sound needs for a frame, s.
    frame_time: f64,
}

impl MotorTracked {
    /// Assigns the frames of `source` to slices by the positions of `motor`.
    pub fn new(source: Box<dyn Live>, motor: BackgroundSweep, options: MotorTrackingOptions) -> MotorTracked {
        MotorTracked {
            source: WholeFrames::new(source),
            motor,
            options,
            tracking: None,
            waiting: VecDeque::new(),
            out: VecDeque::new(),
            ended: None,
            counts: TrackingCounts::default(),
            reported: TrackingCounts::default(),
            reported_at: Instant::now(),
            over: false,
        }
    }

    /// Numbers of frames so far that were assigned and that were left out.
    pub fn counts(&self) -> TrackingCounts {
        self.counts
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Begin(header) => self.begin(*header),
            Event::Frame(frame) => self.arrived(frame),
            Event::Fault(fault) => self.out.push_back(Event::Fault(fault)),
            // Frames are whole.
            Event::Lines { .. } | Event::Idle => {}
            Event::End(why) => self.ended = Some(why),
        }
    }

    fn begin(&mut self, header: Header) {
        self.place_all(true);
        if let Some(mut tracking) = self.tracking.take() {
            tracking.passes.end(&mut self.counts, &mut self.out);
        }
        match motor_header(header, self.motor.speed()) {
            Ok((header, slices, frame_time)) => {
                self.out.push_back(Event::Begin(Box::new(header)));
                self.warn_of_edges(&slices);
                self.tracking = Some(Tracking { passes: Passes::new(slices), frame_time });
            }
            Err(fault) => self.ended = Some(Some(fault)),
        }
    }

    /// Warns if slices are beyond the ends of the sweep, where they are never reached.
    fn warn_of_edges(&mut self, slices: &Axis) {
        let half = self.motor.angle().to_radians() / 2.0;
        let last = slices.len() as f64 - 1.0;
        let (before, behind) = (slices.index_of(-half), last - slices.index_of(half));
        if before.max(behind) >= MAX_FILLED as f64 + 0.5 {
            let (angle, span) = (self.motor.angle(), (slices.last() - slices.first()).to_degrees());
            self.out.push_back(Event::Fault(format!(
                "the motor sweeps {angle} deg and the probe's frames cover {span:.1}: no volume will be complete"
            )));
        }
    }

    fn arrived(&mut self, frame: Frame) {
        let Some(Tracking { frame_time, .. }) = self.tracking else { return };
        let (now, positions) = (Instant::now(), self.motor.positions());
        let time = match self.options.clock {
            Clock::Arrival { delay } => positions.time(now) - frame_time - delay,
            Clock::Stamp => frame.time.map_or(f64::NAN, |stamp| positions.time_of_stamp(stamp)),
        };
        if self.waiting.len() == MAX_WAITING {
            self.waiting.pop_front();
            self.counts.unknown += 1;
        }
        self.waiting.push_back((time, now + MAX_WAIT, frame));
    }

    /// Places the waiting frames whose time the positions cover. `all`: also leaves out the others.
    fn place_all(&mut self, all: bool) {
        let Some(tracking) = &mut self.tracking else { return };
        while let Some((time, until, _)) = self.waiting.front() {
            let (time, until) = (*time, *until);
            let state = self.motor.positions().at(time);
            let span = self.motor.positions().span();
            let not_yet = span.is_some_and(|(_, last)| time > last.time);
            if state == ArrayState::Unknown && not_yet && !all && Instant::now() < until {
                return;
            }
            let Some((_, _, mut frame)) = self.waiting.pop_front() else { return };
            frame.time = Some(time);
            match (state, span) {
                (ArrayState::Unknown, None) => self.counts.early += 1,
                (ArrayState::Unknown, Some((first, _))) if time < first.time => self.counts.early += 1,
                _ => tracking.passes.frame(frame, state, &mut self.counts, &mut self.out),
            }
        }
    }

    fn report(&mut self) {
        if self.reported_at.elapsed() < REPORT_INTERVAL {
            return;
        }
        if let Some(fault) = self.counts.fault(&self.reported) {
            self.out.push_back(Event::Fault(fault));
            (self.reported, self.reported_at) = (self.counts, Instant::now());
        }
    }

    /// The source has ended: stops the motor, then reports the end.
    fn finish(&mut self) {
        self.place_all(true);
        if let Some(tracking) = &mut self.tracking {
            tracking.passes.end(&mut self.counts, &mut self.out);
        }
        let stopped = self.motor.stop().err().map(|error| error.to_string());
        tracing::info!("placed by the motor: {}", self.counts);
        let why = stopped.or(self.ended.take().flatten());
        self.ended = Some(why.clone());
        self.out.push_back(Event::End(why));
        self.over = true;
    }
}

impl Live for MotorTracked {
    fn next(&mut self, patience: Duration) -> Event {
        let until = Instant::now() + patience;
        loop {
            if let Some(event) = self.out.pop_front() {
                return event;
            }
            if self.over {
                return Event::End(self.ended.clone().flatten());
            }
            if self.motor.has_ended() || (self.ended.is_some() && self.waiting.is_empty()) {
                self.finish();
                continue;
            }
            let left = until.saturating_duration_since(Instant::now());
            let look = left.min(if self.waiting.is_empty() { POLL } else { POLL_WAITING });
            if self.ended.is_some() || (self.options.holds && self.motor.positions().span().is_none()) {
                std::thread::sleep(look);
            } else {
                let event = self.source.next(look);
                self.take(event);
            }
            self.place_all(false);
            self.report();
            if self.out.is_empty() && left.is_zero() {
                return Event::Idle;
            }
        }
    }

    /// The array does not wait. A frame that waited would be placed at a later position.
    fn can_wait(&self) -> bool {
        false
    }

    fn disconnected(&self) -> Option<String> {
        self.source.disconnected()
    }
}

/// The header of frames that are swept at `speed` deg/s, the slices in rad, and the time that sound needs for a frame, s.
///
/// # Errors
/// One line: a geometry that is not a fan, or a speed at which neighbouring slices would cross.
fn motor_header(header: Header, speed: f64) -> Result<(Header, Axis, f64), String> {
    let probe = match &header.forward {
        Geometry::Sweep(probe) if matches!(probe.motion, Motion::Fan { .. }) && probe.slices.len() > 1 => probe.clone(),
        _ => return Err("the motor can only place the frames of a rotating probe: [motion] kind = 'fan'".into()),
    };
    let frame_time = probe.acquisition_time() / probe.slices.len() as f64;
    let advance = speed.to_radians() * frame_time;
    let moving = |advance| Geometry::Sweep(Probe { advance: Advance::Same(advance), ..probe.clone() });
    let header = Header { forward: moving(advance), backward: moving(-advance), ..header };
    header.check().map_err(|(field, fault)| format!("swept at {speed:.1} deg/s: {field} {fault}"))?;
    Ok((header, probe.slices, frame_time))
}

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
    /// The phantom for an array that a motor moves at `speed` deg/s: swept in both directions, and with the motor's travel during each frame. It has
    /// an even number of volumes and at least 16 lines. It has fewer lines than `options` states if the motor would otherwise travel more than three
    /// quarters of a slice pitch during a frame.
    ///
    /// # Errors
    /// An option of the phantom is out of its range.
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

    /// Computes the phantom's volumes. `positions`: those of the motor that sweeps the array.
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
        let Geometry::Sweep(probe) = &self.header.forward else { return None };
        // Saturates: beyond the fan, the slice at its edge.
        let slice = probe.slices.index_of(angle.to_radians()).round() as usize;
        volume.get(slice.min(volume.len().saturating_sub(1)))
    }
}

impl Live for FreeRunning {
    fn next(&mut self, patience: Duration) -> Event {
        if !std::mem::replace(&mut self.begun, true) {
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
