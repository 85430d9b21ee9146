//! Formats of pictures that are written. The ending of a file's name decides.

use image::codecs::bmp::BmpEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::codecs::pnm::PnmEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Quality of JPEG pictures, 1 to 100. Colours keep their resolution.
const JPEG_QUALITY: u8 = 95;

/// A file format in which pictures can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    Png,
    Jpeg,
    Bmp,
    /// PGM for one channel, PPM for three.
    Pnm,
}

/// The endings of file names, and their formats.
const ENDINGS: [(&str, PictureFormat); 7] = [
    ("png", PictureFormat::Png),
    ("jpg", PictureFormat::Jpeg),
    ("jpeg", PictureFormat::Jpeg),
    ("bmp", PictureFormat::Bmp),
    ("ppm", PictureFormat::Pnm),
    ("pgm", PictureFormat::Pnm),
    ("pnm", PictureFormat::Pnm),
];

impl PictureFormat {
    /// The format for the ending of a file name, in upper or lower case. A name without an ending means PNG, for example `/dev/stdout`.
    ///
    /// # Errors
    /// The ending is unknown: one line that names the known ones.
    pub fn of(file: &Path) -> Result<PictureFormat, String> {
        let Some(ending) = file.extension() else { return Ok(PictureFormat::Png) };
        if let Some((_, format)) = ENDINGS.iter().find(|(known, _)| ending.eq_ignore_ascii_case(known)) {
            return Ok(*format);
        }
        let known = ENDINGS.map(|(known, _)| format!(".{known}")).join(", ");
        Err(format!("{}: no picture is written with this ending; the known ones are {known}", file.display()))
    }

    /// Encodes pixels, rows from the top; 16-bit ones in the byte order of this machine.
    ///
    /// # Errors
    /// One line: what the format cannot hold.
    pub(super) fn encode(self, pixels: &[u8], size: [u32; 2], colour: ExtendedColorType) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let [width, height] = size;
        let is_deep = colour == ExtendedColorType::L16;
        let done = match self {
            PictureFormat::Png => {
                let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
                encoder.write_image(pixels, width, height, colour)
            }
            PictureFormat::Jpeg | PictureFormat::Bmp if is_deep => {
                return Err("16 bits are written as .png or .pgm only".into());
            }
            PictureFormat::Jpeg => {
                JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).write_image(pixels, width, height, colour)
            }
            PictureFormat::Bmp => BmpEncoder::new(&mut bytes).write_image(pixels, width, height, colour),
            PictureFormat::Pnm => PnmEncoder::new(&mut bytes).write_image(pixels, width, height, colour),
        };
        done.map_err(|e| e.to_string())?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Grey, Picture};

    #[test]
    fn the_ending_decides_whatever_its_case_and_unknown_ones_are_named() {
        let of = |name: &str| PictureFormat::of(Path::new(name));
        for (ending, format) in ENDINGS {
            assert_eq!(of(&format!("a.b/x.{}", ending.to_uppercase())), Ok(format));
        }
        assert_eq!(of("picture"), Ok(PictureFormat::Png));
        for wrong in ["x.gif", "x.mha", "x.png.tiff", "x."] {
            let said = of(wrong).expect_err(wrong);
            assert!(said.starts_with(wrong) && said.contains(".png, .jpg, .jpeg, .bmp, .ppm"), "{said}");
        }
    }

    #[test]
    fn every_format_has_the_same_picture() {
        let level = |x: u32, y: u32, c: u32| (16 * x + 20 * y * c) as u8;
        let rgba = (0..32).flat_map(|n| [level(n % 8, n / 8, 0), level(n % 8, n / 8, 1), level(n % 8, n / 8, 2), 255]);
        let picture = Picture { width: 8, height: 4, rgba: rgba.collect() };
        for (ending, format) in ENDINGS {
            if ending == "pgm" {
                continue;
            }
            let bytes = picture.encoded(format).expect("encoded");
            let read = image::load_from_memory(&bytes).expect("read back").to_rgb8().into_raw();
            let expected: Vec<u8> = picture.rgba.chunks(4).flat_map(|p| p[..3].to_vec()).collect();
            let most = if format == PictureFormat::Jpeg { 24 } else { 0 };
            let worst = read.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(read.len() == expected.len() && worst <= Some(most), "{ending}: {worst:?}");
        }
        let deep = Grey { width: 2, height: 1, sixteen: true, values: vec![7, 65535], from_colour: false };
        for (format, is_written) in [
            (PictureFormat::Png, true),
            (PictureFormat::Pnm, true),
            (PictureFormat::Jpeg, false),
            (PictureFormat::Bmp, false),
        ] {
            let read = deep.encoded(format).ok().and_then(|bytes| image::load_from_memory(&bytes).ok());
            assert_eq!(read.map(|read| read.into_luma16().into_raw()), is_written.then(|| deep.values.clone()));
        }
    }
}
