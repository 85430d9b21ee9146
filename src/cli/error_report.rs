//! `echolume report error`: error against run time.

use crate::args::{InputArgs, Opened, check_number, make_folder, parse_nanoseconds};
use crate::baselines::Stored;
use crate::error_report::choose::Bound;
use crate::error_report::plot::Figure;
use crate::error_report::{self, Measure, choose, dials, errors_and_times, export, plot};
use crate::picture::replace;
use crate::scene::Scene;
use crate::terminal::{Failure, failed, input, progress_bar, say};
use std::path::{Path, PathBuf};

/// Runs of a choice before it is printed: the 95th percentile is the second longest.
const VERIFYING_RUNS: u32 = 20;

#[derive(clap::Args)]
#[command(
    after_help = "Each dial is varied alone; the other settings stay as in the scene. Errors are those of the picture before the tone mapping of stage 4 (RMSE, 0..1), and after it in levels of 255.\n\n\
                        Examples:\n  \
                        echolume report error --dial step --dial format --size 96x96 -o report\n  \
                        echolume report error sweep.mha --preset fetal --mode vr --under-error 0.01\n  \
                        echolume report error --under-time 16ms"
)]
pub struct ErrorReport {
    #[command(flatten)]
    input: InputArgs,
    // The help comes from the list of dials.
    #[arg(long, value_name = "NAME", default_value = "all", help = format!("{}, or all; may be repeated", dials::NAMES.join(", ")))]
    dial: Vec<String>,
    /// Number of volumes timed at each setting of a dial, in turn with the scene as it is; from 6 on an interval of 95 % is known
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Reference: exact (rays integrated without steps), f64 on the CPU, converged (the finest settings on the device), or auto: exact for
    /// dials of rays, f64 for others, if it takes under a minute
    #[arg(long, value_name = "WHAT", default_value = "auto")]
    against: String,
    /// Write error.json, error.csv, error.svg and error.png into this folder; and looks.svg and looks.png, if dials of another look were measured
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Error measure: rmse, levels (95th percentile of the pixels after tone, of 255), mm (distance maps) or degrees (normals)
    #[arg(long, value_name = "NAME", default_value = "rmse")]
    measure: String,
    /// Choose the fastest settings with an error below this; they are measured again before they are printed
    #[arg(long, value_name = "ERROR")]
    under_error: Option<f64>,
    /// Choose the most accurate settings that take less time for a volume and its picture, such as 16ms
    #[arg(long, value_name = "TIME")]
    under_time: Option<String>,
    /// Use the measurements of an earlier report (error.json)
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
}

impl ErrorReport {
    pub fn run(&self) -> Result<(), Failure> {
        let measure = match self.measure.as_str() {
            "rmse" => Measure::Rmse,
            "levels" => Measure::Levels,
            "mm" => Measure::Mm,
            "degrees" => Measure::Degrees,
            other => return Err(input(format!("--measure {other}: must be rmse, levels, mm or degrees"))),
        };
        let time = self.under_time.as_deref().map(|time| parse_nanoseconds("--under-time", time)).transpose()?;
        check_number("--under-error", self.under_error, |e| e > 0.0 && e.is_finite(), "must be a number above 0")?;
        let bounds: Vec<Bound> = self.under_error.map(Bound::Error).into_iter().chain(time.map(Bound::Time)).collect();
        match &self.from {
            Some(file) => {
                let report = error_report::Report::load(file).map_err(input)?;
                self.print(&report, measure)?;
                for bound in bounds {
                    let choice = choose::choose(&report, measure, bound, &[]).map_err(failed)?;
                    let described = report.choices[choice].describe(measure);
                    say!("{described}; measured on {}, {}, and not again", report.device, report.date);
                }
                Ok(())
            }
            None => self.measure(measure, &bounds),
        }
    }

    fn print(&self, report: &error_report::Report, measure: Measure) -> Result<(), Failure> {
        say!("{}", export::summary_table(report, measure).trim_end());
        self.output.as_ref().map_or(Ok(()), |folder| write(report, measure, folder))
    }

