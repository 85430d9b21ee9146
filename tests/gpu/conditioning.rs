//! Line conditioning on lines with an analytic answer: the gain curve, straight lines from exponential decays, ramps and wires
//! that decimation does not move.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::{Array, Axis, Geometry, Motion, Probe};
use echolume::low_level::scene::Scene;

/// One frame of a still linear array: slices equal the lines, so that depths can be read directly.
fn probe(samples: usize, lines: usize) -> Probe {
    Probe {
        array: Array::Linear,
        lines: Axis::centred(1.0, lines),
        motion: Motion::Still { thickness: 1.0 },
        slices: Axis::centred(1.0, 1),
        start_depth: 4.0,
        sample_pitch: 0.1,
        samples,
        ..wobbler()
    }
}

fn lines(samples: usize, conditioning: &str) -> Scene {
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [2, 2] }}\nslices = {{ format = 'r32f', pixels = 901 }}\n\
         conditioning = {{ {conditioning} }}"
    );
    scene(Geometry::Sweep(probe(samples, 5)), FLOATS, &toml)
}

/// A slot after one frame whose sample i on line j is f(i, j).
fn conditioned(device: &Device, scene: &Scene, slot: Slot, f: impl Fn(f64, usize) -> f64) -> Texels {
    let frames = frames(scene, |[i, j, _]| f(i as f64, j));
    let mut renderer = rendered(device, scene.clone(), &frames);
    renderer.read(slot).expect("read").expect("there")
}

#[test]
fn a_constant_frame_shows_the_gain_curve() {
    let device = Device::new();
    let tgc = "tgc = [{ depth = 10.0, gain = -24.0 }, { depth = 20.0, gain = -6.0 }, { depth = 40.0, gain = -12.0 }]";
    // Of envelopes by the factor, of compressed samples by their share of 60 dB; at constant envelopes the two agree.
    let curve = |i: usize| match 4.0 + 0.1 * i as f64 {
        d if d < 10.0 => -24.0,
        d if d < 20.0 => -24.0 + 1.8 * (d - 10.0),
        d if d < 40.0 => -6.0 - 0.3 * (d - 20.0),
        _ => -12.0,
    };
    for (more, constant, start) in
        [("dynamic_range = 60", 1.0, 1.0), ("compressed_range = 60", 0.9, 0.9), ("dynamic_range = 50", 0.1, 0.6)]
    {
        let scene = lines(500, &format!("{tgc}, {more}"));
        let got = conditioned(&device, &scene, Slot::Conditioned, |_, _| constant);
        assert_eq!(got.size, [500, 5, 1]);
        let range = if more.ends_with("50") { 50.0 } else { 60.0 };
        for i in 0..500 {
            let expected = start + curve(i) / range;
            assert!((got.one(i, 3, 0) - expected).abs() < 2e-6, "{more}, sample {i}: {}", got.one(i, 3, 0));
        }
    }
}

#[test]
fn an_exponential_decay_becomes_a_straight_line_that_ends_at_the_dynamic_range() {
    let device = Device::new();
    for range in [20.0, 45.0, 60.0, 120.0] {
        let scene = lines(900, &format!("dynamic_range = {range}"));
        // 0.1 dB a sample, and the same 30 dB lower.
        let got = conditioned(&device, &scene, Slot::Conditioned, |i, j| {
            10f64.powf((-0.1 * i - if j == 2 { 30.0 } else { 0.0 }) / 20.0)
        });
        for i in 0..900 {
            for (j, lower) in [(1, 0.0), (2, 30.0)] {
                let expected = (1.0 - (0.1 * i as f64 + lower) / range).max(0.0);
                assert!((got.one(i, j, 0) - expected).abs() < 3e-6, "{range} dB, sample {i}: {}", got.one(i, j, 0));
            }
        }
    }
}

