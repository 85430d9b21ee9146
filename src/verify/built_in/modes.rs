//! Every mode of the settings in one small sweep, each with filters of every stage.

use super::{ALL_FILTERS, Asked, BYTES, body_frames, wobbler};
use crate::passes::Texels;
use crate::probe::Geometry;
use crate::scene::Scene;

/// What the settings call a mode, and what belongs to it.
const MODES: [(&str, &str); 14] = [
    ("vr", "mode = 'vr'"),
    ("vr, pre-integrated", "mode = 'vr'\nvolume = { compositing = 'pre-integrated', shading = 'depth-coded' }"),
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
];

/// Every mode, once.
pub fn modes() -> Vec<Asked> {
    let sweep = Geometry::Sweep(wobbler());
    MODES.iter().map(|(name, toml)| Asked::new(name, &sweep, BYTES, format!("{toml}\n{ALL_FILTERS}"))).collect()
}

/// A wavy wall between two tissues, each of them a little uneven: something to see and to filter in every mode. Volumes of other
/// numbers have it elsewhere.
pub fn wall(scene: &Scene, number: u32) -> Vec<Texels> {
    let shift = 4.0 * f64::from(number);
    body_frames(scene, |p| {
        let depth = p.y - 42.0 - shift + 3.0 * (0.25 * p.x).sin() + 2.0 * (0.3 * p.z).cos();
        let uneven = 0.08 * (1.9 * p.x + shift).sin() * (1.3 * p.y).cos() * (1.7 * p.z).cos();
        (0.15 + 0.6 * (0.5 + 0.5 * depth).clamp(0.0, 1.0) + uneven).clamp(0.0, 1.0)
    })
}
