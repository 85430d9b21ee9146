//! Arguments of commands that render a recording: the recording, the settings of the scene in layers, the device, and checks of outputs.

use super::labels::show_labels;
use super::picture_file::STANDARD;
use super::recording::{GeometryArgs, open_phantom, open_recording, recording_help};
use super::user_files::{pipeline_folder, presets_file};
use crate::files::check_target;
use crate::files::signals;
use crate::gpu::context::list;
use crate::gpu::{Candidate, Context, ContextOptions, Deadline, DeviceChoice, GpuError, TexelAccess, device_selection};
use crate::marked::Demo;
use crate::scene::default_look::Recorded;
use crate::scene::load::{Layers, LoadError, PRESETS};
use crate::scene::{DeviceFacts, Input, Scene};
use crate::source::{Frame, Source, VolumeFrames};
use crate::terminal::{Failure, failed, input, say, with_progress};
use crate::user_presets;
use crate::workspace::{self, Origin, Workspace};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A flag as it was typed, and the assignment of a setting that it stands for.
type Assigned = (String, String);

/// An open recording, the scene of one of its volumes, and what other scenes of that volume are made from: `recorded` and `layers`.
#[cfg_attr(not(feature = "lab"), expect(dead_code, reason = "only reports read all of it"))]
pub struct Opened {
    pub source: Box<dyn Source>,
    pub recorded: Recorded,
    /// The chosen settings, before defaults are derived from the recording.
    pub layers: Layers,
    pub scene: Scene,
}

/// The command-line arguments that commands which render a recording have in common. Commands that render live have `SourceArgs` instead.
#[derive(clap::Args)]
pub struct InputArgs {
    #[arg(help = format!(
        "Recording: {}, also a stream of frames; or a workspace (.toml) that the viewer saved. Without one, a synthetic fetal head (preset face)",
        recording_help()
    ))]
    input: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    geometry: GeometryArgs,
    /// Segmentation of the recording to show with it (.seg.nrrd): outline and fill on planes, a shell in renderings [default: that of the workspace]
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// Volume of the recording to use, counted from 0 [default: that of the workspace, otherwise 0]
    #[arg(long, value_name = "N")]
    volume: Option<usize>,
    /// A workspace that is a part of a file, in place of the one that `input` names.
    #[arg(skip)]
    stored: Option<(PathBuf, Workspace)>,
}

impl InputArgs {
    /// Opens the recording and builds the scene of the chosen volume. Without a recording it is the phantom. Settings that were not chosen are
    /// derived from the recording; the settings of a workspace are complete.
    ///
    /// # Errors
    /// The recording, the workspace, the segmentation or a setting is wrong, or there is no such volume.
    pub fn open(&self) -> Result<(Box<dyn Source>, Scene), Failure> {
        self.open_with(&[])
    }

    /// Opens the recording and builds the scene as [`InputArgs::open`] does. `chosen`: further assignments of settings, each a pair of the flag that
    /// messages name and `key.path=value`. Flags of these arguments and `--set` take precedence over them.
    ///
    /// # Errors
    /// The recording, the workspace, the segmentation or a setting is wrong, or there is no such volume.
    pub fn open_with(&self, chosen: &[Assigned]) -> Result<(Box<dyn Source>, Scene), Failure> {
        let opened = self.open_recorded(chosen, None)?;
        Ok((opened.source, opened.scene))
    }

    /// Opens the recording and builds the scene of the volume with index `first`, the first that `--volumes` selects.
    ///
    /// # Errors
    /// The recording, the workspace, the segmentation or a setting is wrong, or there is no such volume.
    pub fn open_volumes(&self, first: usize) -> Result<(Box<dyn Source>, Scene), Failure> {
        let opened = self.open_recorded(&[], Some(first))?;
        Ok((opened.source, opened.scene))
    }

