//! Surface nets: in each cell that the surface crosses, a vertex at the mean of the points where it crosses the cell's edges; around each
//! crossed edge, a polygon of the vertices of its four cells (Gibson, *Constrained elastic surface nets*, MICCAI 1998). That is dual
//! contouring without its error function.
//!
//! A cell that holds several patches of the surface has a vertex for each (`cell`), after Nielson, *Dual marching cubes*, IEEE
//! Visualization 2004. Two patches that meet on both sides of a face would still share one edge four times: there a vertex is put on the
//! face. So the mesh is a manifold for any values.
//!
//! The lattice comes slice by slice. Memory: a few slices of values, the crossed cells of a few layers, and the mesh. The rows of a layer are
//! searched at the same time, and slices are filled while polygons are made of those before ([`super::polygons`]).

use super::Mesh;
use super::cell;
use super::polygons::{Builder, Cell, Vertex, cells_of};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::{Arc, mpsc};

/// Layers that are found before polygons are made of them.
const LAYERS_AHEAD: usize = 2;

/// Which surface of a lattice of values to find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Values of at least this are inside.
    pub threshold: f64,
    /// True: close the surface at the border of the lattice and of the known values, half a voxel outside of the last voxel. False: the
    /// surface ends there.
    pub closed: bool,
}

/// The isosurface of a lattice of `size` voxels. `slice` fills a slice of this number with values, row by row, NaN where they are not known; slices
/// are requested once each, in order. `place` maps fractional voxel indices, whole at the centres of voxels, to mm; if it mirrors, the order of the
/// vertices is reversed, so that triangles are still anticlockwise as seen from outside.
///
/// # Errors
/// An error of `slice`, or a message that the surface has too many triangles.
pub fn surface_net<E: From<String> + Send>(
    size: [usize; 3],
    surface: Surface,
    mut slice: impl FnMut(usize, &mut [f64]) -> Result<(), E> + Send,
    place: impl Fn(DVec3) -> DVec3,
) -> Result<Mesh, E> {
    let cells = cells_of(size, surface.closed);
    if cells.contains(&0) {
        return Ok(Mesh::default());
    }
    // A closed surface has a layer of unknown voxels all around.
    let pad = usize::from(surface.closed);
    let (width, height) = (cells[0] + 1, cells[1] + 1);
    let mut own = vec![f64::NAN; size[0] * size[1]];
    let mut fill = |z: usize| -> Result<Arc<Vec<f64>>, E> {
        let mut out = vec![f64::NAN; width * height];
        if (pad..pad + size[2]).contains(&z) {
            slice(z - pad, &mut own)?;
            for (y, row) in own.chunks_exact(size[0]).enumerate() {
                let at = (y + pad) * width + pad;
                out[at..at + size[0]].copy_from_slice(row);
            }
        }
        Ok(Arc::new(out))
    };
    let (sender, layers) = mpsc::sync_channel(LAYERS_AHEAD);
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut send_layers = || -> Result<(), E> {
                let mut above = fill(0)?;
                for z in 0..cells[2] {
                    let below = std::mem::replace(&mut above, fill(z + 1)?);
                    let slices = Slices { surface, width, values: [below, above.clone()] };
                    let crossed = slices.crossed();
                    // Nobody takes them any more where a mesh has too many triangles.
                    if sender.send(Ok((slices, crossed))).is_err() {
                        break;
                    }
                }
                Ok(())
            };
            if let Err(error) = send_layers() {
                drop(sender.send(Err(error)));
            }
        });
        let mut builder = Builder::new(surface.closed, place);
        for layer in layers {
            let (slices, crossed): (Slices, _) = layer?;
            builder.take(crossed, |vertex| slices.offset(vertex))?;
        }
        Ok(builder.finish())
    })
}

/// The slices below and above a layer of cells.
struct Slices {
    surface: Surface,
    width: usize,
    values: [Arc<Vec<f64>>; 2],
}

