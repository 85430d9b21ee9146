//! Compares results with expected ones: outputs of a pass with its reference, and pictures with pictures. It also draws difference pictures
//! for the report.

use super::Findings;
use crate::passes::slots::Format;
use crate::passes::{Arrays, Bind, DispatchArgs, Pass, Slot, Texels, is_hit};
use crate::picture::Picture;
use crate::report::{Fault, Figure, PictureComparison, Unit, Worst};
use crate::scene::Scene;

/// How far the outputs of one dispatch are from those of the reference. "Within tolerance" refers to the tolerance of the pass, the rounding of the
/// format and the [`ExtraTolerance`] together.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Largest error of the texels within tolerance, in the units of the output.
    pub largest: f64,
    /// Largest error of the texels within tolerance, divided by the error that is allowed there (0..1).
    pub used: f64,
    /// Share (0..1) of the texels beyond tolerance, less the share that [`ExtraTolerance`] allows, at least 0; the largest of all outputs.
    pub outliers: f64,
    /// Absolute value of the mean signed error of the texels within tolerance, divided by the error that is allowed there; the largest
    /// of all outputs that have enough written texels. It is small if errors are roundings, which have both signs.
    pub bias: f64,
    /// The worst texel of the first output that has more texels beyond tolerance than its pass and the [`ExtraTolerance`] allow; None if no output
    /// has.
    pub worst: Option<Worst>,
}

/// Minimum number of texels for the bias: with fewer, a few flipped roundings look like a bias.
const MIN_TEXELS: usize = 100;
/// The same for floats, whose rounding errors are small.
const MIN_FLOAT_TEXELS: usize = 20;

fn is_float(format: Format) -> bool {
    let floats = [Format::R16f, Format::Rg16f, Format::Rgba16f, Format::R32f, Format::Rg32f, Format::Rgba32f];
    floats.contains(&format)
}

/// Passes whose outputs differ by no more than their samples: their largest, smallest and mean, and sections.
const SMOOTH: [&str; 3] = ["raycast_projection", "raycast_planes", "raycast_planes_toned"];

/// What is tolerated in addition to the tolerance that a pass declares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExtraTolerance {
    /// Largest additional error of values from 0 to 1.
    pub value: f64,
    /// Largest additional error of distances, mm.
    pub distance: f64,
    /// Additional share (0..1) of texels that may have a larger error.
    pub outliers: f64,
}

impl ExtraTolerance {
    /// The extra tolerance for a dispatch that samples through the device's texture filter, whose weights have `bits` bits and may be truncated along
    /// three axes; zero for other dispatches. Neighbouring texels are assumed to differ by at most 1. If a pass compares samples with a threshold or
    /// looks them up in a transfer function, a small difference may become a large one. Then a share of the texels may be wrong: a threshold is
    /// reached a step earlier or later, and rarely in another voxel. The group "sampling" judges single samples.
    pub fn of(pass: &Pass, scene: &Scene, args: &DispatchArgs, bits: u32) -> ExtraTolerance {
        if !pass.reads(scene, args).iter().any(|bind| bind.filtered) {
            return ExtraTolerance::default();
        }
        let is_smooth = SMOOTH.contains(&pass.name);
        let outliers = if is_smooth { 0.0 } else { 0.02 };
        ExtraTolerance { value: 3.0 * (-f64::from(bits)).exp2(), distance: scene.step, outliers }
    }

    fn at(&self, slot: Slot) -> f64 {
        match slot {
            Slot::Distance | Slot::DistanceA | Slot::DistanceB => self.distance,
            _ => self.value,
        }
    }
}

/// The largest error that is allowed of a value of an output whose expected value is `expected`, in its units: the tolerance of the pass, the
/// rounding of the format, and what `extra` allows.
pub(super) fn tolerance_of(pass: &Pass, extra: ExtraTolerance, slot: Slot, format: Format, expected: f64) -> f64 {
    let tolerance = pass.tolerance.absolute.max(pass.tolerance.relative * expected.abs());
    tolerance + 1.01 * Texels::spacing(format, expected) + extra.at(slot)
}

