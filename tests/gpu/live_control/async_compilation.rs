//! Settings whose pipelines compile in the background, and those that the device cannot draw.

use super::*;
use crate::common::wait;
use ash::vk;
use echolume::low_level::gpu::Wake;
use echolume::low_level::gpu::faults::InjectionPoint;
use echolume::low_level::live::StartStep;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Axis, Geometry, Probe};
use echolume::low_level::scene::{Scene, VolumeFormat};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

fn waking() -> (Arc<AtomicU64>, live::StreamOptions) {
    let woken = Arc::new(AtomicU64::new(0));
    let counted = woken.clone();
    let wake: Wake = Arc::new(move || {
        counted.fetch_add(1, Ordering::Relaxed);
    });
    (woken, live::StreamOptions { wake: Some(wake), ..kept(Update::Whole) })
}

/// Prevents a view that stalls while shaders compile, for both sweep directions of the volumes that arrive meanwhile.
#[test]
fn a_new_mode_compiles_in_the_background_while_pictures_continue() {
    // Expected pictures are drawn on another device, so that every pipeline here belongs to the stream.
    let (device, plain) = (Device::alone(), Device::alone());
    let (woken, options) = waking();
    let mut now = "mode = 'mip'";
    let mut bench = Bench::new(&device, now, options);
    bench.begin(header(0.3));
    (0..2).for_each(|number| drop(bench.live(number)));
    let (waited, mut number) = (waited_for(&device), 2);
    for next in ["mode = 'sr'\nslices.median = true", "mode = 'orthogonal'", "mode = 'vr'\nlayout = 'four'"] {
        // A complete volume waits to be shown when the settings arrive, so that one picture is certain to have the previous ones.
        let frames = bench.stream.frames();
        bench.frames(speckled(number));
        while bench.stream.frames() < frames + 9 {
            bench.stream.step(Duration::from_millis(1)).expect("step");
        }
        let awake = woken.load(Ordering::Relaxed);
        bench.stream.change(settings(next)).expect("change");
        // One of the new settings follows at once where they are compiled before the stream comes to rest.
        let first = bench.settle().swap_remove(0);
        let is_previous = first.picture.expect("brought back") == of(&plain, now, number);
        assert!(first.volume == number && is_previous, "{now} while {next} is made");
        number += 1;
        let begun = Instant::now();
        while woken.load(Ordering::Relaxed) == awake || bench.stream.scene().expect("begun").settings != settings(next)
        {
            assert!(begun.elapsed() < BOUND, "{next} never comes");
            bench.stream.step(Duration::from_millis(1)).expect("step");
        }
        // Both directions of the sweep.
        for _ in 0..2 {
            assert!(bench.live(number) == of(&plain, next, number), "{next}: volume {number}");
            number += 1;
        }
        assert_eq!(waited_for(&device), waited, "{next}: pipelines were made while everything waited");
        now = next;
    }
}

/// A stream whose picture is drawn with the settings before while those of `next` compile.
fn compiling_beside_a_picture(device: &Device, next: &str) -> (Arc<AtomicU64>, Bench) {
    let (woken, options) = waking();
    let mut bench = Bench::new(device, "mode = 'mip'", options);
    bench.begin(header(0.3));
    (0..2).for_each(|number| drop(bench.live(number)));
    // A complete volume waits.
    let frames = bench.stream.frames();
    bench.frames(speckled(2));
    while bench.stream.frames() < frames + 9 {
        bench.stream.step(Duration::from_millis(1)).expect("step");
    }
    bench.stream.change(settings(next)).expect("change");
    while !bench.stream.is_drawing() {
        bench.stream.step(Duration::ZERO).expect("step");
    }
    (woken, bench)
}

/// Prevents a picture that comes seconds late: its pipelines were compiled while another picture was drawn, and nobody asked again.
#[test]
fn what_compiles_during_a_picture_is_drawn_after_it() {
    let next = "mode = 'sr'\nslices.median = true";
    let is_next = |bench: &Bench| bench.stream.scene().expect("begun").settings == settings(next);
    // Another device tells how many pipelines wake the loop.
    let (before, mut bench) = compiling_beside_a_picture(&Device::alone(), next);
    let begun = Instant::now();
    while !is_next(&bench) {
        assert!(begun.elapsed() < BOUND, "{next} never comes");
        bench.stream.step(Duration::from_millis(1)).expect("step");
    }
    let count = before.load(Ordering::Relaxed);
    assert!(count > 0);

    let (woken, mut bench) = compiling_beside_a_picture(&Device::alone(), next);
    // Every pipeline, so that none is left to wake anybody.
    let begun = Instant::now();
    while woken.load(Ordering::Relaxed) < count {
        assert!(begun.elapsed() < BOUND, "{} of {count} pipelines", woken.load(Ordering::Relaxed));
        wait::poll();
    }
    // As an event loop does it: without an event, only what has something to do is asked.
    let mut drawn = 0;
    while !bench.stream.is_idle() {
        drawn += usize::from(matches!(bench.stream.step(Duration::ZERO).expect("step"), live::Step::Picture(_)));
    }
    assert_eq!(drawn, 2, "the picture in flight, and the one of the new settings");
    assert!(is_next(&bench));
}

