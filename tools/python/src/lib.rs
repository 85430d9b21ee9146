//! Echolume as a Python module: what the package `echolume` is made of. It checks little of what users give, since `python/echolume` does that, and
//! copies no array that it returns.

mod facts;
mod renderer;
mod stream;
mod surface;
mod volume;

use echolume_core::scene::Settings;
use echolume_core::scene::load::Layers;
use echolume_gpu::{Context, ContextOptions, DeviceChoice};
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, PyArrayDyn};
use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::path::Path;
use std::sync::Arc;

create_exception!(echolume, DeviceError, PyRuntimeError, "A Vulkan device is missing, failed or was lost.");

/// A picture in memory: its bytes, red, green, blue, alpha, and its height and width.
type Pixels = (Vec<u8>, [usize; 2]);

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn of_device(error: impl std::fmt::Display) -> PyErr {
    DeviceError::new_err(error.to_string())
}

/// A numpy array that takes these values over, and which Python may change.
fn array<'py, T: Element>(py: Python<'py>, values: Vec<T>, shape: &[usize]) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let values = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(invalid)?;
    Ok(PyArrayDyn::from_owned_array(py, values))
}

fn picture_array(py: Python<'_>, (rgba, [height, width]): Pixels) -> PyResult<Bound<'_, PyArrayDyn<u8>>> {
    array(py, rgba, &[height, width, 4])
}

/// What a user chose: presets, assignments such as `mode=mip`, and a table as JSON, in this order.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Chosen {
    presets: Vec<String>,
    assignments: Vec<String>,
    table: String,
}

impl Chosen {
    /// These layers on top of others.
    fn over(&self, mut layers: Layers) -> PyResult<Layers> {
        for preset in &self.presets {
            layers.preset(preset).map_err(invalid)?;
        }
        for assignment in &self.assignments {
            layers.set_by(assignment, assignment).map_err(invalid)?;
        }
        let json: serde_json::Value = serde_json::from_str(&self.table).map_err(invalid)?;
        let table = toml::Table::try_from(json).map_err(|e| invalid(format!("settings: {e}")))?;
        // One by one, so that a message names the key at fault.
        for (key, value) in table {
            let name = format!("settings: {key}");
            layers.table(&name, toml::Table::from_iter([(key, value)]), Path::new("")).map_err(invalid)?;
        }
        Ok(layers)
    }
}

/// Settings as JSON. What is absent is left out, so that they can be given again.
fn json(settings: &Settings) -> PyResult<String> {
    let table = settings.to_table().map_err(invalid)?;
    serde_json::to_string(&table).map_err(invalid)
}

fn context_of(device: Option<&str>) -> PyResult<Arc<Context>> {
    let device = match device {
        Some(name) => name.parse::<DeviceChoice>().map_err(invalid)?,
        None => DeviceChoice::default(),
    };
    Context::new(&ContextOptions { device, ..ContextOptions::default() }).map_err(of_device)
}

#[pymodule]
fn _echolume(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("DeviceError", module.py().get_type::<DeviceError>())?;
    module.add_class::<volume::Volume>()?;
    module.add_class::<renderer::Renderer>()?;
    module.add_class::<stream::Stream>()?;
    module.add_function(wrap_pyfunction!(facts::devices, module)?)?;
    module.add_function(wrap_pyfunction!(facts::info, module)?)?;
    module.add_function(wrap_pyfunction!(facts::phantom, module)?)?;
    module.add_function(wrap_pyfunction!(facts::presets, module)?)?;
    module.add_function(wrap_pyfunction!(surface::convert, module)?)?;
    module.add_function(wrap_pyfunction!(surface::mesh, module)?)?;
    module.add_function(wrap_pyfunction!(volume::places, module)?)
}
