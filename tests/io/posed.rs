//! Frames with poses: through a pipe, in `.frames` files, and as freehand volumes of both.

use crate::common::files::{Folder, repository};
use crate::common::wait;
use echolume::low_level::live::Feed;
use echolume::low_level::probe::{Geometry, Grid, World};
use echolume::low_level::source::freehand::{CompoundingOptions, FreehandArguments};
use echolume::low_level::source::live::{Event, Live, Playback, PlaybackSource};
use echolume::low_level::source::piped::Piped;
use echolume::low_level::source::posed::Posed;
use echolume::low_level::source::recorder::{Header, Reader, Writer};
use echolume::low_level::source::{Frame, InputError, OpenOptions, Source, StoredType, description, open, open_with};
use glam::{DAffine3, DQuat, DVec3};
use serde_json::json;
use std::io::Cursor;
use std::process::Command;
use std::time::Duration;

const SIZE: [usize; 2] = [9, 7];
const SPACING: [f64; 2] = [0.5, 0.4];
const ORIGIN: [f64; 3] = [-2.0, 3.0, 0.0];
const PICTURES: usize = 8;

/// A place in the tracker's space as a value.
fn value(place: DVec3) -> f64 {
    3.0 * place.x - 2.0 * place.y + 1.5 * place.z + 400.0
}

/// The probe moves along its normal.
fn pose(n: usize) -> DAffine3 {
    let turn = DQuat::from_rotation_z(0.3) * DQuat::from_rotation_x(-0.5);
    let moved = DAffine3::from_translation(DVec3::Z * 0.5 * n as f64);
    DAffine3::from_rotation_translation(turn, DVec3::new(100.0, 50.0, -30.0)) * moved
}

fn rows(pose: &DAffine3) -> Vec<u8> {
    let row = |n: usize| [pose.matrix3.row(n).to_array().to_vec(), vec![pose.translation[n]]].concat();
    [0, 1, 2].map(row).concat().iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn samples(n: usize) -> Vec<u8> {
    let place = |k: usize| {
        let (column, row) = ((k % SIZE[0]) as f64, (k / SIZE[0]) as f64);
        DVec3::from(ORIGIN) + DVec3::new(column * SPACING[0], row * SPACING[1], 0.0)
    };
    (0..SIZE[0] * SIZE[1]).flat_map(|k| (value(pose(n).transform_point3(place(k))) as f32).to_le_bytes()).collect()
}

/// The stream of all pictures; those of `without` have no pose, and that of `skewed` is none.
fn stream(version: u32, without: &[usize], skewed: &[usize]) -> Vec<u8> {
    let [x, y] = SIZE;
    let cartesian = json!({"size": [x, y, 1], "spacing": [SPACING[0], SPACING[1], 1.0], "origin": ORIGIN});
    let keys = json!({"echolume": version, "type": "f32", "range": [0, 900], "stamped": true, "posed": true, "cartesian": cartesian});
    let mut bytes = format!("{keys}\n").into_bytes();
    for n in 0..PICTURES {
        bytes.extend((1e9 + n as f64).to_le_bytes());
        let mut matrix = rows(&pose(n));
        if without.contains(&n) {
            matrix = f64::NAN.to_le_bytes().repeat(12);
        }
        if skewed.contains(&n) {
            matrix[..8].copy_from_slice(&7.5f64.to_le_bytes());
        }
        bytes.extend(matrix);
        bytes.extend(samples(n));
    }
    bytes
}

fn all(mut next: impl FnMut() -> Option<Event>) -> (Vec<Event>, Option<String>) {
    let mut events = Vec::new();
    loop {
        match next().expect("an event in time") {
            Event::End(why) => return (events, why),
            event => events.push(event),
        }
    }
}

fn frames(events: &[Event]) -> Vec<&Frame> {
    events.iter().filter_map(|e| if let Event::Frame(frame) = e { Some(frame) } else { None }).collect()
}

fn faults(events: &[Event]) -> Vec<&str> {
    events.iter().filter_map(|e| if let Event::Fault(fault) = e { Some(fault.as_str()) } else { None }).collect()
}

/// Every voxel that is filled has the value of its place. Returns how many are.
fn hold_the_field<'a>(grid: &Grid, world: &World, slices: impl Iterator<Item = (usize, &'a [u8])>) -> usize {
    let (mut filled, mut off) = (0u32, 0.0);
    for (slice, bytes) in slices {
        for (n, bytes) in bytes.as_chunks::<4>().0.iter().enumerate() {
            let stored = f64::from(f32::from_le_bytes(*bytes));
            if stored != 0.0 {
                let cell = [n % grid.size[0], n / grid.size[0], slice].map(|n| n as f64);
                let meant = value(world.at(DVec3::from_array(cell)));
                // A pixel at the border goes to voxels as far as a voxel's diagonal, 0.9 mm, of a slope of 3.9 a mm. Within, that cancels.
                assert!((stored - meant).abs() < 3.5, "{cell:?}: {stored}, {meant}");
                off += (stored - meant).abs();
                filled += 1;
            }
        }
    }
    assert!(off / f64::from(filled) < 0.7, "{off} of {filled}");
    filled as usize
}

