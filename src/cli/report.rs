//! `echolume report`: its kinds.

use super::{Failure, report_error, report_tables};
use clap::Subcommand;

#[derive(clap::Args)]
pub struct Report {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// What each saving costs in error: every dial turned, rendered, timed, and held against its best
    Error(Box<report_error::Error>),
    /// The thesis' tables of times under its conditions, beside its figures
    Tables(report_tables::Tables),
}

impl Report {
    pub fn run(&self) -> Result<(), Failure> {
        match &self.kind {
            Kind::Error(error) => error.run(),
            Kind::Tables(tables) => tables.run(),
        }
    }
}
