//! The enhanced sigma filter (thesis 5.4, 5.5) on slices, distance maps and pictures: the centre is estimated first, and while
//! fewer pixels than the starting window holds lie within two sigma of it, the window grows by one on every side.

use super::estimator::{self, LEAST, least_distance};
use super::sigma::{TIE, few, need, range};
use crate::passes::pass::*;
use crate::scene::{EnhancedSigma, Noise, Scene};

const WHY: &str = "a mean of at most 63^2 values in f32; a pixel within rounding of the range's end may count or not, and with it a \
                   whole ring; R16F stores 1 to 4.9e-4";

pub const SLICE: Pass = Pass {
    name: "enhanced_sigma_slice",
    link: Link::Filter(Filter::of_slices(|s| Some([reach(s, s.slice_filters.enhanced_sigma); 2]))),
    shader: |_, _| "filter/enhanced_sigma.slice",
    needed: |s| need(s.slice_filters.enhanced_sigma.map(|enhanced| enhanced.sigma)),
    params: |s, t| params(s.slice_filters.enhanced_sigma, [LEAST, TIE], t),
    constants: |s, _| constants(s, s.slice_filters.enhanced_sigma, false),
    tolerance: Tolerance::absolute(6e-4).outliers(2e-3).because(WHY),
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.slice_filters.enhanced_sigma, [LEAST, TIE], |_| true);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
    ..Pass::OF_SLICES
};

pub(crate) const DISTANCE: Pass = Pass {
    name: "enhanced_sigma_distance",
    shader: |_, _| "filter/enhanced_sigma.distance",
    needed: |s| need(s.distance.enhanced_sigma.map(|enhanced| enhanced.sigma)),
    params: |s, t| params(s.distance.enhanced_sigma, [least_distance(s), 0.0], t),
    constants: |s, _| constants(s, s.distance.enhanced_sigma, false),
    // A pixel in mm differs by 4e-6 between f32 and f64, a hundred times as much as one in 0..1.
    tolerance: Tolerance::absolute(2e-5).relative(1e-6).outliers(5e-3).because(WHY),
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.distance.enhanced_sigma, [least_distance(s), 0.0], is_hit);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
    ..Pass::OF_DISTANCES
};

pub const PICTURE: Pass = Pass {
    name: "enhanced_sigma_picture",
    shader: |_, _| "filter/enhanced_sigma.picture",
    needed: |s| need(s.settings.post.enhanced_sigma.map(|enhanced| enhanced.sigma)),
    params: |s, t| params(s.settings.post.enhanced_sigma, [LEAST, TIE], t),
    constants: |s, _| constants(s, s.settings.post.enhanced_sigma, false),
    tolerance: Tolerance::absolute(1e-3).relative(1e-3).outliers(1e-2).because(WHY),
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.settings.post.enhanced_sigma, [LEAST, TIE], |_| true);
        enhanced.filter(t, reads, writes, |found| found.mean);
    },
    ..Pass::OF_PICTURES
};

/// Records how many rings of pixels the window of the enhanced sigma filter grew at each pixel of a slice, which Tables 7-9 of the thesis count. It
/// reads the same slice as the filter, which runs next.
pub const GROWTH: Pass = Pass {
    name: "growth_slice",
    link: Link::Observer(Chain::Slices),
    shader: |_, _| "filter/enhanced_sigma.slice",
    needed: |s| match s.slice_filters.enhanced_sigma {
        Some(e) if e.growth && e.sigma > 0.0 => Ok("the windows' growth is asked for"),
        Some(e) if e.growth => Err("a sigma of 0 grows no window"),
        _ => Err("not asked for"),
    },
    writes: |_, _| vec![slices("target", Slot::Growth)],
    params: |s, t| params(s.slice_filters.enhanced_sigma, [LEAST, TIE], t),
    constants: |s, _| constants(s, s.slice_filters.enhanced_sigma, true),
    tolerance: Tolerance::absolute(0.0)
        .outliers(2e-3)
        .because("whole rings; a pixel within rounding of the range's end may count or not, and with it a ring"),
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.slice_filters.enhanced_sigma, [LEAST, TIE], |_| true);
        enhanced.filter(t, reads, writes, |found| vec![f64::from(found.rings)]);
    },
    ..Pass::OF_SLICES
};

/// How far the largest window, or the estimate of its centre, looks, texels.
fn reach(scene: &Scene, enhanced: Option<EnhancedSigma>) -> u32 {
    enhanced.map_or(0, |e| (e.largest / 2).max(estimator::reach(scene.centre(e))))
}

fn params(enhanced: Option<EnhancedSigma>, [least, tie]: [f64; 2], args: &DispatchArgs) -> Params {
    let e = enhanced.unwrap_or_default();
    let params = Params::default().f32("range", range(e.sigma)).f32("tie", tie).f32("few", f64::from(few(e.window)));
    estimator::params(params, e.edge, least).i32("slice", args.slice)
}

/// `growth`: the result is the number of rings that the window grew.
fn constants(scene: &Scene, enhanced: Option<EnhancedSigma>, growth: bool) -> Vec<(&'static str, i32)> {
    let e = enhanced.unwrap_or_default();
    vec![
        ("RADIUS", (e.window / 2) as i32),
        ("MAX_RADIUS", (e.largest / 2) as i32),
        ("ESTIMATOR", estimator::constant(scene.centre(e))),
        ("MULTIPLICATIVE", i32::from(e.noise == Noise::Multiplicative)),
        ("GROWTH", growth as i32),
    ]
}

/// Brightness by Rec. 709; a slice or a distance has one channel.
fn brightness(texel: &[f64]) -> f64 {
    if texel.len() < 3 { texel[0] } else { 0.2126 * texel[0] + 0.7152 * texel[1] + 0.0722 * texel[2] }
}

/// The filter's reference.
struct Enhanced {
    settings: EnhancedSigma,
    centre: crate::scene::Estimator,
    least: f64,
    tie: f64,
    valid: fn(f64) -> bool,
}

/// What the filter finds at a pixel.
struct Found {
    mean: Vec<f64>,
    /// How many rings the window grew.
    rings: u32,
}

impl Enhanced {
    fn new(scene: &Scene, settings: Option<EnhancedSigma>, [least, tie]: [f64; 2], valid: fn(f64) -> bool) -> Enhanced {
        let settings = settings.unwrap_or_default();
        Enhanced { settings, centre: scene.centre(settings), least, tie, valid }
    }

    fn filter(&self, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays, value: fn(Found) -> Vec<f64>) {
        let (source, target, z) = filtered(reads, writes, args);
        for (x, y) in source.pixels() {
            target.set([x, y, z], &value(self.at(source, x as i64, y as i64)));
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
            let alike: Vec<&[f64]> =
                there.into_iter().filter(|v| (brightness(v) - centre).abs() <= range + self.tie).collect();
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