#[test]
fn poses_of_a_pipe_are_those_of_its_frames() {
    let mut piped = Piped::new(Cursor::new(stream(2, &[3], &[5, 6])), None).expect("a thread");
    let (events, why) = all(|| Some(piped.next(Duration::from_secs(10))));
    assert_eq!(why, None);
    for (n, frame) in frames(&events).into_iter().enumerate() {
        let expected = (![3, 5, 6].contains(&n)).then(|| pose(n));
        assert_eq!((frame.time, frame.pose, &frame.bytes), (Some(1e9 + n as f64), expected, &samples(n)), "{n}");
    }
    let [fault] = faults(&events)[..] else { panic!("{events:?}") };
    assert!(fault.contains("frame 0 of volume 5") && fault.contains("rigid"), "{fault}");
    // An old stream has no poses, and says so if it claims them.
    let mut old = Piped::new(Cursor::new(stream(1, &[], &[])), None).expect("a thread");
    let (events, why) = all(|| Some(old.next(Duration::from_secs(10))));
    assert!(events.is_empty() && why.as_deref().is_some_and(|why| why.contains("posed: needs version 2")), "{why:?}");
    // Cut within a pose.
    let whole = stream(2, &[], &[]);
    let header = whole.iter().position(|b| *b == b'\n').expect("a line") + 1;
    let mut cut = Piped::new(Cursor::new(whole[..header + 20].to_vec()), None).expect("a thread");
    let (_, why) = all(|| Some(cut.next(Duration::from_secs(10))));
    assert!(why.as_deref().is_some_and(|why| why.contains("20 of 356 bytes")), "{why:?}");
}

/// Live from a pipe, from the stream kept in a file, and from the recording of the stream: the same volume in the same place.
#[test]
fn pictures_with_poses_become_a_volume_in_the_tracker_s_space() {
    let folder = Folder::new("posed");
    let tape = folder.join("tape.frames");
    let piped = Piped::new(Cursor::new(stream(2, &[3], &[])), None).expect("a thread");
    let feed = Feed::new(Box::new(piped), Some(&tape)).expect("a thread");
    let (events, why) = all(|| feed.next(Duration::from_secs(20)).map(|arrived| arrived.event));
    drop(feed);
    assert_eq!((why, faults(&events)), (None, vec!["1 pictures without a valid pose are left out"]));
    let Some(Event::Begin(header)) = events.iter().find(|e| matches!(e, Event::Begin(_))) else { panic!("{events:?}") };
    let Geometry::Cartesian(grid) = header.forward else { panic!("a lattice") };
    let slices = frames(&events);
    assert_eq!((slices.len(), header.range, header.posed), (grid.size[2], [0.0, 900.0], true));
    let world = World::posed(&slices[0].pose.expect("a pose"), &grid).expect("rigid");
    let filled = hold_the_field(&grid, &world, slices.iter().map(|frame| (frame.slice, &frame.bytes[..])));
    assert!(filled >= SIZE[0] * SIZE[1] * (PICTURES - 1), "{filled}");
    // The recording holds the pictures and their poses, bit for bit.
    let mut reader = Reader::open(&tape).expect("a recording");
    let mut kept = Vec::new();
    while let Some(frame) = reader.next_frame().expect("a frame") {
        kept.push((frame.pose, frame.bytes));
    }
    let sent = (0..PICTURES).map(|n| ((n != 3).then(|| pose(n)), samples(n)));
    assert_eq!(kept, sent.collect::<Vec<_>>());
    let stored = folder.write("stream", stream(2, &[3], &[]));
    for file in [tape.as_path(), stored.as_ref()] {
        let mut source = open(file, None).expect("a volume");
        let Geometry::Cartesian(grid) = source.geometry(0) else { panic!("a lattice") };
        let world = source.world().expect("a place");
        let mut slices = Vec::new();
        while let Some(frame) = source.next_frame().expect("a slice") {
            slices.push((frame.slice, frame.bytes));
        }
        let there = hold_the_field(&grid, &world, slices.iter().map(|(slice, bytes)| (*slice, &bytes[..])));
        assert!(there >= SIZE[0] * SIZE[1] * (PICTURES - 1) && source.volumes() == 1, "{}: {there}", file.display());
    }
}

