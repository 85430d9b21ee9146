//! The tasks of docs/viewer.md, performed by the inputs of a user: each has the result that it should have, with the number of actions that the
//! page says. The phantom is a ball of known place and size.

use super::*;
use echolume::gpu::RendererOptions;
use echolume::measure::body_marks::{centre_of, probe_of};
use echolume::measure::outcome;
use echolume::passes::{Slot, is_hit};
use echolume::scene::load::Layers;
use echolume::scene::picker::Picker;
use echolume::scene::{Mode, PlaneName, Scene};
use echolume::source::live::{Playback, PlaybackSource};
use echolume::source::phantom::{Body, CachedPhantom, Label, Phantom, PhantomOptions, Speckle, Truth};
use echolume::ui::panels::accesskit::{Node, Role};
use echolume::ui::panels::picture_area;
use echolume::workspace::Origin;
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

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
    ("the volume of all bright tissue in the region", bright_tissue),
    ("name a structure", structure),
    ("point at a structure", arrow),
    ("mark where the probe was", body_mark),
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
    ("two recordings in turn", in_turn),
    ("go back to the first recording", first_again),
    ("the look of bone", bone),
    ("keep a look for the next patient", kept_look),
    ("the planes through a point", point),
    ("the planes back to the middle", middle),
    ("show the section along a straight line", straight_section),
    ("show the section along a curved line", curved_section),
    ("why is there no picture", no_picture),
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

fn source(phantom: fn() -> Phantom) -> OpenSource {
    Arc::new(move || {
        let phantom = Box::new(CachedPhantom::new(phantom()));
        Ok(Box::new(PlaybackSource::new(phantom, Playback::Fast, 1)) as Box<dyn Live>)
    })
}

