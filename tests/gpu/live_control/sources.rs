//! Sources and devices that are replaced during viewing, and idle streams.

use super::*;
use crate::common::wait;
use echolume::low_level::gpu::Wake;
use echolume::low_level::probe::Geometry;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// A source that waits for pictures, or does not.
struct Paced(Fed, bool);

impl Live for Paced {
    fn next(&mut self, patience: Duration) -> Event {
        self.0.next(patience)
    }

    fn can_wait(&self) -> bool {
        self.1
    }
}

/// Prevents a live picture that falls further behind with every slow one, and volumes of a recording that are never shown.
#[test]
fn after_a_slow_picture_a_live_source_shows_its_newest_volume_and_a_recording_each() {
    let device = Device::alone();
    for (waits, shown, dropped) in [(false, vec![0, 6], 5), (true, (0..=6).collect::<Vec<_>>(), 0)] {
        let (say, said) = channel();
        let count = Arc::new(AtomicU64::new(0));
        let counted = count.clone();
        let wake: Wake = Arc::new(move || _ = counted.fetch_add(1, Ordering::Relaxed));
        let source = Box::new(Paced(Fed { said, is_recording: false }, waits));
        let feed = Feed::observed(source, None, Some(wake), None).expect("thread");
        let stream = Stream::new(&device, feed, settings("mode = 'mip'"), kept(Update::Whole));
        let mut bench = Bench { stream, say, faults: Vec::new() };
        bench.begin(header(0.3));
        bench.frames(speckled(0));
        let begun = Instant::now();
        while !bench.stream.is_drawing() {
            assert!(begun.elapsed() < BOUND, "no picture begins");
            bench.stream.step(Duration::from_millis(1)).expect("step");
        }
        // All of this comes while the first picture is drawn.
        (1..=6).for_each(|number| bench.frames(speckled(number)));
        wait::until("the frames", || (count.load(Ordering::Relaxed) == 1 + 7 * 9).then_some(()));
        let is_done = |stream: &mut Stream| !stream.renderer().expect("begun").is_drawing().expect("drawing");
        wait::until("the picture", || is_done(&mut bench.stream).then_some(()));
        let pictures = bench.settle();
        assert_eq!(pictures.iter().map(|picture| picture.volume).collect::<Vec<_>>(), shown, "waits: {waits}");
        assert_eq!(bench.stream.statistics().expect("statistics").volumes.dropped, dropped, "waits: {waits}");
        assert!(pictures.last().and_then(|last| last.picture.as_ref()) == Some(&of(&device, "mode = 'mip'", 6)));
    }
}

/// Frames of another probe.
fn other() -> (Header, Vec<Frame>) {
    let geometry = Geometry::Sweep(linear());
    let frame = |n: u32| {
        let bytes = (0..48 * 20).map(|i| (i * 5 + n * 40) as u8).collect();
        Frame { volume: 9, number: n, slice: n as usize, backward: false, time: None, pose: None, bytes }
    };
    (Header { forward: geometry.clone(), backward: geometry, ..header(0.0) }, (0..7).map(frame).collect())
}

/// Prevents a new source from being treated as late because it counts from zero, and volumes of two sources from being confused.
#[test]
fn a_new_source_that_counts_from_zero_continues_with_its_own_volumes() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        let mut bench = Bench::new(&device, "mode = 'mip'", kept(update));
        bench.begin(header(0.3));
        let mut seen: Vec<_> = (0..3).map(|number| bench.live(number)).collect();
        // The first source ended in the middle of a volume.
        bench.frames(speckled(3).drain(..4));
        bench.settle();
        let (say, feed) = fed(None);
        bench.stream.replace_source(feed);
        bench.say = say;
        bench.begin(header(0.3));
        for number in [0, 1] {
            // Swept in the direction of its number, but unlike that of the first source.
            let frames = volume(number, |slice, i| (slice * 29 + i * 7 + number as usize * 101) as u8);
            bench.frames(frames);
            seen.push(bench.picture().1);
        }
        assert_eq!(bench.stream.cine().volumes().len(), 5);
        bench.stream.freeze(true);
        for place in [4, 1, 3, 0, 2] {
            bench.stream.show_cine_volume(place);
            assert!(bench.picture().1 == seen[place], "{update:?}: {place}");
            assert_eq!(bench.stream.cine_position(), Some(place), "{update:?}");
            // Found again if stage 1 has changed, too.
            bench.stream.change(settings("mode = 'mip'\nslices.median = true")).expect("change");
            bench.settle();
            assert_eq!(bench.stream.cine_position(), Some(place), "{update:?}");
            bench.stream.change(settings("mode = 'mip'")).expect("change");
            assert!(bench.picture().1 == seen[place], "{update:?}: {place} and back");
        }
        let mut numbers: Vec<_> = bench.stream.cine().volumes().iter().map(|kept| kept.volume).collect();
        assert!(numbers.is_sorted(), "{numbers:?}");
        numbers.dedup();
        assert_eq!(numbers.len(), 5, "a recording of them would have one number twice");
    }
}

