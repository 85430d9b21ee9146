//! Panels: buttons and drags act on the picture, which equals the headless one where nothing is drawn over it.

use crate::desktop::*;
use echolume::low_level::picture::Picture;
use std::path::PathBuf;
use std::time::Duration;

/// The window of these tests, and the size of the picture between the panels, from `ui::panels::place`.
const WINDOW: [u32; 2] = [1000, 700];

fn picture() -> ([u32; 2], [u32; 2]) {
    echolume::low_level::ui::panels::picture_area(WINDOW, 1.0, true)
}

fn open(desk: &Desk) -> View<'_> {
    desk.view(&["--size", "1000x700", PLAIN[0], PLAIN[1], "--source", SWEEP])
}

#[test]
fn buttons_act_on_the_picture_and_reset_takes_it_all_back() {
    let desk = Desk::new(false);
    let view = open(&desk);
    let (_, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    // The second button of the first row of modes, below undo, redo and presets.
    view.click(155, 151);
    view.shows_middle(&plain(size, &["--mode", "vr"]), "volume");
    // Reset, by its key: Backspace; undo and redo by their buttons.
    desk.tap(0xff08_u32);
    view.shows_middle(&start, "reset");
    view.click(54, 28);
    view.shows_middle(&plain(size, &["--mode", "vr"]), "what was before the reset");
    view.click(155, 28);
    view.shows_middle(&start, "reset again");
    view.leave();
}

#[test]
fn a_drag_on_the_picture_turns_it_and_one_on_a_panel_does_not() {
    let desk = Desk::new(false);
    let view = open(&desk);
    let (corner, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    // Over the headings of the sliders, where nothing reacts.
    view.drag([(WINDOW[0] - 200) as i16, 8], [(WINDOW[0] - 120) as i16, 8]);
    view.shows_middle(&start, "as before");
    let middle = [corner[0] + size[0] / 2, corner[1] + size[1] / 2].map(|n| n as i16);
    view.drag(middle, [middle[0] + 60, middle[1]]);
    until("another picture", || {
        let seen = view.look_at([corner[0] + size[0] / 4, corner[1] + size[1] / 4], size.map(|n| n / 2))?;
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
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    // Escape closes the help, and does not leave.
    for (key, back) in [(u32::from('h'), u32::from('h')), (F1, ESCAPE)] {
        desk.tap(key);
        let (corner, size) = picture();
        let middle = [corner[0] + size[0] / 2, corner[1] + size[1] / 2];
        // Nearly black, whatever the picture shows there.
        until("the help", || {
            let seen = view.look_at(middle, [40, 4])?;
            let dark = seen.rgba.chunks(4).filter(|p| p[..3].iter().all(|c| *c < 60)).count();
            (dark * 2 > seen.rgba.len() / 4).then_some(())
        });
        desk.tap(back);
        view.shows_middle(&start, "without the help");
    }
    view.leave();
}

#[test]
fn saved_pictures_and_loops_have_names_without_patient_data() {
    let desk = Desk::new(false);
    let folder = Folder::new("saved");
    let view =
        desk.view(&["--size", "1000x700", PLAIN[0], PLAIN[1], "--source", SWEEP, "--save-to", &folder.path("kept")]);
    let (_, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    let names = || -> Vec<String> {
        let entries = std::fs::read_dir(folder.path("kept")).into_iter().flatten().flatten();
        entries.map(|e| e.file_name().to_string_lossy().into_owned()).filter(|n| !n.starts_with('.')).collect()
    };
    desk.control('i');
    desk.control('r');
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

/// The panels answer while a picture is drawn, over a copy of the last one. Of a device with several queues the picture is short.
#[test]
fn panels_are_presented_while_a_picture_is_drawn() {
    let desk = Desk::new(false);
    let view = desk.view(&["--size", "1000x700", PLAIN[0], PLAIN[1], "--source", SWEEP, "--budget", "none"]);
    let (corner, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    let surface = plain(size, &["--mode", "sr"]);
    let (from, middle) = (size.map(|n| n / 4), size.map(|n| n / 2));
    let wanted = crop(&surface, from, middle);
    let shown = || view.look_at([corner[0] + from[0], corner[1] + from[1]], middle);
    // The help is asked for while the picture is drawn, and closed again: until it is there, however long its pipelines are compiled before.
    desk.tap('1');
    let begun = std::time::Instant::now();
    while shown() != wanted && begun.elapsed() < PATIENCE {
        for _ in 0..2 {
            desk.tap('h');
            pace(Duration::from_millis(50));
        }
    }
    view.shows_middle(&surface, "the surface");
    let said = view.leave();
    let between = said.split(" shown on the window, ").nth(1).and_then(|rest| rest.split(' ').next());
    let between: u64 = between.and_then(|count| count.parse().ok()).expect("a count");
    assert!(between > 0 || !said.contains("software"), "{said}");
}

/// Prevents panels that stay in the window though they changed, and ones that are drawn again though only the picture did; and a picture that is converted
/// on its way.
#[test]
fn what_is_kept_of_a_window_equals_what_is_drawn_whole() {
    let (desk, folder) = (Desk::new(false), Folder::new("kept"));
    let log = folder.path("log");
    let view = desk.view(&["--size", "1000x700", "--source", SWEEP, "-vv", "--log-file", &log]);
    let (corner, size) = picture();
    view.shows_middle(&headless(size, &[]), "the start");
    // It stays as it is for so many looks: until a picture of full quality is there, and notes have gone.
    let settled = |looks: u32| {
        let mut seen = view.look();
        let mut same = 0;
        until("a window that rests", || {
            watch(Duration::from_millis(300));
            let now = view.look();
            same = if now == seen { same + 1 } else { 0 };
            seen = now;
            (same >= looks).then(|| seen.clone()).flatten()
        })
    };
    let mut state = 7_u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) % below
    };
    for round in 0..3 {
        for _ in 0..8 {
            let [x, y] = [0, 1].map(|axis| (corner[axis] + random(size[axis])) as i16);
            match random(6) {
                0 => desk.tap(['1', '2', '4', '8'][random(4) as usize]),
                1 => desk.tap(TAB),
                2 => desk.control('z'),
                // Over the panels, which show what is under the pointer.
                3 => (0..8).for_each(|_| view.hover(random(WINDOW[0]) as i16, random(WINDOW[1]) as i16)),
                _ => view.drag([x, y], [(corner[0] + random(size[0])) as i16, (corner[1] + random(size[1])) as i16]),
            }
        }
        view.hover((corner[0] + size[0] / 2) as i16, (corner[1] + size[1] / 2) as i16);
        let kept = settled(25);
        // A window of another size keeps nothing.
        for height in [WINDOW[1] + 2, WINDOW[1]] {
            view.resize(WINDOW[0], height);
            until("the size", || (view.place().1.map(u32::from) == [WINDOW[0], height]).then_some(()));
            settled(5);
        }
        // Of a slow machine, the picture of full quality may come after a rest.
        let begun = std::time::Instant::now();
        let mut whole = settled(5);
        while whole != kept && begun.elapsed() < PATIENCE {
            whole = settled(5);
        }
        let differ = kept.rgba.chunks(4).zip(whole.rgba.chunks(4)).filter(|(a, b)| a != b).count();
        if differ > 0 {
            let folder = std::env::temp_dir();
            drop(kept.save(&folder.join("window-kept.png")));
            drop(whole.save(&folder.join("window-whole.png")));
            panic!("round {round}: {differ} pixels differ; see window-kept.png and window-whole.png in {folder:?}");
        }
    }
    view.leave();
    let said = std::fs::read_to_string(&log).expect("the log");
    let presented: Vec<&str> = said.lines().filter_map(|line| line.split("window: the picture ").nth(1)).collect();
    assert!(presented.len() > 20 && presented.iter().all(|how| how.starts_with("as it is")), "{presented:?}");
    let beside = presented.iter().filter_map(|how| how.split(", ").nth(1)?.split(' ').next()?.parse::<u32>().ok());
    let [none, few] =
        [0, WINDOW[0] * WINDOW[1] / 8].map(|most| beside.clone().filter(|pixels| *pixels <= most).count());
    assert!(none > 5 && few > none, "{none} presentations drew no panels again, {few} few of them: {presented:?}");
}

/// Presets are pictures of the volume; one that is chosen shows what `render --preset` does, also one of the user's.
#[test]
fn presets_are_pictures_and_show_what_the_command_renders() {
    let desk = Desk::new(false);
    let folder = Folder::new("presets");
    let file = folder.path("presets.toml");
    let mut command = std::process::Command::new(PROGRAM);
    command.env("ECHOLUME_PRESETS", &file);
    let view = desk.view_by(&mut command, &["--size", "1000x700", PLAIN[0], PLAIN[1], "--source", SWEEP]);
    let (_, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    desk.control('p');
    until("the picture of B-mode in the list", || {
        // The list is in the middle of the window, and B-mode the third of its second row.
        let margin = view.look_at([131, 330], [4, 40])?;
        let is_list = margin.rgba.chunks(4).all(|pixel| pixel[..3] == [18, 21, 26]);
        let tile = view.look_at([640, 390], [190, 110])?;
        let grey = tile.rgba.chunks(4).filter(|p| p[0] > 90 && p[0] == p[1] && p[1] == p[2]).count();
        (is_list && grey > 500).then_some(())
    });
    desk.tap('6');
    let plane = plain(size, &["--preset", "bmode"]);
    view.shows_middle(&plane, "B-mode");
    desk.control('p');
    desk.tap('s');
    "mine".chars().for_each(|letter| desk.tap(letter));
    desk.tap(RETURN);
    until("the preset", || echolume::low_level::user_presets::read(file.as_ref()).ok().filter(|kept| kept.len() == 1));
    desk.tap(ESCAPE);
    desk.control('z');
    view.shows_middle(&start, "taken back");
    desk.control('p');
    desk.tap('7');
    view.shows_middle(&plane, "the preset of the user");
    view.leave();
}

/// Exports are those of the commands; one that is not finished when the view ends leaves nothing.
#[test]
fn the_volume_is_exported_as_the_commands_do() {
    let desk = Desk::new(false);
    let folder = Folder::new("exports");
    let samples: Vec<u8> = (0..24usize.pow(3))
        .map(|n| {
            let at = [n % 24, n / 24 % 24, n / 576].map(|k| k as f64 - 11.5);
            if at.iter().map(|d| d * d).sum::<f64>() < 64.0 { 200 } else { 20 + (n % 7) as u8 }
        })
        .collect();
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 24 24 24\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\nElementDataFile = LOCAL\n";
    let ball = folder.write("ball.mha", [header.as_bytes(), &samples].concat());
    let kept = folder.path("kept");
    let open = || {
        let view = desk.view(&["--size", "700x500", "--source", &ball, "--save-to", &kept, "--mode", "mip"]);
        until("a picture", || {
            let (corner, size) = echolume::low_level::ui::panels::picture_area([700, 500], 1.0, true);
            let seen = view.look_at(corner, size)?;
            let is_bright = |pixel: &[u8]| pixel[..3].iter().all(|c| *c > 150);
            (seen.rgba.chunks(4).filter(|pixel| is_bright(pixel)).count() > 5000).then_some(())
        });
        view
    };
    let view = open();
    let export = |format: char| {
        desk.control('e');
        desk.tap(format);
    };
    let all = || std::fs::read_dir(folder.path("kept")).into_iter().flatten().flatten().map(|entry| entry.path());
    for (format, ending, command) in [('1', "nrrd", &["convert"][..]), ('7', "stl", &["mesh", "--base", "3"])] {
        export(format);
        let file = until("the export", || all().find(|path| path.extension().is_some_and(|end| end == ending)));
        let wanted = folder.path(&format!("wanted.{ending}"));
        let run = std::process::Command::new(PROGRAM).args(command).args([&ball, &wanted]).output();
        let run = run.expect("the program runs");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let [got, wanted] = [file, wanted.into()].map(|file| std::fs::read(file).expect("a file"));
        assert!(got == wanted, "{ending}: {} and {} bytes", got.len(), wanted.len());
    }
    let begins_turntable = || {
        export('8');
        until("a turntable in work", || all().find(|path| path.to_string_lossy().contains(".echolume-export-")));
    };
    let is_clean = || {
        let left: Vec<_> = all().map(|path| path.display().to_string()).collect();
        assert!(left.len() == 2 && left.iter().all(|path| !path.contains(".echolume-export-")), "{left:?}");
    };
    begins_turntable();
    view.leave();
    is_clean();
    let view = open();
    begins_turntable();
    view.terminate();
    is_clean();
}

/// A turntable and a loop are finished, and have the bar that the switch asks for.
#[test]
fn a_turntable_and_a_loop_are_exported_with_marks_as_asked() {
    let desk = Desk::new(false);
    let folder = Folder::new("series");
    let [sweep, kept] = ["two.mha", "kept"].map(|name| folder.path(name));
    let run = |args: &[&str]| {
        let run = std::process::Command::new(PROGRAM).args(args).output().expect("the program runs");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    };
    run(&["phantom", "--volumes", "2", "--frames", "12", "--lines", "32", "-o", &sweep]);
    // Coarse rays: 72 pictures are drawn.
    let look = ["--mode", "mip", "--set", "ray.step=2"];
    let view = desk.view(
        &[&["-v", "--size", "700x500", "--source", &sweep, "--save-to", &kept, "--cine", "9"], &look[..]].concat(),
    );
    let (_, size) = echolume::low_level::ui::panels::picture_area([700, 500], 1.0, true);
    let all = || std::fs::read_dir(&kept).into_iter().flatten().flatten().map(|entry| entry.path());
    let exported = |format: char, ending: &str| {
        let mut asked: Option<std::time::Instant> = None;
        until("the export", || {
            let made = all().find(|path| path.extension().is_some_and(|end| end == ending));
            let is_at_work = all().any(|path| path.to_string_lossy().contains(".echolume-export-"));
            // Before the first volume there is nothing to export.
            if made.is_none() && !is_at_work && asked.is_none_or(|at| at.elapsed().as_secs() >= 3) {
                asked = Some(std::time::Instant::now());
                desk.control('e');
                desk.tap(format);
            }
            made
        })
    };
    let pictures = |folder: &std::path::Path| -> Vec<Picture> {
        let mut files: Vec<PathBuf> =
            std::fs::read_dir(folder).expect("a folder").flatten().map(|e| e.path()).collect();
        files.sort();
        files.iter().map(|file| Picture::load(file).expect("a picture")).collect()
    };
    for (format, ending, count) in [('8', "turntable", 72..73), ('9', "loop", 2..10)] {
        let got = pictures(&exported(format, ending));
        assert!(count.contains(&got.len()), "{ending}: {} pictures", got.len());
        // The bar is below.
        assert!(got.iter().all(|picture| picture.width == size[0] && picture.height > size[1]), "{ending}");
        let middle = |n: usize| crop(&got[n], size.map(|n| n / 4), size.map(|n| n / 2)).expect("inside");
        assert_ne!(middle(0), middle(got.len() / 2), "{ending}");
    }
    view.leave();
}

/// The report of a recording names that, and not the copy that other exports are made of, and is made again from its JSON.
#[test]
fn a_report_of_the_recording_is_exported_with_what_makes_it_again() {
    let desk = Desk::new(false);
    let folder = Folder::new("report");
    std::fs::copy(BONE, folder.join("bone.mha")).expect("copied");
    let caliper = "[[measure]]\nkind = 'distance'\npoints = [[12.4, 0.5, 5.6], [12.4, 23.6, 5.6]]\n";
    let head = "mode = 'plane'\n[workspace]\nversion = 1\nrecording = 'bone.mha'\n";
    let (exam, kept) = (folder.write("exam.toml", [head, caliper].concat()), folder.path("kept"));
    let view = desk.view(&["--size", "700x500", "--source", &exam, "--save-to", &kept]);
    let all = || std::fs::read_dir(&kept).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut asked: Option<std::time::Instant> = None;
    let report = until("the report", || {
        let made = all().find(|path| path.extension().is_some_and(|end| end == "pdf"));
        let is_at_work = all().any(|path| path.to_string_lossy().contains(".echolume-export-"));
        // Before the volume there is nothing to export.
        if made.is_none() && !is_at_work && asked.is_none_or(|at| at.elapsed().as_secs() >= 3) {
            asked = Some(std::time::Instant::now());
            desk.control('e');
            desk.tap(0xff57_u32); // End
            desk.tap(RETURN);
        }
        made
    });
    view.leave();
    let (json, again) = (report.with_extension("json"), folder.path("again.pdf"));
    let text = std::fs::read_to_string(&json).expect("beside it");
    assert!(text.contains("\"name\": \"bone.mha\"") && text.contains("\"value\": 23.1"), "{text}");
    let run =
        std::process::Command::new(PROGRAM).args(["worksheet", "--from"]).arg(&json).args(["-o", &again]).output();
    let run = run.expect("the program runs");
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(said.contains("pictures: all 1 are those of "), "{said}{}", String::from_utf8_lossy(&run.stderr));
    assert!(std::fs::read(&report).expect("a report") == std::fs::read(&again).expect("a report"));
}
