//! Files of frames: every byte is read back, after an interrupted write and in a damaged file.

use crate::common::files::{Folder, SWEEP};
use crate::common::probes::wobbler;
use crate::common::program::run;
use echolume::low_level::probe::{Advance, Axis, Geometry, Grid, Probe};
use echolume::low_level::source::live::{Event, Live, Playback, PlaybackSource};
use echolume::low_level::source::recorder::{Header, Reader, Writer};
use echolume::low_level::source::{Frame, Source, StoredType, VolumeFrames};
use proptest::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

fn probe(advance: f64) -> Probe {
    Probe {
        lines: Axis::from_table((0..6).map(|n| 0.05 * n as f64 + 0.003 * (n as f64).sin()).collect()),
        sample_pitch: 0.4,
        samples: 16,
        slices: Axis::centred(0.02, 5),
        advance: Advance::Same(advance),
        ..wobbler()
    }
}

fn header() -> Header {
    Header {
        forward: Geometry::Sweep(probe(0.01)),
        backward: Geometry::Sweep(probe(-0.01)),
        stored: StoredType::U16,
        range: [3.0, 60_000.0],
        posed: false,
        synthetic: false,
    }
}

/// Three volumes, forward and backward; not every frame has a time stamp.
fn frames() -> Vec<(Frame, f64)> {
    let frame = |n: u32| {
        let (volume, number) = (n / 5 + 7, n % 5);
        let backward = volume % 2 == 1;
        let bytes =
            (0..16 * 6 * 2u32).map(|i| (i.wrapping_mul(2_654_435_761).wrapping_add(n * 977) >> 24) as u8).collect();
        let slice = if backward { 4 - number } else { number } as usize;
        let time = (!n.is_multiple_of(3)).then_some(0.01 * f64::from(n) + 1e9);
        (Frame { volume, number, slice, backward, time, pose: None, bytes }, 0.011 * f64::from(n))
    };
    (0..15).map(frame).collect()
}

fn written(path: &Path, finished: bool) {
    let mut writer = Writer::create(path, header()).expect("made");
    for (frame, arrived) in frames() {
        writer.frame(&frame, arrived).expect("written");
    }
    assert_eq!(writer.frames(), 15);
    if finished {
        writer.finish().expect("finished");
    }
}

fn all(replay: &mut Reader) -> Vec<(Frame, f64)> {
    let mut all = Vec::new();
    while let Some(frame) = replay.next_frame().expect("read") {
        all.push((frame, replay.arrived()));
    }
    all
}

#[test]
fn every_frame_comes_back_byte_for_byte_with_an_index_and_without() {
    let folder = Folder::new("back");
    for finished in [true, false] {
        let path = folder.join(format!("{finished}.frames"));
        written(&path, finished);
        let mut replay = Reader::open(&path).expect("opened");
        assert_eq!((replay.rebuilt(), replay.damaged(), replay.lost()), (!finished, 0, 0));
        assert_eq!(replay.header(), &header());
        assert_eq!((replay.volumes(), replay.frames_per_volume(), replay.frames()), (3, 5, 15));
        for volume in 0..3 {
            let expected = if volume % 2 == 0 { header().backward } else { header().forward };
            assert_eq!(replay.geometry(volume), expected, "volume {volume}, numbered from 7 in the file");
        }
        assert_eq!(all(&mut replay), frames());
        replay.skip_to_volume(1).expect("skipped");
        assert_eq!(all(&mut replay), frames()[5..]);
        assert!(replay.skip_to_volume(3).is_err_and(|fault| fault.to_string().contains("there is no 3")));
    }
}

/// A recording converted to a file of frames renders to the same picture, bit for bit.
#[test]
fn a_recording_and_its_frames_give_the_same_picture() {
    let folder = Folder::new("program");
    let [path, a, b] = ["sweep.frames", "a.png", "b.png"].map(|n| folder.path(n));
    assert_eq!(run(&["convert", SWEEP, &path]).0, Some(0));
    let (code, _, said) = run(&["convert", SWEEP, &path]);
    assert!(code == Some(1) && said.contains("sweep.frames") && said.trim().lines().count() == 1, "{said}");
    for (from, to) in [(SWEEP, &a), (path.as_str(), &b)] {
        let (code, _, said) = run(&["render", from, "--mode", "mip", "--size", "96x96", "-o", to]);
        assert_eq!(code, Some(0), "{said}");
    }
    assert!(std::fs::read(&a).expect("a picture") == std::fs::read(&b).expect("a picture"));
    std::fs::write(&path, b"ECHOFRMS then nothing").expect("written");
    let (code, _, said) = run(&["render", &path, "-o", &a]);
    assert!(code == Some(2) && said.trim().lines().count() == 1 && said.contains("version"), "{said}");
}

