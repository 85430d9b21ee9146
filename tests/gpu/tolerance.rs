//! Pictures that state their error, against exact rays through the same texture: the share of the pixels that state so much is right in many scenes,
//! and what is certain is exact.

use crate::common::gpu::*;
use echolume::low_level::exact_ray::picture::{self, Effort};
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::postprocess::toned;
use echolume::low_level::passes::raycast::tolerance::LEVELS;
use echolume::low_level::passes::{Arrays, Slot, Texels, slots};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::StoredType;
use echolume::low_level::stated_error::Stated;
use echolume::low_level::verify::built_in;

/// Settings that all scenes begin with: the format and the table leave little error of their own, and rays are as close to each other as in a picture of some
/// hundred pixels.
const BASE: &str =
    "mode=vr & picture.size=[24,22] & slices.format=r32f & ray.sampling=exact & slices.pixels=32 & camera.zoom=4";

/// Looks: soft and hard, thin and opaque, in mist and behind thresholds.
const LOOKS: [&str; 5] = [
    "volume.entries=4096 & volume.transfer=[{at=0.05,colour=[0.2,0.15,0.1],opacity=0},{at=0.2,colour=[0.8,0.65,0.5],opacity=0.1},{at=0.6,colour=[1,0.97,0.88],opacity=0.4}]",
    "volume.entries=4096 & volume.transfer=[{at=0.42,colour=[0.9,0.1,0.05],opacity=0},{at=0.5,colour=[0.1,0.8,0.4],opacity=1}] & post.gamma=1.6",
    "volume.entries=4096 & volume.transfer=grey & volume.extinction=0.3",
    "volume.entries=1024 & volume.compositing=pre-integrated & volume.transfer=bone & volume.shading=depth-coded",
    "volume.entries=1024 & volume.compositing=pre-integrated & volume.threshold=0.3 & volume.transfer=warm & post.contrast=1.5",
];

/// Views with their tolerance.
const VIEWS: [(&str, f64); 2] = [
    ("camera.azimuth=25 & camera.elevation=-30 & ray.step=1.5", 1.0),
    ("camera.azimuth=-140 & camera.field_of_view=40 & ray.step=4 & ray.brick=4 & region.fade=4", 2.0),
];

fn scene_of(geometry: &Geometry, assignments: &str) -> Scene {
    let mut layers = Layers::default();
    for assignment in assignments.split(" & ") {
        layers.set(assignment).expect("a setting");
    }
    let input = Input { stored: StoredType::F32, range: [0.0, 1.0] };
    Scene::new(geometry.clone(), input, layers.finish().expect("settings")).expect("a scene")
}

/// A wall, a ball in fluid, and speckle.
fn echo(p: glam::DVec3) -> f64 {
    let ball = (p - glam::DVec3::new(1.0, 26.0, -1.0)).length();
    let speckle = (1.9 * p.x + 0.7 * p.y).sin() * (1.3 * p.y - 0.9 * p.z).sin() * (2.3 * p.z + 0.5 * p.x).cos();
    let wall = if p.y < 10.0 + 3.0 * (0.3 * p.x).sin() { 0.55 } else { 0.0 };
    (wall + 0.75 * ((13.0 - ball) / 3.0).clamp(0.0, 1.0) + 0.07 * speckle).clamp(0.0, 1.0)
}

fn drawn(device: &Device, scene: &Scene, frames: &[Texels]) -> Renderer {
    let mut renderer = rendered(device, scene.clone(), frames);
    renderer.picture().expect("picture");
    renderer
}

/// What a picture states, the error that each pixel has and states, levels.
struct Found {
    stated: Stated,
    size: [usize; 2],
    pixels: Vec<[f64; 2]>,
}

impl Found {
    fn of(renderer: &mut Renderer) -> Found {
        let scene = renderer.scene().clone();
        let tolerance = scene.tolerance().expect("a tolerance");
        let [errors, marks] = Stated::SLOTS.map(|slot| renderer.read(slot).expect("read").expect("there"));
        let drawn = renderer.read(slots::rendered(&scene)).expect("read").expect("there");
        let volume = renderer.read(Slot::of_rays(&scene)).expect("read").expect("there");
        let mut settings = scene.settings.clone();
        settings.ray.tolerance = 0.0;
        let plain = Scene::new(scene.geometry.clone(), scene.input, settings).expect("scene");
        let (mut reads, mut exact, mut effort) = (Arrays::default(), Arrays::default(), Effort::default());
        reads.insert("volume", volume);
        exact.insert("picture", Texels::untouched(drawn.size, 4));
        assert!(picture::replace(&plain, "raycast_volume", &reads, &mut exact, &mut effort));
        let shown = |rgba: &[f64]| if rgba[3] > 0.0 { toned(&scene, [rgba[0], rgba[1], rgba[2]]) } else { [0.0; 3] };
        let pairs = drawn.values.chunks_exact(4).zip(exact.get("picture").values.chunks_exact(4)).zip(&errors.values);
        let pixels = pairs.map(|((a, b), stated)| {
            let (a, b) = (shown(a), shown(b));
            let off = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
            [off * LEVELS, stated * LEVELS]
        });
        let [width, height, _] = errors.size;
        Found { stated: Stated::new(&errors, &marks, tolerance), size: [width, height], pixels: pixels.collect() }
    }

