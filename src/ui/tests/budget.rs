//! The quality ladder and the frames that are there: no rung sends them through stage 1 again.

use super::*;
use crate::frame_budget::{Rung, built_in_ladder, lowered};
use crate::live::{Update, Views};
use crate::passes::Stage;
use crate::plan::{Plan, Rerun, Work};
use crate::scene::Sampling;
use crate::source::recorder::Header;

/// What a change of scene sends through stage 1 again, if anything, on a CPU.
fn stage_1(before: &Scene, after: &Scene) -> Option<String> {
    let [before, after] = [before, after].map(|scene| scene.clone().sampled(Sampling::PackedNeighbours));
    let plan = Plan::new(&after);
    match plan.rerun(&before, &after) {
        Rerun::Steps { steps, .. } => {
            let mut again = steps.iter().map(|i| plan.steps[*i].pass).filter(|pass| pass.stage == Stage::Preprocess);
            again.next().map(|pass| pass.name.to_string())
        }
        other => Some(format!("{other:?}")),
    }
}

#[test]
fn no_rung_needs_stage_1_again() {
    // Longer steps reach further out of the visible part of a volume: an error report may choose them.
    let mut rungs = built_in_ladder();
    rungs.push(Rung::measured("ray.step=2.5"));
    let mut apart = 0;
    for (geometry, preset) in geometries().iter().take(2).flat_map(|g| presets().map(move |preset| (g, preset))) {
        for toml in ["region.depth=[10,60]", "region.depth=[10,60]\nray.sliding=3"] {
            let settings = settings(preset, toml);
            let Ok(full) = Scene::new(geometry.clone(), BYTES, settings.clone()) else { continue };
            let (forward, backward) = (geometry.clone(), geometry.clone());
            let header =
                Header { forward, backward, stored: BYTES.stored, range: BYTES.range, posed: false, synthetic: false };
            let shared = |of: &Settings| {
                let views = Views::new(&header, of, Update::Whole).expect("views");
                let views = views.sharing(&header, &settings, &|scene| lowered(&rungs, scene));
                views.expect("views").first().clone()
            };
            let rest = shared(&settings);
            for rung in &rungs[1..] {
                let moving = rung.apply(&settings);
                let alone = Scene::new(geometry.clone(), BYTES, moving.clone()).expect("scene");
                apart += u32::from(stage_1(&full, &alone).is_some());
                let moving = shared(&moving);
                for (from, to) in [(&rest, &moving), (&moving, &rest)] {
                    assert_eq!(stage_1(from, to), None, "{preset} {toml}: {rung:?}");
                }
            }
        }
    }
    assert!(apart > 0, "scenes that share nothing need it: the test means something");
}

#[test]
fn the_work_of_a_change_is_what_it_draws_again() {
    let geometry = &geometries()[0];
    let work = |preset: &str, toml: &str, changed: &str| {
        let [before, after] = [toml.to_string(), format!("{toml}\n{changed}")]
            .map(|toml| scene(geometry, &settings(preset, toml.trim())));
        Work::between(&before, &after)
    };
    assert_eq!(work("face-classic", "", "post.brightness=0.1"), Work::Tone);
    assert_eq!(work("face-classic", "", "light.ambient=0.7"), Work::Shading);
    assert_eq!(work("face-classic", "", "camera.azimuth=40"), Work::Rays);
    assert_eq!(work("", "layout='four'", "planes.position=[1,60,0]"), Work::Tone);
    assert_eq!(work("", "mode='plane'", "planes.position=[0,60,3]"), Work::Rays);
}
