//! Raw frames through a pipe: each keeps its slice, time and bytes however the data are split; and any bytes terminate. Needs no GPU.

use crate::common::files::{data, repository};
use crate::common::wait;
use echolume::low_level::probe::{Advance, Geometry};
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::piped::Piped;
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{Frame, StoredType};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SOON: Duration = Duration::from_secs(10);

fn probe() -> Value {
    json!({"array": {"kind": "curved", "radius_mm": 40}, "lines": {"sector_angle_deg": 70}, "depth": {"end_mm": 120},
           "motion": {"kind": "fan", "wobble_radius_mm": 25, "fan_angle_deg": 60}})
}

/// Three frames a volume of two lines of four samples.
fn keys() -> Value {
    json!({"echolume": 1, "samples": 4, "lines": 2, "frames": 3, "type": "u8", "probe": probe()})
}

/// The same with some keys changed; null takes one away.
fn changed(changes: Value) -> Value {
    let mut keys = keys();
    let there = keys.as_object_mut().unwrap();
    for (key, value) in changes.as_object().unwrap() {
        match value {
            Value::Null => drop(there.remove(key)),
            value => drop(there.insert(key.clone(), value.clone())),
        }
    }
    keys
}

fn stream(keys: &Value, frames: &[u8]) -> Vec<u8> {
    [format!("{keys}\n").as_bytes(), frames].concat()
}

fn piped(bytes: Vec<u8>) -> Piped {
    Piped::new(Cursor::new(bytes), None).unwrap()
}

/// All events but the end, and the reason of the end.
fn all(mut piped: Piped) -> (Vec<Event>, Option<String>) {
    let mut events = Vec::new();
    loop {
        match piped.next(SOON) {
            Event::End(why) => {
                assert!(matches!(piped.next(SOON), Event::End(again) if again == why), "the end is said again");
                return (events, why);
            }
            Event::Idle => panic!("nothing came in {SOON:?}"),
            event => events.push(event),
        }
    }
}

fn frames(events: &[Event]) -> Vec<Frame> {
    events.iter().filter_map(|e| if let Event::Frame(frame) = e { Some(frame.clone()) } else { None }).collect()
}

fn header(events: &[Event]) -> &Header {
    let Some(Event::Begin(header)) = events.first() else { panic!("{events:?}") };
    header
}

fn refused(keys: &Value) -> String {
    let (events, why) = all(piped(stream(keys, &[0; 100])));
    assert!(events.is_empty(), "{keys}: {events:?}");
    why.unwrap()
}

#[test]
fn frames_swept_both_ways_do_not_lose_their_place_or_a_byte() {
    let bytes: Vec<u8> = (0..8 * 9).collect();
    for ratio in [0.0, 0.5] {
        let keys = changed(json!({"both_ways": true, "speed_ratio": ratio}));
        let (events, why) = all(piped(stream(&keys, &bytes)));
        assert_eq!(why, None);
        let header = header(&events);
        assert_eq!((header.stored, header.range), (StoredType::U8, [0.0, 255.0]));
        let advance = |geometry: &Geometry| match geometry {
            Geometry::Sweep(probe) => probe.advance.clone(),
            Geometry::Cartesian(_) => panic!("a sweep"),
        };
        let pitch = 30f64.to_radians();
        match (advance(&header.forward), advance(&header.backward)) {
            (Advance::None, Advance::None) => assert_eq!(ratio, 0.0),
            (Advance::Same(a), Advance::Same(b)) => assert!((a - ratio * pitch).abs() < 1e-12 && a == -b),
            other => panic!("{other:?}"),
        }
        for (n, frame) in frames(&events).into_iter().enumerate() {
            let (volume, number) = (n / 3, n % 3);
            let backward = volume == 1;
            assert_eq!((frame.volume as usize, frame.number as usize, frame.backward), (volume, number, backward));
            assert_eq!((frame.slice, frame.time), (if backward { 2 - number } else { number }, None));
            assert_eq!(frame.bytes, bytes[8 * n..8 * n + 8]);
        }
        assert_eq!(events.len(), 10);
    }
}

