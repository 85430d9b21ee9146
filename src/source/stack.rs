//! Numbered pictures of one size as the slices of a Cartesian volume: those of a folder, or those that a pattern such as `slice-*.png` names.

use super::keys::Unused;
use super::layout::{Cartesian, Layout, StoredGeometry, extent, warned};
use super::packed::{Encoding, Pixels};
use super::pictures::{About, ENDINGS, Pictures, beside_pixels};
use super::pixel::{Number, PixelFormat};
use super::{OpenOptions, describe};
use crate::files::{self, InputError, escaped, progress, quoted};
use crate::probe::{AxisOrder, Grid, World};
use crate::tree::{self, FromNode};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Most files of a folder that are looked at.
const MAX_FILES: usize = 1 << 20;
/// Largest probe file, bytes.
const MAX_PROBE_BYTES: u64 = 1 << 20;
/// What a stack lacks that has no geometry.
const NO_SPACING: &str =
    "pictures do not say how large they are: give --voxel-spacing X,Y,Z (mm), or --probe for scan lines";

/// True if a path stands for several pictures: it is a folder, or a pattern of names and no existing file.
pub(super) fn is_meant(path: &Path) -> bool {
    path.is_dir() || (pattern(path).is_some() && !path.exists())
}

/// The file name as a pattern, if it has a `*` or `?`.
fn pattern(path: &Path) -> Option<String> {
    path.file_name().and_then(|name| name.to_str()).filter(|name| name.contains(['*', '?'])).map(str::to_string)
}

/// Reads the layout of a stack of pictures: the headers of all pictures, and none of their pixels.
///
/// # Errors
/// There are no pictures, their names are not numbered evenly, they differ in size or depth, or one cannot be read.
pub(super) fn read(path: &Path, options: &OpenOptions) -> Result<Layout, InputError> {
    let fault = |field: &str, fault: String| InputError::new(path, field, fault);
    let (folder, names) = list(path)?;
    let order = order(&names).map_err(|why| fault("pictures", why))?;
    let pictures: Vec<PathBuf> = order.into_iter().map(|n| folder.join(&names[n])).collect();
    let (mut size, mut is_colour, mut is_turned, mut length) = (None, false, false, 0);
    progress::expect_files(pictures.len() as u64);
    for picture in &pictures {
        let about = About::of(picture).map_err(|why| InputError::new(picture, "file", why))?;
        progress::file_read();
        let ([width, height], deep) = *size.get_or_insert((about.size, about.deep));
        if about.size != [width, height] {
            let [a, b] = about.size;
            let why = format!("has {a} x {b} pixels, the first {width} x {height}");
            return Err(InputError::new(picture, "picture", why));
        }
        if about.deep != deep {
            return Err(InputError::new(picture, "picture", "has not as many bits a pixel as the first"));
        }
        is_colour |= about.is_colour;
        is_turned |= about.is_turned;
        length += about.length;
    }
    let ([width, height], deep) = size.unwrap_or_default();
    let number = if deep { Number::U16 } else { Number::U8 };
    let side = |which: &str, n: u32| extent(path, "picture", which, n.into());
    let frame_size = [side("width ", width)?, side("height ", height)?];
    let frames = extent(path, "pictures", "number ", pictures.len() as u64)?;
    let (mut remarks, mut unused) = (Vec::new(), Unused::default());
    if is_turned {
        let text = "pictures say that they are to be turned or mirrored (EXIF): drawn as stored";
        remarks.push(warned(path, "not drawn so", text.into()));
    }
    let beside = pictures.first().map(|first| beside_pixels(first)).unwrap_or_default();
    beside.iter().for_each(|name| unused.note_as_it_is(name));
    let spacing = match (options.voxel_spacing, options.probe) {
        (Some(_), Some(_)) => {
            return Err(fault("--voxel-spacing", "and --probe say different things; give one".into()));
        }
        (Some(spacing), None) => Some(spacing),
        (None, probe) => {
            let beside = pictures.first().map(|first| first.with_file_name("probe.toml")).filter(|file| file.is_file());
            let found =
                probe.map(Path::to_path_buf).or(beside).map(|file| stated_spacing(&file).map(|found| (file, found)));
            let (file, spacing) = found.transpose()?.unwrap_or_default();
            remarks.extend(spacing.map(|_| ("spacing from".to_string(), describe::path(&file))));
            spacing
        }
    };
    let states_geometry = spacing.is_some();
    let geometry = match spacing {
        Some(spacing) => {
            let size = [frame_size[0], frame_size[1], frames];
            let grid = Grid { size, spacing, origin: [0.0; 3] };
            grid.check().map_err(|e| fault("voxel spacing", format!("{} {}", e.field, e.fault)))?;
            StoredGeometry::Cartesian(Cartesian { size, volumes: 1, world: World::of(&grid), order: AxisOrder::STORED })
        }
        None => StoredGeometry::Missing(fault("spacing", NO_SPACING.into())),
    };
    let named =
        |picture: Option<&PathBuf>| quoted(&picture.and_then(|p| p.file_name()).unwrap_or_default().to_string_lossy());
    remarks.push(("pictures".into(), format!("{} to {}", named(pictures.first()), named(pictures.last()))));
    let pixel = PixelFormat { channels: if is_colour { 3 } else { 1 }, ..PixelFormat::grey(number) };
    let pictures = Pictures { files: pictures, is_colour, each: frame_size[0] * frame_size[1] * pixel.bytes() };
    let pixels = Pixels::gathered(path, Encoding::Pictures, length, pictures);
    let stated = Layout::new("stack of pictures", pixel, frame_size, frames, pixels, geometry);
    let layout = Layout { states_geometry, remarks, unused, ..stated };
    layout.check(path, "pictures")?;
    Ok(layout)
}

