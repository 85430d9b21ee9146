//! Lee's sigma filter on slices, distance maps and pictures (Lee 1983; thesis 5.3): the mean of the pixels of a window that
//! lie within two sigma of the centre (additive noise), or two sigma times the centre (multiplicative); where no more than K
//! do, nor all that there are, the mean of the four immediate neighbours.

use crate::passes::pass::*;
use crate::scene;

const WHY: &str = "a sum of at most 63^2 differences in f32; a pixel within rounding of the range's end may fall on either side; the \
                   slice's R16F stores 1 to 4.9e-4";

/// Margin, in values of 0..1, by which the range of similar values is widened: equation 5-3 of the thesis includes a value at the very end, as 51 of
/// 255 levels are at a sigma of 0.1. It is ten times the rounding error of f32, and a fifteenth of a 16-bit level. Distances have no such margin.
pub(super) const TIE: f64 = 1e-6;

pub const SLICE: Pass = Pass {
    name: "sigma_slice",
    link: Link::Filter(Filter::of_slices(|s| Some([radius(s.slice_filters.sigma); 2]))),
    shader: |_, _| "filter/sigma.slice",
    needed: |s| need(s.slice_filters.sigma.map(|sigma| sigma.sigma)),
    extent: |s, t| in_runs(slice_extent(s, t), 1),
    repeat: |s| s.slice_filters.sigma.unwrap_or_default().repeat,
    params: |s, t| params(s.slice_filters.sigma, TIE, t),
    constants: |s, _| {
        let sigma = s.slice_filters.sigma;
        let is_tiled = reads_tile(s, tile_words(radius(sigma)));
        [constants(sigma), vec![("TILED", i32::from(is_tiled))]].concat()
    },
    tolerance: Tolerance::absolute(6e-4).outliers(1e-3).because(WHY),
    reference: |s, t, reads, writes| reference(s.slice_filters.sigma, TIE, t, reads, writes, |_| true),
    ..Pass::OF_SLICES
};

pub(crate) const DISTANCE: Pass = Pass {
    name: "sigma_distance",
    shader: |_, _| "filter/sigma.distance",
    needed: |s| need(s.distance.sigma.map(|sigma| sigma.sigma)),
    extent: |s, t| in_runs(ray_extent(s, t), 1),
    repeat: |s| s.distance.sigma.unwrap_or_default().repeat,
    params: |s, t| params(s.distance.sigma, 0.0, t),
    constants: |s, _| constants(s.distance.sigma),
    tolerance: Tolerance::absolute(1e-5).relative(1e-6).outliers(1e-3).because(WHY),
    reference: |s, t, reads, writes| reference(s.distance.sigma, 0.0, t, reads, writes, is_hit),
    ..Pass::OF_DISTANCES
};

pub const PICTURE: Pass = Pass {
    name: "sigma_picture",
    shader: |_, _| "filter/sigma.picture",
    needed: |s| need(s.settings.post.sigma.map(|sigma| sigma.sigma)),
    extent: |s, t| in_runs_of(PICTURE_RUN, picture_extent(s, t), 1),
    repeat: |s| s.settings.post.sigma.unwrap_or_default().repeat,
    params: |s, t| params(s.settings.post.sigma, TIE, t),
    constants: |s, _| constants(s.settings.post.sigma),
    tolerance: Tolerance::absolute(6e-4).relative(1e-3).outliers(1e-3).because(WHY),
    reference: |s, t, reads, writes| reference(s.settings.post.sigma, TIE, t, reads, writes, |_| true),
    ..Pass::OF_PICTURES
};

/// Pixels that one invocation makes of a picture: RUN of the shader's variant.
const PICTURE_RUN: u32 = 2;

/// A sigma of 0 keeps every pixel: no pass.
pub(super) fn need(sigma: Option<f64>) -> Need {
    match sigma {
        Some(sigma) if sigma > 0.0 => Ok("asked for"),
        Some(_) => Err("a sigma of 0 changes nothing"),
        None => Err("not asked for"),
    }
}

