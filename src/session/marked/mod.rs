//! Pictures with marks: the sides of the patient on every tile, and a bar below with scale, depth, mode, time and origin. The rendered
//! pixels between the marks stay as they are.

mod strokes;

use crate::canvas::{self, Canvas, Drawing, Drawn};
use crate::passes::unveil::{self, Unveiled};
use crate::picture::Picture;
use crate::scene::Scene;
use crate::scene::marks::TileMarks;
use crate::source::DEMO_DATA;
use plotters::prelude::{BLACK, DrawingBackend, RGBColor, ShapeStyle, WHITE};
use std::borrow::Cow;
use std::time::{SystemTime, UNIX_EPOCH};

const BACKGROUND: RGBColor = RGBColor(18, 21, 26);
const TEXT: RGBColor = RGBColor(214, 221, 229);
/// Height of a letter's square, as a share of the picture's shorter edge, and its limits, pixels.
const LETTER_SHARE: f64 = 0.05;
const LETTER: [f64; 2] = [14.0, 48.0];
/// Mean width of a character as a share of the text's height.
const CHARACTER: f64 = 0.55;

/// Date and time as the bar of a picture shows them: `2026-11-23 20:00:00 UTC`.
pub fn time_line(now: SystemTime) -> String {
    // A clock before 1970 is not set.
    let now = humantime::format_rfc3339_seconds(now.max(UNIX_EPOCH)).to_string();
    now.replace('T', " ").replace('Z', " UTC")
}

/// When a picture of the phantom that has no bar below it (`marks.bar`) states that it is not of a patient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demo {
    /// Only if something else is drawn over it, too. Otherwise it keeps exactly the rendered pixels.
    WithOthers,
    /// In every case.
    Always,
}

/// The picture as it is saved. If `marks.bar` of the scene's settings is true, it has the marks and the bar below it that [`marked`] adds; otherwise
/// the measurements and lines that [`measured`] draws. It is unchanged if there is nothing to draw.
///
/// `volume`: number of the volume that the picture shows; measurements of other volumes are dimmed. None: not known, no measurement is dimmed.
/// `start`: the surface at which rendering starts (setting `unveil`), if one was found. `demo`: None if the volume may be of a patient.
///
/// # Errors
/// One line: the drawing failed, or a bar is to be added and the picture is not of this scene's size.
pub fn as_set<'a>(
    picture: &'a Picture,
    scene: &Scene,
    volume: Option<u32>,
    start: Option<&Unveiled>,
    demo: Option<Demo>,
) -> Result<Cow<'a, Picture>, String> {
    let has_lines = scene.has_reference() || scene.has_curve() || start.is_some();
    let is_annotated = !scene.settings.drawn.measure.is_empty() || !scene.settings.drawn.body_marks.is_empty();
    let is_drawn_on = is_annotated || has_lines || demo == Some(Demo::Always);
    let origin = demo.map(|_| DEMO_DATA);
    match scene.settings.drawn.marks.bar {
        false if !is_drawn_on => Ok(Cow::Borrowed(picture)),
        false => measured(picture, scene, volume, start, origin).map(Cow::Owned),
        true => marked(picture, scene, volume, start, &time_line(SystemTime::now()), origin).map(Cow::Owned),
    }
}

