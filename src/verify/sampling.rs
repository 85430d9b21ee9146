//! Group "sampling": the device's linear filter, sample by sample. Vulkan leaves a device some freedom: positions are converted to fixed
//! point, with as many fractional bits as the device states, and a result has the precision of its format. Vulkan does not state the
//! precision of the weights of the eight texels, which GPUs round to as many bits (measured on an H100). The results that this allows form
//! an interval, and a single sample outside it is a fault. The number of samples that only rounded weights explain is reported.

use super::built_in::{BYTES, Noise, cartesian, scene};
use super::compare::{count_figure, texel_comparison};
use super::each_pass::POISON;
use super::{Check, DeviceUnderTest, Findings};
use crate::gpu::{GpuError, formats};
use crate::passes::device_limits::{POSITIONS, sample_position};
use crate::passes::slots::Format;
use crate::passes::{Arrays, DispatchArgs, Slot, Texels};
use crate::report::{Fault, Figure, Level, Unit, Worst};

/// Volume formats by the words of the settings.
const FORMATS: [&str; 4] = ["r8", "r16", "r16f", "r32f"];

/// Sizes of the volumes: even and odd, and one texel thick.
const SIZES: [[usize; 3]; 3] = [[7, 5, 4], [16, 16, 16], [9, 6, 1]];

/// Relative rounding of a coordinate that a shader computes in single precision, with a few operations.
const COORDINATE_ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Units of the last bit by which the weights of eight texels may be off together. One unit is divided between the two halves of a cell, then between
/// the halves of these, and of these again, and each division of a part is rounded by half a unit: none along the first axis, whose share has
/// these bits already, two along the second, four along the third. 2.4 were seen on an H100 (CUDA's texture unit, 4096 positions).
const WEIGHT_UNITS: f64 = 0.5 * (2.0 + 4.0);

/// One sample in so many may be explained by rounded weights alone. One in 20 was on an H100, and half of them with positions of 6 bits.
const MOST_ROUNDED: usize = 8;

/// Rounding of sums and products in single precision, of values up to 1.
const SUM_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

pub fn checks(_: Level) -> Vec<Check> {
    let check = |format| Check::new("sampling", format!("linear filter of {format}"), move |dut| check(dut, format));
    FORMATS.into_iter().map(check).collect()
}

/// The precision that a device's linear filter has to have.
#[derive(Clone, Copy, Debug)]
pub struct FilterPrecision {
    /// Number of fractional bits of a sample's position (`subTexelPrecisionBits`).
    pub bits: u32,
    /// Format of the texels and of the result.
    pub format: Format,
}

impl FilterPrecision {
    /// The same, and what weights give that are rounded to the bits of a position.
    fn both_bounds(self, volume: &Texels, share: [f64; 3]) -> [[f64; 2]; 2] {
        let step = (-f64::from(self.bits)).exp2();
        // Along each axis the pairs of texels that may be blended, and the range of the upper one's weight.
        let axes: [Vec<Cell>; 3] = std::array::from_fn(|axis| {
            let size = volume.size[axis] as f64;
            let at = share[axis] * size - 0.5;
            let error = step + COORDINATE_ROUNDING * (share[axis].abs() * size + 1.0);
            cells(at - error, at + error)
        });
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in &axes[0] {
            for y in &axes[1] {
                for z in &axes[2] {
                    let texels = (0..8).map(|n| {
                        let next = |axis: i64| n >> axis & 1;
                        volume.clamped(x.low + next(0), y.low + next(1), z.low + next(2))
                    });
                    (least, most) = texels.fold((least, most), |(least, most), t| (least.min(t), most.max(t)));
                    // Within a cell the result is linear in each weight, so that its extremes are at the corners.
                    for corner in 0..8 {
                        let weight = |cell: &Cell, axis: usize| cell.weights[corner >> axis & 1];
                        let at = [(x, 0), (y, 1), (z, 2)].map(|(cell, axis)| cell.low as f64 + weight(cell, axis));
                        let value = blend(volume, [x.low, y.low, z.low], at);
                        (low, high) = (low.min(value), high.max(value));
                    }
                }
            }
        }
        let rounding = |value: f64| Texels::spacing(self.format, value) + SUM_ROUNDING;
        let exact = [low - rounding(low), high + rounding(high)];
        let off = WEIGHT_UNITS * step * (most - least);
        // No weight is negative.
        [exact, [(exact[0] - off).max(least - rounding(least)), (exact[1] + off).min(most + rounding(most))]]
    }
}

/// A pair of neighbouring texels, the lower one by its place, and the smallest and largest weight of the upper one.
struct Cell {
    low: i64,
    weights: [f64; 2],
}

/// The cells between texel centres that a range of positions touches.
fn cells(from: f64, to: f64) -> Vec<Cell> {
    let cell = |low: i64| Cell { low, weights: [(from - low as f64).max(0.0), (to - low as f64).min(1.0)] };
    (from.floor() as i64..=to.floor() as i64).map(cell).collect()
}

/// Trilinear interpolation within the cell of `low`, at its far corners too.
fn blend(volume: &Texels, low: [i64; 3], at: [f64; 3]) -> f64 {
    let mut sum = 0.0;
    for corner in 0..8usize {
        let upper = [0, 1, 2].map(|axis| (corner >> axis & 1) as i64);
        let weight = |axis: usize| {
            let share = at[axis] - low[axis] as f64;
            if upper[axis] == 1 { share } else { 1.0 - share }
        };
        let product = weight(0) * weight(1) * weight(2);
        if product != 0.0 {
            sum += product * volume.clamped(low[0] + upper[0], low[1] + upper[1], low[2] + upper[2]);
        }
    }
    sum
}

