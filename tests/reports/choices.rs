//! A choice keeps its bound: on random scenes, chosen settings are rendered once more and compared with a reference that the chooser
//! does not use.

use crate::common::scenes::FLOATS;
use crate::scenes::*;
use echolume::low_level::error_report::choose::Bound;
use echolume::low_level::error_report::dials::{NAMES, dial};
use echolume::low_level::error_report::errors_and_times::{ErrorMeasurement, MeasureError, ReferenceChoice};
use echolume::low_level::error_report::{Kind, Measure, Time, metrics};
use echolume::low_level::exact_ray::picture::{self, Effort};
use echolume::low_level::gpu::TimeStamps;
use echolume::low_level::passes::chain::distance_end;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Array, Axis, Geometry, Grid, Indices, Motion, Probe};
use echolume::low_level::reference;
use echolume::low_level::scene::Scene;
use echolume::low_level::scene::default_look::Recorded;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::source::Frame;
use echolume::{Renderer, RendererOptions};

/// Runs by which a choice is verified.
const RUNS: u32 = 20;

/// Runs by which a bound of a time, a 95th percentile, is judged independently, and how many of them may exceed it: if one in twenty does, more than
/// 10 of 60 do once in 5,800 times (binomial distribution).
const JUDGED: u32 = 60;
const MOST_LATE: usize = 10;

/// Numbers in 0..1 (xorshift64*, Vigna 2016).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.unit() * all.len() as f64) as usize]
    }
}

struct Case {
    geometry: Geometry,
    layers: Layers,
    frames: Vec<Frame>,
}

impl Case {
    /// Geometry, body, mode, transfer function and camera at random.
    fn random(number: u64) -> Case {
        let mut random = Random(0x9e37_79b9_7f4a_7c15 ^ (number + 1).wrapping_mul(0xd134_2543_de82_ef95));
        let r = &mut random;
        let [lines, samples, slices] =
            [r.within(30.0, 60.0), r.within(60.0, 110.0), r.within(9.0, 19.0)].map(|n| n as usize);
        let geometry = match r.one_of(&[0, 1, 2]) {
            0 => Geometry::Sweep(Probe {
                lines: Axis::centred(r.within(0.015, 0.025), lines),
                sample_pitch: r.within(0.4, 0.6),
                samples,
                slices: Axis::centred(r.within(0.02, 0.06), slices),
                ..probe()
            }),
            1 => Geometry::Sweep(Probe {
                array: Array::Linear,
                motion: Motion::Translated,
                lines: Axis::centred(r.within(0.5, 0.8), lines),
                sample_pitch: r.within(0.4, 0.6),
                samples,
                slices: Axis::centred(r.within(0.8, 2.0), slices),
                ..probe()
            }),
            _ => Geometry::Cartesian(Grid {
                size: [lines, samples, slices],
                spacing: [r.within(0.5, 0.8), r.within(0.4, 0.6), r.within(0.8, 2.0)],
                origin: [0.0; 3],
            }),
        };
        let mut layers = Layers::default();
        let mode = r.one_of(&["vr", "vr", "vr", "mip", "mean", "sr"]);
        let low = r.within(0.05, 0.3);
        let colour = |r: &mut Random| format!("[{:.2},{:.2},{:.2}]", r.unit(), r.unit(), r.unit());
        let transfer = format!(
            "volume.transfer=[{{at={low:.3},colour={},opacity=0.0}},{{at={:.3},colour={},opacity={:.3}}},{{at=0.95,colour={},opacity={:.3}}}]",
            colour(r),
            low + r.within(0.1, 0.4),
            colour(r),
            r.within(0.01, 0.4),
            colour(r),
            r.within(0.05, 0.6)
        );
        let sets = [
            format!("mode={mode}"),
            "picture.size=[48,40]".into(),
            format!("slices.pixels={}", r.one_of(&[48, 64, 80])),
            transfer,
            format!("camera.azimuth={:.1}", r.within(-70.0, 70.0)),
            format!("camera.elevation={:.1}", r.within(-30.0, 30.0)),
            format!("camera.zoom={:.2}", r.within(0.8, 2.0)),
            format!("camera.field_of_view={}", r.one_of(&[0, 0, 30])),
            format!("surface.threshold={:.2}", r.within(0.08, 0.2)),
            // The rough search is another detector; exact rays have none.
            "surface.rough=1".into(),
        ];
        sets.iter().for_each(|set| layers.set(set).expect("setting"));
        let (rough, tilt) = ([r.within(0.1, 0.4), r.within(0.1, 0.4)], r.within(-0.3, 0.3));
        let frames = match &geometry {
            Geometry::Sweep(probe) => frames(probe, rough, tilt),
            Geometry::Cartesian(grid) => voxels(grid, rough, tilt),
        };
        Case { geometry, layers, frames }
    }

