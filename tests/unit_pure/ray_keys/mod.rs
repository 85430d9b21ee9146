//! Exact rays and proven bounds honour or refuse every setting that a ray reads. The list of settings is that of their declaration ([`keys`]):
//! each is changed alone, and many of them together at random, and what exact rays and bounds say is compared with rays of 100 000 samples
//! ([`samples`]); surfaces with the detector's own reference at a fine step.

mod keys;
mod samples;

use crate::common::probes::wobbler;
use crate::common::scenes::FLOATS;
use echolume::low_level::bounds;
use echolume::low_level::exact_ray::picture::{self, Effort};
use echolume::low_level::passes::{Arrays, DispatchArgs, MISS, PASSES, Stage, Texels, by_name, is_hit};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Grid, Indices, Motion, Probe};
use echolume::low_level::reference;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Edge, Mode, Scene, SurfaceColour};
use echolume::low_level::statistics::mix;
use glam::DVec3;
use keys::{Key, Of, declared, keys};
use rayon::prelude::*;
use samples::Samples;
use std::sync::LazyLock;

/// Settings that all scenes begin with: small, and neither transparent nor opaque. Edges of surfaces are shorter than structures.
const BASE: &str = "mode=volume & picture.size=[5,4] & slices.pixels=24 & camera.azimuth=25.0 & camera.elevation=-30.0 & \
                    camera.zoom=1.3 & surface.edge=3.0 & surface.threshold=0.12 & volume.transfer=[{at=0.1,colour=[0.9,0.2,0.1],opacity=0.0},\
                    {at=0.3,colour=[0.2,0.8,0.3],opacity=0.08},{at=0.6,colour=[0.3,0.4,1.0],opacity=0.3},{at=1.0,colour=[1,1,0.7],opacity=0.5}]";

/// Passes of stage 2 that cast rays through the volume, and the others.
const CASTS_RAYS: [&str; 6] = [
    "raycast_volume",
    "raycast_refined",
    "raycast_surface",
    "raycast_surface_and_volume",
    "raycast_projection",
    "raycast_cap",
];
/// Planes and the block cast none; bricks and marks of edges tell which rays and samples can be left out; light volumes, stills and the consistent detector are refused.
const CASTS_NONE: [&str; 27] = [
    "raycast_planes",
    "raycast_candidates",
    "surface_paths",
    "choose_surface",
    "raycast_planes_toned",
    "raycast_cube",
    "mark_edges",
    "tolerance_first",
    "tolerance_enlarge",
    "tolerance_list",
    "tolerance_refine",
    "classify_bricks_surface",
    "classify_bricks_volume",
    "brick_distance_surface",
    "brick_distance_volume",
    "light_matter",
    "light_reduce",
    "light_propagate",
    "light_propagate_back",
    "light_diffuse",
    "light_ambient",
    "light_shade",
    "still_majorants",
    "still_begin",
    "still_paths",
    "still_resolve",
    "raycast_still",
];

/// Numbers in 0..1, the same in every run (SplitMix64; Steele, Lea, Flood 2014).
struct Draw(u64);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn of(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize % count
    }
}

/// A body in a geometry: its frames.
struct Body {
    geometry: Geometry,
    frames: Vec<Texels>,
}

/// A fan, voxels, a fan whose motor moves during a frame, and a linear array that is translated.
static BODIES: LazyLock<Vec<Body>> = LazyLock::new(|| {
    let translated = Probe {
        array: Array::Linear,
        lines: Axis::centred(1.8, 22),
        motion: Motion::Translated,
        slices: Axis::centred(3.0, 9),
        ..wobbler()
    };
    let voxels = Grid { size: [20, 22, 12], spacing: [2.0, 2.2, 2.4], origin: [-20.0, 0.0, -14.0] };
    let geometries = [
        Geometry::Sweep(wobbler()),
        Geometry::Cartesian(voxels),
        Geometry::Sweep(Probe { advance: Advance::Same(0.05), ..wobbler() }),
        Geometry::Sweep(translated),
    ];
    geometries.into_iter().map(|geometry| Body { frames: frames(&geometry), geometry }).collect()
});

