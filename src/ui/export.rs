//! Saves pictures, recordings and exports of the view in background threads. File names contain the time and nothing about the patient.

use super::controls::Handiwork;
use super::volume_export::{Export, Job};
use crate::files;
use crate::gpu::Wake;
use crate::picture::Picture;
use crate::progress_lines::Progress;
use crate::scene::Settings;
use crate::segment::{Labels, files::write_segments};
use crate::source::segmentation::Segment;
use crate::texts;
use crate::workspace::{self, Origin};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};

/// Largest number of files that are being saved: a key that is held must not fill the disk.
const MAX_PENDING: usize = 4;

/// Ending of the name of a file of labels.
const LABELS_ENDING: &str = "seg.nrrd";

/// What a saved file contains that would be lost otherwise.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Holds {
    Nothing,
    /// The complete cine loop, up to the volume of this number.
    Loop(u32),
    /// Measurements, annotations, body marks, cuts and labels of a recording.
    Work {
        kept: Option<PathBuf>,
        work: Handiwork,
    },
}

/// The result of saving one file.
pub(super) struct Saved {
    pub(super) file: Result<PathBuf, String>,
    pub(super) holds: Holds,
}

/// Saves files on threads of its own.
pub(super) struct Exporter {
    pub(super) folder: PathBuf,
    sender: Sender<Saved>,
    receiver: Receiver<Saved>,
    pending: usize,
    number: u32,
    wake: Wake,
    /// Threads that save files other than exports.
    threads: Vec<JoinHandle<()>>,
    /// The last export: its name, state and thread.
    export: Option<(&'static str, Arc<Export>, JoinHandle<()>)>,
    /// Progress of the running export when it was last checked; None if it has reported none.
    pub(super) progress: Option<Progress>,
}

impl Exporter {
    /// `folder`: path of the folder for files, which is created with the first file. `wake` is called when saving a file has ended.
    pub(super) fn new(folder: PathBuf, wake: Wake) -> Exporter {
        let (sender, receiver) = channel();
        Exporter {
            folder,
            sender,
            receiver,
            pending: 0,
            number: 0,
            wake,
            threads: Vec::new(),
            export: None,
            progress: None,
        }
    }

    /// The result of a file whose saving has ended; None if there is none that was not returned before.
    pub(super) fn poll(&mut self) -> Option<Saved> {
        let done = self.receiver.try_recv().ok()?;
        self.pending = self.pending.saturating_sub(1);
        Some(done)
    }

    /// Saves as PNG the picture that `make` returns. `make` is called on a thread.
    ///
    /// # Errors
    /// Too many files are being saved, or no thread can be started.
    pub(super) fn picture(
        &mut self,
        make: impl FnOnce() -> Result<Picture, String> + Send + 'static,
    ) -> Result<(), String> {
        self.written("png", Holds::Nothing, move |file| make()?.save(file))
    }

    /// Saves a file with this file name ending by `write`, which is called on a thread. The view waits for it before it ends. `holds`: what the file
    /// contains that would be lost otherwise.
    ///
    /// # Errors
    /// Too many files are being saved, or no thread can be started.
    pub(super) fn written(
        &mut self,
        ending: &'static str,
        holds: Holds,
        write: impl FnOnce(&Path) -> Result<(), String> + Send + 'static,
    ) -> Result<(), String> {
        self.threads.retain(|thread| !thread.is_finished());
        let thread = self.save(ending, holds, write)?;
        self.threads.push(thread);
        Ok(())
    }

    /// Saves a workspace. `labels`: those that are written beside it instead of the file that `origin` names, if any voxel has one; None: they
    /// are as in that file.
    ///
    /// # Errors
    /// Too many files are being saved, no thread can be started, or the settings cannot be written.
    pub(super) fn workspace(
        &mut self,
        settings: Settings,
        mut origin: Origin,
        labels: Option<Option<(Arc<Labels>, Vec<Segment>)>>,
        holds: Holds,
    ) -> Result<(), String> {
        workspace::text(&settings, &origin)?;
        let write = move |file: &Path| {
            if let Some(labels) = labels {
                origin.labels = None;
                if let Some((labels, segments)) = labels {
                    let beside = file.with_extension(LABELS_ENDING);
                    write_segments(&labels, &beside, &segments).map_err(|e| e.to_string())?;
                    origin.labels = beside.file_name().map(PathBuf::from);
                }
            }
            files::replace(file, workspace::text(&settings, &origin)?.as_bytes())
        };
        self.written("toml", holds, write)
    }