    /// Opens the recording and builds the scene as [`InputArgs::open_with`] does. The result can also be used for other scenes of the same volume.
    /// `asked`: index of the volume, from 0, used in place of that of the arguments; None: [`InputArgs::volume`]. `chosen`: as for
    /// [`InputArgs::open_with`].
    ///
    /// # Errors
    /// The recording, the workspace, the segmentation or a setting is wrong, or there is no such volume.
    pub fn open_recorded(&self, chosen: &[Assigned], asked: Option<usize>) -> Result<Opened, Failure> {
        let mut source = self.source()?;
        let volume = asked.map_or_else(|| self.volume(), Ok)?;
        let flag = if asked.is_some() { "--volumes" } else { "--volume" };
        check_volume(&*source, flag, volume, self.name())?;
        let mut layers = self.layers_with(chosen)?;
        if let Some(file) = self.labels()? {
            show_labels(&mut layers, &file, &source.geometry(volume), source.world_of(volume))?;
        }
        let mut recorded = recorded(&*source, volume);
        // The settings of a workspace are complete.
        recorded.is_completed = self.workspace()?.is_none();
        if recorded.needs_levels(&layers) {
            let mut histogram = recorded.histogram(&layers).map_err(input)?;
            shown_frames_of(&mut *source, volume, |frame| histogram.take(&frame.bytes))?;
            recorded.levels = histogram.levels();
        }
        let scene = recorded.scene(&layers).map_err(input)?;
        Ok(Opened { source, recorded, layers, scene })
    }

    /// The workspace, if one was given in place of a recording, and its file.
    fn workspace(&self) -> Result<Option<(&Path, Workspace)>, Failure> {
        if let Some((file, workspace)) = &self.stored {
            return Ok(Some((file, workspace.clone())));
        }
        let file = self.input.as_deref().filter(|file| workspace::is_named(file));
        file.map(|file| Ok((file, Workspace::read(file).map_err(input)?))).transpose()
    }

    /// Opens another recording with the flags that give the geometry of this one.
    ///
    /// # Errors
    /// The file cannot be opened as a recording with these flags.
    pub fn open_another(&self, file: &Path) -> Result<Box<dyn Source>, Failure> {
        open_recording(file, self.geometry.options())
    }

    /// The segmentation to show.
    fn labels(&self) -> Result<Option<PathBuf>, Failure> {
        match &self.labels {
            Some(file) => Ok(Some(file.clone())),
            None => Ok(self.workspace()?.and_then(|(_, workspace)| workspace.origin.labels)),
        }
    }

    /// Index of the volume to use, from 0: `--volume`, else that of the workspace, else 0. An error if the workspace cannot be read.
    pub fn volume(&self) -> Result<usize, Failure> {
        match self.volume {
            Some(volume) => Ok(volume),
            None => Ok(self.workspace()?.map_or(0, |(_, workspace)| workspace.origin.volume)),
        }
    }

    /// Checks `--volumes`: an error if `--volume` is given too, if the workspace cannot be read, or if `--volumes` leaves out the volume of the
    /// workspace, to which the measurements of the workspace belong. `flag`: `--volumes` with its value, for the message. `is_among`: true
    /// for an index that `--volumes` includes.
    pub fn check_volumes(&self, flag: &str, is_among: impl Fn(usize) -> bool) -> Result<(), Failure> {
        if self.volume.is_some() {
            return Err(input("--volume and --volumes: give one of them"));
        }
        match self.workspace()? {
            Some((file, workspace)) if !is_among(workspace.origin.volume) => Err(input(format!(
                "{flag}: leaves out volume {}, which {} is of; choose volumes with it, or set volume in its table [workspace]",
                workspace.origin.volume,
                file.display()
            ))),
            _ => Ok(()),
        }
    }

    /// True if the recording is read from standard input, which is possible only once.
    pub fn is_standard(&self) -> bool {
        self.input.as_deref().is_some_and(|file| file.as_os_str() == STANDARD)
    }

