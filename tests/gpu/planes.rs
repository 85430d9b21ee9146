//! Planes and slabs show objects in their true positions.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Geometry, Grid, Probe};
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::Recording;
use glam::{DVec2, DVec3};

/// Right, down and normal of plane A from the settings, one rotation after the other.
fn turned(azimuth: f64, tilt: f64, roll: f64) -> [DVec3; 3] {
    let turn = |a: DVec3, b: DVec3, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (a * cos + b * sin, b * cos - a * sin)
    };
    let (right, normal) = turn(DVec3::X, DVec3::Z, azimuth);
    let (down, normal) = turn(DVec3::Y, normal, tilt);
    // Clockwise on the screen: the right part moves down, so the right now shows what was above.
    let (right, down) = turn(right, -down, roll);
    [right, -down, normal]
}

/// The expected view of the only tile of a picture: the region fits into the tile, and its middle,
/// projected onto the plane, is the middle of the tile.
fn shown(scene: &Scene, [right, down, normal]: [DVec3; 3], at: DVec3, x: usize, y: usize) -> DVec3 {
    let [width, height] = scene.picture_size().map(f64::from);
    let extent = |axis: DVec3| axis.abs().dot(scene.high - scene.low);
    let pixel = (extent(right) / width).max(extent(down) / height);
    let middle = (scene.low + scene.high) / 2.0;
    let middle = middle + normal * normal.dot(at - middle);
    middle + (right * (x as f64 + 0.5 - width / 2.0) + down * (y as f64 + 0.5 - height / 2.0)) * pixel
}

/// The picture in floats, before it becomes 8 bits.
pub fn picture(renderer: &mut Renderer) -> Texels {
    let mut scene = renderer.scene().clone();
    scene.settings.post.floats = true;
    renderer.change(scene).expect("change");
    renderer.picture().expect("picture");
    renderer.read(Slot::Picture).expect("read").expect("there")
}

/// Prevents planes that are mirrored, shifted or rotated the wrong way, in any geometry: a field that is linear in space is
/// reproduced on every plane. Between lines and frames the sweep deviates by range angle^2 / 8: 0.02 mm between lines,
/// 0.03 mm between uniform and 0.06 mm between non-uniform frames; R16F adds 0.02 mm.
#[test]
fn a_linear_field_is_itself_on_every_plane() {
    let device = Device::new();
    for (name, geometry) in geometries() {
        let is_still = name == "single frame";
        let slope = DVec3::new(0.005, 0.006, if is_still { 0.0 } else { -0.005 });
        let (low, high) = echolume::low_level::scene::insonified_box(&geometry);
        let field = |p: DVec3| 0.5 + slope.dot(p - (low + high) / 2.0);
        for (plane, axes) in [
            ("", turned(0.0, 0.0, 0.0)),
            ("plane = 'b'", [DVec3::Z, DVec3::Y, DVec3::X]),
            ("plane = 'c'", [DVec3::X, -DVec3::Z, DVec3::Y]),
            (TURNED, turned(25.0, -15.0, 40.0)),
        ] {
            let toml = format!(
                "mode = 'plane'\nplanes = {{ position = [1.5, 4.0, -1.0], {plane} }}\npicture = {{ size = [61, 47] }}
                 slices = {{ pixels = 200, format = 'r32f' }}\nray = {{ sampling = 'exact' }}"
            );
            let scene = scene(geometry.clone(), FLOATS, &toml.replace(",  }", " }"));
            let frames = body_frames(&scene, field);
            let depth = 4.0 + scene.probe().map_or(0.0, |p| p.array_radius());
            let at = DVec3::new(1.5, depth, -1.0);
            let picture = picture(&mut rendered(&device, scene.clone(), &frames));
            let (mut seen, mut worst) = (0, 0.0f64);
            for (x, y) in (0..47).flat_map(|y| (0..61).map(move |x| (x, y))) {
                let rgba = picture.get([x, y, 0]);
                let place = shown(&scene, axes, at, x, y);
                if !is_well_inside(&scene, place) {
                    continue;
                }
                if rgba[3] > 0.0 {
                    seen += 1;
                    worst = worst.max((rgba[0] - field(place)).abs() / slope.length());
                }
            }
            println!("{name}, {plane}: {seen} pixels, off by {worst:.4} mm");
            assert!(seen > 60, "{name}: {seen} pixels");
            assert!(worst < 0.11, "{name}: off by {worst} mm");
        }
    }
}

