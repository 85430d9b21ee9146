//! The region as a box while its tool is selected: its section on the planes beside a rendering with a handle on each side, its start line in green
//! on plane A, and its edges in the rendering.

use super::colours::{OUTLINE, START, TEXT};
use super::{PanelState, ShownPicture, picture_rect, shown};
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
    let shown = shown(state, scale).filter(|_| state.controls.tool() == Tool::Region);
    let Some((ShownPicture { scene, .. }, picture)) = shown else { return };
    let at = |[x, y]: [f64; 2]| {
        let near = |v: f64| (v / f64::from(scale)).clamp(-1e5, 1e5) as f32;
        picture.min + vec2(near(x), near(y))
    };
    let painter = ui.ctx().layer_painter(egui::LayerId::background()).with_clip_rect(picture_rect(state, scale));
    if region_box::is_on_planes(scene) {
        let tiling = scene.tiling();
        for (n, tile) in tiling.tiles.iter().enumerate() {
            let [corner, size] = [tile.corner, tile.size].map(|v| v.map(f64::from));
            let area = Rect::from_min_max(at(corner), at([corner[0] + size[0], corner[1] + size[1]]));
            let painter = painter.with_clip_rect(area.intersect(painter.clip_rect()));
            let sides = region_box::section(scene, &tiling, tile);
            sides.iter().for_each(|side| line(&painter, side.ends.map(at), 1.5));
            sides.iter().filter_map(|side| side.handle).for_each(|place| handle(&painter, at(place)));
            if let Some(start) = region_box::start_line(scene, &tiling, n, state.controls.start_line()) {
                let ends: Vec<Pos2> = start.line.into_iter().map(at).collect();
                for (width, colour) in [(2.0 + 2.5, OUTLINE), (2.0, START)] {
                    ends.windows(2).for_each(|two| {
                        painter.line_segment([two[0], two[1]], Stroke::new(width, colour));
                    });
                }
                start.handles.into_iter().for_each(|place| start_handle(&painter, at(place)));
            }
        }
    }
    let tile = scene.marks().into_iter().find(|tile| tile.is_rendering);
    let Some(tile) = tile else { return };
    let (corner, size) = (tile.corner, tile.size);
    let area = Rect::from_min_max(at(corner), at([corner[0] + size[0], corner[1] + size[1]]));
    let painter = painter.with_clip_rect(area.intersect(painter.clip_rect()));
    let (behind, before): (Vec<_>, Vec<_>) = region_box::wireframe(scene).into_iter().partition(|edge| edge.is_behind);
    behind.iter().for_each(|edge| dashes(&painter, edge.ends.map(at)));
    before.iter().for_each(|edge| line(&painter, edge.ends.map(at), 1.5));
    region_box::rendered_handles(scene).into_iter().for_each(|place| handle(&painter, at(place)));
}

/// A bright line between dark edges, which is visible on any picture.
fn line(painter: &Painter, ends: [Pos2; 2], width: f32) {
    painter.line_segment(ends, Stroke::new(width + 2.5, OUTLINE));
    painter.line_segment(ends, Stroke::new(width, TEXT));
}

fn dashes(painter: &Painter, [from, to]: [Pos2; 2]) {
    let way = to - from;
    let length = way.length();
    // An edge that reaches far out of the picture has no more dashes than a screen has room for.
    let count = (length / (2.0 * DASH)).ceil().clamp(1.0, 400.0);
    for n in 0..count as usize {
        let share = |along: f32| from + way * (along / count).min(1.0);
        line(painter, [share(n as f32), share(n as f32 + 0.5)], 1.0);
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