    /// Name of the recording or workspace for messages: the file of [`InputArgs::take_stored`], otherwise the path as the user typed it. It is
    /// `standard input` for `-`, and `phantom` if there is neither.
    pub fn name(&self) -> String {
        match self.stored.as_ref().map(|(file, _)| file).or(self.input.as_ref()) {
            None => "phantom".into(),
            Some(file) if file.as_os_str() == STANDARD => "standard input".into(),
            Some(file) => file.display().to_string(),
        }
    }

    /// Checks the outputs as the function [`check_outputs`] does. The inputs are those of [`InputArgs::read_files`].
    pub fn check_outputs(&self, outputs: &[Output], source: &dyn Source) -> Result<(), Failure> {
        check_outputs(outputs, self.read_files(source).iter().map(PathBuf::as_path))
    }

    /// Which pictures state that they are of the phantom and not of a patient. With a workspace, as in the viewer, every picture states it. Otherwise
    /// a picture states it only if something else, such as a measurement, is drawn over it. None if the volumes are not of the phantom.
    pub fn demo(&self, source: &dyn Source) -> Option<Demo> {
        let is_workspace = self.stored.is_some() || self.input.as_deref().is_some_and(workspace::is_named);
        source.is_synthetic().then_some(if is_workspace { Demo::Always } else { Demo::WithOthers })
    }

    /// All files that are read for the source and the settings, in any order. One of them is the file of the user's presets if `--preset` names one of
    /// these.
    pub fn read_files(&self, source: &dyn Source) -> Vec<PathBuf> {
        let mut read = source.files();
        read.extend(self.geometry.probe.clone());
        read.extend(self.input.clone().filter(|file| workspace::is_named(file)));
        read.extend(self.stored.as_ref().map(|(file, _)| file.clone()));
        read.extend(self.labels().ok().flatten());
        read.extend(self.scene.files());
        // Settings that are refused are named where the scene is made.
        let layers = self.scene.layers_over(Layers::default(), &[]);
        read.extend(layers.iter().flat_map(Layers::transfer_files).map(Path::to_path_buf));
        let is_built_in = |name: &String| PRESETS.iter().any(|(built_in, _)| built_in == name);
        read.extend(presets_file().filter(|_| !self.scene.preset.iter().all(is_built_in)));
        read
    }

    /// True if `--size` was given.
    pub fn has_size(&self) -> bool {
        self.scene.size.is_some()
    }

    /// Path of the recording or workspace as it was typed, `-` included; None if none was given.
    pub fn given(&self) -> Option<PathBuf> {
        self.input.clone()
    }

    /// Uses `workspace`, which was read from a part of `file`, in place of the recording or workspace that was typed.
    pub fn take_stored(&mut self, file: PathBuf, workspace: Workspace) {
        self.stored = Some((file, workspace));
    }

    /// File name, without the folder, of the workspace that was typed; None if a recording or nothing was typed.
    pub fn workspace_name(&self) -> Option<String> {
        let file = self.input.as_deref().filter(|file| workspace::is_named(file))?;
        Some(file.file_name()?.to_string_lossy().into_owned())
    }

    /// The recording with its geometry and the volume to use, as a workspace stores them. Paths are absolute. An error if the workspace that was
    /// given cannot be read, names no recording, or has a depth axis that is not valid.
    pub fn origin(&self) -> Result<Origin, Failure> {
        let (recording, geometry) = match (self.workspace()?, &self.input) {
            (Some((file, workspace)), _) => {
                (workspace.recording(file).map_err(input)?.to_path_buf(), self.geometry.or(&workspace.origin)?)
            }
            (None, recording) => (recording.clone().unwrap_or(workspace::PHANTOM.into()), self.geometry.clone()),
        };
        let mut origin = geometry.origin(Some(recording.clone()));
        if recording.as_os_str() == workspace::PHANTOM {
            origin.recording = Some(recording);
        }
        origin.volume = self.volume()?;
        origin.labels = self.labels()?.map(|file| std::path::absolute(&file).unwrap_or(file));
        Ok(origin)
    }

