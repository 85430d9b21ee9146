//! UFF of the Ultrasound Toolbox (USTB, `.uff`): beamformed data in an HDF5 file, with the scan whose pixels they are.
//!
//! The layout is that of USTB's MATLAB classes. A group of the class `uff.beamformed_data` holds `data`, a dataset, or a group of `real` and
//! `imag`, whose axes are frame, wave, channel and pixel (the first ones are left out where they are 1), and `scan`, with axes in m and rad.
//! Pixels are ordered by depth, then laterally, then in elevation: samples of lines of frames.
//!
//! Complex data and amplitudes become decibels of their envelope, 0 at the largest of the file. Data of both signs are RF and are refused.

use super::describe::{self, Remarks, Rows};
use super::keys::{Aspect, Key, Unused, Use, not_used};
use crate::StoredType;
use crate::files::{InputError, progress, quoted};
use crate::frame::check_volume;
use crate::probe::file::SLAB;
use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::{Frame, Source};
use hdf5_reader::group::Group;
use hdf5_reader::{DEFAULT_CHUNK_CACHE_SLOTS, Dataset, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem};
use std::path::{Path, PathBuf};

/// The keys of a group of beamformed data, and how they are treated, among them those that could change a picture and are not read.
pub(super) static KEYS: [Key; 12] = [
    Key::new("data", Aspect::Storage, Use::Used),
    Key::new("scan", Aspect::Geometry, Use::Used),
    Key::new("scan/x_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/y_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/z_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/azimuth_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/elevation_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/depth_axis", Aspect::Geometry, Use::Used),
    Key::new("scan/transform", Aspect::Geometry, Use::Refused(&["0"])),
    Key::new("scan/origin", Aspect::Geometry, Use::Warned(&["0"])),
    Key::new("scan/apex", Aspect::Geometry, Use::Warned(&["0"])),
    Key::new("*", Aspect::About, Use::Listed),
];

/// Most samples, lines, slices or volumes.
const MAX_EXTENT: u64 = 65_536;
/// Most bytes of one frame, real or imaginary.
const MAX_FRAME_BYTES: u64 = 1 << 30;
/// Most bytes that deflate makes of one, and what small files may take besides.
const INFLATION: u64 = 1032;
const LEAST_BYTES: u64 = 1 << 20;
/// Largest chunk, bytes. MATLAB writes a dataset as one chunk.
const MAX_CHUNK_BYTES: u64 = 1 << 30;
/// The cache of unpacked chunks: it holds those that later frames need again, so that no chunk is unpacked twice in one pass.
const CACHE: CacheLimits = CacheLimits { usual: 64 << 20, most: 2 << 30, most_chunks: 1 << 20 };
/// Farthest that a sample may be from its place on an even axis, m.
const TOLERANCE: f64 = 5e-7;
/// What is shown, dB; USTB's own range.
const SHOWN: [f64; 2] = [-60.0, 0.0];
/// What is stored for an amplitude of 0 and everything below, dB.
const FLOOR: f64 = -200.0;

/// The beamformed data of a UFF file as a source of volumes.
///
/// Memory: a frame, twice; a chunk, three times while it is unpacked (at most 1 GiB each); and a cache of chunks (64 MiB, or what a pass over
/// the frames needs, at most 2 GiB).
pub(super) struct Beamformed {
    path: PathBuf,
    probe: Probe,
    scan: String,
    data: Data,
    scale: Scale,
    volumes: usize,
    next: usize,
    remarks: Remarks,
    unused: Unused,
}

/// Where the numbers of the pixels are.
enum Data {
    Real(Box<Dataset>),
    Complex(Box<[Dataset; 2]>),
}

impl Data {
    fn parts(&self) -> &[Dataset] {
        match self {
            Data::Real(set) => std::slice::from_ref(set),
            Data::Complex(parts) => &parts[..],
        }
    }
}

/// Bytes of the cache of chunks: as a rule, and at most; and most chunks in it.
#[derive(Clone, Copy)]
struct CacheLimits {
    usual: u64,
    most: u64,
    most_chunks: u64,
}

