//! Several recordings in one window: each comes back as it was left, and what is being read is shown, can be ended, and leaves the picture usable.

use super::*;
use crate::common::wait;
use echolume::low_level::files::progress::{self, Progress};
use echolume::low_level::scene::{MeasureKind, Mode};
use echolume::low_level::source::live::{Playback, PlaybackSource};
use echolume::low_level::source::phantom::{Phantom, PhantomOptions, PhantomSource, Speckle};
use echolume::low_level::ui::panels::accesskit::{Node, Role};
use echolume::low_level::ui::recordings::{OpenRecordings, Recordings};
use echolume::low_level::workspace::{Origin, Workspace};
use std::path::{Path, PathBuf};

const WINDOW: [u32; 2] = [1100, 480];

/// What opening a path does: the reason why it cannot be opened.
type Read = Arc<dyn Fn(&Path, &Progress) -> Result<(), String> + Send + Sync>;

/// A window: it replaces its console as the program does.
struct Window {
    device: Arc<Context>,
    console: Console,
    recordings: OpenRecordings,
    read: Read,
    /// What the next console shows.
    next: Arc<Mutex<PathBuf>>,
    folder: Arc<Folder>,
    tree: Vec<Node>,
    exits: bool,
}

fn four_volumes() -> Phantom {
    let options = PhantomOptions {
        volumes: 4,
        speckle: Speckle::None,
        frames: 9,
        lines: 24,
        samples: 64,
        ..PhantomOptions::default()
    };
    Phantom::new(options).expect("a phantom")
}

fn phantom_source() -> Result<Box<dyn Live>, String> {
    Ok(Box::new(PlaybackSource::new(Box::new(PhantomSource::cached(four_volumes())), Playback::Fast, 1)))
}

impl Window {
    fn new(device: &Arc<Context>, first: &str, others: &[&str], read: Read) -> Window {
        let mut list = Recordings::of(SourceKind::Recording, Path::new(first));
        assert!(others.iter().all(|path| list.add(Path::new(path))));
        let (recordings, next) = (Arc::new(Mutex::new(list)), Arc::new(Mutex::new(PathBuf::from(first))));
        let (folder, source) = (Arc::new(Folder::new("recordings")), Arc::new(phantom_source));
        let console = Window::console(device, &recordings, &read, &next, &folder, source, Progress::default());
        Window { device: device.clone(), console, recordings, read, next, folder, tree: Vec::new(), exits: false }
    }

    fn console(
        device: &Arc<Context>,
        recordings: &OpenRecordings,
        read: &Read,
        next: &Arc<Mutex<PathBuf>>,
        folder: &Folder,
        open: OpenSource,
        progress: Progress,
    ) -> Console {
        let origin = Origin::of(Some(next.lock().expect("lock").clone()));
        let (read, next) = (read.clone(), next.clone());
        let options = ConsoleOptions {
            source: SourceKind::Recording,
            plays_once: true,
            folder: folder.0.clone(),
            origin: Some(origin),
            panels: true,
            opening: OpeningOptions {
                recordings: recordings.clone(),
                progress,
                open_file: Some(Arc::new(move |path, progress| {
                    read(path, progress)?;
                    let (next, path) = (next.clone(), path.to_path_buf());
                    Ok(Box::new(move || *next.lock().expect("lock") = path))
                })),
                ..OpeningOptions::default()
            },
            ..options()
        };
        let mut console = Console::new(device, open, options, WINDOW);
        console.describe(true);
        console
    }

    fn update(&mut self) {
        let now = Instant::now() + LATER;
        let request = self.console.update(now).expect("the device is there");
        self.exits |= request.exit;
        if let Some(tree) = self.console.take_tree() {
            self.tree = tree.nodes.into_iter().map(|(_, node)| node).collect();
        }
        if request.restart {
            assert!(request.wake_at.is_some_and(|at| at <= now), "nothing else may wake the new console");
            let source: OpenSource = Arc::new(phantom_source);
            let progress = Progress::default();
            let (recordings, next) = (&self.recordings, &self.next);
            self.console = Window::console(&self.device, recordings, &self.read, next, &self.folder, source, progress);
        }
    }

