//! Simplification of a mesh to a bound in mm: vertices are taken away one by one, the cheapest first, and what lay around each is filled by
//! triangles of its neighbours (half-edge collapse).
//!
//! # The bound
//!
//! A collapse replaces a disc of triangles by another one with the same border. It is done only if both discs lie over one polygon of a
//! plane, each point once, as seen along a common direction. Then the points of both that lie over each other are a relation without gaps on
//! either side, and their distance is at most the difference of two heights. These are linear over each piece of the overlay of both
//! triangulations, so the difference is largest at a corner of it: at the vertex that is taken away, or where an old edge crosses a new one.
//! That height is added to the largest bound of the old triangles, and the sum is the bound of the new ones. By the triangle inequality no
//! point of the result is further from the mesh than the bound of its triangle, and no point of the mesh further from the result.
//!
//! # What is kept
//!
//! Closed stays closed, a manifold stays a manifold of the same genus (link condition: Dey and others, *Topology preserving edge
//! contraction*, 1999), and vertices on a border stay where they are. No triangle turns over: each faces the side of the disc that it
//! belongs to, at 78 degrees or less. Two parts of a surface that are nearer to each other than twice the bound may touch.

use super::Mesh;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Most triangles at a vertex.
const MAX_VALENCE: usize = 16;
/// Smallest area of a new triangle, as a share of the square of its longest edge, unless the old ones were thinner; 0.43 is equilateral.
const LEAST_SHAPE: f64 = 0.06;
/// Smallest cosine between a triangle and the direction along which its disc is seen.
const LEAST_COSINE: f64 = 0.2;
/// How much the length of the edge that vanishes counts beside the distance, so that flat parts lose their short edges first.
const LENGTH_COST: f64 = 1e-3;
/// A triangle that is gone.
const GONE: [u32; 3] = [u32::MAX; 3];

/// Simplifies a mesh: each point of the result is at most `tolerance` mm from `mesh`, and each point of `mesh` from the result. Also returns the
/// bound that was reached, mm. The vertices are some of those of `mesh`.
pub fn simplified(mesh: &Mesh, tolerance: f64) -> (Mesh, f64) {
    let mut surface = Surface::new(mesh, tolerance);
    surface.collapse_all();
    surface.finished(mesh)
}

struct Surface<'a> {
    places: &'a [DVec3],
    tolerance: f64,
    triangles: Vec<[u32; 3]>,
    /// By triangle: how far it may be from the mesh at the beginning, mm.
    bounds: Vec<f64>,
    /// By vertex: its triangles.
    around: Vec<Vec<u32>>,
}

/// A vertex, the neighbour that it may become, and the cost of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Collapse {
    cost: f64,
    /// Bound of the new triangles, mm.
    bound: f64,
    vertex: u32,
    target: u32,
}

impl Eq for Collapse {}

impl Ord for Collapse {
    /// The cheapest is the greatest, as a heap gives the greatest first.
    fn cmp(&self, other: &Collapse) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.vertex.cmp(&self.vertex))
    }
}

impl PartialOrd for Collapse {
    fn partial_cmp(&self, other: &Collapse) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// A neighbour of a vertex as seen along the direction of its disc: place in the plane, and height above it.
#[derive(Clone, Copy)]
struct Seen {
    at: DVec2,
    height: f64,
}

impl<'a> Surface<'a> {
    fn new(mesh: &'a Mesh, tolerance: f64) -> Surface<'a> {
        let mut around = vec![Vec::new(); mesh.vertices.len()];
        for (n, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| around[*v as usize].push(n as u32));
        }
        let bounds = vec![0.0; mesh.triangles.len()];
        Surface { places: &mesh.vertices, tolerance, triangles: mesh.triangles.clone(), bounds, around }
    }

    fn place(&self, vertex: u32) -> DVec3 {
        self.places[vertex as usize]
    }

    fn collapse_all(&mut self) {
        let all = (0..self.places.len() as u32).into_par_iter().filter_map(|vertex| self.cheapest(vertex));
        let mut heap: BinaryHeap<Collapse> = all.collect::<Vec<_>>().into();
        while let Some(planned) = heap.pop() {
            // What lies around may be another by now.
            let Some(now) = self.cheapest(planned.vertex) else { continue };
            if now.cost > planned.cost {
                heap.push(now);
                continue;
            }
            let Some(ring) = self.ring(now.vertex) else { continue };
            self.collapse(&now);
            heap.extend(ring.iter().filter_map(|vertex| self.cheapest(*vertex)));
        }
    }

