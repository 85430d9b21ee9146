//! Messages built by the tests.

use crate::common::files::data;
pub use echolume::low_level::source::igtl::*;
pub use proptest::prelude::*;
pub use std::time::{Duration, Instant};

pub const FILES: [&str; 5] =
    ["Image_Motor_v1.bin", "Image_v2_v2.bin", "ProbeToMotor_v1.bin", "Str_v1.bin", "TDATA_ref_cpp_v1.bin"];

pub fn stored(name: &str) -> Vec<u8> {
    std::fs::read(data("openigtlink").join(name)).unwrap()
}

/// A message of any type and body, with the right size and checksum.
pub fn raw(version: u16, kind: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = version.to_be_bytes().to_vec();
    bytes.extend(kind.bytes().chain(std::iter::repeat(0)).take(12));
    bytes.extend(b"Device\0\0\0\0\0\0\0\0\0\0\0\0\0\0");
    bytes.extend([0; 8]);
    bytes.extend((body.len() as u64).to_be_bytes());
    bytes.extend(crc64(body).to_be_bytes());
    bytes.extend(body);
    bytes
}

/// A query of a client: a kind and no body.
pub fn query(kind: &str, device: &str) -> Vec<u8> {
    let mut bytes = raw(1, kind, &[]);
    bytes[14..34].fill(0);
    bytes[14..14 + device.len()].copy_from_slice(device.as_bytes());
    bytes
}

/// The same message with a changed body and a correct checksum.
pub fn changed(message: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut body = message[HEADER..].to_vec();
    change(&mut body);
    let mut bytes = message[..HEADER].to_vec();
    bytes[42..50].copy_from_slice(&(body.len() as u64).to_be_bytes());
    bytes[50..58].copy_from_slice(&crc64(&body).to_be_bytes());
    bytes.extend(body);
    bytes
}

/// Decodes bytes that must be exactly one message.
pub fn whole(bytes: &[u8]) -> Message {
    match decode(bytes, BODY_LIMIT) {
        Ok(Decoded::Message { message, length }) if length == bytes.len() => message,
        other => panic!("{other:?}"),
    }
}

/// Any bytes must give a message, a number of missing bytes, or one line that fits on a screen.
pub fn total(bytes: &[u8], limit: usize) -> Result<Decoded, DecodeError> {
    let decoded = decode(bytes, limit);
    match &decoded {
        Ok(Decoded::Need(missing)) => assert!(*missing > 0),
        Ok(Decoded::Message { length, .. }) => assert!((HEADER..=bytes.len()).contains(length)),
        Err(refused) => {
            let line = refused.to_string();
            assert_eq!(line.lines().count(), 1, "{line}");
            assert!(line.len() < 2000 && !line.chars().any(char::is_control), "{line:?}");
            if let DecodeError::Checksum { length, .. } | DecodeError::Content { length, .. } = refused {
                assert!((HEADER..=bytes.len()).contains(length));
            }
        }
    }
    decoded
}

pub const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

pub fn transform(device: &str, time: f64, x: f32) -> Message {
    let mut matrix = IDENTITY;
    matrix[0][3] = x;
    Message::Transform(Transform { device: device.into(), time, matrix })
}

/// A volume of u8 whose samples count up.
pub fn image(time: f64, size: [u16; 3]) -> Image {
    Image {
        device: "Image".into(),
        time,
        size,
        region: Region { offset: [0; 3], size },
        scalar: Scalar::U8,
        components: 1,
        coordinates: Coordinates::Lps,
        axes: [[0.5, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1.0]],
        centre: [0.0; 3],
        bytes: (0..size.iter().map(|n| usize::from(*n)).product::<usize>()).map(|v| v as u8).collect(),
    }
}
