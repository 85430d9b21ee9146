//! Diagrams and their text, as SVG or as a picture.

use crate::picture::Picture;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use std::sync::LazyLock;

/// In SVG the text is at the right height; the bitmap rendering of plotters places it too high.
const LINES: Medium = Medium { scale: 1, raised: 0.0 };
const PIXELS: Medium = Medium { scale: 3, raised: 0.12 };

/// The font family that an SVG names. The embedded DejaVu Sans Condensed is registered under the same name; it measures text and
/// draws it in PNGs, since a bare system has no font.
const FONT: &str = "DejaVu Sans Condensed, DejaVu Sans, sans-serif";

static FONT_REGISTERED: LazyLock<bool> =
    LazyLock::new(|| register_font(FONT, FontStyle::Normal, dejavu::sans_condensed::regular()).is_ok());

pub const INK: RGBColor = RGBColor(40, 40, 40);
pub const GRID: [RGBColor; 2] = [RGBColor(208, 208, 208), RGBColor(236, 236, 236)];

pub type Drawn = Result<(), String>;

/// Left, top, right and bottom edge of a rectangle in the output, pixels from its upper left corner.
pub type Frame = [f64; 4];

/// The kind of output.
#[derive(Clone, Copy, Debug)]
struct Medium {
    /// Supersampling factor along each edge, for smooth text and slanted lines.
    pub scale: u32,
    /// How much too high `plotters` draws text in this kind of output, as a share of the font size.
    pub raised: f64,
}

/// The diagram being drawn. Positions and sizes are in output pixels, positions from the upper left corner.
pub struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    medium: Medium,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// # Errors
    /// One line: the embedded font or the drawing failed.
    fn new(area: &'a DrawingArea<B, Shift>, medium: Medium) -> Result<Self, String> {
        if !*FONT_REGISTERED {
            return Err("plot: the embedded font cannot be read".into());
        }
        area.fill(&WHITE).map_err(|e| fault(&e))?;
        Ok(Canvas { area, medium })
    }

    pub fn size(&self) -> [f64; 2] {
        let (w, h) = self.area.dim_in_pixel();
        [w, h].map(|n| f64::from(n / self.medium.scale))
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> (i32, i32) {
        let at = |v: f64| (v * f64::from(self.medium.scale)).round() as i32;
        (at(x), at(y))
    }

    fn styled(&self, style: impl Into<ShapeStyle>) -> ShapeStyle {
        let style = style.into();
        ShapeStyle { stroke_width: style.stroke_width * self.medium.scale, ..style }
    }

    pub fn line(&self, points: &[[f64; 2]], style: impl Into<ShapeStyle>) -> Drawn {
        let points: Vec<_> = points.iter().map(|p| self.pixel(*p)).collect();
        self.area.draw(&PathElement::new(points, self.styled(style))).map_err(|e| fault(&e))
    }

    pub fn boxed(&self, [left, top, right, bottom]: Frame, style: impl Into<ShapeStyle>) -> Drawn {
        let corners = [self.pixel([left, top]), self.pixel([right, bottom])];
        self.area.draw(&Rectangle::new(corners, self.styled(style))).map_err(|e| fault(&e))
    }

    pub fn ring(&self, at: [f64; 2], radius: i32, style: impl Into<ShapeStyle>) -> Drawn {
        self.area
            .draw(&Circle::new(self.pixel(at), radius * self.medium.scale as i32, self.styled(style)))
            .map_err(|e| fault(&e))
    }

    /// Draws a marker of a data point, 8 to 12 pixels across. `shape` modulo 5 selects one of five shapes that differ without colour.
    pub fn mark(&self, at: [f64; 2], shape: usize, colour: RGBColor) -> Drawn {
        let polygon = |corners: &[[f64; 2]]| {
            let points: Vec<_> = corners.iter().map(|c| self.pixel([at[0] + c[0], at[1] + c[1]])).collect();
            self.area.draw(&Polygon::new(points, colour.filled())).map_err(|e| fault(&e))
        };
        match shape % 5 {
            0 => self.ring(at, 4, colour.filled()),
            1 => polygon(&[[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]),
            2 => polygon(&[[0.0, -6.0], [5.0, 4.0], [-5.0, 4.0]]),
            3 => polygon(&[[0.0, -6.0], [6.0, 0.0], [0.0, 6.0], [-6.0, 0.0]]),
            _ => polygon(&[[0.0, 6.0], [5.0, -4.0], [-5.0, -4.0]]),
        }
    }

    /// Draws text of `size` pixels. `at` is its anchor: `across` 0, 1 and 2 are the left end, the middle and the right end of the text; `down`
    /// 0, 1 and 2 are its top, middle and bottom.
    pub fn text(&self, text: &str, at: [f64; 2], size: u32, colour: RGBColor, [across, down]: [usize; 2]) -> Drawn {
        let h = [HPos::Left, HPos::Center, HPos::Right][across.min(2)];
        let v = [VPos::Top, VPos::Center, VPos::Bottom][down.min(2)];
        let style = (FONT, size * self.medium.scale).into_font().color(&colour).pos(Pos::new(h, v));
        let at = self.pixel([at[0], at[1] + self.medium.raised * f64::from(size)]);
        self.area.draw(&Text::new(text.to_string(), at, style)).map_err(|e| fault(&e))
    }

    /// Width and height of a text in letters of `size` pixels, pixels.
    ///
    /// # Errors
    /// One line: the text cannot be measured.
    pub fn measure(&self, text: &str, size: u32) -> Result<[f64; 2], String> {
        let style = (FONT, size * self.medium.scale).into_font().color(&INK);
        let (w, h) = self.area.estimate_text_size(text, &style).map_err(|e| fault(&e))?;
        Ok([w, h].map(|n| f64::from(n) / f64::from(self.medium.scale)))
    }

    /// Returns the text, shortened with an ellipsis if it is wider than `max_width` pixels in letters of `size` pixels.
    ///
    /// # Errors
    /// One line: the text cannot be measured.
    pub fn cut(&self, text: &str, size: u32, max_width: f64) -> Result<String, String> {
        let mut cut = text.to_string();
        while self.measure(&cut, size)?[0] > max_width && cut.chars().count() > 1 {
            let mut kept = cut.trim_end_matches('…').to_string();
            cut = kept.pop().map_or(String::new(), |_| kept + "…");
        }
        Ok(cut)
    }
}

fn fault(e: &dyn std::fmt::Display) -> String {
    format!("plot: cannot be drawn: {e}")
}

/// A drawing that can be rendered as SVG and as a picture.
pub trait Drawing {
    /// Draws on the canvas.
    ///
    /// # Errors
    /// One line: the drawing failed.
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn;
}

/// Renders a drawing as SVG. `size`: width and height, pixels.
///
/// # Errors
/// One line: the drawing failed.
pub fn svg(size: [u32; 2], drawing: &impl Drawing) -> Result<String, String> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size.into()).into_drawing_area();
    drawing.draw(&Canvas::new(&area, LINES)?)?;
    drop(area);
    Ok(text)
}

