//! The start line of the region: where it is drawn, and what drags, double clicks, buttons and keys do to it.

use super::shown::Shown;
use super::*;
use crate::input::Key;
use crate::keys::binding;
use crate::panels::colours::START;
use crate::panels::drawn::Kind;
use crate::region_box::{StartLine, start_line};
use crate::texts::{
    AUTO_RENDER_START as AUTO_START, CURVE_IN_THE_WAY, CUTS_IN_THE_WAY, SEVERAL_IN_THE_WAY, UNVEILING_IN_THE_WAY,
};

const FOUR: &str = "mode='surface'\nlayout='four'\nplanes.smooth={lateral=1,depth=1}\nregion.lateral=[-12,15]\nregion.depth=[30,60]\nregion.elevation=[-10,14]";
const CURVED: &str = "region.start_curve=[[-9,34],[1,42],[12,36]]";

fn curved() -> TestWindow {
    let mut window = TestWindow::new(&format!("{FOUR}\n{CURVED}"));
    window.tool(Tool::Region);
    window
}

fn shown(window: &TestWindow) -> StartLine {
    let scene = window.scene();
    start_line(&scene, &scene.tiling(), 0, window.controls.start_line()).expect("a line")
}

fn points(window: &TestWindow) -> Vec<[f64; 2]> {
    window.controls.settings().region.start_curve.clone().unwrap_or_default()
}

fn double_click(window: &mut TestWindow, at: [f64; 2]) -> Vec<Command> {
    window.now += Duration::from_secs(1);
    window.click(at);
    window.click(at)
}

#[test]
fn the_line_and_its_handles_are_on_plane_a_where_rendering_starts() {
    for turned in ["", "\nplanes.azimuth=25\nplanes.tilt=-20"] {
        let window = TestWindow::new(&format!("{FOUR}\n{CURVED}{turned}"));
        let (scene, start) = (window.scene(), shown(&window));
        let (tiling, curve) = (scene.tiling(), scene.start_curve().expect("a curve"));
        let place = |at: &[f64; 2]| tiling.point(&tiling.tiles[0], *at);
        let ends = [0, start.line.len() - 1].map(|n| place(&start.line[n]).x);
        assert!((ends[0] + 12.0).abs() < 1e-9 && (ends[1] - 15.0).abs() < 1e-9, "across the region: {ends:?}");
        assert!(start.line.iter().map(place).all(|p| (p.y - curve.depth(p.x)).abs() < 1e-9));
        for (handle, point) in start.handles.iter().zip(points(&window)) {
            let [lateral, depth, _] = scene.point_of(place(handle));
            assert!((lateral - point[0]).abs() < 1e-9 && (depth - point[1]).abs() < 1e-9);
        }
        assert_eq!(start.handles.len(), 3);
        let others = [1, 2].map(|tile| start_line(&scene, &tiling, tile, window.controls.start_line()));
        assert_eq!(others, [None, None]);
    }
    // A line that is straight is the near face, and has no handles.
    let straight = TestWindow::new(FOUR);
    let (scene, start) = (straight.scene(), shown(&straight));
    let tiling = scene.tiling();
    assert!(start.handles.is_empty() && start.line.len() == 2);
    assert!(start.line.iter().all(|at| (tiling.point(&tiling.tiles[0], *at).y - scene.low.y).abs() < 1e-9));
    // Where its form cannot be seen, and where nothing starts at it, there is none.
    for toml in [
        FOUR.to_string() + "\nplanes.azimuth=85",
        FOUR.replace("smooth={lateral=1,depth=1}", "smooth=none"),
        FOUR.replace("surface", "cube"),
        FOUR.replace("layout='four'", "layout='single'"),
    ] {
        let scene = TestWindow::new(&toml).scene();
        assert!(!scene.is_flat() && start_line(&scene, &scene.tiling(), 0, &[]).is_none(), "{toml}");
    }
}

