//! Inputs that are built into the program: probes, scenes, bodies and noise, the same on every machine. Tests use them, too.

mod planes;
mod rays;

use crate::passes::Texels;
use crate::probe::{Advance, Array, Axis, Geometry, Grid, Indices, Motion, Probe};
use crate::scene::{DeviceFacts, Input, LabelVolume, Scene, Settings, VolumeFormat};
use crate::source::StoredType;
use crate::statistics::mix;
use glam::{DAffine3, DQuat, DVec3, EulerRot};

/// A scene to build: its name, geometry, input, and settings as TOML.
#[derive(Clone)]
pub struct SceneSpec {
    pub name: String,
    geometry: Geometry,
    input: Input,
    /// Settings as TOML.
    toml: String,
    /// Uses pictures of floats, whatever the settings are.
    floats: bool,
    /// With shared memory passes solve rows and columns under AOS, propagate light and filter slices in workgroups, as on a GPU.
    device: DeviceFacts,
}

impl SceneSpec {
    fn new(name: &str, geometry: &Geometry, input: Input, toml: String) -> SceneSpec {
        let device = DeviceFacts::default();
        SceneSpec { name: name.into(), geometry: geometry.clone(), input, toml, floats: false, device }
    }

    /// Builds the scene.
    ///
    /// # Errors
    /// One line: the settings are invalid.
    pub fn build(&self) -> Result<Scene, String> {
        let mut scene =
            scene(self.geometry.clone(), self.input, &self.toml).map_err(|e| format!("{}: {e}", self.name))?;
        scene.settings.post.floats |= self.floats;
        scene.device = self.device;
        Ok(scene)
    }
}

/// Scenes by name that together need every pass, in every variant of the geometry. `device`: of the scenes whose passes share
/// memory in workgroups.
///
/// # Errors
/// One line: a scene is invalid.
pub fn scenes(device: DeviceFacts) -> Result<Vec<(String, Scene)>, String> {
    specs(device).into_iter().map(|spec| Ok((spec.name.clone(), spec.build()?))).collect()
}

fn specs(device: DeviceFacts) -> Vec<SceneSpec> {
    let planes = planes::plane_scenes();
    // Planes that are rendered directly to 8 bits are also rendered via floats.
    let straight = planes.iter().filter(|spec| spec.build().is_ok_and(|scene| scene.tones_planes()));
    let in_floats =
        straight.map(|spec| SceneSpec { name: format!("{}, in floats", spec.name), floats: true, ..spec.clone() });
    let in_floats: Vec<SceneSpec> = in_floats.collect();
    let rays = rays::ray_scenes();
    // Rows and columns under AOS are solved, light is propagated and slices are filtered in both ways on every device.
    let keys = ["'aos", "volume = { cell", "sigma = { window = 5, sigma = 0.08 }, smooth"];
    let in_both_ways = rays.iter().filter(|spec| keys.iter().any(|key| spec.toml.contains(key)));
    let in_workgroups =
        in_both_ways.map(|spec| SceneSpec { name: format!("{}, in workgroups", spec.name), device, ..spec.clone() });
    let in_workgroups: Vec<SceneSpec> = in_workgroups.collect();
    rays.into_iter().chain(in_workgroups).chain(planes).chain(in_floats).chain(wide_scenes()).collect()
}

/// Scenes whose dispatches have more than eight workgroups along an axis, as those of real pictures have, and few along the others.
fn wide_scenes() -> Vec<SceneSpec> {
    let mut scenes = Vec::new();
    let mut add = |name: &str, geometry: &Geometry, toml: String| {
        scenes.push(SceneSpec::new(name, geometry, BYTES, toml));
    };
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
            add(&format!("Cartesian of {size:?} voxels, {filters}"), &cartesian(size), toml);
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
            add(&format!("Cartesian of {size:?} voxels, {name}"), &cartesian(size), toml);
        }
    }
    let sweep =
        Geometry::Sweep(Probe { lines: Axis::centred(0.02, 70), slices: Axis::centred(0.012, 31), ..wobbler() });
    for (name, rest) in [
        ("cuts", planes::TWO_CUTS),
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
        add(&format!("fan of 31 slices, {name}"), &sweep, toml);
    }
    let small = Geometry::Sweep(wobbler());
    let others = [
        ("planes", "mode = 'orthogonal'\nray.sampling = 'exact'"),
        ("labels", "mode = 'sr'\nlabels.shell = 0.6\nray.sampling = 'exact'"),
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
        add(&format!("picture of {size}, steps by their error"), &small, toml);
    }
    // A workgroup takes 64 lines.
    for size in ["[520, 9]", "[9, 520]"] {
        let toml = format!(
            "mode = 'sr'\nsurface = {{ detector = 'consistent', threshold = 0.02, rough = 1 }}\nray.sampling = 'exact'\n\
             picture.size = {size}\nslices.pixels = 24"
        );
        add(&format!("picture of {size}, consistent surface"), &small, toml);
    }
    for size in ["[79, 9]", "[9, 79]"] {
        let wide = ALL_FILTERS.replace("[37, 29]", size);
        for (name, toml) in MODES {
            add(&format!("picture of {size}, {name}"), &small, format!("{toml}\n{wide}"));
        }
        for (name, toml) in others {
            let toml = format!("{toml}\npicture.size = {size}\nslices.pixels = 24");
            add(&format!("picture of {size}, {name}"), &small, toml);
        }
    }
    scenes
}

/// What a GPU has: every pass then uses the same shader as on a GPU.
pub fn gpu() -> DeviceFacts {
    DeviceFacts { shared_memory: 32 << 10, ..DeviceFacts::default() }
}

