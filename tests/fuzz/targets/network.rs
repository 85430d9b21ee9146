//! Input from the network and from pipes.

use super::{Bytes, told};
use echolume::low_level::source::igtl::{
    Coordinates, DecodeError, Decoded, HEADER, Image, Message, Pairing, Region, Scalar, Tool, ToolKind, TrackingData,
    Transform, Version, crc64, decode, encode,
};
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::piped::Piped;
use std::io::Cursor;
use std::time::{Duration, Instant};

const LIMIT: usize = 1 << 20;

/// OpenIGTLink, unchanged and with the size and checksum that make the body valid.
pub fn messages(bytes: &[u8]) -> String {
    let mut right = bytes.to_vec();
    if let Some((head, body)) = right.split_at_mut_checked(HEADER) {
        head[42..50].copy_from_slice(&(body.len() as u64).to_be_bytes());
        head[50..].copy_from_slice(&crc64(body).to_be_bytes());
    }
    stream(bytes) + &stream(&right)
}

fn stream(mut bytes: &[u8]) -> String {
    let mut outcome = String::new();
    loop {
        let length = match decode(bytes, LIMIT) {
            Ok(Decoded::Need(missing)) => {
                assert!(missing > 0 && missing <= LIMIT + HEADER, "{missing} bytes are missing");
                return outcome + "more";
            }
            Ok(Decoded::Message { message, length }) => {
                outcome += message.kind();
                round_trip(&message);
                length
            }
            Err(DecodeError::Framing { error }) => return outcome + &told(error),
            Err(DecodeError::Checksum { length, error } | DecodeError::Content { length, error }) => {
                outcome += &told(error);
                length
            }
        };
        assert!((HEADER..=bytes.len()).contains(&length), "{length} of {}", bytes.len());
        bytes = &bytes[length..];
    }
}

fn round_trip(message: &Message) {
    for version in [Version::V1, Version::V2] {
        // A text beyond the format's length was longer before it was decoded.
        let Ok(bytes) = encode(message, version) else { continue };
        let again = decode(&bytes, 4 * LIMIT);
        assert_eq!(again, Ok(Decoded::Message { message: message.clone(), length: bytes.len() }));
    }
}

/// Poses and frames of any time in any order: each frame is paired or dropped once.
pub fn pairing(bytes: &[u8]) -> String {
    let mut bytes = Bytes(bytes);
    let name = |n: u8| ["Probe", "Reference", ""][usize::from(n % 3)].to_string();
    let device = Some(bytes.u8()).filter(|n| *n < 128).map(name);
    let mut pairing = Pairing::new(device, bytes.number(), bytes.number());
    let (mut frames, mut volumes, mut settled) = (0, 0, 0);
    while !bytes.is_empty() {
        let (kind, device, time) = (bytes.u8(), name(bytes.u8()), bytes.number());
        let matrix = std::array::from_fn(|_| std::array::from_fn(|_| bytes.number() as f32));
        let message = match kind % 4 {
            0 => Message::Transform(Transform { device, time, matrix }),
            1 => {
                let tools = vec![Tool { name: device.clone(), kind: ToolKind::SixD, matrix }];
                Message::TrackingData(TrackingData { device, time, tools })
            }
            _ => {
                let size = [2, 1, if kind < 250 { 1 } else { 2 }];
                *(if size[2] == 1 { &mut frames } else { &mut volumes }) += 1;
                Message::Image(Image {
                    device,
                    time,
                    size,
                    region: Region { offset: [0; 3], size },
                    scalar: Scalar::U8,
                    components: 1,
                    coordinates: Coordinates::Ras,
                    axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                    centre: [0.0; 3],
                    bytes: vec![0; if size[2] == 1 { 2 } else { 4 }],
                })
            }
        };
        settled += pairing.push(message).len() as u64;
    }
    settled += pairing.finish().len() as u64;
    let counts = pairing.counts();
    assert_eq!((counts.paired, counts.paired + counts.dropped, counts.volumes), (settled, frames, volumes));
    format!("{} {}", counts.paired > 0, counts.dropped > 0)
}

/// A stream of frames, until it ends.
pub fn piped(bytes: &[u8]) -> String {
    let mut piped = Piped::new(Cursor::new(bytes.to_vec()), None).expect("a thread");
    let (begun, mut slices, mut frames) = (Instant::now(), 0, 0);
    loop {
        match piped.next(Duration::from_secs(5)) {
            Event::Begin(header) => slices = header.forward.slices(),
            Event::Frame(frame) | Event::Lines { frame, .. } => {
                frames += 1;
                assert!(frame.slice < slices && !frame.bytes.is_empty());
            }
            Event::Fault(fault) => drop(told(fault)),
            Event::Idle => assert!(begun.elapsed() < Duration::from_secs(20), "no end comes"),
            Event::End(why) => return format!("{} {}", frames.min(3), why.map(told).unwrap_or_default()),
        }
    }
}
