//! Passes that measure the limits of a device: how fast it samples, fetches and copies without computing. No plan has them. `profile` runs
//! each alone and compares the other passes with them.

use super::pass::*;
use crate::probe::StoredType;
use crate::probe::{Geometry, Grid};
use crate::scene::{Input, Scene, SceneError, Settings};

/// Number of samples that each invocation takes from the volume.
pub const SAMPLES: u32 = 256;

/// The passes that measure how fast the device samples a volume (by its filter, by eight fetches, by one fetch) and copies a picture.
pub const MEASURES: &[Pass] = &[FILTERED, EIGHT_FETCHES, ONE_FETCH, COPY];

/// Takes [`SAMPLES`] samples for each pixel by the device's trilinear filter and writes their mean.
pub const FILTERED: Pass = Pass {
    name: "measure_filtered",
    shader: |_, _| "measure/sampling",
    needed: |_| Err("measures the device, not a scene"),
    reads: |_, _| vec![Bind { filtered: true, ..whole("volume", Slot::Volume) }],
    writes: |_, _| vec![whole("picture", Slot::Picture)],
    extent: picture_extent,
    constants: |_, _| vec![("SAMPLING", 0), ("SAMPLES", SAMPLES as i32)],
    tolerance: Tolerance::absolute(2e-3)
        .because("a device's filter may have weights of 8 bits; R16F stores 1 to 4.9e-4"),
    reference: |_, _, reads, writes| mean(reads, writes, Texels::trilinear),
    ..Pass::OF_RAYS
};

/// The same as [`FILTERED`], with interpolation in the shader: it takes eight texels for each sample, fetched or loaded in the way that is fastest on
/// the device.
pub const EIGHT_FETCHES: Pass = Pass {
    name: "measure_eight_fetches",
    reads: |_, _| vec![whole("volume", Slot::Volume)],
    constants: |_, _| vec![("SAMPLING", 1), ("SAMPLES", SAMPLES as i32)],
    ..FILTERED
};

pub const ONE_FETCH: Pass = Pass {
    name: "measure_one_fetch",
    reads: |_, _| vec![whole("volume", Slot::Volume)],
    constants: |_, _| vec![("SAMPLING", 2), ("SAMPLES", SAMPLES as i32)],
    reference: |_, _, reads, writes| {
        mean(reads, writes, |volume, at| {
            let low = at.map(|v| v.max(0.0) as i64);
            volume.clamped(low[0], low[1], low[2])
        });
    },
    ..FILTERED
};

/// Copies a picture: reads 8 bytes a pixel and writes as many.
pub const COPY: Pass = Pass {
    name: "measure_copy",
    shader: |_, _| "measure/copy",
    reads: |_, _| vec![whole("source", Slot::Picture)],
    writes: |_, _| vec![whole("target", Slot::SmoothPicture)],
    constants: no_constants,
    tolerance: Tolerance::exact("nothing is computed"),
    reference: |_, _, reads, writes| writes.get_mut("target").values.copy_from_slice(&reads.get("source").values),
    ..FILTERED
};

/// Takes one sample for each texel of the output, at [`sample_position`]. `verify` tests a device's filter with it; no profile measures it.
pub const POSITIONS: Pass = Pass {
    name: "measure_positions",
    shader: |_, _| "measure/positions",
    writes: |_, _| vec![whole("values", Slot::Distance)],
    extent: ray_extent,
    constants: no_constants,
    reference: |_, _, reads, writes| {
        let volume = reads.get("volume");
        let values = writes.get_mut("values");
        let [width, height, _] = values.size;
        values.fill(|x, y| {
            let share = sample_position([x, y], [width, height]);
            [volume.trilinear(std::array::from_fn(|axis| share[axis] * volume.size[axis] as f64 - 0.5))]
        });
    },
    ..FILTERED
};

/// The position at which [`POSITIONS`] samples for a texel of its output of `size` texels, as a share of the volume's size along each axis: -1/8 to
/// 9/8, so that it also lies outside. It is the same as in glsl/measure/positions.comp.
pub fn sample_position(texel: [usize; 2], size: [usize; 2]) -> [f64; 3] {
    let turn = (13 * texel[0] + 29 * texel[1]) % 61;
    let across = |axis: usize| (texel[axis] as f64 + 0.5) / size[axis] as f64;
    [across(0), across(1), (turn as f64 + 0.5) / 61.0].map(|share| 1.25 * share - 0.125)
}

fn mean(reads: &Arrays, writes: &mut Arrays, sample: impl Fn(&Texels, [f64; 3]) -> f64) {
    let volume = reads.get("volume");
    let picture = writes.get_mut("picture");
    let (size, [width, height, _]) = (volume.size.map(|n| n as f64), picture.size);
    picture.fill(|x, y| {
        let share = [(x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64];
        let at = |i: u32| [share[0], share[1], (f64::from(i) + 0.5) / f64::from(SAMPLES)];
        let texel = |i: u32| std::array::from_fn(|axis| at(i)[axis] * size[axis] - 0.5);
        let sum: f64 = (0..SAMPLES).map(|i| sample(volume, texel(i))).sum();
        let mean = sum / f64::from(SAMPLES);
        [mean, mean, mean, 1.0]
    });
}

/// A scene with a Cartesian volume of `edge`^3 voxels in the default texel format and a picture of `pixels`^2.
///
/// # Errors
/// A size is outside the limits of a scene.
pub fn scene(edge: usize, pixels: u32) -> Result<Scene, SceneError> {
    let mut settings = Settings::default();
    settings.picture.size = [pixels, pixels];
    let grid = Grid { size: [edge; 3], spacing: [1.0; 3], origin: [0.0; 3] };
    Scene::new(Geometry::Cartesian(grid), Input { stored: StoredType::U8, range: [0.0, 255.0] }, settings)
}
