//! The exact reference of a ray against formulas, against sums of very many samples, and with faults planted in it.

use crate::common::figures::figure;
use crate::common::files::data;
use crate::common::probes::{voxels, wobbler};
use crate::common::scenes::{FLOATS, scene};
use echolume::low_level::error_report::convergence::{Fit, Range, fit};
use echolume::low_level::error_report::metrics::{pictures, surfaces};
use echolume::low_level::exact_ray::gauss_kronrod::RULE;
use echolume::low_level::exact_ray::picture::{self, Effort};
use echolume::low_level::exact_ray::projection::projected;
use echolume::low_level::exact_ray::volume::Medium;
use echolume::low_level::exact_ray::{Line, Segment, segments};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use echolume::low_level::reference;
use echolume::low_level::scene::transfer::{self, Absorption};
use echolume::low_level::scene::{Input, Mode, Scene, TransferPoint};
use echolume::low_level::source;
use glam::DVec3;

const WHOLE: [f64; 2] = [0.0, 1.0];

fn point(at: f64, colour: [f64; 3], opacity: f64) -> TransferPoint {
    TransferPoint { at, colour, opacity }
}

fn of_volume(scene: &Scene, f: impl Fn([usize; 3]) -> f64) -> Texels {
    Texels::from_fn(scene.volume_size().map(|n| n as usize), 1, |at, _| f(at))
}

/// Values without structure, the same in every run.
fn noise([x, y, z]: [usize; 3]) -> f64 {
    let n = (x as u64 * 73_856_093) ^ (y as u64 * 19_349_663) ^ (z as u64 * 83_492_791);
    let mixed = (n ^ (n >> 13)).wrapping_mul(0x5851_f42d_4c95_7f2d);
    ((mixed >> 40) & 0xffff) as f64 / 65535.0
}

fn line(scene: &Scene, base: [f64; 3], direction: [f64; 3]) -> Line<'_> {
    Line { scene, base: DVec3::from(base), direction: DVec3::from(direction).normalize() }
}

fn cube() -> Scene {
    scene(voxels([8, 8, 8]), FLOATS, "mode = 'vr'")
}

/// Geometries of every kind: fan and translated, curved and linear, uneven slices, a motor that moves, both ways.
fn sweeps() -> Vec<Probe> {
    let fan = Probe { lines: Axis::centred(0.05, 16), slices: Axis::centred(0.08, 8), ..wobbler() };
    let uneven = Axis::from_table((0..8).map(|k| 0.08 * f64::from(k) - 0.3 + 0.02 * f64::from(k).sin()).collect());
    let uneven_lines =
        Axis::from_table((0..16).map(|k| 0.05 * f64::from(k) - 0.4 + 0.01 * f64::from(k).sin()).collect());
    vec![
        Probe { advance: Advance::Same(0.06), ..fan.clone() },
        Probe { slices: uneven.clone(), ..fan.clone() },
        Probe { lines: uneven_lines, slices: uneven, advance: Advance::Same(-0.05), ..fan.clone() },
        Probe { advance: Advance::Each((0..8).map(|k| 0.01 * f64::from(k) - 0.03).collect()), ..fan.clone() },
        Probe { motion: Motion::Translated, slices: Axis::centred(2.5, 8), ..fan.clone() },
        Probe { array: Array::Linear, lines: Axis::centred(2.0, 16), ..fan.clone() },
        Probe { motion: Motion::Fan { wobble_radius: 32.0 }, ..fan.clone() },
        // Radial: lines to 135 degrees off the axis, which lies behind the apex for the second.
        Probe {
            lines: Axis::centred(0.31, 16),
            motion: Motion::Translated,
            slices: Axis::centred(9.0, 8),
            ..fan.clone()
        },
        Probe { lines: Axis::centred(0.31, 16), motion: Motion::Fan { wobble_radius: 50.0 }, ..fan.clone() },
        fan,
    ]
}