#[test]
fn zero_becomes_black_and_the_mapping_is_monotonic() {
    let device = Device::new();
    let scene = lines(400, "dynamic_range = 200");
    // From below the smallest denormal to full scale, zeros and negative samples on other lines.
    let got = conditioned(&device, &scene, Slot::Conditioned, |i, j| match j {
        0 => 10f64.powf(-46.0 + 46.0 * i / 399.0),
        1 => 0.0,
        2 => 1e-40,
        3 => -0.5,
        _ => i / 399.0,
    });
    assert!(got.values.iter().all(|v| (0.0..=1.0).contains(v)), "a sample leaves 0..1 or is no number");
    for j in [0, 4] {
        assert!((1..400).all(|i| got.one(i, j, 0) >= got.one(i - 1, j, 0)), "line {j} falls");
    }
    assert_eq!((got.one(0, 0, 0), got.one(399, 0, 0)), (0.0, 1.0));
    for j in [1, 2, 3] {
        assert!((0..400).all(|i| got.one(i, j, 0) == 0.0), "line {j} is not black");
    }
    // With a low pass over all of it, too.
    let got = conditioned(&device, &lines(400, "dynamic_range = 60, samples = 50"), Slot::Conditioned, |_, _| 0.0);
    assert!(got.values.iter().all(|v| *v == 0.0));
}

#[test]
fn a_decimated_ramp_is_the_ramp() {
    let device = Device::new();
    for (samples, most, factor) in [(500, 512, 1), (900, 512, 2), (3640, 512, 8), (777, 60, 13)] {
        let scene = lines(samples, &format!("samples = {most}, low_pass = {}", f64::from(factor) / 2.0));
        assert_eq!(scene.decimation(), factor);
        let got = conditioned(&device, &scene, Slot::Conditioned, |i, j| (i + 10.0 * j as f64) / (samples + 50) as f64);
        let reach = 2 * factor as usize; // three deviations
        for x in 0..got.size[0] {
            let i = x * factor as usize;
            let expected = (i + 20) as f64 / (samples + 50) as f64;
            let inside = i >= reach && i + reach < samples;
            assert!(!inside || (got.one(x, 2, 0) - expected).abs() < 1e-6, "{samples} by {factor}, sample {x}");
        }
    }
}

/// Depth of the energy-weighted centroid of the volume's middle column, mm.
fn centroid(scene: &Scene, volume: &Texels) -> f64 {
    let column = volume.size[0] / 2;
    let (mut sum, mut weight) = (0.0, 0.0);
    for row in 0..volume.size[1] {
        let v = volume.one(column, row, 0);
        sum += v * scene.grid.place(column as f64, row as f64).1;
        weight += v;
    }
    sum / weight
}

#[test]
fn a_wire_stays_where_it_is() {
    let device = Device::new();
    let (pitch, mut worst) = (0.1, 0.0f64);
    for most in [900, 450, 225, 113] {
        let scene = lines(900, &format!("samples = {most}"));
        for place in [400.0, 401.3, 402.5, 403.9] {
            // As long as the echo of a real wire: a deviation of 4 samples.
            let wire = |i: f64, _| (-0.5 * ((i - place) / 4.0).powi(2)).exp();
            let volume = conditioned(&device, &scene, Slot::Volume, wire);
            let off = (centroid(&scene, &volume) - (4.0 + pitch * place)) / pitch;
            worst = worst.max(off.abs());
            assert!(off.abs() < 0.05, "factor {}, at {place}: off by {off} samples", scene.decimation());
            // The usual mistake, a lattice centred on the averaged samples, would be detected.
            let mistaken = f64::from(scene.decimation() - 1) / 2.0;
            assert!(scene.decimation() == 1 || (off - mistaken).abs() > 0.4);
        }
    }
    println!("off by at most {worst:.5} samples");
}

