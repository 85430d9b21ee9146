//! A problem whose solution is known, for the orders of the compositing rules. Its fields are formulas, so that no error of a texture
//! disturbs it. The composited sum is the one of the volume renderer's reference; the exact solution integrates the equation that the sum
//! approximates.

use echolume::low_level::passes::raycast::composite::{March, Medium, Place, Rule};
use echolume::low_level::scene::transfer;
use glam::DVec3;

/// Radius of the ball of the test field that rays pass through, voxels. All lengths of this module are in voxels; absorption is per voxel.
pub const RADIUS: f64 = 12.0;

/// A test field inside the ball, whose values are sample values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Waves of 10 to 20 voxels on a slope, with values of 0.25..0.85; it is not zero where rays enter and leave.
    Open,
    /// [`Field::Open`] multiplied by a factor that vanishes at the surface of the ball, so that a missing last step has no effect.
    Vanishing,
}

impl Field {
    /// The value of the field at a position, voxels from the centre of the ball.
    pub fn at(self, p: DVec3) -> f64 {
        let waves = (0.43 * p.x + 0.21 * p.y).sin() + (0.34 * p.y - 0.27 * p.z + 1.0).sin() + (0.39 * p.z + 0.5).cos();
        let value = 0.55 + 0.09 * waves + 0.03 * (p.x / RADIUS);
        match self {
            Field::Open => value,
            Field::Vanishing => value * (1.0 - p.length_squared() / (RADIUS * RADIUS)).max(0.0),
        }
    }
}

/// Absorption and colour are polynomials of the value, so that Gauss-Legendre quadrature of a mean between two values is exact.
fn absorption(v: f64) -> f64 {
    0.5 * v * v * (3.0 - 2.0 * v)
}

fn colour(v: f64) -> [f64; 3] {
    [0.1 + 0.9 * v * v, 0.2 + 0.6 * v, 0.9 - 0.8 * v + 0.3 * v * v]
}

/// Gauss-Legendre nodes in 0..1 and weights, exact for polynomials up to degree 7; absorption times colour has degree 5.
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Deliberate errors in compositing, to see that the measured order shows them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flaw {
    /// True: the last, partial step is left out.
    pub drops_last_step: bool,
    /// Number of bits of the weights of a trilinear filter: positions are rounded to 2^-bits voxels along each axis. None: exact positions.
    pub weight_bits: Option<i32>,
    /// Factor of the absorption; 1 is correct.
    pub absorption: f64,
}

/// No flaw: correct compositing.
pub const NONE: Flaw = Flaw { drops_last_step: false, weight_bits: None, absorption: 1.0 };

/// A ray through the ball, from its entry point.
#[derive(Clone, Copy, Debug)]
struct Ray {
    enter: DVec3,
    along: DVec3,
    path: f64,
}

/// Rays of all directions and many lengths, at least 4 voxels, by the additive recurrence with the four-dimensional generalization of
/// the plastic number (Roberts 2018): evenly distributed, and the same in every run.
fn rays(count: usize) -> Vec<Ray> {
    // The root of x^5 = x + 1.
    let g: f64 = 1.167_303_978_261_418_7;
    let mut found = Vec::with_capacity(count);
    let mut i = 0.0;
    while found.len() < count {
        i += 1.0;
        let [a, b, c, d] = [1, 2, 3, 4].map(|k| (0.5 + i / g.powi(k)).fract());
        let on_sphere = |u: f64, v: f64| {
            let (z, angle) = (1.0 - 2.0 * u, std::f64::consts::TAU * v);
            let r = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(r * angle.cos(), r * angle.sin(), z)
        };
        let (from, to) = (on_sphere(a, b) * RADIUS, on_sphere(c, d) * RADIUS);
        let path = from.distance(to);
        if path >= 4.0 {
            found.push(Ray { enter: from, along: (to - from) / path, path });
        }
    }
    found
}

/// The field along a ray.
struct FieldAlongRay {
    field: Field,
    ray: Ray,
    flaw: Flaw,
    /// Factor on the absorption of the problem itself.
    density: f64,
}

