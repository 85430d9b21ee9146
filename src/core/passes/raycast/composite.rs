//! The emission-absorption sum along one ray in f64, front to back (thesis 4-1, 4-2), through any medium. The reference of the volume
//! renderer passes a texture; tests of the order of the error pass analytic fields.

use crate::scene::{Compositing, transfer};

/// How a step of length h becomes opacity a and light, with y = kappa h / h0, where kappa is the absorption over the reference length h0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// a = y, at most 1, kappa from the step's middle.
    Riemann,
    /// a = 1 - exp(-y), kappa from the step's middle.
    Corrected,
    /// a = 1 - exp(-y), kappa from the beginning of the step. No setting offers it; tests compare it with `Corrected`.
    CorrectedLeft,
    /// a = 1 - exp(-y), with the mean kappa between the sample values at the step's two ends, and the mean colour weighted by kappa.
    PreIntegrated,
    /// Light and opacity are the exact integral over the step of the transfer function, while the sample value changes linearly between the step's
    /// two ends: each place is dimmed by the matter in front of it in the same step.
    Exponential,
    /// The opacity of `PreIntegrated`, but the step's light is y times its colour, as if no part of a step lay in the shade of another (a shortcut of
    /// Engel, Kraus, Ertl 2001). No setting offers it: its error is one order larger.
    PreIntegratedUnshaded,
}

impl From<Compositing> for Rule {
    fn from(compositing: Compositing) -> Rule {
        match compositing {
            Compositing::Riemann => Rule::Riemann,
            Compositing::Corrected => Rule::Corrected,
            Compositing::PreIntegrated => Rule::PreIntegrated,
            Compositing::Exponential => Rule::Exponential,
        }
    }
}

/// A position on a ray: `offset` mm behind the ray's entry, which is reached after `n` steps (`n` may be fractional).
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub offset: f64,
    pub n: f64,
}

/// The matter on a ray. A colour is red, green and blue with the absorption over one reference length; None where the ray is outside the medium.
pub trait Medium {
    /// The part of a step that is inside the medium; both are given by their two ends, as offsets in mm. None if neither end of the step is inside.
    /// If one end is outside, the part ends at the border of the medium, and takes the value of the end inside.
    fn part_inside(&self, step: [f64; 2]) -> Option<[f64; 2]> {
        Some(step)
    }
    fn at(&self, place: Place) -> Option<[f64; 4]>;
    /// Mean colour weighted by absorption, and mean absorption, over a step along which the sample value changes linearly from `from` to `to`.
    fn between(&self, from: Place, to: Place) -> Option<[f64; 4]>;
    /// Premultiplied red, green, blue, and opacity, of a step of `length` reference lengths along which the sample value changes linearly from `from`
    /// to `to`: the integral of its light, each place dimmed by the step's own matter in front of it.
    fn self_attenuated(&self, from: Place, to: Place, length: f64) -> Option<[f64; 4]>;
}

/// Numerical integration of emission and absorption along one ray, front to back.
#[derive(Clone, Copy, Debug)]
pub struct March {
    pub rule: Rule,
    /// Length of the ray behind its entry, mm. The last step is shortened to end there.
    pub path: f64,
    /// The length that absorption refers to, mm.
    pub reference_length: f64,
    /// The ray ends when its transmittance (0..1) has fallen to this or below. With 0 it never ends early.
    pub early_end: f64,
    /// Opacity (0..1) from which on the ray counts as having hit something.
    pub hit: f64,
}

impl March {
    /// Composites a ray. Returns its premultiplied red, green, blue, and opacity, and the offset behind the entry, mm, at which the opacity reaches
    /// `hit`; None if it does not. `offset` maps a number of steps to mm behind the entry, and rises with that number.
    pub fn through(&self, medium: &impl Medium, offset: impl Fn(f64) -> f64) -> ([f64; 4], Option<f64>) {
        let mut light = [0.0; 3];
        let mut opacity = 0.0;
        let mut hit = None;
        let (mut n, mut from) = (0.0, 0.0);
        while from < self.path {
            let to = offset(n + 1.0).min(self.path);
            if let Some(Step { part: [from, to], emitted, opacity: a }) = self.step(medium, [from, to], n) {
                for (light, emitted) in light.iter_mut().zip(emitted) {
                    *light += (1.0 - opacity) * emitted;
                }
                let before = opacity;
                opacity += (1.0 - opacity) * a;
                if hit.is_none() && opacity >= self.hit {
                    hit = Some(from + (to - from) * (self.hit - before) / (opacity - before));
                }
                if self.early_end > 0.0 && opacity >= 1.0 - self.early_end {
                    break;
                }
            }
            (n, from) = (n + 1.0, to);
        }
        ([light[0], light[1], light[2], opacity], hit)
    }

    /// What a step adds to the ray.
    fn step(&self, medium: &impl Medium, step: [f64; 2], n: f64) -> Option<Step> {
        let ends = [Place { offset: step[0], n }, Place { offset: step[1], n: n + 1.0 }];
        let middle = Place { offset: (step[0] + step[1]) / 2.0, n: n + 0.5 };
        // Rules of one sample take its whole step; those of two, what is inside of it.
        let (part, [front, back]) = match self.rule {
            Rule::Riemann | Rule::Corrected | Rule::CorrectedLeft => (step, ends),
            Rule::PreIntegrated | Rule::PreIntegratedUnshaded | Rule::Exponential => {
                let part = medium.part_inside(step)?;
                let front = if part[0] > step[0] { ends[1] } else { ends[0] };
                let back = if part[1] < step[1] { ends[0] } else { ends[1] };
                (part, [front, back])
            }
        };
        let length = (part[1] - part[0]) / self.reference_length;
        let [r, g, b, kappa] = match self.rule {
            Rule::Riemann | Rule::Corrected => medium.at(middle)?,
            Rule::CorrectedLeft => medium.at(front)?,
            Rule::PreIntegrated | Rule::PreIntegratedUnshaded => medium.between(front, back)?,
            Rule::Exponential => {
                let [r, g, b, opacity] = medium.self_attenuated(front, back, length)?;
                return Some(Step { part, emitted: [r, g, b], opacity });
            }
        };
        let y = kappa * length;
        let opacity = if self.rule == Rule::Riemann { y.min(1.0) } else { transfer::opacity(y) };
        let emitted = if self.rule == Rule::PreIntegratedUnshaded { y } else { opacity };
        Some(Step { part, emitted: [r, g, b].map(|colour| emitted * colour), opacity })
    }
}

/// What one step adds to a ray.
struct Step {
    /// Where in the step it is: offsets.
    part: [f64; 2],
    /// Red, green and blue that leave the step towards the eye.
    emitted: [f64; 3],
    opacity: f64,
}
