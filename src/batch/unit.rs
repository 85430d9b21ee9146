//! The command of a unit, and the key of its outputs: a hash of everything that determines them.

use super::manifest::Unit;
use crate::args::{GeometryArgs, SceneArgs};
use crate::digest::{hex, sha256_of_file};
use crate::scene::Settings;
use crate::scene::load::Layers;
use crate::source::segmentation;
use crate::source::volume_file::VolumeFile;
use crate::terminal::{Failure, input};
use crate::tree::Name;
use clap::{Parser, Subcommand};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use toml::Table;

/// Part of every key. It must change when outputs change but the program's version does not.
const SCHEME: &str = "echolume-batch-1";
/// Hexadecimal digits of a key: 128 bits.
const KEY_LENGTH: usize = 32;

/// What can be done with a recording in a batch; its name is that of the subcommand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Name)]
#[tree(rename_all = "lowercase")]
pub enum Kind {
    Render,
    Convert,
    Measure,
    Verify,
}

impl Kind {
    /// File name of the output if the manifest names none.
    fn output(self) -> &'static str {
        match self {
            Kind::Render => "picture.png",
            Kind::Convert => "volume.nrrd",
            Kind::Measure => "figures.json",
            Kind::Verify => "verified.json",
        }
    }

    /// True if the work needs a Vulkan device.
    pub fn needs_device(self) -> bool {
        matches!(self, Kind::Render | Kind::Verify)
    }
}

/// The flags of a unit, as on the command line.
#[derive(Parser)]
#[command(name = "unit", no_binary_name = true, disable_help_flag = true, disable_help_subcommand = true)]
struct UnitLine {
    #[command(subcommand)]
    command: UnitCommand,
}

#[derive(Subcommand)]
enum UnitCommand {
    Render(Box<RenderUnit>),
    Convert(ConvertUnit),
    Measure(VolumeFlags),
    Verify(Box<RenderUnit>),
}

#[derive(clap::Args)]
struct RenderUnit {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    flags: VolumeFlags,
}

#[derive(clap::Args)]
struct ConvertUnit {
    #[command(flatten)]
    flags: VolumeFlags,
    #[arg(long, allow_negative_numbers = true)]
    spacing: Option<f64>,
    #[arg(long, allow_negative_numbers = true)]
    outside: Option<f64>,
}

// The flags of every unit.
#[derive(clap::Args)]
struct VolumeFlags {
    #[command(flatten)]
    geometry: GeometryArgs,
    #[arg(long, default_value_t = 0)]
    volume: usize,
}

/// What is done with a recording: a checked command with all its settings. Units that differ only in their recording share it.
pub struct Work {
    pub kind: Kind,
    /// The work of the unit as text, by which results name it; made by [`text`].
    pub text: String,
    pub geometry: GeometryArgs,
    /// Index of the volume in the recording, from 0.
    pub volume: usize,
    /// Settings with which pictures are drawn, as layers.
    pub layers: Layers,
    /// Voxel spacing of a converted volume, mm; `None`: the grid of a Cartesian recording, or the sample spacing of a sweep.
    pub spacing: Option<f64>,
    /// Value of a converted volume outside the insonified region; `None`: the value of no echo.
    pub outside: Option<f64>,
    /// File name of the output, without the key that precedes it.
    pub output: String,
    /// Hash of the fields above and of the files that settings are read from.
    digest: Vec<u8>,
}

/// The work of a unit as text, by which results name it: the words of its command, or `scene` followed by its settings as JSON, or `render` if the
/// unit states neither.
pub fn text(unit: &Unit) -> String {
    match (&unit.scene, &unit.command) {
        (Some(scene), _) => format!("scene {}", serde_json::to_string(scene).unwrap_or_default()),
        (None, Some(command)) => command.join(" "),
        (None, None) => Kind::Render.name().into(),
    }
}

impl Work {
    /// Parses the work of a unit. Reads the files that its flags name, relative to the working folder.
    ///
    /// # Errors
    /// The command line or a setting is wrong, a file that it names cannot be read, the unit names several outputs, or the command cannot write the
    /// format of the output.
    pub fn of(unit: &Unit) -> Result<Work, Failure> {
        let text = text(unit);
        let mut work = match &unit.scene {
            Some(scene) => {
                let table = Table::try_from(scene).map_err(|e| input(format!("scene: {e}")))?;
                let mut layers = Layers::default();
                layers.table("scene", table, Path::new("")).map_err(input)?;
                Work::new(Kind::Render, layers, GeometryArgs::default(), 0)
            }
            None => Work::parse(unit.command.as_deref().unwrap_or(&["render".to_string()]))?,
        };
        work.output = match unit.outputs.as_slice() {
            [] => work.kind.output().into(),
            [one] => one.clone(),
            several => {
                return Err(input(format!("outputs: {} makes one file, not {}", work.kind.name(), several.len())));
            }
        };
        work.check_output()?;
        // What is given counts, even where it is the default: the rest follows from the recording.
        work.text = text;
        let settings = work.layers.clone().finish().map_err(input)?;
        work.digest = work.hash(&settings)?;
        Ok(work)
    }

