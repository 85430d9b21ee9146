//! The picture from the rendering: the mean of several rays per pixel, or interpolation between the rays where one ray makes
//! four pixels; in a 4-up picture, the rendering next to the planes.

use crate::passes::pass::*;
use crate::scene::Layout;

pub const PASS: Pass = Pass {
    name: "assemble",
    stage: Stage::Postprocess,
    frequency: Frequency::Picture,
    link: Link::None,
    shader: |s, _| match s.settings.layout {
        Layout::Single => "postprocess/assemble.alone",
        Layout::Four => "postprocess/assemble.four",
    },
    needed: |s| match (rendered(s), s.settings.layout) {
        (Slot::Picture, _) => Err("one ray makes a pixel of the whole picture"),
        (_, Layout::Four) => Ok("the rendering stands beside three planes"),
        (_, Layout::Single) if s.settings.ray.half => Ok("one ray makes four pixels"),
        (_, Layout::Single) => Ok("several rays make a pixel"),
    },
    reads: |s, _| {
        let mut reads = vec![whole("rendered", Slot::Rendered)];
        reads.extend((s.settings.layout == Layout::Four).then_some(whole("planes", Slot::Planes)));
        reads
    },
    writes: |_, _| vec![whole("picture", Slot::Picture)],
    extent: picture_extent,
    repeat: once,
    params: |_, _| Params::default(),
    constants: |s, _| vec![("RAYS", s.settings.ray.rays as i32), ("HALF", s.settings.ray.half as i32)],
    tolerance: Tolerance {
        absolute: 1e-3,
        relative: 0.0,
        outliers: 0.0,
        why: "a mean of at most 16 colours in f32; R16F stores 1 to 4.9e-4",
    },
    reference: |scene, _, reads, writes| {
        let rendered = reads.get("rendered");
        let picture = writes.get_mut("picture");
        let rays = scene.settings.ray.rays as usize;
        let corner = match scene.settings.layout {
            Layout::Single => [0, 0],
            // The lower right tile.
            Layout::Four => [picture.size[0] / 2, picture.size[1] / 2],
        };
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                if x < corner[0] || y < corner[1] {
                    let plane = reads.get("planes").get([x, y, 0]).to_vec();
                    picture.set([x, y, 0], &plane);
                    continue;
                }
                if scene.settings.ray.half {
                    picture.set([x, y, 0], &between(rendered, x - corner[0], y - corner[1]));
                    continue;
                }
                let mut mean = [0.0; 4];
                for (i, j) in (0..rays * rays).map(|n| (n % rays, n / rays)) {
                    let ray = rendered.get([(x - corner[0]) * rays + i, (y - corner[1]) * rays + j, 0]);
                    mean.iter_mut().zip(ray).for_each(|(m, v)| *m += v / (rays * rays) as f64);
                }
                picture.set([x, y, 0], &mean);
            }
        }
    },
};

/// Linear interpolation between the rays around a pixel. Ray i goes through the common corner of pixels 2 i and 2 i + 1. Beyond
/// the outermost ray its value repeats.
fn between(rendered: &Texels, x: usize, y: usize) -> [f64; 4] {
    let along = |pixel: usize, rays: usize| {
        let at = ((pixel as f64 - 0.5) / 2.0).clamp(0.0, (rays - 1) as f64);
        let low = at.floor() as usize;
        (low, (low + 1).min(rays - 1), at - at.floor())
    };
    let ((x0, x1, u), (y0, y1, v)) = (along(x, rendered.size[0]), along(y, rendered.size[1]));
    std::array::from_fn(|c| {
        let at = |x, y| rendered.get([x, y, 0])[c];
        (1.0 - v) * ((1.0 - u) * at(x0, y0) + u * at(x1, y0)) + v * ((1.0 - u) * at(x0, y1) + u * at(x1, y1))
    })
}
