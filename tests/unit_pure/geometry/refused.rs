//! Geometries that are refused, and those just within the limits.

use super::{fan, linear, still};
use echolume::low_level::probe::{Advance, Array, Axis, Motion, Probe};
use std::f64::consts::{FRAC_PI_2, PI};

/// Refused with this field, in a message that contains all of these words.
fn refused(probe: &Probe, field: &str, words: &[&str]) {
    let error = probe.check().expect_err(field);
    assert_eq!(error.field, field, "{error}");
    assert!(words.iter().all(|w| error.fault.contains(w)), "{error}");
}

fn taken(probe: &Probe) {
    probe.check().unwrap_or_else(|e| panic!("{probe:?}: {e}"));
}

fn even(first: f64, pitch: f64, count: usize) -> Axis {
    Axis::Even { first, pitch, count }
}

#[test]
fn numbers_beyond_their_limits_are_refused_in_a_short_message() {
    [fan(), linear(), still()].iter().for_each(taken);
    let pitch = |sample_pitch| Probe { sample_pitch, ..fan() };
    refused(&pitch(0.0), "sample pitch", &["is 0, must lie in 1e-6..=1e6"]);
    refused(&pitch(1e-7), "sample pitch", &["is 1e-7,"]);
    refused(&pitch(-0.5), "sample pitch", &["is -0.5,"]);
    refused(&pitch(f64::NAN), "sample pitch", &["NaN"]);
    refused(&pitch(2e6), "sample pitch", &["is 2000000,"]);
    refused(&Probe { sound_speed: 1e300, ..fan() }, "sound speed", &["is 1e300,"]);
    refused(&Probe { sound_speed: 0.0, ..fan() }, "sound speed", &["is 0,"]);
    refused(&Probe { start_depth: -3.0, ..fan() }, "start depth", &["is -3, must lie in 0..=1e6"]);
    refused(&Probe { array: Array::Curved { radius: f64::INFINITY }, ..fan() }, "array radius", &["is inf,"]);
    refused(&Probe { motion: Motion::Fan { wobble_radius: -1.0 }, ..fan() }, "wobble radius", &["is -1,"]);
    refused(&Probe { motion: Motion::Still { thickness: 0.0 }, ..still() }, "slice thickness", &["is 0,"]);
    taken(&Probe { start_depth: 0.0, ..linear() });
    taken(&Probe { motion: Motion::Fan { wobble_radius: 0.0 }, slices: even(0.0, 0.1, 2), ..linear() });
}

#[test]
fn two_samples_and_two_lines_are_the_least() {
    refused(&Probe { samples: 1, ..fan() }, "samples", &["1 a line"]);
    refused(&Probe { samples: 0, ..fan() }, "samples", &["0 a line"]);
    taken(&Probe { samples: 2, ..fan() });
    refused(&Probe { lines: even(0.0, 0.1, 1), ..fan() }, "scan lines", &["1 a frame, at least 2"]);
    refused(&Probe { lines: even(0.0, 0.1, 0), ..fan() }, "scan lines", &["0 a frame, at least 2"]);
    taken(&Probe { lines: even(0.0, 0.1, 2), ..fan() });
}

#[test]
fn positions_rise_within_a_kilometre() {
    let lines = |lines| Probe { lines, ..linear() };
    taken(&lines(even(-1e6, 2e6, 2)));
    refused(&lines(even(0.0, 1.1e6, 2)), "scan lines", &["must be finite and rise from line to line"]);
    refused(&lines(even(-1.1e6, 1.2e6, 2)), "scan lines", &["finite"]);
    refused(&lines(even(0.0, -1.0, 3)), "scan lines", &["rise"]);
    refused(&lines(even(f64::NAN, 1.0, 3)), "scan lines", &["finite"]);
    let slices = |slices| Probe { slices, ..linear() };
    taken(&slices(even(-1e6, 2e6, 2)));
    refused(&slices(even(0.0, 1.1e6, 2)), "frames", &["must be finite and rise from slice to slice"]);
    refused(&slices(even(-1.1e6, 1.2e6, 2)), "frames", &["finite"]);
    refused(&slices(even(0.0, 0.0, 3)), "frames", &["rise"]);
    refused(&slices(even(0.0, 1.0, 0)), "frames", &["rise"]);
}

#[test]
fn a_sweep_has_two_frames_and_a_still_probe_one() {
    refused(&Probe { slices: even(0.0, 1.0, 1), ..fan() }, "frames", &["at least 2 frames a volume"]);
    refused(&Probe { slices: even(0.0, 1.0, 1), ..linear() }, "frames", &["at least 2 frames a volume"]);
    taken(&Probe { slices: even(0.0, 1.0, 2), ..linear() });
    refused(&Probe { slices: even(0.0, 1.0, 2), ..still() }, "frames", &["a still probe has one frame"]);
}

