//! A coarse picture is enlarged along its edges: known answers, and how near it comes to the full picture.

use crate::common::gpu::*;
use crate::ladder::{Stage, draw};
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::{Arrays, DispatchArgs, MISS, Slot, Texels, by_name};
use echolume::low_level::scene::Scene;
use echolume::low_level::verify::each_pass::run_with_reference;

const SIDE: usize = 96;

/// A surface with one ray for several pixels, and cliffs of 2 mm times the pixels between two rays.
fn coarse(apart: usize) -> Scene {
    let toml = format!("mode = 'sr'\npicture.size = [{SIDE}, {SIDE}]\nray.subsampling = {apart}");
    scene(cartesian([20, 20, 20]), BYTES, &toml)
}

/// The picture that is made of colours (grey, opacity) and distances of rays at (x, y), in rays: on the device and by the reference.
fn assembled(single: &mut PassRunner, apart: usize, ray: impl Fn(f64, f64) -> (f64, f64, f64)) -> [Texels; 2] {
    let scene = coarse(apart);
    let pass = by_name("assemble").expect("pass");
    let size = [SIDE / apart, SIDE / apart, 1];
    let at = |[x, y, _]: [usize; 3]| ray(x as f64, y as f64);
    let mut inputs = Arrays::default();
    let held = |value: f64| f64::from(value as f32);
    let rendered = Texels::from_fn(size, 4, |place, c| if c == 3 { at(place).1 } else { at(place).0 });
    let format = Slot::Rendered.format(&scene);
    inputs.insert("rendered", Texels::decode(size, format, &rendered.encode(format)));
    inputs.insert("guide", Texels::from_fn(size, 1, |place, _| held(at(place).2)));
    let args = DispatchArgs::default();
    let device = single.run(&scene, pass, &args, &inputs, 0.654).expect("dispatch").get("picture").clone();
    let mut written = Arrays::default();
    written.insert("picture", Texels::untouched([SIDE, SIDE, 1], 4));
    pass.reference(&scene, &args, &inputs, &mut written);
    [device, written.get("picture").clone()]
}

fn pixels() -> impl Iterator<Item = (usize, usize)> {
    (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)))
}

#[test]
fn constants_stay_and_planes_are_linear() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    for apart in [2, 4, 8] {
        // One colour, whatever the distances are.
        let jagged = |x: f64, y: f64| if (3.0 * x + 5.0 * y) % 7.0 < 3.0 { MISS } else { 20.0 + (11.0 * x + y) % 40.0 };
        for picture in assembled(&mut single, apart, |x, y| (0.5, 1.0, jagged(x, y))) {
            assert!(
                picture.values.chunks(4).all(|p| (p[0] - 0.5).abs() < 1e-3 && (p[3] - 1.0).abs() < 1e-3),
                "{apart}"
            );
        }
        // A plane that is no cliff: its colours are those at the pixel.
        let rays = (SIDE / apart) as f64;
        let plane = |x: f64, y: f64| (0.2 + 0.3 * x / rays + 0.4 * y / rays, 1.0, 30.0 + 0.4 * x + 0.3 * y);
        for picture in assembled(&mut single, apart, plane) {
            for (x, y) in pixels().filter(|(x, y)| [*x, *y].iter().all(|n| (apart..SIDE - apart).contains(n))) {
                let [px, py] = [x, y].map(|n| (n as f64 + 0.5) / apart as f64 - 0.5);
                assert!((picture.get([x, y, 0])[0] - plane(px, py).0).abs() < 1e-3, "{apart} {x} {y}");
            }
        }
    }
}

/// Prevents pixels that no invocation has, where a rendering begins within the pixels of a ray: each has those of a column between two rows of rays.
#[test]
fn each_pixel_of_every_layout_is_that_of_the_reference() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let pass = by_name("assemble").expect("pass");
    for (layout, apart, size) in ["single", "four", "beside", "pair"].into_iter().flat_map(|layout| {
        let sizes = [[96, 96], [97, 75], [62, 90], [71, 83]];
        [2, 4, 8].into_iter().flat_map(move |apart| sizes.map(|size| (layout, apart, size)))
    }) {
        let toml = format!("mode = 'sr'\nlayout = '{layout}'\npicture.size = {size:?}\nray.subsampling = {apart}");
        let scene = scene(cartesian([20, 20, 20]), BYTES, &toml);
        let run = run_with_reference(&mut single, &scene, pass, 0, "noise", 7).expect("dispatch");
        assert!(run.comparison.worst.is_none(), "{layout} {apart} {size:?}: {:?}", run.comparison.worst);
    }
}

