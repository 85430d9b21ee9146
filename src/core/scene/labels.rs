//! The labels that a scene shows beside its echoes: a label for each voxel of a lattice that may lie anyhow in space.

use super::{Scene, insonified_box};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// Most voxels between the outermost ones that have a label.
const MAX_VOXELS: usize = 1 << 26;
/// Voxels around those with a label that are kept: the reach of the smoothing.
const MARGIN: usize = 2;
/// Weights of a voxel and of its neighbours along an axis, sixteenths: a binomial with a standard deviation of one voxel.
const WEIGHTS: [u16; 5] = [1, 4, 6, 4, 1];
/// The least cover of a voxel that has a label, and the most of one that has none: smoothing moves no voxel across the surface.
const COVERED: u8 = 144;
const OPEN: u8 = 255 - COVERED;
/// Colours of labels that have none of their own: those of Tableau 10, in the order in which neighbours differ most from echoes and each other.
const COLOURS: [u32; 10] =
    [0xff7f0e, 0x1f77b4, 0x2ca02c, 0xd62728, 0x9467bd, 0x17becf, 0xe377c2, 0xbcbd22, 0x8c564b, 0x7f7f7f];

/// The labels of the voxels of a lattice, 0 for none, and for each voxel the share of its surroundings that has a label.
#[derive(PartialEq)]
pub struct LabelVolume {
    /// Voxels of the box that holds all labels.
    pub(crate) size: [usize; 3],
    /// From a place in space, mm, to the fractional index of a voxel of the box.
    pub(crate) to_index: DAffine3,
    /// The label of each voxel of the box.
    pub(crate) ids: Vec<u8>,
    /// The share of the surroundings of each voxel that has a label, 255ths: above a half where the voxel has one.
    pub(crate) cover: Vec<u8>,
    /// Of each label, 0..=1.
    pub(crate) colours: Vec<[f64; 3]>,
}

/// Labels that copies of settings share. Two are equal only if they share one [`LabelVolume`] in memory, whatever it holds.
#[derive(Clone)]
pub struct SharedLabels(Arc<LabelVolume>);

impl PartialEq for SharedLabels {
    fn eq(&self, other: &SharedLabels) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl std::fmt::Debug for SharedLabels {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "labels of {:?} voxels", self.0.size)
    }
}

impl std::ops::Deref for SharedLabels {
    type Target = LabelVolume;

    fn deref(&self) -> &LabelVolume {
        &self.0
    }
}

impl From<LabelVolume> for SharedLabels {
    fn from(volume: LabelVolume) -> SharedLabels {
        SharedLabels(Arc::new(volume))
    }
}

impl LabelVolume {
    /// The labels of a lattice of `size` voxels. `voxels` has the label of each, x fastest, 0 for none. `to_space` maps the index of a voxel to the
    /// place of its centre, mm. `own` gives the colour of a label (0..=1), or None for one of the default colours.
    ///
    /// # Errors
    /// The end of a sentence about the labels: no voxel has one, the box around the labelled voxels has more than 2^26 voxels with a margin of two,
    /// `voxels` does not have `size`, or `to_space` has no inverse.
    pub fn new(
        size: [usize; 3],
        voxels: &[u8],
        to_space: DAffine3,
        own: impl Fn(u8) -> Option<[f64; 3]>,
    ) -> Result<LabelVolume, String> {
        let inverse = to_space.inverse();
        if voxels.len() != size.iter().product::<usize>() || !inverse.is_finite() {
            return Err("are on no lattice".into());
        }
        let row = size[0].max(1);
        let (mut low, mut high) = (size, [0; 3]);
        for (n, row) in voxels.chunks_exact(row).enumerate() {
            let is_set = |label: &u8| *label > 0;
            let (Some(first), Some(last)) = (row.iter().position(is_set), row.iter().rposition(is_set)) else {
                continue;
            };
            for (axis, [from, to]) in [[first, last], [n % size[1]; 2], [n / size[1]; 2]].into_iter().enumerate() {
                low[axis] = low[axis].min(from);
                high[axis] = high[axis].max(to + 1);
            }
        }
        if high[0] == 0 {
            return Err("label no voxel".into());
        }
        let low = low.map(|n| n.saturating_sub(MARGIN));
        let kept: [usize; 3] = std::array::from_fn(|axis| (high[axis] + MARGIN).min(size[axis]) - low[axis]);
        let count = kept.iter().fold(1, |all: usize, n| all.saturating_mul(*n));
        if count > MAX_VOXELS {
            let [x, y, z] = kept;
            return Err(format!("lie among {x} x {y} x {z} voxels: at most {MAX_VOXELS} are shown"));
        }
        let mut ids = Vec::with_capacity(count);
        for (z, y) in (0..kept[2]).flat_map(|z| (0..kept[1]).map(move |y| (z, y))) {
            let from = ((low[2] + z) * size[1] + low[1] + y) * size[0] + low[0];
            ids.extend(&voxels[from..from + kept[0]]);
        }
        let usual = |label: u8| COLOURS[(usize::from(label) + COLOURS.len() - 1) % COLOURS.len()];
        let usual = |label: u8| [16, 8, 0].map(|bits| f64::from(usual(label) >> bits & 255) / 255.0);
        let colours = (0..=255).map(|label| own(label).unwrap_or_else(|| usual(label))).collect();
        let first = DVec3::from(low.map(|n| n as f64));
        let to_index = DAffine3::from_translation(-first) * inverse;
        Ok(LabelVolume { size: kept, to_index, cover: covers(kept, &ids), ids, colours })
    }

    /// The edge of a voxel along its shortest axis, mm.
    pub(crate) fn voxel(&self) -> f64 {
        let axes = self.to_index.inverse().matrix3;
        (0..3).map(|n| axes.col(n).length()).fold(f64::INFINITY, f64::min)
    }

