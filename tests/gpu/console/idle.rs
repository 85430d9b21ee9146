//! An idle console, and how it becomes idle: no unneeded work, and the final picture has full quality.

use super::*;

/// Prevents a kiosk that runs hot all night: an unchanging picture causes no dispatch and no wake-up.
#[test]
fn an_idle_console_dispatches_nothing_and_asks_for_no_wake_up() {
    let device = Device::alone();
    for (overlay, panels, hud) in [(true, false, false), (false, false, false), (true, true, true)] {
        let mut desk = Desk::new(&device, ConsoleOptions { overlay, panels, scale: 0.5, ..options() });
        desk.console.resize([400, 240]);
        desk.begin();
        desk.live(0);
        if hud {
            desk.press(Key::Function(2));
        }
        desk.drag([150.0, 100.0], [160.0, 90.0]);
        desk.rest();
        let dispatches = desk.console.stream().dispatches();
        let (mut now, mut woken) = (Instant::now() + LATER, 0);
        // Ten minutes of simulated time, from one requested wake-up to the next.
        let end = now + Duration::from_secs(600);
        while now < end {
            let next = desk.tick(now);
            woken += 1;
            match next.wake_at {
                None => break,
                Some(at) => {
                    assert!(at > now, "again at once: overlay {overlay}, panels {panels}");
                    now = at;
                }
            }
        }
        // The display of times updates once a second; a note disappears, and the missing source is reported.
        assert!(woken < if hud { 650 } else { 12 }, "{woken} times: overlay {overlay}, panels {panels}");
        for _ in 0..50 {
            desk.tick(now);
        }
        assert_eq!(desk.console.stream().dispatches(), dispatches);
    }
}

/// Prevents a view that stays coarse, and one that is slow during a drag because it is fine.
#[test]
fn an_exceeded_frame_budget_lowers_quality_only_during_interaction() {
    let device = Device::alone();
    let mut settings = plain();
    settings.light.shadow = Some(Default::default());
    let budget = Some(Duration::from_nanos(1));
    let mut desk = Desk::new(&device, ConsoleOptions { settings, budget, ..options() });
    desk.begin();
    desk.live(0);
    let last = built_in_ladder().len() - 1;
    let mut coarse = 0;
    desk.console.input(&Input::Moved([40.0, 36.0]));
    desk.console.input(&Input::Button { button: Button::Left, pressed: true });
    for n in 0..60 {
        // The time of the input, however slow the machine is.
        let now = Instant::now();
        desk.console.input(&Input::Moved([40.0 + f64::from(n % 20), 36.0 - f64::from(n % 13)]));
        desk.tick(now);
        // The pointer first leaves the range of a click, and the first picture measures the time.
        assert!(n < 12 || desk.console.quality().rays == last, "{n}: {:?}", desk.console.quality());
        let begun = Instant::now();
        while desk.console.stream().is_drawing() && begun.elapsed() < BOUND {
            desk.tick(now);
        }
        let drawn = desk.drawn();
        coarse += u32::from(
            desk.console.stream().scene().is_some_and(|s| s.settings.ray.subsampling > 1 && s.settings != drawn),
        );
    }
    desk.console.input(&Input::Button { button: Button::Left, pressed: false });
    desk.rest();
    assert_eq!(desk.console.quality(), Quality::default());
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "{coarse} coarse pictures");
}