/// What a pass over the frames, one after the other, unpacks.
#[derive(Default)]
struct Chunks {
    /// The size of a chunk, numbers along each axis; empty where there are none.
    chunk: Vec<u64>,
    /// Bytes of all chunks.
    all: u64,
    /// Bytes and number of the chunks that must be kept so that none is unpacked twice.
    kept: u64,
    count: u64,
}

/// What the numbers are, and what is stored of them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Amplitudes, the largest of which becomes 0 dB.
    Amplitude { largest: f64 },
    /// Decibels, as they are.
    Decibels,
    /// Grey values of 8 bits.
    Grey,
}

impl Beamformed {
    /// Opens a file, and reads all of its samples once to find the largest, unless they are grey values of 8 bits.
    ///
    /// # Errors
    /// The file cannot be read, holds no beamformed data, or holds an array of them. The data are RF, hold nothing but 0, are not compounded, or are
    /// of a scan that is not read. The file states more bytes than it can hold, or its chunks are too large.
    pub fn open(path: &Path) -> Result<Beamformed, InputError> {
        Beamformed::open_within(path, CACHE)
    }

    fn open_within(path: &Path, cache: CacheLimits) -> Result<Beamformed, InputError> {
        let length = std::fs::metadata(path).map_err(|e| InputError::unreadable(path, &e))?.len();
        let most = length.saturating_mul(INFLATION).saturating_add(LEAST_BYTES);
        let file = File { path };
        let group = |bytes: u64, chunks: u64| {
            let at_once = most.min(MAX_CHUNK_BYTES) as usize;
            let options = OpenOptions::default()
                .with_chunk_cache_bytes(bytes as usize)
                .with_chunk_cache_slots(DEFAULT_CHUNK_CACHE_SLOTS.max(chunks as usize))
                .with_max_chunk_bytes(at_once)
                .with_max_read_bytes(at_once)
                .with_max_object_header_bytes(at_once.min(16 << 20));
            let hdf5 = Hdf5File::open_with_options(path, options).map_err(|e| file.broken("file", &e))?;
            file.beamformed(&hdf5.root_group().map_err(|e| file.broken("file", &e))?)
        };
        let opened = group(cache.usual.min(most), 0)?;
        let scan = opened.group("scan").map_err(|e| file.broken("scan", &e))?;
        let (probe, class) = file.probe(&scan)?;
        let mut data = file.data(&opened)?;
        let pixels = (probe.samples * probe.lines.len() * probe.slices.len()) as u64;
        let volumes = file.volumes(&data, pixels)?;
        let needed = file.chunks(&data, pixels / probe.slices.len() as u64)?;
        if needed.all > most {
            let shown = shown(data.parts()[0].shape());
            let fault = format!(
                "has the shape {shown}, {} bytes; a file of {length} bytes holds at most {most}, even packed",
                needed.all
            );
            return file.fault("data", fault);
        }
        if needed.kept > cache.most || needed.count > cache.most_chunks {
            let fault = format!(
                "is in chunks of {}: {} of them, {} bytes, must be in memory at once, at most {} and {}; write it again in chunks of one \
                 frame, as with h5repack -l DATASET:CHUNK=...",
                shown(&needed.chunk),
                needed.count,
                needed.kept,
                cache.most_chunks,
                cache.most
            );
            return file.fault("data", fault);
        }
        if needed.kept > cache.usual || needed.count > DEFAULT_CHUNK_CACHE_SLOTS as u64 {
            data = file.data(&group(needed.kept.max(cache.usual.min(most)), needed.count)?)?;
        }
        let mut remarks = Vec::new();
        let unused = file.unused(&opened, &scan, &mut remarks)?;
        let mut read = Beamformed {
            path: path.into(),
            probe,
            scan: class,
            data,
            scale: Scale::Decibels,
            volumes,
            next: 0,
            remarks,
            unused,
        };
        read.scale = read.measure()?;
        Ok(read)
    }

