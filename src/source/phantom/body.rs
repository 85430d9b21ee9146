//! The bodies of the phantom: their echoes, and the ground truth of those that have a formula.

use super::PhantomOptions;
use super::head::Head;
use super::labels::Label;
use super::speckle::{Beam, DYNAMIC_RANGE, Echo};
use super::vessels::VesselTree;
use crate::files::InputError;
use crate::probe::Probe;
use crate::tree::{All, Name};
use glam::DVec3;
use std::path::Path;

/// The object that the phantom's probe scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, All, Name)]
#[tree(rename_all = "lowercase")]
pub enum Body {
    /// A fetal head, shoulders, a hand and an umbilical cord, in fluid behind the uterine wall. Head and hand move, unless [`PhantomOptions::still`]
    /// is true.
    #[default]
    Head,
    /// A bright ball in dark fluid.
    Sphere,
    /// Dark between the probe and a plane across the central beam, bright behind the plane.
    Step,
    /// Thin bright wires in dark fluid.
    Wires,
    /// The same grey everywhere.
    Constant,
    /// Grey that rises linearly with range, line angle and motor angle.
    Ramp,
    /// A beating chamber: dark blood in a bright wall.
    Heart,
    /// A piece of liver with a branching portal vein.
    Vessels,
}

impl Body {
    /// The labels that this object's ground truth can have. Empty if a formula describes the object.
    pub fn labels(self) -> &'static [Label] {
        match self {
            Body::Head => &Label::ALL[..10],
            Body::Vessels => &Label::ALL[10..],
            _ => &[],
        }
    }
}

named!(Body, "body");

/// A straight wire between two points, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    pub from: DVec3,
    pub to: DVec3,
}

impl Wire {
    /// Distance of a position from the line segment between the two points, mm.
    pub fn distance(&self, place: DVec3) -> f64 {
        let along = self.to - self.from;
        let share = ((place - self.from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (place - self.from - along * share).length()
    }
}

/// The formula grey = `middle` + `per_mm` (range - `range`) + `per_line_rad` line angle + `per_motor_rad` motor angle. Range is the distance
/// from the in-plane apex, mm; angles are in rad. Trilinear interpolation between samples reproduces it, for both directions of the sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RampTruth {
    pub middle: f64,
    pub range: f64,
    pub per_mm: f64,
    pub(crate) per_line_rad: f64,
    pub(crate) per_motor_rad: f64,
}

impl RampTruth {
    pub fn grey(&self, range: f64, line_angle: f64, motor_angle: f64) -> f64 {
        self.middle
            + self.per_mm * (range - self.range)
            + self.per_line_rad * line_angle
            + self.per_motor_rad * motor_angle
    }
}

/// The ground truth of the scanned object: positions in mm in the coordinates of [`Probe`], grey values 0..255 without speckle.
///
/// Edges are linear in grey over the distance from a sample to the next, measured perpendicular to the edge, with the middle grey on the edge itself.
#[derive(Clone, Debug, PartialEq)]
pub enum Truth {
    /// The head, which no formula describes.
    Head,
    Sphere {
        centre: DVec3,
        radius: f64,
        inside: f64,
        outside: f64,
    },
    /// Grey `above` and `below` the plane Y = `y`.
    Step {
        y: f64,
        above: f64,
        below: f64,
    },
    /// Grey `peak` on the axis of a wire, minus `per_mm2` times the square of the distance from it, but at least `outside`.
    Wires {
        wires: Vec<Wire>,
        peak: f64,
        per_mm2: f64,
        outside: f64,
    },
    Constant {
        grey: f64,
    },
    Ramp(RampTruth),
    Heart(HeartTruth),
    Vessels(VesselTree),
}

/// A ball of blood, whose radius changes with time, in a muscular wall: the ground truth of the phantom's heart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeartTruth {
    pub centre: DVec3,
    /// Radius of the blood, mm, at the end of systole and at the end of diastole.
    pub radii: [f64; 2],
    /// Thickness of the muscular wall, mm.
    pub wall: f64,
    /// Length of a heart cycle at the mean rate, s.
    pub period: f64,
    /// Amplitude of the change of the heart rate, as a share of its mean. One rise and fall takes 8 s.
    pub swing: f64,
    pub blood: f64,
    pub muscle: f64,
    pub outside: f64,
}

