//! The shapes of a layout, for tests: in painting order, in points, with colours premultiplied by their opacity.

use egui::Shape;
use egui::epaint::ClippedShape;

/// Left, top, right and bottom edge of a rectangle, points.
pub type Area = [f32; 4];
pub type Colour = [u8; 4];

#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    Rect {
        area: Area,
        fill: Colour,
        edge: Colour,
    },
    Circle {
        centre: [f32; 2],
        radius: f32,
        fill: Colour,
        edge: Colour,
    },
    Line {
        ends: [[f32; 2]; 2],
        width: f32,
        colour: Colour,
    },
    Polygon {
        corners: Vec<[f32; 2]>,
        fill: Colour,
    },
    /// A text; `area` is what it covers, `size` the height of its largest letter.
    Text {
        area: Area,
        text: String,
        size: f32,
        colours: Vec<Colour>,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// The area outside of which the shape is not drawn.
    pub clip: Area,
    pub kind: Kind,
}

pub(super) fn drawn(shapes: &[ClippedShape]) -> Vec<Drawn> {
    let mut found = Vec::new();
    shapes.iter().for_each(|clipped| add(area(clipped.clip_rect), &clipped.shape, &mut found));
    found
}

fn area(rect: egui::Rect) -> Area {
    [rect.left(), rect.top(), rect.right(), rect.bottom()]
}

fn add(clip: Area, shape: &Shape, found: &mut Vec<Drawn>) {
    let kind = match shape {
        Shape::Vec(shapes) => return shapes.iter().for_each(|shape| add(clip, shape, found)),
        // A shadow is no boundary.
        Shape::Rect(rect) if rect.blur_width > 0.0 => return,
        Shape::Rect(rect) => {
            Kind::Rect { area: area(rect.rect), fill: rect.fill.to_array(), edge: rect.stroke.color.to_array() }
        }
        Shape::Circle(circle) => Kind::Circle {
            centre: circle.center.into(),
            radius: circle.radius,
            fill: circle.fill.to_array(),
            edge: circle.stroke.color.to_array(),
        },
        Shape::LineSegment { points, stroke } => {
            Kind::Line { ends: points.map(Into::into), width: stroke.width, colour: stroke.color.to_array() }
        }
        // A line of several pieces.
        Shape::Path(path) if !path.closed && path.fill == egui::Color32::TRANSPARENT => {
            let egui::epaint::ColorMode::Solid(colour) = path.stroke.color else { return };
            let line = |ends: &[egui::Pos2]| Kind::Line {
                ends: [ends[0], ends[1]].map(Into::into),
                width: path.stroke.width,
                colour: colour.to_array(),
            };
            found.extend(path.points.windows(2).map(|ends| Drawn { clip, kind: line(ends) }));
            return;
        }
        Shape::Path(path) => {
            Kind::Polygon { corners: path.points.iter().map(|p| (*p).into()).collect(), fill: path.fill.to_array() }
        }
        Shape::Text(text) => {
            let galley = &text.galley;
            let ink = galley.mesh_bounds.translate(text.pos.to_vec2());
            let sections = &galley.job.sections;
            let colours = sections.iter().map(|section| {
                let own = section.format.color;
                let own = if own == egui::Color32::PLACEHOLDER { text.fallback_color } else { own };
                text.override_text_color.unwrap_or(own).gamma_multiply(text.opacity_factor).to_array()
            });
            let size = sections.iter().map(|section| section.format.font_id.size).fold(0.0, f32::max);
            Kind::Text { area: area(ink), text: galley.text().to_string(), size, colours: colours.collect() }
        }
        _ => return,
    };
    found.push(Drawn { clip, kind });
}