    /// Every frame of the volume [`InputArgs::volume`], in the order of the recording; shows a progress bar.
    #[cfg(feature = "lab")]
    pub fn frames(&self, source: &mut dyn Source) -> Result<Vec<Frame>, Failure> {
        let mut frames = Vec::new();
        shown_frames_of(source, self.volume()?, |frame| frames.push(frame))?;
        Ok(frames)
    }

    /// The scene with the volume format and the way of sampling that the chosen device will use. If there is no such device, the scene stays
    /// unchanged. Opens no device.
    pub fn resolve_sampling(&self, scene: Scene) -> Scene {
        match self.candidate() {
            Some(device) => stored_on(&device, scene).sampled(TexelAccess::for_device(&device).sampling()),
            None => scene,
        }
    }

    /// The scene with the volume format that the chosen device will use. If there is no such device, the scene stays unchanged. Opens no device.
    #[cfg(feature = "lab")]
    pub fn resolve_format(&self, scene: Scene) -> Scene {
        match self.candidate() {
            Some(device) => stored_on(&device, scene),
            None => scene,
        }
    }

    /// The device of these flags.
    fn candidate(&self) -> Option<Candidate> {
        let mut devices = list().unwrap_or_default();
        let chosen =
            device_selection::choose(&devices, self.scene.device.as_ref().unwrap_or(&DeviceChoice::Best)).ok()?;
        Some(devices.swap_remove(chosen))
    }

    /// Opens the chosen device and prints its name on one line. `validation`: with the Vulkan validation layer. Once a signal is deferred
    /// ([`signals::received`]), waiting for the device ends.
    pub fn open_device(&self, validation: bool) -> Result<Arc<Context>, Failure> {
        self.scene.open_device(validation)
    }

    fn source(&self) -> Result<Box<dyn Source>, Failure> {
        match (self.workspace()?, &self.input) {
            (Some((file, workspace)), _) => match workspace.recording(file).map_err(input)? {
                recording if recording.as_os_str() == workspace::PHANTOM => open_phantom(),
                recording => open_recording(recording, self.geometry.or(&workspace.origin)?.options()),
            },
            (None, Some(file)) => open_recording(file, self.geometry.options()),
            (None, None) => open_phantom(),
        }
    }

    /// The device that was chosen. None: the best one.
    #[cfg(feature = "lab")]
    pub fn device(&self) -> Option<DeviceChoice> {
        self.scene.device.clone()
    }

    fn layers_with(&self, chosen: &[Assigned]) -> Result<Layers, Failure> {
        match self.workspace()? {
            Some((_, workspace)) => self.scene.layers_over(workspace.layers, chosen),
            None => self.scene.layers(self.input.is_none(), chosen),
        }
    }
}