/// Echo of a place, mm below the probe's face in depth: a wall, fluid, a ball in it, a speck, and speckle all over.
fn echo([x, y, z]: [f64; 3]) -> f64 {
    let ball = DVec3::new(x - 1.0, y - 26.0, z + 1.0).length();
    let speck = DVec3::new(x + 17.0, y - 20.0, z - 3.0).length();
    let speckle = (1.9 * x + 0.7 * y).sin() * (1.3 * y - 0.9 * z).sin() * (2.3 * z + 0.5 * x).cos();
    let tissue =
        if y < 10.0 + 3.0 * (0.3 * x).sin() { 0.55 } else { 0.0 } + 0.75 * ((13.0 - ball) / 3.0).clamp(0.0, 1.0);
    (0.08 + tissue + 0.8 * (3.5 - speck).clamp(0.0, 1.0) + 0.07 * speckle).clamp(0.0, 1.0)
}

fn frames(geometry: &Geometry) -> Vec<Texels> {
    let frame = |slice: usize| match geometry {
        Geometry::Cartesian(grid) => Texels::from_fn([grid.size[0], grid.size[1], 1], 1, |[i, j, _], _| {
            let at = [i, j, slice];
            echo(std::array::from_fn(|axis| grid.origin[axis] + grid.spacing[axis] * at[axis] as f64))
        }),
        Geometry::Sweep(probe) => Texels::from_fn([probe.samples, probe.lines.len(), 1], 1, |[i, j, _], _| {
            let at = Indices { sample: i as f64, line: j as f64, slice: slice as f64 };
            let place = probe.to_space(at);
            echo([place.x, place.y - probe.array_radius(), place.z])
        }),
    };
    (0..geometry.slices()).map(frame).collect()
}

/// The scene of some assignments over [`BASE`].
fn scene_of(body: &Body, assignments: &str) -> Result<Scene, String> {
    let mut layers = Layers::default();
    for assignment in format!("{BASE} & {assignments}").split(" & ").map(str::trim).filter(|a| !a.is_empty()) {
        layers.set(assignment).map_err(|e| e.to_string())?;
    }
    let settings = layers.finish().expect("settings");
    let input = FLOATS.in_range_of(&settings, 0.0);
    // The sample range is a part of how frames are read: a texture yields stored values.
    Scene::new(body.geometry.clone(), input, settings).map_err(|e| e.to_string())
}

/// Calls `each` with the passes of stage 2 that cast rays, in their order; it makes what they write. Stages 3 and 4 are left out.
fn cast(body: &Body, scene: &Scene, mut each: impl FnMut(&str, &Arrays, &mut Arrays)) {
    reference::render_with(scene, &body.frames, &mut |pass, reads, writes| {
        let stage = by_name(pass).map(|p| p.stage);
        if !CASTS_RAYS.contains(&pass) {
            return matches!(stage, Some(Stage::Shade | Stage::Postprocess));
        }
        each(pass, reads, writes);
        true
    });
}

fn by_reference(scene: &Scene, pass: &str, reads: &Arrays, writes: &mut Arrays) {
    by_name(pass).expect("a pass").reference(scene, &DispatchArgs::default(), reads, writes);
}

/// What exact rays make of a scene: name of the pass, of the array, and texels.
type Made = Vec<(String, Texels)>;

/// Exact rays of a scene, a few of them compared with very many samples; and of volume rendering the bounds.
#[derive(Default)]
struct Checked {
    made: Made,
    rays: usize,
    bounded: usize,
    /// Rays with the surface of the detector at a fine step, and others.
    surfaces: [usize; 2],
    /// What is wrong, a line each.
    faults: Vec<String>,
}

impl Checked {
    fn add(mut self, other: Checked) -> Checked {
        self.rays += other.rays;
        self.bounded += other.bounded;
        self.surfaces = [0, 1].map(|n| self.surfaces[n] + other.surfaces[n]);
        self.faults.extend(other.faults);
        self
    }

    /// Fails if anything is wrong. `most`: the largest share of surfaces elsewhere, since an edge as high as the threshold may be found or not.
    fn assert_right(&self, most: f64) {
        let ([right, wrong], faults) = (self.surfaces, &self.faults);
        println!(
            "{} rays, {} with bounds, {right} surfaces as those of fine samples, {wrong} not",
            self.rays, self.bounded
        );
        assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(30)].join("\n"));
        let share = wrong as f64 / (right + wrong) as f64;
        assert!(share <= most, "{wrong} of {} rays have another surface than that of fine samples", right + wrong);
    }
}