    /// A description for users: pairs of title and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        rows.add("format", format!("UFF of USTB, {}", self.scan));
        let kind = match (&self.data, self.scale) {
            (Data::Complex(_), Scale::Amplitude { .. }) => "complex, shown as decibels of their envelope",
            (_, Scale::Amplitude { .. }) => "amplitudes, shown as decibels",
            (_, Scale::Decibels) => "decibels",
            (_, Scale::Grey) => "grey values",
        };
        rows.add("samples", format!("{}, {kind}", self.sample_type()));
        rows.add_frame(true, [self.probe.samples, self.probe.lines.len()]);
        let each = self.probe.slices.len();
        rows.add("volumes", format!("{} of {each} {}", self.volumes, if each == 1 { "frame" } else { "frames" }));
        rows.extend(describe::probe(&self.probe));
        rows.add_range(self.range(), "");
        rows.extend(self.remarks.iter().cloned());
        rows
    }

    /// Names of the objects in the file, besides the data, that are not used.
    pub fn unused(&self) -> &Unused {
        &self.unused
    }

    /// What the numbers are, by their signs, and the largest.
    fn measure(&self) -> Result<Scale, InputError> {
        if let Data::Real(set) = &self.data
            && let hdf5_reader::Datatype::FixedPoint { size: 1, signed: false, .. } = set.dtype()
        {
            return Ok(Scale::Grey);
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let frames = self.volumes * self.probe.slices.len();
        // The library reads the file: each frame counts for its share of it.
        let each = std::fs::metadata(&self.path).map_or(0, |about| about.len()) / frames.max(1) as u64;
        progress::expect_bytes(each * frames as u64);
        for number in 0..frames {
            progress::add_bytes(each).map_err(|e| InputError::unreadable(&self.path, &e))?;
            for value in self.values(number)?.into_iter().filter(|value| value.is_finite()) {
                (low, high) = (low.min(value), high.max(value));
            }
        }
        match (&self.data, low < 0.0, high > 0.0) {
            (Data::Real(_), true, true) => {
                let fault = format!(
                    "hold {} to {}, both signs: RF data; take their envelope (USTB: postprocess of the analytic signal)",
                    describe::number(low),
                    describe::number(high)
                );
                Err(InputError::new(&self.path, "data", fault))
            }
            (Data::Real(_), true, false) => Ok(Scale::Decibels),
            (_, _, true) => Ok(Scale::Amplitude { largest: high }),
            _ => Err(InputError::new(&self.path, "data", "hold nothing but 0")),
        }
    }

    /// The amplitudes, decibels or grey values of a frame of all volumes.
    fn values(&self, number: usize) -> Result<Vec<f64>, InputError> {
        let file = File { path: &self.path };
        let each = (self.probe.samples * self.probe.lines.len()) as u64;
        let (volume, slice) = (number / self.probe.slices.len(), (number % self.probe.slices.len()) as u64);
        let part = |set: &Dataset| {
            let last = set.ndim().saturating_sub(1);
            let selection = |axis: usize| match axis {
                _ if axis == last => SliceInfoElem::Slice { start: slice * each, end: (slice + 1) * each, step: 1 },
                0 if set.ndim() == 4 => SliceInfoElem::Slice { start: volume as u64, end: volume as u64 + 1, step: 1 },
                _ => SliceInfoElem::Slice { start: 0, end: 1, step: 1 },
            };
            let selections = SliceInfo { selections: (0..set.ndim()).map(selection).collect() };
            numbers(set, &selections).map_err(|e| file.broken("data", &e))
        };
        match &self.data {
            Data::Real(set) => part(set),
            Data::Complex(parts) => {
                let [real, imaginary] = &**parts;
                let (real, imaginary) = (part(real)?, part(imaginary)?);
                Ok(real.into_iter().zip(imaginary).map(|(a, b)| a.hypot(b)).collect())
            }
        }
    }
}

/// The numbers of a selection, of any type of numbers.
fn numbers(set: &Dataset, selection: &SliceInfo) -> Result<Vec<f64>, hdf5_reader::error::Error> {
    // In the width of the file: a frame of f64 would take twice the memory of one of f32.
    match set.dtype() {
        hdf5_reader::Datatype::FloatingPoint { size: 4, .. } => {
            Ok(set.read_slice::<f32>(selection)?.iter().map(|value| f64::from(*value)).collect())
        }
        hdf5_reader::Datatype::FixedPoint { size: 1, signed: false, .. } => {
            Ok(set.read_slice::<u8>(selection)?.iter().map(|value| f64::from(*value)).collect())
        }
        hdf5_reader::Datatype::FixedPoint { size: 8, signed: true, .. } => {
            Ok(set.read_slice::<i64>(selection)?.iter().map(|value| *value as f64).collect())
        }
        hdf5_reader::Datatype::FixedPoint { size: 4, signed: true, .. } => {
            Ok(set.read_slice::<i32>(selection)?.iter().map(|value| f64::from(*value)).collect())
        }
        _ => Ok(set.read_slice::<f64>(selection)?.iter().copied().collect()),
    }
}