#[test]
fn times_and_pieces_of_a_frame_are_not_mixed_up_with_its_samples() {
    let samples: Vec<u8> = (0..3 * 4 * 2).collect();
    let times = [12.5, f64::NAN];
    let keys = changed(json!({"lines": 3, "type": "u16", "stamped": true, "lines_at_once": 2}));
    let mut bytes = Vec::new();
    for time in times {
        bytes.extend(f64::to_le_bytes(time));
        bytes.extend(&samples);
    }
    let (events, why) = all(piped(stream(&keys, &bytes)));
    assert_eq!((why, header(&events).range, events.len()), (None, [0.0, 65535.0], 5));
    for (n, event) in events[1..].iter().enumerate() {
        let Event::Lines { frame, first } = event else { panic!("{event:?}") };
        let whole = [(0, &samples[..16]), (2, &samples[16..])][n % 2];
        assert_eq!((*first, &frame.bytes[..]), whole);
        assert_eq!((frame.number as usize, frame.time), (n / 2, (n < 2).then_some(12.5)));
    }
}

#[test]
fn samples_that_are_not_finite_do_not_get_through_and_are_counted() {
    let values = [f32::NAN, f32::INFINITY, 1e-40, -2.5, 0.0, 1.0, 2.0, 3.0];
    let bytes: Vec<u8> = [values, values].concat().iter().flat_map(|v| v.to_le_bytes()).collect();
    let keys = changed(json!({"type": "f32", "range": [-3, 3]}));
    let (events, why) = all(piped(stream(&keys, &bytes)));
    assert_eq!((why, header(&events).range), (None, [-3.0, 3.0]));
    let clean: Vec<u8> = [0.0, 0.0, 0.0, -2.5, 0.0, 1.0, 2.0, 3.0f32].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(frames(&events).into_iter().map(|f| f.bytes).collect::<Vec<_>>(), [clean.clone(), clean]);
    let faults: Vec<&String> =
        events.iter().filter_map(|e| if let Event::Fault(f) = e { Some(f) } else { None }).collect();
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(faults[0].contains("frame 0 of volume 0"), "{faults:?}");
    assert!(faults[1].contains("4 samples were not finite, 2 denormal"), "{faults:?}");
    assert!(refused(&changed(json!({"type": "f32"}))).contains("range"));
}

#[test]
fn a_cartesian_stream_needs_no_probe() {
    let lattice = json!({"size": [2, 2, 2], "spacing": [0.5, 0.5, 1], "origin": [-1, 0, 3]});
    let keys = json!({"echolume": 1, "type": "u8", "range": [0, 100], "cartesian": lattice});
    let (events, why) = all(piped(stream(&keys, &[7; 16])));
    let Geometry::Cartesian(grid) = header(&events).forward else { panic!("Cartesian") };
    assert_eq!((grid.size, grid.spacing, grid.origin), ([2; 3], [0.5, 0.5, 1.0], [-1.0, 0.0, 3.0]));
    assert_eq!((why, frames(&events).len(), frames(&events)[3].volume), (None, 4, 1));
    for (key, value, named) in
        [("samples", json!(3), "samples"), ("speed_ratio", json!(0.5), "speed_ratio"), ("probe", probe(), "cartesian")]
    {
        let mut wrong = keys.clone();
        wrong[key] = value;
        assert!(refused(&wrong).starts_with(&format!("pipe: {named}: ")), "{}", refused(&wrong));
    }
}

#[test]
fn the_probe_file_that_is_given_goes_before_the_stream() {
    let file = data("wobbler-4dc7/probe.toml");
    for keys in [keys(), changed(json!({"probe": null}))] {
        let (events, _) = all(Piped::new(Cursor::new(stream(&keys, &[])), Some(&file)).unwrap());
        let Geometry::Sweep(probe) = &header(&events).forward else { panic!("a sweep") };
        assert_eq!(probe.array_radius(), 39.8);
    }
    assert!(Piped::new(Cursor::new(Vec::new()), Some(Path::new("none.toml"))).is_err());
}

