//! `echolume phantom`.

use crate::picture::check_target;
use crate::source::phantom::{Body, Phantom, PhantomOptions};
use crate::terminal::{Failure, failed, input, say};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct MakePhantom {
    /// The sweep to write (.mha). Its geometry goes to NAME.probe.toml next to it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Seed of the speckle; the same seed gives the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// head, or a body whose picture has a closed formula: sphere, step, wires, constant, ramp
    #[arg(long, value_name = "NAME", default_value = "head")]
    body: String,
    /// Number of volumes in time; the head moves
    #[arg(long, value_name = "N", default_value_t = 1)]
    volumes: usize,
    /// Sweep every second volume backwards; the motor moves while frames are acquired
    #[arg(long)]
    both_ways: bool,
    /// Share of the frame pitch that the motor travels during one frame, 0..1 [default: 0, with --both-ways 0.5]
    #[arg(long, value_name = "SHARE")]
    speed_ratio: Option<f64>,
    /// Write the echogenicity without speckle
    #[arg(long)]
    no_speckle: bool,
}

impl MakePhantom {
    pub fn run(&self) -> Result<(), Failure> {
        let options = PhantomOptions {
            seed: self.seed,
            body: self.body.parse::<Body>().map_err(input)?,
            volumes: self.volumes,
            both_ways: self.both_ways,
            speckle: !self.no_speckle,
            speed_ratio: self.speed_ratio.unwrap_or(if self.both_ways { 0.5 } else { 0.0 }),
            ..PhantomOptions::default()
        };
        let phantom = Phantom::new(options).map_err(input)?;
        check_target(&self.output).map_err(failed)?;
        phantom.write(&self.output).map_err(failed)?;
        say!("sweep: {}", self.output.display());
        Ok(())
    }
}
