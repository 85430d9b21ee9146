//! Measures Tables 3-6 of the thesis on a device: renders the scene of every row repeatedly.
//!
//! The input is synthetic: a sweep with the geometry of the thesis (4.5) through a ball in front of a wall, both in dark fluid, so that
//! rays end at the depths of those of an examination. It is computed from a formula, so it is the same on every machine.

use crate::gpu::{self, Context, GpuError, Renderer};
use crate::machine;
use crate::passes::{PassTime, Slot, Stage, by_name, is_hit};
use crate::probe::{Advance, Array, Axis, Indices, Motion, Probe};
use crate::profile::timed_run::measure_ceilings;
use crate::scene::{
    Edge, EdgeName, EnhancedSigma, Input, Mode, Place, Scene, SceneError, Settings, Sigma, SliceGrid, Smooth,
    SurfaceColour,
};
use crate::source::{Frame, Geometry, StoredType};
use crate::statistics::mix;
use crate::thesis_tables::{
    Conditions, DEPTH, FAN_ANGLE, Filter3d, Reached, Report, Row, SAMPLES, SECTOR_ANGLE, SOUND_SPEED, Table, tables,
};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Half the edge of the rendered region across the beam, mm: at the depth of the surfaces all of it is within the sweep.
const HALF_REGION: f64 = 45.0;
/// Sigma of the 2D filter, mm.
const SIGMA: f64 = 0.5;
/// Of slices and of pictures, 0..1.
const SLICE_SIGMA: f64 = 0.1;
const PICTURE_SIGMA: f64 = 0.03;
/// Largest window of a growing one that starts at 9x9 (Tables 7-9), pixels.
const GROWING_TO: u32 = 21;

/// How the tables are measured.
#[derive(Clone, Copy, Debug)]
pub struct TableOptions {
    /// True: volumes and pictures are smaller, see [`Conditions::usual`].
    pub quick: bool,
    /// Number of measured volumes for each row.
    pub repeats: usize,
    /// Number of volumes for each row that are rendered first and not measured.
    pub warm_up: usize,
}

impl TableOptions {
    /// Number of volumes that are rendered for all rows, those of the warm-up included.
    pub fn volumes(&self) -> usize {
        tables(self.quick).iter().map(|t| t.rows.len()).sum::<usize>() * (self.repeats + self.warm_up)
    }
}

