//! Polar frames as a PLUS sequence (.mha), with their geometry in a probe file (NAME.probe.toml).

use super::frame::{DEMO_DATA, Source, VolumeFrames};
use crate::files::{InputError, Unfinished};
use crate::probe::{Geometry, ProbeFile, SampleType, Volumes};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Largest number of frames of a file. Their time stamps are in its header, which is at most 1 MiB long.
pub(super) const MAX_FRAMES: usize = 20_000;
const MAX_HEADER_BYTES: usize = 1 << 20;
/// Name of the MetaImage field for remarks.
pub(super) const COMMENT: &str = "Comment";

/// The volumes of a source that are written as a PLUS sequence.
pub struct Sequence {
    kept: Vec<CompleteVolume>,
    left_out: usize,
    /// Frames of a volume.
    frames: usize,
    header: String,
    probe: String,
}

/// The path of the probe file that belongs to a sequence: `sweep.probe.toml` beside `sweep.mha`.
pub fn probe_file_path(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(".probe.toml");
    path.with_file_name(name)
}

impl Sequence {
    /// Reads a source once to find its complete volumes, whose number goes into the header. `path`: that of the source, for messages.
    ///
    /// # Errors
    /// The source cannot be read, is not a sweep, or has no complete volume. There are more than 20000 frames or too many time stamps for a header of
    /// 1 MiB. No probe file can describe the probe.
    pub fn of(source: &mut dyn Source, path: &Path) -> Result<Sequence, InputError> {
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let (kept, left_out) = choose(source, path)?;
        let Some(first) = kept.first() else {
            return Err(fault("volumes", format!("none of {} is whole", source.volumes())));
        };
        let Geometry::Sweep(probe) = source.geometry(first.place) else {
            return Err(fault("geometry", "the frames are pictures, not scan lines; leave --sequence out".into()));
        };
        let frames = source.frames_per_volume();
        let volumes = Volumes {
            both_ways: kept.iter().any(|v| v.backward != first.backward),
            first_backward: first.backward,
            ..Volumes::forward(frames, kept.len())
        };
        let text = ProbeFile::to_toml(&probe, &volumes, source.range()).map_err(|e| fault("geometry", e))?;
        let times = kept.iter().flat_map(|v| &v.times).enumerate();
        let times = times.filter_map(|(n, time)| time.map(|t| (n, format!("{t:?}"))));
        let size = [probe.samples, probe.lines.len(), frames * kept.len()];
        let header = header(size, source.stored_type().into(), &comment(source.is_synthetic()), times);
        if header.len() > MAX_HEADER_BYTES {
            let why = format!("make a header of {} bytes, at most {MAX_HEADER_BYTES} are written", header.len());
            return Err(fault("time stamps", why));
        }
        Ok(Sequence { kept, left_out, frames, header, probe: text })
    }

    /// Number of volumes that are written.
    pub fn volumes(&self) -> usize {
        self.kept.len()
    }

    /// Number of frames that are written.
    pub fn frames(&self) -> usize {
        self.kept.len() * self.frames
    }

    /// Number of volumes that are not written: frames are missing, or two in a row have the same direction although directions alternate.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Writes the frames of the source that was given to [`Sequence::of`], in order of acquisition, and the probe file beside them
    /// ([`probe_file_path`]). `each` is called after every volume.
    ///
    /// # Errors
    /// The source can no longer be read or has changed, the extension is not .mha, or a file cannot be written. No incomplete sequence is left then.
    pub fn write(&self, source: &mut dyn Source, path: &Path, each: impl Fn()) -> Result<(), InputError> {
        write_both(path, &self.header, &self.probe, |file| {
            for volume in &self.kept {
                source.skip_to_volume(volume.place)?;
                for _ in 0..self.frames {
                    let frame = source.next_frame()?.filter(|frame| frame.volume == volume.number);
                    let gone = || InputError::new(path, "frames", "the input changed while it was being read");
                    file.write_all(&frame.ok_or_else(gone)?.bytes).map_err(|e| InputError::unwritable(path, &e))?;
                }
                each();
            }
            Ok(())
        })
    }
}

/// A complete volume.
struct CompleteVolume {
    /// Index in the source, from 0.
    place: usize,
    /// Volume number of its frames.
    number: u32,
    backward: bool,
    times: Vec<Option<f64>>,
}