/// Compares all outputs of a dispatch, the bindings `writes`, with those of the reference. `poison`: value of the outputs before the dispatch. Where
/// the reference has NaN, this value must be unchanged.
pub fn compare_outputs(
    pass: &Pass,
    scene: &Scene,
    extra: ExtraTolerance,
    poison: f64,
    expected: &Arrays,
    got: &Arrays,
    writes: &[Bind],
) -> Comparison {
    let mut all = Comparison::default();
    for bind in writes {
        let (expected, got) = (expected.get(bind.name), got.get(bind.name));
        let format = bind.slot.format(scene);
        let (mut beyond, mut worst) = (0, None);
        // The expected values as the format stores them, so that its rounding does not count as error.
        let stored = Texels::decode(expected.size, format, &expected.encode(format));
        let (mut signed, mut allowance, mut written) = (0.0, 0.0, 0);
        for (i, (e, g)) in expected.values.iter().zip(&got.values).enumerate() {
            let untouched = e.is_nan();
            let e = if untouched { poison } else { *e };
            let allowed = match untouched {
                true => 1.01 * Texels::spacing(format, e),
                false => tolerance_of(pass, extra, bind.slot, format, e),
            };
            let error = (e - g).abs();
            if error <= allowed {
                if !untouched {
                    all.largest = all.largest.max(error);
                    all.used = all.used.max(error / allowed);
                    if is_hit(e.abs()) {
                        let residual = g - if is_float(format) { e } else { stored.values[i] };
                        // For floats a driver may round to either neighbour.
                        let rounded =
                            if is_float(format) { residual.abs().min(Texels::spacing(format, e)) } else { 0.0 };
                        let residual = residual - rounded.copysign(residual);
                        (signed, allowance, written) = (signed + residual, allowance + allowed, written + 1);
                    }
                }
                continue;
            }
            beyond += 1;
            // NaN is the worst error.
            if worst.is_none_or(|(_, _, _, w)| error > w || error.is_nan()) {
                worst = Some((i, e, *g, error));
            }
        }
        let enough = if is_float(format) { MIN_FLOAT_TEXELS } else { MIN_TEXELS };
        if written >= enough && allowance > 0.0 {
            all.bias = all.bias.max((signed / allowance).abs());
        }
        let share = beyond as f64 / expected.values.len() as f64;
        all.outliers = all.outliers.max(share - extra.outliers);
        let Some((i, e, g, _)) =
            worst.filter(|_| share > pass.tolerance.outliers + extra.outliers && all.worst.is_none())
        else {
            continue;
        };
        all.worst = Some(Worst { beyond, ..Worst::of(bind.name, expected, i, [e, g]) });
    }
    all
}

/// Maximum mean difference of a picture from its reference over the values that are near, levels of 255. Rounding causes some tenths
/// of a level.
const MAX_MEAN: f64 = 0.2;
/// Difference above which a value is far off, levels.
const FAR_LEVELS: u8 = 8;
/// Largest share (0..1) of channel values of a picture that may be far off (by more than 8 levels): edges may move by a pixel where the threshold of
/// a detector or shadow is met.
pub(crate) const MAX_FAR_SHARE: f64 = 0.02;

/// Edge of a tile, which one workgroup renders, pixels.
const TILE: u32 = 8;
/// Maximum share of the pixels of a tile that are far off: an edge that moves by a pixel crosses a tile once or twice, a lost workgroup
/// affects all pixels.
const MAX_TILE_SHARE: f64 = 0.5;

/// How far two pictures of 8 bits are apart. A channel value is far off if it differs by more than 8 levels.
pub(crate) struct PictureDifference {
    /// Mean difference of the channel values that are not far off, levels of 255.
    pub mean: f64,
    /// Share (0..1) of all channel values that are far off.
    pub far: f64,
    pub largest: u8,
    /// Largest share (0..1) of pixels with a value that is far off, in any tile of 8 x 8 pixels.
    pub tile: f64,
    pub worst: Worst,
}