/// Requirement: what is grabbed stays under the pointer, also on turned planes, and the other handles stay where they are.
#[test]
fn a_handle_follows_the_pointer_and_stays_in_the_region() {
    for turned in ["", "\nplanes.azimuth=20\nplanes.tilt=-15"] {
        for index in 0..3 {
            let mut window = TestWindow::new(&format!("{FOUR}\n{CURVED}{turned}"));
            window.tool(Tool::Region);
            let before = points(&window);
            let from = shown(&window).handles[index];
            // Inwards: the last one is near the side of the region.
            let to = [from[0] + [6.0, 6.0, -6.0][index], from[1] + 17.0];
            window.drag(Button::Left, from, to);
            let [x, y] = shown(&window).handles[index];
            // The slop is 3 pixels of the picture.
            assert!((x - to[0]).hypot(y - to[1]) <= 3.1, "{turned} {index}: {x} {y} {to:?}");
            let after = points(&window);
            assert!((0..3).all(|n| (after[n] == before[n]) != (n == index)), "{after:?}");
            assert_eq!(window.controls.settings().region.depth, Some([30.0, 60.0]), "no face moved");
            apply(&mut window, Command::Undo);
            assert_eq!(points(&window), before, "one step for undo");
            apply(&mut window, Command::Redo);
            assert_eq!(points(&window), after);
        }
    }
    let mut window = curved();
    for (index, to, wanted) in [
        (0, [-900.0, -900.0], [-12.0, 30.0]),
        (2, [900.0, 900.0], [15.0, 60.0]),
        (1, [900.0, 42.0], [14.0, 42.0]),
        (1, [-900.0, 42.0], [-11.0, 42.0]),
    ] {
        apply(&mut window, Command::MoveStartHandle(index, to));
        assert_eq!(points(&window)[index], wanted, "in the region, and 1 mm from its neighbours");
    }
    for wrong in [[f64::NAN, 40.0], [0.0, f64::INFINITY]] {
        assert_eq!(apply(&mut window, Command::MoveStartHandle(1, wrong)), Change::Nothing);
    }
    assert_eq!(apply(&mut window, Command::MoveStartHandle(3, [0.0, 40.0])), Change::Nothing);
}

#[test]
fn double_clicks_bend_the_line_and_add_and_remove_handles() {
    let mut window = TestWindow::new(FOUR);
    window.tool(Tool::Region);
    // Beside the handle of the near face.
    let [from, to] = [0, 1].map(|n| shown(&window).line[n]);
    let at = |share: f64| [0, 1].map(|a| from[a] + share * (to[a] - from[a]));
    assert_eq!(double_click(&mut window, at(0.2)), [Command::ToggleStartCurve]);
    assert_eq!(points(&window), [[-9.3, 30.0], [1.5, 30.0], [12.3, 30.0]], "where the straight line was");
    let Command::AddStartHandle(Some(lateral)) = double_click(&mut window, at(0.3))[0] else { panic!("no handle") };
    assert!((lateral + 3.9).abs() < 0.01 && points(&window).len() == 4 && (points(&window)[1][0] + 3.9).abs() < 0.01);
    double_click(&mut window, at(0.7));
    assert_eq!(points(&window).len(), 5);
    assert!(points(&window).windows(2).all(|two| two[0][0] < two[1][0]));
    let full = apply(&mut window, Command::AddStartHandle(Some(14.0)));
    assert!(matches!(full, Change::Refused(why) if why.contains("five handles")), "{full:?}");
    let handle = shown(&window).handles[1];
    assert_eq!(double_click(&mut window, handle), [Command::RemoveStartHandle(Some(1))]);
    assert_eq!((points(&window).len(), points(&window)[1][0]), (4, 1.5));
    let handle = shown(&window).handles[3];
    double_click(&mut window, handle);
    let few = apply(&mut window, Command::RemoveStartHandle(None));
    assert!(matches!(few, Change::Refused(why) if why.contains("Shift+G")) && points(&window).len() == 3, "{few:?}");
    for count in [4, 5, 4, 3, 0] {
        apply(&mut window, Command::Undo);
        assert_eq!(points(&window).len(), count);
    }
    // Elsewhere a double click shows the tile alone, as ever.
    let beside = [at(0.5)[0], at(0.5)[1] - 40.0];
    assert!(double_click(&mut window, beside).contains(&Command::Mode(Mode::Plane)));
}

