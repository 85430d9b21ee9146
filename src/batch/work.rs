//! Runs a shard: every unit that is not done, one after the other. The next recording is read meanwhile.

use super::agreement::{Agreement, Drawer};
use super::manifest::Numbered;
use super::painter::{DeviceOptions, Painter, against_reference};
use super::progress::Progress;
use super::reading::{Contents, Read, Task, read, shown};
use super::results::{Earlier, FORMAT, OutputFile, Record, Results, Seconds, Status, Verified};
use super::shard::Shard;
use super::unit::{Key, Kind, Work};
use crate::digest::{sha256, sha256_of_file};
use crate::files::replace;
use crate::gpu::GpuError;
use crate::machine;
use crate::picture::Picture;
use crate::terminal::{Failure, failed, input, say};
use crate::tree;
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant, SystemTime};

/// A unit is given up after so many processes lost the device by it. Each process tries it several times, in smaller and smaller parts.
const MAX_TRIES: usize = 3;
/// A temporary file that was not written to for so long is deleted as abandoned.
const ABANDONED: Duration = Duration::from_secs(3600);

/// The units of a shard, and how they are to be done.
pub struct Job<'a> {
    /// The units of the shard. Paths of their recordings are relative to the folder `beside`.
    pub units: Vec<Numbered>,
    pub beside: &'a Path,
    /// The batch's folder, for outputs, records and results.
    pub folder: &'a Path,
    pub shard: Shard,
    pub device: DeviceOptions,
    /// True if the digests of finished outputs are compared with their records. A unit with a damaged output is done again.
    pub verifies: bool,
    /// Share of the finished units of kind `Render`, 0..=1, whose pictures are drawn again and compared with the stored ones.
    pub recheck: f64,
    /// Results that earlier runs wrote for this shard ([`Earlier::read`]).
    pub earlier: Earlier,
    /// True if the run begins with a line that states how many units were done before.
    pub resumes: bool,
    /// Called before each unit: once it returns true, no further unit is started.
    pub stops: &'a dyn Fn() -> bool,
}

/// How the run of a shard ended: the number of all units of the shard, done or not, and of those that failed in this run.
#[derive(Debug, Default)]
pub struct Ended {
    pub units: usize,
    pub failed: usize,
    /// True if [`Job::stops`] or [`DeviceOptions::stop`] ended the run before it found that no unit was left.
    pub stopped: bool,
}

/// Why a unit was not done.
enum Fault {
    /// The recording or the command is wrong.
    Bad(String),
    Failed(String),
    /// The device is lost, or there is none.
    Device(String),
    /// The outputs cannot be written, so that those of the next unit would fail, too.
    Output(String),
    /// A signal ended the work.
    Stopped,
}

/// The results of a unit before they are written.
#[derive(Default)]
struct Made {
    bytes: Option<Vec<u8>>,
    /// An output that was written already.
    written: Option<OutputFile>,
    figures: Map<String, Value>,
    agreement: Option<Agreement>,
}

impl Made {
    fn of(bytes: Vec<u8>) -> Made {
        Made { bytes: Some(bytes), ..Made::default() }
    }
}

