//! Stills: what is in their plans, and what is refused.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene, settings};
use echolume::low_level::passes::Slot;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;

fn built(toml: &str) -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, toml)
}

fn passes(scene: &Scene) -> Vec<&'static str> {
    Plan::new(scene).steps.iter().map(|step| step.pass.name).collect()
}

/// A scene without a still has no pass and no slot of one, and a still takes the place of compositing and of the light volume.
#[test]
fn a_plan_has_the_passes_of_a_still_only_if_it_is_one() {
    for mode in ["vr", "sr", "mixed", "mip", "cube", "orthogonal"] {
        let plan = Plan::new(&built(&format!("mode = '{mode}'\nlight = {{ volume = {{}} }}")));
        assert!(plan.steps.iter().all(|step| !step.pass.name.contains("still")), "{mode}");
        assert!(plan.slots.iter().all(|slot| !slot.name().contains("still")), "{mode}");
    }
    let still = built(
        "mode = 'vr'\nlight = { volume = {} }\nstill = { samples = 9, batch = 4 }\nray = { brick = 4 }\nclip = [{ at = [0, 30, 0], normal = [0, -1, 0] }]",
    );
    let of_still =
        ["still_majorants", "still_begin", "still_paths", "still_paths", "still_paths", "still_resolve", "tone"];
    let names = passes(&still);
    assert_eq!(names[names.len() - 7..], of_still, "{names:?}");
    let others = ["raycast_volume", "light_", "classify", "brick_distance", "raycast_cap"];
    assert!(!names.iter().any(|name| others.iter().any(|other| name.starts_with(other))), "{names:?}");
    let without = built("mode = 'vr'\nstill = {}\nray = { brick = 0 }");
    assert!(!passes(&without).contains(&"still_majorants"));
    assert!(!Plan::new(&without).slots.contains(&Slot::StillMajorants));
}

#[test]
fn what_is_no_still_is_refused_in_one_line() {
    for (toml, what) in [
        ("mode = 'sr'\nstill = {}", "mode volume"),
        ("mode = 'mixed'\nstill = {}", "mode volume"),
        ("mode = 'vr'\nvolume = { shading = 'first-hit' }\nstill = {}", "volume.shading"),
        ("mode = 'vr'\nray = { sliding = 3 }\nstill = {}", "ray.sliding"),
        ("mode = 'vr'\nlight = { position = [0, 0, 9] }\nstill = {}", "light.position"),
        ("mode = 'vr'\nstill = { samples = 0 }", "still.samples"),
        ("mode = 'vr'\nstill = { samples = 65537 }", "still.samples"),
        ("mode = 'vr'\nstill = { albedo = 1.1 }", "still.albedo"),
        ("mode = 'vr'\nstill = { anisotropy = 1.0 }", "still.anisotropy"),
        ("mode = 'vr'\nstill = { extinction = nan }", "still.extinction"),
    ] {
        let fault = settings(toml).check().expect_err(toml).to_string();
        assert!(fault.contains(what) && !fault.contains('\n'), "{toml}: {fault}");
    }
}
