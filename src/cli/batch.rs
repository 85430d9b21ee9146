//! `echolume batch`: renders, converts, measures or verifies many recordings.

use crate::args::{check_number, write_report};
use crate::batch::make::{self, Found};
use crate::batch::painter::DeviceOptions;
use crate::batch::report::{self, Merged};
use crate::batch::results::{Asked, Earlier};
use crate::batch::shard::{Shard, assign};
use crate::batch::work::Job;
use crate::batch::{manifest, results, unit};
use crate::files::replace;
use crate::files::signals::{self, Held};
use crate::gpu::{Deadline, DeviceChoice};
use crate::terminal::{Failure, failed, input, remark, say};
use crate::tree;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

/// How often a signal is looked for.
const OFTEN: Duration = Duration::from_millis(50);
/// Time after the grace time that a unit has to be dropped, before the process ends with it.
const DROP: Duration = Duration::from_secs(2);

/// When the first signal arrived, and how long the running unit may take from then on, ms.
static SIGNALLED: OnceLock<Instant> = OnceLock::new();
static GRACE: AtomicU64 = AtomicU64::new(0);

#[derive(clap::Args)]
#[command(
    after_help = "A unit is a line of the manifest: {\"input\": FILE, \"command\": [\"render\", \"--preset\", \"bone\"]}, or a \"scene\" with the settings of a \
                  scene file instead of a command; also convert, measure and verify. Its outputs are named by a hash of the recording, the command and \
                  the version, in DIR/units. Units that are done are skipped, so that the same command continues an interrupted batch. docs/batch.md has the \
                  details.\n\n\
                  Exit codes: 0 all units of the shard are done, 1 try again (a signal, or nothing could be written), 2 the manifest or the command line \
                  is wrong, 3 no device or a lost one (try again elsewhere), 4 some units failed and the others are done.\n\n\
                  Examples:\n  \
                  echolume batch --make 'archive/**/*.mha' -o units.ndjson -- render --preset fetal --size 512x512\n  \
                  echolume batch units.ndjson -o results --shard 0/8\n  \
                  sbatch --array=0-63 tools/cluster/batch.sbatch units.ndjson results    (takes the shard from Slurm)\n  \
                  echolume batch --report results"
)]
pub struct Batch {
    /// The manifest: a unit a line, as JSON
    #[arg(required_unless_present_any = ["make", "report"], conflicts_with_all = ["make", "report"])]
    manifest: Option<PathBuf>,
    /// Folder for outputs, records and results, made when needed; with --make the manifest to write; with --report the page [default:
    /// DIR/report.html]
    #[arg(short, long, value_name = "DIR|FILE", required_unless_present = "report")]
    output: Option<PathBuf>,
    /// The shard to do, I from 0 [default: by SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT, or JOB_COMPLETION_INDEX and --shards;
    /// otherwise the whole manifest]
    #[arg(long, value_name = "I/N", conflicts_with = "shards")]
    shard: Option<Shard>,
    /// Number of shards, where the system says which one this is but not of how many
    #[arg(long, value_name = "N")]
    shards: Option<u32>,
    /// Write a manifest of these recordings (files, folders, patterns): sizes, digests, expected cost. What cannot be read is named and
    /// left out. The command of all units follows --
    #[arg(long, value_name = "GLOB", num_args = 1.., conflicts_with_all = ["report", "shard", "shards"])]
    make: Vec<String>,
    /// With --make: what is done with each recording: render, convert, measure or verify, and their flags
    #[arg(last = true, value_name = "COMMAND", requires = "make")]
    command: Vec<String>,
    /// Merge the results of all shards of this folder into one HTML page
    #[arg(long, value_name = "DIR", conflicts_with_all = ["shard", "shards"])]
    report: Option<PathBuf>,
    /// Continue an earlier batch: say first how many units of the shard were done before, and refuse a folder without results of this manifest,
    /// such as a mistyped one. Without this flag finished units are skipped as well, and a folder without results is where a new batch begins
    #[arg(long, conflicts_with_all = ["make", "report"])]
    resume: bool,
    /// Read the outputs of finished units and compare them with the digests of their records. One that differs is one line, and its unit is done
    /// again. Without this flag an output of the right length counts as whole
    #[arg(long, conflicts_with_all = ["make", "report"])]
    verify: bool,
    /// Draw this share of the finished pictures again and compare: bit for bit on the same device and driver, within the tolerance of
    /// verify on others
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    recheck: f64,
    /// Time that the running unit has to finish after SIGTERM, SIGINT or SIGHUP; then it is dropped
    #[arg(long, value_name = "TIME", default_value = "20s")]
    grace: String,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<DeviceChoice>,
}

impl Batch {
    pub fn run(&self) -> Result<(), Failure> {
        if let Some(folder) = &self.report {
            return self.write_page(folder);
        }
        let output = self.output.as_deref().ok_or_else(|| input("-o: is missing"))?;
        match &self.manifest {
            Some(manifest) => self.work(manifest, output),
            None => self.make(output),
        }
    }

