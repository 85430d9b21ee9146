//! Lost sources and devices of a console, and how to exit it.

use super::*;
use ash::vk;
use echolume::low_level::gpu::faults::InjectionPoint;
use echolume::low_level::kiosk::chord::Chord;

/// Prevents a console that ends with its probe, or does not find it again by itself.
#[test]
fn a_lost_source_is_awaited_and_the_picture_stays() {
    let device = Device::alone();
    let sources = Arc::new(Mutex::new(Vec::new()));
    let mut options = options();
    options.retry = Some(Duration::from_millis(20));
    let mut desk = Desk::of(&device, options, sources.clone());
    // No source at first.
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(60) {
        let next = desk.tick(Instant::now());
        assert!(!next.exit && !next.restart);
    }
    let mut last = None;
    for (number, why) in [(0, None), (1, Some("cut".to_string())), (2, None)] {
        let (say, said) = channel();
        desk.say = say;
        sources.lock().expect("lock").push(said);
        desk.begin();
        let picture = desk.live(number % 2);
        assert!(picture == headless(&device, &desk.drawn(), &body(number % 2)), "source {number}");
        desk.say.send(Event::End(why)).expect("listens");
        desk.rest();
        assert!(desk.picture() == picture, "what was shown stays");
        last = Some(picture);
    }
    // A drag rotates the picture, with or without a source.
    desk.console.execute(&Command::Rotate([20.0, 5.0]), Instant::now());
    desk.rest();
    assert!(last.as_ref() != Some(&desk.picture()));
    assert_eq!(desk.console.stream().cine().volumes().len(), 3, "volumes of three sources");
}

/// Prevents an accidental touch from ending a kiosk, and a kiosk that cannot be ended.
#[test]
fn a_kiosk_is_left_by_its_chord_alone_and_a_window_by_escape() {
    let device = Device::alone();
    let chord = Chord::parse("ctrl+alt+q").expect("keys");
    let (all, none) = (Modifiers { control: true, alt: true, shift: false }, Modifiers::default());
    for is_kiosk in [true, false] {
        let mut desk = Desk::new(&device, ConsoleOptions { is_kiosk, exit: is_kiosk.then_some(chord), ..options() });
        let half = Modifiers { control: true, ..none };
        for (held, key, exits) in [
            (none, Key::Char('q'), !is_kiosk),
            (none, Key::Escape, !is_kiosk),
            (half, Key::Char('q'), false),
            (Modifiers { shift: true, ..all }, Key::Char('q'), false),
            (all, Key::Char('q'), is_kiosk),
        ] {
            desk.held(held, key);
            assert_eq!(desk.tick(Instant::now()).exit, exits, "{held:?} {key:?}, kiosk: {is_kiosk}");
            assert!(!desk.tick(Instant::now()).exit, "once is once");
        }
        desk.press(Key::Function(11));
        assert_eq!(desk.tick(Instant::now()).toggle_full_screen, !is_kiosk);
    }
}

/// Prevents a console that ends with its device, or shows something else on the next one.
#[test]
fn a_lost_device_is_reported_and_the_next_one_shows_the_same() {
    for (seam, is_frozen) in
        [(InjectionPoint::Submit, true), (InjectionPoint::Submit, false), (InjectionPoint::Wait, true)]
    {
        let (device, other) = (Device::alone(), Device::alone());
        let mut desk = Desk::new(&device, options());
        desk.begin();
        let seen: Vec<_> = (0..3).map(|number| desk.live(number)).collect();
        let shown = if is_frozen { 1 } else { 2 };
        if is_frozen {
            desk.press(Key::Left);
            desk.rest();
        }
        assert!(desk.picture() == seen[shown]);
        device.faults.inject(seam, 0, vk::Result::ERROR_DEVICE_LOST);
        desk.console.execute(&Command::Rotate([1.0, 0.0]), Instant::now());
        let lost = desk.rest_or_lost().expect_err("lost");
        assert!(matches!(&lost, ConsoleError::DeviceLost(error) if error.is_device_lost()), "{lost}");
        desk.console.execute(&Command::Reset, Instant::now());
        desk.console.revive(&other, None).expect("made anew");
        desk.rest();
        assert!(desk.picture() == seen[shown], "{seam:?}, frozen: {is_frozen}");
        assert_eq!(desk.console.stream().is_frozen(), is_frozen);
        if is_frozen {
            desk.press(Key::Space);
        }
        assert!(desk.live(3) == headless(&other, &desk.drawn(), &body(3)), "{seam:?}, frozen: {is_frozen}");
    }
}