/// A line through the middle of the region of a sweep, in a direction without symmetry.
fn through(scene: &Scene, turn: f64) -> (Line<'_>, f64) {
    let middle = (scene.low + scene.high) / 2.0;
    let direction = DVec3::new(0.5 * turn.cos(), 0.8 * (1.3 * turn).sin() + 0.3, 0.6 * (0.7 * turn).cos()).normalize();
    let long = (scene.high - scene.low).length();
    (Line { scene, base: middle - direction * (long / 2.0), direction }, long)
}

#[test]
fn a_uniform_slab_has_the_opacity_of_its_length() {
    let scene = cube();
    let volume = of_volume(&scene, |_| 0.5);
    let line = line(&scene, [-0.5, 3.2, 2.9], [1.0, 0.0, 0.0]);
    for opacity in [1e-9, 0.05, 0.6, 0.999_999, 1.0] {
        let points = [point(0.0, [0.2, 0.4, 0.8], opacity)];
        let light = Medium::new(&points, 0.0, Absorption::of_length(1.0), 1e-13).light(&segments(
            &line,
            &volume,
            WHOLE,
            [0.0, 7.25],
        ));
        let expected = transfer::opacity(transfer::absorption(opacity) * 7.25);
        for (value, factor) in light.rgba.iter().zip([0.2, 0.4, 0.8, 1.0]) {
            assert!((value - expected * factor).abs() < 2e-14 * 7.25, "{opacity}: {:?}", light.rgba);
        }
    }
}

/// v = s / 7 and opacity a v: the depth is the integral of -ln(1 - a v), which is elementary.
#[test]
fn a_ramp_of_opacity_has_the_depth_of_its_formula() {
    let scene = cube();
    let volume = of_volume(&scene, |[x, ..]| x as f64 / 7.0);
    let line = line(&scene, [0.0, 3.0, 4.0], [1.0, 0.0, 0.0]);
    for a in [0.3, 0.9, 1.0] {
        let points = [point(0.0, [1.0; 3], 0.0), point(1.0, [1.0; 3], a)];
        let light = Medium::new(&points, 0.0, Absorption::of_length(1.0), 1e-14).light(&segments(
            &line,
            &volume,
            WHOLE,
            [0.0, 7.0],
        ));
        // The integral of -ln(1 - a v) dv from 0 to 1 is 1 + (1 - a) ln(1 - a) / a.
        let depth = 7.0 * (1.0 + if a < 1.0 { (1.0 - a) * f64::ln_1p(-a) / a } else { 0.0 });
        assert!((light.rgba[3] - transfer::opacity(depth)).abs() < 1e-13, "{a}: {light:?}");
        assert!((light.rgba[0] - light.rgba[3]).abs() < 1e-12, "white light is the opacity: {light:?}");
    }
}

/// The absorption of opacity a is a E per mm, and at most 1e6 a voxel, which an extinction of 1000 of voxels of 1e4 mm meets at a tenth.
#[test]
fn an_extinction_is_in_proportion_to_the_opacity() {
    let scene = cube();
    let volume = of_volume(&scene, |[x, ..]| x as f64 / 7.0);
    let line = line(&scene, [0.0, 3.0, 4.0], [1.0, 0.0, 0.0]);
    let points = [point(0.0, [1.0; 3], 0.0), point(1.0, [1.0; 3], 0.8)];
    let segments = segments(&line, &volume, WHOLE, [0.0, 7.0]);
    for extinction in [0.01, 0.3, 2.0] {
        let absorption = Absorption { extinction: Some(extinction), reference_length: 0.7 };
        let light = Medium::new(&points, 0.0, absorption, 1e-14).light(&segments);
        assert!((light.rgba[3] - transfer::opacity(7.0 * 0.4 * extinction)).abs() < 1e-13, "{extinction}: {light:?}");
    }
    let thin = [point(0.0, [1.0; 3], 0.0), point(1.0, [1.0; 3], 1.0)];
    let absorption = Absorption { extinction: Some(1e3), reference_length: 1e4 };
    let medium = Medium::new(&thin, 0.0, absorption, 1e-14);
    assert!((absorption.opaque_from() - 0.1).abs() < 1e-15);
    assert!(medium.levels().iter().any(|level| (level - 0.1).abs() < 1e-15), "a kink at {:?}", medium.levels());
    assert_eq!(absorption.over_length(0.1), absorption.over_length(1.0));
}

