//! The fetal head in fluid: echoes and attenuation along a scan line.

use super::labels::Label;
use super::limbs::{Hand, cord, shoulders};
use super::shape::{gradient, normal};
use super::skull::{self, Intracranial, intracranial, is_bone};
use super::speckle::{Beam, Echo};
use super::{GAP, PhantomOptions, face};
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
/// Level of the specular echo from a bone that faces the beam. Bone reflects about a tenth of the power, far more than soft tissue scatters
/// back: it saturates the grey scale, as in a real picture.
const BONE_MIRROR: f32 = 13.0;
/// Thickness of the layer that the specular echo of a bone comes from, mm: rough on the scale of a wavelength.
const BONE_FACE: f32 = 0.5;
const BRAIN: f32 = -29.0;
const THALAMUS: f32 = -34.0;
const SULCUS: f32 = -15.0;
const FALX: f32 = -12.0;
const CHOROID_PLEXUS: f32 = -11.0;
const WALL: f32 = -19.0;
const LINING: f32 = -11.0;
const PROBE_SKIN: f32 = -9.0;

/// Two-way attenuation beyond the time-gain compensation, dB/mm.
const LOSS_SOFT: f32 = 0.12;
const LOSS_BONE: f32 = 2.5;
/// Gain of the compensation at every depth, dB/mm. It makes tissue behind fluid brighter.
const GAIN: f32 = 0.05;

/// Thickness, mm.
const SKIN_THICKNESS: f32 = 2.2;
/// Least depth of a bone below the skin, mm.
const SKIN_LEAST: f32 = 0.8;

/// Radius of the near wall, mm, that leaves a gap of [`GAP`].
const NEAR_WALL: f32 = 88.0;

/// Scale of the anatomy: mm in space for one mm of the model.
const SCALE: f32 = 1.0;
/// The distances of the model may grow faster than the point moves. So much of a distance is safe to skip.
const SAFE_STEP: f32 = 0.6;

pub(super) struct Head {
    /// Between the eyes, in the space of the probe.
    origin: Vec3,
    /// Y of the array's face.
    face: f32,
    /// Nothing moves.
    still: bool,
    /// Radius of the near wall, mm: how far it bulges towards the fetus.
    near_wall: f32,
    /// Power of the clutter, re full scale; 0 without.
    clutter: f32,
}

/// The moving parts at one time.
struct Pose {
    /// Rotation from the axes of space to those of the head.
    rotation: Mat3,
    /// Opening of the jaw, mm.
    mouth: f32,
    hand: Hand,
}

impl Pose {
    /// All movements begin with zero speed, so that the first volume shows a still face.
    fn at(time: f64) -> Pose {
        // 0 at time 0, 1 after half a period.
        let swing = |period: f64| (0.5 - 0.5 * (std::f64::consts::TAU * time / period).cos()) as f32;
        // The head is slightly tilted, and nods and rotates by a few degrees.
        let yaw = (-7.0 + 11.0 * swing(9.0)).to_radians();
        let pitch = (2.0 - 3.0 * swing(7.0)).to_radians();
        let roll = 4.0f32.to_radians();
        let rotation = Mat3::from_rotation_z(roll) * Mat3::from_rotation_x(pitch) * Mat3::from_rotation_y(yaw);
        // Asleep, the lips apart, with a yawn every five seconds.
        Pose { rotation, mouth: 1.7 + 4.8 * swing(5.0).powi(3), hand: Hand::new(0.25 + 0.6 * swing(6.0)) }
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
    Hand,
    Cord,
    Trunk,
}

impl Head {
    /// A head with what is around it, in front of an array whose face is at Y = `face` mm.
    pub fn new(face: f64, options: &PhantomOptions) -> Head {
        let face = face as f32;
        let PhantomOptions { still, gap, clutter_db, .. } = *options;
        Head {
            // The whole vault is inside the fan.
            origin: vec3(0.0, face + 55.0, 0.0),
            face,
            still,
            near_wall: NEAR_WALL + (GAP - gap) as f32,
            clutter: clutter_db.map_or(0.0, |level| 10f32.powf(level as f32 / 10.0)),
        }
    }

