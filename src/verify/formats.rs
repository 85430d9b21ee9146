//! Group "formats": the device's support of every format. Every fallback must still render the picture of the f64 reference.

use super::built_in::{BYTES, scene, wall, wobbler};
use super::compare::{count_figure, picture_comparison, picture_difference};
use super::render::stored_reference_picture;
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::{Context, GpuError, RendererOptions, TexelAccess, formats};
use crate::passes::Texels;
use crate::picture::Picture;
use crate::plan::Plan;
use crate::probe::Geometry;
use crate::report::{Fault, Figure, Level, Unit};
use crate::scene::{Sampling, Scene};
use std::sync::Arc;

/// Volume formats with the allowed difference of a picture, levels: mean and maximum. A maximum projection differs by half a step of the
/// format, by the rounding of 8-bit filter weights between neighbours, and by half a level of the picture.
const VOLUMES: [(&str, f64, f64); 4] = [("r8", 0.6, 3.0), ("r16", 0.4, 2.0), ("r16f", 0.4, 2.0), ("r32f", 0.4, 2.0)];

pub fn checks(_: Level) -> Vec<Check> {
    let mut checks = vec![Check::new("formats", "uses of every format", uses)];
    for (format, mean, most) in VOLUMES {
        let name = format!("a volume in {format}");
        checks.push(Check::new("formats", name, move |dut: &mut DeviceUnderTest| volume(dut, format, [mean, most])));
    }
    checks.push(Check::new("formats", "what falls back", fallbacks));
    checks
}

/// Lists supported and missing features as notes; features that a built-in scene needs and that are missing are faults.
fn uses(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, context) = (Findings::default(), &dut.context);
    for of in formats::format_support(context) {
        let [columns, rows, edge] = of.max_extent;
        let missing =
            if of.unsupported.is_empty() { String::new() } else { format!("; not {}", of.unsupported.join(", ")) };
        let can = of.supported.join(", ");
        findings.notes.push(format!("{}: {can}{missing}; {columns}x{rows}, {edge}^3", of.format));
    }
    let fetch = TexelAccess::for_device(&context.candidate);
    findings.notes.push(format!("{}; automatic sampling: {}", fetch.describe(), fetch.sampling().words()));
    findings.notes.push(format!(
        "{} queues; time stamps of {} bits, {} ns a tick",
        context.queue_count(),
        context.candidate.valid_bits(),
        context.candidate.limits.timestamp_period
    ));
    findings.notes.extend(context.candidate.missing_optional.iter().map(|what| format!("without {what}")));
    let scenes = dut.scenes();
    let mut refused = Vec::new();
    for (name, scene) in scenes.iter() {
        let scene = formats::adapt_scene(context, fetch, scene.clone());
        let fits = formats::check(context, &Plan::new(&scene), &scene);
        refused.extend(fits.err().map(|error| format!("'{name}': {error}")));
    }
    findings.figures.push(count_figure("scenes", scenes.len()));
    findings.figures.push(Figure::error("scenes refused", refused.len() as f64, 0.0, Unit::Count));
    findings.faults.extend(refused.into_iter().take(4).map(Fault::new));
    Ok(findings)
}

fn small(mode: &str, format: &str, ray: &str) -> Result<Scene, GpuError> {
    let toml = format!(
        "mode = '{mode}'\npicture = {{ size = [40, 36] }}\ncamera = {{ azimuth = 20, elevation = -15 }}\n\
         slices = {{ pixels = 64, format = '{format}', still = true }}\nray = {{ step = 0.4, early_end = 0.0, {ray} }}"
    );
    scene(Geometry::Sweep(wobbler()), BYTES, &toml).map_err(GpuError::Broken)
}

/// Mean and 99th percentile of the difference, levels. Rays along the border of the sweep may fall on either side, so the largest
/// hundredth of the values does not count.
fn difference(a: &Picture, b: &Picture) -> [f64; 2] {
    let mut apart: Vec<u8> = a.rgba.iter().zip(&b.rgba).map(|(a, b)| a.abs_diff(*b)).collect();
    apart.sort_unstable();
    let mean = apart.iter().map(|d| f64::from(*d)).sum::<f64>() / apart.len().max(1) as f64;
    let most = apart.get(apart.len() - 1 - apart.len() / 100).copied().map_or(f64::NAN, f64::from);
    [mean, most]
}

/// The largest of the mean differences of all compared pictures, and the largest of the 99th percentiles of their differences, levels of 8 bits.
#[derive(Default)]
pub struct LargestDifference {
    pictures: usize,
    apart: [f64; 2],
}

impl LargestDifference {
    /// Compares a picture with the expected one, and adds a fault if it differs by more than `allowed`: the mean and the 99th percentile of the
    /// differences of channel values, levels of 8 bits. `what`: description of the comparison.
    pub fn add(&mut self, findings: &mut Findings, what: &str, expected: &Picture, got: &Picture, allowed: [f64; 2]) {
        let is = difference(expected, got);
        self.pictures += 1;
        self.apart = [self.apart[0].max(is[0]), self.apart[1].max(is[1])];
        if is[0] <= allowed[0] && is[1] <= allowed[1] {
            return;
        }
        let [mean, most] = is;
        let said = format!("{what}: {mean:.2} levels off on average, 99 % of values by {most} at most");
        let fault = Fault { worst: Some(picture_difference(expected, got).worst), ..Fault::new(said) };
        findings.add_shown(fault, picture_comparison(what, expected, got));
    }

    fn add_figures(&self, findings: &mut Findings, [mean, most]: [f64; 2]) {
        findings.figures.push(count_figure("pictures compared", self.pictures));
        findings.figures.push(Figure::error("mean difference", self.apart[0], mean, Unit::Levels));
        findings.figures.push(Figure::error("99th percentile of the differences", self.apart[1], most, Unit::Levels));
    }
}

