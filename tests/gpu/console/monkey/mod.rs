//! Random input, sources that end anywhere, lost devices: nothing breaks, and nothing leaks.

mod random_source;

use super::*;
use crate::common::own_process;
use ash::vk;
use echolume::low_level::gpu::ContextOptions;
use echolume::low_level::gpu::faults::InjectionPoint;
use echolume::low_level::ui::command::KEY_BINDINGS;
use echolume::low_level::ui::input::Phase;
use echolume::low_level::ui::sliders::SLIDERS;
use random_source::Wild;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// It runs in a process of its own, whose memory no other test uses.
const TEST: &str = "console::monkey::random_input_sources_and_device_losses_break_nothing";
/// Growth of resident memory allowed in the second half, bytes: some pictures are large, and their memory is not
/// returned at once. It does not follow the number of steps: six runs of 15,000 to 131,000 grew by -3 to 78 MB, and one of 41,000 by 134 MB.
const GROWTH: u64 = 192 << 20;

/// Prevents panics, validation messages, leaks, and a console that stops drawing, after any sequence of events. MONKEY_SECONDS continues
/// for longer, MONKEY_SEED repeats a run.
#[test]
fn random_input_sources_and_device_losses_break_nothing() {
    if own_process::is_child() {
        return run();
    }
    // With validation no message; without it bounded memory, because its layers grow with every pipeline.
    for watched in ["1", "0"] {
        let printed = own_process::passes(own_process::command(TEST).env("MONKEY_WATCHED", watched));
        printed.lines().filter(|line| line.contains("monkey:")).for_each(|line| println!("{line}"));
    }
}

fn of_environment(name: &str, unless: u64) -> u64 {
    std::env::var(name).map_or(unless, |value| value.parse().expect(name))
}

/// Says what to do again when a test fails, and what the console noted last.
struct Told {
    seed: u64,
    steps: u64,
    log: PathBuf,
}

impl Told {
    /// `folder`: where warnings are kept.
    fn new(seed: u64, folder: &Folder) -> Told {
        let log = folder.join("log");
        let file = File::create(&log).expect("a log");
        let to_file = tracing_subscriber::fmt().with_max_level(tracing::Level::WARN).with_ansi(false);
        tracing::subscriber::set_global_default(to_file.with_writer(Mutex::new(file)).finish()).expect("the only one");
        Told { seed, steps: 0, log }
    }
}

impl Drop for Told {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let log = std::fs::read_to_string(&self.log).unwrap_or_default();
            let lines: Vec<&str> = log.lines().collect();
            eprintln!("{}", lines[lines.len().saturating_sub(30)..].join("\n"));
            eprintln!("MONKEY_SEED={} after {} steps", self.seed, self.steps);
        }
    }
}

struct Monkey {
    noise: Noise,
    desk: Desk,
    device: Device,
    seed: u64,
    folder: Folder,
    calm: Arc<AtomicBool>,
    last: Arc<Mutex<Vec<Receiver<Event>>>>,
    lost: u32,
    watched: bool,
}