/// Along the middle of a box the smooth step takes half of the fade's length at each end. At half of its length beside a face half is left.
#[test]
fn matter_fades_towards_the_faces_as_its_formula_says() {
    let fade = 4.0;
    let transfer = "transfer = [{ at = 0.0, colour = [1, 1, 1], opacity = 0.02 }]";
    let scene = scene(
        voxels([30, 31, 32]),
        FLOATS,
        &format!("mode = 'vr'\nregion.fade = {fade}\nvolume = {{ {transfer}, threshold = 0.0 }}"),
    );
    let volume = of_volume(&scene, |_| 0.5);
    let kappa = transfer::absorption(0.02);
    let depth = |base: [f64; 3], direction: [f64; 3], long: f64| {
        let line = line(&scene, base, direction);
        let light = Medium::of(&scene, &line, 1e-13).light(&segments(&line, &volume, WHOLE, [0.0, long]));
        assert!((light.rgba[0] - light.rgba[3]).abs() < 1e-12, "white light is the opacity: {light:?}");
        -(-light.rgba[3]).ln_1p() / kappa
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-11, "{a} and {b}");
    // The box begins half a voxel before the first one. Nothing fades towards the face that is nearest to the probe.
    near(depth([-0.5, 15.0, 15.0], [1.0, 0.0, 0.0], 30.0), 30.0 - fade);
    near(depth([15.0, -0.5, 15.0], [0.0, 1.0, 0.0], 31.0), 31.0 - fade / 2.0);
    near(depth([15.0, 15.0, -0.5], [0.0, 0.0, 1.0], 32.0), 32.0 - fade);
    // Beside a face, t = 1 - hypot(1/2, 1 - z / fade) at a distance z from the end.
    let step = |t: f64| if t > 0.0 { t * t * (3.0 - 2.0 * t) } else { 0.0 };
    let count = 1_000_000;
    let at_end: f64 = (0..count).map(|n| step(1.0 - 0.5f64.hypot(1.0 - (f64::from(n) + 0.5) / f64::from(count)))).sum();
    near(
        depth([1.5, 15.0, -0.5], [0.0, 0.0, 1.0], 32.0),
        0.5 * (32.0 - 2.0 * fade) + 2.0 * fade * at_end / f64::from(count),
    );
}

/// A single bright slice: the B-spline is 2/3 at it, integrates to the distance of two slices and is nothing from two slices on; a ramp stays a ramp.
#[test]
fn a_cubic_across_slices_has_the_values_of_the_b_spline() {
    let of = |mode: &str| scene(voxels([4, 4, 9]), FLOATS, &format!("mode = '{mode}'\nray.elevation = 'bspline'"));
    for (mode, name) in [(Mode::Mip, "mip"), (Mode::Mean, "mean")] {
        let scene = of(name);
        let slice = of_volume(&scene, |[.., z]| f64::from(u8::from(z == 4)));
        // Obliquely through one column and row.
        let line = line(&scene, [1.2, 1.3, 0.0], [0.05, 0.05, 1.0]);
        let long = 8.0 / line.direction.z;
        let value = projected(&segments(&line, &slice, WHOLE, [0.0, long]), mode).expect("inside");
        let expected = if mode == Mode::Mip { 2.0 / 3.0 } else { 1.0 / 8.0 };
        assert!((value - expected).abs() < 1e-14, "{name}: {value}");
        let ramp = of_volume(&scene, |[.., z]| z as f64 / 8.0);
        let value = projected(&segments(&line, &ramp, WHOLE, [long / 4.0, long / 2.0]), mode).expect("inside");
        let expected = if mode == Mode::Mip { 0.5 } else { 0.375 };
        assert!((value - expected).abs() < 1e-14, "{name} of a ramp: {value}");
    }
}