/// So many fine slices are more than an image of any device here: 9 GB, of which none is allocated. An H100 allows 4.3 GB.
const SLICES: u32 = 200;

/// Prevents a stream that ends or goes black because settings exceed the device; and that they return with another device.
#[test]
fn settings_too_large_for_the_device_are_reported_and_the_picture_stays() {
    let (device, other) = (Device::alone(), Device::alone());
    let (_, options) = waking();
    let toml = "mode = 'mip'";
    let mut bench = Bench::new(&device, toml, options);
    // Fine slices of many frames are more than any image of the device.
    let geometry = Geometry::Sweep(Probe { slices: Axis::centred(0.006, SLICES as usize), ..wobbler() });
    let many = Header { forward: geometry.clone(), backward: geometry.clone(), ..header(0.0) };
    let frame = |n: u32, volume: u32| {
        let bytes = (0..24 * 64).map(|i| (i * 7 + n * 13 + volume * 90) as u8).collect();
        Frame { volume, number: n, slice: n as usize, backward: false, time: None, pose: None, bytes }
    };
    let volume = |number| (0..SLICES).map(|n| frame(n, number)).collect::<Vec<_>>();
    let expected = [0, 1].map(|number| fresh(&other, toml, &many, Update::Whole, &volume(number)));
    bench.begin(many);
    bench.frames(volume(0));
    assert!(bench.picture() == (0, expected[0].clone()));

    let mut large = settings("mode = 'sr'");
    large.slices.pixels = 4096;
    large.slices.format = VolumeFormat::R32f;
    // None of it may be allocated, or the machine would have to hold it.
    let scene = Scene::new(geometry, BYTES, large.clone()).expect("another device might hold it");
    let most = Plan::new(&scene).slots.iter().map(|slot| slot.bytes(&scene)).max().expect("slots");
    assert!(most > device.candidate.max_allocation, "{most} of {}", device.candidate.max_allocation);
    bench.stream.change(large).expect("told by the device alone");
    assert!(bench.settle().is_empty());
    assert!(bench.faults.len() == 1 && bench.faults[0].contains("4096"), "{:?}", bench.faults);
    bench.frames(volume(1));
    assert!(bench.picture() == (1, expected[1].clone()));
    bench.stream.freeze(true);
    bench.stream.show_cine_volume(0);
    assert!(bench.picture() == (0, expected[0].clone()));
    bench.stream.revive(&other).expect("made anew of what could be drawn");
    assert!(bench.picture() == (0, expected[0].clone()));
}

