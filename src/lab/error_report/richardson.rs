//! Richardson's extrapolation of pictures: from three of the same scene with ever smaller cells to the one that they converge to.
//!
//! A picture P(c) = P + K c^p + ... with the same K and p for all cells c that are small enough gives
//!
//! ```text
//! |P(c1) - P(c2)| / |P(c2) - P(c3)| = (c1^p - c2^p) / (c2^p - c3^p)         P = P(c3) + (P(c3) - P(c2)) c3^p / (c2^p - c3^p)
//! ```
//!
//! (Richardson 1911; Roache 1994 for cells that are not halved, and for the order by three grids). The order p is observed, one for the whole picture, by
//! the root mean squares of the differences: single pixels have none, as their differences may be 0. It is what the next terms leave of the true one, so
//! that the extrapolated picture has an error of its own, which this module states too.

use crate::passes::Texels;

/// Orders that are looked for. Below, the differences hardly shrink; above, they vanish at once, and the picture with the smallest cells is as good.
const ORDERS: [f64; 2] = [0.25, 8.0];

/// The limit of a sequence of pictures, by Richardson extrapolation.
#[derive(Clone, Debug)]
pub struct Extrapolated {
    pub picture: Texels,
    /// The limit that the two coarser pictures alone give with the same order.
    pub coarser: Texels,
    /// The observed order of the error in the size of the cells. Infinite if the two finest pictures are equal.
    pub order: f64,
    /// RMS difference of `picture` and `coarser`, over all values: an estimate of the error of `coarser`. If the pictures converge, it is an upper
    /// bound of the error of `picture`.
    pub error: f64,
    /// RMS difference of the picture with the smallest cells from the limit: an estimate of the error of that picture.
    pub finest: f64,
}

/// Extrapolates three pictures to cells of size 0. `cells`: the edges of their cells, descending, in any unit. They must be the cells of the actual
/// lattices, not the requested ones.
///
/// # Errors
/// One line: the pictures differ in size or channels, the cells do not descend or are not above 0, a value is not finite, or the observed order is
/// not within 0.25..=8.
pub fn extrapolated(pictures: [&Texels; 3], cells: [f64; 3]) -> Result<Extrapolated, String> {
    let [coarse, middle, fine] = pictures;
    let is_alike = |other: &Texels| (other.size, other.channels) == (fine.size, fine.channels);
    if !is_alike(coarse) || !is_alike(middle) {
        return Err(format!(
            "extrapolation: pictures of {:?}, {:?} and {:?} differ in size",
            coarse.size, middle.size, fine.size
        ));
    }
    let [c1, c2, c3] = cells;
    if !(c1 > c2 && c2 > c3 && c3 > 0.0 && c1.is_finite()) {
        return Err(format!("extrapolation: cells of {c1}, {c2} and {c3} must descend, and be above 0"));
    }
    let (first, second) = (rms(coarse, middle), rms(middle, fine));
    if !(first.is_finite() && second.is_finite()) {
        return Err("extrapolation: a picture has values that are not finite".into());
    }
    if second == 0.0 {
        let (picture, coarser) = (fine.clone(), fine.clone());
        return Ok(Extrapolated { picture, coarser, order: f64::INFINITY, error: 0.0, finest: 0.0 });
    }
    let order = order_of(first / second, cells).ok_or_else(|| {
        format!("extrapolation: pictures with cells of {c1}, {c2} and {c3} differ by {first:.1e} and {second:.1e}, which gives no order within {} to {}", ORDERS[0], ORDERS[1])
    })?;
    let towards = |from: &Texels, to: &Texels, from_cell: f64, to_cell: f64| {
        let share = to_cell.powf(order) / (from_cell.powf(order) - to_cell.powf(order));
        let values = from.values.iter().zip(&to.values).map(|(from, to)| to + (to - from) * share).collect();
        Texels { values, ..to.clone() }
    };
    let picture = towards(middle, fine, c2, c3);
    let coarser = towards(coarse, middle, c1, c2);
    let (error, finest) = (rms(&picture, &coarser), rms(&picture, fine));
    Ok(Extrapolated { picture, coarser, order, error, finest })
}

fn rms(a: &Texels, b: &Texels) -> f64 {
    let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / a.values.len().max(1) as f64).sqrt()
}

/// The order at which the differences of pictures have this ratio. (c1^p - c2^p) / (c2^p - c3^p) grows with p.
fn order_of(ratio: f64, [c1, c2, c3]: [f64; 3]) -> Option<f64> {
    let expected = |p: f64| ((c1 / c2).powf(p) - 1.0) / (1.0 - (c3 / c2).powf(p));
    let [mut low, mut high] = ORDERS;
    if !(expected(low)..=expected(high)).contains(&ratio) {
        return None;
    }
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        match expected(middle) < ratio {
            true => low = middle,
            false => high = middle,
        }
    }
    Some((low + high) / 2.0)
}
