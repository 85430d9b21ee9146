//! Annotations of the picture: in every tile a scale, the patient's sides and the probe's marker; the orientation of the axes, and a colour bar.

use super::colours::{self, ACCENT, AXES, BACKING, MEASURE, ON_PLANE, OUTLINE, SIDES, START, TEXT, WARNING, WEAK_TEXT};
use super::{MARK_TEXT, PanelState, body_marks, picture_rect, recordings, shown};
use crate::anatomy::Anatomy;
use crate::command::Tool;
use crate::measure::overlay;
use crate::passes::postprocess;
use crate::region_box;
use crate::scene::marks::{BAR_LENGTHS, TileMarks};
use crate::scene::{Layout, Mode, Scene, transfer};
use crate::texts;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};
use glam::DVec3;

/// Smallest size of a tile, points, on which the axes of the volume are drawn: on a smaller one they would cover anatomy.
pub(super) const MIN_FOR_AXES: f32 = 480.0;
/// A smaller picture has no colour bar, points.
const MIN_FOR_COLOURS: f32 = 300.0;
/// A smaller tile has no scale either, points.
const MIN_FOR_SCALE: f32 = 90.0;

/// Room that a ruler has along the left edge of its tile, and a scale bar in the lower right corner: width as a share of the tile, and height, points.
const RULER_WIDTH: f32 = 60.0;
const BAR_ROOM: (f32, f32) = (0.35, 46.0);

/// The areas of annotations, points: first those that messages must not cover, then those that give way to messages.
pub(super) fn areas(state: &PanelState, scale: f32) -> [Vec<Rect>; 2] {
    let Some((shown, whole)) = shown(state, scale) else { return Default::default() };
    let (mut fixed, mut others) = (body_marks::areas(state, scale), Vec::new());
    for tile in shown.scene.marks_with(&state.controls.settings().drawn.marks) {
        let area = area_of(whole, &tile, scale);
        if !has_room(&area, MIN_FOR_SCALE) {
            continue;
        }
        fixed.extend(tile.letters.iter().map(|(edge, _)| letter_area(area, edge.offset())));
        fixed.extend(tile.probe.map(|edge| marker_area(area, edge.offset())));
        fixed.extend(tile.plane.map(|_| plane_area(area, &tile)));
        others.push(match tile.depth_from {
            Some(_) => area.with_max_x(area.left() + RULER_WIDTH),
            None => Rect::from_min_max(area.max - vec2(area.width() * BAR_ROOM.0, BAR_ROOM.1), area.max),
        });
    }
    [fixed, others]
}

/// The area of a tile in a picture, points.
fn area_of(picture: Rect, tile: &TileMarks, scale: f32) -> Rect {
    let [corner, size] = [tile.corner, tile.size].map(|[x, y]| vec2(x as f32, y as f32) / scale);
    Rect::from_min_size(picture.min + corner, size)
}

fn has_room(area: &Rect, least: f32) -> bool {
    area.width().min(area.height()) >= least
}

/// A place near the edges of a tile: -1 is left and above, 1 right and below.
fn near_edge(area: Rect, [x, y]: [f64; 2]) -> Pos2 {
    let half = area.size() / 2.0 - vec2(16.0, 16.0);
    area.center() + vec2(x as f32 * half.x, y as f32 * half.y)
}

fn letter_area(area: Rect, edge: [f64; 2]) -> Rect {
    Rect::from_center_size(near_edge(area, edge), vec2(16.0, 20.0))
}

/// In the corner of the marker's side, where no letter is.
fn marker_area(area: Rect, edge: [f64; 2]) -> Rect {
    let corner = edge.map(|n| if n == 0.0 { -1.0 } else { n });
    Rect::from_center_size(near_edge(area, corner), vec2(14.0, 14.0))
}

fn plane_area(area: Rect, tile: &TileMarks) -> Rect {
    Rect::from_center_size(near_edge(area, tile.plane_corner()), vec2(20.0, 20.0))
}

