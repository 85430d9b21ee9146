//! Where everything is, in windows from 640 x 480 to 3840 x 2160 at scales from 1 to 3, in every mode and layout.

use super::shown::Shown;
use super::*;
use crate::panels::accesskit::{Action, Node, Role};
use crate::panels::colours::{BACKING, MESSAGE, OUTLINE, PANEL};
use crate::panels::drawn::{Area, Kind};
use crate::panels::{self, Banner, Note, Reading};
use crate::picking::Picker;
use crate::probe::Indices;

const SIZES: [[u32; 2]; 8] =
    [[640, 480], [800, 600], [1024, 768], [1280, 720], [1280, 1024], [1920, 1080], [2560, 1440], [3840, 2160]];
const SCALES: [f32; 6] = [1.0, 1.25, 1.5, 2.0, 2.5, 3.0];
/// Rounding to pixels.
const NEAR: f32 = 1.0;

fn overlap(a: Area, b: Area) -> bool {
    a[0] + NEAR < b[2] && b[0] + NEAR < a[2] && a[1] + NEAR < b[3] && b[1] + NEAR < a[3]
}

fn is_inside(inner: Area, outer: Area) -> bool {
    inner[0] >= outer[0] - NEAR
        && inner[1] >= outer[1] - NEAR
        && inner[2] <= outer[2] + NEAR
        && inner[3] <= outer[3] + NEAR
}

fn common(a: Area, b: Area) -> Option<Area> {
    let both = [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])];
    (both[0] + NEAR < both[2] && both[1] + NEAR < both[3]).then_some(both)
}

/// The window and the picture in it, points.
fn places(shown: &Shown) -> [Area; 2] {
    let scale = shown.panels.scale();
    let ([x, y], [w, h]) = panels::picture_area(shown.size, scale, true);
    let [width, height] = shown.size;
    [[0, 0, width, height], [x, y, x + w, y + h]].map(|area| area.map(|n| n as f32 / scale))
}

fn place(node: &Node) -> Option<Area> {
    node.bounds().map(|b| [b.x0, b.y0, b.x1, b.y1].map(|n| n as f32))
}

/// The controls of the panels with their names, as far as they are in sight: a column ends above the bar, and scrolls.
fn controls(shown: &Shown) -> Vec<(String, Area)> {
    let [window, picture] = places(shown);
    let columns = [[0.0, picture[1], picture[0], picture[3]], [picture[2], picture[1], window[2], picture[3]]];
    let bars = [[0.0, 0.0, window[2], picture[1]], [0.0, picture[3], window[2], window[3]]];
    let names = ["Files, views and search", "Cine loop"].map(|name| shown.names_of_bar(name));
    let controls = shown
        .tree
        .values()
        .filter(|node| matches!(node.role(), Role::Button | Role::Slider | Role::Switch | Role::Tab));
    let seen = controls.filter_map(|node| {
        let area = place(node)?;
        // Of a row of a column, the middle decides where it belongs.
        let middle = (area[0] + area[2]) / 2.0;
        let label = node.label().unwrap_or_default().to_string();
        let at_bar =
            bars.iter().zip(&names).find(|(bar, names)| names.contains(&label) && common(area, **bar).is_some());
        let home = match at_bar {
            Some((bar, _)) => *bar,
            None => *columns.iter().find(|column| (column[0]..column[2]).contains(&middle)).unwrap_or(&bars[1]),
        };
        Some((node.label().unwrap_or_default().to_string(), common(area, home)?, area, home))
    });
    seen.map(|(name, seen, area, home)| {
        let is_in_width = area[0] >= home[0] - NEAR && area[2] <= home[2] + NEAR;
        assert!(is_in_width, "{name} reaches out of its panel: {area:?} of {home:?}");
        (name, seen)
    })
    .collect()
}

/// What annotations draw over the picture: each once, without its dark edges.
fn annotations(shown: &Shown) -> Vec<(String, Area)> {
    let [_, picture] = places(shown);
    let drawn = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
        Kind::Text { area, text, colours, .. } if colours[0] != OUTLINE.to_array() => Some((text.clone(), *area)),
        Kind::Circle { centre: [x, y], radius, fill, .. } if *fill == BACKING.to_array() => {
            Some(("axes".to_string(), [x - radius, y - radius, x + radius, y + radius]))
        }
        Kind::Circle { centre: [x, y], radius: 5.0, .. } => {
            Some(("probe".into(), [x - 5.0, y - 5.0, x + 5.0, y + 5.0]))
        }
        Kind::Rect { area, fill, .. } if fill[3] == 0 && area[2] - area[0] == 16.0 => Some(("colours".into(), *area)),
        _ => None,
    });
    let mut found: Vec<(String, Area)> = drawn.filter(|(_, area)| is_inside(*area, picture)).collect();
    found.dedup();
    found
}

