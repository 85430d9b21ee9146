//! A still: volume rendering by paths of light, from the camera to the lights. Light collides with the medium that the transfer function
//! defines, and is scattered any number of times. Nothing is denoised: the picture is the mean of independent paths, whose expectation is
//! the solution of the equation of radiative transfer (docs/numerics.md).

mod path;
mod random;

pub use path::Medium;
pub use random::Stream;

use super::ray;
use crate::passes::empty_space;
use crate::passes::light_volume;
use crate::passes::lookup_tables::{brick_reaches, still_medium};
use crate::passes::pass::*;
use crate::passes::preprocess::packed_sampling;
use crate::scene::{Scene, Side, Still, windowed};

fn need(scene: &Scene) -> Need {
    scene.still().map(|_| "a still is asked for").ok_or("no still is asked for")
}

fn still(scene: &Scene) -> Still {
    scene.still().copied().unwrap_or_default()
}

/// Slots of the sums that dispatch `n` of the paths writes: the one before reads them.
fn sums(n: u32) -> [Slot; 2] {
    match n % 2 {
        0 => [Slot::StillSumsA, Slot::StillSquaresA],
        _ => [Slot::StillSumsB, Slot::StillSquaresB],
    }
}

/// The slots that hold the sums over all paths of each pixel: first light and the number of paths that met matter, then the squares of the paths'
/// luminances.
pub fn final_sums(scene: &Scene) -> [Slot; 2] {
    sums(still(scene).dispatches())
}

/// Computes the majorant of each brick: the largest extinction of any value that samples in it may have.
pub(crate) const MAJORANTS: Pass = Pass {
    name: "still_majorants",
    shader: |_, _| "raycast/still_majorants",
    needed: |s| match (need(s), s.skips()) {
        (Ok(_), true) => Ok("paths go through bricks, each with its largest extinction"),
        (Ok(_), false) => Err("paths take the largest extinction of all: there are no bricks"),
        (not, _) => not,
    },
    reads: |_, _| [empty_space::ranges(), vec![whole("medium", Slot::StillMedium)]].concat(),
    writes: |_, _| vec![whole("majorants", Slot::StillMajorants)],
    extent: |s, _| s.bricks().count,
    params: |s, _| empty_space::window(s, s.volume_view()),
    constants: |s, _| vec![("ENTRIES", s.transfer_entries() as i32)],
    tolerance: Tolerance::absolute(0.0)
        .relative(1e-6)
        .outliers(1e-3)
        .because("an entry of the medium; a range that ends within rounding of an entry may take another one in"),
    reference: |scene, _, reads, writes| {
        let (ranges, medium) = (reads.get("brick_ranges"), reads.get("medium"));
        let target = writes.get_mut("majorants");
        let window = scene.volume_view().window;
        let last = scene.transfer_entries() - 1;
        let entry = |value: f64| windowed(window, value) * last as f64;
        let beyond = empty_space::beyond(scene);
        for (n, reach) in brick_reaches(scene, &scene.bricks()).into_iter().enumerate() {
            let slack = 1e-6 * last as f64;
            let first = (entry(ranges.values[2 * n] / beyond) - slack).max(0.0) as usize;
            let end = ((entry(ranges.values[2 * n + 1] * beyond) + slack) as usize + 1).min(last);
            let entries = if reach.side == Side::Outside { first..first } else { first..end + 1 };
            target.values[n] = entries.map(|n| medium.values[4 * n + 3]).fold(0.0, f64::max);
        }
    },
    ..Pass::OF_RAYS
};

/// Clears the sums of all pixels before the first path.
pub const BEGIN: Pass = Pass {
    name: "still_begin",
    shader: |_, _| "raycast/still_begin",
    needed: need,
    reads: |_, _| Vec::new(),
    writes: |_, _| written(0),
    extent: ray_extent,
    params: |_, _| Params::default(),
    constants: no_constants,
    tolerance: Tolerance::exact("zeros"),
    reference: |_, _, _, writes| {
        for name in ["next_sums", "next_squares"] {
            writes.get_mut(name).values.fill(0.0);
        }
    },
    ..MAJORANTS
};

fn written(n: u32) -> Vec<Bind> {
    let [light, squares] = sums(n);
    vec![whole("next_sums", light), whole("next_squares", squares)]
}

