//! The f64 references of the filters against independent answers: values worked out by hand, counts, sums that must be kept, equations that
//! must be fulfilled. The tests on a device (tests/gpu) compare the shaders with these references. Needs no GPU.

mod declared;
mod diffusion;
mod estimators;
mod growing;
mod smoothing;

use crate::common::probes::{voxels, wobbler};
use crate::common::scenes::{self, FLOATS};
use echolume::low_level::passes::{Arrays, DispatchArgs, MISS, Pass, Texels, by_name};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use echolume::low_level::statistics::mix;

fn scene(size: [usize; 3], toml: &str) -> Scene {
    scenes::scene(voxels(size), FLOATS, toml)
}

/// A scene with these filters of slices.
fn slices(size: [usize; 2], filters: &str) -> Scene {
    scene([size[0], size[1], 3], &format!("slices = {{ {filters} }}"))
}

/// A scene with these filters of the distance map.
fn distances(size: [usize; 2], filters: &str) -> Scene {
    scene([8; 3], &format!("mode = 'sr'\npicture = {{ size = {size:?} }}\ndistance = {{ {filters} }}"))
}

/// A scene with these filters of the picture.
fn picture(size: [usize; 2], filters: &str) -> Scene {
    scene([8; 3], &format!("mode = 'mip'\npicture = {{ size = {size:?} }}\npost = {{ {filters} }}"))
}

fn pass(name: &str) -> &'static Pass {
    by_name(name).unwrap_or_else(|| panic!("no pass {name}"))
}

/// The result of one dispatch on `source`, in a target of `depth` slices; texels that it does not write are NaN.
fn dispatched(scene: &Scene, name: &str, source: &Texels, args: DispatchArgs, depth: usize) -> Texels {
    let (mut reads, mut writes) = (Arrays::default(), Arrays::default());
    reads.insert("source", source.clone());
    writes.insert("target", Texels::untouched([source.size[0], source.size[1], depth], source.channels));
    pass(name).reference(scene, &args, &reads, &mut writes);
    writes.get("target").clone()
}

/// The result of the first dispatch of a pass, in a plane.
fn filtered(scene: &Scene, name: &str, source: &Texels) -> Texels {
    dispatched(scene, name, source, DispatchArgs::default(), 1)
}

fn plane(size: [usize; 2], f: impl Fn(usize, usize) -> f64) -> Texels {
    Texels::from_fn([size[0], size[1], 1], 1, |[x, y, _], _| f(x, y))
}

/// A plane from its rows.
fn rows<const W: usize, const H: usize>(rows: [[f64; W]; H]) -> Texels {
    plane([W, H], |x, y| rows[y][x])
}

/// A pseudo-random number in 0..1 from a seed.
fn hash(seed: usize) -> f64 {
    let mixed = mix((seed as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (mixed >> 11) as f64 / (1u64 << 53) as f64
}

fn noise(size: [usize; 2], seed: usize) -> Texels {
    plane(size, |x, y| hash(seed * 10_000 + y * size[0] + x))
}

/// Distances near 40 mm with some misses.
fn holed(size: [usize; 2], seed: usize) -> Texels {
    let rough = noise(size, seed);
    plane(size, |x, y| match rough.one(x, y, 0) {
        share if share < 0.3 => MISS,
        share => 40.0 + 3.0 * share,
    })
}

/// A picture with independent values in each channel.
fn colours(size: [usize; 2], seed: usize) -> Texels {
    Texels::from_fn([size[0], size[1], 1], 4, |[x, y, _], c| hash(seed * 10_000 + (y * size[0] + x) * 4 + c))
}

fn channel(texels: &Texels, c: usize) -> Texels {
    Texels::from_fn(texels.size, 1, |at, _| texels.get(at)[c])
}

/// Pixels whose row and column lie within `radius`, the picture's border cut off.
fn window(size: [usize; 3], x: usize, y: usize, radius: usize) -> impl Iterator<Item = (usize, usize)> {
    let all = (0..size[1]).flat_map(move |j| (0..size[0]).map(move |i| (i, j)));
    all.filter(move |(i, j)| i.abs_diff(x) <= radius && j.abs_diff(y) <= radius)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[track_caller]
fn same(got: &Texels, expected: &Texels, what: &str) {
    assert_eq!((got.size, got.channels), (expected.size, expected.channels), "{what}");
    for (i, (a, b)) in got.values.iter().zip(&expected.values).enumerate() {
        let near = (a - b).abs() <= 1e-11 * b.abs().max(1.0);
        assert!(
            near,
            "{what}: {a} in place of {b} at {}, {}",
            i / got.channels % got.size[0],
            i / got.channels / got.size[0]
        );
    }
}

/// The result for slice 2 of 3 is written there and nowhere else; a plane, which has no slices, is written too.
#[test]
fn a_filtered_slice_is_written_to_its_own_layer() {
    let source = noise([6, 5], 1);
    for (name, filter) in [
        ("median_slice", "median = true"),
        ("estimator_slice", "estimator = 'gradient-inverse'"),
        ("sigma_slice", "sigma = {}"),
        ("enhanced_sigma_slice", "enhanced_sigma = {}"),
        ("perona_malik_slice", "perona_malik = { repeat = 1 }"),
        ("gaussian_lateral", "smooth = { lateral = 1.0 }"),
        ("gaussian_depth", "smooth = { depth = 1.0 }"),
    ] {
        let scene = slices([6, 5], filter);
        let args = DispatchArgs { slice: 2, ..DispatchArgs::default() };
        let flat = dispatched(&scene, name, &source, args, 1);
        assert!(flat.values.iter().all(|v| v.is_finite()), "{name}");
        assert!(flat.values.iter().zip(&source.values).any(|(a, b)| a != b), "{name} changes something");
        let volume = dispatched(&scene, name, &source, args, 3);
        for (x, y) in window(source.size, 0, 0, 9) {
            assert_eq!(volume.one(x, y, 2), flat.one(x, y, 0), "{name}");
            assert!(volume.one(x, y, 0).is_nan() && volume.one(x, y, 1).is_nan(), "{name}");
        }
    }
}

/// A batch is its frames one by one, in planes and in the volume.
#[test]
fn the_reference_of_a_batch_filters_each_frame() {
    let scene = scene([6, 5, 4], "mode = 'mip'\nslices = { median = true }");
    let frames: Vec<Texels> = (0..3).map(|n| noise([6, 5], n)).collect();
    let stacked = Texels::from_fn([6, 5, 3], 1, |[x, y, z], _| frames[z].one(x, y, 0));
    let batch = dispatched(
        &scene,
        "median_slice",
        &stacked,
        DispatchArgs { slice: 1, slices: 3, ..DispatchArgs::default() },
        4,
    );
    for (n, frame) in frames.iter().enumerate() {
        let alone = filtered(&scene, "median_slice", frame);
        for (x, y) in window(alone.size, 0, 0, 9) {
            assert_eq!(batch.one(x, y, 1 + n), alone.one(x, y, 0));
            assert!(batch.one(x, y, 0).is_nan());
        }
    }
}
