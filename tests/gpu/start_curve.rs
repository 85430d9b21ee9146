//! The curved render start: what it removes, texel by texel, and that renderings are those of a volume which was cut the same way before it came.

use crate::common::gpu::*;
use echolume::low_level::passes::Slot;
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{Scene, insonified_box};
use glam::DVec3;

fn of(geometry: &Geometry, toml: &str) -> Scene {
    let toml = format!(
        "{toml}\nslices.pixels = 72\npicture.size = [48, 44]\nray.sampling = 'exact'\n\
         volume.transfer = [{{ at = 0.4, colour = [0.5, 0.4, 0.3], opacity = 0 }}, {{ at = 0.7, colour = [1, 0.9, 0.8], opacity = 0.5 }}]"
    );
    scene(geometry.clone(), BYTES, &toml)
}

/// An arc across the volume: a parabola, whose depth this gives at any place in space, and its points.
fn arc(geometry: &Geometry) -> (impl Fn(f64) -> f64 + use<>, String) {
    let scene = of(geometry, "mode = 'vr'");
    let (low, high) = insonified_box(geometry);
    let offset = scene.place_of([0.0; 3]).y;
    let (half, middle) = (0.4 * (high.x - low.x), (low.x + high.x) / 2.0);
    let [end, deepest] = [0.3, 0.55].map(|share| low.y + share * (high.y - low.y));
    let [left, right] = [middle - half, middle + half];
    let points = [[left, end], [middle, deepest], [right, end]].map(|[x, y]| format!("[{x:?}, {:?}]", y - offset));
    let depth = move |x: f64| deepest - (deepest - end) * ((x.clamp(left, right) - middle) / half).powi(2);
    (depth, format!("region.start_curve = [{}]", points.join(", ")))
}

/// In f64, from the formula of the arc: what is nearer to the probe is gone and everything else is as it was, in every geometry; of the curve and
/// the fluid the deeper start counts, and cuts come on top. Planes keep all of it.
#[test]
fn the_device_removes_what_is_in_front_of_the_curve() {
    let device = Device::new();
    let mut deeper = [0, 0];
    for (name, geometry) in geometries().into_iter().filter(|(name, _)| *name != "single frame") {
        let (depth, curve) = arc(&geometry);
        for (mode, removed) in [
            ("mode = 'vr'\nlayout = 'four'", 0.0),
            ("mode = 'mean'\nunveil = { enabled = true, smoothing = 1, offset = 0.5 }", 0.0),
            ("mode = 'minip'\ncuts = [{ contour = [[-2, -2], [2, -2], [0, 2]] }]", 1.0),
        ] {
            let on = of(&geometry, &format!("{mode}\n{curve}"));
            let frames = body_frames(&on, layers(&on));
            let mut renderer = rendered(&device, on.clone(), &frames);
            let picture = renderer.picture().expect("picture");
            let [volume, cut] =
                [Slot::Volume, Slot::CutVolume].map(|slot| renderer.read(slot).expect("read").expect("a volume"));
            let surface = renderer.read(Slot::StartSurface).expect("read");
            let cuts: Vec<_> = on.cuts().collect();
            let mut gone = 0;
            for (n, (before, after)) in volume.values.iter().zip(&cut.values).enumerate() {
                let (x, y) = (n % volume.size[0], n / volume.size[0] % volume.size[1]);
                let z = n / volume.size[0] / volume.size[1];
                let place = on.texel_place([x as u32, y as u32, z as u32]);
                let by_curve = place.y < depth(place.x);
                let by_surface = surface.as_ref().is_some_and(|rows| (y as f64) < rows.one(x, z, 0));
                let is_removed = by_curve || by_surface || cuts.iter().any(|cut| cut.removes(place));
                assert_eq!(*after, if is_removed { removed } else { *before }, "{name}, {mode}: texel {x} {y} {z}");
                gone += usize::from(is_removed);
                if surface.is_some() {
                    deeper[0] += usize::from(by_curve && !by_surface);
                    deeper[1] += usize::from(by_surface && !by_curve);
                }
            }
            assert!((0.1..0.9).contains(&(gone as f64 / volume.values.len() as f64)), "{name}, {mode}: {gone}");
            if mode.contains("four") {
                let whole = rendered(&device, of(&geometry, mode), &frames).picture().expect("picture");
                let [width, height] = [picture.width as usize, picture.height as usize];
                let is_rendering = |n: usize| n % width >= width / 2 && n / width >= height / 2;
                let differs = |n: &usize| picture.rgba[4 * n..4 * n + 4] != whole.rgba[4 * n..4 * n + 4];
                let (rendering, planes): (Vec<usize>, Vec<usize>) =
                    (0..width * height).filter(differs).partition(|n| is_rendering(*n));
                assert!(!rendering.is_empty() && planes.is_empty(), "{name}: {} {}", rendering.len(), planes.len());
            }
        }
    }
    assert!(deeper.iter().all(|texels| *texels > 100), "{deeper:?}");
}

/// Every mode with and without empty-space skipping: to the last bit the picture of samples that were cut before they came. A curve that moves needs no
/// frame again, and without it everything is back.
#[test]
fn a_rendering_is_that_of_a_volume_which_was_cut_before() {
    let device = Device::new();
    let geometry =
        Geometry::Cartesian(Grid { size: [34, 33, 32], spacing: [0.5, 0.6, 0.55], origin: [-8.3, 0.4, -8.5] });
    let (depth, curve) = arc(&geometry);
    let flat = "region.start_curve = [[-8, 5], [0, 5], [4, 5], [8, 5]]";
    for (mode, removed) in [
        ("mode = 'vr'\nlight.volume = {}", 0.0),
        ("mode = 'sr'\nsurface.edge = 1.5", 0.0),
        ("mode = 'mixed'\nsurface.edge = 1.5", 0.0),
        ("mode = 'mip'", 0.0),
        ("mode = 'minip'", 1.0),
    ] {
        for view in ["ray.brick = 0", "ray.brick = 4\ncamera = { azimuth = 50, elevation = -20 }"] {
            let case = format!("{mode}\n{view}");
            let whole = of(&geometry, &case);
            // The wall is the brightest, so that the largest echoes miss it too.
            let of_layers = layers(&whole);
            let body = |p: DVec3| if of_layers(p) == 0.6 { 0.9 } else { of_layers(p) };
            let frames = body_frames(&whole, body);
            let before = body_frames(&whole, |p| if p.y < depth(p.x) { removed } else { body(p) });
            let mut renderer = rendered(&device, of(&geometry, &format!("{case}\n{curve}")), &frames);
            let cut = renderer.picture().expect("picture");
            assert!(cut == rendered(&device, whole.clone(), &before).picture().expect("picture"), "{case}");
            let plain = rendered(&device, whole.clone(), &frames).picture().expect("picture");
            // The smallest echoes are those of the fluid, which reaches below the curve.
            assert!(cut != plain || mode.contains("minip"), "{case}");
            let change = renderer.change(of(&geometry, &format!("{case}\n{flat}"))).expect("change");
            assert!(matches!(change, Rerun::Steps { .. }), "{case}: {change:?}");
            let level = body_frames(&whole, |p| if p.y < 5.0 { removed } else { body(p) });
            let moved = renderer.picture().expect("picture");
            assert!(moved == rendered(&device, whole.clone(), &level).picture().expect("picture"), "{case}: level");
            renderer.change(whole).expect("change");
            send(&mut renderer, &frames, 0);
            assert!(renderer.picture().expect("picture") == plain, "{case}: without");
        }
    }
}