    fn new(kind: Kind, layers: Layers, geometry: GeometryArgs, volume: usize) -> Work {
        let (text, output) = (String::new(), String::new());
        Work { kind, text, geometry, volume, layers, spacing: None, outside: None, output, digest: Vec::new() }
    }

    fn parse(command: &[String]) -> Result<Work, Failure> {
        let line = UnitLine::try_parse_from(command).map_err(|e| {
            let said = e.to_string();
            let first = said.lines().next().unwrap_or_default().trim_start_matches("error: ").to_string();
            input(format!("command: {first}; it must be render, convert, measure or verify, with their flags"))
        })?;
        let drawn = |kind: Kind, unit: RenderUnit| {
            if unit.scene.has_device() {
                return Err(input(
                    "command: --device and --device-timeout are flags of `echolume batch`, not of a unit",
                ));
            }
            let layers = unit.scene.layers(false, &[])?;
            let mut work = Work::new(kind, layers, unit.flags.geometry, unit.flags.volume);
            // A transfer function is a name or a file.
            let files = unit.scene.files().filter(|file| file.is_file());
            for file in files.collect::<Vec<_>>() {
                let unreadable = |e| input(format!("{}: cannot be read: {e}", file.display()));
                work.digest.extend(sha256_of_file(&file).map_err(unreadable)?.0.into_bytes());
            }
            Ok(work)
        };
        match line.command {
            UnitCommand::Render(unit) => drawn(Kind::Render, *unit),
            UnitCommand::Verify(unit) => drawn(Kind::Verify, *unit),
            UnitCommand::Measure(flags) => {
                Ok(Work::new(Kind::Measure, Layers::default(), flags.geometry, flags.volume))
            }
            UnitCommand::Convert(unit) => Ok(Work {
                spacing: unit.spacing,
                outside: unit.outside,
                ..Work::new(Kind::Convert, Layers::default(), unit.flags.geometry, unit.flags.volume)
            }),
        }
    }

    fn check_output(&self) -> Result<(), Failure> {
        let name = Path::new(&self.output);
        let ends = |ending: &str| name.extension().is_some_and(|e| e == ending);
        match self.kind {
            Kind::Convert if segmentation::is_one(name) || segmentation::is_dicom(name) => {
                Err(input("outputs: convert of a batch makes volumes; a segmentation is made by echolume convert"))
            }
            Kind::Convert => VolumeFile::of(name).map(drop).map_err(|e| input(format!("outputs: {e}"))),
            Kind::Render if !ends("png") => Err(input("outputs: render makes a .png")),
            Kind::Measure | Kind::Verify if !ends("json") => {
                Err(input(format!("outputs: {} makes a .json", self.kind.name())))
            }
            _ => Ok(()),
        }
    }

    /// Hash of everything that determines the output, except for the recording.
    fn hash(&self, settings: &Settings) -> Result<Vec<u8>, Failure> {
        let settings = settings.to_json().map_err(|e| input(format!("settings: {e}")))?;
        // Presets decide what follows from the echoes.
        let presets = self.layers.presets().join(",");
        let numbers = format!("{} {:?} {:?}", self.volume, self.spacing, self.outside);
        let axis = format!("{:?}", self.geometry.depth_axis);
        let mut hash = Sha256::new();
        let version = env!("CARGO_PKG_VERSION");
        let parts = [SCHEME, version, self.kind.name(), &self.text, &settings, &presets, &numbers, &axis, &self.output];
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        hash.update(&self.digest);
        Ok(hash.finalize().to_vec())
    }

    /// The key of the outputs of this work for a recording with this digest (SHA-256, 64 hexadecimal digits).
    pub fn key(&self, digest: &str) -> Key {
        let mut hash = Sha256::new();
        hash.update(&self.digest);
        hash.update(digest);
        let mut text = hex(&hash.finalize());
        text.truncate(KEY_LENGTH);
        Key(text)
    }
}

/// The key of a unit's outputs: 32 hexadecimal digits, the beginning of their file names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key(String);

impl Key {
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Path of the folder with the unit's files, relative to the batch's folder. There are at most 65536 such folders, so that a million units
    /// leave some tens of files in each.
    pub fn folder(&self) -> PathBuf {
        Path::new("units").join(&self.0[..2]).join(&self.0[2..4])
    }

    /// Path of the unit's record file, relative to the batch's folder.
    pub fn record(&self) -> PathBuf {
        self.folder().join(format!("{}.json", self.0))
    }

    /// Path of the output `name`, relative to the batch's folder.
    pub fn output(&self, name: &str) -> PathBuf {
        self.folder().join(format!("{}-{name}", self.0))
    }

    /// A number in 0..=1 that is derived from the key and evenly distributed: units whose number is below a limit are a random sample.
    pub fn share(&self) -> f64 {
        u32::from_str_radix(&self.0[4..12], 16).map_or(0.0, |n| f64::from(n) / f64::from(u32::MAX))
    }
}
