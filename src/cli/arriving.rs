//! Where frames come from on their own clock: the arguments of every command that renders live.

use super::driven::{Driven, Driving};
use super::{Failure, failed, input};
use crate::kiosk::config::Config;
use crate::probe::Geometry;
use crate::source::Source;
use crate::source::freehand;
use crate::source::igtl::{Network, NetworkOptions, Poses};
use crate::source::live::{Live, Paced, Playback};
use crate::source::motor_tracking::FreeRunning;
use crate::source::phantom::{self, Phantom};
use crate::source::phantom_source::Kept;
use crate::source::piped::Piped;
use clap::Parser;
use std::path::{Path, PathBuf};

/// Volumes of the phantom that are computed beforehand and played in turns: forth and back twice.
const PHANTOM_VOLUMES: usize = 4;
/// Volumes a second of the phantom, where nothing else is said.
const PHANTOM_RATE: f64 = 1.0;
const NETWORK: &str = "igtl://";

#[derive(Clone, clap::Args)]
pub struct Arriving {
    /// phantom; a recording (.mha, .mhd, .vol, .frames); - for standard input (raw frames behind a line of JSON, as
    /// tools/pipe_frames.py writes them); igtl://HOST[:PORT] for OpenIGTLink
    #[arg(long, value_name = "SOURCE", default_value = "phantom")]
    source: String,
    /// Geometry of the probe (TOML), where the source does not bring its own
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
    /// Volumes a second of a recording or the phantom [default: as fast as they are taken; the phantom: 1]
    #[arg(long, value_name = "N", conflicts_with = "real_time")]
    rate: Option<f64>,
    /// Play a recording as it was stamped
    #[arg(long)]
    real_time: bool,
    /// Times that a recording is played
    #[arg(long, value_name = "N", default_value_t = 1)]
    rounds: u32,
    /// OpenIGTLink: whose TRANSFORM, or which tool of TDATA, places 2D frames; "image": their own matrix [default: any TRANSFORM]
    #[arg(long, value_name = "NAME")]
    tool: Option<String>,
    /// The part of each tracked frame that is ultrasound, pixels
    #[arg(long, value_name = "X,Y,W,H")]
    clip: Option<String>,
    /// Distance between the voxels that tracked frames are compounded into, mm [default: between the frames' pixels]
    #[arg(long, value_name = "MM")]
    spacing: Option<f64>,
    /// Widest gap between tracked frames that is bridged, mm
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    hole: f64,
    #[command(flatten)]
    driven: Driven,
}

/// The same without a command.
#[derive(Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Alone {
    #[command(flatten)]
    arriving: Arriving,
}

impl Arriving {
    /// What a configuration says of the source. Messages are about its keys.
    pub fn configured(config: &Config) -> Result<Arriving, Failure> {
        let parsed = Alone::try_parse_from(config.source_arguments()).map_err(|error| {
            let said = error.to_string();
            // Usage and the pointer to help, behind an empty line, are about a command line.
            let said = said.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ").replace("\n ", "");
            input(config.refuse(&said))
        })?;
        parsed.arriving.check().map_err(|failure| match failure {
            Failure::Input(said) => input(config.refuse(&said)),
            failure => failure,
        })?;
        Ok(parsed.arriving)
    }

    /// What can be told before anything is opened.
    pub fn check(&self) -> Result<(), Failure> {
        self.pace(self.rate)?;
        self.network()?;
        self.driven.check()
    }

    pub fn is_phantom(&self) -> bool {
        self.source == "phantom"
    }

    /// As it was typed.
    pub fn shown(&self) -> &str {
        match self.source.as_str() {
            "-" => "standard input",
            source => source,
        }
    }

    /// Where the source is a file, that.
    pub fn path(&self) -> &Path {
        Path::new(&self.source)
    }