fn check(shown: &Shown, what: &str) {
    let [window, picture] = places(shown);
    let share = |area: Area| (area[2] - area[0]) * (area[3] - area[1]);
    assert!(share(picture) >= 0.5 * share(window), "{what}: the picture has {picture:?} of {window:?}");
    let controls = controls(shown);
    for (n, (name, area)) in controls.iter().enumerate() {
        assert!(is_inside(*area, window), "{what}: {name} at {area:?} is not in {window:?}");
        assert!(!overlap(*area, picture), "{what}: {name} at {area:?} covers the picture {picture:?}");
        for (other, covered) in &controls[..n] {
            assert!(!overlap(*area, *covered), "{what}: {name} at {area:?} covers {other} at {covered:?}");
        }
    }
    for wanted in [&["Freeze", "Unfreeze"][..], &["Save", "Save picture"]] {
        let is_there = |(name, area): &(String, Area)| wanted.contains(&name.as_str()) && area[1] >= picture[3] - NEAR;
        let found = controls.iter().find(|control| is_there(control));
        assert!(
            found.is_some_and(|(_, area)| area[2] - area[0] > 40.0 && area[3] - area[1] > 30.0),
            "{what}: {wanted:?} {found:?}"
        );
    }
    let marks = annotations(shown);
    assert!(marks.iter().any(|(name, _)| name.starts_with("Demo data")), "{what}: the phantom is not named: {marks:?}");
    let is_number = |(name, _): &(String, Area)| name.parse::<u32>().is_ok();
    let has_unit = |(name, _): &(String, Area)| name.ends_with(" mm");
    let has_ruler = shown.scene.marks().iter().any(|tile| tile.depth_from.is_some());
    assert!(!has_ruler || !marks.iter().any(is_number) || marks.iter().any(has_unit), "{what}: no unit: {marks:?}");
    for (n, (name, area)) in marks.iter().enumerate() {
        for (other, covered) in &marks[..n] {
            // The names of the axes stand around and on their disc.
            let are_axes = [name, other].iter().all(|name| ["axes", "lat.", "depth", "elev."].contains(&name.as_str()));
            assert!(are_axes || !overlap(*area, *covered), "{what}: {name} at {area:?} covers {other} at {covered:?}");
        }
        if name == "axes" || name == "colours" {
            let tile = shown.scene.marks().into_iter().map(|tile| {
                let [corner, size] = [tile.corner, tile.size].map(|v| v.map(|n| n as f32 / shown.panels.scale()));
                let [x, y] = [picture[0] + corner[0], picture[1] + corner[1]];
                [x, y, x + size[0], y + size[1]]
            });
            let tile = tile.filter(|tile| is_inside(*area, *tile)).min_by(|a, b| share(*a).total_cmp(&share(*b)));
            let tile = tile.unwrap_or(picture);
            let part = share(*area) / share(tile);
            assert!(part < 0.12, "{what}: {name} at {area:?} covers {part:.2} of its tile {tile:?}");
        }
    }
}

impl Shown {
    fn names_of_bar(&self, name: &str) -> Vec<String> {
        let bar = self.tree.values().find(|node| node.role() == Role::Toolbar && node.label() == Some(name));
        let mut found = Vec::new();
        let mut left: Vec<_> = bar.map(|bar| bar.children().to_vec()).unwrap_or_default();
        while let Some(id) = left.pop() {
            let node = &self.tree[&id];
            found.push(node.label().unwrap_or_default().to_string());
            left.extend(node.children());
        }
        found
    }
}

/// The smallest and the largest at every scale, of the others every second one.
fn windows() -> impl Iterator<Item = ([u32; 2], f32)> {
    let all = SIZES
        .iter()
        .enumerate()
        .flat_map(|(m, size)| SCALES.iter().enumerate().map(move |(n, scale)| (m, size, n, scale)));
    let is_taken = |m: usize, n: usize| m == 0 || m + 1 == SIZES.len() || (m + n).is_multiple_of(2);
    all.filter(move |(m, _, n, _)| is_taken(*m, *n)).map(|(_, size, _, scale)| (*size, *scale))
}

