//! What is said to the person in front of it: a banner over the picture while something is amiss, and notes that go by themselves.

use super::Facts;
use super::theme::{ACCENT, BACKGROUND, FAULT, LARGE, LETTERS, WARNING};
use egui::{Align2, Area, Color32, Frame, Id, Margin, Order, RichText, Stroke, Ui, vec2};

/// Something that lasts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Banner {
    pub title: String,
    pub text: String,
    pub is_fault: bool,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    pub text: String,
    pub is_fault: bool,
}

pub fn show(ui: &mut Ui, facts: &Facts, scale: f32) {
    let picture = super::rect(facts, scale);
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