/// Draws the annotations over the picture. `messages`: areas that messages cover, points.
pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32, messages: &[Rect]) {
    let Some((shown, whole)) = shown(state, scale) else { return };
    let scene = &shown.scene;
    // The part of it that is in sight.
    let picture = whole.intersect(picture_rect(state, scale));
    let painter = ui.ctx().layer_painter(egui::LayerId::background()).with_clip_rect(picture);
    let marks = scene.marks_with(&state.controls.settings().drawn.marks);
    let tiles = || marks.iter().enumerate().map(|(n, tile)| (n, tile, area_of(whole, tile, scale)));
    let tiles = || tiles().filter(|(.., area)| has_room(area, MIN_FOR_SCALE));
    // What tells the sides goes before what tells sizes: that gives way.
    let mut taken = Taken(body_marks::areas(state, scale));
    taken.0.extend(recordings::reading_area(state, scale));
    taken.0.extend(messages);
    tiles().for_each(|(_, tile, area)| sides(&painter, &mut taken, area, tile, messages));
    let recording = state.recordings.iter().find(|recording| recording.is_shown).map(|recording| &*recording.name);
    if let Some((name, colour)) = state.origin.map(|origin| (origin, WARNING)).or(recording.map(|name| (name, TEXT))) {
        // Over the rendering, where it has the left part of the picture.
        let is_left = |tile: &TileMarks| tile.is_rendering && tile.corner == [0.0; 2];
        let rendering = tiles().find(|(_, tile, _)| is_left(tile)).map(|(.., area)| area.intersect(picture));
        let has_it = rendering.is_some_and(|area| name_origin(&painter, &mut taken, area, name, colour));
        _ = has_it || name_origin(&painter, &mut taken, picture, name, colour);
    }
    tell_state(&painter, &mut taken, picture, state);
    state.delay().iter().for_each(|delay| tell_delay(&painter, &mut taken, picture, delay));
    // While it is bent, plane A has the line as it will be, not as the picture has it.
    let is_shown = state.controls.tool() == Tool::Region
        && !scene.unveils()
        && region_box::start_line(scene, &scene.tiling(), 0, state.controls.start_line()).is_some();
    for line in shown.start_lines.iter().skip(usize::from(is_shown)) {
        let [corner, size] = line.tile.map(|[x, y]| vec2(x as f32, y as f32) / scale);
        let painter = painter.with_clip_rect(Rect::from_min_size(picture.min + corner, size).intersect(picture));
        for ends in &line.pieces {
            stroke(&painter, ends.map(|[x, y]| picture.min + vec2(x as f32, y as f32) / scale), 1.5, START);
        }
    }
    for (n, tile, area) in tiles() {
        if n == 0 && scene.has_reference() {
            slices(&painter, &mut taken, picture.min, area, scene, scale);
        }
        if tile.is_rendering && has_room(&area, MIN_FOR_AXES) {
            axes(&painter, &mut taken, area, scene);
        }
    }
    if has_room(&picture, MIN_FOR_COLOURS) && !scene.settings.layout.has_planes() {
        colour_bar(&painter, &mut taken, picture, scene, scale);
    }
    for (n, tile, area) in tiles() {
        let label = tile.place_label().filter(|_| n > 0 || !scene.has_reference());
        if let Some(label) = label {
            // Beside the letter of the plane, or of the upper edge.
            let places = [vec2(34.0, 6.0), vec2(34.0, 26.0), vec2(6.0, 46.0)].map(|away| area.left_top() + away);
            let right = [vec2(-34.0, 6.0), vec2(-34.0, 26.0)].map(|away| area.right_top() + away);
            let has_it = text_at_one_of(&painter, &mut taken, places, Align2::LEFT_TOP, &label, TEXT);
            _ = has_it || text_at_one_of(&painter, &mut taken, right, Align2::RIGHT_TOP, &label, TEXT);
        }
        // All tiles of a tomography have the same scale: only the first one shows it.
        if n > 0 && scene.settings.mode == Mode::Tomography {
            continue;
        }
        if let Some(label) = tile.along_label() {
            let places = (0..5).map(|n| area.center_bottom() - vec2(0.0, 6.0 + 20.0 * n as f32));
            text_at_one_of(&painter, &mut taken, places, Align2::CENTER_BOTTOM, &label, TEXT);
        }
        match tile.depth_from {
            Some(top) => ruler(&painter, &mut taken, area, top, tile.pixel * f64::from(scale)),
            None => bar(&painter, &mut taken, area, tile.pixel * f64::from(scale)),
        }
    }
}

/// Writes on the picture, if no other annotations are drawn, what it shows if that is no patient, and by how much a live picture is late.
pub(super) fn paint_origin(ui: &Ui, state: &PanelState, scale: f32) {
    let picture = picture_rect(state, scale);
    let painter = ui.ctx().layer_painter(egui::LayerId::background()).with_clip_rect(picture);
    let mut taken = Taken::default();
    state.origin.iter().for_each(|origin| _ = name_origin(&painter, &mut taken, picture, origin, WARNING));
    let delay = state.delay().filter(|_| !state.shows_only_origin);
    delay.iter().for_each(|delay| tell_delay(&painter, &mut taken, picture, delay));
}

