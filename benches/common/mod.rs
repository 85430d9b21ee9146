//! What both benches share: the phantom's sweep, scenes of it, and the command line.

use criterion::Criterion;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::StoredType;
use echolume::low_level::source::phantom::{Phantom, PhantomOptions};
use std::time::Duration;

/// Bytes of the phantom.
pub const BYTES: Input = Input { stored: StoredType::U8, range: [0.0, 255.0] };

/// What `cargo bench` and `cargo test` add to the command line, or the user.
#[derive(Clone, Copy, PartialEq)]
pub enum Run {
    /// Measure.
    Bench,
    /// Run each bench once: whether it works at all. Criterion's rule: `--test`, or no `--bench`, which only `cargo bench` adds.
    Test,
    /// Only names.
    List,
}

impl Run {
    pub fn from_arguments() -> Run {
        let given = |flag: &str| std::env::args().any(|a| a == flag);
        match (given("--list"), given("--test") || !given("--bench")) {
            (true, _) => Run::List,
            (_, true) => Run::Test,
            _ => Run::Bench,
        }
    }
}

/// Ten samples in about a second: a full run stays under five minutes on two cores. `--sample-size` and
/// `--measurement-time` ask for more.
pub fn criterion() -> Criterion {
    let short = Criterion::default().sample_size(10).warm_up_time(Duration::from_millis(200));
    short.measurement_time(Duration::from_secs(1)).without_plots().configure_from_args()
}

/// A sweep of the phantom's head.
pub fn phantom(frames: usize, lines: usize, samples: usize) -> Result<Phantom, String> {
    Phantom::new(PhantomOptions { frames, lines, samples, ..PhantomOptions::default() }).map_err(|e| e.to_string())
}

/// A scene of the phantom's preset, as `echolume render` draws it, and what is set beyond it.
pub fn scene(geometry: Geometry, set: &[String]) -> Result<Scene, String> {
    let mut layers = Layers::default();
    layers.preset("face-classic").map_err(|e| e.to_string())?;
    for assignment in set {
        layers.set(assignment).map_err(|e| e.to_string())?;
    }
    let settings = layers.finish().map_err(|e| e.to_string())?;
    Scene::new(geometry, BYTES, settings).map_err(|e| e.to_string())
}
