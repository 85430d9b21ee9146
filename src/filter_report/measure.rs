//! Runs every candidate on frames, as stage 1 does: the frame is scan-converted, then filtered on the device.

use super::candidates::{Candidate, candidates};
use super::quality::quality;
use super::{Areas, Rectangle, Row, Subject};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::{PassTime, Slot, Stage, by_name};
use crate::picture::Region;
use crate::scene::load::Layers;
use crate::scene::{Input, Scene};
use crate::source::phantom::{Phantom, PhantomOptions, PhantomSource, Speckle};
use crate::source::{Source, StoredType};
use crate::thesis_tables::Spread;
use std::sync::Arc;

/// Where the phantom is measured: the face against the fluid before it.
const PHANTOM: Areas = Areas {
    crop: Rectangle { lateral: [-38.0, 38.0], depth: [28.0, 98.0] },
    region: Rectangle { lateral: [-18.0, 8.0], depth: [57.0, 64.0] },
    background: Rectangle { lateral: [-15.0, 15.0], depth: [32.0, 42.0] },
};

/// What to measure, and how.
#[derive(Clone, Copy, Debug)]
pub struct Effort<'a> {
    /// Part of the names of the filters; empty for all.
    pub only: &'a str,
    /// Pixels along the longer edge of a slice.
    pub pixels: u32,
    /// Times measured for each row.
    pub repeats: usize,
}

/// Why a frame cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// What the caller gave cannot be used.
    #[error("{0}")]
    Input(String),
    #[error("{0}")]
    Gpu(#[from] GpuError),
}

/// Measures all candidates on the middle frame of the phantom, whose mean over all speckle is known.
///
/// # Errors
/// The device fails.
pub fn phantom(
    context: &Arc<Context>,
    effort: Effort<'_>,
    after_each: &mut dyn FnMut(),
) -> Result<Subject, MeasureError> {
    let source = |speckle| {
        let options = PhantomOptions { speckle, ..PhantomOptions::default() };
        Phantom::new(options).map(PhantomSource::new).map_err(|e| MeasureError::Input(e.to_string()))
    };
    let mut subject = recording(context, &mut source(Speckle::Random)?, "phantom", PHANTOM, effort, after_each)?;
    let mut bare = Middle::new(context, &mut source(Speckle::Mean)?, PHANTOM, effort.pixels)?;
    let clean = bare.filtered(context, &Candidate::none())?.0;
    for row in &mut subject.rows {
        row.quality = quality(&row.pixels, Some(&clean), subject.size, bare.levels());
    }
    subject.clean = Some(clean);
    Ok(subject)
}

/// Measures all candidates on the middle frame of a recording's first volume.
///
/// # Errors
/// An area lies outside of the sector, or is empty; the recording cannot be read; the device fails.
pub fn recording(
    context: &Arc<Context>,
    source: &mut dyn Source,
    name: &str,
    areas: Areas,
    effort: Effort<'_>,
    after_each: &mut dyn FnMut(),
) -> Result<Subject, MeasureError> {
    let mut middle = Middle::new(context, source, areas, effort.pixels)?;
    let mut rows: Vec<Row> = Vec::new();
    let mut before: Vec<&'static str> = Vec::new();
    for candidate in candidates(middle.scene.grid.pitch, effort.only) {
        let (mut times, mut pixels) = (Vec::new(), Vec::new());
        // The first one warms up.
        for n in 0..=effort.repeats {
            let (values, passes) = middle.filtered(context, &candidate)?;
            if rows.is_empty() {
                before = passes.iter().map(|p| p.name).collect();
            }
            if n > 0 {
                times.extend(time_of_filter(&passes, &before));
            }
            pixels = values;
        }
        let quality = quality(&pixels, None, middle.size(), middle.levels());
        rows.push(Row { candidate, quality, time: Spread::new(&times), pixels });
        after_each();
    }
    Ok(Subject { name: name.into(), areas, frame: middle.frame, size: middle.size(), clean: None, rows })
}

/// Number of candidates with `only` in their names, no filter among them.
pub fn count(only: &str) -> usize {
    candidates([1.0; 2], only).len()
}

/// Time of the passes of stage 1 that no filter does without, ns.
fn time_of_filter(passes: &[PassTime], before: &[&str]) -> Option<f64> {
    let filters = passes
        .iter()
        .filter(|p| by_name(p.name).is_some_and(|pass| pass.stage == Stage::Preprocess) && !before.contains(&p.name));
    filters.map(|p| p.total).reduce(|a, b| a + b)
}

