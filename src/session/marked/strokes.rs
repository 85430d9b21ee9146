//! Measurements and body marks on a saved picture: smooth lines with a dark edge, crosses at their points, heads of arrows, and labels.

use super::blend;
use crate::canvas::{self, Canvas, Drawing, Drawn};
use crate::measure::{body_marks as bodies, overlay};
use crate::passes::unveil::StartLine;
use crate::picture::Picture;
use crate::scene::planes::CURVE_COLOUR;
use crate::scene::{Mode, Scene};
use plotters::prelude::{BLACK, DrawingBackend, ShapeStyle, WHITE};

/// Colour of lines (red, green, blue): yellow, which no tissue has.
pub(super) const LINE: [u8; 3] = [255, 214, 64];
/// Colour of lines of measurements that belong to another volume.
const DIMMED: [u8; 3] = [150, 150, 150];
/// Colour of the line at which rendering starts: green, as on scanners.
const START: [u8; 3] = [64, 235, 96];
/// Colour of the body of a body mark.
const BODY: [u8; 3] = [235, 235, 235];
const EDGE: [u8; 3] = [0, 0, 0];
/// Half the width of a line, and of its dark edge, pixels.
const HALF: f64 = 0.8;
const HALF_EDGE: f64 = 2.0;
/// Half the size of a cross, and length of an arrow's head, pixels.
const CROSS: f64 = 5.0;
const HEAD: f64 = 12.0;
/// Height of a label's text, pixels.
const TEXT: u32 = 14;
/// Widest label, pixels.
const WIDEST: f64 = 600.0;

/// Draws the measurements of a scene into its picture. Those that belong to another volume than `volume` are dimmed.
///
/// # Errors
/// One line: the drawing of a label failed.
pub(super) fn draw(picture: &mut Picture, scene: &Scene, volume: Option<u32>) -> Result<(), String> {
    for drawn in overlay::drawn(scene, volume, &scene.settings.drawn.measure) {
        let mut strokes: Vec<[[f64; 2]; 2]> = Vec::new();
        for line in &drawn.lines {
            strokes.extend(line.windows(2).map(|ends| [ends[0], ends[1]]));
        }
        for (_, [x, y]) in &drawn.points {
            strokes.push([[x - CROSS, *y], [x + CROSS, *y]]);
            strokes.push([[*x, y - CROSS], [*x, y + CROSS]]);
        }
        strokes.extend(drawn.head.iter().flat_map(|head| overlay::arrow_head(*head, HEAD)));
        let line = if drawn.is_of_other { DIMMED } else { LINE };
        edged(picture, drawn.tile, &strokes, [HALF_EDGE, HALF], line);
        if !drawn.label.is_empty() {
            let label = label(&drawn.label, WIDEST)?;
            let at = overlay::label_corner(&drawn, [label.width, label.height].map(f64::from));
            blend(picture, &label, at.map(|n| n.round() as i64));
        }
    }
    Ok(())
}

/// Draws the lines of the slices on the reference tile of a tomography, and the distance between them.
///
/// # Errors
/// One line: the drawing of the label failed.
pub(super) fn slices(picture: &mut Picture, scene: &Scene) -> Result<(), String> {
    if !scene.has_reference() {
        return Ok(());
    }
    let tiling = scene.tiling();
    let Some(first) = tiling.tiles.first() else { return Ok(()) };
    let tile = [first.corner, first.size].map(|corner| corner.map(f64::from));
    edged(picture, tile, &tiling.slice_lines(), [1.5, 0.5], LINE);
    label_below(picture, &overlay::spacing_label(&tiling), tile)
}

/// Writes on each slice of a tomography its position.
///
/// # Errors
/// One line: the drawing of a label failed.
pub(super) fn places(picture: &mut Picture, scene: &Scene) -> Result<(), String> {
    if scene.settings.mode != Mode::Tomography {
        return Ok(());
    }
    for tile in scene.marks().iter().skip(usize::from(scene.has_reference())) {
        let Some(text) = tile.place_label() else { continue };
        let label = label(&text, f64::INFINITY)?;
        if f64::from(label.width) < tile.size[0] {
            blend(picture, &label, [tile.corner[0].round() as i64 + 2, tile.corner[1].round() as i64 + 2]);
        }
    }
    Ok(())
}

/// Draws the line of a curved plane on the plane that it lies on, with its direction, and the line's length on the curved plane's tile.
///
/// # Errors
/// One line: the drawing of the label failed.
pub(super) fn curve(picture: &mut Picture, scene: &Scene) -> Result<(), String> {
    let tiling = scene.tiling();
    let (Some(on), Some(_)) = (scene.curve_line(&tiling), scene.curve()) else { return Ok(()) };
    let tile = &tiling.tiles[on.tile];
    let tile = [tile.corner, tile.size].map(|corner| corner.map(f64::from));
    let mut strokes: Vec<[[f64; 2]; 2]> = on.line.windows(2).map(|ends| [ends[0], ends[1]]).collect();
    strokes.extend(on.head().into_iter().flat_map(|head| overlay::arrow_head(head, HEAD)));
    let colour = CURVE_COLOUR.map(|c| (c * 255.0).round() as u8);
    edged(picture, tile, &strokes, [HALF_EDGE, HALF], colour);
    let marks = scene.marks();
    let section = marks.iter().find_map(|tile| Some((tile, tile.along_label()?)));
    section.map_or(Ok(()), |(tile, text)| label_below(picture, &text, [tile.corner, tile.size]))
}

