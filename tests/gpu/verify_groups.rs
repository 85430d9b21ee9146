//! The groups of `echolume verify` that check the complete program: each passes on this device, or does so in the tests of `cli`, and detects its
//! faults.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Context, ContextOptions, GpuError, Renderer, RendererOptions};
use echolume::low_level::passes::Span;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Geometry;
use echolume::low_level::verify::report::{Level, Outcome, Verdict};
use echolume::low_level::verify::{self, Check, DeviceUnderTest, Findings, built_in};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::sync::Arc;

fn bench() -> DeviceUnderTest {
    prepared(None)
}

/// A bench with a fault in every context.
fn prepared(wrong: Option<fn(&Context)>) -> DeviceUnderTest {
    let options =
        ContextOptions { device: chosen(), validation: true, specialize: Some(true), ..ContextOptions::default() };
    DeviceUnderTest::prepared(&options, Level::Quick, wrong).expect("bench")
}

/// The only check of that name.
fn named(checks: Vec<Check>, name: &str) -> Vec<Check> {
    let mut checks = checks;
    checks.retain(|check| check.name == name);
    assert_eq!(checks.len(), 1, "{name}");
    checks
}

/// Runs checks. Returns the failures as text.
fn failures(bench: &mut DeviceUnderTest, checks: &[Check]) -> Vec<String> {
    let tell = |outcome: &Outcome| {
        println!("{}: {} {:.2} s {:?}", outcome.group, outcome.name, outcome.seconds, outcome.verdict);
        outcome.figures.iter().for_each(|f| println!("    {} {}", f.what, f.value));
        outcome.notes.iter().for_each(|note| println!("    {note}"));
    };
    let names: Vec<_> = checks.iter().map(Check::title).collect();
    let mut group = None;
    let outcomes = verify::run_each(&names, || None, |n| checks[n].run_after(&mut group, bench), tell);
    let faults = |o: &Outcome| o.faults.iter().map(|f| format!("{}: {f:?}", o.name)).collect::<Vec<_>>();
    outcomes.iter().filter(|o| o.verdict == Verdict::Failed).flat_map(faults).collect()
}

/// The quick checks of groups whose time is that of compiling pipelines. The program leaves constants to the driver, for which validation takes
/// twice as long: tests/cli/verify.rs runs the other groups in this way, every mode among them.
fn all_pass(groups: &[&str]) {
    let mut bench = bench();
    // Some checks run it.
    bench.program = Some(PathBuf::from(env!("CARGO_BIN_EXE_echolume")));
    let checks: Vec<Check> =
        verify::checks(Level::Quick).into_iter().filter(|check| groups.contains(&check.group)).collect();
    assert!(groups.iter().all(|group| checks.iter().any(|check| check.group == *group)), "{groups:?}");
    assert!(bench.watched(), "the tests need the validation layer");
    let count = checks.len();
    let faults = failures(&mut bench, &checks);
    assert!(faults.is_empty(), "{count} checks: {}", faults.join("\n"));
}

#[test]
fn quick_checks_of_determinism_hazards_and_stress_pass_on_this_device() {
    all_pass(&["determinism", "hazards", "stress"]);
}

#[test]
fn quick_checks_of_failures_formats_and_memory_pass_on_this_device() {
    all_pass(&["failures", "formats", "memory", "specialization"]);
}

/// Spans of a picture: the host's, and two passes of the device.
fn spans(first: [f64; 2], second: [f64; 2]) -> Vec<Span> {
    let span =
        |name, on_device, [begin, end]: [f64; 2]| Span { name, on_device, begin, end, runs: 1, invocations: None };
    vec![
        span("submit", false, [1000.0, 2000.0]),
        span("raycast_volume", true, first),
        span("tone", true, second),
        span("wait", false, [2000.0, 11_000.0]),
    ]
}

/// A program with another output than this one, or with none, or that does not exist.
#[test]
fn a_result_that_depends_on_the_number_of_threads_is_detected() {
    let mut bench = bench();
    if !bench.context.candidate.name.contains("llvmpipe") {
        return;
    }
    let check = || named(verify::determinism::checks(Level::Quick), "any number of threads");
    let folder = Folder::new("threads");
    let program = |name: &str, text: &str| -> PathBuf {
        let file = folder.join(name);
        std::fs::write(&file, format!("#!/bin/sh\n{text}\n")).expect("written");
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).expect("a program");
        file
    };
    let digest = verify::determinism::digest(&bench.context).expect("digest");
    bench.program = Some(program("same", &format!("cat <<'end'\n{digest}end")));
    assert_eq!(failures(&mut bench, &check()), [""; 0]);
    let other = digest.replacen(&digest[..16], "0123456789abcdef", 1);
    bench.program = Some(program(
        "other",
        &format!("[ $LP_NUM_THREADS = 7 ] && cat <<'end' || cat <<'same'\n{other}end\n{digest}same"),
    ));
    let seen = failures(&mut bench, &check());
    assert!(seen.len() == 1 && seen[0].contains("LP_NUM_THREADS=7: another picture"), "{seen:?}");
    bench.program = Some(program("failing", "exit 3"));
    assert_eq!(failures(&mut bench, &check()).len(), 2);
    bench.program = Some(folder.join("none"));
    assert_eq!(check()[0].run(&mut bench).verdict, Verdict::LeftOut);
}