/// A probe file of a stack of slices: nothing but their spacing.
#[derive(FromNode)]
#[tree(deny_unknown_fields)]
struct StackFile {
    voxels: Voxels,
}

#[derive(FromNode)]
#[tree(deny_unknown_fields)]
struct Voxels {
    spacing_mm: [f64; 3],
}

/// The spacing that a probe file states, mm; None for one of scan lines.
fn stated_spacing(file: &Path) -> Result<Option<[f64; 3]>, InputError> {
    let text = files::read_text(file, MAX_PROBE_BYTES, "probe file").map_err(|e| InputError::new(file, "file", e))?;
    let has_voxels = toml::from_str::<toml::Table>(&text).is_ok_and(|table| table.contains_key("voxels"));
    if !has_voxels {
        // What is wrong with it is said by its own reader.
        return Ok(None);
    }
    let read = tree::from_toml::<StackFile>(&text);
    let read = read.map_err(|e| InputError::new(file, "voxels", e.message().trim().replace('\n', ", ")))?;
    Ok(Some(read.voxels.spacing_mm))
}

/// The folder of a stack, and the names of the pictures in it.
fn list(path: &Path) -> Result<(PathBuf, Vec<String>), InputError> {
    let pattern = if path.is_dir() { None } else { pattern(path) };
    let folder = match &pattern {
        None => path,
        Some(_) => path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new(".")),
    };
    let unreadable = |e| InputError::unreadable(folder, &e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)?.take(MAX_FILES) {
        let name = entry.map_err(unreadable)?.file_name();
        let is_one = match &pattern {
            Some(pattern) => name.to_str().is_some_and(|name| fits(pattern.as_bytes(), name.as_bytes())),
            None => {
                Path::new(&name).extension().is_some_and(|e| ENDINGS.iter().any(|known| e.eq_ignore_ascii_case(known)))
            }
        };
        if is_one && folder.join(&name).is_file() {
            names.extend(name.to_str().map(str::to_string));
        }
    }
    if names.is_empty() {
        let why = match pattern {
            Some(_) => "no file has such a name".to_string(),
            None => format!("is a folder without pictures (.{}); a recording is a file", ENDINGS.join(", .")),
        };
        return Err(InputError::new(path, "pictures", why));
    }
    // The order of a folder is any.
    names.sort();
    Ok((folder.to_path_buf(), names))
}

