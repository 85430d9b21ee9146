//! Every colour of the panels and of what they draw over the picture. `src/ui/tests/colours.rs` checks them against WCAG 2.2 (AA): the contrast of
//! text is 4.5; that of large text, boundaries and states of controls, and lines is 3. Colours with different meanings differ for every kind of
//! colour vision, or a letter, a name or a shape tells them apart too.

use egui::Color32;

/// Around the picture, and behind messages.
pub const BACKGROUND: Color32 = Color32::from_rgb(9, 10, 13);
pub const PANEL: Color32 = Color32::from_rgb(18, 21, 26);
pub(crate) const BUTTON: Color32 = Color32::from_rgb(36, 42, 50);
/// Boundary of a button, and rail of a slider.
pub const EDGE: Color32 = Color32::from_rgb(110, 119, 130);
/// Fill of a selected control, of the filled part of a rail, and of the primary button.
pub(crate) const SELECTED: Color32 = Color32::from_rgb(42, 124, 152);
/// Background of a selected control that keeps its place, such as a tool or a view.
pub(crate) const CHOSEN: Color32 = Color32::from_rgb(17, 52, 64);
/// The program's logo.
pub(crate) const MARK: Color32 = Color32::from_rgb(214, 122, 82);
pub(crate) const MARK_LIGHT: Color32 = Color32::from_rgb(247, 205, 172);
pub const TEXT: Color32 = Color32::from_rgb(214, 221, 229);
/// Text on [`SELECTED`].
pub(crate) const ON_SELECTED: Color32 = Color32::WHITE;
pub(crate) const WEAK_TEXT: Color32 = Color32::from_rgb(138, 150, 163);
/// A control that does not exist in this mode. WCAG demands no contrast of inactive controls.
pub(crate) const ABSENT: Color32 = Color32::from_rgb(90, 98, 107);
pub(crate) const ACCENT: Color32 = Color32::from_rgb(64, 184, 220);
pub(crate) const GOOD: Color32 = Color32::from_rgb(110, 200, 120);
pub const WARNING: Color32 = Color32::from_rgb(250, 190, 70);
/// Text on a fill of [`WARNING`].
pub(crate) const ON_WARNING: Color32 = BACKGROUND;
pub(crate) const FAULT: Color32 = Color32::from_rgb(240, 96, 84);

/// Background of messages and times over the picture: BACKGROUND, slightly transparent.
pub(crate) const MESSAGE: Color32 = Color32::from_rgba_premultiplied(8, 9, 12, 235);
/// Tint of a picture that keeps its own colours.
pub(crate) const UNCOLOURED: Color32 = Color32::WHITE;
/// Shade over everything behind a question.
pub const SHADE: Color32 = Color32::from_black_alpha(150);
/// Bars of shares, such as times of passes and progress: the filled part, and the whole.
pub(crate) const BAR: Color32 = Color32::from_rgba_premultiplied(26, 74, 88, 102);
pub(crate) const WHOLE_BAR: Color32 = Color32::from_rgba_premultiplied(8, 8, 8, 8);

/// The dark edge of bright lines and letters over the picture, which makes them visible on any tissue.
pub const OUTLINE: Color32 = Color32::from_black_alpha(225);
/// Behind labels and marks over the picture.
pub(crate) const BACKING: Color32 = Color32::from_black_alpha(190);
/// The letters of the patient's sides.
pub const SIDES: Color32 = Color32::WHITE;
/// The body of a body mark.
pub const BODY: Color32 = Color32::from_gray(235);
/// The letter of a plane, on the plane's colour.
pub(crate) const ON_PLANE: Color32 = Color32::BLACK;
/// Measurements: yellow, which no tissue has and which every kind of colour vision distinguishes from grey. Plane A has a similar yellow, but
/// measurements have crosses and numbers.
pub(crate) const MEASURE: Color32 = Color32::from_rgb(255, 214, 64);
/// The line at which rendering starts: green, as on scanners.
pub const START: Color32 = Color32::from_rgb(64, 235, 96);
/// The axes of the volume, each with its name: for some kinds of colour vision two of them look alike.
pub const AXES: [(&str, Color32); 3] = [
    ("lat.", Color32::from_rgb(235, 110, 100)),
    ("depth", Color32::from_rgb(120, 205, 120)),
    ("elev.", Color32::from_rgb(110, 160, 245)),
];
/// Frame of the focused control, and ring around the pointer by keyboard. Both are drawn over a wider line of `FOCUS_EDGE`.
pub const FOCUS: Color32 = Color32::WHITE;
pub(crate) const FOCUS_EDGE: Color32 = Color32::BLACK;
/// The pointer where no windowing system draws one.
pub(crate) const POINTER: Color32 = Color32::WHITE;

/// A colour of the scene, 0..=1, on the screen.
pub(crate) fn of_scene(colour: [f64; 3]) -> Color32 {
    let [r, g, b] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
