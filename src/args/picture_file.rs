//! The output of a picture: a file, whose ending decides the format, or `-` for a PNG on standard output.

use crate::files::replace;
use crate::picture::PictureFormat;
use crate::terminal::{self, Failure, failed, input, say};
use std::path::Path;

/// The path that stands for standard input where a file is read, and for standard output where one is written.
pub const STANDARD: &str = "-";

/// Where a picture is written.
#[derive(Clone, Copy, Debug)]
pub enum PictureFile<'a> {
    /// To a file, in this format.
    File(&'a Path, PictureFormat),
    /// To standard output as PNG. Messages then go to standard error.
    StandardOutput,
}

impl<'a> PictureFile<'a> {
    /// The target for the path that the user gave to `flag` (such as `-o`, for messages): standard output if the path is `-`, otherwise a file in
    /// the format of its ending. With standard output, messages go to standard error from now on.
    ///
    /// # Errors
    /// The ending belongs to no known format, or standard output is a terminal.
    pub fn new(flag: &str, path: &'a Path) -> Result<PictureFile<'a>, Failure> {
        if path.as_os_str() == STANDARD {
            terminal::keep_standard_output().map_err(|fault| input(format!("{flag} -: {fault}")))?;
            return Ok(PictureFile::StandardOutput);
        }
        let format = PictureFormat::of(path).map_err(|fault| input(format!("{flag} {fault}")))?;
        Ok(PictureFile::File(path, format))
    }

    /// Path of the file; None for standard output.
    pub fn path(&self) -> Option<&'a Path> {
        match self {
            PictureFile::File(path, _) => Some(path),
            PictureFile::StandardOutput => None,
        }
    }

    /// The target as text for messages.
    pub fn name(&self) -> String {
        self.path().map_or("standard output".into(), |path| path.display().to_string())
    }

    /// Writes a picture, and prints the path if it is a file. `encode`: returns the picture as bytes of the given format.
    pub fn write(&self, encode: impl Fn(PictureFormat) -> Result<Vec<u8>, String>) -> Result<(), Failure> {
        let unwritable = |e: String| failed(format!("{}: cannot be written: {e}", self.name()));
        match self {
            PictureFile::StandardOutput => terminal::write(&encode(PictureFormat::Png).map_err(unwritable)?),
            PictureFile::File(path, format) => {
                replace(path, &encode(*format).map_err(unwritable)?).map_err(failed)?;
                say!("picture: {}", path.display());
            }
        }
        Ok(())
    }
}