/// The simulator's wires under the same low pass with half the samples and with all: decimation moves none of them along their
/// lines. (An eighth of a sample remains: their echoes are compressed and not symmetric, and energies between samples twice as
/// far apart differ. A lattice centred on the two averaged samples would move them by half a sample, 0.125 mm.)
#[test]
fn the_wobblers_wires_stay_where_they_are() {
    use crate::recordings::{centroid, wobbler_volume};
    let device = Device::new();
    let wires = [[0.0, 0.0, 60.0], [20.0, 0.0, 60.0], [-20.0, 0.0, 60.0], [0.0, 12.0, 65.0], [0.0, -12.0, 65.0]];
    let found = |conditioning: &str| {
        let more = format!("conditioning = {{ {conditioning} }}");
        let (probe, scene, volume) = wobbler_volume(&device, "wobbler-4dc7/sweep.mha", &more);
        let truth = |[x, z, depth]: [f64; 3]| glam::DVec3::new(x, depth + probe.axis_depth(), z);
        wires.map(|wire| centroid(&probe, &scene, &volume, truth(wire)))
    };
    let (all, half) = (found("low_pass = 1.0"), found("samples = 200"));
    for (all, half) in all.iter().zip(&half) {
        let deeper = half.truncate().length() - all.truncate().length();
        println!("wire at {all:.2}: deeper by {deeper:.4} mm");
        assert!(deeper.abs() < 0.04, "decimation moved the wire at {all:.2} by {deeper} mm");
    }
}

#[test]
fn decimation_removes_aliases_and_keeps_low_frequencies() {
    let device = Device::new();
    let factor = 8.0;
    let amplitude = |period: f64| {
        let scene = lines(3640, "samples = 455");
        let wave = |i: f64, _| 0.5 + 0.4 * (std::f64::consts::TAU * i / period).cos();
        let got = conditioned(&device, &scene, Slot::Conditioned, wave);
        let inside = (20..got.size[0] - 20).map(|x| got.one(x, 2, 0));
        let (low, high) = inside.fold((1.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        ((high + low - 1.0).abs() + high - low) / 0.8
    };
    // A wave of M samples falls onto a constant: 43 dB down, the window's cut at three deviations costs some of that.
    assert!(amplitude(factor) < 0.012, "{}", amplitude(factor));
    assert!(amplitude(4.0 * factor) > 0.7, "{}", amplitude(4.0 * factor));
}

#[test]
fn conditioning_is_planned_only_where_it_changes_something() {
    let conditions = |scene: &Scene| Plan::new(scene).steps.iter().any(|s| s.pass.name == "condition");
    for (samples, asked, is_there) in [
        (400, "", false),
        (400, "samples = 512", false),
        (400, "low_pass = 0.0", false),
        (400, "samples = 399", true),
        (400, "dynamic_range = 60", true),
        (400, "low_pass = 1.5", true),
        (400, "tgc = [{ depth = 0, gain = 0 }]", true),
    ] {
        let scene = lines(samples, asked);
        assert_eq!(conditions(&scene), is_there, "{asked}");
        assert_eq!(Plan::new(&scene).slots.contains(&Slot::Conditioned), is_there, "{asked}");
        assert_eq!(Plan::new(&scene).slots.contains(&Slot::Tgc), asked.contains("tgc"), "{asked}");
    }
    // A limit of lines has no effect where there are none; conditioning is refused there.
    let on_cartesian = |conditioning: &str| {
        let settings = settings(&format!("conditioning = {{ {conditioning} }}"));
        Scene::new(cartesian([700, 8, 3]), BYTES, settings)
    };
    assert!(!conditions(&on_cartesian("samples = 512").expect("a limit")));
    for (asked, field) in [
        ("dynamic_range = 60", "conditioning.dynamic_range"),
        ("low_pass = 1", "conditioning.low_pass"),
        ("tgc = [{ depth = 0, gain = 3 }]", "conditioning.tgc"),
    ] {
        let error = on_cartesian(asked).expect_err(asked).to_string();
        assert!(error.contains(field) && error.contains("Cartesian"), "{error}");
    }
}

#[test]
fn impossible_conditioning_is_refused_by_name() {
    for (asked, field, fault) in [
        ("dynamic_range = 0", "conditioning.dynamic_range", "1..=200"),
        ("dynamic_range = nan", "conditioning.dynamic_range", "1..=200"),
        ("compressed_range = 0", "conditioning.compressed_range", "1..=200"),
        ("low_pass = 33", "conditioning.low_pass", "0..=32"),
        ("low_pass = -1", "conditioning.low_pass", "0..=32"),
        ("samples = 1", "conditioning.samples", "2..=65536"),
        ("samples = 20", "conditioning.samples", "at least 157"),
        ("tgc = [{ depth = 5, gain = 1 }, { depth = 5, gain = 2 }]", "conditioning.tgc", "rise"),
        ("tgc = [{ depth = nan, gain = 1 }]", "conditioning.tgc", "0..="),
        ("tgc = [{ depth = 1, gain = inf }]", "conditioning.tgc", "-120..=120"),
    ] {
        let settings = settings(&format!("conditioning = {{ {asked} }}"));
        let refused = Scene::new(Geometry::Sweep(probe(10_000, 4)), BYTES, settings).expect_err(asked).to_string();
        assert!(refused.contains(field) && refused.contains(fault), "{asked}: {refused}");
    }
}

#[test]
fn another_curve_or_factor_sends_the_frames_again_and_gives_the_picture_of_a_fresh_renderer() {
    let device = Device::new();
    let with = |conditioning: &str| {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [24, 24] }}\nslices = {{ pixels = 40 }}\nconditioning = {{ {conditioning} }}"
        );
        scene(Geometry::Sweep(wobbler()), BYTES, &toml)
    };
    let frames = body_frames(&with(""), |p| 0.5 + 0.4 * (0.7 * p.y).sin() * (0.3 * p.x).cos());
    let mut renderer = rendered(&device, with("tgc = [{ depth = 0, gain = 1 }]"), &frames);
    renderer.picture().expect("picture");
    for (conditioning, rerun) in [
        ("tgc = [{ depth = 0, gain = 1 }]", Rerun::Steps { steps: vec![], slots: vec![] }),
        ("tgc = [{ depth = 0, gain = -9 }]", Rerun::Frames),
        ("tgc = [{ depth = 0, gain = -9 }], compressed_range = 30", Rerun::Frames),
        ("tgc = [{ depth = 0, gain = -9 }], low_pass = 1.5", Rerun::Frames),
        ("tgc = [{ depth = 0, gain = -9 }], low_pass = 1.5, samples = 30", Rerun::Everything),
        ("samples = 30", Rerun::Everything),
        ("", Rerun::Everything),
    ] {
        assert_eq!(renderer.change(with(conditioning)).expect("change"), rerun, "{conditioning}");
        send(&mut renderer, &frames, 0);
        let fresh = rendered(&device, with(conditioning), &frames).picture().expect("picture");
        assert_eq!(renderer.picture().expect("picture"), fresh, "{conditioning}");
    }
}