/// f = x y z with x = y = t and z = 1 - t: t^2 (1 - t), at most 4/27, its mean 1/12.
#[test]
fn the_cubic_of_one_cell_has_its_largest_value_and_mean() {
    let scene = scene(voxels([2, 2, 2]), FLOATS, "mode = 'mip'");
    let volume = of_volume(&scene, |[x, y, z]| (x * y * z) as f64);
    let line = line(&scene, [0.0, 0.0, 1.0], [1.0, 1.0, -1.0]);
    let segments = segments(&line, &volume, WHOLE, [0.0, 3f64.sqrt()]);
    let value = |mode| projected(&segments, mode).expect("inside");
    assert!((value(Mode::Mip) - 4.0 / 27.0).abs() < 2e-16, "{}", value(Mode::Mip));
    assert!((value(Mode::Mean) - 1.0 / 12.0).abs() < 2e-16, "{}", value(Mode::Mean));
    assert!(value(Mode::MinIp).abs() < 2e-16);
    assert!((1.0 - projected(&segments, Mode::Mip).unwrap() - 23.0 / 27.0).abs() < 1e-15);
}

/// On a straight line the angle about the axis is atan((s - nearest) / least), and the depth in the plane a hyperbola: both have
/// integrals without approximation.
#[test]
fn fields_linear_in_the_angle_and_in_the_depth_of_a_fan_have_the_means_of_their_formulas() {
    for probe in [sweeps().pop().expect("a fan"), Probe { motion: Motion::Fan { wobble_radius: 32.0 }, ..wobbler() }] {
        let (axis, slices) = (probe.axis_depth(), probe.slices.clone());
        let scene = scene(Geometry::Sweep(probe), FLOATS, "mode = 'xray'\nslices = { pixels = 48 }");
        let count = (scene.volume_size()[2] - 1) as f64;
        let angles = of_volume(&scene, |[_, _, z]| z as f64 / count);
        let height = (scene.volume_size()[1] - 1) as f64;
        let depths = of_volume(&scene, |[_, y, _]| y as f64 / height);
        for turn in 0..12 {
            let (line, long) = through(&scene, f64::from(turn));
            let all = segments(&line, &angles, WHOLE, [0.0, long]);
            if all.is_empty() {
                continue;
            }
            let (u, w) = ([line.base.y - axis, line.direction.y], [line.base.z, line.direction.z]);
            let square = u[1] * u[1] + w[1] * w[1];
            let nearest = -(u[0] * u[1] + w[0] * w[1]) / square;
            let least = (u[0] * w[1] - u[1] * w[0]) / square.sqrt();
            let base = (w[0] + w[1] * nearest).atan2(u[0] + u[1] * nearest);
            let angle = |s: f64| {
                let x = (s - nearest) * square.sqrt();
                (base * x + x * (x / least).atan() - least / 2.0 * (least * least + x * x).ln()) / square.sqrt()
            };
            let depth = |s: f64| {
                let x = (s - nearest) * square.sqrt();
                let root = x.hypot(least);
                (x * root + least * least * (x / least.abs()).asinh()) / 2.0 / square.sqrt()
            };
            let runs = |f: &dyn Fn(f64) -> f64| all.iter().map(|s: &Segment| f(s.to) - f(s.from)).sum::<f64>();
            let length = runs(&|s| s);
            let expected = (runs(&angle) / length - slices.first()) / slices.pitch() / count;
            let mean = projected(&all, Mode::Mean).expect("inside");
            assert!((mean - expected).abs() < 1e-13, "angle, {turn}: {mean} and {expected}");
            let all = segments(&line, &depths, WHOLE, [0.0, long]);
            let expected = ((runs(&depth) / length + axis - scene.grid.origin[1]) / scene.grid.pitch[1]) / height;
            let mean = projected(&all, Mode::Mean).expect("inside");
            assert!((mean - expected).abs() < 1e-13, "depth, {turn}: {mean} and {expected}");
        }
    }
}