#[test]
fn wherever_the_writing_stops_every_whole_frame_is_there() {
    let folder = Folder::new("cut");
    let path = folder.join("whole.frames");
    written(&path, true);
    let whole = std::fs::read(&path).expect("read");
    let record = 40 + 16 * 6 * 2 + 4;
    let index = 8 + 12 * 15 + 16;
    let first = whole.len() - index - 15 * record;
    let cut = folder.join("cut.frames");
    for length in (0..whole.len()).step_by(7).chain([first, first + record - 1, first + record, whole.len() - 1]) {
        std::fs::write(&cut, &whole[..length]).expect("written");
        match Reader::open(&cut) {
            Ok(mut replay) => {
                let there = ((length - first) / record).min(15);
                assert_eq!(all(&mut replay), frames()[..there], "cut at {length}");
                assert!(replay.rebuilt() && replay.lost() < (record.max(index)) as u64);
            }
            Err(error) => {
                assert!(length < first, "cut at {length}: {error}");
                assert_eq!(error.to_string().lines().count(), 1);
            }
        }
    }
}

#[test]
fn a_damaged_frame_hides_no_other() {
    let folder = Folder::new("damaged");
    let path = folder.join("sweep.frames");
    for finished in [true, false] {
        let _ = std::fs::remove_file(&path);
        written(&path, finished);
        let mut bytes = std::fs::read(&path).expect("read");
        let record = 40 + 16 * 6 * 2 + 4;
        let first = bytes.len() - if finished { 8 + 12 * 15 + 16 } else { 0 } - 15 * record;
        bytes[first + 6 * record + 100] ^= 4;
        std::fs::write(&path, &bytes).expect("written");
        let mut replay = Reader::open(&path).expect("opened");
        let mut expected = frames();
        expected.remove(6);
        assert_eq!(all(&mut replay), expected);
        assert_eq!(replay.damaged(), 1);
        replay.skip_to_volume(0).expect("skipped");
        assert_eq!(all(&mut replay), expected);
        assert_eq!(replay.damaged(), 1, "of the second round");
    }
}

/// Of a volume without an intact frame nothing is shown: not the next one in its place.
#[test]
fn a_volume_whose_frames_are_all_damaged_is_refused() {
    let folder = Folder::new("all-damaged");
    let path = folder.join("sweep.frames");
    written(&path, true);
    let mut bytes = std::fs::read(&path).expect("read");
    let record = 40 + 16 * 6 * 2 + 4;
    let first = bytes.len() - (8 + 12 * 15 + 16) - 15 * record;
    (5..10).for_each(|n| bytes[first + n * record + 100] ^= 4);
    std::fs::write(&path, &bytes).expect("written");
    let mut reader = Reader::open(&path).expect("opened");
    for (volume, first) in [(0, Some(0)), (1, None), (2, Some(10))] {
        let mut of = VolumeFrames::of(&mut reader, volume).expect("there");
        let mut there = Vec::new();
        while let Some(frame) = of.read().expect("read") {
            there.push(frame);
        }
        let expected = frames().into_iter().map(|(frame, _)| frame).skip(first.unwrap_or(0)).take(5);
        assert_eq!(there, if first.is_some() { expected.collect() } else { Vec::new() }, "volume {volume}");
        assert_eq!(of.count().ok(), first.map(|_| 5));
    }
    let path = path.display().to_string();
    for command in [&["render", "-o", "out.png"][..], &["convert", "out.nrrd"]] {
        let output = folder.path(command[command.len() - 1]);
        let (code, _, said) =
            run(&[&[command[0], &path, "--volume", "1"][..], &command[1..command.len() - 1], &[&output]].concat());
        assert!(code == Some(2) && said.contains("volume 1: all of its frames are damaged"), "{said}");
    }
}