/// The picture with its measurements, annotations, body marks and lines as [`measured`] draws them, with the patient's sides and the probe's marker
/// on its tiles, and with a bar of text below it, by which it is higher. `volume`: number of the volume that it shows; measurements of other volumes
/// are dimmed. None: not known, none is dimmed. `start`: the surface at which rendering starts (setting `unveil`), if one was found. `time`: time of
/// the picture, for the bar. `origin`: what the picture shows, such as "Demo data (phantom)"; None for patients.
///
/// # Errors
/// One line: the picture is not of this scene's size, or the drawing failed.
pub fn marked(
    picture: &Picture,
    scene: &Scene,
    volume: Option<u32>,
    start: Option<&Unveiled>,
    time: &str,
    origin: Option<&str>,
) -> Result<Picture, String> {
    if [picture.width, picture.height] != scene.picture_size() {
        let [width, height] = scene.picture_size();
        return Err(format!(
            "a picture of {} x {} does not fit a scene of {width} x {height}",
            picture.width, picture.height
        ));
    }
    let marks = scene.marks();
    let mut marked = measured(picture, scene, volume, start, None)?;
    let square = LETTER_SHARE * f64::from(picture.width.min(picture.height));
    let square = square.clamp(LETTER[0], LETTER[1]).round() as u32;
    for tile in &marks {
        mark_tile(&mut marked, tile, square)?;
    }
    let bar = Bar::new(scene, &marks, picture.width, time, origin);
    let drawn = canvas::picture([picture.width, bar.height()], &bar)?;
    marked.height += drawn.height;
    marked.rgba.extend(drawn.rgba);
    Ok(marked)
}

/// The picture with its measurements, annotations and body marks, the lines and positions of the slices of a tomography, the line of a curved plane,
/// and the line at which rendering starts. On a picture of another size than the scene's only `origin` is written.
///
/// `volume`: number of the volume that the picture shows; measurements of other volumes are dimmed. None: not known, none is dimmed. `start`: the
/// surface at which rendering starts (setting `unveil`), if one was found. `origin`: what the picture shows, in small letters in the lower left
/// corner; None for nothing.
///
/// # Errors
/// One line: the drawing failed.
pub fn measured(
    picture: &Picture,
    scene: &Scene,
    volume: Option<u32>,
    start: Option<&Unveiled>,
    origin: Option<&str>,
) -> Result<Picture, String> {
    let mut measured = picture.clone();
    if [picture.width, picture.height] == scene.picture_size() {
        strokes::slices(&mut measured, scene)?;
        strokes::places(&mut measured, scene)?;
        strokes::curve(&mut measured, scene)?;
        strokes::start(&mut measured, &unveil::lines(scene, start));
        strokes::draw(&mut measured, scene, volume)?;
        strokes::body_marks(&mut measured, scene);
    }
    origin.map_or(Ok(()), |origin| label(&mut measured, origin))?;
    Ok(measured)
}

/// Writes what the picture is of into its lower left corner; in a narrow one without what stands in brackets.
pub(crate) fn label(picture: &mut Picture, origin: &str) -> Result<(), String> {
    let text = text_height(picture.width);
    let width = |words: &str| ((words.chars().count() as f64 * CHARACTER + 1.0) * f64::from(text)).ceil() as u32;
    let words = if width(origin) <= picture.width { origin } else { origin.split(" (").next().unwrap_or(origin) };
    let size = [width(words).min(picture.width), (f64::from(text) * 1.5).ceil() as u32];
    let glyph = canvas::picture(size, &Glyph::Words(words, text))?;
    let below = i64::from(picture.height) - i64::from(glyph.height);
    blend(picture, &glyph, [0, below]);
    Ok(())
}

/// Height of the text of a bar or a label, pixels.
pub(crate) fn text_height(width: u32) -> u32 {
    (width / 70).clamp(11, 26)
}

/// Draws the letters and the dot of a tile, where it has room for them.
fn mark_tile(picture: &mut Picture, tile: &TileMarks, square: u32) -> Result<(), String> {
    let edge = f64::from(square);
    if tile.size.iter().any(|n| *n < 4.0 * edge) {
        return Ok(());
    }
    let at = |offset: [f64; 2]| -> [i64; 2] {
        std::array::from_fn(|a| {
            let middle = tile.corner[a] + tile.size[a] / 2.0 - edge / 2.0;
            (middle + offset[a] * (tile.size[a] / 2.0 - edge * 0.75)).round() as i64
        })
    };
    for (side, letter) in &tile.letters {
        let glyph = canvas::picture([square; 2], &Glyph::Letter(letter))?;
        blend(picture, &glyph, at(side.offset()));
    }
    if let Some(side) = tile.probe {
        // In the corner of the marker's side, where no letter is.
        let [x, y] = side.offset();
        let glyph = canvas::picture([square; 2], &Glyph::Dot)?;
        blend(picture, &glyph, at([if x == 0.0 { -1.0 } else { x }, if y == 0.0 { -1.0 } else { y }]));
    }
    if let Some((plane, _)) = tile.plane {
        let glyph = canvas::picture([square; 2], &Glyph::Plane(plane))?;
        blend(picture, &glyph, at(tile.plane_corner()));
    }
    Ok(())
}

