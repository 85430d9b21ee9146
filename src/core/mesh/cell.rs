//! The patches of a surface within one cell of a lattice, by the signs of its eight corners.
//!
//! Corner n is at (n & 1, n >> 1 & 1, n >> 2 & 1). Edge 4 a + n runs along axis a; bit 0 of n is its place along axis a + 1 (mod 3), bit 1
//! along axis a + 2. An edge whose corners have different signs is crossed. On each face the crossed edges are joined in pairs; where all four
//! edges are crossed, each pair cuts off a corner that is inside. Both cells of a face see the same signs, and so join the same pairs. Each
//! crossed edge is joined on both faces that it belongs to, which makes cycles: the borders of the patches.

use std::sync::OnceLock;

/// The patches of surface in one cell, for one set of corners that are inside.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Patches {
    /// Number of patches, 0 to 4.
    pub count: u8,
    /// For each edge that the surface crosses, the number of its patch, from 0; for the other edges 0, too.
    pub of_edge: [u8; 12],
}

/// The corners of an edge, the one with the lower coordinate first.
pub(crate) fn corners_of(edge: usize) -> [usize; 2] {
    let (axis, place) = (edge / 4, edge % 4);
    let low = (place & 1) << ((axis + 1) % 3) | (place >> 1) << ((axis + 2) % 3);
    [low, low | 1 << axis]
}

/// The number of the cell edge along `axis` whose coordinates (0 or 1) along the following two axes, cyclically, are `next` and `after`.
pub(crate) fn edge_at(axis: usize, next: usize, after: usize) -> usize {
    4 * axis + next + 2 * after
}

/// The four edges of the face with the normal `axis` at the coordinate `side` (0 or 1), in cyclic order: each shares a corner with the next.
pub(crate) fn edges_of_face(axis: usize, side: usize) -> [usize; 4] {
    let (next, after) = ((axis + 1) % 3, (axis + 2) % 3);
    // An edge along `next` has (after, axis) as its places, one along `after` has (axis, next).
    [edge_at(next, 0, side), edge_at(after, side, 1), edge_at(next, 1, side), edge_at(after, side, 0)]
}

/// True if the surface crosses an edge: exactly one of its corners is inside. `inside`: bit n is set if corner n is inside.
pub(crate) fn is_crossed(inside: u8, edge: usize) -> bool {
    let [a, b] = corners_of(edge);
    (inside >> a ^ inside >> b) & 1 == 1
}

/// True if all four edges of a face are crossed.
pub(crate) fn is_ambiguous(inside: u8, axis: usize, side: usize) -> bool {
    edges_of_face(axis, side).iter().all(|edge| is_crossed(inside, *edge))
}

/// The edge with which the crossed edge `edge` is joined on a face: the surface meets the face in a line from one to the other. If all four edges are
/// crossed, it is the other edge at the same inside corner.
pub(crate) fn partner(inside: u8, axis: usize, side: usize, edge: usize) -> usize {
    let crossed = |other: &usize| *other != edge && is_crossed(inside, *other);
    let edges = edges_of_face(axis, side);
    if !is_ambiguous(inside, axis, side) {
        return edges.into_iter().find(crossed).unwrap_or(edge);
    }
    // The other edge at the corner of this one that is inside.
    let corner = corners_of(edge).into_iter().find(|corner| inside >> corner & 1 == 1);
    let shares = |other: &usize| corner.is_some_and(|corner| corners_of(*other).contains(&corner));
    edges.into_iter().filter(crossed).find(shares).unwrap_or(edge)
}

/// The patches for every set of inside corners: the index has a bit for each corner.
pub(crate) fn patches() -> &'static [Patches; 256] {
    static TABLE: OnceLock<[Patches; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|inside| of_signs(inside as u8)))
}

fn of_signs(inside: u8) -> Patches {
    let mut found = Patches::default();
    let mut is_done = [false; 12];
    for first in (0..12).filter(|edge| is_crossed(inside, *edge)) {
        if is_done[first] {
            continue;
        }
        let mut reached = vec![first];
        while let Some(edge) = reached.pop() {
            if std::mem::replace(&mut is_done[edge], true) {
                continue;
            }
            found.of_edge[edge] = found.count;
            for (axis, side) in (0..6).map(|face| (face / 2, face % 2)) {
                if edges_of_face(axis, side).contains(&edge) {
                    reached.push(partner(inside, axis, side, edge));
                }
            }
        }
        found.count += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_has_two_corners_and_two_faces() {
        for edge in 0..12 {
            let [a, b] = corners_of(edge);
            assert_eq!(b - a, 1 << (edge / 4));
            let faces = (0..6).filter(|face| edges_of_face(face / 2, face % 2).contains(&edge)).count();
            assert_eq!(faces, 2, "edge {edge}");
        }
        for (axis, side) in (0..6).map(|face| (face / 2, face % 2)) {
            let edges = edges_of_face(axis, side);
            for (n, edge) in edges.into_iter().enumerate() {
                let (here, next) = (corners_of(edge), corners_of(edges[(n + 1) % 4]));
                assert!(here.iter().all(|corner| corner >> axis & 1 == side));
                assert_eq!(here.iter().filter(|corner| next.contains(corner)).count(), 1, "edges {n} of {axis} {side}");
            }
        }
    }

    #[test]
    fn corners_alone_are_patches_of_their_own() {
        let count = |inside: u8| patches()[usize::from(inside)].count;
        assert_eq!([count(0), count(255), count(1), count(0b1111), count(0b1001)], [0, 0, 1, 1, 2]);
        // Four corners, no two of them neighbours, and the opposite.
        assert_eq!([count(0b0110_1001), count(0b1001_0110)], [4, 4]);
        // Two corners of a diagonal of the cube outside: joined outside, one patch for each.
        assert_eq!(count(!0b1000_0001), 2);
        assert!(patches().iter().all(|p| p.count <= 4));
    }

    #[test]
    fn joining_is_mutual() {
        for inside in 0..=255u8 {
            for (axis, side) in (0..6).map(|face| (face / 2, face % 2)) {
                for edge in edges_of_face(axis, side).into_iter().filter(|edge| is_crossed(inside, *edge)) {
                    let other = partner(inside, axis, side, edge);
                    assert!(other != edge && partner(inside, axis, side, other) == edge, "{inside:08b} {edge}");
                }
            }
        }
    }
}