/// Prevents a control, a mark or the picture that something else covers, and a window without Freeze or Save.
#[test]
fn nothing_covers_anything_in_any_window_mode_and_layout() {
    let looks = [
        (Mode::Surface, Layout::Single),
        (Mode::Surface, Layout::Pair),
        (Mode::Volume, Layout::Four),
        (Mode::Volume, Layout::Beside),
        (Mode::Mip, Layout::Single),
        (Mode::Plane, Layout::Single),
        (Mode::Orthogonal, Layout::Single),
        (Mode::Tomography, Layout::Single),
        (Mode::Cube, Layout::Single),
    ];
    for (size, scale) in windows() {
        let mut shown =
            Shown::sized("marks.lateral='right-left'\nmarks.elevation='head-feet'\nplanes.reference=true", size, scale);
        for (mode, layout) in looks {
            shown.apply(Command::Mode(mode));
            shown.apply(Command::Layout(layout));
            check(&shown, &format!("{size:?} at {scale}, {mode:?} {layout:?}"));
        }
        shown.recordings = (0..4).map(|n| format!("recording of a rather long name {n}.mha")).collect();
        shown.settle();
        check(&shown, &format!("{size:?} at {scale}, several recordings"));
        shown.recordings.clear();
        shown.apply(Command::Tool(Tool::Curve));
        let points = [[-20.0, 50.0], [0.0, 60.0], [30.0, 52.0]];
        points.into_iter().for_each(|at| _ = shown.apply(Command::CurvePoint(PlaneName::A, at)));
        shown.apply(Command::EndCurve);
        assert!(shown.scene.has_curve());
        check(&shown, &format!("{size:?} at {scale}, a curved plane"));
    }
}

/// A click of the pointer on a control.
fn press(shown: &mut Shown, group: &str, role: Role, name: &str) {
    let control = shown.find(group, role, name);
    let [left, top, right, bottom] = place(&shown.tree[&control]).expect("its place");
    let at = [(left + right) / 2.0, (top + bottom) / 2.0].map(|n| f64::from(n * shown.panels.scale()));
    let button = |pressed| Input::Button { button: Button::Left, pressed };
    for input in [Input::Moved(at), button(true), button(false)] {
        shown.panels.input(&input);
        shown.lay_out();
    }
    shown.settle();
}

/// Prevents a small window or a large scale without the controls that every examination needs: they are in the inspector, beside the picture or over it.
#[test]
fn the_controls_in_front_are_reached_in_every_window() {
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let mut shown = Shown::sized("mode='surface'", size, scale);
        let room = panels::Room::of(size, scale, true);
        if room.has_drawer {
            let bar = if room.has_top { "Files, views and search" } else { "Cine loop" };
            press(&mut shown, bar, Role::Button, "Inspector");
            assert!(shown.visible.inspector.is_open, "{what}");
        } else {
            check(&shown, &format!("{what}, the controls"));
        }
        press(&mut shown, "Inspector", Role::Tab, "Look");
        let [window, picture] = places(&shown);
        let above_bar = [0.0, 0.0, window[2], picture[3]];
        for name in ["Threshold", "Gain", "Smooth", "Brightness", "Lamp", "Depth"] {
            let control = shown.find("Controls", Role::Slider, name);
            shown.ask(control, Action::Focus, None);
            (0..3).for_each(|_| shown.settle());
            let area = place(&shown.tree[&control]).expect("its place");
            assert!(is_inside(area, above_bar), "{what}: {name} at {area:?} is not in {above_bar:?}");
            assert!(area[2] - area[0] > 38.0 && area[3] - area[1] > 20.0, "{what}: {name} at {area:?}");
        }
    }
}