/// Says near the upper left corner whether the picture is live, and which volume of the loop it shows, in as many words as have room.
fn tell_state(painter: &Painter, taken: &mut Taken, picture: Rect, state: &PanelState) {
    let cine = &state.cine;
    let (what, colour) = match (state.timeliness.is_frozen, state.timeliness.ended) {
        (true, _) if cine.is_playing => (texts::STATE_PLAYING.to_string(), WARNING),
        (true, _) => (texts::STATE_FROZEN.to_string(), WARNING),
        (false, Some(ago)) => (texts::ended_for(ago), TEXT),
        (false, None) if state.timeliness.is_live || state.origin.is_some() => (texts::STATE_LIVE.to_string(), TEXT),
        (false, None) => (String::new(), TEXT),
    };
    let volume = cine.shown.map(|at| texts::volume_in_loop(at + 1, cine.count));
    let time = cine.seconds.map(texts::seconds);
    let drawing = state.timeliness.is_late.then(|| texts::STATE_DRAWING.to_string());
    let parts = [drawing, Some(what).filter(|what| !what.is_empty()), volume, time];
    let lower = (0..12).map(|n| vec2(6.0, 26.0 + 10.0 * n as f32));
    let places = [vec2(12.0, 8.0), vec2(34.0, 6.0)].into_iter().chain(lower).map(|away| picture.left_top() + away);
    for count in (1..=parts.len()).rev() {
        let text = parts[..count].iter().flatten().map(String::as_str).collect::<Vec<_>>().join(" · ");
        if text.is_empty() || text_at_one_of(painter, taken, places.clone(), Align2::LEFT_TOP, &text, colour) {
            return;
        }
    }
}

/// Says how far the picture is behind what arrives, near its upper left corner: beside the letter there, or further down.
fn tell_delay(painter: &Painter, taken: &mut Taken, picture: Rect, delay: &str) {
    let lower = (0..20).map(|n| vec2(6.0, 26.0 + 10.0 * n as f32));
    let places = [vec2(34.0, 6.0)].into_iter().chain(lower).map(|away| picture.left_top() + away);
    text_at_one_of(painter, taken, places, Align2::LEFT_TOP, delay, WARNING);
}

/// Says what the picture is of, near the upper right corner of this part of it. False if there is no room.
fn name_origin(painter: &Painter, taken: &mut Taken, picture: Rect, origin: &str, colour: Color32) -> bool {
    // Between the letter of the upper edge and a marker in the corner; in a narrow picture further down.
    let lower = (5..40).map(|n| vec2(-6.0, 6.0 + 5.0 * n as f32));
    // On the right or the left of that letter, or of the lower edge's.
    let [left, low] = [-picture.width() / 2.0 - 12.0, picture.height() - 24.0];
    let beside = [vec2(-6.0, 4.0), vec2(left, 4.0), vec2(-6.0, low), vec2(left, low)];
    let places = [vec2(-32.0, 6.0)].into_iter().chain(lower).chain(beside);
    let places = places.map(|away| picture.right_top() + away);
    // In the smallest pictures without what stands in brackets.
    let short = origin.split(" (").next().unwrap_or(origin);
    text_at_one_of(painter, taken, places.clone(), Align2::RIGHT_TOP, origin, colour)
        || text_at_one_of(painter, taken, places, Align2::RIGHT_TOP, short, colour)
}

/// The areas that marks have taken: no other is drawn there.
#[derive(Default)]
struct Taken(Vec<Rect>);

impl Taken {
    fn is_free(&self, area: Rect) -> bool {
        !self.0.iter().any(|taken| taken.expand(2.0).intersects(area))
    }

    /// Takes an area if it is free.
    fn take(&mut self, area: Rect) -> bool {
        let is_free = self.is_free(area);
        if is_free {
            self.0.push(area);
        }
        is_free
    }
}