    fn scene(&self, set: &[String]) -> Scene {
        let mut layers = self.layers.clone();
        set.iter().for_each(|assignment| layers.set(assignment).expect("an assignment of a choice"));
        Scene::new(self.geometry.clone(), FLOATS, layers.finish().expect("settings")).expect("scene")
    }
}

/// A bumpy wall at the depth `middle`, mm, with a bright layer behind it.
fn echo(p: glam::DVec3, middle: f64, rough: [f64; 2], tilt: f64) -> f32 {
    let wall = middle + tilt * p.x + 1.5 * (rough[0] * p.x).sin() * (rough[1] * p.z).cos();
    let behind = (-((p.y - wall - 6.0) / 2.0).powi(2)).exp();
    (0.1 + 0.5 * ((p.y - wall) / 3.0 + 0.5).clamp(0.0, 1.0) + 0.3 * behind) as f32
}

fn frames(probe: &Probe, rough: [f64; 2], tilt: f64) -> Vec<Frame> {
    let [samples, lines] = [probe.samples, probe.lines.len()];
    let place = |sample: usize, line: usize, slice: usize| {
        probe.to_space(Indices { sample: sample as f64, line: line as f64, slice: slice as f64 })
    };
    let middle = place(samples / 2, lines / 2, probe.slices.len() / 2).y;
    let frame = |slice: usize| {
        let all = (0..lines).flat_map(|line| (0..samples).map(move |sample| (sample, line)));
        all.flat_map(|(sample, line)| echo(place(sample, line, slice), middle, rough, tilt).to_le_bytes()).collect()
    };
    (0..probe.slices.len()).map(|slice| numbered(slice, frame(slice))).collect()
}

fn voxels(grid: &Grid, rough: [f64; 2], tilt: f64) -> Vec<Frame> {
    let [w, h, d] = grid.size;
    let at = |x: usize, y: usize, z: usize| {
        glam::DVec3::new(
            x as f64 * grid.spacing[0] + grid.origin[0],
            y as f64 * grid.spacing[1] + grid.origin[1],
            z as f64 * grid.spacing[2] + grid.origin[2],
        )
    };
    let middle = at(0, h / 2, 0).y;
    let frame = |z: usize| {
        let all = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        all.flat_map(|(x, y)| echo(at(x, y, z), middle, rough, tilt).to_le_bytes()).collect()
    };
    (0..d).map(|z| numbered(z, frame(z))).collect()
}

fn numbered(slice: usize, bytes: Vec<u8>) -> Frame {
    Frame::of_slice(0, slice, bytes)
}

/// What came of a bound.
enum Outcome {
    /// The choice, and whether an independent measurement found the bound kept: of a time, or of an error.
    /// `is_other`: it is not the scene as it is.
    Held { kept: bool, is_other: bool, is_time: bool, description: String },
    /// Nothing that was measured keeps it.
    None(String),
}

