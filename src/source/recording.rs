//! Recorded files (MetaImage, PLUS sequences, Kretz volumes), read one frame at a time in bounded memory.

use super::frame::{Frame, Source};
use super::layout::{Layout, LineOrder, PixelStream, StoredGeometry};
use super::samples::{self, Replaced, SampleType, StoredType};
use super::value_range::ValueRange;
use super::{describe, kretz, metaimage, recorder};
use crate::files::InputError;
use crate::probe::file::geometry_error;
use crate::probe::{Geometry, Grid, Probe, ProbeFile, Volumes};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// A recorded file that is read frame by frame.
pub struct Recording {
    path: PathBuf,
    layout: Layout,
    placement: Placement,
    volumes: Volumes,
    probe_file: Option<PathBuf>,
    range: [f64; 2],
    measured: bool,
    replaced: Replaced,
    /// Number of frames whose replaced samples were counted.
    counted: usize,
    /// Positioned at frame `next`; None after a rewind or an error.
    stream: Option<PixelStream>,
    next: usize,
    /// A complete frame was read, so that the next one may be allocated at once.
    proven: bool,
}

/// Geometry of all volumes, without the advance of each.
enum Placement {
    Sweep(Box<Probe>),
    Cartesian(Grid),
}

impl Recording {
    /// Opens a file. Its geometry comes from the given probe file, otherwise from `<stem>.probe.toml` in its folder, otherwise from the
    /// recording itself, otherwise from the `probe.toml` of the folder. All samples are read once unless the range of their values is
    /// known.
    ///
    /// # Errors
    /// A file that cannot be read, has an unknown format or is damaged, or a geometry that is missing or impossible.
    pub fn open(path: &Path, probe: Option<&Path>) -> Result<Recording, InputError> {
        let mut layout = read_layout(path)?;
        let probe_file = choose_probe_file(path, probe, &mut layout)?;
        let (placement, volumes) = match (&probe_file, &layout.geometry) {
            (Some(file), _) => {
                let (probe, volumes) = file.geometry(layout.frame_size[0], layout.frame_size[1], layout.frames)?;
                (Placement::Sweep(Box::new(probe)), volumes)
            }
            (None, StoredGeometry::Sweep(probe)) => {
                probe.check().map_err(|e| geometry_error(path, &e))?;
                (Placement::Sweep(probe.clone()), Volumes::forward(layout.frames, 1))
            }
            (None, StoredGeometry::Pictures(grid, count)) => {
                grid.check().map_err(|e| geometry_error(path, &e))?;
                (Placement::Cartesian(*grid), Volumes::forward(grid.size[2], *count))
            }
            (None, StoredGeometry::Missing(error)) => return Err(error.clone()),
        };
        let proven = !layout.pixels.compressed;
        let mut recording = Recording {
            path: path.into(),
            layout,
            placement,
            volumes,
            probe_file: probe_file.as_ref().map(|f| f.path().into()),
            range: [0.0, 255.0],
            measured: false,
            replaced: Replaced::default(),
            counted: 0,
            stream: None,
            next: 0,
            proven,
        };
        match probe_file.and_then(|f| f.range()) {
            Some(range) => recording.range = range.map(|v| v + recording.sample_type().shift()),
            None if recording.stored_type() == StoredType::U8 => {}
            None => recording.measure()?,
        }
        Ok(recording)
    }

