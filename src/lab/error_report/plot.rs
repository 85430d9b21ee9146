//! The work-precision diagram as SVG or PNG: one panel for each dial and one for the choices. A panel shows the error over the time that
//! its dial changes, of the picture or of the volume, both logarithmic. Every point is named. A line joins values of an axis, but never
//! names. Dials of another look, whose differences are not errors, have a separate figure.

use super::{Dial, Kind, Measure, Reference, Report, Sizes, Time, Times, choose};
use crate::canvas::{self, Canvas, Drawing, Drawn, Frame, GRID, INK};
use crate::picture::Picture;
use plotters::prelude::*;

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
/// Height of the text above the panels, pixels.
const HEAD: f64 = 92.0;
/// Columns of panels, and the size of a panel in [`size`], pixels.
const COLUMNS: usize = 3;
const PANEL: [u32; 2] = [400, 300];
/// Minimum width and height, pixels.
const MIN_SIZE: [u32; 2] = [640, 400];
/// Maximum width and height, pixels.
const MAX_SIZE: u32 = 4096;

/// Which dials a diagram shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Dials whose differences are errors, and the combinations of their settings.
    Errors,
    /// Dials whose settings differ in look, by their differences from the scene's own look.
    Looks,
}

impl Figure {
    /// The dials of the figure, each with its index in the report.
    fn dials(self, report: &Report) -> impl Iterator<Item = (usize, &Dial)> {
        report.dials.iter().enumerate().filter(move |(_, dial)| (dial.kind == Kind::Look) == (self == Figure::Looks))
    }

    /// True if the report has dials that this diagram shows.
    pub fn is_in(self, report: &Report) -> bool {
        self.dials(report).next().is_some()
    }
}

/// The diagram as SVG: the error by `measure` over the time. `size`: width and height, pixels.
///
/// # Errors
/// One line: no point has both a time and this error, the size is not within 640x400..=4096x4096, or the drawing failed.
pub fn svg(report: &Report, figure: Figure, measure: Measure, size: [u32; 2]) -> Result<String, String> {
    check(size)?;
    canvas::svg(size, &Diagram { report, figure, measure })
}

/// The diagram as a picture: the error by `measure` over the time. `size`: width and height, pixels.
///
/// # Errors
/// One line: no point has both a time and this error, the size is not within 640x400..=4096x4096, or the drawing failed.
pub fn picture(report: &Report, figure: Figure, measure: Measure, size: [u32; 2]) -> Result<Picture, String> {
    check(size)?;
    canvas::picture(size, &Diagram { report, figure, measure })
}

fn check([width, height]: [u32; 2]) -> Result<(), String> {
    let [w, h] = MIN_SIZE;
    if width < w || height < h || width > MAX_SIZE || height > MAX_SIZE {
        return Err(format!("plot: size is {width}x{height}, must lie in {w}x{h}..={MAX_SIZE}x{MAX_SIZE}"));
    }
    Ok(())
}

/// Width and height, pixels, at which every panel of the diagram has room for the names of its points. The height is at most 4096.
pub fn size(report: &Report, figure: Figure) -> [u32; 2] {
    let panels = panels(report, figure, Measure::Rmse);
    let rows = panels.len().div_ceil(COLUMNS).clamp(1, 12) as u32;
    let key = panels.iter().map(|panel| key_height(&panel.key)).sum::<f64>() as u32;
    [PANEL[0] * COLUMNS as u32, (HEAD as u32 + PANEL[1] * rows + key).clamp(MIN_SIZE[1], MAX_SIZE)]
}

/// Most names of a panel: more cover each other, and are numbered instead.
const MOST: usize = 14;
/// Longest line of the key that several names share, characters.
const KEY_WIDTH: usize = 170;
/// Height of a line of the key below the panels, pixels.
const KEY_LINE: f64 = 16.0;

fn key_height(key: &[String]) -> f64 {
    if key.is_empty() { 0.0 } else { KEY_LINE * (key.len() + 1) as f64 }
}

/// A point of a panel.
struct PlottedPoint {
    name: String,
    /// Low end of the interval, median, high end, ms.
    time: [f64; 3],
    error: f64,
    is_default: bool,
    /// A line joins it with its neighbours: it lies on the dial's axis, or on the front.
    is_joined: bool,
    on_front: bool,
}

