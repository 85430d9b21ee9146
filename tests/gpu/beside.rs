//! A rendering with three planes beside it is the rendering alone and the planes of a 4-up picture, each in its place.

use crate::common::gpu::*;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Geometry;
use glam::DVec3;

/// Tissue with a wavy face, and two bodies in it.
fn body(p: DVec3) -> f64 {
    let wall = p.y - 36.0 + 3.0 * (0.4 * p.x).sin() + 2.0 * (0.3 * p.z).cos();
    let bodies = (p - DVec3::new(4.0, 40.0, 1.0)).length().min((p - DVec3::new(-6.0, 44.0, -2.0)).length()) - 3.0;
    if bodies < 0.0 {
        0.9
    } else if wall > 0.0 {
        0.5 + 0.1 * (0.9 * p.x).sin()
    } else {
        0.1
    }
}

fn drawn(device: &Device, layout: &str, [look, planes]: [&str; 2], [width, height]: [u32; 2]) -> Picture {
    let toml = format!(
        "layout = '{layout}'\n{look}\npicture.size = [{width}, {height}]\nplanes = {{ azimuth = 20, position = [1, 38, 0]{planes} }}\n\
         camera = {{ azimuth = 15, elevation = -10, zoom = 2 }}\nslices.pixels = 64"
    );
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, &toml);
    let frames = body_frames(&scene, body);
    rendered(device, scene, &frames).picture().expect("picture")
}

fn part(picture: &Picture, [left, top]: [u32; 2], [width, height]: [u32; 2]) -> Vec<u8> {
    let row = |y: u32| &picture.rgba[4 * (y * picture.width + left) as usize..][..4 * width as usize];
    (top..top + height).flat_map(|y| row(y).iter().copied()).collect()
}

#[test]
fn it_is_the_rendering_alone_and_the_planes_of_a_4_up_picture() {
    let device = Device::new();
    // The size of the picture, that of the rendering, and the corners of the planes, three of 48 x 33 in a column and of 33 x 48 in a row.
    let wide = ([128, 99], [80, 99], [48, 33], [[80, 0], [80, 33], [80, 66]]);
    let high = ([99, 128], [99, 80], [33, 48], [[0, 80], [33, 80], [66, 80]]);
    for look in [
        ["mode = 'sr'\nsurface.threshold = 0.15", ""],
        ["mode = 'sr'\nsurface.threshold = 0.15\nray.subsampling = 2", ", lines = false"],
        ["mode = 'sr'\nsurface.threshold = 0.15\nray.subsampling = 8\npost = { sigma = {}, gamma = 1.4 }", ""],
        ["mode = 'vr'\nclip = [{ at = [0, 40, 0], normal = [0.4, -1, 0.2] }]\nray.subsampling = 4", ""],
        ["mode = 'vr'\nray.rays = 2\npost = { contrast = 1.3, colour_map = 'skin' }", ""],
        ["mode = 'vr'\nray = { rays = 3, adaptive = true }\npost.perona_malik = {}", ""],
        ["mode = 'mip'\npost.floats = true", ", thickness = 2.5"],
        ["mode = 'mixed'\nsurface.threshold = 0.15", ", smooth = { lateral = 1, depth = 1, elevation = 0.5 }"],
    ] {
        for (size, rendering, tile, corners) in [wide, high] {
            let beside = drawn(&device, "beside", look, size);
            let alone = drawn(&device, "single", look, rendering);
            let four = drawn(&device, "four", look, tile.map(|n| 2 * n));
            let look = look.concat();
            // Filters of the whole picture reach over the border between its parts.
            let is_filtered = look.contains("sigma") || look.contains("perona_malik");
            let differing = |a: Vec<u8>, b: Vec<u8>| a.iter().zip(&b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
            let bound = |pixels: [u32; 2]| if is_filtered { 40 * (pixels[0] + pixels[1]) as usize } else { 0 };
            let seen = part(&beside, [0, 0], rendering);
            let lit = seen.chunks(4).filter(|c| c[0] > 20).count();
            assert!(lit > 150, "{look}: {lit} lit pixels of the rendering");
            let count = differing(seen, alone.rgba.clone());
            assert!(count <= bound(rendering), "{look}, {size:?}: {count} of the rendering");
            for (corner, of_four) in corners.into_iter().zip([[0, 0], [tile[0], 0], [0, tile[1]]]) {
                let shown = part(&beside, corner, tile);
                assert!(
                    shown.chunks(4).filter(|c| c[0] > 20).count() > 100,
                    "{look}: the plane at {corner:?} shows nothing"
                );
                let count = differing(shown, part(&four, of_four, tile));
                assert!(count <= bound(tile), "{look}, {size:?}: {count} of the plane at {corner:?}");
            }
        }
    }
}
