//! Looking back: the stream frozen, volumes of the cine loop sent once more, and another source in the place of one that ended.

use super::cine::{Cine, CineVolume};
use super::feed::Feed;
use super::stream::{Stream, StreamError};

/// Frames that are sent before anything else is looked at: some milliseconds' worth.
const AT_ONCE: usize = 8;

/// A volume on its way to the device once more.
pub struct Replay {
    pub(super) kept: CineVolume,
    sent: usize,
    image: u32,
}

impl Stream {
    /// Nothing that comes is shown from here on, or again everything. The source is listened to, and recorded, all the while.
    pub fn freeze(&mut self, frozen: bool) {
        if self.frozen == frozen {
            return;
        }
        self.frozen = frozen;
        // The rest of what is being filled will not be seen, or was not.
        self.cine.cut();
        if let Some(now) = &mut self.now {
            now.turns.end();
        }
    }

    pub fn is_frozen(&self) -> bool {
        self.frozen
    }

    /// The last volumes as they came.
    pub fn cine(&self) -> &Cine {
        &self.cine
    }

    /// The place of what is shown in the cine loop, from 0, where it is in it.
    pub fn cine_position(&self) -> Option<usize> {
        let volume = match (&self.replay, &self.now) {
            (Some(replay), _) => replay.kept.volume,
            (None, Some(now)) => now.volume?,
            (None, None) => return None,
        };
        self.cine.volumes().iter().position(|kept| kept.volume == volume)
    }

    /// Shows the volume at a place of the cine loop, 0 the oldest; one that is not there changes nothing.
    pub fn show_cine_volume(&mut self, place: usize) {
        let (Some(kept), Some(now)) = (self.cine.volumes().get(place).cloned(), &mut self.now) else { return };
        let image = match &self.replay {
            // What was being sent gives way.
            Some(replay) => Some(replay.image),
            None => now.turns.spare(),
        };
        self.replay = image.map(|image| Replay { kept, sent: 0, image });
    }

    /// A volume that other settings or another device took away, where it was kept; else the newest.
    pub(super) fn show_again(&mut self, volume: u32) {
        if let Some(newest) = self.cine.volumes().len().checked_sub(1) {
            self.show_cine_volume(self.cine.volumes().iter().position(|kept| kept.volume == volume).unwrap_or(newest));
        }
    }

    /// The next frames of what is sent once more.
    pub(super) fn send_again(&mut self) -> Result<(), StreamError> {
        let (Some(replay), Some(now)) = (&mut self.replay, &mut self.now) else { return Ok(()) };
        let (frames, image) = (&replay.kept.frames, replay.image);
        for frame in frames.iter().skip(replay.sent).take(AT_ONCE) {
            now.renderer.frame(frame.slice as u32, &frame.bytes, image)?;
            replay.sent += 1;
        }
        if replay.sent >= frames.len() {
            let backward = frames.iter().map(|frame| frame.backward).collect();
            now.turns.put(image, replay.kept.volume, backward);
            self.replay = None;
        }
        Ok(())
    }

    /// Goes on with another source, whose volumes are numbered on from those before; what is shown stays until it has something to show.
    pub fn replace_source(&mut self, feed: Feed) {
        (self.feed, self.end) = (feed, None);
        self.cine.cut();
        // A number of two volumes would lead to the wrong one of them.
        if let Some(newest) = self.newest.take() {
            self.first = newest.checked_add(1).unwrap_or_else(|| {
                self.cine.clear();
                0
            });
        }
        if let Some(now) = &mut self.now {
            now.turns.begin_anew();
        }
    }
}
