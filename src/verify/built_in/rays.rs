//! Built-in scenes of rays.

use super::*;

/// A mode and its settings: a surface with the volume's colour behind it.
const BEHIND: &str = "'sr'\nsurface = { colour = 'behind', colour_depth = 4 }";

/// The same: a surface and a volume of one march.
const PAIR: &str = "'sr'\nlayout = 'pair'";

/// Names of scenes with their settings as TOML, in the order of their file.
fn named_settings() -> impl Iterator<Item = (&'static str, &'static str)> {
    let scenes = include_str!("rays.txt").split("\n[").skip(1);
    // What has no name in brackets is no TOML either, so that building the scenes fails.
    scenes
        .map(|scene| scene.split_once("]\n").unwrap_or(("unnamed", scene)))
        .map(|(name, toml)| (name, toml.trim_end()))
}

/// Scenes that cast rays: every such mode in every geometry, and every filter, light and setting of rays in one geometry.
pub(super) fn ray_scenes() -> Vec<SceneSpec> {
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
    for (name, toml) in named_settings() {
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
