//! The motor moves while a frame is acquired: a fixed object must not move between forward and backward sweeps.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::probe::{Advance, Axis, Geometry, Indices, Probe};
use echolume::low_level::scene::Scene;
use glam::DVec3;

/// Both directions at a share of the pitch, the same with a non-uniform table, and both mixed as in rolling updates.
fn probes() -> Vec<(&'static str, Probe)> {
    let pitch = wobbler().slices.pitch();
    let with = |advance, probe: Probe| Probe { advance, ..probe };
    let each = |sign: f64| (0..9).map(|k| sign * pitch * (0.5 + 0.04 * k as f64)).collect::<Vec<_>>();
    let mixed = (0..9).map(|k| if k < 5 { 0.4 * pitch } else { -0.4 * pitch }).collect();
    vec![
        ("forth", with(Advance::Same(0.8 * pitch), wobbler())),
        ("back", with(Advance::Same(-0.8 * pitch), wobbler())),
        ("uneven, forth", with(Advance::Each(each(1.0)), uneven(wobbler()))),
        ("uneven, back", with(Advance::Each(each(-1.0)), uneven(wobbler()))),
        ("mixed", with(Advance::Each(mixed), wobbler())),
        ("linear array, back", with(Advance::Same(-1.2), linear())),
    ]
}

/// Linear interpolation in (sample, line, slice) reproduces a field linear in range, line angle and slice position.
#[test]
fn a_linear_field_is_reproduced_in_both_directions_to_1e_12() {
    for (name, probe) in probes() {
        probe.check().unwrap();
        let field = |sample: f64, line: f64, position: f64| {
            0.3 + 0.004 * (probe.first_range() + sample * probe.sample_pitch)
                + 0.21 * probe.lines.at(line)
                + 0.13 * position
        };
        let stored = |i: f64, j: f64, k: f64| field(i, j, probe.slice_position(j, k));
        let mut noise = Noise(7);
        let mut worst = 0.0f64;
        for _ in 0..5000 {
            let at = Indices {
                sample: noise.range(0.0, (probe.samples - 1) as f64),
                line: noise.range(0.0, (probe.lines.len() - 1) as f64),
                slice: noise.range(0.0, (probe.slices.len() - 1) as f64),
            };
            let place = probe.to_space(at);
            let (_, _, position) = probe.inverse_sweep_map(place);
            let found = probe.to_indices(place);
            let mut sum = 0.0;
            for corner in 0..8u32 {
                let mut weight = 1.0;
                let axis = |n: u32, value: f64, count: usize, weight: &mut f64| {
                    let low = value.floor().clamp(0.0, (count - 2) as f64);
                    let share = value - low;
                    *weight *= if corner >> n & 1 == 1 { share } else { 1.0 - share };
                    low + f64::from(corner >> n & 1)
                };
                let i = axis(0, found.sample, probe.samples, &mut weight);
                let j = axis(1, found.line, probe.lines.len(), &mut weight);
                let k = axis(2, found.slice, probe.slices.len(), &mut weight);
                sum += weight * stored(i, j, k);
            }
            worst = worst.max((sum - field(found.sample, found.line, position)).abs());
        }
        assert!(worst < 1e-12, "{name}: off by {worst:e}");
    }
}

/// Indices to space and back, at frames and between them.
#[test]
fn space_and_indices_are_each_other_s_inverse() {
    for (name, probe) in probes() {
        let mut noise = Noise(11);
        for _ in 0..2000 {
            let at = Indices {
                sample: noise.range(0.0, (probe.samples - 1) as f64),
                line: noise.range(0.0, (probe.lines.len() - 1) as f64),
                slice: noise.range(0.0, (probe.slices.len() - 1) as f64),
            };
            let back = probe.to_indices(probe.to_space(at));
            let off =
                (back.sample - at.sample).abs().max((back.line - at.line).abs()).max((back.slice - at.slice).abs());
            assert!(off < 1e-9, "{name}: {at:?} came back as {back:?}");
        }
    }
}

/// A field of only the slice position through all GPU stages: frames, scan conversion, lookup tables, sampling. One opaque
/// sample a ray shows its value, in windows narrow enough for R16F to resolve 1e-5.
#[test]
fn the_gpu_reproduces_a_linear_field_in_both_directions() {
    let device = Device::new();
    let mut largest = 0.0f64;
    for (name, probe) in probes() {
        let (low, high) = probe.slice_bounds();
        let value = |position: f64| (position - low) / (high - low);
        let worst = worst_of(&device, &probe, &probe, &value);
        // Scan conversion of the motion's share, t(x, y) on pixels of 0.2 mm, is off by 3e-6; f32 by 1e-6; R16F by 8e-6.
        println!("{name}: off by {worst:.1e} of the sweep");
        assert!(worst < 5e-5, "{name}: off by {worst:e}");
        largest = largest.max(worst);
        if name == "forth" {
            let still = Probe { advance: Advance::None, ..probe.clone() };
            assert!(worst_of(&device, &probe, &still, &value) > 1e-2, "an uncorrected sweep went unnoticed");
            let reversed = Probe { advance: Advance::Same(-0.8 * probe.slices.pitch()), ..probe.clone() };
            assert!(worst_of(&device, &probe, &reversed, &value) > 1e-2, "a reversed sweep went unnoticed");
        }
    }
    device.figure("linear-field", &format!("{largest:.1e}"));
}

