//! Tasks of planes and sections.

use super::*;

pub(super) fn point(user: &mut User) -> String {
    user.letter('8');
    user.letter('s');
    let wanted = user.place(7.0, -4.0);
    let at = user.on_tile(wanted);
    user.click(at);
    let scene = user.scene();
    for name in [PlaneName::A, PlaneName::B, PlaneName::C] {
        let plane = scene.plane(name);
        let off = (wanted - plane.at).dot(plane.normal).abs();
        assert!(off < 1e-6, "plane {name:?} is {off} mm beside the point");
    }
    user.count()
}

pub(super) fn middle(user: &mut User) -> String {
    user.on_planes();
    assert!(user.console.controls().settings().planes.position.is_some());
    user.letter('j');
    let scene = user.scene();
    let off = scene.plane(PlaneName::A).at - (scene.low + scene.high) / 2.0;
    assert!(off.length() < 1e-6, "{off}");
    user.count()
}

/// The section through the ball along a line shows its outline; along a line of three points it has the length of that line.
pub(super) fn straight_section(user: &mut User) -> String {
    user.shift('c');
    let radius = user.ball.1;
    let ends = [-1.5 * radius, 1.5 * radius].map(|right| user.place(right, 0.0));
    let [from, to] = ends.map(|place| user.on_tile(place));
    user.drag(&[from, [from[0] + 20.0, from[1]], to]);
    let scene = user.scene();
    let tile = scene.tiling().tiles.pop().filter(|tile| tile.section.is_some()).expect("a section");
    let length = tile.section.as_ref().map_or(0.0, |section| section.line.length());
    assert!((length - 3.0 * radius).abs() < LENGTH, "{length} mm");
    let (middle, off) = scene.tiling().project(&tile, user.ball.0);
    let wanted = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0);
    assert!(off.abs() < LENGTH && (middle[0] - wanted[0]).abs() * tile.pixel < LENGTH, "{middle:?} {wanted:?}");
    user.count()
}

pub(super) fn curved_section(user: &mut User) -> String {
    user.shift('c');
    let points = [[-12.0, 0.0], [0.0, 6.0], [12.0, 0.0], [20.0, -9.0]];
    points.iter().for_each(|[right, down]| user.click_plane(*right, *down));
    user.key(Key::Enter);
    let curve = user.console.controls().settings().planes.curve.clone().expect("a curve");
    let scene = user.scene();
    for (point, [right, down]) in curve.points.iter().zip(points) {
        let wanted = user.place(right, down);
        let off = scene.place_on_plane(curve.plane, *point).distance(wanted);
        assert!(off < LENGTH, "{off} mm beside {wanted}");
    }
    assert!(scene.has_curve() && user.actions == 2 + points.len());
    "2 + 1 a point".into()
}

pub(super) fn nine_slices(user: &mut User) -> String {
    user.letter('9');
    user.actions += 1;
    user.press(Modifiers { shift: true, ..Modifiers::default() }, Key::Function(3));
    for (name, value) in [("Columns", 3.0), ("Rows", 3.0), ("Spacing", 4.0)] {
        user.sets(name, value);
    }
    let scene = user.scene();
    let tiles = scene.tiling().tiles;
    let away: Vec<f64> = tiles.windows(2).map(|two| (two[1].plane.at - two[0].plane.at).length()).collect();
    assert!(tiles.len() == 9 && away.iter().all(|mm| (mm - 4.0).abs() < 1e-6), "{away:?}");
    user.count()
}
