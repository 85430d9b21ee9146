//! Streams with faults and changes: pictures show complete volumes, and faults are reported.

use crate::common::gpu::*;
use crate::live::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::live::{self, Step};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;
use echolume::low_level::source::Frame;
use echolume::low_level::source::live::Event;
use echolume::low_level::source::recorder::Header;
use std::time::Duration;

/// Prevents a stream that stops or shows wrong pictures because of a faulty source.
#[test]
fn faulty_frames_are_reported_and_left_out() {
    let device = Device::alone();
    let mut events = events(header(0.0), stamped(1));
    events.insert(0, Event::Frame(stamped(0).remove(0)));
    let of = |change: &dyn Fn(&mut Frame)| {
        let mut frame = stamped(2).remove(0);
        change(&mut frame);
        Event::Frame(frame)
    };
    events.push(of(&|f| f.bytes.truncate(1000)));
    events.push(of(&|f| f.bytes.extend([0; 64])));
    events.push(of(&|f| f.bytes.truncate(64 * 20)));
    // An implausible number: frames of volume 3 follow it.
    events.push(of(&|f| (f.volume, f.bytes) = (1 << 31, vec![0; 7])));
    events.push(of(&|f| f.slice = 9));
    events.push(of(&|f| f.slice = usize::MAX));
    events.push(Event::Lines { frame: stamped(2).remove(3), first: 7 });
    events.push(Event::Fault("the peer went away".into()));
    events.push(Event::Begin(Box::new(header(0.3))));
    events.extend(stamped(3).into_iter().map(Event::Frame));
    // Another geometry, with frames of another size.
    let other = Geometry::Sweep(linear());
    events.push(Event::Begin(Box::new(Header { forward: other.clone(), backward: other, ..header(0.0) })));
    let frame = |n| Frame {
        volume: 4,
        number: n,
        slice: n as usize,
        backward: false,
        time: None,
        pose: None,
        bytes: vec![45; 48 * 20],
    };
    events.extend((0..7).map(|n| Event::Frame(frame(n))));
    let mut stream = stream(&device, events, settings("mode = 'mip'"), live::StreamOptions::default());
    let mut shown = Vec::new();
    let faults = run(&mut stream, |_, picture| shown.push(picture.volume));
    assert_eq!(shown.last(), Some(&4), "{shown:?}: {faults:?}");
    let expected = [
        "not announced",
        "1000 bytes",
        "1600 bytes",
        "1280 bytes",
        "7 bytes",
        "slice 9",
        "slice",
        "from line 7",
        "the peer went away",
    ];
    assert_eq!(faults.len(), expected.len(), "{faults:?}");
    for (fault, part) in faults.iter().zip(expected) {
        assert!(fault.contains(part), "{part}: {fault}");
    }
}

/// Prevents settings that reach pictures only with the next volume, or end the stream.
#[test]
fn new_settings_are_drawn_from_the_present_volume() {
    let device = Device::alone();
    let mut stream =
        stream(&device, events(header(0.0), speckled(0)), settings("mode = 'mip'"), live::StreamOptions::default());
    let mut first = None;
    while first.is_none() {
        if let Step::Picture(shown) = stream.step(Duration::from_millis(20)).expect("step") {
            first = Some(shown.picture);
        }
    }
    assert!(stream.change(settings("mode = 'mip'\ncamera = { zoom = -1 }")).is_err());
    stream.change(settings("mode = 'mip'\ncamera = { azimuth = 40 }")).expect("change");
    let mut second = None;
    run(&mut stream, |_, shown| second = Some((shown.volume, shown.picture)));
    let (volume, second) = second.expect("drawn again");
    assert!(volume == 0 && Some(&second) != first.as_ref());
}

/// Prevents a stream that ends with a lost device: the present volume is lost, the next one is shown. Whether a picture or frames are submitted
/// when it is lost depends on how many frames go together.
#[test]
fn a_lost_device_costs_a_volume_and_not_the_stream() {
    use echolume::low_level::gpu::faults::InjectionPoint;
    let mut incomplete = 0;
    let mut last = None;
    // Whether frames were on their way with that submission depends on how fast they came.
    for submission in 1..=16 {
        if submission > 4 && incomplete > 0 {
            break;
        }
        let (device, other) = (Device::alone(), Device::alone());
        let options = live::StreamOptions::default();
        let events = events(header(0.3), (0..6).flat_map(stamped));
        let mut stream = stream(&device, events, settings("mode = 'mip'"), options);
        let (mut shown, mut lost) = (Vec::new(), 0);
        loop {
            match stream.step(Duration::from_millis(20)) {
                Ok(Step::Picture(picture)) => {
                    shown.push(picture.volume);
                    if shown.len() == 2 {
                        device.faults.inject(InjectionPoint::Submit, submission, ash::vk::Result::ERROR_DEVICE_LOST);
                    }
                }
                Ok(Step::End(why)) => break assert_eq!(why, None),
                Ok(_) => {}
                Err(live::StreamError::Gpu(error)) if error.is_device_lost() => {
                    lost += 1;
                    stream.revive(&other).expect("made anew");
                }
                Err(error) => panic!("{error}"),
            }
        }
        assert!(lost == 1 && shown.first() == Some(&0) && shown.last() == Some(&5), "{lost} lost, {shown:?}");
        let counts = stream.statistics().expect("statistics").volumes;
        assert_eq!(counts.shown + counts.dropped + counts.incomplete, 6, "{counts:?}");
        incomplete += counts.incomplete;
        last = Some((stream, other, device));
    }
    assert!(incomplete >= 1, "no frame was lost");
    let (mut stream, other, _device) = last.expect("four at least");
    // It may have been lost to a watchdog: from then on a software device draws pictures of 512 x 512 in bands too. A GPU has measured that
    // it needs none.
    let renderer = stream.renderer().expect("begun");
    let mut scene = renderer.scene().clone();
    scene.settings.picture.size = [512, 512];
    let large = Scene::new(scene.geometry, scene.input, scene.settings).expect("scene");
    let dispatched = renderer.dispatched_passes(|r| r.change(large).and_then(|_| r.picture())).expect("picture");
    let rays = dispatched.iter().filter(|name| **name == "raycast_projection").count();
    assert!(rays > 1 || !other.candidate.is_software(), "{dispatched:?}");
}

