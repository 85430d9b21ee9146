//! A ray by very many samples, from the definition of a sample in docs/numerics.md and docs/settings.md: it shares nothing with exact rays,
//! bounds or passes but the camera, the maps of the probe, and the interpolation of texels. Its error is estimated by how much what it adds up
//! varies.

use echolume::low_level::passes::{MISS, Texels};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Mode, Scene, Shading, TransferPoint, transfer};
use glam::DVec3;

/// Samples of a ray.
pub const COUNT: usize = 100_000;

/// What rays of a scene go through.
pub struct Samples<'a> {
    scene: &'a Scene,
    volume: &'a Texels,
    window: [f64; 2],
    low: DVec3,
    high: DVec3,
    /// Clip planes: unit normals and points.
    clips: Vec<(DVec3, DVec3)>,
}

/// The light of a ray: how far its red, green, blue and opacity may be off, and where its opacity reached `volume.hit`, mm.
pub struct Light {
    pub rgba: [f64; 4],
    pub tolerance: f64,
    pub hit: f64,
}

impl<'a> Samples<'a> {
    /// `start`: the start depth of the mode.
    pub fn new(scene: &'a Scene, volume: &'a Texels, window: [f64; 2], start: Option<f64>) -> Samples<'a> {
        let starts_at = start.map_or(f64::MIN, |depth| scene.place_of([0.0, depth, 0.0]).y);
        let clips = scene.settings.clip.iter();
        Samples {
            scene,
            volume,
            window,
            low: scene.low.with_y(scene.low.y.max(starts_at)),
            high: scene.high,
            clips: clips.map(|c| (DVec3::from(c.normal).normalize(), scene.place_of(c.at))).collect(),
        }
    }

    fn is_rendered(&self, place: DVec3) -> bool {
        let is_in_box = place.cmpge(self.low).all() && place.cmple(self.high).all();
        is_in_box && self.clips.iter().all(|(normal, at)| normal.dot(place - *at) <= 0.0)
    }

    /// The windowed sample of a place; none outside of what is rendered or insonified.
    fn value(&self, place: DVec3) -> Option<f64> {
        if !self.is_rendered(place) {
            return None;
        }
        let (grid, origin) = (&self.scene.grid, self.scene.grid.origin);
        let at = match &self.scene.geometry {
            Geometry::Cartesian(voxels) => {
                std::array::from_fn(|axis| (place[axis] - voxels.origin[axis]) / voxels.spacing[axis])
            }
            Geometry::Sweep(probe) => {
                let (x, y, position) = probe.inverse_sweep_map(place);
                let (sample, line) = probe.plane_indices(x, y);
                let slice = probe.slice_index(position, line);
                let counts = [probe.samples, probe.lines.len(), probe.slices.len()];
                if !([sample, line, slice].iter().zip(counts).all(|(i, n)| (0.0..=(n - 1) as f64).contains(i))) {
                    return None;
                }
                [(x - origin[0]) / grid.pitch[0], (y - origin[1]) / grid.pitch[1], slice]
            }
        };
        let texel = match self.scene.takes_bspline() {
            true => self.volume.bspline_across_slices(at),
            false => self.volume.trilinear(at),
        };
        Some(((texel - self.window[0]) / (self.window[1] - self.window[0])).clamp(0.0, 1.0))
    }

    /// The first and the last place of a line that may be rendered, and the distance between two samples, mm.
    fn stretch(&self, origin: DVec3, direction: DVec3) -> [f64; 3] {
        let radius = (self.high - self.low).length() / 2.0;
        let middle = ((self.low + self.high) / 2.0 - origin).dot(direction);
        let from = (middle - radius).max(0.0);
        let to = (middle + radius).max(from);
        [from, to, (to - from) / COUNT as f64]
    }

    /// The samples of a ray, each with its distance.
    fn along(&self, [origin, direction]: [DVec3; 2]) -> impl Iterator<Item = (f64, Option<f64>)> {
        let [from, _, step] = self.stretch(origin, direction);
        (0..COUNT).map(move |n| {
            let t = from + (n as f64 + 0.5) * step;
            (t, self.value(origin + direction * t))
        })
    }

    /// What is left of the matter at a place.
    fn faded(&self, place: DVec3) -> f64 {
        let fade = self.scene.settings.region.fade;
        if fade == 0.0 {
            return 1.0;
        }
        let to_face = |axis: usize| (place[axis] - self.low[axis]).min(self.high[axis] - place[axis]);
        let distances = [to_face(0), self.high.y - place.y, to_face(2)];
        let beyond = distances.map(|d| (1.0 - d / fade).max(0.0));
        let left = (1.0 - beyond.iter().map(|b| b * b).sum::<f64>().sqrt()).clamp(0.0, 1.0);
        left * left * (3.0 - 2.0 * left)
    }

    /// Emission and absorption between two distances.
    pub fn light(&self, [origin, direction]: [DVec3; 2], [least, most]: [f64; 2]) -> Light {
        let volume = &self.scene.settings.volume;
        let points = transfer::of(volume);
        let pixel = self.scene.grid.pitch[0].min(self.scene.grid.pitch[1]);
        let step = self.stretch(origin, direction)[2];
        let forward = self.scene.rays.forward;
        let corner = |sign: f64| {
            let away = DVec3::from_array(forward.to_array().map(|f| if f * sign > 0.0 { 1.0 } else { 0.0 }));
            (self.low + (self.high - self.low) * away).dot(forward)
        };
        let (near, far) = (corner(-1.0), corner(1.0));
        let (mut light, mut depth, mut hit) = ([0.0; 3], 0.0f64, MISS);
        let (mut before, mut variation) = ([0.0; 4], 0.0);
        for (t, value) in self.along([origin, direction]) {
            // e^-40 of the light is left.
            if depth > 40.0 {
                break;
            }
            let place = origin + direction * t;
            let (mut colour, mut kappa) = ([0.0; 3], 0.0);
            if let Some(value) = value.filter(|v| *v >= volume.threshold && t >= least && t <= most) {
                let [r, g, b, opacity] = between(&points, value);
                let per_mm = match volume.extinction {
                    Some(extinction) => opacity * extinction,
                    None => (-(1.0 - opacity).ln()).min(1e6) / pixel,
                };
                kappa = per_mm * self.faded(place);
                colour = [r, g, b];
                if volume.shading == Shading::DepthCoded {
                    let share = (place.dot(forward) - near) / (far - near);
                    colour = std::array::from_fn(|c| {
                        colour[c] * (volume.near_tint[c] + (volume.far_tint[c] - volume.near_tint[c]) * share)
                    });
                }
            }
            let left = f64::exp(-depth);
            let now = [kappa * colour[0], kappa * colour[1], kappa * colour[2], kappa].map(|q| q * left);
            variation += (0..4).map(|c| (now[c] - before[c]).abs()).fold(0.0, f64::max);
            before = now;
            let share = left * -f64::exp_m1(-kappa * step);
            light.iter_mut().zip(colour).for_each(|(l, c)| *l += share * c);
            depth += kappa * step;
            if hit == MISS && -f64::exp_m1(-depth) >= volume.hit {
                hit = t;
            }
        }
        let [r, g, b] = light;
        // A midpoint sum is off by no more than half a step times the variation of what it adds up; an opaque layer by the light of a step.
        Light { rgba: [r, g, b, -f64::exp_m1(-depth)], tolerance: (step * variation).min(5e-3) + 1e-7, hit }
    }

    /// What a projection keeps of a ray, none if it meets nothing, and how far it may be off.
    pub fn projected(&self, [origin, direction]: [DVec3; 2]) -> (Option<f64>, f64) {
        let (mut sum, mut count) = (0.0, 0.0);
        let (mut least, mut most, mut steepest) = (f64::MAX, f64::MIN, 0.0f64);
        let mut before = None;
        for value in self.along([origin, direction]).map(|(_, value)| value) {
            if let Some(value) = value {
                (sum, count) = (sum + value, count + 1.0);
                (least, most) = (least.min(value), most.max(value));
                steepest = steepest.max(before.map_or(0.0, |before: f64| (value - before).abs()));
            }
            before = value;
        }
        if count == 0.0 {
            return (None, 0.0);
        }
        match self.scene.settings.mode {
            // The region may begin and end half a step beside the samples, and the means of two parts be of another length.
            Mode::Mean => (Some(sum / count), 4.0 / count + 1e-7),
            Mode::MinIp => (Some(least), 2.0 * steepest + 1e-7),
            _ => (Some(most), 2.0 * steepest + 1e-7),
        }
    }
}

/// Colour and opacity of a value: linear between two points.
fn between(points: &[TransferPoint], value: f64) -> [f64; 4] {
    let rgba = |p: &TransferPoint| [p.colour[0], p.colour[1], p.colour[2], p.opacity];
    let above = points.iter().position(|p| p.at > value);
    match above {
        Some(0) => rgba(&points[0]),
        None => points.last().map_or([0.0; 4], rgba),
        Some(n) => {
            let (low, high) = (&points[n - 1], &points[n]);
            let share = (value - low.at) / (high.at - low.at);
            let (low, high) = (rgba(low), rgba(high));
            std::array::from_fn(|c| (1.0 - share) * low[c] + share * high[c])
        }
    }
}