/// Positions times a unit: even ones if they are even as far as f32 tells, which USTB stores.
fn axis_of(values: &[f64], unit: f64) -> Axis {
    let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let (first, count) = (values.first().copied().unwrap_or(0.0), values.len());
    let pitch = (values.last().copied().unwrap_or(0.0) - first) / (count.max(2) - 1) as f64;
    let is_even =
        values.iter().enumerate().all(|(n, value)| (value - first - pitch * n as f64).abs() <= 1.5e-7 * largest);
    match is_even {
        true => Axis::Even { first: first * unit, pitch: pitch * unit, count },
        false => Axis::from_table(values.iter().map(|value| value * unit).collect()),
    }
}

/// A shape for users.
fn shown(shape: &[u64]) -> String {
    shape.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ")
}

/// A file, for messages.
struct File<'a> {
    path: &'a Path,
}

impl File<'_> {
    fn broken(&self, field: &str, error: &hdf5_reader::error::Error) -> InputError {
        InputError::new(self.path, field, format!("cannot be read: {error}"))
    }

    fn fault<T>(&self, field: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
        Err(InputError::new(self.path, field, fault))
    }

    /// The class of a group; empty without one.
    fn class(&self, group: &Group) -> String {
        let class = group.attribute("class").and_then(|class| class.read_string());
        class.map(|class| class.trim_end_matches('\0').trim().to_string()).unwrap_or_default()
    }

    /// The first group of beamformed data, by name.
    fn beamformed(&self, root: &Group) -> Result<Group, InputError> {
        let mut groups = root.groups().map_err(|e| self.broken("file", &e))?;
        groups.sort_by(|a, b| a.name().cmp(b.name()));
        let mut others: Vec<String> = Vec::new();
        for group in groups {
            match self.class(&group) {
                class if class == "uff.beamformed_data" => {
                    let array = group.attribute("array").and_then(|array| array.read_as_f64());
                    if array.is_ok_and(|array| array != 0.0) {
                        return self.fault(group.name(), "is an array of beamformed data; only single ones are read");
                    }
                    return Ok(group);
                }
                class if class.is_empty() || others.len() > 4 => {}
                class => others.push(quoted(&class)),
            }
        }
        match &others[..] {
            [] => self.fault("file", "is an HDF5 file, but not one of USTB with beamformed data (UFF)"),
            others => {
                let there = others.join(", ");
                self.fault("file", format!("holds {there}, but no beamformed data, which alone are read"))
            }
        }
    }

    /// The numbers of a vector.
    fn vector(&self, group: &Group, name: &str) -> Result<Option<Vec<f64>>, InputError> {
        let Ok(set) = group.dataset(name) else { return Ok(None) };
        let count = set.num_elements().map_err(|e| self.broken(name, &e))?;
        if !(1..=MAX_EXTENT).contains(&count) {
            return self.fault(name, format!("has {count} numbers, must have 1 to {MAX_EXTENT}"));
        }
        let all = |axis: usize| SliceInfoElem::Slice { start: 0, end: set.shape()[axis], step: 1 };
        let selection = SliceInfo { selections: (0..set.ndim()).map(all).collect() };
        let values = numbers(&set, &selection).map_err(|e| self.broken(name, &e))?;
        match values.iter().all(|value| value.is_finite()) {
            true => Ok(Some(values)),
            false => self.fault(name, "has a number that is not finite"),
        }
    }

    fn axis(&self, scan: &Group, name: &str) -> Result<Vec<f64>, InputError> {
        match self.vector(scan, name)? {
            Some(values) => Ok(values),
            None => self.fault(&format!("scan/{name}"), "is missing"),
        }
    }

    /// The geometry of a scan, and its class.
    fn probe(&self, scan: &Group) -> Result<(Probe, String), InputError> {
        let class = self.class(scan);
        let (is_sector, names) = match class.as_str() {
            "uff.linear_scan" | "uff.linear_scan_3D" => (false, ["z_axis", "x_axis", "y_axis"]),
            "uff.sector_scan" | "uff.sector_scan_3D" => (true, ["depth_axis", "azimuth_axis", "elevation_axis"]),
            other => {
                let read = "uff.linear_scan and uff.sector_scan, also in 3D";
                return self.fault("scan", format!("is of class {}; {read}, are read", quoted(other)));
            }
        };
        self.no_transform(scan)?;
        let depth = self.axis(scan, names[0])?;
        let lines = self.axis(scan, names[1])?;
        let slices = self.vector(scan, names[2])?.unwrap_or(vec![0.0]);
        for (name, values) in [(names[1], &lines), (names[2], &slices)] {
            if values.windows(2).any(|pair| pair[0] >= pair[1]) {
                return self.fault(&format!("scan/{name}"), "must rise from line to line");
            }
        }
        // Lengths from m to mm; angles stay.
        let unit = if is_sector { 1.0 } else { 1e3 };
        let scaled = |values: &[f64]| axis_of(values, unit);
        let (first, pitch) = self.even(names[0], &depth)?;
        let motion = match (slices.len(), is_sector) {
            (1, _) if slices[0].abs() > TOLERANCE => {
                return self
                    .fault(&format!("scan/{}", names[2]), "is a single plane beside the middle; that is not read");
            }
            (1, _) => Motion::Still { thickness: SLAB },
            // The plane turns about an axis through the apex: x = r sin(azimuth), and r cos(azimuth) lies in the turned plane.
            (_, true) => Motion::Fan { wobble_radius: 0.0 },
            (_, false) => Motion::Translated,
        };
        let slices = if slices.len() == 1 { Axis::centred(1.0, 1) } else { scaled(&slices) };
        let probe = Probe {
            array: if is_sector { Array::Curved { radius: 0.0 } } else { Array::Linear },
            lines: scaled(&lines),
            start_depth: first * 1e3,
            sample_pitch: pitch * 1e3,
            samples: depth.len(),
            motion,
            slices,
            advance: Advance::None,
            sound_speed: 1540.0,
        };
        probe.check().map_err(|e| InputError::new(self.path, "scan", format!("{}: {}", e.field, e.fault)))?;
        let [samples, lines] = [probe.samples as u64, probe.lines.len() as u64];
        match samples * lines * 8 <= MAX_FRAME_BYTES {
            true => Ok((probe, class.trim_start_matches("uff.").to_string())),
            false => self.fault("scan", format!("has frames of {lines} x {samples} pixels, too large")),
        }
    }

    /// First and pitch of an axis that is even to half a micrometre.
    fn even(&self, name: &str, values: &[f64]) -> Result<(f64, f64), InputError> {
        let field = format!("scan/{name}");
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return self.fault(&field, "is empty") };
        let pitch = (last - first) / (values.len().max(2) - 1) as f64;
        if values.len() < 2 || pitch.is_nan() || pitch <= 0.0 {
            return self.fault(&field, "must have two depths or more, which rise");
        }
        // Stored as f32, which is off by 6e-8 of the value.
        let tolerance = TOLERANCE.max(last.abs() * 1e-7);
        match values.iter().enumerate().all(|(n, value)| (value - first - pitch * n as f64).abs() <= tolerance) {
            true => Ok((*first, pitch)),
            false => self.fault(&field, "is not even: depths must be the same distance apart"),
        }
    }

    /// Refuses what moves pixels away from their axes: nested transforms, and several origins of scan lines.
    fn no_transform(&self, scan: &Group) -> Result<(), InputError> {
        let turned = scan.group("transform").and_then(|transform| transform.groups());
        if turned.is_ok_and(|groups| !groups.is_empty()) {
            return self.fault("scan/transform", "is there; scans that are moved by one are not read");
        }
        for name in ["origin", "apex"] {
            let Ok(origin) = scan.group(name) else { continue };
            let groups = origin.groups().map_err(|e| self.broken(name, &e))?;
            if !groups.is_empty() {
                return self.fault(&format!("scan/{name}"), "has several points; scan lines must have one apex");
            }
        }
        Ok(())
    }

    /// The members of the data and of their scan that are not read.
    fn unused(&self, data: &Group, scan: &Group, remarks: &mut Remarks) -> Result<Unused, InputError> {
        let mut unused = Unused::default();
        for (group, within) in [(data, ""), (scan, "scan/")] {
            let (groups, sets) = group.member_names().map_err(|e| self.broken("file", &e))?;
            for name in groups.into_iter().chain(sets) {
                let whole = format!("{within}{name}");
                let known = KEYS.iter().find(|key| key.name == whole);
                if known.is_some_and(|key| key.done == Use::Used) {
                    continue;
                }
                unused.note_as_it_is(&whole);
                if let Some(key) = known {
                    let value = self.numbers_in(group, &name)?;
                    not_used(self.path, key, &value, remarks)?;
                }
            }
        }
        Ok(unused)
    }

    /// The numbers of a group's datasets, as text; of an identity there is none.
    fn numbers_in(&self, parent: &Group, name: &str) -> Result<String, InputError> {
        let Ok(group) = parent.group(name) else { return Ok(String::new()) };
        let mut text = String::new();
        for set in group.datasets().map_err(|e| self.broken(name, &e))? {
            let values = self.vector(&group, set.name())?.unwrap_or_default();
            // An identity has ones on its diagonal and nothing else.
            let is_identity = values.len() == 9 && (0..9).all(|n| values[n] == f64::from(u8::from(n % 4 == 0)));
            values.iter().filter(|_| !is_identity).for_each(|value| text += &format!("{value} "));
        }
        Ok(text)
    }

    fn data(&self, group: &Group) -> Result<Data, InputError> {
        if let Ok(set) = group.dataset("data") {
            return Ok(Data::Real(Box::new(set)));
        }
        let Ok(parts) = group.group("data") else { return self.fault("data", "is missing") };
        let part = |name: &str| parts.dataset(name).map_err(|e| self.broken(&format!("data/{name}"), &e));
        let (real, imaginary) = (part("real")?, part("imag")?);
        match real.shape() == imaginary.shape() {
            true => Ok(Data::Complex(Box::new([real, imaginary]))),
            false => self.fault("data", "has a real part of another size than its imaginary one"),
        }
    }

    /// The number of volumes of data whose shape is frame, wave, channel, pixel.
    fn volumes(&self, data: &Data, pixels: u64) -> Result<usize, InputError> {
        let shape = data.parts()[0].shape();
        let shown = shown(shape);
        let [frames, others @ .., last] = shape else {
            return self.fault("data", format!("has the shape {shown}, must have two axes or more"));
        };
        if *last != pixels {
            return self.fault("data", format!("has {last} pixels, the scan has {pixels}"));
        }
        let (frames, others) = if shape.len() == 4 { (*frames, others) } else { (1, &shape[..shape.len() - 1]) };
        if shape.len() > 4 || others.iter().any(|n| *n != 1) {
            let fault = format!("has the shape {shown}: several channels or waves, which must be compounded first");
            return self.fault("data", fault);
        }
        match frames {
            1..=MAX_EXTENT => Ok(frames as usize),
            _ => self.fault("data", format!("has {frames} frames, must have 1 to {MAX_EXTENT}")),
        }
    }

    /// What a pass over the frames of data of a checked shape unpacks. `each`: pixels of a frame.
    fn chunks(&self, data: &Data, each: u64) -> Result<Chunks, InputError> {
        let mut sum = Chunks::default();
        for set in data.parts() {
            let product = |numbers: &[u64]| numbers.iter().fold(1, |all: u64, n| all.saturating_mul(*n));
            let size = set.raw_element_size().map_err(|e| self.broken("data", &e))? as u64;
            let shape = set.shape();
            let Some(chunk) = set.chunks().filter(|chunk| chunk.len() == shape.len()) else {
                sum.all = sum.all.saturating_add(product(shape).saturating_mul(size));
                continue;
            };
            // The reader refuses chunks of no size.
            let chunk: Vec<u64> = chunk.into_iter().map(|n| u64::from(n).max(1)).collect();
            let along: Vec<u64> = shape.iter().zip(&chunk).map(|(n, of)| n.div_ceil(*of)).collect();
            let bytes = product(&chunk).saturating_mul(size);
            let (last, holds) = (along.last().copied().unwrap_or(1), chunk.last().copied().unwrap_or(1));
            let several_volumes = shape.len() == 4 && shape[0] > 1 && chunk[0] > 1;
            // Chunks of several volumes are needed again for the next volume. Otherwise only the one between two frames is: twice the chunks
            // of a frame hold it, in whatever order a frame's chunks are read.
            let count = if several_volumes { last } else { product(&along).min(2 * (each.div_ceil(holds) + 1)) };
            sum.all = sum.all.saturating_add(product(&along).saturating_mul(bytes));
            sum.kept = sum.kept.saturating_add(count.saturating_mul(bytes));
            sum.count = sum.count.saturating_add(count);
            sum.chunk = chunk;
        }
        Ok(sum)
    }
}

