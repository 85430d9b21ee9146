//! Files with right answers: those that users of other programs could not open, or opened wrongly (tests/data/outside/README.md says what each had), and
//! random ones (tests/data/generated). What `convert`, `info` and `render` make of them.

use crate::common::files::{Folder, data};
use crate::common::program::run;
use echolume::low_level::probe::{Geometry, Indices};
use echolume::low_level::source::{StoredType, open};
use glam::{DMat3, DVec3};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
struct Cases {
    expected: BTreeMap<String, Place>,
    cases: Vec<Case>,
}

/// Where the voxels of a right answer are.
#[derive(Deserialize)]
struct Place {
    /// Rows of the matrix from voxels to mm (LPS).
    step: Option<[[f64; 3]; 3]>,
    origin: Option<[f64; 3]>,
    /// Of pictures without a place, mm.
    spacing: Option<[f64; 2]>,
    /// Of a scan: sample, line and slice, and where they are, mm (lateral, depth, elevation).
    #[serde(default)]
    samples: Vec<([usize; 3], [f64; 3])>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    file: String,
    check: Check,
    /// Right answers: any of them.
    #[serde(default)]
    expected: Vec<String>,
    /// Volumes to compare, if not all.
    volumes: Option<usize>,
    /// First and last time stamp, s.
    times: Option<[f64; 2]>,
    /// Time stamp of each volume, s; empty if none has one.
    stamps: Option<Vec<f64>>,
    tolerance: Option<f64>,
    /// Pixels from one that is compared to the next.
    every: Option<usize>,
    #[serde(default)]
    args: Vec<String>,
    /// The file that is read alike.
    #[serde(rename = "as")]
    twin: Option<String>,
    /// The picture is that of the twin, too.
    #[serde(default)]
    draw: bool,
    /// Where a bright block is, mm.
    #[serde(default)]
    at: Vec<f64>,
    angles: Option<[f64; 2]>,
    depths: Option<[f64; 2]>,
    floor: Option<f64>,
    #[serde(default)]
    balls: Vec<[f64; 3]>,
    /// A refusal in one line is right as well.
    #[serde(default)]
    or_refuse: bool,
    /// A line with one of these words is right as well.
    #[serde(default)]
    or_warn: Vec<String>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Check {
    Volumes,
    Pictures,
    Polar,
    Same,
    Centroid,
    Sector,
    Balls,
    Refuse,
}

/// What `convert` wrote: voxels, x fastest, and where they are.
struct Written {
    size: [usize; 3],
    step: DMat3,
    origin: DVec3,
    values: Vec<f64>,
}

impl Written {
    /// An uncompressed MetaImage, read without the program's own reader.
    fn read(path: &Path) -> Written {
        let bytes = std::fs::read(path).expect("a file");
        const LAST: &[u8] = b"ElementDataFile = LOCAL\n";
        let end = bytes.windows(LAST.len()).position(|w| w == LAST).expect("a header") + LAST.len();
        let header = std::str::from_utf8(&bytes[..end]).expect("text");
        let field = |key: &str| {
            let line = header.lines().find_map(|line| line.strip_prefix(&format!("{key} = ")));
            line.unwrap_or_else(|| panic!("{key} in {header}")).trim()
        };
        let numbers =
            |key: &str| -> Vec<f64> { field(key).split_whitespace().map(|n| n.parse().expect("a number")).collect() };
        let three = |key: &str| <[f64; 3]>::try_from(numbers(key)).expect("three numbers");
        let matrix: [f64; 9] = numbers("TransformMatrix").try_into().expect("nine numbers");
        // Each axis in turn.
        let step = DMat3::from_cols_array(&matrix) * DMat3::from_diagonal(three("ElementSpacing").into());
        let values = decoded(field("ElementType"), &bytes[end..]);
        Written { size: three("DimSize").map(|n| n as usize), step, origin: three("Offset").into(), values }
    }

    fn place(&self, n: usize) -> DVec3 {
        let [x, y, _] = self.size;
        self.origin + self.step * DVec3::new((n % x) as f64, (n / x % y) as f64, (n / x / y) as f64)
    }

