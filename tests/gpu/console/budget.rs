//! What a frame budget leaves alone: frames that are there are never sent again, and what only changes tone or light casts no ray.

use super::*;
use crate::common::wait;
use echolume::low_level::gpu::TimeStamps;
use echolume::low_level::passes::{Stage, by_name};

impl Desk {
    /// The passes that ran since the last call: stage, name and number of runs.
    fn passes(&mut self) -> Vec<(Stage, &'static str, u32)> {
        let statistics = self.console.stream().take_final_statistics().expect("times");
        let ran = statistics.passes.iter().filter(|pass| pass.runs > 0);
        ran.filter_map(|ran| Some((by_name(ran.name)?.stage, ran.name, ran.runs))).collect()
    }

    /// True if the picture shows the camera and the light of the controls.
    fn has_drawn_all(&mut self) -> bool {
        let wanted = self.console.controls().settings().clone();
        let stream = self.console.stream();
        let is_idle = stream.is_idle();
        let drawn = &stream.scene().expect("begun").settings;
        let place = |s: &Settings| (s.camera.clone(), s.light.direction, s.light.position);
        is_idle && place(drawn) == place(&wanted)
    }

    /// Drags when the view has come to rest, and draws every picture on the way. Returns the settings of those pictures.
    fn drag_slowly(&mut self, from: [f64; 2], to: [f64; 2]) -> Vec<Settings> {
        wait::pace(LATER);
        self.console.input(&Input::Moved(from));
        self.console.input(&Input::Button { button: Button::Left, pressed: true });
        let mut drawn = Vec::new();
        for n in 1..=8 {
            let at = [0, 1].map(|a| from[a] + (to[a] - from[a]) * f64::from(n) / 8.0);
            // The time of the input, however slow the machine is.
            let now = Instant::now();
            self.console.input(&Input::Moved(at));
            let begun = Instant::now();
            self.tick(now);
            // Pipelines are compiled in the background.
            while !self.has_drawn_all() {
                assert!(begun.elapsed() < BOUND, "it is never drawn");
                wait::poll();
                self.tick(now);
            }
            drawn.push(self.console.stream().scene().expect("begun").settings.clone());
        }
        self.console.input(&Input::Button { button: Button::Left, pressed: false });
        drawn
    }
}

/// Prevents a tap on gain that takes as long as a new volume, and a light whose surface becomes coarse while it is dragged.
#[test]
fn tone_casts_no_ray_light_keeps_the_distance_map_and_no_rung_runs_stage_1() {
    let device = Device::alone();
    let mut settings = plain();
    settings.light.shadow = Some(Default::default());
    settings.distance.median = 3;
    // With a part of the volume hidden, longer steps reach further than short ones.
    settings.region.depth = Some([6.0, 14.0]);
    let stream = StreamOptions { time_stamps: TimeStamps::EachPass, ..options().stream };
    let budget = Some(Duration::from_nanos(1));
    // The statistics are read here alone: the console would take those of some passes.
    let statistics_interval = Duration::from_secs(3600);
    let mut desk = Desk::new(&device, ConsoleOptions { settings, budget, stream, statistics_interval, ..options() });
    desk.begin();
    desk.live(0);
    desk.press(Key::Space);
    desk.rest();
    assert!(desk.passes().iter().any(|(stage, ..)| *stage == Stage::Preprocess), "stage 1 is counted");

    // A view that turns goes down the ladder, and up again at rest.
    let turned = desk.drag_slowly([40.0, 36.0], [60.0, 20.0]);
    assert!(turned.iter().any(|s| s.ray.subsampling > 1 && s.distance.median == 3), "the ladder is not used");
    desk.rest();
    let ran = desk.passes();
    assert!(ran.iter().any(|(_, name, _)| *name == "raycast_surface"), "{ran:?}");
    assert!(ran.iter().all(|(stage, ..)| *stage != Stage::Preprocess), "a rung runs stage 1: {ran:?}");

    wait::pace(LATER);
    let before = desk.console.stream().dispatches();
    desk.press(Key::Char(']'));
    desk.tick(Instant::now());
    assert_eq!(desk.console.quality(), Quality::default());
    desk.rest();
    let ran = desk.passes();
    assert!(!ran.is_empty() && ran.iter().all(|(stage, ..)| *stage == Stage::Postprocess), "gain: {ran:?}");
    let runs: u32 = ran.iter().map(|(.., runs)| runs).sum();
    assert_eq!(desk.console.stream().dispatches() - before, u64::from(runs), "one picture, in full quality at once");

    desk.press(Key::Char('l'));
    let full = desk.drawn();
    let mut lit = desk.drag_slowly([40.0, 36.0], [50.0, 40.0]);
    desk.rest();
    lit.extend(desk.drag_slowly([40.0, 36.0], [30.0, 30.0]));
    desk.rest();
    let ran = desk.passes();
    assert!(ran.iter().any(|(_, name, _)| *name == "light"), "{ran:?}");
    assert!(
        ran.iter().all(|(stage, name, _)| *stage >= Stage::Shade && !name.ends_with("_distance")),
        "light: {ran:?}"
    );
    assert!(lit.iter().all(|s| s.ray == full.ray && s.distance == full.distance), "a coarse distance map");
    assert!(lit.iter().any(|s| s.light.shadow.is_none()), "the shading has no ladder");
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "at rest");
}

