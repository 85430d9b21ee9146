//! The bounds of the device's linear filter hold for every sampler that Vulkan allows, and for no wrong one.

use echolume::low_level::passes::Texels;
use echolume::low_level::passes::device_limits::sample_position;
use echolume::low_level::passes::slots::Format;
use echolume::low_level::verify::built_in::Noise;
use echolume::low_level::verify::sampling::{FilterPrecision, Judged, judge};

fn volume(size: [usize; 3], format: Format) -> Texels {
    let mut noise = Noise(5);
    let mut values = Texels::untouched(size, 1);
    values.values.iter_mut().for_each(|value| *value = if noise.next() < 0.5 { 0.0 } else { noise.next() });
    Texels::decode(size, format, &values.encode(format))
}

/// What a simulated sampler returns. `place`: its position along an axis, in texels; `round`: its result.
fn sampled(volume: &Texels, place: impl Fn(f64, usize) -> f64, round: impl Fn(f64) -> f64) -> Texels {
    Texels::from_fn([64, 48, 1], 1, |[x, y, _], _| {
        let share = sample_position([x, y], [64, 48]);
        let at = std::array::from_fn(|axis| place(share[axis] * volume.size[axis] as f64 - 0.5, volume.size[axis]));
        round(volume.trilinear(at))
    })
}

fn judged(format: Format, place: impl Fn(f64, usize) -> f64, round: impl Fn(f64) -> f64) -> Judged {
    let volume = volume([7, 5, 4], format);
    judge(FilterPrecision { bits: 8, format }, &volume, &sampled(&volume, place, round))
}

/// Positions cut to fixed point.
fn cut(bits: u32) -> impl Fn(f64, usize) -> f64 {
    let steps = f64::from(bits).exp2();
    move |at, _| (at * steps).floor() / steps
}

const FORMATS: [Format; 4] = [Format::R8, Format::R16, Format::R16f, Format::R32f];

#[test]
fn every_sampler_that_vulkan_allows_is_within_the_bounds() {
    for format in FORMATS {
        let steps = 256.0;
        for (name, outside) in [
            ("exact", judged(format, |at, _| at, |v| v).outside),
            ("cut", judged(format, cut(8), |v| v).outside),
            ("rounded", judged(format, |at, _| (at * steps).round() / steps, |v| v).outside),
            ("finer", judged(format, cut(12), |v| v).outside),
            (
                "in the format",
                judged(format, cut(8), |v| {
                    Texels::decode([1; 3], format, &Texels::from_fn([1; 3], 1, |_, _| v).encode(format)).values[0]
                })
                .outside,
            ),
        ] {
            assert_eq!(outside, 0, "{name}, {format:?}");
        }
    }
}

/// A sampler as an H100 has it: the unit that eight texels share is divided along each axis in turn, in whole 256ths.
#[test]
fn weights_rounded_to_the_bits_of_a_position_are_within_them_and_are_counted() {
    for format in FORMATS {
        let volume = volume([7, 5, 4], format);
        let got = Texels::from_fn([64, 48, 1], 1, |[x, y, _], _| {
            let share = sample_position([x, y], [64, 48]);
            let at: [f64; 3] =
                std::array::from_fn(|a| ((share[a] * volume.size[a] as f64 - 0.5) * 256.0).round() / 256.0);
            let upper = |units: f64, axis: usize| (units * (at[axis] - at[axis].floor())).round();
            let divided = |units: f64, axis: usize| [units - upper(units, axis), upper(units, axis)];
            let [i, j, k] = at.map(|at| at.floor() as i64);
            let mut sum = 0.0;
            for (c, slice) in (0..).zip(divided(256.0, 2)) {
                for (b, row) in (0..).zip(divided(slice, 1)) {
                    for (a, units) in (0..).zip(divided(row, 0)) {
                        sum += units / 256.0 * volume.clamped(i + a, j + b, k + c);
                    }
                }
            }
            sum
        });
        let judged = judge(FilterPrecision { bits: 8, format }, &volume, &got);
        assert_eq!(judged.outside, 0, "{format:?}: {judged:?}");
        // In bytes, a result is as coarse as a weight.
        assert!(judged.rounded > 0 || format == Format::R8, "{format:?}: {judged:?}");
    }
}

