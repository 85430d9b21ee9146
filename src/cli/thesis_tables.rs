//! `echolume report tables`: measures the tables of the thesis.

use crate::args::{Output, check_outputs, open_device, write_if_asked, write_report};
use crate::gpu::DeviceChoice;
use crate::picture::Grey;
use crate::terminal::{Failure, failed, input, say, with_progress};
use crate::thesis_tables::export;
use crate::thesis_tables::growth::growth;
use crate::thesis_tables::row_times::{TableOptions, run};
use std::path::PathBuf;

/// Warm-up volumes of each row: the driver compiles shaders and the clocks rise.
const WARM_UP: usize = 1;

#[derive(clap::Args)]
#[command(
    after_help = "Thesis Tables 3-6: time of a picture in surface mode over frames a volume, volume size, 3D filter and 2D \
                        filter, each row under the conditions that the thesis states (4.5). docs/experiments/thesis-tables.md says how they are read. Pictures add Tables 7-9: how far the windows of the \
                        enhanced sigma filter grow on them.\n\nExamples:\n  \
                        echolume report tables --markdown tables.md --csv tables.csv\n  \
                        echolume report tables scan.png --quick --repeat 3"
)]
pub struct ThesisTables {
    /// Pictures for Tables 7-9: PNG, JPEG, PNM or BMP
    pictures: Vec<PathBuf>,
    /// Number of volumes measured in each row
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Write the tables to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write Tables 3-6 also to this file, and Tables 7-9 to NAME.growth.csv next to it
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Quick trial: volumes of a quarter of the edge length, frames of 64 lines
    #[arg(long)]
    quick: bool,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<DeviceChoice>,
}

impl ThesisTables {
    pub fn run(&self) -> Result<(), Failure> {
        let growth_file =
            self.csv.as_ref().filter(|_| !self.pictures.is_empty()).map(|f| f.with_extension("growth.csv"));
        let targets: [Output; 3] = [
            ("--markdown", self.markdown.as_deref()),
            ("--csv", self.csv.as_deref()),
            ("--csv", growth_file.as_deref()),
        ];
        check_outputs(&targets, self.pictures.iter().map(PathBuf::as_path))?;
        let greys: Vec<Grey> =
            self.pictures.iter().map(|file| Grey::load(file).map_err(input)).collect::<Result<_, _>>()?;
        let context = open_device(self.device.clone(), false)?;

        let options = TableOptions { quick: self.quick, repeats: self.repeat as usize, warm_up: WARM_UP };
        let volumes = options.volumes() as u64;
        let report = with_progress(volumes, "volumes", |step| run(&context, &options, &mut || step()));
        let mut report = report.map_err(failed)?;
        for (file, grey) in self.pictures.iter().zip(&greys) {
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
            let fault = |e| failed(format!("{}: {e}", file.display()));
            report.grown.push(growth(&context, &name, grey).map_err(fault)?);
        }

        let written = export::markdown(&report);
        match &self.markdown {
            None => say!("{}", written.trim_end()),
            Some(file) => write_report(file, &written)?,
        }
        write_if_asked(self.csv.as_deref(), || Ok(export::tables_csv(&report)))?;
        write_if_asked(growth_file.as_deref(), || Ok(export::growth_csv(&report.grown)))
    }
}
