//! What a kiosk tells Prometheus.

use super::*;
use crate::common::wait;
use echolume::low_level::live::metrics::INTERVAL;

/// The value of a sample without labels.
fn value(told: &str, name: &str) -> f64 {
    let start = format!("echolume_{name} ");
    let value = told.lines().find_map(|line| line.strip_prefix(&start)).unwrap_or_else(|| panic!("{name}: {told}"));
    value.parse().expect("a number")
}

/// Prevents a kiosk that looks dead while it rests, and one that metrics keep awake.
#[test]
fn metrics_are_written_at_once_at_intervals_and_at_the_end() {
    let (device, folder) = (Device::alone(), Folder::new("metrics"));
    let file = folder.path("a.prom");
    let mut desk = Desk::new(&device, ConsoleOptions { prometheus: Some(file.clone().into()), ..options() });
    let begun = Instant::now();
    desk.tick(begun);
    let read = || std::fs::read_to_string(&file).unwrap_or_default();
    let wait = |until: &dyn Fn(&str) -> bool| {
        while !until(&read()) {
            assert!(begun.elapsed() < BOUND, "{}", read());
            wait::poll();
        }
    };
    wait(&|told| told.ends_with("echolume_frozen 0\n"));
    assert_eq!((value(&read(), "running"), value(&read(), "pictures_total")), (1.0, 0.0));
    desk.begin();
    desk.live(0);
    desk.rest();
    // Ten minutes of simulated time, from one requested wake-up to the next.
    let (mut now, mut woken) = (Instant::now() + INTERVAL, 0);
    let end = now + Duration::from_secs(600);
    while now < end {
        let at = desk.tick(now).wake_at.expect("the next metrics");
        assert!(at > now && at <= now + INTERVAL, "{:?}", at - now);
        (now, woken) = (at, woken + 1);
    }
    assert!((40..60).contains(&woken), "{woken}");
    wait(&|told| value(told, "pictures_total") == 1.0);
    let told = read();
    assert_eq!([value(&told, "frames_total"), value(&told, "latency_seconds_count")], [body(0).len() as f64; 2]);
    assert_eq!((value(&told, "source_connected"), value(&told, "device_losses_total")), (1.0, 0.0));
    desk.press(Key::Space);
    desk.tick(now);
    wait(&|told| value(told, "frozen") == 1.0);
    desk.console.end_metrics();
    assert_eq!((value(&read(), "running"), value(&read(), "pictures_total")), (0.0, 1.0));
    assert_eq!(folder.names().len(), 1);
}