impl Slices {
    fn corner(&self, x: usize, y: usize, corner: usize) -> f64 {
        self.values[corner >> 2][(y + (corner >> 1 & 1)) * self.width + x + (corner & 1)]
    }

    /// The cells that the surface crosses.
    fn crossed(&self) -> Vec<Cell> {
        let across = self.width - 1;
        let rows = self.values[0].len() / self.width - 1;
        let cell = |x: usize, y: usize| {
            let values: [f64; 8] = std::array::from_fn(|corner| self.corner(x, y, corner));
            // Not for NaN.
            let is_inside = |n: &usize| values[*n] >= self.surface.threshold;
            let inside = (0..8).filter(is_inside).fold(0u8, |bits, n| bits | 1 << n);
            let is_known = self.surface.closed || !values.iter().any(|value| value.is_nan());
            (inside != 0 && inside != u8::MAX).then_some(Cell { x: x as u32, y: y as u32, inside, is_known })
        };
        (0..rows).into_par_iter().flat_map_iter(|y| (0..across).filter_map(move |x| cell(x, y))).collect()
    }

    /// Where a vertex is, from the first corner of its cell, voxels.
    fn offset(&self, vertex: &Vertex) -> DVec3 {
        let [x, y, _] = vertex.cell.map(|n| n as usize);
        let values = std::array::from_fn(|corner| self.corner(x, y, corner));
        mean_crossing(&values, self.surface.threshold, vertex.edges)
    }
}

/// The mean of the points at which the surface crosses some edges of a cell, from its first corner, voxels. `values`: of the corners, NaN
/// where they are not known. `edges`: a bit for each.
fn mean_crossing(values: &[f64; 8], threshold: f64, edges: u16) -> DVec3 {
    let of_edge = |edge: usize| {
        let ends = cell::corners_of(edge);
        let [a, b] = ends.map(|corner| values[corner]);
        let [from, to] = ends.map(|corner| DVec3::from([0, 1, 2].map(|axis| (corner >> axis & 1) as f64)));
        from.lerp(to, crossing(threshold, a, b))
    };
    let edges = (0..12).filter(|edge| edges >> edge & 1 == 1);
    let (sum, count) = edges.fold((DVec3::ZERO, 0.0), |(sum, count), edge| (sum + of_edge(edge), count + 1.0));
    sum / count
}