impl Monkey {
    fn new(seed: u64, watched: bool) -> Monkey {
        let (device, calm, folder) = (opened(watched), Arc::new(AtomicBool::new(false)), Folder::new("monkey"));
        let last: Arc<Mutex<Vec<Receiver<Event>>>> = Arc::default();
        let (is_calm, sources, opened) = (calm.clone(), last.clone(), std::sync::atomic::AtomicU64::new(seed));
        let open: OpenSource = Arc::new(move || {
            let n = opened.fetch_add(1, Ordering::Relaxed);
            match is_calm.load(Ordering::Relaxed) {
                true => match sources.lock().expect("lock").pop() {
                    Some(said) => Ok(Box::new(Fed { said, is_recording: false }) as Box<dyn Live>),
                    None => Err("no probe".into()),
                },
                false if n % 5 == 4 => Err("no probe".into()),
                false => Ok(Box::new(Wild::new(n, is_calm.clone()))),
            }
        });
        let options = ConsoleOptions {
            retry: Some(Duration::from_millis(10)),
            budget: Some(Duration::from_millis(8)),
            folder: folder.0.clone(),
            is_kiosk: true,
            ..options()
        };
        let console = Console::new(&device, open, options, SIZE);
        let desk = Desk { console, say: channel().0 };
        Monkey { noise: Noise(seed), desk, device, seed, folder, calm, last, lost: 0, watched }
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.noise.next() * n as f64) as usize).min(n - 1)
    }

    /// Usually a sensible value.
    fn number(&mut self) -> f64 {
        const ODD: [f64; 10] =
            [0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, f64::MIN_POSITIVE, 1e9, -1e9, -0.0];
        match self.below(12) {
            0 => ODD[self.below(ODD.len())],
            1 => self.noise.range(-1e4, 1e4),
            _ => self.noise.range(-40.0, 40.0),
        }
    }

    fn place(&mut self) -> [f64; 2] {
        if self.below(40) == 0 {
            return [self.number(), self.number()];
        }
        [self.noise.range(-20.0, 420.0), self.noise.range(-20.0, 320.0)]
    }

    fn input(&mut self) -> Input {
        let pressed = self.below(2) == 0;
        match self.below(14) {
            0 => Input::FocusLost,
            1 => Input::Scroll(self.number()),
            2 | 3 => Input::Button { button: [Button::Left, Button::Right, Button::Middle][self.below(3)], pressed },
            4 => Input::Modifiers(Modifiers { shift: pressed, control: self.below(3) == 0, alt: self.below(9) == 0 }),
            5..=7 => {
                let phase = [Phase::Down, Phase::Moved, Phase::Moved, Phase::Up, Phase::Cancelled][self.below(5)];
                Input::Touch { finger: self.below(4) as u64, phase, at: self.place() }
            }
            8..=10 => {
                let bound = &KEY_BINDINGS[self.below(KEY_BINDINGS.len())];
                Input::Key { key: bound.key, pressed }
            }
            _ => Input::Moved(self.place()),
        }
    }

    fn command(&mut self) -> Command {
        let (a, b, c) = (self.number(), self.number(), self.number());
        match self.below(16) {
            0 => Command::Rotate([a, b]),
            1 => Command::Roll(a),
            2 => Command::Zoom(a),
            3 => Command::Pan([a / 40.0, b / 40.0]),
            4 => Command::MoveLight([a / 40.0, b]),
            5 => Command::MoveFace(echolume::low_level::ui::command::Face { axis: self.below(5), high: a > 0.0 }, b),
            6 => Command::MoveClip(a),
            7 => Command::StepPlane(a),
            8 => Command::MoveCrossing([a, b, c]),
            9 => Command::RotatePlanes([a, b]),
            10 => Command::SetSlider(self.below(SLIDERS.len() + 2), a),
            11 => Command::StepSlider(self.below(SLIDERS.len() + 2), [i32::MIN, i32::MAX, -1, 1, 3][self.below(5)]),
            12 => Command::StepCine([i32::MIN, i32::MAX, -1, 1, 5][self.below(5)]),
            13 => Command::SeekCine([0, 1, 3, usize::MAX][self.below(4)]),
            // Far from the edges, where the picture shows something.
            14 => Command::Reset,
            _ => KEY_BINDINGS[self.below(KEY_BINDINGS.len())].command,
        }
    }

    fn step(&mut self) {
        match self.below(200) {
            0..=3 => {
                // Usually small ones: more of them fit into a second.
                let edge = |m: &mut Monkey, most: f64| most.powf(m.noise.next()).round() as u32;
                let size = if self.below(8) == 0 { [700.0, 500.0] } else { [160.0, 120.0] };
                let size = size.map(|most| edge(self, most));
                self.desk.console.resize(size);
            }
            4 => {
                let n = self.below(30) as u32;
                self.device.faults.inject(InjectionPoint::Allocate, n, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
            }
            5 if self.below(4) == 0 => {
                let (n, seam) = (self.below(6) as u32, [InjectionPoint::Submit, InjectionPoint::Wait][self.below(2)]);
                self.device.faults.inject(seam, n, vk::Result::ERROR_DEVICE_LOST);
            }
            6 => self.desk.console.redraw(),
            7..=30 => {
                let command = self.command();
                self.desk.console.execute(&command, Instant::now());
            }
            _ => {
                let input = self.input();
                self.desk.console.input(&input);
            }
        }
        for _ in 0..self.below(4) {
            self.tick(Instant::now());
        }
    }

    fn tick(&mut self, now: Instant) {
        match self.desk.console.update(now) {
            Ok(next) => assert!(!next.exit && !next.restart),
            Err(ConsoleError::Screen(fault)) => panic!("there is no screen: {fault}"),
            Err(ConsoleError::DeviceLost(_)) => {
                self.lost += 1;
                let other = opened(self.watched);
                // Settings that do not fit now apply to the geometry of the next source.
                let _ = self.desk.console.revive(&other, None);
                // Its messages are checked here.
                self.device = other;
            }
        }
    }

    /// Without further injected faults, a volume of a normal source is shown as by a separate renderer.
    fn rest(&mut self) {
        self.device.faults.inject(InjectionPoint::Wait, u32::MAX, vk::Result::SUCCESS);
        self.calm.store(true, Ordering::Relaxed);
        self.desk.console.input(&Input::FocusLost);
        self.desk.console.input(&Input::Modifiers(Modifiers::default()));
        // Closes the list of presets, whose small pictures have a volume and a renderer of their own; the reset takes the preset back.
        self.desk.console.execute(&Command::Preset(0), Instant::now());
        self.desk.console.execute(&Command::Reset, Instant::now());
        self.desk.console.execute(&Command::Tool(Tool::Rotate), Instant::now());
        if self.desk.console.stream().is_frozen() {
            self.desk.console.execute(&Command::Freeze, Instant::now());
        }
        self.desk.console.resize(SIZE);
        let (say, said) = channel();
        self.desk.say = say;
        self.last.lock().expect("lock").push(said);
        self.desk.begin();
        self.desk.frames(body(1));
        let begun = Instant::now();
        // Panels may take space next to it.
        let settings = self.desk.drawn();
        let expected = headless(&self.device, &settings, &body(1));
        loop {
            self.tick(Instant::now() + LATER);
            let stream = self.desk.console.stream();
            let drawn = stream.is_idle() && stream.renderer().is_some_and(|renderer| renderer.has_drawn());
            if drawn && self.desk.picture() == expected {
                break;
            }
            assert!(begun.elapsed() < BOUND, "the picture at the end is another");
        }
        self.save();
        self.calm.store(false, Ordering::Relaxed);
        // Random sources follow again.
        self.desk.say.send(Event::End(None)).expect("listens");
    }

    /// The picture that is shown can be saved, whatever was saved or failed before.
    fn save(&mut self) {
        // Folders of exports in work come and go; so their number says nothing.
        let saved =
            |names: BTreeSet<String>| names.into_iter().filter(|name| !name.starts_with('.')).collect::<BTreeSet<_>>();
        let before = saved(self.folder.names());
        self.desk.console.execute(&Command::SavePicture, Instant::now());
        let begun = Instant::now();
        while saved(self.folder.names()).is_subset(&before) {
            self.tick(Instant::now() + LATER);
            assert!(
                begun.elapsed() < BOUND,
                "the picture at the end is not saved: {before:?}, now {:?}",
                self.folder.names()
            );
        }
    }
}