/// Red, green, blue and opacity by a midpoint sum of `count` steps over each part of the line that is inside, by the function
/// that defines a sample; nothing of the exact reference takes part.
fn summed(line: &Line, volume: &Texels, points: &[TransferPoint], long: f64, count: usize) -> [f64; 4] {
    let mut ends = vec![];
    let scan = 4000;
    let at = |n: usize| long * n as f64 / scan as f64;
    for n in 0..scan {
        let (mut a, mut b) = (at(n), at(n + 1));
        let before = line.is_inside(a);
        if n == 0 && before {
            ends.push(0.0);
        }
        if before != line.is_inside(b) {
            for _ in 0..60 {
                let middle = (a + b) / 2.0;
                if line.is_inside(middle) == before { a = middle } else { b = middle }
            }
            ends.push(a);
        }
    }
    ends.extend((ends.len() % 2 == 1).then_some(long));
    let (mut light, mut depth) = ([0.0; 3], 0.0);
    for pair in ends.chunks_exact(2) {
        let h = (pair[1] - pair[0]) / count as f64;
        for n in 0..count {
            let s = pair[0] + (n as f64 + 0.5) * h;
            let value = volume.trilinear(line.coordinates(s)).clamp(0.0, 1.0);
            let [r, g, b, a] = transfer::at(points, value);
            let kappa = transfer::absorption(a);
            let share = f64::exp(-depth) * transfer::opacity(kappa * h);
            light.iter_mut().zip([r, g, b]).for_each(|(l, c)| *l += share * c);
            depth += kappa * h;
        }
    }
    [light[0], light[1], light[2], transfer::opacity(depth)]
}

fn lively() -> [TransferPoint; 5] {
    [
        point(0.15, [0.9, 0.1, 0.1], 0.0),
        point(0.4, [0.1, 0.9, 0.2], 0.06),
        point(0.45, [0.2, 0.3, 1.0], 0.3),
        point(0.5, [0.2, 0.3, 0.9], 0.0),
        point(0.9, [1.0, 1.0, 0.8], 0.25),
    ]
}

#[test]
fn rays_through_noise_are_those_of_a_hundred_thousand_samples() {
    let points = lively();
    let mut geometries: Vec<Geometry> = sweeps().into_iter().map(Geometry::Sweep).collect();
    geometries.push(voxels([9, 7, 8]));
    let (mut worst, mut compared) = (0.0f64, 0);
    for (kind, geometry) in geometries.into_iter().enumerate() {
        let scene = scene(geometry, FLOATS, "mode = 'vr'\nslices = { pixels = 40 }");
        let volume = of_volume(&scene, noise);
        let medium = Medium::new(&points, 0.0, Absorption::of_length(1.0), 1e-13);
        for turn in 0..3 {
            let (line, long) = through(&scene, f64::from(turn) * 1.7 + 0.2);
            let light = medium.light(&segments(&line, &volume, WHOLE, [0.0, long]));
            let expected = summed(&line, &volume, &points, long, 100_000);
            for (value, expected) in light.rgba.iter().zip(expected) {
                worst = worst.max((value - expected).abs());
                assert!((value - expected).abs() < 1e-7, "geometry {kind}, {turn}: {:?} and {expected:?}", light.rgba);
            }
            compared += usize::from(light.rgba[3] > 0.1);
        }
    }
    println!("largest difference {worst:.1e} over {compared} rays");
    figure("exact-rays", &format!("{worst:.1e}"));
    assert!(compared >= 20, "{compared} rays met something");
}

