//! The surface detector on bodies of known surface: its place with and without noise, what it misses, and what it invents.

use crate::common::*;
use echolume::passes::{Slot, Texels, is_hit};
use echolume::probe::{Geometry, Grid};
use echolume::scene::Scene;
use glam::DVec3;

/// mm; also the voxels' size.
const STEP: f64 = 0.25;

fn block() -> Geometry {
    Geometry::Cartesian(Grid { size: [72, 120, 72], spacing: [STEP; 3], origin: [0.0; 3] })
}

fn with(surface: &str) -> Scene {
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [64, 64] }}\nray = {{ step = {STEP}, sampling = 'exact' }}\n\
         slices = {{ format = 'r32f' }}\ncamera = {{ zoom = 1.1 }}\nsurface = {{ {surface} }}"
    );
    scene(block(), FLOATS, &toml)
}

fn distances(device: &Device, scene: &Scene, frames: &[Texels]) -> Texels {
    let mut renderer = rendered(device, scene.clone(), frames);
    renderer.picture().expect("picture");
    renderer.read(Slot::Distance).expect("read").expect("there")
}

/// How far behind the wall each ray's surface lies, in steps; none where nothing was found.
fn behind_wall(scene: &Scene, distances: &Texels, wall: f64) -> Vec<Option<f64>> {
    let ray = |i: usize| {
        let (x, y) = (i % 64, i / 64);
        let (origin, _) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let distance = distances.one(x, y, 0);
        is_hit(distance).then(|| (origin.y + distance - wall) / STEP)
    };
    (0..64 * 64).map(ray).collect()
}

#[test]
fn a_wall_is_within_a_tenth_of_a_step_at_any_offset_height_width_and_sign() {
    let device = Device::new();
    for rough in [1, 2, 3] {
        for (sign, inside, outside) in [("bright", 1.0, 0.0), ("dark", 0.0, 1.0)] {
            let scene = with(&format!("threshold = 0.1, rough = {rough}, sign = '{sign}'"));
            for (n, width) in [0.3, 0.5, 0.8].into_iter().enumerate() {
                for sub in 0..4 {
                    let wall = 14.0 + STEP * f64::from(sub) / 4.0 + 0.013;
                    let height = 1.0 - 0.3 * n as f64;
                    let share = |p: DVec3| ((p.y - wall) / width + 0.5).clamp(0.0, 1.0);
                    let frames = body_frames(&scene, |p| height * (outside + (inside - outside) * share(p)));
                    let found = behind_wall(&scene, &distances(&device, &scene, &frames), wall);
                    let worst = found.iter().map(|f| f.map_or(99.0, f64::abs)).fold(0.0, f64::max);
                    assert!(worst < 0.1, "{sign}, rough {rough}, ramp {width} mm, offset {sub}: {worst} steps");
                }
            }
        }
    }
}

/// The first crossing fires early on bright edges, by 4 threshold / height steps; the peak does not depend on the height.
#[test]
fn the_peaks_place_does_not_depend_on_the_edges_height_and_the_first_crossings_does() {
    let device = Device::new();
    let mean = |place: &str, height: f64| {
        let scene = with(&format!("threshold = 0.2, rough = 1, place = '{place}'"));
        let mut sum = 0.0;
        for sub in 0..8 {
            let wall = 14.0 + STEP * f64::from(sub) / 8.0;
            let frames = body_frames(&scene, |p| height * ((p.y - wall) / STEP + 0.5).clamp(0.0, 1.0));
            let found = behind_wall(&scene, &distances(&device, &scene, &frames), wall);
            sum += found[64 * 32 + 32].expect("a wall");
        }
        sum / 8.0
    };
    for height in [1.0, 0.6, 0.3] {
        let (peak, crossing) = (mean("peak", height), mean("first-crossing", height));
        // At the newest sample: between the continuous answer and the next whole sample.
        let expected = 4.0 * 0.2 / height;
        println!(
            "height {height}: peak {peak:.2}, first crossing {crossing:.2} steps behind the edge, 4 thr/A = {expected:.2}"
        );
        assert!(peak.abs() < 0.1, "{peak}");
        assert!((expected - 0.6..expected + 0.6).contains(&crossing), "{crossing} is not about {expected}");
    }
}

struct Outcome {
    /// Standard deviation of the place, steps.
    spread: f64,
    missed: f64,
    /// Share of rays whose surface is more than four steps off.
    wrong: f64,
}

