//! One volume in memory: read from a file, computed, or copied from an array.

use crate::{array, invalid};
use echolume_base::tree::Node;
use echolume_core::scene::{EchoHistogram, EchoLevels, Input, default_look::block_edge};
use echolume_probe::{AxisOrder, Frame, Geometry, Indices, Probe, ProbeFile, SampleType, World};
use echolume_source::phantom::{Phantom, PhantomOptions, PhantomSource};
use echolume_source::{self as source, OpenOptions, Source, convert};
use glam::DVec3;
use numpy::{Element, PyArrayDyn, PyReadonlyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is known of a volume.
pub struct Given {
    /// Its samples, as they are stored, with their geometry.
    pub samples: convert::Volume,
    /// Their type, and the stored values that are shown as black and white.
    pub stated: Input,
    /// Their type for users.
    pub sample: SampleType,
    /// Where the voxels are; none of a sweep.
    pub world: Option<World>,
    /// Its number in the recording, and how many there are.
    pub number: u32,
    pub count: usize,
    /// It is of the phantom, not of a patient.
    pub is_synthetic: bool,
}

impl Given {
    pub fn geometry(&self) -> &Geometry {
        self.samples.geometry()
    }

    /// The levels of its echoes, 0..1 of a range; none if all are the same.
    pub fn levels(&self, input: Input) -> Option<EchoLevels> {
        let mut histogram = EchoHistogram::new(self.geometry(), input, block_edge(self.geometry()));
        self.samples.frames().iter().filter(|bytes| !bytes.is_empty()).for_each(|bytes| histogram.take(bytes));
        histogram.levels()
    }

    fn of_source(source: &mut dyn Source, number: u32) -> PyResult<Given> {
        let volume = number as usize;
        source.skip_to_volume(volume).map_err(invalid)?;
        let geometry = source.geometry(volume);
        let mut samples = convert::Volume::new(geometry.clone(), source.stored_type());
        let mut first = None;
        for _ in 0..source.frames_per_volume() {
            let next = source.next_frame().map_err(invalid)?;
            // A file may lack frames: the next one can belong to another volume.
            let Some(frame) = next.filter(|frame| *first.get_or_insert(frame.volume) == frame.volume) else { break };
            samples.take(frame);
        }
        let world = match &geometry {
            Geometry::Cartesian(grid) => Some(source.world_of(volume).unwrap_or_else(|| World::of(grid))),
            Geometry::Sweep(_) => None,
        };
        Ok(Given {
            samples,
            stated: Input { stored: source.stored_type(), range: source.range() },
            sample: source.sample_type(),
            world,
            number,
            count: source.volumes(),
            is_synthetic: source.is_synthetic(),
        })
    }
}

/// A volume: shared by what is made of it, and never changed.
#[pyclass(module = "echolume._echolume", frozen)]
pub struct Volume(pub Arc<Given>);

#[pymethods]
impl Volume {
    /// One volume of a recording.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        volume: i64,
        probe: Option<PathBuf>,
        voxel_spacing: Option<[f64; 3]>,
    ) -> PyResult<Volume> {
        py.detach(|| {
            let options = OpenOptions { probe: probe.as_deref(), voxel_spacing, ..OpenOptions::default() };
            let mut source = source::open_with(&path, options).map_err(invalid)?;
            let count = source.volumes();
            let there = usize::try_from(volume).ok().filter(|volume| *volume < count);
            let Some(number) = there.and_then(|volume| u32::try_from(volume).ok()) else {
                return Err(PyIndexError::new_err(format!("volume {volume}: there are {count}, numbered from 0")));
            };
            Ok(Volume(Arc::new(Given::of_source(&mut *source, number)?)))
        })
    }

    /// The fetal head that the program shows first.
    #[staticmethod]
    fn head(py: Python<'_>) -> PyResult<Volume> {
        py.detach(|| {
            let phantom = Phantom::new(PhantomOptions::default()).map_err(invalid)?;
            Ok(Volume(Arc::new(Given::of_source(&mut PhantomSource::new(phantom), 0)?)))
        })
    }

    /// A copy of an array of (slices, rows, columns), or of (frames, lines, samples) with a probe.
    #[staticmethod]
    fn of_array(
        samples: &Bound<'_, PyAny>,
        spacing: [f64; 3],
        affine: Option<[[f64; 4]; 4]>,
        probe: Option<Tables>,
        range: Option<[f64; 2]>,
    ) -> PyResult<Volume> {
        let Copied { frames, size, span, sample } = Copied::of(samples)?;
        let [columns, rows, slices] = size;
        let probe = probe.map(Tables::file).transpose()?;
        let range = range.or(probe.as_ref().and_then(ProbeFile::range));
        let (geometry, world, order) = match probe {
            Some(file) => (Geometry::Sweep(swept(&file, size)?), None, AxisOrder::STORED),
            None => {
                let (world, order) = placed(spacing, affine, size)?;
                let grid = world.grid(size);
                grid.check().map_err(|e| invalid(format!("{}: {}", e.field, e.fault)))?;
                (Geometry::Cartesian(grid), Some(world), order)
            }
        };
        let [low, high] = range.unwrap_or(span);
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(invalid(format!("range: ({low}, {high}): must be two rising finite numbers")));
        }
        let stated = Input { stored: sample.stored(), range: [low, high].map(|value| value + sample.shift()) };
        let mut samples = convert::Volume::new(geometry, sample.stored());
        for (number, bytes) in frames.into_iter().enumerate() {
            let slice = if order.reversed[2] { slices - 1 - number } else { number };
            let bytes = match order == AxisOrder::STORED {
                true => bytes,
                false => order.reorder(&bytes, [columns, rows, 1], sample.bytes()),
            };
            samples.take(Frame::of_slice(0, slice, bytes));
        }
        Ok(Volume(Arc::new(Given { samples, stated, sample, world, number: 0, count: 1, is_synthetic: false })))
    }

    /// The samples: (slices, rows, columns). Frames that are missing are 0 as stored.
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self.0.sample {
            SampleType::U8 => self.typed::<u8>(py)?.into_any(),
            SampleType::U16 => self.typed::<u16>(py)?.into_any(),
            SampleType::I16 => self.typed::<i16>(py)?.into_any(),
            SampleType::F32 => self.typed::<f32>(py)?.into_any(),
        })
    }

    /// The values that are shown as black and white.
    #[getter]
    fn range(&self) -> [f64; 2] {
        self.0.stated.range.map(|value| value - self.0.sample.shift())
    }

    #[getter]
    fn volumes(&self) -> usize {
        self.0.count
    }

    /// mm between columns, rows and slices; None of a sweep.
    #[getter]
    fn spacing(&self) -> Option<[f64; 3]> {
        match self.0.geometry() {
            Geometry::Cartesian(grid) => Some(grid.spacing),
            Geometry::Sweep(_) => None,
        }
    }

    /// (4, 4): (column, row, slice, 1) to mm in the world; None of a sweep.
    fn affine<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        self.0.world.map(|world| array(py, affine(&world), &[4, 4])).transpose()
    }
}

