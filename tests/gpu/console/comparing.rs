//! The comparison of the shown volume with itself as it was, and with another recording.

use super::*;
use crate::common::wait;
use echolume::low_level::scene::{Input as Samples, Scene};
use echolume::low_level::source;
use echolume::low_level::ui::command::{CompareView, Link};
use echolume::low_level::ui::recordings::Recordings;
use std::path::Path;

impl Desk {
    fn does(&mut self, command: Command) {
        self.console.execute(&command, Instant::now());
    }

    /// Waits until the picture of the compared volume, or that of the difference, is as it should be.
    fn compared(&mut self, n: usize, is_right: impl Fn(&Picture) -> bool) -> Arc<Picture> {
        let begun = Instant::now();
        loop {
            self.tick(Instant::now() + LATER);
            let shown = self.console.compared().expect("a comparison").0;
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
    let pinned = desk.compared(0, |picture| [picture.width, picture.height] == [first.width, first.height]);
    assert!(pinned.rgba == first.rgba, "both tiles show one volume");
    desk.does(Command::Shadow(true));
    desk.does(Command::Rotate([30.0, 0.0]));
    desk.rest();
    let turned = desk.picture();
    let view_alone = desk.compared(0, |picture| picture.rgba != pinned.rgba);
    assert!(view_alone.rgba != turned.rgba, "it has no shadow");
    desk.does(Command::ToggleLink(Link::Look));
    desk.compared(0, |picture| picture.rgba == turned.rgba);
    desk.does(Command::CompareView(CompareView::Difference));
    desk.rest();
    let difference = desk.compared(1, |picture| picture.width == 64);
    let equal = |pixel: &[u8]| pixel == [18, 21, 26, 255];
    assert!(difference.rgba.chunks_exact(4).all(equal), "there is none");
    desk.does(Command::Compare);
    desk.rest();
    assert!(desk.console.compared().is_none());
    assert_eq!([desk.picture().width, desk.picture().height], SIZE);
}

/// The next open recording is drawn with the settings of the shown one, by the formula of its own geometry.
#[test]
fn another_recording_is_drawn_with_the_same_settings() {
    let device = Device::new();
    let recordings = Arc::new(Mutex::new(Recordings::of(SourceKind::Recording, Path::new("shown"))));
    assert!(recordings.lock().expect("a list").add(Path::new(BONE)));
    let opening = OpeningOptions { recordings, ..OpeningOptions::default() };
    let mut desk = Desk::new(&device, ConsoleOptions { opening, ..options() });
    desk.begin();
    desk.live(0);
    desk.press(Key::Char('p'));
    desk.rest();
    let shown = desk.console.stream().scene().expect("begun").settings.clone();
    let mut bone = source::open(BONE.as_ref(), None).expect("a recording");
    let input = Samples { stored: bone.stored_type(), range: bone.range() };
    let scene = Scene::new(bone.geometry(0), input, shown).expect("a scene");
    let mut renderer = Renderer::new(&device, scene, &gpu::RendererOptions::default()).expect("renderer");
    while let Some(frame) = bone.next_frame().expect("a frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    let expected = renderer.picture().expect("picture");
    desk.compared(0, |picture| *picture == expected);
    // It is not like the shown one: the view says so, and stays.
    desk.does(Command::Align);
    desk.tick(Instant::now());
    desk.does(Command::Align);
    desk.compared(0, |picture| *picture == expected);
    assert!(!desk.console.compared().expect("a comparison").1);
}