fn under_noise(device: &Device, rough: u32, deviation: f64) -> Outcome {
    let scene = with(&format!("threshold = 0.45, rough = {rough}"));
    let wall = 18.0;
    let mut noise = Noise(17);
    // Gaussian by the sum of twelve; on a pedestal of 0.3, so that clamping to 0..1 does not halve it.
    let mut gauss = || (0..12).map(|_| noise.next()).sum::<f64>() - 6.0;
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let field: Vec<f64> = (0..width * height * 72).map(|_| gauss()).collect();
    let frames = frames(&scene, |[x, y, k]| {
        let wall = ((y as f64 * STEP - wall) / (2.0 * STEP) + 0.5).clamp(0.0, 1.0);
        0.3 + 0.4 * (wall + deviation * field[(k * height + y) * width + x])
    });
    let mut scene = scene;
    scene.settings.surface.window = [0.0, 1.0];
    scene.settings.surface.threshold *= 0.4;
    let found = behind_wall(&scene, &distances(device, &scene, &frames), wall);
    let rays = found.len() as f64;
    let right: Vec<f64> = found.iter().flatten().copied().filter(|f| f.abs() <= 4.0).collect();
    let mean = right.iter().sum::<f64>() / right.len() as f64;
    Outcome {
        spread: (right.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / right.len() as f64).sqrt(),
        missed: found.iter().filter(|f| f.is_none()).count() as f64 / rays,
        wrong: found.iter().flatten().filter(|f| f.abs() > 4.0).count() as f64 / rays,
    }
}

/// Noise a voxel, as a share of the edge's height, against what becomes of 4096 rays at a threshold of 0.45 of the height.
#[test]
fn noise_spreads_the_place_before_it_hides_or_invents_surfaces() {
    let device = Device::new();
    println!("rough  noise  spread (steps)  missed  wrong");
    for rough in [1, 2] {
        let mut last = 0.0;
        for (deviation, spread, lost) in [(0.0, 0.01, 0.0), (0.1, 0.2, 0.001), (0.2, 0.35, 0.004), (0.3, 0.5, 0.08)] {
            let outcome = under_noise(&device, rough, deviation);
            let Outcome { spread: measured, missed, wrong } = outcome;
            println!("{rough:>5}  {deviation:>5}  {measured:>14.3}  {missed:>6.4}  {wrong:.4}");
            assert!(measured <= spread, "rough {rough}, noise {deviation}: spread {measured}");
            assert!(missed + wrong <= lost, "rough {rough}, noise {deviation}: {missed} missed, {wrong} wrong");
            assert!(measured >= last, "more noise spreads more");
            last = measured;
        }
    }
}

/// Bright specks of two voxels float in the fluid before the wall: the rough detector rides over them.
#[test]
fn small_floating_specks_are_ridden_over() {
    let device = Device::new();
    let hit = |rough: u32| {
        let scene = with(&format!("threshold = 0.3, rough = {rough}, rough_threshold = 0.5"));
        let wall = 24.0;
        let frames = body_frames(&scene, |p| {
            // One speck in every 3 mm, in a layer well before the wall.
            let away = DVec3::new(p.x.rem_euclid(3.0) - 1.5, p.y - 10.0, p.z.rem_euclid(3.0) - 1.5).length();
            let speck = ((0.4 - away) / STEP + 0.5).clamp(0.0, 1.0);
            speck.max(((p.y - wall) / (2.0 * STEP) + 0.5).clamp(0.0, 1.0))
        });
        let found = behind_wall(&scene, &distances(&device, &scene, &frames), wall);
        let specks = found.iter().flatten().filter(|f| **f < -8.0).count() as f64 / found.len() as f64;
        let walls = found.iter().flatten().filter(|f| f.abs() < 1.0).count() as f64 / found.len() as f64;
        (specks, walls)
    };
    let (fine, rough) = (hit(1), hit(3));
    println!("specks taken for surface: {:.4} by the fine detector alone, {:.4} behind a rough one", fine.0, rough.0);
    assert!(fine.0 > 0.02, "the specks are there: {}", fine.0);
    assert!(rough.0 == 0.0, "{}", rough.0);
    assert!(rough.1 > 0.99, "the wall is found behind them: {}", rough.1);
}

#[test]
fn a_sphere_is_within_a_tenth_of_a_step_where_rays_meet_it_within_45_degrees() {
    let device = Device::new();
    let (centre, radius) = (DVec3::new(9.0, 20.0, 9.0), 8.0);
    for rough in [1, 2] {
        let scene = with(&format!("threshold = 0.1, rough = {rough}"));
        let frames = body_frames(&scene, |p| ((radius - p.distance(centre)) / (2.0 * STEP) + 0.5).clamp(0.0, 1.0));
        let map = distances(&device, &scene, &frames);
        let (mut worst, mut rays) = (0.0f64, 0);
        for (x, y) in (0..64 * 64).map(|i| (i % 64, i / 64)) {
            let (origin, _) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let off_axis = (origin.x - centre.x).hypot(origin.z - centre.z);
            if off_axis < radius * std::f64::consts::FRAC_1_SQRT_2 {
                let depth = centre.y - (radius * radius - off_axis * off_axis).sqrt();
                worst = worst.max((origin.y + map.one(x, y, 0) - depth).abs() / STEP);
                rays += 1;
            }
        }
        println!("sphere, rough {rough}: worst {worst:.3} steps over {rays} rays");
        assert!(rays > 1000 && worst < 0.1, "{worst} steps, {rays} rays");
    }
}
