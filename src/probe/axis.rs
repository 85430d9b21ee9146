//! Positions of the scan lines of a frame, or of the slices of a sweep, along their axis.

use crate::tree::{FromNode, ToNode};

/// Strictly increasing positions along an axis, one for each index: angles in rad or lengths in mm.
///
/// The inverse of a uniform axis is `(v - first) / pitch`. A table of positions, as Kretz files have it, is inverted by bracketing and linear
/// interpolation.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
pub enum Axis {
    /// Uniformly spaced: `first + pitch * index`.
    Even { first: f64, pitch: f64, count: usize },
    /// One position for each index, of any spacing.
    Table(Vec<f64>),
}

impl Axis {
    /// `count` positions centred on zero.
    pub fn centred(pitch: f64, count: usize) -> Axis {
        let first = -pitch * (count.saturating_sub(1)) as f64 / 2.0;
        Axis::Even { first, pitch, count }
    }

    /// An axis of the given positions: uniform if they are so to within 1e-9 of their span, since many files store uniform positions as tables.
    pub fn from_table(table: Vec<f64>) -> Axis {
        let count = table.len();
        if count < 2 {
            return Axis::Even { first: table.first().copied().unwrap_or(0.0), pitch: 1.0, count };
        }
        let (first, last) = (table[0], table[count - 1]);
        let pitch = (last - first) / (count - 1) as f64;
        let even =
            table.iter().enumerate().all(|(i, v)| (v - first - pitch * i as f64).abs() <= 1e-9 * (last - first).abs());
        if even { Axis::Even { first, pitch, count } } else { Axis::Table(table) }
    }

