//! Settings that a user may switch to. A viewer compiles their pipelines in advance, and `profile --pipelines --all` measures them.

use super::load::{Layers, PRESETS};
use super::{Layout, Mode, Settings};
use std::path::Path;

/// Settings that a user may switch to, with a name for messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    pub name: String,
    pub settings: Settings,
}

impl Variant {
    fn new(name: impl Into<String>, settings: Settings) -> Variant {
        Variant { name: name.into(), settings }
    }
}

/// How rays may read the volume, each with another shader.
const SAMPLINGS: [&str; 3] = ["hardware", "exact", "quads"];

/// Filters, lights and other choices that are structure: each line is a table of a scene file.
const CHOICES: [&str; 53] = [
    "slices.median = true",
    "slices.sigma = {}",
    "slices.sigma = { repeat = 2 }",
    "slices.enhanced_sigma = { window = 5, largest = 19, sigma = 0.1 }",
    "slices.enhanced_sigma = { growth = true }",
    "slices.perona_malik = {}",
    "slices.perona_malik = { scheme = 'aos', step = 2, repeat = 2 }",
    "slices.perona_malik = { scheme = 'aos-richardson', step = 2, repeat = 2 }",
    "slices.perona_malik = { scheme = 'rkl1', step = 2, repeat = 2 }",
    "slices.smooth = { lateral = 1, depth = 1, elevation = 1 }",
    "slices.estimator = 'median'",
    "slices.estimator = 'perona-malik'",
    "slices.estimator = 'gradient-inverse'",
    "slices.estimator = 'nagao-matsuyama'",
    "conditioning = { samples = 120, low_pass = 1, dynamic_range = 50 }",
    "slices.format = 'r16'",
    "slices.format = 'r32f'",
    "distance = { median = 5, bilateral = { pixels = 2, distance = 1 }, sigma = {} }",
    "distance.median = 19",
    "distance.enhanced_sigma = {}",
    "distance.perona_malik = {}",
    "distance.perona_malik = { scheme = 'aos', step = 2 }",
    "post.sigma = {}",
    "post.enhanced_sigma = {}",
    "post.perona_malik = {}",
    "post.perona_malik = { scheme = 'aos', step = 2 }",
    "post.floats = true",
    "post.antialias = false",
    "light = { shadow = {}, occlusion = {}, skin = {} }",
    "surface.detector = 'adaptive'",
    "surface.detector = 'lasting'",
    "surface.detector = 'consistent'",
    "surface.colour = 'rendered'",
    "surface.colour = 'behind'",
    "ray.subsampling = 2",
    "ray.subsampling = 4",
    "ray.subsampling = 8",
    "ray.rays = 2",
    "mode = 'vr'\nray.rays = 2\nray.adaptive = true",
    "mode = 'vr'\nray.tolerance = 1",
    "ray.elevation = 'bspline'",
    "ray.slice_index = 'table'",
    "ray.elevation = 'bspline-sharp'",
    "mode = 'vr'\nvolume.compositing = 'pre-integrated'",
    "mode = 'vr'\nlight.volume = {}",
    "mode = 'vr'\nlight.volume = { ground = {}, back = 0 }\nregion.fade = 6",
    "mode = 'mixed'\nlight.volume = {}",
    "mode = 'vr'\nfloating = 100",
    "mode = 'vr'\nunveil.enabled = true",
    "mode = 'vr'\ncuts = [{ contour = [[0, 0], [1, 0], [0, 1]], view = { at = [0, 0, 0], direction = [0, 1, 0], up = [0, 0, 1] } }]",
    "mode = 'vr'\nlayout = '4up'\nplanes.smooth = { lateral = 0.5, depth = 0.5, elevation = 1 }",
    "mode = 'vr'\nvolume.shading = 'first-hit'",
    "mode = 'vr'\nvolume.shading = 'depth-coded'",
];

