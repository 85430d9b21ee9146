//! Volumes on a lattice, and their surfaces as triangles: what `echolume convert` and `echolume mesh` compute, on the CPU in f64.

use crate::volume::{Given, Volume, affine};
use crate::{array, invalid};
use echolume_core::mesh::Mesh;
use echolume_core::mesh::nets::{Surface, surface_net};
use echolume_core::mesh::simplify::simplified;
use echolume_core::mesh::smooth::Smoother;
use echolume_core::scene::default_look::smoothing;
use echolume_probe::{Geometry, Grid, SampleType, World};
use echolume_source::convert::lattice;
use numpy::{Element, PyArrayDyn};
use pyo3::prelude::*;

/// Widest smoothing, voxels: its slices are kept in memory.
const MAX_DEVIATION: f64 = 32.0;

/// The lattice that was asked for: the voxels of a volume, or `spacing` mm apart; and where it is.
fn target(given: &Given, spacing: Option<f64>) -> PyResult<(Grid, World)> {
    let geometry = given.geometry();
    let grid = match (geometry, spacing) {
        (Geometry::Cartesian(grid), None) => *grid,
        (Geometry::Sweep(probe), None) => lattice(geometry, probe.sample_pitch)
            .map_err(|e| invalid(format!("spacing: that of the samples, {e}; give a larger one")))?,
        (_, Some(spacing)) => lattice(geometry, spacing).map_err(|e| invalid(format!("spacing: {e}")))?,
    };
    let world = match (geometry, given.world) {
        (Geometry::Cartesian(own), Some(world)) => world.on(own, &grid),
        _ => World::of(&grid),
    };
    Ok((grid, world))
}

/// The volume on a lattice in its own type, and the matrix of the lattice.
#[pyfunction]
pub fn convert<'py>(
    py: Python<'py>,
    volume: &Volume,
    spacing: Option<f64>,
    outside: Option<f64>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArrayDyn<f64>>)> {
    let given = &*volume.0;
    let (grid, world) = target(given, spacing)?;
    let samples = match given.sample {
        SampleType::U8 => converted(py, given, &grid, outside, |value| value.round() as u8)?,
        SampleType::U16 => converted(py, given, &grid, outside, |value| value.round() as u16)?,
        SampleType::I16 => converted(py, given, &grid, outside, |value| value.round() as i16)?,
        SampleType::F32 => converted(py, given, &grid, outside, |value| value as f32)?,
    };
    Ok((samples, array(py, affine(&world), &[4, 4])?))
}

fn converted<'py, T: Element + Copy + Into<f64>>(
    py: Python<'py>,
    given: &Given,
    grid: &Grid,
    outside: Option<f64>,
    cast: impl Fn(f64) -> T + Send + Sync,
) -> PyResult<Bound<'py, PyAny>> {
    let shift = given.sample.shift();
    let outside = outside.unwrap_or(given.stated.range[0] - shift);
    let cast_outside = cast(outside);
    let is_rounded = given.sample == SampleType::F32 && outside.is_finite() && outside.abs() <= f64::from(f32::MAX);
    if !is_rounded && cast_outside.into() != outside {
        return Err(invalid(format!("outside: {outside} is no value of {}", given.sample)));
    }
    let [columns, rows, slices] = grid.size;
    let values = py.detach(|| {
        let mut values = Vec::with_capacity(columns * rows * slices);
        let mut slice = vec![0.0; columns * rows];
        for z in 0..slices {
            signals()?;
            given.samples.slice(grid, z, &mut slice);
            values.extend(slice.iter().map(|v| if v.is_nan() { cast_outside } else { cast(v - shift) }));
        }
        PyResult::Ok(values)
    })?;
    Ok(array(py, values, &[slices, rows, columns])?.into_any())
}

/// A signal of Python, as Ctrl-C, ends a long computation.
fn signals() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

/// A mesh: vertices in mm, triangles, the share of the range that is its threshold, and if it is closed.
type Made<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<u32>>, f64, bool);

/// The surface where a volume passes a threshold.
#[pyfunction]
#[pyo3(signature = (volume, threshold, spacing, smooth, simplify, closed))]
pub fn mesh<'py>(
    py: Python<'py>,
    volume: &Volume,
    threshold: Option<f64>,
    spacing: Option<f64>,
    smooth: Option<f64>,
    simplify: Option<f64>,
    closed: bool,
) -> PyResult<Made<'py>> {
    if let Some(share) = threshold.filter(|share| !(0.0..=1.0).contains(share)) {
        return Err(invalid(format!("threshold: {share}: must lie in 0..=1 of the range of the samples")));
    }
    if let Some(mm) = simplify.filter(|mm| !(mm.is_finite() && *mm > 0.0)) {
        return Err(invalid(format!("simplify: {mm}: must be a length above 0 mm")));
    }
    let given = &*volume.0;
    let (mesh, share) = py.detach(|| {
        let (grid, world) = target(given, spacing)?;
        let found = || given.levels(given.stated).map(|levels| levels.threshold);
        let share = threshold.or_else(found);
        let share = share.ok_or_else(|| invalid("threshold: the echoes have no two classes; give one"))?;
        let [low, high] = given.stated.range;
        let surface = Surface { threshold: low + share * (high - low), closed };
        let deviation = deviation(given.geometry(), &grid, smooth)?;
        let mut smoother = Smoother::new(grid.size, grid.spacing, deviation);
        let slice = |z: usize, out: &mut [f64]| {
            signals()?;
            smoother.slice(z, out, |z, out| given.samples.slice(&grid, z, out));
            Ok(())
        };
        let mesh = surface_net::<Fault>(grid.size, surface, slice, |at| world.at(at)).map_err(|Fault(error)| error)?;
        PyResult::Ok((simplify.map_or_else(|| mesh.clone(), |mm| simplified(&mesh, mm).0), share))
    })?;
    let Mesh { vertices, triangles, open_edges } = mesh;
    let vertex = vertices.len();
    let vertices: Vec<f64> = vertices.into_iter().flat_map(|place| place.to_array()).collect();
    let triangle = triangles.len();
    let vertices = array(py, vertices, &[vertex, 3])?;
    Ok((vertices, array(py, triangles.concat(), &[triangle, 3])?, share, open_edges == 0))
}

/// Why no surface was made.
struct Fault(PyErr);

impl From<String> for Fault {
    fn from(fault: String) -> Fault {
        Fault(invalid(fault))
    }
}

impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Fault {
        Fault(error)
    }
}

/// Standard deviation of the smoothing, mm: what was asked for, or that of a sweep in a picture.
fn deviation(geometry: &Geometry, grid: &Grid, asked: Option<f64>) -> PyResult<f64> {
    let usual = match geometry {
        Geometry::Sweep(_) => smoothing(geometry),
        Geometry::Cartesian(_) => 0.0,
    };
    let most = MAX_DEVIATION * grid.spacing.iter().copied().fold(f64::INFINITY, f64::min);
    match asked {
        Some(mm) if !(0.0..=most).contains(&mm) => {
            Err(invalid(format!("smooth: {mm}: must lie in 0..={most} mm, {MAX_DEVIATION} voxels")))
        }
        Some(mm) => Ok(mm),
        // Volumes that are finer than the usual are smoothed as far as that goes.
        None => Ok(usual.min(most)),
    }
}
