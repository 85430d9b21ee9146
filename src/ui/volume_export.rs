//! Exports the shown volume for other programs: a volume, a surface or a turntable. A process of this program's `convert`, `mesh` or `render` does
//! the work, so that a long export does not block the view and a failing one does not end it.

use crate::files::WorkFolder;
use crate::files::signals::Writing;
use crate::live::cine::CineVolume;
use crate::progress_lines::{self, Progress};
use crate::scene::Measurement;
use crate::source::recorder::{Header, Writer};
use crate::sync::locked;
use crate::text::printable;
use crate::texts;
use crate::workspace::{self, Origin};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// Most of what the process says of a fault, and of one line, bytes.
const MAX_MESSAGE: usize = 1 << 16;
const MAX_LINE: u64 = 1 << 12;
/// How often it is checked whether the process has ended.
const POLL: Duration = Duration::from_millis(20);
/// Pictures of a turntable: one every five degrees.
const TURNTABLE: &str = "72";
/// What `render --rate` takes.
const FILM_RATES: [f64; 2] = [0.1, 240.0];
/// Name of the recording that the process reads.
const RECORDING: &str = "volume.frames";
/// Thickness of the base of a relief, mm.
const BASE: &str = "3";

/// A format in the menu of exports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    pub name: &'static str,
    pub hint: &'static str,
    /// File name ending; for a series of pictures that of its folder.
    pub(super) ending: &'static str,
    pub(super) work: Work,
}

/// How a format is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Work {
    Convert,
    Mesh,
    Relief,
    Turntable,
    /// All volumes between the marks of the cine loop.
    Loop,
    /// A picture whose longer edge has this number of pixels.
    Picture(u32),
    /// The measurements of the recording, and the JSON that makes the report again.
    Report,
    /// The labels instead of the echoes.
    Labels,
}

const fn format(name: &'static str, ending: &'static str, work: Work, hint: &'static str) -> Format {
    Format { name, hint, ending, work }
}

/// All export formats, in the order of the menu.
pub const FORMATS: &[Format] = &[
    format(texts::VOLUME_NRRD, "nrrd", Work::Convert, texts::VOLUME_NRRD_HINT),
    format(texts::VOLUME_NIFTI, "nii.gz", Work::Convert, texts::VOLUME_NIFTI_HINT),
    format(texts::VOLUME_METAIMAGE, "mha", Work::Convert, texts::VOLUME_METAIMAGE_HINT),
    format(texts::VOLUME_DICOM, "dcm", Work::Convert, texts::VOLUME_DICOM_HINT),
    format(texts::SURFACE_STL, "stl", Work::Mesh, texts::SURFACE_STL_HINT),
    format(texts::SURFACE_GLTF, "glb", Work::Mesh, texts::SURFACE_GLTF_HINT),
    format(texts::RELIEF_STL, "stl", Work::Relief, texts::RELIEF_STL_HINT),
    format(texts::TURNTABLE_PICTURES, "turntable", Work::Turntable, texts::TURNTABLE_PICTURES_HINT),
    format(texts::LOOP_PICTURES, "loop", Work::Loop, texts::LOOP_PICTURES_HINT),
    format(texts::PICTURE_1000, "png", Work::Picture(1000), texts::PICTURE_HINT),
    format(texts::PICTURE_2000, "png", Work::Picture(2000), texts::PICTURE_HINT),
    format(texts::PICTURE_4000, "png", Work::Picture(4000), texts::PICTURE_HINT),
    format(texts::TURNTABLE_FILM, "mp4", Work::Turntable, texts::TURNTABLE_FILM_HINT),
    format(texts::LOOP_FILM, "mp4", Work::Loop, texts::LOOP_FILM_HINT),
    format(texts::LABELS_NRRD, "seg.nrrd", Work::Labels, texts::LABELS_NRRD_HINT),
    format(texts::REPORT, "pdf", Work::Report, texts::REPORT_HINT),
];

/// An export in progress.
#[derive(Debug, Default)]
pub(super) struct Export {
    is_cancelled: AtomicBool,
    is_finished: AtomicBool,
    /// The progress that the process reported last.
    progress: Arc<Mutex<Option<Progress>>>,
}

