//! Labels that a user makes: painted on planes and on the surface, undone, grown from a click, saved beside a workspace, and edited again.

use super::*;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::picker::Picker;
use echolume::low_level::scene::{MeasureKind, SharedLabels};
use echolume::low_level::segment::{Labels, files};
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{OpenOptions, StoredType};
use echolume::low_level::ui::command::{Effect, Face, LabelCommand};
use echolume::low_level::ui::panels::accesskit::Node;
use echolume::low_level::workspace::{Origin, Workspace};
use glam::DVec3;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

const SHIFT: Modifiers = Modifiers { shift: true, control: false, alt: false };
const GRID: Grid = Grid { size: [48, 44, 40], spacing: [1.0, 1.0, 1.0], origin: [-24.0, 0.0, -20.0] };
/// The centre of a voxel.
const CENTRE: DVec3 = DVec3::new(2.0, 23.0, -2.0);
const RADIUS: f64 = 11.0;
/// Of the ball, cm3.
const VOLUME: f64 = 4.0 / 3.0 * PI * RADIUS * RADIUS * RADIUS / 1000.0;
/// No voxel is that far from the centre of another one, so that rounding moves none across.
const BRUSH: f64 = 4.05;
/// Points of the integer lattice within a ball (OEIS A000605) and a circle (A000328) of radius 4 around one of them.
const DAB: f64 = 257.0;
const LAYER: f64 = 49.0;

/// A bright ball in dark tissue, with an edge of a voxel.
fn ball() -> Vec<Frame> {
    let [width, height, depth] = GRID.size;
    let slice = |z: usize| {
        let value = |n: usize| {
            let index = [n % width, n / width, z].map(|i| i as f64);
            let away = (DVec3::from(GRID.origin) + DVec3::from(index)).distance(CENTRE);
            (40.0 + 160.0 * (RADIUS - away + 0.5).clamp(0.0, 1.0)).round() as u8
        };
        Frame::of_slice(0, z, (0..width * height).map(value).collect())
    };
    (0..depth).map(slice).collect()
}

impl Desk {
    /// A desk that shows the ball, by planes and as a surface.
    pub(super) fn of_ball(device: &Arc<Context>, folder: &Folder, labels: Option<(PathBuf, SharedLabels)>) -> Desk {
        let (file, shown) = labels.unzip();
        let mut settings =
            settings("mode = 'sr'\nlayout = 'four'\nsurface.threshold = 0.4\nplanes.position = [2, 23, -2]");
        settings.labels.volume = shown;
        let mut origin = Origin::of(Some("ball.mha".into()));
        origin.labels = file;
        let mut desk = Desk::new(
            device,
            ConsoleOptions {
                settings,
                source: SourceKind::Recording,
                origin: Some(origin),
                folder: folder.0.join("kept"),
                ..options()
            },
        );
        desk.console.describe(true);
        let [forward, backward] = [Geometry::Cartesian(GRID), Geometry::Cartesian(GRID)];
        let stored = StoredType::U8;
        let header = Header { forward, backward, stored, range: [0.0, 255.0], posed: false, synthetic: false };
        desk.say.send(Event::Begin(Box::new(header))).expect("listens");
        desk.frames(ball());
        desk.until("a volume", |desk| (desk.console.stream().volumes_shown() > 0).then_some(()));
        desk.rest();
        desk.held(SHIFT, Key::Char('l'));
        desk.until("labels", |desk| desk.console.controls().labelling().map(|_| ()));
        desk.console.execute(&Command::BrushRadius(BRUSH), Instant::now());
        desk
    }

