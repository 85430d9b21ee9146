//! Where the time goes: pictures against the budget, volumes against what sound allows, and each pass as a bar.

use super::Facts;
use super::theme::{ACCENT, BACKGROUND, FAINT, GOOD, LARGE, SMALL, TEXT, WARNING};
use egui::{Area, Color32, Frame, Id, Margin, Order, Rect, RichText, Ui, pos2, vec2};

const WIDTH: f32 = 316.0;
/// Passes that are listed; the rest is one line.
const MOST: usize = 9;

pub fn show(ui: &mut Ui, facts: &Facts, scale: f32) {
    let at = super::rect(facts, scale).left_top() + vec2(12.0, 12.0);
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