    fn until<T>(&mut self, what: &str, mut look: impl FnMut(&mut Window) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            self.update();
            if let Some(found) = look(self) {
                return found;
            }
            assert!(begun.elapsed() < BOUND, "no {what}");
            wait::poll();
        }
    }

    /// Waits until this recording is shown and drawn, to its last volume.
    fn shows(&mut self, path: &str) {
        self.until(path, |window| {
            let is_it = *window.next.lock().expect("lock") == Path::new(path);
            let stream = window.console.stream();
            let is_drawn = stream.cine().volumes().len() == 4 && stream.renderer().is_some_and(|r| r.has_drawn());
            (is_it && is_drawn && window.console.stream().is_idle()).then_some(())
        });
        // What is restored when the recording is over.
        (0..20).for_each(|_| self.update());
    }

    fn press(&mut self, control: bool, key: Key) {
        self.console.input(&Input::Modifiers(Modifiers { control, ..Modifiers::default() }));
        self.console.input(&Input::Key { key, pressed: true });
        self.console.input(&Input::Key { key, pressed: false });
        self.console.input(&Input::Modifiers(Modifiers::default()));
        self.update();
    }

    /// What has this role and a name that begins so.
    fn find(&self, role: Role, name: &str) -> Option<&Node> {
        self.tree.iter().find(|node| node.role() == role && node.label().is_some_and(|own| own.starts_with(name)))
    }

    fn click(&mut self, role: Role, name: &str) {
        let bounds = self.until(name, |window| window.find(role, name).and_then(Node::bounds));
        let at = [(bounds.x0 + bounds.x1) / 2.0, (bounds.y0 + bounds.y1) / 2.0];
        for input in [
            Input::Moved(at),
            Input::Button { button: Button::Left, pressed: true },
            Input::Button { button: Button::Left, pressed: false },
        ] {
            self.console.input(&input);
            self.update();
        }
    }

    /// The names in the list of recordings, the shown one with a mark.
    fn listed(&mut self) -> Vec<String> {
        (0..3).for_each(|_| self.update());
        let name = |node: &Node| {
            let name = node.label()?.strip_prefix("Close ")?.to_string();
            Some((node.bounds().unwrap_or_default().x0, name))
        };
        // The nodes of a tree have no order: the tabs from left to right.
        let mut close: Vec<(f64, String)> = self.tree.iter().filter_map(name).collect();
        close.sort_by(|a, b| a.0.total_cmp(&b.0));
        let close: Vec<String> = close.into_iter().map(|(_, name)| name).collect();
        let is_shown = |name: &String| {
            let node = self.find(Role::Button, name).unwrap_or_else(|| panic!("{name}: {:?}", self.tree));
            node.toggled() == Some(echolume::low_level::ui::panels::accesskit::Toggled::True)
        };
        close.iter().map(|name| if is_shown(name) { format!("> {name}") } else { name.clone() }).collect()
    }
}

fn reads_all() -> Read {
    Arc::new(|path, _| match path.file_name().is_some_and(|name| name == "broken.mha") {
        true => Err("broken.mha: data: cut short".into()),
        false => Ok(()),
    })
}

