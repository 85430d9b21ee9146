//! Films of pictures: AV1 in MP4. A file is complete or absent.
//!
//! Colours are stored as BT.709 of limited range with half the resolution of brightness in both directions (4:2:0), which every player of
//! AV1 decodes.

use super::Picture;
use crate::files::Unfinished;
use rav1e::config::{RateControlConfig, SpeedSettings};
use rav1e::prelude::{
    ChromaSampling, ColorDescription, ColorPrimaries, EncoderConfig, EncoderStatus, FrameType, MatrixCoefficients,
    Packet, PixelRange, Rational, TransferCharacteristics,
};
use rav1e::{Config, Context};
use shiguredo_mp4::boxes::{Av01Box, Av1cBox, SampleEntry, VisualSampleEntryFields};
use shiguredo_mp4::mux::{Mp4FileMuxer, Mp4FileMuxerOptions, Sample};
use shiguredo_mp4::{TrackKind, Uint};
use std::io::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// Units of time of a film in a second: 24, 25, 30, 50 and 60 pictures a second are whole numbers of them.
const TIME_SCALE: NonZeroU32 = NonZeroU32::new(90_000).expect("not 0");
/// Quantizer, 0..=255: 41 to 46 dB for a rendered bone, see tests/cli/series.rs.
const QUANTIZER: usize = 60;
/// Preset between time and size, 0..=10: the fastest that keeps all tools against ringing at edges.
const SPEED: u8 = 8;
/// Pictures from one that is complete in itself to the next: a player jumps to these only.
const KEY_INTERVAL: u64 = 60;
/// Parts of a picture that are encoded at the same time.
const TILES: usize = 4;
/// Types of the units (OBU) of an AV1 stream.
const SEQUENCE_HEADER: u8 = 1;
const TEMPORAL_DELIMITER: u8 = 2;

/// Path of another program that encodes films. It is empty in this build, which has an encoder of its own.
///
/// # Errors
/// Never. A build without the feature `video` needs ffmpeg, and fails here if it is missing.
pub fn encoder() -> Result<PathBuf, &'static str> {
    Ok(PathBuf::new())
}

/// An MP4 file of pictures of one size that is being written. The encoder keeps about forty pictures for comparison; encoded pictures are
/// written at once.
pub struct FilmWriter {
    encoder: Context<u8>,
    muxer: Mp4FileMuxer,
    file: Unfinished,
    size: [u32; 2],
    /// Units of time of a picture.
    duration: u32,
    /// What a player must know before the first picture; taken with it.
    entry: Option<SampleEntry>,
    /// Bytes so far.
    length: u64,
}

impl FilmWriter {
    /// Begins a film of pictures of `size` pixels (width, height) at `rate` pictures a second.
    ///
    /// # Errors
    /// One line without the file's name: a size that AV1 does not have, a folder that cannot be written.
    pub fn create(path: &Path, size: [u32; 2], rate: f64) -> Result<FilmWriter, String> {
        let [width, height] = size.map(|n| n as usize);
        let duration = (f64::from(TIME_SCALE.get()) / rate).round().max(1.0) as u32;
        let colour = ColorDescription {
            color_primaries: ColorPrimaries::BT709,
            transfer_characteristics: TransferCharacteristics::SRGB,
            matrix_coefficients: MatrixCoefficients::BT709,
        };
        let settings = EncoderConfig {
            width,
            height,
            time_base: Rational::new(u64::from(duration), u64::from(TIME_SCALE.get())),
            bit_depth: 8,
            chroma_sampling: ChromaSampling::Cs420,
            pixel_range: PixelRange::Limited,
            color_description: Some(colour),
            min_key_frame_interval: KEY_INTERVAL / 4,
            max_key_frame_interval: KEY_INTERVAL,
            quantizer: QUANTIZER,
            tiles: TILES,
            speed_settings: SpeedSettings::from_preset(SPEED),
            ..EncoderConfig::default()
        };
        let config = Config::new().with_encoder_config(settings).with_rate_control(RateControlConfig::default());
        let encoder: Context<u8> =
            config.new_context().map_err(|e| format!("{width} x {height} pixels are no film: {e}"))?;
        let options = Mp4FileMuxerOptions { creation_timestamp: std::time::Duration::ZERO, ..Default::default() };
        let muxer = Mp4FileMuxer::with_options(options).map_err(|e| e.to_string())?;
        let mut file = Unfinished::create(path).map_err(|e| e.to_string())?;
        let start = muxer.initial_boxes_bytes();
        file.write_all(start).map_err(|e| e.to_string())?;
        let length = start.len() as u64;
        Ok(FilmWriter { encoder, muxer, file, size, duration, entry: None, length })
    }

