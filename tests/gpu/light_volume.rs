//! The light volume against closed formulas: a slab, a sphere, two spheres, and what no formula may break.

use crate::common::gpu::*;
use crate::common::probes::voxels;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::Plan;
use echolume::low_level::scene::{DeviceFacts, Scene};
use glam::DVec3;

/// Voxels of 1 mm whose centres count from 0.
const SIZE: [usize; 3] = [48, 40, 44];
/// Light towards +elevation unless another is given, in matter with 1/e of all colours after 5 mm.
const LIGHT: &str = "follows = 'region', direction = [0, 1, 0]";
const GREY: &str = "cell = 1, depth = 5, warmth = 0, scatter = 0, widening = 0, back = 0";

fn look(light: &str, volume: &str) -> Scene {
    look_with("", light, volume)
}

fn look_with(more: &str, light: &str, volume: &str) -> Scene {
    let toml = format!(
        "mode = 'vr'\n{more}\npicture.size = [32, 32]\nvolume.extinction = 0.2\nvolume.transfer = [{{ at = 0, colour = [1, 1, 1], opacity = 0 }}, \
         {{ at = 1, colour = [1, 1, 1], opacity = 1 }}]\nlight = {{ {light}, volume = {{ {volume} }} }}"
    );
    scene(voxels(SIZE), BYTES, &toml)
}