    /// The file format: "MetaImage", "PLUS sequence", "MetaImage pre-scan sweep" or "Kretz volume".
    pub fn format(&self) -> &'static str {
        self.layout.format
    }

    /// Type of the samples in the file.
    pub fn sample_type(&self) -> SampleType {
        self.layout.sample
    }

    /// Type of the samples in the frames.
    pub fn stored_type(&self) -> StoredType {
        self.layout.sample.stored()
    }

    /// Number of all frames, including those after the last complete volume.
    pub fn frames_in_file(&self) -> usize {
        self.layout.frames
    }

    /// The recording, the file with its samples, and its probe file.
    pub fn files(&self) -> Vec<PathBuf> {
        [self.path.clone(), self.layout.pixels.path.clone()].into_iter().chain(self.probe_file.clone()).collect()
    }

    /// Number of complete volumes.
    pub fn volumes(&self) -> usize {
        self.volumes.count
    }

    pub fn frames_per_volume(&self) -> usize {
        self.volumes.frames
    }

    /// Geometry of a volume, including the motor's travel during each frame.
    pub fn geometry(&self, volume: usize) -> Geometry {
        match &self.placement {
            Placement::Sweep(probe) => {
                let advance = self.volumes.advance(volume, &probe.slices);
                Geometry::Sweep(Probe { advance, ..(**probe).clone() })
            }
            Placement::Cartesian(grid) => Geometry::Cartesian(*grid),
        }
    }

    /// Stored values that are shown as 0 and 1: those of the probe file, otherwise 0 and 255 for u8, otherwise the smallest and largest
    /// in the file without far outliers. The second is always above the first.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Number of samples that were NaN or infinite and read as 0, in the frames read so far; in all frames if the range was measured.
    pub fn replaced(&self) -> u64 {
        self.replaced.not_finite
    }

    /// Number of denormal f32 samples that read as 0, counted like [`Recording::replaced`].
    pub fn flushed(&self) -> u64 {
        self.replaced.denormal
    }

    /// The next frame in order of acquisition; None after the last complete volume.
    ///
    /// # Errors
    /// Data that cannot be read, are cut short or are corrupt.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        let index = self.next;
        if index >= self.frames_to_read() {
            return Ok(None);
        }
        let bytes = match self.read_frame() {
            Ok(bytes) => bytes,
            Err(error) => {
                self.stream = None;
                return Err(error);
            }
        };
        let (volume, number) = (index / self.volumes.frames, index % self.volumes.frames);
        let backward = self.volumes.backward(volume);
        Ok(Some(Frame {
            volume: volume as u32,
            number: number as u32,
            slice: if backward { self.volumes.frames - 1 - number } else { number },
            backward,
            time: self.layout.times.get(&index).copied(),
            bytes,
        }))
    }

    /// Moves back to the first frame.
    pub fn rewind(&mut self) {
        (self.stream, self.next) = (None, 0);
    }

    /// Moves to the first frame of a volume. In a compressed file all frames before it are inflated again.
    ///
    /// # Errors
    /// A volume that does not exist, or data that cannot be read.
    pub fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        if volume >= self.volumes.count {
            let there = self.volumes.count;
            return Err(InputError::new(
                &self.path,
                "volume",
                format!("there is no {volume}, the last is {}", there - 1),
            ));
        }
        let target = volume * self.volumes.frames;
        if target < self.next {
            self.stream = None;
        } else if let Some(mut stream) = self.stream.take() {
            stream.skip((target - self.next) as u64 * self.layout.frame_bytes()).map_err(|e| self.broken(&e, 0))?;
            self.stream = Some(stream);
        }
        self.next = target;
        Ok(())
    }

    /// A description of the file for users: pairs of title and value. Never a patient's name or number.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows: Vec<(String, String)> = Vec::new();
        let mut add = |title: &str, value: String| rows.push((title.into(), value));
        add("format", self.format().into());
        add("compression", if self.layout.pixels.compressed { "zlib" } else { "none" }.into());
        add("samples", self.sample_type().to_string());
        let [first, second] = self.layout.frame_size;
        match self.placement {
            Placement::Sweep(_) => add("frame", format!("{second} lines of {first} samples")),
            Placement::Cartesian(_) => add("frame", format!("{first} x {second} pixels")),
        }
        add("frames", self.layout.frames.to_string());
        add("volumes", describe::volumes(&self.volumes));
        add("geometry from", self.probe_file.as_ref().map_or("the file itself".into(), |p| describe::path(p)));
        match &self.placement {
            Placement::Sweep(probe) => rows.extend(describe::probe(probe)),
            Placement::Cartesian(grid) => rows.extend(describe::grid(grid)),
        }
        let [low, high] = self.range.map(|v| describe::number(v - self.sample_type().shift()));
        let how = if self.measured { " (measured)" } else { "" };
        rows.push(("value range".into(), format!("{low} .. {high}{how}")));
        if self.sample_type() == SampleType::F32 {
            let Replaced { not_finite, denormal } = self.replaced;
            rows.push(("replaced samples".into(), format!("{not_finite} not finite, {denormal} denormal")));
        }
        rows.extend(describe::times(&self.layout.times));
        rows.extend(self.layout.remarks.iter().cloned());
        rows
    }

    fn frames_to_read(&self) -> usize {
        self.volumes.count * self.volumes.frames
    }

    /// Reads all frames once for the smallest and largest value that is no outlier.
    fn measure(&mut self) -> Result<(), InputError> {
        let mut values = ValueRange::new(self.stored_type());
        while let Some(frame) = self.next_frame()? {
            values.take(&frame.bytes);
        }
        let measured = values.measured();
        self.range = measured.range;
        self.measured = true;
        if let Some(remark) = measured.remark() {
            tracing::warn!(file = %describe::path(&self.path), "{remark}");
        }
        self.rewind();
        Ok(())
    }

    fn read_frame(&mut self) -> Result<Vec<u8>, InputError> {
        let (index, size) = (self.next, self.layout.frame_bytes());
        let mut stream = match self.stream.take() {
            Some(stream) => stream,
            None => self.layout.pixels.open(index as u64 * size).map_err(|e| self.broken(&e, 0))?,
        };
        let mut bytes = Vec::with_capacity(if self.proven { size as usize } else { 0 });
        let outcome = stream.fill(size, &mut bytes);
        let outcome = outcome.and_then(|()| match bytes.len() as u64 == size {
            true => Ok(()),
            false => Err(io::ErrorKind::UnexpectedEof.into()),
        });
        outcome.map_err(|e| self.broken(&e, bytes.len()))?;
        self.proven = true;
        // The checksum at the end of a compressed stream shows whether all of it is intact.
        if index + 1 == self.layout.frames {
            let more = stream.finish().map_err(|e| self.broken(&e, bytes.len()))?;
            if more > 0 {
                tracing::warn!(file = %describe::path(&self.path), bytes = more, "more samples than frames; not read");
            }
        }
        let replaced = samples::store(self.layout.sample, self.layout.big_endian, &mut bytes);
        self.count(index, replaced);
        if matches!((&self.layout.line_order, &self.placement), (LineOrder::Reversed, Placement::Sweep(_))) {
            let line = self.layout.frame_size[0] * self.stored_type().bytes();
            bytes = bytes.rchunks_exact(line).flatten().copied().collect();
        }
        (self.stream, self.next) = (Some(stream), index + 1);
        Ok(bytes)
    }

    fn count(&mut self, index: usize, replaced: Replaced) {
        if index < self.counted {
            return;
        }
        self.counted = index + 1;
        if self.replaced == Replaced::default() && replaced != Replaced::default() {
            tracing::warn!(file = %describe::path(&self.path), frame = index, "samples that are not finite or are denormal read as 0");
        }
        self.replaced += replaced;
    }

    /// The error of reading the samples, `got` bytes into the current frame.
    fn broken(&self, error: &io::Error, got: usize) -> InputError {
        let size = self.layout.frame_bytes();
        let (got, claimed) = (self.next as u64 * size + got as u64, self.layout.frames as u64 * size);
        let fault = match error.kind() {
            io::ErrorKind::UnexpectedEof if got >= claimed => {
                "cut short, the end of the compressed stream is missing".into()
            }
            io::ErrorKind::UnexpectedEof => format!("cut short, {got} of {claimed} bytes are there"),
            io::ErrorKind::InvalidData => format!("{error} after {got} of {claimed} bytes"),
            _ => format!("cannot be read: {error}"),
        };
        InputError::new(&self.layout.pixels.path, "data", fault)
    }
}

