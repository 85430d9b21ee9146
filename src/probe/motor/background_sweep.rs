//! A motor that goes back and forth on a thread of its own, and where the array was lately.

use super::drive::Drive;
use super::fault::{Fault, MotorError, Stopped};
use super::guard::Interrupter;
use super::sweep::{ArrayState, Position, Sweep, Track};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Positions that are remembered at least: of 20 s at the shortest time between two.
const KEPT: usize = 4096;
/// Between two positions that lie further apart nothing is known, s. At 9600 baud a position takes 20 ms, three requests 60.
const LONGEST_GAP: f64 = 0.1;

/// A motor that sweeps until it is dropped, or fails. Dropping it stops the motor and waits for that: one request and its reply, or
/// where the module no longer answers as long as stopping is tried.
pub struct BackgroundSweep {
    port: String,
    watch: PositionLog,
    speed: f64,
    angle: f64,
    interrupter: Interrupter,
    thread: Option<JoinHandle<()>>,
}

/// Where the array was lately. Clones see the same.
#[derive(Clone)]
pub struct PositionLog {
    /// Time 0 of the positions.
    start: Instant,
    /// The same, s since 1970.
    start_of_stamps: f64,
    state: Arc<Mutex<State>>,
}

struct State {
    track: Track,
    ended: Option<MotorError>,
}

impl BackgroundSweep {
    /// Looks for home unless it was found before, and sweeps without an end.
    ///
    /// # Errors
    /// A sweep that the motor cannot do, before anything has moved. What goes wrong later is told by [`BackgroundSweep::stop`].
    pub fn start(mut drive: Drive, sweep: Sweep, homed: bool) -> Result<BackgroundSweep, MotorError> {
        let sweep = Sweep { volumes: None, ..sweep };
        let speed = sweep.speed(&drive.table, drive.guard.port().settings().round_trip());
        let speed = speed.map_err(|fault| drive.guard.fail("sweep", fault))?;
        let track = Track { positions: Vec::new(), longest_gap: LONGEST_GAP };
        let watch = PositionLog {
            start: Instant::now(),
            start_of_stamps: SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64(),
            state: Arc::new(Mutex::new(State { track, ended: None })),
        };
        let (interrupter, theirs) = (drive.interrupter(), watch.clone());
        let port = drive.guard.port().settings().path.clone();
        let thread = std::thread::Builder::new().name("motor".into()).spawn(move || theirs.turn(drive, &sweep, homed));
        let thread = thread.map_err(|e| {
            let fault = Fault::OutOfRange(format!("a thread for the motor cannot be started: {e}"));
            MotorError { port: port.clone(), operation: "sweep", fault, stopped: Stopped::NotMoved }
        })?;
        Ok(BackgroundSweep { port, watch, speed, angle: sweep.angle, interrupter, thread: Some(thread) })
    }

    pub fn watch(&self) -> &PositionLog {
        &self.watch
    }

    /// Degrees a second between the ramps.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Degrees from end to end.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// The motor sweeps no more, whyever: [`BackgroundSweep::stop`] says that.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops the motor and waits for that.
    ///
    /// # Errors
    /// How the motor ended, unless it was by this: a fault before, a signal, or that it could not be stopped.
    pub fn stop(&mut self) -> Result<(), MotorError> {
        self.interrupter.interrupt();
        if self.thread.take().is_some_and(|thread| thread.join().is_err()) {
            // The drive has stopped the motor when it was dropped, or has said that it could not.
            let stopped = Stopped::Unconfirmed("see the messages before this one".into());
            let fault = Fault::Interrupted("a panic on its own thread");
            return Err(MotorError { port: self.port.clone(), operation: "sweep", fault, stopped });
        }
        match self.watch.ended() {
            Some(MotorError { fault: Fault::Interrupted(_), stopped: Stopped::Confirmed, .. }) | None => Ok(()),
            Some(error) => Err(error),
        }
    }
}

impl Drop for BackgroundSweep {
    fn drop(&mut self) {
        let known = self.watch.ended().is_some();
        if let Err(error) = self.stop()
            && !known
        {
            tracing::error!("{error}");
        }
    }
}

impl PositionLog {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn turn(&self, mut drive: Drive, sweep: &Sweep, homed: bool) {
        let found = if homed { Ok(()) } else { drive.home() };
        let ended = found.and_then(|()| {
            drive.sweep(sweep, self.start, &mut |position| {
                let track = &mut self.lock().track;
                track.push(position);
                track.forget_all_but(KEPT);
            })
        });
        // Before it is told: whoever hears of it may take the port.
        drop(drive);
        self.lock().ended = ended.err();
    }

    /// A time in s of the positions' clock.
    pub fn time(&self, at: Instant) -> f64 {
        match at.checked_duration_since(self.start) {
            Some(since) => since.as_secs_f64(),
            None => -self.start.saturating_duration_since(at).as_secs_f64(),
        }
    }

    /// A stamp in s since 1970 on the positions' clock. Wrong by as much as the system's clock was set since the start.
    pub fn time_of_stamp(&self, stamp: f64) -> f64 {
        stamp - self.start_of_stamps
    }

    /// When a time of the positions' clock is. A time that is none or before the start is the start.
    pub fn instant(&self, time: f64) -> Instant {
        let since = Duration::try_from_secs_f64(time.max(0.0)).unwrap_or_default();
        self.start.checked_add(since).unwrap_or(self.start)
    }

    /// Where the array was, see [`Track::at`].
    pub fn at(&self, time: f64) -> ArrayState {
        self.lock().track.at(time)
    }

    /// The first position that is remembered and the last one that was read; none before the sweep has begun.
    pub fn span(&self) -> Option<(Position, Position)> {
        let state = self.lock();
        let positions = state.track.positions();
        Some((*positions.first()?, *positions.last()?))
    }

    /// Why the motor sweeps no more.
    fn ended(&self) -> Option<MotorError> {
        self.lock().ended.clone()
    }
}
