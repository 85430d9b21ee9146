//! Arrays as pictures side by side: what was got, what was expected, and by how much they differ.

use crate::passes::{Texels, is_hit};
use crate::picture::Picture;
use crate::verify::report::Shown;

/// Two arrays, at one slice of them, in the same grey: the least and the largest expected value are black and white. Of four channels
/// the first three are red, green and blue; of two the first is shown. What was not hit or not written is black.
pub fn shown(what: &str, expected: &Texels, got: &Texels, slice: usize) -> Shown {
    let seen = |v: f64| v.is_finite() && is_hit(v.abs());
    let plane = expected.size[0] * expected.size[1] * expected.channels;
    let from = (slice * plane).min(expected.values.len().saturating_sub(plane));
    let of = |texels: &'_ Texels| texels.values.iter().skip(from).take(plane).copied().collect::<Vec<f64>>();
    let (expected_values, got_values) = (of(expected), of(got));
    let bounds = expected_values.iter().filter(|v| seen(**v));
    let (low, high) = bounds.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    // Pictures and shares are what they are; distances fill the grey.
    let (low, high) = if low >= 0.0 && high <= 1.0 { (0.0, 1.0) } else { (low, high) };
    let channels = expected.channels;
    let size = [expected.size[0] as u32, expected.size[1] as u32];
    let picture = |of: &dyn Fn(usize) -> f64| {
        let channel = |texel: usize, c: usize| match channels {
            4 => of(4 * texel + c),
            _ => of(channels * texel),
        };
        let level = |v: f64| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let texel = |texel: usize| [0, 1, 2].map(|c| level(channel(texel, c)));
        let rgba = (0..plane / channels.max(1)).flat_map(|t| texel(t).into_iter().chain([255])).collect();
        Picture { width: size[0], height: size[1], rgba }
    };
    let grey = |v: f64| if seen(v) { (v - low) / (high - low).max(1e-12) } else { 0.0 };
    let apart = |i: usize| (grey(expected_values[i]) - grey(got_values[i])).abs();
    let largest = (0..plane).map(apart).fold(0.0, f64::max);
    // So that the largest difference is bright, but what is nothing stays black.
    let gain = (1.0 / largest.max(1.0 / 255.0)).floor().clamp(1.0, 64.0);
    Shown {
        what: what.into(),
        actual: picture(&|i| grey(got_values[i])),
        expected: picture(&|i| grey(expected_values[i])),
        difference: picture(&|i| gain * apart(i)),
        gain: gain as u32,
        fault: None,
    }
}

/// Two pictures of one size.
pub fn pictures(what: &str, expected: &Picture, got: &Picture) -> Shown {
    let largest = expected.rgba.iter().zip(&got.rgba).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let gain = (255 / u32::from(largest.max(1))).clamp(1, 64);
    let apart = expected.rgba.iter().zip(&got.rgba).enumerate();
    let rgba = apart.map(|(i, (a, b))| match i % 4 {
        3 => 255,
        _ => (u32::from(a.abs_diff(*b)) * gain).min(255) as u8,
    });
    let difference = Picture { width: expected.width, height: expected.height, rgba: rgba.collect() };
    let (actual, expected) = (got.clone(), expected.clone());
    Shown { what: what.into(), actual, expected, difference, gain, fault: None }
}
