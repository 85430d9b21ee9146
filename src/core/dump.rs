//! The contents of slots for inspection: as pictures, and as arrays with their units and axes for other programs.

use crate::passes::slots::{Format, Initializer, Meaning, Shape};
use crate::passes::{Slot, Texels, is_hit};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::scene::Scene;
use crate::tree::ToNode;
use glam::DVec3;
use serde_json::{Value, json};

/// What the files beside the arrays state, with the version.
const FORMAT: &str = "echolume dump 1";

/// Width and height of a drawn table, pixels.
const GRAPH: [usize; 2] = [512, 256];

/// Draws a slot: four channels as a colour (0..1, opaque), a volume as its slices side by side, a distance map with near bright, far dark and misses
/// black, a table of the CPU as one curve per channel. Of any other slot the first channel is drawn in grey, stretched from its smallest to its
/// largest value unless all values are within 0..1. `texels`: what the slot holds; None for a table that the CPU computes from the scene. Other slots
/// without texels give one black pixel.
pub fn draw(slot: Slot, texels: Option<&Texels>, scene: &Scene) -> Picture {
    match (texels, slot.initializer()) {
        (Some(texels), _) if texels.channels == 4 && texels.size[2] == 1 => colours(texels),
        (Some(texels), _) if texels.channels == 4 => side_by_side(texels, |n| colour(&texels.values[4 * n..])),
        (Some(texels), _) if slot.meaning().miss.is_some() => side_by_side(texels, grey(distances(texels))),
        (Some(texels), _) => side_by_side(texels, grey(stretched(texels))),
        (None, Initializer::ByScene(make)) => curves(&make(scene), slot.meaning().channels.len()),
        (None, _) => Picture { width: 1, height: 1, rgba: vec![0, 0, 0, 255] },
    }
}

fn byte(value: f64) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn colour(texel: &[f64]) -> [u8; 3] {
    [byte(texel[0]), byte(texel[1]), byte(texel[2])]
}

/// Grey values, 0..1, as colours by index.
fn grey(values: Vec<f64>) -> impl Fn(usize) -> [u8; 3] {
    move |n| [byte(values[n]); 3]
}

fn colours(texels: &Texels) -> Picture {
    let opaque = |p: &[f64]| {
        let [r, g, b] = colour(p);
        [r, g, b, 255]
    };
    let rgba = texels.values.chunks_exact(4).flat_map(opaque).collect();
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

/// All slices side by side, as square as possible, at most 2048 pixels wide. `colour` is that of the texel of this index.
fn side_by_side(texels: &Texels, colour: impl Fn(usize) -> [u8; 3]) -> Picture {
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
                let shown = colour((z * height + y * shrink) * width + x * shrink);
                let at = 4 * ((z / across * h + y) * across * w + z % across * w + x);
                picture.rgba[at..at + 3].copy_from_slice(&shown);
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

/// A slot as the bytes of an NPY file for numpy (NPY 1.0, little endian, C order), and a JSON description of its axes, channels and units. `texels`:
/// what the slot holds; None for a table that the CPU computes from the scene. Other slots without texels give an empty array. Values are f32 as the
/// shaders read them; those of formats of unsigned integers are f64.
pub fn array(slot: Slot, texels: Option<&Texels>, scene: &Scene) -> (Vec<u8>, Value) {
    let Meaning { channels, unit, miss } = slot.meaning();
    let (shape, values) = match (texels, slot.initializer()) {
        (Some(t), _) => ([t.size[2], t.size[1], t.size[0], t.channels], t.values.clone()),
        (None, Initializer::ByScene(make)) => {
            let values: Vec<f64> = make(scene).into_iter().map(f64::from).collect();
            ([1, 1, values.len() / channels.len(), channels.len()], values)
        }
        (None, _) => ([1, 1, 0, 1], Vec::new()),
    };
    let axes = match slot.shape(scene) {
        Shape::Layers(_) => ["layer", "line or row", "sample or column"],
        Shape::Three(_) => ["slice", "row", "column"],
        Shape::Two(_) => ["", "row", "column"],
        Shape::Buffer(_) => ["", "", "entry"],
    };
    // Axes that a shape lacks, and a single channel, are left out.
    let mut kept: Vec<(&str, usize)> = axes.into_iter().zip(shape).filter(|(axis, _)| !axis.is_empty()).collect();
    if shape[3] > 1 {
        kept.push(("channel", shape[3]));
    }
    let is_bits = matches!(slot.format(scene), Format::R32u | Format::Rg32u);
    let bytes = npy(&kept.iter().map(|(_, n)| *n).collect::<Vec<_>>(), &values, is_bits);
    let mut about = json!({
        "format": FORMAT,
        "slot": slot.name(),
        "axes": kept.iter().map(|(axis, _)| *axis).collect::<Vec<_>>(),
        "channels": channels.iter().take(shape[3]).collect::<Vec<_>>(),
        "unit": unit,
    });
    if let Some(miss) = miss {
        about["no_surface"] = json!(miss);
    }
    if slot == Slot::PackedNeighbours {
        // Of the volume it holds the stored part. The volume itself is written whole.
        let [column, row, slice] = slot.first_texel(scene);
        about["first"] = json!({"slice": slice, "row": row, "column": column});
    }
    (bytes, about)
}

/// The bytes of an NPY file, format 1.0. The last axis of `shape` varies fastest. `as_f64`: true stores the values as f64, false as f32.
pub fn npy(shape: &[usize], values: &[f64], as_f64: bool) -> Vec<u8> {
    let sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let kind = if as_f64 { "<f8" } else { "<f4" };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", sizes.trim_end());
    // Magic number, version and length take 10 bytes; the header ends with a line break.
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = padded - 1).as_bytes());
    for value in values {
        match as_f64 {
            true => bytes.extend(value.to_le_bytes()),
            false => bytes.extend((*value as f32).to_le_bytes()),
        }
    }
    bytes
}

