//! Scenes of planes, slabs, tomography and the block.

use super::{Asked, BYTES, cartesian, linear, still, uneven, wobbler};
use crate::probe::{Advance, Geometry};

pub const TURNED: &str = "azimuth = 25, tilt = -15, roll = 40";

/// Every variant of the geometry.
pub fn geometries() -> Vec<(&'static str, Geometry)> {
    let mut moved = wobbler();
    moved.advance = Advance::Same(0.7 * moved.slices.pitch());
    let mut mixed = uneven(wobbler());
    mixed.advance = Advance::Each((0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect());
    vec![
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, motor moving", Geometry::Sweep(moved)),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and mixed", Geometry::Sweep(mixed)),
        ("linear array, translated", Geometry::Sweep(linear())),
        ("single frame", Geometry::Sweep(still())),
        ("Cartesian", cartesian([17, 23, 9])),
    ]
}

/// For the loop over all passes: every mode of this file in every geometry, and its extremes in one.
pub(super) fn scenes() -> Vec<Asked> {
    let mut scenes = Vec::new();
    let base = "slices = { pixels = 33 }\nray = { sampling = 'exact' }";
    for (name, geometry) in geometries() {
        for (mode, rest) in [
            ("plane", format!("picture = {{ size = [23, 31] }}\nplanes = {{ {TURNED}, thickness = 2.5 }}")),
            ("orthogonal", "picture = { size = [37, 29] }".into()),
            ("cube", "picture = { size = [21, 25] }\ncamera = { azimuth = 35, elevation = -20, roll = 5 }".into()),
        ] {
            let toml = format!("mode = '{mode}'\n{base}\n{rest}");
            scenes.push(Asked::new(&format!("{name}, {mode}"), &geometry, BYTES, toml));
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
        "mode = 'vr'\nlayout = 'four'\npicture = { size = [27, 31] }".into(),
        "mode = 'cube'\npicture = { size = [40, 30] }\ncamera = { azimuth = -140, elevation = 25, field_of_view = 40 }
         cube = { shading = 0.8, inset = { left = 9, near = 8, top = 2.5, far = 12 }, tilt = { near = [20, -10], top = [-5, 12] } }
         clip = [{ at = [0, 40, 0], normal = [0.5, 0.5, -0.3] }]".into(),
        "mode = 'cube'\npicture = { size = [33, 25] }\ncamera = { azimuth = 90 }\ncube = { shading = 0, edges = false, inset = { left = 12 } }".into(),
        "mode = 'cube'\npicture = { size = [23, 25] }\ncamera = { field_of_view = 70, zoom = 20 }\ncube = { inset = { near = 10 } }".into(),
    ] {
        scenes.push(Asked::new(&toml.replace('\n', ", "), &Geometry::Sweep(wobbler()), BYTES, format!("{toml}\n{base}")));
    }
    scenes
}
