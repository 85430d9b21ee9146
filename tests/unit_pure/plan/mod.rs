//! Plans, without a GPU: steps and slots, what runs again after a change, the accesses of a dispatch,
//! the slots that the filters of a chain alternate between.

mod accesses;
mod chains;
mod reruns;

use crate::common::probes::{voxels, wobbler};
use crate::common::scenes;
use echolume::low_level::passes::{Frequency, Slot};
use echolume::low_level::plan::{Plan, Step, affected};
use echolume::low_level::probe::{Advance, Geometry, Probe};
use echolume::low_level::scene::{Input, Scene, VisibleBounds};
use echolume::low_level::source::StoredType;

fn fan(advance: Advance) -> Geometry {
    Geometry::Sweep(Probe { advance, ..wobbler() })
}

/// Bytes that a pass scales: slices of voxels take one more.
const SCALED: Input = Input { stored: StoredType::U8, range: [0.0, 200.0] };

fn scene(geometry: Geometry, toml: &str) -> Scene {
    scenes::scene(geometry, SCALED, toml)
}

fn step<'a>(plan: &'a Plan, name: &str) -> &'a Step {
    plan.steps.iter().find(|s| s.pass.name == name).unwrap_or_else(|| panic!("no {name}"))
}

const FILTERED: &str = "mode = 'mip'
    ray = { brick = 0 }
    picture = { size = [5, 4] }
    slices = { median = true, perona_malik = { scheme = 'aos', repeat = 2 }, smooth = { elevation = 1.0 } }";

#[test]
fn steps_are_sorted_by_their_frequency() {
    let plan = Plan::new(&scene(voxels([6, 8, 5]), FILTERED));
    let names = |when| plan.steps_of(when).map(|(i, s)| (i, s.pass.name, s.iteration)).collect::<Vec<_>>();
    let frame = names(Frequency::Frame);
    assert_eq!(frame[..2], [(0, "load_slice", 0), (1, "median_slice", 0)]);
    assert_eq!(frame[2..], std::array::from_fn::<_, 8, _>(|n| (2 + n, "aos_slice", n as u32)));
    assert_eq!(names(Frequency::Volume), [(10, "gaussian_elevation", 0)]);
    assert_eq!(names(Frequency::Picture), [(11, "raycast_projection", 0), (12, "tone", 0)]);
    assert_eq!(plan.steps[9].id(), ("aos_slice", 7));
    assert_eq!(plan.steps[9].args().iteration, 7);
}

#[test]
fn a_step_names_what_it_reads_and_what_it_writes() {
    let scene = scene(fan(Advance::None), "mode = 'vr'");
    let plan = Plan::new(&scene);
    let names = |slots: Vec<Slot>| slots.iter().map(|slot| slot.name()).collect::<Vec<_>>();
    let of = |name: &str| (names(step(&plan, name).reads(&scene)), names(step(&plan, name).writes(&scene)));
    let (reads, writes) = of("scan_convert");
    assert!(reads.contains(&"frames") && reads.contains(&"scan_lut"), "{reads:?}");
    assert_eq!(writes, ["volume"]);
    let (reads, writes) = of("tone");
    assert_eq!((reads, writes), (vec!["picture"], vec!["screen"]));
}

#[test]
fn a_step_reaches_as_many_slices_as_its_gaussian() {
    let plan = Plan::new(&scene(voxels([6, 8, 5]), FILTERED));
    assert_eq!(step(&plan, "gaussian_elevation").reach(&scene(voxels([6, 8, 5]), FILTERED)), 3);
    assert_eq!(step(&plan, "median_slice").reach(&scene(voxels([6, 8, 5]), FILTERED)), 0);
}

/// Batches of five frames of 6x8 bytes, four in flight; five layers each of two spare slots and the three of an elimination, all of f32; two
/// volumes of 6x8x5 in R16F; a picture of 5x4 in RGBA16F and one of bytes.
#[test]
fn a_plan_counts_the_bytes_of_its_slots() {
    let scene = scene(voxels([6, 8, 5]), FILTERED);
    let plan = Plan::new(&scene);
    let slots: Vec<_> = plan.slots.iter().map(|s| s.name()).collect();
    let expected =
        ["frames", "slice_a", "slice_b", "slice_shares", "slice_forward", "slice_rows", "sharp_volume", "volume"];
    assert_eq!(slots[..8], expected);
    assert_eq!(slots[8..], ["picture", "screen"]);
    assert_eq!(plan.bytes(&scene), 5 * 48 * 4 + 5 * 5 * 48 * 4 + 2 * 240 * 2 + 20 * 8 + 20 * 4);
}

