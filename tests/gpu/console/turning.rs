//! The turntable of the view.

use super::*;
use echolume::low_level::scene::Mode;

const KEY: Modifiers = Modifiers { shift: true, control: false, alt: false };

/// It turns about the upright axis at its speed, picture by picture, until a hand turns it; then the view rests at the picture of its settings.
#[test]
fn the_view_turns_by_itself_until_it_is_turned_by_hand() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.console.resize(SIZE);
    desk.begin();
    desk.live(0);
    let azimuth = |desk: &Desk| desk.console.controls().settings().camera.azimuth;
    for stops in [Some(Key::Char('t')), Some(Key::Escape), None] {
        let before = azimuth(&desk);
        desk.held(KEY, Key::Char('t'));
        let (begun, mut turned, mut wakes) = (Instant::now(), 0.0, true);
        while turned < 4.0 {
            assert!(begun.elapsed() < BOUND, "it does not turn");
            wakes &= desk.tick(Instant::now()).wake_at.is_some();
            turned = (azimuth(&desk) - before).rem_euclid(360.0);
        }
        assert!(wakes, "it goes on without events");
        let at_most = 30.0 * begun.elapsed().as_secs_f64() + 1e-6;
        assert!(turned <= at_most, "{turned} of {at_most} degrees");
        let mut still = azimuth(&desk);
        match stops {
            Some(Key::Escape) => desk.press(Key::Escape),
            Some(key) => desk.held(KEY, key),
            None => {
                desk.console.execute(&Command::Rotate([5.0, 0.0]), Instant::now());
                still += 5.0;
            }
        }
        desk.rest();
        let apart = (azimuth(&desk) - still + 180.0).rem_euclid(360.0) - 180.0;
        assert!(apart.abs() < 1e-6, "{stops:?}: it turned by {apart} more");
        assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "{stops:?}");
    }
    // Planes do not turn.
    desk.console.execute(&Command::Mode(Mode::Plane), Instant::now());
    desk.rest();
    desk.held(KEY, Key::Char('t'));
    let settings = desk.console.controls().settings().clone();
    desk.rest();
    assert_eq!(desk.console.controls().settings(), &settings);
}