impl Case {
    /// Chooses among these dials for a bound at random. A time is remeasured, and counts, if `timed`.
    fn choose(&self, number: u64, names: &[&str], repeats: u32, timed: bool) -> Outcome {
        let context = device();
        let scene = self.scene(&[]);
        let dials: Vec<_> = names
            .iter()
            .filter_map(|name| dial(name, &scene).ok())
            .filter(|d| matches!(d.kind, Kind::Numerical | Kind::Several))
            .collect();
        let recorded = Recorded::as_set(self.geometry.clone(), FLOATS);
        let measurement = ErrorMeasurement {
            context: &context,
            recorded: &recorded,
            layers: &self.layers,
            scene: &scene,
            frames: &self.frames,
            input: "a random wall",
            repeats,
            reference: ReferenceChoice::Auto,
        };
        let mut random = Random(number.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x1234_5678);
        let finest = measurement.finest().expect("the finest picture");
        let as_it_is = measurement.report(&dials[..1], &finest, None, |_, _| {}).expect("report");
        let first = &as_it_is.choices[0];
        let time = first.times.map_or(0.0, |times| times.total.median);
        let bound = match timed && number % 2 == 1 {
            true => Bound::Time(time * random.within(0.9, 2.5)),
            // A looser bound, for which there is something faster, in two of three.
            false => Bound::Error(first.errors.rmse.max(1e-6) * 10f64.powf(random.within(-0.6, 1.2))),
        };
        let report = measurement.report(&dials, &finest, Some(bound), |_, _| {}).expect("report");
        assert!(report.choices.iter().all(|choice| choice.times.is_some()), "case {number}: a choice has no time");
        match measurement.choose(&finest, &report, Measure::Rmse, bound, RUNS) {
            Err(MeasureError::NoChoice(why)) => Outcome::None(why),
            Err(other) => panic!("case {number}: {other}"),
            Ok(verified) => {
                let (kept, found) = match bound {
                    Bound::Error(limit) => {
                        let error = self.error(&verified.choice.set);
                        (error <= limit, format!("RMSE {error:.2e} of {limit:.2e}"))
                    }
                    Bound::Time(limit) => {
                        // The limit is a time of the run that chose, in which the scene as it is took so long.
                        let allowed = limit / verified.unchanged.expect("times").total.median;
                        let (share, late) = self.time_share(&verified.choice.set, allowed);
                        let found = format!(
                            "{share:.3} of the scene's time, allowed are {allowed:.3}; {late} of {JUDGED} were late"
                        );
                        (late <= MOST_LATE, found)
                    }
                };
                Outcome::Held {
                    kept,
                    is_other: !verified.choice.set.is_empty(),
                    is_time: matches!(bound, Bound::Time(_)),
                    description: format!("({}) {found}", verified.choice.set.join(" ")),
                }
            }
        }
    }