/// Share of the way from an inside value to another at which the surface is.
fn crossing(threshold: f64, a: f64, b: f64) -> f64 {
    // Of the unknown nothing is known but that the border is between.
    if a.is_nan() || b.is_nan() {
        return 0.5;
    }
    let share = (threshold - a) / (b - a);
    // Values near the limits of f64 overflow.
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Test helper: the mesh of a function of the voxel index, on a lattice with a spacing of `h`.
    pub fn net(size: [usize; 3], threshold: f64, closed: bool, h: f64, value: impl Fn(DVec3) -> f64 + Sync) -> Mesh {
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
    pub(crate) fn closed_manifold(mesh: &Mesh) -> i64 {
        // The sides of triangles as they are run along, each with the corner opposite. Sorted: a hash of thousands of small meshes costs more.
        let mut sides: Vec<[u32; 3]> = Vec::with_capacity(3 * mesh.triangles.len());
        for [a, b, c] in mesh.triangles.iter().copied() {
            assert!(a != b && b != c && a != c, "a triangle without three corners");
            sides.extend([[a, b, c], [b, c, a], [c, a, b]]);
        }
        sides.sort_unstable();
        assert!(sides.windows(2).all(|two| two[0][..2] != two[1][..2]), "an edge is run along twice in one direction");
        let opposite = |u: u32, v: u32| {
            let found = sides.binary_search_by_key(&(u, v), |side| (side[0], side[1]));
            found.ok().map(|n| sides[n][2])
        };
        assert!(sides.iter().all(|[u, v, _]| opposite(*v, *u).is_some()), "an edge has one triangle");
        let mut degree = vec![0; mesh.vertices.len()];
        sides.iter().for_each(|[u, ..]| degree[*u as usize] += 1);
        // Round each vertex once, from triangle to triangle: a fan has all its sides.
        for fan in sides.chunk_by(|one, other| one[0] == other[0]) {
            let [u, first, _] = fan[0];
            let (mut at, mut steps) = (first, 0);
            loop {
                at = opposite(u, at).expect("a side of this vertex");
                steps += 1;
                // A walk that never comes back is no fan either.
                if at == first || steps > fan.len() {
                    break;
                }
            }
            assert_eq!(steps, degree[u as usize], "two fans share a vertex");
        }
        assert!(degree.iter().all(|d| *d > 0), "a vertex has no triangle");
        mesh.vertices.len() as i64 - sides.len() as i64 / 2 + mesh.triangles.len() as i64
    }

    #[test]
    fn what_is_no_closed_manifold_is_noticed() {
        let tetrahedron = |[a, b, c, d]: [u32; 4]| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let mesh = |triangles: Vec<[u32; 3]>| {
            let most = triangles.iter().flatten().max().map_or(0, |n| *n as usize + 1);
            Mesh { vertices: vec![DVec3::ZERO; most], triangles, ..Mesh::default() }
        };
        let is_one = |triangles: Vec<[u32; 3]>| std::panic::catch_unwind(|| closed_manifold(&mesh(triangles))).ok();
        let one = tetrahedron([0, 1, 2, 3]).to_vec();
        assert_eq!(is_one(one.clone()), Some(2));
        let apart = [one.clone(), tetrahedron([4, 5, 6, 7]).to_vec()].concat();
        assert_eq!(is_one(apart), Some(4));
        let joined_at_a_vertex = [one.clone(), tetrahedron([0, 4, 5, 6]).to_vec()].concat();
        let joined_at_an_edge = [one.clone(), tetrahedron([0, 1, 4, 5]).to_vec()].concat();
        let [a, b, c] = one[3];
        let (turned, twice) = ([&one[..3], &[[b, a, c]]].concat(), one.repeat(2));
        for wrong in [one[..3].to_vec(), joined_at_a_vertex, joined_at_an_edge, turned, twice, vec![[0, 1, 1]]] {
            assert_eq!(is_one(wrong.clone()), None, "{wrong:?}");
        }
    }

    /// Test helper: the mesh of a ball from its signed distances (positive inside) on n^3 voxels, their spacing, and the centre of the ball.
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

    /// The 4,096 pairs lie apart in one lattice of 16 x 16 x 16 blocks.
    #[test]
    fn every_pair_of_cells_makes_a_closed_manifold() {
        for axis in 0..3 {
            let size = [0, 1, 2].map(|n| if n == axis { 3 } else { 2 });
            // The block that a place is in, and the voxel of it.
            let block = |v: DVec3| {
                let at = v.to_array().map(|i| (i + 0.75) as usize);
                let [x, y, z] = [0, 1, 2].map(|n| (at[n] / (size[n] + 2), at[n] % (size[n] + 2)));
                (x.0 + 16 * (y.0 + 16 * z.0), [x.1, y.1, z.1])
            };
            let value = |v: DVec3| {
                let (bits, [x, y, z]) = block(v);
                let is_within = x < size[0] && y < size[1] && z < size[2];
                f64::from(u8::from(is_within && bits >> (x + size[0] * (y + size[1] * z)) & 1 == 1))
            };
            let mesh = net(size.map(|n| 16 * (n + 2)), 0.5, true, 1.0, value);
            closed_manifold(&mesh);
            assert_eq!(mesh.open_edges, 0);
            let mut blocks = vec![0; 4096];
            mesh.vertices.iter().for_each(|v| blocks[block(v.max(DVec3::ZERO)).0] += 1);
            // Six at least: a voxel alone is an octahedron or more.
            assert!(blocks.iter().enumerate().all(|(bits, vertices)| (bits > 0) == (*vertices >= 6)), "{blocks:?}");
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
