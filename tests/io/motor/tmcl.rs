//! TMCL on the wire: the manuals' examples, and bytes of any kind.

use echolume::low_level::probe::motor::tmcl::{LENGTH, Reply, Request, axis, checksum, status_words, version_text};
use proptest::prelude::*;

#[test]
fn requests_are_the_bytes_of_the_manuals() {
    let known: [(Request, [u8; LENGTH], &str); 9] = [
        (Request::rotate_right(1, 0, 350), [1, 1, 0, 0, 0, 0, 0x01, 0x5e, 0x61], "ROR 0, 350"),
        (Request::rotate_left(1, 0, 1200), [1, 2, 0, 0, 0, 0, 0x04, 0xb0, 0xb7], "ROL 0, 1200"),
        (Request::stop(1, 0), [1, 3, 0, 0, 0, 0, 0, 0, 4], "MST 0"),
        (Request::move_to(1, 0, 800), [1, 4, 0, 0, 0, 0, 0x03, 0x20, 0x28], "MVP 0, 0, 800"),
        // The others by the same rule: -1000 is ff ff fc 18.
        (Request::set_axis(1, 0, axis::MAX_SPEED, 1000), [1, 5, 4, 0, 0, 0, 0x03, 0xe8, 0xf5], "SAP 4, 0, 1000"),
        (Request::get_axis(1, 0, axis::POSITION), [1, 6, 1, 0, 0, 0, 0, 0, 8], "GAP 1, 0"),
        (Request::get_global(1, 66), [1, 0x0a, 0x42, 0, 0, 0, 0, 0, 0x4d], "GGP 66, 0"),
        (Request::search_start(1, 0), [1, 0x0d, 0, 0, 0, 0, 0, 0, 0x0e], "RFS 0, 0"),
        (Request::version(1), [1, 0x88, 1, 0, 0, 0, 0, 0, 0x8a], "the request for its version"),
    ];
    for (request, bytes, words) in known {
        assert_eq!(request.bytes(), bytes, "{words}");
        assert_eq!(Request::parse(&bytes), Some(request));
        assert_eq!(request.to_string(), words);
    }
}

#[test]
fn replies_are_read_out_of_the_bytes_of_the_manuals() {
    let to_move = Reply { host: 2, module: 1, status: 100, command: 4, value: 800 };
    assert_eq!(Reply::parse(&[2, 1, 0x64, 4, 0, 0, 3, 0x20, 0x8e]), Some(to_move));
    let address = Reply { host: 2, module: 1, status: 100, command: 10, value: 1 };
    assert_eq!(Reply::parse(&[2, 1, 0x64, 0x0a, 0, 0, 0, 1, 0x72]), Some(address));
    assert_eq!(Reply::parse(&[2, 1, 0x64, 4, 0, 0, 3, 0x20, 0x8f]), None);
    assert_eq!(version_text(b"\x021161V115"), Some((1161, "115".to_string())));
    assert_eq!(version_text(b"\x02\xff\xffgarble"), None);
    assert_eq!(version_text(b"\x02VVVVVVVV"), None);
    let mut words: Vec<_> = [100, 101, 1, 2, 3, 4, 5, 6].map(status_words).to_vec();
    words.sort();
    words.dedup();
    assert_eq!(words.len(), 8, "each status has words of its own");
}

#[test]
fn only_idempotent_requests_are_sent_twice() {
    let all = [
        Request::rotate_right(1, 0, 1),
        Request::rotate_left(1, 0, 1),
        Request::move_to(1, 0, 1),
        Request::search_start(1, 0),
        Request::set_axis(1, 0, 4, 1),
        Request::set_global(1, 68, 1),
        Request::stop(1, 0),
        Request::get_axis(1, 0, 1),
        Request::get_global(1, 68),
        Request::search_status(1, 0),
        Request::search_stop(1, 0),
        Request::version(1),
    ];
    assert_eq!(all.map(|r| r.repeatable()), [[false; 6].as_slice(), &[true; 6]].concat()[..]);
    assert!(all[..4].iter().all(Request::moves) && !all[4..].iter().any(Request::moves));
}

proptest! {
    #[test]
    fn any_nine_bytes_are_one_frame_or_none(bytes: [u8; LENGTH]) {
        let right = checksum(&bytes[..8]) == bytes[8];
        prop_assert_eq!(Request::parse(&bytes).map(|r| r.bytes()), right.then_some(bytes));
        prop_assert_eq!(Reply::parse(&bytes).map(|r| r.bytes()), right.then_some(bytes));
        let mut righted = bytes;
        righted[8] = checksum(&bytes[..8]);
        prop_assert_eq!(Reply::parse(&righted).map(|r| r.bytes()), Some(righted));
        version_text(&bytes);
        for byte in bytes {
            prop_assert!(!status_words(byte).is_empty());
        }
    }

    #[test]
    fn a_reply_is_found_behind_any_noise(noise: Vec<u8>, more: Vec<u8>, value: i32, status in 0..100_u8) {
        let request = Request::get_axis(7, 2, 1);
        let reply = Reply { host: 2, module: 7, status, command: 6, value };
        let found = Reply::find(&[noise.as_slice(), &reply.bytes(), &more].concat(), &request);
        // Noise that forms a valid reply is indistinguishable from one; it is too rare to occur here.
        prop_assert!(found.is_some_and(|f| f.module == 7 && f.command == 6));
        if Reply::find(&noise, &request).is_none() && noise.len() < 8 {
            prop_assert!(found.is_some());
        }
        prop_assert_eq!(Reply::find(&reply.bytes()[..8], &request), None);
    }
}