fn header(posed: bool) -> Header {
    let geometry = Geometry::Cartesian(Grid { size: [4, 3, 2], spacing: [1.0; 3], origin: [0.0, 5.0, 0.0] });
    Header {
        forward: geometry.clone(),
        backward: geometry,
        stored: StoredType::U8,
        range: [0.0, 255.0],
        posed,
        synthetic: false,
    }
}

/// A file without poses has the bytes that it had before there were any, and a damaged frame hides none of those with poses.
#[test]
fn files_of_frames_keep_poses_and_without_them_are_as_before() {
    let folder = Folder::new("poses");
    for posed in [false, true] {
        let path = folder.join(format!("{posed}.frames"));
        let frame = |n: u32| Frame {
            volume: n / 2,
            number: n % 2,
            slice: n as usize % 2,
            backward: false,
            time: None,
            pose: (posed && n != 2).then(|| pose(n as usize)),
            bytes: vec![n as u8; 12],
        };
        let mut writer = Writer::create(&path, header(posed)).expect("created");
        (0..6).for_each(|n| writer.frame(&frame(n), f64::from(n)).expect("written"));
        writer.finish().expect("finished");
        let mut bytes = std::fs::read(&path).expect("read");
        let text = String::from_utf8_lossy(&bytes[16..]).into_owned();
        assert_eq!(text.contains("posed"), posed, "the header");
        let first = bytes.windows(4).position(|w| w == b"FRAM").expect("a frame");
        let second = first + 4 + bytes[first + 4..].windows(4).position(|w| w == b"FRAM").expect("a frame");
        assert_eq!(second - first, 40 + if posed { 96 } else { 0 } + 12 + 4);
        let mut reader = Reader::open(&path).expect("opened");
        let world = Source::world(&reader);
        assert_eq!(world.is_some(), posed, "that of the first frame");
        let read: Vec<Frame> = std::iter::from_fn(|| reader.next_frame().expect("a frame")).collect();
        assert_eq!(read, (0..6).map(frame).collect::<Vec<_>>());
        // Without an index, and with a damaged frame.
        bytes.truncate(bytes.len() - 10);
        bytes[second + 45] ^= 1;
        std::fs::write(&path, bytes).expect("written");
        let mut reader = Reader::open(&path).expect("opened");
        assert_eq!((reader.rebuilt(), reader.damaged()), (true, 1));
        let read: Vec<Frame> = std::iter::from_fn(|| reader.next_frame().expect("a frame")).collect();
        assert_eq!(read, [0, 2, 3, 4, 5].map(frame));
    }
}