/// The arguments that choose the device and the settings of a scene. Settings are in layers, of which a later one overrides an earlier one.
#[derive(clap::Args)]
pub struct SceneArgs {
    /// vr or volume, sr or surface, mixed, mip, minip, xray or mean, mpr or plane, orthogonal, tomography, cube
    #[arg(long)]
    mode: Option<String>,
    /// single; 4up: three orthogonal planes and the rendering; beside: the rendering and the planes in a column beside it; pair: volume and surface side by side
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    /// Transfer function: grey, sepia, skin, bone, cool, warm, or a .toml file of points
    #[arg(long, value_name = "NAME|FILE")]
    transfer: Option<String>,
    /// File of settings (TOML)
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Preset of settings: bmode, bone, face, face-classic, fetal, glass, skeleton, thesis, vessel. May be repeated; a later one
    /// overrides an earlier one. Without one, windows and filters of a recording follow from its echoes. Another name is that of a preset
    /// that was saved in `echolume view`
    #[arg(long, value_name = "NAME")]
    preset: Vec<String>,
    /// Width and height of the picture, pixels
    #[arg(long, value_name = "WxH")]
    size: Option<String>,
    /// azimuth, elevation, roll, fov (deg; 0 is parallel), zoom, target=lateral:depth:elevation (mm)
    #[arg(long, value_name = "KEY=VALUE,...", allow_hyphen_values = true)]
    camera: Option<String>,
    /// Region of interest, mm: lateral=LOW:HIGH,depth=LOW:HIGH,elevation=LOW:HIGH
    #[arg(long, value_name = "SIDE=LOW:HIGH,...", allow_hyphen_values = true)]
    roi: Option<String>,
    /// Any setting of a scene file, such as surface.threshold=0.1. The value none switches a filter or light off: light.shadow=none
    #[arg(long, value_name = "KEY.PATH=VALUE", allow_hyphen_values = true)]
    set: Vec<String>,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    pub device: Option<DeviceChoice>,
    /// Give a device up that does not finish within this time, such as 5s or 500ms; none: wait for ever [default: 5s on a GPU, none on
    /// a software device]
    #[arg(long, value_name = "TIME")]
    device_timeout: Option<String>,
}

impl SceneArgs {
    /// The chosen settings as layers, before defaults are derived from the recording. `is_phantom`: the layers begin with the presets of the phantom.
    /// `chosen`: further assignments, as for [`InputArgs::open_with`].
    ///
    /// # Errors
    /// A preset, a file or a setting is wrong.
    pub fn layers(&self, is_phantom: bool, chosen: &[Assigned]) -> Result<Layers, Failure> {
        let mut layers = Layers::default();
        if is_phantom {
            // The pair shows a surface.
            let is_pair = self.layout.as_deref().is_some_and(|layout| layout.eq_ignore_ascii_case("pair"));
            // A layout may be typed as a mode.
            let has_mode = self.mode.as_deref().is_some_and(|mode| mode_setting(mode).starts_with("mode="));
            let is_plain = self.preset.is_empty() && self.scene.is_none() && !has_mode && !is_pair;
            layers.phantom(is_plain).map_err(input)?;
        }
        self.layers_over(layers, chosen)
    }

    /// Adds to `layers`, each over the ones before: the presets, the file of settings, the assignments (`chosen`, as for [`InputArgs::open_with`]),
    /// the flags and `--set`.
    ///
    /// # Errors
    /// A preset, a file or a setting is wrong.
    pub fn layers_over(&self, mut layers: Layers, chosen: &[Assigned]) -> Result<Layers, Failure> {
        for preset in &self.preset {
            add_preset(&mut layers, preset)?;
        }
        if let Some(file) = &self.scene {
            layers.file(file).map_err(input)?;
        }
        for (flag, assignment) in chosen {
            layers.set_by(flag, assignment).map_err(input)?;
        }
        for (flag, assignment) in self.assignments()? {
            layers.set_by(&flag, &assignment).map_err(input)?;
        }
        for assignment in &self.set {
            layers.set(assignment).map_err(input)?;
        }
        Ok(layers)
    }

