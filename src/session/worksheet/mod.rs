//! The worksheet of a workspace: each measurement with its quantities, what it was made on, and its picture with the caliper. [`Sheet`] is all of
//! it but the pixels; [`html`], [`pdf`] and [`Sheet::csv`] write it.

pub mod html;
pub mod pdf;
mod view;

use crate::digest::sha256;
use crate::measure::contours;
use crate::measure::made;
use crate::measure::outcome::{self, Quantity};
use crate::picture::Picture;
use crate::scene::{Made, MeasureKind, Measurement, Scene, Settings};
use crate::segment::sections::Arrangement;
use crate::text::{csv_quoted, printable};
use crate::tree::{self, FromNode, Node, NodeError, ToNode};
use toml::{Table, Value};

/// The version of the JSON that this program writes and reads.
pub const VERSION: u32 = 1;
/// What stands on every page.
const FOOTER: &str = "Not a medical device";
/// What is said of a volume whose method gives none.
const NO_INTERVAL: &str = "no interval stated";

/// The content of a worksheet.
#[derive(Clone, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Sheet {
    /// Version of this form: [`VERSION`].
    pub echolume_worksheet: u32,
    /// Version of the program that wrote it.
    pub program: String,
    /// When the pictures were drawn first, such as `2026-11-23 20:00:00 UTC`.
    pub date: String,
    /// Name and driver of the device that drew the pictures.
    pub device: String,
    /// File name of the workspace; empty if there is none.
    pub workspace: String,
    pub recording: Recording,
    pub measurements: Vec<Entry>,
    /// The text of a workspace with the recording and all settings, from which the pictures are drawn again.
    pub source: String,
}

/// The recording that was measured.
#[derive(Clone, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Recording {
    /// File name.
    pub name: String,
    /// Number of its volumes.
    pub volumes: usize,
    /// Number of its files, those that state its geometry included; 0 for the phantom.
    pub files: usize,
    /// Total length of all files, bytes.
    pub bytes: u64,
    /// SHA-256 of its file in hexadecimal; of several files the SHA-256 of their digests, one a line, in the order of their paths. Empty for the
    /// phantom.
    pub sha256: String,
}

/// A measurement on the worksheet: its result, what it was made on, and its picture.
#[derive(Clone, Debug, PartialEq, FromNode, ToNode)]
pub struct Entry {
    /// Number of the measurement in the list of the workspace's settings, from 1.
    pub number: usize,
    pub kind: String,
    pub text: String,
    /// What was measured. The JSON has it for other programs. It is empty in a sheet that was read, because it is computed again from
    /// [`Sheet::source`].
    #[tree(skip_deserializing)]
    pub quantities: Vec<Quantity>,
    /// How a volume follows from its contours or voxels, or why the measurement has no result; None for others.
    #[tree(skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// What is stated of the confidence interval of a volume; None for other measurements.
    #[tree(skip_serializing_if = "Option::is_none")]
    pub interval: Option<String>,
    /// Number of its volume, from 0.
    pub volume: u32,
    /// Time stamp of that volume, s; None if it has none.
    #[tree(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// The plane or the view that the measurement was made on; if that was not recorded, the one that its picture shows. Empty if neither is known.
    pub plane: String,
    /// The mode, and a digest of the settings, with which the measurement was made; if they were not recorded, those of its picture.
    pub settings: String,
    pub picture: Shown,
}

/// The picture of a measurement.
#[derive(Clone, Debug, PartialEq, Eq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Shown {
    /// What differs from the settings of [`Sheet::source`], as assignments of `render --set`.
    pub set: Vec<String>,
    /// The caption: the plane or the view that the picture shows.
    pub caption: String,
    /// The mode, and a digest of its settings.
    pub settings: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// SHA-256 of its pixels: red, green, blue and alpha of 8 bits, rows from the top.
    pub sha256: String,
}

/// A picture to draw: that of one measurement.
#[derive(Clone, Debug)]
pub struct Block {
    index: usize,
    pub volume: u32,
    view: view::View,
}

impl Block {
    /// True if the measurement has a picture of its own in the worksheet. False for texts and arrows, which are only drawn on pictures.
    pub fn is_for(measured: &Measurement) -> bool {
        !matches!(measured.kind, MeasureKind::Text | MeasureKind::Arrow)
    }

