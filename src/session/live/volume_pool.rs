//! Assigns volume images: which one a frame goes into, and which one is shown. If volumes are shown whole, no picture mixes slices of two
//! volumes. It has no side effects.

use crate::tree::{FromNode, ToNode};

/// How arriving frames become visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ToNode, FromNode)]
#[tree(rename_all = "lowercase")]
pub enum Update {
    /// A volume becomes visible when all its frames have arrived. Several volume images are used in rotation.
    #[default]
    Whole,
    /// Each frame becomes visible at once, in the volume that is shown, next to slices of the previous sweep.
    Rolling,
}

/// Numbers of volumes. Each volume is counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VolumeCounts {
    /// Number of volumes that were shown; of rolling ones those that were complete.
    pub shown: u64,
    /// Number of volumes that were not shown, for example because a newer one or changed settings replaced them, or no volume image was free.
    pub dropped: u64,
    /// Number of volumes that ended with frames missing, dropped ones not included.
    pub incomplete: u64,
    /// Number of frames (not volumes) that arrived for a volume that had ended or was dropped.
    pub left_out: u64,
}

/// A volume that can be shown, and the volume image that holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ready {
    pub image: u32,
    pub volume: u32,
    /// For each slice: true if it was swept backwards.
    pub backward: Vec<bool>,
}

/// Decides which volume image each frame goes to, and which one is shown.
pub(crate) struct VolumePool {
    update: Update,
    slices: usize,
    /// By image and slice: true if the frame in it was swept backwards.
    backward: Vec<Vec<bool>>,
    filling: Option<Filling>,
    ready: Option<Ready>,
    /// The volume in `ready` was counted before: it is a replay.
    is_replay: bool,
    /// The image that a replayed volume is being sent into.
    replay: Option<u32>,
    shown: Option<u32>,
    /// The newest volume that is over, complete or not.
    over: Option<u32>,
    counts: VolumeCounts,
}

struct Filling {
    volume: u32,
    /// None: there was no free image; the volume is left out.
    image: Option<u32>,
    arrived: Vec<bool>,
    missing: usize,
}

impl VolumePool {
    /// `images`: number of volume images in rotation; at least two are used for whole volumes, always one for a rolling one. `slices`: frames a
    /// volume.
    pub fn new(update: Update, images: u32, slices: usize) -> VolumePool {
        let images = if update == Update::Whole { images.max(2) } else { 1 };
        VolumePool {
            update,
            slices,
            backward: vec![vec![false; slices]; images as usize],
            filling: None,
            ready: None,
            is_replay: false,
            replay: None,
            shown: None,
            over: None,
            counts: VolumeCounts::default(),
        }
    }

    /// Discards the contents of all volume images.
    pub fn forget(&mut self) {
        self.end();
        self.counts.dropped += u64::from(self.is_waiting() && !self.is_replay);
        (self.ready, self.shown, self.replay) = (None, None, None);
    }

    /// True if a complete volume waits to be shown; never for rolling volumes.
    pub fn is_waiting(&self) -> bool {
        self.update == Update::Whole && self.ready.is_some()
    }

    /// Number of the volume that waits to be shown; with rolling volumes, of the newest that has a slice that was not shown. None if there is
    /// none.
    pub fn waiting(&self) -> Option<u32> {
        self.ready.as_ref().map(|ready| ready.volume)
    }

    /// True if there is anything new to show.
    pub(crate) fn has_new(&self) -> bool {
        self.ready.is_some()
    }

    pub(crate) fn is_rolling(&self) -> bool {
        self.update == Update::Rolling
    }

    /// Number of volume images.
    pub fn images(&self) -> u32 {
        self.backward.len() as u32
    }

    /// Takes over the counts of the pool of another geometry or device. Its volumes that were not shown count as dropped.
    pub(crate) fn continue_from(&mut self, mut previous: VolumePool) {
        previous.forget();
        (self.counts, self.over) = (previous.counts, previous.over);
    }

    /// Prepares for another source, which may number its volumes from 0 again.
    pub(crate) fn restart_numbering(&mut self) {
        self.end();
        self.over = None;
    }

    /// Index of a volume image for a replayed volume: one that is neither on display nor being filled nor waiting to be shown. If there is none, the
    /// volume that waits to be shown is dropped for it; None if no volume waits. Of rolling volumes it is always image 0.
    pub fn spare(&mut self) -> Option<u32> {
        if self.is_rolling() {
            return Some(0);
        }
        let filling = self.filling.as_ref().and_then(|f| f.image);
        let ready = self.ready.as_ref().map(|r| r.image);
        self.replay = (0..self.images()).find(|image| ![self.shown, filling, ready].contains(&Some(*image)));
        if self.replay.is_none()
            && let Some(replaced) = self.ready.take()
        {
            self.counts.dropped += u64::from(!self.is_replay);
            self.replay = Some(replaced.image);
        }
        self.replay
    }