#[test]
fn foreign_frames_are_refused_and_nothing_is_overwritten() {
    let folder = Folder::new("refused");
    let path = folder.join("sweep.frames");
    let mut writer = Writer::create(&path, header()).expect("made");
    let (frame, _) = frames().remove(6);
    writer.frame(&frame, 0.0).expect("written");
    let short = Frame { bytes: vec![0; 5], ..frame.clone() };
    let astray = Frame { slice: 5, ..frame.clone() };
    let early = Frame { volume: 7, ..frame.clone() };
    for (wrong, field) in [(short, "frame"), (astray, "slice"), (early, "volume")] {
        assert_eq!(writer.frame(&wrong, 0.0).expect_err("refused").field(), field);
    }
    assert!(Writer::create(&path, header()).is_err_and(|e| e.field() == "file"), "it is there already");
    writer.finish().expect("finished");
    assert_eq!(Reader::open(&path).expect("opened").frames(), 1);
    let grid = |size| Geometry::Cartesian(Grid { size, spacing: [1.0; 3], origin: [0.0; 3] });
    for (header, field) in [
        (Header { range: [1.0, 1.0], ..header() }, "range"),
        (Header { range: [0.0, f64::NAN], ..header() }, "range"),
        (Header { backward: grid([16, 6, 5]), forward: grid([16, 5, 5]), ..header() }, "backward"),
        (Header { backward: grid([1 << 20, 1 << 20, 1]), forward: grid([1 << 20, 1 << 20, 1]), ..header() }, "forward"),
        (Header { forward: grid([16, 6, 1 << 60]), ..header() }, "slices"),
        (
            Header {
                forward: Geometry::Sweep(Probe { slices: Axis::centred(1e-30, 1 << 60), ..probe(0.0) }),
                ..header()
            },
            "slices",
        ),
        (Header { forward: Geometry::Sweep(Probe { sample_pitch: -1.0, ..probe(0.0) }), ..header() }, "sample_pitch"),
    ] {
        let path = folder.join("never.frames");
        let error = Writer::create(&path, header).err().expect("refused");
        assert!(error.field().contains(field) || field == "sample_pitch", "{error}");
        assert!(!path.exists());
    }
    if Path::new("/dev/full").exists() {
        // As on a full disk.
        assert!(Writer::create(Path::new("/dev/full"), header()).is_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_bytes_cause_a_panic(changes in prop::collection::vec((0usize..5000, any::<u8>()), 0..12), cut in 0usize..5000) {
        let folder = Folder::new(&format!("any-{:?}", std::thread::current().id()));
        let path = folder.join("any.frames");
        let _ = std::fs::remove_file(&path);
        written(&path, true);
        let mut bytes = std::fs::read(&path).expect("read");
        for (at, value) in changes {
            let n = at % bytes.len();
            bytes[n] = value;
        }
        bytes.truncate(bytes.len().saturating_sub(cut % 700));
        std::fs::write(&path, &bytes).expect("written");
        if let Ok(mut replay) = Reader::open(&path) {
            let originals = frames();
            for frame in all(&mut replay) {
                prop_assert!(originals.contains(&frame), "a frame that was never written");
            }
        }
    }
}

/// Prevents a loop of one cycle that skips its last phase: nothing states when the last volume ends.
#[test]
fn the_last_volume_lasts_as_long_as_the_one_before_it_when_a_recording_is_played_again() {
    let folder = Folder::new("again");
    let path = folder.join("loop.frames");
    let mut writer = Writer::create(&path, header()).expect("made");
    for volume in 0..3u32 {
        for slice in 0..5 {
            let mut frame = Frame::of_slice(volume, slice, vec![0; 16 * 6 * 2]);
            frame.time = Some(0.05 * f64::from(volume));
            writer.frame(&frame, 0.05 * f64::from(volume)).expect("written");
        }
    }
    writer.finish().expect("finished");
    let reader = Reader::open(&path).expect("a recording");
    let mut live = PlaybackSource::new(Box::new(reader), Playback::Recorded, 2);
    let (mut begun, mut volumes) = (None, Vec::new());
    loop {
        match live.next(Duration::from_secs(1)) {
            Event::Frame(frame) if frame.slice == 0 => {
                let begun = *begun.get_or_insert_with(Instant::now);
                volumes.push(begun.elapsed().as_secs_f64());
            }
            Event::End(fault) => break assert_eq!(fault, None),
            _ => {}
        }
    }
    assert_eq!(volumes.len(), 6);
    // Not before; a busy machine may be later.
    for (n, at) in volumes.into_iter().enumerate() {
        assert!(at > 0.05 * n as f64 - 0.01, "volume {n} after {at} s");
    }
}
