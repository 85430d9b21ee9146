//! What is drawn over the picture: banner and notes, times, help, and the pointer where no windowing system draws one.

use super::state::{Facts, rect};
use super::theme::{ACCENT, BACKGROUND, FAINT, FAULT, GOOD, LARGE, LETTERS, PANEL, SMALL, TEXT, WARNING};
use crate::ui::command::Command;
use crate::ui::keys;
use egui::{
    Align2, Area, Color32, Frame, Id, LayerId, Margin, Mesh, Order, Rect, RichText, ScrollArea, Shape, Stroke, Ui,
    Vec2, pos2, vec2,
};

pub fn show_notes(ui: &mut Ui, facts: &Facts, scale: f32) {
    let picture = rect(facts, scale);
    if let Some(banner) = &facts.banner {
        // In the middle where there is no picture, above it where there is one.
        let (align, at) = match facts.is_drawn {
            true => (Align2::CENTER_TOP, picture.center_top() + vec2(0.0, 12.0)),
            false => (Align2::CENTER_CENTER, picture.center()),
        };
        let colour = if banner.is_fault { FAULT } else { WARNING };
        Area::new(Id::new("banner")).order(Order::Middle).pivot(align).fixed_pos(at).interactable(false).show(
            ui.ctx(),
            |ui| {
                boxed(colour).show(ui, |ui| {
                    ui.set_max_width((picture.width() - 60.0).clamp(120.0, 760.0));
                    ui.label(RichText::new(&banner.title).size(LARGE).color(colour));
                    if !banner.text.is_empty() {
                        ui.label(RichText::new(&banner.text).size(LETTERS));
                    }
                });
            },
        );
    }
    if facts.notes.is_empty() {
        return;
    }
    let at = picture.center_bottom() - vec2(0.0, 14.0);
    Area::new(Id::new("notes"))
        .order(Order::Middle)
        .pivot(Align2::CENTER_BOTTOM)
        .fixed_pos(at)
        .interactable(false)
        .show(ui.ctx(), |ui| {
            for note in facts.notes {
                boxed(if note.is_fault { FAULT } else { ACCENT }).show(ui, |ui| {
                    ui.set_max_width((picture.width() - 60.0).clamp(120.0, 760.0));
                    ui.label(RichText::new(&note.text).size(LETTERS));
                });
            }
        });
}

fn boxed(edge: Color32) -> Frame {
    Frame::new()
        .fill(BACKGROUND.gamma_multiply(0.92))
        .inner_margin(Margin::symmetric(16, 10))
        .corner_radius(8)
        .stroke(Stroke::new(2.0, edge))
}

const WIDTH: f32 = 316.0;
/// Passes that are listed; the rest is one line.
const MOST: usize = 9;

pub fn show_times(ui: &mut Ui, facts: &Facts, scale: f32) {
    let at = rect(facts, scale).left_top() + vec2(12.0, 12.0);
    Area::new(Id::new("times")).order(Order::Middle).fixed_pos(at).interactable(false).show(ui.ctx(), |ui| {
        let frame = Frame::new().fill(BACKGROUND.gamma_multiply(0.82)).inner_margin(Margin::same(12)).corner_radius(8);
        frame.show(ui, |ui| {
            ui.set_width(WIDTH);
            ui.spacing_mut().item_spacing.y = 3.0;
            figures(ui, facts);
            ui.add_space(4.0);
            bars(ui, facts);
        });
    });
}