/// What is drawn in one frame.
struct Panel {
    title: String,
    notes: Vec<String>,
    time_axis: &'static str,
    colour: usize,
    /// In the order of the line that joins them.
    points: Vec<PlottedPoint>,
    /// Names of the points that are numbered, a line each.
    key: Vec<String>,
}

fn panels(report: &Report, figure: Figure, measure: Measure) -> Vec<Panel> {
    let mut all: Vec<Panel> = (figure == Figure::Errors).then(|| combinations(report, measure)).into_iter().collect();
    all.extend(figure.dials(report).map(|(d, dial)| of_dial(d, dial, measure)));
    all.retain(|panel| !panel.points.is_empty());
    all
}

fn combinations(report: &Report, measure: Measure) -> Panel {
    let front = choose::front(report, measure);
    let points = report.choices.iter().enumerate().filter_map(|(i, choice)| {
        let name = match choice.changed.is_empty() {
            true => "as it is".to_string(),
            false => {
                choice.changed.iter().map(|(dial, label)| format!("{dial} {label}")).collect::<Vec<_>>().join(", ")
            }
        };
        let (error, time) = (measure.of(&choice.errors)?, milliseconds(&choice.times?.total));
        let (is_default, on_front) = (choice.changed.is_empty(), front.contains(&i));
        Some(PlottedPoint { name, time, error, is_default, is_joined: on_front, on_front })
    });
    let mut points: Vec<_> = points.filter(|p| p.time[0] > 0.0).collect();
    points.sort_by(|a, b| a.time[1].total_cmp(&b.time[1]));
    // Names of many changes, or many names, fit into no panel: those of the front and of the scene as it is are numbered from the fastest on.
    const LONGEST: usize = 40;
    let mut key = Vec::new();
    if points.len() > MOST || points.iter().any(|p| p.name.chars().count() > LONGEST) {
        for point in &mut points {
            let name = std::mem::take(&mut point.name);
            if point.on_front || point.is_default {
                point.name = (key.len() + 1).to_string();
                key.push(format!("{}: {name}", point.name));
            }
        }
    }
    Panel {
        key,
        title: "choices: settings of one dial and of several".into(),
        notes: vec!["rings: Pareto front".into()],
        time_axis: "volume and picture (ms)",
        colour: 6,
        points,
    }
}

fn milliseconds(time: &Time) -> [f64; 3] {
    [time.low, time.median, time.high].map(|t| t * 1e-6)
}

/// The points of a dial over the time that it changes more, by their ratio.
fn of_dial(index: usize, dial: &Dial, measure: Measure) -> Panel {
    let mut points: Vec<_> = dial.points.iter().collect();
    points.sort_by(|a, b| a.value.total_cmp(&b.value));
    let spread = |of: fn(&Times) -> f64| {
        let times = dial.points.iter().filter_map(|p| p.times.as_ref()).map(of);
        let (low, high) = times.fold((f64::MAX, 0.0f64), |(l, h), t| (l.min(t), h.max(t)));
        high / low
    };
    let of_picture = spread(|t| t.picture.median) >= spread(|t| t.volume.median);
    let plotted = points.into_iter().filter_map(|point| {
        let (times, error) = (point.times?, measure.of(&point.errors)?);
        let time = milliseconds(if of_picture { &times.picture } else { &times.volume });
        let (name, is_default, is_joined) = (point.label.clone(), point.is_default, dial.is_on_axis(point));
        Some(PlottedPoint { name, time, error, is_default, is_joined, on_front: false }).filter(|p| p.time[0] > 0.0)
    });
    let mut points: Vec<_> = plotted.collect();
    let key = if points.len() > MOST { numbered(&mut points, &dial.name) } else { Vec::new() };
    let other = dial.points.iter().find(|p| p.is_default).and_then(|p| p.times);
    let other = other.map(|t| match of_picture {
        true => format!("volume {} ms", rounded(t.volume.median * 1e-6)),
        false => format!("picture {} ms", rounded(t.picture.median * 1e-6)),
    });
    Panel {
        title: title(dial),
        notes: notes(dial).into_iter().chain(other).collect(),
        time_axis: if of_picture { "picture (ms)" } else { "volume (ms)" },
        colour: index,
        points,
        key,
    }
}

