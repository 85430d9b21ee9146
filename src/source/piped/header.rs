//! The first line of a stream: what its frames are and where they lie.

use super::NAME;
use crate::probe::{Geometry, Grid, Probe, ProbeFile, Volumes};
use crate::source::recorder::Header;
use crate::source::{Frame, InputError, SampleType};
use serde::Deserialize;
use std::path::Path;

/// Most samples, lines and frames each.
const MOST: usize = 1 << 16;
const VERSION: u64 = 1;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(rename = "echolume")]
    _version: u64,
    samples: Option<usize>,
    lines: Option<usize>,
    frames: Option<usize>,
    #[serde(rename = "type")]
    sample: Sample,
    range: Option<[f64; 2]>,
    both_ways: Option<bool>,
    speed_ratio: Option<f64>,
    #[serde(default)]
    stamped: bool,
    lines_at_once: Option<usize>,
    probe: Option<serde_json::Value>,
    cartesian: Option<Lattice>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Sample {
    U8,
    U16,
    F32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Lattice {
    size: [usize; 3],
    spacing: [f64; 3],
    #[serde(default)]
    origin: [f64; 3],
}

/// What the first line says.
pub(super) struct Stream {
    pub header: Header,
    pub sample: SampleType,
    pub stamped: bool,
    pub lines: usize,
    /// As many as there are, where a frame is given in one piece.
    pub lines_at_once: usize,
    volumes: Volumes,
}

fn fault<T>(key: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
    Err(InputError::new(Path::new(NAME), key, fault))
}

impl Stream {
    /// # Errors
    /// A line that is no such header, or whose frames cannot be: too large, without a place, without a range. Nothing is allocated for them.
    pub fn parse(line: &[u8], probe: Option<ProbeFile>) -> Result<Stream, InputError> {
        let no_json = |e: serde_json::Error| InputError::new(Path::new(NAME), "header", e.to_string());
        let value: serde_json::Value = serde_json::from_slice(line).map_err(|e| {
            let fault = format!("is no line of JSON ({e}); a stream begins as that of tools/pipe_frames.py");
            InputError::new(Path::new(NAME), "header", fault)
        })?;
        // Before the keys, which another version may have others of.
        match value.get("echolume").map(serde_json::Value::as_u64) {
            Some(Some(VERSION)) => {}
            Some(_) => return fault("echolume", format!("must be {VERSION}, the version that this program reads")),
            None => return fault("header", "has no key \"echolume\": this is no stream of frames"),
        }
        let keys: Keys = serde_json::from_slice(line).map_err(no_json)?;
        let size = keys.size()?;
        let sample = match keys.sample {
            Sample::U8 => SampleType::U8,
            Sample::U16 => SampleType::U16,
            Sample::F32 => SampleType::F32,
        };
        let (forward, backward, volumes, range) = match keys.cartesian {
            Some(_) if keys.probe.is_some() || probe.is_some() => {
                return fault("cartesian", "and a probe say different things; only one can be there");
            }
            Some(_) if keys.speed_ratio.is_some() => {
                return fault("speed_ratio", "belongs to a probe, not to a lattice");
            }
            Some(Lattice { size, spacing, origin }) => {
                let geometry = Geometry::Cartesian(Grid { size, spacing, origin });
                let both_ways = keys.both_ways.unwrap_or(false);
                (geometry.clone(), geometry, Volumes { both_ways, ..Volumes::forward(size[2], 1) }, None)
            }
            None => {
                let of_stream = keys.probe.map(|tables| ProbeFile::from_json(Path::new(NAME), tables)).transpose()?;
                let Some(file) = probe.or(of_stream) else {
                    return fault(
                        "probe",
                        "is missing: neither it nor \"cartesian\" is there, and no probe file was given",
                    );
                };
                let (forward, backward, volumes) = swept(&file, size, keys.both_ways, keys.speed_ratio)?;
                (forward, backward, volumes, file.range())
            }
        };
        let range = match (keys.range.or(range), sample) {
            (Some(range), _) => range,
            (None, SampleType::U8) => [0.0, 255.0],
            (None, SampleType::U16 | SampleType::I16) => [0.0, 65535.0],
            (None, SampleType::F32) => return fault("range", "is missing: f32 needs the values that are 0 and 1"),
        };
        let header = Header { forward, backward, stored: sample.stored(), range };
        header.check().or_else(|(key, wrong)| fault(key, wrong))?;
        let lines = size[1];
        let lines_at_once = match keys.lines_at_once {
            Some(0) => return fault("lines_at_once", "is 0, must be at least 1"),
            given => given.unwrap_or(lines).min(lines),
        };
        Ok(Stream { header, sample, stamped: keys.stamped, lines, lines_at_once, volumes })
    }

    /// The frame of a place in the stream, from 0, without samples.
    pub fn frame(&self, index: u64, time: Option<f64>) -> Frame {
        let each = self.volumes.frames as u64;
        let (volume, number) = (index / each, (index % each) as usize);
        // The direction only tells even from odd.
        let backward = self.volumes.backward((volume % 2) as usize);
        Frame {
            volume: u32::try_from(volume).unwrap_or(u32::MAX),
            number: number as u32,
            slice: if backward { self.volumes.frames - 1 - number } else { number },
            backward,
            time,
            bytes: Vec::new(),
        }
    }
}

impl Keys {
    /// Samples, lines and frames, each 1 to [`MOST`].
    fn size(&self) -> Result<[usize; 3], InputError> {
        let given = [("samples", self.samples), ("lines", self.lines), ("frames", self.frames)];
        let mut size = [0; 3];
        for (axis, (key, given)) in given.into_iter().enumerate() {
            size[axis] = match (given, self.cartesian.as_ref().map(|lattice| lattice.size[axis])) {
                (Some(n), None) | (None, Some(n)) => n,
                (Some(n), Some(same)) if n == same => n,
                (Some(n), Some(other)) => return fault(key, format!("is {n}, but cartesian.size says {other}")),
                (None, None) => return fault(key, "is missing"),
            };
            if !(1..=MOST).contains(&size[axis]) {
                return fault(key, format!("is {}, must be 1 to {MOST}", size[axis]));
            }
        }
        Ok(size)
    }
}

/// Where the samples lie swept forwards and backwards, and how frames make up volumes.
fn swept(
    file: &ProbeFile,
    [samples, lines, frames]: [usize; 3],
    both_ways: Option<bool>,
    speed_ratio: Option<f64>,
) -> Result<(Geometry, Geometry, Volumes), InputError> {
    let (probe, mut volumes) = file.geometry(samples, lines, frames)?;
    if volumes.frames != frames {
        return fault("frames", format!("is {frames}, but the probe has {} a volume", volumes.frames));
    }
    volumes.both_ways = both_ways.unwrap_or(volumes.both_ways);
    volumes.speed_ratio = speed_ratio.unwrap_or(volumes.speed_ratio);
    if !(0.0..=1.0).contains(&volumes.speed_ratio) {
        return fault("speed_ratio", format!("is {}, must be 0 to 1", volumes.speed_ratio));
    }
    let going = |first_backward| {
        let advance = Volumes { first_backward, ..volumes.clone() }.advance(0, &probe.slices);
        Geometry::Sweep(Probe { advance, ..probe.clone() })
    };
    Ok((going(false), going(true), volumes))
}
