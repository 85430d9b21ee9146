//! The comparison of the shown volume with itself as it was, and with another recording.

use super::*;
use crate::common::wait;
use echolume::low_level::scene::picker::Picker;
use echolume::low_level::scene::planes::Tile;
use echolume::low_level::scene::{Input as Samples, Scene};
use echolume::low_level::source;
use echolume::low_level::source::recorder::Writer;
use echolume::low_level::ui::command::{CompareView, Link};
use echolume::low_level::ui::recordings::Recordings;
use std::path::Path;

impl Desk {
    fn does(&mut self, command: Command) {
        self.console.execute(&command, Instant::now());
    }

    /// Waits until the picture of the n-th compared volume (from 1), or that of the difference (0), is as it should be.
    fn compared(&mut self, n: usize, is_right: impl Fn(&Picture) -> bool) -> Arc<Picture> {
        let begun = Instant::now();
        loop {
            self.tick(Instant::now() + LATER);
            let shown = self.console.compared();
            if let Some(picture) = shown.into_iter().nth(n).flatten().filter(|picture| is_right(picture)) {
                return picture;
            }
            assert!(begun.elapsed() < BOUND, "picture {n}");
            wait::poll();
        }
    }
}

/// A pinned volume is drawn like the shown one, keeps its look when the shown one gets another, and gets that when the link is tied.
#[test]
fn a_volume_is_compared_with_itself_as_it_was() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    let alone = desk.live(0);
    desk.press(Key::Space);
    desk.does(Command::Compare);
    desk.rest();
    let first = desk.picture();
    // Half of the window, but no smaller than pictures are drawn.
    assert_eq!([first.width, first.height, alone.width], [64, SIZE[1], SIZE[0]]);
    let pinned = desk.compared(1, |picture| [picture.width, picture.height] == [first.width, first.height]);
    assert!(pinned.rgba == first.rgba, "both tiles show one volume");
    desk.does(Command::Shadow(true));
    desk.does(Command::Rotate([30.0, 0.0]));
    desk.rest();
    let turned = desk.picture();
    let view_alone = desk.compared(1, |picture| picture.rgba != pinned.rgba);
    assert!(view_alone.rgba != turned.rgba, "it has no shadow");
    desk.does(Command::ToggleLink(Link::Look));
    desk.compared(1, |picture| picture.rgba == turned.rgba);
    desk.does(Command::CompareView(CompareView::Difference));
    desk.rest();
    let difference = desk.compared(0, |picture| picture.width == 64);
    let equal = |pixel: &[u8]| pixel == [18, 21, 26, 255];
    assert!(difference.rgba.chunks_exact(4).all(equal), "there is none");
    desk.does(Command::Compare);
    desk.rest();
    assert!(desk.console.compared().is_empty());
    assert_eq!([desk.picture().width, desk.picture().height], SIZE);
}