    /// The values of `--scene` and `--transfer` as paths. A transfer function may be a built-in name.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.scene.iter().cloned().chain(self.transfer.iter().map(PathBuf::from))
    }

    /// True if `--size` was given.
    #[cfg(feature = "view")]
    pub fn has_size(&self) -> bool {
        self.size.is_some()
    }

    /// Each flag as it was typed, with the assignment that it stands for.
    fn assignments(&self) -> Result<Vec<Assigned>, Failure> {
        let mut set = Vec::new();
        set.extend(self.mode.as_ref().map(|mode| (format!("--mode {mode}"), mode_setting(mode))));
        for (name, key, value) in
            [("--layout", "layout", &self.layout), ("--transfer", "volume.transfer", &self.transfer)]
        {
            let lower = |value: &str| if key == "layout" { value.to_ascii_lowercase() } else { value.into() };
            set.extend(value.as_ref().map(|value| (format!("{name} {value}"), format!("{key}={}", lower(value)))));
        }
        if let Some(size) = &self.size {
            let flag = format!("--size {size}");
            let edges =
                size.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse::<u32>().ok()?, h.parse::<u32>().ok()?)));
            let (w, h) = edges.ok_or_else(|| input(format!("{flag}: must read WIDTHxHEIGHT in pixels, as 512x512")))?;
            set.push((flag, format!("picture.size=[{w},{h}]")));
        }
        for (name, table, text) in [("--camera", "camera", &self.camera), ("--roi", "region", &self.roi)] {
            for part in text.iter().flat_map(|t| t.split(',')) {
                let flag = format!("{name} {part}");
                let pair = part.split_once('=');
                let (key, value) = pair.ok_or_else(|| input(format!("{flag}: must read key=value,key=value")))?;
                let key = if key == "fov" { "field_of_view" } else { key };
                let value = if value.contains(':') { format!("[{}]", value.replace(':', ",")) } else { value.into() };
                set.push((flag, format!("{table}.{key}={value}")));
            }
        }
        Ok(set)
    }

    /// True if a device or the device's time-out was chosen.
    #[cfg(feature = "verify")]
    pub fn has_device(&self) -> bool {
        self.device.is_some() || self.device_timeout.is_some()
    }

    /// The time after which a device that does not finish counts as lost. An error if `--device-timeout` is no time above 0 and not `none`.
    pub fn deadline(&self) -> Result<Deadline, Failure> {
        match self.device_timeout.as_deref() {
            None => Ok(Deadline::ByDevice),
            Some("none") => Ok(Deadline::Never),
            Some(text) => match humantime::parse_duration(text) {
                Ok(time) if !time.is_zero() => Ok(Deadline::After(time)),
                _ => Err(input(format!("--device-timeout {text}: must be a time such as 5s or 500ms, or none"))),
            },
        }
    }

    /// Opens the chosen device and prints its name on one line. `validation`: with the Vulkan validation layer. Once a signal is deferred
    /// ([`signals::received`]), waiting for the device ends.
    pub fn open_device(&self, validation: bool) -> Result<Arc<Context>, Failure> {
        let (device, deadline) = (self.device.clone().unwrap_or_default(), self.deadline()?);
        open(&ContextOptions {
            device,
            validation,
            deadline,
            stop: Some(|| signals::received().is_some()),
            pipeline_cache: pipeline_folder(),
            ..ContextOptions::default()
        })
    }
}

/// Calls `each` with every frame of the volume with this index, from 0, in the order of the recording. Ends with the first error of the recording.
pub fn frames_of(source: &mut dyn Source, volume: usize, mut each: impl FnMut(Frame)) -> Result<(), Failure> {
    let mut frames = VolumeFrames::of(source, volume).map_err(input)?;
    while let Some(frame) = frames.read().map_err(input)? {
        each(frame);
    }
    frames.count().map(drop).map_err(input)
}

/// The same as [`frames_of`], with a progress bar.
fn shown_frames_of(source: &mut dyn Source, volume: usize, mut each: impl FnMut(Frame)) -> Result<(), Failure> {
    with_progress(source.frames_per_volume() as u64, "frames", |step| {
        frames_of(source, volume, |frame| {
            each(frame);
            step();
        })
    })
}

/// Makes a folder, and those above it, unless they exist.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|e| failed(format!("{}: cannot be written: {e}", folder.display())))
}

/// Fails with the first message of the validation layer, if it has reported any.
pub fn check_messages(context: &Context) -> Result<(), Failure> {
    context.messages().first().map_or(Ok(()), |first| Err(failed(format!("validation: {first}"))))
}