    fn at(&self, place: DVec3) -> Result<f64, String> {
        let index = self.step.inverse() * (place - self.origin);
        let near = index.round();
        let is_there = (0..3).all(|n| (0.0..self.size[n] as f64).contains(&near[n]));
        if !is_there || (self.step * (index - near)).abs().max_element() > 1e-3 {
            let spacing = [0, 1, 2].map(|n| self.step.col(n).length());
            return Err(format!("{:?} voxels of {spacing:?} mm from {}", self.size, self.origin));
        }
        let [x, y, z] = near.as_uvec3().to_array().map(|n| n as usize);
        Ok(self.values[(z * self.size[1] + y) * self.size[0] + x])
    }

    /// Mean place of the voxels that a rule chooses, by their weight.
    fn centroid(&self, chosen: impl IntoIterator<Item = usize>, weight: impl Fn(f64) -> f64) -> Option<DVec3> {
        let sum = |(sum, all): (DVec3, f64), n: usize| {
            (sum + weight(self.values[n]) * self.place(n), all + weight(self.values[n]))
        };
        let (sum, all) = chosen.into_iter().fold((DVec3::ZERO, 0.0), sum);
        (all > 0.0).then_some(sum / all)
    }
}

/// Little-endian samples of a type of MetaImage.
fn decoded(kind: &str, bytes: &[u8]) -> Vec<f64> {
    match kind {
        "MET_UCHAR" => bytes.iter().map(|b| f64::from(*b)).collect(),
        "MET_USHORT" => bytes.as_chunks().0.iter().map(|b| f64::from(u16::from_le_bytes(*b))).collect(),
        "MET_SHORT" => bytes.as_chunks().0.iter().map(|b| f64::from(i16::from_le_bytes(*b))).collect(),
        "MET_FLOAT" => bytes.as_chunks().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect(),
        other => panic!("{other}"),
    }
}

/// The arrays of a right answer: one for each volume, with their size, x first.
fn frames(set: &str, name: &str) -> (Vec<usize>, Vec<Vec<f64>>) {
    let bytes = std::fs::read(data(&format!("{set}/expected/{name}.npy"))).expect("a right answer");
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..10 + length]).expect("text");
    assert!(header.contains("'fortran_order': False"));
    let shape = header.split_once('(').and_then(|(_, rest)| rest.split_once(')')).expect("a shape").0;
    let shape: Vec<usize> = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    let samples = &bytes[10 + length..];
    let values = match header.split('\'').nth(3).expect("a type") {
        "|u1" => decoded("MET_UCHAR", samples),
        "<i2" => decoded("MET_SHORT", samples),
        "<f4" => decoded("MET_FLOAT", samples),
        "<f8" => samples.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
        other => panic!("{other}"),
    };
    let each = shape[1..].iter().product();
    (shape[1..].iter().rev().copied().collect(), values.chunks(each).map(<[f64]>::to_vec).collect())
}

/// A file as a user had it: some are stored packed.
fn stored(folder: &Folder, set: &str, file: &str) -> PathBuf {
    let path = data(&format!("{set}/{file}"));
    let Some(name) = file.strip_suffix(".packed") else { return path };
    let mut plain = Vec::new();
    let packed = std::fs::File::open(path).expect("a file");
    flate2::read::GzDecoder::new(packed).read_to_end(&mut plain).expect("packed by gzip");
    folder.write(name.rsplit('/').next().unwrap_or(name), plain).into()
}

struct Checked<'a> {
    /// The folder below tests/data.
    set: &'static str,
    case: &'a Case,
    places: &'a BTreeMap<String, Place>,
    folder: &'a Folder,
}