/// A volume that was moved while it was recorded lies where each of its own frames says, also if its first frame has no pose.
#[test]
fn every_volume_of_a_recording_lies_where_its_own_frames_say() {
    let folder = Folder::new("moved");
    let Geometry::Cartesian(grid) = header(true).forward else { panic!("a lattice") };
    // Volumes of two frames: a pose each, the second frame only, none, a pose each.
    let posed = |n: usize| [0, 1, 3, 6, 7].contains(&n);
    let places = [Some(0), Some(3), None, Some(6)];
    let tape = folder.join("moved.frames");
    let mut writer = Writer::create(&tape, header(true)).expect("created");
    let keys = json!({"echolume": 2, "type": "u8", "posed": true, "cartesian": {"size": grid.size, "spacing": grid.spacing, "origin": grid.origin}});
    let mut stream = format!("{keys}\n").into_bytes();
    for n in 0..8 {
        let own = posed(n).then(|| pose(n));
        let frame = Frame { pose: own, ..Frame::of_slice(n as u32 / 2, n % 2, vec![n as u8; 12]) };
        writer.frame(&frame, n as f64).expect("written");
        stream.extend(own.map_or(f64::NAN.to_le_bytes().repeat(12), |pose| rows(&pose)));
        stream.extend([n as u8; 12]);
    }
    writer.finish().expect("finished");
    let stored = folder.path("moved");
    std::fs::write(&stored, stream).expect("written");
    for file in [tape.to_str().expect("a plain name"), &stored] {
        let source = open(file.as_ref(), None).expect("volumes");
        assert_eq!(source.world(), World::posed(&pose(0), &grid), "{file}");
        for (volume, first) in places.into_iter().enumerate() {
            // Without a place of its own, that of the recording.
            let meant = World::posed(&pose(first.unwrap_or(0)), &grid).expect("rigid");
            assert_eq!(source.world_of(volume), Some(meant), "{file}: volume {volume}");
            let back = folder.path(&format!("{volume}.nrrd"));
            let (code, _, said) =
                crate::common::program::run(&["convert", file, &back, "--volume", &volume.to_string()]);
            assert_eq!(code, Some(0), "{said}");
            let read = open(back.as_ref(), None).expect("a volume").world().expect("a place");
            for cell in [DVec3::ZERO, DVec3::new(3.0, 2.0, 1.0)] {
                assert!(read.at(cell).distance(meant.at(cell)) < 1e-6, "{file}: volume {volume}");
            }
        }
        // A frame without a pose stays one.
        let copy = folder.path("copy.frames");
        let _ = std::fs::remove_file(&copy);
        let (code, _, said) = crate::common::program::run(&["convert", file, &copy]);
        assert_eq!(code, Some(0), "{said}");
        let mut copied = Reader::open(copy.as_ref()).expect("a recording");
        let poses: Vec<_> = std::iter::from_fn(|| copied.next_frame().expect("a frame")).map(|f| f.pose).collect();
        assert_eq!(poses, (0..8).map(|n| posed(n).then(|| pose(n))).collect::<Vec<_>>(), "{file}");
    }
}

/// Pictures in time of one place are no sweep: they come back from `.frames` as they were, in their place.
#[test]
fn an_oriented_series_of_pictures_stays_one_through_frames() {
    let folder = Folder::new("series");
    let header = "NRRD0005\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\nsizes: 4 3 1 5\n\
                  space directions: (0.3,0.4,0) (-0.2,0.15,0) (0,0,0.5) none\nkinds: domain domain domain time\n\
                  endian: little\nencoding: raw\nspace origin: (10,-20,30)\n\n";
    let samples: Vec<u8> = (0..60).map(|n| n * 4).collect();
    let stored = folder.write("series.nrrd", [header.as_bytes(), &samples].concat());
    let all = |file: &str| {
        let mut source = open(file.as_ref(), None).expect("pictures");
        let Geometry::Cartesian(grid) = source.geometry(0) else { panic!("a lattice") };
        let (volumes, world) = (source.volumes(), source.world_of(4).expect("a place"));
        let frames: Vec<_> = std::iter::from_fn(|| source.next_frame().expect("a picture")).collect();
        (volumes, grid, world, frames.into_iter().map(|f| (f.volume, f.slice, f.bytes)).collect::<Vec<_>>())
    };
    let (volumes, grid, world, pictures) = all(&stored);
    assert_eq!((volumes, grid.size, pictures.len()), (5, [4, 3, 1], 5));
    assert!(world != World::of(&grid), "it is turned");
    let tape = folder.path("series.frames");
    let (code, _, said) = crate::common::program::run(&["convert", &stored, &tape]);
    assert_eq!(code, Some(0), "{said}");
    let (read, same, place, again) = all(&tape);
    assert_eq!((read, same, again), (volumes, grid, pictures));
    for cell in [DVec3::ZERO, DVec3::new(3.0, 2.0, 0.0)] {
        assert!(place.at(cell).distance(world.at(cell)) < 1e-6, "{cell}");
    }
}