/// Gives points numbers for names. Returns the lines that say which number is which name.
fn numbered(points: &mut [PlottedPoint], dial: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (n, point) in points.iter_mut().enumerate() {
        let name = format!("{}: {}", n + 1, point.name);
        point.name = (n + 1).to_string();
        match lines.last_mut().filter(|line| line.len() + name.len() < KEY_WIDTH) {
            Some(line) => *line += &format!(", {name}"),
            None => lines.push(format!("{dial} {name}")),
        }
    }
    lines
}

/// The report as a diagram.
struct Diagram<'a> {
    report: &'a Report,
    figure: Figure,
    measure: Measure,
}

impl Drawing for Diagram<'_> {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let Diagram { report, figure, measure } = *self;
        let all = panels(report, figure, measure);
        if all.is_empty() {
            return Err(format!("plot: no setting has a time and an {}", measure.name()));
        }
        let [width, height] = canvas.size();
        head(canvas, report, figure, measure, width)?;
        let columns = ((width / f64::from(PANEL[0])).floor() as usize).clamp(1, all.len());
        let rows = all.len().div_ceil(columns);
        let key: Vec<String> = all.iter().flat_map(|panel| panel.key.clone()).collect();
        // A diagram too low for its key loses the key's end, not its panels.
        let foot = height - key_height(&key).min(height / 3.0);
        let [across, down] = [width / columns as f64, (foot - HEAD) / rows as f64];
        for (n, line) in key.iter().enumerate() {
            let top = foot + KEY_LINE * n as f64;
            if top + KEY_LINE > height {
                break;
            }
            canvas.text(&canvas.cut(line, 12, width - 48.0)?, [24.0, top], 12, INK, [0, 0])?;
        }
        for (i, panel) in all.iter().enumerate() {
            let (left, top) = ((i % columns) as f64 * across, HEAD + (i / columns) as f64 * down);
            panel.draw(canvas, [left + 56.0, top + 40.0, left + across - 14.0, top + down - 44.0])?;
        }
        Ok(())
    }
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>, frame: Frame) -> Drawn {
        // A logarithmic axis has no 0: exact agreement is drawn half a decade below all other points.
        let positive = self.points.iter().map(|s| s.error).filter(|e| *e > 0.0).fold(f64::MAX, f64::min);
        let exact = if positive == f64::MAX { 1e-9 } else { positive / 3.0 };
        let error = |p: &PlottedPoint| if p.error == 0.0 { exact } else { p.error };
        let ends: Vec<[f64; 2]> = self.points.iter().flat_map(|p| p.time.map(|t| [t, error(p)])).collect();
        let axes = Axes::about(frame, &ends);
        let [left, top, right, _] = frame;
        canvas.text(&canvas.cut(&self.title, 15, right - left)?, [left, top - 36.0], 15, INK, [0, 0])?;
        canvas.text(&canvas.cut(&self.notes.join("; "), 12, right - left)?, [left, top - 18.0], 12, INK, [0, 0])?;
        axes.draw(canvas, self.time_axis)?;
        if self.points.iter().any(|p| p.error == 0.0) {
            let [_, y] = axes.place([axes.x[0], exact]);
            canvas.line(&[[left, y], [right, y]], INK.mix(0.4))?;
            canvas.text("0 (exact)", [right - 4.0, y + 3.0], 11, INK, [2, 0])?;
        }
        let place = |p: &PlottedPoint| axes.place([p.time[1], error(p)]);
        let mut labels = Labels::default();
        // Combinations have no order of their own: their line is the front.
        let of_front = self.points.iter().any(|p| p.on_front);
        let line: Vec<[f64; 2]> = self.points.iter().filter(|p| p.is_joined).map(place).collect();
        let line = if of_front { staircase(&line) } else { line };
        if line.len() > 1 {
            canvas.line(&line, colour(self.colour).mix(0.5).stroke_width(1))?;
            labels.keep_off_line(&line);
        }
        for p in &self.points {
            let [low, _, high] = p.time.map(|t| axes.place([t, error(p)]));
            canvas.line(&[low, high], colour(self.colour).mix(0.6).stroke_width(2))?;
            labels.keep_off(place(p), 6.0);
            labels.keep_off_line(&[low, high]);
        }
        for p in &self.points {
            let [x, y] = place(p);
            if p.on_front {
                canvas.ring([x, y], 8, INK.stroke_width(1))?;
            }
            if p.is_default {
                canvas.boxed([x - 8.0, y - 8.0, x + 8.0, y + 8.0], INK)?;
            }
            canvas.mark([x, y], self.colour, colour(self.colour))?;
        }
        // The default's label first.
        let mut order: Vec<&PlottedPoint> = self.points.iter().filter(|p| !p.name.is_empty()).collect();
        order.sort_by_key(|p| !p.is_default);
        for p in order {
            let label = canvas.cut(&p.name, 11, 0.7 * (right - left))?;
            let size = canvas.measure(&label, 11)?;
            let at = labels.place(place(p), size, frame);
            // A name far from its mark is joined to it.
            let (from, to) = (place(p), [at[0] + size[0] / 2.0, at[1] + size[1] / 2.0]);
            let nearest = [from[0].clamp(at[0], at[0] + size[0]), from[1].clamp(at[1], at[1] + size[1])];
            if (nearest[0] - from[0]).hypot(nearest[1] - from[1]) > 16.0 {
                canvas.line(&[from, if nearest == from { to } else { nearest }], colour(self.colour).mix(0.5))?;
            }
            canvas.text(&label, at, 11, darker(colour(self.colour)), [0, 0])?;
        }
        Ok(())
    }
}

