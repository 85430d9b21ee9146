//! What runs again after a change: the least that makes the picture right, and the filters that must rerun for a lost input.

use super::{FILTERED, fan, scene};
use crate::common::probes::voxels;
use echolume::low_level::plan::{Contents, Plan, Rerun};
use echolume::low_level::probe::{Advance, Geometry};
use echolume::low_level::scene::{Input, Scene};

const SURFACE: &str = "mode = 'sr'
    picture = { size = [24, 24] }
    slices = { pixels = 96, median = true }
    distance = { median = 3, bilateral = { pixels = 1.0, distance = 2.0, repeat = 3 } }";

fn with(more: &str) -> Scene {
    scene(fan(Advance::None), &format!("{SURFACE}\n{more}"))
}

fn rerun(old: &Scene, new: &Scene) -> Rerun {
    Plan::new(new).rerun(old, new)
}

/// The passes that run again, each once, and the slots that are created again.
fn again(old: &Scene, new: &Scene) -> (String, String) {
    let plan = Plan::new(new);
    match plan.rerun(old, new) {
        Rerun::Steps { steps, slots } => {
            let mut passes: Vec<_> = steps.iter().map(|i| plan.steps[*i].pass.name).collect();
            passes.dedup();
            (passes.join(" "), slots.iter().map(|s| s.name()).collect::<Vec<_>>().join(" "))
        }
        other => (format!("{other:?}"), String::new()),
    }
}

fn passes(old: &Scene, new: &Scene) -> String {
    again(old, new).0
}

#[test]
fn a_change_of_nothing_runs_nothing() {
    let ways = [Advance::None, Advance::Same(0.02), Advance::Each((0..9).map(|k| 0.002 * f64::from(k)).collect())];
    for toml in
        [SURFACE, "mode = 'vr'", "mode = 'mixed'\nlayout = 'four'", "mode = 'cube'", "conditioning = { samples = 20 }"]
    {
        for way in &ways {
            let same = || scene(fan(way.clone()), toml);
            assert_eq!(rerun(&same(), &same()), Rerun::Steps { steps: vec![], slots: vec![] }, "{toml}");
        }
    }
}

#[test]
fn only_readers_of_a_changed_slot_run_again() {
    let lit = "light assemble_toned";
    assert_eq!(passes(&with(""), &with("light = { direction = [1.0, 0.0, 0.5] }")), lit);
    assert_eq!(passes(&with(""), &with("post = { gamma = 2.0 }")), "assemble_toned");
    let filtered = "median_distance bilateral_distance light assemble_toned";
    assert_eq!(passes(&with(""), &with("camera = { azimuth = 10 }")), format!("raycast_surface {filtered}"));
    assert_eq!(
        passes(&with(""), &with("surface = { threshold = 0.3 }")),
        format!("classify_bricks_surface brick_distance_surface raycast_surface {filtered}")
    );
    // Another median window is a constant of its pipeline; shadow is one more pass, whose slot the light reads.
    let wider = scene(fan(Advance::None), &SURFACE.replace("median = 3", "median = 5"));
    assert_eq!(passes(&with(""), &wider), filtered);
    assert_eq!(passes(&with(""), &with("light = { shadow = {} }")), "shadow light assemble_toned");
    assert_eq!(passes(&with("light = { shadow = {} }"), &with("")), lit);
    // One repetition less: the remaining ones have run already, but the light reads the other of the two slots.
    let shorter = scene(fan(Advance::None), &SURFACE.replace("repeat = 3", "repeat = 2"));
    assert_eq!(passes(&with(""), &shorter), lit);
    let Rerun::Steps { steps, .. } = rerun(&shorter, &with("")) else { panic!("the volume stays") };
    let plan = Plan::new(&with(""));
    let ids: Vec<_> = steps.iter().map(|i| plan.steps[*i].id()).collect();
    assert_eq!(ids, [("bilateral_distance", 2), ("light", 0), ("assemble_toned", 0)]);
}

#[test]
fn stage_1_runs_again_when_its_parameters_change() {
    let sharper = |settings: &str| scene(voxels([6, 8, 5]), &FILTERED.replace("median = true", settings));
    let before = sharper("sigma = { sigma = 0.1 }");
    assert_eq!(rerun(&before, &sharper("sigma = { sigma = 0.2 }")), Rerun::Frames);
    // The volume before smoothing across slices still exists.
    let wider = scene(voxels([6, 8, 5]), &FILTERED.replace("elevation = 1.0", "elevation = 1.2"));
    let plain = scene(voxels([6, 8, 5]), FILTERED);
    assert_eq!(passes(&plain, &wider), "gaussian_elevation raycast_projection tone");
    // The gain curve is computed again, for the frames that are sent again.
    let gain = |gain: f64| with(&format!("conditioning = {{ tgc = [{{ depth = 5, gain = {gain} }}] }}"));
    assert_eq!(rerun(&gain(1.0), &gain(2.0)), Rerun::Frames);
}

