//! The fetal head in fluid: echoes and attenuation along a scan line.

use super::anatomy::{self, normal};
use super::speckle::{Beam, Echo};
use glam::{Mat3, Vec3, vec3};
use std::f32::consts::TAU;

/// Levels without attenuation, dB re full scale.
const FLUID: f32 = -46.0;
/// Noise of the receiver: no shadow is darker.
const FLOOR: f32 = -48.0;
/// Skin parallel to the beam, and the additional level when it faces the beam.
const SKIN: f32 = -9.0;
const SKIN_FACING: f32 = 4.0;
/// The skin's mirror echo when it faces the beam; the sum over the point-spread function adds about 15 dB.
const SKIN_MIRROR: f32 = -12.0;
const SOFT: f32 = -11.0;
const BONE: f32 = -4.5;
const BRAIN: f32 = -32.0;
const WALL: f32 = -19.0;
const LINING: f32 = -11.0;
const PROBE_SKIN: f32 = -9.0;

/// Two-way attenuation beyond the time-gain compensation, dB/mm.
const LOSS_SOFT: f32 = 0.12;
const LOSS_BONE: f32 = 4.5;
/// Gain of the compensation at every depth, dB/mm. It makes tissue behind fluid brighter.
const GAIN: f32 = 0.05;

/// Thicknesses, mm.
const SKIN_THICKNESS: f32 = 2.2;
const BONE_THICKNESS: f32 = 1.6;

/// Scale of the anatomy: mm in space for one mm of the model.
const SCALE: f32 = 1.0;
/// The distances of the model may grow faster than the point moves. So much of a distance is safe to skip.
const SAFE_STEP: f32 = 0.6;

pub(super) struct Head {
    /// Between the eyes, in the space of the probe.
    origin: Vec3,
    /// Y of the array's face.
    face: f32,
}

/// The moving parts at one time.
struct Pose {
    /// Rotation from the axes of space to those of the head.
    rotation: Mat3,
    /// Opening of the jaw, mm.
    mouth: f32,
    /// Flexion of the fingers, 0..=1.
    curl: f32,
}

impl Pose {
    /// All movements begin with zero speed, so that the first volume shows a still face.
    fn at(time: f64) -> Pose {
        // 0 at time 0, 1 after half a period.
        let swing = |period: f64| (0.5 - 0.5 * (std::f64::consts::TAU * time / period).cos()) as f32;
        // The head is slightly tilted, and nods and rotates by a few degrees.
        let yaw = (-7.0 + 15.0 * swing(9.0)).to_radians();
        let pitch = (2.0 - 3.0 * swing(7.0)).to_radians();
        let roll = 4.0f32.to_radians();
        let rotation = Mat3::from_rotation_z(roll) * Mat3::from_rotation_x(pitch) * Mat3::from_rotation_y(yaw);
        // The lips are a little apart; a yawn every five seconds.
        Pose { rotation, mouth: 1.4 + 5.0 * swing(5.0).powi(3), curl: 0.25 + 0.6 * swing(6.0) }
    }
}

/// The tissue at a point.
enum Tissue {
    /// Fluid; no tissue within so many mm.
    Fluid(f32),
    /// Depth below the nearest skin, mm, and the part that it belongs to.
    Inside(f32, Part),
}

#[derive(Clone, Copy, PartialEq)]
enum Part {
    Head,
    Limb,
}

impl Head {
    /// A head in front of an array whose face is at Y = `face` mm.
    pub fn new(face: f64) -> Head {
        let face = face as f32;
        Head { origin: vec3(0.0, face + 55.0, 5.0), face }
    }

    pub fn along(&self, beam: &Beam, out: &mut [Echo]) {
        let pose = Pose::at(beam.time);
        let pitch = beam.pitch as f32;
        let direction = beam.direction();
        let mut loss = 0.0;
        // Cosine of the angle between the beam and the normal of the skin that it entered.
        let mut facing: Option<f32> = None;
        let mut sample = 0;
        while sample < out.len() {
            let place = beam.rough_place(sample);
            let depth = beam.start_depth as f32 + sample as f32 * pitch;
            let wall = self.wall(place);
            let tissue = self.tissue(place, &pose);
            let (echo, lost) = match tissue {
                Tissue::Inside(deep, part) => {
                    let faced = *facing.get_or_insert_with(|| {
                        let n = normal(place, |p| match self.tissue(p, &pose) {
                            Tissue::Inside(deep, _) => -deep,
                            Tissue::Fluid(away) => away,
                        });
                        -n.dot(direction)
                    });
                    self.flesh(place, &pose, deep, part, faced.max(0.0))
                }
                Tissue::Fluid(away) if wall < 0.0 => {
                    facing = None;
                    // Up to the next possible surface everything is fluid.
                    let clear = (away.min(-wall) * SAFE_STEP / pitch) as usize;
                    let end = (sample + clear).min(out.len() - 1);
                    for (i, echo) in out[sample..end].iter_mut().enumerate() {
                        *echo = received(FLUID, loss, depth + i as f32 * pitch);
                    }
                    sample = end;
                    (Echo { diffuse: FLUID, ..Echo::SILENT }, 0.0)
                }
                Tissue::Fluid(_) => (uterus(place, wall, depth), LOSS_SOFT),
            };
            let depth = beam.start_depth as f32 + sample as f32 * pitch;
            out[sample] = received(echo.diffuse, loss, depth);
            if echo.mirror > Echo::SILENT.mirror {
                out[sample].mirror = echo.mirror - loss + GAIN * (depth - 50.0);
            }
            loss += lost * pitch;
            sample += 1;
        }
    }