/// Requirement: no tool, view or command is hidden without a visible way to it. Tools and views are at the edges of the window, or in the part "Tools" of the
/// inspector, whose button is in sight; the search, which has every command, has a button there too, or in that part.
#[test]
fn every_tool_view_and_command_has_a_visible_way_to_it_in_every_window() {
    const TOOLS: [&str; 14] = [
        "Turn",
        "Light",
        "Region",
        "Clip",
        "Cut",
        "Brush",
        "Crosshair",
        "Curve",
        "Distance",
        "Area",
        "Angle",
        "Contours",
        "Text",
        "Body",
    ];
    for (size, scale) in windows() {
        let what = format!("{size:?} at {scale}");
        let mut shown = Shown::sized("mode='surface'", size, scale);
        let room = panels::Room::of(size, scale, true);
        let [window, picture] = places(&shown);
        let in_sight = |shown: &Shown, name: &str, least: f32| {
            let found = shown.tree.values().filter(|node| node.role() == Role::Button && node.label() == Some(name));
            found.filter_map(place).any(|area| is_inside(area, window) && area[3] - area[1] >= least)
        };
        if room.has_tools_tab {
            if room.has_drawer {
                let bar = if room.has_top { "Files, views and search" } else { "Cine loop" };
                press(&mut shown, bar, Role::Button, "Inspector");
            }
            press(&mut shown, "Inspector", Role::Tab, "Tools");
            // What is below is scrolled to.
            let names = TOOLS.into_iter().chain(["3D", "3D + planes", "4-up", "Slices", "Find a command", "Open"]);
            for name in names.filter(|name| room.has_top || !name.is_empty()) {
                let there =
                    shown.tree.iter().find(|(_, node)| node.role() == Role::Button && node.label() == Some(name));
                let (id, _) = there.unwrap_or_else(|| panic!("{what}: no {name}"));
                shown.ask(*id, Action::Focus, None);
                (0..3).for_each(|_| shown.settle());
                assert!(in_sight(&shown, name, 20.0), "{what}: {name} is out of sight");
            }
            continue;
        }
        for name in TOOLS {
            assert!(in_sight(&shown, name, 28.0), "{what}: {name}");
        }
        for name in [
            "3D",
            "3D + planes",
            "VR | SR",
            "4-up",
            "3 planes",
            "Plane",
            "Slices",
            "Open",
            "Undo",
            "Find a command",
            "Help",
        ] {
            assert!(in_sight(&shown, name, 30.0), "{what}: {name}");
        }
        let view = |node: &Node| {
            let is_one =
                ["3D", "3D + planes", "VR | SR", "4-up", "3 planes", "Plane", "Slices"].contains(&node.label()?);
            (node.role() == Role::Button && is_one).then(|| place(node)).flatten()
        };
        for area in shown.tree.values().filter_map(view) {
            for drawn in &shown.drawn {
                let Kind::Text { area: text, .. } = &drawn.kind else { continue };
                let is_in_it = common(*text, area).is_none() || is_inside(*text, area);
                assert!(is_in_it, "{what}: a text at {text:?} reaches beyond its view at {area:?}");
            }
        }
        // With words where the smallest usual window is.
        let has_word = |name: &str| {
            let is_it =
                |kind: &Kind| matches!(kind, Kind::Text { area, text, .. } if text == name && area[2] < picture[0]);
            shown.drawn.iter().any(|drawn| is_it(&drawn.kind))
        };
        if size[1] as f32 / scale >= 720.0 {
            assert!(TOOLS.iter().all(|name| has_word(name)), "{what}: tools without their words");
        }
    }
}

/// Prevents a bar whose buttons move or change their width with what they say: live for ten seconds, frozen, trimmed, played, at other speeds, ended.
#[test]
fn the_controls_of_the_bar_stand_still() {
    for (size, scale) in windows() {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        let ids = |shown: &Shown| {
            let bar =
                shown.tree.values().find(|node| node.role() == Role::Toolbar && node.label() == Some("Cine loop"));
            let mut left: Vec<_> = bar.map(|bar| bar.children().to_vec()).unwrap_or_default();
            let mut found = Vec::new();
            while let Some(id) = left.pop() {
                let node = &shown.tree[&id];
                if matches!(node.role(), Role::Button | Role::Slider) {
                    found.extend(place(node).map(|area| (id, area)));
                }
                left.extend(node.children());
            }
            found
        };
        let before = ids(&shown);
        assert!(before.len() >= 2, "{size:?} at {scale}: {before:?}");
        for n in (0..40_u32).step_by(3) {
            shown.timeliness.is_live = n < 20;
            shown.timeliness.is_frozen = (20..30).contains(&n);
            shown.timeliness.ended = (n >= 30).then(|| Duration::from_secs(u64::from(10_u32.pow(n % 5))));
            shown.cine.count = (n as usize + 1).min(20);
            shown.cine.shown = Some(shown.cine.count - 1);
            shown.cine.range = n as usize / 4..=shown.cine.count - 1;
            shown.cine.is_trimmed = n > 8;
            shown.cine.is_playing = n % 3 == 1;
            shown.cine.speed = [0.1, 0.25, 0.5, 1.0, 8.0][n as usize % 5];
            shown.cine.goes_back_and_forth = n % 2 == 1;
            shown.cine.seconds = Some(f64::from(n * n) * 7.3);
            shown.cine.length = Some(f64::from(n * n) * 9.1);
            shown.cine.range = (n as usize / 4).min(shown.cine.count - 1)..=shown.cine.count - 1;
            shown.settle();
            assert_eq!(ids(&shown), before, "{size:?} at {scale}, {n}");
        }
    }
}

