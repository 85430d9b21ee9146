//! How the volumes of a live source become pictures: the arguments that a stream and a view share.

use super::{Failure, input};
use crate::live::Update;

#[derive(clap::Args)]
pub struct Turns {
    /// whole: volumes are shown when all of their frames have come; rolling: each frame at once
    #[arg(long, value_name = "HOW", default_value = "whole")]
    update: String,
    /// Volume images that take turns where volumes are whole, 2 or 3
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(2..=3))]
    pub images: u32,
    /// Queues of the device that share the work, 1 to 3 [default: all that it has for different work]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    queues: Option<u8>,
}

impl Turns {
    /// How volumes become visible, as it was typed.
    pub fn update(&self) -> Result<Update, Failure> {
        match self.update.as_str() {
            "whole" => Ok(Update::Whole),
            "rolling" => Ok(Update::Rolling),
            other => Err(input(format!("--update {other}: must be whole or rolling"))),
        }
    }

    pub fn queues(&self) -> Option<usize> {
        self.queues.map(usize::from)
    }
}
