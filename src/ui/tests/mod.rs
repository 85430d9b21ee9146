//! Gestures, keys and settings together, without a window; and known answers for what commands change.

mod body_marks;
mod budget;
mod cine;
mod clipping;
mod colours;
mod comparing;
mod controls;
mod curving;
mod cutting;
mod first_steps;
mod gestures;
mod kept_picture;
mod keyboard_pointer;
mod labelling;
mod layout;
mod measuring;
mod region;
mod render_start;
mod screen_reader;
mod sequences;
mod shown;
mod sides;
mod start_line;

use super::command::{Command, Face, Tool};
use super::controls::{Change, Controls};
use super::gestures::Gestures;
use super::input::{Button, Input, Modifiers};
use super::picking::Viewport;
use super::sliders::{GAIN, PLANES_ZOOM, SLIDERS, THRESHOLD};
use crate::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use crate::scene::load::{Layers, PRESETS};
use crate::scene::{Input as Samples, Layout, Mode, PlaneName, Scene, Settings};
use crate::source::StoredType;
use glam::DVec3;
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

/// Settings of a preset, with lines of TOML over it.
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

/// A window with a picture in it, and gestures on that.
struct TestWindow {
    geometry: Geometry,
    controls: Controls,
    gestures: Gestures,
    corner: [f64; 2],
    /// Pixels of the window per pixel of the picture.
    enlarged: f64,
    held: Modifiers,
    now: Duration,
}

impl TestWindow {
    fn new(toml: &str) -> TestWindow {
        TestWindow {
            geometry: Geometry::Sweep(wobbler()),
            controls: Controls::new(settings("", toml)),
            gestures: Gestures::default(),
            corner: [100.0, 30.0],
            enlarged: 2.0,
            held: Modifiers::default(),
            now: Duration::ZERO,
        }
    }

    fn scene(&self) -> Scene {
        scene(&self.geometry, self.controls.settings())
    }

    /// Converts a position on the picture to the window.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.corner[0] + x * self.enlarged, self.corner[1] + y * self.enlarged]
    }

    fn tool(&mut self, tool: Tool) {
        self.controls.apply(&Command::Tool(tool), None);
    }

    /// Handles an input and applies its commands.
    fn input(&mut self, input: Input) -> Vec<Command> {
        let scene = self.scene();
        let size = scene.picture_size().map(|n| f64::from(n) * self.enlarged);
        let has_work = self.controls.work().is_some() || self.controls.line().is_some();
        let measures = self.controls.measures().to_vec();
        let body_marks = self.controls.body_marks().to_vec();
        let (corner, scene_shown, now) = (self.corner, Some(&scene), self.now);
        let start_line = &self.controls.start_line().to_vec();
        let on = Viewport {
            corner,
            size,
            scene: scene_shown,
            volume: None,
            measures: &measures,
            body_marks: &body_marks,
            start_line,
            has_work,
            is_covered: false,
            now,
        };
        let commands = self.gestures.input(&input, &on, self.controls.tool(), self.held);
        for command in &commands {
            self.controls.apply(command, Some(&scene));
        }
        self.now += Duration::from_millis(50);
        commands
    }

    /// Drags from one position on the picture to another, in steps.
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

fn apply(window: &mut TestWindow, command: Command) -> Change {
    let scene = window.scene();
    window.controls.apply(&command, Some(&scene))
}

#[test]
fn sliders_have_unique_names_and_the_indices_that_keys_use() {
    assert_eq!([GAIN, THRESHOLD, PLANES_ZOOM].map(|n| SLIDERS[n].name), ["Gain", "Threshold", "Planes zoom"]);
    for (i, slider) in SLIDERS.iter().enumerate() {
        assert!(SLIDERS[..i].iter().all(|other| other.name != slider.name), "{}", slider.name);
        assert!(SLIDERS[..i].iter().all(|other| other.key != slider.key), "{}", slider.key);
        assert!(slider.range[0] < slider.range[1] && slider.step > 0.0 && slider.hint.ends_with('.'));
    }
}

#[test]
fn a_slider_shows_the_value_that_was_set() {
    for mode in ["surface", "volume", "mixed", "mip", "plane", "tomography", "cube"] {
        for preset in ["face", "face-classic", "thesis", "bmode"] {
            let window = settings(preset, &format!("mode='{mode}'"));
            for slider in SLIDERS.iter().filter(|s| s.applies(&window)) {
                for share in [0.3, 0.8] {
                    let mut set = window.clone();
                    let value = slider.range[0] + share * (slider.range[1] - slider.range[0]);
                    slider.set(&mut set, value);
                    // Windows keep their order, and some values are integers.
                    let is_window = slider.name.contains("indow");
                    assert!(is_window || (slider.get(&set) - value).abs() <= 1.0, "{} {mode} {value}", slider.name);
                    let mut same = window.clone();
                    slider.set(&mut same, f64::NAN);
                    assert_eq!(same, window, "{}", slider.name);
                }
            }
        }
    }
}

