//! Surface nets: in each cell that the surface crosses, a vertex at the mean of the points where it crosses the cell's edges; around each
//! crossed edge, a polygon of the vertices of its four cells (Gibson, *Constrained elastic surface nets*, MICCAI 1998). That is dual
//! contouring without its error function.
//!
//! A cell that holds several patches of the surface has a vertex for each ([`super::cell`]), after Nielson, *Dual marching cubes*, IEEE
//! Visualization 2004. Two patches that meet on both sides of a face would still share one edge four times: there a vertex is put on the
//! face. So the mesh is a manifold for any values.
//!
//! The lattice comes slice by slice. Memory: two slices of values and of cells, and the mesh.

use super::Mesh;
use super::cell::{self, Patches};
use glam::DVec3;
use std::collections::HashMap;

/// Most triangles of a mesh: 5 GB as STL.
const MAX_TRIANGLES: usize = 100_000_000;

/// The surface to find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Values from here on are inside.
    pub threshold: f64,
    /// Closes the surface at the border of the lattice and of what is known, half a voxel outside of the last one. Otherwise it ends there.
    pub closed: bool,
}

/// A cell that has been visited.
#[derive(Clone, Copy, Default)]
struct Cell {
    /// A bit for each corner that is inside.
    inside: u8,
    /// All corners are known.
    known: bool,
    /// Vertex of the first patch.
    first: u32,
}

/// The surface of the values of a lattice of `size` voxels. `slice` fills a slice with values, NaN where they are not known; slices are asked
/// for once, in order. `place`: fractional voxel indices to mm; a map that mirrors turns the triangles round, so that they are still
/// anticlockwise as seen from outside.
///
/// # Errors
/// An error of `slice`, or in words more triangles than are made.
pub fn surface_net<E: From<String>>(
    size: [usize; 3],
    surface: Surface,
    mut slice: impl FnMut(usize, &mut [f64]) -> Result<(), E>,
    place: impl Fn(DVec3) -> DVec3,
) -> Result<Mesh, E> {
    // A closed surface has a layer of unknown voxels all around.
    let pad = usize::from(surface.closed);
    let [width, height, depth] = size.map(|n| n + 2 * pad);
    if width < 2 || height < 2 || depth < 2 || size.contains(&0) {
        return Ok(Mesh::default());
    }
    let mut own = vec![f64::NAN; size[0] * size[1]];
    let mut fill = |z: usize, out: &mut Vec<f64>| -> Result<(), E> {
        out.clear();
        out.resize(width * height, f64::NAN);
        if z < pad || z >= pad + size[2] {
            return Ok(());
        }
        slice(z - pad, &mut own)?;
        for (y, row) in own.chunks_exact(size[0]).enumerate() {
            let at = (y + pad) * width + pad;
            out[at..at + size[0]].copy_from_slice(row);
        }
        Ok(())
    };
    let turned = place(DVec3::X) - place(DVec3::ZERO);
    let turned = turned.cross(place(DVec3::Y) - place(DVec3::ZERO)).dot(place(DVec3::Z) - place(DVec3::ZERO));
    let mut builder = Builder {
        surface,
        width,
        height,
        mirrored: turned < 0.0,
        table: cell::patches(),
        values: [Vec::new(), Vec::new()],
        cells: [Vec::new(), Vec::new()],
        on_faces: HashMap::new(),
        mesh: Mesh::default(),
    };
    let shift = DVec3::splat(pad as f64);
    let place = |at: DVec3| place(at - shift);
    fill(0, &mut builder.values[1])?;
    for z in 0..depth {
        builder.values.swap(0, 1);
        builder.cells.swap(0, 1);
        // Beyond the last slice there are no cells, only the edges within it.
        if z + 1 < depth {
            fill(z + 1, &mut builder.values[1])?;
            builder.vertices(z, &place);
            builder.face_vertices(z, &place);
        } else {
            builder.cells[1].clear();
        }
        builder.polygons(z, depth);
        if builder.mesh.triangles.len() > MAX_TRIANGLES || builder.mesh.vertices.len() > MAX_TRIANGLES {
            let fault =
                format!("makes more than {MAX_TRIANGLES} triangles; take a larger spacing or another threshold");
            return Err(fault.into());
        }
    }
    Ok(builder.mesh)
}