#[test]
fn a_sector_stays_under_half_a_turn_and_a_fan_in_front_of_the_probe() {
    let sector = |widest: f64| Probe { lines: even(0.0, widest, 2), motion: Motion::Translated, ..fan() };
    refused(&sector(PI), "sector angle", &["180.0 deg off axis"]);
    refused(&sector(3.2), "sector angle", &["183.3 deg"]);
    refused(&Probe { lines: even(-3.2, 3.2, 2), ..sector(1.0) }, "sector angle", &["183.3 deg"]);
    taken(&sector(3.13));
    // The lines of a linear array are positions: 3 mm are no angle. The same holds for the slices of a translated array.
    taken(&linear());
    // Beyond the wobble axis: the complete sector is in front of the apex.
    let wide = |first: f64, widest: f64| Probe {
        motion: Motion::Fan { wobble_radius: 30.5 },
        lines: even(-0.1, 0.1, 3),
        slices: even(first, widest - first, 2),
        ..fan()
    };
    refused(&wide(0.0, FRAC_PI_2), "fan angle", &["90.0 deg off axis"]);
    refused(&wide(-1.6, 0.0), "fan angle", &["91.7 deg"]);
    taken(&wide(0.0, 1.57));
    let moved = Probe { advance: Advance::Same(0.02), ..wide(0.0, 1.57) };
    refused(&moved, "fan angle", &["90.7 deg"]);
}

#[test]
fn what_lies_before_the_wobble_axis_is_cut_and_a_sector_of_which_nothing_is_beyond_it_is_refused() {
    // Its outermost lines begin at 32 cos 60 deg = 16 mm.
    let probe = |wobble_radius| Probe {
        lines: even(-FRAC_PI_2 / 1.5, FRAC_PI_2 / 1.5, 3),
        motion: Motion::Fan { wobble_radius },
        ..fan()
    };
    for (wobble_radius, is_cut) in [(10.0, true), (13.9, true), (14.1, false)] {
        let probe = probe(wobble_radius);
        taken(&probe);
        assert_eq!(probe.folded_share() > 0.0, is_cut, "{wobble_radius}");
        let said = probe.folded().unwrap_or_default();
        assert_eq!(said.contains("% of each frame is not drawn: it lies before the wobble axis"), is_cut, "{said}");
        let low = if is_cut { probe.axis_depth() } else { 16.0 };
        assert!((probe.plane_bounds().0[1] - low).abs() < 1e-9, "{:?}", probe.plane_bounds());
    }
    // All lines begin at the axis.
    let straight = Probe { lines: even(0.0, 0.1, 2), ..probe(0.0) };
    let at_axis = Probe { array: Array::Linear, start_depth: 0.0, lines: even(0.0, 1.0, 2), ..straight };
    taken(&at_axis);
    // A sector to one side that ends before the axis.
    let aside = Probe { lines: even(1.5, 0.01, 3), ..probe(0.0) };
    refused(&aside, "wobble radius", &["nothing of the sector"]);
}

#[test]
fn the_advance_of_the_motor_is_finite_and_one_per_slice() {
    let with = |advance| Probe { advance, ..linear() };
    refused(&with(Advance::Same(f64::NAN)), "motion", &["one finite advance a slice"]);
    refused(&with(Advance::Each(vec![0.1; 3])), "motion", &["one finite advance a slice"]);
    refused(&with(Advance::Each(vec![0.1; 5])), "motion", &["one finite advance a slice"]);
    refused(&with(Advance::Each(vec![0.1, f64::NAN, 0.1, 0.1])), "motion", &["one finite advance a slice"]);
    taken(&with(Advance::Same(-0.5)));
    taken(&with(Advance::Each(vec![0.1, -0.1, 0.1, 0.1])));
}

/// The last of two lines is acquired after half of the advance: slices 1 mm apart meet if each advances 1 mm towards the other.
#[test]
fn neighbouring_slices_do_not_cross() {
    let towards = |way: f64| Probe {
        lines: even(0.0, 1.0, 2),
        slices: even(0.0, 1.0, 2),
        advance: Advance::Each(vec![way, -way]),
        ..linear()
    };
    refused(&towards(1.0), "motion", &["neighbouring slices cross"]);
    refused(&towards(1.5), "motion", &["neighbouring slices cross"]);
    taken(&towards(0.99));
    taken(&towards(-3.0));
    // Any two neighbours, not only the first.
    let last = Probe { slices: even(0.0, 1.0, 3), advance: Advance::Each(vec![0.0, 1.0, -1.0]), ..towards(0.0) };
    refused(&last, "motion", &["neighbouring slices cross"]);
}
