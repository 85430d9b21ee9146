//! Error metrics of pictures (RMSE, PSNR, SSIM), distance maps and normals against a reference.

use crate::passes::{Texels, is_hit};
use crate::statistics::quantile;
use crate::tree::{FromNode, ToNode};

/// Edge of SSIM's window, pixels, and the deviation of its Gaussian (Wang, Bovik, Sheikh, Simoncelli 2004, section III-B).
const WINDOW: usize = 11;
const DEVIATION: f64 = 1.5;
/// SSIM's (K L)^2 for K1 = 0.01, K2 = 0.03 and values in 0..1 (L = 1).
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
/// Luminance of red, green and blue (Rec. ITU-R BT.709), applied to the stored values.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Differences of two pictures over red, green and blue, 0..1. Alpha is not visible on a screen and is ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureError {
    pub rmse: f64,
    /// Largest difference of any channel of any pixel.
    pub max: f64,
    /// 20 log10(1 / rmse), dB; None (infinite) if the pictures are equal.
    pub psnr: Option<f64>,
    /// Mean structural similarity of the luminance over all windows within the picture, at most 1. None if the picture is smaller than the window of
    /// 11 x 11 pixels.
    pub ssim: Option<f64>,
}

/// Statistics of the absolute values of errors.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct ErrorStatistics {
    pub rms: f64,
    pub median: f64,
    /// 95th percentile, interpolated linearly between values.
    pub p95: f64,
    pub max: f64,
    /// Number of pixels that were compared.
    pub count: usize,
}

/// Differences of two pictures as the screen shows them, in levels of 255, not rounded. The difference of a pixel is that of its channel that differs
/// most.
#[derive(Clone, Copy, Debug, Default, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Levels {
    pub rms: f64,
    pub median: f64,
    /// 95th percentile over the pixels, interpolated linearly between values.
    pub p95: f64,
    pub max: f64,
    /// Share (0..1) of the pixels that differ by more than 1 level.
    pub over_1: f64,
    /// Share (0..1) of the pixels that differ by more than 8 levels.
    pub over_8: f64,
}

/// Differences of two maps of a surface: of distances, mm, or of normals, degrees.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct SurfaceError {
    /// Error over the pixels that are hit in both maps and are no jumps, mm or degrees. None if there are no such pixels.
    pub error: Option<ErrorStatistics>,
    /// Share (0..1) of all pixels that are hit in the measured map, but missed in the reference.
    pub false_hits: f64,
    /// Share (0..1) of all pixels that are missed in the measured map, but hit in the reference.
    pub missed_hits: f64,
    /// Share (0..1) of all pixels that are hit in both maps, but on different surfaces. Always 0 for normals.
    pub jumps: f64,
}

/// Compares two toned pictures with values in 0..1 by their first three channels. `left_out`: for each pixel, row by row, true if it does not count.
/// Pixels without an entry count. If no pixel counts, all differences are 0.
///
/// # Errors
/// One line: sizes or channels differ, there is no pixel or more than one layer, or a value is not finite.
pub fn levels(measured: &Texels, reference: &Texels, left_out: &[bool]) -> Result<Levels, String> {
    check("picture", measured, reference)?;
    let channels = measured.channels;
    let pairs = measured.values.chunks_exact(channels).zip(reference.values.chunks_exact(channels)).enumerate();
    let counted = pairs.filter(|(n, _)| !left_out.get(*n).is_some_and(|is_out| *is_out));
    let of_pixel = |(a, b): (&[f64], &[f64])| a.iter().zip(b).take(3).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let differences: Vec<f64> = counted.map(|(_, pair)| 255.0 * of_pixel(pair)).collect();
    let share =
        |limit: f64| differences.iter().filter(|d| **d > limit).count() as f64 / differences.len().max(1) as f64;
    let (over_1, over_8) = (share(1.0), share(8.0));
    let Some(spread) = spread(differences) else { return Ok(Levels::default()) };
    Ok(Levels { rms: spread.rms, median: spread.median, p95: spread.p95, max: spread.max, over_1, over_8 })
}

