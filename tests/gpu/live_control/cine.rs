//! Freezing, the cine loop, and settings that change while no frames arrive.

use super::*;
use echolume::low_level::source::recorder::Reader;

/// Prevents a frozen picture that changes, work for frames that are not shown, a recording with a gap, and a volume whose first
/// frames arrived while frozen from being shown as complete.
#[test]
fn frames_received_while_frozen_are_recorded_and_change_no_picture() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        let folder = Folder::new("frozen");
        let file = folder.join("exam.frames");
        let mut bench = Bench::recorded(&device, "mode = 'mip'", kept(update), Some(&file));
        bench.begin(header(0.3));
        let before = bench.live(0);
        bench.stream.freeze(true);
        let dispatches = bench.dispatches();
        bench.frames([speckled(1), speckled(2)].concat());
        bench.frames(speckled(3).drain(..4));
        assert!(bench.settle().is_empty());
        assert_eq!(bench.dispatches(), dispatches, "{update:?}");
        assert!(bench.stream.renderer().expect("begun").end_picture().expect("picture") == before);
        assert_eq!(bench.stream.cine().volumes().len(), 1, "what was not shown is not kept");

        bench.stream.freeze(false);
        bench.frames(speckled(3).drain(4..));
        let shown = bench.settle();
        assert!(update == Update::Rolling || shown.is_empty(), "a volume that lacks frames");
        let after = bench.live(4);
        assert!(after == fresh(&device, "mode = 'mip'", &header(0.3), update, &speckled(4)), "{update:?}");
        let statistics = bench.stream.statistics().expect("statistics");
        assert_eq!(statistics.frozen, 2 * 9 + 4, "each frame that was passed over is counted");
        let counts = statistics.volumes;
        assert_eq!((counts.shown, counts.dropped, bench.faults.len()), (2, 0, 0), "{counts:?}");
        drop(bench);
        let recording = Reader::open(&file).expect("recording");
        assert_eq!((recording.frames(), recording.rebuilt()), (5 * 9, false));
    }
}

/// Prevents a recording that loses volumes because the picture was frozen while it was read, and one that drops those that are viewed.
#[test]
fn a_recording_is_read_on_while_it_is_frozen() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        let mut bench = Bench::reading(&device, "mode = 'mip'", kept(update));
        let numbers = |bench: &Bench| -> Vec<u32> { bench.stream.cine().volumes().iter().map(|v| v.volume).collect() };
        bench.begin(header(0.3));
        bench.live(0);
        bench.frames(speckled(1).drain(..4));
        bench.settle();
        bench.stream.freeze(true);
        let dispatches = bench.dispatches();
        bench.frames(speckled(1).drain(4..));
        bench.frames((2..6).flat_map(speckled));
        assert!(bench.settle().is_empty());
        assert_eq!((bench.dispatches(), numbers(&bench)), (dispatches, (0..6).collect()), "{update:?}");
        bench.stream.show_cine_volume(1);
        assert!(
            bench.picture() == (1, fresh(&device, "mode = 'mip'", &header(0.3), update, &speckled(1))),
            "{update:?}"
        );
        // What the loop has no room for waits.
        bench.frames((6..10).flat_map(speckled));
        let begun = Instant::now();
        while !bench.stream.is_idle() || numbers(&bench).len() < ROOM.volumes {
            assert!(
                begun.elapsed() < BOUND && matches!(bench.stream.step(Duration::from_millis(1)), Ok(Step::Progress))
            );
        }
        assert_eq!(numbers(&bench), (0..8).collect::<Vec<_>>(), "{update:?}");
        bench.stream.freeze(false);
        assert!(
            bench.picture() == (9, fresh(&device, "mode = 'mip'", &header(0.3), update, &speckled(9))),
            "{update:?}"
        );
        assert_eq!(numbers(&bench), (2..10).collect::<Vec<_>>(), "{update:?}");
        let statistics = bench.stream.statistics().expect("statistics");
        let counts = statistics.volumes;
        assert_eq!((counts.shown, counts.dropped, counts.incomplete), (3, 6, 1), "{update:?}: {counts:?}");
        assert_eq!((statistics.frames, statistics.frozen, bench.faults.len()), (10 * 9, 0, 0), "{update:?}");
    }
}

/// Prevents a replay of something that was not shown, volumes that are counted twice, and a cine position that points at another volume.
#[test]
fn a_replayed_volume_is_identical_to_the_live_picture() {
    let device = Device::alone();
    for (update, toml) in [
        (Update::Whole, "mode = 'vr'\nslices.smooth = { elevation = 1.0 }"),
        (Update::Rolling, "mode = 'vr'\nslices.smooth = { elevation = 1.0 }"),
        (Update::Rolling, "mode = 'vr'\nray = { elevation = 'bspline-sharp', brick = 8 }"),
        (Update::Whole, "mode = 'orthogonal'"),
    ] {
        let mut bench = Bench::new(&device, toml, kept(update));
        bench.begin(header(0.3));
        let seen: Vec<_> = (0..4).map(|number| bench.live(number)).collect();
        bench.stream.freeze(true);
        for (n, place) in [3usize, 0, 2, 2, 1].into_iter().enumerate() {
            bench.stream.show_cine_volume(place);
            assert_eq!(bench.stream.cine_position(), Some(place));
            // Frozen, but the probe continues.
            bench.frames(speckled(4 + n as u32));
            let (volume, picture) = bench.picture();
            assert!(volume == place as u32 && picture == seen[place], "{update:?}: {toml}: {place}");
            assert_eq!(bench.stream.cine_position(), Some(place));
        }
        bench.stream.show_cine_volume(99);
        assert!(bench.settle().is_empty(), "a place that is not there");
        bench.stream.freeze(false);
        bench.live(9);
        let counts = bench.stream.statistics().expect("statistics").volumes;
        assert_eq!((counts.shown, counts.dropped, counts.incomplete), (5, 0, 0), "{update:?}: {counts:?}");
    }
}

