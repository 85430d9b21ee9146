//! Pictures of several volumes beside each other: tiles with names, the difference of two with its scale, and a wipe.

use crate::canvas::{self, Canvas, Drawing, Drawn};
use crate::marked;
use crate::picture::Picture;
use crate::source::DEMO_DATA;
use plotters::prelude::{DrawingBackend, RGBColor, ShapeStyle};

/// Width of the gap between neighbouring tiles, pixels.
pub const GAP: u32 = 2;
const BETWEEN: [u8; 3] = [58, 64, 74];
/// Colours of the difference: no difference, and the first or the second picture brighter by the whole scale. Blue and orange differ for every
/// kind of colour vision.
const EQUAL: [f64; 3] = [18.0, 21.0, 26.0];
const FIRST: [f64; 3] = [255.0, 178.0, 84.0];
const SECOND: [f64; 3] = [94.0, 176.0, 255.0];
const INK: RGBColor = RGBColor(214, 221, 229);
/// Smallest end of the scale, levels of 255. Larger ones double it.
const LEAST_END: u16 = 16;
/// Share of the pixels that may lie beyond the scale's end.
const BEYOND: f64 = 0.01;
/// Maximum number of tiles in a picture of compared volumes; a tile of their difference counts.
pub const MAX_TILES: usize = 4;

/// Name of the tile that shows the difference of two pictures.
pub const DIFFERENCE: &str = "A \u{2212} B";

/// The name of a tile: its letter, the name of the volume and, if the volume is the phantom's, [`DEMO_DATA`].
pub fn tile_name(letter: char, volume: impl std::fmt::Display, is_synthetic: bool) -> String {
    match is_synthetic {
        true => format!("{letter}  {volume} \u{b7} {DEMO_DATA}"),
        false => format!("{letter}  {volume}"),
    }
}

/// Columns and rows of the tiles in a picture of this size: up to three tiles are in one row, or in one column if the picture is higher than wide;
/// four are in two rows of two.
pub fn grid(tiles: usize, [width, height]: [u32; 2]) -> [u32; 2] {
    match tiles {
        0..=1 => [1, 1],
        2 | 3 if width >= height => [tiles as u32, 1],
        2 | 3 => [1, tiles as u32],
        _ => [2, 2],
    }
}

/// The size of each of so many tiles in a picture of this size, pixels; at least 1 x 1.
pub fn tile_size(tiles: usize, size: [u32; 2]) -> [u32; 2] {
    let grid = grid(tiles, size);
    [0, 1].map(|a| ((size[a].saturating_sub((grid[a] - 1) * GAP)) / grid[a]).max(1))
}

/// Lays at most [`MAX_TILES`] tiles, each of [`tile_size`], by rows on a picture of `size` pixels, each with its name in its lower left corner.
///
/// # Errors
/// One line: a name cannot be drawn.
pub fn beside(mut tiles: Vec<(String, Picture)>, size: [u32; 2]) -> Result<Picture, String> {
    let (grid, each) = (grid(tiles.len(), size), tile_size(tiles.len(), size));
    let mut picture = Picture::filled(size, BETWEEN);
    for (n, (name, tile)) in tiles.iter_mut().enumerate() {
        marked::label(tile, name)?;
        let at = [n as u32 % grid[0], n as u32 / grid[0]];
        picture.paste(tile, [0, 1].map(|a| at[a] * (each[a] + GAP)));
    }
    Ok(picture)
}

/// The difference of two pictures of one size in brightness, the first minus the second.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    pub picture: Picture,
    /// The scale runs from -`end` to `end`, levels of 255. `end` is the smallest of 16, 32, 64, 128 and 255 for which, of the pixels that are black
    /// in neither picture, at most 1 % differ by more.
    pub end: u16,
    /// Root mean square of the difference over all pixels, levels of 255.
    pub rms: f64,
}

