//! Poses for 2D frames.

use super::messages::*;
use std::f64::consts::FRAC_PI_2;

const TOLERANCE: f64 = 0.05;

fn pairing(device: Option<&str>) -> Pairing {
    Pairing::new(device.map(Into::into), TOLERANCE, 0.5)
}

fn frame(time: f64) -> Message {
    Message::Image(image(time, [2, 3, 1]))
}

/// Rotated about z, moved by x mm.
fn turned(device: &str, time: f64, angle: f64, x: f32) -> Message {
    let (sine, cosine) = (angle.sin() as f32, angle.cos() as f32);
    let matrix = [[cosine, -sine, 0.0, x], [sine, cosine, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    Message::Transform(Transform { device: device.into(), time, matrix })
}

fn push_all(pairing: &mut Pairing, messages: Vec<Message>) -> Vec<PairedFrame> {
    messages.into_iter().flat_map(|m| pairing.push(m)).collect()
}

#[test]
fn a_pose_of_the_same_time_is_taken_unchanged_in_either_order() {
    for first in [true, false] {
        let mut messages = vec![transform("Probe", 10.0, 7.0), frame(10.0)];
        if !first {
            messages.reverse();
        }
        let paired = push_all(&mut pairing(None), messages);
        assert_eq!(paired.len(), 1);
        assert_eq!((paired[0].pose.translation.x, paired[0].lag, paired[0].interpolated), (7.0, 0.0, false));
        assert_eq!(paired[0].device, "Probe");
    }
}

#[test]
fn between_two_poses_both_parts_are_interpolated() {
    let mut pairing = pairing(Some("Probe"));
    let messages = vec![turned("Probe", 1.0, 0.0, 0.0), frame(1.01), turned("Probe", 1.04, FRAC_PI_2, 8.0)];
    let paired = push_all(&mut pairing, messages);
    let pose = paired[0].pose;
    assert!(paired[0].interpolated && (paired[0].lag - 0.01).abs() < 1e-9);
    assert!((pose.translation.x - 2.0).abs() < 1e-6, "{pose}");
    let x = pose.matrix3.x_axis;
    assert!((x.y.atan2(x.x) - FRAC_PI_2 / 4.0).abs() < 1e-6, "{pose}");
    assert!((pose.matrix3.determinant() - 1.0).abs() < 1e-9);
}

#[test]
fn rotations_are_interpolated_the_shorter_way() {
    let messages = vec![turned("P", 1.0, 3.0, 0.0), frame(1.02), turned("P", 1.04, -3.0, 0.0)];
    let paired = push_all(&mut pairing(None), messages);
    assert!(paired[0].pose.matrix3.x_axis.x < -0.999_999, "{}", paired[0].pose);
}

#[test]
fn a_frame_without_a_near_pose_is_dropped_and_counted() {
    let mut pairing = pairing(Some("Probe"));
    let messages = vec![
        transform("Probe", 1.0, 1.0),
        frame(1.1),
        transform("Other", 1.1, 2.0),
        transform("Probe", 1.2, 3.0),
        frame(1.24),
        transform("Probe", 1.31, 4.0),
    ];
    let paired = push_all(&mut pairing, messages);
    assert_eq!(paired.iter().map(|p| (p.image.time, p.pose.translation.x)).collect::<Vec<_>>(), [(1.24, 3.0)]);
    assert_eq!(pairing.counts(), PairingCounts { paired: 1, dropped: 1, volumes: 0 });
}

#[test]
fn a_frame_waits_for_a_pose_behind_it_as_long_as_frames_have_patience() {
    let mut pairing = pairing(None);
    assert!(pairing.push(transform("P", 1.0, 1.0)).is_empty());
    assert!(pairing.push(frame(1.01)).is_empty());
    assert!(pairing.push(frame(1.5)).is_empty());
    let paired = pairing.push(frame(1.52));
    assert_eq!(paired.len(), 1);
    assert_eq!((paired[0].image.time, paired[0].pose.translation.x), (1.01, 1.0));
    assert!(pairing.finish().is_empty());
    assert_eq!(pairing.counts(), PairingCounts { paired: 1, dropped: 2, volumes: 0 });
}

#[test]
fn poses_of_two_devices_are_not_mixed() {
    let messages = vec![transform("A", 1.0, 1.0), frame(1.03), transform("B", 1.04, 2.0)];
    let paired = push_all(&mut pairing(None), messages);
    assert_eq!((paired[0].device.as_str(), paired[0].pose.translation.x, paired[0].interpolated), ("B", 2.0, false));
}

#[test]
fn a_matrix_without_a_rotation_is_not_interpolated() {
    let scaled = Transform { device: "P".into(), time: 1.0, matrix: IDENTITY.map(|row| row.map(|v| v * 2.0)) };
    let messages = vec![Message::Transform(scaled), frame(1.01), transform("P", 1.04, 2.0)];
    let paired = push_all(&mut pairing(None), messages);
    assert_eq!((paired[0].interpolated, paired[0].pose.matrix3.x_axis.x), (false, 2.0));
}

#[test]
fn a_tool_of_a_tracker_is_a_pose_by_its_name() {
    let tool = |name: &str, x: f32| {
        let mut matrix = IDENTITY;
        matrix[0][3] = x;
        Tool { name: name.into(), kind: ToolKind::SixD, matrix }
    };
    let tools = vec![tool("Stylus", 1.0), tool("Probe", 2.0)];
    let tracked = Message::TrackingData(TrackingData { device: "Tracker".into(), time: 3.0, tools });
    let paired = push_all(&mut pairing(Some("Probe")), vec![tracked.clone(), frame(3.0)]);
    assert_eq!(paired[0].pose.translation.x, 2.0);
    let mut unnamed = pairing(None);
    assert!(push_all(&mut unnamed, vec![tracked, frame(3.0)]).is_empty());
}

#[test]
fn without_stamps_a_frame_gets_the_last_pose() {
    let messages = vec![transform("P", 0.0, 1.0), transform("P", 0.0, 2.0), frame(0.0), transform("P", 0.0, 3.0)];
    let paired = push_all(&mut pairing(None), messages);
    assert_eq!(paired.iter().map(|p| p.pose.translation.x).collect::<Vec<_>>(), [2.0]);
}

#[test]
fn volumes_are_passed_over_and_waiting_is_bounded() {
    let mut pairing = Pairing::new(None, TOLERANCE, f64::INFINITY);
    assert!(pairing.push(Message::Image(image(1.0, [2, 2, 2]))).is_empty());
    for n in 0..1000 {
        assert!(pairing.push(frame(f64::from(n))).is_empty());
    }
    assert_eq!(pairing.counts(), PairingCounts { paired: 0, dropped: 1000 - 64, volumes: 1 });
    pairing.finish();
    assert_eq!(pairing.counts().dropped, 1000);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_frame_is_paired_within_the_tolerance_or_counted(
        events in proptest::collection::vec((any::<bool>(), 0u32..400), 0..200),
    ) {
        let mut pairing = pairing(None);
        let mut frames = 0;
        let mut paired = Vec::new();
        for (is_frame, hundredths) in events {
            let time = f64::from(hundredths) / 100.0;
            frames += u64::from(is_frame);
            paired.extend(pairing.push(if is_frame { frame(time) } else { turned("P", time, time, 0.0) }));
        }
        paired.extend(pairing.finish());
        prop_assert!(paired.iter().all(|p| p.lag.abs() <= TOLERANCE));
        // The pose is a function of time, here an angle. Between two poses it is exact; next to one it is off by the time difference.
        for p in &paired {
            let x = p.pose.matrix3.x_axis;
            let angle = if p.interpolated { p.image.time } else { p.image.time - p.lag };
            prop_assert!((x.x - angle.cos()).abs() < 1e-6 && (x.y - angle.sin()).abs() < 1e-6, "{:?}", p);
        }
        let counts = pairing.counts();
        prop_assert_eq!(counts.paired, paired.len() as u64);
        prop_assert_eq!(counts.paired + counts.dropped, frames);
    }
}
