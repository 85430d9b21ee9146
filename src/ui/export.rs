//! What is saved from the view: on threads of their own, under names that say when and never who.

use crate::gpu::Wake;
use crate::live::cine::CineVolume;
use crate::picture::Picture;
use crate::source::recorder::{Header, Writer};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{SystemTime, UNIX_EPOCH};

/// Savings on their way at most: a finger that rests on the key fills no disk.
const MOST: usize = 4;

pub struct Exporter {
    folder: PathBuf,
    tell: Sender<Result<PathBuf, String>>,
    told: Receiver<Result<PathBuf, String>>,
    under_way: usize,
    number: u32,
    wake: Wake,
}

impl Exporter {
    /// `folder`: where files go; it is made when the first one does.
    pub fn new(folder: PathBuf, wake: Wake) -> Exporter {
        let (tell, told) = channel();
        Exporter { folder, tell, told, under_way: 0, number: 0, wake }
    }

    /// What was saved, or could not be, since this was asked last.
    pub fn poll(&mut self) -> Option<Result<PathBuf, String>> {
        let done = self.told.try_recv().ok()?;
        self.under_way = self.under_way.saturating_sub(1);
        Some(done)
    }

    /// A picture, as PNG.
    ///
    /// # Errors
    /// Others are being saved; no thread.
    pub fn picture(&mut self, picture: Picture) -> Result<(), String> {
        self.save("png", move |file| picture.save(file))
    }

    /// Volumes, as a recording of frames.
    ///
    /// # Errors
    /// As of [`Exporter::picture`].
    pub fn volumes(&mut self, header: Header, volumes: Vec<CineVolume>) -> Result<(), String> {
        self.save("frames", move |file| {
            let mut writer = Writer::create(file, header).map_err(|e| e.to_string())?;
            let mut frames = volumes.iter().flat_map(|kept| &kept.frames);
            match frames.try_for_each(|frame| writer.frame(frame, frame.time.unwrap_or(0.0))) {
                Ok(()) => writer.finish().map_err(|e| e.to_string()),
                Err(e) => {
                    writer.discard();
                    Err(e.to_string())
                }
            }
        })
    }

    fn save(
        &mut self,
        ending: &'static str,
        write: impl FnOnce(&Path) -> Result<(), String> + Send + 'static,
    ) -> Result<(), String> {
        if self.under_way >= MOST {
            return Err(format!("{MOST} files are still being saved: wait a moment"));
        }
        self.number += 1;
        let (folder, number) = (self.folder.clone(), self.number);
        let (tell, wake) = (self.tell.clone(), self.wake.clone());
        let work = move || {
            let cannot = |e| format!("{}: cannot be made: {e}", folder.display());
            let saved = std::fs::create_dir_all(&folder).map_err(cannot).and_then(|()| {
                let file = free_name(&folder, &stamp(SystemTime::now()), number, ending);
                write(&file).map(|()| file)
            });
            let _ = tell.send(saved);
            wake();
        };
        let started = std::thread::Builder::new().name("saving".into()).spawn(work);
        started.map(|_| self.under_way += 1).map_err(|e| format!("a thread cannot be started: {e}"))
    }
}

/// Seconds since 1970 as a date and a time of day (UTC) that every file system takes.
pub fn stamp(now: SystemTime) -> String {
    // Before 1970 a clock is not set, and names need only differ.
    let now = now.max(UNIX_EPOCH);
    humantime::format_rfc3339_seconds(now).to_string().replace(['-', ':'], "").replace('T', "-").replace('Z', "")
}

/// A name that nothing has: what was saved is never written over.
fn free_name(folder: &Path, stamp: &str, number: u32, ending: &str) -> PathBuf {
    let name = |n: u32| folder.join(format!("echolume-{stamp}-{n}.{ending}"));
    (number..u32::MAX).map(name).find(|file| !file.exists()).unwrap_or_else(|| name(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::time::Duration;

    fn wait(keep: &mut Exporter) -> Result<PathBuf, String> {
        for _ in 0..2000 {
            if let Some(done) = keep.poll() {
                return done;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Err("nothing was told".into())
    }

    #[test]
    fn names_say_when_and_are_never_taken() {
        assert_eq!(stamp(UNIX_EPOCH + Duration::from_secs(1_795_310_000)), "20261122-011320");
        let folder = std::env::temp_dir().join(format!("echolume-keep-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        std::fs::write(folder.join("echolume-x-1.png"), "").expect("file");
        assert_eq!(free_name(&folder, "x", 1, "png"), folder.join("echolume-x-2.png"));
        std::fs::remove_dir_all(&folder).expect("folder");
    }

    #[test]
    fn a_picture_is_saved_and_a_folder_that_cannot_be_made_is_told() {
        let picture = Picture { width: 2, height: 1, rgba: vec![1, 2, 3, 255, 4, 5, 6, 255] };
        let folder = std::env::temp_dir().join(format!("echolume-kept-{}", std::process::id()));
        let mut keep = Exporter::new(folder.clone(), Arc::new(|| ()));
        keep.picture(picture.clone()).expect("thread");
        let file = wait(&mut keep).expect("saved");
        assert_eq!(Picture::load(&file).expect("picture"), picture);
        std::fs::remove_dir_all(&folder).expect("folder");
        let mut nowhere = Exporter::new(PathBuf::from("/dev/null/pictures"), Arc::new(|| ()));
        nowhere.picture(picture).expect("thread");
        assert!(wait(&mut nowhere).unwrap_err().contains("/dev/null/pictures"));
    }
}
