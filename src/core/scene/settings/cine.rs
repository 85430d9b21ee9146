//! Settings of the cine loop: its first and last volume, its speed and its direction. No pass reads them.

use crate::scene::number::Allowed::Range;
use crate::scene::number::{Number, number};
use crate::tree::{Defaults, FromNode, ToNode};

/// The cine loop. The viewer plays it; `render --volumes loop` draws it.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Cine {
    /// The first volume that is played, by its number in the recording, from 0. Absent: the first one.
    pub first: Option<u32>,
    /// The last volume that is played. Absent: the last one.
    pub last: Option<u32>,
    /// How fast the viewer plays it, as a multiple of the speed of the acquisition, 0.1..=8.
    #[value(1.0)]
    pub speed: f64,
    /// The loop is played to its last volume and back, also in a film. Otherwise it begins again after the last volume.
    pub back_and_forth: bool,
}

impl Cine {
    /// The numbers of the volumes that are played, ascending, for a recording of `count` volumes. Empty if `first` lies beyond the last volume, or
    /// after `last`; a `last` beyond the last volume counts as that one.
    pub fn volumes(&self, count: usize) -> Vec<usize> {
        let first = self.first.map_or(0, |first| first as usize);
        let last = self.last.map_or(count.saturating_sub(1), |last| last as usize);
        (first..count.min(last.saturating_add(1))).collect()
    }

    /// The numbers of the volumes in the order of a film that is repeated. If the loop is played back and forth, it includes the way back, and each
    /// end is there once.
    pub fn film(&self, count: usize) -> Vec<usize> {
        let mut order = self.volumes(count);
        if self.back_and_forth {
            let between = order.get(1..order.len().saturating_sub(1)).unwrap_or_default();
            order.extend(between.to_vec().iter().rev());
        }
        order
    }
}

pub(super) const NUMBERS: &[Number] = &[number!([drawn] cine.speed, "", Range(0.1, 8.0))];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_repeats_without_a_volume_twice() {
        let forth = Cine { first: Some(2), last: Some(5), ..Cine::default() };
        assert_eq!((forth.volumes(9), forth.film(9)), (vec![2, 3, 4, 5], vec![2, 3, 4, 5]));
        let back = Cine { back_and_forth: true, ..forth };
        assert_eq!((back.volumes(9), back.film(9)), (vec![2, 3, 4, 5], vec![2, 3, 4, 5, 4, 3]));
        assert_eq!(back.film(4), [2, 3], "of two, none is between");
        assert!(back.film(2).is_empty(), "the loop begins behind the recording");
        let all = Cine { back_and_forth: true, ..Cine::default() };
        assert_eq!((all.film(3), all.film(1), all.film(0)), (vec![0, 1, 2, 1], vec![0], vec![]));
    }
}
