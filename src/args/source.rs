//! Arguments of commands that render live: the source of frames, and how volumes become pictures.

#[cfg(feature = "view")]
use super::labels::show_labels;
use super::motor::{MotorArgs, PlannedSweep};
use super::number::check_number;
#[cfg(feature = "view")]
use super::recording::open_phantom;
use super::recording::{GeometryArgs, open_recording, say_probe_file};
use crate::gpu::TimeStamps;
use crate::kiosk::config::Config;
use crate::live::Update;
use crate::memory;
use crate::probe::Geometry;
#[cfg(feature = "view")]
use crate::scene::load::Layers;
use crate::source::formats::described;
use crate::source::freehand::FreehandArguments;
use crate::source::igtl::{self, Network, NetworkOptions, Poses, SCHEME};
#[cfg(feature = "view")]
use crate::source::live::SourceKind;
use crate::source::live::{Live, Playback, PlaybackSource};
use crate::source::motor_tracking::FreeRunning;
use crate::source::phantom::{self, Phantom, PhantomSource};
use crate::source::piped::Piped;
use crate::source::{OpenOptions, Source};
use crate::terminal::{Failure, failed, input};
#[cfg(feature = "view")]
use crate::workspace::{Origin, PHANTOM, Workspace};
use clap::Parser;
use std::path::Path;

/// Volumes of the phantom. They are computed once and played in a loop: two sweeps forth and two back.
const PHANTOM_VOLUMES: usize = 4;
/// Default rate of the phantom, volumes per second.
const PHANTOM_RATE: f64 = 1.0;

/// Largest memory of a voxel of a freehand volume, bytes: its sums, and a sample of 32 bits.
const VOXEL_BYTES: u64 = 12;

/// The arguments that choose the source of live frames.
#[derive(Clone, clap::Args)]
pub struct SourceArgs {
    #[arg(long, value_name = "SOURCE", default_value = "phantom", help = format!(
        "phantom; a recording: {}; a folder or a 'pattern*.png' of numbered pictures; for view, a workspace (.toml); - for standard \
         input (a line of JSON, then raw frames, as tools/pipe_frames.py writes them); igtl://HOST[:PORT] for OpenIGTLink",
        described()
    ))]
    source: String,
    #[command(flatten)]
    geometry: GeometryArgs,
    /// Rate of a recording or the phantom, volumes per second [default: as fast as possible; the phantom: 1]
    #[arg(long, value_name = "N", conflicts_with = "real_time")]
    rate: Option<f64>,
    /// Play a recording at the rate of its time stamps
    #[arg(long)]
    real_time: bool,
    /// Number of times that a recording is played
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// OpenIGTLink: the device (TRANSFORM) or tool (TDATA) that tracks 2D frames; "image": the matrix of each IMAGE [default: any TRANSFORM]
    #[arg(long, value_name = "NAME")]
    tool: Option<String>,
    /// OpenIGTLink: the device whose images are taken, where there are several [default: all]
    #[arg(long, value_name = "NAME")]
    device_name: Option<String>,
    /// OpenIGTLink: take messages whose checksum is 0, unchecked: some senders compute none
    #[arg(long)]
    no_checksum: bool,
    /// The rectangle of each tracked frame that holds ultrasound, pixels
    #[arg(long, value_name = "X,Y,W,H")]
    clip: Option<String>,
    /// Voxel spacing of the volume that tracked frames are compounded into, mm [default: the frames' pixel spacing]
    #[arg(long, value_name = "MM")]
    spacing: Option<f64>,
    /// Widest gap between tracked frames that is filled, mm [default: 2]
    #[arg(long, value_name = "MM")]
    hole: Option<f64>,
    /// Length of a freehand sweep, mm: the volume has room for it from the first frames on, and does not begin again when it grows
    #[arg(long, value_name = "MM")]
    extent: Option<f64>,
    /// Most memory of a volume that tracked frames are compounded into, such as 2G: up to that it grows with the sweep [default: 384M]
    #[arg(long, value_name = "SIZE", value_parser = memory::parse)]
    freehand_size: Option<u64>,
    #[command(flatten)]
    motor: MotorArgs,
}

/// The arguments alone, to parse what a configuration states.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct SourceParser {
    #[command(flatten)]
    source: SourceArgs,
}