/// Edge of a brick where a scene states none, texels.
const BRICK: u32 = 8;

/// A scene with settings from TOML. Where they state none, bricks have an edge of 8 texels, and the volume is stored as `r16f`. If they contain the
/// word `labels`, the scene gets the labels of [`labelled`].
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
    let scene = Scene::new(geometry, input, settings).map_err(|e| e.to_string())?;
    if toml.contains("labels") { labelled(scene) } else { Ok(scene) }
}

/// The scene with labels: two bodies that touch and a single voxel, on a lattice that lies obliquely in the middle of what the scene shows.
///
/// # Errors
/// None: the labels are valid.
pub fn labelled(mut scene: Scene) -> Result<Scene, String> {
    const SIZE: [usize; 3] = [19, 16, 13];
    let middle = DVec3::new(9.0, 7.0, 6.0);
    let label = |at: DVec3| match () {
        () if at == DVec3::new(17.0, 13.0, 2.0) => 9,
        () if ((at - middle) / DVec3::new(7.0, 5.0, 4.0)).length() >= 1.0 => 0,
        () if at.x + 0.4 * at.y < 11.0 => 1,
        () => 4,
    };
    let places = (0..SIZE.iter().product()).map(|n| [n % SIZE[0], n / SIZE[0] % SIZE[1], n / (SIZE[0] * SIZE[1])]);
    let voxels: Vec<u8> = places.map(|at| label(DVec3::from(at.map(|n| n as f64)))).collect();
    let spacing = (scene.high - scene.low) / DVec3::new(24.0, 22.0, 18.0);
    let turned = DAffine3::from_quat(DQuat::from_euler(EulerRot::XYZ, 0.4, -0.3, 0.2));
    let to_space = DAffine3::from_translation((scene.low + scene.high) / 2.0)
        * turned
        * DAffine3::from_scale(spacing)
        * DAffine3::from_translation(-middle);
    let labels = LabelVolume::new(SIZE, &voxels, to_space, |label| (label == 4).then_some([0.9, 0.8, 0.1]))?;
    scene.settings.labels.volume = Some(labels.into());
    Ok(scene)
}

/// Pseudorandom numbers from 0 to below 1, the same on every machine (SplitMix64). The field is the state, at first the seed.
pub struct Noise(pub u64);

impl Noise {
    // Not an iterator: it never ends.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A small abdominal wobbler probe: 24 lines over 66 deg, 9 frames over 27.5 deg, 64 samples a line.
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

/// The given probe with frames at uneven angles.
pub fn uneven(mut probe: Probe) -> Probe {
    let at = |k: usize| probe.slices.at(k as f64) + 0.012 * (1.7 * k as f64).sin();
    probe.slices = Axis::from_table((0..probe.slices.len()).map(at).collect());
    probe
}

/// A linear array that is moved in elevation, so that its frames are parallel.
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

/// The frames of a volume by a function of (column, row, slice) that gives the value, 0..1, that a shader reads there. In a sweep the column is the
/// sample, and the row the scan line.
pub fn frames(scene: &Scene, f: impl Fn([usize; 3]) -> f64) -> Vec<Texels> {
    let [width, height] = scene.frame_size().map(|n| n as usize);
    let one = |k| Texels::from_fn([width, height, 1], 1, |[x, y, _], _| f([x, y, k]));
    (0..scene.slices() as usize).map(one).collect()
}

/// The frames of a volume that shows a body. `body` gives the value, 0..1, at a position in space, mm.
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

/// Scenes of a small sweep: every mode at least once, each with filters of every stage.
pub fn modes() -> Vec<SceneSpec> {
    let sweep = Geometry::Sweep(wobbler());
    MODES.iter().map(|(name, toml)| SceneSpec::new(name, &sweep, BYTES, format!("{toml}\n{ALL_FILTERS}"))).collect()
}

/// The frames of a wavy wall between two slightly uneven tissues, which gives every mode structure to render and filter. Volumes of another `number`
/// have the wall at another depth.
pub fn wall(scene: &Scene, number: u32) -> Vec<Texels> {
    let shift = 4.0 * f64::from(number);
    body_frames(scene, |p| {
        let depth = p.y - 42.0 - shift + 3.0 * (0.25 * p.x).sin() + 2.0 * (0.3 * p.z).cos();
        let uneven = 0.08 * (1.9 * p.x + shift).sin() * (1.3 * p.y).cos() * (1.7 * p.z).cos();
        (0.15 + 0.6 * (0.5 + 0.5 * depth).clamp(0.0, 1.0) + uneven).clamp(0.0, 1.0)
    })
}

pub const TURNED: &str = "azimuth = 25, tilt = -15, roll = 40";

/// The given probe with a motor that moves by `share` of the slice pitch while a frame is acquired.
pub(crate) fn moved(probe: Probe, share: f64) -> Probe {
    Probe { advance: Advance::Same(share * probe.slices.pitch()), ..probe }
}

/// All variants of the geometry, by name.
pub fn geometries() -> Vec<(&'static str, Geometry)> {
    let mut mixed = uneven(wobbler());
    mixed.advance = Advance::Each((0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect());
    vec![
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, motor moving", Geometry::Sweep(moved(wobbler(), 0.7))),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and mixed", Geometry::Sweep(mixed)),
        ("linear array, translated", Geometry::Sweep(linear())),
        ("single frame", Geometry::Sweep(still())),
        ("radial array, translated", Geometry::Sweep(radial())),
        ("Cartesian", cartesian([17, 23, 9])),
    ]
}

/// Settings as TOML with several filters of the slices, the distance map and the picture, and with lights, shadow, occlusion and adjustments of the
/// picture at once.
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