/// Stage 2 of a scene, its two other stages by the f64 references: the exact picture and by samples.
fn picture(scene: &Scene, frames: &[Texels], exact: bool) -> (Texels, Effort) {
    let mut effort = Effort::default();
    let mut slots = reference::render_with(scene, frames, &mut |pass, reads, writes| {
        exact && picture::replace(scene, pass, reads, writes, &mut effort)
    });
    (slots.remove(&Slot::Picture).expect("a picture"), effort)
}

fn wobbler_scene(settings: &str) -> (Scene, Vec<Texels>) {
    let mut recording = source::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let toml = format!("picture = {{ size = [64, 64] }}\npost.floats = true\n{settings}");
    let scene = scene(recording.geometry(0), input, &toml);
    let [width, height] = scene.frame_size().map(|n| n as usize);
    recording.skip_to_volume(0).expect("volume");
    let mut frames = Vec::new();
    for _ in 0..recording.frames_per_volume() {
        frames.push(recording.next_frame().expect("frame").expect("a complete volume"));
    }
    frames.sort_by_key(|f| f.slice);
    let format = Slot::Frames.format(&scene);
    let frames = frames.iter().map(|f| Texels::decode([width, height, 1], format, &f.bytes)).collect();
    (scene, frames)
}

/// The error of the first-order rule falls in proportion to the step, and by no other power: the order that theory gives it.
#[test]
fn the_steps_of_a_real_sweep_converge_to_the_exact_picture() {
    let base = "volume = { compositing = 'riemann', entries = 4096, window = [0.1, 0.6] }\nslices = { pixels = 64 }";
    let with = |step: f64| wobbler_scene(&format!("mode = 'vr'\n{base}\nray = {{ step = {step}, early_end = 0.0 }}"));
    let (scene, frames) = with(1.0);
    let begun = std::time::Instant::now();
    let (exact, effort) = picture(&scene, &frames, true);
    println!("{effort:?} in {:?}", begun.elapsed());
    assert!(effort.estimate < 1e-9 && effort.pieces > 10_000, "{effort:?}");
    let pixel = scene.grid.pitch[0].min(scene.grid.pitch[1]);
    let shares = [0.7, 0.5, 0.35, 0.25];
    let sampled = shares.map(|share| {
        let (scene, frames) = with(share * pixel);
        picture(&scene, &frames, false).0
    });
    let order_against = |reference: &Texels| {
        let error = |n: usize| pictures(&sampled[n], reference).expect("comparable").rmse;
        let pairs: Vec<[f64; 2]> = (0..shares.len()).map(|n| [shares[n], error(n)]).collect();
        let found = fit(&pairs, Range { step: [0.1, 1.0], floor: 0.0 }).expect("four steps");
        println!("{pairs:?}: order {:.3} +- {:.3}", found.order, found.standard_error);
        found
    };
    let Fit { order, standard_error, .. } = order_against(&exact);
    figure("riemann-order", &format!("{order:.2}"));
    figure("riemann-order-error", &format!("{standard_error:.2}"));
    assert!((order - 1.0).abs() < 0.15, "order {order:.3}");
    // The fault planted: light that is one part in fifty too strong. The order is lost.
    let mut planted = exact.clone();
    planted.values.iter_mut().for_each(|v| *v *= 1.02);
    assert!((order_against(&planted).order - 1.0).abs() > 0.3);
}

