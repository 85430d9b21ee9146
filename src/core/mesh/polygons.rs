//! Builds a mesh from the crossed cells of a lattice: its vertices and the polygons between them. Both follow from signs alone. The caller
//! computes the positions of the vertices.
//!
//! Only crossed cells are kept, of two layers. Layers, cells and vertices are in the order of the lattice: the same values make the same file.

use super::Mesh;
use super::cell::{self, Patches};
use glam::DVec3;
use std::collections::HashMap;

/// Most triangles of a mesh: 5 GB as STL.
const MAX_TRIANGLES: usize = 100_000_000;

/// A cell of the lattice that the surface crosses: some of its corners are inside, others outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    pub x: u32,
    pub y: u32,
    /// Bit n is set if corner n is inside: the corner at (n & 1, n >> 1 & 1, n >> 2 & 1) from the first corner of the cell.
    pub inside: u8,
    /// True if the values at all corners are known, or if the surface is to be closed where they are not.
    pub is_known: bool,
}

/// Identifies a vertex: it is the mean of the points at which the surface crosses these edges of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vertex {
    pub cell: [u32; 3],
    /// Bit 4 a + m is set for each crossed edge that the mean is taken over: the edge along axis a whose place along the next axis (cyclically) is
    /// bit 0 of m, and along the one after it bit 1.
    pub edges: u16,
}

/// A layer of cells: each with its first vertex, in the order of rows and of columns within them.
type Layer = Vec<(Cell, u32)>;

/// Builds the mesh of a lattice from the cells that the surface crosses, layer by layer. The cells of a closed surface begin one voxel before the
/// lattice along each axis.
pub struct Builder<P> {
    /// Voxels before the lattice.
    pad: usize,
    place: P,
    mirrored: bool,
    table: &'static [Patches; 256],
    /// The last layer that was taken, and its number plus one.
    last: Layer,
    taken: usize,
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

/// Number of cells along each axis, for a lattice of `size` voxels.
pub(crate) fn cells_of(size: [usize; 3], closed: bool) -> [usize; 3] {
    let pad = usize::from(closed);
    match size.contains(&0) {
        true => [0; 3],
        false => size.map(|n| n + 2 * pad - 1),
    }
}

impl<P: Fn(DVec3) -> DVec3> Builder<P> {
    /// `closed`: whether the surface is closed at the border of the lattice ([`Surface::closed`](super::nets::Surface::closed)). `place` maps
    /// fractional voxel indices to mm. If it mirrors, the order of the vertices is reversed, so that triangles are still anticlockwise as seen from
    /// outside.
    pub fn new(closed: bool, place: P) -> Builder<P> {
        let turned = place(DVec3::X) - place(DVec3::ZERO);
        let turned = turned.cross(place(DVec3::Y) - place(DVec3::ZERO)).dot(place(DVec3::Z) - place(DVec3::ZERO));
        Builder {
            pad: usize::from(closed),
            place,
            mirrored: turned < 0.0,
            table: cell::patches(),
            last: Vec::new(),
            taken: 0,
            on_faces: HashMap::new(),
            mesh: Mesh::default(),
        }
    }

    /// Takes the crossed cells of the next layer, ordered by row and column. `offset`: position of a vertex relative to the first corner of its cell,
    /// voxels.
    ///
    /// # Errors
    /// One line: the mesh would have too many triangles.
    pub fn take(&mut self, cells: Vec<Cell>, offset: impl Fn(&Vertex) -> DVec3) -> Result<(), String> {
        let (z, begin) = (self.taken, self.mesh.vertices.len());
        // Those of the layer before are still needed.
        self.on_faces.retain(|arc, _| arc.face[2] + 1 >= z);
        let (before, mut vertices) = (std::mem::take(&mut self.last), Vec::new());
        let layer = self.patch_vertices(z, cells, begin, &mut vertices);
        self.face_vertices(z, &before, &layer, begin, &mut vertices);
        if begin + vertices.len() > MAX_TRIANGLES {
            return Err(too_many());
        }
        for vertex in &vertices {
            let corner = DVec3::from_array(vertex.cell.map(|n| f64::from(n) - self.pad as f64));
            self.mesh.vertices.push((self.place)(corner + offset(vertex)));
        }
        self.polygons(z, &before, &layer);
        if self.mesh.triangles.len() > MAX_TRIANGLES {
            return Err(too_many());
        }
        (self.taken, self.last) = (z + 1, layer);
        Ok(())
    }

    /// Returns the mesh, after the last layer was taken.
    pub fn finish(mut self) -> Mesh {
        // Beyond the last layer there are no cells, only the edges within its slice.
        let last = std::mem::take(&mut self.last);
        self.polygons(self.taken, &last, &Vec::new());
        self.mesh
    }

    /// Adds the vertices of the patches of a layer's cells.
    fn patch_vertices(&self, z: usize, cells: Vec<Cell>, begin: usize, vertices: &mut Vec<Vertex>) -> Layer {
        let mut layer = Layer::with_capacity(cells.len());
        for cell in cells {
            layer.push((cell, (begin + vertices.len()) as u32));
            let patches = self.table[usize::from(cell.inside)];
            for patch in (0..patches.count).filter(|_| cell.is_known) {
                let of = (0..12).filter(|e| cell::is_crossed(cell.inside, *e) && patches.of_edge[*e] == patch);
                vertices.push(Vertex { cell: [cell.x, cell.y, z as u32], edges: of.fold(0, |bits, e| bits | 1 << e) });
            }
        }
        layer
    }

