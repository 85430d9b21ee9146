//! Comparisons of simulated runs: how often identical ones are called different, and whether differences are found.

use super::simulated::{Noise, Random, pass, profile, run};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::profile::Profile;
use echolume::low_level::profile::compare::{CompareError, CompareOptions, Comparison, Kind, Line, Verdict, compare};
use echolume::low_level::profile::export::comparison_table;

const PAIRS: u32 = 400;

fn compared(old: &Profile, new: &Profile) -> Comparison {
    compare(old, new, &CompareOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn line<'a>(comparison: &'a Comparison, name: &str) -> &'a Line {
    comparison.lines.iter().find(|l| l.name == name).expect("line")
}

/// The number of pairs of identical runs in which anything is called different.
fn false_alarms(seed: u64, noise: Noise) -> u32 {
    let mut random = Random(seed);
    let alarm = |_: &u32| {
        let (old, new) = (run(&mut random, 12, 30, noise), run(&mut random, 12, 30, noise));
        compared(&old, &new).lines.iter().any(|l| l.verdict != Verdict::WithinNoise)
    };
    (0..PAIRS).filter(alarm).count() as u32
}

const STEADY: Noise = Noise { spread: 0.03, memory: 0.0, drift: 0.0, own_drift: 0.0, walk: 0.0, outliers: 0.0 };

/// 5 % of 400 are 20.
#[test]
fn identical_runs_are_rarely_called_different_under_any_noise() {
    let kinds = [
        ("independent", STEADY),
        ("outliers", Noise { outliers: 0.05, ..STEADY }),
        ("memory", Noise { memory: 0.6, ..STEADY }),
        ("drift", Noise { drift: 0.04, ..STEADY }),
        ("drift of each pass", Noise { own_drift: 0.04, ..STEADY }),
        ("random walk", Noise { walk: 0.02, ..STEADY }),
        ("drift and outliers", Noise { drift: 0.04, outliers: 0.05, ..STEADY }),
        ("everything", Noise { memory: 0.5, drift: 0.03, own_drift: 0.02, walk: 0.01, outliers: 0.05, ..STEADY }),
    ];
    for (seed, (name, noise)) in kinds.into_iter().enumerate() {
        let alarms = false_alarms(seed as u64 + 1, noise);
        println!("{name}: {alarms} of {PAIRS}");
        assert!(alarms * 20 <= PAIRS, "{name}: {alarms} of {PAIRS} pairs");
    }
}

/// How often one pass of 12, made slower by `factor`, is called slower.
fn found(seed: u64, noise: Noise, factor: f64) -> u32 {
    let mut random = Random(seed);
    let is_found = |i: &u32| {
        let (old, mut new) = (run(&mut random, 12, 30, noise), run(&mut random, 12, 30, noise));
        let slow = &mut new.passes[*i as usize % 12];
        slow.samples_ns.iter_mut().for_each(|ns| *ns *= factor);
        let name = slow.name.clone();
        let comparison = compared(&old, &new);
        let slow = line(&comparison, &name);
        let (verdict, regression) =
            if factor > 1.0 { (Verdict::Slower, factor > 1.08) } else { (Verdict::Faster, false) };
        slow.verdict == verdict && slow.is_regression == regression
    };
    (0..PAIRS).filter(is_found).count() as u32
}

#[test]
fn a_pass_that_is_ten_percent_slower_is_found_and_so_is_a_faster_one() {
    for (seed, factor) in [(11, 1.10), (12, 1.0 / 1.10)] {
        let times = found(seed, STEADY, factor);
        println!("{factor:.2}: {times} of {PAIRS}");
        assert!(times * 20 > PAIRS * 19, "{times} of {PAIRS}");
    }
    let times = found(13, Noise { drift: 0.02, outliers: 0.03, ..STEADY }, 1.15);
    println!("15 % under drift and outliers: {times} of {PAIRS}");
    assert!(times * 20 > PAIRS * 19, "{times} of {PAIRS}");
}

/// Without its second criterion the test would fail under drift: the simulation can fail.
#[test]
fn the_rank_test_alone_is_not_enough() {
    let mut random = Random(4);
    let noise = Noise { drift: 0.04, ..STEADY };
    let alarm = |_: &u32| {
        let (old, new) = (run(&mut random, 12, 30, noise), run(&mut random, 12, 30, noise));
        compared(&old, &new).lines.iter().any(|l| l.ratio.is_some_and(|r| r.p_holm <= 0.05))
    };
    let alarms = (0..PAIRS).filter(alarm).count() as u32;
    println!("rank test alone under drift: {alarms} of {PAIRS}");
    assert!(alarms * 10 > PAIRS, "{alarms} of {PAIRS}");
}

