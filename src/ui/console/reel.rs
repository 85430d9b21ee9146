//! Thumbnails of the volumes of the cine loop, for its time line. They are made while the loop rests.

use super::presets::{LONG_REST, REST};
use crate::live::cine::CineVolume;
use crate::picture::Picture;
use crate::scene::{Layout, Mode, Settings};
use crate::thumbnails::{Job, Thumbnails};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Most pictures: of a longer loop every second volume has one, or every third and so on.
const MOST: usize = 48;

/// Volumes for each picture of a loop of so many.
fn stride(count: usize) -> usize {
    count.div_ceil(MOST).max(1)
}

/// The thumbnails of the cine loop's volumes.
#[derive(Default)]
pub(super) struct Reel {
    thumbnails: Thumbnails,
    /// The numbers of the volumes, in the order of the pictures.
    volumes: Vec<u32>,
    /// Mode and layout of the thumbnails; others need new ones.
    look: Option<(Mode, Layout)>,
}

fn look_of(settings: &Settings) -> (Mode, Layout) {
    (settings.mode, settings.layout)
}

impl Reel {
    /// Collects thumbnails that are finished. `acted`: time of the user's last action. Returns true if there are new ones.
    pub(super) fn poll(&mut self, acted: Instant, is_drawing: bool, now: Instant) -> bool {
        self.thumbnails.poll(now >= acted + REST && !is_drawing)
    }

    /// For each volume of the cine loop its thumbnail; in a long loop that of the nearest earlier volume that has one. None if it is not drawn
    /// yet.
    pub(super) fn pictures(&self, volumes: &VecDeque<CineVolume>) -> Vec<Option<Arc<Picture>>> {
        let stride = stride(volumes.len());
        (0..volumes.len()).map(|n| self.picture(volumes.get(n - n % stride)?.volume)).collect()
    }

    fn picture(&self, volume: u32) -> Option<Arc<Picture>> {
        let at = self.volumes.iter().position(|made| *made == volume)?;
        self.thumbnails.pictures.get(at).cloned().flatten()
    }

    /// For each volume of the cine loop: true if it needs a thumbnail and has none in the present mode.
    pub(super) fn missing(&self, volumes: &VecDeque<CineVolume>, settings: &Settings) -> Vec<bool> {
        let is_same = self.look == Some(look_of(settings));
        let stride = stride(volumes.len());
        let is_missing = |of: &CineVolume| !is_same || !self.volumes.contains(&of.volume);
        volumes.iter().enumerate().map(|(n, of)| n % stride == 0 && is_missing(of)).collect()
    }

    /// True if thumbnails have to be drawn: the loop has several volumes, some lack one, and the user has paused.
    pub(super) fn wants(
        &self,
        volumes: &VecDeque<CineVolume>,
        settings: &Settings,
        acted: Instant,
        now: Instant,
    ) -> bool {
        let can_begin = volumes.len() > 1 && !self.thumbnails.is_working() && now >= acted + LONG_REST;
        can_begin && self.missing(volumes, settings).contains(&true)
    }

    /// Starts to draw the thumbnails of a job. Volumes without an entry in it keep theirs.
    pub(super) fn make(&mut self, job: Job, volumes: &VecDeque<CineVolume>, settings: &Settings) {
        let kept = volumes.iter().map(|of| self.picture(of.volume)).collect();
        self.volumes = volumes.iter().map(|of| of.volume).collect();
        self.look = Some(look_of(settings));
        self.thumbnails.begin(job);
        // `begin` discards the pictures that the job does not draw: they stay. The others stay until they are replaced.
        self.thumbnails.pictures = kept;
    }

    /// Discards the thumbnails, because their device is lost or another source has other volumes.
    pub(super) fn forget(&mut self) {
        self.thumbnails.keep_first(0);
        (self.volumes, self.look) = (Vec::new(), None);
    }

    pub(super) fn due(&self, now: Instant) -> Option<Instant> {
        self.thumbnails.is_working().then_some(now + Duration::from_millis(50))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a loop of hundreds of volumes with a texture for each.
    #[test]
    fn a_long_loop_has_a_bounded_number_of_pictures() {
        let volumes = |count: u32| -> VecDeque<CineVolume> {
            let numbered = |n| {
                let mut volume = CineVolume::default();
                volume.volume = n;
                volume
            };
            (0..count).map(numbered).collect()
        };
        let reel = Reel::default();
        let settings = Settings::default();
        for (count, wanted) in [(0, 0), (1, 1), (20, 20), (48, 48), (49, 25), (480, 48), (481, 44)] {
            let missing = reel.missing(&volumes(count), &settings);
            assert_eq!(missing.iter().filter(|is_missing| **is_missing).count(), wanted, "{count}");
            assert_eq!(reel.pictures(&volumes(count)).len(), count as usize);
        }
        let (now, later) = (Instant::now(), Instant::now() + LONG_REST);
        assert!(!reel.wants(&volumes(20), &settings, now, now) && reel.wants(&volumes(20), &settings, now, later));
        assert!(!reel.wants(&volumes(1), &settings, now, later), "one volume needs no line");
    }
}