/// Draws a text at the first of these places that is free and in sight. False if there is none.
fn text_at_one_of(
    painter: &Painter,
    taken: &mut Taken,
    places: impl IntoIterator<Item = Pos2>,
    align: Align2,
    label: &str,
    colour: Color32,
) -> bool {
    let size = painter.layout_no_wrap(label.into(), FontId::proportional(MARK_TEXT), colour).size();
    let area = |at: &Pos2| Some(align.anchor_size(*at, size)).filter(|area| painter.clip_rect().contains_rect(*area));
    let at = places.into_iter().find(|at| area(at).is_some_and(|area| taken.take(area)));
    at.iter().for_each(|at| text(painter, *at, align, label, colour));
    at.is_some()
}

/// The place of a mark; if a message covers it, the nearest along its edge that is free, or else further in. `edge`: as of [`near_edge`].
fn uncovered(place: Rect, edge: [f64; 2], tile: Rect, taken: &Taken, messages: &[Rect]) -> Rect {
    if !messages.iter().any(|message| message.expand(2.0).intersects(place)) {
        return place;
    }
    let [x, y] = edge.map(|n| n.abs() as f32);
    let moves = |along: Vec2| (1..60).flat_map(move |n| [1.0, -1.0].map(|way| along * (way * 5.0 * n as f32)));
    let places = moves(vec2(y, x)).chain(moves(vec2(x, y))).map(|by| place.translate(by));
    // It stays on its side of the tile.
    let is_on_its_side = |place: &Rect| {
        let away = place.center() - tile.center();
        edge[0] as f32 * away.x + edge[1] as f32 * away.y > 12.0
    };
    let mut places = places.filter(|place| tile.shrink(4.0).contains_rect(*place) && is_on_its_side(place));
    places.find(|place| taken.is_free(*place)).unwrap_or(place)
}

/// The letters of the patient's sides, and a dot on the side of the probe's marker.
fn sides(painter: &Painter, taken: &mut Taken, area: Rect, tile: &TileMarks, messages: &[Rect]) {
    for (edge, letter) in &tile.letters {
        let place = uncovered(letter_area(area, edge.offset()), edge.offset(), area, taken, messages);
        taken.take(place);
        outlined(painter, place.center(), Align2::CENTER_CENTER, letter, MARK_TEXT * 1.3, SIDES);
    }
    if let Some(edge) = tile.probe {
        let place = uncovered(marker_area(area, edge.offset()), edge.offset(), area, taken, messages);
        taken.take(place);
        painter.circle_filled(place.center(), 7.0, OUTLINE);
        painter.circle_filled(place.center(), 5.0, ACCENT);
    }
    if let Some((letter, colour)) = tile.plane {
        let place = uncovered(plane_area(area, tile), tile.plane_corner(), area, taken, messages);
        taken.take(place);
        painter.rect_filled(place, 3.0, colours::of_scene(colour));
        painter.text(place.center(), Align2::CENTER_CENTER, letter, FontId::proportional(MARK_TEXT), ON_PLANE);
    }
}

fn line(painter: &Painter, from: Pos2, to: Pos2) {
    stroke(painter, [from, to], 1.5, TEXT);
}

/// A bright line between dark edges, which is visible on any picture.
pub(super) fn stroke(painter: &Painter, ends: [Pos2; 2], width: f32, colour: Color32) {
    painter.line_segment(ends, Stroke::new(width + 2.5, OUTLINE));
    painter.line_segment(ends, Stroke::new(width, colour));
}

fn text(painter: &Painter, at: Pos2, align: Align2, label: &str, colour: Color32) {
    outlined(painter, at, align, label, MARK_TEXT, colour);
}

/// Bright text with a dark edge all round, which is readable on any picture.
fn outlined(painter: &Painter, at: Pos2, align: Align2, label: &str, size: f32, colour: Color32) {
    const RING: [Vec2; 8] = [
        vec2(1.2, 0.0),
        vec2(0.9, 0.9),
        vec2(0.0, 1.2),
        vec2(-0.9, 0.9),
        vec2(-1.2, 0.0),
        vec2(-0.9, -0.9),
        vec2(0.0, -1.2),
        vec2(0.9, -0.9),
    ];
    let galley = painter.layout_no_wrap(label.into(), FontId::proportional(size), colour);
    let corner = align.anchor_size(at, galley.size()).min;
    for away in RING {
        painter.galley_with_override_text_color(corner + away, galley.clone(), OUTLINE);
    }
    painter.galley(corner, galley, colour);
}

