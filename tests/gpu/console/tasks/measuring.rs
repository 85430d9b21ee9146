//! Tasks of measuring and of marking, held against the ball of the phantom.

use super::*;

pub(super) fn nose(user: &mut User) -> String {
    user.letter('7');
    user.letter('m');
    let radius = user.ball.1;
    user.click_plane(-radius, 0.0);
    user.click_plane(radius, 0.0);
    user.measured(0, 2.0 * radius, LENGTH);
    user.count()
}

pub(super) fn profile(user: &mut User) -> String {
    user.on_planes();
    user.letter('n');
    [[15.0, 0.0], [0.0, 0.0], [0.0, 9.0]].into_iter().for_each(|[right, down]| user.click_plane(right, down));
    user.measured(0, 90.0, 0.1);
    user.count()
}

pub(super) fn circumference(user: &mut User) -> String {
    user.on_planes();
    user.letter('e');
    let radius = user.ball.1;
    [[0.0, -radius], [0.0, radius], [radius, 0.0]].into_iter().for_each(|[right, down]| user.click_plane(right, down));
    user.measured(1, TAU * radius, LENGTH);
    user.count()
}

pub(super) fn shadow(user: &mut User) -> String {
    user.on_planes();
    user.letter('o');
    user.trace(0.0);
    let area = PI * user.ball.1.powi(2) / 100.0;
    user.measured(0, area, 0.01 * area);
    user.count()
}

/// The path along the ball between two places half a radian to the left and to the right of its front. The surface that is found lies within
/// the width of a sample and of a slice of the ball.
pub(super) fn cheek(user: &mut User) -> String {
    // A length on the surface is as exact as the rays are dense.
    let mut settings = ball_options(&user.folder).settings;
    settings.ray.subsampling = 1;
    let kept = user.at_another(settings, ball);
    user.on_planes();
    user.letter('1');
    user.letter('u');
    let (centre, radius) = user.ball;
    let scene = user.scene();
    for angle in [-0.5_f64, 0.5] {
        let place = centre + (scene.rays.right * angle.sin() - scene.rays.forward * angle.cos()) * radius;
        let at = Picker::of(&scene).project(place).expect("in front");
        user.click(in_window(at));
    }
    user.measured(0, radius, LENGTH);
    user.console = kept;
    user.count()
}

/// Contours every 4 mm. Their volume is that of the ball to 1 % (tests/unit_pure/measure.rs); those of the mouse, to a pixel, were 0.3 % off.
pub(super) fn bladder(user: &mut User) -> String {
    const STEP: f64 = 4.0;
    let (radius, centre) = (user.ball.1, user.ball.0);
    user.letter('7');
    user.letter('w');
    let planes = (2.0 * radius / STEP).floor() as usize;
    let first = -0.5 * STEP * (planes - 1) as f64;
    user.console.execute(&Command::StepPlane(first), Instant::now());
    user.settle();
    for n in 0..planes {
        let off = (user.scene().tiling().tiles[0].plane.at - centre).dot(user.scene().tiling().tiles[0].plane.normal);
        assert!((off - first - STEP * n as f64).abs() < 1e-6, "the wheel moved the plane to {off}");
        user.trace(off);
        user.wheel(STEP);
    }
    user.key(Key::Enter);
    let volume = 4.0 / 3.0 * PI * radius.powi(3) / 1000.0;
    user.measured(0, volume, 0.01 * volume);
    format!("{} + 2 a plane", user.actions - 2 * planes)
}

/// The voxels of the ball. Its edge is one sample and one slice wide, and half of a compressed echo lies at its outer side: 1.8 % too many.
pub(super) fn bright_body(user: &mut User) -> String {
    user.letter('k');
    user.until("result", |user| (!user.console.controls().measures().is_empty()).then_some(()));
    let volume = 4.0 / 3.0 * PI * user.ball.1.powi(3) / 1000.0;
    user.measured(0, volume, 0.02 * volume);
    user.count()
}

