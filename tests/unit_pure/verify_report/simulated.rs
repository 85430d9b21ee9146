//! Simulated runs with a known truth.

use super::profile;
use super::profile::{Noise, Random};
use echolume::low_level::baselines::Stored;
use echolume::low_level::picture::Picture;
use echolume::low_level::verify::report::{
    Fault, Figure, Level, Outcome, PictureComparison, Run, Unit, Verdict, Worst,
};
use proptest::prelude::*;

/// Passes that are timed and checked.
pub const PASSES: [&str; 8] =
    ["scan_convert", "median", "sigma", "raycast_volume", "raycast_surface", "shade", "shadow", "tone"];

/// Times of `repeats` as they scatter on an idle device.
pub const STEADY: Noise = Noise { spread: 0.03, memory: 0.3, drift: 0.01, own_drift: 0.0, walk: 0.0, outliers: 0.02 };

pub fn outcome(group: &str, name: &str, verdict: Verdict) -> Outcome {
    Outcome {
        group: group.into(),
        name: name.into(),
        verdict,
        seconds: 0.25,
        figures: Vec::new(),
        faults: Vec::new(),
        notes: Vec::new(),
        pictures: Vec::new(),
        failed_before: 0,
    }
}

/// A run without checks.
pub fn empty() -> Run {
    Run {
        format: Run::FORMAT.into(),
        program: "echolume 0.1.0, release".into(),
        date: "2026-01-02T03:04:05Z".into(),
        device: profile::profile(1).device,
        level: Level::Quick,
        validation: true,
        seconds: 48.2,
        outcomes: Vec::new(),
    }
}

/// A run without failures. The seed determines the times.
pub fn run(seed: u64) -> Run {
    let mut run = empty();
    let mut random = Random(seed);
    let timed = profile::run(&mut random, PASSES.len(), 30, STEADY);
    for (i, name) in PASSES.iter().enumerate() {
        let mut check = outcome("passes", name, Verdict::Passed);
        let share = [0.02, 0.4, 0.11, 0.37, 0.81, 0.0, 0.25, 0.003][i];
        check.figures.push(Figure::error("largest error", 2.0 * share, 2.0, Unit::Levels));
        check.figures.push(Figure::error("largest error of floats", 1e-4 * share, 1e-4, Unit::Value));
        run.outcomes.push(check);
    }
    for name in ["vr", "sr", "mip", "plane"] {
        let mut check = outcome("modes", name, Verdict::Passed);
        check.figures.push(Figure::error("largest difference", 1.0, 3.0, Unit::Levels));
        let texels = Figure { allowed: None, ..Figure::error("pixels that differ", 17.0, 0.0, Unit::Count) };
        check.figures.push(texels);
        run.outcomes.push(check);
    }
    let mut left_out = outcome("formats", "r16f storage", Verdict::LeftOut);
    left_out.notes.push("the device has no storage images of r16f".into());
    run.outcomes.push(left_out);
    for (name, pass) in PASSES.iter().zip(timed.passes) {
        let mut check = outcome("speed", name, Verdict::Passed);
        check.figures.push(Figure::times("device time", pass.samples_ns).expect("times"));
        run.outcomes.push(check);
    }
    run
}

pub fn check<'a>(run: &'a mut Run, group: &str, name: &str) -> &'a mut Outcome {
    run.outcomes.iter_mut().find(|o| o.group == group && o.name == name).expect("check")
}

/// A check that takes `factor` times as long.
pub fn slower(run: &mut Run, name: &str, factor: f64) {
    let figure = &mut check(run, "speed", name).figures[0];
    let samples = figure.samples.iter().map(|ns| factor * ns).collect();
    *figure = Figure::times("device time", samples).expect("times");
}

/// Makes a check of a pass fail, as with the worst driver faults.
pub fn fail(run: &mut Run, group: &str, name: &str) {
    let check = check(run, group, name);
    check.verdict = Verdict::Failed;
    let worst = Worst {
        output: "picture".into(),
        at: [12, 34, 0],
        channel: 2,
        expected: 0.5,
        got: f64::NAN,
        beyond: 17,
        texels: 4096,
    };
    check.faults.push(Fault {
        what: "the output differs by more than its tolerance".into(),
        pass: Some("raycast_volume".into()),
        input: "a sphere in 64 x 64 x 32, mode vr".into(),
        worst: Some(worst),
        files: vec!["fail/actual.png".into(), "fail/expected.png".into(), "fail/difference.png".into()],
    });
    check.pictures.push(shown("the picture", 48, Some(0)));
}

