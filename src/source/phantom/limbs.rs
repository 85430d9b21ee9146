//! Hand, umbilical cord and shoulders as signed distances, in the axes of the head; they do not rotate with it.

use super::shape::{ball, ellipsoid, join, one_side, rod};
use glam::{Vec3, vec3};
use std::f32::consts::TAU;
use std::sync::LazyLock;

/// A hand beside the cheek, its back towards the probe, fingers up.
pub(super) struct Hand {
    fingers: [Finger; 4],
}

/// From the first knuckle to the tip.
struct Finger {
    joints: [Vec3; 4],
}

/// Where the hand is: beside the cheek, not touching it.
const HAND: Vec3 = vec3(3.5, -1.0, 1.5);

impl Hand {
    /// `curl`: flexion of the fingers, from 0 (stretched) to 1.
    pub fn new(curl: f32) -> Hand {
        // First knuckle, length of the first bone, sideways slope, and how much more than the index it flexes.
        const FINGERS: [(f32, f32, f32, f32, f32); 4] = [
            (30.8, -30.8, 9.0, -0.27, 0.9),
            (35.8, -29.2, 10.2, -0.13, 1.0),
            (41.0, -29.8, 9.6, 0.02, 1.1),
            (45.8, -32.2, 7.6, 0.22, 1.25),
        ];
        let finger = |i: usize| {
            let (x, y, length, slope, flexes) = FINGERS[i];
            let mut at = vec3(x, y, -5.4 - 0.5 * (i as f32 - 1.0).abs());
            let mut joints = [at; 4];
            let mut angle = 0.0;
            // Rest and flexion at each joint, rad; the bones shorten towards the tip.
            let bones = [(0.10, 0.55, 1.0, 1.0), (0.25, 0.80, 0.68, 0.8), (0.15, 0.55, 0.5, 0.6)];
            for (joint, (rest, flexion, share, sideways)) in joints[1..].iter_mut().zip(bones) {
                angle += rest + flexion * curl * flexes;
                let (sin, cos) = f32::sin_cos(angle);
                at += vec3(slope * sideways, cos, -sin) * (length * share);
                *joint = at;
            }
            Finger { joints }
        };
        Hand { fingers: std::array::from_fn(finger) }
    }

    /// Distance of a position in the axes of the head, mm, from the skin of the hand, negative inside. Away from the hand it is a lower bound.
    pub fn distance(&self, p: Vec3) -> f32 {
        let p = p - HAND;
        let bound = ball(p, vec3(40.0, -40.0, -10.0), 40.0);
        if bound > 4.0 {
            return bound;
        }
        let mut d = ellipsoid(p, vec3(38.6, -38.5, -7.5), vec3(11.2, 10.5, 4.4));
        let wrist = vec3(46.0, -66.0, -15.0);
        d = join(d, rod(p, vec3(40.5, -47.0, -9.0), wrist, [6.6, 6.2]), 6.0);
        d = join(d, rod(p, wrist, vec3(50.0, -78.0, -18.0), [6.2, 7.0]), 3.0);
        // Fingers and thumb cost most.
        let bound = ball(p, vec3(35.0, -28.0, -7.0), 24.0);
        if bound > 0.0 {
            return d.min(bound + 1.0);
        }
        let mut fingers = f32::MAX;
        for finger in &self.fingers {
            d = join(d, ball(p, finger.joints[0] + vec3(0.0, -0.5, 0.9), 2.7), 2.2);
            fingers = join(fingers, finger.distance(p), 0.35);
        }
        d = join(d, fingers, 2.0);
        let (middle, tip) = (vec3(26.6, -36.5, -3.6), vec3(24.6, -30.2, -2.8));
        let mut thumb = rod(p, vec3(31.5, -43.5, -7.0), middle, [3.6, 2.9]);
        thumb = join(thumb, rod(p, middle, tip, [2.6, 2.3]), 0.6);
        thumb = join(thumb, ball(p, middle + vec3(0.0, 0.0, 0.6), 2.7), 1.0);
        join(d, thumb, 2.2)
    }

    /// Distance of a position in the axes of the head, mm, from the nearest bone of fingers, thumb, palm and forearm, negative inside. The joints are
    /// of cartilage, which is dark, and do not count. Far from the hand the result is a lower bound.
    pub fn bone(&self, p: Vec3) -> f32 {
        /// Shares of the way from joint to joint at which bone begins and ends.
        const SHAFT: [f32; 2] = [0.14, 0.86];
        let p = p - HAND;
        let bound = ball(p, vec3(40.0, -40.0, -10.0), 40.0);
        if bound > 4.0 {
            return bound;
        }
        let shaft =
            |from: Vec3, to: Vec3, radii: [f32; 2]| rod(p, from.lerp(to, SHAFT[0]), from.lerp(to, SHAFT[1]), radii);
        let mut d = f32::MAX;
        let carpus = vec3(40.5, -48.0, -9.5);
        for finger in &self.fingers {
            let knuckle = finger.joints[0] + vec3(0.0, 0.0, -0.6);
            let root = carpus + (knuckle - carpus) * vec3(0.35, 0.18, 0.2);
            d = d.min(shaft(root, knuckle, [1.4, 1.3]));
            for (i, pair) in finger.joints.windows(2).enumerate() {
                let radius = [1.25, 1.1, 1.0][i];
                d = d.min(shaft(pair[0], pair[1], [radius, radius]));
            }
        }
        let (root, middle, tip) = (vec3(33.5, -45.5, -8.0), vec3(26.6, -36.5, -3.9), vec3(24.6, -30.2, -3.0));
        d = d.min(shaft(root, middle, [1.4, 1.3])).min(shaft(middle, tip, [1.2, 1.0]));
        for side in [-2.6, 2.6] {
            let across = vec3(side, 0.0, 0.0);
            d = d.min(rod(p, vec3(44.0, -56.0, -12.2) + across, vec3(50.0, -78.0, -18.0) + across, [1.7, 1.9]));
        }
        d
    }
}

