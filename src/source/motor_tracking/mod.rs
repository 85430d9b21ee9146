//! The motor drives the sweep: frames of a free-running probe, which come without a place of their own, are given one by where the array
//! was when their first line was taken.
//!
//! A pass of the motor is a volume, and a frame goes to the slice that is nearest to its angle ([`passes`]). How right that is depends on
//! when the frame's first line was taken: by arrival that is known to the jitter of the way from the probe to here, and an error of t s
//! moves the frame by the array's speed times t, forth and back in opposite directions: at 120 deg/s, 10 ms are 1.2 deg. A constant delay
//! can be given and is then none. Between two positions of the motor the array is taken to move evenly, see [`Track::at`].
//!
//! While a frame is acquired the array travels on by speed times frame time. The speed between the ramps stands for all: near the ends
//! of a sweep, within v^2 / 2a deg of them (0.3 deg at 65 deg/s and 8000 deg/s2), the last lines lie up to that way beside their place.
//!
//! [`Track::at`]: crate::probe::motor::Track::at

mod free_running;
mod passes;

pub use free_running::FreeRunning;
pub use passes::TrackingCounts;

use super::frame::{Frame, Header};
use super::live::{Event, Live};
use crate::probe::motor::{ArrayState, BackgroundSweep};
use crate::probe::{Advance, Axis, Geometry, Motion, Probe};
use passes::{MAX_FILLED, Passes};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Frames that wait for the motor's position at most, and how long.
const MAX_WAITING: usize = 32;
const MAX_WAIT: Duration = Duration::from_millis(300);
/// How long the source is waited for before the motor is looked at again; shorter where frames wait for a position.
const POLL: Duration = Duration::from_millis(20);
const POLL_WAITING: Duration = Duration::from_millis(4);
/// Shortest time between two faults that are reported.
const REPORT_INTERVAL: Duration = Duration::from_secs(1);

/// When a frame's first line was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clock {
    /// When it arrived, less the time that sound needs for it and `delay` s from its last line to here.
    Arrival { delay: f64 },
    /// At its stamp, s since 1970 by this machine's clock. A frame without one has no place.
    Stamp,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorTrackingOptions {
    pub clock: Clock,
    /// The source is asked for frames only once the array sweeps, as a file can be. What runs by itself is listened to from the
    /// start: frames that waited would be taken for new ones.
    pub holds: bool,
}

/// A free-running source whose frames the motor places.
///
/// Memory: 32 frames that wait for a position, two that may be the nearest to their slice, and those that stand in for missing ones.
pub struct MotorTracked {
    source: Box<dyn Live>,
    motor: BackgroundSweep,
    options: MotorTrackingOptions,
    now: Option<Tracking>,
    /// Frames that came, without place, and when: the time of the first line on the motor's clock, and until when they wait.
    waiting: VecDeque<(f64, Instant, Frame)>,
    /// A frame whose lines are arriving.
    lines: Option<Frame>,
    out: VecDeque<Event>,
    /// Why the source ended.
    ended: Option<Option<String>>,
    counts: TrackingCounts,
    reported: TrackingCounts,
    reported_at: Instant,
    over: bool,
}

/// What follows from the geometry.
struct Tracking {
    passes: Passes,
    /// That sound needs for a frame, s.
    frame_time: f64,
    frame_bytes: usize,
}

impl MotorTracked {
    pub fn new(source: Box<dyn Live>, motor: BackgroundSweep, options: MotorTrackingOptions) -> MotorTracked {
        MotorTracked {
            source,
            motor,
            options,
            now: None,
            waiting: VecDeque::new(),
            lines: None,
            out: VecDeque::new(),
            ended: None,
            counts: TrackingCounts::default(),
            reported: TrackingCounts::default(),
            reported_at: Instant::now(),
            over: false,
        }
    }

