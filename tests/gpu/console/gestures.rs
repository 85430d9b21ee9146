//! From input to picture: the same, byte for byte, as one drawn from the same settings by a separate renderer.

use super::*;
use echolume::low_level::source::recorder::Reader;

/// Prevents a drag that ends elsewhere than the pointer, and a reset that does not restore the start.
#[test]
fn a_drag_turns_the_picture_and_a_reset_brings_back_the_first_one() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    let first = desk.live(0);
    assert!(first == headless(&device, &desk.drawn(), &body(0)), "at the start");
    let middle = [40.0, 36.0];
    for (tool, from, to) in [
        ('t', middle, [60.0, 20.0]),
        ('l', middle, [20.0, 50.0]),
        // A face of the region, dragged inwards.
        ('g', [70.0, 36.0], [36.0, 36.0]),
        ('x', middle, [40.0, 2.0]),
    ] {
        desk.press(Key::Char(tool));
        desk.rest();
        let before = desk.picture();
        desk.drag(from, to);
        desk.rest();
        let after = desk.picture();
        assert!(after != before, "a drag with {tool} does nothing");
        assert!(after == headless(&device, &desk.drawn(), &body(0)), "after a drag with {tool}");
    }
    desk.console.input(&Input::Scroll(3.0));
    desk.rest();
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "closer");
    // A drag changes no setting of the picture.
    desk.press(Key::Backspace);
    desk.press(Key::Char('t'));
    desk.rest();
    assert!(desk.picture() == first);
}

/// The places of the next seven volumes of a loop that plays.
fn played(desk: &mut Desk) -> Vec<usize> {
    let (mut places, begun, mut now) = (Vec::new(), Instant::now(), Instant::now());
    while places.len() < 7 {
        assert!(begun.elapsed() < BOUND, "{places:?}");
        let next = desk.tick(now);
        let stream = desk.console.stream();
        if stream.is_idle() {
            places.extend(stream.cine_position().filter(|place| places.last() != Some(place)));
            // The requested wake-up happens at once.
            now = next.wake_at.expect("a loop goes on").max(now);
        }
    }
    places
}

/// Prevents volumes that the keys of the cine loop skip or show twice, and a loop that does not advance.
#[test]
fn the_keys_of_time_freeze_look_back_and_play() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    let seen: Vec<_> = (0..3).map(|number| desk.live(number)).collect();
    desk.press(Key::Space);
    desk.frames(body(3));
    desk.rest();
    assert!(desk.console.stream().is_frozen() && desk.picture() == seen[2], "frozen");
    for (key, place) in [
        (Key::Left, 1),
        (Key::Left, 0),
        (Key::Left, 0),
        (Key::Right, 1),
        (Key::End, 2),
        (Key::Right, 2),
        (Key::Home, 0),
    ] {
        desk.press(key);
        desk.rest();
        assert!(
            desk.console.stream().cine_position() == Some(place) && desk.picture() == seen[place],
            "{key:?}: {place}"
        );
    }
    // A step counts from the volume that was asked for, also before that is shown.
    for _ in 0..2 {
        desk.press(Key::Right);
        while desk.console.stream().is_replaying() {
            desk.tick(Instant::now());
        }
    }
    assert_eq!(desk.console.stream().cine_position(), Some(2));
    desk.press(Key::Enter);
    let places = played(&mut desk);
    assert!(places.windows(2).all(|w| w[1] == (w[0] + 1) % 3), "{places:?}");
    desk.press(Key::Enter);
    desk.press(Key::Space);
    assert!(!desk.console.stream().is_frozen());
    assert!(desk.live(4) == headless(&device, &desk.drawn(), &body(4)));
}

/// Prevents a saved picture that differs from the shown one, and a loop that lacks a frame.
#[test]
fn exported_files_are_what_was_shown_and_recorded() {
    let (device, folder) = (Device::new(), Folder::new("saved"));
    let mut desk = Desk::new(&device, ConsoleOptions { folder: folder.0.clone(), ..options() });
    // An export without a picture is no fault.
    desk.held(CONTROL, Key::Char('i'));
    desk.held(CONTROL, Key::Char('r'));
    desk.begin();
    let seen: Vec<_> = (0..3).map(|number| desk.live(number)).collect();
    desk.press(Key::Left);
    desk.rest();
    desk.held(CONTROL, Key::Char('i'));
    desk.held(CONTROL, Key::Char('r'));
    assert!(folder.wait("png", |file| Picture::load(file).ok()) == seen[1]);
    let mut replay = folder.wait("frames", |file| Reader::open(file).ok().filter(|r| !r.rebuilt() && r.frames() == 27));
    assert!(*replay.header() == header(0.3));
    use echolume::low_level::source::Source;
    for expected in (0..3).flat_map(body).collect::<Vec<_>>().chunks(9) {
        let mut expected = expected.to_vec();
        expected.sort_by_key(|frame| frame.slice);
        for frame in expected {
            let got = replay.next_frame().expect("read").expect("there");
            assert!((got.volume, got.slice, got.backward) == (frame.volume, frame.slice, frame.backward));
            assert!(got.bytes == frame.bytes);
        }
    }
    desk.rest();
}