/// Lays white on black over the picture: white covers it, black dims it to a quarter, on which white is readable whatever the picture shows.
fn blend(picture: &mut Picture, glyph: &Picture, at: [i64; 2]) {
    for (n, pixel) in glyph.rgba.chunks_exact(4).enumerate() {
        let (x, y) = (at[0] + n as i64 % i64::from(glyph.width), at[1] + n as i64 / i64::from(glyph.width));
        if x < 0 || y < 0 || x >= i64::from(picture.width) || y >= i64::from(picture.height) {
            continue;
        }
        let first = 4 * (y as usize * picture.width as usize + x as usize);
        let cover = u32::from(pixel[0]);
        for channel in &mut picture.rgba[first..first + 3] {
            *channel = ((u32::from(*channel) / 4 * (255 - cover) + 235 * cover) / 255) as u8;
        }
    }
}

/// A mark on a tile, white on black.
enum Glyph<'a> {
    Letter(&'a str),
    /// The probe's marker.
    Dot,
    /// The letter of a plane, in a frame: it is no side of the patient.
    Plane(&'a str),
    /// A text and its height, pixels.
    Words(&'a str, u32),
}

impl Drawing for Glyph<'_> {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let [width, height] = canvas.size();
        canvas.boxed([0.0, 0.0, width, height], ShapeStyle::from(&BLACK).filled())?;
        match self {
            Glyph::Letter(letter) => {
                canvas.text(letter, [width / 2.0, height / 2.0], (height * 0.85) as u32, WHITE, [1, 1])
            }
            Glyph::Plane(letter) => {
                canvas.boxed([1.0, 1.0, width - 2.0, height - 2.0], ShapeStyle::from(&WHITE).stroke_width(1))?;
                canvas.text(letter, [width / 2.0, height / 2.0], (height * 0.7) as u32, WHITE, [1, 1])
            }
            Glyph::Words(words, text) => {
                canvas.text(words, [f64::from(*text) * 0.5, height / 2.0], *text, WHITE, [0, 1])
            }
            Glyph::Dot => {
                canvas.ring([width / 2.0, height / 2.0], (height * 0.3) as i32, ShapeStyle::from(&WHITE).filled())
            }
        }
    }
}

/// The bar below a picture.
struct Bar {
    /// The scale: its length, mm and pixels, and what of the picture it is of.
    scale: Option<(f64, f64, &'static str)>,
    lines: Vec<String>,
    /// Height of the text, pixels.
    text: u32,
}

impl Bar {
    fn new(scene: &Scene, marks: &[TileMarks], width: u32, time: &str, origin: Option<&str>) -> Bar {
        let text = text_height(width);
        let scaled = marks.iter().rev().find(|tile| tile.is_rendering).or(marks.first());
        let has_several = marks.iter().any(|tile| tile.is_rendering) && marks.len() > 1;
        let of = if has_several { " (rendering)" } else { "" };
        let scale = scaled.and_then(|tile| tile.bar(0.3)).map(|(mm, pixels)| (mm, pixels, of));
        let face = scene.probe().map_or(0.0, |probe| probe.array_radius());
        // Planes beside a rendering show all depths.
        let shown = if has_several { "rendered" } else { "depth" };
        let mut items = vec![
            scene.settings.mode.title().to_string(),
            format!("{shown} {:.0} to {:.0} mm", (scene.low.y - face).max(0.0), scene.high.y - face),
        ];
        items.extend(origin.map(str::to_string));
        items.extend([time.to_string(), "Echolume".into(), "not a medical device".into()]);
        Bar { scale, lines: wrapped(&items, width, text), text }
    }