    /// Appends a picture.
    ///
    /// # Errors
    /// One line: a picture of another size, a full disk, a signal.
    pub fn picture(&mut self, picture: &Picture) -> Result<(), String> {
        let [width, height] = self.size;
        if [picture.width, picture.height] != self.size || picture.rgba.len() != 4 * width as usize * height as usize {
            let (w, h) = (picture.width, picture.height);
            return Err(format!("a picture of {w} x {h} pixels is none of a film of {width} x {height}"));
        }
        let mut frame = self.encoder.new_frame();
        for ((plane, values), stride) in
            frame.planes.iter_mut().zip(planes(picture)).zip([width, width.div_ceil(2), width.div_ceil(2)])
        {
            plane.copy_from_raw_u8(&values, stride as usize, 1);
        }
        self.encoder.send_frame(frame).map_err(|e| e.to_string())?;
        self.take_packets()
    }

    /// Encodes the pictures that the encoder still holds, and renames the complete file to its path.
    ///
    /// # Errors
    /// One line: a fault of the encoder, a full disk, a signal.
    pub fn finish(mut self) -> Result<(), String> {
        self.encoder.flush();
        self.take_packets()?;
        let end = self.muxer.finalize().map_err(|e| e.to_string())?;
        let parts: Vec<(u64, Vec<u8>)> = end.offset_and_bytes_pairs().map(|(at, bytes)| (at, bytes.to_vec())).collect();
        for (at, bytes) in parts {
            // The index goes behind everything, the length of the samples where it was left open.
            match at == self.length {
                true => self.file.write_all(&bytes),
                false => self.file.patch(at, &bytes),
            }
            .map_err(|e| e.to_string())?;
            self.length = self.length.max(at + bytes.len() as u64);
        }
        self.file.complete().map_err(|e| e.to_string())
    }

    /// Writes the pictures that are encoded.
    fn take_packets(&mut self) -> Result<(), String> {
        loop {
            match self.encoder.receive_packet() {
                Ok(packet) => self.write(&packet)?,
                Err(EncoderStatus::Encoded) => {}
                Err(EncoderStatus::NeedMoreData | EncoderStatus::LimitReached) => return Ok(()),
                Err(fault) => return Err(format!("the film cannot be encoded: {fault}")),
            }
        }
    }

    fn write(&mut self, packet: &Packet<u8>) -> Result<(), String> {
        let units = units(&packet.data).ok_or("the encoder wrote no AV1")?;
        let keyframe = packet.frame_type == FrameType::KEY;
        let is_first = self.entry.is_none();
        if is_first {
            let header = units.iter().find(|(kind, _)| *kind == SEQUENCE_HEADER).map(|(_, bytes)| *bytes);
            self.entry = Some(self.sample_entry(header.ok_or("the encoder wrote no sequence header")?)?);
        }
        // Samples of MP4 are temporal units without their delimiters (AV1 in ISOBMFF, 2.4).
        let kept = units.iter().filter(|(kind, _)| *kind != TEMPORAL_DELIMITER);
        let stored: Vec<u8> = kept.flat_map(|(_, bytes)| *bytes).copied().collect();
        self.file.write_all(&stored).map_err(|e| e.to_string())?;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry: self.entry.clone().filter(|_| is_first),
            keyframe,
            timescale: TIME_SCALE,
            duration: self.duration,
            composition_time_offset: None,
            data_offset: self.length,
            data_size: stored.len(),
        };
        self.muxer.append_sample(&sample).map_err(|e| e.to_string())?;
        self.length += stored.len() as u64;
        Ok(())
    }

    fn sample_entry(&self, sequence_header: &[u8]) -> Result<SampleEntry, String> {
        let [width, height] = self.size.map(u16::try_from);
        let (Ok(width), Ok(height)) = (width, height) else {
            return Err("is wider or higher than 65535 pixels".into());
        };
        let record = self.encoder.container_sequence_header();
        let [_, profile, bits, ..] = record[..] else { return Err("the encoder describes nothing".into()) };
        let bit = |n: u8| bits >> n & 1;
        let visual = VisualSampleEntryFields {
            data_reference_index: VisualSampleEntryFields::DEFAULT_DATA_REFERENCE_INDEX,
            width,
            height,
            horizresolution: VisualSampleEntryFields::DEFAULT_HORIZRESOLUTION,
            vertresolution: VisualSampleEntryFields::DEFAULT_VERTRESOLUTION,
            frame_count: VisualSampleEntryFields::DEFAULT_FRAME_COUNT,
            compressorname: [0; 32],
            depth: VisualSampleEntryFields::DEFAULT_DEPTH,
        };
        let av1c_box = Av1cBox {
            seq_profile: Uint::new(profile >> 5),
            seq_level_idx_0: Uint::new(profile & 31),
            seq_tier_0: Uint::new(bit(7)),
            high_bitdepth: Uint::new(bit(6)),
            twelve_bit: Uint::new(bit(5)),
            monochrome: Uint::new(bit(4)),
            chroma_subsampling_x: Uint::new(bit(3)),
            chroma_subsampling_y: Uint::new(bit(2)),
            chroma_sample_position: Uint::new(bits & 3),
            initial_presentation_delay_minus_one: None,
            config_obus: sequence_header.to_vec(),
        };
        Ok(SampleEntry::Av01(Av01Box { visual, av1c_box, unknown_boxes: Vec::new() }))
    }
}

