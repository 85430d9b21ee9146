//! A rendered 2D result, and its way to and from a file.

pub mod grey;
pub mod regions;

use crate::files;
pub use crate::files::{check_target, replace};
use crate::scene::load::plain;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use image::{ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::Path;

/// Longest file of a picture that is read, bytes: what its pixels may take, too.
const LONGEST: u64 = 512 << 20;

/// 8-bit red, green, blue, alpha; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The picture as a PNG, opaque; grey where it is.
    ///
    /// # Errors
    /// One line: it has no pixels, or not as many as its size says.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let pixels = self.width as usize * self.height as usize;
        if pixels == 0 || self.rgba.len() != 4 * pixels {
            let bytes = self.rgba.len();
            return Err(format!("{bytes} bytes are no picture of {} x {} pixels", self.width, self.height));
        }
        let mut bytes = Vec::new();
        let (compression, filter) = (CompressionType::Default, FilterType::Adaptive);
        let encoder = PngEncoder::new_with_quality(&mut bytes, compression, filter);
        let is_grey = self.rgba.chunks_exact(4).all(|p| p[0] == p[1] && p[1] == p[2]);
        let (channels, colour) = if is_grey { (1, ExtendedColorType::L8) } else { (3, ExtendedColorType::Rgb8) };
        let texels: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| &p[..channels]).copied().collect();
        encoder.write_image(&texels, self.width, self.height, colour).map_err(|e| e.to_string())?;
        Ok(bytes)
    }

    /// Writes a PNG beside the target first and renames it: a full disk leaves the old picture as it was.
    ///
    /// # Errors
    /// One line naming the file and the fault.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        let bytes = self.png().map_err(|e| format!("{}: cannot be written: {e}", file.display()))?;
        replace(file, &bytes)
    }

    /// Reads a PNG.
    ///
    /// # Errors
    /// One line naming the file and the fault. Files and pixels of more than 512 MiB are refused, whatever the file claims.
    pub fn load(file: &Path) -> Result<Picture, String> {
        let bytes = files::read(file, LONGEST, "picture").map_err(|e| format!("{}: {e}", file.display()))?;
        // With the limits of the library.
        let image = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png).decode();
        let image = image.map_err(|e| format!("{}: cannot be read: {}", file.display(), plain(&e.to_string())))?;
        let rgba = image.to_rgba8();
        Ok(Picture { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
    }
}
