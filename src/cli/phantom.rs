//! `echolume phantom`.

use super::{Failure, failed, input, say};
use crate::picture::check_target;
use crate::source::phantom::{Body, Options, Phantom};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct MakePhantom {
    /// The sweep to write (.mha); its geometry goes into NAME.probe.toml beside it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Other seeds give other speckle; the same seed gives the same bytes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// head, or a body with an exact answer: sphere, step, wires, constant, ramp
    #[arg(long, value_name = "NAME", default_value = "head")]
    body: String,
    /// Volumes, one after the other in time: the head moves
    #[arg(long, value_name = "N", default_value_t = 1)]
    volumes: usize,
    /// Sweep every second volume backwards, the motor moving while frames are acquired
    #[arg(long)]
    both_ways: bool,
    /// Share of the way to the next frame that the motor travels during one, 0..1 [default: 0, with --both-ways 0.5]
    #[arg(long, value_name = "SHARE")]
    speed_ratio: Option<f64>,
    /// Bare echogenicity
    #[arg(long)]
    no_speckle: bool,
}

impl MakePhantom {
    pub fn run(&self) -> Result<(), Failure> {
        let options = Options {
            seed: self.seed,
            body: self.body.parse::<Body>().map_err(input)?,
            volumes: self.volumes,
            both_ways: self.both_ways,
            speckle: !self.no_speckle,
            speed_ratio: self.speed_ratio.unwrap_or(if self.both_ways { 0.5 } else { 0.0 }),
            ..Options::default()
        };
        let phantom = Phantom::new(options).map_err(input)?;
        check_target(&self.output).map_err(failed)?;
        phantom.write(&self.output).map_err(failed)?;
        say!("sweep: {}", self.output.display());
        Ok(())
    }
}
