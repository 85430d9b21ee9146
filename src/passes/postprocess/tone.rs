//! Contrast, brightness, gamma and colour map; the picture in 8 bits.

use crate::passes::chain::picture_end;
use crate::passes::*;
use crate::scene::{ColourMap, Scene, transfer};

pub const PASS: Pass = Pass {
    name: "tone",
    stage: Stage::Postprocess,
    when: When::Picture,
    shader: |_, _| "postprocess/tone",
    needed: |_| Ok("every picture ends in 8 bits"),
    reads: |s, _| vec![whole("picture", picture_end(s))],
    writes: |_, _| vec![whole("screen", Slot::Screen)],
    extent: picture_extent,
    repeat: once,
    params: |s, _| {
        let post = &s.settings.post;
        let [a, b, c, d, e] = transfer::colour_map(post.colour_map);
        Params::default()
            .f32("brightness", post.brightness)
            .f32("contrast", post.contrast)
            .f32("exponent", 1.0 / post.gamma)
            .vec3("map_0", a)
            .vec3("map_1", b)
            .vec3("map_2", c)
            .vec3("map_3", d)
            .vec3("map_4", e)
    },
    constants: |s, _| vec![("COLOUR_MAP", (s.settings.post.colour_map != ColourMap::None) as i32)],
    tolerance: Tolerance {
        absolute: 1.01 / 255.0,
        relative: 0.0,
        outliers: 0.0,
        why: "a value half-way between two levels may be stored as either",
    },
    reference: |scene, _, reads, writes| {
        let picture = reads.get("picture");
        let screen = writes.get_mut("screen");
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                let rgba = picture.get([x, y, 0]);
                let colour = if rgba[3] > 0.0 { toned(scene, [rgba[0], rgba[1], rgba[2]]) } else { [0.0; 3] };
                screen.set([x, y, 0], &[colour[0], colour[1], colour[2], 1.0]);
            }
        }
    },
};

fn toned(scene: &Scene, colour: [f64; 3]) -> [f64; 3] {
    let post = &scene.settings.post;
    let toned = colour.map(|c| {
        let c = (c - 0.5) * post.contrast + 0.5 + post.brightness;
        c.clamp(0.0, 1.0).powf(1.0 / post.gamma)
    });
    if post.colour_map == ColourMap::None {
        return toned;
    }
    let map = transfer::colour_map(post.colour_map);
    let grey = (0.2126 * toned[0] + 0.7152 * toned[1] + 0.0722 * toned[2]) * 4.0;
    let n = (grey.floor() as usize).min(3);
    std::array::from_fn(|c| map[n][c] + (map[n + 1][c] - map[n][c]) * (grey - n as f64))
}
