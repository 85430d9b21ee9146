//! The line of the curved plane on the plane that it is drawn on, with its points while its tool is selected, and the line in progress.

use super::canvas::Canvas;
use super::colours::{self, OUTLINE, TEXT};
use super::{PanelState, ShownPicture};
use crate::command::Tool;
use crate::measure::overlay;
use crate::scene::Curve;
use crate::scene::planes::{CURVE_COLOUR, CurveLine};
use egui::{Painter, Stroke, Ui, vec2};

/// Radius of a point, points.
const POINT: f32 = 4.5;
/// Length of the arrow's head, points.
const HEAD: f64 = 12.0;

pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32) {
    let Some((ShownPicture { scene, .. }, canvas)) = Canvas::of(ui, state, scale) else { return };
    let (is_chosen, work) = (state.controls.tool() == Tool::Curve, state.controls.line());
    if scene.settings.planes.curve.is_none() && work.is_none() {
        return;
    }
    let tiling = scene.tiling();
    let within = |line: &CurveLine| {
        let tile = &tiling.tiles[line.tile];
        canvas.within(tile.corner.map(f64::from), tile.size.map(f64::from))
    };
    let draw = |line: &CurveLine, has_points: bool| draw(&within(line), &canvas, line, has_points);
    // The tile under the pointer, and the place in space.
    let under = canvas.hovered(ui).and_then(|at| {
        let at = canvas.pixel(at);
        let tile = tiling.tile_at(at[0].max(0.0) as usize, at[1].max(0.0) as usize)?;
        let number = tiling.tiles.iter().position(|other| other.corner == tile.corner)?;
        Some((number, tiling.point(tile, at)))
    });
    if let Some(line) = scene.curve_line(&tiling) {
        draw(&line, is_chosen && work.is_none());
        // Where on the line the pointer over the section is.
        if let Some((_, place)) = under.filter(|(number, _)| tiling.tiles[*number].section.is_some()) {
            let [x, y] = tiling.project(&tiling.tiles[line.tile], place).0.map(|v| v as f32);
            let (at, painter) = (canvas.origin + vec2(x, y) / scale, within(&line));
            for (width, colour) in [(4.0, OUTLINE), (2.0, colours::of_scene(CURVE_COLOUR))] {
                painter.circle_stroke(at, POINT + 2.0, Stroke::new(width, colour));
            }
        }
    }
    let Some(work) = work else { return };
    // The line as it would be with a point under the pointer.
    let under = under.filter(|(number, _)| scene.plane_of_tile(*number) == Some(work.plane));
    let under = under.map(|(_, place)| scene.point_on_plane(work.plane, place));
    let last = work.points.last();
    let under = under.filter(|[x, y]| last.is_some_and(|last| (last[0] - x).hypot(last[1] - y) >= scene.least_apart()));
    let points = work.points.iter().copied().chain(under).collect();
    let shown = Curve { plane: work.plane, points };
    if let Some(mut line) = scene.line_on_tile(&tiling, &shown) {
        line.points.truncate(work.points.len());
        draw(&line, true);
    }
}

fn draw(painter: &Painter, canvas: &Canvas, line: &CurveLine, has_points: bool) {
    let colour = colours::of_scene(CURVE_COLOUR);
    let at = |place| canvas.at(place);
    let mut strokes: Vec<[[f64; 2]; 2]> = line.line.windows(2).map(|ends| [ends[0], ends[1]]).collect();
    strokes.extend(line.head().into_iter().flat_map(|head| overlay::arrow_head(head, HEAD * f64::from(canvas.scale))));
    for stroke in [Stroke::new(4.0, OUTLINE), Stroke::new(1.5, colour)] {
        strokes.iter().for_each(|ends| _ = painter.line_segment(ends.map(at), stroke));
    }
    if has_points {
        for point in &line.points {
            painter.circle_filled(at(*point), POINT + 2.0, OUTLINE);
            painter.circle_filled(at(*point), POINT, TEXT);
        }
    }
}