/// Checks that the recording has a volume with this index. The message has the recording's `name` and the `flag` that selects the volume.
pub fn check_volume(
    source: &dyn Source,
    flag: &str,
    volume: usize,
    name: impl std::fmt::Display,
) -> Result<(), Failure> {
    match source.volumes() {
        count if volume >= count => Err(input(format!("{name}: {flag} {volume}: there are {count}, numbered from 0"))),
        _ => Ok(()),
    }
}

/// What all scenes of a volume have in common: its geometry and sample format. The levels of its echoes are None: the caller fills them in if
/// defaults are derived from them.
pub fn recorded(source: &dyn Source, volume: usize) -> Recorded {
    Recorded {
        geometry: source.geometry(volume),
        stated: Input { stored: source.stored_type(), range: source.range() },
        shift: source.sample_type().shift(),
        levels: None,
        is_completed: true,
    }
}

/// Adds a preset: a built-in one, or else one of the user's.
fn add_preset(layers: &mut Layers, name: &str) -> Result<(), Failure> {
    let unknown = match layers.preset(name) {
        Err(unknown @ LoadError::UnknownPreset { .. }) => unknown,
        added => return added.map_err(input),
    };
    let own = match presets_file() {
        Some(file) => user_presets::read(&file).map_err(|e| input(format!("--preset {name}: {e}")))?,
        None => Vec::new(),
    };
    match own.iter().find(|preset| preset.name == name.trim()) {
        Some(preset) => layers.look(name, &preset.look().map_err(input)?).map_err(input),
        None if own.is_empty() => Err(input(unknown)),
        None => {
            let names: Vec<&str> = own.iter().map(|preset| preset.name.as_str()).collect();
            Err(input(format!("{unknown}; of your own: {}", names.join(", "))))
        }
    }
}

/// Other names of modes.
const MODE_SYNONYMS: [(&str, &str); 9] = [
    ("ortho", "orthogonal"),
    ("slices", "orthogonal"),
    ("tomo", "tomography"),
    ("tui", "tomography"),
    ("x-ray", "xray"),
    ("average", "mean"),
    ("avgip", "mean"),
    ("vrt", "vr"),
    ("maxip", "mip"),
];

/// The setting that a mode stands for, whatever its case. `4up` is a layout.
fn mode_setting(mode: &str) -> String {
    let lower = mode.to_ascii_lowercase();
    if ["4up", "4-up"].contains(&&*lower) {
        return "layout=4up".into();
    }
    let name = MODE_SYNONYMS.iter().find(|(other, _)| *other == lower).map_or(&*lower, |(_, name)| name);
    format!("mode={name}")
}

/// Opens the chosen device, or the best one, and prints its name on one line. `validation`: with the Vulkan validation layer.
#[cfg(feature = "lab")]
pub fn open_device(choice: Option<DeviceChoice>, validation: bool) -> Result<Arc<Context>, Failure> {
    open(&ContextOptions {
        device: choice.unwrap_or_default(),
        validation,
        pipeline_cache: pipeline_folder(),
        ..ContextOptions::default()
    })
}

/// Opens the chosen device, or the best one. Once `stop` returns true, waiting for the device ends. Prints nothing.
#[cfg(feature = "verify")]
pub fn open_device_until(
    choice: Option<DeviceChoice>,
    deadline: Deadline,
    stop: fn() -> bool,
) -> Result<Arc<Context>, GpuError> {
    Context::new(&ContextOptions {
        device: choice.unwrap_or_default(),
        deadline,
        stop: Some(stop),
        pipeline_cache: pipeline_folder(),
        ..ContextOptions::default()
    })
}

/// Opens the chosen device, or the best one, and prints its name on one line. The driver reports statistics of compiled pipelines; none is taken from
/// the cache of an earlier run or stored in it.
#[cfg(feature = "lab")]
pub fn open_device_for_statistics(choice: Option<DeviceChoice>) -> Result<Arc<Context>, Failure> {
    let device = choice.unwrap_or_default();
    open(&ContextOptions { device, compile_statistics: true, ..ContextOptions::default() })
}