/// Prevents messages over the button that they confirm, over each other, or out of the picture.
#[test]
fn messages_stay_in_the_picture_and_apart() {
    let note = |text: &str, is_fault| Note { text: text.into(), is_fault };
    for (size, scale) in windows() {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        shown.banner = Some(Banner {
            title: "No frames from the probe".into(),
            text: "It is connected but sends nothing.".into(),
            is_fault: true,
        });
        shown.notes = vec![
            note("Saved /home/operator/pictures/echolume-20261123-231205-1.png", false),
            note("The loop was not saved: there are no volumes yet", true),
            note("Exporting: Volume, NRRD", false),
            note("Saved /home/operator/pictures/echolume-20261123-231205-2.frames", false),
        ];
        // An area is placed by its size of the layout before.
        shown.reading = Some(Reading { name: "recording.nii.gz".into(), share: Some(0.4), text: "40 %".into() });
        (0..3).for_each(|_| shown.settle());
        let [window, picture] = places(&shown);
        let has = |text: &str| {
            shown.drawn.iter().any(|drawn| matches!(&drawn.kind, Kind::Text { text: own, .. } if own.contains(text)))
        };
        assert!(has("Reading recording") && has("40 %"), "{size:?} at {scale}: what is read is not said");
        let messages: Vec<Area> = shown
            .drawn
            .iter()
            .filter_map(|drawn| match &drawn.kind {
                Kind::Rect { area, fill, .. } if *fill == MESSAGE.to_array() => Some(*area),
                _ => None,
            })
            .collect();
        let what = format!("{size:?} at {scale}, window {window:?}, picture {picture:?}: {messages:?}");
        assert!(!messages.is_empty(), "{what}");
        for (n, area) in messages.iter().enumerate() {
            assert!(is_inside(*area, picture), "{area:?} is not in the picture: {what}");
            assert!(messages[..n].iter().all(|other| !overlap(*area, *other)), "{area:?} covers another: {what}");
        }
        let confirmed = note("Saved /home/operator/pictures/echolume-20261123-231205-2.frames", false).text;
        let newest =
            shown.drawn.iter().any(|drawn| matches!(&drawn.kind, Kind::Text { text, .. } if *text == confirmed));
        assert!(newest, "the newest message is shown: {what}");
    }
}

