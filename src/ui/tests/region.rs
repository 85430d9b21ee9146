//! The box of the region on planes and in the rendering: known answers for its sides, its edges and what drags on it do.

use super::*;
use crate::picking::Picker;
use crate::region_box::{Part, is_on_planes, part_at, rendered_handles, section, wireframe};

const FOUR: &str = "mode='surface'\nlayout='four'\nplanes.smooth={lateral=1,depth=1}\nregion.lateral=[-12,15]\nregion.depth=[30,60]\nregion.elevation=[-10,14]";

fn sides(scene: &Scene, tile: usize) -> Vec<crate::region_box::Side> {
    let tiling = scene.tiling();
    section(scene, &tiling, &tiling.tiles[tile])
}

fn handle(scene: &Scene, tile: usize, face: Face) -> [f64; 2] {
    let side = sides(scene, tile).into_iter().find(|side| side.face == face).expect("a side");
    side.handle.expect("a handle")
}

fn distance(at: [f64; 2], [from, to]: [[f64; 2]; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    ((at[0] - from[0]) * way[1] - (at[1] - from[1]) * way[0]).abs() / way[0].hypot(way[1])
}

#[test]
fn each_plane_shows_the_sides_of_the_region_where_they_are() {
    let scene = TestWindow::new(FOUR).scene();
    assert!(is_on_planes(&scene));
    let tiling = scene.tiling();
    for (tile, through) in [(0, 2), (1, 0), (2, 1)] {
        let sides = sides(&scene, tile);
        assert_eq!(sides.len(), 4, "tile {tile}: {sides:?}");
        for side in &sides {
            assert_ne!(side.face.axis, through, "the plane is parallel to that face");
            let ends = side.ends.map(|end| tiling.point(&tiling.tiles[tile], end)[side.face.axis]);
            let wanted = if side.face.high { scene.high } else { scene.low }[side.face.axis];
            assert!(ends.iter().all(|end| (end - wanted).abs() < 1e-9), "tile {tile}: {ends:?}, not {wanted}");
        }
    }
    // A plane that is turned by 45 degrees cuts a longer side, and one beside the region none.
    let turned = TestWindow::new(&format!("{FOUR}\nplanes.azimuth=45")).scene();
    assert!(sides(&turned, 0).len() >= 4);
    let beside = TestWindow::new(&format!("{FOUR}\nplanes.position=[0,40,25]")).scene();
    assert!(sides(&beside, 0).is_empty() && sides(&beside, 1).len() == 4);
    // Planes that are cropped to the region have no box.
    let cropped = TestWindow::new(&FOUR.replace("planes.smooth={lateral=1,depth=1}", "planes.smooth=none")).scene();
    assert!(!is_on_planes(&cropped) && part_at(&cropped, 0, [100.0, 100.0], [9.0, 9.0]).is_none());
}

/// Requirement: what is grabbed stays under the pointer, also on turned planes; the other sides stay where they are.
#[test]
fn a_side_follows_the_pointer_on_every_plane() {
    for turned in ["", "\nplanes.azimuth=20\nplanes.tilt=-15"] {
        for (tile, face) in [
            (0, Face { axis: 0, high: true }),
            (0, Face { axis: 1, high: false }),
            (1, Face { axis: 2, high: true }),
            (1, Face { axis: 1, high: true }),
            (2, Face { axis: 0, high: false }),
            (2, Face { axis: 2, high: false }),
        ] {
            let mut window = TestWindow::new(&format!("{FOUR}{turned}"));
            window.tool(Tool::Region);
            let before = window.scene();
            let from = handle(&before, tile, face);
            let tiling = before.tiling();
            let inwards = tiling.project(&tiling.tiles[tile], (before.low + before.high) / 2.0).0;
            let to = [0, 1].map(|a| from[a] + 0.3 * (inwards[a] - from[a]));
            window.drag(Button::Left, from, to);
            let after = window.scene();
            let side = sides(&after, tile).into_iter().find(|side| side.face == face).expect("a side");
            // The slop is 3 pixels of the picture.
            assert!(distance(to, side.ends) <= 3.1, "tile {tile}, {face:?}: {:?} {to:?}", side.ends);
            let moved = |axis: usize, high: bool| {
                let of = |scene: &Scene| if high { scene.high[axis] } else { scene.low[axis] };
                of(&after) - of(&before)
            };
            for (axis, high) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
                let is_it = (axis, high) == (face.axis, face.high);
                assert_eq!(moved(axis, high).abs() > 1.0, is_it, "axis {axis} {high}: {}", moved(axis, high));
            }
            window.controls.apply(&Command::Undo, Some(&after));
            assert_eq!(window.controls.settings().region, before.settings.region, "one step for undo");
        }
    }
}