/// Requirement: who goes back to a recording finds look, measurements, undo and the frozen volume as they were left.
#[test]
fn a_recording_comes_back_as_it_was_left() {
    let device = Device::new();
    let mut window = Window::new(&device, "/data/a.mha", &[], reads_all());
    window.shows("/data/a.mha");
    assert!(window.listed().is_empty(), "one recording needs no list");
    let start = window.console.controls().settings().clone();
    window.press(false, Key::Char('4'));
    window.console.execute(&Command::Tool(Tool::Measure(MeasureKind::Distance)), Instant::now());
    window.press(false, Key::Char('8'));
    for x in [0.0, 10.0] {
        window.console.execute(&Command::Point([x, 50.0, 0.0], false), Instant::now());
    }
    assert_eq!(window.console.controls().measures().len(), 1);
    window.console.execute(&Command::StepCine(-2), Instant::now());
    window.press(false, Key::Function(2));
    let left = window.console.controls().settings().clone();
    // Two recordings are dropped together: the first is shown, both are listed.
    for path in ["/data/b.mha", "/data/c.mha"] {
        window.console.drop_file(Path::new(path));
    }
    window.shows("/data/b.mha");
    assert_eq!(window.listed(), ["a.mha", "> b.mha", "c.mha"]);
    let settings = window.console.controls().settings();
    assert_eq!((settings.mode, settings.drawn.measure.len()), (start.mode, 0), "another recording, with the start");
    assert!(!window.console.stream().is_frozen());
    assert!(window.find(Role::Group, "Times").is_some(), "what the window shows stays");
    window.press(false, Key::Char('6'));
    // By key to and fro, in a circle.
    window.press(true, Key::PageUp);
    window.shows("/data/a.mha");
    assert_eq!(window.console.controls().settings(), &left);
    assert_eq!(window.console.stream().cine_position(), Some(1), "the volume that was frozen");
    assert!(window.console.stream().is_frozen());
    window.press(true, Key::Char('z'));
    assert_eq!(window.console.controls().measures().len(), 0, "the last step is still there to be undone");
    window.press(true, Key::PageUp);
    window.shows("/data/c.mha");
    assert_eq!(window.console.controls().settings().mode, start.mode);
    // By a click.
    window.click(Role::Button, "b.mha");
    window.shows("/data/b.mha");
    assert_eq!(window.console.controls().settings().mode, Mode::Mean);
    // What is closed is gone, and the next one comes in its place.
    window.press(true, Key::Char('w'));
    window.shows("/data/c.mha");
    assert_eq!(window.listed(), ["a.mha", "> c.mha"]);
    window.click(Role::Button, "Close a.mha");
    assert!(window.listed().is_empty());
    window.press(true, Key::PageDown);
    window.until("word of it", |window| window.find(Role::Status, "No other recording is open").map(|_| ()));
    assert!(!window.exits);
}

/// Prevents measurements that are lost by one key: of the recording that is shown, and of others that are open.
#[test]
fn what_was_measured_is_not_lost_without_a_question() {
    let device = Device::new();
    let mut window = Window::new(&device, "/data/a.mha", &["/data/b.mha"], reads_all());
    let measure = |window: &mut Window, x: f64| {
        window.console.execute(&Command::Tool(Tool::Measure(MeasureKind::Distance)), Instant::now());
        for x in [0.0, x] {
            window.console.execute(&Command::Point([x, 50.0, 0.0], false), Instant::now());
        }
        window.console.execute(&Command::Tool(Tool::default()), Instant::now());
    };
    window.shows("/data/a.mha");
    window.press(false, Key::Char('8'));
    measure(&mut window, 10.0);
    window.press(true, Key::Char('w'));
    let warning = "Measurements, cuts or labels of a.mha are not saved";
    window.until("a warning", |window| window.find(Role::Alert, warning).map(|_| ()));
    assert_eq!(window.listed(), ["> a.mha", "b.mha"]);
    window.press(true, Key::PageDown);
    window.shows("/data/b.mha");
    window.press(false, Key::Char('8'));
    measure(&mut window, 20.0);
    window.click(Role::Button, "Close a.mha");
    assert_eq!(window.listed(), ["a.mha", "> b.mha"]);
    // All of it is saved before the program ends.
    window.press(false, Key::Char('q'));
    window.until("the question", |window| {
        window.find(Role::AlertDialog, "Measurements, cuts or labels are not saved").map(|_| ())
    });
    assert!(!window.exits && window.console.asks_to_leave());
    window.press(false, Key::Enter);
    window.until("the end", |window| window.exits.then_some(()));
    let files = std::fs::read_dir(&window.folder.0).expect("listed").map(|file| file.expect("a file").path());
    let mut saved: Vec<_> = files.map(|file| Workspace::read(&file).expect("a workspace")).collect();
    saved.sort_by(|a, b| a.origin.recording.cmp(&b.origin.recording));
    for (workspace, (name, length)) in saved.iter().zip([("/data/a.mha", 10.0), ("/data/b.mha", 20.0)]) {
        assert_eq!(workspace.origin.recording.as_deref(), Some(Path::new(name)));
        let measure = workspace.layers.clone().finish().expect("settings").drawn.measure;
        assert_eq!(measure.len(), 1);
        let [from, to] = [0, 1].map(|n| glam::DVec3::from(measure[0].points[n]));
        assert!((from.distance(to) - length).abs() < 1e-9, "{name}: {from} to {to}");
    }
    assert_eq!(saved.len(), 2);
    // What is saved is not asked about.
    window.exits = false;
    window.press(false, Key::Char('q'));
    assert!(window.exits && !window.console.asks_to_leave());
    // Asked for twice, it is lost.
    measure(&mut window, 30.0);
    window.press(true, Key::Char('w'));
    window.press(true, Key::Char('w'));
    window.shows("/data/a.mha");
    assert!(window.listed().is_empty());
}