/// The voxels of strokes on planes that are farther apart than the brush is wide: each is a cylinder between two halves of a ball.
pub(super) fn hand_label(user: &mut User) -> String {
    let [radius, half, step] = [4.0, 10.0, 9.0_f64];
    let kept = user.at_another(ball_options(&user.folder).settings, narrow_ball);
    user.letter('7');
    user.shift('l');
    user.until("labels", |user| user.labelled());
    user.console.execute(&Command::BrushRadius(radius), Instant::now());
    let planes = 3;
    for _ in 0..planes {
        let at = user.scene().tiling().tiles[0].plane;
        let way: Vec<_> = (-8..=8).map(|n| user.on_tile(at.at + at.right * half * f64::from(n) / 8.0)).collect();
        user.drag(&way);
        user.wheel(step);
    }
    let truth = f64::from(planes) * PI * radius.powi(2) * (2.0 * half + 4.0 / 3.0 * radius) / 1000.0;
    let found = user.labelled().expect("labels");
    assert!((found / truth - 1.0).abs() < 0.01, "{found} of {truth}");
    user.console = kept;
    format!("{} + 2 a plane", user.actions - 2 * planes as usize)
}

pub(super) fn grown_label(user: &mut User) -> String {
    let kept = user.at_another(ball_options(&user.folder).settings, narrow_ball);
    user.console.describe(true);
    user.letter('7');
    user.shift('l');
    user.click_on(Role::Button, "Grow bright");
    user.click_plane(5.0, -3.0);
    let found = user.until("body", |user| user.labelled().filter(|found| *found > 0.0));
    let truth = 4.0 / 3.0 * PI * user.ball.1.powi(3) / 1000.0;
    assert!((found / truth - 1.0).abs() < 0.02, "{found} of {truth}");
    user.console = kept;
    user.count()
}

pub(super) fn structure(user: &mut User) -> String {
    user.on_planes();
    user.letter('i');
    user.click_plane(3.0, 4.0);
    user.types("nose");
    user.key(Key::Enter);
    assert_eq!((user.texts(), user.console.controls().typing()), (vec!["nose".to_string()], None));
    user.count()
}

pub(super) fn arrow(user: &mut User) -> String {
    user.on_planes();
    user.letter('y');
    user.click_plane(3.0, 4.0);
    user.click_plane(12.0, 14.0);
    user.types("lip");
    user.key(Key::Enter);
    assert_eq!((user.texts(), user.console.controls().typing()), (vec!["lip".to_string()], None));
    user.count()
}

pub(super) fn body_mark(user: &mut User) -> String {
    user.shift('b');
    let button = user.shown(Role::Button, "Fetus, breech").expect("a button");
    user.click(button);
    let picture = user.scene().picture_size().map(f64::from);
    let mark = user.console.controls().body_marks()[0];
    let [x, y] = centre_of(&mark, picture);
    let place = [x + 0.2 * mark.size * picture[1], y];
    user.click(in_window(place));
    let mark = user.console.controls().body_marks()[0];
    assert_eq!(mark.body, echolume::low_level::scene::Body::FetusBreech);
    let off = probe_of(&mark, picture);
    assert!((off[0] - place[0]).hypot(off[1] - place[1]) < 0.1, "{off:?}, {place:?}");
    user.count()
}

pub(super) fn measurement(user: &mut User) -> String {
    user.has_caliper(10.0);
    let at = user.shown(Role::Button, "1 Caliper").expect("a line of the list");
    user.click(at);
    assert_eq!(user.console.controls().typing(), Some(0), "a click on the list");
    user.types("crl");
    user.key(Key::Enter);
    assert_eq!(user.texts(), ["crl"]);
    user.measured(0, 10.0, 1e-6);
    user.count()
}

pub(super) fn caliper(user: &mut User) -> String {
    user.has_caliper(10.0);
    let way = [10.0, 12.0, 16.0].map(|right| user.place(right, 0.0)).map(|place| user.on_tile(place));
    user.drag(&way);
    user.measured(0, 16.0, LENGTH);
    assert_eq!(user.console.controls().measures().len(), 1, "no other one");
    user.count()
}

pub(super) fn wrong_trace(user: &mut User) -> String {
    user.on_planes();
    user.letter('o');
    user.trace(0.0);
    assert_eq!(user.console.controls().measures().len(), 1);
    user.actions = 0;
    user.control('z');
    assert_eq!(user.console.controls().measures().len(), 0);
    user.count()
}

pub(super) fn sides(user: &mut User) -> String {
    user.on_planes();
    user.click_on(Role::Tab, "Marks");
    user.click_on(Role::Button, "right to left");
    let scene = user.scene();
    let tiles = scene.marks_with(&user.console.controls().settings().drawn.marks);
    assert_eq!(tiles[0].letters.iter().map(|(_, letter)| *letter).collect::<Vec<_>>(), ["R", "L"]);
    user.count()
}