/// Prevents a loop that plays or saves volumes beyond its marks.
#[test]
fn a_trimmed_loop_is_played_back_and_forth_and_saved() {
    use echolume::low_level::source::Source;
    let (device, folder) = (Device::new(), Folder::new("trimmed"));
    let mut desk = Desk::new(&device, ConsoleOptions { folder: folder.0.clone(), ..options() });
    desk.begin();
    (0..5).for_each(|number| _ = desk.live(number));
    let shift = Modifiers { shift: true, ..Modifiers::default() };
    desk.press(Key::Home);
    desk.press(Key::Right);
    desk.held(shift, Key::Home);
    desk.press(Key::End);
    desk.press(Key::Left);
    desk.held(shift, Key::End);
    desk.held(shift, Key::Enter);
    desk.press(Key::Enter);
    let places = played(&mut desk);
    let first_end = places.iter().position(|place| *place == 1).expect("the loop reaches its begin");
    assert_eq!(places[first_end..][..4], [1, 2, 3, 2], "{places:?}");
    desk.press(Key::Enter);
    desk.held(CONTROL, Key::Char('r'));
    let mut saved = folder.wait("frames", |file| Reader::open(file).ok().filter(|r| !r.rebuilt()));
    let volumes: Vec<u32> =
        std::iter::from_fn(|| saved.next_frame().expect("read")).map(|frame| frame.volume).collect();
    assert_eq!(volumes, [[1; 9], [2; 9], [3; 9]].concat());
    desk.rest();
    // Two volumes are in no file.
    desk.press(Key::Char('q'));
    assert!(desk.console.asks_to_leave());
}

/// Prevents panels next to the picture from changing it.
#[test]
fn panels_take_space_and_change_nothing_else() {
    let device = Device::new();
    let mut desk = Desk::new(&device, ConsoleOptions { panels: true, scale: 0.5, ..options() });
    desk.begin();
    desk.live(0);
    for size in [[400, 240], [60, 50], [1, 1], [0, 0], [417, 233]] {
        desk.console.resize(size);
        desk.rest();
        let picture = desk.picture();
        assert_eq!([picture.width, picture.height], desk.drawn().picture.size);
        assert!(picture == headless(&device, &desk.drawn(), &body(0)), "{size:?}");
    }
    let beside = desk.drawn().picture.size;
    desk.press(Key::Function(3));
    desk.rest();
    assert!(desk.drawn().picture.size == [417, 233] && beside[0] < 417 && beside[1] < 233);
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)));
    desk.console.execute(&Command::ToggleHelp, Instant::now());
    desk.press(Key::Function(2));
    desk.rest();
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)));
}

/// What the brush went over is gone, the picture is that of a separate renderer with the same settings, and undo brings it back.
#[test]
fn a_brush_removes_what_it_goes_over() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    let first = desk.live(0);
    desk.press(Key::Char('z'));
    desk.rest();
    desk.drag([32.0, 36.0], [48.0, 36.0]);
    desk.rest();
    let cuts = desk.console.controls().settings().cuts.clone();
    let brush = cuts.first().and_then(|cut| cut.brush.as_ref()).expect("a brush");
    assert!(cuts.len() == 1 && brush.points() > 1 && brush.radius == 4.0, "{cuts:?}");
    let brushed = desk.picture();
    assert!(brushed != first, "nothing is removed");
    assert!(brushed == headless(&device, &desk.drawn(), &body(0)));
    desk.held(Modifiers { control: true, ..Modifiers::default() }, Key::Char('z'));
    desk.rest();
    assert!(desk.picture() == first, "taken back");
    // Without a surface there is nothing to brush.
    desk.press(Key::Char('2'));
    desk.rest();
    desk.drag([32.0, 36.0], [48.0, 36.0]);
    desk.rest();
    assert!(desk.console.controls().settings().cuts.is_empty());
}