#[test]
fn a_recording_that_cannot_be_opened_changes_nothing() {
    let device = Device::new();
    let mut window = Window::new(&device, "/data/a.mha", &["/usb/broken.mha"], reads_all());
    window.shows("/data/a.mha");
    window.press(false, Key::Char('4'));
    window.press(true, Key::PageDown);
    window.until("the fault", |window| window.find(Role::Alert, "Not opened: broken.mha: data").map(|_| ()));
    assert_eq!(window.listed(), ["> a.mha", "broken.mha"], "it was given, and may be there later");
    assert_eq!(window.console.controls().settings().mode, Mode::Mip);
    window.console.open_path(Path::new("/elsewhere/broken.mha"));
    window.until("the fault", |window| {
        let is_over = window.find(Role::Status, "Reading").is_none();
        (is_over && window.recordings.lock().expect("lock").index(Path::new("/elsewhere/broken.mha")).is_none())
            .then_some(())
    });
    assert_eq!(window.listed(), ["> a.mha", "broken.mha"]);
}

/// A reader that has read 43 per cent and waits at a gate, as of a slow disk.
fn slow() -> (Read, Sender<()>, Arc<Mutex<Vec<Progress>>>) {
    let (open, gate) = channel::<()>();
    let (gate, seen) = (Mutex::new(gate), Arc::new(Mutex::new(Vec::new())));
    let all = seen.clone();
    let read: Read = Arc::new(move |_, own| {
        all.lock().expect("lock").push(own.clone());
        progress::expect_bytes(1000);
        progress::add_bytes(432).expect("not cancelled");
        let _ = gate.lock().expect("lock").recv();
        progress::add_bytes(0).map_err(|e| e.to_string())
    });
    (read, open, seen)
}

fn shows_43_percent(window: &mut Window, name: &str) {
    window.until("the share", |window| {
        let bar = window.find(Role::ProgressIndicator, "Read so far")?;
        let said = (bar.numeric_value(), bar.value(), bar.max_numeric_value());
        if said != (Some(43.0), Some("43 %"), Some(100.0)) {
            return None;
        }
        window.find(Role::Status, &format!("Reading {name}")).map(|_| ())
    });
}