/// The settings that a user may switch to from `from` by one choice, and `from` itself first: each mode alone, each mode that casts rays with planes
/// beside it, the pair of surface and volume, and each preset laid over `from`. `follow` adds the settings that follow from another mode or layout;
/// presets do not go through it.
pub fn switches(from: &Settings, follow: impl Fn(Settings) -> Settings) -> Vec<Variant> {
    let mut variants = vec![Variant::new("as it is", from.clone())];
    for mode in Mode::ALL {
        let name = mode.name();
        let mut settings = from.clone();
        settings.set_mode(mode);
        settings.layout = Layout::Single;
        variants.push(Variant::new(format!("mode {name}"), follow(settings.clone())));
        if !mode.is_flat() {
            for (layout, layout_name) in [(Layout::Four, "4up"), (Layout::Beside, "beside")] {
                settings.layout = layout;
                variants.push(Variant::new(format!("mode {name}, layout {layout_name}"), follow(settings.clone())));
            }
        }
    }
    let pair = Settings { mode: Mode::Surface, layout: Layout::Pair, ..from.clone() };
    variants.push(Variant::new("layout pair", follow(pair)));
    variants.extend(PRESETS.iter().filter_map(|(preset, _)| preset_over(from, preset)));
    variants
}

/// All variants of `from` that [`switches`] gives, and also every way to sample the volume in every mode, every mode of every preset, and a list of
/// filters, lights and other choices, each applied to `from` by itself.
pub fn all(from: &Settings) -> Vec<Variant> {
    let mut variants = switches(from, |settings| settings);
    for sampling in SAMPLINGS {
        let text = format!("ray.sampling = '{sampling}'");
        if let Some(sampled) = changed(from, &text) {
            variants.extend(modes_of(&sampled, &text));
        }
    }
    let presets = PRESETS.iter().filter_map(|(preset, _)| preset_over(from, preset));
    variants.extend(presets.flat_map(|variant| modes_of(&variant.settings, &variant.name)));
    variants
        .extend(CHOICES.iter().filter_map(|text| Some(Variant::new(text.replace('\n', ", "), changed(from, text)?))));
    variants
}

fn modes_of(from: &Settings, name: &str) -> Vec<Variant> {
    let of = |mode: Mode| {
        let mut settings = from.clone();
        settings.set_mode(mode);
        Variant::new(format!("{name}, mode {}", mode.name()), settings)
    };
    Mode::ALL.into_iter().map(of).collect()
}

fn preset_over(from: &Settings, preset: &str) -> Option<Variant> {
    let mut layers = Layers::of(from)?;
    layers.preset(preset).ok()?;
    let mut settings = layers.finish().ok()?;
    // The window decides, not the preset.
    settings.picture.size = from.picture.size;
    Some(Variant::new(format!("preset {preset}"), settings))
}

fn changed(from: &Settings, text: &str) -> Option<Settings> {
    let mut layers = Layers::of(from)?;
    layers.table("variant", toml::from_str(text).ok()?, Path::new("")).ok()?;
    layers.finish().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A choice whose setting was renamed would be left out without a word.
    #[test]
    fn no_variant_is_lost_and_each_differs_from_the_start() {
        let from = Settings::default();
        let variants = all(&from);
        let count = switches(&from, |s| s).len()
            + SAMPLINGS.len() * Mode::ALL.len()
            + PRESETS.len() * Mode::ALL.len()
            + CHOICES.len();
        assert_eq!(variants.len(), count);
        let of_choices = &variants[count - CHOICES.len()..];
        for variant in of_choices {
            assert_ne!(variant.settings, from, "{} changes nothing", variant.name);
        }
        let names: std::collections::BTreeSet<_> = variants.iter().map(|v| &v.name).collect();
        assert_eq!(names.len(), variants.len(), "two of the same name");
    }

    #[test]
    fn every_mode_and_layout_is_among_the_switches() {
        let from = Settings { layout: Layout::Pair, ..Settings::default() };
        let variants = switches(&from, |s| s);
        assert_eq!(variants[0].settings, from);
        for mode in Mode::ALL {
            let layouts: Vec<Layout> =
                variants[1..].iter().filter(|v| v.settings.mode == mode).map(|v| v.settings.layout).collect();
            assert!(layouts.contains(&Layout::Single), "{mode:?}: {layouts:?}");
            for layout in [Layout::Four, Layout::Beside] {
                assert_eq!(layouts.contains(&layout), !mode.is_flat(), "{mode:?}: {layouts:?}");
            }
        }
    }
}
