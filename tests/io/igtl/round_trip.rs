//! Encoded messages decode to the same values.

use super::messages::*;
use proptest::collection::vec;
use proptest::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};

fn number() -> impl Strategy<Value = f32> {
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

fn matrix() -> impl Strategy<Value = [[f32; 4]; 3]> {
    proptest::array::uniform3(proptest::array::uniform4(number()))
}

/// Times that both a time stamp and an f64 hold exactly.
fn time() -> impl Strategy<Value = f64> {
    (any::<u32>(), 0u32..1 << 20).prop_map(|(s, f)| f64::from(s) + f64::from(f) / f64::from(1 << 20))
}

fn picture() -> impl Strategy<Value = Message> {
    let scalars =
        [Scalar::I8, Scalar::U8, Scalar::I16, Scalar::U16, Scalar::I32, Scalar::U32, Scalar::F32, Scalar::F64];
    let boxes = proptest::array::uniform3((0u16..4, 1u16..5, 0u16..3));
    let place = (proptest::array::uniform3(proptest::array::uniform3(number())), proptest::array::uniform3(number()));
    (name(), time(), boxes, proptest::sample::select(scalars.to_vec()), 1u8..4, any::<bool>(), place, any::<u8>())
        .prop_map(|(device, time, boxes, scalar, components, ras, (axes, centre), first)| {
            let region = Region { offset: boxes.map(|b| b.0), size: boxes.map(|b| b.1) };
            let pixels: usize = region.size.iter().map(|n| usize::from(*n)).product();
            let length = pixels * usize::from(components) * scalar.bytes();
            Message::Image(Image {
                device,
                time,
                size: boxes.map(|b| b.0 + b.1 + b.2),
                region,
                scalar,
                components,
                coordinates: if ras { Coordinates::Ras } else { Coordinates::Lps },
                axes,
                centre,
                bytes: (0..length).map(|v| (v as u8).wrapping_mul(31).wrapping_add(first)).collect(),
            })
        })
}

fn name() -> impl Strategy<Value = String> {
    "[ -~]{0,20}"
}

fn message() -> impl Strategy<Value = Message> {
    let kinds = [ToolKind::Tracker, ToolKind::SixD, ToolKind::ThreeD, ToolKind::FiveD];
    let tool = (name(), proptest::sample::select(kinds.to_vec()), matrix()).prop_map(|(name, kind, matrix)| Tool {
        name,
        kind,
        matrix,
    });
    prop_oneof![
        (name(), time(), matrix()).prop_map(|(device, time, matrix)| Message::Transform(Transform {
            device,
            time,
            matrix
        })),
        (name(), time(), vec(tool, 0..5)).prop_map(|(device, time, tools)| Message::TrackingData(TrackingData {
            device,
            time,
            tools
        })),
        picture(),
        (name(), time(), any::<u16>(), any::<i64>(), name(), "\\PC{0,60}").prop_map(
            |(device, time, code, subcode, name, text)| {
                Message::Status(Status { device, time, code, subcode, name, text })
            }
        ),
        (name(), time(), "\\PC{0,60}").prop_map(|(device, time, text)| Message::Text(Text { device, time, text })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_message_round_trips(message in message(), second in any::<bool>(), more in vec(any::<u8>(), 0..70)) {
        let bytes = encode(&message, if second { Version::V2 } else { Version::V1 }).unwrap();
        prop_assert_eq!(&whole(&bytes), &message);
        // The bytes after it belong to the next message.
        let expected = Ok(Decoded::Message { message, length: bytes.len() });
        prop_assert_eq!(decode(&[&bytes[..], &more].concat(), BODY_LIMIT), expected);
        for cut in 0..bytes.len() {
            let missing = if cut < HEADER { HEADER - cut } else { bytes.len() - cut };
            prop_assert_eq!(decode(&bytes[..cut], BODY_LIMIT), Ok(Decoded::Need(missing)));
        }
    }
}

#[test]
fn big_endian_samples_of_every_width_are_turned() {
    for (number, width) in [(2u8, 1), (3, 1), (4, 2), (5, 2), (6, 4), (7, 4), (10, 4), (11, 8)] {
        let samples: Vec<u8> = (0..24 * width as u8).collect();
        let big = changed(&stored("Image_Motor_v1.bin"), |body| {
            body[3] = number;
            body[4] = 1;
            body.truncate(72);
            body.extend(&samples);
        });
        let little = changed(&big, |body| body[4] = 2);
        let (Message::Image(big), Message::Image(little)) = (whole(&big), whole(&little)) else { panic!("no image") };
        assert_eq!(little.bytes, samples);
        assert_eq!(big.bytes, samples.chunks(width).flat_map(|c| c.iter().rev().copied()).collect::<Vec<_>>());
        assert_eq!(big.scalar.bytes(), width);
    }
}

#[test]
fn the_two_coordinate_systems_are_half_a_turn_apart() {
    let image = Image { centre: [10.0, 20.0, 30.0], ..image(0.0, [3, 5, 1]) };
    let at = |c| image.index_to_mm(c).transform_point3(glam::DVec3::new(1.0, 2.0, 0.0)).to_array();
    assert_eq!(at(Coordinates::Lps), [10.0, 20.0, 30.0]);
    assert_eq!(at(Coordinates::Ras), [-10.0, -20.0, 30.0]);
    let step = image.index_to_mm(Coordinates::Ras).x_axis.to_array();
    assert_eq!(step, [-0.5, 0.0, 0.0, 0.0]);
}

#[test]
fn values_beyond_the_format_are_refused() {
    let error = |message| encode(&message, Version::V1).unwrap_err().to_string();
    for (time, said) in [(-1.0, "-1 s"), (f64::NAN, "NaN s"), (4_294_967_296.0, "4294967296 s")] {
        assert!(error(transform("a", time, 0.0)).contains(&format!("time stamp: is {said}")));
    }
    assert!(
        error(transform("one name that is too long", 0.0, 0.0)).contains("device: is 25 bytes, must be at most 20")
    );
    assert!(error(transform("a\0b", 0.0, 0.0)).contains("device: has a zero at byte 1"));
    assert!(error(transform("a", 0.0, f32::NAN)).contains("matrix: has NaN, must be finite"));
    let short = Image { bytes: vec![0; 5], ..image(0.0, [2, 3, 1]) };
    assert!(error(Message::Image(short)).contains("samples: are 5 bytes, must be 6"));
    let long = Text { device: "a".into(), time: 0.0, text: "x".repeat(65536) };
    assert!(error(Message::Text(long)).contains("text: is 65536 bytes, must be at most 65535"));
    let other = Other { device: "a".into(), time: 0.0, kind: "VIDEO".into(), bytes: 0 };
    assert!(error(Message::Other(other)).starts_with("VIDEO from 'a': type"));
}