/// What a live stream says of pictures that it leaves out: all of them counted, on few lines, also if no volume is ever emitted.
#[test]
fn pictures_that_are_left_out_are_counted_on_few_lines() {
    let [x, y] = SIZE;
    let grid = Grid { size: [x, y, 1], spacing: [SPACING[0], SPACING[1], 1.0], origin: ORIGIN };
    let (forward, backward) = (Geometry::Cartesian(grid), Geometry::Cartesian(grid));
    let header =
        Header { forward, backward, stored: StoredType::F32, range: [0.0, 900.0], posed: true, synthetic: false };
    let begun = || {
        let mut stream = Posed::new(CompoundingOptions::default());
        assert!(stream.take(Event::Begin(Box::new(header.clone()))).is_empty());
        stream
    };
    let frame = |n: usize, pose, bytes| Frame { pose, ..Frame::of_slice(n as u32, 0, bytes) };
    // No picture has a pose: said while the stream goes on, and once.
    let mut stream = begun();
    let take =
        |stream: &mut Posed, event: Event| -> Vec<Event> { (0..50).flat_map(|_| stream.take(event.clone())).collect() };
    assert!(take(&mut stream, Event::Frame(frame(0, None, samples(0)))).is_empty());
    wait::pace(Duration::from_millis(1050));
    let said = take(&mut stream, Event::Idle);
    assert_eq!(faults(&said), ["50 pictures without a valid pose are left out"]);
    // Pictures that cannot be compounded.
    let mut stream = begun();
    let short = Event::Frame(frame(0, Some(pose(0)), vec![0; 4]));
    let said = [take(&mut stream, short), stream.take(Event::End(None))].concat();
    let [fault] = faults(&said)[..] else { panic!("{said:?}") };
    assert!(fault.starts_with("50 pictures are refused, the last: ") && fault.contains("samples"), "{fault}");
}

/// A recording of the stream, and the stream itself in a file.
fn stored(folder: &Folder, bytes: &[u8]) -> [String; 2] {
    let stream = folder.write("stream", bytes);
    let tape = folder.path("tape.frames");
    let piped = Piped::new(Cursor::new(bytes.to_vec()), None).expect("a thread");
    let feed = Feed::new(Box::new(piped), Some(tape.as_ref())).expect("a thread");
    let (_, why) = all(|| feed.next(Duration::from_secs(20)).map(|arrived| arrived.event));
    assert_eq!(why, None);
    [tape, stream]
}

