//! A rendered 2D result, and its way to and from a file.

pub mod grey;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::Path;

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
    pub fn load(file: &Path) -> Result<Picture, String> {
        let cannot = |e: &dyn std::fmt::Display| format!("{}: cannot be read: {e}", file.display());
        let bytes = std::fs::read(file).map_err(|e| cannot(&e))?;
        let image = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png).map_err(|e| cannot(&e))?;
        let rgba = image.to_rgba8();
        Ok(Picture { width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() })
    }
}

/// Writes bytes beside the target first and renames: a full disk leaves the old file as it was.
///
/// # Errors
/// One line naming the file and the fault.
pub fn replace(file: &Path, bytes: &[u8]) -> Result<(), String> {
    let cannot = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", file.display());
    if std::fs::metadata(file).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        // A device or a pipe is written to; renaming would replace it.
        let opened = std::fs::OpenOptions::new().write(true).open(file);
        return opened.and_then(|mut f| f.write_all(bytes)).map_err(|e| cannot(&e));
    }
    check_target(file)?;
    // Through a link to the file itself, and beside it, so that renaming stays within one file system.
    let target = file.canonicalize().unwrap_or_else(|_| file.to_path_buf());
    let part = target.with_file_name(format!(".echolume-{}.part", std::process::id()));
    let opened = std::fs::OpenOptions::new().write(true).create_new(true).open(&part);
    let mut opened = opened.map_err(|e| cannot(&e))?;
    let written = opened.write_all(bytes).and_then(|()| std::fs::rename(&part, &target));
    written.map_err(|e| {
        let _ = std::fs::remove_file(&part);
        cannot(&e)
    })
}

/// Whether a picture could be written there, before the work is done.
///
/// # Errors
/// One line: the folder does not exist, or the name is a folder's.
pub fn check_target(file: &Path) -> Result<(), String> {
    let cannot = |fault: &str| Err(format!("{}: cannot be written: {fault}", file.display()));
    if file.is_dir() || file.file_name().is_none() {
        return cannot("it is a folder");
    }
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            cannot(&format!("there is no folder {}; make it first", folder.display()))
        }
        _ => Ok(()),
    }
}
