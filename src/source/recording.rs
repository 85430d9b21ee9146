//! Recorded files (MetaImage, PLUS sequences, Kretz volumes), read one frame at a time in bounded memory.

use super::OpenOptions;
use super::describe::{self, Rows};
use super::drawn::Drawn;
use super::formats::read_layout;
use super::frame::{check_memory, check_volume};
use super::keys::Unused;
use super::layout::{Layout, LineOrder, StoredGeometry};
use super::packed::{Encoding, PixelStream};
use super::samples::Replaced;
use super::transforms::Poses;
use super::value_range::ValueRange;
use crate::files::{InputError, progress};
use crate::probe::file::geometry_error;
use crate::probe::{Geometry, Probe, ProbeFile, Volumes, World};
use crate::{Frame, SampleType, Source, StoredType};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// A recorded file whose frames are read one by one.
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
    /// A volume in drawn order, with its number, where drawn slices are not stored frames.
    turned: Option<(usize, Vec<u8>)>,
    /// The next frame of it, counted from the first of the file.
    next_drawn: usize,
}

/// Geometry of all volumes, without the advance of each.
enum Placement {
    Sweep(Box<Probe>),
    Cartesian(Box<Drawn>),
}

impl Recording {
    /// Opens a recording with default options ([`Recording::open_with`]). `probe`: path of the probe file; None: the one that belongs to the
    /// recording, if there is one.
    ///
    /// # Errors
    /// That of [`Recording::open_with`].
    pub fn open(path: &Path, probe: Option<&Path>) -> Result<Recording, InputError> {
        Recording::open_with(path, OpenOptions { probe, ..OpenOptions::default() })
    }