    /// Notes that a replayed volume is complete in the volume image that [`VolumePool::spare`] gave; it is shown next. `backward`: for each
    /// slice, true if it was swept backwards.
    pub fn put(&mut self, image: u32, volume: u32, backward: Vec<bool>) {
        self.backward[image as usize].clone_from(&backward);
        let replaced = self.ready.replace(Ready { image, volume, backward });
        self.counts.dropped += u64::from(!self.is_rolling() && replaced.is_some() && !self.is_replay);
        (self.replay, self.is_replay) = (None, true);
    }

    pub fn counts(&self) -> VolumeCounts {
        self.counts
    }

    /// Index of the volume image that a frame of this volume goes to. None if the frame is left out. `stale` is called once for each new volume:
    /// if it returns true, the whole volume is left out, because newer ones have arrived.
    pub fn place(&mut self, volume: u32, stale: impl FnOnce() -> bool) -> Option<u32> {
        let current = self.filling.as_ref().map(|f| f.volume);
        if current != Some(volume) {
            if current.max(self.over).is_some_and(|newest| volume <= newest) {
                self.counts.left_out += 1;
                return None;
            }
            self.begin(volume, stale());
        }
        let image = self.filling.as_ref().and_then(|f| f.image);
        self.counts.left_out += u64::from(image.is_none());
        image
    }

    /// A newer volume begins: the previous one is over, complete or not.
    fn begin(&mut self, volume: u32, stale: bool) {
        self.end();
        let ready = self.ready.as_ref().map(|r| r.image);
        let taken = |image: &u32| [self.shown, self.replay, ready].contains(&Some(*image));
        let free = match self.update {
            Update::Whole => (0..self.images()).find(|image| !taken(image)),
            Update::Rolling => Some(0),
        };
        let free = free.filter(|_| !stale);
        let arrived = vec![false; self.slices];
        self.filling = Some(Filling { volume, image: free, arrived, missing: self.slices });
    }

    /// Ends the volume that is being filled, because no more of its frames will arrive.
    pub fn end(&mut self) {
        let Some(Filling { volume, image, .. }) = self.filling.take() else { return };
        self.over = Some(volume);
        match image {
            Some(_) => self.counts.incomplete += 1,
            None => self.counts.dropped += 1,
        }
    }

    /// Counts a volume as dropped that was complete although no frame of it was stored.
    pub(crate) fn pass_over(&mut self, volume: u32) {
        if self.over < Some(volume) {
            (self.over, self.counts.dropped) = (Some(volume), self.counts.dropped + 1);
        }
    }

    /// Notes that a frame is in the volume image that [`VolumePool::place`] gave. Returns true if it completes its volume.
    pub fn arrived(&mut self, slice: usize, backward: bool) -> bool {
        let Some(filling) = self.filling.as_mut().filter(|_| slice < self.slices) else { return false };
        let Some(image) = filling.image else { return false };
        filling.missing -= usize::from(!std::mem::replace(&mut filling.arrived[slice], true));
        let directions = &mut self.backward[image as usize];
        directions[slice] = backward;
        let (is_complete, volume) = (filling.missing == 0, filling.volume);
        if is_complete || self.update == Update::Rolling {
            let replaced = self.ready.replace(Ready { image, volume, backward: directions.clone() });
            self.counts.dropped += u64::from(self.update == Update::Whole && replaced.is_some() && !self.is_replay);
            self.is_replay = false;
        }
        if is_complete {
            self.filling = None;
            self.over = Some(volume);
            self.counts.shown += u64::from(self.update == Update::Rolling);
        }
        is_complete
    }

