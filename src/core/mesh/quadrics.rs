//! Simplification by quadrics (Garland and Heckbert 1997) as in meshoptimizer: many times faster than [`super::simplify`], and without its guarantees.

use super::Mesh;
use glam::DVec3;
use meshopt_rs::simplify::simplify;
use std::collections::HashMap;

/// Simplifies a mesh with meshoptimizer: as few triangles as it finds for an error of `tolerance` mm. The error is that of its quadrics and no bound
/// of the distance. The result may be open where `mesh` is closed: [`Mesh::open_edges`] counts the edges that do not belong to two triangles of
/// opposite directions. Its vertices are some of those of `mesh`.
pub fn simplified(mesh: &Mesh, tolerance: f64) -> Mesh {
    let low = mesh.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = mesh.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let extent = (high - low).max_element();
    if !(extent > 0.0 && extent.is_finite()) {
        return mesh.clone();
    }
    // The crate computes in f32: about the mesh's own corner.
    let places: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| (*v - low).as_vec3().to_array()).collect();
    let indices = mesh.triangles.as_flattened();
    let mut left = vec![0; indices.len()];
    let count = simplify(&mut left, indices, &places, 0, (tolerance / extent).min(1.0) as f32);
    let mut numbers = vec![u32::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let (corners, _) = left[..count].as_chunks::<3>();
    let triangles: Vec<[u32; 3]> = corners
        .iter()
        .map(|corners| {
            corners.map(|old| {
                let number = &mut numbers[old as usize];
                if *number == u32::MAX {
                    *number = vertices.len() as u32;
                    vertices.push(mesh.vertices[old as usize]);
                }
                *number
            })
        })
        .collect();
    let open_edges = open_edges(&triangles);
    Mesh { vertices, triangles, open_edges }
}

/// The edges that do not belong to exactly two triangles, once in each direction.
pub(super) fn open_edges(triangles: &[[u32; 3]]) -> u64 {
    // By edge, lower vertex first: how often it is passed in each direction.
    let mut passed: HashMap<[u32; 2], [u32; 2]> = HashMap::with_capacity(triangles.len() * 3 / 2);
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            passed.entry([*from.min(to), *from.max(to)]).or_default()[usize::from(from > to)] += 1;
        }
    }
    passed.values().filter(|counts| **counts != [1, 1]).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron whose faces were split `times` times, with its vertices moved onto a sphere.
    fn sphere(times: u32, radius: f64, centre: DVec3) -> Mesh {
        let mut vertices = vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        let mut triangles: Vec<[u32; 3]> =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        for _ in 0..times {
            let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        vertices.iter_mut().for_each(|v| *v = *v * radius + centre);
        Mesh { vertices, triangles, open_edges: 0 }
    }

    /// On a sphere the middle of a flat triangle is further inside the larger it is: its depth says how far the surface moved.
    #[test]
    fn a_sphere_keeps_its_shape_with_far_fewer_triangles() {
        let (radius, centre) = (20.0, DVec3::new(300.0, -40.0, 7.0));
        let mesh = sphere(6, radius, centre);
        for (tolerance, left) in [(0.02, 0.3), (0.1, 0.08)] {
            let found = simplified(&mesh, tolerance);
            let share = found.triangles.len() as f64 / mesh.triangles.len() as f64;
            assert!(share < left && share > 0.002, "{share} of the triangles are left at {tolerance} mm");
            assert_eq!(found.open_edges, open_edges(&found.triangles));
            let depth = |[a, b, c]: &[u32; 3]| {
                let middle = [a, b, c].map(|v| found.vertices[*v as usize]).into_iter().sum::<DVec3>() / 3.0;
                radius - (middle - centre).length()
            };
            let deepest = found.triangles.iter().map(depth).fold(0.0, f64::max);
            // The quadric of a vertex is a mean over its planes: it may lie three times as far from one of them.
            assert!(deepest < 4.0 * tolerance, "{deepest} mm off at {tolerance} mm");
            assert!(found.vertices.iter().all(|v| ((*v - centre).length() - radius).abs() < 1e-9));
        }
    }

    #[test]
    fn what_has_no_extent_stays_and_open_edges_are_counted() {
        assert_eq!(simplified(&Mesh::default(), 1.0), Mesh::default());
        let point = Mesh { vertices: vec![DVec3::ONE; 3], triangles: vec![[0, 1, 2]], open_edges: 3 };
        assert_eq!(simplified(&point, 1.0), point);
        let mut mesh = sphere(1, 1.0, DVec3::ZERO);
        assert_eq!(open_edges(&mesh.triangles), 0);
        mesh.triangles.pop();
        assert_eq!(open_edges(&mesh.triangles), 3);
    }
}
