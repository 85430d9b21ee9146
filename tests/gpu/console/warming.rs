//! Pipelines that are compiled while the user rests, so that another mode is there at once.

use super::*;
use crate::common::wait;
use echolume::low_level::scene::{Mode, load::PRESETS, variants};
use std::sync::atomic::Ordering;

/// Longer than a user must have rested.
const RESTED: Duration = Duration::from_secs(2);

fn compiled(device: &Device) -> u64 {
    device.counts.pipelines.load(Ordering::Relaxed)
}

impl Desk {
    /// Lets the user rest until nothing is left to compile. Returns how many pipelines that made.
    fn warm_up(&mut self, device: &Device) -> u64 {
        let (before, begun) = (compiled(device), Instant::now());
        self.tick(Instant::now() + RESTED);
        assert!(self.console.stream().has_warmed());
        while self.console.stream().is_warming() {
            assert!(begun.elapsed() < BOUND, "it never ends");
            wait::poll();
            self.tick(Instant::now() + RESTED);
        }
        compiled(device) - before
    }

    /// Ticks until all is drawn, while the pointer moves: a user who acts is not taken to rest, however slow the machine is, so that nothing is compiled in
    /// advance meanwhile.
    fn draw_in_use(&mut self) {
        let begun = Instant::now();
        let mut still = 0;
        while still <= 20 {
            assert!(begun.elapsed() < BOUND, "it is never drawn");
            self.console.input(&Input::Moved([40.0 + f64::from(still % 2), 36.0]));
            self.tick(Instant::now() + LATER);
            let drawn = self.drawn();
            let stream = self.console.stream();
            let is_drawn = stream.scene().is_none_or(|scene| scene.settings == drawn);
            still = if stream.is_idle() && is_drawn { still + 1 } else { 0 };
            if still > 0 {
                wait::poll();
            }
        }
    }
}

/// Prevents a view that makes its user wait for a compiler after the first click on a mode, a layout or a preset's settings.
#[test]
fn after_a_rest_no_mode_layout_or_preset_compiles_anything() {
    let device = Device::alone();
    let mut desk = Desk::new(&device, ConsoleOptions { warms: true, ..options() });
    desk.begin();
    desk.live(0);
    let warmed = desk.warm_up(&device);
    assert!(warmed > 30, "only {warmed} pipelines were compiled in advance");
    let count = compiled(&device);
    for mode in Mode::ALL {
        desk.console.execute(&Command::Mode(mode), Instant::now());
        desk.draw_in_use();
        assert_eq!(desk.console.controls().settings().mode, mode);
        assert_eq!(compiled(&device), count, "{mode:?} is compiled when it is chosen");
    }
    desk.console.execute(&Command::Mode(Mode::Surface), Instant::now());
    for layout in [Layout::Four, Layout::Beside, Layout::Pair, Layout::Single] {
        desk.console.execute(&Command::Layout(layout), Instant::now());
        desk.draw_in_use();
        assert_eq!(desk.console.controls().settings().layout, layout);
        assert_eq!(compiled(&device), count, "{layout:?} is compiled when it is chosen");
    }
    // The settings of the presets, given to the stream as a configuration would.
    let presets =
        variants::switches(&desk.drawn(), |settings| settings).into_iter().filter(|v| v.name.starts_with("preset"));
    for variant in presets {
        let stream = desk.console.stream();
        // A preset may show what this small sweep does not have.
        let (name, begun) = (variant.name, Instant::now());
        if stream.change(variant.settings.clone()).is_err() {
            continue;
        }
        while stream.scene().expect("begun").settings != variant.settings {
            assert!(begun.elapsed() < BOUND, "{name} never comes");
            stream.step(Duration::from_millis(1)).expect("step");
        }
        assert_eq!(compiled(&device), count, "{name} is compiled when it is chosen");
    }
    assert_eq!(PRESETS.len(), 9);
    // Nothing is left to do around the same settings.
    assert_eq!(desk.warm_up(&device), 0);
}

/// Prevents warming that competes with what the user asks for, and one that is never taken up again.
#[test]
fn an_input_ends_warming_and_a_rest_takes_it_up_again() {
    let device = Device::alone();
    let begun = Instant::now();
    let mut desk = Desk::new(&device, ConsoleOptions { warms: true, ..options() });
    desk.begin();
    desk.live(0);
    let request = desk.tick(Instant::now());
    // A busy machine may take longer for its first picture than a user has to rest.
    if begun.elapsed() + LATER < RESTED / 2 {
        assert!(!desk.console.stream().has_warmed(), "before the user rests");
        assert!(request.wake_at.is_some_and(|at| at < Instant::now() + RESTED), "nobody would wake it: {request:?}");
    }
    desk.tick(Instant::now() + RESTED);
    assert!(desk.console.stream().is_warming());
    desk.console.input(&Input::Moved([40.0, 36.0]));
    assert!(!desk.console.stream().is_warming(), "an input does not end it");
    let begun = compiled(&device);
    wait::watch(Duration::from_millis(300));
    let after = compiled(&device);
    assert!(after <= begun + 1, "{} pipelines after the one in the making", after - begun);
    assert!(desk.warm_up(&device) > 20);
}

/// Prevents a kiosk that compiles and wakes up for ever: warming ends, and then nothing is due.
#[test]
fn a_warmed_console_rests() {
    let device = Device::alone();
    let mut desk = Desk::new(&device, ConsoleOptions { warms: true, overlay: false, ..options() });
    desk.begin();
    desk.live(0);
    desk.warm_up(&device);
    let now = Instant::now() + Duration::from_secs(60);
    let next = desk.tick(now);
    assert!(next.wake_at.is_none_or(|at| at > now), "{next:?}");
    assert_eq!(desk.warm_up(&device), 0);
}
