//! Edges just above and below what makes a surface.

use super::{block, fault, show};
use crate::gpu::GpuError;
use crate::passes::{MISS, Slot, is_hit};
use crate::verify::built_in::{FLOATS, frames, scene};
use crate::verify::report::{Figure, Unit};
use crate::verify::{Bench, Found, drawn};

/// mm between voxels.
const VOXEL: f64 = 0.25;
/// mm between samples: more than a voxel, so that an edge a voxel wide fits between two of them.
const STEP: f64 = 0.3;

/// What the detector compares is the difference of two means: of a step from nothing it is the step's height. One a hundredth higher
/// than the threshold is a surface, one a hundredth lower is none. Where it is one, it lies midway between the samples about it.
pub(super) fn contrast(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut wrong, mut aside) = (Found::default(), 0, 0.0f64);
    for (place, threshold) in [("peak", 0.2), ("first-crossing", 0.2), ("peak", 0.6)] {
        for (height, is_surface) in [(1.01, true), (0.99, false)] {
            let toml = format!(
                "mode = 'sr'\npicture = {{ size = [9, 9] }}\nslices.format = 'r32f'\nray = {{ step = {STEP}, sampling = 'exact' }}\n\
                 surface = {{ threshold = {threshold}, place = '{place}', rough = 1 }}\ncamera = {{ field_of_view = 0 }}"
            );
            let scene = scene(block(VOXEL, [40, 80, 40]), FLOATS, &toml).map_err(GpuError::Broken)?;
            // Samples before the last dark voxel; between that one and the first bright one there is none.
            let before = |voxel: usize| (voxel as f64 * VOXEL - scene.low.y) / STEP - 0.5;
            let fits = |voxel: &usize| before(*voxel).floor() == before(voxel + 1).floor();
            let Some(dark) = (40..70).find(fits) else { continue };
            let frames = frames(&scene, |[_, y, _]| if y > dark { height * threshold } else { 0.0 });
            let map = drawn::slot(&bench.context, &scene, &frames, Slot::Distance)?;
            let got = map.one(4, 4, 0);
            let input = || format!("{height} times a threshold of {threshold}, {place}");
            let faults = found.faults.len();
            let (origin, direction) = scene.rays.at(4.5, 4.5);
            let expected = (scene.low.y + STEP * (before(dark).floor() + 1.0) - origin.y) / direction.y;
            if is_hit(got) != is_surface {
                wrong += 1;
                let what = if is_surface { "a surface is overlooked" } else { "something is taken for a surface" };
                found.faults.push(fault(input(), what, "distance_map", [4, 4, 0], [height * threshold, got]));
            } else if is_surface && place == "peak" {
                aside = aside.max((got - expected).abs());
                if (got - expected).abs() > 5e-4 {
                    let what = "the surface is somewhere else";
                    found.faults.push(fault(input(), what, "distance_map", [4, 4, 0], [expected, got]));
                }
            }
            if found.faults.len() > faults {
                show(&mut found, "distance_map", &map, 0, [([4, 4, 0], if is_surface { expected } else { MISS })]);
            }
        }
    }
    found.figures.push(Figure::error("edges that are misjudged", f64::from(wrong), 0.0, Unit::Count));
    found.figures.push(Figure::error("largest error", aside, 5e-4, Unit::Millimetres));
    Ok(found)
}