/// Every mode by samples of 0.05 mm, and exactly.
#[test]
fn projections_and_surfaces_of_a_real_sweep_are_the_limits_of_their_samples() {
    for (mode, limit) in [("mip", 4e-3), ("minip", 4e-3), ("xray", 2e-3), ("sr", 0.0)] {
        let settings = format!(
            "mode = '{mode}'\nslices = {{ pixels = 48 }}\nray = {{ step = 0.05 }}\n\
             surface = {{ threshold = 0.08, edge = 3.0 }}"
        );
        let (scene, frames) = wobbler_scene(&settings);
        let (scene, frames) = (&scene, &frames);
        assert_eq!(picture::fault(scene), None, "{mode}");
        if mode != "sr" {
            let (exact, effort) = picture(scene, frames, true);
            let (sampled, _) = picture(scene, frames, false);
            let off = pictures(&sampled, &exact).expect("comparable");
            println!("{mode}: {off:?}, {effort:?}");
            assert!(off.rmse < limit && off.rmse > 1e-9 && effort.estimate < 1e-11, "{mode}: {off:?} {effort:?}");
            continue;
        }
        let map = |exact: bool| {
            let mut effort = Effort::default();
            let mut slots = reference::render_with(scene, frames, &mut |pass, reads, writes| {
                exact && picture::replace(scene, pass, reads, writes, &mut effort)
            });
            (slots.remove(&Slot::Distance).expect("a distance map"), effort)
        };
        let ((exact, effort), (sampled, _)) = (map(true), map(false));
        let off = surfaces(&sampled, &exact, f64::INFINITY).expect("comparable");
        println!("sr: {off:?}, {effort:?}");
        let spread = off.error.expect("surfaces");
        assert!(spread.count > 500 && spread.median < 2e-3, "{off:?}");
        assert!(off.false_hits < 0.01 && off.missed_hits < 0.01, "{off:?}");
    }
}

/// Exact rays end at cut faces as sampled ones do, with the same colour and at the same place; the others are integrated.
#[test]
fn cut_faces_end_exact_rays_too() {
    for (mode, slot) in [("vr", Slot::Picture), ("sr", Slot::Distance)] {
        let (scene, frames) = wobbler_scene(&format!(
            "mode = '{mode}'\nslices = {{ pixels = 48 }}\nray = {{ step = 0.5 }}\nsurface = {{ threshold = 0.08, edge = 3.0 }}\n\
             volume = {{ transfer = [{{ at = 0.2, colour = [1, 1, 1], opacity = 0 }}, {{ at = 0.4, colour = [1, 0, 0], opacity = 1 }}] }}\n\
             cap = {{ level = 0.15 }}\npost.antialias = false\nclip = [{{ at = [3, 52, -2], normal = [0, 0, 1] }}]\ncamera = {{ elevation = -60 }}"
        ));
        assert_eq!(picture::fault(&scene), None);
        let [(exact, faces), (sampled, _)] = [true, false].map(|exact| {
            let mut effort = Effort::default();
            let mut slots = reference::render_with(&scene, &frames, &mut |pass, reads, writes| {
                exact && picture::replace(&scene, pass, reads, writes, &mut effort)
            });
            (slots.remove(&slot).expect("drawn"), slots.remove(&Slot::Cap).expect("faces"))
        });
        let (mut ends, mut others) = (0, 0);
        for (n, face) in faces.values.chunks_exact(2).enumerate() {
            let [a, b] =
                [&exact, &sampled].map(|texels| &texels.values[n * texels.channels..(n + 1) * texels.channels]);
            match face[1] > 0.0 {
                true => {
                    assert_eq!(a, b, "{mode}: pixel {n}");
                    ends += 1;
                }
                false => others += usize::from(a != b),
            }
        }
        assert!(ends > 100 && others > 20, "{mode}: {ends} rays end at the face, {others} others differ");
    }
}

/// GK15 over pieces of equal length, which ignore where cells and the points of the transfer function are.
fn without_breakpoints(line: &Line, volume: &Texels, points: &[TransferPoint], long: f64, pieces: usize) -> f64 {
    let half = long / pieces as f64 / 2.0;
    let depth = (0..pieces).map(|n| {
        let values = RULE.nodes.map(|x| {
            let s = half * (2.0 * n as f64 + 1.0 + x);
            transfer::absorption(transfer::at(points, volume.trilinear(line.coordinates(s)).clamp(0.0, 1.0))[3])
        });
        RULE.integrals(&values)[0] * half
    });
    transfer::opacity(depth.sum())
}

