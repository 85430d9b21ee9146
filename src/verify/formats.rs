//! What the device does with every format, what that makes fall back to what, and that everything which may fall back still gives
//! the picture of the f64 reference.

use super::built_in::{BYTES, scene, wall, wobbler};
use super::failing::count;
use super::isolated_context::IsolatedContext;
use super::{Bench, Check, Found, drawn, modes, shown};
use crate::gpu::{Context, GpuError, RendererOptions, TexelAccess, formats};
use crate::passes::slots::Format;
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::plan::Plan;
use crate::probe::Geometry;
use crate::reference;
use crate::scene::{Sampling, Scene};
use crate::verify::report::{Fault, Figure, Level, Shown, Unit};
use std::sync::Arc;

/// Volume formats, and how far a picture may be off: levels on average and at most. The largest of a ray is off by half a step of the
/// format, by what a filter's 8 bits round between neighbours, and by half a level of the picture.
const VOLUMES: [(&str, f64, f64); 4] = [("r8", 0.6, 3.0), ("r16", 0.4, 2.0), ("r16f", 0.4, 2.0), ("r32f", 0.4, 2.0)];

pub fn checks(_: Level) -> Vec<Check> {
    let mut checks = vec![Check::new("formats", "uses of every format", uses)];
    for (format, mean, most) in VOLUMES {
        let name = format!("a volume in {format}");
        checks.push(Check::new("formats", name, move |bench: &mut Bench| volume(bench, format, [mean, most])));
    }
    checks.push(Check::new("formats", "what falls back", fallbacks));
    checks
}

/// What there is and what is missing, as notes; what some scene cannot do without, as faults.
fn uses(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, context) = (Found::default(), &bench.context);
    for of in formats::format_support(context) {
        let [columns, rows, edge] = of.max_extent;
        let missing =
            if of.unsupported.is_empty() { String::new() } else { format!("; not {}", of.unsupported.join(", ")) };
        let can = of.supported.join(", ");
        found.notes.push(format!("{}: {can}{missing}; {columns}x{rows}, {edge}^3", of.format));
    }
    let fetch = TexelAccess::for_device(&context.candidate);
    found.notes.push(format!("{}; automatic sampling: {}", fetch.describe(), fetch.sampling().words()));
    found.notes.push(format!(
        "{} queues; time stamps of {} bits, {} ns a tick",
        context.queue_count(),
        context.candidate.valid_bits(),
        context.limits.timestamp_period
    ));
    found.notes.extend(context.candidate.missing_optional.iter().map(|what| format!("without {what}")));
    let scenes = bench.scenes();
    let mut refused = Vec::new();
    for (name, scene) in scenes.iter() {
        let scene = formats::adapt_scene(context, fetch, scene.clone());
        let fits = formats::check(context, &Plan::new(&scene), &scene);
        refused.extend(fits.err().map(|error| format!("'{name}': {error}")));
    }
    found.figures.push(count("scenes", scenes.len()));
    found.figures.push(Figure::error("scenes refused", refused.len() as f64, 0.0, Unit::Count));
    found.faults.extend(refused.into_iter().take(4).map(Fault::new));
    Ok(found)
}

fn small(mode: &str, format: &str, ray: &str) -> Result<Scene, GpuError> {
    let toml = format!(
        "mode = '{mode}'\npicture = {{ size = [40, 36] }}\ncamera = {{ azimuth = 20, elevation = -15 }}\n\
         slices = {{ pixels = 64, format = '{format}', still = true }}\nray = {{ step = 0.4, early_end = 0.0, {ray} }}"
    );
    scene(Geometry::Sweep(wobbler()), BYTES, &toml).map_err(GpuError::Broken)
}

/// A picture by the f64 reference, of frames as they are stored.
pub fn reference(scene: &Scene, frames: &[Texels]) -> Picture {
    let format = Slot::Frames.format(scene);
    let stored: Vec<_> = frames.iter().map(|f| Texels::decode(f.size, format, &f.encode(format))).collect();
    let screen = reference::render(scene, &stored).remove(&Slot::Screen);
    let screen = screen.unwrap_or_else(|| Texels::untouched([0; 3], 4));
    Picture { width: screen.size[0] as u32, height: screen.size[1] as u32, rgba: screen.encode(Format::Rgba8) }
}

/// Mean and largest difference, levels. A ray along the border of what was seen may fall on either side: of the largest hundredth of
/// all values the least counts.
fn apart(a: &Picture, b: &Picture) -> [f64; 2] {
    let mut apart: Vec<u8> = a.rgba.iter().zip(&b.rgba).map(|(a, b)| a.abs_diff(*b)).collect();
    apart.sort_unstable();
    let mean = apart.iter().map(|d| f64::from(*d)).sum::<f64>() / apart.len().max(1) as f64;
    let most = apart.get(apart.len() - 1 - apart.len() / 100).copied().map_or(f64::NAN, f64::from);
    [mean, most]
}

/// The largest of what was seen so far.
#[derive(Default)]
pub struct Largest {
    pictures: usize,
    apart: [f64; 2],
}

impl Largest {
    /// Adds a fault where a picture is further off than allowed.
    pub fn add(&mut self, found: &mut Found, what: &str, expected: &Picture, got: &Picture, allowed: [f64; 2]) {
        let is = apart(expected, got);
        self.pictures += 1;
        self.apart = [self.apart[0].max(is[0]), self.apart[1].max(is[1])];
        if is[0] <= allowed[0] && is[1] <= allowed[1] {
            return;
        }
        let fault = Some(found.faults.len());
        found.pictures.push(Shown { fault, ..shown::pictures(what, expected, got) });
        let [mean, most] = is;
        let said = format!("{what}: {mean:.2} levels off on average, {most} at most");
        found.faults.push(Fault { worst: Some(modes::apart(expected, got).worst), ..Fault::new(said) });
    }