    /// Number of positions.
    pub fn len(&self) -> usize {
        match self {
            Axis::Even { count, .. } => *count,
            Axis::Table(table) => table.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// First position; 0 of an empty table.
    pub fn first(&self) -> f64 {
        self.at(0.0)
    }

    /// Last position; 0 of an empty table.
    pub fn last(&self) -> f64 {
        self.at(self.len().saturating_sub(1) as f64)
    }

    /// Largest distance of a position from zero, by the first and the last.
    pub(crate) fn outermost(&self) -> f64 {
        self.first().abs().max(self.last().abs())
    }

    /// Mean distance between neighbours; 0 for fewer than two positions.
    pub fn pitch(&self) -> f64 {
        match self {
            Axis::Even { pitch, count, .. } if *count > 1 => *pitch,
            Axis::Table(table) if table.len() > 1 => (self.last() - self.first()) / (table.len() - 1) as f64,
            _ => 0.0,
        }
    }

    /// Position at a fractional index. Beyond both ends it is extrapolated linearly.
    pub fn at(&self, index: f64) -> f64 {
        match self {
            Axis::Even { first, pitch, .. } => first + pitch * index,
            Axis::Table(table) => interpolated(table, index),
        }
    }

    /// Fractional index of a position: the inverse of [`Axis::at`], also beyond both ends. NaN gives NaN.
    pub fn index_of(&self, position: f64) -> f64 {
        match self {
            Axis::Even { first, pitch, .. } => (position - first) / pitch,
            Axis::Table(table) if table.len() < 2 => position - self.first(),
            Axis::Table(table) => {
                let i = table.partition_point(|v| *v <= position).clamp(1, table.len() - 1) - 1;
                i as f64 + (position - table[i]) / (table[i + 1] - table[i])
            }
        }
    }

    /// True if the positions are finite and strictly increasing, and there is at least one.
    pub fn is_valid(&self) -> bool {
        match self {
            Axis::Even { first, pitch, count } => {
                first.is_finite() && self.last().is_finite() && *count > 0 && (*count == 1 || *pitch > 0.0)
            }
            Axis::Table(table) => {
                !table.is_empty() && table.iter().all(|v| v.is_finite()) && table.windows(2).all(|w| w[0] < w[1])
            }
        }
    }
}

/// The entry of a table at a fractional index, linear between two entries and beyond both ends.
pub(crate) fn interpolated(table: &[f64], index: f64) -> f64 {
    if table.len() < 2 {
        return table.first().copied().unwrap_or(0.0);
    }
    let i = (index.floor().max(0.0) as usize).min(table.len() - 2);
    table[i] + (table[i + 1] - table[i]) * (index - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uneven_table_is_inverted_at_and_between_its_entries() {
        let axis = Axis::from_table(vec![-1.0, -0.2, 0.1, 2.0]);
        for i in -4..24 {
            let index = i as f64 / 4.0 - 0.5;
            assert!((axis.index_of(axis.at(index)) - index).abs() < 1e-12, "{index}");
        }
    }

    #[test]
    fn an_even_table_becomes_an_even_axis() {
        let axis = Axis::from_table((0..9).map(|i| 0.1 * i as f64 - 0.4).collect());
        assert!(matches!(axis, Axis::Even { .. }));
        assert!((axis.at(8.0) - 0.4).abs() < 1e-12);
    }

    #[test]
    fn falling_or_repeated_positions_are_not_valid() {
        assert!(!Axis::from_table(vec![0.0, 1.0, 1.0]).is_valid());
        assert!(!Axis::from_table(vec![0.0, f64::NAN, 1.0]).is_valid());
        assert!(!Axis::Even { first: 0.0, pitch: -1.0, count: 3 }.is_valid());
        assert!(Axis::Even { first: 0.0, pitch: 0.0, count: 1 }.is_valid());
    }

    #[test]
    fn centred_positions_are_symmetric() {
        let positions = |axis: &Axis| (0..axis.len()).map(|i| axis.at(i as f64)).collect::<Vec<_>>();
        assert_eq!(positions(&Axis::centred(0.5, 4)), [-0.75, -0.25, 0.25, 0.75]);
        assert_eq!(positions(&Axis::centred(3.0, 3)), [-3.0, 0.0, 3.0]);
        assert_eq!(positions(&Axis::centred(3.0, 1)), [0.0]);
        assert!(Axis::centred(3.0, 0).is_empty() && !Axis::centred(3.0, 1).is_empty());
    }

    /// A table from -5 to 15 counts as uniform if each entry is, to 2e-8.
    #[test]
    fn a_table_is_even_to_a_thousand_millionth_of_its_span() {
        let shifted = |by: f64| Axis::from_table(vec![-5.0, 5.0 + by, 15.0]);
        assert_eq!(shifted(1.5e-8), Axis::Even { first: -5.0, pitch: 10.0, count: 3 });
        assert_eq!(shifted(-1.5e-8), Axis::Even { first: -5.0, pitch: 10.0, count: 3 });
        assert!(matches!(shifted(2.5e-8), Axis::Table(_)) && matches!(shifted(-2.5e-8), Axis::Table(_)));
        assert_eq!(Axis::from_table(vec![3.0, 7.0]), Axis::Even { first: 3.0, pitch: 4.0, count: 2 });
        assert_eq!(Axis::from_table(vec![7.0]), Axis::Even { first: 7.0, pitch: 1.0, count: 1 });
        assert_eq!(Axis::from_table(Vec::new()).len(), 0);
    }

    #[test]
    fn the_pitch_of_a_table_is_the_mean_and_of_one_position_zero() {
        let table = Axis::Table(vec![-2.0, 0.5, 4.0]);
        assert_eq!((table.len(), table.first(), table.last(), table.pitch()), (3, -2.0, 4.0, 3.0));
        let even = Axis::Even { first: -2.0, pitch: 0.5, count: 2 };
        assert_eq!((even.len(), even.first(), even.last(), even.pitch()), (2, -2.0, -1.5, 0.5));
        assert_eq!(Axis::Even { first: 1.0, pitch: 3.0, count: 1 }.pitch(), 0.0);
        assert_eq!((Axis::Table(vec![4.0]).pitch(), Axis::Table(Vec::new()).pitch()), (0.0, 0.0));
        assert!(Axis::Table(Vec::new()).is_empty() && !table.is_empty());
    }

    #[test]
    fn tables_are_extrapolated_linearly() {
        let table = Axis::Table(vec![-1.0, 1.0, 2.0, 6.0]);
        for (index, position) in
            [(0.0, -1.0), (0.5, 0.0), (1.0, 1.0), (1.5, 1.5), (2.25, 3.0), (-1.0, -3.0), (4.0, 10.0)]
        {
            assert_eq!((table.at(index), table.index_of(position)), (position, index));
        }
        let two = Axis::Table(vec![1.0, 5.0]);
        assert_eq!((two.at(0.25), two.index_of(2.0), two.pitch()), (2.0, 0.25, 4.0));
        let one = Axis::Table(vec![7.0]);
        assert_eq!((one.at(3.0), one.index_of(9.0)), (7.0, 2.0));
        let even = Axis::Even { first: 1.0, pitch: 4.0, count: 2 };
        assert_eq!((even.at(2.5), even.index_of(11.0)), (11.0, 2.5));
        assert!(table.index_of(f64::NAN).is_nan() && even.index_of(f64::NAN).is_nan());
    }

    #[test]
    fn only_finite_positions_that_rise_are_valid() {
        let even = |first, pitch, count| Axis::Even { first, pitch, count }.is_valid();
        assert!(even(-1.0, 0.5, 2) && even(0.0, -1.0, 1));
        assert!(!even(0.0, 1.0, 0) && !even(0.0, 0.0, 2));
        assert!(!even(f64::NEG_INFINITY, 1.0, 2) && !even(0.0, f64::INFINITY, 2) && !even(1e308, 1e308, 2));
        let table = |positions: &[f64]| Axis::Table(positions.to_vec()).is_valid();
        assert!(table(&[3.0]) && table(&[-1.0, 0.0, 5.0]));
        assert!(!table(&[]) && !table(&[f64::INFINITY]) && !table(&[0.0, 2.0, 1.0]) && !table(&[0.0, 0.0]));
    }
}
