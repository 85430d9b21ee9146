//! The scenes that passes are timed on: for each, what it sets beyond the phantom's preset and which passes it is for.

use crate::common::scene;
use echolume::low_level::passes::{PASSES, Pass};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use echolume::low_level::source::phantom::Phantom;
use echolume::low_level::verify::built_in::labelled;

/// One sweep and its scenes: how large everything is.
pub struct Sizes {
    pub frames: usize,
    pub lines: usize,
    pub samples: usize,
    /// Longer edge of a slice.
    pub pixels: u32,
    /// Edge of a picture.
    pub picture: u32,
}

/// A volume of about 128^3 and a picture of 256^2.
pub const FULL: Sizes = Sizes { frames: 128, lines: 128, samples: 256, pixels: 128, picture: 256 };
/// The least that still shows a face with shadows on it: to see that each bench runs.
pub const SMALL: Sizes = Sizes { frames: 40, lines: 64, samples: 160, pixels: 96, picture: 80 };

pub struct Stated {
    pub name: &'static str,
    set: &'static [&'static str],
    pub passes: &'static [&'static str],
    /// The frames taken as slices of a Cartesian volume.
    cartesian: bool,
}

const fn sweep(name: &'static str, set: &'static [&'static str], passes: &'static [&'static str]) -> Stated {
    Stated { name, set, passes, cartesian: false }
}

pub const SCENES: &[Stated] = &[
    sweep(
        "light volume",
        &["mode=volume", "light.volume={}"],
        &[
            "light_matter",
            "light_reduce",
            "light_propagate",
            "light_propagate_back",
            "light_diffuse",
            "light_ambient",
            "light_shade",
        ],
    ),
    // Light from the side: the preset's own, from above, leaves a small picture without a shadow.
    sweep(
        "preset",
        &["light.direction=[0.9,0.2,0.3]"],
        &[
            "scan_convert",
            "median_slice",
            "sigma_slice",
            "gaussian_lateral",
            "gaussian_depth",
            "gaussian_elevation",
            "tile_ranges",
            "brick_ranges",
            "classify_bricks_surface",
            "brick_distance_surface",
            "raycast_surface",
            "median_distance",
            "bilateral_distance",
            "shadow",
            "occlusion",
            "light",
            "assemble_toned",
        ],
    ),
    sweep(
        "every other filter",
        &[
            "conditioning.tgc=[{ depth = 10, gain = -6 }, { depth = 90, gain = 4 }]",
            "conditioning.low_pass=1.0",
            "slices.enhanced_sigma={ growth = true }",
            "slices.perona_malik={ repeat = 1 }",
            "distance.sigma={ window = 7, sigma = 0.7 }",
            "distance.enhanced_sigma={ sigma = 0.5 }",
            "distance.perona_malik={ edge = 1.0, repeat = 1 }",
            "post.sigma={ window = 5, sigma = 0.05 }",
            "post.enhanced_sigma={ sigma = 0.05 }",
            "post.perona_malik={ repeat = 1 }",
        ],
        &[
            "condition",
            "growth_slice",
            "enhanced_sigma_slice",
            "perona_malik_slice",
            "sigma_distance",
            "enhanced_sigma_distance",
            "perona_malik_distance",
            "sigma_picture",
            "enhanced_sigma_picture",
            "perona_malik_picture",
        ],
    ),
    sweep(
        "Nagao-Matsuyama, AOS",
        &[
            "slices.estimator=nagao-matsuyama",
            "slices.perona_malik={ scheme = 'aos', step = 5.0, repeat = 1 }",
            "post.perona_malik={ scheme = 'aos', step = 5.0, repeat = 1 }",
        ],
        &["estimator_slice", "aos_slice", "aos_picture"],
    ),
    sweep(
        "aos_richardson",
        &["slices.perona_malik={ scheme = 'aos-richardson', step = 5.0, repeat = 1 }"],
        &["aos_richardson_slice"],
    ),
    sweep("rkl1", &["slices.perona_malik={ scheme = 'rkl1', step = 5.0, repeat = 1 }"], &["rkl1_slice"]),
    sweep("adaptive detector", &["surface.detector=adaptive"], &["raycast_surface"]),
    sweep("lasting detector", &["surface.detector=lasting"], &["raycast_surface"]),
    sweep(
        "consistent detector",
        &["surface.detector=consistent"],
        &["raycast_candidates", "surface_paths", "choose_surface"],
    ),
    sweep("exact sampling", &["ray.sampling=exact"], &["raycast_surface"]),
    sweep("quads", &["ray.sampling=quads"], &["packed_neighbours", "raycast_surface"]),
    sweep("hardware sampling", &["ray.sampling=hardware"], &["raycast_surface"]),
    sweep("corrected", &["mode=vr"], &["classify_bricks_volume", "brick_distance_volume", "raycast_volume"]),
    sweep("every sample", &["mode=vr", "ray.brick=0"], &["raycast_volume"]),
    sweep("every sample, surface", &["ray.brick=0"], &["raycast_surface"]),
    sweep("pre-integrated", &["mode=vr", "volume.compositing=pre-integrated"], &["raycast_volume"]),
    sweep("first hit", &["mode=vr", "volume.shading=first-hit"], &["raycast_volume", "light"]),
    sweep(
        "still",
        // Of one dispatch, the sums that it begins with would be zeros.
        &["mode=vr", "still.samples=3", "still.batch=1"],
        &["still_majorants", "still_begin", "still_paths", "still_resolve"],
    ),
    sweep(
        "several rays at edges",
        &["mode=vr", "ray.rays=2", "ray.adaptive=true"],
        &["raycast_volume", "mark_edges", "raycast_refined", "assemble_toned"],
    ),
    sweep(
        "steps by their error",
        &["mode=vr", "ray.tolerance=1"],
        &["tolerance_first", "tolerance_enlarge", "tolerance_list", "tolerance_refine"],
    ),
    sweep("largest", &["mode=mip"], &["raycast_projection", "tone"]),
    sweep("mean", &["mode=mean"], &["raycast_projection"]),
    sweep("three planes", &["mode=orthogonal"], &["raycast_planes_toned"]),
    sweep("three planes in floats", &["mode=orthogonal", "post.floats=true"], &["raycast_planes"]),
    sweep("slabs of 3 mm", &["mode=tomography", "planes.thickness=3"], &["raycast_planes_toned"]),
    sweep("block", &["mode=cube", "cube.inset.near=5", "camera.azimuth=30", "camera.elevation=20"], &["raycast_cube"]),
    sweep(
        "surface and volume of one march",
        &["surface.colour=rendered", "ray.sliding=3"],
        &["raycast_surface_and_volume"],
    ),
    sweep(
        "pair, two rays, in floats",
        &["layout=pair", "ray.rays=2", "post.floats=true"],
        &["raycast_surface_and_volume", "assemble"],
    ),
    sweep("4-up, two rays", &["layout=four", "ray.rays=2"], &["assemble_toned"]),
    sweep(
        "4-up, planes of their own volume",
        &["layout=four", "planes.smooth={ lateral = 1, depth = 1, elevation = 1 }"],
        &["section_scan_convert", "section_lateral", "section_depth", "section_elevation"],
    ),
    sweep("parts that float", &["mode=volume", "floating=50"], &["drop_floating"]),
    sweep(
        "a cut",
        &[
            "mode=volume",
            "cuts=[{ contour = [[-20, -10], [20, -10], [10, 15], [-10, 15]], view = { at = [0, 40, 0], direction = [0, 1, 0], up = [0, 0, 1] } }]",
        ],
        &["cut"],
    ),
    sweep("labels, 4-up", &["layout=four", "labels.shell=0.5"], &["labels"]),
    // Through the middle of the preset's region, on the side away from the camera.
    sweep("a clip with its echoes", &["clip=[{ at = [0, 60, 0], normal = [0.3, -1, 0.2] }]"], &["raycast_cap"]),
    Stated {
        name: "Cartesian, 4-up, planes of their own volume",
        set: &[
            "layout=four",
            "planes.smooth={}",
            "region.lateral=[-1e3, 1e3]",
            "region.depth=[-1e3, 1e3]",
            "region.elevation=[-1e3, 1e3]",
        ],
        passes: &["section_load_slice"],
        cartesian: true,
    },
    Stated {
        name: "Cartesian",
        // The preset's region is the sweep's. A filter would read the samples as they are, and 8 bits would be copied.
        set: &[
            "slices.median=false",
            "slices.sigma=none",
            "slices.smooth=none",
            "slices.format=r16f",
            "region.lateral=[-1e3, 1e3]",
            "region.depth=[-1e3, 1e3]",
            "region.elevation=[-1e3, 1e3]",
        ],
        passes: &["load_slice"],
        cartesian: true,
    },
];

impl Stated {
    pub fn scene(&self, phantom: &Phantom, sizes: &Sizes) -> Result<Scene, String> {
        let mut set =
            vec![format!("slices.pixels={}", sizes.pixels), format!("picture.size=[{0}, {0}]", sizes.picture)];
        // On a CPU small pictures have no bricks unless they are set.
        set.push("ray.brick=8".into());
        set.extend(self.set.iter().map(|s| s.to_string()));
        let grid =
            Grid { size: [sizes.samples, sizes.lines, sizes.frames], spacing: [0.5, 1.0, 1.0], origin: [0.0; 3] };
        let geometry = if self.cartesian { Geometry::Cartesian(grid) } else { Geometry::Sweep(phantom.probe(0)) };
        let scene = scene(geometry, &set).map_err(|e| format!("scene '{}': {e}", self.name))?;
        if self.passes.contains(&"labels") { labelled(scene) } else { Ok(scene) }
    }

    /// The passes named, each needed by the scene.
    pub fn passes(&self, scene: &Scene) -> Result<Vec<&'static Pass>, String> {
        let find = |name: &&str| {
            let pass = PASSES.iter().find(|p| p.name == *name);
            let pass = pass.ok_or_else(|| format!("scene '{}': there is no pass '{name}'", self.name))?;
            match pass.needed(scene) {
                Ok(_) => Ok(pass),
                Err(why) => Err(format!("scene '{}' does not need '{name}': {why}", self.name)),
            }
        };
        self.passes.iter().map(find).collect()
    }
}

/// Refuses a pass that no scene times.
pub fn check_that_none_is_forgotten() -> Result<(), String> {
    let timed = |pass: &Pass| SCENES.iter().any(|s| s.passes.contains(&pass.name));
    let forgotten: Vec<_> = PASSES.iter().filter(|p| !timed(p)).map(|p| p.name).collect();
    match forgotten.is_empty() {
        true => Ok(()),
        false => Err(format!("no bench for {}; add to SCENES in benches/gpu/scenes.rs", forgotten.join(", "))),
    }
}