#[test]
fn slots_of_another_shape_format_or_meaning_are_created_again() {
    let stored =
        |format: &str| scene(fan(Advance::None), &SURFACE.replace("median = true", &format!("format = '{format}'")));
    assert_eq!(rerun(&stored("r16f"), &stored("r8")), Rerun::Everything);
    let pixels = scene(fan(Advance::None), &SURFACE.replace("pixels = 96", "pixels = 97"));
    assert_eq!(rerun(&with(""), &pixels), Rerun::Everything);
    // Another speed of sound changes no slot and no parameter, but the frames belong to another probe.
    let Geometry::Sweep(mut probe) = fan(Advance::None) else { panic!("a sweep") };
    probe.sound_speed = 1500.0;
    assert_eq!(rerun(&with(""), &scene(Geometry::Sweep(probe), SURFACE)), Rerun::Everything);
    let input = Input { range: [0.0, 100.0], ..with("").input };
    let brighter = Scene::new(fan(Advance::None), input, with("").settings).expect("scene");
    assert_eq!(rerun(&with(""), &brighter), Rerun::Everything);
    // Frames that are only copied have no pass that could show the change.
    let copied = |format: &str| scene(voxels([6, 8, 5]), &format!("mode = 'mip'\nslices = {{ format = '{format}' }}"));
    assert_eq!(rerun(&copied("r8"), &copied("r16f")), Rerun::Everything);
}

/// A region of several workgroups shrinks and grows again.
#[test]
fn smaller_visible_bounds_keep_the_volume_and_larger_ones_need_frames() {
    let (all, less) = (with(""), with("region = { depth = [10, 20] }"));
    assert!(all.visible_bounds.holds(&less.visible_bounds) && all.visible_bounds != less.visible_bounds);
    let marched = "raycast_surface median_distance bilateral_distance light assemble_toned";
    let bricks = "brick_ranges classify_bricks_surface brick_distance_surface";
    assert_eq!(passes(&all, &less), format!("{bricks} {marched}"), "its bricks are fewer");
    let whole = SURFACE.replace("median = true", "median = true, everything = true");
    let dragged = |toml: &str| scene(fan(Advance::None), &format!("{whole}\n{toml}"));
    assert_eq!(passes(&dragged(""), &dragged("region = { depth = [10, 20] }")), marched, "its bricks stay");
    assert_eq!(rerun(&less, &all), Rerun::Frames);
}

#[test]
fn lookup_tables_are_built_again_when_their_inputs_change() {
    let volume =
        |way: Advance, more: &str| scene(fan(way), &format!("mode = 'vr'\nslices = {{ pixels = 40 }}\n{more}"));
    let still = |more: &str| volume(Advance::None, more);
    let marched = "raycast_volume tone";
    let (run, made) = again(&still(""), &still("volume = { transfer = 'bone' }"));
    assert_eq!(
        (run, made),
        (format!("classify_bricks_volume brick_distance_volume {marched}"), "opaque_before transfer".into())
    );
    let pre = "compositing = 'pre-integrated'";
    let (run, made) =
        again(&still(&format!("volume = {{ {pre} }}")), &still(&format!("volume = {{ {pre}, transfer = 'bone' }}")));
    assert_eq!(
        (run, made),
        (format!("classify_bricks_volume brick_distance_volume {marched}"), "opaque_before pre_integrated".into())
    );
    let entries = |n: u32| still(&format!("ray = {{ entries = {n} }}"));
    assert_eq!(rerun(&entries(1025), &entries(513)), Rerun::Frames, "of all tables alike");
    let (run, made) = again(&still("ray = { brick = 8 }"), &still("ray = { brick = 16 }"));
    assert!(run.starts_with("brick_ranges classify_bricks_volume") && made == "brick_table", "{run}: {made}");
    // The motor moves in the other direction, or further, during a frame: the tables of the sweep change, the lines of a frame do not.
    let [forth, back, fast] =
        [0.02, -0.02, 0.03].map(|way| volume(Advance::Same(way), "ray = { slice_index = 'table' }"));
    assert_eq!(again(&forth, &back).1, "");
    assert_eq!(again(&forth, &fast).1, "brick_table sweep_lut");
    let [forth, fast] = [0.02, 0.03].map(|way| volume(Advance::Same(way), ""));
    assert_eq!(again(&forth, &fast).1, "brick_table", "a polynomial has no table");
    let each = |sign: f64| volume(Advance::Each((0..9).map(|k| sign * 0.002 * f64::from(k)).collect()), "");
    assert_eq!(again(&each(1.0), &each(-1.0)).1, "slice_table");
    assert_eq!(again(&each(1.0), &each(1.5)).1, "brick_table slice_table");
}

