//! The curved plane by gestures: its line is where it was clicked, its points are dragged, and distances on it are right.

use super::*;
use crate::measure::{outcome, overlay};
use crate::scene::{Curve, MeasureKind};
use crate::workspace::{self, Origin};

/// Where a tile shows coordinates of its plane, pixels of the picture.
fn pixel(window: &TestWindow, tile: usize, point: [f64; 2]) -> [f64; 2] {
    let (scene, name) = (window.scene(), [PlaneName::A, PlaneName::B, PlaneName::C][tile]);
    let tiling = scene.tiling();
    tiling.project(&tiling.tiles[tile], scene.place_on_plane(name, point)).0
}

fn click(window: &mut TestWindow, at: [f64; 2]) {
    // Not a double click.
    window.now += Duration::from_secs(1);
    window.click(at);
}

fn curve(window: &TestWindow) -> Option<Curve> {
    window.controls.settings().planes.curve.clone()
}

fn near(curve: &Curve, plane: PlaneName, points: &[[f64; 2]]) {
    assert_eq!((curve.plane, curve.points.len()), (plane, points.len()));
    for (found, wanted) in curve.points.iter().zip(points) {
        assert!((found[0] - wanted[0]).hypot(found[1] - wanted[1]) < 1e-3, "{found:?} {wanted:?}");
    }
}

const POINTS: [[f64; 2]; 3] = [[-12.0, 30.0], [0.0, 42.0], [15.0, 35.0]];

#[test]
fn a_line_is_drawn_on_any_plane_by_clicks_and_ends_by_a_double_click() {
    for (toml, tile, plane) in [
        ("mode='orthogonal'", 0, PlaneName::A),
        ("mode='orthogonal'\nplanes.tilt=20\nplanes.zoom=1.5", 1, PlaneName::B),
        ("mode='surface'\nlayout='four'", 2, PlaneName::C),
    ] {
        let mut window = TestWindow::new(toml);
        window.tool(Tool::Curve);
        let points = if plane == PlaneName::C { [[-12.0, -5.0], [0.0, 7.0], [15.0, 2.0]] } else { POINTS };
        for (n, point) in points.iter().enumerate() {
            let at = pixel(&window, tile, *point);
            click(&mut window, at);
            assert_eq!(window.controls.line().map(|line| line.points.len()), Some(n + 1), "{toml}");
        }
        assert_eq!(curve(&window), None, "it is not over yet");
        // The second of two clicks at the last point.
        let at = pixel(&window, tile, points[2]);
        assert_eq!(window.click(at), [Command::EndCurve]);
        near(&curve(&window).expect("a curve"), plane, &points);
        let settings = window.controls.settings();
        assert_eq!((settings.mode, settings.layout, settings.planes.plane), (Mode::Orthogonal, Layout::Single, plane));
        assert_eq!(window.scene().tiling().tiles.len(), 4);
        // As one step.
        let after = window.controls.settings().clone();
        assert_eq!(apply(&mut window, Command::Undo), Change::Settings);
        assert_eq!(curve(&window), None);
        assert_eq!(apply(&mut window, Command::Redo), Change::Settings);
        assert_eq!(*window.controls.settings(), after);
    }
}

#[test]
fn a_drag_draws_a_straight_line_and_its_ends_are_dragged_afterwards() {
    let mut window = TestWindow::new("mode='plane'");
    window.tool(Tool::Curve);
    let [from, _, to] = POINTS;
    let ends = [from, to].map(|point| pixel(&window, 0, point));
    window.drag(Button::Left, ends[0], ends[1]);
    near(&curve(&window).expect("a curve"), PlaneName::A, &[from, to]);
    assert_eq!(window.scene().tiling().tiles.len(), 2, "the plane, and the section beside it");
    // A point that is grabbed follows the pointer; a drag is one step.
    let moved = [-20.0, 50.0];
    let (start, end) = (pixel(&window, 0, from), pixel(&window, 0, moved));
    window.drag(Button::Left, start, end);
    let found = curve(&window).expect("a curve").points[0];
    let slop = 6.0 / 2.0 * window.scene().tiling().pixel;
    assert!((found[0] - moved[0]).hypot(found[1] - moved[1]) <= slop + 1e-6, "{found:?}");
    apply(&mut window, Command::Undo);
    near(&curve(&window).expect("a curve"), PlaneName::A, &[from, to]);
    // A click on a point sets no other, and none onto the next one is taken.
    click(&mut window, start);
    assert!(window.controls.line().is_none());
    assert_eq!(apply(&mut window, Command::MoveCurvePoint(0, to)), Change::Nothing, "both ends in one place");
    assert_eq!(apply(&mut window, Command::MoveCurvePoint(9, to)), Change::Nothing);
    assert_eq!(apply(&mut window, Command::MoveCurvePoint(0, [f64::NAN, 0.0])), Change::Nothing);
    assert_eq!(apply(&mut window, Command::ClearCurve), Change::Settings);
    assert_eq!((curve(&window), window.scene().tiling().tiles.len()), (None, 1));
    apply(&mut window, Command::Undo);
    assert!(curve(&window).is_some());
}