/// Renders a drawing as a picture. `size`: width and height, pixels.
///
/// # Errors
/// One line: the drawing failed.
pub fn picture(size: [u32; 2], drawing: &impl Drawing) -> Result<Picture, String> {
    let fine = size.map(|n| n * PIXELS.scale);
    let mut rgb = vec![255; 3 * fine[0] as usize * fine[1] as usize];
    let area = BitMapBackend::with_buffer(&mut rgb, fine.into()).into_drawing_area();
    drawing.draw(&Canvas::new(&area, PIXELS)?)?;
    drop(area);
    let [width, height] = size;
    Ok(Picture { width, height, rgba: averaged(&rgb, size, PIXELS.scale as usize) })
}

/// Width of a text in letters of `size` pixels in a picture, pixels.
///
/// # Errors
/// One line: the embedded font cannot be read, or the text cannot be measured.
pub fn text_width(text: &str, size: u32) -> Result<f64, String> {
    let mut rgb = [255; 3 * 9];
    let area = BitMapBackend::with_buffer(&mut rgb, (3, 3)).into_drawing_area();
    Ok(Canvas::new(&area, PIXELS)?.measure(text, size)?[0])
}

/// Downsamples by averaging squares of `edge` pixels; opaque.
fn averaged(rgb: &[u8], [width, height]: [u32; 2], edge: usize) -> Vec<u8> {
    let (width, height) = (width as usize, height as usize);
    let mut rgba = Vec::with_capacity(4 * width * height);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let mut sums = [0; 3];
        for row in y * edge..(y + 1) * edge {
            let first = 3 * edge * (row * width + x);
            for p in rgb[first..first + 3 * edge].chunks_exact(3) {
                (0..3).for_each(|c| sums[c] += usize::from(p[c]));
            }
        }
        rgba.extend(sums.map(|s| (s / (edge * edge)) as u8));
        rgba.push(255);
    }
    rgba
}
