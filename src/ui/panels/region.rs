//! The region as a box while its tool is selected: its section on the planes beside a rendering with a handle on each side, its start line in green
//! on plane A, and its edges in the rendering.

use super::annotations::stroke;
use super::canvas::Canvas;
use super::colours::{OUTLINE, START, TEXT};
use super::{PanelState, ShownPicture};
use crate::command::Tool;
use crate::region_box;
use egui::{Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};

/// Width of a handle, points.
const HANDLE: f32 = 11.0;
/// Radius of a handle of the start line, points: these are round.
const START_HANDLE: f32 = 6.5;
/// Length of a dash of an edge that is behind, and of what is between two, points.
const DASH: f32 = 6.0;

pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32) {
    let canvas = Canvas::of(ui, state, scale).filter(|_| state.controls.tool() == Tool::Region);
    let Some((ShownPicture { scene, .. }, canvas)) = canvas else { return };
    let at = |place| canvas.at(place);
    if region_box::is_on_planes(scene) {
        let tiling = scene.tiling();
        for (n, tile) in tiling.tiles.iter().enumerate() {
            let painter = canvas.within(tile.corner.map(f64::from), tile.size.map(f64::from));
            let sides = region_box::section(scene, &tiling, tile);
            sides.iter().for_each(|side| stroke(&painter, side.ends.map(at), 1.5, TEXT));
            sides.iter().filter_map(|side| side.handle).for_each(|place| handle(&painter, at(place)));
            if let Some(start) = region_box::start_line(scene, &tiling, n, state.controls.start_line()) {
                let ends: Vec<Pos2> = start.line.into_iter().map(at).collect();
                for stroke in [Stroke::new(2.0 + 2.5, OUTLINE), Stroke::new(2.0, START)] {
                    ends.windows(2).for_each(|two| _ = painter.line_segment([two[0], two[1]], stroke));
                }
                start.handles.into_iter().for_each(|place| start_handle(&painter, at(place)));
            }
        }
    }
    let tile = scene.marks().into_iter().find(|tile| tile.is_rendering);
    let Some(tile) = tile else { return };
    let painter = canvas.within(tile.corner, tile.size);
    let (behind, before): (Vec<_>, Vec<_>) = region_box::wireframe(scene).into_iter().partition(|edge| edge.is_behind);
    behind.iter().for_each(|edge| dashes(&painter, edge.ends.map(at)));
    before.iter().for_each(|edge| stroke(&painter, edge.ends.map(at), 1.5, TEXT));
    region_box::rendered_handles(scene).into_iter().for_each(|place| handle(&painter, at(place)));
}

fn dashes(painter: &Painter, [from, to]: [Pos2; 2]) {
    let way = to - from;
    let length = way.length();
    // An edge that reaches far out of the picture has no more dashes than a screen has room for.
    let count = (length / (2.0 * DASH)).ceil().clamp(1.0, 400.0);
    for n in 0..count as usize {
        let share = |along: f32| from + way * (along / count).min(1.0);
        stroke(painter, [share(n as f32), share(n as f32 + 0.5)], 1.0, TEXT);
    }
}

fn start_handle(painter: &Painter, at: Pos2) {
    painter.circle_filled(at, START_HANDLE + 2.0, OUTLINE);
    painter.circle_filled(at, START_HANDLE, START);
    painter.circle_filled(at, START_HANDLE - 4.0, OUTLINE);
}

fn handle(painter: &Painter, at: Pos2) {
    let area = Rect::from_center_size(pos2(at.x.round(), at.y.round()), vec2(HANDLE, HANDLE));
    painter.rect_filled(area.expand(1.5), 2.0, OUTLINE);
    painter.rect_filled(area, 1.0, TEXT);
}
