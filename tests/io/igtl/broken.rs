//! Any bytes give a message, a number of missing bytes, or one line that names the fault.
//!
//! These properties are a small fuzzing harness: `total` is its target.

use super::messages::*;
use proptest::collection::vec;

#[test]
fn a_message_cut_off_anywhere_asks_for_what_is_missing() {
    for file in FILES {
        let bytes = stored(file);
        for cut in 0..bytes.len() {
            let missing = if cut < HEADER { HEADER - cut } else { bytes.len() - cut };
            assert_eq!(total(&bytes[..cut], BODY_LIMIT), Ok(Decoded::Need(missing)), "{file} cut at {cut}");
        }
    }
}

#[test]
fn every_turned_bit_of_a_body_or_checksum_is_noticed() {
    for file in FILES {
        let bytes = stored(file);
        for bit in 50 * 8..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            match total(&damaged, BODY_LIMIT) {
                Err(DecodeError::Checksum { length, .. }) => assert_eq!(length, bytes.len()),
                other => panic!("{file}: bit {bit} gives {other:?}"),
            }
        }
        for bit in 0..50 * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let _ = total(&damaged, BODY_LIMIT);
        }
    }
}

#[test]
fn an_absurd_claim_is_refused_from_its_header_alone() {
    for claim in [1u64 << 60, u64::MAX, BODY_LIMIT as u64 + 1] {
        let mut header = stored("Image_Motor_v1.bin")[..HEADER].to_vec();
        header[42..50].copy_from_slice(&claim.to_be_bytes());
        let Err(DecodeError::Framing { error }) = total(&header, BODY_LIMIT) else { panic!("{claim} is accepted") };
        assert_eq!(
            error.to_string(),
            format!("IMAGE from 'Image_Motor': body size: is {claim} bytes, must be at most 268435456")
        );
        // Nothing overflows without a limit of the caller.
        let _ = total(&header, usize::MAX);
    }
    let mut header = stored("Image_Motor_v1.bin")[..HEADER].to_vec();
    header[42..50].copy_from_slice(&(BODY_LIMIT as u64).to_be_bytes());
    assert_eq!(total(&header, BODY_LIMIT), Ok(Decoded::Need(BODY_LIMIT)));
}

#[test]
fn an_unknown_version_is_the_end_of_the_stream() {
    for version in [0, 4, 256, u16::MAX] {
        let refused = total(&raw(version, "STRING", b""), BODY_LIMIT).unwrap_err();
        let said = format!(
            "STRING from 'Device': version: is {version}, must be 1 to 3; the stream cannot be re-synchronised"
        );
        assert_eq!(refused.to_string(), said);
    }
}

#[test]
fn a_type_that_is_not_read_is_passed_over_by_its_length() {
    for (version, kind) in [(1, "VIDEO"), (2, "POLYDATA"), (3, "RTS_TDATA"), (1, "TRANSFORMATIO"), (1, "")] {
        let kind = &kind[..kind.len().min(12)];
        let body = [&[0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 9][..], &[7; 30]].concat();
        let other = Other { device: "Device".into(), time: 0.0, kind: kind.into(), bytes: 42 };
        assert_eq!(whole(&raw(version, kind, &body)), Message::Other(other));
    }
}