/// What a program that reads the arrays needs to know of the scene: geometry, slice pixels, rendered box, rays, step, detector and settings. Lengths
/// are in mm, in the space of the volume: x lateral, y depth, z elevation.
pub fn scene_description(scene: &Scene) -> Value {
    let at = |v: DVec3| json!([v.x, v.y, v.z]);
    let rays = &scene.rays;
    json!({
        "format": FORMAT,
        "space": "mm; x lateral, y depth, z elevation; y is 0 at the apex of a curved array and at the face of a linear one",
        "geometry": match &scene.geometry {
            Geometry::Sweep(probe) => json!({"sweep": probe.to_node()}),
            Geometry::Cartesian(grid) => json!({"cartesian": grid.to_node()}),
        },
        "slice_pixels": {"origin_mm": scene.grid.origin, "pitch_mm": scene.grid.pitch, "columns_rows": scene.grid.size},
        "box": {"low_mm": at(scene.low), "high_mm": at(scene.high)},
        "rays": {
            "note": "of the pixel in column x and row y, from 0: origin + (x + 0.5) origin_dx + (y + 0.5) origin_dy, the direction likewise and then normalised",
            "size": scene.ray_size(),
            "origin": at(rays.origin), "origin_dx": at(rays.origin_dx), "origin_dy": at(rays.origin_dy),
            "direction": at(rays.direction), "direction_dx": at(rays.direction_dx), "direction_dy": at(rays.direction_dy),
        },
        "step_mm": scene.step,
        "detector": {"step_mm": scene.ring.step, "samples_of_an_edge": scene.ring.half},
        "settings": scene.settings.to_node(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numpy's format, byte by byte: NEP 1.
    #[test]
    fn an_array_has_numpys_header_and_little_endian_values() {
        for (shape, values, as_f64) in [(vec![2, 3], [1.0, -2.5, 0.0, 4.0, 5.0, 1e9], false), (vec![6], [0.5; 6], true)]
        {
            let bytes = npy(&shape, &values, as_f64);
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\0");
            let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            assert_eq!((10 + length) % 64, 0);
            let header = std::str::from_utf8(&bytes[10..10 + length]).expect("ASCII");
            assert!(header.ends_with('\n') && header.contains("'fortran_order': False"), "{header}");
            let expected = if shape.len() == 2 { "'shape': (2, 3,), " } else { "'shape': (6,), " };
            assert!(header.contains(expected), "{header}");
            let size = if as_f64 { 8 } else { 4 };
            assert!(header.contains(&format!("'descr': '<f{size}'")) && bytes.len() == 10 + length + 6 * size);
            let second = &bytes[10 + length + size..][..size];
            let second = match as_f64 {
                true => f64::from_le_bytes(second.try_into().expect("8 bytes")),
                false => f64::from(f32::from_le_bytes(second.try_into().expect("4 bytes"))),
            };
            assert_eq!(second, values[1]);
        }
    }
}