impl Job<'_> {
    /// Does the units of the shard. A unit that fails is reported in one line, and the others are still done.
    ///
    /// # Errors
    /// A unit's command is wrong ([`Failure::Input`], before any work); there is no device, or it is lost ([`Failure::NoDevice`]); nothing can
    /// be written ([`Failure::Failed`]).
    pub fn run(mut self) -> Result<Ended, Failure> {
        let mut results = Results::open(self.folder, self.shard, std::mem::take(&mut self.earlier)).map_err(failed)?;
        let tasks = self.tasks(&results)?;
        if self.resumes {
            let earlier = results.earlier();
            let done =
                tasks.iter().filter(|task| earlier.says_done(&task.numbered.unit.input, &task.work.text)).count();
            say!("resume: {done} of {} units were done before", tasks.len());
        }
        let cost = |task: &Task| task.numbered.unit.cost.unwrap_or(1.0);
        let mut progress = Progress::new(tasks.len(), tasks.iter().map(cost).sum());
        let mut worker = Worker { job: &self, painter: None };
        let mut ended = Ended { units: tasks.len(), ..Ended::default() };
        let folder = self.folder;
        let recheck = self.recheck;
        let (verifies, verified) = (self.verifies, &Verified::default());
        let outcome = std::thread::scope(|scope| {
            // Without a buffer: one recording waits while another is drawn.
            let (sender, receiver) = sync_channel(0);
            scope.spawn(move || {
                for task in tasks {
                    let again = |key: &Key| task.work.kind == Kind::Render && key.share() < recheck;
                    let read = read(task.clone(), folder, verifies.then_some(verified), again);
                    if sender.send(read).is_err() {
                        return;
                    }
                }
            });
            loop {
                if (self.stops)() {
                    ended.stopped = true;
                    return Ok(());
                }
                let waited = Instant::now();
                let Ok(read) = receiver.recv() else { return Ok(()) };
                let waited = waited.elapsed().as_secs_f64();
                let (task, key, read_in, done) = match read {
                    Read::Finished(task, mut record) => {
                        // Another recording with the same content may have made it.
                        (record.input, record.line) = (task.numbered.unit.input.clone(), task.numbered.line);
                        // The process that did it was ended before it added its line.
                        if !results.has(&record) {
                            results.add(&record).map_err(failed)?;
                        }
                        progress.found(cost(&task));
                        continue;
                    }
                    Read::Failed { task, key, failure, seconds } => {
                        let fault = match failure {
                            Failure::Input(why) => Fault::Bad(why),
                            other => Fault::Failed(other.message()),
                        };
                        (task, key, seconds, Err(fault))
                    }
                    Read::Ready { task, key, .. }
                        if results.losses(&task.numbered.unit.input, &task.work.text) >= MAX_TRIES =>
                    {
                        let why = format!("the device was lost by it {MAX_TRIES} times; it is not tried again");
                        (task, Some(key), 0.0, Err(Fault::Failed(why)))
                    }
                    Read::Ready { task, key, contents, seconds, earlier } => {
                        let done = worker.work(&task, &key, contents, earlier.as_deref());
                        (task, Some(key), seconds, done)
                    }
                };
                let mut record = worker.record(&task, key.as_ref());
                record.seconds = Seconds { read: read_in, wait: waited, ..Seconds::default() };
                let (line, unit) = (task.numbered.line, task.numbered.unit.input.clone());
                let read = format!("{}: ", task.input.display());
                let mut fails = |mut record: Record, status: Status, why: String| {
                    ended.failed += 1;
                    (record.status, record.error) = (status, Some(why.clone()));
                    results.add(&record).map_err(failed)?;
                    progress.failed(
                        cost(&task),
                        &format!("unit {line}: {unit}: {}", why.strip_prefix(&read).unwrap_or(&why)),
                    );
                    Ok::<(), Failure>(())
                };
                match done {
                    Ok((made, work, write)) => {
                        (record.seconds.work, record.seconds.write) = (work, write);
                        let agreement = made.agreement.clone();
                        (record.outputs, record.figures, record.agreement) =
                            (made.written.into_iter().collect(), made.figures, made.agreement);
                        match agreement.and_then(|a| a.fault) {
                            Some(fault) => fails(record, Status::Failed, fault)?,
                            None => {
                                if record.agreement.is_none() {
                                    commit(folder, key.as_ref(), &record).map_err(failed)?;
                                }
                                results.add(&record).map_err(failed)?;
                                progress.done(cost(&task));
                            }
                        }
                    }
                    Err(Fault::Stopped) => {
                        ended.stopped = true;
                        return Ok(());
                    }
                    Err(Fault::Output(why)) => return Err(failed(why)),
                    Err(Fault::Device(why)) => {
                        (record.status, record.error) = (Status::Lost, Some(why.clone()));
                        // A device that cannot be opened is no fault of the unit.
                        if record.drawer.is_some() {
                            results.add(&record).map_err(failed)?;
                        }
                        return Err(Failure::NoDevice(why));
                    }
                    Err(Fault::Bad(why)) => fails(record, Status::Bad, why)?,
                    Err(Fault::Failed(why)) => fails(record, Status::Failed, why)?,
                }
            }
        });
        say!("{}", progress.finish());
        if verifies {
            let [whole, damaged] = [&verified.whole, &verified.damaged].map(|count| count.load(Ordering::Relaxed));
            say!("verified: {whole} outputs are as their records say, {damaged} were not");
        }
        outcome.map(|()| ended)
    }

    /// The units with their work. Units by which a device was lost before come last.
    fn tasks(&self, results: &Results) -> Result<Vec<Task>, Failure> {
        let mut works: HashMap<String, Arc<Work>> = HashMap::new();
        let (mut tasks, mut last) = (Vec::new(), Vec::new());
        for numbered in &self.units {
            let unit = &numbered.unit;
            let same = serde_json::to_string(&(&unit.scene, &unit.command, &unit.outputs)).map_err(input)?;
            let work = match works.get(&same) {
                Some(work) => work.clone(),
                None => {
                    let work = Work::of(unit)
                        .map_err(|e| input(format!("line {} of the manifest: {}", numbered.line, e.message())))?;
                    works.entry(same).or_insert(Arc::new(work)).clone()
                }
            };
            let lost = results.losses(&unit.input, &work.text) > 0;
            let task = Task { numbered: numbered.clone(), input: self.beside.join(&unit.input), work };
            if lost { last.push(task) } else { tasks.push(task) }
        }
        tasks.append(&mut last);
        Ok(tasks)
    }
}

