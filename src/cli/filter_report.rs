//! `echolume report filters`: compares the 2D filters.

use crate::args::{Output, check_outputs, make_folder, open_device, open_recording, write_if_asked, write_report};
use crate::filter_report::candidate_runs::{MeasureError, MeasureOptions, Middle, count, phantom, recording};
use crate::filter_report::candidates::candidates;
use crate::filter_report::{Area, Areas, Report, contact_sheet, export};
use crate::gpu::DeviceChoice;
use crate::machine;
use crate::source::OpenOptions;
use crate::source::formats::described;
use crate::terminal::{Failure, failed, input, progress_bar, say};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(
    after_help = "Measures every 2D filter of slices, over its windows and strengths, on the middle frame of the phantom, whose mean over all \
                  speckle is known, and of the given recordings: SNR, CNR, Pratt's figure of merit of edges, RMSE, SSIM, time.\n\nExamples:\n  \
                  echolume report filters --markdown filters.md --pictures filters\n  \
                  echolume report filters sweep.mha --crop lateral=-30:30,depth=40:90 --region lateral=-5:5,depth=60:66 \
                  --background lateral=-5:5,depth=42:46"
)]
pub struct FilterReport {
    #[arg(help = format!("Recordings to measure as well: {}", described()))]
    recordings: Vec<PathBuf>,
    /// Part of the frame that is measured, mm, inside of the sector; once for each recording, in their order
    #[arg(long, value_name = "lateral=A:B,depth=C:D", allow_hyphen_values = true)]
    crop: Vec<String>,
    /// Tissue of one kind within it, for SNR and CNR; once for each recording
    #[arg(long, value_name = "lateral=A:B,depth=C:D", allow_hyphen_values = true)]
    region: Vec<String>,
    /// The background of the contrast, within it; once for each recording
    #[arg(long, value_name = "lateral=A:B,depth=C:D", allow_hyphen_values = true)]
    background: Vec<String>,
    /// Measure only the filters with this in their names, such as median
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    filter: String,
    /// Pixels along the longer edge of a slice (sweeps only)
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=4096))]
    pixels: u32,
    /// Number of times measured for each setting
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Write the tables to this file instead of standard output
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write all figures to this file, too
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the filtered frames side by side into this folder: phantom.png, and NAME.png of each recording
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<DeviceChoice>,
}

impl FilterReport {
    pub fn run(&self) -> Result<(), Failure> {
        let areas = self.areas()?;
        if count(&self.filter) < 2 {
            let mut names: Vec<&str> = candidates([1.0; 2], "").iter().map(|c| c.filter).collect();
            names.dedup();
            return Err(input(format!(
                "--filter {}: no filter has this in its name; there are: {}",
                self.filter,
                names.join("; ")
            )));
        }
        let names: Vec<String> =
            std::iter::once("phantom".to_string()).chain(self.recordings.iter().map(|f| stem(f))).collect();
        let sheets_in = |folder: &PathBuf| names.iter().map(|name| folder.join(format!("{name}.png"))).collect();
        let sheets: Vec<PathBuf> = self.pictures.as_ref().map_or_else(Vec::new, sheets_in);
        self.pictures.as_deref().map_or(Ok(()), make_folder)?;
        let mut targets: Vec<Output> = vec![("--markdown", self.markdown.as_deref()), ("--csv", self.csv.as_deref())];
        targets.extend(sheets.iter().map(|file| ("--pictures", Some(file.as_path()))));
        check_outputs(&targets, self.recordings.iter().map(PathBuf::as_path))?;
        let sources = self.recordings.iter().map(|file| open_recording(file, OpenOptions::default()));
        let mut sources = sources.collect::<Result<Vec<_>, _>>()?;
        let context = open_device(self.device.clone(), false)?;
        let options = MeasureOptions { only: &self.filter, pixels: self.pixels, repeats: self.repeat as usize };
        let bar = progress_bar((names.len() * count(&self.filter)) as u64).with_message("settings");
        let at_fault = |file: &Path| {
            let name = file.display().to_string();
            move |e| fault(&name, e)
        };
        // All of them before the first is measured: what cannot be measured is refused at once.
        let mut middles = Vec::new();
        for ((source, file), areas) in sources.iter_mut().zip(&self.recordings).zip(areas) {
            middles.push(Middle::new(&context, &mut **source, areas, self.pixels).map_err(at_fault(file))?);
        }
        let mut subjects = vec![phantom(&context, options, &mut || bar.inc(1)).map_err(|e| fault("phantom", e))?];
        for (middle, file) in middles.into_iter().zip(&self.recordings) {
            let measured = recording(&context, middle, &stem(file), options, &mut || bar.inc(1));
            subjects.push(measured.map_err(at_fault(file))?);
        }
        bar.finish_and_clear();
        let report = Report {
            device: machine::device(&context),
            program: machine::program(),
            date: machine::date(),
            repeats: options.repeats,
            subjects,
        };
        let written = export::markdown(&report);
        match &self.markdown {
            None => say!("{}", written.trim_end()),
            Some(file) => write_report(file, &written)?,
        }
        write_if_asked(self.csv.as_deref(), || Ok(export::csv(&report)))?;
        for (file, subject) in sheets.iter().zip(&report.subjects) {
            contact_sheet::contact_sheet(&report, subject).and_then(|sheet| sheet.save(file)).map_err(failed)?;
            say!("written: {}", file.display());
        }
        Ok(())
    }

    /// The areas of each recording.
    fn areas(&self) -> Result<Vec<Areas>, Failure> {
        let count = self.recordings.len();
        for (flag, given) in [("--crop", &self.crop), ("--region", &self.region), ("--background", &self.background)] {
            if given.len() != count {
                let given = given.len();
                return Err(input(format!(
                    "{flag}: is given {given} times for {count} recordings; give it once for each"
                )));
            }
        }
        let parse = |flag: &str, text: &str| {
            area(text).ok_or_else(|| {
                input(format!(
                    "{flag} {text}: must read lateral=LOW:HIGH,depth=LOW:HIGH in mm, as lateral=-20:20,depth=30:70"
                ))
            })
        };
        let each = self.crop.iter().zip(&self.region).zip(&self.background);
        each.map(|((crop, region), background)| {
            Ok(Areas {
                crop: parse("--crop", crop)?,
                region: parse("--region", region)?,
                background: parse("--background", background)?,
            })
        })
        .collect()
    }
}

fn area(text: &str) -> Option<Area> {
    let mut sides = [None; 2];
    for part in text.split(',') {
        let (key, range) = part.split_once('=')?;
        let (low, high) = range.split_once(':')?;
        let range = [low.trim().parse::<f64>().ok()?, high.trim().parse::<f64>().ok()?];
        let axis = ["lateral", "depth"].iter().position(|name| *name == key.trim())?;
        (range[0] < range[1] && sides[axis].is_none()).then(|| sides[axis] = Some(range))?;
    }
    Some(Area { lateral: sides[0]?, depth: sides[1]? })
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned()
}

fn fault(what: &str, error: MeasureError) -> Failure {
    match error {
        MeasureError::Input(fault) => input(format!("{what}: {fault}")),
        MeasureError::Gpu(fault) => failed(fault),
    }
}