/// Largest difference over a picture between the field and a rendering of frames acquired as `real` with the geometry `told`.
fn worst_of(device: &Device, real: &Probe, told: &Probe, value: &dyn Fn(f64) -> f64) -> f64 {
    const WINDOWS: usize = 64;
    let scene_in = |window: usize| {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [24, 24] }}\nray = {{ step = 0.5, sampling = 'exact' }}\n\
             slices = {{ pixels = 280, format = 'r32f' }}\nregion = {{ depth = [25.0, 25.5] }}\ncamera = {{ zoom = 1.8 }}\n\
             [volume]\nwindow = [{}, {}]\ntransfer = [{{ at = 0.0, colour = [0.0, 0.0, 0.0], opacity = 1.0 }}, \
             {{ at = 1.0, colour = [1.0, 0.0, 0.0], opacity = 1.0 }}]",
            window as f64 / WINDOWS as f64,
            (window + 1) as f64 / WINDOWS as f64,
        );
        scene(Geometry::Sweep(told.clone()), FLOATS, &toml)
    };
    let first = scene_in(0);
    let frames = frames(&first, |[_, j, k]| value(real.slice_position(j as f64, k as f64)));
    let mut renderer = rendered(device, first.clone(), &frames);
    let mut worst = 0.0f64;
    let mut checked = 0;
    for window in 0..WINDOWS {
        renderer.change(scene_in(window)).expect("change");
        renderer.picture().expect("picture");
        let picture = renderer.read(Slot::Picture).expect("read").expect("there");
        for y in 0..24 {
            for x in 0..24 {
                let Some(expected) = seen(&first, told, value, x, y) else { continue };
                let within = expected * WINDOWS as f64 - window as f64;
                let got = picture.get([x, y, 0]);
                if (0.05..0.95).contains(&within) && got[3] > 0.99 {
                    worst = worst.max((got[0] - within).abs() / WINDOWS as f64);
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 100, "rays that meet the sweep: {checked}");
    worst
}

/// The field at the only sample of a pixel's ray.
fn seen(scene: &Scene, probe: &Probe, value: &dyn Fn(f64) -> f64, x: usize, y: usize) -> Option<f64> {
    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    assert!((direction - DVec3::Y).length() < 1e-9, "the view is along the depth axis");
    let place = origin + direction * ((scene.low.y + scene.high.y) / 2.0 - origin.y);
    let at = probe.to_indices(place);
    let inside = |i: f64, n: usize| i >= 0.01 && i <= n as f64 - 1.01;
    let (_, _, position) = probe.inverse_sweep_map(place);
    (inside(at.line, probe.lines.len()) && inside(at.slice, probe.slices.len()) && inside(at.sample, probe.samples))
        .then(|| value(position))
}

/// A fixed ball, swept in both directions: with the correction its surface moves at most a fifth as far as without.
#[test]
fn a_ball_swept_both_ways_does_not_move() {
    let device = Device::new();
    let pitch = 0.03;
    let ball = DVec3::new(2.0, 50.0, 1.0);
    let probe = |advance: f64| Probe {
        slices: Axis::centred(pitch, 25),
        lines: Axis::centred(0.012, 96),
        advance: Advance::Same(advance * pitch),
        ..wobbler()
    };
    let toml =
        "mode = 'sr'\npicture = { size = [48, 48] }\nslices = { pixels = 300 }\ncamera = { zoom = 2.0, elevation = 30 }
                ray = { step = 0.3 }\nsurface = { threshold = 0.1, edge = 1.2 }";
    let surface = |advance: f64, told: f64| -> (Scene, Texels) {
        let acquired = scene(Geometry::Sweep(probe(advance)), FLOATS, toml);
        let frames = body_frames(&acquired, |p| ((12.0 - p.distance(ball)) / 8.0 + 0.5).clamp(0.0, 1.0));
        let told = scene(Geometry::Sweep(probe(told)), FLOATS, toml);
        let mut renderer = rendered(&device, told.clone(), &frames);
        renderer.picture().expect("picture");
        (told, renderer.read(Slot::Distance).expect("read").expect("there"))
    };
    // Compared by position in space: the boxes of the two sweeps, and so the pictures, differ by the travel of the motor.
    let apart = |a: (Scene, Texels), b: (Scene, Texels)| {
        let off_sphere = |(scene, distances): &(Scene, Texels)| {
            let mut heights = Vec::new();
            for y in 0..48 {
                for x in 0..48 {
                    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
                    let along = (ball - origin).dot(direction);
                    let limb = (origin + direction * along).distance(ball);
                    let distance = distances.one(x, y, 0);
                    if limb < 7.0 && is_hit(distance) {
                        heights.push((origin + direction * distance - ball, distance));
                    }
                }
            }
            heights
        };
        let centre = |heights: &[(DVec3, f64)]| {
            // The centre of the sphere in elevation, by least squares of |p|^2 = r^2 + 2 p.c over the cap.
            let n = heights.len() as f64;
            assert!(n > 100.0, "{n} rays hit");
            let mean = |f: &dyn Fn(&DVec3) -> f64| heights.iter().map(|(p, _)| f(p)).sum::<f64>() / n;
            let (mz, mq) = (mean(&|p| p.z), mean(&|p| p.length_squared()));
            let cross = mean(&|p| (p.z - mz) * (p.length_squared() - mq));
            cross / mean(&|p| (p.z - mz) * (p.z - mz)) / 2.0
        };
        (centre(&off_sphere(&a)) - centre(&off_sphere(&b))).abs()
    };
    let corrected = apart(surface(0.9, 0.9), surface(-0.9, -0.9));
    let uncorrected = apart(surface(0.9, 0.0), surface(-0.9, 0.0));
    let reversed = apart(surface(0.9, -0.9), surface(-0.9, 0.9));
    println!("moved in elevation by {corrected:.4} mm corrected, {uncorrected:.4} uncorrected, {reversed:.4} reversed");
    assert!(uncorrected > 0.5, "a pitch is 1.3 mm there, half the lines fire by the middle: {uncorrected}");
    assert!(corrected < uncorrected / 5.0, "{corrected} of {uncorrected}");
    assert!(reversed > uncorrected);
    device.figure("ball-corrected", &format!("{corrected:.3}"));
    device.figure("ball-uncorrected", &format!("{uncorrected:.2}"));
    device.figure("ball-reversed", &format!("{reversed:.2}"));
}

/// The ball of the phantom, swept in both directions with a moving motor: the two distance maps, in one view.
#[test]
fn the_phantom_does_not_move_between_forward_and_backward_sweeps() {
    use echolume::low_level::source::phantom::{Body, Phantom, PhantomOptions as Made, Speckle, Truth};
    let device = Device::new();
    let made = Made {
        body: Body::Sphere,
        volumes: 2,
        both_ways: true,
        speckle: Speckle::None,
        speed_ratio: 0.9,
        ..Made::default()
    };
    let phantom = Phantom::new(made).expect("phantom");
    let Truth::Sphere { centre, radius, .. } = phantom.truth() else { panic!("a sphere") };
    let depth = centre.y - phantom.probe(0).array_radius();
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [64, 64] }}\nray = {{ step = 0.25 }}\nsurface = {{ threshold = 0.1, edge = 1 }}\n\
         slices = {{ pixels = 400, smooth = {{ lateral = 0.6, depth = 0.6, elevation = 0.6 }} }}\n\
         region = {{ lateral = [{}, {}], depth = [{}, {}], elevation = [{}, {}] }}\ncamera = {{ elevation = 25 }}",
        centre.x - 0.8 * radius,
        centre.x + 0.8 * radius,
        depth - 1.3 * radius,
        depth,
        centre.z - 0.8 * radius,
        centre.z + 0.8 * radius,
    );
    // The volume of a sweep, drawn with the advance of that sweep times `told`.
    let surface = |volume: usize, told: f64| -> Texels {
        let Advance::Same(advance) = phantom.probe(volume).advance else { panic!("even") };
        let probe = Probe { advance: Advance::Same(told * advance), ..phantom.probe(volume) };
        let mut renderer =
            Renderer::new(&device, scene(Geometry::Sweep(probe), BYTES, &toml), &RendererOptions::default())
                .expect("renderer");
        for frame in phantom.volume(volume) {
            renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
        }
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        renderer.read(Slot::Distance).expect("read").expect("there")
    };
    let apart = |told: f64| {
        let (forth, back) = (surface(0, told), surface(1, told));
        let both = forth.values.iter().zip(&back.values).filter(|(a, b)| is_hit(**a) && is_hit(**b));
        let differences: Vec<f64> = both.map(|(a, b)| (a - b).abs()).collect();
        assert!(differences.len() > 1000, "{} rays hit both", differences.len());
        differences.iter().sum::<f64>() / differences.len() as f64
    };
    let (corrected, uncorrected, reversed) = (apart(1.0), apart(0.0), apart(-1.0));
    println!("phantom: {corrected:.4} mm apart corrected, {uncorrected:.4} uncorrected, {reversed:.4} reversed");
    assert!(corrected < uncorrected / 5.0, "{corrected} of {uncorrected}");
    assert!(reversed > uncorrected, "{reversed} of {uncorrected}");
    device.figure("phantom-corrected", &format!("{corrected:.2}"));
    device.figure("phantom-uncorrected", &format!("{uncorrected:.2}"));
    device.figure("phantom-reversed", &format!("{reversed:.2}"));
}
