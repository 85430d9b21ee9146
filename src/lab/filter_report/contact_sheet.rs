//! Filtered frames side by side, one for each filter, with their names and measures.

use super::{Report, Row, Subject};
use crate::canvas::{self, Canvas, Drawing, Drawn, INK};
use crate::picture::Picture;
use plotters::prelude::DrawingBackend;

/// Columns of tiles.
const COLUMNS: usize = 5;
/// Width of a tile, pixels.
const WIDTH: usize = 240;
/// Between tiles, and below each for its text, pixels.
const GAP: usize = 8;
const CAPTION: usize = 40;

/// Draws the frame of a subject after the [chosen](Report::chosen) setting of each filter, and its clean frame if there is one.
///
/// # Errors
/// One line: the drawing failed.
pub fn contact_sheet(report: &Report, subject: &Subject) -> Result<Picture, String> {
    let mut tiles: Vec<Tile> = Vec::new();
    for row in report.chosen().iter().filter_map(|n| subject.rows.get(*n)) {
        tiles.push(Tile { name: name(row), note: note(row), pixels: &row.pixels });
    }
    if let Some(clean) = &subject.clean {
        tiles.push(Tile {
            name: "mean over all speckle".into(),
            note: "what a filter should find".into(),
            pixels: clean,
        });
    }
    let height = WIDTH * subject.size[1] / subject.size[0].max(1);
    let pitch = [WIDTH + GAP, height + CAPTION];
    let rows = tiles.len().div_ceil(COLUMNS);
    let size = [GAP + COLUMNS.min(tiles.len()) * pitch[0], GAP + rows * pitch[1]];
    let mut drawn = canvas::picture(size.map(|n| n as u32), &Captions { tiles: &tiles, pitch })?;
    for (n, tile) in tiles.iter().enumerate() {
        let at = [GAP + n % COLUMNS * pitch[0], GAP + n / COLUMNS * pitch[1]];
        for (y, x) in (0..height).flat_map(|y| (0..WIDTH).map(move |x| (y, x))) {
            let share = [(x as f64 + 0.5) / WIDTH as f64, (y as f64 + 0.5) / height as f64];
            let level = (255.0 * interpolated(tile.pixels, subject.size, share).clamp(0.0, 1.0)).round() as u8;
            let first = 4 * ((at[1] + y) * size[0] + at[0] + x);
            drawn.rgba[first..first + 3].fill(level);
        }
    }
    Ok(drawn)
}

struct Tile<'a> {
    name: String,
    note: String,
    pixels: &'a [f64],
}

fn name(row: &Row) -> String {
    [row.candidate.filter, &row.candidate.label].join(" ").trim_end().to_string()
}

fn note(row: &Row) -> String {
    let figure = |name: &str, value: Option<f64>| value.map(|v| format!("{name} {v:.3}"));
    let quality = &row.quality;
    let figures = [
        figure("SNR", quality.snr),
        figure("CNR", quality.cnr),
        figure("edges", quality.edges),
        figure("SSIM", quality.ssim),
    ];
    figures.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The value at a place given as shares of both edges, bilinear.
fn interpolated(pixels: &[f64], [width, height]: [usize; 2], [across, down]: [f64; 2]) -> f64 {
    let place = |share: f64, count: usize| {
        let at = (share * count as f64 - 0.5).clamp(0.0, count as f64 - 1.0);
        (at as usize, (at as usize + 1).min(count - 1), at.fract())
    };
    let ((left, right, x), (top, bottom, y)) = (place(across, width), place(down, height));
    let row = |r: usize| pixels[r * width + left] * (1.0 - x) + pixels[r * width + right] * x;
    row(top) * (1.0 - y) + row(bottom) * y
}

struct Captions<'a> {
    tiles: &'a [Tile<'a>],
    pitch: [usize; 2],
}

impl Drawing for Captions<'_> {
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<B>) -> Drawn {
        for (n, tile) in self.tiles.iter().enumerate() {
            let left = (GAP + n % COLUMNS * self.pitch[0]) as f64;
            let top = (GAP + n / COLUMNS * self.pitch[1] + self.pitch[1] - CAPTION) as f64;
            canvas.text(&canvas.cut(&tile.name, 13, WIDTH as f64)?, [left, top + 3.0], 13, INK, [0, 0])?;
            canvas.text(&canvas.cut(&tile.note, 12, WIDTH as f64)?, [left, top + 19.0], 12, INK, [0, 0])?;
        }
        Ok(())
    }
}