/// The judgement of many samples. `outside`: how many are outside the interval of the values that rounded weights allow; `used`: of the others, the
/// largest distance from the middle of that interval, as a share of half its length.
#[derive(Debug, Default)]
pub struct Judged {
    pub outside: usize,
    /// Number of samples that rounded weights allow and exact ones do not; 0 if these are so many that they count as `outside`.
    pub rounded: usize,
    pub used: f64,
    /// The worst sample: column and row in the output, nearest allowed value, and actual value. None if none is outside.
    pub worst: Option<([usize; 2], f64, f64)>,
}

/// Judges every sample in an output of the pass [`POSITIONS`].
pub fn judge(precision: FilterPrecision, volume: &Texels, got: &Texels) -> Judged {
    let [width, height, _] = got.size;
    let mut used_most = 0.0f64;
    let (mut outside, mut rounded) = (Outside::default(), Outside::default());
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let [exact, wide] = precision.both_bounds(volume, sample_position([x, y], [width, height]));
        let value = got.one(x, y, 0);
        if outside.takes([x, y], wide, value) {
            continue;
        }
        rounded.takes([x, y], exact, value);
        let [middle, half] = [0.5 * (wide[0] + wide[1]), 0.5 * (wide[1] - wide[0])];
        used_most = used_most.max((value - middle).abs() / half);
    }
    // More than rounded weights leave: positions are less exact.
    if rounded.count > width * height / MOST_ROUNDED {
        outside = Outside { count: outside.count + rounded.count, ..if outside.count > 0 { outside } else { rounded } };
        rounded = Outside::default();
    }
    Judged { outside: outside.count, rounded: rounded.count, used: used_most, worst: outside.worst }
}

/// Samples outside of intervals, and the worst.
#[derive(Default)]
struct Outside {
    count: usize,
    beyond: f64,
    worst: Option<([usize; 2], f64, f64)>,
}

impl Outside {
    /// True if the value is outside of its interval.
    fn takes(&mut self, at: [usize; 2], [low, high]: [f64; 2], value: f64) -> bool {
        if (low..=high).contains(&value) {
            return false;
        }
        self.count += 1;
        let nearest = if value < low { low } else { high };
        let beyond = (value - nearest).abs();
        // NaN is worse than any number.
        if self.worst.is_none() || beyond.is_nan() || beyond > self.beyond {
            self.beyond = beyond;
            self.worst = Some((at, nearest, value));
        }
        true
    }
}

fn check(dut: &mut DeviceUnderTest, format: &str) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let (mut samples, mut outside, mut rounded, mut used) = (0, 0, 0, 0.0f64);
    for (n, size) in SIZES.into_iter().enumerate() {
        let toml = format!("mode = 'mip'\npicture = {{ size = [64, 48] }}\nslices = {{ format = '{format}' }}");
        let scene = scene(cartesian(size), BYTES, &toml).map_err(GpuError::Broken)?;
        let stored = Slot::Volume.format(&scene);
        if !formats::filters(&dut.context, stored) {
            return Ok(Findings::left_out(format!("the device has no linear filter of {format}")));
        }
        // Mostly extremes: a wrong weight between 0 and 1 changes the result by as much.
        let mut noise = Noise(91 + n as u64);
        let mut texel = || match noise.next() {
            share if share < 0.35 => 0.0,
            share if share < 0.7 => 1.0,
            _ => noise.next(),
        };
        let mut volume = Texels::untouched(Slot::Volume.array_size(&scene), 1);
        volume.values.iter_mut().for_each(|value| *value = texel());
        let volume = Texels::decode(volume.size, stored, &volume.encode(stored));
        let mut inputs = Arrays::default();
        inputs.insert("volume", volume.clone());
        let precision = FilterPrecision { bits: dut.pass_runner().filter_bits(), format: stored };
        let outputs = dut.pass_runner().run(&scene, &POSITIONS, &DispatchArgs::default(), &inputs, POISON)?;
        let got = outputs.get("values");
        let judged = judge(precision, &volume, got);
        let [width, height, _] = got.size;
        samples += width * height;
        (outside, rounded) = (outside + judged.outside, rounded + judged.rounded);
        used = used.max(judged.used);
        let Some(([x, y], expected, value)) = judged.worst else { continue };
        let (beyond, texels) = (judged.outside, width * height);
        let worst = Worst { output: "values".into(), at: [x, y, 0], channel: 0, expected, got: value, beyond, texels };
        let exact = Texels::from_fn([width, height, 1], 1, |[x, y, _], _| {
            let share = sample_position([x, y], [width, height]);
            volume.trilinear(std::array::from_fn(|axis| share[axis] * volume.size[axis] as f64 - 0.5))
        });
        let position = sample_position([x, y], [width, height]).map(|share| format!("{share:.6}")).join(", ");
        let what = format!("{beyond} of {texels} samples are not what {} bits of position allow", precision.bits);
        let input = format!("a volume of {size:?} texels in {format}, at ({position}) of its size");
        let (pass, worst) = (Some(POSITIONS.name.into()), Some(worst));
        let fault = Fault { pass, input, worst, ..Fault::new(what) };
        findings.add_shown(fault, texel_comparison("samples", &exact, got, 0));
    }
    findings.figures.push(count_figure("samples", samples));
    findings.figures.push(Figure::error("samples outside of what is allowed", outside as f64, 0.0, Unit::Count));
    findings.figures.push(count_figure("samples with rounded weights", rounded));
    findings.figures.push(Figure::error("share of the interval", used, 1.0, Unit::Share));
    Ok(findings)
}
