//! Which volume image a frame goes into and which one is shown, so that no picture ever shows slices of two volumes where volumes are
//! whole. Pure.

use serde::{Deserialize, Serialize};

/// How arriving frames become visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Update {
    /// A volume when all of its frames have come, whole: volume images take turns.
    #[default]
    Whole,
    /// Each frame at once, into the volume that is shown: its newest slices lie beside older ones.
    Rolling,
}

/// What became of volumes. Each that was heard of is counted once, when it is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VolumeCounts {
    /// Were shown; rolling: all of their frames came.
    pub shown: u64,
    /// Were whole and gave way to a newer one, or found no free image.
    pub dropped: u64,
    /// Ended with frames missing.
    pub incomplete: u64,
    /// Frames of volumes that were over, and of volumes that were dropped.
    pub left_out: u64,
}

/// A volume that may be shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ready {
    pub image: u32,
    pub volume: u32,
    /// By slice: whether it was swept backwards.
    pub backward: Vec<bool>,
}

/// The volume images of a stream.
pub struct VolumePool {
    update: Update,
    slices: usize,
    /// By image and slice: whether what is there was swept backwards.
    backward: Vec<Vec<bool>>,
    filling: Option<Filling>,
    ready: Option<Ready>,
    /// What waits to be shown was counted before.
    is_again: bool,
    /// The image that a volume is being sent into once more.
    again: Option<u32>,
    shown: Option<u32>,
    /// The newest volume that is over, whatever became of it.
    over: Option<u32>,
    counts: VolumeCounts,
}

struct Filling {
    volume: u32,
    /// None: there was no free image, and the volume is left out.
    image: Option<u32>,
    there: Vec<bool>,
    missing: usize,
}

impl VolumePool {
    /// `images`: volume images that take turns, at least two where volumes are whole; a rolling volume has one.
    pub fn new(update: Update, images: u32, slices: usize) -> VolumePool {
        let images = if update == Update::Whole { images.max(2) } else { 1 };
        VolumePool {
            update,
            slices,
            backward: vec![vec![false; slices]; images as usize],
            filling: None,
            ready: None,
            is_again: false,
            again: None,
            shown: None,
            over: None,
            counts: VolumeCounts::default(),
        }
    }

    /// What the images hold is gone: nothing of it will be shown.
    pub fn forget(&mut self) {
        self.end();
        self.counts.dropped += u64::from(self.is_waiting() && !self.is_again);
        (self.ready, self.shown, self.again) = (None, None, None);
    }

    /// Whether a whole volume waits to be shown.
    pub fn is_waiting(&self) -> bool {
        self.update == Update::Whole && self.ready.is_some()
    }

    /// The volume that waits to be shown; rolling: the newest that something waits of.
    pub fn waiting(&self) -> Option<u32> {
        self.ready.as_ref().map(|ready| ready.volume)
    }

    /// Whether there is anything new to show.
    pub fn has_new(&self) -> bool {
        self.ready.is_some()
    }

    pub fn is_rolling(&self) -> bool {
        self.update == Update::Rolling
    }

    /// How many volume images are used.
    pub fn images(&self) -> u32 {
        self.backward.len() as u32
    }

    /// VolumeCounts go on from those before another geometry or device; a volume of then that was not shown will not be.
    pub fn go_on_from(&mut self, mut before: VolumePool) {
        before.forget();
        (self.counts, self.over) = (before.counts, before.over);
    }

    /// Another source, which numbers its volumes anew.
    pub fn begin_anew(&mut self) {
        self.end();
        self.over = None;
    }

    /// An image for a volume that is sent once more, out of turn: none that is shown or being filled. A volume that waits to be shown
    /// gives way where there is no other. None where all are taken.
    pub fn spare(&mut self) -> Option<u32> {
        if self.is_rolling() {
            return Some(0);
        }
        let filling = self.filling.as_ref().and_then(|f| f.image);
        let ready = self.ready.as_ref().map(|r| r.image);
        self.again = (0..self.images()).find(|image| ![self.shown, filling, ready].contains(&Some(*image)));
        if self.again.is_none()
            && let Some(gone) = self.ready.take()
        {
            self.counts.dropped += u64::from(!self.is_again);
            self.again = Some(gone.image);
        }
        self.again
    }

    /// A volume that was sent once more is whole in the image that [`VolumePool::spare`] gave: it is shown next.
    pub fn put(&mut self, image: u32, volume: u32, backward: Vec<bool>) {
        self.backward[image as usize].clone_from(&backward);
        let before = self.ready.replace(Ready { image, volume, backward });
        self.counts.dropped += u64::from(!self.is_rolling() && before.is_some() && !self.is_again);
        (self.again, self.is_again) = (None, true);
    }

