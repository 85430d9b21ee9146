//! The tasks of docs/viewer.md, performed by the inputs of a user: each has the result that it should have, with the number of actions that the
//! page says. The phantom is a ball of known place and size.

mod cuts_and_looks;
mod files;
mod measuring;
mod planes;
mod trouble;

use super::*;
use crate::common::wait;
use cuts_and_looks::*;
use echolume::low_level::gpu::RendererOptions;
use echolume::low_level::measure::body_marks::{centre_of, probe_of};
use echolume::low_level::measure::outcome;
use echolume::low_level::passes::{Slot, is_hit};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::picker::Picker;
use echolume::low_level::scene::{Mode, PlaneName, Scene};
use echolume::low_level::source::live::{Playback, PlaybackSource};
use echolume::low_level::source::phantom::{Body, Label, Phantom, PhantomOptions, PhantomSource, Speckle, Truth};
use echolume::low_level::ui::command::InspectorTab;
use echolume::low_level::ui::panels::accesskit::{Node, Role};
use echolume::low_level::ui::panels::picture_area;
use echolume::low_level::workspace::Origin;
use files::*;
use glam::DVec3;
use measuring::*;
use planes::*;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use trouble::*;

const WINDOW: [u32; 2] = [1000, 700];
/// Lengths, mm: one of the program's own requirements.
const LENGTH: f64 = 0.1;
/// Longer than the clicks of a double click are apart.
const PAUSE: Duration = Duration::from_millis(450);

/// Performs a task, and returns what the page says of its actions.
type Perform = fn(&mut User) -> String;

/// Each task of the page, in its order, and what performs it.
const TASKS: &[(&str, Perform)] = &[
    ("the length of the nose", nose),
    ("the angle of the profile", profile),
    ("head circumference", circumference),
    ("the area of a shadow", shadow),
    ("the way along the cheek", cheek),
    ("the volume of the bladder", bladder),
    ("the volume of a bright body in the region", bright_body),
    ("label a body by hand", hand_label),
    ("label all of a body", grown_label),
    ("name a structure", structure),
    ("point at a structure", arrow),
    ("mark where the probe was", body_mark),
    ("state the patient's sides", sides),
    ("name a measurement", measurement),
    ("correct a caliper", caliper),
    ("take a wrong trace back", wrong_trace),
    ("cut the cord away", cord),
    ("brush a speck away", speck),
    ("results for the report", results),
    ("a picture with its measurements", picture),
    ("a surface to print", |user| export(user, '7', "Relief to print, STL")),
    ("a turntable for a talk", |user| export(user, '8', "Turntable, pictures")),
    ("the volume for 3D Slicer", |user| export(user, '1', "Volume, NRRD")),
    ("go on tomorrow", tomorrow),
    ("another recording", another),
    ("open a file by its path", by_path),
    ("two recordings in turn", in_turn),
    ("go back to the first recording", first_again),
    ("the look of bone", bone),
    ("keep a look for the next patient", kept_look),
    ("the planes through a point", point),
    ("the planes back to the middle", middle),
    ("nine slices at 4 mm", nine_slices),
    ("show the section along a straight line", straight_section),
    ("show the section along a curved line", curved_section),
    ("why is there no picture", no_picture),
    ("see that a source died", dead_source),
    ("leave without loss", leave),
];

/// Requirement: the page says of every task how it is done, and that is how it is done.
#[test]
fn every_task_of_the_page_is_done_with_the_actions_that_it_says() {
    let page = std::fs::read_to_string(repository("docs/viewer.md")).expect("docs/viewer.md");
    let section = page.split("\n## Tasks\n").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("its tasks");
    let rows: Vec<Vec<&str>> = section
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| task |"))
        .map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect())
        .collect();
    let (named, performed): (Vec<_>, Vec<_>) =
        (rows.iter().map(|row| row[0]).collect(), TASKS.iter().map(|(name, _)| *name).collect());
    assert_eq!(named, performed, "tasks of the page, and tasks that are performed");
    let device = Device::new();
    let mut user = User::new(&device);
    for (row, (name, perform)) in rows.iter().zip(TASKS) {
        user.begin(name);
        let actions = perform(&mut user);
        assert_eq!(Some(&actions.as_str()), row.get(2), "{name}: {}", row[1]);
    }
}

