//! Frames without a position get one from the simulated motor: each carries the true angle of the array.

use crate::common::motor::{settings, simulated, stopped_at_last, table};
use crate::common::probes::wobbler;
use crate::common::wait;
use crate::common::wait::eventually;
use echolume::low_level::probe::motor::simulate::Simulator;
use echolume::low_level::probe::motor::{BackgroundSweep, Drive, Sweep};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::motor_tracking::{Clock, FreeRunning, MotorTracked, MotorTrackingOptions};
use echolume::low_level::source::phantom;
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{Frame, StoredType};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

const PITCH: f64 = 2.0;
const SLICES: usize = 13;
const LINES: usize = 64;
/// Half a pitch wider at both ends. Slow: a slice takes 160 ms, so that a busy machine misses none.
const SWEEP: Sweep = Sweep { angle: 26.0, rate: 0.5, volumes: None };

/// Lines of 120 mm: a frame takes 10 ms.
fn probe() -> Probe {
    Probe {
        array: Array::Curved { radius: 40.0 },
        lines: Axis::centred(0.01, LINES),
        start_depth: 0.0,
        sample_pitch: 40.0,
        samples: 4,
        motion: Motion::Fan { wobble_radius: 25.0 },
        slices: Axis::centred(PITCH.to_radians(), SLICES),
        ..wobbler()
    }
}

fn header(probe: Probe) -> Header {
    let forward = Geometry::Sweep(probe);
    Header {
        backward: forward.clone(),
        forward,
        stored: StoredType::U8,
        range: [0.0, 255.0],
        posed: false,
        synthetic: false,
    }
}

/// A free-running probe on the simulated array.
struct Free {
    simulator: Arc<Simulator>,
    header: Option<Header>,
    /// The frame in progress: the time of its first line, and the angle of the array then.
    taking: Option<(Instant, SystemTime, f64)>,
    pieces: bool,
    /// The second half of a frame that comes in pieces.
    rest: Option<Frame>,
    frames: u32,
}

impl Free {
    fn new(simulator: &Arc<Simulator>) -> Free {
        let (simulator, header) = (simulator.clone(), Some(header(probe())));
        Free { simulator, header, taking: None, pieces: false, rest: None, frames: 0 }
    }
}

impl Live for Free {
    fn next(&mut self, patience: Duration) -> Event {
        if let Some(header) = self.header.take() {
            return Event::Begin(Box::new(header));
        }
        if let Some(frame) = self.rest.take() {
            return Event::Lines { frame, first: LINES / 2 };
        }
        let angle = self.simulator.angle();
        let (began, stamp, angle) = *self.taking.get_or_insert((Instant::now(), SystemTime::now(), angle));
        let left = (began + Duration::from_millis(10)).saturating_duration_since(Instant::now());
        wait::pace(left.min(patience));
        if left > patience {
            return Event::Idle;
        }
        let mut bytes = vec![0; 4 * LINES];
        bytes[..8].copy_from_slice(&angle.to_le_bytes());
        let time = stamp.duration_since(UNIX_EPOCH).ok().map(|t| t.as_secs_f64());
        let mut frame = Frame { volume: self.frames, number: 0, slice: 0, backward: false, time, pose: None, bytes };
        (self.taking, self.frames) = (None, self.frames + 1);
        if self.pieces {
            let bytes = frame.bytes.split_off(2 * LINES);
            self.rest = Some(Frame { bytes, ..frame.clone() });
            return Event::Lines { frame, first: 0 };
        }
        Event::Frame(frame)
    }

    fn can_wait(&self) -> bool {
        false
    }
}

fn turning(simulator: &Simulator, sweep: Sweep) -> BackgroundSweep {
    let drive = Drive::open(&settings(simulator, 2000), &table()).expect("opened");
    BackgroundSweep::start(drive, sweep, false).expect("a sweep that it can do")
}

fn swept(simulator: &Arc<Simulator>, source: Free, clock: Clock) -> MotorTracked {
    MotorTracked::new(Box::new(source), turning(simulator, SWEEP), MotorTrackingOptions { clock, holds: false })
}