/// `rays`: how many are compared.
fn check(body: &Body, scene: &Scene, rays: usize, draw: &mut Draw) -> Checked {
    let mut checked = Checked::default();
    cast(body, scene, |pass, reads, writes| {
        let mut effort = Effort::default();
        match picture::replace(scene, pass, reads, writes, &mut effort) {
            true if effort.pieces == 0 && meets_something(writes) => {
                checked.faults.push(format!("{pass}: {} exact rays of 0 pieces", effort.rays));
            }
            true => {}
            false if pass == "raycast_cap" => by_reference(scene, pass, reads, writes),
            false => checked.faults.push(format!("{pass}: no exact ray")),
        }
        checked.made.extend(writes.iter().map(|(name, texels)| (format!("{pass}.{name}"), texels.clone())));
        match pass {
            _ if rays == 0 => {}
            "raycast_projection" => projections(scene, reads, writes, rays, draw, &mut checked),
            "raycast_cap" => {}
            _ => {
                if pass != "raycast_volume" && pass != "raycast_refined" {
                    surfaces(scene, reads, writes, &mut checked);
                }
                if pass != "raycast_surface" {
                    lights(scene, pass, reads, writes, rays, draw, &mut checked);
                }
            }
        }
    });
    checked
}

/// True if there is light on a picture, or a surface on a map of distances, that is not of a cut face alone.
fn meets_something(writes: &Arrays) -> bool {
    writes.iter().any(|(name, texels)| match name {
        "picture" => texels.values.iter().any(|v| *v > 0.0),
        "distance_map" => texels.values.iter().any(|v| is_hit(*v)),
        _ => false,
    })
}

/// One of the texels that are of interest, if there are any, and others, `count` in all.
fn chosen(
    size: [usize; 3],
    count: usize,
    draw: &mut Draw,
    is_of_interest: impl Fn([usize; 3]) -> bool,
) -> Vec<[usize; 3]> {
    let at = |n: usize| [n % size[0], n / size[0], 0];
    let all = size[0] * size[1];
    let lit: Vec<usize> = (0..all).filter(|n| is_of_interest(at(*n))).collect();
    let of_interest = (!lit.is_empty()).then(|| lit[draw.of(lit.len())]);
    let others: Vec<usize> = (0..count).map(|_| draw.of(all)).collect();
    let mut found: Vec<usize> = of_interest.into_iter().chain(others).take(count).collect();
    found.dedup();
    found.into_iter().map(at).collect()
}

/// Beginning and direction of the ray of a texel; `apart`: rays between two texels.
fn ray(scene: &Scene, [x, y, _]: [usize; 3], apart: f64) -> [DVec3; 2] {
    let (origin, direction) = scene.rays.at((x as f64 + 0.5) * apart, (y as f64 + 0.5) * apart);
    [origin, direction]
}

/// What a ray of volume rendering shows by samples, and whether it begins at a cut face.
fn sampled(scene: &Scene, pass: &str, reads: &Arrays, at: [usize; 3], apart: f64) -> (samples::Light, bool) {
    let volume = &scene.settings.volume;
    let samples = Samples::new(scene, reads.get("volume"), volume.window, volume.start_depth);
    let surface = &scene.settings.surface;
    let ends = match scene.settings.mode {
        Mode::Mixed => [0.0, reads.get("distance_map").one(at[0], at[1], 0)],
        // The march that finds the surface composites whole rays, for the other half of a pair.
        Mode::Surface if surface.colour == SurfaceColour::Behind && pass != "raycast_surface_and_volume" => {
            let found = reads.get("distance_map").one(at[0], at[1], 0);
            [found, found + surface.colour_depth]
        }
        _ => [0.0, MISS],
    };
    let mut light = samples.light(ray(scene, at, apart), ends);
    let cut = scene.has_caps().then(|| reads.get("cap").get(at)).filter(|cut| cut[1] > 0.0);
    if let Some([echo, opacity]) = cut {
        let behind = if *opacity >= 1.0 { [0.0; 4] } else { light.rgba };
        let face = [*echo, *echo, *echo, 1.0];
        light.rgba = std::array::from_fn(|c| opacity * face[c] + (1.0 - opacity) * behind[c]);
    }
    (light, cut.is_some())
}