impl HeartTruth {
    /// Share of the cycle that the heart contracts.
    const SYSTOLE: f64 = 0.38;
    /// In so many seconds the rate rises, falls below the mean and comes back.
    const SWING_SECONDS: f64 = 8.0;

    /// Number of heart cycles, fractional, from time 0 to `time` s. It is whole at the end of each diastole.
    pub fn cycles(&self, time: f64) -> f64 {
        let turn = std::f64::consts::TAU / HeartTruth::SWING_SECONDS;
        (time + self.swing * (1.0 - (turn * time).cos()) / turn) / self.period
    }

    /// Radius of the blood, mm, at a phase (in cycles). It is largest at phase 0.
    pub fn radius(&self, phase: f64) -> f64 {
        let phase = phase.rem_euclid(1.0);
        let filled = match phase < HeartTruth::SYSTOLE {
            true => 0.5 + 0.5 * (std::f64::consts::PI * phase / HeartTruth::SYSTOLE).cos(),
            false => {
                let filling = (phase - HeartTruth::SYSTOLE) / (1.0 - HeartTruth::SYSTOLE);
                0.5 - 0.5 * (std::f64::consts::PI * filling).cos()
            }
        };
        self.radii[0] + (self.radii[1] - self.radii[0]) * filled
    }
}

/// Grey values of the bodies with a formula. The constant one is 15 dB below full scale, where neither end of the scale clips.
const BRIGHT: f64 = 204.0;
const DARK: f64 = 25.5;
const CONSTANT: f64 = 255.0 * (1.0 - 15.0 / DYNAMIC_RANGE);
/// Blood at rest reflects next to nothing: 47.5 dB below full scale, as noise does.
const BLOOD: f64 = 12.75;
const WIRE_PEAK: f64 = 250.0;
/// Grey falls by this times the square of the distance: a wire is 2.9 mm wide in all, so that no frame pitch misses it.
const WIRE_FALL: f64 = 107.0;

/// The echoes of a scanned object as a function of position and time.
pub(super) enum Scatterers {
    Head(Box<Head>),
    Exact { truth: Truth, pitch: f64 },
}

impl Scatterers {
    /// The object that `options.body` names, placed before the face of the probe.
    pub fn new(options: &PhantomOptions, probe: &Probe) -> Scatterers {
        let face = probe.array_radius();
        let depth = |depth: f64| face + depth;
        let truth = match options.body {
            Body::Head => return Scatterers::Head(Box::new(Head::new(face, options))),
            Body::Sphere => Truth::Sphere {
                centre: DVec3::new(4.0, depth(62.0), -3.0),
                radius: 20.0,
                inside: BRIGHT,
                outside: DARK,
            },
            Body::Step => Truth::Step { y: depth(60.0), above: DARK, below: BRIGHT },
            Body::Wires => {
                let wire = |from: [f64; 3], to: [f64; 3]| {
                    let place = |[x, y, z]: [f64; 3]| DVec3::new(x, depth(y), z);
                    Wire { from: place(from), to: place(to) }
                };
                // Along the elevation, and oblique. A wire along the lateral axis might be between two frames.
                let wires = vec![
                    wire([0.0, 30.0, -60.0], [0.0, 30.0, 60.0]),
                    wire([-22.0, 45.0, -60.0], [-22.0, 45.0, 60.0]),
                    wire([20.0, 60.0, -60.0], [20.0, 60.0, 60.0]),
                    wire([-10.0, 70.0, -50.0], [10.0, 86.0, 50.0]),
                    wire([30.0, 100.0, -70.0], [-30.0, 100.0, 70.0]),
                ];
                Truth::Wires { wires, peak: WIRE_PEAK, per_mm2: WIRE_FALL, outside: DARK }
            }
            Body::Constant => Truth::Constant { grey: CONSTANT },
            // A large fetal heart at 144 a minute.
            Body::Heart => Truth::Heart(HeartTruth {
                centre: DVec3::new(2.0, depth(58.0), -1.0),
                radii: if options.still { [13.0; 2] } else { [9.0, 13.0] },
                wall: 4.0,
                period: 60.0 / 144.0,
                swing: options.heart_swing,
                blood: DARK,
                muscle: BRIGHT,
                outside: CONSTANT,
            }),
            Body::Vessels => Truth::Vessels(VesselTree::new(face, [BLOOD, BRIGHT, CONSTANT])),
            Body::Ramp => {
                // A third of the scale for each of the three, so that no corner clips.
                let share = 80.0;
                let over = |span: f64| share / span;
                Truth::Ramp(RampTruth {
                    middle: 127.5,
                    range: (probe.first_range() + probe.last_range()) / 2.0,
                    per_mm: over(probe.last_range() - probe.first_range()),
                    per_line_rad: over(probe.lines.last() - probe.lines.first()),
                    // The motor travels up to one pitch beyond the last frame's first line.
                    per_motor_rad: over(probe.slices.last() - probe.slices.first() + 2.0 * probe.slices.pitch()),
                })
            }
        };
        Scatterers::Exact { truth, pitch: probe.sample_pitch }
    }

