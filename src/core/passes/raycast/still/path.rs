//! One path of light in f64: the estimator of docs/numerics.md, with the random numbers of the shader in the same order, so that single paths agree.

use super::Stream;
use crate::passes::pass::*;
use crate::passes::raycast::{cap, ray, volume};
use crate::scene::{Scene, StillLights, windowed};
use glam::DVec3;
use std::f64::consts::PI;

/// Below this transmittance Russian roulette decides whether a path to a light goes on.
const LEAST_TRANSMITTANCE: f64 = 0.1;
/// Collisions from which on Russian roulette decides whether a path goes on.
const SURE_EVENTS: u32 = 4;

/// The medium that paths of light go through: albedo and extinction at each position, and the majorants of the extinction by brick.
pub struct Medium<'a> {
    scene: &'a Scene,
    volume: &'a Texels,
    table: &'a Texels,
    /// The largest extinction of each brick, 1/mm. None if all take the largest of the medium.
    bricks: Option<&'a Texels>,
    majorant: f64,
    lights: StillLights,
}

/// Albedo and extinction, 1/mm.
type Matter = ([f64; 3], f64);

impl<'a> Medium<'a> {
    pub(super) fn new(scene: &'a Scene, reads: &'a Arrays) -> Medium<'a> {
        let bricks = scene.skips().then(|| reads.get("majorants"));
        Medium::of(scene, reads.get("volume"), reads.get("medium"), bricks)
    }

    /// `table`: albedo of red, green and blue, and extinction (1/mm), at equidistant windowed sample values. `bricks`: the majorant of each brick,
    /// 1/mm; None if the largest extinction of the table applies everywhere.
    pub fn of(scene: &'a Scene, volume: &'a Texels, table: &'a Texels, bricks: Option<&'a Texels>) -> Medium<'a> {
        let majorant = table.values.iter().skip(3).step_by(4).copied().fold(0.0, f64::max);
        Medium { scene, volume, table, bricks, majorant, lights: scene.still_lights() }
    }

    /// Albedo of red, green and blue, and extinction (1/mm), at a place in space, mm. All are 0 outside the insonified region.
    pub fn at(&self, place: DVec3) -> Matter {
        let Some(texel) = ray::texel(self.scene, place) else { return ([0.0; 3], 0.0) };
        let sample = ray::interpolated(self.scene, self.volume, texel);
        let value = windowed(self.scene.volume_view().window, sample);
        let [r, g, b, extinction] = volume::looked_up(self.table, self.table.values.len() / 4, value);
        ([r, g, b], extinction * self.scene.faded(place))
    }

    /// The stretches of a line from a place, with their ends, mm, and majorants. The last one ends where the line leaves the region.
    fn stretches(&self, from: DVec3, along: DVec3, length: f64) -> impl Iterator<Item = (f64, f64)> {
        let bricks = self.scene.bricks();
        let place = (from - bricks.low) / bricks.edge;
        let mut cell = place.floor().as_i64vec3().to_array();
        // A direction component of 0 never reaches a face.
        let each = (along / bricks.edge).to_array();
        let mut next: [f64; 3] = std::array::from_fn(|a| {
            let face = cell[a] as f64 + if each[a] > 0.0 { 1.0 } else { 0.0 };
            if each[a] == 0.0 { f64::INFINITY } else { (face - place[a]) / each[a] }
        });
        let mut is_over = false;
        std::iter::from_fn(move || {
            if is_over {
                return None;
            }
            let Some(majorants) = self.bricks else {
                is_over = true;
                return Some((length, self.majorant));
            };
            let inside = (0..3).all(|a| (0..i64::from(bricks.count[a])).contains(&cell[a]));
            let bound = match inside {
                true => majorants.one(cell[0] as usize, cell[1] as usize, cell[2] as usize),
                false => self.majorant,
            };
            let axis = (0..3).fold(0, |least, a| if next[a] < next[least] { a } else { least });
            let end = next[axis].min(length);
            is_over = end >= length;
            cell[axis] += if each[axis] > 0.0 { 1 } else { -1 };
            next[axis] += (1.0 / each[axis]).abs();
            Some((end, bound))
        })
    }

    /// Goes through the tentative collisions of a line from a place until one of them ends it: `ends` is given the place, the matter, its share
    /// of the majorant, and a random number. The free paths between them have the density of the majorant (Woodcock et al. 1965).
    fn collide<T>(
        &self,
        from: DVec3,
        along: DVec3,
        stream: &mut Stream,
        mut ends: impl FnMut(DVec3, Matter, f64, f64) -> Option<T>,
    ) -> Option<T> {
        let (enter, leave) = ray::span(self.scene, self.scene.volume_view(), from, along);
        if leave <= enter {
            return None;
        }
        let from = from + along * enter;
        let mut drawn = stream.draw();
        let mut depth = -(1.0 - drawn[0]).ln();
        let mut at = 0.0;
        for (end, bound) in self.stretches(from, along, leave - enter) {
            // Optical depth of the rest of the stretch.
            while depth < bound * (end - at) {
                at += depth / bound;
                let place = from + along * at;
                let matter = self.at(place);
                let found = ends(place, matter, (matter.1 / bound).min(1.0), drawn[1]);
                if found.is_some() {
                    return found;
                }
                drawn = stream.draw();
                depth = -(1.0 - drawn[0]).ln();
            }
            depth -= bound * (end - at).max(0.0);
            at = end.max(at);
        }
        None
    }

    /// An estimate of the transmittance from a place to the end of the region, by ratio tracking (Novak, Selle and Jarosz 2014).
    fn transmittance(&self, from: DVec3, towards: DVec3, stream: &mut Stream) -> f64 {
        let mut transmitted = 1.0;
        let is_ended = self.collide(from, towards, stream, |_, _, real, u| {
            transmitted *= 1.0 - real;
            if transmitted < LEAST_TRANSMITTANCE {
                if u * LEAST_TRANSMITTANCE >= transmitted {
                    return Some(());
                }
                transmitted = LEAST_TRANSMITTANCE;
            }
            None
        });
        if is_ended.is_some() { 0.0 } else { transmitted }
    }

    /// Traces one path of the pixel (x, y). Returns its linear light, and in the last component 1 if the path collided with matter, else 0.
    pub fn path(&self, [x, y]: [usize; 2], mut stream: Stream) -> [f64; 4] {
        let settings = self.scene.still().copied().unwrap_or_default();
        let lights = &self.lights;
        let [right, down, ..] = stream.draw();
        let (mut place, mut along) = self.scene.rays.at(x as f64 + right, y as f64 + down);
        let (mut light, mut throughput, mut collided) = ([0.0; 3], [1.0; 3], 0.0);
        for event in 0..settings.events {
            let found = self.collide(place, along, &mut stream, |p, matter, real, u| (u < real).then_some((p, matter)));
            let Some((p, (albedo, _))) = found else {
                if event > 0 {
                    (0..3).for_each(|c| light[c] += throughput[c] * lights.environment[c]);
                }
                break;
            };
            collided = 1.0;
            (0..3).for_each(|c| throughput[c] *= albedo[c]);
            if throughput.into_iter().fold(0.0, f64::max) <= 0.0 {
                break;
            }
            let [choice, roulette, u, v] = stream.draw();
            let share = lights.back_share();
            let (lamp, probability) = if choice < share { (&lights.back, share) } else { (&lights.key, 1.0 - share) };
            if lamp.irradiance.into_iter().fold(0.0, f64::max) > 0.0 {
                let weight = phase(settings.anisotropy, along.dot(lamp.towards)) / probability
                    * self.transmittance(p, lamp.towards, &mut stream);
                (0..3).for_each(|c| light[c] += throughput[c] * weight * lamp.irradiance[c]);
            }
            if event >= SURE_EVENTS {
                let stays = throughput.into_iter().fold(0.0, f64::max).min(1.0);
                if roulette >= stays {
                    break;
                }
                throughput = throughput.map(|t| t / stays);
            }
            place = p;
            along = scattered(settings.anisotropy, along, [u, v]);
        }
        [light[0], light[1], light[2], collided]
    }
}