/// A slot of the picture of matter with this density at a place in mm.
fn lit(device: &Device, scene: &Scene, density: impl Fn(DVec3) -> f64, slot: Slot) -> Texels {
    let mut renderer = Renderer::new(device, scene.clone(), &Default::default()).expect("renderer");
    let [width, height, slices] = SIZE;
    for k in 0..slices {
        let value = |i: usize, j: usize| density(DVec3::new(i as f64, j as f64, k as f64));
        let bytes: Vec<u8> = (0..height)
            .flat_map(|j| (0..width).map(move |i| (i, j)))
            .map(|(i, j)| (255.0 * value(i, j)).round() as u8)
            .collect();
        renderer.frame(k as u32, &bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    renderer.picture().expect("picture");
    renderer.read(slot).expect("read").expect("of the plan")
}

/// The value of a light at a place in mm: between the cells around it.
fn at(scene: &Scene, light: &Texels, place: DVec3) -> [f64; 4] {
    let lattice = scene.light_lattice();
    let cells = (place - lattice.low) / lattice.cell - 0.5;
    let cells = std::array::from_fn(|a| cells[a].clamp(0.0, (light.size[a] - 1) as f64));
    light.interpolated(cells)
}

fn slab(from: f64, to: f64) -> impl Fn(DVec3) -> f64 {
    move |p| if (from..=to).contains(&p.z) { 1.0 } else { 0.0 }
}

/// Behind a slab of 10 mm is left what the law of Lambert and Beer leaves, for any direction and colour; in front of it all.
#[test]
fn a_slab_absorbs_by_the_length_of_the_path() {
    let device = Device::new();
    for (direction, cosine) in [("[0, 1, 0]", 1.0), ("[0.6, 0.8, 0]", 0.8), ("[-0.36, 0.8, 0.48]", 0.8)] {
        let light = format!("follows = 'region', direction = {direction}");
        let scene = look(&light, &GREY.replace("warmth = 0", "warmth = 1"));
        let arriving = lit(&device, &scene, slab(20.0, 29.0), Slot::LightArriving);
        let extinction = scene.settings.light.volume.expect("asked for").extinction();
        for (c, extinction) in extinction.into_iter().enumerate() {
            // Half of each border's cell on either side: ten cells.
            let expected = (-extinction * 10.0 / cosine).exp();
            let behind = at(&scene, &arriving, DVec3::new(24.0, 20.0, 12.0))[c];
            assert!((behind - expected).abs() < 0.01 * expected, "{direction} channel {c}: {behind}, not {expected}");
            let before = at(&scene, &arriving, DVec3::new(24.0, 20.0, 36.0))[c];
            assert!((before - 1.0).abs() < 2e-3, "{direction} channel {c}: {before}");
        }
        assert!(extinction[0] < extinction[1] && extinction[1] < extinction[2], "red goes deepest");
    }
    assert!(device.messages().is_empty(), "{:?}", device.messages());
}

fn ball(middle: DVec3, radius: f64) -> impl Fn(DVec3) -> f64 {
    // A voxel across the border counts by its share, nearly.
    move |p| (radius + 0.5 - p.distance(middle)).clamp(0.0, 1.0)
}

/// On the axis behind a sphere light has passed its diameter; beside it nothing.
#[test]
fn a_sphere_casts_a_shadow_of_its_chords() {
    let device = Device::new();
    let scene = look(LIGHT, GREY);
    let (middle, radius) = (DVec3::new(24.0, 20.0, 26.0), 8.0);
    let arriving = lit(&device, &scene, ball(middle, radius), Slot::LightArriving);
    for off in [0.0, 2.0, 4.0] {
        // Light that spreads mixes chords: the lattice spreads it over half a cell a layer, 4 mm^2 over the 16 layers, half of it
        // on average over those within and behind the sphere. The mean of the second derivative times half the variance.
        let chord = |off: f64| 2.0 * (radius * radius - off * off).max(0.0).sqrt();
        let expected = (-chord(off) / 5.0).exp();
        let behind = at(&scene, &arriving, middle + DVec3::new(off, 0.0, -10.0))[1];
        assert!((behind - expected).abs() < 0.02 + 0.15 * expected, "{off} mm off the axis: {behind}, not {expected}");
    }
    let beside = at(&scene, &arriving, middle + DVec3::new(18.0, 0.0, -10.0))[1];
    assert!(beside > 0.995, "{beside}");
}

/// A sphere in the shadow of another gets the product, whether the first is seen or not: the light volume knows no view.
#[test]
fn shadows_of_two_spheres_multiply_and_do_not_depend_on_the_view() {
    let device = Device::new();
    let scene = look(LIGHT, GREY);
    let (first, second) = (ball(DVec3::new(24.0, 20.0, 34.0), 6.0), ball(DVec3::new(24.0, 20.0, 16.0), 6.0));
    let both = lit(&device, &scene, |p| first(p).max(second(p)), Slot::LightArriving);
    let (one, other) =
        (lit(&device, &scene, &first, Slot::LightArriving), lit(&device, &scene, &second, Slot::LightArriving));
    let place = DVec3::new(24.0, 20.0, 6.0);
    let [both_left, one_left, other_left] = [&both, &one, &other].map(|light| at(&scene, light, place)[1]);
    // Light that spread behind the first is not parallel any more: a few percent.
    assert!((both_left - one_left * other_left).abs() < 0.05, "{both_left}, {one_left} x {other_left}");
    assert!(both_left < 0.6 * one_left && one_left < 0.3, "{both_left} {one_left}");

    let mut turned = scene.settings.clone();
    (turned.camera.azimuth, turned.camera.elevation) = (70.0, 30.0);
    let turned = Scene::new(scene.geometry.clone(), scene.input, turned).expect("scene");
    assert_eq!(lit(&device, &turned, |p| first(p).max(second(p)), Slot::LightArriving).values, both.values);
}

/// Prevents a seam between the tiles of workgroups that bring light through several layers, wherever the light comes from: over the middle of a
/// cell, nearly along the diagonal, from either end of any axis.
#[test]
fn light_through_several_layers_at_once_is_that_of_layer_by_layer() {
    let device = Device::new();
    let body = |p: DVec3| (0.5 + 0.5 * (0.3 * p.x).sin() * (0.4 * p.y).cos() * (0.35 * p.z + 0.2 * p.x).sin()).powi(3);
    for direction in [
        "[0, 1, 0]",
        "[0.6, 0.8, 0.4]",
        "[-0.69, 0.7, -0.68]",
        "[0.2, -0.9, 0.5]",
        "[1, 0.45, -0.55]",
        "[0.66, 0.1, -0.7]",
    ] {
        let light = format!("follows = 'region', direction = {direction}");
        let each = look(&light, &GREY.replace("back = 0", "back = 0.5"));
        let mut several = each.clone();
        several.device.shared_memory = 32 << 10;
        let dispatches = |scene| Plan::new(scene).steps.len();
        assert!(3 * dispatches(&several) < dispatches(&each), "several layers a dispatch");
        let device_of_few = DeviceFacts { invocations: 512, ..several.device };
        let few = Scene { device: device_of_few, ..several.clone() };
        assert_eq!(dispatches(&few), dispatches(&each), "a workgroup needs 1024 invocations");
        for slot in [Slot::LightArriving, Slot::BackLight] {
            let [a, b] = [&each, &several].map(|scene| lit(&device, scene, body, slot));
            assert_eq!(a.size, b.size);
            for (n, (a, b)) in a.values.iter().zip(&b.values).enumerate() {
                // Either is rounded to 16 bits.
                assert!((a - b).abs() <= 1e-3 * a.abs() + 1e-6, "{direction}, {slot:?}, value {n}: {b} instead of {a}");
            }
        }
    }
}

/// A camera that turns needs no new light, unless the light follows it.
#[test]
fn a_view_that_turns_keeps_the_light_of_the_region() {
    let device = Device::new();
    for (follows, again) in [("region", false), ("camera", true)] {
        let light = format!("follows = '{follows}', direction = [0.3, 1, 0.2]");
        let scene = look(&light, GREY);
        let mut renderer = Renderer::new(&device, scene.clone(), &Default::default()).expect("renderer");
        let frame = vec![128; SIZE[0] * SIZE[1]];
        (0..SIZE[2]).for_each(|k| renderer.frame(k as u32, &frame, 0).expect("frame"));
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        let mut turned = scene.settings.clone();
        turned.camera.azimuth = 25.0;
        let turned = Scene::new(scene.geometry.clone(), scene.input, turned).expect("scene");
        let passes = renderer.dispatched_passes(|r| r.change(turned).and_then(|_| r.picture())).expect("picture");
        assert!(passes.contains(&"raycast_volume") && !passes.contains(&"light_matter"), "{follows}: {passes:?}");
        assert_eq!(passes.contains(&"light_propagate"), again, "{follows}: {passes:?}");
    }
}

/// Passes that run again may find what they read overwritten by later ones of the same chain.
#[test]
fn any_change_of_the_light_gives_the_picture_of_a_fresh_renderer() {
    let device = Device::new();
    let frame: Vec<u8> =
        (0..SIZE[0] * SIZE[1]).map(|i| if i / SIZE[0] > 14 { 160 + (i % 7) as u8 * 10 } else { 0 }).collect();
    let rendered = |scene: &Scene| {
        let mut renderer = Renderer::new(&device, scene.clone(), &Default::default()).expect("renderer");
        (0..SIZE[2]).for_each(|k| renderer.frame(k as u32, &frame, 0).expect("frame"));
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        renderer
    };
    let warm = GREY.replace("cell = 1", "cell = 2");
    let scenes = [
        look(LIGHT, &warm.replace("scatter = 0", "scatter = 2")),
        look(LIGHT, &warm.replace("scatter = 0", "scatter = 1")),
        look(LIGHT, &warm),
        look(LIGHT, &warm.replace("back = 0", "back = 1").replace("scatter = 0", "scatter = 3")),
        look("direction = [1, 0.1, 0.2]", &warm.replace("scatter = 0", "scatter = 3")),
        look("direction = [1, 0.1, 0.2], ambient = 0.6", &warm.replace("scatter = 0", "scatter = 0.5")),
        look("direction = [-0.1, 0.1, 1]", &warm.replace("cell = 2", "cell = 3").replace("scatter = 0", "scatter = 1")),
    ];
    let mut renderer = rendered(&scenes[0]);
    for (n, scene) in scenes.iter().enumerate().skip(1).chain([(0, &scenes[0])]) {
        renderer.change(scene.clone()).expect("change");
        let changed = renderer.picture().expect("picture");
        assert!(changed == rendered(scene).picture().expect("picture"), "scene {n}");
    }
}

/// Scattering moves light inside of matter and makes none: under constant light it is constant, and no cell gets more than the brightest has.
#[test]
fn scattered_light_is_a_mean_of_what_arrives() {
    let device = Device::new();
    let scattering = GREY.replace("scatter = 0", "scatter = 2");
    let scene = look(LIGHT, &scattering);
    let matter = |p: DVec3| slab(10.0, 30.0)(p) * if p.x > 24.0 { 1.0 } else { 0.4 };
    let (arriving, scattered) = (
        lit(&device, &look(LIGHT, GREY), matter, Slot::LightArriving),
        lit(&device, &scene, matter, Slot::LightScattered),
    );
    let largest = |light: &Texels| light.values.chunks_exact(4).map(|c| c[1]).fold(0.0, f64::max);
    assert!(largest(&scattered) <= largest(&arriving) * 1.001);
    // Deep in the slab light arrives from its brighter side.
    let deep = DVec3::new(40.0, 20.0, 15.0);
    assert!(at(&scene, &scattered, deep)[1] > 1.05 * at(&scene, &arriving, deep)[1]);
    let empty = lit(&device, &scene, |_| 0.0, Slot::LightScattered);
    assert!(empty.values.chunks_exact(4).all(|c| c[..3].iter().all(|v| (v - 1.0).abs() < 1e-3)));
}

/// Prevents light from a wrong place where two steps of a ray share it: a step further it differs by a fifth here. The picture of a ball comes to within a quarter
/// of a level of 8 bits (root of the mean square) of that of steps a tenth as long, whether steps share light or, with slightly smaller cells, do not.
#[test]
fn two_steps_that_share_their_light_have_that_of_their_middle() {
    let device = Device::new();
    let of = |step: f64, cell: f64| {
        let grey = GREY.replace("cell = 1", &format!("cell = {cell}"));
        look_with(
            &format!("ray.step = {step}\npost.floats = true"),
            "follows = 'region', direction = [0.6, 0.8, 0]",
            &grey,
        )
    };
    let picture = |scene: &Scene| lit(&device, scene, ball(DVec3::new(23.5, 19.5, 21.5), 14.0), Slot::Picture);
    let error = |step: f64, cell: f64| {
        let (coarse, fine) = (picture(&of(step, cell)), picture(&of(step / 10.0, cell)));
        let squares: f64 = coarse.values.iter().zip(&fine.values).map(|(a, b)| (a - b).powi(2)).sum();
        (squares / coarse.values.len() as f64).sqrt()
    };
    assert_eq!([of(0.5, 1.0), of(0.5, 0.99)].map(|scene| scene.lit_steps()), [2, 1]);
    let (shared, single) = (error(0.5, 1.0), error(0.5, 0.99));
    assert!(single > 0.0 && single.max(shared) < 1e-3, "shared {shared}, single {single}");
    // A GPU takes one step after the other; too little shared memory for anything else to differ.
    let together = of(0.5, 1.0);
    let one_by_one = Scene { device: DeviceFacts { shared_memory: 1, ..together.device }, ..together.clone() };
    assert!(picture(&together) == picture(&one_by_one));
}

/// Prevents a surface, or light, where the region ends: in what is the same everywhere nothing has an orientation, however many cells fit into the box.
#[test]
fn a_face_of_the_region_is_no_surface_in_any_lattice() {
    let device = Device::new();
    for cell in [0.9, 1.0, 1.3, 2.0, 2.9] {
        let scene = look(LIGHT, &GREY.replace("cell = 1", &format!("cell = {cell}")));
        let matter = lit(&device, &scene, |_| 0.6, Slot::LightMatter);
        let [least, most] =
            matter.values.chunks_exact(2).fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(v[0]), b.max(v[0])]);
        assert!((0.59..0.61).contains(&least) && most - least < 1e-3, "{cell} mm: densities of {least} to {most}");
        let normals = lit(&device, &scene, |_| 0.6, Slot::LightNormals);
        let longest = normals.values.chunks_exact(4).map(|v| v[0].hypot(v[1]).hypot(v[2])).fold(0.0, f64::max);
        assert!(longest < 1e-2, "{cell} mm: an orientation of {longest}");
    }
}

