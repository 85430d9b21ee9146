//! The output of several pictures: a folder, names with a number, or a film (.mp4).

use super::input::{check_inputs, make_folder};
use super::picture_file::STANDARD;
use crate::picture::film::{FilmWriter, encoder};
use crate::picture::{Picture, PictureFormat, check_target, replace};
use crate::terminal::{Failure, failed, input};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Most digits of a number in a pattern.
const MAX_DIGITS: usize = 9;

/// Where the pictures of a series are written.
#[derive(Clone, Debug, PartialEq)]
pub enum SeriesTarget {
    /// To numbered files: path before and after the number, its least number of digits, and the folder to create, if a folder was named.
    Files { before: OsString, digits: usize, after: String, format: PictureFormat, folder: Option<PathBuf> },
    /// To one film file.
    Film(PathBuf),
}

impl SeriesTarget {
    /// The target that `-o` names: a folder, a pattern or a film. `name`: with a folder, what the names of the pictures begin with, such as `face` in
    /// `face-000000.png`.
    ///
    /// # Errors
    /// One line: the path is `-` or that of a single picture, the pattern is not valid, the ending belongs to no known format, the name of a pattern
    /// or film is not UTF-8, or no encoder of films was found.
    pub fn of(path: &Path, name: &str) -> Result<SeriesTarget, Failure> {
        let text = path.to_string_lossy();
        let refuse = |why: &str| Err(input(format!("-o {text}: {why}")));
        if text == STANDARD {
            return refuse("several pictures are written to files: give a folder (face/) or a pattern (face-%03d.png)");
        }
        let has_ending = path.extension().is_some_and(|ending| !ending.is_empty());
        let is_folder = text.ends_with(std::path::is_separator) || path.is_dir();
        if is_folder || !(has_ending || text.contains('%')) {
            let before = path.join(format!("{name}-")).into_os_string();
            let (after, format, folder) = (".png".into(), PictureFormat::Png, Some(path.into()));
            return Ok(SeriesTarget::Files { before, digits: 6, after, format, folder });
        }
        let Some(file) = path.file_name().unwrap_or_default().to_str() else {
            return refuse("the name of a pattern or a film must be UTF-8; that of a folder need not");
        };
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mp4")) {
            if file.contains('%') {
                return refuse("a film is one file, whose name has no number: leave the % out");
            }
            return encoder().map_or_else(refuse, |_| Ok(SeriesTarget::Film(path.into())));
        }
        let Some((first, rest)) = file.split_once('%') else {
            return refuse(
                "several pictures are written: give a folder (face/), a pattern (face-%03d.png) or a film (face.mp4)",
            );
        };
        let pattern = "the number in a pattern is written %d, or %03d for three digits, once and in the file name";
        let Some((width, after)) = rest.split_once('d').filter(|(_, after)| !after.contains('%')) else {
            return refuse(pattern);
        };
        let digits = if width.is_empty() { Some(1) } else { width.strip_prefix('0').and_then(|n| n.parse().ok()) };
        let Some(digits) = digits.filter(|n| (1..=MAX_DIGITS).contains(n)) else { return refuse(pattern) };
        let folder = path.parent().unwrap_or(Path::new(""));
        if folder.to_string_lossy().contains('%') {
            return refuse(pattern);
        }
        let format = PictureFormat::of(path).map_err(|fault| input(format!("-o {fault}")))?;
        let before = folder.join(first).into_os_string();
        Ok(SeriesTarget::Files { before, digits, after: after.into(), format, folder: None })
    }

    /// Path of the file of the picture with this number. For a film it is the path of the film, whatever the number is.
    pub fn file(&self, number: usize) -> PathBuf {
        match self {
            SeriesTarget::Files { before, digits, after, .. } => {
                let mut file = before.clone();
                file.push(format!("{number:0digits$}{after}"));
                file.into()
            }
            SeriesTarget::Film(path) => path.clone(),
        }
    }

    /// Checks that none of the files of these numbers would replace an input (`read`), creates the folder that was named, and checks that the first
    /// file can be written.
    pub fn check(&self, numbers: impl Iterator<Item = usize>, read: &[PathBuf]) -> Result<(), Failure> {
        let files: Vec<PathBuf> = match self {
            SeriesTarget::Files { .. } => numbers.map(|n| self.file(n)).collect(),
            SeriesTarget::Film(path) => vec![path.clone()],
        };
        check_inputs("-o", &files, read)?;
        if let SeriesTarget::Files { folder: Some(folder), .. } = self {
            make_folder(folder)?;
        }
        files.first().map_or(Ok(()), |first| check_target(first).map_err(failed))
    }
}

