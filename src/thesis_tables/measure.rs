//! Measures Tables 3-6 of the thesis on a device: renders the scene of every row repeatedly.

use crate::gpu::{self, Context, GpuError, Renderer};
use crate::machine;
use crate::passes::{PassTime, Slot, Stage, by_name, is_hit};
use crate::scene::{Input, Mode, Place, Scene, SceneError, Settings, Sigma, SliceGrid, Smooth};
use crate::source::{Frame, Geometry, StoredType};
use crate::thesis_tables::{Conditions, DEPTH, Filter3d, Reached, Report, Row, Table, tables};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Half the edge of the rendered region across the beam, mm: at the depth of the surfaces all of it is within the sweep.
pub const HALF_REGION: f64 = 45.0;
/// Sigma of the 2D filter, mm.
const SIGMA: f64 = 0.5;

/// How to measure the tables.
#[derive(Clone, Copy, Debug)]
pub struct TableOptions {
    /// Use smaller volumes: see [`Conditions::usual`].
    pub quick: bool,
    /// Volumes measured in each row.
    pub repeats: usize,
    /// Volumes rendered before those, not measured.
    pub warm_up: usize,
}

impl TableOptions {
    /// Total number of volumes rendered.
    pub fn volumes(&self) -> usize {
        tables(self.quick).iter().map(|t| t.rows.len()).sum::<usize>() * (self.repeats + self.warm_up)
    }
}

/// Measures every row; `after_each` is called after every volume.
///
/// # Errors
/// The device cannot hold a scene, or fails.
pub fn run(context: &Arc<Context>, options: &TableOptions, after_each: &mut dyn FnMut()) -> Result<Report, GpuError> {
    let device = machine::device(context);
    let mut tables = tables(options.quick);
    let mut sweeps: BTreeMap<usize, Vec<Frame>> = BTreeMap::new();
    for row in tables.iter().flat_map(|t| &t.rows) {
        let Conditions { frames, lines, .. } = row.conditions;
        sweeps.entry(frames).or_insert_with(|| super::sweep::frames(frames, lines));
    }
    for table in &mut tables {
        measure(context, table, &sweeps, options, after_each)?;
    }
    Ok(Report {
        device,
        program: machine::program(),
        date: machine::date(),
        quick: options.quick,
        repeats: options.repeats,
        warm_up: options.warm_up,
        tables,
        grown: Vec::new(),
    })
}

/// Measures the rows of one table, interleaved, so that other load on the machine affects them alike.
fn measure(
    context: &Arc<Context>,
    table: &mut Table,
    sweeps: &BTreeMap<usize, Vec<Frame>>,
    options: &TableOptions,
    after_each: &mut dyn FnMut(),
) -> Result<(), GpuError> {
    let mut renderers = Vec::new();
    for row in &table.rows {
        let scene = scene(&row.conditions).map_err(|e| broken(&e))?;
        renderers.push(Renderer::new(context, scene, &gpu::RendererOptions::default())?);
    }
    for n in 0..options.warm_up + options.repeats {
        for (row, renderer) in table.rows.iter_mut().zip(&mut renderers) {
            for frame in sweeps.get(&row.conditions.frames).into_iter().flatten() {
                renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
            }
            renderer.show(0)?;
            renderer.picture()?;
            let times = renderer.take_times()?;
            if n >= options.warm_up {
                add(row, &times);
            }
            after_each();
        }
    }
    for (row, renderer) in table.rows.iter_mut().zip(&mut renderers) {
        row.reached = reached(renderer)?;
    }
    Ok(())
}

/// Adds the times of a volume to a row, by stage. Copies to and from the device belong to no stage.
fn add(row: &mut Row, times: &[PassTime]) {
    // Without time stamps there are no times, rather than times of 0.
    if times.is_empty() {
        return;
    }
    let stage_time = |is_first: bool| -> f64 {
        let staged = times.iter().filter_map(|t| Some((by_name(t.name)?.stage, t.total)));
        staged.filter(|(stage, _)| (*stage == Stage::Preprocess) == is_first).map(|(_, ns)| ns).sum()
    };
    row.times.preprocess.push(stage_time(true));
    row.times.picture.push(stage_time(false));
}

fn reached(renderer: &mut Renderer) -> Result<Option<Reached>, GpuError> {
    let Some(map) = renderer.read(Slot::Distance)? else { return Ok(None) };
    // Parallel rays along the depth: all begin at the same depth.
    let scene = renderer.scene();
    let above = scene.rays.at(0.5, 0.5).0.y - scene.probe().map_or(0.0, |p| p.array_radius());
    let depths: Vec<f64> = map.values.iter().filter(|t| is_hit(**t)).map(|t| above + t).collect();
    let depth = depths.iter().sum::<f64>() / depths.len().max(1) as f64;
    Ok(Some(Reached { share: depths.len() as f64 / map.values.len().max(1) as f64, depth }))
}

fn broken(error: &SceneError) -> GpuError {
    GpuError::Broken(format!("the scene that measures: {error}"))
}

/// The scene of a row: only the filters that the conditions of the thesis name, no shadow. The coarse detector is off, so that a
/// ray takes all of its samples.
///
/// # Errors
/// None for the conditions of [`tables`].
pub fn scene(conditions: &Conditions) -> Result<Scene, SceneError> {
    let n = conditions.volume;
    let mut settings = Settings { mode: Mode::Surface, ..Settings::default() };
    settings.picture.size = [n, n];
    settings.slices.pixels = n;
    settings.region.lateral = Some([-HALF_REGION, HALF_REGION]);
    settings.region.elevation = Some([-HALF_REGION, HALF_REGION]);
    settings.region.depth = Some([0.0, DEPTH]);
    settings.ray.step = Some(DEPTH / f64::from(n));
    // The thesis takes every sample.
    settings.ray.brick = 0;
    settings.surface.rough = 1;
    settings.surface.place = Place::FirstCrossing;
    settings.distance.sigma = Some(Sigma { window: conditions.filter_2d, sigma: SIGMA, ..Sigma::default() });
    match conditions.filter_3d {
        Filter3d::None => {}
        Filter3d::Sliding(samples) => settings.ray.sliding = samples,
        Filter3d::Stored(taps) => settings.slices.smooth = Some(Smooth { kernel: Some(taps), ..Smooth::default() }),
    }
    let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
    let probe = super::sweep::probe(conditions.frames, conditions.lines);
    let (low, high) = probe.plane_bounds();
    let scene = Scene::new(Geometry::Sweep(probe), input, settings)?;
    // Pixels of slices are square by default, but a sector is wider than deep: n x n pixels are denser in depth.
    let pitch = [0, 1].map(|i| (high[i] - low[i]) / f64::from(n - 1));
    Ok(scene.on_grid(SliceGrid { size: [n, n], origin: low, pitch }))
}
