//! Built-in scenes of planes.

use super::*;

/// Settings with three cuts for tests: a prism, a cone, and a brush.
pub(super) const TWO_CUTS: &str = "mode = 'vr'
    cuts = [
        { contour = [[-8, -6], [9, -5], [3, 2], [2, 9]], view = { at = [0, 20, 0], direction = [0.2, 1, 0], up = [0, 0, 1] } },
        { contour = [[-1, -3], [7, -2], [7, 4], [-2, 4], [7, -3]], view = { at = [-8, 30, 0], direction = [1, 0.5, 0.3], up = [0, -1, 0], eye = 45 }, depth = 20 },
        { brush = { radius = 3.1, strokes = [[[-4, 33, 2], [3, 36, -5], [8, 35, -4]], [[6.2, 50, 7.1]]] } },
    ]";

/// Scenes of planes, tomography and the block: each mode in every geometry, and extremes in one.
pub(super) fn plane_scenes() -> Vec<SceneSpec> {
    let mut scenes = Vec::new();
    let mut add = |name: &str, geometry: &Geometry, toml: String| {
        scenes.push(SceneSpec::new(name, geometry, BYTES, toml));
    };
    let [fan, moving, parallel] = [wobbler(), moved(wobbler(), 0.7), linear()].map(Geometry::Sweep);
    let base = "slices = { pixels = 33 }\nray = { sampling = 'exact' }";
    for (name, geometry) in geometries() {
        for (mode, rest) in [
            ("plane", format!("picture = {{ size = [23, 31] }}\nplanes = {{ {TURNED}, thickness = 2.5 }}")),
            ("orthogonal", "picture = { size = [37, 29] }".into()),
            ("cube", "picture = { size = [21, 25] }\ncamera = { azimuth = 35, elevation = -20, roll = 5 }".into()),
        ] {
            let toml = format!("mode = '{mode}'\n{base}\n{rest}");
            add(&format!("{name}, {mode}"), &geometry, toml);
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
        add(&toml.replace('\n', ", "), &fan, format!("{toml}\n{base}"));
    }
    let voxels = cartesian([17, 23, 9]);
    for (name, geometry, toml) in [
        ("Cartesian, 4-up, planes of all samples", &voxels, "mode = 'vr'\nlayout = 'four'\nplanes.smooth = {}"),
        ("fan, parts that float", &fan, "mode = 'vr'\nfloating = 30"),
        ("fan, two cuts and a brush", &fan, TWO_CUTS),
        ("fan, start at the fluid", &fan, "mode = 'vr'\nunveil.enabled = true"),
        (
            "translated, a cut behind the start at the fluid",
            &parallel,
            "mode = 'minip'\nunveil = { enabled = true, offset = 2 }\n\
             cuts = [{ contour = [[-5, -4], [6, -4], [0, 9]], view = { at = [0, 20, 0], direction = [0, 1, 1], up = [1, 0, 0] }, depth = 9 }]",
        ),
        (
            "fan, motor moving, a cut beside planes",
            &moving,
            "mode = 'sr'\nlayout = 'four'\n\
             cuts = [{ contour = [[-5, -4], [6, -4], [0, 9]], view = { at = [3, 25, -2], direction = [0.4, 1, -0.6], up = [0, 0, 1], eye = 60 } }]",
        ),
        (
            "translated, a cut of what floats",
            &parallel,
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
        add(name, geometry, toml);
    }
    let lit = "light = { volume = { cell = 3, ground = {} } }\nregion.fade = 6";
    for (name, geometry, toml) in [
        ("fan, steps by their error", &fan, "ray.tolerance = 0.5\nray.step = 2"),
        ("fan, moving, steps by their error, lit", &moving, &format!("ray.tolerance = 2\n{lit}")),
        (
            "translated, steps by their error, pre-integrated",
            &parallel,
            "ray = { tolerance = 1, spread = 0, early_end = 0.05 }\nvolume = { compositing = 'pre-integrated', shading = 'depth-coded' }",
        ),
        (
            "labels, 4-up, dim behind the surface",
            &voxels,
            "mode = 'sr'\nlayout = 'four'\nlabels = { behind = 0.2 }\nsurface.threshold = 0.3",
        ),
        ("labels, 3D + planes, half the rays", &voxels, "layout = 'beside'\nray.subsampling = 2\nlabels.fill = 0.4"),
        ("labels, pair, two rays", &parallel, "mode = 'sr'\nlayout = 'pair'\nlabels.shell = 0.7\nray.rays = 2"),
        (
            "labels, perspective, in floats",
            &fan,
            "mode = 'mip'\nlabels.shell = 0.9\npost.floats = true\ncamera = { azimuth = 40, elevation = 15, field_of_view = 35, zoom = 1.8 }",
        ),
        (
            "labels, a curved plane",
            &fan,
            "mode = 'orthogonal'\nlabels.fill = 0.3\nplanes = { tilt = 12, curve = { plane = 'c', points = [[-9, 3], [-2, -6], [5, 2], [11, 1]] } }",
        ),
        (
            "labels, outlines alone",
            &voxels,
            "mode = 'tomography'\nlabels = { fill = 0 }\nplanes = { columns = 2, rows = 3, zoom = 1.6 }",
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
        let mode = if toml.contains("mode") { "" } else { "mode = 'vr'\n" };
        let toml = format!("{mode}{toml}\npicture.size = [27, 31]\nray.sampling = 'exact'\nslices.pixels = 33");
        let toml = if toml.contains("ray = {") { toml.replace("ray.sampling = 'exact'\n", "") } else { toml };
        add(name, geometry, toml);
    }
    for (mode, size) in [("orthogonal", "[41, 33]"), ("cube", "[40, 30]")] {
        let toml = format!(
            "mode = '{mode}'\nslices.pixels = 33\nray = {{ sampling = 'exact', elevation = 'bspline' }}\npicture.size = {size}\n\
             camera = {{ azimuth = -140, elevation = 25 }}"
        );
        add(&format!("{mode}, B-spline across slices"), &fan, toml);
    }
    scenes
}