impl Export {
    /// Cancels the export. Nothing of it is left.
    pub(super) fn cancel(&self) {
        self.is_cancelled.store(true, Relaxed);
    }

    pub(super) fn finish(&self) {
        self.is_finished.store(true, Relaxed);
    }

    pub(super) fn is_finished(&self) -> bool {
        self.is_finished.load(Relaxed)
    }

    /// The progress that the export has reported last; None before it has reported any.
    pub(super) fn progress(&self) -> Option<Progress> {
        *locked(&self.progress)
    }

    /// Exports the volumes of a job to `file`, which must not exist. The file is complete or not written.
    ///
    /// # Errors
    /// One line: the disk is full, the process that exports has failed, or the export was cancelled.
    pub(super) fn run(&self, job: &Job, file: &Path) -> Result<(), String> {
        // A signal that ends this program waits until nothing unfinished is left. Dropped last.
        let signals = Writing::begin();
        let beside = file.parent().unwrap_or(Path::new("."));
        let folder = WorkFolder::new(beside, ".echolume-export-")?;
        let recording = folder.path().join(RECORDING);
        let is_report = job.format.work == Work::Report;
        // A report names the recording itself.
        if !is_report {
            write_frames(&recording, job.header.clone(), &job.volumes)?;
        }
        let made = folder.path().join(format!("out.{}", job.format.ending));
        self.process(&mut job.command(&recording, &made)?, &|| signals.signal().is_some())?;
        let moved = |ending: &str| std::fs::rename(made.with_extension(ending), file.with_extension(ending));
        let json = if is_report { moved("json") } else { Ok(()) };
        json.and_then(|()| std::fs::rename(&made, file)).map_err(|e| format!("{}: {e}", file.display()))
    }

    /// `must_stop`: true if the work is to end early.
    fn process(&self, command: &mut Command, must_stop: &dyn Fn() -> bool) -> Result<(), String> {
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command.env(progress_lines::ASKED_BY.0, progress_lines::ASKED_BY.1);
        let mut child = command.spawn().map_err(texts::why_export_not_started)?;
        let messages = child.stderr.take();
        let progress = self.progress.clone();
        // Not waited for where the work is cancelled: what the process left running may hold the pipe.
        let said = thread::spawn(move || messages.map_or_else(String::new, |messages| listen(messages, &progress)));
        let status = self.wait(&mut child, must_stop)?;
        let said = said.join().unwrap_or_default();
        if status.success() {
            return Ok(());
        }
        let last = said.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or(texts::WHY_EXPORT_ENDED);
        // The view says itself that this program did not save.
        let last = last.strip_prefix("echolume: ").unwrap_or(last);
        Err(printable(last.trim_start_matches("error: ")))
    }

    /// Waits for the process, and ends it where it has to stop.
    fn wait(&self, child: &mut Child, must_stop: &dyn Fn() -> bool) -> Result<ExitStatus, String> {
        loop {
            if self.is_cancelled.load(Relaxed) || must_stop() {
                // It may have ended by itself.
                let _ = child.kill();
                let _ = child.wait();
                return Err("cancelled".into());
            }
            match child.try_wait() {
                Ok(Some(status)) => return Ok(status),
                Ok(None) => thread::sleep(POLL),
                Err(e) => {
                    let _ = child.kill();
                    return Err(texts::why_export_lost(e));
                }
            }
        }
    }
}

/// Takes the progress of a process, and returns what else it says: the end of it, up to a limit.
fn listen(messages: impl Read, progress: &Mutex<Option<Progress>>) -> String {
    let mut said: Vec<u8> = Vec::new();
    let mut messages = BufReader::new(messages);
    let mut line = Vec::new();
    // A line of any length is read in pieces; a full pipe would block the process.
    while (&mut messages).take(MAX_LINE).read_until(b'\n', &mut line).is_ok_and(|read| read > 0) {
        match std::str::from_utf8(&line).ok().and_then(|line| progress_lines::parse(line.trim_end())) {
            Some(found) => *locked(progress) = Some(found),
            None => said.extend(&line),
        }
        // The last words say why.
        said.drain(..said.len().saturating_sub(MAX_MESSAGE));
        line.clear();
    }
    String::from_utf8_lossy(&said).into_owned()
}

