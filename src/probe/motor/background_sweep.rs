//! A sweep on a thread of its own, and the recent positions of the array.

use super::drive::Drive;
use super::guard::Interrupter;
use super::sweep::{ArrayState, Position, Sweep, Track};
use super::{Fault, MotorError, Stopped};
use crate::sync::locked;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Number of positions that are kept at least: those of 20 s at the highest rate.
const MIN_POSITIONS: usize = 4096;
/// Between two positions that are further apart the position is not known, s. At 9600 baud a position takes 20 ms, three requests 60.
const MAX_GAP: f64 = 0.1;

/// A motor that a separate thread sweeps until the motor fails, a signal comes, or the sweep is stopped. Dropping this value stops it as
/// [`BackgroundSweep::stop`] does.
pub struct BackgroundSweep {
    port: String,
    positions: PositionLog,
    speed: f64,
    angle: f64,
    interrupter: Interrupter,
    thread: Option<JoinHandle<()>>,
}

/// The recent positions of the array, with the clock of their times. All clones share them.
#[derive(Clone)]
pub struct PositionLog {
    /// Time 0 of the positions.
    start: Instant,
    /// Time 0 of the positions, s since 1970.
    start_since_1970: f64,
    state: Arc<Mutex<State>>,
}

struct State {
    track: Track,
    ended: Option<MotorError>,
}

impl BackgroundSweep {
    /// Starts a thread that finds home, unless `homed` is true, and sweeps until it is stopped. `volumes` of the sweep is ignored.
    ///
    /// # Errors
    /// The sweep exceeds the limits of the motor, or no thread can be started; then nothing moved. Later faults are returned by
    /// [`BackgroundSweep::stop`].
    pub fn start(mut drive: Drive, sweep: Sweep, homed: bool) -> Result<BackgroundSweep, MotorError> {
        let sweep = Sweep { volumes: None, ..sweep };
        let speed = sweep.speed(&drive.table, drive.guard.port().settings().round_trip());
        let speed = speed.map_err(|fault| drive.guard.fail("sweep", fault))?;
        let track = Track::new(MAX_GAP);
        let positions = PositionLog {
            start: Instant::now(),
            start_since_1970: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
            state: Arc::new(Mutex::new(State { track, ended: None })),
        };
        let (interrupter, theirs) = (drive.interrupter(), positions.clone());
        let port = drive.guard.port().settings().path.clone();
        let thread = std::thread::Builder::new().name("motor".into()).spawn(move || theirs.run(drive, &sweep, homed));
        let thread = thread.map_err(|e| {
            let fault = Fault::OutOfRange(format!("a thread for the motor cannot be started: {e}"));
            MotorError { port: port.clone(), operation: "sweep", fault, stopped: Stopped::NotMoved }
        })?;
        Ok(BackgroundSweep { port, positions, speed, angle: sweep.angle, interrupter, thread: Some(thread) })
    }

    /// The recent positions of the array.
    pub fn positions(&self) -> &PositionLog {
        &self.positions
    }

    /// Speed of the array between the ramps at both ends, deg/s.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Angle of the sweep from end to end, degrees.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// True if the sweep has ended, also if [`BackgroundSweep::stop`] ended it. `stop` returns the fault, if one ended it.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops the motor, and waits until the module has confirmed the command or all attempts have failed. The motor may still be slowing down.
    ///
    /// # Errors
    /// The fault that ended the sweep before, the thread panicked, or the module did not confirm the stop. A sweep that a signal ended is no error if
    /// the module confirmed the stop.
    pub fn stop(&mut self) -> Result<(), MotorError> {
        self.interrupter.interrupt();
        if self.thread.take().is_some_and(|thread| thread.join().is_err()) {
            // The drive stopped the motor when it was dropped, or logged that it could not.
            let stopped = Stopped::Unconfirmed("see the messages before this one".into());
            let fault = Fault::Interrupted("a panic on its own thread");
            return Err(MotorError { port: self.port.clone(), operation: "sweep", fault, stopped });
        }
        match self.positions.ended() {
            Some(MotorError { fault: Fault::Interrupted(_), stopped: Stopped::Confirmed, .. }) | None => Ok(()),
            Some(error) => Err(error),
        }
    }
}

impl Drop for BackgroundSweep {
    fn drop(&mut self) {
        let is_known = self.positions.ended().is_some();
        if let Err(error) = self.stop()
            && !is_known
        {
            tracing::error!("{error}");
        }
    }
}

impl PositionLog {
    fn run(&self, mut drive: Drive, sweep: &Sweep, homed: bool) {
        let found = if homed { Ok(()) } else { drive.home() };
        let ended = found.and_then(|()| {
            drive.sweep(sweep, self.start, &mut |position| {
                let track = &mut locked(&self.state).track;
                track.push(position);
                track.forget_all_but(MIN_POSITIONS);
            })
        });
        // Dropped first: who sees the end may open the port.
        drop(drive);
        locked(&self.state).ended = ended.err();
    }

    /// Converts an instant to the clock of the positions, s.
    pub fn time(&self, at: Instant) -> f64 {
        match at.checked_duration_since(self.start) {
            Some(since) => since.as_secs_f64(),
            None => -self.start.saturating_duration_since(at).as_secs_f64(),
        }
    }

    /// Converts a time stamp in s since 1970 to the clock of the positions, s. It is wrong by as much as the system's clock was adjusted since
    /// the sweep began.
    pub fn time_of_stamp(&self, stamp: f64) -> f64 {
        stamp - self.start_since_1970
    }

    /// Converts a time in s on the clock of the positions to an instant. Times before 0 and those that are not finite give the time 0 of that
    /// clock.
    pub fn instant(&self, time: f64) -> Instant {
        let since = Duration::try_from_secs_f64(time.max(0.0)).unwrap_or_default();
        self.start.checked_add(since).unwrap_or(self.start)
    }

    /// The position of the array at a time in s on the clock of the positions, interpolated as [`Track::at`] does.
    pub fn at(&self, time: f64) -> ArrayState {
        locked(&self.state).track.at(time)
    }

    /// The oldest and the newest position that are stored; None before the sweep has begun.
    pub fn span(&self) -> Option<(Position, Position)> {
        let state = locked(&self.state);
        let positions = state.track.positions();
        Some((*positions.first()?, *positions.last()?))
    }

    /// Why the sweep has ended.
    fn ended(&self) -> Option<MotorError> {
        locked(&self.state).ended.clone()
    }
}
