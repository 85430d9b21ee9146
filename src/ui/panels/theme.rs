//! The theme of the panels: dark, so that the picture is the brightest part of the screen, and large enough for gloves and for reading from
//! 2 m.

use egui::{Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Theme, vec2};
use std::sync::Arc;

pub(super) const BACKGROUND: Color32 = Color32::from_rgb(9, 10, 13);
pub(super) const PANEL: Color32 = Color32::from_rgb(18, 21, 26);
pub(super) const BUTTON: Color32 = Color32::from_rgb(36, 42, 50);
pub(super) const TEXT: Color32 = Color32::from_rgb(214, 221, 229);
pub(super) const WEAK_TEXT: Color32 = Color32::from_rgb(138, 150, 163);
pub(super) const ACCENT: Color32 = Color32::from_rgb(64, 184, 220);
pub(super) const GOOD: Color32 = Color32::from_rgb(110, 200, 120);
pub(super) const WARNING: Color32 = Color32::from_rgb(250, 190, 70);
pub(super) const FAULT: Color32 = Color32::from_rgb(240, 96, 84);

/// Size of running text, points: at a scale of 1 on a monitor with 96 dots per inch it is 5 mm high, which a healthy eye reads from 2 m.
pub(super) const TEXT_SIZE: f32 = 19.0;
/// Size of important text, such as messages.
pub(super) const LARGE_TEXT: f32 = 26.0;
pub(super) const SMALL_TEXT: f32 = 15.0;
/// Minimum size of a button for a gloved finger, points: 14 mm at 96 dots per inch.
pub(super) const TOUCH_SIZE: f32 = 52.0;

/// Sets typeface, sizes and colours.
pub(super) fn apply(context: &egui::Context) {
    let mut fonts = FontDefinitions::empty();
    let faces = [
        ("sans", FontFamily::Proportional, dejavu::sans_condensed::regular()),
        ("mono", FontFamily::Monospace, dejavu::sans_mono::regular()),
    ];
    for (name, family, bytes) in faces {
        fonts.font_data.insert(name.into(), Arc::new(FontData::from_static(bytes)));
        fonts.families.insert(family, vec![name.into()]);
    }
    context.set_fonts(fonts);
    context.set_theme(Theme::Dark);
    let mut style = (*context.style_of(Theme::Dark)).clone();
    let text = |size| FontId::proportional(size);
    style.text_styles = [
        (TextStyle::Small, text(SMALL_TEXT)),
        (TextStyle::Body, text(TEXT_SIZE)),
        (TextStyle::Button, text(TEXT_SIZE)),
        (TextStyle::Heading, text(LARGE_TEXT)),
        (TextStyle::Monospace, FontId::monospace(SMALL_TEXT)),
    ]
    .into();
    style.spacing.item_spacing = vec2(8.0, 8.0);
    style.spacing.button_padding = vec2(8.0, 6.0);
    style.spacing.interact_size = vec2(TOUCH_SIZE, TOUCH_SIZE * 0.7);
    style.spacing.slider_rail_height = 10.0;
    style.spacing.scroll.bar_width = 14.0;
    style.interaction.selectable_labels = false;
    // A tooltip would cover the picture, and a finger cannot hover.
    style.interaction.tooltip_delay = f32::INFINITY;
    let visuals = &mut style.visuals;
    visuals.panel_fill = PANEL;
    visuals.window_fill = PANEL;
    visuals.extreme_bg_color = BACKGROUND;
    visuals.override_text_color = Some(TEXT);
    visuals.selection.bg_fill = ACCENT.gamma_multiply(0.55);
    visuals.selection.stroke = Stroke::new(1.5, Color32::WHITE);
    visuals.slider_trailing_fill = true;
    for widget in [&mut visuals.widgets.inactive, &mut visuals.widgets.hovered, &mut visuals.widgets.active] {
        (widget.bg_fill, widget.weak_bg_fill) = (BUTTON, BUTTON);
        widget.corner_radius = CornerRadius::same(6);
        widget.expansion = 0.0;
    }
    visuals.widgets.hovered.bg_stroke = Stroke::new(1.0, WEAK_TEXT);
    visuals.widgets.active.bg_fill = ACCENT.gamma_multiply(0.4);
    visuals.widgets.active.weak_bg_fill = ACCENT.gamma_multiply(0.4);
    context.set_style_of(Theme::Dark, style);
}