/// Clip, spacing and holes apply to the volume of a file as to a live one, or are refused: never ignored.
#[test]
fn what_is_said_of_a_freehand_volume_applies_to_files() {
    let folder = Folder::new("said");
    let opened = |file: &str, freehand: FreehandArguments| {
        let options = OpenOptions { freehand, ..OpenOptions::default() };
        let mut source = open_with(file.as_ref(), options)?;
        let Geometry::Cartesian(grid) = source.geometry(0) else { panic!("a lattice") };
        let slices: Vec<_> = std::iter::from_fn(|| source.next_frame().expect("a slice")).collect();
        let world = source.world().expect("a place");
        let filled = hold_the_field(&grid, &world, slices.iter().map(|frame| (frame.slice, &frame.bytes[..])));
        Ok::<_, InputError>((grid, filled))
    };
    let none = FreehandArguments::default();
    let [x, y] = SIZE;
    for file in stored(&folder, &stream(2, &[3], &[])) {
        // The pictures are 0.5 mm apart, and the one without a pose leaves a gap that is bridged.
        let (grid, filled) = opened(&file, none).expect("a volume");
        assert_eq!((grid.size, filled), ([x, y, PICTURES], x * y * PICTURES), "{file}");
        let (grid, filled) = opened(&file, FreehandArguments { max_hole: Some(0.0), ..none }).expect("a volume");
        assert_eq!((grid.size, filled), ([x, y, PICTURES], x * y * (PICTURES - 1)), "{file}");
        let (grid, _) = opened(&file, FreehandArguments { clip: Some([2, 1, 4, 3]), ..none }).expect("a volume");
        assert_eq!(grid.size, [4, 3, PICTURES], "{file}");
        let (grid, _) = opened(&file, FreehandArguments { spacing: Some(0.45), ..none }).expect("a volume");
        assert_eq!(grid.spacing, [0.45; 3], "{file}");
        let outside = FreehandArguments { clip: Some([100, 0, 3, 3]), ..none };
        let error = opened(&file, outside).expect_err("refused").to_string();
        assert!(error.contains("leaves nothing of 9 x 7"), "{error}");
        // The flags of a command are the same.
        let (code, _, said) =
            crate::common::program::run(&["stream", "--null", "--source", &file, "--clip", "100,0,3,3"]);
        assert!(code == Some(2) && said.contains("leaves nothing of 9 x 7"), "{code:?} {said}");
    }
    // Frames of a volume, a recording, UFF.
    let tape = folder.path("volume.frames");
    let mut writer = Writer::create(tape.as_ref(), header(true)).expect("created");
    let frame = |n: usize| Frame { pose: Some(pose(0)), ..Frame::of_slice(0, n, vec![0; 12]) };
    (0..2).for_each(|n| writer.frame(&frame(n), 0.0).expect("written"));
    writer.finish().expect("finished");
    let data = |name: &str| crate::common::files::data(name).to_string_lossy().into_owned();
    for file in [tape, data("formats/oblique.nii"), data("uff/sector.uff")] {
        for (said, flag) in [
            (FreehandArguments { clip: Some([0, 0, 2, 2]), ..none }, "--clip"),
            (FreehandArguments { spacing: Some(1.0), ..none }, "--spacing"),
            (FreehandArguments { max_hole: Some(1.0), ..none }, "--hole"),
        ] {
            let options = OpenOptions { freehand: said, ..OpenOptions::default() };
            let error = open_with(file.as_ref(), options).err().expect("refused").to_string();
            assert!(error.contains(&format!("{flag}: is for pictures with poses")), "{error}");
        }
    }
}

/// What `info` says of pictures with poses is what is shown: their volume.
#[test]
fn the_description_of_posed_pictures_is_that_of_their_volume() {
    let folder = Folder::new("described");
    for (file, format) in
        stored(&folder, &stream(2, &[3], &[])).into_iter().zip(["frames as they arrived", "stream of frames"])
    {
        let said = description(file.as_ref(), OpenOptions::default()).expect("a description");
        let row = |title: &str| -> Vec<&str> {
            said.rows.iter().filter(|(there, _)| there == title).map(|(_, value)| value.as_str()).collect()
        };
        assert_eq!(row("format"), [format!("{format}, freehand")]);
        assert_eq!(row("pictures"), ["8, 7 with a valid pose"]);
        assert_eq!(row("geometry"), ["Cartesian, 9 x 7 x 8 voxels of 0.5 x 0.4 x 0.5 mm"]);
        assert_eq!((row("placed").len(), row("position").len(), row("value range").len()), (1, 1, 1), "{said:?}");
        assert_eq!((row("frame").len(), row("volumes").len()), (0, 0), "of the pictures: {said:?}");
        assert_eq!(row("damaged").len(), usize::from(format.starts_with("frames")), "of the file: {said:?}");
    }
}

/// A picture whose pose is rigid and finite, but beyond all trackers, is left out and counted; the others make the volume.
#[test]
fn a_picture_that_is_refused_does_not_take_the_others_with_it() {
    let folder = Folder::new("refused");
    let mut bytes = stream(2, &[], &[]);
    let header = bytes.iter().position(|b| *b == b'\n').expect("a line") + 1;
    let each = 8 + 96 + 4 * SIZE[0] * SIZE[1];
    // The translation along x of the sixth picture.
    let at = header + 5 * each + 8 + 3 * 8;
    bytes[at..at + 8].copy_from_slice(&1e9f64.to_le_bytes());
    for file in stored(&folder, &bytes) {
        let out = format!("{file}.nrrd");
        let (code, _, said) = crate::common::program::run(&["convert", &file, &out]);
        assert_eq!(code, Some(0), "{said}");
        assert!(said.contains("1 of 8 pictures have no valid pose; left out"), "{said}");
        let mut source = open(out.as_ref(), None).expect("a volume");
        let Geometry::Cartesian(grid) = source.geometry(0) else { panic!("a lattice") };
        assert_eq!(grid.size, [SIZE[0], SIZE[1], PICTURES]);
        let world = source.world().expect("a place");
        let slices: Vec<_> = std::iter::from_fn(|| source.next_frame().expect("a slice")).collect();
        let filled = hold_the_field(&grid, &world, slices.iter().map(|frame| (frame.slice, &frame.bytes[..])));
        assert_eq!(filled, SIZE[0] * SIZE[1] * PICTURES, "the gap is bridged");
    }
    // None is left: one line says so.
    let all_out = folder.write("none", stream(2, &(0..PICTURES).collect::<Vec<_>>(), &[]));
    let error = open(all_out.as_ref(), None).err().expect("refused").to_string();
    assert!(error.contains("poses: none of 8 pictures has a valid one"), "{error}");
}

