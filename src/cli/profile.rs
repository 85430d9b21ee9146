//! `echolume profile`: measures the GPU time of every pass.

use super::against::{self, Other};
use super::pipelines::Request;
use crate::args::{InputArgs, Output, ShaderArgs, check_number, check_outputs, write_if_asked};
use crate::baselines::{Stored, Threshold};
use crate::files::replace_shared;
use crate::profile as model;
use crate::profile::timed_run;
use crate::profile::{compare, export};
use crate::terminal::{Failure, failed, input, say};
use crate::tree;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "A repeat is a whole volume: every frame through stage 1, then the picture.\n\nExamples:\n  \
                        echolume profile sweep.mha --preset fetal --json before.json\n  \
                        echolume profile --mode vr --trace trace.json    (open it in Perfetto or chrome://tracing)\n  \
                        echolume profile volume.mha --mode mip --still --turn 2    (the picture alone, each from another angle)\n  \
                        echolume profile --compare before.json after.json    (exit code 1 if a pass became slower, 5 if the noise may hide it)\n  \
                        echolume profile sweep.mha --against target/release/echolume    (or a folder of shaders, or a device: exit code 1 if it is slower)\n  \
                        echolume profile --pipelines --all --json gpu.json    (what the driver makes of every shader)\n  \
                        echolume profile --pipelines --all --compare gpu.json    (exit code 1 on a spill or a loss of occupancy)\n  \
                        echolume profile --pipelines --glsl glsl    (what an edited shader costs in registers, without a build)")]
pub struct Profile {
    #[command(flatten)]
    input: InputArgs,
    /// Number of volumes to measure
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10000))]
    repeat: u32,
    /// Number of warm-up volumes: the driver compiles shaders and the clocks rise
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    warm_up: u32,
    /// Upload the frames once and measure only the picture
    #[arg(long)]
    still: bool,
    /// Rotate the view by this angle before each volume: the azimuth of the camera, or of the planes
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    turn: f64,
    /// Do not measure the device's ceilings (copies, samples, fetches)
    #[arg(long)]
    no_ceilings: bool,
    /// Write all measurements (JSON), for --compare. With --compare or --against: the comparison
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write one line per pass (CSV)
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write one line per pass and repeat (CSV)
    #[arg(long, value_name = "FILE")]
    csv_samples: Option<PathBuf>,
    /// Write a trace for Perfetto or Chrome
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Compare two profiles pass by pass, without measuring; exit code 1 on a regression, 5 if the noise may hide one. On software
    /// devices CPU time is compared. With --pipelines, OLD alone is compared with what is measured
    #[arg(long, num_args = 1..=2, value_names = ["OLD", "NEW"])]
    compare: Vec<PathBuf>,
    /// Measure this in turn with what the other options say, and compare as --compare does: another echolume program, a folder of shaders
    /// (as --glsl), or a device (as --device). Exit code 1 if what is named here is slower. Each of some 12 blocks of volumes is a pair of
    /// processes with its own --warm-up
    #[arg(long, value_name = "PROGRAM|DIR|DEVICE", conflicts_with_all = ["compare", "csv", "csv_samples", "trace"])]
    against: Option<Other>,
    /// In a process of --against: a volume for each line of standard input, and a line of answer
    #[arg(long, hide = true)]
    in_turn: bool,
    #[command(flatten)]
    shaders: ShaderArgs,
    /// Compile the pipelines of the scene, and print what the driver makes of them: registers, occupancy, spills, instructions, time to
    /// compile without a cache and with one. Runs nothing on the device
    #[arg(long, conflicts_with_all = ["repeat", "warm_up", "still", "turn", "no_ceilings", "csv", "csv_samples", "trace", "against"])]
    pipelines: bool,
    /// With --pipelines: of every mode, preset and filter instead of the scene alone
    #[arg(long, requires = "pipelines")]
    all: bool,
    /// Ratio that a pass must exceed to be a regression
    #[arg(long, value_name = "RATIO", default_value_t = 1.05)]
    threshold: f64,
    /// Share of the time of all passes, 0..1, below which a pass may hide a slowdown in the noise: exit code 0, with a note, and not 5
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    minor: f64,
    /// Compare also profiles of different scenes or sizes
    #[arg(long)]
    force: bool,
}