/// Measures every row of all tables. `after_each` is called after every rendered volume, warm-up included. `grown` of the report is left empty.
///
/// # Errors
/// The device cannot hold a scene, or fails.
pub fn run(context: &Arc<Context>, options: &TableOptions, after_each: &mut dyn FnMut()) -> Result<Report, GpuError> {
    let device = machine::device(context);
    let mut tables = tables(options.quick);
    let mut sweeps: BTreeMap<usize, Vec<Frame>> = BTreeMap::new();
    for row in tables.iter().flat_map(|t| &t.rows) {
        let Conditions { frames, lines, .. } = row.conditions;
        sweeps.entry(frames).or_insert_with(|| sweep_frames(frames, lines));
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
        copy: measure_ceilings(context)?.map(|ceilings| ceilings.copy),
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
        let options =
            gpu::RendererOptions { time_stamps: gpu::TimeStamps::EachPass, ..gpu::RendererOptions::default() };
        renderers.push(Renderer::new(context, scene, &options)?);
    }
    for n in 0..options.warm_up + options.repeats {
        for (row, renderer) in table.rows.iter_mut().zip(&mut renderers) {
            renderer.volume(sweeps.get(&row.conditions.frames).into_iter().flatten())?;
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

/// The scene of a row. It has only the filters that the conditions name, and no shadow. The coarse detector and empty-space skipping are off, so
/// that a ray takes all of its samples. If rays are composited, the filters have the sigmas of preset `thesis` and windows that grow to 21 pixels.
///
/// # Errors
/// The conditions are outside the limits of a scene; those of [`tables`] never are.
pub fn scene(conditions: &Conditions) -> Result<Scene, SceneError> {
    let n = conditions.volume;
    let mut settings = Settings { mode: Mode::Surface, ..Settings::default() };
    settings.picture.size = [conditions.picture; 2];
    settings.slices.pixels = n;
    settings.region.lateral = Some([-HALF_REGION, HALF_REGION]);
    settings.region.elevation = Some([-HALF_REGION, HALF_REGION]);
    settings.region.depth = Some([0.0, DEPTH]);
    settings.ray.step = Some(DEPTH / f64::from(n));
    settings.surface.edge = Some(Edge::Named(EdgeName::Samples));
    // The thesis takes every sample.
    settings.ray.brick = Some(0);
    settings.surface.rough = 1;
    settings.post.antialias = false;
    settings.surface.place = Place::FirstCrossing;
    let window = conditions.filter_2d;
    if conditions.is_composited {
        settings.surface.colour = SurfaceColour::Rendered;
        let largest = GROWING_TO.max(window);
        let of = |sigma: f64| Some(EnhancedSigma { window, largest, sigma, ..EnhancedSigma::default() });
        settings.slices.enhanced_sigma = of(SLICE_SIGMA);
        settings.distance.enhanced_sigma = of(SIGMA);
        settings.post.enhanced_sigma = of(PICTURE_SIGMA);
    } else {
        settings.distance.sigma = Some(Sigma { window, sigma: SIGMA, ..Sigma::default() });
    }
    match conditions.filter_3d {
        Filter3d::None => {}
        Filter3d::Sliding(samples) => settings.ray.sliding = samples,
        Filter3d::Stored(taps) => settings.slices.smooth = Some(Smooth { kernel: Some(taps), ..Smooth::default() }),
    }
    let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
    let probe = sweep_probe(conditions.frames, conditions.lines);
    let (low, high) = probe.plane_bounds();
    let scene = Scene::new(Geometry::Sweep(probe), input, settings)?;
    // Pixels of slices are square by default, but a sector is wider than deep: n x n pixels are denser in depth.
    let pitch = [0, 1].map(|i| (high[i] - low[i]) / f64::from(n - 1));
    Ok(scene.on_grid(SliceGrid { size: [n, n], origin: low, pitch }))
}

/// Radius of the array, mm. The thesis does not state it; typical of abdominal wobblers, as in the phantom.
const ARRAY_RADIUS: f64 = 40.0;
/// Radius of the wobble, mm.
const WOBBLE_RADIUS: f64 = 25.0;

/// Radius of the ball of the test object, mm. Its diameter is about that of a fetal head.
pub const BALL_RADIUS: f64 = 45.0;
/// Depth of its centre below the face, mm.
const BALL_DEPTH: f64 = 100.0;
/// Depth of the wall below the face, mm.
const WALL_DEPTH: f64 = 130.0;

/// Value of samples in fluid, 0..1.
const FLUID: f64 = 0.15;
/// Value that the bodies add.
const TISSUE: f64 = 0.6;
/// Width of the edges of bodies, mm.
const EDGE: f64 = 1.0;
/// Standard deviation of the grain: far below the threshold of the detector, even without a filter.
const GRAIN: f64 = 0.01;

/// The probe of a sweep of `frames` frames of `lines` scan lines.
fn sweep_probe(frames: usize, lines: usize) -> Probe {
    let spread = |angle: f64, count: usize| Axis::centred(angle.to_radians() / (count - 1) as f64, count);
    Probe {
        array: Array::Curved { radius: ARRAY_RADIUS },
        lines: spread(SECTOR_ANGLE, lines),
        start_depth: 0.0,
        sample_pitch: DEPTH / (SAMPLES - 1) as f64,
        samples: SAMPLES,
        motion: Motion::Fan { wobble_radius: WOBBLE_RADIUS },
        slices: spread(FAN_ANGLE, frames),
        advance: Advance::None,
        sound_speed: SOUND_SPEED,
    }
}

/// Depth, mm below the probe's face, of the first surface of the test object on a line parallel to the depth axis at (lateral, elevation), mm.
pub fn surface_depth(lateral: f64, elevation: f64) -> f64 {
    let half_chord_squared = BALL_RADIUS.powi(2) - lateral.powi(2) - elevation.powi(2);
    if half_chord_squared > 0.0 { WALL_DEPTH.min(BALL_DEPTH - half_chord_squared.sqrt()) } else { WALL_DEPTH }
}

/// Value at a place, without grain.
fn echo(place: DVec3) -> f64 {
    let depth = place.y - ARRAY_RADIUS;
    let from_ball = (place - DVec3::new(0.0, ARRAY_RADIUS + BALL_DEPTH, 0.0)).length() - BALL_RADIUS;
    let outside = from_ball.min(WALL_DEPTH - depth);
    FLUID + TISSUE * (0.5 - outside / EDGE).clamp(0.0, 1.0)
}

/// Noise of mean 0 and standard deviation 1, nearly normal: the sum of four uniform values, which are bytes of a mixed number (Steele,
/// Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
fn grain(number: u64) -> f64 {
    let mixed = mix(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let sum: f64 = mixed.to_le_bytes()[..4].iter().map(|b| f64::from(*b) / 255.0 - 0.5).sum();
    sum * 3f64.sqrt()
}

/// The frames of one volume of the tables' test object: a ball in fluid in front of a wall, with a fine grain. Each frame has `lines` scan lines of
/// [`SAMPLES`] samples, line by line, as u8: 255 is the value 1. `frames` and `lines` must be at least 2.
pub fn sweep_frames(frames: usize, lines: usize) -> Vec<Frame> {
    let probe = sweep_probe(frames, lines);
    let sample = |slice: usize, line: usize, sample: usize| {
        let at = Indices { sample: sample as f64, line: line as f64, slice: slice as f64 };
        let number = ((slice * lines + line) * SAMPLES + sample) as u64;
        let value = echo(probe.to_space(at)) + GRAIN * grain(number);
        (value.clamp(0.0, 1.0) * 255.0).round() as u8
    };
    (0..frames)
        .into_par_iter()
        .map(|slice| {
            let places = (0..lines).flat_map(|line| (0..SAMPLES).map(move |i| (line, i)));
            let bytes = places.map(|(line, i)| sample(slice, line, i)).collect();
            Frame::of_slice(0, slice, bytes)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sweep_has_the_geometry_and_the_least_time_that_the_thesis_states() {
        let probe = sweep_probe(35, 64);
        probe.check().expect("a probe");
        let degrees = |axis: &Axis| (axis.last() - axis.first()).to_degrees();
        assert!((degrees(&probe.lines) - 77.0).abs() < 1e-9 && (degrees(&probe.slices) - 61.0).abs() < 1e-9);
        assert!((probe.last_range() - probe.first_range() - 160.0).abs() < 1e-9);
        assert!((probe.acquisition_time() * 1e3 - 465.45).abs() < 0.01, "{}", probe.acquisition_time());
    }

    #[test]
    fn grain_has_the_moments_it_claims() {
        let values: Vec<f64> = (0..100_000).map(grain).collect();
        let mean = values.iter().sum::<f64>() / 1e5;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1e5).sqrt();
        assert!(mean.abs() < 0.01 && (deviation - 1.0).abs() < 0.01, "{mean} {deviation}");
    }

    #[test]
    fn echoes_rise_at_the_surface() {
        for (x, z) in [(0.0, 0.0), (20.0, 30.0), (55.0, 10.0), (-30.0, -30.0)] {
            let at = |depth: f64| echo(DVec3::new(x, ARRAY_RADIUS + depth, z));
            let depth = surface_depth(x, z);
            assert!((at(depth) - FLUID - TISSUE / 2.0).abs() < 1e-9 && at(depth - 2.0) == FLUID, "{x} {z}");
        }
    }
}
