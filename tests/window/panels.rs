//! Panels: buttons and drags act on the picture, which equals the headless one where nothing is drawn over it.

use crate::desktop::*;
use echolume::picture::Picture;

/// The window of these tests, and the size of the picture between the panels, from `ui::panels::place`.
const WINDOW: [u32; 2] = [1000, 700];

fn picture() -> ([u32; 2], [u32; 2]) {
    echolume::ui::panels::picture_area(WINDOW, 1.0, true)
}

/// Waits until the middle of the picture, which has no marks, equals that of a headless one.
fn shows(view: &View, wanted: &Picture, what: &str) {
    let (corner, size) = picture();
    assert_eq!([wanted.width, wanted.height], size);
    let from = size.map(|n| n / 4);
    let middle = size.map(|n| n / 2);
    view.shows_at(wanted, [corner[0] + from[0], corner[1] + from[1]], from, middle, what);
}

fn open(desk: &Desk) -> View<'_> {
    desk.view(&["--size", "1000x700", "--source", SWEEP])
}

#[test]
fn buttons_act_on_the_picture_and_reset_takes_it_all_back() {
    let desk = Desk::new(false);
    let view = open(&desk);
    let (_, size) = picture();
    let start = headless(size, &[]);
    shows(&view, &start, "the start");
    // The second button of the first row of modes, and the second of the layouts.
    view.click(155, 52);
    shows(&view, &headless(size, &["--mode", "vr"]), "volume");
    // Reset, by its key: Backspace.
    desk.tap(0xff08_u32);
    shows(&view, &start, "reset");
    view.leave();
}

#[test]
fn a_drag_on_the_picture_turns_it_and_one_on_a_panel_does_not() {
    let desk = Desk::new(false);
    let view = open(&desk);
    let (corner, size) = picture();
    let start = headless(size, &[]);
    shows(&view, &start, "the start");
    // Over the headings of the sliders, where nothing reacts.
    view.drag([(WINDOW[0] - 200) as i16, 8], [(WINDOW[0] - 120) as i16, 8]);
    shows(&view, &start, "as before");
    let middle = [corner[0] + size[0] / 2, corner[1] + size[1] / 2].map(|n| n as i16);
    view.drag(middle, [middle[0] + 60, middle[1]]);
    until("another picture", || {
        let seen = crop(&view.look()?, [corner[0] + size[0] / 4, corner[1] + size[1] / 4], size.map(|n| n / 2))?;
        let before = crop(&start, size.map(|n| n / 4), size.map(|n| n / 2))?;
        (seen != before).then_some(())
    });
    view.leave();
}

#[test]
fn help_and_times_overlay_the_picture_and_disappear() {
    let desk = Desk::new(false);
    let view = open(&desk);
    let (_, size) = picture();
    let start = headless(size, &[]);
    shows(&view, &start, "the start");
    // Escape closes the help, and does not leave.
    for (key, back) in [(u32::from('h'), u32::from('h')), (F1, ESCAPE)] {
        desk.tap(key);
        let (corner, size) = picture();
        let middle = [corner[0] + size[0] / 2, corner[1] + size[1] / 2];
        // Nearly black, whatever the picture shows there.
        until("the help", || {
            let seen = crop(&view.look()?, middle, [40, 4])?;
            let dark = seen.rgba.chunks(4).filter(|p| p[..3].iter().all(|c| *c < 60)).count();
            (dark * 2 > seen.rgba.len() / 4).then_some(())
        });
        desk.tap(back);
        shows(&view, &start, "without the help");
    }
    view.leave();
}

#[test]
fn saved_pictures_and_loops_have_names_without_patient_data() {
    let desk = Desk::new(false);
    let folder = Folder::new("saved");
    let view = desk.view(&["--size", "1000x700", "--source", SWEEP, "--save-to", &folder.path("kept")]);
    let (_, size) = picture();
    let start = headless(size, &[]);
    shows(&view, &start, "the start");
    let names = || -> Vec<String> {
        let entries = std::fs::read_dir(folder.path("kept")).into_iter().flatten().flatten();
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).filter(|n| !n.starts_with('.')).collect()
    };
    desk.tap('p');
    desk.tap('r');
    let names = until("two files", || Some(names()).filter(|n| n.len() == 2));
    assert!(names.iter().all(|n| n.starts_with("echolume-2") && !n.contains("sweep")), "{names:?}");
    let png = names.iter().find(|n| n.ends_with(".png")).expect("a picture");
    let saved = until("the whole file", || Picture::load(&folder.0.join("kept").join(png)).ok());
    // The bar is below the picture; sides and the probe's marker are at its edges.
    assert!(saved.width == start.width && saved.height > start.height);
    let (from, middle) = (size.map(|n| n / 4), size.map(|n| n / 2));
    assert_eq!(crop(&saved, from, middle), crop(&start, from, middle), "without panels");
    view.leave();
}
