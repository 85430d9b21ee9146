//! Inputs that are built into the program: probes, scenes, bodies and noise, the same on every machine. Tests use them, too.

use crate::passes::Texels;
use crate::probe::{Advance, Array, Axis, Geometry, Grid, Indices, Motion, Probe};
use crate::scene::{Input, Scene, Settings, VolumeFormat};
use crate::source::StoredType;
use glam::DVec3;

/// Specification of a scene.
#[derive(Clone)]
pub struct SceneSpec {
    pub name: String,
    geometry: Geometry,
    input: Input,
    /// Settings as TOML.
    toml: String,
    /// Uses pictures of floats, whatever the settings are.
    floats: bool,
    /// Shared memory, bytes, with which passes solve rows and columns under AOS, propagate light and filter slices in workgroups, as on a
    /// GPU.
    shared_memory: u32,
}

impl SceneSpec {
    fn new(name: &str, geometry: &Geometry, input: Input, toml: String) -> SceneSpec {
        SceneSpec { name: name.into(), geometry: geometry.clone(), input, toml, floats: false, shared_memory: 0 }
    }

    /// Builds the scene.
    ///
    /// # Errors
    /// One line: the settings are invalid.
    pub fn build(&self) -> Result<Scene, String> {
        let mut scene =
            scene(self.geometry.clone(), self.input, &self.toml).map_err(|e| format!("{}: {e}", self.name))?;
        scene.settings.post.floats |= self.floats;
        scene.shared_memory = self.shared_memory;
        Ok(scene)
    }
}

/// Scenes by name that together need every pass, in every variant of the geometry. `shared_memory`: shared memory of the device, bytes.
///
/// # Errors
/// One line: a scene is invalid.
pub fn scenes(shared_memory: u32) -> Result<Vec<(String, Scene)>, String> {
    specs(shared_memory).into_iter().map(|spec| Ok((spec.name.clone(), spec.build()?))).collect()
}

fn specs(shared_memory: u32) -> Vec<SceneSpec> {
    let planes = plane_scenes();
    // Planes that are rendered directly to 8 bits are also rendered via floats.
    let straight = planes.iter().filter(|spec| spec.build().is_ok_and(|scene| scene.tones_planes()));
    let in_floats =
        straight.map(|spec| SceneSpec { name: format!("{}, in floats", spec.name), floats: true, ..spec.clone() });
    let in_floats: Vec<SceneSpec> = in_floats.collect();
    let rays = ray_scenes();
    // Rows and columns under AOS are solved, light is propagated and slices are filtered in both ways on every device.
    let keys = ["'aos", "volume = { cell", "sigma = { window = 5, sigma = 0.08 }, smooth"];
    let in_both_ways = rays.iter().filter(|spec| keys.iter().any(|key| spec.toml.contains(key)));
    let in_workgroups = in_both_ways.map(|spec| SceneSpec {
        name: format!("{}, in workgroups", spec.name),
        shared_memory,
        ..spec.clone()
    });
    let in_workgroups: Vec<SceneSpec> = in_workgroups.collect();
    rays.into_iter().chain(in_workgroups).chain(planes).chain(in_floats).chain(wide_scenes()).collect()
}

/// Scenes whose dispatches have more than eight workgroups along an axis, as those of real pictures have, and few along the others.
fn wide_scenes() -> Vec<SceneSpec> {
    let mut scenes = Vec::new();
    for size in [[80, 5, 31], [5, 80, 31]] {
        for filters in [
            "median = true",
            "estimator = 'median'",
            "sigma = { window = 5, sigma = 0.083 }",
            "enhanced_sigma = { window = 3, largest = 5, sigma = 0.083, growth = true }",
            "enhanced_sigma = { window = 3, largest = 5, sigma = 0.083 }",
            "perona_malik = { repeat = 1 }",
            "perona_malik = { scheme = 'rkl1', step = 2.0, repeat = 1 }",
            "perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 }",
            "perona_malik = { scheme = 'aos-richardson', step = 2.0, repeat = 1 }",
            "smooth = { lateral = 0.8, depth = 0.8, elevation = 0.8 }",
        ] {
            let toml = format!(
                "mode = 'vr'\npicture = {{ size = [9, 7] }}\nslices = {{ format = 'r32f', {filters} }}\nray.sampling = 'exact'\nplanes.smooth = {{}}"
            );
            scenes.push(SceneSpec::new(
                &format!("Cartesian of {size:?} voxels, {filters}"),
                &cartesian(size),
                BYTES,
                toml,
            ));
        }
    }
    for size in [[160, 5, 31], [5, 160, 31]] {
        for (name, rest) in [
            ("small bricks", "mode = 'vr'\nray.brick = 4"),
            ("small bricks of a surface", "mode = 'sr'\nray.brick = 4"),
            ("small bricks of a still", "mode = 'vr'\nstill = { samples = 1, events = 4 }\nray.brick = 4"),
            ("planes of all samples", "mode = 'vr'\nlayout = 'four'\nplanes.smooth = {}"),
        ] {
            let toml = format!("{rest}\nray.sampling = 'exact'\npicture.size = [9, 7]");
            scenes.push(SceneSpec::new(
                &format!("Cartesian of {size:?} voxels, {name}"),
                &cartesian(size),
                BYTES,
                toml,
            ));
        }
    }
    let sweep =
        Geometry::Sweep(Probe { lines: Axis::centred(0.02, 70), slices: Axis::centred(0.012, 31), ..wobbler() });
    for (name, rest) in [
        ("cuts", TWO_CUTS),
        ("parts that float", "mode = 'vr'\nfloating = 30\nlight = { volume = { cell = 1.2, back = 0.5 } }"),
        (
            "planes of all samples",
            "mode = 'vr'\nlayout = 'four'\nplanes.smooth = { lateral = 1.5, depth = 1, elevation = 1.2 }",
        ),
        ("conditioning", "mode = 'mip'\nconditioning = { samples = 17, low_pass = 1.3, dynamic_range = 20 }"),
        ("packed neighbours", "mode = 'mip'\nray.sampling = 'quads'"),
    ] {
        let sampling = if rest.contains("quads") { "" } else { "ray.sampling = 'exact'\n" };
        let toml = format!("{rest}\n{sampling}picture.size = [9, 7]\nslices.pixels = 75");
        scenes.push(SceneSpec::new(&format!("fan of 31 slices, {name}"), &sweep, BYTES, toml));
    }
    let small = Geometry::Sweep(wobbler());
    let others = [
        ("planes", "mode = 'orthogonal'\nray.sampling = 'exact'"),
        ("two rays at edges", "mode = 'vr'\nray = { rays = 2, adaptive = true, sampling = 'exact' }"),
        ("still", "mode = 'vr'\nstill = { samples = 1, events = 4 }\nray.sampling = 'exact'"),
        (
            "cap",
            "mode = 'sr'\ncap = { level = 0.5 }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]\nray.sampling = 'exact'",
        ),
        ("in floats", "mode = 'plane'\npost = { floats = true }\nray.sampling = 'exact'"),
        (
            "diffusion",
            "mode = 'vr'\nray.sampling = 'exact'\ndistance = { perona_malik = { repeat = 1 } }\npost = { perona_malik = { repeat = 1 } }",
        ),
        (
            "enhanced sigmas",
            "mode = 'sr'\nray.sampling = 'exact'\ndistance = { enhanced_sigma = { window = 3, largest = 5, sigma = 0.3 } }\n\
             post = { enhanced_sigma = { window = 3, largest = 5, sigma = 0.1 } }",
        ),
        (
            "AOS",
            "mode = 'vr'\nray.sampling = 'exact'\npost = { perona_malik = { scheme = 'aos', step = 5.0, repeat = 1 } }",
        ),
        ("diffused distances", "mode = 'sr'\nray.sampling = 'exact'\ndistance = { perona_malik = { repeat = 1 } }"),
    ];
    // The first rays are cast for every second pixel.
    for size in ["[159, 9]", "[9, 159]"] {
        let toml = format!(
            "mode = 'vr'\nray = {{ tolerance = 0.5, step = 2, sampling = 'exact' }}\npicture.size = {size}\nslices.pixels = 24"
        );
        scenes.push(SceneSpec::new(&format!("picture of {size}, steps by their error"), &small, BYTES, toml));
    }
    // A workgroup takes 64 lines.
    for size in ["[520, 9]", "[9, 520]"] {
        let toml = format!(
            "mode = 'sr'\nsurface = {{ detector = 'consistent', threshold = 0.02, rough = 1 }}\nray.sampling = 'exact'\n\
             picture.size = {size}\nslices.pixels = 24"
        );
        scenes.push(SceneSpec::new(&format!("picture of {size}, consistent surface"), &small, BYTES, toml));
    }
    for size in ["[79, 9]", "[9, 79]"] {
        let wide = ALL_FILTERS.replace("[37, 29]", size);
        for (name, toml) in MODES {
            scenes.push(SceneSpec::new(
                &format!("picture of {size}, {name}"),
                &small,
                BYTES,
                format!("{toml}\n{wide}"),
            ));
        }
        for (name, toml) in others {
            let toml = format!("{toml}\npicture.size = {size}\nslices.pixels = 24");
            scenes.push(SceneSpec::new(&format!("picture of {size}, {name}"), &small, BYTES, toml));
        }
    }
    scenes
}