    fn until<T>(&mut self, what: &str, mut look: impl FnMut(&mut Desk) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            self.tick(Instant::now() + LATER);
            if let Some(found) = look(self) {
                return found;
            }
            assert!(begun.elapsed() < BOUND, "no {what}");
            wait::poll();
        }
    }

    /// The volume of label 1, cm3.
    fn labelled(&self) -> f64 {
        self.console.controls().labelling().and_then(|labels| labels.volumes().next()).expect("label 1").1
    }

    /// Where a tile of planes shows a place.
    fn on_tile(&mut self, n: usize, place: DVec3) -> [f64; 2] {
        let tiling = self.console.stream().scene().expect("a scene").tiling();
        tiling.project(&tiling.tiles[n], place).0
    }

    fn click(&mut self, at: [f64; 2]) {
        self.console.input(&Input::Moved(at));
        self.console.input(&Input::Button { button: Button::Left, pressed: true });
        self.console.input(&Input::Button { button: Button::Left, pressed: false });
    }

    fn labels(&mut self, command: LabelCommand) {
        self.console.execute(&Command::Labels(command), Instant::now());
    }

    /// Measures the volume of the ball by contours on five planes.
    fn measure_by_contours(&mut self) {
        let now = Instant::now();
        self.console.execute(&Command::Tool(Tool::Measure(MeasureKind::Volume)), now);
        for z in [-9.0, -5.0, 0.0, 5.0, 9.0f64] {
            let radius = (RADIUS * RADIUS - z * z).sqrt();
            for step in 0..60 {
                let (sin, cos) = (PI * f64::from(step) / 30.0).sin_cos();
                let place = CENTRE + DVec3::new(radius * cos, radius * sin, z);
                let point = self.console.stream().scene().expect("a scene").point_of(place);
                self.console.execute(&Command::Point(point, false), now);
            }
            self.console.execute(&Command::EndMeasure, now);
        }
        self.console.execute(&Command::EndMeasure, now);
        self.console.execute(&Command::Tool(Tool::Labels), now);
    }

    /// True if the user is asked whether to save before the program ends.
    fn asks_to_leave(&mut self) -> bool {
        self.console.execute(&Command::Exit, Instant::now());
        let asks = self.console.asks_to_leave();
        self.console.execute(&Command::Back, Instant::now());
        asks
    }

    /// Saves a workspace, and returns it once it is saved.
    fn workspace(&mut self, folder: &Folder, known: usize) -> Workspace {
        self.held(CONTROL, Key::Char('s'));
        let file = self.until("workspace", |_| files_of(folder, "toml").get(known).cloned());
        Workspace::read(&file).expect("a workspace")
    }
}

/// The files with this ending, in the order of their names.
fn files_of(folder: &Folder, ending: &str) -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder.0.join("kept")).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<_> = all.filter(|file| file.to_string_lossy().ends_with(ending)).collect();
    found.sort();
    found
}

/// The labels of a file, and the number and mean place in space of its voxels with a label.
fn read(file: &Path) -> (Labels, usize, DVec3) {
    let (labels, _) = files::read(file, OpenOptions::default()).expect("labels");
    let [width, height, _] = labels.grid().size;
    let places: Vec<DVec3> = (0..labels.voxels().len())
        .filter(|n| labels.voxels()[*n] > 0)
        .map(|n| {
            labels.world().at(DVec3::from([n % width, n / width % height, n / (width * height)].map(|i| i as f64)))
        })
        .collect();
    let (count, sum) = (places.len(), places.iter().sum::<DVec3>());
    (labels, count, sum / count as f64)
}

