//! Cuts by gestures: what is drawn round on a rendering is within the cut, in parallel and in perspective; undo, and the side that stays.

use super::*;
use crate::input::Phase;
use crate::scene::cuts::CutShape;
use crate::scene::{Cut, KeptSide, MAX_CUT_POINTS};

/// Drags round a circle of the picture.
fn circle(window: &mut TestWindow, centre: [f64; 2], radius: f64, steps: u32) {
    let on = |n: u32| {
        let (sin, cos) = (f64::from(n) * std::f64::consts::TAU / f64::from(steps)).sin_cos();
        [centre[0] + radius * cos, centre[1] + radius * sin]
    };
    window.input(Input::Moved(window.at(on(0))));
    window.input(Input::Button { button: Button::Left, pressed: true });
    (1..steps).for_each(|n| _ = window.input(Input::Moved(window.at(on(n)))));
    assert!(window.controls.outline().len() > 8, "it is shown while it is drawn");
    window.input(Input::Button { button: Button::Left, pressed: false });
    assert!(window.controls.outline().is_empty());
}

fn cuts(window: &TestWindow) -> Vec<Cut> {
    window.controls.settings().cuts.clone()
}

/// True if a cut removes places along the ray of a pixel, all or none of them.
fn removes(scene: &Scene, shape: &CutShape, pixel: [f64; 2]) -> bool {
    let (origin, direction) = super::super::picking::Picker::of(scene).ray(pixel);
    let away = (scene.rays.target - origin).length();
    let places = [0.8, 1.0, 1.2].map(|share| shape.removes(origin + direction * away * share));
    assert!(places == [places[0]; 3], "{places:?} at {pixel:?}");
    places[0]
}

#[test]
fn what_is_drawn_round_is_cut_along_the_view() {
    for toml in [
        "mode='volume'",
        "mode='surface'\ncamera.azimuth=30\ncamera.elevation=-20\ncamera.roll=15",
        "mode='mip'\ncamera.field_of_view=40\ncamera.azimuth=-50",
        "mode='volume'\nlayout='four'",
        "layout='pair'",
        "mode='volume'\nray.subsampling=2\nregion.depth=[30, 80]\ncamera.field_of_view=30",
    ] {
        let mut window = TestWindow::new(toml);
        window.tool(Tool::Cut);
        let scene = window.scene();
        let [x, y] = super::super::picking::Picker::of(&scene).centre();
        let [x, y] = [x + 11.0, y - 7.0];
        // In a pair, the contour is drawn on the volume.
        let left = if scene.is_pair() { super::super::picking::Picker::of(&scene).corner()[0] } else { 0.0 };
        circle(&mut window, [x - left, y], 40.0, 100);
        let made = cuts(&window);
        assert_eq!(made.len(), 1, "{toml}");
        assert!((8..=60).contains(&made[0].contour.len()), "{toml}: {} corners", made[0].contour.len());
        assert_eq!((made[0].keep, made[0].depth), (KeptSide::Outside, None));
        let scene = window.scene();
        let Some(shape) = scene.cuts().next() else { panic!("{toml}: no cut") };
        for n in 0..24 {
            let (sin, cos) = (f64::from(n) * 0.2618).sin_cos();
            for (radius, expected) in [(39.0, true), (20.0, true), (41.0, false), (60.0, false)] {
                assert_eq!(removes(&scene, &shape, [x + radius * cos, y + radius * sin]), expected, "{toml}: {radius}");
            }
        }
        // The view turns, and what was removed stays removed.
        let inside = scene.rays.target;
        let was = shape.removes(inside);
        apply(&mut window, Command::Rotate([70.0, 25.0]));
        assert_eq!(window.scene().cuts().next().map(|cut| cut.removes(inside)), Some(was));
        assert_eq!(cuts(&window), made);
    }
}

#[test]
fn a_cut_is_undone_and_done_again_and_all_are_removed_at_once() {
    let mut window = TestWindow::new("mode='volume'");
    window.tool(Tool::Cut);
    let [x, y] = super::super::picking::Picker::of(&window.scene()).centre();
    circle(&mut window, [x, y], 30.0, 60);
    assert_eq!(apply(&mut window, Command::KeepSide(KeptSide::Inside)), Change::Tool);
    circle(&mut window, [x, y], 90.0, 200);
    let both = cuts(&window);
    assert_eq!(both.iter().map(|cut| cut.keep).collect::<Vec<_>>(), [KeptSide::Outside, KeptSide::Inside]);
    assert_eq!(apply(&mut window, Command::Undo), Change::Settings);
    assert_eq!(cuts(&window), both[..1]);
    apply(&mut window, Command::Undo);
    assert!(cuts(&window).is_empty());
    apply(&mut window, Command::Redo);
    apply(&mut window, Command::Redo);
    assert_eq!(cuts(&window), both);
    assert_eq!(apply(&mut window, Command::ClearCuts), Change::Settings);
    assert!(cuts(&window).is_empty());
    assert_eq!(apply(&mut window, Command::ClearCuts), Change::Nothing);
    apply(&mut window, Command::Undo);
    assert_eq!(cuts(&window), both);
    // The slider is of the last cut; at 0 that goes through.
    let depth = SLIDERS.iter().position(|slider| slider.name == "Depth of cut").expect("a slider");
    apply(&mut window, Command::SetSlider(depth, 12.0));
    assert_eq!(cuts(&window).iter().map(|cut| cut.depth).collect::<Vec<_>>(), [None, Some(12.0)]);
    apply(&mut window, Command::SetSlider(depth, 0.0));
    assert_eq!(cuts(&window), both);
}