/// Draws the body marks: the outline of the body as a thin line, the probe as a bar with a dot at its marked end.
pub(super) fn body_marks(picture: &mut Picture, scene: &Scene) {
    let size = [picture.width, picture.height].map(f64::from);
    for mark in bodies::drawn(&scene.settings.drawn.body_marks, size) {
        // Thinner where the mark is small: its lines must not run into each other.
        let half = (mark.edge / 130.0).clamp(0.5, 1.5);
        let lines = mark.outline.iter().flat_map(|line| line.windows(2).map(|ends| [ends[0], ends[1]]));
        let outline: Vec<[[f64; 2]; 2]> = lines.collect();
        let [marker, _] = mark.probe;
        let whole = [[0.0; 2], size];
        for (strokes, half, colour) in [
            (&outline[..], half + 1.0, EDGE),
            (&outline[..], half, BODY),
            (&[mark.probe][..], 2.0 * half + 1.0, EDGE),
            (&[[marker; 2]][..], mark.dot + 1.0, EDGE),
            (&[mark.probe][..], 2.0 * half, LINE),
            (&[[marker; 2]][..], mark.dot, LINE),
        ] {
            strokes.iter().for_each(|ends| stroke(picture, whole, *ends, half, colour));
        }
    }
}

/// Draws on the planes the lines at which rendering starts.
pub(super) fn start(picture: &mut Picture, lines: &[StartLine]) {
    for (half, colour) in [(HALF_EDGE, EDGE), (HALF, START)] {
        for line in lines {
            line.pieces.iter().for_each(|ends| stroke(picture, line.tile, *ends, half, colour));
        }
    }
}

/// Draws lines with a dark edge. `halves`: half the width of the edge and of the line, pixels.
fn edged(picture: &mut Picture, tile: [[f64; 2]; 2], lines: &[[[f64; 2]; 2]], halves: [f64; 2], colour: [u8; 3]) {
    for (half, colour) in halves.into_iter().zip([EDGE, colour]) {
        lines.iter().for_each(|ends| stroke(picture, tile, *ends, half, colour));
    }
}

/// Draws a line with smooth borders, within a tile.
fn stroke(picture: &mut Picture, tile: [[f64; 2]; 2], ends: [[f64; 2]; 2], half: f64, colour: [u8; 3]) {
    let size = [f64::from(picture.width), f64::from(picture.height)];
    // The pixels that it may touch: a part of the picture, wherever its ends are.
    let range = |a: usize| {
        let most = (tile[0][a] + tile[1][a]).min(size[a]);
        let clamp = |v: f64| v.clamp(tile[0][a].max(0.0), most.max(0.0));
        let low = ends[0][a].min(ends[1][a]) - half - 1.0;
        let high = ends[0][a].max(ends[1][a]) + half + 1.0;
        clamp(low.floor()) as u32..clamp(high.ceil()) as u32
    };
    let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    for (y, x) in range(1).flat_map(|y| range(0).map(move |x| (y, x))) {
        let from = [f64::from(x) + 0.5 - ends[0][0], f64::from(y) + 0.5 - ends[0][1]];
        let share =
            if squared > 0.0 { ((from[0] * along[0] + from[1] * along[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
        let off = (from[0] - along[0] * share).hypot(from[1] - along[1] * share);
        let cover = (half + 0.5 - off).clamp(0.0, 1.0);
        if cover > 0.0 {
            let first = 4 * (y as usize * picture.width as usize + x as usize);
            for (channel, new) in picture.rgba[first..first + 3].iter_mut().zip(colour) {
                *channel = (f64::from(*channel) * (1.0 - cover) + f64::from(new) * cover).round() as u8;
            }
        }
    }
}

/// Writes a label at the lower left corner of a tile: its corner and size, pixels.
fn label_below(picture: &mut Picture, text: &str, [corner, size]: [[f64; 2]; 2]) -> Result<(), String> {
    let bottom = corner[1] + size[1] - f64::from(TEXT + 8);
    blend(picture, &label(text, size[0])?, [corner[0].round() as i64 + 2, bottom.round() as i64]);
    Ok(())
}

/// A label as a picture; a text wider than `most` pixels is cut.
fn label(text: &str, most: f64) -> Result<Picture, String> {
    let width = canvas::text_width(text, TEXT)?.min(most).ceil() as u32 + 6;
    canvas::picture([width, TEXT + 6], &Label(text))
}

/// A label, white on black.
struct Label<'a>(&'a str);

impl Drawing for Label<'_> {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let [width, height] = canvas.size();
        canvas.boxed([0.0, 0.0, width, height], ShapeStyle::from(&BLACK).filled())?;
        let text = canvas.cut(self.0, TEXT, width - 4.0)?;
        canvas.text(&text, [3.0, height / 2.0], TEXT, WHITE, [0, 1])
    }
}
