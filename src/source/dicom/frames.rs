//! The frames of DICOM files as one stream of samples: native, RLE (PS3.5 annex G) or one of the JPEGs, in any order, cut to a part of the picture.

use super::super::gathered::Decoded;
use super::classes::Coding;
use super::image::{Arrangement, Image};
use super::jpeg::{self, Expected};
use crate::files::progress::CountedFile;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// The frames of one or more DICOM files, with all that is needed to decode them.
pub(super) struct Frames {
    pub(super) files: Vec<PathBuf>,
    /// The pixels of all files. Its places are in the order in which frames are read.
    pub(super) image: Image,
    /// The part of each picture that is read: first column, first row, columns and rows.
    pub(super) part: [usize; 4],
}

impl Frames {
    /// Bytes of one number after decoding.
    fn width(&self) -> usize {
        self.image.pixel.number.bytes()
    }

    /// Numbers of a pixel after decoding.
    fn channels(&self) -> usize {
        self.image.pixel.channels
    }

    /// A frame as it is stored, without its compression.
    fn stored(&self) -> Expected {
        let (channels, width) = match &self.image.arrangement {
            Arrangement::Luma | Arrangement::LumaPlane => (3, self.width()),
            Arrangement::LumaPairs => (2, self.width()),
            Arrangement::Palette(palette) => (1, palette.numbers.width),
            Arrangement::Plain | Arrangement::Planes => (self.channels(), self.width()),
        };
        Expected { size: self.image.size, channels, width }
    }

    fn arranged(&self, mut numbers: Vec<u8>) -> Vec<u8> {
        match &self.image.arrangement {
            Arrangement::Plain => numbers,
            Arrangement::Luma => numbers.chunks_exact(3).map(|pixel| pixel[0]).collect(),
            Arrangement::LumaPairs => numbers.chunks_exact(4).flat_map(|pair| [pair[0], pair[1]]).collect(),
            Arrangement::LumaPlane => {
                numbers.truncate(numbers.len() / 3);
                numbers
            }
            Arrangement::Palette(palette) => palette.greys(&numbers),
            Arrangement::Planes => {
                let (width, channels) = (self.width(), self.channels());
                let plane = numbers.len() / channels.max(1);
                let mut pixels = Vec::with_capacity(numbers.len());
                for at in (0..plane).step_by(width.max(1)) {
                    for channel in 0..channels {
                        let from = channel * plane + at;
                        pixels.extend_from_slice(numbers.get(from..from + width).unwrap_or_default());
                    }
                }
                pixels
            }
        }
    }

    fn cut(&self, pixels: &[u8]) -> Vec<u8> {
        let [x, y, columns, rows] = self.part;
        let width = self.width() * self.channels();
        let line = self.image.size[0] * width;
        let lines = pixels.chunks_exact(line.max(1)).skip(y).take(rows);
        lines.flat_map(|line| line.get(x * width..(x + columns) * width).unwrap_or_default()).copied().collect()
    }
}

impl Decoded for Frames {
    fn each(&self) -> usize {
        self.part[2] * self.part[3] * self.width() * self.channels()
    }

    fn decode(&self, number: usize) -> io::Result<Vec<u8>> {
        let Some(place) = self.image.places.get(number) else { return Ok(Vec::new()) };
        let (Some(path), Some(parts)) =
            (self.files.get(place.file), self.image.parts.get(place.first..place.first + place.count))
        else {
            return Ok(Vec::new());
        };
        let mut file = CountedFile::open(path)?;
        let (mut bytes, stored) = (Vec::new(), self.stored());
        for (offset, length) in parts {
            // Whole words.
            let before = u64::from(self.image.swapped && place.odd);
            let length = if self.image.swapped { (length + before).next_multiple_of(2) } else { *length };
            file.seek(SeekFrom::Start(offset.saturating_sub(before)))?;
            (&mut file).take(length).read_to_end(&mut bytes)?;
        }
        if self.image.swapped {
            bytes.as_chunks_mut::<2>().0.iter_mut().for_each(|word| word.swap(0, 1));
            bytes.drain(..usize::from(place.odd).min(bytes.len()));
            bytes.truncate(stored.bytes());
        }
        let numbers = match self.image.coding {
            Coding::Native => Ok(bytes),
            Coding::Rle => unpacked(&bytes, stored.size[0] * stored.size[1], stored.width, stored.channels),
            Coding::Jpeg => jpeg::baseline(&bytes, stored),
            Coding::JpegLossless => jpeg::lossless(&bytes, stored),
            Coding::Jpeg2000 => jpeg::jpeg_2000(&bytes, stored),
        };
        let wrong = |why| io::Error::new(io::ErrorKind::InvalidData, format!("frame {number} {why}"));
        let numbers = numbers.map_err(wrong)?;
        if numbers.len() != stored.bytes() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(self.cut(&self.arranged(numbers)))
    }

