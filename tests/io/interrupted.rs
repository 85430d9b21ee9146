//! A signal to a program that renders what a motor sweeps. It runs in a process of its own: the signal is for the whole process.
#![cfg(target_os = "linux")]

use crate::common::files::Folder;
use crate::common::motor::{settings, simulated, stopped_at_last, table};
use crate::common::own_process;
use echolume::low_level::live::Feed;
use echolume::low_level::probe::motor::{BackgroundSweep, Drive, Sweep};
use echolume::low_level::source::live::Event;
use echolume::low_level::source::motor_tracking::{self, Clock, FreeRunning, MotorTracked};
use echolume::low_level::source::phantom;
use echolume::low_level::source::recorder::Reader;
use rustix::process::{Signal, getpid, kill_process};
use std::time::{Duration, Instant};

#[test]
fn a_signal_stops_the_motor_and_ends_the_stream_with_a_finished_recording() {
    if !own_process::is_child() {
        let test = "interrupted::a_signal_stops_the_motor_and_ends_the_stream_with_a_finished_recording";
        own_process::passes(&mut own_process::command(test));
        return;
    }
    let folder = Folder::new("interrupted");
    let file = folder.join("exam.frames");
    let simulator = simulated(None);
    let drive = Drive::open(&settings(&simulator, 2000), &table()).expect("opened");
    let sweep = Sweep { angle: 64.0, rate: 0.5, volumes: None };
    let motor = BackgroundSweep::start(drive, sweep, false).expect("a sweep that it can do");
    let options = phantom::PhantomOptions { volumes: 2, lines: 16, samples: 16, ..phantom::PhantomOptions::default() };
    let phantom = FreeRunning::phantom(options, motor.speed()).expect("a phantom");
    let source = FreeRunning::new(phantom, motor.positions().clone());
    let options = motor_tracking::MotorTrackingOptions { clock: Clock::Arrival { delay: 0.0 }, holds: false };
    let feed = Feed::new(Box::new(MotorTracked::new(Box::new(source), motor, options)), Some(&file)).expect("a thread");

    let (begun, mut frames) = (Instant::now(), 0);
    let end = loop {
        match feed.next(Duration::from_millis(100)).map(|arrived| arrived.event) {
            Some(Event::Frame(_)) => {
                frames += 1;
                if frames == 20 {
                    // Not SIGINT: a shell ignores it for background processes.
                    kill_process(getpid(), Signal::TERM).expect("a signal");
                }
            }
            Some(Event::End(why)) => break why,
            _ => assert!(begun.elapsed() < Duration::from_secs(60), "{frames} frames, and no end"),
        }
    };
    assert_eq!(end, None, "nothing has failed");
    assert!(stopped_at_last(&simulator.received()), "the motor was told to stop");
    drop(feed);
    let replay = Reader::open(&file).expect("a recording");
    assert!(!replay.rebuilt() && replay.frames() >= 20, "{} frames", replay.frames());
}