/// The difference of two pictures of equal size.
pub(crate) fn picture_difference(expected: &Picture, got: &Picture) -> PictureDifference {
    let (mut sum, mut far, mut largest, mut at) = (0.0, 0, 0, 0);
    for (i, (e, g)) in expected.rgba.iter().zip(&got.rgba).enumerate() {
        let apart = e.abs_diff(*g);
        match apart > FAR_LEVELS {
            true => far += 1,
            false => sum += f64::from(apart),
        }
        if apart > largest {
            (largest, at) = (apart, i);
        }
    }
    let (count, width) = (expected.rgba.len().max(1), expected.width.max(1) as usize);
    let worst = Worst {
        output: "screen".into(),
        at: [at / 4 % width, at / 4 / width, 0],
        channel: at % 4,
        expected: expected.rgba.get(at).copied().map_or(0.0, f64::from),
        got: got.rgba.get(at).copied().map_or(0.0, f64::from),
        beyond: far,
        texels: count,
    };
    let (mean, far) = (sum / (count - far).max(1) as f64, far as f64 / count as f64);
    PictureDifference { mean, far, largest, tile: worst_tile(expected, got), worst }
}

fn worst_tile(expected: &Picture, got: &Picture) -> f64 {
    let across = expected.width.div_ceil(TILE).max(1);
    let mut tiles = vec![[0u32; 2]; (across * expected.height.div_ceil(TILE)) as usize];
    for (i, (e, g)) in expected.rgba.chunks_exact(4).zip(got.rgba.chunks_exact(4)).enumerate() {
        let (x, y) = (i as u32 % expected.width, i as u32 / expected.width);
        let is_far = e.iter().zip(g).any(|(e, g)| e.abs_diff(*g) > FAR_LEVELS);
        let [far, all] = &mut tiles[(y / TILE * across + x / TILE) as usize];
        (*far, *all) = (*far + u32::from(is_far), *all + 1);
    }
    tiles.iter().map(|[far, all]| f64::from(*far) / f64::from((*all).max(1))).fold(0.0, f64::max)
}

/// Records how far a picture is from the expected one. Adds a fault if the sizes differ, or if the mean difference, the share of values that are
/// off by more than 8 levels, or the share of pixels with such a value in any tile exceeds its limit. `input`: description of the
/// scene, for the report.
pub fn compare_picture(findings: &mut Findings, input: &str, expected: &Picture, got: &Picture) {
    if (expected.width, expected.height, expected.rgba.len()) != (got.width, got.height, got.rgba.len()) {
        return findings.expect(false, || {
            format!("{input}: {}x{} pixels instead of {}x{}", got.width, got.height, expected.width, expected.height)
        });
    }
    let apart = picture_difference(expected, got);
    if apart.mean > MAX_MEAN || apart.far > MAX_FAR_SHARE || apart.tile > MAX_TILE_SHARE {
        let what = format!(
            "mean difference {:.3} levels, {:.2} % of the values off by more than {FAR_LEVELS}, up to {:.0} % of a tile's pixels",
            apart.mean,
            100.0 * apart.far,
            100.0 * apart.tile
        );
        findings.faults.push(Fault { input: input.into(), worst: Some(apart.worst), ..Fault::new(what) });
    }
    findings.figures.push(Figure::error("mean difference", apart.mean, MAX_MEAN, Unit::Levels));
    findings.figures.push(Figure::error("values further off than 8 levels", apart.far, MAX_FAR_SHARE, Unit::Share));
    findings.figures.push(Figure::error("pixels of a tile that are", apart.tile, MAX_TILE_SHARE, Unit::Share));
    findings.figures.push(Figure::informative("largest difference", apart.largest.into(), Unit::Levels));
}