    /// Adds the vertices on the faces of a layer's cells, and on those between it and the layer before.
    fn face_vertices(&mut self, z: usize, before: &Layer, layer: &Layer, begin: usize, vertices: &mut Vec<Vertex>) {
        for (here, _) in layer.iter().filter(|(here, _)| here.is_known) {
            let faces = [
                here.x.checked_sub(1).and_then(|x| found(layer, x, here.y)),
                here.y.checked_sub(1).and_then(|y| found(layer, here.x, y)),
                found(before, here.x, here.y),
            ];
            for (normal, other) in faces.into_iter().enumerate() {
                let Some((other, _)) = other.filter(|(other, _)| other.is_known) else { continue };
                if !self.is_doubled(&other, here, normal) {
                    continue;
                }
                for edge in cell::edges_of_face(normal, 0) {
                    let partner = cell::partner(here.inside, normal, 0, edge);
                    // Each pair once.
                    if partner < edge {
                        continue;
                    }
                    let cell = [here.x, here.y, z as u32];
                    let arc = arc(cell.map(|n| n as usize), here.inside, normal, 0, edge);
                    self.on_faces.insert(arc, (begin + vertices.len()) as u32);
                    vertices.push(Vertex { cell, edges: 1 << edge | 1 << partner });
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

    /// Makes the polygons around the edges in slice z and of those from it to the next. `layers`: of cells before the slice and behind it.
    fn polygons(&mut self, z: usize, before: &Layer, behind: &Layer) {
        // Row, column and axis of each crossed edge, and whether its first end is inside. Several cells have the same edge.
        let mut edges: Vec<(u32, u32, usize, bool)> = Vec::new();
        for (side, (cell, _)) in before.iter().map(|c| (1, c)).chain(behind.iter().map(|c| (0, c))) {
            for edge in (0..12).filter(|edge| cell::is_crossed(cell.inside, *edge)) {
                let (axis, [low, _]) = (edge / 4, cell::corners_of(edge));
                // Edges between slices belong to the layer behind.
                if low >> 2 == side && (axis < 2 || side == 0) {
                    let [x, y] = [cell.x + (low & 1) as u32, cell.y + (low >> 1 & 1) as u32];
                    edges.push((y, x, axis, cell.inside >> low & 1 == 1));
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        for (y, x, axis, inside) in edges {
            self.polygon(axis, [x as usize, y as usize, z], inside, [before, behind]);
        }
    }

    /// The cell that begins one voxel before another or at it, along each axis.
    fn cell_at(&self, [x, y, _]: [usize; 3], before: [usize; 3], [last, next]: [&Layer; 2]) -> Option<(Cell, u32)> {
        let (x, y) = (x.checked_sub(before[0])?, y.checked_sub(before[1])?);
        let layer = if before[2] == 1 { last } else { next };
        found(layer, x as u32, y as u32).filter(|(cell, _)| cell.is_known)
    }

    /// The polygon around the edge from a voxel along `axis`, whose first end is inside or not.
    fn polygon(&mut self, axis: usize, voxel: [usize; 3], inside: bool, layers: [&Layer; 2]) {
        let axes = [(axis + 1) % 3, (axis + 2) % 3];
        // Steps back along both other axes: anticlockwise as seen from where the edge points to.
        const AROUND: [[usize; 2]; 4] = [[1, 1], [0, 1], [0, 0], [1, 0]];
        let mut around = [(Cell { x: 0, y: 0, inside: 0, is_known: false }, 0, [0; 3], 0); 4];
        for (target, back) in around.iter_mut().zip(AROUND) {
            let mut before = [0; 3];
            (before[axes[0]], before[axes[1]]) = (back[0], back[1]);
            let Some((cell, first)) = self.cell_at(voxel, before, layers) else {
                self.mesh.open_edges += 1;
                return;
            };
            // In a cell that begins before the edge, it lies on the far side.
            *target = (cell, first, before, cell::edge_at(axis, back[0], back[1]));
        }
        let (mut corners, mut on_face) = (Vec::with_capacity(8), None);
        for n in 0..4 {
            let ((cell, first, before, edge), (other, _, other_before, _)) = (around[n], around[(n + 1) % 4]);
            let patch = self.table[usize::from(cell.inside)].of_edge[edge];
            corners.push(first + u32::from(patch));
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

fn too_many() -> String {
    format!("makes more than {MAX_TRIANGLES} triangles; take a larger spacing or another threshold")
}

/// The cell of a layer at this place.
fn found(layer: &Layer, x: u32, y: u32) -> Option<(Cell, u32)> {
    let at = layer.binary_search_by_key(&(y, x), |(cell, _)| (cell.y, cell.x));
    at.ok().map(|n| layer[n])
}

/// The pair that an edge belongs to on an ambiguous face of the cell that begins at `start`.
fn arc(start: [usize; 3], inside: u8, normal: usize, side: usize, edge: usize) -> Arc {
    let mut face = start;
    face[normal] += side;
    let ends = cell::corners_of(edge);
    let cut_off = if inside >> ends[0] & 1 == 1 { ends[0] } else { ends[1] };
    Arc { face, normal, inside: [0, 1, 2].map(|axis| start[axis] + (cut_off >> axis & 1)) }
}
