//! Sources and devices that take the place of others while something is looked at, and streams that have nothing to do.

use super::*;
use echolume::probe::Geometry;

/// Frames of another probe.
fn other() -> (Header, Vec<Frame>) {
    let geometry = Geometry::Sweep(linear());
    let frame = |n: u32| {
        let bytes = (0..48 * 20).map(|i| (i * 5 + n * 40) as u8).collect();
        Frame { volume: 9, number: n, slice: n as usize, backward: false, time: None, bytes }
    };
    (Header { forward: geometry.clone(), backward: geometry, ..header(0.0) }, (0..7).map(frame).collect())
}

/// Prevents a source that is taken for late because it counts from nought, and volumes of two sources that are taken for one another.
#[test]
fn another_source_that_counts_from_nought_goes_on_and_its_volumes_are_its_own() {
    let device = Device::new();
    for update in [Update::Whole, Update::Rolling] {
        let mut bench = Bench::new(&device, "mode = 'mip'", kept(update));
        bench.begin(header(0.3));
        let mut seen: Vec<_> = (0..3).map(|number| bench.live(number)).collect();
        // It ended in the middle of a volume.
        bench.frames(speckled(3).drain(..4));
        bench.settle();
        let (say, feed) = fed(None);
        bench.stream.replace_source(feed);
        bench.say = say;
        bench.begin(header(0.3));
        for number in [0, 1] {
            // Swept as its number says, and otherwise unlike the first source's.
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
            // Found again where stage 1 is another, too.
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

/// Prevents a device that is opened anew from showing another volume than the one that was looked at, or nothing.
#[test]
fn a_frozen_volume_outlives_its_device() {
    let (device, other, third) = (Device::new(), Device::new(), Device::new());
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
        // What was asked for and did not come any more.
        bench.stream.revive(&third).expect("made anew");
        assert!(bench.picture() == (2, seen[2].clone()), "{update:?}");
        bench.stream.freeze(false);
        assert!(bench.live(4) == fresh(&device, "mode = 'vr'", &header(0.3), update, &speckled(4)));
    }
}

/// Prevents what is looked at from vanishing because a cable was changed, and a probe that is never shown.
#[test]
fn a_geometry_that_begins_while_frozen_waits_until_it_goes_on() {
    let device = Device::new();
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
fn a_stream_that_has_nothing_to_do_says_so_and_does_nothing() {
    let device = Device::new();
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
        // The same settings once more are no others.
        bench.stream.change(settings("mode = 'sr'")).expect("change");
        bench.settle();
    }
}