    /// The block of the measurement with this index. `scene`: that of the workspace for this volume. `set`: how its view differs, as in
    /// [`Shown::set`]; None: a view that shows the measurement is searched for.
    ///
    /// # Errors
    /// One line: a view that is not allowed.
    pub fn new(scene: &Scene, index: usize, volume: u32, set: Option<&[String]>) -> Result<Block, String> {
        let view = match set {
            Some(set) => view::with(scene, set.to_vec(), index, volume)?,
            None => view::of(scene, index, volume)?,
        };
        Ok(Block { index, volume, view })
    }

    /// The scene of the picture.
    pub fn scene(&self) -> &Scene {
        &self.view.scene
    }

    /// True if both blocks have the same picture.
    pub fn is_drawn_as(&self, other: &Block) -> bool {
        (self.volume, &self.view.set) == (other.volume, &other.view.set)
    }

    /// The entry with this picture. `time`: time stamp of the volume, s.
    pub fn entry(&self, picture: &Picture, time: Option<f64>) -> Entry {
        let scene = self.scene();
        let measured = &scene.settings.drawn.measure[self.index];
        let quantities = outcome::quantities(measured);
        let fault = quantities.as_ref().err().map(|why| why.to_string());
        let plane = made::plane(scene, view::shown_points(measured), measured.on_surface);
        let settings = made::settings(&scene.settings);
        let caption = match (self.view.is_drawn, measured.kind) {
            (_, MeasureKind::Threshold) => "plane through the middle of its box".into(),
            (true, _) if !plane.is_empty() => plane.clone(),
            (true, _) => "view of the workspace".into(),
            (false, _) => "view of the workspace, in which no plane holds the measurement".into(),
        };
        let made = measured.made.clone().unwrap_or_default();
        let or = |own: String, other: &str| if own.is_empty() { other.to_string() } else { own };
        let is_volume = matches!(measured.kind, MeasureKind::Volume | MeasureKind::Threshold);
        Entry {
            number: self.index + 1,
            kind: measured.title().into(),
            text: measured.text.clone(),
            quantities: quantities.unwrap_or_default(),
            method: fault.or_else(|| method(measured)),
            interval: is_volume.then(|| measured.interval.map_or(NO_INTERVAL.into(), interval)),
            volume: self.volume,
            time: made.time.or(time),
            plane: or(made.plane, &plane),
            settings: or(made.settings, &settings),
            picture: Shown {
                set: self.view.set.clone(),
                caption,
                settings,
                size: [picture.width, picture.height],
                sha256: sha256(&picture.rgba),
            },
        }
    }
}

/// An interval of a volume, mm^3, in words.
fn interval([low, high]: [f64; 2]) -> String {
    format!("95 %: {:.2} to {:.2} cm3", low / 1000.0, high / 1000.0)
}

/// How the volume of a body was found.
fn method(measured: &Measurement) -> Option<String> {
    let count = measured.contours.len();
    match measured.kind {
        MeasureKind::Volume => {
            let places = |contour: &Vec<[f64; 3]>| contour.iter().map(|point| (*point).into()).collect();
            let contours: Vec<_> = measured.contours.iter().map(places).collect();
            Some(match contours::volume(&contours).ok()?.1 {
                Arrangement::Parallel { .. } => format!("{count} contours in parallel planes: area times distance"),
                Arrangement::Rotated { .. } => format!("{count} contours in planes through one axis, turned about it"),
            })
        }
        MeasureKind::Threshold => {
            let level = measured.threshold.map_or(String::new(), |share| format!(" {:.0} of 255", share * 255.0));
            Some(match measured.interval {
                Some(_) => format!("largest bright body in a box, by the echoes at its surface, where they are{level}"),
                None => format!("count of the voxels of a box whose echo reaches{level}"),
            })
        }
        _ => None,
    }
}

/// A label and what stands beside it.
type Row = (String, String);

impl Entry {
    /// What was measured, and its text.
    fn title(&self) -> String {
        if self.text.is_empty() { self.kind.clone() } else { format!("{}: {}", self.kind, printable(&self.text)) }
    }

    /// The most important quantity.
    fn result(&self) -> String {
        self.quantities.first().map_or("no result".into(), Quantity::shown)
    }