fn head<B: DrawingBackend>(canvas: &Canvas<B>, report: &Report, figure: Figure, measure: Measure, width: f64) -> Drawn {
    let Sizes { volume: [w, h, d], picture: [pw, ph] } = report.sizes;
    let scene = format!("{}: volume {w}x{h}x{d}, picture {pw}x{ph}", report.scene.lines().next().unwrap_or_default());
    // Order statistics tell an interval from six runs on.
    let bars = if report.repeats < 6 { "range" } else { "95 % interval" };
    let repeats = format!("median and {bars} of {} runs; boxed: the scene as it is", report.repeats);
    let device = format!("{}, {}, {}; {repeats}", report.device, report.driver, report.date);
    let title = match figure {
        Figure::Errors => format!("Error against run time: {} over time on the device", measure.name()),
        Figure::Looks => {
            format!("Looks against run time: difference from the scene as it is, {}, no error", measure.name())
        }
    };
    canvas.text(&title, [24.0, 12.0], 22, INK, [0, 0])?;
    canvas.text(&canvas.cut(&scene, 14, width - 48.0)?, [24.0, 40.0], 14, INK, [0, 0])?;
    canvas.text(&canvas.cut(&device, 14, width - 48.0)?, [24.0, 58.0], 14, INK, [0, 0])
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
        Reference::Exact { estimate, .. } => Some(format!("against exact rays, estimate {estimate:.0e}")),
        Reference::AsItIs => Some("another look: difference, no error".to_string()),
        Reference::Converged { rmse, .. } | Reference::Extrapolated { rmse, .. } => {
            Some(format!("against a picture good to {rmse:.0e}"))
        }
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
            let margin = (high / low).powf(0.08).max(1.1);
            [low / margin, high * margin]
        };
        Axes { frame, x: around(0), y: around(1) }
    }

    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |v: f64, [low, high]: [f64; 2]| (v / low).ln() / (high / low).ln();
        let [left, top, right, bottom] = self.frame;
        [left + share(x, self.x) * (right - left), bottom - share(y, self.y) * (bottom - top)]
    }

    /// Draws the frame, the grid, the ticks with their values, and `across`, the title of the horizontal axis (time). The vertical axis has no title.
    pub fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>, across: &str) -> Drawn {
        let [left, top, right, bottom] = self.frame;
        for (value, named) in ticks(self.x) {
            let [x, _] = self.place([value, self.y[0]]);
            canvas.line(&[[x, top], [x, bottom]], if named { GRID[0] } else { GRID[1] })?;
            if named {
                canvas.text(&number(value), [x, bottom + 5.0], 12, INK, [1, 0])?;
            }
        }
        for (value, named) in ticks(self.y) {
            let [_, y] = self.place([self.x[0], value]);
            canvas.line(&[[left, y], [right, y]], if named { GRID[0] } else { GRID[1] })?;
            if named {
                canvas.text(&number(value), [left - 5.0, y], 12, INK, [2, 1])?;
            }
        }
        canvas.boxed(self.frame, INK)?;
        canvas.text(across, [(left + right) / 2.0, bottom + 22.0], 12, INK, [1, 0])
    }
}

