//! The volume images of a renderer: which one pictures show, which slices passes must process again, and what the CPU found in them.

use crate::error::GpuError;
use crate::passes::Slot;
use crate::passes::slots::Search;
use crate::passes::unveil::Unveiled;
use crate::plan::{Step, affected};
use crate::scene::{Scene, VisibleBounds};
use std::ops::Range;

/// Which slices of each volume image the passes over the volume have yet to process, and what the CPU has found in each volume image.
pub(super) struct Volumes {
    count: u32,
    /// The index of the volume image that pictures show.
    pub shown: u32,
    /// By volume image and slice: the passes over the volume have not processed it yet.
    unprocessed: Vec<Vec<bool>>,
    /// The texels of every frame that stage 1 filters, as last noted; at first those visible at the start.
    pub filtered: VisibleBounds,
    /// What the CPU found and the device has: the slot that holds it, and the volume image that it was found in.
    found: Vec<(Slot, u32)>,
    /// By volume image: what the CPU found of its volume, where the render start follows the fluid.
    pub unveiled: Vec<Option<Unveiled>>,
}

impl Volumes {
    /// `count` volume images, none of whose slices is processed.
    pub fn new(count: u32, scene: &Scene) -> Volumes {
        let mut volumes = Volumes {
            count,
            shown: 0,
            unprocessed: Vec::new(),
            filtered: scene.visible_bounds,
            found: Vec::new(),
            unveiled: vec![None; count as usize],
        };
        volumes.invalidate(scene);
        volumes
    }

    /// Checks that a volume image exists.
    ///
    /// # Errors
    /// It does not.
    pub fn check(&self, image: u32) -> Result<(), GpuError> {
        if image < self.count { Ok(()) } else { Err(GpuError::VolumeImage { image, images: self.count }) }
    }

    /// Marks every slice of every volume image as not processed.
    pub fn invalidate(&mut self, scene: &Scene) {
        self.unprocessed = vec![vec![true; scene.slices() as usize]; self.count as usize];
    }

    /// Notes that a new frame replaces a slice of a volume image: passes over the volume have to process the slice, and the CPU has to search the
    /// image again.
    pub fn replaced(&mut self, image: u32, slice: u32) {
        self.unprocessed[image as usize][slice as usize] = true;
        self.found.retain(|(_, of)| *of != image);
    }

    /// The ranges of visible slices of the shown volume image that a pass over the volume has to process.
    pub(crate) fn due_slices(&self, step: &Step, scene: &Scene) -> Vec<Range<u32>> {
        let (low, high) = (scene.visible_bounds.low[2], scene.visible_bounds.high[2]);
        let runs = affected(&self.unprocessed[self.shown as usize], step.reach(scene)).into_iter();
        runs.map(|run| run.start.max(low)..run.end.min(high)).filter(|run| !run.is_empty()).collect()
    }

    /// Notes that all passes over the volume have processed the shown volume image.
    pub fn processed(&mut self) {
        self.unprocessed[self.shown as usize].fill(false);
    }

    /// The searches that the CPU has to make in the shown volume image before this step runs over it, each with the slot for its result. Results that
    /// these or the step will replace count as not found.
    pub(crate) fn due_searches(&mut self, step: &Step, scene: &Scene) -> Vec<(Slot, Search)> {
        let (shown, writes) = (self.shown, step.writes(scene));
        let reads = step.reads(scene).into_iter().filter_map(|slot| Some((slot, slot.search()?)));
        let due: Vec<_> = reads.filter(|(slot, _)| !self.found.contains(&(*slot, shown))).collect();
        self.found.retain(|(slot, image)| {
            // Nothing is known of what is about to be replaced, should this picture fail.
            let is_replaced = due.iter().any(|(due, _)| due == slot) && (*image == shown || !slot.is_multibuffered());
            // In a volume that changes it is looked for again.
            let changes = *image == shown && slot.search().is_some_and(|search| writes.contains(&search.within));
            !is_replaced && !changes
        });
        due
    }

    /// Notes that these slots hold what the CPU searched for in the shown volume image.
    pub fn found(&mut self, slots: &[Slot]) {
        self.found.retain(|(slot, _)| slot.is_multibuffered() || !slots.contains(slot));
        self.found.extend(slots.iter().map(|slot| (*slot, self.shown)));
    }

    /// Keeps the results of searches only in the slots for which `keeps` is true.
    pub(crate) fn keep_found(&mut self, keeps: impl Fn(Slot) -> bool) {
        self.found.retain(|(slot, _)| keeps(*slot));
    }

    /// The start surface that the CPU last found in the shown volume image. None if there is none.
    pub fn unveiled(&self) -> Option<&Unveiled> {
        self.unveiled[self.shown as usize].as_ref()
    }
}
