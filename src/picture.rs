//! A rendered 2D result, and its way to and from a file.

use std::path::Path;

/// 8-bit red, green, blue, alpha; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

impl Picture {
    /// Writes a PNG beside the target first and renames it: a full disk leaves the old picture as it was.
    ///
    /// # Errors
    /// One line naming the file and the fault.
    pub fn save(&self, file: &Path) -> Result<(), String> {
        let cannot = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", file.display());
        let mut bytes = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        let rgb: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        image::ImageEncoder::write_image(encoder, &rgb, self.width, self.height, image::ExtendedColorType::Rgb8)
            .map_err(|e| cannot(&e))?;
        let mut part = file.as_os_str().to_owned();
        part.push(".part");
        let written = std::fs::write(&part, &bytes).and_then(|()| std::fs::rename(&part, file));
        written.map_err(|e| {
            let _ = std::fs::remove_file(&part);
            cannot(&e)
        })
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