/// Lines of a real probe: 3640 samples become 455 with the preset of the thesis, and the picture looks the same.
#[test]
fn real_lines_of_3640_samples_keep_their_picture() {
    use echolume::low_level::source::Recording;
    let device = Device::new();
    let volume = |conditioning: &str| {
        let mut recording = Recording::open(&data("ultrasonix-curvilinear/brightness.mha"), None).expect("recording");
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [2, 2] }}\nslices = {{ pixels = 512 }}\nconditioning = {{ {conditioning} }}"
        );
        let input = echolume::low_level::scene::Input { stored: recording.stored_type(), range: recording.range() };
        let scene = scene(recording.geometry(0), input, &toml);
        let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
        let frame = recording.next_frame().expect("frame").expect("there");
        renderer.frame(0, &frame.bytes, 0).expect("frame");
        (scene.line_lattice(), renderer.read(Slot::Volume).expect("read").expect("there"))
    };
    let ((all, whole), (few, decimated)) = (volume(""), volume("samples = 512"));
    assert_eq!((all, few), ([3640, 96], [455, 96]));
    let differences: Vec<f64> = whole.values.iter().zip(&decimated.values).map(|(a, b)| (a - b).abs()).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    println!(
        "mean difference {mean:.5}, of a mean of {:.4}",
        whole.values.iter().sum::<f64>() / whole.values.len() as f64
    );
    assert!(mean < 0.02 && mean > 0.0, "{mean}");
}