    pub fn open(&self) -> Result<Box<dyn Live>, Failure> {
        let network = self.source.strip_prefix(NETWORK);
        let is_file = !self.is_phantom() && self.source != "-" && network.is_none();
        let fan = self.is_phantom().then_some(phantom::FAN_ANGLE_DEG);
        let driving = self.driven.checked(self.probe.as_deref(), is_file.then(|| self.path()), fan)?;
        if self.is_phantom() {
            return self.phantom(driving.as_ref());
        }
        let source: Box<dyn Live> = if self.source == "-" {
            Box::new(Piped::new(std::io::stdin(), self.probe.as_deref()).map_err(input)?)
        } else if let Some(address) = network {
            if address.is_empty() {
                return Err(input(format!("--source {}: must read igtl://HOST or igtl://HOST:PORT", self.source)));
            }
            if driving.is_some() {
                return Err(input(format!(
                    "--source {}: brings its own places; --motor is for frames without",
                    self.source
                )));
            }
            let network = Network::connect(address, self.network()?);
            Box::new(network.map_err(|e| failed(format!("{}: {e}", self.source)))?)
        } else {
            let recording = crate::source::open(self.path(), self.probe.as_deref()).map_err(input)?;
            // A free-running probe is as fast as sound lets it.
            let rate = self.rate.or(driving.as_ref().and_then(|_| fastest(&*recording)));
            Box::new(Paced::new(recording, self.pace(rate)?, self.rounds))
        };
        match driving {
            Some(driving) => {
                let motor = driving.start()?;
                Ok(driving.place(source, motor, is_file))
            }
            None => Ok(source),
        }
    }

    fn pace(&self, rate: Option<f64>) -> Result<Playback, Failure> {
        match rate {
            _ if self.real_time => Ok(Playback::Recorded),
            Some(rate) if !(rate > 0.0 && rate <= 1e6) => {
                Err(input(format!("--rate {rate}: must be above 0, at most 1e6 volumes a second")))
            }
            Some(rate) => Ok(Playback::Volumes(rate)),
            None => Ok(Playback::Fast),
        }
    }

    /// Volumes of the phantom in turns, or where a motor is driven what its array sees.
    fn phantom(&self, driving: Option<&Driving>) -> Result<Box<dyn Live>, Failure> {
        let options = phantom::Options { volumes: PHANTOM_VOLUMES, both_ways: true, ..phantom::Options::default() };
        let Some(driving) = driving else {
            let pace = self.pace(self.rate.or(Some(PHANTOM_RATE)))?;
            let phantom = Phantom::new(options).map_err(input)?;
            return Ok(Box::new(Paced::new(Box::new(Kept::new(phantom)), pace, u32::MAX)));
        };
        if self.rate.is_some() || self.real_time {
            return Err(input("--rate and --real-time: sound and the motor are the phantom's pace with --motor"));
        }
        let phantom = FreeRunning::phantom(options, driving.speed).map_err(input)?;
        let motor = driving.start()?;
        let source = FreeRunning::new(phantom, motor.watch().clone());
        Ok(driving.place(Box::new(source), motor, false))
    }

    fn network(&self) -> Result<NetworkOptions, Failure> {
        let mut options = NetworkOptions::default();
        match (&mut options.poses, self.tool.as_deref()) {
            (poses, Some("image")) => *poses = Poses::Image,
            (Poses::Messages { device, .. }, tool) => *device = tool.map(str::to_string),
            (Poses::Image, _) => {}
        }
        let positive = |flag: &str, mm: f64, least: f64| match mm >= least && mm <= 1000.0 {
            true => Ok(mm),
            false => Err(input(format!("{flag} {mm}: must lie in {least}..=1000 mm"))),
        };
        let spacing = self.spacing.map(|mm| positive("--spacing", mm, 0.01)).transpose()?;
        let widest_hole = positive("--hole", self.hole, 0.0)?;
        options.freehand = freehand::Options { spacing, widest_hole, clip: self.clip()?, ..options.freehand };
        Ok(options)
    }

    fn clip(&self) -> Result<Option<[usize; 4]>, Failure> {
        let Some(text) = &self.clip else { return Ok(None) };
        let numbers: Option<Vec<usize>> = text.split(',').map(|n| n.parse().ok()).collect();
        match numbers.and_then(|n| <[usize; 4]>::try_from(n).ok()) {
            Some(clip) => Ok(Some(clip)),
            None => Err(input(format!("--clip {text}: must read X,Y,W,H in pixels, as 100,40,520,440"))),
        }
    }
}

/// Volumes a second of a sweep as fast as sound lets it; none of what is not swept.
fn fastest(source: &dyn Source) -> Option<f64> {
    match source.geometry(0) {
        Geometry::Sweep(probe) => Some(1.0 / probe.acquisition_time()),
        Geometry::Cartesian(_) => None,
    }
}