    /// Starts an export. Only one runs at a time.
    ///
    /// # Errors
    /// Another export is running, too many files are being saved, or no thread can be started.
    pub(super) fn export(&mut self, job: Job) -> Result<(), String> {
        if let Some(name) = self.exporting() {
            return Err(texts::still_exporting(name));
        }
        let export = Arc::new(Export::default());
        let (own, name) = (export.clone(), job.format.name);
        let thread = self.save(job.format.ending, Holds::Nothing, move |file| {
            let done = own.run(&job, file);
            own.finish();
            done
        })?;
        self.export = Some((name, export, thread));
        Ok(())
    }

    /// The name of the export that is running; None if none is.
    pub(super) fn exporting(&self) -> Option<&'static str> {
        // The thread also ends without any work, if there is no folder for it.
        let is_at_work = |export: &Export, thread: &JoinHandle<()>| !export.is_finished() && !thread.is_finished();
        self.export.as_ref().filter(|(_, export, thread)| is_at_work(export, thread)).map(|(name, ..)| *name)
    }

    /// Checks the export that is running. Returns true if its progress changed.
    pub(super) fn look(&mut self) -> bool {
        let export = self.export.as_ref().filter(|_| self.exporting().is_some());
        let progress = export.and_then(|(_, export, _)| export.progress());
        std::mem::replace(&mut self.progress, progress) != progress
    }

    /// Cancels the running export, if there is one.
    pub(super) fn cancel_export(&self) {
        if let Some((_, export, _)) = &self.export {
            export.cancel();
        }
    }

    fn save(
        &mut self,
        extension: &'static str,
        holds: Holds,
        write: impl FnOnce(&Path) -> Result<(), String> + Send + 'static,
    ) -> Result<JoinHandle<()>, String> {
        if self.pending >= MAX_PENDING {
            return Err(texts::still_saving(MAX_PENDING));
        }
        self.number += 1;
        let (folder, number) = (self.folder.clone(), self.number);
        let (sender, wake) = (self.sender.clone(), self.wake.clone());
        let work = move || {
            let cannot = |e| texts::why_no_folder(folder.display(), e);
            let file = std::fs::create_dir_all(&folder).map_err(cannot).and_then(|()| {
                let file = unused_name(&folder, &timestamp(SystemTime::now()), number, extension);
                write(&file).map(|()| file)
            });
            let _ = sender.send(Saved { file, holds });
            wake();
        };
        let started = std::thread::Builder::new().name("saving".into()).spawn(work);
        let started = started.map_err(texts::why_no_thread)?;
        self.pending += 1;
        Ok(started)
    }
}

/// When the view ends, nothing of an export stays, and what is being saved is written to its end.
impl Drop for Exporter {
    fn drop(&mut self) {
        self.cancel_export();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
        if let Some((.., thread)) = self.export.take() {
            let _ = thread.join();
        }
    }
}

/// Date and time (UTC, whole seconds) for file names on any file system, such as `20261122-011320`.
pub fn timestamp(now: SystemTime) -> String {
    // A clock before 1970 is not set; the names only need to differ.
    let now = now.max(UNIX_EPOCH);
    humantime::format_rfc3339_seconds(now).to_string().replace(['-', ':'], "").replace('T', "-").replace('Z', "")
}