/// K of thesis 5.3 for a window of `window` pixels along each edge: where no more than K of its pixels are similar to the centre, the four immediate
/// neighbours are averaged instead. It is 3 at 7x7, 2 at 5x5, and in proportion elsewhere.
pub(super) fn few(window: u32) -> u32 {
    window.saturating_sub(1) / 2
}

/// The half width of the range of similar values, 2 sigma, as the shader gets it; for multiplicative noise as a factor of the centre. It is at most
/// 1e30, which includes every value and stays finite when multiplied by a sample.
pub(super) fn range(sigma: f64) -> f64 {
    f64::from((2.0 * sigma).min(1e30) as f32)
}

fn params(sigma: Option<scene::Sigma>, tie: f64, args: &DispatchArgs) -> Params {
    let sigma = sigma.unwrap_or_default();
    let params = Params::default().f32("range", range(sigma.sigma)).f32("tie", tie);
    params.f32("few", f64::from(few(sigma.window))).i32("slice", args.slice)
}

/// Half the window's edge, texels.
fn radius(sigma: Option<scene::Sigma>) -> u32 {
    sigma.unwrap_or_default().window / 2
}

/// Words of a workgroup's tile of a slice: TILE_PITCH and TILE_ROWS of glsl/filter/sigma.comp.
fn tile_words(radius: u32) -> u32 {
    let columns = GROUP + 2 * radius;
    ((columns + 5) / 8 * 8 + 2) * (GROUP * RUN + 2 * radius)
}

fn constants(sigma: Option<scene::Sigma>) -> Vec<(&'static str, i32)> {
    vec![
        ("RADIUS", radius(sigma) as i32),
        ("MULTIPLICATIVE", i32::from(sigma.unwrap_or_default().noise == scene::Noise::Multiplicative)),
    ]
}

fn reference(
    sigma: Option<scene::Sigma>,
    tie: f64,
    args: &DispatchArgs,
    reads: &Arrays,
    writes: &mut Arrays,
    valid: fn(f64) -> bool,
) {
    let radius = i64::from(radius(sigma));
    let sigma = sigma.unwrap_or_default();
    let (source, target, z) = filtered(reads, writes, args);
    let [width, height, _] = source.size;
    let inside = |x: i64, y: i64| x >= 0 && y >= 0 && x < width as i64 && y < height as i64;
    for (x, y) in pixels([width as i64, height as i64]) {
        let centre = source.get([x as usize, y as usize, 0]).to_vec();
        let filtered: Vec<f64> = (0..source.channels)
            .map(|c| {
                let at = |x: i64, y: i64| source.get([x as usize, y as usize, 0])[c];
                if !valid(centre[c]) {
                    return centre[c];
                }
                let range = match sigma.noise {
                    scene::Noise::Additive => range(sigma.sigma),
                    scene::Noise::Multiplicative => range(sigma.sigma) * centre[c].abs(),
                };
                let window = (y - radius..=y + radius).flat_map(|j| (x - radius..=x + radius).map(move |i| (i, j)));
                let there: Vec<f64> =
                    window.filter(|&(i, j)| inside(i, j)).map(|(i, j)| at(i, j)).filter(|v| valid(*v)).collect();
                let close: Vec<f64> = there.iter().copied().filter(|v| (v - centre[c]).abs() <= range + tie).collect();
                if close.len() as u32 > few(sigma.window) || close.len() == there.len() {
                    return close.iter().sum::<f64>() / close.len() as f64;
                }
                let near: Vec<f64> = [(x, y - 1), (x - 1, y), (x, y + 1), (x + 1, y)]
                    .into_iter()
                    .filter(|&(i, j)| inside(i, j))
                    .map(|(i, j)| at(i, j))
                    .filter(|v| valid(*v))
                    .collect();
                if near.is_empty() { centre[c] } else { near.iter().sum::<f64>() / near.len() as f64 }
            })
            .collect();
        target.set([x as usize, y as usize, z], &filtered);
    }
}