#[test]
fn a_picture_that_differs_by_one_bit_is_detected() {
    let mut bench = bench();
    let modes = bench.modes().expect("pictures");
    let mut other = modes[3].picture.clone();
    other.rgba[77] ^= 1;
    let mut found = Findings::default();
    assert!(verify::expect_same_picture(&mut found, "itself", &modes[3].picture, &modes[3].picture));
    assert!(found.faults.is_empty());
    assert!(!verify::expect_same_picture(&mut found, "other", &modes[3].picture, &other));
    assert!(found.faults[0].what.contains("1 of") && found.pictures.len() == 1, "{:?}", found.faults);
}

/// A skipped pass does not change its output: zeros, which look like a dark picture.
#[test]
fn an_output_that_is_not_written_is_detected() {
    let mut bench = prepared(Some(|context| context.faults.slow_down("light", 0)));
    let seen = failures(&mut bench, &named(verify::memory::checks(Level::Quick), "every variant on poisoned memory"));
    assert!(seen.iter().any(|fault| fault.contains("'picture' are never written")), "{seen:?}");
}

#[test]
fn leaked_memory_is_detected() {
    let context: Arc<Context> = bench().context.clone();
    let before = context.allocated();
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'mip'\npicture = { size = [16, 16] }");
    let renderer: Result<Renderer, GpuError> = Renderer::new(&context, scene, &RendererOptions::default());
    let mut found = Findings::default();
    verify::failures::expect_memory_returned(&mut found, &context, before, "while it is there");
    assert!(found.faults[0].what.contains("are still held"), "{:?}", found.faults);
    drop(renderer.expect("renderer"));
    verify::failures::expect_memory_returned(&mut found, &context, before, "when it is gone");
    assert_eq!(found.faults.len(), 1);
}

/// A volume that is shifted by half a voxel.
#[test]
fn a_picture_unlike_the_reference_is_detected() {
    use verify::formats::LargestDifference;
    use verify::render::stored_reference_picture;
    let bench = bench();
    let scene = scene(
        Geometry::Sweep(wobbler()),
        BYTES,
        "mode = 'mip'\npicture = { size = [40, 36] }\nslices = { pixels = 64 }",
    );
    let frames = built_in::wall(&scene, 0);
    let aside = body_frames(&scene, |p| if p.y + 0.4 > 42.0 { 0.8 } else { 0.15 });
    let (expected, allowed) = (stored_reference_picture(&scene, &frames), [0.6, 3.0]);
    let (mut largest, mut found) = (LargestDifference::default(), Findings::default());
    let picture = |frames| verify::render::picture(&bench.context, &scene, frames).expect("picture");
    largest.add(&mut found, "itself", &expected, &picture(&frames), allowed);
    assert!(found.faults.is_empty(), "{:?}", found.faults);
    largest.add(&mut found, "aside", &expected, &picture(&aside), allowed);
    assert!(found.faults.len() == 1 && found.pictures.len() == 1, "{:?}", found.faults);
}

/// Each volume is sent into the image that is drawn, instead of the other one.
#[test]
fn two_volumes_in_one_image_are_detected() {
    let bench = bench();
    let mut found = Findings::default();
    let into_the_same = |round: usize| round as u32 % 2;
    verify::hazards::alternating_images(&mut found, &bench.context, 1, 4, into_the_same).expect("pictures");
    let (compared, wrong) = (found.compared, found.differ);
    assert!(compared == 4 && wrong >= 2 && found.faults.len() == wrong, "{wrong} of {compared}: {:?}", found.faults);
}