/// Someone at a console in a window, whose actions are counted.
struct User {
    device: Arc<Context>,
    console: Console,
    folder: Folder,
    ball: (DVec3, f64),
    task: String,
    actions: usize,
    /// What a screen reader would have been told last: where the buttons and messages are.
    tree: Vec<Node>,
    /// Files that the console had opened.
    opened: Arc<Mutex<Vec<PathBuf>>>,
    request: LoopRequest,
}

fn ball() -> Phantom {
    let options = PhantomOptions {
        body: Body::Sphere,
        speckle: Speckle::None,
        lines: 96,
        samples: 384,
        ..PhantomOptions::default()
    };
    Phantom::new(options).expect("a phantom")
}

/// The same in a narrower sweep, so that less has to be searched.
fn narrow_ball() -> Phantom {
    Phantom::new(PhantomOptions { fan_angle_deg: 40.0, ..ball().options().clone() }).expect("a phantom")
}

fn source(phantom: fn() -> Phantom) -> OpenSource {
    Arc::new(move || {
        let phantom = Box::new(PhantomSource::cached(phantom()));
        Ok(Box::new(PlaybackSource::new(phantom, Playback::Fast, 1)) as Box<dyn Live>)
    })
}

/// Renderings of a ray for 16 pixels, because most tasks need none or one of any resolution: they took half of the time. Planes are whole.
fn ball_options(folder: &Folder) -> ConsoleOptions {
    let Truth::Sphere { centre, .. } = ball().truth() else { panic!("a ball") };
    let around = format!("planes.position = [{}, {}, {}]", centre.x, centre.y - 40.0, centre.z);
    let settings =
        settings(&format!("mode = 'sr'\nsurface.threshold = 0.4\nmarks.bar = true\nray.subsampling = 4\n{around}"));
    let folder = folder.0.join("kept");
    ConsoleOptions { settings, source: SourceKind::Recording, panels: true, folder, ..options() }
}

impl User {
    fn new(device: &Arc<Context>) -> User {
        let Truth::Sphere { centre, radius, .. } = ball().truth() else { panic!("a ball") };
        let folder = Folder::new("tasks");
        let opened = Arc::new(Mutex::new(Vec::new()));
        let all = opened.clone();
        let options = ConsoleOptions {
            origin: Some(Origin::of(Some(PathBuf::from("phantom")))),
            opening: OpeningOptions {
                open_file: Some(Arc::new(move |path, _| {
                    all.lock().expect("lock").push(path.to_path_buf());
                    Ok(Box::new(|| ()))
                })),
                recent: Some(folder.0.join("recent")),
                ..OpeningOptions::default()
            },
            presets: Some(folder.0.join("presets.toml")),
            ..ball_options(&folder)
        };
        let console = Console::new(device, source(ball), options, WINDOW);
        let (device, request) = (device.clone(), LoopRequest::default());
        let mut user = User {
            device,
            console,
            folder,
            ball: (centre, radius),
            task: String::new(),
            actions: 0,
            tree: Vec::new(),
            opened,
            request,
        };
        user.console.describe(true);
        user.until("a volume", |user| (user.console.stream().volumes_shown() > 0).then_some(()));
        user
    }

    /// The state before a task: the settings of the start, and no measurements. What is set up for a task is no action of it.
    fn begin(&mut self, task: &str) {
        for command in [
            Command::CancelMeasure,
            Command::ClearMeasures,
            Command::Tool(Tool::Rotate),
            Command::Reset,
            Command::InspectorTab(InspectorTab::Look),
        ] {
            self.console.execute(&command, Instant::now());
        }
        self.settle();
        (self.task, self.actions, self.request) = (task.to_string(), 0, LoopRequest::default());
    }

    /// Goes to another console with these settings. Returns the one before.
    fn at_another(&mut self, settings: Settings, phantom: fn() -> Phantom) -> Console {
        let options = ConsoleOptions { settings, ..ball_options(&self.folder) };
        let console = Console::new(&self.device, source(phantom), options, WINDOW);
        let kept = std::mem::replace(&mut self.console, console);
        self.until("a volume", |user| (user.console.stream().volumes_shown() > 0).then_some(()));
        self.settle();
        kept
    }