/// True if a name fits a pattern: `*` is any text, `?` any one byte.
fn fits(pattern: &[u8], name: &[u8]) -> bool {
    // Where to go on after the last `*`: in the pattern, and in the name if it takes one byte more.
    let (mut p, mut n, mut again) = (0, 0, None);
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                again = Some((p, n));
                p += 1;
            }
            Some(c) if *c == b'?' || *c == name[n] => (p, n) = (p + 1, n + 1),
            _ => match again {
                Some((star, from)) => {
                    again = Some((star, from + 1));
                    (p, n) = (star + 1, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|c| *c == b'*')
}

/// A name as text and numbers in turn, text first.
fn parts(name: &str) -> (Vec<&str>, Vec<u64>) {
    let (mut texts, mut numbers, mut rest) = (Vec::new(), Vec::new(), name);
    loop {
        let digits = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        texts.push(&rest[..digits]);
        rest = &rest[digits..];
        if rest.is_empty() {
            return (texts, numbers);
        }
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        // A number that is too long is as good as any: it is the same as no other.
        numbers.push(rest[..end].parse().unwrap_or(u64::MAX));
        rest = &rest[end..];
    }
}

/// The indices of names by their number. All other parts of the names are the same, and the numbers have one step: a missing slice would
/// move all slices after it.
///
/// # Errors
/// One line: what is wrong.
fn order(names: &[String]) -> Result<Vec<usize>, String> {
    let Some((first, others)) = names.split_first() else { return Ok(Vec::new()) };
    let shown = |name: &str| quoted(&escaped(name, 60));
    let (texts, numbers) = parts(first);
    let mut varying = BTreeSet::new();
    for name in others {
        let (other_texts, other_numbers) = parts(name);
        if other_texts != texts {
            return Err(format!(
                "{} and {} differ in more than a number; name one stack by a pattern, such as 'slice-*.png'",
                shown(first),
                shown(name)
            ));
        }
        varying.extend((0..numbers.len()).filter(|n| numbers[*n] != other_numbers[*n]));
    }
    let place = match varying.into_iter().collect::<Vec<_>>()[..] {
        [] => match others.first() {
            None => return Ok(vec![0]),
            Some(other) => return Err(format!("{} and {} have one number", shown(first), shown(other))),
        },
        [place] => place,
        _ => return Err("differ in more than one number; name one stack by a pattern, such as 'slice-2-*.png'".into()),
    };
    let mut numbered: Vec<(u64, usize)> = names.iter().enumerate().map(|(n, name)| (parts(name).1[place], n)).collect();
    numbered.sort_unstable();
    let step = numbered[1].0 - numbered[0].0;
    for pair in numbered.windows(2) {
        let ((before, _), (after, at)) = (pair[0], pair[1]);
        if after == before {
            return Err(format!("two have the number {after}, {} is one", shown(&names[at])));
        }
        if after - before != step {
            return Err(format!(
                "number {before} is followed by {after} ({}), others by a step of {step}: a slice is missing or one too many",
                shown(&names[at])
            ));
        }
    }
    Ok(numbered.into_iter().map(|(_, n)| n).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ordered(names: &[&str]) -> Result<Vec<usize>, String> {
        order(&names.iter().map(|name| name.to_string()).collect::<Vec<_>>())
    }

    #[test]
    fn names_are_ordered_by_their_number_and_gaps_are_refused() {
        assert_eq!(ordered(&["a10.png", "a8.png", "a9.png"]), Ok(vec![1, 2, 0]));
        assert_eq!(ordered(&["7t-05-x.png", "7t-000-x.png", "7t-10-x.png"]), Ok(vec![1, 0, 2]));
        assert_eq!(ordered(&["only.png"]), Ok(vec![0]));
        assert_eq!(ordered(&[]), Ok(vec![]));
        for (names, why) in [
            (&["a1.png", "a2.png", "a4.png"][..], "number 2 is followed by 4 ('a4.png'), others by a step of 1"),
            (&["a1.png", "a01.png"], "'a1.png' and 'a01.png' have one number"),
            (&["a1.png", "a2.png", "a02.png"], "two have the number 2"),
            (&["a1.png", "b2.png"], "differ in more than a number"),
            (&["a1b1.png", "a1b2.png", "a2b1.png"], "more than one number"),
            (&["a1.png", "a.png"], "differ in more than a number"),
        ] {
            assert!(ordered(names).is_err_and(|said| said.contains(why)), "{names:?}: {:?}", ordered(names));
        }
        let long = format!("a{}.png", "9".repeat(400));
        assert!(ordered(&["a1.png", &long]).is_ok(), "two names have any step");
    }

    #[test]
    fn patterns_fit_as_those_of_a_shell() {
        for (pattern, name, is) in [
            ("*.png", "a.png", true),
            ("*.png", "a.png.bak", false),
            ("a*b*c", "aXbYbZc", true),
            ("a*b*c", "aXbYbZ", false),
            ("s?.png", "s1.png", true),
            ("s?.png", "s10.png", false),
            ("*", "", true),
            ("", "a", false),
            ("***a", "bca", true),
        ] {
            assert_eq!(fits(pattern.as_bytes(), name.as_bytes()), is, "{pattern} {name}");
        }
    }
}
