//! Log-log axes, marks and labels, drawn alike into SVG and pixels.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use std::sync::LazyLock;

/// What an SVG asks its viewer for; under this very name the embedded DejaVu Sans Condensed is known here, by which text is
/// measured and PNGs are lettered. A bare system has no font at all.
const FONT: &str = "DejaVu Sans Condensed, DejaVu Sans, sans-serif";

static LETTERED: LazyLock<bool> =
    LazyLock::new(|| register_font(FONT, FontStyle::Normal, dejavu::sans_condensed::regular()).is_ok());

pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: [RGBColor; 2] = [RGBColor(208, 208, 208), RGBColor(236, 236, 236)];

pub(super) type Drawn = Result<(), String>;

/// Left, top, right, bottom, pixels.
pub(super) type Frame = [f64; 4];

/// What a picture is drawn into.
#[derive(Clone, Copy, Debug)]
pub(super) struct Medium {
    /// Its pixels for one of the picture's, along each edge: letters and slanted lines need finer ones than are shown.
    pub scale: u32,
    /// How far plotters sets letters too high in it, as a share of their size.
    pub raised: f64,
}

/// A picture being drawn. Places and sizes are in the pixels that are shown.
pub(super) struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    medium: Medium,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// # Errors
    /// One line: the embedded font or the drawing failed.
    pub fn new(area: &'a DrawingArea<B, Shift>, medium: Medium) -> Result<Self, String> {
        if !*LETTERED {
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

    /// One of five shapes that differ without colour, about 9 pixels across.
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

    /// Text with its anchor's place: `across` and `down` are 0 at left and top, 1 in the middle, 2 at right and bottom.
    pub fn text(&self, text: &str, at: [f64; 2], size: u32, colour: RGBColor, [across, down]: [usize; 2]) -> Drawn {
        let h = [HPos::Left, HPos::Center, HPos::Right][across.min(2)];
        let v = [VPos::Top, VPos::Center, VPos::Bottom][down.min(2)];
        let style = (FONT, size * self.medium.scale).into_font().color(&colour).pos(Pos::new(h, v));
        let at = self.pixel([at[0], at[1] + self.medium.raised * f64::from(size)]);
        self.area.draw(&Text::new(text.to_string(), at, style)).map_err(|e| fault(&e))
    }

    /// Text that reads upwards, about its middle.
    pub fn upright(&self, text: &str, at: [f64; 2], size: u32) -> Drawn {
        let font = (FONT, size * self.medium.scale).into_font().transform(FontTransform::Rotate270);
        let style = font.color(&INK).pos(Pos::new(HPos::Center, VPos::Center));
        self.area.draw(&Text::new(text.to_string(), self.pixel(at), style)).map_err(|e| fault(&e))
    }

    /// Width and height of a text, pixels.
    pub fn measure(&self, text: &str, size: u32) -> Result<[f64; 2], String> {
        let style = (FONT, size * self.medium.scale).into_font().color(&INK);
        let (w, h) = self.area.estimate_text_size(text, &style).map_err(|e| fault(&e))?;
        Ok([w, h].map(|n| f64::from(n) / f64::from(self.medium.scale)))
    }

    /// The text, cut off with an ellipsis where it is wider than there is room.
    pub fn cut(&self, text: &str, size: u32, room: f64) -> Result<String, String> {
        let mut cut = text.to_string();
        while self.measure(&cut, size)?[0] > room && cut.chars().count() > 1 {
            cut = cut
                .trim_end_matches('…')
                .chars()
                .collect::<Vec<_>>()
                .split_last()
                .map_or(String::new(), |(_, kept)| kept.iter().collect::<String>() + "…");
        }
        Ok(cut)
    }
}

fn fault(e: &dyn std::fmt::Display) -> String {
    format!("plot: cannot be drawn: {e}")
}

/// Two logarithmic axes in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    pub frame: Frame,
    /// Least and largest value across and up.
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl Axes {
    /// Axes that leave some room about all values, of which there is one at least; all must be positive.
    pub fn about(frame: Frame, points: &[[f64; 2]]) -> Axes {
        let around = |axis: usize| {
            let (low, high) = points.iter().fold((f64::MAX, 0.0f64), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
            let room = (high / low).powf(0.06).max(1.3);
            [low / room, high * room]
        };
        Axes { frame, x: around(0), y: around(1) }
    }

    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |v: f64, [low, high]: [f64; 2]| (v / low).ln() / (high / low).ln();
        let [left, top, right, bottom] = self.frame;
        [left + share(x, self.x) * (right - left), bottom - share(y, self.y) * (bottom - top)]
    }

    /// Grid, ticks and names.
    pub fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>, across: &str, up: &str) -> Drawn {
        let [left, top, right, bottom] = self.frame;
        for (value, named) in ticks(self.x) {
            let [x, _] = self.place([value, self.y[0]]);
            canvas.line(&[[x, top], [x, bottom]], if named { GRID[0] } else { GRID[1] })?;
            if named {
                canvas.text(&number(value), [x, bottom + 8.0], 14, INK, [1, 0])?;
            }
        }
        for (value, named) in ticks(self.y) {
            let [_, y] = self.place([self.x[0], value]);
            canvas.line(&[[left, y], [right, y]], if named { GRID[0] } else { GRID[1] })?;
            if named {
                canvas.text(&number(value), [left - 8.0, y], 14, INK, [2, 1])?;
            }
        }
        canvas.boxed(self.frame, INK)?;
        canvas.text(across, [(left + right) / 2.0, bottom + 34.0], 16, INK, [1, 0])?;
        canvas.upright(up, [left - 68.0, (top + bottom) / 2.0], 16)
    }
}

