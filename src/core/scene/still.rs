//! Stills: the medium that a transfer function stands for, the lights, and what cannot be drawn as a still.

use super::{Mode, Scene, SceneError, Settings, Shading, Still, refuse};
use glam::DVec3;
use std::f64::consts::PI;

/// Largest extinction in the length that opacities refer to, a slice pixel: a mean free path far below any texel.
const MAX_EXTINCTION: f64 = 40.0;

/// A distant light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistantLight {
    /// Unit direction to the light, in space (lateral, depth, elevation).
    pub towards: DVec3,
    /// Irradiance (red, green, blue) on a surface that faces the light.
    pub irradiance: [f64; 3],
}

/// The lights of a still: key light, back light and surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillLights {
    pub key: DistantLight,
    pub back: DistantLight,
    /// Radiance (red, green, blue) that comes from all directions.
    pub environment: [f64; 3],
}

impl StillLights {
    /// The probability with which a path samples the back light at a collision: its part of the irradiance of both lights.
    pub(crate) fn back_share(&self) -> f64 {
        let [key, back] = [self.key, self.back].map(|light| light.irradiance.into_iter().fold(0.0, f64::max));
        if back > 0.0 { back / (key + back) } else { 0.0 }
    }
}

/// Checks whether the other settings go with a still; without one there is nothing to check.
///
/// # Errors
/// A setting that a still cannot show.
pub(super) fn check(settings: &Settings) -> Result<(), SceneError> {
    let faults = [
        (settings.mode != Mode::Volume, "set mode=volume, or leave it out"),
        (settings.volume.shading != Shading::None, "leave volume.shading out"),
        (settings.ray.sliding != 0, "leave ray.sliding out, which filters along rays"),
        (settings.light.position.is_some(), "its lights are distant, leave light.position out"),
    ];
    match faults.into_iter().find(|(is_refused, _)| *is_refused && settings.still.is_some()) {
        Some((_, what)) => {
            refuse("still", format!("is for mode volume in the colours of its transfer function: {what}"))
        }
        None => Ok(()),
    }
}

/// The albedo of scattering of a medium of which a half-space has this colour under even light (Kulla and Conty 2017, "Revisiting physically based
/// shading at Imageworks"), with the similarity relation for the mean cosine g.
fn albedo_of(colour: f64, g: f64) -> f64 {
    let c = colour.clamp(0.0, 1.0);
    let s = 4.09712 + 4.20863 * c - (9.59217 + 41.6808 * c + 17.7126 * c * c).sqrt();
    let square = s.clamp(0.0, 1.0).powi(2);
    ((1.0 - square) / (1.0 - g * square)).clamp(0.0, 1.0)
}

impl Scene {
    /// The settings of the still, if the scene is one.
    pub fn still(&self) -> Option<&Still> {
        self.settings.still.as_ref()
    }

    /// The medium of the still at the entries of a transfer function: albedo of red, green and blue, and extinction, 1/mm.
    pub(crate) fn still_medium(&self, transfer: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let still = self.still().copied().unwrap_or_default();
        let of = |[r, g, b, absorption]: &[f64; 4]| {
            let albedo = [r, g, b].map(|c| still.albedo * albedo_of(*c, still.anisotropy));
            let extinction = (still.extinction * absorption).min(MAX_EXTINCTION) / self.reference_length();
            [albedo[0], albedo[1], albedo[2], extinction]
        };
        transfer.iter().map(of).collect()
    }

    /// The lights of a still. A light of strength 1 gives a white diffuse surface that faces it the radiance 1.
    pub fn still_lights(&self) -> StillLights {
        let light = &self.settings.light;
        let of = |direction, strength: f64, colour: [f64; 3]| DistantLight {
            towards: self.light_direction(direction),
            irradiance: colour.map(|c| PI * strength * c),
        };
        let volume = light.volume.unwrap_or_default();
        // Without a light volume there is no back light.
        let back = if light.volume.is_some() { volume.back } else { 0.0 };
        StillLights {
            key: of(light.direction, light.diffuse, light.colour),
            back: of(volume.back_direction, back, volume.back_colour),
            environment: light.colour.map(|c| light.ambient * c),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What scatters all light is white, what absorbs all is black, and brighter media scatter more.
    #[test]
    fn the_albedo_of_a_colour_rises_from_0_to_1() {
        for g in [-0.9, 0.0, 0.5, 0.9] {
            assert!(albedo_of(0.0, g) < 1e-4 && albedo_of(1.0, g) > 1.0 - 1e-9, "{g}");
            let all: Vec<f64> = (0..=100).map(|n| albedo_of(f64::from(n) / 100.0, g)).collect();
            assert!(all.windows(2).all(|pair| pair[0] < pair[1] + 1e-12), "{g}");
        }
    }

    #[test]
    fn dispatches_hold_all_samples() {
        for (samples, batch) in [(1, 4), (64, 4), (65, 4), (65536, 1), (65535, 64)] {
            let still = Still { samples, batch, ..Still::default() };
            assert!(still.dispatches() * still.samples_at_once() >= samples);
            assert!((still.dispatches() - 1) * still.samples_at_once() < samples);
            assert!(still.dispatches() <= 64);
        }
    }
}