/// Writes the record of a unit, which marks it as done. Its outputs must have been written.
fn commit(folder: &Path, key: Option<&Key>, record: &Record) -> Result<(), String> {
    let Some(key) = key else { return Ok(()) };
    let text = tree::to_json_lines(record).map_err(|e| e.to_string())? + "\n";
    replace(&folder.join(key.record()), text.as_bytes())
}

struct Worker<'a> {
    job: &'a Job<'a>,
    painter: Option<Painter>,
}

impl Worker<'_> {
    fn record(&self, task: &Task, key: Option<&Key>) -> Record {
        let needs_device = task.work.kind.needs_device();
        Record {
            format: FORMAT.into(),
            key: key.map_or(String::new(), |key| key.text().into()),
            line: task.numbered.line,
            input: task.numbered.unit.input.clone(),
            work: task.work.text.clone(),
            status: Status::Done,
            error: None,
            outputs: Vec::new(),
            seconds: Seconds::default(),
            drawer: if needs_device { self.drawer() } else { None },
            program: machine::program(),
            host: host(),
            date: machine::date(),
            figures: Map::new(),
            agreement: None,
        }
    }

    fn drawer(&self) -> Option<Drawer> {
        self.painter.as_ref().map(Painter::drawer)
    }

    /// Does the work and writes its output. Returns the seconds of both.
    fn work(
        &mut self,
        task: &Task,
        key: &Key,
        contents: Contents,
        earlier: Option<&Record>,
    ) -> Result<(Made, f64, f64), Fault> {
        let place = self.job.folder.join(key.folder());
        fs::create_dir_all(&place).map_err(|e| Fault::Output(format!("{}: cannot be made: {e}", place.display())))?;
        remove_abandoned(&place);
        let below = key.output(&task.work.output);
        let file = self.job.folder.join(&below);
        let name = below.to_string_lossy().into_owned();
        let begun = Instant::now();
        let mut made = match contents {
            Contents::Frames { scene, frames, is_whole } => {
                let picture = self.painter()?.draw(&scene, &frames, is_whole).map_err(of_device)?;
                match (task.work.kind, earlier) {
                    (Kind::Verify, _) => verified(&picture, against_reference(&scene, &frames, &picture))?,
                    (_, Some(earlier)) => self.compared(&file, earlier, &picture)?,
                    _ => Made::of(picture.png().map_err(Fault::Failed)?),
                }
            }
            Contents::Volume { volume, target } => {
                // Written slice by slice, aside, and renamed: the largest outputs are not kept in memory.
                volume.write(&target, &file, || ()).map_err(|e| Fault::Output(e.to_string()))?;
                let (sha256, bytes) =
                    sha256_of_file(&file).map_err(|e| Fault::Output(format!("{}: {e}", file.display())))?;
                let figures = Map::from_iter([
                    ("voxels".to_string(), json!(target.grid.size)),
                    ("spacing_mm".to_string(), json!(target.grid.spacing)),
                ]);
                let written = Some(OutputFile { file: name.clone(), bytes, sha256 });
                Made { written, figures, ..Made::default() }
            }
            Contents::Figures(figures) => {
                let text = stated("echolume-figures-1", &figures)?;
                Made { figures, ..Made::of(text) }
            }
        };
        let work = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        if let Some(bytes) = made.bytes.take() {
            replace(&file, &bytes).map_err(Fault::Output)?;
            made.written = Some(OutputFile { file: name, bytes: bytes.len() as u64, sha256: sha256(&bytes) });
        }
        Ok((made, work, begun.elapsed().as_secs_f64()))
    }

    /// Compares a picture with the stored one, which is kept.
    fn compared(&self, file: &Path, earlier: &Record, picture: &Picture) -> Result<Made, Fault> {
        let kept = Picture::load(file).map_err(Fault::Failed)?;
        let agreement = Agreement::of(&kept, earlier.drawer.as_ref(), picture, self.drawer().as_ref());
        let mut made = Made { written: earlier.outputs.first().cloned(), ..Made::default() };
        if !agreement.agrees {
            let place = self.job.folder.join("differences");
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let other = place.join(format!("shard-{}-{name}", self.job.shard.index));
            fs::create_dir_all(&place)
                .map_err(|e| Fault::Output(format!("{}: cannot be made: {e}", place.display())))?;
            picture.save(&other).map_err(Fault::Output)?;
            made.figures.insert("other_picture".into(), shown(&other).into());
        }
        made.agreement = Some(agreement);
        Ok(made)
    }

    /// The device, opened for the first unit that needs it.
    fn painter(&mut self) -> Result<&mut Painter, Fault> {
        match &mut self.painter {
            Some(there) => Ok(there),
            none => {
                let painter = Painter::open(&self.job.device).map_err(|e| Fault::Device(e.to_string()))?;
                let drawer = painter.drawer();
                let note = if drawer.is_software { " (software: no GPU is used)" } else { "" };
                say!("device: {}{note}, {}", drawer.device, drawer.driver);
                Ok(none.insert(painter))
            }
        }
    }
}