/// Compares rays of volume rendering with exact ones, and with their bounds.
fn lights(
    scene: &Scene,
    pass: &str,
    reads: &Arrays,
    writes: &Arrays,
    rays: usize,
    draw: &mut Draw,
    checked: &mut Checked,
) {
    let picture = writes.get("picture");
    let of_a_pixel = scene.settings.ray.rays;
    let adapts = scene.adapts_rays() && pass == "raycast_volume";
    let is_cast = |at: [usize; 3]| {
        pass != "raycast_refined"
            || reads.get("marks").one(at[0] / of_a_pixel as usize, at[1] / of_a_pixel as usize, 0) != 0.0
    };
    let bounds = (pass == "raycast_volume" && !adapts && bounds::fault(scene).is_none())
        .then(|| bounds::picture(scene, reads.get("volume"), bounds::Effort { width: 0.05, parts: 120 }));
    for at in chosen(picture.size, rays, draw, |at| picture.get(at)[3] > 0.02).into_iter().filter(|at| is_cast(*at)) {
        let (light, is_cut) = sampled(scene, pass, reads, at, if adapts { f64::from(of_a_pixel) } else { 1.0 });
        // Of a volume that stage 3 lights, faces come later.
        if is_cut && scene.lights_volume() {
            continue;
        }
        let exact = picture.get(at);
        let off = exact.iter().zip(light.rgba).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if off.is_nan() || off > light.tolerance {
            let (rgba, tolerance) = (light.rgba, light.tolerance);
            checked.faults.push(format!("{pass} {at:?}: exact {exact:.5?}, sampled {rgba:.5?} +- {tolerance:.1e}"));
        }
        // A hit near the opacity that the ray ends with may go either way.
        if scene.lights_volume() && (exact[3] - scene.settings.volume.hit).abs() > 2e-3 {
            let found = writes.get("hit_distance").one(at[0], at[1], 0);
            let is_same = if is_hit(found) { (found - light.hit).abs() < 0.05 } else { !is_hit(light.hit) };
            if !is_same {
                checked.faults.push(format!("{pass} {at:?}: exact hit at {found}, sampled at {}", light.hit));
            }
        }
        checked.rays += 1;
        if let Some(bounds) = &bounds {
            let ends = bounds.low.get(at).iter().zip(bounds.high.get(at));
            let pairs: Vec<_> = light.rgba.iter().zip(ends).collect();
            let is_within = |v: f64, low: f64, high: f64| (low - light.tolerance..=high + light.tolerance).contains(&v);
            if !pairs.iter().all(|(v, (low, high))| is_within(**v, **low, **high)) {
                checked.faults.push(format!("{pass} {at:?}: sampled light and its bounds {pairs:.5?}"));
            }
            checked.bounded += 1;
        }
    }
}

fn projections(scene: &Scene, reads: &Arrays, writes: &Arrays, rays: usize, draw: &mut Draw, checked: &mut Checked) {
    let (picture, projection) = (writes.get("picture"), &scene.settings.projection);
    let samples = Samples::new(scene, reads.get("volume"), projection.window, projection.start_depth);
    for at in chosen(picture.size, rays, draw, |at| picture.get(at)[3] > 0.0) {
        let (value, tolerance) = samples.projected(ray(scene, at, 1.0));
        let exact = picture.get(at);
        // What a ray only grazes may lie between two samples.
        if value.is_some_and(|value| (exact[0] - value).abs() > tolerance) || (exact[3] == 0.0 && value.is_some()) {
            checked.faults.push(format!("{at:?}: exact {exact:.5?}, sampled {value:.5?} +- {tolerance:.1e}"));
        }
        checked.rays += 1;
    }
}

/// Counts rays whose surface is the one that the detector finds at a fine step, 1/64 of an edge.
fn surfaces(scene: &Scene, reads: &Arrays, writes: &Arrays, checked: &mut Checked) {
    let edge = scene.ring.step * f64::from(scene.ring.half);
    let mut settings = scene.settings.clone();
    settings.surface.edge = Some(Edge::Length(edge));
    settings.ray.step = Some(edge / 64.0);
    settings.ray.samples_per_voxel = None;
    settings.ray.spread = 0.0;
    let fine = Scene::new(scene.geometry.clone(), scene.input, settings).expect("a finer scene");
    let mut sampled = writes.clone();
    by_reference(&fine, "raycast_surface", reads, &mut sampled);
    let size = writes.get("distance_map").size;
    for at in (0..size[0] * size[1]).map(|n| [n % size[0], n / size[0], 0]) {
        let [a, b] = [writes, &sampled].map(|made| made.get("distance_map").get(at)[0]);
        let is_same = if is_hit(a) && is_hit(b) { (a - b).abs() < 2.0 * edge / 64.0 } else { a == b };
        let echoes = scene.lights_by_echo().then(|| [writes, &sampled].map(|made| made.get("surface").get(at)));
        let alike = echoes.is_none_or(|[a, b]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02));
        checked.surfaces[usize::from(!(is_same && (alike || !is_hit(a))))] += 1;
    }
}