/// Prevents a stream that goes silent with a device that does not finish: whatever hangs, a picture, an upload or a pass over a frame, the
/// device is given up, and the next volumes are shown on another. What the hung device was to do is never waited for, also at the end.
#[test]
fn a_device_that_hangs_costs_a_volume_and_not_the_stream() {
    let other = Device::alone();
    for hangs_after in [0, 3] {
        let device = Device::impatient();
        let options = live::StreamOptions::default();
        let mut stream =
            stream(&device, events(header(0.3), (0..9).flat_map(stamped)), settings("mode = 'mip'"), options);
        let (mut shown, mut stalled) = (Vec::new(), 0);
        loop {
            match stream.step(Duration::from_millis(20)) {
                Ok(Step::Picture(picture)) => {
                    shown.push(picture.volume);
                    if shown.len() == 2 {
                        device.faults.hang(hangs_after);
                    }
                }
                Ok(Step::End(why)) => break assert_eq!(why, None),
                Ok(_) => {}
                Err(live::StreamError::Gpu(error)) if error.is_given_up() => {
                    stalled += 1;
                    assert!(error.to_string().contains("did not finish within 2 s"), "{error}");
                    stream.revive(&other).expect("made anew");
                }
                Err(error) => panic!("{error}"),
            }
        }
        assert!(stalled == 1 && shown.first() == Some(&0) && shown.last() == Some(&8), "{stalled} stalls, {shown:?}");
        assert!(device.is_given_up() && !other.is_given_up());
        let counts = stream.statistics().expect("statistics").volumes;
        assert_eq!(counts.shown + counts.dropped + counts.incomplete, 9, "{counts:?}");
    }
}

/// Prevents volumes that are never complete if some slices are outside the visible bounds and frames arrive line by line.
#[test]
fn missing_slices_outside_the_visible_bounds_do_not_make_a_volume_incomplete() {
    let device = Device::alone();
    let toml = "mode = 'mip'\nregion = { elevation = [-1, 1], depth = [30, 50] }";
    let lines = |frame: Frame| {
        let chunks: Vec<_> = frame.bytes.chunks(64 * 5).map(<[u8]>::to_vec).collect();
        let part = move |(n, bytes)| Event::Lines { frame: Frame { bytes, ..frame.clone() }, first: 5 * n };
        chunks.into_iter().enumerate().map(part).collect::<Vec<_>>()
    };
    let mut events = events(header(0.3), []);
    events.extend((0..3).flat_map(stamped).flat_map(lines));
    let mut stream = stream(&device, events, settings(toml), live::StreamOptions::default());
    let mut shown = Vec::new();
    let faults = run(&mut stream, |_, picture| shown.push(picture.volume));
    assert_eq!((faults, shown), (vec![], vec![0, 1, 2]));
    assert!(stream.renderer().expect("begun").skipped_frames() > 0, "all slices are seen");
}

/// Prevents slices of stage 1 from before and after a change from being shown together as one complete volume.
#[test]
fn settings_that_need_new_frames_show_complete_volumes_only() {
    let device = Device::alone();
    for (at, toml) in [(0, "slices.median = true"), (1, "slices.median = true"), (1, "slices.sigma = {}")] {
        let (before, after) = (settings("mode = 'mip'"), settings(&format!("mode = 'mip'\n{toml}")));
        let source = Told(events(header(0.0), (0..80).flat_map(speckled)).into(), Duration::from_millis(2), false);
        let mut stream = stream_of(&device, source, before, live::StreamOptions::default());
        let (mut pictures, mut frames, mut checked) = (0, 0, 0);
        // On a busy machine most volumes pass while one is drawn.
        while checked < 3 {
            match stream.step(Duration::from_millis(20)).expect("step") {
                Step::Picture(shown) => {
                    pictures += 1;
                    let scene = stream.scene().expect("begun").clone();
                    if scene.settings != after {
                        continue;
                    }
                    checked += 1;
                    let mut plain = Renderer::new(&device, scene, &RendererOptions::default()).expect("renderer");
                    let whole = speckled(shown.volume);
                    whole.iter().for_each(|f| plain.frame(f.slice as u32, &f.bytes, 0).expect("frame"));
                    plain.show(0).expect("show");
                    assert!(shown.picture == plain.picture().ok(), "{toml}: volume {}", shown.volume);
                }
                Step::End(_) => break,
                _ => frames += 1,
            }
            // In the middle of the first volume, and of one after a picture.
            if (pictures, frames) == (0, 5) && at == 0 || pictures == 1 && at == 1 && checked == 0 {
                stream.change(after.clone()).expect("change");
            }
        }
        assert!(checked > 0, "{toml}: {pictures} pictures, none after the change");
    }
}
