//! `echolume info FILE`.

use crate::source;
use crate::terminal::{Failure, input, say};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Info {
    /// MetaImage (.mha, .mhd), Kretz (.vol) or .frames file
    file: PathBuf,
    /// Geometry of the probe (TOML) [default: NAME.probe.toml or probe.toml next to the file]
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
}

impl Info {
    pub fn run(&self) -> Result<(), Failure> {
        let facts = source::description(&self.file, self.probe.as_deref()).map_err(input)?;
        let width = facts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        for (name, value) in facts {
            say!("{name:width$}  {value}");
        }
        Ok(())
    }
}
