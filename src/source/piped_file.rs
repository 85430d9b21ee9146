//! A stream of raw frames ([`super::piped`]) that was kept in a file: every frame has the same size, so that any can be read.

use super::describe::{self, Rows};
use super::frame::{Header, POSE_BYTES, Source, check_volume, read_pose};
use super::piped::{StreamHeader, first_line};
use super::piped_record::{self, BEFORE, Stamps};
use super::samples;
use crate::files::InputError;
use crate::files::progress::CountedFile;
use crate::probe::{Geometry, ProbeFile, World};
use crate::{Frame, SampleType, StoredType};
use glam::DAffine3;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A stream of frames that was saved in a file.
pub(super) struct PipedFile {
    path: PathBuf,
    probe_file: Option<PathBuf>,
    stream: StreamHeader,
    input: BufReader<CountedFile>,
    /// Offset of the first frame, bytes.
    start: u64,
    /// Whole volumes.
    volumes: usize,
    /// Bytes after the last whole volume.
    left_over: u64,
    next: u64,
    stamps: Stamps,
}

impl PipedFile {
    /// Opens a file and reads its first line. `probe`: path of the probe file to use instead of the probe in the stream.
    ///
    /// # Errors
    /// The file or the probe file cannot be read, the first line of the file is not a header, or the file has not one complete volume.
    pub fn open(path: &Path, probe: Option<&Path>) -> Result<PipedFile, InputError> {
        let unreadable = |e: std::io::Error| InputError::unreadable(path, &e);
        let file = CountedFile::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let mut input = BufReader::new(file);
        let line = first_line(&mut input)?;
        let start = line.len() as u64 + 1;
        let stream = StreamHeader::parse(&line, probe.map(ProbeFile::read).transpose()?)?;
        let samples = length.saturating_sub(start);
        let whole = (stream.volumes.frames * stream.record_bytes()) as u64;
        if samples < whole {
            let fault = format!("cut short, {samples} of the {whole} bytes of a volume are there");
            return Err(InputError::new(path, "samples", fault));
        }
        let volumes = usize::try_from(samples / whole).unwrap_or(usize::MAX);
        Ok(PipedFile {
            path: path.into(),
            probe_file: probe.map(Path::to_path_buf),
            stream,
            input,
            start,
            volumes,
            left_over: samples % whole,
            next: 0,
            stamps: Stamps::default(),
        })
    }

    /// A description for users: pairs of title and value.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        let header = &self.stream.header;
        rows.add("format", "stream of frames");
        rows.add("samples", self.stream.sample.to_string());
        rows.add_frame(matches!(header.forward, Geometry::Sweep(_)), header.forward.frame_size());
        let volumes = crate::probe::Volumes { count: self.volumes, ..self.stream.volumes.clone() };
        rows.add("volumes", describe::volumes(&volumes));
        if self.left_over > 0 {
            rows.add("more data", format!("{} bytes behind the last whole volume; not read", self.left_over));
        }
        rows.add_geometry(&header.forward);
        rows.add_range(header.range, "");
        rows
    }

    /// Where the first frame of these volumes that has a pose places the lattice.
    fn world_within(&self, volumes: Range<usize>) -> Option<World> {
        let Geometry::Cartesian(grid) = &self.stream.header.forward else { return None };
        World::posed(&self.first_pose(volumes)?, grid)
    }

    /// The first pose of the frames of these volumes, read without moving the position.
    fn first_pose(&self, volumes: Range<usize>) -> Option<DAffine3> {
        let stamp = if self.stream.stamped { size_of::<f64>() } else { 0 };
        let before = (stamp + if self.stream.checked { BEFORE } else { 0 }) as u64;
        let [first, end] = [volumes.start, volumes.end].map(|n| n.min(self.volumes) as u64 * self.frames());
        let mut file = File::open(&self.path).ok().filter(|_| self.stream.header.posed)?;
        for n in first..end {
            let mut pose = [0; POSE_BYTES];
            file.seek(SeekFrom::Start(self.start + n * self.stream.record_bytes() as u64 + before)).ok()?;
            file.read_exact(&mut pose).ok()?;
            if let Some(pose) = read_pose(&pose) {
                return Some(pose);
            }
        }
        None
    }

    /// Frames a volume.
    fn frames(&self) -> u64 {
        self.stream.volumes.frames as u64
    }
}

impl Source for PipedFile {
    fn geometry(&self, volume: usize) -> Geometry {
        let header = &self.stream.header;
        if self.stream.volumes.backward(volume) { header.backward.clone() } else { header.forward.clone() }
    }

    fn stored_type(&self) -> StoredType {
        self.stream.header.stored
    }

    fn sample_type(&self) -> SampleType {
        self.stream.sample
    }

    fn range(&self) -> [f64; 2] {
        self.stream.header.range
    }

    fn volumes(&self) -> usize {
        self.volumes
    }

    fn frames_per_volume(&self) -> usize {
        self.stream.volumes.frames
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        check_volume(&self.path, volume, self.volumes)?;
        self.next = volume as u64 * self.frames();
        self.stamps = Stamps::default();
        let at = self.start + self.next * self.stream.record_bytes() as u64;
        self.input.seek(SeekFrom::Start(at)).map(drop).map_err(|e| InputError::unreadable(&self.path, &e))
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        if self.next >= self.volumes as u64 * self.frames() {
            return Ok(None);
        }
        // The file has so many bytes.
        let mut bytes = vec![0; self.stream.record_bytes()];
        self.input.read_exact(&mut bytes).map_err(|e| InputError::unreadable(&self.path, &e))?;
        let found = match self.stream.checked {
            true => piped_record::content(&bytes),
            false => Some((self.next, &bytes[..])),
        };
        let Some((_, content)) = found.filter(|(number, _)| *number == self.next) else {
            let fault = format!(
                "frame {} (from 0) is damaged or missing; `echolume stream --source - --record FILE.frames` takes what is intact",
                self.next
            );
            return Err(InputError::new(&self.path, "frames", fault));
        };
        let name = self.path.display().to_string();
        let parts = self.stream.parts(content, &mut self.stamps).map_err(|error| error.renamed(&name))?;
        let mut frame = Frame { bytes: parts.samples.to_vec(), ..self.stream.frame(self.next, parts.time) };
        frame.pose = parts.pose.flatten();
        samples::store(self.stream.sample, false, &mut frame.bytes);
        self.next += 1;
        Ok(Some(frame))
    }

    fn header(&self) -> Header {
        self.stream.header.clone()
    }

    fn world(&self) -> Option<World> {
        self.world_within(0..self.volumes)
    }

    fn world_of(&self, volume: usize) -> Option<World> {
        self.world_within(volume..volume.saturating_add(1)).or_else(|| self.world())
    }

    /// Each frame states its pose, or that it has none.
    fn pose(&self) -> Option<DAffine3> {
        None
    }

    fn files(&self) -> Vec<PathBuf> {
        [self.path.clone()].into_iter().chain(self.probe_file.clone()).collect()
    }

    fn probe_file(&self) -> Option<&Path> {
        self.probe_file.as_deref()
    }
}