#[test]
fn intervals_of_ratios_cover_the_truth() {
    let mut random = Random(21);
    let (mut inside, mut all) = (0, 0);
    for _ in 0..PAIRS {
        let (old, new) = (run(&mut random, 6, 30, STEADY), run(&mut random, 6, 30, STEADY));
        for ratio in compared(&old, &new).lines.iter().filter(|l| l.kind == Kind::Pass).filter_map(|l| l.ratio) {
            assert!((ratio.coverage - 0.9588744588744589).abs() < 1e-12, "scipy: all C(12, 6) rank sums");
            inside += u32::from(ratio.low <= 1.0 && 1.0 <= ratio.high);
            all += 1;
        }
    }
    // 2400 lines: 0.9589 with a standard error of 0.004.
    let share = f64::from(inside) / f64::from(all);
    assert!((share - 0.9589).abs() < 0.016, "{share}");
}

#[test]
fn only_a_pass_or_the_wall_past_the_threshold_is_a_regression() {
    let mut random = Random(31);
    let noise = Noise { spread: 0.003, ..STEADY };
    let old = run(&mut random, 4, 30, noise);
    let mut new = run(&mut random, 4, 30, noise);
    let scale = |times: &mut Vec<f64>, by: f64| times.iter_mut().for_each(|ns| *ns *= by);
    scale(&mut new.passes[1].samples_ns, 1.03);
    scale(&mut new.passes[2].samples_ns, 1.2);
    let (mut old, mut new) = (old, new);
    old.host.push(pass("submit", old.passes[0].samples_ns.clone()));
    new.host.push(pass("submit", new.passes[0].samples_ns.iter().map(|ns| ns * 2.0).collect()));
    let comparison = compared(&old, &new);
    let verdicts: Vec<(&str, Verdict)> = comparison.lines.iter().map(|l| (l.name.as_str(), l.verdict)).collect();
    assert_eq!(line(&comparison, "pass 0").verdict, Verdict::WithinNoise, "{verdicts:?}");
    assert_eq!(line(&comparison, "pass 1").verdict, Verdict::Slower);
    assert_eq!(line(&comparison, "submit").verdict, Verdict::Slower);
    let names: Vec<&str> = comparison.regressions().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["pass 2"]);
    let strict = CompareOptions { threshold: Threshold::new(1.01).expect("a ratio"), ..CompareOptions::default() };
    let strict = compare(&old, &new, &strict).expect("comparison");
    assert_eq!(strict.regressions().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["pass 1", "pass 2"]);
    let text = comparison_table(&comparison);
    assert!(text.contains("SLOWER") && text.contains("slower by more than 5.0 %: pass 2\n"), "{text}");
    assert!(text.contains("test: Mann-Whitney on the medians of 6 blocks"), "{text}");
}

#[test]
fn lines_of_only_one_run_are_new_or_removed() {
    let mut random = Random(41);
    let mut old = run(&mut random, 3, 30, STEADY);
    let mut new = run(&mut random, 3, 30, STEADY);
    old.passes[0].name = "left".into();
    new.passes[0].name = "arrived".into();
    new.passes[1].runs_per_picture = 2;
    let comparison = compared(&old, &new);
    let arrived = line(&comparison, "arrived");
    assert_eq!((arrived.verdict, arrived.old_ns, arrived.ratio), (Verdict::New, None, None));
    assert_eq!(line(&comparison, "left").verdict, Verdict::Gone);
    assert_eq!(line(&comparison, "pass 1").note.as_deref(), Some("runs a picture: 1 -> 2"));
    assert!(comparison.regressions().next().is_none());
}