    fn tell(&self, found: &mut Found, [mean, most]: [f64; 2]) {
        found.figures.push(count("pictures compared", self.pictures));
        found.figures.push(Figure::error("mean difference", self.apart[0], mean, Unit::Levels));
        found.figures.push(Figure::error("largest difference", self.apart[1], most, Unit::Levels));
    }
}

/// A volume in one format, by every way to sample it and to read its texels.
fn volume(bench: &mut Bench, format: &str, allowed: [f64; 2]) -> Result<Found, GpuError> {
    let (mut found, mut largest) = (Found::default(), Largest::default());
    let modes: &[&str] = if bench.level == Level::Quick { &["mip"] } else { &["mip", "vr", "mean", "sr"] };
    for mode in modes {
        let exact = small(mode, format, "sampling = 'exact'")?;
        let frames = wall(&exact, 0);
        let expected = reference(&exact, &frames);
        for sampling in ["hardware", "exact", "quads"] {
            let scene = small(mode, format, &format!("sampling = '{sampling}'"))?;
            for fetch in [TexelAccess::Textures, TexelAccess::Storage] {
                let what = format!("{mode} in {format}, {sampling}, {}", fetch.describe());
                let options = RendererOptions { texel_access: Some(fetch), ..RendererOptions::default() };
                match drawn::sent(&bench.context, &scene, &frames, &options) {
                    Ok(mut renderer) => largest.add(&mut found, &what, &expected, &renderer.picture()?, allowed),
                    // It was asked for, so nothing else is taken instead.
                    Err(error @ GpuError::Format { .. }) => found.notes.push(format!("{what}: refused, {error}")),
                    Err(error) => return Err(error),
                }
            }
        }
    }
    largest.tell(&mut found, allowed);
    Ok(found)
}

/// What a device may lack, what is drawn on it then, and what that must fall back to.
struct Lack {
    name: &'static str,
    change: fn(&mut Context),
    options: RendererOptions,
    sampling: Option<Sampling>,
}

fn lacks() -> Vec<Lack> {
    let plain = RendererOptions::default;
    let reading = |fetch| RendererOptions { texel_access: Some(fetch), ..RendererOptions::default() };
    let of = |name, change, options, sampling| Lack { name, change, options, sampling };
    vec![
        of("no filter", formats::disable_linear_filter, reading(TexelAccess::Textures), Some(Sampling::Exact)),
        // The largest allocation holds the volume, and not four times as much.
        of(
            "no room for quads",
            |c| c.candidate.max_bytes = 80 << 10,
            reading(TexelAccess::Storage),
            Some(Sampling::Exact),
        ),
        of("no tables as texels", |c| c.limits.max_texel_buffer_elements = 0, reading(TexelAccess::Storage), None),
        of("small tables as texels", |c| c.limits.max_texel_buffer_elements = 300, reading(TexelAccess::Storage), None),
        of("texels by texelFetch", |_| (), reading(TexelAccess::Textures), None),
        of("texels by imageLoad", |_| (), reading(TexelAccess::Storage), None),
        of("no pushed descriptors", |c| c.push_descriptor = None, plain(), None),
        of("one queue", |_| (), RendererOptions { queues: Some(1), ..plain() }, None),
        of("parameters 4096 bytes apart", |c| c.limits.min_uniform_buffer_offset_alignment = 4096, plain(), None),
        of("no time stamps", |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = 0), plain(), None),
        of("no counts", |c| c.candidate.pipeline_statistics = false, RendererOptions { spans: true, ..plain() }, None),
        of(
            "no clock in common",
            |c| c.candidate.calibrated_timestamps = false,
            RendererOptions { spans: true, ..plain() },
            None,
        ),
    ]
}

fn fallbacks(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut largest, allowed) = (Found::default(), Largest::default(), [0.6, 3.0]);
    let modes = ["mip", "sr", "vr"].map(|mode| small(mode, "r8", "sampling = 'auto'"));
    let mut scenes: Vec<(Scene, Vec<Texels>, Picture)> = Vec::new();
    for scene in modes {
        let scene = scene?;
        let frames = wall(&scene, 0);
        let expected = reference(&scene, &frames);
        scenes.push((scene, frames, expected));
    }
    for lack in lacks() {
        let aside = IsolatedContext::lacking(bench, lack.change)?;
        let context: &Arc<Context> = &aside.context;
        let mut took = String::new();
        for (scene, frames, expected) in &scenes {
            let mut renderer = drawn::sent(context, scene, frames, &lack.options)?;
            let picture = renderer.picture()?;
            let what = format!("{}, mode {:?}", lack.name, scene.settings.mode);
            largest.add(&mut found, &what, expected, &picture, allowed);
            let sampling = renderer.scene().sampling;
            found.expect(lack.sampling.is_none_or(|expected| expected == sampling), || {
                format!("{what}: samples are taken {}", sampling.words())
            });
            took = format!("samples {}, {}", sampling.words(), renderer.texel_access().describe());
        }
        found.notes.push(format!("{}: {took}", lack.name));
        aside.tell(&mut found);
    }
    largest.tell(&mut found, allowed);
    Ok(found)
}