/// Shared memory with which every pass has the shader that it has on a GPU, bytes.
pub const SHARED_MEMORY: u32 = 32 << 10;

/// Edge of a brick where a scene states none, texels.
const BRICK: u32 = 8;

/// A scene with settings from TOML.
///
/// # Errors
/// One line: the settings are invalid.
pub fn scene(geometry: Geometry, input: Input, toml: &str) -> Result<Scene, String> {
    let mut settings = Settings::from_toml(toml).map_err(|e| format!("settings: {}", e.message()))?;
    // Pictures as small as these would not be worth their bricks on a CPU, and skipping would go unchecked.
    settings.ray.brick.get_or_insert(BRICK);
    // Passes are compared on values beyond 0..1 too, and texels that none writes are marked by one: every device stores the same.
    if settings.slices.format == VolumeFormat::Auto {
        settings.slices.format = VolumeFormat::R16f;
    }
    Scene::new(geometry, input, settings).map_err(|e| e.to_string())
}

/// Pseudorandom numbers in 0..1, the same on every machine (SplitMix64).
pub struct Noise(pub u64);

impl Noise {
    // Not an iterator: it never ends.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A small abdominal wobbler: 24 lines over 66 deg, 9 frames over 27 deg, 64 samples.
pub fn wobbler() -> Probe {
    Probe {
        array: Array::Curved { radius: 20.0 },
        lines: Axis::centred(0.05, 24),
        start_depth: 2.0,
        sample_pitch: 0.8,
        samples: 64,
        motion: Motion::Fan { wobble_radius: 12.0 },
        slices: Axis::centred(0.06, 9),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

/// The same probe with frames at uneven angles.
pub fn uneven(mut probe: Probe) -> Probe {
    let at = |k: usize| probe.slices.at(k as f64) + 0.012 * (1.7 * k as f64).sin();
    probe.slices = Axis::from_table((0..probe.slices.len()).map(at).collect());
    probe
}

/// A linear array moved sideways.
pub fn linear() -> Probe {
    Probe {
        array: Array::Linear,
        lines: Axis::centred(1.1, 20),
        motion: Motion::Translated,
        slices: Axis::centred(1.5, 7),
        samples: 48,
        ..wobbler()
    }
}

pub fn still() -> Probe {
    Probe { motion: Motion::Still { thickness: 3.0 }, slices: Axis::centred(1.0, 1), ..wobbler() }
}

/// A radial probe that is pulled back, with lines up to 141 degrees from the depth axis.
pub fn radial() -> Probe {
    Probe {
        array: Array::Curved { radius: 6.0 },
        lines: Axis::centred(0.105, 48),
        start_depth: 1.0,
        motion: Motion::Translated,
        slices: Axis::centred(2.0, 9),
        samples: 40,
        ..wobbler()
    }
}

pub fn cartesian(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [0.5, 0.4, 0.9], origin: [-4.0, 1.0, -3.0] })
}

pub const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
pub const FLOATS: Input = Input { stored: StoredType::F32, range: [0.0, 1.0] };

/// Frames of a volume from a function of texel and slice, with the values that their textures return.
pub fn frames(scene: &Scene, f: impl Fn([usize; 3]) -> f64) -> Vec<Texels> {
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let one = |k| Texels::from_fn([width, height, 1], 1, |[x, y, _], _| f([x, y, k]));
    (0..scene.slices() as usize).map(one).collect()
}

/// Frames of a volume that shows a body, which is given as a function of position in space, mm.
pub fn body_frames(scene: &Scene, body: impl Fn(DVec3) -> f64) -> Vec<Texels> {
    let place = |[i, j, k]: [usize; 3]| match &scene.geometry {
        Geometry::Sweep(probe) => probe.to_space(Indices { sample: i as f64, line: j as f64, slice: k as f64 }),
        Geometry::Cartesian(grid) => {
            let at = [i, j, k];
            DVec3::from_array(std::array::from_fn(|a| grid.origin[a] + grid.spacing[a] * at[a] as f64))
        }
    };
    frames(scene, |at| body(place(at)))
}

/// Names of modes with their settings.
const MODES: [(&str, &str); 17] = [
    ("vr", "mode = 'vr'"),
    ("vr, pre-integrated", "mode = 'vr'\nvolume = { compositing = 'pre-integrated', shading = 'depth-coded' }"),
    ("vr, exponential", "mode = 'vr'\nvolume = { compositing = 'exponential', transfer = 'bone' }"),
    ("vr, first hit", "mode = 'vr'\nvolume = { shading = 'first-hit' }"),
    ("sr", "mode = 'sr'"),
    ("mixed", "mode = 'mixed'"),
    ("mip", "mode = 'mip'"),
    ("minip", "mode = 'minip'"),
    ("mean", "mode = 'mean'"),
    ("plane", "mode = 'plane'\nplanes = { azimuth = 25, tilt = -15, roll = 40, thickness = 2.5 }"),
    ("orthogonal", "mode = 'orthogonal'"),
    ("tomography", "mode = 'tomography'\nplanes = { columns = 3, rows = 2, spacing = 2.5 }"),
    ("cube", "mode = 'cube'"),
    ("4-up, sr", "mode = 'sr'\nlayout = 'four'"),
    ("4-up, vr", "mode = 'vr'\nlayout = 'four'"),
    ("3D + planes, vr", "mode = 'vr'\nlayout = 'beside'"),
    ("pair", "mode = 'sr'\nlayout = 'pair'"),
];

/// Every mode once, each with filters of every stage, in one small sweep.
pub fn modes() -> Vec<SceneSpec> {
    let sweep = Geometry::Sweep(wobbler());
    MODES.iter().map(|(name, toml)| SceneSpec::new(name, &sweep, BYTES, format!("{toml}\n{ALL_FILTERS}"))).collect()
}

/// Frames of a wavy wall between two slightly uneven tissues, which give every mode structure to render and filter. The depth of the wall
/// depends on the volume `number`.
pub fn wall(scene: &Scene, number: u32) -> Vec<Texels> {
    let shift = 4.0 * f64::from(number);
    body_frames(scene, |p| {
        let depth = p.y - 42.0 - shift + 3.0 * (0.25 * p.x).sin() + 2.0 * (0.3 * p.z).cos();
        let uneven = 0.08 * (1.9 * p.x + shift).sin() * (1.3 * p.y).cos() * (1.7 * p.z).cos();
        (0.15 + 0.6 * (0.5 + 0.5 * depth).clamp(0.0, 1.0) + uneven).clamp(0.0, 1.0)
    })
}

/// A prism and a cone, and a brush.
const TWO_CUTS: &str = "mode = 'vr'
    cuts = [
        { contour = [[-8, -6], [9, -5], [3, 2], [2, 9]], view = { at = [0, 20, 0], direction = [0.2, 1, 0], up = [0, 0, 1] } },
        { contour = [[-1, -3], [7, -2], [7, 4], [-2, 4], [7, -3]], view = { at = [-8, 30, 0], direction = [1, 0.5, 0.3], up = [0, -1, 0], eye = 45 }, depth = 20 },
        { brush = { radius = 3.1, strokes = [[[-4, 33, 2], [3, 36, -5], [8, 35, -4]], [[6.2, 50, 7.1]]] } },
    ]";

pub const TURNED: &str = "azimuth = 25, tilt = -15, roll = 40";

/// A wobbler whose motor moves while a frame is acquired.
fn moving() -> Probe {
    let probe = wobbler();
    Probe { advance: Advance::Same(0.7 * probe.slices.pitch()), ..probe }
}

/// All variants of the geometry, by name.
pub fn geometries() -> Vec<(&'static str, Geometry)> {
    let mut mixed = uneven(wobbler());
    mixed.advance = Advance::Each((0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect());
    vec![
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, motor moving", Geometry::Sweep(moving())),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and mixed", Geometry::Sweep(mixed)),
        ("linear array, translated", Geometry::Sweep(linear())),
        ("single frame", Geometry::Sweep(still())),
        ("radial array, translated", Geometry::Sweep(radial())),
        ("Cartesian", cartesian([17, 23, 9])),
    ]
}

/// Scenes of planes, tomography and the block: each mode in every geometry, and extremes in one.
fn plane_scenes() -> Vec<SceneSpec> {
    let mut scenes = Vec::new();
    let base = "slices = { pixels = 33 }\nray = { sampling = 'exact' }";
    for (name, geometry) in geometries() {
        for (mode, rest) in [
            ("plane", format!("picture = {{ size = [23, 31] }}\nplanes = {{ {TURNED}, thickness = 2.5 }}")),
            ("orthogonal", "picture = { size = [37, 29] }".into()),
            ("cube", "picture = { size = [21, 25] }\ncamera = { azimuth = 35, elevation = -20, roll = 5 }".into()),
        ] {
            let toml = format!("mode = '{mode}'\n{base}\n{rest}");
            scenes.push(SceneSpec::new(&format!("{name}, {mode}"), &geometry, BYTES, toml));
        }
    }
    for toml in [
        format!("mode = 'orthogonal'\npicture = {{ size = [41, 33] }}\nplanes = {{ {TURNED}, position = [3, 20, -2] }}"),
        "mode = 'orthogonal'\npicture = { size = [2, 2] }".into(),
        "mode = 'orthogonal'\nplanes = { lines = false, window = [0.3, 0.6] }\npicture = { size = [33, 20] }".into(),
        "mode = 'tomography'\nplanes = { columns = 5, rows = 3, spacing = 3.5, zoom = 1.7 }\npicture = { size = [43, 31] }".into(),
        "mode = 'tomography'\nplanes = { columns = 2, rows = 7, plane = 'c', thickness = 9, slab = 'max' }\npicture = { size = [31, 31] }".into(),
        "mode = 'plane'\nplanes = { plane = 'b', thickness = 7, slab = 'min' }\npicture = { size = [19, 26] }\npost = { colour_map = 'ice' }".into(),
        "mode = 'plane'\nplanes = { position = [900, 20, 0], plane = 'b' }\npicture = { size = [9, 9] }".into(),
        format!("mode = 'plane'\nplanes = {{ {TURNED} }}\npicture = {{ size = [30, 30] }}\nclip = [{{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }}, {{ at = [5, 0, 0], normal = [1, 0, 0] }}]"),
        format!("mode = 'orthogonal'\npicture = {{ size = [47, 39] }}\nplanes = {{ {TURNED}, curve = {{ plane = 'c', points = [[-9, 3], [-2, -6], [5, 2], [11, 1]] }} }}"),
        "mode = 'plane'\npicture = { size = [53, 29] }\nplanes = { thickness = 3, zoom = 1.4, curve = { points = [[-12, 12], [0, 24], [13, 15]] } }".into(),
        "mode = 'vr'\nlayout = 'four'\npicture = { size = [27, 31] }".into(),
        "mode = 'vr'\nlayout = 'four'\npicture = { size = [27, 31] }\nregion = { depth = [9, 20], lateral = [-4, 9] }
         clip = [{ at = [0, 15, 0], normal = [1, 0, 0.3] }]\nplanes.smooth = { lateral = 1.5, depth = 1, elevation = 1.2 }".into(),
        "mode = 'cube'\npicture = { size = [40, 30] }\ncamera = { azimuth = -140, elevation = 25, field_of_view = 40 }
         cube = { shading = 0.8, inset = { left = 9, near = 8, top = 2.5, far = 12 }, tilt = { near = [20, -10], top = [-5, 12] } }
         clip = [{ at = [0, 40, 0], normal = [0.5, 0.5, -0.3] }]".into(),
        "mode = 'cube'\npicture = { size = [33, 25] }\ncamera = { azimuth = 90 }\ncube = { shading = 0, edges = false, inset = { left = 12 } }".into(),
        "mode = 'cube'\npicture = { size = [23, 25] }\ncamera = { field_of_view = 70, zoom = 20 }\ncube = { inset = { near = 10 } }".into(),
    ] {
        scenes.push(SceneSpec::new(&toml.replace('\n', ", "), &Geometry::Sweep(wobbler()), BYTES, format!("{toml}\n{base}")));
    }
    let voxels = cartesian([17, 23, 9]);
    for (name, geometry, toml) in [
        ("Cartesian, 4-up, planes of all samples", &voxels, "mode = 'vr'\nlayout = 'four'\nplanes.smooth = {}"),
        ("fan, parts that float", &Geometry::Sweep(wobbler()), "mode = 'vr'\nfloating = 30"),
        ("fan, two cuts and a brush", &Geometry::Sweep(wobbler()), TWO_CUTS),
        ("fan, start at the fluid", &Geometry::Sweep(wobbler()), "mode = 'vr'\nunveil.enabled = true"),
        (
            "translated, a cut behind the start at the fluid",
            &Geometry::Sweep(linear()),
            "mode = 'minip'\nunveil = { enabled = true, offset = 2 }\n\
             cuts = [{ contour = [[-5, -4], [6, -4], [0, 9]], view = { at = [0, 20, 0], direction = [0, 1, 1], up = [1, 0, 0] }, depth = 9 }]",
        ),
        (
            "fan, motor moving, a cut beside planes",
            &Geometry::Sweep(moving()),
            "mode = 'sr'\nlayout = 'four'\n\
             cuts = [{ contour = [[-5, -4], [6, -4], [0, 9]], view = { at = [3, 25, -2], direction = [0.4, 1, -0.6], up = [0, 0, 1], eye = 60 } }]",
        ),
        (
            "translated, a cut of what floats",
            &Geometry::Sweep(linear()),
            "mode = 'vr'\nfloating = 30\nregion.lateral = [-9, 12]\n\
             cuts = [{ contour = [[-5, -4], [6, -4], [0, 9]], view = { at = [0, 20, 0], direction = [0, 1, 1], up = [1, 0, 0] }, keep = 'inside', depth = 9 }]",
        ),
        (
            "Cartesian, a cut of the smallest echoes",
            &voxels,
            "mode = 'minip'\nslices.format = 'r16f'\n\
             cuts = [{ contour = [[-3, -2], [4, -2], [0, 3]], view = { at = [6, 9, 4], direction = [1, 1, 0], up = [0, 0, 1], eye = 12 }, depth = 3 }]",
        ),
        (
            "Cartesian, parts that float",
            &voxels,
            "mode = 'sr'\nsurface.edge = 2\nfloating = 3\nslices = { format = 'r8', smooth = { elevation = 0.8 } }",
        ),
    ] {
        let toml = format!("{toml}\npicture.size = [27, 31]\nray.sampling = 'exact'");
        let toml = if toml.contains("slices") { toml } else { format!("{toml}\nslices.pixels = 33") };
        scenes.push(SceneSpec::new(name, geometry, BYTES, toml));
    }
    let lit = "light = { volume = { cell = 3, ground = {} } }\nregion.fade = 6";
    for (name, geometry, toml) in [
        ("fan, steps by their error", &Geometry::Sweep(wobbler()), "ray.tolerance = 0.5\nray.step = 2"),
        ("fan, moving, steps by their error, lit", &Geometry::Sweep(moving()), &format!("ray.tolerance = 2\n{lit}")),
        (
            "translated, steps by their error, pre-integrated",
            &Geometry::Sweep(linear()),
            "ray = { tolerance = 1, spread = 0, early_end = 0.05 }\nvolume = { compositing = 'pre-integrated', shading = 'depth-coded' }",
        ),
        (
            "3D + planes, higher than wide, half the rays, toned",
            &voxels,
            "layout = 'beside'\nray.subsampling = 2\npost.colour_map = 'ice'",
        ),
        (
            "Cartesian, steps by their error, 4-up, toned",
            &voxels,
            "layout = 'four'\nray.tolerance = 0.2\nray.rays = 2\npost = { gamma = 1.6, contrast = 1.2, colour_map = 'ice' }\n\
             volume.compositing = 'riemann'",
        ),
    ] {
        let toml = format!("mode = 'vr'\n{toml}\npicture.size = [27, 31]\nray.sampling = 'exact'\nslices.pixels = 33");
        let toml = if toml.contains("ray = {") { toml.replace("ray.sampling = 'exact'\n", "") } else { toml };
        scenes.push(SceneSpec::new(name, geometry, BYTES, toml));
    }
    for (mode, size) in [("orthogonal", "[41, 33]"), ("cube", "[40, 30]")] {
        let toml = format!(
            "mode = '{mode}'\nslices.pixels = 33\nray = {{ sampling = 'exact', elevation = 'bspline' }}\npicture.size = {size}\n\
             camera = {{ azimuth = -140, elevation = 25 }}"
        );
        scenes.push(SceneSpec::new(
            &format!("{mode}, B-spline across slices"),
            &Geometry::Sweep(wobbler()),
            BYTES,
            toml,
        ));
    }
    scenes
}

/// Settings with every filter, light and adjustment at once.
pub const ALL_FILTERS: &str = "
    slices = { pixels = 41, median = true, sigma = { window = 5, sigma = 0.08 }, smooth = { lateral = 2.0, depth = 3.0, elevation = 0.8 } }
    distance = { median = 5, bilateral = { pixels = 1.5, distance = 2.0, repeat = 2 }, sigma = { window = 7, sigma = 0.7 } }
    post = { sigma = { window = 5, sigma = 0.05 }, brightness = 0.05, contrast = 1.3, gamma = 1.8, colour_map = 'skin' }
    light = { texture = 0.4, shininess = 40.0, shadow = { softness = 0.3 }, occlusion = {}, position = [5.0, 10.0, 30.0] }
    picture = { size = [37, 29] }
    camera = { azimuth = 20, elevation = -35, roll = 10, field_of_view = 30 }
    ray = { step = 0.5, sampling = 'exact' }
    surface = { threshold = 0.12, edge = 2 }
";

fn moved(mut probe: Probe, share: f64) -> Probe {
    probe.advance = Advance::Same(share * probe.slices.pitch());
    probe
}

/// A mode and its settings: a surface with the volume's colour behind it.
const BEHIND: &str = "'sr'\nsurface = { colour = 'behind', colour_depth = 4 }";

/// The same: a surface and a volume of one march.
const PAIR: &str = "'sr'\nlayout = 'pair'";

fn ray_scenes() -> Vec<SceneSpec> {
    let mut scenes = Vec::new();
    let mut add = |name: &str, geometry: &Geometry, input: Input, toml: &str| {
        if toml.starts_with("mode") {
            scenes.push(SceneSpec::new(name, geometry, input, toml.into()));
            return;
        }
        for mode in ["'sr'", "'vr'", "'mip'", "'mixed'", "'vr'\nvolume = { shading = 'first-hit' }", BEHIND, PAIR] {
            // A scene of its own for the maps of a fan, and only where the table of surfaces is free.
            if mode == BEHIND && (!name.starts_with("fan") || toml.contains("surface")) {
                continue;
            }
            // Every variant of the geometry once.
            if mode == PAIR && !["fan", "linear", "single", "Cartesian"].iter().any(|shape| name.starts_with(shape)) {
                continue;
            }
            let toml = format!("mode = {mode}\n{toml}");
            scenes.push(SceneSpec::new(&format!("{name}, {mode}"), geometry, input, toml));
        }
    };
    let sweep = Geometry::Sweep(wobbler());
    add("fan with every filter", &sweep, BYTES, ALL_FILTERS);
    let each = (0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect();
    let geometries = [
        ("fan, motor moving", Geometry::Sweep(moved(wobbler(), 0.7))),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and moving", Geometry::Sweep(Probe { advance: Advance::Each(each), ..uneven(wobbler()) })),
        ("linear array, translated", Geometry::Sweep(linear())),
        ("linear array, translated and moving backwards", Geometry::Sweep(moved(linear(), -0.9))),
        ("single frame", Geometry::Sweep(still())),
        ("radial array, translated and moving", Geometry::Sweep(moved(radial(), 0.6))),
        ("Cartesian", cartesian([17, 23, 9])),
        ("Cartesian, one slice", cartesian([9, 8, 1])),
    ];
    for (name, geometry) in &geometries {
        let toml = "slices = { pixels = 33 }
            picture = { size = [19, 33] }
            camera = { azimuth = -30, elevation = 25 }
            surface.edge = 1.8
            ray = { step = 0.45, sampling = 'exact' }";
        // Otherwise only fans wider than 180 degrees use the look-up table.
        let by_table = toml.replace("sampling =", "slice_index = 'table', sampling =");
        add(name, geometry, BYTES, if *name == "fan, uneven" { &by_table } else { toml });
    }
    let toml = "mode = 'vr'\nstill = { samples = 1, events = 8, albedo = 0.9 }\npicture = { size = [17, 11] }\nray = { brick = 0 }";
    add("still of a Cartesian volume without bricks", &cartesian([17, 23, 9]), BYTES, toml);
    let toml = "mode = 'vr'\nstill = { samples = 1, events = 4, anisotropy = -0.6, extinction = 0.5 }\npicture = { size = [16, 16] }\n\
                slices = { pixels = 24, format = 'r8' }\nray = { sampling = 'quads', elevation = 'bspline' }";
    add("still of packed neighbours, B-spline between slices", &sweep, BYTES, toml);
    // So many slices that the digits of the table show.
    let many = Probe { slices: Axis::centred(1.2 / 200.0, 201), ..wobbler() };
    let toml = "mode = 'vr'\nslices = { pixels = 33 }\npicture = { size = [19, 33] }\nvolume = { shading = 'first-hit' }\ncamera = { azimuth = -30, elevation = 25 }
        ray = { step = 0.45, slice_index = 'table', sampling = 'exact' }";
    add("fan of 201 slices by the table", &Geometry::Sweep(many), BYTES, toml);
    // Bytes that are not scaled: the first filter reads them as they are.
    for (format, filters) in [
        ("r8", "median = true"),
        ("r8", "smooth = { lateral = 0.8 }"),
        ("r8", "smooth = { depth = 0.8 }"),
        ("r16f", "estimator = 'median', sigma = {}"),
        ("r16", "sigma = { window = 5, sigma = 0.083 }"),
        ("r32f", "enhanced_sigma = { window = 3, largest = 5, growth = true }"),
        ("r32f", "perona_malik = { repeat = 2 }"),
        ("r32f", "perona_malik = { scheme = 'rkl1', step = 2.0, repeat = 1 }"),
        ("r32f", "perona_malik = { scheme = 'aos-richardson', step = 2.0, repeat = 1 }"),
    ] {
        let toml =
            format!("mode = 'plane'\npicture = {{ size = [9, 7] }}\nslices = {{ format = '{format}', {filters} }}");
        add(&format!("Cartesian, {filters}"), &cartesian([21, 13, 3]), BYTES, &toml);
    }
    // Rows that workgroups solve by both of their methods, in chunks of several pixels.
    let toml = "mode = 'vr'\npicture = { size = [270, 7] }\nslices = { format = 'r32f', perona_malik = { scheme = 'aos', step = 1e3, repeat = 1 } }\n\
                post = { perona_malik = { scheme = 'aos', step = 20.0, repeat = 1 } }\nray = { sampling = 'exact' }";
    add("AOS of long rows", &cartesian([300, 11, 3]), BYTES, toml);
    for format in ["r8", "r16", "r16f", "r32f"] {
        for sampling in ["hardware", "exact", "quads"] {
            let toml = format!(
                "slices = {{ pixels = 24, format = '{format}' }}\npicture = {{ size = [16, 16] }}\nray = {{ step = 0.6, sampling = '{sampling}' }}"
            );
            add(&format!("volume in {format}, sampling {sampling}"), &sweep, BYTES, &toml);
        }
    }
    let one_slice = cartesian([9, 8, 1]);
    for (name, geometry) in
        [("fan", &sweep), ("Cartesian", &cartesian([17, 23, 9])), ("Cartesian, one slice", &one_slice)]
    {
        for (sampling, elevation, format) in [
            ("hardware", "bspline", "r8"),
            ("exact", "bspline", "r16f"),
            ("exact", "bspline-sharp", "r32f"),
            ("quads", "bspline", "r8"),
            ("quads", "bspline-sharp", "r16f"),
        ] {
            let toml = format!(
                "slices = {{ pixels = 24, format = '{format}' }}\npicture = {{ size = [16, 16] }}\nsurface.edge = 1.8\n\
                 ray = {{ step = 0.6, sampling = '{sampling}', elevation = '{elevation}' }}"
            );
            let modes: &[&str] = if name == "fan" { &["'sr'", "'vr'", "'mip'"] } else { &["'vr'"] };
            for mode in modes {
                let toml = format!("mode = {mode}\n{toml}");
                add(&format!("{name}, {mode}, {elevation}, sampling {sampling}"), geometry, BYTES, &toml);
            }
        }
    }
    let joined = "mode = 'vr'\nslices = { pixels = 20, smooth = { elevation = 0.9 } }\npicture = { size = [9, 9] }\n\
                  ray = { sampling = 'exact', elevation = 'bspline' }";
    add("frames joined, B-spline between them", &sweep, BYTES, joined);
    for (name, stored, range) in [("u16", StoredType::U16, [1000.0, 40000.0]), ("f32", StoredType::F32, [-0.25, 1.5])] {
        let toml = "slices = { pixels = 9 }\npicture = { size = [1, 1] }\nray = { sampling = 'exact' }";
        add(&format!("frames in {name}, one pixel"), &sweep, Input { stored, range }, toml);
    }
    for (name, stored, range, conditioning) in [
        ("decimated, the last sample left over", StoredType::U8, [0.0, 255.0], "samples = 13"),
        ("decimated to the least", StoredType::U8, [0.0, 255.0], "samples = 2"),
        ("decimated without a low pass", StoredType::U8, [0.0, 255.0], "samples = 22, low_pass = 0"),
        (
            "every conditioning",
            StoredType::U16,
            [1000.0, 40000.0],
            "samples = 17, low_pass = 1.3, dynamic_range = 20, tgc = [{ depth = 3, gain = -20 }, { depth = 40, gain = 35.5 }]",
        ),
        ("log alone", StoredType::F32, [-0.25, 1.5], "dynamic_range = 60"),
        ("low pass wider than the line", StoredType::F32, [0.0, 1.0], "low_pass = 32"),
        (
            "gain of compressed lines",
            StoredType::U8,
            [0.0, 255.0],
            "compressed_range = 45, tgc = [{ depth = 0, gain = 12 }, { depth = 12.5, gain = -30 }]",
        ),
    ] {
        let toml =
            format!("conditioning = {{ {conditioning} }}\nslices = {{ pixels = 33 }}\npicture = {{ size = [9, 7] }}");
        add(name, &sweep, Input { stored, range }, &toml);
        add(&format!("{name}, linear array"), &Geometry::Sweep(linear()), Input { stored, range }, &toml);
    }
    for (name, toml) in [
        ("sigma 0", "slices = { pixels = 20, sigma = { window = 7, sigma = 0.0 } }"),
        (
            "infinite sigma",
            "slices = { pixels = 20, sigma = { window = 63, sigma = inf } }\npost = { sigma = { window = 9, sigma = inf } }",
        ),
        (
            "first crossing, no rough detector",
            "surface = { place = 'first-crossing', rough = 1 }\nslices = { pixels = 30 }",
        ),
        (
            "dark cavity, roughest",
            "surface = { sign = 'dark', rough = 8, rough_threshold = 0.05 }\nslices = { pixels = 30 }",
        ),
        ("either sign", "surface = { sign = 'any', rough = 2 }\nslices = { pixels = 30 }"),
        (
            "long ring, middle of the edge",
            "surface = { edge = 12, threshold = 0.03, place = 'middle', rough = 1 }\nslices = { pixels = 60 }",
        ),
        (
            "long ring, lasting, third surface",
            "surface = { edge = 6, detector = 'lasting', number = 3, threshold = 0.02 }\nslices = { pixels = 60 }",
        ),
        (
            "long ring, adaptive",
            "surface = { edge = 8, detector = 'adaptive', threshold = 0.02 }\nslices = { pixels = 60 }",
        ),
        ("parallel to a face", "camera = { elevation = 90 }\nslices = { pixels = 30 }"),
        ("inside the volume", "camera = { field_of_view = 90, zoom = 20 }\nslices = { pixels = 30 }"),
        ("shadow, hard", "light = { shadow = { softness = 0.0, bias = 0.4 } }\nslices = { pixels = 12 }"),
        (
            "shadow, soft, near light",
            "light = { position = [10.0, 15.0, 25.0], shadow = {} }\nslices = { pixels = 12 }",
        ),
        ("occlusion", "light = { occlusion = { radius = 8.0, strength = 1.5 } }\nslices = { pixels = 12 }"),
        ("skin", "light = { skin = {}, shadow = {}, occlusion = {} }\nslices = { pixels = 30 }"),
        ("light on the surface", "light = { position = [0.0, 0.0, 0.0], shadow = {} }\nslices = { pixels = 12 }"),
        (
            "light behind",
            "light = { direction = [0.0, 0.0, -1.0], shadow = {}, skin = { translucency = 1.0 } }\nslices = { pixels = 12 }",
        ),
        ("second surface", "surface = { number = 2, threshold = 0.05 }\nslices = { pixels = 30 }"),
        (
            "third surface, no rough detector",
            "surface = { number = 3, threshold = 0.05, rough = 1, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        ("adaptive", "surface = { detector = 'adaptive', threshold = 0.02 }\nslices = { pixels = 30 }"),
        (
            "adaptive, no rough detector, second surface",
            "surface = { detector = 'adaptive', threshold = 0.02, noise = 1.5, rough = 1, number = 2 }\nslices = { pixels = 30 }",
        ),
        (
            "adaptive, dark, roughest, first crossing",
            "surface = { detector = 'adaptive', sign = 'dark', rough = 8, threshold = 0.02, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        ("lasting", "surface = { detector = 'lasting', threshold = 0.02, noise = 1.0 }\nslices = { pixels = 30 }"),
        (
            "lasting, no rough detector, first crossing",
            "surface = { detector = 'lasting', threshold = 0.02, rough = 1, noise = 1.0, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        ("consistent", "surface = { detector = 'consistent', threshold = 0.02, rough = 1 }\nslices = { pixels = 30 }"),
        (
            "consistent, long ring, dark, skin, clipped, sliding",
            "surface = { detector = 'consistent', edge = 8, sign = 'dark', threshold = 0.02, rough = 1 }\nray = { sliding = 3 }\n\
             light = { skin = { translucency = 1.0 } }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]\nslices = { pixels = 60 }",
        ),
        (
            "lasting, dark, second surface",
            "surface = { detector = 'lasting', threshold = 0.02, sign = 'dark', number = 2, noise = 0.0, rough = 3 }\nslices = { pixels = 30 }",
        ),
        (
            "enhanced sigma",
            "post = { enhanced_sigma = { window = 3, largest = 11, sigma = 0.08 } }\nslices = { pixels = 12 }",
        ),
        (
            "both sigmas",
            "post = { sigma = { window = 3, sigma = 0.1 }, enhanced_sigma = { window = 5, largest = 5, sigma = inf } }\nslices = { pixels = 12 }",
        ),
        ("smallest", "mode = 'minip'\nslices = { pixels = 30 }"),
        ("mean", "mode = 'mean'\nslices = { pixels = 30 }"),
        (
            "clipped, lit volume",
            "mode = 'vr'\nvolume = { shading = 'first-hit', hit = 0.1 }\nlight = { shadow = {}, occlusion = {} }\nslices = { pixels = 30 }
             clip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }, { at = [5, 0, 0], normal = [1, 0, 0] }]",
        ),
        ("clipped surface", "slices = { pixels = 30 }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]\ncap = { level = 0.5 }"),
        (
            "clipped veil",
            "mode = 'mixed'\nvolume = { veil = 0.5 }\nlight = { shadow = {} }\nslices = { pixels = 30 }\ncap = { level = 0.5 }
             clip = [{ at = [0, 25, 0], normal = [-0.3, -1, 0.2] }]",
        ),
        (
            "clipped, fading, light in the volume",
            "mode = 'vr'\nlight = { volume = { cell = 5 } }\nregion = { fade = 6 }\nslices = { pixels = 30 }\ncap = { level = 0.48 }
             volume = { transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }] }\nplanes = { window = [0.2, 0.7] }
             clip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }, { at = [5, 0, 0], normal = [1, 0, 0] }]",
        ),
        (
            "still, clipped, fading, two lights",
            "mode = 'vr'\nstill = { samples = 3, batch = 2, events = 6, anisotropy = 0.4, seed = 7 }\nregion = { fade = 6 }
             light = { ambient = 0.3, volume = { back = 0.5, ground = {} } }\nvolume = { extinction = 0.4 }
             slices = { pixels = 30 }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]",
        ),
        ("veil over a surface", "mode = 'mixed'\nvolume = { veil = 0.5 }\nlight = { occlusion = {} }\nslices = { pixels = 30 }"),
        ("rendered colours", "mode = 'sr'\nsurface = { colour = 'rendered' }\nlight = { texture = 0.5 }\nslices = { pixels = 30 }"),
        (
            "rendered colours, shadow over the pixel",
            "mode = 'sr'\nsurface = { colour = 'rendered' }\nvolume = { transfer = 'warm' }\nlight = { shadow = { dims = 'pixel' } }\nslices = { pixels = 30 }",
        ),
        (
            "colours behind the surface",
            "mode = 'sr'\nsurface = { colour = 'behind' }\nlight = { skin = {}, occlusion = {} }\nslices = { pixels = 30 }",
        ),
        (
            "colours behind the surface, shadow and occlusion",
            "mode = 'sr'\nsurface = { colour = 'behind' }\nlight = { shadow = {}, occlusion = {} }\nslices = { pixels = 30 }",
        ),
        (
            "pair, three rays, first crossing, roughest",
            "mode = 'sr'\nlayout = 'pair'\nray = { rays = 3 }\nvolume = { compositing = 'riemann', window = [0.2, 0.9], threshold = 0.3 }\n\
             surface = { place = 'first-crossing', rough = 8, threshold = 0.05, colour = 'rendered' }\nslices = { pixels = 30 }",
        ),
        (
            "pair, half the rays, colours behind a second surface",
            "mode = 'sr'\nlayout = 'pair'\nray = { subsampling = 2 }\nvolume = { shading = 'depth-coded' }\n\
             surface = { number = 2, threshold = 0.05, rough = 2, colour = 'behind' }\nlight = { skin = {}, texture = 0.5 }\nslices = { pixels = 30 }",
        ),
        (
            "pair, lasting, sliding, from inside",
            "mode = 'sr'\nlayout = 'pair'\ncamera = { field_of_view = 90, zoom = 20 }\nray = { sliding = 3 }\n\
             surface = { detector = 'lasting', threshold = 0.02, noise = 1.0, rough = 2 }\nslices = { pixels = 30 }",
        ),
        (
            "pair, adaptive, long ring, clipped",
            "mode = 'sr'\nlayout = 'pair'\nsurface = { edge = 8, detector = 'adaptive', threshold = 0.02, place = 'middle' }\nslices = { pixels = 60 }\n\
             clip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]",
        ),
        (
            "pair of two passes",
            "mode = 'sr'\nlayout = 'pair'\nvolume = { compositing = 'pre-integrated' }\nslices = { pixels = 30 }",
        ),
        ("veil and shadow", "mode = 'mixed'\nlight = { shadow = {} }\nslices = { pixels = 30 }"),
        ("light volume", "mode = 'vr'\nlight = { volume = { cell = 5 } }\nslices = { pixels = 30 }"),
        (
            "light volume, from the side",
            "mode = 'vr'\nlight = { direction = [-1, 0.2, 0.1], follows = 'region', specular = 0.5, volume = { cell = 4, reach = 160, back = 0, scatter = 0, widening = 2, \
             taps = 2, ground = {} } }\nregion = { fade = 6 }\nvolume = { extinction = 0.5 }\nslices = { pixels = 30 }",
        ),
        (
            "light volume, from the probe, over a surface",
            "mode = 'mixed'\nlight = { direction = [0.1, 0.1, 1], volume = { cell = 4, warmth = 0, back_direction = [0, 1, -0.2] } }\nslices = { pixels = 30 }",
        ),
        ("lit volume, shadow", "mode = 'vr'\nvolume = { shading = 'first-hit' }\nlight = { shadow = {}, skin = {} }\nslices = { pixels = 12 }"),
        ("lit volume, occlusion", "mode = 'vr'\nvolume = { shading = 'first-hit' }\nlight = { occlusion = {} }\nslices = { pixels = 12 }"),
        ("depth-coded", "mode = 'vr'\nvolume = { shading = 'depth-coded', transfer = 'warm' }\nslices = { pixels = 30 }"),
        ("Riemann", "mode = 'vr'\nvolume = { compositing = 'riemann', transfer = 'cool' }\nslices = { pixels = 30 }"),
        ("pre-integrated", "mode = 'vr'\nvolume = { compositing = 'pre-integrated', threshold = 0.5 }\nslices = { pixels = 30 }"),
        ("two rays", "mode = 'vr'\nslices = { pixels = 12 }\nray = { rays = 2 }"),
        ("two rays at edges", "mode = 'vr'\nslices = { pixels = 12 }\nray = { rays = 2, adaptive = true }"),
        (
            "4-up, three rays at edges, toned",
            "mode = 'vr'\nlayout = 'four'\nslices = { pixels = 12 }\nray = { rays = 3, adaptive = true }\npost = { contrast = 1.5, gamma = 1.8, colour_map = 'skin' }",
        ),
        ("half the rays", "mode = 'vr'\nslices = { pixels = 12 }\nray = { subsampling = 2 }"),
        (
            "4-up, half the rays, filters in their pixels",
            "layout = 'four'\nslices = { pixels = 12 }\ndistance = { median = 9, sigma = { window = 7 } }\nray = { subsampling = 2 }",
        ),
        (
            "3D + planes, an eighth of the rays, filtered",
            "mode = 'sr'\nlayout = 'beside'\nslices = { pixels = 12 }\nray = { subsampling = 8 }\npost = { sigma = {}, gamma = 1.4 }",
        ),
        ("4-up, three rays", "mode = 'mip'\nlayout = 'four'\nslices = { pixels = 12 }\nray = { rays = 3 }"),
        (
            "every diffusion, explicit",
            "slices = { pixels = 20, perona_malik = { repeat = 3 }, smooth = { lateral = 1.0 } }\n\
             distance = { perona_malik = { edge = 0.8, conductance = 'exponential', step = 0.25, repeat = 2 } }\n\
             post = { perona_malik = { edge = 0.3, conductance = 'exponential', repeat = 3 } }",
        ),
        (
            "diffusion with sharpest and dullest edges",
            "slices = { pixels = 20, perona_malik = { edge = 1e-30, conductance = 'exponential', repeat = 1 } }\n\
             distance = { perona_malik = { edge = 1e-30, repeat = 1 } }\npost = { perona_malik = { edge = inf, repeat = 1 } }",
        ),
        (
            "the heat equation, edges of 0",
            "slices = { pixels = 20, perona_malik = { edge = inf, repeat = 2 } }\n\
             distance = { perona_malik = { edge = inf, repeat = 1 } }\npost = { perona_malik = { edge = 0.0 } }",
        ),
        (
            "AOS",
            "slices = { pixels = 41, perona_malik = { scheme = 'aos', step = 2.0, repeat = 2 } }\n\
             post = { perona_malik = { scheme = 'aos', step = 5.0, repeat = 2, conductance = 'exponential' } }",
        ),
        (
            "AOS, extrapolated",
            "slices = { pixels = 31, perona_malik = { scheme = 'aos-richardson', step = 3.0, repeat = 2 } }",
        ),
        (
            "RKL1",
            "slices = { pixels = 33, perona_malik = { scheme = 'rkl1', step = 4.0, repeat = 2, conductance = 'exponential' } }",
        ),
        (
            "RKL1 in one long step, between filters",
            "slices = { pixels = 20, median = true, perona_malik = { scheme = 'rkl1', edge = inf, step = 30.0, repeat = 1 }, smooth = { depth = 1.0 } }",
        ),
        (
            "AOS in huge steps, between filters",
            "slices = { pixels = 20, median = true, perona_malik = { scheme = 'aos', edge = inf, step = 1e6, repeat = 1 }, smooth = { depth = 1.0 } }\n\
             post = { perona_malik = { scheme = 'aos', edge = 1e-30, step = 1e9, repeat = 1 } }",
        ),
        (
            "enhanced sigmas, Perona-Malik centre, growth",
            "slices = { pixels = 24, enhanced_sigma = { window = 3, largest = 17, sigma = 0.05, centre = 'perona-malik', growth = true } }\n\
             distance = { enhanced_sigma = { window = 5, largest = 11, sigma = 0.3, centre = 'perona-malik', edge = 0.5 } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'perona-malik', noise = 'multiplicative' } }",
        ),
        (
            "enhanced sigmas, gradient-inverse centre, growth",
            "slices = { pixels = 24, enhanced_sigma = { window = 5, largest = 9, sigma = 0.2, noise = 'multiplicative', centre = 'gradient-inverse', growth = true }, smooth = { lateral = 1.0 } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 9, sigma = 0.2, centre = 'gradient-inverse' } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'gradient-inverse' } }",
        ),
        (
            "enhanced sigmas, Nagao-Matsuyama centre",
            "slices = { pixels = 24, enhanced_sigma = { window = 5, largest = 9, sigma = 0.1, centre = 'nagao-matsuyama' } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 9, sigma = 0.2, centre = 'nagao-matsuyama' } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'nagao-matsuyama' } }",
        ),
        (
            "enhanced sigmas, median centre, window beyond the picture",
            "slices = { pixels = 24, enhanced_sigma = { window = 63, largest = 63, sigma = inf } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 63, sigma = 0.2, centre = 'median' } }",
        ),
        ("Gaussian of 3x3x3", "slices = { pixels = 20, smooth = { kernel = 3 } }"),
        ("Gaussian of 5x5x5", "slices = { pixels = 20, smooth = { kernel = 5 } }"),
        ("slight blur", "slices = { pixels = 20, blur = true }"),
        ("slight blur and frames joined", "slices = { pixels = 20, blur = true, smooth = { elevation = 1.0 } }"),
        ("median estimator", "slices = { pixels = 20, estimator = 'median' }"),
        (
            "Perona-Malik estimator, between filters",
            "slices = { pixels = 20, estimator = 'perona-malik', sigma = { window = 3, sigma = 0.1 } }",
        ),
        ("gradient-inverse estimator", "slices = { pixels = 20, estimator = 'gradient-inverse' }"),
        ("Nagao-Matsuyama estimator", "slices = { pixels = 20, estimator = 'nagao-matsuyama' }"),
        (
            "sigmas of multiplicative noise",
            "slices = { pixels = 20, sigma = { window = 5, sigma = 0.3, noise = 'multiplicative' } }\n\
             post = { sigma = { window = 7, sigma = 0.15, noise = 'multiplicative' } }",
        ),
        (
            "infinite sigma of multiplicative noise",
            "slices = { pixels = 20, sigma = { window = 5, sigma = inf, noise = 'multiplicative' } }",
        ),
        ("shininess 0", "light = { shininess = 0.0, texture = 1.0 }\nslices = { pixels = 12 }"),
        ("shininess 1e6", "light = { shininess = 1e6 }\nslices = { pixels = 12 }"),
    ] {
        let ray = "sampling = 'exact', step = 0.7, early_end = 0.0";
        let toml = match toml.split_once("ray = { ") {
            Some((before, after)) => format!("{before}ray = {{ {ray}, {after}"),
            None => format!("{toml}\nray = {{ {ray} }}"),
        };
        add(name, &sweep, BYTES, &format!("{toml}\npicture = {{ size = [23, 17] }}"));
    }
    for ray in ["spread = 1.0", "sliding = 3", "sliding = 5, spread = 0.5"] {
        for mode in ["'sr'", "'vr'", "'mean'", "'vr'\nvolume = { compositing = 'pre-integrated' }"] {
            let toml = format!(
                "mode = {mode}\nslices = {{ pixels = 30 }}\npicture = {{ size = [15, 11] }}\nclip = [{{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }}]
                 camera = {{ azimuth = 35, elevation = 8, roll = 11, field_of_view = 40 }}\nray = {{ sampling = 'exact', step = 0.9, early_end = 0.0, {ray} }}"
            );
            scenes.push(SceneSpec::new(&format!("{ray}, {mode}"), &sweep, BYTES, toml));
        }
    }
    scenes
}