impl SourceArgs {
    /// The source that a configuration file of the kiosk selects. Error messages name the keys of the file.
    pub fn from_config(config: &Config) -> Result<SourceArgs, Failure> {
        let parsed = SourceParser::try_parse_from(config.source_arguments()).map_err(|error| {
            let text = error.to_string();
            // Usage and the hint to --help follow an empty line. They apply to a command line only.
            let text = text.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ").replace("\n ", "");
            input(config.flag_error(&text))
        })?;
        parsed.source.check().map_err(|failure| match failure {
            Failure::Input(text) => input(config.flag_error(&text)),
            failure => failure,
        })?;
        Ok(parsed.source)
    }

    /// Checks the range of each value. Whether the values fit together and fit the source is checked by [`SourceArgs::open`].
    pub fn check(&self) -> Result<(), Failure> {
        self.playback(self.rate)?;
        self.network()?;
        self.motor.check()
    }

    /// The same arguments for another recording; the flags of geometry and of freehand volumes remain.
    #[cfg(feature = "view")]
    pub fn at_file(&self, file: &Path) -> SourceArgs {
        SourceArgs { source: file.to_string_lossy().into_owned(), ..self.clone() }
    }

    /// The same arguments for another recording, without the flags of geometry and of freehand volumes.
    #[cfg(feature = "view")]
    pub fn of_file(&self, file: &Path) -> SourceArgs {
        let geometry = GeometryArgs::default();
        SourceArgs {
            geometry,
            clip: None,
            spacing: None,
            hole: None,
            extent: None,
            freehand_size: None,
            ..self.at_file(file)
        }
    }

    /// The same arguments for the recording that a workspace names. The geometry of the workspace is used where these arguments state none. `file`:
    /// path of the workspace.
    ///
    /// # Errors
    /// The workspace names no recording, or its depth axis is not valid.
    #[cfg(feature = "view")]
    pub fn of_workspace(&self, file: &Path, workspace: &Workspace) -> Result<SourceArgs, Failure> {
        let source = workspace.recording(file).map_err(input)?.to_string_lossy().into_owned();
        Ok(SourceArgs { source, geometry: self.geometry.or(&workspace.origin)?, ..self.clone() })
    }

    /// The recording and its geometry flags as a workspace stores them; the phantom alone if that is the source; nothing if the source is live.
    #[cfg(feature = "view")]
    pub fn origin(&self) -> Origin {
        match self.kind() {
            SourceKind::Demo => Origin::of(Some(PHANTOM.into())),
            SourceKind::Recording => self.geometry.origin(Some(self.source.clone().into())),
            SourceKind::Pipe | SourceKind::Probe => Origin::of(None),
        }
    }

    /// Adds the labels of a segmentation of the first volume of this source to the settings.
    ///
    /// # Errors
    /// The file cannot be read as a segmentation, its labels cannot be shown on the volume, the recording cannot be opened, or the source is standard
    /// input or a network.
    #[cfg(feature = "view")]
    pub fn show_labels(&self, layers: &mut Layers, file: &Path) -> Result<(), Failure> {
        let source = match self.kind() {
            SourceKind::Demo => open_phantom()?,
            SourceKind::Recording => open_recording(self.path(), self.geometry.options())?,
            SourceKind::Pipe | SourceKind::Probe => {
                return Err(input("--labels: are of a recording; the volumes of this source are live"));
            }
        };
        show_labels(layers, file, &source.geometry(0), source.world_of(0))
    }

    /// The map from voxels of the first volume of a recording to world coordinates. None if its file states none or cannot be opened, or if the
    /// source is no recording.
    #[cfg(feature = "view")]
    pub fn world(&self) -> Option<crate::probe::World> {
        let recording = (self.kind() == SourceKind::Recording).then_some(self.path())?;
        open_recording(recording, self.geometry.options()).ok()?.world_of(0)
    }

    /// True if the recording is played only once, so that volume numbers are those of the recording.
    #[cfg(feature = "view")]
    pub fn plays_once(&self) -> bool {
        self.rounds <= 1
    }

    /// True if the source is the built-in phantom.
    pub fn is_phantom(&self) -> bool {
        self.source == "phantom"
    }

