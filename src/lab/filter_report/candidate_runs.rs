//! Runs every candidate on frames in the way of stage 1: the frame is scan-converted, then filtered on the device.

use super::candidates::{Candidate, candidates};
use super::quality::quality;
use super::{Area, Areas, Row, Subject};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, TimeStamps};
use crate::passes::{PassTime, Slot, Stage, by_name};
use crate::picture::Region;
use crate::scene::load::Layers;
use crate::scene::{Input, Scene};
use crate::source::phantom::{Phantom, PhantomOptions, PhantomSource, Speckle};
use crate::source::{Source, StoredType, VolumeFrames};
use crate::thesis_tables::Spread;
use std::sync::Arc;

/// Where the phantom is measured: the face against the fluid before it.
const PHANTOM: Areas = Areas {
    crop: Area { lateral: [-38.0, 38.0], depth: [28.0, 98.0] },
    region: Area { lateral: [-18.0, 8.0], depth: [57.0, 64.0] },
    background: Area { lateral: [-15.0, 15.0], depth: [32.0, 42.0] },
};

/// What a measurement of filters covers.
#[derive(Clone, Copy, Debug)]
pub struct MeasureOptions<'a> {
    /// Only filters whose names contain this text are measured, and always "no filter". Empty for all filters.
    pub only: &'a str,
    /// Pixels along the longer edge of a slice, 2..=4096. A Cartesian volume keeps its voxels.
    pub pixels: u32,
    /// Number of time measurements for each candidate.
    pub repeats: usize,
}

/// Why a frame cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// An option or input cannot be used.
    #[error("{0}")]
    Input(String),
    #[error("{0}")]
    Gpu(#[from] GpuError),
}

/// Measures the candidates that `options` selects on the middle frame of the phantom, whose mean over all speckle (the clean frame) is known.
/// `after_each` is called after each candidate.
///
/// # Errors
/// `options.pixels` is out of its range or too small for the measured areas, or the device fails.
pub fn phantom(
    context: &Arc<Context>,
    options: MeasureOptions<'_>,
    after_each: &mut dyn FnMut(),
) -> Result<Subject, MeasureError> {
    let source = |speckle| {
        let options = PhantomOptions { speckle, ..PhantomOptions::default() };
        Phantom::new(options).map(PhantomSource::new).map_err(|e| MeasureError::Input(e.to_string()))
    };
    let speckled = Middle::new(context, &mut source(Speckle::Random)?, PHANTOM, options.pixels)?;
    let mut subject = recording(context, speckled, "phantom", options, after_each)?;
    let mut bare = Middle::new(context, &mut source(Speckle::Mean)?, PHANTOM, options.pixels)?;
    let clean = bare.filtered(context, &Candidate::none())?.0;
    for row in &mut subject.rows {
        row.quality = quality(&row.pixels, Some(&clean), subject.size, bare.levels.each_ref());
    }
    subject.clean = Some(clean);
    Ok(subject)
}

/// Measures the candidates that `options` selects on the middle frame of a recording's first volume. `name`: that of the recording, for the result.
/// `after_each` is called after each candidate.
///
/// # Errors
/// The device fails.
pub fn recording(
    context: &Arc<Context>,
    mut middle: Middle,
    name: &str,
    options: MeasureOptions<'_>,
    after_each: &mut dyn FnMut(),
) -> Result<Subject, MeasureError> {
    let mut rows: Vec<Row> = Vec::new();
    let mut before: Vec<&'static str> = Vec::new();
    for candidate in candidates(middle.scene.grid.pitch, options.only) {
        let (mut times, mut pixels) = (Vec::new(), Vec::new());
        // The first one warms up.
        for n in 0..=options.repeats {
            let (values, passes) = middle.filtered(context, &candidate)?;
            if rows.is_empty() {
                before = passes.iter().map(|p| p.name).collect();
            }
            if n > 0 {
                times.extend(time_of_filter(&passes, &before));
            }
            pixels = values;
        }
        let quality = quality(&pixels, None, middle.size(), middle.levels.each_ref());
        rows.push(Row { candidate, quality, time: Spread::new(&times), pixels });
        after_each();
    }
    Ok(Subject { name: name.into(), areas: middle.areas, frame: middle.frame, size: middle.size(), clean: None, rows })
}