    /// All that is stated of it. A single quantity stands above.
    fn rows(&self, volumes: usize) -> Vec<Row> {
        let time = self.time.map_or("not stated".into(), |time| format!("{time:.3} s"));
        let picture = Some(&self.picture.caption).filter(|caption| **caption != self.plane);
        let drawn_with = Some(&self.picture.settings).filter(|settings| **settings != self.settings);
        let conditions = [
            ("Of volume", Some(format!("{} of {}", u64::from(self.volume) + 1, volumes.max(1)))),
            ("Time", Some(time)),
            ("Plane", Some(self.plane.clone()).filter(|plane| !plane.is_empty())),
            ("Settings", Some(self.settings.clone())),
            ("Method", self.method.clone()),
            ("Interval", self.interval.clone()),
            ("Picture", picture.cloned()),
            ("Drawn with", drawn_with.cloned()),
            ("SHA-256", Some(self.picture.sha256.clone())),
        ];
        let figures = self.quantities.iter().filter(|_| self.quantities.len() > 1);
        let figures = figures.map(|figure| (capitalised(figure.name), figure.shown()));
        figures.chain(rows_of(conditions)).collect()
    }
}

/// The rows of which something is known, safe to print.
fn rows_of<const N: usize>(all: [(&str, Option<String>); N]) -> impl Iterator<Item = Row> {
    all.into_iter().filter_map(|(label, words)| Some((label.to_string(), printable(&words?))))
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

impl Sheet {
    /// Reads the JSON of a worksheet.
    ///
    /// # Errors
    /// One line without the file's name: it is no worksheet, or one of another version.
    pub fn read(text: &str) -> Result<Sheet, String> {
        let fault = |e: NodeError| printable(&format!("is no worksheet: {e}"));
        let mut node = Node::parse_json(text.as_bytes()).map_err(fault)?;
        match node.at("echolume_worksheet").and_then(|version| version.as_u64()) {
            Some(version) if version != u64::from(VERSION) => {
                Err(format!("is of version {version}, this program reads version {VERSION}"))
            }
            _ => Sheet::from_node(node).map_err(fault),
        }
    }

    /// The sheet as JSON.
    ///
    /// # Errors
    /// One line: the sheet cannot be written as JSON.
    pub fn json(&self) -> Result<String, String> {
        tree::to_json_lines(self).map(|text| text + "\n").map_err(|e| e.to_string())
    }

    /// The results as CSV, a line for each quantity: the columns that the viewer saves, and digests, the program's version and the device.
    /// `settings`: those of the workspace, with the measurements.
    pub fn csv(&self, settings: &Settings) -> String {
        let mut all = settings.drawn.measure.clone();
        for entry in &self.measurements {
            let Entry { volume, time, plane, settings, .. } = entry.clone();
            if let Some(measured) = entry.number.checked_sub(1).and_then(|index| all.get_mut(index)) {
                measured.made = Some(Made { volume, time, plane, settings });
            }
        }
        let device = csv_quoted(&self.device);
        outcome::csv_with(&all, &self.recording.name, ",recording_sha256,picture_sha256,program,device", |n| {
            let entry = self.measurements.iter().find(|entry| entry.number == n);
            let picture = entry.map_or("", |entry| &entry.picture.sha256);
            format!(",{},{picture},{},{device}", self.recording.sha256, self.program)
        })
    }

    /// What is stated of the whole.
    fn head(&self) -> Vec<Row> {
        let Recording { name, files, bytes, sha256, .. } = &self.recording;
        let digest = match files {
            0 => "none: it is computed".into(),
            1 => sha256.clone(),
            files => format!("{sha256}, of the digests of {files} files"),
        };
        let length = if *files == 0 { String::new() } else { format!(" ({:.1} MB)", *bytes as f64 / 1e6) };
        rows_of([
            ("Recording", Some(format!("{name}{length}"))),
            ("SHA-256", Some(digest)),
            ("Workspace", Some(self.workspace.clone()).filter(|name| !name.is_empty())),
            ("Date", Some(self.date.clone())),
            ("Device", Some(self.device.clone())),
            ("Program", Some(format!("Echolume {}", self.program))),
        ])
        .collect()
    }
}

/// The settings of a picture that are not their defaults, one `key = value` a line, without what is drawn over it.
fn changed(settings: &Settings) -> Vec<String> {
    fn differing(path: &str, table: &Table, usual: Option<&Table>, found: &mut Vec<String>) {
        for (key, value) in table {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            match (value, usual.and_then(|usual| usual.get(key))) {
                (_, Some(same)) if value == same => {}
                (Value::Table(table), usual) => differing(&path, table, usual.and_then(Value::as_table), found),
                _ => found.push(printable(&format!("{path} = {value}"))),
            }
        }
    }
    let tables = [settings.clone().without_drawings(), Settings::default()].map(|settings| settings.to_table());
    let mut found = Vec::new();
    if let [Ok(table), Ok(usual)] = tables {
        differing("", &table, Some(&usual), &mut found);
    }
    found
}
