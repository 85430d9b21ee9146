//! MIP, MinIP and the mean: the largest, the smallest or the mean of the samples that each ray meets within the insonified
//! region.

use super::ray;
use crate::passes::empty_space;
use crate::passes::pass::*;
use crate::scene::{Mode, Scene};

pub(crate) const PASS: Pass = Pass {
    name: "raycast_projection",
    shader: |_, _| "raycast/projection",
    needed: |s| match s.settings.mode {
        Mode::Mip | Mode::MinIp | Mode::Mean => Ok("the mode keeps one value of each ray"),
        _ => Err("the mode is no projection"),
    },
    reads: |s, _| ray::marching_reads(s, empty_space::volume_skipping(s)),
    writes: |s, _| vec![whole("picture", rendered(s))],
    params: |s, _| ray::params(s, s.projection_view(), s.step),
    constants: |s, _| [ray::marching_constants(s, empty_space::volume_skipping(s)), vec![("KEPT", kept(s))]].concat(),
    tolerance: Tolerance::absolute(2e-3).outliers(5e-3).because(
        "places are off by 1e-5 mm in f32, and R16F stores 1 to 4.9e-4; a sample at the very border of the sector may \
         fall on either side, and with it the largest of all",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        writes.get_mut("picture").fill(|x, y| {
            let ray = ray::Ray::cast(scene, volume, scene.projection_view(), scene.step, x, y);
            projected(scene, &ray).map_or([0.0; 4], |v| [v, v, v, 1.0])
        });
    },
    ..Pass::OF_RAYS
};

fn kept(scene: &Scene) -> i32 {
    match scene.settings.mode {
        Mode::MinIp => 1,
        Mode::Mean => 2,
        _ => 0,
    }
}

/// None for a ray that meets nothing of the region. The mean is that of the field along the ray: each sample counts as much as
/// its step is long, the last one's being what is left.
fn projected(scene: &Scene, ray: &ray::Ray) -> Option<f64> {
    let steps = ray.steps_to(ray.path().max(0.0)).ceil() as u64;
    let samples = (0..steps).filter_map(|i| {
        let from = ray.offset(i as f64);
        let length = ray.length(i as f64).min(ray.path() - from);
        Some((ray.sample(from + length / 2.0, i as f64 + 0.5).filter(|_| length > 0.0)?, length))
    });
    let samples: Vec<(f64, f64)> = samples.collect();
    let values = samples.iter().map(|s| s.0);
    match scene.settings.mode {
        _ if samples.is_empty() => None,
        Mode::Mean => Some(samples.iter().map(|s| s.0 * s.1).sum::<f64>() / samples.iter().map(|s| s.1).sum::<f64>()),
        Mode::MinIp => values.reduce(f64::min),
        _ => values.reduce(f64::max),
    }
}
