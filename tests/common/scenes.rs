//! Scenes from settings as TOML. This file needs nothing but the probe and scene modules: tools/mutants copies it.

use echolume::probe::Geometry;
use echolume::scene::{Input, Scene};
use echolume::source::StoredType;

pub const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
pub const FLOATS: Input = Input { stored: StoredType::F32, range: [0.0, 1.0] };

pub fn scene(geometry: Geometry, input: Input, toml: &str) -> Scene {
    Scene::new(geometry, input, toml::from_str(toml).expect("settings")).expect("scene")
}