    /// The neighbours of a vertex in the order of its triangles; None on a border.
    fn ring(&self, vertex: u32) -> Option<Vec<u32>> {
        let edge = |n: &u32| {
            let triangle = self.triangles[*n as usize];
            let first = triangle.iter().position(|v| *v == vertex)?;
            Some((triangle[(first + 1) % 3], triangle[(first + 2) % 3]))
        };
        let edges: Vec<(u32, u32)> = self.around[vertex as usize].iter().filter_map(edge).collect();
        let mut ring = vec![edges.first()?.0];
        loop {
            let last = *ring.last()?;
            let next = edges.iter().find(|(from, _)| *from == last)?.1;
            if next == ring[0] {
                break;
            }
            ring.push(next);
            if ring.len() > edges.len() {
                return None;
            }
        }
        (ring.len() == edges.len() && ring.len() >= 3).then_some(ring)
    }

    fn is_neighbour(&self, vertex: u32, other: u32) -> bool {
        self.around[vertex as usize].iter().any(|n| self.triangles[*n as usize].contains(&other))
    }

    /// The cheapest collapse of a vertex within the tolerance.
    fn cheapest(&self, vertex: u32) -> Option<Collapse> {
        let ring = self.ring(vertex)?;
        let (seen, thinnest) = self.seen(vertex, &ring)?;
        let before = self.around[vertex as usize].iter().map(|n| self.bounds[*n as usize]).fold(0.0, f64::max);
        let mut best: Option<Collapse> = None;
        for (n, target) in ring.iter().enumerate() {
            let turned = |k: usize| (n + k) % ring.len();
            let Some(height) = self.height(&ring, &seen, n, thinnest) else { continue };
            let bound = before + height;
            let cost = bound + LENGTH_COST * self.place(vertex).distance(self.place(*target));
            let is_better = best.is_none_or(|best| cost < best.cost);
            if bound > self.tolerance || !is_better {
                continue;
            }
            let [next, last] = [turned(1), turned(ring.len() - 1)].map(|k| ring[k]);
            let shared = ring.iter().filter(|v| **v != *target && self.is_neighbour(*target, **v)).count();
            let grown = self.around[*target as usize].len() + ring.len() - 4;
            // The one new triangle may be there already, as in a tetrahedron.
            let is_there = ring.len() == 3
                && self.around[*target as usize].iter().any(|n| {
                    let triangle = self.triangles[*n as usize];
                    triangle.contains(&next) && triangle.contains(&last)
                });
            if shared == 2 && grown <= MAX_VALENCE && !is_there {
                best = Some(Collapse { cost, bound, vertex, target: *target });
            }
        }
        best
    }

    /// The neighbours of a vertex as seen along the direction of its disc, with the vertex at the origin, and the thinnest shape of its
    /// triangles. None if the disc does not lie over a plane, each point once.
    fn seen(&self, vertex: u32, ring: &[u32]) -> Option<(Vec<Seen>, f64)> {
        let middle = self.place(vertex);
        let spokes: Vec<DVec3> = ring.iter().map(|v| self.place(*v) - middle).collect();
        let next = |n: usize| spokes[(n + 1) % spokes.len()];
        // Of any disc with this border the same.
        let normal = (0..spokes.len()).map(|n| spokes[n].cross(next(n))).sum::<DVec3>().try_normalize()?;
        let (along, across) = normal.any_orthonormal_pair();
        let see =
            |spoke: &DVec3| Seen { at: DVec2::new(spoke.dot(along), spoke.dot(across)), height: spoke.dot(normal) };
        let mut seen: Vec<Seen> = spokes.iter().map(see).collect();
        // Whether the pair turns with the normal or against it.
        if along.cross(across).dot(normal) < 0.0 {
            seen.iter_mut().for_each(|seen| seen.at.y = -seen.at.y);
        }
        let (mut angle, mut thinnest) = (0.0, f64::INFINITY);
        for n in 0..seen.len() {
            let (here, there) = (seen[n].at, seen[(n + 1) % seen.len()].at);
            if here.perp_dot(there) <= 0.0 {
                return None;
            }
            angle += here.perp_dot(there).atan2(here.dot(there));
            thinnest = thinnest.min(shape(DVec3::ZERO, spokes[n], next(n)));
        }
        // Once around.
        ((angle - std::f64::consts::TAU).abs() < 1e-3).then_some((seen, thinnest))
    }