/// The picture that a recording has with these settings, by the formula of its own geometry.
fn drawn(device: &Arc<Context>, recording: &str, settings: Settings) -> Picture {
    let mut source = source::open(recording.as_ref(), None).expect("a recording");
    let input = Samples { stored: source.stored_type(), range: source.range() };
    let scene = Scene::new(source.geometry(0), input, settings).expect("a scene");
    let mut renderer = Renderer::new(device, scene, &gpu::RendererOptions::default()).expect("renderer");
    while let Some(frame) = source.next_frame().expect("a frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    renderer.picture().expect("picture")
}

/// Further open recordings are drawn with the settings of the shown one, up to as many as are open.
#[test]
fn other_recordings_are_drawn_with_the_same_settings() {
    let device = Device::new();
    let recordings = Arc::new(Mutex::new(Recordings::of(SourceKind::Recording, Path::new("shown"))));
    assert!([BONE, SWEEP].iter().all(|file| recordings.lock().expect("a list").add(Path::new(file))));
    let opening = OpeningOptions { recordings, ..OpeningOptions::default() };
    let mut desk = Desk::new(&device, ConsoleOptions { opening, ..options() });
    desk.begin();
    desk.live(0);
    desk.press(Key::Char('p'));
    desk.rest();
    let settings = |desk: &mut Desk| desk.console.stream().scene().expect("begun").settings.clone();
    let expected = drawn(&device, BONE, settings(&mut desk));
    desk.compared(1, |picture| *picture == expected);
    // It is not like the shown one: the view says so, and stays.
    desk.does(Command::Align);
    desk.tick(Instant::now());
    desk.does(Command::Align);
    desk.compared(1, |picture| *picture == expected);
    assert_eq!(desk.console.compared_is_moved(), None);
    for _ in 0..2 {
        desk.does(Command::CompareFurther);
        desk.rest();
        for (n, file) in [(1, BONE), (2, SWEEP)] {
            let expected = drawn(&device, file, settings(&mut desk));
            desk.compared(n, |picture| *picture == expected);
        }
        assert_eq!(desk.console.compared().len(), 3, "the first recording is no further one");
    }
}

/// Prevents a compared loop that jumps to its first volume when its link is cut.
#[test]
fn a_loop_whose_link_is_cut_keeps_its_volume() {
    let (device, folder) = (Device::new(), Folder::new("cut-link"));
    let file = folder.0.join("loop.frames");
    let mut writer = Writer::create(&file, header(0.3)).expect("a file");
    (0..2).flat_map(body).for_each(|frame| writer.frame(&frame, 0.0).expect("written"));
    writer.finish().expect("finished");
    let recordings = Arc::new(Mutex::new(Recordings::of(SourceKind::Recording, Path::new("shown"))));
    assert!(recordings.lock().expect("a list").add(&file));
    let opening = OpeningOptions { recordings, ..OpeningOptions::default() };
    let mut desk = Desk::new(&device, ConsoleOptions { opening, ..options() });
    desk.begin();
    let first = desk.live(0);
    assert!(desk.live(1).rgba != first.rgba, "the volumes differ");
    desk.press(Key::Space);
    desk.does(Command::Compare);
    for turn in 0..4 {
        if turn == 1 {
            desk.does(Command::ToggleLink(Link::Volume));
        }
        desk.does(Command::Rotate([10.0, 0.0]));
        desk.rest();
        let newest = desk.picture();
        desk.compared(1, |picture| picture.rgba == newest.rgba);
    }
}

/// Middle of the bright pixels of a tile of planes, pixels.
fn middle_of_ball(picture: &Picture, tile: &Tile) -> [f64; 2] {
    let inner = |a: usize| tile.corner[a] + 1..tile.corner[a] + tile.size[a] - 1;
    let all = inner(1).flat_map(|y| inner(0).map(move |x| [x, y]));
    // The cross-lines are no grey.
    let is_bright = |[x, y]: &[u32; 2]| {
        let pixel = &picture.rgba[4 * (y * picture.width + x) as usize..][..3];
        pixel.iter().all(|value| *value > 100)
    };
    let bright: Vec<[u32; 2]> = all.filter(is_bright).collect();
    [0, 1].map(|a| bright.iter().map(|at| f64::from(at[a]) + 0.5).sum::<f64>() / bright.len() as f64)
}

/// A drag over the compared picture moves what is under it with the pointer, on each plane and on the rendering, and a drag back brings it back.
/// Turned about the middle of the tile, what is right of it comes below it.
#[test]
fn a_compared_volume_is_moved_by_hand() {
    let (device, folder) = (Device::new(), Folder::new("moved-by-hand"));
    let mut desk = Desk::of_ball(&device, &folder, None);
    desk.does(Command::Compare);
    desk.rest();
    let still = desk.picture();
    desk.compared(1, |picture| picture.rgba == still.rgba);
    let tiles = desk.console.stream().scene().expect("a scene").tiling().tiles.clone();
    for tile in &tiles {
        let ball = middle_of_ball(&still, tile);
        let right = [ball[0] + 4.0, ball[1]];
        let middle = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0);
        let below = [middle[0] - (right[1] - middle[1]), middle[1] + (right[0] - middle[0])];
        for (from, to, turns) in
            [(ball, [ball[0] + 4.0, ball[1] - 3.0], false), (ball, right, false), (right, below, true)]
        {
            desk.does(Command::MoveCompared(0, [from, to], turns));
            let near = |found: [f64; 2], to: [f64; 2]| (found[0] - to[0]).hypot(found[1] - to[1]) < 0.3;
            desk.compared(1, |picture| near(middle_of_ball(picture, tile), to));
            let found = desk.console.compared_is_moved().expect("it is moved");
            if !turns {
                let expected = (to[0] - from[0]).hypot(to[1] - from[1]) * tile.pixel;
                assert!((found[0] - expected).abs() < 1e-6 && found[1] < 1e-6, "{found:?}, not {expected}");
            } else {
                assert!((found[1] - 90.0).abs() < 1e-4, "{found:?}");
            }
            if to != right {
                desk.does(Command::MoveCompared(0, [to, from], turns));
            }
        }
        desk.does(Command::MoveCompared(0, [right, ball], false));
        let moved = desk.console.compared_is_moved().expect("it was moved");
        assert!(moved[0] < 1e-6 && moved[1] < 1e-4, "{moved:?}");
        desk.compared(1, |picture| picture.rgba.iter().zip(&still.rgba).all(|(a, b)| a.abs_diff(*b) <= 1));
    }
    // On the rendering, in the plane of the picture through what the camera looks at.
    let scene = desk.console.stream().scene().expect("a scene").clone();
    let from = Picker::of(&scene).centre();
    let to = Picker::of(&scene).project(scene.rays.target + 5.0 * scene.rays.right - 2.0 * scene.rays.up);
    desk.does(Command::MoveCompared(0, [from, to.expect("in front")], false));
    let moved = desk.console.compared_is_moved().expect("it is moved");
    assert!((moved[0] - 29.0f64.sqrt()).abs() < 1e-6 && moved[1] < 1e-6, "{moved:?}");
}
