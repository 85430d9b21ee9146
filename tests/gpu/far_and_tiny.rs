//! Cartesian volumes far from the origin, and with voxels from a nanometre to a hundred metres: their pictures are those of the same
//! volume at the origin, with voxels of 1 mm.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;

const SIZE: [usize; 3] = [26, 22, 24];

/// A place in space of a place in voxels.
#[derive(Clone, Copy)]
struct Placed {
    spacing: f64,
    origin: [f64; 3],
}

impl Placed {
    fn at(self, voxels: [f64; 3]) -> String {
        let place: [f64; 3] = std::array::from_fn(|a| self.origin[a] + self.spacing * voxels[a]);
        format!("[{:?}, {:?}, {:?}]", place[0], place[1], place[2])
    }

    fn scene(self, toml: &str) -> Scene {
        let grid = Grid { size: SIZE, spacing: [self.spacing; 3], origin: self.origin };
        let toml = format!(
            "picture = {{ size = [40, 36] }}\nslices = {{ format = 'r16' }}\n{toml}\n[post]\nfloats = true\n[ray]\nearly_end = 0.0"
        );
        scene(Geometry::Cartesian(grid), BYTES, &toml)
    }
}

/// Tissue that changes by up to 0.15 a voxel, in fluid: a surface to detect, and structure in each plane.
fn tissue([x, y, z]: [usize; 3]) -> f64 {
    let [x, y, z] = [x as f64 - 12.0, y as f64 - 11.0, z as f64 - 12.0];
    let depth = 8.0 - (x * x + 1.3 * y * y + z * z).sqrt();
    let inside = 1.0 / (1.0 + (-1.2 * depth).exp());
    inside * (0.6 + 0.2 * (0.7 * x).sin() * (0.5 * z + 0.3 * y).cos())
}

/// Scenes of every mode whose lengths, in voxels, are written at a place.
fn modes(p: Placed) -> Vec<(&'static str, String)> {
    let s = p.spacing;
    let oblique = "camera = { azimuth = 25, elevation = 35 }";
    let near = format!(
        "camera = {{ azimuth = 200, elevation = 15, field_of_view = 40, target = {} }}",
        p.at([12.0, 10.0, 11.0])
    );
    let clip = format!("clip = [{{ at = {}, normal = [0.3, 1.0, -0.2] }}]", p.at([12.0, 15.0, 12.0]));
    let region = |low: f64, high: f64| {
        format!("region = {{ elevation = [{:?}, {:?}] }}", p.origin[2] + low * s, p.origin[2] + high * s)
    };
    let light = format!("[light]\ncliff = {:?}\nposition = [{:?}, {:?}, {:?}]", 2.0 * s, 10.0 * s, 15.0 * s, 30.0 * s);
    vec![
        ("mip", format!("mode = 'mip'\n{oblique}\n{}", region(2.0, 20.5))),
        ("mip, near", format!("mode = 'mip'\n{near}")),
        ("vr", format!("mode = 'vr'\n{oblique}\n{clip}")),
        (
            "vr, coded by depth, pre-integrated",
            format!("mode = 'vr'\n{near}\n[volume]\nshading = 'depth-coded'\ncompositing = 'pre-integrated'"),
        ),
        ("vr, lit", format!("mode = 'vr'\n{oblique}\n{light}\n[volume]\nshading = 'first-hit'")),
        ("sr", format!("mode = 'sr'\n{oblique}\n{light}")),
        ("sr, near", format!("mode = 'sr'\n{near}\n{light}")),
        (
            "plane",
            format!(
                "mode = 'plane'\n{clip}\n[planes]\nposition = {}\nazimuth = 20\ntilt = 30",
                p.at([12.0, 11.0, 13.0])
            ),
        ),
        ("orthogonal, a slab", format!("mode = 'orthogonal'\n[planes]\nthickness = {:?}", 3.0 * s)),
        (
            "cube",
            format!(
                "mode = 'cube'\n{oblique}\n{clip}\n[cube.tilt]\nleft = [10, -5]\n[cube.inset]\nleft = {:?}",
                4.0 * s
            ),
        ),
    ]
}

fn picture(device: &Device, scene: Scene) -> Texels {
    let frames = frames(&scene, tissue);
    let mut renderer = rendered(device, scene, &frames);
    renderer.picture().expect("picture");
    renderer.read(Slot::Picture).expect("read").expect("there")
}

/// Compares the pictures of all modes. Prints the largest errors.
fn same_pictures(device: &Device, name: &str, moved: Placed, skip: &[&str]) {
    let home = Placed { spacing: 1.0, origin: [0.0; 3] };
    for ((mode, here), (_, there)) in modes(home).iter().zip(modes(moved)) {
        if skip.contains(mode) {
            continue;
        }
        let (here, there) = (picture(device, home.scene(here)), picture(device, moved.scene(&there)));
        let seen = here.values.iter().filter(|v| **v > 0.05).count();
        assert!(seen > here.values.len() / 20, "{mode}: {seen} values show something");
        let off: Vec<f64> = here.values.iter().zip(&there.values).map(|(a, b)| (a - b).abs()).collect();
        let largest = off.iter().copied().fold(0.0, f64::max);
        let wrong = off.iter().filter(|d| **d > 4e-3).count();
        println!("{name}, {mode}: largest difference {largest:.1e}, {wrong} of {} values above 4e-3", off.len());
        // A ray along a border, a clip plane or a cliff may fall on either side.
        assert!(
            wrong * 200 <= off.len(),
            "{name}, {mode}: {wrong} of {} values are off, by up to {largest}",
            off.len()
        );
    }
}

/// In f32 a coordinate of 1e6 mm is off by 0.03 mm, and with voxels of 0.05 mm nothing was left of a picture.
#[test]
fn a_volume_a_kilometre_away_looks_as_it_does_at_the_origin() {
    let device = Device::new();
    let far = Placed { spacing: 1.0, origin: [1e6, -1e6, 1e6] };
    same_pictures(&device, "1 mm at 1e6 mm", far, &[]);
}

#[test]
fn voxels_of_a_nanometre_and_of_a_hundred_metres_look_like_those_of_a_millimetre() {
    let device = Device::new();
    for spacing in [1e-6, 1e5] {
        same_pictures(&device, &format!("{spacing:e} mm"), Placed { spacing, origin: [0.0; 3] }, &[]);
    }
    // Far away too: f64 keeps 1e-7 of a voxel of a micrometre at 1e6 mm.
    same_pictures(&device, "a micrometre at 1e6 mm", Placed { spacing: 1e-3, origin: [1e6, 1e6, -1e6] }, &[]);
}
