//! `echolume report`: its kinds.

use crate::error_report;
use crate::terminal::Failure;
use crate::thesis_tables;
use clap::Subcommand;

#[derive(clap::Args)]
pub struct Report {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// Measure error against run time: renders and times every setting of each dial and compares it with the reference
    Error(Box<error_report::command::ErrorReport>),
    /// Measure the thesis' tables of times under its conditions, and print them with its figures
    Tables(thesis_tables::command::ThesisTables),
}

impl Report {
    pub fn run(&self) -> Result<(), Failure> {
        match &self.kind {
            Kind::Error(error) => error.run(),
            Kind::Tables(tables) => tables.run(),
        }
    }
}