/// Henyey and Greenstein's phase function (1941): the density over solid angle of a change of direction with this cosine. Its mean cosine is g.
fn phase(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// A direction with that density, from two uniform numbers.
fn scattered(g: f64, along: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let cosine = match g.abs() > 1e-3 {
        true => (1.0 + g * g - ((1.0 - g * g) / (1.0 - g + 2.0 * g * u)).powi(2)) / (2.0 * g),
        false => 1.0 - 2.0 * u,
    };
    let cosine = cosine.clamp(-1.0, 1.0);
    let (sine, turn) = ((1.0 - cosine * cosine).sqrt(), 2.0 * PI * v);
    let [right, up] = cap::axes(along);
    (sine * (turn.cos() * right + turn.sin() * up) + cosine * along).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral over the sphere 1, mean cosine g; drawn directions have the same mean cosine and length 1.
    #[test]
    fn the_phase_function_is_normalised_with_mean_cosine_g() {
        for g in [-0.9, -0.3, 0.0, 5e-4, 0.5, 0.95] {
            let n = 200_000;
            let cosines = (0..n).map(|i| -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n));
            let [mut sum, mut mean] = [0.0; 2];
            for cosine in cosines {
                let density = phase(g, cosine) * 2.0 * PI * 2.0 / f64::from(n);
                (sum, mean) = (sum + density, mean + density * cosine);
            }
            assert!((sum - 1.0).abs() < 1e-5 && (mean - g).abs() < 1e-5, "{g}: {sum} {mean}");
            let mut stream = Stream::new([1, 2], 3, 4);
            let mut drawn = 0.0;
            for along in [DVec3::Z, -DVec3::Z, DVec3::new(0.6, 0.0, -0.8), DVec3::X] {
                for _ in 0..20_000 {
                    let [u, v, ..] = stream.draw();
                    let turned = scattered(g, along, [u, v]);
                    assert!((turned.length() - 1.0).abs() < 1e-12);
                    drawn += turned.dot(along) / 80_000.0;
                }
            }
            // Five standard errors; the variance of a cosine is below 1/3 + g^2.
            assert!((drawn - g).abs() < 5.0 * (0.34 / 80_000.0f64).sqrt(), "{g}: {drawn}");
        }
    }
}