    fn on_planes(&mut self) {
        self.console.execute(&Command::Mode(Mode::Plane), Instant::now());
        self.settle();
    }

    fn update(&mut self) {
        let next = self.console.update(Instant::now() + LATER).expect("the device is there");
        self.request.exit |= next.exit;
        self.request.restart |= next.restart;
        if let Some(tree) = self.console.take_tree() {
            self.tree = tree.nodes.into_iter().map(|(_, node)| node).collect();
        }
    }

    fn until<T>(&mut self, what: &str, mut look: impl FnMut(&mut User) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            self.update();
            if let Some(found) = look(self) {
                return found;
            }
            assert!(begun.elapsed() < BOUND, "{}: no {what}", self.task);
            wait::poll();
        }
    }

    /// Waits until everything is drawn.
    fn settle(&mut self) {
        let mut still = 0;
        self.until("rest", |user| {
            // Measurements are drawn over the picture, and planes have every slice.
            let wanted = user.console.controls().settings().clone();
            let stream = user.console.stream();
            let is_drawn = stream.scene().is_none_or(|scene| {
                let drawn = &scene.settings;
                (drawn.mode, drawn.layout, &drawn.planes) == (wanted.mode, wanted.layout, &wanted.planes)
            });
            still = if stream.is_idle() && is_drawn { still + 1 } else { 0 };
            (still > 5).then_some(())
        });
    }

    fn press(&mut self, held: Modifiers, key: Key) {
        self.console.input(&Input::Modifiers(held));
        self.console.input(&Input::Key { key, pressed: true });
        self.console.input(&Input::Key { key, pressed: false });
        self.console.input(&Input::Modifiers(Modifiers::default()));
        self.settle();
    }

    fn key(&mut self, key: Key) {
        self.actions += 1;
        self.press(Modifiers::default(), key);
    }

    fn letter(&mut self, letter: char) {
        self.key(Key::Char(letter));
    }

    fn control(&mut self, letter: char) {
        self.actions += 1;
        self.press(Modifiers { control: true, ..Modifiers::default() }, Key::Char(letter));
    }

    fn shift(&mut self, letter: char) {
        self.actions += 1;
        self.press(Modifiers { shift: true, ..Modifiers::default() }, Key::Char(letter));
    }

    fn types(&mut self, text: &str) {
        self.actions += 1;
        text.chars().for_each(|letter| self.press(Modifiers::default(), Key::Char(letter)));
    }

    /// Presses and releases the left button along these places of the window.
    fn drag(&mut self, way: &[[f64; 2]]) {
        self.actions += 1;
        wait::pace(PAUSE);
        self.console.input(&Input::Moved(way[0]));
        self.update();
        self.console.input(&Input::Button { button: Button::Left, pressed: true });
        self.update();
        way[1..].iter().for_each(|at| self.console.input(&Input::Moved(*at)));
        self.console.input(&Input::Button { button: Button::Left, pressed: false });
        self.settle();
    }

    fn click(&mut self, at: [f64; 2]) {
        self.drag(&[at]);
    }

    fn wheel(&mut self, notches: f64) {
        self.actions += 1;
        self.console.input(&Input::Scroll(notches));
        self.settle();
    }

    fn scene(&mut self) -> Scene {
        self.console.stream().scene().expect("a scene").clone()
    }

    /// Where the window shows a place on the first tile of planes.
    fn on_tile(&mut self, place: DVec3) -> [f64; 2] {
        let tiling = self.scene().tiling();
        in_window(tiling.project(&tiling.tiles[0], place).0)
    }

    /// Places in the plane of the first tile, relative to the middle of the ball: right, down, mm.
    fn click_plane(&mut self, right: f64, down: f64) {
        let at = self.place(right, down);
        let at = self.on_tile(at);
        self.click(at);
    }

    fn place(&mut self, right: f64, down: f64) -> DVec3 {
        let plane = self.scene().tiling().tiles[0].plane;
        self.ball.0 + plane.right * right + plane.down * down
    }

    /// Drags round the section of the ball, `off` its middle.
    fn trace(&mut self, off: f64) {
        let (centre, radius) = self.ball;
        let tiling = self.scene().tiling();
        let plane = tiling.tiles[0].plane;
        let section = (radius * radius - off * off).sqrt();
        let way: Vec<_> = (0..120)
            .map(|n| {
                let (sin, cos) = (f64::from(n) * TAU / 120.0).sin_cos();
                let place = centre + plane.normal * off + (plane.right * cos + plane.down * sin) * section;
                in_window(tiling.project(&tiling.tiles[0], place).0)
            })
            .collect();
        self.drag(&way);
    }

    /// The n-th quantity of the last measurement is this, within an absolute or a relative error.
    fn measured(&mut self, n: usize, truth: f64, within: f64) {
        let measures = self.console.controls().measures();
        let last = measures.last().unwrap_or_else(|| panic!("{}: nothing is measured", self.task));
        let found = &outcome::quantities(last).expect("results")[n];
        let off = (found.value - truth).abs();
        assert!(off <= within, "{}: {} is {}, not {truth}", self.task, found.name, found.value);
    }

    /// The volume of the first label, cm3; None until labels can be edited.
    fn labelled(&self) -> Option<f64> {
        Some(self.console.controls().labelling()?.volumes().next()?.1)
    }

    fn texts(&self) -> Vec<String> {
        self.console.controls().measures().iter().map(|measured| measured.text.clone()).collect()
    }

    /// The middle of what has this role and a name that begins so, in the window.
    fn shown(&self, role: Role, name: &str) -> Option<[f64; 2]> {
        let is_it = |node: &&Node| node.role() == role && node.label().is_some_and(|label| label.starts_with(name));
        let bounds = self.tree.iter().find(is_it)?.bounds().unwrap_or_default();
        Some([(bounds.x0 + bounds.x1) / 2.0, (bounds.y0 + bounds.y1) / 2.0])
    }

    /// Clicks a control of this role whose name begins so.
    fn click_on(&mut self, role: Role, name: &str) {
        let at = self.until(name, |user| user.shown(role, name));
        self.click(at);
    }

    /// Clicks the rail of a slider where its value is this.
    fn sets(&mut self, name: &str, value: f64) {
        let is_it = |node: &&Node| node.role() == Role::Slider && node.label() == Some(name);
        let slider = self.until(name, |user| user.tree.iter().find(is_it).cloned());
        let bounds = slider.bounds().expect("its place");
        let [low, high] = [slider.min_numeric_value(), slider.max_numeric_value()].map(|n| n.expect("a range"));
        // The middle of the knob, which has 0.8 of the height, stays within the rail.
        let knob = (bounds.y1 - bounds.y0) / 2.5;
        let x = bounds.x0 + knob + (bounds.x1 - bounds.x0 - 2.0 * knob) * (value - low) / (high - low);
        self.click([x, (bounds.y0 + bounds.y1) / 2.0]);
    }

    /// Waits for a file with this ending.
    fn saved(&mut self, ending: &str) -> PathBuf {
        let kept = self.folder.0.join("kept");
        self.until(ending, |_| {
            let files = std::fs::read_dir(&kept).into_iter().flatten().flatten().map(|entry| entry.path());
            let is_whole = |file: &PathBuf| std::fs::metadata(file).is_ok_and(|file| file.len() > 0);
            files.filter(|file| file.extension().is_some_and(|end| end == ending)).find(is_whole)
        })
    }

    fn count(&self) -> String {
        self.actions.to_string()
    }

    /// A caliper of so many mm to the right of the middle of the ball, on planes; no action of the task.
    fn has_caliper(&mut self, length: f64) {
        self.on_planes();
        let ends = [self.place(0.0, 0.0), self.place(length, 0.0)].map(|place| Scene::point_of(&self.scene(), place));
        self.console
            .execute(&Command::Tool(Tool::Measure(echolume::low_level::scene::MeasureKind::Distance)), Instant::now());
        ends.iter().for_each(|end| self.console.execute(&Command::Point(*end, false), Instant::now()));
        self.settle();
    }
}

fn in_window([x, y]: [f64; 2]) -> [f64; 2] {
    let corner = picture_area(WINDOW, 1.0, true).0.map(f64::from);
    [corner[0] + x, corner[1] + y]
}