impl FieldAlongRay {
    fn absorption(&self, value: f64) -> f64 {
        absorption(value) * self.density * self.flaw.absorption
    }

    fn value(&self, offset: f64) -> f64 {
        let place = self.ray.enter + self.ray.along * offset;
        self.field.at(match self.flaw.weight_bits {
            // A rounded weight gives the sample at a rounded position.
            Some(bits) => (place * f64::powi(2.0, bits)).round() * f64::powi(2.0, -bits),
            None => place,
        })
    }
}

impl Medium for FieldAlongRay {
    fn at(&self, place: Place) -> Option<[f64; 4]> {
        let v = self.value(place.offset);
        let [r, g, b] = colour(v);
        Some([r, g, b, self.absorption(v)])
    }

    fn between(&self, from: Place, to: Place) -> Option<[f64; 4]> {
        let (front, back) = (self.value(from.offset), self.value(to.offset));
        let mut sums = [0.0; 4];
        for [share, weight] in GAUSS {
            let v = front + (back - front) * share;
            let (absorbed, rgb) = (weight * absorption(v), colour(v));
            (0..3).for_each(|c| sums[c] += absorbed * rgb[c]);
            sums[3] += absorbed;
        }
        // Without absorption there is no light.
        let mean = |c: usize| if sums[3] > 0.0 { sums[c] / sums[3] } else { 0.0 };
        Some([mean(0), mean(1), mean(2), sums[3] * self.density * self.flaw.absorption])
    }

    fn self_attenuated(&self, from: Place, to: Place, length: f64) -> Option<[f64; 4]> {
        let (front, back) = (self.value(from.offset), self.value(to.offset));
        let kappa = |share: f64| self.absorption(front + (back - front) * share);
        // Optical depth from one share of the step to another. Absorption is of degree 3, for which the nodes are exact.
        let depth = |low: f64, high: f64| {
            GAUSS.iter().map(|[node, w]| w * kappa(low + (high - low) * node)).sum::<f64>() * (high - low) * length
        };
        let (mut sums, mut behind) = ([0.0; 4], 0.0);
        let parts = (PARTS_A_DEPTH * depth(0.0, 1.0)).ceil().max(PARTS);
        for part in 0..parts as u64 {
            // What lies deeper than that emits nothing that f64 sees.
            if behind > 40.0 {
                break;
            }
            let [low, high] = [part, part + 1].map(|n| n as f64 / parts);
            for [node, weight] in GAUSS {
                let share = low + (high - low) * node;
                let light = weight * (high - low) * length * kappa(share) * (-behind - depth(low, share)).exp();
                let rgb = colour(front + (back - front) * share);
                (0..3).for_each(|c| sums[c] += light * rgb[c]);
            }
            behind += depth(low, high);
        }
        sums[3] = transfer::opacity(depth(0.0, 1.0));
        Some(sums)
    }
}

/// Least parts of a step for the quadrature of its light, and parts of an optical depth of 1.
const PARTS: f64 = 8.0;
const PARTS_A_DEPTH: f64 = 4.0;

/// Light of a ray (red, green, blue) by integrating dC/ds = exp(-K) kappa c, dK/ds = kappa with the classical Runge-Kutta method of
/// order 4, in steps of at most `step` voxels, up to an optical depth of 40.
fn integrated(field: Field, ray: Ray, density: f64, step: f64) -> [f64; 3] {
    let through = FieldAlongRay { field, ray, flaw: NONE, density };
    let rate = |offset: f64, depth: f64| {
        let v = through.value(offset);
        let (kappa, left) = (through.absorption(v), (-depth).exp());
        let rgb = colour(v);
        [left * kappa * rgb[0], left * kappa * rgb[1], left * kappa * rgb[2], kappa]
    };
    let steps = (ray.path / step).ceil();
    let h = ray.path / steps;
    let mut state = [0.0; 4];
    for i in 0..steps as u64 {
        // What is left is below f64's resolution.
        if state[3] > 40.0 {
            break;
        }
        let s = i as f64 * h;
        let a = rate(s, state[3]);
        let b = rate(s + h / 2.0, state[3] + h / 2.0 * a[3]);
        let c = rate(s + h / 2.0, state[3] + h / 2.0 * b[3]);
        let d = rate(s + h, state[3] + h * c[3]);
        (0..4).for_each(|k| state[k] += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]));
    }
    [state[0], state[1], state[2]]
}

