//! What this machine and a file have, and the phantom.

use crate::{array, invalid, of_device};
use echolume_core::scene::load::PRESETS;
use echolume_gpu::{DeviceChoice, context, device_selection};
use echolume_probe::{Array, Motion, Probe};
use echolume_source::phantom::{Phantom, PhantomOptions, Speckle};
use echolume_source::{self as source, OpenOptions};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// The names of the presets.
#[pyfunction]
pub fn presets() -> Vec<&'static str> {
    PRESETS.iter().map(|preset| preset.0).collect()
}

/// A device: name, kind, version of Vulkan, driver, what it lacks, and if it is the one that is used.
type Device = (String, &'static str, String, String, Vec<String>, bool);

/// The devices of this machine, in the order of their numbers.
#[pyfunction]
pub fn devices(py: Python<'_>) -> PyResult<Vec<Device>> {
    let devices = py.detach(context::list).map_err(of_device)?;
    let picked = device_selection::choose(&devices, &DeviceChoice::Best).ok();
    let about = |(number, device): (usize, &device_selection::Candidate)| {
        let missing = device.missing.iter().map(|what| what.to_string()).collect();
        let (name, driver) = (device.name.clone(), device.driver.trim().to_string());
        (name, device.kind_name(), device.api_version(), driver, missing, picked == Some(number))
    };
    Ok(devices.iter().enumerate().map(about).collect())
}

/// What `echolume info` says of a file: pairs of title and value.
#[pyfunction]
pub fn info(
    py: Python<'_>,
    path: PathBuf,
    probe: Option<PathBuf>,
    voxel_spacing: Option<[f64; 3]>,
) -> PyResult<Vec<(String, String)>> {
    let options = OpenOptions { probe: probe.as_deref(), voxel_spacing, ..OpenOptions::default() };
    py.detach(|| source::description(&path, options)).map(|found| found.rows).map_err(invalid)
}

/// A volume of the phantom, (frames, lines, samples), and its probe: the radius of the array, the angle of its lines, mm between samples, the radius
/// about which it turns, and the angle of its frames; mm and degrees.
#[pyfunction]
#[pyo3(signature = (body, volume, seed, speckle, frames, lines, samples, fan_angle_deg, still))]
// Keywords of Python.
#[allow(clippy::too_many_arguments)]
pub fn phantom<'py>(
    py: Python<'py>,
    body: &str,
    volume: i64,
    seed: u64,
    speckle: &str,
    frames: usize,
    lines: usize,
    samples: usize,
    fan_angle_deg: f64,
    still: bool,
) -> PyResult<(Bound<'py, PyArrayDyn<u8>>, [f64; 5])> {
    let speckle = match speckle {
        "random" => Speckle::Random,
        "mean" => Speckle::Mean,
        "none" => Speckle::None,
        other => return Err(invalid(format!("speckle: '{other}' is not known, must be one of random, mean, none"))),
    };
    let number = usize::try_from(volume).ok().filter(|number| *number < 10_000);
    let number = number.ok_or_else(|| PyIndexError::new_err(format!("volume {volume}: must lie in 0..=9999")))?;
    let body = body.parse().map_err(invalid)?;
    let usual = PhantomOptions::default();
    let volumes = number + 1;
    let options =
        PhantomOptions { body, seed, speckle, volumes, frames, lines, samples, fan_angle_deg, still, ..usual };
    let (echoes, probe) = py.detach(|| {
        let phantom = Phantom::new(options).map_err(invalid)?;
        let mut made = phantom.volume(number);
        made.sort_by_key(|frame| frame.slice);
        let echoes: Vec<u8> = made.into_iter().flat_map(|frame| frame.bytes).collect();
        PyResult::Ok((echoes, phantom.probe(number)))
    })?;
    Ok((array(py, echoes, &[frames, lines, samples])?, about(&probe)))
}

fn about(probe: &Probe) -> [f64; 5] {
    let angle = |axis: &echolume_probe::Axis| (axis.last() - axis.first()).to_degrees();
    let radius = match probe.array {
        Array::Curved { radius } => radius,
        Array::Linear => 0.0,
    };
    let wobble_radius = match probe.motion {
        Motion::Fan { wobble_radius } => wobble_radius,
        Motion::Translated | Motion::Still { .. } => 0.0,
    };
    [radius, angle(&probe.lines), probe.sample_pitch, wobble_radius, angle(&probe.slices)]
}