/// A volume in one format, with every kind of sampling and texel fetch.
fn volume(dut: &mut DeviceUnderTest, format: &str, allowed: [f64; 2]) -> Result<Findings, GpuError> {
    let (mut findings, mut largest) = (Findings::default(), LargestDifference::default());
    let modes: &[&str] = if dut.level == Level::Quick { &["mip"] } else { &["mip", "vr", "mean", "sr"] };
    for mode in modes {
        let exact = small(mode, format, "sampling = 'exact'")?;
        let frames = wall(&exact, 0);
        let expected = stored_reference_picture(&exact, &frames);
        for sampling in ["hardware", "exact", "quads"] {
            let scene = small(mode, format, &format!("sampling = '{sampling}'"))?;
            for fetch in [TexelAccess::Textures, TexelAccess::Storage] {
                let what = format!("{mode} in {format}, {sampling}, {}", fetch.describe());
                let options = RendererOptions { texel_access: Some(fetch), ..RendererOptions::default() };
                match render::sent(&dut.context, &scene, &frames, &options) {
                    Ok(mut renderer) => largest.add(&mut findings, &what, &expected, &renderer.picture()?, allowed),
                    // The fetch was requested explicitly, so there is no fallback.
                    Err(error @ GpuError::Format { .. }) => findings.notes.push(format!("{what}: refused, {error}")),
                    Err(error) => return Err(error),
                }
            }
        }
    }
    largest.add_figures(&mut findings, allowed);
    Ok(findings)
}

/// A feature that a device may lack, the options to render with, and the sampling that must be used instead.
struct MissingFeature {
    name: &'static str,
    change: fn(&mut Context),
    options: RendererOptions,
    sampling: Option<Sampling>,
    /// Entries of the lookup tables with which it is drawn again, one after the other.
    tables: &'static [u32],
}

fn missing_features() -> Vec<MissingFeature> {
    let plain = RendererOptions::default;
    let reading = |fetch| RendererOptions { texel_access: Some(fetch), ..plain() };
    let (textures, storage) = (|| reading(TexelAccess::Textures), || reading(TexelAccess::Storage));
    let spans = || RendererOptions { spans: true, ..plain() };
    let exact = Some(Sampling::Exact);
    let of = |name, change, options, sampling| MissingFeature { name, change, options, sampling, tables: &[] };
    vec![
        of("no filter", formats::disable_linear_filter, textures(), exact),
        // The maximum allocation holds the volume, but not four times as much.
        of("no room for quads", |c| c.candidate.max_allocation = 80 << 10, storage(), exact),
        of("no tables as texels", |c| c.candidate.limits.max_texel_buffer_elements = 0, storage(), None),
        MissingFeature {
            tables: &[65, 1025],
            ..of("small tables as texels", |c| c.candidate.limits.max_texel_buffer_elements = 300, storage(), None)
        },
        of("texels by texelFetch", |_| (), textures(), None),
        of("texels by imageLoad", |_| (), storage(), None),
        of("no pushed descriptors", |c| c.push_descriptor = None, plain(), None),
        of("one queue", |_| (), RendererOptions { queues: Some(1), ..plain() }, None),
        of(
            "parameters 4096 bytes apart",
            |c| c.candidate.limits.min_uniform_buffer_offset_alignment = 4096,
            plain(),
            None,
        ),
        of("no time stamps", |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = 0), plain(), None),
        of("no counts", |c| c.candidate.pipeline_statistics = false, spans(), None),
        of("no clock in common", |c| c.candidate.calibrated_timestamps = false, spans(), None),
    ]
}

fn fallbacks(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, mut largest, allowed) = (Findings::default(), LargestDifference::default(), [0.6, 3.0]);
    let mut scenes: Vec<(&str, Scene, Vec<Texels>, Picture)> = Vec::new();
    for mode in ["mip", "sr", "vr"] {
        let scene = small(mode, "r8", "sampling = 'auto'")?;
        let frames = wall(&scene, 0);
        let expected = stored_reference_picture(&scene, &frames);
        scenes.push((mode, scene, frames, expected));
    }
    for missing in missing_features() {
        let isolated = IsolatedContext::lacking(dut, missing.change)?;
        let context: &Arc<Context> = &isolated.context;
        let mut took = String::new();
        for (mode, scene, frames, expected) in &scenes {
            let mut renderer = render::sent(context, scene, frames, &missing.options)?;
            let picture = renderer.picture()?;
            let what = format!("{}, mode {:?}", missing.name, scene.settings.mode);
            largest.add(&mut findings, &what, expected, &picture, allowed);
            let sampling = renderer.scene().sampling;
            findings.expect(missing.sampling.is_none_or(|expected| expected == sampling), || {
                format!("{what}: samples are taken {}", sampling.words())
            });
            took = format!("samples {}, {}", sampling.words(), renderer.texel_access().describe());
            // Tables that fit into a texel buffer, then such that do not, by one renderer.
            for entries in missing.tables {
                let ray = format!("sampling = 'auto', slice_index = 'table', entries = {entries}");
                renderer.change(small(mode, "r8", &ray)?)?;
                render::send(&mut renderer, frames, 0)?;
                let picture = renderer.picture()?;
                largest.add(&mut findings, &format!("{what}, {entries} entries"), expected, &picture, allowed);
            }
        }
        findings.notes.push(format!("{}: {took}", missing.name));
        isolated.report_validation(&mut findings);
    }
    largest.add_figures(&mut findings, allowed);
    Ok(findings)
}
