//! Time stamps against the host's clock, and counted invocations.

use crate::common::*;
use echolume::gpu::single::{Single, Timed};
use echolume::gpu::{Options, Renderer};
use echolume::passes::{Arrays, Slot, Texels, Turn, by_name};
use echolume::probe::Geometry;

/// Stamps from the submission's first to its last add up to the time from submission to idle: nothing is missing between them.
/// Both are on one clock, so the device's spans lie within the host's.
#[test]
fn stamps_add_up_to_the_time_from_submission_to_idle() {
    let device = Device::new();
    let toml = "mode = 'sr'\npicture = { size = [256, 256] }\nslices = { pixels = 96 }\nray = { step = 0.1 }\ndistance = { median = 9 }";
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    let frames = body_frames(&scene, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let options = Options { spans: true, ..Options::default() };
    let mut renderer = Renderer::new(&device, scene, &options).expect("renderer");
    // The first picture compiles shaders.
    send(&mut renderer, &frames, 0);
    renderer.picture().expect("picture");
    let mut shares = Vec::new();
    for _ in 0..5 {
        renderer.show(0).expect("show");
        renderer.take_spans().expect("spans");
        renderer.picture().expect("picture");
        let spans = renderer.take_spans().expect("spans");
        let of = |name: &str| spans.iter().find(|s| s.name == name && !s.on_device).expect("host span");
        let (submit, wait) = (of("submit"), of("wait"));
        let on_device: Vec<_> = spans.iter().filter(|s| s.on_device).collect();
        let stamped: f64 = on_device.iter().map(|s| s.end - s.begin).sum();
        shares.push(stamped / (wait.end - submit.begin));
        for pair in on_device.windows(2) {
            assert!((pair[1].begin - pair[0].end).abs() < 1e3, "a gap between {} and {}", pair[0].name, pair[1].name);
        }
        // The clocks are read one after the other: some microseconds apart.
        assert!(on_device[0].begin > submit.begin - 2e5 && on_device[on_device.len() - 1].end < wait.end + 2e5);
        for (name, size) in [("raycast_surface", 256 * 256), ("light", 256 * 256)] {
            let span = on_device.iter().find(|s| s.name == name).expect("pass");
            assert_eq!(span.invocations, Some(size), "{name}");
        }
        assert!(on_device.iter().any(|s| s.name == "readback" && s.invocations.is_none()));
    }
    shares.sort_by(f64::total_cmp);
    println!("stamps hold {shares:.4?} of the time from submission to idle");
    assert!((0.95..1.02).contains(&shares[2]), "{shares:?}");
}

/// What is timed is the work that was meant: every iteration, on the contents given, the same each time.
#[test]
fn a_timed_pass_works_on_the_contents_given() {
    // A device for each: synchronization validation does not see that the host waits for a timeline, so memory that one has
    // read back from and another then takes anew would look like a hazard.
    let devices: [Device; 5] = std::array::from_fn(|_| Device::new());
    let mut single = Single::new(&devices[0]).expect("single");
    let toml = "mode = 'mip'\npicture = { size = [37, 29] }\nslices = { pixels = 24 }\n\
                post = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 }, brightness = 0.1 }";
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    let mut noise = Noise(3);
    let mut picture = Texels::untouched([37, 29, 1], 4);
    picture.values.fill_with(|| noise.next());
    for (name, devices) in [("aos_picture", &devices[1..3]), ("tone", &devices[3..])] {
        let pass = by_name(name).expect("pass");
        let (first, last) = (Turn::default(), Turn { iteration: (pass.repeat)(&scene) - 1, ..Turn::default() });
        let (from, to) = ((pass.reads)(&scene, &first)[0], (pass.writes)(&scene, &last)[0]);
        let mut timed = Timed::new(&devices[0], &scene, pass, &[(from.slot, picture.clone())]).expect("timed");
        assert!(timed.run().expect("run").expect("time stamps") > 0.0, "{name}");
        let got = timed.read(to.slot).expect("read").expect("an image");

        // One dispatch after the other, each fed what those before it wrote.
        let mut slots: Vec<(Slot, Texels)> = vec![(from.slot, picture.clone())];
        for iteration in 0..=last.iteration {
            let turn = Turn { iteration, ..first };
            let mut inputs = Arrays::default();
            for bind in (pass.reads)(&scene, &turn) {
                let (_, texels) = slots.iter().find(|(s, _)| *s == bind.slot).expect("written before");
                inputs.insert(bind.name, texels.clone());
            }
            let outputs = single.run(&scene, pass, &turn, &inputs, 0.0).expect("dispatch");
            for bind in (pass.writes)(&scene, &turn) {
                slots.retain(|(s, _)| *s != bind.slot);
                slots.push((bind.slot, outputs.get(bind.name).clone()));
            }
        }
        let (_, expected) = slots.iter().find(|(s, _)| *s == to.slot).expect("written");
        assert!(got == *expected, "{name}: timed and single dispatches differ");
        let mut empty = Timed::new(&devices[1], &scene, pass, &[]).expect("timed");
        let zeros = empty.read(to.slot).expect("read").expect("an image");
        assert!(
            zeros != got && empty.read(Slot::Volume).expect("read").is_none(),
            "{name}: the contents do not matter"
        );
    }
}