    /// A point in the axes of the model: x right, y up, z towards the probe.
    fn local(&self, place: Vec3) -> Vec3 {
        let p = (place - self.origin) / SCALE;
        vec3(p.x, p.z, -p.y)
    }

    fn tissue(&self, place: Vec3, pose: &Pose) -> Tissue {
        let p = self.local(place);
        let head = anatomy::skin(pose.rotation * p, pose.mouth) * SCALE;
        let limb = anatomy::hand(p, pose.curl).min(anatomy::cord(p)).min(anatomy::shoulders(p)) * SCALE;
        match head.min(limb) {
            away if away > 0.0 => Tissue::Fluid(away),
            deep => Tissue::Inside(-deep, if head <= limb { Part::Head } else { Part::Limb }),
        }
    }

    /// Distance into the uterine wall, mm, negative in the cavity. The inner face is slightly uneven.
    fn wall(&self, place: Vec3) -> f32 {
        // The near wall is pressed in by the probe, the far one is concave.
        let near = 88.0 - (place - vec3(0.0, self.face - 72.0, 0.0)).length();
        let far = (place - vec3(0.0, self.face + 22.0, 0.0)).length() - 90.0;
        let cavity = near.max(far);
        cavity
            + 0.9 * (place.x * 0.11 + 0.6).sin() * (place.z * 0.13).cos()
            + 0.4 * (place.x * 0.31 - place.z * 0.23).sin()
    }

    /// Echo and loss (dB/mm) inside the fetus.
    fn flesh(&self, place: Vec3, pose: &Pose, deep: f32, part: Part, facing: f32) -> (Echo, f32) {
        let skin = || Echo {
            diffuse: SKIN + SKIN_FACING * facing,
            // A specular echo returns only if the surface faces the beam.
            mirror: if deep < 0.5 { SKIN_MIRROR + 20.0 * facing.max(0.1).log10() * 3.0 } else { Echo::SILENT.mirror },
        };
        let soft = Echo { diffuse: SOFT + texture(place, 0.5), ..Echo::SILENT };
        if part == Part::Limb {
            return (if deep < SKIN_THICKNESS { skin() } else { soft }, LOSS_SOFT);
        }
        let p = pose.rotation * self.local(place);
        let bone = -anatomy::bone(p, pose.mouth) * SCALE;
        let in_brain = anatomy::brain(p) < 0.0;
        if bone > 0.0 && bone < BONE_THICKNESS {
            (Echo { diffuse: BONE + 3.0 * facing, ..Echo::SILENT }, LOSS_BONE)
        } else if deep < SKIN_THICKNESS {
            (skin(), LOSS_SOFT)
        } else if in_brain {
            // The falx between the hemispheres.
            let falx = if p.x.abs() < 0.7 { 9.0 } else { 0.0 };
            (Echo { diffuse: BRAIN + falx + texture(place, 0.25), ..Echo::SILENT }, LOSS_SOFT)
        } else {
            (soft, LOSS_SOFT)
        }
    }
}

/// The received echo of a level, dB.
fn received(level: f32, loss: f32, depth: f32) -> Echo {
    Echo { diffuse: (level - loss + GAIN * (depth - 50.0)).max(FLOOR), ..Echo::SILENT }
}

/// Layers of maternal skin, fascia and muscle, and the bright lining of the cavity.
fn uterus(place: Vec3, wall: f32, depth: f32) -> Echo {
    let layers = 3.0 * (wall * TAU / 3.4 + 0.5 * (place.x * 0.2).sin()).sin();
    let level = if depth < 2.0 {
        PROBE_SKIN
    } else if wall < 0.8 {
        LINING
    } else {
        WALL + layers + texture(place, 0.35)
    };
    Echo { diffuse: level, ..Echo::SILENT }
}

/// Slow variation of a tissue's level, dB, over about `1 / fineness` mm.
fn texture(place: Vec3, fineness: f32) -> f32 {
    let p = place * fineness;
    let wave = |a: Vec3| (p.dot(a)).sin();
    1.6 * (wave(vec3(1.3, 0.7, 0.4)) + wave(vec3(-0.6, 1.1, 0.9)) + wave(vec3(0.5, -0.8, 1.2)))
}
