//! Passes that are timed separately. Time stamps of complete pictures are checked by `echolume verify`.

use crate::common::gpu::*;
use echolume::gpu::pass_runner::{PassRunner, PassTimer};
use echolume::passes::{Arrays, DispatchArgs, Slot, Texels, by_name};
use echolume::probe::Geometry;

/// The timed work is the intended work: every iteration, on the given contents, the same each time.
#[test]
fn a_timed_pass_works_on_the_contents_given() {
    // A device for each: synchronization validation ignores that the host waits for a timeline, so memory that one has
    // read back and another one then reuses would look like a hazard.
    let devices: [Device; 5] = std::array::from_fn(|_| Device::new());
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
