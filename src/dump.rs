//! Draws the contents of a slot as a picture, to inspect the stages.

use crate::passes::slots::Initializer;
use crate::passes::{Slot, Texels, is_hit};
use crate::picture::Picture;
use crate::scene::Scene;

/// Width and height of a drawn table, pixels.
const GRAPH: [usize; 2] = [512, 256];

/// Draws a slot: colours unchanged, a volume as a sheet of its slices, a distance map with near bright and far dark, a table as
/// curves. A single channel is stretched from its minimum to its maximum unless it is within 0..1.
pub fn draw(slot: Slot, texels: Option<&Texels>, scene: &Scene) -> Picture {
    match (texels, slot.initializer()) {
        (Some(texels), _) if texels.channels == 4 => colours(texels),
        (Some(texels), _) if matches!(slot, Slot::Distance | Slot::DistanceA | Slot::DistanceB) => {
            sheet(texels, &distances(texels))
        }
        (Some(texels), _) => sheet(texels, &stretched(texels)),
        (None, Initializer::ByScene(make)) => {
            let channels = match slot {
                Slot::Transfer | Slot::Tiles | Slot::Block => 4,
                Slot::SliceTable => 2,
                _ => 1,
            };
            curves(&make(scene), channels)
        }
        (None, _) => Picture { width: 1, height: 1, rgba: vec![0, 0, 0, 255] },
    }
}

fn byte(value: f64) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn colours(texels: &Texels) -> Picture {
    let rgba = texels.values.chunks_exact(4).flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
    Picture { width: texels.size[0] as u32, height: texels.size[1] as u32, rgba }
}

fn stretched(texels: &Texels) -> Vec<f64> {
    let first: Vec<f64> = texels.values.chunks_exact(texels.channels).map(|t| t[0]).collect();
    let (low, high) = first.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let (low, high) = if low >= 0.0 && high <= 1.0 { (0.0, 1.0) } else { (low, high) };
    first.iter().map(|v| (v - low) / (high - low).max(1e-30)).collect()
}

fn distances(texels: &Texels) -> Vec<f64> {
    let hits = texels.values.iter().copied().filter(|v| is_hit(*v));
    let (low, high) = hits.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let near = |v: f64| 1.0 - 0.85 * (v - low) / (high - low).max(1e-30);
    texels.values.iter().map(|v| if is_hit(*v) { near(*v) } else { 0.0 }).collect()
}

/// A sheet of all slices, as square as possible, at most 2048 pixels wide.
fn sheet(texels: &Texels, grey: &[f64]) -> Picture {
    let [width, height, slices] = texels.size;
    let across = (((slices * height) as f64 / width as f64).sqrt().ceil() as usize).clamp(1, slices);
    let shrink = (across * width).div_ceil(2048).max(1);
    let (w, h) = (width.div_ceil(shrink), height.div_ceil(shrink));
    let down = slices.div_ceil(across);
    let mut picture = Picture { width: (across * w) as u32, height: (down * h) as u32, rgba: Vec::new() };
    picture.rgba = [0, 0, 0, 255].repeat(across * w * down * h);
    for z in 0..slices {
        for y in 0..h {
            for x in 0..w {
                let value = byte(grey[(z * height + y * shrink) * width + x * shrink]);
                let at = 4 * ((z / across * h + y) * across * w + z % across * w + x);
                picture.rgba[at..at + 3].fill(value);
            }
        }
    }
    picture
}

/// One curve per channel over the entries, each stretched to the full height.
fn curves(values: &[f32], channels: usize) -> Picture {
    const COLOURS: [[u8; 3]; 4] = [[230, 80, 70], [90, 200, 90], [90, 140, 255], [240, 240, 240]];
    let [width, height] = GRAPH;
    let mut rgba = [16, 16, 16, 255].repeat(width * height);
    let entries = values.len() / channels;
    for (channel, colour) in COLOURS.iter().enumerate().take(channels) {
        let curve: Vec<f32> = values.iter().skip(channel).step_by(channels).copied().collect();
        let (low, high) = curve.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        for x in 0..width {
            let Some(value) = curve.get(x * entries.saturating_sub(1) / (width - 1)) else { continue };
            let share = (value - low) / (high - low).max(1e-30);
            let y = ((1.0 - share) * (height - 1) as f32).round() as usize;
            let at = 4 * (y.min(height - 1) * width + x);
            rgba[at..at + 3].copy_from_slice(colour);
        }
    }
    Picture { width: width as u32, height: height as u32, rgba }
}
