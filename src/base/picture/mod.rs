//! Pictures in memory and their files: rendered pictures (RGBA), and grey pictures for the 2D filters, with signal-to-noise and
//! contrast-to-noise ratios of rectangles of them.

#[cfg(not(feature = "video"))]
#[path = "ffmpeg.rs"]
pub mod film;
#[cfg(feature = "video")]
pub mod film;
mod format;

use crate::files;
pub use crate::files::{check_target, replace};
use crate::text::printable;
pub use format::PictureFormat;

use image::{ExtendedColorType, ImageFormat, ImageReader, Limits};
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;
use std::str::FromStr;

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
    /// A picture of one opaque colour.
    pub fn filled([width, height]: [u32; 2], [red, green, blue]: [u8; 3]) -> Picture {
        Picture { width, height, rgba: [red, green, blue, 255].repeat(width as usize * height as usize) }
    }

    /// The brightness of each pixel by Rec. 709, 0..=255.
    pub fn brightness(&self) -> Vec<u16> {
        brightness::<4, u8>(&self.rgba)
    }

    /// Copies another picture into this one, with its upper left corner at pixel `[left, top]`. What would lie beyond the right and lower edges of
    /// this picture is left out.
    pub fn paste(&mut self, other: &Picture, [left, top]: [u32; 2]) {
        let columns = other.width.min(self.width.saturating_sub(left)) as usize;
        let rows = other.height.min(self.height.saturating_sub(top)) as usize;
        for row in 0..rows {
            let to = 4 * ((top as usize + row) * self.width as usize + left as usize);
            let from = 4 * row * other.width as usize;
            self.rgba[to..to + 4 * columns].copy_from_slice(&other.rgba[from..from + 4 * columns]);
        }
    }

    /// Encodes a PNG without the alpha channel: with one channel if all pixels are grey, otherwise with three.
    ///
    /// # Errors
    /// One line: there are no pixels, or their number does not match the size.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        self.encoded(PictureFormat::Png)
    }

    /// Encodes the picture without its alpha channel: with one channel if all pixels are grey, otherwise with three.
    ///
    /// # Errors
    /// One line: there are no pixels, their number does not match the size, or the format cannot hold a picture of this size.
    pub fn encoded(&self, format: PictureFormat) -> Result<Vec<u8>, String> {
        let pixels = self.width as usize * self.height as usize;
        if pixels == 0 || self.rgba.len() != 4 * pixels {
            let bytes = self.rgba.len();
            return Err(format!("{bytes} bytes are no picture of {} x {} pixels", self.width, self.height));
        }
        let is_grey = self.rgba.chunks_exact(4).all(|p| p[0] == p[1] && p[1] == p[2]);
        let (channels, colour) = if is_grey { (1, ExtendedColorType::L8) } else { (3, ExtendedColorType::Rgb8) };
        let texels: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| &p[..channels]).copied().collect();
        format.encode(&texels, [self.width, self.height], colour)
    }

    /// Writes a picture in the format of the file's ending. It is written to a temporary file and renamed, so that a full disk leaves the
    /// old picture intact.
    ///
    /// # Errors
    /// One line naming the file and the fault.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        save(file, |format| self.encoded(format))
    }

    /// Reads a PNG file.
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
    /// True if samples have 16 bits (0 to 65535), false if 8 bits (0 to 255).
    pub sixteen: bool,
    pub values: Vec<u16>,
    /// True if the file was in colour, so that the samples are the brightness of its pixels.
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
            (true, false) => brightness::<3, _>(&image.into_rgb8().into_raw()),
            (true, true) => brightness::<3, _>(&image.into_rgb16().into_raw()),
        };
        Ok(Grey { width, height, sixteen, values, from_colour: colour.has_color() })
    }

    /// The sample value of white: 255 or 65535.
    pub fn white(&self) -> f64 {
        if self.sixteen { 65535.0 } else { 255.0 }
    }

    /// The samples divided by [`Grey::white`], 0..1, rows from the top.
    pub fn shares(&self) -> Vec<f64> {
        self.values.iter().map(|v| f64::from(*v) / self.white()).collect()
    }

    /// A picture of this one's size and depth with the pixel values `shares`, clamped to 0..1, each rounded to the nearest sample.
    pub fn with(&self, shares: &[f64]) -> Grey {
        let values = shares.iter().map(|v| (v.clamp(0.0, 1.0) * self.white()).round() as u16).collect();
        Grey { values, ..*self }
    }

    /// The samples as little-endian bytes, as a frame stores them.
    pub fn bytes(&self) -> Vec<u8> {
        match self.sixteen {
            true => self.values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            false => self.values.iter().map(|v| *v as u8).collect(),
        }
    }

    /// Encodes a grey picture of 8 or 16 bits.
    ///
    /// # Errors
    /// One line: the picture has 16 bits and the format only 8.
    pub fn encoded(&self, format: PictureFormat) -> Result<Vec<u8>, String> {
        // Encoders take 16 bits in native byte order.
        let (texels, colour) = match self.sixteen {
            true => (self.values.iter().flat_map(|v| v.to_ne_bytes()).collect(), ExtendedColorType::L16),
            false => (self.bytes(), ExtendedColorType::L8),
        };
        format.encode(&texels, [self.width, self.height], colour)
    }

    /// Writes a grey picture of 8 or 16 bits in the format of the file's ending. It replaces an old file only when complete.
    ///
    /// # Errors
    /// One line naming the file and the fault.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        save(file, |format| self.encoded(format))
    }
}

