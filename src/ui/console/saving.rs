//! Saves what is shown: the picture, the cine loop, and the volume in the formats of other programs.

use super::Console;
use crate::export::Holds;
use crate::live::cine::CineVolume;
use crate::marked;
use crate::panels::Note;
use crate::progress_lines::Progress;
use crate::segment::files::write_segments;
use crate::source::live::SourceKind;
use crate::texts;
use crate::volume_export::{FORMATS, Job, Work, renumbered, write_frames};
use crate::workspace::Origin;
use std::time::SystemTime;

impl Console {
    /// Text for pictures that are not of a patient but of the phantom, also from a recording of it; None otherwise.
    pub(super) fn origin(&self) -> Option<&'static str> {
        let is_synthetic = self.stream.header().is_some_and(|header| header.synthetic);
        (self.connection.kind == SourceKind::Demo || is_synthetic).then_some(texts::DEMO_DATA)
    }

    /// Saves the shown picture with its measurements, and with a bar of text if that is chosen.
    pub(super) fn save_picture(&mut self) {
        let picture = match self.stream.renderer().filter(|renderer| renderer.has_drawn()) {
            Some(renderer) => match renderer.end_picture() {
                Ok(picture) => {
                    let mut scene = renderer.scene().clone();
                    scene.settings = scene.settings.with_drawings_of(self.controls.settings());
                    Ok((picture, scene, renderer.unveiled().cloned()))
                }
                Err(fault) => Err(fault.to_string()),
            },
            None => Err(texts::WHY_NO_PICTURE.into()),
        };
        let (has_bar, time) = (self.controls.settings().drawn.marks.bar, marked::time_line(SystemTime::now()));
        let (origin, volume) = (self.origin(), self.stream.drawn_volume());
        let saved = picture.and_then(|(picture, scene, start)| {
            self.exporter.picture(move || match has_bar {
                true => marked::marked(&picture, &scene, volume, start.as_ref(), &time, origin),
                false => marked::measured(&picture, &scene, volume, start.as_ref(), origin),
            })
        });
        if let Err(fault) = saved {
            self.notify(&texts::picture_not_saved(fault), true);
        }
    }

    /// The volumes between the marks of the cine loop.
    fn marked_volumes(&self) -> Vec<CineVolume> {
        // There may be none.
        let range = self.cine_loop().range();
        self.stream.cine().volumes().iter().skip(*range.start()).take(range.count()).cloned().collect()
    }

    /// Saves the volumes of the cine loop between its marks. Returns false if that is impossible.
    pub(super) fn save_loop(&mut self) -> bool {
        let volumes = self.marked_volumes();
        let kept = self.stream.cine().volumes();
        // What lies beyond the marks is still in no file.
        let complete_to = kept.back().map(|newest| newest.volume).filter(|_| volumes.len() == kept.len());
        let saved = match self.stream.header() {
            Some(header) if !volumes.is_empty() => {
                let header = header.clone();
                let holds = complete_to.map_or(Holds::Nothing, Holds::Loop);
                self.exporter.written("frames", holds, move |file| write_frames(file, header, &volumes))
            }
            _ => Err(texts::WHY_NO_VOLUMES.into()),
        };
        if let Err(fault) = &saved {
            self.notify(&texts::loop_not_saved(fault), true);
        }
        saved.is_ok()
    }

    /// Exports the shown volume, or else the newest one, in the n-th format of the menu.
    pub(super) fn export_volume(&mut self, n: usize) {
        let Some(format) = FORMATS.get(n).copied() else { return };
        self.visible.close_exports();
        if format.work == Work::Labels {
            let labels = self.controls.labels_to_export().ok_or_else(|| texts::WHY_NO_LABELS.to_string());
            let begun = labels.and_then(|(labels, segments)| {
                self.exporter.written(format.ending, Holds::Nothing, move |file| {
                    write_segments(&labels, file, &segments).map_err(|e| e.to_string())
                })
            });
            return begun.unwrap_or_else(|fault| self.notify(&texts::not_exported(fault), true));
        }
        let volumes = match format.work {
            Work::Loop => self.marked_volumes(),
            _ => self.shown_in_loop().into_iter().cloned().collect(),
        };
        let rate = self.cine_loop().played_rate();
        // A report needs a recording whose volumes have the numbers of those here.
        let has_report = format.work == Work::Report && self.fixed.plays_once;
        let origin = self.numbered_origin().filter(|origin| has_report && origin.recording.is_some());
        let begun = match self.stream.header().cloned() {
            _ if format.work == Work::Report && origin.is_none() => Err(texts::WHY_NO_REPORT.into()),
            Some(header) if !volumes.is_empty() => {
                let mut settings = self.controls.settings().clone();
                let numbers: Vec<u32> = volumes.iter().map(|volume| volume.volume).collect();
                if origin.is_none() {
                    settings.drawn.measure = renumbered(&settings.drawn.measure, &numbers);
                }
                self.exporter.export(Job {
                    format,
                    header,
                    volumes,
                    rate,
                    settings,
                    origin,
                    device: self.context.candidate.name.clone(),
                })
            }
            _ => Err(texts::WHY_NO_VOLUME.into()),
        };
        match begun {
            Ok(()) => self.notify(&texts::exporting(format.name), false),
            Err(fault) => self.notify(&texts::not_exported(fault), true),
        }
    }

    /// What a workspace stores of the source, with the number of the volume that is shown, if numbers of volumes are those in the recording.
    pub(super) fn numbered_origin(&self) -> Option<Origin> {
        let mut origin = self.fixed.origin.clone()?;
        let shown = self.cine_volume().filter(|_| self.fixed.plays_once);
        origin.volume = shown.map_or(0, |kept| kept.volume as usize);
        Some(origin)
    }

    /// Takes the files that were saved since the last update.
    pub(super) fn poll_saved(&mut self) {
        while let Some(saved) = self.exporter.poll() {
            match saved.file {
                Ok(file) => {
                    self.request.exit |= self.leaving.saved(&saved.holds);
                    match saved.holds {
                        Holds::Work { kept: None, work } => self.controls.saved(work),
                        Holds::Work { kept: Some(path), work } => self.opening.recordings().saved(&path, work),
                        Holds::Loop(_) | Holds::Nothing => {}
                    }
                    if file.extension().is_some_and(|end| end == "toml") {
                        self.opening.remember(&file);
                    }
                    self.notify(&texts::saved(&file), false);
                }
                Err(fault) => {
                    self.leaving.not_saved(&saved.holds);
                    self.notify(&texts::not_saved(fault), true);
                }
            }
        }
    }

    /// A message about the export in progress, once its progress is known; None while the list of exports shows it.
    pub(super) fn export_note(&self) -> Option<Note> {
        let name = self.exporter.exporting().filter(|_| !self.visible.exports)?;
        let Progress { done, of } = self.exporter.progress?;
        Some(Note { text: texts::export_so_far(name, done, of), is_fault: false })
    }
}
