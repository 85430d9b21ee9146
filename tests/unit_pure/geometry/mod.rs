//! Known answers of the maps between indices and space, worked out by hand; bounds against all points that they must contain; and
//! refused geometries at their limits. Needs no GPU.

mod refused;

use echolume::low_level::probe::{Advance, Array, Axis, Indices, Motion, Probe};
use glam::DVec3;
use std::f64::consts::PI;

/// Lines at -30, 0 and 30 deg, samples at 32, 32.5 ... 34 mm from the apex, the wobble axis at a depth of 20 mm.
fn fan() -> Probe {
    Probe {
        array: Array::Curved { radius: 30.0 },
        lines: Axis::Even { first: -PI / 6.0, pitch: PI / 6.0, count: 3 },
        start_depth: 2.0,
        sample_pitch: 0.5,
        samples: 5,
        motion: Motion::Fan { wobble_radius: 10.0 },
        slices: Axis::Even { first: -PI / 6.0, pitch: PI / 12.0, count: 5 },
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

/// Lines at -3, 0 and 3 mm, slices at -2, 0, 2 and 4 mm.
fn linear() -> Probe {
    Probe {
        array: Array::Linear,
        lines: Axis::Even { first: -3.0, pitch: 3.0, count: 3 },
        motion: Motion::Translated,
        slices: Axis::Even { first: -2.0, pitch: 2.0, count: 4 },
        ..fan()
    }
}

fn still() -> Probe {
    Probe { motion: Motion::Still { thickness: 3.0 }, slices: Axis::centred(1.0, 1), ..fan() }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

fn is_at(place: DVec3, expected: [f64; 3]) -> bool {
    place.distance(DVec3::from(expected)) < 1e-9
}

fn at(sample: f64, line: f64, slice: f64) -> Indices {
    Indices { sample, line, slice }
}

#[test]
fn ranges_count_from_the_apex_of_a_curved_array_and_from_the_face_of_a_linear_one() {
    assert_eq!((fan().array_radius(), fan().first_range(), fan().last_range()), (30.0, 32.0, 34.0));
    assert_eq!((linear().array_radius(), linear().first_range(), linear().last_range()), (0.0, 2.0, 4.0));
    assert_eq!((fan().axis_depth(), linear().axis_depth(), still().axis_depth()), (20.0, 0.0, 0.0));
}

#[test]
fn samples_lie_where_trigonometry_puts_them() {
    let s = 3.0f64.sqrt();
    let (x, y) = fan().plane_point(4.0, 2.0);
    assert!(near(x, 17.0) && near(y, 17.0 * s), "{x}, {y}");
    let (x, y) = fan().plane_point(1.0, 0.0);
    assert!(near(x, -16.25) && near(y, 16.25 * s), "{x}, {y}");
    assert_eq!(linear().plane_point(3.0, 0.5), (-1.5, 3.5));
    // 14 mm beyond the axis, rotated by 30 deg about it.
    assert!(is_at(fan().to_space(at(4.0, 1.0, 4.0)), [0.0, 20.0 + 7.0 * s, 7.0]));
    assert!(is_at(fan().to_space(at(4.0, 1.0, 0.0)), [0.0, 20.0 + 7.0 * s, -7.0]));
    assert!(is_at(linear().to_space(at(3.0, 2.0, 3.0)), [3.0, 3.5, 4.0]));
    assert!(is_at(still().to_space(at(0.0, 1.0, 0.0)), [0.0, 32.0, 0.0]));
}

#[test]
fn unsweeping_a_point_inverts_the_sweep() {
    let s = 3.0f64.sqrt();
    let (x, y, position) = fan().inverse_sweep_map(DVec3::new(-4.0, 20.0 + 7.0 * s, 7.0));
    assert!(near(x, -4.0) && near(y, 34.0) && near(position, PI / 6.0), "{x}, {y}, {position}");
    assert_eq!(linear().inverse_sweep_map(DVec3::new(1.0, 2.0, 3.0)), (1.0, 2.0, 3.0));
    assert_eq!(still().inverse_sweep_map(DVec3::new(1.0, 2.0, 0.7)), (1.0, 2.0, 0.0));
}

/// Each kind of advance, on uniform and non-uniform slices.
fn ways(probe: &Probe) -> Vec<Probe> {
    let n = probe.slices.len();
    let pitch = probe.slices.pitch();
    let rough = |k: usize| probe.slices.at(k as f64) + 0.2 * pitch * (1.7 * k as f64).sin();
    let uneven = Probe { slices: Axis::from_table((0..n).map(rough).collect()), ..probe.clone() };
    let each = (0..n).map(|k| pitch * [0.4, -0.3, 0.5, 0.1, -0.2][k % 5]).collect();
    let mut all = Vec::new();
    for advance in [Advance::None, Advance::Same(0.6 * pitch), Advance::Same(-0.6 * pitch), Advance::Each(each)] {
        all.extend([probe, &uneven].map(|p| Probe { advance: advance.clone(), ..p.clone() }));
    }
    all
}

#[test]
fn indices_round_trip_through_space_for_every_array_motion_and_advance() {
    let two = Probe { slices: Axis::Even { first: -1.0, pitch: 2.0, count: 2 }, ..linear() };
    let seven = Probe { slices: Axis::Even { first: -4.0, pitch: 2.0, count: 7 }, ..linear() };
    let radial = Probe { lines: Axis::centred(3.1, 3), motion: Motion::Translated, ..fan() };
    for probe in [fan(), linear(), two, seven, radial].iter().flat_map(ways) {
        probe.check().expect("a probe");
        let slices = probe.slices.len() as f64 - 1.0;
        for n in 0..200 {
            let share = |step: f64| (f64::from(n) * step).fract();
            let there = at(4.0 * share(0.37), 2.0 * share(0.73), slices * share(0.59));
            let back = probe.to_indices(probe.to_space(there));
            let off =
                (back.sample - there.sample).abs() + (back.line - there.line).abs() + (back.slice - there.slice).abs();
            assert!(off < 1e-9, "{probe:?}: {there:?} came back as {back:?}");
        }
    }
    let back = still().to_indices(still().to_space(at(3.0, 0.5, 0.0)));
    assert!(near(back.sample, 3.0) && near(back.line, 0.5) && back.slice == 0.0, "{back:?}");
}

/// Each of three lines is acquired a third of the frame time after the previous one.
#[test]
fn the_motor_moves_while_a_frame_is_acquired() {
    let moving = |advance| Probe { advance, ..linear() };
    assert_eq!(moving(Advance::None).slice_position(2.0, 1.0), 0.0);
    assert!(near(moving(Advance::Same(0.9)).slice_position(2.0, 1.0), 0.6));
    assert!(near(moving(Advance::Same(0.9)).slice_index(0.6, 2.0), 1.0));
    assert!(near(moving(Advance::Same(0.9)).slice_index(1.3, 1.0), 1.5));
    let each = moving(Advance::Each(vec![0.3, 0.6, -0.6, 1.5]));
    let positions = [0.0, 1.0, 2.0, 3.0, 0.5, 2.5].map(|slice| each.slice_position(2.0, slice));
    for (position, expected) in positions.into_iter().zip([-1.8, 0.4, 1.6, 5.0, -0.7, 3.3]) {
        assert!(near(position, expected), "{positions:?}");
    }
    // Beyond both ends in a straight line, as the axis itself is.
    assert!(near(each.slice_position(2.0, -1.0), -4.0) && near(each.slice_position(2.0, 4.0), 8.4));
    for (position, slice) in [(-1.8, 0.0), (0.4, 1.0), (1.6, 2.0), (5.0, 3.0), (3.3, 2.5), (-4.0, -1.0), (8.4, 4.0)] {
        assert!(near(each.slice_index(position, 2.0), slice), "{position}: {}", each.slice_index(position, 2.0));
    }
    let two =
        Probe { slices: Axis::Even { first: 0.0, pitch: 2.0, count: 2 }, ..moving(Advance::Each(vec![0.3, 0.9])) };
    assert!(near(two.slice_position(1.0, 1.0), 2.3) && near(two.slice_position(1.0, 0.5), 1.2));
    let one = Probe { advance: Advance::Each(vec![0.6]), ..still() };
    assert!(near(one.slice_position(2.0, 0.0), 0.4) && one.slice_index(5.0, 2.0) == 0.0);
}

/// Lines or slices on both sides, on one side, and from the centre on.
fn turned(pitch: f64) -> [Axis; 5] {
    [-2.0, -6.0, 2.0, -4.0, 0.0].map(|first| Axis::Even { first: first * pitch, pitch, count: 5 })
}

#[test]
fn the_plane_s_rectangle_touches_the_sector_on_all_four_sides() {
    for lines in turned(0.2).into_iter().chain(turned(0.5)) {
        // Without a wobble axis, nothing of the sector is cut.
        let probe = Probe { lines, motion: Motion::Translated, ..fan() };
        let (low, high) = probe.plane_bounds();
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let upright = [-PI / 2.0, 0.0, PI / 2.0].map(|a| probe.lines.index_of(a).clamp(0.0, 4.0));
        let all: Vec<f64> = (0..=80).map(|l| f64::from(l) / 20.0).chain(upright).collect();
        for (sample, line) in (0..=4).flat_map(|s| all.iter().map(move |l| (f64::from(s), *l))) {
            let (x, y) = probe.plane_point(sample, line);
            least = [least[0].min(x), least[1].min(y)];
            most = [most[0].max(x), most[1].max(y)];
        }
        for axis in 0..2 {
            assert!(
                near(low[axis], least[axis]) && near(high[axis], most[axis]),
                "{:?}: {low:?}, {high:?}",
                probe.lines
            );
        }
    }
    assert_eq!(linear().plane_bounds(), ([-3.0, 2.0], [3.0, 4.0]));
}

#[test]
fn the_box_touches_all_that_the_rectangle_sweeps_over() {
    for (lines, slices) in turned(0.12).into_iter().zip(turned(0.15)) {
        let probe = Probe { lines, slices, ..fan() };
        probe.check().expect("a probe");
        let (low, high) = probe.bounds();
        let (plane_low, plane_high) = probe.plane_bounds();
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for slice in (0..=80).map(|k| f64::from(k) / 20.0) {
            for (x, y) in
                [plane_low[0], plane_high[0]].iter().flat_map(|x| [plane_low[1], plane_high[1]].map(|y| (*x, y)))
            {
                let place = probe.sweep_map(x, y, probe.slices.at(slice));
                (least, most) = (least.min(place), most.max(place));
            }
        }
        assert!(low.distance(least) < 1e-9 && high.distance(most) < 1e-9, "{:?}: {low}, {high}", probe.slices);
    }
    let (low, high) = linear().bounds();
    assert_eq!((low, high), (DVec3::new(-3.0, 2.0, -2.0), DVec3::new(3.0, 4.0, 4.0)));
    let (low, high) = still().bounds();
    assert!(near(low.z, -1.5) && near(high.z, 1.5) && near(high.y, 34.0) && near(low.x, -17.0), "{low}, {high}");
}

/// The last of three lines is acquired after two thirds of the advance.
#[test]
fn slice_bounds_hold_the_last_line_swept_either_way() {
    assert_eq!(linear().slice_bounds(), (-2.0, 4.0));
    for sign in [1.0, -1.0] {
        let (low, high) = Probe { advance: Advance::Same(0.9 * sign), ..linear() }.slice_bounds();
        assert!(near(low, -2.6) && near(high, 4.6), "{low}, {high}");
    }
    let (low, high) = Probe { advance: Advance::Each(vec![0.3, 0.0, 0.0, -0.6]), ..linear() }.slice_bounds();
    assert!(near(low, -2.2) && near(high, 4.4), "{low}, {high}");
}

#[test]
fn sound_takes_a_tenth_of_a_millisecond_to_77_mm_and_back() {
    let probe = Probe {
        lines: Axis::centred(0.01, 100),
        slices: Axis::centred(0.01, 10),
        start_depth: 7.0,
        samples: 141,
        ..fan()
    };
    assert!(near(probe.acquisition_time(), 0.1), "{}", probe.acquisition_time());
}

/// Endocavitary probes with a wide sector and an axis in front of its outer lines, and phased arrays whose lines meet at their face. Of
/// every sample beyond the axis, space has one point; of those before it, none is in the drawn rectangle.
#[test]
fn samples_beyond_the_axis_round_trip_through_space_where_the_sector_is_cut() {
    let mut state = 7u64;
    let mut random = |low: f64, high: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut cut, mut whole) = (0, 0);
    for n in 0..300 {
        let radius = if n % 3 == 0 { 0.0 } else { random(4.0, 40.0) };
        // Every fifth is radial, and may have its axis behind the apex.
        let is_radial = n % 5 == 3;
        let half = if is_radial { random(1.6, 3.1) } else { random(0.2, 1.55) };
        let wobble_radius = random(0.0, if is_radial { 2.0 } else { 1.0 }) * radius;
        let probe = Probe {
            array: Array::Curved { radius },
            lines: Axis::centred(2.0 * half / 40.0, 41),
            start_depth: if n % 2 == 0 { 0.0 } else { random(0.0, 8.0) },
            motion: Motion::Fan { wobble_radius: if n % 5 == 0 { 0.0 } else { wobble_radius } },
            slices: Axis::centred(random(0.02, 0.2), 11),
            samples: 80,
            sample_pitch: random(0.1, 1.0),
            advance: if n % 4 == 0 { Advance::Same(0.3 * 0.02) } else { Advance::None },
            ..fan()
        };
        probe.check().expect("a probe");
        let (low, high) = probe.plane_bounds();
        let mut folded = 0;
        for (line, sample) in (0..41).flat_map(|line| (0..80).map(move |sample| (f64::from(line), f64::from(sample)))) {
            let (x, y) = probe.plane_point(sample, line);
            if y < probe.axis_depth() - 1e-9 {
                folded += 1;
                assert!(y < low[1], "{probe:?}: a sample at {x}, {y} is cut and in {low:?}..{high:?}");
                continue;
            }
            let within = |v: f64, axis: usize| v >= low[axis] - 1e-9 && v <= high[axis] + 1e-9;
            assert!(within(x, 0) && within(y, 1), "{probe:?}: {x}, {y} is not in {low:?}..{high:?}");
            if y < probe.axis_depth() + 1e-3 || x.hypot(y) < 1e-3 {
                continue;
            }
            let there = at(sample, line, 10.0 * random(0.0, 1.0));
            let back = probe.to_indices(probe.to_space(there));
            let off =
                (back.sample - there.sample).abs() + (back.line - there.line).abs() + (back.slice - there.slice).abs();
            assert!(off < 1e-6, "{probe:?}: {there:?} came back as {back:?}");
        }
        let share = f64::from(folded) / (41.0 * 80.0);
        assert!((probe.folded_share() - share).abs() < 0.002, "{share} of {probe:?}: {}", probe.folded_share());
        assert_eq!(probe.folded().is_some(), probe.folded_share() > 0.0);
        *(if folded > 0 { &mut cut } else { &mut whole }) += 1;
    }
    assert!(cut > 50 && whole > 30, "{cut} cut, {whole} whole");
    // An endocavitary probe: 146 degrees about an axis 6 mm behind a face of 10.5 mm radius.
    let probe = Probe {
        array: Array::Curved { radius: 10.5 },
        lines: Axis::centred(146f64.to_radians() / 127.0, 128),
        start_depth: 0.0,
        motion: Motion::Fan { wobble_radius: 6.0 },
        ..fan()
    };
    probe.check().expect("a probe");
    assert!(probe.folded_share() > 0.0 && probe.folded_share() < 0.1, "{}", probe.folded_share());
}