/// Prevents a message over a letter of a side, a marker, a ruler or a scale, and one that makes them vanish.
#[test]
fn messages_cover_no_mark() {
    let is_fixed = |(name, _): &(String, Area)| name == "probe" || (name.len() == 1 && name.parse::<u32>().is_err());
    let is_mark = |mark: &(String, Area)| is_fixed(mark) || mark.0.parse::<u32>().is_ok() || mark.0.ends_with(" mm");
    for (size, scale) in windows() {
        let settings = "marks.lateral='right-left'\nmarks.elevation='head-feet'";
        let mut shown = Shown::sized(settings, size, scale);
        for (mode, layout) in [
            (Mode::Surface, Layout::Single),
            (Mode::Surface, Layout::Pair),
            (Mode::Volume, Layout::Four),
            (Mode::Volume, Layout::Beside),
            (Mode::Plane, Layout::Single),
            (Mode::Orthogonal, Layout::Single),
            (Mode::Tomography, Layout::Single),
        ] {
            let what = format!("{size:?} at {scale}, {mode:?} {layout:?}");
            shown.apply(Command::Mode(mode));
            shown.apply(Command::Layout(layout));
            let marks = |shown: &Shown| annotations(shown).into_iter().filter(is_mark).collect::<Vec<_>>();
            let fixed = |marks: &[(String, Area)]| marks.iter().filter(|mark| is_fixed(mark)).count();
            let before = marks(&shown);
            let (title, text) = ("No frames from the probe".into(), "It is connected but sends nothing.".into());
            shown.banner = Some(Banner { title, text, is_fault: true });
            let names = ["echolume-20261123-231205-1.png", "echolume-20261123-231206-2.png"];
            shown.notes =
                names.map(|name| Note { text: format!("Saved /home/operator/{name}"), is_fault: false }).into();
            shown.settle();
            let messages = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
                Kind::Rect { area, fill, .. } if *fill == MESSAGE.to_array() => Some(*area),
                _ => None,
            });
            let (messages, after) = (messages.collect::<Vec<_>>(), marks(&shown));
            assert!(!messages.is_empty(), "{what}");
            // Between messages, tiles of less than 140 points may have no place that is free.
            let edges = shown.scene.marks().into_iter().flat_map(|tile| tile.size);
            let is_small = edges.fold(f64::INFINITY, f64::min) < 140.0 * f64::from(scale);
            for (name, area) in &after {
                let covers = |message: &&Area| overlap(**message, *area);
                let message = messages.iter().find(covers);
                assert!(is_small || message.is_none(), "{what}: {message:?} covers {name} at {area:?}");
            }
            assert_eq!(fixed(&before), fixed(&after), "{what}");
            // In the smallest pictures a scale may give way.
            let has_room = size[0].min(size[1]) as f32 / scale >= 400.0;
            let scales = |marks: &[(String, Area)]| marks.iter().any(|(name, _)| name.ends_with(" mm"));
            assert!(!has_room || scales(&after) || !scales(&before), "{what}: {before:?} {messages:?}");
            (shown.banner, shown.notes) = (None, Vec::new());
            shown.settle();
        }
    }
}

/// Prevents a colour bar over anatomy, and a corner beside it that stays empty.
#[test]
fn the_colour_bar_lies_beside_what_was_recorded() {
    let steps = |count: usize| (0..=120).map(move |n| f64::from(n) / 120.0 * (count - 1) as f64);
    for (settings, is_there) in [
        ("mode='volume'", false),
        ("mode='mip'\ncamera.zoom=0.5", true),
        ("mode='volume'\ncamera.zoom=6", false),
        ("mode='plane'\nplanes.zoom=0.6", true),
        ("mode='plane'\nplanes.zoom=6", false),
    ] {
        let shown = Shown::new(settings);
        let [_, picture] = places(&shown);
        let bar = shown.drawn.iter().find_map(|drawn| match &drawn.kind {
            Kind::Rect { area, fill, .. } if fill[3] == 0 && area[2] - area[0] == 16.0 => Some(*area),
            _ => None,
        });
        assert_eq!(bar.is_some(), is_there, "{settings}: {bar:?} of {picture:?}");
        let Some([left, top, right, bottom]) = bar else { continue };
        let probe = shown.scene.probe().expect("a probe");
        let (tiling, picker) = (shown.scene.cuts_planes().then(|| shown.scene.tiling()), Picker::of(&shown.scene));
        let at = |place: DVec3| match &tiling {
            Some(tiling) => {
                let (at, away) = tiling.project(&tiling.tiles[0], place);
                (away.abs() < 1.0).then_some(at)
            }
            None => picker.project(place),
        };
        let mut seen = 0;
        for (sample, line) in
            steps(probe.samples).flat_map(|sample| steps(probe.lines.len()).map(move |line| (sample, line)))
        {
            for slice in steps(probe.slices.len()) {
                let place = probe.to_space(Indices { sample, line, slice });
                let is_in_region = place.cmpge(shown.scene.low).all() && place.cmple(shown.scene.high).all();
                let Some([x, y]) = at(place).filter(|_| is_in_region) else { continue };
                let (x, y) = (x as f32 + picture[0], y as f32 + picture[1]);
                seen += usize::from(x >= picture[0] && x < picture[2] && y >= picture[1] && y < picture[3]);
                let is_beside = x < left || x > right || y < top || y > bottom;
                assert!(is_beside, "{settings}: {sample} {line} {slice} is under {bar:?}");
            }
        }
        assert!(seen > 1000, "{settings}: {seen}");
    }
}