#[test]
fn bodies_that_cannot_be_true_are_refused_by_name() {
    let picture = stored("Image_Motor_v1.bin");
    let second = stored("Image_v2_v2.bin");
    let tools = stored("TDATA_ref_cpp_v1.bin");
    let text = stored("Str_v1.bin");
    let put = |message: &[u8], at: usize, bytes: &[u8]| {
        changed(message, |body| body[at..at + bytes.len()].copy_from_slice(bytes))
    };
    let faults = [
        (put(&picture, 1, &[2]), "image version: is 2, must be 1"),
        (put(&picture, 2, &[0]), "components: is 0, must be 1 to 255"),
        (put(&picture, 2, &[255]), "samples: are 24 bytes, must be 6120"),
        (put(&picture, 3, &[9]), "scalar type: is 9, must be 2 to 7, 10 or 11"),
        (put(&picture, 3, &[11]), "samples: are 24 bytes, must be 192"),
        (put(&picture, 4, &[0]), "byte order: is 0, must be 1 (big) or 2 (little)"),
        (put(&picture, 5, &[3]), "coordinates: is 3, must be 1 (RAS) or 2 (LPS)"),
        (put(&picture, 6, &[0, 0]), "size: is 0 x 3 x 2, each must be 1 to 65535"),
        (put(&picture, 12, &[0x7f, 0xc0, 0, 0]), "axes: is NaN, must be finite"),
        (put(&picture, 48, &[0xff, 0x80, 0, 0]), "position: is -inf, must be finite"),
        (put(&picture, 62, &[0, 1]), "sub-volume: covers 1 to 4 of 3 pixels along j, must lie within"),
        (put(&picture, 60, &[0xff; 12]), "sub-volume: covers 65535 to 131070 of 4 pixels along i, must lie within"),
        (put(&picture, 70, &[0, 0]), "sub-volume: covers 0 to 0 of 2 pixels along k, must lie within"),
        (put(&picture, 70, &[0, 1]), "samples: are 24 bytes, must be 12"),
        (changed(&picture, |b| b.truncate(71)), "sub-volume's size: is cut short: 1 of 2 bytes are there"),
        (changed(&picture, |b| b.truncate(0)), "image version: is cut short: 0 of 2 bytes are there"),
        (put(&second, 0, &[0, 11]), "extended header size: is 11 bytes, must be 12 to 146"),
        (put(&second, 0, &[0, 147]), "extended header size: is 147 bytes, must be 12 to 146"),
        (put(&second, 2, &[0, 115]), "metadata size: is 115 + 20 bytes with its header, must be at most 134"),
        (put(&second, 4, &[0xff; 4]), "metadata size: is 18 + 4294967295 bytes with its header, must be at most 134"),
        (changed(&second, |b| b.truncate(11)), "message ID: is cut short: 3 of 4 bytes are there"),
        (put(&tools, 20, &[5]), "tool's type: is 5, must be 1 to 4"),
        (put(&tools, 209 - 3, &[0x7f, 0x80, 0, 0]), "matrix: is inf, must be finite"),
        (changed(&tools, |b| b.truncate(209)), "tools: are 209 bytes, must be 70 each"),
        (put(&text, 2, &[0, 6]), "length: is 6 bytes, must be at most 5"),
        (raw(1, "TRANSFORM", &[0; 47]), "matrix: is cut short: 3 of 4 bytes are there"),
        (raw(1, "TRANSFORM", &[0; 49]), "content: is 49 bytes, must be 48"),
        (raw(1, "STATUS", &[0; 29]), "name: is cut short: 19 of 20 bytes are there"),
    ];
    for (bytes, fault) in faults {
        match total(&bytes, BODY_LIMIT) {
            Err(DecodeError::Content { length, error }) => {
                assert_eq!(length, bytes.len());
                assert!(error.to_string().ends_with(fault), "'{error}' does not say '{fault}'");
            }
            other => panic!("'{fault}' is not found: {other:?}"),
        }
    }
}

#[test]
fn a_peer_cannot_break_lines_or_control_the_terminal() {
    let mut bytes = raw(1, "TRANS\n\x1b[2J", &[0; 47]);
    bytes[14..20].copy_from_slice(b"\r\n\x1b[2J");
    bytes[1] = 9;
    let line = total(&bytes, BODY_LIMIT).unwrap_err().to_string();
    assert!(line.contains("version: is 9"), "{line}");
}

#[test]
fn texts_in_latin_1_are_read() {
    let text = |encoding, bytes: &[u8]| {
        let body = [&[0, encoding, 0, bytes.len() as u8], bytes].concat();
        let Message::Text(text) = whole(&raw(1, "STRING", &body)) else { panic!("no text") };
        text.text
    };
    assert_eq!(text(4, b"gr\xfcn"), "gr\u{fc}n");
    assert_eq!(text(106, "gr\u{fc}n".as_bytes()), "gr\u{fc}n");
    assert_eq!(text(3, b"gr\xfcn"), "gr\u{fffd}n");
}

/// A decoded message encodes to the same bytes, unless bytes that are not UTF-8 outgrew their field.
fn read_hostile(bytes: &[u8]) {
    let limit = 1 << 16;
    let Ok(Decoded::Message { message, .. }) = total(bytes, limit) else { return };
    let Ok(written) = encode(&message, Version::V2) else { return };
    assert_eq!(whole(&written), message);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in vec(any::<u8>(), 0..400), limit in any::<usize>()) {
        let _ = total(&bytes, limit);
        read_hostile(&bytes);
    }

    #[test]
    fn arbitrary_bodies_never_panic(
        version in 1u16..4,
        kind in proptest::sample::select(vec!["TRANSFORM", "TDATA", "IMAGE", "STATUS", "STRING", "POINT"]),
        start in vec(0u8..14, 0..24),
        body in vec(any::<u8>(), 0..300),
    ) {
        read_hostile(&raw(version, kind, &body));
        read_hostile(&raw(version, kind, &[&start[..], &body].concat()));
        let extended = [0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        read_hostile(&raw(version, kind, &[&extended[..], &start, &body].concat()));
    }

    #[test]
    fn damaged_messages_never_panic(
        which in 0usize..5,
        changes in vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in 0usize..40,
        checked in any::<bool>(),
    ) {
        let mut bytes = stored(FILES[which]);
        for (at, value) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        bytes.truncate(bytes.len() - cut.saturating_sub(20).min(bytes.len() - HEADER));
        read_hostile(&if checked { changed(&bytes, |_| {}) } else { bytes });
    }
}