    /// RMSE of a picture of some settings, rendered on a device of its own, against exact rays through the volume that stage 1 of the
    /// unchanged scene gives in f64; of surfaces, over the pixels whose rays find the same one.
    fn error(&self, set: &[String]) -> f64 {
        let context = device();
        let floats = |mut scene: Scene| {
            scene.settings.post.floats = true;
            scene
        };
        let mut renderer =
            Renderer::new(&context, floats(self.scene(set)), &RendererOptions::default()).expect("renderer");
        for frame in &self.frames {
            renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
        }
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        let rendered = renderer.read(Slot::Picture).expect("read").expect("a picture");
        let scene = floats(self.scene(&[]));
        let mut effort = Effort::default();
        let mut slots =
            reference::render_with(&scene, &reference::decoded(&scene, &self.frames), &mut |pass, reads, writes| {
                picture::replace(&scene, pass, reads, writes, &mut effort)
            });
        let expected: Texels = slots.remove(&Slot::Picture).expect("a picture");
        let changed = match scene.detects_surface() {
            true => {
                let slot = distance_end(&scene);
                let found = renderer.read(distance_end(renderer.scene())).expect("read").expect("distances");
                let there = slots.remove(&slot).expect("distances");
                metrics::changed_rays(&found, &there, scene.cliff(), expected.size)
            }
            false => vec![false; expected.size[0] * expected.size[1]],
        };
        let pairs = rendered.values.chunks_exact(4).zip(expected.values.chunks_exact(4)).zip(&changed);
        let squares: Vec<f64> = pairs
            .filter(|(_, is_changed)| !**is_changed)
            .flat_map(|((a, b), _)| [0, 1, 2].map(|c| (a[c] - b[c]).powi(2)))
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Median time of a volume and its picture, and how many of [`JUDGED`] took longer than `allowed`, as shares of the median of the scene as it is, which
    /// is drawn in turn with it: a machine that has become slower since the choice makes both slower.
    fn time_share(&self, set: &[String], allowed: f64) -> (f64, usize) {
        let context = device();
        let renderer = |set: &[String]| {
            let options = RendererOptions { time_stamps: TimeStamps::EachPass, ..RendererOptions::default() };
            Renderer::new(&context, self.scene(set), &options).expect("renderer")
        };
        let (mut own, mut other) = (renderer(set), renderer(&[]));
        let run = |renderer: &mut Renderer| -> f64 {
            for frame in &self.frames {
                renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
            }
            renderer.show(0).expect("show");
            renderer.picture().expect("picture");
            let times = renderer.take_times().expect("times");
            assert!(!times.is_empty(), "the device has no time stamps");
            times.iter().map(|t| t.total).sum()
        };
        // The first run compiles shaders.
        run(&mut own);
        run(&mut other);
        let (others, owns): (Vec<f64>, Vec<f64>) = (0..JUDGED).map(|_| (run(&mut other), run(&mut own))).unzip();
        let median = |times: &[f64]| Time::of(times).expect("runs").median;
        let limit = allowed * median(&others);
        (median(&owns) / median(&others), owns.iter().filter(|time| **time > limit).count())
    }
}

/// Prevents a choice by errors that were added: on their own scene such choices broke their bound. And a chooser that keeps the scene as it is, which holds
/// any bound that the scene holds: of twelve scenes most have something faster, or have to have something more accurate. Times are left to the test below.
#[test]
fn a_choice_keeps_its_error_on_random_scenes() {
    let _alone = alone();
    let (mut held, mut others) = (0, 0);
    for number in 0..12 {
        match Case::random(number).choose(number, &["step", "format", "termination", "pipeline"], 1, false) {
            Outcome::Held { kept, is_other, description, .. } => {
                println!("case {number}: {description}");
                assert!(kept, "case {number}: {description}");
                held += 1;
                others += usize::from(is_other);
            }
            Outcome::None(why) => println!("case {number}: {why}"),
        }
    }
    println!("{held} of 12 held, {others} of them by other settings than the scene's");
    // A third of the bounds are below the error of the scene as it is, whatever the times are.
    assert!(held >= 9 && others >= 3, "{held} of 12 held, {others} of them by other settings than the scene's");
}

/// A hundred scenes, with errors and times: a quarter of an hour on a quiet machine. `tools/test choices --ignored --nocapture` prints how
/// many times were kept when they were measured once more; only errors, which do not depend on the machine's load, can fail it.
#[test]
#[ignore = "takes a quarter of an hour, and a quiet machine"]
fn choices_hold_on_a_hundred_random_scenes() {
    let _alone = alone();
    let (mut held, mut others, mut broken, mut late) = (0, 0, Vec::new(), Vec::new());
    for number in 0..100 {
        match Case::random(number).choose(number, NAMES, 10, true) {
            Outcome::Held { kept, is_other, is_time, description } => {
                others += usize::from(is_other);
                println!("case {number}: {} {description}", if kept { "holds" } else { "BROKEN" });
                held += 1;
                if !kept {
                    (if is_time { &mut late } else { &mut broken }).push(number);
                }
            }
            Outcome::None(why) => println!("case {number}: none: {why}"),
        }
    }
    println!(
        "says \"holds\" on {held} of 100, on {others} by other settings than the scene's; it does not hold an error on {broken:?}, a time on {late:?}"
    );
    assert!(held >= 80 && others >= 50 && broken.is_empty(), "{held}, {others}, {broken:?}");
}