    /// Share of the pixels that the lattice has rays for, and of the last row and column where these lie behind it.
    fn of_lattice(&self) -> f64 {
        let [width, height] = self.size;
        let [columns, rows] = [width.div_ceil(2), height.div_ceil(2)];
        let between = (2 * columns - 1) * (2 * rows - 1) - columns * rows;
        1.0 - between as f64 / (width * height) as f64
    }

    /// Share of the pixels whose error is at most so many levels.
    fn share_within(&self, levels: f64) -> f64 {
        self.pixels.iter().filter(|[off, _]| *off <= levels).count() as f64 / self.pixels.len() as f64
    }
}

/// The share that a picture states holds in each of 50 scenes: geometries of probes and voxels, looks and views. Pixels that are certain are those of exact rays
/// to the rounding of their format. The plain picture of the same step is further off, or the test would say nothing.
#[test]
fn the_stated_share_holds_in_fifty_scenes() {
    let device = Device::new();
    let mut faults = Vec::new();
    let (mut scenes, mut refined, mut plain_is_worse, mut certain) = (0, 0, 0, 0);
    let swept = ["fan", "fan, motor moving", "linear array, translated", "radial array, translated"];
    let mut geometries: Vec<_> = built_in::geometries().into_iter().filter(|(name, _)| swept.contains(name)).collect();
    geometries.push(("voxels", cartesian([24, 26, 15])));
    for (name, geometry) in &geometries {
        for ((view, tolerance), look) in VIEWS.iter().flat_map(|view| LOOKS.iter().map(move |look| (view, look))) {
            let plain = scene_of(geometry, &format!("{BASE} & {look} & {view}"));
            let stating = scene_of(geometry, &format!("{BASE} & {look} & {view} & ray.tolerance={tolerance}"));
            let frames = built_in::body_frames(&plain, echo);
            let mut renderer = drawn(&device, &stating, &frames);
            let found = Found::of(&mut renderer);
            let what = format!("{name}, {look}, {view}");
            let held = found.share_within(*tolerance);
            let worst =
                found.pixels.iter().fold([0.0; 2], |worst, pixel| if pixel[0] > worst[0] { *pixel } else { worst });
            println!("{held:.4} within {tolerance}, {worst:.3?}; {} {what}", found.stated);
            if held < found.stated.kept() {
                faults.push(format!("{what}: {held:.4} of the pixels; {}", found.stated));
            }
            // The picture is stored in halves: 2^-11 of a value below 1.
            let exact = found.pixels.iter().filter(|[_, stated]| *stated == 0.0);
            assert!(exact.clone().all(|[off, _]| *off < 0.2), "{what}: {:?}", exact.map(|p| p[0]).fold(0.0, f64::max));
            certain += usize::from(found.stated.certain > 0.0);
            refined += usize::from(found.stated.with_rays > found.of_lattice());
            scenes += 1;
            // By the same picture without its tolerance.
            renderer.change(plain.clone()).expect("change");
            let coarse = renderer.picture().expect("picture");
            renderer.change(stating.clone()).expect("change");
            let better = renderer.picture().expect("picture");
            let differs = coarse.rgba.iter().zip(&better.rgba).any(|(a, b)| f64::from(a.abs_diff(*b)) > *tolerance);
            plain_is_worse += usize::from(differs);
        }
    }
    assert!(faults.is_empty(), "{} scenes:\n{}", faults.len(), faults.join("\n"));
    println!(
        "{scenes} scenes, {refined} with rays between those of the lattice, {certain} with certain pixels, {plain_is_worse} changed"
    );
    assert!(scenes == 50 && refined >= 40 && certain >= 15 && plain_is_worse >= 30);
}

/// A tolerance that every pixel keeps at once refines none: the dispatch has no workgroup. One that few can keep lists all that it marks.
#[test]
fn the_list_has_what_is_marked() {
    let device = Device::new();
    let (_, geometry) = &built_in::geometries()[0];
    let of = |tolerance: f64| scene_of(geometry, &format!("{BASE} & {} & ray.tolerance={tolerance}", LOOKS[2]));
    let frames = built_in::body_frames(&of(1.0), echo);
    let mut renderer = drawn(&device, &of(64.0), &frames);
    let found = Found::of(&mut renderer);
    assert!((found.stated.with_rays - found.of_lattice()).abs() < 1e-9, "{}", found.stated);
    renderer.change(of(0.01)).expect("change");
    renderer.picture().expect("picture");
    let found = Found::of(&mut renderer);
    let marks = renderer.read(Slot::ErrorMarks).expect("read").expect("there");
    let listed = renderer.read(Slot::RefineGroups).expect("read").expect("there");
    let marked: u32 = marks.values.iter().map(|word| (*word as u32).count_ones()).sum();
    assert_eq!(listed.values, [f64::from(marked.div_ceil(64)), 1.0, 1.0, f64::from(marked)]);
    // What is flat keeps even so little.
    assert!(found.stated.with_rays > found.of_lattice() + 0.1, "{}", found.stated);
}