#[test]
fn tiles_and_blocks_follow_from_their_planes() {
    let cut = |at: f64, everything: bool| {
        let slices = format!("slices = {{ pixels = 40, everything = {everything} }}");
        scene(fan(Advance::None), &format!("mode = 'plane'\nplanes = {{ tilt = {at} }}\n{slices}"))
    };
    assert_eq!(rerun(&cut(0.0, false), &cut(5.0, false)), Rerun::Frames, "it crosses slices that were left out");
    assert_eq!(rerun(&cut(5.0, false), &cut(5.0, true)), Rerun::Frames);
    let planes = |at: f64| cut(at, true);
    assert_eq!(again(&planes(0.0), &planes(5.0)), ("raycast_planes_toned".into(), "tiles".into()));
    let cube = |inset: f64| {
        scene(
            fan(Advance::None),
            &format!("mode = 'cube'\ncube = {{ inset = {{ bottom = {inset} }} }}\nslices = {{ pixels = 40 }}"),
        )
    };
    assert_eq!(again(&cube(1.0), &cube(5.0)).1, "block");
}

/// The filters of the distance map alternate between two slots: median writes A, the bilateral B, A and B again.
#[test]
fn a_filter_with_an_overwritten_input_reruns_the_filters_before_it() {
    let scene = with("");
    let plan = Plan::new(&scene);
    let stale_after = |which: &[(&str, u32)], contents: &Contents| {
        let mut stale: Vec<bool> = plan.steps.iter().map(|s| which.contains(&s.id())).collect();
        plan.complete(&scene, &mut stale, contents);
        plan.steps.iter().zip(stale).filter(|(_, s)| *s).map(|(step, _)| step.id()).collect::<Vec<_>>()
    };
    // The state after a picture.
    let mut contents = Contents::new();
    for step in plan.steps.iter().filter(|s| s.pass.frequency != echolume::low_level::passes::Frequency::Frame) {
        contents.extend(step.writes(&scene).into_iter().map(|slot| (slot, step.id())));
    }
    let bilateral = |n| ("bilateral_distance", n);
    let tail = [("light", 0), ("assemble_toned", 0)];
    assert_eq!(stale_after(&tail, &contents), tail, "what they read is there");
    assert_eq!(stale_after(&[], &contents), []);
    // The third has overwritten the input of the second, so the first runs; the second has overwritten its input.
    let all = [("median_distance", 0), bilateral(0), bilateral(1)];
    assert_eq!(stale_after(&[bilateral(1)], &contents), all);
    assert_eq!(stale_after(&[bilateral(2)], &contents), [bilateral(2)], "the second's result is still in A");
    assert_eq!(stale_after(&[("median_distance", 0)], &contents), [("median_distance", 0)]);
    // Results of stage 1 never count as lost; slots that were never written do.
    assert_eq!(stale_after(&[("tile_ranges", 0)], &Contents::new()), [("tile_ranges", 0)]);
    let first = [("tile_ranges", 0), ("brick_ranges", 0)];
    assert_eq!(stale_after(&[("brick_ranges", 0)], &Contents::new()), first);
}

#[test]
fn another_shader_runs_its_passes_and_what_reads_their_results() {
    let scene = with("");
    let plan = Plan::new(&scene);
    let again = |shader: &str| match plan.rerun_shaders(&scene, |name| name.starts_with(shader)) {
        Rerun::Steps { steps, slots } => {
            assert!(slots.is_empty(), "{shader}: the scene is the same");
            let mut passes: Vec<_> = steps.iter().map(|i| plan.steps[*i].pass.name).collect();
            passes.dedup();
            passes.join(" ")
        }
        other => format!("{other:?}"),
    };
    assert_eq!(again("raycast/volume"), "", "it is not used");
    assert_eq!(again("postprocess/assemble"), "assemble_toned");
    assert_eq!(again("shade/light"), "light assemble_toned");
    assert_eq!(again("raycast/surface"), "raycast_surface median_distance bilateral_distance light assemble_toned");
    assert_eq!(again("preprocess/scan_convert"), "Frames");
}