#[test]
fn a_plan_explains_itself() {
    let scene = scene(voxels([6, 8, 5]), FILTERED);
    let text = Plan::new(&scene).explain(&scene);
    let headings: Vec<_> = text.lines().filter(|l| l.starts_with("stage ")).collect();
    assert_eq!(headings, ["stage 1: preprocess", "stage 2: raycast", "stage 3: shade", "stage 4: postprocess"]);
    let line = |start: &str| {
        let found: Vec<_> = text.lines().filter(|l| l.trim_start().starts_with(start)).collect();
        assert_eq!(found.len(), 1, "{start}: {found:?}");
        found[0].split_whitespace().collect::<Vec<_>>().join(" ")
    };
    // Runs of eight slices: 5 of them in one invocation.
    assert_eq!(line("+ gaussian_elevation"), "+ gaussian_elevation 6 x 8 x 1, each volume: asked for");
    assert_eq!(line("+ aos_slice"), "+ aos_slice 8 x 1 x 1, each frame, 8 times: asked for");
    assert_eq!(line("+ tone"), "+ tone 5 x 4 x 1, each picture: every picture ends in 8 bits");
    assert_eq!(line("- sigma_slice"), "- sigma_slice not asked for");
    // Eight dispatches of five pipelines, each listed once: those of rows, of columns, and of the columns that go to the volume.
    let listed: Vec<&str> = text.lines().map(str::trim).filter(|line| line.starts_with("filter/aos")).collect();
    let forward = "filter/aos_forward.slice: slice_b -> slice_shares, slice_forward";
    let rows = "filter/aos_backward.slice: slice_shares, slice_forward -> slice_rows";
    let columns = "filter/aos_backward.slice: slice_shares, slice_forward, slice_rows -> slice_a";
    let last = "filter/aos_backward.slice: slice_shares, slice_forward, slice_rows -> sharp_volume";
    assert_eq!(listed, [forward, rows, forward, columns, last]);
    assert!(line("samples of the volume").contains("fastest"));
    assert_eq!(
        line("visible"),
        "visible: columns 0..6 of 6, rows 0..8 of 8, slices 0..5 of 5: 100.0 % of the volume; frames 0..5"
    );
    assert_eq!(line("total"), "total 6960 bytes");
}

#[test]
fn runs_of_slices_end_where_the_volume_does() {
    let changed = |which: &[usize]| (0..6).map(|i| which.contains(&i)).collect::<Vec<_>>();
    assert_eq!(affected(&changed(&[1]), 3), vec![0..5; 1]);
    assert_eq!(affected(&changed(&[4]), 3), vec![1..6; 1]);
    assert_eq!(affected(&changed(&[0, 2, 5]), 0), [0..1, 2..3, 5..6]);
    // Adjacent without an overlap: one run all the same.
    assert_eq!(affected(&changed(&[0, 3]), 1), vec![0..5; 1]);
    assert_eq!(affected(&changed(&[1, 2]), 0), vec![1..3; 1]);
}

#[test]
fn what_lies_beside_the_sector_is_an_empty_box_and_not_one_turned_inside_out() {
    for side in [[30.0, 38.0], [-38.0, -30.0]] {
        let settings = format!("mode = 'mip'\nregion = {{ lateral = {side:?}, depth = [2, 6] }}");
        let scene = scene(fan(Advance::None), &settings);
        assert_eq!(
            (scene.visible_bounds, scene.visible_share(), scene.visible_frames()),
            (VisibleBounds::default(), 0.0, 0..0)
        );
    }
}

/// Prevents passes of the detector that chooses among neighbours in other plans, and settings of it that nothing would follow.
#[test]
fn the_consistent_detector_has_passes_of_its_own() {
    let with = |surface: &str| scene(voxels([20, 20, 20]), &format!("mode = 'sr'\n[surface]\n{surface}"));
    let passes = |scene: &Scene| -> Vec<_> { Plan::new(scene).steps.iter().map(|s| s.pass.name).collect() };
    let own = ["raycast_candidates", "surface_paths", "choose_surface"];
    let (plain, consistent) = (passes(&with("")), passes(&with("detector = 'consistent'")));
    assert!(plain.contains(&"raycast_surface") && !own.iter().any(|p| plain.contains(p)), "{plain:?}");
    assert!(!consistent.contains(&"raycast_surface") && own.iter().all(|p| consistent.contains(p)), "{consistent:?}");
    assert!(!Plan::new(&with("")).slots.contains(&Slot::Candidates));
    for (other, word) in [("rough = 2", "rough"), ("number = 2", "number"), ("place = 'middle'", "place")] {
        let toml = format!("mode = 'sr'\n[surface]\ndetector = 'consistent'\n{other}");
        let fault = Scene::new(voxels([20, 20, 20]), SCALED, scenes::settings(&toml)).err().map(|e| e.to_string());
        let names = |f: &String| f.contains(&format!("surface.{word}")) && f.contains("surface.detector=consistent");
        assert!(fault.as_ref().is_some_and(names), "{fault:?}");
    }
}
