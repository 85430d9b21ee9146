//! Annotations of the picture: a scale in every tile, the orientation of the axes, and a colour bar.

use super::{PanelState, SMALL_TEXT, TEXT, WEAK_TEXT, picture_rect};
use crate::passes::postprocess;
use crate::scene::{Layout, Mode, Scene, transfer};
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};
use glam::DVec3;

/// Lengths that a scale bar may have, mm.
const LENGTHS: [f64; 9] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0];

pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32) {
    let Some(scene) = state.scene else { return };
    let picture = picture_rect(state, scale);
    // During a resize the scene has another size for a moment.
    if scene.picture_size() != state.picture.1 {
        return;
    }
    let painter = ui.ctx().layer_painter(egui::LayerId::background()).with_clip_rect(picture);
    let [width, height] = scene.picture_size().map(f64::from);
    let tile = |corner: [f64; 2], size: [f64; 2]| {
        let at = picture.min + vec2(corner[0] as f32, corner[1] as f32) / scale;
        Rect::from_min_size(at, vec2(size[0] as f32, size[1] as f32) / scale)
    };
    if scene.cuts_planes() {
        let sheet = scene.sheet();
        // All tiles of a tomography have the same scale: only the first one shows it.
        let scaled_tiles = if scene.settings.mode == Mode::Tomography { 1 } else { sheet.tiles.len() };
        for shown in sheet.tiles.iter().take(scaled_tiles) {
            let area = tile(shown.corner.map(f64::from), shown.size.map(f64::from));
            let per_point = sheet.pixel * f64::from(scale);
            match shown.plane.down.y > 0.99 {
                true => {
                    let top = shown.plane.at.y - depth_offset(scene) - sheet.pixel * f64::from(shown.size[1]) / 2.0;
                    ruler(&painter, area, top, per_point);
                }
                false => bar(&painter, area, per_point),
            }
        }
    }
    if !scene.is_flat() {
        let [columns, rows] = match scene.settings.layout {
            Layout::Single => [1.0, 1.0],
            Layout::Four => [2.0, 2.0],
            Layout::Pair => [2.0, 1.0],
        };
        let corner = [(width - width / columns).floor(), (height - height / rows).floor()];
        let area = tile(corner, [width - corner[0], height - corner[1]]);
        bar(&painter, area, rendered_pixel(scene, width - corner[0]) * f64::from(scale));
        axes(&painter, area, scene);
    }
    colours(&painter, picture, scene);
}

/// The difference between Y in space and the depth below the probe's face, mm.
fn depth_offset(scene: &Scene) -> f64 {
    scene.probe().map_or(0.0, |probe| probe.array_radius())
}

/// Size of a pixel at the camera's target, mm. `width`: of the rendered tile, pixels.
fn rendered_pixel(scene: &Scene, width: f64) -> f64 {
    let rays = &scene.rays;
    let apart = match rays.is_perspective {
        true => rays.direction_dx.length() * (rays.target - rays.origin).dot(rays.forward),
        false => rays.origin_dx.length(),
    };
    apart * f64::from(scene.ray_size()[0]) / width.max(1.0)
}

fn line(painter: &Painter, from: Pos2, to: Pos2) {
    // A dark edge along the bright line is visible on any picture.
    painter.line_segment([from, to], Stroke::new(4.0, Color32::from_black_alpha(150)));
    painter.line_segment([from, to], Stroke::new(1.5, TEXT));
}

fn text(painter: &Painter, at: Pos2, align: Align2, label: &str, colour: Color32) {
    let font = FontId::proportional(SMALL_TEXT);
    painter.text(at + vec2(1.0, 1.0), align, label, font.clone(), Color32::from_black_alpha(200));
    painter.text(at, align, label, font, colour);
}

/// A ruler along the left edge with numbered ticks of the depth below the probe's face. `top`: depth at the upper edge, mm.
fn ruler(painter: &Painter, area: Rect, top: f64, per_point: f64) {
    let bottom = top + f64::from(area.height()) * per_point;
    if !(per_point > 0.0 && bottom > top && bottom - top < 1e4) {
        return;
    }
    // The ticks are far enough apart for their numbers.
    let step = LENGTHS.into_iter().find(|mm| mm / per_point >= 34.0).unwrap_or(200.0);
    let x = area.left() + 6.0;
    let at = |depth: f64| area.top() + ((depth - top) / per_point) as f32;
    let from = ((top.max(0.0) / step).ceil() * step).max(0.0);
    let mut depth = from;
    while depth <= bottom {
        let y = at(depth);
        line(painter, pos2(x, y), pos2(x + 9.0, y));
        if y > area.top() + 8.0 && y < area.bottom() - 8.0 {
            let unit = if depth == from { " mm" } else { "" };
            text(painter, pos2(x + 13.0, y), Align2::LEFT_CENTER, &format!("{depth:.0}{unit}"), TEXT);
        }
        depth += step;
    }
}