    /// The largest distance, mm, between the disc of a vertex and the triangles of its neighbour `target` that would replace it; None where
    /// these do not lie over the same polygon, each point once, or are too thin.
    fn height(&self, ring: &[u32], seen: &[Seen], target: usize, thinnest: f64) -> Option<f64> {
        let count = ring.len();
        let of = |k: usize| (target + k) % count;
        let (start, from) = (seen[target], self.place(ring[target]));
        // Where the vertex that is taken away lies under or over the new triangles.
        let mut at_vertex: Option<f64> = None;
        for k in 1..count - 1 {
            let [a, b] = [of(k), of(k + 1)];
            let (left, right) = (seen[a].at - start.at, seen[b].at - start.at);
            let area = left.perp_dot(right);
            let [second, third] = [ring[a], ring[b]].map(|v| self.place(v));
            let true_area = (second - from).cross(third - from).length();
            if area <= LEAST_COSINE * true_area || shape(from, second, third) < LEAST_SHAPE.min(thinnest) {
                return None;
            }
            // Shares of the corners at the origin.
            let (u, v) = ((-start.at).perp_dot(right) / area, left.perp_dot(-start.at) / area);
            if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 {
                let height = (1.0 - u - v) * start.height + u * seen[a].height + v * seen[b].height;
                at_vertex = Some(at_vertex.unwrap_or(0.0).max(height.abs()));
            }
        }
        let mut most = at_vertex?;
        // Where an old edge, from the vertex, crosses a new one, from the target.
        for k in 2..count - 1 {
            let end = seen[of(k)];
            let edge = end.at - start.at;
            for (_, spoke) in seen.iter().enumerate().filter(|(n, _)| *n != target && *n != of(k)) {
                let slope = spoke.at.perp_dot(edge);
                if slope == 0.0 {
                    continue;
                }
                let (s, t) = (start.at.perp_dot(edge) / slope, start.at.perp_dot(spoke.at) / slope);
                if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                    let difference = s * spoke.height - (start.height + t * (end.height - start.height));
                    most = most.max(difference.abs());
                }
            }
        }
        Some(most)
    }

    fn collapse(&mut self, collapse: &Collapse) {
        let Collapse { vertex, target, bound, .. } = *collapse;
        for n in std::mem::take(&mut self.around[vertex as usize]) {
            let triangle = self.triangles[n as usize];
            if triangle.contains(&target) {
                self.triangles[n as usize] = GONE;
                triangle.iter().for_each(|v| self.around[*v as usize].retain(|other| *other != n));
                continue;
            }
            self.triangles[n as usize] = triangle.map(|v| if v == vertex { target } else { v });
            self.bounds[n as usize] = bound;
            self.around[target as usize].push(n);
        }
    }

    /// What is left, and the bound of it.
    fn finished(self, mesh: &Mesh) -> (Mesh, f64) {
        let mut number = vec![0; self.places.len()];
        let mut found = Mesh { open_edges: mesh.open_edges, ..Mesh::default() };
        for (vertex, number) in number.iter_mut().enumerate().filter(|(n, _)| !self.around[*n].is_empty()) {
            *number = found.vertices.len() as u32;
            found.vertices.push(self.places[vertex]);
        }
        let left = || self.triangles.iter().zip(&self.bounds).filter(|(triangle, _)| **triangle != GONE);
        found.triangles = left().map(|(triangle, _)| triangle.map(|v| number[v as usize])).collect();
        let bound = left().map(|(_, bound)| *bound).fold(0.0, f64::max);
        (found, bound)
    }
}