impl Source for Beamformed {
    fn geometry(&self, _: usize) -> Geometry {
        Geometry::Sweep(self.probe.clone())
    }

    fn stored_type(&self) -> StoredType {
        if self.scale == Scale::Grey { StoredType::U8 } else { StoredType::F32 }
    }

    fn range(&self) -> [f64; 2] {
        if self.scale == Scale::Grey { [0.0, 255.0] } else { SHOWN }
    }

    fn volumes(&self) -> usize {
        self.volumes
    }

    fn frames_per_volume(&self) -> usize {
        self.probe.slices.len()
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        check_volume(&self.path, volume, self.volumes)?;
        self.next = volume * self.probe.slices.len();
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        let (number, each) = (self.next, self.probe.slices.len());
        if number >= self.volumes * each {
            return Ok(None);
        }
        let values = self.values(number)?;
        self.next += 1;
        let decibels = |value: f64| match self.scale {
            Scale::Amplitude { largest } => 20.0 * (value / largest).log10(),
            _ => value,
        };
        // What is not finite is an amplitude of 0, or was no number.
        let stored =
            |value: f64| Some(decibels(value)).filter(|db| *db > FLOOR && db.is_finite()).unwrap_or(FLOOR) as f32;
        let bytes = match self.scale {
            Scale::Grey => values.into_iter().map(|value| value as u8).collect(),
            _ => values.into_iter().flat_map(|value| stored(value).to_le_bytes()).collect(),
        };
        let (volume, slice) = ((number / each) as u32, number % each);
        Ok(Some(Frame::of_slice(volume, slice, bytes)))
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/uff").join(name)
    }