/// A ruler along the left edge with numbered ticks of the depth below the probe's face. `top`: depth at the upper edge, mm.
fn ruler(painter: &Painter, taken: &mut Taken, area: Rect, top: f64, per_point: f64) {
    let bottom = top + f64::from(area.height()) * per_point;
    if !(per_point > 0.0 && bottom > top && bottom - top < 1e4) {
        return;
    }
    // The ticks are far enough apart for their numbers.
    let step = BAR_LENGTHS.into_iter().find(|mm| mm / per_point >= 34.0).unwrap_or(200.0);
    let x = area.left() + 6.0;
    let at = |depth: f64| area.top() + ((depth - top) / per_point) as f32;
    let from = ((top.max(0.0) / step).ceil() * step).max(0.0);
    let (mut depth, mut has_unit) = (from, false);
    while depth <= bottom {
        let y = at(depth);
        if taken.is_free(Rect::from_min_max(pos2(x, y - 3.0), pos2(x + 9.0, y + 3.0))) {
            line(painter, pos2(x, y), pos2(x + 9.0, y));
            if y > area.top() + 8.0 && y < area.bottom() - 8.0 {
                let place = [pos2(x + 13.0, y)];
                let label = if has_unit { format!("{depth:.0}") } else { texts::whole_millimetres(depth) };
                has_unit |= text_at_one_of(painter, taken, place, Align2::LEFT_CENTER, &label, TEXT);
            }
        }
        depth += step;
    }
}

/// A scale bar in the lower right corner, or further up.
fn bar(painter: &Painter, taken: &mut Taken, area: Rect, per_point: f64) {
    if !(per_point > 0.0 && per_point.is_finite()) {
        return;
    }
    let max_length = f64::from(area.width()) * 0.3 * per_point;
    let Some(mm) = BAR_LENGTHS.into_iter().rev().find(|mm| *mm <= max_length) else { return };
    let width = (mm / per_point) as f32;
    let label = texts::bar_length(mm);
    let words = painter.layout_no_wrap(label.clone(), FontId::proportional(MARK_TEXT), TEXT).size();
    // Or further left, if a message is there.
    let up = |left: f32| (0..8).map(move |n| area.right_bottom() - vec2(16.0 + left, 16.0 + 24.0 * n as f32));
    let places = [0.0, 0.3, 0.55].into_iter().flat_map(|share| up(share * area.width()));
    let right = places.into_iter().find(|right| {
        let half = width.max(words.x) / 2.0;
        let middle = right.x - width / 2.0;
        let top = right.y - 8.0 - words.y;
        taken.take(Rect::from_min_max(pos2(middle - half, top), pos2(middle + half, right.y + 6.0)))
    });
    let Some(right) = right else { return };
    let left = right - vec2(width, 0.0);
    line(painter, left, right);
    for end in [left, right] {
        line(painter, end - vec2(0.0, 5.0), end + vec2(0.0, 5.0));
    }
    text(painter, left + vec2(width / 2.0, -8.0), Align2::CENTER_BOTTOM, &label, TEXT);
}

/// Where the slices of a tomography are, on its reference tile, and their distance.
fn slices(painter: &Painter, taken: &mut Taken, origin: Pos2, area: Rect, scene: &Scene, scale: f32) {
    let tiling = scene.tiling();
    let painter = painter.with_clip_rect(area);
    for ends in tiling.slice_lines() {
        let ends = ends.map(|[x, y]| origin + vec2(x as f32, y as f32) / scale);
        stroke(&painter, ends, 1.0, MEASURE);
    }
    // Above the letter of the lower edge, or higher.
    let places = (0..5).map(|n| area.center_bottom() - vec2(0.0, 6.0 + 20.0 * n as f32));
    text_at_one_of(&painter, taken, places, Align2::CENTER_BOTTOM, &overlay::spacing_label(&tiling), TEXT);
}

/// The axes of the volume in camera view, in the lower left corner.
fn axes(painter: &Painter, taken: &mut Taken, area: Rect, scene: &Scene) {
    const ARM: f64 = 34.0;
    let centre = area.left_bottom() + vec2(58.0, -58.0);
    if !taken.take(Rect::from_center_size(centre, vec2(100.0, 100.0))) {
        return;
    }
    painter.circle_filled(centre, 50.0, BACKING);
    let rays = &scene.rays;
    let mut arms: Vec<(f64, Vec2, &str, Color32)> = DVec3::AXES
        .iter()
        .zip(&AXES)
        .map(|(axis, (name, colour))| {
            let projected = vec2((axis.dot(rays.right) * ARM) as f32, (-axis.dot(rays.up) * ARM) as f32);
            (axis.dot(rays.forward), projected, *name, *colour)
        })
        .collect();
    // Axes that point away are drawn first, and thinner.
    arms.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (away, arm, name, colour) in arms {
        let width = 3.5 - 2.0 * away.max(0.0) as f32;
        stroke(painter, [centre, centre + arm], width, colour);
        painter.circle_filled(centre + arm, 2.3 + 0.5 * width, colour);
        // An axis along the view is too short for a name.
        if arm.length() > 9.0 {
            // A single letter would be read as a side of the patient.
            let out = arm.normalized() * vec2(10.0 + 3.5 * name.len() as f32, 12.0);
            text(painter, centre + arm + out, Align2::CENTER_CENTER, name, colour);
        }
    }
}