/// Prevents a replay from mixing with the volume that is arriving meanwhile, without a spare image and with one.
#[test]
fn cine_replay_and_arriving_frames_do_not_mix() {
    let device = Device::alone();
    let toml = "mode = 'mip'\nslices.everything = true";
    for images in [2, 3] {
        let mut bench = Bench::new(&device, toml, live::StreamOptions { images, ..kept(Update::Whole) });
        bench.begin(header(0.3));
        let seen: Vec<_> = (0..3).map(|number| bench.live(number)).collect();
        let mut counted = 3;
        for number in 3..7 {
            bench.frames(speckled(number).drain(..5));
            bench.settle();
            let place = number as usize % 3;
            bench.stream.show_cine_volume(place);
            // Both are in progress now.
            bench.frames(speckled(number).drain(5..));
            for shown in bench.settle() {
                let expected = seen.get(shown.volume as usize).cloned();
                let expected = expected.unwrap_or_else(|| of(&device, toml, shown.volume));
                assert!(shown.picture == Some(expected), "{images} images, volume {}", shown.volume);
            }
            counted += 1;
            let counts = bench.stream.statistics().expect("statistics").volumes;
            assert_eq!(counts.shown + counts.dropped + counts.incomplete, counted, "{counts:?}");
        }
        assert!(bench.live(7) == of(&device, toml, 7));
    }
}

/// Prevents frozen pictures with parts of the previous settings, and frames that are sent again without a need.
#[test]
fn settings_changed_while_frozen_redraw_the_same_volume() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        let mut bench = Bench::new(&device, "mode = 'mip'", kept(update));
        bench.begin(header(0.3));
        (0..3).for_each(|number| drop(bench.live(number)));
        bench.stream.freeze(true);
        for (volume, toml, comes_again) in [
            (2, "mode = 'mip'\nslices.median = true", true),
            (2, "mode = 'mip'\ncamera = { azimuth = 40 }\nslices.median = true", false),
            (2, "mode = 'sr'\ncamera = { azimuth = 40 }\nslices.median = true", false),
            (2, "mode = 'sr'\nlight = { ambient = 0.7 }\npost = { contrast = 1.3 }\nslices.median = true", false),
            (1, "mode = 'sr'\nslices.sigma = {}", true),
            (1, "mode = 'orthogonal'\nslices.sigma = {}", false),
        ] {
            if bench.stream.cine_position() != Some(volume) {
                bench.stream.show_cine_volume(volume);
                bench.settle();
            }
            bench.stream.change(settings(toml)).expect("change");
            bench.frames(speckled(7));
            let mut came_again = false;
            let mut last = None;
            while !bench.stream.is_idle() {
                if let Step::Picture(shown) = bench.stream.step(Duration::from_millis(1)).expect("step") {
                    last = Some(shown);
                }
                came_again |= bench.stream.is_replaying();
            }
            let last = last.expect("drawn");
            let expected = fresh(&device, toml, &header(0.3), update, &speckled(volume as u32));
            assert_eq!((last.volume, came_again), (volume as u32, comes_again), "{update:?}: {toml}");
            assert!(last.picture == Some(expected), "{update:?}: {toml}");
        }
    }
}

/// Prevents a volume of slices with and without a filter if settings change twice during its replay; and that another
/// volume is shown than the last requested one.
#[test]
fn settings_changed_during_a_replay_restart_the_replay() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        for asked in [None, Some(0)] {
            let mut bench = Bench::new(&device, "mode = 'mip'", kept(update));
            bench.begin(header(0.3));
            (0..3).for_each(|number| drop(bench.live(number)));
            bench.stream.freeze(true);
            match asked {
                Some(place) => bench.stream.show_cine_volume(place),
                None => bench.stream.change(settings("mode = 'mip'\nslices.median = true")).expect("change"),
            }
            let begun = Instant::now();
            let half_way = |stream: &Stream| stream.is_replaying() && !stream.is_drawing();
            while asked.is_none() && !half_way(&bench.stream) {
                bench.stream.step(Duration::from_millis(1)).expect("step");
                assert!(begun.elapsed() < BOUND);
            }
            // All but the last frame have arrived.
            bench.stream.step(Duration::ZERO).expect("step");
            let toml = "mode = 'mip'\nslices.sigma = {}";
            bench.stream.change(settings(toml)).expect("change");
            let (volume, picture) = bench.picture();
            let expected = asked.map_or(2, |place| place as u32);
            assert_eq!(volume, expected, "{update:?}");
            let expected = fresh(&device, toml, &header(0.3), update, &speckled(expected));
            assert!(picture == expected, "{update:?}, asked for {asked:?}");
        }
    }
}

/// Prevents a stream that waits for ever for frames that were not kept.
#[test]
fn without_a_cine_loop_only_changed_settings_wait_for_the_next_volume() {
    let device = Device::alone();
    for update in [Update::Whole, Update::Rolling] {
        let options = live::StreamOptions { update, ..live::StreamOptions::default() };
        let mut bench = Bench::new(&device, "mode = 'mip'", options);
        bench.begin(header(0.3));
        bench.live(0);
        bench.stream.freeze(true);
        let toml = "mode = 'mip'\nslices.median = true";
        bench.stream.change(settings(toml)).expect("change");
        bench.settle();
        assert!(bench.stream.is_idle() && bench.stream.cine_position().is_none());
        bench.stream.freeze(false);
        assert!(bench.live(1) == fresh(&device, toml, &header(0.3), update, &speckled(1)), "{update:?}");
    }
}