/// The test's own fault: without breakpoints the same nodes are many orders of magnitude worse.
#[test]
fn breakpoints_at_cell_faces_and_points_are_what_makes_it_exact() {
    let scene = scene(voxels([9, 7, 8]), FLOATS, "mode = 'vr'");
    let volume = of_volume(&scene, noise);
    let points = lively();
    let (mut with, mut without) = (0.0f64, 0.0f64);
    for turn in 0..8 {
        let (line, long) = through(&scene, f64::from(turn) * 0.9 + 0.1);
        let all = segments(&line, &volume, WHOLE, [0.0, long]);
        let light = Medium::new(&points, 0.0, Absorption::of_length(1.0), 1e-12).light(&all);
        let exact = Medium::new(&points, 0.0, Absorption::of_length(1.0), 1e-16).light(&all);
        with = with.max((light.rgba[3] - exact.rgba[3]).abs());
        let equal = without_breakpoints(&line, &volume, &points, long, light.pieces as usize);
        without = without.max((equal - exact.rgba[3]).abs());
        assert!(light.estimate >= (light.rgba[3] - exact.rgba[3]).abs(), "{light:?}");
    }
    println!("with breakpoints {with:.1e}, without {without:.1e}");
    assert!(with < 1e-13 && without > 1e-6, "{with:.1e} and {without:.1e}");
}

/// The spike of an opacity from 0.499 to 0.501: a ray through a ramp meets it, however narrow.
#[test]
fn a_narrow_spike_of_opacity_is_met() {
    let scene = cube();
    let volume = of_volume(&scene, |[x, ..]| x as f64 / 7.0);
    let line = line(&scene, [0.0, 3.0, 4.0], [1.0, 0.0, 0.0]);
    for half in [1e-3, 1e-6, 1e-9] {
        let top = 0.9;
        let points = [point(0.5 - half, [1.0; 3], 0.0), point(0.5, [1.0; 3], top), point(0.5 + half, [1.0; 3], 0.0)];
        let light = Medium::new(&points, 0.0, Absorption::of_length(1e-3), 1e-14).light(&segments(
            &line,
            &volume,
            WHOLE,
            [0.0, 7.0],
        ));
        let depth = 7e3 * 2.0 * half * (1.0 + (1.0 - top) * f64::ln_1p(-top) / top);
        let off = (light.rgba[3] / transfer::opacity(depth) - 1.0).abs();
        assert!(off < 1e-15 / half + 1e-12, "{half}: {off:.1e}");
    }
}

#[test]
fn breakpoints_of_a_moving_motor_are_all_crossings_of_slices() {
    let mut crossings = 0;
    for probe in sweeps() {
        let scene = scene(Geometry::Sweep(probe), FLOATS, "mode = 'vr'\nslices = { pixels = 40 }");
        for turn in 0..6 {
            let (line, long) = through(&scene, f64::from(turn) * 1.1);
            let places = line.breakpoints([0.0, long]);
            for pair in places.windows(2) {
                let inner = [1e-6, 0.25, 0.5, 0.75, 1.0 - 1e-6].map(|x| pair[0] + (pair[1] - pair[0]) * x);
                let cells = inner.map(|s| line.coordinates(s).map(f64::floor));
                let inside = inner.map(|s| line.is_inside(s));
                crossings += usize::from(inside[2]);
                if pair[1] - pair[0] < 1e-7 {
                    continue;
                }
                assert!(inside.iter().all(|i| *i == inside[2]), "{pair:?}: a border between breakpoints");
                assert!(!inside[2] || cells.iter().all(|c| *c == cells[2]), "{pair:?}: {cells:?}");
            }
        }
    }
    assert!(crossings > 1000, "{crossings}");
}
