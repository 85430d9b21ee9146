//! For unit tests, also of other members: a scene of a block of voxels.

use crate::probe::{Geometry, Grid, StoredType};
use crate::scene::load::Layers;
use crate::scene::{Input, Scene};

/// A scene for tests: settings given as `key=value` lines, and a Cartesian volume of bytes with `size` voxels of 1 mm along each axis (lateral,
/// depth, elevation), the first at (-20, 0, -10) mm.
///
/// # Panics
/// A setting is unknown or out of its range, or no scene can be made of them.
pub fn block(lines: &[&str], size: [usize; 3]) -> Scene {
    let mut layers = Layers::default();
    lines.iter().for_each(|line| layers.set(line).expect(line));
    let grid = Grid { size, spacing: [1.0; 3], origin: [-20.0, 0.0, -10.0] };
    let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
    Scene::new(Geometry::Cartesian(grid), input, layers.finish().expect("settings")).expect("scene")
}