impl Profile {
    pub fn run(&self) -> Result<(), Failure> {
        if self.pipelines {
            let (json, compare) = (self.json.as_deref(), self.compare.as_slice());
            let shaders = &self.shaders;
            return Request { input: &self.input, all: self.all, json, compare, force: self.force, shaders }.run();
        }
        match self.compare.as_slice() {
            [old, new] => self.compare(old, new),
            [_] => Err(input("--compare: needs two profiles, OLD and NEW; with --pipelines one")),
            _ => match &self.against {
                Some(other) => self.measure_against(other),
                None => self.measure(),
            },
        }
    }

    fn measure(&self) -> Result<(), Failure> {
        if self.in_turn {
            against::keep_to_one_core();
        }
        let (mut source, mut scene) = self.input.open()?;
        scene.settings.slices.still |= self.still;
        let targets: [Output; 4] = [
            ("--json", self.json.as_deref()),
            ("--csv", self.csv.as_deref()),
            ("--csv-samples", self.csv_samples.as_deref()),
            ("--trace", self.trace.as_deref()),
        ];
        self.input.check_outputs(&targets, &*source)?;
        check_number("--turn", self.turn, f64::is_finite, "must be a finite angle in degrees")?;
        let shaders = self.shaders.open()?;
        let context = self.input.open_device(false)?;
        // All repeats use the same volume.
        let frames = self.input.frames(&mut *source)?;
        let options = timed_run::ProfileOptions {
            repeats: self.repeat as usize,
            warm_up: self.warm_up as usize,
            still: self.still,
            angle_step: self.turn,
            input: self.input.name(),
            ceilings: !self.no_ceilings,
        };
        let failure = |fault| self.shaders.failure(fault);
        let mut run = timed_run::ProfileRun::new(&context, &scene, &options, &shaders).map_err(failure)?;
        while run.needs_more() {
            if self.in_turn {
                against::await_turn()?;
            }
            run.repeat(&frames).map_err(failure)?;
            if self.in_turn {
                against::end_turn();
            }
        }
        let (profile, spans) = run.finish();
        say!("{}", export::profile_table(&profile).trim_end());
        write_if_asked(self.json.as_deref(), || profile.to_json())?;
        write_if_asked(self.csv.as_deref(), || Ok(export::csv(&profile)))?;
        write_if_asked(self.csv_samples.as_deref(), || Ok(export::csv_samples(&profile)))?;
        write_if_asked(self.trace.as_deref(), || export::chrome_trace(&profile, &spans).map_err(|e| e.to_string()))
    }

    /// Measures in turn with another run, and compares them.
    fn measure_against(&self, other: &Other) -> Result<(), Failure> {
        if self.input.is_standard() {
            return Err(input("--against: standard input can be read once only; name a file"));
        }
        check_outputs(&[("--json", self.json.as_deref())], [])?;
        self.judge(&against::compared(other, self.repeat, self.warm_up, &self.criteria()?)?)
    }

    fn compare(&self, old: &Path, new: &Path) -> Result<(), Failure> {
        check_outputs(&[("--json", self.json.as_deref())], [old, new])?;
        let [old, new] = [old, new].map(|file| model::Profile::load(file).map_err(input));
        self.judge(&compare::compare(&old?, &new?, &self.criteria()?).map_err(input)?)
    }

    fn criteria(&self) -> Result<compare::CompareOptions, Failure> {
        Ok(compare::CompareOptions {
            threshold: Threshold::new(self.threshold).map_err(|e| input(format!("--{e}")))?,
            minor: self.minor,
            force: self.force,
            ..compare::CompareOptions::default()
        })
    }

    /// Prints the differences. Fails on a regression, and where one may have been overlooked.
    fn judge(&self, compared: &compare::Comparison) -> Result<(), Failure> {
        say!("{}", export::comparison_table(compared).trim_end());
        if let Some(file) = &self.json {
            let text = tree::to_json_lines(compared).map_err(failed)?;
            replace_shared(file, text.as_bytes()).map_err(failed)?;
        }
        let slower: Vec<&str> = compared.regressions().map(|l| l.name.as_str()).collect();
        match compared.cannot_tell() {
            _ if !slower.is_empty() => Err(failed(format!("slower by more than the threshold: {}", slower.join(", ")))),
            Some(why) => Err(Failure::CannotTell(why)),
            None => Ok(()),
        }
    }
}