/// Draws the difference of two pictures: blue where the second is brighter, orange where the first is, with the scale at the right edge if there is
/// room for it.
///
/// # Errors
/// One line: pictures of different sizes, or the scale cannot be drawn.
pub fn difference(first: &Picture, second: &Picture) -> Result<Difference, String> {
    let size = common_size(first, second)?;
    let pairs = first.brightness().into_iter().zip(second.brightness());
    let pairs: Vec<[i32; 2]> = pairs.map(|(a, b)| [a, b].map(i32::from)).collect();
    // What one volume alone holds differs by more than tissue does.
    let lit: Vec<u32> = pairs.iter().filter(|[a, b]| *a > 0 && *b > 0).map(|[a, b]| a.abs_diff(*b)).collect();
    let beyond = |end: u16| lit.iter().filter(|off| **off > u32::from(end)).count() as f64;
    let mut end = LEAST_END;
    while end < 255 && beyond(end) > BEYOND * lit.len() as f64 {
        end = (2 * end).min(255);
    }
    let off: Vec<i32> = pairs.into_iter().map(|[a, b]| a - b).collect();
    let mut picture = Picture::filled(size, EQUAL.map(|c| c as u8));
    for (pixel, off) in picture.rgba.chunks_exact_mut(4).zip(&off) {
        pixel[..3].copy_from_slice(&colour(f64::from(*off) / f64::from(end)));
    }
    let squares: f64 = off.iter().map(|off| f64::from(*off).powi(2)).sum();
    let rms = (squares / off.len().max(1) as f64).sqrt();
    scale(&mut picture, end)?;
    Ok(Difference { picture, end, rms })
}

fn common_size(first: &Picture, second: &Picture) -> Result<[u32; 2], String> {
    let size = [first.width, first.height];
    match size == [second.width, second.height] {
        true => Ok(size),
        false => Err(format!("a picture of {} x {} is compared with another size", first.width, first.height)),
    }
}

/// The colour of a difference, -1..=1 of the scale.
fn colour(share: f64) -> [u8; 3] {
    let (to, share) = (if share < 0.0 { SECOND } else { FIRST }, share.abs().min(1.0));
    std::array::from_fn(|c| (EQUAL[c] + share * (to[c] - EQUAL[c])).round() as u8)
}

/// Draws the scale at the right edge, where a picture has room for it.
fn scale(picture: &mut Picture, end: u16) -> Drawn {
    let text = marked::text_height(picture.width);
    let size = [4 * text, (picture.height / 2).min(20 * text)];
    if picture.width < 3 * size[0] || size[1] < 6 * text {
        return Ok(());
    }
    let drawn = canvas::picture(size, &Scale { end, text })?;
    picture.paste(&drawn, [picture.width - size[0] - text / 2, (picture.height - size[1]) / 2]);
    Ok(())
}

struct Scale {
    end: u16,
    /// Height of the text, pixels.
    text: u32,
}

impl Drawing for Scale {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        let ([width, height], text) = (canvas.size(), f64::from(self.text));
        let filled = |colour: [u8; 3]| ShapeStyle::from(&RGBColor(colour[0], colour[1], colour[2])).filled();
        canvas.boxed([0.0, 0.0, width, height], filled(EQUAL.map(|c| c as u8)))?;
        let (top, bottom, left) = (text, height - text, width - text);
        let rows = (bottom - top).max(1.0) as usize;
        for row in 0..rows {
            let share = 1.0 - 2.0 * (row as f64 + 0.5) / rows as f64;
            let y = top + row as f64;
            canvas.boxed([left, y, width, y + 1.0], filled(colour(share)))?;
        }
        let marks =
            [(format!("+{}", self.end), top), ("0".into(), 0.5 * height), (format!("\u{2212}{}", self.end), bottom)];
        for (words, y) in marks {
            canvas.text(&words, [left - 0.4 * text, y], self.text, INK, [2, 1])?;
        }
        Ok(())
    }
}