/// The largest difference of two pictures; infinite if they have other arrays or sizes.
fn difference(a: &Made, b: &Made) -> f64 {
    let is_alike = |((name, a), (other, b)): (&(String, Texels), &(String, Texels))| name == other && a.size == b.size;
    if a.len() != b.len() || !a.iter().zip(b).all(is_alike) {
        return f64::INFINITY;
    }
    let pairs = a.iter().zip(b).flat_map(|((_, a), (_, b))| a.values.iter().zip(&b.values));
    let off = |(a, b): (&f64, &f64)| match a.is_nan() || b.is_nan() {
        true if a.is_nan() && b.is_nan() => 0.0,
        true => f64::INFINITY,
        false => (a - b).abs(),
    };
    pairs.map(off).fold(0.0, f64::max)
}

#[test]
fn every_key_of_the_settings_is_known_to_rays_or_to_none() {
    let (declared, known) = (declared(), keys().map(|key| key.name).collect::<Vec<_>>());
    let missing: Vec<_> = declared.iter().filter(|key| !known.contains(&key.as_str())).collect();
    assert!(missing.is_empty(), "tests/unit_pure/ray_keys/keys.rs does not say whether rays read {missing:?}");
    let gone: Vec<_> = known.iter().filter(|key| !declared.iter().any(|name| name == *key)).collect();
    assert!(gone.is_empty(), "no longer settings: {gone:?}");
    assert_eq!(declared.len(), known.len(), "a key is there twice");
    for key in keys() {
        let leaf = key.name.rsplit('.').next().expect("a name");
        assert!(key.to.iter().all(|to| to.contains(leaf)), "{}: {:?} do not change it", key.name, key.to);
    }
    let of_stage_2 = PASSES.iter().filter(|pass| pass.stage == Stage::Raycast).map(|pass| pass.name);
    let unknown: Vec<_> = of_stage_2.filter(|name| !CASTS_RAYS.contains(name) && !CASTS_NONE.contains(name)).collect();
    assert!(unknown.is_empty(), "it is not said here whether {unknown:?} cast rays");
}

/// Prevents an exact ray, or bounds of one, that leave out a setting without a word. That a change shows, or is refused, keeps the table of keys honest.
#[test]
fn a_setting_that_rays_read_is_honoured_or_refused() {
    let all: Vec<Key> = keys().filter(|key| key.of != Of::Nothing).collect();
    let results = all.par_iter().enumerate().with_max_len(1).map(|(n, key)| of_key(n, key));
    let checked = results.reduce(Checked::default, Checked::add);
    checked.assert_right(0.005);
    assert!(checked.rays > 250 && checked.bounded > 200 && checked.surfaces[0] > 400, "too little was compared");
}

/// A key changed alone.
fn of_key(number: usize, key: &Key) -> Checked {
    // Some settings are of sweeps only.
    let is_of_sweeps = ["conditioning", "slices.pixels", "unveil"].iter().any(|start| key.name.starts_with(start));
    let body = &BODIES[if is_of_sweeps { 2 * (number % 2) } else { number % BODIES.len() }];
    // Stage 1 only makes other texels.
    let rays = if ["conditioning", "slices"].iter().any(|start| key.name.starts_with(start)) { 1 } else { 2 };
    let mut draw = Draw(number as u64);
    let mut all = Checked::default();
    let mut take = |assignments: &str, rays: usize| {
        let named = |fault: &str| format!("{} ({assignments}): {fault}", key.name);
        let scene = match scene_of(body, assignments) {
            Ok(scene) => scene,
            Err(why) => return (None, vec![named(&why)]),
        };
        if let Some(why) = picture::fault(&scene) {
            let is_refused = bounds::fault(&scene).is_some() || scene.settings.mode != Mode::Volume;
            let says_what = why.contains(": set ") && !why.contains('\n');
            let faults =
                (!is_refused || !says_what).then(|| named(&format!("refused by exact rays only, or unclear: {why}")));
            return (None, faults.into_iter().collect());
        }
        let mut checked = check(body, &scene, rays, &mut draw);
        let faults = checked.faults.drain(..).map(|fault| named(&fault)).collect();
        let made = std::mem::take(&mut checked.made);
        all = std::mem::take(&mut all).add(checked);
        (Some(made), faults)
    };
    let (before, mut faults) = take(key.from, rays);
    for to in key.to {
        // What is exactly as before needs no samples.
        let rays = if key.of == Of::Accuracy { 0 } else { rays };
        let (after, more) = take(&format!("{} & {to}", key.from), rays);
        faults.extend(more);
        let changed = match (&before, &after) {
            (Some(before), Some(after)) => difference(before, after),
            _ => f64::INFINITY,
        };
        // Places of surfaces are sums of as many roundings as their edges have samples.
        let is_right = if key.of == Of::Accuracy { changed < 1e-7 } else { changed > 1e-6 };
        if !is_right {
            faults.push(format!("{}: {to} changes exact rays by {changed:.1e}, as {:?}", key.name, key.of));
        }
    }
    all.faults = faults;
    all
}