#[test]
fn a_wrong_sampler_is_outside_of_them() {
    for format in FORMATS {
        let share = |at: f64| at - at.floor();
        for (name, least, judged) in [
            ("6 bits", 100, judged(format, cut(6), |v| v)),
            ("half a texel aside", 2000, judged(format, |at, _| at + 0.5, |v| v)),
            ("nearest", 2000, judged(format, |at, _| at.round(), |v| v)),
            (
                "smooth weights",
                1000,
                judged(format, |at, _| at.floor() + share(at).powi(2) * (3.0 - 2.0 * share(at)), |v| v),
            ),
            ("repeat instead of clamp", 500, judged(format, |at, size| at.rem_euclid(size as f64), |v| v)),
            (
                "a border of 0",
                100,
                judged(
                    format,
                    |at, size| if at < -0.5 || at > size as f64 - 0.5 { f64::NAN } else { at },
                    |v| if v.is_nan() { 0.0 } else { v },
                ),
            ),
            ("NaN", 3072, judged(format, |at, _| at, |_| f64::NAN)),
        ] {
            assert!(judged.outside >= least, "{name}, {format:?}: only {} samples", judged.outside);
            assert!(judged.worst.is_some(), "{name}");
        }
    }
}

/// Vulkan lets a result have the precision of its format. A filter of 8 bits is a fault of every other format; samples of r8 then use more of their
/// interval, which `verify --baseline` reports as an error that grew.
#[test]
fn a_filter_of_8_bits_is_a_fault_of_formats_that_have_more() {
    let coarse = |v: f64| (v * 255.0).floor() / 255.0;
    for format in FORMATS {
        let [exact, coarse] = [judged(format, cut(8), |v| v), judged(format, cut(8), coarse)];
        assert_eq!(coarse.outside > 1000, format != Format::R8, "{format:?}: {coarse:?}");
        assert!(coarse.outside > 0 || coarse.used > 1.5 * exact.used, "{exact:?}, {coarse:?}");
    }
}

/// One sample suffices: no share of outliers is allowed.
#[test]
fn a_single_wrong_sample_is_outside() {
    let volume = volume([16, 16, 16], Format::R16);
    let mut got = sampled(&volume, |at, _| at, |v| v);
    let value = got.one(30, 20, 0);
    got.set([30, 20, 0], &[value + 0.05]);
    let judged = judge(FilterPrecision { bits: 8, format: Format::R16 }, &volume, &got);
    assert_eq!((judged.outside, judged.worst.map(|w| w.0)), (1, Some([30, 20])));
}

/// Against the closed formula of the uniform cubic B-spline of a point, and on fields that it keeps.
#[test]
fn samples_across_slices_are_those_of_the_cubic_bspline() {
    let bell = |x: f64| match x.abs() {
        x if x < 1.0 => 2.0 / 3.0 - x * x + x.powi(3) / 2.0,
        x if x < 2.0 => (2.0 - x).powi(3) / 6.0,
        _ => 0.0,
    };
    let point = Texels::from_fn([3, 2, 9], 1, |[x, y, z], _| f64::from((x, y, z) == (1, 0, 4)));
    let slope = Texels::from_fn([3, 2, 9], 1, |[x, y, z], _| 0.1 * x as f64 + 0.2 * y as f64 + 0.05 * z as f64);
    let even = Texels::from_fn([3, 2, 9], 1, |_, _| 0.7);
    for n in 0..=160 {
        let z = -4.0 + 0.1 * f64::from(n);
        // Bilinear within the slice.
        let of_point = 0.75 * 0.6 * bell(z - 4.0);
        assert!((point.bspline_across_slices([0.75, 0.4, z]) - of_point).abs() < 1e-12, "{z}");
        assert!((even.bspline_across_slices([0.75, 0.4, z]) - 0.7).abs() < 1e-12, "{z}");
        if (1.0..=7.0).contains(&z) {
            let there = 0.075 + 0.08 + 0.05 * z;
            assert!((slope.bspline_across_slices([0.75, 0.4, z]) - there).abs() < 1e-12, "{z}");
        }
    }
    // The border is repeated: its own slice has 5/6 there, its neighbour 1/6, and two slices out nothing else is left.
    let border = Texels::from_fn([1, 1, 4], 1, |[_, _, z], _| if z == 0 { 1.0 } else { 0.4 });
    for (z, expected) in [(0.0, 0.9), (-2.0, 1.0), (3.0, 0.4), (5.0, 0.4)] {
        assert!((border.bspline_across_slices([0.0, 0.0, z]) - expected).abs() < 1e-12, "{z}");
    }
}
