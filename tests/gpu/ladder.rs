//! The quality ladder of a moving view: no rung shows a hole or a part that the full picture has not.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Renderer, RendererOptions, TimeStamps};
use echolume::low_level::passes::{chain, is_hit, slots};
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::{Geometry, Probe};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Mode, Scene, Settings};
use echolume::low_level::source::Frame;
use echolume::low_level::source::phantom::{Phantom, PhantomOptions};
use echolume::low_level::ui::frame_budget::built_in_ladder;
use std::sync::LazyLock;

/// Largest part by which the hit mask of a rung may differ from that of the full picture, mm^2 in the picture plane.
const LARGEST_MM2: f64 = 20.0;

/// Where rays hit something.
#[derive(Clone)]
struct Mask {
    size: [usize; 2],
    hits: Vec<bool>,
}

impl Mask {
    /// Of the last picture: where the distance map ends, or where more than half of the light of a ray is that of the volume.
    fn of(renderer: &mut Renderer) -> Mask {
        let scene = renderer.scene().clone();
        let is_surface = scene.settings.mode == Mode::Surface;
        let slot = if is_surface { chain::distance_end(&scene) } else { slots::rendered(&scene) };
        let texels = renderer.read(slot).expect("read").expect("there");
        let size = [texels.size[0], texels.size[1]];
        let hit = |x, y| if is_surface { is_hit(texels.one(x, y, 0)) } else { texels.get([x, y, 0])[3] > 0.5 };
        let hits = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| hit(x, y)).collect();
        Mask { size, hits }
    }

    fn at(&self, x: usize, y: usize) -> bool {
        self.hits[y * self.size[0] + x]
    }

    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let [width, height] = self.size;
        (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
    }

    /// With so many pixels a side in one: hit where most of them are.
    fn reduced(&self, apart: usize) -> Mask {
        let size = self.size.map(|n| n.div_ceil(apart));
        let most = |x: usize, y: usize| {
            let columns = x * apart..((x + 1) * apart).min(self.size[0]);
            let rows = y * apart..((y + 1) * apart).min(self.size[1]);
            let all = columns.len() * rows.len();
            2 * rows.flat_map(|y| columns.clone().map(move |x| (x, y))).filter(|(x, y)| self.at(*x, *y)).count() >= all
        };
        let hits = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(|(x, y)| most(x, y)).collect();
        Mask { size, hits }
    }

    /// The pixel and its neighbours.
    fn around(&self, x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let [width, height] = self.size;
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)))
    }

    fn is_border(&self, x: usize, y: usize) -> bool {
        self.around(x, y).any(|(i, j)| self.at(i, j) != self.at(x, y))
    }

    /// Pixels of the largest 8-connected part in which another mask differs, without the borders of this one: a border that moves by less than a
    /// pixel is no other anatomy.
    fn largest_difference(&self, other: &Mask) -> usize {
        assert_eq!(self.size, other.size);
        let differs = |x: usize, y: usize| self.at(x, y) != other.at(x, y) && !self.is_border(x, y);
        let mut open: Vec<bool> = self.places().map(|(x, y)| differs(x, y)).collect();
        let mut largest = 0;
        for (x, y) in self.places() {
            let (mut part, mut next) = (0, vec![(x, y)]);
            while let Some((x, y)) = next.pop() {
                if std::mem::take(&mut open[y * self.size[0] + x]) {
                    part += 1;
                    next.extend(self.around(x, y));
                }
            }
            largest = largest.max(part);
        }
        largest
    }
}

/// A volume of the phantom, computed once for all tests.
static VOLUME: LazyLock<(Probe, Vec<Frame>)> = LazyLock::new(|| {
    let phantom = Phantom::new(PhantomOptions { still: true, ..PhantomOptions::default() }).expect("phantom");
    (phantom.probe(0), phantom.volume(0))
});

/// What draws it.
pub struct Stage {
    device: Device,
}

impl Stage {
    pub fn new() -> Stage {
        Stage { device: Device::new() }
    }

    /// The phantom in a look: preset, mode and size of the picture. A ground behind the volume would make every ray opaque.
    pub fn scene(&self, (preset, mode, size): (&str, &str, [u32; 2]), view: &str) -> Scene {
        let mut layers = Layers::default();
        layers.preset(preset).expect("preset");
        let look = [format!("mode={mode}"), format!("picture.size={size:?}"), "slices.everything=true".into()];
        look.iter().for_each(|set| layers.set(set).expect("set"));
        if preset == "face" {
            layers.set("light.volume.ground=none").expect("set");
        }
        view.split(';').filter(|set| !set.is_empty()).for_each(|set| layers.set(set).expect("set"));
        let geometry = Geometry::Sweep(VOLUME.0.clone());
        Scene::new(geometry, BYTES, layers.finish().expect("settings")).expect("scene")
    }

    pub fn renderer(&self, scene: Scene) -> Renderer {
        let options = RendererOptions { time_stamps: TimeStamps::EachPass, ..RendererOptions::default() };
        let mut renderer = Renderer::new(&self.device, scene, &options).expect("renderer");
        send(&mut renderer);
        renderer
    }
}