#[test]
fn indistinguishable_runs_say_why() {
    let mut random = Random(51);
    let few = run(&mut random, 3, 5, STEADY);
    let comparison = compared(&few, &few);
    assert!(comparison.lines.iter().all(|l| l.verdict == Verdict::NotComparable));
    let note = line(&comparison, "pass 0").note.as_deref();
    assert_eq!(note, Some("the old run has 5 repeats; with fewer than 6 nothing can be told apart"));

    let stamped = run(&mut random, 3, 30, STEADY);
    let mut without = stamped.clone();
    without.device.valid_bits = 0;
    without.device_ns.clear();
    without.passes.iter_mut().for_each(|p| p.samples_ns.clear());
    let comparison = compared(&stamped, &without);
    assert_eq!(line(&comparison, "pass 0").note.as_deref(), Some("the new run has no times"));
    assert_eq!(line(&comparison, "wall").verdict, Verdict::WithinNoise);

    let mut zero = stamped.clone();
    zero.passes[0].samples_ns = vec![0.0; 30];
    let comparison = compared(&stamped, &zero);
    let note = line(&comparison, "pass 0").note.as_deref();
    assert_eq!(note, Some("the new run has times of 0 ns: below what its clock resolves"));
}

/// Times that a coarse clock rounds differ by a tick without being different.
#[test]
fn less_than_a_tick_of_the_clock_is_no_difference() {
    let with = |ns: f64, period: f64| {
        let mut profile = profile(30);
        profile.device.timestamp_period_ns = period;
        profile.passes.push(pass("short", vec![ns; 30]));
        profile
    };
    assert_eq!(line(&compared(&with(1000.0, 1.0), &with(1052.0, 1.0)), "short").verdict, Verdict::Slower);
    assert_eq!(line(&compared(&with(1000.0, 60.0), &with(1052.0, 60.0)), "short").verdict, Verdict::WithinNoise);
}

#[test]
fn different_work_is_refused_by_name_unless_forced() {
    let old = profile(30);
    let mut new = old.clone();
    new.scene = "mode = \"vr\"\n[ray]\nstep = 0.25\nrays = 2\n".into();
    new.sizes.picture = [1024, 512];
    new.input = "sweep.vol".into();
    let error = compare(&old, &new, &CompareOptions::default()).expect_err("different work");
    let text = error.to_string();
    assert!(matches!(error, CompareError::DifferentWork(_)));
    for part in [
        "scene ray.step: 0.5 -> 0.25",
        "scene ray.rays: not set -> 2",
        "picture: 512 x 512 pixels -> 1024 x 512 pixels",
        "input: phantom -> sweep.vol",
        "--force",
    ] {
        assert!(text.contains(part), "{part} is not in: {text}");
    }
    assert!(!text.contains("mode"), "{text}");
    let forced = compare(&old, &new, &CompareOptions { force: true, ..CompareOptions::default() }).expect("forced");
    assert_eq!(forced.notes.len(), 4, "{:?}", forced.notes);
}

#[test]
fn other_devices_and_programs_are_compared_with_a_warning() {
    let old = profile(30);
    let mut new = old.clone();
    new.device.name = "another".into();
    new.device.clocks = None;
    new.program = "echolume 0.2.0, release".into();
    // The same settings, written differently.
    new.scene = format!("# resolved\n{}", old.scene);
    let notes = compared(&old, &new).notes;
    assert_eq!(
        notes,
        [
            "device: simulated -> another",
            "clocks: graphics 1.5 GHz -> not known",
            "program: echolume 0.1.0, release -> echolume 0.2.0, release"
        ]
    );
}

/// A lower clock slows every pass by the same factor: no pass is to blame.
#[test]
fn a_shift_of_all_passes_is_reported() {
    let mut random = Random(61);
    let noise = Noise { spread: 0.005, ..STEADY };
    let old = run(&mut random, 6, 30, noise);
    let mut new = run(&mut random, 6, 30, noise);
    assert!(compared(&old, &new).notes.is_empty());
    new.passes[0].samples_ns.iter_mut().for_each(|ns| *ns *= 1.25);
    assert!(compared(&old, &new).notes.is_empty(), "one pass is not all");
    new.passes[1..].iter_mut().flat_map(|p| &mut p.samples_ns).for_each(|ns| *ns *= 1.25);
    let notes = compared(&old, &new).notes;
    assert!(notes.len() == 1 && notes[0].starts_with("all passes changed alike, by a factor of 1.25"), "{notes:?}");
}

#[test]
fn broken_profiles_are_refused() {
    let good = profile(30);
    let mut broken = good.clone();
    broken.wall_ns[3] = f64::NAN;
    let message = compare(&good, &broken, &CompareOptions::default()).expect_err("NaN").to_string();
    assert_eq!(message, "new profile: wall_ns: time 3 is NaN ns; a time is finite and not below 0");
}