const ARRIVAL: Clock = Clock::Arrival { delay: 0.0 };

/// Frames until so many volumes are complete, or the end.
fn frames(swept: &mut MotorTracked, volumes: u64) -> (Vec<Frame>, Option<Option<String>>) {
    let (mut frames, begun) = (Vec::new(), Instant::now());
    while swept.counts().whole < volumes && begun.elapsed() < Duration::from_secs(120) {
        match swept.next(Duration::from_millis(50)) {
            Event::Frame(frame) => frames.push(frame),
            Event::Lines { .. } => panic!("only whole frames"),
            Event::End(why) => return (frames, Some(why)),
            Event::Begin(_) | Event::Fault(_) | Event::Idle => {}
        }
    }
    (frames, None)
}

fn angle_of(frame: &Frame) -> f64 {
    f64::from_le_bytes(*frame.bytes.first_chunk().expect("at least an angle"))
}

/// Most frames show their own slice, in their own direction, and forward and backward sweeps have no lag.
fn hold_against_the_truth(frames: &[Frame], filled: u64) {
    let middle = |frame: &Frame| (frame.slice as f64 - (SLICES as f64 - 1.0) / 2.0) * PITCH;
    let off = |frame: &Frame| angle_of(frame) - middle(frame);
    let wrong = frames.iter().filter(|f| off(f).abs() > PITCH / 2.0 + 0.4).count();
    assert!(wrong <= filled as usize + frames.len() / 10, "{wrong} of {}, {filled} filled", frames.len());
    for backward in [false, true] {
        let mut all: Vec<f64> = frames.iter().filter(|f| f.backward == backward).map(off).collect();
        all.sort_by(f64::total_cmp);
        let median = all[all.len() / 2];
        assert!(median.abs() < 0.4, "{median} deg beside their slices, backward: {backward}");
    }
    for frame in frames {
        assert_eq!(frame.backward, frame.volume % 2 == 1, "forth first");
        let step = if frame.backward { SLICES - 1 - frame.slice } else { frame.slice };
        assert_eq!(frame.number as usize, step);
    }
}

#[test]
fn volumes_are_complete_with_the_slices_and_directions_of_the_array() {
    let one = |pieces: bool, clock: Clock| {
        let simulator = Arc::new(simulated(None));
        let mut swept = swept(&simulator, Free { pieces, ..Free::new(&simulator) }, clock);
        let Event::Begin(header) = swept.next(Duration::from_secs(1)) else { panic!("begins with its header") };
        let (Geometry::Sweep(forth), Geometry::Sweep(back)) = (&header.forward, &header.backward) else { panic!() };
        let (Advance::Same(way), Advance::Same(way_back)) = (&forth.advance, &back.advance) else { panic!() };
        // About 13 deg/s for 10 ms.
        assert!((way.to_degrees() - 0.13).abs() < 0.02 && way == &-way_back, "{way}");
        let (frames, end) = frames(&mut swept, 3);
        let counts = swept.counts();
        // Where the host of the simulation is too busy, its motor stands still.
        if end.as_ref().is_some_and(|why| why.as_ref().is_some_and(|why| why.contains("has stalled"))) {
            return false;
        }
        assert_eq!(end, None, "{counts}");
        assert!(counts.early > 0 && counts.whole >= 3, "{counts}");
        hold_against_the_truth(&frames, counts.filled);
        let of_first: Vec<u32> = frames.iter().map(|f| f.volume).collect();
        assert!(of_first.is_sorted());
        drop(swept);
        assert!(stopped_at_last(&simulator.received()));
        assert!(eventually(|| !simulator.is_moving()));
        true
    };
    std::thread::scope(|scope| {
        for (pieces, clock) in [(false, ARRIVAL), (true, ARRIVAL), (false, Clock::Stamp)] {
            scope.spawn(move || assert!((0..5).any(|_| one(pieces, clock)), "stalled five times"));
        }
    });
}