/// Requirement: what is read is named with its per cent, ends by Esc or a button, and the picture can be worked with meanwhile.
#[test]
fn reading_is_shown_and_can_be_ended_while_the_picture_is_used() {
    let device = Device::new();
    let (read, gate, seen) = slow();
    let mut window = Window::new(&device, "/data/a.mha", &[], read);
    window.shows("/data/a.mha");
    window.console.open_path(Path::new("/data/big.mha"));
    shows_43_percent(&mut window, "big.mha");
    assert_eq!(window.listed(), ["> a.mha", "big.mha"]);
    window.press(false, Key::Char('4'));
    window.until("another picture", |window| {
        window.console.stream().scene().filter(|scene| scene.settings.mode == Mode::Mip).map(|_| ())
    });
    window.press(false, Key::Escape);
    window.until("word of it", |window| window.find(Role::Status, "big.mha is not read further").map(|_| ()));
    let ended = |seen: &Mutex<Vec<Progress>>, n: usize| seen.lock().expect("lock")[n].is_cancelled();
    assert!(ended(&seen, 0) && !window.exits && window.find(Role::ProgressIndicator, "Read").is_none());
    assert!(window.listed().is_empty());
    gate.send(()).expect("it waits");
    // By its button.
    window.console.open_path(Path::new("/data/big.mha"));
    shows_43_percent(&mut window, "big.mha");
    window.click(Role::Button, "Cancel");
    window.until("the end", |window| window.find(Role::ProgressIndicator, "Read").is_none().then_some(()));
    assert!(ended(&seen, 1));
    gate.send(()).expect("it waits");
    assert_eq!(window.console.controls().settings().mode, Mode::Mip, "what was shown is as it was");
    // To its end.
    window.console.open_path(Path::new("/data/big.mha"));
    shows_43_percent(&mut window, "big.mha");
    gate.send(()).expect("it waits");
    let is_next = |window: &Window| *window.next.lock().expect("lock") == Path::new("/data/big.mha");
    window.until("it", |window| is_next(window).then_some(()));
    window.press(false, Key::Escape);
    assert!(!window.exits, "Escape came a moment too late to end the reading");
    window.shows("/data/big.mha");
    assert!(!ended(&seen, 2) && window.listed() == ["a.mha", "> big.mha"]);
}

/// Requirement: the first recording says how far it is too, where there is no picture yet, and Esc leaves it, not the program.
#[test]
fn the_first_recording_is_read_in_sight() {
    let device = Device::new();
    let (gate, waits) = channel::<()>();
    let (waits, own) = (Mutex::new(waits), Progress::default());
    let counted = own.clone();
    let open: OpenSource = Arc::new(move || {
        counted.during(|| {
            progress::expect_bytes(1000);
            progress::add_bytes(432).map_err(|e| e.to_string())?;
            let _ = waits.lock().expect("lock").recv();
            progress::add_bytes(0).map_err(|e| e.to_string())
        })?;
        phantom_source()
    });
    let mut window = Window::new(&device, "/data/a.mha", &[], reads_all());
    let made = |open: &OpenSource, own: &Progress| {
        Window::console(
            &device,
            &window.recordings,
            &window.read,
            &window.next,
            &window.folder,
            open.clone(),
            own.clone(),
        )
    };
    let console = made(&open, &own);
    window.console = console;
    shows_43_percent(&mut window, "a.mha");
    window.press(false, Key::Escape);
    window.until("word of it", |window| window.find(Role::Status, "Reading was cancelled").map(|_| ()));
    assert!(own.is_cancelled() && !window.exits);
    drop(gate);
    // Another one can be opened then.
    window.console.open_path(Path::new("/data/b.mha"));
    window.shows("/data/b.mha");
    assert_eq!(window.listed(), ["a.mha", "> b.mha"]);
}

/// Requirement: going to another recording loses no loop of a probe that is in no file.
#[test]
fn a_loop_that_is_not_saved_is_not_left() {
    let device = Device::new();
    let recordings: OpenRecordings = Arc::default();
    {
        let mut list = recordings.lock().expect("lock");
        *list = Recordings::of(SourceKind::Probe, Path::new("igtl://probe"));
        list.add(Path::new("/data/a.mha"));
    }
    let opened = Arc::new(Mutex::new(0));
    let count = opened.clone();
    let options = ConsoleOptions {
        opening: OpeningOptions {
            recordings: recordings.clone(),
            open_file: Some(Arc::new(move |_, _| {
                *count.lock().expect("lock") += 1;
                Ok(Box::new(|| ()))
            })),
            ..OpeningOptions::default()
        },
        ..options()
    };
    let mut desk = Desk::new(&device, options);
    desk.begin();
    desk.live(1);
    let held = Modifiers { control: true, ..Modifiers::default() };
    desk.held(held, Key::PageDown);
    desk.held(held, Key::Char('w'));
    desk.console.drop_file(Path::new("/data/b.mha"));
    let next = desk.rest();
    assert!(!next.restart && *opened.lock().expect("lock") == 0, "nothing was opened");
}