/// Prevents a console that stands still with a device that does not finish.
#[test]
fn a_hung_device_is_given_up_and_the_next_one_shows_the_same() {
    let (device, other) = (Device::impatient(), Device::alone());
    let folder = Folder::new("stall");
    let file = folder.path("a.prom");
    let mut desk = Desk::new(&device, ConsoleOptions { prometheus: Some(file.clone().into()), ..options() });
    desk.begin();
    let seen: Vec<_> = (0..2).map(|number| desk.live(number)).collect();
    desk.press(Key::Space);
    device.faults.hang(0);
    desk.console.execute(&Command::Rotate([1.0, 0.0]), Instant::now());
    let lost = desk.rest_or_lost().expect_err("given up");
    assert!(matches!(&lost, ConsoleError::DeviceLost(error) if error.is_given_up()), "{lost}");
    desk.console.execute(&Command::Reset, Instant::now());
    desk.console.revive(&other, None).expect("made anew");
    desk.rest();
    assert!(desk.picture() == seen[1] && device.is_given_up());
    desk.console.end_metrics();
    let told = std::fs::read_to_string(&file).expect("metrics");
    for line in
        ["echolume_device_losses_total 1", "echolume_device_stalls_total 1", "echolume_frozen 0", "echolume_running 0"]
    {
        assert!(told.lines().any(|told| told == line), "{line}: {told}");
    }
}

/// Prevents a console that stays black because memory ran out at the wrong moment.
#[test]
fn running_out_of_memory_anywhere_is_recovered() {
    let device = Device::alone();
    let mut reached = 0;
    for n in (0..60).step_by(8) {
        let sources = Arc::new(Mutex::new(Vec::new()));
        let mut desk =
            Desk::of(&device, ConsoleOptions { retry: Some(Duration::from_millis(5)), ..options() }, sources.clone());
        device.faults.inject(InjectionPoint::Allocate, n, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        // A reopened source sends everything again, and no source ends by itself.
        let mut speak = Vec::new();
        for _ in 0..4 {
            let (say, said) = channel();
            say.send(Event::Begin(Box::new(header(0.3)))).expect("listens");
            body(0).into_iter().for_each(|frame| say.send(Event::Frame(frame)).expect("listens"));
            sources.lock().expect("lock").push(said);
            speak.push(say);
        }
        let begun = Instant::now();
        while desk.console.stream().volumes_shown() == 0 {
            assert!(begun.elapsed() < BOUND, "nothing is shown after allocation {n} failed");
            desk.tick(Instant::now() + LATER);
        }
        desk.rest();
        reached += usize::from(sources.lock().expect("lock").len() < 3);
        device.faults.inject(InjectionPoint::Wait, u32::MAX, vk::Result::SUCCESS);
        assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "allocation {n}");
    }
    assert!(reached > 2, "{reached}");
}

/// Prevents a key that leaves the program while help is open, and a loop of a probe that is lost by one key.
#[test]
fn escape_closes_what_is_open_and_leaving_asks_for_a_loop_that_is_not_saved() {
    let (device, folder) = (Device::alone(), Folder::new("leaving"));
    let mut desk = Desk::new(&device, ConsoleOptions { folder: folder.0.clone(), ..options() });
    let escape = |desk: &mut Desk| {
        desk.press(Key::Escape);
        let request = desk.tick(Instant::now());
        (request.exit, request.toggle_full_screen)
    };
    desk.console.set_full_screen(true);
    desk.press(Key::Char('h'));
    desk.press(Key::Function(2));
    assert_eq!(escape(&mut desk), (false, false), "it closes the help");
    assert_eq!(escape(&mut desk), (false, false), "it closes the times");
    assert_eq!(escape(&mut desk), (false, true), "it leaves full screen");
    desk.console.set_full_screen(false);
    assert_eq!(escape(&mut desk), (true, false), "nothing was recorded: it leaves");
    desk.begin();
    let picture = desk.live(0);
    assert_eq!(escape(&mut desk), (false, false));
    assert!(desk.console.asks_to_leave());
    // Other keys do nothing while it asks.
    desk.press(Key::Char('q'));
    desk.press(Key::Char('4'));
    desk.rest();
    assert!(desk.console.asks_to_leave() && desk.picture() == picture);
    assert_eq!(escape(&mut desk), (false, false));
    assert!(!desk.console.asks_to_leave(), "it stays");
    desk.press(Key::Char('q'));
    desk.press(Key::Char('l'));
    assert!(desk.tick(Instant::now()).exit, "without saving");
    desk.press(Key::Char('q'));
    desk.press(Key::Enter);
    let begun = Instant::now();
    while !desk.tick(Instant::now()).exit {
        assert!(begun.elapsed() < BOUND, "it is never saved");
    }
    folder.wait("frames", |_| Some(()));
    assert_eq!(escape(&mut desk), (true, false), "it is saved: it leaves");
    desk.live(1);
    desk.press(Key::Char('q'));
    assert!(!desk.tick(Instant::now()).exit && desk.console.asks_to_leave(), "another volume came");
    // Nobody sees a question without panels.
    let mut alone = Desk::new(&device, ConsoleOptions { overlay: false, ..options() });
    alone.begin();
    alone.live(0);
    assert_eq!(escape(&mut alone), (true, false), "it leaves");
    assert!(!alone.console.asks_to_leave());
    // What was read from a file is there.
    let mut desk = Desk::new(&device, ConsoleOptions { source: SourceKind::Recording, ..options() });
    desk.begin();
    desk.live(0);
    assert_eq!(escape(&mut desk), (true, false));
}