/// The scene with the format that a device stores its volume best in.
fn stored_on(device: &Candidate, scene: Scene) -> Scene {
    Scene { device: DeviceFacts { truncates_halves: device.truncates_halves(), ..scene.device }, ..scene }
}

fn open(options: &ContextOptions) -> Result<Arc<Context>, Failure> {
    let context = Context::new(options).map_err(device_failure)?;
    let note = if context.candidate.is_software() { " (software: no GPU is used)" } else { "" };
    say!("device: {}{note}, {}", context.candidate.name, context.candidate.driver.trim());
    Ok(context)
}

/// The failure for an error of opening or listing devices. A missing device has an exit code of its own.
pub fn device_failure(error: GpuError) -> Failure {
    match error {
        GpuError::NoLoader(_) | GpuError::NoDevice | GpuError::NoneFits(_) | GpuError::NoSuchDevice { .. } => {
            Failure::NoDevice(error.to_string())
        }
        other => failed(other),
    }
}

/// The flag that names an output, and its path if the flag was given.
pub type Output<'a> = (&'a str, Option<&'a Path>);

/// Checks that the outputs can be written and that none is standard output. Also checks that none, unless it is a device or a pipe, replaces an
/// input (`read`) or is named twice.
pub fn check_outputs<'a>(outputs: &[Output], read: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let read: Vec<&Path> = read.into_iter().collect();
    let outputs: Vec<(&str, &Path)> = outputs.iter().filter_map(|(flag, file)| Some((*flag, (*file)?))).collect();
    for (n, (flag, file)) in outputs.iter().enumerate() {
        let refuse = |why: String| Err(input(format!("{flag} {}: {why}; give another name", file.display())));
        if file.as_os_str() == STANDARD {
            return refuse("only a picture (-o of render and filter) is written to standard output".into());
        }
        if read.iter().any(|input| is_same_file(input, file)) {
            return refuse("would replace an input".into());
        }
        if let Some((other, _)) = outputs[..n].iter().find(|(_, before)| is_same_file(before, file)) {
            return refuse(format!("is written by {other} already"));
        }
        check_target(file).map_err(failed)?;
    }
    Ok(())
}

/// Writes a report, which must not contain data about a patient, and prints its path. The file is complete or not written.
#[cfg(feature = "lab")]
pub fn write_report(file: &Path, text: &str) -> Result<(), Failure> {
    crate::files::replace_shared(file, text.as_bytes()).map_err(failed)?;
    say!("written: {}", file.display());
    Ok(())
}

/// Writes a report as [`write_report`] does, if its file was asked for.
#[cfg(feature = "lab")]
pub fn write_if_asked(file: Option<&Path>, text: impl FnOnce() -> Result<String, String>) -> Result<(), Failure> {
    file.map_or(Ok(()), |file| write_report(file, &text().map_err(failed)?))
}

/// Checks that none of `files`, which `flag` names, would replace an input (`read`).
pub(super) fn check_inputs(flag: &str, files: &[PathBuf], read: &[PathBuf]) -> Result<(), Failure> {
    let inputs: HashSet<PathBuf> = read.iter().filter_map(|file| file.canonicalize().ok()).collect();
    match files.iter().find(|file| file.canonicalize().is_ok_and(|there| inputs.contains(&there))) {
        Some(file) => Err(input(format!("{flag} {}: would replace an input; give another name", file.display()))),
        None => Ok(()),
    }
}

/// True if both paths name the same regular file. A device may be written to more than once.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let resolved = |file: &Path| file.canonicalize().ok();
    let is_special = std::fs::metadata(b).is_ok_and(|m| !m.is_file());
    !is_special && (a == b || resolved(a).is_some_and(|a| resolved(b) == Some(a)))
}