    pub fn truth(&self) -> Truth {
        match self {
            Scatterers::Head(_) => Truth::Head,
            Scatterers::Exact { truth, .. } => truth.clone(),
        }
    }

    /// Computes the echoes of the first samples of a scan line, as many as `out` has room for.
    pub fn along(&self, beam: &Beam, out: &mut [Echo]) {
        match self {
            Scatterers::Head(head) => head.along(beam, out),
            Scatterers::Exact { truth, pitch } => {
                for (sample, echo) in out.iter_mut().enumerate() {
                    *echo = exact(truth, beam, sample, *pitch);
                }
            }
        }
    }
}

fn level(grey: f64) -> f32 {
    ((grey / 255.0 - 1.0) * DYNAMIC_RANGE) as f32
}

fn exact(truth: &Truth, beam: &Beam, sample: usize, pitch: f64) -> Echo {
    let place = beam.place(sample);
    // An edge is linear over one sample. A sharper edge could not be located between samples.
    let edge = |beyond: f64, near: f64, far: f64| near + (far - near) * (beyond / pitch + 0.5).clamp(0.0, 1.0);
    let diffuse = match truth {
        Truth::Sphere { centre, radius, inside, outside } => {
            edge(radius - (place - centre).length(), *outside, *inside)
        }
        Truth::Step { y, above, below } => edge(place.y - y, *above, *below),
        Truth::Wires { wires, peak, per_mm2, outside } => {
            let nearest = wires.iter().map(|wire| wire.distance(place)).fold(f64::MAX, f64::min);
            let bump = peak - per_mm2 * nearest * nearest;
            let mirror = if bump > *outside { level(bump) } else { Echo::SILENT.mirror };
            let diffuse = if mirror > Echo::SILENT.mirror { Echo::SILENT.diffuse } else { level(*outside) };
            return Echo { diffuse, mirror };
        }
        Truth::Heart(heart) => {
            let away = (place - heart.centre).length() - heart.radius(heart.cycles(beam.time));
            edge(away, heart.blood, edge(away - heart.wall, heart.muscle, heart.outside))
        }
        Truth::Vessels(tree) => {
            let away = tree.distance(place);
            edge(away, tree.blood, edge(away - tree.wall, tree.muscle, tree.tissue))
        }
        Truth::Constant { grey } => *grey,
        Truth::Ramp(ramp) => ramp.grey(beam.range + pitch * sample as f64, beam.line_angle, beam.motor_angle),
        Truth::Head => return Echo::SILENT,
    };
    Echo { diffuse: level(diffuse), ..Echo::SILENT }
}

/// The error that an option of the phantom is out of its range.
pub(super) fn refusal(field: impl AsRef<str>, fault: impl AsRef<str>) -> InputError {
    InputError::new(Path::new("phantom"), field, fault)
}