/// Prevents a light volume that is made again because a view turns, and one in full for each picture while its light moves.
#[test]
fn the_cells_of_a_light_volume_are_coarser_while_the_light_moves_and_stay_while_the_view_turns() {
    let device = Device::alone();
    let settings =
        settings("mode = 'vr'\nslices = { pixels = 40, format = 'r8' }\nlight = { follows = 'region', volume = {} }");
    let mut desk = Desk::new(&device, ConsoleOptions { settings, budget: Some(Duration::from_nanos(1)), ..options() });
    desk.begin();
    desk.live(0);
    desk.press(Key::Space);
    desk.rest();
    let cells = |settings: &Settings| settings.light.volume.expect("a light volume").cells;
    let full = cells(&desk.drawn());
    let turned = desk.drag_slowly([40.0, 36.0], [60.0, 20.0]);
    assert!(
        turned.iter().any(|s| s.ray.subsampling > 1) && turned.iter().all(|s| cells(s) == full),
        "a view that turns"
    );
    desk.rest();
    desk.press(Key::Char('l'));
    let lit = desk.drag_slowly([40.0, 36.0], [50.0, 40.0]);
    assert!(lit.iter().any(|s| s.ray.subsampling > 1 && cells(s) < full), "a light that moves");
    desk.rest();
    assert!(desk.picture() == headless(&device, &desk.drawn(), &body(0)), "at rest");
}

/// A probe, which does not wait.
struct Hasty(Fed);

impl Live for Hasty {
    fn next(&mut self, patience: Duration) -> Event {
        self.0.next(patience)
    }

    fn can_wait(&self) -> bool {
        false
    }
}

/// Prevents live pictures that fall behind the probe, and a frozen volume that stays coarse.
#[test]
fn live_volumes_that_come_faster_than_pictures_go_down_the_ladder_until_they_are_frozen() {
    let device = Device::alone();
    let budget = Some(Duration::from_nanos(1));
    let (say, said) = channel();
    let said = Mutex::new(Some(said));
    let open: OpenSource = Arc::new(move || match said.lock().expect("lock").take() {
        Some(said) => Ok(Box::new(Hasty(Fed { said, is_recording: false })) as Box<dyn Live>),
        None => Err("no probe".into()),
    });
    let options = ConsoleOptions { settings: plain(), budget, ..options() };
    let mut desk = Desk { console: Console::new(&device, open, options, SIZE), say };
    desk.begin();
    let first = desk.live(0);
    assert_eq!(desk.console.quality(), Quality::default(), "of a single volume nothing is known");
    // By the console's clock a volume comes each microsecond: no picture is so fast.
    let start = Instant::now() + LATER;
    let mut rungs = Vec::new();
    for number in 1..=6 {
        desk.frames(body(number));
        let begun = Instant::now();
        let now = start + Duration::from_micros(number.into());
        while desk.console.stream().volumes_shown() <= u64::from(number) || !desk.console.stream().is_idle() {
            assert!(begun.elapsed() < BOUND, "volume {number} is never shown");
            wait::poll();
            desk.tick(now);
        }
        rungs.push(desk.console.quality().rays);
    }
    assert!(rungs[1..].iter().all(|rung| *rung > 0), "{rungs:?}");
    desk.press(Key::Space);
    desk.rest();
    assert_eq!(desk.console.quality(), Quality::default());
    let (seen, wanted) = (desk.picture(), headless(&device, &desk.drawn(), &body(6)));
    assert!(seen == wanted && seen != first);
}