/// A scale bar in the lower right corner.
fn bar(painter: &Painter, area: Rect, per_point: f64) {
    if !(per_point > 0.0 && per_point.is_finite()) {
        return;
    }
    let max_length = f64::from(area.width()) * 0.3 * per_point;
    let Some(mm) = LENGTHS.into_iter().rev().find(|mm| *mm <= max_length) else { return };
    let width = (mm / per_point) as f32;
    let right = pos2(area.right() - 16.0, area.bottom() - 16.0);
    let left = right - vec2(width, 0.0);
    line(painter, left, right);
    for end in [left, right] {
        line(painter, end - vec2(0.0, 5.0), end + vec2(0.0, 5.0));
    }
    text(painter, left + vec2(width / 2.0, -8.0), Align2::CENTER_BOTTOM, &format!("{mm} mm"), TEXT);
}

/// The axes of the volume in camera view, in the lower left corner.
fn axes(painter: &Painter, area: Rect, scene: &Scene) {
    const ARM: f64 = 34.0;
    let centre = area.left_bottom() + vec2(58.0, -58.0);
    painter.circle_filled(centre, 50.0, Color32::from_black_alpha(110));
    let rays = &scene.rays;
    let named = [
        (DVec3::X, "lateral", Color32::from_rgb(235, 110, 100)),
        (DVec3::Y, "depth", Color32::from_rgb(120, 205, 120)),
        (DVec3::Z, "elevation", Color32::from_rgb(110, 160, 245)),
    ];
    let mut arms: Vec<(f64, Vec2, &str, Color32)> = named
        .iter()
        .map(|(axis, name, colour)| {
            let projected = vec2((axis.dot(rays.right) * ARM) as f32, (-axis.dot(rays.up) * ARM) as f32);
            (axis.dot(rays.forward), projected, *name, *colour)
        })
        .collect();
    // Axes that point away are drawn first, and weaker.
    arms.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (away, arm, name, colour) in arms {
        let colour = colour.gamma_multiply((1.0 - 0.45 * away.max(0.0)) as f32);
        painter.line_segment([centre, centre + arm], Stroke::new(3.5, colour));
        painter.circle_filled(centre + arm, 4.0, colour);
        // An axis along the view is too short for a name.
        if arm.length() > 9.0 {
            let out = arm.normalized() * 11.0;
            text(painter, centre + arm + out, Align2::CENTER_CENTER, &name[..1].to_uppercase(), colour);
        }
    }
}

/// A bar of the colours of all values, with the limits of the window.
fn colours(painter: &Painter, picture: Rect, scene: &Scene) {
    let settings = &scene.settings;
    let window = match settings.mode {
        // The colours of a lit surface do not stand for values.
        Mode::Surface if settings.layout == Layout::Single => return,
        Mode::Surface if settings.layout == Layout::Pair => settings.volume.window,
        Mode::Volume | Mode::Mixed => settings.volume.window,
        Mode::Mip | Mode::MinIp | Mode::Mean => settings.projection.window,
        Mode::Cube => settings.cube.window,
        _ => settings.planes.window,
    };
    let table = scene
        .composites()
        .then(|| transfer::table(&settings.volume.transfer, settings.volume.threshold, scene.transfer_entries()));
    let ramp = |value: f64| {
        let Some(table) = &table else { return [value; 3] };
        let last = table.len() - 1;
        let [r, g, b, absorption] = table[((value * last as f64).round() as usize).min(last)];
        // Transparent values are shown dark.
        [r, g, b].map(|c| if absorption > 0.0 { c } else { 0.15 * c })
    };
    const STEPS: usize = 64;
    let height = (picture.height() * 0.3).clamp(60.0, 220.0);
    let area = Rect::from_min_size(pos2(picture.right() - 34.0, picture.top() + 26.0), vec2(16.0, height));
    for n in 0..STEPS {
        let value = (n as f64 + 0.5) / STEPS as f64;
        let [r, g, b] = postprocess::toned(scene, ramp(value)).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        let low = area.bottom() - height * n as f32 / STEPS as f32;
        let part = Rect::from_min_max(pos2(area.left(), low - height / STEPS as f32 - 0.5), pos2(area.right(), low));
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    painter.rect_stroke(area, 0.0, Stroke::new(1.0, WEAK_TEXT), egui::StrokeKind::Outside);
    for (value, y, align) in
        [(window[1], area.top(), Align2::RIGHT_TOP), (window[0], area.bottom(), Align2::RIGHT_BOTTOM)]
    {
        text(painter, pos2(area.left() - 6.0, y), align, &format!("{:.0}", value * 255.0), TEXT);
    }
}
