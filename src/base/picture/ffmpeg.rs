//! Films of pictures in a program without an encoder of its own: by the ffmpeg that is installed. A file is complete or absent.

use super::Picture;
use crate::files::{WorkFolder, private};
use crate::text::single_line;
use std::env;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Colours as films have them: BT.709 of limited range, half the resolution of brightness in both directions. Encoders take even sizes.
const FILTER: &str = "scale=out_color_matrix=bt709:out_range=tv,pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p";
const COLOURS: [&str; 8] =
    ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv"];

/// Path of the program that encodes films: ffmpeg, found in PATH.
///
/// # Errors
/// One line: there is none.
pub fn encoder() -> Result<PathBuf, &'static str> {
    let name = format!("ffmpeg{}", env::consts::EXE_SUFFIX);
    let found = env::var_os("PATH")
        .and_then(|all| env::split_paths(&all).map(|folder| folder.join(&name)).find(|file| file.is_file()));
    found.ok_or(
        "a film needs the program ffmpeg, which is not in PATH: install it, or build with `cargo build --release --features video`, or give a \
         folder (face/) or a pattern (face-%03d.png)",
    )
}

/// A film of pictures of one size that is being written.
pub struct FilmWriter {
    ffmpeg: Child,
    // Dropped with what is in it.
    folder: WorkFolder,
    target: PathBuf,
    size: [u32; 2],
}

impl FilmWriter {
    /// Begins a film of pictures of `size` pixels (width, height) at `rate` pictures a second.
    ///
    /// # Errors
    /// One line without the file's name: there is no ffmpeg, or a folder cannot be written.
    pub fn create(path: &Path, size: [u32; 2], rate: f64) -> Result<FilmWriter, String> {
        let beside = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = WorkFolder::new(beside, ".echolume-film-")?;
        let (film, log) = (film_in(&folder), log_in(&folder));
        // It keeps the mode of a file that is there.
        let made = private(OpenOptions::new().write(true).create_new(true)).open(&film).and_then(|_| File::create(log));
        let log = made.map_err(|e| e.to_string())?;
        let mut command = Command::new(encoder()?);
        command.args(["-v", "error", "-nostdin", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"]);
        command.args(["-s", &format!("{}x{}", size[0], size[1]), "-r", &rate.to_string(), "-i", "pipe:0"]);
        command.args(["-an", "-vf", FILTER]).args(COLOURS).args(["-movflags", "+faststart"]).arg(&film);
        let ffmpeg = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(log).spawn();
        let ffmpeg = ffmpeg.map_err(|e| format!("ffmpeg cannot be started: {e}"))?;
        Ok(FilmWriter { ffmpeg, folder, target: path.into(), size })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// One line: a picture of another size, or what ffmpeg says.
    pub fn picture(&mut self, picture: &Picture) -> Result<(), String> {
        let [width, height] = self.size;
        if [picture.width, picture.height] != self.size {
            let (w, h) = (picture.width, picture.height);
            return Err(format!("a picture of {w} x {h} pixels is none of a film of {width} x {height}"));
        }
        let pipe = self.ffmpeg.stdin.as_mut().ok_or("the film has ended")?;
        pipe.write_all(&picture.rgba).map_err(|e| self.said(&e.to_string()))
    }

    /// Completes the film and renames it to the path that [`FilmWriter::create`] got.
    ///
    /// # Errors
    /// One line: what ffmpeg says, or a full disk.
    pub fn finish(mut self) -> Result<(), String> {
        // It ends where its input does.
        drop(self.ffmpeg.stdin.take());
        let status = self.ffmpeg.wait().map_err(|e| e.to_string())?;
        match status.success() {
            true => fs::rename(film_in(&self.folder), &self.target).map_err(|e| e.to_string()),
            false => Err(self.said(&status.to_string())),
        }
    }

    /// The last line of ffmpeg, or else this one.
    fn said(&self, other: &str) -> String {
        let log = fs::read(log_in(&self.folder)).unwrap_or_default();
        let log = String::from_utf8_lossy(&log);
        let last = log.lines().rfind(|line| !line.trim().is_empty()).unwrap_or(other);
        format!("ffmpeg: {}", single_line(last))
    }
}

/// Nothing of a film that is not finished stays.
impl Drop for FilmWriter {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.ffmpeg.kill();
        let _ = self.ffmpeg.wait();
    }
}

fn film_in(folder: &WorkFolder) -> PathBuf {
    folder.path().join("film.mp4")
}

fn log_in(folder: &WorkFolder) -> PathBuf {
    folder.path().join("log")
}