#[test]
fn a_fault_of_the_motor_ends_the_stream_with_the_motor_stopped() {
    let one = |fault: &str, named: &[&str], told: bool| {
        let simulator = Arc::new(simulated(Some(fault)));
        let mut swept = swept(&simulator, Free::new(&simulator), ARRIVAL);
        let (_, end) = frames(&mut swept, u64::MAX);
        let why = end.flatten().unwrap_or_else(|| panic!("{fault}: no reason"));
        assert!(named.iter().all(|n| why.contains(n)) && why.lines().count() == 1, "{fault}: {why}");
        assert!(matches!(swept.next(Duration::ZERO), Event::End(Some(again)) if again == why));
        if told {
            assert!(stopped_at_last(&simulator.received()), "{fault}");
            assert!(eventually(|| !simulator.is_moving()), "{fault}");
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(|| one("stall", &["home: the motor has stalled", "The motor was stopped"], true));
        scope.spawn(|| one("stall@1", &["sweep: the motor has stalled at", "The motor was stopped"], true));
        scope.spawn(|| one("limit-switch@1", &["right limit switch", "The motor was stopped"], true));
        scope.spawn(|| one("unplugged@1", &["the port is gone", "could not be stopped", "cut its power"], false));
    });
}

#[test]
fn dropping_the_source_stops_the_motor_while_it_looks_for_home_too() {
    let simulator = Arc::new(simulated(None));
    let mut source = swept(&simulator, Free::new(&simulator), ARRIVAL);
    assert!(eventually(|| simulator.is_moving()), "it looks for home");
    assert!(matches!(source.next(Duration::ZERO), Event::Begin(_)));
    drop(source);
    assert!(stopped_at_last(&simulator.received()));
    assert!(eventually(|| !simulator.is_moving()));
}

#[test]
fn frames_without_a_motor_position_are_reported_at_once() {
    let simulator = Arc::new(simulated(None));
    for (motion, named) in
        [(Motion::Translated, "kind = 'fan'"), (Motion::Fan { wobble_radius: 25.0 }, "no volume will be complete")]
    {
        let wide = Axis::centred(20f64.to_radians(), 9);
        let header = header(Probe { motion, slices: wide, ..probe() });
        let mut source = swept(&simulator, Free { header: Some(header), ..Free::new(&simulator) }, ARRIVAL);
        let said = (0..100).find_map(|_| match source.next(Duration::from_millis(50)) {
            Event::Fault(said) | Event::End(Some(said)) => Some(said),
            _ => None,
        });
        assert!(said.as_ref().is_some_and(|s| s.contains(named)), "{said:?}");
    }
    assert!(eventually(|| !simulator.is_moving()));
}

/// The frames of the phantom lose their positions and are put back in place.
#[test]
fn the_phantom_on_a_free_running_array_is_reassembled() {
    let simulator = simulated(None);
    let sweep = Sweep { angle: 64.0, rate: 0.5, volumes: None };
    let motor = turning(&simulator, sweep);
    let options = phantom::PhantomOptions { volumes: 2, lines: 64, samples: 32, ..phantom::PhantomOptions::default() };
    let whole = FreeRunning::phantom(options.clone(), motor.speed()).expect("a phantom");
    let known: Vec<Vec<Frame>> = (0..2).map(|volume| whole.volume(volume)).collect();
    let source = FreeRunning::new(whole, motor.positions().clone());
    let mut swept = MotorTracked::new(Box::new(source), motor, MotorTrackingOptions { clock: ARRIVAL, holds: false });
    let (frames, end) = frames(&mut swept, 2);
    assert_eq!(end, None);
    let right = |frame: &&Frame| {
        let wanted = known[frame.volume as usize % 2].iter().find(|k| k.slice == frame.slice);
        wanted.is_some_and(|w| w.bytes == frame.bytes && w.backward == frame.backward)
    };
    let (right, all) = (frames.iter().filter(right).count(), frames.len());
    // A frame whose first line is between two slices may be put into the other one.
    assert!(all >= 74 && right * 5 >= all * 4, "{right} of {all} are where they were taken");
}