/// The units of a stream: type, and all bytes with the header. None if the bytes are no such stream, or a unit does not state its size.
fn units(mut stream: &[u8]) -> Option<Vec<(u8, &[u8])>> {
    let mut found = Vec::new();
    while let [header, ..] = *stream {
        let (kind, extension, has_size) = (header >> 3 & 15, usize::from(header >> 2 & 1), header >> 1 & 1 == 1);
        if !has_size {
            return None;
        }
        // The size is a number of up to eight bytes with seven bits each (leb128).
        let (mut size, mut at) = (0usize, 1 + extension);
        loop {
            let byte = *stream.get(at)?;
            let shift = 7 * (at - 1 - extension);
            if shift > 28 {
                return None;
            }
            size |= usize::from(byte & 127) << shift;
            at += 1;
            if byte & 128 == 0 {
                break;
            }
        }
        let (unit, rest) = stream.split_at_checked(at.checked_add(size)?)?;
        found.push((kind, unit));
        stream = rest;
    }
    Some(found)
}

/// Brightness and both colour differences of a picture, 8 bits of limited range (BT.709); those of colour are means of four pixels, of
/// fewer at an odd border.
fn planes(picture: &Picture) -> [Vec<u8>; 3] {
    let [width, height] = [picture.width as usize, picture.height as usize];
    let at = |x: usize, y: usize| {
        let n = 4 * (y * width + x);
        [0, 1, 2].map(|c| f32::from(picture.rgba[n + c]))
    };
    let brightness = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mut out = [Vec::with_capacity(width * height), Vec::new(), Vec::new()];
    for y in 0..height {
        out[0].extend((0..width).map(|x| (16.5 + brightness(at(x, y)) * 219.0 / 255.0) as u8));
    }
    for y in (0..height).step_by(2) {
        for x in (0..width).step_by(2) {
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                if x + dx < width && y + dy < height {
                    let pixel = at(x + dx, y + dy);
                    (0..3).for_each(|c| sum[c] += pixel[c]);
                    count += 1.0;
                }
            }
            let mean = sum.map(|v| v / count);
            let (grey, scale) = (brightness(mean), 224.0 / 255.0);
            out[1].push((128.5 + (mean[2] - grey) / 1.8556 * scale) as u8);
            out[2].push((128.5 + (mean[0] - grey) / 1.5748 * scale) as u8);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_become_those_of_bt_709() {
        // Of ITU-R BT.709: black, white, and red, green and blue of full strength in limited range.
        let colours = [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255]];
        let expected = [[16, 128, 128], [235, 128, 128], [63, 102, 240], [173, 42, 26], [32, 240, 118]];
        for (rgb, expected) in colours.into_iter().zip(expected) {
            let rgba: Vec<u8> = std::iter::repeat_n([rgb[0], rgb[1], rgb[2], 255], 9).flatten().collect();
            let [y, u, v] = planes(&Picture { width: 3, height: 3, rgba });
            assert_eq!([y.len(), u.len(), v.len()], [9, 4, 4]);
            assert!(y.iter().all(|p| *p == expected[0]) && u.iter().all(|p| *p == expected[1]), "{rgb:?} {y:?} {u:?}");
            assert!(v.iter().all(|p| *p == expected[2]), "{rgb:?}: {v:?}");
        }
    }

    #[test]
    fn units_are_found_by_their_sizes() {
        let long = [[0x0a, 0x80, 0x01].as_slice(), &[7; 128]].concat();
        let stream = [&[0x12, 0x00][..], &long, &[0x36, 0x00, 0x01, 0xff]].concat();
        let found = units(&stream).expect("a stream");
        assert_eq!(
            found.iter().map(|(kind, unit)| (*kind, unit.len())).collect::<Vec<_>>(),
            [(2, 2), (1, 131), (6, 4)]
        );
        for wrong in [&[0x10][..], &[0x12], &[0x12, 0x01], &[0x12, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01]] {
            assert_eq!(units(wrong), None, "{wrong:?}");
        }
    }
}
