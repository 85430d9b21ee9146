//! The enhanced sigma filter (thesis 5.4, 5.5) on slices, distance maps and pictures: the centre is estimated first, and while
//! fewer pixels than the starting window holds lie within two sigma of it, the window grows by one on every side.

use super::estimator::{self, LEAST, LEAST_DISTANCE};
use super::sigma::{few, range};
use crate::passes::chain::{distance_link, picture_link, slice_link, writes_volume};
use crate::passes::*;
use crate::scene::{EnhancedSigma, Noise, Scene};

const WHY: &str = "a mean of at most 63^2 values in f32; a pixel at exactly 2 sigma may count or not, and with it a whole ring; \
                   R16F stores 1 to 4.9e-4";

pub const SLICE: Pass = Pass {
    name: "enhanced_sigma_slice",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    shader: |s, t| match writes_volume(s, "enhanced_sigma_slice", t) {
        true => "filter/enhanced_sigma.slice",
        false => "filter/enhanced_sigma.plane",
    },
    needed: |s| asked(s.settings.slices.enhanced_sigma),
    reads: |s, t| vec![whole("source", slice_link(s, "enhanced_sigma_slice", t).0)],
    writes: |s, t| vec![slice("target", slice_link(s, "enhanced_sigma_slice", t).1)],
    extent: slice_extent,
    repeat: once,
    params: |s, t| params(s.settings.slices.enhanced_sigma, LEAST, t),
    constants: |s, _| constants(s, s.settings.slices.enhanced_sigma),
    tolerance: Tolerance { absolute: 6e-4, relative: 0.0, outliers: 2e-3, why: WHY },
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.settings.slices.enhanced_sigma, LEAST, |_| true);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
};

pub const DISTANCE: Pass = Pass {
    name: "enhanced_sigma_distance",
    stage: Stage::Shade,
    frequency: Frequency::Picture,
    shader: |_, _| "filter/enhanced_sigma.distance",
    needed: |s| match s.has_distance() {
        true => asked(s.distance.enhanced_sigma),
        false => Err("no distance map in this mode"),
    },
    reads: |s, t| vec![whole("source", distance_link(s, "enhanced_sigma_distance", t).0)],
    writes: |s, t| vec![whole("target", distance_link(s, "enhanced_sigma_distance", t).1)],
    extent: ray_extent,
    repeat: once,
    params: |s, t| params(s.distance.enhanced_sigma, LEAST_DISTANCE, t),
    constants: |s, _| constants(s, s.distance.enhanced_sigma),
    // A pixel of f32 in mm lies 4e-6 from where f64 has it, a hundred times as far as one in 0..1.
    tolerance: Tolerance { absolute: 2e-5, relative: 1e-6, outliers: 5e-3, why: WHY },
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.distance.enhanced_sigma, LEAST_DISTANCE, is_hit);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
};

pub const PICTURE: Pass = Pass {
    name: "enhanced_sigma_picture",
    stage: Stage::Postprocess,
    frequency: Frequency::Picture,
    shader: |_, _| "filter/enhanced_sigma.picture",
    needed: |s| asked(s.settings.post.enhanced_sigma),
    reads: |s, t| vec![whole("source", picture_link(s, "enhanced_sigma_picture", t).0)],
    writes: |s, t| vec![whole("target", picture_link(s, "enhanced_sigma_picture", t).1)],
    extent: picture_extent,
    repeat: once,
    params: |s, t| params(s.settings.post.enhanced_sigma, LEAST, t),
    constants: |s, _| constants(s, s.settings.post.enhanced_sigma),
    tolerance: Tolerance { absolute: 1e-3, relative: 1e-3, outliers: 1e-2, why: WHY },
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.settings.post.enhanced_sigma, LEAST, |_| true);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
};

/// A sigma of 0 keeps every pixel: no pass.
pub(super) fn asked(enhanced: Option<EnhancedSigma>) -> Need {
    match enhanced {
        Some(e) if e.sigma > 0.0 => Ok("asked for"),
        Some(_) => Err("a sigma of 0 changes nothing"),
        None => Err("not asked for"),
    }
}

pub(super) fn params(enhanced: Option<EnhancedSigma>, least: f64, args: &DispatchArgs) -> Params {
    let e = enhanced.unwrap_or_default();
    let params = Params::default().f32("range", range(e.sigma)).f32("few", f64::from(few(e.window)));
    estimator::params(params, e.edge, least).i32("slice", args.slice)
}