/// Tick values within a range, and whether each has a label: 1 to 9 of every decade, with more labels for fewer decades; equidistant
/// ones in a range of less than a factor of four.
fn ticks([low, high]: [f64; 2]) -> Vec<(f64, bool)> {
    if high < 4.0 * low {
        let rough = (high - low) / 4.0;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
        return (first..=last).map(|i| (i as f64 * step, true)).collect();
    }
    let decades = (high / low).log10();
    let named: &[u32] = if decades < 2.0 { &[1, 2, 5] } else { &[1] };
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let all = (first..=last).flat_map(|d| (1..=9).map(move |m| (f64::from(m) * 10f64.powi(d), m)));
    // Of many decades every second or third one.
    let every = (decades / 5.0).ceil().max(1.0) as i32;
    let named = |v: f64, m: u32| named.contains(&m) && (v.log10().round() as i32 % every == 0 || m > 1);
    all.filter(|(v, _)| *v >= low && *v <= high).map(|(v, m)| (v, named(v, m))).collect()
}

/// A tick label: decimal from 0.001 to 9999, otherwise scientific.
fn number(value: f64) -> String {
    match value {
        v if (0.000_99..9_999.0).contains(&v) => format!("{}", (v * 1e6).round() / 1e6),
        v => {
            let first = v / 10f64.powf(v.log10().floor());
            if (first - first.round()).abs() < 0.02 { format!("{v:.0e}") } else { format!("{v:.1e}") }
        }
    }
}

/// Three digits.
fn rounded(value: f64) -> String {
    let digits = (2 - value.max(1e-9).log10().floor() as i32).clamp(0, 6);
    format!("{value:.*}", digits as usize)
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

    /// Places a label of width `w` and height `h` for the mark at `at`, and returns its top left corner, pixels. The label lies beside the mark, or
    /// else at the nearest free place of the frame. If none is free, it covers others.
    pub fn place(&mut self, at: [f64; 2], [w, h]: [f64; 2], frame: Frame) -> [f64; 2] {
        let around = |gap: f64| {
            let (east, west) = (at[0] + gap, at[0] - gap - w);
            let (above, below, level) = (at[1] - gap - h, at[1] + gap, at[1] - h / 2.0);
            let middle = at[0] - w / 2.0;
            let near = 0.7 * gap;
            let (ne, nw) = ([at[0] + near, at[1] - near - h], [at[0] - near - w, at[1] - near - h]);
            let (se, sw) = ([at[0] + near, at[1] + near], [at[0] - near - w, at[1] + near]);
            [[east, level], ne, [middle, above], [middle, below], se, nw, [west, level], sw]
        };
        let candidates: Vec<[f64; 2]> = [9.0, 12.0, 16.0].into_iter().flat_map(around).collect();
        let boxed = |[x, y]: [f64; 2]| [x - 1.0, y - 1.0, x + w + 1.0, y + h + 1.0];
        let free = |b: Frame| {
            let inside = b[0] >= frame[0] && b[1] >= frame[1] && b[2] <= frame[2] && b[3] <= frame[3];
            inside && !self.taken.iter().any(|t| b[0] < t[2] && t[0] < b[2] && b[1] < t[3] && t[1] < b[3])
        };
        let clear = |b: Frame| !self.lines.iter().any(|p| p[0] > b[0] && p[0] < b[2] && p[1] > b[1] && p[1] < b[3]);
        let [left, top, right, bottom] = frame;
        let rows = (0..).map(|i| top + 2.0 + 4.0 * f64::from(i)).take_while(|y| y + h < bottom);
        let columns = || (0..).map(|i| left + 2.0 + 6.0 * f64::from(i)).take_while(|x| x + w < right);
        let mut anywhere: Vec<[f64; 2]> = rows.flat_map(|y| columns().map(move |x| [x, y])).collect();
        let away = |c: &[f64; 2]| (c[0] + w / 2.0 - at[0]).hypot(c[1] + h / 2.0 - at[1]);
        anywhere.sort_by(|a, b| away(a).total_cmp(&away(b)));
        let all = || candidates.iter().chain(&anywhere);
        let found = candidates.iter().find(|c| free(boxed(**c)) && clear(boxed(**c)));
        let found = found.or_else(|| all().find(|c| free(boxed(**c)) && clear(boxed(**c))));
        let found = found.or_else(|| all().find(|c| free(boxed(**c)))).copied();
        // In a frame that is full it covers another.
        let found = found.unwrap_or([at[0] + 9.0, at[1] - h / 2.0]);
        self.taken.push(boxed(found));
        found
    }
}