#[test]
fn what_encloses_nothing_cuts_nothing() {
    let mut window = TestWindow::new("mode='volume'");
    window.tool(Tool::Cut);
    let [x, y] = super::super::picking::Picker::of(&window.scene()).centre();
    window.click([x, y]);
    window.drag(Button::Left, [x, y], [x + 50.0, y]);
    assert!(cuts(&window).is_empty(), "a click, and a way along a line");
    // A drag that is interrupted leaves nothing behind.
    window.input(Input::Moved(window.at([x, y])));
    window.input(Input::Button { button: Button::Left, pressed: true });
    (0..9).for_each(|n| _ = window.input(Input::Moved(window.at([x + 9.0 * f64::from(n), y]))));
    assert!(!window.controls.outline().is_empty());
    window.input(Input::FocusLost);
    assert!(window.controls.outline().is_empty());
    // A contour beside the volume, and points that are none.
    let mut far = TestWindow::new("mode='volume'\ncamera.zoom=0.2");
    far.tool(Tool::Cut);
    for at in [[4.0, 4.0], [16.0, 4.0], [16.0, 16.0]] {
        apply(&mut far, if at == [4.0, 4.0] { Command::BeginCut(at) } else { Command::CutAlong(at) });
    }
    assert!(matches!(apply(&mut far, Command::EndCut), Change::Refused(_)));
    assert_eq!(apply(&mut far, Command::BeginCut([f64::NAN, 0.0])), Change::Nothing);
    assert_eq!(apply(&mut far, Command::CutAlong([1.0, 0.0])), Change::Nothing, "nothing has begun");
    assert_eq!(apply(&mut far, Command::EndCut), Change::Nothing);
    // The block has no cuts; planes have no tool for them.
    let mut block = TestWindow::new("mode='cube'");
    block.tool(Tool::Cut);
    let [x, y] = super::super::picking::Picker::of(&block.scene()).centre();
    circle(&mut block, [x, y], 40.0, 100);
    assert!(cuts(&block).is_empty());
}

#[test]
fn a_long_scribble_has_as_many_corners_as_a_cut_may_have() {
    let mut window = TestWindow::new("mode='volume'");
    let [x, y] = super::super::picking::Picker::of(&window.scene()).centre();
    apply(&mut window, Command::BeginCut([x, y]));
    for n in 1..5000 {
        let (sin, cos) = (f64::from(n) * 2.4).sin_cos();
        let radius = 100.0 * (0.3 + 0.7 * (f64::from(n) * 0.37).sin().abs());
        apply(&mut window, Command::CutAlong([x + radius * cos, y + radius * sin]));
    }
    assert_eq!(apply(&mut window, Command::EndCut), Change::Settings);
    assert!((100..=MAX_CUT_POINTS).contains(&cuts(&window)[0].contour.len()));
    // As many cuts as a scene may have.
    let one = cuts(&window)[0].clone();
    for _ in 0..40 {
        apply(&mut window, Command::BeginCut([x, y]));
        apply(&mut window, Command::CutAlong([x + 20.0, y]));
        apply(&mut window, Command::CutAlong([x, y + 20.0]));
        apply(&mut window, Command::EndCut);
    }
    assert_eq!((cuts(&window).len(), &cuts(&window)[0]), (32, &one));
}

#[test]
fn a_mode_that_cannot_have_cuts_says_why() {
    let mut window = TestWindow::new("mode='surface'\nsurface.sign='dark'");
    window.tool(Tool::Cut);
    let [x, y] = super::super::picking::Picker::of(&window.scene()).centre();
    circle(&mut window, [x, y], 40.0, 100);
    let made = cuts(&window);
    assert_eq!(made.len(), 1);
    assert_eq!(apply(&mut window, Command::Mode(Mode::Mixed)), Change::Refused(crate::texts::CUTS_IN_THE_WAY));
    assert_eq!((window.controls.settings().mode, cuts(&window)), (Mode::Surface, made));
    apply(&mut window, Command::ClearCuts);
    assert_eq!(apply(&mut window, Command::Mode(Mode::Mixed)), Change::Settings);
}

