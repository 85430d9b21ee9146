//! Labels that the user edits: the label volume, its segments, and what a click or a drag does to it.

use super::texts;
use crate::probe::Grid;
use crate::scene::{LabelVolume, SharedLabels};
use crate::segment::{Brush, Labels, Patch, Shape, files};
use crate::source::segmentation::Segment;
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// What a click or a drag does to labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Effect {
    #[default]
    Paint,
    Erase,
    /// Labels the body at the end of the drag that is brighter than what is around it.
    GrowBright,
    /// Labels the body at the end of the drag that is darker than what is around it.
    GrowDark,
}

/// What the user can request of labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LabelCommand {
    Effect(Effect),
    /// True: the brush is a ball on planes, too. False: on planes it is a disc in the plane.
    Ball(bool),
    /// Chooses the label that is painted.
    Choose(u8),
    /// Adds a label, and chooses it.
    Add,
    /// Gives the chosen label to the body within the contours of the measurement with this index.
    Fill(usize),
    /// Moves the brush to this pixel of the picture: on the tile of planes with this index, or with None on the rendering. If the flag is true and
    /// the effect is [`Effect::Paint`], the brush erases.
    Stroke([f64; 2], Option<usize>, bool),
    /// Ends a stroke. If the effect grows, labels the body at the last place of the brush.
    EndStroke,
}

/// A label volume that is being edited.
#[derive(Clone, Debug)]
pub struct Labelling {
    labels: Arc<Labels>,
    /// Every label that the user can choose.
    segments: Vec<Segment>,
    /// From the index of a voxel to its place in space, mm.
    to_space: DAffine3,
    /// Number of voxels of each label; not those of the edit in progress.
    counts: Vec<usize>,
    pub(super) chosen: u8,
    pub(super) effect: Effect,
    pub(super) is_ball: bool,
    /// The labels before the edit in progress; None if there is none.
    before: Option<Arc<Labels>>,
    /// Whether the picture is to show other labels than it does.
    is_stale: bool,
}

impl Labelling {
    /// `to_space`: from the index of a voxel to its place in space, mm.
    pub(super) fn new(labels: Labels, mut segments: Vec<Segment>, to_space: DAffine3) -> Labelling {
        let counts = counts(&labels);
        let is_missing = |label: &u8| counts[usize::from(*label)] > 0 && segments.iter().all(|s| s.label != *label);
        let missing: Vec<u8> = (1..=u8::MAX).filter(is_missing).collect();
        segments.extend(missing.into_iter().map(|label| files::segment(label, texts::label(label))));
        let (chosen, labels) = (segments.first().map_or(1, |segment| segment.label), Arc::new(labels));
        if segments.is_empty() {
            segments.push(files::segment(chosen, texts::label(chosen)));
        }
        Labelling {
            labels,
            segments,
            to_space,
            counts,
            chosen,
            effect: Effect::default(),
            is_ball: true,
            before: None,
            is_stale: false,
        }
    }

    /// The labels with their segments, to be saved; None if no voxel has a label.
    pub(super) fn parts(&self) -> Option<(Arc<Labels>, Vec<Segment>)> {
        let is_labelled = self.counts.iter().skip(1).any(|count| *count > 0);
        is_labelled.then(|| (self.labels.clone(), self.segments.clone()))
    }

    /// The grid, and the map from space to its coordinates, both mm.
    pub(super) fn grid(&self) -> (Grid, DAffine3) {
        let grid = *self.labels.grid();
        let of_index = DAffine3::from_translation(grid.origin.into()) * DAffine3::from_scale(grid.spacing.into());
        (grid, of_index * self.to_space.inverse())
    }

    /// The number of voxels along each axis, and the map from the index of a voxel to space, mm.
    pub(super) fn lattice(&self) -> ([usize; 3], DAffine3) {
        (self.labels.grid().size, self.to_space)
    }

    /// Each segment with its volume, cm^3: the number of its voxels times the volume of one.
    pub fn volumes(&self) -> impl Iterator<Item = (&Segment, f64)> {
        let each = self.to_space.matrix3.determinant().abs() / 1000.0;
        self.segments.iter().map(move |segment| (segment, self.counts[usize::from(segment.label)] as f64 * each))
    }

    /// Adds a label, and chooses it. Returns false if there are 255.
    pub(super) fn add(&mut self) -> bool {
        let is_free = |label: &u8| self.segments.iter().all(|segment| segment.label != *label);
        let Some(label) = (1..=u8::MAX).find(is_free) else { return false };
        self.segments.push(files::segment(label, texts::label(label)));
        self.chosen = label;
        true
    }

    /// Paints the chosen label along a straight line between two places in space, mm, or erases it. Other labels are painted over, but not
    /// erased. `plane`: unit normal of the plane that the brush moves on, if it moves on one.
    pub(super) fn paint(&mut self, [from, to]: [DVec3; 2], radius: f64, plane: Option<DVec3>, erases: bool) {
        let (grid, to_grid) = self.grid();
        let shape = match plane.filter(|_| !self.is_ball) {
            None => Shape::Ball,
            Some(normal) => {
                let normal = to_grid.transform_vector3(normal).normalize();
                // Of every voxel that the plane goes through.
                Shape::Disc { normal, thickness: normal.abs().dot(grid.spacing.into()) }
            }
        };
        let [from, to] = [from, to].map(|place| to_grid.transform_point3(place));
        let (label, only) = if erases { (0, Some(self.chosen)) } else { (self.chosen, None) };
        let brush = Brush { from, to, radius, shape };
        let changed = self.edit(|labels| labels.paint(&brush, label, only));
        self.is_stale |= changed > 0;
    }

    /// Gives voxels a label, by their numbers; 0 removes it.
    pub(super) fn set(&mut self, voxels: &[u32], label: u8) {
        self.edit(|labels| labels.set(voxels, label));
        self.is_stale = true;
    }

    fn edit<T>(&mut self, change: impl FnOnce(&mut Labels) -> T) -> T {
        self.before.get_or_insert_with(|| self.labels.clone());
        change(Arc::make_mut(&mut self.labels))
    }

    /// Ends the edit in progress: what takes it back, None if nothing was changed.
    pub(super) fn end(&mut self) -> Option<Patch> {
        let patch = self.before.take()?.before(&self.labels)?;
        self.counts = counts(&self.labels);
        Some(patch)
    }

    /// Takes an edit back, or makes it again.
    pub(super) fn exchange(&mut self, patch: &mut Patch) {
        self.edit(|labels| labels.exchange(patch));
        (self.before, self.is_stale, self.counts) = (None, true, counts(&self.labels));
    }

    /// What the picture is to show from now on, if it shows other labels; the inner None is no label.
    pub(super) fn take_shown(&mut self) -> Option<Option<SharedLabels>> {
        let colour = |label| self.segments.iter().find(|segment| segment.label == label).map(|segment| segment.colour);
        let shown = || LabelVolume::new(self.labels.grid().size, self.labels.voxels(), self.to_space, colour);
        std::mem::take(&mut self.is_stale).then(|| shown().ok().map(SharedLabels::from))
    }
}

/// The number of voxels of each label.
fn counts(labels: &Labels) -> Vec<usize> {
    let mut counts = vec![0; 256];
    labels.voxels().iter().for_each(|label| counts[usize::from(*label)] += 1);
    counts
}
