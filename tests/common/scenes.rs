//! Scenes from settings as TOML. This file needs nothing but the probe and scene modules: tools/mutants copies it.

use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene, Settings};
use echolume::low_level::source::StoredType;
use std::path::Path;

pub const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
pub const FLOATS: Input = Input { stored: StoredType::F32, range: [0.0, 1.0] };

/// Settings from TOML. The library deserialises them: `toml::from_str::<Settings>` here would compile serde's code for every setting
/// once more in each test binary, which took more than half of a small binary's build time.
pub fn settings(toml: &str) -> Settings {
    let mut layers = Layers::default();
    layers.table("test", toml.parse().expect("TOML"), Path::new("")).expect("settings");
    layers.finish().expect("settings")
}

pub fn scene(geometry: Geometry, input: Input, toml: &str) -> Scene {
    Scene::new(geometry, input, settings(toml)).expect("scene")
}