/// Traces paths of light for every pixel, some in each dispatch, and adds them to the sums.
pub(crate) const PATHS: Pass = Pass {
    name: "still_paths",
    shader: |_, _| "raycast/still",
    needed: need,
    reads: |s, t| {
        let mut reads = ray::reads(s);
        // Samples are exact: the weights of a device's filter have 8 bits.
        reads.iter_mut().for_each(|bind| bind.filtered = false);
        reads.extend(s.packs().then_some(whole("packed_neighbours", Slot::PackedNeighbours)));
        reads.push(whole("medium", Slot::StillMedium));
        reads.extend(s.skips().then_some(whole("majorants", Slot::StillMajorants)));
        let [light, squares] = sums(t.iteration);
        reads.extend([whole("sums", light), whole("squares", squares)]);
        reads
    },
    writes: |_, t| written(t.iteration + 1),
    extent: ray_extent,
    repeat: |s| still(s).dispatches(),
    params: |s, t| {
        let (still, lights) = (still(s), s.still_lights());
        let first = t.iteration * still.samples_at_once();
        ray::params(s, s.volume_view(), s.step)
            .f32("fade_density", light_volume::fade_density(s))
            .i32("first_sample", first)
            .i32("samples", still.samples_at_once().min(still.samples - first.min(still.samples)))
            .i32("seed", still.seed)
            .i32("events", still.events)
            .f32("anisotropy", still.anisotropy)
            .f32("majorant", largest_extinction(s))
            .vec3("key_towards", lights.key.towards)
            .vec3("key_light", lights.key.irradiance)
            .vec3("back_towards", lights.back.towards)
            .vec3("back_light", lights.back.irradiance)
            .f32("back_share", lights.back_share())
            .vec3("environment", lights.environment)
    },
    constants: |s, _| {
        let with = [
            ("SAMPLING", if s.packs() { packed_sampling(s) } else { 1 }),
            ("FADE", s.region_fade().is_some() as i32),
            ("BRICKS", s.skips() as i32),
            ("ENTRIES", s.transfer_entries() as i32),
        ];
        replaced(ray::constants(s), &["SAMPLING", "SPREAD"], with)
    },
    tolerance: Tolerance::absolute(4e-3).relative(4e-3).outliers(4e-2).because(
        "places along a path are off by 1e-5 mm in f32, so extinctions by as much of a voxel's contrast; where a \
         random number lies that close to a decision, the path becomes another one",
    ),
    reference: |scene, args, reads, writes| {
        let medium = Medium::new(scene, reads);
        let still = still(scene);
        let first = args.iteration * still.samples_at_once();
        let last = (first + still.samples_at_once()).min(still.samples);
        for (x, y) in writes.get("next_sums").pixels() {
            let mut sum: [f64; 4] = std::array::from_fn(|c| reads.get("sums").get([x, y, 0])[c]);
            let mut square = reads.get("squares").one(x, y, 0);
            for sample in first..last {
                let light = medium.path([x, y], Stream::new([x, y], sample, still.seed));
                sum.iter_mut().zip(light).for_each(|(sum, light)| *sum += light);
                square += luminance(light).powi(2);
            }
            writes.get_mut("next_sums").set([x, y, 0], &sum);
            writes.get_mut("next_squares").set([x, y, 0], &[square]);
        }
    },
    ..MAJORANTS
};

/// Luminance of linear light (ITU-R BT.709 weights).
pub fn luminance([red, green, blue, _]: [f64; 4]) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// Largest extinction of the medium, 1/mm.
fn largest_extinction(scene: &Scene) -> f64 {
    still_medium(scene).chunks_exact(4).map(|entry| f64::from(entry[3])).fold(0.0, f64::max)
}

/// Turns the sums into the picture: the mean of the paths of each pixel, through the response curve and over the backdrop.
pub(crate) const RESOLVE: Pass = Pass {
    name: "still_resolve",
    shader: |_, _| "raycast/still_resolve",
    needed: need,
    reads: |s, _| vec![whole("sums", final_sums(s)[0])],
    writes: |s, _| vec![whole("picture", rendered(s))],
    extent: ray_extent,
    params: |s, _| {
        let volume = s.settings.light.volume.unwrap_or_default();
        let ground = volume.ground.unwrap_or_default();
        Params::default()
            .f32("share", 1.0 / f64::from(still(s).samples))
            .f32("exposure", volume.exposure)
            .vec3("ground_middle", ground.middle)
            .vec3("ground_edge", ground.edge)
    },
    constants: |s, _| vec![("GROUND", s.settings.light.volume.is_some_and(|volume| volume.ground.is_some()) as i32)],
    tolerance: Tolerance::absolute(1e-3).because("a response curve and a power in f32; R16F stores 1 to 4.9e-4"),
    reference: |scene, _, reads, writes| {
        let sums = reads.get("sums");
        let (volume, samples) = (scene.settings.light.volume, f64::from(still(scene).samples));
        let (exposure, ground) = (volume.unwrap_or_default().exposure, volume.and_then(|volume| volume.ground));
        writes.get_mut("picture").fill(|x, y| {
            let mut mean: [f64; 4] = std::array::from_fn(|c| sums.get([x, y, 0])[c] / samples);
            mean[3] = mean[3].min(1.0);
            light_volume::on_film(scene, exposure, ground, mean, ray::middle_of(x, y))
        });
    },
    ..MAJORANTS
};
