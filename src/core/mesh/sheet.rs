//! The surface of a distance map as triangles: an open sheet of what the rays hit, a vertex for each ray. It has no back, and is torn where
//! neighbouring rays hit different surfaces.

use super::Mesh;
use super::quadrics::open_edges;
use glam::DVec3;

/// Largest slope of a surface across a ray, tan 80 deg. Neighbouring hits that differ by more are taken as two surfaces, with a gap between them; a
/// steeper surface would hardly be seen.
pub const STEEPEST: f64 = 5.67;

/// The distance map of `size` rays as an open mesh. `ray`: origin (mm) and unit direction of the ray of a column and row. `distances`: along the
/// rays, row by row, mm; None where a ray hit nothing. Returns the mesh, whose triangles are anticlockwise as seen along the rays, and for each
/// vertex the index of its ray.
pub fn sheet(
    size: [usize; 2],
    ray: impl Fn(usize, usize) -> (DVec3, DVec3),
    distances: &[Option<f64>],
) -> (Mesh, Vec<usize>) {
    let [width, height] = size;
    let place = |n: usize, distance: f64| {
        let (origin, direction) = ray(n % width, n / width);
        origin + direction * distance
    };
    let distance = |n: usize| distances.get(n).copied().flatten();
    // Neighbours are of one surface unless it would be steeper than any that is.
    let joined = |a: usize, b: usize| match (distance(a), distance(b)) {
        (Some(near), Some(far)) => {
            let middle = (near + far) / 2.0;
            (near - far).abs() <= STEEPEST * place(a, middle).distance(place(b, middle))
        }
        _ => false,
    };
    let mut triangles = Vec::new();
    for (x, y) in (1..height).flat_map(|y| (1..width).map(move |x| (x, y))) {
        let lower = y * width + x;
        // Around the cell, anticlockwise from its upper left corner; rows go down.
        let cell = [lower - width - 1, lower - 1, lower, lower - width];
        let across = |a: usize, b: usize| match (distance(cell[a]), distance(cell[b])) {
            (Some(p), Some(q)) => place(cell[a], p).distance(place(cell[b], q)),
            _ => f64::INFINITY,
        };
        // Along the shorter diagonal.
        let turn = usize::from(across(1, 3) < across(0, 2));
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = [a, b, c].map(|n| cell[(n + turn) % 4]);
            if joined(a, b) && joined(b, c) && joined(c, a) {
                triangles.push([a, b, c]);
            }
        }
    }
    let mut rays: Vec<usize> = triangles.iter().flatten().copied().collect();
    rays.sort_unstable();
    rays.dedup();
    let mut vertex_of = vec![0u32; width * height];
    for (vertex, ray) in rays.iter().enumerate() {
        vertex_of[*ray] = vertex as u32;
    }
    let vertices = rays.iter().map(|n| place(*n, distance(*n).unwrap_or(0.0))).collect();
    let triangles: Vec<[u32; 3]> = triangles.into_iter().map(|corners| corners.map(|n| vertex_of[n])).collect();
    let open_edges = open_edges(&triangles);
    (Mesh { vertices, triangles, open_edges }, rays)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parallel rays along z, 0.5 mm apart, columns along x and rows along y.
    fn along_z(x: usize, y: usize) -> (DVec3, DVec3) {
        (DVec3::new(0.5 * x as f64, 0.5 * y as f64, 1.0), DVec3::Z)
    }

    #[test]
    fn a_plane_is_whole_and_faces_the_viewer() {
        let plane: Vec<_> = (0..20).map(|n| Some(3.0 + 0.2 * f64::from(n % 5))).collect();
        let (mesh, rays) = sheet([5, 4], along_z, &plane);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len(), mesh.open_edges), (20, 24, 14));
        assert_eq!(rays, (0..20).collect::<Vec<_>>());
        let area = 2.0 * 1.5 * (1.0f64 + 0.4 * 0.4).sqrt();
        assert!((mesh.area() - area).abs() < 1e-12, "{}", mesh.area());
        assert!(mesh.normals().iter().all(|normal| normal.z < -0.9), "{:?}", mesh.normals());
        assert!((mesh.vertices[7] - DVec3::new(1.0, 0.5, 4.4)).length() < 1e-12);
    }

    #[test]
    fn a_sheet_is_torn_at_a_cliff_and_has_holes_where_nothing_was_hit() {
        // Steps of 2.8 mm between rays 0.5 mm apart are joined, of 2.9 mm not.
        for (step, triangles) in [(2.8, 24), (2.9, 18)] {
            let cliff: Vec<_> = (0..20).map(|n| Some(if n % 5 < 2 { 3.0 } else { 3.0 + step })).collect();
            let (mesh, _) = sheet([5, 4], along_z, &cliff);
            assert_eq!(mesh.triangles.len(), triangles);
            assert_eq!(mesh.vertices.len(), 20);
        }
        let mut hole: Vec<_> = vec![Some(3.0); 25];
        hole[12] = None;
        let (mesh, rays) = sheet([5, 5], along_z, &hole);
        // Each of the four cells around it keeps the triangle that it has corners for.
        assert_eq!((mesh.triangles.len(), mesh.open_edges, rays.len()), (28, 20, 24));
        assert!(!rays.contains(&12));
    }

    #[test]
    fn perspective_and_maps_without_a_cell_are_taken() {
        let ray = |x: usize, y: usize| {
            let direction = DVec3::new(x as f64 - 2.0, 2.0 - y as f64, 8.0).normalize();
            (DVec3::new(0.0, 0.0, -8.0), direction)
        };
        // A sphere around the camera: every edge is as steep as the rays are far apart, however far away.
        for distance in [0.01, 1e4] {
            let (mesh, _) = sheet([5, 5], ray, &[Some(distance); 25]);
            assert_eq!((mesh.triangles.len(), mesh.open_edges), (32, 16));
        }
        for size in [[1, 9], [9, 1], [0, 0]] {
            assert!(sheet(size, along_z, &[Some(1.0); 9]).0.triangles.is_empty());
        }
        assert!(sheet([3, 3], along_z, &[None; 9]).0.vertices.is_empty());
    }
}