/// Number of candidates: "no filter", and those whose filter's name contains `only`.
pub fn count(only: &str) -> usize {
    candidates([1.0; 2], only).len()
}

/// Time of the passes of stage 1 that do not run without a filter (`before`), ns.
fn time_of_filter(passes: &[PassTime], before: &[&str]) -> Option<f64> {
    let filters = passes
        .iter()
        .filter(|p| by_name(p.name).is_some_and(|pass| pass.stage == Stage::Preprocess) && !before.contains(&p.name));
    filters.map(|p| p.total).reduce(|a, b| a + b)
}

/// The middle frame of a recording's first volume, and where it is measured.
pub struct Middle {
    areas: Areas,
    scene: Scene,
    frame: usize,
    bytes: Vec<u8>,
    /// Pixels of the slice.
    crop: Region,
    /// Tissue and background, relative to the crop.
    levels: [Region; 2],
    renderer: Option<Renderer>,
}

impl Middle {
    /// Reads the frame and checks the areas. `pixels`: as in [`MeasureOptions`].
    ///
    /// # Errors
    /// `pixels` is out of its range. An area is no valid region or is less than 4 pixels wide or high, the crop reaches beyond the sector, or
    /// another area beyond the crop. The recording cannot be read or lacks the frame, or the device fails.
    pub fn new(
        context: &Arc<Context>,
        source: &mut dyn Source,
        areas: Areas,
        pixels: u32,
    ) -> Result<Middle, MeasureError> {
        let input = |e: String| MeasureError::Input(e);
        let geometry = source.geometry(0);
        let samples = Input { stored: source.stored_type(), range: source.range() };
        let middle = geometry.slices() / 2;
        let mut frames = VolumeFrames::of(source, 0).map_err(|e| input(e.to_string()))?;
        let bytes = loop {
            match frames.read().map_err(|e| input(e.to_string()))? {
                Some(frame) if frame.slice == middle => break frame.bytes,
                Some(_) => {}
                None => return Err(input(format!("has no frame {middle}"))),
            }
        };
        let scene_of = |more: &[String]| {
            let settings = settings(pixels, more).map_err(input)?;
            Scene::new(geometry.clone(), samples, settings).map_err(|e| input(e.to_string()))
        };
        let scene = scene_of(&[])?;
        let pixels_of = |what: &str, area: Area| {
            let set = [format!("region.lateral={:?}", area.lateral), format!("region.depth={:?}", area.depth)];
            pixels_within(what, &scene, &scene_of(&set)?)
        };
        let crop = pixels_of("crop", areas.crop)?;
        let [tissue, behind] = [("region", areas.region), ("background", areas.background)]
            .map(|(what, area)| pixels_of(what, area).and_then(|region| within(what, region, crop)));
        let mut made = Middle { areas, scene, frame: middle, bytes, crop, levels: [tissue?, behind?], renderer: None };
        made.check_crop(context)?;
        // It would keep its memory until the recordings before this one are measured.
        made.renderer = None;
        Ok(made)
    }

    fn size(&self) -> [usize; 2] {
        self.crop.size.map(|n| n as usize)
    }

    /// The crop after the filters of a candidate, and the times of all passes.
    fn filtered(
        &mut self,
        context: &Arc<Context>,
        candidate: &Candidate,
    ) -> Result<(Vec<f64>, Vec<PassTime>), MeasureError> {
        let pixels = self.scene.settings.slices.pixels;
        let settings = settings(pixels, &candidate.set).map_err(MeasureError::Input)?;
        let scene = Scene::new(self.scene.geometry.clone(), self.scene.input, settings)
            .map_err(|e| MeasureError::Input(e.to_string()))?;
        let bytes = std::mem::take(&mut self.bytes);
        let made = self.run(context, scene, &bytes);
        self.bytes = bytes;
        made
    }