/// The known answers detect the injected faults; each failure has two different pictures of the same size.
#[test]
fn a_wrong_known_answer_is_shown() {
    let sound = bench();
    for planted in verify::self_test::faults().filter(|p| ["stale slice", "shifted half pixel"].contains(&p.name)) {
        let mut bench = sound.with_fault(planted.change).expect("bench");
        // Every second one: the self-test runs all of them.
        let checks = verify::checks(Level::Quick).into_iter().filter(|check| check.group == "known answers").step_by(2);
        let outcomes: Vec<Outcome> = checks.map(|check| check.run(&mut bench)).collect();
        let failed: Vec<_> = outcomes.iter().filter(|o| o.verdict == Verdict::Failed).collect();
        assert!(!failed.is_empty(), "{} is not noticed", planted.name);
        for outcome in failed {
            let shown = outcome.pictures.iter().find(|shown| shown.fault.is_some()).expect("pictures");
            let size = (shown.actual.width, shown.actual.height);
            assert_eq!(size, (shown.expected.width, shown.expected.height));
            let fault = &outcome.faults[shown.fault.expect("its fault")];
            assert!(fault.worst.is_some() || fault.what.contains("miss a surface"), "{fault:?}");
            // A millionth is visible in the numbers, but in no picture of 8 bits.
            let is_large = fault.worst.as_ref().is_none_or(|w| (w.expected - w.got).abs() > 1e-3);
            let is_shown = shown.difference.rgba.chunks_exact(4).any(|texel| texel[0] > 0);
            assert!(is_shown || !is_large, "{}: {fault:?}", outcome.name);
        }
    }
}

/// A tile is less than one hundredth of a picture: 2 of all values may be far off, but half of a tile.
#[test]
fn one_lost_workgroup_is_detected() {
    let grey = Picture { width: 80, height: 64, rgba: vec![128; 4 * 80 * 64] };
    let judged = |first: u32, size: [u32; 2]| {
        let (mut found, mut got) = (Findings::default(), grey.clone());
        let place = |i: usize| [i as u32 % 80, i as u32 / 80];
        let texels = got.rgba.chunks_exact_mut(4).enumerate();
        let within = |at: u32, size: u32| (first..first + size).contains(&at);
        let lost = texels.filter(|(i, _)| place(*i).iter().zip(size).all(|(at, size)| within(*at, size)));
        lost.for_each(|(_, texel)| texel.fill(0));
        verify::compare_picture(&mut found, "grey", &grey, &got);
        found.faults.len()
    };
    assert_eq!(judged(16, [8, 8]), 1, "a workgroup");
    assert_eq!(judged(16, [3, 24]), 0, "an edge that moved");
    assert_eq!(judged(16, [0, 0]), 0);
}

#[test]
fn stamps_that_run_backwards_leave_gaps_or_are_longer_than_the_wait_are_seen() {
    use verify::time_stamps::check_spans;
    let [share, outside] = check_spans(&spans([2000.0, 8000.0], [8000.0, 10_000.0])).expect("sane");
    assert!((share - 0.8).abs() < 1e-9 && outside == 0.0);
    let of = |first, second| check_spans(&spans(first, second)).expect_err("seen");
    assert!(of([2000.0, 1500.0], [1500.0, 9000.0]).contains("'raycast_volume' took -500"));
    assert!(of([2000.0, 8000.0], [5000.0, 9000.0]).contains("lie between"));
    assert!(of([2000.0, 6.8e10], [6.8e10, 6.9e10]).contains("took"));
    assert!(of([2000.0, 9000.0], [9000.0, 13_500.0]).contains("all passes"));
    assert!(of([2000.0, 2000.0], [2000.0, 2000.0]).contains("all passes"));
    assert!(check_spans(&spans([2000.0, 8000.0], [8000.0, 9000.0])[..1]).is_err());
    let [_, outside] = check_spans(&spans([20_000.0, 26_000.0], [26_000.0, 27_000.0])).expect("sane in themselves");
    assert!(outside > 0.5, "the device's clock is another");
}

/// A frame of another body arrives before each picture.
#[test]
fn a_renderer_unlike_a_fresh_one_is_detected_by_the_stress_check() {
    let spoil = |renderer: &mut Renderer, image: u32| {
        let frame = vec![200; renderer.frame_bytes()];
        renderer.frame(4, &frame, image)
    };
    let found = verify::stress::stress(&mut bench(), 0.1, &spoil).expect("stress");
    assert!(found.faults.iter().any(|fault| fault.what.contains("values differ")), "{:?}", found.faults);
}

/// Prevents reports that say that validation watched where it sees nothing: layers from 2024 on ignore what shaders access unless asked.
#[test]
fn validation_counts_only_if_it_notices_a_dropped_barrier() {
    for validation in [true, false] {
        let options = ContextOptions { device: chosen(), validation, ..ContextOptions::default() };
        let mut bench = DeviceUnderTest::new(&options, Level::Quick).expect("bench");
        assert_eq!(bench.prove_validation().expect("a device"), validation);
        assert_eq!(bench.watched(), validation);
    }
}