    /// True if the box around the labelled voxels and a margin of two voxels meets the box around the insonified region. Both are aligned with the
    /// axes of space.
    pub fn overlaps(&self, geometry: &crate::probe::Geometry) -> bool {
        let to_space = self.to_index.inverse();
        let last = DVec3::from(self.size.map(|n| n as f64 - 1.0));
        let corners = (0..8).map(|n| DVec3::new((n & 1) as f64, (n >> 1 & 1) as f64, (n >> 2) as f64) * last);
        let corners: Vec<DVec3> = corners.map(|at| to_space.transform_point3(at)).collect();
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let (seen_low, seen_high) = insonified_box(geometry);
        low.cmple(seen_high).all() && high.cmpge(seen_low).all()
    }
}

impl Scene {
    /// The labels that are drawn: none if nothing of them would be seen.
    pub(crate) fn labels(&self) -> Option<&LabelVolume> {
        let labels = &self.settings.labels;
        let on_planes = self.cuts_planes() && (labels.outline || labels.fill > 0.0);
        let in_space = !self.is_flat() && labels.shell > 0.0;
        labels.volume.as_deref().filter(|_| on_planes || in_space)
    }
}

/// The smoothed labels: a binomial along each axis. Beyond the box nothing has a label.
fn covers(size: [usize; 3], ids: &[u8]) -> Vec<u8> {
    let mut from: Vec<u16> = ids.iter().map(|label| u16::from(*label > 0)).collect();
    let mut to = vec![0; from.len()];
    let strides = [1, size[0], size[0] * size[1]];
    for axis in 0..3 {
        to.fill(0);
        for (tap, weight) in WEIGHTS.into_iter().enumerate() {
            // The voxels whose neighbour at this tap is in the box, in runs along the axes before this one.
            let (below, above) = (MARGIN.saturating_sub(tap), tap.saturating_sub(MARGIN));
            let stride = strides[axis];
            for first in (0..from.len()).step_by(stride * size[axis]) {
                let end = first + stride * size[axis];
                let Some(target) = to.get_mut(first + below * stride..end.saturating_sub(above * stride)) else {
                    continue;
                };
                let source = &from[first + above * stride..end - below * stride];
                target.iter_mut().zip(source).for_each(|(to, from)| *to += weight * from);
            }
        }
        std::mem::swap(&mut from, &mut to);
    }
    let cover = |(sum, label): (&u16, &u8)| {
        let share = ((u32::from(*sum) * 255 + 2048) >> 12) as u8;
        if *label > 0 { share.max(COVERED) } else { share.min(OPEN) }
    };
    from.iter().zip(ids).map(cover).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labelled(size: [usize; 3], label: impl Fn([usize; 3]) -> u8) -> Vec<u8> {
        let [width, height, depth] = size;
        let all = (0..width * height * depth).map(|n| [n % width, n / width % height, n / (width * height)]);
        all.map(label).collect()
    }

    #[test]
    fn the_box_holds_the_labels_and_stays_where_they_are() {
        let voxels = labelled([20, 12, 9], |[x, y, z]| u8::from((7..10).contains(&x) && y == 4 && (1..9).contains(&z)));
        let to_space = DAffine3::from_scale_rotation_translation(
            DVec3::new(0.5, 1.0, 2.0),
            glam::DQuat::from_rotation_y(0.7),
            DVec3::new(3.0, -4.0, 5.0),
        );
        let volume = LabelVolume::new([20, 12, 9], &voxels, to_space, |_| None).expect("labels");
        assert_eq!(volume.size, [7, 5, 9]);
        let place = to_space.transform_point3(DVec3::new(8.0, 4.0, 3.0));
        let index = volume.to_index.transform_point3(place);
        assert!(index.distance(DVec3::new(3.0, 2.0, 3.0)) < 1e-9, "{index}");
        assert_eq!(volume.ids[(3 * 5 + 2) * 7 + 3], 1);
        assert!((volume.voxel() - 0.5).abs() < 1e-9);
        assert!(LabelVolume::new([20, 12, 9], &vec![0; voxels.len()], to_space, |_| None).is_err());
    }

    /// Each weight is a product of three binomial ones; a voxel alone, and a wall, are where the bounds and the sums show.
    #[test]
    fn covers_are_products_of_binomials_and_never_cross_a_half() {
        let size = [9, 8, 7];
        let wall = labelled(size, |[x, ..]| u8::from(x >= 4));
        let cover = covers(size, &wall);
        let at = |[x, y, z]: [usize; 3]| f64::from(cover[(z * 8 + y) * 9 + x]);
        for (x, share) in [(1, 0.0_f64), (2, 1.0), (3, 5.0), (4, 11.0), (5, 15.0), (6, 16.0)] {
            let exact: f64 = 255.0 * share / 16.0;
            let bounded = if x >= 4 { exact.max(COVERED.into()) } else { exact.min(OPEN.into()) };
            assert!((at([x, 4, 3]) - bounded).abs() <= 0.5, "{x}: {} of {bounded}", at([x, 4, 3]));
        }
        // At an edge of the box, where three of the five weights along y are within it.
        assert!((at([6, 0, 3]) - 255.0 * 11.0 / 16.0).abs() <= 0.5);
        let one = covers(size, &labelled(size, |at| u8::from(at == [4, 4, 3])));
        assert_eq!(one[(3 * 8 + 4) * 9 + 4], COVERED);
        assert_eq!(one[(4 * 8 + 5) * 9 + 3], (255.0 * 64.0 / 4096.0_f64).round() as u8);
        assert!(one.iter().filter(|share| **share >= 128).count() == 1);
    }
}
