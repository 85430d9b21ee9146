//! Pictures in memory and their files: rendered pictures (RGBA), and grey pictures for the 2D filters.

pub mod regions;

use crate::files;
pub use crate::files::{check_target, replace};
use crate::text::printable;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// Maximum size of a picture file, bytes; also the maximum memory for its pixels.
const MAX_BYTES: u64 = 512 << 20;

/// A picture of 8-bit red, green, blue, alpha; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

impl Picture {
    /// Encodes an opaque PNG; with one channel if all pixels are grey.
    ///
    /// # Errors
    /// One line: there are no pixels, or their number does not match the size.
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

    /// Writes a PNG. It is written to a temporary file and renamed, so that a full disk leaves the old picture intact.
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
        let bytes = files::read(file, MAX_BYTES, "picture").map_err(|e| format!("{}: {e}", file.display()))?;
        // The library limits memory.
        let image = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png).decode();
        let image = image.map_err(|e| format!("{}: cannot be read: {}", file.display(), printable(&e.to_string())))?;
        let rgba = image.to_rgba8();
        Ok(Picture { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
    }
}

/// A picture of one channel of 8 or 16 bits; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grey {
    pub width: u32,
    pub height: u32,
    /// True for values to 65535, false for values to 255.
    pub sixteen: bool,
    pub values: Vec<u16>,
    /// True if the values are the brightness of a colour picture.
    pub from_colour: bool,
}

impl Grey {
    /// Reads PNG, JPEG, PNM or BMP of 8 or 16 bits. Colour becomes brightness by the weights of Rec. 709 on the stored
    /// (gamma-coded) values, so that grey stored as colour keeps its values; transparency is ignored.
    ///
    /// # Errors
    /// One line naming the file and the fault. Files and pixels of more than 512 MiB are refused, whatever the file claims.
    pub fn load(file: &Path) -> Result<Grey, String> {
        // Messages of the library may have several lines and contain text of the file.
        let fault =
            |e: &dyn std::fmt::Display| format!("{}: cannot be read: {}", file.display(), printable(&e.to_string()));
        let bytes = files::read(file, MAX_BYTES, "picture").map_err(|e| format!("{}: {e}", file.display()))?;
        // The contents decide, not the file name.
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fault(&e))?;
        if !reader.format().is_some_and(|f| f.reading_enabled()) {
            return Err(fault(&"is no picture of a known format; PNG, JPEG, PNM and BMP are read"));
        }
        reader.limits(Limits::default());
        let image = reader.decode().map_err(|e| fault(&e))?;
        let (width, height) = (image.width(), image.height());
        if width == 0 || height == 0 {
            return Err(fault(&"has no pixels"));
        }
        let (colour, channels) = (image.color(), u16::from(image.color().channel_count()));
        let sixteen = match u16::from(colour.bytes_per_pixel()) / channels {
            1 => false,
            2 => true,
            _ => return Err(fault(&"has samples of more than 16 bits")),
        };
        let values = match (colour.has_color(), sixteen) {
            (false, false) => image.into_luma8().into_raw().into_iter().map(u16::from).collect(),
            (false, true) => image.into_luma16().into_raw(),
            (true, false) => brightness(&image.into_rgb8().into_raw()),
            (true, true) => brightness(&image.into_rgb16().into_raw()),
        };
        Ok(Grey { width, height, sixteen, values, from_colour: colour.has_color() })
    }

    /// The value of white.
    pub fn white(&self) -> f64 {
        if self.sixteen { 65535.0 } else { 255.0 }
    }

    /// The values scaled to 0..1.
    pub fn shares(&self) -> Vec<f64> {
        self.values.iter().map(|v| f64::from(*v) / self.white()).collect()
    }

    /// The same picture with other values in 0..1, each rounded to the nearest stored value.
    pub fn with(&self, shares: &[f64]) -> Grey {
        let values = shares.iter().map(|v| (v.clamp(0.0, 1.0) * self.white()).round() as u16).collect();
        Grey { values, ..*self }
    }

    /// The samples as stored in a frame, little-endian.
    pub fn bytes(&self) -> Vec<u8> {
        match self.sixteen {
            true => self.values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            false => self.values.iter().map(|v| *v as u8).collect(),
        }
    }

    /// Writes a grey PNG of 8 or 16 bits. It replaces an old file only when complete.
    ///
    /// # Errors
    /// One line naming the file and the fault.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        let mut png = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Default, FilterType::Adaptive);
        // The encoder takes 16 bits in native byte order.
        let (texels, colour) = match self.sixteen {
            true => (self.values.iter().flat_map(|v| v.to_ne_bytes()).collect(), ExtendedColorType::L16),
            false => (self.bytes(), ExtendedColorType::L8),
        };
        encoder
            .write_image(&texels, self.width, self.height, colour)
            .map_err(|e| format!("{}: cannot be written: {e}", file.display()))?;
        replace(file, &png)
    }
}

fn brightness<T: Copy + Into<f64>>(rgb: &[T]) -> Vec<u16> {
    let of = |[r, g, b]: [f64; 3]| (0.2126 * r + 0.7152 * g + 0.0722 * b).round() as u16;
    rgb.chunks_exact(3).map(|p| of([p[0].into(), p[1].into(), p[2].into()])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_weighs_as_rec_709_and_leaves_grey_alone() {
        assert_eq!(brightness(&[255u8, 0, 0, 0, 255, 0, 0, 0, 255]), [54, 182, 18]);
        for v in [0u16, 1, 77, 254, 255, 65535] {
            assert_eq!(brightness(&[v; 3]), [v]);
        }
    }

    #[test]
    fn both_depths_come_back_from_their_files() {
        for (sixteen, values) in [(false, vec![0, 1, 128, 200, 254, 255]), (true, vec![0, 1, 255, 256, 40000, 65535])] {
            let grey = Grey { width: 3, height: 2, sixteen, values, from_colour: false };
            let file = std::env::temp_dir().join(format!("echolume-grey-{}-{sixteen}.png", std::process::id()));
            grey.save(&file).expect("written");
            let back = Grey::load(&file);
            let _ = std::fs::remove_file(&file);
            assert_eq!(back.expect("read"), grey);
            assert_eq!(grey.with(&grey.shares()), grey);
        }
    }
}
