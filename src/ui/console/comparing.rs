//! The comparison of the shown volume with another one.

use super::{Console, ConsoleError};
use crate::comparison::{Comparison, volume_of};
use crate::live::StreamError;
use crate::live::cine::CineVolume;
use crate::picture::Picture;
use crate::recordings::Named;
use crate::source::convert::Volume;
use crate::source::recorder::Header;
use crate::texts;
use std::path::PathBuf;
use std::sync::Arc;

/// Correlation of two aligned volumes below which the user is told to look.
const UNLIKE: f64 = 0.5;

impl Console {
    /// The picture of the difference, and after it those of the compared volumes, each None until it is drawn; empty without a comparison.
    pub fn compared(&self) -> Vec<Option<Arc<Picture>>> {
        self.comparison.as_ref().map_or_else(Vec::new, |comparison| comparison.shown.pictures())
    }

    /// The length, mm, and the angle, degrees, by which the first compared volume is moved; None if it is where its recording says.
    pub fn compared_is_moved(&self) -> Option<[f64; 2]> {
        self.comparison.as_ref()?.shown.others[0].moved
    }

    /// Begins a comparison: with the next open recording, or else with the shown volume as it is now. Ends one that is there.
    pub(super) fn toggle_comparison(&mut self) {
        if self.comparison.take().is_none() {
            let (settings, wake) = (self.controls.settings().clone(), self.fixed.wake.clone());
            let begun = match self.next_recording(1) {
                Some(file) => Comparison::with_file(&self.context, &file, &settings, &wake),
                None => {
                    self.shown_volume().ok_or_else(|| texts::WHY_NOTHING_TO_COMPARE.to_string()).and_then(|volume| {
                        let name = texts::compared_as_it_was(self.shown_name());
                        Comparison::with_volume(&self.context, volume, name, &settings, &wake)
                    })
                }
            };
            match begun {
                Ok(mut comparison) => {
                    comparison.shown.first = self.shown_name();
                    self.comparison = Some(comparison);
                }
                Err(fault) => self.notify(&texts::not_compared(fault), true),
            }
        }
        self.resize_picture();
    }

    /// Compares with the open recording after those that are compared.
    pub(super) fn compare_further(&mut self) {
        let Some(compared) = self.comparison.as_ref().map(|comparison| comparison.shown.others.len()) else {
            return self.toggle_comparison();
        };
        let file = self.next_recording(compared as i32 + 1).ok_or_else(|| texts::WHY_NO_FURTHER.to_string());
        let added = file.and_then(|file| match &mut self.comparison {
            Some(comparison) => comparison.add_file(&self.context, &file),
            None => Ok(()),
        });
        match added {
            Ok(()) => self.resize_picture(),
            Err(fault) => self.notify(&texts::not_compared(fault), true),
        }
    }

    /// The open recording so many places after the shown one; None if there are not so many others.
    fn next_recording(&self, by: i32) -> Option<PathBuf> {
        let further = |by| self.opening.recording(self.opening.further(by)?);
        // The list begins anew with the shown one.
        let others = (1..=by).map_while(|by| further(by).filter(|(_, is_shown)| !is_shown)).collect::<Vec<_>>();
        others.into_iter().nth(by as usize - 1).map(|(file, _)| file).filter(|file| file.exists())
    }

    fn shown_name(&self) -> String {
        let named = self.opening.named().into_iter().find(|named| named.is_shown);
        named.map_or_else(String::new, |Named { name, .. }| name)
    }

    /// The volume on display, or else the newest one in the cine loop, with its header.
    pub(super) fn shown_volume(&self) -> Option<(Header, Volume)> {
        let shown = self.shown_in_loop()?;
        let header = self.stream.header()?.clone();
        let volume = volume_of(&header, shown.frames.iter().map(AsRef::as_ref));
        Some((header, volume))
    }

    /// The volume of the cine loop that is on display; None if that is not in the loop.
    pub(super) fn cine_volume(&self) -> Option<&CineVolume> {
        self.stream.cine().volumes().get(self.stream.cine_position()?)
    }

    /// The volume of the cine loop that is on display, or else its newest one.
    pub(super) fn shown_in_loop(&self) -> Option<&CineVolume> {
        self.cine_volume().or(self.stream.cine().volumes().back())
    }

    /// Moves a compared volume as a drag over its picture does.
    pub(super) fn move_compared(&mut self, n: usize, pixels: [[f64; 2]; 2], turns: bool) {
        if let Some((comparison, scene)) = self.comparison.as_mut().zip(self.stream.scene()) {
            comparison.drag(n, pixels, turns, &scene.geometry);
            self.presentation.redraw();
        }
    }

    /// Moves the compared volumes onto the shown one, or back.
    pub(super) fn align_compared(&mut self) {
        let onto = self.shown_volume().map(|(_, volume)| volume);
        self.comparison.iter_mut().for_each(|comparison| comparison.align(onto.clone()));
    }

    /// Draws what is due of the compared volume.
    ///
    /// # Errors
    /// The device is lost.
    pub(super) fn advance_comparison(&mut self) -> Result<(), ConsoleError> {
        let volume = self.stream.cine_position();
        let Some(comparison) = &mut self.comparison else { return Ok(()) };
        // What is drawn now: while the view moves, at the same quality.
        let settings = self.stream.scene().map_or_else(|| self.controls.settings(), |scene| &scene.settings);
        let news = match comparison.update(settings, volume) {
            Ok((is_other, news)) => {
                self.presentation.redraw_if(is_other);
                news
            }
            Err(StreamError::Gpu(lost)) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
            Err(fault) => {
                self.comparison = None;
                self.resize_picture();
                Some(Err(fault.to_string()))
            }
        };
        match news {
            None => {}
            Some(Ok(found)) if found.correlation < UNLIKE => {
                self.notify(&texts::hardly_aligned(found.correlation), true);
            }
            Some(Ok(found)) => {
                let moved = [found.motion.shift.length(), found.motion.angle()];
                self.notify(&texts::aligned(moved, found.correlation), false);
            }
            Some(Err(fault)) => self.notify(&texts::not_compared(fault), true),
        }
        self.draw_difference();
        Ok(())
    }

    /// Makes the difference of both pictures, if it is shown and both are drawn.
    fn draw_difference(&mut self) {
        let Some(comparison) = self.comparison.as_mut().filter(|comparison| comparison.lacks_difference()) else {
            return;
        };
        if self.stream.is_drawing() {
            return;
        }
        // A device that fails here fails for the picture, too.
        let first =
            self.stream.renderer().filter(|renderer| renderer.has_drawn()).map(|renderer| renderer.end_picture());
        if let Some(Ok(first)) = first {
            comparison.make_difference(&first);
            self.presentation.redraw();
        }
    }
}