impl Finger {
    fn distance(&self, p: Vec3) -> f32 {
        let [root, knuckle, middle, tip] = self.joints;
        let mut d = rod(p, root, knuckle, [2.8, 2.55]);
        d = join(d, rod(p, knuckle, middle, [2.5, 2.3]), 0.5);
        d = join(d, rod(p, middle, tip, [2.3, 2.1]), 0.5);
        // The joints are a little thicker at the back.
        d = join(d, ball(p, knuckle + vec3(0.0, 0.0, 0.5), 2.6), 0.8);
        join(d, ball(p, middle + vec3(0.0, 0.0, 0.35), 2.3), 0.8)
    }
}

/// One piece of the cord's centreline: a + b t + c t^2, t in 0..=1, and the length of the cord up to it.
struct Piece {
    a: Vec3,
    b: Vec3,
    c: Vec3,
    run: f32,
    length: f32,
}

impl Piece {
    fn at(&self, t: f32) -> Vec3 {
        self.a + (self.b + self.c * t) * t
    }
}

/// The centreline is a uniform quadratic B-spline: its tangent has no steps, which would break the twist.
static CENTRELINE: LazyLock<Vec<Piece>> = LazyLock::new(|| {
    const CONTROL: [Vec3; 10] = [
        vec3(-96.0, 58.0, -44.0),
        vec3(-80.0, 40.0, -34.0),
        vec3(-68.0, 24.0, -26.0),
        vec3(-56.0, 8.0, -17.0),
        vec3(-49.0, -8.0, -11.0),
        vec3(-46.0, -24.0, -9.0),
        vec3(-42.0, -39.0, -11.0),
        vec3(-30.0, -52.0, -15.0),
        vec3(-14.0, -61.0, -18.0),
        vec3(4.0, -67.0, -22.0),
    ];
    let mut run = 0.0;
    let piece = |k: &[Vec3]| {
        let (a, b, c) = ((k[0] + k[1]) / 2.0, k[1] - k[0], (k[0] + k[2]) / 2.0 - k[1]);
        let mut piece = Piece { a, b, c, run, length: 0.0 };
        piece.length = (0..32).map(|i| piece.at(i as f32 / 32.0).distance(piece.at((i + 1) as f32 / 32.0))).sum();
        run += piece.length;
        piece
    };
    CONTROL.windows(3).map(piece).collect()
});

/// Radius of a strand of the cord, and of the helix on which its centre runs, mm.
const STRAND: f32 = 2.9;
/// One revolution of the twist, mm.
const TWIST: f32 = 26.0;
/// Radius of the cord with its strands, mm.
const CORD: f32 = 2.0 * STRAND;

/// Distance of a position from the umbilical cord, mm, negative inside: three strands, two arteries and a vein, twisted to a rope 11.6 mm thick.
pub(super) fn cord(p: Vec3) -> f32 {
    // A box around the centreline.
    let (low, high) = (vec3(-88.0, -64.0, -39.0), vec3(-5.0, 49.0, -9.0));
    let bound = (low - p).max(p - high).max(Vec3::ZERO).length() - CORD;
    if bound > 4.0 {
        return bound;
    }
    // The nearest point on two chords of each piece, then Newton's method on that piece.
    let (mut nearest, mut piece, mut t) = (f32::MAX, &CENTRELINE[0], 0.0);
    for candidate in CENTRELINE.iter() {
        let mut from = candidate.a;
        for half in 0..2 {
            let to = candidate.at(0.5 * (half + 1) as f32);
            let along = to - from;
            let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let away = (p - from - along * share).length_squared();
            if away < nearest {
                (nearest, piece, t) = (away, candidate, 0.5 * (half as f32 + share));
            }
            from = to;
        }
    }
    // The chords leave the curve by less than 1 mm.
    let rough = nearest.sqrt() - CORD - 1.0;
    if rough > 3.0 {
        return rough;
    }
    let tangent = |t: f32| piece.b + 2.0 * t * piece.c;
    for _ in 0..2 {
        let (off, tangent) = (p - piece.at(t), tangent(t));
        let slope = tangent.length_squared() - 2.0 * off.dot(piece.c);
        t = (t + off.dot(tangent) / slope.max(1e-3)).clamp(-0.1, 1.1);
    }
    let (off, along) = (p - piece.at(t), tangent(t).normalize());
    // Two axes across the cord. It never runs along z.
    let aside = vec3(along.y, -along.x, 0.0).normalize();
    let third = TAU / 3.0;
    let twist = TAU / TWIST * (piece.run + t * piece.length);
    let angle = off.dot(along.cross(aside)).atan2(off.dot(aside)) + twist;
    let angle = (angle - third * (angle / third).round()).abs();
    let radius = off.length();
    let strand = |angle: f32| {
        let square = radius * radius + STRAND * STRAND - 2.0 * radius * STRAND * angle.cos();
        square.max(0.0).sqrt() - STRAND
    };
    join(strand(angle), strand(third - angle), 1.0)
}

/// Distance of a position from shoulders and chest below the chin, mm, negative inside.
pub(super) fn shoulders(p: Vec3) -> f32 {
    let shoulder = rod(one_side(p), vec3(8.0, -64.0, -48.0), vec3(38.0, -70.0, -48.0), [15.0, 13.0]);
    join(shoulder, ellipsoid(p, vec3(0.0, -84.0, -46.0), vec3(36.0, 26.0, 24.0)), 10.0)
}