fn rms(differences: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = differences.fold((0.0, 0.0), |(sum, n), d| (sum + d * d, n + 1.0));
    f64::sqrt(sum / n)
}

/// `count` step lengths from `low` to `high` voxels, logarithmically spaced.
pub fn steps(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| low * (high / low).powf(i as f64 / (count - 1) as f64)).collect()
}

/// The RMSE of the light of `count` rays for each step length. Returns pairs of step and error, and the error of the exact solution (its difference
/// from the solution at twice the step).
pub fn errors(rule: Rule, field: Field, flaw: Flaw, steps: &[f64], count: usize) -> (Vec<[f64; 2]>, f64) {
    const FINE: f64 = 1.0 / 32.0;
    let rays = rays(count);
    let truth: Vec<[f64; 3]> = rays.iter().map(|ray| integrated(field, *ray, 1.0, FINE / 2.0)).collect();
    let difference = |a: &[f64; 3], b: &[f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let coarser =
        rays.iter().zip(&truth).flat_map(|(ray, truth)| difference(&integrated(field, *ray, 1.0, FINE), truth));
    let own = rms(coarser);
    let pairs = steps.iter().map(|h| {
        let light = rays.iter().zip(&truth).flat_map(|(ray, truth)| {
            let path = if flaw.drops_last_step { (ray.path / h).floor() * h } else { ray.path };
            let march = March { rule, path, reference_length: 1.0, early_end: 0.0, hit: f64::INFINITY };
            let ([r, g, b, _], _) = march.through(&FieldAlongRay { field, ray: *ray, flaw, density: 1.0 }, |n| n * h);
            difference(&[r, g, b], truth)
        });
        [*h, rms(light)]
    });
    (pairs.collect(), own)
}

/// The error of a rule for one optical depth of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffPoint {
    /// Optical depth kappa h of a step of length h at the field's mean value.
    pub depth: f64,
    /// RMSE of the light with steps of length h.
    pub error: f64,
    /// Local order: log2 of `error` over the error with steps of h/2 through the same matter.
    pub order: f64,
}

/// Value of the field about which its waves are.
const MEAN_VALUE: f64 = 0.55;

/// The local order of a rule for steps of different optical depths: `count` rays through [`Field::Open`] in steps of `step` voxels and of half of
/// that. The absorption is scaled so that a step has each of `depths`. The order of 2 for thin steps falls to that of a rule that samples the wrong
/// position of an opaque step.
pub fn stiffness(rule: Rule, step: f64, depths: &[f64], count: usize) -> Vec<StiffPoint> {
    let rays = rays(count);
    let point = |depth: &f64| {
        let density = depth / (step * absorption(MEAN_VALUE));
        // Runge-Kutta steps of an optical depth of 1/16 at most: absorption is up to 2.5 times that of the mean value.
        let fine = (step / (40.0 * depth)).min(1.0 / 32.0);
        let truth: Vec<[f64; 3]> = rays.iter().map(|ray| integrated(Field::Open, *ray, density, fine)).collect();
        let error = |h: f64| {
            rms(rays.iter().zip(&truth).flat_map(|(ray, truth)| {
                let march = March { rule, path: ray.path, reference_length: 1.0, early_end: 0.0, hit: f64::INFINITY };
                let medium = FieldAlongRay { field: Field::Open, ray: *ray, flaw: NONE, density };
                let ([r, g, b, _], _) = march.through(&medium, |n| n * h);
                [r - truth[0], g - truth[1], b - truth[2]]
            }))
        };
        let (whole, half) = (error(step), error(step / 2.0));
        StiffPoint { depth: *depth, error: whole, order: (whole / half).log2() }
    };
    depths.iter().map(point).collect()
}
