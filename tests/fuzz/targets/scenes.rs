//! Settings from files and the command line. What is accepted must make a scene or be refused, and a scene a plan.

use super::probes::wobbler;
use super::{told, written};
use echolume::low_level::passes::DispatchArgs;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Advance, Axis, Geometry, Grid, Motion, Probe};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene, Settings, transfer};
use echolume::low_level::source::StoredType;

fn geometries() -> [Geometry; 3] {
    let fan = Probe { advance: Advance::Same(0.02), ..wobbler() };
    let still = Motion::Still { thickness: 1.0 };
    let frame = Probe { motion: still, slices: Axis::centred(1.0, 1), advance: Advance::None, ..fan.clone() };
    let grid = Grid { size: [9, 8, 7], spacing: [1.0, 0.5, 2.0], origin: [-4.0, 0.0, -6.0] };
    [Geometry::Sweep(fan), Geometry::Sweep(frame), Geometry::Cartesian(grid)]
}

fn planned(settings: &Settings) -> String {
    let mut outcome = String::new();
    for geometry in geometries() {
        for (stored, range) in [(StoredType::U8, [0.0, 255.0]), (StoredType::F32, [-1e9, 1e9])] {
            let input = Input { stored, range };
            let usual = Scene::new(geometry.clone(), input, Settings::default()).expect("the default");
            let scene = match Scene::new(geometry.clone(), input, settings.clone()) {
                Ok(scene) => scene,
                Err(error) => {
                    outcome += &told(error);
                    continue;
                }
            };
            let plan = Plan::new(&scene);
            assert!(!plan.steps.is_empty() && plan.bytes(&scene) > 0);
            assert!(!plan.explain(&scene).is_empty());
            for step in &plan.steps {
                let (pass, args) = (step.pass, DispatchArgs { iteration: step.iteration, ..DispatchArgs::default() });
                pass.invocations(&scene, &args);
                let _ = (pass.shader(&scene, &args), pass.constants(&scene, &args));
            }
            let _ = (Plan::new(&usual).rerun(&usual, &scene), plan.rerun(&scene, &usual), plan.rerun(&scene, &scene));
            outcome += &format!("{:?}", scene.settings.mode);
        }
    }
    outcome
}

pub fn scene_file(bytes: &[u8]) -> String {
    let mut layers = Layers::default();
    match layers.file(&written("scene.toml", bytes)).and_then(|()| layers.finish()) {
        Ok(settings) => planned(&settings),
        Err(error) => told(error),
    }
}

/// A line is an assignment of `--set`.
pub fn assignments(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let (mut layers, mut outcome) = (Layers::default(), String::new());
    for line in text.lines().take(32) {
        let mut next = layers.clone();
        // The command line ends at the first wrong one; here the others are tried as well.
        match next.set(line) {
            Ok(()) => layers = next,
            Err(error) => outcome += &error.to_string(),
        }
    }
    match layers.finish() {
        Ok(settings) => outcome + &planned(&settings),
        Err(error) => outcome + &error.to_string(),
    }
}

pub fn transfer_file(bytes: &[u8]) -> String {
    let path = written("transfer.toml", bytes);
    let mut layers = Layers::default();
    let settings = layers.set(&format!("volume.transfer={}", path.display())).and_then(|()| layers.finish());
    let settings = match settings {
        Ok(settings) => settings,
        Err(error) => return told(error),
    };
    if let Some(fault) = transfer::fault(&settings.volume.transfer) {
        return told(fault);
    }
    let table = transfer::table(&transfer::of(&settings.volume), 0.1, transfer::ENTRIES);
    assert!(table.iter().flatten().all(|v| v.is_finite()));
    assert!(transfer::pre_integrated(&table).iter().flatten().all(|v| v.is_finite()));
    "a table".into()
}