/// Writes volumes as a `.frames` recording. The file is complete or not written.
///
/// # Errors
/// One line: the file cannot be written.
pub(super) fn write_frames(file: &Path, header: Header, volumes: &[CineVolume]) -> Result<(), String> {
    let mut writer = Writer::create(file, header).map_err(|e| e.to_string())?;
    let mut frames = volumes.iter().flat_map(|volume| &volume.frames);
    match frames.try_for_each(|frame| writer.frame(frame, frame.time.unwrap_or(0.0))) {
        Ok(()) => writer.finish().map_err(|e| {
            // What is said not to be saved is not there.
            let _ = std::fs::remove_file(file);
            e.to_string()
        }),
        Err(e) => {
            writer.discard();
            Err(e.to_string())
        }
    }
}

/// The volumes to export, the format and the settings.
pub(super) struct Job {
    pub(super) format: Format,
    pub(super) header: Header,
    /// The shown volume, or all volumes between the marks of the cine loop for [`Work::Loop`].
    pub(super) volumes: Vec<CineVolume>,
    /// Rate at which the cine loop is played, volumes a second.
    pub(super) rate: f64,
    pub(super) settings: crate::scene::Settings,
    /// The recording that is shown, for a report.
    pub(super) origin: Option<Origin>,
    /// The name of the view's device, for turntables.
    pub(super) device: String,
}

impl Job {
    /// The command that makes `made` of a recording of one volume. A workspace for it goes beside the recording.
    fn command(&self, recording: &Path, made: &Path) -> Result<Command, String> {
        let program = std::env::current_exe().map_err(texts::why_no_program)?;
        let mut command = Command::new(program);
        let mut of_workspace = |name: &str, more: &[&str]| {
            command.arg(name).arg(self.workspace(recording)?).args(more);
            command.args(["--device", &self.device, "-o"]).arg(self.output(made));
            Ok::<(), String>(())
        };
        match self.format.work {
            Work::Picture(edge) => {
                let [width, height] = enlarged(self.settings.picture.size, edge);
                of_workspace("render", &["--size", &format!("{width}x{height}")])?;
            }
            Work::Report => of_workspace("worksheet", &[])?,
            Work::Turntable => of_workspace("render", &["--turntable", TURNTABLE])?,
            Work::Loop if self.format.ending == "mp4" => {
                let rate = self.rate.clamp(FILM_RATES[0], FILM_RATES[1]).to_string();
                of_workspace("render", &["--volumes", "loop", "--rate", &rate])?;
            }
            // Pictures have no rate.
            Work::Loop => of_workspace("render", &["--volumes", "loop"])?,
            Work::Convert => _ = command.arg("convert").args([recording, made]),
            Work::Mesh => _ = command.arg("mesh").args([recording, made]),
            Work::Relief => _ = command.arg("mesh").args([recording, made]).args(["--base", BASE]),
            // It is no work of a process.
            Work::Labels => return Err(texts::WHY_NO_LABELS.into()),
        }
        Ok(command)
    }

    /// The path that the command writes. That of a folder of pictures, which turntables and loops make, ends with a slash.
    fn output(&self, made: &Path) -> PathBuf {
        if matches!(self.format.ending, "turntable" | "loop") { made.join("") } else { made.to_path_buf() }
    }

    fn workspace(&self, recording: &Path) -> Result<PathBuf, String> {
        let file = recording.with_file_name("scene.toml");
        // The recording holds what is between the marks.
        let mut settings = self.settings.clone();
        (settings.drawn.cine.first, settings.drawn.cine.last) = (None, None);
        let origin = self.origin.clone().unwrap_or_else(|| Origin::of(Some(RECORDING.into())));
        let text = workspace::text(&settings, &origin)?;
        std::fs::write(&file, text).map_err(|e| format!("{}: {e}", file.display()))?;
        Ok(file)
    }
}

/// The size of a picture of this shape whose longer edge has so many pixels.
fn enlarged(size: [u32; 2], edge: u32) -> [u32; 2] {
    let longest = f64::from(size[0].max(size[1]).max(1));
    size.map(|n| ((f64::from(n) * f64::from(edge) / longest).round() as u32).max(1))
}