#[test]
fn labels_are_painted_undone_grown_and_saved() {
    let (device, folder) = (Device::new(), Folder::new("labelling"));
    let mut desk = Desk::of_ball(&device, &folder, None);
    assert_eq!(desk.labelled(), 0.0);
    desk.rest();
    let plain = desk.picture();
    // On each plane: a layer more for each voxel of the stroke.
    let stroke = DAB + 16.0 * LAYER;
    for (n, along) in [DVec3::X, DVec3::Z, DVec3::X].into_iter().enumerate() {
        let [from, to] = [-8.0, 8.0].map(|off| desk.on_tile(n, CENTRE + along * off));
        desk.drag(from, to);
        let painted = desk.labelled();
        assert_eq!((painted * 1000.0).round(), stroke, "tile {n}");
        desk.rest();
        let labelled = desk.picture();
        assert!(labelled.rgba != plain.rgba, "they are shown");
        desk.held(CONTROL, Key::Char('z'));
        assert_eq!(desk.labelled(), 0.0);
        desk.rest();
        assert!(desk.picture().rgba == plain.rgba, "what was before");
        desk.held(CONTROL, Key::Char('y'));
        desk.rest();
        assert!(desk.labelled() == painted && desk.picture().rgba == labelled.rgba, "and after");
        // Erased where it was painted.
        desk.labels(LabelCommand::Effect(Effect::Erase));
        desk.drag(from, to);
        assert_eq!(desk.labelled(), 0.0);
        desk.labels(LabelCommand::Effect(Effect::Paint));
    }
    // On the surface: a ball around the point of it, half a brush from the middle of the rendering.
    let scene = desk.console.stream().scene().expect("a scene").clone();
    let front = CENTRE - scene.rays.forward * RADIUS;
    desk.click(Picker::of(&scene).project(front).expect("in front"));
    let (painted, dab) = (desk.labelled() * 1000.0, 4.0 / 3.0 * PI * BRUSH.powi(3));
    // Around a place between voxels.
    assert!((painted / dab - 1.0).abs() < 0.08, "{painted} of {dab}");
    desk.workspace(&folder, 0);
    let [beside] = &files_of(&folder, "seg.nrrd")[..] else { panic!("one file beside the workspace") };
    let place = read(beside).2;
    assert!(place.distance(front) < 1.0, "{place}, not {front}");
    desk.held(CONTROL, Key::Char('z'));
    // The body between contours, and beyond the last ones.
    desk.measure_by_contours();
    desk.labels(LabelCommand::Fill(0));
    desk.until("filled body", |desk| (desk.labelled() > 0.0).then_some(()));
    let filled = desk.labelled();
    assert!((filled / VOLUME - 1.0).abs() < 0.01, "{filled} of {VOLUME}");
    desk.held(CONTROL, Key::Char('z'));
    assert_eq!(desk.labelled(), 0.0);
    // All of the ball.
    desk.labels(LabelCommand::Effect(Effect::GrowBright));
    let inside = desk.on_tile(2, CENTRE + DVec3::new(4.0, 0.0, 3.0));
    desk.click(inside);
    desk.until("body", |desk| (desk.labelled() > 0.0).then_some(()));
    let grown = desk.labelled();
    assert!((grown / VOLUME - 1.0).abs() < 0.01, "{grown} of {VOLUME}");
    // A dark body is none there.
    desk.labels(LabelCommand::Effect(Effect::GrowDark));
    desk.click(inside);
    desk.until("refusal", |desk| {
        let nodes = desk.console.take_tree()?.nodes.into_iter();
        let says = |node: Node| node.label().is_some_and(|said| said.starts_with("Nothing is labelled: "));
        nodes.map(|(_, node)| node).any(says).then_some(())
    });
    assert_eq!(desk.labelled(), grown);
    let workspace = desk.workspace(&folder, 1);
    let file = workspace.origin.labels.expect("its labels");
    let (_, count, middle) = read(&file);
    assert_eq!(count as f64 / 1000.0, grown);
    assert!(middle.distance(CENTRE) < 0.1, "{middle}");
    desk.until("end of saving", |desk| (!desk.asks_to_leave()).then_some(()));
    // Another day, its labels are shown and changed. The file stays as it is.
    let bytes = std::fs::read(&file).expect("a file");
    let (labels, segments) = files::read(&file, OpenOptions::default()).expect("labels");
    let shown = files::shown(&labels, &segments, &Geometry::Cartesian(GRID), None).expect("labels").into();
    let mut desk = Desk::of_ball(&device, &folder, Some((file.clone(), shown)));
    assert_eq!(desk.labelled(), grown);
    assert_eq!(desk.workspace(&folder, 2).origin.labels.as_ref(), Some(&file), "nothing was changed");
    let middle = desk.on_tile(0, CENTRE);
    desk.console.input(&Input::Modifiers(CONTROL));
    desk.click(middle);
    desk.console.input(&Input::Modifiers(Modifiers::default()));
    assert_eq!(((grown - desk.labelled()) * 1000.0).round(), DAB);
    assert!(desk.asks_to_leave());
    let other = desk.workspace(&folder, 3).origin.labels.expect("its labels");
    assert!(other != file && std::fs::read(&file).expect("a file") == bytes, "the file was written over");
    assert_eq!(read(&other).1 as f64 / 1000.0, desk.labelled());
    // The export is the same.
    let known = files_of(&folder, "seg.nrrd");
    // The last but one of the menu.
    desk.console.execute(&Command::Export(14), Instant::now());
    let file = desk.until("export", |_| files_of(&folder, "seg.nrrd").into_iter().find(|file| !known.contains(file)));
    assert_eq!(read(&file).1 as f64 / 1000.0, desk.labelled());
}

/// The automatic volume is that of the ball, with an interval, whatever threshold the mode has; the region that holds half of it is said to cut it.
#[test]
fn the_key_k_measures_the_largest_bright_body_of_the_region() {
    let (device, folder) = (Device::new(), Folder::new("measured-body"));
    let mut desk = Desk::of_ball(&device, &folder, None);
    let measured = |desk: &mut Desk, n: usize| {
        desk.press(Key::Char('k'));
        desk.until("measurement", |desk| desk.console.controls().measures().get(n).cloned())
    };
    let whole = measured(&mut desk, 0);
    let found = whole.counted.expect("a volume") / 1000.0;
    assert!((found / VOLUME - 1.0).abs() < 0.01, "{found} of {VOLUME}");
    let [low, high] = whole.interval.expect("an interval").map(|mm3| mm3 / 1000.0);
    assert!(low < found && found < high && high - low < 0.2 * found, "{low} to {high}");
    // From the far end to the middle of the ball.
    let end = GRID.origin[2] + GRID.spacing[2] * (GRID.size[2] - 1) as f64;
    desk.console.execute(&Command::MoveFace(Face { axis: 2, high: true }, CENTRE.z - end), Instant::now());
    desk.rest();
    let half = measured(&mut desk, 1).counted.expect("a volume") / 1000.0;
    assert!((half / VOLUME - 0.5).abs() < 0.1, "{half} of {VOLUME}");
    desk.until("warning", |desk| {
        let nodes = desk.console.take_tree()?.nodes.into_iter();
        let says = |node: Node| node.label().is_some_and(|said| said.contains("reaches the border of the region"));
        nodes.map(|(_, node)| node).any(says).then_some(())
    });
}
