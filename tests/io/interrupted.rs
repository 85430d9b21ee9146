//! A signal to a program that renders what a motor sweeps. It runs in a process of its own: the signal is for the whole process.
#![cfg(target_os = "linux")]

use echolume::live::Feed;
use echolume::probe::motor::simulate::{Options, Simulator};
use echolume::probe::motor::tmcl::command;
use echolume::probe::motor::{Drive, MotorTable, Settings, Sweep, Turning};
use echolume::source::live::Event;
use echolume::source::phantom;
use echolume::source::recorder::Replay;
use echolume::source::swept::{self, Clock, FreeRunning, Swept};
use rustix::process::{Signal, getpid, kill_process};
use std::time::{Duration, Instant};

#[test]
fn a_signal_stops_the_motor_and_ends_the_stream_with_a_finished_recording() {
    if std::env::var_os("INTERRUPTED_ALONE").is_none() {
        let mut child = std::process::Command::new(std::env::current_exe().expect("this program"));
        child.args(["interrupted::a_signal_stops_the_motor_and_ends_the_stream_with_a_finished_recording", "--exact"]);
        let output = child.env("INTERRUPTED_ALONE", "1").output().expect("it runs");
        let out = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && out.contains("1 passed"), "{out}");
        return;
    }
    let folder = std::env::temp_dir().join(format!("echolume-interrupted-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("exam.frames");
    let simulator = Simulator::start(Options::default()).expect("a pseudo-terminal");
    let settings =
        Settings { timeout: Duration::from_secs(2), ..Settings::new(simulator.path().to_str().expect("a plain name")) };
    let drive = Drive::open(&settings, &MotorTable::default()).expect("opened");
    let sweep = Sweep { angle: 64.0, rate: 0.5, volumes: None };
    let motor = Turning::start(drive, sweep, false).expect("a sweep that it can do");
    let options = phantom::Options { volumes: 2, lines: 16, samples: 16, ..phantom::Options::default() };
    let phantom = FreeRunning::phantom(options, motor.speed()).expect("a phantom");
    let source = FreeRunning::new(phantom, motor.watch().clone());
    let options = swept::Options { clock: Clock::Arrival { delay: 0.0 }, holds: false };
    let feed = Feed::new(Box::new(Swept::new(Box::new(source), motor, options)), Some(&file)).expect("a thread");

    let (begun, mut frames) = (Instant::now(), 0);
    let end = loop {
        match feed.next(Duration::from_millis(100)).map(|arrived| arrived.event) {
            Some(Event::Frame(_)) => {
                frames += 1;
                if frames == 20 {
                    // Not SIGINT: what a shell starts in the background has that ignored.
                    kill_process(getpid(), Signal::TERM).expect("a signal");
                }
            }
            Some(Event::End(why)) => break why,
            _ => assert!(begun.elapsed() < Duration::from_secs(60), "{frames} frames, and no end"),
        }
    };
    assert_eq!(end, None, "nothing has failed");
    let received = simulator.received();
    let last = |what: &dyn Fn(u8) -> bool| received.iter().rposition(|r| what(r.command));
    assert!(last(&|c| c == command::STOP) > last(&|c| c == command::MOVE_TO), "the motor was told to stop");
    drop(feed);
    let replay = Replay::open(&file).expect("a recording");
    assert!(!replay.rebuilt() && replay.frames() >= 20, "{} frames", replay.frames());
    let _ = std::fs::remove_dir_all(folder);
}