pub(super) fn constants(scene: &Scene, enhanced: Option<EnhancedSigma>) -> Vec<(&'static str, i32)> {
    let e = enhanced.unwrap_or_default();
    vec![
        ("RADIUS", (e.window / 2) as i32),
        ("LARGEST", (e.largest / 2) as i32),
        ("ESTIMATOR", estimator::constant(scene.centre(e))),
        ("MULTIPLICATIVE", i32::from(e.noise == Noise::Multiplicative)),
    ]
}

/// Rec. 709; a slice or a distance is its own.
fn brightness(texel: &[f64]) -> f64 {
    if texel.len() < 3 { texel[0] } else { 0.2126 * texel[0] + 0.7152 * texel[1] + 0.0722 * texel[2] }
}

/// The filter's reference.
pub(super) struct Enhanced {
    settings: EnhancedSigma,
    centre: crate::scene::Estimator,
    least: f64,
    valid: fn(f64) -> bool,
}

/// What the filter finds at a pixel.
pub(super) struct Found {
    pub mean: Vec<f64>,
    /// How many rings the window grew.
    pub rings: u32,
}

impl Enhanced {
    pub fn new(scene: &Scene, settings: Option<EnhancedSigma>, least: f64, valid: fn(f64) -> bool) -> Enhanced {
        let settings = settings.unwrap_or_default();
        Enhanced { settings, centre: scene.centre(settings), least, valid }
    }

    pub fn filter(&self, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays, value: fn(Found) -> Vec<f64>) {
        let source = reads.get("source");
        let target = writes.get_mut("target");
        let z = if target.size[2] > 1 { args.slice as usize } else { 0 };
        for y in 0..source.size[1] {
            for x in 0..source.size[0] {
                target.set([x, y, z], &value(self.at(source, x as i64, y as i64)));
            }
        }
    }

    fn at(&self, source: &Texels, x: i64, y: i64) -> Found {
        let e = &self.settings;
        let here = source.get([x as usize, y as usize, 0]);
        if !(self.valid)(here[0]) {
            return Found { mean: here.to_vec(), rings: 0 };
        }
        let [width, height] = [source.size[0] as i64, source.size[1] as i64];
        let near = |dx: i64, dy: i64| {
            let (i, j) = ((x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1));
            brightness(source.get([i as usize, j as usize, 0]))
        };
        let centre = estimator::estimate(self.centre, &near, self.valid, e.edge, self.least);
        let range = match e.noise {
            Noise::Additive => range(e.sigma),
            Noise::Multiplicative => range(e.sigma) * centre.abs(),
        };
        let there = |i: i64, j: i64| {
            let inside = i >= 0 && j >= 0 && i < width && j < height;
            inside.then(|| source.get([i as usize, j as usize, 0])).filter(|v| (self.valid)(v[0]))
        };
        // Pixels within a window, and those of them like the centre.
        let window = |radius: i64| {
            let all = (y - radius..=y + radius).flat_map(move |j| (x - radius..=x + radius).map(move |i| (i, j)));
            let there: Vec<&[f64]> = all.filter_map(|(i, j)| there(i, j)).collect();
            let count = there.len();
            let alike: Vec<&[f64]> = there.into_iter().filter(|v| (brightness(v) - centre).abs() <= range).collect();
            (count, alike)
        };
        let (start, largest) = (i64::from(e.window / 2), i64::from(e.largest / 2));
        let (wanted, mut alike) = window(start);
        let mut radius = start;
        while alike.len() < wanted && radius < largest {
            radius += 1;
            alike = window(radius).1;
        }
        if alike.len() as u32 <= few(e.window) && alike.len() < wanted {
            let four = [(x, y - 1), (x - 1, y), (x, y + 1), (x + 1, y)];
            alike = four.into_iter().filter_map(|(i, j)| there(i, j)).collect();
        }
        if alike.is_empty() {
            alike = vec![here];
        }
        let mean = |c: usize| alike.iter().map(|v| v[c]).sum::<f64>() / alike.len() as f64;
        Found { mean: (0..source.channels).map(mean).collect(), rings: (radius - start) as u32 }
    }
}