/// Prevents a reopened device from showing another volume than the one being viewed, or nothing.
#[test]
fn a_frozen_volume_outlives_its_device() {
    let (device, other, third) = (Device::alone(), Device::alone(), Device::alone());
    for update in [Update::Whole, Update::Rolling] {
        let mut bench = Bench::new(&device, "mode = 'vr'", kept(update));
        bench.begin(header(0.3));
        let seen: Vec<_> = (0..4).map(|number| bench.live(number)).collect();
        bench.stream.freeze(true);
        bench.stream.revive(&other).expect("made anew");
        assert!(bench.picture() == (3, seen[3].clone()), "{update:?}");
        bench.stream.show_cine_volume(1);
        assert!(bench.picture() == (1, seen[1].clone()), "{update:?}");
        bench.stream.show_cine_volume(2);
        // A requested volume that did not arrive any more.
        bench.stream.revive(&third).expect("made anew");
        assert!(bench.picture() == (2, seen[2].clone()), "{update:?}");
        bench.stream.freeze(false);
        assert!(bench.live(4) == fresh(&device, "mode = 'vr'", &header(0.3), update, &speckled(4)));
    }
}

/// Prevents the viewed volume from vanishing because a cable was changed, and a probe that is never shown.
#[test]
fn a_geometry_change_while_frozen_waits_until_the_stream_resumes() {
    let device = Device::alone();
    let mut bench = Bench::new(&device, "mode = 'mip'", kept(Update::Whole));
    bench.begin(header(0.3));
    let seen: Vec<_> = (0..2).map(|number| bench.live(number)).collect();
    bench.stream.freeze(true);
    let (theirs, frames) = other();
    bench.begin(theirs.clone());
    bench.frames(frames.clone());
    assert!(bench.settle().is_empty());
    bench.stream.show_cine_volume(0);
    assert!(bench.picture() == (0, seen[0].clone()));
    bench.stream.freeze(false);
    bench.settle();
    assert!(bench.stream.header() == Some(&theirs) && bench.stream.cine().volumes().is_empty());
    bench.frames(frames.clone());
    let expected = fresh(&device, "mode = 'mip'", &theirs, Update::Whole, &frames);
    assert!(bench.picture() == (9, expected));
    // One that came and went again changes nothing.
    bench.stream.freeze(true);
    bench.begin(header(0.3));
    bench.begin(theirs.clone());
    bench.settle();
    bench.stream.freeze(false);
    bench.settle();
    assert!(bench.stream.cine().volumes().len() == 1 && bench.faults.is_empty());
}

/// Prevents a device that runs hot for a picture that stands still.
#[test]
fn an_idle_stream_reports_it_and_does_nothing() {
    let device = Device::alone();
    let mut bench = Bench::new(&device, "mode = 'sr'", kept(Update::Whole));
    assert!(bench.stream.is_idle(), "before anything came");
    bench.begin(header(0.3));
    bench.live(0);
    for is_frozen in [false, true] {
        bench.stream.freeze(is_frozen);
        let dispatches = bench.dispatches();
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_millis(200) {
            assert!(bench.stream.is_idle());
            assert!(matches!(bench.stream.step(Duration::from_millis(1)), Ok(Step::Progress)));
        }
        assert_eq!(bench.dispatches(), dispatches);
        // The same settings again are no change.
        bench.stream.change(settings("mode = 'sr'")).expect("change");
        bench.settle();
    }
}

/// Prevents counts of a source from vanishing when it is opened again, as a kiosk does for as long as it runs.
#[test]
fn what_a_source_counted_is_kept_when_another_follows() {
    struct Unreachable;
    impl Live for Unreachable {
        fn next(&mut self, patience: Duration) -> Event {
            wait::pace(patience.min(Duration::from_millis(1)));
            Event::Idle
        }

        fn can_wait(&self) -> bool {
            true
        }

        fn disconnected(&self) -> Option<String> {
            Some("no server listens".into())
        }
    }
    let device = Device::alone();
    let feed = || Feed::new(Box::new(Unreachable), None).expect("thread");
    let mut stream = Stream::new(&device, feed(), settings("mode = 'mip'"), live::StreamOptions::default());
    for sources in 1..=3 {
        let begun = Instant::now();
        while stream.feed_counts().disconnected < sources {
            assert!(begun.elapsed() < BOUND, "source {sources}: {:?}", stream.feed_counts());
            wait::poll();
        }
        assert_eq!(stream.take_statistics().expect("statistics").faults.disconnected, 1, "source {sources}");
        stream.replace_source(feed());
    }
}
