//! The enhanced sigma filter (thesis 5.4, 5.5) on the lit picture: the centre is estimated by a median of 3x3, and while fewer
//! pixels than the starting window holds lie within two sigma of it, the window grows by one on every side.

use crate::passes::chain::picture_link;
use crate::passes::*;
use crate::scene::{EnhancedSigma, Scene};

const NAME: &str = "enhanced_sigma_picture";

pub const PICTURE: Pass = Pass {
    name: NAME,
    stage: Stage::Postprocess,
    when: When::Picture,
    shader: |_, _| "filter/enhanced_sigma.picture",
    needed: |s| match s.settings.post.enhanced_sigma {
        Some(e) if e.sigma > 0.0 => Ok("asked for"),
        Some(_) => Err("a sigma of 0 changes nothing"),
        None => Err("not asked for"),
    },
    reads: |s, t| vec![whole("source", picture_link(s, NAME, t).0)],
    writes: |s, t| vec![whole("target", picture_link(s, NAME, t).1)],
    extent: picture_extent,
    repeat: once,
    params: |s, t| {
        let e = settings(s);
        Params::default().f32("range", 2.0 * e.sigma).f32("few", f64::from(few(e))).i32("slice", t.slice)
    },
    constants: |s, _| vec![("RADIUS", (settings(s).window / 2) as i32), ("LARGEST", (settings(s).largest / 2) as i32)],
    tolerance: Tolerance {
        absolute: 1e-3,
        relative: 1e-3,
        outliers: 1e-2,
        why: "a mean of at most 63^2 colours in f32; a pixel at exactly 2 sigma may count or not, and with it a whole ring",
    },
    reference: |scene, _, reads, writes| {
        let source = reads.get("source");
        let target = writes.get_mut("target");
        for y in 0..source.size[1] {
            for x in 0..source.size[0] {
                let filtered = filtered(settings(scene), source, x as i64, y as i64);
                target.set([x, y, 0], &filtered);
            }
        }
    },
};

fn settings(scene: &Scene) -> EnhancedSigma {
    scene.settings.post.enhanced_sigma.unwrap_or_default()
}

/// K: at most this many alike, and the four neighbours' mean is taken instead (thesis 5-5).
fn few(e: EnhancedSigma) -> u32 {
    e.window.saturating_sub(1) / 2
}

/// Rec. 709.
fn brightness(colour: &[f64]) -> f64 {
    0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2]
}

fn filtered(e: EnhancedSigma, source: &Texels, x: i64, y: i64) -> [f64; 4] {
    let [width, height, _] = source.size;
    let inside = |x: i64, y: i64| x >= 0 && y >= 0 && x < width as i64 && y < height as i64;
    let clamped = |i: i64, n: usize| i.clamp(0, n as i64 - 1) as usize;
    let mut near: Vec<f64> = (0..9)
        .map(|i| brightness(source.get([clamped(x + i % 3 - 1, width), clamped(y + i / 3 - 1, height), 0])))
        .collect();
    near.sort_by(f64::total_cmp);
    let centre = near[4];
    let range = f64::from((2.0 * e.sigma).min(f64::from(f32::MAX)) as f32);
    // Pixels of the picture within a window, and those of them like the centre.
    let window = |radius: i64| {
        let all = (y - radius..=y + radius).flat_map(move |j| (x - radius..=x + radius).map(move |i| (i, j)));
        let there: Vec<&[f64]> =
            all.filter(|&(i, j)| inside(i, j)).map(|(i, j)| source.get([i as usize, j as usize, 0])).collect();
        let count = there.len();
        let alike: Vec<&[f64]> = there.into_iter().filter(|c| (brightness(c) - centre).abs() <= range).collect();
        (count, alike)
    };
    let (start, largest) = (i64::from(e.window / 2), i64::from(e.largest / 2));
    let (wanted, mut alike) = window(start);
    let mut radius = start;
    while alike.len() < wanted && radius < largest {
        radius += 1;
        alike = window(radius).1;
    }
    if alike.len() as u32 <= few(e) {
        let four = [(x, y - 1), (x - 1, y), (x, y + 1), (x + 1, y)].into_iter().filter(|&(i, j)| inside(i, j));
        alike = four.map(|(i, j)| source.get([i as usize, j as usize, 0])).collect();
    }
    if alike.is_empty() {
        alike = vec![source.get([x as usize, y as usize, 0])];
    }
    std::array::from_fn(|c| alike.iter().map(|colour| colour[c]).sum::<f64>() / alike.len() as f64)
}
