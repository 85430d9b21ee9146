//! SR and VR in one march (thesis 4.4.2): the whole ray is composited, and the distance of its surface is found in the same samples. They
//! lie in the middles of the detector's steps, so opacities are corrected for that step. Compositing takes each of them once and in
//! order, whatever the detector does, which steps back where it fires.

use super::{cap, ray, surface, volume};
use crate::passes::empty_space;
use crate::passes::light_volume;
use crate::passes::pass::*;

pub(crate) const PASS: Pass = Pass {
    name: "raycast_surface_and_volume",
    shader: |_, _| "raycast/surface_and_volume",
    needed: |s| s.marches_once(),
    reads: |s, _| {
        let mut reads = ray::marching_reads(s, empty_space::surface_skipping(s));
        // What either of the two need not see is left out of that one.
        reads.extend(empty_space::volume_skipping(s).map(|slot| whole("volume_bricks", slot)));
        reads.push(whole("transfer", Slot::Transfer));
        reads.extend(light_volume::reads(s));
        reads.extend(cap::reads(s));
        reads
    },
    writes: |s, _| [surface::writes(s), vec![whole("picture", composited_beside_surface(s))]].concat(),
    params: |s, _| {
        let [low, high] = s.volume_view().window;
        volume::compositing_params(s, surface::params(s), s.ring.step)
            .f32("volume_window_low", low)
            .f32("volume_window_scale", 1.0 / (high - low))
    },
    constants: |s, _| [surface::constants(s), volume::compositing_constants(s, false)].concat(),
    tolerance: Tolerance::absolute(4e-3).relative(1e-5).outliers(2e-2).because(
        "of distances, the tolerance of raycast_surface; of colours, that of raycast_volume, on the same samples",
    ),
    reference: |scene, _, reads, writes| {
        for (x, y) in writes.get("picture").pixels() {
            surface::reference_ray(scene, reads, writes, x, y);
            let colour = match cap::cut_at(scene, reads, x, y) {
                Some(cut) => cut.over([0.0; 4]),
                None => volume::composited(scene, reads, scene.ring.step, [x, y]),
            };
            writes.get_mut("picture").set([x, y, 0], &colour);
        }
    },
    ..surface::PASS
};