    fn frames(source: &mut Beamformed) -> Vec<Frame> {
        source.skip_to_volume(0).expect("the first volume");
        std::iter::from_fn(|| source.next_frame().expect("a frame")).collect()
    }

    /// Prevents that a chunk which is larger than the cache, or spans several volumes, is unpacked for every frame.
    #[test]
    fn each_chunk_is_unpacked_once_in_a_pass() {
        // One chunk each of real and imaginary parts; chunks of two volumes and 50 pixels.
        for (name, chunks) in [("sector-3d.uff", 2), ("chunked.uff", 18)] {
            let usual = frames(&mut Beamformed::open(&file(name)).expect("data"));
            let small = CacheLimits { usual: 256, ..CACHE };
            let mut source = Beamformed::open_within(&file(name), small).expect("data");
            let unpacked = |source: &Beamformed| source.data.parts()[0].chunk_cache_stats().misses;
            assert_eq!(unpacked(&source), chunks, "{name}: one pass");
            assert_eq!(frames(&mut source), usual, "{name}");
            assert!(unpacked(&source) <= 2 * chunks, "{name}: two passes, {}", unpacked(&source));
            // A cache that may not be as large is refused, rather than slow.
            let none = CacheLimits { usual: 256, most: 1024, ..CACHE };
            let error = Beamformed::open_within(&file(name), none).err().expect("refused").to_string();
            assert!(error.contains("must be in memory at once") && error.lines().count() == 1, "{error}");
        }
    }
}