impl Volume {
    fn typed<'py, T: Sample>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
        let [columns, rows] = self.0.geometry().frame_size();
        let frames = self.0.samples.frames();
        let values = py.detach(|| {
            let mut values = Vec::with_capacity(columns * rows * frames.len());
            for bytes in frames {
                let end = values.len() + columns * rows;
                values.extend(bytes.chunks_exact(size_of::<T>()).map(T::taken));
                values.resize(end, T::taken(&[0; size_of::<u64>()][..size_of::<T>()]));
            }
            values
        });
        array(py, values, &[frames.len(), rows, columns])
    }
}

/// The rows of the matrix of a world.
pub fn affine(world: &World) -> Vec<f64> {
    let columns = [world.axis(0), world.axis(1), world.axis(2), world.origin()];
    let row = |r: usize| columns.map(|column| column[r]);
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat()
}

/// The world of a lattice, and the order in which its axes are drawn, so that a mirrored volume is not shown mirrored.
fn placed(spacing: [f64; 3], affine: Option<[[f64; 4]; 4]>, size: [usize; 3]) -> PyResult<(World, AxisOrder)> {
    let [x, y, z] = spacing;
    let rows = affine.unwrap_or([[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    if rows[3] != [0.0, 0.0, 0.0, 1.0] {
        return Err(invalid(format!("affine: its last row is {:?}, must be (0, 0, 0, 1)", rows[3])));
    }
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    let name = if affine.is_some() { "affine" } else { "spacing" };
    let world =
        World::new([column(0), column(1), column(2)], column(3)).map_err(|e| invalid(format!("{name}: {e}")))?;
    match world.is_left_handed() {
        false => Ok((world, AxisOrder::STORED)),
        true => {
            let order = AxisOrder::with_other_hand(&world);
            Ok((world.reordered(&order, size), order))
        }
    }
}

/// The tables of a probe file: as JSON, or the file.
#[derive(FromPyObject)]
pub enum Tables {
    Json(String),
    File(PathBuf),
}

impl Tables {
    fn file(self) -> PyResult<ProbeFile> {
        match self {
            Tables::Json(tables) => {
                let tables = Node::parse_json(tables.as_bytes()).map_err(invalid)?;
                ProbeFile::from_tables(Path::new("probe"), tables).map_err(invalid)
            }
            Tables::File(path) => ProbeFile::read(&path).map_err(invalid),
        }
    }
}

/// The probe of a file for one volume of (samples, lines, frames).
fn swept(file: &ProbeFile, [samples, lines, frames]: [usize; 3]) -> PyResult<Probe> {
    let (probe, volumes) = file.geometry(samples, lines, frames).map_err(invalid)?;
    Ok(volumes.swept(0, &probe))
}

/// Where the samples of a probe are, mm: (frames, lines, samples, 3).
#[pyfunction]
pub fn places<'py>(
    py: Python<'py>,
    probe: Tables,
    frames: usize,
    lines: usize,
    samples: usize,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let probe = swept(&probe.file()?, [samples, lines, frames])?;
    let all = py.detach(|| {
        let mut all = Vec::with_capacity(frames * lines * samples * 3);
        for (slice, line) in (0..frames).flat_map(|slice| (0..lines).map(move |line| (slice as f64, line as f64))) {
            let at = |sample: usize| probe.to_space(Indices { sample: sample as f64, line, slice });
            all.extend((0..samples).flat_map(|sample| at(sample).to_array()));
        }
        all
    });
    array(py, all, &[frames, lines, samples, 3])
}

/// A type of samples.
trait Sample: Element + Copy {
    const TYPE: SampleType;
    /// As it is stored.
    fn append(self, bytes: &mut Vec<u8>);
    /// From as many bytes as it has.
    fn taken(stored: &[u8]) -> Self;
    fn value(self) -> f64;
}

/// `$store`: the value as it is stored. `$take`: the value of what is stored.
macro_rules! sample {
    ($type:ty, $stored:ty, $name:ident, |$value:ident| $store:expr, |$bits:ident| $take:expr) => {
        impl Sample for $type {
            const TYPE: SampleType = SampleType::$name;

            fn append(self, bytes: &mut Vec<u8>) {
                let $value = self;
                bytes.extend(($store as $stored).to_le_bytes());
            }

            fn taken(stored: &[u8]) -> $type {
                let mut word = [0; size_of::<$type>()];
                word.copy_from_slice(stored);
                let $bits = <$stored>::from_le_bytes(word);
                $take
            }

            fn value(self) -> f64 {
                f64::from(self)
            }
        }
    };
}

sample!(u8, u8, U8, |value| value, |bits| bits);
sample!(u16, u16, U16, |value| value, |bits| bits);
// Signed samples are stored with an offset of half the range.
sample!(i16, u16, I16, |value| value as u16 ^ 0x8000, |bits| (bits ^ 0x8000) as i16);
sample!(f32, f32, F32, |value| value, |bits| bits);

/// What was copied from an array.
struct Copied {
    /// The bytes of each slice.
    frames: Vec<Vec<u8>>,
    /// Columns, rows, slices.
    size: [usize; 3],
    /// The values that are shown as black and white: of bytes 0 and 255, otherwise the smallest and the largest.
    span: [f64; 2],
    sample: SampleType,
}

impl Copied {
    fn of(samples: &Bound<'_, PyAny>) -> PyResult<Copied> {
        if let Ok(samples) = samples.extract() {
            return copied::<u8>(&samples);
        }
        if let Ok(samples) = samples.extract() {
            return copied::<u16>(&samples);
        }
        if let Ok(samples) = samples.extract() {
            return copied::<i16>(&samples);
        }
        match samples.extract() {
            Ok(samples) => copied::<f32>(&samples),
            Err(_) => Err(invalid("array: must be (slices, rows, columns) of uint8, uint16, int16 or float32")),
        }
    }
}

/// With the GIL, so that nobody changes the array meanwhile.
fn copied<T: Sample>(samples: &PyReadonlyArray3<'_, T>) -> PyResult<Copied> {
    let samples = samples.as_array();
    let (slices, rows, columns) = samples.dim();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut frames = Vec::with_capacity(slices);
    for (slice, plane) in samples.outer_iter().enumerate() {
        let mut bytes = Vec::with_capacity(columns * rows * size_of::<T>());
        let mut is_finite = true;
        for sample in plane.iter() {
            let value = sample.value();
            is_finite &= value.is_finite();
            (low, high) = (low.min(value), high.max(value));
            sample.append(&mut bytes);
        }
        if !is_finite {
            let place = plane.indexed_iter().find(|(_, sample)| !sample.value().is_finite());
            let ((row, column), value) = place.map_or(((0, 0), f64::NAN), |(at, sample)| (at, sample.value()));
            let fault = format!("array: sample [{slice}, {row}, {column}] is {value}: all must be finite");
            return Err(invalid(format!("{fault}, as after np.nan_to_num")));
        }
        frames.push(bytes);
    }
    let span = match T::TYPE {
        SampleType::U8 => [0.0, 255.0],
        _ if low < high => [low, high],
        _ => [low, low + 1.0],
    };
    Ok(Copied { frames, size: [columns, rows, slices], span, sample: T::TYPE })
}
