//! Small pictures of the volumes of the cine loop, for the line of time. They are made while the loop rests.

use super::presets::{LONG_REST, REST};
use crate::gpu::Wake;
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

/// The pictures, and what they are of.
pub(super) struct Reel {
    thumbnails: Thumbnails,
    /// The numbers of the volumes, in the order of the pictures.
    volumes: Vec<u32>,
    /// What a picture in another mode would not look like.
    look: Option<(Mode, Layout)>,
}

fn look_of(settings: &Settings) -> (Mode, Layout) {
    (settings.mode, settings.layout)
}

impl Reel {
    pub(super) fn new(wake: Wake) -> Reel {
        Reel { thumbnails: Thumbnails::new(wake), volumes: Vec::new(), look: None }
    }

    /// Goes on with the pictures; `acted`: when the user acted last. True if there are new ones.
    pub(super) fn poll(&mut self, acted: Instant, is_drawing: bool, now: Instant) -> bool {
        self.thumbnails.poll(now >= acted + REST && !is_drawing)
    }

    /// The picture of each volume of the loop, as far as it is made, or of the volume before it in a long loop.
    pub(super) fn pictures(&self, volumes: &VecDeque<CineVolume>) -> Vec<Option<Arc<Picture>>> {
        let stride = stride(volumes.len());
        (0..volumes.len()).map(|n| self.picture(volumes.get(n - n % stride)?.volume)).collect()
    }

    fn picture(&self, volume: u32) -> Option<Arc<Picture>> {
        let at = self.volumes.iter().position(|made| *made == volume)?;
        self.thumbnails.pictures().get(at).cloned().flatten()
    }

    /// For each volume of the loop, whether it is to have a picture and has none in the present mode.
    pub(super) fn missing(&self, volumes: &VecDeque<CineVolume>, settings: &Settings) -> Vec<bool> {
        let is_same = self.look == Some(look_of(settings));
        let stride = stride(volumes.len());
        let is_missing = |of: &CineVolume| !is_same || !self.volumes.contains(&of.volume);
        volumes.iter().enumerate().map(|(n, of)| n % stride == 0 && is_missing(of)).collect()
    }

    /// True if pictures are to be made: of several volumes, of which some have none, after a rest.
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

    /// Begins to make the pictures of a job, which has none for volumes whose picture stays.
    pub(super) fn make(&mut self, job: Job, volumes: &VecDeque<CineVolume>, settings: &Settings) {
        let kept = volumes.iter().map(|of| self.picture(of.volume)).collect();
        self.volumes = volumes.iter().map(|of| of.volume).collect();
        self.look = Some(look_of(settings));
        self.thumbnails.begin_with(job, kept);
    }

    /// The pictures are made again: their device is gone, or another source has other volumes.
    pub(super) fn forget(&mut self) {
        self.thumbnails.clear();
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
        let reel = Reel::new(Arc::new(|| ()));
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
