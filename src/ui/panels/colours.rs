//! Every colour of the panels and of what they draw over the picture. `src/ui/tests/colours.rs` checks them against WCAG 2.2 (AA): the contrast of
//! text is 4.5; that of large text, boundaries and states of controls, and lines is 3. Colours with different meanings differ for every kind of
//! colour vision, or a letter, a name or a shape tells them apart too.

use egui::Color32;

/// Colour around the picture and behind messages.
pub const BACKGROUND: Color32 = Color32::from_rgb(9, 10, 13);
pub const PANEL: Color32 = Color32::from_rgb(18, 21, 26);
pub(crate) const BUTTON: Color32 = Color32::from_rgb(36, 42, 50);
/// Colour of the outline of a button, and of the rail of a slider.
pub const EDGE: Color32 = Color32::from_rgb(110, 119, 130);
/// Colour of a selected control, of the filled part of a slider's rail, and of the primary button.
pub(crate) const SELECTED: Color32 = Color32::from_rgb(42, 124, 152);
/// Background of a selected control that always stays at its position, such as a tool or a view.
pub(crate) const CHOSEN: Color32 = Color32::from_rgb(17, 52, 64);
/// Colours of the program's logo.
pub(crate) const MARK: Color32 = Color32::from_rgb(214, 122, 82);
pub(crate) const MARK_LIGHT: Color32 = Color32::from_rgb(247, 205, 172);
pub const TEXT: Color32 = Color32::from_rgb(214, 221, 229);
/// Colour of text on [`SELECTED`].
pub(crate) const ON_SELECTED: Color32 = Color32::WHITE;
pub(crate) const WEAK_TEXT: Color32 = Color32::from_rgb(138, 150, 163);
/// Colour of a control that does not exist in the present mode. WCAG demands no contrast of inactive controls.
pub(crate) const ABSENT: Color32 = Color32::from_rgb(90, 98, 107);
pub(crate) const ACCENT: Color32 = Color32::from_rgb(64, 184, 220);
pub(crate) const GOOD: Color32 = Color32::from_rgb(110, 200, 120);
pub const WARNING: Color32 = Color32::from_rgb(250, 190, 70);
/// Colour of text on [`WARNING`].
pub(crate) const ON_WARNING: Color32 = BACKGROUND;
pub(crate) const FAULT: Color32 = Color32::from_rgb(240, 96, 84);

/// Background of messages and times over the picture: [`BACKGROUND`], slightly transparent.
pub(crate) const MESSAGE: Color32 = Color32::from_rgba_premultiplied(8, 9, 12, 235);
/// Tint of a picture (thumbnail) that is drawn in its own colours.
pub(crate) const UNCOLOURED: Color32 = Color32::WHITE;
/// Colour that darkens everything behind a question.
pub const SHADE: Color32 = Color32::from_black_alpha(150);
/// Colour of the filled part of a bar, such as one of progress or of times of passes. [`WHOLE_BAR`] is that of the whole bar.
pub(crate) const BAR: Color32 = Color32::from_rgba_premultiplied(26, 74, 88, 102);
pub(crate) const WHOLE_BAR: Color32 = Color32::from_rgba_premultiplied(8, 8, 8, 8);

/// Colour of the dark outline of bright lines and letters over the picture, which makes them visible on any tissue.
pub const OUTLINE: Color32 = Color32::from_black_alpha(225);
/// Colour behind labels and marks over the picture.
pub(crate) const BACKING: Color32 = Color32::from_black_alpha(190);
/// Colour of the letters of the patient's sides.
pub const SIDES: Color32 = Color32::WHITE;
/// Colour of the lines of the body in a body mark.
pub const BODY: Color32 = Color32::from_gray(235);
/// Colour of the letter of a plane, on the plane's own colour.
pub(crate) const ON_PLANE: Color32 = Color32::BLACK;
/// Colour of measurements: yellow, which no tissue has and which every kind of colour vision distinguishes from grey. Plane A has a similar
/// yellow, but measurements have crosses and numbers.
pub(crate) const MEASURE: Color32 = Color32::from_rgb(255, 214, 64);
/// Colour of the line at which rendering starts: green, as on scanners.
pub const START: Color32 = Color32::from_rgb(64, 235, 96);
/// Names and colours of the axes of the volume. The names are needed because for some kinds of colour vision two of the colours look alike.
pub const AXES: [(&str, Color32); 3] = [
    ("lat.", Color32::from_rgb(235, 110, 100)),
    ("depth", Color32::from_rgb(120, 205, 120)),
    ("elev.", Color32::from_rgb(110, 160, 245)),
];
/// Colour of the frame of the focused control, and of the ring around the pointer that keys move. Both are drawn over a wider line of
/// `FOCUS_EDGE`.
pub const FOCUS: Color32 = Color32::WHITE;
pub(crate) const FOCUS_EDGE: Color32 = Color32::BLACK;
/// Colour of the pointer if no window system draws it.
pub(crate) const POINTER: Color32 = Color32::WHITE;

/// A colour of the scene's settings (red, green, blue, 0..=1) as a colour of the panels.
pub(crate) fn of_scene(colour: [f64; 3]) -> Color32 {
    let [r, g, b] = colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