    pub fn counts(&self) -> TrackingCounts {
        self.counts
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Begin(header) => self.begin(*header),
            Event::Frame(frame) => self.arrived(frame),
            Event::Lines { frame, first } => self.lines(frame, first),
            Event::Fault(fault) => self.out.push_back(Event::Fault(fault)),
            Event::Idle => {}
            Event::End(why) => self.ended = Some(why),
        }
    }

    /// A frame that comes in pieces is placed when it is whole.
    fn lines(&mut self, frame: Frame, first: usize) {
        match &mut self.lines {
            Some(there) if first > 0 && (there.volume, there.slice) == (frame.volume, frame.slice) => {
                there.bytes.extend(&frame.bytes);
            }
            lines => *lines = Some(frame),
        }
        let whole = self.now.as_ref().map(|now| now.frame_bytes);
        if let Some(frame) = self.lines.take_if(|lines| Some(lines.bytes.len()) >= whole) {
            self.arrived(frame);
        }
    }

    fn begin(&mut self, header: Header) {
        self.place_all(true);
        if let Some(mut now) = self.now.take() {
            now.passes.end(&mut self.counts, &mut self.out);
        }
        self.lines = None;
        match motor_header(header, self.motor.speed()) {
            Ok((header, slices, frame_time)) => {
                let frame_bytes = header.frame_bytes().unwrap_or(0) as usize;
                self.out.push_back(Event::Begin(Box::new(header)));
                self.warn_of_edges(&slices);
                self.now = Some(Tracking { passes: Passes::new(slices), frame_time, frame_bytes });
            }
            Err(fault) => self.ended = Some(Some(fault)),
        }
    }

    /// Slices beyond the sweep are never reached.
    fn warn_of_edges(&mut self, slices: &Axis) {
        let half = self.motor.angle().to_radians() / 2.0;
        let last = slices.len() as f64 - 1.0;
        let (before, behind) = (slices.index_of(-half), last - slices.index_of(half));
        if before.max(behind) >= MAX_FILLED as f64 + 0.5 {
            let (angle, span) = (self.motor.angle(), (slices.last() - slices.first()).to_degrees());
            self.out.push_back(Event::Fault(format!(
                "the motor sweeps {angle} deg and the probe's frames lie over {span:.1}: no volume will be whole"
            )));
        }
    }

    fn arrived(&mut self, frame: Frame) {
        let Some(Tracking { frame_time, .. }) = self.now else { return };
        let (now, watch) = (Instant::now(), self.motor.watch());
        let time = match self.options.clock {
            Clock::Arrival { delay } => watch.time(now) - frame_time - delay,
            Clock::Stamp => frame.time.map_or(f64::NAN, |stamp| watch.time_of_stamp(stamp)),
        };
        if self.waiting.len() == MAX_WAITING {
            self.waiting.pop_front();
            self.counts.unknown += 1;
        }
        self.waiting.push_back((time, now + MAX_WAIT, frame));
    }

    /// Places the frames that the positions cover by now; `all`: also gives up those that they do not.
    fn place_all(&mut self, all: bool) {
        let Some(now) = &mut self.now else { return };
        while let Some((time, until, _)) = self.waiting.front() {
            let (time, until) = (*time, *until);
            let place = self.motor.watch().at(time);
            let span = self.motor.watch().span();
            let not_yet = span.is_some_and(|(_, last)| time > last.time);
            if place == ArrayState::Unknown && not_yet && !all && Instant::now() < until {
                return;
            }
            let Some((_, _, mut frame)) = self.waiting.pop_front() else { return };
            frame.time = Some(time);
            match (place, span) {
                (ArrayState::Unknown, None) => self.counts.early += 1,
                (ArrayState::Unknown, Some((first, _))) if time < first.time => self.counts.early += 1,
                _ => now.passes.frame(frame, place, &mut self.counts, &mut self.out),
            }
        }
    }

    fn report(&mut self) {
        if self.reported_at.elapsed() < REPORT_INTERVAL {
            return;
        }
        if let Some(fault) = self.counts.since(&self.reported).fault() {
            self.out.push_back(Event::Fault(fault));
            (self.reported, self.reported_at) = (self.counts, Instant::now());
        }
    }

    /// Nothing comes any more: the motor is stopped before that is said.
    fn finish(&mut self) {
        self.place_all(true);
        if let Some(now) = &mut self.now {
            now.passes.end(&mut self.counts, &mut self.out);
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
            if self.ended.is_some() || (self.options.holds && self.motor.watch().span().is_none()) {
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

    /// The array does not wait, and a frame that did would be placed where the array is later.
    fn can_wait(&self) -> bool {
        false
    }
}

/// The header of frames that the motor places at `speed` deg/s, the slices in rad, and the time that sound needs for a frame, s.
///
/// # Errors
/// In words, frames that no motor turns, or that it would turn too fast.
fn motor_header(header: Header, speed: f64) -> Result<(Header, Axis, f64), String> {
    let probe = match &header.forward {
        Geometry::Sweep(probe) if matches!(probe.motion, Motion::Fan { .. }) && probe.slices.len() > 1 => probe.clone(),
        _ => return Err("the motor can only place the frames of a probe that turns: [motion] kind = 'fan'".into()),
    };
    let frame_time = probe.acquisition_time() / probe.slices.len() as f64;
    let advance = speed.to_radians() * frame_time;
    let going = |advance| Geometry::Sweep(Probe { advance: Advance::Same(advance), ..probe.clone() });
    let header = Header { forward: going(advance), backward: going(-advance), ..header };
    header.check().map_err(|(field, fault)| format!("swept at {speed:.1} deg/s: {field} {fault}"))?;
    Ok((header, probe.slices, frame_time))
}