    fn measure(&self, by: Measure, bounds: &[Bound]) -> Result<(), Failure> {
        let reference = match self.against.as_str() {
            "auto" => errors_and_times::ReferenceChoice::Auto,
            "exact" => errors_and_times::ReferenceChoice::Exact,
            "f64" => errors_and_times::ReferenceChoice::F64,
            "converged" => errors_and_times::ReferenceChoice::Converged,
            other => return Err(input(format!("--against {other}: must be exact, f64, converged or auto"))),
        };
        let Opened { mut source, recorded, layers, scene } = self.input.open_recorded(&[], None)?;
        let scene = self.input.resolve_format(scene);
        self.output.as_deref().map_or(Ok(()), make_folder)?;
        let dials = self.dials(&scene)?;
        let context = self.input.open_device(false)?;
        let frames = self.input.frames(&mut *source)?;
        let (repeats, frames, shown) = (self.repeat, &frames[..], self.input.name());
        let measurement = errors_and_times::ErrorMeasurement {
            context: &context,
            recorded: &recorded,
            layers: &layers,
            scene: &scene,
            frames,
            input: &shown,
            repeats,
            reference,
        };
        let settings: usize = dials.iter().map(|d| d.settings.len() + 1).sum();
        let bar = progress_bar((settings + 1 + errors_and_times::MAX_COMBINATIONS) as u64);
        bar.set_style(indicatif::ProgressStyle::default_bar().template("{bar:30} {pos}/{len} {msg}").map_err(failed)?);
        bar.set_message("the scene's finest picture");
        let finest = measurement.finest().map_err(failed)?;
        let report = measurement.report(&dials, &finest, bounds.first().copied(), |dial, setting| {
            bar.set_message(format!("{dial}: {setting}"));
            bar.inc(1);
        });
        bar.finish_and_clear();
        let report = report.map_err(failed)?;
        self.print(&report, by)?;
        for bound in bounds {
            self.choose(&measurement, &finest, &report, by, *bound)?;
        }
        Ok(())
    }

    /// Chooses settings, renders and times them anew, and prints what held then.
    fn choose(
        &self,
        measurement: &errors_and_times::ErrorMeasurement,
        finest: &errors_and_times::Finest,
        report: &error_report::Report,
        by: Measure,
        bound: Bound,
    ) -> Result<(), Failure> {
        let wanted = match bound {
            Bound::Error(error) => by.format(error),
            Bound::Time(time) => format!("{:.3} ms", time * 1e-6),
        };
        let verified = measurement.choose(finest, report, by, bound, VERIFYING_RUNS).map_err(failed)?;
        for not_kept in verified.failed {
            say!("measured again it does not hold {wanted}: {}", not_kept.describe(by));
        }
        let ([w, h], what) = (report.sizes.picture, verified.choice.describe(by));
        say!("holds {wanted}: {what}; {VERIFYING_RUNS} runs of this scene at {w} x {h} on {}", report.device);
        if let Some((spread, mm)) = verified.choice.errors.mm.and_then(|mm| Some((mm.error?, mm))) {
            say!(
                "  surface: median {:.1} um, 95th percentile {:.1} um; {:.2} % of the pixels lost, {:.2} % gained, {:.2} % on another surface",
                1e3 * spread.median,
                1e3 * spread.p95,
                100.0 * mm.missed_hits,
                100.0 * mm.false_hits,
                100.0 * mm.jumps
            );
        }
        Ok(())
    }

    /// The requested dials. For `all`, those that apply to the scene.
    fn dials(&self, scene: &Scene) -> Result<Vec<dials::Dial>, Failure> {
        if self.dial.iter().any(|d| d == "all") {
            let mut dials = Vec::new();
            for name in dials::NAMES {
                match dials::dial(name, scene) {
                    Ok(dial) => dials.push(dial),
                    Err(why) => say!("dial {name} left out: this scene {why}"),
                }
            }
            return Ok(dials);
        }
        let of = |name: &String| {
            let subject = if dials::NAMES.contains(&name.as_str()) { "this scene " } else { "" };
            dials::dial(name, scene).map_err(|why| input(format!("--dial {name}: {subject}{why}")))
        };
        self.dial.iter().map(of).collect()
    }
}

fn write(report: &error_report::Report, measure: Measure, folder: &Path) -> Result<(), Failure> {
    make_folder(folder)?;
    replace(&folder.join("error.json"), report.to_json().map_err(failed)?.trim_end().as_bytes()).map_err(failed)?;
    replace(&folder.join("error.csv"), export::csv(report).as_bytes()).map_err(failed)?;
    let mut written = vec!["error.json".to_string(), "error.csv".into()];
    for (figure, name) in [(Figure::Errors, "error"), (Figure::Looks, "looks")] {
        if !figure.is_in(report) {
            continue;
        }
        let size = plot::size(report, figure);
        let drawn = plot::svg(report, figure, measure, size).map_err(failed)?;
        replace(&folder.join(format!("{name}.svg")), drawn.as_bytes()).map_err(failed)?;
        let picture = plot::picture(report, figure, measure, size).map_err(failed)?;
        picture.save(&folder.join(format!("{name}.png"))).map_err(failed)?;
        written.extend([format!("{name}.svg"), format!("{name}.png")]);
    }
    say!("written: {} in {}", written.join(", "), folder.display());
    Ok(())
}
