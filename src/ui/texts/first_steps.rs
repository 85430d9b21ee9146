//! Texts of the hints of the first start.

pub(crate) const FIRST_STEPS: &str = "First steps";
/// Pairs of an action and its effect.
pub(crate) const HINTS: [(&str, &str); 3] =
    [("Drag", "turns the view"), ("Wheel", "zooms; over a plane: steps it"), ("H", "shows every key and gesture")];
pub(crate) const CLOSE_HINTS_HINT: &str = "Closes these hints; they do not come again.";
