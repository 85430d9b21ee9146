//! The volume as a solid block: the values at the entry points of rays.

use crate::common::gpu::*;
use crate::planes::picture;
use echolume::low_level::probe::{Geometry, Grid};
use glam::DVec3;

/// The entry of a ray into the block by the slab method, and the field's value there.
#[test]
fn the_block_shows_a_linear_field_where_rays_enter_it() {
    let device = Device::new();
    let block = Geometry::Cartesian(Grid { size: [40, 50, 30], spacing: [0.5; 3], origin: [-10.0, 0.0, -7.0] });
    let slope = DVec3::new(0.011, 0.013, -0.017);
    let field = |p: DVec3| 0.35 + slope.dot(p);
    for view in ["azimuth = 30, elevation = -25", "azimuth = -150, elevation = 40, field_of_view = 50", "azimuth = 90"]
    {
        let toml = format!(
            "mode = 'cube'\npicture = {{ size = [61, 57] }}\ncamera = {{ {view} }}\nslices = {{ format = 'r32f' }}
             region = {{ lateral = [-9, 9], depth = [1, 24], elevation = [-6, 7] }}\nray = {{ sampling = 'exact' }}
             cube = {{ shading = 0, edges = false, inset = {{ left = 2, far = 3, top = 1.5 }} }}"
        );
        let scene = scene(block.clone(), FLOATS, &toml);
        let (low, high) = (DVec3::new(-7.0, 1.0, -6.0), DVec3::new(9.0, 21.0, 5.5));
        let frames = body_frames(&scene, field);
        let picture = picture(&mut rendered(&device, scene.clone(), &frames));
        let (mut seen, mut worst) = (0, 0.0f64);
        for (x, y) in (0..57).flat_map(|y| (0..61).map(move |x| (x, y))) {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            // No ray is parallel to a face except by rounding: then both quotients are infinite, with the right signs.
            let (a, b) = ((low - origin) / direction, (high - origin) / direction);
            let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
            let rgba = picture.get([x, y, 0]);
            if (leave - enter).abs() < 0.05 {
                continue;
            }
            assert_eq!(rgba[3] > 0.0, leave > enter, "{view}: at {x}, {y}");
            if leave > enter {
                seen += 1;
                worst = worst.max((rgba[0] - field(origin + direction * enter)).abs() / slope.length());
            }
        }
        println!("{view}: {seen} pixels, off by {worst:.4} mm");
        assert!(seen > 500 && worst < 0.04, "{view}: {seen} pixels, off by {worst} mm");
    }
}

/// The border of the sector is a face: without insets the far side of a curved array is part of a known surface. Lines and frames
/// bend the field by 0.05 mm, and beyond the border slice pixels of 0.1 mm hold the outermost samples.
#[test]
fn behind_an_empty_corner_the_block_shows_the_sectors_own_border() {
    let device = Device::new();
    let probe = wobbler();
    let toml = "mode = 'cube'\npicture = { size = [64, 64] }\ncamera = { azimuth = 180 }\nslices = { pixels = 800, format = 'r32f' }
                cube = { shading = 0, edges = false }\nray = { sampling = 'exact' }";
    let scene = scene(Geometry::Sweep(probe.clone()), FLOATS, toml);
    // Depth as grey: from behind, the picture is a relief of the far border.
    let frames = body_frames(&scene, |p| (p.y - 30.0) / 50.0);
    let picture = picture(&mut rendered(&device, scene.clone(), &frames));
    let (mut seen, mut worst) = (0, 0.0f64);
    for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        assert!(direction.distance(-DVec3::Y) < 1e-9);
        // (rho + a)^2 + x^2 = R^2 with rho = hypot(y - a, z), a the depth of the wobble axis.
        let radius = probe.last_range();
        let rho = (radius * radius - origin.x * origin.x).sqrt() - probe.axis_depth();
        let depth = probe.axis_depth() + (rho * rho - origin.z * origin.z).max(0.0).sqrt();
        let at = probe.to_indices(DVec3::new(origin.x, depth, origin.z));
        let well_inside = |v: f64, n: usize| v > 0.1 && v < (n - 1) as f64 - 0.1;
        if well_inside(at.line, probe.lines.len()) && well_inside(at.slice, probe.slices.len()) {
            seen += 1;
            worst = worst.max((picture.one(x, y, 0) * 50.0 + 30.0 - depth).abs());
        }
    }
    println!("{seen} pixels of the far border, off by {worst:.4} mm");
    assert!(seen > 300 && worst < 0.12, "{seen} pixels, off by {worst} mm");
}

/// The brightness of a face depends on its angle to the view, and lines are only where two faces meet.
#[test]
fn faces_are_shaded_by_their_angle_and_meet_in_lines() {
    let device = Device::new();
    let block = Geometry::Cartesian(Grid { size: [20, 20, 20], spacing: [1.0; 3], origin: [0.0; 3] });
    for (tilt, turned) in [(0.0f64, 30.0f64), (15.0, 45.0)] {
        let toml = format!(
            "mode = 'cube'\npicture = {{ size = [80, 60] }}\ncamera = {{ azimuth = 30 }}
             cube = {{ shading = 0.5, tilt = {{ near = [0, {tilt}] }} }}"
        );
        let scene = scene(block.clone(), FLOATS, &toml);
        let frames = frames(&scene, |_| 1.0);
        let picture = picture(&mut rendered(&device, scene, &frames));
        // The view is towards +lateral: the near face is visible, and the left one next to it.
        let shaded = |cos: f64| 1.0 - 0.5 * (1.0 - cos);
        // Half of a tilted face cuts; in front of the other half the side of the block remains.
        let greys = [turned, 60.0, 30.0].map(|angle| shaded(angle.to_radians().cos()));
        let (mut faces, mut lines) = ([0, 0, 0], 0);
        for x in 0..80 {
            let rgba = picture.get([x, 30, 0]);
            let face = greys.iter().position(|grey| (rgba[0] - grey).abs() < 1e-3 && rgba[0] == rgba[2]);
            match face {
                _ if rgba[3] == 0.0 => {}
                Some(face) => faces[face] += 1,
                None => {
                    assert!(rgba[2] > rgba[0], "a line is bluish: {rgba:?}");
                    lines += 1;
                }
            }
        }
        println!("tilt {tilt}: {faces:?} pixels of the near face, the left one and the near side, {lines} of lines");
        assert!(faces[0] > 10 && faces[1] > 5 && (faces[2] > 10) == (tilt > 0.0), "{faces:?}");
        // Lines between faces are drawn from both sides, the two at the outline from one.
        let most = if tilt > 0.0 { 12 } else { 9 };
        assert!((4..=most).contains(&lines), "{lines}");
    }
}
