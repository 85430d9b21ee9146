//! VR: emission and absorption along each ray, front to back (thesis 4-1, 4-2), with opacity corrected for the step.

use super::ray;
use crate::passes::*;
use crate::scene::transfer;

pub const PASS: Pass = Pass {
    name: "raycast_volume",
    stage: Stage::Raycast,
    when: When::Picture,
    shader: |s, _| ray::variant!(s, "raycast/volume"),
    needed: |s| if s.composites() { Ok("samples are composited") } else { Err("nothing is composited in this mode") },
    reads: |s, _| {
        let mut reads = ray::reads(s);
        reads.push(whole("transfer", Slot::Transfer));
        reads
    },
    writes: |s, _| vec![whole("picture", chain::rendered(s))],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        ray::params(s, s.window())
            .f32("absorption_scale", s.step / reference_length(s))
            .f32("opaque_enough", 1.0 - s.settings.ray.early_end)
    },
    constants: |s, _| {
        let mut constants = ray::constants(s);
        constants.push(("EARLY_END", (s.settings.ray.early_end > 0.0) as i32));
        constants
    },
    tolerance: Tolerance {
        absolute: 4e-3,
        relative: 0.0,
        outliers: 2e-3,
        why: "places are off by 1e-5 mm in f32, so by as much of a voxel's contrast a sample; an early end leaves 1/512; a \
              sample at the very border of the sector may fall on either side",
    },
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let table = reads.get("transfer");
        let picture = writes.get_mut("picture");
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
                picture.set([x, y, 0], &composite(scene, volume, table, origin, direction));
            }
        }
    },
};

/// The length for which the transfer function's opacities are given: one slice pixel, mm.
pub fn reference_length(scene: &Scene) -> f64 {
    scene.grid.pitch[0].min(scene.grid.pitch[1])
}

/// Red, green, blue and opacity of one ray: the midpoint rule over steps of `scene.step`, the last as long as what is left.
fn composite(scene: &Scene, volume: &Texels, table: &Texels, origin: DVec3, direction: DVec3) -> [f64; 4] {
    let (enter, leave) = ray::span(scene, origin, direction);
    let mut light = [0.0; 3];
    let mut opacity = 0.0;
    let mut i = 0;
    while enter + f64::from(i) * scene.step < leave {
        let from = enter + f64::from(i) * scene.step;
        let length = scene.step.min(leave - from);
        i += 1;
        let Some(value) = ray::sample(scene, volume, origin + direction * (from + length / 2.0)) else { continue };
        let [r, g, b, kappa] = looked_up(table, value);
        let a = transfer::opacity(kappa * length / reference_length(scene));
        for (light, colour) in light.iter_mut().zip([r, g, b]) {
            *light += (1.0 - opacity) * a * colour;
        }
        opacity += (1.0 - opacity) * a;
        if scene.settings.ray.early_end > 0.0 && opacity >= 1.0 - scene.settings.ray.early_end {
            break;
        }
    }
    [light[0], light[1], light[2], opacity]
}

fn looked_up(table: &Texels, value: f64) -> [f64; 4] {
    let entries = table.values.len() / 4;
    let at = value * (entries - 1) as f64;
    let n = (at.floor() as usize).min(entries - 2);
    std::array::from_fn(|c| {
        let (low, high) = (table.values[4 * n + c], table.values[4 * n + 4 + c]);
        low + (high - low) * (at - n as f64)
    })
}
