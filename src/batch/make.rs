//! Makes a manifest from files, folders and patterns: a unit for each recording that can be read, with size, digest and expected cost.

use super::manifest::Unit;
use super::unit::{Kind, Work};
use crate::args::check_volume;
use crate::digest::digest_of;
use crate::source::formats::is_ending;
use crate::source::{self, Source};
use crate::terminal::{Failure, input};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest depth of folders that are searched below a named one.
const MAX_DEPTH: usize = 64;

/// Whether a file becomes a unit of the manifest.
pub enum Found {
    Unit(Box<Unit>),
    /// The file does not become a unit; the text names the file and the reason.
    LeftOut(String),
}

/// The files that `patterns` name, sorted, each once: files, folders with all recordings below them, and patterns with `*`, `?`, `**` and `[...]`.
///
/// # Errors
/// A pattern is invalid or gives no file (such as a folder without recordings), a folder cannot be read, or folders are nested more than 64 deep
/// below a named one.
pub fn files(patterns: &[String]) -> Result<Vec<PathBuf>, Failure> {
    let mut found = Vec::new();
    for pattern in patterns {
        let before = found.len();
        match Path::new(pattern) {
            path if path.is_dir() => walk(path, 0, &mut found).map_err(input)?,
            path if path.exists() => found.push(path.to_path_buf()),
            _ => {
                let matches = glob::glob(pattern).map_err(|e| input(format!("--make {pattern}: {e}")))?;
                for path in matches {
                    let path = path.map_err(|e| input(format!("--make {pattern}: {e}")))?;
                    match path.is_dir() {
                        true => walk(&path, 0, &mut found).map_err(input)?,
                        false => found.push(path),
                    }
                }
            }
        }
        if found.len() == before {
            return Err(input(format!("--make {pattern}: no recording is there")));
        }
    }
    found.sort();
    found.dedup();
    Ok(found)
}

fn walk(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), String> {
    let fault = |e: std::io::Error| format!("{}: cannot be read: {e}", folder.display());
    if depth > MAX_DEPTH {
        return Err(format!("{}: is more than {MAX_DEPTH} folders deep", folder.display()));
    }
    for entry in fs::read_dir(folder).map_err(fault)? {
        let entry = entry.map_err(fault)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(fault)?);
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        if kind.is_dir() {
            walk(&path, depth + 1, found)?;
        } else if ending.is_some_and(|ending| is_ending(&ending)) && path.is_file() {
            found.push(path);
        }
    }
    Ok(())
}

/// Makes the unit of a file: its absolute path, digest, length and expected cost. `command`: what is to be done with the recording, the words of a
/// command line; empty: render. The file is opened and read. It is left out if it cannot be read, does not have the volume that `command` names, or
/// has a name that is not UTF-8.
///
/// # Errors
/// The command is wrong, independently of the file.
pub fn unit(file: &Path, command: &[String]) -> Result<Found, Failure> {
    let blank = Unit {
        input: String::new(),
        digest: None,
        bytes: None,
        cost: None,
        scene: None,
        command: Some(command.to_vec()).filter(|words| !words.is_empty()),
        outputs: Vec::new(),
    };
    let work = Work::of(&blank)?;
    let left_out = |why: String| Ok(Found::LeftOut(why));
    let Some(name) = std::path::absolute(file).ok().and_then(|path| path.to_str().map(str::to_string)) else {
        return left_out(format!("{}: its name is not UTF-8, which a manifest is", file.display()));
    };
    let opened = source::open_with(file, work.geometry.options()).map_err(input).and_then(|source| {
        check_volume(&*source, "--volume", work.volume, file.display())?;
        Ok(source)
    });
    let source = match opened {
        Ok(source) => source,
        Err(failure) => return left_out(failure.message()),
    };
    match digest_of(&source.files()) {
        Err(why) => left_out(why),
        Ok((digest, bytes)) => Ok(Found::Unit(Box::new(Unit {
            input: name,
            digest: Some(digest),
            bytes: Some(bytes),
            cost: Some(expected_cost(work.kind, &*source, work.volume)),
            ..blank
        }))),
    }
}

/// Expected cost: 1 plus the MiB of the volume's samples times the cost of this kind of work relative to drawing. The ratios are rough; it matters
/// only that a large recording costs more than a small one.
fn expected_cost(kind: Kind, source: &dyn Source, volume: usize) -> f64 {
    let geometry = source.geometry(volume);
    let [width, height] = geometry.frame_size();
    let samples = width as f64 * height as f64 * geometry.slices() as f64;
    let weight = match kind {
        Kind::Measure => 0.2,
        Kind::Render => 1.0,
        Kind::Convert => 4.0,
        Kind::Verify => 50.0,
    };
    let cost = 1.0 + weight * samples * source.stored_type().bytes() as f64 / f64::from(1 << 20);
    // So many digits that a line stays short.
    (cost * 1000.0).round() / 1000.0
}
