//! The work-precision diagram as SVG or PNG: error over time on the device, both axes logarithmic, one line per dial.

use super::{Dial, Measure, Reference, Report, Sizes};
use crate::picture::Picture;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use std::sync::LazyLock;

/// Colours by Okabe and Ito, distinguishable with any colour vision; without yellow, which is hard to see on white.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];
const FRONT: RGBColor = RGBColor(255, 214, 120);
/// Width of the legend, pixels.
const LEGEND: f64 = 250.0;
/// Minimum width and height, pixels.
const MIN_SIZE: [u32; 2] = [640, 400];
/// Maximum width and height, pixels.
const MAX_SIZE: u32 = 4096;
/// In SVG the text is at the right height; the bitmap rendering of plotters places it too high.
const LINES: Medium = Medium { scale: 1, raised: 0.0 };
const PIXELS: Medium = Medium { scale: 3, raised: 0.12 };

/// The diagram as SVG, `size` in pixels.
///
/// # Errors
/// One line: no point has a time and such an error, or the size is not within 640x400..4096x4096.
pub fn svg(report: &Report, measure: Measure, size: [u32; 2]) -> Result<String, String> {
    check(size)?;
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size.into()).into_drawing_area();
    draw(&area, LINES, report, measure)?;
    drop(area);
    Ok(text)
}