    /// What the source is, as its name tells: the phantom, standard input, a probe (`igtl://`) or a recording.
    #[cfg(feature = "view")]
    pub fn kind(&self) -> SourceKind {
        match self.source.as_str() {
            _ if self.is_phantom() => SourceKind::Demo,
            "-" => SourceKind::Pipe,
            source if source.starts_with(SCHEME) => SourceKind::Probe,
            _ => SourceKind::Recording,
        }
    }

    /// The source as the user typed it, but `standard input` for `-`; for messages.
    pub fn name(&self) -> &str {
        match self.source.as_str() {
            "-" => "standard input",
            source => source,
        }
    }

    /// The source as a path, which has a meaning only if the source is a file.
    pub fn path(&self) -> &Path {
        Path::new(&self.source)
    }

    /// Opens the source. If a motor was requested, also opens its port and starts its sweep.
    ///
    /// # Errors
    /// A flag does not fit the source, or the source or the motor cannot be opened.
    pub fn open(&self) -> Result<Box<dyn Live>, Failure> {
        let network = self.source.strip_prefix(SCHEME);
        let is_file = !self.is_phantom() && self.source != "-" && network.is_none();
        let fan = self.is_phantom().then_some(phantom::FAN_ANGLE_DEG);
        let sweep = self.motor.plan(self.geometry.probe.as_deref(), is_file.then(|| self.path()), fan)?;
        if let Some(flag) = self.geometry.for_files().filter(|_| !is_file) {
            return Err(input(format!("{flag}: is for recordings of files")));
        }
        if self.is_phantom() {
            if let Some(flag) = self.freehand()?.flag() {
                return Err(input(format!("{flag}: is for frames with poses; the phantom has none")));
            }
            return self.phantom(sweep.as_ref());
        }
        let source: Box<dyn Live> = if self.source == "-" {
            say_probe_file(self.geometry.probe.as_deref());
            let piped = Piped::new(std::io::stdin(), self.geometry.probe.as_deref()).map_err(input)?;
            Box::new(piped.compounded(self.network()?.freehand))
        } else if let Some(address) = network {
            if address.is_empty() {
                return Err(input(format!("--source {}: must read igtl://HOST or igtl://HOST:PORT", self.source)));
            }
            if igtl::port(address).is_none_or(|port| port == 0) {
                return Err(input(format!("--source {}: its port must lie in 1..=65535", self.source)));
            }
            if sweep.is_some() {
                return Err(input(format!(
                    "--source {}: its frames carry their own positions; --motor is for frames without",
                    self.source
                )));
            }
            let network = Network::connect(address, self.network()?);
            Box::new(network.map_err(|e| failed(format!("{}: {e}", self.source)))?)
        } else {
            let options = OpenOptions { freehand: self.freehand()?, ..self.geometry.options() };
            let mut recording = open_recording(self.path(), options)?;
            recording.prepare().map_err(input)?;
            // The frame rate of a free-running probe is limited by the speed of sound.
            let rate = self.rate.or(sweep.as_ref().and_then(|_| acoustic_rate(&*recording)));
            Box::new(PlaybackSource::new(recording, self.playback(rate)?, self.rounds))
        };
        match sweep {
            Some(sweep) => {
                let motor = sweep.start()?;
                Ok(sweep.track(source, motor, is_file))
            }
            None => Ok(source),
        }
    }

    fn playback(&self, rate: Option<f64>) -> Result<Playback, Failure> {
        let is_allowed = |rate: f64| self.real_time || rate > 0.0 && rate <= 1e6;
        check_number("--rate", rate, is_allowed, "must be above 0, at most 1e6 volumes a second")?;
        Ok(match rate {
            _ if self.real_time => Playback::Recorded,
            Some(rate) => Playback::Volumes(rate),
            None => Playback::Fast,
        })
    }

    /// The phantom: its volumes in a loop, or with a motor the frames that the moving array acquires.
    fn phantom(&self, sweep: Option<&PlannedSweep>) -> Result<Box<dyn Live>, Failure> {
        let options =
            phantom::PhantomOptions { volumes: PHANTOM_VOLUMES, both_ways: true, ..phantom::PhantomOptions::default() };
        let Some(sweep) = sweep else {
            let playback = self.playback(self.rate.or(Some(PHANTOM_RATE)))?;
            let phantom = Phantom::new(options).map_err(input)?;
            return Ok(Box::new(PlaybackSource::new(Box::new(PhantomSource::cached(phantom)), playback, u32::MAX)));
        };
        if self.rate.is_some() || self.real_time {
            return Err(input(
                "--rate and --real-time: with --motor the speed of sound and the motor set the rate of the phantom",
            ));
        }
        let phantom = FreeRunning::phantom(options, sweep.speed).map_err(input)?;
        let motor = sweep.start()?;
        let source = FreeRunning::new(phantom, motor.positions().clone());
        Ok(sweep.track(Box::new(source), motor, false))
    }