/// Prevents cones of ambient light that narrow with the cells: their light was that of another width in every lattice, and its limit that of four points of each
/// cone. Cells half as large differ by what a cell shows less of the ball.
#[test]
fn ambient_light_converges_with_the_cells() {
    let device = Device::new();
    let middle = DVec3::new(23.5, 19.5, 21.5);
    let of = |cell: f64| {
        let grey = GREY.replace("cell = 1", &format!("cell = {cell}, reach = 14"));
        let scene = look("follows = 'region', direction = [0, 1, 0], ambient = 1", &grey);
        let light = lit(&device, &scene, ball(middle, 9.0), Slot::LightAmbient);
        // The ambient light's own lattice has cells of twice the edge.
        let (low, edge) = (scene.light_lattice().low, 2.0 * scene.light_lattice().cell);
        let at = |place: DVec3| {
            let cells = (place - low) / edge - 0.5;
            light.interpolated(std::array::from_fn(|a| cells[a].clamp(0.0, (light.size[a] - 1) as f64)))[3]
        };
        // Of matter alone: where none is near, every lattice by its own cells, nothing is lit and no light is looked for.
        let places = (0..13).flat_map(|i| (0..13).flat_map(move |j| (0..13).map(move |k| [i, j, k])));
        let places = places.map(|n| 1.5 * (DVec3::from(n.map(f64::from)) - 6.0)).filter(|from| from.length() < 9.0);
        places.map(|from| at(middle + from)).collect::<Vec<_>>()
    };
    let rms =
        |a: &[f64], b: &[f64]| (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64).sqrt();
    // The widths of cones lie between those of two levels for the third alone.
    let [coarse, usual, between, fine] = [1.12, 0.56, 0.4, 0.28].map(of);
    let off = [&coarse, &usual, &between].map(|light| rms(light, &fine));
    println!("ambient light, cells of 1.12, 0.56 and 0.4 mm, from that of 0.28 mm: {off:.4?}");
    let [least, most] = usual.iter().fold([f64::MAX, 0.0f64], |[a, b], v| [a.min(*v), b.max(*v)]);
    assert!(least < 0.4 && most > 0.7, "light and shadow: {least} to {most}");
    // Were they of first order, the second would be 1/3 of the first. What is between two levels is an average of two widths.
    assert!(off[0] < 0.03 && off[1] < 0.2 * off[0] && off[2] < 0.5 * off[0], "{off:?}");
}