/// The volumes of the sequence, and the number of those left out.
fn choose(source: &mut dyn Source, path: &Path) -> Result<(Vec<CompleteVolume>, usize), InputError> {
    let mut whole: Vec<CompleteVolume> = Vec::new();
    for place in 0..source.volumes() {
        whole.extend(volume(source, place)?);
        if whole.len() * source.frames_per_volume() > MAX_FRAMES {
            let fault = format!("make more than {MAX_FRAMES} frames, which a file does not hold");
            return Err(InputError::new(path, "volumes", fault));
        }
    }
    if whole.iter().any(|v| v.backward != whole[0].backward) {
        // A probe file can only describe directions that alternate.
        whole.dedup_by_key(|v| v.backward);
    }
    let left_out = source.volumes() - whole.len();
    Ok((whole, left_out))
}

/// A volume, if all its frames exist, in order.
fn volume(source: &mut dyn Source, place: usize) -> Result<Option<CompleteVolume>, InputError> {
    let count = source.frames_per_volume();
    let mut kept: Option<CompleteVolume> = None;
    let mut frames = VolumeFrames::of(source, place)?;
    for n in 0..count {
        let Some(frame) = frames.read()? else { return Ok(None) };
        let volume = kept.get_or_insert_with(|| CompleteVolume {
            place,
            number: frame.volume,
            backward: frame.backward,
            times: Vec::new(),
        });
        let slice = if frame.backward { count - 1 - n } else { n };
        if frame.backward != volume.backward || (frame.number as usize, frame.slice) != (n, slice) {
            return Ok(None);
        }
        volume.times.push(frame.time.filter(|t| t.is_finite()));
    }
    Ok(kept)
}

/// The header line that says that a sequence is of the phantom; empty if it is not.
pub(super) fn comment(is_synthetic: bool) -> String {
    if is_synthetic { format!("{COMMENT} = {DEMO_DATA}\n") } else { String::new() }
}

/// The header of a PLUS sequence. `more`: additional lines. `times`: index and time stamp, s, of each frame.
pub(super) fn header(
    [samples, lines, frames]: [usize; 3],
    sample: SampleType,
    more: &str,
    times: impl Iterator<Item = (usize, String)>,
) -> String {
    let kind = sample.metaimage();
    let mut text = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {samples} {lines} {frames}\nElementType = {kind}\nElementSpacing = 1 1 1\n\
         BinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         UltrasoundImageOrientation = FM\nUltrasoundImageType = BRIGHTNESS\n{more}"
    );
    for (frame, time) in times {
        text.push_str(&format!("Seq_Frame{frame:04}_Timestamp = {time}\n"));
    }
    text.push_str("ElementDataFile = LOCAL\n");
    text
}

fn unwritable(path: &Path) -> impl Fn(io::Error) -> InputError {
    move |e| InputError::unwritable(path, &e)
}

/// Writes a sequence and its probe file. If one of them cannot be written completely, no sequence is left. `samples` writes the samples after the
/// header.
///
/// # Errors
/// One line that names the file: its extension is wrong, or it cannot be written.
pub(super) fn write_both(
    path: &Path,
    header: &str,
    probe: &str,
    samples: impl FnOnce(&mut Unfinished) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !ending.eq_ignore_ascii_case("mha") {
        return Err(InputError::new(path, "file", "must end in .mha"));
    }
    if path.is_dir() {
        return Err(InputError::new(path, "file", "is a folder"));
    }
    let mut sequence = Unfinished::create(path).map_err(unwritable(path))?;
    sequence.write_all(header.as_bytes()).map_err(unwritable(path))?;
    samples(&mut sequence)?;
    sequence.finish().map_err(unwritable(path))?;
    let beside = probe_file_path(path);
    let mut geometry = Unfinished::create(&beside).map_err(unwritable(&beside))?;
    geometry.write_all(probe.as_bytes()).and_then(|()| geometry.finish()).map_err(unwritable(&beside))?;
    // The probe file first, so that frames never exist without it.
    geometry.rename().map_err(unwritable(&beside))?;
    sequence.rename().map_err(unwritable(path))
}