#[test]
fn a_line_in_work_is_taken_back_left_and_refused_in_words() {
    let mut window = TestWindow::new("mode='surface'");
    // Without a plane there is nothing to draw on: the tool shows three.
    assert_eq!(apply(&mut window, Command::Tool(Tool::Curve)), Change::Settings);
    assert_eq!(window.controls.settings().mode, Mode::Orthogonal);
    assert_eq!(apply(&mut window, Command::EndCurve), Change::Nothing);
    assert_eq!(apply(&mut window, Command::CurvePoint(PlaneName::A, [1.0, 30.0])), Change::Marks);
    assert!(matches!(apply(&mut window, Command::EndCurve), Change::Refused(why) if why.contains("two points")));
    assert!(matches!(apply(&mut window, Command::CurvePoint(PlaneName::B, [1.0, 30.0])), Change::Refused(_)));
    assert_eq!(apply(&mut window, Command::CurvePoint(PlaneName::A, [1.0, 30.0])), Change::Nothing, "the same");
    assert_eq!(apply(&mut window, Command::CurvePoint(PlaneName::A, [f64::INFINITY, 3.0])), Change::Nothing);
    apply(&mut window, Command::CurvePoint(PlaneName::A, [9.0, 33.0]));
    assert_eq!(apply(&mut window, Command::Undo), Change::Marks);
    assert_eq!(window.controls.line().map(|line| line.points.len()), Some(1));
    assert_eq!(apply(&mut window, Command::CancelCurve), Change::Marks);
    assert!(window.controls.line().is_none() && curve(&window).is_none());
    (0..64).for_each(|n| _ = apply(&mut window, Command::CurvePoint(PlaneName::A, [f64::from(n), 40.0])));
    assert!(matches!(apply(&mut window, Command::CurvePoint(PlaneName::A, [80.0, 40.0])), Change::Refused(_)));
    // Another tool leaves the line.
    window.tool(Tool::Rotate);
    assert!(window.controls.line().is_none());
}