/// With few pipelines that nothing uses: 256 of them would be what the process may grow by.
fn opened(validation: bool) -> Device {
    Device::opened(ContextOptions {
        validation,
        specialize: validation.then_some(true),
        max_unused_pipelines: Some(8),
        ..ContextOptions::default()
    })
}

/// Resident memory of this process, bytes.
fn resident() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").expect("statm");
    4096 * pages.split(' ').nth(1).expect("resident").parse::<u64>().expect("pages")
}

fn run() {
    let seed = of_environment("MONKEY_SEED", 7);
    let time = Duration::from_secs(of_environment("MONKEY_SECONDS", 7));
    let watched = of_environment("MONKEY_WATCHED", 1) == 1;
    let logs = Folder::new("monkey-log");
    let mut told = Told::new(seed, &logs);
    let mut monkey = Monkey::new(seed, watched);
    let (begun, mut half) = (Instant::now(), None);
    while begun.elapsed() < time {
        monkey.step();
        told.steps += 1;
        if half.is_none() && begun.elapsed() > time / 2 {
            monkey.rest();
            half = Some((monkey.device.allocated(), resident()));
        }
    }
    monkey.rest();
    let (device, host) = half.expect("half");
    let (now, resident) = (monkey.device.allocated(), resident());
    let Monkey { seed, lost, .. } = monkey;
    println!(
        "monkey: seed {seed}, {} steps, {lost} devices lost; device {device} to {now} bytes, process {host} to {resident}",
        told.steps
    );
    assert!(now <= device + device / 8 + (1 << 20), "device memory: {device}, then {now}");
    assert!(watched || resident <= host + GROWTH, "the process: {host}, then {resident}");
}