#[test]
fn wrong_first_lines_are_refused_by_name() {
    let huge = 1u64 << 60;
    let mut unknown = probe();
    unknown["array"]["radus_mm"] = json!(1);
    for (changes, named) in [
        (json!({"colour": true}), "unknown field `colour`"),
        (json!({"probe": unknown}), "unknown field `radus_mm`"),
        (json!({"cartesian": {"size": [1, 1, 1], "spacing": [1, 1, 1], "orgin": [0, 0, 0]}}), "unknown field `orgin`"),
        (json!({"echolume": 4}), "echolume: must be 1, 2 or 3"),
        (json!({"echolume": 3, "lines_at_once": 1}), "lines_at_once: is for versions 1 and 2"),
        (json!({"echolume": null}), "no stream of frames"),
        (json!({"samples": huge}), "samples: is 1152921504606846976, must be 1 to 65536"),
        (json!({"lines": 0}), "lines: is 0"),
        (json!({"frames": huge}), "frames: "),
        (json!({"samples": 65536, "lines": 65536}), "1073741824 bytes"),
        (json!({"samples": -1}), "header: "),
        (json!({"type": "i16"}), "unknown variant `i16`"),
        (json!({"range": [5, 5]}), "range"),
        (json!({"speed_ratio": 1.5}), "speed_ratio: is 1.5"),
        (json!({"lines_at_once": 0}), "lines_at_once"),
        (json!({"probe": null}), "probe: is missing"),
        (json!({"probe": {"array": 5}}), "probe: "),
        (json!({"lines": null}), "lines: is missing"),
    ] {
        let error = refused(&changed(changes.clone()));
        assert!(error.starts_with("pipe: ") && error.contains(named), "{changes}: {error}");
        assert_eq!(error.lines().count(), 1);
    }
    let mut still = keys();
    still["probe"]["motion"] = json!({"kind": "still"});
    assert!(refused(&still).contains("frames: is 3, but the probe has 1"));
    for (bytes, named) in [
        (vec![], "ends before its first line"),
        (b"{\"echolume\": 1".to_vec(), "ends before its first line"),
        (b"\n".to_vec(), "header: "),
        (b"\x89PNG\r\n\x1a\n".to_vec(), "header: "),
        (vec![b'['; 1 << 20], "is longer than 65536 bytes"),
        ([vec![b'['; 60_000], b"\n".to_vec()].concat(), "header: "),
    ] {
        let (events, why) = all(piped(bytes));
        assert!(events.is_empty() && why.as_ref().is_some_and(|w| w.contains(named)), "{why:?}");
    }
}

#[test]
fn a_stream_cut_within_a_frame_says_so_and_between_frames_does_not() {
    let keys = changed(json!({"stamped": true}));
    for cut in 0..=64 {
        let (events, why) = all(piped(stream(&keys, &[1; 64][..cut])));
        assert_eq!(frames(&events).len(), cut / 16);
        match cut % 16 {
            0 => assert_eq!(why, None),
            came => {
                let (number, volume) = (cut / 16 % 3, cut / 48);
                let expected = format!("cut short, {came} of 16 bytes of frame {number} of volume {volume} came");
                assert!(why.as_ref().is_some_and(|w| w.contains(&expected)), "{why:?}");
            }
        }
    }
}

/// A frame of version 3.
fn checked(number: u64, content: &[u8]) -> Vec<u8> {
    let body = [&number.to_le_bytes(), content].concat();
    let mut sum = flate2::Crc::new();
    sum.update(&body);
    [b"\x89ECHOFR\n", &body[..], &sum.sum().to_le_bytes()].concat()
}

fn faults(events: &[Event]) -> Vec<&String> {
    events.iter().filter_map(|e| if let Event::Fault(fault) = e { Some(fault) } else { None }).collect()
}

/// Four frames of version 3, with the samples that begin with 10, 20, 30 and 40.
fn four() -> (Value, [Vec<u8>; 4]) {
    let record = |n: u64| {
        let samples: Vec<u8> = (0..8).map(|k| 10 * (n as u8 + 1) + k).collect();
        checked(n, &[&(1e9 + n as f64).to_le_bytes()[..], &samples].concat())
    };
    (changed(json!({"echolume": 3, "stamped": true})), [0, 1, 2, 3].map(record))
}