/// A bar of the colours of all values, with the limits of the window, in a corner of the picture that shows nothing that was recorded. Without such a
/// corner there is none: the controls have the limits too.
fn colour_bar(painter: &Painter, taken: &mut Taken, picture: Rect, scene: &Scene, scale: f32) {
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
        .then(|| transfer::table(&transfer::of(&settings.volume), settings.volume.threshold, scene.transfer_entries()));
    let ramp = |value: f64| {
        let Some(table) = &table else { return [value; 3] };
        let last = table.len() - 1;
        let [r, g, b, absorption] = table[((value * last as f64).round() as usize).min(last)];
        // Transparent values are shown dark.
        [r, g, b].map(|c| if absorption > 0.0 { c } else { 0.15 * c })
    };
    const STEPS: usize = 64;
    let highest = (picture.height() * 0.3).clamp(60.0, 220.0);
    // In the right corners, or beside the letter of the right edge; on the left beside a ruler; below above a scale.
    let (right, left) = (picture.right(), picture.left() + 104.0);
    let places = |height: f32| {
        let (above, below) = (picture.top(), picture.bottom() - height);
        let places = [
            [right - 34.0, above + 26.0],
            [right - 62.0, above + 26.0],
            [right - 34.0, above + 56.0],
            [right - 62.0, above + 56.0],
            [left, above + 26.0],
            [left, above + 56.0],
            [right - 34.0, below - 64.0],
            [right - 62.0, below - 64.0],
            [left, below - 26.0],
            [left, below - 56.0],
        ];
        places.map(|[left, top]| Rect::from_min_size(pos2(left, top), vec2(16.0, height)))
    };
    // Its numbers are on the left.
    let with_numbers = |area: Rect| Rect::from_min_max(area.min - vec2(36.0, 4.0), area.max + vec2(2.0, 4.0));
    let anatomy = Anatomy::of(scene);
    let is_bare = |area: Rect| {
        let part = |from: f32, to: f32, n: u32, of: u32| from + (to - from) * n as f32 / of as f32;
        let at = |n: u32| pos2(part(area.left(), area.right(), n % 5, 4), part(area.top(), area.bottom(), n / 5, 16));
        (0..5 * 17).map(at).map(|at| (at - picture.min) * scale).all(|at| !anatomy.is_at([at.x, at.y].map(f64::from)))
    };
    let is_free = |area: &Rect| {
        let area = with_numbers(*area);
        picture.contains_rect(area) && taken.is_free(area) && is_bare(area)
    };
    let mut all = [highest, 0.7 * highest, 0.45 * highest].into_iter().flat_map(|height| places(height.max(60.0)));
    let Some(area) = all.find(is_free) else { return };
    taken.take(with_numbers(area));
    let height = area.height();
    for n in 0..STEPS {
        let value = (n as f64 + 0.5) / STEPS as f64;
        let colour = colours::of_scene(postprocess::toned(scene, ramp(value)));
        let low = area.bottom() - height * n as f32 / STEPS as f32;
        let part = Rect::from_min_max(pos2(area.left(), low - height / STEPS as f32 - 0.5), pos2(area.right(), low));
        painter.rect_filled(part, 0.0, colour);
    }
    painter.rect_stroke(area, 0.0, Stroke::new(2.5, OUTLINE), egui::StrokeKind::Outside);
    painter.rect_stroke(area, 0.0, Stroke::new(1.0, WEAK_TEXT), egui::StrokeKind::Outside);
    for (value, y, align) in
        [(window[1], area.top(), Align2::RIGHT_TOP), (window[0], area.bottom(), Align2::RIGHT_BOTTOM)]
    {
        text(painter, pos2(area.left() - 6.0, y), align, &format!("{:.0}", value * 255.0), TEXT);
    }
}