fn save(file: &Path, encoded: impl Fn(PictureFormat) -> Result<Vec<u8>, String>) -> Result<(), String> {
    let bytes = encoded(PictureFormat::of(file)?);
    replace(file, &bytes.map_err(|e| format!("{}: cannot be written: {e}", file.display()))?)
}

/// Brightness of pixels of `CHANNELS` values, of which the first three are red, green and blue.
fn brightness<const CHANNELS: usize, T: Copy + Into<f64>>(pixels: &[T]) -> Vec<u16> {
    let of = |[r, g, b]: [f64; 3]| (0.2126 * r + 0.7152 * g + 0.0722 * b).round() as u16;
    pixels.chunks_exact(CHANNELS).map(|p| of([p[0].into(), p[1].into(), p[2].into()])).collect()
}

/// A rectangle of a picture. The ratios of signal to noise and of contrast to noise of its pixels measure how a filter smooths and preserves
/// contrast (thesis 5.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left column and upper row, pixels from the upper left corner of the picture.
    pub at: [u32; 2],
    pub size: [u32; 2],
}

impl FromStr for Region {
    type Err = String;

    /// `X,Y,W,H` in pixels.
    fn from_str(text: &str) -> Result<Region, String> {
        let numbers: Result<Vec<u32>, _> = text.split(',').map(|n| n.trim().parse::<u32>()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, w, h]) if w > 0 && h > 0 && u64::from(w) * u64::from(h) > 1 => {
                Ok(Region { at: [x, y], size: [w, h] })
            }
            Ok(&[_, _, _, _]) => Err("holds fewer than two pixels".into()),
            _ => Err("must read X,Y,WIDTH,HEIGHT in pixels, as 10,20,64,64".into()),
        }
    }
}

/// Mean and population standard deviation of the pixels of a region, 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    pub mean: f64,
    pub deviation: f64,
}

impl Region {
    /// Checks that the region is within a picture of `size` pixels (width, height).
    ///
    /// # Errors
    /// The region reaches beyond the picture.
    pub fn check(&self, size: [u32; 2]) -> Result<(), String> {
        let [right, lower] = [0, 1].map(|i| u64::from(self.at[i]) + u64::from(self.size[i]));
        match right <= u64::from(size[0]) && lower <= u64::from(size[1]) {
            true => Ok(()),
            false => Err(format!("reaches to {right},{lower}, the picture is {} x {} pixels", size[0], size[1])),
        }
    }

