//! Built-in scenes of rays.

use super::*;

/// A mode and its settings: a surface with the volume's colour behind it.
const BEHIND: &str = "'sr'\nsurface = { colour = 'behind', colour_depth = 4 }";

/// The same: a surface and a volume of one march.
const PAIR: &str = "'sr'\nlayout = 'pair'";

fn moved(mut probe: Probe, share: f64) -> Probe {
    probe.advance = Advance::Same(share * probe.slices.pitch());
    probe
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