    pub fn counts(&self) -> VolumeCounts {
        self.counts
    }

    /// The image that a frame of this volume goes into; none where it is left out. Whether a volume that begins is `stale` already, and
    /// left out whole, is asked once.
    pub fn place(&mut self, volume: u32, stale: impl FnOnce() -> bool) -> Option<u32> {
        let of_now = self.filling.as_ref().map(|f| f.volume);
        if of_now != Some(volume) {
            if of_now.max(self.over).is_some_and(|newest| volume <= newest) {
                self.counts.left_out += 1;
                return None;
            }
            self.begin(volume, stale());
        }
        let image = self.filling.as_ref().and_then(|f| f.image);
        self.counts.left_out += u64::from(image.is_none());
        image
    }

    /// A newer volume: the one before it is over, whole or not.
    fn begin(&mut self, volume: u32, stale: bool) {
        self.end();
        let ready = self.ready.as_ref().map(|r| r.image);
        let taken = |image: &u32| [self.shown, self.again, ready].contains(&Some(*image));
        let free = match self.update {
            Update::Whole => (0..self.images()).find(|image| !taken(image)),
            Update::Rolling => Some(0),
        };
        let free = free.filter(|_| !stale);
        let there = vec![false; self.slices];
        self.filling = Some(Filling { volume, image: free, there, missing: self.slices });
    }

    /// No more frames of the volume that is being filled will come.
    pub fn end(&mut self) {
        let Some(Filling { volume, image, .. }) = self.filling.take() else { return };
        self.over = Some(volume);
        match image {
            Some(_) => self.counts.incomplete += 1,
            None => self.counts.dropped += 1,
        }
    }

    /// A frame has gone into the image that [`VolumePool::place`] said; true when its volume is whole with it.
    pub fn arrived(&mut self, slice: usize, backward: bool) -> bool {
        let Some(filling) = self.filling.as_mut().filter(|_| slice < self.slices) else { return false };
        let Some(image) = filling.image else { return false };
        filling.missing -= usize::from(!std::mem::replace(&mut filling.there[slice], true));
        let directions = &mut self.backward[image as usize];
        directions[slice] = backward;
        let (whole, volume) = (filling.missing == 0, filling.volume);
        if whole || self.update == Update::Rolling {
            let before = self.ready.replace(Ready { image, volume, backward: directions.clone() });
            self.counts.dropped += u64::from(self.update == Update::Whole && before.is_some() && !self.is_again);
            self.is_again = false;
        }
        if whole {
            self.filling = None;
            self.over = Some(volume);
            self.counts.shown += u64::from(self.update == Update::Rolling);
        }
        whole
    }