    fn line_height(&self) -> f64 {
        f64::from(self.text) * 1.4
    }

    /// Height of the bar, pixels.
    fn height(&self) -> u32 {
        let rows = self.lines.len() + usize::from(self.scale.is_some());
        (self.line_height() * rows as f64 + f64::from(self.text)).ceil() as u32
    }
}

/// The items in lines that fit the width, pixels.
fn wrapped(items: &[String], width: u32, text: u32) -> Vec<String> {
    let most = ((f64::from(width) - f64::from(text)) / (CHARACTER * f64::from(text))).max(1.0) as usize;
    let mut lines: Vec<String> = Vec::new();
    for item in items {
        match lines.last_mut() {
            Some(line) if line.chars().count() + item.chars().count() + 5 <= most => {
                line.push_str("  ·  ");
                line.push_str(item);
            }
            _ => lines.push(item.clone()),
        }
    }
    lines
}

impl Drawing for Bar {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let [width, height] = canvas.size();
        canvas.boxed([0.0, 0.0, width, height], ShapeStyle::from(&BACKGROUND).filled())?;
        let margin = f64::from(self.text) * 0.5;
        let mut y = margin + self.line_height() / 2.0;
        if let Some((mm, pixels, of)) = self.scale {
            let half = f64::from(self.text) * 0.35;
            for line in [
                [[margin, y], [margin + pixels, y]],
                [[margin, y - half], [margin, y + half]],
                [[margin + pixels, y - half], [margin + pixels, y + half]],
            ] {
                canvas.line(&line, ShapeStyle::from(&TEXT).stroke_width(2))?;
            }
            canvas.text(&format!("{mm} mm{of}"), [2.0 * margin + pixels, y], self.text, TEXT, [0, 1])?;
            y += self.line_height();
        }
        for line in &self.lines {
            let line = canvas.cut(line, self.text, width - 2.0 * margin)?;
            canvas.text(&line, [margin, y], self.text, TEXT, [0, 1])?;
            y += self.line_height();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_block::block;

    fn scene(lines: &[&str]) -> Scene {
        block(&[&["picture.size=[120,96]"], lines].concat(), [40, 30, 20])
    }

    fn grey([width, height]: [u32; 2]) -> Picture {
        Picture { width, height, rgba: [100, 100, 100, 255].repeat((width * height) as usize) }
    }

    /// The pixels that differ from grey in a square around a place, as shares of the picture.
    fn is_marked(picture: &Picture, [x, y]: [f64; 2]) -> bool {
        let (cx, cy) = ((x * 120.0) as u32, (y * 96.0) as u32);
        let near = |c: u32, most: u32| c.saturating_sub(7)..(c + 7).min(most);
        near(cy, 96).any(|y| near(cx, 120).any(|x| picture.rgba[4 * (y * 120 + x) as usize] != 100))
    }

    #[test]
    fn the_bar_is_below_and_letters_and_dot_stand_at_their_edges() {
        let scene = scene(&["mode='plane'", "marks.lateral='right-left'"]);
        let drawn =
            marked(&grey([120, 96]), &scene, None, None, "2026-11-23 20:00:00 UTC", Some("Demo data")).expect("marked");
        assert!(drawn.width == 120 && drawn.height > 96 && drawn.rgba.len() == (4 * 120 * drawn.height) as usize);
        for (at, is) in
            [([0.1, 0.5], true), ([0.9, 0.5], true), ([0.1, 0.1], true), ([0.5, 0.5], false), ([0.9, 0.1], false)]
        {
            assert_eq!(is_marked(&drawn, at), is, "{at:?}");
        }
        let bar = &drawn.rgba[4 * 120 * 96..];
        let bright = bar.chunks_exact(4).filter(|p| p[0] > 180).count();
        assert!(bright > 100, "{bright} pixels of text and scale");
        let later =
            marked(&grey([120, 96]), &scene, None, None, "2026-11-23 20:00:01 UTC", Some("Demo data")).expect("marked");
        assert_ne!(later, drawn, "the time is written");
    }

    #[test]
    fn the_bar_says_what_the_picture_shows_and_that_this_is_no_medical_device() {
        for (mode, title) in [("volume", "Volume"), ("plane", "Plane"), ("mean", "X-ray")] {
            let scene = scene(&[&format!("mode='{mode}'"), "region.depth=[4,17]"]);
            let bar = Bar::new(&scene, &scene.marks(), 900, "2026-11-23 20:00:00 UTC", Some("Demo data"));
            let expected =
                ["depth 4 to 17 mm", "Demo data", "2026-11-23 20:00:00 UTC", "Echolume", "not a medical device"];
            assert_eq!(bar.lines.join("  ·  "), [&[title][..], &expected].concat().join("  ·  "));
            let (mm, pixels, _) = bar.scale.expect("a scale");
            assert!((mm / pixels - scene.marks()[0].pixel).abs() < 1e-9, "{mm} mm are {pixels} pixels");
        }
    }

    #[test]
    fn measurements_are_drawn_where_they_lie_and_without_a_bar_too() {
        let caliper = "measure=[{ kind = 'distance', points = [[-5, 14.5, 0], [5, 14.5, 0]] }]";
        let scene = scene(&["mode='plane'", caliper]);
        let drawn = measured(&grey([120, 96]), &scene, None, None, None).expect("drawn");
        assert_eq!((drawn.width, drawn.height), (120, 96));
        // The middle of the line is in the middle of the plane.
        let middle = 4 * (48 * 120 + 60) as usize;
        let pixel = |at: usize| [drawn.rgba[at], drawn.rgba[at + 1], drawn.rgba[at + 2]];
        assert!(pixel(middle)[0] > 200 && pixel(middle)[2] < 120, "{:?}", pixel(middle));
        assert_eq!(pixel(0), [100; 3], "nothing elsewhere");
        let bright = drawn.rgba.chunks_exact(4).filter(|p| p[2] > 200).count();
        assert!(bright > 20, "{bright} pixels of the label");
    }

    #[test]
    fn texts_and_arrows_are_drawn_into_saved_pictures() {
        let plain = scene(&["mode='plane'"]);
        for (kind, points, at) in [
            ("text", "[[0,15,0]]", [0.55, 0.47]),
            // Its tip is in the middle of the plane.
            ("arrow", "[[0,15,0],[8,20,0]]", [0.5, 0.5]),
        ] {
            let measure = format!("measure=[{{ kind = '{kind}', points = {points}, text = 'lip' }}]");
            let grey = grey([120, 96]);
            let drawn = as_set(&grey, &scene(&["mode='plane'", &measure]), None, None, None).expect("drawn");
            assert!(is_marked(&drawn, at) && !is_marked(&drawn, [0.1, 0.1]), "{kind}");
            assert_ne!(*as_set(&grey, &plain, None, None, None).expect("drawn"), *drawn, "{kind}");
        }
    }

    #[test]
    fn a_body_mark_is_drawn_in_its_square_and_nowhere_else_in_every_mode() {
        for mode in ["surface", "volume", "plane", "orthogonal", "cube"] {
            let mark = "body_marks=[{ body = 'neck', at = [0.75, 0.25], size = 0.4, probe = [0.5, 0.5], angle = 90 }]";
            let scene = scene(&[&format!("mode='{mode}'"), mark]);
            let grey = grey([120, 96]);
            let drawn = as_set(&grey, &scene, None, None, None).expect("drawn");
            assert_eq!((drawn.width, drawn.height), (120, 96));
            // Edge 38 pixels around (90, 24), and the reach of the probe's dot.
            let at = |n: usize| [(n % 120) as f64 + 0.5, (n / 120) as f64 + 0.5];
            let changed: Vec<[f64; 2]> = drawn
                .rgba
                .chunks_exact(4)
                .enumerate()
                .filter(|(_, pixel)| pixel[..3] != [100; 3])
                .map(|(n, _)| at(n))
                .collect();
            assert!(changed.len() > 200, "{mode}: {}", changed.len());
            assert!(changed.iter().all(|[x, y]| (x - 90.0).abs() < 21.0 && (y - 24.0).abs() < 21.0), "{mode}");
            // The marker of the probe is right of its middle.
            let dot = 4 * (33 * 120 + 104) as usize;
            assert_eq!(drawn.rgba[dot..dot + 3], strokes::LINE, "{mode}");
        }
    }

    /// Prevents pictures of the phantom that pass for a patient's, and rendered pixels that are no longer those of the device.
    #[test]
    fn pictures_of_demo_data_say_so_unless_they_are_rendered_pixels_alone() {
        let caliper = "measure=[{ kind = 'distance', points = [[-5, 14.5, 0], [5, 14.5, 0]] }]";
        let bare = grey([120, 96]);
        let shown = |lines: &[&str], demo| as_set(&bare, &scene(lines), None, None, demo).expect("drawn").into_owned();
        let corner = |picture: &Picture| -> usize {
            let is_in = |n: usize| n % 120 < 70 && (n / 120) >= 80 && n / 120 < 96;
            let pixels = picture.rgba.chunks_exact(4).enumerate().filter(|(n, _)| is_in(*n));
            pixels.filter(|(_, pixel)| pixel[0] > 120).count()
        };
        assert_eq!(shown(&["mode='plane'"], Some(Demo::WithOthers)), bare);
        assert_eq!(shown(&["mode='plane'"], None), bare);
        for (lines, demo, is_labelled) in [
            (&["mode='plane'"][..], Some(Demo::Always), true),
            (&["mode='plane'", caliper], Some(Demo::WithOthers), true),
            (&["mode='plane'", caliper], None, false),
        ] {
            let drawn = shown(lines, demo);
            assert_eq!((drawn.width, drawn.height), (120, 96));
            assert_eq!(corner(&drawn) > 30, is_labelled, "{lines:?} {demo:?}: {}", corner(&drawn));
        }
        let bar = |demo| shown(&["mode='plane'", "marks.bar=true"], demo);
        let [with, without] = [bar(Some(Demo::WithOthers)), bar(None)];
        assert!(with.height > without.height || with.rgba != without.rgba, "the bar says it");
        assert_eq!((corner(&with), corner(&bar(Some(Demo::Always)))), (0, 0), "and only the bar");
        // The smallest picture has room for the short words.
        let mut small = grey([64, 64]);
        label(&mut small, DEMO_DATA).expect("drawn");
        assert!(small.rgba.chunks_exact(4).filter(|pixel| pixel[0] > 120).count() > 30);
    }

    /// Prevents letters that a bright picture hides: contrast of 4.5 (WCAG 2.2, AA) with what is behind them.
    #[test]
    fn letters_are_readable_on_white() {
        let linear = |c: u8| ((f64::from(c) / 255.0 + 0.055) / 1.055).powf(2.4);
        let mut white = grey([8, 8]);
        white.rgba.fill(255);
        let glyph = Picture { width: 2, height: 1, rgba: vec![255, 255, 255, 255, 0, 0, 0, 255] };
        blend(&mut white, &glyph, [0, 0]);
        let [letter, behind] = [white.rgba[0], white.rgba[4]].map(|c| linear(c) + 0.05);
        assert!(letter / behind > 4.5, "{letter} on {behind}");
    }

    #[test]
    fn a_picture_of_another_size_is_refused() {
        let fault = marked(&grey([64, 64]), &scene(&[]), None, None, "", None).expect_err("refused");
        assert!(fault.contains("64 x 64"), "{fault}");
    }

    #[test]
    fn items_are_wrapped_and_none_is_lost() {
        let items: Vec<String> = ["Volume", "depth 0 to 30 mm", "Echolume"].map(String::from).to_vec();
        assert_eq!(wrapped(&items, 1000, 14), ["Volume  ·  depth 0 to 30 mm  ·  Echolume"]);
        assert_eq!(wrapped(&items, 64, 11), items);
    }
}
