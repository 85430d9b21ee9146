//! The work-precision diagram: error over time on the device, both logarithmic, one line a dial.

use super::canvas::{Axes, Canvas, Drawn, INK, Labels, Medium};
use super::{Dial, Measure, Reference, Report, Sizes, pareto_front};
use crate::picture::Picture;
use plotters::coord::Shift;
use plotters::prelude::*;

/// Okabe and Ito's colours, told apart with any colour vision, without the yellow that is lost on white.
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
/// Least width and height, pixels.
const SMALLEST: [u32; 2] = [640, 400];
const LARGEST: u32 = 4096;
/// SVG has letters where they belong; plotters' own rendering has them too high.
const LINES: Medium = Medium { scale: 1, raised: 0.0 };
const PIXELS: Medium = Medium { scale: 3, raised: 0.12 };

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

/// The same in pixels.
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

/// Means of squares of pixels, opaque.
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
    let [w, h] = SMALLEST;
    if width < w || height < h || width > LARGEST || height > LARGEST {
        return Err(format!("plot: size is {width}x{height}, must lie in {w}x{h}..={LARGEST}x{LARGEST}"));
    }
    Ok(())
}

/// A point that can be shown: where, and of what.
struct Shown {
    dial: usize,
    point: usize,
    /// ms: least, median, largest.
    time: [f64; 3],
    error: f64,
}

fn shown(report: &Report, measure: Measure) -> Vec<Shown> {
    let mut all = Vec::new();
    for (d, dial) in report.dials.iter().enumerate() {
        for (p, point) in dial.points.iter().enumerate() {
            if let (Some(time), Some(error)) = (point.time.filter(|t| t.low > 0.0), measure.of(&point.errors)) {
                let time = [time.low, time.median, time.high].map(|t| t * 1e-6);
                all.push(Shown { dial: d, point: p, time, error });
            }
        }
    }
    all
}

fn draw<B: DrawingBackend>(area: &DrawingArea<B, Shift>, medium: Medium, report: &Report, measure: Measure) -> Drawn {
    let mut all = shown(report, measure);
    if all.is_empty() {
        return Err(format!("plot: no setting has a time and an {}", measure.name()));
    }
    // A logarithmic axis has no 0: what agrees exactly lies on the axis, half a decade below all else.
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

    let fronts = pareto_front::of_report(report, measure);
    let place = |s: &Shown| axes.place([s.time[1], s.error]);
    let on_front = |s: &Shown| fronts.contains(&(s.dial, s.point));
    let mut labels = Labels::default();
    let steps = staircase(
        &fronts.iter().filter_map(|at| all.iter().find(|s| (s.dial, s.point) == *at)).map(place).collect::<Vec<_>>(),
    );
    canvas.line(&steps, FRONT.stroke_width(6))?;
    labels.keep_off_line(&steps);
    for (d, dial) in report.dials.iter().enumerate() {
        let mut of_dial: Vec<&Shown> = all.iter().filter(|s| s.dial == d).collect();
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

    // What matters most finds room first.
    let rank = |s: &Shown| (!on_front(s), !report.dials[s.dial].points[s.point].is_default);
    let mut order: Vec<&Shown> = all.iter().collect();
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

/// A row for every dial: its unit, its order, and what it is compared with unless that is the reference in f64.
fn legend<B: DrawingBackend>(canvas: &Canvas<B>, report: &Report, left: f64, unnamed: usize) -> Drawn {
    let mut y = 106.0;
    let room = LEGEND - 30.0;
    for (d, dial) in report.dials.iter().enumerate() {
        canvas.mark([left + 6.0, y], d, colour(d))?;
        canvas.text(&canvas.cut(&title(dial), 15, room)?, [left + 20.0, y], 15, INK, [0, 1])?;
        y += 18.0;
        for line in notes(dial) {
            canvas.text(&canvas.cut(&line, 12, room)?, [left + 20.0, y], 12, INK, [0, 1])?;
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
        Reference::Converged { rmse, .. } => Some(format!("against a picture good to {rmse:.0e}")),
    };
    order.into_iter().chain(against).collect()
}

/// What has been reached at each time: level until the next better point.
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

/// Of a pale colour, small letters are hard to read.
fn darker(RGBColor(r, g, b): RGBColor) -> RGBColor {
    let [r, g, b] = [r, g, b].map(|c| (f64::from(c) * 0.7) as u8);
    RGBColor(r, g, b)
}