fn send(renderer: &mut Renderer) {
    for frame in &VOLUME.1 {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
}

/// Changes the scene, whatever its look, and draws it: one renderer for all looks compiles what they share once.
pub fn draw(renderer: &mut Renderer, scene: &Scene) {
    if !matches!(renderer.change(scene.clone()).expect("change"), Rerun::Steps { .. }) {
        send(renderer);
    }
    renderer.picture().expect("picture");
}

/// Of a change that needs no frames again, as that to another rung.
fn drawn(renderer: &mut Renderer, scene: &Scene) -> Mask {
    renderer.change(scene.clone()).expect("change");
    renderer.picture().expect("picture");
    Mask::of(renderer)
}

/// Area of the largest part by which a coarse picture of these settings differs from the full one, mm^2.
fn false_area(renderer: &mut Renderer, full: &Scene, whole: &Mask, settings: Settings) -> f64 {
    let coarse = Scene::new(full.geometry.clone(), full.input, settings).expect("scene");
    let mask = drawn(renderer, &coarse);
    let ray = coarse.rays.origin_dx.length();
    whole.reduced(coarse.settings.ray.subsampling as usize).largest_difference(&mask) as f64 * ray * ray
}

/// Turned views, and clip planes on their way through the head.
const VIEWS: [&str; 8] = [
    "",
    "camera.azimuth=35;camera.elevation=-25",
    "clip=[{at=[4,45,2],normal=[0.3,-1,0.2]}]",
    "clip=[{at=[4,55,2],normal=[0.3,-1,0.2]}]",
    "clip=[{at=[0,69,-1],normal=[0.3,-1,0.2]}]",
    "clip=[{at=[4,52,2],normal=[1,-0.4,0.2]}]",
    "clip=[{at=[4,50,17],normal=[0,-0.3,1]}]",
    "clip=[{at=[14,52,2],normal=[1,-0.4,0.2]}];camera.azimuth=-35",
];

/// Prevents a hole that is not there while a clip plane is dragged.
#[test]
fn no_rung_shows_other_anatomy() {
    let stage = Stage::new();
    let (small, window) = ([370, 362], [742, 724]);
    let mut renderer = stage.renderer(stage.scene(("face-classic", "sr", small), ""));
    for (preset, mode, size, views) in [
        ("face-classic", "sr", small, &VIEWS[..]),
        ("face-classic", "vr", small, &VIEWS[1..6]),
        ("face", "vr", small, &VIEWS[2..5]),
        ("face", "sr", small, &VIEWS[..]),
        ("face-classic", "sr", window, &VIEWS[4..6]),
        ("face", "sr", window, &VIEWS[6..7]),
    ] {
        for view in views {
            let full = stage.scene((preset, mode, size), view);
            draw(&mut renderer, &full);
            let whole = Mask::of(&mut renderer);
            let mut last = full.settings.clone();
            for rung in &built_in_ladder()[1..] {
                let settings = rung.apply(&full.settings);
                if settings == last {
                    continue;
                }
                last = settings.clone();
                let area = false_area(&mut renderer, &full, &whole, settings);
                println!("{preset} {mode} {size:?} {view}: {}: {area:.1} mm^2", rung.label());
                assert!(area <= LARGEST_MM2, "{preset} {mode} {size:?} {view}: {}: {area} mm^2", rung.label());
            }
        }
    }
}

/// The mask test sees what the ladder did before: without filters, and with as few rays in a small window, holes open.
#[test]
fn without_filters_and_with_fewer_rays_holes_open() {
    let stage = Stage::new();
    let look = ("face-classic", "sr", [185, 181]);
    let full = stage.scene(look, VIEWS[4]);
    let mut renderer = stage.renderer(full.clone());
    let whole = drawn(&mut renderer, &full);
    let mut plain = full.settings.moving();
    plain.ray.subsampling = 4;
    plain.distance = Default::default();
    let plain = false_area(&mut renderer, &full, &whole, plain);
    let rung = built_in_ladder().pop().expect("rungs").apply(&full.settings);
    let kept = false_area(&mut renderer, &full, &whole, rung);
    println!("a quarter without filters {plain:.1} mm^2, the last rung {kept:.1} mm^2");
    assert!(plain > LARGEST_MM2 && kept <= LARGEST_MM2, "{plain} {kept}");
}

/// What is not a hole: a border that moves by a pixel. What is one: pixels within.
#[test]
fn the_mask_test_counts_parts_within_borders() {
    let disc = |radius: f64| {
        let hits = (0..40 * 40).map(|i| f64::from(i % 40 - 20).hypot(f64::from(i / 40 - 20)) < radius).collect();
        Mask { size: [40, 40], hits }
    };
    assert_eq!(disc(12.0).largest_difference(&disc(12.4)), 0);
    let mut holed = disc(12.0);
    for (x, y) in [(20, 20), (21, 21), (22, 20), (25, 20)] {
        holed.hits[y * 40 + x] = false;
    }
    assert_eq!(disc(12.0).largest_difference(&holed), 3, "corners connect");
    let reduced = disc(12.0).reduced(4);
    assert_eq!((reduced.size, reduced.at(5, 5), reduced.at(0, 0)), ([10, 10], true, false));
}
