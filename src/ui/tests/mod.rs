//! Hands, keys and settings together, without a window.

mod controls;
mod fingers;
mod mouse;
mod sequences;

use super::command::{Command, Tool};
use super::controls::Controls;
use super::gestures::Gestures;
use super::input::{Button, Input, Modifiers};
use super::picture::Picture;
use crate::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use crate::scene::load::{Layers, PRESETS};
use crate::scene::{Input as Samples, Scene, Settings};
use crate::source::StoredType;
use std::time::Duration;

const BYTES: Samples = Samples { stored: StoredType::U8, range: [0.0, 255.0] };

/// A small abdominal wobbler.
fn wobbler() -> Probe {
    Probe {
        array: Array::Curved { radius: 40.0 },
        lines: Axis::centred(0.02, 61),
        start_depth: 2.0,
        sample_pitch: 0.8,
        samples: 128,
        motion: Motion::Fan { wobble_radius: 20.0 },
        slices: Axis::centred(0.05, 25),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

fn geometries() -> Vec<Geometry> {
    let fan = wobbler();
    let linear = Probe {
        array: Array::Linear,
        lines: Axis::centred(1.1, 40),
        motion: Motion::Translated,
        slices: Axis::centred(1.5, 21),
        samples: 60,
        ..fan.clone()
    };
    let still = Probe { motion: Motion::Still { thickness: 3.0 }, slices: Axis::centred(1.0, 1), ..fan.clone() };
    let thin = Grid { size: [30, 24, 1], spacing: [0.5, 0.4, 0.9], origin: [-4.0, -20.0, -3.0] };
    let cube = Grid { size: [60, 80, 50], spacing: [1.0, 0.9, 1.1], origin: [-30.0, 0.0, -25.0] };
    vec![
        Geometry::Sweep(fan),
        Geometry::Sweep(linear),
        Geometry::Sweep(still),
        Geometry::Cartesian(thin),
        Geometry::Cartesian(cube),
    ]
}

/// Settings by the name of a preset and lines of TOML over it.
fn settings(preset: &str, toml: &str) -> Settings {
    let mut layers = Layers::default();
    if !preset.is_empty() {
        layers.preset(preset).unwrap();
    }
    toml.lines().for_each(|line| layers.set(line).unwrap());
    layers.finish().unwrap()
}

fn presets() -> impl Iterator<Item = &'static str> {
    [""].into_iter().chain(PRESETS.iter().map(|(name, _)| *name))
}

fn scene(geometry: &Geometry, settings: &Settings) -> Scene {
    Scene::new(geometry.clone(), BYTES, settings.clone()).unwrap()
}

/// A window that shows a picture at some place in it, and a hand.
struct Desk {
    geometry: Geometry,
    controls: Controls,
    hand: Gestures,
    corner: [f64; 2],
    /// Pixels of the window for one of the picture.
    enlarged: f64,
    held: Modifiers,
    now: Duration,
}

impl Desk {
    fn new(toml: &str) -> Desk {
        Desk {
            geometry: Geometry::Sweep(wobbler()),
            controls: Controls::new(settings("", toml)),
            hand: Gestures::default(),
            corner: [100.0, 30.0],
            enlarged: 2.0,
            held: Modifiers::default(),
            now: Duration::ZERO,
        }
    }

    fn scene(&self) -> Scene {
        scene(&self.geometry, self.controls.settings())
    }

    /// A place of the picture in the window.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.corner[0] + x * self.enlarged, self.corner[1] + y * self.enlarged]
    }

    fn tool(&mut self, tool: Tool) {
        self.controls.apply(&Command::Tool(tool), None);
    }

    /// Does it and what comes of it.
    fn input(&mut self, input: Input) -> Vec<Command> {
        let scene = self.scene();
        let size = scene.picture_size().map(|n| f64::from(n) * self.enlarged);
        let on = Picture { corner: self.corner, size, scene: Some(&scene), taken: false, now: self.now };
        let commands = self.hand.input(&input, &on, self.controls.tool(), self.held);
        for command in &commands {
            self.controls.apply(command, Some(&scene));
        }
        self.now += Duration::from_millis(50);
        commands
    }

    /// From one place of the picture to another, in steps; presses, moves and lets go.
    fn drag(&mut self, button: Button, from: [f64; 2], to: [f64; 2]) {
        self.input(Input::Moved(self.at(from)));
        self.input(Input::Button { button, pressed: true });
        for n in 1..=20 {
            let share = f64::from(n) / 20.0;
            let at = [0, 1].map(|a| from[a] + (to[a] - from[a]) * share);
            self.input(Input::Moved(self.at(at)));
        }
        self.input(Input::Button { button, pressed: false });
    }

    fn click(&mut self, at: [f64; 2]) -> Vec<Command> {
        self.input(Input::Moved(self.at(at)));
        self.input(Input::Button { button: Button::Left, pressed: true });
        self.input(Input::Button { button: Button::Left, pressed: false })
    }
}