#[test]
fn every_value_in_the_range_of_a_slider_can_be_set() {
    use Mode::*;
    let modes = [Volume, Surface, Mixed, Mip, MinIp, Mean, Plane, Orthogonal, Tomography, Cube];
    for (geometry, mode) in geometries().iter().flat_map(|g| modes.map(|mode| (g, mode))) {
        let start = Settings { mode, ..settings("", "distance.bilateral={ pixels = 2, distance = 1 }") };
        for (n, slider) in SLIDERS.iter().enumerate().filter(|(_, s)| s.applies(&start)) {
            let shown = scene(geometry, &start);
            let [low, high] = slider.range_in(&shown);
            for value in [low, low + 0.37 * (high - low), high] {
                let mut controls = Controls::new(start.clone());
                controls.apply(&Command::SetSlider(n, value), Some(&shown));
                let mut expected = start.clone();
                slider.set(&mut expected, value);
                assert_eq!(controls.settings(), &expected, "{} at {value} {mode:?}: {:?}", slider.name, shown.geometry);
            }
        }
    }
}

#[test]
fn threshold_window_and_start_depth_belong_to_the_current_mode() {
    let named = |name: &str| SLIDERS.iter().find(|s| s.name == name).unwrap();
    let mut s = settings("", "mode='mixed'");
    named("Threshold").set(&mut s, 0.4);
    named("Start depth").set(&mut s, 12.0);
    assert_eq!((s.surface.threshold, s.volume.threshold, s.surface.start_depth), (0.4, 0.0, Some(12.0)));
    s.mode = Mode::Volume;
    named("Threshold").set(&mut s, 0.3);
    named("Window low").set(&mut s, 0.9);
    named("Window high").set(&mut s, 0.2);
    assert!((s.volume.window[0], s.surface.window) == (0.9, [0.0, 1.0]) && s.volume.window[1] > 0.9);
    assert_eq!((s.surface.threshold, s.volume.threshold), (0.4, 0.3));
    named("Start depth").set(&mut s, 0.0);
    assert_eq!((s.volume.start_depth, s.surface.start_depth), (None, Some(12.0)));
    let mut s = settings("fetal", "");
    named("Smoothing").set(&mut s, 0.7);
    let smooth = s.slices.smooth.unwrap();
    assert!((smooth.depth - 0.4).abs() < 1e-9 && (smooth.elevation - 0.7).abs() < 1e-9, "in proportion");
    named("Smoothing").set(&mut s, 0.0);
    assert_eq!(s.slices.smooth, None);
}

#[test]
fn planes_and_the_4_up_layout_lead_to_each_other() {
    let mut window = TestWindow::new("mode='volume'");
    let shows = |window: &TestWindow| (window.controls.settings().mode, window.controls.settings().layout);
    apply(&mut window, Command::Layout(Layout::Four));
    assert_eq!(shows(&window), (Mode::Volume, Layout::Four));
    apply(&mut window, Command::Plane(PlaneName::C));
    assert_eq!(shows(&window), (Mode::Volume, Layout::Four));
    apply(&mut window, Command::Mode(Mode::Tomography));
    assert_eq!(shows(&window), (Mode::Tomography, Layout::Single));
    apply(&mut window, Command::Layout(Layout::Four));
    assert_eq!(shows(&window), (Mode::Volume, Layout::Four));
    apply(&mut window, Command::Layout(Layout::Single));
    apply(&mut window, Command::Plane(PlaneName::B));
    assert_eq!(shows(&window), (Mode::Plane, Layout::Single));
}

#[test]
fn the_pair_is_of_the_surface_and_other_modes_leave_it() {
    let mut window = TestWindow::new("mode='volume'");
    let shows = |window: &TestWindow| (window.controls.settings().mode, window.controls.settings().layout);
    apply(&mut window, Command::Layout(Layout::Pair));
    assert_eq!(shows(&window), (Mode::Surface, Layout::Pair));
    apply(&mut window, Command::Mode(Mode::Surface));
    assert_eq!(shows(&window), (Mode::Surface, Layout::Pair));
    for mode in [Mode::Volume, Mode::Mixed, Mode::Tomography, Mode::Cube] {
        apply(&mut window, Command::Layout(Layout::Pair));
        apply(&mut window, Command::Mode(mode));
        assert_eq!(shows(&window), (mode, Layout::Single));
    }
    apply(&mut window, Command::Layout(Layout::Pair));
    apply(&mut window, Command::Plane(PlaneName::B));
    assert_eq!(shows(&window), (Mode::Plane, Layout::Single));
    apply(&mut window, Command::Layout(Layout::Pair));
    apply(&mut window, Command::Layout(Layout::Four));
    assert_eq!(shows(&window), (Mode::Surface, Layout::Four));
}