fn figures(ui: &mut Ui, facts: &Facts) {
    let times = facts.times;
    let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.1} ms"));
    let held = match (facts.budget, times.pictures.percentile(0.95)) {
        (Some(budget), Some(p95)) if p95 > budget.as_secs_f64() * 1e3 => WARNING,
        (Some(_), Some(_)) => GOOD,
        _ => TEXT,
    };
    ui.label(RichText::new(format!("picture {}", ms(times.pictures.newest()))).size(LARGE).color(held));
    let budget = facts.budget.map_or("no budget".into(), |b| format!("budget {:.0} ms", b.as_secs_f64() * 1e3));
    small(
        ui,
        format!("p50 {}  p95 {}  {budget}", ms(times.pictures.percentile(0.5)), ms(times.pictures.percentile(0.95))),
        FAINT,
    );
    small(ui, facts.quality.to_string(), ACCENT);
    small(
        ui,
        format!("{:.2} volumes/s   {:.0} frames/s   {:.1} pictures/s", times.volumes, times.frames, times.shown),
        TEXT,
    );
    if let Some(floor) = times.floor.filter(|f| *f > 0.0) {
        let share = 100.0 * times.volumes * floor;
        small(ui, format!("sound: {:.0} ms a volume; {share:.0} % of that rate", floor * 1e3), FAINT);
    }
    small(ui, format!("frame to picture p95 {}", ms(times.latency)), TEXT);
    small(
        ui,
        format!("hand to picture p50 {}  p95 {}", ms(times.hands.percentile(0.5)), ms(times.hands.percentile(0.95))),
        TEXT,
    );
    let colour = if times.dropped + times.lost > 0 { WARNING } else { FAINT };
    small(ui, format!("{} volumes dropped, {} frames lost", times.dropped, times.lost), colour);
}

fn bars(ui: &mut Ui, facts: &Facts) {
    let mut passes: Vec<(&str, f64)> =
        facts.times.passes.iter().map(|(name, mean, runs)| (*name, mean * *runs as f64)).collect();
    let all: f64 = passes.iter().map(|p| p.1).sum();
    if all <= 0.0 {
        small(ui, "no times: the device has no time stamps, or nothing ran".into(), FAINT);
        return;
    }
    passes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let rest: f64 = passes.iter().skip(MOST).map(|p| p.1).sum();
    let more = passes.len().saturating_sub(MOST);
    passes.truncate(MOST);
    for (name, time) in &passes {
        let mean = facts.times.passes.iter().find(|(n, ..)| n == name).map_or(0.0, |p| p.1);
        bar(ui, name, time / all, format!("{mean:.2}"));
    }
    if more > 0 {
        bar(ui, &format!("{more} more"), rest / all, String::new());
    }
    small(ui, "ms of a run; bars: share of the device's time".into(), FAINT);
}

fn bar(ui: &mut Ui, name: &str, share: f64, figure: String) {
    let (area, _) = ui.allocate_exact_size(vec2(WIDTH, SMALL + 5.0), egui::Sense::hover());
    let filled = Rect::from_min_size(area.min, vec2((area.width() * share as f32).max(1.0), area.height()));
    let painter = ui.painter();
    painter.rect_filled(area, 2.0, Color32::from_white_alpha(8));
    painter.rect_filled(filled, 2.0, ACCENT.gamma_multiply(0.4));
    let font = egui::FontId::proportional(SMALL);
    let middle = area.center().y;
    painter.text(pos2(area.left() + 6.0, middle), egui::Align2::LEFT_CENTER, name, font.clone(), TEXT);
    painter.text(pos2(area.right() - 6.0, middle), egui::Align2::RIGHT_CENTER, figure, font, TEXT);
}

fn small(ui: &mut Ui, text: String, colour: Color32) {
    ui.label(RichText::new(text).size(SMALL).color(colour));
}

/// What hands do on the picture itself.
const HANDS: [(&str, &str); 9] = [
    ("drag", "what the tool says: turn, light, region, clip, planes"),
    ("Shift + drag, middle drag", "move the picture"),
    ("Ctrl + drag", "move the light"),
    ("wheel", "closer, further; over a plane: step it"),
    ("two fingers", "pinch closer, twist, move"),
    ("double click on a tile", "that tile alone, and back"),
    ("Region, then drag", "the face of the box that is nearest"),
    ("Clip, then drag up", "cut away what is nearer to you"),
    ("Planes, then click", "where the three planes meet"),
];