    fn pose(&self, time: f64) -> Pose {
        Pose::at(if self.still { 0.0 } else { time })
    }

    pub fn along(&self, beam: &Beam, out: &mut [Echo]) {
        let pose = self.pose(beam.time);
        let pitch = beam.pitch as f32;
        let direction = beam.direction();
        let mut loss = 0.0;
        // Cosine of the angle between the beam and the normal of the skin that it entered.
        let mut facing: Option<f32> = None;
        let mut sample = 0;
        while sample < out.len() {
            let place = beam.place(sample).as_vec3();
            let depth = beam.start_depth as f32 + sample as f32 * pitch;
            let wall = self.wall(place);
            let tissue = self.tissue(place, &pose);
            let (echo, lost) = match tissue {
                Tissue::Inside(deep, part) => {
                    let faced = *facing
                        .get_or_insert_with(|| -normal(place, |p| self.tissue(p, &pose).distance()).dot(direction));
                    self.flesh(place, direction, &pose, deep, part, faced.max(0.0))
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
        if self.clutter > 0.0 {
            // What reverberates adds its power, and arrives from no place of its own.
            let with_clutter = |level: f32| 10.0 * (10f32.powf(level / 10.0) + self.clutter).log10();
            out.iter_mut().for_each(|echo| echo.diffuse = with_clutter(echo.diffuse));
        }
    }

    /// A point in the axes of the model: x right, y up, z towards the probe.
    fn local(&self, place: Vec3) -> Vec3 {
        let p = (place - self.origin) / SCALE;
        vec3(p.x, p.z, -p.y)
    }

    fn tissue(&self, place: Vec3, pose: &Pose) -> Tissue {
        let p = self.local(place);
        let mut nearest = (face::skin(pose.rotation * p, pose.mouth), Part::Head);
        for (distance, part) in
            [(shoulders(p), Part::Trunk), (pose.hand.distance(p), Part::Hand), (cord(p), Part::Cord)]
        {
            if distance < nearest.0 {
                nearest = (distance, part);
            }
        }
        match nearest.0 * SCALE {
            away if away > 0.0 => Tissue::Fluid(away),
            deep => Tissue::Inside(-deep, nearest.1),
        }
    }

    /// Distance of a position (mm in the space of the probe) from the skin at a time (s), mm, negative inside. It is exact on the skin and correct
    /// to first order near it.
    pub fn distance(&self, place: Vec3, time: f64) -> f32 {
        // Far from the skin the slope is that of the bounds, not of the surface.
        const NEAR: f32 = 2.0;
        let pose = self.pose(time);
        let distance = |p| self.tissue(p, &pose).distance();
        let here = distance(place);
        if here.abs() > NEAR { here } else { here / gradient(place, distance).length().clamp(0.5, 2.0) }
    }

    /// The tissue's label at a position, mm in the space of the probe, and a time, s.
    pub fn label(&self, place: Vec3, time: f64) -> Label {
        let pose = self.pose(time);
        match self.tissue(place, &pose) {
            Tissue::Fluid(_) if self.wall(place) < 0.0 => Label::Fluid,
            Tissue::Fluid(_) => Label::Uterus,
            Tissue::Inside(_, Part::Hand) => Label::Hand,
            Tissue::Inside(_, Part::Cord) => Label::Cord,
            Tissue::Inside(_, Part::Trunk) => Label::Skin,
            Tissue::Inside(_, Part::Head) => {
                let p = pose.rotation * self.local(place);
                if is_bone(p, pose.mouth) {
                    return Label::Skull;
                }
                match intracranial(p) {
                    None => Label::Skin,
                    Some(Intracranial::Brain | Intracranial::Thalamus | Intracranial::Sulcus) => Label::Brain,
                    Some(Intracranial::ChoroidPlexus) => Label::ChoroidPlexus,
                    Some(Intracranial::Fluid) => Label::Ventricle,
                    Some(Intracranial::Falx) => Label::Falx,
                }
            }
        }
    }

    /// Distance into the uterine wall, mm, negative in the cavity. The inner face is slightly uneven.
    fn wall(&self, place: Vec3) -> f32 {
        // The near wall is pressed in by the probe, the far one is concave.
        let near = self.near_wall - (place - vec3(0.0, self.face - 72.0, 0.0)).length();
        let far = (place - vec3(0.0, self.face + 22.0, 0.0)).length() - 90.0;
        let cavity = near.max(far);
        cavity
            + 0.9 * (place.x * 0.11 + 0.6).sin() * (place.z * 0.13).cos()
            + 0.4 * (place.x * 0.31 - place.z * 0.23).sin()
    }

    /// Echo and loss (dB/mm) inside the fetus.
    fn flesh(&self, place: Vec3, direction: Vec3, pose: &Pose, deep: f32, part: Part, facing: f32) -> (Echo, f32) {
        let skin = || Echo {
            diffuse: SKIN + SKIN_FACING * facing,
            // A specular echo returns only if the surface faces the beam.
            mirror: if deep < 0.5 { SKIN_MIRROR + 20.0 * facing.max(0.1).log10() * 3.0 } else { Echo::SILENT.mirror },
        };
        let soft = Echo { diffuse: SOFT + texture(place, 0.5), ..Echo::SILENT };
        let p = self.local(place);
        if part == Part::Hand && deep > SKIN_LEAST && pose.hand.bone(p) < 0.0 {
            let surface = |place: Vec3| pose.hand.bone(self.local(place));
            return (bone_echo(place, direction, facing, surface), LOSS_BONE);
        }
        if part != Part::Head {
            return (if deep < SKIN_THICKNESS { skin() } else { soft }, LOSS_SOFT);
        }
        let p = pose.rotation * p;
        if is_bone(p, pose.mouth) {
            let surface = |place: Vec3| skull::bone(pose.rotation * self.local(place), pose.mouth);
            (bone_echo(place, direction, facing, surface), LOSS_BONE)
        } else if deep < SKIN_THICKNESS {
            (skin(), LOSS_SOFT)
        } else if let Some(part) = intracranial(p) {
            let level = match part {
                Intracranial::Brain => BRAIN + texture(place, 0.25),
                Intracranial::Thalamus => THALAMUS,
                Intracranial::Sulcus => SULCUS,
                Intracranial::Falx => FALX,
                Intracranial::ChoroidPlexus => CHOROID_PLEXUS + texture(place, 0.5),
                Intracranial::Fluid => FLUID,
            };
            (Echo { diffuse: level, ..Echo::SILENT }, LOSS_SOFT)
        } else {
            (soft, LOSS_SOFT)
        }
    }
}

impl Tissue {
    /// Distance from the nearest skin, mm, negative inside.
    fn distance(&self) -> f32 {
        match *self {
            Tissue::Inside(deep, _) => -deep,
            Tissue::Fluid(away) => away,
        }
    }
}

/// Echo of a place in a bone. `surface`: distance from the bone, mm; `facing`: cosine of the angle between the beam and the skin's normal.
fn bone_echo(place: Vec3, direction: Vec3, facing: f32, surface: impl Fn(Vec3) -> f32) -> Echo {
    let mirror = match -surface(place) < BONE_FACE {
        // A rough face: its amplitude falls with the cosine, not as fast as a smooth mirror's.
        true => BONE_MIRROR + 20.0 * (-normal(place, surface).dot(direction)).max(0.05).log10(),
        false => Echo::SILENT.mirror,
    };
    Echo { diffuse: BONE + 3.0 * facing, mirror }
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