struct Builder {
    surface: Surface,
    width: usize,
    height: usize,
    mirrored: bool,
    table: &'static [Patches; 256],
    /// The slice below the current layer of cells, and the one above.
    values: [Vec<f64>; 2],
    /// The layer of cells before the current one, and the current one; empty if there is none.
    cells: [Vec<Cell>; 2],
    /// Vertices on faces that two patches share with the same two patches. There are few.
    on_faces: HashMap<Arc, u32>,
    mesh: Mesh,
}

/// A pair of crossed edges that are joined on a face of four.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Arc {
    /// The corner of the face nearest to the first voxel.
    face: [usize; 3],
    normal: usize,
    /// The voxel that the pair cuts off, which is inside.
    inside: [usize; 3],
}

impl Builder {
    fn is_inside(&self, value: f64) -> bool {
        // Not for NaN.
        value >= self.surface.threshold
    }

    /// Share of the way from an inside value to another at which the surface is.
    fn crossing(&self, a: f64, b: f64) -> f64 {
        // Of the unknown nothing is known but that the border is between.
        if a.is_nan() || b.is_nan() {
            return 0.5;
        }
        let share = (self.surface.threshold - a) / (b - a);
        // Values near the limits of f64 overflow.
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 }
    }

    /// The point where the surface crosses an edge of the cell at (x, y), in the current layer, from the cell's first corner.
    fn crossing_of(&self, x: usize, y: usize, edge: usize) -> DVec3 {
        let ends = cell::corners_of(edge);
        let [a, b] = ends.map(|corner| self.corner(x, y, corner));
        let [from, to] = ends.map(|corner| DVec3::from([0, 1, 2].map(|axis| (corner >> axis & 1) as f64)));
        from.lerp(to, self.crossing(a, b))
    }

    fn corner(&self, x: usize, y: usize, corner: usize) -> f64 {
        self.values[corner >> 2][(y + (corner >> 1 & 1)) * self.width + x + (corner & 1)]
    }

    /// Makes the vertices of the cells between slices z and z + 1.
    fn vertices(&mut self, z: usize, place: &impl Fn(DVec3) -> DVec3) {
        let across = self.width - 1;
        let mut cells = std::mem::take(&mut self.cells[1]);
        cells.clear();
        cells.resize(across * (self.height - 1), Cell::default());
        for (n, target) in cells.iter_mut().enumerate() {
            let (x, y) = (n % across, n / across);
            let values: [f64; 8] = std::array::from_fn(|corner| self.corner(x, y, corner));
            let inside = (0..8).filter(|n| self.is_inside(values[*n])).fold(0u8, |bits, n| bits | 1 << n);
            let known = self.surface.closed || !values.iter().any(|value| value.is_nan());
            *target = Cell { inside, known, first: self.mesh.vertices.len() as u32 };
            let patches = self.table[usize::from(inside)];
            if !known {
                continue;
            }
            for patch in 0..patches.count {
                let edges = (0..12).filter(|e| cell::is_crossed(inside, *e) && patches.of_edge[*e] == patch);
                let (sum, count) = edges
                    .fold((DVec3::ZERO, 0.0), |(sum, count), edge| (sum + self.crossing_of(x, y, edge), count + 1.0));
                let first = DVec3::new(x as f64, y as f64, z as f64);
                self.mesh.vertices.push(place(first + sum / count));
            }
        }
        self.cells[1] = cells;
    }

    /// Makes the vertices on the faces of the current layer of cells, and on those between it and the one before.
    fn face_vertices(&mut self, z: usize, place: &impl Fn(DVec3) -> DVec3) {
        // Those of the layer before are still needed.
        self.on_faces.retain(|arc, _| arc.face[2] + 1 >= z);
        let across = self.width - 1;
        for n in 0..self.cells[1].len() {
            let here = self.cells[1][n];
            let (x, y) = (n % across, n / across);
            let faces = [
                (0, x.checked_sub(1).map(|_| self.cells[1][n - 1])),
                (1, y.checked_sub(1).map(|_| self.cells[1][n - across])),
                (2, self.cells[0].get(n).copied()),
            ];
            for (normal, before) in faces {
                let Some(before) = before.filter(|before| before.known && here.known) else { continue };
                if !self.is_doubled(&before, &here, normal) {
                    continue;
                }
                for edge in cell::edges_of_face(normal, 0) {
                    let other = cell::partner(here.inside, normal, 0, edge);
                    // Each pair once.
                    if other < edge {
                        continue;
                    }
                    let on_face = (self.crossing_of(x, y, edge) + self.crossing_of(x, y, other)) / 2.0;
                    let first = DVec3::new(x as f64, y as f64, z as f64);
                    let arc = arc([x, y, z], here.inside, normal, 0, edge);
                    self.on_faces.insert(arc, self.mesh.vertices.len() as u32);
                    self.mesh.vertices.push(place(first + on_face));
                }
            }
        }
    }

    /// True if both pairs of edges of the face between two cells belong to one patch on each side.
    fn is_doubled(&self, before: &Cell, after: &Cell, normal: usize) -> bool {
        let is_one = |cell: &Cell, side: usize| {
            let patches = &self.table[usize::from(cell.inside)];
            let [first, others @ ..] = cell::edges_of_face(normal, side).map(|edge| patches.of_edge[edge]);
            others.iter().all(|patch| *patch == first)
        };
        cell::is_ambiguous(after.inside, normal, 0) && is_one(before, 1) && is_one(after, 0)
    }

    /// Makes the polygons around the edges in slice z and of those from it to the next.
    fn polygons(&mut self, z: usize, depth: usize) {
        let (width, height) = (self.width, self.height);
        for y in 0..height {
            for x in 0..width {
                let inside = self.is_inside(self.values[0][y * width + x]);
                let ends = [
                    (x + 1 < width).then(|| self.values[0][y * width + x + 1]),
                    (y + 1 < height).then(|| self.values[0][(y + 1) * width + x]),
                    (z + 1 < depth).then(|| self.values[1][y * width + x]),
                ];
                for (axis, end) in ends.into_iter().enumerate() {
                    if end.is_some_and(|end| self.is_inside(end) != inside) {
                        self.polygon(axis, [x, y, z], inside);
                    }
                }
            }
        }
    }

    /// The cell that begins one voxel before another or at it, along each axis. Its layer is the current one or the one before.
    fn cell_at(&self, [x, y, _]: [usize; 3], before: [usize; 3]) -> Option<Cell> {
        let (x, y) = (x.checked_sub(before[0])?, y.checked_sub(before[1])?);
        let layer = &self.cells[1 - before[2]];
        let is_there = x + 1 < self.width && y + 1 < self.height;
        layer.get(y * (self.width - 1) + x).copied().filter(|cell| is_there && cell.known)
    }

    /// The polygon around the edge from a voxel along `axis`, whose first end is inside or not.
    fn polygon(&mut self, axis: usize, voxel: [usize; 3], inside: bool) {
        let axes = [(axis + 1) % 3, (axis + 2) % 3];
        // Steps back along both other axes: anticlockwise as seen from where the edge points to.
        const AROUND: [[usize; 2]; 4] = [[1, 1], [0, 1], [0, 0], [1, 0]];
        let mut around = [(Cell::default(), [0; 3], 0); 4];
        for (target, back) in around.iter_mut().zip(AROUND) {
            let mut before = [0; 3];
            (before[axes[0]], before[axes[1]]) = (back[0], back[1]);
            let Some(cell) = self.cell_at(voxel, before) else {
                self.mesh.open_edges += 1;
                return;
            };
            // In a cell that begins before the edge, it lies on the far side.
            *target = (cell, before, cell::edge_at(axis, back[0], back[1]));
        }
        let (mut corners, mut on_face) = (Vec::with_capacity(8), None);
        for n in 0..4 {
            let ((cell, before, edge), (other, other_before, _)) = (around[n], around[(n + 1) % 4]);
            let patch = self.table[usize::from(cell.inside)].of_edge[edge];
            corners.push(cell.first + u32::from(patch));
            // The face between this cell and the next one round the edge.
            let normal = if before[axes[0]] != other_before[axes[0]] { axes[0] } else { axes[1] };
            let is_first = before[normal] > other_before[normal];
            let (first, second) = if is_first { (&cell, &other) } else { (&other, &cell) };
            if self.is_doubled(first, second, normal) {
                let start = [0, 1, 2].map(|axis| voxel[axis] - before[axis]);
                let arc = arc(start, cell.inside, normal, usize::from(is_first), edge);
                if let Some(vertex) = self.on_faces.get(&arc) {
                    on_face = Some(corners.len());
                    corners.push(*vertex);
                }
            }
        }
        if inside == self.mirrored {
            corners.reverse();
            on_face = on_face.map(|n| corners.len() - 1 - n);
        }
        // A vertex on a face belongs to two polygons only, so that its diagonals are no other polygon's edges.
        let start = on_face.unwrap_or_else(|| self.shorter_diagonal(&corners));
        corners.rotate_left(start);
        for pair in corners[1..].windows(2) {
            self.mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    /// Where the shorter diagonal of a quadrangle begins.
    fn shorter_diagonal(&self, corners: &[u32]) -> usize {
        let length = |a: usize, b: usize| {
            let at = |n: usize| self.mesh.vertices[corners[n] as usize];
            at(a).distance_squared(at(b))
        };
        usize::from(length(1, 3) < length(0, 2))
    }
}

/// The pair that an edge belongs to on an ambiguous face of the cell that begins at `start`.
fn arc(start: [usize; 3], inside: u8, normal: usize, side: usize, edge: usize) -> Arc {
    let mut face = start;
    face[normal] += side;
    let ends = cell::corners_of(edge);
    let cut_off = if inside >> ends[0] & 1 == 1 { ends[0] } else { ends[1] };
    Arc { face, normal, inside: [0, 1, 2].map(|axis| start[axis] + (cut_off >> axis & 1)) }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The net of a function of the voxel, with voxels `h` apart.
    pub fn net(size: [usize; 3], threshold: f64, closed: bool, h: f64, value: impl Fn(DVec3) -> f64) -> Mesh {
        let slice = |z: usize, out: &mut [f64]| {
            for (n, out) in out.iter_mut().enumerate() {
                *out = value(DVec3::new((n % size[0]) as f64, (n / size[0]) as f64, z as f64));
            }
            Ok::<(), String>(())
        };
        surface_net(size, Surface { threshold, closed }, slice, |at| at * h).expect("a mesh")
    }

    /// Checks that every edge belongs to two triangles that run along it in opposite directions, that the triangles around each vertex are one
    /// fan, and that no triangle has a vertex twice. Returns the Euler characteristic.
    pub fn closed_manifold(mesh: &Mesh) -> i64 {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        let mut next: HashMap<(u32, u32), u32> = HashMap::new();
        for [a, b, c] in mesh.triangles.iter().copied() {
            assert!(a != b && b != c && a != c, "a triangle without three corners");
            for (u, v, w) in [(a, b, c), (b, c, a), (c, a, b)] {
                *edges.entry((u, v)).or_default() += 1;
                assert!(next.insert((u, v), w).is_none(), "an edge is run along twice in one direction");
            }
        }
        assert!(edges.keys().all(|(u, v)| edges.contains_key(&(*v, *u))), "an edge has one triangle");
        let mut degree = vec![0; mesh.vertices.len()];
        edges.keys().for_each(|(u, _)| degree[*u as usize] += 1);
        for (u, v) in edges.keys() {
            // Round the vertex u, from triangle to triangle.
            let (mut at, mut steps) = (*v, 0);
            loop {
                at = next[&(*u, at)];
                steps += 1;
                if at == *v {
                    break;
                }
            }
            assert_eq!(steps, degree[*u as usize], "two fans share a vertex");
        }
        assert!(degree.iter().all(|d| *d > 0), "a vertex has no triangle");
        mesh.vertices.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64
    }

    /// Distances from the surface of a ball, positive within, of a lattice of n^3 voxels.
    pub fn ball(n: usize, radius: f64) -> (Mesh, f64, DVec3) {
        let h = 2.0 / (n - 1) as f64;
        let centre = DVec3::new(0.97, 1.02, 1.01);
        let mesh = net([n; 3], 0.0, true, h, |at| radius - (at * h).distance(centre));
        (mesh, h, centre)
    }

    #[test]
    fn a_ball_has_its_volume_and_area_to_the_second_order() {
        const R: f64 = 0.8;
        let (volume, area) = (4.0 / 3.0 * std::f64::consts::PI * R.powi(3), 4.0 * std::f64::consts::PI * R * R);
        let mut before: Option<[f64; 2]> = None;
        for n in [13, 25, 49] {
            let (mesh, h, centre) = ball(n, R);
            assert_eq!((closed_manifold(&mesh), mesh.open_edges), (2, 0));
            // Crossings are found to h^2 / (8 R). A vertex lies within the hull of crossings at most sqrt(3) h apart, a triangle within that of
            // vertices at most 2 sqrt(3) h apart: nothing lies deeper than (1/8 + 3/8 + 12/8) h^2 / R below the ball, nor above it.
            let depth = 2.0 * h * h / R;
            for triangle in &mesh.triangles {
                let corners = triangle.map(|n| mesh.vertices[n as usize]);
                let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
                let below = R - middle.distance(centre);
                assert!((-1e-9..=depth).contains(&below), "{below} below the ball, at most {depth}");
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                assert!(normal.dot(middle - centre) > 0.0, "a triangle faces inwards");
            }
            let errors = [1.0 - mesh.volume() / volume, 1.0 - mesh.area() / area];
            assert!((0.0..3.0 * depth / R).contains(&errors[0]), "volume: {}", errors[0]);
            assert!(errors[1].abs() < 2.0 * depth / R, "area: {}", errors[1]);
            if let Some(before) = before {
                let orders = [0, 1].map(|n| (before[n] / errors[n]).log2());
                assert!(orders.iter().all(|order| (1.8..2.2).contains(order)), "orders {orders:?}");
            }
            before = Some(errors);
            let normals = mesh.normals();
            let worst = mesh.vertices.iter().zip(&normals).map(|(v, n)| n.dot((*v - centre).normalize()));
            assert!(worst.fold(1.0, f64::min) > 1.0 - 4.0 * h * h / (R * R), "a normal is off");
        }
    }

    #[test]
    fn every_pair_of_cells_makes_a_closed_manifold() {
        for axis in 0..3 {
            let size = [0, 1, 2].map(|n| if n == axis { 3 } else { 2 });
            for bits in 0..1u32 << 12 {
                let at = |v: DVec3| (v.x as usize) + size[0] * (v.y as usize + size[1] * v.z as usize);
                let mesh = net(size, 0.5, true, 1.0, |v| f64::from(bits >> at(v) & 1));
                closed_manifold(&mesh);
                assert!(mesh.open_edges == 0 && (bits == 0) == mesh.triangles.is_empty());
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn noise_makes_a_closed_manifold_with_voxels_inside_on_its_inner_side(
            values in proptest::collection::vec(0u8..4, 216), threshold in 0.0..3.5f64, unknown in 0u8..2
        ) {
            let value = |v: DVec3| match values[v.x as usize + 6 * (v.y as usize + 6 * v.z as usize)] {
                0 if unknown == 1 => f64::NAN,
                value => f64::from(value),
            };
            let mesh = net([6; 3], threshold, true, 0.5, value);
            closed_manifold(&mesh);
            prop_assert!(mesh.volume() >= 0.0);
            prop_assert!(mesh.vertices.iter().all(|v| v.is_finite()));
        }
    }

    #[test]
    fn an_open_surface_ends_at_the_border_and_a_closed_one_half_a_voxel_beyond() {
        // A slab from x = 1.25 on, of values that rise by 1 from voxel to voxel.
        let open = net([5, 4, 3], 1.25, false, 1.0, |v| v.x);
        assert_eq!(open.open_edges, 10, "of 4 x 3 crossed edges two have all their cells");
        assert_eq!(open.triangles.len(), 4);
        assert!(open.vertices.iter().all(|v| (v.x - 1.25).abs() < 1e-12));
        let closed = net([5, 4, 3], 1.25, true, 1.0, |v| v.x);
        assert_eq!(closed_manifold(&closed), 2);
        let low = closed.vertices.iter().copied().reduce(DVec3::min);
        let high = closed.vertices.iter().copied().reduce(DVec3::max);
        // Where the slope meets the cap, a vertex is the mean of both.
        assert!(low.is_some_and(|v| v.x >= 1.25 - 1e-12 && v.y == -0.5 && v.z == -0.5), "{low:?}");
        assert_eq!(high, Some(DVec3::new(4.5, 3.5, 2.5)));
        // What is not known is border too.
        let gap = |v: DVec3| if v.y > 2.5 { f64::NAN } else { v.x };
        assert_eq!(net([5, 4, 3], 1.25, false, 1.0, gap).triangles.len(), 2);
        assert_eq!(closed_manifold(&net([5, 4, 3], 1.25, true, 1.0, gap)), 2);
        assert!(net([5, 1, 3], 1.25, false, 1.0, |v| v.x).triangles.is_empty());
        assert_eq!(closed_manifold(&net([5, 1, 3], 1.25, true, 1.0, |v| v.x)), 2);
    }

    #[test]
    fn a_mirrored_place_keeps_the_outside_outside() {
        let value = |v: DVec3| 2.0 - v.distance(DVec3::splat(3.0));
        let mut meshes = Vec::new();
        for mirror in [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, 1.0, -0.5)] {
            let slice = |z: usize, out: &mut [f64]| {
                out.iter_mut().enumerate().for_each(|(n, out)| {
                    *out = value(DVec3::new((n % 7) as f64, (n / 7) as f64, z as f64));
                });
                Ok::<(), String>(())
            };
            let surface = Surface { threshold: 0.0, closed: false };
            let mesh = surface_net([7; 3], surface, slice, |at| at * mirror + DVec3::splat(1e4)).expect("a mesh");
            assert_eq!(closed_manifold(&mesh), 2);
            meshes.push(mesh.volume());
        }
        // Which diagonal of a quadrangle is shorter depends on the place, if they are about the same.
        let shares = [meshes[1] / meshes[0], 2.0 * meshes[2] / meshes[0]];
        assert!(meshes[0] > 20.0 && shares.iter().all(|share| (share - 1.0).abs() < 0.05), "{meshes:?}");
    }

    #[test]
    fn an_error_of_a_slice_ends_the_work() {
        let failing = |z: usize, _: &mut [f64]| if z == 2 { Err("gone".to_string()) } else { Ok(()) };
        let surface = Surface { threshold: 0.5, closed: true };
        assert_eq!(surface_net([4; 3], surface, failing, |at| at), Err("gone".to_string()));
    }
}