/// Adds a fault unless two pictures are identical byte for byte, and counts the comparison. Returns true if they are. `what`: name of the comparison.
pub fn expect_same_picture(findings: &mut Findings, what: &str, expected: &Picture, got: &Picture) -> bool {
    findings.compared += 1;
    if expected == got {
        return true;
    }
    findings.differ += 1;
    let size = |p: &Picture| format!("{}x{}", p.width, p.height);
    if size(expected) != size(got) {
        findings.expect(false, || format!("{what}: expected {}, got {}", size(expected), size(got)));
        return false;
    }
    let apart = picture_difference(expected, got);
    let other = expected.rgba.iter().zip(&got.rgba).filter(|(a, b)| a != b).count();
    let values = expected.rgba.len();
    let said = format!("{what}: {other} of {values} values differ, by {} levels at most", apart.largest);
    let fault = Fault { worst: Some(Worst { beyond: other, ..apart.worst }), ..Fault::new(said) };
    findings.add_shown(fault, picture_comparison(what, expected, got));
    false
}

/// Records as figures how many pictures were compared so far, and how many of them differ; any that differs is above the limit.
pub(crate) fn add_picture_counts(findings: &mut Findings) {
    findings.figures.push(count_figure("pictures compared", findings.compared));
    findings.figures.push(Figure::error("pictures that differ", findings.differ as f64, 0.0, Unit::Count));
}

/// A comparison picture of one slice of two arrays, with the same grey scale: values of 0..1 as they are, others from the smallest to the largest
/// expected value. Of four channels the first three are red, green and blue; of two channels the first is drawn. Misses and unwritten texels are
/// black.
pub(crate) fn texel_comparison(what: &str, expected: &Texels, got: &Texels, slice: usize) -> PictureComparison {
    let visible = |v: f64| v.is_finite() && is_hit(v.abs());
    let plane = expected.size[0] * expected.size[1] * expected.channels;
    let from = (slice * plane).min(expected.values.len().saturating_sub(plane));
    let of = |texels: &'_ Texels| texels.values.iter().skip(from).take(plane).copied().collect::<Vec<f64>>();
    let (expected_values, got_values) = (of(expected), of(got));
    let bounds = expected_values.iter().filter(|v| visible(**v));
    let (low, high) = bounds.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    // Values within 0..1 are drawn unscaled; distances are stretched.
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
    let grey = |v: f64| if visible(v) { (v - low) / (high - low).max(1e-12) } else { 0.0 };
    let apart = |i: usize| (grey(expected_values[i]) - grey(got_values[i])).abs();
    let largest = (0..plane).map(apart).fold(0.0, f64::max);
    // The largest difference becomes bright; no difference stays black.
    let gain = (1.0 / largest.max(1.0 / 255.0)).floor().clamp(1.0, 64.0);
    PictureComparison {
        what: what.into(),
        actual: picture(&|i| grey(got_values[i])),
        expected: picture(&|i| grey(expected_values[i])),
        difference: picture(&|i| gain * apart(i)),
        gain: gain as u32,
        fault: None,
    }
}

/// A comparison picture of two pictures of equal size.
pub(crate) fn picture_comparison(what: &str, expected: &Picture, got: &Picture) -> PictureComparison {
    let largest = expected.rgba.iter().zip(&got.rgba).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    let gain = (255 / u32::from(largest.max(1))).clamp(1, 64);
    let apart = expected.rgba.iter().zip(&got.rgba).enumerate();
    let rgba = apart.map(|(i, (a, b))| match i % 4 {
        3 => 255,
        _ => (u32::from(a.abs_diff(*b)) * gain).min(255) as u8,
    });
    let difference = Picture { width: expected.width, height: expected.height, rgba: rgba.collect() };
    let (actual, expected) = (got.clone(), expected.clone());
    PictureComparison { what: what.into(), actual, expected, difference, gain, fault: None }
}

/// A count that is reported without a limit.
pub(crate) fn count_figure(what: &str, value: usize) -> Figure {
    Figure::informative(what, value as f64, Unit::Count)
}