/// Prevents that a lost or a repeated byte, or one that differs, costs more than the frame that it was in, or is not said.
#[test]
fn a_frame_with_a_checksum_is_found_again_after_damage() {
    let (keys, records) = four();
    let damages: [fn(&mut Vec<u8>, usize); 4] = [
        |bytes, at| _ = bytes.remove(at),
        |bytes, at| bytes.insert(at, bytes[at]),
        |bytes, at| bytes[at] ^= 1,
        |bytes, at| bytes.truncate(at),
    ];
    for (kind, damage) in damages.into_iter().enumerate() {
        for at in 0..records[1].len() {
            let mut damaged = records.clone();
            damage(&mut damaged[1], at);
            let (events, why) = all(piped(stream(&keys, &damaged.concat())));
            let came = frames(&events);
            let firsts: Vec<(u32, u32, u8)> = came.iter().map(|f| (f.volume, f.number, f.bytes[0])).collect();
            let whole = [(0, 0, 10), (0, 1, 20), (0, 2, 30), (1, 0, 40)];
            // A byte that is repeated at an end of the frame is outside of it. Nothing is missing from what is cut before its first byte.
            let is_whole = kind == 1 && firsts == whole;
            assert!(is_whole || firsts == [whole[0], whole[2], whole[3]], "{kind} at {at}: {firsts:?}");
            assert!(came.iter().all(|f| f.bytes.iter().enumerate().all(|(n, b)| *b == f.bytes[0] + n as u8)));
            assert_eq!(came[came.len() - 1].time, Some(1e9 + 3.0));
            let (faults, missing) = (faults(&events), if is_whole { 0 } else { 1 });
            assert_eq!((why, faults.len()), (None, 1), "{kind} at {at}: {faults:?}");
            assert!(faults[0].ends_with(&format!("{missing} frames are missing")), "{kind} at {at}: {faults:?}");
        }
    }
}

#[test]
fn frames_with_a_checksum_come_once_in_their_places_and_end_between_frames() {
    let (keys, [first, second, third, fourth]) = four();
    let all_of = |records: &[&Vec<u8>]| {
        all(piped(stream(&keys, &records.iter().copied().flatten().copied().collect::<Vec<_>>())))
    };
    let (events, why) = all_of(&[&first, &second, &first, &fourth]);
    let numbers: Vec<_> = frames(&events).iter().map(|f| (f.volume, f.number)).collect();
    assert_eq!((numbers, why), (vec![(0, 0), (0, 1), (1, 0)], None));
    let faults = faults(&events);
    assert!(faults.len() == 2 && faults[0].contains("frame 0, counted from 0, came again"), "{faults:?}");
    assert!(faults[1].ends_with("0 bytes are no frame and are left out; 1 frames are missing"), "{faults:?}");
    let whole = [&first[..], &second, &third].concat();
    for length in 0..=whole.len() {
        let (events, why) = all(piped(stream(&keys, &whole[..length])));
        assert_eq!(frames(&events).len(), length / first.len());
        let is_cut = why.is_some_and(|why| why.contains("cut short, "));
        assert_eq!(is_cut, length % first.len() > 0, "{length}");
    }
    // In a file, where each is at its place.
    let folder = crate::common::files::Folder::new("checked");
    let mut bytes = stream(&keys, &whole);
    let file = folder.write("a.stream", &bytes);
    let read = |file: &str| {
        let mut source = echolume::low_level::source::open(Path::new(file), None).expect("a stream");
        std::iter::from_fn(move || source.next_frame().map_err(|e| e.to_string()).transpose())
            .collect::<Result<Vec<_>, _>>()
    };
    let frames = read(&file).expect("frames");
    assert_eq!(
        frames.iter().map(|f| (f.bytes[0], f.time)).collect::<Vec<_>>(),
        [(10, Some(1e9)), (20, Some(1e9 + 1.0)), (30, Some(1e9 + 2.0))]
    );
    let at = bytes.len() - 1;
    bytes[at] ^= 1;
    let why = read(&folder.write("b.stream", &bytes)).expect_err("damaged");
    assert!(why.contains("frames: frame 2 (from 0) is damaged or missing"), "{why}");
}