/// A lit sphere, one with a wrong corner, and ten times their difference.
pub fn shown(what: &str, size: u32, fault: Option<usize>) -> PictureComparison {
    let pixel = |x: u32, y: u32, wrong: bool| {
        let at = |v: u32| 2.2 * (f64::from(v) + 0.5) / f64::from(size) - 1.1;
        let (x, y) = (at(x), at(y));
        let depth = 1.0 - x * x - y * y;
        let light = if depth > 0.0 { (depth.sqrt() * 0.7 - x * 0.35 - y * 0.45).max(0.05) } else { 0.0 };
        let off = if wrong && x > 0.2 && y > 0.1 && depth > 0.0 { 0.03 + 0.06 * x } else { 0.0 };
        [1.0, 0.82, 0.66].map(|tint| ((light * tint + off).clamp(0.0, 1.0) * 255.0) as u8)
    };
    let picture = |of: &dyn Fn(u32, u32) -> [u8; 3]| {
        let pixels = (0..size * size).flat_map(|i| {
            let [r, g, b] = of(i % size, i / size);
            [r, g, b, 255]
        });
        Picture { width: size, height: size, rgba: pixels.collect() }
    };
    let difference = |x, y| {
        let (a, b) = (pixel(x, y, true), pixel(x, y, false));
        std::array::from_fn(|c| a[c].abs_diff(b[c]).saturating_mul(10))
    };
    PictureComparison {
        what: what.into(),
        actual: picture(&|x, y| pixel(x, y, fault.is_some())),
        expected: picture(&|x, y| pixel(x, y, false)),
        difference: picture(&|x, y| if fault.is_some() { difference(x, y) } else { [0; 3] }),
        gain: 10,
        fault,
    }
}

/// Text in names or messages that other programs might interpret as markup.
pub fn nasty() -> impl Strategy<Value = String> {
    let known = prop::sample::select(vec![
        "]]>",
        "<![CDATA[",
        "<b id=injected>x</b>",
        "</title><b id=injected>",
        "</style><b id=injected>",
        "\"><b id=injected>",
        "' onload='x",
        "&amp;&#0;&bogus;",
        "\0\u{1}\u{8}\u{1b}[2J",
        "a\r\nb\tc",
        "\u{fffe}\u{ffff}\u{85}\u{2028}\u{202e}",
        "<!-- -- -->",
        "ordinary",
    ]);
    prop_oneof![known.prop_map(String::from), any::<String>(), "\\PC{0,40}"]
}

/// Any consistent run without pictures.
pub fn any_run() -> impl Strategy<Value = Run> {
    let value = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), any::<f64>(), -2.0..2.0];
    let unit =
        prop::sample::select(vec![Unit::Value, Unit::Levels, Unit::Millimetres, Unit::Ns, Unit::Share, Unit::Count]);
    let samples = prop::collection::vec(0.0..1e9f64, 0..12);
    let figure = (nasty(), value.clone(), prop::option::of(-1.0..10.0f64), unit, samples).prop_map(
        |(what, value, allowed, unit, samples)| Figure { what, value, allowed, unit, samples, fleeting: false },
    );
    let worst = (nasty(), value.clone(), value, 0..9usize).prop_map(|(output, expected, got, beyond)| Worst {
        output,
        at: [beyond; 3],
        channel: 0,
        expected,
        got,
        beyond,
        texels: 9,
    });
    let files = prop::collection::vec(nasty(), 0..3);
    let fault = (nasty(), prop::option::of(nasty()), nasty(), prop::option::of(worst), files)
        .prop_map(|(what, pass, input, worst, files)| Fault { what, pass, input, worst, files });
    let verdict = prop::sample::select(Verdict::ALL.to_vec());
    let lists =
        (prop::collection::vec(figure, 0..4), prop::collection::vec(fault, 0..3), prop::collection::vec(nasty(), 0..3));
    let outcome = (nasty(), nasty(), verdict, 0.0..1e4f64, lists);
    let outcomes = prop::collection::vec(outcome, 0..8);
    (nasty(), nasty(), nasty(), any::<bool>(), outcomes).prop_map(|(program, date, device, validation, outcomes)| {
        let mut run = Run { program, date, validation, ..empty() };
        run.device.driver.clone_from(&device);
        run.device.name = device;
        for (i, (group, name, verdict, seconds, (mut figures, faults, notes))) in outcomes.into_iter().enumerate() {
            // Names must be unique.
            figures.iter_mut().enumerate().for_each(|(i, figure)| figure.what.push_str(&i.to_string()));
            let (group, name) = (format!("{group}g"), format!("{name}{i}"));
            run.outcomes.push(Outcome {
                group,
                name,
                verdict,
                seconds,
                figures,
                faults,
                notes,
                failed_before: 0,
                pictures: Vec::new(),
            });
        }
        run
    })
}