    /// Takes the next volume to show; None if there is no new one. The volume image that was shown before becomes free, so that the caller must have
    /// no picture of it in flight.
    pub fn take(&mut self) -> Option<Ready> {
        let ready = self.ready.take()?;
        self.shown = Some(ready.image);
        self.counts.shown += u64::from(self.update == Update::Whole && !self.is_replay);
        Some(ready)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A pool, and the volume that each slice of each image holds.
    struct Model {
        pool: VolumePool,
        held: Vec<Vec<u32>>,
        shown: Vec<u32>,
    }

    impl Model {
        fn new(update: Update, images: u32) -> Model {
            let pool = VolumePool::new(update, images, 4);
            let held = vec![vec![u32::MAX; 4]; pool.images() as usize];
            Model { pool, held, shown: Vec::new() }
        }

        fn frame(&mut self, volume: u32, slice: usize) {
            if let Some(image) = self.pool.place(volume, || false) {
                self.held[image as usize][slice] = volume;
                self.pool.arrived(slice, volume % 2 == 1);
            }
        }

        /// Begins a picture.
        fn draw(&mut self) -> Option<Ready> {
            let ready = self.pool.take()?;
            self.shown.push(ready.volume);
            Some(ready)
        }
    }

    proptest! {
        /// Volumes arrive in order, with some frames lost or repeated; pictures begin at any time and take any time.
        #[test]
        fn a_whole_volume_is_never_mixed_and_each_is_counted_once(
            images in 2u32..=3,
            events in prop::collection::vec((0u32..3, 0usize..4, 0u8..4), 1..120),
        ) {
            let mut model = Model::new(Update::Whole, images);
            let (mut volume, mut drawing, mut begun) = (0, None::<Ready>, std::collections::BTreeSet::new());
            for (step, slice, what) in events {
                match what {
                    0 => drawing = model.draw().or(drawing),
                    _ => {
                        volume += u32::from(step == 2);
                        let slices = if step == 0 { 0..4 } else { slice..slice + 1 };
                        begun.insert(volume);
                        slices.for_each(|slice| model.frame(volume, slice));
                    }
                }
                if let Some(drawn) = &drawing {
                    let image = &model.held[drawn.image as usize];
                    prop_assert!(image.iter().all(|v| *v == drawn.volume), "{:?} shows {:?}", drawn, image);
                    prop_assert!(drawn.backward.iter().all(|b| *b == (drawn.volume % 2 == 1)));
                }
            }
            model.pool.end();
            let waiting = u64::from(model.pool.ready.is_some());
            let VolumeCounts { shown, dropped, incomplete, .. } = model.pool.counts();
            prop_assert_eq!(shown + dropped + incomplete + waiting, begun.len() as u64);
            prop_assert!(model.shown.windows(2).all(|w| w[0] < w[1]), "{:?}", model.shown);
        }
    }

    #[test]
    fn a_rolling_volume_shows_each_frame_and_keeps_what_was_there() {
        let mut model = Model::new(Update::Rolling, 3);
        (0..4).for_each(|slice| model.frame(0, slice));
        model.frame(1, 3);
        let ready = model.draw().expect("something new");
        assert_eq!((ready.volume, ready.backward.as_slice()), (1, &[false, false, false, true][..]));
        assert_eq!(model.held, [[0, 0, 0, 1]]);
        assert_eq!(model.draw(), None, "nothing has come since");
        model.frame(0, 1);
        assert_eq!(model.held, [[0, 0, 0, 1]], "a late frame does not put an old slice next to new ones");
        assert_eq!(model.pool.counts(), VolumeCounts { shown: 1, left_out: 1, ..VolumeCounts::default() });
    }

    #[test]
    fn a_volume_that_is_stale_when_it_begins_is_left_out_whole() {
        let mut pool = VolumePool::new(Update::Whole, 3, 2);
        assert_eq!(pool.place(0, || true), None);
        assert_eq!(pool.place(0, || panic!("was asked")), None);
        assert_eq!(pool.place(1, || false), Some(0));
        assert_eq!(pool.counts(), VolumeCounts { dropped: 1, left_out: 2, ..VolumeCounts::default() });
    }

    #[test]
    fn without_a_free_image_a_volume_is_left_out_whole() {
        let mut model = Model::new(Update::Whole, 2);
        (0..4).for_each(|slice| model.frame(0, slice));
        model.draw();
        (0..4).for_each(|slice| model.frame(1, slice));
        model.frame(2, 0);
        // An image is free now, but volume 2 has already lost a frame.
        assert_eq!(model.draw().map(|r| r.volume), Some(1));
        (1..4).for_each(|slice| model.frame(2, slice));
        assert_eq!(model.draw(), None);
        (0..4).for_each(|slice| model.frame(3, slice));
        assert_eq!(model.draw().map(|r| r.volume), Some(3));
        assert_eq!(model.pool.counts(), VolumeCounts { shown: 3, dropped: 1, incomplete: 0, left_out: 4 });
    }

    #[test]
    fn a_replayed_volume_takes_an_unused_image_and_is_counted_once() {
        let mut pool = VolumePool::new(Update::Whole, 3, 2);
        let fill = |pool: &mut VolumePool, volume: u32| {
            let image = pool.place(volume, || false);
            (0..2).for_each(|slice| {
                pool.arrived(slice, false);
            });
            image
        };
        fill(&mut pool, 0);
        let shown = pool.take().expect("whole").image;
        let again = pool.spare().expect("free");
        assert_ne!(again, shown);
        // A volume that arrives meanwhile goes into the third image.
        let third = pool.place(1, || false).expect("free");
        assert!(third != again && third != shown);
        pool.put(again, 0, vec![true; 2]);
        assert_eq!(pool.take(), Some(Ready { image: again, volume: 0, backward: vec![true; 2] }));
        assert_eq!(pool.counts(), VolumeCounts { shown: 1, ..VolumeCounts::default() });
        (0..2).for_each(|slice| {
            pool.arrived(slice, false);
        });
        assert_eq!(pool.take().map(|r| r.volume), Some(1));
        assert_eq!(pool.counts(), VolumeCounts { shown: 2, ..VolumeCounts::default() });
    }

    #[test]
    fn another_source_may_number_from_zero_again() {
        let mut pool = VolumePool::new(Update::Whole, 3, 1);
        pool.place(7, || false);
        pool.arrived(0, false);
        assert_eq!(pool.place(0, || false), None);
        pool.restart_numbering();
        assert!(pool.place(0, || false).is_some());
    }
}