/// By keys and buttons alone: Shift+G bends and straightens, a handle comes into the widest gap, and the one that matters least goes.
#[test]
fn buttons_and_keys_bend_the_line_without_a_pointer() {
    let key = binding(Key::Char('g'), Modifiers { shift: true, ..Modifiers::default() }).expect("a key");
    assert_eq!(key.command, Command::ToggleStartCurve);
    let mut shown = Shown::new(&format!("{FOUR}\n{CURVED}"));
    let labels = |shown: &Shown| -> Vec<String> {
        shown.tree.values().filter_map(|node| node.label().map(str::to_string)).collect()
    };
    let has = |shown: &Shown, name: &str| labels(shown).iter().any(|known| known == name);
    assert!(has(&shown, "Curved line") && !has(&shown, "Add handle"), "a line that is bent can be straightened");
    shown.apply(Command::Tool(Tool::Region));
    for name in ["Handle 1", "Handle 2", "Handle 3", "Add handle", "Remove handle"] {
        assert!(has(&shown, name), "{name}: {:?}", labels(&shown));
    }
    let of = |shown: &Shown| shown.controls.settings().region.start_curve.clone().unwrap_or_default();
    shown.apply(Command::AddStartHandle(None));
    assert_eq!((of(&shown).len(), of(&shown)[2][0]), (4, 6.5));
    // It bends nothing: it lies on the line, and is the one that goes.
    shown.apply(Command::MoveStartHandle(1, [1.0, 48.0]));
    shown.apply(Command::RemoveStartHandle(None));
    assert_eq!(of(&shown), [[-9.0, 34.0], [1.0, 48.0], [12.0, 36.0]]);
    shown.apply(Command::ToggleStartCurve);
    assert!(of(&shown).is_empty() && has(&shown, "Curved line") && !has(&shown, "Add handle"));
    shown.apply(Command::Undo);
    assert_eq!(of(&shown).len(), 3);
    // The line goes with the box, and stays where a face moves.
    shown.apply(Command::MoveRegion([1.0, 2.0, 3.0]));
    assert_eq!(of(&shown), [[-8.0, 36.0], [2.0, 50.0], [13.0, 38.0]]);
    shown.apply(Command::MoveFace(Face { axis: 1, high: false }, -3.0));
    assert_eq!(of(&shown), [[-8.0, 36.0], [2.0, 50.0], [13.0, 38.0]]);
    shown.apply(Command::Mode(Mode::Tomography));
    assert!(!has(&shown, "Curved line"));
    let refused = shown.controls.apply(&Command::ToggleStartCurve, Some(&shown.scene));
    assert_eq!(refused, Change::Settings, "what is bent is made straight in any mode");
    let refused = shown.controls.apply(&Command::ToggleStartCurve, Some(&shown.scene));
    assert!(matches!(refused, Change::Refused(why) if why.contains("of a rendering")), "{refused:?}");
}

/// Green, over its dark edge, with a round handle at each point, and only while the tool for the region is chosen.
#[test]
fn the_line_is_drawn_in_green_with_round_handles() {
    let mut shown = Shown::new(&format!("{FOUR}\n{CURVED}"));
    let greens = |shown: &Shown| {
        let is_green = |kind: &Kind| match kind {
            Kind::Line { colour, .. } | Kind::Circle { fill: colour, .. } => *colour == START.to_array(),
            _ => false,
        };
        shown.drawn.iter().filter(|drawn| is_green(&drawn.kind)).count()
    };
    assert_eq!(greens(&shown), 0);
    shown.apply(Command::Tool(Tool::Region));
    assert!(greens(&shown) > 50, "{}", greens(&shown));
}

/// What is in the way is named, also where several things are: cuts together with the automatic start were refused without it.
#[test]
fn a_look_that_draws_dark_and_bright_says_what_is_in_the_way() {
    let all = "volume.transfer=[{at=0,colour=[1,1,1],opacity=1},{at=1,colour=[1,1,1],opacity=1}]";
    let (cut, fluid) = ("cuts=[{contour=[[-3,-2],[4,-2],[0,3]]}]", "unveil.enabled=true");
    for (removers, why) in [
        (vec![cut], CUTS_IN_THE_WAY),
        (vec![fluid], UNVEILING_IN_THE_WAY),
        (vec![CURVED], CURVE_IN_THE_WAY),
        (vec![cut, fluid], SEVERAL_IN_THE_WAY),
        (vec![cut, CURVED], SEVERAL_IN_THE_WAY),
        (vec![cut, fluid, CURVED], SEVERAL_IN_THE_WAY),
    ] {
        let toml = format!("mode='volume'\n{}", removers.join("\n"));
        let window = TestWindow::new(&toml);
        let look = settings("", &format!("mode='volume'\n{all}"));
        assert_eq!(window.controls.with_look(&look, &window.scene()), Err(why), "{removers:?}");
    }
    // Where both are drawn already, nothing that removes can be switched on.
    let mut window = TestWindow::new(&format!("mode='volume'\n{all}"));
    assert_eq!(apply(&mut window, Command::ToggleStartCurve), Change::Refused(CURVE_IN_THE_WAY));
    let auto = SLIDERS.iter().position(|slider| slider.name == AUTO_START).expect("a slider");
    let refused = apply(&mut window, Command::SetSlider(auto, 1.0));
    assert_eq!(refused, Change::Refused(UNVEILING_IN_THE_WAY));
}