    /// Mean and deviation of the pixels in the region. `values`: the pixels of the picture, 0..1, rows from the top, `width` a row; the region
    /// must be within it.
    pub fn level(&self, values: &[f64], width: u32) -> Level {
        let row = |y: u32| {
            let from = (self.at[1] + y) as usize * width as usize + self.at[0] as usize;
            &values[from..from + self.size[0] as usize]
        };
        let pixels = || (0..self.size[1]).flat_map(|y| row(y).iter().copied());
        let count = f64::from(self.size[0]) * f64::from(self.size[1]);
        let mean = pixels().sum::<f64>() / count;
        let variance = pixels().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
        Level { mean, deviation: variance.sqrt() }
    }
}

impl Level {
    /// Signal-to-noise ratio: mean over standard deviation; None if the deviation is 0.
    pub fn snr(&self) -> Option<f64> {
        (self.deviation > 0.0).then(|| self.mean / self.deviation)
    }

    /// Contrast-to-noise ratio against another region: |m1 - m2| / sqrt(s1^2 + s2^2) of the means m and deviations s; None if both s are 0.
    pub fn cnr(&self, other: &Level) -> Option<f64> {
        let noise = self.deviation.hypot(other.deviation);
        (noise > 0.0).then(|| (self.mean - other.mean).abs() / noise)
    }
}

/// A text table with levels and ratios of a region and its background before and after a filter. `before` and `after`: pixels, 0..1, `width` a
/// row.
pub fn region_table(before: &[f64], after: &[f64], width: u32, region: &Region, background: Option<&Region>) -> String {
    let mut text = format!("{:<22} {:>8} {:>8} {:>8} {:>8}\n", "", "mean", "sd", "SNR", "CNR");
    let ratio = |r: Option<f64>| r.map_or("no noise".into(), |r| format!("{r:.3}"));
    for (when, values) in [("before", before), ("after", after)] {
        let level = region.level(values, width);
        let behind = background.map(|b| b.level(values, width));
        let cnr = behind.map_or("-".into(), |b| ratio(level.cnr(&b)));
        let mut line = |name: &str, level: &Level, cnr: &str| {
            let (mean, deviation, snr) = (level.mean, level.deviation, ratio(level.snr()));
            let _ = writeln!(text, "{:<22} {mean:>8.4} {deviation:>8.4} {snr:>8} {cnr:>8}", format!("{name} {when}"));
        };
        line("region", &level, &cnr);
        if let Some(behind) = behind {
            line("background", &behind, "-");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_weighs_as_rec_709_and_leaves_grey_alone() {
        assert_eq!(brightness::<3, _>(&[255u8, 0, 0, 0, 255, 0, 0, 0, 255]), [54, 182, 18]);
        for v in [0u16, 1, 77, 254, 255, 65535] {
            assert_eq!(brightness::<3, _>(&[v; 3]), [v]);
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

    #[test]
    fn ratios_follow_their_formulas() {
        // A checkerboard of 0.2 and 0.6 next to a plane of 0.9.
        let values: Vec<f64> = (0..8 * 4).map(|i| if i % 8 >= 4 { 0.9 } else { [0.2, 0.6][(i + i / 8) % 2] }).collect();
        let (board, plane): (Region, Region) = ("0,0,4,4".parse().unwrap(), "4, 1,4,3".parse().unwrap());
        let (a, b) = (board.level(&values, 8), plane.level(&values, 8));
        assert!((a.mean - 0.4).abs() < 1e-12 && (a.deviation - 0.2).abs() < 1e-12);
        assert!((a.snr().unwrap() - 2.0).abs() < 1e-12);
        assert!((a.cnr(&b).unwrap() - 2.5).abs() < 1e-9, "{:?}", a.cnr(&b));
        assert!(b.deviation < 1e-12);
        let text = region_table(&values, &[0.5; 32], 8, &board, Some(&plane));
        assert!(text.contains("2.500") && text.contains("no noise"), "{text}");
    }

    #[test]
    fn a_region_that_is_none_or_leaves_the_picture_is_refused() {
        for wrong in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "0,0,0,5", "0,0,1,1", "-1,0,4,4", "0,0,99999999999,1"] {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
        let region: Region = "4,0,4294967295,2".parse().unwrap();
        assert!(region.check([8, 8]).is_err());
        assert!("4,6,4,2".parse::<Region>().unwrap().check([8, 8]).is_ok());
    }
}