/// An arc of 20 mm on plane A, with a point each 15 degrees: the distance on the section is that along the arc, and with a height over the plane the hypotenuse
/// of both.
#[test]
fn a_caliper_on_the_section_measures_along_the_line() {
    let radius = 20.0;
    let points: Vec<[f64; 2]> = (0..11)
        .map(|n| {
            let (sin, cos) = f64::to_radians(-75.0 + 15.0 * f64::from(n)).sin_cos();
            [radius * sin, 35.0 + radius * cos]
        })
        .collect();
    let mut window = TestWindow::new(&format!("mode='orthogonal'\nplanes.curve={{points={points:?}}}"));
    window.tool(Tool::Measure(MeasureKind::Distance));
    let on_section = |window: &TestWindow, degrees: f64, up: f64| {
        let (scene, (sin, cos)) = (window.scene(), degrees.to_radians().sin_cos());
        let place = scene.place_on_plane(PlaneName::A, [radius * sin, 35.0 + radius * cos]) + DVec3::Z * up;
        let tiling = scene.tiling();
        let (at, off) = tiling.project(&tiling.tiles[3], place);
        assert!(off < 0.02, "{off} mm beside the section");
        at
    };
    for (n, (to, up)) in [(40.0, 0.0), (40.0, 6.0), (-70.0, -8.0)].into_iter().enumerate() {
        let ends = [on_section(&window, -50.0, 0.0), on_section(&window, to, up)];
        match n {
            // By a drag, too.
            1 => window.drag(Button::Left, ends[0], ends[1]),
            _ => ends.iter().for_each(|at| click(&mut window, *at)),
        }
        let measured = window.controls.measures().last().expect("a measurement").clone();
        assert_eq!((window.controls.measures().len(), measured.kind), (n + 1, MeasureKind::Surface));
        let found = outcome::quantities(&measured).expect("results");
        let wanted = ((to + 50.0).to_radians() * radius).hypot(up);
        assert_eq!(found[0].name, "along the line");
        assert!((found[0].value - wanted).abs() < 0.1, "{} of {wanted} mm", found[0].value);
        let label = outcome::label(n + 1, &measured);
        assert!(label.ends_with(" mm along the line"), "{label}");
        let scene = window.scene();
        let section = scene.tiling().tiles[3].corner.map(f64::from);
        let drawn = overlay::drawn(&scene, None, &[measured]);
        let shown = drawn.iter().find(|drawn| drawn.tile[0] == section).expect("it is drawn on the section");
        let off = [0, 1].map(|end| {
            let at = shown.points[end].1;
            (at[0] - ends[end][0]).hypot(at[1] - ends[end][1])
        });
        assert!(off.iter().all(|off| *off < 0.6), "{off:?} pixels");
    }
    // What is straight in space is drawn on no section: there it has another length.
    let straight = crate::scene::Measurement {
        points: [points[2], points[8]].map(|[x, y]| [x, y, 0.0]).to_vec(),
        ..Default::default()
    };
    let scene = window.scene();
    let section = scene.tiling().tiles[3].corner.map(f64::from);
    assert!(overlay::drawn(&scene, None, &[straight]).iter().all(|drawn| drawn.tile[0] != section));
    // One end on A is no distance on the section; an angle is refused in words, whether clicked or dragged.
    let beside = pixel(&window, 0, [0.0, 20.0]);
    let on = on_section(&window, 10.0, 0.0);
    click(&mut window, beside);
    assert!(matches!(apply(&mut window, Command::PointOnCurve([0.0, 55.0, 0.0])), Change::Refused(_)));
    for kind in [MeasureKind::Angle, MeasureKind::Trace, MeasureKind::Ellipse, MeasureKind::Volume] {
        window.tool(Tool::Measure(kind));
        window.now += Duration::from_secs(1);
        let commands = window.click(on);
        assert!(matches!(commands[..], [Command::PointOnCurve(_)]), "{kind:?}: {commands:?}");
        assert!(matches!(apply(&mut window, commands[0]), Change::Refused(why) if why.contains("Caliper")), "{kind:?}");
        window.drag(Button::Left, on, [on[0] + 20.0, on[1] + 9.0]);
        assert!(window.controls.work().is_none(), "{kind:?}");
    }
    assert_eq!(window.controls.measures().len(), 3);
}

#[test]
fn a_workspace_keeps_the_curved_plane() {
    let mut window = TestWindow::new("mode='orthogonal'");
    window.tool(Tool::Curve);
    POINTS.iter().for_each(|point| _ = apply(&mut window, Command::CurvePoint(PlaneName::B, *point)));
    apply(&mut window, Command::EndCurve);
    let origin = Origin::of(Some("sweep.mha".into()));
    let text = workspace::text(window.controls.settings(), &origin).expect("a workspace");
    let mut table: toml::Table = text.parse().expect("TOML");
    table.remove("workspace");
    let mut layers = Layers::default();
    layers.table("workspace", table, std::path::Path::new("")).expect("settings");
    let again = layers.finish().expect("settings");
    assert_eq!(again.planes, window.controls.settings().planes);
    near(&again.planes.curve.expect("a curve"), PlaneName::B, &POINTS);
}

/// The wheel over the section steps the plane that it stands on, and a double click shows both alone.
#[test]
fn the_section_steps_and_shows_its_own_plane() {
    let mut window = TestWindow::new("mode='orthogonal'\nplanes.curve={plane='b',points=[[-9,40],[9,50]]}");
    let tile = window.scene().tiling().tiles[3].clone();
    let at = [0, 1].map(|n| f64::from(tile.corner[n]) + f64::from(tile.size[n]) / 2.0);
    window.input(Input::Moved(window.at(at)));
    let before = window.scene().plane(PlaneName::B).at;
    window.input(Input::Scroll(3.0));
    let scene = window.scene();
    let moved = scene.plane(PlaneName::B).at - before;
    assert!((moved - scene.plane(PlaneName::B).normal * 3.0).length() < 1e-9, "{moved}");
    window.now += Duration::from_secs(1);
    window.click(at);
    window.click(at);
    let settings = window.controls.settings();
    assert_eq!((settings.mode, settings.planes.plane), (Mode::Plane, PlaneName::B));
    assert_eq!(window.scene().tiling().tiles.len(), 2);
}