/// The result of comparing a picture with the reference: figures, or a fault.
fn verified(picture: &Picture, findings: crate::verify::Findings) -> Result<Made, Fault> {
    if let Some(fault) = findings.faults.first() {
        return Err(Fault::Failed(format!("differs from the f64 reference: {}", fault.what)));
    }
    let figures: Vec<Value> = findings
        .figures
        .iter()
        .map(|figure| json!({"what": figure.what, "value": figure.value, "allowed": figure.allowed}))
        .collect();
    let mut all = Map::new();
    all.insert("picture".into(), json!([picture.width, picture.height]));
    all.insert("against_reference".into(), figures.into());
    let text = stated("echolume-verified-1", &all)?;
    Ok(Made { figures: all, ..Made::of(text) })
}

/// Figures as a JSON file that names its format.
fn stated(format: &str, figures: &Map<String, Value>) -> Result<Vec<u8>, Fault> {
    let mut all = figures.clone();
    all.insert("format".into(), format.into());
    let mut text = serde_json::to_vec_pretty(&all).map_err(|e| Fault::Failed(e.to_string()))?;
    text.push(b'\n');
    Ok(text)
}

fn of_device(error: GpuError) -> Fault {
    match error {
        GpuError::Stopped { .. } => Fault::Stopped,
        lost if lost.is_device_lost() => Fault::Device(lost.to_string()),
        other => Fault::Failed(other.to_string()),
    }
}

/// Deletes unfinished files of killed processes.
fn remove_abandoned(folder: &Path) {
    let is_abandoned = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let age = fs::metadata(path)
            .and_then(|about| about.modified())
            .ok()
            .and_then(|at| SystemTime::now().duration_since(at).ok());
        name.starts_with(".echolume-") && name.ends_with(".part") && age.is_some_and(|age| age > ABANDONED)
    };
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.filter_map(|entry| entry.ok().map(|e| e.path())).filter(is_abandoned) {
        let _ = fs::remove_file(path);
    }
}

/// The host name of this machine.
fn host() -> String {
    let named = |name: &str| std::env::var(name).ok().filter(|text| !text.is_empty());
    let system = || fs::read_to_string("/proc/sys/kernel/hostname").ok().map(|text| text.trim().to_string());
    named("SLURMD_NODENAME").or_else(system).unwrap_or_default()
}
