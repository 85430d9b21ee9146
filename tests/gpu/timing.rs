//! Time stamps against the host's clock, and counted invocations.

use crate::common::*;
use echolume::gpu::{Options, Renderer};
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