impl Checked<'_> {
    fn file(&self, file: &str) -> String {
        stored(self.folder, self.set, file).to_str().expect("a plain name").to_string()
    }

    fn convert_file(&self, file: &str, volume: usize) -> Result<Written, (Option<i32>, String)> {
        let (from, to, n) = (self.file(file), self.folder.path("out.mha"), volume.to_string());
        let given: Vec<&str> = self.case.args.iter().map(String::as_str).collect();
        let (code, _, said) = run(&[&["convert", &from, &to, "--volume", &n][..], &given].concat());
        if code == Some(0) { Ok(Written::read(Path::new(&to))) } else { Err((code, said)) }
    }

    fn convert(&self, volume: usize) -> Result<Written, String> {
        self.convert_file(&self.case.file, volume).map_err(|(code, said)| format!("{code:?}: {said}"))
    }

    fn check(&self) -> Result<(), String> {
        match self.case.check {
            Check::Volumes | Check::Pictures => {
                let mut faults = self.case.expected.iter().map(|name| self.frames(name));
                let first = faults.next().expect("a right answer");
                faults.fold(first, |found, other| found.or(other))?;
                self.times()?;
                self.stamps()
            }
            Check::Polar => self.polar(&self.case.expected[0]).and_then(|()| self.stamps()),
            Check::Same => self.same(),
            Check::Centroid => {
                let written = self.convert(0)?;
                let bright = (0..written.values.len()).filter(|n| written.values[*n] > 150.0);
                let at = written.centroid(bright, |v| v - 20.0).ok_or("no bright block")?;
                self.is_at(at, 0.3)
            }
            Check::Sector => self.sector(),
            Check::Balls => self.balls(),
            Check::Refuse => self.convert(0).and(Err("a volume without a word".into())),
        }
    }

    fn is_at(&self, place: DVec3, most: f64) -> Result<(), String> {
        let off = self.case.at.iter().enumerate().map(|(n, at)| (place[n] - at).abs()).fold(0.0, f64::max);
        if off > most { Err(format!("the bright block is at {place}")) } else { Ok(()) }
    }

    /// Every volume is that of a right answer, and there are no more.
    fn frames(&self, name: &str) -> Result<(), String> {
        let ((size, all), place) = (frames(self.set, name), &self.places[name]);
        let count = self.case.volumes.unwrap_or(all.len());
        for (t, wanted) in all.iter().take(count).enumerate() {
            let written = self.convert(t)?;
            let compared = match self.case.check {
                Check::Pictures => self.picture(&written, &size, wanted, place),
                _ => self.volume(&written, &size, wanted, place),
            };
            compared.map_err(|fault| format!("volume {t}: {fault}"))?;
        }
        match self.convert_file(&self.case.file, count) {
            Ok(_) => Err(format!("there are more than {count} volumes")),
            Err(_) => Ok(()),
        }
    }

    /// Each voxel is at its place in the world, whatever the order of the axes.
    fn volume(&self, written: &Written, size: &[usize], wanted: &[f64], place: &Place) -> Result<(), String> {
        let step = DMat3::from_cols_array_2d(&place.step.expect("steps")).transpose();
        let origin = DVec3::from(place.origin.expect("an origin"));
        if written.values.len() != wanted.len() {
            return Err(format!("{:?} voxels", written.size));
        }
        for (n, wanted) in wanted.iter().enumerate() {
            let [x, y, z] = [n % size[0], n / size[0] % size[1], n / size[0] / size[1]].map(|n| n as f64);
            let found = written.at(origin + step * DVec3::new(x, y, z))?;
            if (found - wanted).abs() > self.case.tolerance.unwrap_or(1e-3) {
                return Err(format!("voxel {x} {y} {z} is {found}, not {wanted}"));
            }
        }
        Ok(())
    }

    fn picture(&self, written: &Written, size: &[usize], wanted: &[f64], place: &Place) -> Result<(), String> {
        let every = self.case.every.unwrap_or(1);
        let there: Vec<usize> = written.size.into_iter().filter(|n| *n > 1).collect();
        if there.iter().map(|n| n.div_ceil(every)).ne(size.iter().copied()) {
            return Err(format!("{there:?} pixels"));
        }
        let axes: Vec<usize> = (0..3).filter(|n| written.size[*n] > 1).collect();
        for (axis, mm) in axes.iter().zip(place.spacing.iter().flatten()) {
            let found = written.step.col(*axis).length();
            if (found / mm - 1.0).abs() > 1e-3 {
                return Err(format!("pixels of {found} mm, not {mm}"));
            }
        }
        for (n, wanted) in wanted.iter().enumerate() {
            let [x, y] = [n % size[0], n / size[0]];
            let found = written.values[y * every * there[0] + x * every];
            if (found - wanted).abs() > self.case.tolerance.unwrap_or(1.0) {
                return Err(format!("pixel {x} {y} is {found}, not {wanted}"));
            }
        }
        Ok(())
    }

    /// First and last time stamp, as `info` says them.
    fn times(&self) -> Result<(), String> {
        let Some(wanted) = self.case.times else { return Ok(()) };
        let (_, out, _) = run(&["info", &self.file(&self.case.file)]);
        let line = out.lines().find(|line| line.starts_with("time stamp")).ok_or("no time stamps")?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let dots = words.iter().position(|word| *word == "..").ok_or_else(|| line.to_string())?;
        let unit = if words[dots + 2] == "ms" { 1e-3 } else { 1.0 };
        let found = [dots - 1, dots + 1].map(|n| unit * words[n].parse::<f64>().expect("a time"));
        match found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 2e-4) {
            true => Ok(()),
            false => Err(format!("times from {found:?}")),
        }
    }

    /// The time of each frame is that of its volume.
    fn stamps(&self) -> Result<(), String> {
        let Some(wanted) = &self.case.stamps else { return Ok(()) };
        let mut source = open(Path::new(&self.file(&self.case.file)), None).map_err(|error| error.to_string())?;
        while let Some(frame) = source.next_frame().map_err(|error| error.to_string())? {
            let right = match (frame.time, wanted.get(frame.volume as usize)) {
                // NIfTI states them in f32.
                (Some(time), Some(stamp)) => (time - stamp).abs() <= 1e-7 * stamp.abs().max(1.0),
                (time, stamp) => time.is_none() && stamp.is_none(),
            };
            if !right {
                return Err(format!("the time of volume {} is {:?}", frame.volume, frame.time));
            }
        }
        Ok(())
    }

    /// Each frame has its samples, in geometric order, and they are at their places.
    fn polar(&self, name: &str) -> Result<(), String> {
        let (size, all) = frames(self.set, name);
        let mut source = open(Path::new(&self.file(&self.case.file)), None).map_err(|error| error.to_string())?;
        let Geometry::Sweep(probe) = source.geometry(0) else { return Err("no scan lines".into()) };
        let found = [probe.samples, probe.lines.len(), probe.slices.len(), source.volumes()];
        if found != [size[0], size[1], size[2], all.len()] {
            return Err(format!("{found:?} samples, lines, slices and volumes"));
        }
        for ([sample, line, slice], place) in &self.places[name].samples {
            let at = Indices { sample: *sample as f64, line: *line as f64, slice: *slice as f64 };
            let off = probe.to_space(at).distance(DVec3::from(*place));
            if off > 1e-3 {
                return Err(format!("sample {sample} {line} {slice} is {off} mm away"));
            }
        }
        let kind = if source.stored_type() == StoredType::U8 { "MET_UCHAR" } else { "MET_FLOAT" };
        let (each, mut read) = (size[0] * size[1], 0);
        while let Some(frame) = source.next_frame().map_err(|error| error.to_string())? {
            let wanted = &all[frame.volume as usize][frame.slice * each..][..each];
            let values = decoded(kind, &frame.bytes);
            if values.len() != each || values.iter().zip(wanted).any(|(a, b)| (a - b).abs() > 1e-4) {
                return Err(format!("other samples in frame {} of volume {}", frame.slice, frame.volume));
            }
            read += 1;
        }
        if read == size[2] * all.len() { Ok(()) } else { Err(format!("{read} frames")) }
    }

    fn same(&self) -> Result<(), String> {
        let twin = self.case.twin.as_deref().expect("a twin");
        for t in 0..self.case.volumes.expect("a count") {
            let (other, own) = (self.convert_file(twin, t).map_err(|(_, said)| said)?, self.convert(t)?);
            for (n, wanted) in other.values.iter().enumerate() {
                let found = own.at(other.place(n))?;
                if found != *wanted {
                    return Err(format!("volume {t}: voxel {n} is {found}, not {wanted}"));
                }
            }
        }
        if self.case.draw {
            let drawn = [twin, &self.case.file].map(|file| {
                let to = self.folder.path("drawn.png");
                let (code, _, said) = run(&["render", &self.file(file), "--mode", "mpr", "--size", "96x80", "-o", &to]);
                assert_eq!(code, Some(0), "{said}");
                image::open(&to).expect("a picture").to_rgb8().into_raw()
            });
            if drawn[0].iter().zip(&drawn[1]).any(|(a, b)| a.abs_diff(*b) > 3) {
                return Err("another picture".into());
            }
        }
        Ok(())
    }

    /// No echo outside of the sector, and the bright block at its place.
    fn sector(&self) -> Result<(), String> {
        let ([low, high], [near, far]) = (self.case.angles.expect("angles"), self.case.depths.expect("depths"));
        let floor = self.case.floor.expect("a floor");
        for t in 0..self.case.volumes.unwrap_or(1) {
            let written = self.convert(t)?;
            let is_outside = |n: usize| {
                let at = written.place(n);
                let (angle, depth) = (at.x.atan2(at.y), at.x.hypot(at.y));
                !(low - 0.06..=high + 0.06).contains(&angle) || !(near - 1.5..=far + 1.5).contains(&depth)
            };
            let (outside, inside): (Vec<usize>, Vec<usize>) = (0..written.values.len()).partition(|n| is_outside(*n));
            let loudest = outside.iter().map(|n| written.values[*n]).fold(f64::MIN, f64::max);
            if outside.len() < 100 || loudest > floor + 0.5 {
                return Err(format!("{loudest} dB outside of the sector, {} voxels", outside.len()));
            }
            let bright = inside.into_iter().filter(|n| written.values[*n] > -3.0);
            let at = written.centroid(bright, |_| 1.0).ok_or("no bright block")?;
            self.is_at(at, 0.6)?;
        }
        Ok(())
    }

    /// Mutual distances of bright balls: those of the nearest pairs, in order.
    fn balls(&self) -> Result<(), String> {
        let written = self.convert(0)?;
        let [x, y, _] = written.size;
        let mut left: Vec<bool> = written.values.iter().map(|v| *v > 130.0).collect();
        let mut balls = Vec::new();
        while let Some(start) = left.iter().position(|bright| *bright) {
            let (mut part, mut next) = (vec![start], 0);
            left[start] = false;
            while let Some(n) = part.get(next).copied() {
                next += 1;
                for by in [1, x, x * y] {
                    for n in [n.checked_sub(by), Some(n + by)].into_iter().flatten() {
                        if left.get(n) == Some(&true) {
                            left[n] = false;
                            part.push(n);
                        }
                    }
                }
            }
            if part.len() >= 5 {
                balls.extend(written.centroid(part, |v| v));
            }
        }
        let distances = |balls: &[DVec3]| {
            let pairs = (0..balls.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
            let mut all: Vec<f64> = pairs.map(|(a, b)| balls[a].distance(balls[b])).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let wanted: Vec<DVec3> = self.case.balls.iter().map(|at| DVec3::from(*at)).collect();
        let off = distances(&balls).iter().zip(distances(&wanted)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        match balls.len() == wanted.len() && off <= 0.3 {
            true => Ok(()),
            false => Err(format!("{} balls, whose distances are off by {off} mm", balls.len())),
        }
    }

    /// True if the file is refused in one line, or a line warns, where that is right as well.
    fn is_told(&self) -> bool {
        /// Words of a line of a description that is no plain fact.
        const DOUBT: [&str; 8] = ["not", "no", "missing", "unknown", "ignored", "assumed", "instead", "more"];
        let file = self.file(&self.case.file);
        let given: Vec<&str> = self.case.args.iter().map(String::as_str).collect();
        let (code, _, said) = run(&[&["convert", &file, &self.folder.path("told.mha")][..], &given].concat());
        let is_warning = |line: &&str| ["WARN", "INFO"].iter().any(|word| line.trim_start().starts_with(word));
        let refused = said.lines().filter(|line| !is_warning(line) && !line.trim().is_empty()).count() == 1;
        let (_, out, err) = run(&["info", &file]);
        let is_doubt = |line: &&str| line.split(|c: char| !c.is_alphanumeric()).any(|word| DOUBT.contains(&word));
        let lines = said.lines().chain(err.lines()).chain(out.lines().filter(is_doubt));
        let lines: Vec<String> = lines.map(|line| line.replace(&file, "").to_lowercase()).collect();
        let warned =
            code == Some(0) && self.case.or_warn.iter().any(|word| lines.iter().any(|line| line.contains(word)));
        (self.case.or_refuse && code == Some(2) && refused) || warned
    }
}

/// Compares the files of a folder, at least so many.
fn check_all(set: &'static str, least: usize) {
    let text = std::fs::read_to_string(data(&format!("{set}/cases.json"))).expect("the cases");
    let all: Cases = serde_json::from_str(&text).expect("JSON");
    let folder = Folder::new(set);
    let mut faults = Vec::new();
    for case in &all.cases {
        let checked = Checked { set, case, places: &all.expected, folder: &folder };
        if let Err(fault) = checked.check()
            && !checked.is_told()
        {
            faults.push(format!("{}: {fault}", case.name));
        }
    }
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), all.cases.len(), faults.join("\n"));
    assert!(all.cases.len() >= least);
}

#[test]
fn files_of_other_programs_are_read_right_or_refused() {
    check_all("outside", 82);
}

#[test]
fn random_files_are_read_as_other_programs_read_them() {
    check_all("generated", 50);
}
