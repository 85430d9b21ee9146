//! `echolume report`: the commands below it.

use super::bounds::BoundsReport;
use super::error_report::ErrorReport;
use super::filter_report::FilterReport;
use super::thesis_tables::ThesisTables;
use crate::terminal::Failure;
use clap::Subcommand;

#[derive(clap::Args)]
pub struct Report {
    #[command(subcommand)]
    kind: ReportKind,
}

#[derive(Subcommand)]
enum ReportKind {
    /// Measure error against run time: renders and times every setting of each dial and compares it with the reference
    Error(Box<ErrorReport>),
    /// Enclose every ray of volume rendering by proven bounds, on the CPU
    Bounds(Box<BoundsReport>),
    /// Compare the 2D filters of slices: noise, contrast, edges, error and time
    Filters(FilterReport),
    /// Measure the thesis' tables of times, and print them with its figures
    Tables(ThesisTables),
}

impl Report {
    pub fn run(&self) -> Result<(), Failure> {
        match &self.kind {
            ReportKind::Error(error) => error.run(),
            ReportKind::Bounds(bounds) => bounds.run(),
            ReportKind::Filters(filters) => filters.run(),
            ReportKind::Tables(tables) => tables.run(),
        }
    }
}