    /// What to show next, if there is anything new. No picture of what was shown before may be on its way any more: its image is
    /// free from here on.
    pub fn take(&mut self) -> Option<Ready> {
        let ready = self.ready.take()?;
        self.shown = Some(ready.image);
        self.counts.shown += u64::from(self.update == Update::Whole && !self.is_again);
        Some(ready)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What a picture would show: the volume that each slice of each image carries.
    struct Model {
        turns: VolumePool,
        carries: Vec<Vec<u32>>,
        seen: Vec<u32>,
    }

    impl Model {
        fn new(update: Update, images: u32) -> Model {
            let turns = VolumePool::new(update, images, 4);
            let carries = vec![vec![u32::MAX; 4]; turns.images() as usize];
            Model { turns, carries, seen: Vec::new() }
        }

        fn frame(&mut self, volume: u32, slice: usize) {
            if let Some(image) = self.turns.place(volume, || false) {
                self.carries[image as usize][slice] = volume;
                self.turns.arrived(slice, volume % 2 == 1);
            }
        }

        /// The image stays as it is while it is drawn.
        fn draw(&mut self) -> Option<Ready> {
            let ready = self.turns.take()?;
            self.seen.push(ready.volume);
            Some(ready)
        }
    }

    proptest! {
        /// Frames of volumes that come in order, some lost, some twice, and pictures that begin at any time and take any time.
        #[test]
        fn a_whole_volume_is_never_mixed_and_each_is_counted_once(
            images in 2u32..=3,
            events in prop::collection::vec((0u32..3, 0usize..4, 0u8..4), 1..120),
        ) {
            let mut model = Model::new(Update::Whole, images);
            let (mut volume, mut drawing, mut heard) = (0, None::<Ready>, std::collections::BTreeSet::new());
            for (step, slice, what) in events {
                match what {
                    0 => drawing = model.draw().or(drawing),
                    _ => {
                        volume += u32::from(step == 2);
                        let slices = if step == 0 { 0..4 } else { slice..slice + 1 };
                        heard.insert(volume);
                        slices.for_each(|slice| model.frame(volume, slice));
                    }
                }
                if let Some(drawn) = &drawing {
                    let image = &model.carries[drawn.image as usize];
                    prop_assert!(image.iter().all(|v| *v == drawn.volume), "{:?} shows {:?}", drawn, image);
                    prop_assert!(drawn.backward.iter().all(|b| *b == (drawn.volume % 2 == 1)));
                }
            }
            model.turns.end();
            let waiting = u64::from(model.turns.ready.is_some());
            let VolumeCounts { shown, dropped, incomplete, .. } = model.turns.counts();
            prop_assert_eq!(shown + dropped + incomplete + waiting, heard.len() as u64);
            prop_assert!(model.seen.windows(2).all(|w| w[0] < w[1]), "{:?}", model.seen);
        }
    }

    #[test]
    fn a_rolling_volume_shows_each_frame_and_keeps_what_was_there() {
        let mut model = Model::new(Update::Rolling, 3);
        (0..4).for_each(|slice| model.frame(0, slice));
        model.frame(1, 3);
        let ready = model.draw().expect("something new");
        assert_eq!((ready.volume, ready.backward.as_slice()), (1, &[false, false, false, true][..]));
        assert_eq!(model.carries, [[0, 0, 0, 1]]);
        assert_eq!(model.draw(), None, "nothing has come since");
        model.frame(0, 1);
        assert_eq!(model.carries, [[0, 0, 0, 1]], "a late frame does not put an old slice beside new ones");
        assert_eq!(model.turns.counts(), VolumeCounts { shown: 1, left_out: 1, ..VolumeCounts::default() });
    }

    #[test]
    fn a_volume_that_is_stale_when_it_begins_is_left_out_whole() {
        let mut turns = VolumePool::new(Update::Whole, 3, 2);
        assert_eq!(turns.place(0, || true), None);
        assert_eq!(turns.place(0, || panic!("was asked")), None);
        assert_eq!(turns.place(1, || false), Some(0));
        assert_eq!(turns.counts(), VolumeCounts { dropped: 1, left_out: 2, ..VolumeCounts::default() });
    }

    #[test]
    fn without_a_free_image_a_volume_is_left_out_whole() {
        let mut model = Model::new(Update::Whole, 2);
        (0..4).for_each(|slice| model.frame(0, slice));
        model.draw();
        (0..4).for_each(|slice| model.frame(1, slice));
        model.frame(2, 0);
        // The first picture is done now, but volume 2 has lost a frame already.
        assert_eq!(model.draw().map(|r| r.volume), Some(1));
        (1..4).for_each(|slice| model.frame(2, slice));
        assert_eq!(model.draw(), None);
        (0..4).for_each(|slice| model.frame(3, slice));
        assert_eq!(model.draw().map(|r| r.volume), Some(3));
        assert_eq!(model.turns.counts(), VolumeCounts { shown: 3, dropped: 1, incomplete: 0, left_out: 4 });
    }

    #[test]
    fn a_volume_sent_once_more_takes_an_image_that_nothing_else_uses_and_counts_once() {
        let mut turns = VolumePool::new(Update::Whole, 3, 2);
        let fill = |turns: &mut VolumePool, volume: u32| {
            let image = turns.place(volume, || false);
            (0..2).for_each(|slice| {
                turns.arrived(slice, false);
            });
            image
        };
        fill(&mut turns, 0);
        let shown = turns.take().expect("whole").image;
        let again = turns.spare().expect("free");
        assert_ne!(again, shown);
        // While it is being sent another volume comes: into the third image.
        let third = turns.place(1, || false).expect("free");
        assert!(third != again && third != shown);
        turns.put(again, 0, vec![true; 2]);
        assert_eq!(turns.take(), Some(Ready { image: again, volume: 0, backward: vec![true; 2] }));
        assert_eq!(turns.counts(), VolumeCounts { shown: 1, ..VolumeCounts::default() });
        (0..2).for_each(|slice| {
            turns.arrived(slice, false);
        });
        assert_eq!(turns.take().map(|r| r.volume), Some(1));
        assert_eq!(turns.counts(), VolumeCounts { shown: 2, ..VolumeCounts::default() });
    }

    #[test]
    fn another_source_may_count_from_nought_again() {
        let mut turns = VolumePool::new(Update::Whole, 3, 1);
        turns.place(7, || false);
        turns.arrived(0, false);
        assert_eq!(turns.place(0, || false), None);
        turns.begin_anew();
        assert!(turns.place(0, || false).is_some());
    }
}