/// A file name that does not exist yet: no saved file is overwritten.
fn unused_name(folder: &Path, stamp: &str, number: u32, extension: &str) -> PathBuf {
    let name = |n: u32| folder.join(format!("echolume-{stamp}-{n}.{extension}"));
    // Nor that of the labels beside a workspace.
    let is_unused = |file: &PathBuf| !file.exists() && !file.with_extension(LABELS_ENDING).exists();
    (number..u32::MAX).map(name).find(is_unused).unwrap_or_else(|| name(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::cine::CineVolume;
    use crate::probe::{Geometry, Grid};
    use crate::source::StoredType;
    use crate::source::recorder::Header;
    use crate::volume_export::FORMATS;
    use std::time::Duration;

    fn wait(exporter: &mut Exporter) -> Result<PathBuf, String> {
        for _ in 0..2000 {
            if let Some(done) = exporter.poll() {
                return done.file;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err("nothing was reported".into())
    }

    fn job() -> Job {
        let grid = Grid { size: [1; 3], spacing: [1.0; 3], origin: [0.0; 3] };
        let (forward, backward) = (Geometry::Cartesian(grid), Geometry::Cartesian(grid));
        let header =
            Header { forward, backward, stored: StoredType::U8, range: [0.0, 255.0], posed: false, synthetic: false };
        let volumes = vec![CineVolume::default()];
        Job {
            format: FORMATS[0],
            header,
            volumes,
            rate: 1.0,
            settings: Settings::default(),
            origin: None,
            device: String::new(),
        }
    }

    #[test]
    fn names_contain_the_time_and_are_unused() {
        assert_eq!(timestamp(UNIX_EPOCH + Duration::from_secs(1_795_310_000)), "20261122-011320");
        let folder = std::env::temp_dir().join(format!("echolume-export-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        std::fs::write(folder.join("echolume-x-1.png"), "").expect("file");
        assert_eq!(unused_name(&folder, "x", 1, "png"), folder.join("echolume-x-2.png"));
        std::fs::remove_dir_all(&folder).expect("folder");
    }

    #[test]
    fn what_is_being_saved_is_whole_when_the_view_has_ended() {
        let folder = std::env::temp_dir().join(format!("echolume-ended-{}", std::process::id()));
        let picture = Picture { width: 1, height: 1, rgba: vec![1, 2, 3, 255] };
        let same = picture.clone();
        let mut exporter = Exporter::new(folder.clone(), Arc::new(|| ()));
        exporter
            .picture(move || {
                std::thread::sleep(Duration::from_millis(200));
                Ok(same)
            })
            .expect("thread");
        drop(exporter);
        let files: Vec<_> = std::fs::read_dir(&folder).expect("folder").flatten().map(|file| file.path()).collect();
        assert_eq!(files.len(), 1, "{files:?}");
        assert_eq!(Picture::load(&files[0]).expect("picture"), picture);
        std::fs::remove_dir_all(&folder).expect("folder");
    }

    #[test]
    fn a_picture_is_saved_and_a_folder_that_cannot_be_created_is_reported() {
        let picture = Picture { width: 2, height: 1, rgba: vec![1, 2, 3, 255, 4, 5, 6, 255] };
        let folder = std::env::temp_dir().join(format!("echolume-saved-{}", std::process::id()));
        let mut exporter = Exporter::new(folder.clone(), Arc::new(|| ()));
        let same = picture.clone();
        exporter.picture(move || Ok(same)).expect("thread");
        let file = wait(&mut exporter).expect("saved");
        assert_eq!(Picture::load(&file).expect("picture"), picture);
        std::fs::remove_dir_all(&folder).expect("folder");
        let mut nowhere = Exporter::new(PathBuf::from("/dev/null/pictures"), Arc::new(|| ()));
        nowhere.picture(move || Ok(picture)).expect("thread");
        assert!(wait(&mut nowhere).unwrap_err().contains("/dev/null/pictures"));
        // An export that could not begin does not keep the next one from beginning.
        for _ in 0..2 {
            nowhere.export(job()).expect("none is in work");
            assert!(wait(&mut nowhere).unwrap_err().contains("/dev/null/pictures"));
            while nowhere.exporting().is_some() {
                std::thread::yield_now();
            }
        }
    }
}
