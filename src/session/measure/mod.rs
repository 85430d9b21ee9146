//! Measurements: the geometry of calipers, contours and volumes in f64, their results as text and CSV, and their drawing, with that of body
//! marks, over a picture. It needs no device and no window.

pub mod body_marks;
mod body_outlines;
pub mod contours;
pub mod made;
pub mod outcome;
pub mod overlay;
pub mod shapes;