/// Renderings of a ray for 16 pixels, because most tasks need none or one of any resolution: they took half of the time. Planes are whole.
fn ball_options(folder: &Folder) -> ConsoleOptions {
    let Truth::Sphere { centre, .. } = ball().truth() else { panic!("a ball") };
    let around = format!("planes.position = [{}, {}, {}]", centre.x, centre.y - 40.0, centre.z);
    let settings =
        settings(&format!("mode = 'sr'\nsurface.threshold = 0.4\nmarks.bar = true\nray.quarter = true\n{around}"));
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
            open_file: Some(Arc::new(move |path, _| {
                all.lock().expect("lock").push(path.to_path_buf());
                Ok(Box::new(|| ()))
            })),
            recent: Some(folder.0.join("recent")),
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
        for command in [Command::CancelMeasure, Command::ClearMeasures, Command::Tool(Tool::Rotate), Command::Reset] {
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
            std::thread::sleep(Duration::from_millis(1));
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
        std::thread::sleep(PAUSE);
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
        let sheet = self.scene().sheet();
        in_window(sheet.project(&sheet.tiles[0], place).0)
    }

    /// Places in the plane of the first tile, relative to the middle of the ball: right, down, mm.
    fn click_plane(&mut self, right: f64, down: f64) {
        let at = self.place(right, down);
        let at = self.on_tile(at);
        self.click(at);
    }

    fn place(&mut self, right: f64, down: f64) -> DVec3 {
        let plane = self.scene().sheet().tiles[0].plane;
        self.ball.0 + plane.right * right + plane.down * down
    }

    /// Drags round the section of the ball, `off` its middle.
    fn trace(&mut self, off: f64) {
        let (centre, radius) = self.ball;
        let sheet = self.scene().sheet();
        let plane = sheet.tiles[0].plane;
        let section = (radius * radius - off * off).sqrt();
        let way: Vec<_> = (0..120)
            .map(|n| {
                let (sin, cos) = (f64::from(n) * TAU / 120.0).sin_cos();
                let place = centre + plane.normal * off + (plane.right * cos + plane.down * sin) * section;
                in_window(sheet.project(&sheet.tiles[0], place).0)
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

    fn texts(&self) -> Vec<String> {
        self.console.controls().measures().iter().map(|measured| measured.text.clone()).collect()
    }

    /// The middle of what has this role and a name that begins so, in the window.
    fn shown(&self, role: Role, name: &str) -> Option<[f64; 2]> {
        let is_it = |node: &&Node| node.role() == role && node.label().is_some_and(|label| label.starts_with(name));
        let bounds = self.tree.iter().find(is_it)?.bounds().unwrap_or_default();
        Some([(bounds.x0 + bounds.x1) / 2.0, (bounds.y0 + bounds.y1) / 2.0])
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
        self.console.execute(&Command::Tool(Tool::Measure(echolume::scene::MeasureKind::Distance)), Instant::now());
        ends.iter().for_each(|end| self.console.execute(&Command::Point(*end, false), Instant::now()));
        self.settle();
    }
}

fn in_window([x, y]: [f64; 2]) -> [f64; 2] {
    let corner = picture_area(WINDOW, 1.0, true).0.map(f64::from);
    [corner[0] + x, corner[1] + y]
}

fn nose(user: &mut User) -> String {
    user.letter('7');
    user.letter('m');
    let radius = user.ball.1;
    user.click_plane(-radius, 0.0);
    user.click_plane(radius, 0.0);
    user.measured(0, 2.0 * radius, LENGTH);
    user.count()
}

fn profile(user: &mut User) -> String {
    user.on_planes();
    user.letter('n');
    [[15.0, 0.0], [0.0, 0.0], [0.0, 9.0]].into_iter().for_each(|[right, down]| user.click_plane(right, down));
    user.measured(0, 90.0, 0.1);
    user.count()
}

fn circumference(user: &mut User) -> String {
    user.on_planes();
    user.letter('e');
    let radius = user.ball.1;
    [[0.0, -radius], [0.0, radius], [radius, 0.0]].into_iter().for_each(|[right, down]| user.click_plane(right, down));
    user.measured(1, TAU * radius, LENGTH);
    user.count()
}

fn shadow(user: &mut User) -> String {
    user.on_planes();
    user.letter('o');
    user.trace(0.0);
    let area = PI * user.ball.1.powi(2) / 100.0;
    user.measured(0, area, 0.01 * area);
    user.count()
}

/// The path along the ball between two places half a radian to the left and to the right of its front. The surface that is found lies within
/// the width of a sample and of a slice of the ball.
fn cheek(user: &mut User) -> String {
    // A length on the surface is as exact as the rays are dense.
    let mut settings = ball_options(&user.folder).settings;
    settings.ray.quarter = false;
    let kept = user.at_another(settings, ball);
    user.on_planes();
    user.letter('1');
    user.letter('u');
    let (centre, radius) = user.ball;
    let scene = user.scene();
    for angle in [-0.5_f64, 0.5] {
        let place = centre + (scene.rays.right * angle.sin() - scene.rays.forward * angle.cos()) * radius;
        let at = Picker::of(&scene).project(place).expect("in front");
        user.click(in_window(at));
    }
    user.measured(0, radius, LENGTH);
    user.console = kept;
    user.count()
}

/// Contours every 4 mm. Their volume is that of the ball to 1 % (tests/unit_pure/measure.rs); those of the mouse, to a pixel, were 0.3 % off.
fn bladder(user: &mut User) -> String {
    const STEP: f64 = 4.0;
    let (radius, centre) = (user.ball.1, user.ball.0);
    user.letter('7');
    user.letter('w');
    let planes = (2.0 * radius / STEP).floor() as usize;
    let first = -0.5 * STEP * (planes - 1) as f64;
    user.console.execute(&Command::StepPlane(first), Instant::now());
    user.settle();
    for n in 0..planes {
        let off = (user.scene().sheet().tiles[0].plane.at - centre).dot(user.scene().sheet().tiles[0].plane.normal);
        assert!((off - first - STEP * n as f64).abs() < 1e-6, "the wheel moved the plane to {off}");
        user.trace(off);
        user.wheel(STEP);
    }
    user.key(Key::Enter);
    let volume = 4.0 / 3.0 * PI * radius.powi(3) / 1000.0;
    user.measured(0, volume, 0.01 * volume);
    format!("{} + 2 a plane", user.actions - 2 * planes)
}

/// The voxels of the ball. Its edge is one sample and one slice wide, and half of a compressed echo lies at its outer side: 1.8 % too many.
fn bright_tissue(user: &mut User) -> String {
    user.letter('k');
    user.until("result", |user| (!user.console.controls().measures().is_empty()).then_some(()));
    let volume = 4.0 / 3.0 * PI * user.ball.1.powi(3) / 1000.0;
    user.measured(0, volume, 0.02 * volume);
    user.count()
}

fn structure(user: &mut User) -> String {
    user.on_planes();
    user.letter('i');
    user.click_plane(3.0, 4.0);
    user.types("nose");
    user.key(Key::Enter);
    assert_eq!((user.texts(), user.console.controls().typing()), (vec!["nose".to_string()], None));
    user.count()
}

fn arrow(user: &mut User) -> String {
    user.on_planes();
    user.letter('y');
    user.click_plane(3.0, 4.0);
    user.click_plane(12.0, 14.0);
    user.types("lip");
    user.key(Key::Enter);
    assert_eq!((user.texts(), user.console.controls().typing()), (vec!["lip".to_string()], None));
    user.count()
}

fn body_mark(user: &mut User) -> String {
    user.shift('b');
    let button = user.shown(Role::Button, "Fetus, breech").expect("a button");
    user.click(button);
    let picture = user.scene().picture_size().map(f64::from);
    let mark = user.console.controls().body_marks()[0];
    let [x, y] = centre_of(&mark, picture);
    let place = [x + 0.2 * mark.size * picture[1], y];
    user.click(in_window(place));
    let mark = user.console.controls().body_marks()[0];
    assert_eq!(mark.body, echolume::scene::Body::FetusBreech);
    let off = probe_of(&mark, picture);
    assert!((off[0] - place[0]).hypot(off[1] - place[1]) < 0.1, "{off:?}, {place:?}");
    user.count()
}

fn measurement(user: &mut User) -> String {
    user.has_caliper(10.0);
    let at = user.shown(Role::Button, "1 Caliper").expect("a line of the list");
    user.click(at);
    assert_eq!(user.console.controls().typing(), Some(0), "a click on the list");
    user.types("crl");
    user.key(Key::Enter);
    assert_eq!(user.texts(), ["crl"]);
    user.measured(0, 10.0, 1e-6);
    user.count()
}

fn caliper(user: &mut User) -> String {
    user.has_caliper(10.0);
    let way = [10.0, 12.0, 16.0].map(|right| user.place(right, 0.0)).map(|place| user.on_tile(place));
    user.drag(&way);
    user.measured(0, 16.0, LENGTH);
    assert_eq!(user.console.controls().measures().len(), 1, "no other one");
    user.count()
}

fn wrong_trace(user: &mut User) -> String {
    user.on_planes();
    user.letter('o');
    user.trace(0.0);
    assert_eq!(user.console.controls().measures().len(), 1);
    user.actions = 0;
    user.control('z');
    assert_eq!(user.console.controls().measures().len(), 0);
    user.count()
}

/// The fetal head, which lies still.
fn head() -> Phantom {
    let options = PhantomOptions { lines: 96, samples: 384, still: true, ..PhantomOptions::default() };
    Phantom::new(options).expect("a phantom")
}

/// What each ray of a rendering meets first, by the phantom's labels: what the surface is at the place that mode surface finds.
fn met(device: &Arc<Context>, phantom: &Phantom, scene: &Scene) -> Vec<Option<Label>> {
    let mut settings = Settings { mode: Mode::Surface, ..scene.settings.clone() };
    (settings.surface.threshold, settings.ray.quarter) = (0.18, false);
    let scene = Scene::new(scene.geometry.clone(), scene.input, settings).expect("a scene");
    let mut renderer = Renderer::new(device, scene.clone(), &RendererOptions::default()).expect("a renderer");
    for frame in phantom.volume(0) {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("a frame");
    }
    renderer.show(0).expect("a volume");
    renderer.picture().expect("a picture");
    let distances = renderer.read(Slot::Distance).expect("read").expect("distances");
    let width = distances.size[0];
    let label = |n: usize| {
        let distance = distances.values[n];
        let (origin, direction) = scene.rays.at((n % width) as f64 + 0.5, (n / width) as f64 + 0.5);
        // The surface that is found lies up to a few mm in front of the skin: so wide is the beam.
        let mut behind =
            (0..8).map(|n| phantom.label(0, origin + direction * (distance + 0.5 * f64::from(n))).expect("a label"));
        is_hit(distance).then(|| behind.find(|label| *label != Label::Fluid).unwrap_or(Label::Fluid))
    };
    (0..distances.values.len()).map(label).collect()
}

/// Rays of the largest part of a picture that meets this: the end of the cord lies in the wall, where nobody sees that it is there.
fn largest_part(met: &[Option<Label>], width: usize, label: Label) -> Vec<bool> {
    let mut seen = vec![false; met.len()];
    let mut largest = Vec::new();
    for first in 0..met.len() {
        let mut part = Vec::new();
        let mut waiting = vec![first];
        while let Some(n) = waiting.pop() {
            if met.get(n) == Some(&Some(label)) && !seen[n] {
                seen[n] = true;
                part.push(n);
                waiting.extend([n + 1, n + width].into_iter().chain(n.checked_sub(1)).chain(n.checked_sub(width)));
            }
        }
        if part.len() > largest.len() {
            largest = part;
        }
    }
    let mut is_in = vec![false; met.len()];
    largest.into_iter().for_each(|n| is_in[n] = true);
    is_in
}

/// At another console, of the fetal head, from the front: by the phantom's labels the cord is gone from the picture, and the rest is as before.
/// The front of the ball, as seen, is brushed away as deep as the brush reaches.
fn speck(user: &mut User) -> String {
    let scene = user.scene();
    let front = user.ball.0 - scene.rays.forward * user.ball.1;
    let middle = Picker::of(&scene).project(front).expect("in front");
    user.letter('z');
    let way: Vec<_> = (-10..=10).map(|n| in_window([middle[0] + 2.0 * f64::from(n), middle[1]])).collect();
    user.drag(&way);
    let scene = user.scene();
    let shape = scene.cuts().next().expect("a cut");
    let deeper = |mm: f64| front + scene.rays.forward * mm;
    // The surface is found within the width of a sample and of a slice.
    assert!(shape.removes(deeper(0.0)) && shape.removes(deeper(2.5)) && !shape.removes(deeper(6.0)));
    user.count()
}

fn bone(user: &mut User) -> String {
    user.control('p');
    user.letter('5');
    let settings = user.console.controls().settings();
    assert_eq!((settings.surface.threshold, settings.distance.median), (0.08, 15), "those of preset bone");
    user.count()
}

fn kept_look(user: &mut User) -> String {
    user.console.execute(&Command::Mode(Mode::Mip), Instant::now());
    user.settle();
    user.control('p');
    user.letter('s');
    user.types("thin");
    user.key(Key::Enter);
    let kept = echolume::user_presets::read(&user.folder.0.join("presets.toml")).expect("presets");
    assert_eq!((kept[0].name.as_str(), kept[0].look().expect("a look").mode), ("thin", Mode::Mip));
    let actions = user.count();
    user.press(Modifiers::default(), Key::Escape);
    actions
}

fn cord(user: &mut User) -> String {
    let phantom = head();
    let mut layers = Layers::default();
    layers.preset("face").expect("the preset");
    let mut settings = layers.finish().expect("settings");
    settings.ray.quarter = true;
    let kept = user.at_another(settings, head);
    let scene = user.scene();
    let before = met(&user.device, &phantom, &scene);
    let [width, height] = scene.picture_size().map(|n| n as usize);
    assert_eq!(before.len(), width * height);
    let cord = largest_part(&before, width, Label::Cord);
    // Down along the cord, and up again, a little beside it, and over the edge of the picture.
    let rows: Vec<[f64; 3]> = (0..height)
        .filter_map(|y| {
            let of_cord = |x: &usize| cord[y * width + x];
            let ends = [(0..width).find(of_cord)?, (0..width).rev().find(of_cord)?];
            Some([y, ends[0], ends[1]].map(|n| n as f64 + 0.5))
        })
        .collect();
    let ends = [rows[0][0] - BESIDE, rows[rows.len() - 1][0] + BESIDE];
    let around: Vec<[[f64; 2]; 2]> = (0..=(ends[1] - ends[0]) as usize)
        .map(|n| {
            let y = ends[0] + n as f64;
            let near = rows.iter().filter(|row| (row[0] - y).abs() <= BESIDE);
            let wide = near.map(|[at, left, right]| {
                let by = (BESIDE * BESIDE - (at - y) * (at - y)).sqrt();
                [left - by, right + by]
            });
            let [left, right] = wide.fold([f64::INFINITY, 0.0], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
            [[left, y], [right, y]].map(in_window)
        })
        .collect();
    let way: Vec<_> = around.iter().map(|row| row[1]).chain(around.iter().rev().map(|row| row[0])).collect();
    user.letter('f');
    user.drag(&way);
    user.until("cut", |user| (user.scene().settings.cuts.len() == 1).then_some(()));
    let scene = user.scene();
    let after = met(&user.device, &phantom, &scene);
    let was = cord.iter().filter(|of_cord| **of_cord).count();
    let is = cord.iter().zip(&after).filter(|(of_cord, met)| **of_cord && **met == Some(Label::Cord)).count();
    assert!(was > 2000 && is < was / 50, "{was} rays met the cord, {is} do");
    // Along the contour the smallest part of a slice may be missing.
    for label in [Label::Skin, Label::Hand] {
        let seen = || before.iter().zip(&after).filter(|(before, _)| **before == Some(label));
        let (all, stay) = (seen().count(), seen().filter(|(before, after)| before == after).count());
        assert!(all > 2000 && stay as f64 > 0.99 * all as f64, "{}: {stay} of {all} rays", label.name());
    }
    user.console = kept;
    user.count()
}

/// How far beside the cord the contour is drawn, pixels.
const BESIDE: f64 = 10.0;

/// On a desktop the text is on its clipboard; without one it is in a file.
fn results(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.control('c');
    if user.shown(Role::Status, "The results are copied as CSV").is_none() {
        let text = std::fs::read_to_string(user.saved("csv")).expect("a table");
        assert!(text.contains("10.0000"), "{text}");
    }
    user.count()
}

fn picture(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.letter('p');
    let file = user.saved("png");
    let saved = user.until("whole picture", |_| Picture::load(&file).ok());
    let size = picture_area(WINDOW, 1.0, true).1;
    assert!(saved.width == size[0] && saved.height > size[1], "with its bar: {} x {}", saved.width, saved.height);
    // The middle of the caliper is yellow.
    let at = user.place(5.0, 0.0);
    let [x, y] = user.on_tile(at);
    let [left, top] = picture_area(WINDOW, 1.0, true).0.map(f64::from);
    let pixel = |x: f64, y: f64| &saved.rgba[4 * ((y as u32 * saved.width + x as u32) as usize)..][..3];
    let near = (-1..=1).map(|dy| pixel(x - left, y - top + f64::from(dy)));
    assert!(near.into_iter().any(|p| p[0] > 200 && p[1] > 150 && p[2] < 150), "no line at {x}, {y}");
    user.count()
}

/// The number that the menu has for this format; the key would start the program that this test is. tests/window/panels.rs presses it.
fn export(user: &mut User, number: char, name: &str) -> String {
    let test = std::fs::read_to_string(repository("tests/window/panels.rs")).expect("tests/window/panels.rs");
    let is_made = [format!("('{number}', "), format!("export('{number}')")].iter().any(|made| test.contains(made));
    assert!(is_made, "tests/window/panels.rs makes no export {number}");
    user.control('e');
    // All entries are as wide.
    let place = |node: &Node| node.bounds().unwrap_or_default();
    let is_it = |node: &&Node| node.role() == Role::Button && node.label() == Some(name);
    let own = user.tree.iter().find(is_it).map(place).unwrap_or_else(|| panic!("{name} is not in the menu"));
    let is_above = |node: &&Node| (place(node).x0, place(node).x1) == (own.x0, own.x1) && place(node).y0 <= own.y0;
    let above = user.tree.iter().filter(|node| node.role() == Role::Button).filter(is_above).count();
    assert_eq!(above, number as usize - '0' as usize, "{name} has another number");
    let count = user.actions + 1;
    user.key(Key::Escape);
    count.to_string()
}

fn tomorrow(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.control('s');
    let file = user.saved("toml");
    user.until("note of the saved file", |user| user.shown(Role::Status, "Saved"));
    // Tomorrow.
    user.control('o');
    user.actions += 1;
    user.console.input(&Input::Key { key: Key::Char('1'), pressed: true });
    user.console.input(&Input::Key { key: Key::Char('1'), pressed: false });
    user.until("file that is opened", |user| user.request.restart.then_some(()));
    assert_eq!(*user.opened.lock().expect("lock"), [file], "the workspace is the first of the list");
    user.opened.lock().expect("lock").clear();
    user.count()
}

/// As the window hands it on.
fn another(user: &mut User) -> String {
    let dropped = PathBuf::from("/data/other.mha");
    user.actions += 1;
    user.console.open_path(&dropped);
    user.until("file that is opened", |user| user.request.restart.then_some(()));
    assert_eq!(*user.opened.lock().expect("lock"), [dropped]);
    user.count()
}

impl User {
    /// Waits until the console asks to be replaced, as a window would do at once, by one that shows this.
    fn opens(&mut self, path: &Path) {
        self.until("file that is opened", |user| user.request.restart.then_some(()));
        self.request.restart = false;
        assert_eq!(self.opened.lock().expect("lock").drain(..).next_back().as_deref(), Some(path));
    }
}

fn in_turn(user: &mut User) -> String {
    user.actions += 1;
    for path in ["/data/before.mha", "/data/after.mha"] {
        user.console.drop_file(Path::new(path));
    }
    user.opens(Path::new("/data/before.mha"));
    user.actions += 1;
    user.press(Modifiers { control: true, ..Modifiers::default() }, Key::PageDown);
    user.opens(Path::new("/data/after.mha"));
    user.count()
}

/// tests/gpu/console/recordings.rs holds that it comes back as it was left.
fn first_again(user: &mut User) -> String {
    user.actions += 1;
    user.press(Modifiers { control: true, ..Modifiers::default() }, Key::PageUp);
    user.opens(Path::new("/data/before.mha"));
    user.count()
}

fn point(user: &mut User) -> String {
    user.letter('8');
    user.letter('s');
    let wanted = user.place(7.0, -4.0);
    let at = user.on_tile(wanted);
    user.click(at);
    let scene = user.scene();
    for name in [PlaneName::A, PlaneName::B, PlaneName::C] {
        let plane = scene.plane(name);
        let off = (wanted - plane.at).dot(plane.normal).abs();
        assert!(off < 1e-6, "plane {name:?} is {off} mm beside the point");
    }
    user.count()
}

fn middle(user: &mut User) -> String {
    user.on_planes();
    assert!(user.console.controls().settings().planes.position.is_some());
    user.letter('j');
    let scene = user.scene();
    let off = scene.plane(PlaneName::A).at - (scene.low + scene.high) / 2.0;
    assert!(off.length() < 1e-6, "{off}");
    user.count()
}

/// The section through the ball along a line shows its outline; along a line of three points it has the length of that line.
fn straight_section(user: &mut User) -> String {
    user.shift('c');
    let radius = user.ball.1;
    let ends = [-1.5 * radius, 1.5 * radius].map(|right| user.place(right, 0.0));
    let [from, to] = ends.map(|place| user.on_tile(place));
    user.drag(&[from, [from[0] + 20.0, from[1]], to]);
    let scene = user.scene();
    let tile = scene.sheet().tiles.pop().filter(|tile| tile.section.is_some()).expect("a section");
    let length = tile.section.as_ref().map_or(0.0, |section| section.line.length());
    assert!((length - 3.0 * radius).abs() < LENGTH, "{length} mm");
    let (middle, off) = scene.sheet().project(&tile, user.ball.0);
    let wanted = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0);
    assert!(off.abs() < LENGTH && (middle[0] - wanted[0]).abs() * tile.pixel < LENGTH, "{middle:?} {wanted:?}");
    user.count()
}

fn curved_section(user: &mut User) -> String {
    user.shift('c');
    let points = [[-12.0, 0.0], [0.0, 6.0], [12.0, 0.0], [20.0, -9.0]];
    points.iter().for_each(|[right, down]| user.click_plane(*right, *down));
    user.key(Key::Enter);
    let curve = user.console.controls().settings().planes.curve.clone().expect("a curve");
    let scene = user.scene();
    for (point, [right, down]) in curve.points.iter().zip(points) {
        let wanted = user.place(right, down);
        let off = scene.place_on_plane(curve.plane, *point).distance(wanted);
        assert!(off < LENGTH, "{off} mm beside {wanted}");
    }
    assert!(scene.has_curve() && user.actions == 2 + points.len());
    "2 + 1 a point".into()
}

/// At another console, whose probe does not answer.
fn no_picture(user: &mut User) -> String {
    let open: OpenSource = Arc::new(|| Err("connection refused".into()));
    let options = ConsoleOptions {
        retry: Some(Duration::from_secs(60)),
        source: SourceKind::Probe,
        ..ball_options(&user.folder)
    };
    user.console = Console::new(&user.device, open, options, WINDOW);
    user.console.describe(true);
    user.until("banner", |user| {
        let mut messages = user.tree.iter().filter(|node| matches!(node.role(), Role::Alert | Role::Status));
        messages.any(|node| node.label().is_some_and(|text| text.contains("connection refused"))).then_some(())
    });
    user.key(Key::Function(2));
    user.until("times", |user| user.shown(Role::Group, "Times"));
    user.count()
}

/// At another console, of a probe whose volume is in no file.
fn leave(user: &mut User) -> String {
    let options = ConsoleOptions { source: SourceKind::Probe, ..ball_options(&user.folder) };
    user.console = Console::new(&user.device, source(ball), options, WINDOW);
    user.until("a volume", |user| (user.console.stream().volumes_shown() > 0).then_some(()));
    user.request = LoopRequest::default();
    user.key(Key::Escape);
    assert!(user.console.asks_to_leave() && !user.request.exit);
    user.key(Key::Enter);
    user.until("end", |user| user.request.exit.then_some(()));
    assert!(std::fs::metadata(user.saved("frames")).is_ok_and(|file| file.len() > 100_000), "the loop is saved");
    user.count()
}
