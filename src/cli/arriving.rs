//! Where frames come from on their own clock: the arguments of every command that renders live.

use super::{Failure, failed, input};
use echolume::source::freehand;
use echolume::source::igtl::{Network, NetworkOptions, Poses};
use echolume::source::live::{Live, Pace, Paced};
use echolume::source::phantom::{self, Phantom};
use echolume::source::piped::Piped;
use echolume::source::played::Kept;
use std::path::{Path, PathBuf};

/// Volumes of the phantom that are computed beforehand and played in turns: forth and back twice.
const PHANTOM_VOLUMES: usize = 4;
/// Volumes a second of the phantom, where nothing else is said.
const PHANTOM_RATE: f64 = 1.0;
const NETWORK: &str = "igtl://";

#[derive(clap::Args)]
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
}

impl Arriving {
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
        let pace = match (self.rate, self.real_time) {
            (Some(rate), _) if !(rate > 0.0 && rate <= 1e6) => {
                return Err(input(format!("--rate {rate}: must be above 0, at most 1e6 volumes a second")));
            }
            (Some(rate), _) => Pace::Volumes(rate),
            (None, true) => Pace::Recorded,
            (None, false) if self.is_phantom() => Pace::Volumes(PHANTOM_RATE),
            (None, false) => Pace::Fast,
        };
        if self.is_phantom() {
            let options = phantom::Options { volumes: PHANTOM_VOLUMES, both_ways: true, ..phantom::Options::default() };
            let phantom = Phantom::new(options).map_err(input)?;
            return Ok(Box::new(Paced::new(Box::new(Kept::new(phantom)), pace, u32::MAX)));
        }
        if self.source == "-" {
            return Ok(Box::new(Piped::new(std::io::stdin(), self.probe.as_deref()).map_err(input)?));
        }
        if let Some(address) = self.source.strip_prefix(NETWORK) {
            if address.is_empty() {
                return Err(input(format!("--source {}: must read igtl://HOST or igtl://HOST:PORT", self.source)));
            }
            let network = Network::connect(address, self.network()?);
            return Ok(Box::new(network.map_err(|e| failed(format!("{}: {e}", self.source)))?));
        }
        let recording = echolume::source::open(self.path(), self.probe.as_deref()).map_err(input)?;
        Ok(Box::new(Paced::new(recording, pace, self.rounds)))
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