    fn make(&self, file: &Path) -> Result<(), Failure> {
        let found = make::files(&self.make)?;
        let (mut text, mut units, mut left_out, mut cost) = (String::new(), 0, 0, 0.0);
        let bar = indicatif::ProgressBar::new(found.len() as u64).with_message("recordings");
        for recording in &found {
            match make::unit(recording, &self.command)? {
                Found::Unit(unit) => {
                    cost += unit.cost.unwrap_or(1.0);
                    text += &tree::to_json(&unit).map_err(failed)?;
                    text.push('\n');
                    units += 1;
                }
                Found::LeftOut(why) => {
                    left_out += 1;
                    bar.suspend(|| remark(&format!("left out: {why}")));
                }
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        if units == 0 {
            return Err(input(format!("--make: none of {} files can be read", found.len())));
        }
        write_report(file, &text)?;
        let rest = if left_out > 0 { format!(", {left_out} files left out") } else { String::new() };
        say!("{units} units, expected cost {cost:.1}{rest}");
        Ok(())
    }

    fn work(&self, manifest: &Path, folder: &Path) -> Result<(), Failure> {
        check_number("--recheck", self.recheck, |share| (0.0..=1.0).contains(&share), "must lie in 0..=1")?;
        let grace = humantime::parse_duration(&self.grace)
            .map_err(|_| input(format!("--grace {}: must be a time such as 20s or 2m", self.grace)))?;
        let variable = |name: &str| std::env::var(name).ok();
        let shard = match self.shard {
            Some(shard) => shard,
            None => Shard::from_environment(self.shards, variable).map_err(input)?,
        };
        let costs = manifest::costs(manifest).map_err(input)?;
        let earlier = self.earlier(manifest, folder, shard)?;
        let shards = assign(&costs, shard.count);
        let units = manifest::units(manifest, |place| shards.get(place) == Some(&shard.index)).map_err(input)?;
        say!("shard {shard}: {} of {} units", units.len(), costs.len());
        drop((costs, shards));
        std::fs::create_dir_all(folder).map_err(|e| failed(format!("{}: cannot be made: {e}", folder.display())))?;
        GRACE.store(u64::try_from(grace.as_millis()).unwrap_or(u64::MAX), Ordering::SeqCst);
        let held = Held::first();
        let job = Job {
            units,
            beside: manifest.parent().unwrap_or(Path::new("")),
            folder,
            shard,
            device: DeviceOptions { device: self.device.clone(), deadline: Deadline::ByDevice, stop: is_grace_over },
            recheck: self.recheck,
            verifies: self.verify,
            earlier,
            resumes: self.resume,
            stops: &|| held.signal().is_some(),
        };
        let ended = watching(&held, grace, || job.run())?;
        match (ended.stopped, ended.failed) {
            (true, _) => {
                let signal = held.signal().unwrap_or("a signal");
                Err(failed(format!("{signal} ended the shard; the same command goes on with the units that are left")))
            }
            (false, 0) => Ok(()),
            (false, n) => Err(Failure::SomeFailed(format!("{n} of {} units failed", ended.units))),
        }
    }

    /// What earlier processes left in the folder. With `--resume` a folder without results of this manifest is refused, and nothing is made in
    /// it: it is another one than was meant, where everything would be done again.
    fn earlier(&self, manifest: &Path, folder: &Path, shard: Shard) -> Result<Earlier, Failure> {
        if !self.resume {
            return Earlier::read(folder, shard, None).map_err(failed);
        }
        let mut asked = Asked::default();
        manifest::for_each_unit(manifest, |unit| asked.add(&unit.input, &unit::text(unit))).map_err(input)?;
        let earlier = Earlier::read(folder, shard, Some(&asked)).map_err(failed)?;
        let why = match &earlier {
            Earlier { is_begun: false, .. } => "it holds no results of a batch".to_string(),
            Earlier { has_lines: true, is_of_these: false, .. } => {
                format!("its results are of other units than those of {}", manifest.display())
            }
            _ => return Ok(earlier),
        };
        Err(input(format!("--resume: {}: {why}; to begin a batch there, leave --resume out", folder.display())))
    }

    fn write_page(&self, folder: &Path) -> Result<(), Failure> {
        let (records, torn) = results::read_all(folder).map_err(input)?;
        let file = self.output.clone().unwrap_or_else(|| folder.join("report.html"));
        replace(&file, report::html(&records, torn, folder).as_bytes()).map_err(failed)?;
        say!("written: {}", file.display());
        let merged = Merged::of(&records);
        let failures = merged.failures().count();
        say!("{} units: {} done, {failures} failed", merged.units.len(), merged.done().count());
        Ok(())
    }
}

/// True once the grace time after a signal is over: a unit that still runs on the device is dropped.
fn is_grace_over() -> bool {
    let grace = Duration::from_millis(GRACE.load(Ordering::SeqCst));
    signals::received().is_some() && SIGNALLED.get_or_init(Instant::now).elapsed() >= grace
}

/// Does `work`. Reports a signal at once, and ends the process if the running unit does not end within the grace time. Files are first
/// written under other names, so that none is incomplete.
fn watching<T>(held: &Held, grace: Duration, work: impl FnOnce() -> T) -> T {
    let (working, works) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut is_said = false;
            while works.recv_timeout(OFTEN) == Err(RecvTimeoutError::Timeout) {
                let Some(signal) = held.signal() else { continue };
                let since = SIGNALLED.get_or_init(Instant::now).elapsed();
                if !is_said {
                    is_said = true;
                    remark(&format!("{signal}: the running unit has {} to finish", humantime::format_duration(grace)));
                }
                if since >= grace.saturating_add(DROP) {
                    remark(&format!("{signal}: the running unit is dropped; the same command goes on with it"));
                    std::process::exit(1);
                }
            }
        });
        let done = work();
        drop(working);
        done
    })
}