/// Further inside than the reach of a slice pixel: beyond the border its neighbours hold the outermost samples.
fn is_well_inside(scene: &Scene, place: DVec3) -> bool {
    let within = |at: f64, margin: f64, count: usize| at >= margin && at <= (count - 1) as f64 - margin;
    match &scene.geometry {
        Geometry::Sweep(probe) => {
            let at = probe.to_indices(place);
            within(at.sample, 1.0, probe.samples) && within(at.line, 0.6, probe.lines.len())
        }
        Geometry::Cartesian(grid) => {
            (0..3).all(|a| within((place[a] - grid.origin[a]) / grid.spacing[a], 0.0, grid.size[a]))
        }
    }
}

/// The five wires of the simulated sweep on planes through them, by the energy-weighted centroid on the plane: 10^(v 4.5)
/// within 2 mm of the brightest pixel.
#[test]
fn planes_through_the_wobblers_wires_show_them_where_they_are() {
    let device = Device::new();
    let mut recording = Recording::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame().expect("frame") {
        frames.push(frame);
    }
    let Geometry::Sweep(probe) = recording.geometry(0) else { panic!("a sweep") };
    let mut renderer: Option<Renderer> = None;
    let mut worst = 0.0f64;
    // Lateral, elevation, depth from the wobble axis, as in sweep.json.
    for [x, z, y] in [[0.0, 0.0, 60.0], [20.0, 0.0, 60.0], [-20.0, 0.0, 60.0], [0.0, 12.0, 65.0], [0.0, -12.0, 65.0]] {
        let truth = DVec3::new(x, y + probe.axis_depth(), z);
        let depth = truth.y - probe.array_radius();
        for plane in ["", "plane = 'b'", "plane = 'c'", "azimuth = 30, tilt = 20, roll = -25"] {
            let toml = format!(
                "mode = 'plane'\nplanes = {{ position = [{x}, {depth}, {z}], {plane} }}\npicture = {{ size = [160, 160] }}
                 slices = {{ format = 'r32f', pixels = 700, everything = true }}\nray = {{ sampling = 'exact' }}
                 region = {{ lateral = [{}, {}], depth = [{}, {}], elevation = [{}, {}] }}",
                x - 5.0, x + 5.0, depth - 5.0, depth + 5.0, z - 5.0, z + 5.0
            );
            let settings = settings(&toml.replace(",  }", " }"));
            let scene = Scene::new(recording.geometry(0), input, settings).expect("scene");
            let renderer = match &mut renderer {
                Some(renderer) => {
                    renderer.change(scene.clone()).expect("change");
                    renderer
                }
                none => {
                    let new = none
                        .insert(Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer"));
                    for frame in &frames {
                        new.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
                    }
                    new.show(0).expect("show");
                    new
                }
            };
            let picture = picture(renderer);
            // The middle of the picture is the truth.
            let pixel = scene.tiling().pixel;
            let values: Vec<(DVec2, f64)> = (0..160 * 160)
                .map(|i| {
                    (
                        DVec2::new((i % 160) as f64 - 79.5, (i / 160) as f64 - 79.5) * pixel,
                        picture.one(i % 160, i / 160, 0),
                    )
                })
                .collect();
            let close = values.iter().filter(|(p, _)| p.length() < 2.5);
            let brightest = close.max_by(|a, b| a.1.total_cmp(&b.1)).expect("pixels").0;
            let ball = values.iter().filter(|(p, _)| p.distance(brightest) < 2.0);
            let (sum, weight) = ball.fold((DVec2::ZERO, 0.0), |(sum, weight), (p, v)| {
                let w = 10f64.powf(v * 4.5);
                (sum + *p * w, weight + w)
            });
            let off = (sum / weight).length();
            println!("wire at {truth:.2}, {plane:35}: off by {off:.3} mm {:.3}", sum / weight);
            worst = worst.max(off);
        }
    }
    assert!(worst < 0.1, "off by {worst} mm");
    device.figure("plane-wires", &format!("{worst:.3}"));
}

/// A slab against a plain loop over the volume, and against the known result of a field along its normal.
#[test]
fn a_slab_is_the_mean_the_largest_or_the_smallest_of_what_it_holds() {
    let device = Device::new();
    let block = Geometry::Cartesian(Grid { size: [20, 20, 20], spacing: [0.5; 3], origin: [0.0; 3] });
    for (slab, along) in [("mean", 0.0), ("max", 1.5), ("min", -1.5)] {
        let at = |geometry: &Geometry, plane: &str| {
            let toml = format!(
                "mode = 'plane'\nplanes = {{ thickness = 3.0, slab = '{slab}', {plane} }}\npicture = {{ size = [40, 40] }}
                 slices = {{ pixels = 64, format = 'r32f' }}\nray = {{ sampling = 'exact' }}"
            );
            scene(geometry.clone(), FLOATS, &toml)
        };
        let rising = at(&block, "position = [4.75, 4.0, 4.75], plane = 'c'");
        let frames = body_frames(&rising, |p| 0.1 + 0.08 * p.y);
        let got = picture(&mut rendered(&device, rising, &frames)).one(20, 20, 0);
        assert!((got - (0.1 + 0.08 * (4.0 + along))).abs() < 5e-4, "{slab}: {got}");

        let sweep = at(&Geometry::Sweep(wobbler()), TURNED);
        let mut noise = Noise(5);
        let frames: Vec<Texels> = (0..9)
            .map(|_| {
                let mut frame = Texels::untouched([64, 24, 1], 1);
                frame.values.iter_mut().for_each(|v| *v = noise.next());
                frame
            })
            .collect();
        let mut renderer = rendered(&device, sweep.clone(), &frames);
        let picture = picture(&mut renderer);
        let volume = renderer.read(Slot::Volume).expect("read").expect("there");
        let Geometry::Sweep(probe) = &sweep.geometry else { panic!("a sweep") };
        let axes = turned(25.0, -15.0, 40.0);
        let pitch = sweep.grid.pitch[0].min(sweep.grid.pitch[1]);
        let count = (3.0 / pitch).ceil() as usize + 1;
        let (mut checked, mut partial) = (0, 0);
        for (x, y) in (0..40).flat_map(|y| (0..40).map(move |x| (x, y))) {
            let middle = shown(&sweep, axes, (sweep.low + sweep.high) / 2.0, x, y);
            let values: Vec<f64> = (0..count)
                .map(|i| middle + axes[2] * (3.0 * i as f64 / (count - 1) as f64 - 1.5))
                .filter_map(|p| echo(&sweep, probe, &volume, p))
                .collect();
            let rgba = picture.get([x, y, 0]);
            if values.is_empty() {
                assert_eq!(rgba, [0.0; 4], "nothing at {x}, {y}");
                continue;
            }
            let expected = match slab {
                "mean" => values.iter().sum::<f64>() / values.len() as f64,
                "max" => values.iter().copied().fold(f64::MIN, f64::max),
                _ => values.iter().copied().fold(f64::MAX, f64::min),
            };
            assert!((rgba[0] - expected).abs() < 1e-3 && rgba[3] == 1.0, "{slab} at {x}, {y}: {rgba:?} for {expected}");
            checked += 1;
            partial += usize::from(values.len() < count);
        }
        assert!(checked > 300 && partial > 20, "{checked} pixels, {partial} at the border");
    }
}

/// The stored volume at a point; none outside the sector or the box.
fn echo(scene: &Scene, probe: &Probe, volume: &Texels, p: DVec3) -> Option<f64> {
    let at = probe.to_indices(p);
    let inside = |v: f64, n: usize| v >= 0.0 && v <= (n - 1) as f64;
    let within = p.cmpge(scene.low).all() && p.cmple(scene.high).all();
    let (x, y, _) = probe.inverse_sweep_map(p);
    let [i, j] = [(x - scene.grid.origin[0]) / scene.grid.pitch[0], (y - scene.grid.origin[1]) / scene.grid.pitch[1]];
    let counts =
        inside(at.sample, probe.samples) && inside(at.line, probe.lines.len()) && inside(at.slice, probe.slices.len());
    (within && counts).then(|| volume.trilinear([i, j, at.slice]))
}
