//! Comparisons of simulated runs: how often identical ones are called different, and whether differences are found.

use super::simulated::{Noise, Random, pass, profile, run};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::profile::Profile;
use echolume::low_level::profile::compare::{
    CompareError, CompareOptions, Comparison, Kind, Line, Verdict, blocks_in_turn, compare, in_turn,
};
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

/// Prevents "nothing is slower" where the noise hides a pass that takes three times as long, and a limit that the test does not keep: a pass slowed by
/// more than its own limit is called slower.
#[test]
fn what_the_noise_may_hide_is_said_and_a_slowdown_beyond_it_is_found() {
    let mut random = Random(71);
    let loud = Noise { spread: 0.5, memory: 0.8, drift: 0.8, own_drift: 0.5, outliers: 0.2, ..STEADY };
    let mut hidden = 0;
    for pair in 0..100 {
        let (old, mut new) = (run(&mut random, 6, 12, loud), run(&mut random, 6, 12, loud));
        let slowed = format!("pass {}", pair % 6);
        let before = compared(&old, &new);
        let [limit, estimate] = [line(&before, &slowed).limit, line(&before, &slowed).ratio.map(|r| r.estimate)];
        let slow = |profile: &mut Profile, by: f64| {
            profile
                .passes
                .iter_mut()
                .filter(|p| p.name == slowed)
                .flat_map(|p| &mut p.samples_ns)
                .for_each(|ns| *ns *= by);
        };
        slow(&mut new, 3.0);
        let after = compared(&old, &new);
        let is_told = line(&after, &slowed).is_regression || after.cannot_tell().is_some();
        assert!(is_told, "{}", comparison_table(&after));
        assert!(!comparison_table(&after).contains("nothing is slower"));
        hidden += u32::from(!line(&after, &slowed).is_regression);
        // Beyond the limit of the line, from the same times.
        slow(&mut new, 1.01 * limit.expect("a limit") / estimate.expect("a ratio") / 3.0);
        let beyond = line(&compared(&old, &new), &slowed).clone();
        assert!(
            beyond.verdict == Verdict::Slower || beyond.ratio.is_some_and(|r| r.p * 7.0 <= 0.05 && r.floor > 1.0),
            "{beyond:?}"
        );
    }
    assert!(hidden > 10, "the noise hides it in {hidden} of 100 pairs: too few to test anything");
    let quiet = Noise { spread: 0.001, ..STEADY };
    let (old, new) = (run(&mut random, 6, 30, quiet), run(&mut random, 6, 30, quiet));
    assert!(compared(&old, &new).cannot_tell().is_none());
    assert!(comparison_table(&compared(&old, &new)).contains("nothing is slower by more than 5.0 %"));
    let few = run(&mut random, 3, 5, quiet);
    let said = compared(&few, &few).cannot_tell().expect("five repeats tell nothing");
    assert!(said.starts_with("cannot tell anything: pass 0 anything"), "{said}");
}

/// On a CPU the CPU time decides, and it is said: other load on the machine lengthens every pass, but not its CPU time.
#[test]
fn cpu_time_decides_on_software_devices() {
    let mut random = Random(81);
    let mut software = |slow: f64| {
        let mut profile = run(&mut random, 4, 30, Noise { spread: 0.3, ..STEADY });
        profile.device.is_software = true;
        for (n, pass) in profile.passes.iter_mut().enumerate() {
            let by = if n == 2 { slow } else { 1.0 };
            pass.cpu_ns = (0..30).map(|i| by * (1e6 + f64::from(i % 7))).collect();
        }
        profile
    };
    let (old, new) = (software(1.0), software(1.06));
    let comparison = compared(&old, &new);
    assert_eq!(comparison.regressions().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["pass 2"]);
    assert_eq!(line(&comparison, "wall").kind, Kind::Host);
    assert_eq!(line(&comparison, "CPU, all threads").kind, Kind::Cpu);
    assert!(comparison_table(&comparison).contains("compared: CPU time of each pass\n"));
    // A profile of an earlier version has none.
    let mut earlier = old.clone();
    earlier.passes.iter_mut().for_each(|pass| pass.cpu_ns.clear());
    let comparison = compared(&earlier, &new);
    assert!(comparison.notes.iter().any(|note| note.starts_with("the old profile has no CPU time of passes")));
    assert!(comparison_table(&comparison).contains("compared: time of each pass by the device's clock\n"));
    assert_eq!(line(&comparison, "wall").kind, Kind::Wall);
    // On a GPU the device's clock decides.
    let [mut old, mut new] = [old, new];
    [&mut old, &mut new].into_iter().for_each(|profile| profile.device.is_software = false);
    assert!(compared(&old, &new).regressions().next().is_none());
}

/// Blocks of two runs in turn, neighbours slowed by the same load, and one pass of the second by `factor`.
fn blocks(random: &mut Random, factor: f64) -> [Vec<Profile>; 2] {
    let count = blocks_in_turn(12, 0.05);
    assert!(count.is_multiple_of(2) && count >= 12, "{count}");
    let mut sides = [Vec::new(), Vec::new()];
    for _ in 0..count {
        let loads = [(); 3].map(|()| random.between(1.0, 2.0));
        for (side, by) in [(0, 1.0), (1, factor)] {
            let mut block = run(random, 12, 3, Noise { spread: 0.01, outliers: 0.02, ..STEADY });
            let lists = block.passes.iter_mut().map(|pass| &mut pass.samples_ns).chain([&mut block.wall_ns]);
            lists.for_each(|list| list.iter_mut().zip(loads).for_each(|(ns, load)| *ns *= load));
            block.passes[5].samples_ns.iter_mut().for_each(|ns| *ns *= by);
            sides[side].push(block);
        }
    }
    sides
}

#[test]
fn runs_in_turn_show_five_percent_under_a_load_that_doubles_times() {
    let mut random = Random(91);
    let options = CompareOptions { threshold: Threshold::new(1.02).expect("a ratio"), ..CompareOptions::default() };
    let mut told = |factor: f64| -> Vec<String> {
        let [old, new] = blocks(&mut random, factor);
        let comparison = in_turn(&old, &new, &options).expect("comparison");
        assert!(
            comparison.test.starts_with("Wilcoxon's signed ranks of 12 blocks of repeats in turn, Holm over 13 lines"),
            "{}",
            comparison.test
        );
        comparison.regressions().map(|line| line.name.clone()).collect()
    };
    let found = (0..100).filter(|_| told(1.05) == ["pass 5"]).count();
    let alarms = (0..100).filter(|_| !told(1.0).is_empty()).count();
    println!("found {found} of 100, false alarms {alarms} of 100");
    assert!(found >= 95 && alarms <= 5, "found {found} of 100, false alarms {alarms} of 100");
    let [old, mut new] = blocks(&mut random, 1.0);
    new[3].sizes.slices += 1;
    let error = in_turn(&old, &new, &options).expect_err("another size").to_string();
    assert_eq!(error, "new profile: its blocks ran different work");
}