    fn network(&self) -> Result<NetworkOptions, Failure> {
        let mut options = NetworkOptions { device: self.device_name.clone(), ..NetworkOptions::default() };
        match (&mut options.poses, self.tool.as_deref()) {
            (poses, Some("image")) => *poses = Poses::Image,
            (Poses::Messages { device, .. }, tool) => *device = tool.map(str::to_string),
            (Poses::Image, _) => {}
        }
        options.client.takes_no_checksum = self.no_checksum;
        options.freehand = self.freehand()?.over(options.freehand);
        Ok(options)
    }

    /// What is said of the volume that pictures with poses are compounded into.
    fn freehand(&self) -> Result<FreehandArguments, Failure> {
        let lengths = [("--spacing", self.spacing, 0.01), ("--hole", self.hole, 0.0), ("--extent", self.extent, 0.0)];
        for (flag, given, least) in lengths {
            let rule = format!("must lie in {least}..=1000 mm");
            check_number(flag, given, |mm| (least..=1000.0).contains(&mm), &rule)?;
        }
        let max_voxels = self.freehand_size.map(|bytes| match memory::check(bytes) {
            Ok(()) => Ok((bytes / VOXEL_BYTES).max(1) as usize),
            Err(why) => Err(input(format!("--freehand-size: {why}"))),
        });
        let (clip, max_voxels) = (self.clip()?, max_voxels.transpose()?);
        Ok(FreehandArguments { clip, spacing: self.spacing, max_hole: self.hole, extent: self.extent, max_voxels })
    }

    fn clip(&self) -> Result<Option<[usize; 4]>, Failure> {
        let Some(text) = &self.clip else { return Ok(None) };
        let fault = || input(format!("--clip {text}: must read X,Y,W,H in pixels, as 100,40,520,440"));
        let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.parse().ok()).collect();
        numbers.and_then(|n| n.try_into().ok()).map(Some).ok_or_else(fault)
    }
}

/// The volume rate that the speed of sound allows, per second. None for a Cartesian volume.
fn acoustic_rate(source: &dyn Source) -> Option<f64> {
    match source.geometry(0) {
        Geometry::Sweep(probe) => Some(1.0 / probe.acquisition_time()),
        Geometry::Cartesian(_) => None,
    }
}

/// How the volumes of a live source become pictures.
#[derive(clap::Args)]
pub struct StreamArgs {
    /// whole: a volume is shown when all of its frames have arrived; rolling: each frame is shown at once
    #[arg(long, value_name = "HOW", default_value = "whole")]
    update: String,
    /// Number of volume buffers with --update whole, 2 or 3
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(2..=3))]
    pub images: u32,
    /// Number of device queues to use, 1 to 3 [default: one for each kind of work that the device has a queue for]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    queues: Option<u8>,
    /// Time every pass, not only pictures and frames as a whole. Passes then do not overlap, so that pictures take longer
    #[arg(long)]
    timings: bool,
}

impl StreamArgs {
    /// How arriving frames become visible, as `--update` says.
    pub fn update(&self) -> Result<Update, Failure> {
        match self.update.as_str() {
            "whole" => Ok(Update::Whole),
            "rolling" => Ok(Update::Rolling),
            other => Err(input(format!("--update {other}: must be whole or rolling"))),
        }
    }

    /// Which operations are timed on the device: each pass with `--timings`, otherwise only pictures and frames as a whole.
    pub fn time_stamps(&self) -> TimeStamps {
        if self.timings { TimeStamps::EachPass } else { TimeStamps::Ends }
    }

    /// Number of device queues to use, as `--queues` says; None: one for each kind of work that the device has a queue for.
    pub fn queues(&self) -> Option<usize> {
        self.queues.map(usize::from)
    }
}