/// For each pixel of a picture of `size`, true if the rays of both distance maps differ there: a hit that is lost or gained, or surfaces whose
/// distances differ by more than `cliff` mm. Neighbours of such pixels are true as well, because their normals and edges change. The maps may have
/// other sizes than the picture; the ray through the centre of a pixel decides. Pixels are row by row.
pub fn changed_rays(measured: &Texels, reference: &Texels, cliff: f64, size: [usize; 3]) -> Vec<bool> {
    let at = |map: &Texels, x: usize, y: usize| {
        let along = |n: usize, axis: usize| {
            let place = (2 * n + 1) * map.size[axis] / (2 * size[axis]).max(1);
            place.min(map.size[axis].saturating_sub(1))
        };
        map.one(along(x, 0), along(y, 1), 0)
    };
    let [width, height, _] = size;
    let differs = |n: usize| {
        let [a, b] = [measured, reference].map(|map| at(map, n % width, n / width));
        is_hit(a) != is_hit(b) || (is_hit(a) && (a - b).abs() > cliff)
    };
    let changed: Vec<bool> = (0..width * height).map(differs).collect();
    let near = |n: usize| {
        let (x, y) = (n % width, n / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| (x, y)))
            .any(|(x, y)| changed[y * width + x])
    };
    (0..width * height).map(near).collect()
}

/// Compares pictures of 3 or 4 channels in 0..1.
///
/// # Errors
/// One line: the channels are not 3 or 4, sizes or channels differ, there is no pixel or more than one layer, or a value is not finite.
pub fn pictures(measured: &Texels, reference: &Texels) -> Result<PictureError, String> {
    if !matches!(measured.channels, 3 | 4) {
        return Err(format!("a picture has 3 or 4 channels, not {}", measured.channels));
    }
    check("picture", measured, reference)?;
    let channels = measured.channels;
    let rgb = |t: &Texels| t.values.chunks_exact(channels).flat_map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>();
    let (a, b) = (rgb(measured), rgb(reference));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    let rmse = (squares / a.len() as f64).sqrt();
    let max = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let grey =
        |rgb: &[f64]| rgb.chunks_exact(3).map(|p| (0..3).map(|c| LUMINANCE[c] * p[c]).sum()).collect::<Vec<f64>>();
    let psnr = (rmse > 0.0).then(|| -20.0 * rmse.log10());
    Ok(PictureError { rmse, max, psnr, ssim: similarity(&grey(&a), &grey(&b), measured.size) })
}

/// Compares two distance maps, mm. Distances that differ by more than `cliff` mm count as jumps to another surface, not as errors.
///
/// # Errors
/// One line: sizes or channels differ, there is no pixel or more than one layer, or a value is not finite.
pub fn surfaces(measured: &Texels, reference: &Texels, cliff: f64) -> Result<SurfaceError, String> {
    check("distance map", measured, reference)?;
    let first = |t: &Texels| t.values.iter().step_by(t.channels).map(|v| is_hit(*v).then_some(*v)).collect::<Vec<_>>();
    let difference = |a: &f64, b: &f64| Some((a - b).abs()).filter(|off| *off <= cliff);
    Ok(surface(&first(measured), &first(reference), difference))
}

/// Compares two maps of normals (the first three channels are x, y, z) by the angle between normals, degrees. Normals need not have unit length. A
/// zero vector is a miss.
///
/// # Errors
/// One line: there are fewer than 3 channels, sizes or channels differ, there is no pixel or more than one layer, or a value is not finite.
pub fn normals(measured: &Texels, reference: &Texels) -> Result<SurfaceError, String> {
    if measured.channels < 3 {
        return Err(format!("a map of normals has 3 channels or more, not {}", measured.channels));
    }
    check("map of normals", measured, reference)?;
    let read = |t: &Texels| {
        let vectors = t.values.chunks_exact(t.channels).map(|v| glam::DVec3::new(v[0], v[1], v[2]));
        vectors.map(|v| v.try_normalize()).collect::<Vec<_>>()
    };
    // atan2 rather than acos, which is inaccurate for small angles.
    Ok(surface(&read(measured), &read(reference), |a, b| Some(a.cross(*b).length().atan2(a.dot(*b)).to_degrees())))
}