pub fn show_help(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    let screen = ui.ctx().content_rect();
    let mut is_closed = false;
    Area::new(Id::new("help")).order(Order::Foreground).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(
        ui.ctx(),
        |ui| {
            let frame = Frame::new()
                .fill(PANEL.gamma_multiply(0.97))
                .inner_margin(Margin::same(18))
                .corner_radius(10)
                .stroke(Stroke::new(1.0, FAINT));
            frame.show(ui, |ui| {
                let width = (screen.width() - 80.0).clamp(100.0, 1080.0);
                ui.set_width(width);
                ui.horizontal(|ui| {
                    ui.heading("Keys and hands");
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        is_closed = ui.button("Close").clicked();
                    });
                });
                let height = (screen.height() - 150.0).max(0.0);
                ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
                    let keys: Vec<(String, &str)> = keys::help().collect();
                    let half = keys.len().div_ceil(2);
                    let rows = |ui: &mut Ui, rows: &[(String, &str)]| {
                        for (key, words) in rows {
                            row(ui, key, words);
                        }
                    };
                    match width > 760.0 {
                        true => ui.columns(2, |columns| {
                            rows(&mut columns[0], &keys[..half]);
                            rows(&mut columns[1], &keys[half..]);
                        }),
                        false => rows(ui, &keys),
                    }
                    if !facts.exit_key.is_empty() {
                        row(ui, facts.exit_key, "leave");
                    }
                    ui.separator();
                    for (hand, words) in HANDS {
                        row(ui, hand, words);
                    }
                    ui.add_space(8.0);
                    ui.label(RichText::new("Echolume is not a medical device.").size(SMALL).color(FAINT));
                });
            });
        },
    );
    if is_closed {
        ask(Command::Help);
    }
}

fn row(ui: &mut Ui, key: &str, words: &str) {
    ui.horizontal(|ui| {
        ui.add_sized([150.0, LETTERS], egui::Label::new(RichText::new(key).color(ACCENT).size(LETTERS - 2.0)));
        ui.label(RichText::new(words).size(LETTERS - 2.0));
    });
}

/// Its corners from the tip on, points: a head, and a tail between its two halves.
const CORNERS: [Vec2; 7] = [
    vec2(0.0, 0.0),
    vec2(0.0, 24.0),
    vec2(5.5, 18.8),
    vec2(9.4, 27.2),
    vec2(13.2, 25.4),
    vec2(9.4, 17.4),
    vec2(17.0, 17.4),
];
/// The triangles that fill it: it is not convex.
const TRIANGLES: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 5], [0, 5, 6], [2, 3, 4], [2, 4, 5]];

pub fn paint_pointer(ui: &Ui, facts: &Facts, scale: f32) {
    let Some([x, y]) = facts.pointer else { return };
    let tip = pos2(x as f32 / scale, y as f32 / scale);
    // Over everything, and no layer that could be pressed.
    let painter = ui.ctx().layer_painter(LayerId::new(Order::Debug, Id::new("pointer")));
    let corners = CORNERS.map(|corner| tip + corner);
    let mut mesh = Mesh::default();
    corners.iter().for_each(|corner| mesh.colored_vertex(*corner, Color32::WHITE));
    TRIANGLES.iter().for_each(|[a, b, c]| mesh.add_triangle(*a, *b, *c));
    painter.add(mesh);
    // Dark round bright: to be seen on any echo.
    painter.add(Shape::closed_line(corners.to_vec(), Stroke::new(1.5, Color32::BLACK)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangles_fill_what_the_corners_surround() {
        let twice = |corners: &[Vec2]| -> f32 {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).map(|(a, b)| a.x * b.y - a.y * b.x).sum()
        };
        let filled = TRIANGLES.map(|corners| twice(&corners.map(|n| CORNERS[n as usize])));
        // All of them turn the same way round: none covers another.
        assert!(filled.iter().all(|area| *area < 0.0), "{filled:?}");
        assert!((filled.iter().sum::<f32>() - twice(&CORNERS)).abs() < 1e-3);
    }
}