/// Values 1 to 9 of every decade within a range, and whether each is named: the more the fewer decades there are.
fn ticks([low, high]: [f64; 2]) -> Vec<(f64, bool)> {
    let decades = (high / low).log10();
    let named: &[u32] = match decades {
        d if d < 0.7 => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
        d if d < 2.5 => &[1, 2, 5],
        _ => &[1],
    };
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let all = (first..=last).flat_map(|d| (1..=9).map(move |m| (f64::from(m) * 10f64.powi(d), m)));
    all.filter(|(v, _)| *v >= low && *v <= high).map(|(v, m)| (v, named.contains(&m))).collect()
}

/// 0.005, 2, 500 as they are; beyond, as powers of ten.
fn number(value: f64) -> String {
    match value {
        v if (0.000_99..9_999.0).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => format!("{v:.0e}"),
    }
}

/// Where labels go: beside their marks, on top of nothing.
#[derive(Default)]
pub(super) struct Labels {
    /// What is covered.
    taken: Vec<Frame>,
    /// Places along lines, which a label rather keeps clear of.
    lines: Vec<[f64; 2]>,
}

impl Labels {
    pub fn keep_off(&mut self, at: [f64; 2], radius: f64) {
        self.taken.push([at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius]);
    }

    pub fn keep_off_line(&mut self, points: &[[f64; 2]]) {
        for pair in points.windows(2) {
            let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            let count = (dx.hypot(dy) / 3.0).ceil().max(1.0);
            self.lines.extend(
                (0..=count as u32).map(|i| f64::from(i) / count).map(|s| [pair[0][0] + s * dx, pair[0][1] + s * dy]),
            );
        }
    }

    /// Top left of a label of this size for a mark, within the frame; none where there is no room.
    pub fn place(&mut self, at: [f64; 2], [w, h]: [f64; 2], frame: Frame) -> Option<[f64; 2]> {
        let beside = |gap: f64| {
            let (east, west) = (at[0] + gap, at[0] - gap - w);
            let (above, below, level) = (at[1] - gap - h, at[1] + gap, at[1] - h / 2.0);
            let middle = at[0] - w / 2.0;
            let near = 0.7 * gap;
            let (ne, nw) = ([at[0] + near, at[1] - near - h], [at[0] - near - w, at[1] - near - h]);
            let (se, sw) = ([at[0] + near, at[1] + near], [at[0] - near - w, at[1] + near]);
            [[east, level], ne, [middle, above], [middle, below], se, nw, [west, level], sw]
        };
        let candidates: Vec<[f64; 2]> = [11.0, 15.0, 20.0].into_iter().flat_map(beside).collect();
        let boxed = |[x, y]: [f64; 2]| [x - 1.0, y - 1.0, x + w + 1.0, y + h + 1.0];
        let free = |b: Frame| {
            let inside = b[0] >= frame[0] && b[1] >= frame[1] && b[2] <= frame[2] && b[3] <= frame[3];
            inside && !self.taken.iter().any(|t| b[0] < t[2] && t[0] < b[2] && b[1] < t[3] && t[1] < b[3])
        };
        let clear = |b: Frame| !self.lines.iter().any(|p| p[0] > b[0] && p[0] < b[2] && p[1] > b[1] && p[1] < b[3]);
        let found = candidates.iter().find(|c| free(boxed(**c)) && clear(boxed(**c)));
        let found = *found.or_else(|| candidates.iter().find(|c| free(boxed(**c))))?;
        self.taken.push(boxed(found));
        Some(found)
    }
}