fn check(what: &str, measured: &Texels, reference: &Texels) -> Result<(), String> {
    let ([w, h, d], [rw, rh, rd]) = (measured.size, reference.size);
    if (measured.size, measured.channels) != (reference.size, reference.channels) {
        let (mine, its) = (measured.channels, reference.channels);
        return Err(format!("{what}: {w}x{h}x{d} of {mine} channels cannot be compared with {rw}x{rh}x{rd} of {its}"));
    }
    if d != 1 || w * h == 0 {
        return Err(format!("{what}: {w}x{h}x{d} is not one layer of pixels"));
    }
    for (whose, texels) in [("measured", measured), ("reference", reference)] {
        if let Some(i) = texels.values.iter().position(|v| !v.is_finite()) {
            let (pixel, value) = (i / texels.channels, texels.values[i]);
            return Err(format!("{what}, {whose}: pixel ({}, {}) is {value}", pixel % w, pixel / w));
        }
    }
    Ok(())
}

/// `difference`: none for two places that are on different surfaces.
fn surface<T>(
    measured: &[Option<T>],
    reference: &[Option<T>],
    difference: impl Fn(&T, &T) -> Option<f64>,
) -> SurfaceError {
    let mut errors = Vec::new();
    let (mut false_hits, mut missed_hits, mut jumps) = (0, 0, 0);
    for pair in measured.iter().zip(reference) {
        match pair {
            (Some(a), Some(b)) => match difference(a, b) {
                Some(difference) => errors.push(difference),
                None => jumps += 1,
            },
            (Some(_), None) => false_hits += 1,
            (None, Some(_)) => missed_hits += 1,
            (None, None) => {}
        }
    }
    let share = |n: usize| n as f64 / measured.len() as f64;
    SurfaceError {
        error: spread(errors),
        false_hits: share(false_hits),
        missed_hits: share(missed_hits),
        jumps: share(jumps),
    }
}

fn spread(mut errors: Vec<f64>) -> Option<ErrorStatistics> {
    errors.sort_by(f64::total_cmp);
    let max = *errors.last()?;
    let count = errors.len();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count as f64).sqrt();
    Some(ErrorStatistics { rms, median: quantile(&errors, 0.5)?, p95: quantile(&errors, 0.95)?, max, count })
}

/// Mean structural similarity of two single-channel pictures with values in 0..1 (SSIM; Wang et al. 2004, equation 13), weighted by the Gaussian
/// window and averaged over all windows within the picture. Pixels are row by row; the first two numbers of the size are width and height. None if
/// the picture is smaller than the window of 11 x 11 pixels.
pub fn similarity(a: &[f64], b: &[f64], [width, height, _]: [usize; 3]) -> Option<f64> {
    if width < WINDOW || height < WINDOW {
        return None;
    }
    let products = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>();
    let mean = |values: &[f64]| windowed(values, width, height);
    let (ma, mb) = (mean(a), mean(b));
    let (aa, bb, ab) = (mean(&products(a, a)), mean(&products(b, b)), mean(&products(a, b)));
    let each = (0..ma.len()).map(|i| {
        let (va, vb, cov) = (aa[i] - ma[i] * ma[i], bb[i] - mb[i] * mb[i], ab[i] - ma[i] * mb[i]);
        let likeness = (2.0 * ma[i] * mb[i] + C1) * (2.0 * cov + C2);
        likeness / ((ma[i] * ma[i] + mb[i] * mb[i] + C1) * (va + vb + C2))
    });
    Some(each.sum::<f64>() / ma.len() as f64)
}

/// Means under the Gaussian window at every position within the picture: rows, then columns.
fn windowed(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    let away = |i: usize| i as f64 - (WINDOW / 2) as f64;
    let bell: [f64; WINDOW] = std::array::from_fn(|i| (-0.5 * (away(i) / DEVIATION).powi(2)).exp());
    let sum: f64 = bell.iter().sum();
    let (across, down) = (width + 1 - WINDOW, height + 1 - WINDOW);
    let mut rows = Vec::with_capacity(across * height);
    for row in values.chunks_exact(width) {
        rows.extend(row.windows(WINDOW).map(|w| w.iter().zip(bell).map(|(v, g)| v * g).sum::<f64>() / sum));
    }
    let column = |x: usize, y: usize| (0..WINDOW).map(|i| rows[(y + i) * across + x] * bell[i]).sum::<f64>() / sum;
    (0..down).flat_map(|y| (0..across).map(move |x| (x, y))).map(|(x, y)| column(x, y)).collect()
}
