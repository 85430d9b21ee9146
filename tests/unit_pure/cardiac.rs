//! STIC against a beating phantom, whose radius has a formula.

use echolume::probe::Geometry;
use echolume::source::cardiac::{Cycle, CycleOptions, Motion, Rhythm};
use echolume::source::convert::Volume;
use echolume::source::phantom::{Body, HeartTruth, Phantom, PhantomOptions, Speckle, Truth};
use echolume::source::{Frame, StoredType};
use glam::DVec3;

/// A slow sweep of 64 lines of 128 samples a frame: 100 frames a second.
fn sweep(frames: usize, speckle: Speckle) -> (Phantom, HeartTruth) {
    let options = PhantomOptions {
        body: Body::Heart,
        speckle,
        frames,
        lines: 64,
        samples: 128,
        fan_angle_deg: 30.0,
        ..PhantomOptions::default()
    };
    let phantom = Phantom::new(options).expect("options");
    let Truth::Heart(truth) = phantom.truth() else { panic!("a heart") };
    (phantom, truth)
}

/// Frames a second, and what moves.
fn seen(phantom: &Phantom, frames: &[Frame]) -> (f64, Motion) {
    let probe = phantom.probe(0);
    let mut motion = Motion::new([probe.samples, probe.lines.len()], StoredType::U8);
    frames.iter().for_each(|frame| motion.take(frame));
    let span = frames[frames.len() - 1].time.expect("a time") - frames[0].time.expect("a time");
    ((frames.len() - 1) as f64 / span, motion)
}

/// The radius of the blood across the beam, mm: the mean of the first crossings of the grey between blood and muscle.
fn radius(geometry: &Geometry, frames: Vec<Frame>, truth: &HeartTruth) -> f64 {
    let mut volume = Volume::new(geometry.clone(), StoredType::U8);
    frames.into_iter().for_each(|frame| volume.take(frame));
    let level = 0.5 * (truth.blood + truth.muscle);
    let directions = 24;
    let sum: f64 = (0..directions)
        .map(|n| {
            let angle = std::f64::consts::TAU * f64::from(n) / f64::from(directions);
            let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let crossed = |mm: &f64| volume.at(truth.centre + along * *mm).is_some_and(|grey| grey > level);
            (0..400).map(|n| f64::from(n) * 0.05).find(crossed).expect("a wall")
        })
        .sum();
    sum / f64::from(directions)
}

#[test]
fn volumes_of_one_cycle_have_the_radius_of_their_phase() {
    let (phantom, truth) = sweep(1000, Speckle::None);
    let frames = phantom.volume(0);
    let (rate, motion) = seen(&phantom, &frames);
    let rhythm = Rhythm::find(&motion, rate, [90.0, 220.0]).expect("a rhythm");
    let probe = phantom.probe(0);
    let unsorted = radius(&Geometry::Sweep(probe.clone()), frames.clone(), &truth);
    let options = CycleOptions { phases: Some(16), slices: None };
    let cycle = Cycle::new(&probe, StoredType::U8, frames, rhythm, rate, options).expect("a cycle");
    assert!((cycle.seconds / truth.period - 1.0).abs() < 0.01, "{} s for {} s", cycle.seconds, truth.period);
    let geometry = Geometry::Sweep(cycle.probe.clone());
    // A frame is fired from its first line to its last; the ball lies in the middle ones.
    let half_frame = 0.5 / rate;
    let (mut worst, mut worst_unsorted) = (0.0f64, 0.0f64);
    for phase in 0..cycle.phases {
        let frames = cycle.volume(phase);
        let time = frames[0].time.expect("a time") + half_frame;
        let expected = truth.radius(time);
        worst = worst.max((radius(&geometry, frames, &truth) - expected).abs());
        worst_unsorted = worst_unsorted.max((unsorted - expected).abs());
    }
    assert!(worst < 0.4, "{worst:.2} mm of a stroke of {} mm", truth.radii[1] - truth.radii[0]);
    assert!(worst_unsorted > 1.5, "a sweep that is not sorted is as near: {worst_unsorted:.2} mm");
}

#[test]
fn the_rate_is_found_through_speckle_and_a_body_at_rest_has_none() {
    let (phantom, truth) = sweep(1000, Speckle::Random);
    let frames = phantom.volume(0);
    let (rate, motion) = seen(&phantom, &frames);
    let rhythm = Rhythm::find(&motion, rate, [90.0, 220.0]).expect("a rhythm");
    let found = 60.0 * rhythm.cycles() * rate / (frames.len() - 1) as f64;
    assert!((found * truth.period / 60.0 - 1.0).abs() < 0.02, "{found} a minute");
    let still = Phantom::new(PhantomOptions { body: Body::Constant, ..phantom.options().clone() }).expect("options");
    let (rate, motion) = seen(&still, &still.volume(0));
    let error = Rhythm::find(&motion, rate, [90.0, 220.0]).expect_err("no rhythm");
    assert!(error.contains("repeats"), "{error}");
}

/// The R waves of an ECG give the same cycle, and phase 0 is at the wave.
#[test]
fn r_waves_put_phase_zero_where_they_are() {
    let (phantom, truth) = sweep(1000, Speckle::None);
    let frames = phantom.volume(0);
    let (rate, _) = seen(&phantom, &frames);
    let times: Vec<f64> = frames.iter().map(|frame| frame.time.expect("a time")).collect();
    // Largest at whole periods: the waves come a quarter of a cycle later.
    let waves: Vec<f64> = (0..26).map(|n| (f64::from(n) + 0.25) * truth.period).collect();
    let rhythm = Rhythm::of_triggers(&times, &waves).expect("a rhythm");
    let options = CycleOptions { phases: Some(8), slices: Some(12) };
    let cycle = Cycle::new(&phantom.probe(0), StoredType::U8, frames, rhythm, rate, options).expect("a cycle");
    let at_wave = radius(&Geometry::Sweep(cycle.probe.clone()), cycle.volume(0), &truth);
    let expected = truth.radius(0.25 * truth.period + 0.5 / rate);
    assert!((at_wave - expected).abs() < 0.4, "{at_wave:.2} for {expected:.2} mm");
    assert_eq!(cycle.volume(3).len(), 12);
}

#[test]
fn what_makes_no_cycle_is_refused_in_one_line() {
    let (phantom, _) = sweep(200, Speckle::None);
    let frames = phantom.volume(0);
    let rhythm =
        |cycles: f64| Rhythm { phases: (0..200).map(|n| f64::from(n) / 199.0 * cycles).collect(), correlation: None };
    let made = |rhythm, options| Cycle::new(&phantom.probe(0), StoredType::U8, frames.clone(), rhythm, 200.0, options);
    let none = CycleOptions::default();
    for (rhythm, options, wanted) in [
        (rhythm(2.0), none, "2.0 cycles"),
        (rhythm(6.0), CycleOptions { phases: Some(1), ..none }, "--phases 1"),
        (rhythm(6.0), CycleOptions { slices: Some(5000), ..none }, "--slices 5000"),
    ] {
        let Err(error) = made(rhythm, options) else { panic!("{wanted}") };
        assert!(error.contains(wanted) && error.lines().count() == 1, "{error}");
    }
}