/// A part of a slice, first and last but one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    at: [usize; 2],
    size: [usize; 2],
}

/// The middle frame of a volume, and where it is measured.
struct Middle {
    scene: Scene,
    frame: usize,
    bytes: Vec<u8>,
    crop: Window,
    /// Tissue and background, relative to the crop.
    levels: [Region; 2],
    renderer: Option<Renderer>,
}

impl Middle {
    fn new(context: &Arc<Context>, source: &mut dyn Source, areas: Areas, pixels: u32) -> Result<Middle, MeasureError> {
        let input = |e: String| MeasureError::Input(e);
        let geometry = source.geometry(0);
        let samples = Input { stored: source.stored_type(), range: source.range() };
        let middle = geometry.slices() / 2;
        source.skip_to_volume(0).map_err(|e| input(e.to_string()))?;
        let mut bytes = None;
        while let Some(frame) = source.next_frame().map_err(|e| input(e.to_string()))? {
            if frame.volume > 0 {
                break;
            }
            if frame.slice == middle {
                bytes = Some(frame.bytes);
                break;
            }
        }
        let bytes = bytes.ok_or_else(|| input(format!("has no frame {middle}")))?;
        let scene_of = |more: &[String]| {
            let settings = settings(pixels, more).map_err(input)?;
            Scene::new(geometry.clone(), samples, settings).map_err(|e| input(e.to_string()))
        };
        let scene = scene_of(&[])?;
        let window = |what: &str, r: Rectangle| {
            let set = [format!("region.lateral={:?}", r.lateral), format!("region.depth={:?}", r.depth)];
            let cut = scene_of(&set)?;
            window(what, &scene, &cut)
        };
        let crop = window("crop", areas.crop)?;
        let [tissue, behind] = [("region", areas.region), ("background", areas.background)]
            .map(|(what, area)| window(what, area).and_then(|w| within(what, w, crop)));
        let mut made = Middle { scene, frame: middle, bytes, crop, levels: [tissue?, behind?], renderer: None };
        made.check_crop(context)?;
        Ok(made)
    }

    fn size(&self) -> [usize; 2] {
        self.crop.size
    }

    fn levels(&self) -> [&Region; 2] {
        let [tissue, behind] = &self.levels;
        [tissue, behind]
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
            None => self.renderer.insert(Renderer::new(context, scene, &RendererOptions::default())?),
            Some(renderer) => {
                renderer.change(scene)?;
                renderer
            }
        };
        renderer.frame(self.frame as u32, bytes, 0)?;
        let volume = renderer.read(Slot::Volume)?;
        let volume = volume.ok_or_else(|| GpuError::Broken("slot 'volume' is not in the plan".into()))?;
        let [width, height, _] = volume.size;
        let row = |y: usize| {
            let first = (self.frame * height + self.crop.at[1] + y) * width + self.crop.at[0];
            volume.values[first..first + self.crop.size[0]].iter().copied()
        };
        let crop = (0..self.crop.size[1]).flat_map(row).collect();
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
fn window(what: &str, scene: &Scene, cut: &Scene) -> Result<Window, MeasureError> {
    let pixel = |axis: usize, place: f64| (place - scene.grid.origin[axis]) / scene.grid.pitch[axis];
    let mut window = Window { at: [0; 2], size: [0; 2] };
    for axis in 0..2 {
        let first = pixel(axis, cut.low[axis]).ceil().max(0.0) as usize;
        let end = (pixel(axis, cut.high[axis]).floor() as usize + 1).min(scene.grid.size[axis] as usize);
        if end < first + 4 {
            return Err(MeasureError::Input(format!("{what}: is less than 4 pixels wide")));
        }
        window.at[axis] = first;
        window.size[axis] = end - first;
    }
    Ok(window)
}

fn within(what: &str, area: Window, crop: Window) -> Result<Region, MeasureError> {
    let is_inside = (0..2).all(|a| area.at[a] >= crop.at[a] && area.at[a] + area.size[a] <= crop.at[a] + crop.size[a]);
    if !is_inside {
        return Err(MeasureError::Input(format!("{what}: reaches beyond the crop")));
    }
    Ok(Region { at: [0, 1].map(|a| (area.at[a] - crop.at[a]) as u32), size: area.size.map(|n| n as u32) })
}