/// Prevents a stream that never draws again because memory ran out once, anywhere: the previous settings are drawn again.
#[test]
fn running_out_of_memory_rejects_the_settings_and_keeps_the_stream() {
    let (device, plain) = (Device::alone(), Device::alone());
    let (before, after) = ("mode = 'mip'", "mode = 'sr'\nslices.median = true");
    let (old, new) = (of(&plain, before, 1), of(&plain, after, 1));
    let mut refused = 0;
    let mut bench = Bench::new(&device, before, kept(Update::Whole));
    bench.begin(header(0.3));
    (0..2).for_each(|number| drop(bench.live(number)));
    bench.stream.freeze(true);
    for n in 0.. {
        device.faults.inject(InjectionPoint::Allocate, n, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        bench.stream.change(settings(after)).expect("change");
        let picture = bench.settle().pop();
        // An injected fault that was not reached is removed.
        device.faults.inject(InjectionPoint::Wait, u32::MAX, vk::Result::SUCCESS);
        match bench.faults.pop() {
            None => {
                assert!(picture.expect("drawn").picture == Some(new));
                break;
            }
            Some(fault) => assert!(fault.contains("out of device memory"), "{fault}"),
        }
        refused += 1;
        let shown = match picture {
            Some(shown) => shown.picture.expect("brought back"),
            None => bench.stream.renderer().expect("begun").picture().expect("picture"),
        };
        assert!(shown == old && bench.faults.is_empty(), "allocation {n}");
    }
    assert!(refused > 3, "{refused}");
}

/// Prevents a window that stands still while the first pipelines compile, and a first picture that comes late or stays coarse.
#[test]
fn the_first_pipelines_compile_beside_the_steps_and_the_first_picture_has_few_rays() {
    let (device, plain) = (Device::alone(), Device::alone());
    let (woken, options) = waking();
    let now = "mode = 'mip'";
    let options = live::StreamOptions { prepares: true, coarse_first: true, ..options };
    let mut bench = Bench::new(&device, now, options);
    assert_eq!(bench.stream.start_step(), Some(StartStep::Source));
    bench.begin(header(0.3));
    bench.frames(speckled(0));
    let (mut steps, begun) = (Vec::new(), Instant::now());
    let first = loop {
        assert!(begun.elapsed() < BOUND, "no picture: {steps:?}");
        let step = bench.stream.step(Duration::ZERO).expect("step");
        let name = match bench.stream.start_step() {
            None => "none",
            Some(StartStep::Source) => "source",
            Some(StartStep::Compiling { done, count }) => {
                assert!(done <= count);
                "compiling"
            }
            Some(StartStep::Frames { done, count }) => {
                assert!(done <= count && count == 9);
                "frames"
            }
            Some(StartStep::Picture) => "picture",
        };
        if steps.last() != Some(&name) {
            steps.push(name);
        }
        if let Step::Picture(picture) = step {
            break picture;
        }
    };
    assert_eq!(steps, ["source", "compiling", "frames", "picture", "none"]);
    assert!(woken.load(Ordering::Relaxed) > 2, "each pipeline wakes the loop");
    assert_eq!(waited_for(&device), 0, "pipelines were made while everything waited");
    let quarter = of(&plain, &format!("{now}\nray.subsampling = 4"), 0);
    assert!(first.is_coarse && first.picture.expect("brought back") == quarter);
    // What only the full picture needs is compiled beside the first one and after it.
    let last = loop {
        assert!(begun.elapsed() < BOUND, "the same in full");
        if let Some(picture) = bench.settle().pop() {
            break picture;
        }
    };
    assert!(!last.is_coarse && last.picture.expect("brought back") == of(&plain, now, 0));
    // Later ones are drawn in full at once.
    assert!(bench.live(1) == of(&plain, now, 1));
}

/// A stream whose first pipelines are being compiled.
fn preparing(device: &Device, toml: &str, options: live::StreamOptions) -> Bench {
    let mut bench = Bench::new(device, toml, live::StreamOptions { prepares: true, ..options });
    bench.begin(header(0.3));
    bench.frames(speckled(0));
    step_until(&mut bench, |stream| matches!(stream.start_step(), Some(StartStep::Compiling { .. })));
    bench
}

fn step_until(bench: &mut Bench, is_there: impl Fn(&Stream) -> bool) {
    let begun = Instant::now();
    while !is_there(&bench.stream) {
        assert!(begun.elapsed() < BOUND, "{:?}", bench.stream.start_step());
        bench.stream.step(Duration::ZERO).expect("step");
    }
}

/// Prevents a picture that never comes because the device was lost while the first pipelines were compiled, and one that stops the window.
#[test]
fn a_device_lost_while_the_first_pipelines_compile_is_prepared_anew() {
    let (device, other, plain) = (Device::alone(), Device::alone(), Device::alone());
    let toml = "mode = 'mip'";
    let mut bench = preparing(&device, toml, waking().1);
    bench.stream.revive(&other).expect("made anew");
    assert!(bench.picture() == (0, of(&plain, toml, 0)));
    assert_eq!(waited_for(&other), 0, "pipelines were made while everything waited");
}

/// Prevents a source that has to be opened again after settings that only the device refuses: the geometry begins with the next device.
#[test]
fn a_geometry_that_cannot_be_prepared_begins_on_the_next_device() {
    let (device, other, plain) = (Device::alone(), Device::alone(), Device::alone());
    let small = "mode = 'mip'";
    let mut bench = Bench::new(&device, small, live::StreamOptions { prepares: true, ..waking().1 });
    let mut large = settings("mode = 'sr'");
    large.slices.pixels = 4096;
    large.slices.format = VolumeFormat::R32f;
    bench.stream.change(large).expect("told by the device alone");
    // Fine slices of many frames are more than any image of the device.
    let geometry = Geometry::Sweep(Probe { slices: Axis::centred(0.006, SLICES as usize), ..wobbler() });
    let many = Header { forward: geometry.clone(), backward: geometry, ..header(0.0) };
    bench.begin(many.clone());
    let begun = Instant::now();
    let fault = loop {
        assert!(begun.elapsed() < BOUND, "{:?}", bench.stream.start_step());
        if let Err(fault) = bench.stream.step(Duration::ZERO) {
            break fault.to_string();
        }
    };
    assert!(fault.contains("4096"), "{fault}");
    assert_eq!(bench.stream.header(), Some(&many));
    bench.stream.change(settings(small)).expect("change");
    bench.stream.revive(&other).expect("made anew");
    let frame = |n: u32| {
        let bytes = (0..24 * 64).map(|i| (i * 7 + n * 13) as u8).collect();
        Frame { volume: 0, number: n, slice: n as usize, backward: false, time: None, pose: None, bytes }
    };
    let frames: Vec<_> = (0..SLICES).map(frame).collect();
    bench.frames(frames.clone());
    assert!(bench.picture() == (0, fresh(&plain, small, &many, Update::Whole, &frames)));
}

/// Prevents a source that waits for the pipelines of the one before it, or is closed by what they fail with.
#[test]
fn a_source_opened_while_the_first_pipelines_compile_replaces_the_one_before() {
    let (device, plain) = (Device::alone(), Device::alone());
    let toml = "mode = 'mip'";
    let mut bench = preparing(&device, toml, waking().1);
    let (say, feed) = fed(None);
    bench.stream.replace_source(feed);
    bench.say = say;
    assert_eq!(bench.stream.start_step(), Some(StartStep::Source));
    assert!(bench.settle().is_empty() && bench.stream.header().is_none(), "the source before began");
    let next = header(0.2);
    bench.begin(next.clone());
    bench.frames(speckled(1));
    step_until(&mut bench, |stream| stream.header().is_some());
    assert_eq!(bench.stream.header(), Some(&next));
    assert!(bench.picture() == (1, fresh(&plain, toml, &next, Update::Whole, &speckled(1))));
    assert!(bench.faults.is_empty(), "{:?}", bench.faults);
}

/// Prevents a window that stands still because a setting was changed before the first picture.
#[test]
fn settings_changed_while_the_first_pipelines_compile_are_prepared_too() {
    let (device, plain) = (Device::alone(), Device::alone());
    let mut bench = preparing(&device, "mode = 'mip'", waking().1);
    let next = "mode = 'sr'\nslices.median = true";
    bench.stream.change(settings(next)).expect("change");
    assert!(bench.picture() == (0, of(&plain, next, 0)));
    assert_eq!(waited_for(&device), 0, "pipelines were made while everything waited");
}

/// Prevents a window that sleeps on because the thread that compiles for it panicked.
#[test]
fn a_thread_that_panics_over_the_first_pipelines_wakes_the_stream() {
    let (device, plain) = (Device::alone(), Device::alone());
    let woken = Arc::new(AtomicU64::new(0));
    let counted = woken.clone();
    let wake: Wake = Arc::new(move || {
        let is_first =
            std::thread::current().name() == Some("preparing") && counted.fetch_add(1, Ordering::Relaxed) == 0;
        assert!(!is_first, "a panic of this test");
    });
    let toml = "mode = 'mip'";
    let mut bench = preparing(&device, toml, live::StreamOptions { wake: Some(wake), ..kept(Update::Whole) });
    let begun = Instant::now();
    while woken.load(Ordering::Relaxed) < 2 {
        assert!(begun.elapsed() < BOUND, "nobody was woken");
        wait::poll();
    }
    assert!(!bench.stream.is_idle());
    assert!(bench.picture() == (0, of(&plain, toml, 0)));
}

/// Prevents a count of the first frames that is full before any came, as that of the whole stream is.
#[test]
fn the_frames_before_the_first_picture_are_those_of_the_geometry() {
    let device = Device::alone();
    let mut bench = Bench::new(&device, "mode = 'mip'", kept(Update::Whole));
    bench.begin(header(0.3));
    bench.live(0);
    bench.begin(header(0.2));
    bench.frames(speckled(1).drain(..4));
    step_until(&mut bench, |stream| stream.header() == Some(&header(0.2)));
    assert_eq!(bench.stream.start_step(), Some(StartStep::Frames { done: 0, count: 9 }));
    bench.settle();
    assert_eq!(bench.stream.start_step(), Some(StartStep::Frames { done: 4, count: 9 }));
}
