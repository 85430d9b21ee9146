//! Every colour of the panels and of what they draw over the picture. `src/ui/tests/colours.rs` holds them against WCAG 2.2 (AA): text has
//! a contrast of 4.5 with what is behind it; large text, boundaries and states of controls, and lines have one of 3. Colours that are told apart by their meaning
//! differ for every kind of colour vision, or a letter, a name or a shape tells them apart too.

use egui::Color32;

/// Around the picture, and behind messages.
pub(in crate::ui) const BACKGROUND: Color32 = Color32::from_rgb(9, 10, 13);
pub(in crate::ui) const PANEL: Color32 = Color32::from_rgb(18, 21, 26);
pub(in crate::ui) const BUTTON: Color32 = Color32::from_rgb(36, 42, 50);
/// Boundary of a button, and rail of a slider.
pub(in crate::ui) const EDGE: Color32 = Color32::from_rgb(110, 119, 130);
/// Fill of what is chosen, of the filled part of a rail, and of a button that is meant first.
pub(in crate::ui) const SELECTED: Color32 = Color32::from_rgb(42, 124, 152);
pub(in crate::ui) const TEXT: Color32 = Color32::from_rgb(214, 221, 229);
/// Text on [`SELECTED`].
pub(in crate::ui) const ON_SELECTED: Color32 = Color32::WHITE;
pub(in crate::ui) const WEAK_TEXT: Color32 = Color32::from_rgb(138, 150, 163);
/// What is not there in this mode. Of what cannot be used WCAG demands no contrast.
pub(in crate::ui) const ABSENT: Color32 = Color32::from_rgb(90, 98, 107);
pub(in crate::ui) const ACCENT: Color32 = Color32::from_rgb(64, 184, 220);
pub(in crate::ui) const GOOD: Color32 = Color32::from_rgb(110, 200, 120);
pub(in crate::ui) const WARNING: Color32 = Color32::from_rgb(250, 190, 70);
/// Text on a fill of [`WARNING`].
pub(in crate::ui) const ON_WARNING: Color32 = BACKGROUND;
pub(in crate::ui) const FAULT: Color32 = Color32::from_rgb(240, 96, 84);

/// Behind messages and times over the picture: BACKGROUND that lets a little of the picture through.
pub(in crate::ui) const MESSAGE: Color32 = Color32::from_rgba_premultiplied(8, 9, 12, 235);
/// A picture in its own colours.
pub(in crate::ui) const UNCOLOURED: Color32 = Color32::WHITE;
/// Over everything behind a question.
pub(in crate::ui) const SHADE: Color32 = Color32::from_black_alpha(150);
/// A bar of a pass's time, and what it is a share of.
pub(in crate::ui) const BAR: Color32 = Color32::from_rgba_premultiplied(26, 74, 88, 102);
pub(in crate::ui) const WHOLE_BAR: Color32 = Color32::from_rgba_premultiplied(8, 8, 8, 8);

/// The dark edge of bright lines and letters over the picture, which makes them visible on any tissue.
pub(in crate::ui) const OUTLINE: Color32 = Color32::from_black_alpha(225);
/// Behind labels and marks over the picture.
pub(in crate::ui) const BACKING: Color32 = Color32::from_black_alpha(190);
/// The letters of the patient's sides.
pub(in crate::ui) const SIDES: Color32 = Color32::WHITE;
/// The body of a body mark.
pub(in crate::ui) const BODY: Color32 = Color32::from_gray(235);
/// The letter of a plane, on the plane's colour.
pub(in crate::ui) const ON_PLANE: Color32 = Color32::BLACK;
/// Measurements: yellow, which no tissue has and every kind of colour vision sees on grey. Plane A has a similar yellow; a measurement has crosses at its points
/// and a number.
pub(in crate::ui) const MEASURE: Color32 = Color32::from_rgb(255, 214, 64);
/// The line at which rendering starts: green, as on scanners.
pub(in crate::ui) const START: Color32 = Color32::from_rgb(64, 235, 96);
/// The axes of the volume, each with its name: for some kinds of colour vision two of them look alike.
pub(in crate::ui) const AXES: [(&str, Color32); 3] = [
    ("lat.", Color32::from_rgb(235, 110, 100)),
    ("depth", Color32::from_rgb(120, 205, 120)),
    ("elev.", Color32::from_rgb(110, 160, 245)),
];
/// The frame around the control that has the keyboard, and the pointer that is drawn where no windowing system draws one; and their dark edge.
pub(in crate::ui) const FOCUS: Color32 = Color32::WHITE;
pub(in crate::ui) const FOCUS_EDGE: Color32 = Color32::BLACK;
pub(in crate::ui) const POINTER: Color32 = Color32::WHITE;

/// A colour of the scene, 0..=1, on the screen.
pub(in crate::ui) fn of_scene(colour: [f64; 3]) -> Color32 {
    let [r, g, b] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
