//! Passes that are timed separately. Time stamps of complete pictures are checked by `echolume verify`.

use crate::common::gpu::*;
use echolume::low_level::gpu::pass_runner::{PassRunner, PassTimer};
use echolume::low_level::gpu::{Renderer, RendererOptions, TimeStamps};
use echolume::low_level::passes::{Arrays, DispatchArgs, Frequency, Slot, Texels, by_name};
use echolume::low_level::probe::Geometry;
use echolume::low_level::queues::oracle::Event;

/// The timed work is the intended work: every iteration, on the given contents, the same each time.
#[test]
fn a_timed_pass_works_on_the_contents_given() {
    // A device for each: synchronization validation ignores that the host waits for a timeline, so memory that one has
    // read back and another one then reuses would look like a hazard.
    let devices: [Device; 5] = std::array::from_fn(|_| Device::alone());
    let mut single = PassRunner::new(&devices[0]).expect("single");
    let toml = "mode = 'mip'\npicture = { size = [37, 29] }\nslices = { pixels = 24 }\n\
                post = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 }, brightness = 0.1 }";
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    let mut noise = Noise(3);
    let mut picture = Texels::untouched([37, 29, 1], 4);
    picture.values.fill_with(|| noise.next());
    for (name, devices) in [("aos_picture", &devices[1..3]), ("tone", &devices[3..])] {
        let pass = by_name(name).expect("pass");
        let (first, last) =
            (DispatchArgs::default(), DispatchArgs { iteration: (pass.repeat)(&scene) - 1, ..DispatchArgs::default() });
        let (from, to) = (pass.reads(&scene, &first)[0], pass.writes(&scene, &last)[0]);
        let mut timed = PassTimer::new(&devices[0], &scene, pass, &[(from.slot, picture.clone())]).expect("timed");
        assert!(timed.run().expect("run").expect("time stamps") > 0.0, "{name}");
        let got = timed.read(to.slot).expect("read").expect("an image");

        // One dispatch after the other, each on the results of those before it.
        let mut slots: Vec<(Slot, Texels)> = vec![(from.slot, picture.clone())];
        for iteration in 0..=last.iteration {
            let args = DispatchArgs { iteration, ..first };
            let mut inputs = Arrays::default();
            for bind in pass.reads(&scene, &args) {
                let (_, texels) = slots.iter().find(|(s, _)| *s == bind.slot).expect("written before");
                inputs.insert(bind.name, texels.clone());
            }
            let outputs = single.run(&scene, pass, &args, &inputs, 0.0).expect("dispatch");
            for bind in pass.writes(&scene, &args) {
                slots.retain(|(s, _)| *s != bind.slot);
                slots.push((bind.slot, outputs.get(bind.name).clone()));
            }
        }
        let (_, expected) = slots.iter().find(|(s, _)| *s == to.slot).expect("written");
        assert!(got == *expected, "{name}: timed and single dispatches differ");
        let mut empty = PassTimer::new(&devices[1], &scene, pass, &[]).expect("timed");
        let zeros = empty.read(to.slot).expect("read").expect("an image");
        assert!(
            zeros != got && empty.read(Slot::Volume).expect("read").is_none(),
            "{name}: the contents do not matter"
        );
    }
}

/// A surface with shadow and ambient occlusion: two passes that no barrier separates unless they are timed.
fn timed(device: &Device, time_stamps: TimeStamps) -> Renderer {
    let toml = "mode = 'sr'\npicture = { size = [40, 52] }\nslices = { pixels = 40, median = true }\n\
                distance = { median = 3 }\nlight = { shadow = {}, occlusion = {} }";
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    let frames = body_frames(&scene, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let options =
        RendererOptions { time_stamps, log: true, frames_at_once: Some(u32::MAX), ..RendererOptions::default() };
    let mut renderer = Renderer::new(device, scene, &options).expect("renderer");
    send(&mut renderer, &frames, 0);
    renderer.picture().expect("picture");
    renderer
}

/// Prevents times of passes that overlap: between any two stamped pieces of work there is an execution barrier, and before the first.
#[test]
fn passes_that_are_timed_do_not_overlap() {
    let device = Device::alone();
    let mut renderer = timed(&device, TimeStamps::EachPass);
    let log = renderer.log().expect("log");
    let mut stamps = 0;
    for (n, submission) in log.submissions.iter().enumerate() {
        let mut is_serial = false;
        for event in &submission.events {
            match event {
                Event::Serialize => is_serial = true,
                Event::Operation(_) => {
                    let touched = |slot| format!("{event:?}").contains(slot);
                    // What only makes results visible to the host, or clears new images, is not timed.
                    let is_timed = submission.events.iter().filter(|e| **e == Event::Stamp).count() > 1;
                    assert!(is_serial || !is_timed || touched("Readback"), "submission {n}: {event:?}");
                    is_serial = false;
                }
                Event::Stamp => stamps += 1,
                Event::Barrier(_) => {}
            }
        }
    }
    let times = renderer.take_times().expect("times");
    let steps = renderer.plan().steps.iter().map(|s| s.pass.name);
    for name in steps.chain(["upload", "readback"]) {
        assert!(times.iter().any(|t| t.name == name && t.total > 0.0), "{name} has no time");
    }
    let runs: u32 = times.iter().map(|t| t.runs).sum();
    // A stamp is of all frames of a batch.
    let further = renderer.scene().visible_frames().len() - 1;
    let shared = further * (1 + renderer.plan().steps_of(Frequency::Frame).count());
    // Each recording begins with one more.
    let recordings = renderer.log().expect("log").submissions.len() as u32;
    assert_eq!(stamps, runs - shared as u32 + recordings);
}

/// Prevents stamps and barriers that slow down a live picture: two stamps a submission, at its ends, and nothing that serializes.
#[test]
fn a_live_picture_has_two_stamps_a_command_buffer() {
    let device = Device::alone();
    let mut renderer = timed(&device, TimeStamps::Ends);
    for (n, submission) in renderer.log().expect("log").submissions.iter().enumerate() {
        let events = &submission.events;
        let stamps = events.iter().filter(|e| **e == Event::Stamp).count();
        assert_eq!(stamps, 2, "submission {n}");
        assert_eq!([events.first(), events.last()], [Some(&Event::Stamp); 2], "submission {n}");
        assert!(!events.contains(&Event::Serialize), "submission {n}");
    }
    let times = renderer.take_times().expect("times");
    let names: Vec<_> = times.iter().map(|t| t.name).collect();
    assert!(
        names.iter().all(|name| ["picture", "frame", "copy"].contains(name)) && names.contains(&"frame"),
        "{names:?}"
    );
    // The last submission of each recorder is always timed.
    assert!(times.iter().any(|t| t.name == "picture" && t.total > 0.0), "{times:?}");
    let mut untimed = timed(&device, TimeStamps::None);
    assert!(untimed.take_times().expect("times").is_empty());
    assert!(untimed.log().expect("log").submissions.iter().all(|s| !s.events.contains(&Event::Stamp)));
}