/// The first picture on the left, the second on the right, and a line between them. `share`: position of the line from the left, 0..=1 of the
/// width.
///
/// # Errors
/// One line: pictures of different sizes.
pub fn wipe(first: &Picture, second: &Picture, share: f64) -> Result<Picture, String> {
    let size = common_size(first, second)?;
    let column = (share.clamp(0.0, 1.0) * f64::from(first.width)).round() as u32;
    let mut picture = second.clone();
    let row = 4 * first.width as usize;
    for (to, from) in picture.rgba.chunks_exact_mut(row.max(4)).zip(first.rgba.chunks_exact(row.max(4))) {
        to[..4 * column as usize].copy_from_slice(&from[..4 * column as usize]);
    }
    picture.paste(&Picture::filled([1, size[1]], [255; 3]), [column.min(size[0].saturating_sub(1)), 0]);
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(size: [u32; 2], level: impl Fn(u32, u32) -> u8) -> Picture {
        let mut picture = Picture::filled(size, [0; 3]);
        for (n, pixel) in picture.rgba.chunks_exact_mut(4).enumerate() {
            pixel[..3].fill(level(n as u32 % size[0], n as u32 / size[0]));
        }
        picture
    }

    fn pixel(picture: &Picture, [x, y]: [u32; 2]) -> [u8; 3] {
        let at = 4 * (y * picture.width + x) as usize;
        [picture.rgba[at], picture.rgba[at + 1], picture.rgba[at + 2]]
    }

    #[test]
    fn a_difference_has_the_sign_and_the_share_of_its_levels() {
        let size = [40, 30];
        let (first, second) = (ramp(size, |x, _| 100 + x as u8), ramp(size, |_, _| 120));
        let found = difference(&first, &second).expect("a difference");
        let equal = EQUAL.map(|c| c as u8);
        assert_eq!((found.end, pixel(&found.picture, [20, 5])), (32, equal), "20 levels need the scale of 32");
        // At 120 - 100 = 20 of 32 levels, as the formula has it.
        let mixed: [u8; 3] = std::array::from_fn(|c| (EQUAL[c] + 20.0 / 32.0 * (SECOND[c] - EQUAL[c])).round() as u8);
        assert_eq!(pixel(&found.picture, [0, 29]), mixed);
        let mean_square = (0..40).map(|x| f64::from(x - 20).powi(2)).sum::<f64>() / 40.0;
        assert!((found.rms - mean_square.sqrt()).abs() < 1e-12);
        let again = difference(&second, &first).expect("a difference");
        assert!(pixel(&again.picture, [0, 0])[0] > pixel(&again.picture, [0, 0])[2], "the first is brighter: orange");
        assert!(difference(&first, &ramp([41, 30], |_, _| 0)).is_err());
        // In a picture with room the scale stands at the right, in the middle of the height.
        let large = difference(&ramp([300, 300], |_, _| 5), &ramp([300, 300], |_, _| 5)).expect("a difference");
        let column: Vec<[u8; 3]> = (70..230).map(|y| pixel(&large.picture, [290, y])).collect();
        assert!(column.iter().any(|c| c[0] > 200) && column.iter().any(|c| c[2] > 200), "both ends of the scale");
        assert!((0..200).all(|x| pixel(&large.picture, [x, 150]) == equal));
    }

    #[test]
    fn a_wipe_shows_the_first_picture_up_to_its_line() {
        let (first, second) = (ramp([10, 4], |_, _| 50), ramp([10, 4], |_, _| 90));
        let wiped = wipe(&first, &second, 0.4).expect("a wipe");
        let row: Vec<u8> = (0..10).map(|x| pixel(&wiped, [x, 2])[0]).collect();
        assert_eq!(row, [50, 50, 50, 50, 255, 90, 90, 90, 90, 90]);
        for share in [0.0, 1.0] {
            assert!(wipe(&first, &second, share).is_ok());
        }
        assert!(wipe(&first, &ramp([10, 5], |_, _| 0), 0.5).is_err());
    }

    /// Tiles fill the picture, apart from the gaps and what does not divide, and do not overlap.
    #[test]
    fn tiles_lie_beside_each_other() {
        for (count, size) in [(1, [90, 50]), (2, [91, 50]), (2, [50, 91]), (3, [200, 80]), (4, [101, 77])] {
            let [width, height] = tile_size(count, size);
            let tiles = (0..count).map(|n| (String::new(), ramp([width, height], |_, _| 100 + n as u8))).collect();
            let picture = beside(tiles, size).expect("a picture");
            assert_eq!([picture.width, picture.height], size);
            for n in 0..count {
                let shown = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
                let shown = shown.filter(|at| pixel(&picture, *at) == [100 + n as u8; 3]).count();
                // The label of an empty name covers a corner.
                let all = (width * height) as usize;
                assert!(shown <= all && 4 * shown > 3 * all, "{count} {size:?}: {shown} of {all}");
            }
        }
        assert_eq!(tile_size(4, [1, 1]), [1, 1]);
    }
}