    fn files(&self) -> &[PathBuf] {
        &self.files
    }
}

/// RLE: 64 bytes say where up to 15 segments begin, one for each byte of a number, the highest first, channel after channel. Returns the
/// numbers in little-endian order, pixel by pixel.
fn unpacked(bytes: &[u8], pixels: usize, width: usize, channels: usize) -> Result<Vec<u8>, String> {
    let Some(head) = bytes.first_chunk::<64>() else {
        return Err("is cut short: its table of segments is missing".into());
    };
    let head: Vec<usize> = head.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b) as usize).collect();
    let count = width * channels;
    if head[0] != count {
        return Err(format!("has {} segments, must have {count}", head[0]));
    }
    let mut out = vec![0; pixels * count];
    for segment in 0..count {
        let from = head[segment + 1];
        let to = if segment + 1 < count { head[segment + 2] } else { bytes.len() };
        let Some(packed) = bytes.get(from..to) else { return Err(format!("has no segment {segment}")) };
        let (channel, byte) = (segment / width, width - 1 - segment % width);
        let places = out.iter_mut().skip(channel * width + byte).step_by(count);
        let filled = places.zip(PackBits { bytes: packed, copies: 0, same: None }).map(|(place, value)| *place = value);
        if filled.count() != pixels {
            return Err(format!("is cut short in segment {segment}"));
        }
    }
    Ok(out)
}

/// The bytes of a PackBits stream.
struct PackBits<'a> {
    bytes: &'a [u8],
    /// Bytes of the present run that are still to come.
    copies: usize,
    /// The byte that is repeated; None if each is its own.
    same: Option<u8>,
}

impl Iterator for PackBits<'_> {
    type Item = u8;

    fn next(&mut self) -> Option<u8> {
        while self.copies == 0 {
            let (code, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            match *code {
                128 => {}
                literal @ 0..128 => (self.copies, self.same) = (usize::from(literal) + 1, None),
                run => {
                    let (value, rest) = self.bytes.split_first()?;
                    (self.bytes, self.copies, self.same) = (rest, 257 - usize::from(run), Some(*value));
                }
            }
        }
        self.copies -= 1;
        self.same.or_else(|| {
            let (value, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            Some(*value)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::pixel::{Number, PixelFormat};
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn runs_and_literals_of_every_length_are_unpacked() {
        let packed = [2, 7, 8, 9, 128, 254, 5, 0, 1, 129, 3];
        let all: Vec<u8> = PackBits { bytes: &packed, copies: 0, same: None }.collect();
        assert_eq!(all, [vec![7, 8, 9, 5, 5, 5, 1], vec![3; 128]].concat());
        let cut: Vec<u8> = PackBits { bytes: &[5, 1, 2], copies: 0, same: None }.collect();
        assert_eq!(cut, [1, 2]);
        assert_eq!(PackBits { bytes: &[200], copies: 0, same: None }.count(), 0);
    }

    #[test]
    fn segments_are_put_together_byte_by_byte() {
        // Two pixels of 16 bits: the high bytes come first.
        let mut bytes = [2u32, 64, 67].map(u32::to_le_bytes).concat();
        bytes.resize(64, 0);
        bytes.extend([1, 1, 2, 1, 3, 4]);
        assert_eq!(unpacked(&bytes, 2, 2, 1).expect("whole"), [3, 1, 4, 2]);
        assert!(unpacked(&bytes, 3, 2, 1).is_err_and(|why| why.contains("segment 0")));
        assert!(unpacked(&bytes, 2, 1, 3).is_err_and(|why| why.contains("must have 3")));
        assert!(unpacked(&bytes[..60], 2, 2, 1).is_err());
    }

    #[test]
    fn a_part_of_a_picture_is_cut_out() {
        let frames = |arrangement: Arrangement, channels: usize| {
            let image = Image {
                size: [3, 2],
                pixel: PixelFormat { channels, ..PixelFormat::grey(Number::U8) },
                coding: Coding::Native,
                arrangement,
                places: Vec::new(),
                parts: Vec::new(),
                swapped: false,
                warnings: BTreeSet::new(),
            };
            Frames { files: Vec::new(), image, part: [1, 0, 2, 2] }
        };
        let luma = frames(Arrangement::LumaPlane, 1);
        let frames = frames(Arrangement::Planes, 3);
        let planes = [[0, 1, 2, 3, 4, 5], [10, 11, 12, 13, 14, 15], [20, 21, 22, 23, 24, 25]].concat();
        let pixels = frames.cut(&frames.arranged(planes));
        assert_eq!(pixels, [1, 11, 21, 2, 12, 22, 4, 14, 24, 5, 15, 25]);
        assert_eq!((frames.each(), frames.stored().bytes()), (12, 18));
        assert_eq!(luma.cut(&luma.arranged((0..18).collect())), [1, 2, 4, 5]);
    }
}