/// The outline of a half plane lies within a quarter of the distance between two rays of the true line, 0.5 pixels at half the rays; no value is beyond
/// those of the rays. Lines nearly along an axis or a diagonal are left out: all rays beside them are on one side over a long way, so that none tells
/// where between two rows the line is.
#[test]
fn outlines_are_straight_and_nothing_overshoots() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    for apart in [2, 4] {
        let mut largest = 0.0f64;
        for (n, degrees) in [14.0f64, 18.0, 22.0, 33.0, 57.0, 68.0, 76.0].into_iter().enumerate() {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let middle = (SIDE / apart) as f64 / 2.0 + 0.17 * n as f64 - 0.5;
            // Rays on the near side of the line, how far in rays.
            let inside = |x: f64, y: f64| (x - middle) * sin + (y - middle) * cos;
            let half_plane = |x, y| if inside(x, y) > 0.0 { (0.8, 1.0, 30.0) } else { (0.0, 0.0, MISS) };
            for picture in assembled(&mut single, apart, half_plane) {
                assert!(picture.values.iter().all(|v| (-1e-3..=1.001).contains(v)), "{degrees}");
                assert!(
                    picture.values.chunks(4).all(|p| (p[0] - 0.8 * p[3]).abs() < 2e-3),
                    "the colour follows opacity"
                );
                let flat = cos > sin;
                for across in SIDE / 4..3 * SIDE / 4 {
                    // Along the axis that the line crosses more steeply: pixels that are covered, from the far end on.
                    let line = |n: usize| if flat { [across, n, 0] } else { [n, across, 0] };
                    let covered: f64 = (0..SIDE).map(|n| picture.get(line(n))[3]).sum();
                    let place = (across as f64 + 0.5) / apart as f64 - 0.5;
                    let (lean, steep) = if flat { (sin, cos) } else { (cos, sin) };
                    let crossing = middle - (place - middle) * lean / steep;
                    let expected = SIDE as f64 - (crossing + 0.5) * apart as f64;
                    largest = largest.max((covered - expected).abs() * steep);
                }
            }
        }
        println!("{apart} pixels apart: outlines are off by at most {largest:.2} pixels");
        assert!(largest <= 0.25 * apart as f64, "{apart}: {largest}");
    }
}

/// Prevents a cord that vanishes because the outline around it is smoothed, and a nose that bleeds into the cheek behind it.
#[test]
fn thin_parts_stay_and_cliffs_are_sharp() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    for apart in [2, 4] {
        let column = (SIDE / apart / 2) as f64;
        let cord = |x: f64, _| if x == column { (0.7, 1.0, 30.0) } else { (0.0, 0.0, MISS) };
        let step = |x: f64, _| if x < column { (0.2, 1.0, 20.0) } else { (0.8, 1.0, 60.0) };
        for picture in assembled(&mut single, apart, cord) {
            let covered: f64 = (0..SIDE).map(|x| picture.get([x, SIDE / 2, 0])[3]).sum();
            assert!((covered - apart as f64).abs() < 0.6, "{apart}: the cord is {covered} pixels wide");
        }
        for picture in assembled(&mut single, apart, step) {
            let mixed = |x: &usize| (0.21..0.79).contains(&picture.get([*x, SIDE / 2, 0])[0]);
            assert!((0..SIDE).filter(mixed).count() <= 2, "{apart}: the cliff is blurred");
        }
    }
}