/// A second finger, or a palm that the screen rejects, ends a contour without a cut; the finger that is left draws none.
#[test]
fn a_contour_of_a_finger_is_given_up_when_another_comes_or_the_touch_is_cancelled() {
    let mut window = TestWindow::new("mode='volume'");
    window.tool(Tool::Cut);
    let scene = window.scene();
    let [x, y] = super::super::picking::Picker::of(&scene).centre();
    let touch = |window: &mut TestWindow, id: u64, phase: Phase, right: f64| {
        let at = window.at([x + right, y]);
        window.input(Input::Touch { finger: id, phase, at });
    };
    let begin = |window: &mut TestWindow| {
        touch(window, 1, Phase::Down, 0.0);
        (1..8).for_each(|n| touch(window, 1, Phase::Moved, 12.0 * f64::from(n)));
        assert!(!window.controls.outline().is_empty(), "it is shown while it is drawn");
    };
    begin(&mut window);
    touch(&mut window, 1, Phase::Cancelled, 84.0);
    assert!(window.controls.outline().is_empty() && cuts(&window).is_empty());
    begin(&mut window);
    touch(&mut window, 2, Phase::Down, 30.0);
    assert!(window.controls.outline().is_empty());
    touch(&mut window, 2, Phase::Up, 30.0);
    (1..8).for_each(|n| touch(&mut window, 1, Phase::Moved, -12.0 * f64::from(n)));
    touch(&mut window, 1, Phase::Up, -84.0);
    assert!(window.controls.outline().is_empty() && cuts(&window).is_empty());
}

/// The caller knows where the surface is: gestures give the places on the picture, and strokes come back.
#[test]
fn strokes_of_a_brush_are_one_cut_and_each_is_taken_back() {
    let mut window = TestWindow::new("mode='surface'");
    window.tool(Tool::Brush);
    let pressed = window.click([200.0, 220.0]);
    assert_eq!(pressed, [Command::BeginCut([200.0, 220.0]), Command::EndCut], "a click is a stroke of one point");
    window.controls.take_stroke();
    assert_eq!(window.click([200.0, 220.0]), pressed, "a second one is no double click");
    assert_eq!(window.controls.take_stroke(), [[200.0, 220.0]]);
    window.drag(Button::Left, [200.0, 220.0], [300.0, 220.0]);
    assert!(window.controls.take_stroke().len() > 8 && cuts(&window).is_empty());
    let scene = window.scene();
    let stroke = |n: usize| vec![vec![[0.0, 40.0 + n as f64, 0.0], [5.0, 40.0, 0.0]]];
    let brush = |window: &mut TestWindow, n| window.controls.brush(stroke(n), &scene);
    assert_eq!(brush(&mut window, 1), Change::Settings);
    assert_eq!(brush(&mut window, 2), Change::Settings);
    let strokes = |window: &TestWindow| -> Vec<usize> {
        cuts(window).iter().map(|cut| cut.brush.as_ref().map_or(0, |brush| brush.strokes.len())).collect()
    };
    assert_eq!(strokes(&window), [2]);
    assert!(!SLIDERS.iter().any(|s| s.name == "Depth of cut" && s.applies(window.controls.settings())));
    apply(&mut window, Command::BrushRadius(7.5));
    brush(&mut window, 3);
    assert_eq!(strokes(&window), [2, 1]);
    assert_eq!(cuts(&window)[1].brush.as_ref().map(|brush| brush.radius), Some(7.5));
    apply(&mut window, Command::Undo);
    apply(&mut window, Command::Undo);
    assert_eq!(strokes(&window), [1]);
    apply(&mut window, Command::BrushRadius(1e9));
    assert_eq!(window.controls.brush_radius(), 20.0);
    // A long one is divided, and none of it is lost; one step of undo takes all of it back.
    let long: Vec<[f64; 3]> = (0..1100).map(|n| [0.02 * f64::from(n), 40.0, 0.0]).collect();
    assert_eq!(window.controls.brush(vec![long.clone()], &scene), Change::Settings);
    let made = cuts(&window);
    let parts: Vec<_> =
        made[1..].iter().filter_map(|cut| cut.brush.as_ref()).flat_map(|brush| &brush.strokes).collect();
    assert_eq!(parts.iter().map(|part| part.len()).collect::<Vec<_>>(), [512, 512, 78]);
    assert!(parts.windows(2).all(|two| two[0].last() == two[1].first()) && parts[2].last() == long.last());
    apply(&mut window, Command::Undo);
    assert_eq!(strokes(&window), [1]);
    // Bounded: a cut has so many points, and a scene so many cuts.
    for n in 0..MAX_CUT_POINTS {
        brush(&mut window, n);
    }
    assert!(cuts(&window).iter().all(|cut| cut.brush.as_ref().is_some_and(|brush| brush.points() <= MAX_CUT_POINTS)));
    for n in 0..40 {
        apply(&mut window, Command::BrushRadius(1.0 + f64::from(n) / 10.0));
        if let Change::Refused(why) = brush(&mut window, 1) {
            assert!(n > 20 && why.contains("as many cuts"), "{n}: {why}");
        }
    }
    assert_eq!(cuts(&window).len(), 32);
    apply(&mut window, Command::ClearCuts);
    assert!(cuts(&window).is_empty());
}
