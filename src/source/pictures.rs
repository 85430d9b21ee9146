//! Pictures of one size as a stream of samples.

use super::gathered::Decoded;
use crate::files::escaped;
use crate::files::progress::CountedFile;
use image::metadata::Orientation;
use image::{ImageDecoder, ImageReader};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// File name endings of the pictures of a stack, in lower case without the dot. A folder of such pictures is a recording.
pub const ENDINGS: [&str; 7] = ["png", "jpg", "jpeg", "bmp", "pgm", "ppm", "pnm"];

/// The picture files of a stack, in their order.
pub(super) struct Pictures {
    pub files: Vec<PathBuf>,
    /// True if at least one picture is in colour. All pictures are then read with three channels.
    pub is_colour: bool,
    /// Bytes of the samples of one picture.
    pub each: usize,
}

/// What the header of a picture file states.
pub(super) struct About {
    pub size: [u32; 2],
    /// True for 16 bits a channel, false for 8.
    pub deep: bool,
    pub is_colour: bool,
    /// Length of the file, bytes.
    pub length: u64,
    /// True if the picture says that it has to be rotated or mirrored for display (EXIF).
    pub is_turned: bool,
}

impl About {
    /// Reads the header of a picture file.
    ///
    /// # Errors
    /// One line: the file cannot be read, is no picture of a format that is read, or has samples of more than 16 bits.
    pub fn of(picture: &Path) -> Result<About, String> {
        let length = std::fs::metadata(picture).map_err(|e| format!("cannot be read: {e}"))?.len();
        let mut decoder = reader(picture)?.into_decoder().map_err(unreadable)?;
        let is_turned = decoder.orientation().is_ok_and(|orientation| orientation != Orientation::NoTransforms);
        let (colour, (width, height)) = (decoder.color_type(), decoder.dimensions());
        let deep = match colour.bytes_per_pixel() / colour.channel_count() {
            1 => false,
            2 => true,
            _ => return Err("has samples of more than 16 bits".into()),
        };
        Ok(About { size: [width, height], deep, is_colour: colour.has_color(), length, is_turned })
    }
}

/// Bytes at the start of a picture in which its parts are looked for.
const START: u64 = 64 << 10;
/// Chunks of a PNG that are read.
const READ: [&[u8]; 5] = [b"IHDR", b"PLTE", b"tRNS", b"sBIT", b"IDAT"];

/// The names of what a PNG or JPEG file holds beside its pixels and is not read, such as the density of pixels.
pub(super) fn beside_pixels(picture: &Path) -> Vec<String> {
    let mut start = Vec::new();
    // What cannot be read was reported before.
    let _ = std::fs::File::open(picture).and_then(|file| file.take(START).read_to_end(&mut start));
    let shown = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
    let mut names = Vec::new();
    if let Some(mut rest) = start.strip_prefix(b"\x89PNG\r\n\x1a\n") {
        while let Some(([a, b, c, d, name @ ..], after)) = rest.split_first_chunk::<8>() {
            names.extend((!READ.contains(&&name[..])).then(|| format!("PNG {}", shown(name))));
            let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
            let Some(next) = after.get(length.saturating_add(4)..).filter(|_| name != b"IDAT") else { break };
            rest = next;
        }
    } else if let Some(mut rest) = start.strip_prefix(b"\xff\xd8") {
        // Segments of applications; the samples begin after SOS.
        while let Some(([0xff, marker, a, b], after)) = rest.split_first_chunk::<4>() {
            let length = usize::from(u16::from_be_bytes([*a, *b])).saturating_sub(2);
            if (0xe0..=0xef).contains(marker) {
                let name = after.split(|byte| *byte == 0).next().unwrap_or_default();
                names.push(format!("JPEG APP{} {}", marker - 0xe0, shown(name.get(..4).unwrap_or(name))));
            }
            let Some(next) = after.get(length..).filter(|_| *marker != 0xda) else { break };
            rest = next;
        }
    }
    names
}

/// A reader for the format of a file's content, with the library's limits of memory.
fn reader(picture: &Path) -> Result<ImageReader<io::BufReader<CountedFile>>, String> {
    // Not by the name of the file.
    let file = CountedFile::open(picture).map(|file| ImageReader::new(io::BufReader::new(file)));
    let reader = file.and_then(ImageReader::with_guessed_format);
    let reader = reader.map_err(|e| format!("cannot be read: {e}"))?;
    match reader.format().is_some_and(|format| format.reading_enabled()) {
        true => Ok(reader),
        false => Err("is no picture of a known format; PNG, JPEG, PNM and BMP are read".into()),
    }
}

fn unreadable(error: image::ImageError) -> String {
    format!("cannot be read: {}", escaped(&error.to_string(), 200))
}

impl Decoded for Pictures {
    fn each(&self) -> usize {
        self.each
    }

    /// Rows from the top, little-endian.
    fn decode(&self, number: usize) -> io::Result<Vec<u8>> {
        let Some(picture) = self.files.get(number) else { return Ok(Vec::new()) };
        let named = |why: String| {
            let name = picture.file_name().unwrap_or_default().to_string_lossy();
            io::Error::other(format!("{}: {why}", escaped(&name, 100)))
        };
        let image = reader(picture).and_then(|reader| reader.decode().map_err(unreadable)).map_err(named)?;
        let is_deep = image.color().bytes_per_pixel() / image.color().channel_count() == 2;
        let words = |words: Vec<u16>| words.into_iter().flat_map(u16::to_le_bytes).collect();
        let samples: Vec<u8> = match (self.is_colour, is_deep) {
            (false, false) => image.into_luma8().into_raw(),
            (false, true) => words(image.into_luma16().into_raw()),
            (true, false) => image.into_rgb8().into_raw(),
            (true, true) => words(image.into_rgb16().into_raw()),
        };
        match samples.len() == self.each {
            true => Ok(samples),
            false => Err(named("changed while it was being read".into())),
        }
    }

    fn files(&self) -> &[PathBuf] {
        &self.files
    }
}