/// Area of a triangle as a share of the square of its longest edge.
fn shape(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    if longest > 0.0 { (b - a).cross(c - a).length() / (2.0 * longest) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::nets::tests::{ball, closed_manifold, net};
    use super::*;
    use proptest::prelude::*;

    /// Distance of a point from a triangle: from its plane where the foot is inside, else from the nearest edge.
    fn from_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let normal = (b - a).cross(c - a);
        let is_inside = |u: DVec3, v: DVec3| (v - u).cross(p - u).dot(normal) >= 0.0;
        if normal.length() > 0.0 && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
            return (p - a).dot(normal.normalize()).abs();
        }
        let from_edge = |u: DVec3, v: DVec3| {
            let t = (p - u).dot(v - u) / (v - u).length_squared().max(1e-300);
            p.distance(u.lerp(v, t.clamp(0.0, 1.0)))
        };
        from_edge(a, b).min(from_edge(b, c)).min(from_edge(c, a))
    }

    /// The largest distance of points of one mesh from another: corners, middles of edges and triangles.
    fn furthest(from: &Mesh, to: &Mesh) -> f64 {
        let corners = |mesh: &Mesh, t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
        let points = from.triangles.par_iter().flat_map_iter(|t| {
            let [a, b, c] = corners(from, t);
            [a, (a + b) / 2.0, (a + b + c) / 3.0, (a + 3.0 * b) / 4.0]
        });
        // Most triangles lie further away than the nearest one so far, as a ball round them tells: the distance from them is not computed.
        let balls: Vec<_> = to
            .triangles
            .iter()
            .map(|t| corners(to, t))
            .map(|t| (t, t[0].distance(t[1]).max(t[0].distance(t[2]))))
            .collect();
        let distance = |p: DVec3| {
            balls.iter().fold(f64::INFINITY, |nearest, (triangle, radius)| match p.distance(triangle[0]) - radius {
                least if least >= nearest => nearest,
                _ => nearest.min(from_triangle(p, *triangle)),
            })
        };
        points.map(distance).reduce(|| 0.0, f64::max)
    }

    #[test]
    fn a_ball_keeps_to_its_bound_on_both_sides_with_far_fewer_triangles() {
        let (mesh, h, centre) = ball(17, 0.8);
        for (share, left) in [(0.05, 0.9), (0.2, 0.35), (1.0, 0.12)] {
            let tolerance = share * h;
            let (found, bound) = simplified(&mesh, tolerance);
            assert_eq!(closed_manifold(&found), 2);
            assert!(bound > 0.3 * tolerance && bound <= tolerance, "{bound} of {tolerance}");
            for (from, to) in [(&mesh, &found), (&found, &mesh)] {
                let off = furthest(from, to);
                assert!(off <= bound + 1e-12, "{off} beyond the bound {bound}");
            }
            let count = found.triangles.len() as f64;
            assert!(count < left * mesh.triangles.len() as f64, "{share}: {count} of {}", mesh.triangles.len());
            assert!((found.volume() - mesh.volume()).abs() <= bound * mesh.area());
            for triangle in &found.triangles {
                let [a, b, c] = triangle.map(|v| found.vertices[v as usize]);
                assert!((b - a).cross(c - a).dot((a + b + c) / 3.0 - centre) > 0.0, "a triangle is turned over");
            }
        }
    }

    #[test]
    fn planes_lose_all_vertices_that_they_do_not_need() {
        // A block, whose sides are flat and whose edges are bevelled.
        let mesh = net([14, 12, 10], 0.5, true, 1.0, |_| 1.0);
        let (found, bound) = simplified(&mesh, 1e-9);
        assert_eq!(closed_manifold(&found), 2);
        assert!(bound <= 1e-9 && found.triangles.len() * 8 < mesh.triangles.len(), "{}", found.triangles.len());
        assert!((found.volume() / mesh.volume() - 1.0).abs() < 1e-9 && (found.area() / mesh.area() - 1.0).abs() < 1e-9);
        // Nothing is done without a tolerance, and a tetrahedron has nothing to lose.
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let tetrahedron = Mesh { vertices, triangles, open_edges: 0 };
        assert_eq!(simplified(&tetrahedron, 100.0), (tetrahedron.clone(), 0.0));
        assert_eq!(simplified(&Mesh::default(), 1.0), (Mesh::default(), 0.0));
    }

    #[test]
    fn a_border_stays_where_it_is() {
        let mesh = net([16, 14, 6], 2.25, false, 1.0, |v| v.z + 0.2 * (v.x * 0.7).sin() * (v.y * 0.6).cos());
        let (found, bound) = simplified(&mesh, 0.1);
        let [left, before] = [&found, &mesh].map(|mesh| mesh.triangles.len());
        assert!(2 * left < before && found.open_edges == mesh.open_edges, "{left} of {before}");
        let border = |mesh: &Mesh| {
            let mut edges = std::collections::BTreeSet::new();
            for [a, b, c] in &mesh.triangles {
                for (u, v) in [(a, b), (b, c), (c, a)] {
                    let place = |n: &u32| mesh.vertices[*n as usize].to_array().map(f64::to_bits);
                    // An edge that is met twice, in both directions, is inside.
                    if !edges.remove(&(place(v), place(u))) {
                        edges.insert((place(u), place(v)));
                    }
                }
            }
            edges
        };
        assert!(border(&mesh).len() > 40 && border(&mesh) == border(&found));
        assert!(furthest(&mesh, &found).max(furthest(&found, &mesh)) <= bound + 1e-12);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn noise_stays_a_closed_manifold_of_its_genus_within_the_bound(
            values in proptest::collection::vec(0u8..9, 216), threshold in 0.5..8.0f64, tolerance in 0.01..1.0f64
        ) {
            let value = |v: DVec3| f64::from(values[v.x as usize + 6 * (v.y as usize + 6 * v.z as usize)]);
            let mesh = net([6; 3], threshold, true, 0.5, value);
            let (found, bound) = simplified(&mesh, tolerance);
            prop_assert_eq!(closed_manifold(&found), closed_manifold(&mesh));
            prop_assert!(bound <= tolerance);
            if !mesh.triangles.is_empty() {
                prop_assert!(furthest(&mesh, &found).max(furthest(&found, &mesh)) <= bound + 1e-12);
            }
        }
    }
}