    /// Opens a file. Its geometry comes from the given probe file, otherwise from `<stem>.probe.toml` in its folder, otherwise from the
    /// recording itself, otherwise from the `probe.toml` of the folder. All samples are read once unless the range of their values is
    /// known.
    ///
    /// # Errors
    /// The file cannot be read, has an unknown format or is damaged, its geometry is missing or impossible, or its volume is too large. Another error
    /// is an option that does not fit the recording, such as a depth axis for one that is not Cartesian.
    pub fn open_with(path: &Path, options: OpenOptions) -> Result<Recording, InputError> {
        let mut layout = read_layout(path, &options)?;
        let probe_file = choose_probe_file(path, options.probe, &mut layout)?;
        let is_cartesian = probe_file.is_none() && matches!(layout.geometry, StoredGeometry::Cartesian(_));
        if options.depth_axis.is_some() && !is_cartesian {
            let why = "is for Cartesian volumes; the probe says where depth is";
            return Err(InputError::new(path, "--depth-axis", why));
        }
        let stored_bytes = layout.pixel.sample().bytes();
        let mut remarks = Vec::from_iter(layout.pixel.remark().map(|text| ("pixels".to_string(), text)));
        let (placement, volumes) = match (&probe_file, &layout.geometry) {
            (Some(file), _) => {
                let file = file.clone().timed(interval(&layout.times));
                let (probe, volumes) = file.geometry(layout.frame_size[0], layout.frame_size[1], layout.frames)?;
                (Placement::Sweep(Box::new(probe)), volumes)
            }
            (None, StoredGeometry::Sweep(probe)) => {
                probe.check().map_err(|e| geometry_error(path, &e))?;
                let frames = layout.frames / layout.volumes.max(1);
                let volumes = Volumes { first_backward: layout.backward, ..Volumes::forward(frames, layout.volumes) };
                (Placement::Sweep(probe.clone()), volumes)
            }
            (None, StoredGeometry::Cartesian(file)) => {
                let drawn = Drawn::new(path, file, options.depth_axis, stored_bytes, &mut remarks)?;
                (Placement::Cartesian(Box::new(drawn)), Volumes::forward(file.size[2], file.volumes))
            }
            (None, StoredGeometry::Missing(error)) => return Err(error.clone()),
        };
        for (_, text) in remarks.iter().filter(|(title, _)| title == "handedness") {
            tracing::warn!(file = %describe::path(path), "{text}");
        }
        layout.remarks.extend(remarks);
        let proven = !layout.pixels.is_compressed();
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
            turned: None,
            next_drawn: 0,
        };
        check_memory(path, &recording.geometry(0), recording.stored_type())?;
        match probe_file.and_then(|f| f.range()) {
            Some(range) => recording.range = range.map(|v| v + recording.sample_type().shift()),
            None if recording.stored_type() == StoredType::U8 => {}
            None => recording.measure()?,
        }
        Ok(recording)
    }

    /// Name of the file format, for users, such as "MetaImage", "PLUS sequence", "Kretz volume" or "stack of pictures".
    pub fn format(&self) -> &'static str {
        self.layout.format
    }

    /// The transforms of tracked frames, by the name of the transform and the index of the frame in the file.
    pub(super) fn poses(&self) -> &Poses {
        &self.layout.poses
    }

    /// Logs, if pictures are tracked, that they are shown as single pictures, and which options make a volume of them. Without the warning the
    /// first picture could be taken for the sweep.
    pub(super) fn warn_of_tracking(&self) {
        let is_single = self.frames_per_volume() == 1 && self.volumes() > 1;
        if let Some((_, how)) = self.poses().remark().filter(|_| is_single) {
            let (file, count) = (describe::path(&self.path), self.volumes());
            tracing::warn!(%file, "{count} single pictures, not one volume; tracking: {how}");
        }
    }

    /// Number of samples that were NaN or infinite and were replaced by 0: in the frames read so far, or in all frames if the range was
    /// measured.
    pub fn replaced(&self) -> u64 {
        self.replaced.not_finite
    }

    /// Number of denormal f32 samples that were replaced by 0: in the frames read so far, or in all frames if the range was measured.
    pub fn flushed(&self) -> u64 {
        self.replaced.denormal
    }

    /// Moves back to the first frame.
    pub fn rewind(&mut self) {
        (self.stream, self.next, self.next_drawn) = (None, 0, 0);
    }

    /// True if drawn slices are not stored frames.
    fn is_turned(&self) -> bool {
        matches!(&self.placement, Placement::Cartesian(drawn) if !drawn.order.keeps_frames())
    }

    /// The next frame of a volume that is put together in memory.
    fn next_turned(&mut self) -> Result<Option<Frame>, InputError> {
        let slices = self.frames_per_volume();
        let (volume, number) = (self.next_drawn / slices, self.next_drawn % slices);
        let Placement::Cartesian(drawn) = &self.placement else { return Ok(None) };
        let (order, stored, [columns, rows, _]) = (drawn.order, drawn.stored, drawn.grid.size);
        if volume >= self.volumes.count {
            return Ok(None);
        }
        let width = self.stored_type().bytes();
        if self.turned.as_ref().is_none_or(|(there, _)| *there != volume) {
            self.turned = None;
            if self.next != volume * stored[2] {
                (self.stream, self.next) = (None, volume * stored[2]);
            }
            let mut all = Vec::new();
            for _ in 0..stored[2] {
                all.extend(self.read_frame()?);
            }
            self.turned = Some((volume, order.reorder(&all, stored, width)));
        }
        let slice = columns * rows * width;
        let whole = self.turned.as_ref().map(|(_, whole)| &whole[..]).unwrap_or_default();
        let bytes = whole.get(number * slice..(number + 1) * slice).unwrap_or_default().to_vec();
        self.next_drawn += 1;
        let time = self.layout.times.get(&(volume * stored[2])).copied();
        Ok(Some(Frame { time, ..Frame::of_slice(volume as u32, number, bytes) }))
    }

    /// A description of the file for users: pairs of title and value. Never a patient's name or number.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        rows.add("format", self.format());
        rows.add("compression", self.layout.pixels.encoding.name());
        rows.add("samples", self.sample_type().to_string());
        rows.add_frame(matches!(self.placement, Placement::Sweep(_)), self.layout.frame_size);
        rows.add("frames", self.layout.frames.to_string());
        rows.add("volumes", describe::volumes(&self.volumes));
        rows.add("geometry from", self.probe_file.as_ref().map_or("the file itself".into(), |p| describe::path(p)));
        match &self.placement {
            Placement::Sweep(probe) => rows.extend(describe::probe(probe)),
            Placement::Cartesian(drawn) => {
                rows.extend(describe::grid(&drawn.grid));
                rows.extend(drawn.description());
            }
        }
        let how = if self.measured { " (measured)" } else { "" };
        rows.add_range(self.range.map(|v| v - self.sample_type().shift()), how);
        if self.sample_type() == SampleType::F32 {
            let Replaced { not_finite, denormal } = self.replaced;
            rows.add("replaced samples", format!("{not_finite} not finite, {denormal} denormal"));
        }
        rows.extend(describe::times(&self.layout.times));
        rows.extend(self.layout.remarks.iter().cloned());
        rows
    }

    /// Names of keys that the file states and that were not used.
    pub fn unused(&self) -> &Unused {
        &self.layout.unused
    }

    /// Reads all frames once for the smallest and largest value that is no outlier.
    fn measure(&mut self) -> Result<(), InputError> {
        let mut values = ValueRange::new(self.stored_type());
        progress::expect_bytes(self.layout.pixels.length);
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

    /// Reads the next frame of the file. After an error the file is opened again.
    fn read_frame(&mut self) -> Result<Vec<u8>, InputError> {
        let (index, size) = (self.next, self.layout.frame_bytes());
        let mut stream = match self.stream.take() {
            Some(stream) => stream,
            None => self.layout.pixels.open(index as u64 * size).map_err(|e| self.broken(&e, 0))?,
        };
        let mut bytes = Vec::with_capacity(if self.proven { size as usize } else { 0 });
        stream.fill_whole(size, &mut bytes).map_err(|e| self.broken(&e, bytes.len()))?;
        self.proven = true;
        // The checksum at the end of a compressed stream shows whether all of it is intact.
        if index + 1 == self.layout.frames {
            let more = stream.finish().map_err(|e| self.broken(&e, bytes.len()))?;
            if more > 0 {
                tracing::warn!(file = %describe::path(&self.path), bytes = more, "more samples than frames; not read");
            }
        }
        let (mut bytes, replaced) = self.layout.pixel.convert(bytes);
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

/// The median time from a frame to the next, s; None if no two that follow each other have time stamps that rise.
fn interval(times: &BTreeMap<usize, f64>) -> Option<f64> {
    let next = |(index, time): (&usize, &f64)| times.get(&(index + 1)).map(|next| next - time);
    let mut intervals: Vec<f64> = times.iter().filter_map(next).filter(|interval| *interval > 0.0).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).copied()
}

/// The probe file to use. None if there is none, or if the `probe.toml` of the folder does not apply to this recording: it is for those
/// that do not state their own geometry.
fn choose_probe_file(path: &Path, given: Option<&Path>, layout: &mut Layout) -> Result<Option<ProbeFile>, InputError> {
    let is_stack = layout.pixels.encoding == Encoding::Pictures;
    if is_stack && layout.states_geometry {
        return Ok(None);
    }
    // A stack has the probe file of its first picture.
    let first =
        layout.pixels.gathered.iter().filter(|_| is_stack).find_map(|pictures| pictures.files().into_iter().next());
    let found = given.map(Path::to_path_buf).or_else(|| ProbeFile::find_for(first.as_deref().unwrap_or(path)));
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

impl Source for Recording {
    fn goes_back(&self) -> bool {
        self.volumes.backward(0)
    }

    fn geometry(&self, volume: usize) -> Geometry {
        match &self.placement {
            Placement::Sweep(probe) => Geometry::Sweep(self.volumes.swept(volume, probe)),
            Placement::Cartesian(drawn) => Geometry::Cartesian(drawn.grid),
        }
    }

    fn stored_type(&self) -> StoredType {
        self.layout.pixel.sample().stored()
    }

    fn sample_type(&self) -> SampleType {
        self.layout.pixel.sample()
    }

    /// Stored values that are shown as 0 and 1: those of the probe file, otherwise 0 and 255 for u8, otherwise the smallest and largest
    /// in the file without far outliers. The second is always above the first.
    fn range(&self) -> [f64; 2] {
        self.range
    }

    fn volumes(&self) -> usize {
        self.volumes.count
    }

    fn frames_per_volume(&self) -> usize {
        match &self.placement {
            Placement::Sweep(_) => self.volumes.frames,
            Placement::Cartesian(drawn) => drawn.grid.size[2],
        }
    }

    /// In a compressed file all frames before the volume are inflated again.
    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        check_volume(&self.path, volume, self.volumes.count)?;
        self.next_drawn = volume * self.frames_per_volume();
        if self.is_turned() {
            return Ok(());
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

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        if self.is_turned() {
            return self.next_turned();
        }
        let index = self.next;
        if index >= self.volumes.count * self.volumes.frames {
            return Ok(None);
        }
        let bytes = self.read_frame()?;
        let (volume, number) = (index / self.volumes.frames, index % self.volumes.frames);
        let backward = self.volumes.backward(volume);
        let (bytes, slice) = match &self.placement {
            Placement::Cartesian(drawn) if !drawn.is_stored() => {
                drawn.frame(&bytes, number, self.stored_type().bytes())
            }
            _ => (bytes, if backward { self.volumes.frames - 1 - number } else { number }),
        };
        let time = self.layout.times.get(&index).copied();
        let frame = Frame::of_slice(volume as u32, slice, bytes);
        Ok(Some(Frame { number: number as u32, backward, time, ..frame }))
    }

    fn is_synthetic(&self) -> bool {
        self.layout.synthetic
    }

    /// Slices that are no stored frames need the whole first volume.
    fn prepare(&mut self) -> Result<(), InputError> {
        if !self.is_turned() || self.turned.is_some() {
            return Ok(());
        }
        progress::expect_bytes(self.layout.pixels.length / self.volumes.count.max(1) as u64);
        let first = self.next_turned();
        self.next_drawn = 0;
        first.map(drop)
    }

    /// The recording, the file with its samples, and its probe file.
    fn files(&self) -> Vec<PathBuf> {
        let files = [self.path.clone()].into_iter().chain(self.layout.pixels.files());
        files.chain(self.probe_file.clone()).collect()
    }

    fn world(&self) -> Option<World> {
        match &self.placement {
            Placement::Sweep(_) => None,
            Placement::Cartesian(drawn) => Some(drawn.world),
        }
    }

    fn probe_file(&self) -> Option<&Path> {
        self.probe_file.as_deref()
    }
}