/// The probe file to use. None if there is none, or if the `probe.toml` of the folder does not apply to this recording: it is for those
/// that do not state their own geometry.
fn choose_probe_file(path: &Path, given: Option<&Path>, layout: &mut Layout) -> Result<Option<ProbeFile>, InputError> {
    let found = given.map(Path::to_path_buf).or_else(|| ProbeFile::find_for(path));
    let Some(found) = found else { return Ok(None) };
    let is_for_all = given.is_none() && found.file_name().is_some_and(|n| n == "probe.toml");
    let mut leave_out = |why: &str| {
        layout.remarks.push(("not used".into(), format!("{}: {why}", describe::path(&found))));
        Ok(None)
    };
    if let LineOrder::Pictures(word) = &layout.line_order {
        if is_for_all {
            return leave_out("the frames are pictures, not scan lines");
        }
        let fault = format!("is {word}: pictures, not scan lines, so {} does not apply", describe::path(&found));
        return Err(InputError::new(path, "UltrasoundImageOrientation", fault));
    }
    if is_for_all && layout.states_geometry {
        return leave_out("the recording states its own geometry; --probe overrides it");
    }
    ProbeFile::read(&found).map(Some)
}

/// Reads the layout of a file with the reader for its content, or else for the extension of its name.
fn read_layout(path: &Path) -> Result<Layout, InputError> {
    let unreadable = |e| InputError::unreadable(path, &e);
    // A pipe or a folder has no size to check claims against, and opening a pipe may block for ever.
    if !fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(InputError::new(path, "file", "is not a regular file"));
    }
    let file = File::open(path).map_err(unreadable)?;
    let mut start = Vec::new();
    file.take(64).read_to_end(&mut start).map_err(unreadable)?;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if start.starts_with(b"KRETZFILE") {
        kretz::read(path)
    } else if start.starts_with(b"ObjectType") || start.starts_with(b"NDims") || ["mha", "mhd"].contains(&&*ending) {
        metaimage::read(path)
    } else if recorder::Reader::is_one(&start) {
        Err(InputError::new(path, "file", "holds frames as they arrived, not a recording"))
    } else {
        Err(InputError::new(path, "file", "is of no known format; MetaImage (.mha, .mhd) and Kretz (.vol) are read"))
    }
}

impl Source for Recording {
    fn geometry(&self, volume: usize) -> Geometry {
        self.geometry(volume)
    }

    fn stored_type(&self) -> StoredType {
        self.stored_type()
    }

    fn sample_type(&self) -> SampleType {
        self.sample_type()
    }

    fn range(&self) -> [f64; 2] {
        self.range()
    }

    fn volumes(&self) -> usize {
        self.volumes()
    }

    fn frames_per_volume(&self) -> usize {
        self.frames_per_volume()
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.skip_to_volume(volume)
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        self.next_frame()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.files()
    }

    fn probe_file(&self) -> Option<&Path> {
        self.probe_file.as_deref()
    }
}