#[test]
fn a_drag_within_moves_all_of_the_region_as_far_as_the_data_reach() {
    let mut window = TestWindow::new(FOUR);
    window.tool(Tool::Region);
    let before = window.scene();
    let tiling = before.tiling();
    let middle = tiling.project(&tiling.tiles[0], (before.low + before.high) / 2.0).0;
    assert_eq!(part_at(&before, 0, middle, [4.0, 6.0]), Some(Part::Inside));
    window.drag(Button::Left, middle, [middle[0] - 20.0, middle[1] + 12.0]);
    let after = window.scene();
    let moved = after.low - before.low;
    assert!((moved - (after.high - before.high)).length() < 1e-9, "it keeps its size");
    assert!((moved - DVec3::new(-20.0, 12.0, 0.0) * tiling.pixel).length() < 3.1 * tiling.pixel, "{moved}");
    // Far out it stops where the data end, and comes back with the pointer.
    window.drag(Button::Left, [middle[0] - 20.0, middle[1] + 12.0], [middle[0] - 4000.0, middle[1] + 12.0]);
    let out = window.scene();
    assert!(out.low.x < after.low.x && ((out.high.x - out.low.x) - (after.high.x - after.low.x)).abs() < 1e-9);
    assert!((out.low.y - after.low.y).abs() < 1e-9);
}

#[test]
fn the_edges_in_the_rendering_are_those_of_the_region() {
    for (field_of_view, azimuth, elevation) in [(0, 30, 20), (0, -120, 40), (35, 30, 20)] {
        let view =
            format!("camera.field_of_view={field_of_view}\ncamera.azimuth={azimuth}\ncamera.elevation={elevation}");
        let scene = TestWindow::new(&format!("{FOUR}\n{view}")).scene();
        let edges = wireframe(&scene);
        assert_eq!(edges.len(), 12);
        // Seen from outside, a box hides the three edges of its farthest corner.
        assert_eq!(edges.iter().filter(|edge| edge.is_behind).count(), 3, "{view}");
        let picker = Picker::of(&scene);
        let middle = picker.project((scene.low + scene.high) / 2.0).expect("in front");
        let farthest = [scene.low, scene.high];
        for n in 0..8 {
            let corner = DVec3::new(farthest[n & 1].x, farthest[n >> 1 & 1].y, farthest[n >> 2].z);
            let at = picker.project(corner).expect("in front");
            let meeting =
                edges.iter().flat_map(|edge| edge.ends).filter(|end| (end[0] - at[0]).hypot(end[1] - at[1]) < 1e-6);
            assert_eq!(meeting.count(), 3, "corner {n}");
        }
        assert_eq!(rendered_handles(&scene).len(), 6, "{view}: no axis is seen from its end");
        let [width, height] = picker.size();
        assert!((middle[0] - picker.corner()[0]) < width && (middle[1] - picker.corner()[1]) < height);
    }
    // From the probe the depth axis is a point: its faces cannot be dragged.
    let front = TestWindow::new(FOUR).scene();
    assert_eq!(rendered_handles(&front).len(), 4);
    assert!(wireframe(&TestWindow::new("mode='plane'").scene()).is_empty());
}

/// The right and the middle button do what the wheel does, with any tool: on a plane they step it.
#[test]
fn the_right_button_steps_the_plane_under_it_and_moves_a_rendering() {
    for tool in [Tool::Rotate, Tool::Region, Tool::Plane, Tool::Light] {
        for button in [Button::Right, Button::Middle] {
            let mut window = TestWindow::new(FOUR);
            window.tool(tool);
            let before = window.scene();
            let tile = &before.tiling().tiles[1];
            let middle = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0);
            window.drag(button, middle, [middle[0], middle[1] - 10.0]);
            let after = window.scene();
            assert_eq!(after.settings.planes.plane, PlaneName::B);
            let moved = after.plane(PlaneName::B).at - before.plane(PlaneName::B).at;
            let wanted = tile.plane.normal * 10.0 * before.tiling().pixel;
            assert!((moved - wanted).length() < 1e-6, "{tool:?} {button:?}: {moved}, not {wanted}");
            let centre = Picker::of(&after).centre();
            window.drag(button, centre, [centre[0] + 15.0, centre[1]]);
            assert!(window.scene().rays.target != after.rays.target, "{tool:?} {button:?} moves the rendering");
        }
    }
}