/// The diagram as a picture, `size` in pixels.
///
/// # Errors
/// As [`svg`].
pub fn picture(report: &Report, measure: Measure, size: [u32; 2]) -> Result<Picture, String> {
    check(size)?;
    let fine = size.map(|n| n * PIXELS.scale);
    let mut rgb = vec![255; 3 * fine[0] as usize * fine[1] as usize];
    let area = BitMapBackend::with_buffer(&mut rgb, fine.into()).into_drawing_area();
    draw(&area, PIXELS, report, measure)?;
    drop(area);
    let [width, height] = size;
    Ok(Picture { width, height, rgba: averaged(&rgb, size, PIXELS.scale as usize) })
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

fn check([width, height]: [u32; 2]) -> Result<(), String> {
    let [w, h] = MIN_SIZE;
    if width < w || height < h || width > MAX_SIZE || height > MAX_SIZE {
        return Err(format!("plot: size is {width}x{height}, must lie in {w}x{h}..={MAX_SIZE}x{MAX_SIZE}"));
    }
    Ok(())
}

/// A point of the diagram.
struct PlottedPoint {
    dial: usize,
    point: usize,
    /// Minimum, median, maximum, ms.
    time: [f64; 3],
    error: f64,
}

fn plotted_points(report: &Report, measure: Measure) -> Vec<PlottedPoint> {
    let mut all = Vec::new();
    for (d, dial) in report.dials.iter().enumerate() {
        for (p, point) in dial.points.iter().enumerate() {
            if let (Some(time), Some(error)) = (point.time.filter(|t| t.low > 0.0), measure.of(&point.errors)) {
                let time = [time.low, time.median, time.high].map(|t| t * 1e-6);
                all.push(PlottedPoint { dial: d, point: p, time, error });
            }
        }
    }
    all
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, medium: Medium, report: &Report, measure: Measure) -> Drawn {
    let mut all = plotted_points(report, measure);
    if all.is_empty() {
        return Err(format!("plot: no setting has a time and an {}", measure.name()));
    }
    // A logarithmic axis has no 0: exact agreement is drawn half a decade below all other points.
    let positive = all.iter().map(|s| s.error).filter(|e| *e > 0.0).fold(f64::MAX, f64::min);
    let exact = if positive == f64::MAX { 1e-9 } else { positive / 3.0 };
    let zeros = all.iter().filter(|s| s.error == 0.0).count();
    all.iter_mut().filter(|s| s.error == 0.0).for_each(|s| s.error = exact);
    let canvas = Canvas::new(area, medium)?;
    let [width, height] = canvas.size();
    let frame = [96.0, 96.0, width - LEGEND - 20.0, height - 72.0];
    let ends: Vec<[f64; 2]> = all.iter().flat_map(|s| s.time.map(|t| [t, s.error])).collect();
    let axes = Axes::about(frame, &ends);
    head(&canvas, report, width)?;
    axes.draw(&canvas, "time on the device (ms)", measure.name())?;
    if zeros > 0 {
        let [_, y] = axes.place([axes.x[0], exact]);
        canvas.line(&[[frame[0], y], [frame[2], y]], INK.mix(0.4))?;
        canvas.text("0 (exact)", [frame[2] - 6.0, y + 4.0], 13, INK, [2, 0])?;
    }

    let fronts = report.pareto_front(measure);
    let place = |s: &PlottedPoint| axes.place([s.time[1], s.error]);
    let on_front = |s: &PlottedPoint| fronts.contains(&(s.dial, s.point));
    let mut labels = Labels::default();
    let steps = staircase(
        &fronts.iter().filter_map(|at| all.iter().find(|s| (s.dial, s.point) == *at)).map(place).collect::<Vec<_>>(),
    );
    canvas.line(&steps, FRONT.stroke_width(6))?;
    labels.keep_off_line(&steps);
    for (d, dial) in report.dials.iter().enumerate() {
        let mut of_dial: Vec<&PlottedPoint> = all.iter().filter(|s| s.dial == d).collect();
        of_dial.sort_by(|a, b| dial.points[a.point].value.total_cmp(&dial.points[b.point].value));
        let line: Vec<[f64; 2]> = of_dial.iter().map(|s| place(s)).collect();
        canvas.line(&line, colour(d).mix(0.5).stroke_width(1))?;
        labels.keep_off_line(&line);
        for s in &of_dial {
            let [low, _, high] = s.time.map(|t| axes.place([t, s.error]));
            canvas.line(&[low, high], colour(d).stroke_width(2))?;
            labels.keep_off(place(s), 8.5);
        }
    }
    for s in &all {
        if on_front(s) {
            canvas.ring(place(s), 8, INK.stroke_width(1))?;
        }
        if report.dials[s.dial].points[s.point].is_default {
            let [x, y] = place(s);
            canvas.boxed([x - 8.0, y - 8.0, x + 8.0, y + 8.0], INK)?;
        }
        canvas.mark(place(s), s.dial, colour(s.dial))?;
    }

    // The most important points get their labels first.
    let rank = |s: &PlottedPoint| (!on_front(s), !report.dials[s.dial].points[s.point].is_default);
    let mut order: Vec<&PlottedPoint> = all.iter().collect();
    order.sort_by_key(|s| rank(s));
    let mut unnamed = 0;
    for s in order {
        let label = canvas.cut(&report.dials[s.dial].points[s.point].label, 13, 140.0)?;
        match labels.place(place(s), canvas.measure(&label, 13)?, frame) {
            Some(at) => canvas.text(&label, at, 13, darker(colour(s.dial)), [0, 0])?,
            None => unnamed += 1,
        }
    }
    legend(&canvas, report, frame[2] + 18.0, unnamed)
}

fn head<B: DrawingBackend>(canvas: &Canvas<B>, report: &Report, width: f64) -> Drawn {
    let Sizes { volume: [w, h, d], picture: [pw, ph] } = report.sizes;
    let scene = format!("{}: volume {w}x{h}x{d}, picture {pw}x{ph}", report.scene.lines().next().unwrap_or_default());
    let repeats = format!("median and range of {} runs", report.repeats);
    let device = format!("{}, {}, {}; {repeats}", report.device, report.driver, report.date);
    canvas.text("Error against run time", [24.0, 14.0], 24, INK, [0, 0])?;
    canvas.text(&canvas.cut(&scene, 15, width - 48.0)?, [24.0, 44.0], 15, INK, [0, 0])?;
    canvas.text(&canvas.cut(&device, 15, width - 48.0)?, [24.0, 64.0], 15, INK, [0, 0])
}

/// One row per dial: its unit, its order, and its reference unless that is f64.
fn legend<B: DrawingBackend>(canvas: &Canvas<B>, report: &Report, left: f64, unnamed: usize) -> Drawn {
    let mut y = 106.0;
    let width = LEGEND - 30.0;
    for (d, dial) in report.dials.iter().enumerate() {
        canvas.mark([left + 6.0, y], d, colour(d))?;
        canvas.text(&canvas.cut(&title(dial), 15, width)?, [left + 20.0, y], 15, INK, [0, 1])?;
        y += 18.0;
        for line in notes(dial) {
            canvas.text(&canvas.cut(&line, 12, width)?, [left + 20.0, y], 12, INK, [0, 1])?;
            y += 15.0;
        }
        y += 6.0;
    }
    y += 8.0;
    canvas.line(&[[left - 2.0, y], [left + 14.0, y]], FRONT.stroke_width(6))?;
    canvas.ring([left + 6.0, y], 8, INK.stroke_width(1))?;
    canvas.text("Pareto front", [left + 24.0, y], 15, INK, [0, 1])?;
    y += 26.0;
    canvas.boxed([left - 2.0, y - 8.0, left + 14.0, y + 8.0], INK)?;
    canvas.text("default", [left + 24.0, y], 15, INK, [0, 1])?;
    if unnamed > 0 {
        y += 26.0;
        canvas.text(&format!("points without room for a name: {unnamed}"), [left, y], 12, INK, [0, 1])?;
    }
    Ok(())
}

fn title(dial: &Dial) -> String {
    match dial.unit.is_empty() {
        true => dial.name.clone(),
        false => format!("{} ({})", dial.name, dial.unit),
    }
}

fn notes(dial: &Dial) -> Vec<String> {
    let order = dial.order.map(|fit| format!("order {:.2} ± {:.2}", fit.order, fit.standard_error));
    let against = match &dial.reference {
        Reference::F64 => None,
        Reference::AsItIs => Some("another look: difference, no error".to_string()),
        Reference::Converged { rmse, .. } => Some(format!("against a picture good to {rmse:.0e}")),
    };
    order.into_iter().chain(against).collect()
}

/// The front as a staircase: level until the next better point.
fn staircase(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut steps: Vec<[f64; 2]> = Vec::new();
    for point in points {
        steps.extend(steps.last().map(|last| [point[0], last[1]]));
        steps.push(*point);
    }
    steps
}

fn colour(dial: usize) -> RGBColor {
    COLOURS[dial % COLOURS.len()]
}

/// A darker colour for labels: small text in a pale colour is hard to read.
fn darker(RGBColor(r, g, b): RGBColor) -> RGBColor {
    let [r, g, b] = [r, g, b].map(|c| (f64::from(c) * 0.7) as u8);
    RGBColor(r, g, b)
}

/// The font family that an SVG names. The embedded DejaVu Sans Condensed is registered under the same name; it measures text and
/// draws it in PNGs, since a bare system has no font.
const FONT: &str = "DejaVu Sans Condensed, DejaVu Sans, sans-serif";

static FONT_REGISTERED: LazyLock<bool> =
    LazyLock::new(|| register_font(FONT, FontStyle::Normal, dejavu::sans_condensed::regular()).is_ok());

const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: [RGBColor; 2] = [RGBColor(208, 208, 208), RGBColor(236, 236, 236)];

type Drawn = Result<(), String>;

/// Left, top, right, bottom, pixels.
type Frame = [f64; 4];

/// The kind of output.
#[derive(Clone, Copy, Debug)]
struct Medium {
    /// Supersampling factor along each edge, for smooth text and slanted lines.
    pub scale: u32,
    /// How far plotters places text too high, as a share of its size.
    pub raised: f64,
}

/// The diagram being drawn. Positions and sizes are in output pixels.
struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    medium: Medium,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// # Errors
    /// One line: the embedded font or the drawing failed.
    pub fn new(area: &'a DrawingArea<B, Shift>, medium: Medium) -> Result<Self, String> {
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

    pub(crate) fn boxed(&self, [left, top, right, bottom]: Frame, style: impl Into<ShapeStyle>) -> Drawn {
        let corners = [self.pixel([left, top]), self.pixel([right, bottom])];
        self.area.draw(&Rectangle::new(corners, self.styled(style))).map_err(|e| fault(&e))
    }

    pub fn ring(&self, at: [f64; 2], radius: i32, style: impl Into<ShapeStyle>) -> Drawn {
        self.area
            .draw(&Circle::new(self.pixel(at), radius * self.medium.scale as i32, self.styled(style)))
            .map_err(|e| fault(&e))
    }

    /// One of five shapes that differ without colour, about 9 pixels across.
    pub(crate) fn mark(&self, at: [f64; 2], shape: usize, colour: RGBColor) -> Drawn {
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

    /// Text at its anchor: `across` and `down` are 0 for left and top, 1 for the middle, 2 for right and bottom.
    pub fn text(&self, text: &str, at: [f64; 2], size: u32, colour: RGBColor, [across, down]: [usize; 2]) -> Drawn {
        let h = [HPos::Left, HPos::Center, HPos::Right][across.min(2)];
        let v = [VPos::Top, VPos::Center, VPos::Bottom][down.min(2)];
        let style = (FONT, size * self.medium.scale).into_font().color(&colour).pos(Pos::new(h, v));
        let at = self.pixel([at[0], at[1] + self.medium.raised * f64::from(size)]);
        self.area.draw(&Text::new(text.to_string(), at, style)).map_err(|e| fault(&e))
    }

    /// Vertical text, read upwards, centred.
    pub(crate) fn upright(&self, text: &str, at: [f64; 2], size: u32) -> Drawn {
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

    /// The text, cut with an ellipsis if it is wider than `max_width` pixels.
    pub fn cut(&self, text: &str, size: u32, max_width: f64) -> Result<String, String> {
        let mut cut = text.to_string();
        while self.measure(&cut, size)?[0] > max_width && cut.chars().count() > 1 {
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
struct Axes {
    pub frame: Frame,
    /// Minimum and maximum of the horizontal axis.
    pub x: [f64; 2],
    /// Minimum and maximum of the vertical axis.
    pub y: [f64; 2],
}

impl Axes {
    /// Axes with a margin around all points. There must be at least one point, and all values must be positive.
    pub fn about(frame: Frame, points: &[[f64; 2]]) -> Axes {
        let around = |axis: usize| {
            let (low, high) = points.iter().fold((f64::MAX, 0.0f64), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
            let margin = (high / low).powf(0.06).max(1.3);
            [low / margin, high * margin]
        };
        Axes { frame, x: around(0), y: around(1) }
    }

    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |v: f64, [low, high]: [f64; 2]| (v / low).ln() / (high / low).ln();
        let [left, top, right, bottom] = self.frame;
        [left + share(x, self.x) * (right - left), bottom - share(y, self.y) * (bottom - top)]
    }

    /// Draws grid, ticks and axis titles.
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

/// Tick values 1 to 9 of every decade within a range, and whether each has a label: more labels for fewer decades.
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

/// A tick label: decimal from 0.001 to 9999, otherwise scientific.
fn number(value: f64) -> String {
    match value {
        v if (0.000_99..9_999.0).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => format!("{v:.0e}"),
    }
}

/// Placement of labels next to their marks without overlap.
#[derive(Default)]
struct Labels {
    /// Covered rectangles.
    taken: Vec<Frame>,
    /// Points along lines, which labels avoid if possible.
    lines: Vec<[f64; 2]>,
}

impl Labels {
    fn keep_off(&mut self, at: [f64; 2], radius: f64) {
        self.taken.push([at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius]);
    }

    fn keep_off_line(&mut self, points: &[[f64; 2]]) {
        for pair in points.windows(2) {
            let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            let count = (dx.hypot(dy) / 3.0).ceil().max(1.0);
            self.lines.extend(
                (0..=count as u32).map(|i| f64::from(i) / count).map(|s| [pair[0][0] + s * dx, pair[0][1] + s * dy]),
            );
        }
    }

    /// Top left of a label of this size for a mark, within the frame; None if there is no free place.
    pub fn place(&mut self, at: [f64; 2], [w, h]: [f64; 2], frame: Frame) -> Option<[f64; 2]> {
        let around = |gap: f64| {
            let (east, west) = (at[0] + gap, at[0] - gap - w);
            let (above, below, level) = (at[1] - gap - h, at[1] + gap, at[1] - h / 2.0);
            let middle = at[0] - w / 2.0;
            let near = 0.7 * gap;
            let (ne, nw) = ([at[0] + near, at[1] - near - h], [at[0] - near - w, at[1] - near - h]);
            let (se, sw) = ([at[0] + near, at[1] + near], [at[0] - near - w, at[1] + near]);
            [[east, level], ne, [middle, above], [middle, below], se, nw, [west, level], sw]
        };
        let candidates: Vec<[f64; 2]> = [11.0, 15.0, 20.0].into_iter().flat_map(around).collect();
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
