//! A survey of what the rays or planes of a picture meet, in f64 on the CPU. It tells why a picture has a single colour.

use super::detector::{judged, polarity};
use super::ray::{Ray, interpolated, texel};
use crate::passes::texels::{Texels, pixels};
use crate::scene::{Mode, Scene, View, windowed};

/// Most rays whose samples are looked at, and most samples of each.
const RAYS: usize = 4096;
const SAMPLES: f64 = 1024.0;

/// Statistics of what the rays, or the points of planes, meet in the volume.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Survey {
    /// Number of rays that pass through the rendered box on the kept side of all clip planes. For planes, number of their points (pixels) there.
    pub met: usize,
    /// Number of samples in the insonified region that were taken on at most 4096 of those rays, or at all of those points.
    pub insonified: usize,
    /// Smallest and largest of the samples that `insonified` counts, 0..1 before the grey window. None if there are none.
    pub values: Option<[f64; 2]>,
    /// Modes surface and mixed: the largest difference, on any surveyed ray, of the means of two neighbouring stretches of the ray. Each is as long as
    /// `surface.edge` (longer on rays of more than 1024 steps); after the grey window and with the sign of `surface.sign`. 0 in other modes.
    pub edge: f64,
}

/// The region and grey window that the scene's mode renders with.
pub fn view(scene: &Scene) -> View {
    match scene.settings.mode {
        Mode::Volume => scene.volume_view(),
        Mode::Surface | Mode::Mixed => scene.surface_view(),
        Mode::Mip | Mode::MinIp | Mode::Mean => scene.projection_view(),
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => scene.whole_view(scene.settings.planes.window),
        Mode::Cube => scene.whole_view(scene.settings.cube.window),
    }
}

/// Samples the volume along the scene's rays, or on its planes. `volume`: the texels of the scene's volume, 0..1; only those within the visible
/// bounds are read.
pub fn survey(scene: &Scene, volume: &Texels) -> Survey {
    let mut survey = Survey::default();
    let take = if scene.is_flat() { planes } else { rays };
    take(scene, volume, &mut survey);
    survey
}

impl Survey {
    fn take(&mut self, value: f64) {
        let [low, high] = self.values.unwrap_or([value; 2]);
        self.values = Some([low.min(value), high.max(value)]);
        self.insonified += 1;
    }
}

fn rays(scene: &Scene, volume: &Texels, survey: &mut Survey) {
    let view = view(scene);
    // Samples before the window, which is applied where it matters.
    let bare = View { window: [0.0, 1.0], ..view };
    let step = if scene.detects_surface() { scene.ring.step } else { scene.step };
    let [width, height] = scene.ray_size().map(|n| n as usize);
    let cast = |n: usize| Ray::cast(scene, volume, bare, step, n % width, n / width);
    let met: Vec<usize> = (0..width * height).filter(|n| cast(*n).path() > 0.0).collect();
    survey.met = met.len();
    for n in met.iter().step_by(met.len().div_ceil(RAYS).max(1)) {
        let ray = cast(*n);
        let count = (ray.path() / step).ceil().clamp(1.0, SAMPLES);
        let samples: Vec<Option<f64>> =
            (0..count as u64).map(|i| ray.echo(ray.enter + (i as f64 + 0.5) / count * ray.path())).collect();
        samples.iter().flatten().for_each(|value| survey.take(*value));
        if scene.detects_surface() {
            survey.edge = survey.edge.max(largest_edge(scene, view.window, &samples));
        }
    }
}

/// The largest difference between the means of `half` samples and of the `half` before them, none of them outside.
fn largest_edge(scene: &Scene, window: [f64; 2], samples: &[Option<f64>]) -> f64 {
    let half = scene.ring.half as usize;
    let differences = samples.windows(2 * half).filter_map(|ring| {
        let sum = |half: &[Option<f64>]| half.iter().map(|v| v.map(|v| windowed(window, v))).sum::<Option<f64>>();
        let (older, newer) = ring.split_at(half);
        Some(judged(polarity(scene), sum(newer)? - sum(older)?) / half as f64)
    });
    differences.fold(0.0, f64::max)
}

fn planes(scene: &Scene, volume: &Texels, survey: &mut Survey) {
    let tiling = scene.tiling();
    let [width, height] = scene.picture_size().map(|n| n as usize);
    for (x, y) in pixels([width, height]) {
        let Some(tile) = tiling.tile_at(x, y) else { continue };
        let place = tiling.point(tile, [x, y].map(|n| n as f64 + 0.5));
        let within = place.cmpge(scene.low).all() && place.cmple(scene.high).all();
        if !within || scene.clips().any(|(normal, limit)| normal.dot(place) > limit) {
            continue;
        }
        survey.met += 1;
        if let Some(at) = texel(scene, place) {
            survey.take(interpolated(scene, volume, at));
        }
    }
}