/// Mean difference of two pictures in levels of 255, and the mean SSIM of blocks of 8 x 8 pixels of their luminance.
fn likeness(a: &Texels, b: &Texels) -> (f64, f64) {
    let count = (a.size[0] * a.size[1] * 3) as f64;
    let shown = |v: f64| 255.0 * v.clamp(0.0, 1.0);
    let pairs = a.values.iter().zip(&b.values).enumerate().filter(|(i, _)| i % 4 < 3);
    let mean = pairs.map(|(_, (a, b))| (shown(*a) - shown(*b)).abs()).sum::<f64>() / count;
    let grey = |t: &Texels, x, y| {
        let p = t.get([x, y, 0]);
        shown(0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2])
    };
    let (c1, c2) = ((0.01f64 * 255.0).powi(2), (0.03f64 * 255.0).powi(2));
    let (mut sum, mut blocks) = (0.0, 0.0);
    for (i, j) in (0..a.size[1] / 8).flat_map(|j| (0..a.size[0] / 8).map(move |i| (i, j))) {
        let [mut sa, mut sb, mut saa, mut sbb, mut sab] = [0.0; 5];
        for n in 0..64 {
            let (x, y) = (8 * i + n % 8, 8 * j + n / 8);
            let (u, v) = (grey(a, x, y), grey(b, x, y));
            (sa, sb, saa, sbb, sab) = (sa + u, sb + v, saa + u * u, sbb + v * v, sab + u * v);
        }
        let (ma, mb) = (sa / 64.0, sb / 64.0);
        let (va, vb, cov) = (saa / 64.0 - ma * ma, sbb / 64.0 - mb * mb, sab / 64.0 - ma * mb);
        sum += (2.0 * ma * mb + c1) * (2.0 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        blocks += 1.0;
    }
    (mean, sum / blocks)
}

/// Linear interpolation of every ray with its neighbours, edges or not.
fn linear(rendered: &Texels, apart: f64, size: [usize; 3]) -> Texels {
    Texels::from_fn(size, 4, |[x, y, _], c| {
        let along = |pixel: usize, rays: usize| {
            let at = ((pixel as f64 + 0.5) / apart - 0.5).clamp(0.0, (rays - 1) as f64);
            (at.floor() as usize, (at.floor() as usize + 1).min(rays - 1), at - at.floor())
        };
        let ((x0, x1, u), (y0, y1, v)) = (along(x, rendered.size[0]), along(y, rendered.size[1]));
        let at = |x, y| rendered.get([x, y, 0])[c];
        (1.0 - v) * ((1.0 - u) * at(x0, y0) + u * at(x1, y0)) + v * ((1.0 - u) * at(x0, y1) + u * at(x1, y1))
    })
}

/// Coarse surfaces of the phantom are nearer to the full picture than linear interpolation brings them. What has no distance is interpolated.
#[test]
fn coarse_pictures_come_nearer_to_the_full_one_than_by_linear_interpolation() {
    let stage = Stage::new();
    let mut one = None;
    for (preset, mode) in [("face-classic", "sr"), ("face-classic", "mixed"), ("face", "vr"), ("face-classic", "mip")] {
        let full = stage.scene((preset, mode, [370, 362]), "camera.azimuth=20;camera.elevation=-15;post.floats=true");
        let renderer = one.get_or_insert_with(|| stage.renderer(full.clone()));
        draw(renderer, &full);
        let whole = renderer.read(Slot::Picture).expect("read").expect("there");
        for apart in [2, 4] {
            let mut settings = full.settings.moving();
            settings.ray.subsampling = apart;
            let coarse = Scene::new(full.geometry.clone(), full.input, settings).expect("scene");
            renderer.change(coarse.clone()).expect("change");
            renderer.picture().expect("picture");
            let made = renderer.read(Slot::Picture).expect("read").expect("there");
            let plain =
                linear(&renderer.read(Slot::Rendered).expect("read").expect("there"), f64::from(apart), whole.size);
            let (before, after) = (likeness(&whole, &plain), likeness(&whole, &made));
            println!(
                "{preset} {mode} {apart}: mean {:.2} -> {:.2} levels, SSIM {:.4} -> {:.4}",
                before.0, after.0, before.1, after.1,
            );
            match coarse.has_distance() {
                true => assert!(after.0 < 0.95 * before.0 && after.1 > before.1, "{apart}: {before:?} {after:?}"),
                // A GPU's filter rounds its weights to 1/256.
                false => assert!((after.0 - before.0).abs() < 0.02, "{apart}: {before:?} {after:?}"),
            }
        }
    }
}