/// The same of many settings together.
#[test]
fn settings_that_rays_read_are_honoured_together() {
    // Not of light volumes, which exact rays refuse in every draw.
    let all: Vec<Key> = keys().filter(|key| key.of != Of::Nothing && !key.name.starts_with("light.volume")).collect();
    let modes = [
        "mode=volume",
        "mode=volume",
        "mode=volume",
        "mode=volume & volume.shading=first-hit",
        "mode=surface",
        "mode=surface & surface.colour=rendered",
        "mode=surface & surface.colour=behind",
        "mode=surface & layout=pair",
        "mode=mixed",
        "mode=mip",
        "mode=minip",
        "mode=mean",
    ];
    let of_draw = |n: u32| {
        let mut draw = Draw(1000 + 1000 * u64::from(n));
        let body = &BODIES[draw.of(BODIES.len())];
        // Most draws have a setting that is refused, or two that exclude each other.
        for _ in 0..1000 {
            let mut text = modes[draw.of(modes.len())].to_string();
            for key in &all {
                let is_drawn = !["mode", "layout", "picture.size"].contains(&key.name) && draw.unit() < 0.08;
                if is_drawn {
                    let from = key.from.split(" & ").filter(|set| !set.starts_with("mode="));
                    let sets: Vec<_> = from.chain([key.to[draw.of(key.to.len())]]).collect();
                    text = format!("{text} & {}", sets.join(" & "));
                }
            }
            let scene = scene_of(body, &text).ok().filter(|scene| picture::fault(scene).is_none());
            if let Some(scene) = scene {
                let mut checked = check(body, &scene, 2, &mut draw);
                checked.faults.iter_mut().for_each(|fault| *fault = format!("{text}: {fault}"));
                return checked;
            }
        }
        Checked { faults: vec![format!("draw {n}: no scene")], ..Checked::default() }
    };
    let checked = (0..40u32).into_par_iter().with_max_len(1).map(of_draw).reduce(Checked::default, Checked::add);
    checked.assert_right(0.01);
    assert!(checked.rays > 50 && checked.bounded > 12 && checked.surfaces[0] > 100, "too little was compared");
}

/// Prevents a key in the table of those that no ray reads which a ray does read: every value that rays leave behind stays the same, bit for bit.
#[test]
fn a_setting_that_no_ray_reads_changes_no_pixel_of_stage_2() {
    let modes = ["mode=volume", "mode=surface & light.texture=0.3", "mode=mixed", "mode=mip"];
    // Voxels: their stage 1 takes no time.
    let body = &BODIES[1];
    let all: Vec<Key> = keys().filter(|key| key.of == Of::Nothing).collect();
    let made_of = |assignments: &str| {
        let scene = scene_of(body, assignments).ok()?;
        let mut made: Made = Vec::new();
        cast(body, &scene, |pass, reads, writes| {
            by_reference(&scene, pass, reads, writes);
            made.extend(writes.iter().map(|(name, texels)| (format!("{pass}.{name}"), texels.clone())));
        });
        Some(made)
    };
    let of_key = |key: &Key| {
        let pairs = modes.iter().flat_map(|mode| key.to.iter().map(move |to| (mode, to)));
        let compared = pairs.filter_map(|(mode, to)| {
            let before = made_of(&format!("{mode} & {}", key.from))?;
            // Some keys take one value only.
            let after = made_of(&format!("{mode} & {} & {to}", key.from))?;
            assert!(!before.is_empty() && difference(&before, &after) == 0.0, "{mode}: {to} changes rays");
            Some(())
        });
        compared.count()
    };
    let compared: usize = all.par_iter().map(of_key).sum();
    assert!(compared > 450, "{compared} pictures compared");
}