/// A series of pictures that is being written. Each of its files is either written completely or not at all.
pub struct PictureSeries<'a> {
    target: &'a SeriesTarget,
    /// Pictures of a film in a second.
    rate: f64,
    count: usize,
    film: Option<FilmWriter>,
}

impl<'a> PictureSeries<'a> {
    pub fn new(target: &'a SeriesTarget, rate: f64) -> PictureSeries<'a> {
        PictureSeries { target, rate, count: 0, film: None }
    }

    /// Writes a picture to the file of its number, or appends it to the film.
    pub fn write(&mut self, number: usize, picture: &Picture) -> Result<(), Failure> {
        let file = self.target.file(number);
        let unwritable = |e: String| failed(format!("{}: cannot be written: {e}", file.display()));
        match self.target {
            SeriesTarget::Files { format, .. } => {
                replace(&file, &picture.encoded(*format).map_err(unwritable)?).map_err(failed)?;
            }
            SeriesTarget::Film(path) => self.add(path, picture).map_err(unwritable)?,
        }
        self.count += 1;
        Ok(())
    }

    fn add(&mut self, path: &Path, picture: &Picture) -> Result<(), String> {
        if self.film.is_none() {
            self.film = Some(FilmWriter::create(path, [picture.width, picture.height], self.rate)?);
        }
        self.film.as_mut().map_or(Ok(()), |film| film.picture(picture))
    }

    /// Number of written pictures.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Ends the series; a film is completed and gets its final name.
    pub fn finish(self) -> Result<(), Failure> {
        let unwritable = |e: String| failed(format!("{}: cannot be written: {e}", self.target.file(0).display()));
        self.film.map_or(Ok(()), FilmWriter::finish).map_err(unwritable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a folder that is made and then refused.
    #[cfg(unix)]
    #[test]
    fn a_folder_may_have_a_name_that_is_not_utf_8() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        let name = |end: &[u8]| OsString::from(OsStr::from_bytes(&[&b"echolume-series-\xff"[..], end].concat()));
        let folder = std::env::temp_dir().join(name(format!("-{}", std::process::id()).as_bytes()));
        let target = SeriesTarget::of(&folder, "picture").unwrap_or_else(|fault| panic!("{}", fault.message()));
        assert_eq!(target.file(7), folder.join("picture-000007.png"));
        target.check(0..2, &[]).unwrap_or_else(|fault| panic!("{}", fault.message()));
        let picture = Picture { width: 1, height: 1, rgba: vec![1, 2, 3, 255] };
        let mut series = PictureSeries::new(&target, 25.0);
        series.write(1, &picture).unwrap_or_else(|fault| panic!("{}", fault.message()));
        assert_eq!(Picture::load(&folder.join("picture-000001.png")).expect("a picture"), picture);
        std::fs::remove_dir_all(&folder).expect("remove it");
        // A pattern is refused before anything is made.
        let pattern = folder.join(name(b"-%d.png"));
        assert!(SeriesTarget::of(&pattern, "picture").is_err_and(|fault| fault.message().contains("UTF-8")));
        assert!(!folder.exists());
    }

    #[test]
    fn a_folder_a_pattern_and_a_film_are_told_apart_and_all_else_is_refused() {
        let of = |text: &str| SeriesTarget::of(Path::new(text), "picture");
        let third = |text: &str| of(text).expect(text).file(3).to_string_lossy().into_owned();
        assert_eq!(third("a/b/"), "a/b/picture-000003.png");
        assert_eq!(third("a/face-%03d.png"), "a/face-003.png");
        assert_eq!(third("%d.JPG"), "3.JPG");
        assert_eq!(third("face-%02d"), "face-03");
        assert_eq!(third("turn"), "turn/picture-000003.png");
        for wrong in ["face.png", "-", "%x.png", "%3d.png", "%d-%d.png", "%00d.png", "%010d.png", "f%d/a.png", "%d.gif"]
        {
            let fault = of(wrong).expect_err(wrong).message();
            assert!(fault.starts_with(&format!("-o {wrong}: ")), "{wrong}: {fault}");
        }
        let fault = of("face-%03d.mp4").expect_err("a pattern").message();
        assert!(fault.contains("leave the % out"), "in a program without films, too: {fault}");
        match of("face.MP4") {
            Ok(SeriesTarget::Film(path)) => assert!(encoder().is_ok() && path == Path::new("face.MP4")),
            Ok(other) => panic!("{other:?}"),
            Err(fault) => assert!(encoder().is_err() && fault.message().contains("--features video")),
        }
    }
}