/// Prevents a list whose size depends on how many entries a folder has, and a folder or a recent file without its heading.
#[test]
fn the_list_of_files_keeps_its_size_and_has_headings() {
    for (size, scale) in windows() {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        let mut areas = Vec::new();
        let not_there = Some("There is no file and no folder /data/x".to_string());
        for (count, typed) in
            [(1, None), (3, Some(("/da".to_string(), None))), (60, Some(("/data/x".into(), not_there)))]
        {
            shown.files = Some(("/data/heart".into(), (0..count).map(|n| format!("{n}.mha")).collect()));
            shown.typed = typed.clone();
            (0..3).for_each(|_| shown.settle());
            areas.extend(shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
                Kind::Rect { area, fill, edge } if *fill == PANEL.to_array() && edge[3] > 0 => Some(*area),
                _ => None,
            }));
            let has = |wanted: &str| {
                shown.drawn.iter().any(|drawn| matches!(&drawn.kind, Kind::Text { text, .. } if text == wanted))
            };
            let path = typed.as_ref().map_or("/data/heart".into(), |(text, _)| format!("{text}_"));
            assert!(has("Recent") && has(&path), "{size:?} at {scale}: {path}");
            assert!(count == 1 || size[1] as f32 / scale < 400.0 || has("heart"), "{size:?} at {scale}");
            assert!(typed.and_then(|typed| typed.1).is_none_or(|fault| has(&fault)), "{size:?} at {scale}");
        }
        assert!(areas.len() == 3 && areas.iter().all(|area| *area == areas[0]), "{size:?} at {scale}: {areas:?}");
    }
}

/// Prevents a scale bar of which what is being read hides an end.
#[test]
fn the_scale_stays_in_sight_while_a_file_is_read() {
    let mut scales = 0;
    for (size, scale) in windows() {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        shown.reading = Some(Reading { name: "recording.nii.gz".into(), share: Some(0.4), text: "40 %".into() });
        (0..3).for_each(|_| shown.settle());
        let areas = |chosen: &dyn Fn(&Kind) -> Option<Area>| -> Vec<Area> {
            shown.drawn.iter().filter_map(|drawn| chosen(&drawn.kind)).collect()
        };
        let message = areas(&|kind| match kind {
            Kind::Rect { area, fill, .. } if *fill == MESSAGE.to_array() => Some(*area),
            _ => None,
        });
        let [_, picture] = places(&shown);
        let labels = areas(&|kind| match kind {
            Kind::Text { area, text, .. } if text.ends_with(" mm") && is_inside(*area, picture) => Some(*area),
            _ => None,
        });
        scales += labels.len();
        for label in labels {
            assert!(!message.iter().any(|area| overlap(*area, label)), "{size:?} at {scale}: {label:?}, {message:?}");
        }
    }
    assert!(scales > 0);
}

/// Prevents a list, a question or the help of which a part is out of the window.
#[test]
fn dialogs_fit_into_the_window() {
    // Text at other scales has sizes between these.
    for (size, scale) in windows().filter(|(_, scale)| scale.fract() == 0.0) {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        for (n, what) in
            ["help", "times", "exports", "the question", "files", "presets", "a name"].into_iter().enumerate()
        {
            // The console shows no help in a lower window.
            if n == 0 && size[1] as f32 <= 200.0 * scale {
                continue;
            }
            shown.open(n);
            let names = (0..30).map(|n| format!("recording-{n}.mha")).collect();
            shown.files = (n == 4).then(|| ("/data".into(), names));
            let own = (0..12).map(|n| format!("Preset of a rather long name {n}")).collect();
            shown.presets = (n > 4).then(|| (own, (n == 6).then(|| "W".repeat(40))));
            (0..3).for_each(|_| shown.settle());
            let [window, _] = places(&shown);
            // Their frames, and their buttons as far as they are in sight.
            let dialogs = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
                Kind::Rect { area, fill, edge } if *fill == PANEL.to_array() && edge[3] > 0 => Some(*area),
                _ => None,
            });
            let dialogs: Vec<Area> = dialogs.collect();
            assert_eq!(dialogs.len(), usize::from(n != 1), "{size:?} at {scale}: {what}");
            for dialog in dialogs {
                let area = dialog;
                assert!(is_inside(area, window), "{size:?} at {scale}: {what} at {area:?} is not in {window:?}");
            }
        }
    }
}