/// Copies of the measurements on the volumes with these numbers, with the numbers that the volumes have in a recording of them.
pub(super) fn renumbered(measures: &[Measurement], volumes: &[u32]) -> Vec<Measurement> {
    let place = |number: u32| volumes.iter().position(|volume| *volume == number);
    let renumber = |measured: &Measurement| {
        let mut measured = measured.clone();
        if let Some(made) = &mut measured.made {
            made.volume = place(made.volume)? as u32;
        }
        Some(measured)
    };
    measures.iter().filter_map(renumber).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Made;

    #[test]
    fn a_picture_of_another_size_keeps_its_shape() {
        assert_eq!(enlarged([1280, 720], 4000), [4000, 2250]);
        assert_eq!(enlarged([300, 900], 1000), [333, 1000]);
        assert_eq!(enlarged([1, 0], 2000), [2000, 1]);
    }

    /// Prevents a file whose measurements count as those of another volume than they were made on.
    #[test]
    fn measurements_are_of_the_volumes_of_the_file() {
        let on = |volume| Measurement { made: Some(Made { volume, ..Made::default() }), ..Measurement::default() };
        let found = renumbered(&[on(7), on(6), Measurement::default(), on(4)], &[4, 5, 7]);
        assert_eq!(found, [on(2), Measurement::default(), on(0)]);
    }

    #[test]
    fn what_the_process_says_of_its_fault_is_reported() {
        let process = |command: &mut Command| Export::default().process(command, &|| false);
        let run = |script: &str| process(Command::new("sh").args(["-c", script]));
        assert_eq!(run("exit 0"), Ok(()));
        assert_eq!(run("echo warning >&2; echo 'error: no room' >&2; exit 1"), Err("no room".into()));
        assert_eq!(run("echo 'echolume: a.mha: no room' >&2; exit 1"), Err("a.mha: no room".into()));
        assert_eq!(run("exit 3"), Err("it ended early".into()));
        // More than a pipe holds.
        assert_eq!(run("yes abc | head -c 400000 >&2; exit 0"), Ok(()));
        let gone = process(&mut Command::new("/no/such/program"));
        assert!(gone.is_err_and(|fault| fault.contains("cannot be started")));
        // Of a long complaint, its end.
        let long = run("yes abc | head -c 400000 >&2; echo 'error: no room' >&2; exit 1");
        assert_eq!(long, Err("no room".into()));
    }

    /// Prevents an export of minutes that says nothing, and progress that is taken for a fault.
    #[test]
    fn progress_is_read_while_the_process_works_and_is_no_fault() {
        let export = Export::default();
        assert_eq!(export.progress(), None);
        let script = "echo 'progress: 3/72 pictures' >&2; exec sleep 600";
        thread::scope(|scope| {
            let running = scope.spawn(|| export.process(Command::new("bash").args(["-c", script]), &|| false));
            while export.progress().is_none() && !running.is_finished() {
                thread::sleep(POLL);
            }
            assert_eq!(export.progress(), Some(Progress { done: 3, of: 72 }));
            export.cancel();
            assert_eq!(running.join().expect("no panic"), Err("cancelled".into()));
        });
        let script = "echo \"$ECHOLUME_PROGRESS\" >&2; echo 'progress: 1/2' >&2; exit 1";
        let failed = Export::default().process(Command::new("sh").args(["-c", script]), &|| false);
        assert_eq!(failed, Err("lines".into()), "asked for, and not the last word");
    }

    #[test]
    fn an_export_that_is_cancelled_ends_at_once() {
        let export = Export::default();
        let sleep = || export.process(Command::new("sleep").arg("600"), &|| false);
        thread::scope(|scope| {
            let running = scope.spawn(sleep);
            thread::sleep(3 * POLL);
            export.cancel();
            assert_eq!(running.join().expect("no panic"), Err("cancelled".into()));
        });
        assert_eq!(sleep(), Err("cancelled".into()));
        let signalled = Export::default().process(Command::new("sleep").arg("600"), &|| true);
        assert_eq!(signalled, Err("cancelled".into()));
    }
}