#[test]
fn values_of_a_mode_that_do_not_fit_do_not_block_its_key() {
    let mut window =
        TestWindow::new("projection.start_depth=500\ncube.inset.near=900\nplanes.columns=64\nplanes.rows=64");
    for mode in [Mode::Mip, Mode::Cube, Mode::Tomography] {
        assert_eq!(apply(&mut window, Command::Mode(mode)), Change::Settings);
        assert_eq!(window.scene().settings.mode, mode);
    }
}

#[test]
fn the_region_is_never_too_thin_nor_outside_of_the_insonified_box() {
    let mut window = TestWindow::new("surface.start_depth=30");
    let (low, high) = crate::scene::insonified_box(&window.geometry);
    for axis in 0..3 {
        for is_high in [true, false] {
            apply(&mut window, Command::MoveFace(Face { axis, high: is_high }, 1e4));
        }
    }
    assert!((window.scene().low - low).length() < 1e-9 && (window.scene().high - high).length() < 1e-9);
    for axis in 0..3 {
        apply(&mut window, Command::MoveFace(Face { axis, high: true }, -1e4));
    }
    let scene = window.scene();
    let left = scene.high - scene.low.with_y(scene.surface_view().low.y);
    assert!((left - DVec3::splat(2.0)).length() < 1e-9, "{left}");
}

#[test]
fn there_is_one_viewer_clip_plane_and_it_faces_the_viewer() {
    let mut window = TestWindow::new("clip=[{ at = [0, 0, 0], normal = [0, -1, 0] }]");
    apply(&mut window, Command::MoveClip(5.0));
    apply(&mut window, Command::MoveClip(7.0));
    let clips = window.controls.settings().clip.clone();
    assert_eq!(clips.len(), 2);
    assert_eq!(DVec3::from(clips[1].normal), -DVec3::Y);
    let near = window.scene().low.y - 40.0;
    assert!((clips[1].at[1] - near - 12.0).abs() < 1e-9);
    apply(&mut window, Command::Rotate([60.0, 10.0]));
    apply(&mut window, Command::MoveClip(0.5));
    let turned = window.controls.settings().clip.clone();
    let moved = DVec3::from(turned[1].at) - DVec3::from(clips[1].at);
    assert!(turned.len() == 2 && (moved - window.scene().rays.forward * 0.5).length() < 1e-9, "{moved}");
    apply(&mut window, Command::MoveClip(-1e5));
    assert_eq!(window.controls.settings().clip, clips[..1]);
    let mut full = TestWindow::new(&format!("clip=[{}]", ["{ at = [0, 0, 0], normal = [0, -1, 0] }"; 4].join(", ")));
    assert_eq!(apply(&mut full, Command::MoveClip(5.0)), Change::Nothing);
}

#[test]
fn the_light_follows_the_drag_and_stays_on_the_viewers_side() {
    for toml in ["", "light.position=[0, 30, 40]"] {
        let mut window = TestWindow::new(toml);
        let place = |window: &TestWindow| {
            let light = &window.controls.settings().light;
            light.position.unwrap_or(light.direction).normalize()
        };
        let before = place(&window);
        apply(&mut window, Command::MoveLight([0.1, -0.05]));
        assert!((place(&window) - before).truncate().distance(glam::DVec2::new(0.2, 0.1)) < 1e-9);
        apply(&mut window, Command::MoveLight([-40.0, 90.0]));
        assert!(place(&window).z > 0.1 && place(&window).y < 0.0);
        let near = window.controls.settings().light.position;
        assert!(near.is_none_or(|near| (near.length() - 50.0).abs() < 1e-9));
    }
}

#[test]
fn commands_that_do_not_concern_settings_are_returned_to_the_caller() {
    let mut controls = Controls::new(Settings::default());
    for command in [Command::Freeze, Command::StepCine(-1), Command::SavePicture, Command::ToggleHelp, Command::Exit] {
        assert_eq!(controls.apply(&command, None), Change::Caller(command));
    }
    assert_eq!(controls.apply(&Command::Tool(Tool::Light), None), Change::Tool);
    assert_eq!(controls.apply(&Command::Zoom(2.0), None), Change::Nothing, "nothing is shown");
    controls.resize([1920, 0]);
    controls.reset();
    assert_eq!((controls.tool(), controls.settings().picture.size), (Tool::Rotate, [1920, 64]));
}

#[test]
fn a_shadow_is_restored() {
    let mut window = TestWindow::new("light.shadow={ strength = 0.5, softness = 0 }");
    let before = window.controls.settings().clone();
    apply(&mut window, Command::Shadow(false));
    assert_eq!(window.controls.settings().light.shadow.map(|s| s.strength), Some(0.0));
    apply(&mut window, Command::Shadow(true));
    assert_eq!(window.controls.settings(), &before);
}