/// Prevents frames that are shifted by a byte and recorded with stamps of 1e247 s: versions without checksums end there.
#[test]
fn a_lost_byte_shows_in_the_stamps_of_a_stream_without_checksums() {
    for version in [1, 2] {
        let keys = changed(json!({"echolume": version, "stamped": true}));
        let record = |n: u8| [&(1.8e9 + f64::from(n)).to_le_bytes()[..], &[n; 8]].concat();
        let mut bytes: Vec<u8> = (0..6).flat_map(record).collect();
        assert_eq!(all(piped(stream(&keys, &bytes))).1, None);
        bytes.remove(2 * 16 + 10);
        let (events, why) = all(piped(stream(&keys, &bytes)));
        assert_eq!(frames(&events).len(), 3, "the one that lacks a byte has that of the next");
        assert!(
            why.as_ref().is_some_and(|w| w.starts_with("pipe: time stamp: is ") && w.contains("version 3")),
            "{why:?}"
        );
    }
}

#[test]
fn patience_is_kept_and_dropping_does_not_hang() {
    let (reader, mut writer) = std::io::pipe().unwrap();
    let mut piped = Piped::new(reader, None).unwrap();
    assert!(piped.can_wait());
    let short = Duration::from_millis(50);
    let started = Instant::now();
    assert!(matches!(piped.next(short), Event::Idle));
    assert!((short..SOON).contains(&started.elapsed()), "{:?}", started.elapsed());
    writer.write_all(&stream(&keys(), &[1; 8])).unwrap();
    assert!(matches!(piped.next(SOON), Event::Begin(_)) && matches!(piped.next(SOON), Event::Frame(_)));
    assert!(matches!(piped.next(Duration::ZERO), Event::Idle));
    let started = Instant::now();
    drop(piped);
    assert!(started.elapsed() < SOON);
    // The other end notices it with one of the next two bytes.
    while writer.write_all(&[1; 8]).is_ok() {
        assert!(started.elapsed() < SOON);
        wait::poll();
    }
}

/// Counts what was read of an endless stream.
struct Endless(Cursor<Vec<u8>>, std::sync::Arc<std::sync::atomic::AtomicUsize>);

impl Read for Endless {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let came = self.0.read(buffer)?;
        let came = if came == 0 { buffer.len() } else { came };
        self.1.fetch_add(came, std::sync::atomic::Ordering::Relaxed);
        Ok(came)
    }
}

#[test]
fn unread_frames_do_not_accumulate() {
    for changes in [json!({"samples": 512, "lines": 256}), json!({"samples": 512, "lines": 256, "lines_at_once": 1})] {
        let came = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
        let start = Cursor::new(stream(&changed(changes), &[]));
        let piped = Piped::new(Endless(start, came.clone()), None).unwrap();
        let frame = 512 * 256;
        let so_far = || came.load(std::sync::atomic::Ordering::Relaxed);
        wait::until("four frames", || (so_far() >= 4 * frame).then_some(()));
        wait::watch(Duration::from_millis(100));
        assert!((4 * frame..6 * frame).contains(&so_far()), "{}", so_far());
        drop(piped);
    }
}

#[test]
fn the_example_program_is_understood() {
    let script = repository("tools/pipe_frames.py");
    let started = Command::new("python3").arg(script).args(["2000", "70"]).stdout(Stdio::piped()).spawn();
    let Ok(mut child) = started else {
        println!("python3 is missing: not run (tools/test installs it)");
        return;
    };
    let (events, why) = all(Piped::new(child.stdout.take().unwrap(), None).unwrap());
    let frames = frames(&events);
    assert_eq!((why, frames.len(), frames[69].volume, frames[31].slice), (None, 70, 2, 30));
    assert!(frames.windows(2).all(|w| w[0].time < w[1].time && w[0].bytes != w[1].bytes));
    assert!(child.wait().unwrap().success());
}

proptest! {
    #[test]
    fn any_bytes_come_to_an_end(
        head in prop_oneof![Just(keys().to_string()), ".{0,80}"],
        changes in prop::collection::vec((0usize..400, any::<u8>()), 0..4),
        body in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let mut bytes = [head.as_bytes(), b"\n", &body].concat();
        let length = bytes.len();
        for (at, value) in changes {
            bytes[at % length] = value;
        }
        let (events, why) = all(piped(bytes));
        prop_assert!(why.is_none_or(|w| w.starts_with("pipe: ") && w.lines().count() == 1));
        for event in events {
            prop_assert!(!matches!(event, Event::Frame(f) if f.bytes.is_empty()));
        }
    }
}
