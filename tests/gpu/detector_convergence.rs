//! The surface detector converges with the step of the rays: its edges are lengths, so that a finer step finds the same surface more
//! accurately. A detector that compares a fixed number of samples finds another edge at every step, and none at a fine one.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use crate::detector::columns;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::Recording;

/// Length of the preset's edge, mm.
const EDGE: f64 = 1.6;

/// The distance map of the simulated head with a step of the edge divided by `parts`, before any filter of the map.
fn head(device: &Device, parts: f64) -> Texels {
    let mut recording = Recording::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let settings = settings(&format!(
        "mode = 'sr'\npicture = {{ size = [64, 64] }}\nslices = {{ smooth = {{ lateral = 1.4, depth = 0.8, elevation = 1.4 }} }}
         region = {{ lateral = [-26, 34], depth = [24, 56], elevation = [-28, 22] }}
         camera = {{ azimuth = 10, elevation = -10, zoom = 1.25, target = [3, 50, -2] }}
         surface = {{ window = [0.5, 1.0], threshold = 0.08, edge = {EDGE} }}\nray = {{ step = {}, sampling = 'exact' }}",
        EDGE / parts
    ));
    let scene = Scene::new(recording.geometry(0), input, settings).expect("scene");
    assert!((scene.ring.step * parts - EDGE).abs() < 1e-9, "{:?}", scene.ring);
    let mut renderer = Renderer::new(device, scene, &RendererOptions::default()).expect("renderer");
    while let Some(frame) = recording.next_frame().expect("frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    renderer.picture().expect("picture");
    renderer.read(Slot::Distance).expect("read").expect("there")
}

/// Shares of all rays, and distances in mm over the rays that find the same surface.
#[derive(Debug)]
struct Difference {
    hits: f64,
    /// Hit by only one of the two.
    lost_or_gained: f64,
    /// More than half an edge apart: another surface.
    jumped: f64,
    median: f64,
    p95: f64,
}

fn difference(map: &Texels, reference: &Texels) -> Difference {
    let count = map.values.len() as f64;
    let (mut lost, mut jumped, mut apart) = (0, 0, Vec::new());
    for (a, b) in map.values.iter().zip(&reference.values) {
        match (is_hit(*a), is_hit(*b)) {
            (true, true) if (a - b).abs() > EDGE / 2.0 => jumped += 1,
            (true, true) => apart.push((a - b).abs()),
            (false, false) => {}
            _ => lost += 1,
        }
    }
    apart.sort_by(f64::total_cmp);
    Difference {
        hits: map.values.iter().filter(|d| is_hit(**d)).count() as f64 / count,
        lost_or_gained: f64::from(lost) / count,
        jumped: f64::from(jumped) / count,
        median: apart[apart.len() / 2],
        p95: apart[apart.len() * 95 / 100],
    }
}

#[test]
fn a_finer_step_finds_the_same_surface_more_accurately() {
    let device = Device::new();
    let reference = head(&device, 128.0);
    let steps = [4.0, 8.0, 16.0, 32.0, 64.0].map(|parts| {
        let found = difference(&head(&device, parts), &reference);
        println!("step of 1/{parts} edge: {found:.5?}");
        // A surface that is barely above the threshold may go either way.
        let limit = if parts == 4.0 { 0.02 } else { 0.01 };
        assert!(found.hits > 0.5 && found.lost_or_gained <= limit && found.jumped <= limit, "1/{parts}: {found:?}");
        // A ray that grazes the head has a wider edge, and places it less exactly.
        assert!(found.p95 <= 0.02 * EDGE && found.p95 > found.median, "1/{parts}: {found:?}");
        found
    });
    // Second order in the step, until the difference to the reference is as small as that of the reference.
    let order = (steps[0].median / steps[2].median).log2() / 2.0;
    println!("order {order:.2}");
    assert!((1.5..=2.5).contains(&order), "order {order} of {steps:?}");
    let [coarse, finer @ ..] = &steps;
    let largest = |of: fn(&Difference) -> f64| finer.iter().map(of).fold(0.0, f64::max);
    for (name, share) in [
        ("coarse-lost", coarse.lost_or_gained),
        ("coarse-jumped", coarse.jumped),
        ("finer-lost", largest(|found| found.lost_or_gained)),
        ("finer-jumped", largest(|found| found.jumped)),
    ] {
        device.figure(name, &format!("{:.2}", 100.0 * share));
    }
    device.figure("coarse-median", &format!("{:.1}", 1000.0 * coarse.median));
    device.figure("finer-median", &format!("{:.1}", 1000.0 * largest(|found| found.median)));
    device.figure("step-order", &format!("{order:.1}"));
}

/// Prevents a place that depends on the width of an edge: along the ray it grows with the angle of the wall.
#[test]
fn oblique_walls_are_where_they_are_up_to_75_degrees() {
    let device = Device::new();
    let (voxel, edge) = (0.5, 2.0);
    let geometry = Geometry::Cartesian(Grid { size: [96, 96, 9], spacing: [voxel; 3], origin: [-24.0, 0.0, -2.0] });
    let mut largest = 0.0f64;
    for (degrees, deviation) in
        [(0.0, 1.0), (30.0, 1.0), (45.0, 1.0), (60.0, 1.0), (75.0, 1.0), (60.0, 1.25), (45.0, 2.0)]
    {
        for height in [1.0, 0.6] {
            let toml = format!(
                "mode = 'sr'\npicture = {{ size = [64, 8] }}\nray = {{ step = {}, sampling = 'exact' }}\n\
                 slices = {{ format = 'r32f' }}\nsurface = {{ threshold = 0.08, edge = {edge}, rough = 1 }}",
                edge / 4.0
            );
            let scene = scene(geometry.clone(), FLOATS, &toml);
            // Through the middle of the region, tilted about the elevation axis.
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let wall = |x: f64, y: f64| (y - 24.0) * cos + x * sin;
            let frames = body_frames(&scene, |p| height * normal_distribution(wall(p.x, p.y) / deviation));
            let mut renderer = rendered(&device, scene.clone(), &frames);
            renderer.picture().expect("picture");
            let map = renderer.read(Slot::Distance).expect("read").expect("there");
            let (mut worst, mut rays) = (0.0f64, 0);
            for x in 0..map.size[0] {
                let (origin, _) = scene.rays.at(x as f64 + 0.5, 4.5);
                let depth = 24.0 - origin.x * sin / cos;
                // With room for the wall in front and behind.
                if !(10.0..38.0).contains(&depth) || origin.x.abs() > 22.0 {
                    continue;
                }
                let distance = map.one(x, 4, 0);
                assert!(is_hit(distance), "{degrees} deg, deviation {deviation}: no surface at {}", origin.x);
                worst = worst.max((origin.y + distance - depth).abs());
                rays += 1;
            }
            println!(
                "{degrees} deg, deviation {deviation} mm, height {height}: {:.4} of an edge at most, {rays} rays",
                worst / edge
            );
            assert!(
                rays >= 4 && worst <= 0.025 * edge,
                "{degrees} deg, deviation {deviation}, height {height}: {worst} mm"
            );
            largest = largest.max(worst / edge);
        }
    }
    device.figure("oblique-wall", &format!("{largest:.3}"));
}

/// The share of a normal distribution below x standard deviations, by its series: to 1e-9 within 5.
pub fn normal_distribution(x: f64) -> f64 {
    if x.abs() > 5.0 {
        return f64::from(u8::from(x > 0.0));
    }
    let (mut term, mut sum) = (x, x);
    for n in 1..120 {
        term *= x * x / f64::from(2 * n + 1);
        sum += term;
    }
    0.5 + sum * (-x * x / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

/// The ring of the thesis has 8 samples at any step.
#[test]
fn the_ring_of_the_thesis_shrinks_with_the_step_and_the_other_does_not() {
    let long = columns([4, 200, 4], 0.1, "threshold = 0.1");
    assert_eq!((long.ring.half, long.ring.step), (4, 0.4));
    let settings = |toml: &str| {
        let mut settings = long.settings.clone();
        settings.ray.step = Some(0.1);
        settings.surface.edge = settings_of_edge(toml);
        Scene::new(long.geometry.clone(), long.input, settings).expect("scene").ring
    };
    let (fine, thesis) = (settings("1.6"), settings("'samples'"));
    assert_eq!((fine.half, fine.step, thesis.half, thesis.step), (16, 0.1, 4, 0.1));
    // Coarser than a quarter of the edge is as a quarter; finer than 1/256 as that.
    assert_eq!(settings("0.2").half, 4);
    assert_eq!(settings("100").half, 256);
}

fn settings_of_edge(toml: &str) -> Option<echolume::low_level::scene::Edge> {
    settings(&format!("surface.edge = {toml}")).surface.edge
}