/// The orientation of a volume survives `.frames`, and what plays it back.
#[test]
fn a_volume_keeps_its_orientation_through_frames() {
    let folder = Folder::new("oriented");
    let stored = repository("tests/data/formats/raw-ras.nrrd");
    let (tape, back) = (folder.path("tape.frames"), folder.path("back.nrrd"));
    let program = crate::common::program::run;
    for (from, to) in [(stored.to_str().expect("a plain name"), &tape), (tape.as_str(), &back)] {
        let (code, _, said) = program(&["convert", from, to]);
        assert_eq!(code, Some(0), "{said}");
    }
    let all = |path: &str| {
        let mut source = open(path.as_ref(), None).expect("a volume");
        let Geometry::Cartesian(grid) = source.geometry(0) else { panic!("a lattice") };
        let frames: Vec<Vec<u8>> =
            std::iter::from_fn(|| source.next_frame().expect("a slice")).map(|f| f.bytes).collect();
        (source.world().expect("a place"), grid, frames)
    };
    let ((world, grid, samples), (read, _, again)) = (all(stored.to_str().expect("a plain name")), all(&back));
    assert_eq!(samples, again);
    assert!(world != World::of(&grid), "it is turned");
    for cell in [DVec3::ZERO, DVec3::from_array(grid.size.map(|n| n as f64 - 1.0))] {
        let (here, there) = (world.at(cell), read.at(cell));
        assert!(here.distance(there) < 1e-6, "{here} {there}");
    }
    let source = open(tape.as_ref(), None).expect("a volume");
    let mut live = PlaybackSource::new(source, Playback::Fast, 1);
    let (events, _) = crate::posed::all(|| Some(live.next(Duration::from_secs(10))));
    assert!(frames(&events).iter().all(|frame| frame.pose.is_some()));
}

/// The example program sends pictures of a ball of 12 mm around a known place, as a probe that is tilted and moved would see it.
#[test]
fn the_example_s_sweep_is_a_ball_where_it_says() {
    let output =
        Command::new("python3").arg(repository("tools/pipe_frames.py")).args(["--freehand", "2000", "60"]).output();
    let output = output.expect("python3");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let folder = Folder::new("ball");
    let stored = folder.write("sweep", &output.stdout);
    let mut source = open(stored.as_ref(), None).expect("a volume");
    let (world, Geometry::Cartesian(grid)) = (source.world().expect("a place"), source.geometry(0)) else {
        panic!("a lattice")
    };
    let (mut sum, mut weight, mut radii) = (DVec3::ZERO, 0.0, Vec::new());
    while let Some(frame) = source.next_frame().expect("a slice") {
        for (n, sample) in frame.bytes.iter().enumerate().filter(|(_, sample)| **sample > 128) {
            let cell = [n % grid.size[0], n / grid.size[0], frame.slice].map(|n| n as f64);
            let place = world.at(DVec3::from_array(cell));
            sum += place * f64::from(*sample);
            weight += f64::from(*sample);
            radii.push(place);
        }
    }
    let centre = sum / weight;
    assert!(centre.distance(DVec3::new(110.0, -40.0, 65.0)) < 0.5, "{centre}");
    let mean = radii.iter().map(|place| place.distance(centre)).sum::<f64>() / radii.len() as f64;
    assert!((mean - 12.0).abs() < 0.3, "{mean}");
}