    fn run(
        &mut self,
        context: &Arc<Context>,
        scene: Scene,
        bytes: &[u8],
    ) -> Result<(Vec<f64>, Vec<PassTime>), MeasureError> {
        let renderer: &mut Renderer = match &mut self.renderer {
            None => {
                let options = RendererOptions { time_stamps: TimeStamps::EachPass, ..RendererOptions::default() };
                self.renderer.insert(Renderer::new(context, scene, &options)?)
            }
            Some(renderer) => {
                renderer.change(scene)?;
                renderer
            }
        };
        renderer.frame(self.frame as u32, bytes, 0)?;
        let volume = renderer.read(Slot::Volume)?;
        let volume = volume.ok_or_else(|| GpuError::Broken("slot 'volume' is not in the plan".into()))?;
        let [width, height, _] = volume.size;
        let [[left, top], [columns, rows]] = [self.crop.at, self.crop.size].map(|pair| pair.map(|n| n as usize));
        let row = |y: usize| {
            let first = (self.frame * height + top + y) * width + left;
            volume.values[first..first + columns].iter().copied()
        };
        let crop = (0..rows).flat_map(row).collect();
        Ok((crop, renderer.take_times()?))
    }

    /// Refuses a crop that reaches beyond the sector: white samples everywhere must leave it white.
    fn check_crop(&mut self, context: &Arc<Context>) -> Result<(), MeasureError> {
        let Input { stored, range: [_, white] } = self.scene.input;
        let sample: &[u8] = match stored {
            StoredType::U8 => &[white as u8],
            StoredType::U16 => &(white as u16).to_le_bytes(),
            StoredType::F32 => &(white as f32).to_le_bytes(),
        };
        let white = sample.repeat(self.bytes.len() / stored.bytes());
        let values = self.run(context, self.scene.clone(), &white)?.0;
        match values.iter().all(|v| *v > 0.999) {
            true => Ok(()),
            false => Err(MeasureError::Input("crop: reaches beyond the sector; give a smaller one".into())),
        }
    }
}

impl Candidate {
    fn none() -> Candidate {
        Candidate { filter: "none", label: String::new(), set: Vec::new() }
    }
}

fn settings(pixels: u32, more: &[String]) -> Result<crate::scene::Settings, String> {
    let mut layers = Layers::default();
    let fixed = ["mode=plane", "picture.size=[1,1]", "slices.format=r32f", "slices.everything=true"];
    let fixed = fixed.map(str::to_string).into_iter().chain([format!("slices.pixels={pixels}")]);
    for set in fixed.chain(more.iter().cloned()) {
        layers.set(&set).map_err(|e| e.to_string())?;
    }
    layers.finish().map_err(|e| e.to_string())
}

/// The pixels of `scene` within the box of `cut`.
fn pixels_within(what: &str, scene: &Scene, cut: &Scene) -> Result<Region, MeasureError> {
    let pixel = |axis: usize, place: f64| (place - scene.grid.origin[axis]) / scene.grid.pitch[axis];
    let mut region = Region { at: [0; 2], size: [0; 2] };
    for axis in 0..2 {
        let first = pixel(axis, cut.low[axis]).ceil().max(0.0) as u32;
        let end = (pixel(axis, cut.high[axis]).floor() as u32 + 1).min(scene.grid.size[axis]);
        if end < first + 4 {
            return Err(MeasureError::Input(format!(
                "{what}: is less than 4 pixels wide; give a larger one, or more --pixels"
            )));
        }
        region.at[axis] = first;
        region.size[axis] = end - first;
    }
    Ok(region)
}

/// `area` relative to the crop, in which it must lie.
fn within(what: &str, area: Region, crop: Region) -> Result<Region, MeasureError> {
    let is_inside = (0..2).all(|a| area.at[a] >= crop.at[a] && area.at[a] + area.size[a] <= crop.at[a] + crop.size[a]);
    if !is_inside {
        return Err(MeasureError::Input(format!("{what}: reaches beyond the crop")));
    }
    Ok(Region { at: [0, 1].map(|a| area.at[a] - crop.at[a]), size: area.size })
}
