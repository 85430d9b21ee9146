//! The list of presets: small pictures of the present volume beside the view, and the presets of the user.

use super::*;
use crate::common::wait;
use echolume::low_level::scene::{Mode, TransferName};
use echolume::low_level::user_presets::read;
use std::path::PathBuf;

/// The built-in presets of the list.
const BUILT_IN: usize = 6;

/// A console that shows a volume, with a file for presets.
fn desk(device: &Arc<Context>, name: &str) -> (Desk, Folder, PathBuf) {
    let folder = Folder::new(name);
    let file = folder.0.join("config").join("presets.toml");
    let mut desk = Desk::new(device, ConsoleOptions { presets: Some(file.clone()), ..options() });
    desk.begin();
    desk.live(0);
    (desk, folder, file)
}

impl Desk {
    fn types(&mut self, text: &str) {
        text.chars().for_each(|letter| self.press(Key::Char(letter)));
    }

    /// Waits for so many thumbnails other than these.
    fn thumbnails(&mut self, count: usize, before: &[Arc<Picture>]) -> Vec<Arc<Picture>> {
        let begun = Instant::now();
        loop {
            self.tick(Instant::now() + LATER);
            let made: Vec<_> = self.console.thumbnails().iter().flatten().cloned().collect();
            let is_new = |picture: &Arc<Picture>| !before.iter().any(|old| Arc::ptr_eq(old, picture));
            if made.len() == count && made.iter().all(is_new) {
                return made;
            }
            assert!(begun.elapsed() < BOUND, "{} thumbnails", made.len());
            wait::poll();
        }
    }
}

/// Requirement: thumbnails are of the data at hand, cost the view nothing, and exist only while the list is shown.
#[test]
fn thumbnails_are_of_the_volume_and_only_while_the_list_is_open() {
    let device = Device::new();
    let (mut desk, _folder, _) = desk(&device, "thumbnails");
    desk.press(Key::Space);
    desk.rest();
    let (before, picture) = (desk.console.stream().last_begun(), desk.picture());
    assert!(desk.console.thumbnails().is_empty());
    desk.held(CONTROL, Key::Char('p'));
    let made = desk.thumbnails(BUILT_IN, &[]);
    for (n, picture) in made.iter().enumerate() {
        assert_eq!([picture.width, picture.height], [256, 160]);
        let of_view = picture.rgba.chunks(4).filter(|p| p[..3].iter().any(|c| *c > 60)).count();
        // Vessels in a body without any are dark.
        assert!(of_view > 500 || n == 3, "preset {n} shows nothing: {of_view}");
        assert!(made[..n].iter().all(|other| other.rgba != picture.rgba), "preset {n} looks like another");
    }
    assert_eq!(desk.console.stream().last_begun(), before, "the view draws nothing for them");
    assert_eq!(desk.picture(), picture);
    // A turn makes them again; a little one does not.
    desk.console.execute(&Command::Rotate([4.0, 0.0]), Instant::now());
    desk.rest();
    assert!(desk.console.thumbnails().iter().flatten().zip(&made).all(|(now, then)| Arc::ptr_eq(now, then)));
    desk.console.execute(&Command::Rotate([40.0, 0.0]), Instant::now());
    let turned = desk.thumbnails(BUILT_IN, &made);
    assert!(turned[0].rgba != made[0].rgba);
    desk.press(Key::Escape);
    assert!(desk.console.thumbnails().is_empty(), "the list is closed");
    desk.rest();
    let closed = desk.console.stream().dispatches();
    desk.rest();
    assert_eq!(desk.console.stream().dispatches(), closed, "nothing is made for a list that is closed");
    assert!(!desk.tick(Instant::now() + LATER).exit, "Escape leaves the list, not the program");
}

/// Requirement: a preset changes the look, one undo takes it back, and region, view and measurements stay.
#[test]
fn a_preset_is_taken_and_taken_back() {
    let device = Device::new();
    let (mut desk, ..) = desk(&device, "preset");
    desk.console.execute(&Command::Rotate([30.0, 0.0]), Instant::now());
    desk.rest();
    let before = desk.console.controls().settings().clone();
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('3'));
    desk.rest();
    let glass = desk.console.controls().settings().clone();
    assert!(desk.console.thumbnails().is_empty(), "the list closes");
    assert_eq!(glass.mode, Mode::Volume);
    assert!(
        glass.light.volume.is_some() && (glass.light.ambient, glass.light.specular) == (0.3, 0.5),
        "those of glass"
    );
    assert_eq!((&glass.camera, &glass.region.depth), (&before.camera, &before.region.depth));
    let shown = desk.picture();
    assert_eq!(shown, headless(&device, &glass, &body(0)));
    desk.held(CONTROL, Key::Char('z'));
    desk.rest();
    assert_eq!(*desk.console.controls().settings(), before);
}

#[test]
fn presets_of_the_user_are_saved_renamed_deleted_and_brought_back() {
    let device = Device::new();
    let (mut desk, _folder, file) = desk(&device, "own-presets");
    let names = || read(&file).expect("presets").into_iter().map(|preset| preset.name).collect::<Vec<_>>();
    desk.console.execute(&Command::Mode(Mode::Volume), Instant::now());
    desk.console.execute(&Command::Transfer(TransferName::Cool), Instant::now());
    let look = desk.console.controls().settings().look();
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('s'));
    desk.types("bone");
    desk.press(Key::Enter);
    assert!(!file.exists(), "the name of a built-in preset");
    (0..4).for_each(|_| desk.press(Key::Backspace));
    desk.types("12 w");
    desk.press(Key::Enter);
    assert_eq!(names(), ["12 w"]);
    assert_eq!(read(&file).expect("presets")[0].look().expect("a look"), look);
    desk.console.execute(&Command::RenamePreset(0), Instant::now());
    desk.types("x");
    desk.press(Key::Enter);
    assert_eq!(names(), ["12 wx"]);
    desk.console.execute(&Command::DeletePreset(0), Instant::now());
    assert!(names().is_empty());
    desk.press(Key::Char('z'));
    assert_eq!(names(), ["12 wx"]);
    // What another window saved meanwhile is kept.
    desk.press(Key::Escape);
    desk.console.execute(&Command::Mode(Mode::Mip), Instant::now());
    desk.rest();
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('7'));
    desk.rest();
    let taken = desk.console.controls().settings().clone();
    assert_eq!((taken.look(), taken.picture.size), (look, desk.drawn().picture.size));
    // A damaged file keeps what it has.
    std::fs::write(&file, "version = 1\n[[preset]\n").expect("write");
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('s'));
    desk.types("y");
    desk.press(Key::Enter);
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "version = 1\n[[preset]\n");
    desk.press(Key::Char('1'));
    desk.rest();
    assert_eq!(desk.console.controls().settings().mode, Mode::Volume, "built-in presets are there");
}

/// A kiosk has built-in presets and keeps none.
#[test]
fn a_view_without_a_file_keeps_no_presets() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    desk.live(0);
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('s'));
    desk.press(Key::Char('6'));
    desk.rest();
    assert_eq!(desk.console.controls().settings().mode, Mode::Plane, "the key chose B-mode: no name is typed");
}
