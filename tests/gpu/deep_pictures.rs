//! Pictures as a window stores them: of 10 bits a channel more levels, of another order of the channels the same values; and the same picture wherever 8 bits
//! are asked for.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Scene, WindowTexels};
use std::collections::BTreeSet;

/// A picture, what the window takes of it, and the format of that.
fn drawn(device: &Device, scene: &Scene, frames: &[Texels], readback: bool) -> (Picture, Texels, Format) {
    let options = RendererOptions { readback, ..RendererOptions::default() };
    let mut renderer = Renderer::new(device, scene.clone(), &options).expect("renderer");
    send(&mut renderer, frames, 0);
    let picture = renderer.picture().expect("picture");
    let stored = Slot::Screen.format(renderer.scene());
    (picture, renderer.read(Slot::Screen).expect("read").expect("an image"), stored)
}

/// Prevents a deep window that shows pictures of 256 levels, and saved pictures that differ because of it.
#[test]
fn a_deep_window_gets_more_levels_and_files_the_same_picture() {
    // Another test must not get the deep one.
    let (plain, deep) = (Device::new(), Device::alone());
    *deep.window_texels.lock().expect("no panic") = WindowTexels::Deep;
    let toml = "mode = 'mip'\npicture = { size = [64, 48] }\nslices = { pixels = 64, format = 'r32f' }";
    let scene = scene(Geometry::Sweep(wobbler()), FLOATS, toml);
    let frames = body_frames(&scene, |p| (0.3 + 0.004 * p.x + 0.0007 * p.y).clamp(0.0, 1.0));
    for readback in [true, false] {
        let drawn = |device: &Device| {
            let (picture, screen, _) = drawn(device, &scene, &frames, readback);
            let levels: BTreeSet<u64> = screen.values.chunks_exact(4).map(|c| c[0].to_bits()).collect();
            (picture, levels.len())
        };
        let ((usual, levels), (same, more)) = (drawn(&plain), drawn(&deep));
        assert!(levels > 20 && more > 2 * levels, "{levels} levels in 8 bits, {more} for a deep window");
        // Half-way values, rounded twice, may be off by a level.
        assert!(difference(&usual, &same).1 <= 1.0);
        assert_eq!(usual.rgba.len(), same.rgba.len());
    }
}

/// Prevents red and blue that change places in what is saved, measured or shown of a window that stores blue first.
#[test]
fn a_window_that_stores_blue_first_gets_the_same_picture() {
    let (plain, swapped) = (Device::new(), Device::alone());
    *swapped.window_texels.lock().expect("no panic") = WindowTexels::Bgra8;
    let mut coloured = 0;
    for toml in [
        "mode = 'volume'\nlight = { colour = [1.0, 0.6, 0.2] }",
        "mode = 'surface'",
        "mode = 'orthogonal'",
        "mode = 'surface'\nlayout = '4up'",
        "mode = 'volume'\nray = { subsampling = 8 }",
    ] {
        let toml = format!("{toml}\npicture = {{ size = [90, 64] }}\nslices = {{ pixels = 64 }}");
        let scene = scene(Geometry::Sweep(wobbler()), FLOATS, &toml);
        let frames = body_frames(&scene, |p| (0.3 + 0.004 * p.x + 0.0007 * p.y).clamp(0.0, 1.0));
        for readback in [true, false] {
            let drawn = |device: &Device| drawn(device, &scene, &frames, readback);
            let ((usual, values, format), (same, same_values, other)) = (drawn(&plain), drawn(&swapped));
            assert_ne!(format, other, "{toml}: the order of the window");
            assert_eq!(usual.rgba, same.rgba, "{toml}");
            assert!(values == same_values, "{toml}");
            coloured += u32::from(usual.rgba.chunks_exact(4).any(|p| p[0] != p[2]));
        }
    }
    assert!(coloured >= 4, "{coloured} pictures have colours: grey shows no order");
}
